"""GLDF: which photometry of a container is meant, and containers that are damaged or made to do harm."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from etendue.errors import FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats import archive as archives
from etendue.formats.intensity import detect_intensity_format, read_intensity, write_intensity
from etendue.formats.rays import detect_format
from etendue.quantities.intensity import Intensity
from oracles.intensity import lid
from oracles.luminaire_files import archive, gldf_of, ies_of, product, tm33_of

Read = Callable[..., Intensity]

FIXED = """<Emitters>
<Emitter id="e1"><FixedLightEmitter><PhotometryReference photometryId="p1"/><RatedLuminousFlux>750</RatedLuminousFlux>
</FixedLightEmitter></Emitter>
<Emitter id="e2"><ChangeableLightEmitter><PhotometryReference photometryId="p2"/></ChangeableLightEmitter></Emitter>
<Emitter id="e3"><LightEmitter photometryId="p1"/><LightEmitter photometryId="p2"/></Emitter>
</Emitters>"""
VARIANTS = """<Variant id="v1"><Name><Locale language="en">Wide</Locale><Locale language="de">Breit</Locale></Name>
<Geometry><EmitterReference emitterId="e2"/></Geometry></Variant>"""
FILES = {"f1": ("ldc/ies", "localFileName", "a.ies"), "f2": ("ldc/eulumdat", "localFileName", "b.ldt")}
TWO = product(FILES, {"p1": "f1", "p2": "f2"}, body=FIXED, variants=VARIANTS)


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def call(content: bytes, photometry: str | None = None) -> Intensity:
        (tmp_path / "a.gldf").write_bytes(content)
        return read_intensity(tmp_path / "a.gldf", photometry)

    return call


@pytest.fixture
def two(tmp_path: Path) -> bytes:
    write_intensity(tmp_path / "b.ldt", lid("both"))
    members = {"ldc/a.ies": ies_of(lid("none"), tmp_path), "ldc/b.ldt": (tmp_path / "b.ldt").read_bytes()}
    return archive({"product.xml": TWO, **members, "geo/x.l3d": b"mesh"})


def test_the_only_photometry(read: Read, tmp_path: Path) -> None:
    led = read(gldf_of(lid("none"), tmp_path))
    assert np.allclose(led.values, lid("none").values, rtol=1e-5)
    assert led.provenance.source == "a.gldf"
    assert led.provenance.format == "lm63"  # planes are counted as in the file inside
    assert "photometry p of a GLDF container, ldc/led.ies" in led.provenance.steps
    assert any("geometry, pictures and sensors in it were not read" in note for note in led.notes)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.gldf"]


@pytest.mark.parametrize(
    ("name", "symmetry"), [("p1", "none"), ("p2", "both"), ("e1", "none"), ("e2", "both"), ("v1", "both")]
)
def test_one_of_several(read: Read, two: bytes, name: str, symmetry: str) -> None:
    led = read(two, name)
    assert led.symmetry(1e-4) == symmetry
    assert any("a rated luminous flux of 750 lm for emitter e1" in note for note in led.notes) == (symmetry == "none")
    assert led.flux == pytest.approx(lid(symmetry).flux, rel=1e-5)


def test_several_are_listed(read: Read, two: bytes) -> None:
    with pytest.raises(FormatError, match=r"p1 \(e1, e3: a.ies\); p2 \(e2, e3, v1 'Wide': b.ldt\).*--photometry"):
        read(two)
    with pytest.raises(FormatError, match="e3 has 2 photometries: p1, p2"):
        read(two, "e3")
    with pytest.raises(UnknownNameError, match="Did you mean 'v1'"):
        read(two, "v11")


@pytest.mark.parametrize("member", ["ldc/led.xml", "LDC/LED.XML", "led.xml", "ldc\\led.xml"])
def test_tm33_inside_wherever_it_lies(read: Read, member: str) -> None:
    xml = product({"f": ("ldc/iesxml", "localFileName", "led.xml")}, {"p": "f"})
    led = read(archive({"Product.XML": xml, member: tm33_of(lid("none"))}))
    assert np.allclose(led.values, lid("none").values)


def test_complaints_name_the_file_inside(read: Read, tmp_path: Path) -> None:
    xml = product({"f": ("ldc/ies", "localFileName", "led.ies")}, {"p": "f"})
    data = ies_of(lid("none"), tmp_path)
    led = read(archive({"product.xml": xml, "ldc/led.ies": data + b"by hand\r\n"}))
    assert str(led.complaints[0]).startswith("warning: ldc/led.ies: line")
    with pytest.raises(FormatError, match=r"a\.gldf: ldc/led\.ies: candela values: the file ends"):
        read(archive({"product.xml": xml, "ldc/led.ies": data[:-200]}))
    with pytest.raises(FormatError, match=r"a\.gldf: ldc/led\.ies: this is no intensity"):
        read(archive({"product.xml": xml, "ldc/led.ies": b"hello"}))


def test_what_is_elsewhere_is_not_fetched(read: Read) -> None:
    xml = product({"f": ("ldc/ies", "url", "http://127.0.0.1:1/a.ies")}, {"p": "f"})
    with pytest.raises(UnsupportedFormatError, match=r"at http://127.0.0.1:1/a.ies. étendue fetches nothing"):
        read(archive({"product.xml": xml}))


@pytest.mark.parametrize(
    ("xml", "message"),
    [
        (product({}, {}), "the product has no photometry"),
        (product({}, {"p": "f"}), "names the file 'f', which is not listed"),
        (product({"f": ("ldc/ies", "localFileName", "b.ies")}, {"p": "f"}), "'b.ies', which is not in the folder ldc/"),
        (product({"f": ("ldc/ies", "localFileName", "../../etc/passwd")}, {"p": "f"}), "which is not in the folder"),
        ("<Root/>", "it has no GeneralDefinitions"),
        ("<Root>", "no XML"),
        ("<!DOCTYPE a><Root/>", "document type declaration"),
    ],
)
def test_products_that_are_refused(read: Read, xml: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read(archive({"product.xml": xml, "ldc/a.ies": b""}))


def test_names_that_climb_out_of_a_folder_lead_nowhere(tmp_path: Path) -> None:
    """A member of such a name is a name and no place: it is read in the archive, and nothing is written."""
    xml = product({"f": ("ldc/ies", "localFileName", "../../led.ies")}, {"p": "f"})
    (tmp_path / "sub").mkdir()
    content = archive({"product.xml": xml, "ldc/../../led.ies": ies_of(lid("none"), tmp_path)})
    (tmp_path / "sub" / "a.gldf").write_bytes(content)
    assert read_intensity(tmp_path / "sub" / "a.gldf").symmetry(1e-4) == "none"
    assert [p.name for p in tmp_path.iterdir()] == ["sub"]


def test_bombs_are_refused(read: Read, monkeypatch: pytest.MonkeyPatch) -> None:
    xml = product({"f": ("ldc/ies", "localFileName", "a.ies")}, {"p": "f"})
    bomb = archive({"product.xml": xml, "ldc/a.ies": b"1 " * (20 << 20)})
    assert len(bomb) < 200_000
    with pytest.raises(FormatError, match=r"ldc/a.ies: [\d,]+ bytes that unpack to 41,943,040"):
        read(bomb)
    with pytest.raises(FormatError, match=r"product.xml: [\d,]+ bytes, more than"):
        read(archive({"product.xml": b" " * (17 << 20)}))
    # The size in the directory is a lie: what is there is more than what was announced.
    place = bomb.rindex(b"PK\x01\x02")
    lie = bomb[: place + 24] + struct.pack("<I", 1000) + bomb[place + 28 :]
    with pytest.raises(FormatError, match=r"ldc/a\.ies"):
        read(lie)
    # A directory of more members than any product has, told before it is read.
    end = bomb.rindex(b"PK\x05\x06")
    with pytest.raises(FormatError):
        read(bomb[: end + 8] + struct.pack("<HH", 65000, 65000) + bomb[end + 12 :])
    monkeypatch.setattr(archives, "MOST_BYTES", 100)
    with pytest.raises(FormatError):
        read(bomb)


@pytest.mark.parametrize("compression", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_ways_of_packing_are_refused(read: Read, tmp_path: Path, compression: int) -> None:
    xml = product({"f": ("ldc/ies", "localFileName", "a.ies")}, {"p": "f"})
    with pytest.raises(FormatError, match="packed in a way other than deflate"):
        read(archive({"product.xml": xml, "ldc/a.ies": ies_of(lid("none"), tmp_path)}, compression))


@pytest.mark.parametrize("compression", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
@pytest.mark.parametrize("name", ["a.ies", "b.ldt"])
def test_other_archives_are_none(tmp_path: Path, name: str, compression: int) -> None:
    write_intensity(tmp_path / name, lid("none"))
    (tmp_path / "a.zip").write_bytes(archive({name: (tmp_path / name).read_bytes()}, compression))
    assert detect_intensity_format(tmp_path / "a.zip") is None
    with pytest.raises(UnsupportedFormatError, match="a ZIP archive"):
        detect_format(tmp_path / "a.zip")


@pytest.mark.parametrize("first", ["product.xml", "ldc/a.ies", "ldc/b.ldt"])
def test_members_that_are_not_compressed_are_not_taken_for_the_file(read: Read, tmp_path: Path, first: str) -> None:
    """Whichever stands first in the archive, its text is seen at the beginning."""
    write_intensity(tmp_path / "b.ldt", lid("both"))
    members = {"product.xml": TWO.encode(), "ldc/a.ies": ies_of(lid("none"), tmp_path)}
    members["ldc/b.ldt"] = (tmp_path / "b.ldt").read_bytes()
    content = archive({first: members.pop(first), **members}, zipfile.ZIP_STORED)
    for photometry, symmetry in (("p1", "none"), ("p2", "both")):
        assert np.allclose(read(content, photometry).values, lid(symmetry).values, rtol=1e-5)


@pytest.mark.parametrize(("stated", "count"), [("ldc/ies", 0), ("LDC/IES", 0), ("ldc/eulumdat", 1), ("ldc/iesxml", 1)])
def test_a_type_of_content_that_is_another_is_told(read: Read, tmp_path: Path, stated: str, count: int) -> None:
    xml = product({"f": (stated, "localFileName", "led.ies")}, {"p": "f"})
    led = read(archive({"product.xml": xml, "ldc/led.ies": ies_of(lid("none"), tmp_path)}))
    assert led.provenance.format == "lm63"
    found = [str(c) for c in led.complaints]
    assert len(found) == count
    assert all(f"contentType is {stated!r}, and ldc/led.ies is IES LM-63; it was read as that" in c for c in found)
