"""A beam and an aperture: points in them, and how much of the one gets into the other."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_numbers, require_known
from etendue.quantities.quadrature import gauss_legendre

Array = npt.NDArray[np.float64]
Shape = Literal["disk", "square", "ring"]
Profile = Literal["uniform", "gaussian"] | Sequence[float]

RADII = 48
"""Rings in which profiles that are not uniform are drawn and added up."""

CHORDS = 240
"""Chords on which beam and aperture overlap: kinks at their ends cost 1e-5."""

SOURCE = (6, 12)
"""Points of the source of light: radii, and azimuths on each."""


@dataclasses.dataclass(frozen=True)
class Aperture:
    """In front of the detector, at right angles to its arm.

    Parameters
    ----------
    shape : {"disk", "square", "ring"}
        A square has its sides along the plane of the scan and across it.
    diameter : number
        Outer diameter, or side of the square [mm].
    inner : number
        Inner diameter of a ring [mm].

    Examples
    --------
    >>> round(Aperture("ring", 25.0, 10.0).area, 2)
    412.33
    """

    shape: Shape
    diameter: float
    inner: float = 0.0

    def __post_init__(self) -> None:
        require_known(self.shape, get_args(Shape), "shape of an aperture")
        if self.shape == "ring" and not 0.0 < self.inner < self.diameter:
            raise ArgumentError(
                f"a ring-shaped aperture from {self.inner:g} to {self.diameter:g} mm; give an inner diameter above 0 mm and "
                "below the outer one"
            )
        if self.shape != "ring" and self.inner != 0.0:
            raise ArgumentError(f"a {self.shape} has no inner diameter; leave it out, or take a ring")

    @property
    def reach(self) -> float:
        """Distance of the farthest point from the middle [mm]."""
        return 0.5 * self.diameter * (np.sqrt(2.0) if self.shape == "square" else 1.0)

    @property
    def area(self) -> float:
        """In mm²."""
        if self.shape == "square":
            return self.diameter**2
        return float(0.25 * np.pi * (self.diameter**2 - self.inner**2))

    def holds(self, u: Array, v: Array) -> npt.NDArray[np.bool_]:
        """Whether points in its plane are in it."""
        if self.shape == "square":
            return np.asarray((np.abs(u) <= 0.5 * self.diameter) & (np.abs(v) <= 0.5 * self.diameter))
        square = u * u + v * v
        inside = square <= (0.5 * self.diameter) ** 2
        return np.asarray(inside & (square >= (0.5 * self.inner) ** 2) if self.inner else inside)

    def nodes(self, fineness: int) -> tuple[Array, Array]:
        """Points, shape (n, 2), and weights that add up to the area: Gauss and Legendre across, evenly around."""
        x, w = gauss_legendre(fineness)
        if self.shape == "square":
            half = 0.5 * self.diameter
            u, v = np.meshgrid(x * half, x * half, indexing="ij")
            return np.column_stack([u.ravel(), v.ravel()]), (np.outer(w, w) * half**2).ravel()
        low, high = (0.5 * self.inner) ** 2, (0.5 * self.diameter) ** 2
        # Even in the square of the radius: each node stands for the same kind of area.
        radius = np.sqrt(low + (high - low) * 0.5 * (x + 1.0))
        points = _around(radius, 2 * fineness)
        return points, np.repeat(0.5 * w * self.area, 2 * fineness) / (2 * fineness)

    def chord(self, v: Array, radius: float) -> Array:
        """Half of its width at a height, of the circle of `radius` or of the square."""
        if self.shape == "square":
            return np.where(np.abs(v) <= radius, radius, 0.0)
        return np.sqrt(np.maximum(radius**2 - v * v, 0.0))


def _around(radius: Array, azimuths: int) -> Array:
    a = (np.arange(azimuths) + 0.5) * (2.0 * np.pi / azimuths)
    return np.stack([radius[:, None] * np.cos(a), radius[:, None] * np.sin(a)], axis=-1).reshape(-1, 2)


@dataclasses.dataclass(frozen=True)
class Beam:
    """The light that meets the sample: a disk across it, and how its rays spread.

    Parameters
    ----------
    diameter : number
        On the sample, across the beam [mm].
    profile : {"uniform", "gaussian"} or numbers
        Irradiance over the radius: even; falling to 1/e² at the edge, where it is cut; or values at even radii from the
        middle to the edge, between which it is linear.
    divergence : number
        Angle of the outermost rays with the axis [°], in proportion to the radius further in; negative: convergent.
    source_angle : number
        Diameter of the source of light as it is seen from the sample [°]: each point of the beam holds an even cone.

    Examples
    --------
    >>> rays = Beam(14.0).points(np.random.default_rng(1), 1000)
    >>> bool(np.hypot(*rays.T).max() <= 7.0)
    True
    """

    diameter: float
    profile: Profile = "uniform"
    divergence: float = 0.0
    source_angle: float = 0.0

    def __post_init__(self) -> None:
        if isinstance(self.profile, str):
            require_known(self.profile, ("uniform", "gaussian"), "profile of a beam")
        else:
            wanted = "'uniform', 'gaussian', or two or more values from the middle to the edge"
            values = as_numbers(self.profile, "the profile of a beam", wanted)
            if values.ndim != 1 or values.size < 2 or not np.isfinite(values).all() or (values < 0.0).any():
                raise ArgumentError(
                    "the profile of a beam is two or more values from the middle to the edge, none below 0"
                )
            if not values.any():
                raise ArgumentError("the profile of a beam is 0 everywhere")
            object.__setattr__(self, "profile", tuple(values.tolist()))

    @property
    def collimated(self) -> bool:
        """Whether all rays are parallel."""
        return self.divergence == 0.0 and self.source_angle == 0.0

    @property
    def spread(self) -> float:
        """Tangent of the largest angle of a ray with the axis."""
        return float(np.tan(np.radians(abs(self.divergence))) + np.tan(np.radians(0.5 * self.source_angle)))

    def _irradiance(self, part: Array) -> Array:
        if self.profile == "uniform":
            return np.ones(part.shape)
        if self.profile == "gaussian":
            return np.asarray(np.exp(-2.0 * part**2))
        values = np.asarray(self.profile, np.float64)
        return np.interp(part, np.linspace(0.0, 1.0, values.size), values)

    def points(self, rng: np.random.Generator, n: int) -> Array:
        """Points of rays across the beam [mm], shape (n, 2)."""
        if self.profile == "uniform":
            part = np.sqrt(rng.random(n))
        else:
            edges = np.linspace(0.0, 1.0, 4 * RADII + 1)
            g = self._irradiance(edges) * edges
            flux = np.concatenate([[0.0], np.cumsum(0.5 * (g[1:] + g[:-1]))])
            part = np.interp(rng.random(n) * flux[-1], flux, edges)
        a = 2.0 * np.pi * rng.random(n)
        radius = 0.5 * self.diameter * part
        return np.column_stack([radius * np.cos(a), radius * np.sin(a)])

    def tilts(self, points: Array, rng: np.random.Generator) -> Array:
        """Tangents of the angles of rays with the axis, shape (n, 2)."""
        found = points * (np.tan(np.radians(self.divergence)) / (0.5 * self.diameter))
        if self.source_angle:
            radius = np.tan(np.radians(0.5 * self.source_angle)) * np.sqrt(rng.random(len(points)))
            a = 2.0 * np.pi * rng.random(len(points))
            found = found + np.column_stack([radius * np.cos(a), radius * np.sin(a)])
        return np.asarray(found)

    def nodes(self, fineness: int) -> tuple[Array, Array, Array]:
        """Points [mm] and tilts of rays, shape (n, 2) each, and weights that add up to 1."""
        x, w = gauss_legendre(fineness)
        part = np.sqrt(0.5 * (x + 1.0))
        weights = 0.5 * w * self._irradiance(part)
        points = _around(0.5 * self.diameter * part, 2 * fineness)
        weights = np.repeat(weights / weights.sum() / (2 * fineness), 2 * fineness)
        tilts = points * (np.tan(np.radians(self.divergence)) / (0.5 * self.diameter))
        if self.source_angle:
            cone, share = self._source((max(fineness // 2, 2), fineness))
            points = np.repeat(points, len(cone), axis=0)
            tilts = (tilts[:, None] + cone).reshape(-1, 2)
            weights = (weights[:, None] * share).ravel()
        return points, tilts, weights

    def _source(self, many: tuple[int, int]) -> tuple[Array, Array]:
        x, w = gauss_legendre(many[0])
        radius = np.tan(np.radians(0.5 * self.source_angle)) * np.sqrt(0.5 * (x + 1.0))
        return _around(radius, many[1]), np.repeat(0.5 * w / many[1], many[1])

    def overlap(self, aperture: Aperture, angle: Array, distance: float) -> Array:
        """Share of the flux that gets into an aperture whose arm is turned by angles [°] from the axis, without a sample.

        Beam and aperture are cut into chords along the plane of the scan: exact for any chord. The aperture is
        foreshortened by the cosine of the angle. A profile is a sum of even disks, and a source of light that is seen under
        an angle shifts them.
        """
        a = np.radians(angle)
        # Where the rays are that set out from the edge.
        grown = abs(1.0 + distance * np.tan(np.radians(self.divergence)) / (0.5 * self.diameter))
        radii, parts = self._disks()
        radii = np.maximum(radii * grown, 1e-9)
        shifts, shares = (np.zeros((1, 2)), np.ones(1)) if not self.source_angle else self._source(SOURCE)
        shifts = shifts * distance
        t, w = gauss_legendre(CHORDS)
        found = np.zeros(a.shape)
        for radius, part in zip(radii, parts, strict=True):
            # y = ρ sin t: half chords of the beam are smooth in t.
            y, half = radius * np.sin(0.5 * np.pi * t), radius * np.cos(0.5 * np.pi * t)
            weight = w * 0.5 * np.pi * half * part / (np.pi * radius**2)
            for (sx, sy), share in zip(shifts, shares, strict=True):
                for edge, sign in ((aperture.diameter, 1.0), *([(aperture.inner, -1.0)] if aperture.inner else [])):
                    wide = aperture.chord(y + sy, 0.5 * edge) * np.cos(a)[:, None]
                    middle = (distance * np.sin(a))[:, None] - sx
                    lengths = np.minimum(half, middle + wide) - np.maximum(-half, middle - wide)
                    found += sign * share * (np.maximum(lengths, 0.0) @ weight)
        return np.clip(found, 0.0, 1.0)

    def _disks(self) -> tuple[Array, Array]:
        """Even disks that add up to the profile: radii [mm] and shares of the flux, which may be negative."""
        if self.profile == "uniform":
            return np.array([0.5 * self.diameter]), np.ones(1)
        edges = np.linspace(0.0, 1.0, RADII + 1)
        g = self._irradiance(edges)
        middle = 0.5 * (edges[1:] + edges[:-1])
        radii, heights = np.append(middle, 1.0), np.append(-np.diff(g), g[-1])
        flux = heights * radii**2
        return 0.5 * self.diameter * radii, flux / flux.sum()


def into_the_sample(points: Array, tilts: Array, theta: float, *, across: bool) -> tuple[Array, Array]:
    """Where rays meet the surface (or pass the plane across the beam) and their directions, shape (n, 3) each.

    Examples
    --------
    >>> start, to = into_the_sample(np.array([[1.0, 2.0]]), np.zeros((1, 2)), 60.0, across=False)
    >>> (start + 0.0).round(3).tolist(), to.round(3).tolist()
    ([[2.0, 2.0, 0.0]], [[0.866, 0.0, -0.5]])
    """
    c, s = np.cos(np.radians(theta)), np.sin(np.radians(theta))
    axis, first, second = np.array([s, 0.0, -c]), np.array([c, 0.0, s]), np.array([0.0, 1.0, 0.0])
    v = axis + tilts[:, :1] * first + tilts[:, 1:] * second
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    q = points[:, :1] * first + points[:, 1:] * second
    if not across:
        q = q - (q[:, 2] / v[:, 2])[:, None] * v
    return q, v


def axes_of(arm: Array) -> tuple[Array, Array]:
    """The axes of an aperture on an arm: in the plane of the arm and the normal, and across it.

    Examples
    --------
    >>> [axis.round(3).tolist() for axis in axes_of(np.array([0.6, 0.0, 0.8]))]
    [[0.8, 0.0, -0.6], [-0.0, 1.0, 0.0]]
    """
    across = np.hypot(arm[0], arm[1])
    x, y = (arm[0] / across, arm[1] / across) if across > 1e-12 else (1.0, 0.0)
    return np.array([arm[2] * x, arm[2] * y, -across]), np.array([-y, x, 0.0])
