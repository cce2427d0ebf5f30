"""Ray tables: our own bit by bit, others' by the names of their columns, bare numbers with loud assumptions."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.rays import ascii_table, detect_format, read_rays, write_rays
from etendue.quantities.provenance import Provenance
from etendue.units import FluxUnit

Read = Callable[[str], et.RaySet]

ROWS = "1.5,-2,3,0,0.6,0.8,0.25\n-4.25,5e-1,6,0.8,0,-0.6,1.75\n"
SPECTRAL_ROWS = "1.5,-2,3,0,0.6,0.8,0.25,450\n-4.25,5e-1,6,0.8,0,-0.6,1.75,632.8\n"
NAMES = "x_mm,y_mm,z_mm,l,m,n,flux_lm"


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def read(text: str, encoding: str = "utf-8") -> et.RaySet:
        path = tmp_path / "led.asc"
        path.write_bytes(text.encode(encoding))
        assert detect_format(path) is ascii_table.FORMAT
        return read_rays(path)

    return read


def check_two_rays(rays: et.RaySet, mm: float = 1.0) -> None:
    np.testing.assert_allclose(rays.position, np.array([[1.5, -2, 3], [-4.25, 0.5, 6]]) * mm, rtol=1e-15)
    np.testing.assert_allclose(rays.direction, [[0, 0.6, 0.8], [0.8, 0, -0.6]], atol=1e-16)
    assert rays.flux.tolist() == [0.25, 1.75]


def founds(rays: et.RaySet) -> list[str]:
    assert all(c.severity == "warning" for c in rays.complaints)
    return [c.found for c in rays.complaints]


# --- our own ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["lm", "W"])
@pytest.mark.parametrize("with_wavelength", [True, False])
def test_every_bit_comes_back(tmp_path: Path, unit: FluxUnit, with_wavelength: bool) -> None:
    rng = np.random.default_rng(8)
    position = rng.normal(size=(500, 3)) * 10.0 ** rng.integers(-300, 300, size=(500, 3))
    wavelength = rng.uniform(400, 700, 500) if with_wavelength else None
    rays = et.RaySet(position, rng.normal(size=(500, 3)), rng.random(500), flux_unit=unit, wavelength=wavelength)
    path = tmp_path / "rays.csv"
    assert write_rays(path, rays) == ()
    back = read_rays(path)
    (batch,) = rays.batches()
    assert np.array_equal(back.records["position"], batch.position)
    assert np.array_equal(back.records["direction"], batch.direction)
    assert np.array_equal(back.records["flux"], batch.flux)
    assert (back.flux_unit, back.complaints) == (unit, ())
    if wavelength is None:
        assert back.wavelength is None
    else:
        assert np.array_equal(back.records["wavelength"], wavelength)


def test_what_is_written(tmp_path: Path) -> None:
    path = tmp_path / "rays.csv"
    provenance = Provenance(source="LED\nblå.ray")
    rays = et.RaySet([[1, 2, 3.5]], [[0, 0, 1]], [0.25], wavelength=[550.0], provenance=provenance)
    ascii_table.write(rays, path)
    lines = path.read_bytes().decode("ascii").split("\n")
    assert lines[0] == "# etendue ray table"
    assert lines[1].startswith("# software: etendue ")
    assert lines[2:] == ["# source: LED?bl?.ray", "# rays: 1", f"{NAMES},wavelength_nm", "1,2,3.5,0,0,1,0.25,550", ""]
    assert read_rays(path).header["source"] == "LED?bl?.ray"


def test_far_field_rays(tmp_path: Path) -> None:
    records = np.zeros(2, [("direction", "<f8", 3), ("flux", "<f8")])
    records["direction"], records["flux"] = [[0, 0.6, 0.8], [0.8, 0, -0.6]], [1, 2]
    rays = et.RaySet.from_records(records, et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1]).meaning)
    assert ascii_table.write(rays, tmp_path / "far.csv") == ()
    back = read_rays(tmp_path / "far.csv")
    assert not back.has_position
    assert np.array_equal(back.direction, rays.direction)


def test_what_cannot_be_written_is_told(tmp_path: Path) -> None:
    spectrum = et.Spectrum([400.0, 500.0], [1.0, 2.0])
    rays = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1], spectra=(spectrum,))
    (note,) = ascii_table.write(rays, tmp_path / "rays.csv")
    assert "one spectrum for all" in note


def test_a_short_table_of_ours_is_known_to_be_short(tmp_path: Path) -> None:
    path = tmp_path / "rays.csv"
    ascii_table.write(et.RingSource(rays=20), path)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:-3]))
    rays = read_rays(path)
    assert len(rays) == 17
    (complaint,) = rays.complaints
    assert complaint.severity == "error"
    assert "3 are missing" in complaint.found


# --- others', with names ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("names", "mm", "unit"),
    [
        (NAMES, 1, "lm"),
        ("X_m,Y_m,Z_m,L,M,N,FLUX_W", 1000, "W"),
        ("x [cm], y [cm], z [cm], kx, ky, kz, Power [W]", 10, "W"),
        ("PosX(inch),PosY(in),PosZ(inch),DirX,DirY,DirZ,Intensity (lm)", 25.4, "lm"),
        ('"x mm","y mm","z mm","cx","cy","cz","energy watts"', 1, "W"),
        ("x_feet,y_ft,z_ft,a,b,c,ray power [Watt]", 304.8, "W"),
        ("X Pos [µm],Y Pos [um],Z Pos [μm],X Vec,Y Vec,Z Vec,luminous flux", 1e-3, "lm"),
        ("x_nm,y_nm,z_nm,u,v,w,radiant_flux", 1e-6, "W"),
    ],
)
def test_names_and_units(read: Read, names: str, mm: float, unit: str) -> None:
    rays = read(f"{names}\n{ROWS}")
    check_two_rays(rays, mm)
    assert (rays.flux_unit, rays.complaints) == (unit, ())


@pytest.mark.parametrize(
    ("name", "scale"), [("wavelength_nm", 1), ("Wavelength [um]", 1000), ("λ [µm]", 1000), ("lambda (nm)", 1)]
)
def test_wavelengths(read: Read, name: str, scale: float) -> None:
    rays = read(f"{NAMES},{name}\n{SPECTRAL_ROWS}")
    check_two_rays(rays)
    assert rays.wavelength is not None
    assert rays.wavelength.tolist() == [450 * scale, 632.8 * scale]
    assert rays.complaints == ()


def test_latin_1_names(read: Read) -> None:
    assert read(f"x_µm,y_µm,z_µm,l,m,n,flux_lm\n{ROWS}", encoding="latin-1").position[0].tolist() == [
        0.0015,
        -0.002,
        0.003,
    ]


def test_columns_in_any_order(read: Read) -> None:
    rays = read(
        "flux_W,n,m,l,wavelength_nm,z_mm,x_mm,y_mm\n0.25,0.8,0.6,0,450,3,1.5,-2\n1.75,-0.6,0,0.8,600,6,-4.25,.5\n"
    )
    check_two_rays(rays)
    assert rays.wavelength is not None
    assert rays.wavelength.tolist() == [450, 600]


def test_units_that_are_not_stated_are_assumed_aloud(read: Read) -> None:
    rays = read(f"x,y,z,l,m,n,flux,wavelength\n{SPECTRAL_ROWS}")
    check_two_rays(rays)
    assert [found.split(";")[1].split()[2] for found in founds(rays)] == ["mm", "lm.", "nm"]
    assert "with_total_flux" in founds(rays)[1]


def test_unknown_columns_are_named_and_ignored(read: Read) -> None:
    rays = read(f"ray no,{NAMES},surface\n" + "".join(f"{i},{row},lens A.1\n" for i, row in enumerate(ROWS.split())))
    check_two_rays(rays)
    (found,) = founds(rays)
    assert found == "columns that are not known, and are ignored: 'ray no', 'surface'"


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ("x_mm,y_mm,z_mm,l,m,n,colour", "no column is the flux"),
        ("x_mm,y_mm,colour,l,m,n,flux_lm", "2 of 3 position columns"),
        ("x_mm,y_mm,z_m,l,m,n,flux_lm", "unit m and mm of the position"),
        ("x_mm,y_mm,z_mm,l,m,n,flux [mW]", "unit mW of the flux"),
        ("x [furlong],y [furlong],z [furlong],l,m,n,flux_lm", "unit furlong of the position"),
        ("x_mm,y_mm,z_mm,l,m,n,flux_lm,wavelength [THz]", "unit THz of the wavelength"),
        ("x_mm,y_mm,z_mm,l,m,n,flux_lm,power_W", "the columns 'flux_lm' and 'power_W' mean the same"),
    ],
)
def test_names_that_do_not_make_a_ray(read: Read, names: str, found: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(f"# comment\n{names}\n{SPECTRAL_ROWS if names.count(',') == 7 else ROWS}")
    assert (caught.value.place, caught.value.found) == ("line 2", found)


# --- separators and decimal marks ------------------------------------------------------------------------------------


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", ", ", " ; ", "  "])
@pytest.mark.parametrize("end_of_line", ["\n", "\r\n", "\r"])
def test_separators(read: Read, separator: str, end_of_line: str) -> None:
    text = f"# comment\n\n{NAMES}\n{ROWS}\n# end\n".replace("\n", end_of_line).replace(",", separator)
    rays = read("\ufeff" + text)
    check_two_rays(rays)
    assert rays.complaints == ()


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("names", [NAMES + "\n", ""])
def test_decimal_commas(read: Read, separator: str, names: str) -> None:
    rows = (names + ROWS).replace(",", separator).replace(".", ",")
    rays = read(rows)
    check_two_rays(rays)
    assert len(rays.complaints) == (0 if names else 1)


def test_decimal_commas_that_begin_late(read: Read) -> None:
    rays = read(f"{NAMES}\n0;0;0;0;0;1;2\n".replace(",", ";") + "0,5;0;0;0;0;1;3\n")
    assert rays.position[1, 0] == 0.5


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (NAMES.replace(",", ";") + "\n1;2;3;0;0;1;1,5\n1.5;2;3;0;0;1;1\n", "line 3"),
        (NAMES.replace(",", ";") + "\n1;2;3;0;0;1;1.234,5\n", "line 2"),
        ("1,5 2,5 3 0 0 1 1\n", "line 1"),
        ("1,5 2,5 3,0 0,0 0,0 1,0 1,0\n", "line 1"),
    ],
)
def test_ambiguous_decimal_marks_are_refused(read: Read, text: str, place: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(text)
    assert caught.value.place == place
    assert "comma" in caught.value.found


def test_a_decimal_point_far_behind_decimal_commas(read: Read) -> None:
    rows = "0,5;2;3;0;0;1;1,5\n" * 6000 + "0.5;2;3;0;0;1;1\n"
    with pytest.raises(FormatError, match="line 6002: both decimal points and decimal commas"):
        read(NAMES.replace(",", ";") + "\n" + rows)


def test_text_with_points_beside_decimal_commas(read: Read) -> None:
    rays = read("x_mm;y_mm;z_mm;l;m;n;flux_lm;part\n1,5;-2;3;0;0,6;0,8;0,25;v1.2\n-4,25;0,5;6;0,8;0;-0,6;1,75;v1.3\n")
    check_two_rays(rays)


# --- bare numbers ----------------------------------------------------------------------------------------------------


def test_bare_rows(read: Read) -> None:
    rays = read(f"% exported\n{ROWS}".replace(",", "  "))
    check_two_rays(rays)
    assert rays.flux_unit == "lm"
    (found,) = founds(rays)
    assert "taken as x y z [mm], direction, and flux [lm]" in found
    assert "RaySet.with_total_flux(value, unit)" in found


def test_a_bare_eighth_column_is_not_taken_for_a_wavelength(read: Read) -> None:
    rays = read(SPECTRAL_ROWS)
    check_two_rays(rays)
    assert rays.wavelength is None
    assert "column 8" in founds(rays)[1]


@pytest.mark.parametrize("columns", [6, 9, 12])
def test_other_numbers_of_bare_columns_need_names(read: Read, columns: int) -> None:
    with pytest.raises(FormatError, match=f"line 1: {columns} numbers without names. Put a line of names above"):
        read(" ".join("1" * columns) + "\n")


@pytest.mark.parametrize(
    "text",
    ["", "\n\n", "# only comments\n", "IESNA:LM-63-2002\n", "time,temperature\n1,2\n", "1 2 3 4 5\n", "x,y,z\n1,2,3\n"],
)
def test_what_is_no_ray_table(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    assert not ascii_table.recognise(ascii_table.Head.of(path))
    with pytest.raises(FormatError):
        ascii_table.read(path)


def test_rows_with_values_that_are_not_finite_are_left_out_later(read: Read) -> None:
    rays = read(f"{NAMES}\n{ROWS}1,2,3,0,0,1,nan\n1,-inf,3,0,0,1,1\n1,2,3,0,0,0,1\n")
    assert len(rays) == 5
    with pytest.warns(UserWarning, match="left out"):
        assert rays.total_flux == 2
