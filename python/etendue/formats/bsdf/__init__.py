"""Files that hold a BSDF: one module per format, one registry, found by content."""

from __future__ import annotations

import os

from etendue.quantities.bsdf_data import BsdfData


def read_bsdf_data(path: str | os.PathLike[str]) -> BsdfData:
    raise NotImplementedError
