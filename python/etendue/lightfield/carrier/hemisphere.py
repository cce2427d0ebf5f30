"""A carrier surface: the upper half of a sphere."""

from __future__ import annotations

import dataclasses
from types import MappingProxyType

from etendue.lightfield.carrier.part import WORLD, Part
from etendue.lightfield.carrier.sizing import sphere_radius
from etendue.lightfield.carrier.surface import Surface
from etendue.quantities.ray_stream import RayStream


@dataclasses.dataclass(frozen=True)
class Hemisphere(Surface):
    """The upper half of a sphere.

    Parameters
    ----------
    radius : float, optional
        [mm]; None: as small as the rays allow.
    centre : tuple of float
        (x, y, z) of the sphere [mm]

    Raises
    ------
    ArgumentError
        If a number is not finite, or a length is not above 0.

    Examples
    --------
    >>> round(Hemisphere(radius=2).area, 4)
    25.1327
    """

    NAME = "hemisphere"
    LENGTHS = ("radius",)
    SIZES = MappingProxyType({"centre": 3})
    radius: float | None = None
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def parts(self) -> tuple[Part, ...]:
        """One hemisphere."""
        return (Part("hemisphere", "hemisphere", self.centre, WORLD, (self.closed("radius"), 0.0)),)

    def sized_for(self, rays: RayStream) -> Hemisphere:
        """The smallest hemisphere that the rays' lines meet, but for strays far off."""
        return dataclasses.replace(self, radius=self.radius or sphere_radius(rays, self.centre))
