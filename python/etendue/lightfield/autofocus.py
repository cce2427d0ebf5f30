"""Which carrier surface suits a ray set: the meaning of ``surface="auto"``."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.lightfield.counting import FloatArray
from etendue.lightfield.enclosures import ball_centre, cylinder_of_lines, near_rays, start_centre
from etendue.lightfield.jury import Grid, Jury, Verdict
from etendue.lightfield.probe import FEWEST, even_density, probe_rays
from etendue.lightfield.surfaces import SLACK, Box, Cylinder, Disk, Dome, Hemisphere, Part, Plane, Sphere, Surface
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream, checked_threads

PROBE = 1 << 17
"""Rays on which surfaces are compared."""

SCOUTS = 1 << 15
"""Rays on which depths are compared over the whole range, and surfaces of one kind with each other."""

ENOUGH = 1 << 12
"""Scouts from which on one fold of them is enough."""

MANY = 1 << 16
"""Rays from which on fine grids say more than coarse ones."""

LEAD = 3.0
"""Standard errors of the difference by which a less simple surface must lead."""

MOST_UNMET = 0.01
"""Share of the flux, beside that of strays, from which a surface that leaves it unmet is not chosen."""

TINY = 1e-9
"""Size of a source against its coordinates below which rounding alone may have made it."""

FLATS: tuple[tuple[type[Plane | Disk], bool], ...] = ((Plane, False), (Disk, False), (Plane, True), (Disk, True))
"""Flat surfaces that are tried: kind, and whether only for rays that cross the depth within the ball about the source."""

NESTED = (0.15, 0.02, 1e-3)
"""Shares of the rays beyond each side of nested rectangles on which depths are compared: a die, and what lies about it."""

COARSE = (4, 2)
"""Grid on which few rays compare depths, and surfaces of one kind."""

SHARP = (5, 3)
"""Grid on which many rays seek the sharpest depth; few rays halve each coordinate once less, here and below."""

FINER = {(5, 2): ((5, 3), (6, 2)), (3, 4): ((3, 5), (4, 4))}
"""Grids on which many rays compare kinds, then finer ones for those that are not hopeless."""

HOPELESS = 0.15
"""Lag behind the best score [nat] from which finer grids are not tried."""

STEP = 0.125
"""Steps of depth in which the source is searched, in radii of the smallest ball about it."""

REACH = 8
"""Doublings of that radius over which depths outside the ball are tried."""

FINE = 0.01
"""Share of two steps to which the sharpest depth is found."""

NEAR = 0.15
"""Share of two steps to either side of where the scouts see it among which all of the jury seeks it."""

BACKWARDS = 0.5
"""Share of the flux towards −Z from which surfaces that shine towards +Z alone are not tried."""

ASLANT = 0.3
"""Length of the mean direction, from which on a source has a front, and the most of it along Z of one that looks aside."""


@dataclasses.dataclass(frozen=True)
class SurfaceScore:
    """One surface that was tried.

    Parameters
    ----------
    surface : Surface
        With all its dimensions.
    score, score_error : float
        Mean ln of the density in étendue [1/(mm² sr)] at held-out rays, and its standard error.
    lag, lag_error : float
        By how much the score lies below that of the chosen surface, and the standard error of the difference.
    unmet : float
        Share of the flux that does not meet the surface.
    """

    surface: Surface
    score: float
    score_error: float
    lag: float
    lag_error: float
    unmet: float


@dataclasses.dataclass(frozen=True)
class SurfaceChoice:
    """The carrier surface that suits a ray set, and why.

    Parameters
    ----------
    surface : Surface
        With all its dimensions.
    table : tuple of SurfaceScore
        The best surface of each kind, the best score first.
    depths : tuple of float, or None
        The depths tried that come next to the chosen one, below and above, and are worse for sure [mm]; what lies between
        cannot be told from it. The lowest and highest that were tried, if none is worse; None if no depth was sought.
    notes : tuple of str
        The choice in words.
    """

    surface: Surface
    table: tuple[SurfaceScore, ...]
    depths: tuple[float, float] | None
    notes: tuple[str, ...]


def choose_surface(rays: RayStream, *, seed: int = 1, threads: int | None = None) -> SurfaceChoice:
    """The surface on which the light field foretells held-out rays best; of several as good, the simplest.

    Luminance is the same all along a ray, so any surface that all rays meet can carry the field, and which one it is, is a
    matter of how few rays tell it: one on which place and direction have sharp edges of their own, and no room is wasted.
    Tried are, the simplest first,

    - a rectangle and a disk, at the depth at which the source is sharpest, if no more than half the light heads
      towards −Z;
    - a hemisphere that all rays come out of, about the centre of the smallest ball that their lines pass, or of the
      sphere on which they start, whichever is the smaller;
    - a dome about the same centre: a window at the depth of the rectangle, and a hemisphere for what does not pass it;
    - a sphere about it;
    - a cylinder about Z: the smallest that all lines meet, or about their start points;
    - a box about their start points.

    A field of up to 2¹⁶ cells per part, on a uniform base, is fitted to four fifths of some 130 thousand rays and judged on
    the others; see `Jury`. A surface replaces a simpler one if it leads by three standard errors of the difference. None is
    chosen that leaves more than a hundredth of the flux unmet, beside that of strays far off.

    Parameters
    ----------
    rays : RayStream
        With positions.
    seed : int
        Of which rays are held out.
    threads : int, optional
        All cores if None. The choice is the same for any number.

    Raises
    ------
    ArgumentError
        If the rays have no position, carry no flux, or fewer than 25 do.

    Examples
    --------
    >>> import etendue as et
    >>> choice = choose_surface(et.RingSource(rays=20_000))
    >>> choice.surface.NAME, choice.surface.z, round(choice.surface.radius, 1)
    ('disk', 0.0, 30.0)
    """
    threads = checked_threads(threads)
    some = probe_rays(rays, PROBE)
    if len(some) < FEWEST:
        raise ArgumentError(
            f"{len(some)} rays with flux are too few to choose a surface by; state one, such as surface='sphere'."
        )
    return _Search(some, seed, threads).choice()


@dataclasses.dataclass(frozen=True, eq=False)
class _Tried:
    """A surface and its verdict."""

    surface: Surface
    verdict: Verdict


class _Search:
    """The rays of the probe, what they tell of the source's place and size, and the jury."""

    def __init__(self, rays: RaySet, seed: int, threads: int | None) -> None:
        focus = np.array(rays.virtual_focus.point)
        near = near_rays(rays.position, rays.direction, focus)
        self.rays, self.seed = _some(rays, near), seed
        self.few = probe_rays(self.rays, SCOUTS)
        self.position, self.direction = self.rays.position, self.rays.direction
        self.up = self.direction[:, 2] > 0
        self.centre = ball_centre(self.position, self.direction, focus, seed)
        self.start_centre = start_centre(self.position)
        self.least = TINY * float(np.abs(self.position).max())
        self.radius = self.sphere(self.centre).closed("radius")
        even = even_density(rays)
        self.jury = Jury.of(rays, even, seed, threads)
        self.scouts = Jury.of(probe_rays(rays, SCOUTS), even, seed, threads, ENOUGH)
        self.less = 0 if len(rays) >= MANY else 1
        self.most_unmet = MOST_UNMET + 1.0 - float(self.rays.flux.sum() / rays.flux.sum())

    def choice(self) -> SurfaceChoice:
        """Try all kinds, then take the simplest that none beats."""
        kinds: list[Sequence[Surface]] = []
        depths = None
        flux = self.rays.flux
        backwards = float(flux[~self.up].sum() / flux.sum())
        if backwards <= BACKWARDS and np.count_nonzero(self.up) >= FEWEST:
            z, depths = self.depth()
            flats = self.flats(z)
            kinds += [[s for s in flats if isinstance(s, kind)] for kind in (Plane, Disk)]
            kinds += [self.hemispheres(z), self.domes(z)]
        kinds += filter(None, [self.spheres(), self.cylinders(), [Box().sized_for(self.rays)]])
        finalists = self.finals([self.best(kind, self.scouts, COARSE).surface for kind in kinds])
        able = [t for t in finalists if t.verdict.unmet <= self.most_unmet]
        winner = able[0]
        for challenger in able[1:]:
            if challenger.verdict.leads(winner.verdict, LEAD):
                winner = challenger
        table = _table(finalists, winner)
        return SurfaceChoice(winner.surface, table, depths, tuple(self.notes(winner, table, depths)))

    def best(self, kind: Sequence[Surface], jury: Jury, grid: Grid) -> _Tried:
        """Of surfaces of one kind the best; of those that meet enough of the flux, if there are any."""
        verdicts = jury.judge_all([(surface.parts(), grid) for surface in kind])
        tried = [_Tried(surface, verdict) for surface, verdict in zip(kind, verdicts, strict=True)]
        able = [t for t in tried if t.verdict.unmet <= self.most_unmet]
        return max(able or tried, key=lambda t: t.verdict.score.mean)

    def finals(self, surfaces: list[Surface]) -> list[_Tried]:
        """The surfaces as the whole jury sees them, each on the grid that suits it; but for the hopeless."""

        def judged(pairs: list[tuple[Surface, Grid]]) -> dict[tuple[Surface, Grid], Verdict]:
            grids = [(surface.parts(), (place - self.less, turn - self.less)) for surface, (place, turn) in pairs]
            return dict(zip(pairs, self.jury.judge_all(grids), strict=True))

        seen = judged([(surface, grid) for surface in surfaces for grid in FINER])
        best = {s: max(FINER, key=lambda grid: seen[s, grid].score.mean) for s in surfaces}
        enough = max(verdict.score.mean for verdict in seen.values()) - HOPELESS
        hopeful = [(s, grid) for s, grid in best.items() if seen[s, grid].score.mean > enough]
        seen |= judged([(s, finer) for s, grid in hopeful for finer in FINER[grid]])
        return [
            _Tried(s, max((v for (t, _), v in seen.items() if t == s), key=lambda v: v.score.mean)) for s in surfaces
        ]

    # --- depth ---------------------------------------------------------------------------------------------------------

    def depth(self) -> tuple[float, tuple[float, float]]:
        """The simplest of the depths that are as good as any, and those next to it that are not [mm].

        Nested rectangles, which fit any source well enough, tell the scouts where it is about. There the rectangle or disk
        decides that suits the source best: its own edge is what tells depths apart best.
        """
        about, steps = self.about()
        flats = {f: self.flat(*f, about, self.few) for f in FLATS}
        kind, within = max(flats, key=lambda f: self.scouts.judge(flats[f].parts(), COARSE).score.mean)
        seen: dict[float, Verdict] = {}

        def score(z: float) -> float:
            grid = (SHARP[0] - self.less, SHARP[1] - self.less)
            seen[z] = self.jury.judge(self.flat(kind, within, z, self.few).parts(), grid)
            return seen[z].score.mean

        _golden(score, about - NEAR * steps, about + NEAR * steps, FINE * steps)
        sharpest = max(seen, key=lambda z: seen[z].score.mean)
        simple = _rounder(sharpest, NEAR * steps, FINE * steps)
        if np.ptp(self.position[:, 2]) <= SLACK * self.radius:
            simple.insert(0, float(self.position[0, 2]))
        for z in simple:
            score(z)
            if not seen[sharpest].leads(seen[z], LEAD):
                break
        else:
            z = sharpest
        alike = [z for z, verdict in seen.items() if not seen[sharpest].leads(verdict, LEAD)]
        below, above = [z for z in seen if z < min(alike)], [z for z in seen if z > max(alike)]
        return z, (max(below, default=min(alike)), min(above, default=max(alike)))

    def about(self) -> tuple[float, float]:
        """About where the source is sharpest, and the length of two steps [mm]: to the scouts, over the whole range."""
        near = np.arange(-1.0, 1.0 + STEP, STEP)
        far = 2.0 ** np.arange(1, REACH + 1)
        places = self.centre[2] + self.radius * np.concatenate([-far[::-1], near, far])
        verdicts = self.scouts.judge_all([(self.nested(z), COARSE) for z in places])
        at = int(np.clip(np.argmax([verdict.score.mean for verdict in verdicts]), 1, len(places) - 2))
        low, high = float(places[at - 1]), float(places[at + 1])

        def score(z: float) -> float:
            return self.scouts.judge(self.nested(z), COARSE).score.mean

        return _golden(score, low, high, NEAR * (high - low)), high - low

    def nested(self, z: float) -> tuple[Part, ...]:
        """Rectangles at a depth, each within the next, the smallest first; by some of the rays."""
        hit = _crossings(self.few, z)
        return tuple(_rectangle(z, hit, trim).parts()[0] for trim in NESTED)

    # --- what is tried -------------------------------------------------------------------------------------------------

    def flats(self, z: float) -> list[Plane | Disk]:
        """Rectangles and disks at a depth, for all rays and for those that cross it within the ball."""
        return list(dict.fromkeys(self.flat(kind, within, z, self.rays) for kind, within in FLATS))

    def flat(self, kind: type[Plane | Disk], within: bool, z: float, rays: RaySet) -> Plane | Disk:
        """The smallest rectangle or disk at a depth for some rays, or for those of them that cross it within the ball."""
        if within:
            up = rays.direction[:, 2] > 0
            near = np.hypot(*(_crossings(rays, z) - self.centre[:2]).T) <= self.radius * (1 + SLACK)
            if near.any():
                up[up] = near
                rays = _some(rays, up)
        part = Plane(z=z).sized_for(rays).parts()[0]
        (x, y, _), (width, height) = part.centre, (max(length, self.least) for length in part.size)
        if kind is Plane:
            return Plane(z, width, height, (x, y))
        return Disk(max(Disk(z=z, centre=(x, y)).sized_for(rays).closed("radius"), self.least), z, (x, y))

    def centres(self) -> list[FloatArray]:
        """Of the ball, and of the sphere on which the rays start, if they do."""
        return [self.centre, *([] if self.start_centre is None else [self.start_centre])]

    def sphere(self, centre: FloatArray) -> Sphere:
        """The smallest about a centre that the rays allow."""
        sphere = Sphere(centre=_triple(centre)).sized_for(self.rays)
        return dataclasses.replace(sphere, radius=max(sphere.closed("radius"), self.least))

    def hemispheres(self, z: float) -> list[Surface]:
        """As small as the rays allow, also with the rim at a depth, and where few lines leave below it."""
        centres = [*self.centres(), *(np.array([*self.centre[:2], rim]) for rim in (z, self.rim()))]
        spheres = [self.sphere(c) for c in centres]
        return [Hemisphere(sphere.radius, sphere.centre) for sphere in spheres]

    def rim(self) -> float:
        """The height near the ball's centre at which the least flux leaves a hemisphere through its floor [mm].

        Of a hemisphere the height of the smallest ball is ill-defined: only lines that graze the rim hold it.
        """
        offset, k, flux = self.few.position - self.centre, self.few.direction, self.few.flux

        def kept(height: float) -> float:
            x = offset - (0.0, 0.0, height)
            middle = -np.sum(x * k, axis=1)
            near = np.sum(x**2, axis=1) - middle**2
            leaves = x[:, 2] + (middle + np.sqrt(near.max() - near)) * k[:, 2]
            return float(flux[leaves >= 0.0].sum())

        return float(self.centre[2]) + _golden(kept, -STEP * self.radius, STEP * self.radius, FINE * STEP * self.radius)

    def spheres(self) -> list[Surface]:
        """As small as the rays allow."""
        return [self.sphere(c) for c in self.centres()]

    def domes(self, z: float) -> list[Surface]:
        """With a window as wide as the dome, and with one about what is brightest."""
        domes: list[Surface] = []
        for x, y, _ in self.centres():
            radius = self.sphere(np.array([x, y, z])).closed("radius")
            window = _window(np.hypot(*(_crossings(self.rays, z) - (x, y)).T), radius)
            windows = (None,) if window is None or window < self.least else (None, window)
            domes += [Dome(radius, z, width, (float(x), float(y))) for width in windows]
        return domes

    def cylinders(self) -> list[Surface]:
        """About the start points, unless they are flat; and the smallest that all lines meet."""
        low, high = self.position.min(axis=0), self.position.max(axis=0)
        starts = Cylinder(centre=(float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2))
        lines = cylinder_of_lines(self.position, self.direction, self.centre, self.seed)
        flat = high[2] - low[2] <= FINE * self.radius
        return [*([] if flat else [starts.sized_for(self.rays)]), *([] if lines is None else [lines])]

    # --- in words --------------------------------------------------------------------------------------------------------

    def judged(self, row: SurfaceScore) -> str:
        """A surface that was not chosen: how well it predicts against the chosen one, and why it was not if it is better."""
        told = f"{row.surface.NAME} {-row.lag:+.4f} ± {row.lag_error:.4f}".replace("-", "−")
        if row.unmet > self.most_unmet:
            return f"{told}, but {row.unmet:.2%} of the flux does not meet it"
        return told if row.lag > 0.0 else f"{told}, not for sure better and less simple"

    def notes(
        self, winner: _Tried, table: tuple[SurfaceScore, ...], depths: tuple[float, float] | None
    ) -> Iterator[str]:
        """What the user should know of the choice."""
        others = ", ".join(self.judged(row) for row in table if row.surface != winner.surface)
        yield (
            f"carrier surface {winner.surface.spec}: of those that take up the light, the simplest that none surpasses "
            f"for sure in predicting rays held out of the fit ({len(self.jury.flux):,} rays, the same for all; ln "
            f"likelihood per ray against it: {others})"
        )
        if depths is not None and isinstance(winner.surface, Plane | Disk | Dome):
            yield f"depths between {depths[0]:.6g} and {depths[1]:.6g} mm cannot be told from that of {winner.surface.spec}"
        mean = np.average(self.direction, weights=self.rays.flux, axis=0)
        if np.linalg.norm(mean) > ASLANT and mean[2] < ASLANT * np.linalg.norm(mean):
            x, y, z = mean / np.linalg.norm(mean)
            yield (
                f"the light heads towards ({x:.2f}, {y:.2f}, {z:.2f}) on average; planes, disks, hemispheres and domes "
                "shine towards +Z: turn the rays with rays.rotated(axis, angle) if one of these would suit the source"
            )


def _table(finalists: list[_Tried], winner: _Tried) -> tuple[SurfaceScore, ...]:
    """One row for each kind."""
    rows = []
    for tried in sorted(finalists, key=lambda t: -t.verdict.score.mean):
        score = tried.verdict.score
        lag, lag_error = winner.verdict.score.lead(score)
        rows.append(SurfaceScore(tried.surface, score.mean, score.error, lag, lag_error, tried.verdict.unmet))
    return tuple(rows)


def _window(reach: FloatArray, radius: float) -> float | None:
    """Radius of the window of a dome, from how far from its axis the rays cross it; None if as wide as the dome.

    Of two levels of luminance, one on the window and one on the hemisphere, these radii are the most likely.
    """
    shares = np.linspace(0.05, 0.995, 190)
    edges = np.quantile(reach, shares)
    shares, edges = shares[(edges > 0.0) & (edges < radius)], edges[(edges > 0.0) & (edges < radius)]
    if not len(edges):
        return None
    likelihood = shares * np.log(shares / edges**2) + (1.0 - shares) * np.log((1.0 - shares) / (2.0 * radius**2))
    return float(edges[np.argmax(likelihood)])


def _some(rays: RaySet, which: npt.NDArray[np.bool_]) -> RaySet:
    """Some of the rays."""
    return RaySet(rays.position[which], rays.direction[which], rays.flux[which], flux_unit=rays.flux_unit)


def _rectangle(z: float, hit: FloatArray, trim: float) -> Plane:
    """The rectangle at a depth that leaves out a share of the crossings beyond each of its sides."""
    low, high = np.quantile(hit, [trim, 1 - trim], axis=0)
    room = np.where(high > low, (high - low) * (1 + SLACK), 1e-3)
    middle = (low + high) / 2
    return Plane(z, float(room[0]), float(room[1]), (float(middle[0]), float(middle[1])))


def _golden(score: Callable[[float], float], low: float, high: float, width: float) -> float:
    """Where the score is greatest, by golden section down to a width."""
    ratio = (math.sqrt(5.0) - 1.0) / 2.0
    places = [high - ratio * (high - low), low + ratio * (high - low)]
    values = [score(z) for z in places]
    while high - low > width:
        if values[0] >= values[1]:
            high, new = places[1], 0
            places[1], values[1] = places[0], values[0]
            places[0] = high - ratio * (high - low)
        else:
            low, new = places[0], 1
            places[0], values[0] = places[1], values[1]
            places[1] = low + ratio * (high - low)
        values[new] = score(places[new])
    return places[int(np.argmax(values))]


def _rounder(z: float, width: float, unit: float) -> list[float]:
    """Numbers within a width of z, with ever more decimals, down to some tenths of a unit, the roundest first."""
    near: list[float] = []
    power = math.ceil(math.log10(max(abs(z), width)))
    while 10.0**power > 0.1 * unit:
        # Whole powers of ten are exact, their inverses are not.
        value = round(z / 10.0**power) * 10.0**power if power >= 0 else round(z * 10.0**-power) / 10.0**-power
        if abs(value - z) <= width and value not in near:
            near.append(value)
        power -= 1
    return near


def _crossings(rays: RaySet, z: float) -> FloatArray:
    """x, y where the rays that head upwards cross a depth [mm], shape (n, 2)."""
    up = rays.direction[:, 2] > 0
    x, k = rays.position[up], rays.direction[up]
    hit: FloatArray = (x + ((z - x[:, 2]) / k[:, 2])[:, None] * k)[:, :2]
    return hit


def _triple(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return (x, y, z)
