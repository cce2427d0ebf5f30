"""The page as text: one file, in which nothing is asked of anybody, and whose policy allows nothing else."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from html.parser import HTMLParser
from importlib import resources
from typing import Any

import pytest
from etendue.viewer import bundle
from etendue.viewer.bundle import page_html, script, text_of

SUBJECT: dict[str, Any] = {"name": "a <b> & c", "note": "</script><script>alert(1)</script><!--", "unit": "cd/m²"}

CALLS = (
    "fetch(",
    "XMLHttpRequest",
    "WebSocket",
    "EventSource",
    "sendBeacon",
    "importScripts",
    "import(",
    "window.open",
    "eval(",
)
"""By which a script reaches the network, or runs what is not in the page."""


class Elements(HTMLParser):
    """All elements with their attributes and texts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None], str]] = []
        self.inside = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs), ""))
        self.inside = True

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002 - the last one that began
        self.inside = False

    def handle_data(self, data: str) -> None:
        if self.inside:
            tag, attributes, text = self.found[-1]
            self.found[-1] = (tag, attributes, text + data)

    def texts(self, tag: str) -> list[str]:
        return [text for name, _, text in self.found if name == tag]


def policy_of(elements: Elements) -> dict[str, str]:
    (text,) = [a["content"] or "" for _, a, _ in elements.found if a.get("http-equiv") == "Content-Security-Policy"]
    return dict(rule.strip().split(" ", 1) for rule in text.split(";"))  # type: ignore[arg-type, misc, return-value]


def test_a_file_of_its_own_names_nobody_and_asks_nobody() -> None:
    page = page_html(SUBJECT)
    assert not re.search(r"\b(https?|wss?|ftp)://", page)
    assert "//" not in re.sub(r"(^|\s|\\n)//.*?(?=\n|\\n|$)", "", script(served=False))  # but in comments
    for call in CALLS:
        assert call not in page, call
    outward = {"src", "href", "action", "srcset", "data", "poster", "ping"}
    elements = Elements(page)
    named = [(tag, a[name]) for tag, a, _ in elements.found for name in outward & a.keys()]
    assert named == [("link", "data:,")]  # the icon, which browsers would ask for otherwise
    assert not [name for _, a, _ in elements.found for name in a if name.startswith("on") or name == "style"]


def test_the_policy_allows_this_script_and_this_style_and_no_connection() -> None:
    elements = Elements(page_html(SUBJECT))
    policy = policy_of(elements)
    assert policy["default-src"] == "'none'"
    assert policy["connect-src"] == "'none'"
    assert policy["form-action"] == "'none'"
    (style,), (_, code) = elements.texts("style"), elements.texts("script")
    for rule, text in (("script-src", code), ("style-src", style)):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert policy[rule] == f"'sha256-{digest}'"
    assert policy_of(Elements(page_html(SUBJECT, served=True)))["connect-src"] == "'self'"


def test_data_end_no_element_and_come_back() -> None:
    """Texts of files stand in the page as data, whatever they hold."""
    elements = Elements(page_html(SUBJECT))
    data, _ = elements.texts("script")
    assert json.loads(data) == SUBJECT
    assert elements.texts("title") == ["a <b> & c – étendue"]
    assert html.escape(SUBJECT["name"]) in page_html(SUBJECT)


def test_every_file_of_the_page_is_in_it_once() -> None:
    files = {file.name for file in resources.files(bundle.PACKAGE).joinpath(bundle.FOLDER).iterdir()}
    modules = {name for name in files if name.endswith(".js")}
    for served, other in ((False, "server.js"), (True, "offline.js")):
        code = script(served=served)
        for name in modules - {other, "offline.js", "server.js"}:
            assert code.count(f"const module_{name.removesuffix('.js')} = ") == 1, name
        first = text_of("server.js" if served else "offline.js").splitlines()[0]
        assert first in code
        assert text_of(other).splitlines()[0] not in code
    shaders = {name.removesuffix(".glsl") for name in files if name.endswith(".glsl")}
    assert shaders == set(json.loads(re.search(r"SHADERS = (\{.*?\n\})", code, re.DOTALL)[1]))  # type: ignore[index]
    assert {name.rsplit(".", 1)[1] for name in files} == {"js", "glsl", "css", "html"}


@pytest.mark.parametrize("name", sorted(f.name for f in resources.files("etendue.viewer").joinpath("page").iterdir()))
def test_modules_keep_to_what_the_bundle_understands(name: str) -> None:
    """Otherwise a name would be missing, or a line of a module stand as it is where no module is."""
    if not name.endswith(".js"):
        return
    text = text_of(name)
    left = bundle.EXPORT.sub("", bundle.IMPORT.sub("", text))
    assert not re.search(r"^\s*(import|export)\b", left, re.MULTILINE)
    assert "\r" not in text
    for match in bundle.IMPORT.finditer(text):
        exported = {m[1] for m in bundle.EXPORT.finditer(bundle._module_text(match[2], served=True))}
        wanted = {one.strip() for one in match[1].split(",") if one.strip()}
        assert wanted <= exported, (match[2], wanted - exported)
        assert all(re.search(rf"(?<![\w$]){re.escape(one)}(?![\w$])", text[match.end() :]) for one in wanted)


def test_a_circle_of_modules_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    texts = {
        "main.js": 'import { a } from "./a.js";\n',
        "a.js": 'import { b } from "./main.js";\nexport const a = 1;\n',
    }
    monkeypatch.setattr(bundle, "_module_text", lambda name, served: texts[name])  # noqa: ARG005
    with pytest.raises(ValueError, match=r"main\.js imports itself"):
        script(served=False)
