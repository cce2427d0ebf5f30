"""A scene: sources, solids, surfaces, detectors and observers, as a user describes them."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from annotated_types import MaxLen
from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError, model_validator

from etendue.description.families import Family
from etendue.description.files import Files
from etendue.description.keys import Description
from etendue.description.mistakes import mistakes_of
from etendue.description.values import AsRow, Wavelength
from etendue.errors import SceneError
from etendue.formats.input import as_path, require_readable
from etendue.formats.other_kind import other_kind
from etendue.formats.output import atomic_output
from etendue.quantities.arguments import require
from etendue.quantities.notebook import InNotebook
from etendue.scene.detectors import AnyDetector
from etendue.scene.finishes import BUILT_IN, AnyFinish
from etendue.scene.media import Medium, MediumOrName
from etendue.scene.media_library import MEDIA
from etendue.scene.observers import ObserverKeys
from etendue.scene.sources import SOURCES
from etendue.scene.sources.source import Source
from etendue.scene.things import Solid, Surface
from etendue.scene.toml import read_toml, to_toml

MOST = 100_000
"""Sources, solids, surfaces, detectors or observers of one scene."""

LARGEST_FILE = 1 << 25
"""Most bytes of a scene's file."""


def _not_too_many(value: Any) -> Any:
    if isinstance(value, list | tuple) and len(value) > MOST:
        raise ValueError(f"there are {len(value):,}; a scene may have {MOST:,}")
    return value


NotTooMany = BeforeValidator(_not_too_many)
"""Looks at the length before the mistakes in millions of entries are told one by one."""


@dataclasses.dataclass(frozen=True)
class ReadFrom:
    """The file that a scene was read from: what messages call it. Scenes that differ in this alone are equal.

    Examples
    --------
    >>> ReadFrom("room.toml") == ReadFrom("hall.toml")
    True
    """

    file: str = dataclasses.field(default="", compare=False)


class Scene(Description, InNotebook):
    """What light meets on its way, and where it is looked for.

    The same keys in Python and in a TOML file; docs/scenes.md explains every one.

    Parameters
    ----------
    name : str
    wavelength : number
        [nm], of sources that state none.
    surroundings : str or Medium
        What is where no solid is.
    media : mapping
        Media by name, beside those of the library.
    finishes : mapping
        Optical properties of surfaces by name, beside those that are built in.
    sources, solids, surfaces, detectors, observers : sequence

    Raises
    ------
    SceneError
        With every mistake: unknown keys, values out of their domain, names that stand for nothing.

    Examples
    --------
    >>> scene = Scene(
    ...     sources=[{"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}],
    ...     solids=[{"name": "dome", "shape": {"kind": "dome", "radius": 3}, "medium": "silicone"}],
    ...     detectors=[{"kind": "intensity"}],
    ... )
    >>> Scene.from_dict(scene.to_dict()) == scene
    True
    """

    name: str = ""
    wavelength: Wavelength = 555.0
    surroundings: MediumOrName = "air"
    media: dict[str, Medium] = Field(default_factory=dict)
    finishes: dict[str, AnyFinish] = Field(default_factory=dict)
    sources: Annotated[tuple[Annotated[Source, Family(SOURCES)], ...], MaxLen(MOST), NotTooMany, AsRow] = Field(
        default=()
    )
    solids: Annotated[tuple[Solid, ...], MaxLen(MOST), NotTooMany, AsRow] = Field(default=())
    surfaces: Annotated[tuple[Surface, ...], MaxLen(MOST), NotTooMany, AsRow] = Field(default=())
    detectors: Annotated[tuple[AnyDetector, ...], MaxLen(MOST), NotTooMany, AsRow] = Field(default=())
    observers: Annotated[tuple[ObserverKeys, ...], MaxLen(MOST), NotTooMany, AsRow] = Field(default=())
    _folder: Path = PrivateAttr(default=Path())
    _read_from: ReadFrom = PrivateAttr(default_factory=ReadFrom)

    def __repr__(self) -> str:
        """Name, and how much of what there is."""
        kinds = ("sources", "solids", "surfaces", "detectors", "observers")
        counts = ((len(getattr(self, kind)), kind) for kind in kinds)
        told = ", ".join(f"{n} {kind if n > 1 else kind[:-1]}" for n, kind in counts if n) or "empty"
        return f"<Scene {self.name!r}: {told}>"

    @model_validator(mode="after")
    def _names_are_names(self) -> Self:
        mistakes = [
            (f"{key}.{name}", f"{name!r} is built in; choose another name")
            for key, known in (("media", MEDIA), ("finishes", BUILT_IN))
            for name in getattr(self, key)
            if name in known
        ]
        # Solids and surfaces appear side by side in ledgers.
        for family in (("sources",), ("solids", "surfaces"), ("detectors",), ("observers",)):
            taken: dict[str, str] = {}
            for key in family:
                for i, thing in enumerate(getattr(self, key)):
                    place = f"{key}[{i}]"
                    if thing.name and taken.setdefault(thing.name, place) != place:
                        mistakes.append((f"{place}.name", f"{thing.name!r} is the name of {taken[thing.name]} already"))
        if mistakes:
            raise SceneError("scene", mistakes)
        return self

    def read_files(self) -> tuple[Path, ...]:
        """The files that the scene names: ray files, meshes, tables.

        Examples
        --------
        >>> from pathlib import Path
        >>> led = {"kind": "rays", "file": "led.tm25ray"}
        >>> [path.as_posix() for path in Scene.from_dict({"sources": [led]}, folder="lamps").read_files()]
        ['lamps/led.tm25ray']
        """
        return tuple(self.files.find(name) for name in _named_files(self.to_dict()))

    @property
    def called(self) -> str:
        """What messages call the scene: the file that it was read from, else its name.

        Examples
        --------
        >>> Scene(name="hall").called, Scene.from_dict({"name": "hall"}, source="hall.toml").called, Scene().called
        ('hall', 'hall.toml', 'scene')
        """
        return self._read_from.file or self.name or "scene"

    @property
    def files(self) -> Files:
        """Where files are looked for that the scene names with a relative path."""
        return Files(self._folder)

    @classmethod
    def from_dict(
        cls, data: Mapping[str, Any], *, folder: str | os.PathLike[str] = ".", source: object = "scene"
    ) -> Self:
        """A scene from a mapping as a TOML or JSON file holds it.

        Parameters
        ----------
        data : mapping
            Keys and values.
        folder : path
            From which relative paths count.
        source : object
            What messages call the scene: the name of its file.

        Raises
        ------
        SceneError
            With every mistake.
        """
        require(data, Mapping, "Scene.from_dict: data", "a mapping as files of scenes hold it")
        try:
            scene = cls.model_validate(dict(data))
        except ValidationError as error:
            raise SceneError(source, mistakes_of(error, data)) from None
        read_from = ReadFrom("" if source == "scene" else str(source))
        return scene._at(as_path(folder), read_from)  # noqa: SLF001 - an alternative constructor

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a TOML file, in UTF-8, or in UTF-16 with a byte-order mark.

        Raises
        ------
        SceneError
            If the file is no TOML, with line and column, or with every mistake in the scene.
        OSError
            If the file cannot be opened.

        Examples
        --------
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     Scene(name="nothing").save(Path(folder) / "nothing.toml")
        ...     Scene.load(Path(folder) / "nothing.toml").name
        'nothing'
        """
        path = as_path(path)
        require_readable(path)
        with path.open("rb") as file:
            raw = file.read(LARGEST_FILE + 1)
        if len(raw) > LARGEST_FILE:
            raise SceneError(
                path,
                [("", "more than 32 MiB; this is no description of a scene, whose meshes are in files of their own")],
            )
        other = None if path.suffix.lower() == ".toml" else other_kind(path)
        if other is not None:
            raise SceneError(path, [("", f"this is {other.title}, not a scene (.toml). {other.advice}")])
        data = read_toml(path, raw)
        return cls.from_dict(data, folder=path.parent, source=path)

    def to_toml(self, folder: str | os.PathLike[str] | None = None) -> str:
        """The scene as the text of a TOML file in a folder: that from which its relative paths count, if none is given.

        Raises
        ------
        SceneError
            If something lives in memory only.

        Examples
        --------
        >>> print(Scene(name="empty", wavelength=450).to_toml(), end="")
        name = "empty"
        wavelength = 450
        """
        data = self.to_dict()
        return to_toml(data if folder is None else _moved(data, self._folder, as_path(folder)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a TOML file, whole or not at all; relative paths are written as seen from its folder.

        Raises
        ------
        SceneError
            If something lives in memory only.
        ArgumentError
            If the folder does not exist.
        """
        text = self.to_toml(as_path(path).parent)
        with atomic_output(path) as temporary:
            temporary.write_text(text, encoding="utf-8")

    @classmethod
    def json_schema(cls) -> dict[str, Any]:
        """JSON Schema of a scene's file, for editors.

        Examples
        --------
        >>> sorted(Scene.json_schema()["properties"])[:4]
        ['detectors', 'finishes', 'media', 'name']
        """
        return cls.model_json_schema()

    def replace(self, **changes: Any) -> Self:
        """The same with other values for some keys, checked again; paths still count from the same folder.

        Examples
        --------
        >>> Scene(name="a").replace(name="b").name
        'b'
        """
        return super().replace(**changes)._at(self._folder, self._read_from)  # noqa: SLF001 - its own kind

    def _at(self, folder: Path, read_from: ReadFrom) -> Self:
        self._folder, self._read_from = folder, read_from
        return self


def _named_files(value: Any) -> Iterator[str]:
    """Every ``file`` in descriptions."""
    if isinstance(value, dict):
        for key, held in value.items():
            if key == "file" and isinstance(held, str):
                yield held
            else:
                yield from _named_files(held)
    elif isinstance(value, list | tuple):
        for held in value:
            yield from _named_files(held)


def _moved(value: Any, start: Path, end: Path) -> Any:
    """Descriptions with every relative ``file`` as seen from another folder."""
    if isinstance(value, list):
        return [_moved(held, start, end) for held in value]
    if not isinstance(value, dict):
        return value
    return {
        key: Path(os.path.relpath(start / held, end)).as_posix()
        if key == "file" and isinstance(held, str) and not Path(held).is_absolute()
        else _moved(held, start, end)
        for key, held in value.items()
    }
