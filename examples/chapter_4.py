"""Chapter 4 of the thesis: how well a surface must be described before the luminance of a lamp comes out right.

    python examples/chapter_4.py             # coarse pixels and few lines of sight, two minutes
    python examples/chapter_4.py --full      # 125 × 250 pixels: the tables of docs/chapter-4.md

The mixing chamber is traced with materials that are known, in place of those that were measured, and with what a virtual
goniophotometer says of them: a diffuse surface, a diffuse and specular one, a table of scans.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import etendue as et
import numpy as np
from etendue.plot import style
from etendue.plot.region_marks import draw_marks, marks_of
from experiments import goniometer
from experiments.chamber import DIAMETER, FLUX, HEIGHT, SHEET, Finish, chamber
from experiments.goniometer import smoothed, table
from experiments.panels import LINES, ROOT, legend_below, map_grid, new_figure, print_table, put_bar_at, save
from matplotlib.colors import Normalize, PowerNorm

EYE = et.Observer(theta=55, phi=90, distance=1000, target=(0, 0, HEIGHT))
REGION = et.Region(left=-10, right=10, bottom=-12.5, top=-2.5)
"""X 15 to 35 mm and Y 15 to 25 mm of a screen of 50 mm × 25 mm, from its upper left corner: what is compared."""

AROUND_HIGHLIGHTS = et.Region(left=-10, right=10, bottom=-10.5, top=-2.5)
"""The same to Y 23 mm, where U is taken; the rim of the aperture and the black below it lie beyond."""

MANY = 128
"""Lines of sight per pixel from which on diffuse light is gathered."""

BRIGHTEST = 2500.0
"""Luminance at the end of the colours of two lamps over a plate [cd/m²]."""

PET = et.bsdf.RoughCoat(roughness=0.035, index=1.575, base_reflectance=0.9938)
"""Stand-in for microcellular PET: its index, R = 0.984, and a roughness with highlights as bright as in table 4.1."""

GLOSS = et.bsdf.Coated(index=1.5, base_reflectance=0.9211)
"""Stand-in for the gloss paint: a smooth coat, R = 0.832."""

ALUMINIUM = et.bsdf.RoughMetal(roughness=0.12, reflectance=0.85)
"""Stand-in for the sheet with a structured coat of aluminium."""

BARE = {"kind": "lambertian", "reflectance": 0.9}
"""An edge that is not painted black."""

PET_ANGLES = (5.0, 25.0, 45.0, 60.0, 70.0, 80.0)
GLOSS_ANGLES = (5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)
GLOSS_SCANS = (10.0, 40.0, 60.0, 80.0)

THESIS = {
    "PET": {
        "truth": ("", "", "794", "470", "0.68"),
        "diffuse": ("80.07", "28.32", "309", "265", "0.87"),
        "diffuse + specular": ("86.96", "27.54", "356", "268", "0.85"),
        "table of scans": ("94.61", "9.14", "783", "416", "0.65"),
    },
    "gloss paint": {
        "truth": ("", "", "961", "260", ""),
        "diffuse + specular": ("88.7", "12.8", "937", "233", ""),
        "table of scans": ("89.3", "9.5", "1140", "288", ""),
    },
}
"""Tables 4.1 and 4.2; their truth is a photograph."""


def finish_of(bsdf: et.Bsdf) -> Finish:
    return {"kind": "bsdf", "bsdf": bsdf}


def diffuse(bsdf: et.Bsdf) -> Finish:
    """Equation 4.1."""
    return {"kind": "lambertian", "reflectance": goniometer.total_reflectance(bsdf)}


def diffuse_specular(bsdf: et.Bsdf, angles: Sequence[float]) -> Finish:
    """Equation 4.2, with the specular reflectance that the aperture of the instrument holds."""
    specular = [goniometer.specular_reflectance(bsdf, theta) for theta in angles]
    return {
        "kind": "diffuse-specular",
        "total_reflectance": goniometer.total_reflectance(bsdf),
        "specular_reflectance": {"angle": list(angles), "values": specular},
    }


def without_specular(finish: Finish) -> Finish:
    """The diffuse part of a description alone."""
    shares = finish["specular_reflectance"]
    rest = [finish["total_reflectance"] - value for value in shares["values"]]
    return {"kind": "lambertian", "reflectance": {"angle": shares["angle"], "values": rest}}


def shares_of_the_light(rays: int) -> None:
    """What the geometry alone decides: on the edges of the holes, and on the walls."""
    ledger = et.trace(chamber({"kind": "absorber"}), rays=rays, seed=1).ledger
    flux = 4.0 * FLUX
    edges = sum(entry.flux for name, entry in ledger.by_surface.items() if name.startswith("hole"))
    walls = sum(entry.flux for name, entry in ledger.by_surface.items() if name.startswith(("wall", "sheet.top")))
    print(f"edges of the holes: {edges / flux:.2%} of the light (thesis: around 32 %; disc to disc: 32.79 %)")
    print(f"wall and sheet: {walls / (flux - edges):.1%} of what leaves the holes (thesis: 40 %)\n")


def look(finish: Finish, screen: et.Screen, lines: int, edge: Finish | str = "absorber") -> et.LuminanceMap:
    # What patches know of the wall has to be found out first, which few lines do not pay for.
    method = et.PathTracing(rays_per_pixel=lines, forward_rays=0, gather=lines >= MANY)
    return et.luminance_map(chamber(finish, edge), EYE, screen, method=method)


def distribution(finish: Finish, rays: int) -> et.Intensity:
    detector = {"name": "far", "kind": "intensity", "c_planes": 8, "gamma_step": 5}
    return et.trace(chamber(finish, detectors=[detector]), rays=rays, seed=5).intensity["far"]


def numbers(lmap: et.LuminanceMap) -> tuple[str, str, str]:
    """Maximum and mean of the region, and U: least over mean around the highlights."""
    values, inner = (lmap.values[region.mask(lmap.screen)] for region in (REGION, AROUND_HIGHLIGHTS))
    return f"{values.max():.0f}", f"{values.mean():.0f}", f"{inner.min() / inner.mean():.2f}"


def draw_materials(path: Path) -> None:
    """Figures 4.3, 4.4, 4.12 and 4.13."""
    made = new_figure(9.0, 6.2, "Stand-ins for two wall materials, as a goniophotometer measures them")
    grid = made.subplots(2, 2)
    columns = [("PET", PET, PET_ANGLES, PET_ANGLES), ("gloss paint", GLOSS, GLOSS_ANGLES, GLOSS_SCANS)]
    for column, (name, bsdf, angles, scans) in enumerate(columns):
        axes = grid[0, column]
        specular = np.array([goniometer.specular_reflectance(bsdf, theta) for theta in angles])
        axes.plot(angles, specular, "o-", color=LINES[0], label="specular reflectance")
        rest = (goniometer.total_reflectance(bsdf) - specular) / np.pi
        axes.plot(angles, rest, "s--", color=LINES[1], label="diffuse BRDF [1/sr]")
        style.put_title(axes, name)
        axes.set_xlabel("angle of incidence [°]")
        style.put_legend(axes)
        axes = grid[1, column]
        for theta, colour in zip(scans, LINES, strict=False):
            one = goniometer.scan(bsdf, theta)
            r, values = goniometer.OFFSETS, one.values
            axes.semilogy(
                np.concatenate([-r[::-1], r]),
                np.concatenate([values[0][::-1], values[2]]),
                color=colour,
                label=f"{theta:g}°",
            )
        axes.set_xlim(-60, 60)
        axes.set_xlabel("angle from the specular direction [°]")
        style.put_legend(axes, ncols=2)
    grid[0, 0].set_ylabel("reflectance, or BRDF [1/sr]")
    grid[1, 0].set_ylabel("measured f [1/sr]")
    save(made, path)


def draw_maps(path: Path, heading: str, rows: Mapping[str, Mapping[str, et.LuminanceMap]]) -> None:
    """A row of maps for each material, a column for each description, the region of table 4.1 within them."""
    columns = list(max(rows.values(), key=len))
    last = len(columns) - 1
    facts = ["1: the region of tables 4.1 and 4.2"]
    grid = map_grid((2.3, 1.15), columns, list(rows), {last: "each"}, heading=heading, facts=facts)
    for row, maps in enumerate(rows.values()):
        most = 1.02 * max(float(np.quantile(lmap.values, 0.999)) for lmap in maps.values())
        for name, lmap in maps.items():
            image = grid.show(row, columns.index(name), lmap, Normalize(0.0, most))
            draw_marks(grid.panels[row, columns.index(name)], marks_of(lmap, [REGION]))
        data = np.stack([lmap.values for lmap in maps.values()])
        put_bar_at(grid.bars[last][row], image, data, lmap.quantity, lmap.unit)
    grid.save(path)


def draw_intensity(path: Path, found: Mapping[str, Mapping[str, et.Intensity]]) -> None:
    """Figures 4.8, 4.9 and 4.16: C0–C180 and C45–C225."""
    made = new_figure(9.0, 2.9 * len(found) + 0.6, "A mixing chamber: intensity by what its wall is described by")
    grid = made.subplots(len(found), 2, squeeze=False)
    gamma, names = np.arange(0.0, 90.1, 5.0), list(max(found.values(), key=len))
    for panels, (name, curves) in zip(grid, found.items(), strict=True):
        for axes, plane in zip(panels, (0.0, 45.0), strict=True):
            for title, intensity in curves.items():
                there, back = (np.array([float(intensity.at(c, g)) for g in gamma]) for c in (plane, plane + 180.0))
                axes.plot(
                    np.concatenate([-gamma[:0:-1], gamma]),
                    np.concatenate([back[:0:-1], there]),
                    color=LINES[names.index(title)],
                    label=title,
                )
            style.put_title(axes, f"{name}, C{plane:g}–C{plane + 180:g}")
            axes.set_xlabel("γ [°]")
            axes.set_ylim(bottom=0)
        panels[0].set_ylabel("intensity [cd]")
    legend_below(made, grid[0, 0])
    save(made, path)


def draw_images(path: Path, lines: int) -> None:
    """Figure 4.10: two lamps over a plate of each material."""
    plain = et.bsdf.Mixture(parts=[GLOSS], weights=[1.0])
    painted = et.bsdf.RoughCoat(roughness=0.01, index=1.5, base_reflectance=0.9211)
    kinds = {"PET": PET, "painted PET": painted, "aluminium on PET": ALUMINIUM, "painted aluminium": plain}
    screen = et.Screen(40, 30, 80, 60)
    last, norm = len(kinds) - 1, PowerNorm(0.5, 0.0, BRIGHTEST)
    heading = "Two lamps of 1 lm over plates of four materials, from 45°"
    grid = map_grid((2.0, 1.5), list(kinds), [""], {last: "each"}, heading=heading, facts=[ROOT])
    for column, bsdf in enumerate(kinds.values()):
        lamps = [
            {
                "kind": "surface",
                "shape": {"kind": "disk", "radius": 2.5},
                "at": [x, -20, 20],
                "toward": [0, 1, -1],
                "flux": 1,
            }
            for x in (-6, 6)
        ]
        plate = {"shape": {"kind": "rectangle", "width": 120, "height": 120}, "finish": finish_of(bsdf)}
        scene = et.Scene(sources=lamps, surfaces=[plate])
        eye = et.Observer(theta=45, phi=90, distance=400)
        method = et.PathTracing(rays_per_pixel=lines, forward_rays=0)
        lmap = et.luminance_map(scene, eye, screen, method=method)
        image = grid.show(0, column, lmap, norm)
    put_bar_at(grid.bars[last][0], image, lmap.values, lmap.quantity, lmap.unit)
    grid.save(path)


def describe() -> dict[str, dict[str, Finish]]:
    """Each material by what is measured of it, and as it is."""
    return {
        "PET": {
            "diffuse": diffuse(PET),
            "diffuse + specular": diffuse_specular(PET, PET_ANGLES),
            "table of scans": finish_of(goniometer.table(PET, PET_ANGLES)),
            "truth": finish_of(PET),
        },
        "gloss paint": {
            "diffuse + specular": diffuse_specular(GLOSS, GLOSS_ANGLES),
            "table of scans": finish_of(goniometer.table(GLOSS, GLOSS_SCANS)),
            "truth": finish_of(GLOSS),
        },
    }


def alike(intensity: et.Intensity, truth: et.Intensity) -> float:
    """NCC of two intensity distributions [%]."""
    return 100.0 * float(np.corrcoef(intensity.values.ravel(), truth.values.ravel())[0, 1])


def print_material(
    material: str, maps: Mapping[str, et.LuminanceMap], far: Mapping[str, et.Intensity], seconds: Mapping[str, float]
) -> None:
    """Table 4.1 or 4.2, with the numbers of the thesis."""
    truth = maps["truth"]
    print(f"\n{material}: region X 15–35 mm, Y 15–25 mm; U of Y 15–23 mm\n")
    rows = []
    for name, lmap in maps.items():
        c = et.compare(lmap, truth, REGION)
        agreement = ("", "") if name == "truth" else (f"{100 * c.ncc:.2f}", f"{100 * c.nrmse_thesis:.2f}")
        cells = [
            f"{own} ({printed})" if printed else own
            for own, printed in zip([*agreement, *numbers(lmap)], THESIS[material][name], strict=True)
        ]
        rows.append([name, *cells, f"{alike(far[name], far['truth']):.2f}", f"{seconds[name]:.1f}"])
    heads = ["ours (thesis)", "NCC [%]", "NRMSE [%]", "max [cd/m²]", "mean [cd/m²]", "U", "NCC of LID [%]", "map [s]"]
    print_table(heads, rows)
    error = float(np.sqrt(np.mean(truth.standard_error[REGION.mask(truth.screen)] ** 2)))
    print(f"\nstandard error of a pixel of the truth: {error:.0f} cd/m²")


def print_fewer_scans(truth: et.LuminanceMap, lid: et.Intensity, lines: int, rays: int, *, full: bool) -> None:
    """How many angles suffice for an intensity distribution and for a map (section 4.3); in full, steps of 5° as well."""
    print("\nPET: tables of other numbers of scans")
    most = [tuple(np.arange(5.0, 86.0, 5.0))] if full else []
    for angles in ((45.0,), (5.0, 80.0), (5.0, 60.0, 80.0), PET_ANGLES, *most):
        table = finish_of(goniometer.table(PET, angles))
        c = et.compare(look(table, truth.screen, lines), truth, REGION)
        same = alike(distribution(table, rays), lid)
        print(
            f"    {len(angles)}: NCC of the map {100 * c.ncc:.1f} %, NRMSE {100 * c.nrmse_thesis:.1f} %, "
            f"NCC of the LID {same:.2f} %"
        )


def print_noisy_scans(truth: et.LuminanceMap, lid: et.Intensity, lines: int, rays: int, *, full: bool) -> None:
    """What few scans with errors give: joined by straight lines, and smoothed as far as the values say."""
    print("\nPET: six scans, each value with noise")
    noises = (0.0, 0.05, 0.2) if full else (0.2,)
    for noise, (name, made) in itertools.product(noises, {"lines": table, "smooth": smoothed}.items()):
        wall = finish_of(made(PET, PET_ANGLES, noise))
        lmap = look(wall, truth.screen, lines)
        c, same = et.compare(lmap, truth, REGION), alike(distribution(wall, rays), lid)
        most, mean, _ = numbers(lmap)
        print(
            f"    {noise:.0%}, {name}: NCC of the map {100 * c.ncc:.1f} %, NRMSE {100 * c.nrmse_thesis:.1f} %, "
            f"maximum {most}, mean {mean} cd/m², NCC of the LID {same:.2f} %"
        )


def look_at_edges(screen: et.Screen, lines: int) -> dict[str, et.LuminanceMap]:
    """Figure 4.17."""
    print(
        "\naluminium: maximum and mean of the whole map (thesis: 1690 and 226 with edges as drilled, 858 and 96 black)"
    )
    edges = {}
    for name, edge in {"edges as drilled": BARE, "edges black": "absorber"}.items():
        edges[name] = look(finish_of(ALUMINIUM), screen, lines, edge)
        print(f"    {name}: {edges[name].values.max():.0f}, {edges[name].values.mean():.0f}")
    return edges


def split(
    diffuse_alone: et.LuminanceMap, specular: et.LuminanceMap, truth: et.LuminanceMap
) -> dict[str, et.LuminanceMap]:
    """Figure 4.7: what is diffuse, what a mirror would add, and what the lobe adds to that."""
    return {
        "diffuse": diffuse_alone,
        "specular": specular.replace(values=np.clip(specular.values - diffuse_alone.values, 0.0, None)),
        "near-specular": truth.replace(values=np.clip(truth.values - specular.values, 0.0, None)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="125 × 250 pixels and 400 lines of sight for each")
    parser.add_argument("--lines", type=int, help="lines of sight per pixel; the thesis has 1000")
    parser.add_argument("--rays", type=int, help="rays of each intensity distribution")
    parser.add_argument("--output", type=Path, default=Path("chapter-4"), help="folder for the figures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    pixels, usual, rays = ((250, 125), 400, 4_000_000) if options.full else ((50, 25), 64, 200_000)
    lines, rays = options.lines or usual, options.rays or rays
    screen = et.Screen(50, 25, *pixels)

    print(f"chamber: {DIAMETER:g} mm × {HEIGHT:g} mm, sheet of {SHEET:g} mm, four lamps of {FLUX:g} lm")
    shares_of_the_light(min(2_000_000, 10 * rays))
    draw_materials(options.output / "chapter-4-materials.png")

    materials = describe()
    maps: dict[str, dict[str, et.LuminanceMap]] = {}
    far: dict[str, dict[str, et.Intensity]] = {}
    for material, descriptions in materials.items():
        maps[material], far[material], seconds = {}, {}, {}
        for name, finish in descriptions.items():
            start = time.perf_counter()
            maps[material][name] = look(finish, screen, lines)
            seconds[name] = time.perf_counter() - start
            far[material][name] = distribution(finish, rays)
        print_material(material, maps[material], far[material], seconds)
    pet = maps["PET"]
    print_fewer_scans(pet["truth"], far["PET"]["truth"], lines, rays, full=options.full)
    print_noisy_scans(pet["truth"], far["PET"]["truth"], lines, rays, full=options.full)
    edges = look_at_edges(screen, lines)
    rest = look(without_specular(materials["PET"]["diffuse + specular"]), screen, lines)
    light = split(rest, pet["diffuse + specular"], pet["truth"])
    draw_maps(options.output / "chapter-4-maps.png", "A mixing chamber: what its wall is described by", maps)
    draw_maps(options.output / "chapter-4-light.png", "A mixing chamber: parts of its light", {"PET": light})
    draw_maps(options.output / "chapter-4-edges.png", "A mixing chamber", {"aluminium": edges})
    draw_intensity(options.output / "chapter-4-intensity.png", far)
    draw_images(options.output / "chapter-4-images.png", 4 * lines)
    print(f"\nfigures: {options.output}/")


if __name__ == "__main__":
    main()
