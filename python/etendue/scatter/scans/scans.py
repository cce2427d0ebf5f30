"""What a goniometer measured: values at directions of incidence and scatter."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_numbers, require_number, require_numbers
from etendue.scatter.scans.goniometer import bsdf_of_flux, detector_direction, incident_direction

Array = npt.NDArray[np.float64]

SAME = 1e-6
"""How far the length of a unit vector may be off."""

NEAR = 5e-4
"""Angles [rad] within which directions of incidence are one: stages do not come back to the same place exactly."""

TURNED = 2e-3
"""Angles [rad] within which directions of a turned sample are the same, and cosines of incidence."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Scans:
    """BSDF at measured pairs of directions of light that meets the front; it is reflected, or transmitted to the back.

    Parameters
    ----------
    incident, scattered : array, shape (n, 3)
        Unit vectors away from the surface, +z the normal: to where the light comes from, and to the detector, which is
        behind the sample (z < 0) for transmitted light.
    values : array, shape (n,)
        f [1/sr]. Noise below 0, as dark samples have it, belongs to them: without it their mean would be too large.
    standard_error : array, shape (n,), optional
        Of the values [1/sr].
    reflectance, transmittance : float, optional
        Total ones of an integrating sphere; tables are scaled to them at each incidence.

    Raises
    ------
    ArgumentError
        If shapes do not fit, a direction is no unit vector, light comes from behind the sample or leaves along it, a value
        is not finite, a standard error is not or is below 0, or a share is stated of light of which there is no value.

    Examples
    --------
    >>> one = Scans([[-0.6, 0, 0.8]], [[0.6, 0, 0.8]], [2.5])
    >>> [round(theta, 3) for theta in one.thetas]
    [36.87]
    """

    incident: Array
    scattered: Array
    values: Array
    standard_error: Array | None = None
    reflectance: float | None = None
    transmittance: float | None = None

    def __post_init__(self) -> None:
        for name in ("incident", "scattered", "values", "standard_error"):
            given = getattr(self, name)
            if given is not None or name != "standard_error":
                object.__setattr__(self, name, as_numbers(given, f"Scans: {name}", copy=True))
        require_numbers(self, "reflectance", "transmittance", instead="a share of the light", none=True)
        n = self.values.shape
        if len(n) != 1 or not n[0] or self.incident.shape != (*n, 3) or self.scattered.shape != (*n, 3):
            raise ArgumentError("scans are n pairs of directions of shape (n, 3) with n values")
        sides = (("incident", self.incident, "in front of"), ("scattered", np.abs(self.scattered), "beside"))
        for name, vectors, where in sides:
            sound = (np.abs(np.linalg.norm(vectors, axis=1) - 1.0) < SAME) & (vectors[:, 2] > 0.0)
            if not sound.all():
                at = int(np.argmin(sound))
                raise ArgumentError(
                    f"{name}[{at}] is {getattr(self, name)[at].tolist()}, no unit vector {where} the sample"
                )
        if not np.isfinite(self.values).all():
            raise ArgumentError("measured values are finite")
        if self.standard_error is not None:
            if self.standard_error.shape != n:
                raise ArgumentError("standard errors have the shape of the values")
            if not (np.isfinite(self.standard_error) & (self.standard_error >= 0.0)).all():
                raise ArgumentError("standard errors are finite and not below 0")
        for name in ("reflectance", "transmittance"):
            share = getattr(self, name)
            if share is not None and not 0.0 < share <= 1.0:
                raise ArgumentError(f"{name} is {share:g}; it must be more than 0 and at most 1")
            place = "behind" if name == "transmittance" else "in front of"
            if share is not None and not ((self.scattered[:, 2] < 0.0) == (name == "transmittance")).any():
                raise ArgumentError(f"{name} is stated, and no value was measured {place} the sample: leave it out")

    @classmethod
    def from_stages(
        cls,
        stages: npt.ArrayLike,
        scattered_flux: npt.ArrayLike,
        incident_flux: npt.ArrayLike,
        *,
        solid_angle: float,
        reflectance: float | None = None,
        transmittance: float | None = None,
    ) -> Scans:
        """From the raw angles of the four stages and fluxes.

        Parameters
        ----------
        stages : array_like, shape (n, 4)
            α, β, γ, δ [°].
        scattered_flux, incident_flux : array_like
            Of each position, and on the sample: n numbers, or one.
        solid_angle : float
            Of the aperture [sr].
        reflectance, transmittance : float, optional
            As of the class.

        Raises
        ------
        ArgumentError
            As the class, and if a flux is not positive.

        Examples
        --------
        >>> raw = Scans.from_stages([[240.0, 0.0, 30.0, 0.0]], [1e-4], 1.0, solid_angle=1e-3)
        >>> raw.values.round(4).tolist(), raw.scattered.round(3).tolist()
        ([0.1155], [[-0.5, 0.0, 0.866]])
        """
        angles = as_numbers(stages, "Scans.from_stages: stages", "rows of α, β, γ, δ in °")
        scattered, arriving = (
            as_numbers(flux, f"Scans.from_stages: {name}", "a flux, or one for each position")
            for name, flux in (("scattered_flux", scattered_flux), ("incident_flux", incident_flux))
        )
        require_number(solid_angle, "Scans.from_stages: solid_angle", "that of the aperture in sr")
        if angles.ndim != 2 or angles.shape[1] != 4:
            raise ArgumentError("stages are rows of α, β, γ, δ")
        to = detector_direction(*angles.T)
        f = bsdf_of_flux(scattered, arriving, solid_angle=solid_angle, direction=to)
        incident = incident_direction(angles[:, 2], angles[:, 3])
        return cls(incident, to, f, reflectance=reflectance, transmittance=transmittance)

    def way(self, *, transmitted: bool) -> Scans | None:
        """What is reflected, or the mirror image at the surface of what is transmitted; None if there is none.

        In that image light that goes straight on stands where mirrored light would, so that all that is known of lobes about
        the specular direction holds for it. Its `reflectance` is the transmittance.

        Examples
        --------
        >>> both = Scans([[0, 0, 1]] * 2, [[0, 0, 1], [0, 0.6, -0.8]], [0.1, 0.2], transmittance=0.5)
        >>> both.way(transmitted=True).scattered.tolist(), both.way(transmitted=True).reflectance
        ([[0.0, 0.6, 0.8]], 0.5)
        """
        own = (self.scattered[:, 2] < 0.0) == transmitted
        if not own.any():
            return None
        return Scans(
            self.incident[own],
            np.concatenate([self.scattered[own, :2], np.abs(self.scattered[own, 2:])], axis=1),
            self.values[own],
            None if self.standard_error is None else self.standard_error[own],
            self.transmittance if transmitted else self.reflectance,
        )

    def by_incidence(self) -> list[tuple[Array, npt.NDArray[np.intp]]]:
        """Each direction of incidence, by angle, and which values belong to it: the mean of those that are `NEAR`."""
        left = np.arange(self.values.size)
        found = []
        while left.size:
            first = self.incident[left[0]]
            same = np.abs(self.incident[left] - first).max(axis=1) < NEAR
            if np.ptp(self.incident[left[same]], axis=0).max() > 0.0:
                first = self.incident[left[same]].mean(axis=0)
            found.append((first / np.linalg.norm(first), left[same]))
            left = left[~same]
        return sorted(found, key=lambda one: -one[0][2])

    def anisotropy(self) -> float:
        """By how much values differ when the sample is turned about its normal: root mean square of relative differences.

        Of pairs of the same angle of incidence, measured at different azimuths of the sample, and of scattered directions
        that lie alike to the plane of incidence. NaN if there is none: the sample was not turned. It is the test by which
        the thesis, in appendix A, calls a sample isotropic.

        Examples
        --------
        >>> Scans([[-0.6, 0, 0.8], [0, -0.6, 0.8]], [[0.6, 0, 0.8], [0, 0.6, 0.8]], [2.0, 2.2]).anisotropy().__round__(4)
        0.0952
        """
        groups = self.by_incidence()
        differences: list[float] = []
        for k, (first, own) in enumerate(groups):
            for other, its in groups[k + 1 :]:
                if abs(first[2] - other[2]) > TURNED:
                    continue
                # The second turned so that its light comes from where that of the first does.
                turn = np.arctan2(first[1], first[0]) - np.arctan2(other[1], other[0])
                c, s = np.cos(turn), np.sin(turn)
                to = self.scattered[its] @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
                near = to @ self.scattered[own].T
                pair = near.argmax(axis=1)
                met = near.max(axis=1) > 1.0 - 0.5 * TURNED**2
                a, b = self.values[own][pair[met]], self.values[its][met]
                mean = 0.5 * (a + b)
                differences += ((b - a)[mean > 0.0] / mean[mean > 0.0]).tolist()
        return float(np.sqrt(np.mean(np.square(differences)))) if differences else float("nan")

    def __repr__(self) -> str:
        """How many values, at which angles of incidence."""
        thetas = self.thetas
        angles = f"{min(thetas):.3g} to {max(thetas):.3g}°"
        known = "with errors" if self.standard_error is not None else "without errors"
        below = int((self.values < 0.0).sum())
        dark = f", {below} below 0" if below else ""
        return f"Scans({self.values.size} values at {len(thetas)} incidences, {angles}, {known}{dark})"

    @property
    def thetas(self) -> list[float]:
        """Angles of incidence [°]."""
        return [float(np.degrees(np.arccos(min(1.0, i[2])))) for i, _ in self.by_incidence()]
