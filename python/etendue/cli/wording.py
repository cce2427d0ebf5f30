"""Messages in the words of the command line: options where Python has names of arguments."""

from __future__ import annotations

import contextvars
import re
from collections.abc import Iterable

_arguments: contextvars.ContextVar[frozenset[str]] = contextvars.ContextVar("arguments", default=frozenset())

CALLERS = frozenset({
    "beam_angle", "combine_maps", "compare_intensities", "cross_section", "cut_off_angle", "denoise_map", "draw_scene",
    "FieldRays", "filter_map", "IlluminanceMap", "luminance_map", "LuminanceMap", "plot_animation",
    "plot_cross_sections", "plot_sweep", "plot_threshold_sweep", "propagated_to_plane", "propagated_to_sphere",
    "RaySet", "read_rays", "region_statistics", "report_source", "RingSource", "smooth_counts", "SweepTable",
    "threshold_sweep", "zonal_flux",
})  # fmt: skip
"""Functions and classes of Python that messages begin with, but for those whose name is a plain word."""

PARSER = (
    (re.compile(r"Input should be a valid integer, .*"), "give a whole number in digits, e.g. 20"),
    (re.compile(r"Input should be a valid number, .*"), "give a number, e.g. 12.5"),
    (re.compile(r"Input should be greater than or equal to (\S+)"), r"give \1 or more"),
    (re.compile(r"Input should be less than or equal to (\S+)"), r"give \1 at most"),
)
"""What the parser says of numbers, and what is said instead."""


def speak_of(arguments: Iterable[str]) -> None:
    """From here on, messages are those of a verb with these arguments, as Python spells them."""
    _arguments.set(frozenset(arguments))


def in_options(message: str) -> str:
    """A message for somebody at the command line.

    Only names of arguments that no word of a language could be are replaced: with an underscore, or with a value.

    Examples
    --------
    >>> speak_of(["rays_per_pixel", "plane", "ignore_geometry"])
    >>> print(in_options("leave rays_per_pixel out, or take plane='view' or ignore_geometry=True."))
    leave --rays-per-pixel out, or take --plane view or --ignore-geometry.
    >>> print(in_options("a.rays_per_pixel, plane:z=1"))
    a.rays_per_pixel, plane:z=1
    >>> speak_of([])
    """
    arguments = _arguments.get()
    if not arguments:
        return message
    names = "|".join(map(re.escape, sorted(arguments, key=len, reverse=True)))
    return re.sub(
        rf"(?<![\w.:/,=-])({names})(?:=(?:'([^']*)'|(True|-?\d[\d.]*\b))|(?![\w:/=]|\.\w))", _as_option, message
    )


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")


def _as_option(match: re.Match[str]) -> str:
    name, word, value = match[1], match[2], match[3]
    if word is None and value is None and "_" not in name:
        return match[0]
    option = _option(name)
    given = word if word is not None else None if value == "True" else value
    return option if given is None else f"{option} {given}"


def without_caller(message: str) -> str:
    """A message without the name of the function or class of Python that it begins with, if that is no plain word.

    A message that begins with an argument and its value names the option.

    Examples
    --------
    >>> print(without_caller("draw_scene: 4 sections; give 1 to 3."))
    4 sections; give 1 to 3.
    >>> print(without_caller("Observer: theta is 200°"), without_caller("lamp.ies: it is empty"), sep="; ")
    Observer: theta is 200°; lamp.ies: it is empty
    """
    caller, _, rest = message.partition(": ")
    message = rest if caller in CALLERS else message
    argument = re.match(r"(\w+) is (?:'[^']*'|-?\d\S*|nan|-?inf)", message)
    if argument is None or argument[1] not in _arguments.get():
        return message
    return _option(argument[1]) + message[argument.end(1) :]


def of_parser(message: str) -> str:
    """What the parser of arguments says, in words that say what to give.

    Examples
    --------
    >>> print(of_parser("Invalid value for '--threads': Input should be greater than or equal to 1"))
    Invalid value for '--threads': give 1 or more
    """
    for pattern, words in PARSER:
        message = pattern.sub(words, message)
    return message
