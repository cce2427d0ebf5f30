"""The command line on scenes: every verb gives the numbers of the API, and an interruption leaves a valid result."""

from __future__ import annotations

import itertools
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.cli import trace as trace_verb
from etendue.scene import compile_scene
from etendue.scene.framing import framed_screen
from etendue.tracing.running import Rounds

from cli.outcome import Run

SCENE: dict[str, Any] = {
    "name": "lamp",
    "sources": [{"name": "led", "kind": "surface", "shape": {"kind": "rectangle", "width": 2, "height": 1}, "flux": 90}],
    "surfaces": [{"name": "wall", "shape": {"kind": "rectangle", "width": 30, "height": 20}, "at": [9, 0, 5],
                  "toward": [-1, 0, 0.2], "finish": {"kind": "lambertian", "reflectance": 0.7}}],
    "detectors": [
        {"name": "rcs", "kind": "rays", "shape": {"kind": "disk", "radius": 20}, "at": [0, 0, 15]},
        {"name": "far", "kind": "intensity", "c_planes": 6, "gamma_step": 30},
        {"name": "work top/2", "kind": "illuminance", "width": 40, "height": 30, "columns": 3, "rows": 2, "at": [0, 0, 30],
         "toward": [0, 0, -1]},
    ],
    "observers": [
        {"name": "left eye", "theta": 40, "phi": 10, "distance": 100,
         "screen": {"width": 20, "height": 20, "columns": 5, "rows": 4}},
        {"name": "right", "theta": 40, "phi": 20, "distance": 100,
         "screen": {"width": 20, "height": 20, "columns": 5, "rows": 4}},
    ],
}  # fmt: skip


@pytest.fixture(autouse=True)
def lamp(tmp_path: Path) -> None:
    """The scene, in the folder that the program works in."""
    et.Scene(**SCENE).save(tmp_path / "lamp.toml")


@pytest.mark.slow
def test_trace_is_the_trace_of_the_api(run: Run, tmp_path: Path) -> None:
    outputs = ["r.h5", "rcs.tm25ray", "far.ies", "top.npz", "{detector}.png"]
    status, out, _ = run(
        "trace", "lamp.toml", "--rays", "1e5", "--seed", "3", "--json", *itertools.chain(*(["-o", o] for o in outputs))
    )
    assert status == 0
    result = et.trace(et.Scene(**SCENE), 1e5, 3)
    facts = json.loads(out)
    assert facts["ledger"] == result.ledger.to_dict()
    assert facts["rays_done"] == 100_000
    assert set(facts["outputs"]) == {"r.h5", "rcs.tm25ray", "far.ies", "top.npz", "far.png", "work-top-2.png"}
    assert all((tmp_path / name).exists() for name in facts["outputs"])
    assert et.TraceResult.load(tmp_path / "r.h5").ledger == result.ledger
    top = et.read_illuminance_map(tmp_path / "top.npz")
    np.testing.assert_array_equal(top.values, result.illuminance.only.values)
    told = {detector["kind"]: detector for detector in facts["detectors"]}
    assert told["illuminance"]["mean"] == top.mean
    assert told["illuminance"]["maximum"] == top.values.max()
    assert told["illuminance"]["maximum_error"] == top.standard_error[top.values == top.values.max()][0]
    assert told["rays"]["flux"] == pytest.approx(result.rays.only.total_flux, rel=1e-12)
    assert len(et.read_rays(tmp_path / "rcs.tm25ray")) == len(result.rays.only)
    assert et.read_intensity(tmp_path / "far.ies").maximum == pytest.approx(result.intensity.only.maximum, rel=1e-4)


def test_trace_says_what_became_of_the_light(run: Run) -> None:
    status, out, _ = run("trace", "lamp.toml", "--rays", "20000")
    assert status == 0
    for text in ("lamp: 20,000 rays", "emitted", "led", "wall", "escaped", "rcs:", "far:", "work top/2:"):
        assert text in out


def test_copies_of_rays_are_told(run: Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    lamp = et.RaySet(rng.random((200, 3)), rng.normal(size=(200, 3)) * 0.2 + [0, 0, 1], np.ones(200))
    et.write_rays(tmp_path / "led.ray", lamp, format="zemax")
    (tmp_path / "few.toml").write_text('[[sources]]\nname = "led"\nkind = "rays"\nfile = "led.ray"\n', encoding="utf-8")
    _, traced, _ = run("trace", "few.toml", "--rays", "20000", "-o", "few.h5")
    _, told, _ = run("info", "few.h5")
    for out in (traced, told):
        assert "led: 20,000 rays are copies of 200 rays of the set, as good as 200 equal rays" in out
    assert run("info", "few.h5", "--json").json[0]["effective_rays"] == pytest.approx(200)


def test_an_error_that_was_not_reached_is_told(run: Run, tmp_path: Path) -> None:
    """A set of 200 rays given out 100 times each is no surer than the 200 are."""
    rng = np.random.default_rng(1)
    lamp = et.RaySet(rng.random((200, 3)), rng.normal(size=(200, 3)) * 0.2 + [0, 0, 1], np.ones(200))
    et.write_rays(tmp_path / "led.ray", lamp, format="zemax")
    source = '[[sources]]\nkind = "rays"\nfile = "led.ray"\n[[detectors]]\nkind = "intensity"\n'
    (tmp_path / "few.toml").write_text(source, encoding="utf-8")
    _, _, err = run("trace", "few.toml", "--rays", "20000", "--until", "0.001")
    assert "--until 0.001 was not reached: " in err
    assert "copies of the rays of a set" in err
    _, _, err = run("trace", "few.toml", "--rays", "20000", "--until", "0.9")
    assert "--until" not in err


@pytest.mark.slow
def test_an_interruption_leaves_a_valid_result(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("running", "work"):  # rounds of 65,536 rays
        monkeypatch.setattr(f"etendue.tracing.{module}.BATCHES", 1)

    def interrupted(*arguments: Any, **options: Any) -> Any:
        rounds = et.trace_rounds(*arguments, **options)

        class Interrupted(Rounds):
            def __init__(self) -> None:
                self.plan = rounds.plan
                self._inner: Iterator[et.TraceResult] = itertools.islice(rounds, 2)

            def __next__(self) -> et.TraceResult:
                for result in self._inner:
                    return result
                raise KeyboardInterrupt

        return Interrupted()

    with monkeypatch.context() as patch:
        patch.setattr(trace_verb, "trace_rounds", interrupted)
        status, out, err = run("trace", "lamp.toml", "--rays", "1.5e5", "-o", "part.h5", "-o", "top.csv")
    assert status == 130
    assert "valid result" in err
    part = et.TraceResult.load(tmp_path / "part.h5")
    assert part.rays_done == 2 << 16
    assert part.ledger.closes
    assert et.read_illuminance_map(tmp_path / "top.csv").mean == part.illuminance.only.mean
    assert "were traced" in out
    status, _, _ = run("trace", "lamp.toml", "--resume", "part.h5", "-o", "whole.h5")
    assert status == 0
    whole = et.TraceResult.load(tmp_path / "whole.h5")
    assert whole.complete
    assert whole.ledger == et.trace(et.Scene(**SCENE), 1.5e5).ledger


@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [
        (["--rays", "many"], 2, "whole number"),
        (["--rays", "1.5"], 2, "whole number"),
        (["-o", "a.xyz"], 1, ".xyz"),
        (["-o", "no/a.h5"], 1, "does not exist"),
        (["-o", "both.png"], 1, "{detector}"),
        (["-o", "{detctor}.png"], 1, "{detector}"),
        (["-o", "picture.hdr"], 1, "no detector of the kind image"),
        (["--until", "0"], 1, "until"),
        (["--sed", "1"], 2, "--seed"),
    ],
)
def test_mistakes_are_found_before_any_ray_is_traced(
    arguments: list[str], status: int, text: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Rounds, "__next__", lambda _: pytest.fail("it began to trace"))
    monkeypatch.setattr("etendue.tracing.work.far_field_nodes", lambda *_: pytest.fail("it began to look around"))
    before = set(tmp_path.iterdir())
    found, out, err = run("trace", "lamp.toml", *arguments)
    assert found == status
    assert text in out + err
    assert set(tmp_path.iterdir()) == before


def test_detectors_of_like_names_do_not_write_to_one_file(run: Run, tmp_path: Path) -> None:
    """What a file name cannot hold becomes a dash, so that two names of a scene may become one."""
    twin = {**SCENE["detectors"][2], "name": "work-top-2"}
    et.Scene(**{**SCENE, "detectors": [*SCENE["detectors"], twin]}).save(tmp_path / "lamp.toml")
    status, _, err = run("trace", "lamp.toml", "--rays", "1000", "-o", "{detector}.npz")
    assert status == 1
    assert "'work top/2' and 'work-top-2' would both be written here" in err
    assert not (tmp_path / "work-top-2.npz").exists()


def test_luminance_of_the_observers_of_a_scene(run: Run, tmp_path: Path) -> None:
    status, out, _ = run(
        "luminance", "lamp.toml", "--rays-per-pixel", "16", "--seed", "2", "-o", "{observer}.npz", "--json"
    )
    assert status == 0
    maps = et.luminance_map(et.Scene(**SCENE), rays_per_pixel=16, seed=2)
    for name, lmap in zip(("left-eye", "right"), maps, strict=True):
        np.testing.assert_array_equal(et.read_map(tmp_path / f"{name}.npz").values, lmap.values)
    assert [m["outputs"] for m in json.loads(out)["maps"]] == [["left-eye.npz"], ["right.npz"]]


def test_luminance_of_a_scene_for_another_observer(run: Run, tmp_path: Path) -> None:
    view = ["--observer", "30,5", "--distance", "90", "--size", "10,8", "--pixels", "5,4"]
    status, _, _ = run("luminance", "lamp.toml", *view, "--rays-per-pixel", "16", "--until", "0.2", "-o", "a.npz")
    assert status == 0
    expected = et.luminance_map(
        et.Scene(**SCENE), et.Observer(30, 5, 90), et.Screen(10, 8, 5, 4), rays_per_pixel=16, until=0.2
    )
    np.testing.assert_array_equal(et.read_map(tmp_path / "a.npz").values, expected.values)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["lamp.toml", "--samples", "3", "-o", "{observer}.npz"], "--samples"),
        (["lamp.toml", "--pixels", "5,5", "--roll", "5", "-o", "{observer}.npz"], "--roll, --pixels: for an observer"),
        (["lamp.toml", "--distance", "5", "-o", "{observer}.npz"], "--distance"),
        (["lamp.toml", "--target", "0,0,1", "--up", "0,1,0", "-o", "{observer}.npz"], "--target, --up"),
        (["lamp.toml", "--plane", "xy", "-o", "{observer}.npz"], "--plane"),
        (["lamp.toml", "--method", "cone", "-o", "{observer}.npz"], "--method"),
        (["lamp.toml", "--unit", "W", "-o", "{observer}.npz"], "--unit"),
        (["lamp.toml", "--observer", "3,4", "--plane", "xy", "-o", "a.npz"], "--size"),
        (["lamp.toml", "--size", "3,4", "-o", "a.npz"], "--observer"),
        (["other.ray", "--observer", "0,0", "--size", "3,4", "--until", "0.1", "-o", "a.npz"], "--until"),
        (["other.ray", "--size", "3,4", "-o", "a.npz"], "--observer"),
    ],
)
def test_options_that_do_not_apply_are_refused(arguments: list[str], text: str, run: Run) -> None:
    et.write_rays(
        "other.ray", et.RaySet(np.zeros((2, 3)), np.array([[0.1, 0.2, 1.0], [0.0, 0.1, 1.0]]), np.ones(2)), "lighttools"
    )
    status, out, err = run("luminance", *arguments)
    assert status == 2
    assert text in out + err


def test_a_scene_is_framed_without_a_size(run: Run, tmp_path: Path) -> None:
    options = ["--observer", "3,4", "--pixels", "9,5", "--rays-per-pixel", "4"]
    status, _, err = run("luminance", "lamp.toml", *options, "-o", str(tmp_path / "a.npz"))
    assert status == 0, err
    lmap = et.read_map(tmp_path / "a.npz")
    assert lmap.screen == framed_screen(compile_scene(et.Scene.load("lamp.toml")), et.Observer(3, 4, 1000), 9, 5)


def test_several_observers_do_not_write_to_one_file(run: Run) -> None:
    status, _, err = run("luminance", "lamp.toml", "-o", "a.npz")
    assert status == 1
    assert "{observer}" in err


# --- looking at the result of a trace --------------------------------------------------------------------------------


KEEPERS = [{"name": "scatter", "kind": "scatter"}, {"name": "few", "kind": "scatter", "most": 500}]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The lamp with two recorders of scattered light, traced."""
    path = tmp_path_factory.mktemp("traced") / "r.h5"
    et.trace(et.Scene(**{**SCENE, "detectors": [*SCENE["detectors"], *KEEPERS]}), 50_000, 3).save(path)
    return path


@pytest.fixture
def traced(result: Path, tmp_path: Path) -> et.TraceResult:
    """The same in the folder that the program works in."""
    shutil.copy(result, tmp_path / "r.h5")
    return et.TraceResult.load(tmp_path / "r.h5")


def test_how_many_scatter_events_are_kept_is_told(run: Run, tmp_path: Path) -> None:
    et.Scene(**{**SCENE, "detectors": KEEPERS}).save(tmp_path / "lamp.toml")
    outcome = run("trace", "lamp.toml", "--rays", "50000", "--seed", "3")
    assert outcome.status == 0
    assert "scatter events, of 1 ray in" in outcome.out


VIEW = ["--observer", "60,190", "--distance", "90", "--target", "9,0,5", "--size", "10,8", "--pixels", "5,4"]
EYE, GRID = et.Observer(60, 190, 90, target=(9, 0, 5)), et.Screen(10, 8, 5, 4)


def test_luminance_of_scatter_events(run: Run, traced: et.TraceResult, tmp_path: Path) -> None:
    status, out, _ = run("luminance", "r.h5", "--detector", "scatter", *VIEW, "-o", "a.npz", "--json")
    assert status == 0
    expected = et.luminance_map(traced.events["scatter"], EYE, GRID)
    assert expected.values.min() > 0
    np.testing.assert_array_equal(et.read_map(tmp_path / "a.npz").values, expected.values)
    assert any("scatter events" in note for note in json.loads(out)["maps"][0]["notes"])
    # From the scene's own observers, with what lines of sight find besides.
    options = ["--detector", "scatter", "--rays-per-pixel", "16", "--seed", "4"]
    assert run("luminance", "r.h5", *options, "-o", "{observer}.npz")[0] == 0
    maps = et.luminance_map(traced.events["scatter"], rays_per_pixel=16, seed=4)
    for name, lmap in zip(("left-eye", "right"), maps, strict=True):
        np.testing.assert_array_equal(et.read_map(tmp_path / f"{name}.npz").values, lmap.values)


def test_luminance_of_collected_rays(run: Run, traced: et.TraceResult, tmp_path: Path) -> None:
    options = ["--detector", "rcs", "--acceptance", "5", "--flux", "45"]
    assert (
        run("luminance", "r.h5", *options, "--observer", "0,0", "--size", "30,30", "--pixels", "4,4", "-o", "a.npz")[0]
        == 0
    )
    rays = traced.rays["rcs"]
    expected = et.luminance_map(rays, et.Observer(0, 0, 1000), et.Screen(30, 30, 4, 4), acceptance=5)
    np.testing.assert_allclose(
        et.read_map(tmp_path / "a.npz").values, expected.values * 45 / rays.total_flux, rtol=1e-9
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [
        (["r.h5", *VIEW], 1, "3 detectors keep what can be looked at (scatter, few, rcs)"),
        (["r.h5", *VIEW, "--detector", "sctter"], 1, "Did you mean 'scatter'"),
        (["r.h5", *VIEW, "--detector", "far"], 1, "far: it is of the kind intensity"),
        (["r.h5", *VIEW, "--detector", "scatter", "--acceptance", "3"], 2, "--acceptance"),
        (["r.h5", *VIEW, "--detector", "scatter", "--flux", "3"], 2, "--flux"),
        (["r.h5", *VIEW, "--detector", "scatter", "--until", "0.1"], 2, "give --rays-per-pixel too"),
        (["r.h5", *VIEW, "--detector", "scatter", "--forward-rays", "1e5"], 2, "--forward-rays: scatter events are"),
        (["r.h5", *VIEW, "--detector", "rcs", "--rays-per-pixel", "16"], 2, "--rays-per-pixel"),
        (["lamp.toml", "--detector", "scatter"], 2, "--detector"),
    ],
)
@pytest.mark.usefixtures("traced")
def test_what_cannot_be_looked_at_is_told(arguments: list[str], status: int, text: str, run: Run) -> None:
    found, out, err = run("luminance", *arguments, "-o", "{observer}.npz")
    assert found == status
    assert text in " ".join((out + err).split())


def test_a_result_without_anything_to_look_at(run: Run, tmp_path: Path) -> None:
    et.trace(et.Scene(sources=SCENE["sources"]), 1000).save(tmp_path / "bare.h5")
    status, _, err = run("luminance", "bare.h5", *VIEW, "-o", "a.npz")
    assert status == 1
    assert "add one of the kind scatter or rays" in err


def test_info_on_a_scene(run: Run) -> None:
    """All that stands in it, the flux of its sources and what is doubtful: what its keys say."""
    keys = SCENE | {
        "name": "two glasses",
        "sources": [*SCENE["sources"],
                    {"name": "target", "kind": "rings", "radii": [1, 2], "flux": [3, 7], "at": [0, 0, -9]}],
        "solids": [{"name": name, "shape": {"kind": "ball", "radius": 2}, "at": [0, 0, z], "medium": "BK7"}
                   for name, z in (("lower", 8), ("upper", 10))],
    }  # fmt: skip
    et.Scene(**keys).save("two.toml")
    outcome = run("info", "two.toml", "--json")
    assert outcome.status == 0
    (facts,) = outcome.json
    assert (facts["format"], facts["scene"], facts["bytes"]) == (
        "scene",
        "two glasses",
        Path("two.toml").stat().st_size,
    )
    assert [(s["name"], s["kind"], s["flux"]) for s in facts["sources"]] == [
        ("led", "surface", 90), ("target.ring 1", "rings", 3), ("target.ring 2", "rings", 7),
    ]  # fmt: skip
    assert (facts["flux"], facts["flux_unit"]) == (100, "lm")
    assert facts["solids"] == [{"name": name, "kind": "ball", "medium": "BK7"} for name in ("lower", "upper")]
    assert facts["surfaces"] == [{"name": "wall", "kind": "rectangle", "finish": "lambertian"}]
    assert [(d["name"], d["kind"]) for d in facts["detectors"]] == [(d["name"], d["kind"]) for d in SCENE["detectors"]]
    assert facts["observers"][0] == {"name": "left eye", "theta": 40, "phi": 10, "distance": 100, "pixels": [5, 4]}
    assert any("overlap" in note for note in facts["notes"])
    told = run("info", "two.toml")
    for text in (
        "scene 'two glasses'",
        "flux       100 lm",
        "led (surface, 90 lm)",
        "upper (ball, BK7)",
        "work top/2",
        "5 × 4",
    ):
        assert text in told.out
    assert "overlap" in told.err
    Path("wrong.toml").write_text('[[sources]]\nkind = "pint"\n', encoding="utf-8")
    wrong = run("info", "wrong.toml")
    assert wrong.status == 1
    assert "Did you mean 'point'" in wrong.err


def test_info_on_a_result(run: Run, traced: et.TraceResult) -> None:
    status, out, _ = run("info", "r.h5")
    assert status == 0
    for text in (
        "result of a trace",
        "lamp: 50,000 rays",
        "emitted",
        f"scatter: {len(traced.events['scatter']):,} scatter",
    ):
        assert text in out
    (facts,) = json.loads(run("info", "r.h5", "--json")[1])
    assert facts["format"] == "trace result"
    assert facts["ledger"] == traced.ledger.to_dict()
    kept = {d["name"]: d for d in facts["detectors"]}
    assert kept["few"]["events"] == len(traced.events["few"])
    assert kept["few"]["share_of_rays"] == traced.events["few"].share < 1
