"""``etendue info``: what is in a ray, intensity, field, patch, trace or map file, and what is wrong with it."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from etendue.cli.terminal import complain, print_json, progress_bar, say
from etendue.errors import ArgumentError, EtendueError

if TYPE_CHECKING:
    import numpy as np

    from etendue.quantities.intensity import Intensity
    from etendue.quantities.ray_set import RaySet


class Found(NamedTuple):
    """What a file holds: as plain data, and for people."""

    facts: dict[str, Any]
    show: Callable[[], None]


def info(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Ray and intensity files of any format, light fields, patches, results of traces, maps, STEP files."
        ),
    ],
    photometry: Annotated[
        str | None,
        typer.Option("--photometry", help="Which one of intensity files that hold several (TM-33, GLDF)."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Format, rays, flux by header and by sum, bounding box, virtual focus, spectrum, complaints; other files."""
    described: list[Found] = []
    failed = False
    for file in files:
        try:
            described.append(_opened(file, photometry))
        except (EtendueError, OSError) as error:
            failed = True
            reason = error.strerror if isinstance(error, OSError) else error
            described.append(_plainly({"file": str(file), "error": str(reason)}))
    if json:
        print_json([found.facts for found in described])
    else:
        for number, found in enumerate(described):
            if number:
                say()
            found.show()
    if failed:
        raise typer.Exit(1)


def _opened(path: Path, photometry: str | None) -> Found:
    """What the file is, looked for from what is quickly recognised to what is read to its end."""
    # Whoever asks for an intensity file waits for no light fields, scenes or traces to be imported.
    from etendue.formats.intensity import detect_intensity_format, read_intensity

    if path.is_dir():
        patches = _patches(path)
        if patches is not None:
            return patches
    if detect_intensity_format(path) is not None:
        return _intensity(path, read_intensity(path, photometry))
    if photometry is not None:
        raise ArgumentError(f"{path}: --photometry is for intensity files, and this is none.")
    for look in (_light_field, _trace_result, _map, _bodies):
        found = look(path)
        if found is not None:
            return found
    return _plainly(describe(path))


def _found(path: Path, name: str, what: str, facts: dict[str, Any], show: Callable[[], None]) -> Found:
    """A file with a line that says what it is, its size in it."""
    size = path.stat().st_size

    def show_all() -> None:
        say(f"{path}: {what}, {size / 1000:,.1f} kB")
        show()

    return Found({"file": path, "format": name, "bytes": size} | facts, show_all)


def _plainly(facts: dict[str, Any]) -> Found:
    return Found(facts, lambda: _print(facts))


def _patches(path: Path) -> Found | None:
    from etendue.formats.patch_folder import is_patch_folder

    if not is_patch_folder(path):
        return None
    from etendue.lightfield.gridded.gridded_source import GriddedSource

    patches = GriddedSource.load(path)

    def show() -> None:
        say(f"{path}: {len(patches.patches):,} patches on {patches.surface.surface.spec}")
        for note in patches.notes:
            say(f"  {note}")

    size = {"patches": len(patches.patches), "flux_unit": patches.flux_unit}
    return Found({"file": path, "format": "patches"} | size | patches.facts, show)


def _intensity(path: Path, intensity: Intensity) -> Found:
    from etendue.cli.distributions import describe_intensity, print_intensity

    def show() -> None:
        print_intensity(intensity)
        for complaint in intensity.complaints:
            say(f"  {complaint}")

    facts = describe_intensity(intensity) | {"complaints": [one.to_dict() for one in intensity.complaints]}
    return _found(path, facts["format"], "intensity", facts, show)


def _light_field(path: Path) -> Found | None:
    from etendue.lightfield.storage import is_field_file

    if not is_field_file(path):
        return None
    from etendue.cli.field import describe_field, print_field
    from etendue.lightfield.light_field import LightField

    field = LightField.load(path)
    return _found(path, "light field", "light field", describe_field(field), lambda: print_field(field))


def _trace_result(path: Path) -> Found | None:
    from etendue.tracing.storage import is_result_file

    if not is_result_file(path):
        return None
    from etendue.cli.trace import print_result
    from etendue.tracing.result import TraceResult

    result = TraceResult.load(path)
    return _found(path, "trace result", "result of a trace", result.to_dict(), lambda: print_result(result))


def _map(path: Path) -> Found | None:
    from etendue.formats.maps import is_map_file, read_any_map

    if not is_map_file(path):
        return None
    from etendue.cli.maps import describe_map, print_map_file

    found = read_any_map(path)
    return _found(path, "map", f"map of {found.quantity}", describe_map(found), lambda: print_map_file(found))


def _bodies(path: Path) -> Found | None:
    from etendue.scene.mesh_files import step_bodies

    bodies = step_bodies(path)
    if bodies is None:
        return None
    from etendue.cli.bodies import describe_bodies, print_bodies

    def show() -> None:
        say(f"{path}: STEP, {len(bodies)} {'body' if len(bodies) == 1 else 'bodies'}")
        print_bodies(bodies)

    return Found({"file": path, "format": "STEP", "bytes": path.stat().st_size} | describe_bodies(bodies), show)


def describe(path: Path) -> dict[str, Any]:
    """Everything that `info` prints about one file of rays, as plain data: lengths in mm, wavelengths in nm."""
    from etendue.formats.rays import detect_format, read_rays

    rays = read_rays(path)
    with progress_bar(path.name, len(rays)) as progress:
        moments = rays.moments(progress)
    focus = rays.virtual_focus
    low, high = moments.flux_range
    known = len(rays) > rays.tally.unusable
    return {
        "file": str(path),
        "format": rays.provenance.format,
        "title": detect_format(path).title,
        "rays": len(rays),
        "usable_rays": len(rays) - rays.tally.unusable,
        "flux_unit": rays.flux_unit,
        "total_flux": rays.total_flux,
        "header_flux": rays.header.get("total_flux"),
        "sum_flux": rays.tally.flux * rays.meaning.stored_flux_scale,
        "effective_rays": rays.tally.effective_rays,
        "flux_per_ray": [low * rays.flux_scale, high * rays.flux_scale] if known else None,
        "bounding_box": moments.bounds.tolist() if known and rays.has_position else None,
        "virtual_focus": list(focus.point) if focus.determined else None,
        "mean_direction": _mean_direction(moments.weighted_direction),
        "spectrum": _spectrum(rays),
        "luminous_efficacy": _efficacy(rays),
        "columns": list(rays.columns),
        "header": dict(rays.header),
        "complaints": [complaint.to_dict() for complaint in rays.complaints],
        "complaint_lines": [str(complaint) for complaint in rays.complaints],
    }


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


def _print(facts: dict[str, Any]) -> None:
    if "error" in facts:
        complain(
            f"error: {facts['error']}"
            if facts["file"] in facts["error"]
            else f"error: {facts['file']}: {facts['error']}"
        )
        return
    unit = facts["flux_unit"]
    say(f"{facts['file']}")
    header = facts["header_flux"]
    stated = f"header {header:.7g} {unit}" if isinstance(header, float) else "no total in the header"
    rows = [
        ("format", facts["title"]),
        ("rays", f"{facts['rays']:,}" + _unusable(facts)),
        ("flux", f"{facts['total_flux']:.7g} {unit}"),
        ("", f"{stated}; sum over the rays {facts['sum_flux']:.7g} {unit}"),
        ("per ray", _range(facts["flux_per_ray"], unit) + f"; as good as {facts['effective_rays']:,.0f} equal rays"),
        ("bounding box", _box(facts["bounding_box"])),
        ("virtual focus", _point(facts["virtual_focus"], "mm") or "not determined (collimated rays, or far-field data)"),
        ("mean direction", _point(facts["mean_direction"], "") or "none"),
        ("spectrum", facts["spectrum"]),
    ]  # fmt: skip
    rows += [
        (key.replace("_", " "), _short(value)) for key, value in facts["header"].items() if value not in ("", None)
    ]
    for label, value in rows:
        say(f"  {label:<22} {value}")
    if not facts["complaint_lines"]:
        say(f"  {'complaints':<22} none")
    for number, line in enumerate(facts["complaint_lines"]):
        say(f"  {'complaints' if number == 0 else '':<22} {line}")


def _unusable(facts: dict[str, Any]) -> str:
    missing = facts["rays"] - facts["usable_rays"]
    return f", {missing:,} of them cannot be used" if missing else ""


def _range(pair: list[float] | None, unit: str) -> str:
    if pair is None:
        return "none"
    low, high = pair
    return f"{low:.4g} {unit} each" if low == high else f"{low:.4g} to {high:.4g} {unit}"


def _box(bounds: list[list[float]] | None) -> str:
    if bounds is None:
        return "none (far-field data)"
    return ", ".join(f"{axis} {low:.5g} to {high:.5g}" for axis, (low, high) in zip("xyz", bounds, strict=True)) + " mm"


def _point(point: list[float] | None, unit: str) -> str | None:
    return None if point is None else f"({', '.join(f'{c:.4f}' for c in point)}) {unit}".rstrip()


def _short(value: Any) -> str:
    text = f"{value:.7g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 100 else text[:97] + "..."
