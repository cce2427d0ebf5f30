"""Carrier surfaces: where a light field lives. Rays are carried to them along themselves."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, Literal, Self

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError, UnknownNameError
from etendue.lightfield.pilot_sample import pilot_sample
from etendue.quantities.arguments import require, require_number
from etendue.quantities.ray_stream import RayStream

FloatArray = npt.NDArray[np.float64]
Shape = Literal["rectangle", "disk", "hemisphere", "tube"]
Focus = tuple[float, float, float, float]

FLAT: Focus = (0.0, 0.0, 0.0, 0.0)
"""The focus of a part whose places lie in its plane whatever the direction."""

PILOT_RAYS = 1 << 18
"""Rays looked at to size a surface that was given without its dimensions."""

STRAY = 1e-4
"""Share of the rays, on each side, that a surface sized from the rays may leave out when they lie far off."""

SLACK = 1e-6
"""A surface sized from the rays is larger than they need by this factor, so that rounding loses none."""


@dataclasses.dataclass(frozen=True)
class Part:
    """One chart of a carrier surface: a shape with an equal-area map to the unit square.

    Light leaves a part on the side of its normal. Within a rectangle the chart is linear; a disk is mapped by the
    concentric map of [ShirleyChiu1997]_; a hemisphere is mapped to the disk by Lambert's equal-area azimuthal projection
    first; a tube is unrolled, azimuth first.

    Parameters
    ----------
    name : str
        What the part is within its surface: ``"window"``, ``"dome"``, ``"side"`` …
    shape : {"rectangle", "disk", "hemisphere", "tube"}
    centre : tuple of float, shape (3,)
        [mm]; of a hemisphere the centre of the sphere, of a tube the middle of its axis.
    axes : tuple of 3 tuples
        Orthonormal, right-handed x, y, z. z is the normal of a flat part, the pole of a hemisphere, the axis of a tube.
    size : tuple of float
        [mm] (width along x, height along y) of a rectangle, (radius, 0) of a disk or hemisphere, (radius, height) of a tube.
    focus : tuple of 4 floats
        Of a rectangle: the height above it at which the places of light under θ are taken, f₀ + f₁ (1 - cos θ) +
        f₂ (1 - cos θ)² + f₃ (1 - cos θ)³ [mm]. Rays start on the rectangle's plane all the same. Places that are shifted by
        direction alone leave étendue what it is: theory eq. 41.
    hole : float
        Share of both sides, about the middle, within which no ray is left for this part, as others take them first.

    Examples
    --------
    >>> round(Part("dome", "hemisphere", (0, 0, 0), ((1, 0, 0), (0, 1, 0), (0, 0, 1)), (2.0, 0.0)).area, 3)
    25.133
    """

    name: str
    shape: Shape
    centre: tuple[float, float, float]
    axes: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
    size: tuple[float, float]
    focus: Focus = FLAT
    hole: float = 0.0

    @property
    def area(self) -> float:
        """Surface area [mm²]."""
        a, b = self.size
        match self.shape:
            case "rectangle":
                return a * b
            case "disk":
                return math.pi * a * a
            case "hemisphere":
                return 2 * math.pi * a * a
            case "tube":
                return 2 * math.pi * a * b

    @property
    def sides(self) -> tuple[float, float]:
        """Lengths of the sides of the chart [mm]; of disks and hemispheres those of the square of their area."""
        a, b = self.size
        if self.shape == "rectangle":
            return a, b
        return (2 * math.pi * a, b) if self.shape == "tube" else (math.sqrt(self.area),) * 2

    @property
    def etendue(self) -> float:
        """π · area [mm² sr]: that of all light that can leave the part on one side."""
        return math.pi * self.area

    def core(self) -> _core._Part:
        """The part as the compiled core takes it."""
        x, y, z = self.axes
        return {
            "shape": self.shape,
            "centre": self.centre,
            "x": x,
            "y": y,
            "z": z,
            "size": self.size,
            "focus": self.focus,
        }


AXES = ("x", "y", "z")
"""Along which a cylinder may lie."""

WORLD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))


@dataclasses.dataclass(frozen=True)
class Surface(abc.ABC):
    """A carrier surface: parts in the order in which a ray is offered to them.

    A ray belongs to the first part that its line crosses from the inside to the outside, wherever on its line it starts.
    Dimensions that are None are taken from the rays by `sized_for`.
    """

    NAME: ClassVar[str]
    CENTRE_SIZE: ClassVar[int] = 2
    """Coordinates of the centre: 3 where the height is no parameter of its own."""

    @abc.abstractmethod
    def parts(self) -> tuple[Part, ...]:
        """The charts; `ArgumentError` if a dimension is still open."""

    @abc.abstractmethod
    def sized_for(self, rays: RayStream) -> Self:
        """The same surface, with open dimensions as small as the rays allow; see `STRAY`."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, bool) or value is None or field.name == "axis":
                continue
            several = isinstance(value, Iterable) and not isinstance(value, str)
            for one in value if several else (value,):
                require_number(one, f"{type(self).__name__}: {field.name}", "numbers" if several else "a number")
            # Whatever numbers came in, floats are compared, printed and saved.
            numbers = tuple(float(v) for v in value) if several else float(value)
            object.__setattr__(self, field.name, numbers)
            if not np.isfinite(numbers).all():
                raise ArgumentError(f"{type(self).__name__}: {field.name} is {value!r}; give finite lengths in mm.")
            if field.name in LENGTHS and not (isinstance(numbers, float) and numbers > 0):
                raise ArgumentError(f"{type(self).__name__}: {field.name} is {value!r}; give a length above 0 mm.")
            wanted = self.sizes().get(field.name, 1)
            if np.size(numbers) != wanted:
                numbers_of = "coordinates" if field.name == "centre" else "numbers" if wanted > 1 else "number"
                raise ArgumentError(f"{type(self).__name__}: {field.name} is {value!r}; give {wanted} {numbers_of}.")

    @classmethod
    def sizes(cls) -> dict[str, int]:
        """How many numbers the dimensions have that have more than one."""
        return {"centre": cls.CENTRE_SIZE, "focus": len(FLAT)}

    @property
    def open_dimensions(self) -> tuple[str, ...]:
        """Names of the dimensions that are None."""
        return tuple(f.name for f in dataclasses.fields(self) if getattr(self, f.name) is None)

    def closed(self, name: str) -> float:
        """A dimension that must be known by now."""
        value = getattr(self, name)
        if value is None:
            raise ArgumentError(
                f"{type(self).__name__}: {name} is open; state it, or call sized_for(rays) to take it from the rays."
            )
        return float(value)

    @property
    def area(self) -> float:
        """Surface area of all parts [mm²]."""
        return sum(part.area for part in self.parts())

    @property
    def spec(self) -> str:
        """The surface as the command line takes it.

        Examples
        --------
        >>> Dome(radius=1.264).spec
        'dome:radius=1.264,z=0,centre=0/0'
        """
        return self._written(12)

    @property
    def told(self) -> str:
        """The surface as messages tell it: as `spec`, to four digits, and to more where it lies far off for its size.

        Examples
        --------
        >>> Dome(radius=1.26412).told, Disk(radius=1.26412, z=-10_000.03).told
        ('dome:radius=1.264,z=0,centre=0/0', 'disk:radius=1.264,z=-10000.03,centre=0/0')
        """
        lengths = (getattr(self, f.name) for f in dataclasses.fields(self) if f.name in LENGTHS)
        return self._written(4, max((length for length in lengths if length is not None), default=math.inf))

    def _written(self, digits: int, size: float = math.inf) -> str:
        return f"{self.NAME}:" + ",".join(
            f"{f.name}={_text(getattr(self, f.name), digits, size)}"
            for f in dataclasses.fields(self)
            if getattr(self, f.name) is not None and getattr(self, f.name) != UNSAID.get(f.name)
        )


UNSAID = {"frames": 0, "axis": "z"}
"""Values that are as if nothing were said."""

LENGTHS = {"width", "height", "depth", "radius", "window", "rest"}

MOST_FRAMES = 16


def _text(value: Any, digits: int, size: float) -> str:
    if isinstance(value, tuple):
        return "/".join(_text(v, digits, size) for v in value)
    if isinstance(value, bool | str):
        return str(value).lower()
    more = max(math.floor(math.log10(abs(value) / size)), 0) if abs(value) > size else 0
    return format(value, f".{digits + more}g")


@dataclasses.dataclass(frozen=True)
class Plane(Surface):
    """A rectangle in a plane of constant z that emits towards +Z, and frames about it for what lies farther out.

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
        (x, y) of the middle [mm]; None: from the rays.
    focus : tuple of 4 floats, optional
        Height above the plane at which light is sharp that leaves under θ, by powers of 1 - cos θ from the constant on [mm];
        None: 0 for all, but `LightField.fit` finds it.
    frames : int
        0 to 16.
    rest : float, optional
        Radius of a sphere about the middle [mm] that takes up all other lines: light that heads downwards, or comes from far
        beside. None: it is not in the field.

    Raises
    ------
    ArgumentError
        If a number is not finite, a length is not above 0, or there are no such frames.

    Examples
    --------
    >>> Plane(z=0.5, width=4, height=3, centre=(0, 0)).area
    12.0
    >>> [part.size for part in Plane(z=0, width=4, height=3, centre=(0, 0), frames=2).parts()]
    [(4.0, 3.0), (8.0, 6.0), (16.0, 12.0)]
    """

    NAME = "plane"
    z: float = 0.0
    width: float | None = None
    height: float | None = None
    centre: tuple[float, float] | None = None
    focus: Focus | None = None
    frames: int = 0
    rest: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number(self.frames, "Plane: frames", f"a whole number from 0 to {MOST_FRAMES}")
        if not (float(self.frames).is_integer() and 0 <= self.frames <= MOST_FRAMES):
            raise ArgumentError(f"Plane: frames is {self.frames!r}; give a whole number from 0 to {MOST_FRAMES}.")
        object.__setattr__(self, "frames", int(self.frames))

    @property
    def open_dimensions(self) -> tuple[str, ...]:
        """All that are None but the focus, which is then flat, and the rest, which is then left out."""
        return tuple(name for name in super().open_dimensions if name not in ("focus", "rest"))

    def parts(self) -> tuple[Part, ...]:
        """The rectangle, then the frames from within, then both halves of the sphere."""
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
        return (window, *frames, *beyond)

    def sized_for(self, rays: RayStream) -> Plane:
        """The smallest rectangle that the rays' lines cross, but for strays far off."""
        if not self.open_dimensions:
            return self
        hits = hits_upwards(rays, self.z, "Plane", self.focus or FLAT)
        spans = [_span(v, c) for v, c in zip(hits.T, self.centre or (None, None), strict=True)]
        centre = tuple((low + high) / 2 for low, high in spans)
        width, height = ((high - low) * (1 + SLACK) for low, high in spans)
        return dataclasses.replace(
            self, width=self.width or width, height=self.height or height, centre=self.centre or (centre[0], centre[1])
        )


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
        hits = hits_upwards(rays, self.z, "Disk")
        return dataclasses.replace(self, radius=_reach(np.hypot(*(hits - self.centre).T)))


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
    CENTRE_SIZE = 3
    radius: float | None = None
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def parts(self) -> tuple[Part, ...]:
        """One hemisphere."""
        return (Part("hemisphere", "hemisphere", self.centre, WORLD, (self.closed("radius"), 0.0)),)

    def sized_for(self, rays: RayStream) -> Hemisphere:
        """The smallest hemisphere that the rays' lines meet, but for strays far off."""
        return dataclasses.replace(self, radius=self.radius or _impact(rays, self.centre))


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
    CENTRE_SIZE = 3
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
        return dataclasses.replace(self, radius=self.radius or _impact(rays, self.centre))


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
    radius: float | None = None
    bottom: float | None = None
    top: float | None = None
    centre: tuple[float, float] = (0.0, 0.0)
    ends: bool = True
    axis: str = "z"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.axis not in AXES:
            raise UnknownNameError("axis of a cylinder", str(self.axis), AXES)
        if self.bottom is not None and self.top is not None and not self.top > self.bottom:
            raise ArgumentError(f"Cylinder: top {self.top:g} is not above bottom {self.bottom:g}.")

    def parts(self) -> tuple[Part, ...]:
        """The side, and the two ends."""
        radius, bottom, top = (self.closed(name) for name in ("radius", "bottom", "top"))
        along = AXES.index(self.axis)
        x, y, z = (_triple(np.eye(3)[(along + 1 + k) % 3]) for k in range(3))
        down = (x, _triple(-np.array(y) + 0.0), _triple(-np.array(z) + 0.0))

        def at(height: float) -> tuple[float, float, float]:
            return _triple(np.insert(self.centre, along, height))

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
        position, _ = _places_and_directions(rays)
        along = AXES.index(self.axis)
        low, high = _span(position[:, along], None)
        bottom = low if self.bottom is None else self.bottom
        top = high if self.top is None else self.top
        room = max(top - bottom, np.spacing(abs(top) + abs(bottom))) * SLACK
        return dataclasses.replace(
            self,
            radius=self.radius or _reach(np.hypot(*(np.delete(position, along, axis=1) - self.centre).T)),
            bottom=bottom - room if self.bottom is None else bottom,
            top=top + room if self.top is None else top,
        )


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
    CENTRE_SIZE = 3
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
                axes = (_triple(first), _triple(np.cross(normal, first)), _triple(normal))
                centre = np.array(self.centre) + normal * size[axis] / 2
                extent = (size[(axis + 1) % 3], size[(axis + 2) % 3])
                faces.append(Part(f"{mark}{letter}", "rectangle", _triple(centre), axes, extent))
        return tuple(faces)

    def sized_for(self, rays: RayStream) -> Box:
        """The smallest box about the rays' start points, but for strays far off."""
        if not self.open_dimensions:
            return self
        position, _ = _places_and_directions(rays)
        spans = [_span(v, c) for v, c in zip(position.T, self.centre or (None, None, None), strict=True)]
        extent = max(high - low for low, high in spans)
        width, height, depth = (max(high - low, SLACK * extent) * (1 + SLACK) for low, high in spans)
        middle = _triple(np.array([(low + high) / 2 for low, high in spans]))
        return Box(self.width or width, self.height or height, self.depth or depth, self.centre or middle)


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
        radius = self.radius or max(_impact(rays, (*self.centre, self.z)), self.window or 0.0)
        return dataclasses.replace(self, radius=radius)


SURFACES: Mapping[str, type[Surface]] = {
    kind.NAME: kind for kind in (Plane, Disk, Hemisphere, Sphere, Cylinder, Box, Dome)
}
"""Every carrier surface, by the name the command line and the files know."""


def parse_surface(text: str) -> Surface:
    """The surface that ``name:key=value,key=value`` describes; numbers of a centre or a focus are parted by slashes.

    Raises
    ------
    UnknownNameError
        If there is no such surface or dimension.
    ArgumentError
        If a value is no number.

    Examples
    --------
    >>> parse_surface("cylinder:radius=2,bottom=0,top=5,ends=false")
    Cylinder(radius=2.0, bottom=0.0, top=5.0, centre=(0.0, 0.0), ends=False, axis='z')
    """
    require(text, str, "parse_surface: text", "a surface in words, e.g. 'disk:radius=3'")
    name, _, rest = text.partition(":")
    kind = SURFACES.get(name.strip())
    if kind is None:
        raise UnknownNameError("surface", name, SURFACES)
    known = {f.name for f in dataclasses.fields(kind)}
    values: dict[str, Any] = {}
    for item in filter(None, (part.strip() for part in rest.split(","))):
        key, equals, value = (piece.strip() for piece in item.partition("="))
        if key not in known:
            raise UnknownNameError(f"dimension of the surface {name}", key, known)
        if not equals:
            raise ArgumentError(f"surface {text!r}: {key} has no value; write {key}=<number>.")
        if key in values:
            raise ArgumentError(f"surface {text!r}: {key} is stated twice.")
        values[key] = _value(text, key, value)
    return kind(**values)


def _value(text: str, key: str, value: str) -> float | bool | str | tuple[float, ...]:
    if key == "axis":
        return value
    if key == "ends":
        if value not in {"true", "false"}:
            raise ArgumentError(f"surface {text!r}: ends is {value!r}; write true or false.")
        return value == "true"
    try:
        numbers = tuple(float(v) for v in value.split("/"))
    except ValueError:
        raise ArgumentError(f"surface {text!r}: {key} is {value!r}; give a number in mm.") from None
    if key in Surface.sizes():
        return numbers
    if len(numbers) != 1:
        raise ArgumentError(f"surface {text!r}: {key} is {value!r}; give one number in mm.")
    return numbers[0]


def _places_and_directions(rays: RayStream) -> tuple[FloatArray, FloatArray]:
    """Positions [mm] and directions of some of the rays."""
    some = pilot_sample(rays, PILOT_RAYS)
    return some.position, some.direction


def hits_upwards(rays: RayStream, z: float, name: str, focus: Focus = FLAT) -> FloatArray:
    """Places on a height, taken at its focus, of rays that head towards +Z [mm], shape (m, 2).

    Raises
    ------
    ArgumentError
        If there are no such rays.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RaySet([[0, 0, 0], [0, 0, 0]], [[0.6, 0, 0.8], [0, 0, -1]], [1, 1])
    >>> hits_upwards(rays, 4.0, "Plane").tolist()
    [[3.0, 0.0]]
    """
    position, direction = _places_and_directions(rays)
    up = np.flatnonzero(direction[:, 2] > 0)
    if not len(up):
        raise ArgumentError(f"{name}: no ray heads towards +Z; turn the rays, or choose a sphere or cylinder.")
    x, k = position[up], direction[up]
    sharp = z + np.polynomial.polynomial.polyval(1.0 - k[:, 2], focus)
    hits: FloatArray = x[:, :2] + ((sharp - x[:, 2]) / k[:, 2])[:, None] * k[:, :2]
    return hits


def _span(values: FloatArray, centre: float | None) -> tuple[float, float]:
    """The interval that holds the values: all of them, or all but `STRAY` on each side if the others lie far off."""
    inner = np.quantile(values, [STRAY, 1 - STRAY])
    low, high = float(values.min()), float(values.max())
    if high - low > 1.5 * (inner[1] - inner[0]) > 0:
        low, high = float(inner[0]), float(inner[1])
    if centre is not None:
        half = max(high - centre, centre - low)
        low, high = centre - half, centre + half
    if high == low:  # all rays through one point: any extent will do
        low, high = low - 0.5e-3, high + 0.5e-3
    return low, high


def _reach(distances: FloatArray) -> float:
    """The radius that holds the distances, but for strays far off."""
    inner = float(np.quantile(distances, 1 - STRAY))
    reach = float(distances.max())
    reach = inner if reach > 1.5 * inner > 0 else reach
    return (reach or 0.5e-3) * (1 + SLACK)


def _impact(rays: RayStream, centre: tuple[float, float, float]) -> float:
    """The radius of the sphere about `centre` that the rays' lines meet: their distance from the centre."""
    position, direction = _places_and_directions(rays)
    offset = position - np.asarray(centre)
    return _reach(np.linalg.norm(np.cross(offset, direction), axis=1))


def _triple(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return (x, y, z)
