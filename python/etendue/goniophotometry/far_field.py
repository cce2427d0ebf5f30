"""From rays to their far-field intensity."""

from __future__ import annotations

import numpy as np

from etendue.lightfield.light_field import LightField
from etendue.quantities.arguments import require, require_callable
from etendue.quantities.distinct_rays import DistinctRays
from etendue.quantities.intensity import Intensity
from etendue.quantities.node_choice import Choice, choose_nodes
from etendue.quantities.ray_stream import Progress, RayStream, flux_power

SAMPLE = 1 << 18
"""Rays that nodes are chosen from, at least if there are so many: every third of three times as many …"""

FEW = 20_000
"""Up to so many rays, all of them choose the nodes; of more at most every second one, so that nodes depend less on the rays
that they are filled with."""


def intensity_distribution(
    rays: RayStream | LightField,
    c_planes: int | None = None,
    gamma_step: float | None = None,
    *,
    progress: Progress | None = None,
) -> Intensity:
    """Far-field intensity of rays, from their directions alone.

    The table stands for the function that is linear in C and γ between its nodes. Every ray is shared by the nodes around
    its direction as a reader shares it, and the intensity of a node is the sum of its shares over the solid angle of its
    hat function: a mean around the node. So the integral of the function is the flux of the rays exactly, for any steps.
    Where rays start has no influence, so that far-field sets will do.

    Parameters
    ----------
    rays : RayStream or LightField
        A ray set, or a source that draws its rays on demand; they are read in batches. The intensity of a light field is
        that of `LightField.intensity`.
    c_planes : int, optional
        Half planes C, from 0° in equal steps. C is the azimuth from +X towards +Y; 1 means the mean over all of them.
        None: chosen from the rays, for each γ.
    gamma_step : float, optional
        [°], a whole part of 180. γ is the angle from +Z. None: chosen from the rays, narrow in beams and wide where the
        light is even. The table then states its function in between as well, every 2.5° or closer.
    progress : callable, optional
        Called with the number of rays done.

    Returns
    -------
    Intensity
        [cd] for rays in lm, [W/sr] for rays in W. Its `standard_error` is √(Σ (w φ)²) over the solid angle, with the share
        φ of the node in a ray of flux w, but no less than that of as many rays of the flux that rays around have, and one
        more (`etendue.quantities.few_rays`); NaN for a node that no ray reached, whose intensity is 0. With chosen steps of
        γ, it holds what the mean is off from the intensity at the node, where the light shows it
        (`etendue.quantities.node_blur`), and is the value at least of a node beside dark ones, where light ends.
        `flux_error` is √(Σ w²).
        ``luminaire["spectrum"]`` is that of all rays together, if they have one, whatever their directions.
        Copies of a ray, which have its place and direction, are one ray with the flux of all. The notes tell of them, and
        if the steps cannot hold a beam.

    Raises
    ------
    ArgumentError
        If there are no such planes or steps, or `rays` are none.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RingSource(rays=1_000_000, seed=1)             # Lambertian: I = Φ/π · cos γ
    >>> led = et.intensity_distribution(rays)
    >>> bool(abs(led.at(30, 60) * np.pi / rays.total_flux - 0.5) < 0.01), led.unit, round(led.flux / rays.total_flux, 9)
    (True, 'cd', 1.0)
    """
    require_callable(progress)
    if isinstance(rays, LightField):
        return rays.intensity(c_planes, gamma_step)
    require(rays, RayStream, "intensity_distribution: rays", "rays, of a file et.read_rays(path), or a LightField")
    distinct = DistinctRays.of(rays)
    (nodes, told), power = _nodes(distinct.rays, c_planes, gamma_step)
    core = nodes.core()
    sums, squares, count = np.zeros(len(nodes)), np.zeros(len(nodes)), np.zeros(len(nodes), dtype=np.uint64)
    for batch in distinct.rays.batches():
        core.add(batch.direction, batch.flux / power, sums, squares, count)
        if progress is not None:
            progress(batch.start + batch.usable.size)
    error = np.where(count > 0, np.sqrt(squares * distinct.excess), np.nan)
    usable = int(count[-1])
    unusable = distinct.unusable + len(distinct.rays) - usable
    left_out = f", {unusable:,} others cannot be used" if unusable else ""
    notes = [*told, f"{nodes.describe()}; from the directions of {usable:,} rays{left_out}", *distinct.notes]
    asked = c_planes is not None and gamma_step is not None
    step = "far-field intensity, " + ("steps as asked" if asked else "steps chosen from the rays")
    result = nodes.intensity(sums, error, rays.flux_unit, rays.provenance.then(step))
    spectrum = rays.total_spectrum()
    return result.replace(
        values=result.values * power,
        standard_error=result.standard_error * power,
        flux_error=result.flux_error * power,
        luminaire={} if spectrum is None else {"spectrum": spectrum},
        notes=(*notes, *result.notes, *_notes(result), *rays.notes),
    )


def _nodes(rays: RayStream, c_planes: int | None, gamma_step: float | None) -> tuple[Choice, float]:
    """Nodes chosen from evenly spread rays, and the power of two that their flux is summed over."""
    every = max(2 if len(rays) > FEW else 1, len(rays) // SAMPLE)
    parts = [
        (batch.direction[-batch.start % every :: every], batch.flux[-batch.start % every :: every])
        for batch in rays.batches()
    ]
    direction = np.concatenate([np.zeros((0, 3)), *(part[0] for part in parts)])
    flux = np.concatenate([np.zeros(0), *(part[1] for part in parts)])
    return choose_nodes(direction, flux, len(rays), c_planes, gamma_step), flux_power(flux)


def _notes(result: Intensity) -> list[str]:
    notes = []
    known = np.isfinite(result.standard_error) & (result.values > 0.0)
    if known.any():
        share = result.standard_error[known] / result.values[known]
        notes.append(f"median relative standard error {np.median(share):.2%} of the nodes that rays reached")
    empty = int(np.isnan(result.standard_error).sum())
    if empty:
        notes.append(f"{empty:,} of {result.values.size:,} nodes saw no ray: their intensity is 0, its error unknown")
    return notes
