"""`read_bsdf`: files of scatter data as a BSDF."""

from __future__ import annotations

import os

from etendue.formats.bsdf import read_bsdf_data
from etendue.scatter.table import BsdfTable


def read_bsdf(path: str | os.PathLike[str]) -> BsdfTable:
    """Read a BSDF; the format is found from the content.

    Parameters
    ----------
    path : path
        A file of any format of docs/formats/bsdf-files.md.

    Returns
    -------
    BsdfTable
        With all that was not as it should be in `complaints`.

    Raises
    ------
    FormatError
        If it is none of the formats, or damaged; UnsupportedFormatError for formats that are known and refused.
    OSError
        If the file cannot be opened.
    """
    return BsdfTable(read_bsdf_data(path))
