"""Which reading of a TracePro property its own shares agree with: absorbed, specular and scattered light add up to 1."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from etendue.errors import UnsupportedFormatError
from etendue.formats.bsdf.shares import CLOSE as DISAGREES
from etendue.formats.bsdf.tracepro_lines import Lines
from etendue.formats.bsdf.tracepro_models import FLOATING, Numbers, Way
from etendue.formats.bsdf.tracepro_readings import Reading
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

CLOSE = 0.1
"""Relative difference up to which what a file leaves for scatter agrees with a reading: others are off by factors."""

LEAST = 1e-3
"""Share of the flux that may be left by the rounding of the others."""

STEEPEST = 85.0
"""Angle of incidence [°] beyond which shares are not held against a reading: lobes are cut by the horizon there."""

MOST_ROWS = 24
"""That are looked at, of each side."""


@dataclasses.dataclass(frozen=True, eq=False)
class Lit:
    """Light that meets one side: both ways, and what each row leaves for scatter.

    Parameters
    ----------
    ways : sequence of Way
    left : Numbers
        Of one number each.
    """

    ways: Sequence[Way]
    left: Numbers


@dataclasses.dataclass(frozen=True)
class Row:
    """A row in which something is scattered: the angle of incidence [°], what is left for scatter, what a reading makes."""

    theta: float
    left: float
    made: float

    @property
    def off(self) -> float:
        """By how much the two differ, as a part of what is left."""
        return abs(self.made - self.left) / self.left

    def __str__(self) -> str:
        return f"they leave {self.left:.4g} of the light for scatter at {self.theta:g}°, it makes {self.made:.4g}"


def _unsound(reading: Reading, sides: Sequence[Lit]) -> int | None:
    """The line of a row that makes no sense in a reading, or no finite f."""
    at = np.zeros(1)
    with np.errstate(all="ignore"):
        for way in (way for side in sides for way in side.ways):
            for p, line in way.scattering():
                if not reading.sound(p) or not np.isfinite(reading.value(at, at, p)).all():
                    return line
    return None


def only(reading: Reading, sides: Sequence[Lit], lines: Lines) -> Reading:
    """The reading of a kind of scatter that has but one.

    Raises
    ------
    FormatError
        If a row makes no sense in it.
    """
    line = _unsound(reading, sides)
    if line is not None:
        raise lines.refuse(line, "numbers that make no BSDF: B has to be more than 0, unless g is 0, and A/B finite")
    return reading


def unbalanced(reading: Reading, sides: Sequence[Lit], *, turning: bool) -> Iterator[Complaint]:
    """A note if the shares leave more or less for scatter than a formula makes that is not in doubt, by more than 1 %.

    Parameters
    ----------
    reading, sides, turning
        As of `chosen`.
    """
    rows = list(_rows(reading, sides, turning=turning))
    worst = max(rows, key=lambda row: row.off, default=None)
    if worst is not None and worst.off > DISAGREES:
        yield Complaint("note", "rows of shares", f"the formula does not agree with the shares: {worst}")


def chosen(
    readings: Sequence[Reading], sides: Sequence[Lit], lines: Lines, *, turning: bool
) -> tuple[Reading, Complaint]:
    """The reading that the shares agree with best, and what to say of it.

    Parameters
    ----------
    readings : sequence of Reading
        Of the kind of scatter.
    sides : sequence of Lit
        What the file holds.
    lines : Lines
        For errors.
    turning : bool
        Whether the axis turns with the plane of incidence.

    Raises
    ------
    UnsupportedFormatError
        If no reading makes sense, or the shares agree with none.
    """
    line, kind = lines.value("Scatter")

    def unsupported(found: str, advice: str) -> UnsupportedFormatError:
        return UnsupportedFormatError(lines.path, f"line {line + 1}", f"scatter {kind}: {found}", advice)

    sensible = [reading for reading in readings if _unsound(reading, sides) is None]
    if not sensible:
        wanted = "; or ".join(reading.says for reading in readings)
        raise unsupported("numbers that make no sense", f"Known readings: {wanted}. Export it as an asymmetric table.")
    judged = [
        (max(rows, key=lambda row: row.off), reading)
        for reading in sensible
        if (rows := list(_rows(reading, sides, turning=turning)))
    ]
    unknown = "no document says what its columns hold, and its shares"
    solve = "Have TracePro solve for the absorptance, so that the shares add up to 1, and export it again."
    if not judged:
        raise unsupported(f"{unknown} leave nothing for scatter that would tell", solve)
    row, reading = min(judged, key=lambda one: one[0].off)
    if row.off > CLOSE:
        raise unsupported(f"{unknown} agree with no reading: if {reading.says}, {row}", solve)
    numbers = next(p for side in sides for way in side.ways for p, _ in way.scattering())
    for other_row, other in judged:
        if other_row.off <= CLOSE and _differ(reading, other, numbers):
            found = f"{unknown} agree with two readings: {reading.says}; or {other.says}"
            raise unsupported(found, "Set the numbers to 0 that this kind of scatter does not use.")
    text = f"no document says what the columns hold; its shares agree with this: {reading.says}; {row}"
    return reading, Complaint("note", f"line {line + 1}", text, "bsdf-files.md, tracepro")


def _differ(one: Reading, other: Reading, numbers: Array) -> bool:
    """Whether two readings make another f of numbers at half of its widths, by more than shares can tell."""
    along, across = one.widths(numbers)
    x, y = np.array([0.0, 0.5 * along, 0.0]), np.array([0.0, 0.0, 0.5 * across])
    f = one.value(x, y, numbers)
    return bool((np.abs(f - other.value(x, y, numbers)) > 2.0 * CLOSE * f).any())


def _rows(reading: Reading, sides: Sequence[Lit], *, turning: bool) -> Iterator[Row]:
    for side in sides:
        left = side.left.values[..., 0]
        scattering = np.any([way.strong for way in side.ways], axis=0)
        places = np.argwhere(scattering & (left > LEAST) & (side.left.theta <= STEEPEST)[:, None])
        for i, j, k in places[:: max(1, -(-len(places) // MOST_ROWS))]:
            theta, phi = side.left.theta[j], FLOATING if turning else side.left.phi[k]
            specular = np.sin(np.radians(theta)) * np.array([np.cos(np.radians(phi)), np.sin(np.radians(phi))])
            with np.errstate(all="ignore"):
                made = sum(
                    reading.share(way.numbers.values[i, j, k], specular) for way in side.ways if way.strong[i, j, k]
                )
            yield Row(float(theta), float(left[i, j, k]), float(np.nan_to_num(made, nan=np.inf)))
