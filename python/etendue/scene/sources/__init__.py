"""Sources of light, by the ``kind`` that a user writes; the registry is the list of the tests."""

from __future__ import annotations

from etendue.scene.sources.from_files import Field, Point, Rays
from etendue.scene.sources.gridded import Gridded
from etendue.scene.sources.source import Source
from etendue.scene.sources.surfaces import Beam, Rings, Surface

SOURCES: dict[str, type[Source]] = {
    cls.model_fields["kind"].default: cls for cls in (Rays, Field, Gridded, Surface, Rings, Point, Beam)
}
"""Every source by its kind."""

__all__ = ["SOURCES", "Beam", "Field", "Gridded", "Point", "Rays", "Rings", "Source", "Surface"]
