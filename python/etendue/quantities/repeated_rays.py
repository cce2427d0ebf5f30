"""Rays that a set holds more than once, so that they are not independent of each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.quantities.ray_stream import BATCH, RayStream
from etendue.quantities.report import Complaint

if TYPE_CHECKING:
    from collections.abc import Sequence

FloatArray = npt.NDArray[np.float64]
Keys = npt.NDArray[np.uint64]

KEPT = 1 << 20
"""Rays that are compared: those whose key is a multiple of a number, so that copies are kept together or not at all."""

STRETCHES = 64
"""Of larger sets than so many batches, as many are read, evenly spread; of a set merged with itself each with its copy."""

GLANCE = 1 << 18
"""Rays, some of all parts of a set, that tell whether it is worth comparing more."""

HINT = 16
"""Rays of a glance that repeat another one, from which on it is."""

FEWEST, SHARE = 100, 0.01
"""Repeated rays, and their share, that are worth a word: text of few digits makes some by chance."""

TAKEN = (
    "light fields, maps by the cone, tables of intensity and traces of rays without colours take copies for one ray, all "
    "else takes each for a ray of its own, with errors that are too small; give each ray once, with the sum of the flux"
)
"""What becomes of copies."""


def keys_of(position: FloatArray, direction: FloatArray) -> Keys:
    """A key of each ray's place and direction, to single precision: that of copies is the same, that of others is not.

    Of 10^8 rays with different places, two have the same key by chance once in 4000 sets.

    Examples
    --------
    >>> place = np.array([[0.0, 1, 2], [0, 1, 2], [0, 1, 3]])
    >>> key = keys_of(place, np.tile([0.0, -0.0, 1], (3, 1)))
    >>> bool(key[0] == key[1]), bool(key[0] == key[2])
    (True, False)
    """
    return _core.ray_keys(np.asarray(position, np.float64), np.asarray(direction, np.float64))


def glanced_at(rays: int) -> list[tuple[int, int]]:
    """Ranges (start, stop) of a large set among which copies show: its ends, and a piece in every stretch as long as these.

    An end that stands anywhere else once more lies over such a piece there.

    Examples
    --------
    >>> ranges = glanced_at(10_000_000)
    >>> ranges[0], ranges[-1], len(ranges), sum(stop - start for start, stop in ranges) <= GLANCE
    ((0, 65536), (9934464, 10000000), 153, True)
    """
    end = GLANCE // 4
    starts = range(end, rays - end, end)
    piece = max(2 * end // max(len(starts), 1), 4 * HINT)
    pieces = [(start, min(start + piece, rays - end)) for start in starts]
    return [(0, end), *pieces, (rays - end, rays)]


class Repeats(NamedTuple):
    """Of rays that were compared: how many, how many of them repeat another one, and what that is worth.

    Parameters
    ----------
    rays, repeated : int
    excess : float
        Σ w² with the copies of a ray taken together, over that of all rays apart: by which variances are too small that
        take each for a ray of its own.

    Examples
    --------
    >>> Repeats(10_000, 50).told, Repeats(10_000, 5000).told
    (None, '50.00% of the rays repeat another one, with its place and direction')
    """

    rays: int
    repeated: int
    excess: float = 1.0

    @classmethod
    def of(cls, rays: RayStream, stretch: int = BATCH) -> Repeats:
        """Of a set with positions, in one pass over its rays; of a large one, over few of them unless these show copies.

        Parameters
        ----------
        rays : RayStream
            The set.
        stretch : int
            Of sets with more than `STRETCHES` times so many rays, so many are read at a time.

        Examples
        --------
        >>> import etendue as et
        >>> once = et.RaySet(np.eye(300)[:, :3] + np.arange(300)[:, None], np.tile([0.0, 0, 1], (300, 1)), np.ones(300))
        >>> Repeats.of(once), Repeats.of(et.RaySet.merge([once, once]))
        (Repeats(rays=300, repeated=0, excess=1.0), Repeats(rays=600, repeated=300, excess=2.0))
        """
        n, looked = len(rays), min(len(rays), STRETCHES * stretch)
        if n > 2 * GLANCE:
            found = cls._among(rays, glanced_at(n), 1)
            if found.repeated < HINT:
                return found
        starts = range(0, n, stretch) if looked == n else [i * n // STRETCHES for i in range(STRETCHES)]
        return cls._among(rays, [(start, min(start + stretch, n)) for start in starts], max(1, looked // KEPT))

    @classmethod
    def _among(cls, rays: RayStream, ranges: list[tuple[int, int]], every: int) -> Repeats:
        """Of those rays of some ranges whose key is a multiple of a number."""
        keys, flux = _core.kept_ray_keys(rays.core_source(), ranges, every)
        ordered = np.sort(keys)
        found = cls(keys.size, int(np.count_nonzero(ordered[1:] == ordered[:-1])))
        if found.repeated < FEWEST:
            return found
        # Over the largest, so that no square is lost.
        weight = flux / flux.max()
        together = np.bincount(np.unique(keys, return_inverse=True)[1], weight)
        return found._replace(excess=float((together**2).sum() / (weight**2).sum()))

    @property
    def told(self) -> str | None:
        """What is to be said of them; None if they are few, or if few are distinct: pencils, light of no width."""
        if self.repeated < FEWEST or self.repeated < SHARE * self.rays or self.rays - self.repeated < FEWEST:
            return None
        return f"{self.repeated / self.rays:.2%} of the rays repeat another one, with its place and direction"


class SharedRays:
    """Whether sets that are joined hold the same rays.

    Parameters
    ----------
    sizes : sequence of int
        Rays of each set.

    Examples
    --------
    >>> place, up = np.arange(600.0).reshape(200, 3), np.tile([0.0, 0, 1], (200, 1))
    >>> shared = SharedRays([200, 200])
    >>> for number in (0, 1):
    ...     shared.add(number, place, up)
    >>> shared.complaints(["first", "second"])[0].found[:57] + "…"
    'shares 100.00% of its rays with first: light fields, maps…'
    """

    def __init__(self, sizes: Sequence[int]) -> None:
        self._every = np.uint64(max(1, sum(sizes) // KEPT))
        self._keys: list[list[Keys]] = [[] for _ in sizes]

    def add(self, number: int, position: FloatArray, direction: FloatArray) -> None:
        """Take note of some rays of a set."""
        key = keys_of(position, direction)
        self._keys[number].append(key[key % self._every == 0])

    def complaints(self, names: Sequence[str]) -> list[Complaint]:
        """Of each set that shares many rays with one before it; `names` are those of the sets."""
        found: list[Complaint] = []
        before: list[Keys] = []
        for number, parts in enumerate(self._keys):
            keys = np.concatenate([np.zeros(0, dtype=np.uint64), *parts])
            for name, others in zip(names, before, strict=False):
                shared = int(np.isin(keys, others).sum())
                if shared >= FEWEST and shared >= SHARE * keys.size:
                    told = f"shares {shared / keys.size:.2%} of its rays with {name}: {TAKEN}"
                    found.append(Complaint("warning", f"{names[number]}, rays", told))
            before.append(keys)
        return found
