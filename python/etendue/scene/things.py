"""What stands in a scene and is no source: solids and surfaces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Annotated, ClassVar

from pydantic import Field

from etendue.description.families import Family
from etendue.errors import nearest_name
from etendue.scene.bodies import BODIES
from etendue.scene.bodies.body import Body, Face
from etendue.scene.finishes import Finish, FinishOrName
from etendue.scene.media import MediumOrName
from etendue.scene.placement import Placement
from etendue.scene.shapes import SHAPES
from etendue.scene.shapes.shape import WHOLE, Shape, Trim


class Solid(Placement):
    """A closed body, filled with a medium. Where solids overlap or touch, the later one fills the space.

    Parameters
    ----------
    name : str
        For ledgers and messages.
    shape : Body
    medium : str or Medium, optional
        A name, of the scene or of the library, or a description. Only a solid that no light enters needs none.
    finish : str or Finish
        Of all faces that `finishes` does not name.
    finishes : mapping
        Finish by the name of a face, or of a group of faces.
    at, toward, axis, angle, rotation, spin
        Where it stands; see `Placement`.

    Examples
    --------
    >>> lens = Solid(name="window", shape={"kind": "rod", "radius": 5, "height": 1}, medium="BK7",
    ...              finishes={"side": "absorber"})
    >>> lens.finishes
    {'side': 'absorber'}
    """

    INSTEAD: ClassVar[Mapping[str, str]] = MappingProxyType({
        "material": "medium = {0} for what it is filled with, or finish = {0} for what is done to its surface",
        "index": "medium = {{ index = {} }}",
        "radius": "the size in the shape, e.g. shape = {{ kind = 'ball', radius = {} }}",
        "height": "the size in the shape, e.g. shape = {{ kind = 'rod', radius = 5, height = {} }}",
        **Placement.INSTEAD,
    })  # fmt: skip

    name: str = ""
    shape: Annotated[Body, Family(BODIES)]
    medium: MediumOrName | None = None
    finish: FinishOrName = "interface"
    finishes: dict[str, FinishOrName] = Field(default_factory=dict)

    def finish_of(self, face: Face) -> tuple[str | None, Finish | str]:
        """The finish of one face, and under which name it stands: that of the face, of its group, or none."""
        for name in (face.name, face.group):
            if name is not None and name in self.finishes:
                return name, self.finishes[name]
        return None, self.finish

    def check_names(self, faces: tuple[Face, ...]) -> Iterator[tuple[str, str]]:
        """Mistakes in `finishes`: names that no face has."""
        if not self.finishes:
            return
        known = dict.fromkeys(name for face in faces for name in (face.group or face.name, face.name))
        for name in self.finishes:
            if name not in known:
                near = nearest_name(name, known)
                hint = f" Did you mean {near!r}?" if near else ""
                names = ", ".join(list(known)[:12]) + (", …" if len(known) > 12 else "")
                yield (
                    f"finishes.{name}",
                    f"a {type(self.shape).model_fields['kind'].default} has no such face.{hint} Known: {names}.",
                )


class Surface(Placement):
    """A surface without thickness, the same on both sides.

    Parameters
    ----------
    name : str
        For ledgers and messages.
    shape : Shape
    trim : Trim
        What is kept of the shape.
    finish : str or Finish
        A name, of the scene or built in, or a description.
    at, toward, axis, angle, rotation, spin
        Where it stands; see `Placement`.

    Examples
    --------
    >>> Surface(shape={"kind": "paraboloid", "focal_length": 5, "radius": 20}, finish="mirror").shape.focal_length
    5.0
    """

    name: str = ""
    shape: Annotated[Shape, Family(SHAPES)]
    trim: Trim = WHOLE
    finish: FinishOrName
