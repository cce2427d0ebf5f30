"""The threshold that the number of rays suggests: told wherever it is chosen, and near the best for rays kept back."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.goniophotometry.threshold_sweep import threshold_sweep
from etendue.lightfield.gridded.fitting import all_batches, lit_pixels
from etendue.lightfield.gridded.gridded_source import pixels_for, suited_threshold
from oracles.sources import DieUnderDome, PrismaticFilm

FILM = PrismaticFilm()
DISK = et.Disk(radius=FILM.radius, centre=FILM.centre)


def film_rays(n: int) -> et.RaySet:
    position, direction = FILM.rays(n, seed=3)
    return et.RaySet(position, direction, np.full(n, FILM.total_flux / n))


def test_rays_per_patch_are_the_mean_over_rays() -> None:
    """Every ray knows how many there are on its patch: their mean is Σ n² / Σ n for rays of equal flux."""
    x = np.repeat([0.5, 1.5, 2.5], [10, 50, 200])
    position = np.column_stack([x, np.full(260, 0.5), np.zeros(260)])
    astray = np.array([[9.0, 0.5, 0.0]] * 7)
    rays = et.RaySet(np.vstack([position, astray]), np.tile([0.0, 0.0, 1.0], (267, 1)), np.full(267, 0.1))
    pixels = pixels_for(rays, et.Plane(0, 4, 4, centre=(2, 2)), 1.0, None)
    lit = lit_pixels(all_batches(rays, 1, None), pixels)
    assert lit.rays_per_patch == pytest.approx((10**2 + 50**2 + 200**2) / 260)


def test_the_rule_falls_as_rays_rise_within_its_limits() -> None:
    found = [suited_threshold(rays) for rays in (1, 199, 1000, 5000, 1e5, 1e9)]
    assert found == [5.0, 5.0, 1.0, 0.2, 0.01, 0.01]


def test_chosen_where_none_is_given_and_told() -> None:
    rays = film_rays(20_000)
    chosen = et.GriddedSource.fit(rays, DISK, pixel=2.0)
    stated = et.GriddedSource.fit(rays, DISK, pixel=2.0, threshold=chosen.threshold)
    assert chosen.threshold == suited_threshold(20_000 * float((chosen.patches.flux**2).sum()) / chosen.total_flux**2)
    assert chosen.suited
    assert not stated.suited
    assert np.array_equal(chosen.patches.values, stated.patches.values)
    note = f"threshold {chosen.threshold:g} %, chosen from the number of rays"
    assert note in chosen.notes
    assert note not in stated.notes


@pytest.mark.slow
def test_rays_kept_back_score_nearly_as_well_as_with_the_best() -> None:
    """On two sources, one with sharp cut-offs and one under a dome, of few rays and many; what suited 10⁹ is far behind."""
    position, direction = DieUnderDome().rays(15_000, seed=4)
    dome = et.RaySet(position, direction, np.full(15_000, 1.0 / 15_000))
    for rays, surface, pixel in ((film_rays(40_000), DISK, 1.0), (dome, et.Hemisphere(radius=1.3), 0.125)):
        suited = et.GriddedSource.fit(rays, surface, pixel).threshold
        sweep = threshold_sweep(rays, surface, pixel, (5.0, 1.0, 0.2, 0.05, 0.021, suited))
        best, here = sweep["score"].max(), sweep["score"][-1]
        assert best - here < 0.1
        assert here - sweep["score"][4] > 10 * sweep["score_error"].max()


def test_a_source_of_a_scene_takes_it_too(tmp_path: Path) -> None:
    file = tmp_path / "film.tm25ray"
    et.write_rays(file, film_rays(5000))
    (tmp_path / "lamp.toml").write_text(
        '[[sources]]\nkind = "gridded"\nfile = "film.tm25ray"\nsurface = "plane:z=0"\npixel = 4\ndraws = 1000\n'
        '[[detectors]]\nname = "far"\nkind = "intensity"\n'
    )
    chosen = et.GriddedSource.fit(et.read_rays(file), et.Plane(z=0), pixel=4.0)
    result = et.trace(et.Scene.load(tmp_path / "lamp.toml"), rays=1000)
    assert result.intensity.only.flux == pytest.approx(chosen.total_flux, rel=1e-6)
