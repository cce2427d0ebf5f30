"""Materials of luminaires by name: finishes that a scene may name without describing them."""

from __future__ import annotations

import dataclasses
import math

from etendue.scatter.models import Coated, Finish, Gaussian, Lambertian, RoughCoat, RoughMetal

ALUMINIUM = (0.96, 6.69)
"""n and k of aluminium at 555 nm [Rakic1995]_."""

PAINT_INDEX = 1.5
"""Of the binder of paints, typical."""


@dataclasses.dataclass(frozen=True)
class Material:
    """A finish, and what it rests on.

    Parameters
    ----------
    finish : Finish
        With its parameters.
    source : str
        A citation, a definition, or that it is typical: no measurement of a product.

    Examples
    --------
    >>> MATERIALS["gloss-white-paint"].finish.reflectance(8).round(2).tolist()
    0.83
    """

    finish: Finish
    source: str


def _holographic(width: float) -> Material:
    """A diffuser by the full width at half maximum of its lobe at normal incidence [°]; 0.9 gets through."""
    sigma = math.sin(math.radians(width / 2.0)) / math.sqrt(2.0 * math.log(2.0))
    whole = 2.0 * math.pi * sigma**2 * -math.expm1(-0.5 / sigma**2)
    finish = Gaussian(peak=0.9 / whole, sigma=sigma, way="transmitted")
    return Material(finish, f"by definition: f falls to half {width / 2:g}° from normal; transmittance 0.9, typical")


MATERIALS: dict[str, Material] = {
    "matt-white-paint": Material(
        RoughCoat(roughness=0.6, index=PAINT_INDEX, base_reflectance=0.9277), "typical: 85 % reflectance, a rough coat"
    ),
    "gloss-white-paint": Material(
        Coated(index=PAINT_INDEX, base_reflectance=0.9211),
        "typical: 83 % reflectance, a smooth coat over a diffuse base",
    ),
    "anodised-aluminium": Material(
        RoughMetal(roughness=0.15, reflectance=0.82), "typical of bright satin anodising: 0.82 at each facet"
    ),
    "brushed-aluminium": Material(
        RoughMetal(roughness=0.05, roughness_across=0.25, index=ALUMINIUM[0], extinction=ALUMINIUM[1]),
        "optical constants of [Rakic1995]; roughness typical, the brushing along the x axis",
    ),
    "opal-pmma": Material(
        Lambertian(reflectance=0.38, transmittance=0.52), "typical of a sheet of 3 mm: no gloss, no direct transmission"
    ),
    **{f"holographic-diffuser-{width:g}": _holographic(width) for width in (0.5, 5.0, 20.0, 40.0)},
    "microcellular-pet": Material(
        RoughCoat(roughness=0.035, index=1.575, base_reflectance=0.9938),
        "stand-in: R = 0.984 [Audenaert2014] and the index of PET; the roughness was fitted to table 4.1 there",
    ),
}
"""All materials by the name that a scene may use."""
