"""The pitch that a field says it resolves, against rays of sources that have spots of such a pitch."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield.fitting import finest_for, not_so_fine
from etendue.lightfield.resolution import Resolution

Array = npt.NDArray[np.float64]

SIDE = 10.0
"""Of the source [mm], whose middle is off the axis."""

MIDDLE = (0.7, -0.4)
RAYS = 29_000
PLANE = et.Plane(z=0, width=12.0, height=12.0, centre=(0.5, -0.3), focus=(0, 0, 0, 0))


GRID = (3, 3, 3, 3)
STRIP = (16.0, 0.4)
"""Sides of a long source [mm]."""


def spotted(
    *, pitch: float | None, seed: int, rays: int = RAYS, sides: tuple[float, float] = (SIDE, SIDE)
) -> et.RaySet:
    """A rectangle that sends light upwards by the cosine law, with spots (1 + cos)(1 + cos) of this pitch, or even."""
    rng = np.random.default_rng(seed)

    def along(side: float) -> Array:
        x = rng.uniform(-side / 2, side / 2, 6 * rays)
        if pitch is not None and pitch < side / 2:
            x = x[rng.uniform(0, 2, len(x)) < 1 + np.cos(2 * np.pi * x / pitch)]
        return x[:rays]

    position = np.column_stack([along(sides[0]) + MIDDLE[0], along(sides[1]) + MIDDLE[1], np.zeros(rays)])
    sine, phi = np.sqrt(rng.random(rays)), rng.uniform(0, 2 * np.pi, rays)
    direction = np.column_stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1 - sine**2)])
    return et.RaySet(position, direction, np.full(rays, 100.0 / rays))


def contrast(field: et.LightField, *, pitch: float, sides: tuple[float, float] = (SIDE, SIDE)) -> float:
    """What the field shows of the spots, seen along the normal: the worse of the cosines along the sides that have some."""
    n = 240
    offset = [((np.arange(n) + 0.5) / n - 0.5) * side for side in sides]
    x, y = np.meshgrid(*offset)
    points = np.column_stack([x.ravel() + MIDDLE[0], y.ravel() + MIDDLE[1], np.zeros(n * n)])
    seen = field.luminance(points, np.tile([0.0, 0.0, 1.0], (n * n, 1)))[0].reshape(n, n)
    # A cosine on a flat ground has the projection ½.
    return 2.0 * min(
        float((image @ np.cos(2 * np.pi * at / pitch)).sum() / seen.sum())
        for image, at, side in zip((seen, seen.T), offset, sides, strict=True)
        if pitch < side / 2
    )


@pytest.fixture(scope="module")
def stated() -> Resolution:
    return et.LightField.fit(spotted(pitch=None, seed=1), PLANE).resolution()


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.6, 1 / 1.6])
def test_spots_come_back_as_stated(stated: Resolution, factor: float) -> None:
    """Coarser spots with more than half of their contrast, finer ones with less: in fields fitted to rays of their own."""
    pitch = stated.place * factor
    field = et.LightField.fit(spotted(pitch=pitch, seed=2), PLANE)
    shown = contrast(field, pitch=pitch)
    assert shown > 0.5 if factor > 1 else shown < 0.5


@pytest.fixture(scope="module")
def strip() -> et.LightField:
    """Even light of a strip."""
    plane = et.Plane(z=0, width=1.02 * STRIP[0], height=1.02 * STRIP[1], centre=MIDDLE, focus=(0, 0, 0, 0))
    return et.LightField.fit(spotted(pitch=None, seed=1, sides=STRIP), plane, depths=GRID)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.6, 1 / 1.6])
def test_spots_of_a_strip_come_back_as_stated(strip: et.LightField, factor: float) -> None:
    """Its images have as many cells along either side, and those along the longer one are forty times as long."""
    pitch = factor * strip.resolution().place
    field = et.LightField.fit(spotted(pitch=pitch, seed=2, sides=STRIP), strip.surface, depths=GRID)
    shown = contrast(field, pitch=pitch, sides=STRIP)
    assert shown > 0.5 if factor > 1 else shown < 0.5


@pytest.fixture(scope="module")
def symmetric() -> et.LightField:
    """Even light of a square, each ray with its mirror images."""
    plane = et.Plane(z=0, width=12.0, height=12.0, centre=MIDDLE, focus=(0, 0, 0, 0))
    return et.LightField.fit(spotted(pitch=None, seed=1), plane, depths=GRID, symmetry="mirror-xy")


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.25, 1 / 1.25])
def test_spots_of_a_symmetric_source_come_back_as_stated(symmetric: et.LightField, factor: float) -> None:
    """They are even about both middles, as cosines are, so that each ray of them stands for four, as in the statement."""
    pitch = factor * symmetric.resolution().place
    field = et.LightField.fit(spotted(pitch=pitch, seed=2), symmetric.surface, depths=GRID, symmetry="mirror-xy")
    shown = contrast(field, pitch=pitch)
    assert shown > 0.5 if factor > 1 else shown < 0.5


@pytest.mark.parametrize(
    ("surface", "side"),
    [
        (et.Plane(z=0, width=12.0, height=0.3, centre=(0.7, -0.4)), 12.0 / 4),
        (et.Plane(z=0, width=12.0, height=12.0, centre=(0.7, -0.4)), 12.0 / 4),
        (et.Disk(radius=6.0), np.sqrt(np.pi) * 6.0 / 4),
        (et.Cylinder(radius=6.0, bottom=-1.0, top=20.0), np.pi * 12.0 / 4),
    ],
)
def test_cells_are_as_long_as_their_longer_side(surface: et.Plane, side: float) -> None:
    """Four cells along the first side and eight along the second, four along either side of the square of directions."""
    field = et.LightField.fit(spotted(pitch=None, seed=1, rays=200, sides=(12.0, 0.3)), surface, depths=(2, 3, 2, 2))
    found = field.resolution()
    assert (found.cell_place, found.cell_direction) == pytest.approx((side, np.degrees(np.sqrt(np.pi)) / 4), rel=1e-12)


@pytest.mark.slow
def test_more_rays_resolve_more(stated: Resolution) -> None:
    many = et.LightField.fit(spotted(pitch=None, seed=1, rays=4 * RAYS), PLANE, depths=(4, 4, 4, 4)).resolution()
    assert many.place < stated.place
    assert many.direction < stated.direction
    assert (many.part, many.place_limit) == (stated.part, stated.place_limit) == ("plane", "rays")


@pytest.mark.slow
def test_the_same_on_any_threads_and_in_words(stated: Resolution) -> None:
    field = et.LightField.fit(spotted(pitch=None, seed=3, rays=5000), PLANE)
    one, two = (dataclasses.astuple(field.resolution(threads=threads)) for threads in (1, 2))
    assert one == two
    assert f"{stated.place:.2g} mm" in stated.summary()
    assert "more rays would resolve more" in stated.summary()


@pytest.mark.parametrize("number", [1, 100])
def test_what_rests_on_one_ray_is_told_all_the_same(number: int) -> None:
    """With probability 1/e one ray drawn with Poisson's law is none: there is no contrast then, whatever the pitch."""
    rays = spotted(pitch=None, seed=1, rays=number)
    flux = np.ones(number)
    flux[0] = 1e9
    field = et.LightField.fit(et.RaySet(rays.position, rays.direction, flux), PLANE, depths=(2, 2, 4, 4))
    assert field.report.effective_rays == pytest.approx(1.0, rel=1e-6)
    found = [field.resolution(seed=seed) for seed in range(5)]
    assert all(0.0 < r.place <= 12.0 and r.place_limit == "rays" for r in found), found


@pytest.mark.parametrize("flux", [1e-170, 1e300])
def test_fluxes_without_squares_are_refused(flux: float) -> None:
    rays = spotted(pitch=None, seed=1, rays=100)
    with pytest.raises(ArgumentError, match="whose squares, on which errors rest"):
        et.LightField.fit(et.RaySet(rays.position, rays.direction, np.full(100, flux)), PLANE)


def test_the_finest_cells_are_as_asked() -> None:
    """2^k cells along a side of 12 mm, or the longer one of a strip; what is finer than the finest grid is told."""
    for plane in (PLANE, et.Plane(z=0, width=0.3, height=12.0, centre=(0, 0))):
        for side, halvings in ((12 / 4096, 12), (12 / 1000, 10), (12 / 1024, 10), (7.0, 1), (40.0, 1)):
            assert finest_for(plane, side) == halvings
            assert list(not_so_fine(plane, side, halvings)) == []
        assert finest_for(plane, 1e-3) == 12
        (told,) = not_so_fine(plane, 1e-3, 12)
        assert "0.00293 mm" in told
        assert finest_for(plane, None) == 9
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ArgumentError, match="max_resolution"):
            et.LightField.fit(spotted(pitch=None, seed=1, rays=100), PLANE, max_resolution=wrong)


def test_cells_finer_than_the_rays_are_told() -> None:
    """A thousand rays have a grid of 32 × 32 cells, however fine ones are asked for."""
    field = et.LightField.fit(spotted(pitch=None, seed=1, rays=1000), PLANE, depths=(2, 2, 2, 2), max_resolution=0.1)
    assert "cells of 0.1 mm would be more than there are rays: they have 0.375 mm" in field.notes


@pytest.mark.slow
def test_spots_finer_than_the_cells_that_are_asked_for_are_lost() -> None:
    rays = spotted(pitch=1.0, seed=5)
    shown = [
        contrast(et.LightField.fit(rays, PLANE, depths=(2, 2, 2, 2), max_resolution=side), pitch=1.0)
        for side in (None, 0.8)
    ]
    assert shown[0] > 0.5 > shown[1]


@pytest.mark.slow
def test_a_field_a_file_of_it_and_its_diagnostics_state_the_same(tmp_path: Path) -> None:
    """A last digit of an image would change which rays are drawn, and the pitch by a tenth."""
    field = et.LightField.fit(spotted(pitch=None, seed=21, rays=2000), PLANE, depths=(2, 2, 2, 2))
    path = tmp_path / "field.h5"
    field.save(path)
    stated, loaded = field.resolution(), et.LightField.load(path)
    assert loaded.parts[0].space is not None
    assert not np.array_equal(loaded.parts[0].space, field.parts[0].space)
    assert loaded.resolution() == stated
    assert field.resolution(seed=2) != stated
    assert et.diagnose(loaded, seed=2).resolution == stated
