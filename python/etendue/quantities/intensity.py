"""A luminous intensity distribution: what a source sends into every direction, seen from afar."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.angle_table import ROUNDING, gaps_of, hat_integrals, kinks_along, kinks_around
from etendue.quantities.arguments import as_numbers, require, require_fields, require_known, require_number
from etendue.quantities.labelled import dataset
from etendue.quantities.luminaire_facts import LUMINAIRE_FACTS, mirrored_facts, turned_facts
from etendue.quantities.notebook import InNotebook
from etendue.quantities.provenance import Provenance
from etendue.quantities.report import Complaint
from etendue.quantities.unlifted import Unlifted, unlifted
from etendue.units import FLUX_UNITS, INTENSITY_NAME, INTENSITY_UNIT, FluxUnit

if TYPE_CHECKING:
    import xarray

Array = npt.NDArray[np.float64]
Symmetry = Literal["none", "C0-C180", "C90-C270", "both", "rotational"]
SYMMETRIES: tuple[str, ...] = get_args(Symmetry)

UNTURNED = "nothing was turned or mirrored"
"""How notes on the direction of planes end that hold until somebody turns them."""

TURNED, MIRRORED = "turned by", "mirrored:"
"""How the steps of a provenance begin that changed where the planes are."""


@dataclasses.dataclass(frozen=True, eq=False)
class Intensity(InNotebook):
    """Intensity over all directions in C-γ coordinates, with its standard error.

    The table stands for *one* function on the sphere: bilinear in (C, γ) between the nodes, periodic in C, and 0 where γ
    lies outside the table. With a single plane it does not depend on C. γ is the angle from +Z, C the azimuth from +X
    towards +Y: the direction is (sin γ cos C, sin γ sin C, cos γ).

    Parameters
    ----------
    c : array, shape (n_c,)
        Planes [°], rising, 0 ≤ C < 360.
    gamma : array, shape (n_gamma,)
        [°], rising, at least two, 0 to 180.
    values : array, shape (n_c, n_gamma)
        [cd], or [W/sr] when `flux_unit` is ``"W"``.
    standard_error : array, shape (n_c, n_gamma), optional
        Same unit; one number stands for all. NaN where unknown, which is everywhere if not given.
    flux_unit : {"lm", "W"}
    flux_error : float
        Standard error of `flux` [flux unit]; NaN where unknown.
    luminaire : mapping
        What else is known; keys of `LUMINAIRE_FACTS`.
    provenance : Provenance
    notes : tuple of str
        What the user should know.
    complaints : tuple of Complaint
        What the reader of a file had to say.
    smooth : bool
        Whether nodes err together, as those of a light field do, so that chance lifts none of them above the others.

    Raises
    ------
    ArgumentError
        If shapes disagree, angles do not rise or leave their range, or a value is not finite.
    UnknownNameError
        If the unit of flux or a fact about the luminaire is unknown.

    Examples
    --------
    >>> half = Intensity(c=[0, 90, 180, 270], gamma=[0, 90], values=[[4.0, 0], [4, 2], [4, 0], [4, 0]])
    >>> half.at(45, [45, 90, 91]).tolist(), half.unit
    ([2.5, 1.0, 0.0], 'cd')
    >>> half.in_direction([[0, 0, 1], [0, 1, 0]]).tolist()
    [4.0, 2.0]
    >>> half.symmetry()
    'C90-C270'
    """

    c: Array
    gamma: Array
    values: Array
    standard_error: Array = dataclasses.field(default_factory=lambda: np.array(np.nan))
    flux_unit: FluxUnit = "lm"
    flux_error: float = math.nan
    luminaire: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    provenance: Provenance = dataclasses.field(default_factory=Provenance)
    notes: tuple[str, ...] = ()
    complaints: tuple[Complaint, ...] = ()
    smooth: bool = False

    def __repr__(self) -> str:
        """Size, peak and origin."""
        size = f"{self.c.size} C planes × {self.gamma.size} γ angles"
        return f"<Intensity of {size} up to {self.values.max():.4g} {self.unit} from {self.provenance.source}>"

    def __post_init__(self) -> None:
        require_known(self.flux_unit, FLUX_UNITS, "flux unit")
        require(self.provenance, Provenance, "Intensity: provenance", "a Provenance, or leave it out")
        require(self.luminaire, Mapping, "Intensity: luminaire", "facts by their names, as {'name': 'lamp'}")
        for fact in self.luminaire:
            require_known(fact, LUMINAIRE_FACTS, "fact about a luminaire")
        for name in ("c", "gamma", "values", "standard_error"):
            array = as_numbers(getattr(self, name), f"Intensity: {name}", copy=True)
            if name == "standard_error" and array.ndim == 0:
                array = np.full(self.values.shape, array)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "luminaire", dict(self.luminaire))
        self._check()

    def _check(self) -> None:
        for name, angles, fewest in (("c", self.c, 1), ("gamma", self.gamma, 2)):
            if angles.ndim != 1 or angles.size < fewest:
                raise ArgumentError(
                    f"Intensity: {name} has shape {angles.shape}; give a row of at least {fewest} angles."
                )
            if not (np.isfinite(angles).all() and (np.diff(angles) > 0.0).all()):
                raise ArgumentError(f"Intensity: the angles {name} must rise strictly.")
        if self.c[0] < 0.0 or self.c[-1] >= 360.0:
            raise ArgumentError(f"Intensity: C runs from {self.c[0]:g}° to {self.c[-1]:g}°; it must be 0 ≤ C < 360.")
        if self.gamma[0] < 0.0 or self.gamma[-1] > 180.0:
            raise ArgumentError(
                f"Intensity: γ runs from {self.gamma[0]:g}° to {self.gamma[-1]:g}°; it must be 0 to 180."
            )
        shape = (self.c.size, self.gamma.size)
        for name, array in (("values", self.values), ("standard_error", self.standard_error)):
            if array.shape != shape:
                raise ArgumentError(f"Intensity: {name} has shape {array.shape}; (planes, γ) is {shape}.")
        if not np.isfinite(self.values).all():
            raise ArgumentError("Intensity: a value is not finite.")

    # --- the function --------------------------------------------------------------------------------------------------

    @property
    def unit(self) -> str:
        """``"cd"`` or ``"W/sr"``."""
        return INTENSITY_UNIT[self.flux_unit]

    @property
    def quantity(self) -> str:
        """``"luminous intensity"`` or ``"radiant intensity"``."""
        return INTENSITY_NAME[self.flux_unit]

    def planes(self, c: npt.ArrayLike) -> Array:
        """Values of the half planes C, which need not be nodes.

        Parameters
        ----------
        c : array_like, shape (m,)
            [°], any finite number; 370 is 10.

        Returns
        -------
        array, shape (m, n_gamma)
            [`unit`] at the nodes γ.
        """
        first, second, share = self.between_planes(_finite("C", c))
        share = share[..., None]
        return (1.0 - share) * self.values[first] + share * self.values[second]

    def at(self, c: npt.ArrayLike, gamma: npt.ArrayLike) -> Array:
        """Intensity in the directions (C, γ), bilinear between the nodes.

        Parameters
        ----------
        c, gamma : array_like
            [°]; they are broadcast against each other.

        Returns
        -------
        array
            [`unit`]; 0 where γ is outside the table.

        Raises
        ------
        ArgumentError
            If an angle is not finite, or γ is not within 0 to 180.
        """
        c, gamma = np.broadcast_arrays(_finite("C", c), _finite("γ", gamma))
        if ((gamma < -ROUNDING) | (gamma > 180.0 + ROUNDING)).any():
            raise ArgumentError("Intensity: γ is the angle from the axis, 0° to 180°.")
        inside = (gamma >= self.gamma[0] - ROUNDING) & (gamma <= self.gamma[-1] + ROUNDING)
        gamma = gamma.clip(self.gamma[0], self.gamma[-1])
        row = (np.searchsorted(self.gamma, gamma, side="right") - 1).clip(0, self.gamma.size - 2)
        up = (gamma - self.gamma[row]) / (self.gamma[row + 1] - self.gamma[row])
        first, second, share = self.between_planes(c)
        low = (1.0 - share) * self.values[first, row] + share * self.values[second, row]
        high = (1.0 - share) * self.values[first, row + 1] + share * self.values[second, row + 1]
        return np.asarray(np.where(inside, (1.0 - up) * low + up * high, 0.0))

    def in_direction(self, directions: npt.ArrayLike) -> Array:
        """Intensity along directions in the source's axes: γ from +Z, C from +X towards +Y.

        Parameters
        ----------
        directions : array_like, shape (..., 3)
            Of any length above 0.

        Raises
        ------
        ArgumentError
            If the shape is another, or a direction has no length.
        """
        d = _finite("a direction", directions)
        if d.ndim == 0 or d.shape[-1] != 3 or not d.any(axis=-1).all():
            raise ArgumentError(f"Intensity: directions of shape {d.shape}; give (..., 3), none of them zero.")
        x, y, z = np.moveaxis(d, -1, 0)
        return self.at(np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(np.hypot(x, y), z)))

    def between_planes(self, c: Array) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], Array]:
        """The planes before and after each C, and how far it is on the way to the latter, 0 to 1."""
        turned = np.mod(_finite("C", c), 360.0)
        first = (np.searchsorted(self.c, turned, side="right") - 1) % self.c.size
        second = (first + 1) % self.c.size
        gap = gaps_of(self.c)[first]
        return first, second, np.mod(turned - self.c[first], 360.0) / gap

    # --- what follows from it ------------------------------------------------------------------------------------------

    @property
    def node_solid_angle(self) -> Array:
        """Weight of each node in the integral over the sphere [sr], shape (n_c, n_gamma): exact for this function.

        Along γ it is the closed form of ∫ (hat function of the node) sin γ dγ, along C the periodic trapezium rule, which
        is exact for what is linear between the planes.
        """
        gaps = np.radians(gaps_of(self.c))
        return np.outer((gaps + np.roll(gaps, 1)) / 2.0, hat_integrals(self.gamma))

    @property
    def flux(self) -> float:
        """Exact integral of the function over the sphere [`flux_unit`]."""
        return float((self.values * self.node_solid_angle).sum())

    @property
    def maximum(self) -> float:
        """Largest value of the table [`unit`]; a bilinear function has it at a node. See `peak_intensity`."""
        return float(self.values.max())

    @property
    def maximum_error(self) -> float:
        """Root mean square deviation of `maximum` from the largest intensity that there is [`unit`]; NaN where unknown.

        The largest of many noisy values is too large; its deviation is the root of the squares of that (`peak_intensity`)
        and of its standard error.
        """
        return math.hypot(self.peak_error, self.maximum - self.peak_intensity)

    @property
    def peak_intensity(self) -> float:
        """The largest intensity, less what chance lifts the largest of many noisy values by [`unit`].

        By the number of nodes that come near the largest one (`etendue.quantities.unlifted`) [Blom1958]_. Nodes in which
        the function has no kink are between others, and have no error of their own. `maximum` where no error is known, and
        where nodes err together (`smooth`).
        """
        return self.largest_between(0.0, 180.0).value

    @property
    def peak_error(self) -> float:
        """Standard error of `peak_intensity` [`unit`]: that of the largest node; NaN where unknown."""
        return float(self.standard_error.ravel()[self.values.argmax()])

    def largest_between(self, low: float, high: float) -> Unlifted:
        """The largest intensity from γ = `low` to `high` [°], less the lift of chance, as `peak_intensity` [`unit`].

        Parameters
        ----------
        low, high : float
            γ [°], 0 to 180, the second not below the first.

        Returns
        -------
        Unlifted
            `value`, and its standard error `error`; NaN where that is unknown.

        Raises
        ------
        ArgumentError
            If there are no such angles.

        Examples
        --------
        >>> Intensity([0], [0, 40, 90], [[500.0, 100, 0]], 20.0).largest_between(20, 90)
        Unlifted(value=300.0, error=20.0)
        """
        require_number(low, "Intensity.largest_between: low", "an angle in °")
        require_number(high, "Intensity.largest_between: high", "an angle in °")
        if not low <= high:
            raise ArgumentError(
                f"Intensity: γ from {low:g}° to {high:g}°; the first angle must not be above the second."
            )
        inner = self.gamma[(self.gamma > low) & (self.gamma < high)]
        gamma = np.unique([low, *inner, high])
        values = self.at(self.c[:, None], gamma)
        # Between two nodes that err alike, the error of a value is theirs.
        errors = np.stack([np.interp(gamma, self.gamma, row, left=0.0, right=0.0) for row in self.standard_error])
        if self.smooth:
            return unlifted(values, errors, np.zeros_like(values))
        weight = np.stack([np.interp(gamma, self.gamma, row) for row in self._kinks.astype(np.float64)])
        # The first and the last node of all planes are one direction if they are poles.
        weight[:, (gamma == 0.0) | (gamma == 180.0)] = 1.0 / self.c.size
        return unlifted(values, errors, weight)

    @property
    def _kinks(self) -> npt.NDArray[np.bool_]:
        """Where the function is not linear across a node, in γ and, if there are other planes, in C."""
        kinks = kinks_along(self.gamma, self.values)
        return kinks & kinks_around(self.c, self.values) if self.c.size > 1 else kinks

    @property
    def peak(self) -> tuple[float, float]:
        """(C, γ) of the first node that has the largest intensity [°]; C is 0 at the poles and for a single plane."""
        plane, row = np.unravel_index(int(self.values.argmax()), self.values.shape)
        gamma = float(self.gamma[row])
        return (0.0 if gamma in (0.0, 180.0) or self.c.size == 1 else float(self.c[plane])), gamma

    def symmetry(self, tolerance: float = 1e-9) -> Symmetry:
        """The strongest symmetry that the function has.

        Parameters
        ----------
        tolerance : float
            Largest difference between mirrored directions, as a share of the maximum.

        Returns
        -------
        {"none", "C0-C180", "C90-C270", "both", "rotational"}
            The plane(s) about which it is its own mirror image; ``"rotational"`` if it does not depend on C.
        """
        require_number(tolerance, "Intensity.symmetry: tolerance", "a share of the maximum")
        limit = tolerance * float(np.abs(self.values).max())
        if float(np.ptp(self.values, axis=0).max()) <= limit:
            return "rotational"
        # A function that is linear between its planes equals its mirror image if it does so at its own planes.
        about_0 = bool(np.abs(self.values - self.planes(-self.c)).max() <= limit)
        about_90 = bool(np.abs(self.values - self.planes(180.0 - self.c)).max() <= limit)
        names: dict[tuple[bool, bool], Symmetry] = {(True, True): "both", (True, False): "C0-C180"}
        return names.get((about_0, about_90), "C90-C270" if about_90 else "none")

    def to_xarray(self) -> xarray.Dataset:
        """The table as a dataset of xarray, for work by name and angle.

        Returns
        -------
        xarray.Dataset
            Variables ``intensity`` and ``standard_error`` over ``c`` and ``gamma`` [°]. The attributes name quantity, unit,
            flux, provenance, notes and what is known of the luminaire; what is neither text nor a number is JSON.

        Raises
        ------
        MissingLibraryError
            If xarray is not installed: ``pip install 'etendue[xarray]'``.

        Examples
        --------
        >>> half = Intensity(c=[0, 180], gamma=[0, 90], values=[[4.0, 0], [4, 2]])
        >>> float(half.to_xarray().intensity.sel(c=180, gamma=90))
        2.0
        """
        known = {name: fact for name, fact in self.luminaire.items() if name != "spectrum"}
        return dataset(
            {"intensity": (self.values, self.unit), "standard_error": (self.standard_error, self.unit)},
            {"c": (self.c, "degree"), "gamma": (self.gamma, "degree")},
            {
                "quantity": self.quantity,
                "unit": self.unit,
                "flux_unit": self.flux_unit,
                "flux": self.flux,
                "flux_error": self.flux_error,
                "luminaire": known,
                "provenance": self.provenance.to_dict(),
                "notes": list(self.notes),
            },
        )

    # --- other distributions ---------------------------------------------------------------------------------------------

    def replace(self, **changes: Any) -> Intensity:
        """A copy with some fields changed (`dataclasses.replace`)."""
        require_fields(changes, type(self))
        return dataclasses.replace(self, **changes)

    def scaled(self, factor: float) -> Intensity:
        """`factor` times this distribution, for instance for another lamp; the facts of the luminaire stay as they are.

        Raises
        ------
        ArgumentError
            If the factor is negative or not finite.
        """
        require_number(factor, "Intensity.scaled: factor", "a finite factor ≥ 0")
        if not 0.0 <= factor < math.inf:
            raise ArgumentError(f"Intensity: cannot be scaled by {factor}; give a finite factor ≥ 0.")
        provenance = self.provenance.then(f"intensity times {factor:.9g}")
        return self.replace(
            values=self.values * factor,
            standard_error=self.standard_error * factor,
            flux_error=self.flux_error * factor,
            provenance=provenance,
        )

    def rotated_about_axis(self, angle: float) -> Intensity:
        """The source turned about its axis: what was at C is at C + `angle`.

        Parameters
        ----------
        angle : float
            [°], from +X towards +Y. Extents along x and y in `luminaire` change places for odd multiples of 90°. What is
            left to the nearest multiple stands in ``luminaire["extents_turned"]``, unless all that is known is round.
        """
        require_number(angle, "Intensity: the angle to turn by", "a number of degrees")
        if not np.isfinite(angle := float(angle)):
            raise ArgumentError(f"Intensity: cannot be turned by {angle}°.")
        step = f"{TURNED} {angle:.9g}° about the axis"
        return self._with_planes_at(self.c + angle, step, turned_facts(self.luminaire, angle))

    def mirrored(self) -> Intensity:
        """The mirror image in the plane C0-C180: what was at C is at -C.

        Luminaire files count C counter-clockwise *from above*, looking against a z axis from which the light goes away;
        étendue counts it about the direction in which sources emit. This is what leads from one to the other.
        """
        return self._with_planes_at(-self.c, f"{MIRRORED} C became -C", mirrored_facts(self.luminaire))

    @property
    def planes_moved(self) -> bool:
        """Whether somebody turned or mirrored the planes since they were read or made."""
        return any(step.startswith((TURNED, MIRRORED)) for step in self.provenance.steps)

    def _with_planes_at(self, c: Array, step: str, luminaire: Mapping[str, Any]) -> Intensity:
        notes = tuple(note for note in self.notes if not note.endswith(UNTURNED))
        if self.c.size == 1:
            return self.replace(provenance=self.provenance.then(step), luminaire=luminaire, notes=notes)
        turned = np.mod(c, 360.0)
        turned[turned == 360.0] = 0.0  # the remainder of -1e-20 is rounded up to the divisor
        order = np.argsort(turned)
        return self.replace(
            c=turned[order],
            values=self.values[order],
            standard_error=self.standard_error[order],
            luminaire=luminaire,
            provenance=self.provenance.then(step),
            notes=notes,
        )


def _finite(name: str, numbers: npt.ArrayLike) -> Array:
    array = as_numbers(numbers, f"Intensity: {name}", "numbers")
    if not np.isfinite(array).all():
        raise ArgumentError(f"Intensity: {name} is not finite.")
    return array
