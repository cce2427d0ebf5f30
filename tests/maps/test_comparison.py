"""Comparison of maps against numbers worked by hand, scipy and the definitions."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.luminance.combination import combine_maps
from etendue.luminance.comparison import compare, cross_section
from etendue.luminance.denoising import denoise_map
from etendue.luminance.filters import filter_map
from etendue.luminance.regions import Region
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

NAN = math.nan


def make_map(
    values: Any, error: Any = 1.0, observer: Observer | None = None, screen: Screen | None = None, **fields: Any
) -> LuminanceMap:
    values = np.asarray(values, dtype=float)
    height, width = values.shape
    return LuminanceMap(
        values,
        np.broadcast_to(error, values.shape),
        np.where(np.isnan(values), 0, 9),
        observer or Observer(20, 30, 500),
        screen or Screen(2.0 * width, 3.0 * height, width, height),
        provenance=Provenance(),
        **fields,
    )


def test_worked_by_hand() -> None:
    """Test 1 3 / 7 5, reference 2 3 / 5 10: deviations from the means -3 -1 3 1 and -3 -2 0 5; errors 1 0 2 5."""
    result = compare(make_map([[1, 3], [7, 5]]), make_map([[2, 3], [5, 10]], error=[[2, 0], [1, 7]]))
    assert result.ncc == pytest.approx((9 + 2 + 0 + 5) / math.sqrt(20 * 38), rel=1e-14)
    assert result.nrmse_thesis == pytest.approx((1 + 0 + 2 + 5) / (10 * 4), rel=1e-14)
    assert result.nrmse == pytest.approx(math.sqrt((1 + 0 + 4 + 25) / 4) / 10, rel=1e-14)
    np.testing.assert_allclose(result.difference, [[100 / 1.5, 0], [100 / 3, 100 / 1.5]], rtol=1e-14)
    assert result.reduced_chi_square == pytest.approx((1 / 5 + 0 / 1 + 4 / 2 + 25 / 50) / 4, rel=1e-14)
    assert (result.chi_square_pixels, result.pixels) == (4, 4)
    first, second = result.test_statistics, result.reference_statistics
    assert (first.mean, first.maximum, first.minimum, first.uniformity) == (4.0, 7.0, 1.0, 0.25)
    assert (second.mean, second.maximum, second.minimum, second.uniformity) == (5.0, 10.0, 2.0, 0.4)
    assert first.intensity == pytest.approx(result.test.intensity, rel=1e-14)
    assert result.intensity_ratio == pytest.approx(result.test.intensity / result.reference.intensity, rel=1e-14)
    assert result.notes == ()


@pytest.mark.parametrize(
    ("swap", "nrmse", "nrmse_thesis"),
    [(False, math.sqrt(9 / 2) / 4, 3 / (4 * 2)), (True, math.sqrt(9 / 2) / 1, 3 / (4 * 2))],
)
def test_the_second_map_is_the_reference(swap: bool, nrmse: float, nrmse_thesis: float) -> None:
    pair = (make_map([[1, 1]]), make_map([[1, 4]]))
    result = compare(*(pair[::-1] if swap else pair))
    assert result.nrmse == pytest.approx(nrmse)
    assert result.nrmse_thesis == pytest.approx(nrmse_thesis)


def test_ncc_is_pearsons_correlation() -> None:
    rng = np.random.default_rng(1)
    first, second = rng.gamma(2.0, 100.0, (2, 13, 7))
    expected = stats.pearsonr(first.ravel(), second.ravel()).statistic
    assert compare(make_map(first), make_map(second)).ncc == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
def test_measures_do_not_depend_on_the_scale(scale: float) -> None:
    """Squares of such numbers leave the range of float64; the measures do not."""
    first, second = scale * np.array([[1.0, 3, 7, 5]]), scale * np.array([[2.0, 3, 5, 10]])
    result = compare(make_map(first, NAN), make_map(second, NAN))
    assert result.ncc == pytest.approx(16 / math.sqrt(760), rel=1e-13)
    assert result.nrmse == pytest.approx(math.sqrt(7.5) / 10, rel=1e-13)


def test_weaknesses_are_as_documented() -> None:
    """NCC is blind to the scale; eq. 3.6 falls when an outlier is added, the true NRMSE does not."""
    reference = make_map([[1, 2, 3, 4, 5, 6, 7, 8]])
    assert compare(reference.replace(values=2 * reference.values), reference).ncc == pytest.approx(1.0)
    off, outlier = reference.values * 1.5, reference.values * 1.5
    outlier[0, 0] = 100.0
    plain, spiked = (compare(reference.replace(values=values), reference) for values in (off, outlier))
    assert spiked.nrmse_thesis < plain.nrmse_thesis
    assert spiked.nrmse > plain.nrmse


def test_equal_maps_agree_perfectly() -> None:
    lmap = make_map([[1.1, 0, 7.3], [NAN, 2.2, 5.4]])
    result = compare(lmap, lmap)
    assert (result.ncc, result.nrmse, result.nrmse_thesis, result.reduced_chi_square) == (1.0, 0.0, 0.0, 0.0)
    assert (result.intensity_ratio, result.median_difference) == (1.0, 0.0)
    np.testing.assert_array_equal(result.difference, [[0, NAN, 0], [NAN, 0, 0]])


def test_dead_pixels_count_as_zero_or_not_at_all() -> None:
    test, reference = make_map([[4, NAN, 8, NAN]]), make_map([[4, 6, NAN, NAN]])
    zero, exclude = compare(test, reference), compare(test, reference, dead="exclude")
    np.testing.assert_array_equal(zero.difference, [[0, 200, 200, NAN]])
    np.testing.assert_array_equal(exclude.difference, [[0, NAN, NAN, NAN]])
    assert (zero.pixels, exclude.pixels) == (4, 1)
    assert zero.nrmse == pytest.approx(math.sqrt(25) / 6)
    assert exclude.nrmse == 0.0
    assert zero.chi_square_pixels == exclude.chi_square_pixels == 1
    assert (zero.test_statistics.mean, exclude.test_statistics.mean) == (3.0, 4.0)
    assert zero.test_statistics.dead_pixels == exclude.test_statistics.dead_pixels == 2


def test_excluding_everything_is_an_error() -> None:
    with pytest.raises(ArgumentError, match="every pixel is dead"):
        compare(make_map([[1, NAN]]), make_map([[NAN, 1]]), dead="exclude")


def test_chi_square_judges_noise_at_its_own_level() -> None:
    """Two independent noisy maps of one truth: N χ²_red ~ χ²(N); verdict at 1e-6. A 10 % bias is then seen."""
    rng = np.random.default_rng(2)
    truth = rng.uniform(100, 900, (50, 40))
    sigma = truth * rng.uniform(0.02, 0.3, (2, 50, 40))
    first, second = (make_map(truth + s * rng.normal(size=s.shape), s) for s in sigma)
    n = truth.size
    low, high = stats.chi2.ppf([0.5e-6, 1 - 0.5e-6], n) / n
    result = compare(first, second)
    assert result.chi_square_pixels == n
    assert low < result.reduced_chi_square < high
    assert compare(first.replace(values=1.1 * first.values), second).reduced_chi_square > high


def test_chi_square_leaves_out_unknown_errors() -> None:
    test = make_map([[1, 2, 3, NAN]], error=[[1, NAN, 0, NAN]])
    reference = make_map([[3, 2, 3, 4]], error=[[0, 1, 0, 1]])
    result = compare(test, reference)
    assert (result.reduced_chi_square, result.chi_square_pixels) == (4.0, 1)
    none = compare(test, reference.replace(standard_error=np.full((1, 4), NAN)))
    assert math.isnan(none.reduced_chi_square)
    assert any("χ² is undefined" in note for note in none.notes)


@pytest.mark.parametrize("swap", [False, True])
def test_ncc_of_a_constant_map_is_undefined_not_wrong(swap: bool) -> None:
    # 0.1 + 0.2 has no exact mean: a naive formula finds a correlation of rounding errors.
    pair = (make_map(np.full((3, 3), 0.1 + 0.2)), make_map(np.arange(9.0).reshape(3, 3)))
    result = compare(*(pair[::-1] if swap else pair))
    assert math.isnan(result.ncc)
    assert result.notes == ("NCC is undefined: a map is constant over the pixels compared",)
    assert "NCC undefined" in result.summary()


def test_black_maps_are_told_about() -> None:
    black = make_map(np.zeros((2, 2)))
    result = compare(black, black.replace(values=np.full((2, 2), NAN)))
    assert math.isnan(result.nrmse)
    assert math.isnan(result.nrmse_thesis)
    assert math.isnan(result.intensity_ratio)
    assert math.isnan(result.median_difference)
    assert len(result.notes) == 4


def test_region() -> None:
    """The thesis' region lies off centre; columns right of it and rows above it must not enter."""
    screen = Screen(8, 6, 4, 3)
    values = np.arange(12.0).reshape(3, 4) + 1
    test = make_map(values, screen=screen)
    other = make_map(np.where(values < 9, 1000.0, values + 1), screen=screen)
    region = Region(left=-3, right=0, bottom=-3, top=-1)
    result = compare(test, other, region)
    assert result.pixels == 2
    np.testing.assert_array_equal(np.isnan(result.difference), [[True] * 4, [True] * 4, [False, False, True, True]])
    assert (result.test_statistics.minimum, result.test_statistics.maximum) == (9.0, 10.0)
    assert result.nrmse == pytest.approx(1 / 11)
    apparent = screen.pixel_area / 1e6 * screen.cosine(test.observer)[2, :2]
    assert result.test_statistics.intensity == pytest.approx(9 * apparent[0] + 10 * apparent[1], rel=1e-14)


def test_a_centre_on_the_edge_belongs_to_the_region_in_spite_of_rounding() -> None:
    screen = Screen(0.7, 0.9, 7, 3)
    mask = Region(left=-0.3, right=0.1, bottom=-0.3, top=0.3).mask(screen)
    assert mask.sum(axis=0).tolist() == [3, 3, 3, 3, 3, 0, 0]


def test_a_region_without_pixels_says_where_the_screen_is() -> None:
    with pytest.raises(ArgumentError, match=r"no pixel centre.*±4 mm.*±3 mm.*4 × 3 pixels"):
        Region(-0.5, 0.5, -0.5, 0.5).mask(Screen(8, 6, 4, 3))


@pytest.mark.parametrize("limits", [(1, 1, 0, 1), (0, 1, 2, 1), (0, 1, 0, NAN), (-math.inf, 1, 0, 1)])
def test_regions_that_are_none_are_refused(limits: tuple[float, float, float, float]) -> None:
    with pytest.raises(ArgumentError, match=r"region .*in mm"):
        Region(*limits)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"screen": Screen(4.1, 3, 2, 1)}, "screens differ: 4.1 × 3 mm against 4 × 3 mm"),
        ({"screen": Screen(4, 3, 2, 1, "xy")}, "screen planes differ: 'xy' against 'view'"),
        ({"observer": Observer(21, 30, 500)}, r"observers differ: θ = 21°, φ = 30°, 500 mm against θ = 20°"),
        ({"observer": Observer(20, 31, 500)}, "observers differ"),
        ({"observer": Observer(20, 30, 501)}, "observers differ"),
        ({"observer": Observer(20, 30, 500, (0, 0, 1))}, "targets differ"),
    ],
)
def test_maps_of_another_geometry_are_refused(change: dict[str, Any], words: str) -> None:
    reference = make_map([[1, 2]])
    other = reference.replace(**change)
    with pytest.raises(ArgumentError, match=words):
        compare(other, reference)
    ignored = compare(other, reference, ignore_geometry=True)
    assert ignored.nrmse == 0.0
    assert any("pixel by pixel, although" in note and re.search(words, note) for note in ignored.notes)
    assert not any("although" in note for note in compare(reference, reference, ignore_geometry=True).notes)


def test_every_difference_is_named_at_once() -> None:
    reference = make_map([[1, 2]])
    other = reference.replace(screen=Screen(9, 9, 2, 1, "xy"), observer=Observer(0, 0, 9))
    with pytest.raises(ArgumentError, match=r"screens differ.*planes differ.*observers differ"):
        compare(other, reference)


def test_azimuth_matters_only_where_it_turns_something() -> None:
    """At θ = 0 the azimuth changes nothing; at θ = 180° it turns the screen although the observer stays."""
    front = make_map([[1, 2]], observer=Observer(0, 0, 500))
    assert compare(front.replace(observer=Observer(0, 77, 500)), front).nrmse == 0.0
    back = make_map([[1, 2]], observer=Observer(180, 0, 500))
    with pytest.raises(ArgumentError, match="observers differ"):
        compare(back.replace(observer=Observer(180, 77, 500)), back)
    assert compare(back.replace(observer=Observer(180, 360, 500)), back).nrmse == 0.0


def test_geometry_may_differ_by_rounding() -> None:
    reference = make_map([[1, 2]])
    other = reference.replace(
        observer=Observer(float(np.float32(20.00001)), 30, 500 * (1 + 1e-8)), screen=Screen(4 * (1 + 1e-8), 3, 2, 1)
    )
    assert compare(other, reference).nrmse == 0.0


@pytest.mark.parametrize("ignore", [False, True])
def test_pixels_and_units_must_agree_in_any_case(ignore: bool) -> None:
    with pytest.raises(ArgumentError, match=r"1 × 3 pixels.*1 × 2"):
        compare(make_map([[1, 2, 3]]), make_map([[1, 2]]), ignore_geometry=ignore)
    with pytest.raises(ArgumentError, match=r"W/\(m² sr\).*cd/m²"):
        compare(make_map([[1, 2]], flux_unit="W"), make_map([[1, 2]]), ignore_geometry=ignore)


def test_unknown_rule_for_dead_pixels() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'exclude'"):
        compare(make_map([[1]]), make_map([[1]]), dead="excluded")  # type: ignore[arg-type]


def test_text_and_plain_data() -> None:
    result = compare(make_map([[1, 3], [7, 5]]), make_map([[2, 3], [5, 10]]), Region(-2, 2, -3, 3))
    text = result.summary()
    assert "NCC 58.038 %" in text
    assert "20.000 % (eq. 3.6)" in text
    data = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert data["nrmse_thesis"] == pytest.approx(0.2)
    assert data["region_mm"] == {"left": -2, "right": 2, "bottom": -3, "top": 3}
    assert data["reference"]["uniformity"] == pytest.approx(0.4)
    assert data["test"] == dataclasses.asdict(result.test_statistics)
    black = make_map([[0, 0]])
    assert compare(black, black).to_dict()["ncc"] is None


VALUES = np.array([[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [9.0, 10.0, 11.0, NAN]])


@pytest.mark.parametrize(
    ("where", "position", "values", "at"),
    [
        ({"y": 4.4}, [-3, -1, 1, 3], VALUES[0], 3.0),
        ({"y": 0}, [-3, -1, 1, 3], VALUES[1], 0.0),
        ({"y": -4.5}, [-3, -1, 1, 3], VALUES[2], -3.0),
        ({"y": 1.5}, [-3, -1, 1, 3], VALUES[1], 0.0),
        ({"x": -4.0}, [-3, 0, 3], [9, 5, 1], -3.0),
        ({"x": 0.0}, [-3, 0, 3], [11, 7, 3], 1.0),
        ({"x": 4}, [-3, 0, 3], [NAN, 8, 4], 3.0),
    ],
)
def test_cross_section(where: dict[str, float], position: Any, values: Any, at: float) -> None:
    line = cross_section(make_map(VALUES, 0.1 * VALUES, screen=Screen(8, 9, 4, 3)), **where)
    np.testing.assert_allclose(line.position, position, atol=1e-12)
    np.testing.assert_array_equal(line.values, values)
    np.testing.assert_allclose(line.standard_error, 0.1 * np.asarray(values))
    assert line.at == pytest.approx(at, abs=1e-12)
    assert line.pitch == (2.0 if "y" in where else 3.0)
    assert line.axis == ("x" if "y" in where else "y")
    assert (line.quantity, line.unit) == ("luminance", "cd/m²")


@given(
    columns=st.integers(1, 40),
    width=st.floats(1e-3, 1e3),
    share=st.floats(-0.5, 0.5),
)
def test_cross_section_contains_the_coordinate(columns: int, width: float, share: float) -> None:
    lmap = make_map(np.zeros((1, columns)), screen=Screen(width, 1, columns, 1))
    line = cross_section(lmap, x=share * width)
    assert abs(line.at - share * width) <= width / columns / 2 * (1 + 1e-9)


@pytest.mark.parametrize("where", [{}, {"x": 0.0, "y": 0.0}])
def test_cross_section_wants_one_coordinate(where: dict[str, float]) -> None:
    with pytest.raises(ArgumentError, match="exactly one"):
        cross_section(make_map([[1]]), **where)


@pytest.mark.parametrize("where", [{"x": 4.001}, {"x": -5}, {"y": 4.6}, {"y": NAN}])
def test_cross_section_off_the_screen(where: dict[str, float]) -> None:
    with pytest.raises(ArgumentError, match="off the screen"):
        cross_section(make_map(VALUES, screen=Screen(8, 9, 4, 3)), **where)


@pytest.mark.parametrize(
    "ask",
    [
        lambda lmap: compare(make_map([[1.0, 2.0]]), lmap),
        lambda lmap: filter_map(lmap, "average"),
        denoise_map,
        lambda lmap: combine_maps([lmap, lmap]),
    ],
)
def test_what_is_no_map_of_luminance_is_refused(ask: Callable[[Any], object]) -> None:
    desk = IlluminanceMap([[400.0, 600.0]], [[4.0, 5.0]], [[900, 1100]], Screen(2000, 1000, 2, 1, "xy"))
    for wrong, name in ((desk, "an IlluminanceMap"), ("map.exr", "'map.exr'")):
        with pytest.raises(ArgumentError, match=f"the map is {name}; give a LuminanceMap"):
            ask(wrong)
