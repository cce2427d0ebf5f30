"""From rays to their far-field intensity."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.intensity import Intensity
from etendue.quantities.ray_stream import Progress, RayStream

Array = npt.NDArray[np.float64]

MOST_CELLS = 1 << 26
"""Cells of a table: half a gigabyte for each of its two sums."""


@dataclasses.dataclass(frozen=True)
class Cells:
    """The cells around the nodes of a C-γ table: what is nearer to a node, in C and in γ, than to any other.

    The nodes at γ = 0° and 180° have one cell each, a cap that all planes share; the cells together are the sphere.

    Parameters
    ----------
    c_planes : int
        Planes, from C = 0° in equal steps.
    gamma_step : float
        [°], a whole part of 180.

    Raises
    ------
    ArgumentError
        If there are no such planes or steps, or too many cells.

    Examples
    --------
    >>> cells = Cells(4, 45)
    >>> cells.c.tolist(), cells.gamma.tolist()
    ([0.0, 90.0, 180.0, 270.0], [0.0, 45.0, 90.0, 135.0, 180.0])
    >>> bool(np.isclose(4 * cells.solid_angle[1:-1].sum() + cells.solid_angle[[0, -1]].sum(), 4 * np.pi))
    True
    """

    c_planes: int
    gamma_step: float

    def __post_init__(self) -> None:
        if not (isinstance(self.c_planes, int) and self.c_planes >= 1):
            raise ArgumentError(f"c_planes is {self.c_planes!r}; give a whole number of planes, 1 or more.")
        if not (math.isfinite(self.gamma_step) and 0.0 < self.gamma_step <= 90.0):
            raise ArgumentError(f"gamma_step is {self.gamma_step}°; give an angle above 0° and up to 90°.")
        if not math.isclose(self._gammas * self.gamma_step, 180.0, rel_tol=1e-9):
            near = 180.0 / self._gammas
            raise ArgumentError(f"gamma_step is {self.gamma_step}°, which does not divide 180°; {near:.9g}° would do.")
        if self.c_planes * (self._gammas + 1) > MOST_CELLS:
            cells = self.c_planes * (self._gammas + 1)
            raise ArgumentError(f"{cells:,} cells; give fewer c_planes or a larger gamma_step, at most {MOST_CELLS:,}.")

    @property
    def _gammas(self) -> int:
        """Steps from γ = 0° to 180°."""
        return round(180.0 / self.gamma_step)

    @property
    def c(self) -> Array:
        """Planes [°], shape (c_planes,)."""
        return np.linspace(0.0, 360.0, self.c_planes, endpoint=False)

    @property
    def gamma(self) -> Array:
        """[°], from 0 to 180."""
        return np.linspace(0.0, 180.0, self._gammas + 1)

    @property
    def solid_angle(self) -> Array:
        """Of one cell at each γ [sr]: exact; at the poles that of the whole cap."""
        half = math.pi / self._gammas / 2.0
        ring = 4.0 * math.pi / self.c_planes * math.sin(half)
        result = np.array(ring * np.sin(np.radians(self.gamma)), dtype=np.float64)
        result[[0, -1]] = 4.0 * math.pi * math.sin(half / 2.0) ** 2
        return result

    def index(self, direction: Array) -> npt.NDArray[np.intp]:
        """Number of the cell of each unit direction, plane by plane; the caps are the first plane's.

        Parameters
        ----------
        direction : array, shape (n, 3)
            γ is the angle from +Z, C the azimuth from +X towards +Y.
        """
        x, y, z = direction.T
        steps = self._gammas
        row = np.rint(np.arctan2(np.hypot(x, y), z) * (steps / math.pi)).astype(np.intp)
        plane = np.rint(np.arctan2(y, x) * (self.c_planes / (2.0 * math.pi))).astype(np.intp) % self.c_planes
        plane[(row == 0) | (row == steps)] = 0
        index: npt.NDArray[np.intp] = plane * (steps + 1) + row
        return index


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
    return result.replace(notes=tuple(_notes(result, total, len(rays), usable)))


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
