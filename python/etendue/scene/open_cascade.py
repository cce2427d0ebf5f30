"""Open CASCADE in a process of its own: damaged files crash it, or keep it busy for good, and it prints what it thinks."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import IO, Self, cast

from etendue.errors import FormatError
from etendue.extras import require
from etendue.scene import open_cascade_process
from etendue.scene.open_cascade_process import LENGTH, REQUEST

_ERROR = re.compile(r"\*{3,}\s*ERR\s+(?:StepFile\s*:\s*)?(?:Undefined Parsing:\s*)?(.*?)\s*\*{3,}")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")

DAMAGED = "The file is damaged; export it anew."


class OpenCascade:
    """A STEP file in the process that reads it; it ends with the block.

    Parameters
    ----------
    path : Path
        For messages.
    raw : bytes
        What the file holds.

    Raises
    ------
    MissingLibraryError
        If the library is not installed.

    Examples
    --------
    >>> with OpenCascade(Path("cut.step"), b"ISO-10303-21;HEADER;") as reader:
    ...     reader.triangles(0.1, 0.5)
    Traceback (most recent call last):
    etendue.errors.FormatError: cut.step: STEP: holds no surface that can be read (Line ...). Export ...
    """

    def __init__(self, path: Path, raw: bytes) -> None:
        if find_spec("cascadio") is None:
            require("cascadio")
        self._path, self._raw = path, raw

    def __enter__(self) -> Self:
        self._told = tempfile.TemporaryFile()
        self._process = subprocess.Popen(  # noqa: S603 - this Python, and a file of this package
            [sys.executable, str(open_cascade_process.__file__), json.dumps([entry for entry in sys.path if entry])],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._told,
        )
        self._requests, self._answers = cast("IO[bytes]", self._process.stdin), cast("IO[bytes]", self._process.stdout)
        self._send(LENGTH.pack(len(self._raw)) + self._raw)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.communicate()
        self._told.close()

    def triangles(self, linear: float, angular: float, *, relative: bool = False) -> bytes:
        """Binary glTF of all bodies, in metres.

        Parameters
        ----------
        linear : float
            Distance between surfaces and triangles that is asked for [mm], or as a part of each edge.
        angular : float
            [rad] By which the normal may turn along a triangle.
        relative : bool
            Whether `linear` is a part of each edge.

        Raises
        ------
        FormatError
            If nothing can be read, or the library crashes.
        """
        self._send(REQUEST.pack(linear, angular, relative))
        head = self._answers.read(LENGTH.size)
        length = LENGTH.unpack(head)[0] if len(head) == LENGTH.size else -1
        made = self._answers.read(length) if length > 0 else b""
        if length < 0 or len(made) < length:
            raise FormatError(self._path, "STEP", f"Open CASCADE, which reads it, breaks off{self._words()}", DAMAGED)
        if not made:
            words = f"holds no surface that can be read{self._words()}"
            raise FormatError(self._path, "STEP", words, "Export the bodies anew, as solids.")
        return made

    def _send(self, data: bytes) -> None:
        try:
            self._requests.write(data)
            self._requests.flush()
        except OSError:
            return  # it has ended, which the answer that does not come tells

    def _words(self) -> str:
        """What the library said last of the file."""
        self._told.seek(0)
        text = _COLOUR.sub("", self._told.read().decode("utf-8", "replace"))
        said = _ERROR.findall(text) or [line for line in text.splitlines() if line.strip()]
        return f" ({said[-1].strip()})" if said else ""
