"""``etendue trace``: light from the sources of a scene to its detectors."""

from __future__ import annotations

import functools
import re
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from etendue.cli.guard import require_apart
from etendue.cli.options import Json, Threads
from etendue.cli.terminal import INTERRUPTED, check_folder, complain, count, print_json, progress_bar, say
from etendue.cli.writing import Writing
from etendue.errors import ArgumentError, UnknownNameError
from etendue.formats.intensity import INTENSITY_EXTENSIONS, write_intensity
from etendue.formats.intensity.eulumdat_writer import require_luminous
from etendue.formats.maps import MAP_EXTENSIONS, PICTURE_EXTENSIONS
from etendue.formats.rays import RAY_FORMATS, write_rays
from etendue.plot.intensity_picture import plot_intensity
from etendue.quantities.measured import measured
from etendue.scene import Scene
from etendue.tracing.plan import Plan
from etendue.tracing.result import TraceResult
from etendue.tracing.running import trace_rounds
from etendue.tracing.work import MOST_EVENTS

RESULT_EXTENSIONS = (".h5", ".hdf5")
RAY_EXTENSIONS = tuple(e for f in RAY_FORMATS for e in f.extensions if e not in MAP_EXTENSIONS)

Write = Callable[[TraceResult, str, Path], tuple[str, ...]]


def _rays(result: TraceResult, name: str, path: Path) -> tuple[str, ...]:
    return write_rays(path, result.rays[name])


def _intensity(result: TraceResult, name: str, path: Path) -> tuple[str, ...]:
    if path.suffix.lower() in PICTURE_EXTENSIONS:
        plot_intensity(result.intensity[name], path)
        return ()
    return write_intensity(path, result.intensity[name])


def _illuminance(result: TraceResult, name: str, path: Path) -> tuple[str, ...]:
    return () if _picture(result.illuminance[name].plot, path) else result.illuminance[name].save(path)


def _image(result: TraceResult, name: str, path: Path) -> tuple[str, ...]:
    return () if _picture(result.images[name].plot, path) else result.images[name].save(path)


def _picture(plot: Callable[[Path], Any], path: Path) -> bool:
    if path.suffix.lower() in PICTURE_EXTENSIONS:
        plot(path)
        return True
    return False


OUTPUTS: dict[str, tuple[tuple[str, ...], Write]] = {
    "rays": (RAY_EXTENSIONS, _rays),
    "intensity": ((*INTENSITY_EXTENSIONS, *PICTURE_EXTENSIONS), _intensity),
    "illuminance": ((*(e for e in MAP_EXTENSIONS if e != ".hdr"), *PICTURE_EXTENSIONS), _illuminance),
    "image": ((*MAP_EXTENSIONS, *PICTURE_EXTENSIONS), _image),
}
"""By the kind of detector: extensions of the files that what it saw can be written to, and what writes them."""


def trace(
    file: Annotated[Path, typer.Argument(help="A scene, .toml")],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="Whole result (.h5), or by extension what a detector saw: rays (.tm25ray …), intensity (.ies, .ldt), "
            "illuminance and light images (.exr, .npz …), pictures (.png, .svg, .pdf). {detector} is filled in.",
        ),
    ] = None,
    rays: Annotated[
        int | None,
        typer.Option(
            "--rays",
            help="Rays of all sources, e.g. 1e8 (1e7; of ray files alone: all).",
            parser=count(),
            metavar="NUMBER",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the rays, 0 to 2^64 - 1.", min=0)] = 1,
    until: Annotated[
        float | None,
        typer.Option(
            "--until", help="Stop at this relative error (median over the flux) of every detector, e.g. 0.01."
        ),
    ] = None,
    most_events: Annotated[
        int, typer.Option("--most-events", help="Surfaces that a ray may meet before it is given up.", min=1)
    ] = MOST_EVENTS,
    resume: Annotated[
        Path | None, typer.Option("--resume", help="Result (.h5) of the same scene, rays and seed to go on from.")
    ] = None,
    threads: Threads = None,
    json: Json = False,
) -> None:
    """Trace light through a scene: flux ledger, incident rays, intensity, illuminance. Ctrl-C keeps what was done."""
    outputs = output or []
    for path in outputs:
        check_folder(path)
    scene = Scene.load(file)
    # Mistakes are told before any ray is traced, and the nodes of far fields are chosen by rays.
    _writers(outputs, [(own.name or f"detectors[{i}]", own.DETECTION.KIND) for i, own in enumerate(scene.detectors)])
    started = None if resume is None else TraceResult.load(resume)
    rounds = trace_rounds(scene, rays, seed, until=until, most_events=most_events, threads=threads, resume=started)
    writers = _writers(outputs, [(own.name, own.KIND) for own in rounds.plan.detections])
    require_apart([file, *scene.read_files()], [*outputs, *(path for path, _, _ in writers)])
    if any(path.suffix.lower() == ".ldt" for path in outputs):
        require_luminous(rounds.plan.flux_unit)
    result: TraceResult | None = started
    interrupted = False
    with progress_bar("rays", rounds.plan.rays) as progress:
        try:
            for result in rounds:
                if progress is not None:
                    progress(result.rays_done)
        except KeyboardInterrupt:
            if result is None:
                raise
            interrupted = True
    assert result is not None  # noqa: S101 - there is at least one round
    writing = _written(result, outputs, writers)
    if interrupted:
        complain(f"stopped; what was written is the valid result of {result.rays_done:,} of {result.rays_asked:,} rays")
        complain(_how_to_go_on(outputs))
    elif until is not None and not result.relative_error < until:
        copies = " More of them do not help where they are copies of the rays of a set." if _copied(result.plan) else ""
        complain(f"--until {until:g} was not reached: {result.relative_error:.3g} with all rays of --rays.{copies}")
    if json:
        print_json(
            {
                "file": file,
                **result.to_dict(),
                "outputs": writing.done,
                "losses": writing.losses,
                "interrupted": interrupted,
            }
        )
    else:
        for note in writing.losses:
            complain(f"note: {note}")
        print_result(result)
        for path in writing.done:
            say(f"  {path}")
    writing.finish()
    if interrupted:
        raise typer.Exit(INTERRUPTED)


def _written(result: TraceResult, outputs: list[Path], writers: list[tuple[Path, str, Write]]) -> Writing:
    """The whole result first, then what each detector saw."""
    writing = Writing()
    for path in outputs:
        if path.suffix.lower() in RESULT_EXTENSIONS:
            writing.write(path, result.save)
    for path, name, write in writers:
        writing.write(path, functools.partial(write, result, name))
    return writing


def _copied(plan: Plan) -> bool:
    """Whether a source gives out rays of a set more than once."""
    return plan.dealing.strata > plan.dealing.plain


def _how_to_go_on(outputs: list[Path]) -> str:
    """The command that goes on from what was written, or that there is none."""
    results = [path for path in outputs if path.suffix.lower() in RESULT_EXTENSIONS]
    if not results:
        return "nothing to go on from was written: with -o result.h5 a trace that is stopped can be resumed"
    words = sys.argv[1:]
    kept: list[str] = []
    for i, word in enumerate(words):
        if word != "--resume" and not word.startswith("--resume=") and words[max(i - 1, 0)] != "--resume":
            kept.append(word)
    return f"to go on: {shlex.join(['etendue', *kept, '--resume', str(results[0])])}"


def _writers(outputs: list[Path], detectors: list[tuple[str, str]]) -> list[tuple[Path, str, Write]]:
    """What is to be written where: path, detector, writer; the path with the detector's name filled in.

    Detectors are given by their names and kinds.

    Raises
    ------
    ArgumentError
        If no detector sees what a file would hold, or several do and would write to the same file.
    """
    found: list[tuple[Path, str, Write]] = []
    for path in outputs:
        extension = path.suffix.lower()
        if extension in RESULT_EXTENSIONS:
            continue
        kinds = [kind for kind, (extensions, _) in OUTPUTS.items() if extension in extensions]
        if not kinds:
            known = sorted({e for extensions, _ in OUTPUTS.values() for e in extensions} | set(RESULT_EXTENSIONS))
            raise ArgumentError(f"{path}: the extension {path.suffix!r} is none of the known ones: {', '.join(known)}.")
        fitting = [(name, kind) for name, kind in detectors if kind in kinds]
        if not fitting:
            raise ArgumentError(f"{path}: the scene has no detector of the kind {' or '.join(kinds)}.")
        if len(fitting) > 1 and "{detector}" not in path.name:
            names = ", ".join(name for name, _ in fitting)
            raise ArgumentError(f"{path}: {names} would all be written here; put {{detector}} into its name.")
        found += [(_named(path, name), name, OUTPUTS[kind][1]) for name, kind in fitting]
    _require_apart(found)
    return found


def _require_apart(found: list[tuple[Path, str, Write]]) -> None:
    """Refuse two files of one name: names of detectors that differ only in what no file name holds make such."""
    owners: dict[Path, str] = {}
    for path, name, _ in found:
        first = owners.setdefault(path, name)
        if first != name:
            raise ArgumentError(f"{path}: {first!r} and {name!r} would both be written here; rename one of them.")


def _named(path: Path, detector: str) -> Path:
    def value(match: re.Match[str]) -> str:
        if match[1] != "detector":
            raise UnknownNameError(f"placeholder in the output {path}", match[1], ["detector"])
        # A name may hold anything, a file name may not.
        return re.sub(r"[^\w.+-]+", "-", detector).strip("-") or "detector"

    return path.with_name(re.sub(r"\{(\w*)\}", value, path.name))


def print_result(result: TraceResult) -> None:
    """A trace in figures, for people."""
    say(f"{result.plan.scene_name or 'scene'}: {result.rays_done:,} rays, seed {result.seed}")
    for line in result.ledger.table().splitlines():
        say(f"  {line}")
    for detection in result.plan.detections:
        told = detection.summary(result.quantity_of(detection.name))
        if detection.HAS_WHOLE:
            told = f"flux {measured(*result.flux_of(detection.name), result.plan.flux_unit)}, {told}"
        say(f"  {detection.name}: {told}")
        for note in result.notes_of(detection.name):
            say(f"    {note}")
    for note in result.notes:
        say(f"  {note}")
