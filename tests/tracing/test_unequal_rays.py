"""Sets whose rays have unequal flux: errors against the spread of many files of one lamp, at a significance of 1e-4."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from oracles.verdicts import SIGNIFICANCE, assert_agree
from scipy.stats import chi2

Array = npt.NDArray[np.float64]
FILES = 50
FLUX = 100.0


def grid(
    name: str, *, at: tuple[float, float, float], size: tuple[float, float], cells: tuple[int, int] = (1, 1)
) -> Any:
    """An illuminance meter that looks down."""
    return {"name": name, "kind": "illuminance", "width": size[0], "height": size[1], "columns": cells[0],
            "rows": cells[1], "at": at, "toward": [0, 0, -1]}  # fmt: skip


def two_kinds(n: int, seed: int) -> et.RaySet:
    """Parallel rays upwards: of 50 rays one, of flux 50, is on the left, the others, of flux 1, are on the right."""
    rng = np.random.default_rng(5000 + seed)
    heavy = rng.random(n) < 0.02
    x = np.where(heavy, -1.0, 1.0) * rng.uniform(0, 5, n)
    position = np.stack([x, rng.uniform(-5, 5, n), np.zeros(n)], axis=1)
    return et.RaySet(position, np.tile([0, 0, 1.0], (n, 1)), np.where(heavy, 50.0, 1.0))


def six_decades(n: int, seed: int) -> et.RaySet:
    """Parallel rays upwards whose fluxes are spread over six decades; one of ten passes far from the axis."""
    rng = np.random.default_rng(1000 + seed)
    position = np.stack([rng.uniform(-5, 5, n), rng.uniform(-5, 5, n), np.zeros(n)], axis=1)
    position[rng.random(n) < 0.1, 0] = 20.0
    return et.RaySet(position, np.tile([0, 0, 1.0], (n, 1)), 10 ** rng.uniform(-6, 0, n))


def source(rays: et.RaySet) -> dict[str, Any]:
    return {"name": "led", "kind": "rays", "rays": rays, "flux": FLUX}


@pytest.mark.slow
@pytest.mark.parametrize(("n", "rays"), [(3000, 3000), (3000, 8000), (20_000, 3000)])
def test_light_of_many_faint_rays_has_the_error_of_the_few_bright_ones(n: int, rays: int) -> None:
    """With a stated total, what the few bright rays bring too little goes to the others: the faint side of many files of a
    lamp spreads as stated, all rays traced or some of them. The bright side has no smaller error than it should have.

    By the rays' fluxes alone, without the total, the faint side would have an error of a twentieth of that.
    """
    share = 0.02 * 50 / (0.02 * 50 + 0.98)
    detectors = [grid("bright", at=(-2.5, 0, 5), size=(5, 10)), grid("faint", at=(2.5, 0, 5), size=(5, 10))]
    found: dict[str, list[tuple[float, float]]] = {"bright": [], "faint": []}
    for seed in range(FILES):
        scene = et.Scene(sources=[source(two_kinds(n, seed))], detectors=detectors)
        for name, seen in et.trace(scene, rays, seed).illuminance.items():
            found[name].append((float(seen.values[0, 0]), float(seen.standard_error[0, 0])))
    area = 50e-6
    values, errors = np.array(found["faint"]).T
    assert_agree(values=values, expected=FLUX * (1 - share) / area, standard_error=errors)
    values, errors = np.array(found["bright"]).T
    assert chi2.sf((((values - FLUX * share / area) / errors) ** 2).sum(), FILES) > SIGNIFICANCE


def test_a_detector_that_all_light_meets_has_no_error() -> None:
    """However unequal the rays are and however many there are, all of a stated flux is that flux: no noise, no rounding."""
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "exponent": 9, "flux": FLUX}
    detectors = [
        grid("all", at=(0, 0, 5), size=(99, 99)),
        {"name": "far", "kind": "intensity", "c_planes": 2, "gamma_step": 90},
    ]
    equal = [(lamp, rays) for rays in (2000, 3001, 100_001)]
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
