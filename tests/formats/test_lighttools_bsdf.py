"""LightTools tables made by hand: where azimuths begin, sides and ways, colours, mistakes."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

HEAD = """# by hand
Symmetry {symmetry}
SpectralContent {content}
ScatterAzimuth {azimuths}
ScatterRadial 2
0 60
DataBegin
"""

BLOCKS = """AOI 30
POI 0
Side Front
Wavelength 550
ScatterType BRDF
TIS 0.3
0.1 0.2
0.1 0.3
0.1 0.4
0.1 0.5
AOI 30
POI 0
Side Back
Wavelength 550
ScatterType BTDF
TIS 0.3
0.05 0.02
0.05 0.03
0.05 0.04
0.05 0.05
DataEnd
"""

ALL_AROUND = HEAD.format(symmetry="Asymmetric", content="Monochrome", azimuths="4\n0 90 180 270") + BLOCKS


@pytest.mark.parametrize("front", [True, False])
def test_light_that_meets_one_side_alone_stays_on_it(tmp_path: Path, front: bool) -> None:
    grid = PolarGrid("normal", np.arange(0.0, 91.0, 5.0), np.arange(0.0, 360.0, 15.0))
    lit = BsdfSlice(light_from(20.0, 180.0, behind=not front), np.full(grid.shape, 0.3 / np.pi), grid=grid)
    path = tmp_path / "one_side.mes"
    et.write_bsdf(path, et.BsdfTable(BsdfData((lit,), both_sides=False)), format="lighttools")
    read = et.read_bsdf(path)
    found = [float(read.reflectance(20.0, side=side)) for side in ("front", "back")]
    assert found == pytest.approx([0.3, 0.0] if front else [0.0, 0.3], abs=1e-3)


def test_light_comes_from_azimuth_90(tmp_path: Path) -> None:
    path = tmp_path / "x.bsdf"
    path.write_text(ALL_AROUND)
    data = read_bsdf_data(path)
    front, back = data.slices
    assert data.isotropic
    assert not data.both_sides
    assert np.allclose(front.incident, direction(30.0, 90.0))
    # Back to the light 0.3, on to the mirrored side 0.5.
    values = front.at(direction(60.0, [90.0, 270.0, 0.0, 180.0]))
    assert values.tolist() == pytest.approx([0.3, 0.5, 0.2, 0.4])
    assert back.transmitted
    assert np.allclose(back.incident, direction(30.0, 90.0, behind=True))
    assert float(back.at(direction(60.0, 270.0))) == pytest.approx(0.05)
    assert any("stated share is 0.3" in complaint.found for complaint in data.complaints)


def test_half_a_table_is_mirrored_at_the_plane_of_incidence(tmp_path: Path) -> None:
    path = tmp_path / "x.bsdf"
    head = HEAD.format(symmetry="planesymmetrical", content="Monochrome", azimuths="3\n-90 0 90")
    path.write_text(head + "AOI 30 Side Front ScatterType BRDF TIS 0.3\n0.1 0.5 0.1 0.2 0.1 0.3\nDataEnd\n")
    (one,) = read_bsdf_data(path).slices
    assert one.at(direction(60.0, [0.0, 180.0, 90.0, 270.0])).tolist() == pytest.approx([0.2, 0.2, 0.3, 0.5])


def test_of_three_colours_the_second(tmp_path: Path) -> None:
    path = tmp_path / "x.bsdf"
    head = HEAD.format(symmetry="Asymmetric", content="XYZ", azimuths="2\n0 180")
    block = "AOI 0 Side Front ScatterType BRDF TristimulusValue {} TIS 0.3\n0.1 {v} 0.1 {v}\n"
    path.write_text(
        head + "".join(block.format(name, v=v) for name, v in (("TrisX", 1), ("TrisY", 2), ("TrisZ", 3))) + "DataEnd\n"
    )
    (one,) = read_bsdf_data(path).slices
    assert float(one.at(direction(60.0, 0.0))) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("0 60\nDataBegin", "0 95\nDataBegin", "0 to 90"),
        ("Side Back", "Side Left", "not one of Front, Back"),
        ("0.05 0.05\nDataEnd", "0.05\nDataEnd", "DataEnd"),
        ("AOI 30", "AOI -3", "angle of incidence is -3"),
        ("TIS 0.3\n0.1 0.2", "TIS 0.3\n0.1 inf", "no finite number"),
    ],
)
def test_mistakes_are_told_with_their_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "x.bsdf"
    path.write_text(ALL_AROUND.replace(old, new, 1))
    with pytest.raises(FormatError, match=said):
        read_bsdf_data(path)
