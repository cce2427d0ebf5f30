"""Which nodes a far field deserves: steps that hold its beams, and no more of them than its rays bear."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from etendue.quantities.angle_table import gaps_of, hat_halves, hat_integrals
from etendue.quantities.hat_sums import Hats, HatSums
from etendue.quantities.intensity_nodes import Nodes, check_steps, planes_of
from etendue.quantities.powers_of_ten import rounded
from etendue.quantities.ray_stream import flux_power
from etendue.quantities.smooth_light import Harmonics, nodes_around, parts_of

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Counts = npt.NDArray[np.intp]

GAMMA_STEP = 30.0
"""[°] The widest step of γ that is tried; narrower ones are half as wide, a quarter, …"""

TURN = 360.0
"""[°] The widest step of C: one node stands for all."""

DEPTH = {"gamma": 11, "c": 15}
"""Halvings that are tried."""

FINEST = GAMMA_STEP / 2 ** (DEPTH["gamma"] + 1)
"""[°] The finest step that is tried, halved."""

PARTS = {"gamma": 3, "c": 2}
"""Parts of the widest steps that pass, at least. Around the axis fewer: there light that is not even is told by the rays of
each row alone, so that steps of it are halved by less."""

CERTAIN, LIKELY = 5.5, 2.5
"""Standard errors by which halved steps must change the value of a node to be wanted: anywhere, and where steps of twice
the width were halved. Some 10^5 nodes are looked at, and there shall be no such change by chance."""

FEWEST = 128.0
"""Equal rays that a hat must hold to be judged by its normal limit."""

FEW = 8.0
"""Equal rays that it must hold for light that stands out of its surroundings: where the sum of few terms is over its own
scatter, what stands out does so by chance less often than in the normal limit, and a hole in the light more often."""

FEW_NODES = 2
"""So many nodes around the axis are judged all together: tests of each would see light of some directions only."""

ALIKE = 2.0
"""Rows whose hats in γ are wider by up to this factor are judged together."""

MATERIAL = 3e-4
"""Share of the maximum below which a change is of no consequence."""

MOST_ROWS, MOST_ANGLES, MOST_PLANES = 240, 361, 720
"""Rows of nodes; angles γ and planes C of a table: those of EULUMDAT, less the plane of 360°."""

WIDEST_STATED = 2.5
"""[°] The widest step of a table: between rows that are farther apart, the function is stated again."""

READING = 2e-4
"""Share of the flux by which the trapezium rule over I sin γ may differ from the integral of the table's function."""

MOST_TESTED = 1 << 22
"""Nodes of one step that are tested at once."""

TOO_WIDE = 0.01
"""Share of a beam's peak that asked steps may lose before it is told."""


class Choice(NamedTuple):
    """Nodes, and what there is to say about them."""

    nodes: Nodes
    notes: tuple[str, ...]


def choose_nodes(
    direction: Array,
    flux: Array,
    rays: float,
    c_planes: int | None = None,
    gamma_step: float | None = None,
) -> Choice:
    """The nodes that suit a far field, from a sample of its rays.

    A node's value is the mean over its hat, too low at a beam and too high beside it by about h² I″/12 for a step h. If
    halving the steps around a node changes its value by more than its noise, they are halved, as often as it takes; a
    third or half of the steps that pass is taken; less of the widest ones if the change, though not certain, says so, and
    around the axis as many nodes as the harmonics of the light ask for (`etendue.quantities.smooth_light`). So what is left
    stays below the standard error, by some 2.6 times where the light is smooth.
    Steps beside each other differ by little more than a factor of 2, so that no hat is lopsided. Where there is little
    light or it is even, steps stay wide: the noise of a node then is as low as it can be. First rows of γ are chosen by the
    light of all C, then for each row its nodes C, by its light and that of the rows beside it.

    Parameters
    ----------
    direction : array, shape (n, 3)
        Unit vectors.
    flux : array, shape (n,)
        Of any scale.
    rays : float
        Rays that the nodes are meant for: the bias of a mean falls with h², its error rises with h^(-1/2), so that steps
        shrink with the fifth root of rays over sample.
    c_planes, gamma_step : int and float, optional
        Steps that are asked for; the others are chosen.

    Returns
    -------
    Choice
        The notes tell if the steps that were asked for, or the finest ones, cannot hold the beam.

    Raises
    ------
    ArgumentError
        If there are no such planes or steps.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> spot = np.concatenate([rng.normal(0, 0.01, (20_000, 2)), np.ones((20_000, 1))], axis=1)
    >>> spot /= np.linalg.norm(spot, axis=1)[:, None]
    >>> nodes, notes = choose_nodes(spot, np.ones(20_000), 20_000)
    >>> nodes.gamma[1] < 0.5, nodes.gamma[-2], notes
    (True, 165.0, ())
    """
    check_steps(c_planes, gamma_step)
    sample = _Sample.of(direction, flux)
    finer = max(rays / max(sample.flux.size, 1), 1.0) ** 0.2
    if c_planes is not None and gamma_step is not None:
        chosen, unresolved = Nodes.even(c_planes, gamma_step), False
    else:
        chosen, unresolved = _chosen(sample, finer, c_planes, gamma_step)
    notes = []
    if c_planes is not None or gamma_step is not None:
        notes += _too_wide(sample, chosen, _chosen(sample, finer, None, None)[0])
    elif unresolved:
        notes.append(
            "narrower than the finest steps of a table: the peak is a lower bound, set by steps of "
            f"{_smallest(chosen):.2g}°; the flux is not touched"
        )
    return Choice(chosen, tuple(notes))


class _Sample(NamedTuple):
    """Rays that carry flux, by their angles [°]."""

    direction: Array
    flux: Array
    gamma: Array
    c: Array

    @classmethod
    def of(cls, direction: Array, flux: Array) -> _Sample:
        lit = flux > 0.0
        direction, flux = np.ascontiguousarray(direction[lit], dtype=np.float64), np.array(flux[lit], dtype=np.float64)
        flux /= flux_power(flux)
        x, y, z = direction.T
        gamma = np.degrees(np.arctan2(np.hypot(x, y), z))
        return cls(direction, flux, gamma, np.mod(np.degrees(np.arctan2(y, x)), TURN))

    def tables(self, nodes: Nodes) -> tuple[Array, Array]:
        """What the sample makes of nodes: values and errors."""
        sums, squares = np.zeros(len(nodes)), np.zeros(len(nodes))
        nodes.core().add(self.direction, self.flux, sums, squares, np.zeros(len(nodes), dtype=np.uint64))
        return nodes.tables(sums[:-1], np.sqrt(squares[:-1]))


def _chosen(sample: _Sample, finer: float, c_planes: int | None, gamma_step: float | None) -> tuple[Nodes, bool]:
    """Nodes, and whether they cannot hold the beam."""
    if gamma_step is None:
        tree = _Tree.grown(
            sample.gamma, sample.flux, np.zeros(sample.flux.size, dtype=np.intp), np.array([90.0]), "gamma"
        )
        rows, unresolved = tree.angles(PARTS["gamma"], finer, MOST_ROWS)
        gamma = (*rows[0], 180.0)
    else:
        gamma, unresolved = Nodes.even(1, gamma_step).gamma, False
    inner = len(gamma) - 2
    if c_planes is None:
        found, short = _planes(sample, finer, np.array(gamma))
        unresolved |= short
    else:
        found = [planes_of(c_planes)] * inner
    planes = planes_of(1 if c_planes is None else c_planes)
    if c_planes is None:
        # Four planes at least: two are no table to people, nor to all programs.
        planes = tuple(sorted({*planes_of(4), *(c for row in found for c in row)}))
    nodes = Nodes(gamma, ((0.0,), *found, (0.0,)), gamma, planes)
    if gamma_step is None and sample.flux.size:
        nodes = dataclasses.replace(nodes, table=_stated(nodes, sample.tables(nodes)[0]))
    return nodes, unresolved


def _planes(sample: _Sample, finer: float, gamma: Array) -> tuple[list[tuple[float, ...]], bool]:
    """The nodes C of each row but the poles, from the rays around the row; and whether the steps are too wide."""
    row = (np.searchsorted(gamma, sample.gamma, side="right") - 1).clip(0, gamma.size - 2)
    up = (sample.gamma - gamma[row]) / (gamma[row + 1] - gamma[row])
    width = np.concatenate([[np.nan], gamma[2:] - gamma[:-2], [np.nan]])
    alike = np.maximum(width[1:], width[:-1]) <= ALIKE * np.minimum(width[1:], width[:-1])
    # A row is judged with the light of those beside it, whose steps of γ are as narrow: what the light does around the
    # axis changes little from one to the next, and one alone has few rays where a beam ends.
    below, above = np.append(False, alike)[row], np.append(alike, False)[row + 1]
    share = [(row - 1, np.where(below, 1.0 - up, 0.0)), (row, np.where(alike[row], 1.0, 1.0 - up)),
             (row + 1, np.where(alike[row], 1.0, up)), (row + 2, np.where(above, up, 0.0))]  # fmt: skip
    each = np.concatenate([number for number, _ in share])
    weight = np.concatenate([hat * sample.flux for _, hat in share])
    inside = (each > 0) & (each < gamma.size - 1) & (weight > 0.0)
    c, weight, each = np.tile(sample.c, len(share))[inside], weight[inside], each[inside] - 1
    held, squares = np.zeros(gamma.size), np.zeros(gamma.size)
    for number, hat in ((row, (1.0 - up) * sample.flux), (row + 1, up * sample.flux)):
        held += np.bincount(number, hat, gamma.size)
        squares += np.bincount(number, hat * hat, gamma.size)
    rays = _equal(held, squares)[1:-1] * finer**5
    apart = Harmonics.of(sample.c, sample.flux, row, gamma.size - 1)
    together = Harmonics.of(c, weight, each, gamma.size - 2)
    tree = _Tree.grown(c, weight, each, gamma[1:-1], "c")
    return tree.angles(PARTS["c"], finer, MOST_PLANES, nodes_around(apart, together, rays))


@dataclasses.dataclass(frozen=True)
class _Tree:
    """Intervals of γ, or of C for each row: which exist at each level, and which of them are halved.

    And into how many parts the widest should be cut where they are not.
    """

    step: float
    exist: list[Flags]
    split: list[Flags]
    parts: Array
    unresolved: bool
    poles: bool

    @classmethod
    def grown(cls, angle: Array, weight: Array, row: Counts, gamma: Array, axis: str) -> _Tree:
        """Halved where the light asks for it, from the finest steps to the widest, and from there once more.

        Structure that wide steps average away is found by narrow ones; what is beside it is judged less strictly.
        """
        span, step = (180.0, GAMMA_STEP) if axis == "gamma" else (TURN, TURN)
        parts = np.zeros((gamma.size, round(span / step)))
        certain, likely = [], []
        hats = Hats.of(angle, weight, row, gamma.size, span, round(span / step), DEPTH[axis])
        for level in range(DEPTH[axis]):
            size = round(span / step) << level
            if size * gamma.size > MOST_TESTED:
                break
            if axis == "c" and size <= FEW_NODES:
                change = _modulation(angle, weight, row, gamma.size, size)
            else:
                change = _change(hats.sums(size))
            if not change.any():
                break
            # Steps of C that are narrower than the finest ones of γ at their γ do not count.
            wide = (span / size * np.sin(np.radians(gamma)) >= FINEST)[:, None]
            certain.append(_beside(wide & (np.abs(change) > CERTAIN), size))
            likely.append(_beside(wide & (np.abs(change) > LIKELY), size))
            if axis == "gamma" and level == 0:
                # A bright pole has the noise of its small hat; of a dark one that hat tells what is beside it.
                each, dark = parts_of(change), parts_of(np.minimum(change, 0.0))
                parts = np.maximum(each[:, :-1], each[:, 1:])
                parts[:, 0], parts[:, -1] = dark[:, :2].max(axis=1), dark[:, -2:].max(axis=1)
        for level in range(len(certain) - 1, -1, -1):
            certain[level] = _grown_along(certain[level], likely[level])
            if level:
                certain[level - 1] |= certain[level].reshape(gamma.size, -1, 2).any(axis=2)
        exist = np.ones((gamma.size, round(span / step)), dtype=np.bool_)
        split = []
        for sure, maybe in zip(certain, likely, strict=True):
            split.append(exist & (sure | maybe))
            exist = np.repeat(split[-1], 2, axis=1)
        unresolved = len(split) == DEPTH[axis] and bool(split[-1].any())
        return cls.graded(step, round(span / step), gamma.size, split, parts, unresolved, axis)

    @classmethod
    def graded(
        cls, step: float, widest: int, rows: int, split: list[Flags], parts: Array, unresolved: bool, axis: str
    ) -> _Tree:
        """With intervals that differ by a factor of 2 at most from those beside them.

        A hat of two unequal sides has its mean beside its node, which is off by a third of their difference times the slope.
        """
        for level in range(len(split) - 1, 0, -1):
            beside = np.roll(split[level], 1, axis=1) | np.roll(split[level], -1, axis=1)
            if axis == "gamma":
                beside[:, 0], beside[:, -1] = split[level][:, 1], split[level][:, -2]
            split[level - 1] |= (split[level] | beside).reshape(rows, -1, 2).any(axis=2)
        exist = [np.ones((rows, widest), dtype=np.bool_), *(np.repeat(flags, 2, axis=1) for flags in split)]
        return cls(step, exist, split, parts, unresolved, axis == "gamma")

    def angles(
        self, fewest: int, finer: float, most: int, around: Counts | None = None
    ) -> tuple[list[tuple[float, ...]], bool]:
        """The nodes of each row, of `most` different ones at most; and whether they are too far apart for the light.

        Intervals that are not halved further are cut into `finer` times `fewest` parts, or more, so that each row has
        `around` nodes at least; or fewer if there are too many.
        """
        smooth = finer, np.ones(len(self.exist[0]), dtype=np.intp) if around is None else around
        tried = [(parts, *smooth) for parts in range(math.ceil(fewest * finer), fewest - 1, -1)]
        tried.append((fewest, 0.0, np.ones_like(smooth[1])))
        for deepest in range(len(self.split), -1, -1):
            leaves = self._leaves(deepest)
            for parts, more, least in tried:
                row, angle = self._cut(leaves, parts, more, least)
                if np.unique(angle).size <= most:
                    cut = any(flags.any() for flags in self.split[deepest:])
                    return self._rows(row, angle), cut or self.unresolved
        return self._rows(*self._cut(self._leaves(0), *tried[-1])), True

    def _leaves(self, deepest: int) -> list[tuple[Counts, Counts]]:
        """Row and number of the intervals of each level that are not halved further."""
        found = []
        for level, exist in enumerate(self.exist[: deepest + 1]):
            row, start = np.nonzero(exist & ~self.split[level] if level < deepest else exist)
            found.append((row, start))
        return found

    def _cut(
        self, leaves: list[tuple[Counts, Counts]], parts: int, finer: float, around: Counts
    ) -> tuple[Counts, Array]:
        """Row and angle of each node, in no order."""
        rows, angles = [], []
        for level, (row, start) in enumerate(leaves):
            intervals = self.exist[level].shape[1]
            # The hat of a pole is by far the smallest: one part fewer beside it.
            polar = (start == 0) | (start == intervals - 1) if self.poles else np.zeros_like(start, dtype=np.bool_)
            wanted = around[row] / intervals
            if level == 0:
                wanted = np.maximum(wanted, self.parts[row, start] * finer)
            numbers = np.maximum(np.ceil(wanted).astype(np.intp), parts) - polar
            for number in np.unique(numbers):
                which = numbers == number
                rows.append(np.repeat(row[which], number))
                angles.append((self.step / (1 << level) * (start[which][:, None] + np.arange(number) / number)).ravel())
        return np.concatenate(rows), np.concatenate(angles)

    def _rows(self, row: Counts, angle: Array) -> list[tuple[float, ...]]:
        """The angles of each row, in order."""
        order = np.lexsort((angle, row))
        ends = np.cumsum(np.bincount(row, minlength=len(self.exist[0])))[:-1]
        return [tuple(nodes.tolist()) for nodes in np.split(angle[order], ends)]


def _change(sums: HatSums) -> Array:
    """How much the value at each node changes if all steps are halved, in standard errors; shape (rows, nodes).

    It is 0 where there are too few rays; the error is so large that a change of no consequence is none.
    """
    value, error = sums.held / sums.wide, np.sqrt(sums.variance)
    fewest = np.where(sums.change > 0.0, FEW, FEWEST)
    return _in_errors(sums.change, error, value, _equal(sums.held, sums.squares), fewest)


def _modulation(angle: Array, weight: Array, row: Counts, rows: int, size: int) -> Array:
    """What one or two nodes around the axis cannot hold, as `_change`, the same for all nodes of a row.

    They stand for an even row and, on four nodes at most, for light to one side; whatever the direction of that side, the
    amplitude of the first or second harmonic tells whether there is more: Σ w exp(ikC), whose parts have the variance
    ½ Σ w² in even light.
    """
    turn = np.exp(1j * size * np.radians(angle))
    terms = (weight * turn.real, weight * turn.imag, weight, weight * weight)
    across, along, held, squares = (np.asarray(np.bincount(row, term, rows), dtype=np.float64) for term in terms)
    error = np.sqrt(squares / 2.0)
    found = _in_errors(np.hypot(across, along), error, held / 2.0, _equal(held, squares), np.full(rows, FEW))
    return np.repeat(found[:, None], size, axis=1)


def _equal(held: Array, squares: Array) -> Array:
    """How many equal rays have this Σ w and Σ w²."""
    return np.divide(held * held, squares, out=np.zeros(held.shape), where=squares > 0.0)


def _in_errors(change: Array, error: Array, value: Array, equal: Array, fewest: Array) -> Array:
    """Changes of values in standard errors; 0 for fewer equal rays than `fewest`, and for what is of no consequence."""
    top = value[equal >= FEWEST].max(initial=0.0)
    error = np.maximum(error, MATERIAL * top / LIKELY)
    return np.divide(change, error, out=np.zeros(change.shape), where=(error > 0.0) & (equal >= fewest))


def _beside(nodes: Flags, size: int) -> Flags:
    """The intervals on both sides of nodes; at a pole, whose hat is by far the smallest, the pole alone decides."""
    if nodes.shape[1] == size:
        return nodes | np.roll(nodes, -1, axis=1)
    before, after = nodes[:, :-1].copy(), nodes[:, 1:].copy()
    before[:, -1], after[:, 0] = False, False
    return before | after


def _grown_along(sure: Flags, maybe: Flags) -> Flags:
    """With what may be so wherever it is so in a row beside it."""
    while True:
        more = sure.copy()
        more[1:] |= sure[:-1] & maybe[1:]
        more[:-1] |= sure[1:] & maybe[:-1]
        if (more == sure).all():
            return sure
        sure = more


def _smallest(nodes: Nodes) -> float:
    """The smallest step of γ [°]."""
    return float(np.diff(nodes.gamma).min())


def _stated(nodes: Nodes, values: Array) -> tuple[float, ...]:
    """Angles at which the function is stated, so that other rules of integration find its flux as well.

    A reader may sum I sin γ by the trapezium rule; for what is linear in γ that differs from the integral by about
    h²/12 · Δ(I sin γ)′. Intervals are halved until all differences together are below `READING` of the flux.
    """
    gaps = gaps_of(np.array(nodes.planes))
    mean = ((gaps + np.roll(gaps, 1)) / 2.0 @ values) / TURN
    rows = np.array(nodes.gamma)
    flux = float(mean @ hat_integrals(rows))
    table = rows
    while True:
        level = np.interp(table, rows, mean)
        width = np.diff(table)
        between = (
            np.radians(width)
            / 2.0
            * (level[:-1] * np.sin(np.radians(table[:-1])) + level[1:] * np.sin(np.radians(table[1:])))
        )
        exact = _pieces(table, level)
        off = np.abs(between - exact)
        wanted = width > WIDEST_STATED
        if off.sum() > READING * flux:
            wanted |= off > 0.25 * off.max()
        wanted &= width > FINEST / 64.0
        if not wanted.any() or table.size + int(wanted.sum()) > MOST_ANGLES:
            return tuple(table.tolist())
        table = np.sort(np.concatenate([table, (table[:-1] + width / 2.0)[wanted]]))


def _pieces(gamma: Array, values: Array) -> Array:
    """∫ I sin γ dγ over each interval, for I linear in it."""
    before, after = hat_halves(gamma)
    return np.asarray(values[:-1] * before + values[1:] * after)


def _too_wide(sample: _Sample, asked: Nodes, suited: Nodes) -> list[str]:
    """What is to be said if the steps that were asked for lower the peak."""
    if not sample.flux.size:
        return []
    values, errors = sample.tables(asked)
    better, better_errors = sample.tables(suited)
    low, high = int(values.argmax()), int(better.argmax())
    noise = math.hypot(*(float(np.nan_to_num(e.ravel()[i])) for e, i in ((errors, low), (better_errors, high))))
    loss = float(better.max() - values.max())
    if not (loss > 3.0 * noise and loss > TOO_WIDE * float(better.max())):
        return []
    row = high % better.shape[1]
    around = np.array(suited.gamma)
    step = float(np.diff(around)[max(0, np.searchsorted(around, suited.table[row]) - 1)])
    lost = 100.0 * loss / float(better.max())
    told = (
        f"steps too wide for the beam: peak about {rounded(lost, 2 if lost < 95.0 else 3)} % too low; steps as asked, "
        f"{max(np.diff(asked.gamma)):.4g}° of γ and {len(asked.planes)} planes, cannot hold it, γ in steps of {step:.2g}°"
        f"{f' and {len(suited.planes)} planes' if len(suited.planes) > len(asked.planes) else ''} would; "
        "the flux is not touched"
    )
    return [told]
