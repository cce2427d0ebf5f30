"""Points joined into curves: chains of links, and rings of curves whose ends meet."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def chains(count: int, links: npt.NDArray[np.int64]) -> list[list[int]]:
    """Numbers of points in the order in which links join them.

    Parameters
    ----------
    count : int
        Number of points.
    links : array, shape (m, 2)
        Pairs of points. Where more than two links meet, chains end.

    Returns
    -------
    list of lists
        A closed chain ends with its first point. Points without a link are in none.

    Examples
    --------
    >>> chains(5, np.array([[1, 0], [1, 2], [3, 4], [4, 3]]))
    [[0, 1, 2], [3, 4, 3]]
    """
    at: list[list[int]] = [[] for _ in range(count)]
    for number, (a, b) in enumerate(links.tolist()):
        at[a].append(number)
        at[b].append(number)
    ends = links.tolist()
    used = [False] * len(ends)

    def follow(start: int, link: int) -> list[int]:
        chain, here = [start], start
        while not used[link]:
            used[link] = True
            a, b = ends[link]
            here = b if a == here else a
            chain.append(here)
            onwards = [n for n in at[here] if not used[n]]
            if len(at[here]) != 2 or not onwards:
                break
            link = onwards[0]
        return chain

    open_ends = [point for point in range(count) if len(at[point]) not in {0, 2}]
    # The check comes after the links of the chain before have been used up.
    starts = ((point, link) for point in [*open_ends, *range(count)] for link in at[point])
    return [follow(point, link) for point, link in starts if not used[link]]


def rings(curves: list[Array], reach: float) -> list[Array]:
    """Closed curves out of curves whose ends meet.

    Parameters
    ----------
    curves : list of arrays, each of shape (k, 2)
        Open and closed ones, in any sense.
    reach : float
        How far apart ends may lie that meet.

    Returns
    -------
    list of arrays, each of shape (k, 2)
        Each ends in its first point; what does not close is left out.

    Examples
    --------
    >>> half = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])
    >>> rings([half, half[[2, 0]]], 1e-9)[0].tolist()
    [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [0.0, 0.0]]
    """
    closed = [curve for curve in curves if (curve[0] == curve[-1]).all()]
    rest = [curve for curve in curves if not (curve[0] == curve[-1]).all()]
    if not rest:
        return closed
    ends = np.array([curve[side] for curve in rest for side in (0, -1)])
    meeting = _meeting(ends, reach)
    # A curve goes from one meeting place to another.
    links = meeting.reshape(-1, 2)
    lonely = [curve for curve, (a, b) in zip(rest, links, strict=True) if a == b]
    closed += [np.concatenate([curve, curve[:1]]) for curve in lonely]
    apart = [i for i, (a, b) in enumerate(links) if a != b]
    by_pair: dict[tuple[int, int], list[int]] = {}
    for i in apart:
        a, b = links[i].tolist()
        by_pair.setdefault((min(a, b), max(a, b)), []).append(i)
    for chain in chains(int(meeting.max()) + 1, links[apart].reshape(-1, 2)):
        if chain[0] != chain[-1]:
            continue
        parts = []
        for a, b in itertools.pairwise(chain):
            i = by_pair[min(a, b), max(a, b)].pop(0)
            parts.append(rest[i] if links[i, 0] == a else rest[i][::-1])
        ring = np.concatenate([part[:-1] for part in parts] + [parts[0][:1]])
        closed.append(ring)
    return closed


def _meeting(ends: Array, reach: float) -> npt.NDArray[np.int64]:
    """A number for each end, the same for ends that lie within reach of each other."""
    size = max(reach, np.finfo(np.float64).tiny) * 4.0
    numbers = np.full(len(ends), -1)
    cells: dict[tuple[float, float], list[int]] = {}
    taken = 0
    for i, (x, y) in enumerate(ends.tolist()):
        column, row = np.floor(x / size), np.floor(y / size)
        near = [
            j
            for dx in (-1.0, 0.0, 1.0)
            for dy in (-1.0, 0.0, 1.0)
            for j in cells.get((column + dx, row + dy), ())
            if np.hypot(*(ends[j] - ends[i])) <= reach
        ]
        if near:
            numbers[i] = numbers[near[0]]
        else:
            numbers[i], taken = taken, taken + 1
        cells.setdefault((column, row), []).append(i)
    return numbers
