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

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import etendue as et
    >>> from etendue.viewer.opening import exhibit_of
    >>> desk = et.IlluminanceMap([[500.0]], [[5.0]], [[900]], et.Screen(20, 10, 1, 1, "xy"))
    >>> with TemporaryDirectory() as folder:
    ...     write_page(exhibit_of(desk, name="desk"), Path(folder) / "desk.html")
    ...     (Path(folder) / "desk.html").stat().st_size < 200_000
    True
    """
    text = page_html(exhibit.subject)
    with atomic_output(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
