"""Flat carrier surfaces with a beam: a disk of direction cosines that has cells of direction of its own."""

from __future__ import annotations

import dataclasses
import math

from etendue.errors import ArgumentError
from etendue.lightfield.carrier.part import ALL, Beam, Part


def checked_beam(beam: Beam | None, kind: str) -> None:
    """Refuses a beam that is not within all directions.

    Raises
    ------
    ArgumentError
        If it is not within the disk of radius 1 about (0, 0), or has no radius.

    Examples
    --------
    >>> checked_beam((0.6, 0.0, 0.5), "Disk")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    etendue.errors.ArgumentError: Disk: beam is (0.6, 0.0, 0.5); give the middle and the radius of a disk of direction ...
    """
    u, v, radius = beam or ALL
    if not (radius > 0.0 and math.hypot(u, v) + radius <= 1.0):
        raise ArgumentError(
            f"{kind}: beam is {beam!r}; give the middle and the radius of a disk of direction cosines within that of radius "
            "1 about (0, 0), e.g. (0, 0, 0.1)."
        )


def parted(part: Part, beam: Beam | None) -> tuple[Part, ...]:
    """A part for the beam, and one for all other directions; the part alone if there is no beam.

    Examples
    --------
    >>> from etendue.lightfield.carrier.part import WORLD
    >>> disk = Part("disk", "disk", (0, 0, 0), WORLD, (1.0, 0.0))
    >>> [(part.name, part.beam, part.taken) for part in parted(disk, (0.1, 0.0, 0.2))]
    [('beam', (0.1, 0.0, 0.2), (0.0, 0.0, 0.0)), ('disk', (0.0, 0.0, 1.0), (0.1, 0.0, 0.2))]
    """
    if beam is None or beam == ALL:
        return (part,)
    return dataclasses.replace(part, name="beam", beam=beam), dataclasses.replace(part, taken=beam)
