"""SSDD files made by hand: the three systems of coordinates, offsets, colours, values in binary."""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.quantities.bsdf_directions import direction

Array = npt.NDArray[np.float64]


def block(kind: str, system: str, lists: list[list[float]], values: Array, *, extra: str = "") -> str:
    """`values` of shape (param3, param2, param1 or 1, param0), as the file orders them."""
    lines = [f"DATA_TYPE {kind}", "COLOR_MODEL monochrome", f"PARAM_TYPE {system}_coordinate_system"]
    lines += [extra] if extra else []
    lines += [f"PARAM{k}_LIST " + " ".join(map(str, one)) for k, one in enumerate(lists) if one]
    return "\n".join([*lines, "DATA ascii", *(f"{v:.9g}" for v in values.ravel())]) + "\n"


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "x.ssdd"
    path.write_text("# by hand\nVERSION 0.2\n" + text)
    return path


def test_spherical_coordinates_count_from_where_the_light_comes_from(tmp_path: Path) -> None:
    values = np.zeros((4, 2, 1, 2))
    for k, j, i in np.ndindex(4, 2, 2):
        values[k, j, 0, i] = 0.01 * (1 + k) * j + 0.001 * i + 0.05
    text = block("brdf", "spherical", [[0, 40], [], [0, 60], [0, 90, 180, 270]], values)
    data = read_bsdf_data(written(tmp_path, text))
    (one,) = (one for one in data.slices if one.theta > 1)
    assert np.allclose(one.incident, direction(40.0, 0.0))
    found = one.at(direction(60.0, [0.0, 90.0, 180.0, 270.0]))
    assert found.tolist() == pytest.approx([0.061, 0.071, 0.081, 0.091])


def test_specular_coordinates_turn_from_the_normal(tmp_path: Path) -> None:
    """At incidence 50° the mirrored direction is at 50° on the other side; azimuth 0 leads from it to the normal."""
    values = np.array([0.1, 0.2, 0.3, 0.4])[:, None, None, None] * np.array([0.0, 1.0])[:, None, None] + 0.01
    text = block("brdf", "specular", [[50], [], [0, 20], [0, 90, 180, 270]], values)
    (one,) = read_bsdf_data(written(tmp_path, text)).slices
    towards, away = (one.at(direction(angle, 180.0)) for angle in (30.0, 70.0))
    assert float(towards) == pytest.approx(0.11)
    assert float(away) == pytest.approx(0.31)
    # 90° is on the left of who looks from the mirrored direction to the normal with the surface below: +y.
    s = direction(50.0, 180.0)
    left = math.cos(math.radians(20)) * s + math.sin(math.radians(20)) * np.array([0.0, 1.0, 0.0])
    assert float(one.at(left)) == pytest.approx(0.21)


def test_transmitted_light_is_that_of_the_mirrored_hemisphere(tmp_path: Path) -> None:
    values = np.array([0.1, 0.2, 0.3, 0.4])[:, None, None, None] * np.array([0.0, 1.0])[:, None, None] + 0.01
    text = block("btdf", "specular", [[50], [], [0, 20], [0, 90, 180, 270]], values)
    (one,) = read_bsdf_data(written(tmp_path, text)).slices
    s = direction(50.0, 180.0, behind=True)
    left = math.cos(math.radians(20)) * s + math.sin(math.radians(20)) * np.array([0.0, 1.0, 0.0])
    assert float(one.at(left)) == pytest.approx(0.21)
    assert float(one.at(direction(30.0, 180.0, behind=True))) == pytest.approx(0.11)


def test_offsets_move_the_lobe_to_where_light_is_refracted(tmp_path: Path) -> None:
    """At 45° in glass of 1.5 light goes on at 28.1°: there the table begins."""
    values = np.array([1.0, 0.5, 0.0])[None, :, None, None]
    offset = math.degrees(math.asin(math.sin(math.radians(45)) / 1.5)) - 45.0
    text = block("btdf", "specular", [[45], [], [0, 10, 30], [0], [round(offset, 9)]], values)
    (one,) = read_bsdf_data(written(tmp_path, text)).slices
    at = [float(one.at(direction(45.0 + offset + off, 180.0, behind=True))) for off in (-20.0, 0.0, 10.0)]
    assert at == pytest.approx([0.25, 1.0, 0.5], abs=0.02)


@pytest.mark.parametrize("theta", [0.0, 3.0])
def test_offsets_across_the_normal(tmp_path: Path, theta: float) -> None:
    """The table begins on the near side of the normal; azimuth 0 leads on towards the light, and 90° stays on the left."""
    values = np.array([0.1, 0.2, 0.3, 0.4])[:, None, None, None] * np.array([0.0, 1.0])[:, None, None] + 0.01
    text = block(
        "brdf", "specular", [[theta], [30.0, 120.0], [0, 20], [0, 90, 180, 270], [-8.0]], values.repeat(2, axis=2)
    )
    for one in read_bsdf_data(written(tmp_path, text)).slices:
        phi = one.phi
        middle = direction(8.0 - theta, phi)
        assert float(one.at(middle)) == pytest.approx(0.01, abs=0.004)
        assert float(one.at(direction(28.0 - theta, phi))) == pytest.approx(0.11, abs=0.004)
        assert float(one.at(direction(12.0 + theta, phi + 180.0))) == pytest.approx(0.31, abs=0.004)
        left = math.cos(math.radians(20)) * middle + math.sin(math.radians(20)) * direction(90.0, phi + 90.0)
        assert float(one.at(left)) == pytest.approx(0.21, abs=0.004)


def test_half_vectors(tmp_path: Path) -> None:
    """A function of the half angle, and of φd on both halves of a turn, read back at directions of ours."""
    h, d, p = np.linspace(0, 90, 46), np.linspace(0, 90, 31), np.linspace(0, 360, 73)
    f = 0.2 + 0.1 * np.cos(np.radians(p))[:, None, None] * (d / 90)[:, None] + 0.3 * (h / 90) ** 2
    text = block("brdf", "half_difference", [list(h), [], list(d), list(p)], f[:, :, None, :])
    data = read_bsdf_data(written(tmp_path, text))
    (one,) = (one for one in data.slices if abs(one.theta - 40.0) < 1e-6)
    i = one.incident
    for s in (direction(20.0, 130.0), direction(65.0, 200.0), direction(5.0, 10.0)):
        half = (i + s) / np.linalg.norm(i + s)
        # φd: the light about the half vector, from the plane of half vector and normal; zero away from the normal.
        e = np.cross(np.cross(half, [0.0, 0.0, 1.0]), half)
        e = -e / np.linalg.norm(e)
        phi = math.degrees(math.atan2(float(i @ np.cross(half, e)), float(i @ e)))
        angles = math.degrees(math.acos(half[2])), math.degrees(math.acos(float(i @ half)))
        expected = 0.2 + 0.1 * math.cos(math.radians(phi)) * angles[1] / 90 + 0.3 * (angles[0] / 90) ** 2
        assert float(one.at(s)) == pytest.approx(expected, rel=0.01)


SPECIFICATION = (
    """DATA_TYPE brdf
COLOR_MODEL rgb
PARAM_TYPE half_difference_coordinate_system
REDUCTION_TYPE bilateral_symmetry reciprocity
PARAM0_LIST 0 90
PARAM2_LIST 0 90
PARAM3_LIST 0 90
DATA ascii
# PARAM3: 0
"""
    + 8 * "0 0.0524275 0.159779\n"
    + """
DATA_TYPE btdf
COLOR_MODEL xyz
PARAM_TYPE specular_coordinate_system
REDUCTION_TYPE bilateral_symmetry
PARAM0_LIST 0 90
PARAM2_LIST 0 180
PARAM3_LIST 0 180
DATA ascii
"""
    + 8 * "0.106 0.082 0.011\n"
    + """
DATA_TYPE specular_reflectance
COLOR_MODEL spectrum
WAVELENGTH_LIST 400 450 500 550 600 650 700
PARAM0_LIST 0 90
DATA ascii
"""
    + 2 * "0.05 0.05 0.05 0.05 0.05 0.05 0.05\n"
    + """
DATA_TYPE specular_transmittance
COLOR_MODEL monochrome
PARAM0_LIST 0 90
DATA ascii
0.05
0.05
"""
)


@pytest.mark.slow
def test_four_blocks_in_one_file(tmp_path: Path) -> None:
    bsdf = et.read_bsdf(written(tmp_path, SPECIFICATION))
    diffuse = math.pi * (0.7152 * 0.0524275 + 0.0722 * 0.159779)
    assert float(bsdf.reflectance(30.0)) == pytest.approx(diffuse + 0.05, rel=2e-3)
    assert float(bsdf.transmittance(30.0)) == pytest.approx(math.pi * 0.082 + 0.05, rel=2e-3)
    assert float(bsdf.regular_transmittance(30.0)) == pytest.approx(0.05)


def test_binary_values(tmp_path: Path) -> None:
    head = b"VERSION 0.2\nDATA_TYPE brdf\nCOLOR_MODEL monochrome\nPARAM_TYPE spherical_coordinate_system\n"
    lists = b"PARAM0_LIST 0 50\nPARAM2_LIST 0 45 90\nPARAM3_LIST 0\nDATA binary\n"
    path = tmp_path / "x.ssdd"
    path.write_bytes(head + lists + np.array([0.1, 0.2, 0.1, 0.2, 0.1, 0.2], "<f4").tobytes())
    assert [one.integral() for one in read_bsdf_data(path).slices] == pytest.approx(
        [0.1 * math.pi, 0.2 * math.pi], rel=1e-6
    )
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(FormatError, match="not 6 finite values"):
        read_bsdf_data(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("COLOR_MODEL rgb", "COLOR_MODEL cmyk", "COLOR_MODEL 'cmyk'"),
        ("PARAM_TYPE", "PARAM_KIND", "PARAM_TYPE None"),
        ("_coordinate_system", "_coordinates", "PARAM_TYPE 'half.*It is one of spherical_coordinate_system, specular"),
        ("PARAM0_LIST 0 90\nPARAM2_LIST 0 180", "PARAM0_LIST 90 0\nPARAM2_LIST 0 180", "no list of rising"),
        ("PARAM2_LIST 0 180", "PARAM2_LIST 0 999", "beyond their range"),
        ("0.05\n0.05\n", "0.05\n", "not 2 finite values"),
        ("0.05\n0.05\n", "0.05\n1.5\n", "specular share of 1.5"),
        ("PARAM0_LIST 0 90\nDATA ascii\n0.05\n", "PARAM0_LIST 0 90\nDATA hex\n0.05\n", "ascii or binary"),
        ("DATA_TYPE specular_transmittance", "DATA_TYPE specular_reflectance", "twice"),
    ],
)
def test_mistakes(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(FormatError, match=said):
        read_bsdf_data(written(tmp_path, SPECIFICATION.replace(old, new, 1)))


def test_transmitted_light_over_half_vectors_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedFormatError, match="half vectors"):
        read_bsdf_data(written(tmp_path, SPECIFICATION.replace("DATA_TYPE brdf", "DATA_TYPE btdf", 1)))


@pytest.mark.parametrize("word", ["0.1x", "nan", "1e999"])
@pytest.mark.parametrize("at", [0, 3, 7])
def test_a_bad_value_is_named_with_its_line(tmp_path: Path, word: str, at: int) -> None:
    """Of eight values in lines of their own, with a comment among them: the first is two lines below DATA."""
    text = block("brdf", "specular", [[50], [], [0, 20], [0, 90, 180, 270]], np.full((4, 2, 1, 1), 0.05))
    head, _, values = text.partition("DATA ascii\n")
    rows = values.splitlines()
    rows[at] = f"{word} # here"
    path = written(tmp_path, "\n".join([f"{head}DATA ascii", "# a comment", *rows, ""]))
    with pytest.raises(FormatError, match=f"'{word}' is no finite number") as caught:
        read_bsdf_data(path)
    (line,) = (k for k, text in enumerate(path.read_text().splitlines(), 1) if "# here" in text)
    assert caught.value.place == f"line {line}"


def test_what_is_told_of_a_block_names_the_line_above_its_values(tmp_path: Path) -> None:
    values = np.full((4, 2, 1, 1), -0.05)
    path = written(tmp_path, block("brdf", "specular", [[50], [], [0, 20], [0, 90, 180, 270]], values))
    (line,) = (k for k, text in enumerate(path.read_text().splitlines(), 1) if text == "DATA ascii")
    assert [one.place for one in read_bsdf_data(path).complaints] == [f"below line {line}"]
