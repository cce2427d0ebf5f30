"""What the verbs share: how arguments are read, progress is shown and results are printed."""

from __future__ import annotations

import contextlib
import io
import json
import math
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer
from rich.console import Console
from rich.text import Text

from etendue.cli.wording import in_options, of_parser, without_caller
from etendue.errors import ArgumentError, SceneError, UnknownNameError
from etendue.quantities.printable import printable

if TYPE_CHECKING:
    from etendue.quantities.ray_stream import Progress as ProgressFunction

# Brackets and colons in the texts of files are brackets and colons, neither markup nor emoji.
output = Console(soft_wrap=True, highlight=False, markup=False, emoji=False)
"""Results, on standard output."""

errors = Console(stderr=True, soft_wrap=True, highlight=False, markup=False, emoji=False)
"""Complaints and progress, on standard error."""


LARGEST_COUNT = 2**63 - 1
"""Of anything that is counted, since files and tables count in 64 bits."""

INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it (128 + SIGINT)."""

MISTAKE = 70
"""Exit status after an error that nobody foresaw (EX_SOFTWARE of sysexits.h)."""


def complain(message: str) -> None:
    """Print one line to standard error, whatever the message holds, in the words of the command line."""
    _print_as_is(in_options(message))


def _print_as_is(message: str) -> None:
    errors.print(Text(printable(message)))


def say(message: str = "") -> None:
    """Print one line to standard output, whatever the message holds, in the words of the command line."""
    output.print(Text(printable(in_options(message))))


def complain_of(error: Exception) -> None:
    """Print an error to standard error: one line, or one for every mistake of a scene."""
    if isinstance(error, OSError) and error.filename:
        complain(f"error: {error.filename}: {error.strerror}")
        return
    first, *more = error.lines if isinstance(error, SceneError) else (str(error),)
    complain(f"error: {without_caller(first)}")
    for line in more:
        complain(f"  {line}")


def complain_of_mistake(error: BaseException) -> None:
    """Print the traceback of an error that nobody foresaw to standard error; texts of files in it are shown as such."""
    seen: list[BaseException] = []
    link: BaseException | None = error
    while link is not None and link not in seen:
        seen.append(link)
        link = link.__cause__ or (None if link.__suppress_context__ else link.__context__)
    for link in reversed(seen):
        _print_as_is("Traceback (most recent call last):")
        for frame in traceback.extract_tb(link.__traceback__):
            _print_as_is(f'  File "{frame.filename}", line {frame.lineno}, in {frame.name}')
            if frame.line:
                _print_as_is(f"    {frame.line}")
        _print_as_is(f"{type(link).__qualname__}: {link}")
        for note in getattr(link, "__notes__", ()):
            _print_as_is(f"  {note}")
    complain("error: this is a mistake in etendue, not in what it was given; please report the lines above")


def complain_of_usage(error: typer.BadParameter) -> None:
    """Print what the parser has to say about arguments, with the usage of the verb, to standard error."""
    told, message = io.StringIO(), error.format_message()
    error.show(told)
    for line in told.getvalue().replace(message, printable(of_parser(message))).splitlines():
        complain(line)
    advice = INSTEAD.get(str(getattr(error, "option_name", "")))
    if advice:
        complain(f"give {advice}")


INSTEAD = {
    "--theta": "both angles of the observer together: --observer THETA,PHI, e.g. --observer 30,0",
    "--phi": "both angles of the observer together: --observer THETA,PHI, e.g. --observer 30,0",
    "--width": "width and height of the screen together: --size W,H, e.g. --size 25,25",
    "--height": "width and height of the screen together: --size W,H, e.g. --size 25,25",
    "--log": "the scale of the colours: --scale log",
    "--resolution": "columns and rows: --pixels C,R, e.g. --pixels 128,128",
}
"""What is meant by options that do not exist."""


def spell_out_unknown_letters() -> None:
    r"""Let a terminal or file that has no θ or ² show ``\u03b8`` or ``\xb2``: an answer is worth more than its letters."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def print_json(data: Any) -> None:
    """Print one JSON document; NaN, which JSON does not have, becomes null."""
    # JSON has an escape of its own for letters that the output does not have, and for those that a terminal would obey.
    narrow = not (sys.stdout.encoding or "").lower().startswith("utf")
    text = json.dumps(_plain(data), ensure_ascii=narrow, indent=2, allow_nan=False)
    sys.stdout.write("".join(_for_json(letter) for letter in text) + "\n")


def _for_json(letter: str) -> str:
    """A letter of a JSON document as it may be shown; JSON's escapes count in units of UTF-16."""
    if letter == "\n" or printable(letter) == letter:
        return letter
    units = letter.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[at : at + 2].hex()}" for at in range(0, len(units), 2))


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {str(k): _plain(v) for k, v in data.items()}
    if isinstance(data, list | tuple):
        return [_plain(v) for v in data]
    # Help and mistakes are told without numpy; where nobody has imported it, nothing comes from it.
    if (numpy := sys.modules.get("numpy")) and isinstance(data, numpy.generic):
        return _plain(data.item())
    if isinstance(data, float) and not math.isfinite(data):
        return None
    if data is None or isinstance(data, str | int | float | bool):
        return data
    return str(data)


def half_width(degrees: float) -> str:
    """The full width of a lobe at half of its maximum, if the scan reaches that.

    Examples
    --------
    >>> half_width(1.5284), half_width(math.nan)
    ('full width at half maximum 1.528°', 'full width at half maximum beyond the scan')
    """
    return f"full width at half maximum {f'{degrees:.3f}°' if math.isfinite(degrees) else 'beyond the scan'}"


@contextlib.contextmanager
def progress_bar(title: str, total: int) -> Iterator[ProgressFunction | None]:
    """A bar over `total` rays while the block runs; nothing when standard error is no terminal."""
    if not errors.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=errors, transient=True) as bar:
        task = bar.add_task(printable(title), total=total)
        yield lambda done: bar.update(task, completed=done)


def numbers(text: str, count: int, option: str, example: str) -> tuple[float, ...]:
    """Comma-separated numbers of an option, e.g. ``30,0``.

    Raises
    ------
    typer.BadParameter
        If there are not `count` of them, or one is no number.
    """
    parts = text.split(",")
    try:
        values = tuple(float(part) for part in parts)
    except ValueError:
        values = ()
    if len(values) != count:
        raise typer.BadParameter(f"{text!r}: give {count} numbers separated by commas, e.g. {option} {example}")
    return values


def angles(texts: list[str] | None) -> list[tuple[float, ...]]:
    """θ and φ of each observer that is stated [°].

    Raises
    ------
    typer.BadParameter
        If there is none, or one is no pair of numbers.
    """
    if not texts:
        raise typer.BadParameter("give at least one, e.g. --observer 30,0", param_hint="--observer")
    return [numbers(text, 2, "--observer", "30,0") for text in texts]


def both_sides(text: str) -> str:
    """Width and height of an option: one number is a square.

    Examples
    --------
    >>> both_sides("25"), both_sides("25,10")
    ('25,25', '25,10')
    """
    return text if "," in text else f"{text},{text}"


def whole_numbers(text: str, count: int, option: str, example: str) -> tuple[int, ...]:
    """Like `numbers`, for counts: a fraction is refused, never cut off.

    Raises
    ------
    typer.BadParameter
        If there are not `count` of them, or one is no whole number.
    """
    values = numbers(text, count, option, example)
    if not all(value.is_integer() for value in values):
        raise typer.BadParameter(f"{text!r}: give {count} whole numbers, e.g. {option} {example}")
    return tuple(int(value) for value in values)


def count(fewest: int = 1) -> Callable[[str | int], int]:
    """The `parser` of an option that counts something: digits, a power of ten as in ``1e8``, or ``10k``, ``1M``, ``2G``.

    Parameters
    ----------
    fewest : int
        The most is 2^63 - 1.

    Returns
    -------
    callable
        From the text to the number. Raises `typer.BadParameter` for a fraction, or a number out of that range.

    Examples
    --------
    >>> count()("1e8"), count()("12345678901234567"), count()("2.5M")
    (100000000, 12345678901234567, 2500000)
    """

    def parse(text: str | int) -> int:
        try:
            # Digits stand for themselves, however many; a float has only sixteen of them.
            value = int(text)
        except ValueError:
            value = _from_float(text)
        if not fewest <= value <= LARGEST_COUNT:
            raise typer.BadParameter(f"{text!r}: give a whole number from {fewest} to 2^63 - 1")
        return value

    return parse


def _from_float(text: str | int) -> int:
    digits = str(text).strip()
    factor = THOUSANDS.get(digits[-1:], 1.0)
    try:
        rounded = float(digits if factor == 1.0 else digits[:-1]) * factor
    except ValueError:
        rounded = math.nan
    if not rounded.is_integer():
        raise typer.BadParameter(f"{text!r}: give a whole number, e.g. 20000, 1e8 or 100M")
    return int(rounded)


THOUSANDS = {"k": 1e3, "K": 1e3, "M": 1e6, "G": 1e9}
"""Letters after a count."""


Name = TypeVar("Name", bound=str)


def one_of(value: str, known: Iterable[Name], option: str) -> Name:
    """The value of an option that has a few.

    Raises
    ------
    typer.BadParameter
        If it is none of them; suggests the nearest.
    """
    known = list(known)
    for name in known:
        if name.lower() == value.strip().lower():
            return name
    raise typer.BadParameter(str(UnknownNameError(f"value of {option}", value, known)))


def check_folder(path: Path) -> None:
    """Refuse, before any work is done, an output whose folder does not exist.

    Raises
    ------
    ArgumentError
        If so.
    """
    if not path.parent.is_dir():
        raise ArgumentError(f"{path}: the folder {path.parent} does not exist; create it first.")


def check_outputs(paths: list[Path], extensions: tuple[str, ...]) -> None:
    """Refuse, before any work is done, outputs that could not be written afterwards.

    Raises
    ------
    ArgumentError
        If an extension is unknown or a folder does not exist.
    """
    for path in paths:
        if path.suffix.lower() not in extensions:
            raise ArgumentError(
                f"{path}: the extension {path.suffix!r} is none of the known ones: {', '.join(extensions)}."
            )
        check_folder(path)
