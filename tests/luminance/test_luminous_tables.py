"""Flat luminous surfaces with an intensity distribution, L = I(γ, C)/(A cos γ); verdicts at 1e-4."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import SceneError
from etendue.scene import compile_scene
from oracles.both_ways import forwards_and_backwards_agree
from scipy.stats import chi2

Array = npt.NDArray[np.float64]

LOPSIDED = et.Intensity(
    c=[0, 60, 150, 280],
    gamma=[0, 20, 45, 70, 90],
    values=[
        [20.0, 60.0, 35.0, 8.0, 0.0],
        [20.0, 25.0, 50.0, 12.0, 3.0],
        [20.0, 9.0, 4.0, 1.0, 0.0],
        [20.0, 30.0, 10.0, 30.0, 1.0],
    ],
)
"""No two half planes alike, with light at 90°."""

RECTANGLE = {"kind": "rectangle", "width": 4, "height": 2.5}
AREA = 10.0


def lamp(**keys: Any) -> dict[str, Any]:
    return {"kind": "surface", "shape": RECTANGLE, "intensity": LOPSIDED, **keys}


def notes_of(**keys: Any) -> tuple[str, ...]:
    return compile_scene(et.Scene(sources=[lamp(**keys)])).notes


@pytest.mark.parametrize("side", ["front", "back"])
def test_the_luminance_is_that_of_the_closed_form(side: str) -> None:
    """From so far away that all lines of sight are parallel, in a frame that is turned; C runs towards −y on the back."""
    place = {"at": [0.3, -0.2, 1.0], "rotation": [25, -40, 70]}
    scene = et.Scene(sources=[lamp(side=side, **place)])
    axes = np.array(compile_scene(scene).record["sources"][0]["frame"][3:]).reshape(3, 3)
    seen = 0
    for theta, phi in ((0, 0), (35, 20), (60, 140), (75, 250), (110, 300), (140, 80), (180, 0), (90, 190)):
        observer = et.Observer(theta, phi, 1e8, target=(0.3, -0.2, 1.0))
        lmap = et.luminance_map(scene, observer, et.Screen(1e-3, 1e-3, 1, 1), rays_per_pixel=4, seed=1)
        towards = observer.position - np.array([0.3, -0.2, 1.0])
        x, y, z = axes @ (towards / np.linalg.norm(towards))
        if side == "back":
            y, z = -y, -z
        c, gamma = math.degrees(math.atan2(y, x)) % 360.0, math.degrees(math.acos(z))
        expected = LOPSIDED.at(c, gamma) / (AREA * z) * 1e6 if z > 0.0 else 0.0
        assert lmap.values[0, 0] == pytest.approx(expected, rel=1e-6)
        seen += expected > 0.0
    assert seen >= 3


def test_on_the_axis_the_luminance_is_intensity_over_area(tmp_path: Path) -> None:
    """Also from a file, whose flux may be overridden, which is told."""
    et.write_intensity(tmp_path / "lamp.ies", LOPSIDED, format="lm63")
    by_file = {"kind": "surface", "shape": {"kind": "disk", "radius": 2}, "file": "lamp.ies"}
    for keys, factor in (({}, 1.0), ({"flux": 2 * LOPSIDED.flux}, 2.0)):
        scene = et.Scene.from_dict({"sources": [{**by_file, **keys}]}, folder=tmp_path)
        lmap = et.luminance_map(scene, et.Observer(0, 0, 1e8), et.Screen(1e-3, 1e-3, 1, 1), rays_per_pixel=4, seed=1)
        # The file has the digits of IES files.
        assert lmap.values[0, 0] == pytest.approx(factor * 20.0 / (4e-6 * math.pi), rel=1e-3)
        told = [note for note in compile_scene(scene).notes if "multiplied by" in note]
        assert len(told) == (factor != 1.0)


def _directions(rays: Array, table: et.Intensity) -> float:
    """χ² of directions over 12 × 6 bins of equal widths in C and cos γ, against the midpoint rule."""
    planes, rows, fine = 12, 6, 40
    place = np.degrees(np.arctan2(rays[:, 1], rays[:, 0])) % 360.0
    counts, _, _ = np.histogram2d(place, rays[:, 2], (planes, rows), ((0, 360), (0, 1)))
    c = (np.arange(planes * fine) + 0.5) * (360.0 / (planes * fine))
    cosine = (np.arange(rows * fine) + 0.5) / (rows * fine)
    values = np.array([table.at(each, np.degrees(np.arccos(cosine))) for each in c])
    share = values.reshape(planes, fine, rows, fine).sum(axis=(1, 3)) / values.sum()
    expected = share * len(rays)
    return float(((counts - expected) ** 2 / expected).sum())


@pytest.mark.slow
@pytest.mark.parametrize("side", ["front", "back"])
def test_the_far_field_is_the_table(side: str) -> None:
    """Rays forwards, on a plane above the surface: their directions, and their places evenly over it."""
    up = 1.0 if side == "front" else -1.0
    collector = {"kind": "rays", "name": "all", "shape": {"kind": "plane"}, "at": [0, 0, 1e-3 * up]}
    result = et.trace(et.Scene(sources=[lamp(side=side)], detectors=[collector]), rays=200_000, seed=3)
    rays = result.rays["all"]
    assert rays.total_flux == pytest.approx(LOPSIDED.flux, rel=1e-9)
    turned = rays.direction * np.array([1.0, up, up])
    bound = chi2.ppf(1 - 1e-4, 12 * 6 - 1)
    assert _directions(turned, LOPSIDED) < bound
    # The other handedness is told apart.
    assert _directions(turned * np.array([1.0, -1.0, 1.0]), LOPSIDED) > 10 * bound
    start = rays.position - rays.direction * ((rays.position[:, 2]) / rays.direction[:, 2])[:, None]
    places, _, _ = np.histogram2d(start[:, 0], start[:, 1], (8, 5), ((-2, 2), (-1.25, 1.25)))
    expected = len(rays) / places.size
    assert ((places - expected) ** 2 / expected).sum() < chi2.ppf(1 - 1e-4, places.size - 1)


FRONT, BACK = {"radius_of_curvature": 9}, {"radius_of_curvature": -9}
PAPER = {
    "shape": {"kind": "rectangle", "width": 30, "height": 30},
    "finish": {"kind": "lambertian", "reflectance": 0.7},
}


def test_a_lit_paper_is_the_same_both_ways() -> None:
    """Connections and lines of sight by chance against rays forwards."""
    forwards_and_backwards_agree(surfaces=[PAPER], lamp=lamp(spin=30), rays=300_000)


def test_light_behind_a_lens_is_the_same_both_ways() -> None:
    """A lens below paper throws the light of a lopsided lamp on it: lines of sight meet the lamp through paper and lens."""
    lens = {
        "shape": {"kind": "lens", "radius": 4, "thickness": 3, "front": FRONT, "back": BACK},
        "at": [3.1, 1.7, -6],
        "toward": [-0.3, -0.1, 1],
        "medium": "BK7",
    }
    screen = {**PAPER, "finish": {"kind": "lambertian", "reflectance": 0.1, "transmittance": 0.6}}
    forwards_and_backwards_agree(surfaces=[screen], solids=[lens], lamp=lamp(spin=30), below=True, sharp=0.2)


def test_light_behind_the_surface_is_left_out_and_told() -> None:
    """A downlight's few per cent upwards: the rest keeps its candelas."""
    both = et.Intensity(c=[0, 120, 240], gamma=[0, 60, 120, 180], values=[[9.0, 6, 2, 0], [5, 4, 1, 1], [5, 8, 2, 1]])
    (record,) = compile_scene(et.Scene(sources=[lamp(intensity=both)])).record["sources"]
    gamma = (np.arange(200_000) + 0.5) * (math.pi / 2 / 200_000)
    mean = both.at(0, np.degrees(gamma)) + both.at(120, np.degrees(gamma)) + both.at(240, np.degrees(gamma))
    front = float((mean / 3 * np.sin(gamma)).sum() * (math.pi / 2 / 200_000) * 2 * math.pi)
    assert record["flux"] == pytest.approx(front, rel=1e-8)
    (note,) = notes_of(intensity=both)
    assert f"{1 - front / both.flux:.3%}" in note
    assert notes_of() == ()


def test_what_cannot_be() -> None:
    behind = et.Intensity(c=[0], gamma=[90, 100, 180], values=[[0.0, 3, 1]])
    for keys, words in (
        ({"shape": {"kind": "sphere", "radius": 1}}, "a sphere is not flat"),
        ({"exponent": 2}, "'exponent' and an intensity distribution are both given"),
        ({"file": "a.ies"}, "'file' and 'intensity' are both given"),
        ({"flux": 3, "flux_unit": "W"}, "'flux_unit' is the file's own"),
        ({"photometry": "x"}, "'photometry' names one"),
        ({"intensity": behind}, "goes beyond γ = 90°"),
        ({"intensity": None}, "'flux' is missing"),
    ):
        with pytest.raises(SceneError, match=words):
            compile_scene(et.Scene(sources=[lamp(**keys)]))
