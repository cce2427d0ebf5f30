"""What all carrier surfaces share: parts, dimensions that may be open, and their text."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Self

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.carrier.part import Part
from etendue.quantities.arguments import require_number
from etendue.quantities.ray_stream import RayStream


@dataclasses.dataclass(frozen=True)
class Surface(abc.ABC):
    """A carrier surface: parts in the order in which a ray is offered to them.

    A ray belongs to the first part that its line crosses from the inside to the outside, wherever on its line it starts.
    Dimensions that are None are taken from the rays by `sized_for`.
    """

    NAME: ClassVar[str]
    """What the command line and the files call it."""

    LENGTHS: ClassVar[tuple[str, ...]]
    """Dimensions that are above 0."""

    SIZES: ClassVar[Mapping[str, int]] = MappingProxyType({"centre": 2})
    """How many numbers the dimensions have that have more than one."""

    UNSAID: ClassVar[Mapping[str, object]] = MappingProxyType({})
    """Values of dimensions that are as if nothing were said."""

    @abc.abstractmethod
    def parts(self) -> tuple[Part, ...]:
        """The charts; `ArgumentError` if a dimension is still open."""

    @abc.abstractmethod
    def sized_for(self, rays: RayStream) -> Self:
        """The same surface, with open dimensions as small as the rays allow; see `STRAY`."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, bool) or value is None or isinstance(field.default, str):
                continue
            several = isinstance(value, Iterable) and not isinstance(value, str | bytes)
            for one in value if several else (value,):
                instead = "numbers" if several or field.name in self.SIZES else "a number"
                require_number(one, f"{type(self).__name__}: {field.name}", instead)
            # Whatever numbers came in, floats are compared, printed and saved.
            numbers = tuple(float(v) for v in value) if several else float(value)
            object.__setattr__(self, field.name, numbers)
            if not np.isfinite(numbers).all():
                raise ArgumentError(f"{type(self).__name__}: {field.name} is {value!r}; give finite lengths in mm.")
            if field.name in self.LENGTHS and not (isinstance(numbers, float) and numbers > 0):
                raise ArgumentError(f"{type(self).__name__}: {field.name} is {value!r}; give a length above 0 mm.")
            wanted = self.SIZES.get(field.name, 1)
            if np.size(numbers) != wanted:
                numbers_of = "coordinates" if field.name == "centre" else "numbers" if wanted > 1 else "number"
                raise ArgumentError(f"{type(self).__name__}: {field.name} is {value!r}; give {wanted} {numbers_of}.")

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
        >>> import etendue as et
        >>> et.Dome(radius=1.264).spec
        'dome:radius=1.264,z=0,centre=0/0'
        """
        return self._written(12)

    @property
    def told(self) -> str:
        """The surface as messages tell it: as `spec`, to four digits, and to more where it lies far off for its size.

        Examples
        --------
        >>> import etendue as et
        >>> et.Dome(radius=1.26412).told, et.Disk(radius=1.26412, z=-10_000.03).told
        ('dome:radius=1.264,z=0,centre=0/0', 'disk:radius=1.264,z=-10000.03,centre=0/0')
        """
        lengths = (getattr(self, f.name) for f in dataclasses.fields(self) if f.name in self.LENGTHS)
        return self._written(4, max((length for length in lengths if length is not None), default=math.inf))

    def _written(self, digits: int, size: float = math.inf) -> str:
        return f"{self.NAME}:" + ",".join(
            f"{f.name}={_text(getattr(self, f.name), digits, size)}"
            for f in dataclasses.fields(self)
            if getattr(self, f.name) is not None and getattr(self, f.name) != self.UNSAID.get(f.name)
        )


def _text(value: Any, digits: int, size: float) -> str:
    if isinstance(value, tuple):
        return "/".join(_text(v, digits, size) for v in value)
    if isinstance(value, bool | str):
        return str(value).lower()
    more = max(math.floor(math.log10(abs(value) / size)), 0) if abs(value) > size else 0
    return format(value, f".{digits + more}g")
