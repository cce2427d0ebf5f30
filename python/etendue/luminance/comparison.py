"""How well one luminance map agrees with another, and what runs along one line of a map."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.luminance.regions import AnyRegion, Mask, check_region
from etendue.quantities.arguments import require_known, require_number
from etendue.quantities.luminance_map import LuminanceMap, check_luminance_map
from etendue.quantities.powers_of_ten import rounded
from etendue.quantities.printable import printable
from etendue.units import MM2_PER_M2

Array = npt.NDArray[np.float64]
DeadRule = Literal["zero", "exclude"]
DEAD_RULES: tuple[DeadRule, ...] = get_args(DeadRule)

SAME_GEOMETRY = 1e-6
"""Relative difference up to which two lengths count as equal: numbers that passed through a text or float32 header."""


@dataclasses.dataclass(frozen=True)
class MapStatistics:
    """One map in figures.

    Parameters
    ----------
    mean, maximum, minimum : float
        Of the luminance of the pixels compared, in the map's unit. The maximum of a noisy map is biased upwards, the
        minimum downwards.
    uniformity : float
        U = minimum / mean ([Audenaert2014]_ table 4.1); NaN where the mean is not above 0.
    intensity : float
        What these pixels send to the observer [cd] or [W/sr]: Σ L · apparent pixel area.
    dead_pixels : int
        Dead pixels in the region, counted or not.
    """

    mean: float
    maximum: float
    minimum: float
    uniformity: float
    intensity: float
    dead_pixels: int

    def summary(self, unit: str) -> str:
        """The figures in one line of text, luminances in `unit`."""
        return (
            f"mean {rounded(self.mean)}, max {rounded(self.maximum)}, min {rounded(self.minimum)} {unit}, "
            f"uniformity {rounded(self.uniformity, 3)}, dead pixels {self.dead_pixels}"
        )


def _percent(share: float, style: str = ".3f") -> str:
    return "undefined" if np.isnan(share) else f"{100.0 * share:{style}} %"


@dataclasses.dataclass(frozen=True, eq=False)
class Comparison:
    """The agreement of a map with a reference; made by `compare`.

    Parameters
    ----------
    ncc : float
        Normalised cross correlation, eq. 3.5 of [Audenaert2014]_, -1 to 1. It compares shapes only: a map of twice the
        luminance scores 1. The contrast between source and background dominates it, so that two maps of the same
        silhouette score high whatever they show inside; compare inside a region to see more. NaN on a constant map.
    nrmse_thesis : float
        Eq. 3.6 as printed: Σ|Ls - Lm| / (N · max of both maps). In spite of its name a normalised *mean absolute*
        error. It rewards outliers: one bright noisy pixel raises the maximum it is divided by. Kept because the
        numbers of the thesis are given in it.
    nrmse : float
        √(mean (Ls - Lm)²) / max of the reference: the root mean square error that the name promises.
    difference : array, shape (rows, columns)
        Eq. 3.4 [%], 0 to 200: 100 · 2 |Ls - Lm| / (Ls + Lm). NaN outside the pixels compared and where the sum is not
        above 0.
    reduced_chi_square : float
        Mean of z² over the pixels alive in both maps whose standard errors are known and not both 0, with
        z = (Ls - Lm) / √(σs² + σm²): about 1 when the maps differ by their noise only. NaN without such pixels.
    chi_square_pixels : int
        How many pixels that mean is taken over.
    pixels : int
        N, the number of pixels compared.
    test_statistics, reference_statistics : MapStatistics
        Mean, extremes, uniformity and intensity of each map over the pixels compared.
    test, reference : LuminanceMap
        The maps.
    compared : array of bool, shape (rows, columns)
        The pixels compared.
    region : Region, PolygonRegion or None
        Where they were compared; None for the whole screen.
    notes : tuple of str
        In what maps differ that were compared in spite of it, what could not be computed, and why.
    """

    ncc: float
    nrmse_thesis: float
    nrmse: float
    difference: Array
    reduced_chi_square: float
    chi_square_pixels: int
    pixels: int
    test_statistics: MapStatistics
    reference_statistics: MapStatistics
    test: LuminanceMap
    reference: LuminanceMap
    compared: Mask
    region: AnyRegion | None = None
    notes: tuple[str, ...] = ()

    @property
    def intensity_ratio(self) -> float:
        """Intensity of the test map over that of the reference, in the pixels compared; NaN if the latter is 0."""
        reference = self.reference_statistics.intensity
        return self.test_statistics.intensity / reference if reference else math.nan

    @property
    def signed_difference(self) -> Array:
        """100 · (Ls - Lm) / max of the reference [%], shape (rows, columns): above 0 where the test map is brighter.

        NaN outside the pixels compared, and everywhere if the reference is black.
        """
        brightest = self.reference_statistics.maximum
        if not brightest > 0.0:
            return np.full(self.compared.shape, np.nan)
        return np.where(self.compared, 100.0 * self._deviation / brightest, np.nan)

    @property
    def difference_in_sigma(self) -> Array:
        """Z = (Ls - Lm) / √(σs² + σm²), shape (rows, columns).

        NaN outside the pixels compared, where a map is dead, and where the standard errors are unknown or both 0.
        """
        error = np.hypot(self.test.standard_error, self.reference.standard_error)
        known = self.compared & (error > 0.0) & np.isfinite(self.test.values) & np.isfinite(self.reference.values)
        return np.where(known, self._deviation, np.nan) / np.where(known, error, 1.0)

    @property
    def _deviation(self) -> Array:
        return _dead_as_zero(self.test.values) - _dead_as_zero(self.reference.values)

    @property
    def median_difference(self) -> float:
        """Median of `difference` [%] where it is defined; NaN where it is not defined anywhere."""
        defined = self.difference[~np.isnan(self.difference)]
        return float(np.median(defined)) if defined.size else math.nan

    def summary(self) -> str:
        """The result in a few lines of text."""
        agreement = (
            f"NCC {_percent(self.ncc)}, NRMSE {_percent(self.nrmse)} (true RMSE / max of the reference), "
            f"{_percent(self.nrmse_thesis)} (eq. 3.6), {self.pixels} pixels"
        )
        significance = (
            f"reduced χ² {rounded(self.reduced_chi_square)} over {self.chi_square_pixels} pixels, "
            f"intensity ratio {rounded(self.intensity_ratio)}, "
            f"median difference {_percent(self.median_difference / 100.0, '.3g')}"
        )
        maps = (("test", self.test_statistics), ("reference", self.reference_statistics))
        figures = (f"{name}: {statistics.summary(self.reference.unit)}" for name, statistics in maps)
        return "\n".join((agreement, significance, *figures, *(f"note: {printable(note)}" for note in self.notes)))

    def to_dict(self) -> dict[str, Any]:
        """Every number as plain data for JSON (undefined numbers are None): all but the maps and the image."""
        measures = (
            "ncc",
            "nrmse_thesis",
            "nrmse",
            "reduced_chi_square",
            "chi_square_pixels",
            "pixels",
            "intensity_ratio",
        )
        return {
            **{name: _defined(getattr(self, name)) for name in measures},
            "median_difference_percent": _defined(self.median_difference),
            "unit": self.reference.unit,
            "test": {name: _defined(figure) for name, figure in dataclasses.asdict(self.test_statistics).items()},
            "reference": {
                name: _defined(figure) for name, figure in dataclasses.asdict(self.reference_statistics).items()
            },
            "region_mm": dataclasses.asdict(self.region) if self.region else None,
            "notes": list(self.notes),
        }


def _defined(number: float) -> float | None:
    return None if math.isnan(number) else number


def compare(
    test: LuminanceMap,
    reference: LuminanceMap,
    region: AnyRegion | None = None,
    dead: DeadRule = "zero",
    *,
    ignore_geometry: bool = False,
) -> Comparison:
    """Compare a luminance map with a reference by the measures of [Audenaert2014]_ 3.2.3 and two better ones.

    Parameters
    ----------
    test : LuminanceMap
        The map to be judged, Ls (the simulated one in the thesis).
    reference : LuminanceMap
        The map it is judged by, Lm (the measured one in the thesis).
    region : Region or PolygonRegion, optional
        Where to compare; the whole screen if not given.
    dead : {"zero", "exclude"}
        ``"zero"``: a dead pixel counts as 0, as in the thesis. ``"exclude"``: a pixel that is dead in either map is
        left out.
    ignore_geometry : bool
        Compare maps of different screen sizes, planes or observers, pixel by pixel. The region is then measured on
        the reference's screen.

    Returns
    -------
    Comparison
        The measures; its documentation says what each one is blind to.

    Raises
    ------
    ArgumentError
        If one is no map of luminance, the maps differ in unit, pixels, screen or observer, or no pixel is left to compare.
    UnknownNameError
        If there is no such rule for dead pixels.

    Examples
    --------
    >>> from etendue.quantities.observer import Observer, Screen
    >>> from etendue.quantities.provenance import Provenance
    >>> def lmap(*values):
    ...     return LuminanceMap([values], [[1.0] * 4], [[9] * 4], Observer(0, 0, 1000), Screen(4, 1, 4, 1),
    ...                         provenance=Provenance(software="example"))
    >>> result = compare(lmap(1, 3, 7, 5), lmap(2, 3, 5, 10))
    >>> round(result.ncc, 6), result.nrmse_thesis, round(result.nrmse, 6), round(result.reduced_chi_square, 6)
    (0.580381, 0.2, 0.273861, 3.75)
    >>> result.difference.round(2).tolist()
    [[66.67, 0.0, 33.33, 66.67]]
    """
    require_known(dead, DEAD_RULES, "rule for dead pixels")
    for lmap in (test, reference):
        check_luminance_map(lmap, "compare")
    differing = _check_comparable(test, reference, ignore_geometry)
    if region is not None:
        check_region(region, "compare")
    used = region.mask(reference.screen) if region else np.ones(reference.screen.shape, dtype=np.bool_)
    alive = ~(np.isnan(test.values) | np.isnan(reference.values))
    dead_in_region = [int((np.isnan(lmap.values) & used).sum()) for lmap in (test, reference)]
    if dead == "exclude":
        used = used & alive
        if not used.any():
            raise ArgumentError("compare: every pixel is dead in one of the maps. Use dead='zero' or another region.")
    maps = (test, reference)
    simulated, measured = (_dead_as_zero(lmap.values[used]) for lmap in maps)
    chi_square, chi_square_pixels = _reduced_chi_square(test, reference, used & alive)
    difference = np.full(used.shape, np.nan)
    difference[used] = _percentage_difference(simulated, measured)
    figures = [
        _statistics(values, lmap, used, count)
        for values, lmap, count in zip((simulated, measured), maps, dead_in_region, strict=True)
    ]
    result = Comparison(
        ncc=_ncc(simulated, measured),
        nrmse_thesis=_ratio(float(np.abs(simulated - measured).mean()), float(max(simulated.max(), measured.max()))),
        nrmse=_ratio(_root_mean_square(simulated - measured), float(measured.max())),
        difference=difference,
        reduced_chi_square=chi_square,
        chi_square_pixels=chi_square_pixels,
        pixels=int(used.sum()),
        test_statistics=figures[0],
        reference_statistics=figures[1],
        test=test,
        reference=reference,
        compared=used,
        region=region,
    )
    pixelwise = f"compared pixel by pixel, although {'; '.join(differing)}"
    return dataclasses.replace(result, notes=(*([pixelwise] if differing else []), *_what_is_undefined(result)))


def _dead_as_zero(values: Array) -> Array:
    return np.where(np.isnan(values), 0.0, values)


def _check_comparable(test: LuminanceMap, reference: LuminanceMap, ignore_geometry: bool) -> list[str]:
    """What of observer and screen differs, which is an error unless it is to be ignored."""
    if test.unit != reference.unit:
        raise ArgumentError(
            f"compare: the test map is in {test.unit}, the reference in {reference.unit}. Convert the ray set first."
        )
    if test.screen.shape != reference.screen.shape:
        raise ArgumentError(
            f"compare: the test map has {test.screen.rows} × {test.screen.columns} pixels, the reference "
            f"{reference.screen.rows} × {reference.screen.columns} (rows × columns). Make both on one screen."
        )
    differing = list(_geometric_differences(test, reference))
    if differing and not ignore_geometry:
        raise ArgumentError(
            f"compare: {'; '.join(differing)}. Make both for one observer and screen, or use ignore_geometry=True."
        )
    return differing


def _geometric_differences(test: LuminanceMap, reference: LuminanceMap) -> Iterator[str]:
    """One phrase per thing that differs."""
    ours, theirs = test.screen, reference.screen
    if not np.allclose([ours.width, ours.height], [theirs.width, theirs.height], rtol=SAME_GEOMETRY, atol=0.0):
        yield f"screens differ: {ours.width:g} × {ours.height:g} mm against {theirs.width:g} × {theirs.height:g} mm"
    if ours.plane != theirs.plane:
        yield f"screen planes differ: {ours.plane!r} against {theirs.plane!r}"
    one, other = test.observer, reference.observer
    reach = SAME_GEOMETRY * other.distance
    if not np.allclose(one.target, other.target, rtol=0.0, atol=reach):
        yield f"observers' targets differ: {one.target} against {other.target} mm"
    elif not np.allclose(one.position, other.position, rtol=0.0, atol=reach):
        yield (
            f"observers differ: θ = {one.theta:g}°, φ = {one.phi:g}°, {one.distance:g} mm against "
            f"θ = {other.theta:g}°, φ = {other.phi:g}°, {other.distance:g} mm"
        )
    # At θ = 180° the azimuth turns the screen without moving the observer, as up and roll do anywhere.
    elif not np.allclose(ours.axes(one), ours.axes(other), rtol=0.0, atol=SAME_GEOMETRY):
        turns = (f"φ = {who.phi:g}°, up = {who.up}, roll = {who.roll:g}°" for who in (one, other))
        yield f"observers differ in what is up for them: {' against '.join(turns)}"


def _ncc(simulated: Array, measured: Array) -> float:
    """Eq. 3.5; NaN if either map is constant."""
    if simulated.min() == simulated.max() or measured.min() == measured.max():
        return math.nan
    a, b = (values - values.mean() for values in (simulated, measured))
    # Scaled to 1 first, so that no square overflows or vanishes.
    a, b = a / np.abs(a).max(), b / np.abs(b).max()
    return float(np.clip((a @ b) / math.sqrt((a @ a) * (b @ b)), -1.0, 1.0))


def _percentage_difference(simulated: Array, measured: Array) -> Array:
    """Eq. 3.4 [%]."""
    total = simulated + measured
    defined = total > 0.0
    result = np.full(total.shape, np.nan)
    result[defined] = 200.0 * np.abs(simulated - measured)[defined] / total[defined]
    return result


def _root_mean_square(error: Array) -> float:
    largest = float(np.abs(error).max())
    return largest * math.sqrt(np.mean((error / largest) ** 2)) if largest > 0.0 else 0.0


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator > 0.0 else math.nan


def _reduced_chi_square(test: LuminanceMap, reference: LuminanceMap, used: Mask) -> tuple[float, int]:
    error = np.hypot(test.standard_error, reference.standard_error)
    known = used & np.isfinite(error) & (error > 0.0)
    z = (test.values[known] - reference.values[known]) / error[known]
    return (float(np.mean(z * z)) if z.size else math.nan), int(z.size)


def _statistics(values: Array, lmap: LuminanceMap, used: Mask, dead_pixels: int) -> MapStatistics:
    mean, minimum = float(values.mean()), float(values.min())
    apparent = lmap.screen.pixel_area / MM2_PER_M2 * lmap.screen.cosine(lmap.observer)[used]
    return MapStatistics(
        mean=mean,
        maximum=float(values.max()),
        minimum=minimum,
        uniformity=_ratio(minimum, mean),
        intensity=float(values @ apparent),
        dead_pixels=dead_pixels,
    )


def _what_is_undefined(result: Comparison) -> Iterator[str]:
    if math.isnan(result.ncc):
        yield "NCC is undefined: a map is constant over the pixels compared"
    if math.isnan(result.nrmse):
        yield "NRMSE is undefined: the reference has no pixel above 0"
    if math.isnan(result.nrmse_thesis):
        yield "NRMSE of eq. 3.6 is undefined: neither map has a pixel above 0"
    if not result.chi_square_pixels:
        yield "χ² is undefined: no pixel is alive in both maps with a known standard error"


@dataclasses.dataclass(frozen=True, eq=False)
class CrossSection:
    """The pixels along one line of a map; made by `cross_section`.

    Parameters
    ----------
    axis : {"x", "y"}
        The axis that the line runs along: ``"x"`` for a row of pixels.
    at : float
        Centre of that row or column on the other axis [mm].
    position : array, shape (n,)
        Pixel centres along `axis`, from the target [mm], rising.
    pitch : float
        Extent of a pixel along `axis` [mm].
    values, standard_error : array, shape (n,)
        Of those pixels, in `unit`; NaN where dead (and where the error is unknown).
    quantity, unit : str
        What `values` are.
    source : str
        Where the map comes from.
    """

    axis: Literal["x", "y"]
    at: float
    position: Array
    pitch: float
    values: Array
    standard_error: Array
    quantity: str
    unit: str
    source: str = ""


def cross_section(lmap: LuminanceMap, *, x: float | None = None, y: float | None = None) -> CrossSection:
    """Cut a map along the row that contains `y` or the column that contains `x`.

    Parameters
    ----------
    lmap : LuminanceMap
        The map.
    x, y : float
        Exactly one of them: a coordinate on the screen, from the target [mm] (x right, y up). On the border between
        two pixels the one of larger x, or of smaller y, is taken; the screen's own edge belongs to the outermost pixel.

    Returns
    -------
    CrossSection
        Positions, values and standard errors along the line.

    Raises
    ------
    ArgumentError
        If both or neither of `x` and `y` are given, or the coordinate is off the screen.

    Examples
    --------
    >>> from etendue.quantities.observer import Observer, Screen
    >>> from etendue.quantities.provenance import Provenance
    >>> lmap = LuminanceMap([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], np.ones((2, 3)), np.ones((2, 3)), Observer(0, 0, 1000),
    ...                     Screen(3, 4, 3, 2), provenance=Provenance(software="example"))
    >>> line = cross_section(lmap, y=-0.5)
    >>> line.position.tolist(), line.values.tolist(), line.at
    ([-1.0, 0.0, 1.0], [4.0, 5.0, 6.0], -1.0)
    >>> cross_section(lmap, x=1).values.tolist()
    [6.0, 3.0]
    """
    if (x is None) == (y is None):
        raise ArgumentError("cross_section: give exactly one of x (cut along a column) and y (cut along a row), in mm.")
    check_luminance_map(lmap, "cross_section")
    for name, place in (("x", x), ("y", y)):
        if place is not None:
            require_number(place, f"cross_section: {name}", "a place on the screen in mm")
    screen = lmap.screen
    axis: Literal["x", "y"]
    if y is not None:
        row = _pixel_index(-y, screen.height, screen.rows, f"y = {y} mm")
        axis, position, pitch, at = "x", screen.x, screen.width / screen.columns, screen.y[row]
        values, error = lmap.values[row], lmap.standard_error[row]
    elif x is not None:
        column = _pixel_index(x, screen.width, screen.columns, f"x = {x} mm")
        # From the bottom up, so that positions rise.
        axis, position, pitch, at = "y", screen.y[::-1], screen.height / screen.rows, screen.x[column]
        values, error = lmap.values[::-1, column], lmap.standard_error[::-1, column]
    source = lmap.provenance.source
    return CrossSection(axis, float(at), position, pitch, values, error, lmap.quantity, lmap.unit, source)


def _pixel_index(coordinate: float, extent: float, count: int, name: str) -> int:
    if not abs(coordinate) <= extent / 2:
        raise ArgumentError(f"cross_section: {name} is off the screen, which ends at ±{extent / 2:g} mm.")
    return min(int((coordinate / extent + 0.5) * count), count - 1)
