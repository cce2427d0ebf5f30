"""TracePro properties of two sides, tables at normal incidence and of nothing, and what is written of both sides."""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.formats.bsdf import read_bsdf_data, write_bsdf_data
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from oracles.tracepro_files import abg_side, row, section, surface_property


def read(path: Path, text: str) -> BsdfData:
    path = path / "property.txt"
    path.write_text(text)
    return read_bsdf_data(path)


@pytest.mark.slow
def test_light_that_meets_the_back_has_its_own_numbers(tmp_path: Path) -> None:
    text = surface_property(
        scatter=1, sections=[abg_side(a=0.02, mirrored=0.3), abg_side(a=0.01, mirrored=0.3)], coating=7
    )
    data = read(tmp_path, text)
    assert not data.both_sides
    bsdf = et.BsdfTable(data)
    tis = 0.02 * math.pi * math.log(1.0 + 1.0 / 0.1)
    assert float(bsdf.reflectance(0, side="front")) == pytest.approx(0.3 + tis, rel=2e-3)
    assert float(bsdf.reflectance(0, side="back")) == pytest.approx(0.3 + 0.5 * tis, rel=2e-3)
    assert any("[Side1_Data] is read as that of light that meets the front" in str(one) for one in data.complaints)
    # Alike on both, it is the model.
    same = surface_property(scatter=1, sections=[abg_side(a=0.02), abg_side(a=0.02)], coating=7)
    (component,) = read(tmp_path, same).components
    assert component["kind"] == "abg"
    # Only one side, and through it.
    one = surface_property(scatter=1, sections=[abg_side(a=0.0), abg_side(a=0.02, way="transmitted")], coating=7)
    bsdf = et.BsdfTable(read(tmp_path, one))
    assert float(bsdf.transmittance(0, side="back")) == pytest.approx(tis, rel=2e-3)
    assert float(bsdf.transmittance(0, side="front")) == 0.0


def test_tables_of_both_sides(tmp_path: Path) -> None:
    """The axis of the sample is the same on both, and azimuths run about the normal of the front."""

    def side(f: dict[float, float]) -> str:
        table = [
            [300, 0.55, t, p, b, a, value * (1 - b), 0]
            for t, p in ((0, 0), (20, 0), (20, 90))
            for b in (0, 0.3, 0.6)
            for a, value in f.items()
        ]
        return section(rows=[row(theta=t, phi=p, left=0.1) for t, p in ((0, 0), (20, 0), (20, 90))], table=table)

    front, back = {0: 0.2, 90: 0.1, 180: 0.05, 270: 0.02}, {0: 0.03, 90: 0.12, 180: 0.25, 270: 0.06}
    data = read(tmp_path, surface_property(scatter=5, sections=[side(front), side(back)], coating=7))
    assert len(data.slices) == 6
    for one in data.slices:
        f = front if one.front else back
        for azimuth, value in f.items():
            x = 0.3 * np.array([math.cos(math.radians(azimuth)), math.sin(math.radians(azimuth))])
            beta = -one.incident[:2] + x
            to = [*beta, math.copysign(math.sqrt(1.0 - beta @ beta), one.incident[2])]
            # At normal incidence too, where a grid counts from −x.
            assert float(one.at(to)) == pytest.approx(0.7 * value)


def test_a_table_that_scatters_nothing_at_one_incidence(tmp_path: Path) -> None:
    """The table before does not take its place."""
    table = [[300, 0.55, t, 0, b, 0, f, 0] for t, f in ((0, 0.1), (50, 0.0)) for b in (0, 1)]
    text = surface_property(scatter=4, sections=[section(rows=[row(theta=t, left=0.1) for t in (0, 50)], table=table)])
    bsdf = et.BsdfTable(read(tmp_path, text))
    assert bsdf.reflectance([0, 50, 70]) == pytest.approx([0.1 * math.pi, 0.0, 0.0], abs=1e-6)


@pytest.mark.slow
def test_both_sides_and_the_normal_are_written(tmp_path: Path) -> None:
    """A table without symmetry at normal incidence and oblique, of both sides, comes back direction by direction."""
    grid = PolarGrid("normal", np.linspace(0.0, 90.0, 31), np.arange(0.0, 360.0, 15.0))

    def made(front: bool, theta: float, phi: float) -> BsdfSlice:
        t, p = math.radians(theta), math.radians(phi)
        up = 1.0 if front else -1.0
        incident = [math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), up * math.cos(t)]
        turn = np.radians(grid.azimuth)[:, None]
        f = 0.1 + 0.04 * np.sin(np.radians(grid.radial)) * (np.cos(turn) + (0.5 if front else -0.3) * np.sin(turn))
        return BsdfSlice(np.array(incident), f * (1.0 if front else 0.5), grid=grid)

    slices = [made(front, 0.0, 0.0) for front in (True, False)]
    slices += [made(front, t, p) for front in (True, False) for t in (30.0, 60.0) for p in np.arange(0.0, 360.0, 45.0)]
    bsdf = et.BsdfTable(BsdfData(slices, isotropic=False, mirrored=False, both_sides=False))
    lost = et.write_bsdf(tmp_path / "both.txt", bsdf, format="tracepro")
    assert lost == ("the values are a table made for this format",)
    again = et.read_bsdf(tmp_path / "both.txt")
    assert not again.both_sides
    assert (tmp_path / "both.txt").read_text().count("[Side") == 2
    for one in slices[::3]:
        to = grid.directions(one.incident, transmitted=False)[::3, ::5].reshape(-1, 3)
        to = to[np.abs(to[:, 2]) > 0.05]
        assert np.abs(again.evaluate(one.incident, to) - one.at(to)).max() < 0.005
    # What was read fits as it is.
    write_bsdf_data(tmp_path / "again.txt", BsdfData(again.data.slices, isotropic=False, both_sides=False), "tracepro")


def test_a_side_without_slices_absorbs(tmp_path: Path) -> None:
    grid = PolarGrid("cosines", np.array([0.0, 1.0, 2.0]), np.array([0.0]))
    front = BsdfSlice(np.array([-0.6, 0.0, 0.8]), np.full((1, 3), 0.1), grid=grid)
    write_bsdf_data(tmp_path / "one.txt", BsdfData([front], both_sides=False), "tracepro")
    bsdf = et.read_bsdf(tmp_path / "one.txt")
    assert float(bsdf.reflectance(30.0, side="front")) == pytest.approx(0.1 * math.pi, rel=1e-3)
    assert float(bsdf.reflectance(30.0, side="back")) == 0.0
