"""Every change stands in a file that towncrier will gather: a known kind, a name, a text for users."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["towncrier"]
KINDS = ("added", "changed", "deprecated", "removed", "fixed")
"""Those of Keep a Changelog that this project has had a use for; CONTRIBUTING.md lists them."""

NAME = re.compile(rf"(\+[a-z0-9]+(-[a-z0-9]+)*|[0-9]+)\.({'|'.join(KINDS)})\.md")


def fault(name: str, text: str) -> str | None:
    """What is wrong with a fragment of this name and text."""
    if not NAME.fullmatch(name):
        return f"{name}: the name is not +what-it-is.KIND.md with a KIND of {', '.join(KINDS)}"
    if not text.strip() or text.lstrip().startswith(("-", "*", "#")):
        return f"{name}: give a sentence for users, without a bullet or heading; towncrier sets it"
    return None


def test_every_fragment_will_be_gathered() -> None:
    found = sorted(path for path in (ROOT / SETTINGS["directory"]).iterdir() if path.name not in SETTINGS["ignore"])
    for path in found:
        assert fault(path.name, path.read_text(encoding="utf-8")) is None


@pytest.mark.parametrize(
    ("name", "text", "wrong"),
    [
        ("+new-thing.added.md", "A new thing.", False),
        ("13.fixed.md", "Mended.", False),
        ("+new-thing.add.md", "A new thing.", True),
        ("new-thing.added.md", "A new thing.", True),
        ("+New.added.md", "A new thing.", True),
        ("+new.added.txt", "A new thing.", True),
        ("+new.added.md", " ", True),
        ("+new.added.md", "- A new thing.", True),
    ],
)
def test_the_check_sees_what_is_wrong(name: str, text: str, *, wrong: bool) -> None:
    assert (fault(name, text) is not None) is wrong


def test_towncrier_knows_these_kinds_and_the_place_in_the_changelog() -> None:
    assert tuple(SETTINGS["fragment"]) == KINDS
    changelog = (ROOT / SETTINGS["filename"]).read_text(encoding="utf-8")
    assert changelog.count(SETTINGS["start_string"]) == 1
    told = " ".join((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split())
    assert all(f"`{kind}`" in told for kind in KINDS)
