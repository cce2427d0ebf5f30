"""Scatter that TracePro describes by numbers in columns: models that are the same function, else tables of it."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import UnsupportedFormatError
from etendue.formats.bsdf.tracepro_lines import Lines, Rows
from etendue.formats.bsdf.tracepro_readings import Reading
from etendue.quantities.bsdf_directions import NORMAL, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

FLOATING = 90.0
"""Azimuth of the forward direction [°] where the zero is at right angles to the plane of incidence: the floating axis."""

INCIDENCES = (0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0)
SPARSE = (0.0, 20.0, 40.0, 60.0, 75.0, 85.0)
"""Angles at which a table is made [°], besides those of the file; the second with many azimuths of incidence."""

GRAZING = 89.0
"""Stands for 90°, where there is no hemisphere."""

TURN = 10.0
"""Azimuths of incidence [°] of lobes that are not round about an axis of the sample."""

AZIMUTHS = ((3.0, 72), (8.0, 144), (20.0, 360), (np.inf, 720))
"""How many azimuths a slice has, up to which ratio of its widths; the first with many azimuths of incidence."""

LONG = 5.0
"""Ratio of widths from which lobes are smeared between those azimuths of incidence."""

FINEST = 64
"""Most azimuths over which each value of a table is a mean, so that a narrow streak keeps its light."""

APART = 1.5
"""Distance of these azimuths in widths of a streak: the sum over a Gaussian at every 1.5 σ is its integral to 10⁻³."""

MOST_VALUES = 1 << 26
"""Of all tables together."""

FAR = 10.0
"""Widths beyond which there is little light."""

RATIO, ROUND_RATIO = 1.07, 1.03
"""Of one |β − β₀| to the one before; the second where f does not depend on azimuth."""


@dataclasses.dataclass(frozen=True, eq=False)
class Numbers:
    """Numbers by wavelength, angle and azimuth of incidence, linear in the angles as TracePro has it.

    Parameters
    ----------
    wavelength : array, shape (w,)
        [nm].
    theta, phi : array, shape (t,), (p,)
        [°].
    values : array, shape (w, t, p, k)
    line : array of int, shape (w, t, p)
        Where they stand, from 0.
    """

    wavelength: Array
    theta: Array
    phi: Array
    values: Array
    line: npt.NDArray[np.intp]

    @classmethod
    def of(cls, lines: Lines, rows: Rows, values: Array) -> Numbers:
        """Of the rows of shares, with values of shape (rows, k).

        Raises
        ------
        FormatError
            If a wavelength, an angle and an azimuth that there are do not come together once.
        """
        micrometres, theta, phi = rows.values[:, 1], rows.values[:, 2], rows.values[:, 3] % 360.0
        oblique = theta >= NORMAL
        nodes = np.unique(micrometres), np.unique(theta), np.unique(phi[oblique] if oblique.any() else phi[:1])
        shape = tuple(one.size for one in nodes)
        found, line = np.full((*shape, values.shape[1]), np.nan), np.full(shape, -1)
        for row, place in enumerate(zip(*map(np.searchsorted, nodes, (micrometres, theta, phi)), strict=True)):
            # Light along the normal comes from no azimuth, and its row holds for all.
            to = place if oblique[row] else place[:2]
            if (found[to][line[to] >= 0] != values[row]).any():
                text = (
                    f"{theta[row]:g}° of incidence is stated twice for one wavelength and azimuth, with other numbers"
                )
                raise lines.refuse(int(rows.line[row]), text)
            found[to], line[to] = values[row], rows.line[row]
        if (line < 0).any():
            text = "angles of incidence that are not stated for each wavelength and azimuth"
            raise lines.refuse(int(rows.line[-1]), text)
        return cls(1e3 * nodes[0], nodes[1], nodes[2], found, line)

    def at(self, colour: int, theta: float, phi: float) -> Array:
        """The numbers (k,) at a wavelength by its index and at angles [°]; beyond the first and the last angle theirs."""
        j, u = _place(self.theta, theta)
        k, v = _place(np.append(self.phi, self.phi[0] + 360.0), self.phi[0] + (phi - self.phi[0]) % 360.0)
        known = self.values[colour][[j, min(j + 1, self.theta.size - 1)]][:, [k, (k + 1) % self.phi.size]]
        return np.asarray(np.einsum("i,j,ijk->k", [1.0 - u, u], [1.0 - v, v], known))

    def depends_on(self, axis: int) -> bool:
        """Whether values differ along an axis: 0 wavelength, 1 angle, 2 azimuth of incidence."""
        return bool((self.values != self.values.take([0], axis)).any())


def _place(nodes: Array, x: float) -> tuple[int, float]:
    """The node below, and how far on to the next."""
    j = int(np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, max(nodes.size - 2, 0)))
    if nodes.size == 1:
        return 0, 0.0
    return j, float(np.clip((x - nodes[j]) / (nodes[j + 1] - nodes[j]), 0.0, 1.0))


@dataclasses.dataclass(frozen=True, eq=False)
class Way:
    """Light of one way that meets one side.

    Parameters
    ----------
    front : bool
        Which side it meets.
    transmitted : bool
    numbers : Numbers
        A, B, By, g, gy, and the values of a one-dimensional table behind them.
    """

    front: bool
    transmitted: bool
    numbers: Numbers

    @classmethod
    def of(cls, lines: Lines, rows: Rows, values: Array, *, front: bool, transmitted: bool, strength: Array) -> Way:
        """Where nothing is scattered, widths mean nothing: those of the nearest row where there is something stand there."""
        numbers = Numbers.of(lines, rows, np.column_stack([values, strength]))
        known, strong = numbers.values[..., :-1], numbers.values[..., -1] > 0.0
        filled = known.copy()
        places = np.argwhere(strong)
        for place in map(tuple, np.argwhere(~strong) if len(places) else ()):
            nearest = places[np.argmin(np.abs(places - place) @ [10**6, 1, 10**3])]
            filled[place][1:5] = known[tuple(nearest)][1:5]
        return cls(front, transmitted, dataclasses.replace(numbers, values=filled))

    def scattering(self) -> Iterator[tuple[Array, int]]:
        """Numbers of the rows in which something is scattered, each different one once; and the line of the first."""
        strong = np.flatnonzero(self.strong.ravel())
        rows = self.numbers.values.reshape(-1, self.numbers.values.shape[-1])[strong]
        _, first = np.unique(rows, axis=0, return_index=True)
        for k in first:
            yield rows[k], int(self.numbers.line.ravel()[strong[k]])

    @property
    def strong(self) -> npt.NDArray[np.bool_]:
        """In which rows something is scattered, shape (w, t, p)."""
        values = self.numbers.values
        return np.asarray((values[..., 5:].max(-1) if values.shape[-1] > 5 else values[..., 0]) > 0.0)


def constant(ways: Sequence[Way]) -> Array | None:
    """The numbers (k,) of ways of light if they are the same in each row of all of them."""
    first = ways[0].numbers.values[0, 0, 0]
    return first if all((one.numbers.values == first).all() for one in ways) else None


def made(
    reading: Reading, pairs: Sequence[Sequence[Way]], lines: Lines, *, turning: bool, round_: bool
) -> tuple[list[Mapping[str, Any]], list[BsdfSlice], list[Complaint]]:
    """Components and slices of a BSDF, and what to say of them.

    Parameters
    ----------
    reading : Reading
        What the columns stand for.
    pairs : sequence of sequence of Way
        Reflected and transmitted light, of each side; only what scatters something.
    lines : Lines
        For errors.
    turning : bool
        Whether the axis turns with the plane of incidence.
    round_ : bool
        Whether there is no axis.

    Raises
    ------
    UnsupportedFormatError
        If f is a streak so narrow that no table holds it, or there are too many incidences.
    """
    components: list[Mapping[str, Any]] = []
    tabled: list[Way] = []
    for ways in pairs:
        same = constant(ways)
        keys = None if same is None else reading.model(same, turning)
        if keys is None:
            tabled += [one for one in ways if one.strong.any()]
        else:
            components.append({**keys, "way": "transmitted" if ways[0].transmitted else "reflected"})
    # A table has the same wavelengths and azimuths of incidence for all light.
    coloured = any(one.numbers.depends_on(0) for one in tabled)
    turned = not turning and not (round_ and not any(one.numbers.depends_on(2) for one in tabled))
    slices: list[BsdfSlice] = []
    longest, held = 1.0, 0
    with np.errstate(over="ignore", under="ignore"):
        for one in tabled:
            nodes = _Nodes.of(reading, one, lines, many=turned and not round_, round_=round_)
            for another in _slices(reading, one, nodes, coloured=coloured, turned=turned, round_=round_):
                slices.append(another)
                held += another.values.size
                if held > MOST_VALUES:
                    found = (
                        f"numbers that differ between more incidences than a table of {MOST_VALUES} values has room for"
                    )
                    advice = "Export fewer wavelengths, or fewer azimuths of incidence."
                    raise UnsupportedFormatError(lines.path, "rows of shares", found, advice)
            longest = max(longest, nodes.ratio)
    return components, slices, list(_remarks(slices, longest, turned=turned))


def _remarks(slices: Sequence[BsdfSlice], longest: float, *, turned: bool) -> Iterator[Complaint]:
    angles = sorted({round(one.theta, 6) for one in slices})
    if angles:
        span = f"{len(angles)} angles of incidence from {angles[0]:g} to {angles[-1]:g}°"
        yield Complaint("note", "Scatter", f"the formula became a table at {span}")
    if turned and longest > LONG:
        text = (
            f"a lobe {longest:.3g} times as long as it is wide is smeared over up to {TURN / 2:g}° to each side, since the "
            f"table has light from every {TURN:g}° of azimuth"
        )
        yield Complaint("note", "Scatter", text, "bsdf-files.md, tracepro")


@dataclasses.dataclass(frozen=True, eq=False)
class _Nodes:
    """|β − β₀|, azimuths [°], over how many azimuths about it each value is the mean, and the ratio of the widths."""

    radial: Array
    azimuth: Array
    finer: int
    ratio: float

    @classmethod
    def of(cls, reading: Reading, way: Way, lines: Lines, *, many: bool, round_: bool) -> _Nodes:
        """From far within the lobe on, and as many azimuths as the widths along the axis and across it demand."""
        narrow, ratio, line = 2.0, 1.0, 0
        for p, at in itertools.islice(way.scattering(), 50):
            widths = reading.widths(p)
            narrow, line = min((narrow, line), (min(widths), at))
            ratio = max(ratio, max(widths) / min(widths))
        start = max(0.02 * narrow, 1e-6)
        step = ROUND_RATIO if round_ else RATIO
        radial = np.geomspace(start, 2.0, int(np.log(2.0 / start) / np.log(step)) + 2)
        radial = np.unique(np.concatenate([[0.0], radial, reading.nodes]))
        if round_:
            return cls(radial, np.zeros(1), 1, 1.0)
        count = next(count for most, count in AZIMUTHS if many or ratio <= most)
        azimuth = np.linspace(0.0, 360.0, count, endpoint=False)
        reach = min(2.0, FAR * ratio * narrow)
        if reach * np.radians(azimuth[1]) > FINEST * APART * narrow:
            found = f"a streak with a width of {narrow:.2g}, which is {ratio:.3g} times as long"
            advice = "No table holds it. Widen it, or take it for specular light."
            raise UnsupportedFormatError(lines.path, f"line {line + 1}", found, advice)
        finer = int(np.ceil(2.0 * np.radians(azimuth[1]) / (APART * narrow)))
        return cls(radial, azimuth, min(max(finer, 1), FINEST), ratio)


def _slices(
    reading: Reading, way: Way, nodes: _Nodes, *, coloured: bool, turned: bool, round_: bool
) -> Iterator[BsdfSlice]:
    numbers = way.numbers
    many = turned and not round_
    theta = np.unique(np.minimum([*numbers.theta, *(SPARSE if many else INCIDENCES)], GRAZING))
    phi = np.unique([*numbers.phi, *np.arange(0.0, 360.0, TURN)]) if many else numbers.phi
    for colour, wavelength in enumerate(numbers.wavelength if coloured else numbers.wavelength[:1]):
        for angle, around in itertools.product(theta, phi if turned else phi[:1]):
            if angle < NORMAL and around != phi[0]:
                continue
            azimuth = (180.0 + (around if turned else 0.0)) % 360.0
            incident = light_from(angle, azimuth, behind=not way.front)
            start = forwards(azimuth, turning=not turned)
            values = _sampled(reading, numbers.at(colour, float(angle), float(around)), nodes, start)
            grid = PolarGrid("cosines", nodes.radial, nodes.azimuth)
            nanometres = float(wavelength) if coloured else None
            yield BsdfSlice(incident, values, way.transmitted, grid=grid, wavelength=nanometres)


def forwards(phi: float, *, turning: bool) -> float:
    """The azimuth [°] of the forward direction, from the local x axis as the file counts; light comes from azimuth `phi`."""
    return FLOATING if turning else (phi - 180.0) % 360.0


def _sampled(reading: Reading, numbers: Array, nodes: _Nodes, start: float) -> Array:
    """Values [1/sr] of shape (azimuths, radial)."""
    parts = ((np.arange(nodes.finer) + 0.5) / nodes.finer - 0.5) * (360.0 / nodes.azimuth.size)
    f = np.zeros((nodes.azimuth.size, nodes.radial.size))
    for part in parts:
        turn = np.radians(nodes.azimuth + start + part)[:, None]
        f += reading.value(np.cos(turn) * nodes.radial, np.sin(turn) * nodes.radial, numbers)
    return np.asarray(f / nodes.finer)
