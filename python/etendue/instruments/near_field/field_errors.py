"""Errors of readings of a light field, which rests on the same rays at all positions, and of their integral."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from etendue.instruments.near_field.positions import ArmPositions
from etendue.lightfield.etendue_density import EtendueDensity
from etendue.lightfield.redrawn import rays_worth, redrawn_parts

Array = npt.NDArray[np.float64]

FIELDS = 12
"""Fields of rays drawn anew: what varies between them is known to a fifth."""

FEWEST, MOST = 24, 64
"""Points along each coordinate of a part over which the intensity of a direction is summed: too few tell places apart that
light from all others makes up for."""

POINTS = 10**9
"""Of all fields, parts and directions together, unless that would be too few of each: some ten seconds."""


def field_errors(
    field: EtendueDensity, stops: ArmPositions, light: Array, light_error: Array, seed: int, threads: int | None
) -> tuple[Array, float]:
    """Standard errors of readings of a field, and of their integral over the sphere.

    Pixels, and positions, that see the same cells err together; the intensities of fields of rays drawn anew tell by how
    much. The error of a reading is the larger of its spread between these few fields and of its error by independent pixels
    times the one factor that all readings have together. On top comes what the flux of all rays varies by, √(1/n − 1/N) for
    N rays that are worth n equal ones: that of N rays drawn independently.

    Parameters
    ----------
    field : EtendueDensity
        The lamp.
    stops : ArmPositions
        Where the readings were taken.
    light, light_error : array, shape (n,)
        Readings, and their errors as if all pixels were independent.
    seed : int
        Of the fields.
    threads : int, optional
        All cores if None.

    Returns
    -------
    tuple of array, shape (n,), and float
        In the unit of the readings, and in that times sr.

    Examples
    --------
    >>> import etendue as et
    >>> field = et.LightField.fit(et.RingSource(rays=5000), et.Disk(radius=30), depths=(2, 2, 2, 2))
    >>> stops = ArmPositions(30, 60)
    >>> light = field.core.intensity(stops.directions, 24)
    >>> errors, whole = field_errors(field, stops, light, 0.001 * light, 1, None)
    >>> bool((errors > 0.001 * light)[:3].all()), bool(0.0 < whole / (stops.weight @ light) < 0.05)
    (True, True)
    """
    side = math.isqrt(POINTS // (FIELDS * len(stops) * len(field.parts)))
    side = min(max(side, FEWEST), MOST)
    found = np.array([
        field.replace(parts=parts).core.intensity(stops.directions, side, threads)
        for parts in redrawn_parts(field, FIELDS, seed, threads)
    ])  # fmt: skip
    whole, known = float(stops.weight @ found.mean(axis=0)), float(stops.weight @ light)
    if not whole > 0.0:
        return light_error, float(np.linalg.norm(stops.weight * light_error))
    # Readings are intensities over the square of the distance, which is the ratio of both integrals.
    found *= known / whole
    spread, independent = found.std(axis=0, ddof=1), float(np.linalg.norm(stops.weight * light_error))
    factor = float(np.linalg.norm(stops.weight * spread)) / independent if independent > 0.0 else 1.0
    shared = math.sqrt(max(1.0 / max(rays_worth(field), 1.0) - 1.0 / max(field.report.rays, 1), 0.0))
    own = np.maximum(spread, factor * light_error)
    return np.hypot(own, shared * light), math.hypot(float((found @ stops.weight).std(ddof=1)), shared * known)
