"""Numbers of a scene by their paths, and values as the command line spells them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import etendue as et
import pytest
from etendue.sweeps.parameter import Parameter, parse_setting

LENS: dict[str, Any] = {
    "name": "lens",
    "medium": "glass",
    "at": [0, 0, 7],
    "spin": 3,
    "shape": {"kind": "lens", "radius": 3, "thickness": 2, "front": {"radius_of_curvature": 15}},
    "finishes": {"edge": {"kind": "lambertian", "reflectance": 0.3}},
}
FILM = {"kind": "prismatic-film", "width": 4, "height": 4, "thickness": 1, "pitch": 1, "apex_angle": 90}
SCENE = et.Scene(
    wavelength=500,
    media={
        "glass": {"index": 1.5, "absorption": 0.1},
        "smoke": {
            "sellmeier": {"b": [1.0], "c": [0.01]},
            "absorption": {"wavelength": [400, 600], "values": [0.1, 0.2]},
        },
    },
    finishes={
        "wall": {"kind": "lambertian", "reflectance": 0.5},
        "foil": {
            "kind": "mirror",
            "reflectance": {"angle": [0, 60], "wavelength": [400, 600], "values": [[0.1, 0.2], [0.3, 0.4]]},
        },
        "lobe": {"kind": "gaussian", "peak": 2, "sigma": 0.1},
    },
    sources=[
        {"name": "die", "kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 3},
        {"kind": "point", "flux": 4},
        {"name": "white", "kind": "point", "flux": 2, "spectrum": [[450, 1], [600, 2]]},
    ],
    solids=[LENS, {"name": "film", "shape": FILM, "medium": "PMMA"}],
    surfaces=[
        {"name": "a.b", "shape": {"kind": "disk", "radius": 9}, "finish": "wall"},
        {
            "name": "bowl",
            "shape": {"kind": "asphere", "radius_of_curvature": 20, "coefficients": [1e-5, 1e-7], "radius": 5},
            "trim": {"z": [0, 2], "radius": [1, 4]},
            "finish": "foil",
        },
        {
            "name": "kite",
            "shape": {
                "kind": "mesh",
                "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
                "triangles": [[0, 1, 2]],
                "scale": 2,
            },
            "finish": "lobe",
        },
    ],
    detectors=[{"name": "die", "kind": "illuminance", "width": 1, "height": 1, "columns": 4, "rows": 2}],
    observers=[{"name": "eye", "distance": 100, "screen": {"width": 3, "height": 2, "columns": 4, "rows": 4}}],
)


@pytest.mark.parametrize(
    ("path", "value", "unit", "read"),
    [
        ("lens.at.2", 9.5, "mm", lambda s: s.solids[0].at[2]),
        ("solids.lens.at.2", 9.5, "mm", lambda s: s.solids[0].at[2]),
        ("solids[0].at[2]", 9.5, "mm", lambda s: s.solids[0].at[2]),
        ("lens.spin", 12, "°", lambda s: s.solids[0].spin),
        ("lens.shape.radius", 2, "mm", lambda s: s.solids[0].shape.radius),
        ("lens.shape.front.radius_of_curvature", 20, "mm", lambda s: s.solids[0].shape.front.radius_of_curvature),
        ("lens.shape.front.conic", -0.4, "", lambda s: s.solids[0].shape.front.conic),
        ("lens.finishes.edge.reflectance", 0.9, "", lambda s: s.solids[0].finishes["edge"].to_dict()["reflectance"]),
        ("sources.die.flux", 7, "W", lambda s: s.sources[0].flux),
        ("sources.1.flux", 8, "W", lambda s: s.sources[1].flux),
        ("sources.die.wavelength", 450, "nm", lambda s: s.sources[0].wavelength),
        ("white.spectrum.1.0", 610, "nm", lambda s: s.sources[2].spectrum[1][0]),
        ("white.spectrum.1.1", 3, "", lambda s: s.sources[2].spectrum[1][1]),
        ("film.shape.apex_angle", 100, "°", lambda s: s.solids[1].shape.apex_angle),
        ("eye.screen.width", 5, "mm", lambda s: s.observers[0].screen.width),
        ("detectors.die.columns", 5, "", lambda s: s.detectors[0].columns),
        ("glass.index", 1.6, "", lambda s: s.media["glass"].index),
        ("finishes.wall.reflectance", 0.7, "", lambda s: s.finishes["wall"].to_dict()["reflectance"]),
        ("a.b.shape.radius", 4, "mm", lambda s: s.surfaces[0].shape.radius),
        ("wavelength", 600, "nm", lambda s: s.wavelength),
        ("glass.absorption", 0.2, "1/mm", lambda s: s.media["glass"].absorption),
        ("smoke.absorption.values.1", 0.3, "1/mm", lambda s: s.media["smoke"].absorption.values[1]),
        ("smoke.absorption.wavelength.0", 410, "nm", lambda s: s.media["smoke"].absorption.wavelength[0]),
        ("smoke.sellmeier.c.0", 0.02, "µm²", lambda s: s.media["smoke"].sellmeier.c[0]),
        ("smoke.sellmeier.b.0", 1.1, "", lambda s: s.media["smoke"].sellmeier.b[0]),
        (
            "foil.reflectance.values.1.0",
            0.35,
            "",
            lambda s: s.finishes["foil"].to_dict()["reflectance"]["values"][1][0],
        ),
        ("foil.reflectance.angle.1", 50, "°", lambda s: s.finishes["foil"].to_dict()["reflectance"]["angle"][1]),
        ("lobe.peak", 3, "1/sr", lambda s: s.finishes["lobe"].peak),
        ("lobe.sigma", 0.2, "", lambda s: s.finishes["lobe"].sigma),
        ("bowl.shape.coefficients.1", 2e-7, "1/mm⁵", lambda s: s.surfaces[1].shape.coefficients[1]),
        ("bowl.trim.z.1", 3, "mm", lambda s: s.surfaces[1].trim.z[1]),
        ("bowl.trim.radius.0", 0.5, "mm", lambda s: s.surfaces[1].trim.radius[0]),
        ("kite.shape.scale", 3, "", lambda s: s.surfaces[2].shape.scale),
        ("eye.distance", 120, "mm", lambda s: s.observers[0].distance),
    ],
)
def test_a_number_is_found_and_changed_alone(path: str, value: float, unit: str, read: Any) -> None:
    place = Parameter.find(SCENE, path, "W")
    changed = place.changed(SCENE, float(value))
    assert read(changed) == value
    assert place.unit == unit
    before, after = (dict(numbers(scene.to_dict())) for scene in (SCENE, changed))
    assert sum(before.get(key) != after.get(key) for key in {**before, **after}) == 1


def numbers(value: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Everything in a description, by its place."""
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if parts is None:
        yield place, value
        return
    for key, held in parts:
        yield from numbers(held, f"{place}.{key}")


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("lense.at.2", "Did you mean 'lens'"),
        ("solids.lenz.at.2", "unknown part among the solids 'lenz'. Did you mean 'lens'"),
        ("solids.3.at.2", "Known: 0, 1, film, lens"),
        ("die.flux", "2 parts of the scene are called 'die'; write sources.die.flux or detectors.die.flux"),
        ("lens.at", "is a row of 3 values; name one, numbered from 0, e.g. lens.at.0"),
        ("lens.at.3", "they are numbered from 0 to 2"),
        ("lens.at.z", "they are numbered from 0 to 2"),
        ("lens.toward.1", "lens.toward is not stated in the scene"),
        ("lens.medium", "is the name 'glass'; a sweep goes over numbers"),
        ("lens.shape", "name one of its keys: lens.shape.radius"),
        ("lens.shape.radius.x", "is a number and has no parts"),
        ("lens.thickness", "write lens.shape.thickness"),
        ("lens.shape.front.conik", "Did you mean 'conic'"),
        ("media.glas.index", "Did you mean 'glass'"),
        ("lens", "is no number"),
        ("", "unknown part of the scene"),
    ],
)
def test_what_is_no_number_is_told(path: str, message: str) -> None:
    with pytest.raises(et.EtendueError) as caught:
        Parameter.find(SCENE, path)
    assert message in str(caught.value)


def test_a_value_that_a_scene_refuses_is_told_with_its_place() -> None:
    with pytest.raises(et.SceneError, match=r"glass.index = -1: media.glass.index: is -1"):
        Parameter.find(SCENE, "glass.index").changed(SCENE, -1.0)
    with pytest.raises(
        et.SceneError, match=r'detectors.die.columns = 2.5: detectors\[0\] "die": columns: .* whole number'
    ):
        Parameter.find(SCENE, "detectors.die.columns").changed(SCENE, 2.5)


def test_files_still_count_from_the_folder_of_the_scene(tmp_path: Path) -> None:
    scene = et.Scene.from_dict({"sources": [{"name": "led", "kind": "rays", "file": "led.ray"}]}, folder=tmp_path)
    changed = Parameter.find(scene, "led.at.0").changed(scene, 2)
    assert changed.read_files() == (tmp_path / "led.ray",)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a=0:9:3", (0, 3, 6, 9)),
        ("a=0:10:3", (0, 3, 6, 9)),
        ("a=5:9:0.5", (5, 5.5, 6, 6.5, 7, 7.5, 8, 8.5, 9)),
        ("a=0:0.3:0.1", (0, 0.1, 0.2, 0.3)),
        ("a=3:1:-1", (3, 2, 1)),
        ("a=2:2:1", (2,)),
        ("a=5,6,7.5", (5, 6, 7.5)),
        ("a = -1e3", (-1000,)),
    ],
)
def test_ranges_and_lists(text: str, values: tuple[float, ...]) -> None:
    assert parse_setting(text) == ("a", values)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a", "sets nothing"),
        ("a=", "sets nothing"),
        ("=1", "sets nothing"),
        ("a=1:2", "three numbers"),
        ("a=1:2:3:4", "three numbers"),
        ("a=1,two", "are no numbers"),
        ("a=1:inf:1", "are no numbers"),
        ("a=1:2:0", "the step is 0; give one that leads from 1 to 2"),
        ("a=1:2:-0.1", "lead away from 2; give 0.1"),
        ("a=0:10000:1", "more than 10,000 values"),
        ("a=0:1:1e-300", "more than 10,000 values"),
    ],
)
def test_ranges_that_are_none(text: str, message: str) -> None:
    with pytest.raises(et.ArgumentError) as caught:
        parse_setting(text)
    assert message in str(caught.value)
