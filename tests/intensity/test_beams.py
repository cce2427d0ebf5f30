"""Beams far narrower than any usual step keep their flux and their height, wherever they point."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import FormatError
from etendue.tracing import storage
from oracles.beams import PEAK, beam, direction, lobe, rays_of, searchlight
from oracles.intensity import hat_means, read_by_trapezium
from oracles.verdicts import LARGEST_Z, assert_agree, assert_drawn_with

Array = npt.NDArray[np.float64]


def read_back(intensity: et.Intensity, folder: Path) -> list[float]:
    """The flux that a reader finds in the files of a distribution."""
    found = []
    for name in ("a.ies", "a.ldt"):
        et.write_intensity(folder / name, intensity)
        table = et.read_intensity(folder / name)
        found.append(read_by_trapezium(table.values, c=table.c, gamma=table.gamma))
    return found


BEAMS = [
    ("narrow", 1e5, 0.0, 0.0),
    ("Lambertian", 1.0, 0.0, 0.0),
    ("tilted", 1e4, 70.0, 20.0),
    ("beside the pole", 1e5, 250.0, 0.5),
    ("backwards", 300.0, 0.0, 180.0),
    ("sideways", 30.0, 33.0, 90.0),
]


@pytest.mark.slow
@pytest.mark.parametrize(("exponent", "c", "gamma"), [b[1:] for b in BEAMS], ids=[b[0] for b in BEAMS])
def test_files_hold_the_flux_of_a_beam_and_its_peak(exponent: float, c: float, gamma: float, tmp_path: Path) -> None:
    """I₀ = Φ (n + 1)/2π of cosⁿ; a reader's trapezium rule finds Φ to 0.1 %."""
    n, flux = 100_000, 92.0
    far = et.intensity_distribution(rays_of((beam(n, exponent=exponent, c=c, gamma=gamma, seed=3), flux)))
    assert far.flux == pytest.approx(flux, rel=1e-12)
    assert read_back(far, tmp_path) == pytest.approx([flux, flux], rel=1e-3)
    peak = flux * (exponent + 1) / (2 * np.pi)
    assert abs(far.maximum - peak) < LARGEST_Z * far.maximum_error
    # An error that says nothing is none: 10⁵ rays know the peak to a third at least.
    assert far.maximum_error < peak / 3.0


@pytest.mark.slow
def test_two_beams_and_a_batwing(tmp_path: Path) -> None:
    two = rays_of(
        (beam(60_000, exponent=3e3, c=10.0, gamma=30.0, seed=1), 50.0),
        (beam(40_000, exponent=300.0, c=200.0, gamma=60.0, seed=2), 40.0),
    )
    rng = np.random.default_rng(7)
    # I ∝ cos^-3 up to 60°, as for even light on a floor.
    tangent = np.sqrt(3.0 * rng.random(100_000))
    wings = rays_of((direction(c=rng.uniform(0, 360, 100_000), gamma=np.degrees(np.arctan(tangent))), 90.0))
    for rays, peak in ((two, 50.0 * 3001 / (2 * np.pi)), (wings, 90.0 / (3.0 * np.pi) * 8.0)):
        far = et.intensity_distribution(rays)
        assert read_back(far, tmp_path) == pytest.approx([90.0, 90.0], rel=1e-3)
        assert abs(far.maximum - peak) < LARGEST_Z * far.maximum_error + 0.1 * peak * (rays is wings)

    def batwing(c: Array, gamma: Array) -> Array:
        cosine = np.cos(np.radians(np.minimum(gamma, 60.0)))
        return np.where(gamma < 60.0, 90.0 / (3.0 * np.pi * cosine**3), 0.0) + 0.0 * c

    expected = hat_means(batwing, c=far.c, gamma=far.gamma)[0]
    # Nodes whose hats have no ray in common, away from the edge.
    apart = np.s_[:: 1 if far.c.size == 1 else 2, 1 : int(np.searchsorted(far.gamma, 50.0)) : 2]
    assert_agree(values=far.values[apart], expected=expected[apart], standard_error=far.standard_error[apart])


def test_light_of_no_width_says_what_sets_its_peak(tmp_path: Path) -> None:
    """Rays along one line are a pencil of light, not copies of one ray."""
    for towards in ((0.0, 0.0), (70.0, 20.0)):
        far = et.intensity_distribution(rays_of((np.tile(direction(c=towards[0], gamma=towards[1]), (1000, 1)), 7.0)))
        assert "lower bound, set by steps of 0.0049°" in far.notes[0]
        assert read_back(far, tmp_path) == pytest.approx([7.0, 7.0], rel=1e-3)


@pytest.mark.slow
def test_few_rays_of_a_lambertian_source_make_no_spike() -> None:
    """10⁴ rays, 20 seeds: the pole's node is not worse than a tenth, and the peak lies within its error."""
    z = []
    for seed in range(20):
        far = et.intensity_distribution(rays_of((beam(10_000, exponent=1.0, c=0.0, gamma=0.0, seed=seed), np.pi)))
        assert far.flux == pytest.approx(np.pi, rel=1e-9)
        assert far.standard_error[0, 0] < 0.1
        assert far.maximum < 1.4
        z.append((far.maximum - 1.0) / far.maximum_error)
    assert np.abs(z).max() < LARGEST_Z


# --- traced ------------------------------------------------------------------------------------------------------------


def test_the_far_field_of_a_searchlight(tmp_path: Path) -> None:
    result = et.trace(searchlight(), 4e5, 3)
    far = result.intensity.only
    assert far.flux == pytest.approx(result.ledger.escaped.flux, rel=1e-11)
    assert read_back(far, tmp_path) == pytest.approx([far.flux] * 2, rel=1e-3)
    assert abs(far.maximum - PEAK) < LARGEST_Z * far.maximum_error
    assert far.maximum_error < 0.1 * PEAK
    # All of Φ leaves or is absorbed: the flux that escapes is binomial.
    share = far.flux / 60
    assert far.flux_error == pytest.approx(60 * np.sqrt(share * (1 - share) / 4e5), rel=1e-3)


@pytest.mark.slow
def test_traced_far_fields_have_the_same_bits_however_they_are_made(tmp_path: Path) -> None:
    scene = searchlight()
    whole = et.trace(scene, 1.2e6, 5, threads=1)
    first = next(iter(et.trace_rounds(scene, 1.2e6, 5, threads=2)))
    first.save(tmp_path / "part.h5")
    again = et.trace(scene, 1.2e6, 5, resume=tmp_path / "part.h5")
    assert again.plan.far_fields == whole.plan.far_fields
    for name in ("c", "gamma", "values", "standard_error"):
        np.testing.assert_array_equal(getattr(again.intensity.only, name), getattr(whole.intensity.only, name))
    assert again.intensity.only.flux_error == whole.intensity.only.flux_error
    assert again.intensity.only.notes == whole.intensity.only.notes


def test_cells_of_earlier_versions_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(storage, "VERSION", 2)
    et.trace(searchlight(), 1000).save(tmp_path / "old.h5")
    monkeypatch.undo()
    with pytest.raises(FormatError, match="earlier étendue; trace the scene again"):
        et.TraceResult.load(tmp_path / "old.h5")


@pytest.mark.slow
def test_traced_errors_cover_the_truth() -> None:
    """A cosine emitter about an axis off every plane, at asked steps, 5 seeds: nodes with no ray in common."""
    c, gamma, exponent, flux = 101.0, 28.0, 3.0, 9.0
    source = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "exponent": exponent, "flux": flux,
              "toward": direction(c=c, gamma=gamma).tolist()}  # fmt: skip
    scene = et.Scene(
        sources=[source], detectors=[{"name": "far", "kind": "intensity", "c_planes": 12, "gamma_step": 7.5}]
    )
    inside = tried = 0
    truth: Array | None = None
    for seed in range(5):
        far = et.trace(scene, 60_000, seed).intensity.only
        truth = (
            flux * hat_means(lobe(exponent=exponent, c=c, gamma=gamma), c=far.c, gamma=far.gamma)[0]
            if truth is None
            else truth
        )
        sure = (truth > 0.05 * truth.max())[::2, 2:-2:2]
        z = ((far.values - truth) / far.standard_error)[::2, 2:-2:2][sure]
        inside, tried = inside + int((np.abs(z) < 1.0).sum()), tried + z.size
    assert_drawn_with(share=0.6827, hits=inside, rays=tried)
