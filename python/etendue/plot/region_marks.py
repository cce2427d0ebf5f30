"""Regions of a map as its picture shows them: outlined and numbered, with their figures for the caption."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.luminance.comparison import Region
from etendue.luminance.regions import AnyRegion, RegionStatistics, region_statistics
from etendue.plot import style
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]

MOST_REGIONS = 9
"""That a picture has room for."""


class Mark(NamedTuple):
    """A region as a picture shows it: its number, its outline [mm], and its figures in a line of the caption."""

    number: int
    outline: Array
    line: str


def marks_of(lmap: LuminanceMap | IlluminanceMap, regions: Sequence[AnyRegion]) -> list[Mark]:
    """Regions with their numbers and figures.

    Raises
    ------
    ArgumentError
        If there are more than a picture has room for, or one holds no live pixel.
    """
    if len(regions) > MOST_REGIONS:
        raise ArgumentError(
            f"plot: {len(regions)} regions; a picture has room for {MOST_REGIONS}. Draw them in several."
        )
    found = []
    for number, region in enumerate(regions, start=1):
        figures = region_statistics(lmap, region)
        facts = (
            f"{number}: mean {in_words(figures)}",
            f"min {style.plain(figures.minimum)}",
            f"max {style.plain(figures.maximum)}",
            f"min/mean {style.plain(figures.uniformity)}",
            ", ".join(f"{share:g} %: {style.plain(value)}" for share, value in figures.percentiles),
            *(
                [f"{figures.dead_pixels} of {figures.pixels} pixels are dead and count as 0"]
                if figures.dead_pixels
                else []
            ),
        )
        found.append(Mark(number, _outline(region), style.SEPARATOR.join(facts)))
    return found


def in_words(figures: RegionStatistics) -> str:
    """The mean of a region with the errors that it has if its pixels err apart and together."""
    mean = f"{style.plain(figures.mean)} {figures.unit}"
    if not math.isfinite(figures.mean_error):
        return mean
    apart, together = (style.plain(float(f"{x:.2g}")) for x in (figures.mean_error_apart, figures.mean_error))
    return f"{mean} ± {apart} to {together}" if apart != together else f"{mean} ± {apart}"


def _outline(region: AnyRegion) -> Array:
    if isinstance(region, Region):
        left, right, bottom, top = region.left, region.right, region.bottom, region.top
        return np.array([(left, bottom), (right, bottom), (right, top), (left, top)])
    return np.array(region.corners)


def draw_marks(axes: Axes, marks: Sequence[Mark]) -> None:
    """Outlines that are seen on bright and on dark, each with its number at its upper left corner."""
    from matplotlib.patches import Polygon
    from matplotlib.patheffects import withStroke

    for mark in marks:
        # Thin white on wider black.
        halo = [withStroke(linewidth=2.2, foreground="black")]
        axes.add_patch(
            Polygon(mark.outline, closed=True, fill=False, edgecolor="white", linewidth=0.9, path_effects=halo)
        )
        corner = mark.outline[np.argmax(mark.outline[:, 1] - mark.outline[:, 0])]
        axes.annotate(
            str(mark.number), corner, xytext=(3, -3), textcoords="offset points", ha="left", va="top",
            size=style.TICK_SIZE, color="white", weight="bold", path_effects=halo, annotation_clip=True,
        )  # fmt: skip
