"""A carrier surface: a disk in a plane."""

from __future__ import annotations

import dataclasses
from types import MappingProxyType

import numpy as np

from etendue.lightfield.carrier.beam import checked_beam, parted
from etendue.lightfield.carrier.part import ALL, WORLD, Beam, Part, Triple
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
    beam : tuple of 3 floats, optional
        The directions of a beam, for which the disk has cells of direction of its own: a disk of direction cosines
        along X and Y, by its middle and its radius. (0, 0, 1): there is none. None: none, but `LightField.fit` finds it.
    towards : tuple of 3 floats, optional
        Direction that it emits towards; None: +Z. All else is as it was before the surface was turned there about the
        origin, by the shortest rotation from +Z (to -Z about Y): `z` is then its distance from the origin along `towards`.

    Raises
    ------
    ArgumentError
        If a number is not finite, a length is not above 0, a direction has none, or the beam is not within the disk of all
        directions.

    Examples
    --------
    >>> round(Disk(radius=2).area, 4)
    12.5664
    """

    NAME = "disk"
    LENGTHS = ("radius",)
    SIZES = MappingProxyType({"centre": 2, "beam": len(ALL), "towards": 3})
    radius: float | None = None
    z: float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)
    beam: Beam | None = None
    towards: Triple | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        checked_beam(self.beam, "Disk")
        object.__setattr__(self, "towards", checked_towards(self.towards, "Disk"))

    @property
    def open_dimensions(self) -> tuple[str, ...]:
        """All that are None but the beam, and the direction, which is then +Z."""
        return tuple(name for name in super().open_dimensions if name not in ("beam", "towards"))

    def parts(self) -> tuple[Part, ...]:
        """The disk, first for the beam."""
        disk = Part("disk", "disk", (*self.centre, self.z), WORLD, (self.closed("radius"), 0.0))
        return tuple(turned(part, self.towards) for part in parted(disk, self.beam))

    def sized_for(self, rays: RayStream) -> Disk:
        """The smallest disk that the rays' lines cross, but for strays far off."""
        if not self.open_dimensions:
            return self
        hits, _ = hits_upwards(rays, self.z, "Disk", towards=self.towards)
        return dataclasses.replace(self, radius=radius_for(np.hypot(*(hits - self.centre).T)))
