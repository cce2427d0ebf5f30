"""What is known of a BSDF direction by direction: measured or tabulated values, one slice for each incidence.

**Frame.** Directions are unit vectors in the frame of the surface, +z being the normal of its front. They point *away* from
the surface: `incident` to where light comes from, scattered ones to where it goes. Light meets the front if the third
component of `incident` is positive, and is reflected if both have the same sign.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.bsdf_holes import Filled, filled
from etendue.quantities.provenance import Provenance
from etendue.quantities.quadrature import gauss_legendre
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]
GridFrame = Literal["normal", "specular", "cosines"]
GRID_FRAMES: tuple[str, ...] = get_args(GridFrame)

GRAZING = 1e-9
"""Heights below which a direction lies in the surface."""

SIDE = 1e-6
"""Heights by which points may lie on the wrong side: rounding of files."""

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


@dataclasses.dataclass(frozen=True, eq=False)
class PolarGrid:
    """Scattered directions in polar coordinates about the normal or about the specular direction.

    Parameters
    ----------
    frame : {"normal", "specular", "cosines"}
        ``"normal"``: the radial coordinate is θ [°] from the normal of the side where light leaves, the azimuth φ [°] from
        +x towards +y.
        ``"specular"``: it is the angle [°] to the specular direction s (mirrored, or straight on), and the azimuth [°] turns
        from the direction e at right angles to s that lies in the plane of incidence on the side of the normal, towards
        s × e. If s is the normal, e points to −β₀ of a slightly larger incidence at the same azimuth.
        ``"cosines"``: it is |β − β₀|, β and β₀ being the projections of the scattered and the specular direction on the
        surface, and the azimuth [°] turns from the direction of β₀ towards +90° about +z (Harvey and Shack). At normal
        incidence the direction of β₀ is that of a slightly larger incidence at the same azimuth, if `light_from` made the
        incident direction; if it is the normal exactly, light counts as from azimuth 0, and β₀ points to −x.
    radial : array, shape (n,)
        Increasing, not negative.
    azimuth : array, shape (m,)
        Increasing, at most 360° wide; values repeat after 360°. A single azimuth: values do not depend on it.

    Examples
    --------
    >>> about = PolarGrid("specular", [0.0, 10.0], [0.0, 180.0])
    >>> about.directions(direction(30.0, 180.0), transmitted=False)[0, 1].round(3).tolist()  # 10° towards the normal
    [0.342, -0.0, 0.94]
    """

    frame: GridFrame
    radial: Array
    azimuth: Array

    def __post_init__(self) -> None:
        if self.frame not in GRID_FRAMES:
            raise ArgumentError(f"frame is one of {', '.join(GRID_FRAMES)}, not {self.frame!r}")
        for name in ("radial", "azimuth"):
            values = np.array(getattr(self, name), np.float64)
            if values.ndim != 1 or not values.size or not np.isfinite(values).all() or (np.diff(values) <= 0.0).any():
                raise ArgumentError(f"the {name} coordinates of a grid are finite and increase")
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if self.radial[0] < 0.0 or np.ptp(self.azimuth) > 360.0:
            raise ArgumentError("radial coordinates are not negative, and azimuths span 360° at most")

    @property
    def shape(self) -> tuple[int, int]:
        """Azimuths, radial coordinates."""
        return self.azimuth.size, self.radial.size

    def directions(self, incident: Array, *, transmitted: bool) -> Array:
        """Scattered directions, shape (m, n, 3); NaN where a coordinate is no direction on the side where light leaves."""
        return self.direction(self.radial[None, :], self.azimuth[:, None], incident, transmitted=transmitted)

    def direction(self, radial: npt.ArrayLike, azimuth: npt.ArrayLike, incident: Array, *, transmitted: bool) -> Array:
        """The directions at coordinates, shape (…, 3); NaN where there is none on the side where light leaves."""
        r, a = np.broadcast_arrays(np.asarray(radial, np.float64), np.radians(azimuth))
        side = math.copysign(1.0, incident[2]) * (-1.0 if transmitted else 1.0)
        forward = _forward(incident)
        if self.frame == "normal":
            found = direction(np.degrees(np.radians(r)), np.degrees(a), behind=side < 0.0)
        elif self.frame == "specular":
            s, e, across = _axes(incident, transmitted=transmitted)
            t = np.radians(r)
            turned = np.cos(a)[..., None] * e + np.sin(a)[..., None] * across
            found = np.cos(t)[..., None] * s + np.sin(t)[..., None] * turned
        else:
            sideways = np.array([-forward[1], forward[0]])
            beta = -incident[:2] + r[..., None] * (np.cos(a)[..., None] * forward + np.sin(a)[..., None] * sideways)
            with np.errstate(invalid="ignore"):
                height = side * np.sqrt(1.0 - np.sum(beta * beta, axis=-1))
            found = np.concatenate([beta, height[..., None]], axis=-1)
        gone = ~(found[..., 2] * side >= -GRAZING)
        found[gone] = np.nan
        return found

    def coordinates(self, scattered: npt.ArrayLike, incident: Array, *, transmitted: bool) -> tuple[Array, Array]:
        """The inverse of `direction`: radial coordinates and azimuths [°] from 0 to 360 of directions of shape (…, 3)."""
        v = np.asarray(scattered, np.float64)
        forward = _forward(incident)
        if self.frame == "normal":
            radial = np.degrees(np.arctan2(np.hypot(v[..., 0], v[..., 1]), np.abs(v[..., 2])))
            azimuth = np.arctan2(v[..., 1], v[..., 0])
        elif self.frame == "specular":
            s, e, across = _axes(incident, transmitted=transmitted)
            x, y = v @ e, v @ across
            radial = np.degrees(np.arctan2(np.hypot(x, y), v @ s))
            azimuth = np.arctan2(y, x)
        else:
            off = v[..., :2] + incident[:2]
            radial = np.hypot(off[..., 0], off[..., 1])
            azimuth = np.arctan2(forward[0] * off[..., 1] - forward[1] * off[..., 0], off @ forward)
        return np.asarray(radial), np.degrees(azimuth) % 360.0


def _forward(incident: Array) -> Array:
    """The direction of β₀ in the plane of the surface; along −x where light comes along the normal exactly."""
    across = math.hypot(incident[0], incident[1])
    return -incident[:2] / across if across > 0.0 else np.array([-1.0, 0.0])


def _axes(incident: Array, *, transmitted: bool) -> tuple[Array, Array, Array]:
    """The specular direction s, e at right angles to it towards the normal of its side, and s × e."""
    s = -incident if transmitted else mirrored(incident)
    side = math.copysign(1.0, s[2])
    forward = _forward(incident)
    sine = math.hypot(s[0], s[1])
    e = np.array([*(-abs(s[2]) * forward), side * sine])
    return s, e, np.cross(s, e)


@dataclasses.dataclass(frozen=True, eq=False)
class BsdfSlice:
    """BSDF of one incidence, one way (reflected or transmitted) and one wavelength.

    Parameters
    ----------
    incident : array, shape (3,)
        Unit vector to where the light comes from; along the normal as `light_from` has it, to keep its azimuth.
    values : array
        f [1/sr], the cosine not included: shape (m, n) on a `PolarGrid` of m azimuths and n radial coordinates, or (n,) at
        single `points`. NaN: not measured.
    transmitted : bool
        Whether the light passes to the other side.
    grid : PolarGrid, optional
        Where the values are; or
    points : array, shape (n, 3), optional
        the scattered directions themselves.
    projected : array, shape (n,), optional
        Projected solid angle [sr] of which each of the points stands for a part (Klems' patches, leaves of a tensor tree).
    wavelength : float, optional
        In nm; None: weighted by V(λ), or not known.
    stated : float, optional
        What the file says that the integral of f cosθ is: total integrated scatter (TIS).
    standard_error : array, optional
        Of the values, same shape.
    interpolated : bool
        Whether the values lie between fewer that were measured, so that neighbours err together.

    Raises
    ------
    ArgumentError
        If shapes do not fit, a value is infinite, a solid angle is below 0, or a point lies on the side to which this light
        does not go.

    Examples
    --------
    >>> half = BsdfSlice(direction(30.0, 0.0), [[0.5 / np.pi] * 2], grid=PolarGrid("normal", [0.0, 90.0], [0.0]))
    >>> round(half.integral(), 6)
    0.5
    """

    incident: Array
    values: Array
    transmitted: bool = False
    _: dataclasses.KW_ONLY
    grid: PolarGrid | None = None
    points: Array | None = None
    projected: Array | None = None
    wavelength: float | None = None
    stated: float | None = None
    standard_error: Array | None = None
    interpolated: bool = False

    def __post_init__(self) -> None:
        for name in ("incident", "values", "points", "projected", "standard_error"):
            given = getattr(self, name)
            if given is not None:
                array = np.array(given, np.float64)
                array.flags.writeable = False
                object.__setattr__(self, name, array)
        if self.incident.shape != (3,) or not abs(float(np.linalg.norm(self.incident)) - 1.0) < 1e-9:
            raise ArgumentError("incident is one unit vector")
        if (self.grid is None) == (self.points is None):
            raise ArgumentError("a slice has either a grid or points")
        shape = self.grid.shape if self.grid is not None else self.points.shape[:1]  # type: ignore[union-attr] # there is one of both
        if self.values.shape != shape or (self.points is not None and self.points.shape != (*shape, 3)):
            raise ArgumentError(f"values of shape {self.values.shape} do not fit directions of shape {shape}")
        if np.isinf(self.values).any():
            raise ArgumentError("values of a BSDF are finite, or NaN where nothing was measured")
        if self.projected is not None and self.projected.shape != shape:
            raise ArgumentError("projected solid angles have the shape of the values")
        if self.projected is not None and (self.projected < 0.0).any():
            raise ArgumentError("projected solid angles are not below 0 sr: they are those of patches, times |cos θ|")
        if self.points is not None:
            self._require_side(self.points)
        if self.standard_error is not None and self.standard_error.shape != self.values.shape:
            raise ArgumentError("standard errors have the shape of the values")
        if self.standard_error is not None and (self.standard_error < 0.0).any():
            raise ArgumentError("standard errors are not below 0, or NaN where none is known")
        if self.wavelength is not None and not 0.0 < self.wavelength < math.inf:
            raise ArgumentError(f"the wavelength of a slice is {self.wavelength} nm; give a length above 0, or None")

    def _require_side(self, points: Array) -> None:
        """Refuse directions to where this light does not go."""
        behind = (self.incident[2] > 0.0) == self.transmitted
        wrong = points[:, 2] * (-1.0 if behind else 1.0) < -SIDE
        if wrong.any():
            way, where = ("transmitted", "other") if self.transmitted else ("reflected", "lit")
            at = int(np.argmax(wrong))
            raise ArgumentError(
                f"points[{at}] is {points[at].tolist()}; {way} light leaves on the {where} side of the surface: sort the "
                "points by side, or state transmitted"
            )

    @property
    def theta(self) -> float:
        """Angle of incidence [°], from the normal of the side that the light meets."""
        sine = math.hypot(self.incident[0], self.incident[1])
        return math.degrees(math.atan2(sine, abs(self.incident[2]))) if sine > 2.0 * LEAN else 0.0

    @property
    def phi(self) -> float:
        """Azimuth of the incident direction [°], 0 to 360; 0 of the normal exactly."""
        if not self.incident[:2].any():
            return 0.0
        return math.degrees(math.atan2(self.incident[1], self.incident[0])) % 360.0

    @property
    def front(self) -> bool:
        """Whether the light meets the front."""
        return bool(self.incident[2] > 0.0)

    @functools.cached_property
    def directions(self) -> Array:
        """Scattered directions of the values, shape (…, 3); NaN where a grid goes beyond the hemisphere."""
        if self.grid is None:
            assert self.points is not None  # noqa: S101 - for type checkers
            return self.points
        return self.grid.directions(self.incident, transmitted=self.transmitted)

    def at(self, scattered: npt.ArrayLike) -> Array:
        """F [1/sr] at directions of shape (…, 3) on the side where light leaves, for slices on a grid: bilinear on it.

        Beyond the last radial coordinate, or the last within the hemisphere, f is that of the last; between the ends of
        azimuths that do not go around it is interpolated across the gap.

        Raises
        ------
        ArgumentError
            If the slice is made of points.
        """
        if self.grid is None:
            raise ArgumentError("a slice of single points has to be interpolated first")
        r, a = self.grid.coordinates(scattered, self.incident, transmitted=self.transmitted)
        return _bilinear(self.grid, self.held, r, a)

    @functools.cached_property
    def held(self) -> Array:
        """Values of the grid without holes, as `filled` says; those beyond the hemisphere are the last before them."""
        return self._filled.values

    @functools.cached_property
    def holes(self) -> npt.NDArray[np.bool_]:
        """Which values of the grid were not measured and lie between those that were, of the shape of `values`."""
        return self._filled.between

    @functools.cached_property
    def _filled(self) -> Filled:
        assert self.grid is not None  # noqa: S101 - callers say so
        within = ~np.isnan(self.directions[..., 0])
        if self.grid.azimuth.size == 1:
            # It stands for all azimuths, some of which reach farther within the hemisphere than its own.
            within = np.broadcast_to(self.grid.radial <= _reach(self.grid, self), self.values.shape)
        frame = self.grid.frame
        return filled(self.values, self.grid.radial, self.grid.azimuth, within, degrees=frame != "cosines")

    def integral(self) -> float:
        """∫ f cosθ dΩ: the share of the flux that is scattered (directional-hemispherical).

        On a grid by the rule of Gauss and Legendre in each of its cells, f being bilinear there; f beyond the last radial
        coordinate is that of the last. Of points by their projected solid angles.

        Raises
        ------
        ArgumentError
            If the slice is made of points of unknown solid angle.
        """
        if self.grid is None and self.projected is None:
            raise ArgumentError("points of unknown solid angle cannot be added up")
        return self._share

    @functools.cached_property
    def _share(self) -> float:
        return _integral(self) if self.projected is None else float(np.nansum(self.values * self.projected))


def _bilinear(grid: PolarGrid, values: Array, r: Array, a: Array) -> Array:
    i, u = _between(grid.radial, r)
    j, k, v = _around(grid.azimuth, a)
    last = np.minimum(i + 1, grid.radial.size - 1)
    near, far = (1.0 - u) * values[j, i] + u * values[j, last], (1.0 - u) * values[k, i] + u * values[k, last]
    return np.asarray((1.0 - v) * near + v * far)


def _between(nodes: Array, x: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """The node below, and how far on to the next; constant beyond the ends."""
    x = np.clip(x, nodes[0], nodes[-1])
    i = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, max(nodes.size - 2, 0))
    if nodes.size == 1:
        return i, np.zeros_like(x)
    return i, (x - nodes[i]) / (nodes[i + 1] - nodes[i])


def _around(nodes: Array, x: Array) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], Array]:
    """The nodes on both sides of azimuths [°], which repeat after 360°, and how far from the first to the second."""
    if nodes.size == 1:
        zero = np.zeros(np.shape(x), np.intp)
        return zero, zero, np.zeros(np.shape(x))
    whole = np.ptp(nodes) == 360.0
    ring = nodes[:-1] if whole else nodes
    x = (x - ring[0]) % 360.0
    starts = ring - ring[0]
    i = np.searchsorted(starts, x, side="right") - 1
    following = np.append(starts[1:], 360.0)
    return i, (i + 1) % ring.size, (x - starts[i]) / (following[i] - starts[i])


def _reach(grid: PolarGrid, one: BsdfSlice) -> float:
    """The largest radial coordinate of any direction on the side where light leaves."""
    if grid.frame == "cosines":
        return 1.0 + math.hypot(one.incident[0], one.incident[1])
    return 90.0 + (one.theta if grid.frame == "specular" else 0.0)


NODES = 4
"""Of the rule of Gauss and Legendre in each cell of a grid, and by azimuth."""


def _integral(one: BsdfSlice) -> float:
    grid = one.grid
    assert grid is not None  # noqa: S101 - for type checkers
    end = {"normal": 90.0, "specular": 180.0, "cosines": 2.0}[grid.frame]
    radial = np.unique(np.concatenate([[0.0], grid.radial[grid.radial < end], _extended(grid, one), [end]]))
    azimuth = np.unique(np.concatenate([grid.azimuth, np.arange(grid.azimuth[0], grid.azimuth[0] + 361.0, 5.0)]))
    azimuth = azimuth[azimuth <= grid.azimuth[0] + 360.0]
    x, w = gauss_legendre(NODES)
    nodes, weights = (0.5 * (x + 1.0), 0.5 * w)

    def points(edges: Array) -> tuple[Array, Array]:
        widths = np.diff(edges)
        return (edges[:-1, None] + widths[:, None] * nodes).ravel(), (widths[:, None] * weights).ravel()

    a, wa = points(azimuth)
    r, wr = points(radial)
    # Nodes lie on lines of either coordinate: f is interpolated along one, then along the other.
    j, k, v = _around(grid.azimuth, a % 360.0)
    i, u = _between(grid.radial, r)
    held = (1.0 - v)[:, None] * one.held[j] + v[:, None] * one.held[k]
    f = held[:, i]
    f *= 1.0 - u
    f += u * held[:, np.minimum(i + 1, grid.radial.size - 1)]
    f *= _projected(grid, r, a, one)
    return float(np.radians(wa) @ f @ wr)


def _projected(grid: PolarGrid, r: Array, a: Array, one: BsdfSlice) -> Array:
    """Projected solid angle over the product of steps of both coordinates, azimuths in radians, shape (m, n).

    0 where there is no direction on the side where light leaves.
    """
    if grid.frame == "cosines":
        sine = math.hypot(one.incident[0], one.incident[1])
        # |β|² of β₀ and what is added to it.
        squares = np.cos(np.radians(a))[:, None] * (2.0 * sine * r) + (sine * sine + r * r)
        return np.where(squares <= 1.0, r, 0.0)
    turn, t = np.radians(a)[:, None], np.radians(r)
    if grid.frame == "normal":
        height = np.broadcast_to(np.cos(t), (a.size, r.size))
    else:
        # Along the specular direction and along the direction at right angles to it, towards the normal.
        s, e, _ = _axes(one.incident, transmitted=one.transmitted)
        side = math.copysign(1.0, s[2])
        height = np.cos(turn) * (side * e[2] * np.sin(t)) + side * s[2] * np.cos(t)
    return np.where(height >= 0.0, height, 0.0) * (np.sin(t) * math.radians(1.0))


def _extended(grid: PolarGrid, one: BsdfSlice) -> Array:
    """More steps beyond and between the radial coordinates, so that the rim of the hemisphere is found in small cells."""
    if grid.frame == "normal":
        return np.linspace(0.0, 90.0, 19)
    sine = math.hypot(one.incident[0], one.incident[1])
    if grid.frame == "cosines":
        return np.linspace(max(1.0 - sine, 0.0), 1.0 + sine, 129)
    return np.linspace(max(90.0 - one.theta, 0.0), min(90.0 + one.theta, 180.0), 129)


@dataclasses.dataclass(frozen=True, eq=False)
class BsdfData:
    """A BSDF as a file holds it: slices, and components that are described by a model.

    Parameters
    ----------
    slices : sequence of BsdfSlice
        In any order.
    components : sequence of dict
        What a file describes by a model, in the keys of a scene's finishes: ``{"kind": "abg", "a": 0.1, …}``. Components and
        slices add up.
    isotropic : bool
        Whether turning the sample about its normal changes nothing: each slice then stands for all azimuths of incidence.
    mirrored : bool
        Whether the sample is its own mirror image in each plane of incidence.
    both_sides : bool
        Whether light that meets the back is treated as light that meets the front (nothing else is said about it).
    name, provenance, complaints, facts
        What the file calls it, where it comes from, what was not as it should be, and what else it says (text by name).
    format : str
        The format of the file that it was read from, by its name in the registry of formats; empty: of no file.

    Examples
    --------
    >>> BsdfData(components=({"kind": "lambertian", "reflectance": 0.5},), name="paint").wavelengths
    ()
    """

    slices: tuple[BsdfSlice, ...] = ()
    components: tuple[Mapping[str, Any], ...] = ()
    _: dataclasses.KW_ONLY
    isotropic: bool = True
    mirrored: bool = True
    both_sides: bool = True
    name: str = ""
    provenance: Provenance | None = None
    complaints: tuple[Complaint, ...] = ()
    facts: Mapping[str, str] = dataclasses.field(default_factory=dict)
    format: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "slices", tuple(self.slices))
        object.__setattr__(self, "components", tuple(self.components))
        object.__setattr__(self, "complaints", tuple(self.complaints))

    @property
    def wavelengths(self) -> tuple[float, ...]:
        """All that are stated [nm], in order."""
        return tuple(sorted({one.wavelength for one in self.slices if one.wavelength is not None}))
