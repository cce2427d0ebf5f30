"""The nodes of a far field: what rays are shared by, and how their sums become a table of intensity."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.angle_table import gaps_of, hat_integrals
from etendue.quantities.arguments import as_whole, require_number
from etendue.quantities.few_rays import NodeSums, one_ray
from etendue.quantities.intensity import Intensity
from etendue.quantities.node_blur import blur_of, hidden_shapes, rising_rows
from etendue.quantities.provenance import Provenance
from etendue.units import FluxUnit

Array = npt.NDArray[np.float64]

MOST_CELLS = 1 << 26
"""Cells of a table: half a gigabyte for each of its sums."""

LIT = 0.02
"""Share of the peak above which nodes are asked whether steps are too wide for them."""

MANY = 10.0
"""Standard errors beyond which it is of no consequence how many."""

UNTOLD = 0.5
"""Standard errors of a node that what it blurs must be to be told from noise: two of those of a second difference over
12."""

NEIGHBOURS = 0.25
"""Correlation of the errors of neighbouring nodes: ∫φφ' over ∫φ² of two hats in even light."""


@dataclasses.dataclass(frozen=True)
class Nodes:
    """Nodes in C and γ, and the table that is made of them.

    A table stands for a function that is linear in C and γ between its nodes. Its basis are the hats φ of the nodes, which
    add up to 1 in every direction. A ray of flux w gives each node the share w φ, and the intensity of a node is the sum
    of the shares over ∫φ dΩ: a mean of the intensity, weighted by the hat. So the integral of the function is the flux of
    the rays, exactly, whatever the steps are.

    Rows of γ have nodes C of their own: few where rays are few, as about the poles, where one node stands for all C.

    Parameters
    ----------
    gamma : tuple of float
        [°] Rows, from 0 to 180.
    c : tuple of tuples of float
        [°] For each row its nodes, from 0 up to below 360.
    table : tuple of float
        [°] Angles γ of the table: the rows, and angles between them at which the same function is stated again, for
        readers whose rule of integration needs small steps.
    planes : tuple of float
        [°] Planes C of the table: those of all rows, and others at which the same function is stated again.

    Examples
    --------
    >>> nodes = Nodes.even(4, 45)
    >>> len(nodes), nodes.planes, nodes.table
    (15, (0.0, 90.0, 180.0, 270.0), (0.0, 45.0, 90.0, 135.0, 180.0))
    >>> bool(np.isclose(nodes.solid_angle.sum(), 4 * np.pi))
    True
    """

    gamma: tuple[float, ...]
    c: tuple[tuple[float, ...], ...]
    table: tuple[float, ...]
    planes: tuple[float, ...]

    @classmethod
    def even(cls, c_planes: int, gamma_step: float) -> Nodes:
        """Nodes in equal steps; one at each pole.

        Parameters
        ----------
        c_planes : int
            Planes, from C = 0°.
        gamma_step : float
            [°], a whole part of 180.

        Raises
        ------
        ArgumentError
            If there are no such planes or steps, or too many nodes.
        """
        as_whole(c_planes, "c_planes", 1, MOST_CELLS)
        require_number(gamma_step, "gamma_step", "an angle above 0° and up to 90°")
        check_steps(c_planes, gamma_step)
        gamma = tuple(np.linspace(0.0, 180.0, round(180.0 / gamma_step) + 1).tolist())
        plane = planes_of(c_planes)
        return cls(gamma, ((0.0,), *[plane] * (len(gamma) - 2), (0.0,)), gamma, plane)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Nodes:
        """From plain data as `dataclasses.asdict` makes them."""
        rows = tuple(tuple(map(float, row)) for row in data["c"])
        gamma, table, planes = (tuple(map(float, data[name])) for name in ("gamma", "table", "planes"))
        return cls(gamma, rows, table, planes)

    def __len__(self) -> int:
        """Cells that rays are summed in: one for each node, and the last one for all rays together."""
        return sum(map(len, self.c)) + 1

    def describe(self) -> str:
        """What the table is made of, in a sentence."""
        steps, planes = np.diff(self.gamma), [len(row) for row in self.c[1:-1]]
        low, high = float(steps.min()), float(steps.max())
        gamma = f"{low:.3g}°" if np.isclose(low, high) else f"{low:.3g}° to {high:.3g}°"
        most = f"{max(planes)}" if min(planes) == max(planes) else f"{min(planes)} to {max(planes)}"
        return f"each node is the mean around it; nodes in steps of {gamma} of γ, {most} around the axis"

    def core(self) -> _core.FarField:
        """The nodes as the compiled core takes them."""
        return _core.FarField(np.radians(self.gamma).tolist(), [np.radians(row).tolist() for row in self.c])

    @cached_property
    def solid_angle(self) -> Array:
        """∫φ dΩ of each node [sr], row by row."""
        rows = []
        for weight, row in zip(hat_integrals(np.array(self.gamma)), self.c, strict=True):
            gaps = np.radians(gaps_of(np.array(row)))
            rows.append(weight * (gaps + np.roll(gaps, 1)) / 2.0)
        return np.concatenate(rows)

    def tables(self, flux: Array, error: Array) -> tuple[Array, Array]:
        """Intensity and its standard error at the nodes of the table, each of shape (planes, γ).

        Parameters
        ----------
        flux, error : array
            Of each node, without the cell of all rays: its shares of the rays, and their standard error; NaN if unknown.

        Returns
        -------
        values, error : array
            Where the table has a value between nodes, its error is that of the interpolation, with the correlation of ¼
            that neighbours have in even light, and with what the curvature around makes of a straight line.
        """
        values, error = flux / self.solid_angle, error / self.solid_angle
        ends = np.cumsum([len(row) for row in self.c])[:-1]
        pairs = zip(self.c, np.split(values, ends), np.split(error, ends), strict=True)
        planes = np.array(self.planes)
        rows = [_around(np.array(c), v, e, planes) for c, v, e in pairs]
        value_rows, error_rows = (np.stack(arrays) for arrays in zip(*rows, strict=True))
        gamma, table = np.array(self.gamma), np.array(self.table)
        error_rows = np.hypot(error_rows, hidden_shapes(gamma, self.c, planes, value_rows, error_rows))
        before = (np.searchsorted(gamma, table, side="right") - 1).clip(0, gamma.size - 2)
        width = gamma[before + 1] - gamma[before]
        up = ((table - gamma[before]) / width)[:, None]
        # A plane through a pole goes on at the other side; the curvature there is taken as that of the row beside.
        bend = _curvature(value_rows, np.diff(gamma)[:, None])
        bend = np.concatenate([bend[:1], bend, bend[-1:]]) if bend.size else np.zeros_like(value_rows)
        off = (bend[before] + bend[before + 1]) / 2.0 * width[:, None] ** 2
        between = _between(
            value_rows[before], value_rows[before + 1], error_rows[before], error_rows[before + 1], up, off
        )
        return between[0].T, between[1].T

    def _noise(self, flux: Array, error: Array) -> Array:
        """Standard errors of sums over rays, no less than those of as many equal rays, and one more; NaN stays."""
        counts = np.array([len(row) for row in self.c])
        row = np.repeat(np.arange(counts.size), counts)
        single = one_ray(NodeSums(np.array(self.gamma), row, np.concatenate(self.c), flux, error))
        return np.asarray(np.hypot(np.maximum(error, np.sqrt(single * flux)), single))

    def intensity(
        self,
        flux: Array,
        error: Array,
        unit: FluxUnit,
        provenance: Provenance,
        notes: tuple[str, ...] = (),
    ) -> Intensity:
        """The table of sums over rays; `flux` and `error` are those of all cells, the one of all rays being the last.

        Where light ends, or rises from a dark pole, the errors of nodes that were chosen hold what the mean around a node is
        off from the intensity at it. Of steps that were asked for, errors are those of the means; a note tells if the steps
        are so wide for the light that the intensity at the nodes is off from them by more.
        """
        noise, level = self._noise(flux[:-1], error[:-1]), flux[:-1] / self.solid_angle
        blur = blur_of(self.gamma, self.c, level, np.nan_to_num(noise) / self.solid_angle)
        # Chosen steps are wider beside the poles (`etendue.quantities.node_choice`).
        if np.allclose(np.diff(self.gamma), self.gamma[1] - self.gamma[0]):
            notes = (*notes, *_told_of_blur(level, noise / self.solid_angle, blur.off))
        else:
            off, edge = blur.off * self.solid_angle, blur.edge * self.solid_angle
            told = np.where(rising_rows(self.c, level), off**2, np.maximum(off**2 - (UNTOLD * noise) ** 2, 0.0))
            noise = np.sqrt(noise**2 + told + edge**2)
            # Where it is dark beside a node, it may be dark there as well.
            noise = np.where(blur.dark & (level > 0.0), np.maximum(noise, flux[:-1]), noise)
        values, errors = self.tables(flux[:-1], noise)
        return Intensity(
            np.array(self.planes),
            np.array(self.table),
            values,
            errors,
            flux_unit=unit,
            flux_error=float(error[-1]),
            provenance=provenance,
            notes=notes,
        )


def _told_of_blur(level: Array, error: Array, blur: Array) -> tuple[str, ...]:
    """What is to be said of nodes around which the light bends by more than their errors, if it does."""
    top = float(level.max(initial=0.0))
    lit = (level > LIT * top) & (error > 0.0)
    if not lit.any():
        return ()
    off = float(np.sqrt(np.mean((blur[lit] / error[lit]) ** 2)))
    if not off > 1.0:
        return ()
    by = f"{off:.2g}" if off < MANY else f"more than {MANY:g}"
    told = (
        f"errors are those of the means around nodes: with steps this wide, the intensity at a node is off from the mean by "
        f"{by} of them (root mean square), up to about {np.abs(blur[lit]).max() / top:.1%} of the peak, and beam angles and "
        "fluxes of zones accordingly; without stated steps, nodes are chosen that suit the light"
    )
    return (told,)


def check_steps(c_planes: int | None, gamma_step: float | None) -> None:
    """Refuse steps that no table can have; None is any.

    Raises
    ------
    ArgumentError
        If so.

    Examples
    --------
    >>> check_steps(36, 2.5), check_steps(None, None)
    (None, None)
    """
    if c_planes is not None:
        as_whole(c_planes, "c_planes", 1, MOST_CELLS)
    if gamma_step is None:
        steps = 0
    else:
        require_number(gamma_step, "gamma_step", "an angle above 0° and up to 90°")
        if not (math.isfinite(gamma_step) and 0.0 < gamma_step <= 90.0):
            raise ArgumentError(f"gamma_step is {gamma_step:g}°; give an angle above 0° and up to 90°.")
        steps = round(180.0 / gamma_step)
        if not math.isclose(steps * gamma_step, 180.0, rel_tol=1e-9):
            raise ArgumentError(
                f"gamma_step is {gamma_step:g}°, which does not divide 180°; {_round_step(steps):g}° would do."
            )
    cells = (c_planes or 1) * (steps + 1)
    if cells > MOST_CELLS:
        raise ArgumentError(f"{cells:,} cells; give fewer c_planes or a larger gamma_step, at most {MOST_CELLS:,}.")


def _round_step(steps: int) -> float:
    """The step nearest to that of so many steps in 180° which divides 180° and has three digits at most [°].

    Examples
    --------
    >>> _round_step(26), _round_step(2), _round_step(14_634_146)
    (7.2, 90.0, 1.25e-05)
    """
    near = 180.0 / steps
    # In units of its third digit.
    places = 2 - math.floor(math.log10(near))
    candidates: list[float] = [digits / 10**places for digits in range(100, 1001) if 180 * 10**places % digits == 0]
    return min(candidates, key=lambda step: abs(step - near))


def planes_of(number: int) -> tuple[float, ...]:
    """Planes in equal steps from C = 0° [°].

    Examples
    --------
    >>> planes_of(3)
    (0.0, 120.0, 240.0)
    """
    return tuple(np.linspace(0.0, 360.0, number, endpoint=False).tolist())


def _around(c: Array, values: Array, error: Array, planes: Array) -> tuple[Array, Array]:
    """Values and errors of a row at other planes."""
    first = np.searchsorted(c, planes, side="right") - 1
    second = (first + 1) % c.size
    gaps = gaps_of(c)
    if c.size == 1:
        share = off = np.zeros_like(planes)
    else:
        share = (planes - c[first]) / gaps[first]
        bend = _curvature(np.concatenate([values[-1:], values, values[:1]]), np.append(gaps[-1], gaps))
        off = (bend[first] + bend[second]) / 2.0 * gaps[first] ** 2
    return _between(values[first], values[second], error[first], error[second], share, off)


def _curvature(values: Array, gaps: Array) -> Array:
    """Second derivatives at the inner ones of values along the first axis, by divided differences."""
    slope = np.diff(values, axis=0) / gaps
    result: Array = 2.0 * np.diff(slope, axis=0) / (gaps[1:] + gaps[:-1])
    return result


def _between(a: Array, b: Array, error_a: Array, error_b: Array, share: Array, off: Array) -> tuple[Array, Array]:
    """Linear interpolation, and its error; a value of no weight is of no consequence.

    `off` is the second derivative times the square of the step, ½ share (1 − share) of which a straight line is off by.
    """
    error_a, error_b = np.where(share < 1.0, error_a, 0.0), np.where(share > 0.0, error_b, 0.0)
    low, high, bent = (1.0 - share) * error_a, share * error_b, share * (1.0 - share) / 2.0 * off
    return (1.0 - share) * a + share * b, np.sqrt(low * low + high * high + 2.0 * NEIGHBOURS * low * high + bent * bent)
