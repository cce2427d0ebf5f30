"""What every part of a scene has in common: keys that are checked, and values that do not change."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType, NoneType, UnionType
from typing import Any, ClassVar, Literal, Self, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic.functional_validators import ModelWrapValidatorHandler

from etendue.description.mistakes import mistakes_of, shown
from etendue.errors import SceneError, nearest_name

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
        cls = type(self)
        keys = cls.names_by_key()
        mistakes: list[tuple[str, str]] = []
        wrong: dict[str, str] = {}
        for name, choices in _choices(cls).items():
            if name in values and not (isinstance(values[name], str | None) and values[name] in choices):
                wrong[name] = f"is {shown(values[name])}.{_hint(values[name], choices)}"
        fitting = values
        if not values.keys() <= keys.keys():
            known = [key for key, name in keys.items() if name not in cls.IN_MEMORY]
            mistakes = [
                (key, f"unknown key.{cls._meant(key, values[key], known)}") for key in values if key not in keys
            ]
            fitting = {key: value for key, value in values.items() if key in keys}
        mistakes += wrong.items()
        try:
            super().__init__(**fitting)
        except ValidationError as error:
            mistakes += [mistake for mistake in mistakes_of(error, values) if mistake[0] not in wrong]
        if mistakes:
            raise SceneError(cls.__name__, mistakes)

    INSTEAD: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """What is meant by keys that do not exist, with ``{}`` for their value."""

    @classmethod
    def _meant(cls, key: str, value: Any, known: Iterable[str]) -> str:
        return f" Give {cls.INSTEAD[key].format(shown(value))}." if key in cls.INSTEAD else _hint(key, known)

    @classmethod
    def names_by_key(cls) -> Mapping[str, str]:
        """The name of the attribute under each key; they differ where a method has the name of the key."""
        return _names_by_key(cls)

    @model_validator(mode="wrap")
    @classmethod
    def _keys_are_texts(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        # Parts within parts are made by the constructor too, which gets their keys as keywords. Thousands of solids come by
        # here: dictionaries are told by their type, which takes a fraction of the time.
        is_table = type(data) is dict or isinstance(data, Mapping)
        if is_table and {*map(type, data)} != {str}:
            data = {str(key): value for key, value in data.items()}
        return handler(data)

    def replace(self, **changes: Any) -> Self:
        """The same with other values for some keys, checked again; what was not stated before is not stated after.

        Raises
        ------
        SceneError
            As the constructor.
        """
        keys = self.names_by_key().items()
        return type(self)(**{key: getattr(self, name) for key, name in keys if name in self.model_fields_set} | changes)

    def __repr_args__(self) -> Iterator[tuple[str, Any]]:
        """Keys and values, as the constructor takes them."""
        return ((key, getattr(self, name)) for key, name in self.names_by_key().items())

    def to_dict(self) -> dict[str, Any]:
        """Keys and values as a TOML file holds them; keys that have their default are left out, but for ``kind``.

        Raises
        ------
        SceneError
            If something lives in memory only.
        """
        written: dict[str, Any] = {}
        for key, name in sorted(self.names_by_key().items(), key=lambda item: FIRST.get(item[0], len(FIRST))):
            value, field = getattr(self, name), type(self).model_fields[name]
            if name in self.IN_MEMORY and value is not None:
                raise SceneError(
                    type(self).__name__, [(name, "lives in memory; write it to a file first, and name the file")]
                )
            if name == "kind" or value != field.get_default(call_default_factory=True):
                written[key] = _plain(value)
        return written


@functools.cache
def _names_by_key(kind: type[Description]) -> Mapping[str, str]:
    return MappingProxyType({field.alias or name: name for name, field in kind.model_fields.items()})


def _plain(value: Any) -> Any:
    if isinstance(value, Description):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {key: _plain(held) for key, held in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(held) for held in value]
    return str(value) if isinstance(value, Path) else value


@functools.cache
def _choices(kind: type[Description]) -> Mapping[str, tuple[str | None, ...]]:
    """The keys that hold one of a few words, or perhaps nothing."""
    found = {key: _words(kind.model_fields[name].annotation) for key, name in kind.names_by_key().items()}
    return MappingProxyType({key: words for key, words in found.items() if words})


def _words(annotation: Any) -> tuple[str | None, ...]:
    """What a type admits if that is a few words, or None; empty if it admits anything else."""
    if annotation is NoneType:
        return (None,)
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    if get_origin(annotation) in (Union, UnionType):
        parts = [_words(part) for part in get_args(annotation)]
        return tuple(word for part in parts for word in part) if all(parts) else ()
    return ()


def _hint(found: Any, known: Iterable[str | None]) -> str:
    words = [word for word in known if word is not None]
    near = nearest_name(found, words) if isinstance(found, str) else None
    return (f" Did you mean {near!r}?" if near else "") + f" Known: {', '.join(words)}."
