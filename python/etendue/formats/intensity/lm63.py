"""IES LM-63, all editions from 1986 to 2019: the reader. See docs/formats/intensity.md."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import re
from pathlib import Path
from typing import Any, Literal

import numpy as np

from etendue.errors import ArgumentError, FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.intensity.goniometer import Kind, in_c_gamma
from etendue.formats.intensity.intensity_format import (
    DAMAGED,
    LARGEST_INTENSITY,
    IntensityFormat,
    either_comma,
    number,
    read_lines,
    scaled,
)
from etendue.formats.intensity.lm63_writer import FACT_BY_KEYWORD, write
from etendue.formats.intensity.opening import opening_facts
from etendue.formats.intensity.symmetry import Array, from_sector
from etendue.quantities.intensity import UNTURNED, Intensity
from etendue.quantities.report import Complaint, Severity
from etendue.units import INTENSITY_UNIT, WATTS_PER_FILE_UNIT, FluxUnit

PHOTOMETRIC_TYPES: dict[int, Literal["A", "B", "C"]] = {1: "C", 2: "B", 3: "A"}
EDITIONS = (1986, 1991, 1995, 2002, 2019)
FACTORS_TOLD = 12
"""Lamp factors that a complaint lists."""

LARGEST_LENGTH = 1e6
"""Metres or feet; millimetres that a file calls metres are less."""

ORIENTATION = f"C planes are the file's own: in IES files C0 lies along the luminaire's length; {UNTURNED}"

_TILT = re.compile(r"\s*TILT\s*=\s*(.*?)\s*", re.IGNORECASE)
_TAG = re.compile(r"\s*IES(?:NA)?\s*:?\s*(?:LM-63-)?(\d{4}|\d{2})\b", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"(?<![^\s])([+-]?\d+),(\d+(?:[eEdD][+-]?\d+)?)(?![^\s])", re.ASCII)
"""A word of its own; a list such as ``0,45,90`` is none."""
_KEYWORD = re.compile(r"\s*\[\s*([^\]]*?)\s*\]\s*(.*?)\s*")


def recognise(head: Head) -> bool:
    """A file with a line ``TILT=``, or one that begins with the tag of an edition."""
    lines = [] if head.is_zip else head.lines
    return any(_TILT.fullmatch(line) for line in lines) or bool(lines and _TAG.match(lines[0]))


@dataclasses.dataclass
class _Words:
    """The words after the line TILT=, taken one after the other; line ends mean nothing there, commas are blanks.

    Or they are decimal commas, which the standard does not know: then `of` has made points of them.
    """

    path: Path
    words: list[str]
    lines: list[int]
    taken: int = 0

    @classmethod
    def of(cls, path: Path, lines: list[str], first: int, *, decimal_commas: bool = False) -> _Words:
        """Those from line `first` on, counted from 0."""
        if decimal_commas:
            lines = [_DECIMAL_COMMA.sub(r"\1.\2", line) for line in lines]
        found = [(w, n) for n, line in enumerate(lines[first:], first + 1) for w in re.split(r"[\s,]+", line) if w]
        return cls(path, [w for w, _ in found], [n for _, n in found])

    @property
    def left(self) -> int:
        return len(self.words) - self.taken

    def numbers(self, count: int, what: str) -> Array:
        if self.left < count:
            found = f"the file ends; {count:,} were announced and {self.left:,} words are left"
            raise FormatError(self.path, what, found, DAMAGED)
        values = np.zeros(count)
        for index in range(count):
            value = number(self.words[self.taken])
            if value is None:
                word, line = self.words[self.taken], self.lines[self.taken]
                place = f"line {line}, {what}" + (f" {index + 1}" if count > 1 else "")
                raise FormatError(self.path, place, f"{word[:40]!r} is no number", DAMAGED)
            values[index] = value
            self.taken += 1
        return values

    def number(self, what: str) -> float:
        return float(self.numbers(1, what)[0])

    def whole(self, what: str, low: int, high: int) -> int:
        value = self.number(what)
        if not (value.is_integer() and low <= value <= high):
            found = f"found {value:g}; it must be a whole number from {low} to {high}"
            raise FormatError(self.path, f"line {self.lines[self.taken - 1]}, {what}", found, DAMAGED)
        return int(value)


def read(path: Path) -> Intensity:
    """Read a file of any photometric type; A becomes C-γ exactly, B by resampling with the error of it in the notes."""
    try:
        return _Reader(path).intensity()
    except FormatError:
        # Decimal commas are certain only where the file makes no sense without them, and comes out even with them.
        found, reader = None, None
        with contextlib.suppress(FormatError):
            reader = _Reader(path, decimal_commas=True)
            found = reader.intensity() if reader.commas else None
        if found is None or reader is None:
            raise
        if all(map(either_comma, reader.commas)):
            either = f"{either_comma(reader.commas[0])}, and so every number with a comma"
            raise FormatError(path, "numbers", either, "Write them without commas, or with points.") from None
        return found


class _Reader:
    """One file on its way to a distribution."""

    def __init__(self, path: Path, *, decimal_commas: bool = False) -> None:
        self.path = path
        self.commas: list[str] = []
        self.complaints: list[Complaint] = []
        self.lines = read_lines(path)
        tilts = [n for n, line in enumerate(self.lines) if _TILT.fullmatch(line)]
        if not tilts:
            raise FormatError(path, "header", "no line begins with TILT=", DAMAGED)
        self.header = self.lines[: tilts[0]]
        match = _TILT.fullmatch(self.lines[tilts[0]])
        self.tilt = match[1] if match else ""
        self.words = _Words.of(path, self.lines, tilts[0] + 1, decimal_commas=decimal_commas)
        if decimal_commas:
            self.commas = [m[0] for line in self.lines[tilts[0] + 1 :] for m in _DECIMAL_COMMA.finditer(line)]
            found = (
                f"{len(self.commas):,} have a decimal comma, which the standard does not know; it was read as a point"
            )
            self.complain("warning", "numbers", found)
        self.keywords = self._keywords()
        self.version = self._version()

    def complain(self, severity: Severity, place: str, found: str, clause: str = "") -> None:
        self.complaints.append(Complaint(severity, place, found, clause))

    # --- header --------------------------------------------------------------------------------------------------------

    def _keywords(self) -> list[tuple[str, str]]:
        """Keyword and text; lines without a keyword (all of them in 1986) are labels."""
        pairs: list[tuple[str, str]] = []
        for line in self.header:
            match = _KEYWORD.fullmatch(line)
            if match and match[1].upper() == "MORE" and pairs:
                pairs[-1] = (pairs[-1][0], f"{pairs[-1][1]} {match[2]}".strip())
            elif match:
                pairs.append((match[1].upper(), match[2]))
            elif line.strip() and not _TAG.match(line):
                pairs.append(("", line.strip()))
        return pairs

    def _version(self) -> int:
        tags = [match for line in self.header if (match := _TAG.match(line))]
        if not tags:
            return 1986
        year = int(tags[0][1])
        year += 0 if year > 99 else 1900 if year >= 86 else 2000
        if year not in EDITIONS:
            nearest = max((e for e in EDITIONS if e <= year), default=1986)
            self.complain(
                "warning", "first line", f"there is no edition of {year}; read as that of {nearest}", "LM-63 5.1"
            )
            return nearest
        return year

    def _unit(self) -> tuple[FluxUnit, float]:
        """Unit of flux, and the factor of the candela values."""
        stated = [text for key, text in self.keywords if key == "_INTENSITYUNITS"]
        if not stated or stated[0].strip().lower() in {"cd", "candela", "lm/sr"}:
            return "lm", 1.0
        factor = WATTS_PER_FILE_UNIT.get(stated[0].strip().lower())
        if factor is None:
            known = f"Known are cd, {', '.join(WATTS_PER_FILE_UNIT)}."
            raise FormatError(self.path, "[_INTENSITYUNITS]", f"found {stated[0][:40]!r}", known)
        return "W", factor

    def _tilt(self) -> dict[str, Any]:
        """Lamp factors over tilt. They act on a tilted luminaire only, so they are kept and not applied."""
        kind = self.tilt.upper()
        if kind == "NONE":
            return {}
        words = self.words
        if kind != "INCLUDE":
            # Only beside the file itself: a name with folders in it could point anywhere.
            beside = self.path.parent / Path(self.tilt.replace("\\", "/")).name
            if not self.tilt or not _is_file(beside) or beside == self.path:
                self.complain("warning", "TILT=", f"the file {self.tilt[:60]!r} is not there; its factors are unknown")
                return {}
            words = _Words.of(beside, read_lines(beside), 0)
        geometry = words.whole("lamp-to-luminaire geometry", 1, 3)
        count = words.whole("number of tilt angles", 1, 10_000)
        angles, factors = words.numbers(count, "tilt angles"), words.numbers(count, "tilt factors")
        if factors[0] != 1.0:
            self.complain("note", "TILT=", f"the lamp factor at {angles[0]:g}° is {factors[0]:g}; it was not applied")
        if (factors[1:] != 1.0).any():
            told = [f"{factor:g} at {angle:g}°" for angle, factor in zip(angles, factors, strict=True)]
            told = told if len(told) <= FACTORS_TOLD else [*told[: FACTORS_TOLD - 1], "…", told[-1]]
            found = f"lamp factors over tilt, {', '.join(told)}, were not applied: they act on a tilted luminaire"
            self.complain("note", "TILT=", found)
        return {"tilt": {"geometry": geometry, "angles": angles.tolist(), "factors": factors.tolist()}}

    # --- numbers -------------------------------------------------------------------------------------------------------

    def intensity(self) -> Intensity:
        facts = self._tilt()
        take, whole = self.words.number, self.words.whole
        lamps, lumens = whole("number of lamps", -1000, 1_000_000), take("lumens per lamp")
        multiplier = take("candela multiplier")
        n_gamma, n_c = whole("number of vertical angles", 2, 100_000), whole("number of horizontal angles", 1, 100_000)
        kind = PHOTOMETRIC_TYPES[whole("photometric type", 1, 3)]
        units = whole("units type", 1, 2)
        width, length, height = (take(name) for name in ("width", "length", "height"))
        ballast, second, watts = take("ballast factor"), take("ballast-lamp factor or future use"), take("input watts")
        factor = self._factor(multiplier, ballast, second)
        gamma = self.words.numbers(n_gamma, "vertical angles")
        c = self.words.numbers(n_c, "horizontal angles")
        for what, angles in (("vertical", gamma), ("horizontal", c)):
            if not (np.diff(angles) > 0.0).all():
                raise FormatError(self.path, f"{what} angles", "they do not rise", DAMAGED)
        if kind == "C":
            self._check_vertical(gamma)
        values = self.words.numbers(n_c * n_gamma, "candela values").reshape(n_c, n_gamma)
        self._check_end()
        unit, per_unit = self._unit()
        values = scaled(self.path, "candela values", values, factor * per_unit)
        if (values < 0.0).any():
            self.complain("warning", "candela values", f"{int((values < 0.0).sum())} are below 0", "LM-63 5.15")
        notes: tuple[str, ...] = (ORIENTATION,)
        if kind == "C":
            c, values = self._whole_circle(c, values)
        else:
            c, gamma, values, notes = self._from_type(kind, c, gamma, values, INTENSITY_UNIT[unit])
        facts |= {new: text for key, text in reversed(self.keywords) if (new := FACT_BY_KEYWORD.get(key)) and text}
        facts |= {"keywords": tuple(self.keywords), "lamps": abs(lamps), "input_power": watts}
        facts |= self._stated_flux(per_unit)
        facts |= self._opening((width, length, height), "feet" if units == 1 else "m")
        if lumens > LARGEST_INTENSITY:
            self.complain("warning", "lumens per lamp", f"found {lumens:g}, which no lamp has; it was not kept")
        elif lumens > 0.0 and unit == "lm":
            facts["lamp_flux"] = abs(lamps) * lumens
        result = Intensity(
            c,
            gamma,
            values,
            flux_unit=unit,
            luminaire=facts,
            provenance=file_provenance(self.path, "lm63"),
            notes=notes,
        )
        self._check_flux(result)
        return result.replace(complaints=tuple(self.complaints))

    def _check_vertical(self, gamma: Array) -> None:
        if gamma[0] < 0.0 or gamma[-1] > 180.0:
            found = f"{gamma[0]:g}° to {gamma[-1]:g}°, beyond 0° to 180°"
            raise FormatError(self.path, "vertical angles", found, DAMAGED)
        if gamma[0] not in (0.0, 90.0) or gamma[-1] not in (90.0, 180.0):
            found = f"they run from {gamma[0]:g}° to {gamma[-1]:g}°; beyond them the intensity is taken as 0"
            self.complain("warning", "vertical angles", found, "LM-63 5.13")

    def _factor(self, multiplier: float, ballast: float, second: float) -> float:
        """From the numbers of the file to candela (or its other unit)."""
        factors = {"candela multiplier": multiplier, "ballast factor": ballast}
        if self.version <= 1991:
            factors["ballast-lamp photometric factor"] = second
        elif self.version <= 2002 and second != 1.0:
            found = f"the field for future use holds {second:g}, not 1; it was not applied"
            self.complain("warning", "second field after the opening", found, f"LM-63-{self.version} 5.11")
        for name, factor in factors.items():
            if not factor > 0.0:
                raise FormatError(
                    self.path, name, f"found {factor:g}", "It multiplies every candela value; mend the file."
                )
        return math.prod(factors.values())

    def _opening(self, lengths: tuple[float, float, float], unit: str) -> dict[str, Any]:
        """Shape and extents of the luminous opening, from width, length and height, unless a slip made them endless."""
        longest = max(map(abs, lengths))
        if longest > LARGEST_LENGTH:
            found = f"one length is {longest:g} {unit}, which no luminaire has; sizes were not kept"
            self.complain("warning", "luminous opening", found)
            return {}
        return opening_facts(*lengths, unit, self.version)

    def _check_end(self) -> None:
        words = self.words
        if words.left:
            line = words.lines[words.taken]
            surplus = f"{words.left:,} words more than the counts announce"
            # Numbers that nothing announced say that a count is wrong, or an earlier number: then every one is doubtful.
            if line == words.lines[words.taken - 1] or any(number(w) is not None for w in words.words[words.taken :]):
                advice = "Which numbers are the table is not certain; mend the counts or ask for the file again."
                raise FormatError(self.path, f"line {line}", f"there are {surplus}", advice)
            self.complain("warning", f"line {line}", f"{surplus}, none of them a number; they were ignored")
        elif self.lines[-1].strip():
            found = "the file ends with a digit and not with a line end; the last number may have been cut short"
            self.complain("warning", f"line {len(self.lines)}", found)

    # --- planes --------------------------------------------------------------------------------------------------------

    def _whole_circle(self, c: Array, values: Array) -> tuple[Array, Array]:
        """All planes, from the sector that the file explores."""
        first, last = float(c[0]), float(c[-1])
        if c.size == 1 and first != 0.0:
            self.complain("note", "horizontal angles", f"the only one is {first:g}°; taken as rotational symmetry")
        known = from_sector(c, values)
        if known is not None:
            difference = float(np.abs(values[0] - values[-1]).max())
            if last == 360.0 and difference > 1e-6 * float(np.abs(values).max()):
                found = f"the planes 0° and 360° are one and differ by up to {difference:.6g}; that of 0° was taken"
                self.complain("warning", "candela values", found, "LM-63 5.14")
            return known[:2]
        if first == 0.0 and 180.0 < last < 360.0:
            if self.version != 1995:
                self.complain("note", "horizontal angles", f"they end at {last:g}°; 360° is 0° again", "LM-63 5.14")
            if 360.0 - last > 1.5 * float(np.diff(c).max()):
                found = f"no plane between {last:g}° and 360°; the gap was bridged linearly"
                self.complain("warning", "horizontal angles", found)
            return c, values
        raise FormatError(
            self.path, "horizontal angles", f"{first:g}° to {last:g}° is no sector that symmetry completes",
            "Known are 0 to 0, 90, 180 or 360, and 90 to 270; ask for a complete file.",
        )  # fmt: skip

    def _from_type(
        self, kind: Kind, horizontal: Array, vertical: Array, values: Array, unit: str
    ) -> tuple[Array, Array, Array, tuple[str, ...]]:
        """C, γ, values and notes, from a table of type A or B."""
        try:
            converted = in_c_gamma(kind, horizontal, vertical, values, unit)
        except ArgumentError as error:
            raise FormatError(self.path, f"angles of type {kind}", str(error), DAMAGED) from None
        for what in converted.assumed:
            self.complain("note", f"angles of type {kind}", what, "LM-63 5.13, 5.14")
        return converted.c, converted.gamma, converted.values, converted.notes

    # --- flux ----------------------------------------------------------------------------------------------------------

    def _stated_flux(self, per_unit: float) -> dict[str, float]:
        for key, text in self.keywords:
            value = number(text.split()[0]) if key.strip("_") == "TOTALLUMINAIRELUMENS" and text else None
            if value is not None:
                return {"stated_flux": value * per_unit}
        return {}

    def _check_flux(self, intensity: Intensity) -> None:
        lamps = intensity.luminaire.get("lamp_flux")
        if lamps is not None and intensity.flux > 1.05 * lamps:
            found = f"the candela values integrate to {intensity.flux:.6g} lm, the lamps are said to have {lamps:.6g}"
            self.complain("warning", "lumens per lamp", f"{found} lm; the candela values were taken")
        stated = intensity.luminaire.get("stated_flux")
        if stated is not None and abs(intensity.flux - stated) > 0.05 * abs(stated):
            found = f"it says {stated:.6g} {intensity.flux_unit}, the table integrates to {intensity.flux:.6g}"
            self.complain("warning", "[_TOTALLUMINAIRELUMENS]", found)


def _is_file(path: Path) -> bool:
    """Whether there is a file; there is none under a name that the system does not know how to have."""
    try:
        return path.is_file()
    except OSError:
        return False


FORMAT = IntensityFormat("lm63", "IES LM-63", ".ies", recognise, read, write)
