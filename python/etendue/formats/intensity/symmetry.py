"""Symmetric tables: from the planes that a file stores to the whole circle, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from etendue.quantities.intensity import Intensity, Symmetry

Array = npt.NDArray[np.float64]

SAME_PLANE = 1e-7
"""Degrees within which two planes are one: angles that were subtracted from 360."""

RAMP = 1e-3
"""Degrees over which a table falls to 0 where a format has to go on beyond it."""


def unfolded(c: Array, values: Array, symmetry: Symmetry) -> tuple[Array, Array]:
    """The planes of the whole circle, from those that a symmetric file stores.

    Parameters
    ----------
    c : array, shape (k,)
        [°] rising: one plane (rotational), 0 to 90 (both), 0 to 180 (C0-C180), 90 to 270 (C90-C270) or around.
    values : array, shape (k, n_gamma)
        Of these planes.
    symmetry : str
        Which one; see `Intensity.symmetry`.

    Returns
    -------
    c : array, shape (n_c,)
        [°] rising, 0 ≤ C < 360.
    values : array, shape (n_c, n_gamma)
    """
    if symmetry == "rotational":
        return np.zeros(1), values[:1]
    images = {"C0-C180": [c, -c], "C90-C270": [c, 180.0 - c], "both": [c, -c, 180.0 - c, 180.0 + c]}.get(symmetry, [c])
    angles = np.mod(np.concatenate(images), 360.0)
    # What is below 0 by less than the last digit of 360 becomes 360 itself.
    angles[angles == 360.0] = 0.0
    whole, first = np.unique(angles, return_index=True)
    return whole, np.concatenate([values] * len(images))[first]


def from_sector(c: Array, values: Array) -> tuple[Array, Array, Symmetry] | None:
    """The planes of the whole circle, from a sector whose ends tell the symmetry.

    Parameters
    ----------
    c : array, shape (k,)
        [°] rising.
    values : array, shape (k, n_gamma)
        Of these planes.

    Returns
    -------
    c, values : array
        As `unfolded`; of two planes 0° and 360° the first.
    symmetry : str
        What the sector stands for; None instead of all three if it is none of 0 to 0, 90, 180 or 360, and 90 to 270.
    """
    first, last = float(c[0]), float(c[-1])
    sectors: dict[tuple[float, float], Symmetry] = {
        (0.0, 90.0): "both",
        (0.0, 180.0): "C0-C180",
        (90.0, 270.0): "C90-C270",
    }
    if c.size == 1:
        return *unfolded(c, values, "rotational"), "rotational"
    if (first, last) in sectors:
        return *unfolded(c, values, sectors[first, last]), sectors[first, last]
    return (c[:-1], values[:-1], "none") if (first, last) == (0.0, 360.0) else None


def sum_of(parts: Sequence[Intensity]) -> Intensity:
    """The sum of several distributions in the same frame and unit: a table over the nodes of all of them.

    Where one of them ends and another goes on, its step to 0 becomes a ramp of `RAMP`.
    """
    ends = [g for part in parts for g in (part.gamma[0] - RAMP, part.gamma[-1] + RAMP)]
    gamma = np.unique(np.concatenate([part.gamma for part in parts] + [ends]))
    low, high = min(part.gamma[0] for part in parts), max(part.gamma[-1] for part in parts)
    gamma = gamma[(gamma >= low) & (gamma <= high)]
    c = np.unique(np.concatenate([part.c for part in parts]))
    values = np.sum([part.at(c[:, None], gamma) for part in parts], axis=0)
    return parts[0].replace(c=c, gamma=gamma, values=values, standard_error=np.full(values.shape, np.nan))


def folded(intensity: Intensity, symmetry: Symmetry) -> tuple[Array, Array]:
    """The planes that a symmetric file stores: those of the table, folded into the sector, and the sector's edges.

    Inverse of `unfolded` for a distribution of that symmetry. The function stays the same: an edge that is no plane of
    the table is interpolated, as the function is.
    """
    c = intensity.c
    edges = {"rotational": [0.0], "both": [0.0, 90.0], "C0-C180": [0.0, 180.0], "C90-C270": [90.0, 270.0]}
    if symmetry == "rotational":
        c = np.zeros(0)
    elif symmetry in ("C0-C180", "both"):
        c = np.where(c > 180.0, 360.0 - c, c)
        c = np.where(c > 90.0, 180.0 - c, c) if symmetry == "both" else c
    elif symmetry == "C90-C270":
        c = np.where(c < 90.0, 180.0 - c, np.where(c > 270.0, 540.0 - c, c))
    # The edges come first, so that of two planes that are one by rounding they stay.
    nodes = np.concatenate([edges.get(symmetry, [0.0]), c])
    nodes = nodes[np.argsort(nodes, kind="stable")]
    kept: list[float] = []
    for angle in nodes.tolist():
        if not kept or angle - kept[-1] > SAME_PLANE:
            kept.append(angle)
        elif angle in edges.get(symmetry, ()):
            kept[-1] = angle
    if symmetry == "none" and 360.0 - kept[-1] <= SAME_PLANE:
        kept.pop()
    return np.array(kept), intensity.planes(kept)


def whole_hemispheres(intensity: Intensity) -> tuple[Intensity, tuple[str, ...]]:
    """The table continued with zeros, so that γ begins at 0° or 90° and ends at 90° or 180°, as both formats demand.

    Returns
    -------
    intensity : Intensity
    notes : tuple of str
        Whether that changed the function: a step at the end of the table becomes a steep ramp.
    """
    gamma, values = intensity.gamma, intensity.values
    ends = []
    if gamma[0] not in (0.0, 90.0):
        start = 0.0 if gamma[0] < 90.0 else 90.0
        before = np.unique([start, max(start, gamma[0] - RAMP)])
        gamma, values = np.concatenate([before, gamma]), np.pad(values, ((0, 0), (before.size, 0)))
        ends += [(before.size, before[-1])]
    if gamma[-1] not in (90.0, 180.0):
        stop = 90.0 if gamma[-1] < 90.0 else 180.0
        after = np.unique([min(stop, gamma[-1] + RAMP), stop])
        gamma, values = np.concatenate([gamma, after]), np.pad(values, ((0, 0), (0, after.size)))
        ends += [(-after.size - 1, after[0])]
    if not ends:
        return intensity, ()
    steps = [gamma[row] for row, _ in ends if values[:, row].any()]
    notes = tuple(f"the step to 0 at γ = {step:g}° became a ramp of at most {RAMP:g}°" for step in steps)
    error = np.full(values.shape, np.nan)
    return intensity.replace(gamma=gamma, values=values, standard_error=error), notes
