"""EULUMDAT as it is met: symmetries, uneven angles, commas, lamp sets, and what is refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError
from etendue.formats.intensity import read_intensity, write_intensity
from etendue.quantities.intensity import Intensity
from oracles.intensity import lid


def ldt(
    isym: int,
    c: Sequence[float],
    gamma: Sequence[float],
    values: Sequence[float],
    *,
    sets: Sequence[Sequence[object]] = ((2, "LED", 500, "3000 K", "80", 12),),
    lines: dict[int, object] | None = None,
) -> list[str]:
    """Lines of a file; `lines` overrides some by number, counted from 1."""
    head: list[object] = ["maker", 2, isym, len(c), 0, len(gamma), 0, "r", "name", "no", "file", "date"]
    head += [1200, 60, 80, 1100, 50, 1, 2, 3, 4, 100, 0, 1, 0, len(sets)]
    rows = [*head, *(field for row in sets for field in row), *range(10), *c, *gamma, *values]
    for number, text in (lines or {}).items():
        rows[number - 1] = text
    return [str(row) for row in rows]


@pytest.fixture
def read(tmp_path: Path) -> object:
    def call(lines: list[str], encoding: str = "latin-1") -> Intensity:
        (tmp_path / "a.ldt").write_bytes("".join(f"{line}\r\n" for line in lines).encode(encoding))
        return read_intensity(tmp_path / "a.ldt")

    return call


@pytest.mark.parametrize(
    ("isym", "c", "stored", "expected"),
    [
        (0, [0, 90, 100, 270], 4, [0, 1, 2, 3]),
        (1, [0, 90, 180, 270], 1, [0]),
        (1, [0], 1, [0]),
        (2, [0, 20, 180, 340], 3, [0, 1, 2, 1]),
        (2, [0, 20, 90, 180, 270, 340], 4, [0, 1, 2, 3, 2, 1]),
        (3, [0, 90, 180, 270], 3, [1, 2, 1, 0]),
        (3, [20, 90, 160, 270], 3, [1, 2, 1, 0]),
        (4, [0, 30, 90, 150, 180, 210, 270, 330], 3, [0, 1, 2, 1, 0, 1, 2, 1]),
    ],
)
def test_symmetries_and_uneven_planes(read, isym: int, c: list[float], stored: int, expected: list[int]) -> None:
    """C90-C270 stores its planes from 270° over 0° to 90°."""
    values = [value for plane in range(stored) for value in (100, 1000 * plane + 50, 1000 * plane + 1)]
    led = read(ldt(isym, c, [0, 45, 90], values))
    assert led.c.tolist() == (c if isym != 1 else [0])
    assert led.values[:, 1].tolist() == [(1000 * plane + 50) * 0.5 for plane in expected]
    assert not led.complaints


@pytest.mark.parametrize("gamma", [0, 180])
def test_planes_that_contradict_each_other_at_a_pole_are_told(read, gamma: int) -> None:
    """All of them meet there. Measured ones differ by a per cent of the peak or so."""
    rows = [0, 45, 90] if gamma == 0 else [90, 135, 180]
    for other, told in ((470, False), (440, True)):
        ends = [[500, 800, 60], [other, 700, 50]]
        values = [value for plane in ends for value in (plane if gamma == 0 else plane[::-1])]
        led = read(ldt(0, [0, 180], rows, values))
        found = [complaint for complaint in led.complaints if complaint.place == f"intensities at γ = {gamma}°"]
        assert len(found) == told
        assert all("say 220 to 250 cd" in complaint.found for complaint in found)


def test_absolute_intensity_is_that_of_the_first_lamp_set(read) -> None:
    sets = ((2, "LED", 500, "3000 K", "80", 12), (3, "big", 800, "", "", 20))
    led = read(ldt(1, [0], [0, 90], [100, 50], sets=sets))
    assert led.values.tolist() == [[50, 25]]
    assert "2 lamp sets" in str(led.complaints[0])
    assert led.luminaire["lamp_sets"][1] == dict(
        zip(("lamps", "type", "flux", "colour", "colour_rendering", "power"), sets[1], strict=True)
    )
    assert led.luminaire["lamp_flux"] == 500
    assert (led.luminaire["lamps"], led.luminaire["input_power"], led.luminaire["linear"]) == (2, 12, True)


def test_absolute_photometry(read) -> None:
    led = read(ldt(1, [0], [0, 90], [100, 50], sets=((-1, "LED", 500, "", "", 12),)))
    assert led.values.tolist() == [[50, 25]]
    assert "lamp_flux" not in led.luminaire
    assert led.luminaire["stated_flux"] == 500


def test_commas_units_blank_lines_and_a_byte_order_mark(read, tmp_path: Path) -> None:
    rows = ldt(1, [0], [0, 22.5, 90], [100.5, 60, 50], lines={1: "", 8: "", 9: "Größe", 29: "500,0 lm", 16: ""})
    led = read([row.replace(".", ",") for row in rows] + ["", "", ""])
    assert led.gamma.tolist() == [0, 22.5, 90]
    assert led.values.tolist() == [[50.25, 30, 25]]
    assert led.luminaire["luminaire"] == "Größe"
    assert any("decimal comma" in str(c) for c in led.complaints)
    (tmp_path / "b.ldt").write_bytes(b"\xef\xbb\xbf" + "\n".join([*rows, ""]).encode())
    assert read_intensity(tmp_path / "b.ldt").luminaire["luminaire"] == "Größe"


def test_what_is_said_twice(read) -> None:
    led = read(ldt(1, [0], [0, 90], [100, 50], lines={5: 15, 7: 5, 23: 12, 24: 2, 25: 30}))
    found = "\n".join(map(str, led.complaints))
    for what in ("step of γ", "conversion factor is 2", "tilt of 30°", "light output ratio"):
        assert what in found
    assert led.values.tolist() == [[50, 25]]
    assert "2 lines after the last" in str(read([*ldt(1, [0], [0, 90], [100, 50]), "1", "2"]).complaints[0])
    assert "below 0" in str(read(ldt(1, [0], [0, 90], [100, -50])).complaints[0])
    assert "360°" in str(read(ldt(0, [0, 180, 360], [0, 90], range(6))).complaints[0])


def test_what_the_table_does_not_rest_on_may_be_nonsense(read) -> None:
    """A wattage with its unit before it, a missing ratio, sizes in words: complained about, and read."""
    led = read(ldt(1, [0], [0, 90], [100, 50], lines={13: "long", 23: "", 24: "-", 32: "ca. 12 W", 27: "one"}))
    assert led.values.tolist() == [[50, 25]]
    assert led.luminaire["input_power"] == 0
    assert led.luminaire["lamp_flux"] == 500
    assert sorted(c.place for c in led.complaints) == [
        "line 13, housing size",
        "line 24, conversion factor",
        "line 27, lamps of a lamp set",
        "line 32, power of a lamp set",
    ]


@pytest.mark.parametrize("flux", ["1 000", "12 345.5", "1\N{NO-BREAK SPACE}000 lm", "1,000", "1'000", "1.000,5"])
def test_a_flux_with_a_sign_between_thousands_is_refused(read, flux: str) -> None:
    """It would be read as a thousandth of itself, and so would all intensities; 2,000 may be either."""
    with pytest.raises(FormatError, match="line 29, flux of a lamp set"):
        read(ldt(1, [0], [0, 90], [100, 50], sets=[(1, "LED", flux, "3000 K", "80", 12)]))


def test_what_is_no_sign_between_thousands(read) -> None:
    """A remark; three digits behind a decimal comma, where other numbers have one too."""
    for flux, other, expected in (
        ("500 lm", 50, 500),
        ("500 2x36 W", 50, 500),
        ("1,250", "50,5", 1.25),
        ("0,750", 50, 0.75),
    ):
        led = read(ldt(1, [0], [0, 90], [100, other], sets=[(1, "LED", flux, "3000 K", "80", 12)]))
        assert led.luminaire["lamp_flux"] == expected
    # A size does not decide about the table: it is told and left out.
    wide = read(ldt(1, [0], [0, 90], [100, 50], lines={13: "1 200"}))
    assert any("line 13" in str(complaint) for complaint in wide.complaints)


def test_sizes(read) -> None:
    """The length lies along C90-C270, the width along C0-C180; a width of 0 is a circle."""
    facts = read(ldt(1, [0], [0, 90], [100, 50])).luminaire
    assert (facts["opening_x"], facts["opening_y"], facts["opening_z"]) == (50, 1100, 4)
    assert (facts["housing_x"], facts["housing_y"], facts["housing_z"]) == (60, 1200, 80)
    round_ = read(ldt(1, [0], [0, 90], [100, 50], lines={17: 0, 18: 0, 19: 0, 20: 0, 21: 0})).luminaire
    assert (round_["opening_shape"], round_["opening_x"], round_["opening_y"]) == ("circle", 1100, 1100)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (ldt(1, [0], [0, 90], [100]), "announced"),
        (ldt(1, [0], [0, 90], [100, "x"]), "line 47, angles and intensities: 'x' is no number"),
        (ldt(1, [0], [0, 90], [100, "nan"]), "no number"),
        (ldt(1, [0], [90, 0], [100, 50]), "angles γ"),
        (ldt(0, [0, 0], [0, 90], range(4)), "angles C"),
        (ldt(0, [0, 365], [0, 90], range(4)), "angles C"),
        (ldt(4, [0, 90, 180], [0, 90], range(4)), "number of C planes"),
        (ldt(2, [0, 10, 20, 30], [0, 90], range(6)), "not where they belong"),
        (ldt(2, [0, 90, 180, 360], [0, 90], range(6)), "Remove that plane"),
        (ldt(1, [0], [0, 90], [100, 50], lines={26: 21}), "number of lamp sets"),
        (ldt(1, [0], [0, 90], [100, 50], lines={26: ""}), "line is empty"),
        (ldt(1, [0], [0, 90], [100, 50], lines={29: 0}), "kilolumen"),
        (ldt(1, [0], [0, 90], [100, 50], lines={29: ""}), "kilolumen"),
        (
            ldt(1, [0], [0, 90], [100, 50], lines={3: 5}),
            "line 3, symmetry: found 5; it must be a whole number from 0 to 4",
        ),
        (ldt(1, [0], [0, 90], [100, 50])[:20], "the file ends"),
    ],
)
def test_what_is_refused(read, lines: list[str], message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read(lines)


# --- the writer ------------------------------------------------------------------------------------------------------


def test_what_is_written(tmp_path: Path) -> None:
    led = lid("both", gamma=range(0, 181, 5))
    write_intensity(tmp_path / "a.ldt", led)
    lines = (tmp_path / "a.ldt").read_text(encoding="latin-1").splitlines()
    assert lines[1:7] == ["3", "4", "24", "15", "37", "5"]
    assert lines[25:27] == ["1", "-1"]
    assert float(lines[28]) == pytest.approx(led.flux, rel=1e-8)
    down = Intensity(led.c, led.gamma[:19], led.values[:, :19]).flux
    assert float(lines[21]) == pytest.approx(100 * down / led.flux, rel=1e-5)
    assert float(lines[22]) == 100
    # 42 lines of header, all angles, and the planes 0° to 90°
    assert len(lines) == 42 + 24 + 37 + 7 * 37
    assert float(lines[42 + 24 + 37]) == pytest.approx(1000 * led.values[0, 0] / led.flux, rel=1e-5)


def test_planes_of_c90_c270_go_from_270_over_0_to_90(tmp_path: Path) -> None:
    led = lid("C90-C270", c=(0, 20, 90, 160, 180, 200, 270, 340), gamma=(0, 45, 90))
    write_intensity(tmp_path / "a.ldt", led)
    lines = (tmp_path / "a.ldt").read_text(encoding="latin-1").splitlines()
    assert [float(v) for v in lines[42:50]] == [0, 20, 90, 160, 180, 200, 270, 340]
    table = np.array([float(v) for v in lines[53:]]).reshape(5, 3) * led.flux / 1000
    assert np.allclose(table, led.planes([270, 340, 0, 20, 90]), rtol=1e-5)


@pytest.mark.parametrize(
    ("c", "isym"),
    [
        ((0, 30, 90, 150, 180, 210, 270, 330), 3),
        ((90, 210, 270, 330), 0),
        ((0, 20, 90, 160, 180, 270), 0),
        ((20, 90, 160, 200, 240, 270, 300, 340), 0),
    ],
)
def test_the_first_plane_of_c90_c270_is_where_every_reader_looks(tmp_path: Path, c: tuple[int, ...], isym: int) -> None:
    """Plane Mc1 = 3/4 Mc + 1 of the list is 270° [Stockmar1990]; where it cannot be, all planes are stored."""
    led = lid("C90-C270", c=c, gamma=(0, 45, 90))
    write_intensity(tmp_path / "a.ldt", led)
    lines = (tmp_path / "a.ldt").read_text(encoding="latin-1").splitlines()
    assert int(lines[2]) == isym
    planes, gammas = int(lines[3]), int(lines[5])
    listed = [float(line) for line in lines[42 : 42 + planes]]
    first = 3 * planes // 4 if isym == 3 else 0
    table = np.array([float(line) for line in lines[42 + planes + gammas :]]).reshape(-1, gammas)
    for row, values in enumerate(table * float(lines[28]) / 1000):
        np.testing.assert_allclose(values, led.at(listed[(first + row) % planes], led.gamma), rtol=1e-5)


def test_ratio_and_fraction_of_a_table_that_has_no_node_at_90(tmp_path: Path) -> None:
    led = lid("rotational", c=[0], gamma=[0, 60, 120, 180]).replace(luminaire={"lamp_flux": 20000.0, "lamps": 4})
    write_intensity(tmp_path / "a.ldt", led)
    lines = (tmp_path / "a.ldt").read_text(encoding="latin-1").splitlines()
    below = Intensity([0], [0, 60, 90], led.at(0, [[0, 60, 90]])).flux
    assert float(lines[21]) == pytest.approx(100 * below / led.flux, rel=1e-5)
    assert float(lines[22]) == pytest.approx(100 * led.flux / 20000, rel=1e-5)
    assert lines[26] == "4"


def test_numbers_have_no_power_of_ten(tmp_path: Path) -> None:
    led = Intensity([0], [0, 1, 90], [[3e9, 2.5e-7, 0.0]])
    write_intensity(tmp_path / "a.ldt", led)
    assert "e" not in "".join((tmp_path / "a.ldt").read_text(encoding="latin-1").splitlines()[20:]).lower()
    assert np.allclose(read_intensity(tmp_path / "a.ldt").values, led.values, rtol=1e-5, atol=0)


@pytest.mark.parametrize(
    ("led", "message"),
    [
        (lid("none").replace(flux_unit="W"), "luminous intensity only"),
        (Intensity([0], [0, 90], [[0, 0]]), "flux of 0 lm"),
        (Intensity(np.arange(722) * 0.4, [0, 90], np.arange(1444.0).reshape(722, 2)), "at most 721 planes"),
    ],
)
def test_what_the_format_cannot_hold(led: Intensity, message: str, tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match=message):
        write_intensity(tmp_path / "a.ldt", led)
    assert not list(tmp_path.iterdir())


def header(path: Path, count: int = 42) -> list[str]:
    return path.read_text(encoding="latin-1").splitlines()[:count]


def test_what_a_file_says_comes_back(read, tmp_path: Path) -> None:
    """Lines 2 and 13 to 32, but fluxes and ratios, are those of the file that was read."""
    stated = {13: 470, 14: 0, 15: 220, 16: 350, 17: 60, 18: 51, 19: 0, 20: 51, 21: 0, 25: 15}
    rows = ldt(1, [0], [0, 90], [100, 50], lines=stated)
    notes = write_intensity(tmp_path / "b.ldt", read(rows))
    lines = header(tmp_path / "b.ldt")
    kept = [2, *range(13, 22), *range(24, 33)]
    assert [lines[n - 1] for n in kept] == [rows[n - 1] for n in kept]
    assert lines[29:31] == ["3000 K", "80"]
    assert notes == ("the direct ratios are not kept: 0 was written, since étendue does not compute them",)
    write_intensity(tmp_path / "c.ldt", read(rows), rotate=90)
    assert header(tmp_path / "c.ldt")[12:21] == ["470", "0", "220", "60", "350", "0", "51", "0", "51"]


def test_ratios_of_nothing_are_not_missed(read, tmp_path: Path) -> None:
    rows = ldt(1, [0], [0, 90], [100, 50], lines=dict.fromkeys(range(33, 43), 0))
    assert write_intensity(tmp_path / "b.ldt", read(rows)) == ()


def test_a_conversion_factor_is_not_kept_and_that_is_told(read, tmp_path: Path) -> None:
    led = read(ldt(1, [0], [0, 90], [100, 50], lines={24: 0.9}))
    told = write_intensity(tmp_path / "b.ldt", led)
    assert "the conversion factor of 0.9 was not applied and is not kept" in told[0]
    again = read_intensity(tmp_path / "b.ldt")
    assert np.allclose(again.values, led.values)
    assert not any("conversion" in str(c) for c in again.complaints)


def test_a_turned_rectangle_is_told(read, tmp_path: Path) -> None:
    told = write_intensity(tmp_path / "b.ldt", read(ldt(1, [0], [0, 90], [100, 50])), rotate=45)
    assert "(box, 50 × 1100 × 4 mm) stands turned by 45° from the planes C" in told[0]
    assert header(tmp_path / "b.ldt")[12:17] == ["1200", "60", "80", "1100", "50"]


def test_a_turned_housing_is_told_where_it_is_written(tmp_path: Path) -> None:
    led = lid("both").replace(luminaire={"housing_x": 300.0, "housing_y": 100.0})
    (told,) = write_intensity(tmp_path / "b.ldt", led, rotate=45)
    assert told.startswith("the luminaire stands turned by 45°")
    (told,) = write_intensity(tmp_path / "b.ies", led, rotate=45)
    assert "size of the luminaire" in told


def test_what_ies_files_have_no_place_for_is_told(read, tmp_path: Path) -> None:
    sets = ((2, "LED", 500, "3000 K", "80", 12), (3, "big", 800, "", "", 20))
    led = read(ldt(1, [0], [0, 90], [100, 50], sets=sets, lines={24: 0.9, 25: 15}))
    told = "\n".join(write_intensity(tmp_path / "b.ies", led))
    for what in (
        "a linear one",
        "size of the luminaire",
        "heights",
        "colour",
        "lamp sets",
        "tilt",
        "conversion factor",
        "direct ratios",
    ):
        assert what in told


@pytest.mark.parametrize("name", ["luminance__sample_01", "luminance__sample_03", "py__sample5", "py__sample6"])
def test_real_files_keep_sizes_and_colours(samples: Path, tmp_path: Path, name: str) -> None:
    path = samples / "intensity" / f"eulumdat-{name}.ldt"
    told = write_intensity(tmp_path / "b.ldt", read_intensity(path))
    given, found = header(path), header(tmp_path / "b.ldt")
    assert [float(v) for v in found[12:21]] == [float(v) for v in given[12:21]]
    assert found[29:31] == given[29:31]
    assert any("direct ratios" in note for note in told) == (float(given[40]) > 0)
    assert any("luminaire ('œ' became '?')" in note for note in told) == (name == "py__sample6")


def test_a_housing_that_is_not_known_is_as_round_as_the_opening(tmp_path: Path) -> None:
    disk = {"opening_shape": "circle", "opening_x": 300.0, "opening_y": 300.0}
    write_intensity(tmp_path / "b.ldt", lid("both").replace(luminaire=disk))
    assert header(tmp_path / "b.ldt")[12:17] == ["300", "0", "0", "300", "0"]
