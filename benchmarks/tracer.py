"""How fast light is traced, beside Mitsuba (LLVM) and Embree in the same run.

The cavity of thesis chapter 4: a cylinder of radius 21.5 and height 21.4, closed below by a disk, Lambertian with
reflectance 0.984; four black disks in the base that emit from 1 µm above. A segment is one nearest-hit query; a ray ends
when it leaves, is absorbed by chance, or meets a black disk. The same loop, and the same exit fraction, in both; what is
asked of Mitsuba stands in `mitsuba_peer.py`.

- analytic: the faces as they are;
- mesh: 24 064 triangles (23 bands of 1 024 and a fan of 512), flat normals; beside Mitsuba also Embree, asked through
  `embreex` by an array of the rays of the loop, as our index of triangles is; the loop asking Embree has our time for all
  else;
- map: the reverse map seen from 55°, 250 × 125 pixels of 0.2 mm; efficiency is 1/(variance · time), the variance that of a
  pixel over independent runs, relative to its mean over all of them; `luminance_map` as it is, with a survey, a pilot and a
  comparison in its time, and with lines that go on only; Mitsuba 64 paths a pixel;
- field: maps of a light field, bare and behind a lens, 50 × 50 pixels and 1 000 paths each;
- patches: time per ray of a gridded source of 16 to 100 000 patches, through a lens.

Mitsuba's LLVM variants want `libllvm19` (Debian) and `DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1`.

python benchmarks/tracer.py [--jobs analytic,mesh,map,field,patches] [--rays 4000000]
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import mitsuba as mi
import numpy as np
import trimesh
from etendue import _core
from etendue.scene import compile_scene
from mitsuba_peer import cavity_map, cavity_rate
from scenes import FLUX, HEIGHT, LENS, RADIUS, analytic, cavity, mesh
from timing import best, load

Array = Any
LIBRARY = Path("/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1")


def row(job: str, value: str, ratio: str = "") -> None:
    print(f"{job:<52} {value:>28} {ratio:>26}".rstrip(), flush=True)


def forward(scene: _core.Scene, rays: int, threads: int | None) -> tuple[float, float]:
    """Segments per second and exit fraction."""
    batches = -(-rays // _core.batch_size())
    start = time.perf_counter()
    ledger = _core.work_unit(scene, rays, 1, 1_000_000, 0, batches, threads)["ledger"]
    seconds = time.perf_counter() - start
    return ledger["segments"] / seconds, ledger["escaped"][0][0] / (4 * FLUX)


def rays_of_the_loop(scene: et.Scene) -> tuple[Array, Array]:
    """Start points and directions of the segments of 65 536 rays, one event of all of them after the other."""
    core = _core.Scene(compile_scene(scene).record)
    trails = _core.trace_trails(core, 1 << 16, 1, 1_000_000, 100.0)
    longest = max(map(len, trails))
    pairs = [np.stack([trail[k : k + 2] for trail in trails if len(trail) > k + 1]) for k in range(longest - 1)]
    starts, ends = np.concatenate(pairs).transpose(1, 0, 2)
    direction = (ends - starts) / np.linalg.norm(ends - starts, axis=1, keepdims=True)
    # Embree is not told on which triangle a ray starts.
    return starts + 1e-3 * direction, direction


def queries_alone(scene: et.Scene, vertices: Array, triangles: Array, folder: Path) -> tuple[float, float]:
    """Nearest hits per second of one thread for the rays of the loop: ours, and Embree's."""
    from embreex import rtcore_scene  # noqa: PLC0415 - the other jobs go without
    from embreex.mesh_construction import TriangleMesh  # noqa: PLC0415

    origin, direction = rays_of_the_loop(scene)
    vertices.tofile(folder / "vertices.f64")
    triangles.tofile(folder / "triangles.u32")
    np.concatenate([origin.T, direction.T]).tofile(folder / "rays.f64")
    command = ["cargo", "run", "--quiet", "--release", "-p", "etendue-geometry", "--example", "mesh_speed", str(folder)]
    told = subprocess.run(command, cwd=Path(__file__).parent, check=True, capture_output=True, text=True).stdout
    embree = rtcore_scene.EmbreeScene()
    TriangleMesh(embree, vertices[triangles].astype(np.float32))
    origin, direction = origin.astype(np.float32), direction.astype(np.float32)
    return float(told.split()[0]) * 1e6, len(origin) / best(lambda: embree.run(origin, direction), 7)


def job_forward(name: str, scene: et.Scene, walls: Callable[[], dict[str, Any]], rays: int) -> float:
    core = _core.Scene(compile_scene(scene).record)
    forward(core, 1 << 18, None)
    ours, left = max(forward(core, rays, None) for _ in range(3))
    one, _ = max(forward(core, rays, 1) for _ in range(2))
    theirs, their_left = cavity_rate(walls, rays, 3)
    row(f"{name}: all cores", f"{ours / 1e6:.1f} M segments/s", f"{ours / theirs:.2f} × Mitsuba")
    row(f"{name}: one thread", f"{one / 1e6:.1f} M segments/s")
    row(f"{name}: Mitsuba, its faster variant", f"{theirs / 1e6:.1f} M segments/s")
    error = math.sqrt(0.955 * 0.045 / rays)
    row(f"{name}: exit fraction", f"{left:.4f}, {their_left:.4f}", f"± {error:.4f}")
    return one


def job_analytic(rays: int) -> None:
    def walls() -> dict[str, Any]:
        scale = mi.ScalarTransform4f().scale
        wall = {"type": "cylinder", "p0": [0, 0, 0], "p1": [0, 0, HEIGHT], "radius": RADIUS}
        return {"wall": wall, "base": {"type": "disk", "to_world": scale(RADIUS)}}

    job_forward("analytic cavity", analytic(), walls, rays)


def job_mesh(rays: int) -> None:
    vertices, triangles = mesh()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cavity.ply"
        trimesh.Trimesh(vertices, triangles, process=False).export(path)
        scene = cavity([{"name": "walls", "shape": {"kind": "mesh", "file": str(path)}, "finish": "white"}])

        def walls() -> dict[str, Any]:
            return {"walls": {"type": "ply", "filename": str(path), "face_normals": True}}

        one = job_forward(f"mesh cavity, {len(triangles):,} triangles", scene, walls, rays)
        ours, embree = queries_alone(scene, vertices, triangles, Path(folder))
    row("mesh cavity, one thread: queries alone", f"{ours / 1e6:.1f} M/s", f"{ours / embree:.2f} × Embree, single rays")
    row("mesh cavity, one thread: the loop", f"{one / 1e6:.1f} M/s", f"{one / embree:.2f} × Embree's queries alone")
    same = 1 / (1 / one - 1 / ours + 1 / embree)
    row(
        "mesh cavity, one thread: our loop, asking Embree",
        f"{same / 1e6:.1f} M/s",
        f"the loop is {one / same:.2f} × that",
    )


def job_map(_rays: int) -> None:
    observer, screen = et.Observer(55, 0, 1000), et.Screen(50, 25, 250, 125)
    scene = analytic()

    def seen(seed: int, **how: Any) -> Array:
        lmap = et.luminance_map(scene, observer, screen, seed=seed + 100, **how)
        return np.nan_to_num(lmap.values) * 1e-6

    theirs = cavity_map(observer, screen, 64)
    # The pixels in which the inside of the cavity is seen.
    inside = seen(0)
    inside = inside > 0.2 * np.median(inside[inside > 0])

    def judged(look: Callable[[int], Array], runs: int) -> tuple[float, float, float]:
        look(0)
        start = time.perf_counter()
        maps = np.array([look(seed) for seed in range(1, runs + 1)])
        seconds = (time.perf_counter() - start) / runs
        mean = maps.mean(0)
        relative = np.median(maps.var(0, ddof=1)[inside] / mean[inside] ** 2)
        return 1.0 / (relative * seconds), math.sqrt(relative), float(np.median(mean[inside]))

    yours, their_noise, their_level = judged(theirs, 16)
    row("map of the cavity, Mitsuba's path tracer: noise of a run", f"{their_noise:.1%}", f"median {their_level:.5f}")
    ways: dict[str, dict[str, Any]] = {
        "default": {},
        "default, 1 024 lines a pixel": {"rays_per_pixel": 1024},
        "lines that go on": {"gather": False},
    }
    for way, how in ways.items():
        mine, noise, level = judged(lambda seed, how=how: seen(seed, **how), 8)
        job = f"map of the cavity, {way}"
        row(f"{job}: 1/(variance · time)", f"{mine:.0f} /s", f"{mine / yours:.1f} × Mitsuba's path tracer")
        row(f"{job}: noise of a run", f"{noise:.1%}", f"median {level:.5f} lm/(mm² sr)")


def job_field(_rays: int) -> None:
    field = et.LightField.fit(et.RingSource(rays=1_000_000), et.Disk(radius=30), depths=(5, 5, 5, 5))
    source = {"kind": "light-field", "field": field}
    view = et.Screen(70, 70, 50, 50).core_view(et.Observer(20, 0, 1000))
    for name, solids in (("bare", []), ("behind a lens", [LENS])):
        core = _core.Scene(compile_scene(et.Scene(sources=[source], solids=solids)).record)
        _core.look_at_scene(core, view, 4, 1, 1000, "nothing", 0, 1)
        seconds = best(lambda core=core: _core.look_at_scene(core, view, 125, 1, 1000, "nothing", 0, 8), 3)
        job = f"light field {name}, 50 × 50 pixels × 1 000 paths"
        row(job, f"{seconds:.2f} s", f"{1.0 / seconds:.2f} × bar (1 s)")


def job_patches(rays: int) -> None:
    first, batches = None, -(-rays // _core.batch_size())
    for pixel in (20.0, 1.7, 0.165):
        gridded = et.GriddedSource.fit(et.RingSource(rays=2_000_000), et.Disk(radius=30), pixel=pixel, threshold=5.0)
        source = {"kind": "gridded", "gridded": gridded, "draws": rays}
        core = _core.Scene(compile_scene(et.Scene(sources=[source], solids=[LENS])).record)
        seconds = best(lambda core=core: _core.work_unit(core, rays, 1, 1000, 0, batches), 5)
        first = first or seconds
        each = f"{seconds / rays * 1e9:.0f} ns a ray"
        row(f"rays of {len(gridded.patches):,} patches through a lens", each, f"{seconds / first:.2f} × the first")


JOBS = {"analytic": job_analytic, "mesh": job_mesh, "map": job_map, "field": job_field, "patches": job_patches}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", default=",".join(JOBS))
    parser.add_argument("--rays", type=float, default=4e6)
    options = parser.parse_args()
    if LIBRARY.exists():
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(LIBRARY))
    print(load(), flush=True)
    for job in options.jobs.split(","):
        JOBS[job](int(options.rays))


if __name__ == "__main__":
    main()
