"""The wavelength of each ray of a set, carried from the file through a scene to what leaves it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import SceneError
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.spectrum import photopic_efficiency
from etendue.tracing.result import TraceResult
from oracles.verdicts import LARGEST_Z, assert_drawn_with

Array = npt.NDArray[np.float64]

LINES = np.array([450.0, 550.0, 633.0])
BK7 = {"sellmeier": {"b": [1.03961212, 0.231792344, 1.01046945], "c": [0.00600069867, 0.0200179144, 103.560653]}}
SCREEN = {"kind": "rays", "name": "out", "shape": {"kind": "rectangle", "width": 400, "height": 400}}


def n_bk7(wavelength: Array) -> Array:
    l2 = (wavelength / 1e3) ** 2
    terms = zip(BK7["sellmeier"]["b"], BK7["sellmeier"]["c"], strict=True)
    squared: Array = 1.0 + sum(b * l2 / (l2 - c) for b, c in terms)
    return np.sqrt(squared)


def beams(n: int, seed: int = 1) -> tuple[et.RaySet, Array]:
    """1 W of parallel rays in three unequal lines, mixed; a ray is known by its z, and its wavelength beside it."""
    rng = np.random.default_rng(seed)
    wavelength = rng.permutation(np.repeat(LINES, [n // 2, 3 * n // 10, n - n // 2 - 3 * n // 10]))
    position = np.column_stack([np.full(n, -5.0), np.full(n, 1.5), np.arange(n) * 16.0 / n])
    tilt = np.radians(11.0)
    direction = np.tile([np.cos(tilt), np.sin(tilt), 0.0], (n, 1))
    return et.RaySet(position, direction, np.full(n, 1.0 / n), flux_unit="W", wavelength=wavelength), wavelength


def refract(d: Array, normal: Array, n1: Array, n2: Array) -> tuple[Array, Array]:
    """Snell's law for directions (n, 2) at a face with a normal along the light, and Fresnel's transmittance."""
    cosine = d @ normal
    ratio = n1 / n2
    across = np.sqrt(1.0 - ratio**2 * (1.0 - cosine**2))
    out = ratio[:, None] * d + (across - ratio * cosine)[:, None] * normal
    s = (n1 * cosine - n2 * across) / (n1 * cosine + n2 * across)
    p = (n1 * across - n2 * cosine) / (n1 * across + n2 * cosine)
    return out, 1.0 - (s**2 + p**2) / 2.0


def through_prism(rays: Any, apex: float = 28.0, **keys: Any) -> et.Scene:
    """A wedge of BK7, its entrance face at x = 0, and a screen behind it."""
    run = 20.0 * np.tan(np.radians(apex))
    wedge = {"kind": "prism", "vertices": [[0, -10], [2, -10], [2 + run, 10], [0, 10]], "height": 20}
    return et.Scene(
        sources=[{"name": "led", "kind": "rays", **rays}],
        media={"glass": BK7},
        solids=[{"name": "wedge", "shape": wedge, "medium": "glass", "at": [0, 0, -2]}],
        detectors=[{**SCREEN, "at": [30, 0, 0], "toward": [1, 0, 0]}],
        **keys,
    )


def traced(scene: et.Scene) -> TraceResult:
    """With each ray of the scene's set once."""
    result = et.trace(scene, None)
    assert result.ledger.closes
    return result


def number_of(rays: et.RaySet, n: int) -> npt.NDArray[np.intp]:
    """Which ray of `beams` each one was: its z has stayed."""
    return np.rint(rays.position[:, 2] * n / 16.0).astype(np.intp)


@pytest.mark.parametrize("stored", ["memory", "tm25", "zemax", "speos", "index"])
def test_a_prism_sends_each_line_where_snell_says(tmp_path: Path, stored: str) -> None:
    """Three lines in one set: the angle of each is that of its own index, its share that of Fresnel's equations."""
    n, apex = 20_000, np.radians(28.0)
    rays, wavelength = beams(n)
    if stored == "index":
        et.RayIndex.build(rays, tmp_path / "set.etd")
        source: dict[str, Any] = {"rays": et.RayIndex.open(tmp_path / "set.etd")}
    elif stored == "memory":
        source = {"rays": rays}
    else:
        et.write_rays(tmp_path / "set.bin", rays, format=stored)
        source = {"file": tmp_path / "set.bin"}
    result = traced(through_prism(source))
    seen = result.rays["out"]
    assert seen.wavelength is not None
    which = number_of(seen, n)
    np.testing.assert_allclose(seen.wavelength, wavelength[which], rtol=1e-6)
    index = n_bk7(LINES)
    start = np.tile(rays.direction[0, :2], (3, 1))
    inside, first = refract(start, np.array([1.0, 0.0]), np.ones(3), index)
    out, second = refract(inside, np.array([np.cos(apex), -np.sin(apex)]), index, np.ones(3))
    for line, expected, share in zip(LINES, out, first * second, strict=True):
        mine = wavelength[which] == line
        assert mine.sum() > 1000
        straight = np.abs(seen.direction[mine][:, :2] - expected).max(axis=1) < 2e-6
        # Each ray of the set holds 1/n of a watt.
        hits = n * float(seen.flux[mine][straight].sum())
        assert_drawn_with(share=float(share), hits=hits, rays=int((wavelength == line).sum()))
        # The directions of the lines lie much farther apart than that.
        others = np.abs(out[line != LINES] - expected).max(axis=1)
        assert (others > 1e-3).all()


def test_what_leaves_is_written_and_read_with_its_wavelengths(tmp_path: Path) -> None:
    """File, trace, file, trace, file: a ray is known by its place, and keeps its wavelength all the way."""
    n = 5000
    rays, wavelength = beams(n)
    et.write_rays(tmp_path / "0.tm25ray", rays)
    for step in range(2):
        scene = et.Scene(
            sources=[{"kind": "rays", "file": tmp_path / f"{step}.tm25ray"}],
            detectors=[{**SCREEN, "at": [10.0 * step, 0, 0], "toward": [1, 0, 0]}],
        )
        result = traced(scene)
        result.save(tmp_path / "kept.h5")
        kept = et.TraceResult.load(tmp_path / "kept.h5").rays["out"]
        et.write_rays(tmp_path / f"{step + 1}.tm25ray", kept)
        again = et.read_rays(tmp_path / f"{step + 1}.tm25ray")
        assert again.wavelength is not None
        assert len(again) == n
        assert sorted(number_of(again, n)) == list(range(n))
        assert again.wavelength.tolist() == wavelength[number_of(again, n)].tolist()


def test_a_watt_of_blue_has_the_lumens_of_blue(tmp_path: Path) -> None:
    """A band about 450 nm: the sum of K_m V(λ) over its rays, whatever the tracer did; not the 683 lm of 555 nm."""
    n = 20_000
    rng = np.random.default_rng(0)
    wavelength = rng.normal(450.0, 5.0, n)
    rays = et.RaySet(
        np.column_stack([rng.random((n, 2)), np.zeros(n)]), [[0, 0, 1]] * n, np.full(n, 1.0 / n), flux_unit="W",
        wavelength=wavelength,
    )  # fmt: skip
    expected = 683.0 * float(photopic_efficiency(wavelength).mean())
    assert 26.0 < expected < 27.0
    et.write_rays(tmp_path / "blue.tm25ray", rays)
    detector = {**SCREEN, "at": [0, 0, 5]}
    watts = traced(et.Scene(sources=[{"kind": "rays", "file": tmp_path / "blue.tm25ray"}], detectors=[detector]))
    assert watts.rays["out"].total_flux == pytest.approx(1.0, rel=1e-6)
    assert watts.rays["out"].in_unit("lm").total_flux == pytest.approx(expected, rel=1e-5)
    # The scene in lumens: the tracer counts those from the start.
    source = {"kind": "rays", "file": tmp_path / "blue.tm25ray", "flux_unit": "lm"}
    lumens = traced(et.Scene(sources=[source], detectors=[detector]))
    assert lumens.ledger.total.flux == pytest.approx(expected, rel=1e-5)
    assert lumens.rays["out"].total_flux == pytest.approx(expected, rel=1e-5)
    # A total that is stated in lumens is shared by what each ray is worth to the eye, not by watts.
    two = et.RaySet([[0, 0, 0], [0.1, 0, 0]], [[0, 0, 1]] * 2, [1.0, 1.0], flux_unit="W", wavelength=[450.0, 550.0])
    source = {"kind": "rays", "rays": two, "flux_unit": "lm", "flux": 100}
    flux = traced(et.Scene(sources=[source], detectors=[detector])).rays["out"].flux
    worth = photopic_efficiency([450.0, 550.0])
    np.testing.assert_allclose(np.sort(flux), 100.0 * worth / worth.sum(), rtol=1e-9)


def absorber(alpha: Any, thickness: float) -> dict[str, Any]:
    shape = {"kind": "block", "width": 60, "height": 60, "depth": thickness}
    return {"shape": shape, "at": [0, 0, 3], "medium": {"index": 1, "absorption": alpha}}


def test_beers_law_with_the_absorption_of_each_wavelength() -> None:
    """exp(−α(λ) s) of each line is left, and the rest is booked as absorbed."""
    n, thickness = 60_000, 7.0
    table = {"wavelength": [400, 500, 700], "values": [0.30, 0.05, 0.01]}
    rng = np.random.default_rng(3)
    wavelength = rng.permutation(np.repeat(LINES, [n // 2, n // 3, n - n // 2 - n // 3]))
    place = np.column_stack([20 * rng.random((n, 2)) - 10, np.zeros(n)])
    rays = et.RaySet(place, [[0, 0, 1]] * n, np.full(n, 1.0 / n), flux_unit="W", wavelength=wavelength)
    result = traced(
        et.Scene(
            sources=[{"kind": "rays", "rays": rays}],
            solids=[absorber(table, thickness)],
            detectors=[{**SCREEN, "at": [0, 0, 30]}],
        )
    )
    seen = result.rays["out"]
    for line in LINES:
        alpha = float(np.interp(line, table["wavelength"], table["values"]))
        left = n * float(seen.flux[seen.wavelength == line].sum())
        assert_drawn_with(share=float(np.exp(-alpha * thickness)), hits=left, rays=int((wavelength == line).sum()))
    assert result.ledger.absorbed.flux == pytest.approx(1.0 - seen.total_flux, rel=1e-9)


def test_white_light_through_a_filter_has_the_lumens_of_the_integral() -> None:
    """683 ∫ S(λ) V(λ) exp(−α(λ) s) dλ by quadrature, for a lopsided continuous spectrum."""
    n, thickness = 200_000, 4.0
    nodes, weight = np.array([420.0, 455.0, 480.0, 560.0, 700.0]), np.array([0.0, 1.0, 0.2, 0.7, 0.05])
    table = {"wavelength": [420, 500, 560, 700], "values": [0.6, 0.25, 0.02, 0.2]}
    fine = np.linspace(420.0, 700.0, 280_001)
    spectrum = np.interp(fine, nodes, weight)
    share = np.concatenate([[0.0], np.cumsum((spectrum[1:] + spectrum[:-1]) / 2)])
    wavelength = np.interp((np.random.default_rng(5).permutation(n) + 0.5) / n, share / share[-1], fine)
    rng = np.random.default_rng(6)
    place = np.column_stack([20 * rng.random((n, 2)) - 10, np.zeros(n)])
    rays = et.RaySet(place, [[0, 0, 1]] * n, np.full(n, 1.0 / n), flux_unit="W", wavelength=wavelength)
    scene = et.Scene(
        sources=[{"kind": "rays", "rays": rays}],
        solids=[absorber(table, thickness)],
        detectors=[{**SCREEN, "at": [0, 0, 30]}],
    )
    left = np.exp(-np.interp(fine, table["wavelength"], table["values"]) * thickness)
    bright = 683.0 * photopic_efficiency(fine)
    expected = (spectrum * bright * left).sum() / spectrum.sum()
    # Only chance in the filter is left: each ray passes with its probability, the wavelengths are spread evenly.
    variance = (spectrum * bright**2 * left * (1.0 - left)).sum() / spectrum.sum() / n
    found = traced(scene).rays["out"].in_unit("lm").total_flux
    assert abs(found - expected) < LARGEST_Z * np.sqrt(variance)
    assert np.sqrt(variance) < 0.002 * expected


def test_finishes_see_the_wavelength_of_each_ray() -> None:
    """A filter sheet with a transmittance over wavelength."""
    n = 40_000
    rays, wavelength = beams(n)
    sheet = {"wavelength": [500, 600], "values": [0.2, 0.9]}
    scene = et.Scene(
        sources=[{"kind": "rays", "rays": rays}],
        finishes={"filter": {"kind": "transmitter", "transmittance": sheet}},
        surfaces=[{**{k: v for k, v in SCREEN.items() if k == "shape"}, "at": [10, 0, 0], "toward": [1, 0, 0],
                   "finish": "filter"}],
        detectors=[{**SCREEN, "at": [20, 0, 0], "toward": [1, 0, 0]}],
    )  # fmt: skip
    seen = traced(scene).rays["out"]
    for line, share in zip(LINES, [0.2, 0.55, 0.9], strict=True):
        hits = n * float(seen.flux[seen.wavelength == line].sum())
        assert_drawn_with(share=share, hits=hits, rays=int((wavelength == line).sum()))


def many(n: int, threads: int) -> TraceResult:
    """Sets with and without colours in turns, each traced with more rays than it has."""
    coloured, _ = beams(3000)
    plain = et.RaySet(coloured.position, coloured.direction, coloured.flux, flux_unit="W")
    sources = [
        {"kind": "rays", "rays": plain, "wavelength": 480},
        {"kind": "rays", "rays": coloured},
        {"kind": "beam", "shape": {"kind": "disk", "radius": 1}, "flux": 0.5, "flux_unit": "W", "wavelength": 520,
         "at": [-1, 0, 5], "toward": [1, 0, 0]},
        {"kind": "rays", "rays": coloured, "wavelength": 600},
    ]  # fmt: skip
    scene = et.Scene(sources=sources, detectors=[{**SCREEN, "at": [30, 0, 0], "toward": [1, 0, 0]}])
    return et.trace(scene, n, 4, threads=threads)


def test_sources_do_not_lend_each_other_colours_and_threads_change_nothing() -> None:
    one, three = (many(200_000, threads) for threads in (1, 3))
    rays = one.rays["out"]
    assert rays.wavelength is not None
    found = {line: int((rays.wavelength == line).sum()) for line in np.unique(rays.wavelength).astype(float).tolist()}
    # 1 + 1 + 0.5 + 1 W share the rays by their flux; the lines of the coloured set are 0.5, 0.3 and 0.2 of it.
    each = 200_000 / 3.5
    expected = {450.0: 0.5 * each, 480.0: each, 520.0: 0.5 * each, 550.0: 0.3 * each, 600.0: each, 633.0: 0.2 * each}
    assert found.keys() == expected.keys()
    assert all(abs(found[line] - expected[line]) < 300 for line in found)
    assert np.array_equal(rays.records, three.rays["out"].records)


def test_what_is_stated_goes_before_the_wavelengths_of_a_file_and_says_so() -> None:
    rays, _ = beams(500)
    result = traced(through_prism({"rays": rays, "wavelength": 500}))
    assert set(result.rays["out"].wavelength.tolist()) == {500.0}  # type: ignore[union-attr]
    assert any("'wavelength' is stated" in note for note in result.notes)
    assert not any("is stated" in note for note in traced(through_prism({"rays": rays})).notes)


def test_rays_with_a_spectrum_each_draw_from_their_own() -> None:
    """Blue and yellow by spectrum index, at places of their own; indices that point nowhere are told of."""
    n = 30_000
    rng = np.random.default_rng(9)
    index = rng.choice([1, 2, 7], n, p=[0.5, 0.4, 0.1]).astype("<i4")
    records = np.zeros(n, [("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4"), ("spectrum_index", "<i4")])
    records["position"][:, 0], records["direction"][:, 2], records["flux"] = index, 1.0, 1.0 / n
    records["spectrum_index"] = index
    spectra = et.Spectrum([440, 450, 460], [0, 1, 0]), et.Spectrum([540, 560, 600], [1, 1, 1])
    rays = et.RaySet.from_records(records, RaySetMeaning(flux_unit="W", spectra=spectra))
    scene = et.Scene(sources=[{"name": "led", "kind": "rays", "rays": rays}], detectors=[{**SCREEN, "at": [0, 0, 5]}])
    result = traced(scene)
    seen = result.rays["out"]
    assert seen.wavelength is not None
    which = np.rint(seen.position[:, 0]).astype(int)
    # Lines by the nanometre, by the trapezoidal rule: a triangle of area 100 whose ends have none, and 60 nm of even light.
    triangle = {445.0: 15 / 100, 450.0: 55 / 100, 455.0: 90 / 100}
    for own, low, high, shares in ((1, 441, 459, triangle), (2, 540, 600, {540.0: 0.5 / 60, 560.0: 20.5 / 60})):
        found, flux = seen.wavelength[which == own], n * seen.flux[which == own]
        assert set(found.tolist()) == set(range(low, high + 1))
        for last, share in shares.items():
            assert_drawn_with(share=share, hits=float(flux[found <= last].sum()), rays=len(found))
    assert set(seen.wavelength[which == 7].tolist()) <= {*range(441, 460), *range(540, 601)}
    lost = int((index == 7).sum())
    assert any(f"{lost:,} rays" in note and "no wavelength" in note for note in result.notes)


def test_rays_without_a_wavelength_take_one_of_the_others_or_of_the_scene() -> None:
    n = 8000
    rays, wavelength = beams(n)
    holes = np.where(np.arange(n) % 4 == 0, 0.0, wavelength)
    broken = et.RaySet(rays.position, rays.direction, rays.flux, flux_unit="W", wavelength=holes)
    result = traced(through_prism({"rays": broken}))
    seen = result.rays["out"]
    assert seen.wavelength is not None
    which = number_of(seen, n)
    whole = which % 4 != 0
    assert seen.wavelength[whole].tolist() == wavelength[which][whole].tolist()
    assert set(seen.wavelength[~whole].tolist()) == set(LINES.tolist())
    assert any("2,000 rays with 25.000% of the flux have no wavelength" in note for note in result.notes)
    none = et.RaySet(rays.position, rays.direction, rays.flux, flux_unit="W", wavelength=np.full(n, np.nan))
    assert set(traced(through_prism({"rays": none}, wavelength=500)).rays["out"].wavelength.tolist()) == {500.0}  # type: ignore[union-attr]


def test_a_medium_needs_an_index_at_every_wavelength_of_the_rays() -> None:
    """One ray at 140 nm, where the formula of the glass has none; the ends of the range count, not only the lines."""
    rays, wavelength = beams(3000)
    wavelength[1234] = 140.0
    odd = et.RaySet(rays.position, rays.direction, rays.flux, flux_unit="W", wavelength=wavelength)
    with pytest.raises(SceneError, match=r"refractive index of 'glass' is nan at 140 nm"):
        traced(through_prism({"rays": odd}))
    wavelength[1234] = 250.0
    far = et.RaySet(rays.position, rays.direction, rays.flux, flux_unit="W", wavelength=wavelength)
    scene = through_prism({"rays": far})
    library = scene.replace(solids=(scene.solids[0].model_copy(update={"medium": "BK7"}),))
    assert any("extrapolated to 250 nm" in note for note in traced(library).notes)
