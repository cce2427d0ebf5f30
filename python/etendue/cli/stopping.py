"""Ctrl-C, SIGTERM and SIGHUP: three ways of asking for the same clean end."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Iterator
from types import FrameType

STOPPING = ("SIGINT", "SIGTERM", "SIGHUP")
"""Signals that end a program, by name: not every system has them all."""


class Stop:
    """Which signal asked the program to end, if one did."""

    def __init__(self) -> None:
        self.signal: int | None = None

    @property
    def status(self) -> int:
        """Exit status as shells have it: 128 and the number of the signal, of Ctrl-C if none is known."""
        return 128 + (signal.SIGINT if self.signal is None else self.signal)

    def ask(self, number: int, _frame: FrameType | None) -> None:
        """The handler: what is being done is left as upon Ctrl-C."""
        self.signal = number
        if number != signal.SIGINT and number == getattr(signal, "SIGHUP", None):
            _let_go_of_terminal()
        raise KeyboardInterrupt


@contextlib.contextmanager
def stoppable() -> Iterator[Stop]:
    """Have all signals that end a program end the block as Ctrl-C does.

    A signal that is ignored (`nohup`) stays so.

    Examples
    --------
    >>> with stoppable() as stop:
    ...     try:
    ...         signal.raise_signal(signal.SIGTERM)
    ...     except KeyboardInterrupt:
    ...         stop.status
    143
    """
    stop = Stop()
    numbers = [getattr(signal, name) for name in STOPPING if hasattr(signal, name)]
    before = {n: signal.getsignal(n) for n in numbers if signal.getsignal(n) is not signal.SIG_IGN}
    for number in before:
        signal.signal(number, stop.ask)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _let_go_of_terminal() -> None:
    """Write to nowhere what was to be shown on a terminal that is gone, where it would be an error."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            if os.isatty(stream.fileno()):
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, stream.fileno())
                os.close(nowhere)
