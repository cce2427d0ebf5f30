"""Several finishes at once."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from annotated_types import MaxLen, MinLen
from pydantic import model_validator

from etendue.description.families import Family
from etendue.description.files import Files
from etendue.description.values import AsRow, NotNegative
from etendue.errors import ArgumentError
from etendue.scatter.building import built
from etendue.scatter.models.coated import Coated
from etendue.scatter.models.finish import Directed, Finish, Record
from etendue.scatter.models.interface import Interface
from etendue.scatter.models.lobes import ABg, CosinePower, Gaussian, HarveyShack
from etendue.scatter.models.rough import RoughCoat, RoughInterface, RoughMetal
from etendue.scatter.models.shares import Absorber, DiffuseSpecular, Lambertian, Mirror, Mixed, Transmitter

SIMPLE: dict[str, type[Finish]] = {
    cls.model_fields["kind"].default: cls
    for cls in (
        Interface,
        Mirror,
        Absorber,
        Lambertian,
        DiffuseSpecular,
        Transmitter,
        Mixed,
        ABg,
        HarveyShack,
        Gaussian,
        CosinePower,
        Coated,
        RoughCoat,
        RoughInterface,
        RoughMetal,
    )
}
"""Models that are made of no others, by their kind."""


class Mixture(Directed):
    """A sum of finishes, each times its weight: a lobe on a diffuse floor, a coat with holes.

    Parameters
    ----------
    parts : finishes
        What is added up.
    weights : numbers, optional
        One for each; all are 1 if left out. No more light may leave than arrives.
    axis : three numbers
        For parts that are not alike in all directions, in the coordinates of the solid or surface. The parts share it.

    Examples
    --------
    >>> paint = Mixture(parts=[{"kind": "lambertian", "reflectance": 0.8}, {"kind": "gaussian", "peak": 0.5, "sigma": 0.2}])
    >>> paint.reflectance(0).round(4).tolist()
    0.9257
    """

    kind: Literal["mixture"] = "mixture"
    parts: Annotated[tuple[Annotated[Finish, Family(SIMPLE)], ...], MinLen(1), MaxLen(100), AsRow]
    weights: Annotated[tuple[NotNegative, ...], AsRow] = ()

    @model_validator(mode="after")
    def _as_many_weights(self) -> Self:
        if self.weights and len(self.weights) != len(self.parts):
            raise ValueError(f"{len(self.weights)} weights for {len(self.parts)} parts")
        if any(isinstance(part, Directed) and "axis" in part.model_fields_set for part in self.parts):
            raise ValueError("the parts share one axis: state 'axis' beside 'parts', not within")
        return self

    def record(self, files: Files) -> Record:
        """The parts with their weights."""
        weights = self.weights or (1.0,) * len(self.parts)
        record = {
            "kind": "sum",
            "members": [(w, part.unbuilt(files)) for w, part in zip(weights, self.parts, strict=True)],
        }
        try:
            built(record)
        except ValueError as error:
            # A part that is wrong by itself is named.
            for part in self.parts:
                part.record(files)
            raise ArgumentError(f"Mixture: {error}") from None
        return record

    def lets_light_in(self, files: Files) -> bool:
        """If any of the parts does."""
        return any(part.lets_light_in(files) for part in self.parts)
