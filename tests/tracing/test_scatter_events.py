"""Scatter events show what a light image of the same rays shows, lines of sight, and closed forms; verdicts at 1e-4."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.errors import ArgumentError, FormatError, SceneError, UnknownNameError
from etendue.lightfield.light_field import LightField
from etendue.quantities.luminance_map import LuminanceMap
from etendue.scene.scatter_events import EVENT
from etendue.tracing.work import BATCHES
from oracles.verdicts import LARGEST_Z, SIGNIFICANCE, assert_agree
from scipy.stats import chi2, kurtosis

Array = npt.NDArray[np.float64]
NO_FACE = (1 << 32) - 1
ONE_ROUND = BATCHES * _core.batch_size()


def view(name: str, theta: float, phi: float, **more: Any) -> dict[str, Any]:
    screen = {"width": 26, "height": 20, "columns": 6, "rows": 5}
    return {"name": name, "theta": theta, "phi": phi, "distance": 300, "target": [3, 2, 2], "screen": screen, **more}


def corner(**more: Any) -> dict[str, Any]:
    """Two leaves at a slant and a black ball before them, lit by a small lamp that nobody sees: no symmetry."""
    return {
        "sources": [{"name": "led", "kind": "surface", "shape": {"kind": "rectangle", "width": 2, "height": 1}, "flux": 100,
                     "at": [4, 3, 40], "toward": [-0.1, -0.05, -1], "exponent": 20}],
        "surfaces": [
            {"name": "floor", "shape": {"kind": "rectangle", "width": 60, "height": 54}, "finish": {"kind": "lambertian",
             "reflectance": 0.7}},
            {"name": "side", "shape": {"kind": "rectangle", "width": 24, "height": 40}, "at": [-9, 0, 8],
             "toward": [1, 0.2, 0.1], "finish": {"kind": "lambertian", "reflectance": 0.4}},
            {"name": "ball", "shape": {"kind": "sphere", "radius": 4}, "at": [6, -1, 9], "finish": "absorber"},
        ],
        "observers": [view("eye", 40, 15), view("above", 5, 200)],
        "detectors": [{"name": "scatter", "kind": "scatter"}],
        **more,
    }  # fmt: skip


def everything(folder: Path) -> dict[str, Any]:
    """What events have to remember: solids around them and behind, absorption, colours, meshes, sheets on faces of solids,
    bodies that touch, finishes that transmit and depend on angle and colour; and a cavity with many scatters of each ray."""
    (folder / "tile.obj").write_text("v 0 0 0\nv 9 0 1\nv 9 8 2\nv 0 8 0\nf 1 2 3\nf 1 3 4\n", encoding="utf-8")
    (folder / "veil.csv").write_text("450, 0.2\n600, 0.5\n", encoding="utf-8")
    # Tilted, so that rounding sets faces that coincide apart.
    up = np.array([0.36, -0.48, 0.8])
    block, across = np.array([2, 1, 15.0]), np.array([0.8, 0.6, 0])

    def on(height: float, aside: float = 0.0) -> dict[str, Any]:
        return {"at": list(block + height * up + aside * across), "toward": list(up)}

    veil = {"kind": "lambertian", "reflectance": {"file": "veil.csv", "by": "wavelength"}, "transmittance": 0.3}
    white = {"kind": "lambertian", "reflectance": 0.95}
    return {
        "media": {"tinted": {"index": 1.5, "absorption": 0.02}, "haze": {"index": 1.0, "absorption": 0.001}},
        "surroundings": "haze",
        "sources": [
            {"name": "led", "kind": "surface", "shape": {"kind": "rectangle", "width": 2, "height": 1}, "flux": 90,
             "at": [1, 0, 1], "toward": [0.2, 0.1, 1], "spectrum": [[450, 1], [600, 2]]},
            {"name": "pilot", "kind": "point", "flux": 30, "at": [3, 4, 12]},
        ],
        "solids": [
            {"name": "block", "medium": "tinted", **on(0),
             "shape": {"kind": "block", "width": 14, "height": 12, "depth": 3}},
            {"name": "cap", "medium": "tinted", "shape": {"kind": "block", "width": 14, "height": 12, "depth": 2}, **on(3),
             "finishes": {"left": white}},
            {"name": "dome", "medium": "silicone", "shape": {"kind": "dome", "radius": 4}, "at": [9, -6, 0],
             "finishes": {"dome": {"kind": "lambertian", "reflectance": 0.4, "transmittance": 0.4}}},
        ],
        "surfaces": [
            {"name": "label", "shape": {"kind": "disk", "radius": 3}, **on(5), "finish": veil},
            {"name": "inlay", "shape": {"kind": "disk", "radius": 2}, **on(3, 2), "finish": veil},
            {"name": "tile", "shape": {"kind": "mesh", "file": "tile.obj", "unit": "mm"}, "at": [-9, -4, 8], "finish": veil},
            {"name": "cup", "shape": {"kind": "cylinder", "radius": 6, "height": 9}, "finish": white},
            {"name": "floor", "shape": {"kind": "disk", "radius": 30}, "at": [0, 0, -2], "finish": veil},
        ],
        "observers": [view("eye", 40, 15), view("below", 125, 300, target=[2, 0, 8]), view("near", 60, 110, distance=30)],
        "detectors": [
            {"name": "scatter", "kind": "scatter"},
            {"name": "rays", "kind": "rays", "shape": {"kind": "disk", "radius": 3}, **on(5)},
            *({"name": name, "kind": "image", "observer": name} for name in ("eye", "below", "near")),
        ],
    }  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the scene that `traced` has, with the files that it names."""
    return tmp_path_factory.mktemp("everything")


@pytest.fixture(scope="module")
def traced(folder: Path) -> et.TraceResult:
    scene = et.Scene.from_dict(everything(folder), folder=folder)
    return et.trace(scene, 150_000, seed=5)


@pytest.mark.slow
def test_the_same_picture_as_a_light_image_of_the_same_rays(traced: et.TraceResult) -> None:
    """Each scatter is connected to the eye at once, or later: the same sums, but for the order in which they are made."""
    events = traced.events["scatter"]
    assert len(np.unique(events.surface)) >= 7
    assert len(events) > 1.5 * 150_000
    names = ("eye", "below", "near")
    for name, lmap in zip(names, et.luminance_map(events), strict=True):
        image = traced.images[name]
        assert (image.rays > 0).mean() > 0.7
        np.testing.assert_array_equal(lmap.rays, image.rays)
        np.testing.assert_allclose(lmap.values, image.values, rtol=1e-11)
        np.testing.assert_allclose(lmap.standard_error, image.standard_error, rtol=1e-9)
        assert lmap.observer == image.observer
        assert lmap.flux_unit == "lm"


def test_light_leaves_all_faces_that_coincide(tmp_path: Path) -> None:
    """Where a label lies on a block, light is sent off from both: of one alone it would meet the other at once."""
    scene = et.Scene.from_dict(everything(tmp_path), folder=tmp_path)
    result = et.trace(scene, 5000, seed=5)
    events = result.events["scatter"]
    rows = np.array(events.rows)
    shared = rows["face"][:, 1] != NO_FACE
    assert 20 < shared.sum() < 0.5 * len(rows)
    rows["face"][:, 1:] = NO_FACE
    whole, one = et.luminance_map(events)[0], et.luminance_map(events.replace(rows=rows))[0]
    assert one.rays.sum() < whole.rays.sum()
    assert one.values.sum() < whole.values.sum()
    # A light image of the same rays, which holds no faces in store.
    np.testing.assert_allclose(whole.values, result.images["eye"].values, rtol=1e-11)


@pytest.mark.slow
def test_what_events_say(traced: et.TraceResult) -> None:
    """Light that arrives at a Lambertian surface and does not stay there was reflected or let through."""
    events, ledger = traced.events.only, traced.ledger
    assert (np.diff(events.ray) >= 0).all()
    assert events.ray.max() < 150_000
    assert set(np.unique(events.wavelength)) <= {450.0, 555.0, 600.0}
    np.testing.assert_allclose(np.linalg.norm(events.direction, axis=1), 1.0, rtol=1e-12)
    on_floor = events.surface == events.surface_names.index("floor")
    assert np.allclose(events.position[on_floor, 2], -2.0)
    arrived = events.flux_by_surface()
    n = np.count_nonzero(events.surface == events.surface_names.index("cup"))
    absorbed = ledger.by_surface["cup"].flux / arrived["cup"]
    assert abs(absorbed - 0.05) < LARGEST_Z * math.sqrt(0.05 * 0.95 / n)


@pytest.mark.slow
def test_the_same_picture_as_lines_of_sight() -> None:
    """Diffuse surfaces and what stands before them, from two sides: no line of code in common but geometry and finishes."""
    scene = et.Scene(**corner())
    maps = et.luminance_map(et.trace(scene, 2e6, 3).events["scatter"])
    for lmap, reverse in zip(maps, et.luminance_map(scene, rays_per_pixel=1024, seed=5), strict=True):
        assert reverse.observer == lmap.observer
        error = np.hypot(lmap.standard_error, reverse.standard_error)
        dark = reverse.values == 0
        assert (lmap.values[dark] == 0).all()
        assert np.median(error[~dark] / reverse.values[~dark]) < 0.02
        assert_agree(values=lmap.values, expected=reverse.values, standard_error=error)
        for other in (reverse.values[::-1], reverse.values[:, ::-1]):
            assert chi2.sf(np.nansum(((lmap.values - other) / error) ** 2), error.size) < SIGNIFICANCE


@pytest.mark.slow
def test_with_what_lines_of_sight_find_besides() -> None:
    """A lamp in view, a mirror, a disk that mirrors and scatters: the whole is what lines of sight find, to which rays
    forwards add only what the mirrors throw on the walls, which is found by chance else."""
    more = [
        {"name": "mirror", "shape": {"kind": "rectangle", "width": 9, "height": 12}, "at": [-6, 5, 6],
         "toward": [1, -0.4, 0.8], "finish": {"kind": "mirror", "reflectance": 0.9}},
        {"name": "half", "shape": {"kind": "disk", "radius": 5}, "at": [8, 8, 3], "toward": [-0.3, 0, 1],
         "finish": {"kind": "diffuse-specular", "total_reflectance": 0.8, "specular_reflectance": 0.3}},
    ]  # fmt: skip
    lamp = {"name": "lamp", "kind": "surface", "shape": {"kind": "sphere", "radius": 1}, "flux": 60, "at": [9, 2, 14]}
    keys = corner()
    keys["sources"] = [*keys["sources"], lamp]
    keys["surfaces"] = [*keys["surfaces"], *more]
    scene = et.Scene(**keys)
    events = et.trace(scene, 1e6, 4).events.only
    wholes = et.luminance_map(events, rays_per_pixel=256, seed=2)
    parts = et.luminance_map(events)
    other = et.luminance_map(scene, rays_per_pixel=1024, seed=9, forward_rays=1e6)
    for whole, part, reverse in zip(wholes, parts, other, strict=True):
        assert_agree(
            values=whole.values,
            expected=reverse.values,
            standard_error=np.hypot(whole.standard_error, reverse.standard_error),
        )
        rest = whole.values - part.values
        assert (rest >= -1e-9 * whole.values.max()).all()
        assert (rest > 0.05 * whole.values).sum() > 3
        assert any("scatter events" in note for note in whole.notes)
        assert any("left out" in note for note in part.notes)


@pytest.mark.slow
def test_rays_as_a_source_are_counted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Among diffuse surfaces, lines of sight add to events only what they see where all is black: the field that was fitted
    to the rays of the source, which is in view. What events show is what lines of sight show of the lamps themselves."""
    led = {"name": "led", "kind": "surface", "shape": {"kind": "rectangle", "width": 6, "height": 4}, "flux": 100,
           "at": [2, 3, 14], "toward": [0.3, 0.1, -1]}  # fmt: skip
    # Behind the lamp a second one, that shines up.
    lamps = [led, {**led, "name": "up", "toward": [-0.3, -0.1, 1], "at": [2.1, 3.1, 14.5]}]
    shell = {"name": "all", "kind": "rays", "shape": {"kind": "sphere", "radius": 6}, "at": [2, 3, 14]}
    caught = et.trace(et.Scene(**corner(sources=lamps, surfaces=[], detectors=[shell])), 5_000, 2)
    source = {"name": "file", "kind": "rays", "rays": caught.rays.only}
    # On the surface that caught them, and coarse: how well the field fits does not matter, as it is the same in both maps.
    fit, shape = LightField.fit, et.Sphere(radius=6.01, centre=(2, 3, 14))
    coarse = staticmethod(lambda rays, _, **more: fit(rays, shape, depths=(2, 2, 2, 2), **more))
    monkeypatch.setattr(LightField, "fit", coarse)
    events = et.trace(et.Scene(**corner(sources=[source])), None, 3).events.only
    black = [{**surface, "finish": "absorber"} for surface in corner()["surfaces"]]
    direct = et.luminance_map(et.Scene(**corner(sources=[source], surfaces=black)), rays_per_pixel=16)
    wholes, parts = et.luminance_map(events, rays_per_pixel=16), et.luminance_map(events)
    lit = et.luminance_map(et.Scene(**corner(sources=lamps)), rays_per_pixel=512, seed=5)
    dark = et.luminance_map(et.Scene(**corner(sources=lamps, surfaces=black)), rays_per_pixel=512, seed=5)
    for whole, part, alone, on, off in zip(wholes, parts, direct, lit, dark, strict=True):
        np.testing.assert_allclose(whole.values, part.values + alone.values, rtol=1e-12)
        assert (alone.values > 0).sum() > 3
        # Where the lamp is not in view.
        hidden = (off.values == 0) & (on.values > 0)
        error = np.hypot(part.standard_error, on.standard_error)[hidden]
        assert_agree(values=part.values[hidden], expected=on.values[hidden], standard_error=error)


@pytest.mark.slow
def test_integrating_sphere() -> None:
    """V6: a small Lambertian disk on the wall lights the sphere evenly, E₀ = Φ/A; L = ρ (E₀ + E_r)/π everywhere, from any
    observer; and the wall receives (E₀ + E_r) A (1 − f)."""
    radius, reflectance, flux, top = 10.0, 0.8, 3.0, 8.0
    area = 4 * math.pi * radius**2
    port = (radius - top) / (2 * radius)
    inside = np.array([0.6, 0.64, -0.48])
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 0.01}, "flux": flux, "at": 9.99 * inside,
            "toward": -inside}  # fmt: skip
    wall = {"name": "wall", "shape": {"kind": "sphere", "radius": radius}, "trim": {"z": [-11, top]},
            "finish": {"kind": "lambertian", "reflectance": reflectance}}  # fmt: skip
    scene = et.Scene(sources=[lamp], surfaces=[wall], detectors=[{"name": "scatter", "kind": "scatter"}])
    events = et.trace(scene, 1e6, 6).events.only
    arrives = flux / area + reflectance * flux * (1 - port) / (area * (1 - reflectance * (1 - port)))
    assert events.flux_by_surface()["wall"] == pytest.approx(arrives * area * (1 - port), rel=4e-3)
    expected = reflectance / math.pi * arrives * 1e6
    observers = [et.Observer(theta, 200, 60, target=(0, 0, 8)) for theta in (8, 25)]
    for lmap in et.luminance_map(events, observers, et.Screen(5, 4, 5, 4)):
        assert_agree(
            values=lmap.values, expected=np.full(lmap.values.shape, expected), standard_error=lmap.standard_error
        )
        assert abs(lmap.values.mean() / expected - 1) < 0.02


# --- thinning --------------------------------------------------------------------------------------------------------


def test_thinning_keeps_whole_rays() -> None:
    """Of the rays of half, a quarter …, all events are kept, and they are those of the unthinned trace."""
    all_, few = (
        et.trace(et.Scene(**corner(detectors=[{"kind": "scatter", "most": most}])), 3e5, 8).events.only
        for most in (10**7, 100_000)
    )
    assert all_.share == 1.0
    assert few.share in (0.5, 0.25, 0.125, 0.0625)
    assert 100_000 / 5 < len(few) <= 100_000
    depth = all_.rows["ray"] >> np.uint64(56)
    kept = all_.rows[depth >= round(-math.log2(few.share))]
    assert kept.tobytes() == np.asarray(few.rows).tobytes()
    assert few.scale == all_.scale / few.share
    assert any("1 ray in" in note for note in few.notes)
    assert all_.notes == ()


@pytest.mark.slow
def test_thinning_keeps_the_mean_and_tells_its_error() -> None:
    """A closed ball that reflects half receives 2 Φ; the stop at a number of events, which rays with many scatters reach
    first, does not bias it. Over 400 traces of a few rays, thinned hard."""
    ball = {
        "name": "ball",
        "shape": {"kind": "sphere", "radius": 5},
        "finish": {"kind": "lambertian", "reflectance": 0.5},
    }
    lamp = {"kind": "point", "flux": 1, "at": [1, 2, 0]}
    scene = et.Scene(sources=[lamp], surfaces=[ball], detectors=[{"kind": "scatter", "most": 150}])
    # The eye is in the ball, and sees nothing of what is behind it.
    found, shares, eye, screen = [], [], et.Observer(0, 0, 3), et.Screen(9, 9, 1, 1)
    maps: list[LuminanceMap] = []
    for seed in range(400):
        events = et.trace(scene, 600, seed).events.only
        assert len(events) <= 150
        found.append(events.flux_by_surface()["ball"])
        shares.append(events.share)
        maps.append(et.luminance_map(events, eye, screen))
    assert len(set(shares)) > 1
    arrived = np.array(found)
    assert abs(arrived.mean() - 2.0) < LARGEST_Z * arrived.std(ddof=1) / math.sqrt(400)
    # L = ρ E/π. What the wall scatters arrives evenly on it, Φ/A; straight from the lamp comes Φ cos θ/4πr². Mean
    # over the lines of sight through the middles of small squares of the pixel.
    side = (np.arange(200) + 0.5) / 200 * 9 - 4.5
    lines = np.stack([*np.meshgrid(side, side), np.full((200, 200), -3.0)], axis=-1)
    lines /= np.linalg.norm(lines, axis=-1, keepdims=True)
    start = np.array([0.0, 0.0, 3.0])
    along = lines @ start
    seen = start + lines * (np.sqrt(along**2 + 25 - 9) - along)[..., None]
    away = seen - np.array([1.0, 2.0, 0.0])
    distance = np.linalg.norm(away, axis=-1)
    direct = np.sum(away * seen, axis=-1) / (5 * distance) / (4 * math.pi * distance**2)
    truth = (direct.mean() + 1 / (4 * math.pi * 25)) * 0.5 / math.pi * 1e6
    values = np.array([m.values[0, 0] for m in maps])
    stated = np.array([m.standard_error[0, 0] for m in maps])
    assert abs(values.mean() - truth) < LARGEST_Z * values.std(ddof=1) / 20
    # Of a standard deviation of 400 values.
    spread = math.sqrt((kurtosis(values, fisher=False) - 1.0) / (4.0 * 400))
    assert math.sqrt((stated**2).mean()) == pytest.approx(values.std(ddof=1), rel=LARGEST_Z * spread)


@pytest.mark.slow
def test_thinned_maps_have_the_errors_that_they_state() -> None:
    scene = et.Scene(**corner(detectors=[{"kind": "scatter", "most": 60_000}]))
    events = et.trace(scene, 2.5 * ONE_ROUND, 3).events.only
    assert events.share < 0.1
    for lmap, reverse in zip(et.luminance_map(events), et.luminance_map(scene, rays_per_pixel=1024), strict=True):
        assert_agree(
            values=lmap.values,
            expected=reverse.values,
            standard_error=np.hypot(lmap.standard_error, reverse.standard_error),
        )


def test_nothing_is_left_of_one_event() -> None:
    """The least that can be asked for: events of a ray are kept together, or not at all."""
    events = et.trace(et.Scene(**corner(detectors=[{"kind": "scatter", "most": 1}])), 5000, 3).events.only
    assert len(events) <= 1
    assert (et.luminance_map(events)[0].values >= 0).all()


# --- surfaces --------------------------------------------------------------------------------------------------------


def test_some_surfaces_only() -> None:
    chosen = et.Scene(
        **corner(detectors=[{"name": "few", "kind": "scatter", "surfaces": ["side"]}, {"kind": "scatter"}])
    )
    result = et.trace(chosen, 200_000, 3)
    few, all_ = result.events["few"], result.events["detectors[1]"]
    names = np.array(all_.surface_names)
    assert np.asarray(few.rows).tobytes() == all_.rows[names[all_.surface] == "side"].tobytes()
    assert any("side only" in note for note in few.notes)
    with pytest.raises(ArgumentError, match="side only"):
        et.luminance_map(few, rays_per_pixel=16)


def test_a_solid_stands_for_its_faces() -> None:
    dome = {"name": "dome", "shape": {"kind": "dome", "radius": 3}, "medium": "silicone", "at": [0, 0, 2],
            "finish": {"kind": "lambertian", "reflectance": 0.5, "transmittance": 0.5}}  # fmt: skip
    found = {}
    for names in (["dome"], ["dome.dome"], ["dome.base"]):
        scene = et.Scene(**corner(solids=[dome], detectors=[{"name": "few", "kind": "scatter", "surfaces": names}]))
        found[names[0]] = et.trace(scene, 20_000, 3).events.only.flux_by_surface()
    assert set(found["dome"]) == {"dome.dome", "dome.base"}
    assert found["dome"]["dome.dome"] == found["dome.dome"]["dome.dome"]
    with pytest.raises(SceneError, match=r"unknown surface 'flor'\. Did you mean 'floor'"):
        et.trace(et.Scene(**corner(detectors=[{"kind": "scatter", "surfaces": ["flor"]}])), 1000)


@pytest.mark.parametrize("wrong", [{"most": 0}, {"most": 2**60}, {"most": 1.5}, {"surfaces": "floor"}, {"mots": 3}])
def test_nonsense_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(SceneError, match=next(iter(wrong))):
        et.Scene(**corner(detectors=[{"kind": "scatter", **wrong}]))


# --- files -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_looked_at_from_a_file_in_another_place(tmp_path: Path, folder: Path, traced: et.TraceResult) -> None:
    """A result names the files of its scene as seen from where it is; a file that has changed is noticed."""
    (folder / "results").mkdir()
    path = folder / "results" / "result.h5"
    traced.save(path)
    again = et.TraceResult.load(path)
    assert again.events["scatter"].rows.tobytes() == traced.events["scatter"].rows.tobytes()
    for lmap, expected in zip(et.luminance_map(again.events.only), et.luminance_map(traced.events.only), strict=True):
        np.testing.assert_array_equal(lmap.values, expected.values)
        assert lmap.header() == expected.header()
    again.save(folder / "copy.h5")
    assert len(et.luminance_map(et.TraceResult.load(folder / "copy.h5").events.only)) == 3
    # All of it somewhere else, where what others look at stays as it is.
    shutil.copytree(folder, moved := tmp_path / "moved")
    path = moved / "results" / "result.h5"
    (moved / "tile.obj").write_text("v 0 0 0\nv 9 0 1\nv 9 8 2\nf 1 2 3\n", encoding="utf-8")
    with pytest.raises(ArgumentError, match="another scene, or a file that it names has changed"):
        et.luminance_map(et.TraceResult.load(path).events.only)
    (moved / "tile.obj").unlink()
    with pytest.raises(SceneError, match=r"tile\.obj"):
        et.luminance_map(et.TraceResult.load(path).events.only)


def test_a_scene_that_lives_in_memory_can_be_given(tmp_path: Path) -> None:
    rays = et.RaySet(np.zeros((9, 3)), np.tile([0.1, 0, 1.0], (9, 1)), np.ones(9))
    scene = et.Scene(**corner(sources=[{"kind": "rays", "rays": rays, "at": [4, 3, 40], "toward": [0, 0, -1]}]))
    result = et.trace(scene, None)
    expected = et.luminance_map(result.events.only)
    result.save(tmp_path / "r.h5")
    lonely = et.TraceResult.load(tmp_path / "r.h5").events.only
    eye, screen = et.Observer(40, 15, 300), et.Screen(26, 20, 6, 5)
    with pytest.raises(ArgumentError, match="come without their scene"):
        et.luminance_map(lonely, eye, screen)
    with pytest.raises(ArgumentError, match="no observers"):
        et.luminance_map(lonely)
    with pytest.raises(ArgumentError, match="another scene"):
        et.luminance_map(lonely.replace(scene=et.Scene(**corner(surfaces=[]))), eye, screen)
    for lmap, same in zip(et.luminance_map(lonely.replace(scene=scene)), expected, strict=True):
        np.testing.assert_array_equal(lmap.values, same.values)


def test_a_file_cut_short_anywhere_is_found(tmp_path: Path) -> None:
    path = tmp_path / "result.h5"
    et.trace(et.Scene(**corner()), 30_000, 3).save(path)
    whole = path.read_bytes()
    for length in np.linspace(0, len(whole) - 1, 60).astype(int):
        path.write_bytes(whole[:length])
        with pytest.raises(FormatError, match=r"result\.h5"):
            et.TraceResult.load(path)


@pytest.mark.slow
def test_damage_is_found(tmp_path: Path) -> None:
    path = tmp_path / "result.h5"
    small = et.trace(et.Scene(**corner()), 30_000, 3)
    small.save(path)
    whole, rows, found = path.read_bytes(), small.events.only.rows.tobytes(), 0
    for at in np.random.default_rng(5).integers(0, len(whole), 80):
        damaged = bytearray(whole)
        damaged[at] ^= 0x5A
        path.write_bytes(damaged)
        try:
            again = et.TraceResult.load(path)
        except FormatError as error:
            found += str(path) in str(error)
        else:
            assert again.events.only.rows.tobytes() == rows  # room that nothing uses
    assert found > 60


def test_columns_must_fit_each_other(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "result.h5"
    result = et.trace(et.Scene(**corner()), 3000, 3)
    for name, values, match in (
        ("flux", np.ones(5), "shape"), ("part", np.ones((5, 4), "u4"), "shape"), ("ray", np.ones(5), "expected uint64"),
    ):  # fmt: skip
        result.save(path)
        with h5py.File(path, "r+") as file:
            del file["sums/detector_0"][name]
            file["sums/detector_0"][name] = values
        with pytest.raises(FormatError, match=match):
            et.TraceResult.load(path)
    result.save(path)
    with h5py.File(path, "r+") as file:
        file["sums/detector_0"].attrs["level"] = np.uint64(64)
    with pytest.raises(FormatError, match="level"):
        et.TraceResult.load(path)


# --- how it is asked for ---------------------------------------------------------------------------------------------


def test_the_same_bits_for_any_number_of_threads() -> None:
    events = et.trace(et.Scene(**corner()), 200_000, 3).events.only
    one, two, seven = (et.luminance_map(events, threads=n) for n in (1, 2, 7))
    for other in (two, seven):
        for lmap, same in zip(one, other, strict=True):
            assert lmap.values.tobytes() == same.values.tobytes()
            assert lmap.standard_error.tobytes() == same.standard_error.tobytes()


@pytest.mark.slow
def test_events_of_a_ray_stay_together_in_any_stretch(monkeypatch: pytest.MonkeyPatch, traced: et.TraceResult) -> None:
    from etendue.luminance import scatter_map

    expected = et.luminance_map(traced.events.only)
    told: list[int] = []
    monkeypatch.setattr(scatter_map, "STRETCH", 1000)
    for lmap, same in zip(et.luminance_map(traced.events.only, progress=told.append), expected, strict=True):
        np.testing.assert_array_equal(lmap.rays, same.rays)
        np.testing.assert_allclose(lmap.values, same.values, rtol=1e-12)
        np.testing.assert_allclose(lmap.standard_error, same.standard_error, rtol=1e-12)
    assert told == sorted(told)
    assert told[-1] == 3 * len(traced.events.only)


def test_options_that_mean_nothing_are_refused() -> None:
    events = et.trace(et.Scene(**corner()), 2000, 3).events.only
    for wrong, match in (
        ({"forward_rays": 1e5}, "forward_rays"), ({"until": 0.1}, "rays_per_pixel"), ({"seed": 2}, "rays_per_pixel"),
        ({"method": "cone"}, "Cone is for rays"), ({"threads": 0}, "threads"), ({"rays_per_pixel": 0}, "rays_per_pixel"),
    ):  # fmt: skip
        with pytest.raises(ArgumentError, match=match):
            et.luminance_map(events, **wrong)  # type: ignore[call-overload]
    with pytest.raises(UnknownNameError, match="Did you mean 'scatter'"):
        et.trace(et.Scene(**corner()), 2000, 3).events["scater"]
    with pytest.raises(ArgumentError, match="no detector with cells"):
        et.trace(et.Scene(**corner()), 2000, until=0.1)


def test_rows_of_something_else_are_refused() -> None:
    events = et.trace(et.Scene(**corner()), 2000, 3).events.only
    for field, value in (("face", 99), ("part", 1), ("before", 1 << 48), ("after", 7), ("flux", np.nan),
                         ("position", np.inf)):  # fmt: skip
        rows = np.array(events.rows)
        rows[field][3] = value
        with pytest.raises(ArgumentError, match="another scene"):
            et.luminance_map(events.replace(rows=rows))
    assert EVENT.itemsize == 120


def test_a_surface_without_light_is_dark() -> None:
    lamp = {"kind": "point", "flux": 1, "at": [0, 0, 500]}
    scene = et.Scene(**corner(sources=[lamp], surfaces=[]))
    lmap = et.luminance_map(et.trace(scene, 1000, 3).events.only)[0]
    assert (lmap.values == 0).all()
    assert np.isnan(lmap.standard_error).all()
    assert any("saw no scatter" in note for note in lmap.notes)
