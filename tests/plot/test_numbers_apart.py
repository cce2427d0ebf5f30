"""Numbers at axes and circles do not run into each other: by the boxes that the renderer draws."""

from __future__ import annotations

import itertools

import etendue as et
import numpy as np
import pytest
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox


def a_map(*, width: float, height: float) -> et.LuminanceMap:
    screen = et.Screen(width, height, 4, 6)
    values = np.arange(1.0, 25.0).reshape(6, 4)
    return et.LuminanceMap(values, 0.1 * values, np.full((6, 4), 100), et.Observer(0, 0, 1000), screen)


def boxes(texts: list[Text], figure: Figure) -> list[Bbox]:
    """Of what is drawn, in order from the left."""
    figure.canvas.draw()
    found = [text.get_window_extent() for text in texts if text.get_text() and text.get_visible()]
    return sorted(found, key=lambda box: box.x0)


def numbers_below(figure: Figure, panels: list[Axes]) -> list[Bbox]:
    figure.canvas.draw()
    texts = []
    for axes in panels:
        low, high = axes.get_xlim()
        ticks = zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
        texts += [label for tick, label in ticks if low <= tick <= high]
    return boxes(texts, figure)


SIZES = [
    (4, 120),
    (40, 120),
    (400, 12000),
    (12.5, 500),
    (0.5, 6),
    (2000, 90000),
    (40, 40),
    (200, 200),
    (7, 90),
    (3000, 20),
]


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), SIZES)
def test_numbers_below_maps(width: float, height: float) -> None:
    figure = et.plot_map(a_map(width=width, height=height))
    found = numbers_below(figure, figure.axes[:1])
    assert len(found) > 1
    assert all(a.x1 < b.x0 for a, b in itertools.pairwise(found))


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), SIZES)
def test_numbers_below_three_maps(width: float, height: float) -> None:
    """Those of neighbouring panels neither."""
    lmap = a_map(width=width, height=height)
    figure = et.plot_comparison(et.compare(lmap, lmap))
    found = numbers_below(figure, figure.axes[:3])
    assert len(found) > 3
    assert all(a.x1 < b.x0 for a, b in itertools.pairwise(found))


@pytest.mark.slow
@pytest.mark.parametrize("inches", [(5.0, 4.0), (3.0, 3.0), (3.4, 1.2), (2.0, 2.0)])
@pytest.mark.parametrize("peak", [3e-5, 0.7, 950.0, 12_345.0, 4.3e6])
@pytest.mark.parametrize("behind", [0.0, 0.5])
def test_circles_have_numbers(inches: tuple[float, float], peak: float, behind: float) -> None:
    """The outermost has one with the unit, and none lies on another."""
    gamma = np.arange(0.0, 181.0, 2.0)
    values = peak * np.where(gamma <= 90, np.cos(np.radians(gamma)), behind * np.abs(np.cos(np.radians(gamma))))
    figure = Figure(figsize=inches, dpi=100)
    axes = figure.add_axes((0.05, 0.15, 0.9, 0.75))
    et.plot_intensity(et.Intensity([0], gamma, [values.clip(0.0)]), ax=axes)
    numbers = [text for text in axes.texts if "°" not in text.get_text() and text.get_va() == "bottom"]
    assert sum(text.get_text().endswith(" cd") for text in numbers) == 1
    found = boxes(numbers, figure)
    assert all(a.x1 < b.x0 for a, b in itertools.pairwise(found))


@pytest.mark.slow
@pytest.mark.parametrize("inches", [(5.0, 4.0), (3.4, 2.0), (2.4, 1.6), (2.0, 2.0)])
@pytest.mark.parametrize("ahead", [True, False])
def test_names_of_half_planes_stand_beside_the_numbers_at_the_rim(inches: tuple[float, float], ahead: bool) -> None:
    """The longest names: the peak is in the plane C = 183.75°, which is drawn as a third one."""
    c, gamma = np.arange(0.0, 360.0, 3.75), np.arange(0.0, 91.0 if ahead else 181.0, 5.0)
    beam = np.exp(-(((gamma - (60.0 if ahead else 110.0)) / 20.0) ** 2))
    values = 1.0 + 100.0 * np.cos(np.radians((c[:, None] - 183.75) / 2.0)) ** 8 * beam
    values[:, 0] = 1.0
    figure = Figure(figsize=inches, dpi=100)
    axes = figure.add_axes((0.05, 0.25, 0.9, 0.6))
    et.plot_intensity(et.Intensity(c, gamma, values), ax=axes)
    figure.canvas.draw()
    names = [text.get_window_extent() for text in axes.texts if text.get_text().startswith("C")]
    assert next(text.get_text() for text in axes.texts if text.get_text().startswith("C")) == "C180, C270, C183.75"
    numbers = [text.get_window_extent() for text in axes.texts if text.get_text().endswith("°")]
    assert not any(name.overlaps(number) for name in names for number in numbers)
    assert not names[0].overlaps(names[1])


@pytest.mark.slow
@pytest.mark.parametrize("back", [False, True])
def test_names_of_curves_stand_beside_the_curves(back: bool) -> None:
    """Of a lobe about the mirrored direction, or about the light: no point of a curve is in the box of the names."""
    theta, way = np.radians(np.arange(0.0, 90.0, 1.0)), 180.0 if back else 0.0
    grid = PolarGrid("normal", np.degrees(theta), np.arange(0.0, 360.0, 5.0))
    across, along = (np.sin(theta) * function(np.radians(grid.azimuth - way))[:, None] for function in (np.sin, np.cos))
    slices = []
    for incidence in (0.0, 30.0, 60.0, 75.0):
        square = (along - np.sin(np.radians(incidence))) ** 2 + across**2
        slices.append(BsdfSlice(light_from(incidence, 180.0), 0.01 + 5.0 * np.exp(-square / 2.0 / 0.1**2), grid=grid))
    figure = et.plot_bsdf(et.BsdfTable(BsdfData(slices)))
    figure.canvas.draw()
    axes = figure.axes[0]
    box = axes.get_legend().get_window_extent()
    points = np.concatenate([axes.transData.transform(line.get_xydata()) for line in axes.lines])
    inside = (points > box.min).all(axis=1) & (points < box.max).all(axis=1)
    assert not inside.any()


def test_a_narrow_lobe_is_drawn_as_high_as_it_is() -> None:
    """A lobe of 0.006° that lies between points 0.12° apart: its height A / B, at each angle of incidence."""
    polish = et.bsdf.ABg(a=1e-8, b=1e-10, g=2.5)
    axes = et.plot_bsdf(polish).axes[0]
    assert [float(line.get_ydata().max()) for line in axes.lines] == [pytest.approx(100.0, rel=1e-3)] * 4
