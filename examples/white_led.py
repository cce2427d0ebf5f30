"""A white LED from two files, blue and yellow.

    python examples/white_led.py

Makers deliver a white LED as a blue and a yellow ray file in watts. Merged, and converted through the wavelength of every
ray, they give luminance in cd/m²: the die is blue, the phosphor around it yellow, and the lumens are nearly all yellow. The
lumens must be those of the two spectra, integrated over V(λ).
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree
from experiments.panels import draw_maps

RAYS = 60_000
LIGHTS = {"blue": (0.5, 0.55, 450.0, 10.0, 1), "yellow": (0.9, 0.6, 565.0, 45.0, 2)}
"""Half the side [mm], flux [W], peak and width of a Gaussian spectrum [nm], seed."""


def light(half: float, watts: float, peak: float, width: float, seed: int) -> et.RaySet:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-half, half, (2, RAYS))
    sine, azimuth = np.sqrt(rng.random(RAYS)), rng.uniform(0.0, 2.0 * math.pi, RAYS)
    direction = np.column_stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.sqrt(1.0 - sine**2)])
    flux = np.full(RAYS, watts / RAYS)
    position = np.column_stack([x, y, np.zeros(RAYS)])
    return et.RaySet(position, direction, flux, flux_unit="W", wavelength=rng.normal(peak, width, RAYS))


def main() -> None:
    parts = {name: light(*facts) for name, facts in LIGHTS.items()}
    for name, rays in parts.items():
        et.write_rays(f"{name}.ray", rays, format="lighttools")
    white = et.RaySet.merge([et.read_rays(f"{name}.ray") for name in parts]).in_unit("lm")
    nm = np.arange(380.0, 780.5, 0.5)
    truth = spread = 0.0
    for _, watts, peak, width, _ in LIGHTS.values():
        share = np.exp(-(((nm - peak) / width) ** 2) / 2.0)
        flat = et.Spectrum(wavelength=nm, weight=share)
        truth += watts * flat.luminous_efficacy
        spread += (683.0 * watts) ** 2 * 0.1 / RAYS  # V(λ) varies by 0.3 over either spectrum
    agree("luminous flux of the merged file [lm]", white.total_flux, truth, math.sqrt(spread))
    seen, screen = et.Observer(0, 0, 1000), et.Screen(2.4, 2.4, 24, 24)
    sources = [parts["blue"].in_unit("lm"), parts["yellow"].in_unit("lm"), white]
    maps = [et.luminance_map(rays, seen, screen, method=et.Cone(acceptance=12)) for rays in sources]
    print(f"blue alone gives {sources[0].total_flux:.4g} lm, yellow alone {sources[1].total_flux:.4g} lm")
    titles = ["blue", "yellow", "white"]
    draw_maps(Path("white-led.png"), "A white LED from two ray files, face on", titles, [("", maps)], size=2.3)
    print("picture: white-led.png")


if __name__ == "__main__":
    main()
