"""The built site as data: what a page links to, what it loads, and its anchors."""

from __future__ import annotations

import dataclasses
import re
from html.parser import HTMLParser
from pathlib import Path

FETCHED = {"script": "src", "img": "src", "iframe": "src", "video": "src", "source": "src", "object": "data"}
"""Elements whose address a browser loads by itself. Of ``link`` those whose ``rel`` is none of these:"""
NOT_FETCHED = {"canonical", "next", "prev", "alternate", "license"}


@dataclasses.dataclass
class Page:
    """Addresses as they stand in the page."""

    anchors: list[str] = dataclasses.field(default_factory=list)
    links: list[str] = dataclasses.field(default_factory=list)
    fetched: list[str] = dataclasses.field(default_factory=list)


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.page = Page()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attrs}
        if "id" in found:
            self.page.anchors.append(found["id"])
        if tag == "a" and "href" in found:
            self.page.links.append(found["href"])
        if tag == "link" and found.get("rel", "") not in NOT_FETCHED:
            self.page.fetched.append(found["href"])
        if tag in FETCHED and FETCHED[tag] in found:
            self.page.fetched.append(found[FETCHED[tag]])
        self.page.fetched += loaded_by_style(found.get("style", ""))


def loaded_by_style(css: str) -> list[str]:
    """Addresses that a style sheet loads; data in the sheet itself is none.

    >>> loaded_by_style('@import "a.css"; p { background: url(https://b.org/c.png) }')
    ['a.css', 'https://b.org/c.png']
    """
    found = re.findall(r"@import\s+[\"']([^\"']+)|url\(\s*[\"']?([^\"')]+)", css)
    return [address for pair in found for address in pair if address and not address.startswith("data:")]


def read_page(html: str) -> Page:
    """Links, anchors and what is fetched.

    >>> read_page('<a id="top" href="x.html#y">z</a><script src="//cdn.org/s.js"></script>')
    Page(anchors=['top'], links=['x.html#y'], fetched=['//cdn.org/s.js'])
    """
    reader = _Reader()
    reader.feed(html)
    return reader.page


def is_foreign(address: str) -> bool:
    """Whether an address is one of another host.

    >>> [is_foreign(one) for one in ("//cdn.org/s.js", "http://a.org", "assets/s.js", "data:image/png;base64,x")]
    [True, True, False, False]
    """
    return re.match(r"(\w+:)?//", address) is not None


def pages_in(folder: Path) -> dict[str, Page]:
    """Every page by its address."""
    return {
        path.relative_to(folder).as_posix(): read_page(path.read_text(encoding="utf-8"))
        for path in sorted(folder.rglob("*.html"))
    }
