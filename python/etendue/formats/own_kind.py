"""What a file is that étendue itself wrote, or reads as a scene, and what takes it."""

from __future__ import annotations

import contextlib
import dataclasses
import re
from pathlib import Path

from etendue.formats.hdf5 import SIGNATURE
from etendue.formats.head import WORKBOOK_SIGNATURE, Head


@dataclasses.dataclass(frozen=True)
class Kind:
    """A kind of file that étendue takes elsewhere.

    Parameters
    ----------
    title : str
        With its article.
    advice : str
        What takes it.
    """

    title: str
    advice: str


LIGHT_FIELD, TRACE_RESULT, NEAR_FIELD = "etendue light field", "etendue trace result", "etendue near-field measurement"
"""What the attribute ``format`` of HDF5 files says."""

MAP_TITLE, ILLUMINANCE_TITLE = "# etendue luminance map", "# etendue illuminance map"
"""First lines of maps as CSV."""

DIRECTIONS = ("theta_i", "phi_i", "theta_s", "phi_s", "bsdf")
POSITIONS = ("angle", "flux")
POLAR = ("theta_s", "phi_s", "flux")
STAGES = ("alpha", "beta", "gamma", "delta", "flux")
STANDARD_ERROR = "standard_error"
"""Columns of goniometer scans as CSV, and the one that may stand beside them."""

SCANS = (
    (DIRECTIONS, "etendue bsdf fit makes a BSDF of it, and deconvolve takes the instrument out of it."),
    (STAGES, "etendue bsdf fit makes a BSDF of it."),
    (POLAR, "etendue deconvolve takes the instrument out of it."),
    (POSITIONS, "etendue deconvolve takes the instrument out of it."),
)
"""Columns, and what takes a scan that has them."""

MAP = Kind("a luminance or illuminance map", "etendue plot, filter, compare and view take it.")
WORKBOOK = Kind(
    "a workbook of Excel", "etendue bsdf fit takes scans of the goniometer RT-300S; export other tables as text."
)
SCENE = Kind("a scene", "etendue info, trace, luminance, draw, sweep and view take it.")
FINISH = Kind("a finish", "etendue goniometer takes it; in a scene it is one of the finishes.")
BSDF = Kind(
    "scatter data (étendue BSDF)", "etendue bsdf info says what it holds; in a scene it is the file of a finish."
)
OF_HDF5 = {
    LIGHT_FIELD: Kind("a light field", "etendue luminance, view, intensity, sample and info take it."),
    TRACE_RESULT: Kind("the result of a trace", "etendue info, luminance and view take it."),
    NEAR_FIELD: Kind("a near-field measurement", "etendue goniophotometer takes it."),
}
"""By the attribute ``format``."""

KIND_OF_FINISH = re.compile(rb"^[ \t]*kind[ \t]*=", re.MULTILINE)
"""A key that scenes have in their tables only, and a finish by itself before any."""
FIRST_TABLE = re.compile(rb"^[ \t]*\[", re.MULTILINE)


def own_kind(head: Head) -> Kind | None:
    """What a file is that étendue wrote, or reads as a scene, a finish or scans: told without readers of rays or intensity.

    Examples
    --------
    >>> own_kind(Head(Path("lamp.toml"), 17, b'name = "downlight"')).title
    'a scene'
    >>> own_kind(Head(Path("paint.toml"), 19, b'kind = "lambertian"')).title
    'a finish'
    >>> own_kind(Head(Path("scan.csv"), 11, b"Angle; flux")).title
    'a goniometer scan'
    """
    data = head.data
    if data.startswith(SIGNATURE):
        return _of_hdf5(head.path)
    if data.startswith(WORKBOOK_SIGNATURE):
        return WORKBOOK
    titles = (MAP_TITLE.encode("ascii"), ILLUMINANCE_TITLE.encode("ascii"))
    if (data.startswith(b"PK\x03\x04") and b"header.npy" in data[:128]) or data.startswith(titles):
        return MAP
    if head.path.suffix.lower() != ".toml":
        return _scan(head)
    return FINISH if KIND_OF_FINISH.search(FIRST_TABLE.split(data, 1)[0]) else SCENE


def _scan(head: Head) -> Kind | None:
    """A scan is known by the names of its columns, in the first line that is no remark."""
    first = next((line for line in head.lines if line.strip() and not line.lstrip().startswith("#")), "")
    names = {name.strip().casefold() for name in re.split("[;\t,]", first)} - {STANDARD_ERROR}
    return next((Kind("a goniometer scan", advice) for layout, advice in SCANS if names == set(layout)), None)


def _of_hdf5(path: Path) -> Kind | None:
    import h5py

    with contextlib.suppress(OSError, KeyError, ValueError, TypeError), h5py.File(path, "r") as file:
        if "slices" in file.attrs and "format" not in file.attrs:
            return BSDF
        stated = file.attrs.get("format")
        return OF_HDF5.get(stated.decode("utf-8", "replace") if isinstance(stated, bytes) else str(stated))
    return None
