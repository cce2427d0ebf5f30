"""How values show themselves in notebooks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple


class Pages(NamedTuple):
    """What makes the pages: a function of a higher floor, which this one cannot import.

    Parameters
    ----------
    of : callable
        From a value to HTML.

    Examples
    --------
    >>> Pages(of=lambda value: f"<b>{value}</b>").of(3)
    '<b>3</b>'
    """

    of: Callable[[Any], str]


class InNotebook:
    """A value that a notebook shows as a picture, its main facts and its notes.

    Examples
    --------
    >>> import etendue as et
    >>> page = et.Intensity(c=[0], gamma=[0, 90], values=[[1.0, 0.0]], notes=("dim",))._repr_html_()
    >>> "<img " in page, "<li>dim</li>" in page
    (True, True)
    """

    pages: ClassVar[Pages]
    """Set once, by the package itself (`etendue/__init__.py`), which alone knows all floors."""

    def _repr_html_(self) -> str | None:
        """The page; None, upon which notebooks show the text of the value, if there cannot be one."""
        try:
            return self.pages.of(self)
        except Exception:  # noqa: BLE001 - to show a value never fails
            return None
