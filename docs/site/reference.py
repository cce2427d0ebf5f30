"""Pages of the public names: one for each group of ``docs/api_page.py``, written by mkdocstrings from the docstrings."""

from __future__ import annotations

import importlib.util
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import etendue as et

_CODE = re.compile(r"(?<!\[)`et\.(\w+)`")


def _groups() -> dict[str, tuple[str, ...]]:
    spec = importlib.util.spec_from_file_location("api_page", Path(__file__).parents[1] / "api_page.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    groups: dict[str, tuple[str, ...]] = module.GROUPS
    return groups


GROUPS = _groups()


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
    yield f"## `et.{name}` {{ #{name} }}"
    yield ""
    yield f"::: {home_of(name)}"
    yield "    options:"
    yield "      show_root_heading: false"
    yield "      show_root_toc_entry: true"
    yield "      heading_level: 3"
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
