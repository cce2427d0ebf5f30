"""V7: the cylindrical cavity of thesis chapter 4 against its radiosity equation, which knows no rays; verdicts at 1e-4."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.quantities.observer import Observer, Screen
from etendue.tracing.result import TraceResult
from numpy.polynomial.legendre import leggauss
from oracles.gathered import common_error
from oracles.radiosity import Cavity, wall_from_wall, wall_to_disk
from oracles.verdicts import REVERSE, assert_agree, assert_differ, assert_drawn_with

Array = npt.NDArray[np.float64]

FLUX = 4 * 0.96
DISK = 5.0
"""The four holes of radius 2.5 made one, in the middle."""

CAVITY = Cavity(disk=DISK, exitance=FLUX / (math.pi * DISK**2))
SCREEN = {"width": 17, "height": 12, "columns": 8, "rows": 6}
EYE = {"name": "eye", "theta": 45, "phi": 70, "distance": 400, "target": [1, -2, 13]}


def cavity() -> et.Scene:
    white = {"kind": "lambertian", "reflectance": CAVITY.reflectance}
    size = {"radius": CAVITY.radius, "height": CAVITY.height}
    return et.Scene(
        sources=[{"kind": "surface", "shape": {"kind": "disk", "radius": DISK}, "flux": FLUX}],
        surfaces=[
            {"name": "wall", "shape": {"kind": "cylinder", **size}, "finish": white},
            {"name": "base", "shape": {"kind": "annulus", "inner_radius": DISK, "outer_radius": CAVITY.radius},
             "finish": white},
            {"name": "disk", "shape": {"kind": "disk", "radius": DISK}, "at": [0, 0, -1e-3], "finish": "absorber"},
        ],
        detectors=[
            {"name": "floor", "kind": "illuminance", "width": 24, "height": 16, "columns": 6, "rows": 4, "at": [2, -3, 1e-6],
             "spin": 20},
            {"name": "image", "kind": "image", "observer": "eye"},
        ],
        observers=[{**EYE, "screen": SCREEN}],
    )  # fmt: skip


@pytest.fixture(scope="module")
def traced() -> TraceResult:
    result = et.trace(cavity(), 4e5, 11)
    assert result.ledger.closes
    assert result.ledger.lost == ()
    return result


# --- the equation ----------------------------------------------------------------------------------------------------


def test_shares_of_the_wall_add_up() -> None:
    """From a point of the wall all light goes to the wall or to one of the ends."""
    x, w = leggauss(60)
    for z in (0.1, 3.0, 10.7, 21.0):
        total = wall_to_disk(np.array(z), 21.5) + wall_to_disk(np.array(21.4 - z), 21.5)
        for low, high in ((0.0, z), (z, 21.4)):
            at = (low + high) / 2 + (high - low) / 2 * x
            total += (high - low) / 2 * w @ wall_from_wall(at - z, 21.5)
        assert total == pytest.approx(1.0, abs=1e-12)


@pytest.mark.slow
def test_the_solution_loses_no_light_and_has_converged() -> None:
    """What is absorbed, leaves and falls back is what was emitted; other nodes give the same."""
    assert sum(CAVITY.absorbed) + sum(CAVITY.left) == pytest.approx(FLUX, rel=2e-8)
    finer = Cavity(disk=DISK, exitance=CAVITY.exitance, nodes=12, levels=26)
    for at in (np.array([0.01, 1.0, 10.0, 21.39]), np.array([0.0, 4.0, 9.0, 21.4])):
        assert np.allclose(CAVITY.on_base(at), finer.on_base(at), rtol=1e-7)
        assert np.allclose(CAVITY.on_wall(at[at > 0]), finer.on_wall(at[at > 0]), rtol=1e-7)


# --- forwards --------------------------------------------------------------------------------------------------------


def test_where_the_light_ends(traced: TraceResult) -> None:
    ledger = traced.ledger
    n = traced.rays_done
    wall, base = CAVITY.absorbed
    top, back = CAVITY.left
    for flux, rays in (
        (wall, ledger.by_surface["wall"].rays), (base, ledger.by_surface["base"].rays), (top, ledger.escaped.rays),
        (back, ledger.by_surface["disk"].rays),
    ):  # fmt: skip
        assert_drawn_with(share=flux / FLUX, hits=rays, rays=n)


def test_illuminance_of_the_base(traced: TraceResult) -> None:
    """E(r) over each cell of a grid that lies askew: a mean over 8 × 8 points, the integrand being smooth."""
    seen = traced.illuminance["floor"]
    x, w = leggauss(8)
    half = np.array([24 / 6, 16 / 4]) / 2
    expected = np.zeros(seen.values.shape)
    for u, wu in zip(x, w, strict=True):
        for v, wv in zip(x, w, strict=True):
            at = seen.points + u * half[0] * np.array(seen.right) + v * half[1] * np.array(seen.up)
            expected += wu * wv / 4 * CAVITY.on_base(np.hypot(at[..., 0], at[..., 1]))
    assert_agree(values=seen.values, expected=expected * 1e6, standard_error=seen.standard_error)


# --- what is seen ----------------------------------------------------------------------------------------------------


def sights(observer: Observer, screen: Screen, fine: int = 6) -> tuple[Array, Array]:
    """The eye, and unit directions through fine² points of each pixel, shape (rows, columns, fine², 3)."""
    right, up, _ = screen.axes(observer)
    within = (np.arange(fine) + 0.5) / fine - 0.5
    x = screen.x[None, :, None, None] + within[None, None, :, None] * screen.width / screen.columns
    y = screen.y[:, None, None, None] + within[None, None, None, :] * screen.height / screen.rows
    x, y = np.broadcast_arrays(x, y)
    points = np.array(observer.target) + x[..., None] * right + y[..., None] * up
    along = points - observer.position
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    return observer.position, along.reshape(*x.shape[:2], -1, 3)


def expected_map(observer: Observer, screen: Screen, fine: int = 6) -> Array:
    """Mean luminance of each pixel, in lm/(mm² sr): the exitance over π where lines through the opening end."""
    eye, along = sights(observer, screen, fine)
    enter = eye + ((CAVITY.height - eye[2]) / along[..., 2:]) * along
    assert (np.hypot(enter[..., 0], enter[..., 1]) < CAVITY.radius).all()
    ground = eye - eye[2] / along[..., 2:] * along
    r = np.hypot(ground[..., 0], ground[..., 1])
    assert (r > DISK).all()
    # On the wall r = R: the farther of two solutions.
    a = (along[..., :2] ** 2).sum(-1)
    b = (along[..., :2] * enter[..., :2]).sum(-1)
    c = (enter[..., :2] ** 2).sum(-1) - CAVITY.radius**2
    z = enter[..., 2] + (-b + np.sqrt(b * b - a * c)) / a * along[..., 2]
    on_wall = r > CAVITY.radius
    assert 0.1 < on_wall.mean() < 0.9
    seen = np.where(on_wall, CAVITY.on_wall(np.where(on_wall, z, 1.0)), CAVITY.on_base(np.where(on_wall, DISK, r)))
    return CAVITY.reflectance / math.pi * seen.mean(axis=-1)


@pytest.mark.slow
def test_light_image(traced: TraceResult) -> None:
    image = traced.images["image"]
    assert_agree(
        values=image.values,
        expected=expected_map(image.observer, image.screen) * 1e6,
        standard_error=image.standard_error,
    )


@pytest.mark.slow
def test_reverse_map() -> None:
    """By lines of sight, to less than a hundredth a pixel; a mirror image would be told."""
    (seen,) = et.luminance_map(cavity(), rays_per_pixel=16384, seed=2)
    expected = expected_map(seen.observer, seen.screen) * 1e6
    assert np.median(seen.standard_error / seen.values) < 0.01
    assert_agree(values=seen.values, expected=expected, standard_error=seen.standard_error, degrees=REVERSE)
    assert_differ(values=seen.values, other=expected[::-1], standard_error=seen.standard_error)
    assert_differ(values=seen.values, other=expected[:, ::-1], standard_error=seen.standard_error)


@pytest.mark.slow
def test_default_map() -> None:
    """What nothing is said about: lines of sight end at patches, as a pilot finds that better."""
    screen = et.Screen(SCREEN["width"], SCREEN["height"], 24, 18)
    observer = cavity().observers[0].observer()
    lmap = et.luminance_map(cavity(), observer, screen, rays_per_pixel=1500, seed=4)
    assert any("in a pilot" in note for note in lmap.notes)
    # Its pixels are a third as wide as those of the other maps: as dense points are a third as many along a side, or more.
    expected = expected_map(observer, screen, 3) * 1e6
    assert np.median(lmap.standard_error / lmap.values) < 0.012
    # The error that all pixels have in common is no spread: without it.
    spread = np.sqrt(lmap.standard_error**2 - (common_error(lmap=lmap) * lmap.values) ** 2)
    assert_agree(values=lmap.values, expected=expected, standard_error=spread, degrees=REVERSE)
    assert_differ(values=lmap.values, other=expected[:, ::-1], standard_error=spread)
