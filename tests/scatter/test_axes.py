"""Which surfaces have an axis in a scene: those that turning the sample about its normal changes, and no others."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.models import MODELS
from etendue.scene import compile_scene

Array = npt.NDArray[np.float64]


def tabled(*, wide: float, isotropic: bool) -> et.BsdfTable:
    """A Gaussian that is so many times as wide along the axis of the sample, at two incidences."""
    grid = PolarGrid("cosines", np.array([0.0, 0.05, 0.1, 0.2, 0.4, 2.0]), np.arange(0.0, 360.0, 10.0))
    slices = []
    for theta in (0.0, 40.0):
        for phi in (0.0,) if theta == 0.0 or isotropic else np.arange(0.0, 360.0, 45.0):
            incident = direction(theta, phi)
            to = grid.directions(incident, transmitted=False)
            off = (incident[:2] + to[..., :2]) / [0.1 * wide, 0.1]
            slices.append(BsdfSlice(incident, np.exp(-0.5 * np.sum(off * off, axis=-1)), grid=grid))
    return et.BsdfTable(BsdfData(slices, isotropic=isotropic, mirrored=False))


SURFACES: dict[str, et.Bsdf] = {
    "lambertian": et.bsdf.Lambertian(reflectance=0.5),
    "round": et.bsdf.Gaussian(peak=1.0, sigma=0.2),
    "wide": et.bsdf.Gaussian(peak=1.0, sigma=0.2, aspect=3.0),
    "metal": et.bsdf.RoughMetal(roughness=0.3, index=0.96, extinction=6.69),
    "brushed": et.bsdf.RoughMetal(roughness=0.1, roughness_across=0.5, index=0.96, extinction=6.69),
    "coat": et.bsdf.RoughCoat(roughness=0.3, index=1.5, base_reflectance=0.8),
    "brushed-coat": et.bsdf.RoughCoat(roughness=0.1, roughness_across=0.4, index=1.5, base_reflectance=0.8),
    "abg": et.bsdf.ABg(a=0.01, b=0.1, g=2),
    "wide-abg": et.bsdf.ABg(a=0.01, b=0.1, g=2, aspect=2.0),
    "wide-harvey-shack": et.bsdf.HarveyShack(b0=0.8, l=0.1, s=-2.5, aspect=2.0),
    "mixture": et.bsdf.Mixture(
        parts=[{"kind": "lambertian", "reflectance": 0.3}, {"kind": "abg", "a": 0.01, "b": 0.1, "g": 2}]
    ),
    "wide-mixture": et.bsdf.Mixture(
        parts=[
            {"kind": "lambertian", "reflectance": 0.3},
            {"kind": "gaussian", "peak": 1.0, "sigma": 0.2, "aspect": 0.4},
        ]
    ),
    "round-table": tabled(wide=1.0, isotropic=True),
    "wide-table": tabled(wide=3.0, isotropic=False),
}

CHANGED_MODELS = ("wide", "brushed", "brushed-coat", "wide-abg", "wide-harvey-shack")


def test_every_model_that_turning_may_change_is_among_them() -> None:
    """But for rough glass, which is the boundary of a solid; its record is that of the other rough surfaces."""
    turning = {kind for kind, model in MODELS.items() if {"aspect", "roughness_across"} & set(model.model_fields)}
    assert turning - {"rough-interface"} == {getattr(SURFACES[name], "kind", None) for name in CHANGED_MODELS}


def turned(directions: Array, by: float) -> Array:
    """About the normal, by an angle [rad]."""
    c, s = math.cos(by), math.sin(by)
    return directions @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.slow
@pytest.mark.parametrize("name", SURFACES)
def test_surfaces_have_an_axis_where_it_changes_anything(name: str) -> None:
    bsdf = SURFACES[name]
    incident = direction(np.full(24, 35.0), np.full(24, 20.0))
    scattered = direction(np.repeat([20.0, 33.0, 48.0], 8), np.tile(np.arange(0.0, 360.0, 45.0), 3) + 3.0)
    f = bsdf.evaluate(incident, scattered)
    after = bsdf.evaluate(turned(incident, 0.9), turned(scattered, 0.9))
    changes = bool(np.abs(after - f).max() > 1e-6 * f.max())
    wall: dict[str, Any] = {
        "shape": {"kind": "disk", "radius": 1},
        "finish": {"kind": "bsdf", "bsdf": bsdf, "axis": [0.3, 1, 0.2]},
    }
    (face,) = compile_scene(et.Scene(surfaces=[wall], sources=[{"kind": "point", "flux": 1}])).record["faces"]
    assert face["axis"] == ([0.3, 1.0, 0.2] if changes else None)
    assert changes == name.startswith(("wide", "brushed"))
