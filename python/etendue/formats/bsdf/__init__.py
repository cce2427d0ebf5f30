"""Files that hold a BSDF: one module per format, one registry, found by content."""

from __future__ import annotations

import os
from pathlib import Path

from etendue.errors import FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats.bsdf import astm, etendue_hdf5, fred, klems, speos, tracepro, zemax
from etendue.formats.bsdf.bsdf_format import SNIFFED_BYTES, BsdfFormat
from etendue.formats.encodings import in_utf8, refuse_unmarked
from etendue.formats.input import as_path, require_readable
from etendue.formats.output import atomic_output
from etendue.quantities.bsdf_data import BsdfData

BSDF_FORMATS: dict[str, BsdfFormat] = {
    module.FORMAT.name: module.FORMAT for module in (astm, etendue_hdf5, fred, klems, speos, tracepro, zemax)
}
"""Every format by name."""

REFUSED: dict[bytes, tuple[str, str]] = {
    b"OPTIS - ": ("a Speos surface file of another kind", "étendue reads anisotropic BSDF as text; save it as that."),
    b"tensor_file": ("a tensor file of RGL", "étendue does not read it yet."),
}
"""Formats that are known by how they begin, and are not read: what they are, and what to do."""


def read_bsdf_data(path: str | os.PathLike[str]) -> BsdfData:
    """Read what a file holds of a BSDF; the format is found from the content.

    Parameters
    ----------
    path : path
        A file of any of `BSDF_FORMATS`.

    Returns
    -------
    BsdfData
        Slices and components as they stand in the file, in étendue's frame, with all complaints.

    Raises
    ------
    FormatError
        If it is none of the formats, or damaged; UnsupportedFormatError for one that is known by name and not read.
    OSError
        If the file cannot be opened.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from etendue.quantities.bsdf_data import BsdfSlice, PolarGrid, direction
    >>> grid = PolarGrid("specular", [0.0, 90.0], [0.0, 180.0])
    >>> half = BsdfData([BsdfSlice(direction(30.0, 180.0), [[0.16, 0.16]] * 2, grid=grid)])
    >>> with TemporaryDirectory() as folder:
    ...     lost = write_bsdf_data(Path(folder) / "half.bsdf", half)
    ...     read_bsdf_data(Path(folder) / "half.bsdf").slices[0].theta.__round__(6), lost
    (30.0, ())
    """
    path = as_path(path)
    require_readable(path)
    with in_utf8(path) as readable:
        with readable.open("rb") as stream:
            head = stream.read(SNIFFED_BYTES)
        for candidate in BSDF_FORMATS.values():
            if candidate.recognise(head):
                return candidate.read(readable)
    for start, (what, advice) in REFUSED.items():
        if head.startswith(start):
            raise UnsupportedFormatError(path, "first bytes", f"this is {what}", advice)
    refuse_unmarked(path, head)
    found = f"no BSDF format begins with {head[:8]!r}" if head else "the file is empty"
    names = ", ".join(form.title for form in BSDF_FORMATS.values())
    raise FormatError(path, "first bytes", found, f"étendue reads {names}.")


def bsdf_format(path: Path, name: str | None) -> BsdfFormat:
    """The format of a file to be written: by its name, or by the extension.

    Raises
    ------
    UnknownNameError
        If there is no such format, or no format has the extension.
    """
    if name is not None:
        if name not in BSDF_FORMATS:
            raise UnknownNameError("BSDF format", name, BSDF_FORMATS)
        return BSDF_FORMATS[name]
    for form in BSDF_FORMATS.values():
        if path.suffix.lower() in form.extensions:
            return form
    known = [extension for form in BSDF_FORMATS.values() for extension in form.extensions]
    raise UnknownNameError("extension of BSDF files", path.suffix, known)


def write_bsdf_data(path: str | os.PathLike[str], data: BsdfData, format: str | None = None) -> tuple[str, ...]:
    """Write data that are in the layout of a format.

    Parameters
    ----------
    path : path
        Appears whole or not at all.
    data : BsdfData
        Of a layout for which the format's `fits` is true; `etendue.write_bsdf` makes one of any BSDF.
    format : str, optional
        One of `BSDF_FORMATS`; by the extension if left out.

    Returns
    -------
    tuple of str
        What the format cannot hold.

    Raises
    ------
    UnknownNameError
        If there is no such format.
    FormatError
        If the data do not fit.
    """
    path = as_path(path)
    form = bsdf_format(path, format)
    if form.write is None or form.fits is None or not form.fits(data):
        raise FormatError(path, "layout", f"the table does not fit {form.title}", "Write it by write_bsdf.")
    with atomic_output(path) as temporary, temporary.open("w+b") as stream:
        return form.write(data, stream)
