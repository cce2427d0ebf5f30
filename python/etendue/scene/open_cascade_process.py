"""The process that reads a STEP file by Open CASCADE: `etendue.scene.open_cascade` starts it and speaks with it.

It runs by itself and imports nothing of the package. Standard input: the length of the file and the file, then one request
after the other, as `REQUEST`; standard output: for each the length of the answer and the answer, which is empty if nothing
can be read. The end of the input ends it.
"""

import importlib
import importlib.util
import json
import os
import struct
import sys
import types
from typing import Any

LENGTH = struct.Struct("<Q")
REQUEST = struct.Struct("<dd?")
"""Distance from the surface [mm], or as a part of each edge; turn of the normal along a triangle [rad]; whether a part."""


def _library() -> Any:
    """The compiled part of cascadio alone, if that works: the rest takes most of a second to import."""
    spec = importlib.util.find_spec("cascadio")
    if spec is not None and spec.submodule_search_locations:
        package = types.ModuleType("cascadio")
        package.__path__ = list(spec.submodule_search_locations)
        sys.modules["cascadio"] = package
        try:
            return importlib.import_module("cascadio._core")
        except ImportError:
            del sys.modules["cascadio"]
    return importlib.import_module("cascadio")


def _serve() -> None:
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    # What the library prints is no answer.
    os.dup2(2, 1)
    library = _library()
    (length,) = LENGTH.unpack(requests.read(LENGTH.size))
    raw = requests.read(length)
    while len(request := requests.read(REQUEST.size)) == REQUEST.size:
        linear, angular, relative = REQUEST.unpack(request)
        made = library.to_glb_bytes(
            data=raw,
            file_type=library.FileType.STEP,
            tol_linear=linear,
            tol_angular=angular,
            tol_relative=relative,
            merge_primitives=True,
            use_parallel=True,
            include_brep=True,
            brep_types=set(),
            include_materials=False,
        )
        answers.write(LENGTH.pack(len(made)) + made)
        answers.flush()


if __name__ == "__main__":
    sys.path[:] = json.loads(sys.argv[1])
    _serve()
