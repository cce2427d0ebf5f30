"""``etendue info`` of maps: what kind of map it is, of what, and what its notes say."""

from __future__ import annotations

import zipfile
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.formats.maps import MAP_EXTENSIONS
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.provenance import Provenance

from cli.outcome import Run

LOOKED = Provenance(source="led.tm25ray", software="étendue of this test")


def seen() -> et.LuminanceMap:
    """Three by two pixels, of which one is dead."""
    values = np.array([[1.0, 2.0, 3.5], [4.0, np.nan, 0.5]])
    rays = np.array([[5, 6, 7], [8, 0, 3]])
    eye, screen = et.Observer(20, 50, 700), et.Screen(6, 2, 3, 2)
    return et.LuminanceMap(values, 0.1 * values, rays, eye, screen, provenance=LOOKED, notes=("one pixel is dead",))


@pytest.mark.parametrize("extension", MAP_EXTENSIONS)
def test_a_luminance_map_is_told(extension: str, run: Run) -> None:
    seen().save(f"seen{extension}")
    # By content, whatever the name.
    Path(f"seen{extension}").rename("seen.dat")
    done = run("info", "seen.dat")
    assert done.status == 0, done.err
    for words in (
        "seen.dat: map of luminance",
        "3 × 2 pixels, 6 × 2 mm",
        "of led.tm25ray, by étendue of this test",
        "θ = 20°, φ = 50°, 700 mm",
        "maximum 4",
        "cd/m²",
        "one pixel is dead",
    ):
        assert words in done.out
    (facts,) = run("info", "--json", "seen.dat").json
    assert facts["format"] == "map"
    assert facts["unit"] == "cd/m²"
    assert facts["screen"]["columns"] == 3
    assert facts["notes"][0] == "one pixel is dead"
    assert facts["maximum"] == pytest.approx(4.0, rel=0.01)


def test_an_illuminance_map_is_told(run: Run) -> None:
    values = np.array([[500.0, 300.0], [100.0, 100.0]])
    desk = IlluminanceMap(
        values, 0.01 * values, np.full((2, 2), 90), et.Screen(20, 10, 2, 2, "xy"), centre=(1, 2, 3), provenance=LOOKED
    )
    desk.save("desk.npz")
    done = run("info", "desk.npz")
    assert done.status == 0, done.err
    assert "desk.npz: map of illuminance" in done.out
    assert "mean 250 lx, least/mean 0.4, flux 0.05 lm" in done.out
    (facts,) = run("info", "--json", "desk.npz").json
    assert (facts["mean"], facts["uniformity"], facts["flux"]) == pytest.approx((250.0, 0.4, 250 * 200e-6))
    assert facts["centre"] == [1, 2, 3]
    # Of no light 0 over 0 is no number, which people read as that.
    desk.replace(values=0.0 * values).save("dark.npz")
    assert "mean 0 lx, least/mean undefined, flux 0 lm" in run("info", "dark.npz").out


def test_a_damaged_map_and_an_archive_of_rays_are_what_they_are(run: Run) -> None:
    seen().save("seen.npz")
    whole = Path("seen.npz").read_bytes()
    Path("cut.npz").write_bytes(whole[: len(whole) // 2])
    with zipfile.ZipFile("rays.zip", "w") as file:
        file.writestr("led.ray", b"rays")
    done = run("info", "cut.npz", "rays.zip", "seen.npz")
    assert done.status == 1
    assert "cut.npz" in done.err
    assert "unpack" in done.err.split("rays.zip", 1)[1].lower()
    assert "map of luminance" in done.out


def test_the_maximum_of_a_smoothed_map_is_lifted_by_no_chance_of_single_pixels(run: Run) -> None:
    """Of 400 pixels of 1 ± 0.25 the largest is near 1 + 3 · 0.25; once averaged, pixels err together."""
    noise = np.random.default_rng(3).normal(0.0, 0.25, (20, 20))
    eye, screen = et.Observer(0, 0, 700), et.Screen(20, 20, 20, 20)
    et.LuminanceMap(1.0 + noise, np.full((20, 20), 0.25), np.full((20, 20), 16), eye, screen).save("noisy.npz")
    (noisy,) = run("info", "--json", "noisy.npz").json
    assert noisy["maximum"] - noisy["maximum_apart"] > 0.25
    smooth = run("filter", "noisy.npz", "--kind", "average", "-o", "smooth.npz", "--json").json
    assert smooth["maximum_apart"] == smooth["maximum"]
    assert smooth["common_error"] == 0.0
    et.read_map("noisy.npz").replace(common_error=0.05).save("shared.exr")
    shared = run("filter", "shared.exr", "--kind", "weighted", "-o", "smooth.npz", "--json").json
    assert shared["common_error"] == 0.05
    assert "an error of 5.00% in common, of which means take nothing" in shared["notes"][-1]
    assert "lifted by chance" not in run("info", "smooth.npz").out
