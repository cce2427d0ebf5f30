"""Appendices A and B of the thesis: from two scans per incidence to a table, by its two schemes, step by step.

    python examples/appendix_b.py

The stages of the goniometer and the coordinates of Harvey and Shack are drawn as in figs. A.1 to A.4 of the thesis.
A stand-in for microcellular PET is scanned by a virtual goniophotometer at 5° and 60°; the other pictures are figs. B.1 to
B.7, and the numbers beside them what each scheme adds up to.
"""

from __future__ import annotations

import argparse
import functools
import math
from collections.abc import Mapping
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
from chapter_4 import PET
from etendue.plot import style
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.scans import harvey_shack
from etendue.scatter.scans.interpolations import METHODS, SMALLEST, specular_centred, tabulated
from experiments import goniometer
from experiments.constructions import draw_coordinates, draw_stages
from experiments.panels import FAINT, INK, LINES, legend_below, new_figure, print_table, put_bar, save
from experiments.space_drawing import View
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm

Array = npt.NDArray[np.float64]

THETAS = (5.0, 60.0)
SCHEMES = {"first scheme: U, V": "direction-cosines", "second scheme: about the specular": "specular-centred"}
THESIS = {"direction-cosines": ("67 %", "75 %"), "specular-centred": ("99.5 %", "91.4 %")}


LOWEST = 0.03
"""Lowest f that is shown [1/sr]."""

POINTS = "#8fd3ff"
"""Colour of the points of a table's grid."""

NOWHERE = "#b9cbe4"
"""Colour of those that no direction has."""


@functools.cache
def scanned(theta: float) -> tuple[Array, Array]:
    """Directions of both planes in which something was measured, and the BRDF there [1/sr]."""
    one = goniometer.scan(PET, theta)
    there = ~np.isnan(one.values) & ~np.isnan(one.directions[..., 0])
    return one.directions[there], one.values[there]


def all_scans() -> et.Scans:
    """Both incidences."""
    parts = [(direction(theta, 180.0), *scanned(theta)) for theta in THETAS]
    incident = np.concatenate([np.tile(i, (len(d), 1)) for i, d, _ in parts])
    return et.Scans(incident, np.concatenate([d for _, d, _ in parts]), np.concatenate([f for *_, f in parts]))


def rim(axes: Axes, theta: float) -> None:
    """The edge of all directions in U, V."""
    a = np.linspace(0.0, 360.0, 361)
    r = harvey_shack.farthest(theta, a)
    axes.plot(r * np.cos(np.radians(a)), r * np.sin(np.radians(a)), color=FAINT, lw=1)
    axes.set_aspect("equal")


def planar(theta: float, scattered: Array) -> tuple[Array, Array]:
    """U and V of directions."""
    r, a = harvey_shack.coordinates(direction(theta, 180.0), scattered)
    return r * np.cos(np.radians(a)), r * np.sin(np.radians(a))


def draw_scans(path: Path) -> None:
    """B.1 and B.2: what was measured, over the angle and in the plane of direction cosines."""
    figure = new_figure(9.6, 6.9, "A stand-in for microcellular PET: scans in two planes")
    for column, theta in enumerate(THETAS):
        scattered, f = scanned(theta)
        axes = figure.add_subplot(2, 2, column + 1)
        for plane, colour, name in ((1, LINES[0], "in the plane of incidence"), (0, LINES[1], "across it")):
            own = np.abs(scattered[:, 1]) < 1e-6 if plane else np.abs(scattered[:, 1]) > 1e-6
            angle = np.degrees(np.arctan2(scattered[own, 0 if plane else 1], scattered[own, 2]))
            axes.semilogy(angle, f[own], ".", ms=3, color=colour, label=name)
        style.put_title(axes, f"light from {theta:g}°")
        axes.set(xlabel="scatter angle [°]", xlim=(-90, 90))
        axes.set_ylabel("f [1/sr]" if not column else "")
        if not column:
            style.put_legend(axes)
        axes = figure.add_subplot(2, 2, column + 3)
        rim(axes, theta)
        axes.plot(*planar(theta, scattered), ".", ms=2, color=INK)
        axes.set(xlabel="U")
        axes.set_ylabel("V" if not column else "")
    save(figure, path)


def draw_edge(path: Path) -> None:
    """B.3: the largest |β − β₀| by azimuth, as it is and as the thesis prints it."""
    figure = new_figure(7.4, 3.7, "How far directions are from the specular one at most, by incidence")
    axes = figure.add_subplot()
    a = np.linspace(0.0, 360.0, 361)
    for theta, colour in zip((5.0, 30.0, 60.0, 80.0), LINES, strict=False):
        axes.plot(a, harvey_shack.farthest(theta, a), color=colour, label=f"{theta:g}°")
    s = math.sin(math.radians(60.0))
    printed = np.sqrt(1.0 + s * s - 2.0 * s * np.cos(np.radians(a + 90.0)))
    axes.plot(a, printed, "--", lw=1, color=INK, label="60°, as printed")
    axes.set(xlabel="azimuth of β − β₀ [°]", ylabel="largest |β − β₀|", xlim=(0, 360))
    legend_below(figure, axes)
    save(figure, path)


def draw_schemes(path: Path, tables: Mapping[str, et.BsdfTable]) -> None:
    """B.2: what each scheme makes of the scans in U, V, and some points of the grid of the table."""
    figure = new_figure(9.6, 8.3, "A stand-in for microcellular PET: the BRDF between its scans")
    turns = np.radians(np.arange(0.0, 360.0, 10.0))
    for line, (title, method) in enumerate(SCHEMES.items()):
        for column, theta in enumerate(THETAS):
            axes = figure.add_subplot(2, 2, 2 * line + column + 1)
            incident, scattered = direction(theta, 180.0), scanned(theta)[0]
            low, high = (-1.15, 1.15) if column == 0 else (-1.95, 0.25)
            u, v = np.meshgrid(np.linspace(-1.1, 1.1, 241), np.linspace(low, high, 241))
            towards = harvey_shack.directions(incident, np.hypot(u, v), np.degrees(np.arctan2(v, u)))
            there = ~np.isnan(towards[..., 2])
            f = np.full(u.shape, np.nan)
            f[there] = tables[method].evaluate(incident, towards[there])
            norm = LogNorm(LOWEST, float(np.nanmax(f)))
            picture = axes.pcolormesh(u, v, np.maximum(f, LOWEST), cmap=style.COLOUR_MAPS["value"], norm=norm)
            rim(axes, theta)
            for r in np.geomspace(1e-3, 2.0, 99)[58::10]:
                kept = r < harvey_shack.farthest(theta, np.degrees(turns))
                axes.plot(r * np.cos(turns[kept]), r * np.sin(turns[kept]), ".", ms=2, color=POINTS)
            axes.plot(*planar(theta, scattered[::3]), ".", ms=2.5, color="white")
            style.put_title(axes, f"{title}, {theta:g}°")
            axes.set_xlabel("U" if line else "")
            axes.set_ylabel("V" if not column else "")
            put_bar(picture, f, "f", "1/sr", axes)
    save(figure, path)


def about_specular(theta: float, polar: Array, azimuth: Array) -> tuple[Array, Array]:
    """Step 3 of the second scheme: directions at θ′ and φ′ [°], and f there [1/sr], of shape (azimuths, angles).

    Light from (θ, 180°) has φ′ = 0 along x′ and 90° away from the normal. NaN below the horizon.
    """
    incident = direction(theta, 180.0)
    # PolarGrid counts from the side of the normal.
    at = PolarGrid("specular", polar, azimuth + 90.0).directions(incident, transmitted=False)
    there = ~np.isnan(at[..., 0])
    f = np.full(there.shape, np.nan)
    f[there] = specular_centred(incident, *scanned(theta), at[there])[0]
    return at, f


def lobe(polar: Array, azimuth: Array, f: Array) -> Array:
    """Points X′, Y′, Z′ of fig. B.5, shape (…, 3); its caption has cos θ′ cos φ′ where Y′ takes sin θ′ sin φ′."""
    return f[..., None] * direction(polar, azimuth)


def draw_lobe(axes: Axes, wide: float, low: float, high: float) -> PolyCollection:
    """B.5: f about the specular direction, and where it was measured."""
    theta = THETAS[0]
    polar, azimuth = np.linspace(0.0, 95.0, 951), np.linspace(0.0, 360.0, 361)
    f = np.nan_to_num(about_specular(theta, polar, azimuth)[1])
    points = lobe(polar, azimuth[:, None], f)
    view = View(axes, 22.0, -60.0)
    # Drawn are cells of 1° × 5°, and of 0.2° × 5° where f is steep; finer ones would look the same.
    some = np.ix_(np.arange(0, 361, 5), np.append(np.arange(0, 150, 2), np.arange(150, 951, 10)))
    norm = LogNorm(LOWEST, float(f.max()))
    picture = view.surface(points[some], f[some], cmap=style.COLOUR_MAPS["value"], norm=norm)
    scattered, measured = scanned(theta)
    frame = PolarGrid("specular", np.zeros(1), np.zeros(1))
    r, a = frame.coordinates(scattered, direction(theta, 180.0), transmitted=False)
    a = (a - 90.0) % 360.0
    seen = view.facing(points)[np.rint(a).astype(int) % 360, (10.0 * r).astype(int)]
    axes.plot(*view.flat(lobe(r, a, measured)[seen]).T, ".", ms=2.5, color=INK)
    if high > f.max():
        view.arrow([0.0, 0.0, f.max()], [0.0, 0.0, f.max() + 0.3], FAINT, 0.8)
        view.label([0.0, 0.0, f.max() + 0.3], "Z′", FAINT, (10, -2))
    else:
        view.arrow([0.34, 0.0, 0.0], [0.47, 0.0, 0.0], FAINT, 0.8)
        view.label([0.47, 0.0, 0.0], "X′", FAINT, (0, -9))
        # The foot hides most of it.
        view.arrow([0.0, 0.0, 0.0], [0.0, 0.72, 0.0], FAINT, 0.8, zorder=0)
        view.label([0.0, 0.72, 0.0], "Y′", FAINT, (8, 4))
    axes.set(xlim=(-wide, wide), ylim=(low, high), aspect="equal")
    axes.set_axis_off()
    return picture


def draw_points(path: Path) -> None:
    """B.5 and B.6: the lobe about the specular direction, and the points of all steps in U, V."""
    figure = new_figure(9.6, 8.4, "A stand-in for microcellular PET: linear about the specular direction")
    views = ((f"light from {THETAS[0]:g}°: f about Z′, the specular direction", -0.25, 3.6), ("its foot", -0.25, 0.6))
    for column, (title, low, high) in enumerate(views):
        axes = figure.add_subplot(2, 2, column + 1)
        style.put_title(axes, title)
        picture = draw_lobe(axes, 0.5 * (high - low), low, high)
        if column:
            put_bar(picture, picture.get_array(), "f", "1/sr", axes)
    for column, theta in enumerate(THETAS):
        axes = figure.add_subplot(2, 2, column + 3)
        rim(axes, theta)
        r, a = np.meshgrid(np.geomspace(SMALLEST, 2.0, 20), np.arange(0.0, 360.0, 45.0))
        valid = r < harvey_shack.farthest(theta, a)
        u, v = r * np.cos(np.radians(a)), r * np.sin(np.radians(a))
        axes.plot(u[~valid], v[~valid], ".", ms=4, color=NOWHERE)
        axes.plot(u[valid], v[valid], ".", ms=4, color=LINES[0], label="table: 20 × 8 of its 100 × 36")
        at = about_specular(theta, np.arange(10.0, 151.0, 10.0), np.arange(0.0, 360.0, 30.0))[0].reshape(-1, 3)
        axes.plot(*planar(theta, at), ".", ms=4, color=INK, label="by 10° and 30° about the specular direction")
        axes.plot(*planar(theta, scanned(theta)[0]), ".", ms=2.5, color=LINES[1], label="measured")
        style.put_title(axes, f"light from {theta:g}°")
        middle = -math.sin(math.radians(theta))
        axes.set(xlim=(-1.45, 1.45), ylim=(middle - 1.45, middle + 1.45), xlabel="U")
        axes.set_ylabel("V" if not column else "")
    legend_below(figure, axes)
    save(figure, path)


def illuminance(table: et.Bsdf, theta: float, rays: float) -> tuple[Array, float]:
    """E of a hemisphere of 1 m about a sample that gets 1 lm [lx], on 91 × 91 cells seen from above; and its flux."""
    beam = {
        "kind": "beam",
        "flux": 1.0,
        "shape": {"kind": "disk", "radius": 0.1},
        "at": (direction(theta, 180.0) * 20.0).tolist(),
        "toward": (-direction(theta, 180.0)).tolist(),
    }
    sample = {"shape": {"kind": "disk", "radius": 5.0}, "finish": {"kind": "bsdf", "bsdf": table}}
    far = {"name": "far", "kind": "intensity", "c_planes": 72, "gamma_step": 1}
    scene = et.Scene(sources=[beam], surfaces=[sample], detectors=[far])
    found = et.trace(scene, rays=rays, seed=1).intensity["far"]
    x = (np.arange(91) - 45.0) / 45.5
    u, v = np.meshgrid(x, x)
    inside = u * u + v * v < 1.0
    height = np.sqrt(np.where(inside, 1.0 - u * u - v * v, 1.0))
    at = np.stack([np.where(inside, u, 0.0), np.where(inside, v, 0.0), height], axis=-1)
    # E = I/r² at 1 m.
    return np.where(inside, found.in_direction(at), np.nan), float(found.flux)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path())
    parser.add_argument("--rays", type=float, default=4e5)
    given = parser.parse_args()
    folder = given.output
    draw_stages(folder / "appendix-a-stages.png")
    draw_coordinates(folder / "appendix-a-coordinates.png")
    draw_scans(folder / "appendix-b-scans.png")
    draw_edge(folder / "appendix-b-edge.png")
    scans = all_scans()
    tables = {method: et.BsdfTable.from_scans(scans, method) for method in SCHEMES.values()}
    draw_schemes(folder / "appendix-b-schemes.png", tables)
    draw_points(folder / "appendix-b-points.png")
    figure = new_figure(9.6, 8.6, "Illuminance of a hemisphere of 1 m about 1 lm on microcellular PET, from above")
    rows = []
    for line, (title, method) in enumerate(SCHEMES.items()):
        table = tables[method]
        for column, theta in enumerate(THETAS):
            axes = figure.add_subplot(2, 2, 2 * line + column + 1)
            shown, flux = illuminance(table, theta, given.rays)
            lowest = 1e-3 * np.nanmax(shown)
            picture = axes.imshow(
                np.maximum(shown, lowest),
                origin="lower",
                extent=(-1, 1, -1, 1),
                cmap=style.COLOUR_MAPS["value"],
                norm=LogNorm(lowest, float(np.nanmax(shown))),
            )
            style.put_title(axes, f"{title}, {theta:g}°")
            axes.set(xlabel="x [m]" if line else "", ylabel="" if column else "y [m]")
            put_bar(picture, shown, "illuminance", "lx", axes)
            (one,) = (s for s in table.data.slices if abs(s.theta - theta) < 1e-6)
            printed = THESIS[method][column]
            share = f"{100.0 * (one.stated or one.integral()):.1f} %"
            rows.append((title, f"{theta:g}°", share, printed, f"{100.0 * flux:.1f} %"))
    save(figure, folder / "appendix-b-hemisphere.png")
    truth = PET.reflectance(np.array(THETAS))
    print_table(("scheme", "incidence", "share of the table", "thesis", "traced"), rows)
    print(f"true shares: {', '.join(f'{100.0 * share:.1f} %' for share in truth)}\n")
    every = [(method, *(f"{one.integral():.3f}" for one in tabulated(scans, method).slices)) for method in METHODS]
    print_table(("method", "share at 5°", "share at 60°"), every)


if __name__ == "__main__":
    main()
