"""TracePro surface properties made by hand: the parameters of ABg, tables with both zeros of azimuth, mistakes."""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.formats.bsdf.tracepro_lines import COLUMNS, TABLE_COLUMNS
from etendue.quantities.bsdf_directions import direction

HEAD = """TracePro Surface Property Data
File Name\tC:\\x.txt
TracePro Release: 19 6 0
Database Version: 4 1 0

Name\tPolish
Catalog\tby hand
Description\t
Coating 1
Scatter {scatter}
Interaction 0
Polarization 0
User_Data 0
Solve ABSORP

"""


def row(theta: float, *, phi: float = 0.0, refl: float = 0.0, abg: tuple[float, float, float] = (0, 0, 0)) -> str:
    values = [
        300,
        0.55,
        theta,
        phi,
        0.1,
        0.1,
        refl,
        refl + 0.02,
        0,
        0,
        0,
        0,
        abg[0],
        abg[1],
        0,
        abg[2],
        0,
        0,
        0,
        0,
        0,
        0,
    ]
    return "\t\t".join(map(str, values))


def property_of(scatter: int, rows: list[str], table: list[str] | None = None) -> str:
    text = HEAD.format(scatter=scatter) + "\t".join(COLUMNS) + "\n" + "\n".join(rows) + "\n"
    if table is not None:
        text += "\n[Table_BSDF_Data]\n" + "\t".join(TABLE_COLUMNS) + "\n" + "\n".join(table) + "\n"
    return text


def test_abg_and_specular_shares(tmp_path: Path) -> None:
    path = tmp_path / "polish.txt"
    abg = (0.0025, 0.001, 1.8)
    path.write_text(property_of(1, [row(0, refl=0.80, abg=abg), row(60, refl=0.84, abg=abg)]))
    bsdf = et.read_bsdf(path)
    assert bsdf.name == "Polish"
    assert float(bsdf.evaluate([0, 0, 1], [0, 0, 1])) == pytest.approx(2.5)
    # Polarised shares are averaged; in between it is linear.
    assert bsdf.regular_reflectance([0, 30, 60]).tolist() == pytest.approx([0.81, 0.83, 0.85])
    assert float(bsdf.reflectance(0)) == pytest.approx(0.81 + 0.041344, abs=2e-6)


def table(phis: tuple[float, ...], f: dict[float, float]) -> list[str]:
    rows = []
    for phi in phis:
        for beta in (0.0, 0.3, 0.6):
            rows += [f"300 0.55 20 {phi} {beta} {a} {value * (1 - beta)} 0" for a, value in f.items()]
    return rows


def test_the_floating_axis_stands_at_right_angles_to_the_plane_of_incidence(tmp_path: Path) -> None:
    """Forwards is at +90°, as the manual's drawing has it; 0 is on the right of who looks along the light from above."""
    path = tmp_path / "floating.txt"
    path.write_text(property_of(5, [row(20)], table((0.0,), {0: 0.1, 90: 0.2, 180: 0.05, 270: 0.02})))
    data = read_bsdf_data(path)
    (one,) = data.slices
    assert data.isotropic
    assert not data.mirrored
    # Light goes on towards +x: right is −y.
    sine = math.sin(math.radians(20.0))
    for beta, expected in (((sine + 0.3, 0), 0.2), ((sine, -0.3), 0.1), ((sine - 0.3, 0), 0.02), ((sine, 0.3), 0.05)):
        found = one.at(np.array([*beta, math.sqrt(1.0 - beta[0] ** 2 - beta[1] ** 2)]))
        assert float(found) == pytest.approx(0.7 * expected)


def test_names_of_sections_without_brackets(tmp_path: Path) -> None:
    """As a program writes them whose files TracePro imports: brdf_utils, with a tab at the end of each row."""
    path = tmp_path / "plain.txt"
    text = property_of(5, [row(20) + "\t"], table((0.0,), {0: 0.1, 90: 0.2}))
    path.write_text(text.replace("\n[Table_BSDF_Data]", "Table_BSDF_Data"))
    assert len(read_bsdf_data(path).slices) == 1


def test_the_axis_of_the_sample(tmp_path: Path) -> None:
    path = tmp_path / "fixed.txt"
    rows = [row(20, phi=0.0), row(20, phi=90.0)]
    path.write_text(property_of(5, rows, table((0.0, 90.0), {0: 0.2, 90: 0.1, 180: 0.05, 270: 0.02})))
    data = read_bsdf_data(path)
    assert not data.isotropic
    for one in data.slices:
        # The x axis, wherever the light comes from.
        beta = -one.incident[:2] + [0.3, 0.0]
        assert float(one.at(np.array([*beta, math.sqrt(1.0 - beta @ beta)]))) == pytest.approx(0.7 * 0.2)
    assert np.allclose(data.slices[1].incident, direction(20.0, 270.0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (property_of(1, [row(0)])[:-1], "the last line has no end"),
        (property_of(1, [row(0)]).replace("Scatter 1", "Scatter 12"), "Scatter is '12', not one of 0 to 8"),
        (property_of(1, [row(0)]).replace("Name", "Nomen"), "no 'Name'"),
        (property_of(1, [row(0) + " 1"]), "23 fields; the columns are 22"),
        (property_of(1, [row(0).replace("300", "warm")]), "no number"),
        (property_of(1, [row(100)]), "angle of incidence is not from 0 to 90"),
        (property_of(1, [row(0, refl=1.5)]), "that is no share"),
        (property_of(5, [row(20), row(40)], table((0.0,), {0: 0.1})), "no table for 40° of incidence"),
        (property_of(5, [row(20)], [*table((0.0,), {0: 0.1})[:-1], "300 0.55 20 0 0.6 5 0.1 0"]), "no value, or two"),
        (property_of(5, [row(20)]), "no line with Temperature"),
    ],
)
def test_mistakes_are_told(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "wrong.txt"
    path.write_text(text)
    with pytest.raises(FormatError, match=said):
        read_bsdf_data(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (property_of(8, [row(0)]), "BSDF property"),
        (property_of(1, [row(0)]).replace("Coating 1", "Coating 3"), "grating"),
        (property_of(1, [row(0)]) + "[SAVE-DATA]\n", "several properties"),
    ],
)
def test_what_is_not_read_is_named(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "other.txt"
    path.write_text(text)
    with pytest.raises(UnsupportedFormatError, match=said):
        read_bsdf_data(path)
