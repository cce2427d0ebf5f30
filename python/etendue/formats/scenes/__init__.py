"""Scenes for ray tracers: a source's patches with their intensity distributions, one writer per ray tracer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from etendue.formats.scenes import mitsuba, radiance
from etendue.quantities.patches import Patches

SCENES: dict[str, Callable[[Patches, Path, float], None]] = {"radiance": radiance.write, "mitsuba": mitsuba.write}
"""What writes a scene into an empty folder, by the name of the ray tracer: patches, the folder, and what multiplies all
tables in the light of the scene."""

SCENE_FILES = {"radiance": radiance.FILES, "mitsuba": mitsuba.FILES}
"""Names of the files of each scene in its folder, a regular expression."""
