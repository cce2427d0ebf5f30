"""A file wherever a source is asked for."""

from __future__ import annotations

import os

from etendue.formats.input import as_path
from etendue.formats.patch_folder import is_patch_folder
from etendue.formats.rays import read_rays
from etendue.lightfield.light_field import LightField
from etendue.lightfield.storage import is_field_file
from etendue.quantities.ray_set import RaySet
from etendue.scene import Scene
from etendue.scene.sources.gridded import Gridded

SCENE_EXTENSION = ".toml"


def open_source(path: str | os.PathLike[str]) -> RaySet | LightField | Scene:
    """What a file holds: a scene if it ends in ``.toml``, else, by its content, a light field or rays.

    A folder of patches is a scene of nothing else.

    Raises
    ------
    FormatError
        If it is of no such format, or damaged.
    OSError
        If it cannot be opened.
    SceneError
        If the scene has mistakes.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import etendue as et
    >>> with TemporaryDirectory() as folder:
    ...     _ = et.write_rays(Path(folder) / "rings.tm25ray", et.RingSource(rays=1000).ray_set())
    ...     open_source(Path(folder) / "rings.tm25ray")
    <RaySet of 1,000 rays in lm from rings.tm25ray>
    """
    path = as_path(path)
    if is_patch_folder(path):
        return Scene(name=path.name, sources=(Gridded(file=path),))
    if path.suffix.lower() == SCENE_EXTENSION:
        return Scene.load(path)
    return LightField.load(path) if is_field_file(path) else read_rays(path)
