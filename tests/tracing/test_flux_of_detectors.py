"""The flux of all light that a detector meets, and its error."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import pytest

FLUX = 40.0
RAYS = 20_000

BEAM = {"name": "beam", "kind": "beam", "shape": {"kind": "disk", "radius": 2}, "flux": FLUX, "at": [0.3, 0.2, 0]}
MIRROR = {"name": "mirror", "shape": {"kind": "rectangle", "width": 4, "height": 8}, "at": [2, 0, 9],
          "finish": {"kind": "mirror"}}  # fmt: skip


def half(name: str, kind: str, *, x: float, z: float, **keys: Any) -> dict[str, Any]:
    """A detector from x − 2 to x + 2."""
    return {"name": name, "kind": kind, "at": [x, 0, z], **keys}


def test_rays_that_cross_a_surface_twice_count_as_one() -> None:
    """Of a beam upwards, a mirror over x > 0 sends a share p back. Through a plane below it goes F (1 + p), of which the
    share alone is by chance, through the half plane under the mirror 2 F p: errors are F √(p (1 − p)/n) and twice that.

    With crossings taken for independent they would be F √((1 + p)/n) and √2 too small. An illuminance meter that looks down
    sees what goes up only, one over the lamp's both halves all of it: no error is left there.
    """
    rectangle = {"kind": "rectangle", "width": 4, "height": 8}
    scene = et.Scene(
        sources=[BEAM],
        surfaces=[MIRROR],
        detectors=[
            half("plane", "rays", x=0, z=3, shape=rectangle | {"width": 8}),
            half("under", "rays", x=2, z=5, shape=rectangle),
            half("up", "illuminance", x=2, z=6, width=4, height=8, columns=3, rows=2, toward=[0, 0, -1]),
            half("down", "illuminance", x=2, z=7, width=4, height=8, columns=1, rows=1),
            half("all", "illuminance", x=0, z=2, width=8, height=8, columns=5, rows=3, toward=[0, 0, -1]),
        ],
    )
    result = et.trace(scene, RAYS, 3)
    under = result.rays["under"]
    share = under.total_flux / 2 / FLUX
    assert 0.55 < share < 0.65  # the lamp is off the edge of the mirror
    error = FLUX * math.sqrt(share * (1 - share) / RAYS)
    expected = {
        "plane": (FLUX * (1 + share), error),
        "under": (2 * FLUX * share, 2 * error),
        "up": (FLUX * share, error),
        "down": (FLUX * share, error),
        "all": (FLUX, 0.0),
    }
    for name, (flux, stated) in expected.items():
        found = result.flux_of(name)
        assert found[0] == pytest.approx(flux, rel=1e-10)
        assert found[1] == pytest.approx(stated, rel=1e-3, abs=1e-6)
    assert result.flux_of("plane")[0] == pytest.approx(result.rays["plane"].total_flux, rel=1e-12)
    up = result.illuminance["up"]
    area = 4 * 8 / 1e6
    assert (up.flux_error, up.mean_error) == (result.flux_of("up")[1], pytest.approx(error / area, rel=1e-3))
    assert up.mean == pytest.approx(FLUX * share / area, rel=1e-10)


def test_the_flux_of_a_far_field_is_that_of_its_table() -> None:
    far = {"name": "far", "kind": "intensity", "c_planes": 6, "gamma_step": 15}
    result = et.trace(et.Scene(sources=[BEAM], surfaces=[MIRROR | {"finish": "absorber"}], detectors=[far]), RAYS, 4)
    found = result.intensity["far"]
    assert result.flux_of("far") == (pytest.approx(found.flux, rel=1e-10), found.flux_error)


def test_only_light_on_cells_is_waited_for() -> None:
    """How well all light is known together stops no trace: not that of a surface, nor that of a grid."""
    keeper = half("kept", "rays", x=0, z=1, shape={"kind": "rectangle", "width": 8, "height": 8})
    grid = half("grid", "illuminance", x=2, z=6, width=4, height=8, columns=4, rows=4, toward=[0, 0, -1])
    result = et.trace(et.Scene(sources=[BEAM], detectors=[keeper, grid]), RAYS)
    desk = result.illuminance["grid"]
    lit = desk.values > 0
    known, weight = (desk.standard_error / np.where(lit, desk.values, 1))[lit], desk.values[lit]
    order = np.argsort(known)
    median = known[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)]
    assert result.relative_error == pytest.approx(median)
    assert result.relative_error > 3 * desk.mean_error / desk.mean
    with pytest.raises(et.ArgumentError, match="no detector with cells"):
        et.trace(et.Scene(sources=[BEAM], detectors=[keeper]), RAYS, until=0.01)


def test_what_sums_no_flux_is_refused() -> None:
    result = et.trace(et.Scene(sources=[BEAM], detectors=[{"name": "scatter", "kind": "scatter"}]), 1000)
    with pytest.raises(et.ArgumentError, match=r"flux:scatter: name a detector of rays, illuminance or intensity\."):
        result.flux_of("scatter")
    with pytest.raises(et.UnknownNameError, match=r"'scater'\. Did you mean 'scatter'"):
        result.flux_of("scater")


@pytest.mark.parametrize(
    ("n", "rays", "lamp"), [(3000, 3000, 0.0), (3000, 8000, 0.0), (9000, 3000, 0.0), (3000, 6000, 9.0)]
)
def test_all_light_has_the_error_of_one_cell(n: int, rays: int, lamp: float) -> None:
    """In a white sphere, of rays of unequal flux: all of a set, each several times, a part of it, all of it beside a lamp.

    The one cell of a detector knows its error as every cell does; all light on a grid in its place, or through a surface
    there that sees light from below only, has the same.
    """
    rng = np.random.default_rng(3)
    position, direction = rng.uniform(-1, 1, (n, 3)), rng.normal(size=(n, 3))
    led = et.RaySet(position, direction, 10 ** rng.uniform(-3, 0, n))
    place = {"width": 6, "height": 6, "at": [0, 0, 5], "toward": [0, 0, -1]}
    black = {"shape": {"kind": "rectangle", "width": 12, "height": 12}, "at": [0, 0, 5.001], "finish": "absorber"}
    ball = {"shape": {"kind": "sphere", "radius": 10}, "finish": {"kind": "lambertian", "reflectance": 0.9}}
    beside = [{"kind": "point", "flux": lamp, "at": [0, 2, -3]}] if lamp else []
    scene = et.Scene(
        sources=[{"kind": "rays", "rays": led, "flux": FLUX}, *beside],
        surfaces=[ball, black],
        detectors=[
            {"name": "one", "kind": "illuminance", "columns": 1, "rows": 1, **place},
            {"name": "grid", "kind": "illuminance", "columns": 5, "rows": 4, **place},
            {"name": "kept", "kind": "rays", "shape": {"kind": "rectangle", "width": 6, "height": 6}, "at": [0, 0, 5]},
        ],
    )
    result = et.trace(scene, rays, 7)
    one = result.illuminance["one"]
    area = 6 * 6 / 1e6
    expected = one.values[0, 0] * area, one.standard_error[0, 0] * area
    assert expected[1] > 0.005 * expected[0] > 0.0
    for name in ("one", "grid", "kept"):
        assert result.flux_of(name) == pytest.approx(expected, rel=1e-9)
    # Taken for independent, the cells would be surer of all light, or less sure, than they are.
    cells = result.illuminance["grid"].standard_error
    assert math.sqrt(np.nansum(cells**2)) * area / cells.size != pytest.approx(expected[1], rel=0.01)
