"""A carrier surface: a disk in a plane."""

from __future__ import annotations

import dataclasses

import numpy as np

from etendue.lightfield.carrier.part import WORLD, Part
from etendue.lightfield.carrier.sizing import hits_upwards, radius_for
from etendue.lightfield.carrier.surface import Surface
from etendue.quantities.ray_stream import RayStream


@dataclasses.dataclass(frozen=True)
class Disk(Surface):
    """A disk in a plane of constant z that emits towards +Z.

    Parameters
    ----------
    radius : float, optional
        [mm]; None: as large as the rays need.
    z : float
        [mm]
    centre : tuple of float
        (x, y) [mm]

    Raises
    ------
    ArgumentError
        If a number is not finite, or a length is not above 0.

    Examples
    --------
    >>> round(Disk(radius=2).area, 4)
    12.5664
    """

    NAME = "disk"
    LENGTHS = ("radius",)
    radius: float | None = None
    z: float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)

    def parts(self) -> tuple[Part, ...]:
        """One disk."""
        return (Part("disk", "disk", (*self.centre, self.z), WORLD, (self.closed("radius"), 0.0)),)

    def sized_for(self, rays: RayStream) -> Disk:
        """The smallest disk that the rays' lines cross, but for strays far off."""
        if not self.open_dimensions:
            return self
        hits, _ = hits_upwards(rays, self.z, "Disk")
        return dataclasses.replace(self, radius=radius_for(np.hypot(*(hits - self.centre).T)))
