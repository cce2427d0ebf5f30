"""Goniometer scans: the printed equations of the thesis where they are right, the mended ones, and what schemes cost."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, FormatError, UnknownNameError
from etendue.quantities.bsdf_directions import direction, mirrored
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.materials import MATERIALS
from etendue.scatter.model_fit import fit_bsdf
from etendue.scatter.scans import harvey_shack
from etendue.scatter.scans.files import read_scans
from etendue.scatter.scans.goniometer import bsdf_of_flux, detector_direction, incident_direction
from etendue.scatter.scans.interpolations import (
    METHODS,
    SMALLEST,
    horizon,
    radial_coordinates,
    share_error,
    suited,
    tabulated,
)
from etendue.scatter.scans.scans import Scans

Array = npt.NDArray[np.float64]


# --- appendix A ------------------------------------------------------------------------------------------------------


def printed_detector(*, alpha: float, beta: float, gamma: float, delta: float) -> Array:
    """Eq. A.2, letter by letter."""
    a, b, g, d = (math.radians(x) for x in (alpha, beta, gamma, delta))
    sin, cos = math.sin, math.cos
    return np.array([
        -cos(a) * cos(b) * sin(g) * cos(d) + sin(a) * cos(b) * cos(g) * cos(d) + sin(b) * sin(d),
        cos(a) * cos(b) * sin(g) * sin(d) - sin(a) * cos(b) * cos(g) * sin(d) + sin(b) * cos(d),
        -cos(a) * cos(b) * cos(g) - sin(a) * cos(b) * sin(g),
    ])  # fmt: skip


def test_stages_point_where_the_printed_equations_say() -> None:
    rng = np.random.default_rng(3)
    for alpha, beta, gamma, delta in rng.uniform([-180, -90, -90, -180], [180, 90, 90, 180], (200, 4)):
        found = detector_direction(alpha, beta, gamma, delta)
        assert np.allclose(found, printed_detector(alpha=alpha, beta=beta, gamma=gamma, delta=delta), atol=1e-14)
        assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-14)
        i = incident_direction(gamma, delta)
        # At rest the light goes straight on into the detector; 180° + 2γ is the specular direction.
        assert np.allclose(detector_direction(0, 0, gamma, delta), -i, atol=1e-14)
        assert np.allclose(detector_direction(180 + 2 * gamma, 0, gamma, delta), mirrored(i), atol=1e-14)


def test_bsdf_of_fluxes() -> None:
    """Of a Lambertian sample: Φ ρ cosθ Ω/π arrives."""
    to = direction(np.array([0.0, 40.0, 80.0]), 20.0)
    flux = 0.7 / math.pi * to[:, 2] * 2e-4 * 3.0
    assert bsdf_of_flux(flux, 3.0, solid_angle=2e-4, direction=to) == pytest.approx(np.full(3, 0.7 / math.pi))
    with pytest.raises(ArgumentError, match="plane of the sample"):
        bsdf_of_flux(1.0, 1.0, solid_angle=1e-3, direction=[1.0, 0.0, 0.0])
    with pytest.raises(ArgumentError, match="more than 0"):
        bsdf_of_flux(1.0, 0.0, solid_angle=1e-3, direction=[0.0, 0.0, 1.0])


def test_coordinates_go_there_and_back_and_a17_as_printed_does_not() -> None:
    rng = np.random.default_rng(4)
    incident = direction(40.0, 25.0)
    scattered = direction(np.degrees(np.arccos(rng.uniform(0.01, 1.0, 2000))), rng.uniform(0, 360, 2000))
    r, a = harvey_shack.coordinates(incident, scattered)
    assert np.allclose(harvey_shack.directions(incident, r, a), scattered, atol=1e-9)
    # A.16, and A.17 with 2π − φ in place of φ + π.
    i, d = incident, scattered
    off = d[:, :2] + i[:2]
    across = math.hypot(i[0], i[1])
    phi = np.degrees(np.arccos((-i[1] * off[:, 0] + i[0] * off[:, 1]) / (np.hypot(*off.T) * across)))
    below = (-i[0] * off[:, 0] - i[1] * off[:, 1]) / across < 0
    assert np.allclose(np.where(below, 360.0 - phi, phi), a, atol=1e-5)
    printed = np.where(below, phi + 180.0, phi)
    wrong = np.abs((printed - a + 180.0) % 360.0 - 180.0) > 1e-5
    assert wrong.mean() == pytest.approx(below.mean(), abs=0.01)
    assert wrong.mean() > 0.5


def test_at_normal_incidence_the_axis_is_x() -> None:
    """Where A.13 is 0/0: A.4 to A.6."""
    r, a = harvey_shack.coordinates([0.0, 0.0, 1.0], direction(30.0, [0.0, 100.0, 200.0]))
    assert r == pytest.approx(np.full(3, 0.5))
    assert a == pytest.approx([0.0, 100.0, 200.0])


def test_the_edge_of_directions_and_b2_as_printed() -> None:
    for theta in (0.0, 5.0, 60.0, 85.0):
        incident = direction(theta, 130.0)
        azimuth = np.arange(0.0, 360.0, 7.0)
        r = harvey_shack.farthest(theta, azimuth)
        assert not np.isnan(harvey_shack.directions(incident, r * (1 - 1e-9), azimuth)).any()
        assert np.isnan(harvey_shack.directions(incident, r * (1 + 1e-9), azimuth)).all()
    sine = math.sin(math.radians(60.0))
    printed = math.sqrt(1.0 + sine**2 - 2.0 * sine * math.cos(math.radians(90.0)))
    assert printed == pytest.approx(1.3229, abs=1e-4)
    assert float(harvey_shack.farthest(60.0, 0.0)) == pytest.approx(0.5)


def test_b4_as_printed_is_no_rotation() -> None:
    """About X by −60°; with minus signs at (2,3) and (3,1) and +θ it turns the specular direction to Z."""

    def matrix(*, theta: float, sign: float) -> Array:
        c, s = math.cos(math.radians(theta)), math.sin(math.radians(theta))
        return np.array([[1, 0, 0], [0, c, sign * s], [0, s, c]])

    specular = np.array([0.0, math.sin(math.radians(60)), math.cos(math.radians(60))])
    assert np.linalg.det(matrix(theta=-60.0, sign=+1.0)) == pytest.approx(-0.5)
    mended = matrix(theta=60.0, sign=-1.0)
    assert np.linalg.det(mended) == pytest.approx(1.0)
    assert np.allclose(mended @ specular, [0, 0, 1])
    # The frame of PolarGrid is that rotation: angles to the specular direction are kept.
    incident = direction(60.0, 270.0)
    at = direction(np.array([20.0, 50.0, 70.0]), np.array([80.0, 90.0, 100.0]))
    r, _ = PolarGrid("specular", np.zeros(1), np.zeros(1)).coordinates(at, incident, transmitted=False)
    assert np.cos(np.radians(r)) == pytest.approx((at @ mended.T)[:, 2])


def test_limits_of_the_scans_are_those_of_the_thesis() -> None:
    """(90°, 0°), (90° − θ, 90°), (90°, 180°), (90° + θ, 270°), azimuth 90° being forwards there."""
    incident = direction(25.0, 180.0)
    assert [round(horizon(incident, a), 9) for a in (90.0, 180.0, 270.0, 0.0)] == [90.0, 65.0, 90.0, 115.0]


# --- appendix B ------------------------------------------------------------------------------------------------------

PET = et.bsdf.RoughCoat(roughness=0.1, index=1.575, base_reflectance=0.99)


def two_planes(bsdf: et.Bsdf, *, thetas: tuple[float, ...], reflectance: float | None = None) -> Scans:
    """Denser at the specular direction, none where the detector would shade the light, as in fig. B.1."""
    incidents, scattered = [], []
    for theta in thetas:
        incident = direction(theta, 180.0)
        r = np.concatenate([np.arange(0.0, 10.0, 0.5), np.arange(10.0, 150.0, 5.0)])
        at = PolarGrid("specular", r, np.array([0.0, 90.0, 180.0, 270.0])).directions(incident, transmitted=False)
        own = at[~np.isnan(at[..., 0])]
        shaded = own @ incident > math.cos(math.radians(6.0))
        own = own[(own[:, 2] > math.sin(math.radians(2.0))) & ~shaded]
        incidents.append(np.tile(incident, (len(own), 1)))
        scattered.append(own)
    i, s = np.concatenate(incidents), np.concatenate(scattered)
    return Scans(i, s, bsdf.evaluate(i, s), reflectance=reflectance)


@pytest.mark.slow
def test_what_each_scheme_costs() -> None:
    """Shares before scaling: triangles in U, V lose a third, as 67 and 75 % in the thesis; those about the specular few."""
    scans = two_planes(PET, thetas=(5.0, 60.0))
    truth = PET.reflectance([5.0, 60.0])
    lost = {
        name: np.array([one.stated for one in tabulated(scans, name).slices], float) / truth - 1.0 for name in METHODS
    }
    assert (lost["direction-cosines"] < -0.2).all()
    assert (np.abs(lost["specular-centred"]) < 0.12).all()
    assert (np.abs(lost["smooth"]) < 0.12).all()
    assert (np.abs(lost["smooth"]) < np.abs(lost["direction-cosines"])).all()


def test_natural_neighbours_keep_a_plane_and_take_sibsons_areas() -> None:
    """Linear functions come back between the points; four points on a square share its middle evenly."""
    incident = direction(0.0, 0.0)

    def lifted(beta: Array) -> Array:
        return np.column_stack([beta, np.sqrt(1.0 - np.sum(beta * beta, axis=1))])

    square = np.array([[0.3, 0.0], [0.0, 0.3], [-0.3, 0.0], [0.0, -0.3]])
    (middle,), _ = METHODS["natural-neighbours"](
        incident, lifted(square), np.array([1.0, 2.0, 3.0, 8.0]), lifted(np.zeros((1, 2)))
    )
    assert middle == pytest.approx(3.5, abs=0.02)
    rng = np.random.default_rng(3)
    points = rng.uniform(-0.6, 0.6, (300, 2))
    at = rng.uniform(-0.3, 0.3, (60, 2))
    plane = lambda beta: 1.0 + beta @ np.array([0.7, -0.4])  # noqa: E731 - a function of a line
    found, _ = METHODS["natural-neighbours"](incident, lifted(points), plane(points), lifted(at))
    assert np.abs(found / plane(at) - 1.0).max() < 0.02


def test_turning_the_sample() -> None:
    """Brushed metal differs when it is turned, paint does not; turned on the stage, not in the plane of incidence."""
    brushed = et.bsdf.RoughMetal(roughness=0.3, roughness_across=0.1, reflectance=0.9)
    for bsdf, most, least in ((brushed, 9.0, 0.3), (et.bsdf.Gaussian(peak=2.0, sigma=0.2), 1e-9, 0.0)):
        incidents, scattered = [], []
        for phi in (180.0, 225.0, 300.0):
            incident = direction(40.0, phi)
            to = direction(np.array([20.0, 35.0, 45.0, 60.0]), phi + np.array([170.0, 180.0, 190.0, 180.0]))
            incidents.append(np.tile(incident, (4, 1)))
            scattered.append(to)
        i, s = np.concatenate(incidents), np.concatenate(scattered)
        assert least <= Scans(i, s, bsdf.evaluate(i, s)).anisotropy() <= most
    assert math.isnan(two_planes(PET, thetas=(5.0, 60.0)).anisotropy())


@pytest.mark.slow
@pytest.mark.parametrize("method", ["specular-centred", "smooth"])
def test_the_lobe_comes_back(method: str) -> None:
    """f about the specular direction to 10 %, between the planes too; the share is the stated one."""
    table = et.BsdfTable.from_scans(two_planes(PET, thetas=(5.0, 30.0, 60.0), reflectance=0.97), method)
    incident = direction(30.0, 180.0)
    at = PolarGrid("specular", np.array([1.0, 4.0, 8.0]), np.arange(0.0, 360.0, 22.5))
    scattered = at.directions(incident, transmitted=False)
    ratio = table.evaluate(incident, scattered) / PET.evaluate(incident, scattered)
    assert float(np.abs(ratio / np.median(ratio) - 1.0).max()) < 0.1
    assert table.reflectance([5.0, 30.0, 60.0]) == pytest.approx(np.full(3, 0.97), abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("planes", [(0.0, 180.0), (0.0, 90.0, 180.0, 270.0)])
@pytest.mark.parametrize("theta", [5.0, 60.0, 75.0])
def test_the_light_of_a_round_lobe_is_that_of_its_closed_form(planes: tuple[float, ...], theta: float) -> None:
    """ρ + 2πσ²P of a lobe on a floor, less what of it lies beyond the horizon; also where counts are few, and many are 0.

    A tenth of the counts of the floor are 0, the mean count is 2.5; the shares of 40 values on either side err by some 3 %.
    """
    sample = et.bsdf.Mixture(
        parts=[{"kind": "gaussian", "peak": 40.0, "sigma": 0.03}, {"kind": "lambertian", "reflectance": 0.2}]
    )
    incident = direction(theta, 180.0)
    r = np.concatenate([np.arange(0.0, 6.0, 0.2), np.arange(6.0, 150.0, 1.5)])
    at = PolarGrid("specular", r, np.array(planes)).directions(incident, transmitted=False)
    to = at[~np.isnan(at[..., 0])]
    to = to[to[:, 2] > 0.05]
    light = np.tile(incident, (len(to), 1))
    f = sample.evaluate(light, to)
    truth = 0.2 + 2 * math.pi * 0.03**2 * 40.0 if theta < 70.0 else float(sample.reflectance(theta))
    clean, noisy = (
        float(tabulated(Scans(light, to, values)).slices[0].integral())
        for values in (f, 0.025 * np.random.default_rng(4).poisson(f / 0.025))
    )
    assert clean == pytest.approx(truth, rel=0.01)
    assert noisy == pytest.approx(truth, rel=0.12)


@pytest.mark.slow
def test_lobes_that_fall_by_decades_beside_the_scans_hold_their_light() -> None:
    """An oblong lobe without a floor, 2πσ²·3·P of the light: logarithms between its scans miss it by decades."""
    lobe = et.bsdf.Gaussian(peak=5.0, sigma=0.05, aspect=3.0)
    incident = direction(20.0, 180.0)
    r = np.concatenate([np.arange(0.0, 10.0, 0.5), np.arange(10.0, 150.0, 2.0)])
    at = PolarGrid("specular", r, np.arange(0.0, 360.0, 45.0)).directions(incident, transmitted=False)
    to = at[~np.isnan(at[..., 0])]
    to = to[to[:, 2] > 0.05]
    scans = Scans(np.tile(incident, (len(to), 1)), to, lobe.evaluate(np.tile(incident, (len(to), 1)), to))
    (one,) = tabulated(scans, "smooth").slices
    assert one.integral() == pytest.approx(2 * math.pi * 0.05**2 * 3.0 * 5.0, rel=0.15)


@pytest.mark.slow
def test_the_order_of_values_that_were_measured_twice_does_not_matter() -> None:
    once = in_plane(f=0.1)
    again = np.full(once.values.size, 0.3)
    twice = [
        Scans(np.tile(once.incident, (2, 1)), np.tile(once.scattered, (2, 1)), np.concatenate(values))
        for values in ((once.values, again), (again, once.values))
    ]
    for method in ("specular-centred", "smooth", "natural-neighbours"):
        a, b = (tabulated(scans, method).slices[0].values for scans in twice)
        assert a == pytest.approx(b, rel=1e-9, nan_ok=True)


@pytest.mark.slow
def test_stated_errors_of_the_smooth_method_hold() -> None:
    """Noise of 5 % on a Lambertian surface: f misses R/π by less than its standard error, which is that of one value."""
    rng = np.random.default_rng(7)
    squares = []
    for _ in range(8):
        clean = two_planes(et.bsdf.Lambertian(reflectance=0.8), thetas=(30.0,))
        noisy = Scans(
            clean.incident, clean.scattered, clean.values * np.exp(0.05 * rng.standard_normal(clean.values.size))
        )
        (one,) = tabulated(noisy, "smooth").slices
        assert one.standard_error is not None
        there = ~np.isnan(one.values)
        z = (one.values[there] - 0.8 / math.pi) / one.standard_error[there]
        squares.append(float(np.median(z * z)))
    # The median of χ² with one degree of freedom is 0.455.
    assert 0.455 / 10 < np.mean(squares) < 0.455


def test_grids_are_those_of_the_thesis() -> None:
    r = radial_coordinates()
    assert (r.size, r[0], r[1], r[-1]) == (100, 0.0, SMALLEST, 2.0)


def test_impossible_scans_are_refused() -> None:
    i, s = [direction(30.0, 180.0)], [direction(30.0, 0.0)]
    with pytest.raises(ArgumentError, match="shape"):
        Scans(np.array(i), np.array(s), np.ones(2))
    with pytest.raises(ArgumentError, match="no unit vector"):
        Scans(np.array(i), 2.0 * np.array(s), np.ones(1))
    with pytest.raises(ArgumentError, match="values are finite"):
        Scans(np.array(i), np.array(s), np.full(1, np.nan))
    with pytest.raises(ArgumentError, match="fewer than two"):
        tabulated(Scans(np.array(i), np.array(s), np.ones(1)))
    with pytest.raises(UnknownNameError, match="smooth"):
        tabulated(Scans(np.array(i), np.array(s), np.ones(1)), "smoth")


def in_plane(*, f: float) -> Scans:
    to = np.concatenate([direction(np.arange(0.0, 85.0, 5.0), a) for a in (0.0, 180.0)])
    return Scans(np.tile(direction(30.0, 180.0), (len(to), 1)), to, np.full(len(to), f))


def test_what_no_method_can_make_a_table_of_is_told() -> None:
    """Directions on a line, and a sample that scatters nothing."""
    with pytest.raises(ArgumentError, match="lie on a line"):
        tabulated(in_plane(f=0.25), "direction-cosines")
    for method in ("radial-basis", "smooth"):
        with pytest.raises(ArgumentError, match="no value is above 0"):
            tabulated(in_plane(f=0.0), method)
    for error in (np.nan, -0.1, np.inf):
        with pytest.raises(ArgumentError, match="standard errors are finite"):
            Scans([[0, 0, 1]], [[0, 0, 1]], [0.2], standard_error=[error])  # type: ignore[arg-type,list-item] # made arrays
    with pytest.raises(ArgumentError, match="must be finite"):
        bsdf_of_flux(1.0, 1.0, solid_angle=math.inf, direction=[0.0, 0.0, 1.0])


def at_random(*, f: float) -> Scans:
    """Directions of no order, within 50° of the normal."""
    beta = np.random.default_rng(8).uniform(-0.54, 0.54, (400, 2))
    to = np.column_stack([beta, np.sqrt(1.0 - np.sum(beta * beta, axis=1))])
    return Scans(np.tile(direction(20.0, 180.0), (len(to), 1)), to, np.full(len(to), f))


def test_the_method_suits_the_scans_if_none_is_stated() -> None:
    """Two planes, one side of one plane, no planes at all; only what is not the usual one is told, with the reason."""
    one_side = in_plane(f=0.25)
    ahead = one_side.scattered[:, 0] > math.sin(math.radians(30.0)) - 1e-9
    one_side = Scans(one_side.incident[ahead], one_side.scattered[ahead], one_side.values[ahead])
    assert suited(in_plane(f=0.25)) == ("smooth", "")
    assert suited(in_plane(f=0.0)) == ("specular-centred", "no value is above 0")
    method, why = suited(at_random(f=0.25))
    assert method == "natural-neighbours"
    assert "azimuths about the specular direction, and make no scans" in why
    # From the specular direction to the horizon ahead it is 0.5 in direction cosines, and back from it 1.5.
    both = ["at one azimuth", "beyond the measured directions"]
    for scans, method, told in ((in_plane(f=0.25), "smooth", []), (one_side, "smooth", both)):
        table = et.Bsdf.from_scans(scans)
        assert isinstance(table, et.BsdfTable)
        assert table.data.facts["interpolation"] == method
        for complaint, part in zip(table.complaints, told, strict=True):
            assert ("beyond" in part) != (f"method {method}" in str(complaint))
            assert part in str(complaint)


def test_a_stated_method_that_cannot_work_names_those_that_can() -> None:
    with pytest.raises(
        ArgumentError, match=r"specular-centred: .* azimuths about .*: direction-cosines, natural-neigh.*, smooth$"
    ):
        tabulated(at_random(f=0.25), "specular-centred")
    with pytest.raises(
        ArgumentError, match=r"on a line.* specular-centred, natural-neighbours, radial-basis, shepard, smooth$"
    ):
        tabulated(in_plane(f=0.25), "direction-cosines")
    with pytest.raises(ArgumentError, match=r"no value is above 0.*: specular-centred, natural-neighbours, shepard$"):
        tabulated(in_plane(f=0.0), "smooth")


def test_transmitted_light_is_the_mirror_image_of_reflected_light(tmp_path: Path) -> None:
    """A lobe about the direction straight on makes the slices of one about the specular direction, on the other side."""
    front = in_plane(f=0.25)
    through = front.scattered * [1.0, 1.0, -1.0]
    for method in ("automatic", "shepard", "smooth"):
        (one,) = tabulated(front, method).slices
        (other,) = tabulated(Scans(front.incident, through, front.values), method).slices
        assert (one.transmitted, other.transmitted) == (False, True)
        assert np.array_equal(one.values, other.values, equal_nan=True)
        assert one.stated == other.stated
    both = Scans(
        np.concatenate([front.incident, front.incident]),
        np.concatenate([front.scattered, through]),
        np.concatenate([front.values, 0.5 * front.values]),
        reflectance=0.6,
        transmittance=0.3,
    )
    table = et.Bsdf.from_scans(both)
    assert table.reflectance(30.0) == pytest.approx(0.6, abs=1e-3)
    assert table.transmittance(30.0) == pytest.approx(0.3, abs=1e-3)
    # From a file θ counts on from the normal of the front.
    path = tmp_path / "scan.csv"
    path.write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n30,180,30,0,1\n30,180,150,0,2\n")
    read = read_scans([path], transmittance=0.4)
    assert read.scattered[:, 2] == pytest.approx([math.cos(math.radians(30.0)), -math.cos(math.radians(30.0))])
    assert read.transmittance == 0.4
    with pytest.raises(ArgumentError, match=r"scattered\[1\].*behind the sample: models are fitted to reflected light"):
        fit_bsdf(read, "lambertian")
    with pytest.raises(ArgumentError, match=r"scattered\[0\] is .*, no unit vector beside the sample"):
        Scans([[0, 0, 1]], [[0, 1, 0]], [0.1])  # type: ignore[arg-type,list-item] # made arrays
    for share, place in (("transmittance", "behind"), ("reflectance", "in front of")):
        one_way = front.scattered if share == "transmittance" else through
        with pytest.raises(ArgumentError, match=f"{share} is stated, and no value was measured {place} the sample"):
            Scans(front.incident, one_way, front.values, **{share: 0.5})  # type: ignore[arg-type] # one of two names
    with pytest.raises(ArgumentError, match=r"transmittance is 1\.2"):
        Scans([[0, 0, 1]], [[0, 0, 1]], [0.1], transmittance=1.2)  # type: ignore[arg-type,list-item] # made arrays


@pytest.mark.slow
def test_a_diffuser_from_scans_behind_it() -> None:
    """A holographic diffuser of 20°, scanned in six planes at four incidences: f and T are its own."""
    diffuser = MATERIALS["holographic-diffuser-20"].finish
    grid = PolarGrid(
        "specular", np.append(np.arange(0.0, 30.0, 1.0), np.arange(30.0, 150.0, 5.0)), np.arange(12) * 30.0
    )
    incident, scattered, values = [], [], []
    for theta in (0.0, 20.0, 40.0, 60.0):
        light = direction(theta, 180.0)
        to = grid.directions(light, transmitted=True).reshape(-1, 3)
        to = to[to[:, 2] < -0.02]
        incident.append(np.tile(light, (len(to), 1)))
        scattered.append(to)
        values.append(diffuser.evaluate(light, to))
    table = et.Bsdf.from_scans(Scans(*map(np.concatenate, (incident, scattered, values))))
    assert (table.reflectance([0.0, 30.0]) == 0.0).all()
    thetas = np.array([0.0, 20.0, 30.0, 40.0])
    assert table.transmittance(thetas) == pytest.approx(diffuser.transmittance(thetas), rel=0.02)
    at = direction(np.arange(100.0, 180.0, 8.0)[:, None], np.arange(0.0, 360.0, 45.0))
    for theta in (0.0, 30.0, 40.0):
        known = diffuser.evaluate(direction(theta, 180.0), at)
        assert np.abs(table.evaluate(direction(theta, 180.0), at) - known).max() < 0.05 * known.max()


@pytest.mark.parametrize("method", ["specular-centred", "shepard"])
def test_errors_of_scans_are_those_of_the_table(method: str) -> None:
    """A mean of values that are all off by 4 % is off by 4 %."""
    scans = in_plane(f=0.25)
    known = Scans(scans.incident, scans.scattered, scans.values, standard_error=0.04 * scans.values, reflectance=0.7)
    (one,) = tabulated(known, method).slices
    there = ~np.isnan(one.values)
    assert one.interpolated
    assert one.standard_error is not None
    assert one.standard_error[there] == pytest.approx(0.04 * one.values[there])
    assert share_error(one) == pytest.approx(0.04 * float(one.stated or 0.0))
    assert tabulated(scans, method).slices[0].standard_error is None


def test_stages_that_do_not_come_back_exactly() -> None:
    """Angles as they are read, a few thousandths of a degree off: the same incidences, and the same share."""
    rows = np.array(
        [
            (180.0 + 2.0 * gamma + a, b, gamma, 0.0)
            for gamma in (0.0, 10.0, 40.0)
            for a, b in [
                *((a, 0.0) for a in np.arange(-45.0, 46.0, 3.0)),
                *((0.0, b) for b in np.arange(-45.0, 46.0, 3.0)),
            ]
        ]
    )
    rng = np.random.default_rng(4)
    tables = []
    for stages in (rows, rows + rng.uniform(-0.004, 0.004, rows.shape)):
        to = detector_direction(*stages.T)
        scans = Scans.from_stages(stages, 0.1 / math.pi * 1e-3 * to[:, 2], 1.0, solid_angle=1e-3)
        tables.append(et.Bsdf.from_scans(scans, "smooth"))
    exact, read = tables
    assert read.isotropic
    assert read.incidences == pytest.approx(exact.incidences, abs=0.002)
    assert read.reflectance([0.0, 10.0, 40.0]) == pytest.approx([0.1] * 3, rel=1e-3)


def test_a_table_is_the_first_thing_that_is_asked_for() -> None:
    """In an interpreter that has made no other table."""
    code = """
import etendue as et
scattered = [[0.5, 0, 0.75**0.5], [-0.5, 0, 0.75**0.5], [0, 0.5, 0.75**0.5]]
print(et.Bsdf.from_scans(et.Scans([[0, 0, 1]] * 3, scattered, [0.2] * 3), "specular-centred").incidences)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "(0.0,)"


# --- files -----------------------------------------------------------------------------------------------------------


def test_stages_in_two_files(tmp_path: Path) -> None:
    scan, arriving = tmp_path / "scan.csv", tmp_path / "incident.csv"
    scan.write_text(
        "# a comment\nalpha;beta;gamma;delta;flux\n" + "".join(f"{240 + a};0;30;0;1e-4\n" for a in (-5, 0, 5))
    )
    arriving.write_text("alpha,beta,gamma,delta,flux\n0,0,0,0,0.9\n0,0,0,0,1.1\n")
    scans = read_scans([scan], incident_flux=arriving, solid_angle=1e-3, reflectance=0.9)
    assert scans.thetas == pytest.approx([30.0])
    assert scans.values[1] == pytest.approx(0.1 / math.cos(math.radians(30.0)))
    with pytest.raises(ArgumentError, match="state the incident flux"):
        read_scans([scan])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("theta,phi\n1,2\n", "columns theta, phi"),
        ("theta_i,phi_i,theta_s,phi_s,bsdf,colour\n", "columns"),
        ("theta_i,phi_i,theta_s,phi_s,bsdf\n", "no values follow"),
        ("theta_i,phi_i,theta_s,phi_s,bsdf\n30,180,30,0\n", "4 fields; the columns are 5"),
        ("theta_i,phi_i,theta_s,phi_s,bsdf\n30,180,30,0,nan\n", "no finite number"),
        ("theta_i,phi_i,theta_s,phi_s,bsdf\n30,180,30,0,1\n95,180,30,0,1\n", "row 2, theta_i: an angle of 95°"),
        ("theta_i,phi_i,theta_s,phi_s,bsdf\n30,180,190,0,1\n", "row 1, theta_s: an angle of 190°"),
    ],
)
def test_mistakes_in_files_are_told(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "scan.csv"
    path.write_text(text)
    with pytest.raises(FormatError, match=said):
        read_scans([path])
