"""Ray files: found by content, read without copying, written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from etendue.errors import ArgumentError, FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats.encodings import in_utf8, refuse_unmarked
from etendue.formats.head import Head
from etendue.formats.input import as_path, at_rest, is_stream, require_readable, stream_in_file
from etendue.formats.output import atomic_output
from etendue.formats.own_kind import own_kind
from etendue.formats.rays import (
    asap,
    ascii_table,
    etd,
    lighttools,
    lighttools_text,
    refused,
    speos,
    speos_text,
    tm25,
    tracepro,
    zemax,
    zemax_text,
)
from etendue.formats.rays.ray_format import RayFormat
from etendue.quantities.arguments import require, require_path
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream
from etendue.units import FluxUnit

RAY_FORMATS: tuple[RayFormat, ...] = (
    tm25.FORMAT,
    etd.FORMAT,
    lighttools.FORMAT,
    zemax.FORMAT,
    speos.FORMAT,
    asap.FORMAT,
    lighttools_text.FORMAT,
    tracepro.FORMAT,
    zemax_text.FORMAT,
    speos_text.FORMAT,
    ascii_table.FORMAT,
)
"""Every format, in the order in which a file is tested: magic numbers first, bare columns of numbers last."""


def detect_format(path: str | os.PathLike[str]) -> RayFormat:
    """The format of a ray file, from its content.

    Raises
    ------
    UnsupportedFormatError
        If the file is of a format that étendue refuses by name.
    FormatError
        If it is of no known format.
    """
    head = Head.of(as_path(path))
    for candidate in RAY_FORMATS:
        if candidate.recognise(head):
            return candidate
    refuse_unmarked(head.path, head.data)
    own = own_kind(head)
    if own is not None:
        raise UnsupportedFormatError(path, "byte 0", f"this is {own.title}, no ray file", own.advice)
    refused.refuse(head)
    known = ", ".join(f.title for f in RAY_FORMATS)
    raise FormatError(
        path, "byte 0", f"{head.data[:16]!r} begins no ray file that étendue knows", f"Known formats: {known}."
    )


def read_rays(path: str | os.PathLike[str], *, flux: float | None = None, flux_unit: FluxUnit | None = None) -> RaySet:
    """Read a ray file. Its format is found from the content, never from the extension.

    Text may be in UTF-8, Latin-1, or UTF-16 with a byte-order mark.

    The rays of binary files stay where they are: opening 28 GB takes no memory. Files whose per-ray values are relative
    (TM-25, LightTools, Speos) are scaled to the header's total flux.

    Parameters
    ----------
    path : str or path
        Of the file.
    flux : float, optional
        Total flux that overrides the file's [`flux_unit`].
    flux_unit : {"lm", "W"}, optional
        Unit of `flux`; the file's own if None.

    Returns
    -------
    RaySet
        Its `complaints` tell everything that is wrong with the file. Of a ray index it is a `RayIndex`.

    Raises
    ------
    FormatError
        With file, place, what was found and what to do.
    ArgumentError
        If it is a directory, a device or a socket.
    OSError
        If the file cannot be opened.

    Warns
    -----
    ChangedFileWarning
        If somebody wrote to the file, at any time as long as the set is in use; what it was when it was opened counts. That
        it became shorter, or is another file, is a FormatError.
    WaitingWarning
        If it is a pipe, and nothing comes. A pipe is read to its end into a temporary file.
    """
    path = as_path(path)
    require_readable(path)
    rays = _from_stream(path) if is_stream(path) else _from_file(path)
    if flux is None and flux_unit is not None:
        raise ArgumentError("read_rays: flux_unit is the unit of `flux`, which is missing; RaySet.in_unit converts.")
    return rays if flux is None else rays.with_total_flux(flux, flux_unit)


def _from_file(path: Path) -> RaySet:
    with at_rest(path), in_utf8(path) as readable:
        return detect_format(readable).read(readable)


def _from_stream(path: Path) -> RaySet:
    """The rays that come out of a pipe, under its name."""
    with stream_in_file(path) as file:
        return _from_file(file)


def write_rays(
    path: str | os.PathLike[str], rays: RayStream, format: str | None = None, *, flux_unit: FluxUnit | None = None
) -> tuple[str, ...]:
    """Write a ray file: completely, or not at all.

    Parameters
    ----------
    path : str or path
        Of the file; its folder must exist.
    rays : RayStream
        A ray set, or a source that draws its rays on demand.
    format : str, optional
        The name of one, as ``"tm25"`` or ``"zemax"``; `docs/formats/ray-files.md` lists them. From the extension if None.
    flux_unit : {"lm", "W"}, optional
        Unit of the flux in the file, whatever of the rays' spectra it then cannot hold. None: that of the rays, but watts in
        formats that hold wavelengths beside watts only (TM-25).

    Returns
    -------
    tuple of str
        What the format could not express, one sentence each.

    Raises
    ------
    UnknownNameError
        If there is no such format.
    ArgumentError
        If the extension belongs to none or to several, there are no rays or more than the format holds, or they have no
        position and the format needs one.
    """
    require_path(path, "write_rays: path", "the path of the file first, then the rays")
    require(rays, RayStream, "write_rays: rays", "rays, of a file et.read_rays(path)")
    path = Path(path)
    chosen = writable_format(path, rays, format)
    notes: tuple[str, ...] = ()
    if flux_unit is not None and isinstance(rays, RaySet):
        rays = rays.in_unit(flux_unit)
        if chosen.wants_watts(rays):
            rays = rays.without_spectrum()
            notes = (f"{chosen.title} holds wavelengths and spectra of rays beside W only: they are left out, for lm.",)
    with atomic_output(path, size=chosen.least_size(rays)) as temporary:
        return (*notes, *chosen.write(rays, temporary), *rays.notes)


def writable_format(path: Path, rays: RayStream, format: str | None = None) -> RayFormat:
    """The format that a file of these rays will have, which can hold them; looks at their number, not at the rays.

    Raises
    ------
    UnknownNameError, ArgumentError
        As `write_rays`.

    Examples
    --------
    >>> from etendue.quantities.ray_set import RaySet
    >>> writable_format(Path("led.dat"), RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0])).name
    'zemax'
    """
    chosen = format_of_output(path, format)
    if len(rays) == 0:
        raise ArgumentError(f"{path}: there are no rays to write.")
    if chosen.most_rays is not None and len(rays) > chosen.most_rays:
        raise ArgumentError(
            f"{path}: {len(rays):,} rays of {rays.provenance.source}; a file of the format {chosen.title} holds at most "
            f"{chosen.most_rays:,}. Draw fewer (--subset, or RaySet.subset in Python) or write TM-25."
        )
    if not (rays.has_position or chosen.far_field):
        able = ", ".join(f.name for f in RAY_FORMATS if f.far_field)
        raise ArgumentError(
            f"{path}: {chosen.title} holds a position for every ray, and far-field rays have none; "
            f"at the origin they would look like a point source. Formats for far-field rays: {able}."
        )
    return chosen


OTHER_NAMES = {
    "opticstudio": "zemax",
    "zemax-opticstudio": "zemax",
    "ansys-speos": "speos",
    "iestm25": "tm25",
    "tm-25": "tm25",
}
"""Of formats, as users call them."""


def format_named(name: str) -> RayFormat:
    """The format of a name, whatever its case, or of another name that it goes by.

    Raises
    ------
    UnknownNameError
        If there is none; suggests the nearest.

    Examples
    --------
    >>> format_named("OpticStudio").name
    'zemax'
    """
    require(name, str, "format", "the name of a format of ray files, or None")
    wanted = name.strip().lower()
    for candidate in RAY_FORMATS:
        if candidate.name.lower() == OTHER_NAMES.get(wanted, wanted):
            return candidate
    raise UnknownNameError("ray format", name, [f.name for f in RAY_FORMATS])


def format_of_output(path: Path, name: str | None = None) -> RayFormat:
    """The format that a file will have: of that name or, without one, the only one of its extension.

    Raises
    ------
    UnknownNameError
        If there is none of that name.
    ArgumentError
        If the extension belongs to none or to several.

    Examples
    --------
    >>> format_of_output(Path("led.dis")).name, format_of_output(Path("led.ray"), "speos").unit
    ('asap', 'W')
    """
    if name is not None:
        return format_named(name)
    fitting = [f for f in RAY_FORMATS if path.suffix.lower() in f.extensions]
    if len(fitting) == 1:
        return fitting[0]
    names = [f.name for f in fitting or RAY_FORMATS]
    reason = "belongs to several formats" if fitting else "belongs to no ray format"
    raise ArgumentError(f"{path}: the extension {path.suffix!r} {reason}; name one: {', '.join(names)}.")
