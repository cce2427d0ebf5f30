"""The far field of a light field: flux as a reader finds it, errors that hold, and what the field cannot know."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from oracles.beams import beam, lobe
from oracles.intensity import hat_means, read_by_trapezium
from oracles.verdicts import assert_drawn_with

Array = npt.NDArray[np.float64]
FLUX = 7.0


def lamp(n: int, exponent: float, c: float, gamma: float, seed: int) -> et.RaySet:
    """A disk that shines into cosⁿ about an axis, the same from everywhere."""
    rng = np.random.default_rng(seed + 10_000)
    radius, turn = 5.0 * np.sqrt(rng.random(n)), rng.uniform(0, 2 * np.pi, n)
    position = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(n)], axis=1)
    return et.RaySet(position, beam(n, exponent=exponent, c=c, gamma=gamma, seed=seed), np.full(n, FLUX / n))


def field_of(n: int, exponent: float, c: float, gamma: float, seed: int, cells: int, own: bool = True) -> et.LightField:
    """Of a disk whose beam has cells of its own, or not."""
    disk = et.Disk(radius=5.01, beam=None if own else (0, 0, 1))
    return et.LightField.fit(lamp(n, exponent, c, gamma, seed), disk, depths=(2, 2, cells, cells))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("exponent", "c", "gamma", "own"), [(300.0, 40.0, 25.0, True), (1e5, 0.0, 0.0, False), (1e5, 0.0, 0.0, True)]
)
def test_files_of_a_field_hold_its_flux(exponent: float, c: float, gamma: float, own: bool, tmp_path: Path) -> None:
    """A reader's trapezium rule finds it to 0.1 %, of a beam of 0.4° too, whose peak the field cannot know by cells that
    all directions share."""
    field = field_of(30_000, exponent, c, gamma, 3, 4, own).replace(notes=("said before",))
    far = field.intensity()
    assert far.flux == pytest.approx(field.total_flux, rel=1e-12)
    for name in ("a.ies", "a.ldt"):
        et.write_intensity(tmp_path / name, far)
        table = et.read_intensity(tmp_path / name)
        assert read_by_trapezium(table.values, c=table.c, gamma=table.gamma) == pytest.approx(
            field.total_flux, rel=1e-3
        )
    assert far.notes[-1] == "said before"
    assert any("counting the 30,000 equal rays" in note for note in far.notes)
    assert any("which broaden it" in note for note in far.notes) == (not own)
    if own:
        assert np.isfinite(far.standard_error[far.values > 0.1 * far.maximum]).all()
        peak = FLUX * (exponent + 1) / (2 * np.pi)
        assert far.peak_error < 0.15 * peak
        assert abs(far.peak_intensity - peak) < 4 * far.peak_error


@pytest.mark.slow
def test_the_values_are_the_integral_over_the_surface() -> None:
    """Another route: rays drawn from the field, shared by the same nodes; and the intensity of a map from afar."""
    field = field_of(30_000, 6.0, 200.0, 30.0, 5, 4)
    far = field.intensity(24, 7.5)
    drawn = et.intensity_distribution(field.sample(1_000_000, seed=9), 24, 7.5)
    lit = far.values > 0.05 * far.maximum
    # 10⁶ rays know a node to a percent and a half; the quadrature may be off by one at the edges of the field's cells.
    np.testing.assert_allclose(far.values[lit], drawn.values[lit], atol=5 * float(drawn.standard_error[lit].max()))
    seen = et.luminance_map(field, et.Observer(30, 195, 1e5), et.Screen(12, 12, 64, 64))
    assert seen.intensity == pytest.approx(float(far.at(195, 30)), rel=0.03)


@pytest.mark.slow
def test_errors_are_those_of_counting_and_cover_the_truth() -> None:
    """4 fields: the error of a node is that of the rays themselves, to noise; within it lie no fewer than 68 %."""
    n, exponent, c, gamma = 20_000, 6.0, 200.0, 30.0
    inside, tried, ratios = 0, 0, []
    truth: Array | None = None
    for seed in range(4):
        far = field_of(n, exponent, c, gamma, seed, 4).intensity(12, 15.0)
        if truth is None:
            truth = FLUX * hat_means(lobe(exponent=exponent, c=c, gamma=gamma), c=far.c, gamma=far.gamma)[0]
        counted = et.intensity_distribution(lamp(n, exponent, c, gamma, seed), 12, 15.0)
        lit = (truth > 0.1 * truth.max())[::2, 2:-2:2]
        ratios.append((far.standard_error / counted.standard_error)[::2, 2:-2:2][lit])
        z = ((far.values - truth) / far.standard_error)[::2, 2:-2:2][lit]
        inside, tried = inside + int((np.abs(z) < 1.0).sum()), tried + z.size
    assert np.median(np.concatenate(ratios)) == pytest.approx(1.0, abs=0.05)
    assert_drawn_with(share=(0.6827, 0.98), hits=inside, rays=tried)


@pytest.mark.slow
def test_rays_of_unequal_flux_count_less(tmp_path: Path) -> None:
    """Kish's number of them is kept with the field; a field without it takes its rays as equal ones, and says so."""
    rays = lamp(20_000, 6.0, 0.0, 0.0, 1)
    weights = np.random.default_rng(4).exponential(size=20_000)
    lopsided = et.RaySet(rays.position, rays.direction, weights)
    field = et.LightField.fit(lopsided, et.Disk(radius=5.01), depths=(2, 2, 4, 4))
    kish = weights.sum() ** 2 / (weights**2).sum()
    field.save(tmp_path / "a.h5")
    kept = et.LightField.load(tmp_path / "a.h5")
    assert kept.report.effective_rays == pytest.approx(kish, rel=1e-9)
    even = et.LightField.fit(rays, et.Disk(radius=5.01), depths=(2, 2, 4, 4))
    share = [f.intensity(4, 15).standard_error[0, 0] / f.intensity(4, 15).values[0, 0] for f in (kept, even)]
    assert share[0] / share[1] == pytest.approx(np.sqrt(20_000 / kish), rel=0.1)


@pytest.mark.slow
def test_steps_that_a_narrow_beam_needs_can_be_had(monkeypatch: pytest.MonkeyPatch) -> None:
    """The step that the notes ask for is one that a field takes, whatever the beam; tables without end are refused."""
    # One point of the surface stands for all, and few planes: the light is the same everywhere, and about the axis.
    monkeypatch.setattr("etendue.lightfield.far_field.SIDE", 1)
    monkeypatch.setattr("etendue.lightfield.far_field.PLANES", 1)
    field = field_of(3000, 2e5, 0.0, 0.0, 3, 2)
    told = next(note for note in field.intensity(24, 1.0).notes if "cannot hold it" in note)
    step = float(told.partition("γ in steps of ")[2].partition("°")[0])
    assert step < 0.05
    finer = field.intensity(4, 180.0 / round(180.0 / step))
    assert not any("cannot hold it" in note for note in finer.notes)
    with pytest.raises(et.ArgumentError, match=r"18,000,000 nodes; of a light field 13,000,000 can be had"):
        field.intensity(4000, 0.04)
