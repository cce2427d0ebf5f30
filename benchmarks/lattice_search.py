"""The search for the generating vector of `crates/sampling/src/lattice.rs`.

A rank-1 lattice of 2^m points, for all m from 4 to 20 at once, in twelve dimensions that are used in pairs: place in the
pixel, direction, places on sources. The figure of merit is P₂, the squared error of the worst periodic function of
smoothness 1: for two dimensions the mean of ω(xᵢ) ω(xⱼ), ω(x) = 2π²(x² − x + 1/6), for many that of Π (1 + γ ω(xₖ)) − 1. The
residues modulo 256 are found by coordinate descent from random starts, for pairs of 16 to 256 points; the further binary
digits one by one, by pairs and products up to 4096 points and by products alone, component by component, beyond
([Cools2006]).

python benchmarks/lattice_search.py     # prints the vector, and what its pairs are worth
"""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
DIMENSIONS, DIGITS, FIRST, STARTS = 12, 20, 8, 12
GAMMA = 0.35
WITHIN, ACROSS = 1.0, 0.08


def weights() -> Array:
    w = np.full((DIMENSIONS, DIMENSIONS), ACROSS)
    for k in range(0, DIMENSIONS, 2):
        w[k, k + 1] = w[k + 1, k] = WITHIN
    np.fill_diagonal(w, 0.0)
    return w


WEIGHTS = weights()


def omega(g: int, n: int) -> Array:
    x = (np.arange(n, dtype=np.int64) * (g % n) % n) / n
    return 2 * np.pi**2 * (x * x - x + 1 / 6)


def pairs(table: Array) -> float:
    return float((WEIGHTS * (table @ table.T / table.shape[1])).sum() / 2)


def few_points() -> list[int]:
    """The vector modulo 2^FIRST."""
    odd = range(1, 1 << FIRST, 2)
    known = {m: {g: omega(g, 1 << m) for g in odd} for m in range(4, FIRST + 1)}

    def cost(g: list[int]) -> float:
        return sum(pairs(np.array([known[m][v] for v in g])) * 2 ** (1.5 * m) for m in known)

    best: tuple[float, list[int]] = (np.inf, [])
    for start in range(STARTS):
        g = [1, *(int(v) for v in np.random.default_rng(start).integers(0, 128, DIMENSIONS - 1) * 2 + 1)]
        least, better = cost(g), True
        while better:
            better = False
            for k, v in itertools.product(range(1, DIMENSIONS), odd):
                old, g[k] = g[k], v
                if (now := cost(g)) < least - 1e-12:
                    least, better = now, True
                else:
                    g[k] = old
        best = min(best, (least, list(g)))
    return best[1]


def by_pairs(g: list[int], m: int) -> list[int]:
    """One binary digit more, by pairs and, lightly, by products."""
    n, digit, rng = 1 << m, 1 << (m - 1), np.random.default_rng(m)

    def cost(table: Array) -> float:
        return pairs(table) + 0.3 * float(np.prod(1 + GAMMA * table, axis=0).mean() - 1)

    best: tuple[float, list[int]] = (np.inf, g)
    for start in range(5 * STARTS):
        h = [g[0], *(v + (digit if start > 0 and rng.random() < 0.5 else 0) for v in g[1:])]
        table = np.array([omega(v, n) for v in h])
        least, better = cost(table), True
        while better:
            better = False
            for k in range(1, DIMENSIONS):
                row = table[k].copy()
                table[k] = omega(h[k] ^ digit, n)
                if (now := cost(table)) < least - 1e-15:
                    least, better, h[k] = now, True, h[k] ^ digit
                else:
                    table[k] = row
        best = min(best, (least, h))
    return best[1]


def by_products(g: list[int], m: int) -> list[int]:
    """One binary digit more, component by component."""
    n, digit = 1 << m, 1 << (m - 1)
    product, found = 1 + GAMMA * omega(g[0], n), [g[0]]
    for v in g[1:]:
        options = [1 + GAMMA * omega(v + extra, n) for extra in (0, digit)]
        choice = int(np.argmin([(product * o).mean() for o in options]))
        found.append(v + choice * digit)
        product *= options[choice]
    return found


def main() -> None:
    g = few_points()
    for m in range(FIRST + 1, DIGITS + 1):
        g = by_pairs(g, m) if m <= 12 else by_products(g, m)
    print(g)
    for m in range(4, 13):
        worth = [float((omega(g[k], 1 << m) * omega(g[k + 1], 1 << m)).mean()) for k in range(0, DIMENSIONS, 2)]
        print(f"2^{m} points, P₂ of the pairs:", *(f"{p:.4f}" for p in worth))


if __name__ == "__main__":
    main()
