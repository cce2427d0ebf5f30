"""Slices of any layout on the grid that the core takes: polar about the specular direction, in direction cosines."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.bsdf_data import BsdfSlice, PolarGrid

Array = npt.NDArray[np.float64]

AZIMUTHS = 72
"""Of the grid, unless a slice has more."""

SMALLEST = 1e-4
"""Smallest distance from the specular direction in direction cosines that the grid resolves (0.006°)."""

ACCURACY = 2e-3
"""To which f is linear between radial coordinates, relative to f; and to 1e-3 of this of the largest f."""

CANDIDATES = 400
"""Radial coordinates that the grid is chosen from."""


@dataclasses.dataclass(frozen=True, eq=False)
class Lobe:
    """What the core takes of a slice.

    Parameters
    ----------
    sine : float
        Of the angle of incidence.
    radial : array, shape (n,)
        |β − β₀|, from 0.
    f : array, shape (m, n)
        Without the floor [1/sr], at m azimuths evenly from the direction of β₀.
    share, floor : float
        Of the flux: in the lobe, and Lambertian.
    """

    sine: float
    radial: Array
    f: Array
    share: float
    floor: float

    def record(self) -> dict[str, object]:
        """As the core takes it."""
        return {"sine": self.sine, "radial": self.radial, "f": self.f, "share": self.share, "floor": self.floor}


def lobes_of(slices: Sequence[BsdfSlice], shares: Sequence[float], *, mirrored: bool) -> list[Lobe]:
    """Slices of rising incidence on the grid of the core.

    Beyond the rim of the hemisphere, where a slice holds nothing and the lobe of a neighbouring incidence may reach, f goes
    on in proportion to that of the slice before; that of the first is held constant. Single points stand for what is nearest
    to them.

    Parameters
    ----------
    slices : sequence of BsdfSlice
        Of one azimuth of incidence, one way and one wavelength, each at another angle.
    shares : sequence of float
        Of the flux that each scatters; f is scaled by the core so that this is its integral.
    mirrored : bool
        Whether both sides of the plane of incidence are made equal.

    Raises
    ------
    ArgumentError
        If a slice holds no values.
    """
    radial = _candidates(slices)
    azimuths = max(AZIMUTHS, *(_azimuths(one) for one in slices))
    polar = PolarGrid("cosines", radial, np.arange(azimuths) * (360.0 / azimuths))
    lobes = []
    before: Array | None = None
    for one, share in zip(slices, shares, strict=True):
        if np.isnan(one.values).all():
            raise ArgumentError("a slice holds no values")
        f = _values(one, polar.directions(one.incident, transmitted=one.transmitted))
        if mirrored:
            f = 0.5 * (f + f[(-np.arange(azimuths)) % azimuths])
        floor = float(np.nanmin(f))
        before = _continued(f, before)
        lambertian = min(np.pi * floor, share)
        raised = np.maximum(before - floor, 0.0)
        chosen = _chosen(radial, raised)
        sine = float(np.hypot(one.incident[0], one.incident[1]))
        lobes.append(
            Lobe(
                sine,
                radial[chosen],
                np.ascontiguousarray(raised[:, chosen]),
                max(share - lambertian, 0.0),
                lambertian,
            )
        )
    return lobes


def _azimuths(one: BsdfSlice) -> int:
    finest = one.grid.azimuth.size if one.grid is not None else 0
    return finest if finest >= 360 else 2 * finest


def _candidates(slices: Sequence[BsdfSlice]) -> Array:
    spread = [[0.0], np.geomspace(SMALLEST, 2.0, CANDIDATES)]
    spread += [one.grid.radial for one in slices if one.grid is not None and one.grid.frame == "cosines"]
    found = np.unique(np.concatenate(spread))
    return found[found <= 2.0]


def _values(one: BsdfSlice, directions: Array) -> Array:
    """At directions of shape (m, n, 3); NaN where they are none."""
    there = ~np.isnan(directions[..., 0])
    found = np.full(there.shape, np.nan)
    found[there] = one.at(directions[there]) if one.grid is not None else _nearest(one, directions[there])
    return found


def _nearest(one: BsdfSlice, directions: Array) -> Array:
    """Values of the points that are nearest in the plane of direction cosines."""
    known = ~np.isnan(one.values)
    points, values = one.directions[known, :2], one.values[known]
    found = np.zeros(len(directions))
    step = max(1, (1 << 22) // len(points))
    for start in range(0, len(directions), step):
        off = directions[start : start + step, None, :2] - points
        found[start : start + step] = values[np.argmin(np.einsum("ijk,ijk->ij", off, off), axis=1)]
    return found


def _continued(f: Array, before: Array | None) -> Array:
    """Missing values along each azimuth in proportion to those of the slice before, or the last one there is."""
    # At grazing incidence the hemisphere may end before the first step: the specular direction itself is common to all.
    centre = f[:, 0][~np.isnan(f[:, 0])]
    f = f.copy()
    f[:, 0] = np.where(np.isnan(f[:, 0]), centre.mean() if centre.size else np.nanmean(f), f[:, 0])
    missing = np.isnan(f)
    last = np.maximum.accumulate(np.where(missing, 0, np.arange(f.shape[1])), axis=1)
    held = np.take_along_axis(f, last, axis=1)
    if before is None:
        return np.asarray(held)
    there = np.take_along_axis(before, last, axis=1)
    ratio = np.divide(before, there, out=np.ones_like(before), where=missing & (there > 0.0))
    return np.asarray(held * ratio)


def _chosen(radial: Array, f: Array) -> npt.NDArray[np.intp]:
    """Radial coordinates between which f is nearly linear: halved from the ends where it is not."""
    allowed = ACCURACY * (f + 1e-3 * f.max())
    kept = {0, len(radial) - 1}
    open_ = [(0, len(radial) - 1)]
    while open_:
        i, j = open_.pop()
        if j - i < 2:
            continue
        u = (radial[i + 1 : j] - radial[i]) / (radial[j] - radial[i])
        line = f[:, i : i + 1] * (1.0 - u) + f[:, j : j + 1] * u
        off = np.abs(f[:, i + 1 : j] - line) / np.maximum(allowed[:, i + 1 : j], np.finfo(np.float64).tiny)
        worst = off.max(axis=0)
        k = i + 1 + int(np.argmax(worst))
        if worst[k - i - 1] > 1.0:
            kept.add(k)
            open_ += [(i, k), (k, j)]
    return np.array(sorted(kept))
