"""Regions of a map as its picture shows them: outlined and numbered, with their figures for the caption."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.luminance.region_statistics import RegionStatistics, region_statistics
from etendue.luminance.regions import AnyRegion
from etendue.plot import style
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.powers_of_ten import common_power

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


def check_number(regions: Sequence[AnyRegion]) -> None:
    """Refuse more regions than a picture has room for.

    Raises
    ------
    ArgumentError
        If so.
    """
    if len(regions) > MOST_REGIONS:
        raise ArgumentError(
            f"plot: {len(regions)} regions; a picture has room for {MOST_REGIONS}. Draw them in several."
        )


def marks_of(lmap: LuminanceMap | IlluminanceMap, regions: Sequence[AnyRegion]) -> list[Mark]:
    """Regions with their numbers and figures.

    Raises
    ------
    ArgumentError
        If there are more than a picture has room for, or one holds no live pixel.
    """
    check_number(regions)
    found = []
    for number, region in enumerate(regions, start=1):
        figures = region_statistics(lmap, region)
        facts = [*_facts(number, figures)]
        if figures.dead_pixels:
            facts.append(f"{figures.dead_pixels} of {figures.pixels} pixels are dead and count as 0")
        facts += ["cut at the edge of the screen"] * bool(figures.notes)
        found.append(Mark(number, np.array(region.corners), style.SEPARATOR.join(facts)))
    return found


def _facts(number: int, figures: RegionStatistics) -> Iterator[str]:
    """Mean of a region, with the errors that it has if its pixels err apart and together, extremes and percentiles."""
    # Either all numbers are counted in a power of ten, or none is.
    power = common_power(figures.minimum, figures.maximum)

    def told(value: float, digits: int = 4) -> str:
        return style.plain(float(f"{value / 10.0**power:.{digits}g}"))

    known = [told(error, 2) for error in (figures.mean_error_apart, figures.mean_error) if math.isfinite(error)]
    mean = " ± ".join([told(figures.mean), *([" to ".join(dict.fromkeys(known))] if known else [])])
    unit = style.in_powers(figures.unit, power)
    yield f"{number} in {unit}: mean {mean}" if power else f"{number}: mean {mean} {unit}"
    yield f"min {told(figures.minimum)}"
    yield f"max {told(figures.maximum)}"
    yield f"min/mean {style.plain(figures.uniformity)}"
    yield ", ".join(f"{share:g} %: {told(value)}" for share, value in figures.percentiles)


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
