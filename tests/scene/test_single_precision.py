"""Bodies of files in single precision touch those that are exact; of bodies that do not, the film between them is told."""

from __future__ import annotations

import itertools
import struct
import warnings
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import SceneWarning
from etendue.scene import Scene, compile_scene
from etendue.scene.triangles import as_written
from oracles.meshes import divided_sphere
from oracles.verdicts import assert_drawn_with

CUBE = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])
TURN = {"axis": (1, 2, 3), "angle": 29.0}


def stl(corners: np.ndarray[Any, Any], triangles: np.ndarray[Any, Any]) -> bytes:
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[t].ravel(), 0) for t in triangles)
    return b"".ljust(80) + struct.pack("<I", len(triangles)) + rows


def plate(z: float, thickness: float) -> np.ndarray[Any, Any]:
    """Corners of a plate of 10 mm by 10 mm on the height z."""
    return np.array([-5.0, -5.0, z]) + CUBE * [10.0, 10.0, thickness]


def told(*solids: dict[str, Any], folder: Path = Path()) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        compile_scene(Scene.from_dict({"solids": list(solids)}, folder=folder))
    assert all(warning.category is SceneWarning for warning in caught)
    return [str(warning.message) for warning in caught]


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e4])
def test_numbers_of_single_precision_are_those_that_were_written(scale: float) -> None:
    """Up to six digits come back from single precision to the last bit, whatever their size."""
    digits = zip(np.random.default_rng(2).uniform(-10, 10, 600), [1, 3, 6] * 200, strict=True)
    meant = np.array([float(f"{x * scale:.{n}g}") for x, n in digits])
    stored = meant.astype(np.float32).astype(np.float64)
    assert (stored != meant).mean() > 0.25
    assert np.abs(as_written(stored) / meant - 1.0).max() < 3e-16
    # What single precision does not hold, or seven digits do not tell, stays.
    others = np.array([*meant[stored != meant], 0.0, np.inf, -np.inf, 1e300, 1e-300, 2.0**-24, 1.0 + 2.0**-23])
    assert (as_written(others) == others).all()


def test_a_body_of_single_precision_touches_the_exact_one_below(tmp_path: Path) -> None:
    """Two plates of one index on each other: of a beam along the normal (1 - R)/(1 + R) passes, R = (n - 1)²/(n + 1)².

    Single precision holds 3.7 mm, where they touch, as 3.70000005 mm; a film of air would let (1 - R)/(1 + 3 R) pass.
    """
    (tmp_path / "plate.stl").write_bytes(stl(plate(3.7, 1.6), TRIANGLES))
    rays, reflected = 20_000, 1.0 / 9.0
    scene = Scene.from_dict(
        {
            "sources": [{"kind": "beam", "shape": {"kind": "disk", "radius": 2}, "flux": rays, "at": [0.3, 0.1, -1]}],
            "solids": [
                {"shape": {"kind": "block", "width": 10, "height": 10, "depth": 3.7}, "medium": {"index": 2}},
                {"shape": {"kind": "mesh", "file": "plate.stl"}, "medium": {"index": 2}},
            ],
            "detectors": [{"kind": "rays", "name": "behind", "shape": {"kind": "disk", "radius": 4}, "at": [0, 0, 8]}],
        },
        folder=tmp_path,
    )
    passed = et.trace(scene, rays=rays, seed=1).rays["behind"].total_flux
    assert_drawn_with(share=(1.0 - reflected) / (1.0 + reflected), hits=passed, rays=rays)


@pytest.mark.parametrize("gap", [0.0, 1e-9, 3e-8, 2e-6, 1e-4])
def test_a_film_that_nobody_makes_is_told(gap: float) -> None:
    """Of two plates the thickness between them, along some line; what may have been meant, or is none, is not told."""
    below = {"name": "below", "shape": {"kind": "block", "width": 9, "height": 8, "depth": 3.1}, "medium": "PMMA"}
    shape = {"kind": "mesh", "vertices": plate(3.1 + gap, 2.0).tolist(), "triangles": TRIANGLES.tolist()}
    texts = told({**below, **TURN}, {"name": "above", "shape": shape, "medium": "BK7", **TURN})
    if gap in (0.0, 1e-4):
        assert texts == []
        return
    (text,) = texts
    words, _, rest = text.partition(" mm thick, as at ")
    assert words.startswith('"below" and "above" touch but for a film ')
    # The median of lines in all directions, 1/cos 60° times as long as that along the normal.
    assert float(words.rpartition(" ")[2]) == pytest.approx(2.0 * gap, rel=0.5)
    assert (
        'let "above", which is listed later, reach a little into "below": that they overlap then does no harm' in rest
    )
    dark = {"finish": "absorber", **TURN}
    assert told({**below, **dark}, {"name": "above", "shape": shape, **dark}) == []


def test_rounded_numbers_of_an_inclined_face_leave_a_film(tmp_path: Path) -> None:
    """Corners in single precision of two plates that were turned before they were stored, and are of unlike size."""
    turn = np.array(
        Scene(solids=[{"shape": {"kind": "ball", "radius": 1}, "medium": "BK7", **TURN}]).solids[0].frame().axes
    )
    for name, corners in (("below", plate(0.0, 3.1)), ("above", plate(3.1, 2.0) * [0.3, 0.6, 1.0])):
        (tmp_path / f"{name}.stl").write_bytes(stl(corners @ turn.T, TRIANGLES))
    solids = [{"name": n, "shape": {"kind": "mesh", "file": f"{n}.stl"}, "medium": "BK7"} for n in ("below", "above")]
    (text,) = told(*solids, folder=tmp_path)
    assert '"below" and "above" touch but for a film' in text


@pytest.mark.slow
def test_films_between_unlike_triangles_of_one_sphere_are_told() -> None:
    """A ball in a cavity of its size. The corners of coarse triangles are those of finer ones, which lie further out.

    So a coarser ball leaves a film as thick as its triangles are off; a finer one has none, and one that is turned some.
    """
    vertices, triangles = divided_sphere(4)
    off = 1.0 - np.linalg.norm(vertices[triangles].mean(axis=1), axis=1).min()
    block = {
        "kind": "mesh",
        "vertices": [*((CUBE - 0.5) * 3).tolist(), *divided_sphere(5)[0].tolist()],
        "triangles": [*TRIANGLES.tolist(), *(divided_sphere(5)[1][:, ::-1] + len(CUBE)).tolist()],
        "crease_angle": 30,
    }

    def with_ball(times: int, radius: float = 1.0, **place: Any) -> list[str]:
        vertices, triangles = divided_sphere(times)
        corners = (radius * vertices).tolist()
        ball = {"kind": "mesh", "vertices": corners, "triangles": triangles.tolist(), "crease_angle": 180}
        return told(
            {"name": "block", "shape": block, "medium": "PMMA"},
            {"name": "ball", "shape": ball, "medium": "BK7", **place},
        )

    assert with_ball(5) == []
    (coarse,) = with_ball(4)
    assert '"block" and "ball" do not touch everywhere: a film of some ' in coarse
    assert 0.3 * off < float(coarse.partition("a film of some ")[2].partition(" mm")[0]) < 3.0 * off
    (fine,) = with_ball(6)
    assert '"block" and "ball" overlap' in fine
    assert "film" not in fine
    (turned,) = with_ball(5, rotation=[20, 30, 40])
    assert '"block" and "ball" overlap' in turned
    assert "; elsewhere a film of some " in turned
    # A gap that is as wide everywhere was left on purpose.
    assert with_ball(5, 0.995) == []
