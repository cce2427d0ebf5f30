"""The far field of a light field: its integral over the surface, at nodes that suit its beams."""

from __future__ import annotations

import math

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.etendue_density import EtendueDensity
from etendue.lightfield.field_rays import FieldRays
from etendue.lightfield.symmetry import order
from etendue.quantities.intensity import Intensity
from etendue.quantities.intensity_nodes import Array, Nodes, check_steps, planes_of
from etendue.quantities.node_choice import choose_nodes
from etendue.quantities.ray_stream import checked_threads
from etendue.units import INTENSITY_UNIT

SAMPLE = 1 << 17
"""Rays drawn from the field that nodes are chosen from, at most."""

FEWEST = 20_000

SIDE = 24
"""Points along each coordinate of a part over which the intensity of a direction is summed."""

WIDEST = 2.5
"""[°] Widest interval of γ that has two directions of its own."""

PLANES = 24
"""Intervals of C around the axis that have two directions each, at least."""

LEAST_LOST = 0.03
"""Share of a peak below which what it lacks is not told."""

MOST = 13_000_000
"""Nodes that may be asked for, those of `PLANES` planes at least: each direction is an integral over the surface."""

LOST = 0.9
"""A beam that fills k cells of the field's directions was found to have a peak that is too low by some `LOST`/k of it."""


def field_intensity(
    field: EtendueDensity, c_planes: int | None, gamma_step: float | None, threads: int | None
) -> Intensity:
    """As `etendue.LightField.intensity`.

    Examples
    --------
    >>> import etendue as et
    >>> field = et.LightField.fit(et.RingSource(rays=50_000), et.Disk(radius=30), depths=(3, 3, 3, 3))
    >>> field_intensity(field, 4, 30.0, None).values.shape
    (4, 7)
    """
    check_steps(c_planes, gamma_step)
    asked = max(c_planes or 1, PLANES) * round(180.0 / (gamma_step or 90.0))
    if asked > MOST:
        raise ArgumentError(
            f"c_planes is {c_planes} and gamma_step {gamma_step}°, {asked:,} nodes; of a light field {MOST:,} can be had: "
            "give fewer c_planes or a larger gamma_step."
        )
    rests = field.report.effective_rays
    known = math.isfinite(rests) and rests > 0.0
    rays = (rests if known else field.report.rays) * order(field.report.symmetry)
    drawn = next(FieldRays(field, round(min(SAMPLE, max(FEWEST, rays)))).batches())
    nodes, told = choose_nodes(drawn.direction, drawn.flux, rays, c_planes, gamma_step)
    direction, weight = directions(nodes)
    found = weight * field.core.intensity(direction, SIDE, checked_threads(threads))
    # What the sum over directions misses is known: the integral of the field is a closed form.
    total = float(found.sum())
    found *= field.total_flux / total if total > 0.0 else 0.0
    flux, _ = _shared(nodes, direction, found)
    # Of n rays with the flux Φ, Σ (φ Φ/n)² is Φ/n ∫ φ² I dΩ.
    _, squares = _shared(nodes, direction, np.sqrt(found))
    error = np.sqrt(squares * field.total_flux / rays)
    error[flux == 0.0] = np.nan
    result = nodes.intensity(
        flux,
        error,
        field.flux_unit,
        field.provenance.then(f"intensity [{INTENSITY_UNIT[field.flux_unit]}] of the light field"),
    )
    broadened = _broadened(field, result)
    counted = f"{rests:,.0f} equal rays" if known else f"{field.report.rays:,} rays, taken as equal ones,"
    how = f"standard errors are those of counting the {counted} that the field rests on, node by node"
    # What is to be said of a beam without width is said of one that is as wide as a cell of the field.
    notes = (*(broadened or told), f"{nodes.describe()}; {how}: the field smooths, and is mostly better")
    luminaire = {} if field.spectrum is None else {"spectrum": field.spectrum}
    return result.replace(smooth=True, luminaire=luminaire, notes=(*notes, *result.notes, *field.notes))


def directions(nodes: Nodes) -> tuple[Array, Array]:
    """Directions with their solid angles [sr] for integrals over the sphere: exact for what is cubic between nodes.

    Gauss's two points in every interval of γ and C, of which wide ones are divided.

    Examples
    --------
    >>> d, weight = directions(Nodes.even(4, 45))
    >>> d.shape[1], bool(np.isclose(weight.sum(), 4 * np.pi)), bool(np.isclose(weight @ d[:, 2] ** 2, 4 * np.pi / 3))
    (3, True, True)
    """
    found, weights = [], []
    for low, high, *rows in zip(nodes.gamma[:-1], nodes.gamma[1:], nodes.c[:-1], nodes.c[1:], strict=True):
        gamma, along = _gauss(np.linspace(low, high, math.ceil((high - low) / WIDEST) + 1))
        c, around = _gauss(np.array(sorted({*planes_of(PLANES), *rows[0], *rows[1], 360.0})))
        sin, cos = np.sin(gamma)[:, None], np.cos(gamma)[:, None]
        found.append(np.stack(np.broadcast_arrays(sin * np.cos(c), sin * np.sin(c), cos), axis=-1).reshape(-1, 3))
        weights.append((along[:, None] * sin * around).ravel())
    weight = np.concatenate(weights)
    # The sine is no polynomial: the sphere is whole.
    return np.concatenate(found), weight * (4.0 * np.pi / weight.sum())


def _gauss(edges: Array) -> tuple[Array, Array]:
    """Two points in each interval between angles [°], and their weights [rad]."""
    edges = np.radians(edges)
    half, middle = np.diff(edges)[:, None] / 2.0, (edges[1:] + edges[:-1])[:, None] / 2.0
    offset = np.array([-1.0, 1.0]) / math.sqrt(3.0)
    return (middle + half * offset).ravel(), np.repeat(half, 2)


def _shared(nodes: Nodes, direction: Array, flux: Array) -> tuple[Array, Array]:
    """Σ w and Σ w² of the shares of each node, and of all together."""
    sums, squares = np.zeros(len(nodes)), np.zeros(len(nodes))
    nodes.core().add(direction, flux, sums, squares, np.zeros(len(nodes), dtype=np.uint64))
    return sums, squares


def _broadened(field: EtendueDensity, found: Intensity) -> list[str]:
    """What is to be said of a beam that is hardly wider than the field's own cells of direction."""
    finest, cells = min(
        (math.pi * chart.beam[2] ** 2 / n, n)
        for chart, part in zip(field.surface.parts(), field.parts, strict=True)
        for n in [max(part.ratio.shape[2] * part.ratio.shape[3], 0 if part.direction is None else part.direction.size)]
    )
    if not found.maximum > 0.0:
        return []
    beam = field.total_flux / found.maximum
    filled = beam / finest
    if LOST / filled * found.maximum < max(found.peak_error, LEAST_LOST * found.maximum):
        return []
    told = f"the beam fills no more than {max(filled, 1.0):.2g} of the light field's {cells:,} cells of direction"
    return [f"{told}, which broaden it: the peak is too low by more than its error; take it from the rays themselves"]
