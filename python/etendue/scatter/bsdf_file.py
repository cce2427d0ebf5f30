"""A finish from a file of scatter data, or from a BSDF in memory."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import ClassVar, Literal, Self

from pydantic import InstanceOf, model_validator
from pydantic.json_schema import SkipJsonSchema

from etendue.description.files import Files
from etendue.errors import ArgumentError
from etendue.scatter.bsdf import Bsdf
from etendue.scatter.files import read_bsdf
from etendue.scatter.models.finish import Directed, Record
from etendue.scatter.table import BsdfTable


class BsdfFile(Directed):
    """A surface that scatters as a file says, or a BSDF in memory.

    Parameters
    ----------
    file : path
        Of any format that `read_bsdf` reads; or
    bsdf : Bsdf
        the BSDF itself, from Python only.
    axis : three numbers
        Where the x axis of the sample points, in the coordinates of the solid or surface; it is laid on the surface at every
        point. For anisotropic samples.

    Examples
    --------
    >>> from etendue.scatter.models import Lambertian
    >>> BsdfFile(bsdf=Lambertian(reflectance=0.5)).reflectance(0).tolist()
    0.5
    """

    IN_MEMORY: ClassVar[tuple[str, ...]] = ("bsdf",)

    kind: Literal["bsdf"] = "bsdf"
    file: Path | None = None
    bsdf: SkipJsonSchema[InstanceOf[Bsdf] | None] = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.file is None) == (self.bsdf is None):
            raise ValueError("name a 'file', or hand over a 'bsdf' in Python")
        return self

    def opened(self, files: Files) -> Bsdf:
        """The BSDF that is meant.

        Raises
        ------
        FormatError, OSError
            If its file cannot be read.
        """
        if self.bsdf is not None:
            return self.bsdf
        if self.file is None:
            raise ArgumentError("neither a file nor a BSDF")
        path = files.find(self.file).resolve()
        about = path.stat()
        return _opened(path, about.st_mtime_ns, about.st_size)

    def record(self, files: Files) -> Record:
        """That of the BSDF."""
        return self.opened(files).record(files)

    def lets_light_in(self, files: Files) -> bool:
        """If it transmits, mirrors aside."""
        return any(self.opened(files).ways[1::2])


@functools.lru_cache(maxsize=8)
def _opened(path: Path, _time: int, _size: int) -> BsdfTable:
    # A scene asks for the same file several times; of another time or size it is another one.
    return read_bsdf(path)
