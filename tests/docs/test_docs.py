"""The documentation is complete, and what it refers to exists."""

from __future__ import annotations

import importlib
import re
from collections.abc import Mapping
from pathlib import Path

import etendue as et
import pytest
from etendue.cli.verbs import FAMILIES_OF_VERBS, VERBS
from etendue.description.keys import Description
from etendue.formats.intensity import INTENSITY_FORMATS
from etendue.formats.maps import MAP_EXTENSIONS, PICTURE_EXTENSIONS
from etendue.formats.rays import RAY_FORMATS
from etendue.luminance.filters import FILTERS
from etendue.scene import MEDIA, Medium, Scene, Solid, Surface
from etendue.scene.bodies import BODIES
from etendue.scene.detectors import DETECTORS
from etendue.scene.finishes import FINISHES
from etendue.scene.observers import ObserverKeys, ScreenKeys
from etendue.scene.placement import Placement
from etendue.scene.shapes import SHAPES, HalfSpace, Trim
from etendue.scene.shapes.conics import Profile
from etendue.scene.sources import SOURCES, Source

from docs.pages import PAGES, ROOT, anchors, blocks, links, name_of, prose

CODE = [*sorted((ROOT / "python").rglob("*.py")), *sorted((ROOT / "crates").rglob("*.rs"))]
CITATION = re.compile(r"\[([A-Z][A-Za-z]*[0-9]{4,7}[a-z]?)\]")
THEORY = re.compile(r"\btheory eqs?\. (\d+)(?:(?: to |-|–| and |, )(\d+))?")


def text_of(paths: list[Path]) -> str:
    return "\n".join(path.read_text(encoding="utf-8") for path in paths)


def docs() -> str:
    return text_of(PAGES)


def page(name: str) -> Path:
    path = ROOT / "docs" / name
    assert path in PAGES
    return path


# --- references --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_links_lead_somewhere(path: Path) -> None:
    for link in links(path):
        if link.startswith(("https://", "http://")):
            continue
        target, _, anchor = link.partition("#")
        file = (path.parent / target).resolve() if target else path
        assert file.exists(), f"{name_of(path)}: {link} leads nowhere"
        assert file.is_relative_to(ROOT), f"{name_of(path)}: {link} leads out of the project"
        assert not anchor or anchor in anchors(file), f"{name_of(path)}: no heading {anchor!r} in {name_of(file)}"


def test_there_are_links() -> None:
    assert sum(1 for path in PAGES for _ in links(path)) >= 20


def test_the_index_names_every_page() -> None:
    linked = {(ROOT / "docs" / link.partition("#")[0]).resolve() for link in links(ROOT / "docs" / "README.md")}
    missing = [
        name_of(p) for p in PAGES if p.is_relative_to(ROOT / "docs") and p.name != "README.md" and p not in linked
    ]
    assert not missing


def test_citations_and_bibliography_agree() -> None:
    """Every key that is cited exists, and every entry is cited."""
    entries = re.findall(r"^@\w+\{([^,]+),", (ROOT / "references.bib").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(entries) == len(set(entries)) >= 10
    cited = set(CITATION.findall("\n".join(prose(path) for path in PAGES) + text_of(CODE)))
    assert cited == set(entries)


def test_theory_equations_are_numbered_and_cited_ones_exist() -> None:
    numbers = [int(n) for n in re.findall(r"\\tag\{(\d+)\}", page("theory.md").read_text(encoding="utf-8"))]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) >= 25
    cited = {int(n) for pair in THEORY.findall(docs() + text_of(CODE)) for n in pair if n}
    assert cited
    assert cited <= set(numbers)


def test_equations_referred_to_within_the_theory_exist() -> None:
    text = prose(page("theory.md"))
    numbers = {int(n) for n in re.findall(r"\\tag\{(\d+)\}", text)}
    own = re.findall(r"(?<!thesis )(?<!Thesis )\b[Ee]qs?\. (\d+)(?![.\d])", text)
    assert len(own) >= 10
    assert {int(n) for n in own} <= numbers


# --- completeness ------------------------------------------------------------------------------------------------------


def test_every_public_name_is_documented() -> None:
    assert len(et.__all__) >= 10
    missing = [name for name in et.__all__ if not re.search(rf"\b{name}\b", docs())]
    assert not missing


def test_every_module_named_in_the_pages_exists() -> None:
    named = sorted(set(re.findall(r"`(etendue(?:\.\w+)+)`", docs())))
    assert len(named) >= 20
    for name in named:
        parts = name.split(".")
        for count in range(len(parts), 0, -1):
            try:
                value = importlib.import_module(".".join(parts[:count]))
            except ModuleNotFoundError:
                continue
            for attribute in parts[count:]:
                value = getattr(value, attribute)
            break


def test_architecture_names_every_crate_and_module() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    crates = {f"crates/{path.parent.name}" for path in (ROOT / "crates").glob("*/Cargo.toml")}
    assert crates == set(re.findall(r"^\| `(crates/\w+)` \|", text, re.MULTILINE))
    package = ROOT / "python" / "etendue"
    # Families of like modules (formats, detectors, verbs) are named as a whole.
    families = {
        "formats/rays",
        "formats/maps",
        "formats/bsdf",
        "scatter/models",
        "formats/intensity",
        "lightfield/carrier",
        "scene/detectors",
        "cli",
        "plot",
    }
    modules = {
        "etendue." + name.removesuffix(".py").replace("/", ".")
        for name in (path.relative_to(package).as_posix() for path in package.rglob("*.py"))
        if not name.endswith("__init__.py") and not any(name.startswith(family + "/") for family in families)
    }
    modules |= {"etendue." + family.replace("/", ".") for family in families}
    assert modules == set(re.findall(r"^\| `(etendue\.[\w.]+)` \|", text, re.MULTILINE))


def test_the_page_of_ray_files_lists_every_format_with_its_extensions() -> None:
    rows = re.findall(r"^\| `([a-z0-9-]+)` \|[^|]*\|([^|]*)\|", prose(page("formats/ray-files.md")), re.MULTILINE)
    listed = {name: tuple(re.findall(r"`(\.\w+)`", cell)) for name, cell in rows}
    assert listed == {f.name: f.extensions for f in RAY_FORMATS}


def test_the_page_of_intensity_files_lists_every_format_with_its_extension() -> None:
    rows = re.findall(r"^\| `([a-z0-9]+)` \|[^|]*\| `(\.\w+)` \|", prose(page("formats/intensity.md")), re.MULTILINE)
    assert dict(rows) == {name: f.extension for name, f in INTENSITY_FORMATS.items()}


def test_the_page_of_map_files_lists_every_extension() -> None:
    listed = re.findall(r"^\| (`\.[^|]*)\|", prose(page("formats/maps.md")), re.MULTILINE)
    assert set(re.findall(r"\.\w+", " ".join(listed))) == {*MAP_EXTENSIONS, *PICTURE_EXTENSIONS}


FAMILIES: dict[str, Mapping[str, type[Description]]] = {
    "Sources": SOURCES,
    "Finishes": FINISHES,
    "Solids": BODIES,
    "Surfaces": SHAPES,
    "Detectors": DETECTORS,
}
"""Families of a scene's parts, by the section that lists them."""

TOLD_OF_ALL = {*Source.model_fields, "kind"}
"""Keys that the page explains once for all: name, place and colours."""


@pytest.mark.parametrize("section", FAMILIES)
def test_the_page_of_scenes_names_every_kind_and_every_key(section: str) -> None:
    text = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8").split(f"\n## {section}\n")[1].split("\n## ")[0]
    rows = dict(re.findall(r"^\| `([a-z-]+)` \| ([^|]*)\|", text, re.MULTILINE))
    assert set(FAMILIES[section]) <= set(rows)
    for kind, member in FAMILIES[section].items():
        keys = set(member.names_by_key()) - TOLD_OF_ALL
        assert set(re.findall(r"`(\w+)`", rows[kind])) == keys, kind


@pytest.mark.parametrize(
    "part", [Scene, Placement, Medium, Solid, Surface, Trim, HalfSpace, Profile, ScreenKeys, ObserverKeys]
)
def test_the_page_of_scenes_names_every_key(part: type[Description]) -> None:
    text = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8")
    missing = [key for key in part.names_by_key() if f"`{key}`" not in text]
    assert not missing


def test_the_page_of_scenes_names_every_medium() -> None:
    text = prose(page("scenes.md"))
    assert all(f"`{name}`" in text for name in MEDIA)


def test_theory_names_every_filter() -> None:
    rows = re.findall(r"^\| `([a-z-]+)` \|", prose(page("theory.md")), re.MULTILINE)
    assert set(rows) == set(FILTERS)


def test_every_verb_is_run_by_a_page() -> None:
    commands = [block.text for path in PAGES for block in blocks(path) if block.language == "console"]
    run = set(re.findall(r"^\$ etendue (\w+)", "\n".join(commands), re.MULTILINE))
    assert run == {*VERBS, *FAMILIES_OF_VERBS}


def test_no_page_names_a_path_of_somebodys_machine() -> None:
    assert not re.findall(r"(?:/home/|/Users/|/tmp/|[A-Z]:\\)\S*", docs())
