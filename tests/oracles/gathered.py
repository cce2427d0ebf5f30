"""What a map of gathered light says of the error that its pixels have in common."""

from __future__ import annotations

import etendue as et


def common_error(*, lmap: et.LuminanceMap) -> float:
    """The larger of the difference to lines that go on and its standard error, relative, as the map's notes have them."""
    (note,) = (note for note in lmap.notes if note.startswith("compared with"))
    figures = note.split(": ")[1].split(" of ")[0].split("±")
    return max(abs(float(figure.strip(" +%"))) / 100 for figure in figures)
