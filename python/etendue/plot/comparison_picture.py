"""Two maps beside their difference, with the figures of their agreement."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from etendue.errors import UnknownNameError
from etendue.luminance.comparison import Comparison
from etendue.plot import style
from etendue.plot.map_picture import SCALES, Scale, colour_map, draw_colour_bar, draw_screen, normalisation
from etendue.quantities.observer import Screen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NARROWEST_COLUMN = 2.1
"""Room for the lines of text under three narrow maps [inches]."""

GREATEST_DIFFERENCE = 200.0
"""What eq. 3.4 gives where one map is black [%]."""


def plot_comparison(
    comparison: Comparison,
    path: str | os.PathLike[str] | None = None,
    scale: Scale = "linear",
    *,
    labels: tuple[str, str] = ("test", "reference"),
    title: str | None = None,
) -> Figure:
    """Draw both maps with the same colours, their difference [%], and the measures of agreement (cf. fig. 3.3).

    Parameters
    ----------
    comparison : Comparison
        What `etendue.compare` gave.
    path : path, optional
        Where to write the picture, .png or .pdf.
    scale : {"linear", "log"}
        Scale of the luminance colours. Those of the difference are linear and end at its 99th percentile.
    labels : pair of str
        Names of the two maps.
    title : str, optional
        First line; "Comparison" if not given.

    Returns
    -------
    matplotlib.figure.Figure
        The figure, not registered with pyplot. The region compared is outlined, the difference is grey outside it.

    Raises
    ------
    UnknownNameError
        If `scale` or the extension of `path` does not exist.

    Examples
    --------
    >>> from etendue.luminance.comparison import compare
    >>> from etendue.quantities.luminance_map import LuminanceMap
    >>> from etendue.quantities.observer import Observer
    >>> from etendue.quantities.provenance import Provenance
    >>> lmap = LuminanceMap([[3.0, 1.0]], [[0.1, 0.1]], [[900, 300]], Observer(0, 0, 1000), Screen(2, 1, 2, 1),
    ...                     provenance=Provenance(software="example"))
    >>> [axes.get_title(loc="left") for axes in plot_comparison(compare(lmap, lmap)).axes[:3]]
    ['test', 'reference', 'difference']
    """
    if scale not in SCALES:
        raise UnknownNameError("colour scale", scale, SCALES)
    test, reference = comparison.test, comparison.reference
    layout = _Layout.around(reference.screen)
    figure = style.new_figure(layout.width, layout.height)
    both = np.stack((test.values, reference.values))
    norm = normalisation(both, scale, None, None)
    panels = [style.add_axes(figure, *place) for place in layout.panels]
    for axes, lmap in zip(panels, (test, reference), strict=False):
        image = draw_screen(axes, lmap.values, lmap.screen, colour_map("value"), norm, layout.panels[0][2:])
    draw_colour_bar(
        figure, style.add_axes(figure, *layout.bars[0]), image, both, f"{reference.quantity} [{reference.unit}]"
    )
    difference = comparison.difference
    defined = difference[~np.isnan(difference)]
    end = float(np.percentile(defined, 99)) if defined.size else 0.0
    image = draw_screen(
        panels[2],
        difference,
        reference.screen,
        colour_map("difference"),
        normalisation(difference, "linear", 0.0, end if end > 0.0 else GREATEST_DIFFERENCE),
        layout.panels[2][2:],
    )
    draw_colour_bar(figure, style.add_axes(figure, *layout.bars[1]), image, difference, "difference [%]")
    for axes, name in zip(panels, (*labels, "difference"), strict=True):
        axes.set_title(name, loc="left", size=style.LABEL_SIZE, color=style.INK, pad=4)
        axes.set_xlabel("x [mm]")
        _outline(axes, comparison)
    panels[0].set_ylabel("y [mm]")
    for axes in panels[1:]:
        axes.set_yticklabels([])
    heading = title if title is not None else "Comparison"
    left, top = layout.panels[0][0], layout.height
    style.add_text(figure, left, top - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    seen = f"seen at {style.describe_observer(reference.observer)}"
    style.add_text(figure, left, top - 0.54, seen, size=style.LABEL_SIZE, color=style.FAINT)
    for number, line in enumerate(reversed(_figures(comparison, labels))):
        style.add_text(figure, left, 0.14 + 0.16 * number, line, size=style.TICK_SIZE, color=style.FAINT)
    return style.finish(figure, path)


def _outline(axes: Axes, comparison: Comparison) -> None:
    """The region compared."""
    from matplotlib.patches import Rectangle

    region = comparison.region
    if region is not None:
        size = (region.right - region.left, region.top - region.bottom)
        axes.add_patch(Rectangle((region.left, region.bottom), *size, fill=False, edgecolor="white", linewidth=1.0))


def _figures(comparison: Comparison, labels: tuple[str, str]) -> list[str]:
    """Three lines below the pictures."""
    maps = zip(labels, (comparison.test_statistics, comparison.reference_statistics), strict=True)
    unit = comparison.reference.unit
    agreement = (
        f"NCC {_per_cent(comparison.ncc)}",
        f"NRMSE {_per_cent(comparison.nrmse)} of the reference's max",
        f"eq. 3.6 {_per_cent(comparison.nrmse_thesis)}",
        f"χ²/N {style.plain(comparison.reduced_chi_square)}",
        f"intensity ratio {style.plain(comparison.intensity_ratio)}",
    )
    lines = [style.SEPARATOR.join(agreement)]
    for name, figures in maps:
        facts = (
            f"{name}: mean {style.plain(figures.mean)} {unit}",
            f"max {style.plain(figures.maximum)}",
            f"uniformity {style.plain(figures.uniformity)}",
            f"{style.grouped(str(figures.dead_pixels))} dead pixels",
        )
        lines.append(style.SEPARATOR.join(facts))
    return lines


def _per_cent(fraction: float) -> str:
    return "undefined" if math.isnan(fraction) else f"{style.plain(100.0 * fraction)} %"


class _Layout(NamedTuple):
    """Places [inches]: of the figure, and (left, bottom, width, height) of the three panels and two colour bars."""

    width: float
    height: float
    panels: list[tuple[float, float, float, float]]
    bars: list[tuple[float, float, float, float]]

    @classmethod
    def around(cls, screen: Screen) -> _Layout:
        aspect = screen.width / screen.height
        # Beyond these limits the pixels are drawn out of proportion rather than invisibly thin.
        wide = float(np.clip(4.2 * aspect, 0.4, 3.1))
        high = float(np.clip(wide / aspect, 0.3, 4.2))
        left, gap, bottom, top, bar = 0.7, 0.18, 1.82, 0.98, 0.72
        pitch = max(wide + gap, NARROWEST_COLUMN)
        panels = [(left + column * pitch, bottom, wide, high) for column in range(3)]
        under = bottom - bar
        bars = [(left, under, 2 * pitch - gap, 0.13), (panels[2][0], under, pitch - gap, 0.13)]
        return cls(left + 3 * pitch + 0.1, bottom + high + top, panels, bars)
