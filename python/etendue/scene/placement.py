"""Where things stand and which way they point."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt
from pydantic import model_validator

from etendue.description.keys import Description
from etendue.description.values import Number, Point, Vector
from etendue.quantities.observer import cos_sin_degrees
from etendue.quantities.vectors import shortest_rotation, unit

Array = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Frame:
    """A right-handed orthonormal frame: local coordinates p stand for the point ``origin + axes @ p``.

    Parameters
    ----------
    origin : array, shape (3,)
        [mm]
    axes : array, shape (3, 3)
        The columns are the images of local x, y and z.

    Examples
    --------
    >>> Frame.along((0, 0, 5), (2, 0, 0), (0, 0, -1)).record()
    [0.0, 0.0, 5.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0]
    """

    origin: Array
    axes: Array

    def record(self) -> list[float]:
        """Origin, x, y and z axis as 12 numbers."""
        return [*self.origin.tolist(), *self.axes.T.ravel().tolist()]

    @classmethod
    def along(cls, origin: npt.ArrayLike, x: npt.ArrayLike, z: npt.ArrayLike) -> Frame:
        """The frame with a given x axis and a given z axis perpendicular to it, of any length."""
        unit_x, unit_z = unit(x), unit(z)
        axes = np.stack([unit_x, np.cross(unit_z, unit_x), unit_z], axis=1)
        return cls(np.array(origin, dtype=np.float64), axes)

    @classmethod
    def shifted(cls, x: float, y: float, z: float) -> Frame:
        """Parallel to the outer frame."""
        return cls(np.array([x, y, z], dtype=np.float64), np.eye(3))


UPRIGHT = np.eye(3)
"""The axes of what is not turned."""
UPRIGHT.flags.writeable = False  # thousands of solids share it

HERE = Frame.shifted(0.0, 0.0, 0.0)
"""The outer frame itself."""


class Placement(Description):
    """Where a thing stands: `at`, and one way of saying how it is turned.

    Parameters
    ----------
    at : 3 numbers
        Where the local origin comes to stand [mm].
    toward : 3 numbers, optional
        The direction in which local +Z comes to point, of any length; by the shortest rotation, as observers turn their
        screens. Straight down, which is the end of many shortest rotations, it is half a turn about Y.
    axis, angle : 3 numbers and a number, optional
        A turn by `angle` [°] about `axis` through the local origin, counter-clockwise seen against the axis.
    rotation : 3 numbers, optional
        Turns [°] about the fixed world axes X, then Y, then Z.
    spin : number
        A turn [°] about local +Z before all others.

    Raises
    ------
    SceneError
        If more than one way is used, an axis has no length, or an axis has no angle.

    Examples
    --------
    >>> Placement(at=(0, 0, 9), toward=(1, 0, 0)).frame().record()
    [0.0, 0.0, 9.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]
    """

    INSTEAD: ClassVar[Mapping[str, str]] = MappingProxyType({
        "position": "at = {}",
        "normal": "toward = {}",
        "direction": "toward = {}",
    })  # fmt: skip

    at: Point = (0.0, 0.0, 0.0)
    toward: Vector | None = None
    axis: Vector | None = None
    angle: Number | None = None
    rotation: Vector | None = None
    spin: Number = 0.0

    @model_validator(mode="after")
    def _one_way_of_turning(self) -> Self:
        if self.toward is None and self.axis is None and self.rotation is None and self.angle is None:
            return self
        ways = [name for name in ("toward", "axis", "rotation") if getattr(self, name) is not None]
        if len(ways) > 1:
            raise ValueError(f"is turned by {' and '.join(repr(w) for w in ways)}; use one of them")
        if (self.axis is None) != (self.angle is None):
            raise ValueError("'axis' and 'angle' belong together: give both or neither")
        for name in ("toward", "axis"):
            value = getattr(self, name)
            if value is not None and not 0.0 < math.hypot(*value) < math.inf:
                raise ValueError(f"{name!r} is {list(value)}, which is no direction")
        return self

    def frame(self) -> Frame:
        """Local coordinates in the world."""
        axes = UPRIGHT
        if self.toward is not None:
            axes = shortest_rotation(self.toward)
        elif self.axis is not None and self.angle is not None:
            axes = _turn(np.asarray(self.axis), self.angle)
        elif self.rotation is not None:
            x, y, z = (_turn(axis, angle) for axis, angle in zip(np.eye(3), self.rotation, strict=True))
            axes = z @ y @ x
        if self.spin:
            axes = axes @ _turn(np.array([0.0, 0.0, 1.0]), self.spin)
        # Adding 0 turns the -0 of exact quarter turns into 0.
        return Frame(np.asarray(self.at), axes if axes is UPRIGHT else axes + 0.0)


def _turn(axis: Array, angle: float) -> Array:
    """Rodrigues' formula; exact about the coordinate axes at quarter turns."""
    c, s = cos_sin_degrees(angle)
    x, y, z = unit(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # 1 + s K + (1 - c) K² with K² = u uᵀ - 1, in a form that keeps the axis exactly.
    outer = np.outer((x, y, z), (x, y, z))
    turned: Array = outer + c * (np.eye(3) - outer) + s * cross
    return turned
