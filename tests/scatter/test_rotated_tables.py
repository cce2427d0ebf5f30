"""Tables of a sample without symmetry whose lobe is fixed to it: along the normal, and where nothing is known there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import GridFrame, PolarGrid
from oracles import rotated_samples as by_hand

Array = npt.NDArray[np.float64]

GRIDS = {
    "normal": PolarGrid("normal", np.arange(0.0, 90.0, 3.0), np.arange(0.0, 360.0, 10.0)),
    "specular": PolarGrid("specular", np.arange(0.0, 171.0, 3.0), np.arange(0.0, 360.0, 10.0)),
    "cosines": PolarGrid("cosines", np.arange(0.0, 1.8, 0.05), np.arange(0.0, 360.0, 10.0)),
}
PHIS = (200.0, 250.0, 320.0)


def sampled(frame: GridFrame, *, theta: float, phi: float) -> BsdfSlice:
    incident, grid = light_from(theta, phi), GRIDS[frame]
    to = grid.directions(incident, transmitted=False)
    there = ~np.isnan(to[..., 0])
    values = np.full(grid.shape, np.nan)
    values[there] = by_hand.f(incident=incident, scattered=to[there])
    return BsdfSlice(incident, values, grid=grid)


def off(table: et.Bsdf, *, theta: float, phi: float, seen: float = 0.0) -> float:
    """The largest difference from f about its lobe, in parts of the peak; directions turned by `seen` [°] are asked for."""
    incident = by_hand.direction(theta=theta, phi=phi)
    distance, azimuth = by_hand.BESIDE[False]
    middle = distance * np.array([math.cos(math.radians(azimuth)), math.sin(math.radians(azimuth))])
    turn = np.arange(0.0, 2.0 * math.pi, math.pi / 4.0)
    ring = 0.15 * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    beta = np.concatenate([middle + ring, ring - middle]) - incident[:2]
    beta = beta[np.hypot(*beta.T) < 0.97]
    to = np.column_stack([beta, np.sqrt(1.0 - np.sum(beta * beta, axis=-1))])
    asked = [by_hand.turned(vectors=vectors, by=seen) for vectors in (incident, to)]
    return float(np.abs(table.evaluate(*asked) - by_hand.f(incident=incident, scattered=to)).max()) / by_hand.PEAK


@pytest.mark.slow
@pytest.mark.parametrize("frame", GRIDS)
def test_light_along_the_normal_among_rotations(frame: GridFrame) -> None:
    """None of them from azimuth 0; that of the slice along the normal counts as written, however its grid does."""
    slices = [sampled(frame, theta=theta, phi=phi) for theta in (0.0, 40.0) for phi in PHIS]
    table = et.BsdfTable(BsdfData(slices[1:], isotropic=False, mirrored=False))
    assert off(table, theta=0.0, phi=0.0) < 0.05
    for phi in PHIS:
        assert off(table, theta=1e-3, phi=phi) < 0.05
        assert off(table, theta=40.0, phi=phi) < 0.05


@pytest.mark.slow
def test_the_lobe_stays_with_the_sample_where_only_the_normal_is_known() -> None:
    """Between rows at every 10° it is turned by up to 5°."""
    table = et.BsdfTable(BsdfData([sampled("specular", theta=0.0, phi=200.0)], isotropic=False, mirrored=False))
    assert off(table, theta=0.0, phi=0.0) < 0.05
    for phi in (0.0, 35.0, 200.0):
        assert off(table, theta=1e-3, phi=phi) < 0.05
        assert off(table, theta=20.0, phi=phi) < 0.05


def test_where_the_normal_is_not_known_the_lobe_of_the_least_incidence_stands_there() -> None:
    slices = [sampled("cosines", theta=theta, phi=phi) for theta in (10.0, 40.0) for phi in PHIS]
    table = et.BsdfTable(BsdfData(slices, isotropic=False, mirrored=False))
    assert off(table, theta=0.0, phi=0.0) < 0.05
    share = np.mean([one.integral() for one in slices[:3]])
    assert float(table.reflectance(0.0)) == pytest.approx(share, rel=1e-3)
    for phi in PHIS:
        assert off(table, theta=1e-3, phi=phi) < 0.05
        assert off(table, theta=10.0, phi=phi) < 0.05


@pytest.mark.parametrize("frame", GRIDS)
@pytest.mark.parametrize("written", [0.0, 200.0])
def test_a_sample_that_was_not_turned(frame: GridFrame, written: float) -> None:
    """Values in the frame of the sample need no azimuth along the normal: it is that of other light."""
    normal = sampled(frame, theta=0.0, phi=200.0)
    if frame == "normal":
        normal = BsdfSlice(light_from(0.0, written), normal.values, grid=normal.grid)
    table = et.BsdfTable(BsdfData([normal, sampled(frame, theta=40.0, phi=200.0)], mirrored=False))
    for theta, seen in ((1e-3, 0.0), (1e-3, 77.0), (40.0, 130.0)):
        assert off(table, theta=theta, phi=200.0, seen=seen) < 0.05


def scanned(phis: Sequence[float]) -> et.Scans:
    """Arms through the specular direction, every 15° of azimuth about it, that lie alike to the plane of incidence."""
    arms = PolarGrid("specular", np.arange(0.0, 130.0, 4.0), np.arange(5.0, 360.0, 15.0))
    incident, scattered = [], []
    for theta in (0.0, 40.0):
        for phi in phis:
            to = arms.directions(light_from(theta, phi), transmitted=False).reshape(-1, 3)
            to = to[to[:, 2] > 0.05]
            scattered.append(to)
            # Written as a goniometer has it: along the normal without an azimuth.
            incident.append(np.tile(by_hand.direction(theta=theta, phi=phi if theta else 0.0), (len(to), 1)))
    i, s = np.concatenate(incident), np.concatenate(scattered)
    return et.Scans(i, s, by_hand.f(incident=i, scattered=s))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["specular-centred", "direction-cosines"])
def test_scans_of_a_rotated_sample(method: str) -> None:
    """At an azimuth that is on no arm's mirror image: an asymmetric sample has none."""
    table = et.Bsdf.from_scans(scanned([200.0]), method)
    for theta, seen in ((1e-3, 0.0), (1e-3, 60.0), (40.0, 60.0)):
        assert off(table, theta=theta, phi=200.0, seen=seen) < 0.1, (theta, seen)
    turned = et.Bsdf.from_scans(scanned([200.0, 250.0]), method)
    for theta, phi in ((0.0, 0.0), (40.0, 200.0), (40.0, 250.0)):
        assert off(turned, theta=theta, phi=phi) < 0.1, (theta, phi)


@pytest.mark.slow
@pytest.mark.parametrize("isotropic", [True, False])
def test_tables_of_directional_scans(isotropic: bool) -> None:
    """Their light comes from azimuth 180°."""
    at = np.arange(-0.96, 0.97, 0.06)
    beta = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    beta = beta[np.hypot(*beta.T) < 0.97]
    to = np.column_stack([beta, np.sqrt(1.0 - np.sum(beta * beta, axis=-1))])
    scans = []
    for theta in (0.0, 40.0):
        f = by_hand.f(incident=by_hand.direction(theta=theta, phi=180.0), scattered=to)
        scans.append(et.DirectionalScan(to, 1e-4 * f * to[:, 2], solid_angle=1e-4, incidence=theta))
    table = et.bsdf_table(scans, isotropic=isotropic)
    if not isotropic:
        assert off(table, theta=0.0, phi=0.0) < 0.1
    for theta, seen in ((1e-3, 0.0), (40.0, 0.0), *(((1e-3, 90.0), (40.0, 90.0)) if isotropic else ())):
        assert off(table, theta=theta, phi=180.0, seen=seen) < 0.1, (theta, seen)
