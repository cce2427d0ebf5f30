"""The pictures show the function: the right curves at the right places, and nothing that is not there."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.plot.intensity_picture import INTENSITY_KINDS, plot_intensity
from etendue.quantities.intensity import Intensity
from matplotlib.figure import Figure
from oracles.intensity import TERMS, lid

BOTH = pytest.mark.parametrize("kind", INTENSITY_KINDS)


def curves(figure: Figure) -> dict[str, np.ndarray]:
    lines = figure.axes[0].lines
    return {str(line.get_label()): np.asarray(line.get_xydata()) for line in lines if str(line.get_label())[0] != "_"}


@pytest.mark.parametrize("symmetry", TERMS)
def test_the_curves_are_the_function(symmetry: str) -> None:
    led = lid(symmetry, c=tuple(range(7, 367 - 15, 15)))
    drawn = curves(plot_intensity(led, kind="cartesian"))
    assert len(drawn) == 1 if symmetry == "rotational" else len(drawn) >= 2
    for label, points in drawn.items():
        c = 0.0 if label == "all C" else float(label.split(" ")[0][1:])
        gamma, values = points.T
        expected = led.at(np.where(gamma < 0, c + 180.0, c), np.abs(gamma))
        # At γ = 0 both half planes meet.
        assert np.allclose(values[gamma != 0], expected[gamma != 0])


def test_polar_curves_point_down_and_c_lies_on_the_right() -> None:
    led = Intensity([0, 90, 180, 270], [0, 60, 180], [[1, 8, 0], [1, 2, 0], [1, 3, 0], [1, 4, 0]])
    drawn = curves(plot_intensity(led))
    for label, right, left in (("C0 – C180", 8, 3), ("C90 – C270", 2, 4)):
        points = drawn[label]
        for radius, side in ((right, 1), (left, -1)):
            place = radius * np.array([side * np.sin(np.pi / 3), -0.5])
            assert np.abs(points - place).sum(axis=1).min() < 1e-9
        assert points[:, 1].min() == pytest.approx(min(-1, -0.5 * max(right, left)), abs=0.7)


def test_values_below_0_are_no_light_in_the_opposite_direction() -> None:
    """Of 5 cd down, -3 cd at 45° in C0 and 3 cd in C180 nothing goes upwards, and nothing to the right beyond 45°."""
    led = Intensity([0, 180], [0, 45, 90], [[5, -3, 0], [5, 3, 0]])
    figure = plot_intensity(led)
    x, y = curves(figure)["C0 – C180"].T
    assert y.max() < 1e-9
    assert x[np.abs(y) < 1e-9].max() < 1e-9
    assert "values below 0 are drawn as 0" in " ".join(text.get_text() for text in figure.texts)
    # On straight axes they are where they are.
    assert curves(plot_intensity(led, kind="cartesian"))["C0 – C180"][:, 1].min() == -3.0


def test_the_plane_of_the_maximum_is_added_if_it_is_another() -> None:
    values = np.ones((8, 3))
    values[5, 1] = 9.0  # C = 225°: the left half of the plane C45
    led = Intensity(np.arange(8) * 45.0, [0, 30, 90], values)
    assert list(curves(plot_intensity(led))) == ["C0 – C180", "C90 – C270", "C45 – C225 (maximum)"]
    assert len(curves(plot_intensity(lid("both")))) == 2


@BOTH
def test_a_picture_per_klm_is_that_of_the_lamps_flux(kind: str) -> None:
    led = Intensity([0, 90, 180, 270], [0, 60, 90], [[10, 8, 0], [10, 2, 0], [10, 3, 0], [10, 4, 0]])
    for flux, stated in ((4.0, {"lamp_flux": 4.0}), (led.flux, {})):
        figure = plot_intensity(led.replace(luminaire=stated), kind=kind, per_klm=True)  # type: ignore[arg-type]
        points = curves(figure)["C0 – C180"]
        assert np.hypot(*points.T).max() == pytest.approx(1e3 / flux * 10) or kind == "cartesian"
        assert points[:, 1].max() == pytest.approx(1e3 / flux * 10) or kind == "polar"
        texts = [t.get_text() for t in [*figure.axes[0].texts, *figure.texts]] + [figure.axes[0].get_ylabel()]
        assert any("cd/klm" in text for text in texts)
        assert any(f"of the {'lamps' if stated else 'luminaire'}" in text for text in texts)
    with pytest.raises(ArgumentError, match="W/sr cannot be drawn as cd/klm"):
        plot_intensity(led.replace(flux_unit="W"), per_klm=True)


def test_a_polar_picture_names_the_half_planes_and_marks_the_edges_of_the_beam() -> None:
    led = Intensity([0, 90, 180, 270], [0, 60, 120, 180], [[10, 8, 1, 0], [10, 2, 1, 0], [10, 3, 1, 0], [10, 4, 1, 0]])
    figure = plot_intensity(led)
    places = {text.get_text(): text.get_position()[0] for text in figure.axes[0].texts}
    assert places["C0, C90"] > 0 > places["C180, C270"]
    dotted = [line for line in figure.axes[0].lines if line.is_dashed()]
    angles = [np.degrees(np.arctan2(line.get_xdata()[1], -line.get_ydata()[1])) for line in dotted]
    found = [one for sheet in et.data_sheet(led).beam for one in (sheet.left, sheet.right)]
    assert sorted(np.round(angles, 6)) == sorted(np.round(found, 6))
    captions = " ".join(text.get_text() for text in figure.texts)
    assert "beam angle (50 %)" in captions
    assert "field angle (10 %)" in captions


def test_a_dark_back_is_left_out() -> None:
    front = lid("both", gamma=range(0, 91, 5))
    for led, reach in ((front, 90), (lid("both"), 180)):
        axes = plot_intensity(led, kind="cartesian").axes[0]
        assert axes.get_xlim() == (-reach, reach)


@BOTH
def test_noise_is_drawn_and_named(kind: str) -> None:
    led = et.intensity_distribution(et.RingSource(rays=20_000, seed=1), 12, 10)
    figure = plot_intensity(led, kind=kind)  # type: ignore[arg-type]
    assert len(figure.axes[0].collections) + len(figure.axes[0].patches) >= 2
    texts = " ".join(text.get_text() for text in figure.texts)
    assert "median standard error" in texts
    assert "±" in texts
    assert "600" in texts


@pytest.mark.slow
@BOTH
def test_strange_tables(kind: str, tmp_path: Path) -> None:
    for led in (
        Intensity([0], [0, 180], [[0, 0]]),
        Intensity([0], [90, 180], [[1e-9, 3e-9]]),
        Intensity([5, 300], [10, 20], [[1e9, 2], [3, 4]], flux_unit="W"),
        Intensity([0], [0, 90], [[-1, 5]]),
    ):
        path = tmp_path / "a.png"
        plot_intensity(led, path, kind, title="A title")  # type: ignore[arg-type]
        assert path.stat().st_size > 5000


@pytest.mark.slow
@BOTH
def test_the_same_distribution_gives_the_same_bytes(kind: str, tmp_path: Path) -> None:
    for suffix in (".png", ".pdf"):
        paths = [tmp_path / f"{n}{suffix}" for n in "ab"]
        for path in paths:
            plot_intensity(lid("none"), path, kind)  # type: ignore[arg-type]
        assert paths[0].read_bytes() == paths[1].read_bytes()


def test_unknown_names(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="'polar'"):
        plot_intensity(lid("none"), kind="ploar")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="extension"):
        plot_intensity(lid("none"), tmp_path / "a.jpg")
    assert not list(tmp_path.iterdir())
