"""Rays drawn from a light field: they have its density, its flux and their own addresses, and need no memory."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.errors import ArgumentError
from etendue.lightfield.carrier import Surface
from etendue.lightfield.counting import PartGrids, count_rays
from etendue.lightfield.field_rays import FieldRays
from etendue.lightfield.light_field import LightField
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import BATCH
from oracles.light_fields import SURFACES, make_field
from scipy import stats

Array = npt.NDArray[np.float64]

SIGNIFICANCE = 1e-4
"""Of every verdict on random numbers here; seeds are fixed, so that a verdict does not change from run to run."""

MM2 = 1e-6
"""Square millimetre in square metres."""

SINGLE = ("plane", "disk", "hemisphere", "open cylinder")
"""Surfaces of one part, one of each shape."""


# --- they have the field's density: coordinate by coordinate -----------------------------------------------------------

PIECES = (16, 16, 8, 8)
"""Between so many edges along s₁, s₂, a, b the luminance of the fields below is a polynomial of second order in each
coordinate: half a cell of their factors of 8 × 8 and 4 × 4."""


def gauss(pieces: int, nodes: int) -> tuple[Array, Array]:
    """Nodes and weights on [0, 1], `nodes` between any two edges."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    return ((np.arange(pieces)[:, None] + (x + 1) / 2) / pieces).ravel(), np.tile(w / 2 / pieces, pieces)


def density(field: LightField, axes: list[Array]) -> Array:
    """Probability density in the unit cube, from the luminance along the lines of a lattice."""
    (part,) = field.surface.parts()
    at = np.stack([g.ravel() for g in np.meshgrid(*axes, indexing="ij")], axis=1)
    luminance, _ = field.luminance(*_core.rays_of_part(part.core(), at))
    return luminance.reshape([len(a) for a in axes]) * MM2 * part.etendue / field.total_flux


@pytest.fixture(scope="module", params=SINGLE)
def coordinates(request: pytest.FixtureRequest) -> tuple[LightField, Array]:
    """A field of one part, and 200 000 rays drawn from it by their coordinates there."""
    field = make_field(SURFACES[request.param], seed=7)
    rays = field.sample(200_000, seed=3)
    part, at = _core.cross_parts([p.core() for p in field.surface.parts()], rays.position, rays.direction)
    assert (part == 0).all()
    return field, at


@pytest.mark.slow
def test_the_density_integrates_to_one(coordinates: tuple[LightField, Array]) -> None:
    """Gauss rules are exact for it, so that the oracle of the tests below is; and total_flux is what it should be."""
    rules = [gauss(n, 2) for n in PIECES]
    values = density(coordinates[0], [x for x, _ in rules])
    total = np.einsum("ijkl,i,j,k,l->", values, *(w for _, w in rules))
    assert total == pytest.approx(1, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("axis", range(4))
def test_each_coordinate_is_uniform_under_its_distribution_function(
    coordinates: tuple[LightField, Array], axis: int
) -> None:
    """The probability integral transform, with three nodes per piece along the axis: the parabola through them."""
    field, at = coordinates
    rules = [gauss(n, 3 if k == axis else 2) for k, n in enumerate(PIECES)]
    values = np.moveaxis(density(field, [x for x, _ in rules]), axis, 0)
    others = [w for k, (_, w) in enumerate(rules) if k != axis]
    marginal = np.einsum("ijkl,j,k,l->i", values, *others).reshape(-1, 3)
    x, w = np.polynomial.legendre.leggauss(3)
    legendre = np.stack([np.ones(3), x, (3 * x * x - 1) / 2])
    series = marginal @ (w * legendre * (np.arange(3)[:, None] + 0.5)).T
    pieces = len(series)
    below = np.concatenate([[0], np.cumsum(series[:, 0])]) / pieces
    piece = np.minimum((at[:, axis] * pieces).astype(int), pieces - 1)
    t = 2 * (at[:, axis] * pieces - piece) - 1
    integrals = np.stack([t + 1, (t * t - 1) / 2, (t**3 - t) / 2]) / 2
    u = below[piece] + np.sum(series[piece].T * integrals, axis=0) / pieces
    assert below[-1] == pytest.approx(1, rel=1e-7)
    assert stats.kstest(u, "uniform").pvalue > SIGNIFICANCE


@pytest.mark.slow
def test_all_coordinates_together(coordinates: tuple[LightField, Array]) -> None:
    """χ² over 8 × 4 × 4 × 8 cells, against too good a fit as well."""
    field, at = coordinates
    cells = (8, 4, 4, 8)
    rules = [gauss(n, 2) for n in PIECES]
    mass = density(field, [x for x, _ in rules])
    for k, (_, w) in enumerate(rules):
        mass *= w.reshape([-1 if k == axis else 1 for axis in range(4)])
    shape = list(itertools.chain.from_iterable((n, 2 * pieces // n) for n, pieces in zip(cells, PIECES, strict=True)))
    expected = mass.reshape(shape).sum(axis=(1, 3, 5, 7)).ravel()
    index = np.minimum((at * cells).astype(int), np.array(cells) - 1)
    counts = np.bincount(np.ravel_multi_index(tuple(index.T), cells), minlength=len(expected))
    likely = expected * len(at) > 5
    seen, hoped = np.append(counts[likely], counts[~likely].sum()), np.append(expected[likely], expected[~likely].sum())
    p = stats.chisquare(seen, hoped / hoped.sum() * seen.sum()).pvalue
    assert SIGNIFICANCE < p < 1 - SIGNIFICANCE
    assert likely.sum() > 900


# --- they have the field's density: along lines, charts unseen ---------------------------------------------------------


def lines_out_of(surface: Surface, n: int, rng: np.random.Generator) -> tuple[Array, Array, float]:
    """Lines with even density in étendue that leave a convex surface, and the étendue they fill.

    Points are even on its area, directions follow the cosine law; no chart is used. All that leaves the window of a dome
    leaves the dome above it, too.
    """
    parts = [p for p in surface.parts() if p.name != "window"]
    areas = np.array([part.area for part in parts])
    owner = rng.choice(len(parts), p=areas / areas.sum(), size=n)
    point, normal = np.zeros((n, 3)), np.zeros((n, 3))
    for index, part in enumerate(parts):
        mine = np.flatnonzero(owner == index)
        u, v = rng.random((2, len(mine)))
        turn, (a, b) = 2 * np.pi * v, part.size
        ring = np.stack([np.cos(turn), np.sin(turn)])
        flat = np.stack([0 * u, 0 * u, 1 + 0 * u])
        if part.shape == "rectangle":
            local, out = np.stack([(u - 0.5) * a, (v - 0.5) * b, 0 * u]), flat
        elif part.shape == "disk":
            local, out = np.stack([*(a * np.sqrt(u) * ring), 0 * u]), flat
        elif part.shape == "hemisphere":  # zones of a sphere are as large as they are high
            out = np.stack([*(np.sqrt(1 - u * u) * ring), u])
            local = a * out
        else:
            out = np.stack([*ring, 0 * u])
            local = np.stack([*(a * ring), (u - 0.5) * b])
        axes = np.array(part.axes)
        point[mine], normal[mine] = local.T @ axes + np.array(part.centre), out.T @ axes
    sphere = rng.normal(size=(n, 3))
    direction = normal + sphere / np.linalg.norm(sphere, axis=1)[:, None]
    return point, direction / np.linalg.norm(direction, axis=1)[:, None], math.pi * float(areas.sum())


def features(point: Array, direction: Array) -> Array:
    """What tells lines apart, whatever point they are given by: direction, and the foot of the perpendicular."""
    foot = point - np.sum(point * direction, axis=1)[:, None] * direction
    return np.stack([direction[:, 0], direction[:, 1] + 0.3 * direction[:, 2], foot[:, 0], foot[:, 1] - foot[:, 2]])


@pytest.mark.slow
@pytest.mark.parametrize("which", ["plane", "disk", "hemisphere", "sphere", "cylinder", "box", "dome"])
def test_lines_are_as_frequent_as_they_are_bright(which: str) -> None:
    """χ² over 256 classes of lines between counts of rays and the luminance averaged over other, even lines.

    Both are random: the variance of a class is that of its count and that of its average.
    """
    field = make_field(SURFACES[which], seed=11)
    n = 150_000
    point, direction, etendue = lines_out_of(field.surface, n, np.random.default_rng(2))
    value = field.luminance(points=point, directions=direction)[0] * MM2 * etendue / field.total_flux / n
    rays = field.sample(n, seed=5)
    even, drawn = features(point, direction), features(rays.position, rays.direction)
    edges = [np.quantile(f, [0.25, 0.5, 0.75]) for f in even]
    classes = [
        np.ravel_multi_index([np.searchsorted(e, f) for e, f in zip(edges, table, strict=True)], (4,) * 4)
        for table in (even, drawn)
    ]
    shares, squares = (np.bincount(classes[0], w, 256) for w in (value, value**2))
    counts = np.bincount(classes[1], minlength=256)
    assert abs(shares.sum() - 1) < stats.norm.isf(SIGNIFICANCE / 2) * math.sqrt(squares.sum() - 1 / n)
    rare = shares * n < 20
    shares, squares, counts = (np.append(a[~rare], a[rare].sum()) for a in (shares, squares, counts))
    seen = shares > 0
    chi2 = np.sum((counts / n - shares)[seen] ** 2 / (shares / n + squares)[seen])
    assert seen.sum() > 150
    assert counts[~seen].sum() == 0
    assert SIGNIFICANCE < stats.chi2.sf(chi2, seen.sum()) < 1 - SIGNIFICANCE


@pytest.mark.slow
@pytest.mark.parametrize("which", SURFACES)
def test_rays_leave_their_surface(which: str) -> None:
    """But for one in a million of those that graze it, whose crossing rounding may lose."""
    field = make_field(SURFACES[which], seed=4)
    counts = count_rays(field.rays(200_000), field.surface, PartGrids((2, 2, 2, 2), (4, 4)))
    assert counts.unmet_rays <= 1
    assert sum(counts.part_flux) + counts.unmet_flux == pytest.approx(field.total_flux, rel=1e-12)


def cell_means(field: LightField, side: int) -> tuple[Array, Array]:
    """Share of the flux in each of side⁴ cells, exactly, and the standard error that the field states for it."""
    (part,) = field.surface.parts()
    nodes, weights = gauss(PIECES[0], 2)
    at = np.stack([g.ravel() for g in np.meshgrid(*[nodes] * 4, indexing="ij")], axis=1)
    lines = _core.rays_of_part(part.core(), at)
    mass = np.einsum("i,j,k,l->ijkl", *[weights] * 4) * MM2 * part.etendue / field.total_flux
    value, error = (
        (mass * v.reshape(mass.shape)).reshape([side, len(nodes) // side] * 4).sum(axis=(1, 3, 5, 7)).ravel()
        for v in field.luminance(*lines)
    )
    return value, error


@pytest.mark.slow
def test_a_refit_of_the_rays_agrees_with_the_field() -> None:
    """In the cells of its grid, 49 rays each: nearer than counts would be, and as near as it says."""
    n, side = 200_000, 8
    field = make_field(SURFACES["disk"], seed=2, factors=None)
    refit = LightField.fit(field.rays(n, seed=9), field.surface, depths=(3, 3, 3, 3))
    assert refit.total_flux == pytest.approx(field.total_flux, rel=1e-9)
    (truth, _), (found, error) = cell_means(field, side), cell_means(refit, side)
    assert truth.sum() == pytest.approx(1, rel=1e-7)
    lit = truth * n > 5
    off, error, truth = np.abs(found - truth)[lit], error[lit], truth[lit]
    assert stats.chi2.sf(np.sum(off**2 / truth) * n, len(off)) > SIGNIFICANCE
    assert np.median(error / np.sqrt(truth / n)) < 1.2  # than those of the counts, that is
    for sigmas in (1, 2):
        share = math.erf(sigmas / math.sqrt(2))
        assert np.mean(off < sigmas * error) > stats.binom.ppf(SIGNIFICANCE, len(off), share) / len(off)


# --- every ray has its address -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def field() -> LightField:
    return make_field(SURFACES["dome"], seed=6, flux_unit="W")


def test_any_stretch_has_the_same_bits(field: LightField) -> None:
    rays = field.rays(100_000, seed=2**64 - 1)
    whole = _core.read_rays(rays.core_source(), 0, len(rays))
    for start, stop in ((0, 1), (4095, 8193), (99_990, 100_000), (50_000, 50_000)):
        for a, b in zip(whole, _core.read_rays(rays.core_source(), start, stop), strict=True):
            np.testing.assert_array_equal(a[start:stop], b)
    for size in (7919, BATCH):
        columns = zip(*((b.position, b.direction, b.flux) for b in rays.batches(size)), strict=True)
        for a, parts in zip(whole, columns, strict=True):
            np.testing.assert_array_equal(a, np.concatenate(parts))


def test_a_ray_hangs_on_the_seed_and_its_number_alone(field: LightField) -> None:
    few, many = field.sample(1000, seed=5), field.sample(50_000, seed=5)
    np.testing.assert_array_equal(few.position, many.position[:1000])
    np.testing.assert_array_equal(few.direction, many.direction[:1000])
    assert len(np.unique(many.position, axis=0)) == 50_000
    seeds = (0, 1, 2, 3, 2**32, 2**63, 2**64 - 1)
    assert len(np.unique([field.sample(1, seed).position[0] for seed in seeds], axis=0)) == len(seeds)


def test_one_ray_tells_nothing_of_the_next(field: LightField) -> None:
    p = field.sample(200_000, seed=8).direction[:, 0]
    low, high = np.searchsorted(np.quantile(p, [0.2, 0.4, 0.6, 0.8]), np.stack([p[:-1], p[1:]]))
    table = np.bincount(5 * low + high, minlength=25).reshape(5, 5)
    assert stats.chi2_contingency(table).pvalue > SIGNIFICANCE


def test_a_saved_field_gives_its_own_rays_again(field: LightField, tmp_path: Path) -> None:
    field.save(tmp_path / "field.h5")
    one, other = (LightField.load(tmp_path / "field.h5").sample(1000) for _ in range(2))
    np.testing.assert_array_equal(one.position, other.position)


# --- flux, names and refusals ------------------------------------------------------------------------------------------


def test_rays_carry_the_flux_of_the_field_in_equal_shares(field: LightField) -> None:
    rays = field.rays(30_000, seed=3)
    assert isinstance(rays, FieldRays)
    assert (len(rays), rays.flux_unit, rays.has_position, rays.flux_scale) == (30_000, "W", True, 1.0)
    assert rays.total_flux == field.total_flux
    sample = field.sample(30_000, seed=3)
    assert sample.flux_unit == "W"
    assert np.ptp(sample.flux) == 0
    assert math.fsum(sample.flux) == pytest.approx(field.total_flux, rel=1e-12)
    tally = rays.pass_over()
    assert (tally.rays, tally.unusable) == (30_000, 0)
    assert tally.flux == pytest.approx(field.total_flux, rel=1e-12)
    assert tally.norm_error < 1e-14


def test_provenance_is_enough_to_draw_them_again(field: LightField) -> None:
    for rays in (field.rays(12, seed=77), field.sample(12, seed=77)):
        assert rays.provenance.source == field.provenance.source
        assert rays.provenance.steps == (*field.provenance.steps, "12 rays drawn from the light field, seed 77")


@pytest.mark.parametrize(("n", "seed"), [(0, 1), (-1, 1), (2**63, 1), (10, -1), (10, 2**64)])
def test_numbers_out_of_their_domain(field: LightField, n: int, seed: int) -> None:
    name = (
        r"FieldRays: the number of rays is -?\d+; give" if seed == 1 else r"seed is -?\d+; give a whole number from 0"
    )
    for draw in (field.rays, field.sample):
        with pytest.raises(ArgumentError, match=name):
            draw(n, seed)


def test_numbers_that_are_no_integers(field: LightField) -> None:
    for n, seed in ((1e6 + 0.5, 1), (10, 1.5), ("10", 1)):
        with pytest.raises(ArgumentError, match="give a whole number from"):
            field.rays(n, seed=seed)  # type: ignore[arg-type]
    assert len(field.rays(np.int64(5), seed=np.uint64(3))) == len(field.rays(5.0, 3)) == 5  # type: ignore[arg-type]


# --- streams -----------------------------------------------------------------------------------------------------------


def test_a_trillion_rays_need_no_memory(field: LightField) -> None:
    rays = field.rays(10**12)
    assert len(rays) == 10**12
    batch = next(rays.batches(1000))
    assert math.fsum(batch.flux) == pytest.approx(field.total_flux * 1e-9, rel=1e-12)
    last = _core.read_rays(rays.core_source(), 10**12 - 2, 10**12)
    assert np.isfinite(last[0]).all()


@pytest.mark.slow
def test_rays_are_written_as_they_are_drawn(field: LightField, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """To TM-25 and back, and never more than a batch at once."""
    read, stretches = _core.read_rays, []

    def spy(source: Any, start: int, stop: int) -> Any:
        stretches.append((start, stop))
        return read(source, start, stop)

    n = 2 * BATCH + 12_345
    with monkeypatch.context() as patched:
        patched.setattr(_core, "read_rays", spy)
        lost = et.write_rays(tmp_path / "rays.tm25ray", field.rays(n, seed=4))
    assert len(lost) == 1  # that the field was made from a measurement or a simulation, it does not know
    assert [start for start, _ in stretches[1:]] == [stop for _, stop in stretches[:-1]]
    assert (stretches[0][0], stretches[-1][1]) == (0, n)
    assert max(stop - start for start, stop in stretches) <= BATCH
    back, drawn = et.read_rays(tmp_path / "rays.tm25ray"), field.sample(n, seed=4)
    assert isinstance(back, RaySet)
    assert (len(back), back.flux_unit) == (n, "W")
    assert back.total_flux == pytest.approx(field.total_flux, rel=1e-6)
    np.testing.assert_allclose(back.position, drawn.position, atol=1e-6)
    np.testing.assert_allclose(back.direction, drawn.direction, atol=1e-7)
