"""Fields that blur where light comes from are told of; sharp ones are not."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.lightfield.close_lines import BLURRED, TOLD, _distances, blurred_share, crowding
from oracles.sources import DieUnderDome, LimbDarkenedDisk, PrismaticFilm

FLAT = (0.0, 0.0, 0.0, 0.0)
"""Of planes that no focus is sought for."""

SIDE = 2.0
"""Of a chip [mm]."""


def chips(heights: tuple[float, float], n: int, *, seed: int, unequal: bool = False) -> et.RaySet:
    """Two Lambertian chips, 50 mm apart, with 70 and 30 lm."""
    rng = np.random.default_rng(seed)
    counts = round(0.7 * n), round(0.3 * n)
    centres = np.array([(-25.0, 3.0, heights[0]), (25.0, -3.0, heights[1])])
    position = np.repeat(centres, counts, axis=0)
    position[:, :2] += SIDE * rng.uniform(-0.5, 0.5, (sum(counts), 2))
    u, turn = rng.random(sum(counts)), 2 * np.pi * rng.random(sum(counts))
    direction = np.column_stack([np.sqrt(u) * np.cos(turn), np.sqrt(u) * np.sin(turn), np.sqrt(1 - u)])
    flux = np.where(rng.random(sum(counts)) < 0.5, 10.0, 1.0) if unequal else np.ones(sum(counts))
    return et.RaySet(position, direction, flux).with_total_flux(100.0)


def told(field: et.LightField) -> list[str]:
    return [note for note in field.notes if "pass each other" in note]


def test_distances_are_those_between_lines() -> None:
    """Against the component of what joins two points along the common normal, by cross products."""
    rng = np.random.default_rng(5)
    p, q, k, m = (rng.normal(size=(n, 3)) for n in (6, 9, 6, 9))
    k, m = (v / np.linalg.norm(v, axis=1)[:, None] for v in (k, m))
    normal = np.cross(k[:, None], m[None])
    expected = np.abs(((q[None] - p[:, None]) * normal).sum(axis=2)) / np.linalg.norm(normal, axis=2)
    assert _distances(p, k, q, m) == pytest.approx(expected, rel=1e-10)


def test_parallel_lines_are_as_far_apart_as_they_are() -> None:
    """Along the same or the opposite direction, |(q - p) × k|; beside them one that crosses."""
    k = np.array([[0.6, 0.0, 0.8]])
    p, q = np.array([[1.0, 2.0, 3.0]]), np.array([[4.0, -1.0, 2.0], [0.0, 5.0, 1.0], [1.0, 2.0, 9.0]])
    found = _distances(p, k, q, np.array([[0.6, 0.0, 0.8], [-0.6, 0.0, -0.8], [1.0, 0.0, 0.0]]))
    expected = [*np.linalg.norm(np.cross(q[:2] - p, k), axis=1), 0.0]
    assert found == pytest.approx(np.array([expected]), abs=1e-12)


@pytest.mark.slow
def test_a_beam_of_parallel_rays_is_not_taken_for_blur() -> None:
    """All lines of a collimated beam are parallel; those of its field are not quite, and pass each other no less closely."""
    rng = np.random.default_rng(8)
    position = np.column_stack([rng.uniform(-1, 1, (4000, 2)), np.zeros(4000)])
    beam = et.RaySet(position, np.tile([0.0, 0.0, 1.0], (4000, 1)), np.ones(4000))
    field = et.LightField.fit(beam, et.Plane(z=0, width=2, height=2, focus=FLAT), depths=(3, 3, 3, 3))
    assert np.median(crowding(beam, field)) < BLURRED
    assert not told(field)


HEIGHTS = (0.0, 5.0)

N = 20_000
"""Rays of the chips: so few that 2¹⁶ cells are enough. From 30,000 on there are sixteen times as many."""


def seen(field: et.LightField, which: int) -> tuple[float, float]:
    """Mean luminance and error of the middle of a chip over the closed form Φ/(π A)."""
    x, y, flux = ((-25, 3, 70e6), (25, -3, 30e6))[which]
    observer, screen = (
        et.Observer(50, 100, 1000, target=(x, y, HEIGHTS[which])),
        et.Screen(0.6 * SIDE, 0.6 * SIDE, 4, 4),
    )
    chip = et.luminance_map(field, observer, screen)
    assert set(told(field)) <= set(chip.notes)
    truth = flux / (np.pi * SIDE**2)
    return float(chip.values.mean() / truth), float(chip.standard_error.mean() / truth)


@pytest.mark.slow
def test_chips_at_two_heights_are_blurred_and_told_of() -> None:
    """On a dome that shows the first chip sharply the second is many times too dark, which error bars do not know."""
    rays = chips(HEIGHTS, N, seed=2)
    field = et.LightField.fit(rays, et.Dome(radius=36.2, z=0, window=15.6, centre=(-10, 1.37)))
    (note,) = told(field)
    assert "too low, by more than their errors" in note
    value, error = seen(field, 1)
    assert value + 4 * error < 1.0
    assert value < 0.2
    # Of the 30 % of the light that come from there most, of the other chip's hardly any.
    assert 0.1 < blurred_share(crowding(rays, field)) < 0.35


@pytest.mark.slow
def test_a_surface_that_blurs_part_of_the_light_is_replaced() -> None:
    """The dome has the best score of these rays; the box shows both chips within four errors, and is taken."""
    field = et.LightField.fit(chips(HEIGHTS, N, seed=2))
    assert field.surface.NAME == "box"
    assert any("in its place, which blurs" in note for note in field.notes)
    assert not told(field)
    for which in (0, 1):
        value, error = seen(field, which)
        assert error < 0.2
        assert abs(value - 1.0) < 4 * error


@pytest.mark.slow
@pytest.mark.parametrize("unequal", [False, True])
def test_chips_at_one_height_are_not(unequal: bool) -> None:
    """On the surface that is chosen for them; and of unequal flux, on that same plane."""
    rays = chips((0.0, 0.0), 10_000, seed=2, unequal=unequal)
    field = et.LightField.fit(rays, et.Plane(z=0, width=52, height=8, centre=(0, 0), focus=FLAT) if unequal else "auto")
    assert not told(field)
    # The mean of some 200 ratios that err by 0.22 each, and some sharpness that any field lacks.
    assert 0.95 < np.median(crowding(rays, field)) < 1.15


KNOWN = {
    LimbDarkenedDisk(): et.Disk(radius=LimbDarkenedDisk().radius, centre=LimbDarkenedDisk().centre),
    PrismaticFilm(): et.Disk(radius=PrismaticFilm().radius, centre=PrismaticFilm().centre),
    DieUnderDome(): et.Plane(z=0, focus=FLAT),
}
"""Sources, each with the surface that is found for it (test_selection.py)."""


@pytest.mark.slow
@pytest.mark.parametrize("source", list(KNOWN), ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("n", [1000, 20_000])
def test_sharp_fields_of_known_sources_are_not(source: LimbDarkenedDisk | PrismaticFilm | DieUnderDome, n: int) -> None:
    x, d = source.rays(n, seed=3)
    rays = et.RaySet(x, d, np.ones(n))
    field = et.LightField.fit(rays, KNOWN[source])
    ratio = crowding(rays, field)
    assert not told(field)
    assert len(ratio) > 200
    assert (ratio > BLURRED).mean() < TOLD / 2
    assert 0.9 < np.median(ratio) < 1.15


def test_rays_of_the_field_itself_pass_each_other_as_it_says() -> None:
    plane = et.Plane(z=0, width=60, height=20, focus=FLAT)
    field = et.LightField.fit(chips((0.0, 0.0), 4000, seed=4), plane, depths=(3, 3, 2, 2))
    ratio = crowding(field.sample(10_000, seed=9), field)
    # Ratios of counts of 40 and of as many, within five standard errors of the mean of their logarithms.
    assert abs(np.log(ratio).mean()) < 5 * np.sqrt(2 / 40 / 256)


def test_few_rays_tell_nothing() -> None:
    rays = chips(HEIGHTS, 500, seed=6)
    field = et.LightField.fit(rays, et.Plane(z=0, width=60, height=20), depths=(2, 2, 2, 2))
    assert len(crowding(rays, field)) == 0
    assert not told(field)
