"""FRED tables: black anodising as FRED and as Zemax has it, a table made by hand, mistakes."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

HAND = """type bsdf_data
format angles=deg bsdf=value scale=0.5
30 0
0 0 0.4
40 0 0.8
40 90 0.6
40 180 0.2
80 0 0.5
80 90 ---
80 180 0.1
140 0 0.3
140 180 0.1
"""


def test_transmitted_light_along_the_surface_stays_transmitted(tmp_path: Path) -> None:
    """A table that is written as it is, with a row at 90°: that row had been read as all that is reflected."""
    grid = PolarGrid("normal", np.linspace(0.0, 90.0, 19), np.arange(0.0, 360.0, 30.0))
    values = np.full(grid.shape, 0.45 / math.pi)
    slices = tuple(BsdfSlice(light_from(theta, 180.0), values, True, grid=grid) for theta in (0.0, 30.0, 60.0))
    path = tmp_path / "opal.dat"
    et.write_bsdf(path, et.BsdfTable(BsdfData(slices)), format="fred")
    read = et.read_bsdf(path)
    assert read.reflectance([0.0, 30.0, 60.0]).tolist() == [0.0] * 3
    assert read.transmittance([0.0, 30.0, 60.0]) == pytest.approx(np.full(3, 0.45), abs=1e-6)


def test_a_table_made_by_hand(tmp_path: Path) -> None:
    path = tmp_path / "hand.dat"
    path.write_text(HAND)
    data = read_bsdf_data(path)
    back, through = data.slices
    assert data.isotropic
    assert data.mirrored
    assert np.allclose(back.incident, direction(30.0, 180.0))
    at = direction(40.0, [0.0, 90.0, 180.0, 270.0])
    assert back.at(at).tolist() == pytest.approx([0.4, 0.3, 0.1, 0.3])
    assert float(back.at(direction(0.0, 77.0))) == pytest.approx(0.2)
    assert through.transmitted
    assert through.at(direction(40.0, [0.0, 180.0], behind=True)).tolist() == pytest.approx([0.15, 0.05])
    assert any("1 directions were not measured" in complaint.found for complaint in data.complaints)


def test_a_scan_in_the_plane_of_incidence(tmp_path: Path) -> None:
    """exp(−30 |β − β₀|), measured in the plane: the same beside it, and no ring about the normal."""
    beta0 = math.sin(math.radians(45.0))
    lines = ["type bsdf_data", "format angles=deg bsdf=value scale=1", "45 0"]
    for theta, phi in itertools.product(range(0, 90, 1), (0, 180)):
        off = abs((1 if phi == 0 else -1) * math.sin(math.radians(theta)) - beta0)
        lines.append(f"{theta} {phi} {math.exp(-30.0 * off):.9g}")
    path = tmp_path / "plane.dat"
    path.write_text("\n".join(lines) + "\n")
    data = read_bsdf_data(path)
    (one,) = data.slices
    # ∫ exp(−30 r) 2πr dr, but for what little lies beyond the horizon.
    assert one.integral() == pytest.approx(2.0 * math.pi / 900.0, rel=0.02)
    assert any("in the plane of incidence alone" in complaint.found for complaint in data.complaints)


def test_black_anodising_as_zemax_has_it(samples: Path) -> None:
    """The same measurements: where both have values, f agrees but for their interpolation."""
    fred, zemax = (read_bsdf_data(samples / "bsdf" / f"AnoBlackEC1onAlum{end}") for end in ("_fred.txt", ".bsdf"))
    for one in fred.slices:
        (same,) = (other for other in zemax.slices if abs(other.theta - one.theta) < 1e-6)
        at = one.directions[:, (one.grid.radial > 5) & (one.grid.radial < 60)]  # type: ignore[union-attr]
        a, b = one.at(at), same.at(at)
        assert float(np.nanmedian(np.abs(np.log(a / b)))) < 0.1, one.theta


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("angles=deg", "angles=rad", "angles is 'rad'"),
        ("bsdf=value", "bsdf=log", "bsdf is 'log'"),
        ("scale=0.5", "scale=-1", "scale is '-1'"),
        ("scale=0.5", "scale=x", "scale is 'x'"),
        ("30 0\n", "", "without an incidence"),
        ("30 0\n", "30 0\n30 10\n", "an incidence without directions"),
        ("40 0 0.8", "40 0 0.8 1", "neither an incidence"),
        ("40 0 0.8", "40 0 nan", "neither an incidence"),
        ("140 180 0.1\n", "140 180 0.1", "the last line has no end"),
        ("format", "fromat", "there is no 'format'"),
    ],
)
def test_mistakes_are_told(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "wrong.dat"
    path.write_text(HAND.replace(old, new))
    with pytest.raises(FormatError, match=said):
        read_bsdf_data(path)
