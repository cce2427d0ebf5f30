"""Maps of a source made of patches: what a reverse ray tracer shows of them, without its noise."""

from __future__ import annotations

import math
import operator

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.memory import require_memory
from etendue.quantities.observer import Observer, Screen

MOST_SAMPLES = 4096
PIXEL_BYTES = 60
"""Of a pixel in memory while a map is made."""
"""Lines of sight per pixel."""


def gridded_luminance_map(source: GriddedSource, observer: Observer, screen: Screen, samples: int = 16) -> LuminanceMap:
    """What an observer sees of patches: the mean of their luminance over each pixel.

    Parameters
    ----------
    source : GriddedSource
        Patches with their tables. The map shows the light of the source, which has the flux of its rays; that of
        ``source.as_printed`` shows the tables alone, as chapter 3 of the thesis does.
    observer : Observer
        Whose lines of sight are followed back to the patches.
    screen : Screen
        The pixels.
    samples : int
        Lines of sight per pixel, on a square grid: rounded to a square number.

    Returns
    -------
    LuminanceMap
        [cd/m²], or W/(m² sr) for patches in watts. Tables do not know their error, so that it is unknown everywhere. The
        notes tell the factor over the tables.

    Raises
    ------
    ArgumentError
        If `samples` is out of range, or the screen has no apparent area.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.carrier import Disk
    >>> rings = et.RingSource(rays=400_000, seed=2)
    >>> grid = GriddedSource.fit(rings, Disk(radius=30), pixel=2, threshold=5)
    >>> lmap = gridded_luminance_map(grid, et.Observer(40, 0, 1000), et.Screen(8, 8, 1, 1))
    >>> bool(abs(lmap.values[0, 0] / rings.luminance(0, 0) - 1) < 0.1)
    True
    """
    samples = operator.index(samples)
    if not 1 <= samples <= MOST_SAMPLES:
        raise ArgumentError(f"samples is {samples}; give 1 to {MOST_SAMPLES} lines of sight per pixel.")
    size = f"a map of {screen.columns} x {screen.rows} pixels"
    require_memory(PIXEL_BYTES * screen.columns * screen.rows, f"{source.patches.provenance.source}: {size}")
    fine = max(1, round(math.sqrt(samples)))
    right, up, _ = screen.axes(observer)
    viewpoint, target = observer.position, np.asarray(observer.target)
    within = (np.arange(fine) + 0.5) / fine - 0.5
    x = (screen.x[:, None] + within * (screen.width / screen.columns)).ravel()
    values = np.zeros(screen.shape)
    for row, middle in enumerate(screen.y):
        y = middle + within * (screen.height / screen.rows)
        points = target + (y[:, None, None] * up + x[:, None] * right).reshape(-1, 3)
        seen = source.luminance(points, viewpoint - points)
        values[row] = seen.reshape(fine, screen.columns, fine).mean(axis=(0, 2))
    return LuminanceMap(
        values=values,
        standard_error=np.full(screen.shape, np.nan),
        rays=np.full(screen.shape, -1),
        observer=observer,
        screen=screen,
        flux_unit=source.flux_unit,
        provenance=source.patches.provenance.then(
            f"luminance of {len(source.patches)} patches, {fine**2} points per pixel"
        ),
        notes=source.notes,
    )
