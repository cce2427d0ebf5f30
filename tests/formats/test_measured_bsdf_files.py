"""Files of goniophotometers and databases made by hand: BiRD, PAB, MERL, RGL."""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, FormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.quantities.bsdf_directions import direction
from oracles.bsdf_files import merl, pab, rgl, tensors

Array = npt.NDArray[np.float64]


def bird(**data: Any) -> dict[str, Any]:
    """The layout of the project's own example: two polarisations at two wavelengths."""
    columns: dict[str, Any] = {
        "wavelength_i": {"unit": "nm", "values": [550, 550, 650, 650]},
        "polarization_i": {"notation": "inStokes", "values": 2 * [[1, 1, 0, 0], [1, -1, 0, 0]]},
        "theta_i": {"unit": "°", "values": 4 * [30]},
        "phi_i": {"unit": "deg", "values": 4 * [0]},
        "theta_r": {"unit": "rad", "values": 4 * [math.radians(10)]},
        "phi_r": {"unit": "°", "values": 4 * [60]},
        "BRDF": {"unit": "sr^-1", "values": [0.254, 0.264, 0.267, 0.273]},
        "uBRDF": {"unit": "%", "values": [1, 1, 2, 2]},
    }
    sample = {"name": "SRT1", "properties_symmetry": "isotropic"}
    return {"metadata": {"type": "BRDF", "sample": sample}, "data": {**columns, **data}}


def test_bird_has_uncertainties_and_polarisations(tmp_path: Path) -> None:
    path = tmp_path / "x.brdf"
    path.write_text(json.dumps(bird(), ensure_ascii=False))
    data = read_bsdf_data(path)
    assert data.name == "SRT1"
    assert data.wavelengths == (550.0, 650.0)
    first = data.slices[0]
    assert np.allclose(first.incident, direction(30.0, 0.0))
    assert np.allclose(first.directions.reshape(-1, 3), direction(10.0, 60.0), atol=1e-7)
    assert first.values.ravel().tolist() == pytest.approx([0.259])
    assert first.standard_error is not None
    assert first.standard_error.ravel().tolist() == pytest.approx([0.00259])
    assert any("several times" in complaint.found for complaint in data.complaints)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"theta_i": {"unit": "gon", "values": 4 * [30]}}, "unit is 'gon'"),
        ({"theta_r": {"unit": "deg", "values": 4 * [95]}}, "not from 0 to 90"),
        ({"phi_r": {"unit": "deg", "values": [1, 2]}}, "2 values for 4"),
        ({"BRDF": {"unit": "1/sr", "values": "many"}}, "no list of numbers"),
        ({"BRDF": None}, "no object"),
        ({"uBRDF": {"unit": "1/sr", "values": [1, 2, 3, True]}}, "no list of numbers"),
    ],
)
def test_mistakes_of_bird_files(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    path = tmp_path / "x.brdf"
    path.write_text(json.dumps(bird(**change), ensure_ascii=False))
    with pytest.raises(FormatError, match=said):
        read_bsdf_data(path)


@pytest.mark.parametrize("quantity", ["BRDF", "DSF"])
def test_pab_directions_and_quantities(tmp_path: Path, quantity: str) -> None:
    path = tmp_path / "x.dat"
    path.write_bytes(pab(quantity))
    data = read_bsdf_data(path)
    (one,) = data.slices
    assert data.name == "brushed sheet"
    assert np.allclose(one.incident, direction(30.0, 0.0))
    theta = np.degrees(np.arccos(one.directions[:, 2]))
    phi = np.degrees(np.arctan2(one.directions[:, 1], one.directions[:, 0])) % 360.0
    assert np.allclose(one.values, 0.1 + theta / 1000 + phi / 10000, rtol=1e-5)
    # Each point stands for what is nearest to it: an even 0.2 would add up to 0.2 π.
    assert one.projected is not None
    assert float(one.projected.sum()) == pytest.approx(math.pi, rel=1e-6)


def test_files_of_single_incidences_are_read_together(tmp_path: Path) -> None:
    paths = [tmp_path / f"{theta}.dat" for theta in (30, 60)]
    for path, theta in zip(paths, (30.0, 60.0), strict=True):
        path.write_bytes(pab(theta=theta))
    bsdf = et.read_bsdf(paths)
    assert bsdf.incidences == (30.0, 60.0)
    assert bsdf.isotropic
    paths[1].write_bytes(pab(theta=60.0, phi=45.0))
    assert not et.read_bsdf(paths).isotropic
    with pytest.raises(ArgumentError, match="both hold light from 30"):
        et.read_bsdf([paths[0], paths[0]])
    with pytest.raises(ArgumentError, match="no file"):
        et.read_bsdf([])


@pytest.mark.parametrize(("up", "phi"), [("#upphi 90", 0.0), ("#upphi 0", 90.0), ("#", 90.0), ("#upphi 130", 320.0)])
def test_upwards_is_the_y_axis_of_pab_files(tmp_path: Path, up: str, phi: float) -> None:
    """As pabopto2bsdf of Radiance has it: 0 unless stated, and azimuths count so that upwards is at 90°.

    Values tell the azimuth of the file: it differs by as much from that of the direction as that of the light.
    """
    path = tmp_path / "x.dat"
    path.write_bytes(pab(up=up))
    (one,) = read_bsdf_data(path).slices
    assert np.allclose(one.incident, direction(30.0, phi))
    theta = np.degrees(np.arccos(one.directions[:, 2]))
    found = np.degrees(np.arctan2(one.directions[:, 1], one.directions[:, 0]))
    assert np.allclose((one.values - 0.1 - theta / 1000) * 10000, (found - phi) % 360.0, atol=1e-3)


def test_pab_mistakes(tmp_path: Path) -> None:
    path = tmp_path / "x.dat"
    whole = pab().decode()
    for old, new, said in (
        ("#intheta 30\n", "", "no angles of incidence"),
        ("in_file: 200", "in_file: 201", "201 are stated, 200"),
        ("#intheta 30", "#intheta 90", "light from θ 90"),
        ("#upphi 90", "#upphi north", "#upphi is 'north'"),
        ("#upphi 90", "#upphi nan", "#upphi is 'nan'"),
    ):
        path.write_text(whole.replace(old, new))
        with pytest.raises(FormatError, match=said):
            read_bsdf_data(path)


def test_merl_coordinates(tmp_path: Path) -> None:
    """f of the half angle and of the difference angles, at directions of ours."""

    def f(h: Array, d: Array, p: Array) -> Array:
        return 0.1 + 0.2 * np.cos(h) ** 2 + 0.1 * np.cos(d) + 0.05 * np.cos(2.0 * p) * np.sin(d) ** 2

    path = tmp_path / "x.binary"
    path.write_bytes(merl(f))
    data = read_bsdf_data(path)
    (one,) = (one for one in data.slices if abs(one.theta - 40.0) < 1e-6)
    for s in (direction(20.0, 130.0), direction(65.0, 200.0), direction(70.0, 10.0)):
        half = (one.incident + s) / np.linalg.norm(one.incident + s)
        e = np.cross(np.cross(half, [0.0, 0.0, 1.0]), half)
        e = -e / max(float(np.linalg.norm(e)), 1e-12)
        phi = math.atan2(float(one.incident @ np.cross(half, e)), float(one.incident @ e))
        angles = math.acos(min(half[2], 1.0)), math.acos(float(one.incident @ half))
        assert float(one.at(s)) == pytest.approx(float(f(*map(np.asarray, (*angles, phi)))), rel=0.02)


def test_merl_that_was_not_measured_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "x.binary"
    path.write_bytes(merl(lambda h, d, p: np.where(d > 1.4, -1.0, 0.2) + 0.0 * h * p))
    data = read_bsdf_data(path)
    assert float(np.nanmax(data.slices[3].values)) == pytest.approx(0.2, rel=1e-6)
    assert float(np.nanmin(data.slices[3].values)) == pytest.approx(0.2, rel=1e-6)


def hats(at: Array, nodes: int) -> Array:
    """Weights of nodes over the unit interval, of shape (…, nodes)."""
    return np.maximum(1.0 - np.abs((at * (nodes - 1))[..., None] - np.arange(nodes)), 0.0)


def bilinear(table: Array, u: Array, v: Array) -> Array:
    """Over the unit square, by hats about the nodes."""
    wx, wy = hats(u, table.shape[1]), hats(v, table.shape[0])
    return np.asarray(np.einsum("...x,...y,yx->...", wx, wy, table))


def means(table: Array, at: Array) -> Array:
    """The same at each of `at` along y, its mean over all of them along x."""
    return np.asarray(hats(at, table.shape[0]) @ table @ hats(at, table.shape[1]).mean(axis=0))


def warped(density: Array, incident: Array, scattered: Array) -> tuple[float, float, float, float]:
    """Coordinates of the half vector, and its distribution functions along x and y, by midpoints over the density."""
    middle = (np.arange(2000) + 0.5) / 2000
    half = (incident + scattered) / np.linalg.norm(incident + scattered)
    u = math.sqrt(math.acos(half[2]) * 2.0 / math.pi)
    v = (math.atan2(half[1], half[0]) + math.pi) / (2.0 * math.pi)
    along = bilinear(density, middle, np.full(2000, v))
    rows = means(density, middle)
    return u, v, float(along[middle < u].sum() / along.sum()), float(rows[middle < v].sum() / rows.sum())


def test_rgl_between_measured_incidences(tmp_path: Path) -> None:
    """As Mitsuba's `measured`: densities of visible normals are normalised; they and the values are linear in the angle."""
    rng = np.random.default_rng(6)
    single = np.float32
    first, second = rng.uniform(0.2, 2.0, (2, 5, 4))
    y, x = np.linspace(0, 1, 6)[:, None], np.linspace(0, 1, 7)
    low, high = 0.05 + 0.03 * x + 0.04 * y, 0.02 + 0.06 * x + 0.01 * y
    fields = {
        "phi_i": np.zeros(1, single),
        "theta_i": np.radians([0.0, 40.0]).astype(single),
        "ndf": np.ones((2, 2), single),
        "sigma": np.ones((2, 2), single),
        # Of another scale.
        "vndf": np.stack([first, 5.0 * second]).astype(single)[None],
        "spectra": np.stack([low, high]).astype(single)[None, :, None],
        "wavelengths": np.array([555.0], single),
        "jacobian": np.zeros(1, np.uint8),
    }
    path = tmp_path / "x.bsdf"
    path.write_bytes(tensors(fields))
    data = read_bsdf_data(path)
    assert [round(one.theta, 3) for one in data.slices] == [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0]
    one, part = data.slices[3], 15.0 / 40.0
    levels = [means(d, (np.arange(600) + 0.5) / 600).mean() for d in (first, second)]
    density = (1.0 - part) * first / levels[0] + part * second / levels[1]
    for s in (direction(20.0, 130.0), direction(65.0, 200.0), direction(40.0, 260.0)):
        _, _, left, below = warped(density, one.incident, s)
        known = [0.05 + 0.03 * left + 0.04 * below, 0.02 + 0.06 * left + 0.01 * below]
        expected = ((1.0 - part) * known[0] + part * known[1]) / s[2]
        assert float(one.at(s)) == pytest.approx(expected, rel=0.01)


def test_rgl_warp_against_a_quadrature(tmp_path: Path) -> None:
    """f cosθ = a + b x' + c y', x' and y' being the distribution functions of the density of visible normals.

    Both by midpoints over the bilinear density: nothing of the reader's sums is used.
    """
    rng = np.random.default_rng(5)
    density = rng.uniform(0.2, 2.0, (5, 4))
    y, x = np.linspace(0, 1, 6)[:, None], np.linspace(0, 1, 7)
    values, ndf, sigma = 0.05 + 0.03 * x + 0.04 * y, rng.uniform(1, 2, (3, 4)), rng.uniform(1, 2, (2, 5))
    path = tmp_path / "x.bsdf"
    path.write_bytes(rgl(vndf=density, values=values, ndf=ndf, sigma=sigma))
    data = read_bsdf_data(path)
    (one,) = (one for one in data.slices if abs(one.theta - 30.0) < 1e-3)
    for s in (direction(20.0, 130.0), direction(65.0, 200.0), direction(40.0, 260.0)):
        u, v, left, below = warped(density, one.incident, s)
        # Of the light: θ as on the axis of half angles, and the azimuth 0, which is the middle of the second.
        from_light = math.sqrt(math.radians(30.0) * 2.0 / math.pi)
        scale = bilinear(ndf, np.array(u), np.array(v)) / (4.0 * bilinear(sigma, np.array(from_light), np.array(0.5)))
        expected = (0.05 + 0.03 * left + 0.04 * below) * scale / s[2]
        assert float(one.at(s)) == pytest.approx(float(expected), rel=0.01)


@pytest.mark.parametrize("phis", [(-180.0, -120.0, -60.0, 0.0), (-180.0, -150.0, -120.0, -90.0)])
def test_rgl_samples_measured_over_a_part_of_the_turn(tmp_path: Path, phis: tuple[float, ...]) -> None:
    """f by Mitsuba's rule: light from y > 0 is turned by half a turn; of a quarter x and y each become negative.

    The density of visible normals is even, so that f cosθ is linear in the coordinates of the half vector.
    """
    single = np.float32
    u, v = np.linspace(0, 1, 4), np.linspace(0, 1, 4)[:, None]
    levels = 0.1 + 0.02 * np.cos(np.radians(2.0 * np.array(phis)))
    values = levels[:, None, None, None, None] + np.broadcast_to(0.03 * u + 0.04 * v, (4, 2, 1, 4, 4))
    path = tmp_path / "x.bsdf"
    even = np.ones((4, 2, 2, 2), single)
    path.write_bytes(
        tensors(
            {
                "phi_i": np.radians(phis).astype(single),
                "theta_i": np.radians([0.0, 40.0]).astype(single),
                "ndf": even[0, 0],
                "sigma": even[0, 0],
                "vndf": even,
                "spectra": values.astype(single),
                "wavelengths": np.array([555.0], single),
                "jacobian": np.zeros(1, np.uint8),
            }
        )
    )
    data = read_bsdf_data(path)
    assert not data.isotropic
    quarter = phis[-1] < 0.0
    oblique = {round(one.phi) % 360: one for one in data.slices if one.theta > 1.0}
    images = {round(-phi if quarter else phi + 180.0) % 360 for phi in phis} | {round(phi) % 360 for phi in phis}
    images |= {round(180.0 + sign * phi) % 360 for phi in phis for sign in ((1.0, -1.0) if quarter else ())}
    assert set(oblique) == images
    for phi, one in oblique.items():
        s = direction(25.0, phi + 100.0)
        i = one.incident
        if quarter:
            signs = np.array([-np.sign(i[0]) or 1.0, -np.sign(i[1]) or 1.0, 1.0])
            # On an axis either sign stands for the same: that of the measured azimuths is taken.
            signs = np.where(np.abs(i) < 1e-5, 1.0, signs)
        else:
            signs = np.array([-1.0, -1.0, 1.0]) if i[1] > 1e-5 else np.ones(3)
        i, s = signs * i, signs * s
        half = (i + s) / np.linalg.norm(i + s)
        x, y = math.sqrt(math.acos(half[2]) * 2.0 / math.pi), (math.atan2(half[1], half[0]) / math.pi + 1.0) / 2.0
        level = 0.1 + 0.02 * math.cos(2.0 * math.atan2(i[1], i[0]))
        assert float(one.at(signs * s)) == pytest.approx((level + 0.03 * x + 0.04 * y) / s[2], rel=5e-3)


def test_rgl_mistakes(tmp_path: Path) -> None:
    path = tmp_path / "x.bsdf"
    whole = rgl(vndf=np.ones((4, 4)), values=np.full((4, 4), 0.1))
    for old, new, said in (
        (b"sigma", b"sigmo", "'sigma'"),
        (b"tensor_file\0\1\0", b"tensor_file\0\2\0", "version"),
        (b"\x02\x00ndf", b"\x02\x00ndg", "ends within|beyond|no array|dimensions"),
    ):
        path.write_bytes(whole.replace(old, new))
        if old in whole:
            with pytest.raises(FormatError, match=said):
                read_bsdf_data(path)
    path.write_bytes(whole[:200])
    with pytest.raises(FormatError):
        read_bsdf_data(path)
    # More dimensions than any array has; an empty one beside one that no machine holds.
    path.write_bytes(
        tensors({"ndf": np.ones((1,) * 30, np.float32)}).replace(b"ndf\x1e\x00", b"ndf\x46\x00") + bytes(800)
    )
    with pytest.raises(FormatError):
        read_bsdf_data(path)
    path.write_bytes(
        b"tensor_file\0" + struct.pack("<2BIH", 1, 0, 1, 3) + b"ndf" + struct.pack("<HBQ3Q", 3, 10, 0, 0, 2**63, 2**63)
    )
    with pytest.raises(FormatError, match="3 dimensions"):
        read_bsdf_data(path)
