"""EULUMDAT (.ldt): the reader. See docs/formats/intensity.md."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from etendue.errors import FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.intensity.eulumdat_writer import write
from etendue.formats.intensity.intensity_format import (
    DAMAGED,
    IntensityFormat,
    either_comma,
    number,
    read_lines,
    scaled,
)
from etendue.formats.intensity.symmetry import Array, unfolded
from etendue.quantities.intensity import UNTURNED, Intensity, Symmetry
from etendue.quantities.report import Complaint, Severity
from etendue.units import LUMENS_PER_KILOLUMEN

ORIENTATION = (
    "C planes are the file's own: in EULUMDAT C0 lies across a linear luminaire, 90° after that of IES files; "
    f"{UNTURNED}"
)

ISYM: dict[int, Symmetry] = {0: "none", 1: "rotational", 2: "C0-C180", 3: "C90-C270", 4: "both"}

LAMP_FIELDS = ("lamps", "type", "flux", "colour", "colour_rendering", "power")
FLUX_TOLERANCE = 0.05
"""Relative disagreement between the integral and the light output ratio that becomes a warning; coarse tables of narrow
beams are off by up to 4.5 %."""

DIGITS = range(10)

_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:\s[0-9]{3})+(?![^\s.,])")
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")


def recognise(head: Head) -> bool:
    """Lines 2 to 7 are a type, a symmetry, and two counts of angles with their steps; line 1 is not that of an IES file.

    Type and symmetry may be any digit: the reader says which it does not know, and where.
    """
    if head.is_zip or (head.lines and head.lines[0].lstrip().upper().startswith("TILT")):
        return False
    words = [_first_word(line) for line in head.lines[1:7]]
    numbers = [value for word in words if (value := number(word.replace(",", "."))) is not None]
    if len(numbers) < 6:
        return False
    kind, symmetry, planes, step, gammas, gamma_step = numbers
    counts = planes >= 1 and planes.is_integer() and gammas >= 2 and gammas.is_integer()
    return kind in DIGITS and symmetry in DIGITS and counts and 0 <= step <= 360 and 0 <= gamma_step <= 180


def read(path: Path) -> Intensity:
    """Read a file of any symmetry, as absolute intensity with the flux of its first lamp set."""
    return _Reader(path).intensity()


def _first_word(line: str) -> str:
    words = line.split()
    return words[0] if words else ""


class _Reader:
    """One file on its way to a distribution; every line holds one value, which its number tells."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lines = read_lines(path)
        self.complaints: list[Complaint] = []
        self.commas = 0

    def complain(self, severity: Severity, place: str, found: str, clause: str = "") -> None:
        self.complaints.append(Complaint(severity, place, found, clause))

    # --- single lines, counted from 1 ----------------------------------------------------------------------------------

    def text(self, line: int, what: str) -> str:
        if line > len(self.lines):
            raise FormatError(self.path, f"line {line}", f"the file ends before the {what}", DAMAGED)
        return self.lines[line - 1].strip()

    def value(self, line: int, what: str) -> float | None:
        """The number that a line begins with; units or remarks may follow. None if the line is empty."""
        text = self.text(line, what)
        word = _first_word(text)
        if not word:
            return None
        if word != text and _THOUSANDS.match(text):
            thousands = f"{text[:40]!r} has blanks between thousands"
            raise FormatError(self.path, f"line {line}, {what}", thousands, "Write the number without them.")
        if "," in word and "." not in word:
            word = word.replace(",", ".")
            self.commas += 1
        found = number(word)
        if found is None:
            raise FormatError(self.path, f"line {line}, {what}", f"{word[:40]!r} is no number", DAMAGED)
        return found

    def needed(self, line: int, what: str) -> float:
        found = self.value(line, what)
        if found is None:
            raise FormatError(self.path, f"line {line}, {what}", "the line is empty", DAMAGED)
        return found

    def aside(self, line: int, what: str) -> float:
        """A number that the table does not rest on: 0 if the line is empty, or says something else."""
        self.text(line, what)
        try:
            return self.value(line, what) or 0.0
        except FormatError as error:
            self.complain("warning", error.place, f"{error.found}; 0 was taken")
            return 0.0

    def whole(self, line: int, what: str, low: int, high: int) -> int:
        found = self.needed(line, what)
        if not (found.is_integer() and low <= found <= high):
            place, demand = f"line {line}, {what}", f"a whole number from {low} to {high}"
            raise FormatError(self.path, place, f"found {found:g}; it must be {demand}", DAMAGED)
        return int(found)

    # --- the file ------------------------------------------------------------------------------------------------------

    def intensity(self) -> Intensity:
        kind, isym = self.whole(2, "type", 0, 3), self.whole(3, "symmetry", 0, 4)
        n_c, n_gamma = self.whole(4, "number of C planes", 1, 100_000), self.whole(6, "number of γ", 2, 100_000)
        steps = self.aside(5, "step of C"), self.aside(7, "step of γ")
        sets = self._lamp_sets(self.whole(26, "number of lamp sets", 1, 20))
        c, gamma, values = self._table(27 + 6 * len(sets) + 10, ISYM[isym], n_c, n_gamma)
        self._check_steps(steps, c, gamma)
        flux = sets[0]["flux"]
        if not flux > 0.0:
            found = f"found {flux:g} lm, but the table is in candela per kilolumen of it"
            raise FormatError(self.path, "line 29, flux of the lamps", found, "State the flux of the lamp set there.")
        c, values = self._whole_circle(c, values, ISYM[isym])
        values = scaled(self.path, "intensities", values, flux / LUMENS_PER_KILOLUMEN)
        result = Intensity(
            c,
            gamma,
            values,
            luminaire=self._facts(kind, sets),
            provenance=file_provenance(self.path, "eulumdat"),
            notes=(ORIENTATION,),
        )
        self._check_meaning(result, flux, len(sets))
        return result.replace(complaints=tuple(self.complaints))

    def _lamp_sets(self, count: int) -> list[dict[str, Any]]:
        sets = []
        for first in range(27, 27 + 6 * count, 6):
            row: dict[str, Any] = {}
            for line, field in enumerate(LAMP_FIELDS, first):
                what = f"{field} of a lamp set"
                if field == "flux":
                    row[field] = self.value(line, what) or 0.0
                    self._check_comma(line, what)
                else:
                    row[field] = self.aside(line, what) if field in {"lamps", "power"} else self.text(line, what)
            sets.append(row)
        return sets

    def _check_comma(self, line: int, what: str) -> None:
        """Refuse a flux of which nobody knows whether its comma stands between thousands or before decimals."""
        word = _first_word(self.text(line, what))
        either = either_comma(word)
        if either is not None and not any(
            _DECIMAL_COMMA.fullmatch(_first_word(other)) for n, other in enumerate(self.lines, 1) if n != line
        ):
            found = f"{either}: no other number has a comma"
            raise FormatError(self.path, f"line {line}, {what}", found, "Write it without the comma, or with a point.")

    def _table(self, first: int, symmetry: Symmetry, n_c: int, n_gamma: int) -> tuple[Array, Array, Array]:
        """Angles and stored intensities [cd/klm]: from line `first` on, one number each, empty lines left out."""
        stored = _stored_planes(symmetry, n_c)
        if stored is None:
            found = f"{n_c} planes, of which symmetry {symmetry} would store no whole number"
            raise FormatError(self.path, "line 4, number of C planes", found, DAMAGED)
        count = n_c + n_gamma + stored * n_gamma
        lines = [line for line in range(first, len(self.lines) + 1) if self.lines[line - 1].strip()]
        if len(lines) < count:
            found = f"{count:,} angles and intensities were announced, {len(lines):,} lines are left"
            raise FormatError(self.path, f"line {len(self.lines)}", found, DAMAGED)
        numbers = np.array([self.needed(line, "angles and intensities") for line in lines[:count]])
        if len(lines) > count:
            found = f"{len(lines) - count:,} lines after the last intensity were ignored"
            self.complain("warning", f"line {lines[count]}", found)
        elif lines[-1] == len(self.lines):
            found = "the file ends with a digit and not with a line end; the last number may have been cut short"
            self.complain("warning", f"line {lines[-1]}", found)
        c, gamma, values = np.split(numbers, [n_c, n_c + n_gamma])
        for what, angles, low, high in (("C", c, 0.0, 360.0), ("γ", gamma, 0.0, 180.0)):
            if not (np.diff(angles) > 0.0).all() or angles[0] < low or angles[-1] > high:
                found = f"they run from {angles[0]:g}° to {angles[-1]:g}° or do not rise"
                raise FormatError(self.path, f"angles {what}", found, DAMAGED)
        if (values < 0.0).any():
            self.complain("warning", "intensities", f"{int((values < 0.0).sum())} are below 0")
        return c, gamma, values.reshape(stored, n_gamma)

    def _whole_circle(self, c: Array, values: Array, symmetry: Symmetry) -> tuple[Array, Array]:
        """All planes, from those that the file stores."""
        n_c = c.size
        if n_c > 1 and c[-1] == 360.0:
            if symmetry != "none":
                raise FormatError(self.path, "angles C", "they end at 360°, which is 0° again", "Remove that plane.")
            self.complain("warning", "angles C", "they end at 360°, which is 0° again; that plane was left out")
            return c[:-1], values[:-1]
        if symmetry in ("none", "rotational"):
            return unfolded(c, values, symmetry)
        start = 0.0 if symmetry != "C90-C270" else 270.0
        found = np.flatnonzero(np.isclose(c, start, rtol=0.0, atol=1e-6))
        sector = np.roll(c, -int(found[0]))[: len(values)] if found.size else np.zeros(0)
        stop = {"both": 90.0, "C0-C180": 180.0, "C90-C270": 90.0}[symmetry]
        if not sector.size or abs(sector[-1] - stop) > 1e-6:
            wanted = f"planes {start:g}° to {stop:g}°, which this symmetry stores, are not where they belong"
            raise FormatError(self.path, "angles C", wanted, DAMAGED)
        whole, all_values = unfolded(sector, values, symmetry)
        if whole.size != n_c or not np.allclose(whole, c, rtol=0.0, atol=1e-3):
            self.complain(
                "warning", "angles C", f"the list contradicts {symmetry} symmetry; its mirror images were taken"
            )
        return whole, all_values

    def _facts(self, kind: int, sets: list[dict[str, Any]]) -> dict[str, Any]:
        texts = {1: "manufacturer", 8: "test_report", 9: "luminaire", 10: "catalogue_number", 12: "issue_date"}
        facts: dict[str, Any] = {fact: self.text(n, fact) for n, fact in texts.items() if self.text(n, fact)}
        lamp = sets[0]
        facts |= {"linear": kind == 2, "lamps": abs(int(lamp["lamps"])), "lamp_sets": tuple(sets)}
        facts |= {"input_power": lamp["power"]} | ({"lamp": lamp["type"]} if lamp["type"] else {})
        if lamp["lamps"] >= 0:
            facts["lamp_flux"] = lamp["flux"]
        else:
            facts["stated_flux"] = lamp["flux"]
        for what, first in (("housing", 13), ("opening", 16)):
            # The length lies along C90-C270; a width of 0 marks a circle.
            length, width = (self.aside(first + n, f"{what} size") for n in range(2))
            heights = [self.aside(n, f"{what} height") for n in (range(18, 22) if what == "opening" else (15,))]
            height = max(heights)
            facts |= {f"{what}_x": width or length, f"{what}_y": length, f"{what}_z": height}
            if what == "housing":
                facts |= {"housing_round": True} if length and not width else {}
            else:
                facts |= {"opening_heights": tuple(heights)} if min(heights) < height else {}
                round_, flat = width == 0.0, height == 0.0
                shapes = {
                    (True, True): "circle",
                    (True, False): "vertical cylinder",
                    (False, True): "rectangle",
                    (False, False): "box",
                }
                facts["opening_shape"] = shapes[round_, flat] if length else "point"
        return facts | self._of_the_measurement(len(sets))

    def _of_the_measurement(self, sets: int) -> dict[str, Any]:
        """Conversion factor, tilt and direct ratios, where they say something."""
        first = 27 + 6 * sets
        ratios = tuple(self.aside(n, "direct ratio") for n in range(first, first + 10))
        conversion, tilt = self.aside(24, "conversion factor"), self.aside(25, "tilt")
        facts: dict[str, Any] = {"direct_ratios": ratios} if any(ratios) else {}
        facts |= {"conversion_factor": conversion} if conversion not in (0.0, 1.0) else {}
        return facts | ({"measurement_tilt": tilt} if tilt else {})

    # --- what is said twice --------------------------------------------------------------------------------------------

    def _check_steps(self, steps: tuple[float, float], c: Array, gamma: Array) -> None:
        for what, step, angles in (("C", steps[0], c), ("γ", steps[1], gamma)):
            if step and not np.allclose(np.diff(angles), step, rtol=0.0, atol=0.01):
                self.complain(
                    "warning", f"step of {what}", f"it is {step:g}°, but the angles differ; the angles were taken"
                )

    def _check_meaning(self, result: Intensity, flux: float, sets: int) -> None:
        if self.commas:
            self.complain("note", "numbers", f"{self.commas} have a decimal comma")
        if sets > 1:
            found = f"{sets} lamp sets; the intensity is that with the first, of {flux:g} lm"
            self.complain("note", "line 26", f"{found}; scale it by the ratio of fluxes for another")
        conversion, tilt = (result.luminaire.get(fact) for fact in ("conversion_factor", "measurement_tilt"))
        if conversion is not None:
            self.complain("warning", "line 24", f"the conversion factor is {conversion:g}; it was not applied")
        if tilt is not None:
            self.complain(
                "note", "line 25", f"the luminaire was measured at a tilt of {tilt:g}°; nothing was turned back"
            )
        ratio = self.aside(23, "light output ratio")
        stated = flux * ratio / 100.0
        if stated > 0.0 and abs(result.flux - stated) > FLUX_TOLERANCE * stated:
            found = f"with a light output ratio of {ratio:g} % the luminaire has {stated:.6g} lm"
            taken = f"the table integrates to {result.flux:.6g} lm; the table was taken"
            self.complain("warning", "line 23", f"{found}, {taken}")


def _stored_planes(symmetry: Symmetry, n_c: int) -> int | None:
    """How many planes a file stores; None if the symmetry does not divide their number."""
    if symmetry in ("none", "rotational"):
        return n_c if symmetry == "none" else 1
    parts = 4 if symmetry == "both" else 2
    return n_c // parts + 1 if n_c % parts == 0 else None


FORMAT = IntensityFormat("eulumdat", "EULUMDAT", ".ldt", recognise, read, write)
