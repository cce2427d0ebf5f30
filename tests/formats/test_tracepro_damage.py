"""Small TracePro properties of each kind of scatter, cut at every byte, and with absurd numbers."""

from __future__ import annotations

import contextlib
import itertools
from pathlib import Path

import pytest
from etendue.errors import EtendueError, FormatError
from etendue.formats.bsdf import read_bsdf_data
from oracles.tracepro_files import small_files

FILES = small_files()


@pytest.fixture(autouse=True)
def few_angles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables made of formulas at two angles of incidence: it is the file that is looked at."""
    for angles in ("INCIDENCES", "SPARSE"):
        monkeypatch.setattr(f"etendue.formats.bsdf.tracepro_models.{angles}", (0.0, 60.0))


@pytest.mark.slow
@pytest.mark.parametrize("kind", FILES)
def test_cut_at_every_byte(tmp_path: Path, kind: str) -> None:
    """An error that says so; but a file without tables that is cut after a row is a property of fewer rows."""
    whole = FILES[kind]
    path = tmp_path / "cut.txt"
    path.write_bytes(whole)
    assert read_bsdf_data(path).name == "by hand"
    read_in_part = 0
    for cut in range(len(whole)):
        path.write_bytes(whole[:cut])
        if kind in ("ABg", "elliptical ABg", "elliptical Gaussian", "1D ABg") and whole[:cut].endswith(b"\n"):
            with contextlib.suppress(FormatError):
                read_bsdf_data(path)
                read_in_part += 1
            continue
        with pytest.raises(FormatError):
            read_bsdf_data(path)
    assert read_in_part <= 1


@pytest.mark.slow
@pytest.mark.parametrize("kind", FILES)
def test_absurd_numbers(tmp_path: Path, kind: str) -> None:
    """Each number of the last row by something absurd: a BSDF or an error of ours, and no warning."""
    text = FILES[kind].decode()
    path = tmp_path / "absurd.txt"
    lines = text.splitlines()
    sections = [k for k, line in enumerate(lines) if line.startswith("[Table") or k == len(lines) - 1]
    # The last row of shares, and of the table.
    for k in {max(j for j in range(end + 1) if lines[j].startswith("300")) for end in sections}:
        fields = lines[k].split()
        for j, absurd in itertools.product(range(len(fields)), ("0", "-1", "1e300", "1e-300", "360")):
            changed = [*fields[:j], absurd, *fields[j + 1 :]]
            path.write_text("\n".join([*lines[:k], " ".join(changed), *lines[k + 1 :], ""]))
            with contextlib.suppress(EtendueError):
                read_bsdf_data(path)


def test_tables_of_another_temperature_than_the_shares_are_refused(tmp_path: Path) -> None:
    """Shares at 300 K, and a table at 310 K alone."""
    kind = next(kind for kind, text in FILES.items() if b"[Table" in text)
    head, mark, table = FILES[kind].decode().partition("[Table")
    path = tmp_path / "warm.txt"
    path.write_text(head + mark + table.replace("\n300", "\n310"))
    with pytest.raises(FormatError, match=r"warm\.txt: line \d+: no table for "):
        read_bsdf_data(path)
