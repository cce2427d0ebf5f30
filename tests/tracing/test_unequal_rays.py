"""Sets whose rays have unequal flux: errors against the spread of many files of one lamp, at a significance of 1e-4."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from oracles.verdicts import assert_agree

Array = npt.NDArray[np.float64]
FILES = 50
FLUX = 100.0


def grid(
    name: str, *, at: tuple[float, float, float], size: tuple[float, float], cells: tuple[int, int] = (1, 1)
) -> Any:
    """An illuminance meter that looks down."""
    return {"name": name, "kind": "illuminance", "width": size[0], "height": size[1], "columns": cells[0],
            "rows": cells[1], "at": at, "toward": [0, 0, -1]}  # fmt: skip


BRIGHT = 0.02 * 50 / (0.02 * 50 + 0.98)
"""Share of the light of the bright rays of `two_kinds`."""


def two_kinds(n: int, seed: int, *, parallel: bool = True) -> et.RaySet:
    """Of 50 rays one, of flux 50, is on the left, the others, of flux 1, are on the right: upwards, or to that side in all
    directions alike.
    """
    rng = np.random.default_rng(5000 + seed)
    heavy = rng.random(n) < 0.02
    side = np.where(heavy, -1.0, 1.0)
    position = np.stack([side * rng.uniform(0, 5, n), rng.uniform(-5, 5, n), np.zeros(n)], axis=1)
    direction = np.tile([0, 0, 1.0], (n, 1))
    if not parallel:
        direction = rng.normal(size=(n, 3))
        direction[:, 0] = side * np.abs(direction[:, 0])
    return et.RaySet(position, direction, np.where(heavy, 50.0, 1.0))


def six_decades(n: int, seed: int) -> et.RaySet:
    """Parallel rays upwards whose fluxes are spread over six decades; one of ten passes far from the axis."""
    rng = np.random.default_rng(1000 + seed)
    position = np.stack([rng.uniform(-5, 5, n), rng.uniform(-5, 5, n), np.zeros(n)], axis=1)
    position[rng.random(n) < 0.1, 0] = 20.0
    return et.RaySet(position, np.tile([0, 0, 1.0], (n, 1)), 10 ** rng.uniform(-6, 0, n))


def source(rays: et.RaySet) -> dict[str, Any]:
    return {"name": "led", "kind": "rays", "rays": rays, "flux": FLUX}


MANY = [(3000, 3000, 0.0), (3000, 8000, 0.0), (20_000, 3000, 0.0), (3000, 6000, 100.0)]
"""Rays of a set, rays of a trace, flux of another lamp: all of the set, each several times, a part of it, all of it beside
others."""


def assert_spread(*, found: dict[str, list[et.LuminanceMap]], expected: list[float]) -> None:
    """Of maps of many files: pixels spread about what is expected as they state."""
    for maps in found.values():
        for pixel, truth in enumerate(expected):
            values, errors = np.array([[m.values.flat[pixel], m.standard_error.flat[pixel]] for m in maps]).T
            assert_agree(values=values, expected=truth, standard_error=errors)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "rays", "lamp"), MANY)
def test_light_of_many_faint_rays_has_the_error_of_the_few_bright_ones(n: int, rays: int, lamp: float) -> None:
    """With a stated total, what the few bright rays bring too little goes to the others: over many files of a lamp either
    side spreads as stated, in illuminance, and in the luminance of a wall from a light image and from stored scatters.

    By the rays' fluxes alone, without the total, the faint side would have an error of a twentieth of that.
    """
    eye, screen = et.Observer(180, 0, 1e6, target=(0, 0, 6)), et.Screen(8, 8, 2, 1)
    wall = {"name": "wall", "shape": {"kind": "rectangle", "width": 10, "height": 10}, "at": [0, 0, 6],
            "finish": {"kind": "lambertian", "reflectance": 0.5}}  # fmt: skip
    keys: dict[str, Any] = {
        "surfaces": [wall],
        "observers": [{"name": "eye", "theta": 180, "distance": 1e6, "target": [0, 0, 6],
                       "screen": {"width": 8, "height": 8, "columns": 2, "rows": 1}}],
        "detectors": [grid("cells", at=(0, 0, 5), size=(10, 10), cells=(2, 1)),
                      {"name": "image", "kind": "image", "observer": "eye"}, {"name": "scatter", "kind": "scatter"}],
    }  # fmt: skip
    found: dict[str, list[Any]] = {"cells": [], "image": [], "scatter": []}
    for seed in range(FILES):
        # The other lamp is on the other side of the wall.
        beside = [{"name": "lamp", "kind": "point", "flux": lamp, "at": [0, 0, 99]}] if lamp else []
        result = et.trace(et.Scene(sources=[source(two_kinds(n, seed)), *beside], **keys), rays, seed)
        found["cells"].append(result.illuminance["cells"])
        found["image"].append(result.images["image"])
        found["scatter"].append(et.luminance_map(result.events["scatter"], eye, screen))
    # As the eye sees them from below, or the cells lie.
    lit = [FLUX * share / 50e-6 for share in (BRIGHT, 1 - BRIGHT)]
    for name, maps in found.items():
        first = np.argmax(sum(m.values.ravel() for m in maps))
        expected = lit if first == 0 else lit[::-1]
        scale = 1.0 if name == "cells" else 0.5 / math.pi
        assert_spread(found={name: maps}, expected=[scale * e for e in expected])


@pytest.mark.slow
@pytest.mark.parametrize(("n", "rays", "lamp"), MANY)
def test_intensities_of_unequal_rays_spread_as_stated(n: int, rays: int, lamp: float) -> None:
    """One half of space is as bright everywhere, and so is the other, by themselves and in the light of a lamp."""
    far = {"name": "far", "kind": "intensity", "c_planes": 4, "gamma_step": 45}
    found = []
    for seed in range(FILES):
        beside = [{"name": "lamp", "kind": "point", "flux": lamp, "at": [9, 0, -9]}] if lamp else []
        sources = [source(two_kinds(n, seed, parallel=False)), *beside]
        found.append(et.trace(et.Scene(sources=sources, detectors=[far]), rays, seed).intensity["far"])
    for plane, share in ((0, 1 - BRIGHT), (2, BRIGHT)):
        values, errors = np.array([[one.values[plane, 2], one.standard_error[plane, 2]] for one in found]).T
        assert_agree(values=values, expected=FLUX * share / (2 * math.pi) + lamp / (4 * math.pi), standard_error=errors)


def test_a_detector_that_all_light_meets_has_no_error() -> None:
    """However unequal the rays are and however many there are, all of a stated flux is that flux: no noise, no rounding."""
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "exponent": 9, "flux": FLUX}
    detectors = [
        grid("all", at=(0, 0, 5), size=(99, 99)),
        {"name": "far", "kind": "intensity", "c_planes": 2, "gamma_step": 90},
    ]
    equal = [(lamp, rays) for rays in (2000, 3001, 40_001)]
    for light, rays in [*equal, (source(six_decades(2000, 1)), 2000), (source(six_decades(2000, 1)), 6000)]:
        result = et.trace(et.Scene(sources=[light], detectors=detectors), rays)
        far, seen = result.intensity["far"], result.illuminance["all"]
        assert far.flux == pytest.approx(FLUX, rel=1e-12)
        assert far.flux_error == 0.0
        # A beam and a lobe do not miss a plate of this size, but for one ray of ten thousand of the lobe.
        missed = FLUX - seen.flux
        assert seen.standard_error[0, 0] == 0.0 if missed < 1e-9 else seen.standard_error[0, 0] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("rays", [2000, 10_000])
def test_measures_of_sweeps_spread_as_stated(rays: int) -> None:
    """Of 10 000 rays over six decades of flux some or all: what is emitted, escapes and is absorbed, and the flux on one
    cell and on 36, over many files. 0.9 of the light meets a wall, which absorbs half of it.

    The emitted flux of all rays is what is stated.
    """
    wall = {"name": "wall", "shape": {"kind": "rectangle", "width": 10, "height": 10}, "at": [0, 0, 5],
            "finish": {"kind": "lambertian", "reflectance": 0.5}}  # fmt: skip
    detectors = [
        grid("one", at=(0, 0, 4.5), size=(10, 10)),
        grid("many", at=(0, 0, 4.6), size=(10, 10), cells=(6, 6)),
        {"name": "far", "kind": "intensity", "c_planes": 1, "gamma_step": 90},
    ]
    expected = {"emitted": FLUX, "escaped": 55.0, "efficiency": 0.55, "absorbed": 45.0, "flux:one": 90.0,
                "flux:many": 90.0, "mean:many": 90.0 / 100e-6, "flux:far": 55.0}  # fmt: skip
    tables = []
    for seed in range(FILES):
        scene = et.Scene(sources=[source(six_decades(10_000, seed))], surfaces=[wall], detectors=detectors)
        tables.append(et.sweep(scene, {"wall.at.2": [5.0]}, list(expected), rays=rays, seed=seed))
    if rays == 10_000:
        assert all(table["emitted"] == pytest.approx(FLUX) and table.standard_error["emitted"] == 0 for table in tables)
        del expected["emitted"]
    for name, truth in expected.items():
        values, errors = (np.array([float(part[name][0]) for part in parts]) for parts in (
            tables, [table.standard_error for table in tables]))  # fmt: skip
        assert_agree(values=values, expected=truth, standard_error=errors)
    assert all(
        math.isclose(table.standard_error["flux:one"][0], table.standard_error["flux:many"][0], rel_tol=1e-9)
        for table in tables
    )


def test_light_that_comes_again_and_again_has_no_smaller_error() -> None:
    """Between two white plates rays of unequal flux pass a cell many times: Φ/(1 − r²) upwards, over many files."""
    plate = {
        "shape": {"kind": "rectangle", "width": 1e6, "height": 1e6},
        "finish": {"kind": "lambertian", "reflectance": 0.8},
    }
    meter = grid("cell", at=(0, 0, 4), size=(1e6, 1e6))
    found = []
    for seed in range(FILES):
        scene = et.Scene(
            sources=[source(six_decades(1000, seed))],
            surfaces=[plate | {"at": [0, 0, z]} for z in (-1, 9)],
            detectors=[meter],
        )
        seen = et.trace(scene, 1000, seed).illuminance["cell"]
        found.append((seen.flux, float(seen.standard_error[0, 0]) * 1e6))
    values, errors = np.array(found).T
    assert_agree(values=values, expected=FLUX / (1 - 0.8**2), standard_error=errors)
