"""``etendue info``: what is in a ray, intensity, field, patch, trace, map or scene file, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from etendue.cli.terminal import complain, complain_of, print_json, progress_bar, say
from etendue.errors import ArgumentError, EtendueError, SceneError

if TYPE_CHECKING:
    from etendue.quantities.intensity import Intensity


class Found(NamedTuple):
    """What a file holds: as plain data, and for people."""

    facts: dict[str, Any]
    show: Callable[[], None]


def info(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Ray and intensity files of any format, light fields, patches, results of traces, maps, scenes, STEP "
            "files."
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
            facts = {"file": str(file), "error": str(reason)}
            described.append(
                Found(facts, partial(complain_of, error)) if isinstance(error, SceneError) else _plainly(facts)
            )
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
    # Whoever asks for one kind of file does not wait until the parts of all others are imported.
    if path.is_dir():
        patches = _patches(path)
        if patches is not None:
            return patches
    elif photometry is None and _holds_binary_rays(path):
        return _plainly(describe(path))
    from etendue.formats.intensity import detect_intensity_format, read_intensity

    if detect_intensity_format(path) is not None:
        return _intensity(path, read_intensity(path, photometry))
    if photometry is not None:
        raise ArgumentError(f"{path}: --photometry is for intensity files, and this is none.")
    for look in _looks(path):
        found = look(path)
        if found is not None:
            return found
    return _plainly(describe(path))


def _holds_binary_rays(path: Path) -> bool:
    """Whether it is of a binary format of rays: told without the parts of anything else. A pipe is left unread."""
    from etendue.formats.head import Head
    from etendue.formats.input import is_stream

    if is_stream(path):
        return False
    head = Head.of(path)
    if head.is_text:
        return False
    from etendue.formats.rays import RAY_FORMATS

    return any(candidate.recognise(head) for candidate in RAY_FORMATS)


def _looks(path: Path) -> Iterator[Callable[[Path], Found | None]]:
    """The looks that are worth it: by the first bytes, so that nobody waits for the parts of other files to be imported."""
    from etendue.formats.hdf5 import SIGNATURE
    from etendue.formats.head import STEP_SIGNATURE, Head
    from etendue.formats.own_kind import SCENE, own_kind

    head = Head.of(path)
    if head.data.startswith(SIGNATURE):
        yield from (_light_field, _trace_result)
    if own_kind(head) is SCENE:
        yield _scene
    yield _map
    if head.data.lstrip().startswith(STEP_SIGNATURE):
        yield _bodies


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
        say(f"{path}: {len(patches.patches):,} patches on {patches.surface.surface.told}")
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


def _scene(path: Path) -> Found:
    from etendue.cli.scenes import describe_scene, print_scene
    from etendue.scene import Scene, compile_scene

    scene = Scene.load(path)
    compiled = compile_scene(scene)
    facts = describe_scene(scene, compiled)
    what = f"scene {scene.name!r}" if scene.name else "scene"
    return _found(path, "scene", what, facts, lambda: print_scene(facts, compiled.doubts))


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
    from etendue.formats.rays import read_rays
    from etendue.formats.rays.facts import ray_facts

    rays = read_rays(path)
    with progress_bar(path.name, len(rays)) as progress:
        return ray_facts(rays, path, progress)


def _print(facts: dict[str, Any]) -> None:
    if "error" in facts:
        complain(
            f"error: {facts['error']}"
            if facts["file"] in facts["error"]
            else f"error: {facts['file']}: {facts['error']}"
        )
        return
    from etendue.formats.rays.facts import fact_rows

    say(f"{facts['file']}")
    for label, value in fact_rows(facts):
        say(f"  {label:<22} {value}")
    if not facts["complaint_lines"]:
        say(f"  {'complaints':<22} none")
    for number, line in enumerate(facts["complaint_lines"]):
        say(f"  {'complaints' if number == 0 else '':<22} {line}")
