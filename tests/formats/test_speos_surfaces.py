"""Speos surfaces made by hand: .brdf, .scattering, .simplescattering, .coated."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError, UnsupportedFormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from oracles.bsdf_files import COATED, SCATTERING, SIMPLE

BRDF = """OPTIS - brdf surface file v8.0
0
a comment
9
two
lines
1 1
1
1 2
40
400 700
80
2 3
\t0 90 360
0 2 2 2
90 4 3 2
50
2 2
\t0 360
0 1 1
90 1 1
10
2 2
\t0 360
90 1 1
180 1 1
20
2 2
\t0 360
90 3 3
180 3 3
End of file
"""


def test_brdf_by_wavelength(tmp_path: Path) -> None:
    path = tmp_path / "x.brdf"
    path.write_text(BRDF)
    data = read_bsdf_data(path)
    assert data.wavelengths == (400.0, 700.0)
    blue, red, through_blue, through_red = data.slices
    assert [one.integral() for one in (blue, red, through_blue, through_red)] == pytest.approx([0.8, 0.5, 0.1, 0.2])
    assert np.allclose(blue.incident, direction(40.0, 180.0))
    on, across = (float(blue.at(direction(90.0 - 1e-6, azimuth))) for azimuth in (0.0, 90.0))
    assert on / across == pytest.approx(4.0 / 3.0, rel=1e-5)
    assert float(red.at(direction(30.0, 70.0))) == pytest.approx(0.5 / math.pi)
    assert through_red.transmitted
    assert float(through_red.at(direction(30.0, 70.0, behind=True))) == pytest.approx(0.2 / math.pi)


def test_what_brdf_files_state_is_kept_beside_what_their_tables_add_up_to(tmp_path: Path) -> None:
    """The flat tables of transmitted light, of 1 and 3, add up to π and 3π: 10 and 20 % are stated."""
    path = tmp_path / "x.brdf"
    path.write_text(BRDF)
    data = read_bsdf_data(path)
    assert [one.stated for one in data.slices] == pytest.approx([0.8, 0.5, 0.1, 0.2])
    (told,) = data.complaints
    assert told.place == "40° of incidence, transmission, 700 nm"
    factors = re.search(r"adds up to (\S+): values are scaled by (\S+); at other places by (\S+) to (\S+)$", told.found)
    assert factors is not None
    raw, farthest, least, most = map(float, factors.groups())
    assert (raw, farthest) == pytest.approx((3.0 * math.pi, 0.2 / (3.0 * math.pi)), rel=1e-5)
    assert least == farthest
    # At 400 nm, of light that is reflected, f rises from 2 to 3 and 4 at the rim: it is no more than at 700 nm, half of 1.
    assert most == pytest.approx(0.5 / math.pi, rel=1e-5)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("1 1\n1\n1 2", "0 0\n1\n1 2", "neither"),
        ("\n80\n", "\n180\n", "a share of 180"),
        ("400 700", "700 400", "do not rise"),
        ("End of file\n", "", "End of file"),
        ("1 1\n1\n1 2", "1 1\n2\n1 2", "type of values is 2"),
    ],
)
def test_mistakes_of_brdf_files(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "x.brdf"
    path.write_text(BRDF.replace(old, new, 1))
    with pytest.raises(FormatError, match=said):
        read_bsdf_data(path)


def test_colours_of_brdf_files_are_written_and_read(tmp_path: Path) -> None:
    source = tmp_path / "x.brdf"
    source.write_text(BRDF)
    first = et.read_bsdf(source)
    et.write_bsdf(tmp_path / "y.brdf", first)
    second = et.read_bsdf(tmp_path / "y.brdf")
    assert second.wavelengths == (400.0, 700.0)
    for wavelength in (400.0, 550.0, 700.0):
        one, other = (bsdf.reflectance(40.0, wavelength=wavelength) for bsdf in (first, second))
        assert float(one) == pytest.approx(float(other), rel=1e-6)


@pytest.mark.slow
def test_scattering_by_angle_and_wavelength(tmp_path: Path) -> None:
    path = tmp_path / "x.scattering"
    path.write_text(SCATTERING)
    bsdf = et.read_bsdf(path)
    assert bsdf.name == "made by hand"
    at = {"wavelength": 400.0}
    # At 0° and 400 nm: 30 % mirrored, 20 % straight on, 20 % and 10 % Lambertian.
    assert float(bsdf.regular_reflectance(0.0, **at)) == pytest.approx(0.3)
    assert float(bsdf.regular_transmittance(0.0, **at)) == pytest.approx(0.2)
    assert float(bsdf.reflectance(0.0, **at)) == pytest.approx(0.5)
    # At 600 nm a Gaussian of 20 %, 10° wide.
    assert float(bsdf.reflectance(0.0, wavelength=600.0)) == pytest.approx(0.2, rel=1e-3)
    assert float(bsdf.reflectance(45.0, wavelength=600.0)) == pytest.approx(0.2, rel=1e-3)
    assert float(bsdf.transmittance(45.0, wavelength=600.0)) == pytest.approx(0.2, rel=1e-3)


def test_lobes_are_as_wide_as_stated(tmp_path: Path) -> None:
    """Half of the intensity at half of the width: 15° in the plane of incidence, 2.5° across it."""
    path = tmp_path / "x.scattering"
    path.write_text(SCATTERING)
    (one,) = (s for s in read_bsdf_data(path).slices if s.wavelength == 600.0 and s.theta > 40 and not s.transmitted)

    def intensity(d: np.ndarray) -> float:
        return float(one.at(d)) * float(d[2])

    s = direction(45.0, 0.0)
    across = math.cos(math.radians(2.5)) * s + math.sin(math.radians(2.5)) * np.array([0.0, 1.0, 0.0])
    peak = intensity(s)
    for d in (direction(30.0, 0.0), direction(60.0, 0.0), across):
        assert intensity(d) / peak == pytest.approx(0.5, rel=0.02)


@pytest.mark.slow
def test_simple_scattering(tmp_path: Path) -> None:
    """What is neither Lambertian nor Gaussian is specular: 0.9 · (60 %, 30 %, 10 %)."""
    path = tmp_path / "x.simplescattering"
    path.write_text(SIMPLE)
    bsdf = et.read_bsdf(path)
    for theta in (0.0, 30.0, 60.0):
        assert float(bsdf.reflectance(theta)) == pytest.approx(0.9, rel=2e-3)
        assert float(bsdf.regular_reflectance(theta)) == pytest.approx(0.09)
    # Far from the lobe there is only Lambert.
    far = float(bsdf.evaluate(direction(60.0, 0.0), direction(10.0, 0.0)))
    assert far == pytest.approx(0.9 * 0.6 / math.pi, rel=1e-3)


@pytest.mark.slow
def test_simple_scattering_of_both_sides(tmp_path: Path) -> None:
    path = tmp_path / "x.simplescattering"
    head = "\n".join(SIMPLE.splitlines()[:2])
    path.write_text(f"{head}\nBoth\n\n10 20 40 30 50\n4 8\n0\n35\n")
    bsdf = et.read_bsdf(path)
    assert float(bsdf.reflectance(20.0)) == pytest.approx(0.9 * 0.35, rel=1e-3)
    assert float(bsdf.transmittance(20.0)) == pytest.approx(0.9 * 0.65, rel=1e-3)
    assert float(bsdf.regular_transmittance(20.0)) == pytest.approx(0.9 * 0.65 * 0.1)
    path.write_text(f"{head}\nBoth\n\n10 20 40 30 50\n4 8\n1\n")
    with pytest.raises(UnsupportedFormatError, match="Fresnel"):
        read_bsdf_data(path)


def test_coated(tmp_path: Path) -> None:
    """The mean of two lines, one for each polarisation."""
    path = tmp_path / "x.coated"
    path.write_text(COATED)
    bsdf = et.read_bsdf(path)
    assert float(bsdf.regular_reflectance(50.0, wavelength=480.0)) == pytest.approx(0.123)
    assert float(bsdf.regular_transmittance(50.0, wavelength=480.0)) == pytest.approx(0.877)
    assert float(bsdf.regular_reflectance(0.0, wavelength=780.0)) == pytest.approx(0.257)
    assert any("straight on" in str(complaint) for complaint in bsdf.complaints)


@pytest.mark.parametrize(
    ("text", "old", "new", "said"),
    [
        (COATED, "31.9\t68.1", "31.9\t78.1", "add up to 110"),
        (COATED, "50\t11.3", "-5\t11.3", "do not rise"),
        (COATED, "90\t100\t0", "90\t100", "words follow"),
        (SCATTERING, "45\t0\t0", "45\t0\t101", "101 %"),
        (SCATTERING, "\t0\t0\t30\t5\t", "\t0\t0\t300\t5\t", "300°"),
        (SCATTERING, "\t400\t\t600", "\t600\t\t400", "do not rise"),
        (COATED, "4 3\n", "40 3\n", "words follow"),
        (SCATTERING, "3 2\n", "60 2\n", "words follow"),
        (SIMPLE, "Reflection", "Reflexion", "not one of"),
        (SIMPLE, "10 60 30 12", "10 80 30 12", "more than 100"),
        (SIMPLE, "12\n", "12\n13\n", "goes on"),
        (SIMPLE, "12\n", "12", "no end"),
    ],
)
def test_mistakes(tmp_path: Path, text: str, old: str, new: str, said: str) -> None:
    path = tmp_path / "x"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FormatError, match=said):
        read_bsdf_data(path)


COLOURED = et.bsdf.Mixed(
    specular_reflectance={"angle": [10, 80], "wavelength": [450, 650], "values": [[0.05, 0.1], [0.3, 0.2]]},
    specular_transmittance={"angle": [0, 30, 90], "values": [0.2, 0.1, 0.0]},
    diffuse_reflectance={"wavelength": [400, 500, 700], "values": [0.3, 0.2, 0.35]},
    diffuse_transmittance=0.15,
)


@pytest.mark.parametrize("extension", [".scattering", ".coated", ".simplescattering"])
def test_shares_are_written_and_read(tmp_path: Path, extension: str) -> None:
    """At nodes, between them and beyond them, for each of the four ways of light."""
    bsdf = {
        ".scattering": COLOURED,
        ".coated": COLOURED.replace(diffuse_reflectance=0.0, diffuse_transmittance=0.0),
        ".simplescattering": et.bsdf.Mixed(
            specular_reflectance=0.05, specular_transmittance=0.1, diffuse_reflectance=0.3, diffuse_transmittance=0.45
        ),
    }[extension]
    assert et.write_bsdf(tmp_path / f"x{extension}", bsdf) == ()
    again = et.read_bsdf(tmp_path / f"x{extension}")
    assert et.write_bsdf(tmp_path / f"y{extension}", again) == ()
    twice = et.read_bsdf(tmp_path / f"y{extension}")
    for theta in (0.0, 7.0, 30.0, 55.0, 85.0):
        for wavelength in (390.0, 450.0, 520.0, 700.0):
            for way in ("reflectance", "transmittance", "regular_reflectance", "regular_transmittance"):
                one, *others = (float(getattr(b, way)(theta, wavelength=wavelength)) for b in (bsdf, again, twice))
                assert others == pytest.approx([one, one], abs=1e-11), (theta, wavelength, way)
    for complaint in again.complaints:
        assert "straight on" in str(complaint)


@pytest.mark.slow
def test_lobes_of_scattering_files_are_written_as_they_were_read(tmp_path: Path) -> None:
    """The words of the file that stand for light: shares in per cent, and widths where there is some, up to 45°."""
    source, copy = tmp_path / "x.scattering", tmp_path / "y.scattering"
    source.write_text(SCATTERING)
    bsdf = et.read_bsdf(source)
    assert et.write_bsdf(copy, bsdf) == ()
    first, second = (np.array(path.read_text().split()[10:52], float) for path in (source, copy))
    lit = first > 0.0
    assert second[lit] == pytest.approx(first[lit], rel=1e-8)
    # Widths of lobes without light are those to which the reader widens them.
    assert second[~lit].max() <= 0.01
    again = et.read_bsdf(copy)
    assert len(again.data.slices) == len(bsdf.data.slices)
    for one, other in zip(bsdf.data.slices, again.data.slices, strict=True):
        assert other.values == pytest.approx(one.values, rel=1e-7, abs=1e-9)


@pytest.mark.slow
def test_lobes_of_a_simple_surface_in_a_file_by_angle(tmp_path: Path) -> None:
    """0.9 · (60 %, 30 %, 10 %) at all angles, 12° wide; what is mirrored at grazing incidence leaves room for it."""
    path = tmp_path / "x.simplescattering"
    path.write_text(SIMPLE)
    simple = et.read_bsdf(path)
    assert et.write_bsdf(tmp_path / "y.scattering", simple) == ()
    again = et.read_bsdf(tmp_path / "y.scattering")
    assert again.incidences == simple.incidences
    pair = direction(50.0, 180.0), direction([45.0, 50.0, 60.0, 70.0], [0.0, 20.0, 300.0, 100.0])
    assert again.evaluate(*pair) == pytest.approx(simple.evaluate(*pair), rel=1e-6)
    grazing = {"angle": [0, 85, 90], "values": [0.0, 0.0, 0.735]}
    data = dataclasses.replace(simple.data, components=({"kind": "mixed", "specular_reflectance": grazing},))
    et.write_bsdf(tmp_path / "z.scattering", et.BsdfTable(data))
    words = (tmp_path / "z.scattering").read_text().split()[-11:]
    assert list(map(float, words)) == pytest.approx([90, 73.5, 0, 0, 0, 26.5, 0, 12, 0, 12, 0], abs=1e-6)
    assert len(read_bsdf_data(tmp_path / "z.scattering").slices) == 7


def test_lobes_that_speos_does_not_describe_are_refused(tmp_path: Path) -> None:
    """One value 0.1 % off; kinks of other shares between the lobes; formats without lobes."""
    path = tmp_path / "x.simplescattering"
    path.write_text(SIMPLE)
    data = read_bsdf_data(path)
    one = data.slices[2]
    values = one.values.copy()
    values[3, 10] *= 1.001
    bent = {"kind": "mixed", "diffuse_reflectance": {"angle": [0, 33, 90], "values": [0.1, 0.2, 0.1]}}
    for slices, components, name in (
        ([dataclasses.replace(one, values=values)], data.components, "y.scattering"),
        ([one], (bent,), "y.scattering"),
        ([one], data.components, "y.simplescattering"),
        ([one], (), "y.coated"),
    ):
        with pytest.raises(ArgumentError, match="write"):
            et.write_bsdf(tmp_path / name, et.BsdfTable(BsdfData(slices, components)))
        assert not (tmp_path / name).exists()


@pytest.mark.parametrize(
    "white", [{"reflectance": 0.8}, {"reflectance": 0.0, "transmittance": 0.6}, {"reflectance": 0.0}]
)
def test_simple_surfaces_of_one_side(tmp_path: Path, white: dict[str, float]) -> None:
    bsdf = et.bsdf.Lambertian(**white)
    et.write_bsdf(tmp_path / "x.simplescattering", bsdf)
    again = et.read_bsdf(tmp_path / "x.simplescattering")
    for way in ("reflectance", "transmittance", "regular_reflectance"):
        assert float(getattr(again, way)(30.0)) == pytest.approx(float(getattr(bsdf, way)(30.0)), abs=1e-12)


@pytest.mark.parametrize(
    ("name", "bsdf", "said"),
    [
        ("x.coated", et.bsdf.Lambertian(reflectance=0.5), r"write it as \.scattering"),
        ("x.simplescattering", COLOURED, "the same shares at all angles"),
        ("x.scattering", et.bsdf.Gaussian(peak=1.0, sigma=0.2), r"\.anisotropicbsdf"),
        ("x.coated", et.bsdf.Interface(), "more than that"),
    ],
)
def test_what_shares_cannot_hold_is_refused_and_nothing_is_left(
    tmp_path: Path, name: str, bsdf: et.Bsdf, said: str
) -> None:
    with pytest.raises(ArgumentError, match=said):
        et.write_bsdf(tmp_path / name, bsdf)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", [BRDF, COATED, SCATTERING, SIMPLE], ids=["brdf", "coated", "scattering", "simple"])
def test_a_byte_order_mark_changes_nothing(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.speos"
    found = []
    for encoding in ("utf-8", "utf-8-sig"):
        path.write_text(text, encoding=encoding)
        data = read_bsdf_data(path)
        found.append((data.name, data.components, [(one.wavelength, one.values.tolist()) for one in data.slices]))
    assert found[0] == found[1]
