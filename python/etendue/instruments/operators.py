"""What an instrument does to a lobe, as a matrix: a slice convolved with a slice, or a round lobe behind a round blur."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.extras import scipy_part
from etendue.instruments.goniometer_scan import GoniometerScan
from etendue.quantities.quadrature import gauss_legendre

Array = npt.NDArray[np.float64]
OperatorName = Literal["rings", "slice"]

FAINT = 1e-4
"""Of the largest value of an instrument function: below, it is noise."""

DARK = 1e-3
"""Of the largest value of a scan: one that has more at an end ends on the lobe."""

FEWEST_PAIRS = 2
"""Positions on either side of a middle that have a counterpart."""

FINE = 16
"""Parts of a step between positions of an instrument function."""

LARGE = 200
"""Rows from which on a matrix is kept as a sparse one."""

PER_STEP, AZIMUTHS = 4, 24
"""Nodes of the rings by step and by half a turn: the matrix is right to 1e-4 of a signature that is five steps wide."""


@dataclasses.dataclass(frozen=True, eq=False)
class Operator:
    """A lobe by angle from its middle → what a detector sees.

    Parameters
    ----------
    name : {"rings", "slice"}
        Which of the two.
    matrix : array, shape (n, m)
        From f cosθ at the nodes to the flux over the solid angle at the positions.
    nodes : array, shape (m,)
        Angles of the unknowns [°]: of cubic B-splines from the middle if "rings", else those of the positions.
    angle : array, shape (n,)
        Of the positions from the middle of the lobe [°].
    reach : number
        Angle from its middle at which the instrument function ends [°].
    """

    name: OperatorName
    matrix: Array
    nodes: Array
    angle: Array
    reach: float

    def at_positions(self, values: Array) -> Array:
        """Values at the nodes as values at the positions; `values` of shape (m,) or (m, k)."""
        if self.name == "slice":
            return values
        steps = np.abs(self.angle) / self.nodes[1]
        k = np.floor(steps).astype(np.intp)
        found = np.zeros((self.angle.size, *values.shape[1:]))
        for shift, part in zip((-1, 0, 1, 2), _cubic(steps - k), strict=True):
            # Even about the middle; beyond the last node as there.
            own = np.minimum(np.abs(k + shift), self.nodes.size - 1)
            found += part.reshape((-1,) + (1,) * (values.ndim - 1)) * values[own]
        return found

    def start(self, values: Array) -> Array:
        """Where the iteration begins: of rings at the measured values, both sides averaged; of a slice at an even one.

        The second is Richardson's own, which the thesis does not change; from the first, rings take fewer iterations.
        `values` of shape (n,) or (n, k), the result (m,) or (m, k).
        """
        if self.name == "slice":
            return np.asarray(np.ones_like(values) * np.maximum(values, 0.0).mean(axis=0))
        inner = self.nodes[self.nodes <= max(self.angle[-1], -self.angle[0])]
        columns = values.reshape(values.shape[0], -1).T
        found = []
        for column in columns:
            sides = np.stack([np.interp(s * self.nodes, self.angle, column, np.nan, np.nan) for s in (1.0, -1.0)])
            known = np.isfinite(sides)
            mean = np.where(known, sides, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
            found.append(np.where(known.any(axis=0), mean, mean[max(inner.size - 1, 0)]))
        return np.stack(found, axis=1).reshape((self.nodes.size, *values.shape[1:]))


def _cubic(u: Array) -> tuple[Array, Array, Array, Array]:
    """Weights of four neighbouring cubic B-splines between the second and third; none is below 0, their sum is 1."""
    v = 1.0 - u
    return v**3 / 6.0, (3.0 * u**3 - 6.0 * u**2 + 4.0) / 6.0, (3.0 * v**3 - 6.0 * v**2 + 4.0) / 6.0, u**3 / 6.0


def middle_of(angle: Array, values: Array) -> float:
    """The angle about which values are most nearly symmetrical [°]: where they agree best with themselves, mirrored.

    Where they end on the lobe, what has no counterpart is left out, and the middle lies within half a width of the largest.

    Examples
    --------
    >>> angle = np.arange(-5.0, 5.01, 0.1)
    >>> round(middle_of(angle, np.exp(-0.5 * (angle - 0.234) ** 2)), 3)
    0.234
    >>> part = np.arange(-5.0, 1.01, 0.1)
    >>> round(middle_of(part, np.exp(-0.5 * (part - 0.234) ** 2)), 3)
    0.234
    """
    step = float(np.diff(angle).min())
    even = np.arange(angle[0], angle[-1] + 0.5 * step, step)
    y = np.interp(even, angle, values)
    if max(y[0], y[-1]) > DARK * y.max():
        return _middle_of_part(even, y)
    size = 1 << (2 * y.size - 1).bit_length()
    both = np.fft.irfft(np.fft.rfft(y, size) ** 2, size)[: 2 * y.size - 1]
    k = int(np.clip(np.argmax(both), 1, both.size - 2))
    a, b, c = both[k - 1 : k + 2]
    off = 0.5 * (a - c) / (a - 2.0 * b + c) if a - 2.0 * b + c < 0.0 else 0.0
    return float(even[0] + 0.5 * (k + off) * step)


def _middle_of_part(angle: Array, values: Array) -> float:
    """Where values at even steps differ least, in the mean square, from those that they have a counterpart with."""
    top = int(np.argmax(values))
    bright = values > 0.5 * values[top]
    dim = np.flatnonzero(~bright)
    below, above = dim[dim < top], dim[dim > top]
    reach = min(top - int(below[-1]) if below.size else values.size, int(above[0]) - top if above.size else values.size)
    least = min(FEWEST_PAIRS, (values.size - 1) // 2)
    # In half steps: between two positions there are pairs as well.
    trial = np.arange(max(2 * (top - reach), 2 * least), min(2 * (top + reach), 2 * (values.size - 1 - least)) + 1)
    if not trial.size:
        return float(angle[top])
    best = int(trial[np.argmin([_unlikeness(values, twice) for twice in trial.tolist()])])
    # A parabola through its neighbours with the same pairs, as many for each.
    count = min(best - 2, 2 * (values.size - 1) - best - 2) // 2 + 1
    a, b, c = (_unlikeness(values, best + 2 * step, count) for step in (-1, 0, 1))
    bend = a - 2.0 * b + c
    between = float(np.clip(0.5 * (a - c) / bend, -0.5, 0.5)) if bend > 0.0 else 0.0
    return float(angle[0] + (0.5 * best + between) * (angle[1] - angle[0]))


def _unlikeness(values: Array, twice: int, most: int | None = None) -> float:
    """Mean square of what values differ by from their counterparts about `twice`/2; of the `most` innermost pairs."""
    count = min(twice, 2 * (values.size - 1) - twice) // 2 + 1
    inner = np.arange(min(count, most or count))
    return float(np.mean((values[twice // 2 - inner] - values[(twice + 1) // 2 + inner]) ** 2))


def folded(signature: GoniometerScan) -> tuple[Array, Array]:
    """An instrument function by angle from its middle: angles from 0 [°] and values, both sides averaged, largest 1.

    Cubic and without overshoots between positions.

    Raises
    ------
    ArgumentError
        If it holds no light.
    """
    values = np.maximum(signature.flux, 0.0)
    if not values.any():
        raise ArgumentError("the instrument function holds no light")
    off = signature.angle - middle_of(signature.angle, values)
    step = signature.step
    reach = float(min(-off[0], off[-1]))
    if reach < 2.0 * step:
        raise ArgumentError("the instrument function ends on one side of its middle: scan it on both")
    radius = np.arange(0.0, reach + 1e-9, step)
    mean = 0.5 * (np.interp(radius, off, values) + np.interp(-radius, off, values))
    mean = mean / mean.max()
    last = int(np.flatnonzero(mean > FAINT)[-1]) + 1
    radius, mean = radius[: last + 1], np.append(mean[:last], 0.0) if last < radius.size else mean
    fine = np.linspace(0.0, radius[-1], FINE * (radius.size - 1) + 1)
    return fine, _monotone(fine, radius, mean)


def _monotone(x: Array, nodes: Array, values: Array) -> Array:
    """Piecewise cubic through values at even nodes, even about the first, that never overshoots [Fritsch1984]_."""
    h = nodes[1]
    rise = np.diff(values) / h
    both = rise[1:] * rise[:-1]
    mean = rise[1:] + rise[:-1]
    inner = np.where(both > 0.0, 2.0 * both / np.where(mean == 0.0, 1.0, mean), 0.0)
    slope = np.concatenate([[0.0], inner, [0.0]])
    k = np.clip((x / h).astype(np.intp), 0, nodes.size - 2)
    u = x / h - k
    flat = values[k] * (1 + 2 * u) * (1 - u) ** 2 + values[k + 1] * u * u * (3 - 2 * u)
    return np.asarray(flat + h * (slope[k] * u * (1 - u) ** 2 + slope[k + 1] * u * u * (u - 1)))


def sparse_if_large(matrix: Array) -> Any:
    """The same; most of it is 0, which SciPy makes use of if it is there and the matrix is large."""
    if matrix.shape[0] < LARGE:
        return matrix
    try:
        return scipy_part("sparse").csr_array(matrix)
    except ImportError:
        return matrix


def operator_of(scan: GoniometerScan, signature: GoniometerScan, name: OperatorName, middle: float) -> Operator:
    """The operator of a name; see `Operator`.

    ``"rings"``: the lobe is round, a sum of cubic B-splines of the smallest step of the scan. What the instrument shows of a
    point is round as well, its radius being the instrument function's own slice: the bare beam is a point of light, and the
    detector passes through its image. So each matrix element is the integral of a ring over that blur on the sphere.

    ``"slice"``: the slice of the scan convolved with the slice of the instrument function, as the thesis does it.

    Raises
    ------
    ArgumentError
        If the instrument function is wider than the scan or holds no light.
    """
    radius, blur = folded(signature)
    reach = float(radius[-1])
    angle = scan.angle - middle
    width = float(scan.angle[-1] - scan.angle[0])
    if 2.0 * reach >= width:
        raise ArgumentError(
            f"the instrument function is {2.0 * reach:.3g}° wide, the scan {width:.3g}°: scan to larger angles"
        )
    if name == "slice":
        matrix = np.interp(np.abs(angle[:, None] - angle[None, :]), radius, blur, right=0.0)
        step = np.gradient(angle)
        # What a flat lobe gives is itself.
        return Operator(
            name, matrix * step / np.trapezoid(np.append(blur[:0:-1], blur), dx=radius[1]), angle, angle, reach
        )
    step = scan.step
    # The last positions see what lies beyond them, as far as the blur reaches.
    nodes = np.arange(0.0, np.abs(angle).max() + reach + step, step)
    return Operator(name, _rings(np.abs(angle), nodes, radius, blur), nodes, angle, reach)


def _rings(angle: Array, nodes: Array, radius: Array, blur: Array) -> Array:
    """∫ of each ring over the blur about each position; positions that are alike are computed once."""
    h = float(nodes[1])
    distinct, own = np.unique(np.round(angle, 9), return_inverse=True)
    reach = float(radius[-1])
    cells = int(np.ceil(2.0 * reach / h)) + 2
    x, w = gauss_legendre(PER_STEP)
    first = np.maximum(np.floor((distinct - reach) / h), 0.0)
    # θ of all nodes in the cells that the blur of a position meets.
    cell = first[:, None] + np.arange(cells)
    u = 0.5 * (x + 1.0)
    theta = np.radians((cell[:, :, None] + u) * h)
    alpha = np.radians(distinct)[:, None, None]
    product = np.sin(alpha) * np.sin(theta)
    least = np.sin(0.5 * (alpha - theta)) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        part = (np.sin(0.5 * np.radians(reach)) ** 2 - least) / product
    part = np.where(product > 0.0, part, np.where(least < np.sin(0.5 * np.radians(reach)) ** 2, 1.0, 0.0))
    turn = 2.0 * np.arcsin(np.sqrt(np.clip(part, 0.0, 1.0)))
    y, v = gauss_legendre(AZIMUTHS)
    around = np.zeros(theta.shape)
    for yk, vk in zip(0.5 * (y + 1.0), 0.5 * v, strict=True):
        gamma = 2.0 * np.arcsin(np.sqrt(np.clip(least + product * np.sin(0.5 * turn * yk) ** 2, 0.0, 1.0)))
        around += vk * np.interp(np.degrees(gamma), radius, blur, right=0.0)
    around *= 2.0 * turn * np.sin(theta) * (0.5 * np.radians(h)) * w
    total = 2.0 * np.pi * np.trapezoid(*_finely(radius, blur))
    matrix = np.zeros((distinct.size, nodes.size + cells + 2))
    rows = np.arange(distinct.size)[:, None]
    column = cell.astype(np.intp)
    for shift, part in zip((-1, 0, 1, 2), _cubic(u), strict=True):
        spline = np.minimum(np.abs(column + shift), matrix.shape[1] - 1)
        np.add.at(matrix, (np.broadcast_to(rows, spline.shape), spline), around @ part)
    # The last spline stands for those that no blur reaches in full.
    inside = matrix[:, : nodes.size]
    inside[:, -1] += matrix[:, nodes.size :].sum(axis=1)
    return np.asarray((inside / total)[own])


def _finely(radius: Array, blur: Array) -> tuple[Array, Array]:
    fine = np.linspace(0.0, radius[-1], 4 * radius.size)
    return np.interp(fine, radius, blur) * np.sin(np.radians(fine)), np.radians(fine)
