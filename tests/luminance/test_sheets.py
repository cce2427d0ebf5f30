"""Lamps behind filters and other sheets that light passes straight: connections go through them."""

from __future__ import annotations

from typing import Any

import etendue as et
import numpy as np
import pytest
from oracles.verdicts import LARGEST_Z, REVERSE, assert_agree

FLOOR = {
    "shape": {"kind": "rectangle", "width": 120, "height": 90},
    "finish": {"kind": "lambertian", "reflectance": 0.6},
}
ANGLE = {"angle": [0, 90], "values": [0.9, 0.1]}
BLUE = {"wavelength": [400, 500, 600, 700], "values": [0.9, 0.8, 0.1, 0.05]}


def lamp(**more: Any) -> dict[str, Any]:
    """5 × 3 mm, 34 mm above the floor, which leans."""
    shape = {"kind": "rectangle", "width": 5, "height": 3}
    return {"kind": "surface", "shape": shape, "flux": 100, "at": [3, 2, 34], "toward": [0.1, 0, -1], **more}


def sheet(finish: dict[str, Any] | str, width: float = 200.0, tilt: float = 0.0) -> dict[str, Any]:
    """24 mm above the floor."""
    shape = {"kind": "rectangle", "width": width, "height": 1.3 * width}
    return {"shape": shape, "at": [4, -3, 24], "toward": [tilt, tilt, 1], "finish": finish}


@pytest.mark.slow
@pytest.mark.parametrize("finish", ["transparent", {"kind": "transmitter", "transmittance": 0.4}])
def test_a_sheet_takes_its_share_and_nothing_else(finish: dict[str, Any] | str) -> None:
    """Of the light on the floor a sheet passes T, and seen through it too T²: in each pixel, with errors as without it."""
    share = 1.0 if finish == "transparent" else 0.4
    for eye, times in ((et.Observer(38, 60, 300), 2), (et.Observer(85, 30, 100, target=(0, 0, 2)), 1)):
        plain, behind = (
            et.luminance_map(et.Scene(sources=[lamp()], surfaces=some), eye, et.Screen(4, 4, 3, 3), rays_per_pixel=64)
            for some in ([FLOOR], [FLOOR, sheet(finish)])
        )
        assert (plain.values > 0.0).sum() >= 8
        # Lines of sight, and connections, are the same.
        np.testing.assert_allclose(behind.values, share**times * plain.values, rtol=1e-9)
        np.testing.assert_allclose(behind.standard_error, share**times * plain.standard_error, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "finish",
    [
        {"kind": "mixed", "specular_transmittance": 0.5, "specular_reflectance": 0.35},
        {"kind": "mixed", "specular_transmittance": 0.4, "diffuse_transmittance": 0.2, "specular_reflectance": 0.1},
        {"kind": "transmitter", "transmittance": ANGLE},
        {"kind": "transmitter", "transmittance": BLUE},
    ],
)
def test_light_through_sheets_forwards_and_backwards_is_the_same(finish: dict[str, Any]) -> None:
    """A floor, a wall and a glass ball below a sheet that mirrors, scatters or colours: all scatters of a trace connected to
    the eye, which sees no smooth surface, and lines of sight. χ² over the pixels, and all of them together."""
    ball = {"shape": {"kind": "ball", "radius": 6}, "at": [10, 6, 12], "medium": "BK7"}
    wall = {"shape": {"kind": "rectangle", "width": 120, "height": 80}, "at": [-40, 0, 40], "toward": [1, 0, 0.1],
            "finish": {"kind": "lambertian", "reflectance": 0.5}}  # fmt: skip
    white = [[420, 0.2], [480, 0.3], [550, 0.2], [620, 0.2], [690, 0.1]]
    screen = {"width": 24, "height": 30, "columns": 6, "rows": 6, "plane": "xy"}
    eye = {"name": "eye", "theta": 70, "phi": 0, "distance": 300, "target": [30, 0, 0], "screen": screen}
    scene = et.Scene(
        sources=[lamp(spectrum=white)], surfaces=[FLOOR, wall, sheet(finish, 26, 0.12)], solids=[ball],
        detectors=[{"kind": "image", "name": "image", "observer": "eye"}], observers=[eye],
    )  # fmt: skip
    forward = et.trace(scene, 3e5, 3).images["image"]
    (reverse,) = et.luminance_map(scene, rays_per_pixel=256, seed=5)
    error = np.hypot(forward.standard_error, reverse.standard_error)
    assert np.median(error / reverse.values) < 0.15
    assert_agree(values=reverse.values, expected=forward.values, standard_error=error, degrees=REVERSE)
    total = float(np.sqrt((error**2).sum()))
    assert total < 0.03 * reverse.values.sum()
    assert abs((forward.values - reverse.values).sum()) < LARGEST_Z * total
