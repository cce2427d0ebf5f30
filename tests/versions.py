"""Try the lowest versions of all libraries that pyproject.toml states, and the highest that there are.

usage: python tests/versions.py [--keep FOLDER] [TEST ...]

Makes a fresh virtual environment for each, lends it the package as it is built here, runs some tests, and prints what was
installed. Warnings of libraries of another age are no errors here. Run it with the Python that requires-python names.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "etendue"

TESTS = (
    "tests/quantities/test_extras.py",
    "tests/quantities/test_labelled.py",
    "tests/maps/test_map_formats.py",
    "tests/maps/test_exr.py",
    "tests/plot",
    "tests/intensity/test_picture.py",
    "tests/scene/test_scene.py",
    "tests/scene/test_meshes.py",
    "tests/scene/test_step_files.py",
    "tests/lightfield/test_storage.py",
)
"""What every library is used by."""


def requirements() -> list[str]:
    """What the package and its tests ask for; an extra that names extras is replaced by these."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras: dict[str, list[str]] = project["optional-dependencies"]
    wanted = [*project["dependencies"], *extras["test"]]
    for text in list(wanted):
        if match := re.fullmatch(rf"{PACKAGE}\[([\w,]+)\]", text):
            wanted.remove(text)
            wanted += [one for name in match[1].split(",") for one in extras[name]]
    return wanted


def lowest(requirement: str) -> str:
    """The requirement with its lower bound as the only version.

    >>> lowest("numpy>=1.26")
    'numpy==1.26'
    """
    return requirement.replace(">=", "==").split(",", maxsplit=1)[0]


def tried(name: str, wanted: list[str], tests: list[str], folder: Path) -> bool:
    """Whether the tests pass in a fresh environment with these requirements."""
    print(f"--- {name}", flush=True)  # noqa: T201 - what this program is for
    venv.create(folder, with_pip=True, clear=True)
    python = folder / "bin" / "python"
    quiet = ("--quiet", "--disable-pip-version-check")
    if subprocess.run([python, "-m", "pip", "install", *quiet, "--only-binary=:all:", *wanted], check=False).returncode:
        return False
    site = Path(sysconfig.get_path("purelib", vars={"base": str(folder), "platbase": str(folder)}))
    (site / f"{PACKAGE}.pth").write_text(f"{ROOT / 'python'}\n", encoding="utf-8")
    facts = f"{PACKAGE}-{importlib.metadata.version(PACKAGE)}.dist-info"
    shutil.copytree(str(importlib.metadata.distribution(PACKAGE).locate_file(facts)), site / facts)
    subprocess.run([python, "-m", "pip", "list", "--disable-pip-version-check"], check=False)
    command = [python, "-m", "pytest", "-o", "filterwarnings=default", "--disable-warnings", *tests]
    return subprocess.run(command, check=False, cwd=ROOT).returncode == 0


def main() -> int:
    """1 if one of the two failed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--keep", type=Path, help="folder for the environments, which stay there")
    parser.add_argument("tests", nargs="*", default=list(TESTS))
    options = parser.parse_args()
    wanted = requirements()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or Path(temporary)
        passed = [
            tried("lowest", [lowest(one) for one in wanted], options.tests, folder / "lowest"),
            tried("highest", wanted, options.tests, folder / "highest"),
        ]
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
