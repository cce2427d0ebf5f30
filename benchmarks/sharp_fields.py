"""How sharp light fields are: a packaged LED with strays on a plane and from three sides, and a checkerboard of 31 µm.

The LED (tests/oracles/packaged_led.py) is a structured die below a window, so that no plane is sharp for all directions,
with a glow and 0.3 % of strays over 20 × 20 mm. Its field is drawn from, and the drawn rays are counted on a plane in
200 × 200 cells; beside it stand the project's 2-D smoother on the counts of the file on that very plane, drawn from
likewise, and the best Gaussian, whose width knows the answer. NCC and NRMSE (true RMSE over the maximum) are against the
exitance by quadrature. Maps are against the luminance in closed form, beside the best of four cones under every filter,
chosen knowing the truth.

The checkerboard: squares of 31.25 µm over 2 mm on a plane, Lambertian, with 0.3 % of strays over 20 × 20 mm. Contrast is
(bright - dark)/(bright + dark) over the middles of the squares in a map along the axis; that of the truth is 1.

python benchmarks/sharp_fields.py [--rays 1e5] [--drawn 2e7] [--checkerboard 1e6]
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
from etendue.denoising.smoothing import smooth_counts

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from light_field_maps import filtered
from oracles.packaged_led import PackagedLed

Array = Any
LED, PLANE, CELLS = PackagedLed(), -0.45, 200
SQUARES, SIDE, STRAYS = 64, 2.0, 0.003
ACCEPTANCES = (1.5, 5.0, 15.0, 30.0)


def on_plane(position: Array, direction: Array) -> Array:
    """Counts in the cells of a square about the die, row along y."""
    hit = position + ((PLANE - position[:, 2]) / direction[:, 2])[:, None] * direction
    x, y = (hit[:, :2] - LED.centre).T
    return np.histogram2d(y, x, bins=CELLS, range=[[-LED.side / 2, LED.side / 2]] * 2)[0]


def verdict(name: str, found: Array, truth: Array, seconds: float | None = None) -> None:
    """One line: NCC and NRMSE."""
    ncc = np.corrcoef(found.ravel(), truth.ravel())[0, 1]
    nrmse = np.sqrt(np.mean((found - truth) ** 2)) / truth.max()
    print(
        f"  {name:44s} NCC {ncc:.4f}  NRMSE {nrmse:.4f}" + ("" if seconds is None else f"  {seconds:6.1f} s"),
        flush=True,
    )


def gaussian(counts: Array, width: float) -> Array:
    """Counts convolved with a Gaussian [cells]."""
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(CELLS), np.fft.fftfreq(CELLS)))
    return np.fft.ifft2(np.fft.fft2(counts) * np.exp(-2 * (np.pi * width * frequency) ** 2)).real


def led(rays: int, drawn: int) -> None:
    """Plane and maps."""
    position, direction = LED.rays(rays, seed=1)
    ray_set = et.RaySet(position, direction, np.full(rays, LED.total_flux / rays))
    truth = LED.exitance(z=PLANE, side=LED.side, cells=CELLS, directions=24) / LED.total_flux
    counts = on_plane(position, direction)
    print(f"packaged LED, {rays:,} rays, on z = {PLANE} mm; {drawn:,} rays drawn")
    widths = np.linspace(0.5, 5.0, 37)
    errors = [np.mean((gaussian(counts, w) / rays - truth) ** 2) for w in widths]
    verdict("best Gaussian, not drawn", gaussian(counts, widths[int(np.argmin(errors))]) / rays, truth)
    start = time.perf_counter()
    smooth = smooth_counts(counts, counts, np.ones_like(counts)).mass / rays
    seconds = time.perf_counter() - start
    verdict("2-D smoother on that plane, not drawn", smooth, truth, seconds)
    verdict("2-D smoother on that plane, drawn", np.random.default_rng(3).poisson(smooth * drawn) / drawn, truth)
    fields = {}
    for name, surface in (("stated", et.Plane(z=PLANE)), ("automatic", "auto")):
        start = time.perf_counter()
        fields[name] = et.LightField.fit(ray_set, surface)
        seconds = time.perf_counter() - start
        sample = fields[name].sample(drawn, seed=5)
        verdict(
            f"light field, {name} surface, drawn", on_plane(sample.position, sample.direction) / drawn, truth, seconds
        )
    print(f"  automatic: {fields['automatic'].surface.spec}")
    for theta in (0, 30, 60):
        observer, screen = et.Observer(theta, 25, 800, target=(*LED.centre, PLANE)), et.Screen(2.2, 2.2, 128, 128)
        right, up, _ = screen.axes(observer)
        at = (np.arange(128) + 0.5) / 128 - 0.5
        v, u = (a.ravel() for a in np.meshgrid(-at * 2.2, at * 2.2, indexing="ij"))
        points = np.array(observer.target) + u[:, None] * right + v[:, None] * up
        sight = observer.position - points
        sight /= np.linalg.norm(sight, axis=1)[:, None]
        true = LED.luminance(points=points, directions=sight).reshape(128, 128)
        for name, field in fields.items():
            verdict(f"map from {theta}°, {name}", et.luminance_map(field, observer, screen).values, true)
        found = {}
        for acceptance in ACCEPTANCES:
            cone = et.luminance_map(ray_set, observer, screen, method=et.Cone(acceptance=acceptance))
            found |= {f"cone of {acceptance}°, {name}": np.nan_to_num(lmap.values) for name, lmap in filtered(cone)}
        best = min(found, key=lambda name: np.mean((found[name] - true) ** 2))
        verdict(f"map from {theta}°, {best}", found[best], true)


def checkerboard(rays: int) -> None:
    """Contrast with and without strays."""
    for strays in (0.0, STRAYS):
        rng = np.random.default_rng(1)
        count = int(strays * rays)
        square = rng.integers(0, SQUARES * SQUARES // 2, rays - count)
        row, column = np.divmod(square, SQUARES // 2)
        column = 2 * column + row % 2
        place = (np.stack([column, row], axis=1) + rng.random((rays - count, 2))) * (SIDE / SQUARES) - SIDE / 2
        place = np.concatenate([place, rng.uniform(-10, 10, (count, 2))])
        r, turn = np.sqrt(rng.random(rays)), 2 * np.pi * rng.random(rays)
        k = np.stack([r * np.cos(turn), r * np.sin(turn), np.sqrt(1 - r * r)], axis=1)
        start = time.perf_counter()
        field = et.LightField.fit(et.RaySet(np.column_stack([place, np.zeros(rays)]), k, np.full(rays, 1.0 / rays)))
        seconds = time.perf_counter() - start
        middle = (np.arange(SQUARES) + 0.5) / SQUARES * SIDE - SIDE / 2
        x, y = np.meshgrid(middle, middle)
        points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        luminance = field.luminance(points, np.tile([0.0, 0.0, 1.0], (x.size, 1)))[0].reshape(x.shape)
        bright = (np.add.outer(np.arange(SQUARES), np.arange(SQUARES)) % 2) == 0
        b, d = luminance[bright].mean(), luminance[~bright].mean()
        print(
            f"checkerboard, {rays:,} rays, {strays:.1%} strays: contrast {(b - d) / (b + d):.3f}  {seconds:.1f} s  "
            f"{field.surface.spec}",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=float, default=1e5)
    parser.add_argument("--drawn", type=float, default=2e7)
    parser.add_argument("--checkerboard", type=float, default=1e6, help="rays of the checkerboard")
    options = parser.parse_args()
    led(int(options.rays), int(options.drawn))
    checkerboard(int(options.checkerboard))


if __name__ == "__main__":
    main()
