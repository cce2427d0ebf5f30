"""Several outputs of one verb: one that cannot be written does not take the others with it, nor what was computed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from etendue.cli.terminal import complain
from etendue.errors import EtendueError


class Writing:
    """Outputs as they are written, one after the other.

    Attributes
    ----------
    done : list of Path
        What was written.
    losses : list of str
        What the formats could not express, each with its file.

    Examples
    --------
    >>> from etendue.errors import ArgumentError
    >>> def refused(path):
    ...     raise ArgumentError("this format has no room for it.")
    >>> writing = Writing()
    >>> for name, write in (("a.ldt", refused), ("b.ies", lambda path: ["angles were rounded"])):
    ...     writing.write(Path(name), write)
    >>> [path.name for path in writing.done], writing.losses
    (['b.ies'], ['b.ies: angles were rounded'])
    >>> writing.finish()
    Traceback (most recent call last):
    etendue.errors.ArgumentError: this format has no room for it.
    """

    def __init__(self) -> None:
        self.done: list[Path] = []
        self.losses: list[str] = []
        self._failed: list[tuple[Path, Exception]] = []

    def write(self, path: Path, write: Callable[[Path], Iterable[str] | None]) -> None:
        """Write one output; what cannot be written is told when all others are."""
        try:
            told = write(path)
        except (EtendueError, OSError) as error:
            self._failed.append((path, error))
            return
        self.done.append(path)
        self.losses += [f"{path}: {note}" for note in told or ()]

    def finish(self) -> None:
        """Tell which outputs were not written, and why.

        Raises
        ------
        EtendueError, OSError
            The first mistake, if there is one.
        """
        for path, error in self._failed[1:]:
            complain(f"{path}: not written: {error}")
        if self._failed:
            path, error = self._failed[0]
            complain(f"{path}: not written:")
            raise error
