"""Light that smooth surfaces or beams send to diffuse ones: how many rays forwards it takes, and what they show."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.scatter.building import core_scene
from etendue.scene.dealing import CellSums, Dealing, Units

Array = npt.NDArray[np.float64]

PILOT = 0x50494C4F54
"""What the seed is mixed with, so that no ray of the pilot is one of a map or a trace of the same seed."""

GOLDEN = 0x9E3779B97F4A7C15
"""Step from the seed of one run of rays to the next: 2⁶⁴ over the golden section."""

RUN = 1 << 44
"""More rays than any pilot takes: the run whose first batches it traces."""

BATCH = 1 << 13
"""Rays of a batch of a pilot: few, so that all threads have some."""

STEP = 8
"""Batches of a pilot at a time."""

MOST_RAYS = 1 << 18
"""Rays of a pilot at most; it stops earlier when enough has been found, or rays go to and fro for long, or nothing is found
by more rays than the map has lines of sight, or something by `MOST_BEFOREHAND` times as many."""

MOST_BEFOREHAND = 8
"""Rays of a pilot for each line of sight, from which on it has cost a small map more than it can save."""

ENOUGH = 1 << 13
"""Arrivals at diffuse surfaces, and as many contributions to an image, that are enough for a pilot."""

MOST_SEGMENTS = 1 << 22
"""Ways between surfaces that the rays of a pilot go."""

SCOUTS = 1 << 7
"""Rays that tell a pilot how long rays go to and fro."""

LONG = MOST_SEGMENTS // (STEP * BATCH)
"""Ways of a ray, by the scouts, beyond which a step would take more than `MOST_SEGMENTS`, as where glass traps light: steps
are then smaller, and rays are given up early. A pilot only advises; no light of the map rests on what its rays bring."""

SPOT_RAYS, SPOT_EVENTS = 1 << 13, 4
"""Rays that tell where light is scattered, and surfaces that each of them meets at most."""

SMALL_BATCH, FEW_EVENTS = BATCH >> 4, 1 << 9
"""Rays of a batch, and surfaces that a ray may meet, in a pilot whose rays are long."""

LINE = 4.0
"""What a line of sight costs, in ways between surfaces of rays forwards."""

MOST_SHARE = 8.0
"""Rays forwards cost as much as this many times the lines of sight at most, unless they are asked for."""

FEWEST_RAYS = 1 << 14
"""Rays forwards that a map has at least where they find anything; of rays longer than `LONG`, as many as are that effort."""

ROUND = 16
"""Batches of rays traced forwards at a time."""

FEW = 10
"""Contributions from which on the spread of a pixel's own tells its error."""

NEIGHBOURS = 4
"""Contributions in the neighbourhood that stands in for a pixel with few of its own."""


@dataclasses.dataclass(frozen=True, eq=False)
class Forward:
    """What rays traced forwards send to the eye of an observer.

    Parameters
    ----------
    values, error : array, shape (rows, columns)
        Luminance and its standard error [flux unit/(mm² sr)].
    rays : array of int64, shape (rows, columns)
        Rays that each pixel rests on.
    note : str
        What it is.
    """

    values: Array
    error: Array
    rays: npt.NDArray[np.int64]
    note: str

    @classmethod
    def of(
        cls,
        sums: CellSums,
        sources: CellSums,
        shape: tuple[int, ...],
        dealing: Dealing,
        rays: int,
        scale: float,
        note: str,
    ) -> Forward:
        """From the sums of each pixel, and of the sources, over the first `rays` rays of a run; w stands for `scale` w."""
        error = np.sqrt(dealing.variance(sums, rays, sources)).reshape(shape)
        sum_, count = (row.sum(axis=0).reshape(shape) for row in (sums[0], sums[2]))
        return cls(sum_ * scale, error * scale, count.astype(np.int64), note)

    def with_neighbours(self, possible: npt.NDArray[np.bool_]) -> Forward:
        """With errors that hold what a pixel has not found by chance, though its neighbours have (`at_least_nearby`)."""
        variance = at_least_nearby(self.error**2, self.rays, possible)
        return dataclasses.replace(self, error=np.sqrt(variance))


def at_least_nearby(variance: Array, count: npt.NDArray[np.integer[Any]], possible: npt.NDArray[np.bool_]) -> Array:
    """Variances of pixels; where they rest on few contributions, no less than the mean of the neighbourhood.

    A pixel that no contribution has reached has a variance of 0 by its own account. With K contributions in the smallest
    square around it that holds a few, the mean of the variances there, times (K + 1)/K, is what it may be expected to have
    [the mean of K + 1 under an even prior, K being Poisson distributed]. But beside a bright spot it is known to get fewer:
    with k of its own, no more than k + 1 + 2 √(k + 1) of the K, which is above the limit of 95 % of a Poisson distribution.

    Parameters
    ----------
    variance : array, shape (rows, columns)
        By each pixel's own contributions.
    count : array, shape (rows, columns)
        How many they are.
    possible : array of bool, shape (rows, columns)
        Pixels that contributions can reach; others keep their variance.

    Returns
    -------
    array, shape (rows, columns)

    Examples
    --------
    >>> import numpy as np
    >>> count = np.array([[3, 0, 2], [12, 1, 4]])
    >>> at_least_nearby(count / 1.0, count, np.ones((2, 3), dtype=bool)).round(2)
    array([[ 4.25,  3.  ,  2.  ],
           [12.  ,  3.83,  4.  ]])
    """
    needy = possible & (count < FEW)
    if not needy.any() or not count.any():
        return variance
    fields = [np.where(possible, part, 0.0) for part in (variance, count, np.ones(count.shape))]
    sums = [np.pad(part.cumsum(0).cumsum(1), ((1, 0), (1, 0))) for part in fields]
    rows, columns = np.nonzero(needy)
    floor, open_ = np.zeros(len(rows)), np.ones(len(rows), dtype=bool)
    own = count[needy] + 1.0
    most = own + 2.0 * np.sqrt(own)
    radius = 1
    while open_.any():
        top, bottom = np.maximum(rows - radius, 0), np.minimum(rows + radius + 1, count.shape[0])
        left, right = np.maximum(columns - radius, 0), np.minimum(columns + radius + 1, count.shape[1])
        total, found, pixels = (
            part[bottom, right] - part[top, right] - part[bottom, left] + part[top, left] for part in sums
        )
        whole = radius >= max(count.shape)
        done = open_ & ((found >= NEIGHBOURS) | whole)
        floor[done] = (total / np.maximum(found, 1.0) * np.minimum((found + 1.0) / pixels, most))[done]
        open_ &= ~done
        radius *= 2
    result = variance.copy()
    result[needy] = np.maximum(result[needy], floor)
    return result


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """How many rays forwards a map takes, and where its lines of sight look for light behind smooth surfaces.

    Parameters
    ----------
    rays : int
        For the passes that are made in any case; 0: lines of sight look for all light.
    guide : _core.Guide or None
        Directions in which lines of sight go on from diffuse surfaces.
    glints : sequence of _core.Glints
        For each view, where in its pixels lines of sight look for small sources.
    beforehand : int
        Rays of the pilot.
    """

    rays: int
    guide: _core.Guide | None
    glints: Sequence[_core.Glints]
    beforehand: int


def plan(
    record: Mapping[str, Any],
    views: Sequence[_core._View],
    glints: Sequence[_core.Glints],
    seed: int,
    most_events: int,
    lines: int,
    rays: int | None,
    threads: int | None,
) -> Plan:
    """What a pilot of rays forwards and of lines of sight advises for `lines` lines of sight per pixel.

    With V the variance of one ray or one line, relative to the luminance and summed over the pixels, V_f/n + V_r/m is least
    for a given effort if n : m is as the roots of V_f and V_r over the costs. `rays` is what the user asks for, if he does.
    """
    seed ^= PILOT
    pixels = max(view["columns"] * view["rows"] for view in views)
    images = [{"kind": "image", "view": view, "complement": True, "shared": float(pixels)} for view in views]
    core = core_scene({**record, "detectors": [*images, {"kind": "arrivals"}]})
    dealing = Dealing.of(record["sources"], RUN)
    scouts = _core.work_unit(core, RUN, seed, most_events, 0, 1, threads, SCOUTS)
    ways = scouts["ledger"]["segments"] / SCOUTS
    long = ways > LONG
    each, events = (SMALL_BATCH, min(FEW_EVENTS, most_events)) if long else (BATCH, most_events)
    bound = min(MOST_SEGMENTS, MOST_SHARE * LINE * lines * pixels) if long else MOST_SEGMENTS
    batches, segments, arrivals = 0, 0, []
    sums = [np.zeros((4, view["columns"] * view["rows"])) for view in views]
    while batches * each < MOST_RAYS and segments < bound:
        traced = _core.work_unit(core, RUN, seed, events, batches, batches + STEP, threads, each)
        cells = (dealing.added(*dealing.nothing(tally), tally, RUN)[0] for tally in traced["tallies"])
        sums = [total + [part.sum(axis=0) for part in found] for total, found in zip(sums, cells, strict=False)]
        arrivals.append(traced["arrivals"])
        segments += traced["ledger"]["segments"]
        batches += STEP
        least = min(total[2].sum() for total in sums)
        most = lines * pixels * (MOST_BEFOREHAND if least else 1)
        if min(sum(map(len, arrivals)), least) >= ENOUGH or batches * each >= most:
            break
    done = batches * each
    found = np.concatenate(arrivals)
    guide = _core.Guide(core, found) if len(found) else None
    if rays is not None:
        return Plan(rays, guide, glints, done)
    cost = max((ways if long else segments / done) / LINE, 0.25)
    wanted = [
        _rays(core, view, total, done, seed, most_events, lines, (guide, small), threads, cost)
        for view, total, small in zip(views, sums, glints, strict=True)
    ]
    return Plan(max(wanted), guide, glints, done)


def bright_spots(record: Mapping[str, Any], threads: int | None) -> _core.BrightSpots:
    """Small places of diffuse surfaces that much light comes from, as of a wall close to a lamp.

    A few rays forwards tell where light is scattered for the first few times, the same ones for all maps of a scene.
    """
    core = core_scene({**record, "detectors": [{"kind": "scatter", "most": 16 * SPOT_RAYS * SPOT_EVENTS}]})
    traced = _core.work_unit(core, SPOT_RAYS, PILOT, SPOT_EVENTS, 0, 1, threads, SPOT_RAYS)
    return _core.BrightSpots(core, traced["events"][0][0])


def _rays(
    core: _core.Scene,
    view: _core._View,
    sums: Array,
    done: int,
    seed: int,
    most_events: int,
    lines: int,
    guides: tuple[_core.Guide | None, _core.Glints],
    threads: int | None,
    cost: float,
) -> int:
    """Rays forwards that balance the errors of one view."""
    if not sums[2].any():
        return 0
    pixels = view["columns"] * view["rows"]
    passes, paths = 4, max(1, min(4, lines // 16))
    looks = _core.look_at_scene(
        core, view, paths, seed, most_events, "caustics", 0, passes, threads, None, float(pixels), *guides
    )[0].reshape(passes, pixels)
    # Of one ray, and of one line.
    one = sums[0] * RUN
    forward = sums[1] * (RUN * (RUN / done)) - (one / done) ** 2
    reverse = np.var(looks, axis=0, ddof=1) * paths
    value = np.mean(looks, axis=0) + one / done
    lit = value > 0.0
    weight = 1.0 / np.maximum(value, value[lit].mean() / 10.0) ** 2 * lit
    of_ray, of_line = float((forward * weight).sum()), float((reverse * weight).sum())
    most = MOST_SHARE * lines * pixels / cost
    best = lines * math.sqrt(pixels * of_ray / (of_line * cost)) if of_line > 0.0 else most
    return int(max(min(best, most), FEWEST_RAYS * min(1.0, LONG / (cost * LINE))))


class LightImages:
    """What rays forwards send to the eyes of observers, run by run; each run has rays of its own."""

    def __init__(
        self,
        record: Mapping[str, Any],
        views: Sequence[_core._View],
        plan: Plan,
        shared: float | None,
        seed: int,
        most_events: int,
        threads: int | None,
    ) -> None:
        portion = {"complement": True} if shared is None else {"complement": True, "shared": shared}
        self._core = _core.Scene(
            {**record, "detectors": [{"kind": "image", "view": view, **portion} for view in views]}
        )
        self._plan = plan
        self._split = (
            "" if shared is not None else " (all of it: with gather, lines of sight leave it to rays forwards)"
        )
        self._how = seed, most_events, threads
        self._dealing = Dealing.of(record["sources"], plan.rays)
        # Luminance, its variance and the rays of each view, over all runs.
        self._sums = [np.zeros((3, view["rows"], view["columns"])) for view in views]
        self.runs = 0

    def trace(self, runs: int) -> None:
        """Traces as many runs as are wanted, if they have not been yet."""
        seed, most_events, threads = self._how
        rays = self._plan.rays
        batches = -(-rays // _core.batch_size())
        while self.runs < runs:
            own = (seed + self.runs * GOLDEN) % (1 << 64)
            sums: list[tuple[CellSums, Units]] = []
            for first in range(0, batches, ROUND):
                last = min(first + ROUND, batches)
                traced = _core.work_unit(self._core, rays, own, most_events, first, last, threads)
                tallies = (*traced["tallies"], traced["emitted"])
                sums = sums or [self._dealing.nothing(tally) for tally in tallies]
                done = min(last * _core.batch_size(), rays)
                before = zip(sums, tallies, strict=True)
                sums = [self._dealing.added(*held, tally, done) for held, tally in before]
            *images, (sources, _) = sums
            for total, (found, _) in zip(self._sums, images, strict=True):
                image = Forward.of(found, sources, total.shape[1:], self._dealing, rays, 1.0, "")
                np.add(total, [image.values, image.error**2, image.rays], out=total)
            self.runs += 1

    def seen(self, number: int) -> Forward:
        """What the observer of this number sees of the runs so far."""
        rays = self._plan.rays * self.runs
        note = (
            f"{rays:,} rays forwards, and {self._plan.beforehand:,} beforehand, for light that smooth surfaces or beams "
            f"send to diffuse ones{self._split}"
        )
        values, variance, count = self._sums[number]
        return Forward(values / self.runs, np.sqrt(variance) / self.runs, count.astype(np.int64), note)
