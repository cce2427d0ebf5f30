"""Tensor trees made by hand: order of corners and of values, the map of the disk, sides; means of trees that are written."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import FormatError
from etendue.formats.bsdf import read_bsdf_data, write_bsdf_data
from etendue.formats.bsdf.tensor_tree import FORMAT
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from formats.slanted import Slanted

Array = npt.NDArray[np.float64]

XML = """<?xml version="1.0" encoding="UTF-8"?>
<WindowElement xmlns="http://windows.lbl.gov"><WindowElementType>System</WindowElementType>
<Optical><Layer><Material><Name>by hand</Name></Material>
<DataDefinition><IncidentDataStructure>TensorTree{rank}</IncidentDataStructure></DataDefinition>
<WavelengthData><LayerNumber>System</LayerNumber><Wavelength unit="Integral">Visible</Wavelength>
<WavelengthDataBlock><WavelengthDataDirection>{way}</WavelengthDataDirection>
<AngleBasis>LBNL/Shirley-Chiu</AngleBasis><ScatteringDataType>BTDF</ScatteringDataType>
<ScatteringData>
{tree}
</ScatteringData></WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>
"""


def square_of(beta: Array) -> Array:
    """Where on the square a point of the disk is: radius and angle, octant by octant, as Shirley and Chiu draw it."""
    r, turn = math.hypot(*beta), math.atan2(beta[1], beta[0]) % (2.0 * math.pi)
    eighth = int(((turn / (math.pi / 4.0)) + 1.0) % 8.0 // 2.0)
    off = (turn - eighth * math.pi / 2.0 + math.pi) % (2.0 * math.pi) - math.pi
    other = r * off / (math.pi / 4.0)
    a, b = ((r, other), (-other, r), (-r, -other), (other, -r))[eighth]
    return np.array([0.5 * (a + 1.0), 0.5 * (b + 1.0)])


def looked_up(tree: Any, place: tuple[float, ...]) -> float:
    """A branch is a list of corners, of which bit i is the upper half of coordinate i; a leaf is an array."""
    if isinstance(tree, np.ndarray):
        n = tree.shape[0]
        return float(tree[tuple(int(x * n) for x in place)])
    return looked_up(tree[sum((x >= 0.5) << i for i, x in enumerate(place))], tuple(2.0 * x % 1.0 for x in place))


def text_of(tree: Any) -> str:
    inner = (
        " ".join(map(repr, tree.ravel().tolist())) if isinstance(tree, np.ndarray) else "\n".join(map(text_of, tree))
    )
    return "{ " + inner + " }"


def place_of(one: BsdfSlice, scattered: Array, rank: int) -> tuple[float, ...]:
    """As Radiance has it, in its coordinates: x has the other sign than étendue's."""
    towards = -np.array([-one.incident[0], one.incident[1]])
    out = np.array([-scattered[0], scattered[1]])
    if rank == 4:
        return (*square_of(towards), *square_of(out))
    turn = -math.atan2(towards[1], towards[0])
    turned = np.array(
        [
            math.cos(turn) * out[0] - math.sin(turn) * out[1],
            math.sin(turn) * out[0] + math.cos(turn) * out[1],
        ]
    )
    return (0.5 - 0.5 * math.hypot(*towards), *square_of(turned))


def uneven(rank: int, depth: int, rng: np.random.Generator) -> Any:
    if depth == 0 or rng.random() < 0.3:
        return rng.uniform(0.01, 0.2, (1 << int(rng.integers(0, 3 if rank == 3 else 2)),) * rank)
    return [uneven(rank, depth - 1, rng) for _ in range(1 << rank)]


@pytest.mark.slow
@pytest.mark.parametrize("rank", [3, 4])
@pytest.mark.parametrize("way", ["Transmission Front", "Reflection Back"])
def test_uneven_trees_against_a_look_up(rank: int, way: str, tmp_path: Path) -> None:
    tree = [uneven(rank, 2, np.random.default_rng(k)) for k in range(1 << rank)]
    path = tmp_path / "x.xml"
    path.write_text(XML.format(rank=rank, way=way, tree=text_of(tree)))
    data = read_bsdf_data(path)
    assert data.isotropic == (rank == 3)
    front, transmitted = way.endswith("Front"), way.startswith("Trans")
    assert len(data.slices) in (8, 16, 32) if rank == 3 else len(data.slices) in (64, 256)
    for one in data.slices[:: max(1, len(data.slices) // 20)]:
        assert one.front == front
        assert one.transmitted == transmitted
        assert (one.directions[:, 2] > 0.0).all() == (front != transmitted)
        assert one.projected is not None
        assert float(one.projected.sum()) == pytest.approx(math.pi)
        expected = [looked_up(tree, place_of(one, scattered, rank)) for scattered in one.directions]
        assert one.values.tolist() == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
def test_values_that_are_written_are_means_over_cells(tmp_path: Path) -> None:
    """Against random directions, even in projected solid angle, sorted into cells by the other map."""
    assert FORMAT.tabulate is not None
    data = FORMAT.tabulate(Slanted())
    rng = np.random.default_rng(8)
    r, turn = np.sqrt(rng.random(40_000)), rng.uniform(0.0, 2.0 * math.pi, 40_000)
    beta = np.stack([r * np.cos(turn), r * np.sin(turn)], axis=-1)
    cells = np.array([square_of(np.array([-x, y])) for x, y in beta]) * 16.0
    index = cells[:, 0].astype(int) * 16 + cells[:, 1].astype(int)
    for one in data.slices[5::400]:
        side = 1.0 if one.front != one.transmitted else -1.0
        d = np.column_stack([beta, side * np.sqrt(1.0 - r * r)])
        f = Slanted().evaluate(one.incident, d)
        count = np.bincount(index, minlength=256)
        mean = np.bincount(index, f, 256) / count
        spread = np.sqrt(np.maximum(np.bincount(index, f * f, 256) / count - mean**2, 0.0) / count)
        # The rule of 3 × 3 midpoints is off by a percent of the largest value where the lobe is steep.
        assert (np.abs(one.values - mean) < 5.0 * spread + 0.01 * mean.max() + 1e-12).all()
    lost = write_bsdf_data(tmp_path / "x.tt.xml", data)
    assert any("16 × 16" in sentence for sentence in lost)


def test_an_isotropic_tree_keeps_shares(tmp_path: Path) -> None:
    film = et.bsdf.Gaussian(peak=2.0, sigma=0.2, way="transmitted")
    et.write_bsdf(tmp_path / "x.tt.xml", film)
    again = et.read_bsdf(tmp_path / "x.tt.xml")
    for one in again.data.slices[::8]:
        assert one.integral() == pytest.approx(float(film.transmittance(one.theta)), rel=0.01)


@pytest.mark.parametrize(
    ("tree", "said"),
    [
        ("{ 1 2 3 }", "no grid of finite"),
        ("{ 1 nan }", "no grid of finite"),
        ("{ { 1 } { 2 } }", "a branch of 2"),
        ("{ 1 ", "do not close"),
        ("1 }", "a brace too many"),
        ("{ 1 } { 2 }", "a second tree"),
        ("{ 1 { 2 } }", "values beside branches"),
        (40 * "{ ", "nested more than"),
        ("", "do not close"),
    ],
)
def test_mistakes(tree: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "x.xml"
    path.write_text(XML.format(rank=3, way="Reflection Front", tree=tree))
    with pytest.raises(FormatError, match=said):
        read_bsdf_data(path)


def test_a_matrix_of_klems_has_the_axes_of_radiance(tmp_path: Path) -> None:
    """Radiance's upwards direction y stays; its x has the other sign, as the front of the file is on the other side.

    The patch of Transmission Front at θ 40°, φ 90° is upwards, and that at φ 0° on the left of who looks at the front.
    """
    from etendue.formats.bsdf.klems import BASES

    theta, phi = BASES["LBNL/Klems Full"].centres
    matrix = np.zeros((145, 145))
    up, right = (int(np.argmin(np.abs(theta - 40.0) + np.abs(phi - azimuth))) for azimuth in (90.0, 0.0))
    matrix[up, up], matrix[right, right] = 1.0, 2.0
    rows = "\n".join(",".join(map(str, row)) for row in matrix)
    text = XML.format(rank=4, way="Transmission Front", tree=rows).replace("TensorTree4", "Columns")
    text = text.replace(
        "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>",
        "<ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis><RowAngleBasis>LBNL/Klems Full</RowAngleBasis>",
    )
    path = tmp_path / "x.xml"
    path.write_text(text)
    lit = [one for one in read_bsdf_data(path).slices if one.values.any()]
    assert len(lit) == 2
    for one, to in zip(lit, (direction(40.0, 180.0, behind=True), direction(40.0, 90.0, behind=True)), strict=True):
        # Light that goes upwards, or to Radiance's +x, which is étendue's −x, and stays so.
        assert np.allclose(one.directions[one.values > 0.0], to, atol=1e-9)
        assert np.allclose(one.incident, [-to[0], -to[1], -to[2]], atol=1e-9)
