"""The stub of the compiled core says what the core is: names, parameters, defaults, and what comes back."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from etendue import _core

STUB = Path(__file__).resolve().parents[2] / "python" / "etendue" / "_core.pyi"
TREE = ast.parse(STUB.read_text())
CLASSES = {node.name: node for node in TREE.body if isinstance(node, ast.ClassDef)}
FUNCTIONS = {node.name: node for node in TREE.body if isinstance(node, ast.FunctionDef)}


def keys(name: str) -> list[str]:
    """Keys of a TypedDict of the stub."""
    return [
        node.target.id
        for node in CLASSES[name].body
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)
    ]


def parameters(function: ast.FunctionDef) -> list[tuple[str, bool]]:
    """Names of the parameters, and whether they may be left out."""
    names = [a.arg for a in function.args.args if a.arg not in ("self", "cls")]
    optional = len(function.args.defaults)
    return [(name, i >= len(names) - optional) for i, name in enumerate(names)]


def built(thing: Any) -> list[tuple[str, bool]]:
    return [(p.name, p.default is not p.empty) for p in inspect.signature(thing).parameters.values()]


def test_stub_and_module_hold_the_same_names() -> None:
    stated = {name for name in (*CLASSES, *FUNCTIONS) if not name.startswith("_")}
    assert stated == {name for name in dir(_core) if not name.startswith("_")}


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_functions_take_what_the_stub_says(name: str) -> None:
    assert built(getattr(_core, name)) == parameters(FUNCTIONS[name])
    assert ast.get_docstring(FUNCTIONS[name])
    assert getattr(_core, name).__doc__


@pytest.mark.parametrize("name", sorted(name for name in CLASSES if not name.startswith("_")))
def test_classes_have_what_the_stub_says(name: str) -> None:
    methods = {node.name: node for node in CLASSES[name].body if isinstance(node, ast.FunctionDef)}
    assert built(getattr(_core, name)) == parameters(methods["__new__"])
    own = {m for m in vars(getattr(_core, name)) if callable(getattr(getattr(_core, name), m))} - {
        "__doc__",
        "__module__",
    }
    assert own == set(methods)
    with pytest.raises(TypeError):
        type("Child", (getattr(_core, name),), {})  # @final


def source() -> _core.RingSource:
    return _core.RingSource([(0.0, 1.0, 2.0, 100)], 2, 7)


def test_a_scan_comes_back_with_the_keys_of_the_stub() -> None:
    tally, moments = _core.scan(source())
    assert list(tally) == keys("_Tally")
    assert list(moments) == keys("_Moments")
    assert {type(v) for v in tally.values()} == {int, float, list}
    assert isinstance(tally["dark"], int)


def test_cone_sums_want_every_key_and_come_back_in_the_stated_shapes() -> None:
    view = {
        "eye": (0.0, 0.0, 9.0), "target": (0.0, 0.0, 0.0), "right": (1.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0),
        "normal": (0.0, 0.0, 1.0), "width": 2.0, "height": 2.0, "columns": 3, "rows": 2,
    }  # fmt: skip
    cone: Any = {"view": view, "acceptances": [0.1, 0.5, 1.0, 1.5], "disk": None}
    assert list(view) == keys("_View")
    assert list(cone) == keys("_Cone")
    ((flux, flux_squared, rays),), tally = _core.cone_sums(source(), [cone])
    assert {a.shape for a in (flux, flux_squared, rays)} == {(4, 2, 3)}
    assert (flux.dtype, flux_squared.dtype, rays.dtype) == (np.float64, np.float64, np.uint64)
    assert list(tally) == keys("_Tally")
    for key in cone:
        with pytest.raises((TypeError, KeyError, ValueError), match=key):
            _core.cone_sums(source(), [{k: v for k, v in cone.items() if k != key}])
    for key in view:
        with pytest.raises((TypeError, KeyError, ValueError), match="view"):
            _core.cone_sums(source(), [{**cone, "view": {k: v for k, v in view.items() if k != key}}])


def test_arrays_come_back_in_the_stated_shapes_and_types() -> None:
    position, direction, flux = _core.read_rays(source(), 3, 10)
    assert (position.shape, direction.shape, flux.shape) == ((7, 3), (7, 3), (7,))
    assert {a.dtype for a in (position, direction, flux)} == {np.dtype(np.float64)}
    assert _core.select_subset(0, 10, 10, 4, 0, 1).dtype == np.uint64
    assert _core.deal_parts(0, 10, 4, 1).dtype == np.uint32
    assert len(source()) == 200


def test_what_is_no_source_is_refused() -> None:
    with pytest.raises(TypeError):
        _core.scan(np.zeros(3))  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        _core.RayTable(np.zeros(28, np.int8), 28, 0, 12, 24, False, 1.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("size", "layout"),
    [
        (28, (28, 0, 12, 25, False)),  # the flux reaches past the record
        (28, (28, 20, 12, 24, False)),
        (28, (28, 0, 12, 24, True)),
        (29, (28, 0, 12, 24, False)),  # not a whole number of records
        (28, (0, 0, 12, 24, False)),
        (28, (28, 2**63, 12, 24, False)),
    ],
)
def test_records_that_reach_outside_their_bytes_are_refused(size: int, layout: tuple[int, int, int, int, bool]) -> None:
    with pytest.raises(ValueError, match="not a table"):
        _core.RayTable(np.zeros(size, np.uint8), *layout, 1.0)


@pytest.mark.parametrize(
    "arguments", [(5, 4, 10, 2, 0, 1), (0, 11, 10, 2, 0, 1), (0, 10, 10, 11, 0, 1), (0, 10, 10, 2, 3, 1)]
)
def test_subsets_that_do_not_exist_are_refused(arguments: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="subset"):
        _core.select_subset(*arguments)
