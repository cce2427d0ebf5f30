"""Files that hold f as a function of two directions: its values on a grid about the specular direction."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt

from etendue.formats.bsdf.bsdf_format import Tabulated
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

Array = npt.NDArray[np.float64]

RADIAL = np.concatenate(
    [
        [0.0],
        np.geomspace(0.05, 2.0, 14),
        np.arange(2.5, 10.0, 0.5),
        np.arange(10.0, 40.0, 1.0),
        np.arange(40.0, 181.0, 2.5),
    ]
)
"""Angles from the specular direction [°]."""

AZIMUTH_STEP = 5.0

RIM = 1e-7
"""Height at which f along the surface is taken: rounding leaves such directions on either side of it, up to `GRAZING`."""


def values_on(
    grid: PolarGrid, bsdf: Tabulated, incident: Array, *, transmitted: bool, wavelength: float | None = None
) -> Array:
    """F [1/sr] on a grid about the specular direction: along the surface as just above it, 0 beyond the hemisphere.

    Parameters
    ----------
    grid : PolarGrid
        In angles or direction cosines.
    bsdf : Tabulated
        What is asked.
    incident : array, shape (3,)
        Unit vector to where the light comes from.
    transmitted : bool
        Whether the light passes to the other side.
    wavelength : float, optional
        In nm.

    Returns
    -------
    array, of the shape of the grid
    """
    side = 1.0 if (incident[2] > 0.0) != transmitted else -1.0

    def above(to: Array) -> Array:
        to[:, 2] = side * np.maximum(side * to[:, 2], RIM)
        return bsdf.evaluate(incident, to / np.linalg.norm(to, axis=-1, keepdims=True), wavelength=wavelength)

    return _filled(grid, incident, above, transmitted=transmitted, beyond=0.0)


def _filled(
    grid: PolarGrid, incident: Array, values_at: Callable[[Array], Array], *, transmitted: bool, beyond: float
) -> Array:
    """Values of a function of directions, shape (n, 3), on a grid; `beyond` where it reaches beyond the hemisphere."""
    scattered = grid.directions(incident, transmitted=transmitted)
    there = ~np.isnan(scattered[..., 0])
    values = np.full(grid.shape, beyond)
    values[there] = values_at(scattered[there])
    return values


def sampled(
    evaluate: Callable[[Array, Array], Array],
    incidences: Iterable[tuple[float, float]],
    *,
    transmitted: bool = False,
    wavelength: float | None = None,
) -> list[BsdfSlice]:
    """A slice for each incidence.

    Parameters
    ----------
    evaluate : callable
        f [1/sr] for pairs of unit vectors away from the surface, shapes (n, 3); NaN where nothing is known.
    incidences : sequence of (θ, φ)
        In degrees, of light that meets the front.
    transmitted : bool
        Whether the light passes to the other side.
    wavelength : float, optional
        In nm.

    Returns
    -------
    list of BsdfSlice
        On grids about the specular direction, as far as there is a hemisphere.
    """
    found = []
    grid = PolarGrid("specular", RADIAL, np.arange(0.0, 360.0, AZIMUTH_STEP))
    for theta, phi in incidences:
        incident = light_from(theta, phi)

        def known(to: Array, incident: Array = incident) -> Array:
            return evaluate(np.broadcast_to(incident, to.shape), to)

        values = _filled(grid, incident, known, transmitted=transmitted, beyond=np.nan)
        found.append(BsdfSlice(incident, values, transmitted, grid=grid, wavelength=wavelength))
    return found
