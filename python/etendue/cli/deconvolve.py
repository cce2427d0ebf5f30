"""``etendue deconvolve``: a scan without the instrument that took it, in one plane or in two dimensions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
import typer

from etendue.cli.stated import refuse
from etendue.cli.terminal import check_outputs, complain, half_width, one_of, print_json, say
from etendue.errors import ArgumentError
from etendue.formats.maps import PICTURE_EXTENSIONS
from etendue.instruments.bench import Bench
from etendue.instruments.deconvolution import REPLICATES, Deconvolution, Method
from etendue.instruments.deconvolution import deconvolve as deconvolve_scan
from etendue.instruments.directional_deconvolution import (
    DirectionalDeconvolution,
    DirectionalMethod,
    deconvolve_directions,
)
from etendue.instruments.directional_scan import DirectionalScan, read_scan
from etendue.instruments.goniometer_scan import GoniometerScan, read_goniometer_scan
from etendue.instruments.operators import OperatorName
from etendue.instruments.scatter_goniometer import ScatterGoniometer
from etendue.instruments.stopping import RULES
from etendue.plot import plot_deconvolution, plot_directions
from etendue.quantities.measured import measured
from etendue.quantities.powers_of_ten import counted
from etendue.scatter.lobe_models import LOBE_MODELS

METHODS = sorted({*get_args(Method), *get_args(DirectionalMethod)})


def deconvolve(
    scan: Annotated[
        Path,
        typer.Argument(
            help="The scan, .csv: angle,flux; or theta_s,phi_s,flux; or theta_i,phi_i,theta_s,phi_s,bsdf; standard_error."
        ),
    ],
    instrument: Annotated[
        Path | None,
        typer.Option(
            "--instrument",
            help="The scan of the bare beam by the same instrument, .csv; in two dimensions, if nothing else tells it.",
        ),
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option("--output", "-o", help="Values, .csv, or a picture, .png, .svg or .pdf; repeatable."),
    ] = None,
    operator: Annotated[
        str,
        typer.Option("--operator", help="In one plane. rings: a round lobe, exactly; slice: as the thesis does it."),
    ] = "rings",
    method: Annotated[
        str | None,
        typer.Option(
            "--method",
            help="richardson-lucy or matrix; in one plane penalised, the default for rings whose noise is known; "
            "in two dimensions total-variation and parametric.",
        ),
    ] = None,
    stop: Annotated[
        str | None,
        typer.Option("--stop", help=f"When the iteration ends: {', '.join(RULES)}, or a number of iterations."),
    ] = None,
    models: Annotated[
        str | None,
        typer.Option("--models", help=f"Lobes that --method parametric chooses from: {', '.join(LOBE_MODELS)}."),
    ] = None,
    regular: Annotated[
        float | None,
        typer.Option("--regular", help="Share that is mirrored in a single direction; looked for if not given."),
    ] = None,
    cell: Annotated[float | None, typer.Option("--cell", help="Width of the finest splines in °.")] = None,
    aperture: Annotated[
        float | None, typer.Option("--aperture", help="Diameter of the aperture in mm, if the file does not say.")
    ] = None,
    beam: Annotated[
        float | None, typer.Option("--beam", help="Diameter of the beam in mm, if the file does not say.")
    ] = None,
    distance: Annotated[
        float | None,
        typer.Option("--distance", help="Distance from sample to aperture in mm, if the file does not say."),
    ] = None,
    replicates: Annotated[
        int,
        typer.Option("--replicates", help="Number of repeated scans, with new noise, that error bands are made of."),
    ] = REPLICATES,
    seed: Annotated[
        int, typer.Option("--seed", help="Seed of the repeated scans, and of counts kept back.", min=0)
    ] = 1,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Take the instrument out of a scan, and say how the iteration stopped and what it is sure of."""
    how: OperatorName = one_of(operator, ("rings", "slice"), "--operator")
    if method is not None:
        method = one_of(method, METHODS, "--method")
    rule: str | int | None = stop
    if stop is not None:
        rule = int(stop) if stop.isdecimal() else _rule(stop)
    chosen = None if models is None else [one_of(name.strip(), LOBE_MODELS, "--models") for name in models.split(",")]
    outputs = output or []
    check_outputs(outputs, (".csv", *PICTURE_EXTENSIONS))
    measured = read_scan(scan)
    bare = None if instrument is None else read_goniometer_scan(instrument)
    if isinstance(measured, GoniometerScan):
        only = {"--models": chosen, "--regular": regular, "--cell": cell, "--aperture": aperture, "--beam": beam}
        _refuse({**only, "--distance": distance})
        if method not in {None, *get_args(Method)}:
            raise ArgumentError(f"--method {method} is for scans in two dimensions; {scan} is in one plane")
        if bare is None:
            raise ArgumentError(f"{scan} is in one plane: state --instrument, a scan of the bare beam")
        which: Any = method
        flat = deconvolve_scan(measured, bare, operator=how, method=which, stop=rule, replicates=replicates, seed=seed)
        _tell(flat, scan, outputs, json=json)
        return
    if how != "rings":
        raise ArgumentError("--operator is for scans in one plane; this one is in two dimensions")
    if method not in {None, *get_args(DirectionalMethod)}:
        raise ArgumentError(f"--method {method} is for scans in one plane; {scan} is in two dimensions")
    way: Any = method or "richardson-lucy"
    if way != "parametric":
        refuse(["models"], f"for --method parametric; {way} chooses from none")
    if way in {"parametric", "matrix"}:
        refuse(["stop", "replicates"], f"for an iteration; --method {way} is none")
    more: dict[str, Any] = {} if chosen is None else {"models": chosen}
    found = deconvolve_directions(
        measured,
        _instrument(measured, bare, aperture, beam, distance),
        method=way,
        stop=rule,
        regular=True if regular is None else regular,
        cell=cell,
        replicates=replicates,
        seed=seed,
        **more,
    )
    _tell_directions(found, scan, outputs, json=json)


def _rule(stop: str) -> str:
    """The rule by which the iteration ends, of ``--stop``.

    Raises
    ------
    typer.BadParameter
        If it is neither a rule nor a number of iterations.
    """
    try:
        return one_of(stop, RULES, "--stop")
    except typer.BadParameter as mistake:
        raise typer.BadParameter(f"{mistake.message} Or a whole number of iterations, from 1.") from None


def _refuse(given: dict[str, object]) -> None:
    named = [name for name, value in given.items() if value is not None]
    if named:
        raise ArgumentError(f"{', '.join(named)}: for scans in two dimensions; this one is in one plane")


def _instrument(
    scan: DirectionalScan,
    bare: GoniometerScan | None,
    aperture: float | None,
    beam: float | None,
    distance: float | None,
) -> Bench | GoniometerScan | None:
    stated = (beam, aperture, distance)
    if all(value is None for value in stated):
        if scan.bench is not None:
            refuse(
                ["instrument"], "the file of the scan tells beam, aperture and distance, which say more; leave it out"
            )
        return bare
    if bare is not None:
        raise ArgumentError("state --aperture, --beam and --distance, or --instrument: not both")
    if any(value is None for value in stated):
        raise ArgumentError("--aperture, --beam and --distance describe an instrument together: state all three")
    return ScatterGoniometer(beam, aperture, distance).bench  # type: ignore[arg-type] # none is None


def _write(found: Deconvolution | DirectionalDeconvolution, scan: Path, outputs: list[Path]) -> None:
    for path in outputs:
        if path.suffix.lower() == ".csv":
            found.save(path)
        elif isinstance(found, Deconvolution):
            plot_deconvolution(found, path, title=scan.name)
        else:
            plot_directions(found, path, title=scan.name)


def _peak_error(found: Deconvolution | DirectionalDeconvolution) -> float | None:
    return None if found.standard_error is None else float(found.standard_error[int(np.argmax(found.values))])


def _tell(found: Deconvolution, scan: Path, outputs: list[Path], *, json: bool) -> None:
    _write(found, scan, outputs)
    error = _peak_error(found)
    if json:
        print_json({
            "outputs": outputs,
            "peak": found.peak,
            "peak_error": error,
            "peak_before": float(found.raw.max()),
            "fwhm": found.fwhm,
            "middle": found.middle,
            "iterations": found.iterations,
            "stop": found.stop,
            "total_scatter": list(found.total_scatter),
            "operator": found.operator,
            "notes": list(found.notes),
        })  # fmt: skip
        return
    for note in found.notes:
        complain(f"note: {note}")
    before, after = found.total_scatter
    say(f"stop after {found.iterations} iterations, {found.stop}" if found.iterations else found.stop)
    say(_peak_line(float(found.raw.max()), found.peak, error))
    say(f"{half_width(found.fwhm)}, middle at {found.middle:.3f}°")
    say(f"total scatter {before:.4g} before, {after:.4g} after")
    for path in outputs:
        say(f"{path}: written")


def _peak_line(before: float, after: float, error: float | None) -> str:
    known = measured(after, math.nan if error is None else error, "").rstrip()
    return f"peak {counted(before, '').rstrip()} as measured, {known} without the instrument"


def _tell_directions(found: DirectionalDeconvolution, scan: Path, outputs: list[Path], *, json: bool) -> None:
    _write(found, scan, outputs)
    error = _peak_error(found)
    raw = float(found.scan.bsdf.max())
    if json:
        print_json({
            "outputs": outputs,
            "method": found.method,
            "peak": found.peak,
            "peak_error": error,
            "peak_before": raw,
            "iterations": found.iterations,
            "stop": found.stop,
            "regular_share": found.regular.share,
            "regular_share_error": found.regular.error,
            "total_flux": list(found.total_flux),
            "cell": found.cell,
            "model": None if found.model is None else found.model.bsdf.model_dump(),
            "turn": None if found.model is None else found.model.turn,
            "notes": list(found.notes),
        })  # fmt: skip
        return
    for note in found.notes:
        complain(f"note: {note}")
    before, after = found.total_flux
    if found.iterations:
        say(f"stop after {found.iterations} iterations, {found.stop}")
    else:
        say(found.stop)
    say(_peak_line(raw, found.peak, error))
    say(
        f"in a single direction {found.regular.share:.4g} ± {found.regular.error:.1g} of the light; {found.regular.why}"
    )
    say(f"flux of all positions {before:.4g} before, {after:.4g} after")
    if found.model is not None:
        for part in found.model.bsdf.parts:
            say(f"  {part!r}")
        say(f"  axis turned by {found.model.turn:.1f}°")
    for path in outputs:
        say(f"{path}: written")
