"""A number in a scene by its path, such as ``lens.at.2``, and the scene with another number there."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from annotated_types import Le

from etendue.description.keys import Description
from etendue.description.values import LONGEST
from etendue.errors import ArgumentError, SceneError, UnknownNameError
from etendue.scene import Scene
from etendue.units import FluxUnit

ROWS = ("sources", "solids", "surfaces", "detectors", "observers")
"""Families of a scene whose parts are listed, each with a name or without."""

TABLES = ("media", "finishes")
"""Families whose parts are held by name."""

DEGREES = ("angle", "spin", "rotation", "theta", "phi", "roll", "gamma_step", "apex_angle", "crease_angle")
LENGTHS = ("target", "radius_of_curvature", "width", "height", "distance", "z", "radius")
"""Keys of angles, and of lengths that have not the limit which tells all others."""

OTHERS = {
    "wavelength": "nm",
    "absorption": "1/mm",
    "sellmeier.c": "µm²",
    "scale": "",
    "peak": "1/sr",
    "b0": "1/sr",
    "a": "1/sr",
}
"""Units of other keys, by their ends."""

COEFFICIENTS = "coefficients"
"""Of aspheres: A₄ r⁴ + A₆ r⁶ + … is a length."""

SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")

Word = str | int
"""A step of a path: a key, a name, or a number from 0."""


@dataclasses.dataclass(frozen=True)
class Parameter:
    """A number of a scene that can be changed.

    Parameters
    ----------
    path : str
        As the user wrote it.
    words : tuple
        From the scene down: family, number or name, keys, numbers from 0 in rows.
    unit : str
        Empty if it has none.

    Examples
    --------
    >>> lens = {"name": "lens", "medium": "PMMA", "at": [0, 0, 7], "shape": {"kind": "ball", "radius": 3}}
    >>> scene = Scene(solids=[lens])
    >>> place = Parameter.find(scene, "lens.at.2")
    >>> place.words, place.unit, place.changed(scene, 9.0).solids[0].at
    (('solids', 0, 'at', 2), 'mm', (0.0, 0.0, 9.0))
    >>> Parameter.find(scene, "lens.shape.radis")
    Traceback (most recent call last):
    etendue.errors.UnknownNameError: unknown key of lens.shape 'radis'. Did you mean 'radius'? Known: kind, radius.
    """

    path: str
    words: tuple[Word, ...]
    unit: str

    @classmethod
    def find(cls, scene: Scene, path: str, flux_unit: FluxUnit = "lm") -> Parameter:
        """The number at a path.

        Parameters
        ----------
        scene : Scene
            Where it is looked for.
        path : str
            ``lens.at.2`` begins with the name of a source, solid, surface, detector, observer, medium or finish;
            ``solids.lens.at.2`` and ``solids.0.at.2`` with its family; what is left is ``wavelength``. Numbers in rows
            count from 0.
        flux_unit : {"lm", "W"}
            Of the scene.

        Raises
        ------
        UnknownNameError
            If a name or key does not exist; suggests the nearest.
        ArgumentError
            If a name stands for several parts, or at the path there is no number.
        """
        text = re.sub(r"\[(\d+)\]", r".\1", path.strip())
        head, rest = _part(scene, text)
        words, value = list(head), _at(scene, head)
        told, annotation, key = _called(scene, head, text), None, ""
        keys: list[str] = []
        for word in rest:
            step: Word
            if isinstance(value, Description):
                step, annotation, key = _key(value, word, told), _annotation(value, word), word
                # The values of a table are what the table is of.
                keys += [] if word == "values" and keys else [word]
                value = getattr(value, value.names_by_key()[word])
            elif isinstance(value, Mapping):
                if word not in value:
                    raise UnknownNameError(f"name in {told}", word, value)
                step, value = word, value[word]
            elif isinstance(value, tuple | list):
                step = _number_in(value, word, told)
                value = value[step]
            else:
                raise ArgumentError(f"{path}: {_why_not(value, told)}")
            words.append(step)
            told = f"{told}.{word}"
        if isinstance(value, bool) or not (value is None or isinstance(value, int | float)):
            raise ArgumentError(f"{path}: {_why_not(value, told)}")
        if key == "spectrum":  # rows of wavelength and share
            return cls(path, tuple(words), "nm" if words[-1] == 0 else "")
        if key == COEFFICIENTS and isinstance(words[-1], int):
            return cls(path, tuple(words), f"1/mm{str(2 * words[-1] + 3).translate(SUPERSCRIPTS)}")
        return cls(path, tuple(words), flux_unit if key == "flux" else _unit(keys, annotation))

    def changed(self, scene: Scene, value: float) -> Scene:
        """The scene with another number here, checked as a whole file is.

        Raises
        ------
        SceneError
            If the scene has mistakes then; names the parameter and the value.
        """
        whole = int(value) if float(value).is_integer() and abs(value) < 2**53 else float(value)
        first, *rest = self.words
        assert isinstance(first, str)  # noqa: S101 - a scene has keys
        try:
            return scene.replace(**{first: _with(getattr(scene, first), rest, whole)})
        except SceneError as error:
            raise SceneError(f"{self.path} = {value:g}", error.mistakes) from None


def _with(value: Any, words: list[Word], number: float) -> Any:
    """What a value is made of, with a number in one place: descriptions become mappings, which are checked anew."""
    if not words:
        return number
    word, *rest = words
    if isinstance(value, Description):
        held = {key: getattr(value, name) for key, name in value.names_by_key().items()}
        return held | {word: _with(held[str(word)], rest, number)}
    if isinstance(value, Mapping):
        return {**value, word: _with(value[word], rest, number)}
    return [_with(held, rest, number) if i == word else held for i, held in enumerate(value)]


def _part(scene: Scene, text: str) -> tuple[tuple[Word, ...], list[str]]:
    """The part of the scene that a path begins with, and the words after it."""
    family, _, after = text.partition(".")
    if family in (*ROWS, *TABLES) and after:
        return _member(scene, family, after)
    if text == "wavelength":
        return (), [text]
    named = [(name, place) for name, place in _names(scene) if text == name or text.startswith(f"{name}.")]
    # Names may have dots in them; the longest is meant.
    longest = max((len(name) for name, _ in named), default=0)
    named = [(name, place) for name, place in named if len(name) == longest]
    if not named:
        known = {*(name for name, _ in _names(scene)), *ROWS, *TABLES, "wavelength"}
        raise UnknownNameError("part of the scene", family, known)
    if len(named) > 1:
        name, rest = named[0][0], text[longest:]
        ways = " or ".join(f"{family}.{name}{rest}" for _, (family, _) in named)
        raise ArgumentError(f"{text}: {len(named)} parts of the scene are called {name!r}; write {ways}.")
    return named[0][1], text[longest + 1 :].split(".") if len(text) > longest else []


def _names(scene: Scene) -> Iterator[tuple[str, tuple[str, Word]]]:
    """Every name that a part has, with its place."""
    for family in ROWS:
        for i, thing in enumerate(getattr(scene, family)):
            if thing.name:
                yield thing.name, (family, i)
    for family in TABLES:
        yield from ((name, (family, name)) for name in getattr(scene, family))


def _member(scene: Scene, family: str, text: str) -> tuple[tuple[Word, ...], list[str]]:
    """A part by its family and its name, or its number from 0."""
    members = [(name, place) for name, place in _names(scene) if place[0] == family]
    fitting = [(name, place) for name, place in members if text == name or text.startswith(f"{name}.")]
    if fitting:
        name, place = max(fitting, key=lambda one: len(one[0]))
        return place, text[len(name) + 1 :].split(".") if len(text) > len(name) else []
    word, *rest = text.split(".")
    held = getattr(scene, family)
    if word.isdigit() and family in ROWS and int(word) < len(held):
        return (family, int(word)), rest
    numbers = [str(i) for i in range(len(held))] if family in ROWS else []
    raise UnknownNameError(f"part among the {family}", word, [*(name for name, _ in members), *numbers])


def _at(scene: Scene, words: tuple[Word, ...]) -> Any:
    if not words:
        return scene
    family, member = words
    return getattr(scene, str(family))[member]


def _called(scene: Scene, words: tuple[Word, ...], text: str) -> str:
    """What messages call the part."""
    if not words:
        return "the scene"
    family, member = words
    name = member if isinstance(member, str) else getattr(scene, str(family))[member].name
    return str(name) if name and not text.startswith(f"{family}.") else f"{family}.{name or member}"


def _key(part: Description, word: str, told: str) -> str:
    """A key of a part.

    Raises
    ------
    UnknownNameError
        If it has none of this name.
    ArgumentError
        If its shape has.
    """
    names = part.names_by_key()
    known = [key for key, name in names.items() if name not in part.IN_MEMORY]
    if word in known:
        return word
    shape = getattr(part, "shape", None)
    if isinstance(shape, Description) and word in shape.names_by_key():
        raise ArgumentError(f"{told}.{word}: that is a size of its shape; write {told}.shape.{word}.")
    raise UnknownNameError(f"key of {told}", word, known)


def _number_in(row: Sequence[Any], word: str, told: str) -> int:
    if not word.isdigit() or int(word) >= len(row):
        raise ArgumentError(
            f"{told}.{word}: {told} is a row of {len(row)} values; they are numbered from 0 to {len(row) - 1}."
        )
    return int(word)


def _why_not(value: Any, told: str) -> str:
    """Why a value is no number that can be changed, and what to name instead."""
    if value is None:
        return f"{told} is not stated in the scene and has no parts; state it first."
    if isinstance(value, bool):
        return f"{told} is {str(value).lower()}; a sweep goes over numbers."
    if isinstance(value, str):
        return f"{told} is the name {value!r}; a sweep goes over numbers: describe what is named, and name a key of it."
    if isinstance(value, Description):
        keys = [key for key, name in value.names_by_key().items() if name not in value.IN_MEMORY and key != "kind"]
        return f"{told} is no number; name one of its keys: {', '.join(f'{told}.{key}' for key in keys)}."
    if isinstance(value, tuple | list):
        return f"{told} is a row of {len(value)} values; name one, numbered from 0, e.g. {told}.0."
    if isinstance(value, Mapping):
        return f"{told} is a table; name one of its entries: {', '.join(value) or 'it has none'}."
    if isinstance(value, int | float):
        return f"{told} is a number and has no parts."
    return f"{told} is no number."


def _annotation(part: Description, word: str) -> Any:
    field = type(part).model_fields[part.names_by_key()[word]]
    return (field.annotation, *field.metadata)


def _unit(keys: list[str], annotation: Any) -> str:
    """The unit of what the last key holds, by its name or by the limit that all lengths have."""
    key = keys[-1] if keys else ""
    if key in DEGREES:
        return "°"
    for end in (".".join(keys[-2:]), key):
        if end in OTHERS:
            return OTHERS[end]
    return "mm" if key in LENGTHS or repr(Le(LONGEST)) in repr(annotation) else ""


# --- values ------------------------------------------------------------------------------------------------------------

MOST_STEPS = 10_000
"""Of a sweep over all its parameters together."""

ON_THE_GRID = 1e-9
"""Share of a step by which rounding may let the last value miss the end."""


def parse_setting(text: str) -> tuple[str, tuple[float, ...]]:
    """A parameter and its values as the command line spells them: ``path=start:stop:step`` or ``path=a,b,c``.

    The stop is one of the values if whole steps lead there.

    Raises
    ------
    ArgumentError
        If it is neither, a step is 0 or leads away from the stop, or there are more than 10 000 values.

    Examples
    --------
    >>> parse_setting("lens.at.2=5:6:0.5")
    ('lens.at.2', (5.0, 5.5, 6.0))
    >>> parse_setting("lens.shape.radius=5,7.5")
    ('lens.shape.radius', (5.0, 7.5))
    """
    path, equals, values = text.partition("=")
    if not equals or not path.strip() or not values.strip():
        raise ArgumentError(f"{text!r} sets nothing: give PATH=START:STOP:STEP or PATH=A,B,C, e.g. lens.at.2=5:9:0.5.")
    spelt = values.split(":" if ":" in values else ",")
    try:
        numbers = [float(one) for one in spelt]
    except ValueError:
        numbers = []
    if not numbers or not all(map(math.isfinite, numbers)):
        raise ArgumentError(f"{text!r}: {values!r} are no numbers; give START:STOP:STEP or A,B,C, e.g. 5:9:0.5.")
    if ":" not in values:
        return path.strip(), tuple(numbers)
    if len(numbers) != 3:
        raise ArgumentError(f"{text!r}: a range has three numbers, START:STOP:STEP, e.g. 5:9:0.5.")
    return path.strip(), _range(text, *numbers)


def _range(text: str, start: float, stop: float, step: float) -> tuple[float, ...]:
    if step == 0.0:
        raise ArgumentError(f"{text!r}: the step is 0; give one that leads from {start:g} to {stop:g}.")
    if (stop - start) * step < 0.0:
        raise ArgumentError(f"{text!r}: steps of {step:g} lead away from {stop:g}; give {-step:g}.")
    steps = (stop - start) / step
    if not steps < MOST_STEPS:
        raise ArgumentError(f"{text!r}: that is more than {MOST_STEPS:,} values; take larger steps.")
    count = math.floor(steps + ON_THE_GRID) + 1
    # Rounded to the digits that were meant: 5 + 3 · 0.1 is 5.3.
    return tuple(float(f"{start + i * step:.12g}") for i in range(count))
