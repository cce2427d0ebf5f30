"""A carrier surface: a flat window and the hemisphere above it."""

from __future__ import annotations

import dataclasses

from etendue.errors import ArgumentError
from etendue.lightfield.carrier.part import WORLD, Part
from etendue.lightfield.carrier.sizing import sphere_radius
from etendue.lightfield.carrier.surface import Surface
from etendue.quantities.ray_stream import RayStream


@dataclasses.dataclass(frozen=True)
class Dome(Surface):
    """A flat window and the hemisphere above it, [Audenaert2014]_ section 3.3.2.

    A ray whose line passes the window belongs to the window, where the image of a die is sharp; the rest, light that the
    lens scatters or reflects, belongs to the hemisphere.

    Parameters
    ----------
    radius : float, optional
        Of the hemisphere [mm]; None: as small as the rays allow.
    z : float
        Height of the window and of the sphere's centre [mm].
    window : float, optional
        Radius of the window [mm]; None: that of the hemisphere.
    centre : tuple of float
        (x, y) [mm]

    Raises
    ------
    ArgumentError
        If a number is not finite, a length is not above 0, or the window is wider than the hemisphere.

    Examples
    --------
    >>> [(part.name, round(part.area, 3)) for part in Dome(radius=1.264).parts()]
    [('window', 5.019), ('dome', 10.039)]
    """

    NAME = "dome"
    LENGTHS = ("radius", "window")
    radius: float | None = None
    z: float = 0.0
    window: float | None = None
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.radius is not None and self.window is not None and self.window > self.radius:
            raise ArgumentError(f"Dome: window radius {self.window:g} is above the dome's radius {self.radius:g}.")

    @property
    def open_dimensions(self) -> tuple[str, ...]:
        """The radius alone: an open window is as wide as the dome."""
        return () if self.radius is not None else ("radius",)

    def parts(self) -> tuple[Part, ...]:
        """The window, then the dome."""
        radius, centre = self.closed("radius"), (*self.centre, self.z)
        return (
            Part("window", "disk", centre, WORLD, (self.window or radius, 0.0)),
            Part("dome", "hemisphere", centre, WORLD, (radius, 0.0)),
        )

    def sized_for(self, rays: RayStream) -> Dome:
        """The smallest dome that the rays' lines meet, but for strays far off."""
        radius = self.radius or max(sphere_radius(rays, (*self.centre, self.z)), self.window or 0.0)
        return dataclasses.replace(self, radius=radius)
