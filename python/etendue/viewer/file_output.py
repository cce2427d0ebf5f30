"""A page as one file, which needs nothing else: it can be mailed, and opens by double click."""

from __future__ import annotations

from pathlib import Path

from etendue.formats.output import atomic_output
from etendue.viewer.bundle import page_html
from etendue.viewer.opening import Exhibit

PAGE_EXTENSIONS = (".html", ".htm")


def write_page(exhibit: Exhibit, path: Path) -> None:
    """Write the page, whole or not at all.

    Parameters
    ----------
    exhibit : Exhibit
        What it shows.
    path : Path
        Of a folder that exists.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    text = page_html(exhibit.subject)
    with atomic_output(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
