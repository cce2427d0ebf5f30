"""Where a source looks, and how it is turned so that it looks towards +Z."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from etendue.lightfield.counting import FloatArray

FLAT = 1e-4
"""Thickness, against the extent, up to which start points lie in a plane: single precision and what tools round."""


class Turn(NamedTuple):
    """A rotation about an axis through the origin, right-handed: as `etendue.RaySet.rotated` takes it.

    Examples
    --------
    >>> Turn((0.0, -1.0, 0.0), 40.0).told, Turn((0.0, -1.0, 0.0), 40.0).option
    ('rays.rotated((0, -1, 0), 40)', 'etendue convert --rotate 0,-1,0,40')
    """

    axis: tuple[float, float, float]
    angle: float

    @property
    def told(self) -> str:
        """The call in Python, to six digits."""
        return f"rays.rotated(({', '.join(self._axis)}), {self.angle:.6g})"

    @property
    def option(self) -> str:
        """The option of the command line, likewise."""
        return f"etendue convert --rotate {','.join(self._axis)},{self.angle:.6g}"

    @property
    def _axis(self) -> list[str]:
        return [f"{round(value, 6) + 0.0:.6g}" for value in self.axis]


def mean_direction(direction: FloatArray, flux: FloatArray) -> FloatArray:
    """Flux-weighted mean of unit vectors, shape (3,): shorter than 1 by how far they spread.

    Examples
    --------
    >>> mean_direction(np.array([[0.0, 0.6, 0.8], [0.0, -0.6, 0.8]]), np.ones(2)).tolist()
    [0.0, 0.0, 0.8]
    """
    mean: FloatArray = np.average(direction, weights=flux, axis=0)
    return mean


def start_normal(position: FloatArray, towards: FloatArray) -> FloatArray | None:
    """The normal of the plane on which rays start, on the side of their mean direction; None if they start on none.

    Parameters
    ----------
    position : array, shape (n, 3)
        Start points [mm].
    towards : array, shape (3,)
        The mean direction, of any length.

    Examples
    --------
    >>> corners = np.array([[0, 0, 0], [1, 0, 1], [0, 1, 0], [1, 1, 1]], dtype=float)
    >>> (start_normal(corners, np.array([-1.0, 0.0, 1.0])) * 2**0.5).round(9).tolist()
    [-1.0, 0.0, 1.0]
    """
    away = position - position.mean(axis=0)
    extents, axes = np.linalg.eigh(away.T @ away)
    # Of a line or a point there is no one plane.
    if not extents[0] <= FLAT**2 * extents[1]:
        return None
    normal: FloatArray = axes[:, 0]
    return normal if normal @ towards > 0 else -normal


def turn_upright(front: FloatArray) -> Turn:
    """The shortest rotation that takes a unit vector to +Z; from -Z about X.

    Examples
    --------
    >>> turn_upright(np.array([0.6, 0.0, 0.8])).axis, turn_upright(np.array([0.0, 0.0, -1.0]))
    ((0.0, -1.0, 0.0), Turn(axis=(1.0, 0.0, 0.0), angle=180.0))
    """
    x, y, z = (float(value) for value in front)
    across = math.hypot(x, y)
    axis = (y / across, -x / across, 0.0) if across > 0.0 else (1.0, 0.0, 0.0)
    return Turn(axis, math.degrees(math.atan2(across, z)))
