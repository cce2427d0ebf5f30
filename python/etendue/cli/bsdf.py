"""``etendue bsdf``: what a file says of scatter, its picture, and other formats."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer

from etendue.cli.guard import guarded
from etendue.cli.stated import Verb, refuse, stated
from etendue.cli.terminal import check_folder, complain, one_of, print_json, say
from etendue.errors import ArgumentError
from etendue.formats.bsdf import BSDF_FORMATS
from etendue.formats.own_kind import DIRECTIONS, STAGES
from etendue.formats.rt300s import is_rt300s
from etendue.formats.scans_csv import read_columns
from etendue.plot import plot_bsdf
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.measured import measured
from etendue.scatter.appearance import GLASS, appearance
from etendue.scatter.bsdf import WAVELENGTH
from etendue.scatter.files import read_bsdf, write_bsdf
from etendue.scatter.materials import MATERIALS
from etendue.scatter.model_fit import FITTED_MODELS, fit_bsdf
from etendue.scatter.scans.files import read_scans
from etendue.scatter.scans.interpolations import AUTOMATIC, METHODS, share_error
from etendue.scatter.scans.scans import Scans
from etendue.scatter.table import BsdfTable

app = typer.Typer(
    help="Files of scatter data: what they hold, pictures of it, other formats.",
    no_args_is_help=True,
    add_completion=False,
)

ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)
"""Angles of incidence at which shares are told [°]."""

RIGHT_ANGLE = 90.0
"""[°]"""

File = Annotated[Path, typer.Argument(help="A file with a BSDF, of any format that étendue reads.")]
Files = Annotated[
    list[Path], typer.Argument(help="A file with a BSDF; or several that hold a part each, as one incidence.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


def info(files: Files, json: Json = False) -> None:
    """Say what a file holds: its format, incidences, sides, shares by angle, reciprocity, and what is wrong with it."""
    bsdf = read_bsdf(files)
    facts = _facts(files, bsdf)
    if json:
        print_json(facts)
        return
    for complaint in facts["complaints"]:
        complain(complaint)
    turned = "isotropic" if bsdf.isotropic else "anisotropic"
    say(f"{_named(files)}: {facts['format']}, {bsdf.name or 'no name'}, {turned}")
    for one in facts["tables"]:
        stated = "" if one["stated"] is None else f", stated {one['stated']:.4f}"
        if one["unscaled"] is not None:
            stated = f", {one['unscaled']:.4f} before scaling"
        way = "transmitted" if one["transmitted"] else "reflected"
        place = f"{one['side']}, {one['theta']:g}°" + (f", azimuth {one['phi']:g}°" if not bsdf.isotropic else "")
        place += "" if one["wavelength"] is None else f", {one['wavelength']:g} nm"
        say(f"  {place}: {one['share']:.4f} {way}{stated}")
    for part in facts["components"]:
        say(f"  component {part}")
    colour = f" at {WAVELENGTH:g} nm" if bsdf.wavelengths else ""
    for key in ("reflectance", "transmittance"):
        if max(facts[key]) > 0.0:
            last = facts["known_to"][key]
            told = ", ".join(
                f"{share:.4f} at {angle:g}°{'*' if angle > last else ''}"
                for angle, share in zip(ANGLES, facts[key], strict=True)
            )
            beyond = f" (* extrapolated from {last:g}°)" if last < max(ANGLES) else ""
            say(f"{key}{colour}: {told}{beyond}")
    say(f"reciprocity: f there and back differ by {facts['reciprocity']:.1%} on average")


def _named(files: list[Path]) -> str:
    return str(files[0]) if len(files) == 1 else f"{len(files)} files"


def _table_facts(one: BsdfSlice, *, of_scans: bool) -> dict[str, Any]:
    share = one.integral()
    return {
        "side": "front" if one.front else "back",
        "theta": round(one.theta, 6),
        "phi": round(one.phi, 6),
        "transmitted": one.transmitted,
        "wavelength": one.wavelength,
        "share": share,
        # Tables of scans keep there what the scans added up to; nothing was stated.
        "stated": None if of_scans else one.stated,
        "unscaled": one.stated if of_scans and one.stated != share else None,
    }


def _facts(files: list[Path], bsdf: BsdfTable) -> dict[str, Any]:
    # A file of many slices is told by the first azimuth.
    first = {
        (one.front, one.transmitted, round(one.theta, 6), one.wavelength): one for one in reversed(bsdf.data.slices)
    }
    of_scans = "interpolation" in bsdf.data.facts
    ordered = sorted(first.values(), key=lambda one: (not one.front, one.transmitted, one.theta, one.wavelength or 0.0))
    tables = [_table_facts(one, of_scans=of_scans) for one in ordered]
    angles = np.array(ANGLES)
    return {
        "file": files[0] if len(files) == 1 else files,
        "format": bsdf.data.format,
        "name": bsdf.name,
        "isotropic": bsdf.isotropic,
        "slices": len(bsdf.data.slices),
        "tables": tables,
        "components": [dict(part) for part in bsdf.data.components],
        "angles": list(ANGLES),
        "reflectance": bsdf.reflectance(angles).tolist(),
        "transmittance": bsdf.transmittance(angles).tolist(),
        "known_to": {
            key: bsdf.known_to(transmitted=transmitted)
            for key, transmitted in (("reflectance", False), ("transmittance", True))
        },
        "reciprocity": bsdf.irreciprocity(),
        "complaints": [str(complaint) for complaint in bsdf.complaints],
    }


def plot(
    file: File,
    output: Annotated[Path, typer.Option("--output", "-o", help="The picture, .png, .svg or .pdf.")],
    incidence: Annotated[
        float, typer.Option("--incidence", help="Angle of incidence of the lobe that is drawn, in °.")
    ] = 45.0,
    side: Annotated[str, typer.Option("--side", help="The side that the light meets: front or back.")] = "front",
    json: Json = False,
) -> None:
    """Draw f in the plane of incidence, the lobe in direction cosines and as a surface, and the shares by angle."""
    met: Literal["front", "back"] = one_of(side, ("front", "back"), "--side")
    if not 0.0 <= incidence < RIGHT_ANGLE:
        raise typer.BadParameter(f"{incidence:g}° is not from 0 to below 90°", param_hint="--incidence")
    check_folder(output)
    bsdf = read_bsdf(file)
    complaints = [str(complaint) for complaint in bsdf.complaints]
    plot_bsdf(bsdf, output, incidence=incidence, side=met, title=bsdf.name or None)
    if json:
        print_json({"output": output, "complaints": complaints})
        return
    for complaint in complaints:
        complain(complaint)
    say(f"{output}: f of {file}")


def convert(
    files: Files,
    output: Annotated[Path, typer.Argument(help="The file to write.")],
    format: Annotated[
        str | None, typer.Option("--format", help="Format to write; from the extension of OUTPUT if not given.")
    ] = None,
    json: Json = False,
) -> None:
    """Read a file, or several that belong together, and write another one; what gets lost is told."""
    named = None if format is None else one_of(format, BSDF_FORMATS, "--format")
    check_folder(output)
    bsdf = read_bsdf(files)
    complaints = [str(complaint) for complaint in bsdf.complaints]
    notes = list(write_bsdf(output, bsdf, named))
    if json:
        print_json({"output": output, "complaints": complaints, "notes": notes})
        return
    for line in (*complaints, *(f"note: {note}" for note in notes)):
        complain(line)
    held = [(len(bsdf.data.slices), "slice"), (len(bsdf.data.components), "component")]
    read = " and ".join(f"{n} {what}" + ("s" if n != 1 else "") for n, what in held if n)
    say(f"{output}: {read} read from {_named(files)}")


def gloss(
    files: Files,
    seed: Annotated[int, typer.Option("--seed", help="For the tables that errors are made of.")] = 1,
    json: Json = False,
) -> None:
    """Say how a surface looks to instruments: gloss, reflection haze, distinctness of image, haze of what it transmits.

    After ISO 2813 at 20°, 60° and 85°, ISO 13803, ASTM E430 and D1003; with errors if the file has those of its values.
    """
    bsdf = read_bsdf(files)
    found = appearance(bsdf, seed)
    complaints = [str(complaint) for complaint in bsdf.complaints]
    if not bsdf.isotropic:
        complaints.append("note: light comes from azimuth 180°; turned about its normal, the sample looks different")
    if bsdf.wavelengths:
        complaints.append(f"note: all numbers are those of light of {WAVELENGTH:g} nm, not weighted with V(λ)")
    if found.extrapolated:
        last = next(iter(found.extrapolated.values()))
        beyond = f"beyond the last incidence, {last:g}°, and extrapolated: it may be off by a factor"
        complaints.append(f"warning: {' and '.join(found.extrapolated)}: {beyond}")
    if json:
        facts = {**dataclasses.asdict(found), "file": files[0] if len(files) == 1 else files}
        print_json({**facts, "complaints": complaints})
        return
    for complaint in complaints:
        complain(complaint)
    units = {"haze": "% of transmitted light", "distinctness": "%"}
    for name, value in found.values().items():
        say(f"{name}: {measured(value, found.errors.get(name, math.nan), units.get(name, 'gloss units'))}")
    say(f"gloss units: black glass of index {GLASS} has 100")


def fit(
    files: Annotated[
        list[Path],
        typer.Argument(help="Scans: CSV of theta_i,phi_i,theta_s,phi_s,bsdf or of stages; .xls of the RT-300S."),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="The BSDF, in any format that étendue writes.")],
    method: Annotated[
        str | None, typer.Option("--method", help=f"From scans to a grid: {', '.join(METHODS)}; else by the scans.")
    ] = None,
    model: Annotated[
        str | None, typer.Option("--model", help=f"A model instead of a table: {', '.join(FITTED_MODELS)}.")
    ] = None,
    reflectance: Annotated[
        float | None,
        typer.Option("--reflectance", help="Reflectance by an integrating sphere; each incidence is scaled to it."),
    ] = None,
    transmittance: Annotated[
        float | None,
        typer.Option("--transmittance", help="Transmittance by an integrating sphere, for scans behind the sample."),
    ] = None,
    incident_flux: Annotated[
        Path | None, typer.Option("--incident-flux", help="For stages: the file with the flux on the sample.")
    ] = None,
    solid_angle: Annotated[
        float | None, typer.Option("--solid-angle", help="For stages: solid angle of the aperture in sr.")
    ] = None,
    blank: Annotated[
        Path | None, typer.Option("--blank", help="For .xls: the scan without a sample, which is subtracted.")
    ] = None,
    json: Json = False,
) -> None:
    """Make a table of goniometer scans, or fit a model to them, and say what they add up to."""
    chosen = None if method is None else one_of(method, METHODS, "--method")
    fitted = None if model is None else one_of(model, FITTED_MODELS, "--model")
    if chosen is not None and fitted is not None:
        raise typer.BadParameter("it is for tables, and --model asks for a model; leave one out", param_hint="--method")
    check_folder(output)
    _refuse_idle(files)
    scans = read_scans(
        files,
        incident_flux=incident_flux,
        solid_angle=solid_angle,
        reflectance=reflectance,
        transmittance=transmittance,
        blank=blank,
    )
    named = ", ".join(file.name for file in files)
    if fitted is not None:
        _fit_model(scans, named, fitted, output, json=json)
    else:
        _fit_table(scans, named, chosen or AUTOMATIC, output, json=json)


def _refuse_idle(files: list[Path]) -> None:
    """Refuse options that are for other kinds of scans than these."""
    of_stages = ("incident_flux", "solid_angle")
    if not stated("blank", *of_stages):
        return
    books = [file for file in files if is_rt300s(file)]
    if not books:
        refuse(["blank"], "for .xls of the RT-300S, and none of the files is one")
    # Files of stages are told from those of directions by their columns.
    tables = (read_columns(file, (DIRECTIONS, STAGES)) for file in files if file not in books)
    if all(DIRECTIONS[0] in columns for columns in tables):
        refuse(of_stages, "for scans of stages and fluxes, and none of the files is one")


def _fit_model(scans: Scans, named: str, model: str, output: Path, *, json: bool) -> None:
    try:
        found = fit_bsdf(scans, model)
    except ArgumentError as error:
        raise ArgumentError(f"{named}: {error}") from error
    notes = [*found.notes, *write_bsdf(output, found.table)]
    if json:
        parameters = {
            name: {"value": value, "standard_error": found.standard_errors[name]}
            for name, value in found.parameters.items()
        }
        shares = [
            {"theta": round(theta, 6), "share": share, "standard_error": error}
            for theta, share, error in zip(found.thetas, found.shares, found.share_errors, strict=True)
        ]
        fit = {name: getattr(found, name) for name in ("chi2_per_dof", "rms_residual", "degrees_of_freedom")}
        print_json(
            {"output": output, "model": found.kind, "parameters": parameters, "shares": shares, **fit, "notes": notes}
        )
        return
    for note in notes:
        complain(f"note: {note}")
    for line in found.lines():
        say(f"  {line}")
    say(f"{output}: {found.kind} fitted to {scans.values.size} values at {len(scans.thetas)} incidences")


def _fit_table(scans: Scans, named: str, method: str, output: Path, *, json: bool) -> None:
    try:
        table = BsdfTable.from_scans(scans, method)
    except ArgumentError as error:
        advice = "values are f in 1/sr, the cosine not included; --reflectance scales them to an integrating sphere"
        raise ArgumentError(f"{named}: {error}; {advice}") from error
    notes = list(write_bsdf(output, table))
    shares = [
        {
            "theta": round(one.theta, 6),
            "phi": round(one.phi, 6),
            "transmitted": one.transmitted,
            "share": one.stated,
            "standard_error": share_error(one),
        }
        for one in table.data.slices
    ]
    method = table.data.facts["interpolation"]
    turning = scans.anisotropy()
    complaints = [str(complaint) for complaint in table.complaints]
    if json:
        told = {"complaints": complaints, "notes": notes}
        turned = turning if math.isfinite(turning) else None
        print_json({"output": output, "method": method, "shares": shares, "anisotropy": turned, **told})
        return
    for line in (*complaints, *(f"note: {note}" for note in notes)):
        complain(line)
    if math.isfinite(turning):
        say(f"  turning the sample changes values by {turning:.1%} (root mean square)")
    for one, held in zip(shares, table.data.slices, strict=True):
        place = f"{one['theta']:g}°" + ("" if table.isotropic else f", azimuth {one['phi']:g}°")
        way = " of transmitted light" if held.transmitted else ""
        total = scans.transmittance if held.transmitted else scans.reflectance
        scaled = "" if total is None else f", scaled to {total:g}"
        say(f"  {place}: the scans{way} add up to {_share_told(held)}{scaled}")
    count = len(table.data.slices)
    say(f"{output}: {count} slice{'s' * (count != 1)} of {scans.values.size} values, {method}")


def _share_told(one: BsdfSlice) -> str:
    share, error = one.stated or 0.0, share_error(one)
    return measured(share, error, "").rstrip() if math.isfinite(error) else f"{share:.4f}"


NEAR_NORMAL = 8.0
"""Angle at which integrating spheres measure reflectance [°]."""


def materials(json: Json = False) -> None:
    """List the materials that a scene may name as a finish: reflectance and transmittance at 8°, and what they rest on."""
    found = [
        {
            "name": name,
            "kind": material.finish.model_dump()["kind"],
            "reflectance": float(material.finish.reflectance(NEAR_NORMAL)),
            "transmittance": float(material.finish.transmittance(NEAR_NORMAL)),
            "source": material.source,
        }
        for name, material in MATERIALS.items()
    ]
    if json:
        print_json(found)
        return
    for one in found:
        shares = f"R = {one['reflectance']:.2f}, T = {one['transmittance']:.2f}"
        say(f"{one['name']}: {one['kind']}, {shares} at {NEAR_NORMAL:g}°; {one['source']}")


for _name, _verb in (
    ("info", info),
    ("plot", plot),
    ("convert", convert),
    ("gloss", gloss),
    ("fit", fit),
    ("materials", materials),
):
    app.command(_name, cls=Verb)(guarded(f"bsdf {_name}", _verb))
