"""What the verbs share about light fields: how one is named, read and described."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, Literal

import typer

from etendue.cli.convert import in_unit, with_flux
from etendue.cli.terminal import say
from etendue.errors import ArgumentError
from etendue.formats.rays import read_rays
from etendue.lightfield.carrier import SURFACES, Surface, parse_surface
from etendue.lightfield.light_field import LightField
from etendue.lightfield.storage import is_field_file
from etendue.quantities.arguments import require_known
from etendue.quantities.powers_of_ten import counted
from etendue.quantities.ray_set import RaySet
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum

FIELD_EXTENSIONS = (".h5", ".hdf5")
"""Of the files that hold a light field."""


def surface_option(text: str) -> Surface | Literal["auto"]:
    """The carrier surface that an option names.

    Raises
    ------
    UnknownNameError
        If there is no such surface or dimension.
    ArgumentError
        If a dimension is no number, or is stated of the surface that is chosen.
    """
    name, colon, _ = (piece.strip() for piece in text.partition(":"))
    require_known(name, ("auto", *SURFACES), "surface")
    if name != "auto":
        return parse_surface(text)
    if colon:
        raise ArgumentError(f"surface {text!r}: auto chooses the dimensions; give auto alone, or state which surface.")
    return "auto"


def read_source(path: Path, flux: str | None, unit: str | None) -> RaySet | LightField:
    """The light field, or the rays with flux and unit as the options state; which of them, the file's content tells.

    Raises
    ------
    typer.BadParameter
        If the file is a light field, and a flux was given.
    UnitError
        If the unit is another one and the spectrum is not known.
    """
    if not is_field_file(path):
        return in_unit(with_flux(read_rays(path), flux), unit)
    if flux is not None:
        raise typer.BadParameter(f"--flux: for ray files; {path} is a light field")
    return in_unit(LightField.load(path), unit)


def spectrum_text(spectrum: Spectrum | SpectralLines | None) -> str:
    """The range of a spectrum and its luminous efficacy of radiation, for people."""
    if spectrum is None:
        return "unknown"
    low, high = spectrum.wavelength[0], spectrum.wavelength[-1]
    kind = f"{spectrum.wavelength.size:,} lines, " if isinstance(spectrum, SpectralLines) else ""
    span = f"{low:.4g} nm" if low == high else f"{kind}{low:.4g} to {high:.4g} nm"
    return f"{span}, {spectrum.luminous_efficacy:.4g} lm/W"


def complaints_of(source: RaySet | LightField) -> list[str]:
    """What is wrong with a ray file, one line each; a field tells it in its notes."""
    return [str(c) for c in source.complaints] if isinstance(source, RaySet) else []


def describe_field(field: LightField) -> dict[str, Any]:
    """A field in figures, as plain data [mm², flux unit, nat]."""
    report = field.report
    return {
        "surface": field.surface.spec,
        "parts": [
            {"name": chart.name, "area": chart.area, "flux": flux, "cells": list(part.ratio.shape)}
            for chart, flux, part in zip(field.surface.parts(), field.part_flux, field.parts, strict=True)
        ],
        "flux_unit": field.flux_unit,
        "total_flux": field.total_flux,
        "spectrum": spectrum_text(field.spectrum),
        "luminous_efficacy": None if field.spectrum is None else field.spectrum.luminous_efficacy,
        **dataclasses.asdict(report),
        "lead_over_histogram": report.score - report.histogram_score,
        "resolution": dataclasses.asdict(field.resolution()),
        "source": field.provenance.source,
        "notes": list(field.notes),
    }


def print_field(field: LightField) -> None:
    """A field in figures, for people."""
    report = field.report
    unmet = ""
    if report.unmet_rays:
        share = report.unmet_flux / (report.unmet_flux + field.total_flux)
        unmet = f"; {report.unmet_rays:,} more ({share:.3%} of the flux) do not meet the surface"
    ahead = report.score - report.histogram_score
    rows = [
        ("surface", field.surface.spec),
        ("flux", counted(field.total_flux, field.flux_unit)),
        ("spectrum", spectrum_text(field.spectrum)),
        *([] if report.symmetry == "none" else [("symmetry", report.symmetry)]),
        ("rays", f"{report.rays - report.unmet_rays:,}{unmet}"),
        *(("grid" if number == 0 else "", text) for number, text in enumerate(_grids(field))),
        ("evidence", f"{report.log_evidence:,.1f} nat against the base measure"),
        ("degrees of freedom", f"{report.effective_cells:,.0f}, effective"),
        ("held-out score", report.score_text),
        ("", f"{ahead:+.4f} against the equal-étendue histogram"),
        ("resolves", field.resolution().summary()),
    ]
    for label, value in rows:
        say(f"  {label:<22} {value}")
    for note in field.notes:
        say(f"  {note}")


RECIPES_TOLD = {
    "uniform": "tree alone",
    "scaled": "tree scaled to the images of place and direction",
    "product": "tree on the product of the images of place and direction",
}
"""What the names of recipes mean."""


def _grids(field: LightField) -> list[str]:
    """Cells, recipe and concentration of each part, and how fine its images are."""
    charts, report = field.surface.parts(), field.report
    lines = []
    for chart, part, base, concentration in zip(charts, field.parts, report.bases, report.concentrations, strict=True):
        name = f"{chart.name}: " if len(charts) > 1 else ""
        cells = " × ".join(str(n) for n in part.ratio.shape)
        lines.append(f"{name}{cells} cells, {RECIPES_TOLD[base]}, concentration {concentration:g}")
    return lines
