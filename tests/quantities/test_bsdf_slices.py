"""Shares of the flux that slices of a BSDF scatter, by another route."""

from __future__ import annotations

import numpy as np
import pytest
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import GridFrame, PolarGrid


@pytest.mark.parametrize("frame", ["normal", "specular", "cosines"])
@pytest.mark.parametrize("transmitted", [False, True])
@pytest.mark.parametrize("behind", [False, True])
def test_the_integral_of_a_lopsided_slice(frame: GridFrame, transmitted: bool, behind: bool) -> None:
    """Against the mean of f over the hemisphere, direction by direction: evenly in sin²θ and φ, times π.

    Values differ from azimuth to azimuth by up to ten times, so that a turned, mirrored or swapped axis is seen.
    """
    radial = {"normal": np.linspace(0, 90, 7), "specular": np.linspace(0, 150, 9), "cosines": np.linspace(0, 1.9, 8)}[
        frame
    ]
    grid = PolarGrid(frame, radial, np.array([0.0, 40.0, 110.0, 200.0, 290.0]))
    values = np.random.default_rng(3).uniform(0.1, 1.0, grid.shape) * np.array([[1.0], [3.0], [2.0], [0.3], [0.5]])
    square, phi = (np.arange(160) + 0.5) / 160, (np.arange(180) + 0.5) / 180 * 360.0
    theta = np.degrees(np.arcsin(np.sqrt(square)))
    for incidence in (0.0, 35.0, 70.0):
        one = BsdfSlice(light_from(incidence, 25.0, behind=behind), values, grid=grid, transmitted=transmitted)
        to = direction(theta[:, None], phi[None, :], behind=behind != transmitted)
        assert one.integral() == pytest.approx(np.pi * float(one.at(to).mean()), rel=5e-4)
