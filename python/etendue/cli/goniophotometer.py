"""``etendue goniophotometer``: a virtual near-field measurement of a lamp, and ray files, tables and pictures from it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from etendue.cli.options import Json, Threads, ray_format
from etendue.cli.stated import refuse
from etendue.cli.terminal import check_folder, complain, count, numbers, print_json, progress_bar, say
from etendue.cli.writing import Writing
from etendue.errors import ArgumentError
from etendue.formats.intensity import INTENSITY_EXTENSIONS, write_intensity
from etendue.formats.maps import PICTURE_EXTENSIONS
from etendue.formats.rays import RAY_FORMATS, write_rays
from etendue.instruments.near_field.goniophotometer import NearFieldGoniophotometer
from etendue.instruments.near_field.run import NearFieldRun
from etendue.instruments.near_field.storage import is_run_file
from etendue.lightfield.carrier import Surface, parse_surface
from etendue.plot import plot_near_field
from etendue.quantities.measured import measured

RUN_EXTENSIONS = (".h5", ".hdf5")
CLOSEST = "closest"

SETTINGS = (
    "positions", "distance", "photometer_distance", "centre", "field_of_view", "camera_pixels", "exposures",
    "exposure_ratio", "level", "bits", "full_well", "read_noise", "threshold", "blur", "exposure_error",
    "photometer_error", "arm_error", "misalignment", "samples",
)  # fmt: skip
"""Options that say how a lamp is measured."""


def goniophotometer(
    lamp: Annotated[
        Path, typer.Argument(help="A light field, a ray file or a scene; or a measurement that this verb wrote.")
    ],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="What to write, by its extension: a ray file, .ies or .ldt of the photometer, a picture, or .h5 of "
            "everything; repeatable.",
        ),
    ] = None,
    rays: Annotated[
        int,
        typer.Option(
            "-n", "--rays", help="Rays of the ray files to be written, e.g. 1e7.", parser=count(), metavar="NUMBER"
        ),
    ] = 10**6,
    format: Annotated[
        str | None,
        typer.Option("--format", help="Format of the ray files; from the extension of the output if not given."),
    ] = None,
    surface: Annotated[
        str, typer.Option("--surface", help="Where rays start: closest, sphere, box, cylinder:radius=2 …")
    ] = CLOSEST,
    positions: Annotated[
        str, typer.Option("--positions", help="Step between positions in °, of γ and C, or of both: 5 or 5,10.")
    ] = "5",
    distance: Annotated[
        float | None,
        typer.Option(
            "--distance",
            help="Distance of camera and photometer from the centre in mm; 15 sizes of the lamp if left out.",
        ),
    ] = None,
    photometer_distance: Annotated[
        float | None,
        typer.Option(
            "--photometer-distance", help="Distance of the photometer in mm, if it is another than the camera's."
        ),
    ] = None,
    centre: Annotated[
        str | None,
        typer.Option("--centre", help="Point about which the arm turns: X,Y,Z in mm; the lamp's middle if left out."),
    ] = None,
    field_of_view: Annotated[
        float | None, typer.Option("--field-of-view", help="Side of the image in mm; just the lamp if left out.")
    ] = None,
    camera_pixels: Annotated[int, typer.Option("--camera-pixels", help="Pixels along each side of the image.")] = 512,
    exposures: Annotated[int, typer.Option("--exposures", help="Exposures at each position.")] = 1,
    exposure_ratio: Annotated[
        float, typer.Option("--exposure-ratio", help="Ratio of each exposure time to the one before, which is shorter.")
    ] = 10.0,
    level: Annotated[
        float,
        typer.Option(
            "--level", help="Signal of the brightest pixel in the shortest exposure, as a share of full scale."
        ),
    ] = 0.9,
    bits: Annotated[
        int, typer.Option("--bits", help="Bits of the camera's analogue-to-digital converter, 4 to 16.")
    ] = 12,
    full_well: Annotated[float, typer.Option("--full-well", help="Electrons of a pixel at full scale.")] = 20_000.0,
    read_noise: Annotated[float, typer.Option("--read-noise", help="Read noise of a pixel in electrons.")] = 10.0,
    threshold: Annotated[
        float,
        typer.Option(
            "--threshold", help="Signal below which a pixel counts as dark, in standard deviations of its noise."
        ),
    ] = 5.0,
    blur: Annotated[float, typer.Option("--blur", help="Width of the image of a point in pixels.")] = 0.0,
    exposure_error: Annotated[
        float, typer.Option("--exposure-error", help="Standard deviation of the exposure times, as a share.")
    ] = 0.0,
    photometer_error: Annotated[
        float, typer.Option("--photometer-error", help="Standard deviation of each illuminance, as a share.")
    ] = 0.0,
    arm_error: Annotated[
        float, typer.Option("--arm-error", help="Standard deviation of γ and C of each position in °.")
    ] = 0.0,
    misalignment: Annotated[
        str, typer.Option("--misalignment", help="By how much the lamp stands beside its place: X,Y,Z in mm.")
    ] = "0,0,0",
    samples: Annotated[
        int | None,
        typer.Option("--samples", help="Lines of sight per pixel; if left out, 65 536 in each image, 4 at least."),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of noise, errors and rays.", min=0)] = 1,
    threads: Threads = None,
    json: Json = False,
) -> None:
    """Measure a lamp with a virtual near-field goniophotometer: images and illuminances from all around."""
    outputs = output or []
    if format is not None:
        ray_format(format)
    for path in outputs:
        _check(path, format)
    if all(_kind(path, format) != "rays" for path in outputs):
        refuse(("rays", "format", "surface"), "for ray files, and none is written; add one, e.g. -o lamp.tm25ray")
    if exposures == 1:
        refuse(["exposure_ratio"], "for --exposures 2 or more, of which each is longer than the one before")
    at = CLOSEST if surface == CLOSEST else parse_surface(surface)
    gonio = NearFieldGoniophotometer(
        _steps(positions),
        distance,
        camera_pixels=camera_pixels,
        exposures=exposures,
        field_of_view=field_of_view,
        centre=None if centre is None else _triple(centre, "--centre"),
        photometer_distance=photometer_distance,
        photometer_error=photometer_error,
        bits=bits,
        full_well=full_well,
        read_noise=read_noise,
        blur=blur,
        exposure_ratio=exposure_ratio,
        level=level,
        exposure_error=exposure_error,
        threshold=threshold,
        misalignment=_triple(misalignment, "--misalignment"),
        arm_error=arm_error,
    )
    run = _measured_before(lamp)
    if run is not None:
        refuse(SETTINGS, f"{lamp} was measured before; such settings are for a lamp that is measured")
    else:
        with progress_bar("positions", len(gonio.positions)) as progress:
            told = None if progress is None else lambda done, _: progress(done)
            run = gonio.measure(lamp, seed=seed, samples=samples, threads=threads, progress=told)
    notes = dict.fromkeys(run.notes)
    writing = Writing()

    def write(path: Path) -> None:
        notes.update(dict.fromkeys(_write(run, path, rays, format, at, seed)))

    for path in outputs:
        writing.write(path, write)
    facts = _facts(run) | {"lamp": lamp, "outputs": writing.done, "notes": list(notes)}
    if json:
        print_json(facts)
    else:
        for note in notes:
            complain(f"note: {note}")
        _tell(run)
        for path in writing.done:
            say(f"{path}: written")
    writing.finish()


def _steps(text: str) -> float | tuple[float, float]:
    if "," not in text:
        return numbers(text, 1, "--positions", "5")[0]
    gamma, c = numbers(text, 2, "--positions", "5,10")
    return gamma, c


def _triple(text: str, option: str) -> tuple[float, float, float]:
    x, y, z = numbers(text, 3, option, "0,0,1.5")
    return x, y, z


def _kind(path: Path, format: str | None = None) -> str | None:
    extension = path.suffix.lower()
    if extension in RUN_EXTENSIONS:
        return "run"
    if extension in PICTURE_EXTENSIONS:
        return "picture"
    if extension in INTENSITY_EXTENSIONS:
        return "intensity"
    if format is not None or sum(extension in f.extensions for f in RAY_FORMATS) == 1:
        return "rays"
    return None


def _check(path: Path, format: str | None) -> None:
    """Refuse, before any work is done, an output of which nobody could tell what it shall be."""
    if _kind(path, format) is None:
        known = {e for f in RAY_FORMATS for e in f.extensions if _kind(Path("x" + e)) == "rays"}
        raise ArgumentError(
            f"{path}: the extension {path.suffix!r} is none of rays ({', '.join(sorted(known))}), intensity "
            f"({', '.join(INTENSITY_EXTENSIONS)}), "
            f"pictures ({', '.join(PICTURE_EXTENSIONS)}) or a whole measurement (.h5); give "
            "--format for rays in a file of another name."
        )
    check_folder(path)


def _measured_before(path: Path) -> NearFieldRun | None:
    return NearFieldRun.load(path) if path.is_file() and is_run_file(path) else None


def _write(
    run: NearFieldRun, path: Path, rays: int, format: str | None, surface: Surface | str, seed: int
) -> list[str]:
    """Write one output; what is to be said of it."""
    match _kind(path, format):
        case "run":
            run.save(path)
        case "picture":
            plot_near_field(run, path)
        case "intensity":
            table = run.intensity()
            return [*table.notes, *(f"{path}: {note}" for note in write_intensity(path, table))]
        case _:
            with progress_bar("rays", rays) as progress:
                found = run.ray_set(
                    rays, surface=surface if isinstance(surface, Surface) else "closest", seed=seed, progress=progress
                )
            lost = [note for note in write_rays(path, found, format) if note not in found.notes]
            return [*found.notes, *(f"{path}: {note}" for note in lost)]
    return []


def _facts(run: NearFieldRun) -> dict[str, Any]:
    setting = run.setting
    return {
        "positions": len(setting.positions),
        "distance": setting.distance,
        "photometer_distance": setting.photometer_distance,
        "field_of_view": setting.field_of_view,
        "centre": setting.centre,
        "lit_pixels": run.lit_pixels,
        "saturated_pixels": run.saturated,
        "total_flux": run.total_flux,
        "total_flux_error": run.total_flux_error,
        "flux_unit": run.flux_unit,
        "disagreement": run.disagreement,
        "luminance_of_a_count": run.scale,
        "dynamic_range": setting.camera.dynamic_range,
    }


def _tell(run: NearFieldRun) -> None:
    setting = run.setting
    pixel = setting.field_of_view / setting.camera.pixels
    say(
        f"{len(setting.positions):,} positions {setting.distance:g} mm from the centre, images of "
        f"{setting.field_of_view:g} mm, pixels of {pixel:.3g} mm"
    )
    say(f"total flux {measured(run.total_flux, run.total_flux_error, run.flux_unit)} by the photometer")
    say(
        f"{run.lit_pixels:,} lit pixels; dynamic range {setting.camera.dynamic_range:,.0f} : 1; the images put "
        f"{run.disagreement:.2%} of the flux elsewhere than the photometer"
    )
