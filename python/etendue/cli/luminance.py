"""``etendue luminance``: what the source looks like from where an observer stands."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.convert import in_unit, with_flux
from etendue.cli.detectors import check_detector
from etendue.cli.field import complaints_of, read_source, surface_option
from etendue.cli.maps import check_regions, parsed_regions, print_map, summary, write_map
from etendue.cli.options import Flux, Json, Regions, Threads, Unit
from etendue.cli.orbit import alike, around, moving_outputs
from etendue.cli.stated import refuse, refuse_without_picture
from etendue.cli.terminal import (
    angles,
    both_sides,
    check_outputs,
    complain,
    count,
    numbers,
    one_of,
    print_json,
    progress_bar,
    say,
    whole_numbers,
)
from etendue.errors import ArgumentError, UnknownNameError
from etendue.formats.maps import MAP_EXTENSIONS, PICTURE_EXTENSIONS
from etendue.formats.patch_folder import is_patch_folder
from etendue.lightfield.light_field import LightField
from etendue.luminance.estimate import Acceptance, luminance_map
from etendue.luminance.framing import centre_of_light, framed_screens, probe
from etendue.luminance.method_choice import Spelling, choose_method, mismatch
from etendue.luminance.methods import METHOD_NAMES, AnyMethod, PathTracing
from etendue.luminance.opening import SCENE_EXTENSION, open_source
from etendue.luminance.regions import AnyRegion
from etendue.luminance.source_kinds import kind_of_source
from etendue.plot.animation import plot_animation
from etendue.plot.colour_scale import SCALES
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import PLANES, Observer, Screen
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress
from etendue.scene import Scene
from etendue.scene.scatter_events import ScatterEvents
from etendue.tracing.result import TraceResult
from etendue.tracing.storage import is_result_file

Source = RaySet | LightField | Scene | ScatterEvents

SPELLING = Spelling(option=lambda name: f"--{name.replace('_', '-')}", method=lambda kind: f"--method {kind.NAME}")

DISTANCE, PIXELS = 1000.0, "128,128"
"""Of observers and screens that are stated on the command line, unless they say otherwise [mm; columns, rows]."""


def luminance(
    file: Annotated[
        Path,
        typer.Argument(
            help="A ray file of any format, an index of rays, a light field, a scene (.toml), or the result of a trace."
        ),
    ],
    output: Annotated[
        list[Path],
        typer.Option(
            "-o",
            "--output",
            help="Map to write, or with --orbit a moving picture; several are allowed. {theta}, {phi} and {observer} are "
            "filled in.",
        ),
    ],
    observer: Annotated[
        list[str] | None,
        typer.Option(
            "--observer",
            help="Direction θ,φ of the observer in degrees; may be given several times. "
            "Of a scene, its own observers if not given.",
            metavar="THETA,PHI",
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(
            "--size", help="Width and height of the screen in mm; framed to what is seen if not given.", metavar="W,H"
        ),
    ] = None,
    orbit: Annotated[
        int | None,
        typer.Option(
            "--orbit",
            help="Go around: so many observers at the θ of --observer, from its φ on in even steps over 360°, "
            "+Z upright unless --up says what is. For moving pictures (.gif, .mp4, .html), on one scale; "
            "or a file each with {phi}.",
            metavar="NUMBER",
            show_default=False,
        ),
    ] = None,
    distance: Annotated[float, typer.Option("--distance", help="Distance from target to observer in mm.")] = DISTANCE,
    target: Annotated[
        str | None,
        typer.Option(
            "--target",
            help="Point looked at, in mm (0,0,0; of rays and light fields without --size, where the light is).",
            metavar="X,Y,Z",
            show_default=False,
        ),
    ] = None,
    up: Annotated[
        str | None,
        typer.Option("--up", help="Direction that stands upright in the picture, e.g. 0,0,1.", metavar="X,Y,Z"),
    ] = None,
    roll: Annotated[float, typer.Option("--roll", help="Tilt of the observer's head to its left in °.")] = 0.0,
    region: Regions = None,
    pixels: Annotated[str, typer.Option("--pixels", help="Columns and rows of the map.", metavar="C,R")] = PIXELS,
    plane: Annotated[
        str, typer.Option("--plane", help="Plane of the screen: view (facing the observer) or xy (fixed).")
    ] = "view",
    method: Annotated[
        str,
        typer.Option(
            "--method",
            help="auto, cone, lightfield or pathtracing; auto: the one that has the options, or suits the file.",
        ),
    ] = "auto",
    acceptance: Annotated[
        str | None,
        typer.Option(
            "--acceptance",
            help="Half-angle of the cone in degrees (1.5), or auto: the one of least error.",
            show_default=False,
        ),
    ] = None,
    observer_radius: Annotated[
        float | None,
        typer.Option(
            "--observer-radius",
            help="For the cone: the observer is a disk of this radius in mm that faces the target.",
            show_default=False,
        ),
    ] = None,
    surface: Annotated[
        str | None,
        typer.Option("--surface", help="Carrier surface of the light field, as for fit (auto).", show_default=False),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            "--samples", help="Points per pixel at which a light field is read (16).", min=1, show_default=False
        ),
    ] = None,
    rays_per_pixel: Annotated[
        int | None,
        typer.Option(
            "--rays-per-pixel",
            help="Lines of sight per pixel of a scene (256); of scatter events, for what they leave out (none).",
            parser=count(),
            metavar="NUMBER",
            show_default=False,
        ),
    ] = None,
    until: Annotated[
        float | None,
        typer.Option(
            "--until",
            help="Of a scene: follow more lines of sight until this error, weighted by flux, is reached, e.g. 0.01.",
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option("--seed", help="Of a scene: seed of the lines of sight (1).", min=0, show_default=False),
    ] = None,
    forward_rays: Annotated[
        float | None,
        typer.Option(
            "--forward-rays",
            help="Of a scene: rays traced forwards besides, for caustics and beams (as many as they need); 0: none, and "
            "no search for small bright places of walls.",
            min=0,
            show_default=False,
        ),
    ] = None,
    gather: Annotated[
        bool | None,
        typer.Option(
            "--gather/--no-gather",
            help="Of a scene: lines of sight end at the second diffuse surface, whose light is found first (if a pilot "
            "finds it better).",
            show_default=False,
        ),
    ] = None,
    detector: Annotated[
        str | None,
        typer.Option(
            "--detector", help="Of the result of a trace: the detector whose scatter events or rays are shown."
        ),
    ] = None,
    flux: Flux = None,
    unit: Unit = None,
    scale: Annotated[
        str, typer.Option("--scale", help="Colours of a picture: auto, linear or log; auto: what its values ask for.")
    ] = "auto",
    cache: Annotated[
        bool, typer.Option("--cache/--no-cache", help="Take light fields from those fitted before (etendue cache).")
    ] = True,
    threads: Threads = None,
    json: Json = False,
) -> None:
    """Luminance maps with a standard error per pixel, from rays, a light field, a scene or a trace, for many observers."""
    method, plane = one_of(method, METHOD_NAMES, "--method"), one_of(plane, PLANES, "--plane")
    colours, regions = one_of(scale, SCALES, "--scale"), parsed_regions(region, output)
    refuse_without_picture(output, "scale")
    stated = {
        "acceptance": None if acceptance is None else _acceptance(acceptance),
        "observer_radius": observer_radius,
        "surface": None if surface is None else surface_option(surface),
        "samples": samples,
        "rays_per_pixel": rays_per_pixel,
        "until": until,
        "seed": seed,
        "forward_rays": forward_rays,
        "gather": gather,
    }
    is_scene = file.suffix.lower() == SCENE_EXTENSION or is_patch_folder(file)
    scene = opened if is_scene and isinstance(opened := open_source(file), Scene) else None
    detected = _detected(file, detector)
    looked = detected if isinstance(detected, ScatterEvents) else scene
    own = looked.scene if isinstance(looked, ScatterEvents) else scene
    own_observers = own is not None and observer is None and size is None and orbit is None
    if own is not None and own_observers:
        who = _observers_of(own, file)
        why = f"for an observer that is stated with --observer; those of {file} have their own"
        refuse(("distance", "target", "up", "roll", "pixels", "plane"), why)
    else:
        upright = None if up is None else _three(up, "--up", "0,0,1")
        who = [("", Observer(theta, phi, distance, up=upright, roll=roll)) for theta, phi in angles(observer)]
    if orbit is not None:
        who = [("", one) for one in around([one for _, one in who], orbit)]
    moving, single = moving_outputs(output, orbit)
    targets = _targets(single, who)
    if looked is None:
        source: Source = (
            in_unit(with_flux(detected, flux), unit) if isinstance(detected, RaySet) else read_source(file, flux, unit)
        )
    else:
        what = "holds scatter events" if isinstance(looked, ScatterEvents) else "is a scene"
        _refuse({"--flux": flux, "--unit": unit}, f"for rays and light fields; {file} {what}")
        source = looked
    how = _method(source, method, stated)
    observers = [one for _, one in who]
    if own is not None and own_observers:
        screens = [keys.screen.screen() for keys in own.observers]
    else:
        framed = source if isinstance(source, RaySet | LightField) else own
        observers, screens = _views(framed, observers, target, size, pixels, plane)
        screens = screens if orbit is None else alike(screens)
    check_regions(regions, screens)
    with _progress(source, screens, how) as progress:
        maps = luminance_map(
            source,
            observers,
            screens,
            method="auto" if how is None else how,
            cache=cache,
            threads=threads,
            progress=progress,
        )
    written = zip(maps, targets, strict=True)
    losses = [note for lmap, paths in written for note in write_map(lmap, paths, colours, regions)]
    for path in moving:
        plot_animation(maps, path, colours)
    complaints = complaints_of(source) if isinstance(source, RaySet) else []
    if json:
        summaries = [summary(lmap, regions) | {"outputs": paths} for lmap, paths in zip(maps, targets, strict=True)]
        found = {"file": file, "maps": summaries, "complaints": complaints, "notes": losses}
        print_json(found | ({"moving": moving} if moving else {}))
        return
    for line in (*complaints, *(f"note: {note}" for note in losses)):
        complain(line)
    _print_maps(maps, targets, regions, together=orbit is not None)
    for path in moving:
        say(str(path))


def _print_maps(
    maps: Sequence[LuminanceMap], targets: list[list[Path]], regions: list[AnyRegion], *, together: bool
) -> None:
    """Each map with its files and its notes, or the notes of all together, each once."""
    for lmap, paths in zip(maps, targets, strict=True):
        print_map(lmap, regions, notes=not together)
        for path in paths:
            say(f"  {path}")
    for note in dict.fromkeys(note for lmap in maps for note in lmap.notes) if together else ():
        say(note)


def _detected(file: Path, detector: str | None) -> ScatterEvents | RaySet | None:
    """What a detector of a trace collected that can be looked at; None if the file is no result of a trace.

    Raises
    ------
    UnknownNameError, ArgumentError
        If there is no such detector, or several and none is named.
    """
    # A file that is missing is told when it is read.
    if not (file.is_file() and is_result_file(file)):
        _refuse({"--detector": detector}, f"for results of traces; {file} is none")
        return None
    result = TraceResult.load(file)
    found: dict[str, ScatterEvents | RaySet] = {**result.events, **result.rays}
    if detector is not None:
        check_detector(result, detector, found, "scatter events or rays")
        return found[detector]
    if len(found) != 1:
        have = (
            f"{len(found)} detectors keep what can be looked at ({', '.join(found)})" if found else "no detector keeps"
        )
        wish = "name one by --detector" if found else "scatter events or rays: add one of the kind scatter or rays"
        raise ArgumentError(f"{file}: {have}{'; ' if found else ' '}{wish}.")
    return next(iter(found.values()))


def _method(source: Source, method: str, options: Mapping[str, object]) -> AnyMethod | None:
    """The method with those of its options that are stated.

    Raises
    ------
    typer.BadParameter
        If options, method and file do not go together.
    """
    stated = {name: value for name, value in options.items() if value is not None}
    kind = kind_of_source(source)
    complaint = mismatch(method, stated, kind, SPELLING)
    if complaint is not None:
        raise typer.BadParameter(complaint)
    return choose_method(method, stated, kind)


def _progress(source: Source, screens: list[Screen], how: AnyMethod | None) -> AbstractContextManager[Progress | None]:
    """A progress bar of what there is to do for maps."""
    if isinstance(how, PathTracing):
        pixels = sum(screen.columns * screen.rows for screen in screens)
        return progress_bar("lines of sight", how.rays_per_pixel * pixels)
    if isinstance(source, ScatterEvents):
        return progress_bar("scatter events", len(source) * len(screens))
    return progress_bar("rays", len(source)) if isinstance(source, RaySet) else nullcontext()


def _targets(output: list[Path], who: list[tuple[str, Observer]]) -> list[list[Path]]:
    """The files of each map, which can be written.

    Raises
    ------
    ArgumentError
        If an output is stated twice, maps of several observers would be written to the same file, or one cannot be written.
    """
    targets = [[_named(path, observer, name) for path in output] for name, observer in who]
    everything = [path for paths in targets for path in paths]
    if len(set(output)) < len(output):
        twice = next(path for number, path in enumerate(output) if path in output[:number])
        raise ArgumentError(f"{twice} is stated twice as an output.")
    if len(set(everything)) < len(everything):
        raise ArgumentError(
            "several observers would write to the same file; put {theta} and {phi}, or {observer}, into its name."
        )
    check_outputs(everything, (*MAP_EXTENSIONS, *PICTURE_EXTENSIONS))
    return targets


def _views(
    source: Scene | RaySet | LightField | None,
    observers: list[Observer],
    target: str | None,
    size: str | None,
    pixels: str,
    plane: str,
) -> tuple[list[Observer], list[Screen]]:
    """Observers of the target with their screens: of the stated size, or framed to what each sees of the source."""
    columns, rows = whole_numbers(both_sides(pixels), 2, "--pixels", "128,128")
    to_frame = size is None and plane == "view"
    if target is not None:
        x, y, z = _three(target, "--target", "0,0,0")
    elif to_frame and isinstance(source, RaySet | LightField):
        x, y, z = centre_of_light(probe(source))
    else:
        x, y, z = 0.0, 0.0, 0.0
    observers = [dataclasses.replace(observer, target=(x, y, z)) for observer in observers]
    if to_frame and source is not None:
        return observers, framed_screens(source, observers, columns, rows)
    if size is None:
        raise typer.BadParameter("give the screen's width and height in mm, e.g. --size 25,25", param_hint="--size")
    # One number is a square.
    width, height = numbers(both_sides(size), 2, "--size", "25,25")
    return observers, [Screen(width, height, columns, rows, "xy" if plane == "xy" else "view")] * len(observers)


def _three(text: str, option: str, example: str) -> tuple[float, float, float]:
    x, y, z = numbers(text, 3, option, example)
    return x, y, z


def _observers_of(scene: Scene, file: Path) -> list[tuple[str, Observer]]:
    """Those that a scene has, with their names."""
    if not scene.observers:
        raise ArgumentError(f"{file}: the scene has no observers; give --observer and --size.")
    return [(keys.name, keys.observer()) for keys in scene.observers]


def _refuse(options: Mapping[str, object], why: str) -> None:
    needless = [option for option, value in options.items() if value is not None]
    if needless:
        raise typer.BadParameter(f"{', '.join(needless)}: {why}")


def _acceptance(text: str) -> Acceptance:
    """The half-angle that an option states, or "auto"."""
    return "auto" if text.strip() == "auto" else numbers(text, 1, "--acceptance", "1.5, or --acceptance auto")[0]


def _named(path: Path, observer: Observer, name: str) -> Path:
    angles = {"theta": f"{observer.theta:g}", "phi": f"{observer.phi:g}"}
    # A name may hold anything, a file name may not.
    angles["observer"] = re.sub(r"[^\w.+-]+", "-", name) or f"{angles['theta']}-{angles['phi']}"

    def value(match: re.Match[str]) -> str:
        if match[1] not in angles:
            raise UnknownNameError(f"placeholder in the output {path}", match[1], angles)
        return angles[match[1]]

    return Path(re.sub(r"\{(\w*)\}", value, str(path)))
