"""What is upright for an observer: axes by hand, and maps that turn as his head does."""

from __future__ import annotations

import json

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.quantities.observer import Observer, Screen, observer_from_dict, observer_to_dict
from hypothesis import given
from hypothesis import strategies as st

DIRECTIONS = {"theta": st.floats(1, 179), "phi": st.floats(-360, 360)}


@given(**DIRECTIONS, roll=st.floats(-720, 720))
def test_up_is_upright_and_roll_turns_about_the_line_of_sight(theta: float, phi: float, roll: float) -> None:
    """For +Z up the axes are the unit vectors of azimuth and of elevation: (-sin φ, cos φ, 0) and -∂/∂θ of the direction."""
    right, up, toward = Observer(theta, phi, 10, up=(0, 0, 3), roll=roll).axes()
    t, p, r = np.radians([theta, phi, roll])
    east = np.array([-np.sin(p), np.cos(p), 0.0])
    north = np.array([-np.cos(t) * np.cos(p), -np.cos(t) * np.sin(p), np.sin(t)])
    np.testing.assert_allclose(right, np.cos(r) * east + np.sin(r) * north, atol=1e-9)
    np.testing.assert_allclose(up, np.cos(r) * north - np.sin(r) * east, atol=1e-9)
    np.testing.assert_allclose(np.cross(right, up), toward, atol=1e-9)


@pytest.mark.parametrize("quarters", [1, 2, 3])
@pytest.mark.parametrize("up", [None, (0.0, 0.0, 1.0)])
def test_a_map_turned_by_roll_is_the_turned_map(quarters: int, up: tuple[float, float, float] | None) -> None:
    """The same rays count in the same pixels, turned clockwise with the picture; the source has no symmetry."""
    rng = np.random.default_rng(5)
    position = rng.normal((1.0, -2.0, 0.5), (3.0, 1.0, 0.7), (40_000, 3))
    direction = rng.normal((np.sin(0.7), 0.1, np.cos(0.7)), 0.05, (40_000, 3))
    rays = et.RaySet(position=position, direction=direction, flux=rng.random(40_000))
    screen = Screen(12, 12, 12, 12)
    plain, turned = (
        et.luminance_map(rays, Observer(40, 8, 500, up=up, roll=roll), screen, method=et.Cone(acceptance=5))
        for roll in (0.0, 90.0 * quarters)
    )
    assert np.nanmax(plain.values) > 0.0
    assert not np.array_equal(plain.rays, np.rot90(plain.rays, -quarters))
    np.testing.assert_array_equal(turned.rays, np.rot90(plain.rays, -quarters))
    np.testing.assert_allclose(turned.values, np.rot90(plain.values, -quarters), rtol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"up": (0, 0, 0)}, "up is"),
        ({"up": (0, np.inf, 0)}, "up is"),
        ({"up": (1, 2)}, "up is"),
        ({"up": (1e-9, 0, -2)}, "along the line of sight"),
        ({"roll": np.nan}, "roll is"),
    ],
)
def test_what_nothing_is_upright_for_is_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        Observer(0, 0, 10, **options)  # type: ignore[arg-type]


def test_fixed_planes_turn_with_nobody() -> None:
    for observer in (Observer(10, 0, 10, up=(0, 1, 0)), Observer(10, 0, 10, roll=5)):
        with pytest.raises(ArgumentError, match="plane='xy'"):
            Screen(1, 1, 1, 1, "xy").axes(observer)


@pytest.mark.parametrize("turns", [{}, {"up": (0.0, 1.0, 2.0)}, {"roll": 12.5}, {"up": (1.0, 0.0, 0.0), "roll": -3.0}])
def test_files_have_up_and_roll_only_where_they_are_stated(turns: dict[str, object]) -> None:
    observer = Observer(12, 34, 56, (7, 8, 9), **turns)  # type: ignore[arg-type]
    data = observer_to_dict(observer)
    assert set(data) == {"theta", "phi", "distance", "target", *turns}
    assert observer_from_dict(json.loads(json.dumps(data))) == observer
