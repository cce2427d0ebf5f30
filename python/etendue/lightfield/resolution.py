"""What a light field resolves: the finest array of spots that comes back from as many rays with half its contrast."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from etendue.lightfield.candidate import FINE_POSITIONS, images_of
from etendue.lightfield.counting import FloatArray, PartCounts, Sums
from etendue.lightfield.etendue_density import EtendueDensity
from etendue.lightfield.marginals import marginals
from etendue.lightfield.nodes import node_values
from etendue.lightfield.storage import rounded_part
from etendue.lightfield.symmetry import sum_of_images
from etendue.quantities.powers_of_ten import rounded
from etendue.quantities.ray_stream import checked_seed, checked_threads

PITCHES = tuple(2.13 * 2.0 ** (k / 2.0) for k in range(13))
"""Pitches of the arrays that are tried, in cells of the images along the longer side: none that dyadic boxes favour."""

HALF = 0.5
PHASE = 1.0
"""Of the cosines at the first cell [rad]: off the edges of dyadic boxes; those of symmetric fields are even."""

POSITIONS = FINE_POSITIONS[:4]
"""Positions over which the images are averaged here: a quarter of those of a fit, in a quarter of the time."""

PURPOSE = 0x5350_4F54
"""Keeps the random numbers of the trial apart from all others."""


class Wave(NamedTuple):
    """A cosine along one side of an image: its pitch in cells, and its mean over each of them.

    Examples
    --------
    >>> Wave(2.0, np.array([1.0, -1.0])).pitch
    2.0
    """

    pitch: float
    cells: FloatArray


Pitches = tuple[float | None, float | None]
"""Along either side of an image; None along one that has no room for two spots."""

Waves = tuple[Wave | None, Wave | None]


@dataclasses.dataclass(frozen=True)
class Resolution:
    """What a light field resolves on the part that has most of the flux.

    Parameters
    ----------
    part : str
        Its name.
    place : float
        Pitch of spots on the surface that directions share, which the field shows with half their contrast along either
        side [mm]; along the longer one alone where the shorter has no room for two.
    direction : float
        Pitch of beams that places share, likewise, near the normal, or the middle of the beam if the part is for one [°].
    cell_place, cell_direction : float
        Longer side of the cells of places [mm] and of directions there [°]: structure that changes with place
        and direction together is no finer than these.
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
    cosines, the worse of both: cells of a long surface are long. Where structure changes with the direction, as that of a
    die below a dome on the dome's surface does, only the tree in four dimensions sees it, with its coarser cells. Of a field
    that was folded by a symmetry the spots have it too, and the rays that are drawn are folded as those of the fit were.

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
    threads, seed = checked_threads(threads), checked_seed(seed)
    charts, fluxes = field.surface.parts(), field.part_flux
    index = int(np.argmax(fluxes))
    # As a file holds it: counts that are drawn from a field and from the same one loaded are the same, bit by bit.
    chart, part, report = charts[index], rounded_part(field.parts[index]), field.report
    symmetry = report.symmetry
    rays = report.effective_rays if math.isfinite(report.effective_rays) else float(report.rays - report.unmet_rays)
    own = max(rays * fluxes[index] / field.total_flux, 1.0)
    fine = [len(f) for f in (part.space, part.direction) if f is not None]
    n1, n2, n3, n4 = part.ratio.shape
    cells = (fine[0], fine[1]) if len(fine) == 2 else (min(n1, n2), min(n3, n4))
    images = marginals(part, cells, chart.shape == "tube")
    # The square of all directions holds the π of all direction cosines; a step of these is a larger angle off the normal.
    u, v, radius = chart.beam
    square = math.degrees(radius * math.sqrt(math.pi / (1.0 - u * u - v * v)))
    sides = chart.sides, (square, square)

    def contrasts(pitch: float) -> tuple[float, float]:
        """Over place and over direction; both are tried at once."""
        stream = np.array([seed, PURPOSE + PITCHES.index(pitch)], dtype=np.uint64)
        generator = np.random.Generator(np.random.Philox(key=stream))
        pitches = [_along_sides(pitch, len(image), lengths) for image, lengths in zip(images, sides, strict=True)]
        waves = [_waves(len(image), both, symmetry != "none") for image, both in zip(images, pitches, strict=True)]
        true = [image * _spots(len(image), both) for image, both in zip(images, waves, strict=True)]
        drawn = (generator.poisson(own * t / t.sum()).astype(np.float64) for t in true)
        space, direction = (Sums(sum_of_images(cells, symmetry), None) for cells in drawn)
        if not (space.rays and direction.rays):
            return 0.0, 0.0
        counts = PartCounts(space, space, direction)
        found = images_of(counts, chart.whole, threads, symmetry, POSITIONS).densities()
        over_place, over_direction = (_contrast(f, t, both) for f, t, both in zip(found, true, waves, strict=True))
        return over_place, over_direction

    known: dict[float, tuple[float, float]] = {}

    def of(which: int) -> Callable[[float], float]:
        def contrast(pitch: float) -> float:
            if pitch not in known:
                known[pitch] = contrasts(pitch)
            return known[pitch][which]

        return contrast

    place, direction = (_half_contrast(of(which), cells[which]) for which in (0, 1))
    return Resolution(
        part=chart.name,
        place=place * max(chart.sides) / cells[0],
        direction=direction * square / cells[1],
        cell_place=max(chart.sides[0] / n1, chart.sides[1] / n2),
        cell_direction=square / min(n3, n4),
        place_limit="cells" if place <= PITCHES[1] else "rays",
        direction_limit="cells" if direction <= PITCHES[1] else "rays",
    )


def _along_sides(pitch: float, n: int, lengths: tuple[float, float]) -> Pitches:
    """The pitch in cells along either side of n × n: as many millimetres are more cells along the shorter one."""
    one, other = (pitch * (max(lengths) / length) for length in lengths)
    most = max(pitch, n // 2)
    return one if one <= most else None, other if other <= most else None


def _waves(n: int, pitches: Pitches, even: bool) -> Waves:
    """The mean of a cosine over each of n cells along either side: 1 in the middle if it is even about that."""

    def wave(pitch: float) -> FloatArray:
        first = np.pi * (1 - n) / pitch if even else PHASE
        cells: FloatArray = np.sinc(1.0 / pitch) * np.cos(2.0 * np.pi * np.arange(n) / pitch + first)
        return cells

    along, across = (None if pitch is None else Wave(pitch, wave(pitch)) for pitch in pitches)
    return along, across


def _spots(n: int, waves: Waves) -> FloatArray:
    """An array of spots on n × n cells: mean 1, darkest 0."""
    along, across = (np.ones(n) if wave is None else 1.0 + wave.cells for wave in waves)
    return along[:, None] * across[None, :]


def _contrast(found: FloatArray, true: FloatArray, waves: Waves) -> float:
    """What is left of the cosines along both axes where the image is shown, linear between centres; the worse counts."""
    shown = node_values(found)
    left = []
    for axes, wave in zip(((1, 0), (0, 1)), waves, strict=True):
        if wave is not None:
            signal = float((true.transpose(axes) @ wave.cells).sum() / true.sum())
            kept = float((shown.transpose(axes) @ wave.cells).sum() / shown.sum()) / signal
            # Cells hold sinc(1/p) of the amplitude, and a linear interpolation takes sinc²(1/p) of what its nodes have.
            left.append(kept * float(np.sinc(1.0 / wave.pitch)) ** 3)
    return min(left)


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
