"""Values in notebooks: a picture or a table, all notes, no mark-up of strangers, and never an exception."""

from __future__ import annotations

import base64
import re
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.quantities.provenance import Provenance
from oracles.light_fields import SURFACES, make_field
from oracles.map_files import make_map

FOREIGN = "<script>alert(1)</script>&\x1b[2J"
"""A name that would be a program if it were not shown letter by letter."""

ORIGIN = Provenance(source=FOREIGN)


def scene() -> et.Scene:
    return et.Scene(
        name=FOREIGN,
        sources=[{"name": FOREIGN, "kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}],
        surfaces=[
            {
                "name": "half",
                "shape": {"kind": "rectangle", "width": 1e3, "height": 2e3},
                "at": [500, 0, 1],
                "finish": "absorber",
            }
        ],
        detectors=[{"kind": "intensity", "name": FOREIGN, "c_planes": 4, "gamma_step": 10}],
    )


def illuminance() -> et.IlluminanceMap:
    grid, screen = np.ones((2, 2)), et.Screen(2, 1, 2, 2, "xy")
    return et.IlluminanceMap(grid, grid, grid, screen, provenance=ORIGIN, notes=(FOREIGN,))


def lambertian() -> et.Intensity:
    table = [np.cos(np.radians(range(91)))]
    return et.Intensity(c=[0], gamma=range(91), values=table, provenance=ORIGIN, notes=(FOREIGN,))


def rays(count: int = 1) -> et.RaySet:
    up = np.tile([0.0, 0.0, 1.0], (count, 1))
    return et.RaySet(up, up, np.ones(count), provenance=ORIGIN)


VALUES: dict[str, tuple[bool, Callable[[], Any]]] = {
    "LuminanceMap": (True, lambda: make_map().replace(provenance=ORIGIN, notes=(FOREIGN,))),
    "IlluminanceMap": (True, illuminance),
    "Intensity": (True, lambertian),
    "LightField": (True, lambda: make_field(SURFACES["dome"]).replace(provenance=ORIGIN, notes=(FOREIGN,))),
    "RaySet": (False, rays),
    "Scene": (True, scene),
    "TraceResult": (False, lambda: et.trace(scene(), rays=10_000)),
}
"""Each with whether its page has a picture."""


class Reader(HTMLParser):
    """Tags, texts, and the pictures of a page; refuses tags that do not match."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[str] = []
        self.open: list[str] = []
        self.texts: list[str] = []
        self.pictures: list[bytes] = []
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag == "img":
            found = re.fullmatch(r"data:image/png;base64,(.*)", dict(attrs)["src"] or "")
            assert found
            self.pictures.append(base64.b64decode(found[1], validate=True))
        else:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


@pytest.mark.slow
@pytest.mark.parametrize("which", VALUES)
def test_pages_hold_what_they_should(which: str) -> None:
    pictured, make = VALUES[which]
    value = make()
    page = value._repr_html_()
    read = Reader(page)
    assert "script" not in read.tags
    assert "\x1b" not in page
    assert any("<script>" in text for text in read.texts)
    assert [picture[:4] for picture in read.pictures] == [b"\x89PNG"] * pictured
    assert len(page) < 400_000
    assert len(getattr(value, "notes", ())) <= read.tags.count("li")


def test_the_account_of_a_trace_is_a_table() -> None:
    """Every row of the ledger, with its flux."""
    result = et.trace(scene(), rays=10_000)
    texts = Reader(result._repr_html_()).texts
    for _, name, entry in result.ledger.rows():
        at = next(i for i, text in enumerate(texts) if text.strip("\u2003") == name.replace("\x1b", "\\x1b"))
        assert texts[at + 1].startswith(f"{entry.flux:.4g} lm")


def test_large_ray_sets_are_not_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("etendue.plot.notebook.QUICK_RAYS", 9)
    assert "flux" in Reader(rays(9)._repr_html_()).texts
    ten = rays(10)
    assert "flux" not in Reader(ten._repr_html_()).texts
    assert ten._tally is None


def test_large_scenes_are_not_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("etendue.plot.notebook.QUICK_THINGS", 1)
    assert Reader(scene()._repr_html_()).pictures == []


def test_a_scene_that_cannot_be_drawn_says_why(tmp_path: Path) -> None:
    lost = et.Scene(solids=[{"shape": {"kind": "mesh", "file": str(tmp_path / "gone.stl")}, "medium": "PMMA"}])
    read = Reader(lost._repr_html_())
    assert read.pictures == []
    assert any("gone.stl" in text for text in read.texts)


@pytest.mark.parametrize("which", VALUES)
def test_without_matplotlib_the_words_remain(which: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pictured, make = VALUES[which]
    value = make()
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.setitem(sys.modules, name, None)
    read = Reader(value._repr_html_())
    assert read.pictures == []
    assert any("etendue[plot]" in text for text in read.texts) is pictured


def test_whatever_happens_the_text_remains(monkeypatch: pytest.MonkeyPatch) -> None:
    """None tells notebooks to show the text of the value."""

    def broken(_value: object) -> str:
        raise RuntimeError("out of ink")

    monkeypatch.setattr("etendue.plot.notebook._notes", broken)
    assert make_map()._repr_html_() is None
