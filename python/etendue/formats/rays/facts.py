"""What a ray file says of itself, and what its rays do: as plain data, and as rows for people."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from etendue.formats.rays import RAY_FORMATS
from etendue.quantities.distinct_rays import DistinctRays
from etendue.quantities.powers_of_ten import counted
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress
from etendue.quantities.repeated_rays import TAKEN
from etendue.quantities.report import Complaint

NO_RAY = "no ray can be used"
"""Why nothing is known of where rays are."""


def ray_facts(rays: RaySet, path: str | Path, progress: Progress | None = None) -> dict[str, Any]:
    """The facts of a file of rays: lengths in mm, wavelengths in nm, flux in the unit that stands beside.

    Parameters
    ----------
    rays : RaySet
        As read from the file.
    path : path
        The file, as it is called.
    progress : callable, optional
        Told how many rays have been looked at.

    Examples
    --------
    >>> import etendue as et
    >>> facts = ray_facts(et.RingSource(rays=1000).ray_set(), "rings")
    >>> facts["rays"], facts["flux_unit"], fact_rows(facts)[0]
    (1000, 'lm', ('format', 'synthetic'))
    """
    moments = rays.moments(progress)
    focus = rays.virtual_focus
    low, high = moments.flux_range
    known = rays.tally.usable > 0
    distinct, complaints = DistinctRays.of(rays, join=False), rays.complaints
    # A set that tells of copies itself tells enough.
    if distinct.told is not None and rays.meaning.copies <= 1.0:
        complaints = (*complaints, Complaint("warning", "rays", f"{distinct.told}: {TAKEN}"))
    return {
        "file": str(path),
        "format": rays.provenance.format,
        "title": next((one.title for one in RAY_FORMATS if one.name == rays.provenance.format), rays.provenance.format),
        "rays": len(rays),
        "usable_rays": rays.tally.usable,
        "flux_unit": rays.flux_unit,
        "total_flux": rays.total_flux,
        "header_flux": rays.header.get("total_flux"),
        "sum_flux": rays.tally.flux * rays.meaning.stored_flux_scale,
        "effective_rays": rays.tally.effective_rays / distinct.excess,
        "flux_per_ray": [low * rays.flux_scale, high * rays.flux_scale] if known else None,
        "bounding_box": moments.bounds.tolist() if known and rays.has_position else None,
        "virtual_focus": list(focus.point) if focus.determined else None,
        "mean_direction": _mean_direction(moments.weighted_direction),
        "spectrum": _spectrum(rays),
        "luminous_efficacy": _efficacy(rays),
        "columns": list(rays.columns),
        "header": dict(rays.header),
        "complaints": [complaint.to_dict() for complaint in complaints],
        "complaint_lines": [str(complaint) for complaint in complaints],
    }


def fact_rows(facts: dict[str, Any]) -> list[tuple[str, str]]:
    """Label and text of each fact of `ray_facts` but the complaints.

    Examples
    --------
    >>> import etendue as et
    >>> fact_rows(ray_facts(et.RingSource(rays=1000).ray_set(), "rings"))[1]
    ('rays', '1,000')
    """
    unit = facts["flux_unit"]
    header, usable = facts["header_flux"], facts["usable_rays"]
    stated = f"header {header:.7g} {unit}" if isinstance(header, float) else "no total in the header"
    rows = [
        ("format", facts["title"]),
        ("rays", f"{facts['rays']:,}" + _unusable(facts)),
        ("flux", f"{facts['total_flux']:.7g} {unit}"),
        ("", f"{stated}; sum over the rays {facts['sum_flux']:.7g} {unit}"),
        ("per ray", _range(facts["flux_per_ray"], unit) + _equal_rays(facts["effective_rays"])),
        ("bounding box", _box(facts["bounding_box"]) or f"none ({'far-field data' if usable else NO_RAY})"),
        (
            "virtual focus",
            _point(facts["virtual_focus"], "mm")
            or f"not determined ({'collimated rays, or far-field data' if usable else NO_RAY})",
        ),
        ("mean direction", _point(facts["mean_direction"], "") or "none"),
        ("spectrum", facts["spectrum"]),
    ]  # fmt: skip
    rows += [
        (key.replace("_", " "), _short(value)) for key, value in facts["header"].items() if value not in ("", None)
    ]
    return rows


def _mean_direction(weighted: np.ndarray[Any, np.dtype[np.float64]]) -> list[float] | None:
    length = math.hypot(*weighted.tolist())
    return [float(c) / length for c in weighted] if length > 0 else None


def _spectrum(rays: RaySet) -> str:
    colours = rays.colours()
    efficacy = _efficacy(rays)
    worth = "" if efficacy is None else f", {efficacy:.4g} lm/W"
    if "wavelength" in rays.columns:
        if colours is None or colours.range is None:
            return "wavelength per ray, none known"
        low, high = colours.range
        unknown = f"; {colours.unknown_rays:,} rays state none" if colours.unknown_rays else ""
        return f"wavelength per ray, {low:.4g} to {high:.4g} nm{worth}{unknown}"
    if rays.meaning.single_wavelength is not None:
        return f"single wavelength {rays.meaning.single_wavelength:.4g} nm{worth}"
    if "spectrum_index" in rays.columns:
        return f"one of {len(rays.spectra)} spectra per ray{worth}"
    if rays.spectra:
        nodes = rays.spectra[0].wavelength
        return f"one spectrum for all rays, {nodes[0]:.4g} to {nodes[-1]:.4g} nm{worth}"
    if "tristimulus_x" in rays.columns:
        return "tristimulus values per ray"
    return "unknown"


def _efficacy(rays: RaySet) -> float | None:
    """Luminous efficacy of radiation of all rays [lm/W]."""
    spectrum = rays.total_spectrum()
    return None if spectrum is None else spectrum.luminous_efficacy


def _unusable(facts: dict[str, Any]) -> str:
    missing = facts["rays"] - facts["usable_rays"]
    return f", {missing:,} of them cannot be used" if missing else ""


def _range(pair: list[float] | None, unit: str) -> str:
    if pair is None:
        return "none"
    low, high = pair
    return f"{counted(low, unit)} each" if low == high else f"{counted(low, unit)} to {counted(high, unit)}"


def _equal_rays(effective: float) -> str:
    return "" if math.isnan(effective) else f"; as good as {effective:,.0f} equal rays"


def _box(bounds: list[list[float]] | None) -> str | None:
    if bounds is None:
        return None
    sides = [f"{low:.5g}" if low == high else f"{low:.5g} to {high:.5g}" for low, high in bounds]
    return ", ".join(f"{axis} {side}" for axis, side in zip("xyz", sides, strict=True)) + " mm"


def _point(point: list[float] | None, unit: str) -> str | None:
    return None if point is None else f"({', '.join(f'{c:.4f}' for c in point)}) {unit}".rstrip()


def _short(value: Any) -> str:
    """A fact of a header as people read it.

    >>> _short(False), _short((0.0, -2.5, 1e-3)), _short(1.0), _short("led")
    ('no', '(0, -2.5, 0.001)', '1', 'led')
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple) and all(isinstance(one, float) for one in value):
        text = f"({', '.join(f'{one:.7g}' for one in value)})"
    else:
        text = f"{value:.7g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 100 else text[:97] + "..."
