"""The gallery shows what the examples say of themselves."""

from __future__ import annotations

import importlib.util
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_gallery_is_what_the_examples_say() -> None:
    """Run ``python docs/gallery_page.py`` after changes of docstrings; at least sixteen examples are in it."""
    spec = importlib.util.spec_from_file_location("gallery_page", ROOT / "docs" / "gallery_page.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8") == module.page()
    assert len(module.SHOWN) >= 16
    for name, picture in module.SHOWN.items():
        assert (ROOT / "examples" / f"{name}.py").is_file()
        assert (ROOT / "docs" / "figures" / picture).is_file()
