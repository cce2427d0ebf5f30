"""LightTools text ray files: keys in any order and case, four kinds of rows, relative flux."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.rays import detect_format, lighttools_text, read_rays
from etendue.quantities.report import RayFileWarning

Read = Callable[..., et.RaySet]

KEYS = {
    "lt_rdf_version": "2.0",
    "dataname": "green LED",
    "lt_datatype": "radiant_power",
    "lt_far_field_data": "no",
    "lt_color_info": "none",
    "lt_length_units": "millimeters",
    "lt_data_origin": "0 0 0",
    "lt_radiant_flux": "2.0",
}
ROWS = "1.5 -2 3 0 0.6 0.8 0.25\r\n-4.25 7.24e-016 6 0.8 0 -0.6 1.75\r\n"
"""Two rays of together 2 W."""


def text(rows: str = ROWS, **changes: str | None) -> str:
    keys = {**KEYS, **changes}
    header = "".join(f"{key}: {value}\r\n" for key, value in keys.items() if value is not None)
    return f"# LightTools 8.7.0 \r\n# Ray Data Export File\r\n{header}lt_startofdata\r\n{rows}lt_endofdata"


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def read(rows: str = ROWS, **changes: str | None) -> et.RaySet:
        path = tmp_path / "led.ray"
        path.write_bytes(text(rows, **changes).encode())
        assert detect_format(path) is lighttools_text.FORMAT
        return read_rays(path)

    return read


def found_in(rays: et.RaySet, severity: str = "warning") -> list[tuple[str, str]]:
    return [(c.place, c.found) for c in rays.complaints if c.severity == severity]


def test_two_rays(read: Read) -> None:
    rays = read()
    assert rays.position.tolist() == [[1.5, -2, 3], [-4.25, 7.24e-16, 6]]
    np.testing.assert_allclose(rays.direction, [[0, 0.6, 0.8], [0.8, 0, -0.6]], atol=1e-16)
    assert rays.flux.tolist() == [0.25, 1.75]
    assert (rays.flux_unit, rays.wavelength, rays.complaints) == ("W", None, ())
    assert rays.header["name"] == "green LED"
    assert rays.provenance.format == "lighttools-text"


def test_flux_is_relative(read: Read) -> None:
    """LightTools' values are larger than the total by the number of rays it started."""
    rays = read(lt_radiant_flux="0.5")
    with pytest.warns(
        RayFileWarning, match=r"the header says 0.5 W, the rays sum to 2; .* scaled to the header's total"
    ):
        assert rays.total_flux == 0.5
    assert rays.flux.tolist() == [0.0625, 0.4375]


@pytest.mark.parametrize("stated", [None, "0", "-1", "nan", "unknown", ""])
def test_unknown_totals(read: Read, stated: str | None) -> None:
    rays = read(lt_radiant_flux=stated)
    assert rays.flux.tolist() == [0.25, 1.75]
    ((place, found),) = found_in(rays)
    assert place == ("header" if stated is None else "line 10")
    assert "taken as absolute" in found


def test_keys_in_any_case_and_order(tmp_path: Path) -> None:
    path = tmp_path / "led.txt"
    header = [f"{key.upper()} : {value.upper()}" for key, value in reversed(KEYS.items())]
    path.write_text("\n\r".join(["# x", *header, "LT_STARTOFDATA", *ROWS.split("\r\n"), "LT_ENDOFDATA", ""]))
    rays = read_rays(path)
    assert rays.flux.tolist() == [0.25, 1.75]
    assert (rays.flux_unit, rays.complaints) == ("W", ())


def test_keys_that_are_stated_again_or_unknown(read: Read) -> None:
    rays = read(lt_datatype="radiant_power\r\nLT_DataType: luminous_flux", lt_polarization="none")
    assert rays.flux_unit == "W"
    assert found_in(rays) == [
        ("line 6", "lt_datatype is stated again, 'luminous_flux' after 'radiant_power'; the first counts")
    ]
    assert found_in(rays, "note") == [("line 12", "'lt_polarization' is not known; its value, 'none', is ignored")]


@pytest.mark.parametrize(
    ("unit", "mm"),
    [
        ("millimeters", 1), ("Centimeters", 10), ("METERS", 1000), ("inches", 25.4), ("feet", 304.8),
        ("micrometers", 1e-3), ("nanometers", 1e-6), ("millimetres", 1), ("mm", 1), ("m", 1000), ("inch", 25.4),
    ],
)  # fmt: skip
def test_length_units(read: Read, unit: str, mm: float) -> None:
    rays = read(lt_length_units=unit)
    np.testing.assert_allclose(rays.position[0], np.array([1.5, -2, 3]) * mm, rtol=1e-15)
    assert rays.complaints == ()


@pytest.mark.parametrize("unit", [None, "system", "system_units"])
def test_length_units_that_the_file_does_not_name(read: Read, unit: str | None) -> None:
    rays = read(lt_length_units=unit)
    assert rays.position[0].tolist() == [1.5, -2, 3]
    assert "taken as mm" in found_in(rays)[0][1]


def test_wavelengths(read: Read) -> None:
    rays = read("1 2 3 0 0.6 0.8 0.5 450\n4 5 6 0.8 0 -0.6 1.5 632.8\n", lt_color_info="Wavelength")
    assert rays.wavelength is not None
    assert rays.wavelength.tolist() == [450, 632.8]
    assert rays.flux.tolist() == [0.5, 1.5]


@pytest.mark.parametrize("spelling", ["tristimulus", "CIE_Tristimulus", "tristimulus_values"])
def test_tristimulus_values_stand_in_place_of_the_flux(read: Read, spelling: str) -> None:
    rows = "1 2 3 0 0.6 0.8 7 0.5 9\n4 5 6 0.8 0 -0.6 11 1.5 13\n"
    rays = read(rows, lt_color_info=spelling, lt_datatype="luminous_flux")
    assert rays.flux.tolist() == [0.5, 1.5]
    assert rays.column("tristimulus_x").tolist() == [7, 11]
    assert rays.column("tristimulus_z").tolist() == [9, 13]
    assert rays.complaints == ()
    contradictory = read(rows, lt_color_info=spelling)
    assert contradictory.flux_unit == "lm"
    assert len(found_in(contradictory)) == 1


@pytest.mark.parametrize(
    ("colour", "rows"),
    [
        ("none", "0 0.6 0.8 0.5\n0.8 0 -0.6 1.5\n"),
        ("wavelength", "0 0.6 0.8 0.5 450\n0.8 0 -0.6 1.5 600\n"),
        ("tristimulus", "0 0.6 0.8 7 0.5 8\n0.8 0 -0.6 9 1.5 3\n"),
    ],
)
def test_far_field_rays_have_no_position(read: Read, colour: str, rows: str) -> None:
    rays = read(rows, lt_far_field_data="YES", lt_color_info=colour, lt_datatype="luminous_flux")
    assert not rays.has_position
    np.testing.assert_allclose(rays.direction, [[0, 0.6, 0.8], [0.8, 0, -0.6]], atol=1e-16)
    assert rays.flux.tolist() == [0.5, 1.5]


def test_rows_must_be_as_the_header_says(read: Read) -> None:
    with pytest.raises(FormatError, match="line 12: 7 entries where 8 are expected"):
        read(lt_color_info="wavelength")
    with pytest.raises(FormatError, match="line 12: 7 entries where 4 are expected"):
        read(lt_far_field_data="yes")


def test_an_origin_is_not_applied(read: Read) -> None:
    rays = read(lt_data_origin="   1  0 -2.5 ")
    assert rays.position[0].tolist() == [1.5, -2, 3]
    assert found_in(rays) == [
        (
            "line 9",
            "data origin [1.0, 0.0, -2.5] is not 0; positions are left as stored (in Python, RaySet.moved shifts them)",
        )
    ]
    assert "no position" in found_in(read(lt_data_origin="here"))[0][1]


@pytest.mark.parametrize(
    ("key", "value", "found"),
    [
        ("lt_datatype", None, "lt_datatype is missing, so that the unit of the flux is not known"),
        ("lt_datatype", "photons", "lt_datatype 'photons' is not known, so that the unit of the flux is not known"),
        ("lt_far_field_data", "maybe", "lt_far_field_data is 'maybe'"),
        ("lt_color_info", "pink", "lt_color_info is 'pink'"),
        ("lt_length_units", "furlongs", "lt_length_units is 'furlongs'"),
    ],
)
def test_headers_that_mean_nothing(read: Read, key: str, value: str | None, found: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(**{key: value})
    assert caught.value.found == found
    assert caught.value.place == ("header" if value is None else f"line {list(KEYS).index(key) + 3}")
    assert caught.value.advice.startswith("Known: ")


def test_missing_keys_with_one_meaning(read: Read) -> None:
    rays = read(lt_far_field_data=None, lt_color_info=None, lt_rdf_version=None)
    assert rays.flux.tolist() == [0.25, 1.75]
    assert [found for _, found in found_in(rays)] == [
        "lt_far_field_data is missing; taken as 'no'",
        "lt_color_info is missing; taken as 'none'",
    ]


def test_a_truncated_file(tmp_path: Path) -> None:
    path = tmp_path / "led.ray"
    path.write_text(text()[: -len("lt_endofdata")] + "9 9 9 0 0 1 3")
    rays = read_rays(path)
    assert rays.records["flux"].tolist() == [0.25, 1.75]
    assert [c.severity for c in rays.complaints] == ["error", "error"]
    assert "lt_endofdata" in rays.complaints[1].found
    path.write_text(text().split("lt_startofdata")[0])
    with pytest.raises(FormatError, match="lt_startofdata is missing"):
        read_rays(path)


def test_what_is_written(tmp_path: Path) -> None:
    path = tmp_path / "led.ray"
    rays = et.RaySet([[1, 2, 3.5]], [[0, 0.6, 0.8]], [0.1], flux_unit="W", wavelength=[550.0])
    assert lighttools_text.write(rays, path) == ()
    content = path.read_bytes().decode()
    assert content.count("\r\n") == content.count("\n")
    lines = content.splitlines()
    assert "lt_datatype: radiant_power" in lines
    assert "lt_far_field_data: no" in lines
    assert "lt_color_info: wavelength" in lines
    assert "lt_length_units: millimeters" in lines
    assert f"lt_radiant_flux: {0.1:.17g}" in lines
    row = lines[lines.index("lt_startofdata") + 1]
    assert [float(v) for v in row.split()] == [1, 2, 3.5, 0, 0.6, 0.8, 0.1, 550]
    assert lines[-1] == "lt_endofdata"


def test_wavelengths_beside_lumens_are_told_to_be_lost(tmp_path: Path) -> None:
    rays = et.RaySet([[1, 2, 3.5]], [[0, 0.6, 0.8]], [0.1], wavelength=[550.0])
    notes = lighttools_text.write(rays, tmp_path / "led.ray")
    assert any("in_unit('W')" in note for note in notes)
    back = read_rays(tmp_path / "led.ray")
    assert (back.flux_unit, back.wavelength) == ("lm", None)


@pytest.mark.parametrize("colour", ["none", "tristimulus"])
@pytest.mark.parametrize("far_field", ["no", "yes"])
def test_what_is_read_is_written(read: Read, tmp_path: Path, colour: str, far_field: str) -> None:
    position = {"no": ("1 2 3", "4 5 6"), "yes": ("", "")}[far_field]
    flux = {"none": ("5", "1.5"), "tristimulus": ("7 5 8", "9 1.5 3")}[colour]
    rows = f"{position[0]} 0 0.6 0.8 {flux[0]}\n{position[1]} 0.8 0 -0.6 {flux[1]}\n"
    rays = read(
        rows, lt_far_field_data=far_field, lt_color_info=colour, lt_datatype="luminous_flux", lt_radiant_flux="26"
    )
    with pytest.warns(RayFileWarning):
        assert rays.total_flux == 26
    assert lighttools_text.write(rays, tmp_path / "again.ray") == ()
    again = read_rays(tmp_path / "again.ray")
    assert again.has_position is (far_field == "no")
    assert again.flux.tolist() == [20, 6]
    if colour == "tristimulus":
        assert again.column("tristimulus_x").tolist() == [28, 36]
        assert again.column("tristimulus_z").tolist() == [32, 12]


def test_samples(samples: Path) -> None:
    """Written by LightTools 8.7.0 and 2024.03; the started rays were 10 000 and 3."""
    rays = read_rays(samples / "rays" / "Cyl10k.1.ray")
    assert (len(rays), rays.provenance.format, rays.flux_unit) == (10_000, "lighttools-text", "lm")
    with pytest.warns(RayFileWarning, match="the header says 1 lm, the rays sum to 10000"):
        assert rays.total_flux == 1
    assert rays.position[1].tolist() == [-1.886318e-15, -6.707289, 17.41703]
    np.testing.assert_allclose(rays.direction[-1], [0.1473921, 0.8453243, 0.5135196], atol=1e-7)
    assert rays.flux[-1] == pytest.approx(1.21945e-4, rel=1e-6)

    three = read_rays(samples / "rays" / "ThreeRays_Wavelength.1.txt")
    assert (len(three), three.flux_unit) == (3, "W")
    assert three.wavelength is not None
    assert three.wavelength.tolist() == [550, 450, 620]
    with pytest.warns(RayFileWarning):
        np.testing.assert_allclose(three.flux, np.array([0.003106601, 0.004659902, 0.001553301]) / 3, rtol=1e-6)
