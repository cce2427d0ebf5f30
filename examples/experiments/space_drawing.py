"""Directions and surfaces in space drawn on flat axes, with the arrows, arcs and labels that those have."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
from etendue.plot import style
from etendue.quantities.bsdf_directions import direction
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Polygon

Array = npt.NDArray[np.float64]

PALE = "#f1f4f8"
"""Faces of surfaces that others stand on."""

SHADED = "#c3ced8"
"""Lines of what is only there for orientation."""


@dataclasses.dataclass(frozen=True)
class View:
    """A parallel projection, seen from an elevation and an azimuth [°]; z points up, and from above y does.

    Parameters
    ----------
    axes : Axes
    elevation, azimuth : float
        From where one looks [°].
    order : tuple of 3 ints
        Which of the coordinates stand for x, y and z.
    """

    axes: Axes
    elevation: float = 90.0
    azimuth: float = -90.0
    order: tuple[int, int, int] = (0, 1, 2)

    def flat(self, points: npt.ArrayLike) -> Array:
        """Where points of shape (…, 3) are on the axes, shape (…, 2); those of shape (…, 2) have z = 0."""
        points = np.asarray(points, np.float64)
        if points.shape[-1] == 2:
            points = np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)
        eye = direction(90.0 - self.elevation, self.azimuth)
        right = direction(90.0, self.azimuth + 90.0)
        return points[..., list(self.order)] @ np.stack([right, np.cross(eye, right)], axis=-1)

    def line(self, points: npt.ArrayLike, **look: Any) -> None:
        """A polyline through points."""
        self.axes.plot(*self.flat(points).T, **({"lw": 0.8, "color": SHADED, "solid_capstyle": "butt"} | look))

    def face(self, points: npt.ArrayLike, **look: Any) -> None:
        """A filled polygon."""
        self.axes.add_patch(Polygon(self.flat(points), **({"facecolor": PALE, "edgecolor": SHADED, "lw": 0.8} | look)))

    def facing(self, points: Array) -> npt.NDArray[np.bool_]:
        """Which cells between points of shape (m, n, 3) are seen from outside, shape (m − 1, n − 1).

        Outside is to where the step along n, then that along m turn by the right hand.
        """
        normals = np.cross(points[1:, 1:] - points[:-1, :-1], points[1:, :-1] - points[:-1, 1:])
        eye = direction(90.0 - self.elevation, self.azimuth)
        return np.asarray(normals[..., list(self.order)] @ eye > 0.0)

    def surface(self, points: Array, values: Array, **look: Any) -> PolyCollection:
        """The cells that face the eye, from far to near, each in the colour of the mean of the values at its corners."""
        seen = self.facing(points)
        corners = np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]], axis=-2)[seen]
        mean = 0.25 * (values[:-1, :-1] + values[:-1, 1:] + values[1:, 1:] + values[1:, :-1])[seen]
        eye = direction(90.0 - self.elevation, self.azimuth)
        order = np.argsort(corners.mean(axis=1)[:, list(self.order)] @ eye)
        faces = PolyCollection(self.flat(corners[order]), array=mean[order], lw=0.5, edgecolors="face", **look)
        self.axes.add_collection(faces)
        return faces

    def arrow(
        self, start: npt.ArrayLike, end: npt.ArrayLike, colour: str, width: float = 1.6, zorder: float = 2
    ) -> None:
        """From one point to another."""
        tips = {"arrowstyle": "-|>", "color": colour, "lw": width, "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 9}
        self.axes.annotate("", tuple(self.flat(end)), tuple(self.flat(start)), arrowprops=tips, zorder=zorder)

    def turn(self, points: npt.ArrayLike, colour: str, width: float = 1.0) -> None:
        """An arrow along a curve."""
        at = self.flat(points)
        self.axes.plot(*at.T, color=colour, lw=width)
        tips = {"arrowstyle": "-|>", "color": colour, "lw": width, "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 7}
        # Its head points away from where the curve was a little before.
        before = at[np.linalg.norm(at - at[-1], axis=1) > 0.04][-1]
        self.axes.annotate("", tuple(at[-1]), tuple(before), arrowprops=tips)

    def label(self, at: npt.ArrayLike, text: str, colour: str, away: tuple[float, float] = (0.0, 0.0)) -> None:
        """Text beside a point, its middle so many points of type away."""
        self.axes.annotate(
            text,
            tuple(self.flat(at)),
            away,
            textcoords="offset points",
            color=colour,
            size=style.LABEL_SIZE,
            ha="center",
            va="center",
        )

    def beside(self, start: npt.ArrayLike, end: npt.ArrayLike, text: str, colour: str, other: npt.ArrayLike) -> None:
        """Text beside the middle of a line, on the side where another point is not."""
        a, b, c = self.flat(start), self.flat(end), self.flat(other)
        along = (b - a) / np.linalg.norm(b - a)
        across = np.array([-along[1], along[0]])
        if (c - a) @ across > 0.0:
            across = -across
        self.label(0.5 * (np.asarray(start) + np.asarray(end)), text, colour, tuple(9.0 * across))
