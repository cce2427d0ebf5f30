"""What is imported, and when: `import etendue` takes no library, and each name comes with its module."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import etendue
import pytest
from etendue.cli.verbs import FAMILIES_OF_VERBS, VERBS, command_of, summary

STUB = Path(etendue.__file__).with_suffix(".pyi")

MODULES_AT_ONCE = {"etendue", "etendue.quantities", "etendue.quantities.notebook", "etendue.quantities.outlets"}
"""Modules of ours that `import etendue` imports: those in which it says where files, pictures and pages are made."""


def imported(*, code: str) -> set[str]:
    """Names of all modules after some lines in a fresh interpreter."""
    lines = f"{code}\nimport json, sys\nprint('\\n' + json.dumps(sorted(sys.modules)))"
    result = subprocess.run([sys.executable, "-c", lines], capture_output=True, text=True, check=True)
    return set(json.loads(result.stdout.splitlines()[-1]))


def libraries(modules: set[str]) -> set[str]:
    """Libraries of others among them."""
    first = {name.partition(".")[0] for name in modules}
    return {name for name in first - sys.stdlib_module_names if not name.startswith("_")} - {"etendue", "sitecustomize"}


def ours(modules: set[str]) -> set[str]:
    return {name for name in modules if name.partition(".")[0] == "etendue"}


def test_import_etendue_imports_little() -> None:
    modules = imported(code="import etendue")
    assert not libraries(modules)
    assert ours(modules) == MODULES_AT_ONCE
    assert "importlib.metadata" not in modules


@pytest.mark.slow
def test_a_name_brings_its_own_module_alone() -> None:
    """Rays need no scenes, and so no pydantic; scenes do."""
    assert "pydantic" not in libraries(imported(code="import etendue as et\net.RaySet, et.read_rays"))
    assert "pydantic" in libraries(imported(code="import etendue as et\net.Scene"))


AT_TERMINALS = {"annotated_doc", "rich", "shellingham", "typer"}
"""Libraries behind the command line, with those that they bring."""

FOR_HELP = {"attr", "markdown_it", "mdurl", "pygments"}
"""What rich takes to write the list of verbs; `attr` only where something else has installed it."""

FOR_ARGUMENTS = {"annotated_types", "pydantic", "pydantic_core", "typing_extensions", "typing_inspection"}
"""What typer takes to read the arguments of any verb, if it is installed."""

NEVER = ("cascadio", "h5py", "matplotlib", "OpenEXR", "scipy", "tifffile", "tomli_w", "trimesh")


def program(*, arguments: list[str]) -> set[str]:
    code = f"""
import sys
sys.argv = ["etendue", *{arguments!r}]
from etendue.cli import main
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
"""
    return imported(code=code)


def test_help_imports_no_verb() -> None:
    """The list of verbs is that of their docstrings, and none of them is imported."""
    modules = program(arguments=["--help"])
    assert libraries(modules) <= AT_TERMINALS | FOR_HELP
    parts = {name.split(".")[1] for name in ours(modules) if "." in name}
    assert parts == {"cli", "errors", "extras", "formats", "quantities"}
    commands = {name for name in ours(modules) if name.startswith("etendue.cli.")}
    names = ("app", "guard", "stated", "stopping", "terminal", "verbs", "wording")
    assert commands == {f"etendue.cli.{name}" for name in names}


@pytest.mark.slow
def test_info_imports_what_the_file_asks_for(tmp_path: Path) -> None:
    """Intensity and rays need no scenes, no light fields; intensity none of the libraries of other formats."""
    path = tmp_path / "small.ies"
    etendue.write_intensity(path, etendue.Intensity(c=[0], gamma=[0, 10, 90], values=[[1000, 10, 0]]))
    modules = program(arguments=["info", str(path)])
    assert libraries(modules) <= AT_TERMINALS | FOR_ARGUMENTS | {"numpy"}
    assert not {name.partition(".")[0] for name in modules} & set(NEVER)
    assert "urllib.request" not in modules
    for part in ("scene", "scatter", "lightfield", "luminance", "tracing", "plot", "formats.rays", "formats.maps"):
        assert f"etendue.{part}" not in modules
    etendue.write_rays(tmp_path / "led.tm25ray", etendue.RingSource(rays=100).ray_set())
    modules = program(arguments=["info", str(tmp_path / "led.tm25ray")])
    assert "etendue.formats.rays" in modules
    others = ("formats.intensity", "formats.maps")
    for part in ("scene", "scatter", "lightfield", "luminance", "tracing", "plot", *others):
        assert f"etendue.{part}" not in modules


@pytest.mark.parametrize("name", [*VERBS, *FAMILIES_OF_VERBS])
def test_the_list_says_of_each_verb_what_the_verb_says(name: str) -> None:
    assert summary({**VERBS, **FAMILIES_OF_VERBS}[name]) == command_of(name).help


def test_the_stub_says_where_each_name_is() -> None:
    """What type checkers read is what happens."""
    tree = ast.parse(STUB.read_text())
    stated = {
        alias.asname or alias.name: (node.module, alias.name)
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    expected = {name: (module, name) for name, module in etendue.HOMES.items()}
    for name, module in etendue.MODULES.items():
        package, _, last = module.rpartition(".")
        expected[name] = (package, last)
    assert stated == expected
    (listed,) = (ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign))
    assert listed == etendue.__all__ == sorted(expected)


@pytest.mark.slow
def test_every_public_name_is_there() -> None:
    assert {*etendue.__all__, "__version__"} == set(dir(etendue))
    for name in dir(etendue):
        assert getattr(etendue, name) is getattr(etendue, name)
    assert etendue.errors.ArgumentError is etendue.ArgumentError
    for name in ("luminanse_map", "_hidden"):
        with pytest.raises(AttributeError, match=name):
            getattr(etendue, name)
    code = "import etendue\nfrom etendue import *\nassert all(n in globals() for n in etendue.__all__)"
    assert "etendue.plot" in imported(code=code)


@pytest.mark.slow
def test_maps_know_their_files_before_anything_else_is_imported() -> None:
    """A map that comes out of a pickle has been made by nobody in this process."""
    code = """
import etendue.quantities.luminance_map as m, numpy as np, tempfile, pathlib
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
one = np.ones((2, 2))
lmap = m.LuminanceMap(one, one, one.astype(int), Observer(0, 0, 9), Screen(2, 2, 2, 2), "lm", Provenance("a", "b", "c"))
with tempfile.TemporaryDirectory() as folder:
    lmap.save(pathlib.Path(folder) / "map.csv")
    assert (pathlib.Path(folder) / "map.csv").stat().st_size
assert "2" in lmap._repr_html_()
"""
    assert "etendue.formats.maps" in imported(code=code)
