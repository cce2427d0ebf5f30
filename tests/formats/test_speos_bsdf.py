"""Speos files made by hand, with values that are not absolute, and two of a supplier against the same data of Zemax."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.formats.bsdf.speos import write
from etendue.quantities.bsdf_directions import direction

PHI = "\t0 90 180 270 360"


def hand(*, type_of_values: int = 1, description: tuple[int, str] = (0, ""), spectrum: str = "1\n555 40") -> str:
    """A reflecting table at 0 and 40°: brighter forwards than backwards, brightest at φ = 90°; in arbitrary units."""
    rows = "\n".join(f"{theta} 3 5 1 2 3" for theta in range(0, 91, 10))
    if type_of_values == 0:
        cosines = [math.cos(math.radians(theta)) for theta in range(0, 91, 10)]
        rows = "\n".join(
            " ".join(str(v) for v in [10 * k, *(c * f for f in (3, 5, 1, 2, 3))]) for k, c in enumerate(cosines)
        )
    data = "\n".join(f"10 5\n{PHI}\n{rows}" for _ in range(2))
    return (
        f"OPTIS - Anisotropic BSDF surface file v8.0\n0\nby hand\n{description[0]}\n{description[1]}\n1 0 0\n1 0\n"
        f"{type_of_values}\n1\n0\n2\n0 40\n0 0\nspectrum\n{spectrum}\n{data}\nEnd of file\n"
    )


@pytest.mark.parametrize("description", [(0, ""), (5, "hello"), (11, "hello\n1 2 3")])
@pytest.mark.parametrize("type_of_values", [0, 1])
def test_values_are_scaled_to_the_spectrum(tmp_path: Path, type_of_values: int, description: tuple[int, str]) -> None:
    path = tmp_path / "hand.anisotropicbsdf"
    path.write_text(hand(type_of_values=type_of_values, description=description))
    data = read_bsdf_data(path)
    assert [round(one.theta, 9) for one in data.slices] == [0.0, 40.0]
    # The mean over azimuth is 2.75 in the file's unit: f = 0.4/π in the mean.
    for one in data.slices:
        assert one.integral() == pytest.approx(0.4, rel=1e-3 if type_of_values else 0.02)
    forwards, left, backwards, right = data.slices[1].at(direction(50.0, [0.0, 90.0, 180.0, 270.0]))
    unit = 0.4 / math.pi / 2.75
    assert np.allclose(
        [forwards, left, backwards, right], np.array([3, 5, 1, 2]) * unit, rtol=1e-3 if type_of_values else 0.02
    )


def test_the_factor_to_the_stated_share_is_told(tmp_path: Path) -> None:
    """A table whose mean over azimuth is 2.75 adds up to 2.75 π: 40 % are stated, where the reference is in the table."""
    path = tmp_path / "hand.anisotropicbsdf"
    path.write_text(hand())
    data = read_bsdf_data(path)
    (told,) = data.complaints
    assert str(told).startswith("note: 0° of incidence, reflection: the stated share is 0.4, the table adds up to ")
    raw, factor = (float(word) for word in re.findall(r"up to (\S+):.* by (\S+)$", told.found)[0])
    assert raw == pytest.approx(2.75 * math.pi, rel=1e-5)
    assert factor == pytest.approx(0.4 / (2.75 * math.pi), rel=1e-5)
    assert [one.stated for one in data.slices] == [0.4, None]
    # A reference between the incidences is that of no table; and of a file that is scaled already nothing is told.
    path.write_text(hand().replace("0 0\nspectrum", "20 0\nspectrum"))
    between = read_bsdf_data(path)
    assert [one.stated for one in between.slices] == [None, None]
    assert "20° of incidence" in between.complaints[0].place
    with (tmp_path / "again.anisotropicbsdf").open("w+b") as stream:
        write(data, stream)
    again = read_bsdf_data(tmp_path / "again.anisotropicbsdf")
    assert again.complaints == ()
    assert again.slices[0].stated == pytest.approx(0.4)


def test_the_spectrum_is_weighted_with_v_of_lambda(tmp_path: Path) -> None:
    path = tmp_path / "hand.anisotropicbsdf"
    path.write_text(hand(spectrum="3\n380 90\n555 40\n780 10"))
    data = read_bsdf_data(path)
    assert data.slices[0].integral() == pytest.approx(0.4, abs=0.005)
    assert any("V(λ)" in complaint.found for complaint in data.complaints)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("1 0\n1\n", "1 2\n1\n", "flag of transmission is 2"),
        ("1 0\n1\n", "0 0\n1\n", "neither reflection nor transmission"),
        ("1 0\n1\n", "1 0\n2\n", "type of values is 2"),
        ("0 40\n", "40 0\n", "do not rise"),
        ("0 40\n", "0 95\n", "not from 0 to 90"),
        ("\n10 3 5", "\n95 3 5", "do not rise"),
        ("555 40", "555 -40", "falls back in wavelength, or below 0"),
        ("End of file", "", "End of file"),
        ("by hand\n0\n", "by hand\nmany\n", "no length of the description"),
        ("10 5\n", "1000000000 5\n", "words follow"),
    ],
)
def test_mistakes_are_told_with_their_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    text = hand()
    assert old in text
    path = tmp_path / "hand.anisotropicbsdf"
    path.write_text(text.replace(old, new))
    with pytest.raises(FormatError, match=said) as caught:
        read_bsdf_data(path)
    assert "line" in caught.value.place


@pytest.mark.parametrize("way", ["brdf", "btdf"])
def test_the_same_vinyl_as_zemax_has_it(samples: Path, way: str) -> None:
    """A converter wrote the Speos file from the Zemax one, filled zeros beyond its last angle and scaled anew.

    What is left is the shape at the reference incidence: in proportion over the whole measured range.
    """
    speos, zemax = (
        read_bsdf_data(samples / "bsdf" / f"planesymmetric_{way}{end}").slices[0]
        for end in (".anisotropicbsdf", "_zemax.bsdf")
    )
    assert speos.integral() == pytest.approx(0.134506, rel=1e-6)
    assert speos.theta == pytest.approx(15.0)
    at = direction(np.array([0.0, 10.0, 25.0, 40.0])[:, None], np.arange(0.0, 360.0, 30.0), behind=way == "btdf")
    ratio = speos.at(at) / zemax.at(at)
    assert np.std(ratio) / np.mean(ratio) < 0.01
    assert np.mean(ratio) == pytest.approx(1.03, abs=0.02)


def test_a_byte_order_mark_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "x.anisotropicbsdf"
    found = []
    for encoding in ("utf-8", "utf-8-sig"):
        path.write_text(hand(), encoding=encoding)
        found.append([one.values.tolist() for one in read_bsdf_data(path).slices])
    assert found[0] == found[1]


def test_numbers_that_make_no_table_are_refused_with_the_file(tmp_path: Path) -> None:
    """An intensity of 1e308 at 80°, over cos 80°, is beyond the range of numbers."""
    path = tmp_path / "hand.anisotropicbsdf"
    whole = hand(type_of_values=0)
    path.write_text(re.sub(r"(?m)^80 \S+", "80 1e308", whole, count=1))
    assert path.read_text() != whole
    with pytest.raises(FormatError, match=r"hand\.anisotropicbsdf: values: values of a BSDF are finite"):
        read_bsdf_data(path)
