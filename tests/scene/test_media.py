"""Media: published indices at spectral lines, formulas and tables."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.description.files import Files
from etendue.errors import ArgumentError, FormatError, SceneError
from etendue.scene import Scene, compile_scene
from etendue.scene.finishes import Transmitter
from etendue.scene.media import Medium, Sellmeier
from etendue.scene.media_library import MEDIA

D, F, C, SODIUM = 587.5618, 486.1327, 656.2725, 589.29

PUBLISHED = [
    # Schott's data sheet of N-BK7.
    ("BK7", D, 1.51680, 1e-5),
    ("BK7", F, 1.52238, 1e-5),
    ("BK7", C, 1.51432, 1e-5),
    # Malitson 1965, table 1: 0.587562 µm and 0.486133 µm.
    ("fused-silica", D, 1.45846, 1e-5),
    ("fused-silica", F, 1.46313, 1e-5),
    # Sultanova et al. 2009, table 1, at 587.6 nm; the fit to all their wavelengths misses a single one by some 1e-3.
    ("PMMA", D, 1.491, 1e-3),
    ("PC", D, 1.585, 1e-3),
    # IAPWS: water at 20 °C against air at the sodium lines.
    ("water", SODIUM, 1.33299, 2e-5),
    ("silicone", D, 1.42, 0.0),
    ("air", D, 1.0, 0.0),
    ("vacuum", D, 1.0, 0.0),
]


def test_every_medium_of_the_library_is_tested() -> None:
    assert {name for name, *_ in PUBLISHED} == set(MEDIA)


@pytest.mark.parametrize(("name", "wavelength", "index", "tolerance"), PUBLISHED)
def test_published_indices(name: str, wavelength: float, index: float, tolerance: float) -> None:
    found = float(MEDIA[name].medium.index_at([wavelength], Files())[0])
    assert found == pytest.approx(index, abs=tolerance or 1e-15)


def test_abbe_numbers() -> None:
    """(n_d - 1)/(n_F - n_C): 64.17 of N-BK7 and 67.8 of fused silica by their data sheets, 57.4 and 29.9 of plastics.

    The fits with one term disperse up to a tenth more than the plastics do, which is 7e-4 in n from F to C.
    """
    for name, abbe, tolerance in (
        ("BK7", 64.17, 0.01),
        ("fused-silica", 67.8, 0.1),
        ("PMMA", 57.4, 5),
        ("PC", 29.9, 2.5),
    ):
        d, f, c = MEDIA[name].medium.index_at([D, F, C], Files())
        assert (d - 1) / (f - c) == pytest.approx(abbe, abs=tolerance)


def test_the_record_of_a_formula_is_the_formula() -> None:
    """The record's coefficients, put into the equation of the border once more."""
    record = MEDIA["water"].medium.record(Files())["index"]
    l2 = 0.6**2
    n2 = 1 + sum(b * l2 / (l2 - c) for b, c in zip(record["b"], record["c"], strict=True))
    assert n2**0.5 == pytest.approx(float(MEDIA["water"].medium.index_at([600.0], Files())[0]), rel=1e-15)


def test_tables_in_the_scene_and_in_files(tmp_path: Path) -> None:
    """A table is linear between its nodes and constant outside, wherever it stands."""
    (tmp_path / "n.csv").write_text("# nm; n\n700, 1.4\n\n400; 1.6 # sorted by the reader\n", encoding="utf-8")
    by_file = Medium.model_validate({"table": {"file": "n.csv"}, "absorption": {"wavelength": [500], "values": [0.1]}})
    in_line = Medium.model_validate({"table": {"wavelength": [400, 700], "values": [1.6, 1.4]}})
    for medium in (by_file, in_line):
        assert medium.index_at([300, 550, 900], Files(tmp_path)) == pytest.approx([1.6, 1.5, 1.4])
        assert medium.record(Files(tmp_path))["index"]["n"].tolist() == [1.6, 1.4]
    assert by_file.record(Files(tmp_path))["absorption"]["per_mm"].tolist() == [0.1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("400 1.5 3", "line 1"),
        ("400 x", "line 1"),
        ("# nothing", "no numbers"),
        ("400 1.5\n400 1.6", "twice"),
        ("400 nan", "not finite"),
    ],
)
def test_files_that_are_no_tables(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "n.csv").write_text(text, encoding="utf-8")
    with pytest.raises(FormatError, match=words):
        Medium.model_validate({"table": {"file": "n.csv"}}).record(Files(tmp_path))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "given by nothing"),
        ({"index": 1.5, "sellmeier": {"b": [1], "c": [0.01]}}, "'index' and 'sellmeier'"),
        ({"index": 0.9}, "index: is 0.9; it must be at least 1"),
        ({"index": 1.5, "absorption": -1}, "absorption: is -1; it must be at least 0"),
        (
            {"index": 1.5, "absorption": {"wavelength": [20, 10], "values": [0, 0]}},
            "absorption: 'wavelength' must rise",
        ),
        ({"table": {"wavelength": [400], "values": [1.5, 1.6]}}, "same length"),
        ({"sellmeier": {"b": [1, 2], "c": [0.01]}}, "same length"),
    ],
)
def test_media_that_are_none(keys: dict[str, object], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        Medium(**keys)


def test_an_index_that_is_missing_at_a_wavelength_of_a_source() -> None:
    """1 + λ²/(λ² - 0.36) is negative below 424 nm and has a pole at 600 nm."""
    strange = Medium(sellmeier=Sellmeier(b=[1.0], c=[0.36]))
    beam = {"kind": "beam", "shape": {"kind": "disk", "radius": 1}, "flux": 1}
    ball = {"name": "pearl", "shape": {"kind": "ball", "radius": 1}, "medium": "strange"}
    scene = Scene(media={"strange": strange}, solids=[ball], sources=[{**beam, "wavelength": 500}])
    with pytest.raises(SceneError, match=r"\"pearl\": medium: the refractive index of 'strange' is nan at 500 nm"):
        compile_scene(scene)
    compiled = compile_scene(scene.replace(sources=[{**beam, "wavelength": 800}]))
    assert compiled.medium_names == ("air", "strange")


def test_extrapolation_is_told() -> None:
    ball = {"shape": {"kind": "ball", "radius": 1}, "medium": "PMMA"}
    assert compile_scene(Scene(solids=[ball])).notes == ()
    (note,) = compile_scene(Scene(solids=[ball], wavelength=400)).notes
    assert note == "PMMA: its index was measured from 436.8 to 1052 nm and is extrapolated to 400 nm"


def test_a_far_field_behind_surroundings_that_absorb_is_told() -> None:
    """exp(−∞) is left of light that they absorb; a line beside their band escapes whole."""
    band = {"index": 1.0, "absorption": {"wavelength": [500, 600], "values": [0.01, 0.0]}}
    lamp = {"kind": "point", "flux": 3, "wavelength": 500}
    far = {"name": "far", "kind": "intensity", "c_planes": 4, "gamma_step": 45}
    for line, flux in ((500, 0.0), (650, 3.0)):
        scene = Scene(surroundings=band, sources=[lamp | {"wavelength": line}], detectors=[far])
        result = et.trace(scene, rays=1000)
        assert result.intensity["far"].flux == pytest.approx(flux)
        assert any(note.startswith("far: the surroundings absorb") for note in result.notes) == (not flux)


def test_absorption_stays_an_array() -> None:
    record = Medium(index=1.5, absorption=0.002).record(Files())
    assert isinstance(record["absorption"]["wavelength"], np.ndarray)
    assert record["absorption"]["per_mm"].tolist() == [0.002]


MICROMETRES = {"wavelength": [0.4, 0.7], "values": [0.9, 0.5]}


@pytest.mark.parametrize(
    ("keys", "place"),
    [
        ({"wavelength": 0.555}, "wavelength"),
        ({"sources": [{"kind": "point", "flux": 1, "wavelength": 0.45}]}, r"sources\[0\].wavelength"),
        ({"sources": [{"kind": "point", "flux": 1, "spectrum": [[0.45, 1]]}]}, r"sources\[0\].spectrum\[0\]\[0\]"),
        ({"media": {"m": {"index": 1.5, "absorption": MICROMETRES}}}, r"media.m.absorption.wavelength\[0\]"),
        ({"finishes": {"f": {"kind": "mirror", "reflectance": MICROMETRES}}}, r"reflectance.wavelength\[0\]"),
    ],
)
def test_wavelengths_in_micrometres_are_refused(keys: dict[str, object], place: str) -> None:
    with pytest.raises(SceneError, match=rf"{place}: is 0\.[0-9]+; wavelengths are in nm, and 10 nm at least"):
        Scene.from_dict(keys)


@pytest.mark.parametrize(
    "user",
    [Medium(table={"file": "n.csv"}), Transmitter(transmittance={"file": "n.csv", "by": "wavelength"})],
    ids=["index", "finish"],
)
def test_wavelengths_in_micrometres_of_files_are_refused(tmp_path: Path, user: Medium | Transmitter) -> None:
    (tmp_path / "n.csv").write_text("0.4, 0.9\n0.7, 0.8\n", encoding="utf-8")
    with pytest.raises(ArgumentError, match=r"n\.csv: .*wavelengths are in nm, and 10 nm at least"):
        user.record(Files(tmp_path))


def test_light_beyond_tables_is_told() -> None:
    """Of shares 1, 2, 3 and 4 at 380, 400, 650 and 730 nm, 0.1 lies below 400, 0.5 outside 400 to 700, 0.7 above 400 nm."""

    def noted(**keys: object) -> str:
        lamps = [
            {"name": "dim", "kind": "point", "flux": 1, "spectrum": [[400, 1]]},
            {"name": "lamp", "kind": "point", "flux": 1, "spectrum": [[380, 1], [400, 2], [650, 3], [730, 4]]},
        ]
        ball = {
            "name": "pearl",
            "shape": {"kind": "ball", "radius": 1},
            "at": [0, 0, 9],
            "medium": {"index": 1.5, **keys},
        }
        return " | ".join(compile_scene(Scene(sources=lamps, solids=[ball])).notes)

    def table(*wavelength: float, values: tuple[float, ...] = (0.3, 0.1)) -> dict[str, object]:
        return {"absorption": {"wavelength": wavelength, "values": values}}

    told = "the absorption of 'pearl.medium' is known from {} to {} nm; its last value is taken for {} "
    told += "of the light of 'lamp'"
    assert noted(**table(400, 700)) == told.format(400, 700, 0.5) + ", as at 730 nm"
    assert noted(**table(400, 730)) == told.format(400, 730, 0.1) + ", as at 380 nm"
    assert noted(**table(100, 400)) == told.format(100, 400, 0.7) + ", as at 730 nm"
    assert (
        noted(**table(380, 730))
        == noted(**table(100, 300, values=(0.1, 0.1)))
        == noted(**table(300, values=(0.1,)))
        == ""
    )
    bent = {"index": None, "table": {"wavelength": [390, 900], "values": [1.6, 1.5]}}
    assert noted(**bent) == told.replace("absorption", "index").format(390, 900, 0.1) + ", as at 380 nm"


def test_light_beyond_tables_of_finishes_is_told() -> None:
    sheet = {"name": "sheet", "shape": {"kind": "disk", "radius": 1}, "at": [0, 0, 3]}
    by_colour = {"wavelength": [500, 600], "values": [0.5, 0.9]}
    filters = {
        "f": {"kind": "mixture", "parts": [{"kind": "lambertian", "reflectance": by_colour}], "weights": [1]},
        "g": {"kind": "transmitter", "transmittance": {"angle": [0, 80], "values": [0.9, 0.1]}},
    }
    for name, told in (
        ("f", "the finish 'f' is known from 500 to 600 nm; its last value is taken for 1 of the light of"),
        ("g", ""),
    ):
        lamp = {"name": "lamp", "kind": "point", "flux": 1, "wavelength": 450}
        notes = compile_scene(Scene(finishes=filters, sources=[lamp], surfaces=[{**sheet, "finish": name}])).notes
        assert " ".join(notes).startswith(told)
        assert bool(notes) == bool(told)
