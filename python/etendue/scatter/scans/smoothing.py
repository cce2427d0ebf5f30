"""Values that were measured here and there, smoothed about the specular direction."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.scatter.scans import harvey_shack

Array = npt.NDArray[np.float64]

TESTED = 500
"""Values that `smooth` finds its width by."""

SMALLEST = 1e-3
"""The smallest |β − β₀| that the logarithmic distance resolves, as that of the grid."""


def require_light(values: Array) -> None:
    """Refuse values of which no logarithm can be taken.

    Raises
    ------
    ArgumentError
        If no value is above 0.

    Examples
    --------
    >>> require_light(np.array([0.0, 0.1]))
    """
    if not (values > 0.0).any():
        raise ArgumentError("no value is above 0, and this method takes logarithms")


def smooth(incident: Array, measured: Array, values: Array, wanted: Array) -> tuple[Array, Array]:
    """Local lines through ln f over the logarithmic distance from the specular direction, with errors.

    The width along the distance is that which predicts each value best from all others; along the azimuth it bridges the
    largest gap between the scans. The standard error is that by which the others miss a value, averaged in the same way: of
    the shape between the scans, and of the noise of one value, which is more than that of their mean.

    Logarithms of noisy values are too low on average, and zeros have none. So what is found is multiplied by the mean of the
    measured values over the mean of what is found where they were measured, with the same weights: not by the mean of their
    ratios, which has no bound where values are decades above what is found.

    So values below 0, as noise about a dark level has them, count in that mean, and f is below 0 where it is. Of logarithms
    what lies below that noise has no meaning, and counts as large as it.

    Parameters
    ----------
    incident : array, shape (3,)
        Unit vector to where the light comes from.
    measured, wanted : array, shape (n, 3), (m, 3)
        Unit vectors of the measured and of the wanted directions.
    values : array, shape (n,)
        Measured f [1/sr].

    Returns
    -------
    array, array
        f and its standard error at the wanted directions [1/sr], shape (m,).

    Raises
    ------
    ArgumentError
        If no value is above 0, or they are too few.

    Examples
    --------
    >>> angle = np.radians(np.arange(-80.0, 81.0, 5.0))
    >>> to = np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    >>> f, _ = smooth(np.array([0.0, 0.0, 1.0]), to, np.tile([0.3, -0.1], 17)[:33], to[:2])
    >>> bool((np.abs(f - 0.1) < 0.05).all())
    True
    """
    require_light(values)
    least = max(0.5 * float(values[values > 0.0].min()), _noise(values), 1e-300)
    logs = np.log(np.maximum(values, least))
    planes = [harvey_shack.coordinates(incident, one) for one in (measured, wanted)]
    scale = max(float(np.quantile(planes[0][0][planes[0][0] > 0.0], 0.25)), SMALLEST)
    (x, a), (at_x, at_a) = ((np.arcsinh(r / scale), azimuth) for r, azimuth in planes)
    steps = np.sort(a[planes[0][0] > scale])
    gap = float(np.diff(np.append(steps, steps[0] + 360.0)).max()) if steps.size > 1 else 360.0
    turn = max(0.5 * gap, 5.0)

    def weights(at_x: Array, at_a: Array, width: float) -> Array:
        # Azimuths mean the less, the closer to the specular direction.
        part = -np.expm1(-0.5 * (at_x[:, None] * x) / (0.25 * width + 1e-12))
        log = -0.5 * ((at_x[:, None] - x) / width) ** 2
        log -= 0.5 * (part * ((at_a[:, None] - a + 180.0) % 360.0 - 180.0) / turn) ** 2
        return np.asarray(log)

    def line(log: Array, at_x: Array, width: float) -> tuple[Array, Array]:
        w = np.exp(log - log.max(axis=1, keepdims=True))
        w /= w.sum(axis=1, keepdims=True)
        mean = w @ x
        spread = w @ (x * x) - mean**2 + (0.05 * width) ** 2
        slope = ((w * (x - mean[:, None])) @ logs) / spread
        return w @ logs + slope * (at_x - mean), w

    def missed_by_others(chosen: npt.NDArray[np.intp], width: float) -> Array | None:
        """What the others miss of some of the values; None if one has no others near it."""
        log = weights(x[chosen], a[chosen], width)
        log[np.arange(chosen.size), chosen] = -np.inf
        if not np.isfinite(log.max(axis=1)).all():
            return None
        return np.asarray(logs[chosen] - line(log, x[chosen], width)[0])

    every = np.arange(x.size)
    tested = every[:: math.ceil(x.size / TESTED)]
    best = None
    for width in np.geomspace(0.03, 1.5, 14):
        trial = missed_by_others(tested, float(width))
        score = math.inf if trial is None else float(np.mean(trial**2))
        if math.isfinite(score) and (best is None or score < best[0]):
            best = (score, float(width))
    missed = None if best is None else missed_by_others(every, best[1])
    if best is None or missed is None:
        raise ArgumentError("too few values to smooth")
    width = best[1]
    there, own = line(weights(x, a, width), x, width)
    smoothed = np.exp(np.minimum(there, logs.max()))
    found, w = line(weights(at_x, at_a, width), at_x, width)
    f = np.exp(np.minimum(found, logs.max()))
    scaled = f * (w @ values) / (w @ smoothed)
    if not (values < 0.0).any():
        return scaled, f * np.sqrt(w @ missed**2)
    # Misses of logarithms say nothing of values below 0.
    off = values - smoothed * (own @ values) / (own @ smoothed)
    return scaled, np.maximum(f * np.sqrt(w @ missed**2), np.sqrt(w @ off**2))


def _noise(values: Array) -> float:
    """Of values about a dark level: as far below 0 as half of those that are below it; 0 if none is."""
    below = values[values < 0.0]
    return float(np.median(-below)) if below.size else 0.0
