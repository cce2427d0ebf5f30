"""What a file is that was expected to be something else, and what takes it."""

from __future__ import annotations

import contextlib
import dataclasses
from pathlib import Path

from etendue.errors import FormatError
from etendue.formats.head import Head


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


MAP = Kind("a luminance or illuminance map", "etendue plot, filter, compare and view take it.")
SCENE = Kind("a scene", "etendue trace, luminance, draw, sweep and view take it.")
BSDF = "etendue bsdf info says what it holds; in a scene it is the file of a finish."
OF_HDF5 = {
    "etendue light field": Kind("a light field", "etendue luminance, view, intensity, sample and info take it."),
    "etendue trace result": Kind("the result of a trace", "etendue info, luminance and view take it."),
    "etendue near-field measurement": Kind("a near-field measurement", "etendue goniophotometer takes it."),
}
"""By the attribute ``format`` of an HDF5 file."""

HDF5 = b"\x89HDF\r\n\x1a\n"


def own_kind(head: Head) -> Kind | None:
    """What a file is that holds no rays and no intensity distribution: one that étendue wrote, a BSDF or a scene.

    Examples
    --------
    >>> own_kind(Head(Path("lamp.toml"), 17, b'name = "downlight"')).title
    'a scene'
    """
    data = head.data
    if data.startswith(HDF5):
        return _of_hdf5(head.path)
    if (data.startswith(b"PK\x03\x04") and b"header.npy" in data[:128]) or data.startswith(
        (b"# etendue luminance map", b"# etendue illuminance map")
    ):
        return MAP
    from etendue.formats.bsdf import BSDF_FORMATS  # only a file that nobody knows needs all formats

    for form in BSDF_FORMATS.values():
        if form.recognise(data):
            return Kind(f"scatter data ({form.title})", BSDF)
    return SCENE if head.path.suffix.lower() == ".toml" else None


def other_kind(path: Path) -> Kind | None:
    """What a file is, from its beginning and, of scenes, from its name; None if nothing in étendue takes it."""
    from etendue.formats.intensity import detect_intensity_format
    from etendue.formats.rays import RAY_FORMATS

    with contextlib.suppress(FormatError):
        head = Head.of(path)
        found = own_kind(head)
        if found is not None:
            return found
        form = detect_intensity_format(path)
        if form is not None:
            return Kind(
                f"an intensity distribution ({form.title})",
                "etendue intensity, plot and info take it; a source of a scene can name it.",
            )
        for rays in RAY_FORMATS:
            if rays.recognise(head):
                return Kind(
                    f"a ray file ({rays.title})",
                    "etendue info, fit, luminance and convert take it; a source of a scene can name it.",
                )
    return None


def _of_hdf5(path: Path) -> Kind | None:
    import h5py

    with contextlib.suppress(OSError, KeyError, ValueError, TypeError), h5py.File(path, "r") as file:
        if "slices" in file.attrs and "format" not in file.attrs:
            return Kind("scatter data (étendue BSDF)", BSDF)
        stated = file.attrs.get("format")
        return OF_HDF5.get(stated.decode("utf-8", "replace") if isinstance(stated, bytes) else str(stated))
    return None


def foreign(path: Path, wanted: str, advice: str, place: str = "byte 0") -> FormatError:
    """The error for a file that is not what was `wanted`, with what it is if that is known."""
    other = other_kind(path)
    if other is not None:
        return FormatError(path, place, f"this is {other.title}, not {wanted}", advice)
    return FormatError(path, place, f"this is not {wanted}", advice)
