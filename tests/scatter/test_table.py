"""Tables of scatter against known functions: shares, values in between, samples, and light through scenes both ways."""

from __future__ import annotations

import math
import pickle

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.resampling import ACCURACY, lobes_of
from oracles.both_ways import forwards_and_backwards_agree, two_walls
from scipy.stats import chi2

Array = npt.NDArray[np.float64]

FLOOR, LOBE, SIGMA = 0.3, 0.4, 0.15
"""The known BRDF of the bar: a Lambertian floor and a Gaussian in direction cosines."""


def known(*, incident: Array, scattered: Array) -> Array:
    off = incident[..., :2] + scattered[..., :2]
    peak = LOBE / (2.0 * math.pi * SIGMA**2)
    return FLOOR / math.pi + peak * np.exp(-0.5 * np.sum(off * off, axis=-1) / SIGMA**2)


def slanted(*, incident: Array, scattered: Array) -> Array:
    """No symmetry at all: more light to one side of the plane of incidence, and another lobe there than back."""
    theta = np.arccos(np.abs(incident[..., 2]))
    sideways = (incident[..., 0] * scattered[..., 1] - incident[..., 1] * scattered[..., 0]) / np.sin(theta)
    return known(incident=incident, scattered=scattered) * (0.6 + 0.3 * np.sin(2.0 * theta)) * (1.0 + 0.5 * sideways)


def quadrature(function: object, theta: float) -> float:
    """∫ f cosθ dΩ by Gauss and Legendre over the disk of direction cosines: another route than the table's."""
    x, w = np.polynomial.legendre.leggauss(300)
    r, a = 0.5 * (x + 1.0), np.arange(720) * (2.0 * math.pi / 720)
    beta = np.stack([r[:, None] * np.cos(a), r[:, None] * np.sin(a)], axis=-1)
    scattered = np.concatenate([beta, np.sqrt(1.0 - r * r)[:, None, None] * np.ones((1, a.size, 1))], axis=-1)
    f = function(incident=direction(theta, 30.0), scattered=scattered)  # type: ignore[operator]
    return float(np.sum(f.mean(axis=1) * 2.0 * math.pi * r * 0.5 * w))


def table_of(function: object, *, thetas: Array, mirrored: bool = True) -> et.BsdfTable:
    """56 × 56 = 3 136 points for each incidence, as a goniometer lays them out."""
    slices = []
    for theta in thetas:
        incident = direction(theta, 30.0)
        grid = PolarGrid("normal", np.linspace(0.0, 89.9, 56), np.arange(56) * (360.0 / 56))
        f = function(incident=incident, scattered=grid.directions(incident, transmitted=False))  # type: ignore[operator]
        slices.append(BsdfSlice(incident, f, grid=grid))
    return et.BsdfTable(BsdfData(slices, mirrored=mirrored))


SIX = np.linspace(0.0, 75.0, 6)


@pytest.fixture(scope="module")
def table() -> et.BsdfTable:
    return table_of(known, thetas=SIX)


def test_a_single_azimuth_stands_for_all() -> None:
    """A/(B + r²) in 400 steps about the specular direction at 60°: its share by midpoints of the disk, at any azimuth.

    Forwards the hemisphere ends at r = 0.134, backwards at 1.866.
    """
    sine = math.sin(math.radians(60.0))
    side = (np.arange(1000) + 0.5) / 500.0 - 1.0
    x, y = np.meshgrid(side, side)
    f = 0.01 / (0.05 + (x - sine) ** 2 + y**2)
    share = float(f[x * x + y * y < 1.0].sum()) / 500.0**2
    for azimuth in (0.0, 90.0, 180.0):
        grid = PolarGrid("cosines", np.linspace(0.0, 2.0, 401), np.array([azimuth]))
        values = 0.01 / (0.05 + grid.radial**2)
        one = BsdfSlice(np.array([-sine, 0.0, 0.5]), values[None], grid=grid)
        assert one.integral() == pytest.approx(share, rel=1e-3)
        assert float(one.at([-0.5, 0.0, math.sqrt(0.75)])) == pytest.approx(0.01 / (0.05 + (0.5 + sine) ** 2), rel=1e-3)


@pytest.mark.slow
def test_shares_of_a_known_brdf(table: et.BsdfTable) -> None:
    """pabopto2bsdf and bsdf2klems: up to 4 % off in between, 38 % at 82.5°."""
    thetas = np.append(np.arange(0.0, 70.1, 2.5), [66.5, 82.5])
    truth = np.array([quadrature(known, theta) for theta in thetas])
    off = np.abs(table.reflectance(thetas) / truth - 1.0)
    assert np.max(off[thetas <= 70.0]) < 0.004
    assert off[-1] < 0.006


def test_between_the_incidences_the_lobe_moves(table: et.BsdfTable) -> None:
    for theta, bar in ((7.0, 0.02), (22.0, 0.02), (52.0, 0.05), (67.0, 0.08)):
        incident = direction(theta, 200.0)
        scattered = direction(np.linspace(0.0, 80.0, 33)[:, None], np.arange(0.0, 360.0, 10.0))
        expected = known(incident=incident, scattered=scattered)
        off = np.abs(table.evaluate(incident, scattered) - expected).max() / expected.max()
        assert off < bar, theta


@pytest.mark.slow
def test_a_table_without_symmetry_keeps_its_handedness() -> None:
    table = table_of(slanted, thetas=np.linspace(5.0, 75.0, 8), mirrored=False)
    incident = direction(40.0, 200.0)
    scattered = direction(np.array([20.0, 50.0, 70.0])[:, None], np.arange(0.0, 360.0, 15.0))
    right = slanted(incident=incident, scattered=scattered)
    found = table.evaluate(incident, scattered)
    assert np.abs(found - right).max() < 0.03 * right.max()
    # The other way round, and mirrored, it is another function, which this test would see.
    mirror = np.array([1.0, -1.0, 1.0])
    for wrong in (
        slanted(incident=scattered, scattered=np.broadcast_to(incident, scattered.shape)),
        slanted(incident=incident * mirror, scattered=scattered * mirror)[:, ::-1],
    ):
        assert np.abs(found - wrong).max() > 0.06 * right.max()


def holed(*, f: float | None = None, beyond: float = 2.0) -> et.BsdfTable:
    """R = 0.6 and a narrow lobe that does not change with the incidence; of the slice at 40° one value is `f`, and there is
    nothing farther than `beyond` from the specular direction in direction cosines."""
    grid = PolarGrid("normal", np.arange(0.0, 90.0, 2.0), np.arange(0.0, 360.0, 5.0))
    slices = []
    for theta in (0.0, 20.0, 40.0, 60.0):
        incident = light_from(theta, 180.0)
        scattered = grid.directions(incident, transmitted=False)
        off = np.linalg.norm(incident[:2] + scattered[..., :2], axis=-1)
        values = 0.6 / math.pi + 5.0 * np.exp(-0.5 * (off / 0.06) ** 2)
        if theta == 40.0:
            values[off > beyond] = 0.0
            values[50, 30] = values[50, 30] if f is None else f
        slices.append(BsdfSlice(incident, values, grid=grid))
    return et.BsdfTable(BsdfData(slices, mirrored=False))


@pytest.mark.slow
@pytest.mark.parametrize("part", [0.0, 0.5])
def test_one_low_value_changes_f_there_alone(part: float) -> None:
    """Elsewhere f is what it is of the same table without it: to what f is linear within where f is known, and to a quarter
    of what the whole table is off between incidences, at the skirts of the lobe.
    """
    whole, table = holed(), holed(f=part * 0.6 / math.pi)
    one = table.data.slices[2]
    hole = one.incident[:2] + one.directions[50, 30, :2]
    around = direction(np.arange(0.0, 90.0, 4.0)[:, None], np.arange(-80.0, 180.0, 20.0)).reshape(-1, 3)
    for theta in (20.0, 30.0, 35.0, 40.0, 45.0, 50.0, 60.0):
        incident = direction(theta, 180.0)
        peak = incident * [-1.0, -1.0, 1.0]
        at = np.append(around[np.linalg.norm(incident[:2] + around[:, :2] - hole, axis=1) > 0.1], [peak], axis=0)
        off = np.abs(table.evaluate(incident, at) / whole.evaluate(incident, at) - 1.0)
        lobe = np.exp(-0.5 * np.sum((incident + at)[:, :2] ** 2, axis=-1) / 0.06**2)
        itself = np.abs(whole.evaluate(incident, at) / (0.6 / math.pi + 5.0 * lobe) - 1.0)
        assert off.max() < (ACCURACY if theta in (20.0, 40.0, 60.0) else 0.25 * itself.max()), theta
    assert float(table.reflectance(40.0)) == pytest.approx(one.integral(), rel=1e-6)


def test_a_slice_without_a_diffuse_part_has_neighbours_without() -> None:
    """0.6 is Lambertian at 0°, 20° and 60°; at 40° all lies within a cone, and then no base is taken out of any."""
    slices = holed(beyond=0.3).data.slices
    lobes = lobes_of(slices, [one.integral() for one in slices], isotropic=True, mirrored=False)[0.0]
    assert [lobe.base for lobe in lobes] == [0.0] * 5


@pytest.mark.slow
@pytest.mark.parametrize("wide", [10.0, 30.0, 72.0, 150.0])
def test_a_hole_in_a_slice_stays_a_hole(wide: float) -> None:
    """R = 0.4 and a lobe that moves with the incidence; at 40° a sector about the light is dark. Between incidences f is the
    known function outside the sector, and goes linearly to nothing within it."""
    floor, peak = 0.4 / math.pi, 3.0

    def known(*, incident: Array, scattered: Array) -> Array:
        off = incident[..., :2] + scattered[..., :2]
        return floor + peak * np.exp(-0.5 * np.sum(off * off, axis=-1) / SIGMA**2)

    grid = PolarGrid("normal", np.linspace(0.0, 89.9, 91), np.arange(72) * 5.0)
    slices = []
    for theta in (20.0, 40.0, 60.0):
        incident = direction(theta, 180.0)
        scattered = grid.directions(incident, transmitted=False)
        values = known(incident=incident, scattered=scattered)
        back = np.degrees(np.arctan2(scattered[..., 1], -scattered[..., 0]))
        values[(np.abs(back) < 0.5 * wide) & (theta == 40.0)] = 0.0
        slices.append(BsdfSlice(incident, values, grid=grid))
    table = et.BsdfTable(BsdfData(slices))
    for theta, part in ((25.0, 0.25), (30.0, 0.5), (45.0, 0.75), (50.0, 0.5)):
        incident = direction(theta, 180.0)
        bright = np.stack([direction(theta, 0.0), direction(50.0, 30.0), direction(60.0, 90.0)])
        right = known(incident=incident, scattered=bright)
        # Energy is cubic in the squared sine between the incidences, and f linear: a few per cent of a hole's light.
        assert table.evaluate(incident, bright) == pytest.approx(right, rel=0.06), theta
        dark = table.evaluate(incident, direction(60.0, 180.0)[None])[0]
        assert dark == pytest.approx((1.0 - part) * floor, rel=0.15), theta


def test_samples_have_the_share_and_the_density(table: et.BsdfTable) -> None:
    n, incident = 200_000, direction(52.0, 100.0)
    drawn = table.sample(incident, n, seed=5)
    gone = np.isnan(drawn[:, 0])
    share = float(table.reflectance(52.0))
    assert abs((~gone).sum() - n * share) < 4.0 * math.sqrt(n * share * (1.0 - share))
    # Cells of equal area in direction cosines: expected numbers from the known function by points within.
    beta = drawn[~gone, :2]
    cells = 12
    counts, _, _ = np.histogram2d(beta[:, 0], beta[:, 1], bins=cells, range=[[-1, 1]] * 2)
    fine = 40
    x = (np.arange(cells * fine) + 0.5) * 2.0 / (cells * fine) - 1.0
    gx, gy = np.meshgrid(x, x, indexing="ij")
    inside = gx**2 + gy**2 < 1.0
    scattered = np.stack([gx, gy, np.sqrt(np.where(inside, 1.0 - gx**2 - gy**2, 1.0))], axis=-1)
    f = np.zeros(gx.shape)
    f[inside] = table.evaluate(incident, scattered[inside])
    expected = n * f.reshape(cells, fine, cells, fine).sum(axis=(1, 3)) * (2.0 / (cells * fine)) ** 2
    enough = expected > 30.0
    statistic = float(np.sum((counts[enough] - expected[enough]) ** 2 / expected[enough]))
    assert statistic < chi2.ppf(1.0 - 1e-4, enough.sum())


def test_what_radiates_more_than_it_receives_is_refused_with_the_angle() -> None:
    grid = PolarGrid("normal", np.array([0.0, 90.0]), np.array([0.0]))
    bright = BsdfSlice(direction(35.0, 0.0), np.full((1, 2), 1.1 / math.pi), grid=grid)
    table = et.BsdfTable
    with pytest.raises(ArgumentError, match=r"at 35° of incidence the table reflects 1\.1 "):
        table(BsdfData([bright]))
    slightly = BsdfSlice(direction(35.0, 0.0), np.full((1, 2), 1.005 / math.pi), grid=grid)
    told = table(BsdfData([slightly]))
    assert "1.005" in str(told.complaints[0])
    assert float(told.reflectance(35.0)) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("share", [0.5, 0.95])
def test_a_single_incidence_stands_for_all_with_its_share(share: float) -> None:
    """A round Gaussian of σ = 0.15 at 60° alone, a fifth of which is cut by the horizon: at 0° it is share / (2π σ²) at its
    peak, and round; at 75° what the horizon leaves of it has the same share, and f grows as the quadratures of both say."""

    def lobe(*, incident: Array, scattered: Array) -> Array:
        off = incident[..., :2] + scattered[..., :2]
        return np.exp(-0.5 * np.sum(off * off, axis=-1) / SIGMA**2)

    grid = PolarGrid("cosines", np.append(0.0, np.geomspace(0.005, 2.0, 120)), np.array([0.0]))
    values = share / quadrature(lobe, 60.0) * np.exp(-0.5 * (grid.radial / SIGMA) ** 2)
    table = et.BsdfTable(BsdfData([BsdfSlice(direction(60.0, 180.0), values[None], grid=grid)]))
    assert table.reflectance([0.0, 10.0, 40.0, 60.0, 75.0, 89.0]) == pytest.approx(share, rel=2e-3)
    mirrored = direction(75.0, 0.0)
    assert float(table.evaluate(direction(75.0, 180.0), mirrored)) == pytest.approx(
        share / quadrature(lobe, 75.0), rel=0.01
    )
    off = np.array([0.0, 0.1, 0.2, 0.3])
    peak = share / (2.0 * math.pi * SIGMA**2)
    for azimuth in (0.0, 70.0, 180.0):
        f = table.evaluate([0, 0, 1], direction(np.degrees(np.arcsin(off)), azimuth))
        assert f == pytest.approx(peak * np.exp(-0.5 * (off / SIGMA) ** 2), rel=0.02)


def even(share: float, *, way: bool, wavelength: float | None = None, theta: float = 30.0) -> BsdfSlice:
    """A Lambertian slice, transmitted if `way`."""
    grid = PolarGrid("normal", np.array([0.0, 90.0]), np.array([0.0]))
    return BsdfSlice(direction(theta, 0.0), np.full((1, 2), share / math.pi), way, grid=grid, wavelength=wavelength)


MIRROR = {"kind": "mirror", "reflectance": {"angle": [0.0, 30.0, 90.0], "values": [0.2, 0.6, 0.2]}}


def test_both_ways_and_components_together_leave_no_more_than_arrives() -> None:
    """The sums are 0.7 + 0.7, 0.7 at 450 nm + 0.5, 0.7 + 0.6 of a mirror, and 0.98 + 0.103 of two components."""
    both = [even(0.7, way=False), even(0.7, way=True)]
    coloured = [even(0.7, way=False, wavelength=450.0), even(0.4, way=False, wavelength=650.0), even(0.5, way=True)]
    lambertian = {"kind": "lambertian", "reflectance": 0.98}
    for data, told in (
        (BsdfData(both), "at 30° of incidence 1.4 "),
        (BsdfData(coloured), "at 30° of incidence, 450 nm 1.2 "),
        (BsdfData(both[:1], (MIRROR,)), "at 30° of incidence 1.3 "),
        (BsdfData((), (lambertian, {"kind": "mirror", "reflectance": 0.103})), "at 0° of incidence 1.083 "),
    ):
        with pytest.raises(ArgumentError, match=told):
            et.BsdfTable(data)
    # Each side for itself: light that meets the front is reflected, light that meets the back goes through.
    grid = both[1].grid
    behind = BsdfSlice(direction(30.0, 0.0, behind=True), both[1].values, True, grid=grid)
    table = et.BsdfTable(BsdfData([both[0], behind], both_sides=False))
    assert table.complaints == ()
    assert table.reflectance(30.0) == pytest.approx(0.7)
    assert table.transmittance(30.0, side="back") == pytest.approx(0.7)


def test_what_leaves_beyond_all_of_the_light_by_little_is_scaled_and_told() -> None:
    """0.606 + 0.4 is scaled by 1/1.006 at 30° alone; beside 0.6 of a mirror there is room for 0.4 of 0.405."""
    slices = [even(0.6, way=False, theta=60.0), even(0.606, way=False), even(0.4, way=True)]
    table = et.BsdfTable(BsdfData(slices))
    assert [str(one) for one in table.complaints] == [
        "warning: 30° of incidence: 1.006 of the light leaves in all; scaled to 1"
    ]
    assert table.reflectance([30.0, 60.0]) == pytest.approx([0.606 / 1.006, 0.6], abs=1e-9)
    assert table.transmittance(30.0) == pytest.approx(0.4 / 1.006, abs=1e-9)
    # Backwards as forwards.
    assert table.evaluate(direction(30.0, 0.0), [0, 0, -1]) == pytest.approx(0.4 / 1.006 / math.pi, abs=1e-9)
    mirrored = et.BsdfTable(BsdfData([even(0.405, way=False)], (MIRROR,)))
    assert "1.005" in str(mirrored.complaints[0])
    assert mirrored.regular_reflectance(30.0) == pytest.approx(0.6, abs=1e-9)
    assert mirrored.reflectance(30.0) == pytest.approx(1.0, abs=1e-9)


def test_components_and_what_lies_between_incidences_are_scaled_as_a_whole() -> None:
    """A mirror and a Lambertian, together 1.008 at 33.3°; slices at 0° and 60° with a mirror that is 0.005 more at 30°."""
    bent = {"kind": "lambertian", "reflectance": {"angle": [0.0, 33.3, 90.0], "values": [0.1, 0.408, 0.1]}}
    components = et.BsdfTable(BsdfData((), ({"kind": "mirror", "reflectance": 0.6}, bent)))
    assert "1.008" in str(components.complaints[0])
    assert components.reflectance([0.0, 33.3]) == pytest.approx([0.7 / 1.008, 1.0], abs=1e-9)
    hump = {"kind": "mirror", "reflectance": {"angle": [0.0, 30.0, 60.0], "values": [0.5, 0.505, 0.5]}}
    table = et.BsdfTable(BsdfData([even(0.5, way=False, theta=theta) for theta in (0.0, 60.0)], (hump,)))
    assert "30° of incidence: 1.005 of the light leaves in all; everything is scaled" in str(table.complaints[0])
    assert table.reflectance([0.0, 30.0]) == pytest.approx([1.0 / 1.005, 1.0], abs=1e-6)
    assert pickle.loads(pickle.dumps(table)).reflectance(30.0) == table.reflectance(30.0)  # noqa: S301 - our own


def test_each_way_is_linear_between_its_own_wavelengths() -> None:
    """np.interp of the shares that were put in, constant beyond them; a way without a wavelength is the same at all."""
    back, through = {450.0: 0.2, 650.0: 0.1}, {500.0: 0.1, 600.0: 0.5}
    coloured = [even(share, way=False, wavelength=at, theta=0.0) for at, share in back.items()]
    asked = (400.0, 450.0, 500.0, 525.0, 550.0, 600.0, 650.0, 700.0)
    other = [even(share, way=True, wavelength=at, theta=0.0) for at, share in through.items()]
    table, plain = (et.BsdfTable(BsdfData(coloured + more)) for more in (other, [even(0.25, way=True, theta=0.0)]))
    for at in asked:
        r, t = (np.interp(at, [*way], [*way.values()]) for way in (back, through))
        assert table.reflectance(30.0, wavelength=at) == pytest.approx(r, abs=1e-9)
        assert table.transmittance(30.0, wavelength=at) == pytest.approx(t, abs=1e-9)
        assert plain.reflectance(30.0, wavelength=at) == pytest.approx(r, abs=1e-9)
        assert plain.transmittance(30.0, wavelength=at) == pytest.approx(0.25, abs=1e-9)
        assert plain.evaluate([0, 0, 1], [0, 0, -1], wavelength=at) == pytest.approx(0.25 / math.pi, abs=1e-9)


def test_a_slice_without_a_wavelength_holds_where_no_other_is_stated() -> None:
    """0.4 at 10° for all; at 60° 0.2 at 450 nm and 0.6 at 650 nm."""
    slices = [even(0.4, way=False, theta=10.0)]
    slices += [even(share, way=False, wavelength=at, theta=60.0) for at, share in ((450.0, 0.2), (650.0, 0.6))]
    table = et.BsdfTable(BsdfData(slices))
    for at, share in ((450.0, 0.2), (550.0, 0.4), (650.0, 0.6)):
        assert table.reflectance([10.0, 60.0], wavelength=at) == pytest.approx([0.4, share], abs=1e-9)


def test_tables_pickle(table: et.BsdfTable) -> None:
    again = pickle.loads(pickle.dumps(table))  # noqa: S301 - our own
    assert again.reflectance(33.0) == table.reflectance(33.0)


@pytest.mark.slow
def test_anisotropic_tables_turn_with_the_sample() -> None:
    """A lobe that is wide along x: light from x and from y sees two different lobes."""

    def brushed(*, incident: Array, scattered: Array) -> Array:
        off = incident[..., :2] + scattered[..., :2]
        return 2.0 * np.exp(-0.5 * ((off[..., 0] / 0.3) ** 2 + (off[..., 1] / 0.08) ** 2))

    grid = PolarGrid("cosines", np.concatenate([[0.0], np.geomspace(0.01, 2.0, 80)]), np.arange(0.0, 360.0, 5.0))
    slices = []
    for theta in (0.0, 20.0, 40.0, 60.0):
        for phi in (0.0,) if theta == 0.0 else np.arange(0.0, 360.0, 30.0):
            incident = direction(theta, phi)
            d = grid.directions(incident, transmitted=False)
            slices.append(BsdfSlice(incident, brushed(incident=incident, scattered=d), grid=grid))
    table = et.BsdfTable(BsdfData(slices, isotropic=False, mirrored=False))
    scattered = direction(np.array([10.0, 30.0, 50.0])[:, None], np.arange(0.0, 360.0, 20.0))
    for theta, phi in ((0.0, 0.0), (20.0, 45.0), (40.0, 90.0), (40.0, 105.0)):
        incident = direction(theta, phi)
        expected = brushed(incident=incident, scattered=scattered)
        assert np.abs(table.evaluate(incident, scattered) - expected).max() < 0.35, (theta, phi)


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.25, 0.08])
def test_light_forwards_and_backwards_is_the_same(width: float) -> None:
    """A table without symmetry, whose light image and lines of sight must agree."""

    def skewed(*, incident: Array, scattered: Array) -> Array:
        off = incident[..., :2] + scattered[..., :2]
        lobe = 0.5 / (2.0 * math.pi * width**2) * np.exp(-0.5 * np.sum(off * off, axis=-1) / width**2)
        return (0.2 / math.pi + lobe) * (1.0 + 0.3 * scattered[..., 0] - 0.2 * scattered[..., 1]) * 0.8

    grid = PolarGrid("cosines", np.concatenate([[0.0], np.geomspace(0.01, 2.0, 40)]), np.arange(0.0, 360.0, 10.0))
    slices = []
    for theta in (0.0, 35.0, 70.0):
        for phi in (0.0,) if theta == 0.0 else np.arange(0.0, 360.0, 45.0):
            incident = direction(theta, phi)
            d = grid.directions(incident, transmitted=False)
            slices.append(BsdfSlice(incident, skewed(incident=incident, scattered=d), grid=grid))
    table = et.BsdfTable(BsdfData(slices, isotropic=False, mirrored=False))
    walls = two_walls({"kind": "bsdf", "bsdf": table, "axis": [0.3, 1.0, 0.2]})
    forwards_and_backwards_agree(surfaces=walls, rays=600_000 if width < 0.1 else 200_000, lines=9000)


def test_noise_below_nothing_is_told() -> None:
    """One half of the hemisphere at 3, the other at −1: the share is that of their mean, and f two thirds of what it was."""
    grid = PolarGrid("normal", np.array([0.0, 90.0]), np.array([0.0, 179.999, 180.0, 359.999]))
    values = 0.1 * np.array([[3.0, 3.0], [3.0, 3.0], [-1.0, -1.0], [-1.0, -1.0]])

    def table(f: npt.NDArray[np.float64]) -> et.BsdfTable:
        return et.BsdfTable(BsdfData([BsdfSlice(direction(0.0, 0.0), f, grid=grid)], isotropic=True, mirrored=False))

    noisy = table(values)
    assert float(noisy.reflectance(0.0)) == pytest.approx(0.1 * math.pi, rel=1e-3)
    (told,) = map(str, noisy.complaints)
    assert (
        told
        == "warning: 0° of incidence: values below 0 become 0, and the others are scaled by 0.667 to the same share"
    )
    # Less than nothing in all is nothing.
    black = table(-values)
    assert float(black.reflectance(0.0)) == 0.0
    assert "values add up to -0.3142 of the light: nothing is scattered" in str(black.complaints[0])
    assert not table(np.abs(values)).complaints
