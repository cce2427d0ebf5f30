"""Lines of sight that end at surfaces whose light is known: the same map, with less noise. Verdicts at 1e-4, fixed seeds."""

from __future__ import annotations

import functools
import math
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.luminance import scene_map
from etendue.luminance.gathering import BLOCKS, LEAST_LINES, NOT_TAKEN, PILOT, Comparison, blocks
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.building import core_scene
from etendue.scene import compile_scene
from oracles.gathered import common_error
from oracles.verdicts import REVERSE, assert_agree

Array = npt.NDArray[np.float64]
WHITE = {"kind": "lambertian", "reflectance": 0.85}


def tray(**more: Any) -> dict[str, Any]:
    """A white tray with slanted sides, lit by a lamp in a corner that faces one side; a black plate lies close to the floor,
    a slanted diffuse sheet lets light through. No symmetry; light goes to and fro."""
    side = {"shape": {"kind": "rectangle", "width": 40, "height": 16}, "finish": WHITE}
    surfaces = [
        {"name": "floor", "shape": {"kind": "rectangle", "width": 40, "height": 30}, "finish": WHITE},
        {"name": "left", **side, "at": [-20, 0, 6], "toward": [1, 0, 0.2], "spin": 90},
        {"name": "right", **side, "at": [21, 0, 7], "toward": [-1, 0.1, 0.4], "spin": 90},
        {"name": "back", "shape": {"kind": "cylinder", "radius": 34, "height": 18}, "at": [0, -16, 0], "finish": WHITE},
        {"name": "plate", "shape": {"kind": "disk", "radius": 5}, "at": [4, 3, 1e-3], "finish": "absorber"},
        {"name": "sheet", "shape": {"kind": "rectangle", "width": 9, "height": 7}, "at": [-8, -4, 8],
         "toward": [0.5, 0.3, 1], "finish": {"kind": "lambertian", "reflectance": 0.3, "transmittance": 0.5}},
    ]  # fmt: skip
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1.5}, "flux": 50, "at": [-12, 8, 5],
            "toward": [1, -0.6, 0.3]}  # fmt: skip
    eye = {"name": "eye", "theta": 35, "phi": 250, "distance": 300, "target": [0, 0, 4],
           "screen": {"width": 44, "height": 34, "columns": 11, "rows": 9}}  # fmt: skip
    detectors = [{"name": "image", "kind": "image", "observer": "eye"}]
    return {"sources": [lamp], "surfaces": surfaces, "observers": [eye], "detectors": detectors, **more}


def seen(scene: et.Scene, **how: Any) -> et.LuminanceMap:
    (lmap,) = et.luminance_map(scene, **how)
    return lmap


def painted(**finishes: Any) -> dict[str, Any]:
    """The tray with other finishes, by the names of its surfaces."""
    there = tray()
    assert {*finishes} <= {surface["name"] for surface in there["surfaces"]}
    surfaces = [
        {**surface, "finish": finishes.get(surface["name"], surface["finish"])} for surface in there["surfaces"]
    ]
    return {**there, "surfaces": surfaces}


def leaning_table() -> et.BsdfTable:
    """0.4/π and a lobe that is wider to one side, at three angles of incidence: R about 0.75."""
    slices = []
    for theta in (0.0, 40.0, 75.0):
        incident, grid = direction(theta, 180.0), PolarGrid("normal", np.linspace(0.0, 88.0, 45), np.arange(48) * 7.5)
        off = (incident + grid.directions(incident, transmitted=False))[..., :2]
        width = np.where(off[..., 1] > 0, 0.3, 0.15)
        f = 0.4 / math.pi + 0.9 * np.exp(-0.5 * (off[..., 0] / 0.3) ** 2 - 0.5 * (off[..., 1] / width) ** 2)
        slices.append(BsdfSlice(incident, f, grid=grid))
    return et.BsdfTable(BsdfData(tuple(slices)))


def table_without_a_horizon() -> et.BsdfTable:
    """A base that falls to nothing at 80° and a lobe, as most files have it: R about 0.8."""
    slices = []
    for theta in np.arange(0.0, 86.0, 5.0):
        incident, grid = direction(theta, 180.0), PolarGrid("normal", np.linspace(0.0, 88.0, 89), np.arange(72) * 5.0)
        scattered = grid.directions(incident, transmitted=False)
        base = 0.42 * np.sqrt(np.maximum(scattered[..., 2] - 0.1736, 0.0)) * (1.0 - 0.2 * incident[2])
        off = np.sum((incident + scattered)[..., :2] ** 2, axis=-1)
        slices.append(BsdfSlice(incident, base + 0.25 * np.exp(-off / (2 * 0.2**2)), grid=grid))
    return et.BsdfTable(BsdfData(tuple(slices)))


def agrees_with_the_light_image(*, scene: dict[str, Any], gathered: et.LuminanceMap, rays: float, sharp: float) -> None:
    """Rays forwards, each scatter connected to the eye, know nothing of patches."""
    image = et.trace(et.Scene(**scene), rays, 9).images["image"]
    # The lamp itself is no scattered light.
    eye, screen = gathered.observer, gathered.screen
    dark = {**scene, "surfaces": [dict(s, finish="absorber") for s in scene["surfaces"]]}
    bare = et.luminance_map(et.Scene(**dark), eye, screen, rays_per_pixel=256)
    clear = (bare.values == 0) & (image.values > 0)
    assert clear.sum() > 60
    error = np.hypot(gathered.standard_error, image.standard_error)
    assert np.median(error[clear] / image.values[clear]) < sharp
    assert_agree(
        values=gathered.values[clear], expected=image.values[clear], standard_error=error[clear], degrees=REVERSE
    )


@pytest.fixture(scope="module")
def gathered() -> et.LuminanceMap:
    return seen(et.Scene(**tray()), rays_per_pixel=1024, seed=3, gather=True)


@pytest.mark.slow
def test_the_map_is_that_of_the_light_image(gathered: et.LuminanceMap) -> None:
    agrees_with_the_light_image(scene=tray(), gathered=gathered, rays=2e6, sharp=0.022)


@pytest.mark.slow
def test_what_does_not_depend_on_where_light_came_from_is_known_of_any_finish() -> None:
    """The base of a satin paint, the floor of a table, the Lambertian part of a mixture, light about the normal: patches
    know this part, lines go on for the rest."""
    lobe = {"kind": "gaussian", "peak": 0.8, "sigma": 0.25, "aspect": 0.6}
    parts = [{"kind": "lambertian", "reflectance": 0.55}, lobe]
    scene = painted(
        floor={"kind": "rough-coat", "roughness": 0.3, "index": 1.6, "base_reflectance": 0.95},
        left={"kind": "bsdf", "bsdf": leaning_table()},
        right={"kind": "mixture", "parts": parts, "axis": [0.2, 1, 0.3]},
        back={"kind": "cosine-power", "about": "normal", "exponent": 1.5, "peak": 0.46},
    )
    known = seen(et.Scene(**scene), rays_per_pixel=1024, seed=3, gather=True)
    agrees_with_the_light_image(scene=scene, gathered=known, rays=2e6, sharp=0.03)
    assert any("known light" in note for note in known.notes)


@pytest.mark.slow
def test_the_base_of_a_table_is_known_though_nothing_leaves_near_the_horizon() -> None:
    """There is no Lambertian floor in it; of what leaves by the same distribution from anywhere patches know most."""
    paint = {"kind": "bsdf", "bsdf": table_without_a_horizon()}
    scene = painted(floor=paint, left=paint, right=paint, back=paint)
    known = seen(et.Scene(**scene), rays_per_pixel=2048, seed=3, gather=True)
    agrees_with_the_light_image(scene=scene, gathered=known, rays=2e6, sharp=0.03)
    assert any("known light" in note for note in known.notes)
    # In a chamber most of the light has met the wall before.
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 2.5}, "flux": 1, "at": [4.5, 3, 0.1]}
    walls = [{"shape": {"kind": "cylinder", "radius": 20, "height": 20}}, {"shape": {"kind": "disk", "radius": 20}}]
    chamber = et.Scene(sources=[lamp], surfaces=[{**wall, "finish": paint} for wall in walls])
    look = {"observer": et.Observer(55, 0, 1000), "screen": et.Screen(50, 25, 20, 10), "rays_per_pixel": 512, "seed": 3}
    plain, known = (et.luminance_map(chamber, gather=gather, **look) for gather in (False, True))
    lit = plain.values > 0.05 * np.median(plain.values)
    assert np.median((plain.standard_error[lit] / known.standard_error[lit]) ** 2) > 1.2


@pytest.mark.slow
def test_gloss_paint_is_known_but_for_what_it_mirrors() -> None:
    """Light that leaves a coat depends on the angle; mirror images are in no light image: beside lines that go on."""
    gloss = {"kind": "coated", "index": 1.3, "base_reflectance": 0.95}
    mixed = {"kind": "mixture", "parts": [gloss, WHITE], "weights": [0.5, 0.5]}
    scene = et.Scene(**painted(floor=gloss, left=gloss, right=mixed, back=gloss))
    known = seen(scene, rays_per_pixel=2048, seed=3, forward_rays=0, gather=True)
    exact = seen(scene, rays_per_pixel=4096, seed=7, forward_rays=0)
    error = np.hypot(known.standard_error, exact.standard_error)
    lit = exact.values > 0.05 * np.median(exact.values)
    # Few lines find mirror images of the lamp, and every pixel's error holds what those beside it have found of them.
    assert np.median(error[lit] / exact.values[lit]) < 0.08
    assert_agree(values=known.values[lit], expected=exact.values[lit], standard_error=error[lit], degrees=REVERSE)


@pytest.mark.slow
def test_noise_is_smaller(gathered: et.LuminanceMap) -> None:
    exact = seen(et.Scene(**tray()), rays_per_pixel=1024, seed=4)
    lit = exact.values > 0.2 * np.median(exact.values)
    ratio = (exact.standard_error[lit] / gathered.standard_error[lit]) ** 2
    assert np.median(ratio) > 1.1
    assert "lines of sight that go on to the sources" in " ".join(gathered.notes)
    assert "leave gather out" not in " ".join(gathered.notes)


@pytest.mark.slow
def test_integrating_sphere() -> None:
    """V6: L = ρ (E₀ + E_r)/π, as in test_scene_map, to a fraction of its error."""
    radius, reflectance, flux, top = 10.0, 0.9, 3.0, 8.0
    area = 4 * math.pi * radius**2
    port = (radius - top) / (2 * radius)
    inside = np.array([0.6, 0.64, -0.48])
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 0.01}, "flux": flux, "at": 9.99 * inside,
            "toward": -inside}  # fmt: skip
    wall = {"shape": {"kind": "sphere", "radius": radius}, "trim": {"z": [-11, top]},
            "finish": {"kind": "lambertian", "reflectance": reflectance}}  # fmt: skip
    reflected = reflectance * flux * (1 - port) / (area * (1 - reflectance * (1 - port)))
    expected = reflectance / math.pi * (flux / area + reflected) * 1e6
    lmap = et.luminance_map(
        et.Scene(sources=[lamp], surfaces=[wall]),
        et.Observer(8, 200, 60, target=(0, 0, 8)),
        et.Screen(5, 4, 5, 4),
        rays_per_pixel=1024,
        gather=True,
    )
    assert_agree(
        values=lmap.values,
        expected=np.full(lmap.values.shape, expected),
        standard_error=lmap.standard_error,
        degrees=REVERSE,
    )
    # The mean of such maps scatters by 0.25 % (eight seeds); without patches by 0.8 %, of half as many lines.
    assert abs(lmap.values.mean() / expected - 1) < 3.9 * 2.5e-3


@pytest.mark.slow
def test_no_light_is_counted_twice() -> None:
    """A lens throws a caustic on the floor, which lights the walls; a beam falls on a side: what the light image adds and
    what the patches send are shared out."""
    lens = {"name": "lens", "shape": {"kind": "ball", "radius": 3}, "medium": "BK7", "at": [-6, 4, 6]}
    beam = {"kind": "beam", "shape": {"kind": "disk", "radius": 2}, "flux": 20, "at": [0, -3, 30],
            "toward": [0.5, 0.1, -1]}  # fmt: skip
    scene = et.Scene(**{**tray(solids=[lens]), "sources": [*tray()["sources"], beam]})
    both = seen(scene, rays_per_pixel=1024, seed=4, forward_rays=5e5, gather=True)
    image = et.trace(scene, 1e6, 3).images["image"]
    # Pixels in which the lens or the lamp is seen show what a light image cannot.
    right, up, _ = image.screen.axes(image.observer)
    points = np.array(image.observer.target) + image.screen.x[:, None] * right + image.screen.y[:, None, None] * up
    sight = points - image.observer.position
    sight /= np.linalg.norm(sight, axis=-1, keepdims=True)
    clear = image.values > 0
    for centre, radius in ((np.array([-6.0, 4.0, 6.0]), 3.0), (np.array([-12.0, 8.0, 5.0]), 1.5)):
        off = np.linalg.norm(np.cross(image.observer.position - centre, sight), axis=-1)
        clear &= off > radius + math.hypot(4, 4) / 2
    assert clear.sum() > 50
    error = np.hypot(image.standard_error, both.standard_error)
    assert_agree(values=both.values[clear], expected=image.values[clear], standard_error=error[clear], degrees=REVERSE)


@pytest.mark.slow
def test_triangles_of_a_mesh_are_patches(tmp_path: Any) -> None:
    """A dented bowl of small triangles and one of large ones, beside lines of sight that go on."""
    import trimesh

    bowl = trimesh.creation.icosphere(subdivisions=4, radius=12)
    bowl.update_faces(bowl.triangles_center @ [0.1, 0.05, -1.0] > -3.1)
    bowl.apply_scale([1.0, 0.8, 0.9])
    bowl.export(tmp_path / "bowl.stl")
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 5, "at": [3, 1, -4],
            "toward": [-1, 0, -0.5]}  # fmt: skip
    scene = et.Scene(
        sources=[lamp],
        surfaces=[{"name": "bowl", "shape": {"kind": "mesh", "file": str(tmp_path / "bowl.stl")}, "finish": WHITE}],
    )
    eye, screen = et.Observer(20, 40, 200, target=(0, 0, -4)), et.Screen(18, 14, 6, 5)
    known = et.luminance_map(scene, eye, screen, rays_per_pixel=512, gather=True)
    exact = et.luminance_map(scene, eye, screen, rays_per_pixel=2048, seed=7)
    lit = exact.values > 0
    error = np.hypot(known.standard_error, exact.standard_error)[lit]
    assert_agree(values=known.values[lit], expected=exact.values[lit], standard_error=error, degrees=REVERSE)
    # Per line of sight, the variance is smaller; the rest is that of the light that comes straight from the lamp.
    assert np.median((exact.standard_error[lit] / known.standard_error[lit]) ** 2) * 4 > 1.2


@pytest.mark.slow
def test_the_same_bits_for_any_number_of_threads() -> None:
    asked = functools.partial(seen, et.Scene(**tray()), rays_per_pixel=64, seed=3, gather=True)
    for look in (asked, looked_into):
        one, seven = (look(threads=n) for n in (1, 7))
        assert np.array_equal(one.values, seven.values)
        assert np.array_equal(one.standard_error, seven.standard_error)
        assert one.notes == seven.notes


def test_nothing_diffuse_is_told() -> None:
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 5}
    lmap = et.luminance_map(
        et.Scene(sources=[lamp]), et.Observer(0, 0, 100), et.Screen(2, 2, 2, 2), rays_per_pixel=4, gather=True
    )
    assert any("no surface with a diffuse base" in note for note in lmap.notes)
    assert lmap.values.max() > 0


def test_a_difference_is_told() -> None:
    """The comparison is judged by the errors of both: passes of one mean, lines of another."""
    rng = np.random.default_rng(3)
    exact = [rng.normal(10.0, 1.0, (40, 30)) for _ in range(2)]
    for shift, told in ((0.0, False), (0.5, True)):
        passes = [blocks(rng.normal(10.0 + shift, 0.3, (40, 30))) for _ in range(16)]
        found = Comparison.of(passes, exact)
        assert found is not None
        assert found.differs is told
        assert found.bias >= max(abs(found.difference), found.error)
        assert abs(found.difference - shift / 10) < 3.9 * found.error
        # Of 1 200 pixels twice.
        assert found.error == pytest.approx(0.1 / math.sqrt(2400), rel=0.1)
    assert len(passes[0]) == BLOCKS**2 + 1
    assert Comparison.of(passes, [np.diag([1.0, 0, 0, 0, 0]) * k for k in (1.0, 2.0)]) is None


LINES = 656
"""For each of the 800 pixels of the cup: enough that patches are tried unasked."""


INTO = et.Observer(35, 30, 400, target=(0, 0, 12)), et.Screen(20, 18, 32, 25)


def cup() -> et.Scene:
    """White, open above, with a lamp beside its axis and a grey base: most light has been scattered many times."""
    white, grey = ({"kind": "lambertian", "reflectance": share} for share in (0.95, 0.9))
    side = {"name": "side", "shape": {"kind": "cylinder", "radius": 20, "height": 25}, "finish": white}
    base = {"shape": {"kind": "disk", "radius": 20}, "finish": grey}
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 4}, "flux": 10, "at": [9, 2, 1]}
    return et.Scene(sources=[lamp], surfaces=[side, base])


def looked_into(**how: Any) -> et.LuminanceMap:
    return et.luminance_map(cup(), *INTO, **{"rays_per_pixel": LINES, "seed": 5} | how)


@functools.cache
def looked_into_by_default() -> et.LuminanceMap:
    return looked_into()


def planted(monkeypatch: pytest.MonkeyPatch, *, factor: float, first: int) -> None:
    """Patches that send out too much light, from a pass on."""
    real = _core.look_at_scene

    def look(*arguments: Any) -> list[Array]:
        values, *rest = real(*arguments)
        number, known = arguments[6], arguments[9]
        return [values * factor if known is not None and number >= first else values, *rest]

    monkeypatch.setattr(_core, "look_at_scene", look)


@pytest.mark.slow
def test_patches_that_differ_from_lines_are_left_out() -> None:
    """In the pilot or after it; what is left is the map of lines that go on, bit by bit."""
    assert 800 * LINES >= LEAST_LINES
    plain, unspoilt = looked_into(gather=False), looked_into_by_default()
    assert any("in a pilot" in note for note in unspoilt.notes)
    assert not np.array_equal(unspoilt.values, plain.values)
    for first, told in ((0, False), (2 * PILOT, True)):
        with pytest.MonkeyPatch.context() as patch:
            planted(patch, factor=1.2, first=first)
            spoilt = looked_into()
        assert np.array_equal(spoilt.values, plain.values)
        assert np.array_equal(spoilt.standard_error, plain.standard_error)
        assert (NOT_TAKEN in spoilt.notes) is told


@pytest.mark.slow
def test_what_the_comparison_leaves_open_is_in_the_errors() -> None:
    """The spread of the passes and, in common, the difference to lines that go on, or what of it these cannot tell."""
    lmap = looked_into_by_default()
    common = common_error(lmap=lmap)
    assert 1e-4 < common < 0.05
    lit = lmap.values > 0
    assert (lmap.standard_error[lit] > 0.98 * common * lmap.values[lit]).all()
    assert lmap.common_error == pytest.approx(common, rel=0.05)  # the note has two digits
    whole = et.region_statistics(lmap, et.Region(-99, 99, -99, 99))
    shared = np.minimum(lmap.common_error * lmap.values, lmap.standard_error)
    apart = np.sqrt((lmap.standard_error**2 - shared**2).sum()) / lmap.values.size
    assert whole.mean_error_apart == pytest.approx(math.hypot(apart, shared.mean()), rel=1e-12)
    assert looked_into(rays_per_pixel=16, gather=False).common_error == 0.0
    table = et.sweep(
        cup(), {"side.finish.reflectance": [0.95]}, ["mean", "intensity"], *INTO, rays_per_pixel=LINES, seed=5
    )
    assert table["mean"][0] == pytest.approx(whole.mean, rel=1e-12)
    assert table.standard_error["mean"][0] == pytest.approx(whole.mean_error_apart, rel=1e-12)
    error = whole.mean_error_apart * lmap.intensity / whole.mean
    assert table.standard_error["intensity"][0] == pytest.approx(error, rel=1e-5)  # cosines differ between pixels


@pytest.mark.slow
def test_lines_go_on_where_patches_do_not_pay() -> None:
    """One diffuse plate under a lamp: nothing to gather, and the map is that of lines alone, bit by bit."""
    lamp = {
        "kind": "surface",
        "shape": {"kind": "disk", "radius": 1},
        "flux": 5,
        "at": [3, 1, 20],
        "toward": [0, 0, -1],
    }
    plate = {"shape": {"kind": "rectangle", "width": 40, "height": 30}, "finish": WHITE}
    scene = et.Scene(sources=[lamp], surfaces=[plate])
    eye, screen = et.Observer(30, 40, 300), et.Screen(20, 20, 64, 64)
    unasked, plain = (
        et.luminance_map(scene, eye, screen, rays_per_pixel=128, gather=gather) for gather in (None, False)
    )
    assert np.array_equal(unasked.values, plain.values)
    assert unasked.notes == plain.notes


@pytest.mark.slow
def test_colours_and_light_fields_are_gathered_too() -> None:
    """Two wavelengths of unequal shares, walls that reflect them unequally, a light field beside the lamp: the light image
    of rays forwards, which knows of no patches, has the same values."""
    field = et.LightField.fit(et.RingSource(rays=20_000), et.Disk(radius=30), depths=(3, 3, 2, 2))
    scene = tray()
    tint = {"kind": "lambertian", "reflectance": {"wavelength": [450, 650], "values": [0.9, 0.4]}}
    scene["surfaces"] = [dict(s, finish=tint if s["finish"] == WHITE else s["finish"]) for s in scene["surfaces"]]
    lamp = {**scene["sources"][0], "spectrum": [[450, 0.7], [650, 0.3]]}
    panel = {"kind": "light-field", "field": field, "flux": 20, "at": [0, 5, 60], "toward": [0, 0, -1],
             "spectrum": [[450, 0.1], [650, 0.9]]}  # fmt: skip
    coloured = et.Scene(**{**scene, "sources": [lamp, panel]})
    known = seen(coloured, rays_per_pixel=1024, seed=2, gather=True)
    image = et.trace(coloured, 2e6, 5).images["image"]
    right, up, _ = image.screen.axes(image.observer)
    points = np.array(image.observer.target) + image.screen.x[:, None] * right + image.screen.y[:, None, None] * up
    sight = points - image.observer.position
    sight /= np.linalg.norm(sight, axis=-1, keepdims=True)
    off = np.linalg.norm(np.cross(image.observer.position - np.array([-12.0, 8.0, 5.0]), sight), axis=-1)
    clear = (image.values > 0) & (off > 1.5 + math.hypot(4, 4) / 2)
    assert clear.sum() > 60
    error = np.hypot(known.standard_error, image.standard_error)
    assert np.median(error[clear] / image.values[clear]) < 0.03
    assert_agree(values=known.values[clear], expected=image.values[clear], standard_error=error[clear], degrees=REVERSE)


def test_it_is_not_tried_where_rays_hardly_end() -> None:
    """In a white ball: what rays do on their way would fill the memory, and take longer than lines of sight."""
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 5}
    for reflectance, few in ((0.5, True), (0.995, False)):
        white = {"kind": "lambertian", "reflectance": reflectance}
        scene = et.Scene(sources=[lamp], surfaces=[{"shape": {"kind": "sphere", "radius": 10}, "finish": white}])
        record = compile_scene(scene).record
        core = core_scene({**record, "detectors": []})
        assert scene_map._Surveys(core, record, 1, None).may_pay is few
