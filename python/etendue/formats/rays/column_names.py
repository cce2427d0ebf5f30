"""Names of columns in ray tables, as programs and people write them."""

from __future__ import annotations

import dataclasses
import re

from etendue.units import FLUX_UNITS, MM_PER_LENGTH_UNIT

AXES = "xyz"

POSITION_SPELLINGS = ("{}", "{}0", "pos{}", "{}pos", "position{}", "{}position", "start{}", "{}start")
DIRECTION_SPELLINGS = (
    "k{}",
    "c{}",
    "d{}",
    "v{}",
    "dir{}",
    "{}dir",
    "direction{}",
    "{}direction",
    "vec{}",
    "{}vec",
    "cos{}",
)
DIRECTION_LETTERS = ("lmn", "abc", "uvw")
SCALARS = {
    "flux": ("flux", "power", "intensity", "energy", "incflux", "rayflux", "raypower", "weight"),
    "wavelength": ("wavelength", "lambda", "λ", "wl"),
}
TELLING_NAMES = {"luminousflux": "lm", "radiantflux": "W", "radiantpower": "W"}
"""Names of the flux that state its unit."""

UNITS = {
    **{unit.lower(): unit for unit in (*MM_PER_LENGTH_UNIT, *FLUX_UNITS)},
    "µm": "um",  # micro sign
    "μm": "um",  # Greek letter
    "in": "inch",
    "ft": "feet",
    "lumen": "lm",
    "lumens": "lm",
    "watt": "W",
    "watts": "W",
}
"""Units by their spellings in lower case."""


@dataclasses.dataclass(frozen=True)
class ColumnName:
    """What a column's name says.

    Parameters
    ----------
    field : str
        Of the records: ``position``, ``direction``, ``flux`` or ``wavelength``.
    component : int
        0, 1, 2 of vectors; 0 of numbers.
    unit : str
        As in `etendue.units`, or as the name has it if unknown; empty if it states none.
    """

    field: str
    component: int
    unit: str


def _meanings() -> dict[str, tuple[str, int]]:
    known = {name: (field, 0) for field, names in SCALARS.items() for name in names}
    known |= dict.fromkeys(TELLING_NAMES, ("flux", 0))
    for component, axis in enumerate(AXES):
        known |= {spelling.format(axis): ("position", component) for spelling in POSITION_SPELLINGS}
        known |= {spelling.format(axis): ("direction", component) for spelling in DIRECTION_SPELLINGS}
    known |= {letter: ("direction", i) for letters in DIRECTION_LETTERS for i, letter in enumerate(letters)}
    return known


MEANINGS = _meanings()


def column_name(text: str) -> ColumnName | None:
    """What a column's name says, or None if it is not known.

    The unit stands in brackets, or behind an underscore or blank.

    Examples
    --------
    >>> column_name("X_mm")
    ColumnName(field='position', component=0, unit='mm')
    >>> column_name("Power [W]").unit, column_name("ray number")
    ('W', None)
    """
    text = text.strip().strip('"').strip()
    bracketed = re.fullmatch(r"(.*?)\s*[\[(](.*)[\])]", text)
    suffixed = re.fullmatch(r"(.+)[_ ]([^_ ]+)", text)
    if bracketed:
        return _named(bracketed[1], bracketed[2].strip())
    if suffixed and suffixed[2].lower() in UNITS and (named := _named(suffixed[1], suffixed[2])):
        return named
    return _named(text, "")


def _named(name: str, unit: str) -> ColumnName | None:
    plain = re.sub(r"[\s_.\-]", "", name).lower()
    if plain not in MEANINGS:
        return None
    field, component = MEANINGS[plain]
    return ColumnName(field, component, UNITS.get(unit.lower(), unit) or TELLING_NAMES.get(plain, ""))
