"""A carrier surface: a rectangle in a plane, with frames about it."""

from __future__ import annotations

import dataclasses
from types import MappingProxyType

from etendue.errors import ArgumentError
from etendue.lightfield.carrier.beam import checked_beam, parted
from etendue.lightfield.carrier.part import ALL, FLAT, WORLD, Beam, Focus, Part, Triple
from etendue.lightfield.carrier.sizing import SLACK, extent, hits_upwards
from etendue.lightfield.carrier.sphere import Sphere
from etendue.lightfield.carrier.surface import Surface
from etendue.lightfield.carrier.towards import checked_towards, turned
from etendue.quantities.arguments import require_number
from etendue.quantities.ray_stream import RayStream

MOST_FRAMES = 16


@dataclasses.dataclass(frozen=True)
class Plane(Surface):
    """A rectangle in a plane of constant z that emits towards +Z, or turned, and frames about it for what lies farther out.

    Light that leaves the plane need not be sharp there: a die under a window or a lens is seen at a depth that changes with
    the angle. `focus` says at which, so that one image of the die serves all directions. Frames, each twice as large as
    the one within, carry what little light comes from beside it, so that the rectangle can be as small as the die.

    Parameters
    ----------
    z : float
        [mm]
    width, height : float, optional
        Along X and Y [mm]; None: as large as the rays need.
    centre : tuple of float, optional
        (x, y) of the middle [mm]; None: from the rays, for a stated size where it holds the most light.
    focus : tuple of 4 floats, optional
        Height above the plane at which light is sharp that leaves under θ, by powers of 1 - cos θ from the constant on [mm];
        None: 0 for all, but `LightField.fit` finds it.
    frames : int
        0 to 16.
    rest : float, optional
        Radius of a sphere about the middle [mm] that takes up all other lines: light that heads downwards, or comes from far
        beside. None: it is not in the field.
    beam : tuple of 3 floats, optional
        The directions of a beam, for which the rectangle has cells of direction of its own: a disk of direction cosines
        along X and Y, by its middle and its radius. (0, 0, 1): there is none. None: none, but `LightField.fit` finds it.
    towards : tuple of 3 floats, optional
        Direction that it emits towards; None: +Z. All else is as it was before the surface was turned there about the
        origin, by the shortest rotation from +Z (to -Z about Y): `z` is then its distance from the origin along `towards`.

    Raises
    ------
    ArgumentError
        If a number is not finite, a length is not above 0, a direction has none, there are no such frames, or the beam is
        not within the disk of all directions.

    Examples
    --------
    >>> Plane(z=0.5, width=4, height=3, centre=(0, 0)).area
    12.0
    >>> [part.size for part in Plane(z=0, width=4, height=3, centre=(0, 0), frames=2).parts()]
    [(4.0, 3.0), (8.0, 6.0), (16.0, 12.0)]
    >>> [part.name for part in Plane(z=0, width=4, height=3, centre=(0, 0), beam=(0.1, 0, 0.2)).parts()]
    ['beam', 'plane']
    >>> Plane(z=7, width=4, height=3, centre=(0, 0), towards=(1, 0, 0)).parts()[0].centre
    (7.0, 0.0, 0.0)
    """

    NAME = "plane"
    LENGTHS = ("width", "height", "rest")
    SIZES = MappingProxyType({"centre": 2, "focus": len(FLAT), "beam": len(ALL), "towards": 3})
    UNSAID = MappingProxyType({"frames": 0})
    z: float = 0.0
    width: float | None = None
    height: float | None = None
    centre: tuple[float, float] | None = None
    focus: Focus | None = None
    frames: int = 0
    rest: float | None = None
    beam: Beam | None = None
    towards: Triple | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number(self.frames, "Plane: frames", f"a whole number from 0 to {MOST_FRAMES}")
        if not (float(self.frames).is_integer() and 0 <= self.frames <= MOST_FRAMES):
            raise ArgumentError(f"Plane: frames is {self.frames!r}; give a whole number from 0 to {MOST_FRAMES}.")
        object.__setattr__(self, "frames", int(self.frames))
        checked_beam(self.beam, "Plane")
        object.__setattr__(self, "towards", checked_towards(self.towards, "Plane"))

    @property
    def open_dimensions(self) -> tuple[str, ...]:
        """All that are None but the focus, which is then flat, the rest and the beam, which are left out, and +Z."""
        return tuple(name for name in super().open_dimensions if name not in ("focus", "rest", "beam", "towards"))

    def parts(self) -> tuple[Part, ...]:
        """The rectangle, first for the beam, then the frames from within, then both halves of the sphere."""
        width, height = self.closed("width"), self.closed("height")
        if self.centre is None:
            raise ArgumentError("Plane: centre is open; state it, or call sized_for(rays).")
        centre, focus = (*self.centre, self.z), self.focus or FLAT
        window = Part("plane", "rectangle", centre, WORLD, (width, height), focus)
        frames = (
            Part(f"frame {k}", "rectangle", centre, WORLD, (width * 2**k, height * 2**k), focus, 0.5)
            for k in range(1, self.frames + 1)
        )
        beyond = () if self.rest is None else Sphere(self.rest, centre).parts()
        return tuple(turned(part, self.towards) for part in (*parted(window, self.beam), *frames, *beyond))

    def sized_for(self, rays: RayStream) -> Plane:
        """The smallest rectangle that the rays' lines cross, but for strays far off; of a stated size, where most do."""
        if not self.open_dimensions:
            return self
        hits, flux = hits_upwards(rays, self.z, "Plane", self.focus or FLAT, self.towards)
        sizes, centres = (self.width, self.height), self.centre or (None, None)
        spans = [extent(v, flux, c, size) for v, c, size in zip(hits.T, centres, sizes, strict=True)]
        centre = tuple((low + high) / 2 for low, high in spans)
        width, height = ((high - low) * (1 + SLACK) for low, high in spans)
        return dataclasses.replace(
            self, width=self.width or width, height=self.height or height, centre=self.centre or (centre[0], centre[1])
        )
