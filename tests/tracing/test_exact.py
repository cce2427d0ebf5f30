"""Traces of scenes whose answer is known in closed form. Every verdict is at a significance of 1e-4, with fixed seeds."""

from __future__ import annotations

import math
import re
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.scene.detectors.illuminance import lowered_by_chance
from etendue.tracing.result import TraceResult
from numpy.polynomial.legendre import leggauss
from oracles.intensity import hat_means
from oracles.verdicts import LARGEST_Z, SIGNIFICANCE, assert_agree, assert_drawn_with
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

Array = npt.NDArray[np.float64]
NODES, WEIGHTS = leggauss(8)


def traced(rays: float, seed: int = 1, **scene: Any) -> TraceResult:
    result = et.trace(et.Scene(**scene), rays, seed)
    assert result.ledger.closes
    assert result.ledger.lost_share == 0.0
    return result


# --- free space ------------------------------------------------------------------------------------------------------


def test_chance_lowers_the_least_of_equal_cells_as_is_told() -> None:
    """100 cells of the same light, 10⁴ rays each: what is taken off again leaves least/mean 1 on average.

    The standard error of the average over 400 draws is that of their spread.
    """
    counts = np.random.default_rng(5).poisson(1e4, (400, 100)).astype(np.float64)
    uniformity = counts.min(axis=1) / counts.mean(axis=1)
    found = uniformity / [1.0 - lowered_by_chance(row, np.sqrt(row)) for row in counts]
    assert abs(found.mean() - 1.0) < LARGEST_Z * found.std(ddof=1) / 20.0
    assert uniformity.mean() < 0.98


def test_noise_of_the_darkest_cell_is_told() -> None:
    """A beam makes the same light in all cells; of 100 and of 0.5 rays in each, there is something to be said."""
    beam = {"kind": "beam", "shape": {"kind": "rectangle", "width": 10, "height": 10}, "flux": 1, "at": [0, 0, -5]}
    grid = {"name": "grid", "kind": "illuminance", "width": 10, "height": 10, "columns": 10, "rows": 10}
    below = {**grid, "name": "below", "columns": 1, "rows": 1, "toward": [0, 0, -1]}
    (told,) = traced(10_000, sources=[beam], detectors=[{**grid, "toward": [0, 0, -1]}]).illuminance["grid"].notes
    assert re.match(r"the darkest of 100 cells is known to \d+ %; chance may have lowered it, .* by up to \d+ %", told)
    (told,) = traced(50, sources=[beam], detectors=[{**grid, "toward": [0, 0, -1]}]).illuminance["grid"].notes
    assert re.match(r"no ray met \d\d of 100 cells", told)
    assert not traced(1000, sources=[beam], detectors=[below]).illuminance["below"].notes
    (told,) = traced(1000, sources=[beam], detectors=[grid]).illuminance["grid"].notes
    assert told.startswith("no ray met it on the side of its +z")


@pytest.mark.parametrize("exponent", [1.0, 3.5])
def test_illuminance_falls_with_the_square_of_the_distance(exponent: float) -> None:
    """E = I₀ cosⁿα cos β/d², I₀ = Φ (n + 1)/2π: a source and a grid that are both oblique and off every axis."""
    flux, at, toward = 500.0, np.array([10.0, -20.0, 5.0]), np.array([0.3, -0.2, 0.93])
    toward /= np.linalg.norm(toward)
    spot = {"kind": "surface", "shape": {"kind": "disk", "radius": 1e-3}, "exponent": exponent, "flux": flux, "at": at,
            "toward": toward}  # fmt: skip
    grid = {"name": "wall", "kind": "illuminance", "width": 300, "height": 200, "columns": 6, "rows": 5,
            "at": [150, -90, 260], "toward": [-0.4, 0.1, -0.9], "spin": 33}  # fmt: skip
    seen = traced(6e5, 3, sources=[spot], detectors=[grid]).illuminance["wall"]
    half = np.array([300 / 6, 200 / 5]) / 2
    expected = np.zeros(seen.screen.shape)
    for u, wu in zip(NODES, WEIGHTS, strict=True):
        for v, wv in zip(NODES, WEIGHTS, strict=True):
            aside = u * half[0] * np.array(seen.right) + v * half[1] * np.array(seen.up)
            away = seen.points + aside - at
            distance = np.linalg.norm(away, axis=-1)
            alpha, beta = away @ toward / distance, -(away @ np.array(seen.normal)) / distance
            assert (alpha > 0).all()
            assert (beta > 0).all()
            expected += wu * wv / 4 * flux * (exponent + 1) / (2 * np.pi) * alpha**exponent * beta / distance**2
    assert_agree(values=seen.values, standard_error=seen.standard_error, expected=expected * 1e6)
    # No turn, no mirror image: the picture is lopsided enough to tell.
    for other in (expected[::-1], expected[:, ::-1], expected[::-1, ::-1]):
        z = (seen.values - other * 1e6) / seen.standard_error
        assert chi2.sf((z**2).sum(), z.size) < SIGNIFICANCE


def test_light_from_behind_is_not_counted() -> None:
    lamp = {"kind": "point", "flux": 1}
    size = {"kind": "illuminance", "width": 9, "height": 9, "columns": 2, "rows": 2, "at": [0, 0, 3]}
    detectors = [{"name": "up", **size}, {"name": "down", **size, "toward": [0, 0, -1]}]
    seen = traced(1e5, sources=[lamp], detectors=detectors).illuminance
    assert (seen["up"].values == 0).all()
    assert np.isnan(seen["up"].standard_error).all()
    assert (seen["down"].values > 0).all()


def test_light_that_starts_on_a_detector_is_not_counted_wherever_it_stands() -> None:
    """All of it is a micrometre above, whatever the rounding of a turned plane: of rays in a plane, and of a lamp there."""
    n, rng = 5000, np.random.default_rng(3)
    foot = np.pad(rng.uniform(-9, 9, (n, 2)), ((0, 0), (0, 1)))
    up = rng.normal(size=(n, 3))
    up[:, 2] = np.abs(up[:, 2])
    plane = {"kind": "rays", "shape": {"kind": "rectangle", "width": 20, "height": 20}}
    sheet = {"kind": "surface", "shape": {"kind": "rectangle", "width": 18, "height": 18}, "flux": 1.0}
    for rotation, at in (([0, 0, 0], [0, 0, 1 / 3]), ([30, 40, 50], [3, 4, 5]), ([11, -73, 5], [100, 2000, 3.3])):
        turn = Rotation.from_euler("xyz", rotation, degrees=True).as_matrix()
        above = (turn @ [0, 0, 1e-3] + at).tolist()
        rays = et.RaySet(foot @ turn.T + at, up @ turn.T, np.full(n, 1 / n))
        places = {"on": at, "above": above}
        detectors = [{**plane, "name": name, "at": place, "rotation": rotation} for name, place in places.items()]
        for light in ({"kind": "rays", "rays": rays}, {**sheet, "at": at, "rotation": rotation}):
            seen = traced(n, sources=[light], detectors=detectors).rays
            assert (len(seen["on"]), seen["above"].total_flux) == (0, pytest.approx(1.0, abs=3 / n))


@pytest.mark.slow
@pytest.mark.parametrize("exponent", [1.0, 4.0])
def test_far_field_of_a_cosine_emitter(exponent: float) -> None:
    """V2: I = I₀ cosⁿγ about an axis that is tilted against the table; the mean around each node by quadrature."""
    flux, axis = 100.0, np.array([math.sin(0.5) * math.cos(0.7), math.sin(0.5) * math.sin(0.7), math.cos(0.5)])
    source = {"kind": "surface", "shape": {"kind": "rectangle", "width": 3, "height": 1}, "exponent": exponent,
              "flux": flux, "toward": axis, "at": [4, 5, 6]}  # fmt: skip
    far = traced(
        5e5, 5, sources=[source], detectors=[{"name": "far", "kind": "intensity", "c_planes": 8, "gamma_step": 15}]
    ).intensity.only

    def intensity(c: Array, gamma: Array) -> Array:
        c, gamma = np.radians(c), np.radians(gamma)
        cosine = np.sin(gamma) * np.cos(c) * axis[0] + np.sin(gamma) * np.sin(c) * axis[1] + np.cos(gamma) * axis[2]
        return flux * (exponent + 1) / (2 * np.pi) * np.maximum(cosine, 0.0) ** exponent

    expected = hat_means(intensity, c=far.c, gamma=far.gamma)[0]
    assert far.flux == pytest.approx(flux, rel=1e-12)
    # Nodes whose hats have no ray in common.
    expected, far_values, far_errors = (a[::2, 1:-1:2] for a in (expected, far.values, far.standard_error))
    inner, error = far_values, far_errors
    lit = inner > 0
    assert (expected[~lit] < 1e-3 * expected.max()).all()
    # Quadrature is off by 1e-3 in nodes that the terminator crosses: they have fewer rays than that could show.
    assert_agree(values=inner[lit], standard_error=error[lit], expected=expected[lit])


def test_flux_from_disc_to_disc() -> None:
    """V8: F = ½ (Z − √(Z² − 4 (r₂/r₁)²)), Z = 1 + (1 + R₂²)/R₁², R = r/d."""
    r1, r2, d = 2.0, 3.0, 2.5
    R1, R2 = r1 / d, r2 / d
    Z = 1 + (1 + R2**2) / R1**2
    share = 0.5 * (Z - math.sqrt(Z**2 - 4 * (r2 / r1) ** 2))
    axis = np.array([0.48, -0.6, 0.64])
    source = {"kind": "surface", "shape": {"kind": "disk", "radius": r1}, "flux": 7, "at": [1, 2, 3], "toward": axis}
    target = {"name": "target", "shape": {"kind": "disk", "radius": r2}, "at": np.array([1, 2, 3]) + d * axis,
              "toward": axis, "finish": "absorber"}  # fmt: skip
    ledger = traced(1e6, 2, sources=[source], surfaces=[target]).ledger
    assert_drawn_with(share=share, hits=ledger.by_surface["target"].rays, rays=10**6)
    assert ledger.by_surface["target"].flux == pytest.approx(7 * ledger.by_surface["target"].rays / 10**6, rel=1e-12)


# --- surfaces --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("reflectance", "top"), [(0.9, 6.0), (0.5, 0.0)])
def test_integrating_sphere(reflectance: float, top: float) -> None:
    """V6: E_r = ρ Φ₀/(A (1 − ρ (1 − f))) is uniform, whatever the source: a thin beam that hits one spot here."""
    radius, flux = 10.0, 50.0
    port = (radius - top) / (2 * radius)
    beam = {"kind": "beam", "shape": {"kind": "disk", "radius": 0.1}, "flux": flux, "at": [1, 2, 0],
            "toward": [0.5, 0.3, -0.8]}  # fmt: skip
    wall = {"name": "wall", "shape": {"kind": "sphere", "radius": radius}, "trim": {"z": [-11, top]},
            "finish": {"kind": "lambertian", "reflectance": reflectance}}  # fmt: skip
    ledger = traced(4e5, 4, sources=[beam], surfaces=[wall]).ledger
    share = reflectance * port / (1 - reflectance * (1 - port))
    assert_drawn_with(share=share, hits=ledger.escaped.rays, rays=400_000)


def fresnel(cosine: float, n: float) -> float:
    """Reflectance of unpolarised light from 1 into n."""
    across = math.sqrt(1 - (1 - cosine**2) / n**2)
    s, p = (cosine - n * across) / (cosine + n * across), (across - n * cosine) / (across + n * cosine)
    return (s * s + p * p) / 2


@pytest.mark.slow
@pytest.mark.parametrize("angle", [0.0, 40.0, 75.0])
def test_slab_that_absorbs(angle: float) -> None:
    """All reflections in a slab of transmittance τ: T = (1−R)² τ/(1−R²τ²), R' = R + (1−R)² R τ²/(1−R²τ²)."""
    n, thickness, absorption = 1.6, 3.0, 0.15
    cosine = math.cos(math.radians(angle))
    R = fresnel(cosine, n)
    tau = math.exp(-absorption * thickness / math.sqrt(1 - (1 - cosine**2) / n**2))
    through = (1 - R) ** 2 * tau / (1 - (R * tau) ** 2)
    back = R + (1 - R) ** 2 * R * tau**2 / (1 - (R * tau) ** 2)
    direction = np.array([math.sin(math.radians(angle)), 0, cosine])
    wide = {"kind": "rectangle", "width": 2000, "height": 2000}
    result = traced(
        4e5,
        6,
        media={"dark": {"index": n, "absorption": absorption}},
        sources=[{"kind": "beam", "shape": {"kind": "disk", "radius": 1}, "flux": 1, "at": -9 * direction,
                  "toward": direction}],
        solids=[{"name": "slab", "shape": {"kind": "block", "width": 900, "height": 900, "depth": thickness},
                 "medium": "dark", "at": [0, 0, 5]}],
        surfaces=[{"name": "behind", "shape": wide, "at": [0, 0, 60], "finish": "absorber"},
                  {"name": "before", "shape": wide, "at": [0, 0, -60], "finish": "absorber"}],
    )  # fmt: skip
    ledger = result.ledger
    found = np.array(
        [ledger.by_surface["behind"].rays, ledger.by_surface["before"].rays, ledger.by_medium["dark"].rays]
    )
    assert found.sum() == 400_000
    expected = 400_000 * np.array([through, back, 1 - through - back])
    assert chi2.sf(((found - expected) ** 2 / expected).sum(), 2) > SIGNIFICANCE


@pytest.mark.parametrize(("angle", "length"), [(35.0, 3.0), (60.0, 5.0)])
def test_mirrored_pipe(angle: float, length: float) -> None:
    """Parallel light through a cylindrical mirror pipe [SwiftSmith1995]_, p = length/diameter."""
    radius, reflectance = 2.0, 0.85
    aspect = length * math.tan(math.radians(angle))
    # s = sin t takes the root at s = 1 out of the integrand.
    t = (np.arange(400_000) + 0.5) / 400_000 * math.pi / 2
    s = np.sin(t)
    bounces = aspect / s
    whole = np.floor(bounces)
    kept = reflectance**whole * (1 - (1 - reflectance) * (bounces - whole))
    share = 4 / math.pi * (s**2 * kept).mean() * math.pi / 2
    direction = np.array([math.sin(math.radians(angle)), 0, math.cos(math.radians(angle))])
    length *= 2 * radius
    end = {"kind": "rays", "shape": {"kind": "disk", "radius": radius}}
    pipe = {"name": "pipe", "shape": {"kind": "cylinder", "radius": radius, "height": length},
            "finish": {"kind": "mirror", "reflectance": reflectance}}  # fmt: skip
    # The opening is lit evenly, and the outside of the pipe is kept dark.
    baffle = {"name": "baffle", "shape": {"kind": "annulus", "inner_radius": radius, "outer_radius": 40},
              "finish": "absorber"}  # fmt: skip
    beam = {
        "kind": "beam",
        "shape": {"kind": "disk", "radius": 2.2},
        "flux": 1,
        "at": -20 * direction,
        "toward": direction,
    }
    result = traced(
        1.5e5, 8, sources=[beam], surfaces=[pipe, baffle],
        detectors=[{"name": "in", **end, "at": [0, 0, 1e-6]}, {"name": "out", **end, "at": [0, 0, length - 1e-6]}],
    )  # fmt: skip
    entered = len(result.rays["in"])
    assert entered > 50_000
    assert_drawn_with(share=share, hits=len(result.rays["out"]), rays=entered)


# --- lossless optics -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_furnace() -> None:
    """V9: in a surround of luminance 1, every illuminance behind a lossless lens is π."""
    sky = 12.0
    source = {"kind": "surface", "shape": {"kind": "sphere", "radius": sky}, "side": "back",
              "flux": math.pi * 4 * math.pi * sky**2}  # fmt: skip
    lens = {"name": "lens", "medium": "BK7", "at": [0.3, -0.5, 0], "rotation": [10, 20, 0],
            "shape": {"kind": "lens", "radius": 4, "thickness": 2.5, "front": {"radius_of_curvature": 8},
                      "back": {"radius_of_curvature": -20}}}  # fmt: skip
    grid = {"name": "grid", "kind": "illuminance", "width": 6, "height": 5, "columns": 4, "rows": 3, "at": [0, 0.4, 5],
            "toward": [0.1, 0, -1]}  # fmt: skip
    seen = traced(3e6, 9, sources=[source], solids=[lens], detectors=[grid]).illuminance["grid"]
    assert_agree(values=seen.values, standard_error=seen.standard_error, expected=np.full((3, 4), math.pi * 1e6))


@pytest.mark.slow
def test_luminance_out_of_a_dome() -> None:
    """V10: light that leaves n = 1.5 through any face keeps L/n²: a Lambertian disk in a dome, seen as intensity.

    At normal exit from the centre of a hemisphere nothing is bent, so that I(γ) = T I₀ cos γ with T = 4n/(n+1)² of the
    first passage, and what is reflected is absorbed by the base.
    """
    n, flux = 1.5, 10.0
    transmittance = 4 * n / (n + 1) ** 2
    source = {"kind": "surface", "shape": {"kind": "disk", "radius": 1e-3}, "flux": flux, "at": [0, 0, 1e-4]}
    dome = {
        "name": "dome",
        "shape": {"kind": "dome", "radius": 10},
        "medium": "glass",
        "finishes": {"base": "absorber"},
    }
    far = traced(
        5e5, 7, media={"glass": {"index": n}}, sources=[source], solids=[dome],
        detectors=[{"name": "far", "kind": "intensity", "c_planes": 4, "gamma_step": 10}],
    ).intensity.only  # fmt: skip

    def intensity(_: Array, gamma: Array) -> Array:
        return transmittance * flux / math.pi * np.maximum(np.cos(np.radians(gamma)), 0.0) + 0.0 * _

    expected = hat_means(intensity, c=far.c, gamma=far.gamma)[0]
    apart = np.s_[::2, 1:9:2]
    assert_agree(values=far.values[apart], standard_error=far.standard_error[apart], expected=expected[apart])
