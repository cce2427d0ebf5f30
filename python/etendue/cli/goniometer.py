"""``etendue goniometer``: a virtual measurement of a BSDF, or of the bare beam."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from etendue.cli.stated import refuse
from etendue.cli.terminal import check_folder, complain, count, half_width, one_of, print_json, say
from etendue.instruments.directional_scan import DirectionalScan
from etendue.instruments.goniometer_measurement import Method
from etendue.instruments.goniometer_scan import GoniometerScan, Way
from etendue.instruments.positions import Plane
from etendue.instruments.samples import read_sample
from etendue.instruments.scan_peak import scan_peak
from etendue.instruments.scatter_goniometer import BARE_STEP, SPAN, STEP, ScatterGoniometer
from etendue.quantities.measured import measured_largest
from etendue.quantities.powers_of_ten import counted

COLLIMATED = 0.0

ROUNDED = 1e-9
"""Relative error below which it is none but rounding."""

WINDOW = 6.0
"""Span of a window if nothing is said [°]."""


def goniometer(
    sample: Annotated[
        Path | None, typer.Argument(help="The sample: a finish in TOML (kind = …), or a file of scatter data.")
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="The scan, .csv.")] = None,
    no_sample: Annotated[bool, typer.Option("--no-sample", help="The bare beam: the instrument function.")] = False,
    aperture: Annotated[
        float, typer.Option("--aperture", help="Diameter of the aperture, or side of a square in mm.")
    ] = 25.0,
    aperture_shape: Annotated[
        str, typer.Option("--aperture-shape", help="Shape of the aperture: disk, square or ring.")
    ] = "disk",
    inner: Annotated[float, typer.Option("--inner", help="Inner diameter of a ring in mm.")] = 0.0,
    beam: Annotated[float, typer.Option("--beam", help="Diameter of the beam in mm.")] = 14.0,
    profile: Annotated[
        str, typer.Option("--profile", help="Irradiance over the beam: uniform or gaussian.")
    ] = "uniform",
    divergence: Annotated[
        float,
        typer.Option("--divergence", help="Angle of the outermost rays with the axis in °; negative: convergent."),
    ] = COLLIMATED,
    source_angle: Annotated[
        float, typer.Option("--source-angle", help="Diameter of the source of light, seen from the sample in °.")
    ] = COLLIMATED,
    distance: Annotated[
        float, typer.Option("--distance", help="Distance from the sample to the aperture in mm.")
    ] = 886.0,
    incidence: Annotated[float, typer.Option("--incidence", help="Angle of incidence in °.")] = 0.0,
    step: Annotated[
        float | None,
        typer.Option("--step", help=f"Step between positions in °; {STEP:g}, or {BARE_STEP:g} of the bare beam."),
    ] = None,
    span: Annotated[
        float | None,
        typer.Option(
            "--span",
            help=f"Angle up to which the scan goes on both sides, in °; {SPAN:g} with a sample, {WINDOW:g} of a window.",
        ),
    ] = None,
    window: Annotated[
        bool, typer.Option("--window", help="In two dimensions: a window about the regular direction.")
    ] = False,
    outside: Annotated[
        float | None,
        typer.Option("--outside", help="With --window: steps in ° over the rest of the hemisphere, 0.5 to 30."),
    ] = None,
    turn: Annotated[
        float, typer.Option("--turn", help="With --window: by how much the sample is turned about its normal in °.")
    ] = 0.0,
    head: Annotated[
        float,
        typer.Option("--head", help="With --window: diameter of the detector's head in mm, which shadows the sample."),
    ] = 0.0,
    plane: Annotated[
        str, typer.Option("--plane", help="Plane of the scan: in-plane (that of incidence) or cross-plane.")
    ] = "in-plane",
    way: Annotated[
        str | None,
        typer.Option("--way", help="Light that is measured, transmitted or reflected, of a sample that does both."),
    ] = None,
    method: Annotated[
        str, typer.Option("--method", help="How it is computed: trace (rays) or quadrature (an integral).")
    ] = "trace",
    rays: Annotated[int, typer.Option("--rays", parser=count(), help="Rays at each position.", metavar="N")] = 10**6,
    fresh: Annotated[
        bool,
        typer.Option(
            "--fresh", help="Draw new rays for each position, so that errors are independent: ten times the work."
        ),
    ] = False,
    photons: Annotated[
        float | None,
        typer.Option(
            "--photons", help="Photons of the whole beam at each position, for photon noise; none if not given."
        ),
    ] = None,
    dark: Annotated[float, typer.Option("--dark", help="Counts without light at a position.")] = 0.0,
    drift: Annotated[
        float, typer.Option("--drift", help="Share by which the beam changes during the scan, e.g. 0.01.")
    ] = 0.0,
    seed: Annotated[int, typer.Option("--seed", help="Seed of rays and noise.", min=0)] = 1,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Measure a sample, or the bare beam, with a virtual goniometer."""
    if (sample is None) != no_sample:
        raise typer.BadParameter("give a sample, or --no-sample for the instrument function")
    if no_sample and window:
        raise typer.BadParameter("--window needs a sample: the bare beam is the same across and along")
    if not window and (outside is not None or turn or head):
        raise typer.BadParameter("--outside, --turn and --head are for scans in two dimensions: add --window")
    if no_sample:
        refuse(("incidence", "plane", "way"), "for a sample; the bare beam goes straight on")
        if not fresh:
            refuse(["rays"], "of the bare beam, for --fresh; without it the overlap of beam and aperture is computed")
    step = step if step is not None else BARE_STEP if no_sample else STEP
    which: Plane = one_of(plane, ("in-plane", "cross-plane"), "--plane")
    if window and which != "in-plane":
        raise typer.BadParameter("--plane is for scans in one plane; --window scans both")
    how: Method = one_of(method, ("trace", "quadrature"), "--method")
    if how == "quadrature":
        refuse(("rays", "fresh"), "for --method trace; a quadrature draws no rays")
    shape: Literal["uniform", "gaussian"] = one_of(profile, ("uniform", "gaussian"), "--profile")
    ways: tuple[Way, Way] = ("transmitted", "reflected")
    to = None if way is None else one_of(way, ways, "--way")
    if output is not None:
        check_folder(output)
    instrument = ScatterGoniometer(
        beam,
        aperture,
        distance,
        aperture=one_of(aperture_shape, ("disk", "square", "ring"), "--aperture-shape"),
        inner_diameter=inner,
        profile=shape,
        divergence=divergence,
        source_angle=source_angle,
        photons=photons,
        dark=dark,
        drift=drift,
        head_diameter=head,
    )
    if window:
        wide = instrument.measure_window(
            read_sample(sample),  # type: ignore[arg-type] # there is one
            incidence,
            step,
            WINDOW if span is None else span,
            rays,
            seed,
            outside=outside,
            turn=turn,
            way=to,
            method=how,
            fresh=fresh,
        )
        _tell_directions(wide, sample, output, json=json)
        return
    if sample is None:
        scan = instrument.instrument_function(step, span, rays=rays if method == "trace" and fresh else None, seed=seed)
    else:
        scan = instrument.measure(
            read_sample(sample),
            incidence,
            step,
            rays,
            seed,
            span=SPAN if span is None else span,
            plane=which,
            way=to,
            method=how,
            fresh=fresh,
        )
    if output is not None:
        scan.save(output)
    facts = {
        "output": output,
        "sample": sample,
        "positions": scan.angle.size,
        "solid_angle": instrument.solid_angle,
        "fwhm": scan.fwhm,
        "notes": list(scan.notes),
    }
    facts |= {"peak_flux": scan.peak} if sample is None else {**_peak(scan), "total_scatter": scan.total_scatter}
    if json:
        print_json(facts)
        return
    for note in scan.notes:
        complain(f"note: {note}")
    say(
        f"{scan.angle.size} positions from {scan.angle[0]:g}° to {scan.angle[-1]:g}°, Ω = {instrument.solid_angle:.4g} sr"
    )
    if sample is None:
        say(f"instrument function: {half_width(scan.fwhm)}")
    else:
        say(f"peak {_told_peak(scan)}, {half_width(scan.fwhm)}")
        told = "if the lobe is round in direction cosines and the scan reaches its end"
        say(f"total scatter {scan.total_scatter:.4f}, {told}")
    if output is not None:
        say(f"{output}: written")


def _peak(scan: GoniometerScan | DirectionalScan) -> dict[str, float]:
    """The peak [1/sr] with its error, and the largest value, which chance lifts, as plain data for JSON."""
    value, error = scan_peak(scan)
    return {"peak": value, "peak_error": error, "maximum": float(scan.bsdf.max())}


def _told_peak(scan: GoniometerScan | DirectionalScan) -> str:
    largest, (value, error) = float(scan.bsdf.max()), scan_peak(scan)
    if error < ROUNDED * value:  # a quadrature
        return counted(largest, "1/sr")
    return measured_largest(value, error, largest, "1/sr")


def _tell_directions(scan: DirectionalScan, sample: Path | None, output: Path | None, *, json: bool) -> None:
    if output is not None:
        scan.save(output)
    if json:
        print_json({
            "output": output,
            "sample": sample,
            "positions": scan.flux.size,
            "solid_angle": scan.solid_angle,
            **_peak(scan),
            "notes": list(scan.notes),
        })  # fmt: skip
        return
    for note in scan.notes:
        complain(f"note: {note}")
    say(
        f"{scan.flux.size} positions in two dimensions, {scan.way} at {scan.incidence:g}°, Ω = {scan.solid_angle:.4g} sr"
    )
    say(f"peak {_told_peak(scan)}")
    if output is not None:
        say(f"{output}: written")
