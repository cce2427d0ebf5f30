"""Coordinates of Harvey and Shack: |β − β₀| and its azimuth; thesis eqs. A.4 to A.17, B.1 and B.2.

The azimuth counts from x′ = z × i, which stands at right angles to the plane of incidence; the specular direction moves
towards +90°. Where light comes along the normal, x′ is x. The thesis prints φ + π for azimuths of 180° and more (A.6, A.17),
which is right only at 180 and 270°; it is 2π − φ. B.1 and B.2 take φ for the azimuth of β, not of β − β₀.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def axes(incident: npt.ArrayLike) -> tuple[Array, Array]:
    """x′ and y′ in the plane of the surface, shape (2,) each: eq. A.13, and its limit where that is 0/0.

    Examples
    --------
    >>> [v.tolist() for v in axes([-0.6, 0.0, 0.8])]
    [[-0.0, -1.0], [1.0, -0.0]]
    """
    i = np.asarray(incident, np.float64)
    across = float(np.hypot(i[0], i[1]))
    if across == 0.0:
        return np.array([1.0, 0.0]), np.array([0.0, 1.0])
    return np.array([-i[1], i[0]]) / across, np.array([-i[0], -i[1]]) / across


def coordinates(incident: npt.ArrayLike, scattered: npt.ArrayLike) -> tuple[Array, Array]:
    """|β − β₀| and the azimuth [°], 0 to 360, of directions of shape (…, 3): eqs. A.10 and A.17.

    Examples
    --------
    >>> r, a = coordinates([-0.6, 0.0, 0.8], [0.9, 0.0, 0.19**0.5])
    >>> round(float(r), 6), round(float(a), 6)
    (0.3, 90.0)
    """
    x, y = axes(incident)
    off = np.asarray(scattered, np.float64)[..., :2] + np.asarray(incident, np.float64)[:2]
    azimuth = np.degrees(np.arctan2(off @ y, off @ x)) % 360.0
    return np.asarray(np.hypot(off[..., 0], off[..., 1])), np.asarray(azimuth)


def directions(incident: npt.ArrayLike, radial: npt.ArrayLike, azimuth: npt.ArrayLike) -> Array:
    """The reflected directions at coordinates, shape (…, 3); NaN beyond `farthest`.

    Examples
    --------
    >>> directions([-0.6, 0.0, 0.8], 0.0, 0.0).tolist()
    [0.6, -0.0, 0.8]
    """
    x, y = axes(incident)
    r, a = np.broadcast_arrays(np.asarray(radial, np.float64), np.radians(azimuth))
    i = np.asarray(incident, np.float64)
    beta = r[..., None] * (np.cos(a)[..., None] * x + np.sin(a)[..., None] * y) - i[:2]
    with np.errstate(invalid="ignore"):
        height = np.copysign(np.sqrt(1.0 - np.sum(beta * beta, axis=-1)), i[2])
    found = np.concatenate([beta, height[..., None]], axis=-1)
    found[np.isnan(height)] = np.nan
    return found


def farthest(theta: float, azimuth: npt.ArrayLike) -> Array:
    """The largest |β − β₀| of a direction at an angle of incidence [°], by azimuth [°]: B.2, mended.

    −sin θ sin φ + √(1 − sin²θ cos²φ), from |β₀ + r u| = 1.

    Examples
    --------
    >>> farthest(60.0, [0.0, 90.0]).round(3).tolist()
    [0.5, 0.134]
    """
    a, s = np.radians(azimuth), np.sin(np.radians(theta))
    return np.asarray(-s * np.sin(a) + np.sqrt(1.0 - (s * np.cos(a)) ** 2))
