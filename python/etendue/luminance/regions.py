"""Parts of a screen: rectangles and polygons, and the pixels that they hold."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import require, require_number
from etendue.quantities.observer import Screen

Mask = npt.NDArray[np.bool_]
Corner = tuple[float, float]

ON_THE_EDGE = 1e-9
"""Share of a pixel by which a pixel centre may lie outside a region and still belong to it: rounding."""


@dataclasses.dataclass(frozen=True)
class Region:
    """A rectangle on the screen; it holds the pixels whose centres lie inside or on its edge.

    Parameters
    ----------
    left, right : float
        Limits along the screen's right axis, from the target [mm].
    bottom, top : float
        Limits along the screen's up axis, from the target [mm].

    Raises
    ------
    ArgumentError
        If a limit is not finite or the rectangle is empty.

    Examples
    --------
    >>> Region(left=-1, right=0, bottom=-2, top=2).mask(Screen(4, 2, 4, 2)).astype(int).tolist()
    [[0, 1, 0, 0], [0, 1, 0, 0]]
    """

    left: float
    right: float
    bottom: float
    top: float

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            require_number(getattr(self, field.name), f"Region: {field.name}", "a limit in mm")
        if not all(map(math.isfinite, dataclasses.astuple(self))):
            raise ArgumentError(f"{self}: give four finite limits in mm.")
        if not (self.left < self.right and self.bottom < self.top):
            raise ArgumentError(f"{self}: left must be below right and bottom below top (x right, y up, in mm).")

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Of the rectangle, counter-clockwise from the lower left one [mm]."""
        left, right, bottom, top = self.left, self.right, self.bottom, self.top
        return (left, bottom), (right, bottom), (right, top), (left, top)

    def __str__(self) -> str:
        """As the command line takes it."""
        return f"region {self.left:g},{self.right:g},{self.bottom:g},{self.top:g}"

    def mask(self, screen: Screen) -> Mask:
        """Pixels of `screen` in the region, shape (rows, columns).

        Raises
        ------
        ArgumentError
            If no pixel centre lies in the region.
        """
        require(screen, Screen, "Region: screen", "a Screen: et.Screen(width, height, columns, rows)")
        slack_x = ON_THE_EDGE * screen.width / screen.columns
        slack_y = ON_THE_EDGE * screen.height / screen.rows
        columns = (screen.x >= self.left - slack_x) & (screen.x <= self.right + slack_x)
        rows = (screen.y >= self.bottom - slack_y) & (screen.y <= self.top + slack_y)
        if not (columns.any() and rows.any()):
            raise ArgumentError(
                f"{self}: no pixel centre lies in it. The screen spans x = ±{screen.width / 2:g} mm and "
                f"y = ±{screen.height / 2:g} mm in {screen.columns} × {screen.rows} pixels."
            )
        return np.logical_and.outer(rows, columns)


@dataclasses.dataclass(frozen=True)
class PolygonRegion:
    """A polygon on the screen; it holds the pixels whose centres lie inside (even-odd rule) or on its edge.

    Parameters
    ----------
    corners : sequence of pairs
        Right and up from the target [mm], three or more, in order; the last is joined to the first.

    Raises
    ------
    ArgumentError
        If there are fewer than three corners, one is not a pair of finite numbers, or they lie on one line.

    Examples
    --------
    >>> from etendue.quantities.observer import Screen
    >>> PolygonRegion([(-2, -1), (2, -1), (-2, 1)]).mask(Screen(4, 2, 4, 2)).astype(int).tolist()
    [[1, 0, 0, 0], [1, 1, 1, 0]]
    """

    corners: Sequence[Corner]

    def __post_init__(self) -> None:
        try:
            corners = tuple((float(x), float(y)) for x, y in self.corners)
        except (TypeError, ValueError):
            told = "PolygonRegion: corners are no pairs of numbers"
            raise ArgumentError(f"{told}; give (x, y) in mm for each, e.g. [(0, 0), (4, 0), (0, 3)].") from None
        if len(corners) < 3 or not all(math.isfinite(x) and math.isfinite(y) for x, y in corners):
            raise ArgumentError(
                f"region {_told(self.corners)}: give three or more corners with finite coordinates in mm."
            )
        object.__setattr__(self, "corners", corners)
        # A polygon that crosses itself spans area also where that of its loops cancels in `area`.
        (x, y), width = corners[0], np.ptp(corners, axis=0).max()
        off = [abs((a - x) * (d - y) - (c - x) * (b - y)) for (a, b), (c, d) in self._edges()]
        if not max(off) > ON_THE_EDGE * width * width:
            raise ArgumentError(f"region {_told(corners)}: the corners lie on one line and span no area.")

    def __str__(self) -> str:
        """As the command line takes it."""
        return f"region {_told(self.corners)}"

    @property
    def area(self) -> float:
        """Of a polygon that does not cross itself [mm²], by the shoelace formula: loops of either sense cancel."""
        return abs(sum(a * d - c * b for (a, b), (c, d) in self._edges())) / 2.0

    def _edges(self) -> Sequence[tuple[Corner, Corner]]:
        return list(itertools.pairwise((*self.corners, self.corners[0])))

    def mask(self, screen: Screen) -> Mask:
        """Pixels of `screen` in the region, shape (rows, columns).

        Raises
        ------
        ArgumentError
            If no pixel centre lies in the region.
        """
        require(screen, Screen, "PolygonRegion: screen", "a Screen: et.Screen(width, height, columns, rows)")
        x, y = screen.x[None, :], screen.y[:, None]
        inside, on_edge = np.zeros(screen.shape, dtype=np.bool_), np.zeros(screen.shape, dtype=np.bool_)
        slack = ON_THE_EDGE * min(screen.width / screen.columns, screen.height / screen.rows)
        for (a, b), (c, d) in self._edges():
            length = math.hypot(c - a, d - b)
            if length == 0.0:
                continue
            along = (((x - a) * (c - a) + (y - b) * (d - b)) / length).clip(0.0, length) / length
            on_edge |= np.hypot(x - a - along * (c - a), y - b - along * (d - b)) <= slack
            if b != d:
                # A ray to the right of the pixel's centre crosses the edge.
                crosses = ((b <= y) & (y < d)) | ((d <= y) & (y < b))
                inside ^= crosses & (x < a + (y - b) * (c - a) / (d - b))
        inside |= on_edge
        if not inside.any():
            raise ArgumentError(
                f"{self}: no pixel centre lies in it. The screen spans ±{screen.width / 2:g} mm "
                f"across and ±{screen.height / 2:g} mm up in {screen.columns} × {screen.rows} pixels."
            )
        return inside


AnyRegion = Region | PolygonRegion


def _told(corners: Sequence[Corner]) -> str:
    return ",".join("/".join(f"{coordinate:g}" for coordinate in corner) for corner in corners)


def check_region(given: object, asker: str) -> None:
    """Refuse what is no region, such as its bare limits.

    Raises
    ------
    ArgumentError
        If so.

    Examples
    --------
    >>> check_region(5, "plot")
    Traceback (most recent call last):
    etendue.errors.ArgumentError: plot: region is 5; give et.Region(left, right, bottom, top) or et.PolygonRegion(…).
    """
    instead = "et.Region(left, right, bottom, top) or et.PolygonRegion(…)"
    require(given, (Region, PolygonRegion), f"{asker}: region", instead)


def parse_region(text: str) -> AnyRegion:
    """A region as the command line spells it: four limits, or the corners of a polygon.

    Parameters
    ----------
    text : str
        ``LEFT,RIGHT,BOTTOM,TOP`` in mm, or three or more corners ``X/Y,X/Y,X/Y``.

    Raises
    ------
    ArgumentError
        If it is neither.

    Examples
    --------
    >>> parse_region("-1,1,-2,2")
    Region(left=-1.0, right=1.0, bottom=-2.0, top=2.0)
    >>> parse_region("0/0,1/0,0/1").area
    0.5
    """
    rows = [part.split("/") for part in text.split(",")]
    polygon = "/" in text
    try:
        numbers = [tuple(map(float, row)) for row in rows]
    except ValueError:
        numbers = []
    # What the regions themselves refuse, they explain.
    if polygon and numbers and all(len(row) == 2 for row in numbers):
        return PolygonRegion([(x, y) for x, y in numbers])
    if not polygon and len(numbers) == 4:
        return Region(*(x for (x,) in numbers))
    raise ArgumentError(
        f"{text!r} is no region: give LEFT,RIGHT,BOTTOM,TOP in mm, e.g. -5,5,-2,2, or corners X/Y, e.g. 0/0,4/0,0/3."
    )
