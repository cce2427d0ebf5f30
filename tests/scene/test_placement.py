"""Placement: every way of turning against a rotation that is known."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.scene.placement import Frame, Placement
from scipy.spatial.transform import Rotation


def axes(**keys: Any) -> np.ndarray[Any, Any]:
    """Columns x, y, z of the frame."""
    return Placement(**keys).frame().axes


@pytest.mark.parametrize("seed", range(20))
def test_frames_are_right_handed_and_orthonormal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for keys in (
        {"toward": rng.normal(size=3).tolist()},
        {"axis": rng.normal(size=3).tolist(), "angle": rng.uniform(-720, 720)},
        {"rotation": rng.uniform(-720, 720, 3).tolist()},
    ):
        frame = axes(**keys, spin=rng.uniform(-360, 360))
        assert frame.T @ frame == pytest.approx(np.eye(3), abs=1e-15 * 8)
        assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("seed", range(10))
def test_turns_are_those_of_scipy(seed: int) -> None:
    """An independent implementation: rotation vectors, and extrinsic x-y-z Euler angles (lower case)."""
    rng = np.random.default_rng(seed)
    axis, angle, euler = rng.normal(size=3), rng.uniform(-400, 400), rng.uniform(-400, 400, 3)
    unit = axis / np.linalg.norm(axis)
    assert axes(axis=axis, angle=angle) == pytest.approx(
        Rotation.from_rotvec(unit * math.radians(angle)).as_matrix(), abs=1e-12
    )
    assert axes(rotation=euler) == pytest.approx(Rotation.from_euler("xyz", euler, degrees=True).as_matrix(), abs=1e-12)


@pytest.mark.parametrize(("theta", "phi"), [(0, 0), (30, 0), (45, 70), (90, 200), (179, -30), (120, 90)])
def test_toward_is_the_turn_of_an_observers_screen(theta: float, phi: float) -> None:
    """+Z comes to point there, and +X, +Y where a screen's axes do (docs/conventions.md)."""
    observer = et.Observer(theta=theta, phi=phi, distance=1)
    right, up, normal = et.Screen(1, 1, 1, 1).axes(observer)
    found = axes(toward=(3e5 * observer.direction).tolist())
    assert found == pytest.approx(np.stack([right, up, normal], axis=1), abs=1e-12)


def test_quarter_turns_are_exact() -> None:
    """Not 6e-17 of another axis, and no -0."""
    assert axes(toward=[0, 0, -1]).tolist() == [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]
    assert axes(toward=[1, 0, 0]).tolist() == [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    assert axes(axis=[0, 0, 2], angle=90).tolist() == [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    assert axes(rotation=[180, 0, 0]).tolist() == [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
    assert "-0" not in str(Placement(toward=[0, 0, -1], spin=90).frame().record())


def test_spin_comes_first() -> None:
    """A quarter turn about local +Z takes local x to y, which then goes where y goes."""
    plain, spun = axes(toward=[1, 2, 3]), axes(toward=[1, 2, 3], spin=90)
    assert spun[:, 0] == pytest.approx(plain[:, 1])
    assert spun[:, 1] == pytest.approx(-plain[:, 0])
    assert spun[:, 2] == pytest.approx(plain[:, 2])


def test_the_record_lists_the_axes_one_after_the_other() -> None:
    frame = Frame.along((1, 2, 3), (0, 5, 0), (2, 0, 0))
    assert frame.record() == [1, 2, 3, 0, 1, 0, 0, 0, 1, 1, 0, 0]
