"""XML files of strangers as a small tree: no document type, so no entities; bounded in size, depth and number.

Expat of the standard library parses; everything by which an XML text can grow or reach outside itself is declared in a
document type (XML 1.0, section 2.8), and a file that has one is refused.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Never
from xml.parsers import expat

from etendue.errors import FormatError

MOST_ELEMENTS = 1 << 20
"""A table of 0.5° by 0.25° over the whole sphere has half as many."""

MOST_LEVELS = 64
ADVICE = "The file is damaged or cut short, or no such file; ask for it again."


@dataclasses.dataclass(slots=True)
class Element:
    """An element with its attributes, text and children; names without their namespaces.

    Parameters
    ----------
    name : str
    attributes : mapping
    line : int
        Where it starts, counted from 1.
    text : str
        Its own, without that of its children, stripped.
    children : list of Element
    """

    name: str
    attributes: dict[str, str]
    line: int
    text: str = ""
    children: list[Element] = dataclasses.field(default_factory=list)

    @property
    def place(self) -> str:
        """For messages."""
        return f"line {self.line}, {self.name}"

    def all(self, name: str) -> list[Element]:
        """Children of that name."""
        return [child for child in self.children if child.name == name]

    def first(self, *path: str) -> Element | None:
        """The first child of that name, its first child of the next one, and so on; None if there is none."""
        found: Element | None = self
        for name in path:
            found = next((child for child in found.children if child.name == name), None) if found else None
        return found

    def words(self, *path: str) -> str:
        """The text there, blanks and line ends as one blank; empty if there is no such element."""
        found = self.first(*path)
        return " ".join(found.text.split()) if found else ""

    def everything(self) -> Iterator[Element]:
        """The element itself and all below it."""
        stack = [self]
        while stack:
            element = stack.pop()
            yield element
            stack.extend(reversed(element.children))


def parse_xml(data: bytes, path: object, part: str = "") -> Element:
    """The root of an XML text.

    Parameters
    ----------
    data : bytes
        The whole of it, in any encoding that expat knows.
    path : path
        For messages.
    part : str
        Of the file, for messages; empty if the text is the file.

    Raises
    ------
    FormatError
        If it is not well formed, has a document type, or is too deep or too large.
    """
    before = f"{part}, " if part else ""
    parser = expat.ParserCreate()
    parser.buffer_text = True
    open_elements: list[Element] = []
    texts: list[list[str]] = []
    roots: list[Element] = []
    count = 0

    def refuse(found: str, advice: str = ADVICE) -> Never:
        raise FormatError(path, f"{before}line {parser.CurrentLineNumber}", found, advice)

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MOST_ELEMENTS:
            refuse(f"more than {MOST_ELEMENTS:,} elements", "No distribution needs so many.")
        if len(open_elements) >= MOST_LEVELS:
            refuse(f"elements within elements, {MOST_LEVELS} deep", "No distribution is nested so deeply.")
        element = Element(name.rpartition(":")[2], attributes, parser.CurrentLineNumber)
        (open_elements[-1].children if open_elements else roots).append(element)
        open_elements.append(element)
        texts.append([])

    def end(_: str) -> None:
        open_elements.pop().text = "".join(texts.pop()).strip()

    def text(found: str) -> None:
        if texts:
            texts[-1].append(found)

    def document_type(*_: object) -> None:
        refuse("a document type declaration", "Such files can grow without bound; ask for one without <!DOCTYPE …>.")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.StartDoctypeDeclHandler = document_type
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise FormatError(path, f"{before}line {error.lineno}", f"no XML: {reason}", ADVICE) from None
    except (LookupError, ValueError) as error:
        raise FormatError(path, f"{before}first line", f"no encoding that can be read: {error}", ADVICE) from None
    return roots[0]
