"""The flux in an aperture by quadrature over the lines of sight between beam and aperture."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.instruments.bench import Bench
from etendue.quantities.bsdf_directions import direction
from etendue.scatter.bsdf import Bsdf

Array = npt.NDArray[np.float64]

FINENESS = ((4, 8), (5, 11), (7, 15), (10, 21), (14, 30))
"""Nodes across beam and aperture: the next are tried where two differ by more than `RESOLVED`."""

RESOLVED = 2e-4
"""Of the largest flux of a scan: quadratures that differ by less agree."""


def integrated_flux(
    bench: Bench, bsdf: Bsdf, arms: Array, *, theta: float, wavelength: float, behind: bool
) -> tuple[Array, Array]:
    """Share of the beam in the aperture at each position, and by how much a coarser quadrature differs; shapes (k,).

    A lobe that is narrow beside beam and aperture falls between few nodes, so that their number grows where two
    quadratures differ. What goes on in a single direction is added in closed form.

    Parameters
    ----------
    bench : Bench
        Beam, aperture and distance.
    bsdf : Bsdf
        Of the sample.
    arms : array, shape (k, 3)
        Positions.
    theta, wavelength : number
        Angle of incidence [°], and in nm.
    behind : bool
        Whether light is measured that goes to the other side.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer = et.ScatterGoniometer(5, 5, 500)
    >>> paint = et.bsdf.Lambertian(reflectance=1.0)
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> flux, _ = integrated_flux(goniometer.bench, paint, up, theta=0.0, wavelength=550.0, behind=False)
    >>> round(float(flux[0]) / goniometer.solid_angle * np.pi, 3)
    1.0
    """

    def at(chosen: Array, beam: int, aperture: int) -> Array:
        found = np.zeros(len(chosen))
        for sight in bench.sights(chosen, theta, beam, aperture):
            lit, incident = sight.weights > 0.0, sight.incident[None, :, None]
            if lit.all():
                f = bsdf.evaluate(incident, sight.scattered, wavelength=wavelength)
            else:
                f = np.zeros(lit.shape)
                each = np.broadcast_to(incident, sight.scattered.shape)[lit]
                f[lit] = bsdf.evaluate(each, sight.scattered[lit], wavelength=wavelength)
            found[sight.positions] = np.einsum("ibn,ibn->i", f, sight.weights)
        return found

    coarse, fine = (at(arms, *nodes) for nodes in FINENESS[:2])
    for k, nodes in enumerate(FINENESS[2:]):
        unsure = np.abs(fine - coarse) > RESOLVED * fine.max()
        if not unsure.any():
            break
        if k == 0:
            # Two coarse ones may agree by chance.
            unsure = np.maximum(fine, coarse) > 0.1 * RESOLVED * fine.max()
        coarse[unsure], fine[unsure] = fine[unsure], at(arms[unsure], *nodes)
    regular = bsdf.regular_transmittance if behind else bsdf.regular_reflectance
    straight = float(regular(theta, wavelength=wavelength))
    bare = straight * bench.bare(arms, direction(theta, 0.0, behind=behind)) if straight > 0.0 else 0.0
    return fine + bare, np.abs(fine - coarse)
