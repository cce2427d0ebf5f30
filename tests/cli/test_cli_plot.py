"""Pictures of maps and distributions that are in files."""

from __future__ import annotations

import json
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.cli.plot import _common
from matplotlib.image import imread

from cli.outcome import Run


def a_map(*, factor: float = 1.0) -> et.LuminanceMap:
    """Values that differ in every pixel, from 10 to 170 cd/m² times a factor."""
    values = factor * (10.0 + 10.0 * np.arange(17.0)[:16].reshape(4, 4))
    return et.LuminanceMap(values, 0.1 * values, np.full((4, 4), 100), et.Observer(30, 0, 1000), et.Screen(8, 8, 4, 4))


@pytest.fixture
def maps(tmp_path: Path) -> tuple[Path, Path]:
    a_map().save(tmp_path / "dim.npz")
    a_map(factor=3.0).save(tmp_path / "bright.exr")
    return tmp_path / "dim.npz", tmp_path / "bright.exr"


@pytest.mark.slow
def test_pictures_of_every_type(run: Run, maps: tuple[Path, Path]) -> None:
    outcome = run("plot", maps[0], "-o", "a.png", "-o", "a.svg", "-o", "a.pdf", "--title", "My lamp")
    assert outcome.status == 0, outcome.err
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in Path("a.svg").read_bytes()
    assert Path("a.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.slow
def test_several_maps_share_a_scale(run: Run, maps: tuple[Path, Path]) -> None:
    """The range is that of all pixels; the brightest of the dim map is not as bright as that of the other."""
    assert _common([a_map(), a_map(factor=3.0)], "linear", None, None) == ("linear", 0.0, 3.0 * 160.0)
    assert run("plot", *maps, "-o", "{name}.png", "--scale", "linear").status == 0
    together = imread("dim.png")
    assert run("plot", maps[0], "-o", "{name}.png", "--scale", "linear").status == 0
    alone = imread("dim.png")

    def yellow(picture: np.ndarray) -> int:
        """Dots of the colours in which inferno ends; the colour bar has some in both pictures."""
        return int(((picture[..., 1] - picture[..., 2]) > 0.45).sum())

    assert yellow(alone) > 3 * yellow(together)
    with pytest.raises(et.ArgumentError, match="no scale in common"):
        _common([a_map(), a_map().replace(flux_unit="W")], "linear", None, None)


def test_regions_in_figures(run: Run, maps: tuple[Path, Path]) -> None:
    """Left upper quarter: 10, 20, 50, 60; a triangle that holds the two pixels of the top row on the right."""
    outcome = run("plot", maps[0], "-o", "a.png", "--region", "-4,0,0,4", "--region", "0/2,4/2,4/4,0/4", "--json")
    first, second = json.loads(outcome.out)["pictures"][0]["regions"]
    assert (first["mean"], first["minimum"], first["maximum"]) == (35.0, 10.0, 60.0)
    assert second["mean"] == pytest.approx(35.0)
    assert second["minimum"] == 30.0


def test_the_error_of_a_region_is_that_of_its_pixels_together_or_apart(run: Run, tmp_path: Path) -> None:
    """Of rays that were counted, 4 pixels of 10 ± 2 have a mean of 10 ± 1; those of a light field err together: 10 ± 2."""
    for name, rays in (("cone", 25), ("field", -1)):
        lmap = et.LuminanceMap(
            np.full((2, 2), 10.0),
            np.full((2, 2), 2.0),
            np.full((2, 2), rays),
            et.Observer(0, 0, 1000),
            et.Screen(2, 2, 2, 2),
        )
        lmap.save(tmp_path / f"{name}.npz")
        out = run("plot", f"{name}.npz", "-o", "a.png", "--region", "-1,1,-1,1").out
        assert f"region 1: mean {'10.0 ± 1.0' if rays > 0 else '10.0 ± 2.0'} cd/m²" in out


def test_an_intensity_distribution_is_drawn_as_one(run: Run, tmp_path: Path) -> None:
    table = et.Intensity([0.0, 90.0], np.linspace(0, 90, 10), [[1000.0 - 10 * k for k in range(10)]] * 2)
    et.write_intensity(tmp_path / "lamp.ies", table)
    assert run("plot", "lamp.ies", "-o", "lamp.png").status == 0
    refused = run("plot", "lamp.ies", "-o", "lamp.png", "--vmax", "3")
    assert refused.status == 2
    assert "--vmax" in refused.err


def test_complaints_keep_their_severity_and_name_one_of_several_files(run: Run) -> None:
    """Planes of 100 and 200 cd meet at γ = 0: a warning, of the one file that has it."""
    et.write_intensity("sure.ies", et.Intensity([0.0, 90.0], [0.0, 90.0], [[100.0, 1.0], [100.0, 2.0]]))
    et.write_intensity("torn.ies", et.Intensity([0.0, 90.0], [0.0, 90.0], [[100.0, 1.0], [200.0, 2.0]]))
    alone = run("plot", "torn.ies", "-o", "lamp.svg").err
    assert alone.startswith("warning: ")
    assert "torn.ies" not in alone
    assert run("plot", "sure.ies", "torn.ies", "-o", "{name}.svg").err.startswith("warning: torn.ies: ")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("-o", "same.png"), "{name}"),
        (("-o", "{nam}.png"), "name"),
        (("-o", "{name}.bmp"), ".png"),
        (("-o", "{name}.png", "--region", "1,2"), "LEFT,RIGHT,BOTTOM,TOP"),
        (("-o", "{name}.png", "--show", "eror"), "relative-error"),
    ],
)
def test_what_is_refused(run: Run, maps: tuple[Path, Path], words: tuple[str, ...], told: str) -> None:
    outcome = run("plot", *maps, *words)
    assert outcome.status in (1, 2)
    assert told in outcome.err
    assert not list(Path().glob("*.png"))
