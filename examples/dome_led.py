"""Section 3.3 of the thesis with an LED made of parts: from its ray file back to what the LED itself looks like.

    python examples/dome_led.py              # 200 000 rays and coarse grids, seconds
    python examples/dome_led.py --full       # four and forty million rays: the table of docs/chapter-3.md

A die in a silicone dome is traced forwards; its rays become a TM-25 file. From the file alone light fields are fitted: on
the plane of the die, on the dome, on a low box about the die, and where étendue thinks best; and the gridded algorithm of
section 3.3.2 is run. Their maps are compared with maps of the LED itself, by lines of sight through dome and base.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import etendue as et
from etendue.luminance.gridded_map import gridded_luminance_map
from experiments import led
from experiments.differences import draw_decades
from experiments.panels import QUICK, draw_maps, measures, noise, print_table

OBSERVERS = [et.Observer(theta=theta, phi=0, distance=1000) for theta in (0, 30, 60, 90)]
SEVENTY = et.Observer(theta=70, phi=0, distance=1000)
"""Of figure 3.10."""

PIXEL, PARALLELS = 0.125, 16
"""Of section 3.3.3: Δd [mm], 961 cells on the dome."""

THRESHOLDS = (0.5, 0.01)
"""E [%]: one for some million rays, and the best of figure 3.13, which had 10⁹."""

THESIS = ((99.0, 5.2), (97.9, 7.3), (97.9, 5.6), (74.9, 8.9))
"""Table 3.3: NCC and NRMSE of eq. 3.6 [%], against photographs."""

Maps = dict[str, Sequence[et.LuminanceMap]]


def fields(rays: et.RaySet, *, full: bool) -> dict[str, et.LightField]:
    """Light fields on several carrier surfaces; in a hurry on three of them."""
    surfaces = {
        "die plane": et.Disk(radius=led.CARRIER, z=led.DIE_TOP),
        "window and dome": et.Dome(radius=led.CARRIER),
        "low box": led.LOW_BOX,
    }
    if not full:
        return {name: et.LightField.fit(rays, surface, depths=QUICK) for name, surface in surfaces.items()}
    surfaces |= {"hemisphere": et.Hemisphere(radius=led.CARRIER), "automatic": "auto"}
    return {name: et.LightField.fit(rays, surface) for name, surface in surfaces.items()}


def seen_by_fields(rays: et.RaySet, screen: et.Screen, *, full: bool) -> Maps:
    """Maps of the light fields, and how well each predicts rays that were held out."""
    found: Maps = {}
    for name, field in fields(rays, full=full).items():
        report = field.report
        print(f"field, {name}: {field.surface.spec}")
        unmet = max(0.0, 1 - field.total_flux / rays.total_flux)
        print(f"    {unmet:.2%} of the flux not met, score {report.score:.4f} ± {report.score_error:.4f} per ray")
        found[f"field, {name}"] = et.luminance_map(field, [*OBSERVERS, SEVENTY], screen)
    return found


def seen_by_patches(rays: et.RaySet, traced: int, screen: et.Screen) -> Maps:
    """Maps of the patches of section 3.3.2, named by how many rays were traced."""
    found: Maps = {}
    for threshold in THRESHOLDS:
        grid = et.GriddedSource.fit(rays, et.Dome(radius=led.CARRIER), PIXEL, threshold, PARALLELS)
        name = f"gridded, {threshold:g} %, {traced / 1e6:g} M rays"
        print(f"{name}: {grid.notes[0]}")
        found[name] = [gridded_luminance_map(grid.as_printed, observer, screen) for observer in (*OBSERVERS, SEVENTY)]
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=200_000)
    parser.add_argument("--full", action="store_true", help="four and forty million rays, fine grids, 50 × 50 pixels")
    parser.add_argument("--output", type=Path, default=Path("dome-led"), help="folder for ray file and figures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    rays, pixels, lines = (4_000_000, 50, 1024) if options.full else (options.rays, 25, 64)
    screen = et.Screen(2.5, 2.5, pixels, pixels)

    model = et.Scene(name="dome LED", **led.PARTS)
    et.draw_scene(model, options.output / "dome-led-section.png", section=["y=0"], rays=14, window=(-3, 3, -0.5, 2))
    truth = et.luminance_map(model, [*OBSERVERS, SEVENTY], screen, method=et.PathTracing(rays_per_pixel=lines))
    file = options.output / "dome-led.tm25ray"
    et.write_rays(file, led.ray_file(rays))
    near_field = et.read_rays(file)
    print(f"{len(near_field):,} rays of {rays:,} leave the LED: {near_field.total_flux:.2f} lm of {led.FLUX:g} lm")

    start = time.perf_counter()
    methods = {**seen_by_fields(near_field, screen, full=options.full), **seen_by_patches(near_field, rays, screen)}
    print(f"fitted and mapped in {time.perf_counter() - start:.0f} s")
    if options.full:
        methods |= seen_by_patches(led.ray_file(10 * rays), 10 * rays, screen)

    print("\nTable 3.3 with this LED: NCC / NRMSE of eq. 3.6 / true NRMSE [%]\n")
    rows = [
        [name, *(" / ".join(measures(*pair)) for pair in zip(m[:4], truth[:4], strict=True))]
        for name, m in methods.items()
    ]
    rows += [
        ["thesis, 1000 M rays", *(f"{ncc} / {nrmse}" for ncc, nrmse in THESIS)],
        ["noise of the LED's own map", *(noise(lmap) for lmap in truth[:4])],
        ["its brightest pixel [cd/m²]", *(f"{lmap.values.max():.2e}" for lmap in truth[:4])],
    ]
    print_table(["", *(f"({o.theta:g}°, {o.phi:g}°)" for o in OBSERVERS)], rows)

    shown = [name for name in methods if name.startswith("field") and "hemi" not in name]
    shown += [name for name in methods if name.startswith(f"gridded, {THRESHOLDS[0]:g} %")][-1:]
    pictures = [
        (f"θ = {observer.theta:g}°", [*(methods[name][i] for name in shown), truth[i]])
        for i, observer in enumerate(OBSERVERS)
    ]
    heading = "An LED with a silicone dome, from its ray file and by itself"
    draw_maps(options.output / "dome-led.png", heading, [*shown, "the LED itself"], pictures, kind="root", size=1.9)
    seen = {name: methods[name][-1] for name in shown if "dome" in name or name.startswith("gridded")}
    heading = "Figure 3.10: an LED with a silicone dome, from 70°"
    draw_decades(options.output / "figure-3.10.png", heading, seen | {"the LED itself": truth[-1]}, decades=4)
    print(f"\nfigures and ray file: {options.output}/")


if __name__ == "__main__":
    main()
