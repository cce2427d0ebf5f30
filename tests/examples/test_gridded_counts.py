"""Counting in half degrees, which an example does in one pass, against the two passes of `GriddedSource.fit`."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import etendue as et
import numpy as np
import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
RAYS = 20_000


@pytest.fixture
def counts(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module("experiments.gridded_counts")


def rays_of(seed: int) -> et.RaySet:
    """Rays about a slanted axis, from a patch beside the middle: nothing is symmetric."""
    rng = np.random.default_rng(seed)
    position = np.column_stack([rng.normal(0.3, 0.25, RAYS), rng.normal(-0.2, 0.15, RAYS), np.zeros(RAYS)])
    direction = rng.normal((0.4, 0.1, 0.8), 0.35, (RAYS, 3))
    direction[:, 2] = np.abs(direction[:, 2]) + 0.05
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return et.RaySet(position, direction, np.full(RAYS, 3.0 / RAYS))


def imaged(rays: et.RaySet, mirror: np.ndarray) -> et.RaySet:
    return et.RaySet(rays.position @ mirror, rays.direction @ mirror, rays.flux)


@pytest.mark.parametrize(
    ("surface", "pixel", "parallels"),
    [(et.Plane(0, 5, 5, centre=(0, 0)), 1.0, None), (et.Dome(radius=1.2), 0.4, 3)],
    ids=["plane", "dome"],
)
def test_the_source_is_that_of_two_passes(
    counts: ModuleType, surface: et.Surface, pixel: float, parallels: int | None
) -> None:
    found = counts.GriddedCounts.on(surface, pixel, parallels)
    first, second = rays_of(1), rays_of(2)
    found.add(first, RAYS)
    found.add(second, RAYS)
    both = et.RaySet(
        np.vstack([first.position, second.position]),
        np.vstack([first.direction, second.direction]),
        np.concatenate([first.flux, second.flux]) / 2,
    )
    for threshold in (2.1, 0.1):
        made, expected = found.source(threshold), et.GriddedSource.fit(both, surface, pixel, threshold, parallels)
        assert np.array_equal(made.patches.pixel, expected.patches.pixel)
        assert np.array_equal(made.patches.theta_step, expected.patches.theta_step)
        assert np.array_equal(made.patches.phi_step, expected.patches.phi_step)
        np.testing.assert_allclose(made.patches.values, expected.patches.values, rtol=1e-5)  # counted in float32
        assert made.total_flux == pytest.approx(expected.total_flux, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("surface", "pixel", "parallels", "normal"),
    [
        (et.Plane(0, 5, 5, centre=(0, 0)), 1.0, None, (1.0, 0.0, 0.0)),
        (et.Plane(0, 5, 5, centre=(0, 0)), 1.0, None, (0.0, 1.0, 0.0)),
        (et.Dome(radius=1.2), 0.4, 3, (0.5**0.5, -(0.5**0.5), 0.0)),
    ],
    ids=["x", "y", "diagonal of a dome"],
)
def test_images_are_as_if_counted(
    counts: ModuleType, surface: et.Surface, pixel: float, parallels: int | None, normal: tuple[float, float, float]
) -> None:
    """But for rays on an edge between half degrees, which belong to the one above: there is none here."""
    rays, mirror = rays_of(1), np.eye(3) - 2 * np.outer(normal, normal)
    once, both = (counts.GriddedCounts.on(surface, pixel, parallels) for _ in range(2))
    once.add(rays, RAYS)
    both.add(rays, RAYS)
    both.add(imaged(rays, mirror), RAYS)
    images = once.mirrored(normal)
    assert (images.traced, images.left) == (both.traced, both.left)
    np.testing.assert_allclose(images.flux, both.flux, rtol=1e-5)
    assert (images.flux > 0).sum() > 1.5 * (once.flux > 0).sum()


def test_a_plane_that_moves_the_pixels_is_refused(counts: ModuleType) -> None:
    found = counts.GriddedCounts.on(et.Plane(0, 4, 4, centre=(0.5, 0)), 1.0)
    with pytest.raises(ValueError, match="the image of a pixel is none"):
        found.mirrored((1.0, 0.0, 0.0))


def test_what_was_counted_is_kept(counts: ModuleType, tmp_path: Path) -> None:
    """A second run reads the counts, and traces nothing."""
    traced: list[tuple[int, int]] = []

    def trace(rays: int, seed: int) -> et.RaySet:
        traced.append((rays, seed))
        return rays_of(seed)

    first, again = (counts.GriddedCounts.on(et.Plane(0, 5, 5, centre=(0, 0)), 1.0) for _ in range(2))
    assert list(counts.counted(first, trace, [RAYS, 3 * RAYS], tmp_path)) == [RAYS, 3 * RAYS]
    assert traced == [(RAYS, 1), (2 * RAYS, 2)]
    assert list(counts.counted(again, trace, [RAYS, 3 * RAYS], tmp_path)) == [RAYS, 3 * RAYS]
    assert len(traced) == 2
    assert np.array_equal(first.flux, again.flux)
    assert (first.traced, first.left) == (again.traced, again.left)
