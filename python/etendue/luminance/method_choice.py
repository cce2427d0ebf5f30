"""The choice of a method: which one is meant by its name and options for a source, and what does not go together.

`luminance_map` and the command line both ask here, so that they accept and refuse the same.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from etendue.errors import ArgumentError, UnknownNameError
from etendue.luminance.methods import METHOD_NAMES, METHODS, AnyMethod, Method, methods_with, option_names
from etendue.luminance.source_kinds import SourceKind


@dataclasses.dataclass(frozen=True)
class Spelling:
    """How messages call options and methods: as Python or as the command line does.

    Parameters
    ----------
    option : callable
        From the name of an option to what the user wrote.
    method : callable
        From a method to what the user wrote.
    """

    option: Callable[[str], str]
    method: Callable[[type[Method]], str]


PYTHON = Spelling(option=str, method=lambda kind: kind.__name__)


def mismatch(
    method: AnyMethod | str, stated: Mapping[str, object], source: SourceKind, spelling: Spelling = PYTHON
) -> str | None:
    """What does not go together of a method, options that are stated beside it, and a source; None if all does.

    Parameters
    ----------
    method : Cone, FromField, PathTracing or str
        The method, or its shorthand; ``"auto"``: the one that has the options, or that suits the source.
    stated : mapping
        Options by name, without those that were left out.
    source : SourceKind
        What is looked at.
    spelling : Spelling
        How options and methods are called.

    Returns
    -------
    str or None
        A sentence that names the method which has the option.

    Raises
    ------
    UnknownNameError
        If there is no such method, or no method has an option.

    Examples
    --------
    >>> from etendue.luminance.source_kinds import RAYS, SCENE
    >>> mismatch("auto", {"acceptance": 3}, RAYS)
    >>> mismatch("lightfield", {"acceptance": 3}, RAYS)
    'acceptance: FromField has no such option (it has surface, samples); Cone has it. Leave it out.'
    >>> mismatch("auto", {"acceptance": 3}, SCENE)
    'acceptance: an option of Cone, which is for rays, and the source is a scene; leave it out.'
    """
    if isinstance(method, str) and method not in METHOD_NAMES:
        raise UnknownNameError("method", method, METHOD_NAMES)
    given: Any = method
    if not isinstance(given, str | Method):
        found = f"the class {given.__name__}, not an object of it" if isinstance(given, type) else repr(given)
        choices = ", ".join(f"{kind.__name__}(…)" for kind in METHODS.values())
        raise ArgumentError(f"method is {found}; give {choices}, or a name: {', '.join(METHOD_NAMES)}.")
    for name in stated:
        if not methods_with(name):
            raise UnknownNameError("option", name, [n for kind in METHODS.values() for n in option_names(kind)])
    if isinstance(method, Method):
        return _beside(method, stated) or _unsuitable(type(method), source, spelling) or _idle(method, source)
    if method == "auto":
        return _of_several(stated, source, spelling)
    kind = METHODS[method]
    return (
        _unsuitable(kind, source, spelling)
        or _foreign(kind, stated, spelling)
        or _meaningless(stated, source, spelling)
    )


def choose_method(method: AnyMethod | str, stated: Mapping[str, Any], source: SourceKind) -> AnyMethod | None:
    """The method with its options.

    Parameters
    ----------
    method, stated, source
        As of `mismatch`.

    Returns
    -------
    Cone, FromField, PathTracing or None
        One of `source.methods`; None: scatter events by themselves.

    Raises
    ------
    ArgumentError
        If something does not go together, or an option is out of its domain.
    UnknownNameError
        As `mismatch`.

    Examples
    --------
    >>> from etendue.luminance.source_kinds import EVENTS, INDEX, RAYS
    >>> choose_method("auto", {"acceptance": 3}, RAYS)
    Cone(acceptance=3, observer_radius=None)
    >>> choose_method("auto", {}, INDEX), choose_method("auto", {}, EVENTS)
    (Cone(acceptance=None, observer_radius=None), None)
    """
    complaint = mismatch(method, stated, source)
    if complaint is not None:
        raise ArgumentError(complaint)
    if not isinstance(method, str):
        return method
    if method != "auto":
        return METHODS[method](**stated)
    if source.only_if is not None and not stated:
        return None
    (kind, *_) = _having(stated, source)
    return kind(**stated)


def _having(stated: Mapping[str, object], source: SourceKind) -> list[type[AnyMethod]]:
    """The methods for a source that have all the options."""
    return [kind for kind in source.methods if set(stated) <= set(option_names(kind))]


def _either(kinds: list[type[Method]] | tuple[type[Method], ...], spelling: Spelling) -> str:
    return " or ".join(spelling.method(kind) for kind in kinds)


def _listed(names: list[str], spelling: Spelling) -> str:
    return ", ".join(spelling.option(name) for name in names)


def _beside(method: Method, stated: Mapping[str, object]) -> str | None:
    """What is wrong with options beside a method that holds its own; only Python has such methods."""
    if not stated:
        return None
    kind = type(method)
    own = [name for name in stated if name in option_names(kind)]
    if own:
        return (
            f"{', '.join(own)}: the method {method!r} holds its options; state it there, or give method={kind.NAME!r}."
        )
    return _foreign(kind, stated, PYTHON)


def _foreign(kind: type[Method], stated: Mapping[str, object], spelling: Spelling) -> str | None:
    """Options that another method has."""
    foreign = [name for name in stated if name not in option_names(kind)]
    if not foreign:
        return None
    return (
        f"{_listed(foreign, spelling)}: {spelling.method(kind)} has no such option "
        f"(it has {_listed(list(option_names(kind)), spelling)}); {_either(methods_with(foreign[0]), spelling)} has it. "
        "Leave it out."
    )


def _unsuitable(kind: type[Method], source: SourceKind, spelling: Spelling) -> str | None:
    """A method that does not take the source."""
    if kind in source.methods:
        return None
    return (
        f"{spelling.method(kind)} is for {kind.SOURCES}, and the source is {source.words}; "
        f"leave it out, or give {_either(source.methods, spelling)}."
    )


def _meaningless(stated: Mapping[str, object], source: SourceKind, spelling: Spelling) -> str | None:
    """Options that mean nothing for the source."""
    idle = [name for name in stated if name in source.without]
    return f"{_listed(idle, spelling)}: {source.without[idle[0]]}; leave it out." if idle else None


def _idle(method: Method, source: SourceKind) -> str | None:
    """Options of an object, other than their defaults, that mean nothing for the source."""
    plain = type(method)()
    given = {name: getattr(method, name) for name in option_names(type(method))}
    return _meaningless({n: value for n, value in given.items() if value != getattr(plain, n)}, source, PYTHON)


def _of_several(stated: Mapping[str, object], source: SourceKind, spelling: Spelling) -> str | None:
    """What is wrong with options if they tell the method."""
    strangers = [name for name in stated if not set(methods_with(name)) & set(source.methods)]
    if strangers:
        (owner, *_) = methods_with(strangers[0])
        return (
            f"{_listed(strangers, spelling)}: an option of {spelling.method(owner)}, which is for {owner.SOURCES}, "
            f"and the source is {source.words}; leave it out."
        )
    if not _having(stated, source):
        shares = [(kind, [name for name in stated if name in option_names(kind)]) for kind in source.methods]
        told = ", ".join(f"{_listed(names, spelling)} of {spelling.method(kind)}" for kind, names in shares if names)
        return f"{told}: no method has options of both; leave those of one out."
    if source.only_if is not None and stated and source.only_if not in stated:
        needed = spelling.option(source.only_if)
        lines = f"{_listed(list(stated), spelling)}: for lines of sight; give {needed} too, or leave it out."
        return _meaningless(stated, source, spelling) or lines
    return _meaningless(stated, source, spelling)
