"""Rays become intensity: every cell where it belongs, every lumen once, every error as large as it says."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import cache

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.goniophotometry.far_field import intensity_distribution
from etendue.quantities.intensity_nodes import Nodes
from etendue.quantities.ray_records import RaySetMeaning
from oracles.intensity import hat_means
from oracles.verdicts import LARGEST_Z, assert_agree, assert_differ, assert_drawn_with
from scipy.integrate import simpson

Array = npt.NDArray[np.float64]


def direction(c: npt.ArrayLike, gamma: npt.ArrayLike) -> Array:
    a, b = np.radians(c), np.radians(gamma)
    a, b = np.broadcast_arrays(a, b)
    return np.stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)], axis=-1)


def rays_of(directions: Array, flux: Array, unit: str = "lm") -> et.RaySet:
    flat = directions.reshape(-1, 3)
    position = np.random.default_rng(9).normal(size=flat.shape)  # where rays start is of no consequence
    return et.RaySet(position, flat, np.ravel(flux), flux_unit=unit)  # type: ignore[arg-type]


def nodes_of(planes: int, step: float) -> tuple[Array, Array]:
    return np.arange(planes) * (360.0 / planes), np.linspace(0.0, 180.0, round(180.0 / step) + 1)


@cache
def hat_weights(planes: int, step: float) -> Array:
    """∫φ dΩ of every node, by quadrature; all planes of a pole are one node."""
    c, gamma = nodes_of(planes, step)
    return hat_means(lambda a, b: np.ones(np.broadcast_shapes(a.shape, b.shape)), c=c, gamma=gamma)[1]


@cache
def hat_squares(planes: int, step: float) -> Array:
    """∫φ² dΩ over ∫φ dΩ of every node: by Simpson's rule."""
    _, gamma = nodes_of(planes, step)
    # ∫φ² of a hat in C is 2/3 of ∫φ; of one plane, φ is 1.
    x = np.linspace(0.0, np.pi, 8 * (gamma.size - 1) + 1)
    hats = np.stack([np.interp(np.degrees(x), gamma, row) for row in np.eye(gamma.size)])
    along = simpson(hats**2 * np.sin(x), x=x) / simpson(hats * np.sin(x), x=x)
    around = np.full((planes, gamma.size), 1.0 if planes == 1 else 2.0 / 3.0)
    around[:, [0, -1]] = 1.0
    return around * along


def shares_of(planes: int, step: float, c: float, gamma: float) -> Array:
    """The shares of the nodes in a ray, as a reader interpolates between them: one row, then one column at a time."""
    along = np.stack([np.interp(gamma, nodes_of(planes, step)[1], row) for row in np.eye(round(180.0 / step) + 1)])
    grid = np.append(nodes_of(planes, step)[0], 360.0)
    around = np.stack([np.interp(c % 360.0, grid, np.append(row, row[0])) for row in np.eye(planes)])
    found = np.outer(around, along)
    found[:, [0, -1]] = found[:, [0, -1]].sum(axis=0)
    return found


# --- every ray to the nodes around it ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("planes", "step"), [(36, 2.5), (5, 45), (1, 10), (7, 7.5), (4, 90)])
@pytest.mark.parametrize(("c", "gamma"), [(0.0, 0.0), (41.3, 57.1), (359.9, 178.9), (180.0, 90.0), (301.0, 1.3)])
def test_a_ray_is_shared_by_the_nodes_around_it(planes: int, step: float, c: float, gamma: float) -> None:
    led = intensity_distribution(rays_of(direction([c], [gamma]), np.array([3.0])), planes, step)
    expected = 3.0 * shares_of(planes, step, c, gamma) / hat_weights(planes, step)
    # The midpoint rule of 24 parts is off by 1/(2 · 24²) at a pole.
    assert np.allclose(led.values, expected, rtol=1e-3, atol=1e-9 * expected.max())
    assert led.flux == pytest.approx(3.0, rel=1e-12)
    # One ray of flux w is w ± w at a node with φ = 1 all over; a hat's mean of φ² is r times that of φ. Of w is known what
    # the shares of all nodes say, Σ φ²/r over Σ φ, and each node may have one such ray more.
    squares = hat_squares(planes, step)
    flux = expected * hat_weights(planes, step)
    flux[1:, [0, -1]] = 0.0
    one = squares * (flux**2 / squares).sum() / 3.0 / hat_weights(planes, step)
    error = np.hypot(np.maximum(expected, np.sqrt(one * expected)), one)
    lit = expected > 1e-6 * expected.max()
    assert np.allclose(led.standard_error[lit], error[lit], rtol=3e-3)


def test_no_turn_and_no_mirror_image() -> None:
    """One ray in each octant, all different, each at a node."""
    c, gamma = np.meshgrid([40.0, 130.0, 220.0, 310.0], [50.0, 130.0], indexing="ij")
    led = intensity_distribution(rays_of(direction(c, gamma), np.arange(1.0, 9.0)), 36, 10)
    lit = np.argwhere(led.values > 1e-9 * led.maximum)
    assert [(led.c[i], led.gamma[j]) for i, j in lit] == list(zip(c.ravel(), gamma.ravel(), strict=True))
    found = led.in_direction(direction(c, gamma)).ravel()
    assert np.allclose(found * led.node_solid_angle[lit[:, 0], lit[:, 1]], np.arange(1.0, 9.0))


@pytest.mark.slow
def test_the_solid_angles_are_exact_and_make_the_sphere() -> None:
    for planes, step in ((36, 2.5), (1, 90), (20, 0.25)):
        nodes = Nodes.even(planes, step)
        poles, belt = nodes.solid_angle[[0, -1]], nodes.solid_angle[1:-1].reshape(-1, planes)
        weights = hat_weights(planes, step)
        assert np.allclose(poles, weights[0, [0, -1]], rtol=1e-3)
        assert np.allclose(belt.T, weights[:, 1:-1], rtol=1e-3)
        assert nodes.solid_angle.sum() == pytest.approx(4 * np.pi, rel=1e-13)


# --- closed forms ----------------------------------------------------------------------------------------------------


def leaning_lobe(n: int, exponent: float, axis: Array, seed: int) -> Array:
    """Directions of I ∝ cos^n about an axis off every symmetry plane, by inversion."""
    rng = np.random.default_rng(seed)
    cos = rng.random(n) ** (1.0 / (exponent + 1.0))
    sin, phi = np.sqrt(1.0 - cos**2), rng.uniform(0, 2 * np.pi, n)
    first = np.cross(axis, [0.0, 0.0, 1.0])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    return sin[:, None] * (np.cos(phi)[:, None] * first + np.sin(phi)[:, None] * second) + cos[:, None] * axis


def lobe(exponent: float, axis: Array) -> Callable[[Array, Array], Array]:
    """Intensity of a lobe of unit flux."""
    return lambda c, gamma: (exponent + 1) / (2 * np.pi) * np.maximum(direction(c, gamma) @ axis, 0.0) ** exponent


@pytest.mark.slow
@pytest.mark.parametrize(("exponent", "c", "gamma"), [(1.0, 20.0, 35.0), (30.0, 250.0, 4.0), (6.0, 101.0, 170.0)])
def test_a_leaning_lobe_node_by_node(exponent: float, c: float, gamma: float) -> None:
    """Against quadrature; every third node in C and γ, whose hats have no ray in common."""
    n, planes, step = 150_000, 24, 7.5
    axis = direction(c, gamma)
    led = intensity_distribution(rays_of(leaning_lobe(n, exponent, axis, 5), np.full(n, 3.0 / n)), planes, step)
    expected = 3.0 * hat_means(lobe(exponent, axis), c=led.c, gamma=led.gamma)[0]
    apart = np.s_[::3, 1:-1:3]
    held = led.values[apart] > 6.0 * led.standard_error[apart]
    values, errors = led.values[apart][held], led.standard_error[apart][held]
    assert_agree(values=values, expected=expected[apart][held], standard_error=errors)
    turned = np.roll(expected, 1, axis=0)[apart][held]
    assert_differ(values=values, other=turned, standard_error=errors)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "step", "told"), [(20_000, 2.5, False), (20_000, 5.0, False), (400_000, 7.5, True)])
def test_what_steps_blur_beyond_the_errors_is_told(n: int, step: float, told: bool) -> None:
    """Intensity at the nodes less the means around them, by quadrature, over the errors of the means: the note's number is
    their root mean square within a quarter, and there is none if it is below 1."""
    planes, axis = round(180.0 / step), direction(31.0, 32.0)
    led = intensity_distribution(rays_of(leaning_lobe(n, 10.0, axis, 5), np.full(n, 3.0 / n)), planes, step)
    at = 3.0 * lobe(10.0, axis)(led.c[:, None], led.gamma)
    blur = at - 3.0 * hat_means(lobe(10.0, axis), c=led.c, gamma=led.gamma)[0]
    lit = (at > 0.02 * at.max()) & (led.standard_error > 0.0)
    off = math.sqrt(np.mean((blur[lit] / led.standard_error[lit]) ** 2))
    notes = [note for note in led.notes if note.startswith("errors are those of the means around nodes")]
    assert told is (off > 1.0)
    assert len(notes) == told
    if told:
        assert float(re.search(r"by ([\d.]+) of them", notes[0])[1]) == pytest.approx(off, rel=0.25)  # type: ignore[index]
        share = float(re.search(r"about ([\d.]+)% of the peak", notes[0])[1])  # type: ignore[index]
        assert share == pytest.approx(100.0 * np.abs(blur).max() / at.max(), rel=0.25)


@pytest.mark.slow
def test_error_bars_cover_the_truth() -> None:
    """Rays of unequal flux, 8 seeds; nodes with no ray in common; the number of those within one error is binomial."""
    n, planes, step, inside, tried = 60_000, 24, 7.5, 0, 0
    axis = direction(20.0, 35.0)
    truth = None
    for seed in range(8):
        weights = np.random.default_rng(seed).gamma(2.0, 0.5, n)
        led = intensity_distribution(rays_of(leaning_lobe(n, 2.0, axis, seed), weights), planes, step)
        truth = n * hat_means(lobe(2.0, axis), c=led.c, gamma=led.gamma)[0] if truth is None else truth
        sure = (truth > 0.05 * truth.max())[::2, 2:-2:2]
        z = ((led.values - truth) / led.standard_error)[::2, 2:-2:2][sure]
        inside, tried = inside + int((np.abs(z) < 1.0).sum()), tried + z.size
    assert_drawn_with(share=0.6827, hits=inside, rays=tried)


@pytest.mark.slow
def test_a_lambertian_source_as_a_function() -> None:
    rays = et.RingSource(rays=2_000_000, seed=2)
    led = et.intensity_distribution(rays, 8, 5)
    cosine = hat_means(lambda c, gamma: np.cos(np.radians(gamma)) + 0.0 * c, c=led.c, gamma=led.gamma)[0]
    # Every other plane, whose hats have no ray in common.
    planes, row = np.s_[::2], int(np.flatnonzero(led.gamma == 40.0)[0])
    error = np.sqrt((led.standard_error[planes, row] ** 2).mean() / 4)
    assert error < 0.005 * led.values[0, row]
    found = led.at(led.c[planes], 40.0).mean()
    assert abs(found - rays.total_flux / np.pi * cosine[planes, row].mean()) < LARGEST_Z * error
    assert led.flux == pytest.approx(rays.total_flux, rel=1e-12)
    assert led.at(0, 100) == 0


# --- every lumen once ------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("planes", "step"), [(1, 90), (13, 11.25)])
def test_flux_closes_to_rounding_over_several_batches(planes: int, step: float) -> None:
    n = 270_000
    rng = np.random.default_rng(3)
    directions, flux = rng.normal(size=(n, 3)), rng.random(n)
    rays = rays_of(directions, flux, "W")
    seen: list[int] = []
    led = intensity_distribution(rays, planes, step, progress=seen.append)
    assert led.flux == pytest.approx(rays.total_flux, rel=1e-12)
    assert led.flux_error == pytest.approx(np.sqrt((flux**2).sum()), rel=1e-6)
    assert seen[-1] == n
    assert len(seen) > 1
    assert (led.unit, led.quantity) == ("W/sr", "radiant intensity")


def test_far_field_sets_and_unusable_rays() -> None:
    records = np.zeros(4, dtype=[("direction", "<f4", (3,)), ("flux", "<f4")])
    records["direction"] = [[0, 0, 2], [0, 1, 0], [0, 0, 0], [np.nan, 0, 1]]
    records["flux"] = [1, 2, 4, 8]
    rays = et.RaySet.from_records(records, RaySetMeaning())
    assert not rays.has_position
    led = intensity_distribution(rays, 4, 45)
    omega = Nodes.even(4, 45).solid_angle
    assert np.allclose(led.values[:, 0] * omega[0], 1.0)
    assert led.values[1, 2] * led.node_solid_angle[1, 2] == pytest.approx(2.0)
    assert np.count_nonzero(led.values > 1e-9) == 5
    assert np.isnan(led.standard_error[0, 2])
    assert "2 others cannot be used" in led.notes[0]
    assert "15 of 20 nodes saw no ray" in led.notes[-1]


def test_copies_of_a_ray_are_one_ray() -> None:
    """A set merged with itself has twice the flux, the same nodes and relative errors; without places nothing is known."""
    once = rays_of(
        leaning_lobe(30_000, 6.0, direction(20.0, 35.0), 5), np.random.default_rng(1).gamma(2.0, 0.5, 30_000)
    )
    expected, found = intensity_distribution(once), intensity_distribution(et.RaySet.merge([once, once]))
    assert np.array_equal(found.gamma, expected.gamma)
    assert np.array_equal(found.c, expected.c)
    assert np.allclose(found.values, 2.0 * expected.values, rtol=1e-9)
    assert np.allclose(found.standard_error, 2.0 * expected.standard_error, rtol=1e-9, equal_nan=True)
    assert found.flux_error == pytest.approx(2.0 * expected.flux_error)
    assert any("30,000 of 60,000 rays repeat another one" in note for note in found.notes)
    records = np.zeros(400, dtype=[("direction", "<f4", (3,)), ("flux", "<f4")])
    records["direction"], records["flux"] = np.tile(np.random.default_rng(2).normal(size=(200, 3)), (2, 1)), 1.0
    far = intensity_distribution(et.RaySet.from_records(records, RaySetMeaning()))
    assert far.flux_error == pytest.approx(20.0)
    assert not any("repeat" in note for note in far.notes)


@pytest.mark.parametrize("power", [-700, -500, 500, 700])
def test_flux_whose_squares_are_no_numbers_has_its_errors(power: int) -> None:
    """Over a power of two every number is the same, bit by bit, also where squares vanish or are infinite."""
    lamp = leaning_lobe(4000, 6.0, direction(20.0, 35.0), 5)
    weights = np.random.default_rng(1).gamma(2.0, 0.5, 4000)
    expected, found = (intensity_distribution(rays_of(lamp, weights * scale)) for scale in (1.0, 2.0**power))
    assert np.array_equal(found.values, expected.values * 2.0**power)
    assert np.array_equal(found.standard_error, expected.standard_error * 2.0**power, equal_nan=True)
    assert found.flux_error == expected.flux_error * 2.0**power > 0.0


def test_no_flux_at_all() -> None:
    led = intensity_distribution(rays_of(direction([0.0, 5.0], [1.0, 90.0]), np.zeros(2)), 4, 45)
    assert (led.flux, led.maximum, led.symmetry()) == (0.0, 0.0, "rotational")


@pytest.mark.parametrize(
    ("planes", "step", "message"),
    [
        (0, 5, "c_planes"),
        (2.5, 5, "whole number"),
        (4, 0, "gamma_step"),
        (4, -5, "gamma_step"),
        (4, 7, "7.2° would do"),
        (4, 1.23e-5, "1.25e-05° would do"),
        (4, 120, "gamma_step"),
        (4, float("nan"), "gamma_step"),
        (10**7, 0.1, "cells"),
    ],
)
def test_cells_that_are_none(planes: int, step: float, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        Nodes.even(planes, step)


# --- colours -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["point", "surface"])
def test_a_distribution_of_rays_shines_with_their_spectrum(kind: str) -> None:
    """Behind a sheet that lets other shares of each line through: the hits of a line are binomial."""
    lines, shares, let = np.array([450.0, 550.0, 633.0]), np.array([0.5, 0.3, 0.2]), np.array([0.1, 0.5, 0.9])
    rng = np.random.default_rng(12)
    down = direction(rng.uniform(0, 360, 3000), np.degrees(np.arcsin(0.9 * np.sqrt(rng.random(3000)))))
    flux = np.repeat(shares * 2.0, 1000) / 1000.0
    rays = et.RaySet(np.zeros((3000, 3)), down, flux, flux_unit="W", wavelength=np.repeat(lines, 1000))
    led = intensity_distribution(rays)
    found = led.luminaire["spectrum"]
    assert found.wavelength.tolist() == lines.tolist()
    assert found.lines("W")[1] == pytest.approx(shares, rel=1e-9)
    shape = {"shape": {"kind": "disk", "radius": 1.0}} if kind == "surface" else {}
    disk = {"kind": "disk", "radius": 5e3}
    scene = et.Scene(
        sources=[{"name": "led", "kind": kind, "intensity": led, **shape}],
        finishes={"dye": {"kind": "transmitter", "transmittance": {"wavelength": lines, "values": let}}},
        surfaces=[{"shape": disk, "at": [0, 0, 1], "finish": "dye"}],
        detectors=[{"kind": "rays", "name": "out", "shape": disk, "at": [0, 0, 2]}],
    )
    n = 20_000
    result = et.trace(scene, n)
    seen = result.rays["out"]
    total = result.ledger.total.flux
    for line, share in zip(lines, shares * let, strict=True):
        hits = n * float(seen.flux[seen.wavelength == line].sum()) / total
        assert_drawn_with(share=float(share), hits=hits, rays=n)
    assert any("the finish 'dye' treats its wavelengths differently" in note for note in result.notes)
    assert not any("not known" in note for note in result.notes)


def test_a_spectrum_that_all_rays_share_is_that_of_their_distribution() -> None:
    white = et.Spectrum([420, 450, 480, 560, 700], [0.0, 1.0, 0.2, 0.7, 0.0])
    plain = rays_of(direction([0.0, 90.0], [10.0, 50.0]), np.ones(2), "W")
    assert "spectrum" not in intensity_distribution(plain).luminaire
    assert intensity_distribution(plain.with_spectrum(white)).luminaire["spectrum"] == white
