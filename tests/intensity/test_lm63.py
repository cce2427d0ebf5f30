"""IES LM-63 as it is met: editions, factors, sectors, tilt, openings, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.intensity import read_intensity, write_intensity
from etendue.quantities.intensity import Intensity
from oracles.intensity import lid

GAMMA = "0 45 90"


def ies(
    tag: str = "IESNA:LM-63-2002",
    *,
    keywords: str = "[TEST] t\n[MANUFAC] m",
    tilt: str = "TILT=NONE",
    head: str = "1 -1 1 3 {n} 1 2 0 0 0",
    factors: str = "1 1 20",
    gamma: str = GAMMA,
    c: str = "0",
    values: str = "10 6 1",
    end: str = "\n",
) -> bytes:
    parts = [tag, keywords, tilt, head.format(n=len(c.split())), factors, gamma, c, values]
    return ("\n".join(part for part in parts if part) + end).encode("latin-1")


@pytest.fixture
def read(tmp_path: Path) -> object:
    def call(content: bytes) -> Intensity:
        (tmp_path / "a.ies").write_bytes(content)
        return read_intensity(tmp_path / "a.ies")

    return call


# --- editions and factors --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tag", "factor"),
    [
        ("", 2 * 0.5 * 3),
        ("IESNA91", 2 * 0.5 * 3),
        ("IESNA95", 2 * 0.5),
        ("IESNA:LM-63-95", 2 * 0.5),
        ("IESNA:LM-63-1995", 2 * 0.5),
        ("IESNA:LM-63-2002", 2 * 0.5),
        ("IES:LM-63-2019", 2 * 0.5),
        ("sccs 1.2\nIESNA:LM-63-1991", 2 * 0.5 * 3),
    ],
)
def test_which_factors_multiply(read, tag: str, factor: float) -> None:
    """The ballast-lamp factor of 1986 and 1991 became "future use", and then the kind of file."""
    led = read(ies(tag, head="2 400 2 3 {n} 1 2 0 0 0", factors="0.5 3 20"))
    assert led.values.tolist() == [[10 * factor, 6 * factor, factor]]
    assert led.luminaire["lamp_flux"] == 800
    assert led.luminaire["input_power"] == 20
    complained = any("future use" in str(c) for c in led.complaints)
    assert complained == any(year in tag for year in ("95", "2002"))


def test_an_edition_that_never_was(read) -> None:
    led = read(ies("IESNA:LM-63-2005"))
    assert "no edition of 2005" in str(led.complaints[0])


@pytest.mark.parametrize("factors", [("1 -1 0", "1 1 20"), ("1 -1 1", "0 1 20"), ("1 -1 -2", "1 1 20")])
def test_factors_that_would_destroy_the_table_are_refused(read, factors: tuple[str, str]) -> None:
    with pytest.raises(FormatError, match="multiplies every candela value"):
        read(ies(head=f"{factors[0]} 3 1 1 2 0 0 0", factors=factors[1]))


def test_more_flux_than_the_lamps_have(read) -> None:
    assert "lumens per lamp" in str(read(ies(head="1 5 1 3 1 1 2 0 0 0")).complaints[0])
    assert not read(ies(head="1 50 1 3 1 1 2 0 0 0")).complaints


# --- the stream of numbers -------------------------------------------------------------------------------------------


def test_delimiters_and_line_ends_mean_nothing(read) -> None:
    plain = read(ies(c="0 90", values="10 6 1 10 7 2"))
    wild = ies(c="0 90", values="10 6 1 10 7 2").decode().split("TILT=NONE\n")
    wild[1] = (
        wild[1].replace("\n", " ").replace(" ", " ,\t\r\n", 7).replace("10 7", "1.0e1,+7.").replace("1 20", "1.0\n20")
    )
    again = read("TILT = none\n".join(wild).encode())
    assert np.array_equal(again.values, plain.values)
    assert np.array_equal(again.c, plain.c)


def test_what_follows_the_table_is_complained_about(read) -> None:
    led = read(ies(end="\nfoo bar baz\n"))
    assert led.values.tolist() == [[10, 6, 1]]
    assert "3 words" in str(led.complaints[0])
    assert not read(ies(end="\n\n \r\n\x1a")).complaints
    assert "cut short" in str(read(ies(end="")).complaints[0])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (ies(values="10 6"), "candela values: the file ends"),
        (ies(values="10 6 x"), r"line 9, candela values 3: 'x' is no number"),
        (ies(values="10 6 nan"), "no number"),
        (ies(values="10 6 1_0"), "no number"),
        (ies(values="10 6 1e999"), "no number"),
        (ies(gamma="0 90 45"), "vertical angles: they do not rise"),
        (ies(gamma="0 90 190"), "beyond 0° to 180°"),
        (ies(c="0 0", values="1 2 3 4 5 6"), "horizontal angles: they do not rise"),
        (ies(head="1 -1 1 3.5 1 1 2 0 0 0"), "number of vertical angles"),
        (ies(head="1 -1 1 3 0 1 2 0 0 0"), "number of horizontal angles"),
        (ies(head="1 -1 1 3 1 4 2 0 0 0"), "photometric type"),
        (ies(head="1 -1 1 3 1 1 3 0 0 0"), "units type"),
        (ies(tilt=""), "TILT="),
        (ies(keywords="[_INTENSITYUNITS] photons"), "photons"),
    ],
)
def test_what_is_refused(read, content: bytes, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read(content)


def test_values_below_zero_and_ranges_that_end_early(read) -> None:
    assert "1 are below 0" in str(read(ies(values="10 -6 1")).complaints[0])
    led = read(ies(gamma="0 20 60"))
    assert "0° to 60°" in str(led.complaints[0])
    assert led.at(0, [60, 61]).tolist() == [1, 0]


# --- sectors ---------------------------------------------------------------------------------------------------------


def planes(count: int) -> str:
    """Values 100·plane + row, so that no two are alike."""
    return " ".join(f"{100 * plane + row + 1}" for plane in range(count) for row in range(3))


@pytest.mark.parametrize(
    ("c", "whole", "order"),
    [
        ("0", [0], [0]),
        ("55", [0], [0]),
        ("0 30 90", [0, 30, 90, 150, 180, 210, 270, 330], [0, 1, 2, 1, 0, 1, 2, 1]),
        ("0 30 180", [0, 30, 180, 330], [0, 1, 2, 1]),
        ("90 120 270", [60, 90, 120, 270], [1, 0, 1, 2]),
        ("0 30 200 360", [0, 30, 200], [0, 1, 2]),
        ("0 120 240", [0, 120, 240], [0, 1, 2]),
        ("0 100 200 345", [0, 100, 200, 345], [0, 1, 2, 3]),
    ],
)
def test_sectors_become_the_whole_circle(read, c: str, whole: list[float], order: list[int]) -> None:
    led = read(ies("IESNA:LM-63-1995", c=c, values=planes(len(c.split()))))
    assert led.c.tolist() == whole
    assert led.values[:, 1].tolist() == [100 * plane + 2 for plane in order]


@pytest.mark.parametrize("c", ["0 45", "10 90", "90 180", "0 120", "180 360", "0 30 365", "0 90 180 361"])
def test_incomplete_sectors_are_refused(read, c: str) -> None:
    with pytest.raises(FormatError, match="no sector that symmetry completes"):
        read(ies(c=c, values=planes(len(c.split()))))


def test_planes_0_and_360_that_differ(read) -> None:
    led = read(ies(c="0 180 360", values=planes(3)))
    assert led.planes([360])[0].tolist() == [1, 2, 3]
    assert "differ by up to 200" in str(led.complaints[0])


def test_a_gap_in_the_circle_is_named(read) -> None:
    gap = "no plane between"
    led = read(ies("IESNA:LM-63-1995", c="0 10 20 190", values=planes(4)))
    assert not any(gap in str(complaint) for complaint in led.complaints)
    led = read(ies("IESNA:LM-63-1995", c="0 70 140 210", values=planes(4)))
    assert f"{gap} 210° and 360°" in str(led.complaints[0])


def test_commas_that_may_stand_between_thousands_are_refused(read) -> None:
    """1,250 is 1250 or 1.25 cd; beside 0,9 or 1000,5 it is 1.25."""
    with pytest.raises(FormatError, match=r"numbers: '1,250' may be 1250 or 1\.250, and so every number with a comma"):
        read(ies(values="1,250 1,100 980"))
    assert read(ies(values="1,250 1,100 0,9")).values.tolist() == [[1.25, 1.1, 0.9]]
    assert read(ies(values="1000,5 1,100 980")).values.tolist() == [[1000.5, 1.1, 980]]


# --- keywords, tilt, unit, opening -----------------------------------------------------------------------------------


def test_keywords(read) -> None:
    text = "[MANUFAC] Söhne\n[more] & Co\n label\n[BLOCK]\n[ENDBLOCK]\n[ _MINE ] a [b]\n[OTHER]\n[OTHER] x"
    facts = read(ies(keywords=text)).luminaire
    assert facts["manufacturer"] == "Söhne & Co"
    pairs = (("MANUFAC", "Söhne & Co"), ("", "label"), ("BLOCK", ""), ("ENDBLOCK", ""), ("_MINE", "a [b]"))
    assert facts["keywords"] == (*pairs, ("OTHER", ""), ("OTHER", "x"))


def test_tilt_is_kept_and_not_applied(read, tmp_path: Path) -> None:
    include = read(ies(tilt="TILT=INCLUDE\n1\n3\n0 45 90\n1.0 .95 .9"))
    assert include.luminaire["tilt"] == {"geometry": 1, "angles": [0, 45, 90], "factors": [1, 0.95, 0.9]}
    assert include.values.tolist() == [[10, 6, 1]]
    (told,) = map(str, include.complaints)
    assert "1 at 0°, 0.95 at 45°, 0.9 at 90°, were not applied" in told
    assert not read(ies(tilt="TILT=INCLUDE\n1\n3\n0 45 90\n1 1 1")).complaints
    many = read(ies(tilt=f"TILT=INCLUDE\n1\n91\n{' '.join(map(str, range(91)))}\n1 {'0.5 ' * 90}"))
    assert "0.5 at 10°, …, 0.5 at 90°, were not" in str(many.complaints[0])
    (tmp_path / "lamp.tlt").write_text("2 2\n0 90\n0.9 0.8\n")
    beside = read(ies(tilt="TILT=C:\\data\\lamp.tlt"))
    assert beside.luminaire["tilt"]["factors"] == [0.9, 0.8]
    assert "0.9; it was not applied" in str(beside.complaints[0])
    missing = read(ies(tilt="TILT=../other.tlt"))
    assert "is not there" in str(missing.complaints[0])
    # No system knows a name of 400 letters: it is an error to ask for it, and the table does not rest on it.
    assert "is not there" in str(read(ies(tilt=f"TILT={'9' * 400}")).complaints[0])
    with pytest.raises(FormatError, match="tilt angles: the file ends"):
        read(ies(tilt="TILT=INCLUDE\n1\n300\n0 45 90\n1.0 .95 .9"))
    assert any("tilt" in note for note in write_intensity(tmp_path / "b.ies", include))


@pytest.mark.parametrize(("unit", "factor"), [("mW/sr", 1e-3), ("W/sr", 1.0), ("uW/sr", 1e-6)])
def test_radiometric_files(read, tmp_path: Path, unit: str, factor: float) -> None:
    led = read(ies(keywords=f"[_INTENSITYUNITS]   {unit} \n[_TOTALLUMINAIRELUMENS] 5"))
    assert led.flux_unit == "W"
    assert np.allclose(led.values, np.array([[10, 6, 1]]) * factor)
    assert led.luminaire["stated_flux"] == pytest.approx(5 * factor)
    assert "_TOTALLUMINAIRELUMENS" in str(led.complaints[0])
    write_intensity(tmp_path / "b.ies", led)
    again = read_intensity(tmp_path / "b.ies")
    assert (again.flux_unit, again.flux) == ("W", pytest.approx(led.flux, rel=1e-5))


@pytest.mark.parametrize(
    ("tag", "lengths", "shape", "extents"),
    [
        ("2002", "0 0 0", "point", (0, 0, 0)),
        ("2002", "0.1 0.4 0", "rectangle", (400, 100, 0)),
        ("2002", "0.1 0.4 0.2", "box", (400, 100, 200)),
        ("2002", "0.1 0 0", "rectangle", (0, 100, 0)),
        ("2002", "-0.1 -0.1 0", "circle", (100, 100, 0)),
        ("2002", "-0.1 -0.4 0", "ellipse", (400, 100, 0)),
        ("2002", "-0.1 -0.1 0.3", "vertical cylinder", (100, 100, 300)),
        ("2002", "-0.1 -0.1 -0.1", "sphere", (100, 100, 100)),
        ("2002", "-0.1 -0.1 -0.3", "ellipsoid", (100, 100, 300)),
        ("2002", "-0.1 0.4 -0.1", "cylinder along length", (400, 100, 100)),
        ("2002", "0.1 -0.4 -0.4", "cylinder along width", (400, 100, 400)),
        ("2002", "-0.1 0 -0.1", "vertical ellipse", (0, 100, 100)),
        ("2002", "-0.1 0 -0.4", "vertical ellipse", (0, 100, 400)),
        ("2019", "0 -0.1 -0.4", "vertical ellipse", (100, 0, 400)),
        ("2002", "0.1 0.1 -0.1", "unknown: width 0.1, length 0.1, height -0.1 m", None),
        ("2002", "-0.1 0 0", "circle", (100, 100, 0)),
        ("1995", "-0.1 0 0", "circle", (100, 100, 0)),
        ("1995", "-0.1 0 -0.1", "sphere", (100, 100, 100)),
        ("1995", "-0.1 0 0.3", "vertical cylinder", (100, 100, 300)),
        ("1995", "0 0.4 -0.1", "cylinder along length", (400, 100, 100)),
        ("1995", "-0.1 0.4 -0.2", "ellipsoid", (400, 100, 200)),
    ],
)
def test_luminous_openings(
    read, tmp_path: Path, tag: str, lengths: str, shape: str, extents: tuple[float, float, float] | None
) -> None:
    """Width runs along C90-C270 (y), length along C0-C180 (x); what 2002 can say survives writing."""
    led = read(ies(f"IESNA:LM-63-{tag}", head=f"1 -1 1 3 1 1 2 {lengths}"))
    facts = led.luminaire
    assert facts["opening_shape"] == shape
    notes = write_intensity(tmp_path / "b.ies", led)
    again = read_intensity(tmp_path / "b.ies").luminaire
    assert bool(notes) == (extents is None)
    assert b"-0 " not in (tmp_path / "b.ies").read_bytes()
    if extents is not None:
        assert (facts["opening_x"], facts["opening_y"], facts["opening_z"]) == pytest.approx(extents)
        assert {k: v for k, v in again.items() if k.startswith("opening")} == pytest.approx(
            {k: v for k, v in facts.items() if k.startswith("opening")}
        )


def test_feet(read) -> None:
    assert read(ies(head="1 -1 1 3 1 1 1 1 2 0")).luminaire["opening_x"] == pytest.approx(609.6)


def test_what_is_written_is_the_edition_of_2002(tmp_path: Path) -> None:
    write_intensity(tmp_path / "a.ies", lid("both"))
    lines = (tmp_path / "a.ies").read_text(encoding="ascii").splitlines()
    assert lines[0] == "IESNA:LM-63-2002"
    keys = [line.split("]")[0][1:] for line in lines if line.startswith("[")]
    assert keys[:4] == ["TEST", "TESTLAB", "ISSUEDATE", "MANUFAC"]
    at = lines.index("TILT=NONE")
    assert lines[at + 1 : at + 3] == ["1 -1 1 37 7 1 2 0 0 0", "1 1 0"]
    assert lines[at + 4] == "0 15 30 45 60 75 90"
    write_intensity(tmp_path / "b.ies", lid("C90-C270"))
    assert " 25 1 2 0 0 0" in (tmp_path / "b.ies").read_text(encoding="ascii")  # 0 to 360: 90 to 270 is not in 2002


# --- what is written of a file that was read ---------------------------------------------------------------------------

TRUE = (
    "[NEARFIELD] 0.5 1\n[DISTRIBUTION] Type III\n[LAMPCAT] L-1\n[SEARCH] {a}\n[_COLOR] 4000 K\n[OTHER] first\n"
    "[OTHER] second\n[MANUFAC] another"
)


def keywords_of(path: Path) -> list[tuple[str, str]]:
    return list(read_intensity(path).luminaire["keywords"])


def test_keywords_that_stay_true_are_kept(read, tmp_path: Path) -> None:
    """IES to IES: every line but those of facts comes back, in its order, and nothing is told."""
    led = read(ies(keywords=f"[TEST] t\n[MANUFAC] m\n{TRUE}"))
    assert write_intensity(tmp_path / "b.ies", led) == ()
    given = [pair for pair in led.luminaire["keywords"] if pair not in {("TEST", "t"), ("MANUFAC", "m")}]
    found = keywords_of(tmp_path / "b.ies")
    assert [pair for pair in found if pair in given] == given
    assert read_intensity(tmp_path / "b.ies").luminaire["manufacturer"] == "m"
    again = read_intensity(tmp_path / "b.ies")
    assert write_intensity(tmp_path / "c.ies", again) == ()
    assert [pair for pair in keywords_of(tmp_path / "c.ies") if pair in given] == given


def test_keywords_that_cannot_be_kept_are_named(read, tmp_path: Path) -> None:
    led = read(ies(keywords=f"[TEST] t\n[MANUFAC] m\n[FOO] x\n[BLOCK]\n[_Ä] y\n{TRUE}\na label"))
    (told,) = write_intensity(tmp_path / "b.ies", led)
    assert told.endswith("are not kept: [FOO], [BLOCK], [_Ä]")
    assert ("OTHER", "a label") in keywords_of(tmp_path / "b.ies")
    (told,) = write_intensity(tmp_path / "b.ies", led, rotate=90)
    assert told.endswith("are not kept: [FOO], [BLOCK], [_Ä], [DISTRIBUTION]")
    told = "\n".join(write_intensity(tmp_path / "b.ldt", led))
    assert "without a line of their own are not kept: [FOO], [BLOCK], [_Ä], [NEARFIELD], [DISTRIBUTION]" in told


@pytest.mark.parametrize(("unit", "per_mw"), [("mW/sr", 1.0), ("W/sr", 1e-3), ("cd", 1.0)])
def test_a_stated_flux_is_kept_where_the_table_has_it(read, tmp_path: Path, unit: str, per_mw: float) -> None:
    """Watts are written as milliwatts, whatever the unit before; a flux that the table has not is named."""
    unstated = read(ies(keywords=f"[_INTENSITYUNITS] {unit}"))
    flux = unstated.flux * (per_mw * 1e3 if unstated.flux_unit == "W" else 1.0)
    led = read(ies(keywords=f"[_INTENSITYUNITS] {unit}\n[_TOTALLUMINAIRELUMENS] {1.02 * flux:.6g}"))
    assert write_intensity(tmp_path / "b.ies", led) == ()
    again = read_intensity(tmp_path / "b.ies")
    assert again.luminaire["stated_flux"] == pytest.approx(1.02 * led.flux, rel=1e-5)
    assert not again.complaints
    (told,) = write_intensity(tmp_path / "c.ies", led.scaled(2))
    assert told.endswith("[_TOTALLUMINAIRELUMENS]")
    assert "stated_flux" not in read_intensity(tmp_path / "c.ies").luminaire


def test_keywords_of_real_files(samples: Path, tmp_path: Path) -> None:
    """B1 states 91.6 mW before its multiplier of 1.32: untrue of the table, and named."""
    led = read_intensity(samples / "intensity" / "guv-calcs__B1_module.ies")
    (told,) = write_intensity(tmp_path / "b.ies", led)
    assert told.endswith("are not kept: [_TOTALLUMINAIRELUMENS]")
    found = dict(keywords_of(tmp_path / "b.ies"))
    for keyword in ("NEARFIELD", "DISTRIBUTION", "_RADIATIONTYPE"):
        assert found[keyword].split() == dict(led.luminaire["keywords"])[keyword].split()


def test_a_turned_file_says_so_and_nothing_else(read, tmp_path: Path) -> None:
    led = read(ies(head="1 -1 1 3 1 1 2 0.5 1.2 0.1"))
    (told,) = write_intensity(tmp_path / "b.ies", led, rotate=45)
    assert "(box, 1200 × 500 × 100 mm) stands turned by 45° from the planes C" in told
    text = " ".join((tmp_path / "b.ies").read_text("ascii").replace("[MORE]", "").split())
    assert "turned by 45 deg about the axis" in text
    assert "nothing was turned" not in text
    again = read_intensity(tmp_path / "b.ies").luminaire
    assert [again[f"opening_{axis}"] for axis in "xyz"] == pytest.approx([1200, 500, 100])
    assert write_intensity(tmp_path / "c.ies", led, rotate=90.0002) == ()
    quarter = read_intensity(tmp_path / "c.ies").luminaire
    assert [quarter[f"opening_{axis}"] for axis in "xyz"] == pytest.approx([500, 1200, 100])


@pytest.mark.parametrize("turn", [45.0, 90.0])
def test_what_an_untouched_copy_said_is_not_said_of_a_turned_one(read, tmp_path: Path, turn: float) -> None:
    write_intensity(tmp_path / "b.ies", read(ies()))
    assert "nothing was turned or mirrored" in " ".join((tmp_path / "b.ies").read_text("ascii").split())
    write_intensity(tmp_path / "c.ies", read_intensity(tmp_path / "b.ies"), rotate=turn)
    assert "nothing was turned" not in (tmp_path / "c.ies").read_text("ascii")


def test_letters_that_a_file_does_not_have_are_told(tmp_path: Path) -> None:
    facts = {"manufacturer": "Łódź", "luminaire": "1½ × ½ — 90°", "lamp": "LED ± 5 %"}
    led = lid("both").replace(luminaire=facts)
    (told,) = write_intensity(tmp_path / "b.ies", led)
    assert told.startswith("texts changed, since the format has ASCII letters only: ")
    assert "manufacturer ('Ł' became '?', 'ó' became 'o', 'ź' became 'z'); luminaire ('½' became '1/2'" in told
    assert "lamp" not in told
    again = read_intensity(tmp_path / "b.ies").luminaire
    assert (again["manufacturer"], again["luminaire"]) == ("?odz", "1 1/2 x 1/2 - 90 deg")
    (told,) = write_intensity(tmp_path / "b.ldt", led)
    assert told.endswith("Latin-1 letters only: manufacturer ('Ł' became '?', 'ź' became 'z')")
    assert read_intensity(tmp_path / "b.ldt").luminaire["luminaire"] == "1½ × ½ - 90°"
    (told,) = write_intensity(tmp_path / "b.ldt", lid("both").replace(luminaire={"luminaire": "x" * 500}))
    assert "luminaire (cut to 78 of 500 characters)" in told
    (told,) = write_intensity(tmp_path / "b.ldt", lid("both").replace(luminaire={"lamp": "\x96 5 W"}))
    assert r"lamp ('\x96' became ' ')" in told
    composed = lid("both").replace(luminaire={"luminaire": "Gro\u0308\xdfe\xa0½"})
    assert write_intensity(tmp_path / "b.ldt", composed) == ()
    assert read_intensity(tmp_path / "b.ldt").luminaire["luminaire"] == "Größe ½"
