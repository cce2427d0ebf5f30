"""Values as notebooks show them: a line of words, a picture or a table, and the notes."""

from __future__ import annotations

import base64
import functools
import html
import io
import math
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from etendue.lightfield.light_field import LightField
from etendue.luminance.estimate import luminance_map
from etendue.luminance.methods import FromField
from etendue.plot import style
from etendue.plot.intensity_picture import plot_intensity
from etendue.plot.map_picture import plot_map
from etendue.plot.scene_layout import lay_out_scene
from etendue.plot.scene_picture import plot_layout
from etendue.plot.sweep_picture import plot_sweep
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.pixel_map import PixelMap
from etendue.quantities.powers_of_ten import counted
from etendue.quantities.printable import printable
from etendue.quantities.ray_set import RaySet
from etendue.scene import Scene
from etendue.sweeps.table import SweepTable
from etendue.tracing.result import TraceResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 110
"""Of pictures: sharp enough, and some ten kilobytes."""

CSS_INCH = 96
"""Pixels of an inch in a browser."""

QUICK_RAYS = 1_000_000
"""Rays in memory that are added up for a page."""

QUICK_THINGS, QUICK_BYTES = 1000, 100_000_000
"""Sources, solids and surfaces of a scene, and bytes of its files, up to which it is drawn for a page."""

Row = tuple[str, str]


def notebook_page(value: Any) -> str:
    """The page of a value, as HTML.

    Examples
    --------
    >>> from etendue.quantities.provenance import Provenance
    >>> lmap = LuminanceMap([[3.0, 1.0]], [[0.1, 0.1]], [[900, 300]], Observer(0, 0, 1000), Screen(2, 1, 2, 1),
    ...                     provenance=Provenance("<b>"), notes=("one pixel & another",))
    >>> page = notebook_page(lmap)
    >>> "&lt;b&gt;" in page, "<li>one pixel &amp; another</li>" in page, "data:image/png;base64," in page
    (True, True, True)
    """
    words = repr(value).removeprefix("<").removesuffix(">")
    return f"<div><p><strong>{_text(words)}</strong></p>{''.join(_parts(value))}</div>"


@functools.singledispatch
def _parts(value: Any) -> Iterable[str]:
    """What stands below the first line."""
    raise TypeError(f"{type(value).__name__} has no page")


@_parts.register
def _(value: PixelMap) -> Iterator[str]:
    yield _picture(value.plot, value)
    yield _notes(value.notes)


@_parts.register
def _(value: Intensity) -> Iterator[str]:
    yield _picture(lambda: plot_intensity(value), value)
    yield _notes((*value.notes, *map(str, value.complaints)))


@_parts.register
def _(value: LightField) -> Iterator[str]:
    report = value.report
    yield _picture(lambda: plot_map(_seen(value), title="Light field"), value)
    yield _table(
        [
            ("surface", str(value.surface.spec)),
            ("flux", counted(value.total_flux, value.flux_unit)),
            ("rays", f"{report.rays - report.unmet_rays:,}"),
            ("held-out score", report.score_text),
        ]
    )
    yield _notes(value.notes)


@_parts.register
def _(value: RaySet) -> Iterator[str]:
    yield _table(_ray_facts(value))
    quick = len(value) <= QUICK_RAYS
    yield _notes(map(str, value.complaints) if quick else value.notes)


@_parts.register
def _(value: Scene) -> Iterator[str]:
    things = sum(len(family) for family in (value.sources, value.solids, value.surfaces))
    size = sum(path.stat().st_size for path in value.read_files() if path.is_file())
    if things > QUICK_THINGS or size > QUICK_BYTES:
        yield "<p>Large; draw_scene draws it.</p>"
        return
    notes: list[str] = []

    def drawn() -> Figure:
        layout = lay_out_scene(value)
        notes.extend(layout.compiled.notes)
        return plot_layout(layout)

    yield _picture(drawn, value)
    yield _notes(notes)


@_parts.register
def _(value: TraceResult) -> Iterator[str]:
    ledger = value.ledger
    total = ledger.total.flux or 1.0
    rows = [
        (
            f"{'&emsp;' * depth}{_text(name)}",
            counted(entry.flux, ledger.flux_unit),
            f"{entry.flux / total:.2%}",
            f"{entry.rays:,}",
        )
        for depth, name, entry in ledger.rows()
    ]
    head = "".join(f"<th>{title}</th>" for title in ("", "flux", "share", "rays"))
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    yield f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    detections = value.plan.detections
    if detections:
        yield f"<p>detectors: {_text(', '.join(f'{d.name} ({d.KIND})' for d in detections))}</p>"
    yield _notes(value.notes)


@_parts.register
def _(value: SweepTable) -> Iterator[str]:
    yield _picture(lambda: plot_sweep(value), value)
    yield _notes(value.notes)


def _seen(field: LightField) -> LuminanceMap:
    """The field from the front, or from behind if that is dark."""
    parts = field.surface.parts()
    target = np.mean([part.centre for part in parts], axis=0)
    reach = 1.05 * max(math.dist(part.centre, target) + math.hypot(*part.size) for part in parts)
    screen = Screen(2.0 * reach, 2.0 * reach, 96, 96)
    x, y, z = target.tolist()
    for theta in (30.0, 150.0):
        lmap = luminance_map(field, Observer(theta, 0.0, 20.0 * reach, (x, y, z)), screen, method=FromField(samples=4))
        if lmap.values.any():
            break
    return lmap


def _ray_facts(rays: RaySet) -> Iterator[Row]:
    yield "rays", f"{len(rays):,}"
    if len(rays) <= QUICK_RAYS:
        yield "flux", counted(rays.total_flux, rays.flux_unit)
    elif isinstance(stated := rays.header.get("total_flux"), float):
        yield "flux stated by the file", counted(stated, rays.flux_unit)
    if len(rays) <= QUICK_RAYS and rays.has_position:
        low, high = rays.position.min(axis=0), rays.position.max(axis=0)
        for axis, first, last in zip("xyz", low, high, strict=True):
            yield axis, f"{first:.5g} to {last:.5g} mm"
    if rays.columns:
        yield "further columns", ", ".join(rays.columns)
    yield "format", rays.provenance.format
    for step in rays.provenance.steps:
        yield "made by", step


# --- HTML --------------------------------------------------------------------------------------------------------------


def _picture(draw: Callable[[], Figure], value: object) -> str:
    """A figure as an image within the page; why there is none, if there is none."""
    try:
        figure = draw()
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=DPI, metadata=style.FILE_TYPES[".png"])
        width = round(figure.get_figwidth() * CSS_INCH)
    except Exception as error:  # noqa: BLE001 - the words remain
        return f"<p>No picture: {_text(str(error))}</p>"
    coded = base64.b64encode(stream.getvalue()).decode("ascii")
    return f'<img width="{width}" alt="{_text(repr(value))}" src="data:image/png;base64,{coded}">'


def _table(rows: Iterable[Row]) -> str:
    body = "".join(f"<tr><th>{_text(name)}</th><td>{_text(text)}</td></tr>" for name, text in rows)
    return f"<table><tbody>{body}</tbody></table>"


def _notes(notes: Iterable[str]) -> str:
    items = "".join(f"<li>{_text(note)}</li>" for note in notes)
    return f"<ul>{items}</ul>" if items else ""


def _text(text: str) -> str:
    """As HTML shows it, letter by letter."""
    return html.escape(printable(text))
