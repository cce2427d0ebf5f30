"""Total scatter of scans at oblique incidence, against the light that models scatter."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.instruments.goniometer_scan import GoniometerScan
from etendue.instruments.positions import Plane, detector_directions
from etendue.quantities.bsdf_directions import light_from

LOBES = {
    "gaussian": et.bsdf.Gaussian(peak=1, sigma=0.15),
    "abg": et.bsdf.ABg(a=0.02, b=0.01, g=1.8),
    "wide": et.bsdf.Gaussian(peak=0.5, sigma=0.4),
    "flat": et.bsdf.Lambertian(reflectance=0.6),
}


def scan_of(*, bsdf: et.Bsdf, angle: np.ndarray, incidence: float, plane: Plane) -> GoniometerScan:
    """Values of eq. 5.1, point by point."""
    to = detector_directions(angle, incidence, plane, behind=False)
    flux = bsdf.evaluate(light_from(incidence, 180.0), to) * np.abs(to[:, 2]) * 1e-3
    return GoniometerScan(angle, flux, solid_angle=1e-3, incidence=incidence, way="reflected", plane=plane)


@pytest.mark.parametrize("name", LOBES)
@pytest.mark.parametrize("incidence", [0.0, 30.0, 60.0, 75.0])
def test_lobes_that_are_round_in_direction_cosines_give_their_light(name: str, incidence: float) -> None:
    """To 1e-3; as if round in the angle the light of the first would be 1.5 times at 60°, and 2.1 at 75°."""
    scan = scan_of(bsdf=LOBES[name], angle=np.arange(-89.5, 90.0, 0.5), incidence=incidence, plane="in-plane")
    assert scan.total_scatter == pytest.approx(float(LOBES[name].reflectance(incidence)), rel=1e-3)


@pytest.mark.parametrize("incidence", [0.0, 60.0])
def test_scans_across_the_plane_of_incidence(incidence: float) -> None:
    """Of a lobe that ends within their reach; 0.62 of the light at 60°, as if round in the angle."""
    scan = scan_of(bsdf=LOBES["gaussian"], angle=np.arange(-89.5, 90.0, 0.5), incidence=incidence, plane="cross-plane")
    assert scan.total_scatter == pytest.approx(float(LOBES["gaussian"].reflectance(incidence)), rel=1e-3)


def test_one_side_stands_for_the_other_where_it_ends() -> None:
    """A scan from the specular direction on outwards: the lobe is taken for round."""
    scan = scan_of(bsdf=LOBES["gaussian"], angle=np.arange(-60.0, 20.1, 0.5), incidence=20.0, plane="in-plane")
    assert scan.total_scatter == pytest.approx(float(LOBES["gaussian"].reflectance(20.0)), rel=2e-3)
