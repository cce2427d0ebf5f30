"""Pictures in axes of the user: nothing is drawn elsewhere or written, colours and places are those of the values."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import matplotlib as mpl
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield.diagnostics import Diagnostics
from etendue.plot.bsdf_picture import polar_surface
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.threshold_sweep import COLUMNS, ThresholdSweep
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from oracles.light_fields import SURFACES, make_field
from oracles.map_files import make_map

pytestmark = pytest.mark.xdist_group(__name__)
"""One worker makes what the tests draw."""

LENS = et.Scene(solids=[{"name": "lens", "shape": {"kind": "ball", "radius": 4}, "medium": "PMMA"}])


def lambertian() -> et.Intensity:
    return et.Intensity(c=[0], gamma=range(91), values=[np.cos(np.radians(range(91)))])


def sweep() -> ThresholdSweep:
    columns = {name: np.array([0.9, 0.8]) for name in COLUMNS} | {"threshold": np.array([2.1, 0.021])}
    return ThresholdSweep(columns, patches=437, rays=10**6, held_out=10**5)


def swept() -> et.SweepTable:
    rising, falling = np.array([1.0, 2.0, 4.0]), np.array([30.0, 20.0, 10.0])
    values, errors = {"escaped": rising, "peak:far": falling}, {"escaped": rising / 10, "peak:far": falling / 10}
    return et.SweepTable({"lens.at.2": rising}, values, errors, {"escaped": "lm", "peak:far": "cd"}, done=3)


@functools.cache
def lobe() -> et.Deconvolution:
    angle = np.linspace(-5.0, 5.0, 41)
    scan = et.GoniometerScan(angle, np.exp(-(angle**2)))
    return et.deconvolve(scan, et.GoniometerScan(angle, np.exp(-4.0 * angle**2)), stop=5)


@functools.cache
def wide_lobe() -> et.DirectionalDeconvolution:
    goniometer = et.ScatterGoniometer(photons=1e6)
    scan = goniometer.measure_window(et.bsdf.Gaussian(peak=200.0, sigma=0.012), 60, step=1, span=4, method="quadrature")
    return et.deconvolve_directions(scan, stop=5, regular=False, replicates=4)


@functools.cache
def near_field() -> et.NearFieldRun:
    disk = {"kind": "surface", "shape": {"kind": "disk", "radius": 2}, "flux": 100}
    return et.NearFieldGoniophotometer(step=(30, 90), camera_pixels=16).measure(et.Scene(sources=[disk]))


@functools.cache
def characteristic() -> Diagnostics:
    return et.diagnose(make_field(SURFACES["disk"]))


DRAWN: dict[str, tuple[int, Callable[..., Any]]] = {
    "map": (1, lambda **given: et.plot_map(make_map(), **given)),
    "method": (1, lambda **given: make_map().plot(**given)),
    "cross sections": (1, lambda **given: et.plot_cross_sections([et.cross_section(make_map(), y=0)], **given)),
    "polar": (1, lambda **given: et.plot_intensity(lambertian(), **given)),
    "cartesian": (1, lambda **given: et.plot_intensity(lambertian(), kind="cartesian", **given)),
    "comparison": (3, lambda **given: et.plot_comparison(et.compare(make_map(), make_map()), **given)),
    "threshold": (2, lambda **given: et.plot_threshold_sweep(sweep(), **given)),
    "sweep": (2, lambda **given: et.plot_sweep(swept(), **given)),
    "characteristic": (2, lambda **given: et.plot_characteristic(characteristic(), **given)),
    "deconvolution": (3, lambda **given: et.plot_deconvolution(lobe(), **given)),
    "directions": (4, lambda **given: et.plot_directions(wide_lobe(), **given)),
    "near field": (4, lambda **given: et.plot_near_field(near_field(), **given)),
    "bsdf": (3, lambda **given: et.plot_bsdf(et.bsdf.Gaussian(peak=3.0, sigma=0.2), **given)),
    "scene": (2, lambda **given: et.draw_scene(LENS, rays=0, **given)),
}
"""Every function that draws: how many axes it needs."""


def figure_with(axes: int) -> Figure:
    figure = Figure(figsize=(4.0 * axes, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    figure.subplots(1, axes, squeeze=False)
    return figure


def test_every_picture_is_here() -> None:
    # A moving picture is a file, and on no axes.
    public = {name for name in et.__all__ if name.startswith(("plot_", "draw_"))} - {"plot_animation", "plot_report"}
    assert len(public) == len(set(DRAWN) - {"method", "cartesian"})


@pytest.mark.slow
@pytest.mark.parametrize("which", DRAWN)
def test_axes_are_drawn_on_and_come_back(which: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    count, draw = DRAWN[which]
    figure = figure_with(count)
    given = list(figure.axes)
    drawn = draw(ax=given if count > 1 else given[0])
    assert drawn == (tuple(given) if count > 1 else given[0])
    assert all(axes.has_data() or axes.patches for axes in given)
    assert figure.texts == []  # no heading and no caption over a figure of somebody else
    figure.canvas.draw()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("which", DRAWN)
def test_axes_and_a_path_are_refused(which: str, tmp_path: Path) -> None:
    count, draw = DRAWN[which]
    with pytest.raises(et.ArgumentError, match="savefig"):
        draw(path=tmp_path / "picture.png", ax=figure_with(count).axes[0] if count == 1 else figure_with(count).axes)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("which", DRAWN)
def test_too_many_axes_are_refused(which: str) -> None:
    count, draw = DRAWN[which]
    with pytest.raises(et.ArgumentError, match=rf"{count + 1} axes for {count} diagram"):
        draw(ax=figure_with(count + 1).axes)


@pytest.mark.parametrize("which", ["polar", "map"])
def test_polar_axes_are_refused(which: str) -> None:
    with pytest.raises(et.ArgumentError, match="no plain axes"):
        DRAWN[which][1](ax=Figure().add_subplot(projection="polar"))


def test_a_map_has_its_values_and_its_colour_bar() -> None:
    """The image holds the values at their places, and beside it the bar spans them."""
    lmap, figure = make_map(), figure_with(1)
    (axes,) = figure.axes
    et.plot_map(lmap, ax=axes, scale="linear", cmap="viridis", title="$x")
    (image,) = axes.get_images()
    shown = np.ma.filled(image.get_array(), np.nan)
    np.testing.assert_array_equal(shown, np.maximum(lmap.values, 0.0))
    half = lmap.screen.width / 2, lmap.screen.height / 2
    assert tuple(image.get_extent()) == (-half[0], half[0], -half[1], half[1])
    assert image.get_cmap()(0.3) == mpl.colormaps["viridis"](0.3)
    assert axes.get_title(loc="left") == "$x"
    (bar,) = (other for other in figure.axes if other is not axes)
    assert bar.get_ylabel() == f"luminance [10⁶ {lmap.unit}]"
    assert bar.get_ylim()[1] == pytest.approx(np.nanmax(lmap.values))


@pytest.mark.slow
@pytest.mark.parametrize("which", ["map", "comparison"])
def test_colours_are_those_that_are_asked_for(which: str) -> None:
    _, draw = DRAWN[which]
    for wanted in ("cividis", mpl.colormaps["cividis"]):
        image = draw(cmap=wanted).axes[0].get_images()[0]
        assert image.get_cmap()(0.7) == mpl.colormaps["cividis"](0.7)
    with pytest.raises(et.UnknownNameError, match="viridis"):
        draw(cmap="virids")


@pytest.mark.parametrize("size", [(70.0, 70.0), (120.0, 15.0), (15.0, 120.0), (20.0, 15.0)])
def test_pixels_are_to_scale_and_the_bar_is_as_long_as_the_picture(size: tuple[float, float]) -> None:
    """Without a layout engine, where the room is what matplotlib's axes and bars take."""
    lmap = et.LuminanceMap(np.eye(4), np.eye(4), np.ones((4, 4)), et.Observer(0, 0, 1000), et.Screen(*size, 4, 4))
    figure = Figure(figsize=(5, 5))
    FigureCanvasAgg(figure)
    axes = lmap.plot(ax=figure.subplots())
    figure.canvas.draw()
    bar = figure.axes[1].get_window_extent()
    picture = axes.get_window_extent()
    assert picture.width / picture.height == pytest.approx(size[0] / size[1], rel=1e-6)
    lying = size[0] > 2 * size[1]
    assert (bar.width / picture.width if lying else bar.height / picture.height) == pytest.approx(1.0, abs=0.05)


def test_names_are_no_formulas() -> None:
    axes = figure_with(1).axes[0]
    et.plot_cross_sections([et.cross_section(make_map(), y=0)], labels=["$a^$"], ax=axes)
    axes.figure.canvas.draw()
    assert axes.get_legend().get_texts()[0].get_text() == "$a^$"


@pytest.mark.parametrize("incidence", [-5.0, 90.0, 95.0, float("nan")])
def test_light_from_behind_has_no_lobe_to_draw(incidence: float) -> None:
    with pytest.raises(ArgumentError, match=f"incidence is {incidence}; give an angle"):
        et.plot_bsdf(et.bsdf.Lambertian(reflectance=0.5), incidence=incidence)


def test_a_mirror_has_no_lobe_to_draw() -> None:
    _, disk, _, surface = et.plot_bsdf(et.bsdf.Mirror(reflectance=0.9)).axes
    assert "Nothing is scattered" in {disk.get_title(where) for where in ("left", "center", "right")}
    assert "Nothing is scattered" in {surface.get_title(where) for where in ("left", "center", "right")}
    assert not surface.collections


@pytest.mark.parametrize(
    ("theta", "phi", "behind", "transmitted"), [(50.0, 200.0, False, True), (0.0, 0.0, True, False)]
)
def test_the_polar_surface_is_f_from_the_specular_direction_to_the_horizon(
    theta: float, phi: float, behind: bool, transmitted: bool
) -> None:
    """Against the closed form of a Gaussian, on the side where the light goes; its last ring lies in the surface."""
    way: Any = "transmitted" if transmitted else "reflected"
    incident = direction(theta, phi, behind=behind)
    bsdf = et.bsdf.Gaussian(peak=3.0, sigma=0.2, way=way)
    toward, f = polar_surface(bsdf, incident, transmitted=transmitted)
    side = 1.0 if behind == transmitted else -1.0
    assert (side * toward[..., 2] > 0.0).all()
    assert np.abs(toward[-1, :, 2]).max() < 1e-4
    assert toward[0] == pytest.approx(np.broadcast_to(incident * [-1, -1, -1 if transmitted else 1], toward[0].shape))
    square = np.sum((toward[..., :2] + incident[:2]) ** 2, axis=-1)
    assert f == pytest.approx(3.0 * np.exp(-0.5 * square / 0.2**2), rel=1e-9)


def test_the_polar_surface_shows_both_sides_where_light_goes() -> None:
    """Transmitted light below what comes from the front, reflected light on the side of the back."""
    for way, side, limits in (
        ("transmitted", "front", (-1.0, 1.0)),
        ("reflected", "back", (-1.0, 0.0)),
    ):
        drawn = et.plot_bsdf(et.bsdf.Gaussian(peak=3.0, sigma=0.2, way=way), side=side)  # type: ignore[arg-type] # both are
        surface: Any = drawn.axes[-1]
        assert len(surface.collections) == 1
        assert surface.get_zlim() == pytest.approx(limits)
