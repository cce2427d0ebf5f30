"""Models of the BSDF: the finishes of scenes, and what `etendue.bsdf` offers."""

from __future__ import annotations

from etendue.scatter.models.coated import Coated
from etendue.scatter.models.finish import Finish
from etendue.scatter.models.interface import Interface
from etendue.scatter.models.lobes import ABg, CosinePower, Gaussian, HarveyShack
from etendue.scatter.models.mixture import SIMPLE, Mixture
from etendue.scatter.models.rough import RoughCoat, RoughInterface, RoughMetal
from etendue.scatter.models.shares import Absorber, DiffuseSpecular, Lambertian, Mirror, Mixed, Scattering, Transmitter

MODELS: dict[str, type[Finish]] = {**SIMPLE, "mixture": Mixture}
"""Every model by its kind, as a scene names it."""

__all__ = [
    "MODELS",
    "ABg",
    "Absorber",
    "Coated",
    "CosinePower",
    "DiffuseSpecular",
    "Finish",
    "Gaussian",
    "HarveyShack",
    "Interface",
    "Lambertian",
    "Mirror",
    "Mixed",
    "Mixture",
    "RoughCoat",
    "RoughInterface",
    "RoughMetal",
    "Scattering",
    "Transmitter",
]
