"""IES LM-63-2002: the writer. See docs/formats/intensity.md."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from etendue.formats.intensity.intensity_format import (
    Texts,
    decimal,
    figures,
    general_losses,
    keywords_lost,
    number,
    turned_extents,
)
from etendue.formats.intensity.opening import opening_lengths
from etendue.formats.intensity.symmetry import folded, whole_hemispheres
from etendue.quantities.intensity import UNTURNED, Intensity
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
OPTIONAL = {"LUMCAT": "catalogue_number", "LUMINAIRE": "luminaire", "LAMP": "lamp"}
FACT_BY_KEYWORD = REQUIRED | OPTIONAL

KEPT = {
    "BALLAST", "BALLASTCAT", "COLORCONSTANT", "DISTRIBUTION", "FLASHAREA", "LAMPCAT", "LAMPPOSITION", "MAINTCAT",
    "NEARFIELD", "OTHER", "SEARCH",
}  # fmt: skip
"""Keywords of LM-63-2002 that no fact stands for."""

KEPT_UNTURNED = {"DISTRIBUTION", "LAMPPOSITION"}
"""Those that speak of the planes."""

TOTAL = "_TOTALLUMINAIRELUMENS"
FLUX_TOLERANCE = 0.05
"""Relative disagreement between a stated flux and the integral of the table up to which the reader does not complain."""

LONGEST_KEYWORD = 40


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
    texts = Texts("ascii", "ASCII", 10_000)
    kept, left_out = _kept(intensity)
    (width, length, height), said = opening_lengths(facts)
    lamp_flux, lamps = float(facts.get("lamp_flux", 0.0)), max(1, int(facts.get("lamps", 1)))
    lumens = decimal(lamp_flux / lamps, DIGITS) if lamp_flux > 0.0 else "-1"
    counts = f"{lamps} {lumens} 1 {whole.gamma.size} {c.size} 1 2"
    opening = " ".join(decimal(extent, DIGITS) for extent in (width, length, height))
    lines = ["IESNA:LM-63-2002", *_keywords(texts, intensity, kept), "TILT=NONE", f"{counts} {opening}"]
    lines += [f"1 1 {decimal(float(facts.get('input_power', 0.0)), DIGITS)}"]
    for row in (whole.gamma, c):
        lines += wrapped(decimal(angle, 9) for angle in row)
    for plane in values:
        lines += wrapped(decimal(value, DIGITS) for value in plane)
    path.write_bytes("".join(f"{line}\r\n" for line in lines).encode("ascii"))
    losses = [*notes] if said else [*notes, f"the luminous opening, {facts['opening_shape']!r}, is none that IES knows"]
    lost = keywords_lost(left_out, "that do not hold for this table, or that LM-63-2002 does not know,")
    turned = turned_extents(facts, housing=False)
    return (*losses, *general_losses(intensity), *turned, *_of_eulumdat(facts), *lost, *texts.losses())


def further_keywords(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Keyword lines of an IES file that no other fact of the luminaire holds, as pairs, in their order."""
    further, held = [], set()
    for keyword, text in facts.get("keywords", ()):
        if keyword in FACT_BY_KEYWORD and (not text or keyword not in held):
            # The first that says something became the fact.
            held |= {keyword} if text else set()
        elif not text.endswith(UNTURNED):
            # What étendue wrote about the planes of another table would be untrue of one that was turned.
            further.append((keyword, text))
    return further


def _kept(intensity: Intensity) -> tuple[list[tuple[str, str]], list[str]]:
    """Keyword lines of the file that the distribution came from: those that stay true, and names of the others."""
    kept, left_out = [], []
    for keyword, text in further_keywords(intensity.luminaire):
        mine = (
            keyword.startswith("_") and len(keyword) <= LONGEST_KEYWORD and keyword.isascii() and keyword.isprintable()
        )
        if keyword == "_INTENSITYUNITS":
            continue
        if keyword == TOTAL:
            stated = _total(intensity, text)
            kept += [(keyword, stated)] if stated else []
            left_out += [] if stated else [keyword]
        elif keyword in KEPT_UNTURNED and intensity.planes_moved:
            left_out.append(keyword)
        elif not keyword:
            kept.append(("OTHER", text))
        elif keyword in KEPT or keyword in FACT_BY_KEYWORD or (mine and not set(keyword) & set("[]")):
            kept.append((keyword, text))
        else:
            left_out.append(keyword)
    return kept, left_out


def _total(intensity: Intensity, text: str) -> str:
    """The stated flux in the unit that is written; empty if there is none, or the table integrates to another."""
    stated = intensity.luminaire.get("stated_flux")
    if stated is None or abs(intensity.flux - stated) > FLUX_TOLERANCE * abs(stated):
        return ""
    stated /= WATTS_PER_FILE_UNIT[RADIOMETRIC_UNIT.lower()] if intensity.flux_unit == "W" else 1.0
    value = number((text.split() or [""])[0])
    same = value is not None and math.isclose(value, stated, rel_tol=1e-9)
    return text if same else decimal(stated, DIGITS)


def _of_eulumdat(facts: Mapping[str, Any]) -> Iterator[str]:
    """What a file of EULUMDAT or TM-33 may say that has no place in one of IES, in a sentence."""
    first = (*facts.get("lamp_sets", ()), {})[0]
    known = {
        "that the luminaire is a linear one": facts.get("linear"),
        "size of the luminaire": any(facts.get(f"housing_{axis}") for axis in "xyz"),
        "heights of the luminous opening but the largest": "opening_heights" in facts,
        "colour and colour rendering of the lamps": first.get("colour") or first.get("colour_rendering"),
        "lamp sets but the first": len(facts.get("lamp_sets", ())) > 1,
        "tilt of the measurement": "measurement_tilt" in facts,
        "conversion factor, which was not applied": "conversion_factor" in facts,
        "direct ratios": "direct_ratios" in facts,
    }
    lost = [what for what, there in known.items() if there]
    if lost:
        yield f"IES files have no place for what follows, which is not kept: {'; '.join(lost)}"


def _keywords(texts: Texts, intensity: Intensity, kept: Iterable[tuple[str, str]]) -> Iterator[str]:
    """The required keywords, those that are known, those of the file before, and where the numbers come from."""
    facts, provenance = intensity.luminaire, intensity.provenance
    fallback = {"TEST": "none", "TESTLAB": texts.own(provenance.software), "ISSUEDATE": "unknown", "MANUFAC": "unknown"}
    for keyword, fact in FACT_BY_KEYWORD.items():
        text = texts.of(fact.replace("_", " "), facts.get(fact, "")) or fallback.get(keyword, "")
        if text:
            yield from _entry(keyword, text)
    if intensity.flux_unit == "W":
        yield f"[_INTENSITYUNITS] {RADIOMETRIC_UNIT}"
    for keyword, text in kept:
        yield from _entry(keyword, texts.of(f"[{keyword}]", text))
    source = texts.of("file name", provenance.source)
    yield from _entry("OTHER", texts.own(f"from {source} ({provenance.format}) by {provenance.software}"))
    for step in (*provenance.steps, *turned_extents(facts, housing=False), *figures(intensity), *intensity.notes):
        yield from _entry("OTHER", texts.own(step))


def _entry(keyword: str, text: str) -> Iterator[str]:
    """One keyword; what has no room in its line continues under [MORE]."""
    for part in textwrap.wrap(text, LINE - len(keyword) - 8) or [""]:
        yield f"[{keyword}] {part}".rstrip()
        keyword = "MORE"


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
