"""The luminous opening of an IES file: a shape coded in the signs of three lengths."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from etendue.units import MM_PER_LENGTH_UNIT

_SHAPES_BY_SIGNS: dict[tuple[int, int, int], str] = {
    # (width, length, height): LM-63-2002 and 2019, table 1
    (-1, -1, 0): "ellipse",
    (-1, -1, 1): "vertical cylinder",
    (-1, -1, -1): "ellipsoid",
    (-1, 1, -1): "cylinder along length",
    (1, -1, -1): "cylinder along width",
    (-1, 0, -1): "vertical ellipse",
    (0, -1, -1): "vertical ellipse",
    # 1995, and 2002 files that still spell it that way
    (-1, 0, 0): "circle of one diameter",
    (-1, 0, 1): "vertical cylinder of one diameter",
    (0, 1, -1): "cylinder along length",
    (1, 0, -1): "cylinder along width",
    (-1, 1, 0): "ellipse",
    (1, -1, 0): "ellipse",
    (-1, 1, 1): "vertical cylinder",
    (1, -1, 1): "vertical cylinder",
}
_SHAPES_OF_1995: dict[tuple[int, int, int], str] = {
    (-1, 0, -1): "sphere of one diameter",
    (-1, 1, -1): "ellipsoid",
    (1, -1, -1): "ellipsoid",
}
"""Signs that mean something else before 2002."""

_SIGNS_BY_SHAPE: dict[str, tuple[int, int, int]] = {
    "point": (0, 0, 0),
    "rectangle": (1, 1, 0),
    "box": (1, 1, 1),
    "circle": (-1, -1, 0),
    "ellipse": (-1, -1, 0),
    "vertical cylinder": (-1, -1, 1),
    "sphere": (-1, -1, -1),
    "ellipsoid": (-1, -1, -1),
    "cylinder along length": (-1, 1, -1),
    "cylinder along width": (1, -1, -1),
    # One of both extents is 0, and has no sign.
    "vertical ellipse": (-1, -1, -1),
}
"""How LM-63-2002 spells each shape."""


def opening_facts(width: float, length: float, height: float, unit: str, version: int) -> dict[str, Any]:
    """Shape and extents [mm] of the luminous opening, as keys of `LUMINAIRE_FACTS`.

    Parameters
    ----------
    width, length, height : float
        As the file has them, with their signs. Width runs along C90-C270, length along C0-C180.
    unit : {"feet", "m"}
        What they are in.
    version : int
        Year of the standard that the file names.
    """
    signs = (_sign(width), _sign(length), _sign(height))
    shape = _SHAPES_BY_SIGNS.get(signs)
    if version < 2002:
        shape = _SHAPES_OF_1995.get(signs, shape)
    if min(signs) >= 0:
        shape = "box" if height else "rectangle" if width or length else "point"
    if shape is None:
        return {"opening_shape": f"unknown: width {width:g}, length {length:g}, height {height:g} {unit}"}
    mm = MM_PER_LENGTH_UNIT[unit]
    x, y, z = abs(length) * mm, abs(width) * mm, abs(height) * mm
    if shape.endswith(" of one diameter"):
        shape, x = shape.removesuffix(" of one diameter"), y
    if shape == "cylinder along length" and y == 0.0:
        y = z
    if shape == "cylinder along width" and x == 0.0:
        x = z
    if math.isclose(x, y):
        shape = {"ellipse": "circle", "ellipsoid": "sphere" if math.isclose(x, z) else shape}.get(shape, shape)
    return {"opening_shape": shape, "opening_x": x, "opening_y": y, "opening_z": z}


def opening_lengths(facts: Mapping[str, Any]) -> tuple[tuple[float, float, float], bool]:
    """Width, length, height [m] as LM-63-2002 spells them, and whether they say all that the facts do."""
    shape = str(facts.get("opening_shape", "point"))
    x, y, z = (float(facts.get(f"opening_{axis}", 0.0)) / MM_PER_LENGTH_UNIT["m"] for axis in "xyz")
    signs = _SIGNS_BY_SHAPE.get(shape)
    if signs is None:
        return (0.0, 0.0, 0.0), False
    width, length, height = (
        sign * extent if sign and extent else 0.0 for sign, extent in zip(signs, (y, x, z), strict=True)
    )
    return (width, length, height), True


def _sign(number: float) -> int:
    return (number > 0.0) - (number < 0.0)
