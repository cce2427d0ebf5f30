"""From rays to their far-field intensity."""

from __future__ import annotations

import numpy as np

from etendue.quantities.intensity import Intensity
from etendue.quantities.intensity_cells import Cells
from etendue.quantities.ray_stream import Progress, RayStream


def intensity_distribution(
    rays: RayStream, c_planes: int = 36, gamma_step: float = 2.5, *, progress: Progress | None = None
) -> Intensity:
    """Far-field intensity of rays, from their directions alone.

    Every ray counts for the cell of the table whose node it is nearest to, and the intensity of a node is the flux of its
    cell over the exact solid angle of the cell: a mean over the cell, whose centre is the node (a node at γ = 0° or 180°
    is the centre of a cap that all planes share). Where rays start has no influence, so that far-field sets will do.

    Parameters
    ----------
    rays : RayStream
        A ray set, or a source that draws its rays on demand; they are read in batches.
    c_planes : int
        Half planes C, from 0° in equal steps. C is the azimuth from +X towards +Y; 1 means the mean over all of them.
    gamma_step : float
        [°], a whole part of 180. γ is the angle from +Z.
    progress : callable, optional
        Called with the number of rays done.

    Returns
    -------
    Intensity
        [cd] for rays in lm, [W/sr] for rays in W. Its `standard_error` is √(Σ w²) over the solid angle, NaN for a cell
        that no ray reached, whose intensity is 0. The flux of all cells is that of the rays; the bilinear function
        between their means has a slightly different integral, and the notes state both.

    Raises
    ------
    ArgumentError
        If there are no such planes or steps.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RingSource(rays=1_000_000, seed=1)             # Lambertian: I = Φ/π · cos γ
    >>> led = et.intensity_distribution(rays, c_planes=1, gamma_step=5)
    >>> round(float(led.at(30, 60)) * np.pi / rays.total_flux, 2), led.unit
    (0.5, 'cd')
    """
    cells = Cells(c_planes, gamma_step)
    shape = (cells.c.size, cells.gamma.size)
    flux, squares = np.zeros(shape[0] * shape[1]), np.zeros(shape[0] * shape[1])
    usable = 0
    for batch in rays.batches():
        index = cells.index(batch.direction)
        flux += np.bincount(index, batch.flux, flux.size)
        squares += np.bincount(index, batch.flux * batch.flux, flux.size)
        usable += batch.flux.size
        if progress is not None:
            progress(batch.start + batch.usable.size)
    total = float(flux.sum())
    values = flux.reshape(shape) / cells.solid_angle
    error = np.sqrt(squares).reshape(shape) / cells.solid_angle
    error[error == 0.0] = np.nan
    for table in (values, error):
        table[:, [0, -1]] = table[0, [0, -1]]
    result = Intensity(
        cells.c,
        cells.gamma,
        values,
        error,
        flux_unit=rays.flux_unit,
        provenance=rays.provenance.then(f"far-field intensity in {shape[0]} planes, γ in steps of {gamma_step:.9g}°"),
    )
    return result.replace(notes=(*_notes(result, total, len(rays), usable), *rays.notes))


def _notes(result: Intensity, total: float, rays: int, usable: int) -> list[str]:
    unit = result.flux_unit
    left_out = f", {rays - usable:,} others cannot be used" if usable < rays else ""
    notes = [f"mean over the cell around each node, from the directions of {usable:,} rays{left_out}"]
    if total > 0.0:
        deviation = f"{result.flux / total - 1.0:+.3%}".replace("-", "−")
        found = f"the function of the table has {result.flux:.7g} {unit} ({deviation})"
        notes.append(f"the cells hold {total:.7g} {unit}, {found}")
    known = np.isfinite(result.standard_error)
    if known.any():
        share = result.standard_error[known] / result.values[known]
        notes.append(f"median relative standard error {np.median(share):.2%} of the cells that rays reached")
    empty = int((~known).sum())
    if empty:
        notes.append(f"{empty:,} of {known.size:,} nodes saw no ray: their intensity is 0, its error unknown")
    return notes
