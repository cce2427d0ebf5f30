"""Arguments of the wrong kind are refused in the words of the call, not where something further in stumbles over them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest

TABLE = et.Intensity([0, 90, 180, 270], np.arange(0, 91, 10.0), [np.cos(np.radians(np.arange(0, 91, 10.0)))] * 4)
VALUES = 10.0 + 10.0 * np.arange(16.0).reshape(4, 4)
LMAP = et.LuminanceMap(VALUES, 0.1 * VALUES, np.full((4, 4), 100), et.Observer(30, 0, 1000), et.Screen(8, 8, 4, 4))
SQUARE = et.Region(-2, 2, -2, 2)
NO_NUMBERS = ("0", None, [1.0, 2.0], LMAP)
NOTHING_KNOWN = ("lamp.ies", None, 3.5, [], {}, LMAP)

CALLS: dict[str, tuple[Callable[[Any], object], tuple[Any, ...]]] = {
    "beam_angle: intensity": (et.beam_angle, NOTHING_KNOWN),
    "beam_angle: c": (lambda wrong: et.beam_angle(TABLE, wrong), NO_NUMBERS),
    "beam_angle: share": (lambda wrong: et.beam_angle(TABLE, share=wrong), NO_NUMBERS),
    "reference": (lambda wrong: et.beam_angle(TABLE, reference=wrong), (None, 3, ("maximum",))),
    "cut_off_angle: intensity": (et.cut_off_angle, NOTHING_KNOWN),
    "cut_off_angle: share": (lambda wrong: et.cut_off_angle(TABLE, wrong), NO_NUMBERS),
    "data_sheet: intensity": (et.data_sheet, NOTHING_KNOWN),
    "zonal_flux: intensity": (lambda wrong: et.zonal_flux(wrong, [0, 90]), NOTHING_KNOWN),
    "zonal_flux: edges": (lambda wrong: et.zonal_flux(TABLE, wrong), ("0,30", [0, "a"], {}, LMAP)),
    "plot_intensity: intensity": (et.plot_intensity, NOTHING_KNOWN),
    "write_intensity: path": (lambda wrong: et.write_intensity(wrong, TABLE), (TABLE, None, 3)),
    "write_intensity: intensity": (lambda wrong: et.write_intensity("a.ies", wrong), NOTHING_KNOWN),
    "intensity_distribution: rays": (et.intensity_distribution, NOTHING_KNOWN),
    "region_statistics: lmap": (lambda wrong: et.region_statistics(wrong, SQUARE), ("a.npz", None, SQUARE)),
    "region_statistics: region": (lambda wrong: et.region_statistics(LMAP, wrong), ((-1, 1, -1, 1), "0,1,0,1", None)),
    "a percentile": (lambda wrong: et.region_statistics(LMAP, SQUARE, wrong), ("50", None, [None], [5, "95"])),
    "rule for dead pixels": (lambda wrong: et.region_statistics(LMAP, SQUARE, dead=wrong), (None, 0)),
    "compare: region": (lambda wrong: et.compare(LMAP, LMAP, wrong), ((-1, 1, -1, 1), "0,1,0,1", 3)),
    "cross_section: x": (lambda wrong: et.cross_section(LMAP, x=wrong), ("0", [1.0], LMAP)),
    "cross_section": (lambda wrong: et.cross_section(wrong, x=0.0), ("a.npz", None, 3)),
    "combine_maps: maps": (et.combine_maps, (LMAP, 3, None)),
    "filter": (lambda wrong: et.filter_map(LMAP, wrong), ("opt", None, 3, ["average"], {})),
    "plot_map: lmap": (et.plot_map, ("a.npz", None, TABLE)),
    "plot_map: region": (lambda wrong: et.plot_map(LMAP, regions=wrong), (SQUARE, [(-1, 1, -1, 1)], None)),
    "plot_map: vmin": (lambda wrong: et.plot_map(LMAP, vmin=wrong), ("0", [1.0])),
    "plot_comparison: comparison": (et.plot_comparison, (LMAP, None)),
    "plot_cross_sections": (et.plot_cross_sections, (LMAP, [LMAP], et.cross_section(LMAP, x=0))),
    "draw_scene: scene": (et.draw_scene, ("a.toml", None, {})),
    "Observer: theta": (lambda wrong: et.Observer(wrong, 0, 1000), NO_NUMBERS),
    "Observer: distance": (lambda wrong: et.Observer(0, 0, wrong), NO_NUMBERS),
    "Screen: width": (lambda wrong: et.Screen(wrong, 8, 4, 4), NO_NUMBERS),
    "Screen: columns": (lambda wrong: et.Screen(8, 8, wrong, 4), NO_NUMBERS),
    "Region: left": (lambda wrong: et.Region(wrong, 1, 0, 1), NO_NUMBERS),
    "PolygonRegion: corners": (
        et.PolygonRegion,
        ([(0, 0, 1), (1, 0, 1), (0, 1, 1)], None, 3, [1, 2, 3], "0/0,1/0,0/1"),
    ),
    "Disk: radius": (lambda wrong: et.Disk(radius=wrong), ("3", LMAP, ["3"])),
    "write_rays: path": (lambda wrong: et.write_rays(wrong, et.RingSource(rays=10)), (et.RingSource(rays=10), None)),
    "write_rays: rays": (lambda wrong: et.write_rays("a.tm25ray", wrong), ("b.tm25ray", None, LMAP)),
    "plot_sweep: table": (et.plot_sweep, ("a.csv", None)),
    "plot_animation": (lambda wrong: et.plot_animation(wrong, "a.gif"), (LMAP, None, ["a.npz", "b.npz"])),
    "deconvolve: scan": (lambda wrong: et.deconvolve(wrong, wrong), ("scan.csv", None, LMAP)),
    "deconvolve_directions: scan": (et.deconvolve_directions, ("scan.csv", None, LMAP)),
    "plot: path": (lambda wrong: et.plot_map(LMAP, wrong), (3, ["a.png"])),
    "LightField.fit: rays": (et.LightField.fit, ("lamp.tm25ray", None, LMAP)),
    "parse_surface: text": (et.parse_surface, (None, 3, et.Disk(radius=3))),
    "path is": (et.read_rays, (None, 3.5, [])),
}
"""By what the message begins with or names: a call, and what it refuses."""


@pytest.mark.parametrize("name", CALLS)
def test_the_message_names_the_argument(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    call, wrong = CALLS[name]
    for given in wrong:
        with pytest.raises(et.EtendueError) as refused:
            call(given)
        assert isinstance(refused.value, ValueError)
        assert name in str(refused.value), given
    assert not list(tmp_path.iterdir())


def test_what_is_meant_is_said() -> None:
    with pytest.raises(et.ArgumentError, match=r"et\.denoise_map\(lmap\)"):
        et.filter_map(LMAP, "opt")
    with pytest.raises(et.ArgumentError, match=r"et\.Region\(left, right, bottom, top\)"):
        et.region_statistics(LMAP, (-1, 1, -1, 1))  # type: ignore[arg-type]
    with pytest.raises(et.ArgumentError, match=r"et\.read_intensity\(path\)"):
        et.beam_angle("lamp.ies")  # type: ignore[arg-type]


def test_numbers_of_numpy_are_numbers() -> None:
    """Scalars, and arrays without axes, as they come out of computations."""
    zero = np.array(0.0)
    assert et.beam_angle(TABLE, zero).angle == et.beam_angle(TABLE, np.float32(0.0)).angle == et.beam_angle(TABLE).angle
    assert et.Disk(radius=np.int64(3)) == et.Disk(radius=3)
    assert et.Observer(np.float64(30.0), 0, np.int32(1000)) == et.Observer(30, 0, 1000)
    assert et.cross_section(LMAP, x=np.float64(1.0)).values.tolist() == VALUES[::-1, 2].tolist()


def test_one_percentile_is_one() -> None:
    """50 and [50] are the same: the median of 60, 70, 100 and 110."""
    one = et.region_statistics(LMAP, SQUARE, 50)
    assert one.percentiles == ((50.0, 85.0),)
    assert one == et.region_statistics(LMAP, SQUARE, [50])


@pytest.mark.slow
def test_the_intensity_of_a_light_field_is_its_own() -> None:
    """By rays of the field, drawn at random, as a second route: all of the flux, and four nodes within four errors
    (by chance once in 4000 times)."""
    field = et.LightField.fit(et.RingSource(rays=20_000, seed=1).ray_set(), et.Disk(radius=30), depths=(2, 2, 2, 2))
    found = et.intensity_distribution(field, 4, 10)
    np.testing.assert_array_equal(found.values, field.intensity(4, 10).values)
    drawn = et.intensity_distribution(field.rays(200_000, seed=3), 4, 10)
    assert drawn.flux == pytest.approx(found.flux)
    row = 3
    assert abs(drawn.values[:, row] - found.values[:, row]).max() < 4 * drawn.standard_error[:, row].max()
