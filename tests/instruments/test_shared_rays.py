"""Positions that count the same rays err together: what deconvolution makes of it."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.instruments.directional_scan import DirectionalScan, read_directional_scan
from etendue.instruments.goniometer_scan import GoniometerScan, read_goniometer_scan
from etendue.instruments.shared_rays import together
from etendue.quantities.bsdf_directions import direction
from oracles.verdicts import SIGNIFICANCE
from scipy.integrate import quad
from scipy.stats import chi2

SOLID_ANGLE = 6.25e-4
RAYS = 10_000


def overlap(*, x: float) -> float:
    """Of a disk in another one that is x diameters away: two segments over the area."""
    half = math.acos(x)
    return (2.0 * half - math.sin(2.0 * half)) / math.pi


def test_in_one_plane_the_variance_grows_by_the_overlaps() -> None:
    """All of it is the rays': F (1 − F)/N. In fine steps the sum is an integral over the overlap of two disks."""
    angle = np.arange(-4.0, 4.001, 0.02)
    flux = np.full(angle.size, 1e-3)
    error = np.sqrt(flux * (1.0 - flux) / RAYS)
    scan = GoniometerScan(angle, flux, error, solid_angle=SOLID_ANGLE, shared_rays=RAYS)
    diameter = math.degrees(2.0 * math.sqrt(SOLID_ANGLE / math.pi))
    expected = 2.0 * quad(lambda x: overlap(x=x), 0.0, 1.0)[0] * diameter / 0.02
    factor = together(scan)
    assert factor[angle.size // 2] == pytest.approx(expected, rel=1e-3)
    # At the end of the scan there are neighbours on one side alone.
    assert factor[0] == pytest.approx(0.5 * (expected + 1.0), rel=1e-3)
    # As much noise of photons again is independent at each position.
    noisy = dataclasses.replace(scan, standard_error=math.sqrt(2.0) * error)
    np.testing.assert_allclose(together(noisy) - 1.0, 0.5 * (factor - 1.0), rtol=1e-9)
    np.testing.assert_array_equal(together(dataclasses.replace(scan, shared_rays=0)), np.ones(angle.size))


def test_in_two_dimensions_it_grows_by_the_positions_in_an_aperture() -> None:
    """The overlap of two disks has the integral of their area: Ω over the solid angle of a position."""
    step = 0.1
    x, y = (np.radians(part.ravel()) for part in np.meshgrid(*2 * [np.arange(-2.5, 2.501, step)]))
    arms = direction(np.degrees(np.arcsin(np.hypot(x, y))), np.degrees(np.arctan2(y, x)))
    flux = np.full(len(arms), 1e-3)
    error = np.sqrt(flux * (1.0 - flux) / RAYS)
    scan = DirectionalScan(arms, flux, error, solid_angle=SOLID_ANGLE, shared_rays=RAYS)
    middle = int(np.argmax(arms[:, 2]))
    assert together(scan)[middle] == pytest.approx(SOLID_ANGLE / math.radians(step) ** 2, rel=0.01)


@pytest.mark.slow
def test_bands_hold_where_all_positions_count_the_same_rays() -> None:
    """Squares of the peak's deviations over 16 seeds, each over its own error: at most χ², at 10⁻⁴.

    Taken for independent, positions in steps of a sixteenth of the aperture make them three times and more as large.
    """
    bench = et.ScatterGoniometer()
    sample, bare = et.bsdf.Gaussian(peak=30.0, sigma=0.05, way="transmitted"), bench.instrument_function()
    squares = {0: 0.0, 50_000: 0.0}
    for seed in range(1, 17):
        scan = bench.measure(sample, 0, 0.1, 50_000, seed, span=9)
        assert scan.shared_rays == 50_000
        for shared in squares:
            found = et.deconvolve(dataclasses.replace(scan, shared_rays=shared), bare, seed=seed)
            assert found.standard_error is not None
            at = int(np.argmax(found.values))
            squares[shared] += float((found.peak - 30.0) / found.standard_error[at]) ** 2
    assert chi2.sf(squares[50_000], 16) > SIGNIFICANCE, squares
    assert chi2.sf(squares[0], 16) < SIGNIFICANCE, squares


def test_files_say_how_many_rays_are_shared(tmp_path: Path) -> None:
    bench, sample = et.ScatterGoniometer(), et.bsdf.Lambertian(reflectance=0.5)
    path = tmp_path / "scan.csv"
    for fresh in (False, True):
        bench.measure(sample, 0, 20, 1000, span=40, fresh=fresh).save(path)
        assert read_goniometer_scan(path).shared_rays == (0 if fresh else 1000)
        bench.measure_window(sample, 0, 20, 40, 1000, fresh=fresh).save(path)
        assert read_directional_scan(path).shared_rays == (0 if fresh else 1000)
    bench.measure(sample, 0, 20, span=40, method="quadrature").save(path)
    assert "shared_rays" not in path.read_text(encoding="utf-8")
    path.write_text("# shared_rays = 1e6\nangle,flux\n0,1\n1,2\n", encoding="utf-8")
    with pytest.raises(et.FormatError, match="'1e6' is no number of rays"):
        read_goniometer_scan(path)
