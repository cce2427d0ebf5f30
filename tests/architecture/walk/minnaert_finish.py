"""Minnaert's law of diffuse reflection."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Le
from etendue.description.files import Files
from etendue.description.tables import Shares, grid_of
from etendue.description.values import AsNumber, Finite
from etendue.scatter.models.finish import Finish, Record
from pydantic import Field


class Minnaert(Finish):
    """Diffuse reflection that is weaker the more light comes and goes along the surface, as of dark rough rock.

    The BRDF is ρ (n + 2)/(2π) (cos θᵢ cos θₛ)ⁿ, so that the share ρ cosⁿθᵢ is reflected.

    Parameters
    ----------
    reflectance : number or ShareTable
        ρ, of light along the normal; the same at all angles.
    exponent : number
        n ≥ 0; 0 is a Lambertian surface.

    Examples
    --------
    >>> Minnaert(reflectance=0.9, exponent=1.5).record(Files())["exponent"]
    1.5
    """

    kind: Literal["minnaert"] = "minnaert"
    stated_reflectance: Shares = Field(alias="reflectance")
    exponent: Annotated[float, Finite, Ge(0.0), Le(1e3), AsNumber]

    def record(self, files: Files) -> Record:
        """The share along the normal, and the exponent."""
        reflectance = grid_of(self.stated_reflectance, files)
        return {"kind": "minnaert", "diffuse_reflectance": reflectance.record(), "exponent": self.exponent}
