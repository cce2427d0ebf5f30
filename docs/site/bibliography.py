"""The bibliography as a page, and keys in brackets as links to it."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

_ENTRY = re.compile(r"^@\w+\{([^,]+),\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_FIELD = re.compile(r"^\s*(\w+)\s*=\s*\{(.*?)\},?$", re.MULTILINE)
_CITATION = re.compile(r"\[([A-Z][A-Za-z]*[0-9]{4,7}[a-z]?)\](?![\[(])")
_ACCENTS = {'"': "\u0308", "'": "\u0301", "`": "\u0300", "^": "\u0302", "~": "\u0303", "u ": "\u0306"}
_TOLD = ("editor", "journal", "booktitle", "series", "edition", "type", "number", "howpublished", "school", "institution",
         "publisher", "address", "year", "note")  # fmt: skip


def plain(text: str) -> str:
    r"""Text of a BibTeX field without its braces and commands.

    >>> plain(r'D{\"u}rr on {BSDFs}, 1--2')
    'Dürr on BSDFs, 1–2'
    """
    for command, mark in _ACCENTS.items():
        text = re.sub(r"\{?\\" + re.escape(command) + r"\{?(\w)\}?", lambda found, mark=mark: found[1] + mark, text)
    text = re.sub(r"[{}]", "", text).replace("--", "–").replace(r"\&", "&")
    return unicodedata.normalize("NFC", " ".join(text.split()))


def entries(text: str) -> dict[str, dict[str, str]]:
    """Fields of every entry by its key."""
    return {key: {name: plain(value) for name, value in _FIELD.findall(body)} for key, body in _ENTRY.findall(text)}


def _line(key: str, fields: dict[str, str]) -> str:
    author = fields.get("author", "").replace(" and ", "; ")
    told = {**fields, "edition": f"{fields['edition']} edition" if "edition" in fields else ""}
    if "journal" in fields:
        told["journal"] = f"{fields['journal']} {fields.get('volume', '')}".strip()
        told["number"] = f"no. {fields['number']}" if "number" in fields else ""
    rest = [told[name] for name in _TOLD if told.get(name)]
    if "pages" in fields:
        rest.insert(-1 if "year" in fields else len(rest), f"pp. {fields['pages']}")
    link = f" [doi:{fields['doi']}](https://doi.org/{fields['doi']})" if "doi" in fields else ""
    who = f"{author}: " if author else ""
    return f'<span id="{key.lower()}">**{key}**</span>\n:   {who}*{fields["title"]}*. {", ".join(rest)}.{link}\n'


def bibliography_page(path: Path) -> str:
    """Markdown of the page: every entry in the order of its keys."""
    found = sorted(entries(path.read_text(encoding="utf-8")).items(), key=lambda pair: pair[0].lower())
    head = "# Bibliography\n\nWhat the code and these pages cite, by the keys that stand there in brackets.\n\n"
    return head + "\n".join(_line(key, fields) for key, fields in found)


def link_citations(text: str, page: str) -> str:
    r"""Keys in brackets made links to the page of that address.

    >>> print(link_citations("A map [Audenaert2014] is", "references.md"))
    A map [\[Audenaert2014\]](references.md#audenaert2014) is
    """
    return _CITATION.sub(lambda found: rf"[\[{found[1]}\]]({page}#{found[1].lower()})", text)


def link_citations_of_docstrings(html: str) -> str:
    """The same in the HTML of a page of the reference; docstrings write ``[Key2014]_``.

    >>> link_citations_of_docstrings("drawn as in [Salmon2011]_.")
    'drawn as in <a href="../project/references.html#salmon2011">[Salmon2011]</a>.'
    """
    return re.sub(
        _CITATION.pattern + "_?",
        lambda found: f'<a href="../project/references.html#{found[1].lower()}">[{found[1]}]</a>',
        html,
    )
