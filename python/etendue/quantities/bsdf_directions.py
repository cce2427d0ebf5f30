"""Directions of light in the frame of a surface: to where it comes from, and to where it goes.

**Frame.** Directions are unit vectors in the frame of the surface, +z being the normal of its front. They point *away* from
the surface: `incident` to where light comes from, scattered ones to where it goes. Light meets the front if the third
component of `incident` is positive, and is reflected if both have the same sign.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

NORMAL = 1e-4
"""Angles of incidence [°] below which light comes along the normal, and from no azimuth."""

LEAN = 1e-100
"""Sine of the angle of light that comes along the normal and keeps an azimuth: its square is still a number that is not 0
(they begin at 1e-308), and the cosine beside it is 1 exactly."""


def direction(theta: npt.ArrayLike, phi: npt.ArrayLike, *, behind: bool = False) -> Array:
    """Unit vectors at angles θ [°] from the normal of a side and azimuths φ [°] from +x towards +y.

    Parameters
    ----------
    theta, phi : array_like
        Shapes that broadcast.
    behind : bool
        About −z instead of +z; the azimuth is the same.

    Returns
    -------
    array, shape (…, 3)

    Examples
    --------
    >>> direction(30.0, 90.0).round(3).tolist()
    [0.0, 0.5, 0.866]
    """
    t, p = np.broadcast_arrays(np.radians(theta), np.radians(phi))
    height = -np.cos(t) if behind else np.cos(t)
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), height], axis=-1)


def light_from(theta: float, phi: float, *, behind: bool = False) -> Array:
    """To where light comes from at an angle θ [°] from the normal of a side and an azimuth φ [°], also along the normal.

    There light comes from no azimuth, but what a file says of it counts from the plane of incidence in which it was
    measured. So the direction leans towards φ, by `LEAN`, which is lost in any sum.

    Parameters
    ----------
    theta, phi : float
        As of `direction`, of one direction.
    behind : bool
        Whether the light meets the back.

    Returns
    -------
    array, shape (3,)

    Examples
    --------
    >>> from etendue.quantities.bsdf_slice import BsdfSlice
    >>> from etendue.quantities.polar_grid import PolarGrid
    >>> grid = PolarGrid("specular", [0.0, 90.0], [0.0])
    >>> one, other = (BsdfSlice(light_from(0.0, phi), [[0.1, 0.1]], grid=grid) for phi in (90.0, 180.0))
    >>> one.theta, one.phi, other.phi
    (0.0, 90.0, 180.0)
    """
    found = direction(theta, phi, behind=behind)
    if not found[:2].any():
        found[:2] = LEAN * np.cos(np.radians(phi)), LEAN * np.sin(np.radians(phi))
    return found


def mirrored(incident: npt.ArrayLike) -> Array:
    """The specular direction of reflection of `incident`, shape (…, 3).

    Examples
    --------
    >>> mirrored([0.6, 0.0, 0.8]).tolist()
    [-0.6, -0.0, 0.8]
    """
    return np.asarray(incident, np.float64) * [-1.0, -1.0, 1.0]
