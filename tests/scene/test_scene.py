"""Scenes as files: what is read back, what is refused and how it is said."""

from __future__ import annotations

import copy
import json
import tomllib
from pathlib import Path
from typing import Any

import etendue as et
import pytest
from etendue import _core
from etendue.errors import ArgumentError, SceneError
from etendue.scatter.models import Gaussian, Mixture
from etendue.scene import Scene, compile_scene
from etendue.scene.toml import to_toml
from hypothesis import given
from hypothesis import strategies as st

EVERYTHING: dict[str, Any] = {
    "name": 'a "quoted" name, with\ttabs and ü',
    "wavelength": 450.5,
    "surroundings": "water",
    "media": {
        "my plastic": {"index": 1.49, "absorption": 0.001},
        "glass": {
            "sellmeier": {"b": [1.0, 0.5], "c": [0.01, 0.02]},
            "absorption": {"wavelength": [410, 720], "values": [3, 4]},
        },
    },
    "finishes": {
        "white": {"kind": "lambertian", "reflectance": 0.984},
        "gloss": {
            "kind": "diffuse-specular",
            "total_reflectance": 0.9,
            "specular_reflectance": {"angle": [0, 90], "wavelength": [400, 700], "values": [[0.1, 0.2], [0.3, 0.4]]},
        },
    },
    "sources": [
        {"kind": "surface", "name": "die", "shape": {"kind": "rectangle", "width": 1, "height": 1}, "flux": 100},
        {"kind": "rings", "radii": [1, 2], "flux": [3, 4], "spectrum": [[450, 1], [550, 3]], "toward": [0, 0, -1]},
        {"kind": "point", "flux": 5, "at": [0, 0, 1e-7]},
        {"kind": "beam", "shape": {"kind": "disk", "radius": 2}, "flux": 1, "wavelength": 633, "spin": 45},
    ],
    "solids": [
        {"name": "dome", "shape": {"kind": "dome", "radius": 3}, "medium": "silicone"},
        {
            "name": "lens",
            "shape": {"kind": "lens", "radius": 5, "thickness": 4, "front": {"radius_of_curvature": 10, "conic": -1}},
            "medium": "my plastic",
            "finishes": {"edge": {"kind": "absorber"}, "back": "white"},
            "at": [0, 0, 10],
        },
        {"shape": {"kind": "block", "width": 1, "height": 1, "depth": 1}, "finish": "absorber", "at": [30, 0, 0]},
    ],
    "surfaces": [
        {
            "shape": {"kind": "paraboloid", "focal_length": 5},
            "trim": {"z": [float("-inf"), 10], "half_spaces": [{"normal": [1, 0, 0], "distance": 2}]},
            "finish": "mirror",
            "axis": [1, 0, 0],
            "angle": 10,
        }
    ],
    "detectors": [
        {"kind": "rays", "name": "rcs", "shape": {"kind": "sphere", "radius": 100}},
        {"kind": "illuminance", "width": 10, "height": 20, "columns": 3, "rows": 4, "rotation": [10, 20, 30]},
        {"kind": "intensity", "c_planes": 8, "gamma_step": 5},
        {"kind": "image", "observer": "me"},
    ],
    "observers": [
        {
            "name": "me",
            "theta": 30,
            "distance": 1000,
            "screen": {"width": 10, "height": 10, "columns": 16, "rows": 8, "plane": "xy"},
        }
    ],
}
"""A scene with something of everything that needs no file."""


def test_a_scene_survives_its_file(tmp_path: Path) -> None:
    """Scene → TOML → Scene and dict → Scene → dict are identities, and the text is what a second pass would write."""
    scene = Scene.from_dict(EVERYTHING, folder=tmp_path)
    scene.save(tmp_path / "scene.toml")
    again = Scene.load(tmp_path / "scene.toml")
    assert again == scene
    assert again.to_toml() == scene.to_toml()
    assert Scene.from_dict(scene.to_dict(), folder=tmp_path) == scene
    assert scene.name == EVERYTHING["name"]
    assert scene.surfaces[0].trim.z == (float("-inf"), 10.0)


def test_keywords_and_descriptions_make_the_same_scene() -> None:
    """Classes in Python and tables in a file mean the same."""
    solids = et.scene.Solid(name="a", shape=et.scene.bodies.Ball(radius=2), medium=et.scene.Medium(index=1.5))
    by_class = Scene(solids=[solids], finishes={"w": et.scene.finishes.Lambertian(reflectance=0.5)})
    by_table = Scene.from_dict(
        {
            "solids": [{"name": "a", "shape": {"kind": "ball", "radius": 2}, "medium": {"index": 1.5}}],
            "finishes": {"w": {"kind": "lambertian", "reflectance": 0.5}},
        }
    )
    assert by_class == by_table
    assert by_class.replace(name="b").replace(name="") == by_class


def test_descriptions_are_frozen() -> None:
    with pytest.raises(Exception, match="frozen"):
        Scene().name = "b"  # type: ignore[misc]


@given(st.text(max_size=20), st.floats(min_value=1e-9, max_value=1e8), st.text(min_size=1, max_size=8))
def test_any_text_and_number_survives(name: str, radius: float, key: str) -> None:
    """Names of any letters, as values and as keys, and numbers to the last bit."""
    known = {"vacuum", "air", "BK7", "fused-silica", "PMMA", "PC", "silicone", "water"}
    scene = Scene(
        name=name,
        media={} if key in known else {key: {"index": 1.5}},
        solids=[{"shape": {"kind": "ball", "radius": radius}}],
    )
    assert Scene.from_dict(tomllib.loads(scene.to_toml())) == scene


def test_vectors_stand_on_one_line_whatever_texts_hold() -> None:
    """Only line breaks between values are taken out, none that a text or a row of tables has."""
    data = {
        "texts": ["a]", "}", "[,", "x,\n]", "[\n"],
        "rows": [[1.0, 2.5], [1e22, 1e-300], []],
        "solids": [{"at": [0.0, 0.0, 7.0]}, {"name": "}"}],
        "sources": [{"name": "}"}, {"name": "b"}],
        "q.r": {"\x7f": [float("inf"), -3]},
    }
    text = to_toml(data)
    assert tomllib.loads(text) == data
    assert "at = [0, 0, 7]\n" in text
    assert '    { name = "}" },\n    { name = "b" },\n' in text
    assert "rows = [[1, 2.5], [1e+22, 1e-300], []]\n" in text


def test_the_schema_is_json_and_knows_every_kind() -> None:
    schema = Scene.json_schema()
    text = json.dumps(schema)
    for kinds in (et.scene.shapes.SHAPES, et.scene.bodies.BODIES, et.scene.finishes.FINISHES, et.scene.sources.SOURCES):
        for kind in kinds:
            assert f'"const": "{kind}"' in text
    assert schema["additionalProperties"] is False
    assert schema["$defs"]["Ball"]["properties"]["radius"]["exclusiveMinimum"] == 0
    assert schema["$defs"]["Lambertian"]["properties"]["reflectance"]["oneOf"][0]["maximum"] == 1
    assert not {key for key in ("gt", "ge", "le") if f'"{key}"' in text}, "words that JSON Schema does not know"


MISTAKES: list[tuple[dict[str, Any], list[str]]] = [
    ({"solid": []}, ["solid: unknown key. Did you mean 'solids'?"]),
    ({"name": 3}, ["name: is 3: input should be a valid string"]),
    ({"wavelength": "555"}, ["wavelength: is '555', not a number"]),
    ({"wavelength": True}, ["wavelength: is True, not a number"]),
    ({"solids": {"shape": 1}}, ["solids: is {'shape': 1}, not a row of values in [ ]"]),
    (
        {"solids": [{"name": "lens", "shape": {"kind": "frustum", "radius_bottom": 1, "radius_tpo": 2, "height": 0}}]},
        [
            "solids[0] \"lens\": shape.radius_tpo: unknown key. Did you mean 'radius_top'?",
            'solids[0] "lens": shape.radius_top: is missing',
            'solids[0] "lens": shape.height: is 0; it must be greater than 0',
        ],
    ),
    (
        {"solids": [{"shape": {"kind": "Ball", "radius": 1}}]},
        ["solids[0].shape: unknown kind 'Ball'. Did you mean 'ball'?"],
    ),
    ({"solids": [{"shape": {"radius": 1}}]}, ["solids[0].shape: 'kind' is missing. Known kinds: ball, "]),
    ({"solids": [{"shape": 7}]}, ["solids[0].shape: is 7, not a table with a 'kind'."]),
    (
        {"surfaces": [{"shape": {"kind": "disk", "radius": 1}, "finish": 0.5}]},
        ["surfaces[0].finish: is 0.5, not a name or a table with a 'kind'."],
    ),
    ({"surfaces": [{"shape": {"kind": "disk", "radius": float("inf")}, "finish": "mirror"}]}, ["shape.radius: is inf"]),
    (
        {"surfaces": [{"shape": {"kind": "disk", "radius": 1}, "finish": "mirror", "toward": [0, 0, 0]}]},
        ["surfaces[0]: 'toward' is [0.0, 0.0, 0.0], which is no direction"],
    ),
    (
        {"sources": [{"kind": "point", "flux": 1, "toward": [0, 0, 1], "axis": [0, 0, 1], "angle": 3}]},
        ["sources[0]: is turned by 'toward' and 'axis'; use one of them"],
    ),
    ({"sources": [{"kind": "point", "flux": 1, "angle": 3}]}, ["'axis' and 'angle' belong together"]),
    ({"sources": [{"kind": "rays"}]}, ["sources[0]: 'file' is missing"]),
    (
        {"media": {"m": {1: 2}}},
        ["media.m.1: unknown key. Known: ", "media.m: the refractive index is given by nothing"],
    ),
    ({"sources": [{"kind": "point"}]}, ["sources[0]: 'flux' is missing"]),
    (
        {"sources": [{"kind": "point", "flux": 1, "spectrum": [[500, 1], [400, 1]]}]},
        ["sources[0]: 'spectrum': the wavelengths must rise"],
    ),
    ({"detectors": [{"kind": "intensity", "gamma_step": 7}]}, ["'gamma_step' is 7°, which does not divide 180°"]),
    (
        {"observers": [{"distance": 1, "screen": {"width": 1, "height": 1, "rows": 1}}]},
        ["observers[0].screen.columns: is missing"],
    ),
    (
        {"observers": [{"distance": -1, "screen": {"width": 1, "height": 1, "columns": 1, "rows": 1}}]},
        ["observers[0]: Observer: distance is -1 mm"],
    ),
    ({"media": {"air": {"index": 1.2}}}, ["media.air: 'air' is built in; choose another name"]),
    (
        {"finishes": {"w": {"kind": "lambertian", "reflectance": 1.5}}},
        ["finishes.w.reflectance: is 1.5; it must be at most 1"],
    ),
    (
        {"detectors": [{"kind": "intensity", "name": "a"}, {"kind": "intensity", "name": "a"}]},
        ["detectors[1].name: 'a' is the name of detectors[0] already"],
    ),
]


def test_a_value_that_is_none_of_a_few_is_told_once_with_all_others() -> None:
    """Also where it is a whole number that Python does not spell out."""
    lamp = {"kind": "surface", "name": "led", "side": "frnt", "shape": {"kind": "disk", "radius": -1}, "flux": 1}
    mesh = {"kind": "mesh", "file": "a.stl", "unit": 10**5000}
    with pytest.raises(SceneError) as caught:
        Scene(sources=[lamp], solids=[{"shape": mesh, "medium": 3}])
    assert caught.value.mistakes == (
        ('sources[0] "led": side', "is 'frnt'. Did you mean 'front'? Known: front, back."),
        ('sources[0] "led": shape.radius', "is -1; it must be greater than 0"),
        ("solids[0].shape.unit", "is a whole number of thousands of digits. Known: nm, um, mm, cm, m, inch, feet."),
        ("solids[0].medium", "is 3: input should be a valid string"),
    )


@pytest.mark.parametrize(("keys", "expected"), MISTAKES, ids=[e[0][:50] for _, e in MISTAKES])
def test_mistakes_are_told_with_their_place(keys: dict[str, Any], expected: list[str]) -> None:
    """From a file and from keywords alike; all of them at once."""
    for make in (lambda: Scene.from_dict(keys, source="luminaire.toml"), lambda: Scene(**keys)):
        with pytest.raises(SceneError) as caught:
            make()
        assert len(caught.value.mistakes) == len(expected)
        for text in expected:
            assert text in str(caught.value)
    with pytest.raises(SceneError, match=r"^luminaire\.toml: "):
        Scene.from_dict(keys, source="luminaire.toml")


COMPILED: list[tuple[dict[str, Any], list[str]]] = [
    (
        {"solids": [{"name": "lens", "shape": {"kind": "ball", "radius": 1}, "medium": "pmma"}]},
        ["solids[0] \"lens\": medium: unknown medium 'pmma'. Did you mean 'PMMA'?"],
    ),
    (
        {"solids": [{"name": "lens", "shape": {"kind": "ball", "radius": 1}}]},
        ['solids[0] "lens": medium: is missing; light enters this solid'],
    ),
    (
        {"surfaces": [{"shape": {"kind": "disk", "radius": 1}, "finish": "miror"}]},
        ["surfaces[0].finish: unknown finish 'miror'. Did you mean 'mirror'?"],
    ),
    (
        {
            "solids": [
                {"shape": {"kind": "rod", "radius": 1, "height": 1}, "medium": "PC", "finishes": {"sid": "mirror"}}
            ]
        },
        ["solids[0].finishes.sid: a rod has no such face. Did you mean 'side'? Known: side, bottom, top."],
    ),
    ({"sources": [{"kind": "rays", "file": "no.ray"}]}, ["sources[0]: there is no file "]),
    ({"sources": [{"kind": "light-field", "file": "no.h5"}]}, ["sources[0]"]),
    ({"surroundings": "aether"}, ["surroundings: unknown medium 'aether'"]),
    (
        {
            "sources": [
                {"kind": "point", "name": "a", "flux": 1},
                {"kind": "point", "name": "b", "flux": 1, "flux_unit": "W"},
            ]
        },
        ["sources: 'a' is in lm and 'b' is in W; give all of them in one unit"],
    ),
    ({"detectors": [{"kind": "image", "observer": "me"}]}, ["detectors[0]: unknown observer 'me'"]),
    (
        {
            "finishes": {"w": {"kind": "lambertian", "reflectance": 0.6, "transmittance": 0.5}},
            "surfaces": [{"shape": {"kind": "disk", "radius": 1}, "finish": "w"}],
        },
        ["finishes.w: the shares add up to 1.1"],
    ),
]


@pytest.mark.parametrize(("keys", "expected"), COMPILED, ids=[e[0][:40] for _, e in COMPILED])
def test_mistakes_of_names_and_files(keys: dict[str, Any], expected: list[str]) -> None:
    """What only shows when everything is put together."""
    with pytest.raises(SceneError) as caught:
        compile_scene(Scene.from_dict(keys))
    assert len(caught.value.mistakes) == len(expected)
    for text in expected:
        assert text in str(caught.value)


def test_a_missing_file_of_a_finish_is_one_mistake_at_each_place(tmp_path: Path) -> None:
    """Two surfaces that name it themselves, a solid by a name of the scene: each place once, with the nearest file."""
    et.write_bsdf(tmp_path / "pet.h5", et.bsdf.Lambertian(reflectance=0.5))
    missing = {"kind": "bsdf", "file": str(tmp_path / "pett.h5")}
    disk = {"kind": "disk", "radius": 1}
    keys = {
        "finishes": {"film": missing},
        "surfaces": [{"name": "wall", "shape": disk, "finish": missing}, {"shape": disk, "finish": missing}],
        "solids": [{"shape": {"kind": "ball", "radius": 1}, "medium": "PC", "finish": "film"}],
    }
    with pytest.raises(SceneError) as caught:
        compile_scene(Scene.from_dict(keys))
    told = f"there is no file {tmp_path / 'pett.h5'}. Did you mean 'pet.h5'?"
    places = ["finishes.film", 'surfaces[0] "wall": finish', "surfaces[1].finish"]
    assert sorted(caught.value.mistakes) == [(place, told) for place in places]


def test_all_mistakes_of_a_scene_are_told_at_once() -> None:
    keys = {key: value for mistake, _ in COMPILED for key, value in mistake.items() if key != "sources"}
    with pytest.raises(SceneError, match="mistakes\n"):
        compile_scene(Scene.from_dict(keys))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"name = ", "no TOML: "),
        (b"\xff\xfe", "byte 0: no UTF-8"),
        (b"x = " + b"[" * 100_000, "brackets within brackets"),
        (b'name = "a"\nname = "b"', "no TOML: "),
    ],
)
def test_files_that_are_no_scenes(tmp_path: Path, text: bytes, words: str) -> None:
    (tmp_path / "bad.toml").write_bytes(text)
    with pytest.raises(SceneError, match=r"bad\.toml") as caught:
        Scene.load(tmp_path / "bad.toml")
    assert words in str(caught.value)


def test_a_scene_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        Scene.load(tmp_path / "nothing.toml")


def test_paths_count_from_the_file_of_the_scene(tmp_path: Path) -> None:
    """Saved elsewhere, a scene finds the same files."""
    et.write_rays(tmp_path / "led.tm25ray", et.RaySet([[0, 0, 0]] * 3, [[0, 0, 1]] * 3, [1.0, 2.0, 3.0]))
    scene = Scene.from_dict({"sources": [{"kind": "rays", "file": "led.tm25ray"}]}, folder=tmp_path)
    (tmp_path / "below").mkdir()
    scene.save(tmp_path / "below" / "scene.toml")
    text = (tmp_path / "below" / "scene.toml").read_text(encoding="utf-8")
    assert 'file = "../led.tm25ray"' in text
    again = Scene.load(tmp_path / "below" / "scene.toml")
    assert compile_scene(again).record["sources"][0]["flux"] == pytest.approx(6.0)


def test_what_lives_in_memory_cannot_be_saved(tmp_path: Path) -> None:
    rays = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0])
    scene = Scene(sources=[et.scene.sources.Rays(rays=rays)])
    assert compile_scene(scene).record["sources"][0]["scale"] == 1.0
    with pytest.raises(SceneError, match="rays: lives in memory"):
        scene.save(tmp_path / "scene.toml")
    assert not (tmp_path / "scene.toml").exists()


def test_thousands_of_mistakes_are_told_in_part() -> None:
    balls = [{"name": f"b{i}", "shape": {"kind": "ball", "radius": -1}} for i in range(2000)]
    with pytest.raises(et.SceneError) as caught:
        et.Scene(solids=balls)
    assert len(caught.value.mistakes) == 2000
    lines = str(caught.value).splitlines()
    assert lines[0] == "Scene: 2,000 mistakes"
    assert lines[1].startswith('  solids[0] "b0": shape.radius')
    assert len(lines) == 52
    assert lines[-1] == "  and 1,950 more"


def test_mistakes_that_show_when_a_scene_is_compiled_name_its_file(tmp_path: Path) -> None:
    """Also of scenes that are the same as one that was read, with other values; equal scenes stay equal."""
    path = tmp_path / "hall.toml"
    path.write_text('name = "hall"\n[[detectors]]\nkind = "image"\nobserver = "eye"\n', encoding="utf-8")
    scene = Scene.load(path)
    for one in (scene, scene.replace(name="other"), copy.deepcopy(scene)):
        with pytest.raises(SceneError, match=r"hall\.toml: detectors\[0\]: unknown observer 'eye'\. There is none\."):
            compile_scene(one)
    with pytest.raises(ArgumentError, match=r"hall\.toml: there is no source"):
        et.trace(scene.replace(detectors=[]), rays=100)
    alike = Scene.from_dict(scene.to_dict(), folder=tmp_path)
    assert scene == alike
    with pytest.raises(SceneError, match=r"^hall: detectors"):
        compile_scene(alike)


def test_a_wrong_value_in_a_row_is_one_mistake() -> None:
    """The row is not called too short because of it; an empty one is."""
    point = {"kind": "point", "flux": 1}
    with pytest.raises(SceneError) as told:
        Scene(sources=[point | {"spectrum": [[450, -1], [500, 2]]}])
    assert told.value.mistakes == (("sources[0].spectrum[0][1]", "is -1; it must be at least 0"),)
    with pytest.raises(SceneError, match="spectrum: has 0 values; it must have 1 at least"):
        Scene(sources=[point | {"spectrum": []}])
    with pytest.raises(SceneError, match="vertices: has 2 values; it must have 3 at least"):
        Scene(surfaces=[{"shape": {"kind": "polygon", "vertices": [[0, 0], [1, 0]]}, "finish": "mirror"}])


def test_what_was_not_stated_is_not_stated_after_a_change() -> None:
    """Folders of patches refuse pixels, and mixtures axes of parts, that are stated; a wavelength that is taken is told."""
    source = Scene(sources=[{"kind": "gridded", "file": "patches"}]).sources[0].replace(flux=3)
    assert source.model_fields_set == {"kind", "file", "flux"}
    assert source == type(source)(file="patches", flux=3)
    part = Gaussian(peak=0.5, sigma=0.2).replace(peak=0.4)
    assert Mixture(parts=[part]).parts == (Gaussian(peak=0.4, sigma=0.2),)
    lamp = {"kind": "point", "flux": 1, "flux_unit": "W"}
    notes = compile_scene(Scene(sources=[lamp]).replace(name="again")).notes
    assert ["555 nm is taken" in note for note in notes] == [True]


def test_more_solids_than_a_scene_may_have_are_one_mistake() -> None:
    (ball,) = Scene(solids=[{"shape": {"kind": "ball", "radius": 1.0}, "medium": "BK7"}]).solids
    many = Scene(solids=[ball] * (_core.most_solids() + 1))
    with pytest.raises(
        SceneError, match=r"solids: there are 65,535 of them, and 65,534 are the most; join those of one"
    ):
        compile_scene(many)
