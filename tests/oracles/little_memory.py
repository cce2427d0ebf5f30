"""Readers in a process of their own, with little memory beyond what their libraries take."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

SCRIPT = """
import resource, sys
{imports}
from etendue.errors import FormatError
pages = int(open("/proc/self/statm").read().split()[0])
most = pages * resource.getpagesize() + {spare}
resource.setrlimit(resource.RLIMIT_AS, (most, most))
for path in map(Path, sys.argv[1:]):
    try:
        {call}
        print("read")
    except FormatError as error:
        print(str(error).replace("\\n", " "))
    except BaseException as error:
        print(type(error).__name__, str(error).replace("\\n", " "))
"""


def told(*, imports: str, call: str, paths: Iterable[Path], spare: int) -> list[str]:
    """What reading each file ended with: the text of a `FormatError`, ``read``, or another error's name and text.

    `call` reads ``path``; `spare` is the memory it may take, in bytes.
    """
    if not sys.platform.startswith("linux"):
        pytest.skip("memory is limited by the page on Linux")
    script = SCRIPT.format(imports=f"from pathlib import Path\n{imports}", call=call, spare=spare)
    done = subprocess.run(
        [sys.executable, "-c", script, *map(str, paths)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()
