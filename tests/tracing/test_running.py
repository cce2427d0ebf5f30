"""Rounds, stops and continuations: the same bits whatever happens in between, and clear words for what cannot be."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import etendue as et
import h5py
import numpy as np
import pytest
from etendue import _core
from etendue.errors import ArgumentError, FormatError, SceneWarning, UnknownNameError
from etendue.tracing import TraceWarning, running, work
from etendue.tracing.result import TraceResult
from oracles.results import bits
from oracles.verdicts import LARGEST_Z, assert_drawn_with

BATCHES = 2
"""Batches of a round here: with fewer than usual a trace of several rounds is short."""

ONE_ROUND = BATCHES * _core.batch_size()

MOST = 2_280
"""Events kept: so few that they are thinned once more in the second round."""


def luminaire(**more: Any) -> et.Scene:
    """A lens before a tilted LED in a box with a diffuse wall: no symmetry, every kind of event and of detector."""
    screen = {"width": 30, "height": 20, "columns": 6, "rows": 4}
    keys: dict[str, Any] = {
        "name": "lopsided",
        "media": {"tinted": {"index": 1.5, "absorption": 0.05}},
        "sources": [
            {"name": "led", "kind": "surface", "shape": {"kind": "rectangle", "width": 2, "height": 1}, "flux": 90,
             "toward": [0.2, 0.1, 1], "spectrum": [[450, 1], [600, 2]]},
            {"name": "pilot", "kind": "point", "flux": 10, "at": [3, 4, 1]},
        ],
        "solids": [{"name": "lens", "medium": "tinted", "at": [0.5, 0, 4], "shape": {"kind": "lens", "radius": 4,
                    "thickness": 3, "front": {"radius_of_curvature": 9}, "back": {"radius_of_curvature": -7}}}],
        "surfaces": [{"name": "wall", "shape": {"kind": "rectangle", "width": 30, "height": 20}, "at": [9, 0, 5],
                      "toward": [-1, 0, 0.2], "finish": {"kind": "lambertian", "reflectance": 0.7}}],
        "detectors": [
            {"name": "rcs", "kind": "rays", "shape": {"kind": "disk", "radius": 20}, "at": [0, 0, 15]},
            {"name": "far", "kind": "intensity", "c_planes": 6, "gamma_step": 30},
            {"name": "desk", "kind": "illuminance", "width": 40, "height": 30, "columns": 3, "rows": 2, "at": [0, 0, 30],
             "toward": [0, 0, -1]},
            {"name": "eye", "kind": "image", "observer": "side"},
            {"name": "scatter", "kind": "scatter", "most": MOST},
        ],
        "observers": [{"name": "side", "theta": 80, "phi": 190, "distance": 200, "target": [9, 0, 5], "screen": screen}],
    }  # fmt: skip
    return et.Scene(**(keys | more))


@pytest.fixture(scope="module", autouse=True)
def _short_rounds() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for module in (work, running):
            patch.setattr(module, "BATCHES", BATCHES)
        yield


@pytest.fixture(scope="module")
def rounds() -> list[TraceResult]:
    """Results after one, two and all rounds."""
    found = list(et.trace_rounds(luminaire(), 2.5 * ONE_ROUND, 7))
    assert [r.rays_done for r in found] == [ONE_ROUND, 2 * ONE_ROUND, 2.5 * ONE_ROUND]
    return found


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2, 7])
def test_the_same_bits_for_any_number_of_threads(threads: int, rounds: list[TraceResult]) -> None:
    assert bits(et.trace(luminaire(), 2.5 * ONE_ROUND, 7, threads=threads)) == bits(rounds[-1])


@pytest.mark.slow
def test_the_same_bits_after_a_stop(rounds: list[TraceResult], tmp_path: Path) -> None:
    # Events were thinned on the way.
    assert 0 < rounds[0].sums.scattered[4].level < rounds[-1].sums.scattered[4].level
    rounds[0].save(tmp_path / "part.h5")
    before = bits(rounds[0])
    for start in (rounds[0], TraceResult.load(tmp_path / "part.h5"), tmp_path / "part.h5", str(tmp_path / "part.h5")):
        assert bits(et.trace(luminaire(), 2.5 * ONE_ROUND, 7, resume=start)) == bits(rounds[-1])
    # Going on twice from the same result, and from one after another.
    assert bits(et.trace(luminaire(), 2.5 * ONE_ROUND, 7, resume=rounds[1])) == bits(rounds[-1])
    assert bits(rounds[0]) == before
    assert bits(et.trace(luminaire(), 2.5 * ONE_ROUND, 7, resume=rounds[-1])) == bits(rounds[-1])


@pytest.mark.slow
def test_a_file_holds_the_whole_result(rounds: list[TraceResult], tmp_path: Path) -> None:
    path = tmp_path / "result.h5"
    for result in rounds:
        result.save(path)
        again = TraceResult.load(path)
        assert bits(again) == bits(result)
        assert again.plan == result.plan
        assert again.ledger == result.ledger
        assert again.to_dict() == result.to_dict()
        assert again.provenance == result.provenance
        np.testing.assert_array_equal(again.intensity["far"].values, result.intensity["far"].values)
        np.testing.assert_array_equal(again.rays["rcs"].wavelength, result.rays["rcs"].wavelength)
        assert again.illuminance["desk"].header() == result.illuminance["desk"].header()
        assert again.images["eye"].header() == result.images["eye"].header()
    assert et.Scene.from_dict(__import__("tomllib").loads(again.plan.scene_text)) == luminaire()


def test_a_part_stands_for_the_whole(rounds: list[TraceResult]) -> None:
    part, whole = rounds[0], rounds[-1]
    assert not part.complete
    assert whole.complete
    assert any("were traced" in note for note in part.notes)
    assert part.ledger.total.flux == pytest.approx(100.0, rel=1e-6)
    assert whole.ledger.total.flux == pytest.approx(100.0, rel=1e-12)
    n = part.rays_done
    for of in ("far", "desk", "eye"):
        few, many = (
            {**r.intensity, **r.illuminance, **r.images}[of] for r in (part, whole)
        )  # fmt: skip
        known = np.isfinite(few.standard_error) & (few.standard_error > 0) & (many.standard_error > 0)
        # The part is in the whole, so that their difference has the variance of a share 1 − n/N of the part's.
        spread = few.standard_error[known] * math.sqrt(1 - n / whole.rays_done)
        assert np.abs((few.values - many.values)[known] / spread).max() < 5.5
        ratio = few.standard_error[known] / many.standard_error[known]
        assert np.median(ratio) == pytest.approx(math.sqrt(2.5), rel=0.05)
    # Rays of equal flux that arrive or do not.
    share = whole.rays["rcs"].total_flux / 100.0
    spread = math.sqrt(share * (1 - share) / n * (1 - n / whole.rays_done))
    assert abs(part.rays["rcs"].total_flux / 100.0 - share) < LARGEST_Z * spread


def test_the_ledger_closes_and_names_everything(rounds: list[TraceResult]) -> None:
    for result in rounds:
        ledger = result.ledger
        assert ledger.closes
        assert ledger.imbalance < 1e-12
        assert ledger.lost == ()
        assert list(ledger.emitted) == ["led", "pilot"]
        # Of rays there are whole numbers.
        assert ledger.emitted["led"].flux == pytest.approx(90, rel=1e-5)
        assert ledger.by_surface["wall"].flux > 1
        assert ledger.by_medium["tinted"].flux > 1
        assert ledger.by_medium["air"].rays == 0
        assert "wall" in ledger.table()


def test_what_a_collecting_surface_keeps_is_a_ray_set(rounds: list[TraceResult], tmp_path: Path) -> None:
    rays = rounds[0].rays.only
    assert set(np.unique(rays.wavelength)) == {450.0, 555.0, 600.0}
    blue = rays.flux[rays.wavelength == 450.0].sum() / rays.flux[rays.wavelength != 555.0].sum()
    assert blue == pytest.approx(1 / 3, abs=0.01)
    assert np.allclose(rays.position[:, 2], 15.0)
    assert (np.hypot(*rays.position[:, :2].T) <= 20 + 1e-9).all()
    et.write_rays(tmp_path / "rays.tm25ray", rays)
    again = et.read_rays(tmp_path / "rays.tm25ray")
    assert len(again) == len(rays)
    assert again.in_unit("lm").total_flux == pytest.approx(rays.total_flux, rel=1e-6)
    assert np.allclose(again.wavelength, rays.wavelength)


@pytest.mark.slow
def test_one_colour_is_stated_once() -> None:
    rays = et.trace(luminaire(sources=[{"kind": "point", "flux": 1, "wavelength": 470}]), 1e5).rays["rcs"]
    assert "wavelength" not in rays.columns
    assert rays.meaning.single_wavelength == 470.0
    # And the set is a source that another scene can take.
    again = et.trace(et.Scene(sources=[{"kind": "rays", "rays": rays}]), rays=None)
    assert again.rays_done == len(rays)
    assert again.ledger.total.flux == pytest.approx(rays.total_flux, rel=1e-9)
    assert again.plan.scene_text == ""


@pytest.mark.slow
def test_stops_when_the_error_is_small_enough() -> None:
    free = et.trace(luminaire(), 10 * ONE_ROUND, until=0.02)
    assert free.relative_error < 0.02
    assert free.rays_done < 10 * ONE_ROUND
    assert free.rays_done % ONE_ROUND == 0
    with pytest.raises(ArgumentError, match="no detector with cells"):
        et.trace(luminaire(detectors=[]), 1e5, until=0.1)
    for nonsense in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ArgumentError, match="until"):
            et.trace(luminaire(), 1e5, until=nonsense)


@pytest.mark.slow
def test_another_trace_is_not_continued(rounds: list[TraceResult]) -> None:
    start, n = rounds[0], 2.5 * ONE_ROUND
    with pytest.raises(ArgumentError, match="the seed is 7 there and 8 here"):
        et.trace(luminaire(), n, 8, resume=start)
    with pytest.raises(ArgumentError, match="number of rays"):
        et.trace(luminaire(), n + 1, 7, resume=start)
    with pytest.raises(ArgumentError, match="most_events"):
        et.trace(luminaire(), n, 7, resume=start, most_events=3)
    with pytest.raises(ArgumentError, match="the scene"):
        et.trace(luminaire(media={"tinted": {"index": 1.5, "absorption": 0.0500001}}), n, 7, resume=start)
    # The number of rays need not be said again; what a thing is called is not what it is.
    assert bits(et.trace(luminaire(), seed=7, resume=rounds[-1])) == bits(rounds[-1])
    assert et.trace(luminaire(name="renamed"), n, 7, resume=rounds[-1]).complete


def test_names_are_found_and_the_nearest_is_suggested(rounds: list[TraceResult]) -> None:
    result = rounds[0]
    assert list(result.rays) == ["rcs"]
    assert "desk" in result.illuminance
    assert "far" not in result.illuminance
    with pytest.raises(UnknownNameError, match="Did you mean 'desk'"):
        result.illuminance["dsk"]
    two = {"kind": "intensity"}
    with pytest.raises(ArgumentError, match="2 of them"):
        _ = et.trace(luminaire(detectors=[two, two]), 1000).intensity.only
    with pytest.raises(ArgumentError, match="none"):
        _ = et.trace(luminaire(detectors=[]), 1000).rays.only


@pytest.mark.slow
def test_progress_is_told_after_each_round() -> None:
    told: list[int] = []
    et.trace(luminaire(), 2 * ONE_ROUND, progress=told.append)
    assert told == [ONE_ROUND, 2 * ONE_ROUND]


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"rays": 0}, "rays"), ({"rays": 2.5}, "rays"), ({"rays": 2**60}, "rays"), ({"rays": math.nan}, "rays"),
        ({"rays": True}, "rays"), ({"rays": "many"}, "rays"), ({"seed": True}, "seed"), ({"most_events": True}, "most_e"),
        ({"until": True}, "until"), ({"until": "0.1"}, "until"), ({"until": math.nan}, "until"),
        ({"seed": -1}, "seed"), ({"seed": 2**64}, "seed"), ({"most_events": 0}, "most_events"), ({"threads": 0}, "threads"),
    ],
)  # fmt: skip
def test_nonsense_is_refused(arguments: dict[str, Any], match: str) -> None:
    with pytest.raises(ArgumentError, match=match):
        et.trace_rounds(luminaire(), **({"rays": 1000} | arguments))


def test_what_cannot_be_traced_is_refused() -> None:
    with pytest.raises(ArgumentError, match="no source"):
        et.trace(et.Scene())
    rays: Any = et.RingSource(rays=100)
    for nothing, match in (
        (rays, "rays are put in a source"),
        ({"sources": []}, "a dict is no scene"),
        (None, "no scene"),
    ):
        for door in (et.trace, et.trace_rounds, et.trace_work):
            with pytest.raises(ArgumentError, match=match):
                door(nothing)
    many = {"kind": "illuminance", "width": 1, "height": 1, "columns": 65536, "rows": 65536}
    with pytest.raises(ArgumentError, match="cells"):
        et.trace(luminaire(detectors=[many]))


def test_each_ray_of_a_set_once() -> None:
    rng = np.random.default_rng(3)
    n = 70_001
    rays = et.RaySet(rng.normal(size=(n, 3)), rng.normal(size=(n, 3)), rng.random(n))
    plane = {"name": "all", "kind": "rays", "shape": {"kind": "sphere", "radius": 50}}
    scene = et.Scene(sources=[{"kind": "rays", "rays": rays}], detectors=[plane])
    result = et.trace(scene)
    assert result.rays_done == et.trace_work(scene).plan.rays == et.trace_rounds(scene).plan.rays == n
    assert et.trace_work(et.Scene(sources=[{"kind": "point", "flux": 1}])).plan.rays == 10**7
    assert not any("share" in note for note in result.notes)
    np.testing.assert_allclose(np.sort(result.rays["all"].flux), np.sort(rays.flux), rtol=1e-12)
    two = et.trace(et.Scene(sources=[{"kind": "rays", "rays": rays}, {"kind": "rays", "rays": rays, "flux": 1}]))
    assert two.rays_done == 2 * n
    assert any("share" in note for note in two.notes)


# --- what is lost ----------------------------------------------------------------------------------------------------


def test_light_that_gets_no_ray_is_told() -> None:
    """Five candles beside a flood are of no ray, and their light is missing."""
    flood = {"name": "flood", "kind": "point", "flux": 1e4}
    candles = [{"name": f"candle {i}", "kind": "point", "flux": 2.0, "at": [0, 0, i]} for i in range(5)]
    scene = et.Scene(sources=[*candles, flood])
    few = et.trace(scene, rays=1000)
    assert few.ledger.total.flux == pytest.approx(1e4, rel=1e-12)
    (told,) = few.notes
    assert told.startswith("candle 0, candle 1, candle 2 and 2 more: none of 1,000 rays")
    assert "10 lm of 10010 lm are missing" in told
    enough = et.trace(scene, rays=60_000)
    assert enough.ledger.total.flux == pytest.approx(1e4 + 10, rel=1e-12)
    assert not enough.notes


def test_an_open_solid_is_named() -> None:
    """A pyramid without a base: rays leave it that have never entered it."""
    vertices = [[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0], [0, 0, 4]]
    sides = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    tent = {"name": "tent", "medium": "PMMA", "shape": {"kind": "mesh", "vertices": vertices, "triangles": sides}}
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 1, "at": [0.3, 0.2, -3]}
    with pytest.warns(SceneWarning, match="open"), pytest.warns(TraceWarning, match="contradiction, first at tent"):
        ledger = et.trace(et.Scene(sources=[lamp], solids=[tent]), 1e5).ledger
    assert ledger.lost_share > 0.01
    assert ledger.closes
    assert ledger.lost[0].place.startswith("tent")


def test_rays_that_never_end_are_given_up() -> None:
    box = {"name": "box", "shape": {"kind": "sphere", "radius": 5}, "finish": "mirror"}
    result = et.trace(
        et.Scene(sources=[{"kind": "point", "flux": 1, "at": [1, 0, 0]}], surfaces=[box]), 1000, most_events=50
    )
    assert result.ledger.terminated.rays == 1000
    assert result.ledger.closes
    assert any("raise most_events" in note and "reflectance" in note for note in result.notes)


def test_trapped_light_is_told_with_its_medium() -> None:
    """In a block of n = 1.5 all light beyond the critical angle of all six faces stays: 1 − 3 (1 − √(1 − 1/n²)) of it. More
    surfaces would not let it out, and the note does not advise them."""
    block = {"name": "guide", "shape": {"kind": "block", "width": 4, "height": 4, "depth": 4}, "medium": {"index": 1.5}}
    lamp = {"kind": "point", "flux": 1, "at": [0.1, 0.2, 2.3]}
    result = et.trace(et.Scene(sources=[lamp], solids=[block]), 10_000, most_events=1000)
    assert_drawn_with(
        share=1 - 3 * (1 - math.sqrt(1 - 1 / 1.5**2)), hits=result.ledger.terminated.rays, rays=result.rays_done
    )
    (note,) = result.notes
    assert "trapped" in note
    assert "'guide.medium' absorbed nothing" in note
    assert "raise" not in note
    # Few surfaces tell nothing: all light leaves a lens that it comes to from outside, and most needs two.
    lens = {"shape": {"kind": "ball", "radius": 3}, "medium": "BK7", "at": [0, 0, 9]}
    for few, left in ((1, False), (1000, True)):
        through = et.trace(et.Scene(sources=[lamp], solids=[lens]), 1000, most_events=few)
        assert (through.ledger.escaped.rays == 1000) == left == (not through.notes)
        assert all("raise most_events from 1;" in note and "probably" not in note for note in through.notes)
    dim = {**block, "medium": {"index": 1.5, "absorption": 0.5}}
    assert not et.trace(et.Scene(sources=[lamp], solids=[dim]), 10_000).notes


# --- files -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_damage_is_found(tmp_path: Path) -> None:
    path = tmp_path / "result.h5"
    small = et.trace(luminaire(), 20_000)
    small.save(path)
    whole = path.read_bytes()
    found = 0
    rng = np.random.default_rng(5)
    for at in rng.integers(0, len(whole), 60):
        damaged = bytearray(whole)
        damaged[at] ^= 0x5A
        path.write_bytes(damaged)
        try:
            again = TraceResult.load(path)
        except FormatError as error:
            found += str(path) in str(error)
        else:
            assert bits(again) == bits(small)  # room that nothing uses
    assert found > 40
    for length in (0, 7, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(FormatError):
            TraceResult.load(path)


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.h5"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "something else"
    with pytest.raises(FormatError, match="TraceResult"):
        TraceResult.load(path)
    path.write_text("no")
    with pytest.raises(FormatError, match="not the result of a trace"):
        TraceResult.load(path)
    with pytest.raises(OSError, match="none"):
        TraceResult.load(tmp_path / "none.h5")
