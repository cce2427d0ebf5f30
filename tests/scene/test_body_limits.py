"""Bodies and outlines at their limits: what is refused, where faces meet, and how large a film may be."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from etendue.description.files import Files
from etendue.errors import SceneError
from etendue.scene import bodies
from etendue.scene.shapes.outline import signed_area, simple_polygon
from hypothesis import assume, given
from hypothesis import strategies as st

BICONVEX = {"front": {"radius_of_curvature": 5}, "back": {"radius_of_curvature": -5}}


@pytest.mark.parametrize(
    ("kind", "keys", "words"),
    [
        ("Lens", {"radius": 3, "thickness": 1.9, **BICONVEX}, "leaves -0.1 mm at the edge"),
        ("Lens", {"radius": 6, "thickness": 9, **BICONVEX}, "'radius' is 6 mm.* ends at 5 mm"),
        ("Lens", {"radius": 3, "thickness": 0, **BICONVEX}, "thickness: is 0; it must be greater than 0"),
        # r⁴ - r⁶ is 0 on the axis and at the edge, and 4/27 mm at r = √(2/3).
        ("Lens", {"radius": 1, "thickness": 0.1, "front": {"coefficients": [1, -1]}}, "the faces meet 0.816"),
        (
            "Lens",
            {"radius": 1, "thickness": 1, "front": {"radius_of_curvatur": 3}},
            "front.radius_of_curvatur: unknown key",
        ),
        ("Frustum", {"radius_bottom": 0, "radius_top": 0, "height": 1}, "has a width at one end"),
        (
            "PrismaticFilm",
            {"width": 1, "height": 1, "thickness": 1, "pitch": 0.3},
            "no whole number of pitches; 0.9 would",
        ),
        ("PrismaticFilm", {"width": 1, "height": 1, "thickness": 1, "pitch": 1e-6}, "1e[+]06 prisms"),
        ("PrismaticFilm", {"width": 1, "height": 1, "thickness": 1, "pitch": 3}, "0.333333 prisms"),
        ("PrismaticFilm", {"width": 1, "height": 1, "thickness": 1, "pitch": 1, "apex_angle": 180}, "1° to 179°"),
        ("Prism", {"vertices": [(0, 0), (1, 1), (1, 0), (0, 1)], "height": 1}, "sides 0 and 2 touch or cross"),
        ("Prism", {"vertices": [(0, 0), (1, 1)], "height": 1}, "has 2 values; it must have 3 at least"),
        ("Torus", {"major_radius": 1, "minor_radius": 1}, "less than 'major_radius'"),
        ("Ball", {"radius": 1e300}, "at most 1e[+]09"),
    ],
)
def test_bodies_that_cannot_be(kind: str, keys: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        getattr(bodies, kind)(**keys)


def test_the_edge_of_a_lens_ends_where_its_faces_do() -> None:
    """The same numbers to the last bit: the sag of both faces at the radius."""
    lens = bodies.Lens(
        radius=3, thickness=4, front={"radius_of_curvature": 7, "conic": -0.3}, back={"coefficients": [-1e-3]}
    )
    one, other, edge = lens.faces(Files())
    assert edge.shape["z"] == (lens.front.sag(3.0), 4 + lens.back.sag(3.0))
    assert one.shape["r"][1] == other.shape["r"][1] == 3.0
    assert edge.shape["z0"] == -9.0
    assert lens.edge_thickness == edge.shape["z"][1] - edge.shape["z"][0]


@pytest.mark.slow
@given(st.integers(1, 60), st.floats(0.01, 10), st.floats(20, 160), st.floats(0.01, 5))
def test_the_section_of_a_film_is_closed_and_has_its_area(n: int, pitch: float, apex: float, slab: float) -> None:
    """Slab and n triangles; every apex has its angle, and the faces' widths are the sides of the section."""
    film = bodies.PrismaticFilm(width=n * pitch, height=2, thickness=slab, pitch=pitch, apex_angle=apex)
    section = film.profile()
    assert signed_area(section) == pytest.approx(n * pitch * (slab + film.prism_height / 2))
    left, ridge, right = section[4], section[3], section[2]
    a, b = left - ridge, right - ridge
    cosine = a @ b / np.linalg.norm(a) / np.linalg.norm(b)
    assert np.degrees(np.arccos(cosine)) == pytest.approx(apex, abs=1e-6)
    faces = film.faces(Files())
    assert len(faces) == 2 * n + 5
    widths = sorted(face.shape["outline"]["width"] for face in faces if face.shape["outline"]["kind"] == "rectangle")
    sides = np.linalg.norm(np.roll(section, -1, axis=0) - section, axis=1)
    assert widths == pytest.approx(sorted(sides.tolist()))


def test_a_film_of_many_prisms_is_quick() -> None:
    """A thousand prisms, as of a film of 50 mm with 50 µm pitch."""
    assert len(bodies.PrismaticFilm(width=50, height=50, thickness=0.1, pitch=0.05).faces(Files())) == 2005


# --- outlines ----------------------------------------------------------------------------------------------------------


def segments_touch(p: Any, q: Any, r: Any, s: Any) -> bool:
    """Whether two segments with whole coordinates have a point in common, by exact integers."""

    def side(a: Any, b: Any, c: Any) -> int:
        value = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        return (value > 0) - (value < 0)

    def within(a: Any, b: Any, c: Any) -> bool:
        return min(a[0], b[0]) <= c[0] <= max(a[0], b[0]) and min(a[1], b[1]) <= c[1] <= max(a[1], b[1])

    one, two, three, four = side(p, q, r), side(p, q, s), side(r, s, p), side(r, s, q)
    if one != two and three != four:
        return True
    return any(
        z == 0 and within(*ab, c)
        for z, ab, c in ((one, (p, q), r), (two, (p, q), s), (three, (r, s), p), (four, (r, s), q))
    )


def is_simple(corners: list[tuple[int, int]]) -> bool:
    """Every pair of sides: neighbours share one point, others none."""
    n = len(corners)
    sides = [(corners[i], corners[(i + 1) % n]) for i in range(n)]
    for i, j in itertools.combinations(range(n), 2):
        (a, b), (c, d) = sides[i], sides[j]
        if j - i in (1, n - 1):
            outer, shared, inner = (a, b, d) if j - i == 1 else (c, d, b)
            if n == 3 and j - i == 2:
                outer, shared, inner = c, d, b
            cross = (shared[0] - outer[0]) * (inner[1] - shared[1]) - (shared[1] - outer[1]) * (inner[0] - shared[0])
            dot = (shared[0] - outer[0]) * (inner[0] - shared[0]) + (shared[1] - outer[1]) * (inner[1] - shared[1])
            if cross == 0 and dot < 0:
                return False
        elif segments_touch(a, b, c, d):
            return False
    return True


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=3, max_size=8))
def test_simple_polygons_against_every_pair_of_sides(corners: list[tuple[int, int]]) -> None:
    """On a coarse lattice, where touching, overlapping and crossing are common; exact integers on the other side."""
    assume(all(a != b for a, b in zip(corners, corners[1:] + corners[:1], strict=True)))
    try:
        simple_polygon(corners)
        simple = True
    except ValueError:
        simple = False
    assert simple == is_simple(corners)


@pytest.mark.slow
def test_a_polygon_of_many_corners_is_quick() -> None:
    """A circle of 20 000 corners is simple; with two of them exchanged it is not."""
    angle = np.linspace(0, 2 * np.pi, 20_000, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    simple_polygon(circle)
    assert signed_area(circle) == pytest.approx(np.pi, rel=1e-7)
    circle[[100, 101]] = circle[[101, 100]]
    with pytest.raises(ValueError, match="sides 99 and 101 touch or cross"):
        simple_polygon(circle)


def test_area_far_from_the_origin() -> None:
    """The shoelace formula around the first corner: no digits lost at 1e8 mm."""
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) + 1e8
    assert signed_area(square) == 1.0
    assert signed_area(square[::-1]) == -1.0
