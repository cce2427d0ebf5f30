"""Maps of patches: the mean over each pixel, on both kinds of screen, the right way round."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield.carrier import Disk
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.luminance.gridded_map import gridded_luminance_map
from oracles.sources import PrismaticFilm

FILM = PrismaticFilm()


@pytest.fixture(scope="module")
def source() -> GriddedSource:
    position, direction = FILM.rays(150_000, seed=1)
    rays = et.RaySet(position, direction, np.full(150_000, FILM.total_flux / 150_000))
    return GriddedSource.fit(rays, Disk(radius=FILM.radius, centre=FILM.centre), pixel=1.0, threshold=2.1)


@pytest.mark.parametrize("plane", ["view", "xy"])
def test_pixels_are_means_over_lines_of_sight(source: GriddedSource, plane: str) -> None:
    observer, screen = et.Observer(40, 130, 300, target=(1, -2, 0)), et.Screen(24, 18, 4, 3, plane=plane)  # type: ignore[arg-type]
    lmap = gridded_luminance_map(source, observer, screen, samples=3600)
    right, up, _ = screen.axes(observer)
    rng = np.random.default_rng(3)
    for row, column in ((0, 1), (1, 3), (2, 2)):
        n = 20_000
        x = screen.x[column] + (rng.random(n) - 0.5) * 6
        y = screen.y[row] + (rng.random(n) - 0.5) * 6
        points = np.array([1, -2, 0]) + x[:, None] * right + y[:, None] * up
        seen = source.luminance(points=points, directions=observer.position - points)
        assert abs(seen.mean() - lmap.values[row, column]) < 4 * seen.std() / np.sqrt(n)
    assert np.isnan(lmap.standard_error).all()
    assert (lmap.unit, lmap.values.shape) == ("cd/m²", (3, 4))


def test_the_map_is_the_right_way_round(source: GriddedSource) -> None:
    """The map of the patches is nearer to that of the closed form than any turn or mirror image of it."""
    screen = et.Screen(30, 30, 10, 10)
    for observer in (et.Observer(20, 70, 1000), et.Observer(20, 250, 1000)):
        right, up, _ = screen.axes(observer)
        fine = (np.arange(100) + 0.5) * 0.3 - 15
        points = fine[None, :, None] * right - fine[:, None, None] * up
        sight = observer.position - points
        sight /= np.linalg.norm(sight, axis=-1, keepdims=True)
        truth = (
            FILM.luminance(points=points.reshape(-1, 3), directions=sight.reshape(-1, 3))
            .reshape(10, 10, 10, 10)
            .mean(axis=(1, 3))
        )
        values = gridded_luminance_map(source, observer, screen).values
        right_way = np.corrcoef(values.ravel(), truth.ravel())[0, 1]
        for wrong in (values[::-1], values[:, ::-1], values[::-1, ::-1], values.T):
            assert np.corrcoef(wrong.ravel(), truth.ravel())[0, 1] < right_way - 0.005


def test_refusals(source: GriddedSource) -> None:
    for samples in (0, 10**6):
        with pytest.raises(ArgumentError, match="lines of sight"):
            gridded_luminance_map(source, et.Observer(0, 0, 100), et.Screen(1, 1, 1, 1), samples)
    with pytest.raises(ArgumentError, match="no apparent area"):
        gridded_luminance_map(source, et.Observer(90, 0, 100), et.Screen(1, 1, 1, 1, plane="xy"))
