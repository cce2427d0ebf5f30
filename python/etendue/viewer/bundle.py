"""The page's modules, style sheet and shaders as one HTML text: no Node, no network, nothing but text put together.

Each module becomes a function that returns what it exports; an import becomes the taking of names from it. The modules keep
to what this needs: imports ``import { a, b } from "./x.js";`` and exports before ``const``, ``function``, ``async function``
or ``class``, each at the beginning of a line.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from collections.abc import Iterator
from importlib import resources
from typing import Any

PACKAGE = "etendue.viewer"
FOLDER = "page"

FIRST = "main.js"
SHADERS = "shaders.js"
"""A module that is made of the GLSL files."""

SERVER, OFFLINE = "server.js", "offline.js"
"""What talks to the program, and what stands in for it in a file of its own."""

IMPORT = re.compile(r'^import \{([^}]*)\} from "\./([\w.]+)";\n', re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:async function|function|const|class) ([\w$]+))", re.MULTILINE)


def text_of(name: str) -> str:
    """A file of the page.

    Examples
    --------
    >>> text_of("screen.vert.glsl").splitlines()[0]
    '#version 300 es'
    """
    return resources.files(PACKAGE).joinpath(FOLDER, name).read_text("utf-8")


def script(*, served: bool) -> str:
    """All modules as one script; the program behind the page is there or not.

    Examples
    --------
    >>> "fetch(" in script(served=True), "fetch(" in script(served=False)
    (True, False)
    """
    done: list[str] = []
    pieces = list(_pieces(FIRST, served, done, ()))
    return '"use strict";\n' + "\n".join(pieces)


def _pieces(name: str, served: bool, done: list[str], within: tuple[str, ...]) -> Iterator[str]:
    """A module after those that it imports, each once."""
    if name in done:
        return
    if name in within:
        raise ValueError(f"{name} imports itself through {' and '.join(within)}")
    text = _module_text(name, served)
    for match in IMPORT.finditer(text):
        yield from _pieces(match[2], served, done, (*within, name))
    exports = [match[1] for match in EXPORT.finditer(text)]
    body = EXPORT.sub("", IMPORT.sub(lambda match: f"const {{{match[1]}}} = {_variable(match[2])};\n", text))
    done.append(name)
    yield f"const {_variable(name)} = (() => {{\n{body}\nreturn {{ {', '.join(exports)} }};\n}})();"


def _variable(name: str) -> str:
    return "module_" + name.removesuffix(".js")


def _module_text(name: str, served: bool) -> str:
    if name == SHADERS:
        return f"export const SHADERS = {json.dumps(_shaders(), indent=1)};\n"
    return text_of(OFFLINE if name == SERVER and not served else name)


def _shaders() -> dict[str, str]:
    files = resources.files(PACKAGE).joinpath(FOLDER).iterdir()
    names = sorted(file.name for file in files if file.name.endswith(".glsl"))
    return {name.removesuffix(".glsl"): text_of(name) for name in names}


def policy(style: str, code: str, *, served: bool) -> str:
    """The content-security policy: this style, this script, pictures of the page's own making, and nothing else.

    Examples
    --------
    >>> policy("", "", served=False).split("; ")[0]
    "default-src 'none'"
    """
    hashes = (base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii") for text in (style, code))
    style_hash, code_hash = hashes
    rules = {
        "default-src": "'none'",
        "script-src": f"'sha256-{code_hash}'",
        "style-src": f"'sha256-{style_hash}'",
        "img-src": "data: blob:",
        "connect-src": "'self'" if served else "'none'",
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def page_html(subject: dict[str, Any], *, served: bool = False) -> str:
    """The whole page with what it shows.

    Parameters
    ----------
    subject : dict
        Plain data; see `etendue.viewer.subjects`.
    served : bool
        Whether the program is behind the page.

    Examples
    --------
    >>> page_html({"name": "LED <1>"}).splitlines()[7]
    '<title>LED &lt;1&gt; – étendue</title>'
    """
    style, code = text_of("style.css"), script(served=served)
    # "</script>" would end the element that the data stand in, wherever in them it stood.
    data = json.dumps(subject, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    filled = {
        "policy": html.escape(policy(style, code, served=served)),
        "title": html.escape(f"{subject['name']} – étendue"),
        "style": style,
        "script": code,
        "subject": data,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda match: filled[match[1]], text_of("page.html"))
