"""Pictures: every pixel in its place and colour, nothing cut off, the same bytes each time."""

from __future__ import annotations

import itertools
import math
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.luminance.comparison import compare, cross_section
from etendue.luminance.regions import Region
from etendue.plot import plot_comparison, plot_cross_sections, plot_map, style
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from matplotlib.colors import LogNorm, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

NAN = math.nan


def make_map(values: Any, screen: Screen | None = None, **fields: Any) -> LuminanceMap:
    values = np.asarray(values, dtype=float)
    plain: dict[str, Any] = {"provenance": Provenance("/data/led.tm25ray"), "observer": Observer(30, 0, 1000)} | fields
    screen = screen or Screen(2.0 * values.shape[1], 2.0 * values.shape[0], values.shape[1], values.shape[0])
    return LuminanceMap(values, 0.05 * values, np.where(np.isnan(values), 0, 400), screen=screen, **plain)


def scene(rows: int, columns: int, width: float, height: float, top: float = 3e5, dead: float = 0.0) -> LuminanceMap:
    """Rings without symmetry, black outside, with dead pixels."""
    rng = np.random.default_rng(rows * columns)
    y, x = np.mgrid[-1 : 1 : rows * 1j, -1 : 1 : columns * 1j]
    values = top * np.where(x**2 + y**2 < 0.5, 1.0 + 0.5 * x, 0.0) * rng.gamma(50, 0.02, (rows, columns))
    values[rng.random((rows, columns)) < dead] = NAN
    return make_map(values, Screen(width, height, columns, rows))


MAPS = {
    "square": scene(128, 128, 70, 70),
    "tiny": scene(3, 4, 4, 3, top=300.0),
    "wide": scene(64, 512, 120, 15),
    "tall": scene(512, 64, 15, 120),
    "stripe": scene(3, 500, 200, 1),
    "one pixel": make_map([[5.0]]),
    "dead pixels": scene(64, 64, 70, 70, dead=0.15),
    "all dead": make_map(np.full((4, 5), NAN)),
    "black": make_map(np.zeros((4, 5))),
    "constant": make_map(np.full((4, 5), 1234.5)),
    "negative": make_map([[-1.0, 2.0, 3.0]]),
    "radiance": scene(40, 60, 30, 20, top=0.03).replace(flux_unit="W"),
    "faint": scene(9, 9, 1e-3, 1e-3, top=1e-9),
    "bright": scene(9, 9, 9e3, 9e3, top=3e9),
    "from afar": make_map([[1.0, 2.0]], observer=Observer(179.123, -359.25, 1.25e9, (1.5, -22.25, 1e3))),
    "no errors": make_map([[1.0, 2.0]]).replace(standard_error=[[NAN, NAN]], rays=[[-1, -1]]),
    "infinite": make_map([[1.0, math.inf, 2.0]]),
}


def assert_nothing_is_cut_off(figure: Figure) -> None:
    """No ink on the outermost dots of the picture, and no tick label over its neighbour."""
    figure.canvas.draw()
    picture = np.asarray(figure.canvas.buffer_rgba())[..., :3]
    assert (picture < 100).any()
    frame = (picture[:3], picture[-3:], picture[:, :3], picture[:, -3:])
    for side, edge in zip(("top", "bottom", "left", "right"), frame, strict=True):
        assert (edge == 255).all(), f"something leaves the picture at the {side}"
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            labels = [tick.label1 for tick in axis._update_ticks() if tick.label1.get_visible()]
            labels = sorted((label for label in labels if label.get_text()), key=lambda label: label.get_position())
            boxes = [label.get_window_extent() for label in labels]
            for (label, box), (_, other) in itertools.pairwise(zip(labels, boxes, strict=True)):
                assert not box.overlaps(other), f"{label.get_text()!r} of {axes.get_ylabel()!r} overlaps its neighbour"


def words(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.texts)


SCALES = {which: ("linear", "log")[:: 1 if index % 2 else -1] for index, which in enumerate(MAPS)}
"""For each map both, of which the first one alternates: every map meets every choice, and every scale every show."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("which", "scale", "show"),
    [(which, *pair) for which in MAPS for pair in zip(SCALES[which], ("value", "relative-error"), strict=True)],
)
def test_every_map_gives_a_picture_with_nothing_cut_off(which: str, scale: Any, show: Any) -> None:
    assert_nothing_is_cut_off(plot_map(MAPS[which], scale=scale, show=show))


def colours_at_pixel_centres(figure: Figure, path: Path, screen: Screen) -> npt.NDArray[np.float64]:
    """What the written file shows where each pixel of the first axes has its centre, shape (rows, columns, 3)."""
    picture = imread(path)[..., :3]
    x, y = np.meshgrid(screen.x, screen.y)
    dots = figure.axes[0].transData.transform(np.stack((x.ravel(), y.ravel()), axis=-1))
    column, row = dots[:, 0].astype(int), (picture.shape[0] - dots[:, 1]).astype(int)
    return picture[row, column].reshape(*screen.shape, 3)


@pytest.mark.parametrize("plane", ["view", "xy"])
def test_every_pixel_is_in_its_place_and_colour(plane: Any, tmp_path: Path) -> None:
    """Row 0 is the top, column 0 the left; compared with the colour map itself, dot by dot in the file."""
    values = np.array([[1.0, 2.0, NAN, 4.0], [5.0, 0.0, 7.0, 8.0], [9.0, 10.0, 11.0, 3.0]])
    lmap = make_map(values, Screen(8, 9, 4, 3, plane))
    figure = plot_map(lmap, tmp_path / "map.png")
    expected = mpl.colormaps["inferno"](values / 11.0)[..., :3]
    expected[0, 2] = to_rgb(style.DEAD)
    np.testing.assert_allclose(
        colours_at_pixel_centres(figure, tmp_path / "map.png", lmap.screen), expected, atol=0.006
    )
    assert figure.axes[0].get_xlim() == (-4.0, 4.0)
    assert figure.axes[0].get_ylim() == (-4.5, 4.5)
    assert ("XY plane" in words(figure)) == (plane == "xy")


def test_logarithmic_colours(tmp_path: Path) -> None:
    """Four decades by default; black pixels are dark, not grey."""
    values = np.array([[1e5, 1e3, 10.0, 1e-3, 0.0, NAN]])
    figure = plot_map(make_map(values), tmp_path / "map.png", "log")
    expected = mpl.colormaps["inferno"](np.array([[1.0, 0.5, 0.0, 0.0, 0.0, 0.0]]))[..., :3]
    expected[0, 5] = to_rgb(style.DEAD)
    found = colours_at_pixel_centres(figure, tmp_path / "map.png", make_map(values).screen)
    np.testing.assert_allclose(found, expected, atol=0.006)


def test_relative_error_is_in_per_cent(tmp_path: Path) -> None:
    lmap = make_map([[100.0, 50.0, 0.0, NAN]]).replace(standard_error=[[2.0, 2.0, 1.0, NAN]])
    figure = plot_map(lmap, tmp_path / "map.png", show="relative-error")
    expected = mpl.colormaps["viridis"](np.array([[0.5, 1.0, 0.0, 0.0]]))[..., :3]
    expected[0, 2:] = to_rgb(style.DEAD)
    np.testing.assert_allclose(
        colours_at_pixel_centres(figure, tmp_path / "map.png", lmap.screen), expected, atol=0.006
    )
    assert "2 pixels without a relative error, or darker than 0.1 % of the maximum (grey, 50 %)" in words(figure)
    assert figure.axes[1].get_ylabel() + figure.axes[1].get_xlabel() == "standard error / luminance [%]"


def test_the_words_say_geometry_rays_and_errors() -> None:
    lmap = MAPS["dead pixels"].replace(observer=Observer(30, 45, 12345, (1, 2, 3)))
    figure = plot_map(lmap, title="My lamp")
    text = words(figure)
    assert "My lamp" in text
    assert "θ = 30°, φ = 45°, from 12\u2009345 mm of (1, 2, 3) mm" in text
    assert "median 400 rays per lit pixel" in text
    assert "standard error 5 %, weighted by flux" in text
    assert f"{lmap.dead_pixels} dead pixels (grey, 1" in text
    assert "led.tm25ray" in text
    assert figure.axes[1].get_ylabel() == "luminance [cd/m²]"
    assert figure.axes[0].get_ylabel() == "vertical on the screen [mm]"
    assert plot_map(MAPS["radiance"]).axes[1].get_ylabel() == "radiance [W/(m² sr)]"


@pytest.mark.parametrize(("which", "scale"), [("all dead", "linear"), ("all dead", "log"), ("black", "log")])
def test_nothing_to_show_has_no_colour_bar(which: str, scale: Any) -> None:
    figure = plot_map(MAPS[which], scale=scale)
    assert len(figure.axes) == 1
    assert figure.axes[0].texts[0].get_text().startswith("no ray" if which == "all dead" else "nothing")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("which", "options", "limits"),
    [
        ("tiny", {}, (0.0, MAPS["tiny"].values.max())),
        ("negative", {}, (-1.0, 3.0)),
        ("constant", {}, (0.0, 1234.5)),
        ("black", {}, (0.0, 1.0)),
        ("infinite", {}, (0.0, 2.0)),
        ("constant", {"vmin": 1000, "vmax": 2000}, (1000, 2000)),
        ("constant", {"scale": "log"}, (123.45, 1234.5)),
        ("negative", {"scale": "log"}, (2.0, 3.0)),
        ("constant", {"scale": "log", "vmin": 1.0}, (1.0, 1234.5)),
    ],
)
def test_limits_of_the_colours(which: str, options: dict[str, Any], limits: tuple[float, float]) -> None:
    norm = plot_map(MAPS[which], **options).axes[0].images[0].norm
    assert isinstance(norm, LogNorm if options.get("scale") == "log" else Normalize)
    assert (norm.vmin, norm.vmax) == pytest.approx(limits)


@pytest.mark.parametrize(
    ("options", "extend"),
    [
        ({}, "neither"),
        ({"vmin": 1.0}, "min"),
        ({"vmax": 2e5}, "max"),
        ({"vmin": 1.0, "vmax": 2e5}, "both"),
        ({"scale": "log"}, "min"),
    ],
)
def test_the_colour_bar_points_to_what_lies_beyond(options: dict[str, Any], extend: str) -> None:
    assert plot_map(MAPS["square"], **options).axes[0].images[0].colorbar.extend == extend


@pytest.mark.parametrize(
    "options",
    [{"vmin": 3, "vmax": 3}, {"vmin": 5, "vmax": 1}, {"vmax": NAN}, {"vmin": -math.inf}, {"scale": "log", "vmin": 0}],
)
def test_ranges_that_are_none_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(ArgumentError, match="vmin < vmax"):
        plot_map(MAPS["tiny"], **options)


def test_unknown_names_get_a_suggestion(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'log'"):
        plot_map(MAPS["tiny"], scale="logg")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="Did you mean 'relative-error'"):
        plot_map(MAPS["tiny"], show="relative_error")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match=r"Did you mean '\.png'"):
        plot_map(MAPS["tiny"], tmp_path / "map.pngg")
    with pytest.raises(ArgumentError, match="does not exist"):
        plot_map(MAPS["tiny"], tmp_path / "absent" / "map.png")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_more_pixels_than_dots_are_averaged_not_dropped(tmp_path: Path) -> None:
    """A bright pixel in every 16 x 16 must leave a trace: averaged, the whole picture is evenly lit."""
    values = np.zeros((2048, 2048))
    values[::16, ::16] = 1.0
    lmap = make_map(values, Screen(1, 1, 2048, 2048))
    figure = plot_map(lmap, tmp_path / "map.png", vmax=1 / 64)
    box = figure.axes[0].get_window_extent()
    picture = imread(tmp_path / "map.png")[..., :3]
    middle = picture[
        int(picture.shape[0] - box.y1) + 20 : int(picture.shape[0] - box.y0) - 20, int(box.x0) + 20 : int(box.x1) - 20
    ]
    blocks = middle[: middle.shape[0] // 16 * 16, : middle.shape[1] // 16 * 16].reshape(
        middle.shape[0] // 16, 16, -1, 16, 3
    )
    assert (blocks.mean(axis=(1, 3)).sum(axis=-1) > 0.05).all()


# --- files -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("extension", [".png", ".svg", ".pdf"])
def test_the_same_map_gives_the_same_bytes(extension: str, tmp_path: Path) -> None:
    first, second = tmp_path / f"first{extension}", tmp_path / f"second{extension}"
    MAPS["dead pixels"].plot(first)
    MAPS["dead pixels"].plot(second, scale="log")
    assert first.read_bytes() != second.read_bytes()
    MAPS["dead pixels"].plot(second)
    assert first.read_bytes() == second.read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


def test_png_holds_no_date_and_no_version(tmp_path: Path) -> None:
    MAPS["tiny"].plot(tmp_path / "map.png")
    data, at, chunks = (tmp_path / "map.png").read_bytes(), 8, set()
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        chunks.add(kind)
        at += 12 + length
    assert chunks == {b"IHDR", b"pHYs", b"IDAT", b"IEND"}


def test_saving_a_map_as_picture_draws_it(tmp_path: Path) -> None:
    lost = MAPS["tiny"].save(tmp_path / "saved.png")
    MAPS["tiny"].plot(tmp_path / "plotted.png")
    assert (tmp_path / "saved.png").read_bytes() == (tmp_path / "plotted.png").read_bytes()
    assert "cannot be read back" in lost[0]


def test_without_a_path_the_figure_comes_back_unregistered() -> None:
    import matplotlib.pyplot as plt

    assert isinstance(MAPS["tiny"].plot(), Figure)
    assert plt.get_fignums() == []


@pytest.mark.slow
def test_matplotlib_waits_until_a_picture_is_asked_for() -> None:
    program = "import sys, etendue.plot; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


# --- cross sections --------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("which", MAPS)
def test_cross_sections_of_every_map(which: str) -> None:
    few, many = SCALES[which]
    lines = [cross_section(MAPS[which], y=0), cross_section(MAPS[which], y=MAPS[which].screen.height / 3)]
    assert_nothing_is_cut_off(plot_cross_sections(lines, scale=few))
    assert_nothing_is_cut_off(plot_cross_sections([cross_section(MAPS[which], x=0)] * 9, scale=many))


def test_cross_sections_draw_steps_with_bands(tmp_path: Path) -> None:
    line = cross_section(make_map([[1.0, NAN, 3.0, 2.0]]), y=0)
    figure = plot_cross_sections([line], tmp_path / "cut.png", labels=["my line"], title="Cut")
    band, steps = (patch.get_data() for patch in figure.axes[0].patches)
    np.testing.assert_array_equal(steps.edges, [-4, -2, 0, 2, 4])
    np.testing.assert_array_equal(steps.values, [1, NAN, 3, 2])
    np.testing.assert_allclose(band.values, 1.05 * np.array([1, NAN, 3, 2]))
    np.testing.assert_allclose(band.baseline, 0.95 * np.array([1, NAN, 3, 2]))
    assert (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()) == (
        "horizontal on the screen [mm]",
        "luminance [cd/m²]",
    )
    assert figure.axes[0].get_legend().get_texts()[0].get_text() == "my line"
    assert imread(tmp_path / "cut.png").ndim == 3


def test_a_cross_section_with_labels_says_where_and_shows_lines_on_the_axis() -> None:
    """The picture alone must tell the place; a line of zeros is drawn over the axis, not clipped by it."""
    dark = LuminanceMap(
        np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 4), dtype=int), Observer(0, 0, 100), Screen(8, 8, 4, 4)
    )
    figure = plot_cross_sections([cross_section(dark, x=-1)], labels=["a"])
    assert any("x = −1 mm" in text.get_text() for text in figure.texts)
    (*_, line) = figure.axes[0].patches
    assert not line.get_clip_on()
    assert line.get_zorder() > max(spine.get_zorder() for spine in figure.axes[0].spines.values())
    assert not any(
        "mm" in text.get_text() for text in plot_cross_sections([cross_section(dark, x=-1)], title="Cut").texts
    )


def test_cross_sections_of_several_maps_are_told_apart() -> None:
    lmap = make_map([[1.0, 4.0, 3.0, 2.0]])
    other = lmap.replace(provenance=Provenance("/data/second.ray"))
    for maps, names in (
        ([lmap], ["at 0 mm up"]),
        ([lmap, other], ["led.tm25ray, at 0 mm up", "second.ray, at 0 mm up"]),
    ):
        legend = plot_cross_sections([cross_section(one, y=0) for one in maps]).axes[0].get_legend()
        assert [text.get_text() for text in legend.get_texts()] == names


def test_cross_sections_that_do_not_fit_together_are_refused() -> None:
    lmap = MAPS["tiny"]
    with pytest.raises(ArgumentError, match="no section"):
        plot_cross_sections([])
    with pytest.raises(ArgumentError, match=r"along x.*along y"):
        plot_cross_sections([cross_section(lmap, y=0), cross_section(lmap, x=0)])
    with pytest.raises(ArgumentError, match=r"luminance.*radiance"):
        plot_cross_sections([cross_section(lmap, y=0), cross_section(lmap.replace(flux_unit="W"), y=0)])
    with pytest.raises(ArgumentError, match="2 labels for 1 sections"):
        plot_cross_sections([cross_section(lmap, y=0)], labels=["a", "b"])
    with pytest.raises(UnknownNameError, match="Did you mean 'linear'"):
        plot_cross_sections([cross_section(lmap, y=0)], scale="linea")  # type: ignore[arg-type]


# --- comparisons -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("which", "scale"),
    # One of the scales for each, and both for those that are laid out in other ways, or have nothing that a logarithm shows.
    [(which, SCALES[which][0]) for which in sorted(set(MAPS) - {"infinite"})]
    + [(which, SCALES[which][1]) for which in ("tall", "black", "negative")],
)
def test_comparisons_of_every_map(which: str, scale: Any) -> None:
    lmap = MAPS[which]
    assert_nothing_is_cut_off(plot_comparison(compare(lmap.replace(values=1.1 * lmap.values), lmap), scale=scale))


def test_comparison_of_two_observers_names_both() -> None:
    """It named the reference's alone, as if both maps had been seen from there."""
    reference = make_map([[1.0, 2.0]])
    test = reference.replace(observer=Observer(10, 20, 300))
    text = words(plot_comparison(compare(test, reference, ignore_geometry=True)))
    one, other = (style.describe_observer(lmap.observer) for lmap in (test, reference))
    assert f"first seen at {one}; second at {other}" in text
    assert f"seen at {other}" in words(plot_comparison(compare(reference, reference)))


def test_comparison_shows_both_maps_alike_and_where_they_differ(tmp_path: Path) -> None:
    reference = make_map([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    test = reference.replace(values=reference.values * [[1, 2, 1], [1, 1, 3]])
    result = compare(test, reference, Region(-1, 3, -2, 1))
    figure = plot_comparison(result, tmp_path / "cmp.png", labels=("mine", "theirs"), title="Mine against theirs")
    images = [axes.images[0] for axes in figure.axes[:3]]
    np.testing.assert_array_equal(images[0].get_array(), test.values)
    np.testing.assert_array_equal(images[1].get_array(), reference.values)
    np.testing.assert_array_equal(images[2].get_array().mask, np.isnan(result.difference))
    # Above 0 where the first is brighter, in per cent of 6.
    signed = 100.0 * (test.values - reference.values) / 6.0
    np.testing.assert_allclose(images[2].get_array().compressed(), signed[~np.isnan(result.difference)])
    assert images[2].get_clim()[0] == -images[2].get_clim()[1]
    assert images[0].get_clim() == images[1].get_clim() == (0.0, 18.0)
    outline = figure.axes[0].patches[0]
    assert {tuple(corner) for corner in outline.get_xy().tolist()} == {(-1, -2), (3, -2), (3, 1), (-1, 1)}
    assert [axes.get_title(loc="left") for axes in figure.axes[:3]] == ["mine", "theirs", "first − second"]
    text = words(figure)
    assert f"NCC {100 * result.ncc:.4g} %" in text
    assert "mine: mean" in text
    assert "Mine against theirs" in text
    with pytest.raises(UnknownNameError):
        plot_comparison(result, scale="logarithmic")  # type: ignore[arg-type]


@pytest.mark.parametrize("rows", [1, 2, 12, 60])
def test_numbers_beside_a_flat_map_do_not_run_into_each_other(rows: int) -> None:
    """A map of 60 columns and of few rows is a strip."""
    ones = np.ones((rows, 60))
    flat = LuminanceMap(ones, ones, ones.astype(int), Observer(0, 0, 100), Screen(10, rows / 6, 60, rows))
    figure = plot_map(flat)
    figure.canvas.draw()
    shown = [label.get_window_extent() for label in figure.axes[0].get_yticklabels() if label.get_text()]
    low, high = figure.axes[0].get_window_extent().intervaly
    shown = sorted((box for box in shown if low <= (box.y0 + box.y1) / 2 <= high), key=lambda box: box.y0)
    assert shown
    assert all(below.y1 <= above.y0 for below, above in itertools.pairwise(shown))
