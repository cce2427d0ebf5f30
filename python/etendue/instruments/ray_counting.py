"""Rays that are counted in the aperture of a goniometer."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.instruments.beam_and_aperture import axes_of, into_the_sample
from etendue.instruments.bench import Bench
from etendue.quantities.arguments import as_whole
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.ray_stream import checked_seed
from etendue.scatter.bsdf import Bsdf

Array = npt.NDArray[np.float64]

MOST_RAYS = (1 << 40) - 1
"""That may be drawn: days of work."""

BLOCK = 1 << 20
"""Rays that are traced together; what a scan takes of memory does not grow with its rays."""


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


def counted_flux(
    bench: Bench,
    bsdf: Bsdf | None,
    arms: Array,
    rays: int,
    seed: int,
    *,
    theta: float,
    wavelength: float,
    behind: bool,
    fresh: bool = False,
) -> tuple[Array, Array]:
    """Share of the rays of a beam that get into the aperture at each position, and its standard error; shapes (k,).

    Parameters
    ----------
    bench : Bench
        Beam, aperture and distance.
    bsdf : Bsdf, optional
        Of the sample; None: there is none.
    arms : array, shape (k, 3)
        Positions.
    rays, seed : int
        How many, and their seed.
    theta, wavelength : number
        Angle of incidence [°], and in nm.
    behind : bool
        Whether rays are counted that go to the other side.
    fresh : bool
        Rays of its own for each position, instead of the same for all.

    Raises
    ------
    ArgumentError
        If the number of rays or the seed is no whole number, or out of its range.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer, up = et.ScatterGoniometer(), np.array([[0.0, 0.0, 1.0]])
    >>> paint = et.bsdf.Lambertian(reflectance=1.0)
    >>> share, error = counted_flux(
    ...     goniometer.bench, paint, up, 200_000, 1, theta=0.0, wavelength=550.0, behind=False
    ... )
    >>> bool(abs(share[0] - goniometer.solid_angle / np.pi) < 4 * error[0])
    True
    """
    rays, seed = as_whole(rays, "rays", 1, MOST_RAYS), checked_seed(seed)

    def leaving(n: int, number: tuple[int, ...]) -> tuple[Array, Array]:
        """Where rays leave the sample [mm] and to where, shape (n, 3) each; NaN where they are absorbed."""
        rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((*number, 0))))
        points = bench.beam.points(rng, n)
        start, v = into_the_sample(points, bench.beam.tilts(points, rng), theta, across=bsdf is None)
        if bsdf is None:
            return start, v
        own = int(np.random.SeedSequence((*number, 1)).generate_state(1, np.uint64)[0])
        incident = direction(theta, 180.0) if bench.beam.collimated else -v
        return start, bsdf.sample(incident, n, seed=own, wavelength=wavelength)

    hits = np.zeros(len(arms))
    for block, first in enumerate(range(0, rays, BLOCK)):
        n = min(BLOCK, rays - first)
        if fresh:
            for k in range(len(arms)):
                hits[k : k + 1] += ray_hits(bench, *leaving(n, (seed, block, k + 1)), arms[k : k + 1], behind=behind)
        else:
            hits += ray_hits(bench, *leaving(n, (seed, block, 0)), arms, behind=behind)
    share = hits / rays
    # Where no ray came, as if one had: the error of nothing is not nothing.
    return share, np.sqrt(np.maximum(share, 1.0 / rays) * (1.0 - share) / rays)
