"""A family of like things, chosen by ``kind``: its registry is all that pydantic needs to know."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from etendue.description.mistakes import BY_NAME, shown
from etendue.errors import nearest_name


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
        union = core_schema.tagged_union_schema(choices, discriminator=self._choice)
        return core_schema.no_info_before_validator_function(self._known, union)

    def _known(self, value: Any) -> Any:
        """Refuse a kind that no member has, before the union is asked."""
        kind = self._choice(value)
        if kind in self.members or (self.by_name and kind == BY_NAME):
            return value
        kinds = f"Known kinds: {', '.join(self.members)}."
        if not isinstance(value, Mapping | BaseModel):
            text = f"is {shown(value)}, not a {'name or a ' if self.by_name else ''}table with a 'kind'. {kinds}"
        elif not kind:
            text = f"'kind' is missing. {kinds}"
        else:
            near = nearest_name(kind, self.members)
            text = f"unknown kind {kind!r}.{f' Did you mean {near!r}?' if near else ''} {kinds}"
        raise PydanticCustomError("unknown_kind", "{message}", {"message": text})

    def _choice(self, value: Any) -> str:
        """The kind; an empty one, which no class has, if the value says none."""
        if isinstance(value, str) and self.by_name:
            return BY_NAME
        kind = value.get("kind") if isinstance(value, Mapping) else getattr(value, "kind", None)
        return kind if isinstance(kind, str) else ""
