"""From pydantic's findings to sentences: where in the scene, what was found, and what it should be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError

from etendue.errors import SceneError

BY_NAME, DESCRIBED, NUMBER, TABLE = "(name)", "(description)", "(number)", "(table)"
"""What may stand in one place, where two different things may; pydantic puts these into its places, we leave them out."""

LONGEST = 60
"""Letters of a wrong value that a message repeats."""


def mistakes_of(error: ValidationError, data: Any) -> list[tuple[str, str]]:
    """All findings of a validation: the place of each, and a sentence.

    Parameters
    ----------
    error : ValidationError
        Of pydantic.
    data : object
        What was validated; it tells the names of sources, solids and so on.
    """
    mistakes: list[tuple[str, str]] = []
    for details in error.errors():
        # A row with a wrong value is too short for pydantic, which leaves that one out; it is told by itself.
        if details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]:
            continue
        place = place_of(details["loc"], data)
        cause = details.get("ctx", {}).get("error")
        if isinstance(cause, SceneError):
            mistakes += [(join(place, inner), text) for inner, text in cause.mistakes]
        else:
            mistakes.append((place, sentence(details)))
    return mistakes


def join(place: str, inner: str) -> str:
    """A place within a place.

    Examples
    --------
    >>> join("solids[0]", "shape"), join('solids[1] "lens"', "shape")
    ('solids[0].shape', 'solids[1] "lens": shape')
    """
    if not place or not inner or inner.startswith("["):
        return place + inner
    return f"{place}: {inner}" if place.endswith('"') else f"{place}.{inner}"


def place_of(location: Sequence[int | str], data: Any) -> str:
    """Where a finding is, as one finds it in the file.

    Examples
    --------
    >>> scene = {"solids": [{"name": "lens", "shape": {"kind": "ball", "radius": -1}}]}
    >>> place_of(("solids", 0, "shape", "ball", "radius"), scene)
    'solids[0] "lens": shape.radius'
    """
    text = ""
    for element in location:
        if isinstance(element, int):
            text += f"[{element}]"
            data = data[element] if isinstance(data, list | tuple) and element < len(data) else None
            name = _get(data, "name")
            text += f' "{name}": ' if isinstance(name, str) and name else ""
        elif not _is_tag(element, data):
            text += element if not text or text.endswith(": ") else f".{element}"
            data = _get(data, element)
    return text.removesuffix(": ")


def _is_tag(element: str, data: Any) -> bool:
    """Whether an element is the kind that was chosen at a place, and no key."""
    return element in (BY_NAME, DESCRIBED, NUMBER, TABLE) or (
        _get(data, "kind") == element and _get(data, element) is None
    )


def _get(data: Any, key: str) -> Any:
    if isinstance(data, Mapping):
        return data.get(key)
    return getattr(data, key, None) if isinstance(data, BaseModel) else None


def sentence(details: Mapping[str, Any]) -> str:
    """What was found and what is asked for."""
    context = details.get("ctx", {})
    found = shown(details["input"])
    match details["type"]:
        case "missing":
            return "is missing"
        case "greater_than":
            return f"is {found}; it must be greater than {context['gt']:g}"
        case "greater_than_equal":
            return f"is {found}; it must be at least {context['ge']:g}"
        case "less_than_equal":
            return f"is {found}; it must be at most {context['le']:g}"
        case "too_short":
            return f"has {len(details['input'])} values; it must have {context['min_length']} at least"
        case "too_long":
            return f"has more than {context['max_length']:,} values, which is the most"
        case "finite_number":
            return f"is {found}; it must be finite"
        case "unknown_kind":
            return str(details["msg"])
        case "value_error" | "assertion_error":
            text = str(context.get("error", details["msg"]))
            return f"is {found}, {text}" if text.startswith("not a ") else text
        case _:
            return f"is {found}: {details['msg'][:1].lower()}{details['msg'][1:]}"


def shown(value: Any) -> str:
    """A wrong value as messages repeat it.

    Examples
    --------
    >>> shown(2.0), shown("front")
    ('2', "'front'")
    """
    # Whole numbers are floats by now, whichever way they were written.
    try:
        text = str(int(value)) if isinstance(value, float) and value.is_integer() and abs(value) < 1e15 else repr(value)
    except ValueError:
        # Python spells out no whole number of more than some 4000 digits.
        text = "a whole number of thousands of digits"
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"
