"""A source on a page that an engineer signs: facts, complaints, maps on one scale, intensity, what more rays would bring."""

from __future__ import annotations

import base64
import io
import math
import os
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from etendue.errors import UnknownNameError
from etendue.formats.output import atomic_output
from etendue.luminance.source_report import SourceReport
from etendue.plot import style
from etendue.plot.colour_scale import choose_scale, colour_map, normalisation
from etendue.plot.intensity_picture import plot_intensity
from etendue.plot.map_picture import axis_names, draw_colour_bar, draw_screen, plot_map
from etendue.quantities.arguments import require, require_path
from etendue.quantities.measured import measured
from etendue.quantities.observer import Observer
from etendue.quantities.printable import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

A4 = (8.27, 11.69)
"""[inches]"""

MARGIN = 0.55
LINE = 0.145

HEADING = 14.0
"""Size of the type of the title."""

SIDE = 1.42
"""Of the picture of a map [inches]."""

MOST_VIEWS = 4
"""Maps on the page; the others stand in its table only."""

FACT_LINES, COMPLAINT_LINES, NOTE_LINES = 20, 6, 5
"""Room for the facts and the complaints; a page of HTML has them all."""

OF_SURFACE = ("carrier surface", "depths between")
"""How notes begin that tell how the surface of the light field was chosen."""

MOST_ROWS = 6
"""Of the table of views."""

LEAST = 1e-4
"""Share of the flux above which a zone is worth a line."""

END = 0.62
"""Height of the page's last line but the signature [inches]."""

SMALL = style.CAPTION_SIZE - 1.0
"""Size of the type of the zones."""

GAP = 0.06
"""Between the angles of a zone and its flux [inches]; between two columns it is more."""

LOW = 0.9
"""Height of the polar diagram where there is little room [inches]."""

SIGNED = ("date", "name", "signature")

PAGE_TYPES = (".html", ".pdf", ".png", ".svg")


def plot_report(report: SourceReport, path: str | os.PathLike[str] | None = None) -> Figure:
    """Draw a report of a source on a page of A4; as .html its text is text, and the file needs nothing else.

    Parameters
    ----------
    report : SourceReport
        Of `etendue.report_source`.
    path : path, optional
        Where to write it, .html, .pdf, .png or .svg. The same report gives the same bytes.

    Returns
    -------
    matplotlib.figure.Figure
        The page, not registered with pyplot.

    Raises
    ------
    UnknownNameError
        If the extension of `path` is none of these.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> import etendue as et
    >>> report = et.report_source(et.RingSource(rays=20_000).ray_set(), surface=et.Disk(radius=30), forecast=False)
    >>> [f"{side:.2f}" for side in plot_report(report).get_size_inches()]
    ['8.27', '11.69']
    """
    require(report, SourceReport, "plot_report: report", "what et.report_source(rays) gives")
    if path is not None:
        require_path(path, "plot_report: path", "the path of the page, or None")
    suffix = None if path is None else Path(path).suffix.lower()
    if suffix is not None and suffix not in PAGE_TYPES:
        raise UnknownNameError("extension of a report", suffix, PAGE_TYPES)
    figure = style.new_figure(*A4)
    y = A4[1] - 0.62
    room = A4[0] - 2 * MARGIN - style.width_of(report.subtitle, style.LABEL_SIZE) - 0.2
    title = style.shortened(report.title, int(room / style.width_of("0", 1.15 * HEADING)))
    style.add_text(figure, MARGIN, y, title, size=HEADING, color=style.INK, weight="bold")
    style.add_text(figure, A4[0] - MARGIN, y, report.subtitle, size=style.LABEL_SIZE, color=style.FAINT, ha="right")
    foot = _write_facts(figure, report, y - 0.3)
    y = min(foot, _write_words(figure, report, y - 0.3, foot)) - 0.2
    y = _draw_maps(figure, report, y)
    y = _write_views(figure, report, y)
    _draw_intensity(figure, report, y)
    _write_end(figure, report)
    if suffix == ".html":
        style.finish(figure, None)
        with atomic_output(Path(str(path))) as temporary:
            Path(temporary).write_text(report_html(report), encoding="utf-8")
        return figure
    return style.finish(figure, path)


def _lines(figure: Figure, x: float, y: float, lines: Sequence[str], colour: str = style.INK) -> float:
    for line in lines:
        style.add_text(figure, x, y, style.regrouped(line), size=style.CAPTION_SIZE, color=colour)
        y -= LINE
    return y


def _heading(figure: Figure, x: float, y: float, text: str) -> float:
    style.add_text(figure, x, y, text, size=style.LABEL_SIZE, color=style.INK, weight="bold")
    return y - 1.15 * LINE


def _write_facts(figure: Figure, report: SourceReport, y: float) -> float:
    """The file's facts, on the left half."""
    y = _heading(figure, MARGIN, y, "Rays")
    rows = [(label, style.wrapped([text], 2.75)[:2]) for label, text in report.facts]
    shown = _that_fit([len(lines) for _, lines in rows], FACT_LINES)
    for label, lines in rows[:shown]:
        style.add_text(figure, MARGIN, y, label, size=style.CAPTION_SIZE, color=style.FAINT)
        y = _lines(figure, MARGIN + 0.95, y, lines)
    return _lines(figure, MARGIN, y, _rest(len(rows) - shown), style.FAINT)


def _write_words(figure: Figure, report: SourceReport, y: float, foot: float) -> float:
    """Complaints, what the field resolves, and as many notes as have room beside the facts, on the right half."""
    x, wide = A4[0] / 2 + 0.2, A4[0] / 2 - MARGIN - 0.2
    y = _heading(figure, x, y, "Complaints" if report.complaints else "Complaints: none")
    wrapped = [style.wrapped([line], wide)[:3] for line in report.complaints]
    shown = _that_fit([len(lines) for lines in wrapped], COMPLAINT_LINES)
    for lines in wrapped[:shown]:
        y = _lines(figure, x, y, lines)
    y = _lines(figure, x, y, _rest(len(wrapped) - shown), style.FAINT)
    y = _heading(figure, x, y - 0.5 * LINE, "Light field")
    for line in report.quality_lines:
        # What only those ask for who know the estimator stands in the page of HTML.
        if "nat per ray" not in line and "degrees of freedom" not in line:
            y = _lines(figure, x, y, style.wrapped([line], wide))
    room = int((y - foot) / LINE) - 2
    # What may be wrong with the light goes first.
    ordered = sorted(report.notes, key=lambda note: note.startswith(OF_SURFACE))
    # Where some are left out, a line says so.
    notes = [_cut(style.wrapped([note], wide), min(NOTE_LINES, max(room - 1, 1))) for note in ordered]
    lengths = [len(lines) for lines in notes]
    shown = len(notes) if sum(lengths) <= room else _that_fit(lengths, room - 1)
    if not shown and notes:
        y = _lines(figure, x, y - 0.5 * LINE, [f"notes: {len(notes)}, in the page of HTML"], style.FAINT)
    if shown:
        y = _heading(figure, x, y - 0.5 * LINE, "Notes")
        for lines in notes[:shown]:
            y = _lines(figure, x, y, lines)
        y = _lines(figure, x, y, _rest(len(notes) - shown), style.FAINT)
    return y


def _cut(lines: Sequence[str], most: int) -> list[str]:
    """The first lines of a note, and dots if there are more.

    >>> _cut(["one", "two", "three"], 2), _cut(["word"], 2)
    (['one', 'two …'], ['word'])
    """
    return list(lines) if len(lines) <= most else [*lines[: most - 1], f"{lines[most - 1]} …"]


def _that_fit(lengths: Sequence[int], room: int) -> int:
    """How many of the paragraphs, first ones first, have room [lines].

    >>> _that_fit([2, 1, 3], 5), _that_fit([], 5)
    (2, 0)
    """
    ends = np.cumsum(lengths)
    return int((ends <= room).sum())


def _rest(number: int) -> list[str]:
    """What is said of those that had no room."""
    return [f"and {number} more: see the page of HTML, or etendue info"] if number else []


def _draw_maps(figure: Figure, report: SourceReport, y: float) -> float:
    """The first maps side by side on one scale, with their colour bar."""
    shown = report.maps[:MOST_VIEWS]
    y = _heading(figure, MARGIN, y, f"{shown[0].quantity.capitalize()}, one scale")
    values = np.concatenate([lmap.values.ravel() for lmap in shown])
    errors = np.concatenate([lmap.standard_error.ravel() for lmap in shown])
    chosen = choose_scale(values, "auto")
    norm = normalisation(values, chosen.name, None, None, errors)
    gap = (A4[0] - 2 * MARGIN - 0.35 - MOST_VIEWS * SIDE) / (MOST_VIEWS - 1)
    image = None
    for number, lmap in enumerate(shown):
        high = SIDE * lmap.screen.height / lmap.screen.width
        x = MARGIN + 0.35 + number * (SIDE + gap)
        axes = style.add_axes(figure, x, y - SIDE - 0.1, SIDE, high)
        image = draw_screen(
            axes, lmap.values, lmap.screen, colour_map("value", None), norm, (SIDE, high), axis_names(lmap)
        )
        axes.xaxis.label.set_fontsize(style.TICK_SIZE)
        axes.yaxis.label.set_fontsize(style.TICK_SIZE)
        if number:
            axes.set_ylabel("")
        style.add_text(figure, x, y - 0.06, _where(lmap.observer), size=style.TICK_SIZE, color=style.INK)
    y -= SIDE + 0.62
    if image is not None:
        bar = style.add_axes(figure, MARGIN + 0.35, y, A4[0] - 2 * MARGIN - 0.35, 0.09)
        draw_colour_bar(image, values, shown[0].quantity, shown[0].unit, bar)
        bar.xaxis.label.set_fontsize(style.TICK_SIZE)
    return y - 0.62


def _write_views(figure: Figure, report: SourceReport, y: float) -> float:
    """The table of the observers."""
    rows = report.view_rows()
    places = [0.0, 0.5, 1.0, 3.3, 4.9]
    for place, (label, _) in zip(places, rows[0], strict=True):
        style.add_text(figure, MARGIN + place, y, label, size=style.CAPTION_SIZE, color=style.FAINT)
    for row in rows[:MOST_ROWS]:
        y -= LINE
        for place, (_, text) in zip(places, row, strict=True):
            style.add_text(figure, MARGIN + place, y, text, size=style.CAPTION_SIZE, color=style.INK)
    first = report.maps[0]
    where = ", ".join(f"{c:g}" for c in first.observer.target)
    size = f"{first.screen.width:g} × {first.screen.height:g} mm, {first.screen.columns} × {first.screen.rows} pixels"
    more = f"and {len(rows) - MOST_ROWS} other views; " if len(rows) > MOST_ROWS else ""
    seen = f"{more}screen {size} through ({where}) mm; distance {first.observer.distance:g} mm"
    return _lines(figure, MARGIN, y - 1.2 * LINE, [seen], style.FAINT)


def _draw_intensity(figure: Figure, report: SourceReport, y: float) -> None:
    """The polar diagram on the left, its figures on the right, between `y` and the foot of the page."""
    half, foot = A4[0] / 2 - MARGIN, 1.35
    axes = style.add_axes(figure, MARGIN, foot + 0.45, half - 0.2, max(y - foot - 0.75, LOW))
    plot_intensity(report.intensity, ax=axes, title=report.intensity.quantity.capitalize())
    x = A4[0] / 2 + 0.2
    words = [line for text in report.sheet.lines() for line in style.wrapped([text], half - 0.2)]
    y = _lines(figure, x, _heading(figure, x, y - 0.22, "As a data sheet has it"), words) - 0.5 * LINE
    _write_zones(figure, report, (x, y))


def _write_zones(figure: Figure, report: SourceReport, place: tuple[float, float]) -> None:
    """The flux of zones that have light, in up to three columns, as their numbers and the room above the end allow."""
    # Of the rest a page of HTML tells.
    lit = [zone for zone in report.sheet.zones if zone[2] > LEAST * report.intensity.flux]
    most = max((flux for _, _, flux, _ in lit), default=1.0)
    # Numbers from 1 to 1 000 are short.
    power = 0 if 1.0 <= most < 1e5 else 3 * math.floor(math.log10(most) / 3.0)
    unit = style.in_powers(report.intensity.flux_unit, power)
    x, y = place[0], _heading(figure, *place, f"Flux by zones of γ [{unit}]")
    told = [
        (f"{low:g}–{high:g}°", measured(flux / 10.0**power, error / 10.0**power, "").rstrip())
        for low, high, flux, error in lit
    ]
    columns = _columns(told, A4[0] - MARGIN - x)
    rows = max(1, 1 + int((y - END - LINE * (1 + len(_end_lines(report)))) / LINE))
    hidden = sum(max(0, len(column) - rows) for column in columns)
    # The last line is for what says so.
    rows -= hidden > 0
    hidden = sum(max(0, len(column) - rows) for column in columns)
    for column in columns:
        for row, (where, flux_text) in enumerate(column[:rows]):
            style.add_text(figure, x, y - row * LINE, where, size=SMALL, color=style.FAINT)
            style.add_text(figure, x + _widest(column, 0) + GAP, y - row * LINE, flux_text, size=SMALL, color=style.INK)
        x += _widest(column, 0) + _widest(column, 1) + 2.5 * GAP
    if hidden:
        _lines(figure, place[0], y - rows * LINE, [f"and {hidden} more: see the page of HTML"], style.FAINT)


def _columns(told: list[tuple[str, str]], wide: float) -> list[list[tuple[str, str]]]:
    """Pairs of texts in three columns, or in fewer where these have no room side by side [inches].

    >>> [len(column) for column in _columns([("0–10°", "1.40 ± 0.38")] * 18, 3.4)]
    [6, 6, 6]
    >>> [len(column) for column in _columns([("0–10°", "0.001400 ± 0.000038")] * 5, 3.4)]
    [3, 2]
    """
    for count in (3, 2, 1):
        high = max(1, math.ceil(len(told) / count))
        columns = [told[first : first + high] for first in range(0, len(told), high)]
        if sum(_widest(column, 0) + _widest(column, 1) + 2.5 * GAP for column in columns) <= wide + 1.5 * GAP:
            break
    return columns


def _widest(column: list[tuple[str, str]], part: int) -> float:
    return max(style.width_of(pair[part], SMALL) for pair in column)


def _write_end(figure: Figure, report: SourceReport) -> None:
    """Where everything comes from, and room for a name."""
    wide, lines = A4[0] - 2 * MARGIN, _end_lines(report)
    _lines(figure, MARGIN, END + LINE * len(lines), lines, style.FAINT)
    for number, what in enumerate(SIGNED):
        x = MARGIN + number * wide / len(SIGNED)
        style.add_text(figure, x, 0.38, f"{what} {'.' * 44}", size=style.CAPTION_SIZE, color=style.FAINT)


def _end_lines(report: SourceReport) -> list[str]:
    return style.wrapped([f"{label}: {text}" for label, text in report.provenance], A4[0] - 2 * MARGIN)[:5]


# --- as a page of the web ----------------------------------------------------------------------------------------------

HEAD = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>{title}</title><style>
body {{ font: 14px/1.45 system-ui, sans-serif; color: #16181d; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }}
h1 {{ font-size: 1.5rem; margin: 0; }} h2 {{ font-size: 1.05rem; margin: 1.6rem 0 .4rem; }}
table {{ border-collapse: collapse; }} td, th {{ padding: .15rem 1rem .15rem 0; text-align: left; vertical-align: top; }}
th {{ color: #656a73; font-weight: normal; }} img {{ max-width: 100%; }} .pictures img {{ width: 49%; }}
.sign {{ display: flex; gap: 2rem; margin-top: 2.5rem; color: #656a73; }}
.sign span {{ flex: 1; border-top: 1px solid #656a73; }}
@media print {{ body {{ margin: 0; font-size: 10px; }} .pictures img {{ width: 24%; }} h2 {{ break-after: avoid; }} }}
</style></head><body>
"""


def report_html(report: SourceReport) -> str:
    """The report as one page of HTML, pictures in it; it loads nothing.

    Examples
    --------
    >>> import etendue as et
    >>> rays, disk = et.RingSource(rays=20_000).ray_set(), et.Disk(radius=30)
    >>> report = et.report_source(rays, surface=disk, title="<Rings>", observers=[et.Observer(0, 0, 1000)], forecast=False)
    >>> page = report_html(report)
    >>> "<h1>&lt;Rings&gt;</h1>" in page, "http:" in page.replace("http-equiv", "")
    (True, False)
    """
    return HEAD.format(title=_text(report.title)) + "\n".join(_body(report)) + "\n</body></html>\n"


def _body(report: SourceReport) -> Iterator[str]:
    yield f"<h1>{_text(report.title)}</h1><p>{_text(report.subtitle)}</p>"
    yield "<h2>Rays</h2>" + _table(report.facts)
    yield "<h2>Complaints</h2>" + (_list(report.complaints) if report.complaints else "<p>none</p>")
    yield "<h2>Light field</h2>" + _list(report.quality_lines)
    values = np.concatenate([lmap.values.ravel() for lmap in report.maps])
    errors = np.concatenate([lmap.standard_error.ravel() for lmap in report.maps])
    scale = choose_scale(values, "auto").name
    norm = normalisation(values, scale, None, None, errors)
    pictures = []
    for lmap in report.maps:
        where = _where(lmap.observer)
        pictures.append(_picture(plot_map(lmap, scale=scale, vmin=norm.vmin, vmax=norm.vmax, title=where), where))
    yield f'<h2>{report.maps[0].quantity.capitalize()}, one scale</h2><div class="pictures">{"".join(pictures)}</div>'
    names = [label for label, _ in report.view_rows()[0]]
    body = "".join(f"<tr>{''.join(f'<td>{_text(text)}</td>' for _, text in row)}</tr>" for row in report.view_rows())
    yield f"<table><tr>{''.join(f'<th>{_text(name)}</th>' for name in names)}</tr>{body}</table>"
    what = report.intensity.quantity.capitalize()
    yield f"<h2>{what}</h2>{_picture(plot_intensity(report.intensity), what)}" + _list(report.sheet.lines())
    unit = report.intensity.flux_unit
    zones = [
        (f"γ {low:g}° to {high:g}°", measured(flux, error, unit))
        for low, high, flux, error in report.sheet.zones
        if flux
    ]
    yield "<h2>Flux by zones</h2>" + _table(zones)
    yield "<h2>Notes</h2>" + _list(report.notes)
    yield "<h2>Provenance</h2>" + _table(report.provenance)
    yield f'<div class="sign">{"".join(f"<span>{what}</span>" for what in SIGNED)}</div>'


def _where(observer: Observer) -> str:
    return f"θ = {observer.theta:g}°, φ = {observer.phi:g}°"


def _text(text: str) -> str:
    return escape(printable(text))


def _table(rows: Sequence[tuple[str, str]]) -> str:
    return "<table>" + "".join(f"<tr><th>{_text(a)}</th><td>{_text(b)}</td></tr>" for a, b in rows) + "</table>"


def _list(lines: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{_text(line)}</li>" for line in lines) + "</ul>"


def _picture(figure: Figure, alt: str) -> str:
    """As data in the page."""
    memory = io.BytesIO()
    figure.savefig(memory, format="png", dpi=130, metadata={"Software": None})
    return f'<img alt="{_text(alt)}" src="data:image/png;base64,{base64.b64encode(memory.getvalue()).decode("ascii")}">'
