"""``etendue deconvolve``: a scan without the instrument that took it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from etendue.cli.terminal import check_outputs, complain, one_of, print_json, say
from etendue.instruments.deconvolution import REPLICATES, Method
from etendue.instruments.deconvolution import deconvolve as deconvolve_scan
from etendue.instruments.goniometer_scan import read_goniometer_scan
from etendue.instruments.operators import OperatorName
from etendue.instruments.stopping import RULES
from etendue.plot import plot_deconvolution


def deconvolve(
    scan: Annotated[
        Path, typer.Argument(help="The scan, .csv: angle,flux, or theta_i,phi_i,theta_s,phi_s,bsdf; standard_error.")
    ],
    instrument: Annotated[
        Path, typer.Option("--instrument", help="The scan of the bare beam by the same instrument, .csv.")
    ],
    output: Annotated[
        list[Path] | None, typer.Option("--output", "-o", help="Values, .csv, or a picture, .png or .pdf; repeatable.")
    ] = None,
    operator: Annotated[
        str, typer.Option("--operator", help="rings: a round lobe, exactly; slice: as the thesis does it.")
    ] = "rings",
    method: Annotated[str, typer.Option("--method", help="richardson-lucy or matrix.")] = "richardson-lucy",
    stop: Annotated[str | None, typer.Option("--stop", help=f"{', '.join(RULES)}, or a number of iterations.")] = None,
    replicates: Annotated[int, typer.Option("--replicates", help="Scans that error bands are made of.")] = REPLICATES,
    seed: Annotated[int, typer.Option("--seed", help="Of them, and of counts kept back.")] = 1,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Take the instrument out of a scan, and say how the iteration stopped and what it is sure of."""
    how: OperatorName = one_of(operator, ("rings", "slice"), "--operator")
    which: Method = one_of(method, ("richardson-lucy", "matrix"), "--method")
    rule: str | int | None = stop
    if stop is not None:
        rule = int(stop) if stop.isdecimal() else one_of(stop, RULES, "--stop")
    outputs = output or []
    check_outputs(outputs, (".csv", ".png", ".pdf"))
    found = deconvolve_scan(
        read_goniometer_scan(scan),
        read_goniometer_scan(instrument),
        operator=how,
        method=which,
        stop=rule,
        replicates=replicates,
        seed=seed,
    )
    for path in outputs:
        if path.suffix.lower() == ".csv":
            found.save(path)
        else:
            plot_deconvolution(found, path, title=scan.name)
    error = None
    if found.standard_error is not None:
        error = float(found.standard_error[int(np.argmax(found.values))])
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
    told = "" if error is None else f" ± {error:.2g}"
    say(f"stop after {found.iterations} iterations, {found.stop}")
    say(f"peak {found.raw.max():.5g} as measured, {found.peak:.5g}{told} without the instrument")
    say(f"full width at half maximum {found.fwhm:.3f}°, middle at {found.middle:.3f}°")
    say(f"total scatter {before:.6g} before, {after:.6g} after")
    for path in outputs:
        say(f"{path}: written")
