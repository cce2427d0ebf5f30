"""Rows of numbers in text files: what is understood, what is refused and in which line, and what a cut file still says."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, EtendueError, FormatError
from etendue.formats.head import Head
from etendue.formats.rays import ascii_table, lighttools_text, read_rays, speos_text, text_rows, tracepro, zemax_text
from etendue.formats.rays.ray_format import RayFormat
from etendue.formats.rays.text_rows import RowLayout, Rows, head_lines, number, read_rows

LAYOUT = RowLayout(fields={"direction": (0, 1, 2), "flux": (3,)}, columns=4, clause="test")
GIVEN = [[1.0, 2.5, -3.0, 0.25], [4.0, -5.5, 6e-16, 7e5], [0.125, 8.0, -9.75, 10.0]]
FORMATS = (zemax_text.FORMAT, lighttools_text.FORMAT, speos_text.FORMAT, tracepro.FORMAT, ascii_table.FORMAT)

Read = Callable[..., Rows]


@pytest.fixture
def parse(tmp_path: Path) -> Read:
    def parse(data: bytes, layout: RowLayout = LAYOUT, offset: int = 0, line: int = 1) -> Rows:
        path = tmp_path / "rows.txt"
        path.write_bytes(data)
        return read_rows(path, layout, offset=offset, line=line)

    return parse


def values(rows: Rows) -> list[list[float]]:
    return [[*record["direction"].tolist(), float(record["flux"])] for record in rows.records]


PLAIN = b"1 2.5 -3 .25\n4. -5.5 6e-016 7.0E+5\n0.125 8 -9.75 10\n"


@pytest.mark.parametrize(
    "data",
    [
        PLAIN,
        PLAIN.replace(b"\n", b"\r\n"),
        PLAIN.replace(b"\n", b"\n\r"),
        PLAIN.replace(b"\n", b"\r"),
        PLAIN.replace(b" ", b"\t"),
        PLAIN.replace(b" ", b"  \t "),
        PLAIN.replace(b"\n", b"  \t\n"),
        PLAIN.replace(b"\n", b"\n\n   \n"),
        b"\r\n" + PLAIN.replace(b"\n", b"\r\n") + b"\r\n\x1a",
        PLAIN + b"\x1a",
        PLAIN[:-1] + b"\x1a",
        PLAIN[:-1] + b"\r",
        PLAIN.replace(b"7.0E+5", b"7.0D+05"),
        PLAIN.replace(b"7.0E+5", b"7.0D5"),
        PLAIN.replace(b"7.0E+5", b".7d6").replace(b"6e-016", b"0.6-015"),
        PLAIN.replace(b"4.", b'"4"'),
    ],
)
def test_what_is_understood(parse: Read, data: bytes) -> None:
    rows = parse(data)
    assert values(rows) == GIVEN
    assert rows.complaints == ()


@pytest.mark.parametrize(
    ("separator", "data"),
    [
        (",", b"1,2.5,-3,.25\n4.,-5.5,6e-016 ,7.0E+5\n0.125, 8,-9.75,10\n"),
        (";", b"1;2.5;-3;.25\r\n4.;-5.5;6e-016;7.0E+5\r\n   \r\n0.125; 8;-9.75;10\r\n"),
        ("\t", PLAIN.replace(b" ", b"\t")),
    ],
)
def test_separators(parse: Read, separator: str, data: bytes) -> None:
    layout = RowLayout(fields=LAYOUT.fields, columns=4, clause="test", separator=separator)
    assert values(parse(data, layout)) == GIVEN


def test_decimal_comma(parse: Read) -> None:
    layout = RowLayout(fields=LAYOUT.fields, columns=4, clause="test", separator=";", decimal_comma=True)
    assert values(parse(b"1;2,5;-3;,25\n4,;-5,5;6e-016;7,0E+5\n0,125;8;-9,75;10\n", layout)) == GIVEN
    with pytest.raises(FormatError, match=r"line 2: both decimal points and decimal commas"):
        parse(b"1;2,5;-3;,25\n4,;-5.5;6e-016;7,0E+5\n", layout)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1.#INF", math.inf),
        ("-1.#INF00", -math.inf),
        ("-inf", -math.inf),
        ("1.5D+01", 15.0),
        ("-1.25d-2", -0.0125),
        ("0.1234-102", 0.1234e-102),
        ("7.24e-016", 7.24e-16),
    ],
)
def test_numbers(text: str, expected: float) -> None:
    assert number(text) == expected


@pytest.mark.parametrize("text", ["nan", "1.#QNAN", "-1.#IND", "-nan(ind)", "NAN"])
def test_undefined_numbers(text: str) -> None:
    assert math.isnan(number(text))


@pytest.mark.parametrize("text", ["", "x", "1_000", "0x10", "1,5", "1.2.3", "1e", "--1", "1.5-2", "+", "1.0D", "²"])
def test_what_is_no_number(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        number(text)


def test_values_that_are_not_finite_are_read_by_both_parsers(parse: Read) -> None:
    """Whether such rays are of use is the ray set's business."""
    rows = parse(b"1 2 nan 4\n1 2 3 1e400\n1 2 -1.#IND 4\n1 inf 3 4\n")
    found = np.array(values(rows))
    assert np.isnan(found[[0, 2], 2]).all()
    assert found[1, 3] == found[3, 1] == math.inf


@pytest.mark.parametrize(
    ("bad", "what"),
    [
        (b"1 2 3", "3 entries where 4 are expected: '1 2 3'"),
        (b"1 2 3 4 5", "5 entries where 4 are expected"),
        (b"1 2 3 x", "'x' is not a number"),
        (b"1 2 1_0 3", "'1_0' is not a number"),
        (b"1,2,3,4", "1 entries where 4 are expected"),
        (b"1 2 3\x00 4", "is not a number"),
        (b"end of data, really", "'end' is not a number"),
        (b"x" * 200, "1 entries where 4 are expected: 'xxx"),
    ],
)
@pytest.mark.parametrize("end_of_line", [b"\n", b"\r\n", b"\n\r", b"\r"])
def test_a_bad_row_is_refused_with_its_line(parse: Read, bad: bytes, what: str, end_of_line: bytes) -> None:
    good = PLAIN.replace(b"\n", end_of_line)
    data = b"title" + end_of_line + good + end_of_line + bad + end_of_line + good
    with pytest.raises(FormatError) as caught:
        parse(data, offset=len(b"title" + end_of_line), line=2)
    assert caught.value.place == "line 6"
    assert what in caught.value.found
    assert "4 entries" in caught.value.advice


def test_blocks_do_not_matter(parse: Read, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines that cross the borders of blocks, and line numbers counted over blocks."""
    rng = np.random.default_rng(5)
    table = rng.normal(size=(400, 4)) * 10.0 ** rng.integers(-200, 200, size=(400, 4))
    lines = ["\t".join(map(repr, row)) + "\r\n" for row in table.tolist()]
    for size in (1, 7, 64, 1000, 1 << 20):
        monkeypatch.setattr(text_rows, "BLOCK", size)
        assert np.array_equal(values(parse("".join(lines).encode())), table)
        broken = [*lines[:317], "1 2 3\r\n", *lines[317:]]
        with pytest.raises(FormatError, match="line 318: 3 entries"):
            parse("".join(broken).encode())


def test_columns_in_any_order_and_columns_that_are_not_read(parse: Read) -> None:
    layout = RowLayout(fields={"direction": (4, 1, 2), "flux": (0,)}, columns=5, clause="test")
    expected = [[5.0, 2.0, 3.0, 1.0], [50.0, 20.0, 30.0, 10.0]]
    assert values(parse(b"1 2 3 4 5\n10 20 30 40 50\n", layout)) == expected
    assert values(parse(b"1 2 3 blue 5\n10 20 30 red 50\n", layout)) == expected


def test_comments_are_skipped_where_the_format_has_them(parse: Read) -> None:
    layout = RowLayout(fields=LAYOUT.fields, columns=4, clause="test", comments=("#", "//"))
    lines = PLAIN.splitlines(keepends=True)
    data = b"# a\n" + lines[0] + b"// b 1 2 3 4\n" + lines[1] + lines[2] + b"# end"
    assert values(parse(data, layout)) == GIVEN
    with pytest.raises(FormatError, match="line 1"):
        parse(data)


# --- the end of the data -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "tail", [b"END\n", b"Total power of all: 3.5 W\n\n", b"END", b"end of rays\r\nsecond line\nthird line 1 2\n"]
)
def test_text_behind_the_rows_is_ignored_with_a_warning(parse: Read, tail: bytes) -> None:
    rows = parse(PLAIN + tail)
    assert values(rows) == GIVEN
    (complaint,) = rows.complaints
    assert (complaint.severity, complaint.place) == (("error" if tail == b"END" else "warning"), "line 4")


def test_text_before_further_rows_is_no_tail(parse: Read) -> None:
    with pytest.raises(FormatError, match="line 4"):
        parse(PLAIN + b"END\n" + b"text\n" * 10 + PLAIN)


def test_text_longer_than_is_looked_at_is_no_tail(parse: Read) -> None:
    with pytest.raises(FormatError, match="line 4"):
        parse(PLAIN + b"text\n" * text_rows.TAIL)


def test_a_cut_last_row_is_left_out(parse: Read) -> None:
    for tail in (b"1", b"1 2", b"1 2 -", b"1 2 3 ", b"1 2 3 4e", b"1 2 3 4e-"):
        rows = parse(PLAIN + tail)
        assert values(rows) == GIVEN
        assert [c.severity for c in rows.complaints] == ["error"]
        assert rows.complaints[0].place == "line 4"
    for tail in (b"1 x 3", b"x 2 3 4", b"1 2 3 4 5"):
        with pytest.raises(FormatError, match="line 4"):
            parse(PLAIN + tail)


def test_a_missing_last_line_end_is_told(parse: Read) -> None:
    rows = parse(PLAIN[:-1])
    assert values(rows) == GIVEN
    assert [(c.severity, c.place) for c in rows.complaints] == [("warning", "line 3")]


def test_stated_numbers_of_rows(parse: Read) -> None:
    def stating(expected: int) -> RowLayout:
        return RowLayout(fields=LAYOUT.fields, columns=4, clause="test", expected=expected, stated_at="line 0")

    assert parse(PLAIN, stating(3)).complaints == ()
    short = parse(PLAIN, stating(10**18))
    assert values(short) == GIVEN
    assert [(c.severity, c.place) for c in short.complaints] == [("error", "line 0")]
    assert "999,999,999,999,999,997 are missing" in short.complaints[0].found
    long = parse(PLAIN, stating(2))
    assert values(long) == GIVEN
    assert [c.severity for c in long.complaints] == ["warning"]
    # Behind the stated number of rows anything may follow; before, nothing may.
    assert values(parse(PLAIN + b"1 2 3\nx\n" + PLAIN, stating(3))) == GIVEN
    with pytest.raises(FormatError, match="line 4"):
        parse(PLAIN + b"1 2 3\nx\n" + PLAIN, stating(4))
    # The last number of a file that is known to be short is not trusted.
    cut = parse(PLAIN[:-1], stating(4))
    assert values(cut) == GIVEN[:2]
    assert [c.severity for c in cut.complaints] == ["error", "error"]


def test_end_markers(parse: Read) -> None:
    layout = RowLayout(fields=LAYOUT.fields, columns=4, clause="test", end="lt_end")
    for tail in (b"lt_end", b"LT_EndOfData\r\n", b" lt_end\n\n\n"):
        rows = parse(PLAIN + tail, layout)
        assert (values(rows), rows.complaints) == (GIVEN, ())
    noted = parse(PLAIN + b"lt_end\n1 2 3 4\n", layout)
    assert values(noted) == GIVEN
    assert [c.severity for c in noted.complaints] == ["note"]
    for tail in (b"", b"lt_e"):
        missing = parse(PLAIN + tail, layout)
        assert values(missing) == GIVEN
        assert "truncated" in missing.complaints[-1].found
    assert values(parse(PLAIN[:-1], layout)) == GIVEN[:2]


@pytest.mark.parametrize("data", [b"", b"\n\n", b"  ", b"\x1a", b"1 2"])
def test_no_rows_at_all(parse: Read, data: bytes) -> None:
    with pytest.raises(FormatError, match="line 7: no ray follows"):
        parse(data, line=7)


def test_a_line_without_end_does_not_fill_the_memory(parse: Read, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_rows, "BLOCK", 1 << 12)
    with pytest.raises(FormatError, match="line 4: no end within 65,536 bytes"):
        parse(PLAIN + b"1 " * (1 << 17))


def test_head_lines_with_byte_order_mark_and_a_cut_head() -> None:
    data = b"\xef\xbb\xbfab\r\n\r\n c \nlast"
    whole = head_lines(Head(Path("x"), len(data), data))
    assert [(line.number, line.text, line.start, line.end) for line in whole] == [
        (1, "ab", 3, 7), (2, "", 7, 9), (3, "c", 9, 13), (4, "last", 13, 17),
    ]  # fmt: skip
    assert [line.text for line in head_lines(Head(Path("x"), 10**9, data))] == ["ab", "", "c"]


# --- all text formats ----------------------------------------------------------------------------------------------------


def sample(rays: int, seed: int = 11) -> et.RaySet:
    rng = np.random.default_rng(seed)
    direction = rng.normal(loc=(0.3, -0.2, 2.0), size=(rays, 3))
    return et.RaySet(
        rng.normal(loc=(4, -5, 6), scale=(1, 2, 3), size=(rays, 3)),
        direction / np.linalg.norm(direction, axis=1)[:, None],
        rng.exponential(size=rays),
        flux_unit="W",
        wavelength=rng.uniform(400, 700, rays),
    )


@pytest.fixture(params=FORMATS, ids=lambda f: f.name)
def text_format(request: pytest.FixtureRequest) -> RayFormat:
    chosen: RayFormat = request.param
    return chosen


@pytest.mark.slow
def test_all_numbers_come_back(tmp_path: Path, text_format: RayFormat) -> None:
    rays = sample(70_000)  # more than two stretches of the writer
    path = tmp_path / "rays.txt"
    text_format.write(rays, path)
    back = read_rays(path)
    assert back.provenance.format == text_format.name
    # Metres and micrometres cost a rounding.
    np.testing.assert_allclose(back.position, rays.position, rtol=4e-16, atol=0)
    np.testing.assert_allclose(back.direction, rays.direction, rtol=0, atol=3e-16)
    scale = rays.total_flux / back.total_flux
    if text_format is not speos_text.FORMAT:  # which has no total flux
        assert scale == pytest.approx(1, rel=1e-12)
    np.testing.assert_allclose(back.flux * scale, rays.flux, rtol=1e-12)
    if text_format is not tracepro.FORMAT:
        assert back.wavelength is not None
        np.testing.assert_allclose(back.wavelength, rays.wavelength, rtol=4e-16)


def test_unusable_rays_are_not_written(tmp_path: Path, text_format: RayFormat) -> None:
    rays = sample(9)
    position, direction, flux = rays.position, rays.direction, rays.flux
    position[1, 2], direction[4], flux[8] = np.nan, 0, -1
    damaged = et.RaySet(position, direction, flux, flux_unit="W", wavelength=rays.wavelength)
    with pytest.warns(UserWarning, match="left out"):
        notes = text_format.write(damaged, tmp_path / "rays.txt")
    assert any("3 of 9 rays are not written" in note for note in notes)
    back = read_rays(tmp_path / "rays.txt")
    kept = [0, 2, 3, 5, 6, 7]
    np.testing.assert_allclose(back.position, rays.position[kept], rtol=4e-16)
    if text_format is not tracepro.FORMAT:
        assert back.wavelength is not None
        np.testing.assert_allclose(back.wavelength, np.asarray(rays.wavelength)[kept], rtol=4e-16)


def test_nothing_usable_is_not_written(tmp_path: Path, text_format: RayFormat) -> None:
    rays = et.RaySet([[0, 0, np.nan]], [[0, 0, 1]], [1.0], flux_unit="W", wavelength=[500.0])
    with pytest.warns(UserWarning, match="left out"), pytest.raises(ArgumentError, match="nothing to write"):
        text_format.write(rays, tmp_path / "rays.txt")


@pytest.mark.slow
@pytest.mark.parametrize("rays", [1, 3])
def test_truncation_at_every_byte(tmp_path: Path, text_format: RayFormat, rays: int) -> None:
    """A cut file is refused, or complained about; the rays that are read are those that were written, but for the last."""
    path = tmp_path / "rays.txt"
    text_format.write(sample(rays), path)
    data = path.read_bytes()
    uncut = text_format.read(path)
    whole, usual = uncut.records, set(uncut.meaning.complaints)
    for size in range(len(data)):
        path.write_bytes(data[:size])
        try:
            cut = read_rays(path)
        except FormatError:
            continue
        assert cut.provenance.format == text_format.name, size
        missing_only_the_line_end = data[size:].strip() == b""
        severities = {c.severity for c in cut.meaning.complaints if c not in usual}
        assert missing_only_the_line_end or severities & {"warning", "error"}, size
        certain = len(cut) if "error" in severities else len(cut) - 1
        for name in cut.records.dtype.names or ():
            assert np.array_equal(cut.records[name][:certain], whole[name][:certain]), size
        if len(cut) < rays:
            assert "error" in severities, size


@pytest.mark.slow
def test_no_damage_leads_to_another_error(tmp_path: Path, text_format: RayFormat) -> None:
    path = tmp_path / "rays.txt"
    text_format.write(sample(4), path)
    data = path.read_bytes()
    rng = np.random.default_rng(3)
    refused = 0
    for _ in range(300):
        damaged = bytearray(data)
        for at in rng.integers(0, len(data), size=rng.integers(1, 4)):
            damaged[at] = rng.choice([rng.integers(0, 256), damaged[at] ^ (1 << rng.integers(0, 8))])
        path.write_bytes(bytes(damaged))
        try:
            rays = read_rays(path)
        except EtendueError:
            refused += 1
        else:
            assert rays.records.dtype["flux"] == np.float64
    assert 20 < refused < 280  # the damage is neither harmless nor total


def test_absurd_counts_allocate_nothing(tmp_path: Path) -> None:
    path = tmp_path / "rays.txt"
    path.write_text("999999999999999 4 0 0\n1 2 3 0 0 1 5\n")
    assert len(read_rays(path)) == 1
    path.write_text("999999999999999\n1 1 2 3 0 0 1 550 1\n")
    assert len(read_rays(path)) == 1
