"""Flat shapes: the plane z = 0 within an outline, with its normal along +z."""

from __future__ import annotations

import abc
import math
from typing import Any, Literal, Self

import numpy as np
from pydantic import model_validator

from etendue.description.files import Files
from etendue.description.values import Length, LengthOrZero, Vertices
from etendue.errors import ArgumentError
from etendue.scene.shapes.outline import signed_area, simple_polygon
from etendue.scene.shapes.shape import Record, Shape, Sheet, Trim, overlap


class Flat(Shape, abc.ABC):
    """What flat shapes share: an outline in the plane z = 0."""

    @abc.abstractmethod
    def outline(self) -> Record:
        """The outline as the core takes it."""

    def sheet(self, trim: Trim, files: Files) -> Sheet:  # noqa: ARG002 - other shapes come from files
        """The flat shape within the trim; a range of radii needs a round outline, or none."""
        outline = self.outline()
        if trim.radius is not None:
            outline = self._ring(outline, trim.radius)
        return Sheet({"kind": "flat", "outline": outline}, [*trim.planes(), *trim.planes_of_z()])

    def _ring(self, outline: Record, radius: tuple[float, float]) -> Record:
        if outline["kind"] not in ("whole", "annulus"):
            raise ArgumentError("trim.radius: this outline is not round; use a disk, an annulus, or half spaces")
        inner, outer = overlap((outline.get("inner", 0.0), outline.get("outer", math.inf)), radius)
        if outer == math.inf:
            raise ArgumentError("trim.radius: give a finite outer radius")
        if not inner < outer:
            raise ArgumentError("trim.radius: nothing is left of the surface")
        return {"kind": "annulus", "inner": inner, "outer": outer}


class Plane(Flat):
    """The whole plane z = 0.

    Examples
    --------
    >>> Plane().outline()
    {'kind': 'whole'}
    """

    kind: Literal["plane"] = "plane"

    def outline(self) -> Record:
        """No outline at all."""
        return {"kind": "whole"}


class Rectangle(Flat):
    """A rectangle around the origin.

    Parameters
    ----------
    width, height : number
        Along x and y [mm], > 0.

    Examples
    --------
    >>> Rectangle(width=4, height=3).outline()
    {'kind': 'rectangle', 'width': 4.0, 'height': 3.0}
    """

    kind: Literal["rectangle"] = "rectangle"
    width: Length
    height: Length

    def outline(self) -> Record:
        """Width along x, height along y."""
        return {"kind": "rectangle", "width": self.width, "height": self.height}


class Disk(Flat):
    """A disk around the origin.

    Parameters
    ----------
    radius : number
        [mm], > 0.

    Examples
    --------
    >>> Disk(radius=2).outline()
    {'kind': 'annulus', 'inner': 0.0, 'outer': 2.0}
    """

    kind: Literal["disk"] = "disk"
    radius: Length

    def outline(self) -> Record:
        """An annulus without a hole."""
        return {"kind": "annulus", "inner": 0.0, "outer": self.radius}


class Annulus(Flat):
    """A disk with a round hole, both around the origin.

    Parameters
    ----------
    inner_radius, outer_radius : number
        [mm], 0 ≤ inner < outer.

    Examples
    --------
    >>> Annulus(inner_radius=1, outer_radius=2).outline()
    {'kind': 'annulus', 'inner': 1.0, 'outer': 2.0}
    """

    kind: Literal["annulus"] = "annulus"
    inner_radius: LengthOrZero
    outer_radius: Length

    @model_validator(mode="after")
    def _has_a_width(self) -> Self:
        if not self.inner_radius < self.outer_radius:
            raise ValueError(f"'inner_radius' is {self.inner_radius:g}; it must be below 'outer_radius'")
        return self

    def outline(self) -> Record:
        """Inner and outer radius."""
        return {"kind": "annulus", "inner": self.inner_radius, "outer": self.outer_radius}


class Polygon(Flat):
    """A simple polygon: no two sides touch but at the corners they share.

    Parameters
    ----------
    vertices : rows of 2 numbers
        Corners (x, y) in order [mm], in either sense, at least three.

    Examples
    --------
    >>> Polygon(vertices=[(0, 0), (2, 0), (0, 2)]).outline()["vertices"].shape
    (3, 2)
    """

    kind: Literal["polygon"] = "polygon"
    vertices: Vertices

    @model_validator(mode="after")
    def _is_simple(self) -> Self:
        simple_polygon(self.vertices)
        return self

    def outline(self) -> Record:
        """The corners, counter-clockwise."""
        corners = np.array(self.vertices)
        return {"kind": "polygon", "vertices": corners if signed_area(corners) > 0.0 else corners[::-1].copy()}


FLAT: dict[str, type[Any]] = {
    cls.model_fields["kind"].default: cls for cls in (Plane, Rectangle, Disk, Annulus, Polygon)
}
"""Flat shapes by kind."""
