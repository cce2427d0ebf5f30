"""How glossy and how hazy a surface looks to the instruments of the standards, from its BSDF.

Light of 555 nm meets the front from azimuth 180°, along the x axis of a sample that is not alike in all directions.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.quadrature import gauss_legendre
from etendue.scatter.bsdf import Bsdf
from etendue.scatter.table import BsdfTable

Array = npt.NDArray[np.float64]

GLASS = 1.567
"""Refractive index of the polished black glass whose gloss is 100 by definition [ISO2813]_."""

SOURCE = (0.75, 2.5)
"""Angles that the image of the source subtends at the receptor, in the plane of incidence and across it [°]."""

RECEPTORS: dict[int, tuple[float, float]] = {20: (1.8, 3.6), 60: (4.4, 11.7), 85: (4.0, 6.0)}
"""Angles that the aperture of the receptor subtends, likewise, by angle of incidence [°]."""

STRAIGHT = 2.5
"""Angle from the incident direction [°] beyond which transmitted light counts as haze [ASTMD1003]_."""


@dataclasses.dataclass(frozen=True)
class Receptor:
    """A slit beside the mirrored direction.

    Parameters
    ----------
    offset : float
        Of its middle from the mirrored direction, in the plane of incidence, towards larger angles [°].
    along, across : float
        Angles that it subtends in the plane of incidence and across it [°].

    Examples
    --------
    >>> Receptor(offset=1.9, along=1.8, across=3.6) in HAZE_RECEPTORS
    True
    """

    offset: float
    along: float
    across: float


HAZE_INCIDENCE = 20.0
HAZE_RECEPTORS = (Receptor(-1.9, 1.8, 3.6), Receptor(1.9, 1.8, 3.6))
"""Angle of incidence [°] of reflection haze, and the receptors on both sides of that of gloss [ISO13803]_."""

IMAGE_INCIDENCE = 30.0
IMAGE_SOURCE = (0.44, 5.0)
"""Angle of incidence [°] of distinctness of image and of haze near it, and the source's image [°] [ASTME4302019]_."""

INCIDENCES = {
    **{f"gloss {angle}": float(angle) for angle in RECEPTORS},
    "reflection haze": HAZE_INCIDENCE,
    "distinctness": IMAGE_INCIDENCE,
}
"""Angles of incidence of what is made of reflected light [°]."""

CLOSE = 0.5
"""What a table may miss of them [°]: about what the source subtends."""

IMAGE_RECEPTORS = {
    "specular": (Receptor(0.0, 0.4, 5.0),),
    "0.3": (Receptor(-0.3, 0.14, 5.0), Receptor(0.3, 0.14, 5.0)),
    "2": (Receptor(-2.0, 0.4, 5.0), Receptor(2.0, 0.4, 5.0)),
    "5": (Receptor(-5.0, 0.5, 5.0), Receptor(5.0, 0.5, 5.0)),
}
"""Receptors by their angle from the mirrored direction [°]; of two the mean is taken."""

ROUNDING = 1e-12
"""Shares that differ by less are the same."""

DRAWS = 12
"""Tables drawn from a table with standard errors, whose spread is the error of its appearance."""

DIMMED = 0.5
"""Part of their light that is left in these tables."""

RATIOS = ("haze", "distinctness")
"""Numbers that do not change with the light as a whole."""

CLOSEST = 1e-4
"""|β − β₀| within which all interpolated values err together."""

NODES = 24
"""Of the rule of Gauss and Legendre along each side of the receptor, on both sides of the mirrored direction."""

STEPS = 5
"""The same of the source."""


@dataclasses.dataclass(frozen=True)
class Appearance:
    """How a surface looks to the instruments of the standards.

    Parameters
    ----------
    gloss : mapping of int to float
        Specular gloss in gloss units at 20°, 60° and 85°.
    haze : float or None
        Of transmitted light [%]; None if nothing is transmitted.
    reflection_haze : float
        In gloss units.
    distinctness : float or None
        Distinctness of image [%]; None if nothing is reflected.
    errors : mapping of str to float
        Standard errors, of "gloss 20", "gloss 60", "gloss 85", "haze", "reflection haze" and "distinctness"; empty if those
        of the BSDF are not known, and without those that are extrapolated.
    extrapolated : mapping of str to float
        Numbers for which light comes from beyond the last incidence of a table, likewise, with this incidence [°]: a table
        knows nothing there, and how f grows towards grazing light may be a factor.

    Examples
    --------
    >>> from etendue.scatter.models import Mirror
    >>> looks = appearance(Mirror(reflectance=0.5))
    >>> looks.haze is None, looks.reflection_haze, looks.distinctness, looks.errors
    (True, 0.0, 100.0, {})
    """

    gloss: dict[int, float]
    haze: float | None
    reflection_haze: float
    distinctness: float | None
    errors: dict[str, float] = dataclasses.field(default_factory=dict)
    extrapolated: dict[str, float] = dataclasses.field(default_factory=dict)

    def values(self) -> dict[str, float]:
        """All numbers by the names of their errors."""
        named: dict[str, float | None] = {f"gloss {angle}": value for angle, value in self.gloss.items()}
        named |= {
            "haze": self.haze,
            "reflection haze": self.reflection_haze,
            "distinctness": self.distinctness,
        }
        return {name: value for name, value in named.items() if value is not None}


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
    along, across = RECEPTORS[angle]
    return 100.0 * _received(bsdf, angle, SOURCE, Receptor(0.0, along, across)) / _fresnel(angle)


def reflection_haze(bsdf: Bsdf) -> float:
    """Reflection haze after ISO 13803: at 20°, the flux into receptors beside that of gloss, in gloss units.

    The receptors are as large as that of gloss, 1.8° in the plane of incidence, with their middles 1.9° from the mirrored
    direction; both are added up.

    Parameters
    ----------
    bsdf : Bsdf
        Its front is looked at.

    Returns
    -------
    float
        In gloss units: 100 times the flux over that of black glass into the receptor of gloss.

    Examples
    --------
    >>> from etendue.scatter.models import Lambertian
    >>> white = Lambertian(reflectance=0.9)
    >>> round(reflection_haze(white) / specular_gloss(white, 20), 2)
    2.0
    """
    found = sum(_received(bsdf, HAZE_INCIDENCE, SOURCE, receptor) for receptor in HAZE_RECEPTORS)
    return 100.0 * found / _fresnel(HAZE_INCIDENCE)


def distinctness_of_image(bsdf: Bsdf) -> float:
    """Distinctness of image after ASTM E430 and D5767 (A) [%]: 100 (1 − R₀.₃/R₀) at 30°.

    R₀ is the flux into a slit of 0.4° at the mirrored direction, R₀.₃ the mean of those into slits of 0.14° that stand 0.3°
    beside it, both divided by the width of their slits; the image of the source is 0.44° wide, and the slits and it are 5°
    high. So a matt surface has 0 %. The image of a perfect mirror ends within the slits beside it: what a mirror of the same
    R₀ would send there is left out of R₀.₃, so that a perfect mirror has 100 %.

    Parameters
    ----------
    bsdf : Bsdf
        Its front is looked at.

    Returns
    -------
    float

    Raises
    ------
    ArgumentError
        If nothing is reflected into the slit.

    Examples
    --------
    >>> from etendue.scatter.models import Mirror
    >>> distinctness_of_image(Mirror(reflectance=0.9))
    100.0
    """
    found = {name: _image(bsdf, name) for name in ("specular", "0.3")}
    if not found["specular"] > 0.0:
        raise ArgumentError("distinctness of image is a part of the light that is reflected, and nothing is")
    beside, middle = (IMAGE_RECEPTORS[name][0] for name in ("0.3", "specular"))
    of_mirror = _mirrored_part(IMAGE_SOURCE, beside) / beside.along
    of_mirror /= _mirrored_part(IMAGE_SOURCE, middle) / middle.along
    return 100.0 * (1.0 - (found["0.3"] / found["specular"] - of_mirror) / (1.0 - of_mirror))


def haze_index(bsdf: Bsdf, angle: int = 2) -> float:
    """Haze index after ASTM E430 [%]: 100 R/R₀ at 30°, R being the flux 2° or 5° beside the mirrored direction.

    The slits are 0.4° wide at 2°, 0.5° at 5°, and fluxes are divided by these widths; the source and R₀ are those of
    `distinctness_of_image`.

    Parameters
    ----------
    bsdf : Bsdf
        Its front is looked at.
    angle : {2, 5}
        From the mirrored direction [°].

    Returns
    -------
    float

    Raises
    ------
    ArgumentError
        If the angle is none of the standard's, or nothing is reflected into the slit.

    Examples
    --------
    >>> from etendue.scatter.models import Lambertian
    >>> round(haze_index(Lambertian(reflectance=0.9), 2))
    100
    """
    if str(angle) not in IMAGE_RECEPTORS:
        raise ArgumentError(f"haze is measured 2 and 5° beside the mirrored direction, not {angle}°")
    whole = _image(bsdf, "specular")
    if not whole > 0.0:
        raise ArgumentError("haze is a part of the light that is reflected, and nothing is")
    return 100.0 * _image(bsdf, str(angle)) / whole


def _image(bsdf: Bsdf, name: str) -> float:
    """The mean of what the receptors of a name get, over the width of their slits."""
    receptors = IMAGE_RECEPTORS[name]
    found = [_received(bsdf, IMAGE_INCIDENCE, IMAGE_SOURCE, receptor) / receptor.along for receptor in receptors]
    return sum(found) / len(found)


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
        x, w = gauss_legendre(4 * NODES)
        # Finer towards the straight direction, where lobes are narrow.
        u = 0.5 * (x + 1.0)
        theta, weight = STRAIGHT * u * u, 0.5 * w * np.radians(STRAIGHT) * 2.0 * u
        scattered = direction(theta[:, None], np.arange(0.0, 360.0, 10.0), behind=True)
        f = bsdf.evaluate([0.0, 0.0, 1.0], scattered).mean(axis=1)
        straight += float(np.sum(f * np.cos(np.radians(theta)) * np.sin(np.radians(theta)) * weight)) * 2.0 * np.pi
    # Of a lobe within the limit nothing is left but rounding, on either side of 0.
    beyond = 1.0 - straight / total
    return 100.0 * beyond if abs(beyond) > ROUNDING else 0.0


def appearance(bsdf: Bsdf, seed: int = 1) -> Appearance:
    """All numbers of a surface; of tables with standard errors these go through to the numbers.

    Errors are the spread over tables drawn with normal errors of their values: independent ones where each was measured;
    where values were interpolated between fewer, all that lie about as far from the specular direction err together, which
    is an upper bound. What errors of an instrument have in common, as that of its reference, is not in them.

    Parameters
    ----------
    bsdf : Bsdf
        Its front is looked at.
    seed : int
        For the tables that are drawn.

    Examples
    --------
    >>> from etendue.scatter.models import Lambertian
    >>> {angle: round(gloss, 2) for angle, gloss in appearance(Lambertian(reflectance=0.9)).gloss.items()}
    {20: 1.08, 60: 2.24, 85: 0.03}
    """
    found = _appearance(bsdf)
    data = bsdf.data if isinstance(bsdf, BsdfTable) else None
    last = bsdf.known_to()
    extrapolated = {name: last for name, angle in INCIDENCES.items() if name in found.values() and angle > last + CLOSE}
    found = dataclasses.replace(found, extrapolated=extrapolated)
    if data is None or not any(one.standard_error is not None for one in data.slices):
        return found
    rng = np.random.default_rng(seed)
    drawn = [_appearance(BsdfTable(_drawn(data, rng))).values() for _ in range(DRAWS)]
    errors = {
        name: float(np.std([one[name] for one in drawn if name in one], ddof=1)) / (1.0 if name in RATIOS else DIMMED)
        for name in found.values()
        if sum(name in one for one in drawn) > 1 and name not in extrapolated
    }
    return dataclasses.replace(found, errors=errors)


def _appearance(bsdf: Bsdf) -> Appearance:
    gloss = {angle: specular_gloss(bsdf, angle) for angle in RECEPTORS}
    reflected = float(bsdf.reflectance(IMAGE_INCIDENCE)) > 0.0
    return Appearance(
        gloss,
        transmission_haze(bsdf) if float(bsdf.transmittance(0.0)) > 0.0 else None,
        reflection_haze(bsdf),
        distinctness_of_image(bsdf) if reflected else None,
    )


def _drawn(data: BsdfData, rng: np.random.Generator) -> BsdfData:
    """At half of its light, with values off by errors of their size; the share that a slice scatters is off with them.

    Half of the light leaves room for errors: no table that scatters more than it receives is drawn.
    """
    slices = []
    for one in data.slices:
        values = one.values
        if one.standard_error is not None:
            values = np.maximum(values + one.standard_error * _deviations(one, rng), 0.0)
        slices.append(dataclasses.replace(one, values=DIMMED * values, stated=None))
    return dataclasses.replace(data, slices=tuple(slices), components=tuple(map(_dimmed, data.components)))


def _deviations(one: BsdfSlice, rng: np.random.Generator) -> Array:
    """A number of unit variance for each value.

    Interpolated values are those of neighbours, so that all at nearly the same distance from the specular direction, within
    a factor of 2, err together: their errors do not shrink in the mean.
    """
    if not one.interpolated:
        return rng.standard_normal(one.values.shape)
    off = one.directions[..., :2] + one.incident[:2]
    octave = np.log2(np.maximum(np.nan_to_num(np.hypot(off[..., 0], off[..., 1])), CLOSEST) / CLOSEST)
    low = np.floor(octave).astype(np.intp)
    part = octave - low
    drawn = rng.standard_normal(int(low.max()) + 2)
    both = (1.0 - part) * drawn[low] + part * drawn[low + 1]
    return np.asarray(both / np.sqrt((1.0 - part) ** 2 + part**2))


def _dimmed(component: Mapping[str, Any]) -> dict[str, Any]:
    parts = [dict(part) for part in component["parts"]] if component["kind"] == "mixture" else [dict(component)]
    weights = component.get("weights") or [1.0] * len(parts)
    whole = {"kind": "mixture", "parts": parts, "weights": [DIMMED * weight for weight in weights]}
    # The axis of one part is stated beside the parts.
    stated = [own.pop("axis") for own in (*parts, dict(component)) if "axis" in own]
    return {**whole, "axis": stated[0]} if stated else whole


def _received(bsdf: Bsdf, angle: float, source: tuple[float, float], receptor: Receptor) -> float:
    """What a receptor gets, over the flux on the sample: mirrored light of the image of the source, and scattered light."""
    mirrored = float(bsdf.regular_reflectance(angle)) * _mirrored_part(source, receptor)
    return float(mirrored + (_scattered_into(bsdf, angle, source, receptor) if bsdf.reflects else 0.0))


def _mirrored_part(source: tuple[float, float], receptor: Receptor) -> float:
    """The part of the image of a source, evenly bright, that lies in a receptor."""
    part = 1.0
    for size, offset, opening in ((source[0], receptor.offset, receptor.along), (source[1], 0.0, receptor.across)):
        low, high = max(-0.5 * size, offset - 0.5 * opening), min(0.5 * size, offset + 0.5 * opening)
        part *= max(high - low, 0.0) / size
    return part


def _scattered_into(bsdf: Bsdf, angle: float, source: tuple[float, float], receptor: Receptor) -> float:
    """∫ f cosθ dΩ over the aperture, averaged over the directions of the source."""
    s, v = gauss_legendre(STEPS)
    total = 0.0
    for tilt, part in zip(0.5 * source[0] * s, v, strict=True):
        for turn, part_across in zip(0.5 * source[1] * s, v, strict=True):
            # The receptor, about the axis that the mirrored centre of the source follows.
            low, high = receptor.offset - 0.5 * receptor.along, receptor.offset + 0.5 * receptor.along
            a, weights = _towards(tilt, low, high)
            b, weights_across = _towards(turn, -0.5 * receptor.across, 0.5 * receptor.across)
            received = _about(angle, 0.0, a[:, None], b[None, :])
            f = bsdf.evaluate(_about(angle, 180.0, tilt, turn), received)
            projected = np.maximum(received[..., 2], 0.0) * np.cos(np.radians(b))
            total += 0.25 * part * part_across * float(weights @ (f * projected) @ weights_across)
    return total


def _towards(centre: float, low: float, high: float) -> tuple[Array, Array]:
    """Angles from low to high [°] that get denser towards the mirrored direction, and their weights [rad]."""
    x, w = gauss_legendre(NODES)
    u, w = 0.5 * (x + 1.0), 0.5 * w
    if not low < centre < high:
        # It lies outside: from the edge that is nearer to it.
        near, far = (low, high) if centre <= low else (high, low)
        return near + (far - near) * u * u, np.radians(abs(far - near) * 2.0 * u * w)
    nodes = [centre + (end - centre) * u**3 for end in (low, high)]
    weights = [abs(end - centre) * 3.0 * u * u * w for end in (low, high)]
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
