"""Steps for light that varies smoothly: so narrow that what they blur is less than the noise of the rays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Counts = npt.NDArray[np.intp]

LEFT = 0.15
"""Squared bias that steps may leave in a table, as a share of the variance. The bias of a mean falls with h² and its
variance with 1/h, so that the squared error is least at ¼; at 0.15 it is 2 % above that, and a standard error covers 65 %
of the nodes instead of 62 %."""

ORDERS = 6
"""Harmonics around the axis that are looked at. What is narrower is found where it is, by halved steps."""

CERTAIN = 14.0
"""Power of a harmonic, in units of what noise has on average, above which it is there: noise has an exponential law, and
some 10^3 are looked at."""

FEWEST = 8.0
"""Equal rays that they are looked for in."""

NUMBERS = (2, 3, 4, 6, 8, 12, 16, 24, 32)
"""Nodes around the axis that are tried: planes of rows with different ones are mostly the same."""


class Harmonics(NamedTuple):
    """Sums Σ w exp(ikC) of rays, shape (`ORDERS` + 1, rows), and Σ w², shape (rows,).

    Examples
    --------
    >>> pair = Harmonics.of(np.array([0.0, 180.0]), np.ones(2), np.zeros(2, dtype=np.intp), 1)
    >>> np.abs(pair.sums[:3, 0]).round(12).tolist(), pair.squares.tolist()
    ([2.0, 0.0, 2.0], [2.0])
    """

    sums: npt.NDArray[np.complex128]
    squares: Array

    @classmethod
    def of(cls, c: Array, weight: Array, row: Counts, rows: int) -> Harmonics:
        """Of rays at C [°], by the number of their row."""
        turn = np.exp(1j * np.radians(c))
        sums = np.zeros((ORDERS + 1, rows), dtype=np.complex128)
        term = weight.astype(np.complex128)
        for order in range(ORDERS + 1):
            sums[order] = np.bincount(row, term.real, rows) + 1j * np.bincount(row, term.imag, rows)
            term *= turn
        return cls(sums, np.asarray(np.bincount(row, weight * weight, rows), dtype=np.float64))

    def certain(self) -> npt.NDArray[np.bool_]:
        """Which harmonics are there for certain in 1, 2, 4, … rows together, shape (`ORDERS` + 1,)."""
        found = np.zeros(ORDERS + 1, dtype=np.bool_)
        sums, squares = (
            np.cumsum(np.insert(self.sums, 0, 0.0, axis=1), axis=1),
            np.cumsum(np.insert(self.squares, 0, 0.0)),
        )
        width = 1
        while width < squares.size:
            noise = squares[width:] - squares[:-width]
            power = np.abs(sums[:, width:] - sums[:, :-width]) ** 2
            found |= ((power > CERTAIN * noise) & (power[0] > FEWEST * noise)).any(axis=1)
            width *= 2
        found[0] = False
        return found

    def shares(self) -> Array:
        """|c_k|² of light ∝ Σ c_k exp(ikC) with c_0 = 1, less what noise adds to it."""
        power, total = np.abs(self.sums) ** 2 - self.squares, np.abs(self.sums[0]) ** 2
        return np.asarray(np.divide(power, total, out=np.zeros(power.shape), where=total > 0.0).clip(0.0))


def nodes_around(apart: Harmonics, together: Harmonics, rays: Array) -> Counts:
    """So many nodes around the axis, for each row, that their bias is small beside their noise.

    The mean over hats leaves sinc²(k/N) of the harmonic k in the values of N nodes, and the straight lines between them
    leave as much of these: the mean square of the difference is 2 |c_k|² (1 − 2 s + s (2 + cos 2πk/N)/3) with
    s = sinc⁴(k/N). That of the noise is N/2n for n rays.

    Parameters
    ----------
    apart : Harmonics
        Of rows that have no ray in common: they tell which harmonics there are.
    together : Harmonics
        Of each row with the light of those beside it: how strong they are.
    rays : array, shape (rows,)
        Equal rays that each row will hold.

    Returns
    -------
    array, shape (rows,)
        1 where light is even.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> c = rng.uniform(0, 360, 20_000)
    >>> light = Harmonics.of(c, 1.0 + 0.5 * np.cos(np.radians(c - 20.0)), np.zeros(20_000, dtype=np.intp), 1)
    >>> [int(nodes_around(light, light, np.array([n]))[0]) for n in (10, 1000, 100_000)]
    [4, 12, 24]
    >>> even = Harmonics.of(c, np.ones(20_000), np.zeros(20_000, dtype=np.intp), 1)
    >>> int(nodes_around(even, even, np.array([100_000]))[0])
    1
    """
    share = np.where(apart.certain()[:, None], together.shares(), 0.0)
    order = np.arange(ORDERS + 1)[:, None]
    result = np.where(share.any(axis=0), NUMBERS[-1], 1)
    for number in reversed(NUMBERS):
        kept = np.sinc(order / number) ** 4
        blur = 1.0 - 2.0 * kept + kept * (2.0 + np.cos(2.0 * np.pi * order / number)) / 3.0
        # Of a harmonic with less than two nodes a period, nothing is told from another one.
        bias = 2.0 * (share * np.where(2 * order < number, blur, 1.0)).sum(axis=0)
        result[bias <= LEFT * number / (2.0 * np.maximum(rays, 1.0))] = number
    return np.where(share.any(axis=0), result, 1)


def parts_of(change: Array) -> Array:
    """Into how many parts steps are to be cut if halving them changes a value by so many standard errors.

    Halving takes ¾ of a bias that is ∝ h², and the change of a mean over a hat has half the variance of the mean itself. In
    a table, with the straight lines between nodes, the squared bias is 4.2 times that of a node on average, and the variance
    ¾: their ratio is 5 times the square of the change, and falls with the fifth power of the number of parts.

    Examples
    --------
    >>> parts_of(np.array([0.0, 1.0, 2.5, 5.5])).round(1).tolist()
    [0.0, 0.0, 2.8, 4.0]
    """
    return np.asarray((5.0 / LEFT * np.maximum(change * change - 1.0, 0.0)) ** 0.2)
