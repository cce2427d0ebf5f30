"""Intensity distributions that sources take from files: what points and luminous surfaces say of them alike."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import numpy as np

from etendue.description.files import Files
from etendue.errors import ArgumentError
from etendue.formats.intensity import read_intensity
from etendue.quantities.intensity import Intensity
from etendue.quantities.spectral_lines import SpectralLines
from etendue.units import FluxUnit


class TakesTable(Protocol):
    """A source with the keys of a distribution.

    Examples
    --------
    >>> from etendue.scene.sources import Point
    >>> lamp: TakesTable = Point(flux=4)
    >>> lamp.file is None
    True
    """

    file: Path | None
    photometry: str | None
    intensity: Intensity | None
    flux: float | None
    flux_unit: FluxUnit | None


def has_table(source: TakesTable) -> bool:
    """Whether a distribution is given.

    Examples
    --------
    >>> from etendue.scene.sources import Point
    >>> has_table(Point(flux=4)), has_table(Point(file="lamp.ies"))
    (False, True)
    """
    return source.file is not None or source.intensity is not None


def check_origin(source: TakesTable) -> None:
    """Refuse what cannot be meant together.

    Raises
    ------
    ValueError
        If a distribution is given twice, or a key that belongs to another origin, or nothing tells the flux.

    Examples
    --------
    >>> from etendue.scene.sources import Point
    >>> check_origin(Point(flux=4))
    """
    if source.file is not None and source.intensity is not None:
        raise ValueError("'file' and 'intensity' are both given; use one")
    if source.photometry is not None and source.file is None:
        raise ValueError("'photometry' names one of the distributions of a file; give 'file'")
    if has_table(source) and source.flux_unit is not None:
        raise ValueError("'flux_unit' is the file's own; leave it out")
    if not has_table(source) and source.flux is None:
        raise ValueError("'flux' is missing; only a file could tell it")


def read_table(source: TakesTable, files: Files) -> Intensity:
    """The distribution that is given.

    Raises
    ------
    ArgumentError, FormatError, OSError
        If it cannot be read, or sends out no light.

    Examples
    --------
    >>> from etendue.scene.sources import Point
    >>> lamp = Intensity(c=[0], gamma=[0, 90], values=[[2.0, 0.0]])
    >>> read_table(Point(intensity=lamp), Files()) is lamp
    True
    """
    table = source.intensity
    if source.file is not None:
        table = read_intensity(files.find(source.file), source.photometry)
    assert table is not None  # noqa: S101 - one of the two is given
    if (table.values < 0.0).any() or not table.flux > 0.0:
        raise ArgumentError("the intensity is negative somewhere, or 0 everywhere")
    return table


def table_record(table: Intensity) -> dict[str, Any]:
    """Angles [rad] and values as the core takes them.

    Examples
    --------
    >>> table_record(Intensity(c=[0], gamma=[0, 90], values=[[2.0, 0.0]]))["gamma"].round(4).tolist()
    [0.0, 1.5708]
    """
    return {"gamma": np.radians(table.gamma), "c": np.radians(table.c), "values": np.array(table.values)}


def spectrum_is_mean(table: Intensity) -> bool:
    """Whether the spectrum of a distribution is that of rays of several colours, which may go into different directions.

    Examples
    --------
    >>> rays = Intensity([0], [0, 180], [[1.0, 1]], luminaire={"spectrum": SpectralLines([450, 600], [1, 2])})
    >>> spectrum_is_mean(rays)
    True
    """
    spectrum = table.luminaire.get("spectrum")
    return isinstance(spectrum, SpectralLines) and spectrum.is_mean


def front_of(table: Intensity) -> Intensity:
    """What of a distribution a flat surface can send out: the same function up to γ = 90°, and nothing beyond.

    Raises
    ------
    ArgumentError
        If nothing is left.

    Examples
    --------
    >>> lamp = Intensity(c=[0], gamma=[0, 120], values=[[4.0, 0.0]])
    >>> front = front_of(lamp)
    >>> front.gamma.tolist(), front.values.tolist()
    ([0.0, 90.0], [[4.0, 1.0]])
    """
    if table.gamma[-1] <= 90.0:
        return table
    kept = table.gamma < 90.0
    if not kept.any():
        raise ArgumentError("all light of this distribution goes beyond γ = 90°, behind the surface")
    at_rim = np.array([table.at(c, 90.0) for c in table.c]).reshape(-1, 1)
    front = Intensity(
        table.c,
        np.append(table.gamma[kept], 90.0),
        np.concatenate([table.values[:, kept], at_rim], axis=1),
        flux_unit=table.flux_unit,
        luminaire=table.luminaire,
        provenance=table.provenance.then("cut at γ = 90°"),
    )
    if not front.flux > 0.0:
        raise ArgumentError("all light of this distribution goes beyond γ = 90°, behind the surface")
    return front
