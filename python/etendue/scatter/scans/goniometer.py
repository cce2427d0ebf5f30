"""The four stages of a goniometer, and what it measures: thesis appendix A, eqs. A.1 to A.3.

At the reference position all angles are 0: light, sample and detector are in line, the detector behind the sample, which the
light meets along its normal. The stages turn the detector bench by α and the detector on it by β, and the sample by γ, about
an axis across the light, and by δ about its own normal [Leloup2008]_.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError

Array = npt.NDArray[np.float64]


def incident_direction(gamma: npt.ArrayLike, delta: npt.ArrayLike) -> Array:
    """To where the light comes from, in the coordinates of the sample: eq. A.1.

    Parameters
    ----------
    gamma, delta : array_like
        Angles of the stages of the sample [°]; shapes that broadcast.

    Returns
    -------
    array, shape (…, 3)
        Away from the surface, as eq. A.7 takes it; the text of section A.2 has it point the other way once.

    Examples
    --------
    >>> incident_direction(30.0, 0.0).round(3).tolist()
    [0.5, -0.0, 0.866]
    """
    g, d = np.broadcast_arrays(np.radians(gamma), np.radians(delta))
    return np.stack([np.sin(g) * np.cos(d), -np.sin(g) * np.sin(d), np.cos(g)], axis=-1)


def detector_direction(alpha: npt.ArrayLike, beta: npt.ArrayLike, gamma: npt.ArrayLike, delta: npt.ArrayLike) -> Array:
    """Where the detector is, in the coordinates of the sample: eq. A.2.

    Parameters
    ----------
    alpha, beta, gamma, delta : array_like
        Angles of the four stages [°]; shapes that broadcast.

    Returns
    -------
    array, shape (…, 3)

    Examples
    --------
    >>> detector_direction(180.0 + 2 * 30.0, 0.0, 30.0, 0.0).round(3).tolist()  # the specular direction
    [-0.5, 0.0, 0.866]
    """
    a, b, g, d = np.broadcast_arrays(*(np.radians(angle) for angle in (alpha, beta, gamma, delta)))
    # In the plane of the light and the normal: along the surface, and along the normal.
    along = np.cos(b) * (np.sin(a) * np.cos(g) - np.cos(a) * np.sin(g))
    height = -np.cos(b) * (np.cos(a) * np.cos(g) + np.sin(a) * np.sin(g))
    x = along * np.cos(d) + np.sin(b) * np.sin(d)
    y = -along * np.sin(d) + np.sin(b) * np.cos(d)
    return np.stack([x, y, height], axis=-1)


def bsdf_of_flux(
    scattered: npt.ArrayLike, incident: npt.ArrayLike, *, solid_angle: float, direction: npt.ArrayLike
) -> Array:
    """F [1/sr] from two fluxes of the same unit: Φs/(Φi Ω |cos θs|), eq. A.3 [ASTME2387]_.

    The thesis prints 1/(sr nm): both fluxes are spectral, so the nanometre cancels.

    Parameters
    ----------
    scattered, incident : array_like
        Flux in the aperture of the detector, and on the sample.
    solid_angle : float
        Of the aperture seen from the sample [sr].
    direction : array_like, shape (…, 3)
        Of the detector.

    Raises
    ------
    ArgumentError
        If the solid angle or an incident flux is not positive and finite, or the detector lies in the surface.

    Examples
    --------
    >>> bsdf_of_flux(1e-4, 1.0, solid_angle=1e-3, direction=[0.6, 0.0, 0.8]).round(6).tolist()
    0.125
    """
    cosine = np.abs(np.asarray(direction, np.float64)[..., 2])
    arriving = np.asarray(incident, np.float64)
    if not 0.0 < solid_angle < np.inf or not ((arriving > 0.0) & np.isfinite(arriving)).all():
        raise ArgumentError("solid angle and incident flux must be finite and more than 0")
    if (cosine < 1e-9).any():
        raise ArgumentError("a detector in the plane of the sample measures no BSDF")
    return np.asarray(np.asarray(scattered, np.float64) / (arriving * solid_angle * cosine))
