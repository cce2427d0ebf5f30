"""Slices of any layout on the grid that the core takes: polar about the specular direction, in direction cosines."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.bsdf_directions import NORMAL
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.scatter.bases import Base, even_out, share_in

Array = npt.NDArray[np.float64]

AZIMUTHS = 72
"""Of the grid, unless a slice has more."""

SMALLEST = 1e-4
"""Smallest distance from the specular direction in direction cosines that the grid resolves (0.006°)."""

ACCURACY = 2e-3
"""To which f is linear between radial coordinates, relative to f; and to 1e-3 of this of the largest f."""

CANDIDATES = 400
"""Radial coordinates that the grid is chosen from."""

FEW = 80
"""The same for slices of single points, none of which is closer to another than some hundredths."""

AT_ONCE = 1 << 16
"""Pairs of a direction and a point that are compared together: they stay in the processor's cache."""

RIM = 1.0 - 1e-9
"""Sine of an incidence beyond which there is none."""

STEPS_TO_THE_RIM = 12
"""Incidences beyond the last, if components leave more of one than of another."""

EVEN = 1e-9
"""Shares that differ by less are the same: rounding of the core."""


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
        Without the base [1/sr], at m azimuths evenly from the direction of β₀.
    share, base : float
        Of the flux: in the lobe, and in the base.
    """

    sine: float
    radial: Array
    f: Array
    share: float
    base: float

    def record(self) -> dict[str, object]:
        """As the core takes it."""
        return {"sine": self.sine, "radial": self.radial, "f": self.f, "share": self.share, "base": self.base}


def _all(theta: Array) -> Array:
    return np.ones(len(theta))


@dataclasses.dataclass(frozen=True)
class Rest:
    """What is left of the light for one way of scattering it.

    Parameters
    ----------
    left : callable
        What components leave, by angle of incidence [°].
    most : float
        Share of this that may be scattered.
    part : float
        Beyond the last incidence, of what would be scattered there: between the angles at which it is known a smooth curve
        may rise above what is left.
    """

    left: Callable[[Array], Array] = _all
    most: float = 1.0
    part: float = 1.0


def lobes_of(
    slices: Sequence[BsdfSlice],
    shares: Sequence[float],
    *,
    isotropic: bool,
    mirrored: bool,
    base: Base | None = None,
    rest: Rest | None = None,
) -> dict[float, list[Lobe]]:
    """Slices of one way and one wavelength on the grid of the core: by azimuth of incidence [°], of rising incidence.

    Beyond the rim of the hemisphere, where a slice holds nothing and the lobe of a neighbouring incidence may reach, f goes
    on in proportion to that of the slice before; that of the first to its mean over azimuths. Single points stand for what
    is nearest to them. If incidences are not known at the same azimuths, f is interpolated between azimuths, turned with
    them.

    Below the first incidence its lobe keeps its share; of an isotropic sample it becomes the mean over azimuths at the
    normal. Beyond the last the lobe stays as it is, and its share of what components leave goes on as it does there, by no
    more than between the last two incidences; that of transmitted light does not rise, as grazing light enters nothing.

    Light along the normal comes from no azimuth. Unless the sample is isotropic, f stays where it is in the frame of the
    sample: there is a row at azimuth 0, from which the core takes such light to come, and if no slice is known there, the
    mean of those of the least incidence stands for it. Of several the first counts.

    Parameters
    ----------
    slices : sequence of BsdfSlice
        In any order.
    shares : sequence of float
        Of the flux that each scatters; f is scaled by the core so that this is its integral.
    isotropic : bool
        Whether the azimuth of incidence does not matter.
    mirrored : bool
        Whether both sides of the plane of incidence are made equal.
    base : Base, optional
        How light leaves that has forgotten where it came from; f of it is taken off the lobes. Lambertian, unless given.
    rest : Rest, optional
        What else takes of the light, if anything does.

    Raises
    ------
    ArgumentError
        If a slice holds no values.
    """
    for one in slices:
        if np.isnan(one.values).all():
            raise ArgumentError(f"the slice at {one.theta:g}° of incidence holds no values")
    radial = _candidates(slices)
    azimuths = max(AZIMUTHS, *(_azimuths(one) for one in slices))
    by_theta: dict[float, dict[float, tuple[BsdfSlice, float]]] = {}
    for one, share in zip(slices, shares, strict=True):
        phi = 0.0 if isotropic or one.theta < NORMAL else round(one.phi, 6) % 360.0
        by_theta.setdefault(round(one.theta, 6), {}).setdefault(phi, (one, share))
    oblique = [by_theta[theta] for theta in sorted(by_theta) if theta >= NORMAL]
    rows = _rows(oblique, isotropic=isotropic)
    unknown = not isotropic and bool(oblique) and min(by_theta) >= NORMAL
    normal = _mean(oblique[0], radial, azimuths) if unknown else None
    found: dict[float, list[Lobe]] = {}
    kept: dict[tuple[float, float], Array] = {}
    for row in rows:
        members: list[tuple[float, Array, float]] = []
        if normal is not None:
            members.append((0.0, np.where(radial <= 1.0, _swung(normal[0], row), np.nan), normal[1]))
        for theta in sorted(by_theta):
            known = by_theta[theta]
            f, share, sine = np.zeros((azimuths, radial.size)), 0.0, 0.0
            for phi, part in [(row, 1.0)] if theta < NORMAL else _around(sorted(known), row):
                one, own = known[0.0] if theta < NORMAL else known[phi]
                if (theta, phi) not in kept:
                    turned = _plane(one, oblique) if isotropic else phi
                    kept[theta, phi] = _values(one, _directions(one, radial, azimuths, turned))
                f, share = f + part * kept[theta, phi], share + part * own
                sine = math.sin(math.radians(one.theta))
            if mirrored:
                f = 0.5 * (f + f[(-np.arange(azimuths)) % azimuths])
            members.append((sine, f, share))
        lobes = _lobes(members, radial, base or Base())
        # Below the first incidence no more is scattered than there, though less of the lobe is cut by the horizon.
        first = [] if lobes[0].sine == 0.0 else [_at_the_normal(lobes[0], isotropic=isotropic)]
        found[row] = [*first, *lobes, *_to_the_rim(lobes, rest or Rest(), may_rise=not slices[0].transmitted)]
    return found


def _lobes(members: Sequence[tuple[float, Array, float]], radial: Array, base: Base) -> list[Lobe]:
    """Of rising sines of incidence, f that is NaN beyond the hemisphere, and shares."""
    found = []
    before: Array | None = None
    leaving = [base.at(_cosines(sine, radial, len(f))) for sine, f, _ in members]
    parts = even_out([share_in(f, there, share) for (_, f, share), there in zip(members, leaving, strict=True)])
    for (sine, f, share), there, part in zip(members, leaving, parts, strict=True):
        below = part / np.pi * there
        before = _continued(np.maximum(f - below, 0.0), before, part / np.pi)
        chosen = _chosen(radial, before, before + below)
        lobe = np.ascontiguousarray(before[:, chosen])
        found.append(Lobe(sine, radial[chosen], lobe, share - part, part))
    return found


def _cosines(sine: float, radial: Array, azimuths: int) -> Array:
    """Of the angle from the normal at places about β₀; 0 beyond the hemisphere."""
    along = np.cos(np.arange(azimuths) * (2.0 * np.pi / azimuths))[:, None]
    return np.asarray(np.sqrt(np.maximum(1.0 - sine**2 - radial * (radial + 2.0 * sine * along), 0.0)))


def _at_the_normal(first: Lobe, *, isotropic: bool) -> Lobe:
    """What stands for light along the normal where it is not known. That of an isotropic sample knows no azimuth."""
    f = np.broadcast_to(first.f.mean(axis=0), first.f.shape) if isotropic else first.f
    return dataclasses.replace(first, sine=0.0, f=np.ascontiguousarray(f))


def _to_the_rim(lobes: Sequence[Lobe], rest: Rest, *, may_rise: bool) -> list[Lobe]:
    """What stands for light beyond the last incidence: the last lobe.

    Its share of what components leave goes on straight, over the square of the sine, as a parabola through the last three
    leaves the last, if that is the way from the one before, and by no more than between these two. There are steps if what
    components leave is not always the same.
    """
    last = lobes[-1]
    if last.sine > RIM:
        return []
    thetas = np.linspace(np.degrees(np.arcsin(last.sine)), 90.0, STEPS_TO_THE_RIM + 1)
    known = np.degrees(np.arcsin([one.sine for one in lobes[-3:]]))
    left, left_there = rest.left(thetas), rest.left(known)
    if np.ptp(left) < EVEN:
        thetas, left = thetas[[0, -1]], left[[0, -1]]
    x = np.sin(np.radians(known)) ** 2
    y = np.array([one.share + one.base for one in lobes[-3:]]) / np.maximum(left_there, np.finfo(np.float64).tiny)
    beyond = np.sin(np.radians(thetas[1:])) ** 2 - x[-1]
    change = np.zeros(len(beyond))
    if len(x) > 1:
        slopes = np.diff(y) / np.diff(x)
        steepness = slopes[-1]
        if len(x) > 2:
            steepness += (x[2] - x[1]) * (slopes[1] - slopes[0]) / (x[2] - x[0])
        step = y[-1] - y[-2]
        change = np.clip(steepness * beyond, min(step, 0.0), max(step, 0.0) if may_rise else 0.0)
    shares = np.clip(y[-1] + change, 0.0, max(rest.most, 0.0)) * left[1:] * rest.part
    # Without a lobe all of it is in the base.
    bases = (
        shares
        if last.share <= 0.0
        else np.minimum(last.base * left[1:] / max(left[0], np.finfo(np.float64).tiny), shares)
    )
    sines = np.append(np.sin(np.radians(thetas[1:-1])), 1.0)
    return [
        dataclasses.replace(last, sine=float(sine), share=float(share - base), base=float(base))
        for sine, share, base in zip(sines, shares, bases, strict=True)
    ]


TURN = 10.0
"""Between rows [°] where light was measured along the normal alone."""

Known = dict[float, tuple[BsdfSlice, float]]
"""Slices of one angle of incidence, with what they scatter of the flux, by azimuth [°]."""


def _rows(oblique: Sequence[Known], *, isotropic: bool) -> list[float]:
    """Azimuths of incidence [°]: all that are known where most are; and 0."""
    if not oblique:
        return [0.0] if isotropic else np.arange(0.0, 360.0, TURN).tolist()
    most = max(len(known) for known in oblique)
    rows = set(next(known for known in oblique if len(known) == most))
    return sorted(rows if isotropic else rows | {0.0})


def _plane(one: BsdfSlice, oblique: Sequence[Known]) -> float:
    """The azimuth [°] from which the light of a slice comes, if that of others does not matter.

    Along the normal a grid that counts from the plane of incidence knows its own. If directions stand for themselves, the
    plane is that of the other slices, whatever azimuth was written down.
    """
    itself = one.grid is None or one.grid.frame == "normal"
    if one.theta < NORMAL and itself and oblique:
        return next(iter(oblique[0].values()))[0].phi
    return one.phi


def _mean(known: Known, radial: Array, azimuths: int) -> tuple[Array, float]:
    """The mean of slices from several azimuths, moved to the normal: f from azimuth 180° of β − β₀ on, and the share."""
    moved = [_continued(_values(one, _directions(one, radial, azimuths, 0.0)), None) for one, _ in known.values()]
    return np.mean(moved, axis=0), float(np.mean([share for _, share in known.values()]))


def _swung(f: Array, row: float) -> Array:
    """What a row at another azimuth of incidence holds of f of light along the normal, from 180° on; linear in azimuth."""
    place = np.arange(len(f)) + row * len(f) / 360.0
    low = np.floor(place).astype(np.intp)
    part = (place - low)[:, None]
    return np.asarray((1.0 - part) * f[low % len(f)] + part * f[(low + 1) % len(f)])


def _around(known: list[float], wanted: float) -> list[tuple[float, float]]:
    """The azimuths on both sides of one, with their parts."""
    if wanted in known or len(known) == 1:
        return [(wanted if wanted in known else known[0], 1.0)]
    above = int(np.searchsorted(known, wanted))
    low, high = known[above - 1], known[above % len(known)]
    part = ((wanted - low) % 360.0) / ((high - low) % 360.0)
    return [(low, 1.0 - part), (high, part)]


def _directions(one: BsdfSlice, radial: Array, azimuths: int, phi: float) -> Array:
    """Scattered directions, shape (m, n, 3), about the specular direction of light from azimuth `phi`; NaN where none is."""
    turn = np.radians(phi + 180.0 + np.arange(azimuths) * (360.0 / azimuths))
    off = radial[None, :, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)[:, None, :]
    beta = off - one.incident[:2]
    square = 1.0 - np.einsum("ijk,ijk->ij", beta, beta)
    height = np.sqrt(np.where(square >= 0.0, square, np.nan)) * (1.0 if one.front != one.transmitted else -1.0)
    found = np.concatenate([beta, height[..., None]], axis=-1)
    found[np.isnan(height)] = np.nan
    return np.asarray(found)


def _azimuths(one: BsdfSlice) -> int:
    finest = one.grid.azimuth.size if one.grid is not None else 0
    return finest if finest >= 360 else 2 * finest


def _candidates(slices: Sequence[BsdfSlice]) -> Array:
    gridded = any(one.grid is not None for one in slices)
    spread: list[Array] = [
        np.zeros(1),
        np.geomspace(SMALLEST, 2.0, CANDIDATES) if gridded else np.geomspace(1e-2, 2.0, FEW),
    ]
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
    step = max(1, AT_ONCE // len(points))
    # |d − p|² is least where d·p − |p|²/2 is most.
    half = 0.5 * np.einsum("jk,jk->j", points, points)
    places, columns = np.ascontiguousarray(directions[:, :2]), np.ascontiguousarray(points.T)
    for start in range(0, len(directions), step):
        nearness = places[start : start + step] @ columns
        nearness -= half
        found[start : start + step] = values[np.argmax(nearness, axis=1)]
    return found


def _continued(f: Array, before: Array | None, level: float = 0.0) -> Array:
    """Missing values along each azimuth in proportion to those of the slice before, or to the mean of all azimuths.

    A base of about this level was taken off both, beside which what is left may be nothing. The mean falls away from the
    specular direction, or is held: what rises there is another lobe, as of light sent back. Nothing becomes more than what
    is known, however often f rises from slice to slice.
    """
    # At grazing incidence the hemisphere may end before the first step: the specular direction itself is common to all.
    centre = f[:, 0][~np.isnan(f[:, 0])]
    f = f.copy()
    f[:, 0] = np.where(np.isnan(f[:, 0]), centre.mean() if centre.size else np.nanmean(f), f[:, 0])
    missing = np.isnan(f)
    most = np.nanmax(f)
    last = np.maximum.accumulate(np.where(missing, 0, np.arange(f.shape[1])), axis=1)
    held = np.take_along_axis(f, last, axis=1)
    if before is None:
        known = ~missing
        mean = np.where(known, f, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        before = np.broadcast_to(np.minimum.accumulate(np.where(known.any(axis=0), mean, np.inf)), f.shape)
    there = np.take_along_axis(before, last, axis=1)
    ratio = np.divide(before + level, there + level, out=np.ones_like(before), where=missing & (there + level > 0.0))
    return np.asarray(np.where(missing, np.minimum(held * ratio, most), f))


def _chosen(radial: Array, f: Array, whole: Array) -> npt.NDArray[np.intp]:
    """Radial coordinates between which f is nearly linear beside the whole with the base: halved from the ends where not."""
    # By radial coordinate first, so that a stretch of them lies together in memory.
    f, whole = np.ascontiguousarray(f.T), np.ascontiguousarray(whole.T)
    allowed = np.maximum(ACCURACY * (whole + 1e-3 * whole.max()), np.finfo(np.float64).tiny)
    kept = {0, len(radial) - 1}
    open_ = [(0, len(radial) - 1)]
    while open_:
        i, j = open_.pop()
        if j - i < 2:
            continue
        u = ((radial[i + 1 : j] - radial[i]) / (radial[j] - radial[i]))[:, None]
        off = f[i] * (1.0 - u)
        off += f[j] * u
        np.subtract(f[i + 1 : j], off, out=off)
        np.abs(off, out=off)
        off /= allowed[i + 1 : j]
        worst = off.max(axis=1)
        k = i + 1 + int(np.argmax(worst))
        if worst[k - i - 1] > 1.0:
            kept.add(k)
            open_ += [(i, k), (k, j)]
    return np.array(sorted(kept))
