"""The site builds without a warning; what the builder does not look for: names, navigation, anchors, other hosts."""

from __future__ import annotations

import doctest
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from posixpath import dirname, normpath
from types import ModuleType

import etendue as et
import pytest

from docs.built_site import Page, is_foreign, loaded_by_style, pages_in
from docs.pages import PAGES, ROOT, name_of, prose


def part_of_site(name: str) -> ModuleType:
    """A module of docs/site, which is no package."""
    spec = importlib.util.spec_from_file_location(f"site_{name}", ROOT / "docs" / "site" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(ROOT / "docs" / "site"))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.pop(0)
    return module


@pytest.mark.parametrize("name", ["bibliography", "equations", "hooks", "reference"])
def test_examples_of_the_hooks(name: str) -> None:
    done = doctest.testmod(part_of_site(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert done.attempted
    assert not done.failed


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the built site; a warning of the builder is an error."""
    folder = tmp_path_factory.mktemp("site")
    # Without the search for garbage, a tenth of its time.
    program = "import gc; gc.disable(); from mkdocs.__main__ import cli; cli()"
    command = [sys.executable, "-c", program, "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def built(site: Path) -> dict[str, Page]:
    found = pages_in(site)
    assert len(found) >= 60
    return found


@pytest.mark.slow
def test_every_public_name_has_an_entry(built: dict[str, Page]) -> None:
    home_of = part_of_site("reference").home_of
    anchors = [anchor for name, page in built.items() if name.startswith("reference/") for anchor in page.anchors]
    assert [name for name in et.__all__ if anchors.count(home_of(name)) != 1] == []


@pytest.mark.slow
def test_the_page_of_public_names_leads_to_the_entries(built: dict[str, Page]) -> None:
    home_of = part_of_site("reference").home_of
    led_to = {link.rpartition("#")[2] for link in built["api.html"].links}
    assert {home_of(name) for name in et.__all__} <= led_to


@pytest.mark.slow
def test_every_page_of_the_project_is_in_the_navigation(built: dict[str, Page]) -> None:
    page_at = part_of_site("hooks").page_at
    listed = {normpath(link.partition("#")[0]) for link in built["index.html"].links}
    wanted = {name_of(path): page_at(name_of(path)).removesuffix(".md") + ".html" for path in PAGES}
    assert [name for name, page in wanted.items() if page not in listed] == []


@pytest.mark.slow
def test_links_lead_to_pages_and_anchors(site: Path, built: dict[str, Page]) -> None:
    followed, broken = 0, []
    for name, page in built.items():
        if name == "404.html":  # whose links begin at the root of a server
            continue
        for link in page.links:
            if is_foreign(link) or link.startswith("mailto:"):
                continue
            target, _, anchor = link.partition("#")
            there = normpath(f"{dirname(name)}/{target}").lstrip("/") if target else name
            followed += 1
            if there in built:
                if anchor and anchor not in built[there].anchors:
                    broken.append(f"{name}: {link}: no such anchor")
            elif not (site / there).exists():
                broken.append(f"{name}: {link}: no such page")
    assert followed > 1000
    assert broken == []


@pytest.mark.slow
def test_nothing_is_loaded_from_another_host(site: Path, built: dict[str, Page]) -> None:
    fetched = [(name, address) for name, page in built.items() for address in page.fetched]
    assert len(fetched) > 5 * len(built)
    styles = list(site.rglob("*.css"))
    assert styles
    fetched += [(path.name, one) for path in styles for one in loaded_by_style(path.read_text(encoding="utf-8"))]
    assert [pair for pair in fetched if is_foreign(pair[1])] == []


@pytest.mark.slow
def test_equations_are_drawn_as_they_are_numbered(site: Path) -> None:
    text = prose(ROOT / "docs" / "theory.md")
    html = (site / "theory.html").read_text(encoding="utf-8")
    assert re.findall(r'id="eq-(\w+)"', html) == re.findall(r"\\tag\{(\w+)\}", text)
    assert html.count("<math ") == text.count("$$") // 2
    outside = re.sub(r"<(pre|code)\b.*?</\1>", "", html, flags=re.DOTALL)
    assert "$$" not in outside
    assert not re.search(r"\\[a-z]+", re.sub(r"<script.*?</script>", "", outside, flags=re.DOTALL))
