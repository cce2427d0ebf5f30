"""Every job beside its best peer, in one go: ratios above 1 mean that étendue is faster.

    python benchmarks/run_all.py [--only map,count] [--repeats 3] [--rays 20000000]

Peers that are not installed are named and skipped: Mitsuba 3 (`mitsuba`, with LLVM, see `mitsuba_peer.py`), Radiance
(`pyradiance`), numba, a C compiler with OpenMP for `peers/plain.c`, and the benchmark of the reader `tm25ray`
(`cargo install tm25ray --example tm25_bench --features mmap`); for Embree see `tracer.py`. Both sides of a row are
measured one after the other; each figure is the best of some tries. With repeats, the whole is done again, and the
least and the largest ratio are printed. `taskset -c 0,1 python benchmarks/run_all.py` gives two cores to either side where
there are more.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import etendue as et
import numpy as np
import scenes
from etendue import _core
from etendue.lightfield.counting import count_rays
from etendue.lightfield.fitting import grids_for
from etendue.scene import compile_scene
from light_field import families
from light_field_speed import DEPTHS, RINGS, SAMPLES
from scenes import glass, lattice
from timing import best, cores, load, timed

HERE = Path(__file__).parent
LIBRARY = Path("/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1")
CORES = cores()
CAVITY = et.Observer(55, 0, 1000), et.Screen(50, 25, 250, 125)
RING_VIEW = et.Observer(20, 0, 1000), et.Screen(70, 70, 50, 50)


class Row(NamedTuple):
    """One job: how fast it is here and there, and what the ratio should be."""

    job: str
    ours: str
    peer: str
    ratio: float
    bar: float | None = None


def per_second(job: str, ours: float, peer: str, theirs: float, bar: float) -> Row:
    """Rates in millions."""
    return Row(job, f"{ours / 1e6:.1f} M/s", f"{peer} {theirs / 1e6:.1f} M/s", ours / theirs, bar)


def seconds(job: str, ours: float, peer: str, theirs: float, bar: float) -> Row:
    """Times."""
    return Row(job, f"{ours * 1e3:.4g} ms", f"{peer} {theirs * 1e3:.4g} ms", theirs / ours, bar)


# --- rays through scenes ---------------------------------------------------------------------------------------------


def forward(_: argparse.Namespace, folder: Path) -> Iterator[Row]:
    import mitsuba_peer as peer  # noqa: PLC0415 - not everybody has it
    import tracer  # noqa: PLC0415

    path, mesh = peer.mesh_walls(folder)
    walls = {"name": "walls", "shape": {"kind": "mesh", "file": str(path)}, "finish": "white"}
    for name, scene, theirs, bar in (
        ("analytic cavity", scenes.analytic(), peer.analytic_walls, 2.5),
        ("cavity of 24 064 triangles", scenes.cavity([walls]), mesh, 1.1),
    ):
        core = _core.Scene(compile_scene(scene).record)
        tracer.forward(core, 1 << 18, None)
        ours, _ = max(tracer.forward(core, 4_000_000, None) for _ in range(3))
        rate, _ = peer.cavity_rate(theirs, 4_000_000, 3)
        yield per_second(f"segments, {name}", ours, "Mitsuba", rate, bar)


def solids(_: argparse.Namespace, __: Path) -> Iterator[Row]:
    import mitsuba_peer as peer  # noqa: PLC0415

    for count in (10, 100, 1000, 10_000):
        places, step = lattice(count)
        ball = {"kind": "ball", "radius": 0.35 * step}
        setting, core = timed(lambda places=places, ball=ball: glass(ball, places))
        rays = 1_000_000
        batches = -(-rays // _core.batch_size())
        rates = []
        for _ in range(3):
            took, found = timed(lambda core=core, n=batches, rays=rays: _core.work_unit(core, rays, 1, 1000, 0, n))
            rates.append(found["ledger"]["segments"] / took)
        theirs, loading = peer.balls_rate(places, 0.35 * step, rays, 3)
        yield per_second(f"segments, {count:,} glass balls", max(rates), "Mitsuba", theirs, 1.2)
        if count == 10_000:
            yield seconds("set-up of 10 000 balls", setting, "Mitsuba", loading, 1.0)
            half = 0.5 * step
            block = {"kind": "block", "width": half, "height": half, "depth": half}
            setting, _ = timed(lambda places=places, block=block: glass(block, places))
            yield seconds("set-up of 10 000 blocks, beside 10 000 balls", setting, "Mitsuba", loading, 1.0)


# --- maps ------------------------------------------------------------------------------------------------------------


def field(_: argparse.Namespace, __: Path) -> Iterator[Row]:
    import mitsuba_peer as peer  # noqa: PLC0415

    observer, screen = RING_VIEW
    rings = et.LightField.fit(et.RingSource(rays=1_000_000), et.Disk(radius=30), depths=(5, 5, 5, 5))
    for name, lenses, bar in (("bare", [], 0.6), ("behind a lens", [scenes.LENS], 1.3)):
        scene = et.Scene(sources=[{"kind": "light-field", "field": rings}], solids=lenses)
        ours = best(lambda scene=scene: et.luminance_map(scene, observer, screen, rays_per_pixel=1000, gather=False), 4)
        theirs = peer.rings_seconds(observer, screen, 1000, 3, lens=bool(lenses))
        yield seconds(f"light field {name}, 50 × 50 × 1 000", ours, "Mitsuba, Lambertian disks", theirs, bar)


def cavity(_: argparse.Namespace, folder: Path) -> Iterator[Row]:
    import mitsuba_peer as peer  # noqa: PLC0415

    scene = scenes.analytic()

    def ours(seed: int) -> Any:
        return np.nan_to_num(et.luminance_map(scene, *CAVITY, seed=seed + 100).values) * 1e-6

    truth = et.luminance_map(scene, *CAVITY, rays_per_pixel=4096, seed=77)
    reference = np.nan_to_num(truth.values) * 1e-6
    inside = reference > 0.2 * np.median(reference[reference > 0])
    for axis in (0, 1):  # pixels without an edge
        inside = inside & np.roll(inside, 1, axis) & np.roll(inside, -1, axis)

    def efficiency(look: Callable[[int], Any], runs: int) -> float:
        """1/(mean square error · time), the error relative to the reference: median over the pixels."""
        look(0)
        took, maps = timed(lambda: np.array([look(seed) for seed in range(1, runs + 1)]))
        square = ((maps - reference) ** 2).mean(axis=0)[inside] / reference[inside] ** 2
        return float(1 / (np.median(square) * took / runs))

    mine = efficiency(ours, 6)
    theirs = efficiency(peer.cavity_map(*CAVITY, 64), 6)
    job = "map of the cavity, default: 1/(error² · time)"
    yield Row(job, f"{mine:.0f} /s", f"Mitsuba's path tracer {theirs:.0f} /s", mine / theirs, 10)
    try:
        import radiance_peer  # noqa: PLC0415
    except ImportError as error:
        print(f"skipped: {error}")
        return
    cached = efficiency(radiance_peer.cavity_map(folder, *CAVITY), 2)
    yield Row("the same", f"{mine:.0f} /s", f"Radiance's ambient cache {cached:.0f} /s", mine / cached, 1.5)


def look(_: argparse.Namespace, __: Path) -> Iterator[Row]:
    from numba_peer import look_at_plane  # noqa: PLC0415

    family = families()["film"]
    rays = family.ray_set(1_000_000, 1)
    took, found = timed(lambda: et.LightField.fit(rays, family.surface))
    yield seconds("fit of 10⁶ rays, surface stated", took, "bar", 2.0, 1.0)
    yield seconds("the same, surface found", timed(lambda: et.LightField.fit(rays))[0], "bar", 5.0, 1.0)
    x0, x1, y0, y1 = family.source.extent
    observer = et.Observer(40, 30, 1000, target=((x0 + x1) / 2, (y0 + y1) / 2, 0.0))
    screen = et.Screen(1.04 * (x1 - x0), 1.04 * (x1 - x0), 128, 128)
    ours = best(lambda: et.luminance_map(found, observer, screen, samples=SAMPLES), 50)
    theirs = best(look_at_plane(family.surface, observer, screen), 50)
    yield seconds("map from a field, 128² × 16", ours, "numba", theirs, 2.0)


# --- ray files -------------------------------------------------------------------------------------------------------


def files(options: argparse.Namespace, folder: Path) -> Iterator[Row]:
    compiler = next((found for name in ("cc", "gcc", "clang") if (found := shutil.which(name))), None)
    if compiler is None:
        raise ImportError("no C compiler")
    program, path = folder / "plain", folder / "rings.tm25ray"
    flags = ["-O3", "-march=native", "-ffast-math", "-fopenmp"]
    subprocess.run([compiler, *flags, HERE / "peers" / "plain.c", "-lm", "-o", program], check=True)
    et.write_rays(path, et.RingSource(rays=options.rays))
    start = path.stat().st_size - 28 * options.rays

    def plain(*job: object) -> float:
        """Seconds of a job in C."""
        command = [str(part) for part in (program, path, start, *job, CORES, 5)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        return float(done.stdout.split()[0])

    rays, peer = options.rays, "plain C"
    ours = best(lambda: et.read_rays(path).total_flux, 5)
    yield per_second("decode, check and sum a TM-25 file", rays / ours, f"{peer}, sum", rays / plain("sum"), 1.0)
    observer, screen = et.Observer(30, 0, 1e6), et.Screen(70, 70, 128, 128)
    how = et.Cone(acceptance=1.5)
    ours = best(lambda: et.luminance_map(et.read_rays(path), observer, screen, method=how), 5)
    yield seconds(f"cone map of {rays:.0e} rays", ours, peer, plain("cone", 30, 1.5, 70, 128), 0.5)
    grids = grids_for(rays, DEPTHS)
    ours = best(lambda: count_rays(et.read_rays(path), RINGS, grids), 3)
    theirs = plain("counts", 60, *grids.fine)
    yield per_second("étendue counts, Σ w and Σ w²", rays / ours, f"{peer}, number only", rays / theirs, 1.0)
    # Of equal rays the number is all there is to know, here as there.
    et.write_rays(path, et.RingSource((30.0,), (600.0,), rays=options.rays))
    ours = best(lambda: count_rays(et.read_rays(path), RINGS, grids), 3)
    theirs = plain("counts", 60, *grids.fine)
    yield per_second("étendue counts of equal rays", rays / ours, peer, rays / theirs, 1.0)


def reader(options: argparse.Namespace, folder: Path) -> Iterator[Row]:
    program = shutil.which("tm25_bench")
    if program is None:
        raise ImportError("no program tm25_bench")
    path = folder / "rings.tm25ray"
    et.write_rays(path, et.RingSource(rays=options.rays))
    ours = options.rays / best(lambda: _core.scan(et.read_rays(path).core_source(), 1), 5)
    told = subprocess.run([program, path, "5"], check=True, capture_output=True, text=True).stdout
    # It turns every record into numbers, and sums one of them, on one thread.
    for job in ("mmap + decode", "stream + decode"):
        rates = [
            float(line.split("M rays/s")[0].split()[-1]) for line in told.splitlines() if line.strip().startswith(job)
        ]
        yield per_second("decode, check and sum, one thread", ours, f"tm25ray, {job}", max(rates) * 1e6, 1.0)


def start(_: argparse.Namespace, folder: Path) -> Iterator[Row]:
    path = folder / "small.tm25ray"
    et.write_rays(path, et.RingSource(rays=100_000))
    program = Path(sys.executable).with_name("etendue")
    # Modules are compiled once, as they are for whoever does not forbid it.
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}

    def took(*command: object) -> float:
        run = list(map(str, command))
        return best(lambda: subprocess.run(run, check=True, capture_output=True, env=environment), 6)

    peer = "import mitsuba"
    theirs = took(sys.executable, "-c", peer)
    ours = took(sys.executable, "-c", "import etendue")
    yield seconds("import etendue", ours, peer, theirs, theirs / 0.15)
    for arguments in (("--help",), ("info", path)):
        ours = took(program, *arguments)
        yield seconds(f"etendue {arguments[0]}", ours, "bar", 0.25, 1.0)


JOBS = {
    "forward": forward,
    "solids": solids,
    "field": field,
    "cavity": cavity,
    "look": look,
    "files": files,
    "reader": reader,
    "start": start,
}


def machine() -> str:
    """What it is measured on."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    used = f"{CORES} of {os.cpu_count()} cores"
    return f"{names[0] if names else platform.processor()}, {used}; étendue {et.__version__}; {load()}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(JOBS), help=f"some of {', '.join(JOBS)}")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--rays", type=int, default=20_000_000, help="in the ray file")
    parser.add_argument("--one", choices=JOBS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    chosen = options.only.split(",")
    if unknown := set(chosen) - set(JOBS):
        parser.error(f"no such job: {', '.join(sorted(unknown))}; known: {', '.join(JOBS)}")
    if LIBRARY.exists():
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(LIBRARY))
    warnings.simplefilter("ignore")
    if options.one:
        with tempfile.TemporaryDirectory() as folder:
            try:
                for row in JOBS[options.one](options, Path(folder)):
                    print(json.dumps(row), flush=True)
            except ImportError as error:
                print(json.dumps(f"skipped: {error}"), flush=True)
        return
    print(machine(), flush=True)
    ratios: defaultdict[str, list[float]] = defaultdict(list)
    for repeat in range(options.repeats):
        for name in chosen:
            # A peer that dies (LLVM of a version that does not know the processor) takes nobody with it.
            command = [sys.executable, __file__, "--one", name, "--rays", str(options.rays)]
            with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as job:
                for line in job.stdout or ():
                    found = json.loads(line)
                    if isinstance(found, str):
                        print(f"{name}: {found}", flush=True)
                        continue
                    row = Row(*found)
                    ratios[f"{row.job}, {row.peer.rsplit(' ', 2)[0]}"].append(row.ratio)
                    bar = f"bar {row.bar:.3g}" if row.bar is not None else ""
                    print(f"{row.job:<48} {row.ours:>12}  {row.peer:<40} {row.ratio:6.2f}  {bar}".rstrip(), flush=True)
                told = job.stderr.read().strip().splitlines() if job.stderr else []
            if job.returncode:
                print(
                    f"{name} ended with status {job.returncode}: {told[-1] if told else 'nothing was said'}", flush=True
                )
        print(f"end of run {repeat + 1}; {load()}", flush=True)
    if options.repeats > 1:
        print("\nratio, least to largest:")
        for job, found in ratios.items():
            print(f"{job:<48} {min(found):6.2f} to {max(found):.2f}")


if __name__ == "__main__":
    main()
