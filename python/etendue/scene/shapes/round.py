"""Round shapes that need no lens maker: spheres, cylinders, cones. Their normals point away from the axis or centre."""

from __future__ import annotations

import abc
import math
from typing import Any, Literal, Self

from pydantic import model_validator

from etendue.description.files import Files
from etendue.description.values import Length, LengthOrZero
from etendue.errors import ArgumentError
from etendue.scene.shapes.shape import UNBOUNDED, Record, Shape, Sheet, Trim, overlap

ALL_RADII = (0.0, math.inf)


def quadric(
    r2: float,
    z2: float,
    z1: float,
    z0: float,
    *,
    z: tuple[float, float] = UNBOUNDED,
    r: tuple[float, float] = ALL_RADII,
) -> Record:
    """r2 (x² + y²) + z2 z² + z1 z + z0 = 0 within ranges of z and of the distance r from the axis.

    The normal is the gradient.

    Examples
    --------
    >>> quadric(1.0, 1.0, 0.0, -4.0)["z"]
    (-inf, inf)
    """
    return {"kind": "quadric", "r2": r2, "z2": z2, "z1": z1, "z0": z0, "z": z, "r": r}


def trimmed_quadric(record: Record, trim: Trim) -> Sheet:
    """A quadric within a trim.

    Raises
    ------
    ArgumentError
        If the ranges have nothing in common.

    Examples
    --------
    >>> trimmed_quadric(quadric(1.0, 1.0, 0.0, -4.0), Trim(z=(0, 9))).shape["z"]
    (0.0, 9.0)
    """
    z, r = overlap(record["z"], trim.z), overlap(record["r"], trim.radius)
    for name, (low, high) in (("z", z), ("radius", r)):
        if not low < high:
            raise ArgumentError(f"trim.{name}: nothing is left of the surface")
    return Sheet({**record, "z": z, "r": r}, trim.planes())


class Quadric(Shape, abc.ABC):
    """What shapes with one quadric equation share."""

    @abc.abstractmethod
    def quadric(self) -> Record:
        """The equation and its own ranges."""

    def sheet(self, trim: Trim, files: Files) -> Sheet:  # noqa: ARG002 - other shapes come from files
        """The quadric; ranges of the trim narrow its own."""
        return trimmed_quadric(self.quadric(), trim)


class Sphere(Quadric):
    """A sphere around the origin; its normal points outwards.

    Parameters
    ----------
    radius : number
        [mm], > 0.

    Examples
    --------
    >>> Sphere(radius=2).quadric()["z0"]
    -4.0
    """

    kind: Literal["sphere"] = "sphere"
    radius: Length

    def quadric(self) -> Record:
        """X² + y² + z² = R²."""
        return quadric(1.0, 1.0, 0.0, -(self.radius**2))


class Hemisphere(Quadric):
    """The half z ≥ 0 of a sphere around the origin; its normal points outwards.

    Parameters
    ----------
    radius : number
        [mm], > 0.

    Examples
    --------
    >>> Hemisphere(radius=2).quadric()["z"]
    (0.0, inf)
    """

    kind: Literal["hemisphere"] = "hemisphere"
    radius: Length

    def quadric(self) -> Record:
        """X² + y² + z² = R², z ≥ 0."""
        return quadric(1.0, 1.0, 0.0, -(self.radius**2), z=(0.0, math.inf))


class Cylinder(Quadric):
    """The side of a cylinder about the z axis, from z = 0 up; its normal points away from the axis.

    Parameters
    ----------
    radius, height : number
        [mm], > 0.

    Examples
    --------
    >>> Cylinder(radius=2, height=5).quadric()["z"]
    (0.0, 5.0)
    """

    kind: Literal["cylinder"] = "cylinder"
    radius: Length
    height: Length

    def quadric(self) -> Record:
        """X² + y² = R², 0 ≤ z ≤ h."""
        return quadric(1.0, 0.0, 0.0, -(self.radius**2), z=(0.0, self.height))


class Cone(Quadric):
    """The side of a cone or of a frustum about the z axis, from z = 0 up; its normal points away from the axis.

    Parameters
    ----------
    radius_bottom, radius_top : number
        At z = 0 and at z = `height` [mm], ≥ 0, not both 0.
    height : number
        [mm], > 0.

    Examples
    --------
    >>> Cone(radius_bottom=0, radius_top=3, height=3).quadric()["z2"]
    -1.0
    """

    kind: Literal["cone"] = "cone"
    radius_bottom: LengthOrZero
    radius_top: LengthOrZero
    height: Length

    @model_validator(mode="after")
    def _has_a_width(self) -> Self:
        if self.radius_bottom == self.radius_top == 0.0:
            raise ValueError("'radius_bottom' and 'radius_top' are both 0; a cone has a width at one end")
        return self

    def quadric(self) -> Record:
        """X² + y² = (r₀ + m z)² with m = (r₁ - r₀)/h; the range of z keeps one nappe."""
        m = (self.radius_top - self.radius_bottom) / self.height
        r0 = self.radius_bottom
        return quadric(1.0, -m * m, -2.0 * m * r0, -r0 * r0, z=(0.0, self.height))


ROUND: dict[str, type[Any]] = {cls.model_fields["kind"].default: cls for cls in (Sphere, Hemisphere, Cylinder, Cone)}
"""Round shapes by kind."""
