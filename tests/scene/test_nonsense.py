"""Nonsense in, one clear error out: no other exception, no huge allocation, whatever the file holds."""

from __future__ import annotations

import copy
import random
import warnings
from typing import Any

import pytest
from etendue.errors import SceneError, SceneWarning
from etendue.scene import Scene, compile_scene
from hypothesis import given
from hypothesis import strategies as st
from oracles.scenes import BODIES, SHAPES

LEAVES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=5),
    st.sampled_from(["ball", "BK7", "mirror", "air"]),
)
ANYTHING = st.recursive(
    LEAVES,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["kind", "name", "shape", "radius", "at", "x"]), inner, max_size=4)
    ),
    max_leaves=8,
)
SCENE: dict[str, Any] = {
    "wavelength": 500.0,
    "media": {"m": {"index": 1.5, "absorption": {"wavelength": [400.0, 700.0], "values": [0.0, 0.1]}}},
    "finishes": {"f": {"kind": "mirror", "reflectance": {"angle": [0.0, 90.0], "values": [0.5, 0.9]}}},
    "sources": [{"kind": "surface", "shape": {"kind": "disk", "radius": 1.0}, "flux": 1.0, "spectrum": [[500.0, 1.0]]}],
    "solids": [{"name": kind, "shape": {"kind": kind, **keys}, "medium": "m"} for kind, (keys, _) in BODIES.items()],
    "surfaces": [
        {"name": f"s {kind}", "shape": {"kind": kind, **keys}, "finish": "f"} for kind, keys in SHAPES.items()
    ],
    "detectors": [
        {"kind": "illuminance", "width": 1.0, "height": 1.0, "columns": 2, "rows": 3, "toward": [0.0, 0.0, 1.0]}
    ],
    "observers": [{"distance": 10.0, "screen": {"width": 1.0, "height": 1.0, "columns": 2, "rows": 2}}],
}
ABSURD: list[Any] = [
    None, True, -1, 0, 10**400, -0.0, 1e-320, 1e308, -1e308, float("nan"), float("inf"), float("-inf"), "", "é" * 50, [], {},
    [[]], [1] * 300, {"kind": "ball"}, {"kind": []}, b"bytes", {1: 2},
]  # fmt: skip
"""What may stand in the place of any value."""


def built(data: Any) -> bool:
    """Whether a scene could be made of something; every failure must be ours, and be told."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SceneWarning)
            compile_scene(Scene.from_dict(data))
    except SceneError as error:
        mistakes = error.mistakes
    else:
        return True
    assert mistakes
    assert all(len(text) < 2000 for _, text in mistakes)
    return False


def test_the_scene_itself_is_sound() -> None:
    assert built(SCENE)


@pytest.mark.slow
@given(st.dictionaries(st.sampled_from([*Scene.model_fields, "x"]), ANYTHING, max_size=4))
def test_any_tree_is_a_scene_or_an_error(data: dict[str, Any]) -> None:
    built(data)


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Every place of a tree that holds something."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list | tuple) else ()
    return [path, *(place for key, held in inner for place in places(held, (*path, key)))]


def with_value(tree: Any, path: tuple[Any, ...], value: Any) -> Any:
    if not path:
        return value
    changed = list(tree) if isinstance(tree, tuple) else copy.copy(tree)
    changed[path[0]] = with_value(tree[path[0]], path[1:], value)
    return changed


@pytest.mark.slow
@pytest.mark.parametrize("family", [key for key in SCENE if key != "wavelength"])
def test_one_absurd_value_anywhere(family: str) -> None:
    """Every value of a scene in turn, replaced by one of the absurd ones; 600 at most for each family, drawn with a seed."""
    part = {key: SCENE[key] for key in {family, "media", "finishes"}}
    trials = [(path, value) for path in places(part)[1:] for value in ABSURD]
    refused = 0
    for path, value in random.Random(7).sample(trials, min(len(trials), 600)):
        refused += not built(with_value(part, path, value))
    assert refused > 100
