"""What every part of a scene has in common: keys that are checked, and values that do not change."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, ValidationError, ValidatorFunctionWrapHandler, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from etendue.errors import SceneError, nearest_name
from etendue.scene.mistakes import scene_error

FIRST = {"name": 0, "kind": 1}
"""Keys that are written before all others."""


class Description(BaseModel):
    """A part of a scene as a user writes it.

    Made from keywords, or from a mapping as a TOML file holds it. An unknown key is a mistake; all mistakes are told at
    once, in one `SceneError`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    IN_MEMORY: ClassVar[tuple[str, ...]] = ()
    """Fields that hold something that only Python can hand over, and no file can."""

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise scene_error(error, values, type(self).__name__) from None

    # Parts within parts are not made through the constructor, so that their mistakes arrive with their place.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @model_validator(mode="wrap")
    @classmethod
    def _names_every_unknown_key(cls, data: Any, handler: ValidatorFunctionWrapHandler) -> Self:
        if not isinstance(data, Mapping):
            return handler(data)  # type: ignore[no-any-return]
        known = [name for name in cls.model_fields if name not in cls.IN_MEMORY]
        unknown: list[InitErrorDetails] = []
        for key in data:
            if key not in cls.model_fields:
                near = nearest_name(str(key), known)
                hint = f" Did you mean {near!r}?" if near else ""
                message = f"unknown key.{hint} Known: {', '.join(known)}."
                kind = PydanticCustomError("unknown_key", "{message}", {"message": message})
                unknown.append(InitErrorDetails(type=kind, loc=(str(key),), input=data[key]))
        if not unknown:
            return handler(data)  # type: ignore[no-any-return]
        try:
            handler({key: value for key, value in data.items() if key in cls.model_fields})
        except ValidationError as error:
            unknown += [_again(details) for details in error.errors()]
        raise ValidationError.from_exception_data(cls.__name__, unknown)

    def replace(self, **changes: Any) -> Self:
        """The same with other values for some keys, checked again.

        Raises
        ------
        SceneError
            As the constructor.
        """
        return type(self)(**{name: getattr(self, name) for name in type(self).model_fields} | changes)

    def to_dict(self) -> dict[str, Any]:
        """Keys and values as a TOML file holds them; keys that have their default are left out, but for ``kind``.

        Raises
        ------
        SceneError
            If something lives in memory only.
        """
        written: dict[str, Any] = {}
        for name, field in sorted(type(self).model_fields.items(), key=lambda item: FIRST.get(item[0], len(FIRST))):
            value = getattr(self, name)
            if name in self.IN_MEMORY and value is not None:
                raise SceneError(
                    type(self).__name__, [(name, "lives in memory; write it to a file first, and name the file")]
                )
            if name == "kind" or value != field.get_default(call_default_factory=True):
                written[name] = _plain(value)
        return written


def _plain(value: Any) -> Any:
    if isinstance(value, Description):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {key: _plain(held) for key, held in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(held) for held in value]
    return str(value) if isinstance(value, Path) else value


def _again(details: Any) -> InitErrorDetails:
    """A mistake that was found, to be told with others."""
    kind = PydanticCustomError(details["type"], "{message}", {**details.get("ctx", {}), "message": details["msg"]})
    return InitErrorDetails(type=kind, loc=details["loc"], input=details["input"])
