"""Regions of maps: pixels against areas, statistics against sums by hand, and what is drawn of them."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.luminance.comparison import compare
from etendue.luminance.region_statistics import region_statistics
from etendue.luminance.regions import PolygonRegion, Region, parse_region
from etendue.plot import plot_comparison, plot_map, style
from etendue.plot.colour_scale import choose_scale
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.powers_of_ten import common_power


def make_map(values: object, error: float = 0.5) -> LuminanceMap:
    found = np.array(values, dtype=float)
    screen = Screen(found.shape[1], found.shape[0], found.shape[1], found.shape[0])
    return LuminanceMap(found, np.full(found.shape, error), np.full(found.shape, 9), Observer(0, 0, 1000), screen)


def test_a_polygon_holds_the_pixels_of_its_area() -> None:
    """Concave and aslant: the pixels that it holds have its area but for those on its edges; one without sides parallel to
    the axes and a rectangle as a polygon, against the rectangle itself."""
    screen = Screen(10, 8, 1000, 800)
    arrow = PolygonRegion([(-4.1, -3.3), (0.2, -1.2), (4.3, -2.9), (0.1, 3.7)])
    assert arrow.mask(screen).sum() * screen.pixel_area == pytest.approx(arrow.area, rel=2e-3)
    box = PolygonRegion([(-1.003, -2.003), (3.003, -2.003), (3.003, 0.503), (-1.003, 0.503)])
    np.testing.assert_array_equal(box.mask(screen), Region(-1.003, 3.003, -2.003, 0.503).mask(screen))


def test_a_rectangle_is_its_polygon_whichever_way_it_is_told() -> None:
    """Limits on pixel centres, off them, in either sense, and mirrored: both kinds hold the same pixels, and the mirror
    image of a region the mirrored ones."""
    rng = np.random.default_rng(3)
    screen = Screen(9, 7, 9, 7)
    for _ in range(200):
        limits = rng.integers(-8, 9, 4) / 2.0 if rng.random() < 0.5 else rng.uniform(-4, 4, 4)
        (left, right), (bottom, top) = sorted(limits[:2]), sorted(limits[2:])
        if not (left < right and bottom < top):
            continue
        try:
            expected = Region(left, right, bottom, top).mask(screen)
        except ArgumentError:
            continue
        corners = [(left, bottom), (right, bottom), (right, top), (left, top)]
        for order in (corners, corners[::-1], corners[2:] + corners[:2]):
            np.testing.assert_array_equal(PolygonRegion(order).mask(screen), expected)
        mirrored = PolygonRegion([(-x, y) for x, y in corners]).mask(screen)
        np.testing.assert_array_equal(mirrored, expected[:, ::-1])
    triangle = PolygonRegion([(-3, -2), (3, -2), (0, 1)]).mask(screen)
    np.testing.assert_array_equal(triangle, triangle[:, ::-1])
    assert triangle.sum() == 7 + 5 + 3 + 1


def test_loops_of_either_sense_hold_pixels() -> None:
    """A bow tie, whose two loops have the signed area 0: pixels of one fall on those of the other by the mirror."""
    tie = PolygonRegion([(-4, -3), (4, 3), (4, -3), (-4, 3)])
    inside = tie.mask(Screen(10, 8, 1000, 800))
    assert tie.area == 0.0
    assert inside.sum() * 1e-4 == pytest.approx(24.0, rel=5e-3)
    np.testing.assert_array_equal(inside, inside[:, ::-1])


def test_what_a_region_has_beyond_the_screen_is_told() -> None:
    lmap = make_map([[1, 2, 3, 4], [5, 6, 7, 8]])
    assert region_statistics(lmap, Region(-2, 2, -1, 1)).notes == ()
    (note,) = region_statistics(lmap, PolygonRegion([(0, -3.5), (0, 1), (2.25, 1)])).notes
    assert "0.25 mm beyond its right, 2.5 mm beyond its bottom" in note
    words = "".join(text.get_text() for text in plot_map(lmap, regions=[Region(0, 9, 0, 1)]).texts)
    assert "cut at the edge of the screen" in words


def test_statistics_are_those_of_the_pixels_in_the_region() -> None:
    """Two rows by hand, one of the pixels dead: left out, mean 4, errors 0.5 and 0.5/√5; as 0, 20/6 and less."""
    lmap = make_map([[9, 9, 9, 9], [2, 4, math.nan, 9], [3, 5, 6, 9]])
    found = region_statistics(lmap, Region(-2, 1, -1.5, 0.5), percentiles=(0, 50, 100), dead="exclude")
    assert (found.mean, found.minimum, found.maximum) == (4.0, 2.0, 6.0)
    assert (found.mean_error, found.mean_error_apart) == (0.5, pytest.approx(0.5 / math.sqrt(5)))
    assert found.percentiles == ((0.0, 2.0), (50.0, 4.0), (100.0, 6.0))
    assert (found.uniformity, found.uniformity_of_extremes) == (0.5, pytest.approx(1 / 3))
    assert (found.area, found.pixels, found.dead_pixels) == (6.0, 6, 1)
    whole = region_statistics(lmap, Region(-2, 1, -1.5, 0.5))
    assert (whole.mean, whole.minimum, whole.uniformity) == (pytest.approx(20 / 6), 0.0, 0.0)
    assert (whole.mean_error, whole.mean_error_apart) == (pytest.approx(2.5 / 6), pytest.approx(0.5 * math.sqrt(5) / 6))
    with pytest.raises(et.errors.UnknownNameError, match="Did you mean 'zero'"):
        region_statistics(lmap, Region(-2, 1, -1.5, 0.5), dead="zeros")  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="all 1 pixels"):
        region_statistics(lmap, Region(0, 1, -0.5, 0.5))
    with pytest.raises(ArgumentError, match="percentiles"):
        region_statistics(lmap, Region(-2, 1, -1, 1), percentiles=(101,))


def test_the_mean_of_a_region_is_the_luminance_however_many_pixels_are_dead() -> None:
    """The innermost zone of the ring source has a stated luminance; with few rays most pixels are dead, and the mean of
    eight independent maps lies within 4 standard errors (6e-5) of it. The mean of the live pixels alone does not."""
    region = PolygonRegion([(9 * math.cos(a), 9 * math.sin(a)) for a in np.arange(8) * math.pi / 4])
    found, live = [], []
    for seed in range(1, 9):
        source = et.RingSource(rays=100_000, seed=seed)
        lmap = et.luminance_map(source, Observer(0, 0, 1000), Screen(20, 20, 64, 64), method=et.Cone(acceptance=2))
        found.append(region_statistics(lmap, region))
        live.append(region_statistics(lmap, region, dead="exclude").mean)
    assert all(one.dead_pixels > one.pixels / 2 for one in found)
    error = math.sqrt(sum(one.mean_error_apart**2 for one in found)) / len(found)
    truth = source.zone_luminance[0]
    assert abs(np.mean([one.mean for one in found]) - truth) < 4 * error
    assert np.mean(live) - truth > 20 * error


def test_cells_that_no_ray_reached_leave_the_error_of_a_mean_known() -> None:
    """k rays of equal flux in a region have the relative error 1/√k, however many of its cells they missed."""
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}
    desk = {"name": "desk", "kind": "illuminance", "width": 50, "height": 40, "columns": 100, "rows": 80}
    scene = et.Scene(sources=[lamp], detectors=[desk | {"at": [0, 0, 10], "toward": [0, 0, -1]}])
    lmap, region = et.trace(scene, rays=20_000, seed=1).illuminance["desk"], Region(-20.1, 15.3, -12.2, 18.4)
    inside = region.mask(lmap.screen)
    assert (lmap.rays[inside] == 0).sum() > 100
    found = region_statistics(lmap, region)
    assert found.mean_error_apart == pytest.approx(found.mean / math.sqrt(lmap.rays[inside].sum()), rel=1e-3)
    assert found.mean_error > found.mean_error_apart
    assert (found.minimum, found.dead_pixels) == (0.0, 0)


def test_the_error_of_a_mean_is_its_spread() -> None:
    """500 maps of 40 independent pixels: the spread of their means within 4 of its standard errors (6e-5)."""
    draws = np.random.default_rng(1).normal(10.0, 0.5, (500, 4, 10))
    means = [region_statistics(make_map(one), Region(-5, 5, -2, 2)).mean for one in draws]
    stated = region_statistics(make_map(draws[0]), Region(-5, 5, -2, 2)).mean_error_apart
    assert np.std(means, ddof=1) == pytest.approx(stated, rel=4 / math.sqrt(2 * 499))


def test_what_pixels_have_in_common_counts_once() -> None:
    """5 % in common beside 1 of each pixel's own: √(0.5² + 1²/n) for a mean of 10 over n pixels, down to one."""
    lmap = make_map(np.full((4, 10), 10.0), math.hypot(1.0, 0.5)).replace(common_error=0.05)
    for region, n in ((Region(-5, -4, 1, 2), 1), (Region(-5, 5, -2, 2), 40)):
        assert region_statistics(lmap, region).mean_error_apart == pytest.approx(math.hypot(0.5, n**-0.5), rel=1e-12)


def test_chance_lifts_the_largest_pixel_and_not_the_maximum_apart() -> None:
    """100 maps of 1 600 even pixels, each with its own error: the largest is 3.2 of them too large on average, what is
    stated of pixels that err apart less than half of one. One pixel that stands out keeps its value."""
    draws = np.random.default_rng(5).normal(10.0, 0.5, (100, 40, 40))
    found = [region_statistics(make_map(one), Region(-20, 20, -20, 20)) for one in draws]
    assert np.mean([one.maximum for one in found]) - 10.0 > 3.0 * 0.5
    assert abs(np.mean([one.maximum_apart for one in found]) - 10.0) < 0.5 * 0.5
    # What pixels have in common lifts none above the others.
    shared = make_map(draws[0]).replace(standard_error=0.05 * draws[0], common_error=0.05)
    assert region_statistics(shared, Region(-20, 20, -20, 20)).maximum_apart == draws[0].max()
    draws[:, 3, 7] = 20.0
    assert region_statistics(make_map(draws[0]), Region(-20, 20, -20, 20)).maximum_apart == pytest.approx(
        20.0, abs=1e-6
    )


def test_regions_are_outlined_and_numbered() -> None:
    regions = [Region(-1, 1, -1, 0), PolygonRegion([(-2, -1), (2, -1), (0, 1)])]
    figure = plot_map(make_map([[1, 2, 3, 4], [5, 6, 7, 8]]), regions=regions)
    first, second = figure.axes[0].patches
    assert {tuple(map(float, c)) for c in first.get_xy()} == {(-1, -1), (1, -1), (1, 0), (-1, 0)}
    assert {tuple(map(float, c)) for c in second.get_xy()} == set(regions[1].corners)
    assert [text.get_text() for text in figure.axes[0].texts] == ["1", "2"]
    words = "\n".join(text.get_text() for text in figure.texts)
    assert "1: mean 6.5 ± 0.35 to 0.5 cd/m²  ·  min 6  ·  max 7" in words
    bright = plot_map(make_map(1e7 * np.array([[1, 2, 3, 4], [5, 6, 7, 8]])), regions=regions)
    words = "\n".join(text.get_text() for text in bright.texts)
    assert "1 in 10⁶ cd/m²: mean 65" in words
    assert "min 60  ·  max 70" in words
    with pytest.raises(ArgumentError, match="10 regions"):
        plot_map(make_map([[1, 2]]), regions=[Region(-1, 1, -1, 1)] * 10)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2,3", "is no region"),
        ("a/b,1/2,3/4", "is no region"),
        ("0/0,1/1,2/2", "no area"),
        ("0/0,1/1", "three"),
        ("2,1,0,1", "left"),
    ],
)
def test_what_is_no_region_is_refused(text: str, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        parse_region(text)


def test_the_scale_follows_the_median_of_the_lit() -> None:
    """A thirtieth of the maximum decides, whatever is black or dead."""
    for median, name in ((0.99, "log"), (1.01, "linear")):
        values = np.array([0.0, 0.0, math.nan, median / 2, median, 30.0])
        assert choose_scale(values[values != median / 2], "auto").name == "linear"  # the median of two is between them
        assert choose_scale(values, "auto").name == name
    assert choose_scale(np.array([1.0, 1e6, 1e6]), "log") == ("log", "")


def test_differences_have_a_sign() -> None:
    """By hand: (test − reference) over the reference's maximum, and over √(0.3² + 0.4²); colours symmetric about 0."""
    test, reference = make_map([[1, 4, math.nan, 2]], 0.3), make_map([[2, 2, 1, 5]], 0.4)
    result = compare(test, reference)
    np.testing.assert_allclose(result.signed_difference, [[-20, 40, -20, -60]])
    np.testing.assert_allclose(result.difference_in_sigma, [[-2, 4, math.nan, -6]])
    for kind, expected in (("maximum", result.signed_difference), ("sigma", result.difference_in_sigma)):
        image = plot_comparison(result, difference=kind).axes[2].images[0]  # type: ignore[arg-type]
        low, high = image.get_clim()
        np.testing.assert_allclose(image.get_array().filled(math.nan), np.maximum(expected, low))
        assert low == -high < 0.0
    with pytest.raises(et.errors.UnknownNameError, match="Did you mean 'sigma'"):
        plot_comparison(result, difference="sigm")  # type: ignore[arg-type]


def test_numbers_have_one_notation() -> None:
    assert [style.plain(x) for x in (0.0, 12345.0, -0.5, 1e-5, -2.5e9, 1.23456e-12)] == [
        "0", "12\u2009340", "−0.5", "10⁻⁵", "−2.5 × 10⁹", "1.235 × 10⁻¹²",
    ]  # fmt: skip
    assert [common_power(-x, x) for x in (0.0, 1e-3, 9e-4, 9.9e6, 1e7, 2e9)] == [0, 0, -6, 0, 6, 9]
