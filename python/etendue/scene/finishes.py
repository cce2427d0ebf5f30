"""Finishes: the optical properties of surfaces that a scene names. The models are those of `etendue.bsdf`."""

from __future__ import annotations

from typing import Annotated

from etendue.description.families import Family
from etendue.scatter.bsdf_file import BsdfFile
from etendue.scatter.materials import MATERIALS
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

FINISHES: dict[str, type[Finish]] = {**MODELS, "bsdf": BsdfFile}
"""Every finish by its kind: the models, and scatter data from files."""

BUILT_IN: dict[str, Finish] = {
    "interface": Interface(),
    "absorber": Absorber(),
    "mirror": Mirror(),
    "transparent": Transmitter(),
    **{name: material.finish for name, material in MATERIALS.items()},
}
"""Finishes that a scene may name without describing them."""

AnyFinish = Annotated[Finish, Family(FINISHES)]
FinishOrName = Annotated[Finish | str, Family(FINISHES, by_name=True)]

__all__ = [
    "BUILT_IN",
    "FINISHES",
    "Absorber",
    "AnyFinish",
    "BsdfFile",
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
