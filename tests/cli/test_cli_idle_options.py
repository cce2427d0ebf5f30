"""Options that would change nothing, or that contradict each other, are refused before anything is worked out."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.cli import luminance as luminance_verb
from etendue.cli import plot as plot_verb

from cli.outcome import Run


def a_map(*, factor: float = 1.0) -> et.LuminanceMap:
    values = factor * (10.0 + 10.0 * np.arange(16.0).reshape(4, 4))
    return et.LuminanceMap(values, 0.1 * values, np.full((4, 4), 100), et.Observer(30, 0, 1000), et.Screen(8, 8, 4, 4))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A file of each kind that is quickly made."""
    a_map().save(tmp_path / "dim.npz")
    a_map(factor=2.0).save(tmp_path / "bright.npz")
    values = a_map().values
    desk = et.IlluminanceMap(values, 0.1 * values, np.full((4, 4), 100), et.Screen(8, 8, 4, 4, "xy"))
    desk.save(tmp_path / "desk.npz")
    table = et.Intensity([0.0, 90.0], np.linspace(0, 90, 10), [[1000.0 - 10 * k for k in range(10)]] * 2)
    et.write_intensity(tmp_path / "lamp.ies", table)
    et.write_rays(tmp_path / "lamp.tm25ray", et.RingSource(rays=2000, seed=1).ray_set())
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}
    et.Scene(name="lamp", sources=[lamp]).save(tmp_path / "scene.toml")
    directions = "theta_i,phi_i,theta_s,phi_s,bsdf\n"
    rows = "".join(f"0,0,{theta},0,0.3\n" for theta in range(0, 85, 5))
    (tmp_path / "scan.csv").write_text(directions + rows, encoding="utf-8")
    (tmp_path / "paint.toml").write_text('kind = "lambertian"\nreflectance = 0.5\n', encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("--region 1,2", "LEFT,RIGHT,BOTTOM,TOP"),
        ("--region 5,1,2,3", "left must be below"),
        ("--size 10 --region 20,30,1,2", "no pixel centre lies in it"),
        ("--region 200,300,1,2", "no pixel centre lies in it"),
        ("--size 10" + " --region -5,5,-5,5" * 10 + " -o a.png", "10 regions"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_a_bad_region_is_told_before_the_map_is_worked_out(
    run: Run, monkeypatch: pytest.MonkeyPatch, words: str, told: str
) -> None:
    monkeypatch.setattr(luminance_verb, "luminance_map", lambda *_, **__: pytest.fail("a map was worked out"))
    outcome = run("luminance", "lamp.tm25ray", "--observer", "0,0", *words.split(), "-o", "a.npz")
    assert outcome.status == 1
    assert told in outcome.err
    assert not Path("a.npz").exists()


@pytest.mark.usefixtures("folder")
def test_a_region_beside_the_screen_of_one_map_of_several_leaves_no_picture(run: Run) -> None:
    a_map().replace(screen=et.Screen(2, 2, 4, 4)).save("small.npz")
    outcome = run("plot", "dim.npz", "small.npz", "-o", "{name}.png", "--region", "2,4,2,4")
    assert outcome.status == 1
    assert "no pixel centre lies in it" in outcome.err
    assert not list(Path().glob("*.png"))


@pytest.mark.usefixtures("folder")
def test_a_map_is_kept_where_its_picture_is_refused(run: Run) -> None:
    """Only the map tells that no ray came into the region, in a corner beside the rings of radius 30 mm."""
    words = ("--observer", "0,0", "--size", "80", "--pixels", "8", "--method", "cone", "--region", "30,40,30,40")
    outcome = run("luminance", "lamp.tm25ray", *words, "-o", "a.png", "-o", "a.npz")
    assert outcome.status == 1
    assert "dead" in outcome.err
    assert et.read_map("a.npz").values.shape == (8, 8)


@pytest.mark.usefixtures("folder")
def test_regions_of_illuminance_in_figures(run: Run) -> None:
    """Left upper quarter: 10, 20, 50, 60 lx; each ± 10 %: the root of 1 + 4 + 25 + 36, over 4, is 2.03."""
    outcome = run("plot", "desk.npz", "-o", "a.svg", "--region", "-4,0,0,4")
    assert outcome.status == 0, outcome.err
    assert "region 1: mean 35.0 ± 2.0 lx, minimum 10 lx, maximum 60 lx, minimum over mean 0.286" in outcome.out
    # 136 px·lx·4 mm² = 5.44 mlm; least over mean 10 / 85.
    assert "mean 85 lx, least/mean 0.118, flux 0.00544 lm" in outcome.out


@pytest.mark.usefixtures("folder")
def test_log_is_the_scale_log(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []
    monkeypatch.setattr(plot_verb, "plot_map", lambda *given, **_: drawn.append(given[2]))
    for words in ((), ("--log",), ("--scale", "log"), ("--log", "--scale", "log"), ("--scale", "linear")):
        assert run("plot", "dim.npz", "-o", "a.png", *words).status == 0
    assert drawn == ["auto", "log", "log", "log", "linear"]


IDLE = {
    "plot dim.npz -o a.png --log --scale linear": "--scale linear",
    "plot dim.npz -o a.png --log --scale auto": "--scale auto",
    "plot dim.npz desk.npz -o {name}.png --per-klm": "--per-klm",
    **{
        f"plot lamp.ies -o a.png {words}": words.split()[0]
        for words in ("--log", "--scale linear", "--vmin 1", "--vmax 1", "--show value", "--region 0,1,0,1")
    },
    "compare dim.npz bright.npz --difference sigma": "--difference",
    "compare dim.npz bright.npz --difference maximum": "--difference",
    "compare dim.npz bright.npz --scale log": "--scale",
    "filter dim.npz --kind opt --size 3 -o a.npz": "--size",
    "filter dim.npz --kind opt --gamma 0.1 -o a.npz": "--gamma",
    "filter dim.npz --kind average --gamma 0.2 -o a.npz": "--gamma",
    "filter dim.npz --kind average --scale log -o a.npz": "--scale",
    "luminance lamp.tm25ray --observer 0,0 --scale log -o a.npz": "--scale",
    "convert lamp.tm25ray less.tm25ray --seed 2": "--seed",
    "intensity lamp.ies --kind cartesian": "--kind",
    "intensity lamp.ies --per-klm -o a.ldt": "--per-klm",
    "draw scene.toml --title lamp": "--title",
    "view dim.npz -o a.html --no-browser": "--no-browser",
    "view dim.npz -o a.html --port 80": "--port",
    "view dim.npz -o a.html --seed 2": "--seed",
    "view dim.npz -o a.html --rays 100": "--rays",
    "patches lamp.tm25ray -o patches --seed 2": "--seed",
    "sweep scene.toml --set sources[0].flux=1,2 --measure escaped --target 0,0,1": "--target",
    "sweep scene.toml --set sources[0].flux=1,2 --measure escaped --pixels 4": "--pixels",
    "sweep scene.toml --set sources[0].flux=1,2 --measure escaped --observer 0,0": "--observer",
    "sweep scene.toml --set sources[0].flux=1,2 --measure escaped --rays-per-pixel 16": "--rays-per-pixel",
    "sweep scene.toml --set sources[0].flux=1,2 --measure intensity --observer 0,0 --rays 100": "--rays",
    "goniometer --no-sample --incidence 30": "--incidence",
    "goniometer --no-sample --way reflected": "--way",
    "goniometer --no-sample --plane cross-plane": "--plane",
    "goniometer --no-sample --rays 1000": "--rays",
    "goniometer paint.toml --method quadrature --rays 1000": "--rays",
    "goniometer paint.toml --method quadrature --fresh": "--fresh",
    "goniophotometer scene.toml --rays 1000": "--rays",
    "goniophotometer scene.toml --format zemax -o a.h5": "--format",
    "goniophotometer scene.toml --surface box -o a.ies": "--surface",
    "goniophotometer scene.toml --exposure-ratio 4": "--exposure-ratio",
    "bsdf fit scan.csv -o a.xml --blank lamp.ies": "--blank",
    "bsdf fit scan.csv -o a.xml --incident-flux lamp.ies": "--incident-flux",
    "bsdf fit scan.csv -o a.xml --solid-angle 0.1": "--solid-angle",
}
"""By the call, what the answer names."""


@pytest.mark.parametrize("call", IDLE)
def test_what_would_change_nothing_is_refused(run: Run, folder: Path, call: str) -> None:
    before = sorted(folder.rglob("*"))
    outcome = run(*call.split())
    assert outcome.status == 2
    assert IDLE[call] in outcome.err
    assert "Traceback" not in outcome.err
    assert sorted(folder.rglob("*")) == before


USED = (
    "compare dim.npz bright.npz --scale log --section-x 0 --section-output a.png",
    "compare dim.npz bright.npz --difference sigma -o a.png",
    "filter dim.npz --kind selective --size 3 --gamma 0.1 -o a.npz",
    "luminance lamp.tm25ray --observer 0,0 --method cone --pixels 4 --scale log -o a.png",
    "convert lamp.tm25ray less.tm25ray --subset 10 --seed 2",
    "intensity lamp.ies --kind cartesian -o a.svg",
    "draw scene.toml --title lamp --rays 3 -o a.svg",
    "sweep scene.toml --set sources[0].flux=1,2 --measure escaped --rays 100 --seed 2",
    "goniometer --no-sample --rays 1000 --fresh --step 5",
    "goniometer paint.toml --method quadrature --step 20 --incidence 30 --plane cross-plane",
)


@pytest.mark.slow
@pytest.mark.parametrize("call", USED)
@pytest.mark.usefixtures("folder")
def test_what_changes_something_is_taken(run: Run, call: str) -> None:
    outcome = run(*call.split())
    assert outcome.status == 0, outcome.err


@pytest.mark.usefixtures("folder")
def test_a_scan_that_tells_its_instrument_takes_no_other(run: Run) -> None:
    """Beam, aperture and distance stand in its file, so that a scan of the bare beam would say less; nor do ways mix."""
    goniometer = et.ScatterGoniometer(photons=1e6)
    sample = et.bsdf.ABg(a=0.003, b=1e-4, g=2.2)
    goniometer.measure_window(sample, 45, step=1.5, span=6, method="quadrature").save("window.csv")
    goniometer.instrument_function().save("bare.csv")
    for words, told in (
        ("--instrument bare.csv", "--instrument"),
        ("--models abg", "--models"),
        ("--method parametric --stop 10", "--stop"),
        ("--method matrix --replicates 5", "--replicates"),
    ):
        outcome = run("deconvolve", "window.csv", *words.split(), "-o", "a.csv")
        assert outcome.status == 2, outcome.err
        assert told in outcome.err
        assert not Path("a.csv").exists()


@pytest.fixture(scope="module")
def traced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trace with a desk that measures illuminance, rays that are kept, and a far field."""
    desk = {"kind": "illuminance", "width": 10, "height": 10, "columns": 2, "rows": 2, "at": [0, 0, 100]}
    detectors = [
        {"name": "desk", "toward": [0, 0, -1], **desk},
        {"name": "far", "kind": "intensity"},
        {"name": "kept", "kind": "rays", "shape": {"kind": "sphere", "radius": 50}},
    ]
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}
    path = tmp_path_factory.mktemp("traced") / "result.h5"
    et.trace(et.Scene(sources=[lamp], detectors=detectors), rays=500).save(path)
    return path


@pytest.mark.parametrize(
    ("verb", "detector", "told"),
    [
        ("luminance", "kpet", ("Did you mean 'kept'", "Known: desk, far, kept")),
        ("luminance", "window", ("unknown detector 'window'", "Known: desk, far, kept")),
        ("luminance", "desk", ("desk: it is of the kind illuminance", "scatter events or rays", "kept")),
        ("view", "dsk", ("Did you mean 'desk'", "Known: desk, far, kept")),
        ("view", "far", ("far: it is of the kind intensity", "map or rays", "desk, kept")),
    ],
)
def test_a_detector_that_there_is_not(run: Run, traced: Path, verb: str, detector: str, told: tuple[str, ...]) -> None:
    look = ("--observer", "0,0", "-o", "a.npz") if verb == "luminance" else ("-o", "a.html")
    outcome = run(verb, traced, "--detector", detector, *look)
    assert outcome.status == 1
    assert all(words in outcome.err for words in told), outcome.err


@pytest.mark.usefixtures("folder")
def test_a_detector_of_a_trace_without_any(run: Run) -> None:
    et.trace(et.Scene.load("scene.toml"), rays=100).save("bare.h5")
    outcome = run("luminance", "bare.h5", "--observer", "0,0", "--detector", "desk", "-o", "a.npz")
    assert outcome.status == 1
    assert "has no detectors" in outcome.err
