"""Models of the BSDF: the finishes of scenes, and what `etendue.bsdf` offers."""

from __future__ import annotations

from etendue.scatter.models.finish import Finish
from etendue.scatter.models.interface import Interface
from etendue.scatter.models.shares import Absorber, DiffuseSpecular, Lambertian, Mirror, Mixed, Scattering, Transmitter

MODELS: dict[str, type[Finish]] = {
    cls.model_fields["kind"].default: cls
    for cls in (Interface, Mirror, Absorber, Lambertian, DiffuseSpecular, Transmitter, Mixed)
}
"""Every model by its kind, as a scene names it."""

__all__ = [
    "MODELS",
    "Absorber",
    "DiffuseSpecular",
    "Finish",
    "Interface",
    "Lambertian",
    "Mirror",
    "Mixed",
    "Scattering",
    "Transmitter",
]
