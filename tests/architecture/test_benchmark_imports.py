"""Benchmarks, which no test runs, still find what they take from the package."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.mark.parametrize("path", sorted(BENCHMARKS.glob("*.py")), ids=lambda path: path.stem)
def test_what_a_benchmark_imports_of_the_package_is_there(path: Path) -> None:
    """Read, not run: libraries of peers need not be installed."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "etendue":
            module = importlib.import_module(node.module or "")
            missing = [
                one.name for one in node.names if not hasattr(module, one.name) and not _is_module(module, one.name)
            ]
            assert not missing, f"{path.name}: {node.module} has no {', '.join(missing)}"


def _is_module(package: object, name: str) -> bool:
    try:
        importlib.import_module(f"{getattr(package, '__name__', '')}.{name}")
    except ModuleNotFoundError:
        return False
    return True
