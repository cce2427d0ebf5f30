"""Every sentence of the `.notes` that Python gives is printed by the verb that does the same, and is in its JSON.

The inputs are made to give notes: rays that cannot be used, rays that do not meet the carrier, a total flux that scales
them, light towards the eye, solids that overlap, a far field too coarse for its beam.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import etendue as et
import numpy as np
import pytest
from etendue.cli.verbs import VERBS
from etendue.cli.wording import in_options
from etendue.goniophotometry.far_field import intensity_distribution
from etendue.lightfield.carrier import Surface, parse_surface
from etendue.lightfield.fit_cache import FOLDER_VARIABLE, fit_or_recall
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.luminance.source_report import DISTANCE
from etendue.plot.scene_layout import lay_out_scene
from etendue.quantities.printable import printable
from etendue.scene import compile_scene

from cli.outcome import Run

EYE = ("--observer", "20,30", "--distance", "200", "--size", "9,7", "--pixels", "6,5")
OBSERVER, SCREEN = et.Observer(20, 30, 200), et.Screen(9, 7, 6, 5)
DISK = "disk:radius=1.2,centre=0.3/-0.2"

SCENE = """
name = "two glasses"
[[sources]]
name = "led"
kind = "rays"
file = "led.tm25ray"
[[solids]]
name = "lower"
medium = "PMMA"
at = [0, 0, 4]
shape = { kind = "ball", radius = 3 }
[[solids]]
name = "upper"
medium = "PC"
at = [0.5, 0, 8]
shape = { kind = "ball", radius = 3 }
[[surfaces]]
name = "wall"
at = [9, 0, 5]
toward = [-1, 0, 0.2]
shape = { kind = "rectangle", width = 30, height = 20 }
finish = { kind = "lambertian", reflectance = 0.7 }
[[observers]]
name = "eye"
theta = 20
phi = 30
distance = 200
screen = { width = 9, height = 7, columns = 6, rows = 5 }
"""
DETECTORS = """
[[detectors]]
name = "rcs"
kind = "rays"
at = [0, 0, 15]
shape = { kind = "disk", radius = 20 }
[[detectors]]
name = "far"
kind = "intensity"
c_planes = 4
gamma_step = 30
[[detectors]]
name = "card"
kind = "illuminance"
at = [0, 0, 30]
toward = [0, 0, -1]
width = 40
height = 30
columns = 3
rows = 2
[[detectors]]
name = "events"
kind = "scatter"
[[detectors]]
name = "image"
kind = "image"
observer = "eye"
"""


class Case(NamedTuple):
    """A call of the program, and the notes of what Python gives for it."""

    arguments: tuple[object, ...]
    notes: tuple[str, ...]


def led_rays() -> et.RaySet:
    """A narrow beam; of ten rays one has no flux, direction or place, and one leaves far off the others."""
    rng = np.random.default_rng(3)
    n = 500
    position = np.c_[rng.uniform(-0.5, 1.0, n), rng.uniform(-0.8, 0.4, n), np.zeros(n)]
    direction = rng.normal((0.1, 0.05, 1.0), 0.15, (n, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    position[7::20] += [40.0, -30.0, 2.0]
    return et.RaySet(position, direction, rng.gamma(2.0, 0.01, n))


DIFFUSER = et.bsdf.Gaussian(peak=500.0, sigma=0.015, way="transmitted")


@pytest.fixture(scope="session")
def kept_fields(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for the light fields that the calls fit."""
    return tmp_path_factory.mktemp("kept")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("notes")
    rays = led_rays()
    et.write_rays(place / "led.tm25ray", rays)
    spoil(place / "led.tm25ray", len(rays))
    et.write_rays(place / "plain.tm25ray", rays.subset(300, seed=1))
    kinds = DETECTORS.split("[[detectors]]\n")
    (place / "scene.toml").write_text(SCENE + DETECTORS, encoding="utf-8")
    for name, detector in (("rcs", kinds[1]), ("events", kinds[4])):
        (place / f"{name}.toml").write_text(f"{SCENE}[[detectors]]\n{detector}", encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        spoilt = et.read_rays(place / "led.tm25ray")
        et.LightField.fit(spoilt, "auto", symmetry="auto", depths=(2, 2, 2, 2)).save(place / "led.h5")
        for name, number in (("scene", 20_000), ("events", 20_000), ("rcs", 1000)):
            et.trace(et.Scene.load(place / f"{name}.toml"), number, 2).save(place / f"{name}.result.h5")
        cone = et.luminance_map(spoilt, OBSERVER, SCREEN, method="cone", acceptance=8)
        cone.save(place / "map.npz")
        black = cone.replace(values=np.zeros(cone.values.shape), standard_error=np.zeros(cone.values.shape))
        black.save(place / "black.npz")
        et.write_intensity(place / "led.ies", intensity_distribution(spoilt, 4, 30))
    (place / "diffuser.toml").write_text('kind = "gaussian"\npeak = 500.0\nsigma = 0.015\nway = "transmitted"\n')
    et.ScatterGoniometer(photons=1e5).measure(DIFFUSER, step=0.5, span=5, rays=20_000).save(place / "scan.csv")
    et.ScatterGoniometer().instrument_function(0.55).save(place / "bare.csv")
    return place


def spoil(path: Path, rays: int) -> None:
    """Take the direction of one ray of twenty, and state twice the flux in the header."""
    data = bytearray(path.read_bytes())
    row = np.dtype("<f4").itemsize * 7
    start = len(data) - rays * row
    table = np.frombuffer(data, "<f4", rays * 7, start).reshape(rays, 7)
    table[3::20, 3:6] = np.nan
    header = np.frombuffer(data, "<f4", 1, 12)
    header *= 2.0
    path.write_bytes(data)


def of_rays(rays: et.RaySet) -> tuple[str, ...]:
    """Complaints of a set, its notes among them."""
    return tuple(str(complaint) for complaint in rays.complaints)


# --- the verbs ---------------------------------------------------------------------------------------------------------


def convert(place: Path) -> Iterator[Case]:
    inputs = [place / "led.tm25ray", place / "plain.tm25ray"]
    merged = et.RaySet.merge([et.read_rays(path) for path in inputs])
    losses = et.write_rays("api.dat", merged, "zemax")
    yield Case(("convert", *inputs, "out.dat", "--format", "zemax"), (*of_rays(merged), *losses, *merged.notes))


def fit(place: Path) -> Iterator[Case]:
    rays = et.read_rays(place / "led.tm25ray")
    field = et.LightField.fit(rays, parse_surface(DISK), symmetry="auto", depths=(2, 2, 2, 2))
    call = (
        "fit",
        place / "led.tm25ray",
        "-o",
        "out.h5",
        "--surface",
        DISK,
        "--symmetry",
        "auto",
        "--depths",
        "2,2,2,2",
    )
    yield Case(call, (*field.notes, *of_rays(rays)))


def luminance(place: Path) -> Iterator[Case]:
    rays = et.read_rays(place / "led.tm25ray")

    def case(*arguments: object, notes: Iterable[str]) -> Case:
        return Case(("luminance", *arguments, "-o", "out.exr"), tuple(notes))

    cone = et.luminance_map(rays, OBSERVER, SCREEN, acceptance="auto")
    yield case(
        place / "led.tm25ray", *EYE, "--acceptance", "auto", notes=(*cone.notes, *cone.save("api.exr"), *of_rays(rays))
    )
    smooth = et.luminance_map(rays, OBSERVER, SCREEN, surface=parse_surface(DISK))
    yield case(place / "led.tm25ray", *EYE, "--surface", DISK, notes=smooth.notes)
    field = et.LightField.load(place / "led.h5")
    yield case(place / "led.h5", *EYE, notes=et.luminance_map(field, OBSERVER, SCREEN).notes)
    scene = et.Scene.load(place / "scene.toml")
    seen = et.luminance_map(scene, OBSERVER, SCREEN, rays_per_pixel=32, forward_rays=20_000)
    call = (place / "scene.toml", *EYE, "--rays-per-pixel", 32, "--forward-rays", 20_000)
    yield case(*call, notes=seen.notes)
    events = et.TraceResult.load(place / "events.result.h5").events.only
    yield case(place / "events.result.h5", *EYE, notes=et.luminance_map(events, OBSERVER, SCREEN).notes)
    kept = et.TraceResult.load(place / "rcs.result.h5").rays.only
    shown = et.luminance_map(kept, OBSERVER, SCREEN, acceptance=8)
    assert kept.notes
    yield case(place / "rcs.result.h5", *EYE, "--acceptance", 8, notes=(*shown.notes, *of_rays(kept)))


def sample(place: Path) -> Iterator[Case]:
    field = et.LightField.load(place / "led.h5")
    drawn = field.rays(500, seed=1)
    losses = et.write_rays("api.dis", drawn, "asap")
    yield Case(("sample", place / "led.h5", "-n", 500, "-o", "out.dis"), (*field.notes, *drawn.notes, *losses))


def report(place: Path) -> Iterator[Case]:
    file = place / "led.tm25ray"
    # One view of the four that a report has of itself.
    found = et.report_source(
        file, surface=parse_surface(DISK), observers=[et.Observer(20, 30, DISTANCE)], forecast=False
    )
    call = ("report", file, "--surface", DISK, "--observer", "20,30", "--no-forecast", "-o", "report.html")
    yield Case(call, (*found.notes, *found.complaints))


def intensity(place: Path) -> Iterator[Case]:
    rays = et.read_rays(place / "led.tm25ray")
    far = intensity_distribution(rays, 4, 30)
    assert any("%" in note for note in far.notes)  # too coarse: the table has another flux than its cells
    call = ("intensity", place / "led.tm25ray", "--c-planes", 4, "--gamma-step", 30, "-o", "out.ldt")
    yield Case(call, (*far.notes, *et.write_intensity("api.ldt", far), *of_rays(rays)))
    yield Case(("intensity", place / "led.ies"), et.read_intensity(place / "led.ies").notes)


def detected(result: et.TraceResult) -> Iterator[str]:
    """Notes of a trace and of all that its detectors saw."""
    yield from result.notes
    for kind in (result.rays, result.intensity, result.illuminance, result.events, result.images):
        for found in kind.values():
            yield from found.notes


def trace(place: Path) -> Iterator[Case]:
    result = et.trace(et.Scene.load(place / "scene.toml"), 20_000, 2)
    losses = et.write_rays("api.tm25ray", result.rays.only)
    call = ("trace", place / "scene.toml", "--rays", 20_000, "--seed", 2, "-o", "out.tm25ray")
    yield Case(call, (*detected(result), *losses))


def patches(place: Path) -> Iterator[Case]:
    rays = et.read_rays(place / "led.tm25ray")
    source = GriddedSource.fit(rays, parse_surface(DISK), 0.5, 0.1)
    call = (
        "patches",
        place / "led.tm25ray",
        "--surface",
        DISK,
        "--pixel",
        0.5,
        "--threshold",
        0.1,
        "-o",
        "out.patches",
    )
    yield Case(call, (*source.notes, *of_rays(rays)))


def filter_(place: Path) -> Iterator[Case]:
    noisy = et.read_map(place / "map.npz")
    yield Case(("filter", place / "map.npz", "--kind", "opt", "-o", "out.npz"), et.denoise_map(noisy).notes)
    average = et.filter_map(noisy, "average", size=3)
    yield Case(("filter", place / "map.npz", "--kind", "average", "--size", 3, "-o", "out.npz"), average.notes)


def compare(place: Path) -> Iterator[Case]:
    maps = [et.read_map(place / name) for name in ("map.npz", "black.npz")]
    yield Case(("compare", place / "map.npz", place / "black.npz"), et.compare(*maps).notes)


def info(place: Path) -> Iterator[Case]:
    yield Case(("info", place / "led.tm25ray"), of_rays(et.read_rays(place / "led.tm25ray")))
    yield Case(("info", place / "led.h5"), et.LightField.load(place / "led.h5").notes)
    yield Case(("info", place / "led.ies"), et.read_intensity(place / "led.ies").notes)
    with warnings.catch_warnings(action="ignore"):
        compiled = compile_scene(et.Scene.load(place / "scene.toml"))
    assert compiled.doubts
    yield Case(("info", place / "scene.toml"), compiled.notes)
    yield Case(("info", place / "scene.result.h5"), tuple(detected(et.TraceResult.load(place / "scene.result.h5"))))


def draw(place: Path) -> Iterator[Case]:
    layout = lay_out_scene(et.Scene.load(place / "scene.toml"))
    assert layout.compiled.doubts
    yield Case(("draw", place / "scene.toml"), layout.compiled.notes)


def demo(_: Path) -> Iterator[Case]:
    source = et.RingSource(rays=100_000, seed=1)
    lmap = et.luminance_map(source, et.Observer(0, 0, 150), et.Screen(70, 70, 64, 64), method="cone")
    yield Case(("demo", "--rays", 100_000, "-o", "out.png"), lmap.notes)


def goniometer(place: Path) -> Iterator[Case]:
    scan = et.ScatterGoniometer().measure(DIFFUSER, step=0.5, span=5, rays=20_000)
    call = ("goniometer", place / "diffuser.toml", "--step", 0.5, "--span", 5, "--rays", 20_000, "-o", "out.csv")
    yield Case(call, scan.notes)
    wide = et.ScatterGoniometer().measure_window(DIFFUSER, step=1, span=3, rays=20_000)
    call = ("goniometer", place / "diffuser.toml", "--window", "--step", 1, "--span", 3, "--rays", 20_000)
    yield Case(call, wide.notes)


def deconvolve(place: Path) -> Iterator[Case]:
    scan, bare = (et.read_goniometer_scan(place / name) for name in ("scan.csv", "bare.csv"))
    call = ("deconvolve", place / "scan.csv", "--instrument", place / "bare.csv", "-o", "out.csv")
    yield Case(call, et.deconvolve(scan, bare).notes)
    sample = et.bsdf.Gaussian(peak=200.0, sigma=0.012)
    goniometer = et.ScatterGoniometer(photons=1e6, dark=20)
    wide = goniometer.measure_window(sample, 60, step=1, span=5, outside=20, method="quadrature")
    wide.save(place / "wide.csv")
    found = et.deconvolve_directions(et.read_directional_scan(place / "wide.csv"), stop=5, regular=0.001, replicates=2)
    options = ("--stop", 5, "--regular", 0.001, "--replicates", 2)
    yield Case(("deconvolve", place / "wide.csv", *options, "-o", "out.csv"), found.notes)


def view(place: Path) -> Iterator[Case]:
    field = et.LightField.load(place / "led.h5")
    yield Case(("view", place / "led.h5", "-o", "out.html"), field.notes)
    rays = et.read_rays(place / "led.tm25ray")
    yield Case(("view", place / "led.tm25ray", "-o", "out.html"), (*fit_or_recall(rays).notes, *of_rays(rays)))
    yield Case(("view", place / "map.npz", "-o", "out.html"), et.read_map(place / "map.npz").notes)
    kept = et.TraceResult.load(place / "rcs.result.h5").rays.only
    yield Case(("view", place / "rcs.result.h5", "-o", "out.html"), (*fit_or_recall(kept).notes, *of_rays(kept)))


def goniophotometer(place: Path) -> Iterator[Case]:
    gonio = et.NearFieldGoniophotometer((30, 120), camera_pixels=16, photometer_distance=200)
    measured = gonio.measure(place / "led.h5", samples=4)
    options = ("--positions", "30,120", "--camera-pixels", 16, "--photometer-distance", 200, "--samples", 4)
    outputs = ("-o", "out.tm25ray", "-o", "out.ies", "-n", 100)
    notes = (*measured.notes, *measured.intensity().notes, *measured.ray_set(100).notes)
    yield Case(("goniophotometer", place / "led.h5", *options, *outputs), notes)


def plot(place: Path) -> Iterator[Case]:
    lmap = et.luminance_map(
        et.read_rays(place / "led.tm25ray"), et.Observer(0, 0, 100), et.Screen(2, 2, 8, 8), method="cone"
    )
    lmap.save(place / "for-plot.npz")
    yield Case(("plot", place / "for-plot.npz", "-o", "out.png"), et.read_map(place / "for-plot.npz").notes)


def sweep(place: Path) -> Iterator[Case]:
    heights = {"upper.at.2": [8, 9]}
    options = {"rays": 20_000, "rays_per_pixel": 16, "seed": 2}
    table = et.sweep(place / "scene.toml", heights, ["escaped", "maximum"], OBSERVER, SCREEN, **options)
    call = ("sweep", place / "scene.toml", "--set", "upper.at.2=8,9", "--measure", "escaped,maximum", *EYE)
    yield Case((*call, "--rays", 20_000, "--rays-per-pixel", 16, "--seed", 2), table.notes)


CASES: dict[str, Callable[[Path], Iterator[Case]] | None] = {
    "demo": demo,
    "info": info,
    "convert": convert,
    "fit": fit,
    "luminance": luminance,
    "sample": sample,
    "intensity": intensity,
    "draw": draw,
    "plot": plot,
    "report": report,
    "trace": trace,
    "sweep": sweep,
    "view": view,
    "patches": patches,
    "filter": filter_,
    "compare": compare,
    "goniometer": goniometer,
    "deconvolve": deconvolve,
    "goniophotometer": goniophotometer,
    "cache": None,  # a count of files and their size: nothing that has notes
}
"""Of each verb: what it is called with, and what Python has to say of the same."""


def texts(found: Any) -> Iterator[str]:
    """All texts of a JSON document."""
    if isinstance(found, str):
        yield found
    for part in found.values() if isinstance(found, dict) else found if isinstance(found, list) else ():
        yield from texts(part)


def test_every_verb_is_here() -> None:
    assert set(CASES) == set(VERBS)


@pytest.mark.slow
@pytest.mark.parametrize("verb", [verb for verb in VERBS if CASES.get(verb)])
def test_what_python_knows_is_printed(
    verb: str,
    run: Run,
    folder: Path,
    kept_fields: Path,
    monkeypatch: pytest.MonkeyPatch,
    stand_on: Callable[[Surface], None],
) -> None:
    # The light field of a file is fitted once for all calls.
    monkeypatch.setenv(FOLDER_VARIABLE, str(kept_fields))
    # `led.h5` has the notes of a search for a carrier, all others stand on the disk.
    stand_on(parse_surface(DISK))
    # There are no notes in the solid of intensity on a page.
    solid = {"c": [0, 180], "gamma": [0, 90, 180], "values": [1, 0, 0, 1, 0, 0], "unit": "cd"}
    monkeypatch.setattr("etendue.viewer.subjects.intensity_solid", lambda _: solid)
    # Nor is it asked what the page of a report shows, which takes a second to draw.
    monkeypatch.setattr("etendue.cli.report.plot_report", lambda *_: None)
    call = CASES[verb]
    assert call is not None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cases = list(call(folder))
    for arguments, notes in cases:
        assert notes, f"{arguments}: an input that gives no notes shows nothing"
        plain = run(*arguments)
        assert plain.status == 0, plain.err
        missing = [note for note in notes if in_options(printable(note)) not in plain.out + plain.err]
        assert not missing, f"{arguments} does not print {missing}"
        document = run(*arguments, "--json")
        assert document.status == 0, document.err
        told = "\n".join(texts(json.loads(document.out)))
        missing = [note for note in notes if note not in told]
        assert not missing, f"{arguments} --json does not hold {missing}"


@pytest.mark.slow
def test_observers_of_a_report_look_at_where_the_light_is(run: Run, tmp_path: Path) -> None:
    """A Lambertian square far from the origin has Φ/(π A) cd/m², and is not a dot in a picture of 3 m.

    Some pixel has no less than the mean, whose error is at most that of counting the rays within 7° of the observer.
    """
    rng = np.random.default_rng(4)
    n = 20_000
    cos, phi = np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    sin = np.sqrt(1 - cos**2)
    place = np.stack([1000 + 4 * rng.random(n) - 2, 500 + 4 * rng.random(n) - 2, np.full(n, -300.0)], axis=1)
    rays = et.RaySet(place, np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=1), np.full(n, 100.0 / n))
    et.write_rays(tmp_path / "far.tm25ray", rays)
    args = ("--surface", "plane:z=-300,width=4,height=4,centre=1000/500", "--no-forecast", "--json")
    found = run("report", str(tmp_path / "far.tm25ray"), "-o", str(tmp_path / "far.html"), "--observer", "20,40", *args)
    largest = float(found.json["views"][0]["largest pixel"].split(" ± ")[0])
    error = 1 / np.sqrt(n * np.sin(np.radians(7)) ** 2 * np.cos(np.radians(20)))
    assert largest > 100 / np.pi / 16e-6 * (1 - 3.1 * error)  # one-sided, 0.1 %
