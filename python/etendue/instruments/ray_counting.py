"""Rays that are counted in the aperture of a goniometer."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.instruments.beam_and_aperture import axes_of
from etendue.instruments.bench import Bench

Array = npt.NDArray[np.float64]


def ray_hits(bench: Bench, start: Array, to: Array, arms: Array, *, behind: bool) -> Array:
    """How many rays get into the aperture at each position.

    Parameters
    ----------
    bench : Bench
        Aperture and distance.
    start, to : array, shape (n, 3)
        Where rays leave the sample [mm], and to where; NaN where they are absorbed.
    arms : array, shape (k, 3)
        Positions.
    behind : bool
        Whether rays are counted that go to the other side.

    Returns
    -------
    array, shape (k,)

    Examples
    --------
    >>> from etendue.instruments.beam_and_aperture import Aperture, Beam
    >>> bench = Bench(Beam(2.0), Aperture("disk", 10.0), 100.0)
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> ray_hits(bench, np.zeros((1, 3)), up, up, behind=False).tolist()
    [1.0]
    """
    aperture = bench.aperture
    leaving = to[:, 2] < 0.0 if behind else to[:, 2] > 0.0
    farthest = float(np.sqrt(np.max(np.einsum("ij,ij->i", start, start), initial=0.0)))
    # Two unit vectors differ by less than this if the one leads from the spot into the aperture at the other.
    bound = 1.01 * (aperture.reach + farthest) / (bench.distance - farthest)
    # Along the widest spread of the positions, rays are put in order: each position looks at a stretch of them.
    spread = np.ptp(arms, axis=0) if len(arms) > 1 else np.ones(3)
    first = int(np.argmax(spread))
    low, high = arms.min(axis=0) - bound, arms.max(axis=0) + bound
    near = leaving
    for k in range(3):
        near = near & (to[:, k] >= low[k]) & (to[:, k] <= high[k])
    chosen = np.flatnonzero(near)
    if len(arms) > 1:
        chosen = chosen[np.argsort(to[chosen, first], kind="stable")]
    s, p = to[chosen].T.copy(), start[chosen].T.copy()
    found = np.zeros(len(arms))
    ends = (np.searchsorted(s[first], arms[:, first] + shift) for shift in (-bound, bound))
    for k, (i, j) in enumerate(zip(*ends, strict=True)):
        if j <= i:
            continue
        d, (t1, t2) = arms[k], axes_of(arms[k])
        sx, sy, sz, px, py, pz = (*s[:, i:j], *p[:, i:j])
        along = (bench.distance - (px * d[0] + py * d[1] + pz * d[2])) / (sx * d[0] + sy * d[1] + sz * d[2])
        x, y, z = px + along * sx, py + along * sy, pz + along * sz
        u, w = x * t1[0] + y * t1[1] + z * t1[2], x * t2[0] + y * t2[1] + z * t2[2]
        found[k] = np.count_nonzero(aperture.holds(u, w) & (along > 0.0))
    return found
