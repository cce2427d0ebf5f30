"""No file needs, directly or through others, a file that needs it.

In Python a file needs what it imports, deferred imports included. In Rust it needs the files that hold what it names, in
`use` lines and in paths wherever they stand, in its test modules too. It needs the modules that it declares, since they
belong to it, but for those called `tests`. A file that does nothing but declare modules and hand on their names needs
none and is needed by none: who names something through it needs the file behind it.
"""

from __future__ import annotations

import ast
import dataclasses
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "etendue"
CRATES = ROOT / "crates"

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


RUST_ITEM = re.compile(
    r"(?:pub(?:\([^)]*\))?\s+)?(?:use\b[^;]*|mod\s+\w+\s*);|#!?\[[^\]]*\]|#!?\[(?:[^\[\]]|\[[^\]]*\])*\]"
)
RUST_NOISE = re.compile(
    r"""//[^\n]*|/\*.*?\*/|\bb?r(\#*)".*?"\1|b?"(?:\\.|[^"\\])*"|b?'(?:\\(?:u\{\w+\}|.)[^']?|[^'\\])'""", re.DOTALL
)
RUST_PATH = re.compile(r"(?<![\w:])(\w+)((?:::\w+)+)")

Module = tuple[str, ...]
"""The path of a module in its crate; () is the crate itself."""


def use_trees(text: str) -> Iterator[tuple[list[str], str]]:
    """From `a::{b, c as d, e::*}` the paths of all leaves and the names by which they are known, ``*`` for globs."""
    head, brace, rest = text.strip().partition("{")
    path = [part.strip() for part in head.split("::") if part.strip()]
    if not brace:
        last, _, alias = (path.pop() if path else "").partition(" as ")
        path = [*path, *([last] if last not in ("self", "*") else [])]
        yield path, (alias or ("*" if last == "*" else "".join(path[-1:]))).strip()
        return
    depth, start = 0, 0
    rest = rest.rstrip().removesuffix("}") + ","
    for i, letter in enumerate(rest):
        depth += {"{": 1, "}": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            if rest[start:i].strip():
                for more, name in use_trees(rest[start:i]):
                    yield [*path, *more], name or path[-1]
            start = i + 1


@dataclasses.dataclass
class RustFile:
    """The modules that a file declares, and the paths that it names, each with the module in which it stands."""

    module: Module
    is_facade: bool
    inner: set[Module] = dataclasses.field(default_factory=set)
    """Modules whose text is in the file."""
    declared: list[str] = dataclasses.field(default_factory=list)
    """Modules in files of their own."""
    imports: dict[tuple[Module, str], list[str]] = dataclasses.field(default_factory=dict)
    """By module and name."""
    globs: list[tuple[Module, list[str]]] = dataclasses.field(default_factory=list)
    paths: list[tuple[Module, list[str]]] = dataclasses.field(default_factory=list)


def rust_file(module: Module, text: str) -> RustFile:
    text = RUST_NOISE.sub(lambda found: " " if found[0].startswith("/") else '""', text)
    file = RustFile(module, not RUST_ITEM.sub("", text).strip(), {module})
    spans = []
    for found in re.finditer(r"\bmod\s+(\w+)\s*\{", text):
        depth, end = 1, found.end()
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        spans.append((found.start(), end, found[1]))

    def at(place: int) -> Module:
        return (*module, *(name for start, end, name in spans if start < place < end))

    file.inner |= {(*at(start), name) for start, _, name in spans}
    file.declared = [name for name in re.findall(r"\bmod\s+(\w+)\s*;", text) if name != "tests"]
    for found in re.finditer(r"\buse\s+([^;]*);", text):
        for path, name in use_trees(found[1]):
            if name == "*":
                file.globs.append((at(found.start()), path))
            else:
                file.imports[at(found.start()), name] = path
    rest = re.sub(r"\buse\s+[^;]*;", lambda found: " " * len(found[0]), text)
    file.paths = [(at(p.start()), [p[1], *p[2].split("::")[1:]]) for p in RUST_PATH.finditer(rest)]
    return file


class RustCrate:
    """The files of one crate and which of them needs which."""

    def __init__(self, source: Path) -> None:
        self.files: dict[Module, RustFile] = {}
        self.home: dict[Module, Module] = {}
        self.names: dict[Module, str] = {}
        for path in sorted(source.rglob("*.rs")):
            parts = path.relative_to(source).with_suffix("").parts
            module = parts[:-1] if parts[-1] in ("mod", "lib") else parts
            file = self.files[module] = rust_file(module, path.read_text(encoding="utf-8"))
            self.home |= dict.fromkeys(file.inner, module)
            self.names[module] = path.relative_to(source.parent.parent).as_posix()

    def absolute(self, scope: Module, path: list[str]) -> Module | None:
        """The path from the crate's root; None if it leads out of the crate, or begins with a name of the file itself."""
        first, *rest = path or ["self"]
        if first == "crate":
            return tuple(rest)
        if first == "self":
            return (*scope, *rest)
        if first == "super":
            while first == "super":
                scope, (first, *rest) = scope[:-1], rest or ["self"]
            return (*scope, *(() if first == "self" else (first,)), *rest)
        known = self.files[self.home[scope]].imports.get((scope, first))
        if known is not None and known[:1] != [first]:
            begun = self.absolute(scope, known)
            return None if begun is None else (*begun, *rest)
        return (*scope, *path) if (*scope, first) in self.home else None

    def targets(self, path: Module, depth: int = 0) -> set[Module]:
        """The modules with a file of their own that a path leads to, through those that only hand names on."""
        assert depth < 20, path
        length = max(n for n in range(len(path) + 1) if path[:n] in self.home)
        module, rest = path[:length], path[length:]
        file = self.files[self.home[module]]
        if not file.is_facade or file.module != module:
            return {file.module}
        if not rest:
            # Only the names behind it are needed, and they are seen where they stand.
            return set()
        known = file.imports.get((module, rest[0]))
        begun = None if known is None else self.absolute(module, known)
        if begun is not None:
            return self.targets((*begun, *rest[1:]), depth + 1)
        found: set[Module] = set()
        for scope, glob in file.globs:
            inside = self.absolute(scope, glob)
            found |= set() if inside is None else self.targets((*inside, *rest), depth + 1)
        return found

    def behind(self, path: Module) -> set[Module]:
        """The files behind all names of a module."""
        file = self.files.get(path)
        if file is None or not file.is_facade:
            return self.targets(path)
        found: set[Module] = set()
        for (scope, _), known in file.imports.items():
            full = self.absolute(scope, known)
            found |= set() if full is None else self.targets(full)
        for scope, known in file.globs:
            full = self.absolute(scope, known)
            found |= set() if full is None else self.behind(full)
        return found

    def needs(self) -> Needs:
        result: Needs = {}
        for module, file in self.files.items():
            found: set[Module] = set()
            if not file.is_facade:
                found |= {(*module, name) for name in file.declared if not self.files[(*module, name)].is_facade}
                stated = [(scope, path) for (scope, _), path in file.imports.items()]
                for scope, path in [*stated, *file.paths]:
                    full = self.absolute(scope, path)
                    found |= set() if full is None else self.targets(full)
                for scope, path in file.globs:
                    full = self.absolute(scope, path)
                    found |= set() if full is None else self.behind(full)
            result[self.names[module]] = {self.names[m] for m in found - {module}}
        return result


def rust_needs(crates: Path) -> Needs:
    needs: Needs = {}
    for manifest in sorted(crates.glob("*/Cargo.toml")):
        needs |= RustCrate(manifest.parent / "src").needs()
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


@pytest.mark.slow
def test_no_circle_in_the_package() -> None:
    needs = python_needs(PACKAGE)
    assert sum(map(len, needs.values())) > 500
    assert circles(needs) == []


def planted(root: Path, files: Mapping[str, str]) -> RustCrate:
    for name, text in files.items():
        path = root / "src" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return RustCrate(root / "src")


HOUSE = {
    "lib.rs": "//! A house.\npub mod above;\nmod below;\nmod rooms;\n",
    "above.rs": "use crate::below::{self, Thing as Other};\npub struct Thing(Other);\n",
    "below.rs": "pub struct Thing; // not crate::above\npub const TEXT: &str = 'crate::above::Thing';\n".replace(
        "'", '"'
    ),
    "rooms/mod.rs": "#[allow(unused, reason = 'both')]\nmod one;\nmod two;\npub use one::One;\npub use two::*;\n".replace(
        "'", '"'
    ),
    "rooms/one.rs": "pub struct One;\n",
    "rooms/two.rs": "use super::One;\npub struct Two(One);\n#[cfg(test)]\nmod tests {\n    use super::*;\n}\n",
}


def test_files_of_rust_need_what_their_paths_lead_to(tmp_path: Path) -> None:
    needs = planted(tmp_path / "house", HOUSE).needs()
    src = "house/src"
    assert needs == {
        f"{src}/lib.rs": set(),
        f"{src}/above.rs": {f"{src}/below.rs"},
        f"{src}/below.rs": set(),
        f"{src}/rooms/mod.rs": set(),
        f"{src}/rooms/one.rs": set(),
        f"{src}/rooms/two.rs": {f"{src}/rooms/one.rs"},
    }


@pytest.mark.parametrize(
    ("file", "text", "found"),
    [
        ("below.rs", "use crate::{above::Thing};\nfn f(_: Thing) {}\n", ["above.rs", "below.rs"]),
        ("below.rs", "fn f() { crate::above::g() }\n", ["above.rs", "below.rs"]),
        ("below.rs", "#[cfg(test)]\nmod tests { use super::super::above::Thing; }\n", ["above.rs", "below.rs"]),
        ("below.rs", "use super::above;\nfn f() { above::g() }\n", ["above.rs", "below.rs"]),
        ("rooms/one.rs", "use super::Two;\npub struct One;\n", ["rooms/one.rs", "rooms/two.rs"]),
        ("rooms/one.rs", "use crate::rooms::*;\npub struct One;\n", ["rooms/one.rs", "rooms/two.rs"]),
        ("rooms/mod.rs", "mod one;\nmod two;\npub struct One;\n", ["rooms/mod.rs", "rooms/two.rs"]),
        (
            "rooms/mod.rs",
            "mod one;\nmod two;\npub use one::One;\nfn f() { two::g() }\n",
            ["rooms/mod.rs", "rooms/two.rs"],
        ),
    ],
)
def test_a_circle_in_a_crate_is_found(tmp_path: Path, file: str, text: str, found: list[str]) -> None:
    assert circles(planted(tmp_path / "house", HOUSE).needs()) == []
    needs = planted(tmp_path / "house", {**HOUSE, file: text}).needs()
    assert circles(needs) == [[f"house/src/{name}" for name in found]]


def test_no_circle_in_a_crate() -> None:
    needs = rust_needs(CRATES)
    assert len({name.split("/")[0] for name in needs}) == len(list(CRATES.glob("*/Cargo.toml"))) >= 7
    assert len(needs) > 140
    assert sum(map(len, needs.values())) > 300
    assert circles(needs) == []
