"""A clear coat over a diffuse base: gloss paint."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Le

from etendue.description.files import Files
from etendue.description.tables import Shares, grid_of
from etendue.description.values import AsNumber, Finite
from etendue.errors import ArgumentError
from etendue.scatter.models.finish import Finish, Record


class Coated(Finish):
    """A smooth clear coat on a Lambertian base: Fresnel reflection at the coat, and what the base scatters through it.

    f = (1 − F(θᵢ)) (1 − F(θₛ)) ρ / (π m² (1 − ρ Fᵢₙ)), m being the index of the coat over that of the medium outside and
    Fᵢₙ the reflectance of the coat for diffuse light from within [Saunderson1942]_.

    Parameters
    ----------
    index : number
        Refractive index of the coat.
    base_reflectance : number or ShareTable
        ρ of the base within the coat; the same at all angles.

    Examples
    --------
    >>> paint = Coated(index=1.5, base_reflectance=0.9)
    >>> paint.reflectance([0, 60]).round(4).tolist(), paint.regular_reflectance([0, 60]).round(4).tolist()
    ([0.7928, 0.8034], [0.04, 0.0892])
    """

    kind: Literal["coated"] = "coated"
    index: Annotated[float, Finite, Ge(1.0), Le(10.0), AsNumber]
    base_reflectance: Shares

    def record(self, files: Files) -> Record:
        """The index, and the reflectance by wavelength."""
        base = grid_of(self.base_reflectance, files)
        if (base.values != base.values[0]).any():
            raise ArgumentError(
                "base_reflectance depends on the angle of incidence; within a coat light comes from all"
            )
        return {"kind": "coated", "index": self.index, "base_reflectance": base.record()}
