"""Solids that bite into each other and light that starts in them are told before a trace; what may be so is not."""

from __future__ import annotations

import itertools
import json
import math
import re
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.cli import app as program
from etendue.errors import SceneWarning
from etendue.scene import compile_scene, overlaps
from oracles.scenes import BODIES, OCTAHEDRON, OCTANTS

POINT = re.compile(r"\((\S+), (\S+), (\S+)\) mm")


def told(**scene: Any) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        notes = compile_scene(et.Scene(**scene)).notes
    texts = [str(warning.message) for warning in caught]
    assert all(warning.category is SceneWarning for warning in caught)
    assert set(texts) <= set(notes)
    return texts


def solid(name: str, kind: str, medium: Any = "BK7", **keys: Any) -> dict[str, Any]:
    place = {key: keys.pop(key) for key in ("at", "rotation", "finish", "finishes") if key in keys}
    return {"name": name, "shape": {"kind": kind, **keys}, "medium": medium, **place}


def ball(name: str, radius: float, at: Any = (0, 0, 0), **more: Any) -> dict[str, Any]:
    return solid(name, "ball", radius=radius, at=at, **more)


def disk(radius: float = 1.0, at: Any = (0, 0, 0), **more: Any) -> dict[str, Any]:
    return {"name": "led", "kind": "surface", "shape": {"kind": "disk", "radius": radius}, "flux": 1, "at": at, **more}


# --- solids ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_two_balls() -> None:
    """They overlap if |r₁ − r₂| < d < r₁ + r₂; the first is hidden if d < r₂ − r₁. To within a hundredth."""
    rng = np.random.default_rng(4)
    verdicts = {"apart": 0, "overlap": 0, "hidden": 0, "within": 0}
    for _ in range(300):
        (r1, r2), d = rng.uniform(0.2, 2.0, 2), rng.uniform(0.0, 3.5)
        if min(abs(d - r1 - r2), abs(d - abs(r1 - r2))) < 0.01 * min(r1, r2):
            continue
        v = rng.normal(size=3)
        first, second = rng.uniform(-9, 9, 3), d * v / np.linalg.norm(v)
        second += first
        texts = told(solids=[ball("one", r1, first), ball("two", r2, second)])
        verdict = "apart" if d > r1 + r2 else "overlap" if d > abs(r1 - r2) else "hidden" if r1 < r2 else "within"
        verdicts[verdict] += 1
        if verdict in ("apart", "within"):
            assert texts == []
            continue
        (text,) = texts
        assert ("overlap" if verdict == "overlap" else '"one" lies in "two"') in text
        assert '"one"' in text
        assert '"two"' in text
        point = np.array([float(x) for x in POINT.search(text).groups()])  # type: ignore[union-attr]
        # Four digits are printed, of lengths up to 12.
        assert np.linalg.norm(point - first) < r1 + 0.01
        assert np.linalg.norm(point - second) < r2 + 0.01
    assert min(verdicts.values()) > 20, verdicts


@pytest.mark.parametrize("depth", [0.02, 0.1, 1.0])
def test_small_overlaps_are_found(depth: float) -> None:
    """A lens that sits a little too deep in a block, a rod that ends in another, a die that sticks out of its dome."""
    lens = solid("lens", "lens", "PMMA", radius=4, thickness=3, front={"radius_of_curvature": 9}, at=[1, 2, 5 - depth])
    block = solid("block", "block", width=30, height=20, depth=5)
    (text,) = told(solids=[block, lens])
    assert '"block" and "lens" overlap' in text
    x, y, z = (float(x) for x in POINT.search(text).groups())  # type: ignore[union-attr]
    assert 5 - depth - 1e-3 <= z <= 5 + 1e-3
    assert math.hypot(x - 1, y - 2) < 4
    rods = [solid("a", "rod", radius=1, height=9), solid("b", "rod", radius=1, height=9, at=[0, 0, 9 - depth])]
    assert '"a" and "b" overlap' in told(solids=rods)[0]
    dome = solid("dome", "dome", "silicone", radius=3)
    die = solid("die", "block", {"index": 2.4}, width=1, height=1, depth=2, at=[0.2, 0, -depth])
    assert '"dome" and "die" overlap' in told(solids=[dome, die])[0]


def test_solids_that_differ_by_a_trifle_touch() -> None:
    """Overlaps of a millionth of the size are roundings."""
    for depth, found in ((1e-8, 0), (1e-4, 1)):
        rods = [solid("a", "rod", radius=1, height=9), solid("b", "rod", radius=1, height=9, at=[0, 0, 9 - depth])]
        assert len(told(solids=rods)) == found


R = 3.0
DOUBLET = {"radius": 5, "thickness": 4, "back": {"radius_of_curvature": -10, "conic": -0.5}}
MAY_BE: dict[str, list[dict[str, Any]]] = {
    "die in a dome": [
        solid("dome", "dome", "silicone", radius=R),
        solid("die", "block", {"index": 2.4}, width=1, height=1, depth=0.2),
    ],
    "lens on a dome": [
        solid("dome", "dome", "silicone", radius=R),
        solid("lens", "lens", radius=2, thickness=2, front={"radius_of_curvature": -R}, at=[0, 0, R]),
    ],
    "cemented doublet": [
        solid("crown", "lens", **DOUBLET, rotation=[12, -40, 7]),
        solid("flint", "lens", "PC", radius=5, thickness=2, front=DOUBLET["back"], rotation=[12, -40, 7],
              at=(4 * et.Scene(solids=[solid("", "ball", radius=1, rotation=[12, -40, 7])]).solids[0].frame().axes[:, 2])),
    ],
    "fibre": [
        solid("cladding", "rod", {"index": 1.45}, radius=0.2, height=80, rotation=[33, 21, -4]),
        solid("core", "rod", {"index": 1.5}, radius=0.1, height=80, rotation=[33, 21, -4]),
    ],
    "two prisms in a cube": [
        solid("one", "prism", vertices=[(0, 0), (7, 0), (0, 7)], height=7),
        solid("two", "prism", "PC", vertices=[(7, 0), (7, 7), (0, 7)], height=7),
    ],
    "film on a plate": [
        solid("plate", "block", width=20, height=10, depth=2),
        solid("film", "prismatic-film", "PC", width=20, height=10, thickness=0.2, pitch=0.5, at=[0, 0, 2]),
    ],
    "die in a die in a block": [
        solid("block", "block", width=20, height=10, depth=2),
        solid("die", "block", "PC", width=2, height=1, depth=2),
        solid("dot", "ball", "water", radius=0.3, at=[0.5, 0.1, 1]),
    ],
    "beside each other, boxes within each other": [
        solid("bowl", "torus", major_radius=5, minor_radius=1),
        ball("ball", 2),
        solid("rod", "rod", radius=0.5, height=9, at=[6, 6, -4], rotation=[0, 20, 45]),
    ],
    "meshes that share an edge": [
        solid("one", "mesh", vertices=OCTAHEDRON, triangles=OCTANTS),
        solid("two", "mesh", vertices=OCTAHEDRON, triangles=OCTANTS, at=[2, 2, 0]),
    ],
}  # fmt: skip


SHIFTS = {
    "die in a die in a block": (0, 0.4, 0),
    "beside each other, boxes within each other": (-2.5, -2.5, 0),
    "meshes that share an edge": (-0.3, -0.3, 0),
}
"""Of the last solid, so that it bites or sticks out; where a little to the side and down does not do."""


@pytest.mark.parametrize("case", MAY_BE)
def test_nested_cemented_and_immersed_solids_are_not_told(case: str) -> None:
    *others, last = MAY_BE[case]
    assert told(solids=[*others, last]) == []
    at = np.array(last.get("at", (0, 0, 0))) + SHIFTS.get(case, (-0.07, -0.03, -0.11))
    assert any("overlap" in text for text in told(solids=[*others, {**last, "at": at}]))


@pytest.mark.parametrize("kind", BODIES)
def test_every_body_in_another(kind: str) -> None:
    """In a ball that holds it, at the rim of the ball, and outside."""
    body = solid("body", kind, "PC", **BODIES[kind][0], rotation=[10, 20, 30])
    assert told(solids=[ball("water", 9, medium="water"), body]) == []
    assert told(solids=[ball("water", 9, [0, 0, 20], medium="water"), body]) == []
    texts = told(solids=[ball("water", 9, [0, 0, -9], medium="water"), body])
    assert len(texts) == 1
    assert '"water" and "body" overlap' in texts[0]
    assert '"body" lies in "water"' in told(solids=[body, ball("water", 9)])[0]


def test_too_many_solids_in_one_place() -> None:
    nest = [ball(f"shell {i}", 6 - i) for i in range(5)]
    assert told(solids=nest[:4]) == []
    (text,) = told(solids=nest)
    assert "at once" in text
    assert all(f'"shell {i}"' in text for i in range(5))


def test_open_solids_are_told_with_a_place() -> None:
    tent = solid("tent", "mesh", vertices=[*OCTAHEDRON], triangles=OCTANTS[1:])
    (text,) = told(solids=[tent, ball("ball", 1)], sources=[disk(0.3, at=[0, 0, -0.5])])
    assert 'solids[0] "tent": ' in text
    assert "open" in text
    assert POINT.search(text)


# --- sources ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [0.3, 1.0, 1.7])
def test_a_source_that_starts_partly_in_a_solid(offset: float) -> None:
    """The share is the area that two disks have in common: r² (2 arccos(c/2r) − (c/2r) √(4 − (c/r)²)), binomial."""
    half = offset / 2
    share = (2 * math.acos(half) - half * math.sqrt(4 - offset**2)) / math.pi
    rod = solid("lens", "rod", radius=1, height=4, at=[offset, 0, -1])
    (text,) = told(solids=[rod], sources=[disk()])
    found, rest = (float(x) / 100 for x in re.findall(r"(\d+)%", text))
    for seen, expected in ((found, share), (rest, 1 - share)):
        assert abs(seen - expected) < 4 * math.sqrt(share * (1 - share) / 256) + 0.005
    assert '"led"' in text
    assert '"lens"' in text
    inside, outside = (np.array([float(x) for x in match]) for match in POINT.findall(text))
    assert np.hypot(inside[0] - offset, inside[1]) <= 1 + 1e-3
    assert np.hypot(outside[0] - offset, outside[1]) >= 1 - 1e-3


def test_a_source_in_a_wall() -> None:
    """No light leaves a solid all faces of which are opaque."""
    for medium, finish in ((None, "absorber"), ("BK7", {"kind": "lambertian", "reflectance": 0.9}), (None, "mirror")):
        wall = solid("wall", "block", medium, width=9, height=9, depth=2, finish=finish)
        (text,) = told(solids=[wall], sources=[disk(at=[0, 0, 0.5])])
        assert text.startswith("100%")
        assert '"led"' in text
        assert '"wall"' in text
        assert "lets light pass" in text
        assert told(solids=[wall], sources=[disk(at=[0, 0, 2])]) == []
        assert told(solids=[wall], sources=[disk(at=[0, 0, 3])]) == []
        # In a die within the wall the light has a way to go.
        assert told(solids=[wall, ball("die", 0.5, [0, 0, 1])], sources=[disk(0.2, at=[0, 0, 1])]) == []
    window = solid("wall", "block", width=9, height=9, depth=2, finish="absorber", finishes={"top": "interface"})
    assert told(solids=[window], sources=[disk(at=[0, 0, 0.5])]) == []


def test_sources_in_or_on_solids_are_not_told() -> None:
    """Immersed, on a face, a trifle above it, round about, in front."""
    dome = solid("dome", "dome", "silicone", radius=2)
    die = solid("die", "block", {"index": 2.4}, width=1, height=1, depth=0.2)
    for source in (
        disk(at=[0, 0, 0.5]), disk(at=[0, 0, 0]), disk(at=[0, 0, 1e-9]), disk(5, at=[0, 0, 0]), disk(0.4, at=[0, 0, 0.2]),
        disk(at=[0, 0, -1]), {"kind": "beam", "shape": {"kind": "disk", "radius": 5}, "flux": 1, "at": [0, 0, -3]},
        {"kind": "point", "flux": 1, "at": [0, 0, 0.1]}, {"kind": "point", "flux": 1},
        {"kind": "surface", "shape": {"kind": "sphere", "radius": 30}, "side": "back", "flux": 1},
    ):  # fmt: skip
        assert told(solids=[dome, die], sources=[source]) == []


@pytest.mark.slow
def test_rays_and_fields_that_start_in_a_lens(tmp_path: Path) -> None:
    """A ray file whose rays start on a disk of radius 30, and a lens of radius 10 at the same place."""
    rays = et.RaySet.merge([et.RaySet(b.position, b.direction, b.flux) for b in et.RingSource(rays=50_000).batches()])
    et.write_rays(tmp_path / "rings.tm25ray", rays)
    field = et.LightField.fit(rays, et.Disk(radius=30), depths=(3, 3, 2, 2))
    lens = solid("lens", "rod", radius=10, height=4, at=[0, 0, -1])
    for source in ({"kind": "rays", "file": str(tmp_path / "rings.tm25ray")}, {"kind": "rays", "rays": rays},
                   {"kind": "light-field", "field": field}):  # fmt: skip
        (text,) = told(solids=[lens], sources=[{"name": "led", **source}])
        assert '"led" starts in "lens"' in text
        assert told(solids=[lens], sources=[{"name": "led", **source, "at": [0, 0, -5]}]) == []


def test_a_few_stray_rays_are_not_told() -> None:
    """Less than a hundredth of the looked at."""
    position = np.random.default_rng(1).normal(size=(1000, 3)) * [1, 1, 0]
    position[500] = [0, 0, 7]
    rays = et.RaySet(position, np.tile([0.0, 0.0, 1.0], (1000, 1)), np.ones(1000))
    assert told(sources=[{"kind": "rays", "rays": rays}], solids=[ball("lens", 1, [0, 0, 7])]) == []


# --- where it is seen ------------------------------------------------------------------------------------------------

BITING = [ball("lens", 2, [0, 0, 5]), ball("pearl", 1, [0, 0, 7])]


def test_it_is_seen_before_the_light_is_traced() -> None:
    scene = et.Scene(solids=BITING, sources=[disk()])
    match = '"lens" and "pearl" overlap: both hold'
    with pytest.warns(SceneWarning, match=match) as caught:
        rounds = et.trace_rounds(scene, 1e3)
    assert any(match in note for note in rounds.plan.notes)
    with pytest.warns(SceneWarning, match=match):
        assert any(match in note for note in et.trace(scene, 1e3).notes)
    with pytest.warns(SceneWarning, match=match):
        lmap = et.luminance_map(scene, et.Observer(0, 0, 100), et.Screen(1, 1, 1, 1), rays_per_pixel=4)
    assert any(match in note for note in lmap.notes)
    assert len(caught) == 1


@pytest.mark.parametrize("verb", ["trace", "draw", "luminance"])
def test_the_command_line_tells_it(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Once, on its way, and in what it prints at the end."""
    path = tmp_path / "biting.toml"
    et.Scene(solids=BITING, sources=[disk()]).save(path)
    options = {
        "trace": "--rays 1e3",
        "draw": "",
        "luminance": f"--observer 0,0 --distance 9 --size 1,1 --pixels 1,1 --rays-per-pixel 4 -o {tmp_path}/a.npz",
    }
    for more in ("", "--json"):
        monkeypatch.setattr(sys, "argv", ["etendue", verb, str(path), *options[verb].split(), *more.split()])
        with pytest.raises(SystemExit) as leaving:
            program.main()
        out, err = capsys.readouterr()
        assert not leaving.value.code, err
        assert " ".join(err.split()).count('warning: "lens" and "pearl" overlap: both hold') == 1
    assert "pearl" in json.dumps(json.loads(out))


@pytest.mark.parametrize("at_once", [1, 7, 1 << 18])
def test_pairs_of_boxes_are_those_of_all_against_all(monkeypatch: pytest.MonkeyPatch, at_once: int) -> None:
    generator = np.random.default_rng(3)
    low = generator.uniform(0, 10, (60, 3))
    high = low + generator.uniform(0, 4, (60, 3))
    # Some begin where others end, one holds all, and one has no end that is known.
    low[1], high[2], low[3], high[3] = high[0], low[4], -1, 20
    low[5], high[5] = np.inf, -np.inf
    sizes = (high - low).max(axis=1)
    monkeypatch.setattr(overlaps, "PAIRS_AT_ONCE", at_once)
    found = list(overlaps._near(SimpleNamespace(low=low, high=high, sizes=sizes)))  # type: ignore[arg-type]

    def meet(a: int, b: int) -> bool:
        thick = overlaps.BESIDE * min(sizes[a], sizes[b])
        return all(min(high[a, k], high[b, k]) - max(low[a, k], low[b, k]) > thick for k in range(3))

    expected = {(a, b) for a, b in itertools.combinations(range(60), 2) if meet(a, b)}
    assert len(found) == len(set(found))
    assert set(found) == expected
    assert 100 < len(expected) < 1000
