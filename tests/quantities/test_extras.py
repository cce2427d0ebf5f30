"""The base install does its work without the libraries of the extras; what needs one says which, before any work."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from etendue.extras import EXTRAS

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

BLOCKED = f"""
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {sorted(EXTRAS)}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name.split(".")[0])

sys.meta_path.insert(0, Blocker())
"""
"""The beginning of a program in which no library of an extra can be imported."""

MAIN_JOB = """
import etendue as et

rays = et.RingSource(rays=20_000).ray_set()
et.write_rays("led.tm25ray", rays, format="tm25")
rays = et.read_rays("led.tm25ray")
lmap = et.luminance_map(rays, et.Observer(0, 0, 1000), et.Screen(60, 60, 4, 4), method=et.Cone(acceptance=5))
for name in ("map.npz", "map.exr", "map.tif", "map.csv"):
    lmap.save(name)
    assert et.read_map(name).screen == lmap.screen
et.LightField.fit(rays, et.Disk(radius=30), depths=(3, 3, 2, 2)).save("led.h5")
scene = et.Scene(sources=[{"kind": "point", "flux": 1}])
assert et.trace(scene, rays=1000).ledger.closes
assert rays._repr_html_() and lmap._repr_html_() and scene._repr_html_()
"""


def run_blocked(program: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", "-c", BLOCKED + program, *arguments]
    return subprocess.run(command, check=False, capture_output=True, text=True, cwd=folder)


def libraries(requirements: list[str]) -> set[str]:
    return {re.split(r"[^\w-]", text)[0] for text in requirements}


@pytest.mark.slow
def test_the_main_job_needs_no_extra(tmp_path: Path) -> None:
    done = run_blocked(MAIN_JOB, tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("library", EXTRAS)
def test_extras_are_those_of_the_package(library: str) -> None:
    """What messages tell users to install brings the library, and without it the library is not there."""
    assert library in libraries(PROJECT["optional-dependencies"][EXTRAS[library].name])
    assert library not in libraries(PROJECT["dependencies"])


NEEDY = {
    "lmap.plot('map.png')": "plot",
    "lmap.save('map.pdf')": "plot",
    "et.plot_intensity(et.Intensity([0], [0, 90], [[1, 0]]))": "plot",
    "et.draw_scene(et.Scene())": "plot",
    "lmap.to_xarray()": "xarray",
}


@pytest.mark.slow
def test_what_needs_an_extra_names_it(tmp_path: Path) -> None:
    grid = "import etendue as et; one = [[1.0]]"
    lmap = "lmap = et.LuminanceMap(one, one, one, et.Observer(0, 0, 1000), et.Screen(1, 1, 1, 1))"
    told = "\n".join(
        f"try:\n    {call}\nexcept et.MissingLibraryError as error:\n    print(str(error).splitlines()[-1])"
        for call in NEEDY
    )
    done = run_blocked(f"{grid}\n{lmap}\n{told}\n", tmp_path)
    lines = done.stdout.splitlines()
    for line, extra in zip(lines, NEEDY.values(), strict=True):
        assert line.endswith(f"pip install 'etendue[{extra}]'."), done
    assert list(tmp_path.iterdir()) == []


COMMANDS = (
    # A lamp that is not there: the picture is looked after first.
    ("luminance", "nowhere.tm25ray", "--observer", "30,0", "-o", "map.npz", "-o", "map.png"),
    ("demo", "--rays", "1e5", "-o", "demo.png"),
    ("intensity", "nowhere.tm25ray", "-o", "far.pdf"),
    ("draw", "nowhere.toml", "-o", "layout.png"),
)


@pytest.mark.slow
def test_the_command_line_says_so_before_any_work(tmp_path: Path) -> None:
    """One command after the other in one process, which holds none of the libraries at any time."""
    program = f"""
from etendue.cli import main

for arguments in {COMMANDS}:
    sys.argv[1:] = arguments
    try:
        main()
    except SystemExit as end:
        print(end.code)
"""
    done = run_blocked(program, tmp_path)
    assert (done.returncode, done.stdout.split()) == (0, ["1"] * len(COMMANDS))
    told = "error: matplotlib is not installed, which pictures need. Install it: pip install 'etendue[plot]'.\n"
    assert done.stderr == told * len(COMMANDS)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_command_line_works_without(tmp_path: Path) -> None:
    program = "from etendue.cli import main; main()"
    (tmp_path / "lamp.toml").write_text('[[sources]]\nkind = "point"\nflux = 1\n')
    done = run_blocked(program, tmp_path, "trace", "lamp.toml", "--rays", "1000", "-o", "result.h5")
    assert (done.returncode, done.stderr) == (0, "")
