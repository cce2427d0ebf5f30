"""Regions of a map as its picture shows them: outlined and numbered, with their figures for the caption."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

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


ROOM = 12.0
"""Sides of a number with its halo [points]."""


def draw_marks(axes: Axes, marks: Sequence[Mark]) -> None:
    """Outlines that are seen on bright and on dark, each with its number at the upper left of what is seen of it.

    Numbers that would lie on each other, those of equal outlines among them, stand side by side.
    """
    (left, right), (bottom, top) = sorted(axes.get_xlim()), sorted(axes.get_ylim())
    points = 72.0 / style.figure_of(axes).dpi
    places: list[tuple[Array, Array, list[int]]] = []
    for mark in marks:
        draw_outline(axes, mark.outline)
        seen = clipped(mark.outline, (left, right, bottom, top))
        corners = (seen if len(seen) else mark.outline).clip((left, bottom), (right, top))
        corner = corners[np.argmax(corners[:, 1] - corners[:, 0])]
        dot = points * np.asarray(axes.transData.transform(corner))
        for _, other, numbers in places:
            if np.abs(other - dot).max() < ROOM:
                numbers.append(mark.number)
                break
        else:
            places.append((corner, dot, [mark.number]))
    edges = axes.get_window_extent()
    for corner, (x, y), numbers in places:
        # At the right and at the lower edge there is room on the other side only.
        ends, low = x + ROOM * len(numbers) > points * edges.x1, y - ROOM < points * edges.y0
        axes.annotate(
            ", ".join(map(str, numbers)),
            (float(corner[0]), float(corner[1])),
            xytext=(-3 if ends else 3, 3 if low else -3),
            textcoords="offset points",
            ha="right" if ends else "left",
            va="bottom" if low else "top",
            size=style.TICK_SIZE,
            color="white",
            weight="bold",
            path_effects=halo(),
            annotation_clip=False,
        )


def halo() -> list[Any]:
    """Black around thin white lines and letters, which are seen on bright and on dark."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.2, foreground="black")]


def draw_outline(axes: Axes, corners: Array) -> None:
    """The outline of a region, corners of shape (n, 2) [mm]."""
    from matplotlib.patches import Polygon

    axes.add_patch(Polygon(corners, closed=True, fill=False, edgecolor="white", linewidth=0.9, path_effects=halo()))


def clipped(corners: Array, frame: tuple[float, float, float, float]) -> Array:
    """The part of a polygon that lies in a rectangle: of all its parts, if there are several.

    Parameters
    ----------
    corners : array, shape (n, 2)
        Of the polygon, in order.
    frame : tuple
        Left, right, bottom, top, in the unit of the corners.

    Returns
    -------
    array, shape (m, 2)
        Empty if no part does.

    Examples
    --------
    >>> clipped(np.array([(0.0, 0), (4, 0), (0, 4)]), (1.0, 9.0, 1.0, 9.0)).tolist()
    [[1.0, 1.0], [3.0, 1.0], [1.0, 3.0]]
    """
    from matplotlib.path import Path
    from matplotlib.transforms import Bbox

    left, right, bottom, top = frame
    closed = Path(np.concatenate([corners, corners[:1]]), closed=True)
    parts = closed.clip_to_bbox(Bbox([(left, bottom), (right, top)])).to_polygons()
    # The first corner stands at the end once more.
    return np.concatenate([np.asarray(part)[:-1] for part in parts]) if parts else np.zeros((0, 2))
