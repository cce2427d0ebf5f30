"""Ray indices (``.etd``) as a format among others; docs/formats/ray-index.md describes it byte by byte."""

from __future__ import annotations

from pathlib import Path

from etendue.formats.head import Head
from etendue.formats.rays.index_file import MAGIC
from etendue.formats.rays.ray_format import RayFormat
from etendue.formats.rays.ray_index import RayIndex, write_index
from etendue.quantities.ray_stream import RayStream


def recognise(head: Head) -> bool:
    """By the magic bytes."""
    return head.data.startswith(MAGIC)


def read(path: Path) -> RayIndex:
    """Map an index; see `RayIndex.open`."""
    return RayIndex.open(path)


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Index rays into a file; all that the set knows is kept, but rays that cannot be used are not."""
    return write_index(rays, path, progress=rays.watcher)


FORMAT = RayFormat("etd", "étendue ray index", (".etd",), recognise, read, write)
"""Ray indices."""
