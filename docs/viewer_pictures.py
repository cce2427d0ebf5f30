"""Make the pictures of the viewer, in Chromium: a packaged LED, a collimator cut open, the LED turned.

usage: python docs/viewer_pictures.py [led] [scene] [moving]

Chromium draws without a graphics processor here, some ten seconds for each picture in its full quality; the moving one has
few and small frames for that reason.
"""

from __future__ import annotations

import math
import shutil
import sys
import tempfile
from pathlib import Path

import etendue as et
import numpy as np
from etendue.plot.animation_files import Writing, write_gif
from etendue.viewer.file_output import write_page
from etendue.viewer.opening import exhibit_of

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from oracles.browser import Browser, browsing
from oracles.packaged_led import PackagedLed
from PIL import Image

FIGURES = Path(__file__).with_name("figures")
RAYS = 3_000_000

COLLIMATOR = et.Scene(
    name="collimator",
    sources=[
        {
            "kind": "surface",
            "shape": {"kind": "rectangle", "width": 2, "height": 1.2},
            "at": [0.3, -0.2, 0],
            "flux": 100,
        }
    ],
    solids=[
        {
            "medium": "PMMA",
            "at": [0, 0, 3],
            "shape": {"kind": "lens", "radius": 6, "thickness": 5, "back": {"radius_of_curvature": -6, "conic": -1.2}},
            "finishes": {"edge": "absorber"},
        }
    ],
    surfaces=[
        {
            "shape": {"kind": "cylinder", "radius": 7, "height": 9},
            "finish": {"kind": "lambertian", "reflectance": 0.8},
        }
    ],
)


def led() -> et.LightField:
    """The field of a packaged LED."""
    source = PackagedLed()
    position, direction = source.rays(RAYS, seed=1)
    return et.LightField.fit(et.RaySet(position, direction, np.full(RAYS, source.total_flux / RAYS)))


def show(browser: Browser, value: et.LightField | et.Scene, name: str, *steps: str) -> None:
    """Open a page, do something in it, and wait until it has finished."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "page.html"
        write_page(exhibit_of(value, name=name), path)
        browser.open(path.as_uri())
        for step in steps:
            browser.evaluate(step)
        browser.wait("etendue.finished()")


def show_led(browser: Browser) -> None:
    """From 35°, with isolines, a polygon and a cross section."""
    show(
        browser,
        led(),
        "led.h5",
        "etendue.setView({theta: 35, phi: 20, width: 4})",
        "etendue.setLook({isolines: 10})",
        "etendue.drawn('polygon', [[0.08, -0.46], [0.27, 0.28], [0.62, 0.1], [0.7, -0.42]])",
        "etendue.drawn('line', [[-1.2, 0.1], [1.1, -0.1]])",
        "document.querySelector('#solid-box').style.display = 'none'",
        "document.querySelector('#observer-box').style.display = 'none'",
    )
    browser.wait("etendue.state.regions[0].figures?.flux && etendue.state.section")
    browser.mouse("mouseMoved", x=420, y=300)
    browser.wait("etendue.finished() && document.getElementById('reading').textContent !== '–'")
    browser.screenshot(FIGURES / "viewer-led.png")


def show_scene(browser: Browser) -> None:
    """Cut open, with rays."""
    show(
        browser,
        COLLIMATOR,
        "collimator.toml",
        "etendue.setView({theta: 20, phi: -65, width: 26, target: [0, 0, 5]})",
        "document.getElementById('fit').click()",
        "etendue.setShown({rays: true, axis: 'x', place: 0.5})",
    )
    browser.screenshot(FIGURES / "viewer-scene.png")


FRAMES, MOVING = 24, (800, 500)
"""Frames of the moving picture, and pixels of its page."""


def show_moving(program: str) -> None:
    """Once around the LED, up and down on the way, the pointer on it."""
    with browsing(program, width=MOVING[0], height=MOVING[1]) as browser, tempfile.TemporaryDirectory() as folder:
        show(browser, led(), "led.h5", "etendue.setView({theta: 35, phi: 0, width: 3})")
        browser.mouse("mouseMoved", x=236, y=222)
        frames = []
        for number in range(FRAMES):
            turn = number / FRAMES
            theta = 35.0 + 20.0 * math.sin(2.0 * math.pi * turn)
            browser.evaluate(f"etendue.setView({{theta: {theta:.1f}, phi: {360.0 * turn:.1f}, up: [0, 0, 1]}})")
            browser.wait("etendue.finished() && document.getElementById('reading').textContent !== '–'")
            browser.screenshot(Path(folder) / "frame.png")
            frames.append(np.asarray(Image.open(Path(folder) / "frame.png").convert("RGB")))
    write_gif(Writing(frames, [], "", 0.2), FIGURES / "viewer.gif")


def main() -> None:
    """Make the pictures that are named, or all."""
    program = shutil.which("chromium")
    if program is None:
        sys.exit("no Chromium is installed")
    wanted = sys.argv[1:] or ["led", "scene", "moving"]
    if "moving" in wanted:
        show_moving(program)
    with browsing(program, width=1280, height=800) as browser:
        if "led" in wanted:
            show_led(browser)
        if "scene" in wanted:
            show_scene(browser)


if __name__ == "__main__":
    main()
