"""Numbers that no sound file of intensity holds, at every place where it has one."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.intensity import goniometer, read_intensity
from etendue.quantities.intensity import Intensity
from etendue.quantities.spectrum import Spectrum
from oracles.intensity import lid
from oracles.luminaire_files import archive, emitter, product, tm33, write_any
from oracles.planted_numbers import planted_in_text

SMALL = lid("none", c=(0, 180), gamma=(0, 45, 90))
TABLE = np.array([[1.0, 2, 3], [4, 9, 5]])


def written(name: str, folder: Path) -> bytes:
    write_any(name, folder / "small", SMALL)
    return (folder / "small").read_bytes()


def of_goniometer(kind: int) -> bytes:
    """An IES file of type B (2) or A (3)."""
    numbers = f"1 500 2 3 2 {kind} 2 0.1 0.2 0.3\n0.9 1 20\n-30 0 10\n-20 25\n1 2 3\n4 9 5"
    return f"IESNA:LM-63-2002\n[TEST] t\nTILT=INCLUDE\n1\n2\n0 90\n1 0.9\n{numbers}\n".encode()


def tm33_file() -> bytes:
    spectrum = '<PwrData w="450">1</PwrData><PwrData w="550">2</PwrData>'
    return tm33(
        emitter(
            h=[0, 90],
            v=[0, 90],
            values=TABLE[:, :2],
            table="<Multiplier>2</Multiplier>",
            before="<RatedLumens>500</RatedLumens>",
            after=f"<SpectralData><EmitterSpectral>{spectrum}</EmitterSpectral></SpectralData>",
        )
    )


FILES: dict[str, Callable[[Path], bytes]] = {
    "lm63": lambda folder: written("lm63", folder),
    "type B": lambda _: of_goniometer(2),
    "type A": lambda _: of_goniometer(3),
    "eulumdat": lambda folder: written("eulumdat", folder),
    "tm33": lambda _: tm33_file(),
}


def unsound(thing: Any, place: str = "") -> Iterator[str]:
    """Places of numbers that are none."""
    if isinstance(thing, dict):
        for key, part in thing.items():
            yield from unsound(part, f"{place} {key}")
    elif isinstance(thing, list | tuple):
        for part in thing:
            yield from unsound(part, place)
    elif isinstance(thing, Spectrum):
        yield from unsound((thing.wavelength, thing.weight), place)
    elif isinstance(thing, float | np.ndarray) and not np.isfinite(thing).all():
        yield place


def require_sound_or_refused(path: Path) -> bool:
    """Whether it was read; every number of what was read is one, and an error names file and place."""
    try:
        led = read_intensity(path)
    except FormatError as error:
        assert str(path) in str(error)  # noqa: PT017 - either outcome is right
        assert error.place  # noqa: PT017
        return False
    assert not [*unsound({"c": led.c, "gamma": led.gamma, "values": led.values, "flux": led.flux, **led.luminaire})]
    assert repr(led)
    assert led.symmetry()
    return True


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_no_planted_number_becomes_light(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of text formats; the error of resampling is not the question here, so type B gets few nodes."""
    monkeypatch.setattr(goniometer, "MOST_NODES", 1 << 6)
    data, path = FILES[name](tmp_path), tmp_path / "planted"
    path.write_bytes(data)
    assert require_sound_or_refused(path)
    outcomes = []
    tracemalloc.start()
    try:
        for planted in planted_in_text(data):
            path.write_bytes(planted)
            outcomes.append(require_sound_or_refused(path))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert outcomes.count(False) > 0.2 * len(outcomes) > 20
    assert peak < 32e6


@pytest.mark.slow
@pytest.mark.parametrize("name", ["product", "lm63", "tm33"])
def test_no_planted_number_in_a_container_becomes_light(name: str, tmp_path: Path) -> None:
    """In the list of its contents, and in the photometry: then the error names container and member."""
    path = tmp_path / "planted.gldf"
    kind = "tm33" if name == "tm33" else "ies"
    inner = tm33_file() if name == "tm33" else written("lm63", tmp_path)
    xml = product(
        {"f": (f"ldc/{kind}", "localFileName", "led")},
        {"p": "f"},
        body='<Emitters><Emitter id="e"><FixedLightEmitter><PhotometryReference photometryId="p"/>'
        "<RatedLuminousFlux>500</RatedLuminousFlux></FixedLightEmitter></Emitter></Emitters>",
    ).encode()
    outcomes = []
    for planted in planted_in_text(xml if name == "product" else inner):
        members = (
            {"product.xml": planted, "ldc/led": inner}
            if name == "product"
            else {"product.xml": xml, "ldc/led": planted}
        )
        path.write_bytes(archive(members))
        outcomes.append(require_sound_or_refused(path))
    assert any(outcomes)
    assert name == "product" or not all(outcomes)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("1 500 2 3", "1 500 1e308 3", r"candela values: 9, times the factor 9e\+307 .* more than any source"),
        ("4 9 5", "4 1e40 5", r"candela values: 1e\+40, times the factor 1\.8 "),
    ],
)
def test_intensities_beyond_every_source_are_refused(old: str, new: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "led.ies"
    path.write_bytes(of_goniometer(3).replace(old.encode(), new.encode()))
    with pytest.raises(FormatError, match=message):
        read_intensity(path)


@pytest.mark.parametrize(
    ("old", "new", "fact", "told"),
    [
        ("0.1 0.2", "1e308 0.2", "opening_x", r"1e\+308 m, which no luminaire has"),
        ("1 500", "1 1e308", "lamp_flux", r"1e\+308, which no lamp has"),
    ],
)
def test_sizes_and_fluxes_beyond_everything_are_told_and_not_kept(
    old: str, new: str, fact: str, told: str, tmp_path: Path
) -> None:
    path = tmp_path / "led.ies"
    path.write_bytes(of_goniometer(3))
    sound: Intensity = read_intensity(path)
    path.write_bytes(of_goniometer(3).replace(old.encode(), new.encode()))
    led = read_intensity(path)
    assert fact in sound.luminaire
    assert fact not in led.luminaire
    assert [c for c in led.complaints if told.replace("\\", "") in c.found]


@pytest.mark.parametrize("kind", [2, 3])
def test_a_table_of_a_goniometer_cut_at_every_byte(kind: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error, or, inside the very last number, a complaint."""
    monkeypatch.setattr(goniometer, "MOST_NODES", 1 << 6)
    data, path = of_goniometer(kind), tmp_path / "led.ies"
    for length in range(len(data)):
        path.write_bytes(data[:length])
        if length < len(data.rstrip()):
            with pytest.raises(FormatError):
                read_intensity(path)
        else:
            assert any("cut short" in c.found for c in read_intensity(path).complaints)
