"""No file needs, directly or through others, a file that needs it: in Python over imports, deferred ones included."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "python" / "etendue"

Needs = dict[str, set[str]]
"""By the name of a file, the names of those that it needs."""


def circles(needs: Mapping[str, set[str]]) -> list[list[str]]:
    """The sets of files that all need each other, by Tarjan's algorithm."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in sorted(needs[name]):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            start = stack.index(name)
            if len(stack) - start > 1 or name in needs[name]:
                found.append(sorted(stack[start:]))
            del stack[start:]

    for name in sorted(needs):
        if name not in index:
            visit(name)
    return found


def imported(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Module and name of everything that a file imports, wherever in it, also through `importlib`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.module or "", alias.name) for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            yield from ((arg.value, "") for arg in node.args if isinstance(arg, ast.Constant))


def python_needs(package: Path) -> Needs:
    paths = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        paths[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    compiled = f"{package.name}._core"
    needs: Needs = {}
    for name, path in paths.items():
        targets = set()
        for module, attribute in imported(ast.parse(path.read_text(encoding="utf-8"))):
            full = f"{module}.{attribute}".rstrip(".")
            if compiled not in (full, module):
                targets |= {full if full in paths else module} & set(paths)
        needs[name] = targets
    return needs


def test_circles_are_found() -> None:
    line = {"a": {"b"}, "b": {"c"}, "c": set[str]()}
    assert circles(line) == []
    assert circles({**line, "c": {"a"}}) == [["a", "b", "c"]]
    assert circles({**line, "c": {"b"}, "d": {"d", "a"}}) == [["b", "c"], ["d"]]


def test_a_deferred_import_counts(tmp_path: Path) -> None:
    package = tmp_path / "house"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "above.py").write_text("from house import below\n")
    (package / "below.py").write_text("def late():\n    from house.above import thing\n    return thing\n")
    assert circles(python_needs(package)) == [["house.above", "house.below"]]
    (package / "below.py").write_text("import importlib\ndef late():\n    importlib.import_module('house.above')\n")
    assert circles(python_needs(package)) == [["house.above", "house.below"]]


def test_no_circle_in_the_package() -> None:
    needs = python_needs(PACKAGE)
    assert sum(map(len, needs.values())) > 500
    assert circles(needs) == []
