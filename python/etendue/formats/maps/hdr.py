"""Radiance picture: luminance for the tools of the lighting trade, to 8 bits and without its error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from etendue.errors import ArgumentError, FormatError
from etendue.formats.maps import rgbe
from etendue.formats.maps.header import FOREIGN, MapHeader, header_text
from etendue.formats.maps.map_format import DAMAGED, AnyMap, MapFormat, check_room, parsing
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.pixel_map import MapValues
from etendue.units import RADIANCE_WHITE_EFFICACY, FluxUnit

MAGIC = b"#?RADIANCE\n"
FORMAT_LINE = "FORMAT=32-bit_rle_rgbe"
HEADER_KEY = "ETENDUE="
HEADER_PIECE = 1000
"""Characters of JSON per header line: the tools of Radiance read lines of up to 2047 bytes."""

PARALLEL_BELOW = 1e-4
"""Full view angle [°] under which a view is written as parallel."""

GREY = np.array([0.265074126, 0.670114631, 0.064811243])
"""Share of red, green and blue in the luminance of a Radiance picture (color.h, equal-energy white)."""

NARROWEST_VIEW, WIDEST_VIEW = 1.1e-6, 179.9999
"""Full view angles [°] between which Radiance has perspective views."""

LOST = "a Radiance picture has 8 bits per value (±0.4 %), no standard errors and no ray counts"


def write(lmap: AnyMap, path: Path) -> tuple[str, ...]:
    """Write a 32-bit_rle_rgbe picture.

    A luminance is written as luminance / 179 in red, green and blue, as Radiance computes it back; a radiance as it
    is. A dead pixel is the all-zero pixel. VIEW is the observer's view of the screen, lengths in mm. Lines that begin
    with ``ETENDUE=`` hold the exact header as JSON.
    """
    if not isinstance(lmap, LuminanceMap):
        raise ArgumentError(
            f"a Radiance picture holds luminance, and this map is {lmap.quantity}. Save it as .exr or .npz."
        )
    grey = lmap.values / _unit_in_file(lmap.flux_unit)
    lost = [LOST, *_out_of_range(grey)]
    mantissa, exponent = rgbe.encode_grey(grey)
    text = header_text(_as_read(lmap, rgbe.decode(mantissa, exponent)))
    view = _view(lmap)
    if not view:
        lost.append("no Radiance view shows this screen, so the picture has no VIEW")
    rows, columns = lmap.screen.shape
    pixel_aspect = (lmap.screen.height / rows) / (lmap.screen.width / columns)
    header = [
        MAGIC.decode("ascii").rstrip(),
        "SOFTWARE= " + " ".join(lmap.provenance.software.encode("ascii", "replace").decode("ascii").split()),
        *(HEADER_KEY + text[start : start + HEADER_PIECE] for start in range(0, len(text), HEADER_PIECE)),
        *([f"VIEW= {view}"] if view else []),
        *([f"PIXASPECT= {pixel_aspect:.9g}"] if abs(pixel_aspect - 1.0) > 1e-9 else []),
        FORMAT_LINE,
        "",
        f"-Y {rows} +X {columns}",
    ]
    with path.open("wb") as stream:
        stream.write("".join(f"{line}\n" for line in header).encode("ascii"))
        for line, power in zip(mantissa, exponent, strict=True):
            if columns in rgbe.RUN_WIDTHS:
                stream.write(rgbe.pack_line((line, line, line, power)))
            else:
                stream.write(np.stack((line, line, line, power), axis=-1).tobytes())
    return tuple(lost)


def _unit_in_file(flux_unit: FluxUnit) -> float:
    """What a pixel value of 1 means in the unit of the map."""
    return RADIANCE_WHITE_EFFICACY if flux_unit == "lm" else 1.0


def _out_of_range(grey: MapValues) -> Iterator[str]:
    largest = np.nanmax(grey, initial=0.0)
    if largest >= rgbe.LIMIT:
        raise ArgumentError(f"the map holds {largest:g}, too bright for a Radiance picture. Save it as .npz or .csv.")
    if (grey < 0.0).any():
        yield "values below 0 are written as 0"
    if ((grey > 0.0) & (grey < rgbe.SMALLEST)).any():
        yield f"values below {rgbe.SMALLEST:.1g} W/(m² sr) are written as 0"


def _as_read(lmap: LuminanceMap, grey: MapValues) -> LuminanceMap:
    """The map that `read` makes of decoded pixels."""
    return lmap.replace(
        values=grey * _unit_in_file(lmap.flux_unit),
        standard_error=np.full(grey.shape, np.nan),
        rays=np.where(np.isnan(grey), 0, -1),
    )


def _view(lmap: LuminanceMap) -> str:
    """Radiance's view parameters for this observer and screen, lengths in mm; empty where there are none."""
    observer, screen = lmap.observer, lmap.screen
    right, up, normal = screen.axes(observer)
    to_eye = observer.distance * observer.direction
    aside, above, height = (float(to_eye @ axis) for axis in (right, up, normal))
    if height <= 0.0:
        # plane="xy" from below: the picture is a mirror image of what is seen.
        return ""
    horizontal, vertical = (2.0 * math.degrees(math.atan2(size / 2, height)) for size in (screen.width, screen.height))
    axes = f"-vp {_numbers(observer.position)} -vd {_numbers(-normal)} -vu {_numbers(up)}"
    if max(horizontal, vertical) < PARALLEL_BELOW:
        # The parallel views of Radiance are never oblique.
        return "" if screen.plane == "xy" else f"-vtl {axes} -vh {screen.width:.9g} -vv {screen.height:.9g}"
    if min(horizontal, vertical) < NARROWEST_VIEW or max(horizontal, vertical) > WIDEST_VIEW:
        return ""
    # -vs and -vl move the picture against the view axis, in widths and heights of it.
    shift = f" -vs {-aside / screen.width:.9g} -vl {-above / screen.height:.9g}" if screen.plane == "xy" else ""
    return f"-vtv {axes} -vh {horizontal:.9g} -vv {vertical:.9g}{shift}"


def _numbers(vector: MapValues) -> str:
    # Adding 0 turns -0 into 0.
    return " ".join(f"{number + 0.0:.9g}" for number in vector)


def read(path: Path) -> AnyMap:
    """Read what `write` wrote; a change of exposure by another tool is undone, and noted."""
    data = path.read_bytes()
    end = data.find(b"\n\n")
    lines = data[:end].decode("latin-1").split("\n")
    text = "".join(line.removeprefix(HEADER_KEY) for line in lines if line.startswith(HEADER_KEY))
    if end < 0 or not text:
        raise FormatError(path, "header", f"no lines {HEADER_KEY!r} in it", FOREIGN)
    header = MapHeader.parse(path, f"header lines {HEADER_KEY!r}", text)
    if FORMAT_LINE not in lines or any(line.startswith("COLORCORR=") for line in lines):
        raise FormatError(path, "header", "not plain RGBE any more", f"It must have {FORMAT_LINE!r} and no COLORCORR.")
    start = data.find(b"\n", end + 2) + 1
    resolution = data[end + 2 : start - 1] if start else b""
    # Split, because Radiance's own tools pad the numbers with blanks.
    if resolution.split() != f"-Y {header.rows} +X {header.columns}".encode("ascii").split():
        found = f"{resolution[:40]!r}, the map has {header.rows} rows and {header.columns} columns"
        raise FormatError(path, "resolution line", found, DAMAGED)
    check_room(path, header.pixels, 4, rgbe.LARGEST_RATIO)
    with parsing(path, "pixels"):
        pixels = rgbe.unpack_lines(data[start:], header.rows, header.columns)
        exposures = [float(line.partition("=")[2]) for line in lines if line.startswith("EXPOSURE=")]
        exposure = math.prod(exposures)
        if not (math.isfinite(exposure) and exposure > 0.0):
            raise ValueError(f"the exposure is {exposure}")
        unit = _unit_in_file(header.data["flux_unit"]) / exposure
    values = rgbe.decode(_grey(pixels), pixels[:, 3]) * unit
    notes = (f"another tool changed the exposure to {exposure:g}; it was divided out",) if exposures else ()
    rays = np.where(np.isnan(values), 0, -1)
    return header.restore(values, np.full(values.shape, np.nan), rays, sealed=not exposures, notes=notes)


def _grey(pixels: rgbe.Bytes) -> MapValues:
    """Mantissa of the luminance, exactly that of the three colours where they agree."""
    red, green, blue = (pixels[:, plane].astype(np.float64) for plane in range(3))
    agree = (red == green) & (green == blue)
    return np.where(agree, red, GREY[0] * red + GREY[1] * green + GREY[2] * blue)


FORMAT = MapFormat("hdr", (".hdr", ".pic"), lambda head: head.startswith(b"#?"), read, write)
