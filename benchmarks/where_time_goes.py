"""Where the time of each job goes, by kind of work: shares of the samples that `perf` takes, on all cores.

    python benchmarks/where_time_goes.py [--only balls-10,fit] [--seconds 6]

Needs `perf` (Linux) and a core that names its functions. That of the package does not; one that does is built by
`cargo build --release -p etendue-bindings` and put in its place (`target/release/lib_core.so` as `_core.abi3.so`). A job is
set up, runs once, and is then watched; nothing is counted of what came before. Work that is inlined counts as what it is
inlined into, so that "rays on their way" holds the decisions at surfaces, too.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import etendue as et
import scenes
import trimesh
from etendue import _core
from etendue.lightfield.counting import count_rays
from etendue.lightfield.fitting import grids_for
from etendue.scene import compile_scene
from light_field import families
from light_field_speed import DEPTHS, RINGS
from timing import load

KINDS = {
    "which face is met": r"intersect_block|face_set|::bvh|geometry::mesh|Face::first|::nearest",
    "points and normals there": r"surface_point|settle",
    "what surfaces do with light": r"::bsdf|scatter|interfaces|fresnel|_sheet|::smooth|guide",
    "random numbers": r"philox|lattice",
    "what sources send out": r"optics::source|light_sampler",
    "rays on their way": r"etendue_trace",
    "records decoded and checked": r"geometry::(table|ray_batch|pass|source)|RayTable",
    "sums of rays": r"geometry::scan|lightfield::(cone|counts)",
    "trees": r"::polya",
    "fields read and drawn from": r"lightfield::field",
    "memory copied and cleared": r"mem(move|set|cpy)|clear_page|copy_",
    "numpy and Python": r"python|umath|blas|_multiarray",
}
"""Kinds of work, by names of functions and of the files that they are in; the first that fits."""

Job = Callable[[], object]


def forward(scene: et.Scene | _core.Scene) -> Job:
    core = scene if isinstance(scene, _core.Scene) else _core.Scene(compile_scene(scene).record)
    rays = 1_000_000
    batches = -(-rays // _core.batch_size())
    return lambda: _core.work_unit(core, rays, 1, 1000, 0, batches)


def balls(count: int) -> Job:
    places, step = scenes.lattice(count)
    return forward(scenes.glass({"kind": "ball", "radius": 0.35 * step}, places))


def mesh(folder: Path) -> Job:
    path = folder / "cavity.ply"
    trimesh.Trimesh(*scenes.mesh(), process=False).export(path)
    walls = {"name": "walls", "shape": {"kind": "mesh", "file": str(path)}, "finish": "white"}
    return forward(scenes.cavity([walls]))


def cavity_map(_: Path) -> Job:
    scene, observer, screen = scenes.analytic(), et.Observer(55, 0, 1000), et.Screen(50, 25, 250, 125)
    return lambda: et.luminance_map(scene, observer, screen)


def field_in_scene(lenses: list[dict[str, object]]) -> Job:
    rings = et.LightField.fit(et.RingSource(rays=1_000_000), et.Disk(radius=30), depths=(5, 5, 5, 5))
    scene = et.Scene(sources=[{"kind": "light-field", "field": rings}], solids=lenses)
    observer, screen = et.Observer(20, 0, 1000), et.Screen(70, 70, 50, 50)
    return lambda: et.luminance_map(scene, observer, screen, rays_per_pixel=1000, gather=False)


def field_map(_: Path) -> Job:
    family = families()["film"]
    field = et.LightField.fit(family.ray_set(1_000_000, 1), family.surface)
    observer, screen = et.Observer(40, 30, 1000), et.Screen(20, 20, 128, 128)
    return lambda: et.luminance_map(field, observer, screen, samples=16)


def fit(_: Path) -> Job:
    family = families()["film"]
    rays = family.ray_set(1_000_000, 1)
    return lambda: et.LightField.fit(rays, family.surface)


def ray_file(folder: Path) -> Path:
    path = folder / "rings.tm25ray"
    et.write_rays(path, et.RingSource(rays=10_000_000))
    return path


def cone(folder: Path) -> Job:
    path, observer, screen = ray_file(folder), et.Observer(30, 0, 1e6), et.Screen(70, 70, 128, 128)
    return lambda: et.luminance_map(et.read_rays(path), observer, screen, method=et.Cone())


def count(folder: Path) -> Job:
    path, grids = ray_file(folder), grids_for(10_000_000, DEPTHS)
    return lambda: count_rays(et.read_rays(path), RINGS, grids)


def decode(folder: Path) -> Job:
    path = ray_file(folder)
    return lambda: et.read_rays(path).total_flux


JOBS: dict[str, tuple[str, Callable[[Path], Job]]] = {
    "cavity": ("analytic cavity, forward", lambda _: forward(scenes.analytic())),
    "mesh": ("cavity of 24 064 triangles, forward", mesh),
    "balls-10": ("10 glass balls, forward", lambda _: balls(10)),
    "balls-1000": ("1 000 glass balls, forward", lambda _: balls(1000)),
    "map": ("map of the cavity, default", cavity_map),
    "bare": ("light field bare, 50 × 50 × 1 000", lambda _: field_in_scene([])),
    "lens": ("light field behind a lens", lambda _: field_in_scene([scenes.LENS])),
    "look": ("map from a field, 128² × 16", field_map),
    "fit": ("fit of 10⁶ rays, surface stated", fit),
    "decode": ("decode, check and sum a TM-25 file", decode),
    "cone": ("cone map of a TM-25 file", cone),
    "count": ("étendue counts", count),
}


def watched(name: str, seconds: float) -> None:
    """Sets a job up, says so on a line, and does it again and again for some time."""
    with tempfile.TemporaryDirectory() as folder:
        job = JOBS[name][1](Path(folder))
        job()
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        sys.stdin.readline()
        start = time.perf_counter()
        while time.perf_counter() - start < seconds:
            job()


def shares(name: str, seconds: float, folder: Path, perf: str) -> Counter[str]:
    """Shares of the samples of a job, by kind of work; `perf` is the program."""
    record = folder / "perf.data"
    command = [sys.executable, __file__, "--one", name, "--seconds", str(seconds)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as job:
        if job.stdin is None or job.stdout is None or job.stdout.readline() != "ready\n":
            raise RuntimeError(f"{name} could not be set up")
        watch = [perf, "record", "-q", "-F", "499", "-p", str(job.pid), "-o", record]
        with subprocess.Popen(watch, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as watching:
            time.sleep(0.5)
            job.stdin.write("go\n")
            job.stdin.close()
            job.wait()
            watching.wait()
    report = subprocess.run(
        [perf, "report", "-i", record, "--stdio", "--no-children", "-F", "overhead,dso,symbol", "-t", "|"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    core = re.findall(r"_core\.abi3\.so *\|([^|\n]*)", report)
    if 2 * sum("0x0000" in symbol for symbol in core) > len(core):
        sys.exit("The core has no names of functions: see --help.")
    found: Counter[str] = Counter()
    for line in report.splitlines():
        if line.startswith("#") or line.count("|") < 2:
            continue
        overhead, file, symbol = line.split("|", 2)
        what = f"{file} {symbol}"
        kind = next((kind for kind, pattern in KINDS.items() if re.search(pattern, what)), "the rest")
        found[kind] += float(overhead.strip().rstrip("%"))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(JOBS), help=f"some of {', '.join(JOBS)}")
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--one", choices=JOBS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        watched(options.one, options.seconds)
        return
    chosen = options.only.split(",")
    if unknown := set(chosen) - set(JOBS):
        parser.error(f"no such job: {', '.join(sorted(unknown))}; known: {', '.join(JOBS)}")
    perf = shutil.which("perf")
    if perf is None:
        sys.exit("where_time_goes.py needs perf, which comes with the tools of the Linux kernel.")
    print(load(), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen:
            found = shares(name, options.seconds, Path(folder), perf)
            parts = [f"{kind} {share:.0f} %" for kind, share in found.most_common() if share >= 1.5]
            print(f"{JOBS[name][0]}: {', '.join(parts)}", flush=True)


if __name__ == "__main__":
    main()
