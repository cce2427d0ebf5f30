"""Texts of intensity files as programs really write them: decimal commas, surplus words, control characters, encodings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.intensity import detect_intensity_format, read_intensity, write_intensity
from etendue.quantities.intensity import Intensity
from oracles.intensity import lid

IES = "IESNA:LM-63-2002\n{header}TILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n{values}\n{end}"
ENCODINGS = ["utf-8", "utf-8-sig", "utf-16", "utf-32", "latin-1"]


def read(folder: Path, values: str, header: str = "", end: str = "") -> Intensity:
    (folder / "a.ies").write_text(IES.format(values=values, header=header, end=end), encoding="utf-8")
    return read_intensity(folder / "a.ies")


def test_decimal_commas_are_read_where_only_they_make_sense(tmp_path: Path) -> None:
    led = read(tmp_path, "1000,5 900,2 700,1")
    assert led.values.tolist() == [[1000.5, 900.2, 700.1]]
    assert "3 have a decimal comma" in str(led.complaints[0])
    # In a list with commas between the numbers they are what the standard says.
    assert read(tmp_path, "1000,900,700").values.tolist() == [[1000.0, 900.0, 700.0]]
    assert not read(tmp_path, "1000,900, 700").complaints


@pytest.mark.parametrize("values", ["1000,5 900,2 700,1 5", "1 000 900 700", "9 8 7 6", "9 8 7\n6"])
def test_numbers_that_nothing_announced_are_no_data(values: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"a\.ies: line \d+.*(words more than the counts|ends)"):
        read(tmp_path, values)


def test_words_behind_the_table_are_told(tmp_path: Path) -> None:
    led = read(tmp_path, "9 8 7", end="made by hand")
    assert led.values.tolist() == [[9.0, 8.0, 7.0]]
    assert str(led.complaints[0]).startswith("warning: line 8: 3 words more")


def test_a_luminaire_named_like_a_line_of_the_other_format(tmp_path: Path) -> None:
    for name in ("TILT=INCLUDE fixture", "TILT=NONE", "IESNA:LM-63-2002", "tilt = none"):
        facts = {"luminaire": name, "manufacturer": name if name.startswith("IES") else "m"}
        for extension, kind in ((".ldt", "eulumdat"), (".ies", "lm63")):
            path = tmp_path / f"a{extension}"
            write_intensity(path, lid("both").replace(luminaire=facts))
            again = read_intensity(path)
            assert (again.provenance.format, again.luminaire["luminaire"]) == (kind, name)


@pytest.mark.parametrize("letter", ["\x1b", "\x00", "\x07"])
def test_control_characters_are_the_reason(letter: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"a\.ies: line 2: the control character '\\x"):
        read(tmp_path, "1 2 3", header=f"[TEST] {letter}[2J\n")


@pytest.mark.parametrize("name", ["led.ies", "led.ldt"])
@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("end", ["\r\n", "\n", "\r"])
def test_every_encoding_that_is_certain(name: str, encoding: str, end: str, tmp_path: Path) -> None:
    led = lid("both").replace(luminaire={"luminaire": "Leuchte SIZE 5"})
    write_intensity(tmp_path / name, led)
    text = (tmp_path / name).read_bytes().decode("latin-1").replace("SIZE", "Größe").replace("\r\n", end)
    (tmp_path / name).write_bytes(text.encode(encoding))
    again = read_intensity(tmp_path / name)
    assert np.allclose(again.at([0, 77], [3, 90]), led.at([0, 77], [3, 90]), rtol=1e-5)
    assert again.luminaire["luminaire"] == "Leuchte Größe 5"
    assert detect_intensity_format(tmp_path / name) is not None


@pytest.mark.parametrize("name", ["led.ies", "led.ldt"])
@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be"])
def test_wide_text_without_a_mark_is_named(name: str, encoding: str, tmp_path: Path) -> None:
    write_intensity(tmp_path / name, lid("both"))
    (tmp_path / name).write_bytes((tmp_path / name).read_bytes().decode("ascii").encode(encoding))
    with pytest.raises(FormatError, match=encoding.upper()):
        read_intensity(tmp_path / name)


def test_wide_text_that_is_cut_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_bytes(IES.format(values="1 2 3", header="", end="").encode("utf-16")[:-1])
    with pytest.raises(FormatError, match="no UTF-16-LE"):
        read_intensity(tmp_path / "a.ies")
