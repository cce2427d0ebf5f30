"""Tables of type A and type B goniophotometers in C-γ: type A exactly, type B resampled with a stated error.

ANSI/IES LM-63-02, section 3: the planes of type A share the vertical axis, those of type B a horizontal one; horizontal
angles run clockwise seen from above. The direction H = 0, V = 0 is photometric horizontal (C = 0, γ = 90) for type A and
photometric zero (γ = 0) for type B. With x towards C = 0, y towards C = 90 and z along γ = 0, that is

    type A: (cos V cos H, -cos V sin H, -sin V), hence C = -H and γ = 90 + V
    type B: (cos H sin V, -sin H, cos H cos V)

Either is a table in spherical coordinates: of type A about z, of type B about y, with V as the angle around that axis.
"""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np

from etendue.errors import ArgumentError
from etendue.formats.intensity.symmetry import RAMP, Array
from etendue.quantities.intensity import Intensity

Kind = Literal["A", "B"]

LARGEST_DIFFERENCE = 0.005
"""Of the maximum: the resampled table is made finer until it differs by no more, or has `MOST_NODES`."""

FLUX_DIFFERENCE = 1e-3
"""Share of the flux by which a resampled table may differ at most, if `MOST_NODES` allow it."""

MOST_NODES = 1 << 19
MOST_PLANES = 1440
MOST_GAMMAS = 1440
MOST_LOOKS = 1 << 10
"""Angles of a file, along either of its axes, at which differences are looked for."""


@dataclasses.dataclass(frozen=True)
class Converted:
    """A table in C-γ, and what the conversion did.

    Parameters
    ----------
    c, gamma : array
        [°]
    values : array, shape (n_c, n_gamma)
    notes : tuple of str
        Where the luminaire points, what was not measured, and the resampling error.
    assumed : tuple of str
        What the table does not say itself: symmetries.
    """

    c: Array
    gamma: Array
    values: Array
    notes: tuple[str, ...]
    assumed: tuple[str, ...]


def in_c_gamma(kind: Kind, horizontal: Array, vertical: Array, values: Array, unit: str) -> Converted:
    """The function that a type A or type B table stands for, in C-γ.

    That function is bilinear in (H, V) between the nodes and 0 outside them. Angles that begin at 0° belong to a
    symmetric table, of which the other half is the mirror image: LM-63 knows tables from -90° and from 0° only.

    Parameters
    ----------
    kind : {"A", "B"}
        Of the goniophotometer.
    horizontal : array, shape (n_h,)
        [°] rising, at least two; type A -180 to 180, type B -90 to 90.
    vertical : array, shape (n_v,)
        [°] rising, at least two; type A -90 to 90, type B -180 to 180.
    values : array, shape (n_h, n_v)
        [`unit`]
    unit : str
        Of the values, for the notes.

    Raises
    ------
    ArgumentError
        If there are too few angles, or they leave their range.
    """
    horizontal, values, first = _both_sides("horizontal", horizontal, values, 180.0 if kind == "A" else 90.0)
    vertical, transposed, second = _both_sides("vertical", vertical, values.T, 90.0 if kind == "A" else 180.0)
    values = transposed.T
    if kind == "A":
        table = _about_axis(-horizontal[::-1], 90.0 + vertical, values[::-1])
        notes = [
            "type A: its direction H = 0, V = 0 is C = 0, γ = 90°; C = -H and γ = 90° + V, so nothing was resampled"
        ]
    else:
        native = _about_axis(vertical, 90.0 + horizontal, values.T)
        table, told = _resampled(native, horizontal, vertical, unit)
        notes = [
            "type B: its direction H = 0, V = 0 is γ = 0; positive H is towards C = 270°, positive V towards C = 0",
            told,
        ]
    unseen = _unmeasured(kind, horizontal, vertical)
    return Converted(table.c, table.gamma, table.values, (*notes, *unseen), (*first, *second))


def _both_sides(name: str, angles: Array, values: Array, most: float) -> tuple[Array, Array, tuple[str, ...]]:
    """The whole table, from one that may begin at 0° because it is symmetric about it; one row of values for each angle."""
    if angles.size < 2:
        raise ArgumentError(f"there is one {name} angle, {angles[0]:g}°; no symmetry makes a distribution of it")
    if angles[0] < -most or angles[-1] > most:
        raise ArgumentError(f"{name} angles run from {angles[0]:g}° to {angles[-1]:g}°, beyond -{most:g}° to {most:g}°")
    if angles[0] != 0.0:
        return angles, values, ()
    told = f"{name} angles begin at 0°: taken as symmetric, with the mirror image on the other side"
    return np.concatenate([-angles[:0:-1], angles]), np.concatenate([values[:0:-1], values]), (told,)


def _unmeasured(kind: Kind, horizontal: Array, vertical: Array) -> tuple[str, ...]:
    around, along = (horizontal, vertical) if kind == "A" else (vertical, horizontal)
    if around[-1] - around[0] >= 360.0 and along[0] == -90.0 and along[-1] == 90.0:
        return ()
    ranges = f"H from {horizontal[0]:g}° to {horizontal[-1]:g}° and V from {vertical[0]:g}° to {vertical[-1]:g}°"
    return (f"only {ranges} were measured; what goes elsewhere is unknown and was taken as 0",)


def _about_axis(around: Array, along: Array, values: Array) -> Intensity:
    """A table over the angle around an axis and the angle from it, 0 where it has no planes."""
    span = around[-1] - around[0]
    if span >= 360.0:
        return _sorted(around[:-1], along, values[:-1])
    if 360.0 - span <= 2.0 * RAMP:
        return _sorted(around, along, values)
    edges = np.concatenate([[around[0] - RAMP], around, [around[-1] + RAMP]])
    return _sorted(edges, along, np.pad(values, ((1, 1), (0, 0))))


def _sorted(around: Array, along: Array, values: Array) -> Intensity:
    turned = np.mod(around, 360.0)
    turned[turned == 360.0] = 0.0  # the remainder of -1e-20 is rounded up to the divisor
    order = np.argsort(turned)
    return Intensity(turned[order], along, values[order])


def _native_values(native: Intensity, c: Array, gamma: Array) -> Array:
    """A type B table, kept about y with V counted from z towards x, in directions (C, γ)."""
    c, gamma = np.broadcast_arrays(np.radians(c), np.radians(gamma))
    x, y, z = np.sin(gamma) * np.cos(c), np.sin(gamma) * np.sin(c), np.cos(gamma)
    # Whole degrees must hit the nodes at the ends of the table, and not fall outside them by a rounding error.
    around = np.round(np.degrees(np.arctan2(x, z)), 9)
    along = np.round(np.degrees(np.arctan2(np.hypot(z, x), y)), 9)
    return native.at(around, along)


def _resampled(native: Intensity, horizontal: Array, vertical: Array, unit: str) -> tuple[Intensity, str]:
    """The C-γ table of a type B one, as fine as its own steps ask for, and the error of that in words."""
    gamma, planes = _first_grid(horizontal, vertical)
    maximum = max(float(np.abs(native.values).max()), np.finfo(np.float64).tiny)
    while True:
        c: Array = np.arange(planes, dtype=np.float64) * (360.0 / planes)
        table = Intensity(c, gamma, _native_values(native, c[:, None], gamma))
        inside, edge = _largest_differences(native, table, horizontal, vertical)
        flux_error = abs(table.flux - native.flux)
        good = inside <= LARGEST_DIFFERENCE * maximum and flux_error <= FLUX_DIFFERENCE * abs(native.flux)
        finer = np.unique(np.concatenate([gamma, (gamma[1:] + gamma[:-1]) / 2.0]))
        more = min(2 * planes, MOST_PLANES)
        if good or finer.size * more > MOST_NODES:
            break
        gamma, planes = finer, more
    told = (
        f"resampled from {horizontal.size} by {vertical.size} to {planes} planes by {gamma.size} angles γ: largest "
        f"difference from the bilinear function of the file {inside:.3g} {unit} ({100.0 * inside / maximum:.2g} % of the "
        f"maximum); flux {table.flux:.6g} for {native.flux:.6g} ({_percent(table.flux, native.flux)})"
    )
    if edge > max(inside, LARGEST_DIFFERENCE * maximum):
        told += f"; at the edge of what was measured the step to 0 became a slope, {edge:.3g} {unit} off at most"
    return table, told


def _largest_differences(
    native: Intensity, table: Intensity, horizontal: Array, vertical: Array
) -> tuple[float, float]:
    """Largest difference of two functions within what was measured, and in cells of the table across its edge.

    Looked for where either function has its kinks and halfway between them: at the nodes of the file and the middles of
    its cells, at the middles of the table's cells and of their sides.
    """
    h, v = _with_middles(horizontal), _with_middles(vertical)
    # On the axis of type B itself V has no meaning.
    h = np.radians(h[np.abs(h) < 90.0 - RAMP])[:, None]
    x, y, z = np.cos(h) * np.sin(np.radians(v)), -np.sin(h) + 0.0 * v, np.cos(h) * np.cos(np.radians(v))
    c = np.mod(np.degrees(np.arctan2(y, x)), 360.0).ravel()
    gamma = np.degrees(np.arctan2(np.hypot(x, y), z)).ravel()
    halfway: Array = (table.gamma[1:] + table.gamma[:-1]) / 2.0
    between = table.c + 180.0 / table.c.size
    for around, along in ((between, halfway), (between, table.gamma), (table.c, halfway)):
        c = np.append(c, np.repeat(around, along.size))
        gamma = np.append(gamma, np.tile(along, around.size))
    everywhere = _about_axis(vertical, 90.0 + horizontal, np.ones((vertical.size, horizontal.size)))
    measured = _native_values(everywhere, table.c[:, None], table.gamma) > 0.5
    following = np.roll(measured, -1, axis=0)
    corners = np.stack([measured[:, :-1], measured[:, 1:], following[:, :-1], following[:, 1:]])
    across = corners.any(axis=0) != corners.all(axis=0)
    # The edge is a curve here and may cut off a piece of a cell between its corners: the neighbours belong to it too.
    across |= np.roll(across, 1, axis=0) | np.roll(across, -1, axis=0)
    across[:, 1:] |= across[:, :-1].copy()
    across[:, :-1] |= across[:, 1:].copy()
    plane = np.minimum((c / 360.0 * table.c.size).astype(np.intp), table.c.size - 1)
    row = (np.searchsorted(table.gamma, gamma, side="right") - 1).clip(0, table.gamma.size - 2)
    at_edge = across[plane, row] | (gamma > table.gamma[-1])
    difference = np.abs(_native_values(native, c, gamma) - table.at(c, gamma))
    return float(difference[~at_edge].max(initial=0.0)), float(difference[at_edge].max(initial=0.0))


def _with_middles(angles: Array) -> Array:
    """Nodes and the middles between them; of very fine tables only some."""
    every = np.sort(np.append(angles, (angles[1:] + angles[:-1]) / 2.0))
    return every[:: -(-every.size // (2 * MOST_LOOKS))]


def _percent(found: float, expected: float) -> str:
    return f"{100.0 * (found / expected - 1.0):+.2g} %" if expected else "none"


def _first_grid(horizontal: Array, vertical: Array) -> tuple[Array, int]:
    """Angles γ that meet every node of the planes H = 0 and V = 0, and planes no further apart than these angles."""
    widest = np.radians([np.abs(horizontal).max(), np.abs(vertical).max()])
    # The largest γ of a rectangle in (H, V) is at a corner, where cos γ = cos H cos V, or on the axis behind it.
    corner = float(np.degrees(np.arccos(np.clip(np.cos(widest[0]) * np.cos(widest[1]), -1.0, 1.0))))
    end = max(corner, float(np.degrees(widest.max())), 90.0 if widest.max() >= np.pi / 2.0 else 0.0)
    nodes = np.abs(np.concatenate([[0.0], horizontal, vertical]))
    gamma = np.unique(np.round(np.append(nodes[nodes < end], end), 9))
    if gamma.size > MOST_GAMMAS:
        gamma = np.linspace(0.0, end, MOST_GAMMAS)
    steps = np.radians(np.diff(gamma))
    farthest = np.sin(np.minimum(np.radians(gamma[1:]), np.pi / 2.0))
    planes = 4 * int(np.ceil(np.pi / 2.0 * float(np.max(farthest / steps))))
    return gamma, max(min(planes, MOST_PLANES, MOST_NODES // gamma.size), 24)
