"""ASTM text made by hand: grids and scattered points, both sides, colours, mistakes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.formats.bsdf.points import projected_solid_angles
from etendue.quantities.bsdf_data import direction


def text_of(rows: list[tuple[float, ...]], *, values: str = "BRDF", count: int | None = None) -> str:
    """Angles in degrees become radians."""
    lines = [",".join([*(repr(math.radians(a)) for a in row[:4]), *(repr(v) for v in row[4:])]) for row in rows]
    points = len(rows) if count is None else count
    head = f"LAB_NAME somewhere\nSAMPLE_NAME black anodised\nAPERTURE 1.6\nNUM_POINTS {points}\n"
    return head + f"VARS theta_i,phi_i,theta_s,phi_s,{values}\n" + "\n".join(lines) + "\n"


GRID = [
    (30.0, 180.0, theta, phi, 0.1 + 0.001 * theta + 0.01 * (phi == 0))
    for theta in (10.0, 40.0, 70.0)
    for phi in (0.0, 90.0, 180.0, 270.0)
]


def test_a_grid_and_the_other_side_of_the_normal(tmp_path: Path) -> None:
    path = tmp_path / "hand.astm"
    # θs runs through the normal: −40° at φ = 0 is 40° at 180°.
    path.write_text(text_of([*GRID, (30.0, 180.0, 150.0, 0.0, 0.02), (30.0, 180.0, 150.0, 180.0, 0.03)]))
    data = read_bsdf_data(path)
    back, through = data.slices
    assert data.name == "black anodised"
    assert data.facts["APERTURE"] == "1.6"
    assert np.allclose(back.incident, direction(30.0, 180.0))
    assert float(back.at(direction(40.0, 0.0))) == pytest.approx(0.15)
    assert float(back.at(direction(40.0, 180.0))) == pytest.approx(0.14)
    assert through.transmitted
    assert float(through.at(direction(30.0, 180.0, behind=True))) == pytest.approx(0.03)
    path.write_text(text_of([(30.0, 180.0, t, 0.0, 0.1 + t / 1000) for t in (-60.0, -30.0, 30.0, 60.0)]))
    (one,) = read_bsdf_data(path).slices
    assert float(one.at(direction(60.0, 180.0))) == pytest.approx(0.04)
    assert float(one.at(direction(60.0, 0.0))) == pytest.approx(0.16)


def test_scattered_points_stand_for_what_is_near(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    angles = np.column_stack([np.degrees(np.arcsin(np.sqrt(rng.uniform(0, 0.999, 400)))), rng.uniform(0, 360, 400)])
    path = tmp_path / "scattered.astm"
    path.write_text(text_of([(20.0, 180.0, t, p, 0.25) for t, p in angles]))
    (one,) = read_bsdf_data(path).slices
    assert one.points is not None
    assert one.integral() == pytest.approx(0.25 * math.pi, rel=1e-6)
    # Twice as dense, half as much each.
    assert float(projected_solid_angles(one.points).mean()) == pytest.approx(math.pi / 400)


def test_colours(tmp_path: Path) -> None:
    path = tmp_path / "colours.astm"
    path.write_text(text_of([(*row, row[4] / 2) for row in GRID], values="465nm,550nm"))
    assert read_bsdf_data(path).wavelengths == (465.0, 550.0)
    path.write_text(text_of([(*row[:4], 1.0, row[4], 2.0) for row in GRID], values="X,Y,Z"))
    assert float(read_bsdf_data(path).slices[0].at(direction(40.0, 0.0))) == pytest.approx(0.15)
    path.write_text(text_of([(*row[:4], 1.0, row[4], 2.0) for row in GRID], values="R,G,B"))
    with pytest.raises(UnsupportedFormatError, match="R, G, B"):
        read_bsdf_data(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (text_of(GRID)[:-1], "the last line has no end"),
        (text_of(GRID, count=99), "12 points; NUM_POINTS is '99'"),
        (text_of(GRID).replace("NUM_POINTS 12", "NUM_POINTS many"), "NUM_POINTS is 'many'"),
        (text_of(GRID).replace(",0.11", ",nan", 1), "finite numbers"),
        (text_of([(90.0, 180.0, 20.0, 0.0, 0.1)]), "along the surface"),
        (text_of([(600.0, 180.0, 20.0, 0.0, 0.1)]), "beyond a turn"),
        (text_of(GRID, values="BRDF,BRDF"), "VARS are"),
    ],
)
def test_mistakes_are_told(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "wrong.astm"
    path.write_text(text)
    with pytest.raises(FormatError, match=said):
        read_bsdf_data(path)
