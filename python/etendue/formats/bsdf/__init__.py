"""Files that hold a BSDF: one module per format, one registry, found by content."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

from etendue.errors import ArgumentError, FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats.bsdf import (
    astm,
    bird,
    etendue_hdf5,
    fred,
    klems,
    lighttools,
    merl,
    pab,
    rgl,
    speos,
    speos_brdf,
    speos_coated,
    speos_scattering,
    speos_simple,
    ssdd,
    tensor_tree,
    tracepro,
    zemax,
)
from etendue.formats.bsdf.bsdf_format import NO_ERRORS, SNIFFED_BYTES, BsdfFormat, ShareTables
from etendue.formats.bsdf.tokens import ADVICE
from etendue.formats.encodings import in_utf8, refuse_unmarked
from etendue.formats.input import as_path, require_readable
from etendue.formats.other_kind import other_kind
from etendue.formats.output import atomic_output
from etendue.quantities.arguments import require_known
from etendue.quantities.bsdf_data import BsdfData

BSDF_FORMATS: dict[str, BsdfFormat] = {
    module.FORMAT.name: module.FORMAT
    for module in (
        astm,
        bird,
        etendue_hdf5,
        fred,
        klems,
        lighttools,
        merl,
        pab,
        rgl,
        speos,
        speos_brdf,
        speos_coated,
        speos_scattering,
        speos_simple,
        ssdd,
        tensor_tree,
        tracepro,
        zemax,
    )
}
"""Every format by name."""

REFUSED: dict[str, tuple[str, str]] = {
    ".bsdf180": ("a Speos BSDF180 container", "Save its parts as .anisotropicbsdf, as text."),
    ".ddr": ("a diffuse distribution of Integra", "Export it as SSDD."),
    ".ddt": ("a diffuse distribution of Integra", "Export it as SSDD."),
    ".sdr": ("a specular distribution of Integra", "Export it as SSDD."),
    ".sdt": ("a specular distribution of Integra", "Export it as SSDD."),
}
"""Formats that are known by their extension, and are not read: what they are, and what to do."""


def read_bsdf_data(path: str | os.PathLike[str]) -> BsdfData:
    """Read what a file holds of a BSDF; the format is found from the content.

    Parameters
    ----------
    path : path
        A file of any of `BSDF_FORMATS`.

    Returns
    -------
    BsdfData
        Slices and components as they stand in the file, in étendue's frame, with all complaints and the name of the format.

    Raises
    ------
    FormatError
        If it is none of the formats, or damaged; UnsupportedFormatError for one that is known by name and not read.
    OSError
        If the file cannot be opened.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from etendue.quantities.bsdf_directions import direction
    >>> from etendue.quantities.bsdf_slice import BsdfSlice
    >>> from etendue.quantities.polar_grid import PolarGrid
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
                try:
                    data = candidate.read(readable)
                except ArgumentError as error:
                    # Numbers that are each fine and make no slice together.
                    raise FormatError(path, "values", str(error), ADVICE) from error
                return dataclasses.replace(data, format=candidate.name)
    if path.suffix.lower() in REFUSED:
        what, advice = REFUSED[path.suffix.lower()]
        raise UnsupportedFormatError(path, "extension", f"this is {what}", advice)
    if head.startswith(b"OPTIS - "):
        advice = "étendue reads BSDF, BRDF, scattering, simple scattering and coated surfaces, as text."
        raise UnsupportedFormatError(path, "first line", "this is a Speos file of another kind", advice)
    refuse_unmarked(path, head)
    other = other_kind(path)
    if other is not None:
        raise UnsupportedFormatError(path, "first bytes", f"this is {other.title}, no BSDF", other.advice)
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
        require_known(name, BSDF_FORMATS, "BSDF format")
        return BSDF_FORMATS[name]
    # Of ".bsdf" and ".lt.bsdf" the longer one says more.
    endings = sorted(
        ((extension, form) for form in BSDF_FORMATS.values() for extension in form.extensions),
        key=lambda pair: -len(pair[0]),
    )
    for extension, form in endings:
        if path.name.lower().endswith(extension):
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
        raise FormatError(
            path, "layout", f"the table does not fit {form.title}", "In Python, write_bsdf brings it into that layout."
        )
    with atomic_output(path) as temporary, temporary.open("w+b") as stream:
        lost = form.write(data, stream)
    errors = any(one.standard_error is not None for one in data.slices)
    return (*lost, NO_ERRORS) if errors and not form.holds_errors else lost


def write_bsdf_shares(path: str | os.PathLike[str], shares: ShareTables, format: str | None = None) -> None:
    """Write shares of mirrored and Lambertian light in a format that holds no tables.

    Parameters
    ----------
    path : path
        Appears whole or not at all.
    shares : ShareTables
        By angle and wavelength.
    format : str, optional
        One of `BSDF_FORMATS`; by the extension if left out.

    Raises
    ------
    UnknownNameError
        If there is no such format.
    ArgumentError
        If the format cannot hold them.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import numpy as np
    >>> mirrored = np.array([[[0.9], [0.95]], [[0.0], [0.0]]])
    >>> mirror = ShareTables("mirror", np.array([0.0, 90.0]), np.array([555.0]), mirrored, 0.0 * mirrored)
    >>> with TemporaryDirectory() as folder:
    ...     write_bsdf_shares(Path(folder) / "mirror.coated", mirror)
    ...     read_bsdf_data(Path(folder) / "mirror.coated").components[0]["specular_reflectance"]["values"]
    [0.9, 0.95]
    """
    path = as_path(path)
    form = bsdf_format(path, format)
    if form.write_shares is None:
        raise ArgumentError(
            f"{form.title} holds tables, and these are shares: in Python, write_bsdf makes a table of them."
        )
    with atomic_output(path) as temporary, temporary.open("w+b") as stream:
        form.write_shares(shares, stream)
