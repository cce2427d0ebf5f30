"""The page of the public names holds every name once, and is what the docstrings say today."""

from __future__ import annotations

import importlib.util
from collections import Counter
from pathlib import Path
from types import ModuleType

import etendue as et

DOCS = Path(__file__).resolve().parents[2] / "docs"


def writer() -> ModuleType:
    spec = importlib.util.spec_from_file_location("api_page", DOCS / "api_page.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_public_name_stands_in_one_group() -> None:
    assert Counter(name for names in writer().GROUPS.values() for name in names) == Counter(et.__all__)


def test_the_page_is_what_the_docstrings_say() -> None:
    told = "run `python docs/api_page.py`"
    assert (DOCS / "api.md").read_text(encoding="utf-8") == writer().page(), told
