"""Sources of scenes: flux, units, colours and tables against what their files hold; detectors and observers."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue import _core
from etendue.errors import SceneError
from etendue.luminance import scene_map
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.spectrum import photopic_efficiency
from etendue.scene import Compiled, Scene, compile_scene, sources
from oracles import step

DISK = {"kind": "disk", "radius": 1}


def compiled(*given: Any, **keys: Any) -> Compiled:
    return compile_scene(Scene(sources=given, **keys))


def source(*given: Any, **keys: Any) -> dict[str, Any]:
    (record,) = compiled(*given, **keys).record["sources"]
    found: dict[str, Any] = record
    return found


def rays(**keys: Any) -> et.RaySet:
    return et.RaySet([[0, 0, 0], [1, 0, 0]], [[0, 0, 1], [0, 0.6, 0.8]], [1.0, 3.0], **keys)


# --- rays --------------------------------------------------------------------------------------------------------------


def test_rays_of_a_file_that_states_relative_flux(tmp_path: Path) -> None:
    """Scale times the sum of stored fluxes is the total: the file's, or the one that is asked for."""
    et.write_rays(tmp_path / "led.tm25ray", rays())
    stored = et.read_rays(tmp_path / "led.tm25ray").tally.flux
    for keys, total in (({}, 4.0), ({"flux": 900}, 900.0)):
        scene = Scene.from_dict({"sources": [{"kind": "rays", "file": "led.tm25ray", **keys}]}, folder=tmp_path)
        (record,) = compile_scene(scene).record["sources"]
        assert record["flux"] == pytest.approx(total, rel=1e-6)
        assert record["scale"] * stored == pytest.approx(total, rel=1e-6)
        assert len(record["rays"]) == 2


def test_rays_in_memory_with_relative_flux() -> None:
    """Stored 1 and 3, which share 10 lm: a factor of 2.5, and twice that for 20 lm."""
    relative = rays().replace(declared_flux=10.0)
    assert source(sources.Rays(rays=relative))["scale"] == pytest.approx(2.5)
    assert source(sources.Rays(rays=relative, flux=20))["scale"] == pytest.approx(5.0)


def test_watts_become_lumens_through_the_spectrum() -> None:
    """683 lm/W at 555 nm; with a flux of one's own the unit is a statement about that flux."""
    line = rays(flux_unit="W", spectra=(et.Spectrum([555.0], [1.0]),))
    assert source(sources.Rays(rays=line))["flux"] == pytest.approx(4.0)
    assert compiled(sources.Rays(rays=line)).flux_unit == "W"
    lumens = compiled(sources.Rays(rays=line, flux_unit="lm"))
    assert lumens.flux_unit == "lm"
    assert lumens.record["sources"][0]["flux"] == pytest.approx(4 * 683.0)
    stated = compiled(sources.Rays(rays=rays(flux_unit="W"), flux_unit="lm", flux=10))
    assert (stated.flux_unit, stated.record["sources"][0]["flux"]) == ("lm", 10.0)
    with pytest.raises(SceneError, match=r"sources\[0\]: .*spectrum"):
        compiled(sources.Rays(rays=rays(flux_unit="W"), flux_unit="lm"))


def test_watts_without_a_spectrum_become_lumens_through_the_colours_that_are_stated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """4 W at 500 nm are 4 K_m V(500) lm; of a spectrum with equal lumens at two lines, 4/Σ(½/(K_m V)); and back again."""
    watts, lumens = rays(flux_unit="W"), rays(flux_unit="lm")
    at = 683.0 * photopic_efficiency([500.0, 600.0])
    two = [[500, 1], [600, 1]]
    assert source(sources.Rays(rays=watts, flux_unit="lm", wavelength=500))["flux"] == pytest.approx(4 * at[0])
    assert source(sources.Rays(rays=watts, flux_unit="lm", spectrum=two))["flux"] == pytest.approx(4 / (0.5 / at).sum())
    assert source(sources.Rays(rays=lumens, flux_unit="W", spectrum=two))["flux"] == pytest.approx(4 / (0.5 * at).sum())
    # What rays of a file know themselves goes first.
    green = rays(flux_unit="W", spectra=(et.Spectrum([555.0], [1.0]),))
    assert source(sources.Rays(rays=green, flux_unit="lm", wavelength=500))["flux"] == pytest.approx(4 * 683.0)
    with pytest.raises(SceneError, match=r"V\(λ\) is 0 at wavelengths of \[900"):
        compiled(sources.Rays(rays=watts, flux_unit="lm", wavelength=900))

    # As a light field, and seen through a fitted one.
    def fitted(rays: et.RaySet, **_: Any) -> et.LightField:
        return et.LightField.fit(rays, et.Disk(radius=30), depths=(1, 1, 1, 1))

    monkeypatch.setattr(scene_map, "fit_or_recall", fitted)
    grey = et.RingSource(rays=500).ray_set().replace(flux_unit="W")
    field = fitted(grey)
    stated = sources.Field(field=field, flux_unit="lm", wavelength=500)
    assert source(stated)["flux"] == pytest.approx(field.total_flux * at[0])
    fits: scene_map.Fits = {}
    for line, efficacy in zip((500.0, 600.0), at, strict=True):
        scene = Scene(sources=[sources.Rays(rays=grey, flux_unit="lm", wavelength=line)])
        (seen,) = scene_map.with_fields(scene, cache=False, fits=fits)[0].sources
        assert isinstance(seen, sources.Field)
        assert seen.flux == pytest.approx(grey.total_flux * efficacy, rel=1e-3)


def test_streams_of_rays_are_sources_too() -> None:
    """A source that draws its rays, in memory."""
    record = source(sources.Rays(rays=et.RingSource(rays=1000)))
    assert record["flux"] == pytest.approx(600.0)
    with pytest.raises(SceneError, match="cannot be turned into"):
        compiled(sources.Rays(rays=et.RingSource(rays=1000), flux_unit="W"))


def test_rays_that_cannot_be_used(tmp_path: Path) -> None:
    dark = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [0.0])
    with pytest.raises(SceneError, match="carry no flux"):
        compiled(sources.Rays(rays=dark))
    far = et.RaySet.from_records(
        np.array([((0, 0, 1), 1.0)], dtype=[("direction", "<f8", (3,)), ("flux", "<f8")]), RaySetMeaning()
    )
    with pytest.raises(SceneError, match="directions only"):
        compiled(sources.Rays(rays=far))
    (tmp_path / "no.ray").write_bytes(b"nothing")
    scene = Scene.from_dict({"sources": [{"kind": "rays", "file": "no.ray"}]}, folder=tmp_path)
    with pytest.raises(SceneError, match="begins no ray file"):
        compile_scene(scene)


# --- colours -----------------------------------------------------------------------------------------------------------


def test_what_is_stated_goes_before_the_file_and_the_file_before_the_scene() -> None:
    blue = rays(spectra=(et.Spectrum([450.0], [1.0]),))
    assert source(sources.Rays(rays=rays()), wavelength=600)["wavelengths"].tolist() == [600]
    assert source(sources.Rays(rays=blue), wavelength=600)["wavelengths"].tolist() == [450]
    assert source(sources.Rays(rays=blue, wavelength=500))["wavelengths"].tolist() == [500]
    lines = source(sources.Rays(rays=blue, spectrum=[[500, 1], [600, 3]]))
    assert lines["wavelengths"].tolist() == [500, 600]
    assert lines["shares"].tolist() == [0.25, 0.75]


def test_rays_with_a_colour_each_keep_it_unless_one_is_stated() -> None:
    """Flux 1 and 3 at two wavelengths; what is stated for all goes before them, and is told."""
    coloured = rays(wavelength=[450.0, 600.0])
    found = compiled(sources.Rays(rays=coloured, name="led"))
    assert found.record["sources"][0]["wavelengths"].tolist() == [450, 600]
    assert found.record["sources"][0]["shares"].tolist() == [0.25, 0.75]
    assert found.notes == ()
    stated = compiled(sources.Rays(rays=coloured, name="led", wavelength=500))
    assert stated.record["sources"][0]["wavelengths"].tolist() == [500]
    assert stated.notes == ("led: the rays' own colours are not used, because 'wavelength' is stated for all of them",)


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"wavelength": 940}, True),
        ({"spectrum": [[550, 1], [850, 0.1]]}, True),
        ({"spectrum": [[550, 1], [850, 0]]}, False),
        ({"wavelength": 780}, False),
        ({"wavelength": 940, "flux_unit": "W"}, False),
    ],
)
def test_lumens_that_nobody_sees_are_told(keys: dict[str, Any], *, told: bool) -> None:
    """V(λ) ends at 360 and 830 nm."""
    notes = compiled(sources.Surface(shape=DISK, flux=1, **keys)).notes
    assert [note.startswith("sources[0]: at ") and 'flux_unit = "W"' in note for note in notes] == [True] * told


def test_a_spectrum_as_lines() -> None:
    """Lines by the nanometre: whatever is smooth in wavelength is weighted by them as by the integral over the spectrum."""
    nodes = np.array([400.0, 500.3, 550.0, 700.0, 900.0])
    weight = np.array([1.0, 2.0, 4.0, 1.0, 1.0])
    fine = np.linspace(400, 900, 500 * 64 + 1)
    for unit, seen in (("W", np.ones_like(fine)), ("lm", photopic_efficiency(fine))):
        wavelength, shares = et.Spectrum(nodes, weight).lines(unit)  # type: ignore[arg-type]
        assert np.diff(wavelength).max() < 1.0 + 1e-9
        assert shares.sum() == pytest.approx(1.0, rel=1e-12)
        light = np.interp(fine, nodes, weight) * seen
        for function in (lambda x: x, lambda x: 1.5 + 5e3 / x**2, lambda x: np.exp(-(((x - 460) / 20) ** 2))):
            expected = np.trapezoid(light * function(fine), fine) / np.trapezoid(light, fine)
            assert shares @ function(wavelength) == pytest.approx(expected, rel=1e-4)
    spectrum = et.Spectrum(nodes, weight)
    wavelength, shares = spectrum.lines("W")
    assert 683.0 * shares @ photopic_efficiency(wavelength) == pytest.approx(spectrum.luminous_efficacy, rel=3e-5)


def test_lines_of_spectra_of_any_extent() -> None:
    """Fine tables are left as they are, wide ones have some thousand lines, and one pair is one line."""
    fine = np.arange(400.0, 700.1, 0.5)
    assert et.Spectrum(fine, np.ones(fine.size)).lines("W")[0].tolist() == fine.tolist()
    wavelength, shares = et.Spectrum([1.0, 1e6], [1.0, 1.0]).lines("W")
    assert 4000 < wavelength.size < 4200
    assert wavelength @ shares == pytest.approx(5e5, rel=1e-3)
    assert [part.tolist() for part in et.Spectrum([555.0], [2.0]).lines("lm")] == [[555.0], [1.0]]


# --- tables and surfaces -----------------------------------------------------------------------------------------------


def test_an_intensity_file_as_a_point(tmp_path: Path) -> None:
    """The table in radians; its flux, or the one that is stated."""
    spot = et.Intensity(c=[0, 90, 180, 270], gamma=[0, 30, 90], values=[[9, 4, 0], [9, 3, 0], [9, 2, 0], [9, 1, 0]])
    et.write_intensity(tmp_path / "spot.ies", spot)
    for keys, flux in (({}, spot.flux), ({"flux": 700}, 700.0)):
        scene = Scene.from_dict({"sources": [{"kind": "point", "file": "spot.ies", **keys}]}, folder=tmp_path)
        (record,) = compile_scene(scene).record["sources"]
        assert record["flux"] == pytest.approx(flux, rel=1e-4)
        assert np.degrees(record["gamma"]).tolist() == pytest.approx([0, 30, 90])
        assert np.degrees(record["c"]).tolist() == pytest.approx([0, 90, 180, 270])
        assert record["values"][2] == pytest.approx([9, 2, 0])
    in_memory = source(sources.Point(intensity=spot))
    assert in_memory["flux"] == pytest.approx(spot.flux)


def test_points_that_cannot_be() -> None:
    dark = et.Intensity(c=[0], gamma=[0, 90], values=[[0.0, 0.0]])
    with pytest.raises(SceneError, match="0 everywhere"):
        compiled(sources.Point(intensity=dark))
    with pytest.raises(SceneError, match="'flux_unit' is the file's own"):
        sources.Point(file="a.ies", flux_unit="W")


@pytest.mark.slow
def test_a_light_field(tmp_path: Path) -> None:
    """Its flux, or the one that is stated; from a file and from memory."""
    field = et.LightField.fit(et.RingSource(rays=50_000), et.Disk(radius=30), depths=(2, 2, 2, 2))
    field.save(tmp_path / "led.h5")
    scene = Scene.from_dict({"sources": [{"kind": "light-field", "file": "led.h5"}]}, folder=tmp_path)
    (record,) = compile_scene(scene).record["sources"]
    assert record["flux"] == pytest.approx(600.0, rel=1e-3)
    assert sum(record["field"].flux()) == pytest.approx(600.0, rel=1e-3)
    assert source(sources.Field(field=field, flux=5))["flux"] == 5.0


def test_a_gridded_source_has_the_flux_of_its_rays() -> None:
    """Coarse bins do not hold the flux of the rays; one factor over all patches gives it back."""
    rng = np.random.default_rng(3)
    position = np.column_stack([rng.random((4000, 2)) * [3, 2], np.zeros(4000)])
    direction = np.column_stack([rng.normal(size=(4000, 2)) * [0.4, 0.2] + [0.1, 0.3], np.ones(4000)])
    lamp = et.RaySet(position, direction, np.full(4000, 500 / 4000))
    grid = et.GriddedSource.fit(lamp, et.Plane(z=0), 1.0, 2.0)
    assert abs(grid.table_flux / 500 - 1) > 0.004
    scene = et.Scene(sources=[{"name": "led", "kind": "gridded", "gridded": grid, "draws": 5000, "wavelength": 600}])
    result = et.trace(scene, rays=None)
    assert result.ledger.total.flux == pytest.approx(500, rel=1e-9)
    assert any(f"multiplied by {500 / grid.table_flux:.4g}, to 500 lm" in note for note in result.notes)
    assert any("in no standard error" in note for note in result.notes)


def test_a_gridded_source_is_the_rays_that_it_draws(tmp_path: Path) -> None:
    """From a file and from memory: the same bits as drawn by hand, with the flux of the tables or the one that is stated."""
    made = et.RingSource(rays=20_000)
    batch = next(made.batches(20_000))
    et.write_rays(tmp_path / "rings.tm25ray", et.RaySet(batch.position, batch.direction, batch.flux))
    rays_read = et.read_rays(tmp_path / "rings.tm25ray")
    grid = et.GriddedSource.fit(rays_read, et.parse_surface("disk:radius=30"), 10.0, 5.0)
    drawn = grid.sample(1000, 7)
    keys = {"surface": "disk:radius=30", "pixel": 10, "threshold": 5, "draws": 1000, "seed": 7}
    by_file = {"kind": "gridded", "file": "rings.tm25ray", **keys}
    scene = Scene.from_dict({"sources": [by_file]}, folder=tmp_path)
    in_memory = sources.Gridded(gridded=grid, draws=1000, seed=7, flux=5)
    for record, flux in ((compile_scene(scene).record["sources"][0], grid.total_flux), (source(in_memory), 5.0)):
        found = _core.read_rays(record["rays"], 0, 1000)
        assert np.array_equal(found[0], drawn.position)
        assert record["flux"] == pytest.approx(flux, rel=1e-9)
        assert record["scale"] * found[2].sum() == pytest.approx(flux, rel=1e-6)


def test_surfaces_emit_on_the_side_that_is_asked_for() -> None:
    for side, flip in (("front", False), ("back", True)):
        record = source(sources.Surface(shape=DISK, flux=1, side=side, exponent=0, trim={"radius": [0, 0.5]}))
        assert (record["flip"], record["exponent"]) == (flip, 0.0)


@pytest.mark.parametrize(
    ("shape", "trim", "finite"),
    [
        ({"kind": "plane"}, {}, False),
        ({"kind": "plane"}, {"radius": [0, 3]}, True),
        ({"kind": "sphere", "radius": 1}, {}, True),
        ({"kind": "cylinder", "radius": 1, "height": 1}, {}, True),
        ({"kind": "paraboloid", "focal_length": 1}, {}, False),
        ({"kind": "paraboloid", "focal_length": 1}, {"z": [1, float("inf")]}, False),
        ({"kind": "paraboloid", "focal_length": 1}, {"z": [float("-inf"), 5]}, True),
        ({"kind": "paraboloid", "focal_length": 1, "radius": 3}, {}, True),
        ({"kind": "ellipsoid", "focus": 1, "second_focus": 2}, {}, True),
        ({"kind": "hyperboloid", "focus": 1, "virtual_focus": 2}, {}, False),
        ({"kind": "hyperboloid", "focus": 1, "virtual_focus": 2}, {"z": [float("-inf"), 5]}, True),
    ],
)
def test_surfaces_without_an_end_cannot_emit(shape: dict[str, Any], trim: dict[str, Any], finite: bool) -> None:
    """Flux over an infinite area is no luminance at all."""
    given = sources.Surface(shape=shape, flux=1, trim=trim)
    if finite:
        assert source(given)["flux"] == 1.0
    else:
        with pytest.raises(SceneError, match=r"sources\[0\]: shape: this surface has no end"):
            compiled(given)


TRIANGLE = {"kind": "mesh", "vertices": [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "triangles": [(0, 1, 2)]}


@pytest.mark.parametrize(
    ("keys", "place"),
    [
        ({"shape": {"kind": "disk", "radius": 1e-300}}, r"\.shape\.radius: is 1e-300; it must be at least 1e-100"),
        ({"shape": {"kind": "rectangle", "width": 1, "height": 1e-200}}, r"\.shape\.height: is 1e-200"),
        ({"shape": {"kind": "sphere", "radius": 1}, "trim": {"z": [5, 6]}}, r"\.trim: .* finite area"),
        (
            {"shape": {"kind": "torus", "major_radius": 2, "minor_radius": 1}, "trim": {"z": [0, 9]}},
            ": trim: a luminous torus cannot be cut; give the part that is left as a mesh",
        ),
        ({"shape": TRIANGLE, "trim": {"z": [0, 9]}}, ": trim: a luminous mesh cannot be cut"),
        (
            {"shape": {"kind": "sphere", "radius": 1}, "trim": {"half_spaces": [{"normal": [1, 0, 0]}]}},
            r": trim\.half_spaces: a luminous sphere cannot be cut by them",
        ),
    ],
)
def test_a_surface_that_cannot_emit_is_told_with_its_place(keys: dict[str, Any], place: str) -> None:
    """The core takes whatever is compiled."""
    with pytest.raises(SceneError, match=rf"sources\[0\]{place}"):
        compile_scene(Scene.from_dict({"sources": [{"kind": "surface", "flux": 1, **keys}]}))


@pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="STEP files need the extra [step]")
def test_a_luminous_body_of_a_file_says_how_far_its_triangles_are_off(tmp_path: Path) -> None:
    """As a body that light meets does."""
    (tmp_path / "ball.step").write_text(step.sphere(10.0), encoding="ascii")
    shape = {"kind": "mesh", "file": "ball.step", "tolerance": 0.5}
    scene = Scene.from_dict({"sources": [{"kind": "surface", "flux": 1, "shape": shape}]}, folder=tmp_path)
    (note,) = compile_scene(scene).notes
    assert re.fullmatch(r"sources\[0\]: .* triangles, with interpolated normals, .* \(chord error\); .*", note)


def test_the_smallest_surface_emits() -> None:
    shape = {"kind": "rectangle", "width": 1e-100, "height": 1e-100}
    least = Scene(sources=[{"kind": "surface", "flux": 1, "shape": shape}])
    assert et.trace(least, rays=100).ledger.escaped.rays == 100


def test_rings_are_annuli_with_their_own_flux() -> None:
    """Thesis section 2.3, in its place: three sources that share a frame and a colour."""
    found = compiled(sources.Rings(name="led", radii=[10, 20, 30], flux=[300, 200, 100], at=[0, 0, 5], wavelength=450))
    assert found.source_names == ("led.ring 1", "led.ring 2", "led.ring 3")
    edges = [(r["shape"]["outline"]["inner"], r["shape"]["outline"]["outer"]) for r in found.record["sources"]]
    assert edges == [(0, 10), (10, 20), (20, 30)]
    assert [r["flux"] for r in found.record["sources"]] == [300, 200, 100]
    assert all(r["frame"][2] == 5 and r["wavelengths"].tolist() == [450] for r in found.record["sources"])


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"kind": "rings", "radii": [1, 2], "flux": [1]}, "one for each ring"),
        ({"kind": "rings", "radii": [2, 1], "flux": [1, 1]}, "must rise"),
        ({"kind": "beam", "shape": {"kind": "plane"}, "flux": 1}, "unknown kind 'plane'"),
        ({"kind": "beam", "shape": {"kind": "sphere", "radius": 1}, "flux": 1}, "unknown kind 'sphere'"),
        ({"kind": "gridded", "surface": "plane:z=0", "gridded": None}, "'file' is missing"),
        ({"kind": "gridded", "file": "a", "surface": "plain:z=0"}, "unknown .*'plain'"),
        ({"kind": "surface", "shape": DISK, "flux": 0}, "must be greater than 0"),
        ({"kind": "surface", "shape": DISK, "flux": 1, "exponent": -1}, "must be at least 0"),
        ({"kind": "rays", "file": "a", "flux_unit": "lumen"}, "flux_unit: is 'lumen'. Did you mean 'lm'"),
    ],
)
def test_sources_that_are_none(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        Scene(sources=[keys])


# --- detectors ---------------------------------------------------------------------------------------------------------


def test_an_image_is_its_observers_view() -> None:
    keys = {"width": 10, "height": 20, "columns": 4, "rows": 8}
    scene = Scene(
        detectors=[{"kind": "image", "observer": "me"}],
        observers=[{"name": "me", "theta": 30, "phi": 40, "distance": 500, "target": [1, 2, 3], "screen": keys}],
    )
    observer = et.Observer(30, 40, 500, (1, 2, 3))
    assert compile_scene(scene).record["detectors"][0]["view"] == et.Screen(**keys).core_view(observer)
    assert scene.observers[0].observer() == observer
    assert scene.observers[0].screen.screen() == et.Screen(**keys)


def test_detectors_in_place() -> None:
    """Frames, trims and cells, and names in order."""
    rcs = {"kind": "rays", "name": "rcs", "shape": {"kind": "plane"}, "trim": {"radius": [0, 5]}, "at": [0, 0, 30]}
    grid = {"kind": "illuminance", "width": 4, "height": 2, "columns": 8, "rows": 3, "toward": [0, 0, -1]}
    found = compile_scene(Scene(detectors=[rcs, grid, {"kind": "intensity", "c_planes": 24, "gamma_step": 10}]))
    assert found.detector_names == ("rcs", "detectors[1]", "detectors[2]")
    first, second, third = found.record["detectors"]
    assert first["shape"]["outline"] == {"kind": "annulus", "inner": 0.0, "outer": 5.0}
    assert first["frame"][:3] == [0, 0, 30]
    assert second["frame"][9:] == [0, 0, -1]
    assert (second["columns"], second["rows"]) == (8, 3)
    assert third == {"kind": "intensity", "c_planes": 24, "gamma_step": 10}


@pytest.mark.parametrize("unit", ["lm", "W"])
def test_light_of_unknown_colours_beside_a_filter_is_told(unit: str) -> None:
    """A thing that is selective, and a colour that is taken: told if nobody stated it, however the scene was made."""
    dye = {"index": 1.33, "absorption": {"wavelength": [400, 700], "values": [0.2, 0.0]}}
    sheet = {"shape": {"kind": "disk", "radius": 1}, "at": [0, 0, 1], "finish": "cyan"}
    scene = et.Scene(
        finishes={"cyan": {"kind": "transmitter", "transmittance": {"wavelength": [400, 700], "values": [0.9, 0.1]}}},
        sources=[{"name": "lamp", "kind": "point", "flux": 1, "flux_unit": unit}],
        solids=[{"name": "cell", "shape": {"kind": "ball", "radius": 1}, "at": [0, 0, 5], "medium": dye}],
        surfaces=[sheet],
    )
    told = "the colours of its light are not known, and the absorption of 'cell.medium', the finish 'cyan' treat wavelengths"

    def tells(given: et.Scene) -> bool:
        return any(note.startswith(f"lamp: {told} differently; 555 nm is taken") for note in compile_scene(given).notes)

    assert tells(scene)
    assert tells(scene.replace(name="again"))
    assert not tells(scene.replace(surfaces=[{**sheet, "finish": "mirror"}]))
    clear = [{"name": "cell", "shape": {"kind": "ball", "radius": 1}, "at": [0, 0, 5], "medium": "BK7"}]
    assert not any("not known" in note for note in compile_scene(scene.replace(surfaces=[], solids=clear)).notes)
    assert not tells(scene.replace(wavelength=555))
    assert not tells(scene.replace(sources=[scene.sources[0].replace(wavelength=555)]))
