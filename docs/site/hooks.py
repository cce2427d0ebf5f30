"""What MkDocs does beside reading docs/: pages from elsewhere in the project, links, equations, citations, public names."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Callable
from pathlib import Path
from posixpath import dirname, normpath, relpath
from typing import Any

from bibliography import bibliography_page, link_citations, link_citations_of_docstrings
from equations import draw_equations
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from reference import link_names, reference_pages

ROOT = Path(__file__).resolve().parents[2]

ELSEWHERE = {
    "README.md": "index.md",
    "docs/README.md": "pages.md",
    "ARCHITECTURE.md": "project/architecture.md",
    "CONTRIBUTING.md": "project/contributing.md",
    "CHANGELOG.md": "project/changelog.md",
    "benchmarks/README.md": "project/benchmarks.md",
    "references.bib": "project/references.md",
}
"""Pages that do not stand in docs/, or not under the name that they have on the site: file of the project → page."""

_FENCE = re.compile(r"^( {0,3}(`{3,}|~{3,})[^\n]*\n.*?^ {0,3}\2[`~]*[ \t]*$)", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"(!?\[(?:[^\[\]]|\[[^\]]*\])*\])\(([^)\s]+)\)|(`[^`\n]*`)")


def page_at(path: str) -> str | None:
    """The page or picture of the site that shows a file of the project, if there is one.

    >>> page_at("docs/theory.md"), page_at("examples/prism.py"), page_at("Cargo.toml")
    ('theory.md', 'examples/prism.md', None)
    """
    if path in ELSEWHERE:
        return ELSEWHERE[path]
    if path.startswith("docs/"):
        return path.removeprefix("docs/").replace(".ipynb", ".md")
    if re.fullmatch(r"examples/\w+\.py", path):
        return path.removesuffix(".py") + ".md"
    return None


def source_of(page: str) -> str:
    """The file of the project that a page of the site shows: the inverse of `page_at`."""
    back = {there: here for here, there in ELSEWHERE.items()}
    return back.get(page, f"docs/{page}")


def move_links(text: str, page: str) -> str:
    """Links and images of a project's page as they must be on the site; those to files that it does not show are text.

    >>> move_links("[a](../README.md#x) [b](../changes) `[c](d)`", "theory.md")
    '[a](index.md#x) b `[c](d)`'
    """

    def moved(found: re.Match[str]) -> str:
        label, link, code = found[1], found[2], found[3]
        if code or link.startswith(("http://", "https://", "mailto:", "#")):
            return found[0]
        target, hash_sign, anchor = link.partition("#")
        there = page_at(normpath(f"{dirname(source_of(page))}/{target}".lstrip("/")))
        return f"{label}({relpath(there, dirname(page) or '.')}{hash_sign}{anchor})" if there else label[1:-1]

    return _LINK.sub(moved, text)


def outside_blocks(text: str, change: Callable[[str], str]) -> str:
    """Text with its prose changed, and its fenced blocks as they are."""
    pieces = _FENCE.split(text)
    # Each block comes as two pieces: itself and its fence.
    prose, fenced = pieces[0::3], pieces[1::3]
    return "".join(change(words) + block for words, block in zip(prose, [*fenced, ""], strict=True))


def example_page(path: Path) -> str:
    """Markdown that shows a script under what it says of itself."""
    code = path.read_text(encoding="utf-8")
    title = (ast.get_docstring(ast.parse(code)) or path.stem).split("\n", maxsplit=1)[0].partition(":")[0].rstrip(".")
    return f"# {title}\n\n`examples/{path.name}`, as the [gallery](../gallery.md) runs it:\n\n````python\n{code}````\n"


def notebook_page(path: Path) -> str:
    """Markdown of a notebook: its words and its cells, and where it is itself."""
    parts = []
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
    return "\n\n".join([*parts, f"The notebook itself: [{path.name}]({path.name}).\n"])


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that docs/ does not hold."""
    made = {there: ROOT / here for here, there in ELSEWHERE.items()}
    files.remove(files.src_uris["README.md"])  # the page of all pages, which is not the first one here
    for page, path in made.items():
        text = bibliography_page(path) if path.suffix == ".bib" else path.read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=text))
    for path in sorted((ROOT / "examples").glob("*.py")):
        files.append(File.generated(config, f"examples/{path.stem}.md", content=example_page(path)))
    for path in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")):
        files.append(File.generated(config, f"notebooks/{path.stem}.md", content=notebook_page(path)))
    for _, page, text in reference_pages():
        files.append(File.generated(config, page, content=text))
    return files


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """List the pages of the reference below the page of the public names."""
    (reference,) = (section["Reference"] for section in config.nav or [] if "Reference" in section)
    reference[0] = {"Public names": ["api.md", *({group: page} for group, page, _ in reference_pages())]}
    return config


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Move links, draw equations, and link citations and public names."""
    here = page.file.src_uri
    bibliography = relpath("project/references.md", dirname(here) or ".")
    made_here = here.startswith(("reference/", "examples/", "notebooks/"))

    def change(text: str) -> str:
        text = text if made_here else move_links(text, here)
        text = text if here == "project/references.md" else link_citations(text, bibliography)
        return draw_equations(text if made_here else link_names(text))

    return outside_blocks(markdown, change)


def on_page_content(html: str, *, page: Any, **_: Any) -> str:
    """Link the citations of docstrings."""
    return link_citations_of_docstrings(html) if page.file.src_uri.startswith("reference/") else html
