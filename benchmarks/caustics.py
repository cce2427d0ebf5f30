"""Maps of light behind glass: many seeds against a long run, pixel by pixel; and what rays forwards cost.

    python benchmarks/caustics.py [SEEDS] [RAYS_PER_PIXEL] [FORWARD_RAYS] [LINES_PER_PIXEL]

Prints for three scenes how the deviations of the pixels are spread in units of their stated errors (standard normal: -1.00,
0.00 and 1.00 at 16, 50 and 84 %), how many lie beyond 2, 3 and 4 and the farthest, the light of all pixels and its error,
and the time with and without rays forwards. What is right is found by another route: all that diffuse surfaces send to the
eye directly by the light image of `etendue.trace`, the rest by plain lines of sight, spread evenly over the pixel and by
the cosine law: nothing is shared, guided or looked for beforehand.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import etendue as et
import numpy as np
from etendue import _core
from etendue.luminance.methods import PASSES
from etendue.luminance.scene_map import MOST_EVENTS
from etendue.scene import compile_scene

LAMBERTIAN = {"kind": "lambertian", "reflectance": 0.8}

BALL_OVER_PAPER = {
    "sources": [{"kind": "surface", "shape": {"kind": "disk", "radius": 0.5}, "flux": 100, "at": [0, 0, 30],
                 "toward": [0, 0, -1]}],
    "solids": [{"shape": {"kind": "ball", "radius": 5}, "medium": {"index": 1.5}, "at": [0, 0, 10]}],
    "surfaces": [{"shape": {"kind": "rectangle", "width": 40, "height": 40}, "finish": LAMBERTIAN}],
    "observers": [{"name": "eye", "theta": 55, "phi": 0, "distance": 300,
                   "screen": {"width": 30, "height": 18, "columns": 30, "rows": 18}}],
}  # fmt: skip

LENS_AND_MIRROR = {
    "media": {"tinted": {"index": 1.5, "absorption": 0.02}},
    "sources": [{"kind": "surface", "shape": {"kind": "rectangle", "width": 2, "height": 1}, "flux": 100, "at": [-6, 1, 14],
                 "toward": [0.2, 0.1, -1]},
                {"kind": "surface", "shape": {"kind": "rectangle", "width": 6, "height": 2}, "flux": 40, "at": [9, -2, 6],
                 "toward": [1, 0.1, 0.3]}],
    "solids": [{"medium": "tinted", "at": [-5.5, 1.5, 9], "rotation": [6, 8, 0], "shape":
                {"kind": "lens", "radius": 4, "thickness": 2.5, "front": {"radius_of_curvature": 14},
                 "back": {"radius_of_curvature": -9, "conic": -0.5}}}],
    "surfaces": [{"shape": {"kind": "rectangle", "width": 40, "height": 30}, "finish": LAMBERTIAN},
                 {"shape": {"kind": "conic", "radius_of_curvature": 22, "radius": 6}, "at": [17, -2, 7],
                  "toward": [-1, 0, -0.3], "finish": {"kind": "mirror", "reflectance": 0.85}}],
    "observers": [{"name": "eye", "theta": 48, "phi": 250, "distance": 300, "target": [2, 0, 2],
                   "screen": {"width": 40, "height": 26, "columns": 28, "rows": 18}}],
}  # fmt: skip

BALL_IN_A_CUP = {
    "sources": [{"kind": "surface", "shape": {"kind": "rectangle", "width": 2, "height": 1}, "flux": 300,
                 "at": [0.4, 0.2, 0]}],
    "solids": [{"shape": {"kind": "ball", "radius": 4}, "medium": "PMMA", "at": [0.3, -0.5, 7]}],
    "surfaces": [{"shape": {"kind": "cylinder", "radius": 8, "height": 6}, "finish":
                  {"kind": "lambertian", "reflectance": 0.9}}],
    "observers": [{"name": "eye", "theta": 30, "phi": 20, "distance": 1000, "target": [0, 0, 5],
                   "screen": {"width": 26, "height": 26, "columns": 24, "rows": 24}}],
}  # fmt: skip

SCENES: dict[str, dict[str, Any]] = {
    "ball over paper": BALL_OVER_PAPER,
    "lens and mirror": LENS_AND_MIRROR,
    "ball in a cup": BALL_IN_A_CUP,
}


def right(keys: dict[str, Any], rays: float, lines: int) -> tuple[np.ndarray, np.ndarray]:
    """Luminance [cd/m²] and its error, by rays forwards and plain lines of sight."""
    scene = et.Scene(**keys, detectors=[{"name": "image", "kind": "image", "observer": "eye"}])
    image = et.trace(scene, rays, 1 << 40).images["image"]
    observer = scene.observers[0]
    core = _core.Scene({**compile_scene(scene).record, "detectors": []})
    view = observer.screen.screen().core_view(observer.observer())
    looks = 1e6 * _core.look_at_scene(core, view, lines // PASSES, 1 << 41, MOST_EVENTS, "scattered", 0, PASSES)[0]
    error = np.std(looks, axis=0, ddof=1) / np.sqrt(PASSES)
    # Where no ray arrived, the image states none.
    return image.values + np.mean(looks, axis=0), np.hypot(np.nan_to_num(image.standard_error), error)


def main(seeds: int, rays_per_pixel: int, rays: float, lines: int) -> None:
    """Prints the comparison of each scene."""
    for name, keys in SCENES.items():
        scene = et.Scene(**keys)
        truth, truth_error = right(keys, rays, lines)
        whole, known = truth.sum(), np.sqrt((truth_error**2).sum())
        for forwards in (None, 0):
            off, light, seconds = [], [], 0.0
            for seed in range(1, seeds + 1):
                started = time.perf_counter()
                (lmap,) = et.luminance_map(scene, rays_per_pixel=rays_per_pixel, seed=seed, forward_rays=forwards)
                seconds += time.perf_counter() - started
                sure = np.hypot(lmap.standard_error, truth_error)
                # A pixel that is sure of what is wrong counts as infinitely far off; one of which both know all is left out.
                with np.errstate(divide="ignore", invalid="ignore"):
                    z = (lmap.values - truth) / sure
                off.append(z[~np.isnan(z)])
                light.append([lmap.values.sum(), np.sqrt((lmap.standard_error**2).sum())])
            z = np.concatenate(off)
            sums, errors = np.array(light).T
            totals = (sums - whole) / np.hypot(errors, known)
            low, middle, high = np.percentile(z, [16, 50, 84])
            print(f"{name}, {'rays forwards by default' if forwards is None else 'without rays forwards'}:")
            print(
                f"  pixels: z at 16, 50, 84 %: {low:.2f} {middle:.2f} {high:.2f}; beyond 2: {(np.abs(z) > 2).mean():.1%}",
                end="",
            )
            print(f", 3: {(np.abs(z) > 3).mean():.2%}, 4: {(np.abs(z) > 4).mean():.2%}, farthest {np.abs(z).max():.1f}")
            print(
                f"  all light: {sums.mean() / whole - 1:+.2%} ± {sums.std(ddof=1) / whole / np.sqrt(seeds):.2%}", end=""
            )
            print(
                f" ({known / whole:.2%} of the long run), lowest run {sums.min() / whole - 1:+.1%}, "
                f"rms z {np.sqrt((totals**2).mean()):.2f}"
            )
            print(f"  {seconds / seeds:.3f} s per map")


if __name__ == "__main__":
    given = [int(float(word)) for word in sys.argv[1:]]
    main(*(given + [40, 256, 20_000_000, 1 << 15][len(given) :]))
