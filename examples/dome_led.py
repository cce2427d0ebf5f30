"""Section 3.3 of the thesis with an LED made of parts: from its ray file back to what the LED itself looks like.

    python examples/dome_led.py              # 200 000 rays and coarse grids, seconds
    python examples/dome_led.py --full       # four million rays: the table of docs/chapter-3.md

A die in a silicone dome is traced forwards; its rays become a TM-25 file. From the file alone light fields are fitted, on
the plane of the die, on the dome, on both, and where étendue thinks best; and the gridded algorithm of section 3.3.2 is
run. Their maps are compared with maps of the LED itself, by lines of sight through dome and base.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import etendue as et
from etendue.luminance.gridded_map import gridded_luminance_map
from experiments import led
from experiments.panels import QUICK, draw_maps, measures, noise, print_table

OBSERVERS = [et.Observer(theta=theta, phi=0, distance=1000) for theta in (0, 30, 60, 90)]
PIXEL, PARALLELS, THRESHOLD = 0.125, 16, 0.01
"""Of section 3.3.3: Δd [mm], 961 cells on the dome, E [%]."""


def fields(rays: et.RaySet, *, full: bool) -> dict[str, et.LightField]:
    """Light fields on several carrier surfaces; in a hurry on two of them."""
    surfaces = {"die plane": et.Disk(radius=led.CARRIER, z=led.DIE_TOP), "window and dome": et.Dome(radius=led.CARRIER)}
    if not full:
        return {name: et.LightField.fit(rays, surface, depths=QUICK) for name, surface in surfaces.items()}
    surfaces |= {"hemisphere": et.Hemisphere(radius=led.CARRIER), "automatic": "auto"}
    return {name: et.LightField.fit(rays, surface) for name, surface in surfaces.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=200_000)
    parser.add_argument("--full", action="store_true", help="four million rays, fine grids, 50 × 50 pixels")
    parser.add_argument("--output", type=Path, default=Path("dome-led"), help="folder for ray file and figure")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    rays, pixels, lines = (4_000_000, 50, 1024) if options.full else (options.rays, 25, 64)
    screen = et.Screen(2.5, 2.5, pixels, pixels)

    model = et.Scene(name="dome LED", **led.PARTS)
    truth = et.luminance_map(model, OBSERVERS, screen, rays_per_pixel=lines)
    file = options.output / "dome-led.tm25ray"
    et.write_rays(file, led.ray_file(rays))
    near_field = et.read_rays(file)
    print(f"{len(near_field):,} rays of {rays:,} leave the LED: {near_field.total_flux:.2f} lm of {led.FLUX:g} lm")

    start = time.perf_counter()
    methods = {}
    for name, field in fields(near_field, full=options.full).items():
        methods[name] = et.luminance_map(field, OBSERVERS, screen)
        print(f"{name}: {field.surface.spec}, score {field.report.score:.4f} ± {field.report.score_error:.4f}")
    grid = et.GriddedSource.fit(near_field, et.Dome(radius=led.CARRIER), PIXEL, THRESHOLD, PARALLELS)
    methods["gridded"] = [gridded_luminance_map(grid, observer, screen) for observer in OBSERVERS]
    print(f"gridded: {grid.notes[0]}")
    print(f"fitted and mapped in {time.perf_counter() - start:.0f} s")

    print("\nTable 3.3 with this LED: NCC / NRMSE of eq. 3.6 / true NRMSE [%]\n")
    rows = []
    for i, observer in enumerate(OBSERVERS):
        cells = [" / ".join(measures(maps[i], truth[i])) for maps in methods.values()]
        brightest = float(truth[i].values.max())
        rows.append([f"({observer.theta:g}°, {observer.phi:g}°)", f"{brightest:.2e}", noise(truth[i]), *cells])
    print_table(["observer", "brightest pixel [cd/m²]", "its noise", *methods], rows)
    titles = [*(f"field: {name}" if name != "gridded" else name for name in methods), "the LED itself"]
    pictures = [
        (f"θ = {observer.theta:g}°", [*(maps[i] for maps in methods.values()), truth[i]])
        for i, observer in enumerate(OBSERVERS)
    ]
    draw_maps(options.output / "dome-led.png", titles, pictures, kind="root", size=1.9)
    print(f"\nfigure and ray file: {options.output}/")


if __name__ == "__main__":
    main()
