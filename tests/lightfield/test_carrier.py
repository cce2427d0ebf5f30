"""Carrier surfaces: charts, sizing from rays, text, and what they refuse."""

from __future__ import annotations

import dataclasses

import etendue as et
import numpy as np
import pytest
from etendue import _core
from etendue.errors import ArgumentError, UnknownNameError
from etendue.lightfield.carrier import SURFACES
from oracles.light_fields import SURFACES as SPECIMENS

EVERY = pytest.mark.parametrize("name", SPECIMENS)
CLOSED = ("sphere", "cylinder", "cylinder along x", "box")


def bundle(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    position = rng.normal(size=(n, 3)) * [0.5, 0.8, 0.4] + [0.2, 0.1, 0.3]
    direction = rng.normal([0.2, -0.1, 0.3], size=(n, 3))
    return position, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def test_every_surface_is_tried() -> None:
    assert {type(surface) for surface in SPECIMENS.values()} == set(SURFACES.values())
    assert {type(SPECIMENS[name]) for name in CLOSED} == {et.Sphere, et.Cylinder, et.Box}


@EVERY
def test_the_text_of_a_surface_gives_the_surface(name: str) -> None:
    """To twelve digits, and exactly where these are all that there are."""
    surface = SPECIMENS[name]
    again = et.parse_surface(surface.spec)
    assert type(again) is type(surface)
    assert et.parse_surface(again.spec) == again
    for part, there in zip(surface.parts(), again.parts(), strict=True):
        assert there.name == part.name
        for at, found in ((part.centre, there.centre), (part.axes, there.axes), (part.size, there.size)):
            np.testing.assert_allclose(found, at, rtol=1e-11, atol=0)


def test_a_cylinder_along_another_axis_is_that_along_z_turned() -> None:
    """Rays and cylinder turned together, x → y → z → x: each line leaves the same part at the same place and direction."""
    position, direction = bundle(4000, 7)
    along_z = et.Cylinder(radius=0.9, bottom=-0.6, top=1.1, centre=(0.2, -0.3))
    owner, at = _core.cross_parts([p.core() for p in along_z.parts()], position, direction)
    assert (np.bincount(owner + 1, minlength=4) > 100).all()
    for turns, axis, centre in ((1, "x", (0.2, -0.3)), (2, "y", (-0.3, 0.2))):
        turned = et.Cylinder(radius=0.9, bottom=-0.6, top=1.1, centre=centre, axis=axis)
        x, k = (np.ascontiguousarray(np.roll(v, turns, axis=1)) for v in (position, direction))
        owner_there, there = _core.cross_parts([p.core() for p in turned.parts()], x, k)
        np.testing.assert_array_equal(owner_there, owner)
        np.testing.assert_allclose(there[owner >= 0], at[owner >= 0], atol=1e-12)


@pytest.mark.parametrize("towards", [(0.3, -0.5, 0.7), (0, 2, 0), (-1, 0.2, -0.9), (0, 0, -3), (1e-4, 0, -1)])
def test_a_flat_surface_that_looks_aside_is_the_upright_one_turned(towards: tuple[float, float, float]) -> None:
    """Rays and surface turned together, by Rodrigues' formula: a line leaves the same part at the same place and direction.

    The normal of its first part is the direction itself, and what is open is sized as it is for upright rays.
    """
    position, direction = bundle(4000, 9)
    rays = et.RaySet(position, direction, np.ones(4000))
    unit = np.array(towards) / np.linalg.norm(towards)
    axis = np.cross([0, 0, 1], unit)
    about = axis if axis.any() else [0.0, 1.0, 0.0]
    turned = rays.rotated(about, float(np.degrees(np.arctan2(np.linalg.norm(axis), unit[2]))))
    plane = et.Plane(0.7, 2.5, 1.5, (0.1, -0.4), (0.2, -0.1, 0.3, 0.0), 2, 9.0)
    for upright in (plane, et.Disk(radius=1.3, z=-0.2, centre=(0.5, 1 / 7))):
        there = dataclasses.replace(upright, towards=towards)
        np.testing.assert_allclose(there.parts()[0].axes[2], unit, atol=1e-15)
        owner, at = _core.cross_parts([p.core() for p in upright.parts()], rays.position, rays.direction)
        assert (owner >= 0).mean() > 0.3
        parts = [p.core() for p in there.parts()]
        owner_there, at_there = _core.cross_parts(parts, turned.position, turned.direction)
        assert np.count_nonzero(owner_there != owner) <= 1  # a line at an edge, by rounding
        same = (owner >= 0) & (owner == owner_there)
        np.testing.assert_allclose(at_there[same], at[same], atol=1e-9)
    for spec in ("plane:z=0.4", "disk:z=0.4"):
        sized, own = (et.parse_surface(spec).sized_for(rays), et.parse_surface(_aside(spec, towards)).sized_for(turned))
        assert not own.open_dimensions
        for part, mine in zip(sized.parts(), own.parts(), strict=True):
            np.testing.assert_allclose(mine.size, part.size, rtol=1e-9)


def _aside(spec: str, towards: tuple[float, float, float]) -> str:
    return f"{spec},towards={'/'.join(map(str, towards))}"


def test_a_direction_is_one_of_three_numbers_with_a_length() -> None:
    assert et.Disk(radius=1, towards=(0, 0, 2)) == et.Disk(radius=1)
    for wrong, told in (((0, 0, 0), "has no length"), ((1, 0), "give 3 numbers"), ("up", "numbers")):
        with pytest.raises(ArgumentError, match=told):
            et.Plane(towards=wrong)  # type: ignore[arg-type]


def test_an_axis_that_there_is_none_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(UnknownNameError, match="axis of a cylinder"):
        et.parse_surface("cylinder:radius=1,axis=w")
    for axis in ("Z", None, 2):
        with pytest.raises(UnknownNameError, match="axis"):
            et.Cylinder(radius=1, axis=axis)  # type: ignore[arg-type]


def test_text_is_no_length() -> None:
    with pytest.raises(ValueError, match="Disk: radius is 'wide'"):
        et.Disk(radius="wide")  # type: ignore[arg-type]


@pytest.mark.parametrize("off", [0.0, 12.3, -10_000.03, 2.5e6])
def test_messages_tell_where_a_small_surface_is(off: float) -> None:
    """The text, read again: lengths to four digits, and places to less than a hundredth of the size, however far off."""
    for surface in (
        et.Plane(z=off, width=1.2344, height=0.7, centre=(-off, 2 * off)),
        et.Cylinder(radius=1.2344, bottom=off, top=off + 1, centre=(off, 0)),
    ):
        told = et.parse_surface(surface.told)
        assert told.parts()[0].size[0] == pytest.approx(1.234, abs=1e-12)
        np.testing.assert_allclose(told.parts()[0].centre, surface.parts()[0].centre, atol=0.01, rtol=0)


@EVERY
def test_axes_are_right_handed_and_coordinates_lead_back_to_the_ray(name: str) -> None:
    position, direction = bundle(4000, 1)
    parts = SPECIMENS[name].parts()
    for part in parts:
        axes = np.array(part.axes)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
        assert np.linalg.det(axes) > 0
    owner, at = _core.cross_parts([p.core() for p in parts], position, direction)
    assert 0.05 < (owner >= 0).mean() <= 1.0
    for index, part in enumerate(parts):
        mine = owner == index
        points, directions = _core.rays_of_part(part.core(), np.ascontiguousarray(at[mine]))
        np.testing.assert_allclose(directions, direction[mine], atol=1e-9)
        # The point lies on the ray's line.
        off = np.linalg.norm(np.cross(points - position[mine], direction[mine]), axis=1)
        assert off.max(initial=0) < 1e-9


@pytest.mark.parametrize("name", CLOSED)
def test_whatever_starts_inside_a_closed_surface_leaves_it(name: str) -> None:
    surface = SPECIMENS[name]
    inside = np.mean([part.centre for part in surface.parts()], axis=0) + np.array([0.1, -0.05, 0.02])
    rng = np.random.default_rng(2)
    direction = rng.normal(size=(5000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    owner, _ = _core.cross_parts([p.core() for p in surface.parts()], np.tile(inside, (5000, 1)), direction)
    assert (owner >= 0).all()
    assert len(set(owner)) == len(surface.parts())


@pytest.mark.parametrize("spec", [*SURFACES, "cylinder:axis=x", "cylinder:axis=y,centre=0.5/0"])
def test_open_dimensions_are_taken_from_the_rays(spec: str) -> None:
    rng = np.random.default_rng(3)
    n = 40_000
    x = np.column_stack([rng.uniform(-2, 3, n), rng.uniform(-1, 1, n), np.zeros(n)])
    u, phi = rng.uniform(0, 0.9, n), rng.uniform(0, 2 * np.pi, n)
    k = np.column_stack([np.sqrt(u) * np.cos(phi), np.sqrt(u) * np.sin(phi), np.sqrt(1 - u)])
    rays = et.RaySet(x, k, np.ones(n))
    sized = et.parse_surface(spec).sized_for(rays)
    assert not sized.open_dimensions
    owner, _ = _core.cross_parts([p.core() for p in sized.parts()], x, k)
    assert (owner < 0).mean() <= 5e-4
    if isinstance(sized, et.Plane):
        assert sized.area == pytest.approx(10, rel=1e-3)


def test_a_few_strays_do_not_blow_a_plane_up() -> None:
    rng = np.random.default_rng(4)
    n = 200_000
    x = np.column_stack([rng.uniform(-1, 1, (n, 2)), np.zeros(n)])
    x[:10] *= 500
    rays = et.RaySet(x, np.tile([0, 0, 1.0], (n, 1)), np.ones(n))
    sized = et.Plane(z=0).sized_for(rays)
    assert sized.width is not None
    assert 1.9 < sized.width < 2.1


@pytest.mark.parametrize(
    "spec", ["plane:width=2.5", "plane:height=1.5", "plane:width=2,height=1", "box:width=2,height=1"]
)
def test_a_surface_of_stated_size_lies_where_most_light_is(spec: str) -> None:
    """A bright die of 2 × 1 mm at (3, -1), and beside it, over ten times its size, half as much light in as many rays."""
    rng = np.random.default_rng(5)
    n = 20_000
    die = np.column_stack([rng.uniform(2, 4, n), rng.uniform(-1.5, -0.5, n)])
    wide = rng.uniform(-10, 20, (n, 2))
    rays = et.RaySet(
        np.column_stack([np.vstack([die, wide]), np.zeros(2 * n)]),
        np.tile([0, 0, 1.0], (2 * n, 1)),
        np.repeat([2.0, 1.0], n),
    )
    sized = et.parse_surface(spec).sized_for(rays)
    assert isinstance(sized, et.Plane | et.Box)
    assert sized.centre is not None
    for name, c, of_die, of_all, size in zip(("width", "height"), sized.centre, (3, -1), (5, 5), (2, 1), strict=False):
        # The die is found to where its outermost rays, or those beside it, lie: some of 1e4 per mm.
        expected, room = (
            (of_all, 0.02) if f"{name}=" not in spec else (of_die, getattr(sized, name) / 2 - size / 2 + 0.01)
        )
        assert abs(c - expected) <= room


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: et.Plane(width=-1), "length above 0"),
        (lambda: et.Disk(radius=float("nan")), "finite"),
        (lambda: et.Cylinder(radius=1, bottom=2, top=1), "not above bottom"),
        (lambda: et.Dome(radius=1, window=2), "window"),
        (lambda: et.Hemisphere(radius=1, centre=(0, 0)), "3 coordinates"),
        (lambda: et.Plane().parts(), "open"),
        (lambda: et.parse_surface("plane:z=high"), "number"),
        (lambda: et.parse_surface("plane:z"), "no value"),
        (lambda: et.parse_surface("plane:z=1,z=2"), "twice"),
        (lambda: et.parse_surface("cylinder:ends=maybe"), "true or false"),
        (lambda: et.Plane().sized_for(et.RaySet([[0, 0, 0]], [[0, 0, -1.0]], [1.0])), r"towards \+Z"),
        (lambda: et.Plane().sized_for(et.RaySet([[0, 0, 0]], [[0, 0, 1.0]], [0.0])), "no flux"),
    ],
)
def test_senseless_surfaces_are_refused(make: object, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        make()  # type: ignore[operator]


def test_unknown_names_suggest_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'dome'"):
        et.parse_surface("dom:radius=1")
    with pytest.raises(UnknownNameError, match="Did you mean 'radius'"):
        et.parse_surface("dome:radios=1")
