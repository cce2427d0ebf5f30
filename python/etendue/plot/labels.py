"""Names beside what they name: each in the emptiest place near it."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

CELL = 0.03
"""Side of the cells in which it is counted what is drawn [inches]."""
ANCHORS = 24
"""Places of a thing that its name may stand beside."""
DISTANCES = (0.05, 0.11, 0.2, 0.34)
"""Between a name and its place [inches]; beyond the second one, a line leads from one to the other."""
WIDTH, HEIGHT = 0.6, 1.25
"""Of a letter, in sizes of the type."""


@dataclasses.dataclass(frozen=True)
class Label:
    """A name with its place; lengths in inches from the lower left corner of the diagram.

    Parameters
    ----------
    x, y : float
        The middle of the name.
    anchor : tuple of 2 floats
        What it names.
    leads : bool
        Whether a line should lead there.
    """

    x: float
    y: float
    anchor: tuple[float, float]
    leads: bool


class LabelPlacer:
    """Finds places for names in a diagram.

    Parameters
    ----------
    width, height : float
        Of the diagram [inches].
    size : float
        Of the type [points].

    Examples
    --------
    >>> placer = LabelPlacer(3.0, 2.0, 7.5)
    >>> placer.draw(np.array([[0.0, 1.0], [3.0, 1.0]]))
    >>> label = placer.place("floor", [np.array([[0.0, 1.0], [3.0, 1.0]])])
    >>> abs(label.y - 1.0) > 0.05, label.leads
    (True, False)
    """

    def __init__(self, width: float, height: float, size: float) -> None:
        self.width, self.height = width, height
        self.size = size / 72.0
        self.taken = np.zeros((max(1, math.ceil(height / CELL)), max(1, math.ceil(width / CELL))))

    def draw(self, curve: Array, weight: float = 1.0) -> None:
        """Mark the cells along a line as less welcome."""
        for a, b in itertools.pairwise(curve):
            if not np.isfinite([a, b]).all():
                continue
            low, high = np.minimum(a, b), np.maximum(a, b)
            if (high < 0.0).any() or (low > (self.width, self.height)).any():
                continue
            steps = min(4000, max(2, int(2.0 * float(np.hypot(*(b - a))) / CELL) + 2))
            points = a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)
            column, row = (np.floor(points / CELL).astype(np.int64)).T
            rows, columns = self.taken.shape
            inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
            self.taken[row[inside], column[inside]] = np.maximum(self.taken[row[inside], column[inside]], weight)

    def place(self, text: str, curves: list[Array]) -> Label | None:
        """The best place for the name of what these curves show; none if nothing of it lies in the diagram.

        The cells of the place are taken.
        """
        anchors = self._anchors(curves)
        if not len(anchors):
            return None
        half = np.array([len(text) * WIDTH * self.size, HEIGHT * self.size]) / 2.0
        sums = np.pad(self.taken, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
        best: tuple[float, Label] | None = None
        for anchor in anchors:
            for step, distance in enumerate(DISTANCES):
                for turn in range(16):
                    toward = np.array([math.cos(turn * math.pi / 8.0), math.sin(turn * math.pi / 8.0)])
                    # The name touches a circle of this radius around its place.
                    middle = anchor + toward * (distance + half * np.abs(toward))
                    if (middle - half < 0.02).any() or (middle + half > (self.width - 0.02, self.height - 0.02)).any():
                        continue
                    cost = self._covered(sums, middle, half) + 1.5 * step
                    if best is None or cost < best[0]:
                        x, y = middle.tolist()
                        best = cost, Label(x, y, (float(anchor[0]), float(anchor[1])), step > 1)
        if best is None:
            return None
        left, bottom, right, top = self._cells(np.array([best[1].x, best[1].y]), half)
        self.taken[bottom:top, left:right] = 12.0
        return best[1]

    def _anchors(self, curves: list[Array]) -> Array:
        """Points evenly along what lies in the diagram."""
        found = []
        for curve in curves:
            middle = (curve[1:] + curve[:-1]) / 2.0
            found.append(np.concatenate([curve, middle]))
        points = np.concatenate(found) if found else np.zeros((0, 2))
        inside = ((points >= 0.0) & (points <= (self.width, self.height))).all(axis=1)
        points = points[inside]
        order = np.lexsort((points[:, 1], points[:, 0]))
        picked = order[np.unique(np.linspace(0, len(order) - 1, ANCHORS).astype(np.int64))] if len(order) else order
        chosen: Array = points[picked]
        return chosen

    def _cells(self, middle: Array, half: Array) -> tuple[int, int, int, int]:
        left, bottom = np.floor((middle - half) / CELL).astype(int).tolist()
        right, top = np.ceil((middle + half) / CELL).astype(int).tolist()
        rows, columns = self.taken.shape
        return max(left, 0), max(bottom, 0), min(right, columns), min(top, rows)

    def _covered(self, sums: Array, middle: Array, half: Array) -> float:
        left, bottom, right, top = self._cells(middle, half)
        return float(sums[top, right] - sums[bottom, right] - sums[top, left] + sums[bottom, left])
