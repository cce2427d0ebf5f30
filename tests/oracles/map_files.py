"""Luminance maps without symmetry, and what each file format can hold of them, worked out apart from the writers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from etendue.formats.maps import MAP_FORMATS
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance

NAN = math.nan
EXACT, FLOAT32 = {"npz", "csv"}, {"exr", "tiff"}


def make_map(shape: tuple[int, int] = (4, 3), seed: int = 1, **fields: Any) -> LuminanceMap:
    """No symmetry anywhere; dead, black and very bright pixels; runs of equal values; unknown errors and counts."""
    rng = np.random.default_rng(seed)
    values = rng.gamma(1.5, 2000.0, shape)
    values[:, : shape[1] // 2] = values[0, 0]
    values.flat[0] = 0.0
    values.flat[values.size // 2] = NAN
    values.flat[-1] = 3.3e7
    error = values * rng.uniform(0.01, 0.2, shape)
    error.flat[values.size // 3] = NAN
    rays = np.where(np.isnan(values), 0, rng.integers(-1, 10**6, shape))
    plain = {
        "observer": Observer(41.7, -13.2, 812.5, (0.1, -2.0, 3.0)),
        "screen": Screen(12.3, 7.7, shape[1], shape[0]),
        "provenance": Provenance("LED »x«, ü.ray", "tm25", "ab12", ("cone 1.5°", "filter"), "étendue 0.1"),
        "notes": ("first, with a comma", 'second "quoted"\nand broken'),
    }
    return LuminanceMap(values, error, rays, **(plain | fields))


def path_of(name: str, folder: Path) -> Path:
    return folder / f"map{MAP_FORMATS[name].extensions[0]}"


def as_stored(lmap: LuminanceMap, name: str) -> LuminanceMap:
    """What a file of this format can hold of a map, worked out independently of the writers."""
    if name in EXACT:
        return lmap
    if name in FLOAT32:
        values, error = (a.astype(np.float32).astype(np.float64) for a in (lmap.values, lmap.standard_error))
        return lmap.replace(values=values, standard_error=error)
    assert name == "hdr"
    unit = 179.0 if lmap.flux_unit == "lm" else 1.0
    values = np.vectorize(lambda value: eight_bits(value / unit) * unit, otypes=[float])(lmap.values)
    dead = np.isnan(lmap.values)
    return lmap.replace(values=values, standard_error=np.full(values.shape, NAN), rays=np.where(dead, 0, -1))


def eight_bits(value: float) -> float:
    if math.isnan(value) or value == 0.0:
        return value
    step = 2.0 ** (math.floor(math.log2(value)) - 7)
    return (math.floor(value / step) + 0.5) * step


def assert_same(one: LuminanceMap, other: LuminanceMap) -> None:
    for field in ("values", "standard_error", "rays"):
        np.testing.assert_array_equal(getattr(one, field), getattr(other, field))
    assert one.header() == other.header()


def decode_by_the_book(data: bytes) -> tuple[list[str], npt.NDArray[np.int64]]:
    """Header lines and RGBE bytes (rows, columns, 4), byte by byte from "Radiance File Formats"."""
    header, _, rest = data.partition(b"\n\n")
    resolution, _, rest = rest.partition(b"\n")
    _, rows, _, columns = resolution.split()
    height, width = int(rows), int(columns)
    pixels = np.zeros((height, width, 4), dtype=np.int64)
    stream = iter(rest)
    for line in range(height):
        if 8 <= width < 32768:
            assert (next(stream), next(stream), 256 * next(stream) + next(stream)) == (2, 2, width)
            for component in range(4):
                column = 0
                while column < width:
                    code = next(stream)
                    if code > 128:
                        value, count = next(stream), code - 128
                        pixels[line, column : column + count, component] = value
                    else:
                        count = code
                        for offset in range(count):
                            pixels[line, column + offset, component] = next(stream)
                    column += count
                assert column == width
        else:
            for column in range(width):
                pixels[line, column] = [next(stream) for _ in range(4)]
    assert next(stream, None) is None
    return header.decode("ascii").split("\n"), pixels
