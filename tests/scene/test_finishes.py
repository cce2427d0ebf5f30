"""Finishes: shares of light against what is written, thesis eqs. 4.1 and 4.2, and what cannot be."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.description.files import Files
from etendue.description.tables import Grid, on_common_nodes
from etendue.errors import ArgumentError, SceneError
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.bsdf import Bsdf
from etendue.scatter.materials import MATERIALS
from etendue.scatter.models.shares import PARTS
from etendue.scatter.table import BsdfTable
from etendue.scene import Scene, compile_scene, finishes
from etendue.scene.colour_dependence import telling_finishes
from etendue.scene.finishes import BUILT_IN, FINISHES
from scipy.interpolate import RegularGridInterpolator

HERE = Files(Path())

SPECIMENS: dict[str, dict[str, Any]] = {
    "mirror": {"reflectance": 0.9},
    "absorber": {},
    "lambertian": {"reflectance": 0.4, "transmittance": 0.5},
    "diffuse-specular": {"total_reflectance": 0.9, "specular_reflectance": 0.1},
    "transmitter": {"transmittance": 0.7},
    "mixed": {
        "specular_reflectance": 0.1,
        "specular_transmittance": 0.2,
        "diffuse_reflectance": 0.3,
        "diffuse_transmittance": 0.4,
    },
}
EXPECTED: dict[str, tuple[float, float, float, float]] = {
    "mirror": (0.9, 0, 0, 0),
    "absorber": (0, 0, 0, 0),
    "lambertian": (0, 0, 0.4, 0.5),
    "diffuse-specular": (0.1, 0, 0.8, 0),
    "transmitter": (0, 0.7, 0, 0),
    "mixed": (0.1, 0.2, 0.3, 0.4),
}
"""Shares in the order of `PARTS`."""


SCATTERING = [kind for kind, cls in FINISHES.items() if issubclass(cls, finishes.Scattering)]
"""Finishes that are given by their shares alone."""


def test_every_finish_with_given_shares_is_tested() -> None:
    assert set(SPECIMENS) == set(EXPECTED) == set(SCATTERING)


@pytest.mark.parametrize("kind", SCATTERING)
def test_shares(kind: str) -> None:
    """The four shares by hand."""
    record = FINISHES[kind](**SPECIMENS[kind]).record(HERE)
    assert [float(record[part]["values"][0, 0]) for part in PARTS] == pytest.approx(EXPECTED[kind])
    assert all(record[part]["values"].shape == (1, 1) for part in PARTS)


@pytest.mark.parametrize("kind", SCATTERING)
def test_whether_light_gets_in(kind: str) -> None:
    """Transmission decides."""
    transmits = EXPECTED[kind][1] + EXPECTED[kind][3] > 0
    assert FINISHES[kind](**SPECIMENS[kind]).lets_light_in(HERE) is transmits


def test_an_interface_leaves_its_shares_to_the_media() -> None:
    assert finishes.Interface().record(HERE) == {"kind": "fresnel"}
    assert finishes.Interface().lets_light_in(HERE)


def bilinear(record: dict[str, Any], angle: float, wavelength: float) -> float:
    """A table of the record by scipy, clamped to its edges."""
    nodes = [record["angle"], record["wavelength"]]
    values = record["values"]
    for axis, row in enumerate(nodes):
        if len(row) == 1:  # scipy asks for two nodes
            nodes[axis] = np.array([row[0], row[0] + 1.0])
            values = np.repeat(values, 2, axis=axis)
    at = [np.clip(v, row[0], row[-1]) for v, row in zip((angle, wavelength), nodes, strict=True)]
    return float(RegularGridInterpolator(nodes, values)(at)[0])


def test_the_diffuse_part_is_what_the_specular_part_leaves() -> None:
    """Eq. 4.2 at any angle and wavelength: R_diff = R_total(λ) - R_spec(θ), although their nodes differ."""
    paint = finishes.DiffuseSpecular(
        total_reflectance={"wavelength": [400, 500, 700], "values": [0.8, 0.95, 0.9]},
        specular_reflectance={"angle": [5, 45, 80], "values": [0.04, 0.06, 0.5]},
    )
    record = paint.record(HERE)
    rng = np.random.default_rng(3)
    for angle, wavelength in zip(rng.uniform(0, np.pi / 2, 50), rng.uniform(350, 750, 50), strict=True):
        total = np.interp(wavelength, [400, 500, 700], [0.8, 0.95, 0.9])
        specular = np.interp(np.degrees(angle), [5, 45, 80], [0.04, 0.06, 0.5])
        assert bilinear(record["specular_reflectance"], angle, wavelength) == pytest.approx(specular, abs=1e-12)
        assert bilinear(record["diffuse_reflectance"], angle, wavelength) == pytest.approx(total - specular, abs=1e-12)


def test_tables_on_common_nodes_are_the_same_functions() -> None:
    """Bilinear between nodes and constant outside, before and after."""
    rng = np.random.default_rng(4)
    grids = [
        Grid(np.sort(rng.uniform(0, 90, n)), np.sort(rng.uniform(400, 700, m)), rng.random((n, m)))
        for n, m in ((3, 2), (1, 5), (4, 1))
    ]
    angle, wavelength, values = on_common_nodes(grids)
    at = rng.uniform(-10, 100, 40), rng.uniform(300, 800, 40)
    for grid, common in zip(grids, values, strict=True):
        again = Grid(angle, wavelength, common)
        assert again.at(*map(np.sort, at)) == pytest.approx(grid.at(*map(np.sort, at)), abs=1e-13)


def test_tables_from_files(tmp_path: Path) -> None:
    (tmp_path / "r.txt").write_text("0 0.1\n90 0.9\n", encoding="utf-8")
    for by, angle in (("angle", [0.0, np.pi / 2]), ("wavelength", [0.0])):
        if by == "wavelength":
            (tmp_path / "r.txt").write_text("400 0.1\n700 0.9\n", encoding="utf-8")
        record = finishes.Mirror(reflectance={"file": "r.txt", "by": by}).record(Files(tmp_path))[
            "specular_reflectance"
        ]
        assert record["angle"].tolist() == angle
        assert record["values"].ravel().tolist() == [0.1, 0.9]
    (tmp_path / "r.txt").write_text("0 0.1\n91 0.9\n", encoding="utf-8")
    with pytest.raises(ArgumentError, match="0 to 90°"):
        finishes.Mirror(reflectance={"file": "r.txt", "by": "angle"}).record(Files(tmp_path))


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"values": [1.0]}, "give 'angle', 'wavelength' or both"),
        ({"angle": [0, 90]}, "give either 'values', or a 'file'"),
        ({"angle": [0, 91], "values": [0, 0]}, r"angle\[1\]: is 91; it must be at most 90"),
        ({"angle": [10, 0], "values": [0, 0]}, "'angle' must rise"),
        ({"angle": [0, 90], "values": [0.5, 1.5]}, "between 0 and 1"),
        ({"angle": [0, 90], "values": [0.5]}, "the nodes ask for 2 values"),
        ({"angle": [0, 90], "wavelength": [400, 700], "values": [0.5, 0.5]}, "2 rows of 2 values"),
        ({"angle": [0, 90], "values": ["a", "b"]}, "must be numbers"),
        ({"angle": [0, 90], "values": [[0.1], [0.1, 0.2]]}, "must be numbers, or rows"),
        ({"file": "r.txt"}, "'file' and 'by' belong together"),
        ({"file": "r.txt", "by": "angle", "angle": [0]}, "columns of the file"),
        ({"file": "r.txt", "by": "angel"}, "Did you mean 'angle'"),
    ],
)
def test_tables_that_are_none(table: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=f"reflectance.*{words}"):
        finishes.Mirror(reflectance=table)


def test_more_light_than_arrives() -> None:
    """At one angle only, and where the specular part exceeds the total."""
    rising = {"angle": [0, 60, 90], "values": [0.1, 0.2, 0.7]}
    with pytest.raises(ArgumentError, match=r"add up to 1.2 at 90° and 555 nm"):
        finishes.Mixed(specular_reflectance=rising, diffuse_transmittance=0.5).record(HERE)
    with pytest.raises(ArgumentError, match=r"specular_reflectance 0.7 is more than total_reflectance 0.5 at 90°"):
        finishes.DiffuseSpecular(total_reflectance=0.5, specular_reflectance=rising).record(HERE)
    # 0.1 + 0.2 + 0.7 exceeds 1 by rounding alone.
    finishes.Mixed(specular_reflectance=0.1, diffuse_reflectance=0.2, diffuse_transmittance=0.7).record(HERE)


def test_names_of_finishes_and_faces() -> None:
    """Every face has the finish that is nearest to it: its own, its group's, the solid's."""
    prism = {"kind": "prism", "vertices": [(0, 0), (1, 0), (0, 1)], "height": 1}
    keys = {"side": {"kind": "absorber"}, "side 2": "mirror", "top": {"kind": "lambertian", "reflectance": 0.5}}
    scene = Scene(
        finishes={"grey": {"kind": "mirror", "reflectance": 0.5}},
        solids=[{"name": "p", "shape": prism, "medium": "PC", "finishes": keys, "finish": "grey"}],
        surfaces=[{"name": "s", "shape": {"kind": "disk", "radius": 1}, "finish": "absorber"}],
    )
    compiled = compile_scene(scene)
    found = {
        name: compiled.finish_names[face["finish"]]
        for name, face in zip(compiled.face_names, compiled.record["faces"], strict=True)
    }
    assert found == {
        "p.side 1": "p.side.finish",
        "p.side 2": "mirror",
        "p.side 3": "p.side.finish",
        "p.bottom": "grey",
        "p.top": "p.top.finish",
        "s": "absorber",
    }
    assert len(set(compiled.finish_names)) == len(compiled.finish_names) == 5


def test_interfaces_on_surfaces_are_told_of() -> None:
    """The same medium lies on both sides of a surface, so nothing happens there."""
    disk = {"shape": {"kind": "disk", "radius": 1}}
    for finish in ("interface", {"kind": "interface"}):
        (note,) = compile_scene(Scene(surfaces=[{**disk, "name": "pane", "finish": finish}])).notes
        assert note.startswith("pane: an interface changes nothing")
    assert compile_scene(Scene(surfaces=[{**disk, "finish": "mirror"}])).notes == ()


def test_finishes_that_treat_colours_differently_are_named_whatever_they_are_made_of() -> None:
    """Those whose own reflectance at 60° differs between the wavelengths, and no others."""
    white, red = 0.4, {"wavelength": [450, 650], "values": [0.2, 0.6]}
    made: dict[str, Bsdf] = {}
    for name, r in (("white", white), ("red", red)):
        made[name] = et.bsdf.Lambertian(reflectance=r)
        made[f"{name} mixture"] = et.bsdf.Mixture(
            parts=[{"kind": "gaussian", "peak": 0.5, "sigma": 0.2}, {"kind": "lambertian", "reflectance": r}]
        )
        made[f"{name} coat"] = et.bsdf.RoughCoat(index=1.5, base_reflectance=r, roughness=0.3)
    grid = PolarGrid("normal", np.array([0.0, 90.0]), np.array([0.0]))
    for name, at in (("white table", {None: 0.1}), ("red table", {450.0: 0.1, 650.0: 0.2})):
        slices = [BsdfSlice(direction(30.0, 0.0), [[f, f]], grid=grid, wavelength=line) for line, f in at.items()]
        made[name] = BsdfTable(BsdfData(slices))
    for lines in ([450.0, 650.0], [500.0, 510.0], [650.0, 700.0], [600.0]):
        for name, finish in made.items():
            values = [float(finish.reflectance(60, wavelength=line)) for line in lines]
            told = list(telling_finishes([finish.record(HERE)], [name], np.array(lines)))
            assert told == ([f"the finish {name!r}"] if np.ptp(values) > 1e-6 else []), (lines, values)


def test_built_in_finishes() -> None:
    assert set(BUILT_IN) == {"interface", "absorber", "mirror", "transparent", *MATERIALS}
    transparent = BUILT_IN["transparent"].record(HERE)
    assert transparent["specular_transmittance"]["values"].tolist() == [[1.0]]


def test_a_solid_that_no_light_enters_needs_no_medium() -> None:
    """A metal block; but not if one face transmits."""
    block = {"shape": {"kind": "block", "width": 1, "height": 1, "depth": 1}, "finish": "mirror"}
    assert compile_scene(Scene(solids=[block])).record["solids"] == [{"medium": 0}]
    with pytest.raises(SceneError, match=r"solids\[0\].medium: is missing"):
        compile_scene(Scene(solids=[{**block, "finishes": {"top": "interface"}}]))


def absorbed(scene: dict[str, Any], name: str) -> float:
    """Of 1 lm, by a surface or a medium of this name."""
    ledger = et.trace(et.Scene(**scene), 20_000).ledger
    return {**ledger.by_surface, **ledger.by_medium}[name].flux


def beam(x: float) -> dict[str, Any]:
    return {"kind": "beam", "shape": {"kind": "disk", "radius": 1}, "flux": 1, "at": [x, 0, 50], "toward": [0, 0, -1]}


def plate(name: str, x: float, finish: Any) -> dict[str, Any]:
    return {"name": name, "shape": {"kind": "disk", "radius": 5}, "at": [x, 0, 0], "finish": finish}


def grey(reflectance: float) -> dict[str, Any]:
    return {"kind": "lambertian", "reflectance": reflectance}


@pytest.mark.parametrize("named", ["dark.finish", "paint"])
def test_a_finish_without_a_name_is_never_that_of_another(named: str) -> None:
    """Names are free: one that looks like what a finish without a name is called does not take its place."""
    surfaces = [plate("bright", 0, named), plate("dark", 100, grey(0.1))]
    scene = {"sources": [beam(0), beam(100)], "finishes": {named: grey(0.9)}, "surfaces": surfaces}
    # Binomial, 10 000 rays each: five standard deviations.
    assert absorbed(scene, "bright") == pytest.approx(0.1, abs=0.015)
    assert absorbed(scene, "dark") == pytest.approx(0.9, abs=0.015)


def test_faces_and_surfaces_with_finishes_of_their_own() -> None:
    """The face `top` of the solid `x` and the surface `x.top` are two things."""
    block = {"name": "x", "shape": {"kind": "block", "width": 10, "height": 10, "depth": 5}, "medium": "BK7",
             "finishes": {"top": grey(0.9)}}  # fmt: skip
    scene = {"sources": [beam(100)], "solids": [block], "surfaces": [plate("x.top", 100, grey(0.1))]}
    ledger = et.trace(et.Scene(**scene), 20_000).ledger
    assert ledger.absorbed.flux == pytest.approx(0.9, abs=0.011)


@pytest.mark.parametrize("named", ["clear.medium", "ink"])
def test_a_medium_without_a_name_is_never_that_of_another(named: str) -> None:
    """Beer and Lambert: 5 mm of ink absorb 1 - exp(-0.5), the clear block beside it nothing."""
    blocks = [
        {
            "name": name,
            "shape": {"kind": "block", "width": 10, "height": 10, "depth": 5},
            "at": [x, 0, 0],
            "medium": medium,
        }
        for name, x, medium in (("inked", 0, named), ("clear", 100, {"index": 1.0}))
    ]
    scene = et.Scene(sources=[beam(0), beam(100)], media={named: {"index": 1.0, "absorption": 0.1}}, solids=blocks)
    # Binomial, 10 000 rays of 1e-4 lm each.
    assert et.trace(scene, 20_000).ledger.absorbed.flux == pytest.approx(1 - np.exp(-0.5), abs=0.025)


TWO_WAYS = {"angle": [0, 90], "wavelength": [450, 650], "values": [[0.9, 0.5], [0.7, 0.3]]}


@pytest.mark.parametrize(
    ("finish", "share"),
    [
        ({"kind": "mirror", "reflectance": TWO_WAYS}, 0.7),
        ({"kind": "lambertian", "reflectance": TWO_WAYS}, 0.7),
        ({"kind": "rough-metal", "reflectance": TWO_WAYS, "roughness": 0.05}, 0.7),
    ],
)
@pytest.mark.parametrize("where", ["surface", "face"])
def test_tables_over_two_variables_where_they_are_used(where: str, finish: dict[str, Any], share: float) -> None:
    """A table of angle and wavelength may stand in the surface itself: halfway between two colours it has their mean."""
    scene: dict[str, Any] = {"sources": [{**beam(0), "wavelength": 550}]}
    if where == "surface":
        scene["surfaces"] = [plate("s", 0, finish)]
    else:
        block = {"kind": "block", "width": 10, "height": 10, "depth": 5}
        scene["solids"] = [
            {"shape": block, "at": [0, 0, -5], "medium": "BK7", "finish": "absorber", "finishes": {"top": finish}}
        ]
    # Binomial: 20 000 rays, five standard deviations.
    assert et.trace(et.Scene(**scene), 20_000).ledger.absorbed.flux == pytest.approx(1 - share, abs=0.017)
