"""Workbooks of the RT-300S: the real scan of black anodising against the table that was published from it; damage."""

from __future__ import annotations

import shutil
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.rt300s import read_rt300s
from etendue.scatter.scans.files import SHADOW


@pytest.fixture(scope="module")
def scans(samples: Path) -> et.Scans:
    folder = samples / "bsdf"
    return et.read_scans([folder / "AnoBlackEC1_goniometer.xls"], blank=folder / "blank_goniometer.xls")


@pytest.mark.slow
def test_the_real_scan_without_its_blank_is_the_published_table(samples: Path, scans: et.Scans) -> None:
    """In three bands of the angle from the normal medians of f over the table's are 1 to 6 %. The signal is π f cosθ;
    without the cosine, or with the blank left in, they are not. Single values differ more: the publishers averaged and
    filled in, and their lobes at 50 and 70° do not lean towards grazing as the scan does."""
    folder = samples / "bsdf"
    raw = folder / "AnoBlackEC1_goniometer.xls"
    away = np.degrees(np.arccos(np.einsum("ij,ij->i", scans.incident, scans.scattered)))
    assert away.min() > SHADOW
    assert 2400 < scans.values.size < 2508
    published = et.read_bsdf(folder / "AnoBlackEC1onAlum.bsdf")

    def medians(values: np.ndarray) -> list[float]:
        found = []
        height = scans.scattered[:, 2]
        for low, high in ((0, 35), (35, 65), (65, 90)):
            ratios = []
            for one in published.data.slices:
                near = np.abs(scans.incident @ one.incident - 1) < 1e-9
                near &= (height <= np.cos(np.radians(low))) & (height > np.cos(np.radians(high)))
                ratios.append(values[near] / one.at(scans.scattered[near]))
            found.append(float(np.median(np.concatenate(ratios))))
        return found

    assert medians(scans.values) == pytest.approx([1.0, 1.0, 1.0], abs=0.06)
    flat = medians(scans.values * scans.scattered[:, 2])
    assert flat[2] < 0.5
    dirty = medians(et.read_scans([raw]).values)
    assert abs(dirty[2] - 1.0) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    "known",
    [
        et.bsdf.Mixture(
            parts=[{"kind": "lambertian", "reflectance": 0.3}, {"kind": "gaussian", "peak": 1.0, "sigma": 0.15}]
        ),
        et.bsdf.RoughCoat(roughness=0.3, index=1.5, base_reflectance=0.5),
    ],
    ids=["gaussian", "coat"],
)
def test_the_method_that_is_chosen_finds_shares_of_known_surfaces(scans: et.Scans, known: et.Bsdf) -> None:
    """At the directions of the real scan, without noise: the directional-hemispherical reflectance to 1 %."""
    values = known.evaluate(scans.incident, scans.scattered)
    table = et.Bsdf.from_scans(et.Scans(scans.incident, scans.scattered, values))
    assert isinstance(table, et.BsdfTable)
    assert table.data.facts["interpolation"] == "natural-neighbours"
    for one in table.data.slices:
        assert one.integral() == pytest.approx(float(known.reflectance(one.theta)), rel=0.01)


def test_damage_is_told(samples: Path, tmp_path: Path) -> None:
    whole = samples / "bsdf" / "blank_goniometer.xls"
    assert read_rt300s(whole)["rt"].size == 2508
    broken = tmp_path / "broken.xls"
    shutil.copy(whole, broken)
    data = bytearray(broken.read_bytes())
    broken.write_bytes(data[: len(data) // 3])
    with pytest.raises(FormatError, match="damaged"):
        et.read_scans([broken])
    # Noise about nothing is no damage.
    assert (et.read_scans([whole]).values < 0.0).any()
