"""The text of a TracePro surface property: keys, sections and rows of numbers, each with its line."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.bsdf.tokens import ADVICE, ended_lines
from etendue.formats.rays.text_rows import number
from etendue.quantities.bsdf_directions import NORMAL

Array = npt.NDArray[np.float64]

COLUMNS = ("Temperature", "Wavelength", "IncAngle", "AziAngle", "Abso_S", "Abso_P", "Refl_S", "Refl_P", "Tran_S",
           "Tran_P", "PhaseRefl", "PhaseTran", "BRDF_A", "BRDF_B", "BRDF_By", "BRDF_g", "BRDF_gy", "BTDF_A", "BTDF_B",
           "BTDF_By", "BTDF_g", "BTDF_gy")  # fmt: skip
TABLE_COLUMNS = ("Temperature", "Wavelength", "IncAngle", "AziAngle", "ScatterBeta", "ScatterAzimuth", "BRDF", "BTDF")

SIDES = ("Side1_Data", "Side2_Data")
SECTIONS = (*SIDES, "Table_BSDF_Data", "GratingData", "SAVE-DATA")


def section_of(line: str) -> str:
    """The name of the section that begins in a line, or nothing. Files that TracePro imports have them without brackets too.

    Examples
    --------
    >>> section_of("[Side1_Data]"), section_of("Table_BSDF_Data"), section_of("300 0.55")
    ('Side1_Data', 'Table_BSDF_Data', '')
    """
    if line[:1].isdigit():  # nearly all lines are rows of numbers
        return ""
    word = line.strip().removeprefix("[").removesuffix("]")
    return word if word in SECTIONS or line.startswith("[") else ""


@dataclasses.dataclass(frozen=True, eq=False)
class Rows:
    """Rows of numbers below a line with the names of columns.

    Parameters
    ----------
    line : array of int, shape (n,)
        Where each stands, from 0.
    values : array, shape (n, columns)
        Both tables begin with temperature [K], wavelength [µm], angle and azimuth of incidence [°].
    """

    line: npt.NDArray[np.intp]
    values: Array

    @property
    def left(self) -> Array:
        """What rows of shares leave for scatter: neither absorbed nor mirrored nor straight on, the mean of S and P."""
        return np.asarray(1.0 - self.values[:, 4:10].reshape(-1, 3, 2).mean(axis=2).sum(axis=1))

    def where(self, kept: npt.NDArray[np.bool_ | np.intp]) -> Rows:
        """Some of them: whether each is kept, or the places of those that are."""
        return Rows(self.line[kept], self.values[kept])


class Lines:
    """The lines of a file, split into fields, each with its number.

    Parameters
    ----------
    path : Path
        The file; it is read at once.

    Raises
    ------
    FormatError
        If it is larger than 256 MiB, in no known encoding, or its last line has no end.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lines = ended_lines(path)

    def refuse(self, line: int, found: str, advice: str = ADVICE) -> FormatError:
        """What is wrong in a line, which counts from 0."""
        return FormatError(self.path, f"line {line + 1}", found, advice)

    def find(self, key: str) -> tuple[int, str] | None:
        """What stands behind a key, in front of all sections, and its line; None if it is not there."""
        for at, line in enumerate(self.lines):
            fields = line.split(None, 1)
            if fields and fields[0].casefold() == key.casefold():
                return at, fields[1].strip() if len(fields) > 1 else ""
            if section_of(line) or line.split()[:2] == ["Temperature", "Wavelength"]:
                break
        return None

    def value(self, key: str) -> tuple[int, str]:
        """What stands behind a key that has to be there, and its line."""
        found = self.find(key)
        if found is None:
            raise FormatError(self.path, "first lines", f"there is no {key!r}", ADVICE)
        return found

    def kind(self, key: str, known: tuple[str, ...]) -> tuple[int, int]:
        """The number behind a key, of a list of kinds, and its line."""
        at, text = self.value(key)
        word = text.split()[0] if text else ""
        if not word.isascii() or not word.isdigit() or len(word) > 2 or int(word) >= len(known):
            raise self.refuse(at, f"{key} is {word[:40]!r}, not one of 0 to {len(known) - 1}")
        return at, int(word)

    def switched_on(self, key: str) -> int | None:
        """The line of a key with 1 behind it; None if it is 0 or not there."""
        if self.find(key) is None:
            return None
        at, value = self.kind(key, ("off", "on"))
        return at if value else None

    def sides(self, *, two: bool) -> list[tuple[int, int]]:
        """First and last line (not included) of the data of each side; of one side, all lines.

        Raises
        ------
        FormatError
            If there are not as many sides as the coating has.
        """
        starts = [[at for at, line in enumerate(self.lines) if section_of(line) == name] for name in SIDES]
        if not two:
            for found in starts:
                if found:
                    text = f"{self.lines[found[0]].strip()}, though the coating is not direction-sensitive"
                    raise self.refuse(found[0], text)
            return [(0, len(self.lines))]
        for name, found in zip(SIDES, starts, strict=True):
            if len(found) != 1:
                text = f"{len(found)} sections [{name}]; a direction-sensitive coating has one"
                raise self.refuse(found[1] if found else len(self.lines) - 1, text)
        (first,), (second,) = starts
        if second < first:
            raise self.refuse(second, f"[{SIDES[1]}] stands in front of [{SIDES[0]}]")
        return [(first, second), (second, len(self.lines))]

    def rows(self, columns: tuple[str, ...], begin: int, end: int) -> Rows:
        """The numbers below a line with the names of columns, to the next line that is empty or begins a section.

        Raises
        ------
        FormatError
            If there is no such line between `begin` and `end`, nothing below it, or something that is no finite number.
        """
        for at in range(begin, end):
            if self.lines[at].split()[: len(columns)] == list(columns):
                break
        else:
            missing = f"there is no line with {' '.join(columns[:4])} … {columns[-1]}"
            raise FormatError(self.path, f"line {end}", missing, ADVICE)
        rows = []
        for line in range(at + 1, end):
            fields = self.lines[line].split()
            if not fields or section_of(self.lines[line]):
                break
            if len(fields) != len(columns):
                raise self.refuse(line, f"{len(fields)} fields; the columns are {len(columns)}")
            try:
                values = [number(field) for field in fields]
            except ValueError:
                raise self.refuse(line, "a field that is no number") from None
            if not all(map(math.isfinite, values)):
                raise self.refuse(line, "a field that is not finite")
            rows.append(values)
        if not rows:
            raise self.refuse(at, "no values follow")
        found = Rows(at + 1 + np.arange(len(rows)), np.array(rows))
        for bad, text in (
            (found.values[:, 1] <= 0.0, "a wavelength that is not more than 0"),
            ((found.values[:, 2] < 0.0) | (found.values[:, 2] > 90.0), "an angle of incidence is not from 0 to 90°"),
            (np.abs(found.values[:, 3]) > 360.0, "an azimuth of incidence beyond a turn"),
        ):
            if bad.any():
                raise self.refuse(int(found.line[bad][0]), text)
        return found


def once_at_the_normal(rows: Rows) -> Rows:
    """Without rows of light along the normal from all but the first azimuth: it comes from no azimuth.

    TracePro's editor locks those rows of a property with several azimuths, whatever they hold.
    """
    normal = rows.values[:, 2] < NORMAL
    if not normal.any():
        return rows
    return rows.where(~normal | (rows.values[:, 3] == rows.values[normal, 3].min()))
