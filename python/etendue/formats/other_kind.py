"""What a file is that was expected to be something else, and what takes it."""

from __future__ import annotations

import contextlib
from pathlib import Path

from etendue.errors import FormatError
from etendue.formats.head import Head
from etendue.formats.intensity import detect_intensity_format
from etendue.formats.own_kind import Kind, own_kind
from etendue.formats.rays import RAY_FORMATS


def other_kind(path: Path) -> Kind | None:
    """What a file is, from its beginning and, of scenes, from its name; None if nothing in étendue takes it."""
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


def foreign(path: Path, wanted: str, advice: str, place: str = "byte 0") -> FormatError:
    """The error for a file that is not what was `wanted`, with what it is if that is known."""
    other = other_kind(path)
    if other is not None:
        return FormatError(path, place, f"this is {other.title}, not {wanted}", advice)
    return FormatError(path, place, f"this is not {wanted}", advice)
