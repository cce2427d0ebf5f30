"""Maps of scenes against closed forms, against forward traces, and against each other; verdicts at 1e-4."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield import fit_cache
from etendue.luminance.methods import PathTracing
from etendue.luminance.scene_map import look_at_scene, with_fields
from etendue.quantities.luminance_map import LuminanceMap
from oracles.luminaires import corner
from oracles.verdicts import LARGEST_Z, assert_agree

Array = npt.NDArray[np.float64]


def sky(radius: float = 50.0) -> dict[str, Any]:
    """A surround of luminance 1 lm/(mm² sr) = 1e6 cd/m²."""
    return {"name": "sky", "kind": "surface", "shape": {"kind": "sphere", "radius": radius}, "side": "back",
            "flux": math.pi * 4 * math.pi * radius**2}  # fmt: skip


def seen(
    observer: et.Observer, screen: et.Screen, *, rays_per_pixel: int = 64, seed: int = 1, **scene: Any
) -> LuminanceMap:
    return et.luminance_map(et.Scene(**scene), observer, screen, rays_per_pixel=rays_per_pixel, seed=seed)


def test_what_lies_beside_a_lamp_changes_no_bit_of_its_image() -> None:
    """Only pixels whose lines may meet something are followed: a black body elsewhere widens that window, one without
    an end makes it the whole map."""
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 7, "exponent": 2, "at": [1, 2, 0.5]}
    near = {"kind": "surface", "shape": {"kind": "sphere", "radius": 0.02}, "flux": 1, "at": [-1, 2, 1]}
    wall = {"shape": {"kind": "rectangle", "width": 2, "height": 1}, "finish": {"kind": "lambertian", "reflectance": 0.6},
            "at": [0.5, 3.5, 1], "rotation": [80, 0, 10]}  # fmt: skip
    black = {"finish": {"kind": "lambertian", "reflectance": 0}}
    small = {"shape": {"kind": "disk", "radius": 0.1}, "at": [-6, -5, -30], **black}
    whole = {"shape": {"kind": "plane"}, "at": [0, 0, -60], **black}
    observer, screen = et.Observer(35, 40, 80, target=(0, 1, 0)), et.Screen(20, 16, 64, 48)
    bare = seen(observer, screen, sources=[lamp, near], surfaces=[wall])
    lit = np.argwhere(bare.values > 0)
    assert lit.min() > 3
    assert (lit.max(axis=0) < (44, 60)).all()
    for other in (small, whole):
        beside = seen(observer, screen, sources=[lamp, near], surfaces=[wall, other])
        assert np.array_equal(bare.values, beside.values)
        assert np.array_equal(bare.standard_error, beside.standard_error)


# --- without noise ---------------------------------------------------------------------------------------------------


def test_a_mirror_shows_the_surround() -> None:
    wall = {
        "shape": {"kind": "paraboloid", "focal_length": 3, "radius": 5},
        "finish": {"kind": "mirror", "reflectance": 0.8},
    }
    lmap = seen(et.Observer(20, 30, 40), et.Screen(4, 3, 8, 6), sources=[sky()], surfaces=[wall])
    # One bounce, or two: nothing in between.
    bounces = np.log(lmap.values / 1e6) / np.log(0.8)
    assert (bounces > 1 - 1e-9).all()
    assert np.isclose(np.round(bounces[lmap.standard_error == 0]), bounces[lmap.standard_error == 0], atol=1e-6).all()


@pytest.mark.parametrize("exponent", [1.0, 2.5])
@pytest.mark.parametrize("theta", [0.0, 25.0, 65.0])
def test_cosine_emitter(exponent: float, theta: float) -> None:
    """V2: L(θ) = Φ (n + 1)/(2π A) cosⁿ⁻¹θ."""
    flux, area = 80.0, 6.0 * 4.0
    source = {
        "kind": "surface",
        "shape": {"kind": "rectangle", "width": 6, "height": 4},
        "exponent": exponent,
        "flux": flux,
    }
    lmap = seen(et.Observer(theta, 40, 1e7), et.Screen(1, 1, 2, 2), rays_per_pixel=4, sources=[source])
    expected = flux * (exponent + 1) / (2 * np.pi * area) * math.cos(math.radians(theta)) ** (exponent - 1)
    assert np.allclose(lmap.values / 1e6, expected, rtol=1e-6)


def test_disk_in_a_dome() -> None:
    """V4: seen from afar at height h the line of sight starts at ρ = h/(n cos(i − i')), and L = T L₀/n²."""
    n, radius = 1.41, 3.0
    source = {
        "kind": "surface",
        "shape": {"kind": "disk", "radius": 1.2},
        "flux": math.pi * math.pi * 1.2**2,
        "at": [0, 0, 1e-9],
    }
    dome = {
        "name": "dome",
        "shape": {"kind": "dome", "radius": radius},
        "medium": "glass",
        "finishes": {"base": "absorber"},
    }
    screen = et.Screen(5, 5, 25, 25)
    lmap = seen(et.Observer(0, 0, 1e7), screen, sources=[source], solids=[dome], media={"glass": {"index": n}})
    # Beyond the dome nothing is asked for.
    h = np.minimum(np.hypot(screen.x[None, :], screen.y[:, None]), 2.99)
    i = np.arcsin(h / radius)
    r = np.arcsin(h / (n * radius))
    rho = h / (n * np.cos(i - r))
    with np.errstate(invalid="ignore", divide="ignore"):
        s, p = np.sin(i - r) ** 2 / np.sin(i + r) ** 2, np.tan(i - r) ** 2 / np.tan(i + r) ** 2
    reflectance = np.where(h > 0, (s + p) / 2, ((n - 1) / (n + 1)) ** 2)
    half = math.hypot(0.1, 0.1)
    inside, outside = rho < 1.2 - half, rho > 1.2 + half
    assert inside.sum() > 20
    # The pixel is a mean over h, and T bends downwards within it.
    assert np.allclose(lmap.values[inside] / 1e6, (1 - reflectance[inside]) / n**2, rtol=2e-4)
    assert (lmap.values[outside] < 1e-3 * 1e6).all()


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [3.0, 6.0])
def test_flashed_disk_of_a_parabola(tilt: float) -> None:
    """V5: a sphere of radius a at the focus flashes the paraboloid where (f + r²/4f) sin δ ≤ a: I = ρ L π r² cos δ, and the
    sphere itself adds L π a²."""
    f, a, reflectance = 10.0, 1.5, 0.85
    mirror = {"shape": {"kind": "paraboloid", "focal_length": f, "radius": 40},
              "finish": {"kind": "mirror", "reflectance": reflectance}}  # fmt: skip
    lamp = {
        "kind": "surface",
        "shape": {"kind": "sphere", "radius": a},
        "flux": math.pi * 4 * math.pi * a * a,
        "at": [0, 0, f],
    }
    lmap = seen(
        et.Observer(tilt, 25, 1e7), et.Screen(90, 90, 90, 90), rays_per_pixel=256, sources=[lamp], surfaces=[mirror]
    )
    sine = math.sin(math.radians(tilt))
    flashed = 4 * f * (a / sine - f)
    assert 0 < flashed < 40**2
    expected = reflectance * math.pi * flashed * math.cos(math.radians(tilt)) + math.pi * a * a
    error = math.sqrt((lmap.standard_error**2).sum()) * lmap.screen.pixel_area / 1e6
    assert error < 3e-3 * expected
    assert abs(lmap.intensity - expected) < LARGEST_Z * error
    assert lmap.values.max() <= (1 + reflectance) * 1e6 * (1 + 1e-12)


def test_slab_that_absorbs() -> None:
    """All reflections in a slab of transmittance τ: L = L₀ (1−R)² τ/(1−R²τ²) at the angle of each pixel."""
    n, absorption, thickness, theta = 1.6, 0.15, 3.0, 50.0
    lamp = {"kind": "surface", "shape": {"kind": "rectangle", "width": 400, "height": 400}, "flux": math.pi * 400 * 400}
    slab = {
        "shape": {"kind": "block", "width": 900, "height": 900, "depth": thickness},
        "medium": "dark",
        "at": [0, 0, 5],
    }
    lmap = seen(
        et.Observer(theta, 70, 1e7), et.Screen(2, 2, 3, 3), sources=[lamp], solids=[slab], surfaces=[
            {"shape": {"kind": "rectangle", "width": 400, "height": 400}, "at": [0, 0, -1], "finish": "absorber"}],
        media={"dark": {"index": n, "absorption": absorption}},
    )  # fmt: skip
    c = math.cos(math.radians(theta))
    across = math.sqrt(1 - (1 - c * c) / n**2)
    R = (((c - n * across) / (c + n * across)) ** 2 + ((across - n * c) / (across + n * c)) ** 2) / 2
    tau = math.exp(-absorption * thickness / across)
    expected = (1 - R) ** 2 * tau / (1 - (R * tau) ** 2)
    # Weak branches are drawn by chance: some noise, and no more.
    assert (lmap.standard_error < 2e-3 * lmap.values).all()
    error = lmap.standard_error.mean() / 3
    assert abs(lmap.values.mean() - 1e6 * expected) < LARGEST_Z * error + 1e-5 * lmap.values.mean()


# --- scattered light -------------------------------------------------------------------------------------------------


def test_integrating_sphere() -> None:
    """V6: a small Lambertian disk on the wall lights the sphere evenly, E₀ = Φ/A; L = ρ (E₀ + E_r)/π everywhere."""
    radius, reflectance, flux, top = 10.0, 0.8, 3.0, 8.0
    area = 4 * math.pi * radius**2
    port = (radius - top) / (2 * radius)
    inside = np.array([0.6, 0.64, -0.48])
    lamp = {
        "kind": "surface",
        "shape": {"kind": "disk", "radius": 0.01},
        "flux": flux,
        "at": 9.99 * inside,
        "toward": -inside,
    }
    wall = {"shape": {"kind": "sphere", "radius": radius}, "trim": {"z": [-11, top]},
            "finish": {"kind": "lambertian", "reflectance": reflectance}}  # fmt: skip
    hit = flux * (1 - port)
    reflected = reflectance * hit / (area * (1 - reflectance * (1 - port)))
    expected = reflectance / math.pi * (flux / area + reflected) * 1e6
    lmap = seen(
        et.Observer(8, 200, 60, target=(0, 0, 8)),
        et.Screen(5, 4, 5, 4),
        rays_per_pixel=1024,
        sources=[lamp],
        surfaces=[wall],
    )
    assert_agree(values=lmap.values, expected=np.full(lmap.values.shape, expected), standard_error=lmap.standard_error)
    assert abs(lmap.values.mean() / expected - 1) < 0.02


def test_diffuse_furnace() -> None:
    """White diffuse surfaces in an even surround cannot be seen."""
    white = {"kind": "lambertian", "reflectance": 1.0}
    leaves = [
        {"shape": {"kind": "disk", "radius": 3}, "finish": white},
        {
            "shape": {"kind": "rectangle", "width": 5, "height": 3},
            "finish": white,
            "axis": [0, 1, 0],
            "angle": 60,
            "at": [2, 0, 2],
        },
    ]
    lmap = seen(
        et.Observer(35, 20, 40), et.Screen(7, 6, 7, 6), rays_per_pixel=1024, sources=[sky()], surfaces=leaves
    )  # fmt: skip
    known = lmap.standard_error > 1e-6
    z = (lmap.values[known] - 1e6) / lmap.standard_error[known]
    # Of 16 passes the spread has 15 degrees of freedom: z² has the mean 15/13.
    assert (z**2).mean() < 15 / 13 * (1 + LARGEST_Z * math.sqrt(3 / known.sum()))
    assert np.allclose(lmap.values[~known], 1e6, rtol=1e-9)


@pytest.mark.slow
def test_rings_through_a_collecting_surface() -> None:
    """V1: the rings of thesis section 2.3, Lᵢ = Φᵢ/(π Aᵢ), by lines of sight, and by the cone from the rays that a surface
    before them kept."""
    rings = et.RingSource(rays=1000)
    scene = et.Scene(
        sources=[{"kind": "rings", "radii": [10, 20, 30], "flux": list(rings.ring_flux), "at": [0, 0, 5]}],
        detectors=[{"name": "rcs", "kind": "rays", "at": [3, -2, 25],
                    "shape": {"kind": "rectangle", "width": 200, "height": 200}}],
    )  # fmt: skip
    observer, screen = et.Observer(20, 30, 1000, target=(0, 0, 5)), et.Screen(72, 60, 12, 10, "xy")
    truth = rings.pixel_luminance(et.Observer(20, 30, 1000), screen)
    reverse = et.luminance_map(scene, observer, screen, rays_per_pixel=1024)
    within = 5 * reverse.standard_error + np.where(reverse.standard_error > 0, truth.max() / 32, 1e-9 * truth.max())
    assert (np.abs(reverse.values - truth) <= within).all()
    assert (reverse.standard_error == 0).sum() > 40
    # Pixels lie in the plane of the rings, where the cone has no width.
    incident = et.trace(scene, 4e6, 2).rays["rcs"]
    cone = et.luminance_map(incident, observer, screen, method="cone", acceptance=4.0)
    lit = cone.rays > 50
    assert lit.sum() > 60
    error = np.hypot(cone.standard_error, reverse.standard_error)[lit]
    assert_agree(values=cone.values[lit], expected=reverse.values[lit], standard_error=error)
    total = math.sqrt((error**2).sum())
    assert total < 0.012 * reverse.values[lit].sum()
    assert abs((cone.values - reverse.values)[lit].sum()) < LARGEST_Z * total


@pytest.mark.slow
def test_a_beam_on_paper() -> None:
    """L = ρ E/π with E = Φ cos α/A within the spot: lines of sight do not find it, rays forwards do."""
    tilt, radius, flux = math.radians(20), 6.0, 10.0
    direction = np.array([math.sin(tilt), 0, -math.cos(tilt)])
    scene = et.Scene(
        sources=[{"kind": "beam", "shape": {"kind": "disk", "radius": radius}, "flux": flux, "at": -50 * direction,
                  "toward": direction}],
        surfaces=[{"shape": {"kind": "rectangle", "width": 60, "height": 60}, "finish": {"kind": "lambertian",
                   "reflectance": 0.8}}],
    )  # fmt: skip
    eye, screen = et.Observer(35, 70, 300), et.Screen(6, 5, 6, 5, "xy")
    assert (et.luminance_map(scene, eye, screen, rays_per_pixel=16, forward_rays=0).values == 0).all()
    expected = 0.8 / math.pi * flux * math.cos(tilt) / (math.pi * radius**2) * 1e6
    for rays in (None, 1e6):
        lmap = et.luminance_map(scene, eye, screen, rays_per_pixel=16, forward_rays=rays)
        assert_agree(values=lmap.values, expected=expected, standard_error=lmap.standard_error)


@pytest.mark.slow
def test_no_light_is_counted_twice() -> None:
    """A lens throws a caustic on the floor, part of which lights the wall: lines of sight and rays forwards share the light
    out between them, and a whole light image has all of it, but for pixels in which the lens itself is seen."""
    centre, radius = np.array([3.0, 2.0, 6.5]), 2.5
    eye = {"name": "eye", "theta": 65, "phi": 105, "distance": 300, "target": [3, 2, 0],
           "screen": {"width": 26, "height": 20, "columns": 9, "rows": 7}}  # fmt: skip
    lens = {"name": "lens", "shape": {"kind": "ball", "radius": radius}, "medium": "BK7", "at": centre}
    scene = et.Scene(**corner(solids=[lens], observers=[eye]))
    image = et.trace(scene, 2e6, 3).images["image"]
    (both,) = et.luminance_map(scene, rays_per_pixel=2048, seed=4, forward_rays=2e6)
    (apart,) = et.luminance_map(scene, rays_per_pixel=64, seed=4)
    assert np.median(both.standard_error) < np.median(apart.standard_error)
    right, up, _ = image.screen.axes(image.observer)
    points = np.array(image.observer.target) + image.screen.x[:, None] * right + image.screen.y[:, None, None] * up
    sight = points - image.observer.position
    sight /= np.linalg.norm(sight, axis=-1, keepdims=True)
    off = np.linalg.norm(np.cross(image.observer.position - centre, sight), axis=-1)
    clear = off > radius + math.hypot(26 / 9, 20 / 7) / 2
    assert 30 < clear.sum() < clear.size
    error = np.hypot(image.standard_error, both.standard_error)
    assert_agree(values=both.values[clear], expected=image.values[clear], standard_error=error[clear], least=0.5)


# --- solids that touch -----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_cemented_bodies_are_one() -> None:
    """A rod in two halves of the same medium, and one within another: nothing is seen of where they touch."""
    whole = [
        {"name": "rod", "shape": {"kind": "rod", "radius": 2, "height": 4}, "medium": "PC", "rotation": [30, 10, 0]}
    ]
    half = {"shape": {"kind": "rod", "radius": 2, "height": 2}, "medium": "PC"}
    tilt = et.Scene(solids=whole).solids[0].frame()
    up = tilt.axes[:, 2] * 2
    at = [list(tilt.origin), list(tilt.origin + up)]
    halves = [{"name": f"half{i}", **half, "rotation": [30, 10, 0], "at": at[i]} for i in (0, 1)]
    nested = [
        *whole,
        {"name": "core", "shape": {"kind": "ball", "radius": 0.8}, "medium": "PC", "at": list(tilt.origin + up / 2)},
    ]
    lamp = {"kind": "surface", "shape": {"kind": "rectangle", "width": 3, "height": 30}, "flux": 100, "at": [1, 0, -9]}
    maps = [
        seen(et.Observer(35, 20, 60), et.Screen(7, 7, 16, 16), sources=[lamp], solids=solids, rays_per_pixel=64)
        for solids in (whole, halves, nested)
    ]
    for other in maps[1:]:
        error = np.hypot(maps[0].standard_error, other.standard_error)
        off = np.abs(other.values - maps[0].values)
        assert (off <= 1e-3 * maps[0].values.max() + 5 * error).all()
        assert np.median(off) <= 1e-9 * maps[0].values.max()


def test_an_immersed_source_keeps_its_luminance() -> None:
    """V10: L/n² along a line of sight; a die inside a block, seen straight on, is T L/n²."""
    n = 1.5
    die = {"kind": "surface", "shape": {"kind": "rectangle", "width": 2, "height": 2}, "flux": 4 * math.pi}
    block = {"shape": {"kind": "block", "width": 40, "height": 40, "depth": 4}, "medium": "glass", "at": [0, 0, -1],
             "finishes": {"bottom": "absorber"}}  # fmt: skip
    lmap = seen(
        et.Observer(0, 0, 1e6), et.Screen(1, 1, 2, 2), sources=[die], solids=[block], media={"glass": {"index": n}}
    )
    assert np.allclose(lmap.values / 1e6, 4 * n / (n + 1) ** 2 / n**2, rtol=1e-4)


# --- how it is asked for ---------------------------------------------------------------------------------------------


def test_the_same_bits_for_any_number_of_threads() -> None:
    scene = et.Scene(**corner())
    one, two, seven = (et.luminance_map(scene, rays_per_pixel=16, seed=4, threads=n)[0] for n in (1, 2, 7))
    for other in (two, seven):
        np.testing.assert_array_equal(other.values, one.values)
        np.testing.assert_array_equal(other.standard_error, one.standard_error)
    assert (et.luminance_map(scene, rays_per_pixel=16, seed=5)[0].values != one.values).any()


def test_more_passes_until_the_error_is_reached() -> None:
    scene = et.Scene(**corner())
    told: list[int] = []
    (rough,) = et.luminance_map(scene, rays_per_pixel=16)
    (fine,) = et.luminance_map(scene, rays_per_pixel=16, until=0.02, progress=told.append)

    def reached(lmap: LuminanceMap) -> float:
        assert lmap.relative_error is not None
        return lmap.relative_error.flux_weighted

    # No source is uncertain: the figure is that which is printed of the map.
    assert reached(fine) < 0.02 < reached(rough)
    assert any(note.startswith(f"sampling error {reached(fine):.2%}") for note in fine.notes)
    assert rough.rays.max() == rough.rays.min() == 16
    assert 16 < fine.rays.max() <= 64 * 16
    assert told[-1] == fine.rays.sum()
    assert told == sorted(told)
    (capped,) = et.luminance_map(scene, rays_per_pixel=4, until=1e-5)
    assert capped.rays.max() == 64 * 4
    assert any("stopped before" in note for note in capped.notes)


@pytest.mark.parametrize(("rays", "passes", "paths"), [(1, 4, 1), (5, 5, 1), (16, 16, 1), (17, 16, 2), (256, 16, 16)])
def test_lines_of_sight_come_in_passes(rays: int, passes: int, paths: int) -> None:
    how = PathTracing(rays_per_pixel=rays)
    assert (how.passes, how.paths) == (passes, paths)


def test_error_bars_hold() -> None:
    """The spread of maps with other seeds is what each of them says of itself."""
    scene = et.Scene(**corner())
    maps = [et.luminance_map(scene, rays_per_pixel=64, seed=s)[0] for s in range(1, 25)]
    values = np.array([m.values for m in maps])
    stated = np.array([m.standard_error**2 for m in maps]).mean(axis=0)
    ratio = (values.var(axis=0, ddof=1) / stated).mean()
    pixels = values[0].size
    assert abs(ratio - 1) < LARGEST_Z * math.sqrt(2 / (23 * pixels) + 2 / (24 * 15 * pixels)) * 1.2


@pytest.mark.slow
def test_rays_are_fitted_before_they_are_looked_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(fit_cache.FOLDER_VARIABLE, str(tmp_path / "kept"))
    # On the disk itself, for which a search takes seconds.
    fit = et.LightField.fit
    disk = et.Disk(radius=30)
    monkeypatch.setattr(et.LightField, "fit", staticmethod(lambda rays, _, **how: fit(rays, disk, **how)))
    rings = et.RingSource(rays=20_000, seed=3)
    rays = et.RaySet.merge([et.RaySet(b.position, b.direction, b.flux) for b in rings.batches()])
    et.write_rays(tmp_path / "rings.tm25ray", rays)
    # The same rays as a file and in memory: the second map finds the field of the first.
    for given in ({"file": tmp_path / "rings.tm25ray"}, {"rays": et.read_rays(tmp_path / "rings.tm25ray")}):
        scene = et.Scene(sources=[{"name": "led", "kind": "rays", "flux": 300, "at": [0, 0, 5], **given}])
        (lmap,) = et.luminance_map(scene, [et.Observer(0, 0, 1000)], et.Screen(12, 12, 4, 4), rays_per_pixel=64)
        assert any("light field" in note for note in lmap.notes)
        # Half of the flux, half of the luminance; what the field does not know is in the error, and may go together all over
        # the map.
        assert (lmap.standard_error > 0).all()
        error = float(lmap.standard_error.mean())
        assert error < 0.05 * lmap.values.mean()
        assert abs(lmap.values.mean() - rings.zone_luminance[0] / 2) < LARGEST_Z * error
    fitted, notes = with_fields(scene)
    assert fitted.sources[0].kind == "light-field"
    assert fitted.sources[0].name == "led"
    assert len(notes) == 1


def test_what_cannot_be_seen_is_told() -> None:
    scene = et.Scene(
        sources=[
            {"name": "spot", "kind": "point", "flux": 1},
            {"name": "laser", "kind": "beam", "shape": {"kind": "disk", "radius": 1}, "flux": 1},
        ]
    )
    lmap = et.luminance_map(scene, et.Observer(0, 0, 100), et.Screen(1, 1, 1, 1), rays_per_pixel=4)
    assert lmap.values[0, 0] == 0.0
    assert any("spot" in note for note in lmap.notes)
    assert any("laser" in note for note in lmap.notes)
    assert any("dark" in note for note in lmap.notes)


def test_options_belong_to_their_sources() -> None:
    scene, eye, screen = et.Scene(**corner()), et.Observer(0, 0, 100), et.Screen(1, 1, 1, 1)
    with pytest.raises(ArgumentError, match="Cone is for rays, and the source is a scene"):
        et.luminance_map(scene, eye, screen, method="cone")
    for wrong in ({"acceptance": 2.0}, {"surface": et.Plane(z=0)}, {"samples": 4}):
        with pytest.raises(ArgumentError, match=next(iter(wrong))):
            et.luminance_map(scene, eye, screen, **wrong)  # type: ignore[call-overload]
    for wrong in ({"rays_per_pixel": 4}, {"until": 0.1}, {"seed": 1}):
        with pytest.raises(ArgumentError, match=next(iter(wrong))):
            et.luminance_map(et.RingSource(rays=100), eye, screen, **wrong)  # type: ignore[call-overload]
    for nonsense in ({"rays_per_pixel": 0}, {"rays_per_pixel": 2**30}, {"until": -1.0}, {"seed": -1}, {"threads": 0}):
        with pytest.raises(ArgumentError, match=next(iter(nonsense))):
            et.luminance_map(scene, eye, screen, **nonsense)  # type: ignore[call-overload]
    with pytest.raises(ArgumentError, match="no observers"):
        et.luminance_map(et.Scene(sources=[sky()]))
    with pytest.raises(ArgumentError, match="no source"):
        look_at_scene(et.Scene(), [(eye, screen)], PathTracing())
    with pytest.raises(ArgumentError, match="give an observer"):
        et.luminance_map(scene, screen=screen)
