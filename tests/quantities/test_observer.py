"""Observers and screens against rotations worked out on another way, and vectors by hand."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math

import numpy as np
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.quantities.observer import Observer, Screen, observer_from_dict
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

angles = st.floats(-720.0, 720.0)
thetas = st.floats(0.0, 180.0)
fixed = settings(derandomize=True, deadline=None, max_examples=200)


def unit(theta: float, phi: float) -> np.ndarray:
    t, p = math.radians(theta), math.radians(phi)
    return np.array([math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)])


# --- where he stands -------------------------------------------------------------------------------------------------


@fixed
@given(thetas, angles, st.floats(1e-3, 1e9), st.tuples(*[st.floats(-1e6, 1e6)] * 3))
def test_stands_where_the_convention_puts_him(
    theta: float, phi: float, distance: float, target: tuple[float, ...]
) -> None:
    observer = Observer(theta, phi, distance, target)
    np.testing.assert_allclose(observer.direction, unit(theta, phi), atol=2e-15)
    expected = np.array(target) + distance * unit(theta, phi)
    np.testing.assert_allclose(observer.position, expected, rtol=1e-14, atol=1e-14 * distance + 1e-9)


@pytest.mark.parametrize("theta", [0, 90, 180])
@pytest.mark.parametrize("turns", range(-9, 10))
def test_quarter_turns_are_exact(theta: float, turns: int) -> None:
    right, up, toward = Screen(1, 1, 1, 1).axes(Observer(theta, 90.0 * turns, 1000))
    c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][turns % 4]
    ct, st_ = {0: (1, 0), 90: (0, 1), 180: (-1, 0)}[theta]
    assert toward.tolist() == [st_ * c, st_ * s, ct]
    assert right.tolist() == [ct * c * c + s * s, (ct - 1) * c * s, -st_ * c]
    assert up.tolist() == [(ct - 1) * c * s, ct * s * s + c * c, -st_ * s]


# --- how his screen is turned ----------------------------------------------------------------------------------------


@fixed
@given(thetas, angles)
@example(0.0, 123.0)
@example(1e-7, 211.0)
@example(180.0, 77.0)
def test_view_axes_are_turned_about_the_axis_between_z_and_the_observer(theta: float, phi: float) -> None:
    p = math.radians(phi)
    expected = Rotation.from_rotvec(math.radians(theta) * np.array([-math.sin(p), math.cos(p), 0.0])).as_matrix()
    axes = np.array(Screen(1, 1, 1, 1).axes(Observer(theta, phi, 1.0)))
    np.testing.assert_allclose(axes, expected.T, atol=3e-15)


@fixed
@given(st.floats(0.0, 179.0), angles)
def test_view_axes_are_the_shortest_rotation_that_takes_z_to_the_observer(theta: float, phi: float) -> None:
    """The quaternion (1 + z·t, z × t): it knows the observer's direction only, no angles."""
    t = unit(theta, phi)
    cross = np.cross([0.0, 0.0, 1.0], t)
    shortest = Rotation.from_quat([*cross, 1.0 + t[2]])
    right, up, toward = Screen(1, 1, 1, 1).axes(Observer(theta, phi, 1.0))
    np.testing.assert_allclose(np.array([right, up, toward]), shortest.as_matrix().T, atol=3e-13)
    aligned, _ = Rotation.align_vectors([toward], [[0.0, 0.0, 1.0]])
    assert aligned.magnitude() == pytest.approx(
        Rotation.from_matrix(np.array([right, up, toward]).T).magnitude(), abs=1e-7
    )


@fixed
@given(thetas, angles)
def test_axes_are_right_handed_and_orthonormal(theta: float, phi: float) -> None:
    axes = np.array(Screen(1, 1, 1, 1).axes(Observer(theta, phi, 1.0)))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-14)


def test_the_antipode_is_the_limit_of_the_views_before_it() -> None:
    """At θ = 180° the shortest rotation is not unique; φ chooses, so that a sweep over θ does not jump."""
    for phi in (0.0, 37.0, 90.0, 250.0):
        screen = Screen(1, 1, 1, 1)
        before, at = (np.array(screen.axes(Observer(t, phi, 1.0))) for t in (180.0 - 1e-9, 180.0))
        np.testing.assert_allclose(before, at, atol=1e-10)
        # A half turn about the axis (-sin φ, cos φ, 0) leaves that axis alone.
        axis = np.array([-math.sin(math.radians(phi)), math.cos(math.radians(phi)), 0.0])
        np.testing.assert_allclose(at.T @ axis, axis, atol=1e-15)
        assert at[2].tolist() == [0.0, 0.0, -1.0]


def test_the_xy_plane_stays_put() -> None:
    screen = Screen(1, 1, 1, 1, plane="xy")
    for theta, phi in itertools.product([0, 30, 89.9, 120, 180], [0, 45, 200]):
        np.testing.assert_array_equal(np.array(screen.axes(Observer(theta, phi, 1000))), np.eye(3))


@pytest.mark.parametrize("phi", [0, 17, 90, -90])
def test_the_xy_plane_has_no_area_from_within_it(phi: float) -> None:
    with pytest.raises(ArgumentError, match=r"theta = 90.*plane='view'"):
        Screen(1, 1, 1, 1, plane="xy").axes(Observer(90, phi, 1000))
    Screen(1, 1, 1, 1, plane="xy").axes(Observer(89.999999, phi, 1000))


# --- pixels ----------------------------------------------------------------------------------------------------------


def test_pixel_centres_of_an_uneven_screen_by_hand() -> None:
    screen = Screen(width=6, height=2, columns=3, rows=4)
    assert screen.shape == (4, 3)
    assert screen.x.tolist() == [-2.0, 0.0, 2.0]
    assert screen.y.tolist() == [0.75, 0.25, -0.25, -0.75]  # row 0 is the top
    assert screen.pixel_area == 1.0


@fixed
@given(
    thetas.filter(lambda t: abs(t - 90) > 1e-3),
    angles,
    st.floats(1.0, 1e5),
    st.tuples(*[st.floats(-100, 100)] * 3),
    st.sampled_from(["view", "xy"]),
)
def test_cosine_is_the_scalar_product_of_normal_and_line_of_sight(
    theta: float, phi: float, distance: float, target: tuple[float, float, float], plane: str
) -> None:
    observer, screen = Observer(theta, phi, distance, target), Screen(11.0, 4.0, 5, 3, plane)
    right, up, normal = screen.axes(observer)
    cosine = screen.cosine(observer)
    assert cosine.shape == (3, 5)
    for row, column in itertools.product(range(3), range(5)):
        x, y = (column + 0.5) * 11.0 / 5 - 5.5, 2.0 - (row + 0.5) * 4.0 / 3
        sight = observer.position - (np.array(target) + x * right + y * up)
        expected = abs(sight @ normal) / np.linalg.norm(sight)
        assert cosine[row, column] == pytest.approx(expected, rel=1e-8, abs=1e-10)


def test_rows_and_columns_of_the_cosine_are_not_swapped() -> None:
    """Seen from +X, the right column of an xy screen is nearest to the observer and most inclined away."""
    cosine = Screen(10, 2, 5, 2, plane="xy").cosine(Observer(60, 0, 20))
    assert (np.diff(cosine, axis=1) > 0).all()  # towards the observer, the line of sight is steeper
    assert cosine[0].tolist() == pytest.approx(cosine[1].tolist(), rel=1e-15)
    top_bright = Screen(2, 10, 2, 5, plane="xy").cosine(Observer(60, 90, 20))
    assert (np.diff(top_bright, axis=0) < 0).all()  # row 0 is the top, +Y


def test_a_view_screen_is_faced_squarely_at_its_centre() -> None:
    assert Screen(9, 7, 3, 3).cosine(Observer(35, 110, 50, (1, 2, 3)))[1, 1] == pytest.approx(1.0, abs=1e-15)
    assert Screen(9, 7, 3, 3, "xy").cosine(Observer(35, 110, 50, (1, 2, 3)))[1, 1] == pytest.approx(
        math.cos(math.radians(35)), rel=1e-14
    )


# --- refusals and round trips ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((-1e-9, 0, 1), "theta is -1e-09"),
        ((180.0000001, 0, 1), "theta"),
        ((math.nan, 0, 1), "theta is nan"),
        ((0, math.inf, 1), "phi is inf"),
        ((0, math.nan, 1), "phi is nan"),
        ((0, 0, 0), "distance is 0"),
        ((0, 0, -5), "distance is -5"),
        ((0, 0, math.inf), "distance is inf"),
        ((0, 0, math.nan), "distance is nan"),
        ((0, 0, 1, (0, 0)), "target"),
        ((0, 0, 1, (0, 0, math.nan)), "target"),
        ((0, 0, 1, (0, 0, 0, 0)), "target"),
    ],
)
def test_refuses_an_observer_outside_the_domain(arguments: tuple[object, ...], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        Observer(*arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, 1, 1, 1), "width is 0"),
        ((1, -1, 1, 1), "height is -1"),
        ((math.nan, 1, 1, 1), "width is nan"),
        ((1, math.inf, 1, 1), "height is inf"),
        ((1, 1, 0, 1), "columns is 0"),
        ((1, 1, 1, -3), "rows is -3"),
        ((1, 1, 12.7, 1), "columns is 12.7"),
        ((1, 1, math.nan, 1), "columns is nan"),
        ((1, 1, 1, math.inf), "rows is inf"),
        ((1, 1, 65537, 1), "65536"),
    ],
)
def test_refuses_a_screen_outside_the_domain(arguments: tuple[float, ...], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        Screen(*arguments)  # type: ignore[arg-type]


def test_whole_numbers_of_any_type_count_pixels() -> None:
    screen = Screen(1, 1, np.int32(3), 4.0)  # type: ignore[arg-type]
    assert (screen.columns, screen.rows) == (3, 4)
    assert type(screen.columns) is int
    assert type(screen.rows) is int


def test_an_unknown_plane_is_met_with_the_nearest_name() -> None:
    with pytest.raises(UnknownNameError, match=r"unknown screen plane 'veiw'. Did you mean 'view'\?"):
        Screen(1, 1, 1, 1, "veiw")  # type: ignore[arg-type]


def test_an_observer_survives_json() -> None:
    observer = Observer(12.5, -33.0, 777.0, (1.0, -2.0, 3.5))
    assert observer_from_dict(json.loads(json.dumps(dataclasses.asdict(observer)))) == observer
