"""Running the blocks of a page."""

from __future__ import annotations

import contextlib
import doctest
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import warnings
from pathlib import Path
from typing import Any
from unittest.mock import patch

import etendue as et
from etendue.cli import main
from etendue.scene import compile_scene
from oracles.examples import run_example

from docs.pages import Block, blocks, name_of

DOCTEST_FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE

ENVIRONMENT = {"COLUMNS": "120", "NO_COLOR": "1", "PYTHONUTF8": "1"}
"""Of a command."""


def run_page(page: Path) -> None:
    """Run the blocks of a page in order, in one namespace and in the working folder, and compare what they print."""
    names: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(page):
        if block.language == "python":
            run_python(block, name_of(page), names)
        elif block.language == "console":
            run_console(block, name_of(page))
        elif block.language == "toml":
            compile_toml(block, name_of(page))


def compile_toml(block: Block, page: str) -> None:
    """Keep a scene under the name in its first line, for the blocks that follow, and compile it."""
    name = re.fullmatch(r"# (\w+\.toml)", block.text.splitlines()[0])
    assert name, f"{page}:{block.line}: the first line of a scene is a remark with the name of its file"
    Path(name[1]).write_text(block.text, encoding="utf-8")
    compile_scene(et.Scene.load(name[1]))


def run_python(block: Block, page: str, names: dict[str, Any]) -> None:
    """Run a block as a program, or as an interactive session if it shows one."""
    if not block.text.lstrip().startswith(">>>"):
        # Lines are moved to where they stand in the page, so that a traceback points there.
        exec(compile("\n" * (block.line - 1) + block.text, page, "exec"), names)  # noqa: S102
        return
    session = doctest.DocTestParser().get_doctest(block.text, names, page, page, block.line - 1)
    session.globs = names
    report: list[str] = []
    doctest.DocTestRunner(optionflags=DOCTEST_FLAGS).run(session, out=report.append, clear_globs=False)
    assert not report, "".join(report)


def run_console(block: Block, page: str) -> None:
    """Run each ``$ etendue …`` or ``$ python examples/…``; what it prints must be the lines below, if there are any."""
    commands = re.split(r"^\$ ", block.text.replace("\\\n", " "), flags=re.MULTILINE)
    assert not commands[0].strip(), f"{page}:{block.line}: a console block begins with $"
    for text in commands[1:]:
        command, _, expected = text.partition("\n")
        status, printed = run_command(shlex.split(command))
        place = f"{page}:{block.line}: {command}"
        assert status == 0, f"{place}\n{printed}"
        agrees = doctest.OutputChecker().check_output(expected, printed, DOCTEST_FLAGS)
        assert agrees or not expected.strip(), f"{place}\nprinted:\n{printed}\nshown:\n{expected}"


def run_command(command: list[str]) -> tuple[int, str]:
    """Exit status of a command line, and what it prints: étendue, or an example of the project with this Python."""
    name, *arguments = command
    with patch.dict(os.environ, ENVIRONMENT):
        if name == "etendue":
            return run_here(arguments)
        assert name == "python", f"{name!r} is not étendue's command"
        assert arguments[0].startswith("examples/"), f"{arguments[0]!r} is no example"
        return 0, run_example(arguments[0].removeprefix("examples/"), arguments[1:])


def run_apart(arguments: list[str]) -> tuple[int, str]:
    """Start a program."""
    done = subprocess.run(arguments, capture_output=True, encoding="utf-8", timeout=200, check=False)
    return done.returncode, done.stderr + done.stdout


def run_here(arguments: list[str]) -> tuple[int, str]:
    """Do in this process what the command étendue does: a process of its own takes a second before it begins."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        warnings.catch_warnings(),
        patch.object(sys, "argv", ["etendue", *arguments]),
    ):
        try:
            main()
        except SystemExit as leaving:
            status = int(leaving.code or 0)
    printed = b"".join(stream.buffer.getvalue() for stream in (err, out))
    return status, printed.decode("utf-8")


def installed() -> str:
    """The command étendue, beside this Python."""
    path = shutil.which("etendue", path=sysconfig.get_path("scripts"))
    assert path, "the command etendue is not installed beside this Python"
    return path
