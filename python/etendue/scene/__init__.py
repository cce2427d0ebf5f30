"""Scenes: what a user writes of sources, solids, surfaces and detectors, and what the tracer takes of it."""

from __future__ import annotations

from etendue.scene import bodies, detectors, finishes, media, observers, placement, shapes, sources
from etendue.scene.compiling import Compiled, compile_scene
from etendue.scene.media import Medium
from etendue.scene.media_library import MEDIA
from etendue.scene.scene import Scene
from etendue.scene.things import Solid, Surface

__all__ = [
    "MEDIA",
    "Compiled",
    "Medium",
    "Scene",
    "Solid",
    "Surface",
    "bodies",
    "compile_scene",
    "detectors",
    "finishes",
    "media",
    "observers",
    "placement",
    "shapes",
    "sources",
]
