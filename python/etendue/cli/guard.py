"""What every verb does alike: streams as inputs, outputs that are no inputs, words when it is stopped or out of memory."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from etendue.cli.terminal import complain
from etendue.cli.wording import speak_of
from etendue.errors import ArgumentError, MemoryLimitError
from etendue.extras import require_for
from etendue.formats.input import is_stream, stream_in_file
from etendue.formats.output import require_writable

OUTPUTS = ("output", "report", "picture", "section_output")
"""Names of parameters that are paths to be written; all other paths are read."""

GOES_ON = "resume"
"""The parameter that may name the file to be written: what is gone on from."""


def guarded(name: str, verb: Callable[..., None]) -> Callable[..., None]:
    """A verb with all that."""

    @functools.wraps(verb)
    def run(**values: Any) -> None:
        speak_of(values)
        inputs = {key: _paths(value) for key, value in values.items() if key not in OUTPUTS}
        outputs = [path for key, value in values.items() if key in OUTPUTS for path in _paths(value)]
        require_apart([path for key, paths in inputs.items() if key != GOES_ON for path in paths], outputs)
        if name != "patches":  # whose output is a folder
            for path in outputs:
                require_writable(path)
                require_for(path)
        read = [path for paths in inputs.values() for path in paths]
        try:
            with contextlib.ExitStack() as streams:
                for key, paths in inputs.items():
                    if any(is_stream(path) for path in paths):
                        opened = [streams.enter_context(stream_in_file(p)) if is_stream(p) else p for p in paths]
                        values[key] = opened if isinstance(values[key], list) else opened[0]
                verb(**values)
        except KeyboardInterrupt:
            complain(f"`etendue {name}` cannot go on from where it was stopped; started again, it begins anew")
            raise
        except MemoryLimitError:
            raise
        except MemoryError as error:
            place = ", ".join(map(str, read)) or f"etendue {name}"
            raise MemoryLimitError(
                f"{place}: there is not enough memory: {error or 'the system gives no more'}. "
                "Ask for fewer pixels, rays or cells, or give the program more memory."
            ) from error

    return run


def require_apart(inputs: list[Path], outputs: list[Path]) -> None:
    """Refuse, before any work is done, to write over what is read, under whatever name.

    Raises
    ------
    ArgumentError
        If an output is one of the inputs.
    """
    for output in outputs:
        for path in inputs:
            if _same(path, output):
                also = "" if path == output else f" ({path})"
                raise ArgumentError(f"{output}: this is also an input{also}, which would be lost. Give another name.")


def _same(path: Path, other: Path) -> bool:
    with contextlib.suppress(OSError):
        return path.samefile(other)
    return False


def _paths(value: Any) -> list[Path]:
    return list(_flat(value))


def _flat(value: Any) -> Iterator[Path]:
    if isinstance(value, Path):
        yield value
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _flat(part)
