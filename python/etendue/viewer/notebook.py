"""The page in a notebook, as a widget."""

from __future__ import annotations

import functools
import os
from importlib import resources
from pathlib import Path
from typing import Any, get_args

from etendue.extras import require
from etendue.quantities import arguments
from etendue.viewer.bundle import PACKAGE, page_html
from etendue.viewer.opening import Viewable, exhibit_of, open_viewable

HEIGHT = 640
"""Of the page in a notebook [CSS pixels]."""


def view(
    source: Viewable | str | os.PathLike[str],
    *,
    title: str | None = None,
    detector: str | None = None,
    rays: float | None = None,
    seed: int = 1,
    height: int = HEIGHT,
    cache: bool = True,
    threads: int | None = None,
) -> Any:
    """Show a source in a notebook, to be moved and measured: the page that `etendue view` writes, as a widget.

    Parameters
    ----------
    source : LightField, RayStream, LuminanceMap, IlluminanceMap, TraceResult, Scene or path
        Rays are fitted first; a scene is traced, and the light that leaves it is fitted on a surface around it.
    title : str, optional
        Where the source is from if not given.
    detector : str, optional
        Of the result of a trace: whose map or rays are shown.
    rays : float, optional
        Of a scene: how many are traced, 2·10⁶ if not given.
    seed : int
        Of that trace.
    height : int
        [CSS pixels]
    cache : bool
        Whether fits are taken from those made before.
    threads : int, optional
        All cores if None.

    Returns
    -------
    anywidget.AnyWidget
        Its ``page`` is the page's HTML.

    Raises
    ------
    MissingLibraryError
        If anywidget is not installed: ``pip install 'etendue[notebook]'``.
    ArgumentError
        If there is no light to be seen, or options and source do not go together.

    Examples
    --------
    >>> import etendue as et
    >>> screen = et.Screen(60, 60, 6, 6)
    >>> seen = et.luminance_map(et.RingSource(rays=5000), et.Observer(0, 0, 1000), screen, method=et.Cone(acceptance=5))
    >>> widget = et.view(seen, title="rings")
    >>> widget.title, widget.page.startswith("<!doctype html>")
    ('rings', True)
    """
    arguments.require(
        source,
        (str, os.PathLike, *get_args(Viewable)),
        "view: source",
        "a light field, rays, a map, the result of a trace, a scene, or the path of one of them",
    )
    if title is not None:
        arguments.require(title, str, "view: title", "the title of the page, or None")
    arguments.require_number(height, "view: height", "a number of CSS pixels")
    require("anywidget")
    if isinstance(source, str | os.PathLike):
        path = Path(source)
        viewable, name = open_viewable(path, detector), title or path.name
        detector = None
        file = str(path)
    else:
        viewable, file = source, None
        name = title or _name(source)
    exhibit = exhibit_of(
        viewable, name=name, file=file, detector=detector, rays=rays, seed=seed, cache=cache, threads=threads
    )
    return _widget()(page=page_html(exhibit.subject), title=name, height=int(height))


def _name(source: Any) -> str:
    """What a value is called that has not been read from a file here."""
    provenance = getattr(source, "provenance", None)
    return str(getattr(source, "name", "") or getattr(provenance, "source", "") or type(source).__name__)


@functools.cache
def _widget() -> Any:
    """The kind of widget; its library is imported when one is asked for."""
    import anywidget  # noqa: PLC0415
    import traitlets  # noqa: PLC0415

    class Viewer(anywidget.AnyWidget):  # type: ignore[misc, unused-ignore]  # the library has types or not
        """A page."""

        _esm = resources.files(PACKAGE).joinpath("widget.js").read_text("utf-8")
        page = traitlets.Unicode().tag(sync=True)
        title = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int(HEIGHT).tag(sync=True)

    return Viewer
