"""`BsdfSlice`: a BSDF of one incidence at many scattered directions, what lies between them, and the share it scatters."""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.bsdf_directions import LEAN
from etendue.quantities.bsdf_holes import Filled, filled
from etendue.quantities.polar_grid import PolarGrid, specular_axes
from etendue.quantities.quadrature import gauss_legendre

Array = npt.NDArray[np.float64]

SIDE = 1e-6
"""Heights by which points may lie on the wrong side: rounding of files."""


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
    >>> from etendue.quantities.bsdf_directions import direction
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
    # Nodes lie on lines of either coordinate. Along a line of one azimuth the integral is a sum over the radial nodes as far
    # as the rim, of which f, linear between its own, takes fixed parts: the sums to each node are the same for all azimuths.
    j, k, v = _around(grid.azimuth, a % 360.0)
    f = (1.0 - v)[:, None] * one.held[j] + v[:, None] * one.held[k]
    i, u = _between(grid.radial, r)
    rim, parts = _projected(grid, r, a, one)
    within = np.searchsorted(r, rim, side="right")
    rows, last = np.arange(1, r.size + 1), np.minimum(i + 1, grid.radial.size - 1)
    found = np.zeros(a.size)
    for by_azimuth, by_radius in parts:
        sums = np.zeros((r.size + 1, grid.radial.size))
        sums[rows, i] = (1.0 - u) * by_radius * wr
        sums[rows, last] += u * by_radius * wr
        np.cumsum(sums, axis=0, out=sums)
        found += by_azimuth * np.einsum("ij,ij->i", sums[within], f)
    return float(np.radians(wa) @ found)


def _projected(grid: PolarGrid, r: Array, a: Array, one: BsdfSlice) -> tuple[Array, list[tuple[Array | float, Array]]]:
    """Projected solid angle over the product of steps of both coordinates, azimuths in radians.

    Returns
    -------
    array, shape (m,)
        The radial coordinate at each azimuth up to which there are directions on the side where light leaves.
    list of tuple
        Products whose sum it is up to there: a factor of each azimuth, shape (m,), or of all, and one of each radial
        coordinate, shape (n,).
    """
    turn, t = np.radians(a), np.radians(r)
    if grid.frame == "cosines":
        # |β₀ + r (cos a, sin a)|² = 1.
        sine = math.hypot(one.incident[0], one.incident[1])
        inside = np.sqrt(np.maximum(1.0 - np.square(sine * np.sin(turn)), 0.0)) - sine * np.cos(turn)
        return inside, [(1.0, r)]
    step = math.radians(1.0) * np.sin(t)
    if grid.frame == "normal":
        return np.full(a.size, 90.0), [(1.0, step * np.cos(t))]
    # Along the specular direction and along the direction at right angles to it, towards the normal.
    s, e, _ = specular_axes(one.incident, transmitted=one.transmitted)
    side = math.copysign(1.0, s[2])
    across, along = side * e[2] * np.cos(turn), side * float(s[2])
    return 90.0 + np.degrees(np.arctan2(across, along)), [(across, step * np.sin(t)), (along, step * np.cos(t))]


def _extended(grid: PolarGrid, one: BsdfSlice) -> Array:
    """More steps beyond and between the radial coordinates, so that the rim of the hemisphere is found in small cells."""
    if grid.frame == "normal":
        return np.linspace(0.0, 90.0, 19)
    sine = math.hypot(one.incident[0], one.incident[1])
    if grid.frame == "cosines":
        return np.linspace(max(1.0 - sine, 0.0), 1.0 + sine, 129)
    return np.linspace(max(90.0 - one.theta, 0.0), min(90.0 + one.theta, 180.0), 129)
