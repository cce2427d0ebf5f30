"""Lenses: two surfaces of revolution and the edge between them."""

from __future__ import annotations

import sys
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from etendue.description.files import Files
from etendue.description.values import Length
from etendue.scene.bodies.body import Body, Face
from etendue.scene.placement import Frame
from etendue.scene.shapes.conics import Profile
from etendue.scene.shapes.round import quadric

LOOKS = 4097
"""Distances from the axis at which the thickness is looked at."""


class Lens(Body):
    """A lens about the z axis, with the faces ``front``, ``back`` and ``edge``.

    The vertex of the front stands in the origin, that of the back at z = `thickness`; light that travels towards +z
    meets the front first.

    Parameters
    ----------
    radius : number
        Of both faces and of the edge [mm], > 0.
    thickness : number
        From vertex to vertex [mm], > 0.
    front, back : Profile
        Flat if left out. A biconvex lens has a front with positive and a back with negative radius of curvature.

    Raises
    ------
    SceneError
        If a face does not exist out to the radius, or the faces meet within it.

    Examples
    --------
    >>> lens = Lens(radius=3, thickness=2, front={"radius_of_curvature": 5}, back={"radius_of_curvature": -5})
    >>> lens.edge_thickness
    0.0
    >>> [face.name for face in lens.faces(Files())]
    ['front', 'back']
    """

    kind: Literal["lens"] = "lens"
    radius: Length
    thickness: Length
    front: Profile = Field(default=Profile())
    back: Profile = Field(default=Profile())

    @model_validator(mode="after")
    def _is_thick_enough(self) -> Self:
        self.front.check_radius(self.radius)
        self.back.check_radius(self.radius)
        if self.edge_thickness < 0.0:
            raise ValueError(
                f"'thickness' is {self.thickness:g} mm, which leaves {self.edge_thickness:.6g} mm at the edge; make the "
                "lens thicker, or its radius smaller"
            )
        r = np.linspace(0.0, self.radius, LOOKS)[:-1]
        between = self.thickness + self.back.sags(r) - self.front.sags(r)
        if not (between > 0.0).all():
            raise ValueError(f"'thickness': the faces meet {r[np.argmin(between)]:.4g} mm from the axis")
        return self

    @property
    def edge_thickness(self) -> float:
        """Length of the edge along the axis [mm]; 0 where faces that shall meet miss each other by rounding alone."""
        back, front = self.back.sag(self.radius), self.front.sag(self.radius)
        length = self.thickness + back - front
        # Each sag carries a few roundings of its own size, the sum two more.
        rounding = 8.0 * sys.float_info.epsilon * (self.thickness + abs(back) + abs(front))
        return 0.0 if abs(length) <= rounding else length

    def faces(self, files: Files) -> tuple[Face, ...]:  # noqa: ARG002 - other bodies come from files
        """Front, back, and the edge if it has a length."""
        found = [
            Face("front", self.front.record(0.0, self.radius), flip=True),
            Face("back", self.back.record(0.0, self.radius), Frame.shifted(0.0, 0.0, self.thickness)),
        ]
        if self.edge_thickness > 0.0:
            low, high = self.front.sag(self.radius), self.thickness + self.back.sag(self.radius)
            found.append(Face("edge", quadric(1.0, 0.0, 0.0, -(self.radius**2), z=(low, high))))
        return tuple(found)
