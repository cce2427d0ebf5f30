"""The documentation as data: pages, fenced blocks, links."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

PAGES = [
    *sorted((ROOT / "docs").rglob("*.md")),
    *(
        ROOT / name
        for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "benchmarks/README.md")
    ),
]

_FENCE = re.compile(r" {0,3}(`{3,}|~{3,})\s*(.*)")
_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


@dataclasses.dataclass(frozen=True)
class Block:
    """A fenced block: the word after the fence, its text, and the number of its first line."""

    language: str
    text: str
    line: int


def name_of(page: Path) -> str:
    """A page's path from the root, for messages."""
    return page.relative_to(ROOT).as_posix()


def split(text: str) -> tuple[str, list[Block]]:
    """Prose and fenced blocks of a page.

    >>> split("a\\n```python\\n1 + 1\\n```\\nb")
    ('a\\nb', [Block(language='python', text='1 + 1\\n', line=3)])
    """
    prose: list[str] = []
    blocks: list[Block] = []
    held: list[str] = []
    fence, language, first = "", "", 0
    for number, line in enumerate(text.splitlines(), 1):
        match = _FENCE.fullmatch(line)
        if not fence and match:
            fence, language, first, held = match[1], match[2].strip(), number + 1, []
        elif fence and match and match[1].startswith(fence) and not match[2]:
            blocks.append(Block(language, "".join(f"{held_line}\n" for held_line in held), first))
            fence = ""
        elif fence:
            held.append(line)
        else:
            prose.append(line)
    if fence:
        raise ValueError(f"line {first - 1}: the fenced block is not closed")
    return "\n".join(prose), blocks


def prose(page: Path) -> str:
    """A page without its fenced blocks."""
    return split(page.read_text(encoding="utf-8"))[0]


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page, in order."""
    return split(page.read_text(encoding="utf-8"))[1]


def links(page: Path) -> Iterator[str]:
    """Targets of a page's links and images; code is none."""
    yield from _LINK.findall(re.sub(r"`[^`]*`", "", prose(page)))


def anchors(page: Path) -> set[str]:
    """The names by which the headings of a page can be reached, as GitHub makes them."""
    headings = re.findall(r"^#+ +(.*)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
