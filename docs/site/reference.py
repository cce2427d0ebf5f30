"""Pages of the public names: one for each group of ``docs/api_page.py``, written by mkdocstrings from the docstrings."""

from __future__ import annotations

import inspect
import re
import runpy
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import etendue as et

_CODE = re.compile(r"(?<!\[)`et\.(\w+)`")


GROUPS: dict[str, tuple[str, ...]] = runpy.run_path(str(Path(__file__).parents[1] / "api_page.py"))["GROUPS"]


def page_of(group: str) -> str:
    """Address of a group's page.

    >>> page_of("Light fields")
    'reference/light-fields.md'
    """
    return f"reference/{group.lower().replace(' ', '-')}.md"


def home_of(name: str) -> str:
    """Where a public name is defined, which is its anchor.

    >>> home_of("Observer")
    'etendue.quantities.observer.Observer'
    """
    value = getattr(et, name)
    return value.__name__ if isinstance(value, ModuleType) else f"{value.__module__}.{value.__qualname__}"


def _entry(name: str) -> Iterator[str]:
    value = getattr(et, name)
    yield f"::: {home_of(name)}"
    yield "    options:"
    yield f"      heading: et.{name}"
    yield f"      toc_label: et.{name}"
    if isinstance(value, ModuleType):
        members = [one for one in vars(value) if not one.startswith("_") and inspect.isclass(getattr(value, one))]
        yield f"      members: [{', '.join(members)}]"
    yield ""


def reference_pages() -> Iterator[tuple[str, str, str]]:
    """Group, address and Markdown of every page."""
    for group, names in GROUPS.items():
        lines = [f"# {group}", "", *(line for name in names for line in _entry(name))]
        yield group, page_of(group), "\n".join(lines)


def link_names(text: str) -> str:
    """Public names in code made references to their entries, which autorefs resolves.

    >>> link_names("`et.Observer` and `et.nothing`")
    '[`et.Observer`][etendue.quantities.observer.Observer] and `et.nothing`'
    """
    known = set(et.__all__)
    return _CODE.sub(lambda code: f"[{code[0]}][{home_of(code[1])}]" if code[1] in known else code[0], text)
