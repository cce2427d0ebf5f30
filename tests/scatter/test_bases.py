"""What of a table leaves with one distribution: found in known functions, and exact between incidences."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.bases import Base, base_of, share_in
from etendue.scatter.resampling import lobes_of

Array = npt.NDArray[np.float64]

END = math.cos(math.radians(80.0))
GRID = PolarGrid("normal", np.linspace(0.0, 89.0, 90), np.arange(72) * 5.0)


def ended(*, incident: Array, scattered: Array) -> Array:
    """A base that ends at 80°, more of it at grazing incidence, and a lobe that moves with the specular direction."""
    lobe = np.exp(-np.sum((incident + scattered)[..., :2] ** 2, axis=-1) / (2.0 * 0.2**2))
    return base_of_ended(incident=incident, scattered=scattered) + 0.25 * lobe


def base_of_ended(*, incident: Array, scattered: Array) -> Array:
    return 0.42 * np.sqrt(np.maximum(scattered[..., 2] - END, 0.0)) * (1.0 - 0.2 * incident[..., 2])


def share_of_the_base(theta: float) -> float:
    """∫ f cosθ dΩ = 2π ∫ f z dz by Gauss and Legendre, z = end + t²: another route than the table's."""
    x, w = np.polynomial.legendre.leggauss(200)
    t = 0.5 * (x + 1.0) * math.sqrt(1.0 - END)
    z = END + t * t
    inner = float(np.sum(w * 0.5 * math.sqrt(1.0 - END) * 0.42 * t * z * 2.0 * t))
    return 2.0 * math.pi * inner * (1.0 - 0.2 * math.cos(math.radians(theta)))


def slices(step: float, noise: float = 0.0) -> list[BsdfSlice]:
    random = np.random.default_rng(4)
    found = []
    for theta in np.arange(0.0, 85.1, step):
        incident = direction(theta, 180.0)
        f = ended(incident=incident, scattered=GRID.directions(incident, transmitted=False))
        found.append(BsdfSlice(incident, f * (1.0 + noise * random.standard_normal(f.shape)), grid=GRID))
    return found


def shares(table: et.BsdfTable) -> tuple[Array, Array]:
    """Angles of incidence [°], and what the base holds of the flux there, as the core is told."""
    rows = table._record["front"][0]["reflected"][0]["slices"]
    return np.degrees(np.arcsin([one["sine"] for one in rows])), np.array([one["base"] for one in rows])


@pytest.mark.slow
@pytest.mark.parametrize(("step", "noise", "least"), [(5.0, 0.0, 0.96), (20.0, 0.0, 0.96), (20.0, 0.05, 0.8)])
def test_all_of_a_base_is_found(step: float, noise: float, least: float) -> None:
    """A lobe in the way of a slice takes nothing from it. With noise of 5 % the lowest of thousands of values decides."""
    thetas, found = shares(et.BsdfTable(BsdfData(slices(step, noise))))
    known = np.array([share_of_the_base(theta) for theta in np.minimum(thetas, 80.0 if step > 5.0 else 85.0)])
    # Up to 70° the lobe leaves directions free of it.
    part = (found / known)[thetas < 70.0]
    assert part.min() > least
    assert part.max() < 1.02
    base = base_of(slices(step, noise))
    cosines = np.array([0.95, 0.7, 0.4, 0.25])
    right = np.sqrt(cosines - END)
    ratio = base.at(cosines) / right
    assert np.ptp(ratio) < (0.03 + 2.0 * noise) * ratio.mean()
    assert (base.at(np.array([0.0, 0.1, 0.15])) == 0.0).all()


@pytest.mark.slow
@pytest.mark.parametrize(("step", "bar"), [(5.0, 0.035), (20.0, 0.04)])
def test_a_base_stays_where_it_is_between_incidences(step: float, bar: float) -> None:
    """Moved with the specular direction it would be wrong by a tenth and by a third, root mean square. What is left is
    beside the end of the base, which a grid of 1° cannot show."""
    table = et.BsdfTable(BsdfData(slices(step)))
    random = np.random.default_rng(1)
    cosine, turn = np.sqrt(random.random(20_000)), 2.0 * np.pi * random.random(20_000)
    sine = np.sqrt(1.0 - cosine**2)
    scattered = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=-1)
    for theta in (9.0, 27.0, 33.0, 50.0, 65.0, 73.0):
        incident = direction(theta, 180.0)
        right = ended(incident=incident, scattered=scattered)
        off = (table.evaluate(incident, scattered) - right) / (right + 0.1 * right.mean())
        assert math.sqrt(np.mean(off**2)) < bar, theta


@pytest.mark.slow
@pytest.mark.parametrize("transmitted", [False, True])
def test_what_a_base_sends_out_is_drawn_by_it(transmitted: bool) -> None:
    """A table that is nothing but a base, reflected or transmitted: f at any angles, and the mean sin² of samples."""
    steps = np.array([1.0, 0.9, 0.7, 0.4, 0.1])
    law = Base(steps)
    made = []
    for theta in (0.0, 30.0, 60.0, 85.0):
        incident = direction(theta, 180.0)
        f = law.at(np.abs(GRID.directions(incident, transmitted=transmitted)[..., 2])) * (0.15 + 0.001 * theta)
        made.append(BsdfSlice(incident, f, grid=GRID, transmitted=transmitted))
    table = et.BsdfTable(BsdfData(made))
    sign = -1.0 if transmitted else 1.0
    scattered = direction(np.array([2.0, 33.0, 61.0, 85.0])[:, None], np.arange(0.0, 360.0, 50.0)) * [1.0, 1.0, sign]
    for theta in (0.0, 45.0, 60.0):
        f = table.evaluate(direction(theta, 77.0), scattered)
        assert f == pytest.approx(law.at(np.abs(scattered[..., 2])) * (0.15 + 0.001 * theta), rel=0.01)
    # Projected solid angle is even in s = sin²: <s> is that of l by closed quadrature.
    s = (np.arange(100_000) + 0.5) / 100_000
    leaving = law.at(np.sqrt(1.0 - s)) / law.at(np.sqrt(1.0 - s)).sum()
    mean = float(s @ leaving)
    spread = math.sqrt(float(s**2 @ leaving) - mean**2)
    drawn = table.sample(direction(40.0, 10.0), 400_000, seed=5)
    drawn = drawn[~np.isnan(drawn[:, 0])]
    found = np.sum(drawn[:, :2] ** 2, axis=-1)
    # Two-sided, 1 in 10⁴, beside what 1° steps of the grid and l between cosines are off.
    assert abs(found.mean() - mean) < 3.9 * spread / math.sqrt(found.size) + 5e-4
    assert (drawn[:, 2] * sign > 0.0).all()


def test_a_lobe_at_one_incidence_is_no_base() -> None:
    """Nobody can tell whether it moves; it does, as lobes of most surfaces do."""
    incident = direction(0.0, 0.0)
    scattered = GRID.directions(incident, transmitted=False)
    lobe = np.exp(-np.sum((incident + scattered)[..., :2] ** 2, axis=-1) / (2.0 * 0.2**2))
    table = et.BsdfTable(BsdfData([BsdfSlice(incident, lobe, grid=GRID)]))
    f = table.evaluate(direction(40.0, 180.0), direction([0.0, 40.0], 0.0))
    assert f[0] < 0.1 * f[1]


def test_a_share_in_a_base_is_nowhere_too_much() -> None:
    """It is as much where it touches f; and one that is hardly anything is none."""
    leaving = np.array([1.5, 1.0, 0.5, 0.0, 1.0])
    f = np.array([0.6, 0.2, 0.075, 0.0, np.nan]) / np.pi
    assert share_in(f, leaving, 0.3) == pytest.approx(0.15)
    assert share_in(np.append(f[:1], [0.0] * 4), leaving, 0.3) == 0.0


@pytest.mark.slow
def test_beyond_the_horizon_is_nothing_brighter_than_what_is_known() -> None:
    """f goes on there in proportion to the slice before; at grazing incidence it rises with every slice, and what is left
    beside a base may rise from hardly anything."""
    metal = et.bsdf.RoughMetal(roughness=0.35, reflectance=0.6)
    found = []
    for theta in np.arange(0.0, 86.0, 5.0):
        incident = direction(theta, 180.0)
        scattered = GRID.directions(incident, transmitted=False)
        f = np.asarray(metal.evaluate(incident, scattered)) + 0.1 * scattered[..., 2] * (
            0.2 + np.abs(scattered[..., 1])
        )
        found.append(BsdfSlice(incident, f, grid=GRID))
    lobes = lobes_of(found, [one.integral() for one in found], isotropic=True, mirrored=False, base=base_of(found))[0.0]
    assert max(lobe.base for lobe in lobes) > 0.02
    for one, lobe in zip(found, lobes, strict=False):
        assert lobe.f.max() <= one.values.max() * (1.0 + 1e-9)
