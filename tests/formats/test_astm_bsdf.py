"""ASTM text made by hand: grids and scattered points, both sides, colours, mistakes."""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.formats.bsdf.points import projected_solid_angles
from etendue.quantities.bsdf_directions import direction

Array = npt.NDArray[np.float64]


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


def abg(incident: Array, scattered: Array) -> Array:
    """0.0025/(0.001 + |β − β₀|^1.8)."""
    off = np.asarray(scattered)[..., :2] + np.asarray(incident)[:2]
    return np.asarray(0.0025 / (0.001 + np.hypot(off[..., 0], off[..., 1]) ** 1.8))


def scanned(azimuths: tuple[float, ...], *, theta: float = 60.0) -> list[tuple[float, ...]]:
    """The same at directions of some azimuths."""
    incident = direction(theta, 180.0)
    places = [(t, a) for a in azimuths for t in np.arange(0.0 if a == azimuths[0] else 1.0, 88.0)]
    return [(theta, 180.0, t, a, float(abg(incident, direction(t, a)))) for t, a in places]


def test_what_was_measured_in_the_plane_of_incidence_turns_about_the_specular_direction(tmp_path: Path) -> None:
    """A scan in the plane knows all of a lobe that is the same all around in direction cosines, whose share is known."""
    path = tmp_path / "plane.astm"
    path.write_text(text_of(scanned((0.0, 180.0))))
    table = et.read_bsdf(path)
    (one,) = table.data.slices
    beside = direction([60.0, 50.0, 70.0, 20.0], [20.0, -30.0, 10.0, 90.0])
    assert one.at(beside) == pytest.approx(abg(one.incident, beside), rel=0.02)
    share = float(et.bsdf.ABg(a=0.0025, b=0.001, g=1.8).reflectance(60.0))
    assert float(table.reflectance(60.0)) == pytest.approx(share, rel=0.02)
    assert any("in the plane of incidence alone" in str(each) for each in table.complaints)
    # From the one side nothing but the other says what is on the other.
    path.write_text(text_of(scanned((0.0,))))
    assert read_bsdf_data(path).slices[0].at(beside[:3]) == pytest.approx(abg(one.incident, beside[:3]), rel=0.02)
    # With two planes about the normal, the lobe lies between azimuths: four times the light, and that is told.
    path.write_text(text_of(scanned((0.0, 90.0, 180.0, 270.0))))
    assert any("90° apart do not resolve the lobe" in str(each) for each in read_bsdf_data(path).complaints)
    path.write_text(text_of(scanned(tuple(np.arange(0.0, 360.0, 5.0)))))
    assert not read_bsdf_data(path).complaints


def test_directions_that_stand_there_twice_become_their_mean(tmp_path: Path) -> None:
    path = tmp_path / "twice.astm"
    again = [(*row[:4], 3.0 * row[4]) for row in GRID]
    for rows in ([*GRID, *again], [*again, *GRID]):
        path.write_text(text_of(rows))
        data = read_bsdf_data(path)
        assert float(data.slices[0].at(direction(40.0, 0.0))) == pytest.approx(2.0 * 0.15)
        assert [str(each) for each in data.complaints if "several times" in each.found]


@pytest.mark.parametrize("digits", [4, 6, 9])
def test_rounding_puts_no_light_on_the_other_side(tmp_path: Path, digits: int) -> None:
    """Rounded, half a right angle more is behind the surface, and a whole turn more than one."""
    rows = [(30.0, 180.0, t, p, 0.05) for t in np.arange(0.0, 91.0, 10.0) for p in np.arange(0.0, 361.0, 20.0)]
    lines = [",".join([*(f"{math.radians(a):.{digits}g}" for a in row[:4]), repr(row[4])]) for row in rows]
    path = tmp_path / "rounded.astm"
    head = text_of(rows).partition("VARS")[0]
    path.write_text(f"{head}VARS theta_i,phi_i,theta_s,phi_s,BRDF\n" + "\n".join(lines) + "\n")
    (one,) = read_bsdf_data(path).slices
    assert not one.transmitted
    assert one.integral() == pytest.approx(0.05 * math.pi, rel=1e-3)


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
