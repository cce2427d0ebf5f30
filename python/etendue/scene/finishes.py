"""Finishes: the optical properties of surfaces that a scene names. The models are those of `etendue.bsdf`."""

from __future__ import annotations

from typing import Annotated

from etendue.description.families import Family
from etendue.scatter.models import (
    MODELS,
    Absorber,
    DiffuseSpecular,
    Finish,
    Interface,
    Lambertian,
    Mirror,
    Mixed,
    Scattering,
    Transmitter,
)

FINISHES = MODELS
"""Every finish by its kind."""

BUILT_IN: dict[str, Finish] = {
    "interface": Interface(),
    "absorber": Absorber(),
    "mirror": Mirror(),
    "transparent": Transmitter(),
}
"""Finishes that a scene may name without describing them."""

AnyFinish = Annotated[Finish, Family(FINISHES)]
FinishOrName = Annotated[Finish | str, Family(FINISHES, by_name=True)]

__all__ = [
    "BUILT_IN",
    "FINISHES",
    "Absorber",
    "AnyFinish",
    "DiffuseSpecular",
    "Finish",
    "FinishOrName",
    "Interface",
    "Lambertian",
    "Mirror",
    "Mixed",
    "Scattering",
    "Transmitter",
]
