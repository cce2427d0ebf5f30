"""Light that is mirrored or goes straight on, and lobes after ABg, in the formats that hold them beside tables."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import etendue as et
import pytest
from etendue.errors import ArgumentError
from etendue.formats.bsdf import BSDF_FORMATS, read_bsdf_data, write_bsdf_data
from etendue.formats.bsdf.regular import regular_of
from etendue.quantities.bsdf_directions import direction
from formats.slanted import SlantedOnce, coarsen
from oracles.tracepro_files import NAMES, abg_side, ellipse, fixed, share, surface_property

ENDS = pytest.mark.parametrize("end", [".txt", ".ssdd"])
ANGLES = [0.0, 30.0, 60.0, 80.0]


def scatter_and_rows(path: Path) -> tuple[int, list[dict[str, float]]]:
    """The kind of scatter of a TracePro property of one side, and its rows of shares by the names of their columns."""
    lines = path.read_text().splitlines()
    (kind,) = (int(line.split()[1]) for line in lines if line.startswith("Scatter\t"))
    start = lines.index("\t".join(NAMES)) + 1
    end = lines.index("", start) if "" in lines[start:] else len(lines)
    return kind, [dict(zip(NAMES, map(float, line.split()), strict=True)) for line in lines[start:end]]


@pytest.mark.slow
@ENDS
def test_gloss_paint_keeps_its_gloss(tmp_path: Path, end: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """0.84 in all, of which a tenth of the light is mirrored up to 60° and four tenths at 90°, linear in between."""
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (0.0, 30.0, 60.0, 80.0))
    mirrored = {"angle": [0, 60, 90], "values": [0.1, 0.1, 0.4]}
    paint = et.bsdf.DiffuseSpecular(total_reflectance=0.84, specular_reflectance=mirrored)
    lost = et.write_bsdf(tmp_path / f"paint{end}", paint)
    assert not any("single direction" in note for note in lost)
    again = et.read_bsdf(tmp_path / f"paint{end}")
    assert again.regular_reflectance([0, 60, 75, 80]) == pytest.approx([0.1, 0.1, 0.25, 0.3])
    # 1e-3: the rim of the hemisphere cuts cells of the table.
    assert again.reflectance(ANGLES) == pytest.approx(0.84, abs=1e-3)


@ENDS
def test_straight_light_is_kept_apart_from_mirrored_light(tmp_path: Path, end: str) -> None:
    film = et.bsdf.Mixed(specular_reflectance=0.1, specular_transmittance={"angle": [0, 90], "values": [0.8, 0.2]})
    assert et.write_bsdf(tmp_path / f"film{end}", film) == ()
    again = et.read_bsdf(tmp_path / f"film{end}")
    assert again.regular_reflectance(ANGLES) == pytest.approx(0.1)
    assert again.regular_transmittance([0, 45, 90]) == pytest.approx([0.8, 0.5, 0.2])
    assert again.ways == (True, True, False, False)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tracepro", "ssdd"])
def test_shares_beside_a_table_without_symmetry(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of light from both sides, where the format has them; at the one incidence of the tables, which has all rows.

    What is neither mirrored nor let straight on nor scattered is absorbed: so the shares of the rows add up to 1.
    """
    coarsen(monkeypatch, 30.0)
    form = BSDF_FORMATS[name]
    assert form.tabulate is not None
    mixed = {
        "kind": "mixed",
        "specular_reflectance": {"angle": [60.0], "values": [0.2]},
        "specular_transmittance": 0.05,
    }
    data = dataclasses.replace(form.tabulate(SlantedOnce()), components=(mixed,))
    assert write_bsdf_data(tmp_path / "x", data, name) == ()
    again = read_bsdf_data(tmp_path / "x")
    regular = regular_of(again.components)
    assert regular is not None
    assert regular.at([60.0])[:, 0] == pytest.approx([0.2, 0.05])
    assert len(again.slices) == len(data.slices)
    for one in data.slices:
        same = (other for other in again.slices if other.transmitted == one.transmitted)
        near = max(same, key=lambda other: float(other.incident @ one.incident))
        at = one.directions[..., 2] ** 2 > 0.01
        assert near.at(one.directions[at]) == pytest.approx(one.values[at], rel=1e-6)
    # A row that leaves another share for scatter than its tables have would be told.
    assert not any("leaves" in complaint.found for complaint in again.complaints)


def test_a_property_of_abg_and_mirrored_light_is_written_as_it_was_read(tmp_path: Path) -> None:
    """At 0° a tenth is mirrored, and ABg with g = 2 scatters πA ln(1 + 1/B); at 60° what a quadrature says."""
    path = tmp_path / "polish.txt"
    path.write_text(surface_property(scatter=1, sections=[abg_side(a=0.01, mirrored=0.1)]))
    read = et.read_bsdf(path)
    assert et.write_bsdf(tmp_path / "again.txt", read) == ()
    kind, rows = scatter_and_rows(tmp_path / "again.txt")
    assert kind == 1
    total = math.pi * 0.01 * math.log(11.0)
    again = et.read_bsdf(tmp_path / "again.txt")
    assert float(again.reflectance(0.0)) == pytest.approx(0.1 + total, rel=1e-5)
    assert [dict(part)["kind"] for part in again.data.components] == ["mixed", "abg"]
    assert not again.complaints
    (normal,) = (row for row in rows if row["IncAngle"] == 0.0)
    assert normal["Abso_S"] == normal["Abso_P"] == pytest.approx(0.9 - total, rel=1e-6)
    (oblique,) = (row for row in rows if row["IncAngle"] == 60.0)
    scattered = share(f=lambda x, y: 0.01 / (0.1 + x * x + y * y), beta0=(0.0, math.sin(math.radians(60.0))))
    assert 0.9 - oblique["Abso_S"] == pytest.approx(scattered, abs=1e-4)


@pytest.mark.slow
def test_abg_to_either_side_with_its_weight(tmp_path: Path) -> None:
    """Half of one lobe back and two of another through, as formulas: the same f as the mixture, everywhere."""
    parts = [
        {"kind": "abg", "a": 0.01, "b": 0.1, "g": 2},
        {"kind": "abg", "a": 0.02, "b": 0.2, "g": 1.5, "way": "transmitted"},
        {"kind": "mirror", "reflectance": 0.3},
    ]
    plate = et.bsdf.Mixture(parts=parts, weights=[0.5, 2.0, 1.0])
    assert et.write_bsdf(tmp_path / "plate.txt", plate) == ()
    assert (tmp_path / "plate.txt").stat().st_size < 4000
    again = et.read_bsdf(tmp_path / "plate.txt")
    for behind in (False, True):
        pair = direction(40.0, 20.0), direction([[10.0], [40.0], [75.0]], [0.0, 130.0, 200.0], behind=behind)
        assert again.evaluate(*pair) == pytest.approx(plate.evaluate(*pair), rel=1e-12)
    assert again.regular_reflectance(ANGLES) == pytest.approx(0.3)


@pytest.mark.slow
@pytest.mark.parametrize("way", ["reflected", "transmitted"])
def test_elliptical_abg_is_a_formula_where_it_is_the_same_function(tmp_path: Path, way: str) -> None:
    """For g = 1 A/(B + ρ) with ρ² = x² + (y/3)²; held against the formula of TracePro's manual, and its shares."""
    lobe = et.bsdf.ABg(a=0.02, b=0.05, g=1, aspect=3, way=way)
    assert et.write_bsdf(tmp_path / "brushed.txt", lobe) == ()
    kind, rows = scatter_and_rows(tmp_path / "brushed.txt")
    assert kind == 2
    f = ellipse(peak=0.4, b=(0.05, 0.15), g=(1.0, 1.0))
    for row in rows:
        if row["IncAngle"] in (0.0, 60.0):
            scattered = share(f=f, beta0=fixed(theta=row["IncAngle"], phi=row["AziAngle"]))
            assert 1.0 - row["Abso_S"] == pytest.approx(scattered, abs=2e-4)
    assert {row["AziAngle"] for row in rows} == {0.0, 90.0}
    again = et.read_bsdf(tmp_path / "brushed.txt")
    assert not again.isotropic
    pair = direction(40.0, 20.0), direction([[10.0], [40.0], [75.0]], [0.0, 130.0, 200.0], behind=way == "transmitted")
    assert again.evaluate(*pair) == pytest.approx(lobe.evaluate(*pair), rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "bsdf",
    [
        et.bsdf.ABg(a=0.02, b=0.05, g=1.5, aspect=3),
        et.bsdf.ABg(a=0.02, b=0.05, g=1.5, beyond="renormalised"),
        et.bsdf.Mixture(parts=[{"kind": "abg", "a": 0.01, "b": b, "g": 2} for b in (0.1, 0.2)]),
        et.bsdf.Mixture(parts=[{"kind": "abg", "a": 0.01, "b": 0.1, "g": 2}, {"kind": "lambertian", "reflectance": 0.1}]),
    ],
)  # fmt: skip
def test_what_is_no_formula_of_tracepro_is_a_table(
    tmp_path: Path, bsdf: et.Bsdf, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (0.0, 40.0))
    assert "the values are a table made for this format" in et.write_bsdf(tmp_path / "x.txt", bsdf)
    assert scatter_and_rows(tmp_path / "x.txt")[0] == 5
    again = et.read_bsdf(tmp_path / "x.txt")
    assert float(again.reflectance(40.0, 180.0)) == pytest.approx(float(bsdf.reflectance(40.0, 180.0)), rel=0.01)


@pytest.mark.slow
@ENDS
def test_grazing_light_is_mirrored_as_far_as_the_table_goes(
    tmp_path: Path, end: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fresnel's share rises to 1 at 90°, where a table of 89° still scatters: more than all light would leave."""
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (0.0, 60.0))
    lost = et.write_bsdf(tmp_path / f"coat{end}", et.bsdf.Coated(index=1.5, base_reflectance=0.9))
    (told,) = (note for note in lost if "beyond 89°" in note)
    # Fresnel at 89°, unpolarised, index 1.5.
    i = math.radians(89.0)
    t = math.asin(math.sin(i) / 1.5)
    fresnel = 0.5 * ((math.sin(i - t) / math.sin(i + t)) ** 2 + (math.tan(i - t) / math.tan(i + t)) ** 2)
    assert f"{fresnel:.3g} of the light, at 90° 1 in truth" in told
    again = et.read_bsdf(tmp_path / f"coat{end}")
    assert float(again.regular_reflectance(90.0)) == pytest.approx(fresnel, rel=1e-6)
    assert any("at the incidences of the table alone" in note for note in lost) is (end == ".txt")


@ENDS
def test_of_colours_the_one_that_is_mirrored_is_told(tmp_path: Path, end: str) -> None:
    gold = et.bsdf.Mirror(reflectance={"wavelength": [455, 655], "values": [0.4, 0.9]})
    told = "no wavelength is in the file: its values are those at 555 nm"
    assert et.write_bsdf(tmp_path / f"gold{end}", gold) == (told,)
    assert float(et.read_bsdf(tmp_path / f"gold{end}").regular_reflectance(20.0)) == pytest.approx(0.65)


@ENDS
def test_what_media_mirror_is_no_share_of_a_surface(tmp_path: Path, end: str) -> None:
    with pytest.raises(ArgumentError, match="nothing of this BSDF is scattered"):
        et.write_bsdf(tmp_path / f"glass{end}", et.bsdf.Interface())
    assert not (tmp_path / f"glass{end}").exists()
