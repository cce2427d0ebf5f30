"""Whether an installed étendue works: files, light field, map, trace, viewer and verbs, in some seconds.

    python tests/smoke.py                      # with the Python that étendue is installed for
    python tests/smoke.py --without-compiler   # and nothing within reach could have compiled it

It needs nothing of the checkout but this file and none of the libraries of the tests. `.ci/wheel` and the workflow of the
wheels run it. What is measured is compared with closed forms, at 5 standard errors.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

import etendue as et
import numpy as np

COMPILERS = ("cargo", "rustc", "cc", "gcc", "clang", "c++", "g++", "cl", "maturin")

SCENE = """
[[sources]]
name = "disk"
kind = "surface"
shape = { kind = "disk", radius = 5 }
flux = 100

[[detectors]]
name = "above"
kind = "rays"
shape = { kind = "disk", radius = 5 }
at = [0, 0, 10]
"""


def close(found: float, truth: float, error: float, what: str) -> None:
    """Compare at 5 standard errors."""
    if not abs(found - truth) <= 5.0 * error:
        raise SystemExit(f"{what}: {found:.5g} ± {error:.2g}, and {truth:.5g} is true")
    print(f"ok: {what}: {found:.5g} ± {error:.2g}, true {truth:.5g}")


def no_compiler() -> None:
    """Fail if a compiler can be found."""
    found = [path for path in map(shutil.which, COMPILERS) if path]
    if found:
        raise SystemExit(f"compilers are within reach: {', '.join(found)}. Run with a PATH without them.")
    print("ok: no compiler within reach")


def rays_and_maps() -> None:
    """A ring source through a file, a light field and a map; Φ = π² L r² of a Lambertian disk, seen face on."""
    et.write_rays("disk.tm25ray", et.RingSource(radii=(5.0,), flux=(100.0,), rays=200_000, seed=1))
    rays = et.read_rays("disk.tm25ray")
    field = et.LightField.fit(rays, et.Disk(radius=5.0), depths=(2, 2, 2, 2))
    field.save("disk.h5")
    screen = et.Screen(4, 4, 2, 2)
    lmap = et.luminance_map(et.LightField.load("disk.h5"), et.Observer(30, 20, 1000), screen)
    truth = 100.0 / (math.pi**2 * (5.0e-3) ** 2)
    close(float(lmap.values.mean()), truth, float(lmap.standard_error.mean()), "luminance of a disk [cd/m²]")
    lmap.save("map.exr")
    again = et.read_map("map.exr")
    if not np.allclose(again.values, lmap.values, rtol=1e-6):
        raise SystemExit("map.exr does not hold the map that was written")
    found = et.intensity_distribution(rays)
    close(found.at(c=0, gamma=60) / found.at(c=0, gamma=0), 0.5, 0.02, "cosine law, I(60°)/I(0°)")


def scenes() -> None:
    """Of the light of a Lambertian disk, what meets an equal disk at twice its radius: the view factor in closed form."""
    Path("lamp.toml").write_text(SCENE, encoding="utf-8")
    result = et.trace(et.Scene.load("lamp.toml"), rays=200_000, seed=1)
    x = 2.0 + (10.0 / 5.0) ** 2
    share = (x - math.sqrt(x * x - 4.0)) / 2.0
    error = math.sqrt(share * (1.0 - share) / 200_000)
    close(result.rays["above"].total_flux / 100.0, share, error, "view factor of disks")


def verbs() -> None:
    """The program: facts, a map and its picture, a page, a trace."""
    program = shutil.which("etendue", path=sysconfig.get_path("scripts"))
    if program is None:
        raise SystemExit("the program etendue is not installed beside this Python")

    def run(*arguments: str) -> str:
        done = subprocess.run([program, *arguments], capture_output=True, encoding="utf-8", check=False)
        if done.returncode:
            raise SystemExit(f"etendue {' '.join(arguments)}: exit {done.returncode}\n{done.stdout}{done.stderr}")
        print(f"ok: etendue {' '.join(arguments)}")
        return done.stdout

    facts = json.loads(run("info", "disk.tm25ray", "--json"))[0]
    if facts["rays"] != 200_000:
        raise SystemExit(f"etendue info counts {facts['rays']} rays in a file of 200000")
    look = ("--observer", "30,0", "--size", "12,12", "--pixels", "32,32")
    written = ["seen.exr", "seen.png", "disk.html", "again.ray", "disk.ies", "trace.h5", "disk-demo.png"]
    run("luminance", "disk.h5", *look, "-o", "seen.exr", "-o", "seen.png")
    run("view", "disk.h5", "-o", "disk.html")
    run("convert", "disk.tm25ray", "again.ray", "--format", "lighttools")
    run("intensity", "disk.tm25ray", "-o", "disk.ies")
    run("trace", "lamp.toml", "--rays", "1e5", "--seed", "1", "-o", "trace.h5")
    run("demo", "--rays", "2000000", "-o", "disk-demo.png")
    for name in written:
        if Path(name).stat().st_size < 1000:
            raise SystemExit(f"{name} is nearly empty")


def main() -> None:
    """All of it, in a folder of its own that is removed afterwards."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--without-compiler", action="store_true", help="fail if a compiler is within reach")
    if parser.parse_args().without_compiler:
        no_compiler()
    print(f"etendue {et.__version__} of {Path(et.__file__).parent}, Python {sys.version.split()[0]}")
    os.environ["PYTHONUTF8"] = "1"
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ETENDUE_CACHE_DIR"] = folder
        home = Path.cwd()
        os.chdir(folder)
        try:
            rays_and_maps()
            scenes()
            verbs()
        finally:
            os.chdir(home)
    print("all well")


if __name__ == "__main__":
    main()
