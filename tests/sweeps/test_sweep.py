"""Sweeps against closed forms, against single calls, and against other seeds."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.luminance import scene_map
from etendue.sweeps.measures import NOUNS
from oracles.verdicts import LARGEST_Z, REVERSE, SIGNIFICANCE, assert_agree
from scipy.stats import chi2, norm

DIE: dict[str, Any] = {"name": "die", "kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}
SCREEN: dict[str, Any] = {
    "name": "screen",
    "shape": {"kind": "disk", "radius": 2},
    "at": [0, 0, 3],
    "finish": "absorber",
}
DESK: dict[str, Any] = {
    "name": "desk",
    "kind": "illuminance",
    "width": 6,
    "height": 4,
    "columns": 3,
    "rows": 2,
    "at": [0.5, 0, 3],
    "toward": [0, 0, -1],
}
EYE = et.Observer(0, 0, 1000)


def disks(near: float, far: float, distance: float) -> float:
    """Share of the light of a Lambertian disk that meets a parallel coaxial one: the view factor in closed form."""
    a, b = near / distance, far / distance
    s = 1.0 + (1.0 + b * b) / (a * a)
    return 0.5 * (s - math.sqrt(s * s - 4.0 * (far / near) ** 2))


# --- against closed forms ----------------------------------------------------------------------------------------------


def test_light_on_a_disk_is_the_view_factor_at_every_distance() -> None:
    """Each value has another seed, so that all are independent."""
    places = np.linspace(0.3, 1.8, 100)
    bare = et.Scene(sources=[DIE], surfaces=[SCREEN])
    tables = [et.sweep(bare, {"screen.at.2": [z]}, "absorbed:screen", rays=3000, seed=k) for k, z in enumerate(places)]
    values, errors = (
        np.concatenate([table[part] if part else table.standard_error["absorbed:screen"] for table in tables])
        for part in ("absorbed:screen", "")
    )
    truth = np.array([100.0 * disks(1.0, 2.0, z) for z in places])
    assert_agree(values=values, expected=truth, standard_error=errors)


def test_all_steps_of_one_sweep_hold_over_two_parameters() -> None:
    places, radii = [1.0, 2.0, 4.0], [0.5, 1.5]
    bare = et.Scene(sources=[DIE], surfaces=[SCREEN])
    measures = ["absorbed:screen", "escaped", "efficiency", "emitted"]
    table = et.sweep(bare, {"screen.at.2": places, "die.shape.radius": radii}, measures, rays=50_000)
    truth = np.array([[100.0 * disks(radius, 2.0, z) for radius in radii] for z in places])
    # The seed is that of all steps, so that they are not independent: each is judged at its part of the significance.
    limit = float(norm.isf(SIGNIFICANCE / 2 / truth.size))
    for name, expected in {
        "absorbed:screen": truth,
        "escaped": 100.0 - truth,
        "efficiency": 1.0 - truth / 100.0,
    }.items():
        assert np.abs((table[name] - expected) / table.standard_error[name]).max() < limit
    assert table["emitted"] == pytest.approx(np.full((3, 2), 100.0), rel=1e-12)
    assert not table.standard_error["emitted"].any()
    assert (table.unit("escaped"), table.unit("efficiency"), table.unit("screen.at.2")) == ("lm", "", "mm")


def test_a_white_wall_absorbs_the_geometric_series() -> None:
    """A sphere with a port of the share f, lit from its middle: (1 − f)(1 − ρ) / (1 − ρ (1 − f))."""
    wall = {
        "name": "wall",
        "shape": {"kind": "sphere", "radius": 10},
        "trim": {"z": [-10, 6]},
        "finish": "white",
    }
    ball = et.Scene(
        sources=[{"kind": "point", "flux": 50}],
        surfaces=[wall],
        finishes={"white": {"kind": "lambertian", "reflectance": 0.5}},
    )
    port, shares = 0.2, np.array([0.0, 0.5, 0.8, 0.95])
    table = et.sweep(ball, {"white.reflectance": shares}, ["absorbed:wall", "absorbed", "escaped"], rays=40_000)
    truth = 50.0 * (1.0 - port) * (1.0 - shares) / (1.0 - shares * (1.0 - port))
    limit = float(norm.isf(SIGNIFICANCE / 2 / truth.size))
    assert np.abs((table["absorbed:wall"] - truth) / table.standard_error["absorbed:wall"]).max() < limit
    np.testing.assert_array_equal(table["absorbed"], table["absorbed:wall"])
    assert table["escaped"] + table["absorbed"] == pytest.approx(50.0, rel=1e-9)


def test_a_lens_is_brightest_with_the_die_in_its_focus() -> None:
    """A plane and a conic with k = −n² have one sharp focus; there the lens is filled with the luminance of the die."""
    index, curvature, radius, side = 1.49, 15.0, 8.0, 1.0
    focus = curvature / (index - 1.0)
    lens = {
        "name": "lens",
        "medium": "clear",
        "shape": {
            "kind": "lens",
            "radius": radius,
            "thickness": 4,
            "front": {"radius_of_curvature": curvature, "conic": -(index**2)},
        },
        "finishes": {"edge": "absorber"},
    }
    die = {"kind": "surface", "shape": {"kind": "rectangle", "width": side, "height": side}, "flux": 100}
    scene = et.Scene(media={"clear": {"index": index}}, sources=[die], solids=[lens])
    # From so far away that it is no matter where the lens stands.
    eye = et.Observer(0, 0, 1e7)
    places = focus + np.array([-20.0, -10.0, 0.0, 10.0])
    table = et.sweep(scene, {"lens.at.2": places}, "intensity", eye, et.Screen(17, 17, 17, 17), rays_per_pixel=16)
    assert table.best("intensity") == {"lens.at.2": focus}
    area, normal = math.pi * (radius * 1e-3) ** 2, (1.0 - ((index - 1.0) / (index + 1.0)) ** 2) ** 2
    most = 100.0 / (math.pi * (side * 1e-3) ** 2) * area * normal
    # Transmittance falls from the axis to the margin.
    assert 0.98 * most < table["intensity"][2] < most + LARGEST_Z * table.standard_error["intensity"][2]
    assert table["intensity"][0] < 0.5 * most


def test_errors_of_maps_hold() -> None:
    """A disk seen from afar, each value of another seed: luminance Φ/(πA), intensity Φ/π, mean by the area of the screen."""
    tables = [
        et.sweep(
            et.Scene(sources=[DIE]),
            {"die.shape.radius": [1.0]},
            ["intensity", "mean", "maximum"],
            EYE,
            et.Screen(3, 3, 8, 8),
            rays_per_pixel=32,
            seed=k,
        )
        for k in range(12)
    ]
    for name, truth in {"intensity": 100.0 / math.pi, "mean": 100.0 / math.pi / 9e-6}.items():
        values, errors = (
            np.concatenate([one[name] for one in part])
            for part in ([t.values for t in tables], [t.standard_error for t in tables])
        )
        assert_agree(values=values, expected=truth, standard_error=errors, degrees=REVERSE * 10)
    assert tables[0]["maximum"] == pytest.approx(100.0 / math.pi**2 * 1e6, rel=1e-9)


def test_differences_of_one_seed_are_sharper_than_errors_say() -> None:
    bare = et.Scene(sources=[DIE], surfaces=[SCREEN])
    tables = [et.sweep(bare, {"screen.at.2": [3.0, 3.2]}, "absorbed:screen", rays=2000, seed=k) for k in range(1, 33)]
    difference = np.array([np.diff(table["absorbed:screen"])[0] for table in tables])
    stated = math.hypot(*tables[0].standard_error["absorbed:screen"])
    # A ray in ten or so changes its fate; of 32 differences the spread is known to 13 %.
    assert difference.std(ddof=1) < 0.5 * stated
    truth = 100.0 * (disks(1.0, 2.0, 3.2) - disks(1.0, 2.0, 3.0))
    assert abs(difference.mean() - truth) < LARGEST_Z * difference.std(ddof=1) / math.sqrt(32)


# --- against single calls ----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_every_measure_is_that_of_a_single_call() -> None:
    far = {"name": "far", "kind": "intensity", "c_planes": 4, "gamma_step": 10}
    kept = {"name": "kept", "kind": "rays", "shape": {"kind": "disk", "radius": 3}, "at": [0, 0, 1]}
    scene = et.Scene(sources=[DIE], detectors=[DESK | {"at": [0.5, 0, 2]}, far, kept])
    measures = ["flux:desk", "mean:desk", "maximum:desk", "minimum:desk", "uniformity:desk", "flux:far", "peak:far"]
    measures += ["flux:kept", "intensity", "mean", "maximum", "minimum", "uniformity"]
    region = et.Region(-0.5, 0.5, -0.5, 0.25)
    options = {"region": region, "rays": 20_000, "rays_per_pixel": 16, "seed": 7}
    table = et.sweep(scene, {"die.at.0": [0.25, -0.5]}, measures, EYE, et.Screen(3, 2, 12, 8), **options)
    for i, x in enumerate((0.25, -0.5)):
        moved = scene.replace(sources=[DIE | {"at": [x, 0, 0]}])
        result = et.trace(moved, 20_000, 7)
        lmap = et.luminance_map(moved, EYE, et.Screen(3, 2, 12, 8), rays_per_pixel=16, seed=7)
        seen, desk = et.region_statistics(lmap, region), result.illuminance["desk"]
        expected = {
            "flux:desk": desk.flux,
            "mean:desk": desk.mean,
            "maximum:desk": desk.values.max(),
            "minimum:desk": desk.values.min(),
            "uniformity:desk": desk.uniformity,
            "flux:far": result.intensity["far"].flux,
            "peak:far": result.intensity["far"].peak_intensity,
            "flux:kept": result.rays["kept"].total_flux,
            "intensity": lmap.intensity,
            "mean": seen.mean,
            "maximum": seen.maximum,
            "minimum": seen.minimum,
            "uniformity": seen.uniformity,
        }
        assert {name: table[name][i] for name in table.values} == pytest.approx(expected, rel=1e-12)
        assert table.standard_error["peak:far"][i] == result.intensity["far"].peak_error
        assert table.standard_error["mean"][i] == pytest.approx(seen.mean_error_apart, rel=1e-12)
    assert {name.partition(":")[0] for name in table.values} | {"emitted", "escaped", "efficiency", "absorbed"} == {
        *NOUNS
    }


def test_the_error_of_a_flux_does_not_hang_on_the_cells() -> None:
    """A ray meets one cell or none, so that the cells' errors add up to that of one cell of the whole size."""
    scene = et.Scene(sources=[DIE], detectors=[DESK])
    fine = et.sweep(scene, {"desk.at.2": [1, 3]}, ["flux:desk", "mean:desk"], rays=20_000)
    whole = scene.replace(detectors=[DESK | {"columns": 1, "rows": 1}])
    coarse = et.sweep(whole, {"desk.at.2": [1, 3]}, ["flux:desk", "mean:desk"], rays=20_000)
    for name in ("flux:desk", "mean:desk"):
        assert fine[name] == pytest.approx(coarse[name], rel=1e-12)
        assert fine.standard_error[name] == pytest.approx(coarse.standard_error[name], rel=1e-9)
    alone = et.trace(whole.replace(detectors=[DESK | {"columns": 1, "rows": 1, "at": [0.5, 0, 3]}]), 20_000, 1)
    assert coarse.standard_error["mean:desk"][1] == alone.illuminance["desk"].standard_error[0, 0]


def test_what_a_named_medium_absorbs_in_a_solid_is_that_of_the_solid() -> None:
    """Of a beam through a slab (1 − R)(1 − a)/(1 − R a) stay in it, and (1 − R)² a/(1 − R² a²) get to the stop behind."""
    slab = {"name": "slab", "shape": {"kind": "rod", "radius": 5, "height": 4}, "medium": "glass"}
    scene = et.Scene(
        media={"glass": {"index": 1.6, "absorption": 0.1}},
        sources=[{"kind": "beam", "shape": {"kind": "disk", "radius": 1}, "flux": 20, "at": [0, 0, -2]}],
        solids=[slab],
        surfaces=[{"name": "glass", "shape": {"kind": "disk", "radius": 9}, "at": [0, 0, 9], "finish": "absorber"}],
    )
    r, a = (0.6 / 2.6) ** 2, math.exp(-0.4)
    within = 20 * (1 - r) * (1 - a) / (1 - r * a)
    behind = 20 * (1 - r) ** 2 * a / (1 - (r * a) ** 2)
    places = np.linspace(-9, -2, 50)
    measures = ["absorbed:slab", "absorbed:glass"]
    tables = [et.sweep(scene, {"sources.0.at.2": [z]}, measures, rays=2000, seed=k) for k, z in enumerate(places)]
    # A surface and a medium of one name are meant both.
    for name, expected in zip(measures, (within, within + behind), strict=True):
        values, errors = (np.array([float(part[name][0]) for part in parts]) for parts in (
            tables, [table.standard_error for table in tables]))  # fmt: skip
        assert_agree(values=values, expected=expected, standard_error=errors)
    two = scene.replace(solids=[slab, slab | {"name": "other", "at": [0, 30, 0]}])
    with pytest.raises(et.ArgumentError, match="slab and other are of the medium 'glass'"):
        et.sweep(two, {"slab.at.0": [0]}, "absorbed:slab", rays=100)


def test_no_error_is_stated_of_light_that_no_ray_brought() -> None:
    far = {"name": "rays", "kind": "rays", "shape": {"kind": "disk", "radius": 0.01}, "at": [0, 0, 5000]}
    table = et.sweep(et.Scene(sources=[DIE], detectors=[far]), {"die.flux": [1]}, ["flux:rays", "absorbed"], rays=100)
    assert all(table[name] == 0.0 and np.isnan(table.standard_error[name]) for name in ("flux:rays", "absorbed"))


def test_a_flux_in_a_row_has_the_unit_of_the_scene() -> None:
    rings = {"name": "rings", "kind": "rings", "radii": [1, 2], "flux": [1, 2], "flux_unit": "W", "wavelength": 600}
    table = et.sweep(et.Scene(sources=[rings]), {"rings.flux.0": [3, 4]}, "emitted", rays=100)
    assert (table.unit("rings.flux.0"), table.unit("emitted")) == ("W", "W")
    assert table["emitted"] == pytest.approx([5.0, 6.0])


def test_errors_of_light_that_comes_to_a_detector_again_and_again() -> None:
    """In a white sphere: squares of deviations over 40 seeds, each over its own error, are χ² with 39 degrees.

    What a ray brings to several cells, or again and again to a ray collecting surface, is not independent: with cells, or
    crossings, taken for such, χ² is three times as large.
    """
    plane = {"at": [4, 2, 5], "toward": [0.3, -0.5, 0.8]}
    detectors = [
        {"name": "grid", "kind": "illuminance", "width": 4, "height": 4, "columns": 3, "rows": 2, **plane},
        {"name": "large", "kind": "illuminance", "width": 12, "height": 12, "columns": 2, "rows": 2},
        {"name": "rays", "kind": "rays", "shape": {"kind": "rectangle", "width": 12, "height": 12}},
    ]
    ball = {"shape": {"kind": "sphere", "radius": 10}, "finish": {"kind": "lambertian", "reflectance": 0.98}}
    sphere = et.Scene(sources=[{**DIE, "at": [1, 2, 3]}], surfaces=[ball], detectors=detectors)
    measures = ["flux:grid", "mean:large", "flux:rays"]
    tables = [et.sweep(sphere, {"die.at.0": [1.0]}, measures, rays=500, seed=seed) for seed in range(40)]
    for name in measures:
        values, errors = (np.array([float(part[name][0]) for part in parts]) for parts in (
            tables, [table.standard_error for table in tables]))  # fmt: skip
        squares = (((values - values.mean()) / errors) ** 2).sum()
        assert SIGNIFICANCE / 2 < chi2.cdf(squares, 39) < 1 - SIGNIFICANCE / 2


def test_a_detector_absorbs_nothing() -> None:
    """Its face stands in the ledger, but who asks for what a detector absorbs means what meets it."""
    scene = et.Scene(sources=[DIE], surfaces=[SCREEN | {"name": "desk"}], detectors=[DESK, DESK | {"name": "other"}])
    table = et.sweep(scene, {"die.flux": [100]}, "absorbed:desk", rays=1000)
    assert table["absorbed:desk"][0] == pytest.approx(100.0 * disks(1.0, 2.0, 3.0), abs=8.0)  # that of the surface
    with pytest.raises(et.ArgumentError, match="other is a detector, which absorbs nothing; write flux:other"):
        et.sweep(scene, {"die.flux": [100]}, "absorbed:other", rays=1000)


@pytest.mark.slow
def test_rays_are_fitted_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    et.write_rays(tmp_path / "rings.tm25ray", et.RingSource(radii=(0.3, 0.5, 0.6), rays=20_000))
    led = {"name": "led", "kind": "rays", "file": "rings.tm25ray"}
    scene = et.Scene.from_dict({"sources": [led]}, folder=tmp_path)
    fits: list[int] = []

    def counted(rays: et.RaySet, **_: Any) -> et.LightField:
        fits.append(1)
        return et.LightField.fit(rays, et.Disk(radius=1), depths=(2, 2, 2, 2))

    monkeypatch.setattr(scene_map, "fit_or_recall", counted)
    screen = et.Screen(4, 4, 4, 4)
    table = et.sweep(scene, {"led.at.0": [0, 0.5], "led.flux": [50, 100]}, "maximum", EYE, screen, rays_per_pixel=16)
    assert len(fits) == 1
    single = et.Scene.from_dict({"sources": [led | {"at": [0.5, 0, 0], "flux": 100}]}, folder=tmp_path)
    alone = et.luminance_map(single, EYE, screen, rays_per_pixel=16, seed=1)
    assert table["maximum"][1, 1] == alone.values.max()
    # What the field does not know is common to all pixels, whose errors then add up.
    mean = et.sweep(scene, {"led.at.0": [0]}, "mean", EYE, screen, rays_per_pixel=16)
    of_map = et.luminance_map(scene, EYE, screen, rays_per_pixel=16, seed=1)
    assert mean.standard_error["mean"][0] == pytest.approx(np.nanmean(of_map.standard_error), rel=1e-12)


def test_the_observers_of_the_scene_can_be_swept() -> None:
    screen = {"width": 3, "height": 3, "columns": 6, "rows": 6}
    eye = {"name": "eye", "distance": 1000, "screen": screen}
    scene = et.Scene(sources=[DIE], observers=[eye, eye | {"name": "side", "theta": 60}])
    table = et.sweep(scene, {"eye.theta": [0, 60]}, ["intensity", "maximum:side"], rays_per_pixel=32)
    assert list(table.values) == ["intensity:eye", "intensity:side", "maximum:side"]
    assert table.unit("eye.theta") == "°"
    assert table["intensity:eye"][1] < 0.6 * table["intensity:eye"][0]
    assert table["intensity:side"][0] == table["intensity:side"][1]


def test_a_framed_screen_is_the_same_at_all_steps() -> None:
    steps = et.sweep_steps(
        et.Scene(sources=[DIE]), {"die.shape.radius": [3.0, 1.0]}, "mean", EYE, (8, 8), rays_per_pixel=16
    )
    *_, table = steps
    # The mean over the same area has the same flux in it.
    assert table["mean"][1] == pytest.approx(
        table["mean"][0], abs=LARGEST_Z * math.hypot(*table.standard_error["mean"])
    )


# --- what is stopped, kept and told ------------------------------------------------------------------------------------


def test_tables_so_far_are_those_of_the_whole_and_do_not_change() -> None:
    scene = et.Scene(sources=[DIE], surfaces=[SCREEN])
    axes = {"screen.at.2": [1, 2], "die.flux": [100, 50]}
    tables = list(et.sweep_steps(scene, axes, "escaped", rays=1000))
    whole = et.sweep(scene, axes, "escaped", rays=1000)
    assert [table.done for table in tables] == [1, 2, 3, 4]
    assert [len(list(table.rows())) for table in tables] == [1, 2, 3, 4]
    np.testing.assert_array_equal(tables[-1]["escaped"], whole["escaped"])
    assert np.isnan(tables[1]["escaped"]).tolist() == [[False, False], [True, True]]
    assert whole["escaped"][0, 1] == pytest.approx(whole["escaped"][0, 0] / 2, rel=1e-12)
    assert not tables[0].complete
    assert "1 of 4 steps" in tables[0].notes[0]


def test_a_table_is_written_and_read_as_numbers(tmp_path: Path) -> None:
    table = et.sweep(et.Scene(sources=[DIE], surfaces=[SCREEN]), {"screen.at.2": [1, 2]}, "escaped", rays=1000)
    table.save(tmp_path / "sweep.csv")
    lines = (tmp_path / "sweep.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "screen.at.2 [mm],escaped [lm],standard error of escaped [lm]"
    read = np.array([list(map(float, line.split(","))) for line in lines[1:]])
    np.testing.assert_array_equal(read, np.array(list(table.rows())))
    with pytest.raises(et.UnknownNameError, match=r"'\.csv'"):
        table.save(tmp_path / "sweep.cvs")
    with pytest.raises(et.UnknownNameError, match="Did you mean 'escaped'"):
        table["escapd"]


def test_a_dataset_has_the_same_numbers() -> None:
    table = et.sweep(et.Scene(sources=[DIE], surfaces=[SCREEN]), {"screen.at.2": [1, 2]}, "escaped", rays=1000)
    assert float(table.to_xarray()["escaped"].sel({"screen.at.2": 2})) == table["escaped"][1]


def test_notes_tell_each_thing_once() -> None:
    lens = {"name": "lens", "medium": "PMMA", "at": [0, 0, 5], "shape": {"kind": "ball", "radius": 2}}
    scene = et.Scene(sources=[DIE], solids=[lens])
    table = et.sweep(scene, {"lens.at.2": [4, 5, 6]}, "maximum", EYE, (8, 8), rays_per_pixel=16)
    assert len(table.notes) == len({*table.notes})
    assert sum("sampling error" in note for note in table.notes) == 1
    assert any(note.startswith("at lens.at.2 = 4; likewise at 2 more: sampling error") for note in table.notes)


@pytest.mark.parametrize(
    ("parameters", "measure", "message"),
    [
        ({}, "escaped", "at least one parameter"),
        ({"die.flux": []}, "escaped", "no row of finite numbers"),
        ({"die.flux": ["bright"]}, "escaped", "no row of finite numbers"),
        ({"die.flux": [math.inf]}, "escaped", "no row of finite numbers"),
        ({"die.flux": range(1, 10_003)}, "escaped", "10,002 steps; take 10,000 at most"),
        ({"die.flux": [1], "sources.0.flux": [2]}, "escaped", "are the same number"),
        ({"die.flux": [50, -1]}, "escaped", r"die.flux = -1: sources\[0\] \"die\": flux: is -1; it must be greater"),
        ({"dye.flux": [1]}, "escaped", "unknown part of the scene 'dye'. Did you mean 'die'"),
        ({"die.flax": [1]}, "escaped", "unknown key of die 'flax'. Did you mean 'flux'"),
        ({"die.radius": [1]}, "escaped", "write die.shape.radius"),
        ({"die.flux": [1]}, "escapd", "unknown measure 'escapd'. Did you mean 'escaped'"),
        ({"die.flux": [1]}, "flux", "of which detector? flux:desk"),
        ({"die.flux": [1]}, "flux:dsk", "unknown detector of the measure flux 'dsk'. Did you mean 'desk'"),
        ({"die.flux": [1]}, "maximum", "nobody looks at the scene; give an observer, or a detector, e.g. maximum:desk"),
        ({"die.flux": [1]}, ["escaped", "escaped"], "is given twice"),
        ({"die.flux": [1]}, [], "give a measure"),
        ({"die.flux": [1]}, "escaped:die", "is of all the light"),
        ({"die.flux": [1]}, "peak:desk", "of the kind intensity"),
        ({"die.flux": [1]}, "absorbed:scren", "Did you mean 'screen'"),
    ],
)
def test_mistakes_are_told(parameters: Any, measure: Any, message: str) -> None:
    scene = et.Scene(sources=[DIE], surfaces=[SCREEN], detectors=[DESK])
    with pytest.raises(et.EtendueError) as caught:
        et.sweep(scene, parameters, measure, rays=100)
    assert message.replace("\\", "") in str(caught.value)


def test_the_page_tells_of_every_measure() -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "how-to.md").read_text(encoding="utf-8")
    section = page.partition("## See what a number of a scene does")[2].partition("\n## ")[0]
    for noun in NOUNS:
        assert f"`{noun}" in section, f"docs/how-to.md does not tell of {noun}"
