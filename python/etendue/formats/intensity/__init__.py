"""Files of luminous intensity distributions: one module per format, one registry, found by content."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from etendue.errors import ArgumentError, FormatError, UnknownNameError
from etendue.formats.encodings import refuse_unmarked
from etendue.formats.head import Head
from etendue.formats.input import as_path, is_stream, require_file
from etendue.formats.intensity import eulumdat, gldf, lm63, tm33
from etendue.formats.intensity.intensity_format import IntensityFormat
from etendue.formats.output import atomic_output
from etendue.quantities.arguments import INTENSITY, require, require_known, require_number, require_path
from etendue.quantities.intensity import Intensity
from etendue.quantities.report import Complaint

INTENSITY_FORMATS: dict[str, IntensityFormat] = {
    module.FORMAT.name: module.FORMAT for module in (eulumdat, lm63, tm33, gldf)
}
"""Every format by name, in the order in which a file is tested: what must be in seven lines before what may be in one."""

INTENSITY_EXTENSIONS: tuple[str, ...] = tuple(f.extension for f in INTENSITY_FORMATS.values() if f.write)
"""Extensions that choose a format for writing."""

POLES_APART = 0.05
"""Share of the largest intensity by which planes may differ where they meet without a word: measured ones do by 1 %."""

PLANES_COUNTED_AS = {"lm63": "lm63", "tm33": "lm63", "eulumdat": "eulumdat"}
"""Which of the formats that can be written counts its planes C from the same side of a luminaire."""


def detect_intensity_format(path: str | os.PathLike[str]) -> IntensityFormat | None:
    """The format of an intensity file, from its content; None if it is none of them.

    A pipe is none: looking at its beginning would take that away from whoever reads it.

    Raises
    ------
    OSError
        If the file cannot be opened.
    """
    path = as_path(path)
    if is_stream(path):
        return None
    head = Head.of(path)
    return next((f for f in INTENSITY_FORMATS.values() if f.recognise(head)), None)


def read_intensity(path: str | os.PathLike[str], photometry: str | None = None) -> Intensity:
    """Read an intensity file of any format: IES LM-63, EULUMDAT, TM-33, GLDF; the format is found from the content.

    The planes C are the file's own. IES and EULUMDAT count them from different sides of a luminaire (C of EULUMDAT is C of
    IES + 90°), and both count them from above, against the axis; `Intensity.rotated_about_axis` and `Intensity.mirrored`
    lead from one to the other, and nothing does so unasked.

    Parameters
    ----------
    path : path
        Of the file.
    photometry : str, optional
        Which one, of a file that holds several: the number of an emitter of TM-33, the name of a photometry, an emitter
        or a variant of GLDF. Without it TM-33 gives the sum of its emitters, and GLDF the only one that it has.

    Returns
    -------
    Intensity
        Absolute, over all planes whatever the symmetry of the file. Its `complaints` tell everything that is wrong with
        the file, `luminaire` what else it says.

    Raises
    ------
    FormatError
        With file, place, what was found and what to do; of a file that holds several, with the names of all.
    UnknownNameError
        If there is no such photometry in the file.
    ArgumentError
        If a photometry is named, and the format holds one only; or if the path leads to a pipe, a device or a folder.
    OSError
        If the file cannot be opened.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> narrow = Intensity(c=[0], gamma=[0, 10, 90], values=[[1000, 10, 0]])
    >>> with TemporaryDirectory() as folder:
    ...     lost = write_intensity(Path(folder) / "spot.ies", narrow)
    ...     read_intensity(Path(folder) / "spot.ies").values.tolist(), lost
    ([[1000.0, 10.0, 0.0]], ())
    """
    require_file(as_path(path), "intensity files are looked at before they are read")
    found = detect_intensity_format(path)
    if found is None:
        refuse_unmarked(Path(path), Head.of(Path(path)).data)
        known = ", ".join(f"{f.title} ({f.extension})" for f in INTENSITY_FORMATS.values())
        why = "this is no intensity distribution: it begins as none of the known formats do"
        raise FormatError(path, "first lines", why, f"Known are {known}.")
    if photometry is None:
        return _with_poles_told(found.read(as_path(path)))
    if found.pick is None:
        raise ArgumentError(
            f"{path}: photometry {photometry!r}: {found.title} files hold one distribution; leave the name out."
        )
    return _with_poles_told(found.pick(as_path(path), photometry))


def _with_poles_told(led: Intensity) -> Intensity:
    """With a complaint if planes differ by much where they meet, which no source does: a table out of order, or damaged."""
    told = []
    for row in (0, -1):
        apart = float(np.ptp(led.values[:, row]))
        if led.gamma[row] in (0.0, 180.0) and apart > POLES_APART * led.maximum:
            low, high = float(led.values[:, row].min()), float(led.values[:, row].max())
            found = f"all planes meet there, and say {low:.6g} to {high:.6g} {led.unit}; they were taken as they are"
            told.append(Complaint("warning", f"intensities at γ = {led.gamma[row]:g}°", found))
    return led.replace(complaints=(*led.complaints, *told)) if told else led


def write_intensity(
    path: str | os.PathLike[str],
    intensity: Intensity,
    format: str | None = None,
    *,
    rotate: float = 0.0,
    mirror: bool = False,
) -> tuple[str, ...]:
    """Write an IES LM-63-2002 or EULUMDAT file: completely, or not at all.

    Parameters
    ----------
    path : path
        Of the file; its folder must exist.
    intensity : Intensity
        Planes and angles are written as they are, with only as many planes as its symmetry needs.
    format : {"lm63", "eulumdat"}, optional
        From the extension if None.
    rotate : float
        [°] Turn the source about its axis first: what is at C is written at C + `rotate`. 90 turns the planes of IES
        into those of EULUMDAT, -90 the other way.
    mirror : bool
        Write what is at C at -C first: from counting about the direction of emission (étendue) to counting from above.

    Returns
    -------
    tuple of str
        What the format could not express, one sentence each.

    Raises
    ------
    UnknownNameError
        If there is no such format or extension.
    ArgumentError
        If the format cannot hold the distribution at all.
    """
    require_path(path, "write_intensity: path", "the path of the file first, then the Intensity")
    require(intensity, Intensity, "write_intensity: intensity", INTENSITY)
    require_number(rotate, "write_intensity: rotate", "a number of degrees")
    path = Path(path)
    writable = {name: f for name, f in INTENSITY_FORMATS.items() if f.write}
    by_extension = {f.extension: f for f in writable.values()}
    if format is not None:
        require_known(format, writable, "intensity format that can be written")
        chosen = writable[format]
    elif path.suffix.lower() in by_extension:
        chosen = by_extension[path.suffix.lower()]
    else:
        raise UnknownNameError("extension of an intensity file", path.suffix.lower(), by_extension)
    counted = PLANES_COUNTED_AS.get(intensity.provenance.format, chosen.name)
    kept: tuple[str, ...] = ()
    if counted != chosen.name and rotate == 0.0:
        turn = 90 if chosen.name == "eulumdat" else -90
        origin = INTENSITY_FORMATS[intensity.provenance.format].title
        kept = (f"C planes were kept as {origin} counts them; rotate={turn} turns them to those of {chosen.title}",)
    if mirror:
        intensity = intensity.mirrored()
    if rotate != 0.0:
        intensity = intensity.rotated_about_axis(rotate)
    with atomic_output(path) as temporary:
        losses = chosen.write(intensity, temporary) if chosen.write else ()
    return (*losses, *kept)
