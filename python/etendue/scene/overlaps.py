"""Solids that bite into each other, and light that starts in them: looked for with lines, before anything is traced."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.scene.extents import box_of
from etendue.scene.face_rows import FaceRows

Array = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
Record = dict[str, Any]

MOST_LINES, FEWEST_LINES, ALL_LINES = 1024, 64, 1 << 13
"""Lines through the box that two solids share, and as many through the boxes of the smaller one's faces: within limits, what
`ALL_LINES` leave for each pair."""

STARTS = 256
"""Rays of a source whose starts are looked at."""

SHARE = 0.01
"""Of these, fewer say nothing: measured ray files have strays."""

BESIDE = 1e-6
"""Of the size of a solid: what overlaps by less was meant to touch. It is far more than the roundings of a placement, and
of coordinates in single precision, and less than anything that is made."""

ROUNDING = 1e-12
"""Of the size of a solid: faces that are nearer to each other may be one to the tracer, and are not told."""

FEWEST_FILMS, FILMS = 3, 0.01
"""Lines that meet a film between two solids before it is told, and, of solids that overlap, their share of the lines that go
from one to the other: near an edge a few do by chance."""

THIN, VARIED = 5e-3, 0.4
"""Triangles that stand for the same curved surface are nearer to each other than this part of the size of a solid (ten times
the distance from it that is asked for by default), and here and there much nearer than on the whole: the least twentieth of
the lines than this part of the median. Across an even gap it is half of that."""

MOST_PAIRS = 512
"""Pairs of solids with boxes that meet; a scene with more is looked at in part."""

PAIRS_AT_ONCE = 1 << 18
"""Pairs of boxes that are compared together."""

DEEPEST = 4
"""Solids that a ray may be in at once."""


@dataclasses.dataclass(frozen=True)
class Kind:
    """What is known of a solid besides its faces.

    Parameters
    ----------
    name : str
    opaque : bool
        Whether no face of it lets light pass.
    closed : bool
        What is open has no inside.

    Examples
    --------
    >>> Kind("wall", opaque=True, closed=True).name
    'wall'
    """

    name: str
    opaque: bool
    closed: bool


def doubts_about(record: Record, kinds: Sequence[Kind], source_names: Sequence[str]) -> tuple[str, ...]:
    """What is probably not meant: each with the names of both bodies and a point.

    Solids may lie in one another and touch. These are told: two of which each has space of its own and both share some;
    one that lies in a later one, which fills its space; more than four in one place; two that touch but for a film that
    nobody makes; sources of which a part starts in a solid and a part does not, or which start in a solid that no light
    leaves.

    The lines are the same every time. What takes less than some thousandth of the box that two solids share may be missed.

    Parameters
    ----------
    record : mapping
        Of the tracer; see `etendue.scene.compile_scene`.
    kinds : sequence of Kind
        One for each of its solids.
    source_names : sequence of str
        Of its sources.

    Examples
    --------
    >>> from etendue.scene import Scene, compile_scene
    >>> wall = {"shape": {"kind": "ball", "radius": 2}, "finish": "absorber"}
    >>> record = compile_scene(Scene(solids=[wall])).record
    >>> led = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 1}
    >>> sources = compile_scene(Scene(sources=[led])).record["sources"]
    >>> doubts_about({**record, "sources": sources}, [Kind("wall", opaque=True, closed=True)], ["led"])[0][:45]
    '100% of the light of "led" starts in "wall", '
    """
    solids = _Solids(record, kinds)
    if not solids.owner.size:
        return ()
    sources = zip(source_names, record["sources"], strict=True)
    return (*_overlaps(solids), *(doubt for name, source in sources for doubt in _starts(solids, name, source)))


def _place(point: Array) -> str:
    x, y, z = (point + 0.0).tolist()
    return f"({x:.4g}, {y:.4g}, {z:.4g}) mm"


# --- solids ----------------------------------------------------------------------------------------------------------


class _Solids:
    """The closed solids of a scene, and the boxes around them."""

    def __init__(self, record: Record, kinds: Sequence[Kind]) -> None:
        self.record = record
        self.names = [f'"{kind.name}"' for kind in kinds]
        self.opaque = [kind.opaque for kind in kinds]
        faces: FaceRows = record["faces"]
        # The last stands for no solid, whose number is -1.
        closed = faces.chosen(np.array([*(kind.closed for kind in kinds), False])[faces.solids])
        boxes = np.array([box_of(form["shape"]) for form in closed.forms]).reshape(-1, 2, 3)[closed.form]
        # A face of absurd numbers may have no place.
        known = np.isfinite(boxes).all(axis=(1, 2))
        self.faces, self.boxes = closed.chosen(known), boxes[known]
        self.owner = self.faces.solids
        self.low, self.high = np.full((len(kinds), 3), np.inf), np.full((len(kinds), 3), -np.inf)
        self.frames = self.faces.frames.reshape(-1, 4, 3)
        # Of the corners of a face's box the least and the greatest coordinates: sums of the least and the greatest parts.
        ends = np.stack([self.boxes[:, 0], self.boxes[:, 0] + (self.boxes[:, 1] - self.boxes[:, 0])], axis=1)
        parts = ends[..., None] * self.frames[:, None, 1:]
        np.minimum.at(self.low, self.owner, parts.min(axis=1).sum(axis=1) + self.frames[:, 0])
        np.maximum.at(self.high, self.owner, parts.max(axis=1).sum(axis=1) + self.frames[:, 0])
        self.sizes = (self.high - self.low).max(axis=1)

    def placed(self, faces: Numbers, at: Array) -> Array:
        """Points in the boxes of faces, which lie along their own axes; from coordinates 0 to 1, in the world [mm]."""
        low, high = self.boxes[faces, 0], self.boxes[faces, 1]
        local = low + at * (high - low)
        placed: Array = np.einsum("...k,...kx->...x", local, self.frames[faces, 1:]) + self.frames[faces, 0]
        return placed

    def in_faces(self, solid: int, n: int) -> Array:
        """Points in the boxes of a solid's faces, shape (n, 3) [mm]: even where it is thin and aslant."""
        faces = np.flatnonzero(self.owner == solid)
        return self.placed(faces[np.arange(n) * max(1, len(faces) // n) % len(faces)], _spread(n, 3))

    @functools.cached_property
    def _core(self) -> _core.Scene:
        n = len(self.faces)
        bare = dataclasses.replace(self.faces, solids=np.full(n, -1), finishes=np.zeros(n, dtype=np.int64))
        return _bare(self.record, bare, [])

    def crossings(self, starts: Array, directions: Array) -> tuple[Numbers, Numbers, Array]:
        """Where lines cross solids ahead: number of the line, of the solid, distance [mm]; in order along each line."""
        lines, faces, distances = _core.scene_crossings(self._core, starts, directions)
        order = np.lexsort((distances, lines))
        return lines[order].astype(np.int64), self.owner[faces[order].astype(np.int64)], distances[order]

    def sides(self, points: Array) -> tuple[Flags, Flags]:
        """Whether points lie in each solid, and whether they lie outside of it, shape (points, solids).

        A point on a face, or from which a line meets an edge, does neither.
        """
        directions = _directions(len(points))
        shape = (len(points), len(self.names))
        inside, outside = np.ones((2, *shape), dtype=bool)
        for sign in (1.0, -1.0):
            line, solid, t = self.crossings(points, sign * directions)
            counts = np.zeros(shape, dtype=np.int64)
            np.add.at(counts, (line, solid), 1)
            inside &= counts % 2 == 1
            outside &= counts % 2 == 0
            on = t <= BESIDE * self.sizes[solid]
            inside[line[on], solid[on]] = outside[line[on], solid[on]] = False
        return inside, outside


def _bare(record: Record, faces: FaceRows, sources: list[Record]) -> _core.Scene:
    """Faces and sources in the scene's surroundings, and nothing else."""
    return _core.Scene(
        {
            "media": record["media"][:1],
            "finishes": [{"kind": "fresnel"}],
            "solids": [],
            "faces": faces,
            "sources": sources,
            "detectors": [],
        }
    )


@functools.cache
def _spread(n: int, dimensions: int) -> Array:
    """Points of the unit cube, evenly spread: multiples of powers of 1/g, g^(d+1) = g + 1 [Roberts2018]_."""
    g = 2.0
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (dimensions + 1))
    return (0.5 + np.outer(np.arange(1, n + 1), g ** -np.arange(1.0, dimensions + 1))) % 1.0


def _directions(n: int) -> Array:
    """Unit vectors, evenly spread, shape (n, 3)."""
    u, v = _spread(n, 2).T
    z, turn = 2.0 * u - 1.0, 2.0 * np.pi * v
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)


# --- solids in solids ------------------------------------------------------------------------------------------------


def _overlaps(solids: _Solids) -> Iterator[str]:
    pairs = list(itertools.islice(_near(solids), MOST_PAIRS + 1))
    lines = _lines_for(pairs)
    names = solids.names
    shared: list[tuple[int, int]] = []
    hidden: set[int] = set()
    for a, b in pairs[:MOST_PAIRS]:
        found = _compare(solids, a, b, lines)
        if found.point is None:
            yield from _film(solids, a, b, found)
            continue
        shared.append((a, b))
        if found.first and found.second:
            gape = _gape(solids, a, b, found)
            elsewhere = f"; elsewhere {gape}" if gape else ""
            yield (
                f"{names[a]} and {names[b]} overlap: both hold {_place(found.point)}, and neither lies in the other; "
                f"{names[b]}, which is listed later, fills the space that they share{elsewhere}"
            )
        elif not found.first and a not in hidden:
            hidden.add(a)
            yield (
                f"{names[a]} lies in {names[b]}, which is listed later and fills its space, as at {_place(found.point)}; "
                f"light never meets {names[a]}: list it after {names[b]}"
            )
    yield from _crowds(solids, shared)
    known = set(pairs)
    touching = list(itertools.islice((pair for pair in _near(solids, -BESIDE) if pair not in known), MOST_PAIRS))
    for a, b in touching:
        yield from _film(solids, a, b, _compare(solids, a, b, _lines_for(touching)))
    if len(pairs) > MOST_PAIRS:
        yield f"more than {MOST_PAIRS} pairs of solids are near each other; {MOST_PAIRS} were looked at for overlaps"


def _lines_for(pairs: Sequence[tuple[int, int]]) -> int:
    return min(MOST_LINES, max(FEWEST_LINES, ALL_LINES // max(1, 2 * len(pairs))))


def _film(solids: _Solids, a: int, b: int, found: _Shared) -> Iterator[str]:
    """What is told of two solids that share nothing, were meant to touch, and do not."""
    if solids.opaque[a] and solids.opaque[b]:
        return
    names, thin = solids.names, found.films <= BESIDE * solids.sizes[[a, b]].min()
    if thin.sum() >= FEWEST_FILMS:
        where = int(np.flatnonzero(thin)[np.argsort(found.films[thin])[thin.sum() // 2]])
        yield (
            f"{names[a]} and {names[b]} touch but for a film {found.films[where]:.2g} mm thick, as at "
            f"{_place(found.places[where])}: light is refracted and reflected on both its sides, as by a gap; let "
            f"{names[b]}, which is listed later, reach a little into {names[a]}: that they overlap then does no harm"
        )
    elif gape := _gape(solids, a, b, found):
        yield f"{names[a]} and {names[b]} do not touch everywhere: {gape}"


def _gape(solids: _Solids, a: int, b: int, found: _Shared) -> str:
    """The film between two solids, if triangles stand for a curved surface that both seem to have; else nothing."""
    forms = np.unique(solids.faces.form[np.isin(solids.owner, [a, b])])
    rounded = any(solids.faces.forms[form]["shape"].get("normals") is not None for form in forms)
    near = np.sort(found.films[found.films < THIN * solids.sizes[[a, b]].min()])
    few = len(near) < max(FEWEST_FILMS, FILMS * (len(near) + found.common), 0.5 * len(found.films))
    # What is as thin nowhere as its mean says was left on purpose.
    if few or not rounded or near[len(near) // 20] > VARIED * near[len(near) // 2]:
        return ""
    return (
        f"a film of some {near[len(near) // 2]:.2g} mm is left between them, as by a gap. If triangles stand for one curved "
        f"surface there, give both the same 'tolerance', or let {solids.names[b]}, which is listed later, reach into "
        f"{solids.names[a]}"
    )


def _near(solids: _Solids, least: float = BESIDE) -> Iterator[tuple[int, int]]:
    """Pairs of solids whose boxes have so much of their sizes in common along each axis, the first listed first."""
    order = np.argsort(solids.low[:, 0], kind="stable")
    # By axis, since only one is looked at at a time.
    low, high = np.ascontiguousarray(solids.low[order].T), np.ascontiguousarray(solids.high[order].T)
    sizes = solids.sizes[order]
    # How many of those that begin later along x begin before each has ended.
    ends = high[0] + max(-least, 0.0) * np.where(np.isfinite(sizes), sizes, 0.0)
    counts = np.maximum(np.searchsorted(low[0], ends) - np.arange(1, len(order) + 1), 0)
    start = 0
    while start < len(order):
        # So many solids at a time that their pairs take little memory; one at least.
        stop = start + max(int(np.searchsorted(np.cumsum(counts[start:]), PAIRS_AT_ONCE)), 1)
        first = np.repeat(np.arange(start, stop), counts[start:stop])
        begun = np.repeat(np.cumsum(counts[start:stop]) - counts[start:stop], counts[start:stop])
        second = first + 1 + np.arange(len(first)) - begun
        for axis in (1, 2, 0):
            begin, end = low[axis], high[axis]
            common = np.minimum(end[first], end[second]) - np.maximum(begin[first], begin[second])
            near = common > least * np.minimum(sizes[first], sizes[second])
            first, second = first[near], second[near]
        pairs = np.sort(order[np.stack([first, second], axis=1)], axis=1)
        yield from ((int(a), int(b)) for a, b in pairs)
        start = stop


class _Shared(NamedTuple):
    """What lines say of two solids.

    A point in the midst of what they share, if they do; whether the first and the second have space of their own; how many
    stretches of lines they share, and the longest [mm]; how long those from one to the other are that neither holds [mm],
    and a point in each.
    """

    point: Array | None
    first: bool
    second: bool
    common: int
    depth: float
    films: Array
    places: Array


def _compare(solids: _Solids, a: int, b: int, lines: int) -> _Shared:
    low, high = solids.low[[a, b]], solids.high[[a, b]]
    reach = float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
    small = min((a, b), key=lambda solid: solids.sizes[solid])
    common = low.max(axis=0) + _spread(lines, 3) * (high.min(axis=0) - low.max(axis=0))
    directions = _directions(2 * lines)
    starts = np.concatenate([common, solids.in_faces(small, lines)]) - reach * directions
    line, solid, t = solids.crossings(starts, directions)
    kept = (solid == a) | (solid == b)
    line, solid, t = line[kept], solid[kept], t[kept]
    # Stretches from each crossing to the next of the same line.
    length = np.where(line[1:] == line[:-1], np.diff(t), 0.0)
    size = solids.sizes[[a, b]].min()
    one, other = (_held(line, solid == which)[:-1] for which in (a, b))
    between = ~one & ~other & (solid[1:] != solid[:-1]) & (length > ROUNDING * size)
    films = np.flatnonzero(between & np.isin(line[:-1], line[:-1][one]) & np.isin(line[:-1], line[:-1][other]))
    middles = starts[line[films]] + (t[films] + length[films] / 2.0)[:, None] * directions[line[films]]
    first, second = one & (length > BESIDE * size), other & (length > BESIDE * size)
    both, point = first & second, None
    if both.any():
        best = int(np.argmax(np.where(both, length, 0.0)))
        point = starts[line[best]] + (t[best] + length[best] / 2.0) * directions[line[best]]
    return _Shared(
        point,
        bool((first & ~second).any()),
        bool((second & ~first).any()),
        int(both.sum()),
        float(length[both].max(initial=0.0)),
        length[films],
        middles,
    )


def _held(line: Numbers, crossed: Flags) -> Flags:
    """Whether what follows each crossing of a line lies in a solid, given which of the crossings are those of the solid.

    A line that crosses it an odd number of times has met an edge: nothing of it counts.
    """
    count: Numbers = np.cumsum(crossed, dtype=np.int64)
    begin, end = np.searchsorted(line, line), np.searchsorted(line, line, side="right")
    before = count[begin] - crossed[begin].astype(np.int64)
    held: Flags = ((count - before) % 2 == 1) & ((count[end - 1] - before) % 2 == 0)
    return held


def _crowds(solids: _Solids, shared: Sequence[tuple[int, int]]) -> Iterator[str]:
    """More solids in one place than a ray may be in at once."""
    for a, pairs in itertools.groupby(sorted(shared), key=lambda pair: pair[0]):
        if len(list(pairs)) < DEEPEST:
            continue
        points = solids.low[a] + _spread(MOST_LINES, 3) * (solids.high[a] - solids.low[a])
        inside, _ = solids.sides(points)
        inside &= inside[:, a : a + 1]
        most = int(np.argmax(inside.sum(axis=1)))
        if inside[most].sum() > DEEPEST:
            names = [name for name, held in zip(solids.names, inside[most], strict=True) if held]
            yield f"{', '.join(names)} all hold {_place(points[most])}; a ray can be in {DEEPEST} solids at once: use fewer"
            return


# --- sources in solids -----------------------------------------------------------------------------------------------


def _starts(solids: _Solids, name: str, source: Record) -> Iterator[str]:
    trails = _core.trace_trails(_bare(solids.record, FaceRows.of([]), [source]), STARTS, 1, 1, 1.0)
    points = np.array([trail[0] for trail in trails if len(trail)]).reshape(-1, 3)
    near = (points[:, None] >= solids.low) & (points[:, None] <= solids.high)
    if not near.all(axis=2).any():
        return
    inside, outside = solids.sides(points)
    for solid in np.flatnonzero(inside.mean(axis=0) >= SHARE):
        # The space belongs to the last solid that holds it.
        owned = inside[:, solid] & ~inside[:, solid + 1 :].any(axis=1)
        here, without = inside[:, solid], outside[:, solid]
        if solids.opaque[solid]:
            if owned.mean() >= SHARE:
                yield (
                    f'{owned.mean():.0%} of the light of "{name}" starts in {solids.names[solid]}, as at '
                    f"{_place(points[np.argmax(owned)])}, and no face of it lets light pass; move one of them"
                )
        elif without.mean() >= SHARE:
            yield (
                f'{here.mean():.0%} of the light of "{name}" starts in {solids.names[solid]}, as at '
                f"{_place(points[np.argmax(here)])}, and {without.mean():.0%} outside of it, as at "
                f"{_place(points[np.argmax(without)])}; put all of it inside, or none"
            )
