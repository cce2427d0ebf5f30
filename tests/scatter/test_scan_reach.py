"""Light beyond the directions that were measured: by the area of what is left out, in direction cosines."""

from __future__ import annotations

import re

import etendue as et
import numpy as np
import pytest
from etendue.quantities.bsdf_directions import direction
from etendue.scatter.scans.interpolations import METHODS, tabulated
from etendue.scatter.scans.notices import outside
from etendue.scatter.scans.scans import Scans


def matt(*, reach: float, azimuths: int = 24, incidence: float = 0.0) -> Scans:
    """f = 0.5/π up to an angle from the normal [°], in steps of a ninth of it and at even azimuths."""
    angles = np.linspace(0.0, reach, 10)
    to = np.concatenate([direction(angles, a) for a in np.arange(azimuths) * 360.0 / azimuths])
    return Scans(np.tile(direction(max(incidence, 1e-6), 180.0), (len(to), 1)), to, np.full(len(to), 0.5 / np.pi))


def told(scans: Scans, method: str) -> list[tuple[float, float]]:
    """All of the light, and that beyond the measured directions, of each complaint about it."""
    found = [str(one) for one in tabulated(scans, method).complaints if "beyond the measured" in one.found]
    assert all(text.startswith("warning: reflected light, ") for text in found)
    return [tuple(map(float, re.findall(r"of the ([\d.]+) of .*, ([\d.]+) lies beyond", text)[0])) for text in found]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["natural-neighbours", "smooth"])
def test_light_beyond_the_measured_directions_is_told(method: str) -> None:
    """Measured up to 45°: 1 − sin² 45° = half of the light of a matt surface is not; counted on 20,000 even points."""
    ((share, beyond),) = told(matt(reach=45.0), method)
    assert share == pytest.approx(0.5, rel=0.01)
    # The measured directions of natural neighbours are the corners of a polygon of 24.
    part = 24.0 / (2.0 * np.pi) * np.sin(2.0 * np.pi / 24.0) if method == "natural-neighbours" else 1.0
    assert beyond == pytest.approx(share * (1.0 - 0.5 * part), rel=2e-3)


@pytest.mark.slow
def test_methods_that_go_on_are_told_and_no_others() -> None:
    """Linear ones have no light at the horizon, or outside the triangles: what they hold was measured."""
    going_on = {name for name in METHODS if told(matt(reach=45.0, azimuths=8), name)}
    assert going_on == {"natural-neighbours", "radial-basis", "shepard", "smooth"}


@pytest.mark.slow
def test_of_scans_to_the_horizon_nothing_is_told() -> None:
    assert not told(matt(reach=87.5), "natural-neighbours")
    assert not told(matt(reach=87.5, azimuths=4, incidence=30.0), "smooth")


@pytest.mark.slow
def test_scans_on_a_line_have_nothing_between() -> None:
    """All but the plane is beyond them, and a plane holds no light."""
    ((share, beyond),) = told(matt(reach=87.5, azimuths=2), "natural-neighbours")
    assert beyond == pytest.approx(share, rel=2e-3)


def test_the_polygon_around_points_is_that_of_a_disk() -> None:
    """Points on a circle: a point at half its radius is inside, one at twice outside, one on a chord's far side, too."""
    angle = np.arange(6) * np.pi / 3.0 + 0.3
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    middle = np.cos(np.pi / 6.0) * np.column_stack([np.cos(angle + np.pi / 6.0), np.sin(angle + np.pi / 6.0)])
    rng = np.random.default_rng(5)
    inside = 0.5 * rng.uniform(-1.0, 1.0, (50, 2))
    points = np.concatenate([inside, circle, inside])
    assert not outside(points, np.concatenate([inside, circle, 0.999 * middle])).any()
    assert outside(points, np.concatenate([1.001 * middle, 2.0 * circle])).all()


def test_a_bsdf_of_scans_tells_it() -> None:
    bsdf = et.Bsdf.from_scans(matt(reach=45.0))
    assert any("beyond the measured directions" in one.found for one in bsdf.complaints)
