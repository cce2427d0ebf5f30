"""The part of the walk that needs a compiler: a BSDF and a detector are added to a copy of the tree, compiled and used.

Run by hand, `python tests/architecture/walk/compiled.py`; it takes some minutes, for everything is compiled in a folder of
its own: cargo goes by the times of files alone, and might take those of two trees for the same. With `--check` the compiler
only looks whether all of it would compile, which CI has time for.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))

from architecture.walk.additions import ADDITIONS, copy_tree  # noqa: E402
from architecture.walk.test_walk import INTERPRETED, passed  # noqa: E402

LIBRARIES = ("lib_core.so", "lib_core.dylib")

CHECKED = [["cargo", "check", "--quiet", "--workspace", "--all-targets"]]

BUILT = [
    ["cargo", "fmt", "--all", "--check"],
    ["cargo", "test", "--release", "-p", "etendue-optics", "bsdf"],
    ["cargo", "build", "--release", "-p", "etendue-bindings", "--features", "pyo3/extension-module"],
]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="look whether it would compile, and no more")
    only_check = parser.parse_args().check
    with tempfile.TemporaryDirectory() as folder:
        root = copy_tree(Path(folder) / "tree")
        target = Path(folder) / "target"
        environment = {**os.environ, "CARGO_TARGET_DIR": str(target)}
        tests = []
        for family in sorted(set(ADDITIONS) - set(INTERPRETED)):
            ADDITIONS[family].apply(root)
            tests += [*ADDITIONS[family].unasked, f"tests/architecture/walk/checks.py::test_{family.lower()}"]
        for command in CHECKED if only_check else BUILT:
            subprocess.run(command, cwd=root, env=environment, check=True)
        if only_check:
            return
        (library,) = (target / "release" / name for name in LIBRARIES if (target / "release" / name).exists())
        shutil.copy(library, root / "python" / "etendue" / "_core.abi3.so")
        missing = set(tests) - passed(root, *tests)
        if missing:
            sys.exit(f"did not run: {', '.join(sorted(missing))}")
    sys.stdout.write(f"{len(tests)} tests hold for what was added\n")


if __name__ == "__main__":
    main()
