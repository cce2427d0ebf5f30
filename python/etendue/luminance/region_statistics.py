"""Parts of a map in figures: their mean with its error, extremes, percentiles and uniformity."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from etendue.errors import ArgumentError
from etendue.luminance.comparison import DEAD_RULES, DeadRule
from etendue.luminance.regions import ON_THE_EDGE, AnyRegion, check_region
from etendue.quantities.arguments import LUMINANCE_OR_ILLUMINANCE, require, require_known, require_number
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap, errors_parted
from etendue.quantities.observer import Screen
from etendue.quantities.unlifted import unlifted

PERCENTILES = (5.0, 50.0, 95.0)
"""That are stated [%]."""


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
        What a map says that all its pixels err by in common is added to it.
    maximum_apart : float
        The maximum less what chance lifts the largest of many pixels by, if each errs by itself but for what they have in
        common (`etendue.quantities.unlifted`), in `unit`. The minimum is lowered by chance likewise.
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
    notes : tuple of str
        How far the region reaches beyond the screen, where it does.

    Examples
    --------
    >>> from etendue.luminance.regions import Region
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
    maximum_apart: float
    percentiles: tuple[tuple[float, float], ...]
    uniformity: float
    uniformity_of_extremes: float
    area: float
    pixels: int
    dead_pixels: int
    quantity: str
    unit: str
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Mean and extremes."""
        values = f"mean {self.mean:.4g} {self.unit}, {self.minimum:.4g} to {self.maximum:.4g}"
        return f"<RegionStatistics: {values}, of {self.pixels} pixels>"

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; undefined numbers are None."""
        found = dataclasses.asdict(self)
        found = {name: None if isinstance(v, float) and math.isnan(v) else v for name, v in found.items()}
        shares = {f"{share:g}": value for share, value in self.percentiles}
        return found | {"percentiles": shares, "notes": list(self.notes)}


def region_statistics(
    lmap: LuminanceMap | IlluminanceMap,
    region: AnyRegion,
    percentiles: Sequence[float] | float = PERCENTILES,
    dead: DeadRule = "zero",
) -> RegionStatistics:
    """Mean, extremes, percentiles and uniformity of a part of a map.

    Parameters
    ----------
    lmap : LuminanceMap or IlluminanceMap
        With its standard errors.
    region : Region or PolygonRegion
        On the screen of the map.
    percentiles : sequence of float, or float
        Which ones [%], 0 to 100.
    dead : {"zero", "exclude"}
        ``"zero"``: a dead pixel counts as 0 ± 0, so that the mean is not biased: where rays are few, those pixels that one
        of them reached are too bright on average. ``"exclude"``: it is left out, where it is dead for want of a measurement.

    Raises
    ------
    ArgumentError
        If no pixel centre, or no live pixel, lies in the region, a percentile is out of its range, or something is no map,
        no region or no number.
    UnknownNameError
        If there is no such rule for dead pixels.

    Examples
    --------
    >>> from etendue.luminance.regions import Region
    >>> from etendue.quantities.observer import Observer
    >>> lmap = LuminanceMap([[1.0, 2, 3, 4]], [[0.3] * 4], [[9] * 4], Observer(0, 0, 1000), Screen(4, 1, 4, 1))
    >>> found = region_statistics(lmap, Region(-1, 2, -1, 1))
    >>> found.mean, round(found.mean_error, 3), round(found.mean_error_apart, 3), round(found.uniformity, 3)
    (3.0, 0.3, 0.173, 0.667)
    """
    require(lmap, (LuminanceMap, IlluminanceMap), "region_statistics: lmap", LUMINANCE_OR_ILLUMINANCE)
    check_region(region, "region_statistics")
    percentiles = _percentiles(percentiles)
    if not all(0.0 <= share <= 100.0 for share in percentiles):
        raise ArgumentError(f"region_statistics: percentiles are {tuple(percentiles)}; give numbers from 0 to 100.")
    require_known(dead, DEAD_RULES, "rule for dead pixels")
    inside = region.mask(lmap.screen)
    live = inside & ~np.isnan(lmap.values)
    # A cell of illuminance that no ray reached is 0, of unknown error: it counts as a dead pixel does.
    lit = live & ~((lmap.values == 0.0) & (lmap.rays == 0))
    if not live.any():
        raise ArgumentError(f"region_statistics: all {int(inside.sum())} pixels in {region} are dead.")
    counted = inside if dead == "zero" else live
    values, errors = (np.where(lit, array, 0.0)[counted] for array in (lmap.values, lmap.standard_error))
    common = lmap.common_error if isinstance(lmap, LuminanceMap) else 0.0
    shared, own = errors_parted(values, errors, common)
    mean, low, high = float(values.mean()), float(values.min()), float(values.max())
    return RegionStatistics(
        mean=mean,
        mean_error=float(errors.mean()),
        mean_error_apart=math.hypot(float(np.sqrt((own**2).sum()) / own.size), float(shared.mean())),
        minimum=low,
        maximum=high,
        maximum_apart=unlifted(values, np.nan_to_num(own), np.ones(values.size)).value,
        percentiles=tuple((float(share), float(np.percentile(values, share))) for share in percentiles),
        uniformity=low / mean if mean > 0.0 else math.nan,
        uniformity_of_extremes=low / high if high > 0.0 else math.nan,
        area=float(inside.sum()) * lmap.screen.pixel_area,
        pixels=int(inside.sum()),
        dead_pixels=int((inside & ~live).sum()),
        quantity=lmap.quantity,
        unit=lmap.unit,
        notes=_beyond(region, lmap.screen),
    )


def _percentiles(given: Any) -> tuple[float, ...]:
    """As several, where one is given."""
    shares = tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else (given,)
    for share in shares:
        require_number(share, "region_statistics: a percentile", "a number from 0 to 100")
    return shares


def _beyond(region: AnyRegion, screen: Screen) -> tuple[str, ...]:
    """How far a region reaches beyond the screen, if it does."""
    x, y = np.array(region.corners).T
    reach = {
        "left": -screen.width / 2.0 - x.min(),
        "right": x.max() - screen.width / 2.0,
        "bottom": -screen.height / 2.0 - y.min(),
        "top": y.max() - screen.height / 2.0,
    }
    rounding = ON_THE_EDGE * max(screen.width, screen.height)
    sides = [f"{far:.3g} mm beyond its {side}" for side, far in reach.items() if far > rounding]
    if not sides:
        return ()
    return (f"the region reaches out of the screen, {', '.join(sides)}: only what lies on the screen is counted",)
