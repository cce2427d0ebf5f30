"""A carrier surface: a disk in a plane."""

from __future__ import annotations

import dataclasses
from types import MappingProxyType

import numpy as np

from etendue.lightfield.carrier.part import WORLD, Part, Triple
from etendue.lightfield.carrier.sizing import hits_upwards, radius_for
from etendue.lightfield.carrier.surface import Surface
from etendue.lightfield.carrier.towards import checked_towards, turned
from etendue.quantities.ray_stream import RayStream


@dataclasses.dataclass(frozen=True)
class Disk(Surface):
    """A disk in a plane of constant z that emits towards +Z, or turned.

    Parameters
    ----------
    radius : float, optional
        [mm]; None: as large as the rays need.
    z : float
        [mm]
    centre : tuple of float
        (x, y) [mm]
    towards : tuple of 3 floats, optional
        Direction that it emits towards; None: +Z. All else is as it was before the surface was turned there about the
        origin, by the shortest rotation from +Z (to -Z about Y): `z` is then its distance from the origin along `towards`.

    Raises
    ------
    ArgumentError
        If a number is not finite, a length is not above 0, or a direction has none.

    Examples
    --------
    >>> round(Disk(radius=2).area, 4)
    12.5664
    """

    NAME = "disk"
    LENGTHS = ("radius",)
    SIZES = MappingProxyType({"centre": 2, "towards": 3})
    radius: float | None = None
    z: float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)
    towards: Triple | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "towards", checked_towards(self.towards, "Disk"))

    @property
    def open_dimensions(self) -> tuple[str, ...]:
        """All that are None but the direction, which is then +Z."""
        return tuple(name for name in super().open_dimensions if name != "towards")

    def parts(self) -> tuple[Part, ...]:
        """One disk."""
        disk = Part("disk", "disk", (*self.centre, self.z), WORLD, (self.closed("radius"), 0.0))
        return (turned(disk, self.towards),)

    def sized_for(self, rays: RayStream) -> Disk:
        """The smallest disk that the rays' lines cross, but for strays far off."""
        if not self.open_dimensions:
            return self
        hits, _ = hits_upwards(rays, self.z, "Disk", towards=self.towards)
        return dataclasses.replace(self, radius=radius_for(np.hypot(*(hits - self.centre).T)))
