"""Total scatter of a lobe of which one scan is known: rings about the regular direction, in direction cosines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from etendue.instruments.positions import Plane, detector_directions

Array = npt.NDArray[np.float64]

FINE = 16
"""Parts of a step between positions in which the rings are added up."""


def sum_of_rings(angle: Array, flux: Callable[[Array], Array], incidence: float, plane: Plane) -> float:
    """∫ f cosθ dΩ of a lobe that is as wide in direction cosines as the scan shows it: ∫ f dβ over rings about β₀.

    Scans in the plane of incidence show a lobe on both sides of the specular direction: between them f at the same |β − β₀|
    is linear in the azimuth about it, as in tables of such scans (Harvey and Shack: polished and rough surfaces scatter
    alike all around in direction cosines). Scans at right angles to it show the mean of both. Beyond the end of one side
    the other stands for the whole ring, and beyond both there is nothing. Only the part of a ring counts that is above the
    horizon. At normal incidence this is π ∫ f cosθ |sin θ| dθ, eq. 5.2.

    Parameters
    ----------
    angle : array, shape (n,)
        Positions [°], increasing.
    flux : callable
        f |cosθₛ| at angles [°] between the first and the last position.
    incidence : float
        [°]
    plane : {"in-plane", "cross-plane"}
        Which the detector moved in.

    Examples
    --------
    >>> angle = np.linspace(-90.0, 90.0, 181)
    >>> even = lambda a: np.cos(np.radians(a)) / np.pi
    >>> [round(sum_of_rings(angle, even, incidence, "in-plane"), 3) for incidence in (0.0, 60.0)]
    [1.0, 1.0]
    """
    if angle.size < 2:
        return 0.0
    inner = np.arange(FINE) / FINE
    x = np.append((angle[:-1, None] + np.diff(angle)[:, None] * inner).ravel(), angle[-1])
    sine = float(np.sin(np.radians(incidence)))
    beta = detector_directions(x, incidence, plane, behind=False)[:, :2] - np.array([sine, 0.0])
    r = np.hypot(beta[:, 0], beta[:, 1])
    onwards = x > (incidence if plane == "in-plane" else 0.0)
    # Half of the azimuths about β₀ at which a ring is above the horizon, from the side of the normal on.
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = np.where(sine * r > 0.0, (1.0 - sine**2 - r * r) / (2.0 * sine * r), 1.0)
    half = np.pi - np.arccos(np.clip(cosine, -1.0, 1.0))
    reach = [float(r[side].max(initial=0.0)) for side in (onwards, ~onwards)]
    both = r <= min(reach)
    part = half
    if plane == "in-plane":
        part = np.where(onwards, half * half / np.pi, 2.0 * half - half * half / np.pi)
    part = np.where(both, part, 2.0 * half)
    values = flux(x) * part
    # Between positions r is smooth but for the regular direction itself, where it is 0.
    if plane == "in-plane":
        # f dβ = f r dr = f cosθ r dθ.
        return float(np.trapezoid(values * r, np.radians(x)))
    # f cosθₛ over the cosine of the turn and that of the incidence, times r dr.
    a = np.radians(x)
    step = np.abs(np.sin(a)) * (sine**2 * (1.0 - np.cos(a)) + np.cos(a))
    cosine_of = np.maximum(np.cos(a) * np.cos(np.radians(incidence)), 1e-9)
    return float(np.trapezoid(values / cosine_of * step, a))
