"""One look for all pictures: colours, type sizes, layout in inches, and files whose bytes repeat."""

from __future__ import annotations

import itertools
import math
import os
import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.extras import require
from etendue.formats.output import atomic_output
from etendue.quantities.arguments import require_path
from etendue.quantities.observer import Observer
from etendue.quantities.powers_of_ten import common_power, ten_to
from etendue.quantities.printable import printable

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
    from matplotlib.text import Text
    from matplotlib.ticker import LogFormatter, MaxNLocator, ScalarFormatter

INK = "#1c1c22"
"""Titles and labels."""
FAINT = "#6b6b76"
"""Captions, ticks and frames."""
RULE = "#c9c9d1"
"""Grid lines and thin frames."""
DEAD = "#8fa3ad"
"""Pixels without a number: a cold grey that no colour map here contains."""
LINES = ("#1f5aa6", "#d1622b", "#3c8d5a", "#8a4fa3", "#b8942b", "#5b6770")
"""Lines in one diagram, in this order."""

COLOUR_MAPS = {"value": "inferno", "error": "viridis", "difference": "RdBu_r", "size of difference": "magma"}
"""Each for one kind of number: perceptually uniform, and for signed numbers two colours that all eyes tell apart."""

TITLE_SIZE, LABEL_SIZE, TICK_SIZE, CAPTION_SIZE = 11.0, 9.0, 8.0, 7.5
DPI = 200

SEPARATOR = "  ·  "
"""Between the facts of a caption."""

FILE_TYPES: dict[str, dict[str, Any]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}
"""File types of pictures, each with what keeps its bytes the same from run to run."""


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inches] outside matplotlib's global state.

    Raises
    ------
    MissingLibraryError
        If matplotlib is not installed.
    """
    require("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def given_axes(ax: Axes | Sequence[Axes] | npt.NDArray[Any], diagrams: int, path: object) -> tuple[Axes, ...]:
    """The axes that a user hands over to be drawn on, one for each diagram.

    Raises
    ------
    MissingLibraryError
        If matplotlib is not installed.
    ArgumentError
        If there are more or fewer of them, they are no plain ones, or a path is given as well.
    """
    require("matplotlib")
    if path is not None:
        raise ArgumentError(f"ax and {path}: with axes of your own, save their figure: ax.figure.savefig(path).")
    axes = tuple(np.ravel(np.array(ax, dtype=object)))
    if len(axes) != diagrams:
        raise ArgumentError(f"ax: {len(axes)} axes for {diagrams} diagram{'s' * (diagrams > 1)}; give one for each.")
    for one in axes:
        if getattr(one, "name", None) != "rectilinear":
            raise ArgumentError(f"ax: {one!r} are no plain axes of matplotlib; make some with plt.subplots().")
    return axes


def figure_of(axes: Axes) -> Figure:
    """The whole figure that axes are in."""
    figure = axes.get_figure(root=True)
    if figure is None:
        raise ArgumentError(f"ax: {axes!r} were taken out of their figure.")
    return figure


def inches_of(axes: Axes) -> tuple[float, float]:
    """Width and height of axes [inches]."""
    place, dpi = axes.get_window_extent(), figure_of(axes).dpi
    return place.width / dpi, place.height / dpi


def put_title(axes: Axes, text: str) -> None:
    """A title over axes; it stands there as it is: a dollar sign begins no formula."""
    axes.set_title(printable(text), loc="left", size=LABEL_SIZE, color=INK, weight="bold", parse_math=False)


def put_legend(axes: Axes, **options: Any) -> Legend:
    """A legend in the house look; names stand in it as they are."""
    legend = axes.legend(
        frameon=False,
        fontsize=TICK_SIZE,
        labelcolor=INK,
        borderaxespad=0.2,
        borderpad=0.0,
        **({"handlelength": 1.6, "columnspacing": 1.4} | options),
    )
    for text in legend.get_texts():
        text.set_parse_math(False)
        text.set_text(printable(text.get_text()))
    return legend


def add_axes(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Axes at a place given in inches from the lower left corner."""
    across, up = figure.get_size_inches()
    return figure.add_axes((left / across, bottom / up, width / across, height / up))


def add_text(figure: Figure, x: float, y: float, text: str, **properties: Any) -> None:
    """Text at a place given in inches from the lower left corner, its baseline on y."""
    across, up = figure.get_size_inches()
    figure.text(x / across, y / up, text, **({"va": "baseline", "ha": "left"} | properties))


def dress(axes: Axes) -> None:
    """Give axes the house look: thin frame, faint ticks."""
    for spine in axes.spines.values():
        spine.set(color=RULE, linewidth=0.6)
    axes.tick_params(which="both", labelsize=TICK_SIZE, color=RULE, labelcolor=FAINT, width=0.6, length=3)
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set(size=LABEL_SIZE, color=INK)
        axis.get_offset_text().set(size=TICK_SIZE, color=FAINT)


def finish(figure: Figure, path: str | os.PathLike[str] | None) -> Figure:
    """Write the figure, if a path is given, whole or not at all, and return it.

    Names and titles stand in it as they are: a dollar sign begins no formula.
    """
    _take_texts_as_they_are(figure)
    if path is not None:
        require_path(path, "plot: path", "the path of the picture, .png, .svg or .pdf")
        suffix = Path(path).suffix.lower()
        if suffix not in FILE_TYPES:
            raise UnknownNameError("extension of a picture", suffix, FILE_TYPES)
        from matplotlib import rc_context

        # The names of parts in an .svg are drawn by chance unless a salt is stated.
        with atomic_output(path) as temporary, rc_context({"svg.hashsalt": "etendue"}):
            figure.savefig(temporary, format=suffix[1:], metadata=FILE_TYPES[suffix])
    return figure


def _take_texts_as_they_are(figure: Figure) -> None:
    for text in _texts_of(figure):
        text.set_parse_math(False)
        text.set_text("\n".join(map(printable, text.get_text().split("\n"))))


def _texts_of(artist: Artist) -> Iterator[Text]:
    """All texts but the numbers at axes, which are ours: their powers of ten are formulas, and to list them makes them."""
    from matplotlib.axis import Axis
    from matplotlib.text import Text

    if isinstance(artist, Axis):
        yield artist.label
        return
    if isinstance(artist, Text):
        yield artist
    for child in artist.get_children():
        yield from _texts_of(child)


def locator_for(inches: float) -> MaxNLocator:
    """Round numbers for ticks, as many as fit on an axis of this length."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(int(min(7, max(1, inches * 1.8))), steps=[1, 2, 2.5, 5, 10])


LETTER = 0.062
"""Width of a digit at an axis [inches]: 0.56 of the size of its type."""


def width_of(text: str, size: float = TICK_SIZE) -> float:
    """About how wide a number is [inches].

    Examples
    --------
    >>> round(width_of("−20"), 2), round(width_of("−20", 4.0), 2)
    (0.19, 0.09)
    """
    return len(text) * LETTER * size / TICK_SIZE


def keep_apart(axis: Axis, inches: float, low: float, high: float) -> None:
    """Where the ticks of a horizontal axis of this length would run into each other, take the outermost two, or one."""
    from matplotlib.ticker import FixedLocator

    # Rounding puts no tick beyond the end.
    slack = 1e-9 * (high - low)
    ticks = [
        float(tick) for tick in axis.get_major_locator().tick_values(low, high) if low - slack <= tick <= high + slack
    ]
    scale = 10.0 ** common_power(low, high)
    # All have as many decimals as the one that needs most.
    decimals = max((len(plain(tick / scale).partition(".")[2]) for tick in ticks), default=0)
    while len(ticks) > 1:
        widths = [width_of(f"{tick / scale:.{decimals}f}") for tick in ticks]
        apart = [(b - a) * inches / (high - low) for a, b in itertools.pairwise(ticks)]
        if all(gap > (a + b) / 2 + LETTER for gap, (a, b) in zip(apart, itertools.pairwise(widths), strict=True)):
            return
        ticks = [ticks[0], ticks[-1]] if len(ticks) > 2 else ticks[1:]
        axis.set_major_locator(FixedLocator(ticks))


def put_numbers(axis: Axis, name: str, unit: str, low: float, high: float) -> None:
    """The label of an axis with its unit, and its ticks: plain numbers, of tiny or huge ones a power of ten in the unit."""
    power = common_power(low, high)
    axis.set_major_formatter(number_formatter(power))
    axis.set_label_text(f"{name} [{in_powers(unit, power)}]")


def in_powers(unit: str, power: int) -> str:
    """A unit with a power of ten before it, unless that is 1."""
    return f"{ten_to(power)} {unit}" if power else unit


def number_formatter(power: int = 0) -> ScalarFormatter:
    """Ticks as plain numbers in groups of three digits, counted in this power of ten."""
    from matplotlib.ticker import ScalarFormatter

    class Grouped(ScalarFormatter):
        def get_offset(self) -> str:
            return ""

        def __call__(self, x: float, pos: int | None = None) -> str:
            return grouped(super().__call__(x, pos).removeprefix(r"$\mathdefault{").removesuffix("}$"))

    formatter = Grouped(useMathText=True, useOffset=False)
    # Twice the same limit fixes the power.
    formatter.set_powerlimits((power, power))
    formatter.set_scientific(power != 0)
    return formatter


def log_formatter() -> LogFormatter:
    """Ticks of a logarithmic axis, written as all other numbers are (`plain`)."""
    from matplotlib.ticker import LogFormatterSciNotation

    class Plain(LogFormatterSciNotation):
        def __call__(self, x: float, pos: int | None = None) -> str:
            # The empty text marks ticks for which there is no room.
            return plain(x) if super().__call__(x, pos) else ""

    return Plain(minor_thresholds=(1.5, 0.6))


def put_log_numbers(axis: Axis) -> None:
    """Ticks of a logarithmic axis, large and small ones, as `log_formatter` writes them."""
    axis.set_major_formatter(log_formatter())
    axis.set_minor_formatter(log_formatter())


def grouped(text: str) -> str:
    """A number of five digits or more with thin spaces between groups of three, other texts as they are."""
    match = re.fullmatch(r"([^\d]?)(\d{5,})(\..*)?", text)
    return f"{match[1]}{int(match[2]):,}{match[3] or ''}".replace(",", "\u2009") if match else text


def regrouped(text: str) -> str:
    """A text of the command line, its numbers grouped as those of pictures are.

    Examples
    --------
    >>> regrouped("1,234,567 rays at (0,5), 12,5") == "1\u2009234\u2009567 rays at (0,5), 12,5"
    True
    """
    return re.sub(r"(?<=\d),(?=\d{3}\b)", "\u2009", text)


def plain(number: float) -> str:
    """A number to four digits, in powers of ten only if it is very small or very large."""
    if not math.isfinite(number):
        return "undefined"
    rounded = f"{number:.3e}"
    if number != 0.0 and not 1e-3 <= abs(number) < 1e7:
        digits, power = rounded.split("e")
        digits = f"{float(digits):g}".replace("-", "−")
        return {"1": "", "−1": "−"}.get(digits, f"{digits} × ") + ten_to(int(power))
    return grouped(f"{float(rounded):.10g}").replace("-", "−")


def percent(number: float) -> str:
    """A share to two digits, never in powers of ten."""
    return f"{number:.0f} %" if abs(number) >= 9.95 else f"{number:.2g} %"


def describe_observer(observer: Observer) -> str:
    """The observer in a few words."""
    place = f"θ = {observer.theta:g}°, φ = {observer.phi:g}°, from {grouped(f'{observer.distance:.10g}')} mm"
    if any(observer.target):
        place += f" of ({', '.join(f'{c:g}' for c in observer.target)}) mm"
    if observer.up is not None:
        axes = {(1.0, 0.0, 0.0): "+X", (0.0, 1.0, 0.0): "+Y", (0.0, 0.0, 1.0): "+Z"}
        place += f", {axes.get(observer.up) or '(' + ', '.join(map(plain, observer.up)) + ')'} up"
    if observer.roll:
        place += f", rolled by {observer.roll:g}°"
    return place.replace("-", "−")


HORIZONTAL, VERTICAL = "horizontal on the screen", "vertical on the screen"
"""The axes of a map, which are those of what the observer sees and seldom x and y of the source."""


def headed(what: str, source: str, inches: float = 4.4) -> str:
    """A heading that names where a picture comes from, the middle of a long name left out."""
    name, room = Path(source).name.partition(" (")[0], max(12, int(inches * 10.0) - len(what) - 4)
    if not name:
        return what
    half = (room - 1) // 2
    return f"{what} of {name if len(name) <= room else name[:half] + '…' + name[-half:]}"


def shortened(name: str, letters: int) -> str:
    """A name that has room for so many letters (eight at least), its middle left out if it must be.

    Examples
    --------
    >>> shortened("lamp.tm25ray", 12), shortened("a-lamp-of-1200-lm.tm25ray", 12)
    ('lamp.tm25ray', 'a-lam…m25ray')
    """
    room = max(8, letters)
    return name if len(name) <= room else f"{name[: room // 2 - 1]}…{name[-(room // 2) :]}"


def wrapped(facts: Iterable[str], inches: float) -> list[str]:
    """Lines of a caption that fit into a width; a fact is not broken unless it is longer than a line."""
    room = int(inches * 16.5)
    lines: list[str] = []
    for fact in facts:
        if lines and len(lines[-1]) + len(SEPARATOR) + len(fact) <= room:
            lines[-1] += SEPARATOR + fact
        else:
            lines.extend(textwrap.wrap(fact, room))
    return lines
