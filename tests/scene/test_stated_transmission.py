"""Finishes that scatter light through a solid's face by a stated share, which a real face would refract."""

from __future__ import annotations

from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scene import compile_scene

GAUSSIAN = {"kind": "gaussian", "peak": 0.5, "sigma": 0.2}
SCATTERING: dict[str, dict[str, Any]] = {
    "opal": {"kind": "lambertian", "reflectance": 0.3, "transmittance": 0.6},
    "mixed": {
        "kind": "mixed",
        "specular_transmittance": 0.2,
        "diffuse_transmittance": {"angle": [0, 90], "values": [0, 0.1]},
    },
    "lobe": {**GAUSSIAN, "way": "transmitted"},
    "mixture": {
        "kind": "mixture",
        "parts": [{"kind": "mirror", "reflectance": 0.1}, {**GAUSSIAN, "way": "transmitted"}],
    },
}
OTHERS: dict[str, dict[str, Any]] = {
    "interface": {"kind": "interface"},
    "rough": {"kind": "rough-interface", "roughness": 0.3},
    "transmitter": {"kind": "transmitter", "transmittance": 0.9},
    "white": {"kind": "lambertian", "reflectance": 0.9},
    "reflected": GAUSSIAN,
}


def told(finish: dict[str, Any], index: float, **more: Any) -> list[str]:
    """What the scene of a solid with this finish says of it."""
    body = {"name": "slab", "shape": {"kind": "block", "width": 9, "height": 9, "depth": 2}, "medium": {"index": index}}
    return list(compile_scene(et.Scene(finishes={"skin": finish}, solids=[{**body, "finish": "skin"}], **more)).notes)


@pytest.mark.parametrize("name", SCATTERING)
def test_a_finish_that_scatters_light_into_another_medium_is_told(name: str) -> None:
    (line,) = told(SCATTERING[name], 1.5)
    assert line.startswith('slab: its finish "skin" scatters light through a face')
    assert "a factor of up to 2.25;" in line
    (water,) = told(SCATTERING[name], 1.5, surroundings={"index": 4 / 3})
    assert f"a factor of up to {1.5**2 / (4 / 3) ** 2:.3g};" in water
    assert not told(SCATTERING[name], 1.0)
    assert not told(SCATTERING[name], 1.5, surroundings={"index": 1.5})


@pytest.mark.parametrize("name", OTHERS)
def test_a_finish_that_refracts_or_lets_nothing_through_is_not(name: str) -> None:
    assert not told(OTHERS[name], 1.5)


@pytest.mark.parametrize("transmitted", [False, True])
def test_a_measured_sample_is_told_if_it_transmits(*, transmitted: bool) -> None:
    grid = PolarGrid("cosines", np.array([0.0, 0.1, 0.4, 2.0]), np.arange(0.0, 360.0, 30.0))
    incident = direction(0.0, 0.0)
    to = grid.directions(incident, transmitted=transmitted)
    f = np.exp(-np.sum(to[..., :2] ** 2, axis=-1))
    data = BsdfData([BsdfSlice(incident, 0.2 * f, grid=grid, transmitted=transmitted)], isotropic=True)
    assert len(told({"kind": "bsdf", "bsdf": et.BsdfTable(data)}, 1.5)) == transmitted
