"""Figures 3.16 and 3.17 of the thesis: a lens that makes a beam of 13° of an LED, lit by models of that LED.

    python examples/narrow_beam.py              # few rays and coarse grids, seconds
    python examples/narrow_beam.py --full       # four million rays: the figures of docs/chapter-3.md

The lens stands before the LED of `dome_led.py`. Truth is the LED itself, die, dome and base, together with the lens. The
models are what one gets from a vendor or makes of it: the ray file, the light field fitted to it, the patches of section
3.3.2, and a Lambertian square as large as the die with the same flux.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
from etendue.goniophotometry.comparison import compare_intensities
from experiments import led
from experiments.panels import INK, LINES, QUICK, draw_maps, legend_below, measures, new_figure, print_table, save

LENS = {
    "name": "lens",
    "shape": {
        "kind": "lens",
        "radius": 8,
        "thickness": 12.73,
        "front": {"radius_of_curvature": 24.4, "conic": 2.27, "coefficients": [-2.63e-4]},
        "back": {"radius_of_curvature": -4.795, "conic": -0.723, "coefficients": [-1.747e-4, -1.39e-6]},
    },
    # Section 3.3.3: n = 1.51, 0.2 per metre.
    "medium": {"index": 1.51, "absorption": 2e-4},
    "finishes": {"edge": "absorber"},
    "at": [0, 0, 2.2],
}
"""Found by an evolution strategy (CMA-ES) of 1500 steps over these nine numbers, from 5000 rays of the LED: merit as in the
thesis, the share of the light that meets the target."""

TARGET = {"name": "target", "kind": "rays", "shape": {"kind": "disk", "radius": 15}, "at": [0, 0, 131]}
FAR = {"name": "far field", "kind": "intensity", "c_planes": 8, "gamma_step": 0.5}
VERTEX = 2.2 + 12.73
OBSERVERS = [et.Observer(theta, 0, 1000, target=(0, 0, VERTEX)) for theta in (0, 3, 6, 9)]


def square(flux: float) -> dict[str, Any]:
    """A Lambertian square as large as the die (section 3.3.3)."""
    return {
        "kind": "surface",
        "shape": {"kind": "rectangle", "width": 1, "height": 1},
        "flux": flux,
        "at": [0, 0, led.DIE_TOP],
    }


def luminaires(near_field: et.RaySet, *, full: bool) -> dict[str, et.Scene]:
    """The lens before the LED itself, and before each model of it."""
    field = et.LightField.fit(near_field, led.LOW_BOX, depths=None if full else QUICK)
    grid = et.GriddedSource.fit(near_field, et.Dome(radius=led.CARRIER), 0.125, 0.01, 16).as_printed
    print(f"gridded: {grid.notes[0]}, E = {grid.threshold:g} %")
    models: dict[str, dict[str, Any]] = {
        "ray file": {"kind": "rays", "rays": near_field},
        "light field": {"kind": "light-field", "field": field},
        **(
            {"field, automatic": {"kind": "light-field", "field": et.LightField.fit(near_field, "auto")}}
            if full
            else {}
        ),
        "gridded": {"kind": "gridded", "gridded": grid, "draws": len(near_field)},
        "Lambertian square": square(near_field.total_flux),
    }
    detectors = [TARGET, FAR]
    parts = {**led.PARTS, "solids": [*led.PARTS["solids"], LENS]}
    found = {"the LED itself": et.Scene(name="LED and lens", **parts, detectors=detectors)}
    found |= {
        name: et.Scene(name=f"{name} and lens", sources=[source], solids=[LENS], detectors=detectors)
        for name, source in models.items()
    }
    # The ray file again, but light that the lens sends back meets what the LED is made of.
    body = {**parts, "sources": [models["ray file"]]}
    found["ray file before the LED's body"] = et.Scene(name="ray file, body and lens", **body, detectors=detectors)
    return found


def profile(intensity: et.Intensity) -> tuple[Any, Any]:
    """Angle from -90° to 90° in the planes C180 and C0, and intensity [cd]."""
    near = intensity.gamma <= 90
    half = len(intensity.c) // 2
    gamma = intensity.gamma[near]
    values = np.concatenate([intensity.values[half][near][:0:-1], intensity.values[0][near]])
    return np.concatenate([-gamma[:0:-1], gamma]), values


def width(angle: Any, values: Any) -> float:
    """Full width at half maximum [°], linear between the nodes."""
    above = np.flatnonzero(values >= values.max() / 2)
    first, last = above[0], above[-1]
    level = values.max() / 2

    def crossing(inside: int, outside: int) -> float:
        share = (values[inside] - level) / (values[inside] - values[outside])
        return float(angle[inside] + share * (angle[outside] - angle[inside]))

    return crossing(last, last + 1) - crossing(first, first - 1)


def draw_profiles(path: Path, profiles: dict[str, tuple[Any, Any]]) -> None:
    """Figure 3.17."""
    made = new_figure(8.4, 4.0, "Figure 3.17: LED and lens, intensity in the C0–C180 plane")
    for axes, reach in zip(made.subplots(1, 2), (15, 20), strict=True):
        for (name, (angle, values)), colour in zip(profiles.items(), (INK, *LINES), strict=False):
            dashes = {"the LED itself": "-", "Lambertian square": "-."}.get(name, "--")
            shown = np.abs(angle) <= reach
            axes.plot(angle[shown], values[shown], dashes, color=colour, linewidth=1.2, label=name)
        axes.set_xlabel("γ, C180 left and C0 right [°]")
    made.axes[0].set_ylabel("intensity [cd]")
    made.axes[1].set_yscale("log")
    made.axes[1].set_ylim(bottom=made.axes[1].get_ylim()[1] * 1e-4)
    legend_below(made, made.axes[0])
    save(made, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=100_000)
    parser.add_argument("--pixels", type=int, default=24, help="along a side of each map")
    parser.add_argument("--full", action="store_true", help="four million rays, fine grids, 60 × 60 pixels")
    parser.add_argument("--output", type=Path, default=Path("narrow-beam"), help="folder for the figures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    rays, pixels, lines = (4_000_000, 60, 512) if options.full else (options.rays, options.pixels, 16)

    near_field = led.ray_file(rays)
    scenes = luminaires(near_field, full=options.full)
    print(f"the LED: {near_field.total_flux:.2f} lm in {len(near_field):,} rays")
    print(f"target: full angle 2 atan(15/131) = {2 * math.degrees(math.atan(15 / 131)):.2f}°\n")
    results = {name: et.trace(scene, rays=rays, seed=2) for name, scene in scenes.items()}
    far = {name: result.intensity.only for name, result in results.items()}
    profiles = {name: profile(intensity) for name, intensity in far.items()}
    rows = []
    for name, result in results.items():
        agreement = compare_intensities(far[name], far["the LED itself"])
        share = result.rays["target"].total_flux / near_field.total_flux
        error = math.sqrt(share * (1 - share) / rays)
        angle, values = profiles[name]
        rows.append(
            [
                name,
                f"{share:.2%} ± {error:.2%}",
                f"{values.max():,.0f}",
                f"{width(angle, values):.2f}",
                f"{agreement.ncc_sphere:.3%}",
                f"{agreement.nrmse_sphere:.3%}",
            ]
        )
    heads = ["source", "light on the target", "peak [cd]", "FWHM [°]", "NCC over the sphere", "NRMSE over the sphere"]
    print_table(heads, rows)

    screen = et.Screen(18, 18, pixels, pixels)
    seen = ("the LED itself", "light field", "Lambertian square")
    maps = {
        name: et.luminance_map(scenes[name], OBSERVERS, screen, method=et.PathTracing(rays_per_pixel=lines))
        for name in seen
    }
    print(
        "\nmaps of the lens against those with the LED itself: NCC / NRMSE of eq. 3.6 / true NRMSE [%]; intensity [cd]\n"
    )
    rows = []
    for i, observer in enumerate(OBSERVERS):
        truth = maps["the LED itself"][i]
        cells = [cell for name in seen[1:] for cell in (" / ".join(measures(maps[name][i], truth)),)]
        rows.append([f"{observer.theta:g}°", *cells, " / ".join(f"{maps[name][i].intensity:,.0f}" for name in seen)])
    print_table(["θ", *seen[1:], "intensity: " + ", ".join(seen)], rows)
    drawn = scenes["the LED itself"].replace(name="Figure 3.16: LED and lens", detectors=[])
    et.draw_scene(drawn, options.output / "figure-3.16.png", section=["y=0"], rays=24, window=(-9.5, 9.5, -1.5, 20))
    draw_profiles(options.output / "figure-3.17.png", {name: profiles[name] for name in list(profiles)[:-1]})
    shown = [*seen[1:], seen[0]]
    pictures = [(f"θ = {o.theta:g}°", [maps[name][i] for name in shown]) for i, o in enumerate(OBSERVERS)]
    heading = "A lens for a narrow beam, lit by models of an LED"
    draw_maps(options.output / "narrow-beam.png", heading, shown, pictures, kind="root")
    print(f"\nfigures: {options.output}/")


if __name__ == "__main__":
    main()
