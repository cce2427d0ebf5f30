"""What the means around the nodes of a far field are off from the intensity at them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

EDGE = 0.5
"""Largest error of a mean beside a kink or an edge, in units of the change from one second difference to the next. Where the
slope changes by s at a node, with steps h, the mean is off by sh/6 and the change is sh/2; where the light ends at one, the
mean is off by half the light and the change is up to that."""

SURE = 4.0
"""Standard errors that such a change must have: smooth light on chosen nodes has less."""

DIM = 0.02
"""Share of the peak below which rows may be too dark for the steps that their light needs."""

SECOND, THIRD = (1.0, 2.0, 1.0), (1.0, 3.0, 3.0, 1.0)
"""Weights, but for their signs, of three values in a second difference, and of four in the change from one to the next."""

SHARED = 12.5 / 20.0
"""Variance of that change, in units of that of values without correlation: that of neighbours is ¼. Of second
differences it is ⅔."""


class Blur(NamedTuple):
    """What nodes blur, row by row, each of shape (nodes,).

    Examples
    --------
    >>> Blur(off=np.array([0.1]), edge=np.array([0.0]), dark=np.array([False])).off.tolist()
    [0.1]
    """

    off: Array
    """The mean around the node less the intensity at it, as far as the curvature of the light tells."""
    edge: Array
    """How large that may be where the curvature changes from node to node: at kinks and edges."""
    dark: npt.NDArray[np.bool_]
    """Whether it is dark beside the node."""


def blur_of(gamma: tuple[float, ...], c: tuple[tuple[float, ...], ...], values: Array, error: Array) -> Blur:
    """What the means around nodes are off from the intensity at them, from the means themselves.

    Light that is smooth is off by h²/12 of its curvature, in γ and around the axis. About a pole light is even in γ, as
    I₀ + bγ²: with steps h, the pole's node is off by 0.3 bh², and the row beside it is 1.2 bh² above it.

    Parameters
    ----------
    gamma, c
        Rows [°], and the nodes of each, as `etendue.quantities.intensity_nodes.Nodes` has them.
    values, error : array, shape (nodes,)
        Intensity, and its error by the number of rays alone.

    Examples
    --------
    >>> rows = (0.0,), (0.0, 120.0, 240.0), (0.0, 120.0, 240.0), (0.0,)
    >>> blur = blur_of((0.0, 60.0, 120.0, 180.0), rows, np.array([4.0, 4, 4, 4, 0, 0, 0, 0]), np.full(8, 0.1))
    >>> float(blur.off[0]), blur.dark.tolist()
    (0.0, [False, True, True, True, True, True, True, True])
    """
    ends = np.cumsum([len(row) for row in c])[:-1]
    rows, errors = np.split(values, ends), np.split(error, ends)
    radians, nodes = np.radians(gamma), [np.array(row) for row in c]
    off, edge, dark = [], [], []
    for i, row in enumerate(rows):
        if i in (0, len(rows) - 1):
            beside = rows[1] if i == 0 else rows[-2]
            off.append((beside.mean() - row) / 4.0)
            edge.append(np.zeros(1))
            dark.append(np.full(row.size, not beside.any()))
            continue
        near = range(max(i - 2, 0), min(i + 3, len(rows)))
        beside_values, beside_errors = (
            np.stack([_on(nodes[i], nodes[j], those[j]) for j in near]) for those in (rows, errors)
        )
        at = i - near[0]
        below, above = beside_values[at - 1], beside_values[at + 1]
        # Along a row, of even steps, the second difference is the curvature times h².
        around = np.roll(row, 1) - 2.0 * row + np.roll(row, -1)
        off.append(_hat_bias(below, row, above, radians[i - 1 : i + 2]) + around / 12.0)
        edge.append(
            np.hypot(_along(radians[near[0] : near[-1] + 1], at, beside_values, beside_errors), _round(row, errors[i]))
        )
        dark.append((below == 0.0) | (above == 0.0) | (np.roll(row, 1) == 0.0) | (np.roll(row, -1) == 0.0))
    return Blur(np.concatenate(off), np.concatenate(edge), np.concatenate(dark))


def rising_rows(c: tuple[tuple[float, ...], ...], values: Array) -> npt.NDArray[np.bool_]:
    """Which nodes are in rows from a pole on of which each is brighter than the one before.

    Examples
    --------
    >>> rising_rows(((0.0,), (0.0, 180.0), (0.0,)), np.array([1.0, 2, 4, 5])).tolist()
    [True, True, True, False]
    """
    counts = [len(row) for row in c]
    rises = np.diff([row.mean() for row in np.split(values, np.cumsum(counts)[:-1])])
    rising = np.logical_and.accumulate(np.append(rises > 0.0, False))
    rising |= np.logical_and.accumulate(np.append(rises[::-1] < 0.0, False))[::-1]
    return np.repeat(rising, counts)


def _on(c: Array, nodes: Array, values: Array) -> Array:
    """The values of a row at other angles C."""
    return np.asarray(np.interp(c, np.append(nodes, nodes[0] + 360.0), np.append(values, values[0])))


def _hat_bias(before: Array, value: Array, after: Array, gamma: Array) -> Array:
    """What the mean over the hat of the middle one of three rows γ [rad] is off from the value at it.

    With slope I' and curvature I″ that is I' (m₁ + m₂ cot γ) + I″ m₂/2, since the mean is weighted by sin γ, with the hat's
    moments m₁ = (b − a)/3 and m₂ = (a² − ab + b²)/6 for sides a and b.
    """
    low, high = np.diff(gamma)
    rise, next_rise = (value - before) / low, (after - value) / high
    slope, bend = (rise * high + next_rise * low) / (low + high), 2.0 * (next_rise - rise) / (low + high)
    first, second = (high - low) / 3.0, (low**2 - low * high + high**2) / 6.0
    return np.asarray(slope * (first + second / math.tan(gamma[1])) + bend * second / 2.0)


def _along(gamma: Array, at: int, values: Array, errors: Array) -> Array:
    """The error that kinks and edges make along γ at row `at` of up to five."""
    gaps = np.diff(gamma)[:, None]
    step = (gamma[at + 1] - gamma[at - 1]) / 2.0
    bend = 2.0 * np.diff(np.diff(values, axis=0) / gaps, axis=0) / (gaps[1:] + gaps[:-1]) * step**2
    changes = [_beyond_noise(change, errors[k : k + 4], THIRD) for k, change in enumerate(np.diff(bend, axis=0))]
    own = _beyond_noise(bend[at - 1], errors[at - 1 : at + 2], SECOND)
    return _edge(own, np.min(changes, axis=0, initial=np.inf), np.max(changes, axis=0, initial=0.0))


def _round(values: Array, errors: Array) -> Array:
    """The error that kinks and edges make along a row."""
    if values.size < 4:
        return np.zeros(values.size)
    padded, padded_errors = (np.concatenate([row[-2:], row, row[:2]]) for row in (values, errors))
    beside = np.stack([padded_errors[k : k + values.size + 1] for k in range(4)])
    change = _beyond_noise(np.diff(padded, 3), beside, THIRD)
    own = _beyond_noise(np.diff(padded[1:-1], 2), beside[:3, 1:], SECOND)
    return _edge(own, np.minimum(change[:-1], change[1:]), np.maximum(change[:-1], change[1:]))


def _edge(own: Array, least: Array, most: Array) -> Array:
    """The error of a node, from its second difference and from the changes of that to the nodes beside it.

    An edge or a kink beyond the nodes beside it changes these, and leaves the second difference of the node small. One at
    the node itself may leave that small as well, but changes it to both sides.
    """
    return np.asarray(EDGE * np.minimum(most, np.maximum(least, own)))


def _beyond_noise(difference: Array, errors: Array, weights: tuple[float, ...]) -> Array:
    """The part of differences that is more than their noise; errors of the values, shape (values, n)."""
    variance = SHARED * (np.array(weights) ** 2) @ errors**2
    return np.asarray(np.sqrt(np.maximum(difference**2 - SURE**2 * variance, 0.0)))


def hidden_shapes(gamma: Array, c: tuple[tuple[float, ...], ...], planes: Array, values: Array, errors: Array) -> Array:
    """What rows whose nodes are far apart hide of beams that rows beside them show, shape (rows, planes).

    Where a beam ends, few rays are left to ask for narrow steps around the axis, and a wide hat spreads them. A row with
    nodes in steps of s° across holds light that varies no faster along γ either: rows within 2s of it have its shape. Those
    with half as many nodes or fewer are off by what their hats make of that shape, in the proportion of the light of both
    rows. Rows brighter than `DIM` have rays enough to have been asked themselves.

    Parameters
    ----------
    gamma, c
        Rows [°], and the nodes of each.
    planes : array
        [°] Those of all rows.
    values, errors : array, shape (rows, planes)
        Of each row, at all planes.

    Examples
    --------
    >>> planes = np.array([0.0, 90.0, 180.0, 270.0])
    >>> rows = np.array([[0.0] * 4, [80.0, 0, 0, 0], [1.0, 0, 1, 0], [0.0] * 4])
    >>> c = (0.0,), (0.0, 90.0, 180.0, 270.0), (0.0, 180.0), (0.0,)
    >>> hidden_shapes(np.array([0.0, 60.0, 100.0, 180.0]), c, planes, rows, np.zeros((4, 4)))[2].round(2).tolist()
    [1.0, 0.5, 0.0, 0.5]
    """
    result, dim = np.zeros(values.shape), DIM * values.max()
    gaps = np.diff(np.append(planes, planes[0] + 360.0))
    weight = (gaps + np.roll(gaps, 1)) / 720.0
    mean = values @ weight
    reach = 2.0 * np.array([np.diff((*row, 360.0)).min() for row in c]) * np.sin(np.radians(gamma))
    count = np.array([len(row) for row in c])
    for i in range(1, gamma.size - 1):
        near = (np.abs(gamma - gamma[i]) <= reach) & (count >= 2 * count[i]) & (mean > 0.0)
        if not 0.0 < values[i].max() < dim or not near.any():
            continue
        nodes = np.array(c[i])
        ends, unit = np.append(nodes, 360.0), np.eye(nodes.size)
        hats = np.stack([np.interp(planes, ends, np.append(row, row[0])) for row in unit])
        shown = (values[near] @ (hats * weight).T / (hats @ weight)) @ hats
        share = np.minimum((mean[i] + np.nan_to_num(errors[i]) @ weight) / mean[near], 1.0)
        result[i] = (np.abs(values[near] - shown) * share[:, None]).max(axis=0)
    return result
