"""Files of intensity: every format of the registry goes through the same trials."""

from __future__ import annotations

import importlib
import os
import pkgutil
from pathlib import Path

import etendue as et
import etendue.formats.intensity
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError, UnknownNameError
from etendue.formats.intensity import INTENSITY_FORMATS, detect_intensity_format, read_intensity, write_intensity
from etendue.quantities.intensity import Intensity
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from oracles.intensity import TERMS, lid
from oracles.luminaire_files import write_any

ALL = pytest.mark.parametrize("name", INTENSITY_FORMATS)
WRITTEN = pytest.mark.parametrize("name", [name for name, f in INTENSITY_FORMATS.items() if f.write])
DIGITS = 1e-5
"""Six significant digits are stored."""


def path_of(name: str, folder: Path) -> Path:
    return folder / f"led{INTENSITY_FORMATS[name].extension}"


def assert_same_function(found: Intensity, expected: Intensity, tolerance: float = DIGITS) -> None:
    """At the nodes of both, which is everywhere."""
    c = np.union1d(found.c, expected.c)[:, None]
    gamma = np.union1d(found.gamma, expected.gamma)
    assert np.allclose(found.at(c, gamma), expected.at(c, gamma), rtol=tolerance, atol=tolerance * expected.maximum)


def test_the_registry_holds_every_module_that_has_a_format() -> None:
    package = etendue.formats.intensity
    modules = [importlib.import_module(f"{package.__name__}.{m.name}") for m in pkgutil.iter_modules(package.__path__)]
    assert {m.FORMAT.name for m in modules if hasattr(m, "FORMAT")} == set(INTENSITY_FORMATS)
    assert set(INTENSITY_FORMATS) == {"lm63", "eulumdat", "tm33", "gldf"}


# --- round trips -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@WRITTEN
@pytest.mark.parametrize("symmetry", TERMS)
@pytest.mark.parametrize(
    "c",
    [
        tuple(range(0, 360, 15)),
        tuple(np.arange(7.5, 360, 15)),  # no plane at 0°, 90°, …
        (0, 10, 50, 90, 130, 170, 180, 190, 230, 270, 310, 350),  # uneven
    ],
    ids=["even", "shifted", "uneven"],
)
@pytest.mark.parametrize("gamma", [(0, 90), tuple(range(0, 181, 5)), (90, 91, 110, 180)], ids=["down", "all", "up"])
def test_round_trip(name: str, symmetry: str, c: tuple[float, ...], gamma: tuple[float, ...], tmp_path: Path) -> None:
    led = lid(symmetry, c=c, gamma=gamma)
    lost = write_intensity(path_of(name, tmp_path), led)
    again = read_intensity(path_of(name, tmp_path))
    assert_same_function(again, led)
    assert again.symmetry(1e-4) == led.symmetry(1e-4)
    assert (lost, again.complaints, again.flux_unit) == ((), (), "lm")
    assert again.flux == pytest.approx(led.flux, rel=1e-5)
    assert list(tmp_path.iterdir()) == [path_of(name, tmp_path)]


@WRITTEN
def test_what_was_read_is_written_without_further_loss(name: str, tmp_path: Path) -> None:
    write_intensity(path_of(name, tmp_path), lid("C0-C180"))
    once = read_intensity(path_of(name, tmp_path))
    write_intensity(path_of(name, tmp_path), once)
    twice = read_intensity(path_of(name, tmp_path))
    assert_same_function(twice, once, 2e-6)
    assert twice.luminaire.keys() == once.luminaire.keys()


@WRITTEN
def test_symmetry_makes_files_smaller(name: str, tmp_path: Path) -> None:
    size = {}
    for symmetry in TERMS:
        write_intensity(path_of(name, tmp_path), lid(symmetry))
        size[symmetry] = path_of(name, tmp_path).stat().st_size
    assert size["rotational"] < 0.6 * size["both"] < 0.4 * size["C0-C180"] < 0.3 * size["none"]


@WRITTEN
def test_rays_to_file_and_back(name: str, tmp_path: Path) -> None:
    led = et.intensity_distribution(et.RingSource(rays=50_000, seed=1), 8, 15)
    lost = write_intensity(path_of(name, tmp_path), led)
    assert lost == ("standard errors are not kept",)
    assert_same_function(read_intensity(path_of(name, tmp_path)), led)


@WRITTEN
def test_a_table_that_ends_early_goes_on_with_zero(name: str, tmp_path: Path) -> None:
    led = lid("none", gamma=[10, 30, 60])
    (note, other) = write_intensity(path_of(name, tmp_path), led)
    assert "ramp" in note
    assert "γ = 60°" in other
    again = read_intensity(path_of(name, tmp_path))
    assert (again.gamma[0], again.gamma[-1]) == (0, 90)
    assert np.allclose(
        again.at(led.c[:, None], [5, 10, 45, 60, 61]), led.at(led.c[:, None], [5, 10, 45, 60, 61]), rtol=1e-5
    )
    assert again.flux == pytest.approx(led.flux, rel=1e-3)


@WRITTEN
def test_text_and_facts(name: str, tmp_path: Path) -> None:
    facts = {
        "manufacturer": "Łampa & Söhne\r\n[X] injected", "luminaire": "x" * 500, "catalogue_number": "№ 7", "lamps": 3,
        "lamp_flux": 9000.0, "input_power": 12.5, "opening_shape": "rectangle", "opening_x": 250.0, "opening_y": 1200.0,
        "opening_z": 0.0,
    }  # fmt: skip
    led = lid("both").replace(luminaire=facts)
    write_intensity(path_of(name, tmp_path), led)
    again = read_intensity(path_of(name, tmp_path))
    assert_same_function(again, led)
    for fact in ("lamps", "lamp_flux", "input_power", "opening_shape", "opening_x", "opening_y", "opening_z"):
        assert again.luminaire[fact] == facts[fact]
    assert str(again.luminaire["manufacturer"]).startswith("?ampa &")
    data = path_of(name, tmp_path).read_bytes()
    assert b"\r\n" in data
    assert not data.replace(b"\r\n", b"").count(b"\n")
    assert max(map(len, data.split(b"\r\n"))) <= 132


@WRITTEN
def test_turned_and_mirrored_on_the_way_out(name: str, tmp_path: Path) -> None:
    led = lid("none")
    write_intensity(path_of(name, tmp_path), led, rotate=90, mirror=True)
    again = read_intensity(path_of(name, tmp_path))
    c = np.arange(0, 360, 7.0)[:, None]
    assert np.allclose(again.at(90 - c, [20, 70, 140]), led.at(c, [20, 70, 140]), rtol=1e-5)


def test_from_one_format_to_the_other_nothing_is_turned_and_that_is_said(tmp_path: Path) -> None:
    write_intensity(tmp_path / "a.ies", lid("none"))
    ies = read_intensity(tmp_path / "a.ies")
    assert any("rotate=90 turns" in note for note in write_intensity(tmp_path / "b.ldt", ies))
    assert_same_function(read_intensity(tmp_path / "b.ldt"), ies)
    assert not any("rotate" in note for note in write_intensity(tmp_path / "b.ldt", ies, rotate=90))
    assert any(
        "rotate=-90 turns" in note for note in write_intensity(tmp_path / "c.ies", read_intensity(tmp_path / "b.ldt"))
    )


# --- recognition and refusals ----------------------------------------------------------------------------------------


@ALL
def test_the_content_decides_not_the_extension(name: str, tmp_path: Path) -> None:
    write_any(name, tmp_path / "led.xyz", lid("none"))
    found = detect_intensity_format(tmp_path / "led.xyz")
    assert found is not None
    assert found.name == name
    assert_same_function(read_intensity(tmp_path / "led.xyz"), lid("none"))
    data = (tmp_path / "led.xyz").read_bytes()
    if not data.startswith(b"PK"):
        (tmp_path / "LED").write_bytes(b"\xef\xbb\xbf" + data)
        assert_same_function(read_intensity(tmp_path / "LED"), lid("none"))


@WRITTEN
@pytest.mark.parametrize("end", [b"\n", b"\r"])
def test_line_ends_of_any_system(name: str, end: bytes, tmp_path: Path) -> None:
    path = path_of(name, tmp_path)
    write_intensity(path, lid("both"))
    path.write_bytes(path.read_bytes().replace(b"\r\n", end))
    assert_same_function(read_intensity(path), lid("both"))


@pytest.mark.parametrize("content", [b"", b"\n" * 50, b"hello\n" * 50, bytes(range(256)) * 20, b"1 2 3 4 5 6 7\n" * 40])
def test_other_files_are_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_bytes(content)
    with pytest.raises(FormatError, match=r"a\.ies"):
        read_intensity(tmp_path / "a.ies")


def test_ray_files_are_no_intensity_files(samples: Path) -> None:
    from etendue.formats.rays import detect_format

    for path in (samples / "rays").iterdir():
        assert detect_intensity_format(path) is None
    for path in (samples / "intensity").iterdir():
        with pytest.raises(FormatError):
            detect_format(path)


@pytest.mark.parametrize("name", ["lm63", "eulumdat"])
def test_files_that_hold_one_distribution_have_none_to_name(name: str, tmp_path: Path) -> None:
    write_intensity(path_of(name, tmp_path), lid("none"))
    with pytest.raises(ArgumentError, match="hold one distribution"):
        read_intensity(path_of(name, tmp_path), "1")


def test_a_pipe_is_left_to_those_who_read_pipes(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert detect_intensity_format(tmp_path / "pipe") is None
    with pytest.raises(ArgumentError, match="this is a pipe"):
        read_intensity(tmp_path / "pipe")


def test_wrong_names_and_places(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="'eulumdat'"):
        write_intensity(tmp_path / "a", lid("none"), format="eulumdata")
    with pytest.raises(UnknownNameError, match=r"\.ldt"):
        write_intensity(tmp_path / "a.ltd", lid("none"))
    with pytest.raises(ArgumentError, match="does not exist"):
        write_intensity(tmp_path / "b" / "a.ies", lid("none"))
    with pytest.raises(OSError, match="nothing"):
        read_intensity(tmp_path / "nothing.ies")
    assert not list(tmp_path.iterdir())


# --- damage ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@WRITTEN
@pytest.mark.parametrize("symmetry", ["none", "rotational", "C90-C270"])
def test_cut_at_every_byte(name: str, symmetry: str, tmp_path: Path) -> None:
    """A cut is an error, or makes no difference, or is complained about: inside the very last number."""
    path = path_of(name, tmp_path)
    led = lid(symmetry, c=(0, 90, 180, 270), gamma=(0, 45, 90))
    write_intensity(path, led)
    data = path.read_bytes()
    outcomes = []
    for length in range(len(data)):
        path.write_bytes(data[:length])
        try:
            found = read_intensity(path)
        except FormatError:
            outcomes.append("error")
            continue
        if any("cut short" in c.found for c in found.complaints):
            outcomes.append("complaint")
        else:
            assert_same_function(found, led)
            outcomes.append("right")
    last = len(data.rstrip()) - len(data.split()[-1])  # where the last number begins
    assert set(outcomes[: last + 1]) == {"error"}
    assert set(outcomes[last + 1 : len(data.rstrip()) + 1]) == {"complaint"}
    assert set(outcomes[len(data.rstrip()) + 1 :]) == {"right"}


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, f in INTENSITY_FORMATS.items() if f.write is None])
def test_cut_at_every_byte_where_an_end_is_marked(name: str, tmp_path: Path) -> None:
    """XML ends with a tag and ZIP with a record: whatever is cut short is an error."""
    path = path_of(name, tmp_path)
    led = lid("none", c=(0, 180), gamma=(0, 90))
    write_any(name, path, led)
    data = path.read_bytes()
    whole = len(data.rstrip()) if name != "gldf" else len(data)
    for length in range(whole):
        path.write_bytes(data[:length])
        with pytest.raises(FormatError):
            read_intensity(path)
    path.write_bytes(data[:whole])
    assert_same_function(read_intensity(path), led)


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A small table in a file of each format: written once, and damaged in many ways."""
    folder = tmp_path_factory.mktemp("sound")
    for name in INTENSITY_FORMATS:
        write_any(name, path_of(name, folder), lid("both", c=(0, 90, 180, 270), gamma=(0, 45, 90)))
    return {name: path_of(name, folder).read_bytes() for name in INTENSITY_FORMATS}


@pytest.mark.slow
@ALL
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damage_gives_a_format_error_or_a_distribution(
    name: str, data: st.DataObject, sound: dict[str, bytes], tmp_path: Path
) -> None:
    """Bytes overwritten, removed and inserted; the formats have no checksum, so a digit may have become another."""
    path = path_of(name, tmp_path)
    content = bytearray(sound[name])
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        what = data.draw(st.sampled_from(["flip", "remove", "insert"]))
        byte = data.draw(st.one_of(st.sampled_from(b"0123456789-+.,eE \r\n\x00[]="), st.integers(0, 255)))
        if what == "insert":
            content.insert(place, byte)
        elif what == "remove":
            del content[place]
        else:
            content[place] = byte
    path.write_bytes(content)
    try:
        found = read_intensity(path)
    except FormatError:
        return
    assert np.isfinite(found.values).all()
    assert np.isfinite(found.flux)


@WRITTEN
def test_absurd_counts_take_no_memory(name: str, tmp_path: Path) -> None:
    path = path_of(name, tmp_path)
    write_intensity(path, lid("none"))
    lines = path.read_bytes().split(b"\r\n")
    for old, new in ((b"37", b"100000"), (b"24", b"99996"), (b"25", b"100000")):
        lines = [b" ".join(new if word == old else word for word in line.split(b" ")) for line in lines]
    path.write_bytes(b"\r\n".join(lines))
    with pytest.raises(FormatError, match="announced"):
        read_intensity(path)
