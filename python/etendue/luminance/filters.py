"""Digital filters for luminance maps: the four of [Audenaert2014]_ 2.2.3, with errors and flux accounted for."""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.luminance.redrawn_maps import redrawn
from etendue.quantities.arguments import require_known, require_number
from etendue.quantities.luminance_map import LuminanceMap, check_luminance_map, errors_parted, notes_that_stay
from etendue.quantities.powers_of_ten import counted, rounded

Array = npt.NDArray[np.float64]
Counts = npt.NDArray[np.int64]
ArrayOrCounts = TypeVar("ArrayOrCounts", Array, Counts)

SMOOTHING = ("filter ", "denoised ")
"""How steps of the provenance begin that let the errors of pixels depend on each other."""

TOGETHER = "pixels of light fields and of smoothed maps err together: standard errors are no less for it"

FRACTION = "a finite fraction > 0, such as 0.2"

DRAWS, FEWEST_DRAWS = 24, 6
"""Maps drawn anew for the errors of the selective filters: each error is then known to 15 %, or to 30 % by the fewest."""

MANY_PIXELS = 1 << 20
"""Beyond these the fewer maps are drawn, the more pixels there are."""

SUMMED = ("value", "error", "rays", "unknown")
"""Fields of `_Stack` that are summed over the pixels used."""

PIXELS_AT_ONCE = 1 << 14
"""Pixels that the selective filters work on together, so that their intermediate arrays stay in the cache."""


@dataclasses.dataclass(frozen=True)
class FilterKind:
    """One row of the registry `FILTERS`.

    Parameters
    ----------
    name : str
        The name users give.
    weighted : bool
        Near pixels count more (fig. 2.3, right) instead of all alike (fig. 2.3, left).
    selective : bool
        Only pixels that resemble the central one count (eq. 2.6, fig. 2.4).
    """

    name: str
    weighted: bool
    selective: bool


FILTERS: dict[str, FilterKind] = {
    kind.name: kind
    for kind in (
        FilterKind("average", weighted=False, selective=False),
        FilterKind("weighted", weighted=True, selective=False),
        FilterKind("selective", weighted=False, selective=True),
        FilterKind("selective-weighted", weighted=True, selective=True),
    )
}
"""Every filter by name."""


def filter_map(lmap: LuminanceMap, kind: str, size: int | tuple[int, int] = 5, gamma: float = 0.2) -> LuminanceMap:
    """Smooth a luminance map with a filter of [Audenaert2014]_ 2.2.3.

    Parameters
    ----------
    lmap : LuminanceMap
        The map f. It is not changed.
    kind : {"average", "weighted", "selective", "selective-weighted"}
        Name of the filter; see `kernel` for the weights. The selective filters average only the pixels f(x+s, y+t)
        with ``|f(x+s, y+t) - f(x, y)| < gamma f(x, y)`` (eq. 2.6, strictly), normalised for each pixel (fig. 2.4).
    size : odd int, or pair (rows, columns) of odd ints
        Size of the kernel [pixels].
    gamma : float
        γ of eq. 2.6, > 0: the largest fraction by which a pixel may deviate and still be averaged. (A sentence in
        2.3.3 of the thesis says the opposite; the equation rules.) The linear filters do not use it.

    Returns
    -------
    LuminanceMap
        The filtered map g of eq. 2.5, with one more provenance step and a note that gives the intensity before and
        after. No filter keeps it exactly, and the selective ones lose some: a pixel that noise made bright has a wider
        window γ f(x, y) than one that noise made dark, and is pulled down more than the other is pulled up. `rays`
        counts the rays in the pixels used.

    Raises
    ------
    UnknownNameError
        If there is no such filter.
    ArgumentError
        If `size` is not odd and positive, `gamma` is not positive and finite, or the map is none of luminance.

    Notes
    -----
    *Border.* The kernel is cut at the edge of the map and normalised by the weights that remain, so a constant map
    stays constant.

    *Dead pixels.* No ray came, so the unbiased estimate of the pixel's luminance is 0, and that is what enters the
    average; to leave the pixel out would lift its neighbours. A pixel stays dead where no ray came into the whole
    kernel. Eq. 2.6 selects nothing around a pixel that is dead or not above 0: it then keeps what it has.

    *Standard errors.* σ²(g) = Σ w² σ²(f) for independent pixels of f, which those of the cone estimator are. Pixels of light
    fields, and of maps that were smoothed before, err together; of these it is σ(g) = Σ w σ(f), which no correlation
    exceeds, and a note says so. Of a scene the lines of sight are independent from pixel to pixel, and what the map says
    that its pixels have in common (`LuminanceMap.common_error`), as what a light field in it does not know, is added up
    likewise. A pixel whose error is unknown makes the errors unknown of all that use it.
    Dead pixels add nothing, although a pixel without rays is not known exactly. For the selective filters the noise itself
    decides on the selection, so that of independent pixels the error is made by drawing the map 24 times about g (6 to 24
    times beyond a million pixels) with the noise of f, always the same draws, and filtering these maps: what comes out
    scatters by it. Of maps whose pixels err together it is that of the pixels *once selected*, which is optimistic.

    Examples
    --------
    >>> from etendue.quantities.observer import Observer, Screen
    >>> from etendue.quantities.provenance import Provenance
    >>> f = np.array([[100.0, 118.0, 500.0], [98.0, np.nan, 520.0]])
    >>> lmap = LuminanceMap(f, 0.1 * f, np.where(np.isnan(f), 0, 100), Observer(0, 0, 1000), Screen(3, 2, 3, 2),
    ...                     provenance=Provenance(software="example"))
    >>> filter_map(lmap, "average", 3).values.round(2).tolist()
    [[79.0, 222.67, 284.5], [79.0, 222.67, 284.5]]
    >>> smooth = filter_map(lmap, "selective", 3)
    >>> smooth.values.round(2).tolist()
    [[105.33, 105.33, 510.0], [99.0, nan, 510.0]]
    >>> smooth.notes[0]
    'selective 3×3, γ = 0.2: intensity 0.001336 → 0.00133 cd (−0.47 %); dead pixels 1 → 1'
    """
    check_luminance_map(lmap, "filter_map")
    if isinstance(kind, str) and kind == "opt":
        raise ArgumentError("filter_map: 'opt' is the denoiser, which needs no setting; call et.denoise_map(lmap).")
    require_known(kind, FILTERS, "filter")
    chosen = FILTERS[kind]
    rows, columns = _kernel_size(size)
    if chosen.selective:
        require_number(gamma, "filter_map: gamma", FRACTION)
        if not (math.isfinite(gamma) and gamma > 0.0):
            raise ArgumentError(f"filter_map: gamma is {gamma}; give {FRACTION}.")
    # What reaches beyond both edges from every pixel is never used.
    reached = [min(size, 2 * length - 1) for size, length in zip((rows, columns), lmap.values.shape, strict=True)]
    weights = _weights(reached[0], chosen.weighted), _weights(reached[1], chosen.weighted)
    together = pixels_err_together(lmap)
    power, width = (1 if together else 2), (gamma if chosen.selective else None)
    shared, own = errors_parted(lmap.values, lmap.standard_error, lmap.common_error)
    stack = _Stack.of(lmap, lmap.standard_error if together else own**2)
    filtered = _filter(stack, weights, width, power)
    if chosen.selective and not together:
        variance = _redrawn_variance(stack, filtered, weights, gamma, _draws(lmap))
        filtered = dataclasses.replace(filtered, error=variance)
    if lmap.common_error and not together:
        added = _filter(_Stack.of(lmap, shared), weights, width, 1)
        filtered = dataclasses.replace(filtered, error=filtered.error + added.error**2)
    label = f"{kind} {rows}×{columns}" + (f", γ = {gamma:g}" if chosen.selective else "")
    result = filtered.put_into(lmap, f"filter {label}", power)
    return result.replace(notes=(*notes_that_stay(lmap), *_report(lmap, result, label, chosen)))


def pixels_err_together(lmap: LuminanceMap) -> bool:
    """Whether the errors of neighbouring pixels are known to be much the same: of a light field, or smoothed before.

    Examples
    --------
    >>> from etendue.quantities.observer import Observer, Screen
    >>> lmap = LuminanceMap([[1.0, 2.0]], [[0.1, 0.1]], [[90, 50]], Observer(0, 0, 1000), Screen(2, 1, 2, 1))
    >>> [pixels_err_together(one) for one in (lmap, filter_map(lmap, "average", 3), lmap.replace(rays=[[-1, -1]]))]
    [False, True, True]
    """
    # Rays are counted by the cone, and lines of sight are as independent; light fields count none.
    counted = lmap.rays[~np.isnan(lmap.values)] >= 0
    return not counted.any() or any(step.startswith(SMOOTHING) for step in lmap.provenance.steps)


def kernel(kind: str, size: int | tuple[int, int] = 5) -> Array:
    """Weights w(s, t) of a filter of eq. 2.5, normalised to Σ w = 1.

    Parameters
    ----------
    kind : str
        Name of the filter. The selective ones have the weights of their linear sisters (fig. 2.4).
    size : odd int, or pair (rows, columns) of odd ints
        Size [pixels].

    Returns
    -------
    array, shape (rows, columns)
        All alike for ``"average"``; for ``"weighted"`` w ∝ 2^-(|s|+|t|), which is the printed kernel of fig. 2.3
        when the size is 5 × 5.

    Raises
    ------
    UnknownNameError
        If there is no such filter.
    ArgumentError
        If `size` is not odd and positive.

    Examples
    --------
    >>> (100 * kernel("weighted", 5)).round(9).astype(int).tolist()
    [[1, 2, 4, 2, 1], [2, 4, 8, 4, 2], [4, 8, 16, 8, 4], [2, 4, 8, 4, 2], [1, 2, 4, 2, 1]]
    """
    require_known(kind, FILTERS, "filter")
    rows, columns = _kernel_size(size)
    weights: Array = np.outer(_weights(rows, FILTERS[kind].weighted), _weights(columns, FILTERS[kind].weighted))
    return weights / float(weights.sum())


def _kernel_size(size: int | tuple[int, int]) -> tuple[int, int]:
    try:
        pair = (size, size) if not isinstance(size, (tuple, list)) else size
        rows, columns = (operator.index(number) for number in pair)
    except (TypeError, ValueError):
        rows = columns = 0
    if rows < 1 or columns < 1 or rows % 2 == 0 or columns % 2 == 0:
        raise ArgumentError(f"filter size is {size!r}; give an odd number of pixels such as 5, or a pair of such.")
    return rows, columns


def _weights(size: int, weighted: bool) -> Array:
    """One axis of the kernel; both kernels are outer products. Their scale cancels."""
    distance = np.abs(np.arange(size) - size // 2)
    return np.ldexp(1.0, -distance) if weighted else np.ones(size)


@dataclasses.dataclass(frozen=True)
class _Stack:
    """What is filtered together: arrays of one shape."""

    value: Array
    """Luminance, 0 where dead."""
    error: Array
    """Standard error to the power that adds up, 0 where dead, NaN where unknown."""
    rays: Counts
    """Rays, 0 where dead or unknown."""
    unknown: Counts
    """1 where the pixel is alive but its number of rays is unknown."""
    alive: Counts
    """1 where the pixel is not dead."""

    @classmethod
    def of(cls, lmap: LuminanceMap, error: Array) -> _Stack:
        dead = np.isnan(lmap.values)
        return cls(
            value=np.where(dead, 0.0, lmap.values),
            error=np.where(dead, 0.0, error),
            rays=np.where(dead, 0, np.maximum(lmap.rays, 0)),
            unknown=(~dead & (lmap.rays < 0)).astype(np.int64),
            alive=(~dead).astype(np.int64),
        )

    def put_into(self, lmap: LuminanceMap, step: str, power: int) -> LuminanceMap:
        dead = self.alive == 0
        return lmap.replace(
            values=np.where(dead, np.nan, self.value),
            standard_error=np.where(dead, np.nan, self.error ** (1.0 / power)),
            rays=np.where(self.unknown > 0, -1, self.rays),
            provenance=lmap.provenance.then(step),
        )


def _filter(stack: _Stack, weights: tuple[Array, Array], gamma: float | None, power: int) -> _Stack:
    """With the kernel of these weights along rows and columns; selectively if there is a `gamma`."""
    if gamma is None:
        return _filter_linearly(stack, *weights, power)
    means = _selected_means(stack.value, dataclasses.asdict(stack), weights, gamma, power)
    return _Stack(**means, alive=stack.alive)


def _filter_linearly(stack: _Stack, row_weights: Array, column_weights: Array, power: int) -> _Stack:
    """Eq. 2.5 with a kernel that is an outer product: first down the columns, then along the rows."""

    def spread(array: ArrayOrCounts, power: int) -> ArrayOrCounts:
        down = _correlate(array, row_weights**power)
        return _correlate(down.T, column_weights**power).T

    rows, columns = stack.value.shape
    inside = np.outer(_correlate(np.ones(rows), row_weights), _correlate(np.ones(columns), column_weights))
    return _Stack(
        value=spread(stack.value, 1) / inside,
        error=spread(stack.error, power) / inside**power,
        rays=spread(stack.rays, 0),
        unknown=spread(stack.unknown, 0),
        alive=spread(stack.alive, 0),
    )


def _correlate(array: ArrayOrCounts, weights: Array) -> ArrayOrCounts:
    """Σ_s w(s) f(x + s) along the first axis, the kernel cut at both ends."""
    result = np.zeros_like(array)
    for offset, weight in _offsets(weights, len(array)):
        here, there = _overlap(offset, len(array), 0, len(array))
        result[here] += array.dtype.type(weight) * array[there]
    return result


def _draws(lmap: LuminanceMap) -> int:
    return max(FEWEST_DRAWS, min(DRAWS, DRAWS * MANY_PIXELS // max(lmap.values.size, 1)))


def _redrawn_variance(stack: _Stack, filtered: _Stack, weights: tuple[Array, Array], gamma: float, draws: int) -> Array:
    """Variance of the filtered map among maps drawn about it; NaN where unknown."""
    if not (stack.error > 0.0).any():
        return filtered.error
    known = filtered.value
    sums, squares = np.zeros_like(known), np.zeros_like(known)
    for again in redrawn(known, stack.value, np.sqrt(stack.error), draws):
        deviation = _selected_means(again, {"value": again}, weights, gamma)["value"] - known
        sums += deviation
        squares += deviation**2
    variance = np.maximum(squares - sums**2 / draws, 0.0) / (draws - 1)
    # Unknown errors reach all that used them, and a pixel not above 0 keeps what it has.
    return np.where(np.isnan(filtered.error) | ~(stack.value > 0.0), filtered.error, variance)


def _selected_means(
    value: Array, arrays: dict[str, npt.NDArray[Any]], weights: tuple[Array, Array], gamma: float, power: int = 1
) -> dict[str, npt.NDArray[Any]]:
    """Means and sums over the pixels that resemble each one (eq. 2.6), in bands of rows: those of `SUMMED` in `arrays`."""
    rows, columns = value.shape
    arrays = {name: array for name, array in arrays.items() if name in SUMMED}
    result = {name: np.zeros_like(array) for name, array in arrays.items()}
    band = max(1, PIXELS_AT_ONCE // columns)
    for start in range(0, rows, band):
        stop = min(start + band, rows)
        for name, array in _select_band(value, arrays, weights, gamma, power, start, stop).items():
            result[name][start:stop] = array
    return result


def _select_band(
    value: Array,
    arrays: dict[str, npt.NDArray[Any]],
    weights: tuple[Array, Array],
    gamma: float,
    power: int,
    start: int,
    stop: int,
) -> dict[str, npt.NDArray[Any]]:
    rows, columns = value.shape
    centre = value[start:stop]
    allowed = gamma * centre
    total = np.zeros_like(centre)
    sums = {name: np.zeros_like(array[start:stop]) for name, array in arrays.items()}
    for down, row_weight in _offsets(weights[0], rows):
        here_rows, there_rows = _overlap(down, rows, start, stop)
        for right, column_weight in _offsets(weights[1], columns):
            here_columns, there_columns = _overlap(right, columns, 0, columns)
            here, there = (here_rows, here_columns), (there_rows, there_columns)
            chosen = np.abs(value[there] - centre[here]) < allowed[here]  # eq. 2.6
            weight = row_weight * column_weight
            share = weight * chosen
            total[here] += share
            for name, sum_ in sums.items():
                if name == "error":
                    # `where` and not a product: the error of a pixel that was not chosen may be unknown (NaN).
                    np.add(sum_[here], weight**power * arrays[name][there], out=sum_[here], where=chosen)
                else:
                    sum_[here] += (share if name == "value" else chosen) * arrays[name][there]
    found = total > 0.0
    scale = np.where(found, total, 1.0)
    for name, divisor in (("value", scale), ("error", scale**power)):
        if name in sums:
            sums[name] = sums[name] / divisor
    return {name: np.where(found, array, arrays[name][start:stop]) for name, array in sums.items()}


def _offsets(weights: Array, length: int) -> Iterator[tuple[int, float]]:
    """The offsets s that lead from some pixel of a line to another one, with w(s)."""
    half = len(weights) // 2
    reach = min(half, length - 1)
    return ((offset, weights[half + offset]) for offset in range(-reach, reach + 1))


def _overlap(offset: int, length: int, start: int, stop: int) -> tuple[slice, slice]:
    """Slices for x and x + offset, with x in start..stop and both on the line; the first counts from `start`."""
    first, last = max(start, -offset), min(stop, length - offset)
    last = max(first, last)
    return slice(first - start, last - start), slice(first + offset, last + offset)


def _report(before: LuminanceMap, after: LuminanceMap, label: str, kind: FilterKind) -> Iterator[str]:
    unit = "cd" if before.flux_unit == "lm" else "W/sr"
    old, new = before.intensity, after.intensity
    change = f" ({100.0 * (new - old) / old:+.2f} %)".replace("-", "−") if old else ""
    dead = f"; dead pixels {before.dead_pixels} → {after.dead_pixels}" if before.dead_pixels else ""
    yield f"{label}: intensity {rounded(old)} → {counted(new, unit)}{change}{dead}"
    if pixels_err_together(before) and np.isfinite(before.standard_error).any():
        yield f"{label}: {TOGETHER}"
    if before.common_error and not pixels_err_together(before):
        yield f"{label}: pixels have an error of {before.common_error:.2%} in common, of which means take nothing"
    if kind.selective and np.isfinite(before.standard_error).any():
        if pixels_err_together(before):
            yield f"{label}: standard errors are optimistic, because the noise itself selected the pixels that are averaged"
        else:
            yield (
                f"{label}: standard errors hold what the noise does by selecting the pixels that are averaged, found on "
                f"{_draws(before)} maps drawn with the noise of this one"
            )
