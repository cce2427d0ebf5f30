"""EULUMDAT (.ldt): the writer. See docs/formats/intensity.md."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from etendue.errors import ArgumentError
from etendue.formats.intensity.intensity_format import (
    Texts,
    decimal,
    figures,
    general_losses,
    keywords_lost,
    turned_extents,
)
from etendue.formats.intensity.lm63_writer import further_keywords
from etendue.formats.intensity.symmetry import Array, folded, unfolded, whole_hemispheres
from etendue.quantities.intensity import Intensity, Symmetry
from etendue.units import INTENSITY_NAME, INTENSITY_UNIT, LUMENS_PER_KILOLUMEN, FluxUnit

MOST_PLANES, MOST_GAMMAS = 721, 361
TEXT = 78
DIGITS = 6

NUMBER_OF_SYMMETRY: dict[Symmetry, int] = {"none": 0, "rotational": 1, "C0-C180": 2, "C90-C270": 3, "both": 4}
SHAPES = {"point", "circle", "rectangle", "box", "vertical cylinder"}


def require_luminous(flux_unit: FluxUnit) -> None:
    """Refuse radiant intensity, which the format has no room for.

    Raises
    ------
    ArgumentError
        If the unit of the flux is not the lumen.
    """
    if flux_unit != "lm":
        found = f"{INTENSITY_NAME[flux_unit]} [{INTENSITY_UNIT[flux_unit]}]"
        raise ArgumentError(
            f"EULUMDAT knows luminous intensity only, and this is {found}. "
            "Write an .ies file, or convert the rays to lumens first: --unit lm, or RaySet.in_unit('lm') in Python."
        )


def write(intensity: Intensity, path: Path) -> tuple[str, ...]:
    """Write the planes that symmetry leaves, in candela per kilolumen of the lamps, or of the luminaire if absolute."""
    require_luminous(intensity.flux_unit)
    whole, notes = whole_hemispheres(intensity)
    flux = whole.flux
    if not flux > 0.0:
        raise ArgumentError(f"EULUMDAT states intensity per lumen, and this source has a flux of {flux:g} lm.")
    symmetry = whole.symmetry()
    planes = _planes(whole, symmetry)
    # Readers begin with plane 3/4 Mc + 1, and that must be 270°: there are tables in which it is another.
    if symmetry == "C90-C270" and (planes.size % 4 or planes[3 * planes.size // 4] != 270.0):
        symmetry = "none"
        planes = _planes(whole, symmetry)
    values = _stored(whole, symmetry)
    if planes.size > MOST_PLANES or whole.gamma.size > MOST_GAMMAS:
        raise ArgumentError(
            f"EULUMDAT holds at most {MOST_PLANES} planes of {MOST_GAMMAS} angles, not {planes.size} of "
            f"{whole.gamma.size}. Use fewer, or write an .ies file."
        )
    facts = whole.luminaire
    texts = Texts("latin-1", "Latin-1", TEXT)
    lamp_flux = float(facts.get("lamp_flux", 0.0))
    absolute = not lamp_flux > 0.0
    lamp_flux = flux if absolute else lamp_flux
    table = values * (LUMENS_PER_KILOLUMEN / lamp_flux)
    lines = [
        *_identity(texts, intensity, whole.gamma, symmetry, planes),
        *_sizes(facts),
        *(decimal(n, DIGITS) for n in (100.0 * _downward(whole) / flux, 100.0 * flux / lamp_flux)),
        *("1", decimal(float(facts.get("measurement_tilt", 0.0)), DIGITS), "1"),
        str(-1 if absolute else max(1, int(facts.get("lamps", 1)))),
        texts.of("lamp", facts.get("lamp", "")),
        decimal(lamp_flux, 9),
        *_colour(texts, facts),
        decimal(float(facts.get("input_power", 0.0)), DIGITS),
        *["0"] * 10,
        *(decimal(angle, 9) for angle in (*planes, *whole.gamma)),
        *(decimal(value, DIGITS) for value in table.ravel()),
    ]
    path.write_bytes("".join(f"{line}\r\n" for line in lines).encode("latin-1"))
    return (*notes, *general_losses(intensity), *_losses(facts), *texts.losses())


def _planes(whole: Intensity, symmetry: Symmetry) -> Array:
    """C of all planes that the file lists [°]."""
    return unfolded(*folded(whole, symmetry), symmetry)[0]


def _stored(whole: Intensity, symmetry: Symmetry) -> Array:
    """Values in the order of the file: C90-C270 symmetry goes from 270° over 0° to 90°, all others rise from 0°."""
    values = folded(whole, symmetry)[1]
    # Plane C is the mirror image of 180° - C, so that 90° up to 270° reads backwards as 270°, 280°, … 360°, … 90°.
    return values[::-1] if symmetry == "C90-C270" else values


def _identity(texts: Texts, intensity: Intensity, gamma: Array, symmetry: Symmetry, planes: Array) -> Iterator[str]:
    """Lines 1 to 12."""
    facts, provenance = intensity.luminaire, intensity.provenance
    kind = 2 if facts.get("linear") else 1 if symmetry == "rotational" else 3

    def text(fact: str, otherwise: str) -> str:
        return texts.of(fact.replace("_", " "), facts[fact]) if facts.get(fact) else texts.own(otherwise)

    yield text("manufacturer", provenance.software)
    yield str(kind)
    yield str(NUMBER_OF_SYMMETRY[symmetry])
    for angles, whole_turn in ((planes, True), (gamma, False)):
        yield str(angles.size)
        yield decimal(_step(angles, whole_turn), 9)
    # What is to be said about a table with errors stands where the report on its measurement is named.
    peak = [*figures(intensity)][:1]
    yield text("test_report", "; ".join(peak + [*intensity.notes][: len(peak)]))
    yield text("luminaire", provenance.source)
    yield text("catalogue_number", "")
    yield texts.of("file name", provenance.source)
    yield text("issue_date", "")


def _colour(texts: Texts, facts: Mapping[str, Any]) -> Iterator[str]:
    """Colour and colour rendering of the lamp set that the intensity is stated with, as its file spells them."""
    first = (*facts.get("lamp_sets", ()), {})[0]
    for field in ("colour", "colour_rendering"):
        yield texts.of(f"{field.replace('_', ' ')} of the lamps", first.get(field, ""))


def _step(angles: Array, whole_turn: bool) -> float:
    """The step of equidistant angles, 0 for others."""
    steps = np.diff(np.append(angles, angles[0] + 360.0)) if whole_turn else np.diff(angles)
    return float(steps.mean()) if angles.size > 1 and np.allclose(steps, steps.mean(), rtol=0.0, atol=1e-6) else 0.0


def _sizes(facts: Mapping[str, Any]) -> Iterator[str]:
    """Lines 13 to 21 [mm]: length along C90-C270, width along C0-C180, 0 for what is round."""
    known = facts.get("opening_shape") in SHAPES
    opening = {axis: float(facts.get(f"opening_{axis}", 0.0)) if known else 0.0 for axis in "xyz"}
    housing = {axis: float(facts.get(f"housing_{axis}", opening[axis])) for axis in "xyz"}
    round_ = facts.get("opening_shape") in {"circle", "vertical cylinder"}
    # What is not known of the housing is taken from the opening, its shape too.
    housing_round = facts.get("housing_round", round_ and not {"housing_x", "housing_y"} & set(facts))
    for extents, is_round in ((housing, housing_round), (opening, round_)):
        yield decimal(extents["y"], DIGITS)
        yield decimal(0.0 if is_round and extents["x"] == extents["y"] else extents["x"], DIGITS)
        if extents is housing:
            yield decimal(extents["z"], DIGITS)
    for height in _heights(facts, opening["z"]):
        yield decimal(height, DIGITS)


def _heights(facts: Mapping[str, Any], highest: float) -> Sequence[float]:
    """Of the luminous opening at C0, C90, C180 and C270 [mm]; the same ones unless a file told them apart."""
    heights: Sequence[float] = facts.get("opening_heights", ())
    return heights if len(heights) == 4 and max(heights) == highest else [highest] * 4


def _losses(facts: Mapping[str, Any]) -> Iterator[str]:
    shape = facts.get("opening_shape", "point")
    if shape not in SHAPES:
        yield f"the luminous opening, {shape!r}, is none that EULUMDAT knows"
    yield from turned_extents(facts, housing=True)
    if len(facts.get("lamp_sets", ())) > 1:
        yield "of several lamp sets only the one that the intensity is stated with was written"
    if "conversion_factor" in facts:
        found = f"the conversion factor of {facts['conversion_factor']:g} was not applied"
        yield f"{found} and is not kept: 1 was written, since the intensities hold as they are"
    if "direct_ratios" in facts:
        yield "the direct ratios are not kept: 0 was written, since étendue does not compute them"
    lost = [keyword for keyword, _ in further_keywords(facts) if keyword != "_INTENSITYUNITS"]
    laboratory = ["TESTLAB"] if facts.get("laboratory") and "keywords" in facts else []
    yield from keywords_lost([*laboratory, *lost], "without a line of their own")


def _downward(intensity: Intensity) -> float:
    """Flux at γ below 90°, exact: the table is cut there with a node that it has, or gets by interpolation."""
    gamma = intensity.gamma
    if gamma[0] >= 90.0:
        return 0.0
    below = gamma[gamma < 90.0]
    edge = intensity.at(intensity.c, 90.0)[:, None]
    values = np.concatenate([intensity.values[:, : below.size], edge], axis=1)
    return Intensity(intensity.c, np.append(below, 90.0), values).flux
