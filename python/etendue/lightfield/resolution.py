"""What a light field resolves: the finest array of spots that comes back from as many rays with half its contrast."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from etendue.lightfield.candidate import FINE_POSITIONS, images_of
from etendue.lightfield.counting import FloatArray, PartCounts, Sums
from etendue.lightfield.etendue_density import EtendueDensity
from etendue.lightfield.marginals import marginals
from etendue.lightfield.nodes import node_values
from etendue.quantities.powers_of_ten import rounded
from etendue.quantities.ray_stream import checked_threads

PITCHES = tuple(2.13 * 2.0 ** (k / 2.0) for k in range(13))
"""Pitches of the arrays that are tried, in cells of the images: none that dyadic boxes favour."""

HALF = 0.5
PHASE = 1.0
"""Of the cosines at the first cell [rad]: off the edges of dyadic boxes."""

POSITIONS = FINE_POSITIONS[:4]
"""Positions over which the images are averaged here: a quarter of those of a fit, in a quarter of the time."""

PURPOSE = 0x5350_4F54
"""Keeps the random numbers of the trial apart from all others."""


@dataclasses.dataclass(frozen=True)
class Resolution:
    """What a light field resolves on the part that has most of the flux.

    Parameters
    ----------
    part : str
        Its name.
    place : float
        Pitch of spots on the surface that directions share, which the field shows with half their contrast [mm].
    direction : float
        Pitch of beams that places share, likewise, near the normal [°].
    cell_place, cell_direction : float
        Side of the cells of places [mm] and of directions near the normal [°]: structure that changes with place and
        direction together is no finer than these.
    place_limit, direction_limit : {"rays", "cells"}
        What would resolve more: more rays, or finer cells of the images.

    Examples
    --------
    >>> Resolution("plane", 0.0512, 1.83, 0.7, 5.6, "rays", "rays").summary()
    '0.051 mm and 1.8° at half contrast (more rays would resolve more); 0.7 mm × 5.6° for what changes with both'
    """

    part: str
    place: float
    direction: float
    cell_place: float
    cell_direction: float
    place_limit: str
    direction_limit: str

    def summary(self) -> str:
        """One sentence."""
        more = dict.fromkeys(
            {"rays": "more rays", "cells": "finer cells"}[k] for k in (self.place_limit, self.direction_limit)
        )
        wanted = f"{', '.join(more)} would resolve more"
        shared = f"{rounded(self.place, 2)} mm and {rounded(self.direction, 2)}° at half contrast ({wanted})"
        return f"{shared}; {rounded(self.cell_place, 2)} mm × {rounded(self.cell_direction, 2)}° for what changes with both"


def resolution(field: EtendueDensity, *, seed: int = 1, threads: int | None = None) -> Resolution:
    """What a field resolves, tried out: an array of spots before the source, and as many rays as the field rests on.

    The images of the field over place and over direction are multiplied with (1 + cos 2πx/p)(1 + cos 2πy/p), as many rays as
    the field rests on are drawn from them, and images are made of these as in a fit. The contrast is what is left of the
    cosines. Where structure changes with the direction, as that of a die below a dome on the dome's surface does, only the
    tree in four dimensions sees it, with its coarser cells.

    Parameters
    ----------
    field : EtendueDensity
        Of any surface.
    seed : int
        Of the rays that are drawn.
    threads : int, optional
        All cores if None.

    Returns
    -------
    Resolution

    Examples
    --------
    >>> import etendue as et
    >>> disk = et.Disk(radius=30)
    >>> few, many = (et.LightField.fit(et.RingSource(rays=n), disk, depths=(3, 3, 2, 2)) for n in (2000, 20_000))
    >>> resolution(many).place < resolution(few).place
    True
    """
    threads = checked_threads(threads)
    charts, fluxes = field.surface.parts(), field.part_flux
    index = int(np.argmax(fluxes))
    chart, part, report = charts[index], field.parts[index], field.report
    rays = report.effective_rays if math.isfinite(report.effective_rays) else float(report.rays - report.unmet_rays)
    own = max(rays * fluxes[index] / field.total_flux, 1.0)
    fine = [len(f) for f in (part.space, part.direction) if f is not None]
    sides = (fine[0], fine[1]) if len(fine) == 2 else (part.ratio.shape[0], part.ratio.shape[2])
    images = marginals(part, sides, chart.shape == "tube")
    # One cell of n × n holds the share 1/n² of the area, and of the π of all direction cosines.
    units = math.sqrt(chart.area) / sides[0], math.degrees(math.sqrt(math.pi) / sides[1])

    def contrasts(pitch: float) -> tuple[float, float]:
        """Over place and over direction; both are tried at once."""
        stream = np.array([seed, PURPOSE + PITCHES.index(pitch)], dtype=np.uint64)
        generator = np.random.Generator(np.random.Philox(key=stream))
        true = [image * _spots(len(image), pitch) for image in images]
        space, direction = (Sums(generator.poisson(own * t / t.sum()).astype(np.float64), None) for t in true)
        if not (space.rays and direction.rays):
            return 0.0, 0.0
        counts = PartCounts(space, space, direction)
        found = images_of(counts, dataclasses.replace(chart, hole=0.0), threads, positions=POSITIONS).densities()
        over_place, over_direction = (_contrast(f, t, pitch) for f, t in zip(found, true, strict=True))
        return over_place, over_direction

    known: dict[float, tuple[float, float]] = {}

    def of(which: int) -> Callable[[float], float]:
        def contrast(pitch: float) -> float:
            if pitch not in known:
                known[pitch] = contrasts(pitch)
            return known[pitch][which]

        return contrast

    place, direction = (_half_contrast(of(which), sides[which]) for which in (0, 1))
    return Resolution(
        part=chart.name,
        place=place * units[0],
        direction=direction * units[1],
        cell_place=math.sqrt(chart.area / (part.ratio.shape[0] * part.ratio.shape[1])),
        cell_direction=math.degrees(math.sqrt(math.pi / (part.ratio.shape[2] * part.ratio.shape[3]))),
        place_limit="cells" if place <= PITCHES[1] else "rays",
        direction_limit="cells" if direction <= PITCHES[1] else "rays",
    )


def _spots(n: int, pitch: float) -> FloatArray:
    """An array of spots with this pitch on n × n cells: mean 1, darkest 0."""
    wave = 1.0 + _wave(n, pitch)
    return wave[:, None] * wave[None, :]


def _wave(n: int, pitch: float) -> FloatArray:
    """The mean of a cosine over each of n cells."""
    wave: FloatArray = np.sinc(1.0 / pitch) * np.cos(2.0 * np.pi * np.arange(n) / pitch + PHASE)
    return wave


def _contrast(found: FloatArray, true: FloatArray, pitch: float) -> float:
    """What is left of the cosines along both axes where the image is shown, linear between centres; the worse counts."""
    shown = node_values(found)
    wave = _wave(len(true), pitch)
    left = []
    for axes in ((0, 1), (1, 0)):
        signal = float((true.transpose(axes) @ wave).sum() / true.sum())
        left.append(float((shown.transpose(axes) @ wave).sum() / shown.sum()) / signal)
    # Cells hold sinc(1/p) of the amplitude, and a linear interpolation takes sinc²(1/p) of what its nodes have.
    return min(left) * float(np.sinc(1.0 / pitch)) ** 3


def _half_contrast(contrast: Callable[[float], float], n: int) -> float:
    """The pitch of half contrast in cells, between the coarsest that falls short and the finest that does not."""
    pitches = [p for p in PITCHES if p <= max(n // 2, 2)]
    low, high = -1, len(pitches)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if contrast(pitches[middle]) >= HALF else (middle, high)
    if high == len(pitches):
        return float(n)
    if high == 0:
        return float(pitches[0])
    less, more = contrast(pitches[low]), contrast(pitches[high])
    share = (HALF - less) / (more - less)
    return math.exp(math.log(pitches[low]) + share * math.log(pitches[high] / pitches[low]))
