"""The spectrum of a light field: that of the rays it was fitted to, kept in its file, and used wherever it shines."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import etendue as et
import h5py
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError, UnitError, UnknownNameError
from etendue.lightfield.carrier import Disk
from etendue.lightfield.light_field import LightField
from etendue.luminance import scene_map
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum, photopic_efficiency
from oracles.verdicts import assert_drawn_with

LINES, SHARES = np.array([450.0, 550.0, 633.0]), np.array([0.5, 0.3, 0.2])
WHITE = Spectrum([420, 450, 480, 560, 700], [0.0, 1.0, 0.2, 0.7, 0.0])


def rays(n: int = 2000, **keys: Any) -> et.RaySet:
    """2 W from a disk that is brighter on one side, nearly Lambertian, in three lines unless told otherwise."""
    rng = np.random.default_rng(2)
    radius, turn = np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    place = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(n)])
    sine, around = np.sqrt(0.98 * rng.random(n)), 2 * np.pi * rng.random(n)
    k = np.column_stack([sine * np.cos(around), sine * np.sin(around), np.sqrt(1 - sine**2)])
    flux = 1.0 + 0.5 * (place[:, 0] > 0.2)
    # Each line has its share of the flux, up to half a ray.
    spread = np.searchsorted(np.cumsum(SHARES)[:-1], (np.cumsum(flux) - flux / 2)[rng.permutation(n)] / flux.sum())
    own = {} if keys else {"wavelength": LINES[spread]}
    return et.RaySet(place, k, 2.0 * flux / flux.sum(), flux_unit="W", **own, **keys)


@pytest.fixture(scope="module")
def field() -> LightField:
    return LightField.fit(rays(), Disk(radius=1.2), depths=(3, 3, 3, 3))


def test_a_field_of_watts_knows_its_lumens(field: LightField) -> None:
    """K_m Σ Φ_e V(λ) of the rays, whose wavelengths are spread over all of the field."""
    source = rays()
    spectrum = field.spectrum
    assert isinstance(spectrum, SpectralLines)
    assert spectrum.wavelength.tolist() == LINES.tolist()
    wavelength = source.wavelength
    assert wavelength is not None
    expected = [float(source.flux[wavelength == line].sum()) for line in LINES]
    np.testing.assert_allclose(spectrum.weight / spectrum.weight.sum(), np.array(expected) / 2.0, rtol=1e-12)
    lumens = field.in_unit("lm")
    assert lumens.total_flux == pytest.approx(683.0 * np.array(expected) @ photopic_efficiency(LINES), rel=1e-9)
    assert lumens.total_flux == pytest.approx(source.in_unit("lm").total_flux, rel=1e-9)
    assert lumens.flux_unit == "lm"
    assert any("which all rays have together" in note for note in lumens.notes)
    point, up = [[0.1, 0.2, 0.0]], [[0.1, 0.0, 1.0]]
    both = lumens.luminance(points=point, directions=up)[0] / field.luminance(points=point, directions=up)[0]
    assert both[0] == pytest.approx(lumens.total_flux / 2.0, rel=1e-9)
    assert lumens.in_unit("W").total_flux == pytest.approx(2.0, rel=1e-9)
    assert lumens.in_unit("W").spectrum is spectrum
    with pytest.raises(UnitError, match="knows no spectrum"):
        field.replace(spectrum=None).in_unit("lm")
    with pytest.raises(UnitError, match="V\\(λ\\) is 0"):
        field.replace(spectrum=Spectrum([300.0], [1.0])).in_unit("lm")


def test_what_a_set_says_of_all_its_rays_is_what_its_field_knows() -> None:
    """A spectrum for all, one wavelength for all, spectra by index, none; rays that state none are told of."""

    def fitted(source: et.RaySet) -> LightField:
        return LightField.fit(source, Disk(radius=1.2), depths=(2, 2, 2, 2))

    assert fitted(rays(2000, spectra=(WHITE,))).spectrum is WHITE
    plain = rays(2000, spectra=()).replace(spectra=())
    assert fitted(plain).spectrum is None
    single = fitted(plain.replace(single_wavelength=600.0)).spectrum
    assert single is not None
    assert single.wavelength.tolist() == [600.0]
    source = rays(2000)
    holes = np.where(np.arange(2000) < 500, -1.0, source.wavelength)
    broken = et.RaySet(source.position, source.direction, source.flux, flux_unit="W", wavelength=holes)
    assert any("500 rays with" in note for note in fitted(broken).notes)


@pytest.mark.parametrize("spectrum", [SpectralLines(LINES, SHARES, "lm"), WHITE, Spectrum([555.0], [2.0]), None])
def test_the_spectrum_is_kept_in_the_file(field: LightField, spectrum: Any, tmp_path: Path) -> None:
    path = tmp_path / "led.h5"
    field.replace(spectrum=spectrum).save(path)
    found = LightField.load(path).spectrum
    assert type(found) is type(spectrum)
    if spectrum is not None:
        assert found is not None
        assert found.wavelength.tolist() == spectrum.wavelength.tolist()
        assert found.weight.tolist() == spectrum.weight.tolist()
        assert found.luminous_efficacy == spectrum.luminous_efficacy
        with h5py.File(path, "a") as file:
            del file["spectrum"]
        # As files of before have it.
        assert LightField.load(path).spectrum is None


@pytest.mark.parametrize("wrong", ["kind", "order", "length", "missing"])
def test_a_damaged_spectrum_is_refused(field: LightField, wrong: str, tmp_path: Path) -> None:
    path = tmp_path / "led.h5"
    field.save(path)
    with h5py.File(path, "a") as file:
        group = file["spectrum"]
        if wrong == "kind":
            group.attrs["kind"] = "rainbow"
        elif wrong == "order":
            group["wavelength"][...] = LINES[::-1]
        else:
            del group["weight"]
            if wrong == "length":
                group["weight"] = SHARES[:2]
    with pytest.raises(FormatError, match="spectrum"):
        LightField.load(path)


def test_drawn_rays_have_wavelengths_with_their_shares(field: LightField, tmp_path: Path) -> None:
    """In memory, in a stream and in a file; whatever the place and direction, by their shares of the flux."""
    n = 60_000
    share = np.asarray(field.spectrum.weight) / field.spectrum.weight.sum()  # type: ignore[union-attr]
    drawn = field.sample(n, seed=3)
    wavelength = drawn.wavelength
    assert wavelength is not None
    for line, expected in zip(LINES, share, strict=True):
        assert_drawn_with(share=float(expected), hits=int((wavelength == line).sum()), rays=n)
        right = drawn.position[:, 0] > 0.2
        assert_drawn_with(share=float(expected), hits=int((wavelength[right] == line).sum()), rays=int(right.sum()))
    stream = field.rays(n, seed=3)
    parts = [stream.wavelength_of(batch) for batch in stream.batches(7001)]
    assert np.concatenate(parts).tolist() == wavelength.tolist()  # type: ignore[arg-type]
    et.write_rays(tmp_path / "drawn.tm25ray", stream)
    et.write_rays(tmp_path / "drawn.sdf", stream)
    for name in ("drawn.tm25ray", "drawn.sdf"):
        again = et.read_rays(tmp_path / name).wavelength
        assert again is not None
        np.testing.assert_allclose(again, wavelength, rtol=1e-6)
    for name, stored_total in (("speos", True), ("speos-text", False)):
        et.write_rays(tmp_path / name, field.rays(1000, seed=3), name)
        rays_again = et.read_rays(tmp_path / name)
        assert rays_again.column("wavelength").tolist() == wavelength[:1000].tolist()
        np.testing.assert_allclose(rays_again.direction, drawn.direction[:1000], atol=1e-6)
        if stored_total:
            assert rays_again.total_flux == pytest.approx(field.total_flux, rel=1e-6)
    with pytest.raises(ArgumentError, match="drawn in lumens"):
        et.write_rays(tmp_path / "lumens.ray", field.in_unit("lm").rays(10), "speos")
    white = field.replace(spectrum=WHITE)
    et.write_rays(tmp_path / "white.tm25ray", white.rays(1000))
    read = et.read_rays(tmp_path / "white.tm25ray").spectra
    assert len(read) == 1
    np.testing.assert_allclose(read[0].wavelength, WHITE.wavelength)
    assert white.sample(10).spectra == (WHITE,)


def test_the_intensity_of_a_field_has_its_spectrum(field: LightField) -> None:
    assert field.intensity(4, 30.0).luminaire["spectrum"] == field.spectrum
    assert "spectrum" not in field.replace(spectrum=None).intensity(4, 30.0).luminaire


def filtered(source: dict[str, Any], *, plate: bool, **keys: Any) -> et.Scene:
    """The disk behind a sheet that lets 0.1, 0.5 and 0.9 of the lines through."""
    sheet = {"wavelength": LINES, "values": [0.1, 0.5, 0.9]}
    front = {"shape": {"kind": "rectangle", "width": 9e3, "height": 9e3}, "at": [0, 0, 2], "finish": "filter"}
    return et.Scene(
        sources=[{"name": "led", **source}],
        finishes={"filter": {"kind": "transmitter", "transmittance": sheet}} if plate else {},
        surfaces=[front] if plate else [],
        **keys,
    )


def test_a_field_shines_with_its_spectrum_forwards(field: LightField) -> None:
    n = 60_000
    screen = {
        "kind": "rays",
        "name": "out",
        "shape": {"kind": "rectangle", "width": 9e3, "height": 9e3},
        "at": [0, 0, 3],
    }
    result = et.trace(filtered({"kind": "light-field", "field": field}, plate=True, detectors=[screen]), n)
    seen = result.rays["out"]
    share = np.asarray(field.spectrum.weight) / field.spectrum.weight.sum()  # type: ignore[union-attr]
    for line, given, left in zip(LINES, share, [0.1, 0.5, 0.9], strict=True):
        hits = n * float(seen.flux[seen.wavelength == line].sum()) / 2.0
        assert_drawn_with(share=float(given * left), hits=hits, rays=n)
    assert any("the finish 'filter' treats its wavelengths differently" in note for note in result.notes)
    lumens = et.trace(filtered({"kind": "light-field", "field": field, "flux_unit": "lm"}, plate=False), 1000)
    assert lumens.ledger.total.flux == pytest.approx(field.in_unit("lm").total_flux, rel=1e-9)
    assert not any("treat" in note for note in lumens.notes)


@pytest.mark.parametrize("unit", ["W", "lm"])
def test_a_map_through_a_filter_takes_the_spectrum_of_the_field(field: LightField, unit: Any) -> None:
    """Looked at through the sheet, every pixel has Σ share · transmittance of what it has without."""
    sure = field.replace(
        parts=tuple(dataclasses.replace(part, deviation=np.zeros_like(part.deviation)) for part in field.parts)
    )
    observer, screen = et.Observer(20, 30, 400), et.Screen(1.0, 1.0, 6, 6)
    source = {"kind": "light-field", "field": sure, "flux_unit": unit}
    with_it, without = (
        et.luminance_map(filtered(source, plate=plate), observer, screen, rays_per_pixel=512) for plate in (True, False)
    )
    _, share = field.spectrum.lines(unit)  # type: ignore[union-attr]
    expected = float(share @ [0.1, 0.5, 0.9])
    ratio = with_it.values.sum() / without.values.sum()
    # The wavelength of a line of sight is chosen anew: over 6 × 6 × 512 of them the mean transmittance has this error.
    spread = np.sqrt(share @ (np.array([0.1, 0.5, 0.9]) - expected) ** 2 / (36 * 512))
    rough = np.sqrt((with_it.standard_error**2).sum()) / without.values.sum()
    assert abs(ratio - expected) < 3.9 * max(spread, rough)
    assert max(spread, rough) < 0.02 * expected
    assert any("the finish 'filter'" in note and "all its rays together" in note for note in with_it.notes)
    assert not any("all its rays together" in note for note in without.notes)


def test_a_map_of_a_ray_file_takes_the_spectrum_of_its_rays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The set is fitted; its lines are those of the map, and what tells them apart is named.

    Which surface suits the rays is not the question here.
    """
    monkeypatch.setattr(
        scene_map, "fit_or_recall", lambda rays, **_: LightField.fit(rays, Disk(radius=1.2), depths=(2, 2, 2, 2))
    )
    et.write_rays(tmp_path / "led.tm25ray", rays(2000))
    lens = {"shape": {"kind": "ball", "radius": 2}, "at": [0, 0, 4], "medium": "BK7"}
    scene = et.Scene(sources=[{"name": "led", "kind": "rays", "file": tmp_path / "led.tm25ray"}], solids=[lens])
    seen = et.luminance_map(scene, et.Observer(0, 0, 400), et.Screen(1, 1, 2, 2), rays_per_pixel=4)
    assert any("led" in note and "the index of 'BK7' treats its wavelengths differently" in note for note in seen.notes)
    stated = scene.replace(sources=(scene.sources[0].model_copy(update={"wavelength": 550.0}),))
    seen = et.luminance_map(stated, et.Observer(0, 0, 400), et.Screen(1, 1, 2, 2), rays_per_pixel=4)
    assert not any("treat" in note for note in seen.notes)


def test_watts_of_unknown_colour_are_told_of() -> None:
    source = {"kind": "rays", "rays": rays(100, spectra=()), "name": "led"}
    told = "led: its watts have no known wavelength; 555 nm is taken, which decides what they are in lumens"
    assert told in et.trace(et.Scene(sources=[source]), None).notes
    assert told not in et.trace(et.Scene(sources=[source], wavelength=600), None).notes


def test_scenes_say_what_a_field_says_of_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines that pass its sphere, counted by their distance from its middle, and one efficacy for two colours.

    Blue light goes up and red light down, so that lumens in proportion to watts are wrong on either side. What a map
    fits to rays by itself is no other field.
    """
    rng = np.random.default_rng(4)
    place, k = 0.2 * rng.normal(size=(4000, 3)), rng.normal(size=(4000, 3))
    k /= np.linalg.norm(k, axis=1)[:, None]
    missing = int((np.linalg.norm(np.cross(place, k), axis=1) > 0.5).sum())
    red = float((k[:, 2] < 0).mean())
    sided = et.RaySet(
        place, k, np.full(4000, 1 / 4000), flux_unit="W", wavelength=np.where(k[:, 2] < 0, LINES[2], LINES[0])
    )
    sphere = et.Sphere(radius=0.5, centre=(0.0, 0.0, 0.0))
    mixed = LightField.fit(sided, sphere, depths=(2, 2, 2, 2))
    lost = f"led: {missing} of 4,000 rays ({missing / 4000:.3%} of the flux) do not meet"
    efficacy = 683.0 * float(photopic_efficiency(LINES[[0, 2]]) @ [1 - red, red])
    tolerance = 3.9 * 683.0 * np.sqrt(0.25 / 4000)  # the field knows the colours of the rays that meet it alone

    def told(source: dict[str, Any]) -> tuple[tuple[str, ...], tuple[str, ...]]:
        scene = et.Scene(sources=[{"name": "led", **source}])
        seen = et.luminance_map(scene, et.Observer(0, 0, 100), et.Screen(1, 1, 2, 2), rays_per_pixel=4)
        return et.trace(scene, 1000).notes, seen.notes

    for notes in told({"kind": "light-field", "field": mixed}):
        assert sum(note.startswith(lost) for note in notes) == 1
        assert not any("convert the rays" in note for note in notes)
    for notes in told({"kind": "light-field", "field": mixed, "flux_unit": "lm"}):
        (spread,) = (note for note in notes if "which all rays have together" in note)
        assert float(spread.split(" by ")[1].split(" lm/W")[0]) == pytest.approx(efficacy, abs=tolerance)
    for notes in told({"kind": "light-field", "field": mixed, "flux_unit": "lm", "flux": 100}):
        assert any("the stated lm are spread as the field's W are" in note for note in notes)
    for notes in told({"kind": "light-field", "field": mixed, "flux_unit": "lm", "flux": 100, "wavelength": 550}):
        assert not any("convert the rays" in note for note in notes)
    monkeypatch.setattr(scene_map, "fit_or_recall", lambda rays, **_: LightField.fit(rays, sphere, depths=(2, 2, 2, 2)))
    _, notes = told({"kind": "rays", "rays": sided})
    assert sum(note.startswith(lost) for note in notes) == 1


def test_lines_of_an_unknown_unit_are_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"unknown flux unit 'lumen'\. Did you mean 'lm'"):
        SpectralLines(LINES, SHARES, "lumen")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="unknown flux unit 'mW'"):
        SpectralLines(LINES, SHARES).in_unit("mW")  # type: ignore[arg-type]
