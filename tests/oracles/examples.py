"""Running the examples of the project in this process: one of its own takes two seconds of processor time to begin."""

from __future__ import annotations

import contextlib
import io
import runpy
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from unittest.mock import patch

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def run_example(name: str, arguments: Sequence[str]) -> str:
    """Do in the working folder what ``python examples/NAME ARGUMENTS`` does there; what it prints."""
    program = str(EXAMPLES / name)
    printed = io.StringIO()
    with (
        patch.object(sys, "argv", [program, *arguments]),
        patch.object(sys, "path", [str(EXAMPLES), *sys.path]),
        contextlib.redirect_stdout(printed),
        warnings.catch_warnings(),
    ):
        runpy.run_path(program, run_name="__main__")
    return printed.getvalue()
