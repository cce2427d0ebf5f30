"""A source as patches: small surface sources, each with an intensity distribution of its own."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.intensity import Intensity
from etendue.quantities.provenance import Provenance
from etendue.units import FluxUnit

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]


@dataclasses.dataclass(frozen=True)
class AngularGrid:
    """The directions of a patch's intensity distribution: step 4b of section 3.2.2 of [Audenaert2014]_.

    Parameters
    ----------
    theta_step : int
        Δθ [°], a divisor of 90. θ is the angle from the patch's normal.
    phi_step : int
        Δφ [°], a divisor of 360. φ is the azimuth from the patch's x axis towards its y axis.

    Examples
    --------
    >>> grid = AngularGrid(30, 90)
    >>> grid.theta.tolist(), grid.phi.tolist(), grid.bins
    ([0.0, 30.0, 60.0, 82.5, 90.0], [0.0, 90.0, 180.0, 270.0], 16)
    """

    theta_step: int
    phi_step: int

    @property
    def shape(self) -> tuple[int, int]:
        """Rows θ, the one at 90° included, and columns φ."""
        return 90 // self.theta_step + 2, 360 // self.phi_step

    @property
    def bins(self) -> int:
        """Bins that rays are counted in."""
        return (self.shape[0] - 1) * self.shape[1]

    @property
    def theta(self) -> Array:
        """Central directions of the bins [°], and 90°, where the intensity is 0; the last bin is a half one."""
        whole = np.arange(90 // self.theta_step, dtype=np.float64) * float(self.theta_step)
        return np.concatenate([whole, [90.0 - self.theta_step / 4.0, 90.0]])

    @property
    def phi(self) -> Array:
        """Central directions of the bins [°]."""
        return np.arange(self.shape[1], dtype=np.float64) * float(self.phi_step)

    @property
    def solid_angle(self) -> Array:
        """Weight of each node in the exact integral of the bilinear function [sr], shape `shape`."""
        table = Intensity(self.phi, self.theta, np.zeros(self.shape[::-1]))
        return table.node_solid_angle.T


@dataclasses.dataclass(frozen=True, eq=False)
class Patches:
    """Small surface sources, each of which sends out light by a table of its own.

    A patch is a flat polygon, or the cell of a curved surface. Its table is the function that is bilinear in (θ, φ)
    between the nodes of its `AngularGrid`, periodic in φ, in the patch's own axes. The luminance of a patch is
    I(θ, φ) / (A cos θ), with the area A that the patch shows along its normal.

    Parameters
    ----------
    shapes : tuple of str
        What the patches of each part of the surface are: ``"square"``, ``"spherical cell"``, ``"cylindrical cell"``.
    parts : tuple of str
        Names of the parts.
    part : array of int, shape (n,)
        The part each patch belongs to.
    pixel : array of int, shape (n,)
        Its number among the cells that the whole surface has.
    centre : array, shape (n, 3)
        Centre of gravity [mm].
    axes : array, shape (n, 3, 3)
        Rows: unit vectors x, y, z; z is the normal, x the plane C0.
    outline : tuple of n arrays, shape (k, 3)
        Corners [mm] of a flat polygon about `centre`, perpendicular to z, of area `projected_area`, counter-clockwise seen
        against z. A curved patch is seen in this outline along its normal.
    extent : array, shape (n, 2)
        Of the outline, along x and y [mm].
    area : array, shape (n,)
        Of the surface [mm²].
    projected_area : array, shape (n,)
        |∫ normal dA| [mm²]: what the patch shows along z. Equal to `area` if it is flat.
    flux : array, shape (n,)
        Of the rays that the patch stands for [`flux_unit`].
    theta_step, phi_step : array of int, shape (n,)
        Δθ and Δφ [°].
    error : array, shape (n,)
        E [%], eq. 3.3.
    start : array of int, shape (n + 1,)
        Where each patch's table begins in `values`.
    values : array
        All tables [cd or W/sr], one after the other, each of shape ``grid(i).shape``, row by row.
    flux_unit : {"lm", "W"}
    provenance : Provenance

    Raises
    ------
    ArgumentError
        If the shapes disagree.

    Examples
    --------
    >>> square = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
    >>> cosine = np.cos(np.radians(AngularGrid(30, 90).theta))[:, None] * np.ones(4)
    >>> patch = Patches(
    ...     shapes=("square",), parts=("plane",), part=[0], pixel=[0], centre=[[0, 0, 0]], axes=[np.eye(3)],
    ...     outline=(square,), extent=[[1, 1]], area=[1], projected_area=[1], flux=[np.pi],
    ...     theta_step=[30], phi_step=[90], error=[0], start=[0, 20], values=cosine.ravel(),
    ... )
    >>> len(patch), patch.intensity(0).values.shape
    (1, (4, 5))
    >>> patch.towards([0, 0], [[0, 0, 1], [0, 0.5, 0.75**0.5]]).round(3).tolist()
    [1.0, 0.866]
    """

    shapes: tuple[str, ...]
    parts: tuple[str, ...]
    part: Indices
    pixel: Indices
    centre: Array
    axes: Array
    outline: tuple[Array, ...]
    extent: Array
    area: Array
    projected_area: Array
    flux: Array
    theta_step: Indices
    phi_step: Indices
    error: Array
    start: Indices
    values: Array
    flux_unit: FluxUnit = "lm"
    provenance: Provenance = dataclasses.field(default_factory=Provenance)

    def __post_init__(self) -> None:
        n = len(self.part)
        shapes: dict[str, tuple[int, ...]] = {"centre": (n, 3), "axes": (n, 3, 3), "extent": (n, 2), "start": (n + 1,)}
        whole = {"part", "pixel", "theta_step", "phi_step", "start"}
        vectors = {"area", "projected_area", "flux", "error", "values"}
        for name in (*shapes, *sorted((whole | vectors) - set(shapes))):
            # A view that cannot be written: tables may be large, and nobody else's array is changed.
            array = np.asarray(getattr(self, name), dtype=np.intp if name in whole else np.float64).view()
            array.setflags(write=False)
            object.__setattr__(self, name, array)
            expected = (
                (int(self.start[-1]) if self.start.ndim and len(self.start) else 0,) if name == "values" else (n,)
            )
            if array.shape != shapes.get(name, expected):
                raise ArgumentError(
                    f"Patches: {name} has shape {array.shape}; with {n} patches it must be {shapes.get(name, expected)}."
                )
        if len(self.outline) != n:
            raise ArgumentError(f"Patches: {len(self.outline)} outlines for {n} patches; give one for each.")

    def __len__(self) -> int:
        """Number of patches."""
        return len(self.part)

    def grid(self, i: int) -> AngularGrid:
        """The directions of patch i."""
        return AngularGrid(int(self.theta_step[i]), int(self.phi_step[i]))

    def table(self, i: int) -> Array:
        """Intensity of patch i at the nodes of its grid [cd or W/sr], shape ``grid(i).shape``."""
        return self.values[self.start[i] : self.start[i + 1]].reshape(self.grid(i).shape)

    def shape(self, i: int) -> str:
        """What patch i is."""
        return self.shapes[int(self.part[i])]

    def intensity(self, i: int) -> Intensity:
        """The distribution of patch i in its own axes: γ = θ from z, C = φ from x towards y."""
        grid = self.grid(i)
        along_x, along_y = (float(length) for length in self.extent[i])
        opening = {"opening_shape": "rectangle", "opening_x": along_x, "opening_y": along_y}
        return Intensity(
            grid.phi,
            grid.theta,
            self.table(i).T,
            flux_unit=self.flux_unit,
            luminaire=opening,
            provenance=self.provenance.then(f"patch {i + 1} of {len(self)}, in its own axes"),
        )

    @property
    def bins(self) -> Indices:
        """Bins of each patch that rays were counted in, shape (n,)."""
        return (90 // self.theta_step + 1) * (360 // self.phi_step)

    @functools.cached_property
    def table_flux(self) -> Array:
        """Exact integral of each patch's bilinear function [`flux_unit`], shape (n,).

        It differs from `flux`: a function through means over bins does not have exactly the flux of the bins.
        """
        flux = np.zeros(len(self))
        for _, chosen, weight in self.by_grid():
            # Not `@`: BLAS starts threads for it, which cost more than such short products.
            flux[chosen] = [np.einsum("i,i", self.values[self.start[i] : self.start[i + 1]], weight) for i in chosen]
        flux.setflags(write=False)
        return flux

    def by_grid(self) -> list[tuple[AngularGrid, Indices, Array]]:
        """For every grid that occurs: the grid, its patches, and the weights of its nodes [sr], flat."""
        pairs = np.unique(np.stack([self.theta_step, self.phi_step], axis=1), axis=0)
        grids = [AngularGrid(int(theta), int(phi)) for theta, phi in pairs]
        return [
            (grid, np.flatnonzero((self.theta_step == theta) & (self.phi_step == phi)), grid.solid_angle.ravel())
            for grid, (theta, phi) in zip(grids, pairs, strict=True)
        ]

    def local(self, patch: npt.ArrayLike, direction: npt.ArrayLike) -> Array:
        """World directions in the axes of patches (eqs. 3.7 and 3.8), shape (m, 3)."""
        local: Array = np.einsum("mij,mj->mi", self.axes[np.asarray(patch)], np.asarray(direction, dtype=np.float64))
        return local

    def towards(self, patch: npt.ArrayLike, direction: npt.ArrayLike) -> Array:
        """Intensity that patches send in directions.

        Parameters
        ----------
        patch : array_like of int, shape (m,)
            Numbers of patches.
        direction : array_like, shape (m, 3)
            Unit vectors in world axes.

        Returns
        -------
        array, shape (m,)
            [cd or W/sr]; 0 behind the patch.
        """
        return self.at_local(patch, self.local(patch, direction))

    def at_local(self, patch: npt.ArrayLike, direction: npt.ArrayLike) -> Array:
        """What `towards` gives, for unit directions in the axes of the patches."""
        patch = np.asarray(patch)
        steps = self.theta_step[patch], self.phi_step[patch]
        return interpolated(self.values, self.start[patch], *steps, np.asarray(direction, dtype=np.float64))


def interpolated(
    values: Array, start: Indices | int, theta_step: Indices | int, phi_step: Indices | int, direction: Array
) -> Array:
    """The bilinear functions of tables in some directions.

    Parameters
    ----------
    values : array
        Tables as `Patches` stores them.
    start, theta_step, phi_step : int or array of int, shape (m,)
        Where the table for each direction begins, and its steps [°].
    direction : array, shape (m, 3)
        Unit vectors in the axes of the table.

    Returns
    -------
    array, shape (m,)
        In the unit of `values`; 0 for θ ≥ 90°.

    Examples
    --------
    >>> grid = AngularGrid(30, 90)
    >>> table = np.repeat([4.0, 3, 2, 1, 0], 4)
    >>> theta = np.radians([15, 82.5, 86.25])
    >>> slanted = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=1)
    >>> interpolated(table, 0, grid.theta_step, grid.phi_step, slanted).round(9).tolist()
    [3.5, 1.0, 0.5]
    """
    x, y, z = direction.T
    theta = np.degrees(np.arctan2(np.hypot(x, y), z))
    inside = theta < 90.0
    theta = np.minimum(theta, 90.0)
    # Rows are `theta_step` apart but for the last three, which stand at 90° - theta_step, 90° - theta_step / 4 and 90°.
    whole, last = 90 // theta_step, 90.0 - theta_step / 4.0
    beyond = theta >= last
    row = np.where(beyond, whole, np.minimum((theta / theta_step).astype(np.intp), whole - 1))
    low = np.where(beyond, last, row * theta_step)
    high = np.where(beyond, 90.0, np.where(row == whole - 1, last, low + theta_step))
    up = (theta - low) / (high - low)
    columns = 360 // phi_step
    turn = np.degrees(np.arctan2(y, x)) / phi_step
    before = np.floor(turn)
    aside = turn - before
    left = before.astype(np.intp) % columns
    right = (left + 1) % columns
    near = start + row * columns
    far = near + columns
    below = (1.0 - aside) * values[near + left] + aside * values[near + right]
    above = (1.0 - aside) * values[far + left] + aside * values[far + right]
    return np.where(inside, (1.0 - up) * below + up * above, 0.0)
