"""Carrier surfaces, by the name that a user writes: where a light field lives. Rays are carried to them along themselves."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from etendue.errors import ArgumentError, UnknownNameError
from etendue.lightfield.carrier.box import Box
from etendue.lightfield.carrier.cylinder import Cylinder
from etendue.lightfield.carrier.disk import Disk
from etendue.lightfield.carrier.dome import Dome
from etendue.lightfield.carrier.hemisphere import Hemisphere
from etendue.lightfield.carrier.part import Part
from etendue.lightfield.carrier.plane import Plane
from etendue.lightfield.carrier.sphere import Sphere
from etendue.lightfield.carrier.surface import Surface
from etendue.quantities.arguments import require

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
        values[key] = _value(text, kind, key, value)
    return kind(**values)


def _value(text: str, kind: type[Surface], key: str, value: str) -> float | bool | str | tuple[float, ...]:
    (default,) = (f.default for f in dataclasses.fields(kind) if f.name == key)
    if isinstance(default, str):
        return value
    if isinstance(default, bool):
        if value not in {"true", "false"}:
            raise ArgumentError(f"surface {text!r}: {key} is {value!r}; write true or false.")
        return value == "true"
    try:
        numbers = tuple(float(v) for v in value.split("/"))
    except ValueError:
        raise ArgumentError(f"surface {text!r}: {key} is {value!r}; give a number in mm.") from None
    if key in kind.SIZES:
        return numbers
    if len(numbers) != 1:
        raise ArgumentError(f"surface {text!r}: {key} is {value!r}; give one number in mm.")
    return numbers[0]


__all__ = [
    "SURFACES",
    "Box",
    "Cylinder",
    "Disk",
    "Dome",
    "Hemisphere",
    "Part",
    "Plane",
    "Sphere",
    "Surface",
    "parse_surface",
]
