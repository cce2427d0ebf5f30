"""A family of like things, chosen by ``kind``: its registry is all that pydantic needs to know."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from etendue.scene.mistakes import BY_NAME


class Family:
    """Marks a field, as ``Annotated[Shape, Family(SHAPES)]``: one of the registered classes, by its ``kind``.

    Parameters
    ----------
    members : mapping
        Classes by kind.
    by_name : bool
        Whether a name may stand there too, for something that is described elsewhere.

    Examples
    --------
    >>> from typing import Annotated
    >>> from pydantic import TypeAdapter
    >>> from etendue.scene.shapes import SHAPES
    >>> from etendue.scene.shapes.shape import Shape
    >>> TypeAdapter(Annotated[Shape, Family(SHAPES)]).validate_python({"kind": "disk", "radius": 2})
    Disk(kind='disk', radius=2.0)
    """

    def __init__(self, members: Mapping[str, type[BaseModel]], *, by_name: bool = False) -> None:
        self.members = members
        self.by_name = by_name

    def __get_pydantic_core_schema__(self, _source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The tagged union of the members, as pydantic asks for it."""
        choices: dict[Any, CoreSchema] = {kind: handler.generate_schema(cls) for kind, cls in self.members.items()}
        if self.by_name:
            choices[BY_NAME] = core_schema.str_schema(min_length=1)
        return core_schema.tagged_union_schema(choices, discriminator=self._choice)

    def _choice(self, value: Any) -> str:
        """The kind; an empty one, which no class has, if the value says none."""
        if isinstance(value, str) and self.by_name:
            return BY_NAME
        kind = value.get("kind") if isinstance(value, Mapping) else getattr(value, "kind", None)
        return kind if isinstance(kind, str) else ""
