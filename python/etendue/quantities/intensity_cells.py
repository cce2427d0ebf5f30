"""The cells of a C-γ table: which directions count for which of its nodes."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError

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
