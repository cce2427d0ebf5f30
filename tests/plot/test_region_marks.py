"""Every region has a number that is seen, and what is dead in a comparison is grey and counted."""

from __future__ import annotations

import re

import etendue as et
import numpy as np
import pytest
from etendue.plot import style
from etendue.plot.region_marks import clipped
from matplotlib.figure import Figure
from matplotlib.text import Annotation

SCREEN = et.Screen(40, 40, 40, 40)


def a_map(*, dead: np.ndarray | None = None) -> et.LuminanceMap:
    """A spot, dead where stated."""
    x, y = np.meshgrid(SCREEN.x, SCREEN.y)
    values = 100.0 + 1000.0 * np.exp(-(x**2 + y**2) / 60.0)
    values = values if dead is None else np.where(dead, np.nan, values)
    return et.LuminanceMap(values, 0.05 * values, np.where(np.isnan(values), 0, 100), et.Observer(30, 0, 1000), SCREEN)


def numbers_of(figure: Figure) -> list[Annotation]:
    return [text for text in figure.axes[0].texts if isinstance(text, Annotation)]


@pytest.mark.parametrize("seed", range(4))
def test_what_is_left_of_a_polygon_has_the_area_that_pixels_count(seed: int) -> None:
    """Triangles at random about a rectangle: by the corners that are left, and by pixels of 0.02 mm inside both."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-8.0, 8.0, (3, 2))
    x, y = clipped(corners, (-5.0, 5.0, -3.0, 4.0)).T
    area = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2.0
    fine = et.Screen(16, 16, 800, 800)
    across, up = np.meshgrid(fine.x, fine.y)
    inside = et.PolygonRegion(corners.tolist()).mask(fine) & (np.abs(across) < 5.0) & (up > -3.0) & (up < 4.0)
    # A pixel in error along each edge, of at most 60 mm.
    assert area == pytest.approx(float(inside.sum()) * fine.pixel_area, abs=60.0 * 0.02)
    assert area > 0.0


def test_a_region_whose_corners_lie_outside_has_its_number_in_the_picture() -> None:
    """The upper left corner of what is seen: that of the screen, or where the edge of the triangle comes in."""
    # The upper edge goes from (-30, -5) to (8, -8): at x = -20 it is at -5.79.
    regions = [et.Region(-35, 5, 5, 35), et.PolygonRegion([(-30, -5), (8, -30), (8, -8)]), et.Region(19, 25, -30, -19)]
    figure = et.plot_map(a_map(), regions=regions)
    figure.canvas.draw()
    frame = figure.axes[0].get_window_extent()
    found = {text.get_text(): text for text in numbers_of(figure)}
    assert found.keys() == {"1", "2", "3"}
    assert found["1"].xy == pytest.approx((-20, 20))
    assert found["2"].xy == pytest.approx((-20, -5 - 3 * 10 / 38))
    assert found["3"].xy == pytest.approx((19, -19))
    for text in found.values():
        box = text.get_window_extent()
        assert text.get_visible()
        assert frame.x0 < box.x0 < box.x1 < frame.x1
        assert frame.y0 < box.y0 < box.y1 < frame.y1


def test_equal_outlines_have_all_their_numbers() -> None:
    square = et.Region(-5, 5, -5, 5)
    figure = et.plot_map(a_map(), regions=[square, square, et.Region(-15, -10, 0, 5), square, et.Region(-5, 9, -5, 5)])
    figure.canvas.draw()
    assert sorted(text.get_text() for text in numbers_of(figure)) == ["1, 2, 4, 5", "3"]
    boxes = [text.get_window_extent() for text in numbers_of(figure)]
    assert not boxes[0].overlaps(boxes[1])


def shown_difference(figure: Figure) -> np.ndarray:
    return np.asarray(figure.axes[2].images[0].get_array().filled(np.nan))


@pytest.mark.parametrize("difference", ["maximum", "sigma", "thesis"])
def test_pixels_that_are_dead_in_both_maps_are_grey(difference: str) -> None:
    """Nothing is known of them; those dead in one map count as 0 there, and have no difference in standard errors."""
    x, y = np.meshgrid(SCREEN.x, SCREEN.y)
    one, other = x**2 + y**2 > 300, (x**2 + y**2 > 300) | (x > 10)
    figure = et.plot_comparison(et.compare(a_map(dead=other), a_map(dead=one)), difference=difference)
    grey = np.isnan(shown_difference(figure))
    only_one = one ^ other
    np.testing.assert_array_equal(grey, other if difference == "sigma" else one & other)
    assert figure.axes[2].images[0].get_cmap().get_bad()[:3] == pytest.approx((0x8F / 255, 0xA3 / 255, 0xAD / 255))
    told = " ".join(text.get_text() for text in figure.texts)
    assert f"grey: {int((one & other).sum())} pixels dead in both maps" in told
    kind = (
        "pixels dead in one of them" if difference == "sigma" else "pixels are dead in one of the maps and count as 0"
    )
    assert f"{int(only_one.sum())} {kind}" in told


def test_what_is_grey_outside_a_region_is_told() -> None:
    """20 × 20 of 40 × 40 pixels are compared, 1200 are not; of those, the dead ones are told with the others."""
    dead = np.zeros(SCREEN.shape, bool)
    dead[0] = dead[20, 18:22] = True
    figure = et.plot_comparison(et.compare(a_map(dead=dead), a_map(), et.Region(-10, 10, -10, 10), "exclude"))
    told = " ".join(text.get_text() for text in figure.texts)
    assert re.search(r"grey: 4 pixels dead in one of them\W+1200 pixels outside the region", told)
    assert int(np.isnan(shown_difference(figure)).sum()) == 1204


def test_nothing_is_said_of_grey_where_nothing_is() -> None:
    figure = et.plot_comparison(et.compare(a_map(), a_map()))
    assert not any("grey" in text.get_text() for text in figure.texts)
    assert style.DEAD == "#8fa3ad"
