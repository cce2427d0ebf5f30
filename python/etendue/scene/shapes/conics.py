"""Surfaces of revolution of optics: conics and even aspheres by their sag, and conics by their foci."""

from __future__ import annotations

import abc
import math
from typing import Annotated, Any, Literal, Self

import numpy as np
import numpy.typing as npt
from annotated_types import MaxLen
from pydantic import Field, model_validator

from etendue.description.files import Files
from etendue.description.keys import Description
from etendue.description.values import Length, LengthOrZero, Number, Numbers
from etendue.errors import ArgumentError
from etendue.scene.shapes.round import Quadric, quadric
from etendue.scene.shapes.shape import Record, Shape, Sheet, Trim, overlap

Array = npt.NDArray[np.float64]
Coefficients = Annotated[Numbers, MaxLen(16)]


class Profile(Description):
    """Sag of a surface of revolution over its distance r from the axis.

    z = c r² / (1 + √(1 - (1 + k) c² r²)) + A₄ r⁴ + A₆ r⁶ + …

    Parameters
    ----------
    radius_of_curvature : number, optional
        1/c [mm], > 0 if the centre of curvature lies at larger z; flat if left out.
    conic : number
        k: 0 sphere, -1 paraboloid, below -1 hyperboloid, between -1 and 0 ellipsoid with its vertex on the long axis.
    coefficients : numbers
        A₄ [mm⁻³], A₆ [mm⁻⁵] and so on.

    Examples
    --------
    >>> round(Profile(radius_of_curvature=5).sag(3.0), 12)
    1.0
    """

    radius_of_curvature: Number | None = None
    conic: Number = 0.0
    coefficients: Coefficients = Field(default=())

    @model_validator(mode="after")
    def _has_a_curvature(self) -> Self:
        if self.radius_of_curvature is not None and not 1e-9 <= abs(self.radius_of_curvature) <= 1e12:
            raise ValueError(
                f"'radius_of_curvature' is {self.radius_of_curvature:g}; leave it out for a flat surface, or give a radius "
                "between 1e-9 and 1e12 mm"
            )
        return self

    @property
    def curvature(self) -> float:
        """Curvature at the vertex [1/mm]."""
        return 0.0 if self.radius_of_curvature is None else 1.0 / self.radius_of_curvature

    def reach(self) -> float:
        """Largest distance from the axis at which the surface exists [mm]; ``inf`` if it has no end."""
        if self.radius_of_curvature is None or self.conic <= -1.0:
            return math.inf
        return abs(self.radius_of_curvature) / math.sqrt(1.0 + self.conic)

    def check_radius(self, radius: float, name: str = "radius") -> None:
        """Refuse a radius at which the surface does not exist: c² (1 + k) r² ≤ 1.

        Raises
        ------
        ValueError
            With the largest radius there is.
        """
        if radius > self.reach():
            raise ValueError(
                f"{name!r} is {radius:g} mm, but with this radius of curvature and conic the surface ends at "
                f"{self.reach():.6g} mm from its axis"
            )
        with np.errstate(over="ignore", invalid="ignore"):
            if not np.isfinite(self.sags(radius)):
                raise ValueError(f"'coefficients': the sag at {name!r} = {radius:g} mm is not finite")

    def sag(self, r: float) -> float:
        """Height above the vertex at one distance from the axis [mm]."""
        return float(self.sags(r))

    def sags(self, r: npt.ArrayLike) -> Array:
        """Height above the vertex [mm] at distances r from the axis, of any shape."""
        r2 = np.square(np.asarray(r, dtype=np.float64))
        c = self.curvature
        # At the very end of the surface, rounding may leave a trifle below 0 under the root.
        root = np.sqrt(np.maximum(1.0 - (1.0 + self.conic) * c * c * r2, 0.0))
        even = np.zeros_like(r2)
        for a in reversed(self.coefficients):
            even = (even + a) * r2
        sag: Array = c * r2 / (1.0 + root) + even * r2
        return sag

    def record(self, inner: float, outer: float) -> Record:
        """The surface between two distances from the axis as the core takes it; its normal has positive z."""
        c, k = self.curvature, self.conic
        if any(self.coefficients):
            return {
                "kind": "asphere",
                "curvature": c,
                "conic": k,
                "coefficients": list(self.coefficients),
                "r": (inner, outer),
            }
        if c == 0.0:
            return {"kind": "flat", "outline": {"kind": "annulus", "inner": inner, "outer": outer}}
        # c r² + c (1 + k) z² - 2 z = 0, times -1 for a normal with positive z; divided by |c| to keep numbers near 1.
        s = math.copysign(1.0, c)
        record = quadric(-s, -s * (1.0 + k), 2.0 / abs(c), 0.0, r=(inner, outer))
        if k != -1.0:
            # The sag is one of two branches, which lie on both sides of the centre of the conic.
            centre = 1.0 / (c * (1.0 + k))
            record["z"] = (-math.inf, centre) if centre > 0.0 else (centre, math.inf)
        return record


class Revolved(Shape, abc.ABC):
    """What surfaces with a sag share: the vertex in the origin, the axis along z, the normal with positive z.

    Parameters
    ----------
    radius_of_curvature, conic
        As of `Profile`.
    radius : number
        Of the rim [mm], > 0.
    inner_radius : number
        Of a round hole about the axis [mm].
    """

    radius_of_curvature: Number | None = None
    conic: Number = 0.0
    radius: Length
    inner_radius: LengthOrZero = 0.0

    @model_validator(mode="after")
    def _exists(self) -> Self:
        self.profile().check_radius(self.radius)
        if not self.inner_radius < self.radius:
            raise ValueError(f"'inner_radius' is {self.inner_radius:g}; it must be below 'radius'")
        return self

    @abc.abstractmethod
    def profile(self) -> Profile:
        """The sag."""

    def sheet(self, trim: Trim, files: Files) -> Sheet:  # noqa: ARG002 - other shapes come from files
        """The surface; ranges of radii narrow its own, ranges of z are half spaces."""
        inner, outer = overlap((self.inner_radius, self.radius), trim.radius)
        if not inner < outer:
            raise ArgumentError("trim.radius: nothing is left of the surface")
        return Sheet(self.profile().record(inner, outer), [*trim.planes(), *trim.planes_of_z()])


class Conic(Revolved):
    """A conic of revolution by its sag.

    Parameters
    ----------
    radius_of_curvature, conic, radius, inner_radius
        As of `Revolved`.

    Examples
    --------
    >>> Conic(radius_of_curvature=-10, conic=-1, radius=8).profile().sag(2.0)
    -0.2
    """

    kind: Literal["conic"] = "conic"

    def profile(self) -> Profile:
        """The sag, without coefficients."""
        return Profile(radius_of_curvature=self.radius_of_curvature, conic=self.conic)


class Asphere(Revolved):
    """An even asphere.

    Parameters
    ----------
    radius_of_curvature, conic, radius, inner_radius
        As of `Revolved`.
    coefficients : numbers
        As of `Profile`.

    Examples
    --------
    >>> Asphere(radius_of_curvature=10, conic=-1, coefficients=[1e-5], radius=8).profile().sag(2.0)
    0.20016
    """

    kind: Literal["asphere"] = "asphere"
    coefficients: Coefficients = Field(default=())

    def profile(self) -> Profile:
        """The sag with all its terms."""
        return Profile(radius_of_curvature=self.radius_of_curvature, conic=self.conic, coefficients=self.coefficients)


class Mirror(Quadric, abc.ABC):
    """What conics with foci share: they open towards +z, and their normal points outwards, away from the focus."""

    origin: Literal["vertex", "focus"] = "vertex"
    radius: Length | None = None
    inner_radius: LengthOrZero = 0.0

    @abc.abstractmethod
    def vertex_form(self) -> tuple[float, float]:
        """Focal length f of the vertex' own focus and conic constant."""

    def quadric(self) -> Record:
        """C r² + c (1 + k) z² - 2 z = 0 about the vertex, on its branch, moved to the focus if asked for."""
        f, k = self.vertex_form()
        e2 = 1.0 + k
        # The distance from vertex to focus is R/(1 + e) with e = √-k, for every conic.
        radius = f * (1.0 + math.sqrt(-k))
        shift = f if self.origin == "focus" else 0.0
        # r² + e2 (z + s)² - 2 R (z + s) = 0
        record = quadric(
            1.0,
            e2,
            2.0 * (e2 * shift - radius),
            (e2 * shift - 2.0 * radius) * shift,
            r=(self.inner_radius, math.inf if self.radius is None else self.radius),
        )
        if e2 < 0.0:
            record["z"] = (radius / e2 - shift, math.inf)  # the branch of the focus alone
        elif e2 > 0.0 and self.radius is not None:
            record["z"] = (-math.inf, radius / e2 - shift)  # up to the widest place, where a rim can be
        return record

    @model_validator(mode="after")
    def _rim_exists(self) -> Self:
        if self.radius is not None and not self.inner_radius < self.radius:
            raise ValueError(f"'inner_radius' is {self.inner_radius:g}; it must be below 'radius'")
        return self


class Paraboloid(Mirror):
    """A paraboloid about the z axis that opens towards +z; its normal points outwards, to the convex side.

    Parameters
    ----------
    focal_length : number
        From the vertex to the focus [mm], > 0.
    origin : {"vertex", "focus"}
        What stands in the local origin.
    radius : number, optional
        Of the rim [mm]; without it the trim says where the surface ends.
    inner_radius : number
        Of a round hole about the axis [mm].

    Examples
    --------
    >>> Paraboloid(focal_length=5, radius=20).quadric()["z1"]
    -20.0
    """

    kind: Literal["paraboloid"] = "paraboloid"
    focal_length: Length

    def vertex_form(self) -> tuple[float, float]:
        """The focal length, and -1."""
        return self.focal_length, -1.0


class Ellipsoid(Mirror):
    """A prolate ellipsoid about the z axis; light from one focus meets in the other. Its normal points outwards.

    Parameters
    ----------
    focus, second_focus : number
        From the vertex at smaller z to the foci [mm], 0 < focus ≤ second_focus.
    origin : {"vertex", "focus"}
        What stands in the local origin: that vertex, or the focus nearer to it.
    radius : number, optional
        Of the rim [mm], on the half of the vertex; the whole ellipsoid without it.
    inner_radius : number
        Of a round hole about the axis [mm], on both ends unless `radius` or a trim takes the other away.

    Examples
    --------
    >>> mirror = Ellipsoid(focus=10, second_focus=40)
    >>> mirror.semi_axes
    (25.0, 20.0)
    """

    kind: Literal["ellipsoid"] = "ellipsoid"
    focus: Length
    second_focus: Length

    @model_validator(mode="after")
    def _order_and_rim(self) -> Self:
        if self.focus > self.second_focus:
            raise ValueError(f"'focus' is {self.focus:g}; it must not lie beyond 'second_focus'")
        if max(self.radius or 0.0, self.inner_radius) > self.semi_axes[1]:
            raise ValueError(
                f"'radius' is {self.radius}: the ellipsoid is nowhere farther than {self.semi_axes[1]:.6g} mm from its axis"
            )
        return self

    @property
    def semi_axes(self) -> tuple[float, float]:
        """Along the axis and across it [mm]."""
        return (self.focus + self.second_focus) / 2.0, math.sqrt(self.focus * self.second_focus)

    def vertex_form(self) -> tuple[float, float]:
        """The distance of the nearer focus, and -e² with e = (f₂ - f₁)/(f₂ + f₁)."""
        e = (self.second_focus - self.focus) / (self.second_focus + self.focus)
        return self.focus, -e * e


class Hyperboloid(Mirror):
    """One branch of a hyperboloid of two sheets about the z axis; light from its focus seems to come from the other.

    It opens towards +z; its normal points outwards, to the convex side.

    Parameters
    ----------
    focus : number
        From the vertex to the focus inside the branch [mm], > 0.
    virtual_focus : number
        From the vertex to the focus behind it [mm], > `focus`.
    origin, radius, inner_radius
        As of `Paraboloid`.

    Examples
    --------
    >>> Hyperboloid(focus=2, virtual_focus=6, radius=5).vertex_form()
    (2.0, -4.0)
    """

    kind: Literal["hyperboloid"] = "hyperboloid"
    focus: Length
    virtual_focus: Length

    @model_validator(mode="after")
    def _order(self) -> Self:
        if not self.focus < self.virtual_focus:
            raise ValueError(f"'focus' is {self.focus:g}; it must be nearer to the vertex than 'virtual_focus'")
        return self

    def vertex_form(self) -> tuple[float, float]:
        """The distance of the focus, and -e² with e = (f₂ + f₁)/(f₂ - f₁)."""
        e = (self.virtual_focus + self.focus) / (self.virtual_focus - self.focus)
        return self.focus, -e * e


CONICS: dict[str, type[Any]] = {
    cls.model_fields["kind"].default: cls for cls in (Conic, Asphere, Paraboloid, Ellipsoid, Hyperboloid)
}
"""Surfaces of revolution by kind."""
