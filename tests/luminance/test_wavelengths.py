"""Light of many wavelengths on lines of sight, each of which has one: means and errors where few of them get through."""

from __future__ import annotations

from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from oracles.verdicts import REVERSE, assert_agree

Array = npt.NDArray[np.float64]

WAVELENGTH = np.arange(400.0, 701.0, 4.0)
"""[nm]."""

SIDE, HEIGHT, FLUX, WHITE = 10.0, 100.0, 500.0, 0.6
"""Of a square lamp over a floor [mm, mm, lm], and the reflectance of what is white."""

TARGET, PIXELS, WIDTH = (30.0, 15.0), 6, 6.0


def bell(*, middle: float, width: float) -> Array:
    """A normal curve over `WAVELENGTH`."""
    return np.asarray(np.exp(-0.5 * ((WAVELENGTH - middle) / width) ** 2))


def shares(curve: Array) -> Array:
    """Shares of a flux."""
    return curve / curve.sum()


LED = shares(0.06 * bell(middle=450, width=10) + bell(middle=565, width=45))
"""A white LED in lumens: little of them is blue."""

BLUE = 0.9 * bell(middle=432, width=7)
"""A dark blue filter: 0.4 % of the lumens of `LED` get through."""


def floor_luminance(*, lamp: tuple[float, float], depth: Array | None = None) -> Array:
    """ρ/π ∫ L cosθ₁ cosθ₂/d² dA [cd/m²] over a lamp that faces a floor, by the midpoint rule, in each pixel.

    With a depth for each wavelength, light is weakened by exp(−depth/cosθ), and a wavelength is the first axis.
    """
    place = ((np.arange(4 * PIXELS) + 0.5) / (4 * PIXELS) - 0.5) * WIDTH
    x, y = np.meshgrid(TARGET[0] + place, TARGET[1] - place)
    side = ((np.arange(24) + 0.5) / 24 - 0.5) * SIDE
    u, v = (axis.ravel() for axis in np.meshgrid(lamp[0] + side, lamp[1] + side))
    square = (x.reshape(-1, 1) - u) ** 2 + (y.reshape(-1, 1) - v) ** 2 + HEIGHT**2
    cosine = HEIGHT / np.sqrt(square)
    luminance = FLUX / (np.pi * SIDE**2 * 1e-6)
    each = WHITE / np.pi * luminance * cosine**2 / square * SIDE**2 / u.size
    depths = np.zeros(1) if depth is None else depth
    fine = np.array([np.sum(each * np.exp(-one / cosine), axis=1) for one in depths])
    pixels = fine.reshape(-1, PIXELS, 4, PIXELS, 4).mean(axis=(2, 4))
    return pixels[0] if depth is None else pixels


def lamp(spectrum: Array, at: tuple[float, float] = (0.0, 0.0)) -> dict[str, Any]:
    """A square lamp that faces the floor."""
    return {"kind": "surface", "shape": {"kind": "rectangle", "width": SIDE, "height": SIDE}, "flux": FLUX,
            "at": [*at, HEIGHT], "toward": [0, 0, -1],
            "spectrum": np.column_stack([WAVELENGTH, spectrum]).tolist()}  # fmt: skip


def table(values: Array, wavelength: Array = WAVELENGTH) -> dict[str, Any]:
    """Of a finish or a medium, over the wavelength."""
    return {"wavelength": wavelength.tolist(), "values": values.tolist()}


def floor(reflectance: Any = WHITE) -> dict[str, Any]:
    """A large floor."""
    return {"shape": {"kind": "rectangle", "width": 2000, "height": 2000},
            "finish": {"kind": "lambertian", "reflectance": reflectance}}  # fmt: skip


def maps_of(scene: et.Scene, *, lines: int, seeds: int, **options: Any) -> list[et.LuminanceMap]:
    """From far above, so that all lines of sight are upright."""
    observer = et.Observer(0, 0, 4e6, target=(*TARGET, 0.0))
    screen = et.Screen(WIDTH, WIDTH, PIXELS, PIXELS, "xy")
    methods = [et.PathTracing(rays_per_pixel=lines, seed=seed, **options) for seed in range(1, seeds + 1)]
    return [et.luminance_map(scene, observer, screen, method=method) for method in methods]


def agree(maps: list[et.LuminanceMap], expected: Array) -> None:
    """Means and errors of some maps are right."""
    assert_agree(
        values=np.array([lmap.values for lmap in maps]),
        expected=expected,
        standard_error=np.array([lmap.standard_error for lmap in maps]),
        degrees=REVERSE,
    )


@pytest.mark.parametrize("lines", [64, 256, 1024])
def test_a_dark_blue_floor_under_a_white_led(lines: int) -> None:
    """By flux 0.3 of the 64 lines of a pixel would have a wavelength that the floor reflects, and most pixels none."""
    scene = et.Scene(sources=[lamp(LED)], surfaces=[floor(table(BLUE))])
    agree(maps_of(scene, lines=lines, seeds=3), floor_luminance(lamp=(0, 0)) * np.sum(LED * BLUE) / WHITE)


@pytest.mark.parametrize("lines", [64, 256])
def test_a_white_floor_through_a_dark_blue_filter(lines: int) -> None:
    """The filter lies over the lamp and is seen through once."""
    sheet = {"shape": {"kind": "rectangle", "width": 2000, "height": 2000}, "at": [0, 0, 2 * HEIGHT],
             "finish": {"kind": "transmitter", "transmittance": table(BLUE)}}  # fmt: skip
    scene = et.Scene(sources=[lamp(LED)], surfaces=[floor(), sheet])
    agree(maps_of(scene, lines=lines, seeds=3), floor_luminance(lamp=(0, 0)) * np.sum(LED * BLUE))


def test_two_filters_of_which_little_passes_both() -> None:
    """Neither foresees what the other leaves."""
    other = 0.9 * bell(middle=470, width=14)
    sheets = [
        {"shape": {"kind": "rectangle", "width": 2000, "height": 2000}, "at": [0, 0, height],
         "finish": {"kind": "transmitter", "transmittance": table(values)}}
        for height, values in ((2 * HEIGHT, BLUE), (3 * HEIGHT, other))
    ]  # fmt: skip
    scene = et.Scene(sources=[lamp(LED)], surfaces=[floor(), *sheets])
    agree(maps_of(scene, lines=256, seeds=3), floor_luminance(lamp=(0, 0)) * np.sum(LED * BLUE * other))


def test_a_pool_of_blue_water() -> None:
    """Light from the lamp goes down through it at an angle, and comes up upright; connections pass its surface."""
    depth, absorption = 20.0, 0.002 + 0.15 * (1 - bell(middle=440, width=15))
    pool = {"shape": {"kind": "block", "width": 3000, "height": 3000, "depth": depth}, "at": [0, 0, 1 + depth / 2],
            "medium": {"index": 1, "absorption": table(absorption)}}  # fmt: skip
    scene = et.Scene(sources=[lamp(LED)], surfaces=[floor()], solids=[pool])
    weakened = floor_luminance(lamp=(0, 0), depth=absorption * depth) * np.exp(-absorption * depth)[:, None, None]
    agree(maps_of(scene, lines=256, seeds=3), np.tensordot(LED, weakened, axes=1))


def test_lamps_of_several_colours_on_a_white_floor_err_as_white_ones_do() -> None:
    """What nothing selective has met is no noise of colours: each line counts all light of all lamps."""
    red, green = (shares(bell(middle=middle, width=8)) for middle in (630, 525))
    filtered = {"shape": {"kind": "rectangle", "width": 5, "height": 5}, "at": [900, 900, 50],
                "finish": {"kind": "transmitter", "transmittance": table(BLUE)}}  # fmt: skip
    places = ((0.0, 0.0), (60.0, -20.0))
    expected = np.sum([floor_luminance(lamp=at) for at in places], axis=0)
    found = {}
    for spectra in ((red, green), (LED, LED)):
        lamps = [lamp(spectrum, at) for spectrum, at in zip(spectra, places, strict=True)]
        scene = et.Scene(sources=lamps, surfaces=[floor(), filtered])
        maps = maps_of(scene, lines=64, seeds=3)
        agree(maps, expected)
        found[spectra[0] is red] = np.array([lmap.values for lmap in maps])
    # The same lines of sight: their wavelengths are all that differs.
    assert np.allclose(found[True], found[False], rtol=1e-12)


@pytest.mark.parametrize("step", [4, 20, 50])
@pytest.mark.parametrize("gather", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_an_integrating_sphere_of_a_coloured_paint(step: int, gather: bool) -> None:
    """A point in the middle of a sphere: L = Φ/(πA) Σ s ρ/(1 − ρ); known exitance of few wavelengths, of many, and none."""
    wavelength = np.arange(400.0, 701.0, step)
    spectrum = shares(np.interp(wavelength, WAVELENGTH, LED))
    paint = np.interp(wavelength, [400, 500, 600, 700], [0.3, 0.2, 0.6, 0.5])
    radius = 50.0
    source = {"kind": "point", "flux": FLUX, "spectrum": np.column_stack([wavelength, spectrum]).tolist()}
    wall = {"shape": {"kind": "sphere", "radius": radius},
            "finish": {"kind": "lambertian", "reflectance": table(paint, wavelength)}}  # fmt: skip
    scene = et.Scene(sources=[source], surfaces=[wall])
    observer, screen = et.Observer(30, 40, 20, target=(5.0, -3.0, 2.0)), et.Screen(20, 20, 5, 5)
    methods = [et.PathTracing(rays_per_pixel=256, seed=seed, gather=gather) for seed in (1, 2)]
    maps = [et.luminance_map(scene, observer, screen, method=method) for method in methods]
    area = 4 * np.pi * radius**2 * 1e-6
    agree(maps, np.full((5, 5), FLUX / (np.pi * area) * np.sum(spectrum * paint / (1 - paint))))
