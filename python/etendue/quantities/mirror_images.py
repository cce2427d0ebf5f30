"""Slices of samples that are their own mirror image in the plane of incidence: their other half, and whether they are."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

Array = npt.NDArray[np.float64]

SAME = 1e-6
"""Azimuths that differ by less are one [°]."""


def unfolded(one: BsdfSlice) -> BsdfSlice:
    """A slice whose azimuths lie on one side of the plane of incidence alone, with the mirror image of these on the other.

    Others are returned as they are.

    Parameters
    ----------
    one : BsdfSlice
        Of a sample that is its own mirror image.

    Examples
    --------
    >>> from etendue.quantities.bsdf_directions import light_from
    >>> grid = PolarGrid("normal", [0.0, 90.0], [0.0, 90.0, 180.0])
    >>> half = BsdfSlice(light_from(30.0, 180.0), [[0.1, 0.1], [0.3, 0.3], [0.2, 0.2]], grid=grid)
    >>> whole = unfolded(half)
    >>> whole.grid.azimuth.tolist(), whole.values[:, 0].tolist()
    ([0.0, 90.0, 180.0, 270.0], [0.1, 0.3, 0.2, 0.3])
    """
    grid = one.grid
    if grid is None or grid.azimuth.size < 2:
        return one
    onward = one.phi + 180.0 if grid.frame == "normal" else 0.0
    start = onward + 360.0 * np.floor((grid.azimuth[0] - onward + SAME) / 360.0)
    beside = grid.azimuth - start
    inner = (np.abs(beside) > SAME) & (np.abs(beside - 180.0) > SAME) & (np.abs(beside - 360.0) > SAME)
    if beside.max() <= 180.0 + SAME:
        image, order = start + 360.0 - beside[inner][::-1], slice(None)
    elif beside.min() >= 180.0 - SAME and beside.max() <= 360.0 + SAME:
        image, order = start + 360.0 - beside[inner][::-1], slice(None, None, -1)
    else:
        return one

    def both(values: Array) -> Array:
        return np.concatenate([values, values[inner][::-1]][order])

    return dataclasses.replace(
        one,
        values=both(one.values),
        grid=PolarGrid(grid.frame, grid.radial, np.concatenate([grid.azimuth, image][order])),
        standard_error=None if one.standard_error is None else both(one.standard_error),
    )


def unlike_its_image(one: BsdfSlice) -> float:
    """The part of its light by which a slice differs from its mirror image in the plane of incidence.

    Parameters
    ----------
    one : BsdfSlice
        Of single points: 0, as these have no image among themselves.

    Examples
    --------
    >>> from etendue.quantities.bsdf_directions import light_from
    >>> grid = PolarGrid("normal", [1.0, 90.0], [0.0, 90.0, 180.0, 270.0])
    >>> one = BsdfSlice(light_from(30.0, 180.0), [[0.2, 0.2], [0.3, 0.3], [0.2, 0.2], [0.1, 0.1]], grid=grid)
    >>> round(unlike_its_image(one), 2)
    0.25
    """
    light = one.integral() if one.grid is not None else 0.0
    if one.grid is None or not light > 0.0:
        return 0.0
    across = np.array([-one.incident[1], one.incident[0], 0.0])
    length = float(np.hypot(across[0], across[1]))
    # Along the normal any plane is one of incidence; the azimuth of light along the normal counts as 0.
    across = across / length if length > 0.0 else np.array([0.0, 1.0, 0.0])
    to = one.directions
    there = ~np.isnan(to[..., 0])
    apart = np.zeros(one.values.shape)
    apart[there] = np.abs(one.held[there] - one.at(to[there] - 2.0 * (to[there] @ across)[:, None] * across))
    return 0.5 * dataclasses.replace(one, values=apart, standard_error=None).integral() / light
