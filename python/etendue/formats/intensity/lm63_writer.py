"""IES LM-63-2002: the writer. See docs/formats/intensity.md."""

from __future__ import annotations

import textwrap
import unicodedata
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from etendue.formats.intensity.intensity_format import decimal, figures, fitted, general_losses
from etendue.formats.intensity.opening import opening_lengths
from etendue.formats.intensity.symmetry import folded, whole_hemispheres
from etendue.quantities.intensity import Intensity
from etendue.units import WATTS_PER_FILE_UNIT

LINE = 132
"""Characters in a line; the standard allows 256, some readers no more than this."""

DIGITS = 6
RADIOMETRIC_UNIT = "mW/sr"
"""What radiometric IES files in the wild use."""

REQUIRED = {
    "TEST": "test_report",
    "TESTLAB": "laboratory",
    "ISSUEDATE": "issue_date",
    "MANUFAC": "manufacturer",
}
SPELT_OUT = {"γ": "gamma", "°": " deg", "±": "+/-", "−": "-", "–": "-", "√": "sqrt", "Σ": "sum"}
OPTIONAL = {"LUMCAT": "catalogue_number", "LUMINAIRE": "luminaire", "LAMP": "lamp"}


def write(intensity: Intensity, path: Path) -> tuple[str, ...]:
    """Write type C with TILT=NONE: absolute candela, C over the least sector that symmetry allows."""
    whole, notes = whole_hemispheres(intensity)
    symmetry = whole.symmetry()
    # 90° to 270° belongs to the edition of 1995 only.
    symmetry = "none" if symmetry == "C90-C270" else symmetry
    c, values = folded(whole, symmetry)
    if symmetry == "none":
        c, values = np.append(c, 360.0), np.concatenate([values, values[:1]])
    values = values / (WATTS_PER_FILE_UNIT[RADIOMETRIC_UNIT.lower()] if whole.flux_unit == "W" else 1.0)
    facts = whole.luminaire
    (width, length, height), said = opening_lengths(facts)
    lamp_flux, lamps = float(facts.get("lamp_flux", 0.0)), max(1, int(facts.get("lamps", 1)))
    lumens = decimal(lamp_flux / lamps, DIGITS) if lamp_flux > 0.0 else "-1"
    counts = f"{lamps} {lumens} 1 {whole.gamma.size} {c.size} 1 2"
    opening = " ".join(decimal(extent, DIGITS) for extent in (width, length, height))
    lines = ["IESNA:LM-63-2002", *_keywords(intensity), "TILT=NONE", f"{counts} {opening}"]
    lines += [f"1 1 {decimal(float(facts.get('input_power', 0.0)), DIGITS)}"]
    for row in (whole.gamma, c):
        lines += wrapped(decimal(angle, 9) for angle in row)
    for plane in values:
        lines += wrapped(decimal(value, DIGITS) for value in plane)
    path.write_bytes("".join(f"{line}\r\n" for line in lines).encode("ascii"))
    losses = [*notes] if said else [*notes, f"the luminous opening, {facts['opening_shape']!r}, is none that IES knows"]
    return (*losses, *general_losses(intensity))


def _keywords(intensity: Intensity) -> Iterator[str]:
    """The required keywords, those that are known, and where the numbers come from."""
    facts, provenance = intensity.luminaire, intensity.provenance
    fallback = {"TEST": "none", "TESTLAB": provenance.software, "ISSUEDATE": "unknown", "MANUFAC": "unknown"}
    for keyword, fact in (REQUIRED | OPTIONAL).items():
        text = str(facts.get(fact, "")) or fallback.get(keyword, "")
        if text:
            yield from _entry(keyword, text)
    if intensity.flux_unit == "W":
        yield f"[_INTENSITYUNITS] {RADIOMETRIC_UNIT}"
    yield from _entry("OTHER", f"from {provenance.source} ({provenance.format}) by {provenance.software}")
    for step in (*provenance.steps, *figures(intensity), *intensity.notes):
        yield from _entry("OTHER", step)


def _entry(keyword: str, text: str) -> Iterator[str]:
    """One keyword; what has no room in its line continues under [MORE]."""
    for part in textwrap.wrap(fitted(_spelt_out(text), "ascii", 10_000), LINE - len(keyword) - 8) or [""]:
        yield f"[{keyword}] {part}".rstrip()
        keyword = "MORE"


def _spelt_out(text: str) -> str:
    """Letters that ASCII does not have, by those that it has."""
    for letter, words in SPELT_OUT.items():
        text = text.replace(letter, words)
    return "".join(letter for letter in unicodedata.normalize("NFKD", text) if not unicodedata.combining(letter))


def wrapped(words: Iterable[str]) -> Iterator[str]:
    """Lines of words, none longer than `LINE`."""
    held: list[str] = []
    length = 0
    for word in words:
        if held and length + 1 + len(word) > LINE:
            yield " ".join(held)
            held, length = [], 0
        length += len(word) + bool(held)
        held.append(word)
    yield " ".join(held)
