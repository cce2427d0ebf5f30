"""A carrier surface: a cylinder, closed or open."""

from __future__ import annotations

import dataclasses
from types import MappingProxyType

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.carrier.part import Part, Triple, triple
from etendue.lightfield.carrier.sizing import SLACK, radius_for, sizing_rays, span
from etendue.lightfield.carrier.surface import Surface
from etendue.quantities.arguments import require_known
from etendue.quantities.ray_stream import RayStream

AXES = ("x", "y", "z")
"""Along which a cylinder may lie."""


@dataclasses.dataclass(frozen=True)
class Cylinder(Surface):
    """A cylinder about an axis along X, Y or Z, closed by its ends or open.

    Parameters
    ----------
    radius : float, optional
        [mm]; None: from the rays.
    bottom, top : float, optional
        Where the ends are along the axis [mm]; None: from the rays' start points.
    centre : tuple of float
        Where the axis is [mm]: (x, y) if it is along Z, (x, z) along Y, (y, z) along X.
    ends : bool
        Whether light that leaves through the ends belongs to the surface; if not, it is counted as not met.
    axis : str
        ``"x"``, ``"y"`` or ``"z"``.

    Raises
    ------
    ArgumentError
        If a number is not finite, a length is not above 0, or the top is not above the bottom.
    UnknownNameError
        If there is no such axis.

    Examples
    --------
    >>> [part.name for part in Cylinder(radius=2, bottom=0, top=5).parts()]
    ['side', 'top', 'bottom']
    >>> [part.centre for part in Cylinder(radius=2, bottom=0, top=5, centre=(1, 7), axis="y").parts()]
    [(1.0, 2.5, 7.0), (1.0, 5.0, 7.0), (1.0, 0.0, 7.0)]
    """

    NAME = "cylinder"
    LENGTHS = ("radius",)
    UNSAID = MappingProxyType({"axis": "z"})
    radius: float | None = None
    bottom: float | None = None
    top: float | None = None
    centre: tuple[float, float] = (0.0, 0.0)
    ends: bool = True
    axis: str = "z"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_known(self.axis, AXES, "axis of a cylinder")
        if self.bottom is not None and self.top is not None and not self.top > self.bottom:
            raise ArgumentError(f"Cylinder: top {self.top:g} is not above bottom {self.bottom:g}.")

    def parts(self) -> tuple[Part, ...]:
        """The side, and the two ends."""
        radius, bottom, top = (self.closed(name) for name in ("radius", "bottom", "top"))
        along = AXES.index(self.axis)
        x, y, z = (triple(np.eye(3)[(along + 1 + k) % 3]) for k in range(3))
        down = (x, triple(-np.array(y) + 0.0), triple(-np.array(z) + 0.0))

        def at(height: float) -> Triple:
            return triple(np.insert(self.centre, along, height))

        side = Part("side", "tube", at((bottom + top) / 2), (x, y, z), (radius, top - bottom))
        lids = (
            Part("top", "disk", at(top), (x, y, z), (radius, 0.0)),
            Part("bottom", "disk", at(bottom), down, (radius, 0.0)),
        )
        return (side, *lids) if self.ends else (side,)

    def sized_for(self, rays: RayStream) -> Cylinder:
        """The smallest cylinder about the rays' start points, but for strays far off."""
        if not self.open_dimensions:
            return self
        position = sizing_rays(rays).position
        along = AXES.index(self.axis)
        low, high = span(position[:, along], None)
        bottom = low if self.bottom is None else self.bottom
        top = high if self.top is None else self.top
        room = max(top - bottom, np.spacing(abs(top) + abs(bottom))) * SLACK
        return dataclasses.replace(
            self,
            radius=self.radius or radius_for(np.hypot(*(np.delete(position, along, axis=1) - self.centre).T)),
            bottom=bottom - room if self.bottom is None else bottom,
            top=top + room if self.top is None else top,
        )
