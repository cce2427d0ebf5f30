"""How glossy and how hazy a surface looks to the instruments of the standards, from its BSDF."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.bsdf_data import direction
from etendue.scatter.bsdf import Bsdf

Array = npt.NDArray[np.float64]

GLASS = 1.567
"""Refractive index of the polished black glass whose gloss is 100 by definition [ISO2813]_."""

SOURCE = (0.75, 2.5)
"""Angles that the image of the source subtends at the receptor, in the plane of incidence and across it [°]."""

RECEPTORS: dict[int, tuple[float, float]] = {20: (1.8, 3.6), 60: (4.4, 11.7), 85: (4.0, 6.0)}
"""Angles that the aperture of the receptor subtends, likewise, by angle of incidence [°]."""

STRAIGHT = 2.5
"""Angle from the incident direction [°] beyond which transmitted light counts as haze [ASTMD1003]_."""

NODES = 24
"""Of the rule of Gauss and Legendre along each side of the receptor, on both sides of the mirrored direction."""

STEPS = 5
"""The same of the source."""


@dataclasses.dataclass(frozen=True)
class Appearance:
    """Gloss and haze of a surface.

    Parameters
    ----------
    gloss : mapping of int to float
        Specular gloss in gloss units at 20°, 60° and 85°.
    haze : float or None
        Of transmitted light [%]; None if nothing is transmitted.

    Examples
    --------
    >>> from etendue.scatter.models import Mirror
    >>> appearance(Mirror(reflectance=0.5)).haze is None
    True
    """

    gloss: dict[int, float]
    haze: float | None


def specular_gloss(bsdf: Bsdf, angle: int = 60) -> float:
    """Specular gloss after ISO 2813: the flux that the receptor gets, over that from black glass of index 1.567, times 100.

    Light that is mirrored in a single direction gets into the receptor whole, since its aperture is larger than the image of
    the source. Of f the integral over the aperture is taken, and the mean over directions within the source.

    Parameters
    ----------
    bsdf : Bsdf
        Its front is looked at.
    angle : {20, 60, 85}
        Of incidence and of the receptor [°].

    Returns
    -------
    float
        In gloss units.

    Raises
    ------
    ArgumentError
        If the angle is none of the standard's.

    Examples
    --------
    >>> from etendue.scatter.models import Coated
    >>> round(specular_gloss(Coated(index=1.567, base_reflectance=0), 60), 6)
    100.0
    """
    if angle not in RECEPTORS:
        raise ArgumentError(f"gloss is measured at {', '.join(map(str, RECEPTORS))}°, not at {angle}°")
    mirrored = float(bsdf.regular_reflectance(angle))
    scattered = _into_receptor(bsdf, angle) if bsdf.reflects else 0.0
    return float(100.0 * (mirrored + scattered) / _fresnel(angle))


def transmission_haze(bsdf: Bsdf) -> float:
    """Haze after ASTM D1003 [%]: of light that is transmitted at normal incidence, the part that leaves beyond 2.5°.

    Parameters
    ----------
    bsdf : Bsdf
        Light meets its front.

    Returns
    -------
    float

    Raises
    ------
    ArgumentError
        If nothing is transmitted.

    Examples
    --------
    >>> from etendue.scatter.models import Lambertian
    >>> round(transmission_haze(Lambertian(reflectance=0, transmittance=0.5)), 2)  # 1 - sin² 2.5°
    99.81
    """
    total = float(bsdf.transmittance(0.0))
    if total <= 0.0:
        raise ArgumentError("haze is a part of the light that is transmitted, and nothing is")
    straight = float(bsdf.regular_transmittance(0.0))
    if bsdf.transmits:
        x, w = np.polynomial.legendre.leggauss(4 * NODES)
        # Finer towards the straight direction, where lobes are narrow.
        u = 0.5 * (x + 1.0)
        theta, weight = STRAIGHT * u * u, 0.5 * w * np.radians(STRAIGHT) * 2.0 * u
        scattered = direction(theta[:, None], np.arange(0.0, 360.0, 10.0), behind=True)
        f = bsdf.evaluate([0.0, 0.0, 1.0], scattered).mean(axis=1)
        straight += float(np.sum(f * np.cos(np.radians(theta)) * np.sin(np.radians(theta)) * weight)) * 2.0 * np.pi
    return float(100.0 * (1.0 - straight / total))


def appearance(bsdf: Bsdf) -> Appearance:
    """Gloss at all three angles, and haze if light is transmitted.

    Examples
    --------
    >>> from etendue.scatter.models import Lambertian
    >>> {angle: round(gloss, 2) for angle, gloss in appearance(Lambertian(reflectance=0.9)).gloss.items()}
    {20: 1.08, 60: 2.24, 85: 0.03}
    """
    gloss = {angle: specular_gloss(bsdf, angle) for angle in RECEPTORS}
    return Appearance(gloss, transmission_haze(bsdf) if float(bsdf.transmittance(0.0)) > 0.0 else None)


def _into_receptor(bsdf: Bsdf, angle: int) -> float:
    """∫ f cosθ dΩ over the aperture, averaged over the directions of the source."""
    along, across = (0.5 * side for side in RECEPTORS[angle])
    s, v = np.polynomial.legendre.leggauss(STEPS)
    total = 0.0
    for tilt, part in zip(0.5 * SOURCE[0] * s, v, strict=True):
        for turn, part_across in zip(0.5 * SOURCE[1] * s, v, strict=True):
            # The receptor, about the axis that the mirrored centre of the source follows.
            a, weights = _towards(tilt, along)
            b, weights_across = _towards(turn, across)
            received = _about(angle, 0.0, a[:, None], b[None, :])
            f = bsdf.evaluate(_about(angle, 180.0, tilt, turn), received)
            projected = np.maximum(received[..., 2], 0.0) * np.cos(np.radians(b))
            total += 0.25 * part * part_across * float(weights @ (f * projected) @ weights_across)
    return total


def _towards(centre: float, half: float) -> tuple[Array, Array]:
    """Angles from −half to half [°] that get denser towards the mirrored direction, and their weights [rad]."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    u, w = 0.5 * (x + 1.0), 0.5 * w
    nodes = [centre + (end - centre) * u**3 for end in (-half, half)]
    weights = [abs(end - centre) * 3.0 * u * u * w for end in (-half, half)]
    return np.concatenate(nodes), np.radians(np.concatenate(weights))


def _about(angle: float, phi: float, along: npt.ArrayLike, across: npt.ArrayLike) -> Array:
    """Directions at an angle from the normal, turned by `along` in the plane of incidence, then by `across` [°]."""
    a, b = np.broadcast_arrays(np.radians(np.asarray(along) + angle), np.radians(across))
    in_plane = np.stack([np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)], axis=-1)
    c, s = np.cos(np.radians(phi)), np.sin(np.radians(phi))
    return np.asarray(in_plane @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


def _fresnel(angle: float) -> float:
    """Reflectance of the black glass."""
    cosine = np.cos(np.radians(angle))
    inside = np.sqrt(1.0 - (np.sin(np.radians(angle)) / GLASS) ** 2)
    s = (cosine - GLASS * inside) / (cosine + GLASS * inside)
    p = (GLASS * cosine - inside) / (GLASS * cosine + inside)
    return float(0.5 * (s * s + p * p))
