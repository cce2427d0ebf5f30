"""Values that were measured here and there, on a grid of |β − β₀| and azimuth: thesis appendix B, and better ways."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.extras import require
from etendue.quantities.arguments import SCANS, require_known
from etendue.quantities.arguments import require as require_kind
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint
from etendue.scatter.scans import harvey_shack
from etendue.scatter.scans.arms import AT_CENTRE, MOST_ARMS, ON_ARM, apart, arms_of, azimuths_of, beside
from etendue.scatter.scans.notices import BelowZero, Beyond, even_directions, outside
from etendue.scatter.scans.scans import NEAR, SAME, Scans
from etendue.scatter.scans.smoothing import require_light, smooth

Array = npt.NDArray[np.float64]
Interpolation = Callable[[Array, Array, Array, Array], tuple[Array, Array | None]]
"""Of an incidence, measured directions, values and wanted directions: values there, and their standard errors if known."""

SMALLEST = 1e-3
"""The smallest |β − β₀| above 0 of the grid, which the thesis leaves open: 0.06° at normal incidence."""

RADIAL, AZIMUTHS = 100, 36
"""Logarithmic steps of |β − β₀| to 2, and azimuths: those of the thesis."""

TURNED = 0.1
"""Azimuths of incidence that differ by less are one [°]."""

SMOOTHED = 2000
"""Values of an incidence up to which `smooth` is taken for scans: its time and memory grow with their square."""

SPARSE = 5.0
"""Values on each azimuth that was measured, on average, below which they are none: by chance 72 azimuths hold a few each."""

ON_A_LINE = 1e-9
"""Distance in U, V below which directions lie on a line: rounding of unit vectors."""

AUTOMATIC = "automatic"
"""In place of a method: the one that suits the scans."""


def radial_coordinates(smallest: float = SMALLEST) -> Array:
    """0, and 99 logarithmic steps to 2.

    Examples
    --------
    >>> radial_coordinates()[[0, 1, -1]].tolist()
    [0.0, 0.001, 2.0]
    """
    return np.concatenate([[0.0], np.geomspace(smallest, 2.0, RADIAL - 1)])


def _planar(incident: Array, scattered: Array) -> Array:
    r, a = harvey_shack.coordinates(incident, scattered)
    return np.column_stack([r * np.cos(np.radians(a)), r * np.sin(np.radians(a))])


def direction_cosines(incident: Array, measured: Array, values: Array, wanted: Array) -> tuple[Array, None]:
    """Linear over the triangles of the measured points in U, V, 0 outside them: the first scheme of appendix B.

    Raises
    ------
    ArgumentError
        If the directions make no triangle.
    MissingLibraryError
        Without SciPy.
    """
    spatial = require("scipy.spatial")
    try:
        triangles = spatial.Delaunay(_planar(incident, measured))
    except spatial.QhullError:
        found = (
            "the measured directions lie on a line in U, V, or are too few: there are no triangles to be linear over"
        )
        raise ArgumentError(found) from None
    inside = require("scipy.interpolate").LinearNDInterpolator(triangles, values, fill_value=0.0)
    return np.asarray(inside(_planar(incident, wanted))), None


def radial_basis(incident: Array, measured: Array, values: Array, wanted: Array) -> tuple[Array, None]:
    """A sum of distances to the measured points in U, V, each times a weight, and a constant: through ln f.

    f counts as no less than a thousandth of the least value. Thin plates are closer to f between scattered points, but go
    on along their slope beyond scans in two planes, and lose up to 15 % of the light there at 75°.

    Raises
    ------
    ArgumentError
        If no value is above 0, or one is below.
    MissingLibraryError
        Without SciPy.
    """
    require_light(values)
    if (values < 0.0).any():
        raise ArgumentError(f"{(values < 0.0).sum()} of {values.size} values are below 0, and have no logarithm")
    # A direction that was measured several times counts once.
    points, own = np.unique(np.round(_planar(incident, measured), 9), axis=0, return_inverse=True)
    mean = np.bincount(own.ravel(), values) / np.bincount(own.ravel())
    logs = np.log(np.maximum(mean, 1e-3 * values[values > 0.0].min()))
    surface = require("scipy.interpolate").RBFInterpolator(points, logs, kernel="linear")
    return np.asarray(np.exp(np.minimum(surface(_planar(incident, wanted)), np.log(values.max())))), None


def shepard(incident: Array, measured: Array, values: Array, wanted: Array) -> tuple[Array, None]:
    """Means weighted with the inverse square of the distance in U, V [Shepard1968]_."""
    points, at = _planar(incident, measured), _planar(incident, wanted)
    square = np.sum((at[:, None, :] - points) ** 2, axis=-1)
    weights = 1.0 / np.maximum(square, 1e-18)
    return np.asarray(weights @ values / weights.sum(axis=1)), None


RINGS, SPOKES = 160, 144
"""Cells on which areas are counted by natural neighbours: in ln |β − β₀|, and in azimuth."""


def natural_neighbours(incident: Array, measured: Array, values: Array, wanted: Array) -> tuple[Array, None]:
    """Means weighted with the area in U, V that a point would take from each of the measured ones [Sibson1981]_.

    Areas are counted on cells that get smaller towards the specular direction, where scans are dense: a cell is taken by the
    point if that is nearer than all measured ones.
    """
    # A direction that was measured several times counts once.
    points, own = np.unique(np.round(_planar(incident, measured), 9), axis=0, return_inverse=True)
    mean = np.bincount(own.ravel(), values) / np.bincount(own.ravel())
    edges = np.concatenate([[0.0], np.geomspace(1e-4, 2.0, RINGS)])
    r = np.sqrt(0.5 * (edges[1:] ** 2 + edges[:-1] ** 2))
    a = (np.arange(SPOKES) + 0.5) * (2.0 * np.pi / SPOKES)
    cells = np.stack([r[:, None] * np.cos(a), r[:, None] * np.sin(a)], axis=-1).reshape(-1, 2)
    area = np.repeat(np.diff(edges**2), SPOKES)
    owner, reach = _nearest(cells, points)
    at = _planar(incident, wanted)
    found = mean[_nearest(at, points)[0]]
    for start in range(0, len(at), 256):
        square = _squares(at[start : start + 256], cells)
        taken = np.where(square < reach, area, 0.0)
        whole = taken.sum(axis=1)
        some = whole > 0.0
        found[start : start + 256][some] = ((taken @ mean[owner])[some]) / whole[some]
    return found, None


def _squares(a: Array, b: Array) -> Array:
    """Squares of the distances of all points of one list from all of another."""
    return np.asarray(np.sum(a * a, axis=1)[:, None] + np.sum(b * b, axis=1) - 2.0 * (a @ b.T))


def _nearest(at: Array, points: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """The nearest of some points, and the square of its distance."""
    found, square = np.zeros(len(at), np.intp), np.zeros(len(at))
    step = max(1, (1 << 22) // len(points))
    for start in range(0, len(at), step):
        all_of_them = _squares(at[start : start + step], points)
        found[start : start + step] = all_of_them.argmin(axis=1)
        square[start : start + step] = all_of_them.min(axis=1)
    return found, square


def specular_centred(incident: Array, measured: Array, values: Array, wanted: Array) -> tuple[Array, None]:
    """Linear in the angle from the specular direction and the azimuth about it, 0 at the horizon: the second scheme.

    The measured points form scans at some azimuths about the specular direction; where only one side was scanned, the other
    is its mirror image. The rotations of eqs. B.3 and B.4 are those of `PolarGrid` ("specular"); the dense set of step 3 is
    left out, since the grid is read from the interpolation itself.

    Raises
    ------
    ArgumentError
        If the points do not form scans through the specular direction.
    """
    frame = PolarGrid("specular", np.zeros(1), np.zeros(1))
    r, a = frame.coordinates(measured, incident, transmitted=False)
    centre = r < AT_CENTRE
    arms = arms_of(r[~centre], a[~centre])
    peak = float(values[centre].mean()) if centre.any() else None
    curves = []
    for azimuth in arms:
        own = ~centre & (apart(a, azimuth) < ON_ARM)
        if not own.any():
            # The mirror image in the plane of incidence.
            own = ~centre & (apart(a, -azimuth) < ON_ARM)
        # A direction that was measured several times counts once.
        x, place = np.unique(np.round(r[own], 6), return_inverse=True)
        y = np.bincount(place.ravel(), values[own]) / np.bincount(place.ravel())
        start = [(0.0, peak if peak is not None else float(y[0]))]
        edge = horizon(incident, azimuth)
        inner = x < edge - 1e-6
        points = [*start, *zip(x[inner].tolist(), y[inner].tolist(), strict=True), (edge, 0.0)]
        curves.append(np.array(points).T)
    at_r, at_a = frame.coordinates(wanted, incident, transmitted=False)
    table = np.stack([np.interp(at_r, *curve) for curve in curves])
    ring = np.append(arms, arms[0] + 360.0)
    k = np.clip(np.searchsorted(ring, arms[0] + (at_a - arms[0]) % 360.0, side="right") - 1, 0, len(arms) - 1)
    t = ((at_a - ring[k]) % 360.0) / (ring[k + 1] - ring[k])
    columns = np.arange(at_r.size)
    return (1.0 - t) * table[k, columns] + t * table[(k + 1) % len(arms), columns], None


def horizon(incident: Array, azimuth: float) -> float:
    """Angle from the specular direction to the surface [°], at an azimuth about it that counts from the side of the normal.

    Examples
    --------
    >>> [round(horizon(np.array([-0.6, 0.0, 0.8]), a), 2) for a in (0.0, 90.0, 180.0)]
    [126.87, 90.0, 53.13]
    """
    # Heights are cos t · s_z + sin t · cos φ · e_z, with e_z = √(1 − s_z²).
    slope = np.cos(np.radians(azimuth)) * np.sqrt(max(0.0, 1.0 - incident[2] ** 2))
    return float(np.degrees(np.arctan2(incident[2], -slope)))


METHODS: dict[str, Interpolation] = {
    "specular-centred": specular_centred,
    "direction-cosines": direction_cosines,
    "natural-neighbours": natural_neighbours,
    "radial-basis": radial_basis,
    "shepard": shepard,
    "smooth": smooth,
}
"""Ways from scattered values to a grid, by name."""

LINEAR = ("specular-centred", "direction-cosines", "natural-neighbours", "shepard")
"""Those whose values are means of the measured ones: standard errors of these become some of the table."""


LOGARITHMIC = ("radial-basis", "smooth")
"""Those that take logarithms, and need light."""


GOING_ON = ("natural-neighbours", "radial-basis", "shepard", "smooth")
"""Those that go on with f beyond the measured directions; the others have nothing at the horizon, or outside."""


def _light_beyond(one: BsdfSlice, method: str, incident: Array, measured: Array) -> float:
    """The share of the light of a slice outside the measured directions, or for `smooth` further out than the furthest."""
    to = even_directions()
    points, wanted = _planar(incident, measured), _planar(incident, to)
    furthest = np.hypot(*points.T).max() + ON_A_LINE
    there = np.hypot(*wanted.T) > furthest if method == "smooth" else outside(points, wanted)
    behind = to[there] * [1.0, 1.0, -1.0 if one.transmitted else 1.0]
    return float(one.at(behind).sum()) * np.pi / len(to)


def suited(scans: Scans) -> tuple[str, str]:
    """The method for scans of which nothing else is known, and why it is not the usual one.

    Between scans through the specular direction lobes are round in |β − β₀|, as `smooth` takes them: those that are round in
    the angle from that direction, as of the second scheme of the thesis, would hold up to 1/cos θ times the light that was
    measured in the plane of incidence. Scattered values are interpolated between all their neighbours.

    Parameters
    ----------
    scans : Scans
        All incidences.

    Returns
    -------
    str, str
        One of `METHODS`, and the reason; "smooth" has none if there are scans on two sides.

    Raises
    ------
    ArgumentError
        If there are fewer than two values beside the specular direction at an incidence.

    Examples
    --------
    >>> to = np.random.default_rng(1).uniform(-0.6, 0.6, (400, 3)) * [1, 1, 0] + [0, 0, 1]
    >>> to /= np.linalg.norm(to, axis=1, keepdims=True)
    >>> suited(Scans(np.tile([0.0, 0.0, 1.0], (400, 1)), to, np.full(400, 0.25)))[0]
    'natural-neighbours'
    """
    counts, most, scattered = [], 0, False
    for incident, own in scans.by_incidence():
        r, a = beside(scans, incident, own)
        if r.size < 2:
            raise ArgumentError("fewer than two values beside the specular direction: nothing to interpolate")
        azimuths = azimuths_of(r, a)
        measured = sum(bool((apart(a, each) < ON_ARM).any()) for each in azimuths)
        scattered |= len(azimuths) > MOST_ARMS or r.size < SPARSE * measured
        counts.append(len(azimuths))
        most = max(most, r.size)
    if scattered:
        most_azimuths = f"{max(counts)} azimuths" if max(counts) > 1 else "one azimuth"
        why = f"the values lie at {most_azimuths} about the specular direction, and make no scans through it"
        return "natural-neighbours", why
    if min(counts) < 2:
        return (
            "smooth",
            "the values lie at one azimuth about the specular direction; f counts as the same at the others",
        )
    if most > SMOOTHED:
        return "specular-centred", f"there are {most:,} values of one incidence, too many for `smooth`"
    if not (scans.values > 0.0).any():
        return "specular-centred", "no value is above 0"
    return "smooth", ""


def _workable(scans: Scans) -> list[str]:
    """The methods that can make a table of scans."""
    found = dict.fromkeys(METHODS)
    for incident, own in scans.by_incidence():
        r, a = beside(scans, incident, own)
        points = _planar(incident, scans.scattered[own])
        if r.size < 2 or not 2 <= len(azimuths_of(r, a)) <= MOST_ARMS:
            found.pop("specular-centred", None)
        if np.linalg.matrix_rank(points - points[0], tol=ON_A_LINE) < 2:
            found.pop("direction-cosines", None)
        if not (scans.values[own] > 0.0).any():
            for name in LOGARITHMIC:
                found.pop(name, None)
        if (scans.values[own] < 0.0).any():
            found.pop("radial-basis", None)
    return list(found)


def tabulated(scans: Scans, method: str = AUTOMATIC, smallest: float = SMALLEST) -> BsdfData:
    """A table on 100 logarithmic |β − β₀| and 36 azimuths for each incidence.

    Parameters
    ----------
    scans : Scans
        All incidences.
    method : str
        One of `METHODS`, or "automatic" for the one that suits the scans; a note says which and why, if it is not the usual.
    smallest : float
        The smallest |β − β₀| above 0.

    Returns
    -------
    BsdfData
        Isotropic if all light comes from one azimuth; the fact "interpolation" says how it was made. Scaled to
        `scans.reflectance` and `scans.transmittance` where these are known; `stated` is the share before. Values below 0
        count in it, with a note; so the noise of dark samples does not become light. With standard
        errors where the scans have some and the method is linear, or finds its own (`smooth`).

    Raises
    ------
    UnknownNameError
        If there is no such method.
    ArgumentError
        If the values do not suit it.
    MissingLibraryError
        If it needs a library that is not installed.

    Examples
    --------
    >>> from etendue.quantities.bsdf_directions import direction
    >>> incident = direction(30.0, 180.0)
    >>> scattered = np.concatenate([direction(np.arange(0.0, 85.0, 5.0), a) for a in (0.0, 90.0, 180.0)])
    >>> flat = Scans(np.tile(incident, (len(scattered), 1)), scattered, np.full(len(scattered), 0.25))
    >>> round(tabulated(flat, method="shepard").slices[0].integral(), 3)
    0.785
    """
    require_kind(scans, Scans, "scans", SCANS)
    require_known(method, (*METHODS, AUTOMATIC), "method of interpolation")
    turns: list[float] = []
    for incident, _ in scans.by_incidence():
        phi = _azimuth(incident)
        if phi is not None and all(apart(np.array(phi), other) > TURNED for other in turns):
            turns.append(phi % 360.0)
    complaints: list[Complaint] = []
    slices: list[BsdfSlice] = []
    methods: list[str] = []
    for transmitted in (False, True):
        way = scans.way(transmitted=transmitted)
        if way is None:
            continue
        own, why = suited(way) if method == AUTOMATIC else (method, "")
        told = f"method {own}" + (" for transmitted light" if transmitted else "")
        complaints += [Complaint("note", told, why)] if why else []
        methods += [own] if own not in methods else []
        below, beyond = BelowZero(), Beyond()
        slices += _slices(way, own, radial_coordinates(smallest), turns, (below, beyond), transmitted=transmitted)
        light = f"{'transmitted' if transmitted else 'reflected'} light"
        complaints += [*below.told(way.values, light), *beyond.told(light)]
    return BsdfData(
        tuple(slices),
        isotropic=len(turns) <= 1,
        mirrored=False,
        name="scans",
        complaints=tuple(complaints),
        facts={"interpolation": ", ".join(methods)},
    )


def _slices(
    scans: Scans,
    method: str,
    radial: Array,
    turns: Sequence[float],
    notices: tuple[BelowZero, Beyond],
    *,
    transmitted: bool,
) -> Iterator[BsdfSlice]:
    """A slice for each incidence of what is reflected, or of the mirror image of what is transmitted."""
    for measured, own in scans.by_incidence():
        incident = measured
        if _azimuth(measured) is None and len(turns) == 1:
            # The sample was not turned: the plane of incidence is the same along the normal.
            incident = light_from(0.0, turns[0])
        elif _azimuth(measured) is None and np.abs(measured[:2]).max() > SAME:
            incident = np.array([0.0, 0.0, 1.0])
        # The azimuth of PolarGrid counts from the forward direction, that of Harvey and Shack from 90° before it.
        grid = PolarGrid("cosines", radial, np.linspace(0.0, 360.0, AZIMUTHS, endpoint=False, dtype=np.float64))
        at = grid.directions(incident, transmitted=False)
        there = ~np.isnan(at[..., 0])
        try:
            f, error = METHODS[method](incident, scans.scattered[own], scans.values[own], at[there])
        except ArgumentError as mistake:
            others = [name for name in _workable(scans) if name != method]
            raise ArgumentError(f"{method}: {mistake}. Methods that take these scans: {', '.join(others)}") from None
        of_values = None if scans.standard_error is None else scans.standard_error[own]
        if of_values is not None and (method in LINEAR or (method == "smooth" and of_values.any())):
            # No less than that of a mean: as if all values that count for a place erred together.
            together, _ = METHODS[method](incident, scans.scattered[own], of_values, at[there])
            error = together if error is None else np.maximum(error, together)
        values, errors = np.full(grid.shape, np.nan), None
        # Without noise below 0 there is but rounding.
        negative = (scans.values[own] < 0.0).any()
        values[there] = f if negative else np.maximum(f, 0.0)
        if error is not None:
            errors = np.full(grid.shape, np.nan)
            errors[there] = error
        # The same grid of direction cosines, on the side where the light leaves.
        one = BsdfSlice(incident, values, transmitted, grid=grid)
        share = one.integral()
        if negative:
            lifted = values.copy()
            lifted[there], _ = METHODS[method](
                incident, scans.scattered[own], np.maximum(scans.values[own], 0.0), at[there]
            )
            notices[0].note(one.theta, share, dataclasses.replace(one, values=lifted).integral())
        if method in GOING_ON:
            notices[1].note(one.theta, share, _light_beyond(one, method, incident, scans.scattered[own]))
        factor = 1.0
        if scans.reflectance is not None:
            if not share > 0.0:
                raise ArgumentError("nothing is scattered: the values cannot be scaled to a share of the light")
            factor = scans.reflectance / share
        scaled = None if errors is None else errors * factor
        yield dataclasses.replace(one, values=values * factor, stated=share, standard_error=scaled, interpolated=True)


def share_error(one: BsdfSlice) -> float:
    """How far the share of a slice before scaling may be off, if all its values err together; NaN without standard errors.

    Parameters
    ----------
    one : BsdfSlice
        Of a table of scans.

    Examples
    --------
    >>> grid = PolarGrid("normal", [0.0, 90.0], [0.0])
    >>> flat = {"values": [[0.2, 0.2]], "standard_error": [[0.01, 0.01]], "stated": 0.6}
    >>> round(share_error(BsdfSlice(light_from(0.0, 0.0), grid=grid, **flat)), 6)
    0.03
    """
    if one.standard_error is None or one.stated is None:
        return float("nan")
    off = dataclasses.replace(one, values=one.standard_error, standard_error=None).integral()
    return one.stated * off / one.integral()


def _azimuth(incident: Array) -> float | None:
    """Of where light comes from [°]; None along the normal."""
    across = float(np.hypot(incident[0], incident[1]))
    return float(np.degrees(np.arctan2(incident[1], incident[0]))) if across > NEAR else None
