"""What can be done to a ray set, against closed forms, brute force and the statistics of random choices."""

from __future__ import annotations

import functools
import itertools
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from etendue.errors import ArgumentError, UnitError, UnknownNameError
from etendue.quantities import ray_merge, ray_operations, ray_rewriting
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.report import RayFileWarning
from etendue.quantities.spectrum import Spectrum, photopic_efficiency
from etendue.quantities.spool import spool
from etendue.units import LUMINOUS_EFFICACY_MAX
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, linalg, stats
from scipy.spatial.transform import Rotation

SIGNIFICANCE = 1e-4
"""Of every verdict on random choices here; seeds are fixed, so that a verdict does not change from run to run."""

fixed = settings(derandomize=True, deadline=None, max_examples=50)
coordinates = st.tuples(*[st.floats(-100, 100)] * 3)
FILE = Provenance(source="led.ray", format="lighttools", fingerprint="f0")

RECORD = np.dtype(
    [
        ("position", "<f8", 3), ("direction", "<f8", 3), ("flux", "<f8"), ("wavelength", "<f4"),
        ("radiant_flux", "<f4"), ("stokes", "<f4", 3), ("polarisation_axis", "<f4", 3), ("additional", "<f4", 2),
    ]
)  # fmt: skip


def uneven(n: int = 500, seed: int = 3, meaning: RaySetMeaning | None = None) -> RaySet:
    """Rays without symmetry and with every kind of column; ``additional`` holds the number of the ray."""
    rng = np.random.default_rng(seed)
    table = np.zeros(n, RECORD)
    table["position"] = rng.normal([3, -1, 0.5], [1, 2, 0.3], (n, 3))
    direction = rng.normal([0.3, -0.2, 1], 0.4, (n, 3))
    table["direction"] = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    table["flux"] = rng.gamma(0.7, 2.0, n) + 1e-3
    table["wavelength"] = rng.uniform(420, 680, n)
    table["radiant_flux"] = table["flux"] / 300
    table["stokes"] = rng.uniform(-0.5, 0.5, (n, 3))
    axis = rng.normal(size=(n, 3))
    table["polarisation_axis"] = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    table["additional"] = np.arange(n)[:, None]
    return RaySet.from_records(table, meaning or RaySetMeaning())


def number(rays: RaySet) -> np.ndarray:
    """Which ray of `uneven` each ray is."""
    return rays.column("additional")[:, 0].astype(int)


def distance_to_line(point: np.ndarray, x: np.ndarray, k: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.cross(point - x, k), axis=1)


# --- moving rays -----------------------------------------------------------------------------------------------------


@fixed
@given(coordinates.filter(lambda a: np.linalg.norm(a) > 1e-3), st.floats(-1000, 1000))
def test_rotation_is_right_handed_about_the_axis_and_undone_by_its_reverse(
    axis: tuple[float, ...], angle: float
) -> None:
    rays = uneven(20)
    turned = rays.rotated(axis, angle)
    rotation = Rotation.from_rotvec(np.deg2rad(angle) * np.array(axis) / np.linalg.norm(axis))
    np.testing.assert_allclose(turned.position, rotation.apply(rays.position), atol=1e-12)
    np.testing.assert_allclose(turned.direction, rotation.apply(rays.direction), atol=1e-13)
    np.testing.assert_allclose(
        turned.column("polarisation_axis"), rotation.apply(rays.column("polarisation_axis")), atol=1e-6
    )
    back = turned.rotated(axis, -angle)
    np.testing.assert_allclose(back.position, rays.position, atol=1e-12)
    np.testing.assert_allclose(back.direction, rays.direction, atol=1e-13)
    np.testing.assert_array_equal(back.flux, rays.flux)


@fixed
@given(coordinates, st.floats(1e-3, 1e3))
def test_moving_and_scaling_change_positions_only(offset: tuple[float, ...], factor: float) -> None:
    rays = uneven(20, meaning=RaySetMeaning(length_scale=25.4, declared_flux=7.0))
    changed = rays.moved(offset).scaled(factor)
    np.testing.assert_allclose(changed.position, (rays.position + offset) * factor, rtol=1e-13, atol=1e-12)
    np.testing.assert_allclose(changed.direction, rays.direction, atol=1e-15)
    np.testing.assert_allclose(changed.flux, rays.flux, rtol=1e-15)
    assert changed.total_flux == pytest.approx(7.0, rel=1e-13)
    for name in ("stokes", "polarisation_axis", "wavelength"):
        np.testing.assert_array_equal(changed.column(name), rays.column(name))


@fixed
@given(coordinates, coordinates.filter(lambda n: np.linalg.norm(n) > 1e-2))
def test_rays_are_carried_along_their_lines_onto_the_plane(point: tuple[float, ...], normal: tuple[float, ...]) -> None:
    rays = uneven(50)
    there = rays.propagated_to_plane(point, normal)
    n = np.array(normal) / np.linalg.norm(normal)
    kept = number(there)
    slope = np.abs(rays.direction[kept] @ n)
    assert len(kept) >= 49
    assert (np.abs((there.position - point) @ n) <= 1e-12 * (1 + np.linalg.norm(there.position, axis=1))).all()
    reach = np.linalg.norm(there.position - rays.position[kept], axis=1)
    assert (distance_to_line(there.position, rays.position[kept], rays.direction[kept]) <= 1e-14 * (1 + reach)).all()
    assert (reach <= (np.abs((rays.position[kept] - point) @ n) + 1e-9) / slope * (1 + 1e-9)).all()
    np.testing.assert_array_equal(there.flux, rays.flux[kept])


@pytest.mark.parametrize("far", [-1e6, 0.0, 1e6])
def test_start_points_far_away_still_meet_the_surface(far: float) -> None:
    """A vendor's ray may start anywhere on its line; a metre or a kilometre away, it is the same ray."""
    near = uneven(200)
    away = RaySet(near.position + far * near.direction, near.direction, near.flux)
    on_plane = away.propagated_to_plane((0, 0, 5), (0.1, 0, 1))
    np.testing.assert_allclose(on_plane.position, near.propagated_to_plane((0, 0, 5), (0.1, 0, 1)).position, atol=1e-8)
    centre, radius = np.array([3.0, -1.0, 0.0]), 30.0
    on_sphere = away.propagated_to_sphere(tuple(centre), radius)
    np.testing.assert_allclose(on_sphere.position, near.propagated_to_sphere(tuple(centre), radius).position, atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(on_sphere.position - centre, axis=1), radius, rtol=1e-10)


def test_rays_leave_the_sphere_where_the_closed_form_says() -> None:
    """Chords of a sphere of radius 5 about (1, 2, 3) at distance 3 from its centre: half a chord is 4."""
    x = np.array([[1, 5, 3], [100, 5, 3], [-7, 5, 3], [1, 2, 0], [1, 2, 3.0]])
    k = np.array([[1, 0, 0], [1, 0, 0], [-1, 0, 0], [0, -1, 0], [0, 0.6, 0.8]])
    out = RaySet(x, k, np.ones(5)).propagated_to_sphere((1, 2, 3), 5.0).position
    np.testing.assert_allclose(out, [[5, 5, 3], [5, 5, 3], [-3, 5, 3], [1, -2, 0], [1, 5, 7]], atol=1e-13)


@fixed
@given(coordinates, st.floats(0.1, 200))
def test_the_sphere_is_met_from_inside_by_just_the_lines_that_cross_it(
    centre: tuple[float, ...], radius: float
) -> None:
    rays = uneven(50)
    there = rays.propagated_to_sphere(centre, radius)
    c = np.array(centre)
    foot = distance_to_line(c, rays.position, rays.direction)
    clear = np.abs(foot - radius) > 1e-9
    met = np.isin(np.arange(50), number(there))
    np.testing.assert_array_equal(met[clear], (foot < radius)[clear])
    radial = there.position - c
    np.testing.assert_allclose(np.linalg.norm(radial, axis=1), radius, rtol=1e-11)
    assert (np.einsum("ij,ij->i", radial, there.direction) >= -1e-9 * radius).all()  # outwards
    kept = number(there)
    assert (distance_to_line(there.position, rays.position[kept], rays.direction[kept]) < 1e-11 * (radius + 200)).all()


def test_a_tangent_ray_touches_and_a_missing_one_is_counted_with_its_flux() -> None:
    rays = RaySet([[-9, 2, 0], [-9, 2.0001, 0], [-9, 1, 0]], [[1, 0, 0]] * 3, [1.0, 3.0, 4.0], provenance=FILE)
    there = rays.propagated_to_sphere((0, 0, 0), 2.0)
    np.testing.assert_allclose(there.position, [[0, 2, 0], [math.sqrt(3), 1, 0]], atol=1e-15)
    assert there.total_flux == 5.0
    (complaint,) = there.complaints
    assert complaint.severity == "error"
    assert "1 rays with 37.500% of the flux never meet it" in complaint.found
    assert "sphere" in complaint.place


def test_rays_parallel_to_the_plane_are_counted_with_their_flux() -> None:
    direction = [[1, 0, 0], [0, 1, 1e-13], [0, 0.6, 0.8], [0, 1, -1e-9]]
    rays = RaySet(np.ones((4, 3)), direction, [1.0, 2.0, 4.0, 3.0])
    there = rays.propagated_to_plane((0, 0, 0), (0, 0, 7))
    assert there.flux.tolist() == [4.0, 3.0]
    (complaint,) = there.complaints
    assert "2 rays with 30.000% of the flux never meet it" in complaint.found
    dark = RaySet(np.ones((1, 3)), [[1, 0, 0]], [0.0]).propagated_to_plane((0, 0, 0))
    assert "1 rays with 0.000% of the flux" in dark.complaints[0].found


@pytest.mark.parametrize(
    ("operation", "message"),
    [
        (lambda r: r.moved((0, 0)), "offset"),
        (lambda r: r.moved((0, 0, math.nan)), "offset"),
        (lambda r: r.rotated((0, 0, 0), 10), "axis has no length"),
        (lambda r: r.rotated((0, 0, math.inf), 10), "axis"),
        (lambda r: r.rotated((0, 0, 1), math.nan), "angle is nan"),
        (lambda r: r.scaled(0), "factor"),
        (lambda r: r.scaled(-1), "factor"),
        (lambda r: r.scaled(math.inf), "factor"),
        (lambda r: r.propagated_to_plane((0, 0, 0), (0, 0, 0)), "normal has no length"),
        (lambda r: r.propagated_to_plane((0, 0, math.nan)), "point"),
        (lambda r: r.propagated_to_sphere((0, 0, 0), 0), "radius is 0"),
        (lambda r: r.propagated_to_sphere((0, 0, 0), math.nan), "radius is nan"),
        (lambda r: r.propagated_to_sphere((0, 0), 1), "centre"),
    ],
)
def test_moves_outside_their_domain_are_refused(operation: Callable[[RaySet], RaySet], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        operation(uneven(3))


# --- what every operation keeps --------------------------------------------------------------------------------------

OPERATIONS: dict[str, Callable[[RaySet], RaySet]] = {
    "subset": lambda r: r.subset(len(r), seed=1),
    "moved": lambda r: r.moved((1, 2, 3)),
    "rotated": lambda r: r.rotated((0, 0, 1), 90),
    "to plane": lambda r: r.propagated_to_plane((0, 0, -20)),
    "to sphere": lambda r: r.propagated_to_sphere((3, -1, 0), 50),
    "in watts": lambda r: r.in_unit("W"),
    "merged": lambda r: RaySet.merge([r]),
}


def with_defects() -> RaySet:
    """A file's rays on a relative scale, against its header, with three rays that cannot be used."""
    rays = uneven(600, meaning=RaySetMeaning(declared_flux=337.0, header={"total_flux": 337.0}, provenance=FILE))
    rays.records["position"][100, 0] = math.nan
    rays.records["direction"][200] = 0
    rays.records["flux"][300] = rays.records["radiant_flux"][300] = -1
    with pytest.warns(RayFileWarning):
        assert rays.tally.unusable == 3
    return rays


@pytest.mark.filterwarnings("ignore::etendue.quantities.report.RayFileWarning")
@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS)
def test_rays_that_cannot_be_used_stay_out_and_stay_complained_about(operation: Callable[[RaySet], RaySet]) -> None:
    rays = with_defects()
    changed = operation(rays)
    text = "\n".join(map(str, changed.complaints))
    for reason in ("1 of 600 rays have a coord", "1 of 600 rays have no direction", "1 of 600 rays have negative flux"):
        assert text.count(reason) == 1
    assert text.count("the header says 337 lm, the rays sum to") == 1
    whole = np.setdiff1d(np.arange(600), [100, 200, 300])
    used = np.concatenate([number(changed)[b.start : b.start + len(b.usable)][b.usable] for b in changed.batches()])
    np.testing.assert_array_equal(used, whole)


@pytest.mark.filterwarnings("ignore::etendue.quantities.report.RayFileWarning")
@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS)
def test_long_sets_are_streamed_through_files_with_the_same_result(
    operation: Callable[[RaySet], RaySet], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    rays = with_defects()
    expected = operation(rays)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    for module in (ray_operations, ray_rewriting):
        monkeypatch.setattr(module, "CHUNK", 47)
    for module in (ray_operations, ray_rewriting, ray_merge):
        monkeypatch.setattr(module, "spool", functools.partial(spool, memory_limit=5000))
    streamed = operation(rays)
    assert isinstance(streamed.records, np.memmap)
    assert not isinstance(expected.records, np.memmap)
    assert streamed.records.tobytes() == expected.records.tobytes()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS)
def test_watts_per_lumen_of_a_ray_survive(operation: Callable[[RaySet], RaySet]) -> None:
    rays = uneven(300, meaning=RaySetMeaning(declared_flux=1000.0))
    changed = operation(rays)
    assert changed.column("radiant_flux").sum() == pytest.approx(1000.0 / 300, rel=1e-6)
    assert changed.in_unit("W").total_flux == pytest.approx(1000.0 / 300, rel=1e-6)


@pytest.mark.slow
def test_columns_of_more_rays_than_a_stretch_stay_with_their_rays() -> None:
    n = 2 * ray_rewriting.CHUNK + 1000
    table = np.zeros(n, [("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4"), ("wavelength", "<f8")])
    table["wavelength"] = np.arange(n)
    table["position"][:, 1] = np.arange(n)
    table["direction"] = (0, 0, 1)
    table["flux"] = 1
    table["flux"][[5, ray_rewriting.CHUNK + 7]] = math.nan
    rays = RaySet.from_records(table, RaySetMeaning())
    with pytest.warns(RayFileWarning, match="2 of"):
        assert rays.tally.not_finite == 2
    for changed in (rays.moved((1, 0, 0)), RaySet.merge([rays, rays])):
        np.testing.assert_array_equal(changed.position[:, 1], changed.wavelength)
        assert len(changed) in (n - 2, 2 * (n - 2))


# --- a random subset -------------------------------------------------------------------------------------------------


def test_every_ray_has_the_same_chance_of_being_in_a_subset() -> None:
    """Counts of n rays in S subsets of k: Σ (c - Sp)²/(S p (1-p)) · (n-1)/n is χ² with n - 1 degrees of freedom."""
    rays, n, k, seeds = uneven(37), 37, 11, 4000
    inside = np.zeros((seeds, n), bool)
    for seed in range(seeds):
        inside[seed, number(rays.subset(k, seed))] = True
    assert (inside.sum(axis=1) == k).all()
    p = k / n
    chi2 = ((inside.sum(axis=0) - seeds * p) ** 2).sum() / (seeds * p * (1 - p)) * (n - 1) / n
    assert SIGNIFICANCE < stats.chi2.sf(chi2, n - 1) < 1 - SIGNIFICANCE
    # The overlap of two subsets drawn with neighbouring seeds is hypergeometric if they are independent.
    overlap = (inside[1:] & inside[:-1]).sum(axis=1)
    law = stats.hypergeom(n, k, k)
    z = (overlap.mean() - law.mean()) / (law.std() / math.sqrt(len(overlap)))
    assert abs(z) < stats.norm.isf(SIGNIFICANCE / 2)


@fixed
@given(st.integers(1, 200), st.integers(0, 2**64 - 1), st.sampled_from([1, 7, 64, 1000]))
def test_a_subset_keeps_order_total_and_columns_and_not_the_stretches(n: int, seed: int, chunk: int) -> None:
    rays = uneven(200, meaning=RaySetMeaning(stored_flux_scale=0.25))
    part = rays.subset(n, seed)
    chosen = number(part)
    assert len(chosen) == n
    assert (np.diff(chosen) > 0).all()
    assert part.total_flux == rays.total_flux  # exactly
    np.testing.assert_array_equal(part.position, rays.position[chosen])
    np.testing.assert_array_equal(part.wavelength, rays.column("wavelength")[chosen])
    np.testing.assert_allclose(part.flux / part.flux[0], rays.flux[chosen] / rays.flux[chosen][0], rtol=1e-12)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ray_operations, "CHUNK", chunk)
        np.testing.assert_array_equal(number(rays.subset(n, seed)), chosen)


def test_a_subset_of_all_is_the_set() -> None:
    rays = uneven(50)
    np.testing.assert_array_equal(rays.subset(50, seed=9).records, rays.records)


@pytest.mark.parametrize(
    ("n", "seed", "message"),
    [
        (0, 1, "is 0; give .* 1 to 50"),
        (51, 1, "is 51; give"),
        (-1, 1, "is -1; give"),
        (5, -1, "seed -1"),
        (5, 2**64, "seed"),
    ],
)
def test_a_subset_that_does_not_exist_is_refused(n: int, seed: int, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        uneven(50).subset(n, seed)


# --- thinning --------------------------------------------------------------------------------------------------------


@fixed
@given(st.integers(2, 9), st.integers(0, 2**64 - 1))
def test_parts_are_disjoint_and_make_up_the_whole(parts: int, seed: int) -> None:
    rays = uneven(300, meaning=RaySetMeaning(declared_flux=60.0))
    dealt = rays.thin(parts, seed)
    assert len(dealt) == parts
    assert sorted(itertools.chain.from_iterable(number(part) for part in dealt)) == list(range(300))
    for part in dealt:
        assert (np.diff(number(part)) > 0).all()
        np.testing.assert_allclose(part.flux, parts * rays.flux[number(part)], rtol=1e-14)
    # Each part stands for the whole: their mean is the whole, and none is forced to its total.
    assert math.fsum(part.total_flux for part in dealt) / parts == pytest.approx(60.0, rel=1e-13)
    assert len({part.total_flux for part in dealt}) == parts


def test_rays_fall_to_parts_as_a_fair_die_does() -> None:
    rays = RaySet(np.zeros((200_000, 3)), np.ones((200_000, 3)), np.arange(200_000.0))
    dealt = rays.thin(5, seed=8)
    assert stats.chisquare([len(part) for part in dealt]).pvalue > SIGNIFICANCE
    # The same ray under many seeds, and neighbouring rays under one: no memory.
    part_of = np.zeros(200_000, int)
    for index, part in enumerate(dealt):
        part_of[(part.flux / 5).round().astype(int)] = index
    pairs = np.bincount(5 * part_of[1:] + part_of[:-1], minlength=25)
    assert stats.chi2_contingency(pairs.reshape(5, 5)).pvalue > SIGNIFICANCE
    few = RaySet(np.zeros((4, 3)), np.ones((4, 3)), np.arange(4.0))
    counts = np.array([[len(part) for part in few.thin(2, seed)] for seed in range(4000)])
    expected = stats.binom(4, 0.5).pmf(range(5)) * 4000
    assert stats.chisquare(np.bincount(counts[:, 0], minlength=5), expected).pvalue > SIGNIFICANCE


@pytest.mark.parametrize(("parts", "seed"), [(1, 0), (0, 0), (-3, 0), (2**32, 0), (2, -1), (2, 2**64)])
def test_parts_that_cannot_be_dealt_are_refused(parts: int, seed: int) -> None:
    with pytest.raises(ArgumentError, match=r"thin|seed"):
        uneven(5).thin(parts, seed)


# --- virtual focus ---------------------------------------------------------------------------------------------------


def test_the_virtual_focus_is_the_least_squares_point_of_all_lines() -> None:
    rays = uneven(3000)
    k, w = rays.direction, rays.flux
    across = np.eye(3) - k[:, :, None] * k[:, None, :]
    rows = np.sqrt(w)[:, None, None] * across
    point, *_ = linalg.lstsq(rows.reshape(-1, 3), np.einsum("ijk,ik->ij", rows, rays.position).ravel())
    assert rays.virtual_focus.determined
    np.testing.assert_allclose(rays.virtual_focus.point, point, rtol=1e-10)
    far = RaySet(rays.position + 1e5 * k, k, w)
    np.testing.assert_allclose(far.virtual_focus.point, point, atol=1e-6)


@fixed
@given(coordinates, st.floats(2e-3, 1.0))
def test_rays_from_one_point_have_their_focus_there(focus: tuple[float, ...], spread: float) -> None:
    rng = np.random.default_rng(5)
    direction = np.column_stack([rng.normal(0.1, spread, (200, 2)), np.ones(200)])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    rays = RaySet(focus + rng.uniform(1, 50, (200, 1)) * direction, direction, rng.gamma(1.0, 1.0, 200))
    assert rays.virtual_focus.determined
    np.testing.assert_allclose(rays.virtual_focus.point, focus, atol=1e-12 * 100 / spread**2)


@pytest.mark.parametrize(
    ("spread", "determined"), [(0.0, False), (1e-7, False), (1e-4, False), (5e-3, True), (0.1, True)]
)
def test_collimated_rays_have_no_focus_but_a_centroid(spread: float, determined: bool) -> None:
    """Below some 0.06° of spread the place of the focus along the beam is made of rounding in f4 files."""
    rng = np.random.default_rng(6)
    position = rng.normal([1, 2, 3], 1.0, (400, 3))
    direction = np.array([0.6, 0, 0.8]) + rng.normal(0, spread, (400, 3))
    flux = rng.gamma(1.0, 1.0, 400)
    focus = RaySet(position, direction, flux).virtual_focus
    assert focus.determined == determined
    if not determined:
        np.testing.assert_allclose(focus.point, flux @ position / flux.sum(), rtol=1e-12)


def test_no_light_has_no_focus() -> None:
    assert not RaySet(np.ones((3, 3)), np.eye(3), np.zeros(3)).virtual_focus.determined


# --- total flux ------------------------------------------------------------------------------------------------------


def test_a_total_set_by_the_user_is_shared_in_proportion_and_ends_the_argument_with_the_header() -> None:
    meaning = RaySetMeaning(declared_flux=50.0, header={"total_flux": 50.0, "date": "2020"}, provenance=FILE)
    rays = uneven(100, meaning=meaning)
    changed = rays.with_total_flux(337.0)
    assert changed.total_flux == 337.0
    np.testing.assert_allclose(changed.flux, rays.records["flux"] * 337 / rays.records["flux"].sum(), rtol=1e-13)
    assert changed.complaints == ()
    assert changed.header == {"overruled_total_flux": 50.0, "date": "2020"}
    assert changed.provenance.steps == ("total flux set to 337 lm",)


def test_a_total_in_another_unit_makes_the_other_fluxes_of_the_rays_void() -> None:
    changed = uneven(100).with_total_flux(2.0, "W")
    assert (changed.flux_unit, changed.total_flux) == ("W", 2.0)
    assert changed.columns == ("wavelength", "stokes", "polarisation_axis", "additional")
    np.testing.assert_array_equal(number(changed.subset(100, seed=1)), np.arange(100))


@pytest.mark.parametrize("flux", [0.0, -1.0, math.nan, math.inf])
def test_a_total_must_be_a_flux(flux: float) -> None:
    with pytest.raises(ArgumentError, match="finite flux > 0"):
        uneven(3).with_total_flux(flux)
    with pytest.raises(UnknownNameError, match="flux unit"):
        uneven(3).with_total_flux(1.0, "mW")  # type: ignore[arg-type]


# --- lumens and watts ------------------------------------------------------------------------------------------------


def radiometric(n: int = 300, **meaning: Any) -> RaySet:
    kept = [name for name in RECORD.names or () if name != "radiant_flux"]
    return RaySet.from_records(
        uneven(n).records[kept], RaySetMeaning(provenance=FILE, **({"flux_unit": "W"} | meaning))
    )


def without_wavelength(rays: RaySet, **meaning: Any) -> RaySet:
    kept = [name for name in rays.records.dtype.names or () if name != "wavelength"]
    return RaySet.from_records(rays.records[kept], rays.replace(**meaning).meaning)


def test_watts_become_lumens_ray_by_ray_through_v_of_lambda() -> None:
    watts = radiometric(declared_flux=4.0)
    lumens = watts.in_unit("lm")
    assert watts.wavelength is not None
    np.testing.assert_allclose(lumens.flux, watts.flux * 683 * photopic_efficiency(watts.wavelength), rtol=1e-14)
    assert (lumens.flux_unit, lumens.total_flux) == ("lm", pytest.approx(math.fsum(lumens.flux), rel=1e-13))
    back = lumens.in_unit("W")
    np.testing.assert_allclose(back.flux, watts.flux, rtol=1e-13)
    assert lumens.in_unit("lm") is lumens
    assert lumens.provenance.steps == ("W to lm through the wavelength of each ray",)


def test_one_spectrum_or_wavelength_converts_all_rays_alike() -> None:
    watts = without_wavelength(radiometric())
    assert watts.replace(single_wavelength=650.0).in_unit("lm").total_flux == pytest.approx(
        watts.total_flux * 683 * 0.107, rel=1e-12
    )
    spectrum = Spectrum([430.0, 470.0, 640.0], [0.0, 5.0, 1.0])
    product = lambda x: np.interp(x, spectrum.wavelength, spectrum.weight) * photopic_efficiency([x])[0]  # noqa: E731
    visible = math.fsum(integrate.quad(product, nm, nm + 1)[0] for nm in range(430, 640))
    k = 683 * visible / (0.5 * 40 * 5 + 0.5 * 170 * 6)
    assert watts.with_spectrum(spectrum).in_unit("lm").total_flux == pytest.approx(watts.total_flux * k, rel=1e-7)


def test_each_ray_finds_its_spectrum_by_its_index() -> None:
    table = np.zeros(4, [("direction", "<f4", 3), ("flux", "<f4"), ("spectrum_index", "<i4")])
    table["direction"], table["flux"], table["spectrum_index"] = (0, 0, 1), (1, 2, 4, 8), (2, 1, 2, 3)
    lines = tuple(Spectrum([w], [1.0]) for w in (555.0, 650.0, 510.0))
    rays = RaySet.from_records(table, RaySetMeaning(flux_unit="W", spectra=lines))
    np.testing.assert_allclose(rays.in_unit("lm").flux, 683 * np.array([0.107, 2, 0.428, 8 * 0.503]), rtol=1e-12)
    table["spectrum_index"][1] = 4
    with pytest.raises(UnitError, match=r"outside 1\.\.3"):
        RaySet.from_records(table, RaySetMeaning(flux_unit="W", spectra=lines)).in_unit("lm")


def test_a_spectrum_of_the_user_s_replaces_what_was_known() -> None:
    green = Spectrum([555.0], [1.0])
    for rays in (radiometric(), without_wavelength(radiometric(), single_wavelength=650.0)):
        told = rays.with_spectrum(green)
        assert told.in_unit("lm").total_flux == pytest.approx(683 * rays.total_flux, rel=1e-12)
        assert told.wavelength is None
        assert told.columns == ("stokes", "polarisation_axis", "additional")


def test_a_column_of_watts_is_better_than_a_spectrum() -> None:
    rays = uneven(100, meaning=RaySetMeaning(declared_flux=600.0))
    watts = rays.in_unit("W")
    np.testing.assert_allclose(watts.flux, rays.flux / 300, rtol=1e-6)
    assert watts.total_flux == pytest.approx(2.0, rel=1e-6)


@pytest.mark.parametrize("wavelength", [math.nan, 0.0, -450.0])
def test_the_ray_whose_wavelength_is_missing_is_named(wavelength: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the second stretch of the rays."""
    monkeypatch.setattr(ray_rewriting, "CHUNK", 1000)
    watts = radiometric(ray_rewriting.CHUNK + 10)
    watts.records["wavelength"][ray_rewriting.CHUNK + 3] = wavelength
    with pytest.raises(UnitError, match=rf"led\.ray: ray 1,004 has the wavelength {wavelength:g} nm.*--flux 54.6lm"):
        watts.in_unit("lm")


@pytest.mark.filterwarnings("ignore::etendue.quantities.report.RayFileWarning")
@pytest.mark.parametrize("unit", ["W", "lm"])
def test_rays_that_cannot_be_used_need_neither_wavelength_nor_spectrum(unit: str) -> None:
    """All bits of a damaged record may be set: as binary32 that is NaN, even a signalling one."""
    table = np.zeros(6, [("direction", "<f4", 3), ("flux", "<f4"), ("wavelength", "<f4"), ("radiant_flux", "<f4")])
    table["direction"], table["flux"], table["wavelength"], table["radiant_flux"] = (0, 0, 1), 2, 555, 2 / 683
    table[["direction", "wavelength"]][4] = ((0, 0, 0), -1)
    table["flux"][1] = math.inf
    table["wavelength"][1] = 100  # V is 0, and infinity times 0 is no number
    table.view("<u4").reshape(6, -1)[2] = 0x7FA0_0000
    rays = RaySet.from_records(table[["direction", "flux", "wavelength"]], RaySetMeaning(flux_unit=unit))
    other = rays.in_unit("lm" if unit == "W" else "W")
    expected = 2 * 683 if unit == "W" else 2 / 683
    assert [b.flux.tolist() for b in other.batches(3)] == [[pytest.approx(expected)], [pytest.approx(expected)] * 2]
    assert (other.tally.not_finite, other.tally.no_direction) == (2, 1)
    if unit == "lm":
        radiant = RaySet.from_records(table, RaySetMeaning()).in_unit("W")
        assert radiant.total_flux == pytest.approx(3 * expected)
        assert radiant.tally.unusable == 3


@pytest.mark.parametrize(
    ("rays", "unit", "message"),
    [
        (
            lambda: without_wavelength(radiometric()),
            "lm",
            r"led.ray: W cannot become lumens.*--flux 54.6lm",
        ),
        (lambda: without_wavelength(radiometric(), flux_unit="lm"), "W", r"lm cannot become watts.*--flux 0.7W"),
        (lambda: radiometric(flux_unit="lm", wavelength_scale=10.0), "W", r"V\(λ\) is 0"),
        (lambda: without_wavelength(radiometric(), spectra=(Spectrum([500.0], [1.0]),) * 2), "lm", "no spectrum"),
    ],
)
def test_what_the_rays_do_not_know_is_not_guessed(rays: Callable[[], RaySet], unit: Any, message: str) -> None:
    with pytest.raises(UnitError, match=message):
        rays().in_unit(unit)


def test_a_spectrum_that_is_none_is_refused() -> None:
    with pytest.raises(ArgumentError, match=r"with_spectrum: spectrum is a list; give a Spectrum"):
        radiometric(3).with_spectrum([[450, 1]])  # type: ignore[arg-type]


def test_an_unknown_unit_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="'lumen'"):
        radiometric(3).in_unit("lumen")  # type: ignore[arg-type]


# --- merging ---------------------------------------------------------------------------------------------------------


def test_a_merged_set_is_one_after_the_other_with_the_stated_ratio() -> None:
    blue, yellow = uneven(30, seed=1), uneven(50, seed=2, meaning=RaySetMeaning(declared_flux=5.0, length_scale=10.0))
    both = RaySet.merge([blue, yellow], flux=[23.0, 314.0])
    np.testing.assert_allclose(both.position, np.concatenate([blue.position, yellow.position]), rtol=1e-15)
    np.testing.assert_allclose(both.direction, np.concatenate([blue.direction, yellow.direction]), rtol=1e-14)
    assert math.fsum(both.flux[:30]) == pytest.approx(23.0, rel=1e-13)
    assert math.fsum(both.flux[30:]) == pytest.approx(314.0, rel=1e-13)
    np.testing.assert_allclose(both.flux[30:] / both.flux[30], yellow.flux / yellow.flux[0], rtol=1e-13)
    np.testing.assert_allclose(both.column("stokes"), np.concatenate([blue.column("stokes"), yellow.column("stokes")]))
    own = RaySet.merge([blue, yellow])
    assert own.total_flux == pytest.approx(blue.total_flux + 5.0, rel=1e-13)


def spectral(*, n: int, spectra: tuple[Spectrum, ...] = (), index: Any = None, **meaning: Any) -> RaySet:
    fields: list[Any] = [("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4")]
    table = np.zeros(n, fields + ([("spectrum_index", "<i4")] if index is not None else []))
    table["direction"], table["flux"] = (0, 0, 1), 1
    if index is not None:
        table["spectrum_index"] = index
    return RaySet.from_records(table, RaySetMeaning(flux_unit="W", spectra=spectra, **meaning))


A, B, C = (Spectrum([w], [1.0]) for w in (555.0, 650.0, 510.0))


def test_each_merged_ray_still_finds_its_spectrum() -> None:
    both = RaySet.merge(
        [spectral(n=2, spectra=(A,)), spectral(n=3, spectra=(B, C), index=(2, 1, 2)), spectral(n=1, spectra=(B,))]
    )
    assert both.column("spectrum_index").tolist() == [1, 1, 3, 2, 3, 4]
    assert both.spectra == (A, B, C, B)
    np.testing.assert_allclose(both.in_unit("lm").flux, 683 * np.array([1, 1, 0.503, 0.107, 0.503, 0.107]), rtol=1e-12)


def test_a_wrong_index_does_not_point_into_the_spectra_of_another_set() -> None:
    both = RaySet.merge([spectral(n=2, spectra=(A,), index=(1, 2)), spectral(n=1, spectra=(B,))])
    assert both.column("spectrum_index").tolist() == [1, 0, 2]
    with pytest.raises(UnitError, match=r"outside 1\.\.2"):
        both.in_unit("lm")


@pytest.mark.parametrize("ignorant", [spectral(n=1), spectral(n=1, spectra=(A, B))])
def test_spectra_that_one_set_does_not_know_are_not_invented(ignorant: RaySet) -> None:
    both = RaySet.merge([spectral(n=2, spectra=(A,)), ignorant])
    assert both.spectra == ()
    assert [c.found.rsplit(": ")[-1] for c in both.complaints] == ["spectrum"] * (1 + bool(ignorant.spectra))
    with pytest.raises(UnitError, match="no spectrum"):
        both.in_unit("lm")


def test_wavelengths_that_every_set_knows_are_kept() -> None:
    red, green, blue = (spectral(n=1, single_wavelength=w) for w in (620.0, 530.0, 460.0))
    rgb = RaySet.merge([red, green, blue])
    assert rgb.wavelength is not None
    assert rgb.wavelength.tolist() == [620, 530, 460]
    assert RaySet.merge([red, red]).meaning.single_wavelength == 620.0
    assert RaySet.merge([red, red]).columns == ()
    dull = RaySet.merge([red, spectral(n=1)])
    assert dull.wavelength is None
    assert [c.found.rsplit(": ")[-1] for c in dull.complaints] == ["wavelength"]
    assert rgb.complaints == RaySet.merge([red, red]).complaints == ()
    mixed = RaySet.merge([radiometric(2, wavelength_scale=0.5), red])
    assert mixed.wavelength is not None
    assert mixed.wavelength.tolist() == pytest.approx([*(0.5 * uneven(2).column("wavelength")), 620.0])
    # What a ray says of itself goes before what the header says of all.
    odd = radiometric(2, single_wavelength=620.0)
    assert RaySet.merge([odd, red]).wavelength == pytest.approx([*uneven(2).column("wavelength"), 620.0])


def test_wavelengths_beside_spectra_become_spectra_of_a_line() -> None:
    """K_m V(λ) of each line, and K of the spectrum: a white set of a blue laser, and of a phosphor with a spectrum."""
    laser = spectral(n=2, single_wavelength=450.0)
    wide = Spectrum([500.0, 560.0, 650.0], [0.0, 1.0, 0.0])
    both = RaySet.merge([spectral(n=1, spectra=(wide,)), laser, radiometric(3, wavelength_scale=0.9)])
    own = 0.9 * uneven(3).column("wavelength")
    efficacy = [wide.luminous_efficacy, *(LUMINOUS_EFFICACY_MAX * photopic_efficiency([450.0, 450.0, *own]))]
    np.testing.assert_allclose(both.in_unit("lm").flux, both.flux * efficacy, rtol=1e-12)
    assert [c.found.rsplit(": ")[-1] for c in both.complaints] == ["stokes, polarisation_axis, additional"]
    # What a ray says of itself goes before what the header says of all, and an unknown wavelength is no spectrum.
    odd = radiometric(2, spectra=(wide,))
    odd.records["wavelength"][0] = -1.0
    assert RaySet.merge([spectral(n=1, spectra=(wide,)), odd]).column("spectrum_index").tolist() == [1, 0, 2]


def test_too_many_wavelengths_beside_spectra_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("etendue.quantities.ray_merge.MOST_LINES", 3)
    few, many = (RaySet.merge([spectral(n=1, spectra=(A,)), radiometric(n)]) for n in (3, 4))
    assert (len(few.spectra), len(many.spectra)) == (4, 0)
    assert [c.found.rsplit(": ")[-1].split(",")[0] for c in many.complaints] == ["spectrum", "wavelength"]


def test_columns_that_not_all_sets_have_alike_are_left_out() -> None:
    other = uneven(3).records[["position", "direction", "flux", "stokes"]]
    wide = np.zeros(2, [("position", "<f8", 3), ("direction", "<f8", 3), ("flux", "<f8"), ("additional", "<f4", 5)])
    wide["direction"] = (0, 0, 1)
    assert RaySet.merge([uneven(3), RaySet.from_records(other, RaySetMeaning())]).columns == ("stokes",)
    both = RaySet.merge([uneven(3, meaning=RaySetMeaning(provenance=FILE)), RaySet.from_records(wide, RaySetMeaning())])
    assert both.columns == ()
    reason = "left out, because not every merged set has it alike"
    assert [str(c) for c in both.complaints] == [
        f"note: led.ray, columns: {reason}: wavelength, radiant_flux, stokes, polarisation_axis, additional",
        f"note: memory, columns: {reason}: additional",
    ]


def test_a_merged_set_knows_where_it_comes_from() -> None:
    first = uneven(3, meaning=RaySetMeaning(provenance=FILE)).moved((0, 0, 1))
    second = uneven(3, meaning=RaySetMeaning(provenance=Provenance("b.ray", "zemax", "0b")))
    origin = RaySet.merge([first, second]).provenance
    assert (origin.source, origin.format, origin.fingerprint) == ("led.ray + b.ray", "lighttools + zemax", "f0 + 0b")
    assert origin.steps == ("led.ray: moved by [0.0, 0.0, 1.0] mm", "merged")


def test_complaints_of_a_merged_set_name_the_file() -> None:
    bad = uneven(3, meaning=RaySetMeaning(provenance=FILE))
    bad.records["flux"][0] = math.nan
    with pytest.warns(RayFileWarning):
        both = RaySet.merge([uneven(2), bad])
    assert [str(c) for c in both.complaints] == [
        "error: led.ray, rays: 1 of 3 rays have a coordinate, direction or flux that is not finite; they are left out"
    ]
    assert len(both) == 4


@pytest.mark.parametrize(
    ("sets", "flux", "message"),
    [
        (list, None, "no ray sets"),
        (lambda: [uneven(2), radiometric(2)], None, "the sets differ in unit"),
        (lambda: [uneven(2), uneven(2)], [1.0], "1 fluxes for 2 sets"),
        (lambda: [uneven(2)], [0.0], "finite flux > 0"),
        (
            lambda: [RaySet.from_records(uneven(2).records[["direction", "flux"]], RaySetMeaning())],
            None,
            "far-field set has no positions",
        ),
    ],
)
def test_sets_that_do_not_go_together_are_refused(sets: Callable[[], list[RaySet]], flux: Any, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        RaySet.merge(sets(), flux)


def test_far_field_rays_cannot_be_moved() -> None:
    far = RaySet.from_records(uneven(2).records[["direction", "flux"]], RaySetMeaning(provenance=FILE))
    with pytest.raises(ArgumentError, match=r"led\.ray: far-field rays have no position"):
        far.moved((0, 0, 1))
    assert far.subset(1, seed=1).total_flux == far.total_flux


def test_a_total_in_another_unit_goes_through_the_spectrum_if_it_is_known() -> None:
    """Lumens stated for a set in watts are shared by what each wavelength is worth, not by the watts."""
    rays = RaySet([[0, 0, 0]] * 2, [[0, 0, 1]] * 2, [1.0, 1.0], flux_unit="W", wavelength=[555.0, 610.0])
    stated = rays.with_total_flux(100.0, "lm")
    assert stated.total_flux == 100.0
    v_610 = 0.503  # CIE 018:2019, V(610 nm)
    np.testing.assert_allclose(stated.flux, [100 / (1 + v_610), 100 * v_610 / (1 + v_610)], rtol=1e-9)
    invisible = RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0], wavelength=[300.0])
    assert invisible.with_total_flux(5.0, "W").total_flux == 5.0


def test_rays_without_a_wavelength_have_no_lumens() -> None:
    rays = RaySet([[0, 0, 0]] * 3, [[0, 0, 1]] * 3, [1.0] * 3, flux_unit="W", wavelength=[555.0, 0.0, 610.0])
    with pytest.raises(UnitError, match="ray 2 has the wavelength 0 nm"):
        rays.in_unit("lm")


def test_sets_that_hold_the_same_rays_say_so_when_they_are_merged() -> None:
    """Of 400 rays, 300 are among those of the first set, in another order; a third set has rays of its own."""
    one, other = (
        RaySet(*np.split(np.random.default_rng(s).normal(size=(500, 6)), 2, axis=1), np.ones(500)) for s in (1, 2)
    )
    order = np.random.default_rng(3).permutation(500)[:300]
    mixed = [
        np.concatenate([getattr(one, name)[order], getattr(other, name)[:100]]) for name in ("position", "direction")
    ]
    both = RaySet.merge([one, RaySet(*mixed, np.ones(400))])
    told = [complaint.found for complaint in both.complaints if "shares" in complaint.found]
    assert len(told) == 1
    assert "shares 75.00% of its rays with" in told[0]
    assert not any("shares" in complaint.found for complaint in RaySet.merge([one, other]).complaints)
