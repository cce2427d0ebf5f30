"""Section 3.2 of the thesis with a remote phosphor made of parts, bare and under a film of prisms.

    python examples/remote_phosphor.py              # few rays and coarse grids, seconds
    python examples/remote_phosphor.py --full       # four million rays: the tables of docs/chapter-3.md

A luminous plate, darker towards its rim, with and without a film of 240 prisms above it, is traced forwards onto a
hemisphere far around it, prism by prism, as a goniophotometer would record it. From these rays alone the gridded algorithm
and light fields make maps; lines of sight through film and plate make the maps they are compared with.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import etendue as et
import numpy as np
from etendue.luminance.gridded_map import gridded_luminance_map
from etendue.plot import style
from experiments import film
from experiments.panels import LINES, draw_maps, legend_below, measures, new_figure, noise, print_table, save
from experiments.phosphor import BOX, CARRIER, FLUX, TOP, lamp

OBSERVERS = [et.Observer(theta, phi, 1000) for phi in (0, 90) for theta in (0, 30, 60, 80)]
"""Of table 3.2. The prisms run along y: φ = 0° is across them."""

THRESHOLDS = {"bare": (2.1,), "film": (2.1, 0.5, 0.021)}
"""E [%] of the gridded algorithm: the best of figures 3.8 and 3.9, which had 10⁹ rays, and between them one for fewer."""

THESIS = {
    ("bare", 1.0): ((99.7, 2.8), (99.6, 3.5), (99.7, 2.8), (99.3, 3.1)),
    ("film", 1.0): (
        *((99.8, 2.3), (99.3, 4.3), (98.5, 6.3), (86.8, 12.5)),
        *((99.8, 2.7), (99.4, 4.1), (97.7, 7.4), (89.1, 11.2)),
    ),
    ("film", 0.5): (
        *((99.6, 3.3), (99.0, 5.1), (98.0, 6.9), (76.5, 11.9)),
        *((99.5, 3.6), (99.1, 5.0), (96.7, 8.0), (84.4, 12.3)),
    ),
}
"""Tables 3.1 and 3.2: NCC and NRMSE of eq. 3.6 [%], against photographs."""

MAP = 23.0
"""Width and height of the maps [mm]."""


def sources(kind: str, rays: et.RaySet, depths: tuple[int, int, int, int] | None) -> dict[str, et.LightField]:
    """Light fields: on the plane of the topmost surface, as the thesis has it; on a box whose sides shine too; automatic."""
    found = {"field, plane": et.LightField.fit(rays, et.Plane(TOP[kind], 24.2, 24.2, centre=(0, 0)), depths=depths)}
    if kind == "film":
        found["field, box"] = et.LightField.fit(rays, BOX, depths=depths)
    if depths is None:
        found["field, automatic"] = et.LightField.fit(rays, "auto")
        print(f"    automatic: {found['field, automatic'].surface.spec}")
    for name, field in found.items():
        print(f"    {name}: score {field.report.score:.4f} ± {field.report.score_error:.4f} per ray")
    return found


def coarser(lmap: et.LuminanceMap, screen: et.Screen) -> et.LuminanceMap:
    """The same map with fewer pixels, each the mean of a whole number of finer ones."""
    k = lmap.screen.rows // screen.rows
    blocks = (screen.rows, k, screen.columns, k)
    return lmap.replace(
        values=lmap.values.reshape(blocks).mean(axis=(1, 3)),
        standard_error=np.sqrt((lmap.standard_error.reshape(blocks) ** 2).sum(axis=(1, 3))) / k**2,
        rays=lmap.rays.reshape(blocks).sum(axis=(1, 3)),
        screen=screen,
    )


def experiment(kind: str, options: argparse.Namespace) -> dict[float, dict[str, list[et.LuminanceMap]]]:
    """Maps of every method by size of the pixels; ``"truth"`` are those of the lamp itself."""
    scene = lamp(kind)
    start = time.perf_counter()
    result = et.trace(scene, rays=options.rays)
    rays = result.rays.only
    middle = time.perf_counter()
    print(f"\n{kind}: {rays.total_flux:.1f} lm of {FLUX:g} lm leave it in {len(rays):,} rays of {options.rays:,}")
    fields = sources(kind, rays, None if options.full else (2, 2, 2, 2))
    plane = et.Plane(TOP[kind], *CARRIER[kind], centre=(0, 0))
    observers = [
        et.Observer(o.theta, o.phi, o.distance, target=(0, 0, TOP[kind]))
        for o in OBSERVERS
        if kind == "film" or o.phi == 0
    ]
    found: dict[float, dict[str, list[et.LuminanceMap]]] = {}
    for pixel in options.pixels:
        count = round(MAP / pixel)
        screen = et.Screen(MAP, MAP, count, count)
        if pixel == options.pixels[0]:
            # From the axis all azimuths see the same.
            apart = [o for o in observers if o.theta or not o.phi]
            seen = dict(
                zip(
                    apart,
                    et.luminance_map(scene, apart, screen, method=et.PathTracing(rays_per_pixel=options.lines)),
                    strict=True,
                )
            )
            truth = [seen[o] if o in seen else seen[observers[0]].replace(observer=o) for o in observers]
        else:
            truth = [coarser(lmap, screen) for lmap in truth]
        found[pixel] = {"truth": truth}
        for threshold in THRESHOLDS[kind]:
            grid = et.GriddedSource.fit(rays, plane, pixel, threshold)
            maps = [gridded_luminance_map(grid.as_printed, observer, screen) for observer in observers]
            found[pixel][f"gridded, {threshold:g} %"] = maps
            print(f"    Δd = {pixel:g} mm, E = {threshold:g} %: {grid.notes[0]}")
        for name, field in fields.items():
            found[pixel][name] = et.luminance_map(field, observers, screen)
    print(
        f"    traced in {middle - start:.0f} s; fitted, and looked at all ways, in {time.perf_counter() - middle:.0f} s"
    )
    return found


def print_tables(kind: str, found: dict[float, dict[str, list[et.LuminanceMap]]]) -> None:
    """One row for each observer, three measures for each method."""
    for pixel, maps in found.items():
        print(f"\n{kind}, Δd = {pixel:g} mm: NCC / NRMSE of eq. 3.6 / true NRMSE [%]\n")
        truth = maps["truth"]
        methods = {name: seen for name, seen in maps.items() if name != "truth"}
        rows = [
            [
                f"({t.observer.theta:g}°, {t.observer.phi:g}°)",
                f"{t.values.max():,.0f}",
                noise(t),
                *(" / ".join(measures(seen[i], t)) for seen in methods.values()),
                " / ".join(map(str, THESIS[kind, pixel][i])) if (kind, pixel) in THESIS else "",
            ]
            for i, t in enumerate(truth)
        ]
        print_table(["observer", "brightest pixel [cd/m²]", "its noise", *methods, "thesis, 10⁹ rays"], rows)


def draw_sections(path: Path, bare: list[et.LuminanceMap], film: list[et.LuminanceMap]) -> None:
    """Figure 3.7 and what it stands on: horizontal cuts at several angles, with and without the film."""
    made = new_figure(8.8, 3.7, "A remote phosphor under a film of prisms, and bare (dotted): horizontal cuts by θ")
    panels = made.subplots(1, 2, sharey=True)
    for axes, phi in zip(panels, (0, 90), strict=True):
        for colour, theta in zip(LINES, (0, 30, 60, 80), strict=False):
            for maps, dashes in ((film, "-"), (bare, ":")):
                (lmap,) = [m for m in maps if m.observer.theta == theta and m.observer.phi in {phi, 0}][-1:]
                # The bare plate looks the same from all azimuths; but φ = 90° tilts the screen's other axis.
                cut = et.cross_section(lmap, y=0.1) if lmap.observer.phi == phi else et.cross_section(lmap, x=0.1)
                label = f"{theta}°" if dashes == "-" else None
                axes.stairs(
                    cut.values,
                    np.append(cut.position - cut.pitch / 2, cut.position[-1] + cut.pitch / 2),
                    baseline=None,
                    color=colour,
                    linestyle=dashes,
                    label=label,
                )
        style.put_title(axes, "across the prisms (φ = 0°)" if phi == 0 else "along the prisms (φ = 90°)")
        axes.set_xlabel(f"{style.HORIZONTAL} [mm]")
    panels[0].set_ylabel(f"{cut.quantity} [{cut.unit}]")
    legend_below(made, panels[0])
    save(made, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=50_000)
    parser.add_argument("--lines", type=int, default=4, help="lines of sight per pixel of the maps of the lamp itself")
    parser.add_argument("--pixel", type=float, default=1.0, help="width of a pixel [mm]")
    parser.add_argument("--full", action="store_true", help="four million rays, 128 lines, 0.5 mm and 1 mm, fine grids")
    parser.add_argument("--output", type=Path, default=Path("remote-phosphor"), help="folder for the figures")
    options = parser.parse_args()
    options.pixels = (options.pixel,)
    options.output.mkdir(parents=True, exist_ok=True)
    if options.full:
        options.rays, options.lines, options.pixels = 4_000_000, 128, (0.5, 1.0)
    film.print_and_draw(options.output / "film-transmission.png", 2048 if options.full else 64)
    found = {kind: experiment(kind, options) for kind in ("bare", "film")}
    for kind, maps in found.items():
        print_tables(kind, maps)
    truth = {kind: maps[options.pixels[0]]["truth"] for kind, maps in found.items()}
    for kind, i in (("bare", 0), ("film", 0)):
        print(f"\n{kind}: {truth[kind][i].intensity:.1f} cd on the axis", end="")
    print(f", {truth['film'][0].intensity / truth['bare'][0].intensity:.3f} times as much")
    maps = found["film"][options.pixels[0]]
    shown = [name for name in maps if name not in {"truth", "gridded, 2.1 %", "field, automatic"}]
    rows = [
        (f"({t.observer.theta:g}°, {t.observer.phi:g}°)", [*(maps[name][i] for name in shown), t])
        for i, t in enumerate(maps["truth"])
        if t.observer.theta or not t.observer.phi  # from the axis all azimuths see the same
    ]
    heading = "A remote phosphor under a film of prisms, seen from (θ, φ)"
    draw_maps(options.output / "remote-phosphor.png", heading, [*shown, "the lamp itself"], rows, size=1.6)
    draw_sections(options.output / "remote-phosphor-sections.png", truth["bare"], truth["film"])
    print(f"figures: {options.output}/")


if __name__ == "__main__":
    main()
