"""Chapter 3 of the thesis with its number of rays: the gridded algorithm from 10⁵ to 10⁹ rays, beside light fields.

    python examples/many_rays.py                      # 40 000 rays of one lamp, seconds
    python examples/many_rays.py --full               # the numbers of docs/chapter-3.md, half an hour
    python examples/many_rays.py --full --lamp led --most 1e9

The lamps are those of `remote_phosphor.py` and `dome_led.py`. Rays are traced, counted pixel by pixel in half degrees, and
forgotten; from the counts follow the patches of every threshold. The counts are kept in the folder `--output`, and a run
that was broken off goes on with them.
"""

from __future__ import annotations

import argparse
import dataclasses
import shutil
import time
from pathlib import Path

import etendue as et
import numpy as np
from etendue.goniophotometry.comparison import compare_intensities
from etendue.goniophotometry.threshold_sweep import THRESHOLDS
from etendue.lightfield.gridded.gridded_source import suited_threshold
from etendue.luminance.gridded_map import gridded_luminance_map
from experiments import led, phosphor
from experiments.differences import draw_cuts, draw_differences
from experiments.gridded_counts import GriddedCounts, counted
from experiments.panels import INK, LINES, measures, noise, print_table
from experiments.sweeping import (
    draw_sweep,
    far_field,
    print_pixel_sweep,
    print_sweep,
    suitability,
    sweep,
)

LAMPS = {"bare": "Remote phosphor (fig. 3.8)", "film": "The same under a film (fig. 3.9)", "led": "LED (fig. 3.13)"}
SOURCES = {"bare": "A remote phosphor", "film": "A remote phosphor under a film", "led": "An LED with a silicone dome"}
CUTS = {
    "bare": "Remote phosphor (fig. 3.4)",
    "film": "Remote phosphor under a film (fig. 3.7)",
    "led": "LED with a silicone dome (fig. 3.15)",
}
"""What the pictures show."""

MARKS = (10**5, 10**6, 10**7, 10**8, 10**9)
FIELDS = 10**7
"""Light fields are fitted up to so many rays."""

DIAGONAL = (0.5**0.5, -(0.5**0.5), 0.0)
"""Normal of the plane x = y."""

Depths = tuple[int, int, int, int] | None
Seen = dict[str, list[et.LuminanceMap]]


def power(rays: int) -> str:
    """4 × 10⁸ for 400 000 000."""
    digits, exponent = f"{rays:.0e}".split("e+")
    raised = f"10{str(int(exponent)).translate(str.maketrans('0123456789', '⁰¹²³⁴⁵⁶⁷⁸⁹'))}"
    return raised if digits == "1" else f"{digits} × {raised}"


def place(observer: et.Observer) -> str:
    """As the thesis writes it."""
    return f"({observer.theta:g}°, {observer.phi:g}°)"


@dataclasses.dataclass(frozen=True)
class Lamp:
    """What one section of chapter 3 looks at.

    Parameters
    ----------
    scene : Scene
        With a detector of rays.
    surface : Surface
        That is cut into pixels.
    pixel, parallels
        As of `GriddedSource.fit`.
    carrier : Surface
        Of the light field.
    observers : list of Observer
    screen : Screen
        At the resolution of the thesis.
    lines : int
        Lines of sight per pixel in the maps of the lamp itself.
    best : float
        Threshold [%] that the thesis found best.
    rays : int
        Most rays to be traced.
    mirrors : tuple
        Normals of planes in which the lamp is its own image: of the most rays, half, or three in four, are images.
    """

    scene: et.Scene
    surface: et.Surface
    pixel: float
    parallels: int | None
    carrier: et.Surface
    observers: list[et.Observer]
    screen: et.Screen
    lines: int
    best: float
    rays: int
    mirrors: tuple[tuple[float, float, float], ...]

    def traced(self, rays: int, seed: int) -> et.RaySet:
        """Rays that leave it."""
        return et.trace(self.scene, rays=rays, seed=seed).rays.only

    @classmethod
    def named(cls, name: str) -> Lamp:
        """``"bare"``, ``"film"`` or ``"led"``."""
        if name == "led":
            observers = [et.Observer(theta, 0, 1000) for theta in (0, 30, 60, 90)]
            screen, surface = et.Screen(2.5, 2.5, 50, 50), et.Dome(radius=led.CARRIER)
            return cls(
                led.recorded(),
                surface,
                0.125,
                16,
                led.LOW_BOX,
                observers,
                screen,
                1024,
                0.01,
                4 * 10**8,
                mirrors=(DIAGONAL,),
            )
        top, film = phosphor.TOP[name], name == "film"
        observers = [
            et.Observer(theta, phi, 1000, target=(0, 0, top))
            for phi in ((0, 90) if film else (0,))
            for theta in (0, 30, 60, 80)
        ]
        plane = et.Plane(top, *phosphor.CARRIER[name], centre=(0, 0))
        carrier = phosphor.BOX if film else et.Plane(top, 24.2, 24.2, centre=(0, 0))
        how = (
            phosphor.lamp(name),
            plane,
            1.0,
            None,
            carrier,
            observers,
            et.Screen(23, 23, 23, 23),
            128 if film else 512,
        )
        return cls(*how, *((0.021, 4 * 10**8) if film else (2.1, 10**9)), mirrors=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))


def maps_of(lamp: Lamp, source: et.GriddedSource) -> list[et.LuminanceMap]:
    """As the thesis has them: the light of the tables alone."""
    return [gridded_luminance_map(source.as_printed, observer, lamp.screen) for observer in lamp.observers]


def cells(maps: list[et.LuminanceMap], truth: list[et.LuminanceMap]) -> list[str]:
    """Three measures for each observer."""
    return [" / ".join(measures(*pair)) for pair in zip(maps, truth, strict=True)]


def print_spread(lamp: Lamp, truth: list[et.LuminanceMap], rays: int, depths: Depths) -> None:
    """Mean and standard deviation of the measures over five ray files."""
    found: dict[str, list[list[list[float]]]] = {}
    for seed in range(5):
        file = lamp.traced(rays, 900 + seed)
        suited = et.GriddedSource.fit(file, lamp.surface, lamp.pixel, parallels=lamp.parallels)
        field = et.LightField.fit(file, lamp.carrier, depths=depths)
        seen = {
            "gridded, suited E": maps_of(lamp, suited),
            "field": et.luminance_map(field, lamp.observers, lamp.screen),
        }
        for name, maps in seen.items():
            pairs = zip(maps, truth, strict=True)
            found.setdefault(name, []).append([[float(m) if m != "–" else np.nan for m in measures(*p)] for p in pairs])
    print(f"\nfive files of {rays:,} rays traced: mean ± standard deviation\n")
    rows = []
    for name, values in found.items():
        mean, spread = np.mean(values, axis=0), np.std(values, axis=0, ddof=1)
        told = (zip(*pair, strict=True) for pair in zip(mean, spread, strict=True))
        rows.append([name, *(" / ".join(f"{m:.2f} ± {s:.2f}" for m, s in pairs) for pairs in told)])
    print_table(["", *map(place, lamp.observers)], rows)


def print_storage(lamp: Lamp, source: et.GriddedSource, field: et.LightField, rays: int, folder: Path) -> None:
    """Bytes of the patches and of a light field beside those of the ray file, and how long their maps take."""
    shutil.rmtree(folder / "patches", ignore_errors=True)
    source.save_patches(folder / "patches")
    patches = sum(path.stat().st_size for path in (folder / "patches" / "lids").iterdir())
    file = lamp.traced(10**5, 7)
    et.write_rays(folder / "some.tm25ray", file)
    ray_file = (folder / "some.tm25ray").stat().st_size / len(file) * rays
    (folder / "some.tm25ray").unlink()
    field.save(folder / "field.h5")
    held = (folder / "field.h5").stat().st_size
    print(f"\nray file of {rays:,} rays: {ray_file / 1e6:,.1f} MB (TM-25)")
    print(
        f"{len(source.patches)} intensity files: {patches / 1e6:.1f} MB, 1/{ray_file / patches:,.0f} (thesis: 30 MB, 1/830)"
    )
    print(f"light field: {held / 1e6:.1f} MB, 1/{ray_file / held:,.0f}")
    one = [lamp.observers[1]]
    start = time.perf_counter()
    gridded_luminance_map(source, *one, lamp.screen)
    middle = time.perf_counter()
    et.luminance_map(field, *one, lamp.screen)
    end = time.perf_counter()
    print(
        f"a map of the patches takes {middle - start:.2f} s, of the light field {end - middle:.2f} s (thesis: 7 h and more)"
    )


def draw(name: str, lamp: Lamp, truth: list[et.LuminanceMap], seen: Seen, folder: Path) -> None:
    """Figures 3.3, 3.5, 3.6 or 3.14 with percentage differences, and cuts: 3.4, 3.7 or 3.15."""
    kind = "root" if name == "led" else "linear"
    rows = [
        (place(o), truth[i], [maps[i] for maps in seen.values()])
        for i, o in enumerate(lamp.observers)
        if o.theta or not o.phi  # from the axis all azimuths see the same
    ]
    heading = f"{SOURCES[name]}: the lamp itself, patches and light field"
    draw_differences(folder / f"{name}-differences.png", heading, "the lamp itself", list(seen), rows, kind)
    looks = ("o", LINES[0]), ("x", LINES[1])
    along = {"y": 0.5} if name == "bare" else {"x": 0.01} if name == "led" else None
    if along is not None:
        shown = range(len(truth)) if name == "led" else [0]
        panels = {
            place(lamp.observers[i]): [
                ("the lamp itself", et.cross_section(truth[i], **along), "-", INK),
                *(
                    (name, et.cross_section(seen[name][i], **along), *how)
                    for name, how in zip(seen, looks, strict=True)
                ),
            ]
            for i in shown
        }
    else:
        # At φ = 90° the observer stands above, so that the screen's x runs across the prisms from both.
        panels = {
            label: [
                (place(lamp.observers[i]), et.cross_section(maps[i], y=0.0), how, colour)
                for i, how, colour in ((2, "o", LINES[0]), (6, "s", LINES[1]))
            ]
            for label, maps in [*seen.items(), ("the lamp itself", truth)]
        }
    draw_cuts(folder / f"{name}-cuts.png", CUTS[name], panels, columns=2 if name == "led" else len(panels))


@dataclasses.dataclass
class Growth:
    """What comes of more and more rays of a lamp.

    Parameters
    ----------
    rows, suits : list
        Of tables: measures of maps, and thresholds that suit the number of rays.
    seen : dict
        Maps of the patches of the most rays, and of the field of the most that it was fitted to.
    counts, source, field
        Of the same.
    """

    rows: list[list[str]] = dataclasses.field(default_factory=list)
    suits: list[list[str]] = dataclasses.field(default_factory=list)
    seen: Seen = dataclasses.field(default_factory=dict)
    counts: GriddedCounts | None = None
    source: et.GriddedSource | None = None
    field: et.LightField | None = None


def grown(
    lamp: Lamp, truth: list[et.LuminanceMap], marks: list[int], judges: et.RaySet, folder: Path, depths: Depths
) -> Growth:
    """Patches and fields of as many rays as the marks say."""
    found, start = Growth(), time.perf_counter()
    counts = GriddedCounts.on(lamp.surface, lamp.pixel, lamp.parallels)
    for mark in counted(counts, lamp.traced, marks, folder):
        print(f"{mark:,} rays traced after {time.perf_counter() - start:.0f} s, {counts.left:,} leave the lamp")
        found.counts = counts.mirrored(*lamp.mirrors) if mark == marks[-1] else counts
        name = power(found.counts.traced)
        suited = suited_threshold(found.counts.lit.rays_per_patch)
        for threshold in sorted({lamp.best, suited}):
            source = found.counts.source(threshold)
            maps = maps_of(lamp, source)
            bins = f"{source.patches.bins.mean():,.0f}"
            found.rows.append([name, f"gridded, {threshold:.2g} %, {bins} bins", *cells(maps, truth)])
            if threshold == lamp.best and mark == marks[-1]:
                found.seen[f"gridded, {name} rays"] = maps
                found.source = source
        if mark > FIELDS:
            continue
        if depths is None:
            found.suits.append([name, *suitability(counts, judges)])
        found.field = et.LightField.fit(lamp.traced(mark, 10**6 + 2), lamp.carrier, depths=depths)
        field = {f"field, {name} rays": et.luminance_map(found.field, lamp.observers, lamp.screen)}
        found.rows.append([name, "field", *cells(*field.values(), truth)])
    found.seen |= field
    return found


def experiment(name: str, options: argparse.Namespace) -> None:
    """All of one lamp."""
    lamp, folder = Lamp.named(name), options.output
    traced = options.most or lamp.rays // 2 ** len(lamp.mirrors)
    marks = sorted({mark for mark in MARKS if mark <= traced} | {traced})
    depths: Depths = None
    judge = 10**6 if options.full else options.rays
    if not options.full:
        coarse = et.Screen(lamp.screen.width, lamp.screen.height, 23, 23)
        lamp = dataclasses.replace(lamp, lines=4, screen=coarse)
        marks, depths = [options.rays // 4, options.rays], (2, 2, 2, 2)
    print(f"\n# {name}\n")
    method = et.PathTracing(rays_per_pixel=lamp.lines)
    truth = et.luminance_map(lamp.scene, lamp.observers, lamp.screen, method=method)
    file, other = (lamp.traced(judge, 10**6 + i) for i in range(2))
    judges = lamp.traced(judge // 5, 10**6 + 4)
    found = grown(lamp, truth, marks, judges, folder / f"{name}-counts", depths)
    print(f"\n{name}: NCC / NRMSE of eq. 3.6 / true NRMSE [%]\n")
    print_table(
        ["rays", "", *map(place, lamp.observers)],
        [*found.rows, ["", "noise of the lamp's own map", *map(noise, truth)]],
    )
    if found.suits:
        print(f"\n{name}: thresholds suited to the number of rays\n")
        print_table(["rays", "per patch", "suited E", "its score", "best of nine", "its score", "0.021 %"], found.suits)
    swept = sweep(found.counts, file, judges, THRESHOLDS if options.full else (2.1, 0.021))
    print(f"\nthresholds with {found.counts.traced:,} rays; {judge:,} rays drawn against a file of as many\n")
    print_sweep(swept)
    again = compare_intensities(far_field(other), far_field(file))
    print(f"a second ray file against the first: NCC {again.ncc:.3%}, NRMSE {again.nrmse_thesis:.3%}")
    draw_sweep(folder / f"{name}-thresholds.png", swept, LAMPS[name])
    print_storage(lamp, found.source, found.field, found.counts.left, folder)
    draw(name, lamp, truth, found.seen, folder)
    many = lamp.traced(4 * judge if options.full else judge, 10**6 + 3)
    print(f"\npixels with {len(many):,} rays\n")
    sides = [lamp.pixel * 2.0**k for k in (range(2, -3, -1) if options.full else range(2))]
    # Cells of the dome follow the squares.
    print_pixel_sweep(sides, lambda side: et.GriddedSource.fit(many, lamp.surface, side), file, judges)
    if options.full:
        print_spread(lamp, truth, judge, depths)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=40_000)
    parser.add_argument("--lamp", choices=LAMPS, help="one of them only; without --full it is bare")
    parser.add_argument(
        "--full", action="store_true", help="up to 10⁹ rays, a million to judge, fine grids, five seeds"
    )
    parser.add_argument(
        "--most", type=lambda text: int(float(text)), help="rays that --full traces of each lamp, as 1e9"
    )
    parser.add_argument("--output", type=Path, default=Path("many-rays"), help="folder for the figures and the counts")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    chosen = [options.lamp] if options.lamp else list(LAMPS) if options.full else ["bare"]
    for name in chosen:
        experiment(name, options)
    print(f"\nfigures: {options.output}/")


if __name__ == "__main__":
    main()
