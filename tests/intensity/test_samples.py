"""Real files of many makers: read by a second, simple route, and integrated to the flux they state."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from etendue.formats.intensity import read_intensity
from oracles.intensity import flux_by_quadrature

FLUX = {
    # Stated flux (lamps · light output ratio, lm or W), and how far a table of such steps may be off
    "eulumdat-luminance__sample_01.ldt": (4828.0, 0.003),
    "eulumdat-luminance__sample_02.ldt": (2112.0, 0.003),
    "eulumdat-luminance__sample_03.ldt": (609.0, 0.003),
    "eulumdat-luminance__sample_04.ldt": (12334.0, 0.008),
    "eulumdat-luminance__sample_05.ldt": (9639.0, 0.003),
    "eulumdat-py__sample1.ldt": (1983.0, 0.001),
    "eulumdat-py__sample2.ldt": (4600.0, 0.001),
    "eulumdat-py__sample3.ldt": (12800.0, 0.001),
    "eulumdat-py__sample4.ldt": (5540.0, 0.001),
    "eulumdat-py__sample5.ldt": (611.9, 0.001),
    "eulumdat-py__sample6.ldt": (1800.0 * 0.999492, 0.001),
    "eulumdat-py__sample7.ldt": (2445.4, 0.001),
    "eulumdat-py__sample8.ldt": (400.0 * 0.88629073034905, 0.001),
    "eulumdat-py__sample9.ldt": (10002.0, 0.001),
    "eulumdat-py__sample10.ldt": (7000.0, 0.001),
    # 91.6 mW is what the file states before its multiplier of 1.32
    "guv-calcs__B1_module.ies": (0.0916 * 1.32, 0.003),
}


def files(samples: Path) -> list[Path]:
    return sorted((samples / "intensity").iterdir())


@pytest.mark.slow
def test_every_file_reads(samples: Path) -> None:
    found = {path.name: read_intensity(path) for path in files(samples)}
    assert len(found) == 20
    assert set(FLUX) < set(found)
    for name, led in found.items():
        assert led.flux == pytest.approx(flux_by_quadrature(led), rel=1e-10), name
        assert led.flux_unit == ("W" if name.startswith(("guv", "photompy")) else "lm")
        assert not any(c.severity == "error" for c in led.complaints)


def test_symmetries(samples: Path) -> None:
    """What each file claims, or more: a file without symmetry may hold a table that has some."""
    claims = {0: "none", 1: "rotational", 2: "C0-C180", 3: "C90-C270", 4: "both"}
    seen = set()
    for path in files(samples):
        if path.suffix == ".ldt":
            isym = int(path.read_bytes().split(b"\n")[2])
            led = read_intensity(path)
            seen.add(isym)
            assert led.symmetry() in (
                claims[isym],
                "C90-C270" if path.name == "eulumdat-py__sample3.ldt" else claims[isym],
            )
    assert seen == {0, 1, 2, 3, 4}


@pytest.mark.parametrize("name", FLUX)
def test_the_flux_is_the_stated_one(samples: Path, name: str) -> None:
    stated, tolerance = FLUX[name]
    assert read_intensity(samples / "intensity" / name).flux == pytest.approx(stated, rel=tolerance)


def test_values_by_a_second_route(samples: Path) -> None:
    """The last numbers of a file are its table; no symmetry, no names, no records needed to see that."""
    for path in files(samples):
        led = read_intensity(path)
        text = path.read_text(encoding="latin-1")
        if path.suffix == ".ldt":
            lines = [line.strip() for line in text.splitlines()]
            isym, n_c, n_gamma = (int(float(lines[n])) for n in (2, 3, 5))
            stored = {0: n_c, 1: 1, 2: n_c // 2 + 1, 3: n_c // 2 + 1, 4: n_c // 4 + 1}[isym]
            numbers = [float(line) for line in [line for line in lines if line][-stored * n_gamma :]]
            factor = float(lines[28].replace(",", ".")) / 1000.0
            first_c = 270.0 if isym == 3 else 0.0
        else:
            numbers = [float(word) for word in re.split(r"[\s,]+", text.split("TILT=NONE")[1].strip())]
            n_gamma, stored = int(numbers[3]), int(numbers[4])
            factor = numbers[2] * numbers[10] * (1e-3 if led.flux_unit == "W" else 1.0)
            first_c = 0.0
        table = np.array(numbers[-stored * n_gamma :]).reshape(stored, n_gamma) * factor
        assert np.allclose(led.planes([first_c])[0], table[0], rtol=1e-12), path.name
        middle = led.c[(stored // 2 + int(np.argmin(np.abs(led.c - first_c)))) % led.c.size] if stored > 1 else 0.0
        assert np.allclose(led.planes([middle])[0], table[stored // 2], rtol=1e-12), path.name


def test_what_the_files_say_of_themselves(samples: Path) -> None:
    trilux = read_intensity(samples / "intensity" / "eulumdat-py__sample6.ldt")
    assert trilux.luminaire["manufacturer"] == "TRILUX"
    assert (trilux.luminaire["opening_x"], trilux.luminaire["opening_y"]) == (240.0, 104.0)
    erco = read_intensity(samples / "intensity" / "eulumdat-py__sample5.ldt")
    assert erco.luminaire["manufacturer"] == "ERCO GmbH"  # behind a byte-order mark
    assert "lamp_flux" not in erco.luminaire
    two = read_intensity(samples / "intensity" / "eulumdat-py__sample1.ldt")
    assert [s["flux"] for s in two.luminaire["lamp_sets"]] == [1983.0, 2643.0]
    ies = read_intensity(samples / "intensity" / "photompy__LLIA001477-002.ies")
    assert dict(ies.luminaire["keywords"])["LUMINAIRE"].endswith("fan and unmarked control circuit")
    assert ies.luminaire["opening_y"] == pytest.approx(0.813 * 304.8)  # feet, and the width lies along C90
