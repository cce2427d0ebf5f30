"""The synthetic sources of the light-field tests: rays against luminance, flux against quadrature, lines against points."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy import stats

from tests.oracles.sources import DieUnderDome, LimbDarkenedDisk, PrismaticFilm, StructuredLed

Array = npt.NDArray[np.float64]

SIGNIFICANCE = 1e-4
"""Of every verdict on random numbers here; seeds are fixed."""

PLANAR = (LimbDarkenedDisk(), PrismaticFilm(), StructuredLed())
DOME = DieUnderDome()
CELLS = (5, 4, 4, 6)
"""Of equal étendue: two of place, squared sine, azimuth. Even and odd, so that no edge of a source hides on theirs."""
RAYS = 400_000
POINTS = 200
"""Per cell, for its mean luminance."""


def plane_lines(source: LimbDarkenedDisk | PrismaticFilm | StructuredLed, unit: Array) -> tuple[Array, Array, float]:
    """Lines through the unit cube (n, 4) of equal étendue, and the étendue of the whole [m² sr]."""
    x0, x1, y0, y1 = source.extent
    sine, turn = np.sqrt(unit[:, 2]), 2 * np.pi * unit[:, 3]
    place = np.stack([x0 + (x1 - x0) * unit[:, 0], y0 + (y1 - y0) * unit[:, 1], np.zeros(len(unit))], axis=-1)
    direction = np.stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - sine**2)], axis=-1)
    return place, direction, (x1 - x0) * (y1 - y0) * np.pi * 1e-6


def plane_unit(source: LimbDarkenedDisk | PrismaticFilm | StructuredLed, place: Array, direction: Array) -> Array:
    x0, x1, y0, y1 = source.extent
    turn = np.arctan2(direction[:, 1], direction[:, 0]) / (2 * np.pi) % 1.0
    columns = (place[:, 0] - x0) / (x1 - x0), (place[:, 1] - y0) / (y1 - y0), 1 - direction[:, 2] ** 2, turn
    return np.stack(columns, axis=-1)


def dome_frame(up: Array, turn: Array) -> tuple[Array, Array, Array]:
    """South, east and outward at height `up` and azimuth `turn` of a unit sphere."""
    c, s, out = np.cos(turn), np.sin(turn), np.sqrt(1 - up**2)
    south = np.stack([up * c, up * s, -out], axis=-1)
    return south, np.stack([-s, c, np.zeros_like(c)], axis=-1), np.stack([out * c, out * s, up], axis=-1)


def dome_lines(source: DieUnderDome, unit: Array) -> tuple[Array, Array, float]:
    south, east, normal = dome_frame(unit[:, 0], 2 * np.pi * unit[:, 1])
    sine, turn = np.sqrt(unit[:, 2:3]), 2 * np.pi * unit[:, 3:4]
    direction = sine * np.cos(turn) * south + sine * np.sin(turn) * east + np.sqrt(1 - sine**2) * normal
    return source.radius * normal, direction, 2 * np.pi**2 * source.radius**2 * 1e-6


def dome_unit(source: DieUnderDome, place: Array, direction: Array) -> Array:
    azimuth = np.arctan2(place[:, 1], place[:, 0]) % (2 * np.pi)
    frame = dome_frame(np.clip(place[:, 2] / source.radius, 0, 1), azimuth)
    a, b, c = (np.sum(axis * direction, axis=1) for axis in frame)
    return np.stack(
        [place[:, 2] / source.radius, azimuth / (2 * np.pi), 1 - c**2, np.arctan2(b, a) / (2 * np.pi) % 1], -1
    )


def cells(unit: Array) -> npt.NDArray[np.int64]:
    index = np.minimum((unit * CELLS).astype(np.int64), np.array(CELLS) - 1)
    return np.ravel_multi_index(tuple(index.T), CELLS)


def stratified(seed: int) -> Array:
    """POINTS points of the unit cube in each cell, cell after cell."""
    corner = np.stack(np.unravel_index(np.arange(np.prod(CELLS)), CELLS), axis=-1)
    return (np.repeat(corner, POINTS, axis=0) + np.random.default_rng(seed).random((len(corner) * POINTS, 4))) / CELLS


FAMILIES = [(source, plane_lines, plane_unit) for source in PLANAR] + [(DOME, dome_lines, dome_unit)]
NAMES = [type(source).__name__ for source, *_ in FAMILIES]


@pytest.mark.slow
@pytest.mark.parametrize(("source", "lines", "unit_of"), FAMILIES, ids=NAMES)
def test_rays_follow_the_luminance(source, lines, unit_of) -> None:
    """χ² over étendue cells: counts against luminance at random points of each cell, both with their variance."""
    place, direction, etendue = lines(source, stratified(11))
    luminance = source.luminance(points=place, directions=direction).reshape(-1, POINTS)
    share = etendue / len(luminance) / source.total_flux
    expected = RAYS * share * luminance.mean(axis=1)
    variance = (RAYS * share) ** 2 * luminance.var(axis=1, ddof=1) / POINTS

    counts = np.bincount(cells(unit_of(source, *source.rays(RAYS, seed=5))), minlength=len(luminance))
    assert counts[expected == 0].sum() <= RAYS * 1e-4  # a corner of the source that no point met
    enough = expected > 10
    squares = (counts - expected)[enough] ** 2 / (expected + variance)[enough]
    assert stats.chi2.sf(squares.sum(), enough.sum()) > SIGNIFICANCE
    assert expected[~enough].sum() < 0.01 * RAYS


@pytest.mark.parametrize(("source", "lines", "unit_of"), FAMILIES, ids=NAMES)
def test_the_flux_is_the_integral_of_the_luminance(source, lines, unit_of) -> None:  # noqa: ARG001
    place, direction, etendue = lines(source, stratified(23))
    luminance = source.luminance(points=place, directions=direction).reshape(-1, POINTS)
    error = np.sqrt(luminance.var(axis=1, ddof=1).sum() / POINTS) / len(luminance) * etendue
    assert error < 0.005 * source.total_flux
    deviation = (luminance.mean() * etendue - source.total_flux) / error
    assert 2 * stats.norm.sf(abs(deviation)) > SIGNIFICANCE


@pytest.mark.parametrize(("source", "lines", "unit_of"), FAMILIES, ids=NAMES)
def test_the_luminance_belongs_to_the_line(source, lines, unit_of) -> None:  # noqa: ARG001
    """Moved along its line, outside the source, a point sees the same, but for lines within rounding of an edge."""
    place, direction, _ = lines(source, np.random.default_rng(3).random((20_000, 4)))
    here, far = (
        source.luminance(points=place, directions=direction),
        source.luminance(points=place + 750.0 * direction, directions=direction),
    )
    same = np.isclose(here, far, rtol=1e-6, atol=0)
    assert same.mean() > 0.9995
    assert (here > 0).mean() > 0.2


@pytest.mark.parametrize(("source", "lines", "unit_of"), FAMILIES, ids=NAMES)
def test_every_ray_lies_where_its_source_shines(source, lines, unit_of) -> None:  # noqa: ARG001
    place, direction = source.rays(50_000, seed=9)
    assert place.shape == direction.shape == (50_000, 3)
    assert np.allclose(np.sum(direction**2, axis=1), 1.0, rtol=0, atol=1e-14)
    luminance = source.luminance(points=place + 1e-9 * direction, directions=direction)
    assert (luminance > 0).mean() > 0.9999
    if source is not DOME:
        assert luminance.max() < source.ceiling
        x0, x1, y0, y1 = source.extent
        assert (place[:, 0] > x0).all()
        assert (place[:, 0] < x1).all()
        assert (place[:, 1] > y0).all()
        assert (place[:, 1] < y1).all()


@pytest.mark.parametrize("source", [*PLANAR, DOME], ids=NAMES)
def test_no_mirror_and_no_half_turn_leaves_a_source_unchanged(source) -> None:
    """The centre of the light and of the directions: not on any axis, not on a diagonal."""
    place, direction = source.rays(200_000, seed=13)
    middle = (np.array(source.extent[::2]) + source.extent[1::2]) / 2
    for values in (place[:, :2] - middle, direction[:, :2]):
        mean, error = values.mean(axis=0), values.std(axis=0) / np.sqrt(len(values))
        assert (np.abs(mean) > 4 * error).all()
        assert abs(abs(mean[0]) - abs(mean[1])) > 4 * np.hypot(*error)


@pytest.mark.parametrize("source", PLANAR, ids=NAMES[:-1])
def test_planar_sources_are_dark_from_behind_and_beside(source) -> None:
    x, y = source.centre
    points = np.array([[x, y, 0.0], [x, y, 0.0], [source.extent[1] + 1, y, 0.0]])
    directions = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert (source.luminance(points=points, directions=directions) == 0).all()


@pytest.mark.slow
def test_the_flux_does_not_change_with_finer_gauss_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    """An edge that a rule crosses would show here."""
    from tests.oracles import sources

    before = [source.total_flux for source in (*PLANAR, DOME)]
    gauss = sources._gauss
    monkeypatch.setattr(sources, "_gauss", lambda nodes, low, high: gauss(2 * nodes, low, high))
    after = [type(source)().total_flux for source in (*PLANAR, DOME)]
    assert after == pytest.approx(before, rel=1e-9)


def test_a_dome_magnifies_a_die_at_its_centre_by_its_index() -> None:
    """V4: a parallel view of height h along the axis meets the plane of the die at h / (n cos(i − i'))."""
    height = np.array([0.05, 0.2, 0.4])
    i = np.arcsin(height / DOME.radius)
    inside = np.arcsin(np.sin(i) / DOME.index)
    reach = height / (DOME.index * np.cos(i - inside))
    points = np.stack([-height, np.zeros(3), np.full(3, 40.0)], axis=-1)
    transmittance = DOME.transmittance(cos_inside=np.cos(inside), cos_outside=np.cos(i))
    die = DOME.die_luminance(x=-reach, y=np.zeros(3), p=-np.sin(i - inside), q=np.zeros(3))  # inside it leans outwards
    expected = transmittance * die / DOME.index**2 + DOME.floor_luminance
    assert DOME.luminance(points=points, directions=np.tile([0.0, 0.0, 1.0], (3, 1))) == pytest.approx(
        expected, rel=1e-12
    )


def test_fresnel_at_the_normal() -> None:
    assert DOME.transmittance(cos_inside=np.ones(1), cos_outside=np.ones(1)) == pytest.approx([0.96], rel=1e-15)


def test_the_floor_carries_its_share_in_every_direction() -> None:
    place, direction = DOME.rays(400_000, seed=17)
    downwards = (direction[:, 2] < 0).sum()  # a quarter of what a hemisphere scatters, and nothing of the die
    expected = 0.25 * DOME.floor * 400_000
    assert stats.poisson.cdf(downwards, expected) > SIGNIFICANCE
    assert stats.poisson.sf(downwards - 1, expected) > SIGNIFICANCE
    assert np.allclose(np.linalg.norm(place, axis=1), DOME.radius, rtol=1e-12)
