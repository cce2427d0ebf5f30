"""Where the squares of the gridded algorithm lie, and which angular bins it tries."""

from __future__ import annotations

import itertools
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.lightfield.gridded import angular
from etendue.lightfield.gridded.pixelated import PixelatedSurface
from etendue.lightfield.gridded.pixels import SquarePixels

SIDE = 0.7


def lopsided(n: int, seed: int = 1) -> tuple[Any, Any]:
    """Rays from 1.9 × 1.1 mm about (0.31, −0.17), aslant."""
    rng = np.random.default_rng(seed)
    position = np.column_stack([rng.uniform(-0.64, 1.26, n), rng.uniform(-0.72, 0.38, n), np.zeros(n)])
    direction = rng.normal([0.2, -0.1, 1.5], 0.3, (n, 3))
    direction[:, 2] = np.abs(direction[:, 2]) + 0.1
    return position, direction / np.linalg.norm(direction, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("centre_on", "count", "touched"), [("corner", 576, 468), ("pixel", 529, 453), ("auto", 529, 453)]
)
def test_a_square_of_23_mm_and_the_lamp_in_it(centre_on: Any, count: int, touched: int) -> None:
    """Section 3.2.3 of the thesis has 23 × 23 squares of 1 mm. Squares that a disk of 23 mm touches are those whose nearest
    point to the middle is within it."""
    plane = et.Plane(z=0, width=23, height=23, centre=(0.4, -2.0))
    (pixels,) = PixelatedSurface.cut(plane, 1.0, None, centre_on=centre_on).pixels
    cells = pixels.cells(np.arange(pixels.count))
    nearest = np.maximum(np.abs(cells.centre[:, :2] - plane.centre) - 0.5, 0.0)
    assert (pixels.count, int((np.hypot(*nearest.T) < 11.5).sum())) == (count, touched)
    # Each knows its own points again, on whichever lattice.
    drawn = pixels.on_pixels(np.arange(count), np.zeros((count, 3)), np.zeros((count, 3)), np.random.default_rng(2))
    local, _ = pixels.to_local(drawn, np.tile([0.0, 0.0, 1.0], (count, 1)))
    np.testing.assert_array_equal(pixels.index(local), np.arange(count))
    for corners, centre in zip(cells.outline, cells.centre, strict=True):
        np.testing.assert_allclose(corners.mean(axis=0), centre, atol=1e-12)


@pytest.mark.parametrize("centre_on", ["corner", "pixel", "auto"])
def test_stray_rays_do_not_move_the_squares(centre_on: Any) -> None:
    """A ray far off makes an open plane larger, about another centre; the tables of all other pixels stay as they are."""
    position, direction = lopsided(3000)
    far = np.array([[37.123, -21.456, 0.0]])
    alone, with_stray = (
        et.GriddedSource.fit(et.RaySet(x, k, np.ones(len(x))), et.Plane(z=0), SIDE, 2.0, centre_on=centre_on)
        for x, k in ((position, direction), (np.vstack([position, far]), np.vstack([direction, [[0, 0, 1]]])))
    )
    # Corners at whole multiples of the side, or pixels.
    offset = 0.0 if centre_on == "pixel" else 0.5
    steps = alone.patches.centre[:, :2] / SIDE - offset
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    near = with_stray.patches.centre[:, 0] < 10
    assert near.sum() == len(alone.patches) == len(with_stray.patches) - 1
    np.testing.assert_allclose(with_stray.patches.centre[near], alone.patches.centre, atol=1e-12)
    np.testing.assert_allclose(with_stray.patches.flux[near], alone.patches.flux)


def test_rounding_adds_no_square() -> None:
    """Sides that are no binary fractions: 2.3 mm in tenths are 23 squares, 2.4 mm are 24, wherever the plane lies."""
    for tenths, x in itertools.product(range(1, 60), (0.0, 0.3, -1.7)):
        plane = et.Plane(z=0, width=tenths / 10, height=tenths / 10, centre=(x, 0.1))
        for centre_on, odd in (("corner", 0), ("pixel", 1), ("auto", tenths % 2)):
            (pixels,) = PixelatedSurface.cut(plane, 0.1, None, centre_on=centre_on).pixels  # type: ignore[arg-type]
            assert pixels.count == (tenths + (tenths % 2 != odd)) ** 2


def test_the_edge_belongs_to_the_last_square() -> None:
    part = et.Plane(z=0, width=2.3, height=2.3, centre=(0, 0)).parts()[0]
    pixels = SquarePixels(part, 0.1, (0.05, 0.05))
    points = np.array([[-1.15, -1.15, 0.0], [1.15, 1.15, 0.0], [1.15 + 1e-6, 0, 0], [np.inf, 0, 0], [np.nan, 0, 0]])
    assert pixels.index(points).tolist() == [0, 23 * 23 - 1, -1, -1, -1]


def test_steps_are_those_that_are_stated() -> None:
    """All tables begin with the coarsest bins and stop at the finest; every step divides the quarter and the circle."""
    position, direction = lopsided(4000)
    rays = et.RaySet(position, direction, np.ones(len(position)))
    stated: dict[str, Any] = {"coarsest_bins": (15, 60), "finest_bins": (5, 20)}
    coarse, fine = (et.GriddedSource.fit(rays, et.Plane(z=0), SIDE, e, **stated).patches for e in (100.0, 0.0))
    assert set(zip(coarse.theta_step, coarse.phi_step, strict=True)) == {(15, 60)}
    assert set(zip(fine.theta_step, fine.phi_step, strict=True)) == {(5, 20)}
    steps = [(g.theta_step, g.phi_step) for g in angular.sequence((15, 60), (5, 20))]
    assert steps == [(15, 60), (10, 45), (9, 40), (6, 36), (5, 30), (5, 24), (5, 20)]
    # The flux of the bins is that of the rays, whatever the steps.
    for patches in (coarse, fine):
        assert patches.flux.sum() == pytest.approx(4000.0)


@pytest.mark.parametrize(
    ("options", "error", "told"),
    [
        ({"coarsest_bins": (31, 90)}, ArgumentError, "coarsest bins: Δθ is 31°"),
        ({"finest_bins": (1, 7)}, ArgumentError, "finest bins: Δφ is 7°"),
        ({"coarsest_bins": (0, 90)}, ArgumentError, "Δθ is 0°"),
        ({"coarsest_bins": (5, 90), "finest_bins": (6, 1)}, ArgumentError, "finest bins have Δθ = 6°, more than"),
        ({"centre_on": "pixels"}, UnknownNameError, "pixel"),
    ],
)
def test_what_cannot_be_is_refused(options: Any, error: type[Exception], told: str) -> None:
    position, direction = lopsided(10)
    with pytest.raises(error, match=told):
        et.GriddedSource.fit(et.RaySet(position, direction, np.ones(10)), et.Plane(z=0), SIDE, **options)
