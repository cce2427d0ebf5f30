"""A carrier surface: a closed box."""

from __future__ import annotations

import dataclasses
from types import MappingProxyType

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.carrier.part import Part, triple
from etendue.lightfield.carrier.sizing import SLACK, extent, sizing_rays
from etendue.lightfield.carrier.surface import Surface
from etendue.quantities.ray_stream import RayStream


@dataclasses.dataclass(frozen=True)
class Box(Surface):
    """A closed box with faces along the axes.

    Parameters
    ----------
    width, height, depth : float, optional
        Along X, Y and Z [mm]; None: from the rays' start points.
    centre : tuple of float, optional
        (x, y, z) of the middle [mm]; None: from the rays.

    Raises
    ------
    ArgumentError
        If a number is not finite, or a length is not above 0.

    Examples
    --------
    >>> Box(2, 3, 4, centre=(0, 0, 2)).area
    52.0
    """

    NAME = "box"
    LENGTHS = ("width", "height", "depth")
    SIZES = MappingProxyType({"centre": 3})
    width: float | None = None
    height: float | None = None
    depth: float | None = None
    centre: tuple[float, float, float] | None = None

    def parts(self) -> tuple[Part, ...]:
        """Six rectangles."""
        size = [self.closed(name) for name in ("width", "height", "depth")]
        if self.centre is None:
            raise ArgumentError("Box: centre is open; state it, or call sized_for(rays).")
        faces = []
        for axis, letter in ((2, "z"), (0, "x"), (1, "y")):
            for sign, mark in ((1.0, "+"), (-1.0, "-")):
                normal, first = np.eye(3)[axis] * sign, np.eye(3)[(axis + 1) % 3]
                axes = (triple(first), triple(np.cross(normal, first)), triple(normal))
                centre = np.array(self.centre) + normal * size[axis] / 2
                extent = (size[(axis + 1) % 3], size[(axis + 2) % 3])
                faces.append(Part(f"{mark}{letter}", "rectangle", triple(centre), axes, extent))
        return tuple(faces)

    def sized_for(self, rays: RayStream) -> Box:
        """The smallest box about the rays' start points, but for strays far off; of a stated size, about most light."""
        if not self.open_dimensions:
            return self
        some = sizing_rays(rays)
        flux, sizes, centres = some.flux, (self.width, self.height, self.depth), self.centre or (None, None, None)
        spans = [extent(v, flux, c, size) for v, c, size in zip(some.position.T, centres, sizes, strict=True)]
        longest = max(high - low for low, high in spans)
        width, height, depth = (max(high - low, SLACK * longest) * (1 + SLACK) for low, high in spans)
        middle = triple(np.array([(low + high) / 2 for low, high in spans]))
        return Box(self.width or width, self.height or height, self.depth or depth, self.centre or middle)
