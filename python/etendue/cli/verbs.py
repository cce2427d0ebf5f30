"""The verbs of the program. A verb is imported when it is called: the list of all of them, with what they do, needs none."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import re
from importlib.machinery import SourceFileLoader
from typing import Any

import typer
from typer.core import TyperGroup

from etendue.cli.guard import guarded
from etendue.cli.stated import Verb

VERBS = {
    "demo": "etendue.cli.demo:demo",
    "info": "etendue.cli.info:info",
    "convert": "etendue.cli.convert:convert",
    "fit": "etendue.cli.fit:fit",
    "luminance": "etendue.cli.luminance:luminance",
    "view": "etendue.cli.view:view",
    "sample": "etendue.cli.sample:sample",
    "intensity": "etendue.cli.intensity:intensity",
    "draw": "etendue.cli.draw:draw",
    "plot": "etendue.cli.plot:plot",
    "report": "etendue.cli.report:report",
    "trace": "etendue.cli.trace:trace",
    "sweep": "etendue.cli.sweep:sweep",
    "patches": "etendue.cli.patches:patches",
    "filter": "etendue.cli.filter_:filter_",
    "compare": "etendue.cli.compare:compare",
    "goniometer": "etendue.cli.goniometer:goniometer",
    "deconvolve": "etendue.cli.deconvolve:deconvolve",
    "goniophotometer": "etendue.cli.goniophotometer:goniophotometer",
    "cache": "etendue.cli.cache:cache",
}
"""By name, the module and the function."""

FAMILIES_OF_VERBS = {"bsdf": "etendue.cli.bsdf:app"}
"""Verbs of two words, by the first: the module and its program."""


def command_of(name: str) -> Any:
    """The command of a verb, or of a family of verbs, with its parameters.

    Examples
    --------
    >>> [parameter.name for parameter in command_of("compare").params][:2]
    ['test', 'reference']
    """
    if name in FAMILIES_OF_VERBS:
        found = typer.main.get_command(_found(FAMILIES_OF_VERBS[name]))
    else:
        alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        alone.command(name, cls=Verb)(guarded(name, _found(VERBS[name])))
        found = typer.main.get_command(alone)
    found.name = name
    return found


def _found(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


def summary(place: str) -> str:
    """What a verb does: the docstring of its function, or the `help` of its family, read from the source."""
    module, _, name = place.partition(":")
    spec = importlib.util.find_spec(module)
    assert spec is not None  # noqa: S101 - the modules are ours
    assert isinstance(spec.loader, SourceFileLoader)  # noqa: S101
    text = spec.loader.get_source(module) or ""
    of_function = rf'^def {name}\(.*?\) -> None:\n    """(.*?)"""'
    of_family = rf'^{name} = typer\.Typer\(\s*help="(.*?)"'
    found = re.search(of_function, text, re.DOTALL | re.MULTILINE) or re.search(of_family, text, re.MULTILINE)
    assert found is not None, f"{place} does not say what it does"  # noqa: S101 - a test asks every verb
    return inspect.cleandoc(found[1])


WITH_COMMAS = ("--observer", "--size", "--pixels", "--target", "--up", "--region")
"""Options of several numbers, between which commas stand."""


def with_commas(words: list[str]) -> list[str]:
    """The same with commas in place of blanks between the numbers of an option.

    Examples
    --------
    >>> with_commas(["led.h5", "--observer", "30", "0", "--size", "4", "--seed", "1", "2"])
    ['led.h5', '--observer', '30,0', '--size', '4', '--seed', '1', '2']
    """
    found: list[str] = []
    joining = False
    for before, word in zip(["", *words], words, strict=False):
        if joining and _is_number(before) and _is_number(word):
            found[-1] += f",{word}"
        else:
            joining = word in WITH_COMMAS or (joining and before in WITH_COMMAS)
            found.append(word)
    return found


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


class VerbGroup(TyperGroup):
    """Lists the verbs by their names and summaries, and imports the one that is called."""

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """The verb itself in place of its line in the list."""
        name, line, rest = super().resolve_command(ctx, args)
        return name, line if name is None else command_of(name), with_commas(rest)


def add_verbs(app: typer.Typer) -> None:
    """Add a line for each verb to a program of the class `VerbGroup`."""
    for name, place in {**VERBS, **FAMILIES_OF_VERBS}.items():
        app.command(name, help=summary(place))(_line)


def _line() -> None:
    """Stand for a verb in the list of verbs."""
