"""Intensity distributions, as the verbs tell them."""

from __future__ import annotations

import re
from typing import Any

from etendue.cli.terminal import say
from etendue.quantities.data_sheet import data_sheet
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminaire_facts import LUMINAIRE_FACTS
from etendue.quantities.measured import measured, peak_line
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum


def describe_intensity(distribution: Intensity) -> dict[str, Any]:
    """A distribution in figures, as plain data [its unit, °]."""
    c, gamma = distribution.peak
    return {
        "quantity": distribution.quantity,
        "unit": distribution.unit,
        "format": distribution.provenance.format,
        "flux": distribution.flux,
        "flux_error": distribution.flux_error,
        "flux_unit": distribution.flux_unit,
        "maximum": distribution.maximum,
        "maximum_error": distribution.maximum_error,
        "peak_intensity": distribution.peak_intensity,
        "peak_error": distribution.peak_error,
        "maximum_at": {"c": c, "gamma": gamma},
        "symmetry": distribution.symmetry(),
        "planes": distribution.c.size,
        "gammas": distribution.gamma.size,
        "gamma_range": [float(distribution.gamma[0]), float(distribution.gamma[-1])],
        "data_sheet": data_sheet(distribution).to_dict(),
        "luminaire": {name: _plain(name, fact) for name, fact in distribution.luminaire.items()},
        "notes": list(distribution.notes),
    }


UNSTATED_AS_0 = frozenset({"input_power"})
"""Facts for which files have a place that has to be filled, with 0 where nothing is stated: no lamp takes 0 W."""


def _stated(name: str, fact: Any) -> bool:
    return not (name in UNSTATED_AS_0 and fact == 0)


def _plain(name: str, fact: Any) -> Any:
    if isinstance(fact, Spectrum | SpectralLines):
        return {"wavelength": fact.wavelength.tolist(), "weight": fact.weight.tolist()}
    return fact if _stated(name, fact) else None


def _told(value: Any) -> str:
    """A fact as people read it.

    >>> _told(True), _told(0.1), _told("T5")
    ('yes', '0.1', 'T5')
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def print_intensity(distribution: Intensity) -> None:
    """A distribution in figures, for people."""
    facts = describe_intensity(distribution)
    low, high = facts["gamma_range"]
    planes = "one plane" if facts["planes"] == 1 else f"{facts['planes']} planes"
    say(f"{facts['quantity']}, {planes}, {facts['gammas']} angles γ from {low:g}° to {high:g}°")
    flux = measured(distribution.flux, distribution.flux_error, distribution.flux_unit)
    say(f"  flux {flux}, symmetry {facts['symmetry']}")
    say(f"  {peak_line(distribution)}")
    for line in data_sheet(distribution).lines():
        say(f"  {line}")
    for name, value in distribution.luminaire.items():
        if isinstance(value, Spectrum | SpectralLines):
            what = "lines" if isinstance(value, SpectralLines) else "wavelengths"
            say(f"  spectrum: {value.wavelength[0]:g} to {value.wavelength[-1]:g} nm, {value.wavelength.size} {what}")
        elif name not in {"keywords", "lamp_sets", "tilt"}:
            text = _told(value)
            unit = re.search(r"\[(\w+)\]", LUMINAIRE_FACTS[name].replace("[flux unit]", f"[{distribution.flux_unit}]"))
            told = f"{text[:100]}{f' {unit[1]}' if unit else ''}" if _stated(name, value) else "not stated"
            say(f"  {name.replace('_', ' ')}: {told}")
    for note in distribution.notes:
        say(f"  {note}")
