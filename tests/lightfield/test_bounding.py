"""Where a source is and how large, from its lines alone: lamps of known shape that shine all round."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from etendue.lightfield.carrier import Box
from etendue.lightfield.selection.bounding import (
    MISSED,
    ball_centre,
    box_of_lines,
    cylinder_of_lines,
    near_rays,
    start_centre,
)
from oracles.bodies import Block, Body, Globe, Rod
from scipy.optimize import minimize

Array = npt.NDArray[np.float64]

BODIES = [Globe(), Block(), Rod()]
NAMES = [type(body).__name__.lower() for body in BODIES]


def lines(body: Body, n: int = 20_000) -> tuple[Array, Array]:
    """Lines of a lamp with start points anywhere on them."""
    position, direction = body.rays(n, seed=1)
    return position + direction * np.random.default_rng(2).uniform(-9, 9, (n, 1)), direction


def distances(position: Array, direction: Array, centre: Array) -> Array:
    return np.linalg.norm(np.cross(position - centre, direction), axis=1)


@pytest.mark.parametrize("body", BODIES, ids=NAMES)
def test_lamps_of_the_tests_have_the_flux_they_state(body: Body) -> None:
    """∫ L dU over all lines through a sphere about the lamp, by Monte Carlo; the rays have the density L / Φ."""
    rng = np.random.default_rng(7)
    n, around = 100_000, 4.0
    normal, turn = rng.normal(size=(2, n, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    direction = normal + turn / np.linalg.norm(turn, axis=1)[:, None]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    luminance = body.luminance(points=around * normal + body.middle, directions=direction)
    etendue = 4 * np.pi**2 * around**2 * 1e-6
    flux, error = luminance.mean() * etendue, luminance.std() * etendue / np.sqrt(n)
    assert abs(flux - body.total_flux) < 4 * error
    position, direction = body.rays(20_000, seed=3)
    seen = body.luminance(points=position + 3.0 * direction, directions=direction)
    # E[1 / L] over rays is the étendue of the lamp over its flux: π times its area, for a convex one.
    inverse = 1 / seen
    area = inverse.mean() * body.total_flux / np.pi * 1e6
    known = {"globe": 4 * np.pi * 2.5**2, "block": 8 * (1.5 * 0.6 + 0.6 * 2.2 + 2.2 * 1.5), "rod": 2.2 * np.pi * 5.7}
    error = area * inverse.std() / inverse.mean() / np.sqrt(20_000)
    assert abs(area - known[type(body).__name__.lower()]) < 4 * error


@pytest.mark.parametrize("body", BODIES, ids=NAMES)
def test_the_smallest_ball_is_that_of_an_optimiser(body: Body) -> None:
    """min over c, t of t, subject to |distance of line i from c|² ≤ t, by sequential quadratic programming."""
    position, direction = lines(body, 3000)
    centre = ball_centre(position, direction, np.zeros(3), 1)
    found = distances(position, direction, centre).max()

    def room(unknown: Array) -> Array:
        return unknown[3] - distances(position, direction, unknown[:3]) ** 2

    best = minimize(lambda u: u[3], [*body.middle, 9.0], constraints={"type": "ineq", "fun": room}, method="SLSQP")
    assert best.success
    assert np.sqrt(best.x[3]) - 1e-6 < found < np.sqrt(best.x[3]) * 1.005


def test_a_ball_in_two_dimensions() -> None:
    rng = np.random.default_rng(3)
    turn, reach = rng.random(5000) * 2 * np.pi, 1.4 * np.sqrt(rng.random(5000))
    along = np.stack([-np.sin(turn), np.cos(turn)], axis=1)
    position = np.array([3.0, -2.0]) + reach[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1) + 4 * along
    assert ball_centre(position, along, np.zeros(2), 1) == pytest.approx([3.0, -2.0], abs=0.01)


@pytest.mark.parametrize("share", [0.0, 0.002, 0.02])
def test_strays_are_those_beyond_a_gap(share: float) -> None:
    rod = Rod()
    position, direction = lines(rod)
    strays = int(share * len(position))
    position[:strays] += np.random.default_rng(4).normal(size=(strays, 3)) * 500
    far = distances(position, direction, np.array(rod.middle)) > 10
    near = near_rays(position, direction, np.array(rod.middle))
    assert not (near & far).any()
    assert near[~far].all()
    assert far.sum() >= 0.9 * strays


def test_start_points_on_a_sphere_show_its_centre_and_others_none() -> None:
    position, _ = Globe().rays(500, seed=1)
    centre = start_centre(position)
    assert centre is not None
    assert centre == pytest.approx(Globe().middle, abs=1e-12)
    assert start_centre(lines(Globe(), 500)[0]) is None
    upper = position[position[:, 2] > 3.5]
    assert start_centre(upper) == pytest.approx(Globe().middle, abs=1e-12)


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (5.0, -9.0, 30.0)])
def test_a_cylinder_of_lines_is_the_rod(start: tuple[float, float, float]) -> None:
    rod = Rod()
    found = cylinder_of_lines(*lines(rod), np.array(start), 1)
    assert found is not None
    assert found.radius == pytest.approx(rod.radius, rel=0.005)
    ends = rod.middle[2] - rod.height / 2, rod.middle[2] + rod.height / 2
    assert (found.bottom, found.top) == pytest.approx(ends, abs=0.01)
    assert found.centre == pytest.approx(rod.middle[:2], abs=0.01)


@pytest.mark.parametrize(("turns", "axis"), [(1, "x"), (2, "y")])
def test_a_cylinder_of_lines_along_another_axis_is_the_rod_turned(turns: int, axis: str) -> None:
    """x → y → z → x: the rod about Z becomes one about X, then about Y."""
    rod = Rod()
    position, direction = (np.roll(v, turns, axis=1) for v in lines(rod))
    middle = np.roll(rod.middle, turns)
    found = cylinder_of_lines(position, direction, np.zeros(3), 1, axis)
    assert found is not None
    assert (found.axis, found.radius) == (axis, pytest.approx(rod.radius, rel=0.005))
    along = "xyz".index(axis)
    ends = middle[along] - rod.height / 2, middle[along] + rod.height / 2
    assert (found.bottom, found.top) == pytest.approx(ends, abs=0.01)
    assert found.centre == pytest.approx(np.delete(middle, along), abs=0.01)


def test_lines_along_z_have_no_cylinder() -> None:
    place = np.random.default_rng(5).uniform(-1, 1, (500, 3))
    assert cylinder_of_lines(place, np.tile([0.0, 0.0, 1.0], (500, 1)), np.zeros(3), 1) is None


def box_cost(faces: Array, position: Array, direction: Array) -> float:
    """ln of the area of a box, and of the lines those that its closed form says miss it."""
    block = Block(middle=tuple(faces.mean(axis=0)), half=tuple(np.diff(faces, axis=0)[0] / 2))
    _, met = block.exits(points=position - block.middle, directions=direction)
    a, b, c = 2 * np.array(block.half)
    return float(np.log(2 * (a * b + b * c + c * a)) + MISSED * np.mean(~met))


def faces_of(box: Box) -> Array:
    assert box.centre is not None
    half = np.array([box.closed(name) for name in ("width", "height", "depth")]) / 2
    return np.stack([np.array(box.centre) - half, np.array(box.centre) + half])


@pytest.mark.parametrize(("aside", "radius"), [((0.0, 0.0, 0.0), 3.0), ((2.0, -1.0, 3.0), 7.0)])
@pytest.mark.parametrize("body", BODIES, ids=NAMES)
def test_a_box_of_lines_is_a_least_one(body: Body, aside: tuple[float, float, float], radius: float) -> None:
    """No face of it can be moved for a better one."""
    position, direction = lines(body, 4000)
    box = box_of_lines(position, direction, np.add(body.middle, aside), radius)
    assert box is not None
    faces = faces_of(box)
    least = box_cost(faces, position, direction)
    for side in range(2):
        for axis in range(3):
            for move in (-0.3, -0.03, -0.003, 0.003, 0.03, 0.3):
                moved = faces.copy()
                moved[side, axis] += move
                assert box_cost(moved, position, direction) > least - 1e-4, (side, axis, move)


def test_a_box_of_lines_that_were_recorded_from_above_alone() -> None:
    """A hemisphere far around a lamp sees only what heads upwards: the lines that graze it tell where its bottom is."""
    block = Block()
    position, direction = lines(block, 100_000)
    up = direction[:, 2] > 0.0
    box = box_of_lines(position[up], direction[up], np.array(block.middle), 3.0)
    assert box is not None
    assert faces_of(box) == pytest.approx(faces_of(Box(*2 * np.array(block.half), centre=block.middle)), abs=0.01)


def test_a_box_leaves_few_lines_far_out() -> None:
    """One line of ten thousand would double its size; that costs more than leaving it."""
    block = Block()
    position, direction = lines(block)
    position[:2] += 5.0 * np.cross(direction[:2], [1.0, 0.0, 0.0])
    box = box_of_lines(position, direction, np.array(block.middle), 9.0)
    assert box is not None
    assert faces_of(box) == pytest.approx(faces_of(Box(*2 * np.array(block.half), centre=block.middle)), abs=0.03)


def test_lines_along_the_faces_of_a_box_meet_it() -> None:
    """Lines of a grid along each axis, which divide by 0 at the faces they lie in."""
    grid = np.linspace(-1.0, 1.0, 21)
    u, v = (g.ravel() for g in np.meshgrid(grid, grid))
    o = np.zeros_like(u)
    position = np.concatenate([np.stack(p, axis=1) for p in ((u, v, o), (o, u, v), (v, o, u))])
    direction = (
        np.repeat(np.eye(3)[[2, 0, 1]], len(u), axis=0) * np.where(np.arange(3 * len(u)) % 2, -1.0, 1.0)[:, None]
    )
    box = box_of_lines(position, direction, np.zeros(3), 1.0)
    assert box is not None
    assert faces_of(box) == pytest.approx(np.array([[-1.0] * 3, [1.0] * 3]), abs=1e-5)


def test_lines_along_z_have_no_box() -> None:
    place = np.random.default_rng(5).uniform(-1, 1, (500, 3))
    assert box_of_lines(place, np.tile([0.0, 0.0, 1.0], (500, 1)), np.zeros(3), 2.0) is None
