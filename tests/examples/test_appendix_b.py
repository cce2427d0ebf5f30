"""The pictures of appendices A and B: their vectors, angles and points by matrices of rotation and by vectors alone."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest

Array = npt.NDArray[np.float64]
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture
def constructions(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module("experiments.constructions")


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module("appendix_b")


def turned(*, axis: str, angle: float) -> Array:
    """The matrix of a rotation about an axis by the right hand."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    found = np.eye(3)
    found[j, j], found[j, k], found[k, j], found[k, k] = c, -s, s, c
    return found


def sample(*, gamma: float, delta: float) -> Array:
    """x, y and z of the sample, one a column: about its normal by δ, then about y, against the right hand, by γ."""
    return turned(axis="y", angle=-gamma) @ turned(axis="z", angle=delta)


def detector(*, alpha: float, beta: float) -> Array:
    """From behind the sample at rest, up by β on the bench, then with the bench about y, against the right hand, by α."""
    return turned(axis="y", angle=-alpha) @ turned(axis="x", angle=beta) @ [0.0, 0.0, -1.0]


@pytest.mark.parametrize("case", ["AT_REST", "TURNED"])
def test_stages_are_drawn_as_rotations(constructions: ModuleType, case: str) -> None:
    alpha, beta, gamma, delta = getattr(constructions, case)
    axes = constructions.sample_axes(gamma, delta)
    assert np.allclose(axes.T, sample(gamma=gamma, delta=delta), atol=1e-12)
    bench = constructions.detector_direction(alpha, beta, 0.0, 0.0)
    assert np.allclose(bench, detector(alpha=alpha, beta=beta), atol=1e-12)
    # The dashed line is the mirror image of the light in the normal that is drawn.
    light, normal = np.array([0.0, 0.0, 1.0]), axes[2]
    specular = constructions.detector_direction(180.0 + 2.0 * gamma, 0.0, 0.0, 0.0)
    assert np.allclose(specular, 2.0 * (normal @ light) * normal - light, atol=1e-12)


def test_coordinates_are_those_of_the_vectors_drawn(constructions: ModuleType) -> None:
    """βsc = |s − iₛ| without the components along z, and φsc the turn from z × i to that difference by the right hand."""
    azimuths = []
    for those in constructions.CONSTRUCTIONS.values():
        for one in those:
            alpha, beta, gamma, delta = one.stages
            to_sample = sample(gamma=gamma, delta=delta).T
            i, s, z = to_sample[:, 2], to_sample @ detector(alpha=alpha, beta=beta), np.array([0.0, 0.0, 1.0])
            assert np.allclose(one.incident, i, atol=1e-12)
            assert np.allclose(one.scattered, s, atol=1e-12)
            specular = 2.0 * (z @ i) * z - i
            off = (s - specular) * [1.0, 1.0, 0.0]
            r, a = one.coordinates
            assert r == pytest.approx(np.linalg.norm(off), abs=1e-12)
            across = np.cross(z, i) if i[2] < 1.0 else np.array([1.0, 0.0, 0.0])
            pointing = turned(axis="z", angle=a) @ across
            assert np.allclose(pointing / np.linalg.norm(pointing), off / np.linalg.norm(off), atol=1e-12)
            # The ends of the arrows in the plane.
            assert np.allclose(one.at(0.0, 0.0), specular[:2], atol=1e-12)
            assert np.allclose(one.at(r, a), s[:2], atol=1e-12)
            azimuths.append(a)
    assert min(azimuths) < 180.0 < max(azimuths)


def test_each_construction_is_that_of_its_figure(constructions: ModuleType) -> None:
    """Light along the normal; in the plane of y and z; in neither plane of two axes."""
    normal, inclined, oblique = (those[0].incident for those in constructions.CONSTRUCTIONS.values())
    assert np.allclose(normal, [0.0, 0.0, 1.0])
    assert abs(inclined[0]) < 1e-12 < -inclined[1]
    assert (np.abs(oblique) > 0.1).all()


def brdf(*, polar: npt.ArrayLike, azimuth: npt.ArrayLike) -> Array:
    """Of no symmetry, over θ′ and φ′ [°]."""
    return np.asarray(np.exp(-np.asarray(polar) / 20.0) * (2.0 + np.cos(np.radians(np.asarray(azimuth) - 20.0))))


def scans(theta: float) -> tuple[Array, Array]:
    """Every 10° about the specular direction as far as the horizon, in the plane of incidence and across it."""
    polar, azimuth = (v.ravel() for v in np.meshgrid(np.arange(0.0, 150.0, 10.0), np.arange(0.0, 360.0, 90.0)))
    t, p = np.radians(polar), np.radians(azimuth)
    local = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1) @ turned(axis="x", angle=theta)
    # Light comes from −x: x′ = z × i = −y and y′ = x.
    at = np.stack([local[:, 1], -local[:, 0], local[:, 2]], axis=-1)
    return at[at[:, 2] > 0.03], brdf(polar=polar, azimuth=azimuth)[at[:, 2] > 0.03]


@pytest.mark.parametrize("theta", [5.0, 60.0])
def test_points_about_the_specular_direction_are_rotated_by_b4(
    example: ModuleType, monkeypatch: pytest.MonkeyPatch, theta: float
) -> None:
    """B.3 and B.4 mended, about x′ by +θ, take the directions to the angles that they were asked for."""
    monkeypatch.setattr(example, "scanned", scans)
    polar, azimuth = np.arange(0.0, 151.0, 10.0), np.arange(0.0, 360.0, 30.0)
    at, f = example.about_specular(theta, polar, azimuth)
    local = np.stack([-at[..., 1], at[..., 0], at[..., 2]], axis=-1)
    unit = example.lobe(polar, azimuth[:, None], np.ones(f.shape))
    there = ~np.isnan(f)
    assert there.sum() > 0.5 * there.size
    assert np.allclose((local @ turned(axis="x", angle=theta).T)[there], unit[there], atol=1e-12)
    # What is missing is below the surface.
    assert ((unit @ turned(axis="x", angle=theta))[~there][:, 2] < 1e-9).all()


def test_the_lobe_is_linear_in_both_angles_between_the_scans(
    example: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At measured angles it is what was measured; between, the mean with the weights of the distances."""
    monkeypatch.setattr(example, "scanned", scans)
    _, f = example.about_specular(25.0, np.array([20.0, 24.0, 30.0]), np.arange(0.0, 360.0, 30.0))
    arms = np.arange(0.0, 360.0, 90.0)
    assert f[::3, 0] == pytest.approx(brdf(polar=20.0, azimuth=arms))
    assert f[::3, 2] == pytest.approx(brdf(polar=30.0, azimuth=arms))
    assert f[:, 1] == pytest.approx(0.6 * f[:, 0] + 0.4 * f[:, 2])
    assert f[1::3] == pytest.approx((2.0 * f[::3] + np.roll(f[::3], -1, axis=0)) / 3.0)
    assert f[2::3] == pytest.approx((f[::3] + 2.0 * np.roll(f[::3], -1, axis=0)) / 3.0)
