"""The total flux of a goniophotometer: what its integral may miss between the positions."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.instruments.near_field.positions import ArmPositions, _half_integrals
from oracles.verdicts import assert_drawn_with
from scipy.integrate import quad

Array = npt.NDArray[np.float64]


@pytest.mark.parametrize("rings", [(0, 30, 60, 90), (0, 10, 30, 50, 70, 90), (0, 20, 40, 60, 80, 90), (0, 60, 90)])
def test_splines_on_uneven_rings_hold_what_is_flat_at_the_pole(rings: tuple[float, ...]) -> None:
    """1, γ² and γ³ times sin γ, by quadrature; a spline of two steps has one cubic without slope at the pole."""
    x = np.radians(rings)
    for power in (0, 2, 3):
        exact, _ = quad(lambda g, power=power: g**power * math.sin(g), 0.0, math.pi / 2)
        assert float(_half_integrals(x) @ x**power) == pytest.approx(exact, rel=1e-12)


def directions(*, stops: ArmPositions) -> Array:
    """Unit vectors to all positions."""
    g, c = np.radians(stops.gamma), np.radians(stops.c)
    return np.stack([np.sin(g) * np.cos(c), np.sin(g) * np.sin(c), np.cos(g)], axis=1)


@pytest.mark.parametrize("step", [(5, 15), (10, 10), (15, 15), (18, 20), (30, 60)])
def test_what_is_missed_of_a_tilted_disk_is_known(step: tuple[float, float]) -> None:
    """Lambertian light about 80 axes drawn at random has the integral π, and a kink across all rings and planes.

    What is missed is less than what is told in four of five cases or more, and nothing is told of even light.
    """
    stops = ArmPositions(*step)
    to, axes = directions(stops=stops), np.random.default_rng(1).normal(size=(80, 3))
    light = np.maximum(to @ (axes / np.linalg.norm(axes, axis=1)[:, None]).T, 0.0)
    none = np.zeros(len(stops))
    held = sum(abs(stops.weight @ one - np.pi) < stops.missed(one, none) for one in light.T)
    assert_drawn_with(share=(0.8, 1.0 - 1e-12), hits=float(held), rays=80.0)
    assert stops.missed(none + 1.0, none) < 1e-7


@pytest.mark.parametrize("step", [(2.5, 15), (5, 5), (10, 10)])
def test_what_is_missed_of_light_that_ends_at_an_angle_is_known(step: tuple[float, float]) -> None:
    """A disk behind a sharp cut-off at Γ sends out π sin² Γ: the error is told to a factor of three."""
    stops = ArmPositions(*step)
    none, level = np.zeros(len(stops)), np.maximum(np.cos(np.radians(stops.gamma)), 0.0)
    angles = np.random.default_rng(2).uniform(20.0, 80.0, 60)
    light = [np.where(stops.gamma < angle, level, 0.0) for angle in angles]
    missed = [
        abs(stops.weight @ one - np.pi * math.sin(math.radians(a)) ** 2) for one, a in zip(light, angles, strict=True)
    ]
    told = [stops.missed(one, none) for one in light]
    assert np.sqrt(np.mean(np.square(told))) == pytest.approx(np.sqrt(np.mean(np.square(missed))), rel=0.5)
    assert (np.array(missed) < 3.0 * np.array(told)).mean() > 0.95


def test_noise_is_not_taken_for_light_between_the_positions() -> None:
    """Even light with readings that err by 2 %: what is told is little beside what the readings leave unknown."""
    stops = ArmPositions(10, 10)
    rng = np.random.default_rng(3)
    errors = np.full(len(stops), 0.02)
    told = [stops.missed(1.0 + errors * rng.normal(size=len(stops)), errors) for _ in range(100)]
    assert np.mean(told) < 0.25 * np.linalg.norm(stops.weight * errors)


def test_a_note_tells_of_a_lamp_whose_horizon_is_tilted() -> None:
    """In steps of 30° its flux is off by more than fifty stated errors."""
    disk = {"kind": "surface", "shape": {"kind": "disk", "radius": 2}, "flux": 100}
    gonio = et.NearFieldGoniophotometer((30, 60), camera_pixels=8)
    run = gonio.measure(et.Scene(sources=[disk | {"toward": [0.3, 0.1, 1]}]), seed=2)
    assert abs(run.total_flux - 100.0) > 50.0 * run.total_flux_error
    assert any("changes much between positions" in note for note in run.notes)
    assert any("changes much between positions" in note for note in run.intensity().notes)
