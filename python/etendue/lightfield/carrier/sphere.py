"""A carrier surface: a whole sphere."""

from __future__ import annotations

import dataclasses
from types import MappingProxyType

from etendue.lightfield.carrier.part import DOWN, WORLD, Part
from etendue.lightfield.carrier.sizing import sphere_radius
from etendue.lightfield.carrier.surface import Surface
from etendue.quantities.ray_stream import RayStream


@dataclasses.dataclass(frozen=True)
class Sphere(Surface):
    """A whole sphere, as two hemispheres: for sources that emit upwards and downwards.

    Parameters
    ----------
    radius : float, optional
        [mm]; None: as small as the rays allow.
    centre : tuple of float
        (x, y, z) [mm]

    Raises
    ------
    ArgumentError
        If a number is not finite, or a length is not above 0.

    Examples
    --------
    >>> [part.name for part in Sphere(radius=2).parts()]
    ['upper', 'lower']
    """

    NAME = "sphere"
    LENGTHS = ("radius",)
    SIZES = MappingProxyType({"centre": 3})
    radius: float | None = None
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def parts(self) -> tuple[Part, ...]:
        """The upper and the lower hemisphere."""
        size = (self.closed("radius"), 0.0)
        return (
            Part("upper", "hemisphere", self.centre, WORLD, size),
            Part("lower", "hemisphere", self.centre, DOWN, size),
        )

    def sized_for(self, rays: RayStream) -> Sphere:
        """The smallest sphere that the rays' lines meet, but for strays far off."""
        return dataclasses.replace(self, radius=self.radius or sphere_radius(rays, self.centre))
