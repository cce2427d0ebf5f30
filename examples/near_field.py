"""What a near-field goniophotometer's settings cost: pixels, steps and exposures against lamps known in closed form.

    python examples/near_field.py              # coarse steps and few pixels, seconds
    python examples/near_field.py --full       # the figures and tables of docs/near-field.md, some ten minutes

Three questions. How well does a lamp come back through images, rays and a light field (1.3.1 of the thesis)? What does one
exposure do to a lamp that is 10⁵ times as bright in one place as in another, and how many exposures bring it back (6.2)? And
how does an LED look from the side, where its brightest pixel has a fourteenth (table 3.3), with one exposure?
"""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

import etendue as et
import numpy as np
from etendue.plot import style
from experiments import closed_form_lamps as lamps
from experiments.panels import draw_maps, print_table

OBSERVERS = {"0°": (0.0, 0.0), "33°, 52°": (33.0, 52.0), "62°, 200°": (62.0, 200.0), "78°, 310°": (78.0, 310.0)}
"""Between positions of every step but the first."""

SCREEN = et.Screen(6.6, 6.6, 132, 132)


def truths() -> dict[str, et.LuminanceMap]:
    """The LED's own maps."""
    return {
        name: lamps.luminance_map(lamps.led, et.Observer(theta, phi, 500), SCREEN)
        for name, (theta, phi) in OBSERVERS.items()
    }


def fitted(rays: et.RaySet, *, full: bool) -> et.LightField:
    """As `NearFieldRun.light_field` does it on a plane; on a coarse grid unless in full."""
    return et.LightField.fit(rays, et.Plane(), depths=None if full else (2, 2, 2, 2))


def agreement(source: et.LightField, exact: dict[str, et.LuminanceMap]) -> list[str]:
    """NCC with the lamp's own maps [%]."""
    maps = [et.luminance_map(source, lmap.observer, SCREEN) for lmap in exact.values()]
    return [f"{100 * et.compare(m, lmap).ncc:.2f}" for m, lmap in zip(maps, exact.values(), strict=True)]


def round_trip(*, full: bool, folder: Path) -> None:
    """The LED → instrument → light field → maps, over pixels, steps and exposures; and through rays."""
    exact = truths()
    rows = []
    base = (5.0, 128) if full else (15.0, 32)
    settings = [(base[0], p) for p in ((32, 64, 128, 256) if full else (32,))]
    settings += [(s, base[1]) for s in ((15.0, 10.0) if full else ())]
    runs, fields = {}, {}
    for step, pixels in settings:
        gonio = et.NearFieldGoniophotometer(step, camera_pixels=pixels, exposures=2, distance=100)
        run = gonio.measure(lamps.led, size=lamps.LED_SIZE, samples=4)
        field = fitted(run.ray_set(), full=full)
        row = [f"{step:g}°", f"{pixels}", f"{run.lit_pixels:,}", f"{100 * (run.total_flux / LED_FLUX - 1):+.2f}"]
        rows.append(row + agreement(field, exact))
        runs[step, pixels], fields[step, pixels] = run, field
    print_table(["step", "pixels", "lit pixels", "flux [%]", *OBSERVERS], rows)
    kept, whole, rows = runs[base], fields[base], []
    for n in (10**5, 10**6, 10**7) if full else (10**4,):
        field = fitted(kept.ray_set(n), full=full)
        rows.append([f"{n:,} rays", *agreement(field, exact)])
    one = kept.using(1)
    rows.append(["all pixels, one exposure", *agreement(fitted(one.ray_set(), full=full), exact)])
    rows.append(["all pixels, two exposures", *agreement(whole, exact)])
    print_table(["light field from", *OBSERVERS], rows)
    pictures = [
        (name, [*(et.luminance_map(f, exact[name].observer, SCREEN) for f in (field, whole)), exact[name]])
        for name in list(OBSERVERS)[1:3]
    ]
    titles = [f"through {style.grouped(str(n))} rays", "from all pixels", "the lamp itself"]
    heading = "An LED, measured by a near-field goniophotometer"
    draw_maps(folder / "near-field-round-trip.png", heading, titles, pictures, "root")


def led_flux() -> float:
    """∫ L cos γ over the LED in closed form [lm]: the rim's terms in x vanish."""
    x, y = (np.arange(2000) + 0.5) / 1000 - 0.8, (np.arange(1600) + 0.5) / 1000 - 0.8
    points = np.stack(np.broadcast_arrays(x[None, :], y[:, None], 0.0), axis=-1).reshape(-1, 3)
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), points.shape)
    texture = lamps.led(points - up, up).sum() * 1e-6 / lamps.DIE
    die = lamps.DIE * texture * np.pi * (0.8 + 0.2 * 2 / 3)
    rim = lamps.RIM * np.pi * (3.0**2 - 2.5**2) * np.pi * (1.2 - 0.6 * 2 / 3)
    return float(die + rim) / 1e6


LED_FLUX = led_flux()


def dynamic_range(*, full: bool, folder: Path) -> None:
    """A reflector that glows with a hundred thousandth of its chip's luminance."""
    total = lamps.CHIP_FLUX + lamps.GLOW_FLUX
    print(
        f"\nchip {lamps.CHIP_FLUX:.1f} lm, reflector {lamps.GLOW_FLUX:.1f} lm, {lamps.GLOW_FLUX / total:.1%} of all\n"
    )
    rows = []
    gonio = et.NearFieldGoniophotometer(15 if full else 30, camera_pixels=512 if full else 64, exposures=5)
    for bits, error in ((8, 0.0), (12, 0.0), (16, 0.0), (12, 0.02)) if full else ((12, 0.0),):
        camera = dataclasses.replace(gonio, bits=bits, exposure_error=error)
        run = camera.measure(lamps.reflector, size=lamps.REFLECTOR_SIZE, samples=4)
        for n in (1, 2, 3, 4, 5):
            some = run.using(n)
            lmap = some.luminance_map(0)
            away = np.hypot(lmap.screen.x[None, :] - 20, lmap.screen.y[:, None] + 10) > 8
            seen = lmap.values[away].sum() * lmap.screen.pixel_area * np.pi / 1e6
            chip = lmap.values[~away].sum() * lmap.screen.pixel_area * np.pi / 1e6
            near = lamps.GLOW * np.pi * 8**2 * np.pi / 1e6
            rows.append([
                f"{bits}", f"{error:.0%}", f"{n}", f"{some.setting.camera.dynamic_range:,.0f}",
                f"{100 * some.disagreement:.2f}",
                f"{100 * (chip / (lamps.CHIP_FLUX + near) - 1):+.2f}",
                f"{100 * (seen / (lamps.GLOW_FLUX - near) - 1):+.1f}",
            ])  # fmt: skip
        print(
            f"{bits} bits, times to {error:.0%}: exposures needed for 0.1 % of the flux: {run.exposures_needed(1e-3)}"
        )
        if bits == 12 and not error:
            et.plot_near_field(
                run.using(1), folder / "near-field-one-exposure.png", title="Chip and reflector, one exposure"
            )
            et.plot_near_field(
                run.using(4), folder / "near-field-exposures.png", title="Chip and reflector, four exposures"
            )
    print()
    print_table(
        [
            "bits",
            "error of times",
            "exposures",
            "dynamic range",
            "disagreement [%]",
            "chip from 0° [%]",
            "reflector from 0° [%]",
        ],
        rows,
    )


def from_the_side(*, full: bool, folder: Path) -> None:
    """A die under a dome that glows: images with one exposure of 8 bits, over what is taken for dark, against the truth."""
    gonio = et.NearFieldGoniophotometer(30, camera_pixels=128 if full else 48, exposures=4, bits=8, distance=100)
    rows, pictures = [], []
    angles = (0.0, 30.0, 60.0, 90.0)
    for threshold in (5.0, 15.0, 24.0, 30.0):
        camera = dataclasses.replace(gonio, threshold=threshold)
        run = camera.measure(lamps.dome, size=2.6, samples=25 if full else 4)
        for n in (1, 4) if threshold == 5.0 else (1,):
            some, row = run.using(n), []
            for gamma in angles:
                seen = some.luminance_map(gamma)
                exact = lamps.luminance_map(lamps.dome, seen.observer, seen.screen)
                found = et.compare(seen, exact)
                row.append(f"{100 * found.ncc:.1f} / {100 * found.nrmse:.1f}")
                if gamma == 90.0:
                    pictures.append(seen)
            least = run.setting.camera.least_count / run.setting.camera.highest
            rows.append([f"{n}", f"{least:.1%}", f"{100 * some.disagreement:.2f}", *row])
    brightest = [exact_maximum(run, gamma) for gamma in angles]
    heads = [f"{g:g}°, brightest 1/{brightest[0] / b:.1f}" for g, b in zip(angles, brightest, strict=True)]
    print("\nDome: NCC / NRMSE [%] against the lamp's own images\n")
    print_table(["exposures of 8 bits", "dark below, of full scale", "disagreement [%]", *heads], rows)
    exact = lamps.luminance_map(lamps.dome, pictures[0].observer, pictures[0].screen)
    titles = [f"{row[0]} exposure{'s' * (row[0] != '1')}, dark below {row[1].replace('%', ' %')}" for row in rows]
    heading = "A die under a glowing dome, images from the side"
    rows = [("γ = 90°", [*pictures, exact])]
    draw_maps(folder / "near-field-side.png", heading, [*titles, "the lamp itself"], rows, "root")


def exact_maximum(run: et.NearFieldRun, gamma: float) -> float:
    """Of the lamp's own image."""
    seen = run.luminance_map(gamma)
    return float(lamps.luminance_map(lamps.dome, seen.observer, seen.screen).values.max())


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--full", action="store_true", help="the figures and tables of docs/near-field.md")
    options.add_argument("--output", type=Path, default=Path("near-field"), help="folder for pictures")
    options.add_argument("--only", choices=("round-trip", "dynamic-range", "side"), help="one part alone")
    given = options.parse_args()
    given.output.mkdir(exist_ok=True)
    parts = {"round-trip": round_trip, "dynamic-range": dynamic_range, "side": from_the_side}
    for name, part in parts.items():
        if given.only in {None, name}:
            part(full=given.full, folder=given.output)


if __name__ == "__main__":
    main()
