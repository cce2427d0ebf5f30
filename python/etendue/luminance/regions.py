"""Parts of a map in figures: rectangles and polygons on the screen, their mean with its error, extremes and uniformity."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.luminance.comparison import DEAD_RULES, ON_THE_EDGE, DeadRule, Region
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Screen

Mask = npt.NDArray[np.bool_]
Corner = tuple[float, float]

PERCENTILES = (5.0, 50.0, 95.0)
"""That are stated [%]."""


@dataclasses.dataclass(frozen=True)
class PolygonRegion:
    """A polygon on the screen; it holds the pixels whose centres lie inside (even-odd rule).

    Parameters
    ----------
    corners : sequence of pairs
        Right and up from the target [mm], three or more, in order; the last is joined to the first.

    Raises
    ------
    ArgumentError
        If there are fewer than three corners, one is not finite, or they span no area.

    Examples
    --------
    >>> from etendue.quantities.observer import Screen
    >>> PolygonRegion([(-2, -1), (2, -1), (-2, 1)]).mask(Screen(4, 2, 4, 2)).astype(int).tolist()
    [[1, 0, 0, 0], [1, 1, 1, 0]]
    """

    corners: Sequence[Corner]

    def __post_init__(self) -> None:
        corners = tuple((float(x), float(y)) for x, y in self.corners)
        if len(corners) < 3 or not all(math.isfinite(x) and math.isfinite(y) for x, y in corners):
            raise ArgumentError(
                f"region {_told(self.corners)}: give three or more corners with finite coordinates in mm."
            )
        object.__setattr__(self, "corners", corners)
        if self.area == 0.0:
            raise ArgumentError(f"region {_told(corners)}: the corners span no area.")

    @property
    def area(self) -> float:
        """Of a polygon that does not cross itself [mm²]: the shoelace formula."""
        return abs(sum(a * d - c * b for (a, b), (c, d) in self._edges())) / 2.0

    def _edges(self) -> Sequence[tuple[Corner, Corner]]:
        return list(itertools.pairwise((*self.corners, self.corners[0])))

    def mask(self, screen: Screen) -> Mask:
        """Pixels of `screen` in the region, shape (rows, columns).

        Raises
        ------
        ArgumentError
            If no pixel centre lies in the region.
        """
        x, y = screen.x[None, :], screen.y[:, None]
        inside = np.zeros(screen.shape, dtype=np.bool_)
        slack = ON_THE_EDGE * screen.width / screen.columns
        for (a, b), (c, d) in self._edges():
            if b == d:
                continue
            # A ray to the right of the pixel's centre crosses the edge.
            crosses = ((b <= y) & (y < d)) | ((d <= y) & (y < b))
            inside ^= crosses & (x <= a + (y - b) * (c - a) / (d - b) + slack)
        if not inside.any():
            raise ArgumentError(
                f"region {_told(self.corners)}: no pixel centre lies in it. The screen spans ±{screen.width / 2:g} mm "
                f"across and ±{screen.height / 2:g} mm up in {screen.columns} × {screen.rows} pixels."
            )
        return inside


AnyRegion = Region | PolygonRegion


def _told(corners: Sequence[Corner]) -> str:
    return ",".join("/".join(f"{coordinate:g}" for coordinate in corner) for corner in corners)


@dataclasses.dataclass(frozen=True, repr=False)
class RegionStatistics:
    """A region of a map in figures; made by `region_statistics`.

    Parameters
    ----------
    mean, minimum, maximum : float
        Of the pixels counted, in `unit`.
    mean_error : float
        Standard error of the mean if all pixels err together: the mean of their errors, which no correlation exceeds.
        Pixels of light fields and of smoothed maps are like that. NaN where that of a pixel is not known; cells of
        illuminance that no ray reached count as 0 ± 0.
    mean_error_apart : float
        The same if each pixel errs by itself, as those do that count rays: the root of the sum of squares over their number.
    percentiles : tuple of pairs
        Share [%] and value: the linear interpolation between ranked pixels.
    uniformity : float
        Minimum over mean; NaN where the mean is not above 0.
    uniformity_of_extremes : float
        Minimum over maximum; NaN where the maximum is not above 0.
    area : float
        Of all pixels in the region [mm²].
    pixels, dead_pixels : int
        How many pixels there are, and how many of them are dead.
    quantity, unit : str
        Of the map.

    Examples
    --------
    >>> from etendue.quantities.observer import Observer
    >>> lmap = LuminanceMap([[1.0, 3.0]], [[0.3] * 2], [[9] * 2], Observer(0, 0, 1000), Screen(2, 1, 2, 1))
    >>> region_statistics(lmap, Region(-1, 1, -1, 1))
    <RegionStatistics: mean 2 cd/m², 1 to 3, of 2 pixels>
    """

    mean: float
    mean_error: float
    mean_error_apart: float
    minimum: float
    maximum: float
    percentiles: tuple[tuple[float, float], ...]
    uniformity: float
    uniformity_of_extremes: float
    area: float
    pixels: int
    dead_pixels: int
    quantity: str
    unit: str

    def __repr__(self) -> str:
        """Mean and extremes."""
        values = f"mean {self.mean:.4g} {self.unit}, {self.minimum:.4g} to {self.maximum:.4g}"
        return f"<RegionStatistics: {values}, of {self.pixels} pixels>"

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; undefined numbers are None."""
        found = dataclasses.asdict(self)
        found = {name: None if isinstance(v, float) and math.isnan(v) else v for name, v in found.items()}
        return found | {"percentiles": {f"{share:g}": value for share, value in self.percentiles}}


def region_statistics(
    lmap: LuminanceMap | IlluminanceMap,
    region: AnyRegion,
    percentiles: Sequence[float] = PERCENTILES,
    dead: DeadRule = "zero",
) -> RegionStatistics:
    """Mean, extremes, percentiles and uniformity of a part of a map.

    Parameters
    ----------
    lmap : LuminanceMap or IlluminanceMap
        With its standard errors.
    region : Region or PolygonRegion
        On the screen of the map.
    percentiles : sequence of float
        Which ones [%], 0 to 100.
    dead : {"zero", "exclude"}
        ``"zero"``: a dead pixel counts as 0 ± 0, so that the mean is not biased: where rays are few, those pixels that one
        of them reached are too bright on average. ``"exclude"``: it is left out, where it is dead for want of a measurement.

    Raises
    ------
    ArgumentError
        If no pixel centre, or no live pixel, lies in the region, or a percentile is out of its range.
    UnknownNameError
        If there is no such rule for dead pixels.

    Examples
    --------
    >>> from etendue.quantities.observer import Observer
    >>> lmap = LuminanceMap([[1.0, 2, 3, 4]], [[0.3] * 4], [[9] * 4], Observer(0, 0, 1000), Screen(4, 1, 4, 1))
    >>> found = region_statistics(lmap, Region(-1, 2, -1, 1))
    >>> found.mean, round(found.mean_error, 3), round(found.mean_error_apart, 3), round(found.uniformity, 3)
    (3.0, 0.3, 0.173, 0.667)
    """
    if not all(0.0 <= share <= 100.0 for share in percentiles):
        raise ArgumentError(f"region_statistics: percentiles are {tuple(percentiles)}; give numbers from 0 to 100.")
    if dead not in DEAD_RULES:
        raise UnknownNameError("rule for dead pixels", dead, DEAD_RULES)
    inside = region.mask(lmap.screen)
    live = inside & ~np.isnan(lmap.values)
    # A cell of illuminance that no ray reached is 0, of unknown error: it counts as a dead pixel does.
    lit = live & ~((lmap.values == 0.0) & (lmap.rays == 0))
    if not live.any():
        raise ArgumentError(f"region_statistics: all {int(inside.sum())} pixels in {region} are dead.")
    counted = inside if dead == "zero" else live
    values, errors = (np.where(lit, array, 0.0)[counted] for array in (lmap.values, lmap.standard_error))
    mean, low, high = float(values.mean()), float(values.min()), float(values.max())
    return RegionStatistics(
        mean=mean,
        mean_error=float(errors.mean()),
        mean_error_apart=float(np.sqrt((errors**2).sum()) / errors.size),
        minimum=low,
        maximum=high,
        percentiles=tuple((float(share), float(np.percentile(values, share))) for share in percentiles),
        uniformity=low / mean if mean > 0.0 else math.nan,
        uniformity_of_extremes=low / high if high > 0.0 else math.nan,
        area=float(inside.sum()) * lmap.screen.pixel_area,
        pixels=int(inside.sum()),
        dead_pixels=int((inside & ~live).sum()),
        quantity=lmap.quantity,
        unit=lmap.unit,
    )


def parse_region(text: str) -> AnyRegion:
    """A region as the command line spells it: four limits, or the corners of a polygon.

    Parameters
    ----------
    text : str
        ``LEFT,RIGHT,BOTTOM,TOP`` in mm, or three or more corners ``X/Y,X/Y,X/Y``.

    Raises
    ------
    ArgumentError
        If it is neither.

    Examples
    --------
    >>> parse_region("-1,1,-2,2")
    Region(left=-1.0, right=1.0, bottom=-2.0, top=2.0)
    >>> parse_region("0/0,1/0,0/1").area
    0.5
    """
    rows = [part.split("/") for part in text.split(",")]
    polygon = "/" in text
    try:
        numbers = [tuple(map(float, row)) for row in rows]
    except ValueError:
        numbers = []
    # What the regions themselves refuse, they explain.
    if polygon and numbers and all(len(row) == 2 for row in numbers):
        return PolygonRegion([(x, y) for x, y in numbers])
    if not polygon and len(numbers) == 4:
        return Region(*(x for (x,) in numbers))
    raise ArgumentError(
        f"{text!r} is no region: give LEFT,RIGHT,BOTTOM,TOP in mm, e.g. -5,5,-2,2, or corners X/Y, e.g. 0/0,4/0,0/3."
    )
