"""What scatter costs and how exact a table is, beside Lambert's law and closed quadratures in the same run.

1. A known BRDF, 0.3/π + a Gaussian of σ = 0.15 in direction cosines with a share of 0.4, is tabled at 0, 15 … 75° in 3 136
   points each; its directional-hemispherical reflectance is held against the quadrature of the function.
2. Samples and values per second of each model and of the table, and the chamber of thesis chapter 4 traced forwards with
   each, all beside a Lambertian surface of the same reflectance at normal incidence: a ray; a segment, which is a ray over
   the ways that it goes; and a bounce, which is what a ray takes beyond one in a black chamber, over the further surfaces
   that it meets. Of samples and values the least times of 10 rounds; of the chamber, without setting it up, the medians of
   50 rounds in which each surface takes its turn, with the quartiles of their ratios: a bounce is a small difference, and
   the machine's speed swings.
3. With `--peers` (needs `pyradiance` and `mitsuba`): the same BRDF through `pabopto2bsdf` and `bsdf2klems`; and the map of
   the chamber from 55°, 126 × 63 pixels, with a satin paint and a table of it beside Mitsuba's `roughplastic` of the same
   reflectance at 20°
   (`scalar_rgb`, `path`), and its light image beside `ptracer`: 1/(variance · time), the variance that of a pixel over
   independent runs.

4. With `--set-up`, in place of all that: how long rough surfaces take to answer for the first time, alike along and across
   and not, and a metal whose reflectance is known at 41 wavelengths beside the same at one.

python benchmarks/scatter.py [--rays 1e6] [--only table] [--peers] [--set-up]
"""

from __future__ import annotations

import argparse
import itertools
import math
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue import _core
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.building import core_scene
from etendue.scene import compile_scene
from timing import timed

Array = npt.NDArray[np.float64]

FLOOR, LOBE, SIGMA = 0.3, 0.4, 0.15
ANGLES = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 66.5, 68.0, 70.0, 82.5)
SAMPLES = 1_000_000
FEW = 1000
ROUNDS = 50
TIMES = 10


def row(job: str, value: str, ratio: str = "") -> None:
    print(f"{job:<52} {value:>28} {ratio:>30}".rstrip(), flush=True)


def known(incident: Array, scattered: Array) -> Array:
    off = incident[..., :2] + scattered[..., :2]
    return FLOOR / math.pi + LOBE / (2 * math.pi * SIGMA**2) * np.exp(-0.5 * np.sum(off * off, axis=-1) / SIGMA**2)


def exact(theta: float) -> float:
    """Gauss and Legendre over the unit disk of direction cosines."""
    x, w = np.polynomial.legendre.leggauss(400)
    r, a = 0.5 * (x + 1.0), np.arange(1440) * (2.0 * math.pi / 1440)
    beta = np.stack([r[:, None] * np.cos(a), r[:, None] * np.sin(a)], axis=-1)
    scattered = np.concatenate([beta, np.sqrt(1.0 - r * r)[:, None, None] * np.ones((1, a.size, 1))], axis=-1)
    return float(np.sum(known(direction(theta, 180.0), scattered).mean(axis=1) * 2.0 * math.pi * r * 0.5 * w))


def table() -> et.BsdfTable:
    slices = []
    for theta in np.linspace(0.0, 75.0, 6):
        incident = direction(theta, 180.0)
        grid = PolarGrid("normal", np.linspace(0.0, 89.9, 56), np.arange(56) * (360.0 / 56))
        slices.append(BsdfSlice(incident, known(incident, grid.directions(incident, transmitted=False)), grid=grid))
    return et.BsdfTable(BsdfData(tuple(slices)))


def tabled(bsdf: et.Bsdf) -> et.BsdfTable:
    """A table of a model, at 0, 5 … 85°."""
    grid = PolarGrid("cosines", np.append(0.0, np.geomspace(1e-3, 2.0, 100)), np.arange(0.0, 360.0, 5.0))
    slices = []
    for theta in np.arange(0.0, 86.0, 5.0):
        incident = direction(theta, 180.0)
        scattered = grid.directions(incident, transmitted=False)
        there = ~np.isnan(scattered[..., 0])
        values = np.full(there.shape, np.nan)
        values[there] = bsdf.evaluate(incident, scattered[there])
        slices.append(BsdfSlice(incident, values, grid=grid))
    return et.BsdfTable(BsdfData(tuple(slices)))


def chamber(finish: Mapping[str, Any]) -> et.Scene:
    disk = {"kind": "disk", "radius": 2.5}
    lamps = [
        {"kind": "surface", "shape": disk, "flux": 0.96, "at": [x, y, 0.1]} for x in (-4.5, 4.5) for y in (-4.5, 4.5)
    ]
    walls = [
        {"shape": {"kind": "cylinder", "radius": 21.5, "height": 21.4}, "finish": finish},
        {"shape": {"kind": "disk", "radius": 21.5}, "finish": finish},
    ]
    return et.Scene(sources=lamps, surfaces=walls)


def ways(scene: et.Scene) -> float:
    """Ways between surfaces that a ray of the chamber goes, the last one included."""
    rays = 2 * _core.batch_size()
    core = core_scene({**compile_scene(scene).record, "detectors": []})
    traced = _core.work_unit(core, rays, 1, 1 << 20, 0, 2)
    return float(traced["ledger"]["segments"] / rays)


def as_mountain(folder: Path) -> list[Path]:
    """The known BRDF as PAB writes it, a file for each incidence."""
    paths = []
    for theta in np.linspace(0.0, 75.0, 6):
        grid = PolarGrid("normal", np.linspace(0.0, 89.9, 56), np.arange(56) * (360.0 / 56))
        incident = direction(theta, 0.0)
        f = known(incident, grid.directions(incident, transmitted=False))
        lines = [f"#intheta {theta:g}", "#inphi 0", "#format: theta phi BRDF"]
        lines += [
            f"{polar:.6f}\t{azimuth:.6f}\t{f[k, i]:.9g}"
            for k, azimuth in enumerate(grid.azimuth)
            for i, polar in enumerate(grid.radial)
        ]
        paths.append(folder / f"known_{theta:g}.dat")
        paths[-1].write_text("\n".join(lines) + "\n")
    return paths


def radiance_row() -> None:
    """What Radiance makes of the known BRDF: Klems' full basis."""
    import pyradiance  # noqa: PLC0415 - only with --peers

    home = Path(pyradiance.__file__).parent
    tools = {**os.environ, "PATH": f"{home / 'bin'}:{os.environ['PATH']}", "RAYPATH": str(home / "lib")}

    def made(path: Path, tool: str, *arguments: str) -> Path:
        command = [str(home / "bin" / tool), *arguments]
        with path.open("wb") as out:
            subprocess.run(command, stdout=out, stderr=subprocess.DEVNULL, env=tools, check=True)
        return path

    with tempfile.TemporaryDirectory() as folder:
        measured = as_mountain(Path(folder))
        mesh = made(Path(folder) / "known.sir", "pabopto2bsdf", *map(str, measured))
        xml = made(Path(folder) / "known.xml", "bsdf2klems", str(mesh))
        found = et.read_bsdf(xml)
        for theta in ANGLES:
            truth, share = exact(theta), float(found.reflectance(theta))
            off = f"{100 * (share / truth - 1):+.2f} %"
            row(f"reflectance by bsdf2klems at {theta:g}°", f"{share:.4f} of {truth:.4f}", off)


def efficiency(look: Callable[[int], Array], runs: int = 6) -> tuple[float, float]:
    """1/(relative variance · time), the median over lit pixels; and their mean."""
    look(0)
    begun = time.perf_counter()
    maps = np.array([look(seed) for seed in range(1, runs + 1)])
    each = (time.perf_counter() - begun) / runs
    mean, variance = maps.mean(axis=0), maps.var(axis=0, ddof=1)
    lit = mean > 0.05 * np.median(mean[mean > 0.0])
    return 1.0 / (float(np.median(variance[lit] / mean[lit] ** 2)) * each), float(mean[lit].mean())


def mitsuba_row() -> None:
    """The chamber with satin paint, seen from 55°, by both."""
    import mitsuba as mi  # noqa: PLC0415 - only with --peers

    mi.set_variant("scalar_rgb")
    moved = mi.ScalarTransform4f
    observer, screen = et.Observer(55, 0, 1000), et.Screen(50, 25, 126, 63)
    paint = et.bsdf.RoughCoat(roughness=0.2, index=1.5, base_reflectance=0.8)
    wanted = float(paint.reflectance(20.0))

    def wall(base: float) -> dict[str, Any]:
        coat = {"type": "roughplastic", "distribution": "ggx", "alpha": 0.2, "int_ior": 1.5, "ext_ior": 1.0}
        inner = {**coat, "diffuse_reflectance": {"type": "rgb", "value": base}}
        return {"type": "twosided", "bsdf": inner}

    def reflectance(base: float) -> float:
        bsdf, at, context = mi.load_dict(wall(base)), mi.SurfaceInteraction3f(), mi.BSDFContext()
        at.wi = mi.Vector3f(math.sin(math.radians(20.0)), 0.0, math.cos(math.radians(20.0)))
        numbers = np.random.default_rng(1).random((20_000, 3)).tolist()
        return float(np.mean([bsdf.sample(context, at, a, mi.Point2f(b, c))[1][0] for a, b, c in numbers]))

    # Linear in the reflectance of the base.
    low, high = reflectance(0.2), reflectance(1.0)
    base = 0.2 + 0.8 * (wanted - low) / (high - low)
    _, up, _ = screen.axes(observer)
    eye = np.asarray(observer.position).tolist()
    light = {"type": "area", "radiance": {"type": "rgb", "value": 0.96 / (math.pi**2 * 2.5**2)}}
    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    lamps = {
        f"lamp{k}": {
            "type": "disk",
            "to_world": moved().translate([x, y, 0.1]) @ moved().scale(2.5),
            "emitter": light,
            "bsdf": black,
        }
        for k, (x, y) in enumerate((x, y) for x in (-4.5, 4.5) for y in (-4.5, 4.5))
    }
    film = {"type": "hdrfilm", "width": 126, "height": 63, "rfilter": {"type": "box"}, "pixel_format": "luminance"}
    there = moved().look_at(origin=eye, target=[0, 0, 0], up=np.asarray(up).tolist())
    theirs = mi.load_dict(
        {
            "type": "scene",
            **lamps,
            "wall": {"type": "cylinder", "p0": [0, 0, 0], "p1": [0, 0, 21.4], "radius": 21.5, "bsdf": wall(base)},
            "base": {"type": "disk", "to_world": moved().scale(21.5), "bsdf": wall(base)},
            "integrator": {"type": "path", "max_depth": -1, "rr_depth": 100},
            "sensor": {
                "type": "perspective",
                "fov": 2 * math.degrees(math.atan(25 / 1000)),
                "fov_axis": "x",
                "to_world": there,
                "film": film,
                "sampler": {"type": "independent", "sample_count": 64},
            },
        }
    )
    scene = chamber({"kind": "bsdf", "bsdf": paint})
    walls = {"": scene, ", its table": chamber({"kind": "bsdf", "bsdf": tabled(paint)})}

    def ours(scene: et.Scene, seed: int, *, gather: bool) -> Array:
        how = et.PathTracing(rays_per_pixel=1024, seed=seed + 100, gather=gather)
        return np.nan_to_num(np.asarray(et.luminance_map(scene, observer, screen, method=how).values)) * 1e-6

    peer, their_mean = efficiency(lambda seed: np.asarray(mi.render(theirs, seed=seed, spp=64))[..., 0])
    row("satin chamber from 55°: mitsuba", f"{peer:.1f} /s", f"mean {their_mean:.3g} cd/mm²")
    for (wall, made), (name, gather) in itertools.product(
        walls.items(), (("etendue", False), ("etendue, gather", True))
    ):
        own, own_mean = efficiency(lambda seed, made=made, gather=gather: ours(made, seed, gather=gather))
        row(
            f"satin chamber from 55°: {name}{wall}",
            f"{own:.1f} /s",
            f"{own / peer:.2f} × mitsuba, mean {own_mean:.3g}",
        )

    # Forwards: rays from the lamps, each scatter connected to the eye.
    particles = mi.load_dict({"type": "ptracer", "max_depth": -1, "rr_depth": 100})
    eyes = {"name": "eye", "theta": 55, "phi": 0, "distance": 1000,
            "screen": {"width": 50, "height": 25, "columns": 126, "rows": 63}}  # fmt: skip

    def image(scene: et.Scene, seed: int) -> Array:
        seen = scene.replace(observers=[eyes], detectors=[{"kind": "image", "name": "image", "observer": "eye"}])
        return np.nan_to_num(np.asarray(et.trace(seen, rays=1e6, seed=seed).images["image"].values)) * 1e-6

    peer, their_mean = efficiency(
        lambda seed: np.asarray(mi.render(theirs, integrator=particles, seed=seed, spp=64))[..., 0]
    )
    row("satin chamber, light image: mitsuba ptracer", f"{peer:.2f} /s", f"mean {their_mean:.3g} cd/mm²")
    for wall, made in walls.items():
        own, own_mean = efficiency(lambda seed, made=made: image(made, seed))
        row(
            f"satin chamber, light image: etendue{wall}",
            f"{own:.2f} /s",
            f"{own / peer:.2f} × mitsuba, mean {own_mean:.3g}",
        )


def asked(bsdf: et.Bsdf, incident: Array, to: Array) -> tuple[float, float]:
    """The least times of a sample and of a value [s]."""
    drawn = min(timed(lambda: bsdf.sample(incident, SAMPLES, seed=2))[0] for _ in range(TIMES))
    valued = min(timed(lambda: bsdf.evaluate(incident, to))[0] for _ in range(TIMES))
    return drawn / SAMPLES, valued / SAMPLES


def chambers(scenes: Mapping[str, et.Scene], rays: int) -> dict[str, Array]:
    """Times of a ray of each chamber [s], without setting it up, by round."""
    found: dict[str, list[float]] = {name: [] for name in scenes}
    for _ in range(ROUNDS):
        for name, scene in scenes.items():
            few, all_ = (timed(lambda scene=scene, n=n: et.trace(scene, rays=n, seed=1))[0] for n in (FEW, rays))
            found[name].append((all_ - few) / (rays - FEW))
    return {name: np.array(times) for name, times in found.items()}


def set_up() -> None:
    """Processor seconds until a rough surface first tells what it reflects."""

    def seconds(bsdf: et.Bsdf) -> float:
        begun = time.process_time()
        bsdf.reflectance(10.0, media=(1.0, 1.5))
        return time.process_time() - begun

    made: dict[str, Callable[..., et.Bsdf]] = {
        "rough-metal": lambda **facets: et.bsdf.RoughMetal(index=0.96, extinction=6.69, **facets),
        "rough-coat": lambda **facets: et.bsdf.RoughCoat(index=1.5, base_reflectance=0.8, **facets),
        "rough-interface": et.bsdf.RoughInterface,
    }
    for distribution in ("ggx", "beckmann"):
        for kind, make in made.items():
            alike = seconds(make(distribution=distribution, roughness=0.4))
            unlike = seconds(make(distribution=distribution, roughness=0.4, roughness_across=0.2))
            row(f"set-up of {kind}, {distribution}, alike, unlike", f"{alike:.2f}, {unlike:.2f} s")
    metals = {}
    for count in (1, 41):
        colours = {"wavelength": np.linspace(400, 700, count).tolist(), "values": np.linspace(0.8, 0.9, count).tolist()}
        metals[count] = seconds(et.bsdf.RoughMetal(roughness=0.4, roughness_across=0.2, reflectance=colours))
    row(
        "set-up of a metal of unlike roughness, 41 wavelengths",
        f"{metals[41]:.2f} s",
        f"{metals[41] / metals[1]:.1f} × that of one",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=float, default=1e6)
    parser.add_argument(
        "--only", default="", help="some of the surfaces, as 'table,coated'; the Lambertian one is always there"
    )
    parser.add_argument("--peers", action="store_true", help="beside Radiance and Mitsuba")
    parser.add_argument("--set-up", action="store_true", help="set-up of rough surfaces alone")
    given = parser.parse_args()
    if given.set_up:
        set_up()
        return
    rays = int(given.rays)

    measured = table()
    for theta in ANGLES:
        truth, found = exact(theta), float(measured.reflectance(theta))
        row(
            f"reflectance of the table at {theta:g}°",
            f"{found:.4f} of {truth:.4f}",
            f"{100 * (found / truth - 1):+.2f} %",
        )

    bsdfs: dict[str, et.Bsdf] = {
        "lambertian": et.bsdf.Lambertian(reflectance=0.7),
        "gaussian": et.bsdf.Gaussian(peak=LOBE / (2 * math.pi * SIGMA**2), sigma=SIGMA),
        "coated": et.bsdf.Coated(index=1.5, base_reflectance=0.8),
        "rough-metal": et.bsdf.RoughMetal(roughness=0.2, index=0.96, extinction=6.69),
        "rough-coat": (paint := et.bsdf.RoughCoat(roughness=0.2, index=1.5, base_reflectance=0.8)),
        "table": measured,
        "table-of-paint": tabled(paint),
    }
    if only := [name for name in given.only.split(",") if name]:
        if unknown := set(only) - set(bsdfs):
            parser.error(f"no such surface: {', '.join(sorted(unknown))}; known: {', '.join(bsdfs)}")
        bsdfs = {name: bsdf for name, bsdf in bsdfs.items() if name in ("lambertian", *only)}
    incident, to = (
        direction(40.0, 180.0),
        et.bsdf.Lambertian(reflectance=1.0).sample(direction(40.0, 0.0), SAMPLES, seed=1),
    )
    black = chamber({"kind": "bsdf", "bsdf": et.bsdf.Lambertian(reflectance=0.0)})
    scenes = {name: chamber({"kind": "bsdf", "bsdf": bsdf}) for name, bsdf in bsdfs.items()}
    for name, scene in scenes.items():
        bsdfs[name].sample(incident, 10, seed=1)
        assert et.trace(scene, rays=1000, seed=1).ledger.closes  # noqa: S101 - what does not close is no benchmark
    gone = {name: ways(scene) for name, scene in scenes.items()}
    drawn, valued = "a sample", "a value"
    single = {name: dict(zip((drawn, valued), asked(bsdf, incident, to), strict=True)) for name, bsdf in bsdfs.items()}
    for name in bsdfs:
        for what, took in single[name].items():
            row(f"{name}: {what}", f"{1e9 * took:.0f} ns", f"{took / single['lambertian'][what]:.2f} × lambertian")
    times = chambers({"black": black, **scenes}, rays)

    def figures(name: str) -> dict[str, Array]:
        return {
            "a ray of the chamber": times[name],
            "a segment there": times[name] / gone[name],
            "a bounce there": (times[name] - times["black"]) / (gone[name] - 1.0),
        }

    for name in bsdfs:
        for what, took in figures(name).items():
            plain = figures("lambertian")[what]
            low, high = np.percentile(took / plain, [25, 75])
            ratio = f"{np.median(took) / np.median(plain):.2f} × lambertian"
            row(f"{name}: {what}", f"{1e9 * np.median(took):.0f} ns", f"{ratio} ({low:.2f} to {high:.2f})")
    if given.peers:
        radiance_row()
        mitsuba_row()


if __name__ == "__main__":
    main()
