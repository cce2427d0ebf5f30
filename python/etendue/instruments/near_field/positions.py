"""`ArmPositions`: where the arm of a goniophotometer of type C stops, and what each stop counts for."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.angle_table import hat_integrals
from etendue.quantities.quadrature import gauss_legendre

Array = npt.NDArray[np.float64]

FINEST = 0.1
"""Smallest step [°]: 6.5 million positions."""

COARSEST = 30.0
"""Largest step in γ [°]: with larger ones the pole would count for less than nothing."""

FEWEST_RINGS = 3
"""Steps from a pole to 90° of which every second one still makes a spline that tells something."""

NODES = 12
"""Of the Gauss-Legendre rule between two positions; it integrates a cubic times sin γ to 10⁻¹⁶."""


@dataclasses.dataclass(frozen=True, eq=False)
class ArmPositions:
    """Stops in even steps of γ and C over the whole sphere; one at each pole, where C has no meaning.

    Parameters
    ----------
    step_gamma, step_c : number
        [°]; steps of γ go into 90°, steps of C into 360°.

    Raises
    ------
    ArgumentError
        If a step does not, is smaller than 0.1° or larger than 30° and 120°.

    Examples
    --------
    >>> stops = ArmPositions(30, 90)
    >>> len(stops), stops.gamma[:3].tolist(), stops.c[:3].tolist()
    (22, [0.0, 30.0, 30.0], [0.0, 0.0, 90.0])
    >>> round(float(stops.weight.sum() / np.pi), 9)
    4.0
    """

    step_gamma: float
    step_c: float

    def __post_init__(self) -> None:
        for name, step, whole in (("γ", self.step_gamma, 90.0), ("C", self.step_c, 360.0)):
            parts = whole / step if step > 0.0 else np.nan
            if not step >= FINEST or abs(parts - round(parts)) > 1e-9 * parts:
                raise ArgumentError(
                    f"a step of {step:g}° in {name}: {whole:g}° must be a whole number of steps, of {FINEST:g}° at least; "
                    "give 10, 5, 2.5 or 1, for instance."
                )
        if self.step_c > 120.0 or self.step_gamma > COARSEST:
            raise ArgumentError(
                f"steps of {self.step_gamma:g}° in γ and {self.step_c:g}° in C; give {COARSEST:g}° and 120° at most."
            )

    @property
    def rings(self) -> Array:
        """γ of each ring of positions [°], both poles among them."""
        return self.step_gamma * np.arange(2 * round(90.0 / self.step_gamma) + 1, dtype=np.float64)

    @property
    def planes(self) -> Array:
        """C of each plane [°]."""
        count = round(360.0 / self.step_c)
        return (360.0 / count) * np.arange(count, dtype=np.float64)

    def __len__(self) -> int:
        """Number of positions."""
        return 2 + (self.rings.size - 2) * self.planes.size

    @property
    def gamma(self) -> Array:
        """Of each position [°], shape (n,): ring by ring."""
        return np.concatenate([[0.0], np.repeat(self.rings[1:-1], self.planes.size), [180.0]])

    @property
    def c(self) -> Array:
        """Of each position [°], shape (n,)."""
        return np.concatenate([[0.0], np.tile(self.planes, self.rings.size - 2), [0.0]])

    @property
    def directions(self) -> Array:
        """Unit vectors to all positions, shape (n, 3)."""
        return _directions(self.gamma, self.c)

    @property
    def weight(self) -> Array:
        """Solid angle that each position counts for [sr], shape (n,): 4π together.

        Sums with them are integrals over the sphere of what is even in C and, in γ, a cubic spline above the horizon and
        another below it. Most lamps send light to one side only, so that their light has a kink at 90°.
        """
        return self._dealt(_spline_integrals(self.rings))

    def missed(self, values: Array, errors: Array) -> float:
        """How much of the integral over the sphere may be missed between the positions, by what fewer of them make of it.

        Every second ring and the others make splines in γ of their own, every second or third plane an integral in C. Half
        of the largest difference from the integral by all positions, less what the errors explain twice over, stands for
        each of both ways. That is about the error of light that ends at an angle, one to four times that of light with a
        kink, as of a tilted disk, and more than that of light that changes smoothly.

        Parameters
        ----------
        values, errors : array, shape (n,)
            At the positions, with standard errors in the same unit.

        Returns
        -------
        float
            In that unit times sr.

        Examples
        --------
        >>> stops = ArmPositions(5, 15)
        >>> even, cut = np.ones(len(stops)), (stops.gamma < 52) * np.cos(np.radians(stops.gamma))
        >>> round(stops.missed(even, 0 * even), 6), bool(stops.missed(cut, 0 * cut) > 0.05)
        (0.0, True)
        """
        whole = self.weight
        found = 0.0
        for way in (self._fewer_rings(), self._fewer_planes(whole)):
            largest = 0.0
            for weight in way:
                other = weight - whole
                noise = float(np.linalg.norm(other * errors))
                largest = max(largest, float(other @ values) ** 2 - (2.0 * noise) ** 2)
            found += largest
        return 0.5 * float(np.sqrt(found))

    def _fewer_rings(self) -> Iterator[Array]:
        """Weights of the positions on every second ring, with poles and horizon, and of those on the others."""
        half = (self.rings.size - 1) // 2
        if half < FEWEST_RINGS:
            return
        from_pole = np.minimum(np.arange(self.rings.size), np.arange(self.rings.size)[::-1])
        for odd in (0, 1):
            kept = (from_pole % 2 == odd) | (from_pole == 0) | (from_pole == half)
            rings = np.zeros(self.rings.size)
            rings[kept] = _spline_integrals(self.rings[kept])
            yield self._dealt(rings)

    def _fewer_planes(self, whole: Array) -> Iterator[Array]:
        """Weights of the positions on every second plane, or third where every second stands opposite to the others."""
        count = self.planes.size
        apart = next((n for n in (4, 3, 2) if count % n == 0), 1)
        apart = 2 if apart == 4 else apart
        for first in range(apart if apart > 1 else 0):
            weight = whole.copy()
            planes = weight[1:-1].reshape(-1, count)
            planes *= np.where(np.arange(count) % apart == first, float(apart), 0.0)
            yield weight

    @property
    def hat(self) -> Array:
        """Solid angle of the hat about each position [sr], shape (n,): 4π together.

        A hat is the weight with which `drawn` spreads the light of a position: 1 there and falling linearly to its
        neighbours. Light spread so has at each position just what was seen there.
        """
        return self._dealt(hat_integrals(self.rings))

    def _dealt(self, rings: Array) -> Array:
        """Integrals over γ of the rings, turned about the axis and dealt to their positions."""
        ring = 2.0 * np.pi * rings
        inner = np.repeat(ring[1:-1] / self.planes.size, self.planes.size)
        return np.concatenate([ring[:1], inner, ring[-1:]])

    def table(self, values: Array) -> Array:
        """Values of the positions as a table, shape (planes, rings)."""
        inner = values[1:-1].reshape(self.rings.size - 2, self.planes.size).T
        ends = np.ones((self.planes.size, 1))
        return np.hstack([values[0] * ends, inner, values[-1] * ends])

    def nearest(self, gamma: float, c: float) -> int:
        """The position closest to a direction."""
        towards = _directions(np.array([float(gamma)]), np.array([float(c)]))[0]
        return int(np.argmax(self.directions @ towards))

    def drawn(self, stops: npt.NDArray[np.intp], rng: np.random.Generator) -> Array:
        """A direction near each of some positions, drawn with the weight that they have in between, shape (n, 3).

        That weight falls linearly to the neighbours, in γ and in C. Drawn by the solid angles of their hats (`hat`), a light
        that is constant stays so, and any other is linear between positions.
        """
        gamma_of, n = self.gamma[stops], len(stops)
        gamma = np.zeros(n)
        left = np.arange(n)
        while left.size:
            middle = gamma_of[left]
            trial = np.abs(middle + self.step_gamma * (rng.random(left.size) - rng.random(left.size)))
            trial = np.where(trial > 180.0, 360.0 - trial, trial)
            top = np.where(np.abs(middle - 90.0) <= self.step_gamma, 90.0, 0.0)
            edge = np.where(middle < 90.0, middle + self.step_gamma, middle - self.step_gamma)
            largest = np.sin(np.radians(np.where(top > 0.0, top, edge)))
            taken = rng.random(left.size) * largest < np.sin(np.radians(trial))
            gamma[left[taken]] = trial[taken]
            left = left[~taken]
        pole = (gamma_of == 0.0) | (gamma_of == 180.0)
        c = self.c[stops] + self.step_c * (rng.random(n) - rng.random(n))
        c = np.where(pole, 360.0 * rng.random(n), c)
        return _directions(gamma, c)


def _directions(gamma: Array, c: Array) -> Array:
    g, a = np.radians(gamma), np.radians(c)
    return np.stack([np.sin(g) * np.cos(a), np.sin(g) * np.sin(a), np.cos(g)], axis=1)


def _spline_integrals(rings: Array) -> Array:
    """∫ s(γ) sin γ dγ as weights of the values at the rings; s: one cubic spline above 90°, one below.

    The rings lie alike above and below, 0°, 90° and 180° among them. At a pole its slope is zero, since what is averaged
    over C is even in γ; at 90° its third derivative is continuous across the last position ("not a knot").
    """
    count = (rings.size - 1) // 2
    half = _half_integrals(np.radians(rings[: count + 1]))
    weights = np.zeros(rings.size)
    weights[: count + 1] += half
    weights[count:] += half[::-1]
    return weights


def _half_integrals(x: Array) -> Array:
    """For positions from the pole to 90° [rad], two at least."""
    n = x.size - 1
    h = np.diff(x)
    # Slopes d of the spline from its values y: A d = B y.
    a, b = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    a[0, 0] = 1.0
    for i in range(1, n):
        left, right = 1.0 / h[i - 1], 1.0 / h[i]
        a[i, i - 1 : i + 2] = left, 2.0 * (left + right), right
        b[i, i - 1 : i + 2] = -3.0 * left**2, 3.0 * (left**2 - right**2), 3.0 * right**2
    if n == 1:
        a[1, :], b[1, :] = (1.0, 1.0), (-2.0 / h[0], 2.0 / h[0])  # a parabola
    else:
        # The third derivative, 6 (d + d' - 2 secant)/h², is the same in the last two intervals.
        left, right = h[n - 2] ** -2, h[n - 1] ** -2
        a[n, n - 2 :] = left, left - right, -right
        b[n, n - 2 :] = (
            -2.0 * left / h[n - 2],
            2.0 * (left / h[n - 2] + right / h[n - 1]),
            -2.0 * right / h[n - 1],
        )
    slopes = np.linalg.solve(a, b)
    nodes, factors = gauss_legendre(NODES)
    t = 0.5 * (nodes + 1.0)
    weights = np.zeros(n + 1)
    for i in range(n):
        hermite = np.stack([
            (1 + 2 * t) * (1 - t) ** 2,
            t * (1 - t) ** 2 * h[i],
            t**2 * (3 - 2 * t),
            t**2 * (t - 1) * h[i],
        ])  # fmt: skip
        left, left_slope, right, right_slope = hermite @ (0.5 * h[i] * factors * np.sin(x[i] + h[i] * t))
        weights[i] += left
        weights[i + 1] += right
        weights += left_slope * slopes[i] + right_slope * slopes[i + 1]
    return weights
