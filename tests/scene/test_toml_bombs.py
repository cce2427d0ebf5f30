"""Small scene files that ask for much: each is an error with its place, found before memory or time is spent on it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import etendue as et
import pytest
from etendue.errors import EtendueError, SceneError
from etendue.scene import Scene

SOURCE = '[[sources]]\nkind = "surface"\nshape = { kind = "disk", radius = 3 }\nflux = {flux}\n'.replace("{flux}", "%s")
BOMBS = {
    "dotted key": (".".join("a" * 20_000) + " = 1\n", "line 1: a key of more than 16 parts"),
    "quoted key": ("# remark\n" + " . ".join(["'a'"] * 20_000) + " = 1\n", "line 2: a key of more than 16 parts"),
    "table": ("x = '''\n'''\n[" + ".".join("a" * 20_000) + "]\n", "line 3: a key of more than 16 parts"),
    "behind quotes": ('x = """"q\\""""\n' + ".".join("a" * 20_000) + " = 1\n", "line 2: a key of more than 16 parts"),
    "integer": (SOURCE % ("9" * 6000), "line 4: a number of 6,000 digits"),
    "hexadecimal": (SOURCE % ("0x" + "f" * 6000), "line 4: a number of 6,002 digits"),
    "arrays": ("a = " + "[" * 100_000, "line 1: brackets within brackets"),
    "tables": ("a = " + "{a = " * 100_000, "line 1: brackets within brackets"),
    "sources": ("sources = [" + "1," * 400_000 + "]", "there are 400,000; a scene may have 100,000"),
    "spectrum": (SOURCE % 1 + "spectrum = [" + "'x'," * 200_000 + "]", "spectrum[0]: is 'x'"),
    "large": ("#" * ((1 << 25) + 1), "more than 32 MiB"),
}
LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (3 << 29, 3 << 29))
resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
from etendue.scene import Scene
for path in sys.argv[1:]:
    try:
        Scene.load(path)
    except ValueError as error:
        print(str(error)[:300].replace(chr(10), " "))
"""


@pytest.mark.slow
def test_bombs_are_told_with_their_place_in_little_memory(tmp_path: Path) -> None:
    paths = []
    for number, (text, _) in enumerate(BOMBS.values()):
        paths.append(tmp_path / f"{number}.toml")
        paths[-1].write_text(text)
    told = subprocess.run([sys.executable, "-c", LIMITED, *paths], capture_output=True, text=True, check=True)
    for line, path, (_, expected) in zip(told.stdout.splitlines(), paths, BOMBS.values(), strict=True):
        assert line.startswith(f"{path}: ")
        assert expected in line


@pytest.mark.parametrize(
    "detector",
    [
        'kind = "illuminance"\nwidth = 1\nheight = 1\ncolumns = 1000000000000\nrows = 1',
        'kind = "illuminance"\nwidth = 1\nheight = 1\ncolumns = 65536\nrows = 65536',
        'kind = "intensity"\nc_planes = 1000000000000',
    ],
)
def test_counts_that_no_memory_holds_are_named(detector: str, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(f"{SOURCE % 1}[[detectors]]\n{detector}\n")
    with pytest.raises(EtendueError, match=r"1000000000000|4,294,967,296|4294967296"):
        et.trace(Scene.load(tmp_path / "a.toml"), rays=10)


@pytest.mark.slow
def test_long_texts_and_numbers_in_rows_are_no_bombs(tmp_path: Path) -> None:
    row = ", ".join(f"[{400 + i / 100}, 1.0]" for i in range(30_000))
    (tmp_path / "a.toml").write_text(f'name = """{"a.b." * 1000}"""\n{SOURCE % 1}spectrum = [{row}]\n')
    assert len(Scene.load(tmp_path / "a.toml").sources) == 1


def test_a_number_that_python_cannot_spell_out() -> None:
    with pytest.raises(SceneError, match="thousands of digits"):
        Scene(wavelength=10**5000)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings_that_are_certain(encoding: str, end: str, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_bytes(f'name = "größer"{end}wavelength = 450{end}'.encode(encoding))
    scene = Scene.load(tmp_path / "a.toml")
    assert (scene.name, scene.wavelength) == ("größer", 450)


def test_encodings_that_are_not(tmp_path: Path) -> None:
    for encoding, reason in (("utf-16-le", "UTF-16-LE"), ("utf-32-be", "UTF-32-BE"), ("latin-1", "byte 10: no UTF-8")):
        (tmp_path / "a.toml").write_bytes('name = "größer"\n'.encode(encoding))
        with pytest.raises(SceneError, match=reason):
            Scene.load(tmp_path / "a.toml")


def test_cut_at_every_byte_or_with_any_byte_changed(tmp_path: Path) -> None:
    data = (SOURCE % 1 + 'name = "é"\n[[solids]]\nshape = { kind = "ball", radius = 1 }\nat = [0, 0, 9]\n').encode()
    path = tmp_path / "a.toml"
    refused = 0
    for place in range(len(data)):
        for changed in (data[:place], data[:place] + b"\x00" + data[place + 1 :], data[:place] + b"[" + data[place:]):
            path.write_bytes(changed)
            try:
                Scene.load(path)
            except SceneError:
                refused += 1
    assert refused > 2 * len(data)
