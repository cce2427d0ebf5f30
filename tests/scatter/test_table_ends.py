"""Tables of scatter below their first and beyond their last incidence."""

from __future__ import annotations

from collections.abc import Callable

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import UnknownNameError
from etendue.formats.bsdf.functions import sampled
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.appearance import appearance

Array = npt.NDArray[np.float64]


def lobed(theta: float, share: float, *, way: bool = False) -> BsdfSlice:
    """A slice of a round Gaussian of σ = 0.3 in direction cosines that scatters this share."""
    grid = PolarGrid("cosines", np.append(0.0, np.geomspace(0.01, 2.0, 60)), np.array([0.0]))
    incident = direction(theta, 180.0)
    one = BsdfSlice(incident, np.exp(-0.5 * (grid.radial / 0.3) ** 2)[None], way, grid=grid)
    return BsdfSlice(incident, one.values * share / one.integral(), way, grid=grid)


@pytest.mark.parametrize(
    ("angles", "shares", "beyond"),
    [
        # Of a parabola in sin²θ what is tangent to it at the last incidence.
        ((0.0, 30.0, 45.0, 60.0), lambda x: 0.3 + 0.4 * x - 0.1 * x**2, lambda x: 0.54375 + 0.25 * (x - 0.75)),
        ((0.0, 60.0, 80.0), lambda x: 0.9 - 0.5 * x, lambda x: 0.9 - 0.5 * x),
        # Just all of it.
        ((30.0, 60.0), lambda x: x, lambda x: x),
    ],
)
def test_beyond_the_last_incidence_the_share_goes_on(
    angles: tuple[float, ...], shares: Callable[[Array], Array], beyond: Callable[[Array], Array]
) -> None:
    table = et.BsdfTable(BsdfData([lobed(theta, float(shares(np.sin(np.radians(theta)) ** 2))) for theta in angles]))
    thetas = np.linspace(angles[-1], 89.0, 7)
    assert table.reflectance(thetas) == pytest.approx(beyond(np.sin(np.radians(thetas)) ** 2), abs=2e-3)


@pytest.mark.slow
def test_a_gloss_paint_known_to_75_degrees_reflects_as_it_does_to_grazing_light() -> None:
    """The share of the model is a quadrature of the core; the lobe that stays as it is lost a tenth at the horizon."""
    paint = et.bsdf.RoughCoat(roughness=0.1, index=1.575, base_reflectance=0.99)
    slices = sampled(paint.evaluate, [(theta, 180.0) for theta in (5.0, 25.0, 45.0, 60.0, 75.0)])
    thetas = np.array([76.0, 80.0, 85.0, 89.0])
    found = et.BsdfTable(BsdfData(slices)).reflectance(thetas)
    assert found == pytest.approx(np.asarray(paint.reflectance(thetas)), rel=0.01)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_beyond_the_last_incidence_the_share_changes_by_no_more_than_before(sign: float) -> None:
    """From 45° to 50° by 0.04, which is 0.2 over the rest of sin²θ."""
    table = et.BsdfTable(BsdfData([lobed(45.0, 0.5), lobed(50.0, 0.5 + sign * 0.04)]))
    assert float(table.reflectance(89.99)) == pytest.approx(0.5 + sign * 0.08, abs=1e-4)


def test_what_would_rise_above_all_of_the_light_rises_to_it() -> None:
    table = et.BsdfTable(BsdfData([lobed(theta, share) for theta, share in ((0.0, 0.2), (60.0, 0.95))]))
    shares = np.asarray(table.reflectance(np.linspace(60.0, 89.99, 40)))
    assert np.diff(shares).min() >= -1e-9
    assert shares[-1] == pytest.approx(1.0, abs=1e-5)
    assert shares.max() <= 1.0


def test_both_ways_leave_no_more_than_all_grazing_light() -> None:
    """0.6 and 0.3 rose from 45° to 60°; what is reflected goes on to 2/3, what is transmitted rises no further."""
    slices = [
        lobed(theta, share, way=way)
        for theta, shares in ((45.0, (0.4, 0.2)), (60.0, (0.6, 0.3)))
        for way, share in zip((False, True), shares, strict=True)
    ]
    table = et.BsdfTable(BsdfData(slices))
    assert float(table.reflectance(89.99)) == pytest.approx(2.0 / 3.0, abs=1e-4)
    assert float(table.transmittance(89.99)) == pytest.approx(0.3, abs=1e-4)
    thetas = np.linspace(60.0, 89.99, 40)
    assert (np.asarray(table.reflectance(thetas)) + np.asarray(table.transmittance(thetas))).max() <= 1.0


@pytest.mark.slow
def test_beside_a_smooth_surface_a_lobe_has_the_same_part_of_what_enters() -> None:
    """A gloss paint: Fresnel's reflectance F of glass, and a lobe of 0.8 (1 − F), known to 60° and right beyond."""
    thetas = np.linspace(0.0, 90.0, 46)

    def fresnel(theta: npt.ArrayLike) -> Array:
        c = np.cos(np.radians(theta))
        g = np.sqrt(1.5**2 - 1.0 + c * c)
        return 0.5 * (((c - g) / (c + g)) ** 2 + ((2.25 * c - g) / (2.25 * c + g)) ** 2)

    mirror = {"kind": "mirror", "reflectance": {"angle": thetas.tolist(), "values": fresnel(thetas).tolist()}}
    slices = [lobed(theta, float(0.8 * (1.0 - fresnel(theta)))) for theta in (0.0, 20.0, 40.0, 60.0)]
    table = et.BsdfTable(BsdfData(slices, components=(mirror,)))
    assert not table.complaints
    at = np.array([60.0, 70.0, 80.0, 84.0])
    assert table.reflectance(at) == pytest.approx(0.8 + 0.2 * fresnel(at), rel=0.01)
    # Of white paint nothing is left over, and what would be more than all is not there.
    white = [lobed(theta, float(0.95 * (1.0 - fresnel(theta)))) for theta in (0.0, 20.0, 40.0, 60.0)]
    table = et.BsdfTable(BsdfData(white, components=(mirror,)))
    assert not table.complaints
    assert np.max(table.reflectance(np.arange(60.0, 90.0, 0.25))) == pytest.approx(1.0, abs=1e-3)


def test_an_isotropic_table_knows_no_azimuth_at_the_normal() -> None:
    """Of light from 45° a sector about where it comes from is dark; along the normal f is the mean over the azimuths."""
    grid = PolarGrid("cosines", np.append(0.0, np.geomspace(0.01, 2.0, 60)), np.arange(0.0, 360.0, 10.0))
    values = np.where(np.abs(grid.azimuth - 180.0)[:, None] <= 60.0, 0.0, 1.0) * np.exp(-(grid.radial**2))
    table = et.BsdfTable(BsdfData([BsdfSlice(direction(45.0, 180.0), 0.2 * values, grid=grid)]))
    f = table.evaluate([0.0, 0.0, 1.0], direction(30.0, np.arange(0.0, 360.0, 15.0)))
    assert f.min() > 0.0
    assert f == pytest.approx(np.full(24, f.mean()), rel=1e-9)


@pytest.mark.slow
def test_what_is_extrapolated_is_told_and_has_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Known to 60° from the front, to 75° from the back: gloss at 85° is beyond both."""
    monkeypatch.setattr("etendue.scatter.appearance.DRAWS", 2)
    front, back = ([lobed(theta, 0.5) for theta in thetas] for thetas in ((0.0, 30.0, 60.0), (0.0, 40.0, 75.0)))
    behind = [
        BsdfSlice(one.incident * [1.0, 1.0, -1.0], one.values, grid=one.grid, standard_error=0.1 * one.values)
        for one in back
    ]
    ahead = [BsdfSlice(one.incident, one.values, grid=one.grid, standard_error=0.1 * one.values) for one in front]
    table = et.BsdfTable(BsdfData([*ahead, *behind], both_sides=False))
    assert table.known_to() == 60.0
    assert table.known_to(side="back") == 75.0
    assert table.known_to(transmitted=True) == 90.0
    with pytest.raises(UnknownNameError, match="front"):
        table.known_to(side="frnt")  # type: ignore[arg-type]
    found = appearance(table)
    assert found.extrapolated == {"gloss 85": 60.0}
    assert set(found.errors) == {"gloss 20", "gloss 60", "reflection haze", "distinctness"}
    assert appearance(et.bsdf.Lambertian(reflectance=0.5)).extrapolated == {}


@pytest.mark.parametrize("theta", [80.0, 89.0])
def test_rays_off_a_lobe_that_the_horizon_cuts_have_the_share_that_is_stated(theta: float) -> None:
    """Most of the lobe would lie beyond the horizon. The count is binomial: within 4 of its standard errors."""
    radial, azimuth, share = np.linspace(0.0, 2.0, 40), np.arange(0.0, 360.0, 30.0), 0.9
    grid = PolarGrid("cosines", radial, azimuth)
    width = 0.5 * (1.0 + 0.3 * np.cos(np.radians(azimuth)))[:, None]
    shape, incident = np.exp(-0.5 * (radial / width) ** 2), direction(60.0, 0.0)
    values = shape * share / BsdfSlice(incident, shape, grid=grid).integral()
    table = et.BsdfTable(BsdfData([BsdfSlice(incident, values, grid=grid)]))
    towards = direction(theta, 0.0)
    beam = {
        "kind": "beam",
        "shape": {"kind": "disk", "radius": 1e-4},
        "flux": 1,
        "at": 10 * towards,
        "toward": -towards,
    }
    scene = et.Scene(
        sources=[beam],
        surfaces=[{"shape": {"kind": "disk", "radius": 50}, "finish": {"kind": "bsdf", "bsdf": table}}],
        detectors=[{"name": "all", "kind": "rays", "shape": {"kind": "hemisphere", "radius": 60}}],
    )
    rays = 20_000
    flux, error = et.trace(scene, rays=rays, seed=1).flux_of("all")
    assert error == pytest.approx(np.sqrt(flux * (1.0 - flux) / rays), rel=1e-3)
    assert abs(flux - share) < 4.0 * error
