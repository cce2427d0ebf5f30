"""Samples to put into a virtual instrument, from files."""

from __future__ import annotations

import os
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from etendue.description.families import Family
from etendue.description.files import Files
from etendue.description.mistakes import mistakes_of
from etendue.errors import SceneError
from etendue.formats.input import as_path
from etendue.scatter.bsdf import Bsdf
from etendue.scatter.files import read_bsdf
from etendue.scatter.models import MODELS
from etendue.scatter.models.finish import Finish
from etendue.scene.toml import read_toml


def read_sample(path: str | os.PathLike[str]) -> Bsdf:
    r"""A sample: the keys of a finish in TOML (``kind = "gaussian"`` …), or a file of scatter data.

    Raises
    ------
    SceneError
        If the keys describe no finish.
    FormatError, OSError
        If the file cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "diffuser.toml"
    ...     _ = path.write_text('kind = "gaussian"\npeak = 17.0\nsigma = 0.09\nway = "transmitted"\n')
    ...     read_sample(path).sigma
    0.09
    """
    path = as_path(path)
    if path.suffix.lower() != ".toml":
        return read_bsdf(path)
    data = read_toml(path, path.read_bytes())
    family: Any = Annotated[Finish, Family(MODELS)]
    try:
        found: Finish = TypeAdapter(family).validate_python(data)
    except ValidationError as error:
        raise SceneError(path, mistakes_of(error, data)) from None
    found.record(Files(path.parent))
    return found
