"""Bodies with flat faces: blocks, prisms, prismatic films."""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import model_validator

from etendue.description.files import Files
from etendue.description.values import Length, Number, Vertices
from etendue.scene.bodies.body import Body, Face
from etendue.scene.placement import Frame
from etendue.scene.shapes.outline import signed_area, simple_polygon
from etendue.scene.shapes.shape import Record

Array = npt.NDArray[np.float64]

MOST_PRISMS = 100_000
"""Prisms of one film: each is two faces of the scene."""


def lid(name: str, outline: Record, z: float, *, top: bool) -> Face:
    """A flat face at a height, whose normal points up if it is a top and down if it is a bottom.

    Examples
    --------
    >>> lid("base", {"kind": "whole"}, 0.0, top=False).flip
    True
    """
    return Face(name, {"kind": "flat", "outline": outline}, Frame.shifted(0.0, 0.0, z), flip=not top)


def wall(name: str, start: npt.ArrayLike, end: npt.ArrayLike, up: npt.ArrayLike, group: str | None = None) -> Face:
    """A rectangle from an edge, given by its two ends, along `up` [mm], whose normal is edge × up.

    Examples
    --------
    >>> face = wall("front", (0, 0, 0), (2, 0, 0), (0, 0, 3))
    >>> face.shape["outline"]["height"], face.frame.axes[:, 2].tolist()
    (3.0, [0.0, -1.0, 0.0])
    """
    a, b, height = (np.asarray(v, dtype=np.float64) for v in (start, end, up))
    outline = {
        "kind": "rectangle",
        "width": float(np.linalg.norm(b - a)),
        "height": float(np.linalg.norm(height)),
    }
    frame = Frame.along((a + b + height) / 2.0, b - a, np.cross(b - a, height))
    return Face(name, {"kind": "flat", "outline": outline}, frame, group=group)


class Block(Body):
    """A rectangular block that stands on z = 0 with the z axis through its middle.

    Its faces are ``left`` (-x), ``right`` (+x), ``front`` (-y), ``back`` (+y), ``bottom`` and ``top``.

    Parameters
    ----------
    width, height, depth : number
        Along x, y and z [mm], > 0.

    Examples
    --------
    >>> [face.name for face in Block(width=2, height=3, depth=4).faces(Files())]
    ['front', 'right', 'back', 'left', 'bottom', 'top']
    """

    kind: Literal["block"] = "block"
    width: Length
    height: Length
    depth: Length

    def faces(self, files: Files) -> tuple[Face, ...]:  # noqa: ARG002 - other bodies come from files
        """Four walls and two lids."""
        x, y = self.width / 2.0, self.height / 2.0
        corners = [(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)]
        up = (0.0, 0.0, self.depth)
        names = ("front", "right", "back", "left")
        walls = [wall(name, corners[i], corners[(i + 1) % 4], up) for i, name in enumerate(names)]
        outline = {"kind": "rectangle", "width": self.width, "height": self.height}
        return (*walls, lid("bottom", outline, 0.0, top=False), lid("top", outline, self.depth, top=True))


class Prism(Body):
    """A polygon in the plane z = 0, extruded upwards.

    Its faces are ``side 1``, ``side 2`` … in the order of the polygon's sides, together ``side``, and ``bottom`` and
    ``top``.

    Parameters
    ----------
    vertices : rows of 2 numbers
        Corners (x, y) in order [mm], in either sense, at least three; the polygon is simple.
    height : number
        [mm], > 0.

    Examples
    --------
    >>> wedge = Prism(vertices=[(0, 0), (4, 0), (0, 3)], height=10)
    >>> [face.name for face in wedge.faces(Files())]
    ['side 1', 'side 2', 'side 3', 'bottom', 'top']
    """

    kind: Literal["prism"] = "prism"
    vertices: Vertices
    height: Length

    @model_validator(mode="after")
    def _is_simple(self) -> Self:
        simple_polygon(self.vertices)
        return self

    def faces(self, files: Files) -> tuple[Face, ...]:  # noqa: ARG002 - other bodies come from files
        """A wall over every side, and two polygons."""
        corners = np.array(self.vertices)
        forward = signed_area(corners) > 0.0
        up = np.array([0.0, 0.0, self.height])
        walls = []
        for i, (a, b) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
            start, end = (a, b) if forward else (b, a)
            walls.append(wall(f"side {i + 1}", (*start, 0.0), (*end, 0.0), up, group="side"))
        outline = {"kind": "polygon", "vertices": corners if forward else corners[::-1].copy()}
        return (*walls, lid("bottom", outline, 0.0, top=False), lid("top", outline, self.height, top=True))


class PrismaticFilm(Body):
    """A slab on z = 0 with straight prisms on top, side by side along x, each along y: a brightness enhancing film.

    Its faces are ``prism 1`` to ``prism 2n``, left and right flanks in turn, together ``prisms``; ``bottom``; ``left``
    and ``right``, the edges of the slab; ``front`` (-y) and ``back`` (+y), the saw-toothed ends.

    Parameters
    ----------
    width, height : number
        Along x and y [mm]; the width is a whole number of pitches.
    thickness : number
        Of the slab below the valleys [mm], > 0.
    pitch : number
        From ridge to ridge [mm], > 0.
    apex_angle : number
        Between the flanks of a prism [°], 0 < apex < 180.

    Examples
    --------
    >>> film = PrismaticFilm(width=2, height=3, thickness=0.2, pitch=1)
    >>> film.prisms, film.prism_height, len(film.faces(Files()))
    (2, 0.5, 9)
    """

    kind: Literal["prismatic-film"] = "prismatic-film"
    width: Length
    height: Length
    thickness: Length
    pitch: Length
    apex_angle: Number = 90.0

    @model_validator(mode="after")
    def _whole_prisms(self) -> Self:
        if not 1.0 <= self.apex_angle <= 179.0:
            raise ValueError(f"'apex_angle' is {self.apex_angle:g}°; give 1° to 179°")
        ratio = self.width / self.pitch
        if not 0.5 <= ratio <= MOST_PRISMS:
            raise ValueError(f"'pitch' is {self.pitch:g}: {ratio:.6g} prisms; a film has 1 to {MOST_PRISMS:,}")
        # Width and pitch as users write them have errors of some 1e-16 each; the ratio is off by that times itself.
        if abs(ratio - round(ratio)) > 1e-9 * ratio:
            whole = max(round(ratio), 1) * self.pitch
            raise ValueError(f"'width' is {self.width:g}, no whole number of pitches; {whole:g} would be one")
        return self

    @property
    def prisms(self) -> int:
        """Number of prisms."""
        return round(self.width / self.pitch)

    @property
    def prism_height(self) -> float:
        """From valley to ridge [mm]."""
        half = self.pitch / 2.0
        return half if self.apex_angle == 90.0 else half / math.tan(math.radians(self.apex_angle) / 2.0)

    def profile(self) -> Array:
        """The cross section in x and z [mm], counter-clockwise seen from -y, shape (2n + 3, 2).

        Valleys and ridges stand at multiples of half the pitch from the middle, so that neighbours share them exactly.
        """
        n = self.prisms
        x = (np.arange(2 * n + 1) - n) * (self.pitch / 2.0)
        z = np.where(np.arange(2 * n + 1) % 2 == 0, self.thickness, self.thickness + self.prism_height)
        top = np.stack([x, z], axis=1)[::-1]
        return np.concatenate([[[x[0], 0.0], [x[-1], 0.0]], top])

    def faces(self, files: Files) -> tuple[Face, ...]:  # noqa: ARG002 - other bodies come from files
        """Flanks, slab and saw-toothed ends."""
        section = self.profile()
        y = self.height / 2.0
        along = np.array([0.0, self.height, 0.0])
        # The section runs counter-clockwise seen from -y, so that y × side points outwards: a wall over the side in
        # reverse, along +y.
        placed = np.stack([section[:, 0], np.full(len(section), -y), section[:, 1]], axis=1)

        def flank(name: str, i: int, group: str | None = None) -> Face:
            return wall(name, placed[(i + 1) % len(placed)], placed[i], along, group)

        last = len(section) - 1
        found = [flank(f"prism {k + 1}", last - 1 - k, "prisms") for k in range(2 * self.prisms)]
        found += [flank("bottom", 0), flank("right", 1), flank("left", last)]
        # Local x, y of the ends are x and z of the film; the normal is then x × z = -y.
        end = {"kind": "flat", "outline": {"kind": "polygon", "vertices": section}}
        front, back = (Frame.along((0.0, at, 0.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)) for at in (-y, y))
        return (*found, Face("front", end, front), Face("back", end, back, flip=True))


FLAT_BODIES: dict[str, type[Body]] = {cls.model_fields["kind"].default: cls for cls in (Block, Prism, PrismaticFilm)}
"""Bodies with flat faces by kind."""
