"""Files that are refused by name, with advice; and that a readable file never is."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import pytest
from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf import fred, speos, speos_brdf, speos_coated, speos_scattering, speos_simple, tracepro_writing
from etendue.formats.head import Head
from etendue.formats.rays import read_rays, write_rays
from etendue.formats.rays.refused import REFUSALS, refuse

BINARY = bytes(range(7, 256)) * 4
"""The beginning of no known file."""

NAMED = [
    ("rayfile_LED_5M_20200101_LucidShape.ray", "LucidShape", "TM-25"),
    ("rayfile_LED_5M_20200101_SimuLux.ray", "SimuLux", "TM-25"),
    ("rayfile_LED_5M_20200101_TracePro_Photopia.ray", "Photopia", "TM-25"),
    ("lamp.TTR", "TechnoTeam", "TM-25"),
    ("lamp.ttl", "TechnoTeam", "ray files"),
    ("lamp.rsm", "Radiant Source Model", "TM-25"),
    ("lamp.rs7", "Radiant Source Model", "TM-25"),
    ("lamp.rs8", "Radiant Source Model", "TM-25"),
    ("lamp.RSMX", "Radiant Source Model", "TM-25"),
    ("path.zrd", "ZRD", "TM-25"),
    ("lamp.fcr", "FRED", "TM-25"),
    ("lamp.crs", "critical ray set", "TM-25"),
    ("lamp.ldt", "EULUMDAT", "ray files"),
    *(
        (f"paint{end}", "BSDF", "etendue bsdf info")
        for end in (".bsdf", ".astm", ".ssdd", ".brdf", ".coated", ".SCATTERING")
    ),
]
SIGNED = [
    (b"PK\x03\x04", "ZIP", "Unpack"),
    (b"\x1f\x8b\x08", "gzip", "Unpack"),
    (b"7z\xbc\xaf\x27\x1c", "7-Zip", "Unpack"),
    (b"Rar!\x1a\x07\x00", "RAR", "Unpack"),
    (b"%PDF-1.7", "PDF", "beside it"),
    (b"version https://git-lfs.github.com/spec/v1\n", "Git LFS", "git lfs pull"),
    (b"<!DOCTYPE html><html>", "web page", "browser"),
    (b"ISO-10303-21;\nHEADER;", "STEP", "another file"),
    (b"IESNA:LM-63-2002\r\n", "LM-63", "ray files"),
    (b"OPTIS - Extended Map file", "Speos result map", "Export the rays"),
    (b"OPTIS - Spectrum file v1.0\n", "spectrum", "another file"),
    (b"\xd2\x07\x00\x00\x01\x00\x00\x00", "ZRD", "TM-25"),
    *((text.START.encode(), "BSDF", "etendue bsdf info") for text in (fred, speos, speos_brdf, tracepro_writing)),
    *((text.START, "BSDF", "etendue bsdf info") for text in (speos_coated, speos_scattering, speos_simple)),
]


@pytest.mark.parametrize(("name", "title", "advice"), NAMED)
def test_refused_by_the_makers_file_name(tmp_path: Path, name: str, title: str, advice: str) -> None:
    path = tmp_path / name
    path.write_bytes(BINARY)
    with pytest.raises(UnsupportedFormatError) as error:
        read_rays(path)
    assert title in error.value.found
    assert advice in error.value.advice
    assert error.value.place == "file name"


@pytest.mark.parametrize(("data", "title", "advice"), SIGNED)
def test_refused_by_content_under_any_name(tmp_path: Path, data: bytes, title: str, advice: str) -> None:
    path = tmp_path / "led_LucidShape.ray"
    path.write_bytes(data + BINARY)
    with pytest.raises(UnsupportedFormatError) as error:
        read_rays(path)
    assert title in error.value.found
    assert advice in error.value.advice
    assert error.value.place == "byte 0"


def test_every_refusal_can_be_met() -> None:
    met = {title for _, title, _ in (*NAMED, *SIGNED)} | {"Lumicept"}
    for refusal in REFUSALS:
        assert refusal.signatures or refusal.extensions or refusal.names
        assert any(title in refusal.title for title in met), refusal.title


def test_unknown_files_are_not_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "led.ray"
    for data in (BINARY, b""):
        path.write_bytes(data)
        refuse(Head.of(path))
        with pytest.raises(FormatError, match="Known formats: IES TM-25") as error:
            read_rays(path)
        assert not isinstance(error.value, UnsupportedFormatError)


def test_a_wrong_name_on_a_readable_file_does_no_harm(tmp_path: Path) -> None:
    rays = et.RingSource(rays=50).ray_set()
    for name in ("led_LucidShape.rsm", "led.zip", "led.pdf"):
        write_rays(tmp_path / name, rays, "zemax")
        assert len(read_rays(tmp_path / name)) == 50


def test_intensity_files_are_told_from_ray_files(samples: Path) -> None:
    """Every real intensity file is refused by what it is, although it is a text full of numbers."""
    files = sorted((samples / "intensity").iterdir())
    assert len(files) > 10
    for path in files:
        with pytest.raises(FormatError):
            read_rays(path)
