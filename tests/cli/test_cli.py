"""The command line as users meet it: every verb gives the numbers of the API, and fails without leaving anything."""

from __future__ import annotations

import dataclasses
import io
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
import typer.main
from etendue.cli import convert as convert_verb
from etendue.cli import demo as demo_verb
from etendue.cli import luminance as luminance_verb
from etendue.cli.terminal import numbers, print_json
from etendue.cli.verbs import FAMILIES_OF_VERBS, VERBS, command_of
from etendue.formats.rays import RAY_FORMATS
from etendue.quantities.provenance import version
from etendue.quantities.report import RayFileWarning

from cli.outcome import Outcome, Run, files


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files to work on: an off-centre source in three formats, one with defects, and a file that is cut short."""
    place = tmp_path_factory.mktemp("rays")
    source = et.RingSource((2.0, 5.0), (30.0, 20.0), rays=60_000, seed=3).ray_set().moved((1.0, -0.5, 0.0))
    et.write_rays(place / "led.tm25ray", source)
    et.write_rays(place / "led.dat", source.subset(20_000, seed=1), "zemax")
    wavelength = 450.0 + 200.0 * np.arange(5000) / 5000
    small = source.subset(5000, seed=2)
    spectral = et.RaySet(small.position, small.direction, small.flux / 300, flux_unit="W", wavelength=wavelength)
    et.write_rays(place / "watts.tm25ray", spectral)
    (place / "short.tm25ray").write_bytes((place / "led.tm25ray").read_bytes()[:-1000])
    rows = np.column_stack([small.position, small.direction, small.flux])[:50]
    rows[7, 6] = -1.0
    np.savetxt(place / "bad.csv", rows, delimiter=",", fmt="%.9g")
    (place / "nonsense.ray").write_bytes(b"\x00\x01" * 500)
    return place


# --- the program -----------------------------------------------------------------------------------------------------


def verbs() -> dict[str, Any]:
    return {name: command_of(name) for name in (*VERBS, *FAMILIES_OF_VERBS)}


def whole_verbs() -> dict[str, Any]:
    """The verbs by all of their words: those of a family, and the others."""
    found = {}
    for name, verb in verbs().items():
        family = getattr(verb, "commands", {"": verb})
        found.update({f"{name} {second}".strip(): command for second, command in family.items()})
    return found


def test_help_names_every_verb_with_what_it_does(run: Run) -> None:
    outcome = run("--help")
    assert outcome.status == 0
    expected = [
        "demo",
        "info",
        "convert",
        "fit",
        "luminance",
        "sample",
        "intensity",
        "trace",
        "draw",
        "patches",
        "filter",
        "compare",
        "cache",
        "bsdf",
    ]
    assert set(verbs()) == {*expected, "goniometer", "deconvolve", "goniophotometer", "view", "plot", "report", "sweep"}
    for name, verb in verbs().items():
        assert f" {name} " in outcome.out
        assert verb.help


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(whole_verbs()))
def test_help_of_a_verb_explains_every_option_and_argument(run: Run, name: str) -> None:
    outcome = run(*name.split(), "--help")
    assert outcome.status == 0
    for parameter in whole_verbs()[name].params:
        assert parameter.help, f"{name}: {parameter.name} has no help"
        assert parameter.help.split("{")[0].split("[")[0].strip()[:60] in outcome.out
        for spelling in parameter.opts if parameter.param_type_name == "option" else ():
            assert spelling in outcome.out
    assert "--json" in outcome.out


def test_every_verb_that_draws_random_numbers_takes_a_seed() -> None:
    seeded = {name for name, verb in verbs().items() if any("--seed" in p.opts for p in verb.params)}
    assert seeded == {
        "demo",
        "convert",
        "deconvolve",
        "draw",
        "fit",
        "goniometer",
        "goniophotometer",
        "luminance",
        "report",
        "sample",
        "sweep",
        "trace",
        "view",
        "patches",
    }


def test_version(run: Run) -> None:
    assert run("--version") == Outcome(0, f"etendue {version()}\n", "")


def test_the_package_runs_as_a_module() -> None:
    out = subprocess.run(
        [sys.executable, "-m", "etendue", "--version"], check=True, capture_output=True, text=True, timeout=60
    ).stdout
    assert out == f"etendue {version()}\n"


def test_no_verb_shows_the_help(run: Run) -> None:
    outcome = run()
    assert outcome.status == 2
    assert "luminance" in outcome.out + outcome.err


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["luminace"], "'luminance'"),
        (["demo", "--ray", "1000000"], "--rays"),
        (["compare", "a.npz", "b.npz", "--ded", "zero"], "--dead"),
        (["compare", "a.npz", "b.npz", "--dead", "exlude"], "'exclude'"),
        (["filter", "a.npz", "--kind", "wieghted", "-o", "b.npz"], "'weighted'"),
        (["filter", "a.npz", "--kind", "weighted", "-o", "b.npz", "--scale", "lin"], "'linear'"),
        (["convert", "a.dat", "b.ray", "--format", "lightools"], "'lighttools'"),
        (["luminance", "a.dat", "--observer", "0,0", "--size", "1,1", "-o", "a.npz", "--plane", "veiw"], "'view'"),
        (["luminance", "a.dat", "--observer", "0,0", "--size", "1,1", "-o", "a.npz", "--method", "cones"], "'cone'"),
        (["sample", "a.h5", "-n", "5", "-o", "b.dat", "--format", "zemaxx"], "'zemax'"),
    ],
)
def test_a_misspelt_name_is_met_with_the_nearest_one(run: Run, tmp_path: Path, arguments: list[str], hint: str) -> None:
    outcome = run(*arguments)
    assert outcome.status == 2
    assert hint in outcome.err
    assert outcome.out == ""
    assert files(tmp_path) == []


LUMINANCE = ["luminance", "led.tm25ray", "--observer", "0,0", "--size", "10,8", "-o", "a.npz"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ["luminance"],
        ["luminance", "led.tm25ray", "--size", "1,1", "-o", "a.npz"],  # no observer
        ["luminance", "led.tm25ray", "--observer", "30", "--size", "1,1", "-o", "a.npz"],
        ["luminance", "led.tm25ray", "--observer", "thirty,0", "--size", "1,1", "-o", "a.npz"],
        [*LUMINANCE, "--pixels", "12.7,3"],  # 12 would be another map than the one asked for
        [*LUMINANCE, "--pixels", "nan,3"],
        [*LUMINANCE, "--pixels", "12,12,12"],
        [*LUMINANCE, "--target", "0,0"],
        [*LUMINANCE, "--threads", "0"],
        [*LUMINANCE, "--threads", "-2"],
        [*LUMINANCE, "--distance", "far"],
        [*LUMINANCE, "--flux", "12 candela"],
        [*LUMINANCE, "--flux", "1e"],
        [*LUMINANCE, "--unit", "lumen"],
        ["convert", "led.tm25ray"],
        ["convert", "led.tm25ray", "x.dat", "--flux", "1", "--flux", "2"],
        ["compare", "a.npz"],
        ["compare", "a.npz", "b.npz", "--section-output", "s.png"],  # a cut along nothing
        ["compare", "a.npz", "b.npz", "--section-x", "1"],
        ["filter", "a.npz", "-o", "b.npz"],
        ["demo", "--rays", "10"],
        ["demo", "--rays", "99999.5"],
        ["sample", "a.h5", "-n", "1e400", "-o", "x.tm25ray"],
        ["sample", "a.h5", "-n", "nan", "-o", "x.tm25ray"],
        ["sample", "a.h5", "-n", "0.5", "-o", "x.tm25ray"],
        ["sample", "a.h5", "-n", "0", "-o", "x.tm25ray"],
        ["sample", "a.h5", "-n", "1e19", "-o", "x.tm25ray"],
        ["convert", "led.tm25ray", "x.dat", "--subset", "few"],
        ["info"],
    ],
)
def test_wrong_usage_ends_with_status_2(run: Run, folder: Path, arguments: list[str], tmp_path: Path) -> None:
    if "led.tm25ray" in arguments:
        (tmp_path / "led.tm25ray").symlink_to(folder / "led.tm25ray")
    before = files(tmp_path)
    outcome = run(*arguments)
    assert outcome.status == 2, outcome
    assert "Error" in outcome.err
    assert "Traceback" not in outcome.err
    assert files(tmp_path) == before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["info", "{}/nothere.ray"], "No such file"),
        (["info", "{}"], "directory"),
        (["info", "{}/nonsense.ray"], "Known formats"),
        (["convert", "{}/nothere.ray", "x.dat"], "nothere.ray: No such file"),
        (["convert", "{}/led.tm25ray", "x.ray"], "belongs to several formats"),
        (["convert", "{}/led.tm25ray", "x.xyz"], "belongs to no ray format"),
        (["convert", "{}/led.tm25ray", "x.dat", "--subset", "0"], "subset: the number of rays is 0"),
        (["convert", "{}/led.tm25ray", "x.dat", "--subset", "60001"], "is 60001; give a whole number from 1 to 60,000"),
        (["convert", "{}/led.tm25ray", "x.dat", "--subset", "5", "--seed", "-1"], "seed -1"),
        (["convert", "{}/led.tm25ray", "x.dat", "--unit", "W"], "no spectrum"),
        (["convert", "{}/led.tm25ray", "x.dat", "--flux", "0"], "finite flux > 0"),
        (["convert", "{}/led.tm25ray", "x.dat", "--flux", "1e300"], "32-bit"),
        (["convert", "{}/led.tm25ray", "{}/watts.tm25ray", "x.dat", "--unit", "W"], "lm cannot become watts"),
        (["luminance", "{}/led.tm25ray", "--observer", "181,0", "--size", "1,1", "-o", "a.npz"], "0° to 180°"),
        (
            ["luminance", "{}/led.tm25ray", "--observer", "90,0", "--size", "1,1", "-o", "a.npz", "--plane", "xy"],
            "area",
        ),
        (["luminance", "{}/led.tm25ray", "--observer", "0,0", "--size", "0,1", "-o", "a.npz"], "width is 0"),
        (["luminance", "{}/led.tm25ray", "--observer", "0,0", "--size", "1,1", "-o", "a.exrr"], ".exrr"),
        (["luminance", "{}/led.tm25ray", "--observer", "0,0", "-o", "a.npz", "-o", "a.npz"], "a.npz is stated twice"),
        (
            ["luminance", "{}/led.tm25ray", "--observer", "0,0", "--size", "1,1", "-o", "a.npz", "--acceptance", "0"],
            "acceptance is 0",
        ),
        (["luminance", "{}/nonsense.ray", "--observer", "0,0", "--size", "1,1", "-o", "a.npz"], "nonsense.ray"),
        (
            ["filter", "{}/led.tm25ray", "--kind", "average", "-o", "b.npz"],
            "this is a ray file (IES TM-25 ray file), no map",
        ),
        (["compare", "{}/nothere.npz", "{}/nothere.npz"], "No such file"),
        (["demo", "--seed", "-1", "-o", "d.png"], "--seed is -1"),
        (["demo", "-o", "d.exe"], ".png"),
    ],
)
def test_data_that_cannot_be_used_ends_with_status_1_and_no_file(
    run: Run, folder: Path, tmp_path: Path, arguments: list[str], message: str
) -> None:
    outcome = run(*(a.format(folder) for a in arguments))
    assert outcome.status == 1, outcome
    assert "error: " in outcome.err
    assert message in outcome.err
    assert files(tmp_path) == []


def test_a_failing_run_leaves_the_old_output_as_it_was(run: Run, folder: Path, tmp_path: Path) -> None:
    (tmp_path / "x.dat").write_text("mine")
    assert run("convert", folder / "led.tm25ray", "x.dat", "--flux", "1e300").status == 1
    assert (tmp_path / "x.dat").read_text() == "mine"
    assert files(tmp_path) == ["x.dat"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["convert", "led.tm25ray", "no/x.dat"],
        ["luminance", "led.tm25ray", "--observer", "0,0", "--size", "1,1", "-o", "a.npz", "-o", "no/a.npz"],
        ["luminance", "led.tm25ray", "--observer", "0,0", "--size", "1,1", "-o", "{theta}/a.npz"],
        ["demo", "-o", "no/d.png"],
    ],
)
def test_a_folder_that_does_not_exist_is_refused_before_any_work(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, arguments: list[str]
) -> None:
    for module, name in ((convert_verb, "read_rays"), (luminance_verb, "read_source"), (demo_verb, "luminance_map")):
        monkeypatch.setattr(module, name, lambda *_, **__: pytest.fail("work was done"))
    outcome = run(*arguments)
    assert outcome.status == 1
    assert "does not exist. Create it first" in outcome.err
    assert files(tmp_path) == []


# --- info ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["led.tm25ray", "led.dat", "watts.tm25ray"])
def test_info_tells_what_the_api_knows(run: Run, folder: Path, name: str) -> None:
    path = folder / name
    (facts,) = run("info", path, "--json").json
    rays = et.read_rays(path)
    assert (facts["file"], facts["format"]) == (str(path), rays.provenance.format)
    assert (facts["rays"], facts["usable_rays"], facts["flux_unit"]) == (len(rays), len(rays), rays.flux_unit)
    assert facts["total_flux"] == rays.total_flux
    assert facts["virtual_focus"] == list(rays.virtual_focus.point)
    assert facts["bounding_box"] == [[float(c.min()), float(c.max())] for c in rays.position.T]
    flux = next(rays.batches()).flux
    assert facts["flux_per_ray"] == [flux.min(), flux.max()]
    assert facts["effective_rays"] == rays.tally.effective_rays
    mean = rays.flux @ rays.direction
    assert facts["mean_direction"] == pytest.approx(mean / np.linalg.norm(mean), rel=1e-9)
    assert [c["found"] for c in facts["complaints"]] == [c.found for c in rays.complaints]
    assert ("450 to 650 nm" in facts["spectrum"]) == (name == "watts.tm25ray")


def test_info_for_people_says_the_same(run: Run, folder: Path) -> None:
    outcome = run("info", folder / "led.tm25ray")
    rays = et.read_rays(folder / "led.tm25ray")
    for piece in ("IES TM-25 ray file", "60,000", "50 lm", "virtual focus"):
        assert piece in outcome.out
    focus = ", ".join(f"{c:.4f}" for c in rays.virtual_focus.point)
    assert f"({focus}) mm" in outcome.out


def test_info_describes_the_good_files_beside_a_bad_one(run: Run, folder: Path) -> None:
    names = ("led.dat", "nonsense.ray", "nothere", "watts.tm25ray")
    outcome = run("info", *(folder / name for name in names), "--json")
    assert outcome.status == 1
    good, bad, missing, watts = outcome.json
    assert (good["rays"], watts["rays"]) == (20_000, 5_000)
    assert "Known formats" in bad["error"]
    assert missing == {"file": str(folder / "nothere"), "error": "No such file or directory"}
    people = run("info", folder / "led.dat", folder / "nonsense.ray")
    assert people.status == 1
    assert "20,000" in people.out
    assert "error: " in people.err
    assert "nonsense.ray" in people.err


def test_info_counts_and_names_defects(run: Run, folder: Path) -> None:
    outcome = run("info", folder / "bad.csv")
    assert outcome.status == 0
    assert "50, 1 of them cannot be used" in outcome.out
    assert "1 of 50 rays have negative flux" in outcome.out


def test_info_of_rays_that_cannot_be_used_does_not_call_them_far_field_data(run: Run, tmp_path: Path) -> None:
    (tmp_path / "nan.csv").write_text("x_mm,y_mm,z_mm,l,m,n,flux_lm\n" + "0,0,0,0,0,1,nan\n" * 5, encoding="utf-8")
    told = run("info", tmp_path / "nan.csv").out
    assert "none (no ray can be used)" in told
    assert "not determined (no ray can be used)" in told
    assert "far-field" not in told


def test_info_tells_of_rays_that_a_file_holds_twice(run: Run, folder: Path) -> None:
    """A set merged with itself: half of its rays repeat another one. Each way of asking says so, and of no other file."""
    merged = run("convert", folder / "led.dat", folder / "led.dat", "twice.csv")
    assert "shares 100.00% of its rays with" in merged.err
    assert "50.00% of the rays repeat another one" in run("info", "twice.csv").out
    (facts,) = run("info", "twice.csv", "--json").json
    assert [c["severity"] for c in facts["complaints"] if "repeat" in c["found"]] == ["warning"]
    (alone,) = run("info", folder / "led.dat", "--json").json
    assert facts["effective_rays"] == pytest.approx(alone["effective_rays"], rel=1e-6)
    assert "repeat" not in run("info", folder / "led.dat").out


def test_info_of_pencils_of_light_counts_all_their_rays(run: Run, tmp_path: Path) -> None:
    """6 000 equal rays along three lines: light of no width, and no copies of three rays."""
    place = np.tile(5.0 * np.eye(3), (2000, 1))
    et.write_rays(tmp_path / "pencils.tm25ray", et.RaySet(place, np.tile([0.0, 0, 1], (6000, 1)), np.ones(6000)))
    (facts,) = run("info", tmp_path / "pencils.tm25ray", "--json").json
    assert facts["effective_rays"] == pytest.approx(6000)
    assert not [c for c in facts["complaints"] if "repeat" in c["found"]]


def test_info_tells_the_wavelengths_that_are_known(run: Run, tmp_path: Path, folder: Path) -> None:
    data = bytearray((folder / "watts.tm25ray").read_bytes())
    rays = np.asarray(et.read_rays(folder / "watts.tm25ray").records)
    first = len(data) - rays.nbytes + rays.dtype.fields["wavelength"][1]  # type: ignore[index]
    for index, stored in ((0, math.nan), (7, math.inf)):
        data[first + index * rays.itemsize : first + index * rays.itemsize + 4] = np.float32(stored).tobytes()
    (tmp_path / "odd.tm25ray").write_bytes(data)
    assert "wavelength per ray, 450 to 650 nm" in run("info", "odd.tm25ray").out


# --- convert ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("format_", [f.name for f in RAY_FORMATS])
def test_convert_writes_every_format(run: Run, folder: Path, tmp_path: Path, format_: str) -> None:
    outcome = run("convert", folder / "watts.tm25ray", "out.bin", "--format", format_, "--flux", "2W", "--json")
    assert outcome.status == 0, outcome.err
    rays = et.read_rays(tmp_path / "out.bin")
    assert rays.provenance.format == format_
    assert outcome.json["rays"] == len(rays) == 5000
    assert outcome.json["output"] == "out.bin"
    assert (outcome.json["total_flux"], outcome.json["flux_unit"]) == (2.0, "W")
    found, given = rays.position, et.read_rays(folder / "watts.tm25ray").position
    if format_ == "etd":  # it has an order of its own
        found, given = (x[np.lexsort(x.T)] for x in (found, given))
    np.testing.assert_allclose(found, given, atol=1e-5)


def test_convert_tells_what_a_format_cannot_hold(run: Run, folder: Path) -> None:
    outcome = run("convert", folder / "led.dat", "out.ray", "--format", "speos")
    assert outcome.status == 1
    assert "wavelength" in outcome.err
    outcome = run("convert", folder / "watts.tm25ray", "out.dis")
    assert outcome.status == 0
    assert "note: " in outcome.err
    assert "wavelength" in outcome.err


def test_convert_finds_the_format_in_the_extension(run: Run, folder: Path, tmp_path: Path) -> None:
    outcome = run("convert", folder / "led.dat", "out.TM25ray")
    assert (outcome.status, outcome.out) == (0, "out.TM25ray: 20,000 rays, 50 lm\n")
    assert et.read_rays(tmp_path / "out.TM25ray").provenance.format == "tm25"


@pytest.mark.parametrize(("flux", "total"), [("337", 337.0), ("337lm", 337.0), (" 1.5e2 lm ", 150.0)])
def test_convert_overrides_the_flux(run: Run, folder: Path, tmp_path: Path, flux: str, total: float) -> None:
    assert run("convert", folder / "led.dat", "out.tm25ray", "--flux", flux).status == 0
    assert et.read_rays(tmp_path / "out.tm25ray").total_flux == pytest.approx(total, rel=1e-7)


def test_convert_goes_from_watts_to_lumens(run: Run, folder: Path, tmp_path: Path) -> None:
    expected = et.read_rays(folder / "watts.tm25ray").in_unit("lm").total_flux
    outcome = run("convert", folder / "watts.tm25ray", "out.dat", "--unit", "lm", "--json").json
    assert (outcome["flux_unit"], outcome["total_flux"]) == ("lm", expected)
    assert et.read_rays(tmp_path / "out.dat").total_flux == pytest.approx(expected, rel=1e-6)


def test_convert_draws_the_subset_of_the_api(run: Run, folder: Path, tmp_path: Path) -> None:
    for seed in (1, 8):
        arguments = ["--subset", 100, *([] if seed == 1 else ["--seed", seed])]
        assert run("convert", folder / "led.tm25ray", "out.dat", *arguments).status == 0
        expected = et.read_rays(folder / "led.tm25ray").subset(100, seed=seed)
        np.testing.assert_array_equal(et.read_rays(tmp_path / "out.dat").position, expected.position)
        assert et.read_rays(tmp_path / "out.dat").total_flux == pytest.approx(50.0, rel=1e-6)


def test_convert_merges_with_a_flux_for_each(run: Run, folder: Path, tmp_path: Path) -> None:
    inputs = [folder / "led.dat", folder / "led.tm25ray"]
    outcome = run("convert", *inputs, "white.tm25ray", "--flux", "23lm", "--flux", "314", "--json").json
    assert (outcome["rays"], outcome["total_flux"]) == (80_000, pytest.approx(337.0, rel=1e-10))
    white = et.read_rays(tmp_path / "white.tm25ray")
    assert white.flux[:20_000].sum() == pytest.approx(23.0, rel=1e-6)
    assert white.flux[20_000:].sum() == pytest.approx(314.0, rel=1e-6)


def test_convert_prints_complaints_and_losses_and_keeps_standard_output_clean(run: Run, folder: Path) -> None:
    outcome = run("convert", folder / "bad.csv", folder / "watts.tm25ray", "out.dat", "--flux", "1W", "--flux", "2W")
    assert outcome.status == 0
    assert "1 of 50 rays have negative flux" in outcome.err
    assert "note: " in outcome.err
    assert outcome.out == "out.dat: 5,049 rays, 3 W\n"
    as_json = run("convert", folder / "bad.csv", "out.csv", "--json")
    assert any("negative flux" in line for line in as_json.json["complaints"])


# --- luminance, filter, compare --------------------------------------------------------------------------------------

CONE = ("--acceptance", "6")
VIEW = ("--observer", "25,-40", "--distance", 300, "--target", "1,-0.5,0", "--size", "12,9", "--pixels", "12,9")


def api_view(**changes: Any) -> tuple[et.Observer, et.Screen]:
    observer = et.Observer(25, -40, 300, (1, -0.5, 0))
    return observer, dataclasses.replace(et.Screen(12, 9, 12, 9), **changes)


@pytest.mark.parametrize(
    ("options", "screen", "method"),
    [
        (("--acceptance", "auto"), {}, {"acceptance": "auto"}),
        (("--method", "cone", "--acceptance", "auto"), {}, {"method": "cone", "acceptance": "auto"}),
        (("--method", "cone"), {}, {"method": "cone"}),
        (
            ("--method", "cone", "--acceptance", "4.5", "--plane", "xy"),
            {"plane": "xy"},
            {"method": "cone", "acceptance": 4.5},
        ),
        (("--acceptance", "6"), {}, {"method": "cone", "acceptance": 6.0}),
        (("--acceptance", "6", "--threads", "2"), {}, {"acceptance": 6.0, "threads": 1}),
    ],
)
def test_luminance_is_the_map_of_the_api(
    run: Run, folder: Path, tmp_path: Path, options: Any, screen: Any, method: Any
) -> None:
    outcome = run("luminance", folder / "led.tm25ray", *VIEW, *options, "-o", "a.npz", "--json")
    expected = et.luminance_map(et.read_rays(folder / "led.tm25ray"), *api_view(**screen), **method)
    written = et.read_map(tmp_path / "a.npz")
    np.testing.assert_array_equal(written.values, expected.values)
    np.testing.assert_array_equal(written.standard_error, expected.standard_error)
    np.testing.assert_array_equal(written.rays, expected.rays)
    (facts,) = outcome.json["maps"]
    assert facts["intensity"] == expected.intensity
    assert facts["maximum"] == np.nanmax(expected.values)
    assert facts["mean_of_live_pixels"] == pytest.approx(np.nanmean(expected.values), rel=1e-12)
    assert (facts["dead_pixels"], facts["pixels"], facts["rays"]) == (expected.dead_pixels, 108, expected.rays.sum())
    assert facts["notes"] == list(expected.notes)
    assert facts["outputs"] == ["a.npz"]


def test_an_index_is_looked_at_by_the_cone(run: Run, folder: Path, tmp_path: Path) -> None:
    """Made by convert, told by its content, counted as its rays are, and it says so."""
    assert run("convert", folder / "led.tm25ray", "led.etd").status == 0
    (tmp_path / "led.etd").rename(tmp_path / "led.dat")
    for given, options in (({}, ()), ({"acceptance": 6.0}, CONE), ({"acceptance": "auto"}, ("--acceptance", "auto"))):
        outcome = run("luminance", "led.dat", *VIEW, *options, "-o", "a.npz", "--json")
        acceptance: Any = given.get("acceptance", 1.5)
        expected = et.luminance_map(
            et.read_rays(folder / "led.tm25ray"), *api_view(), method="cone", acceptance=acceptance
        )
        seen = et.read_map(tmp_path / "a.npz")
        np.testing.assert_array_equal(seen.rays, expected.rays)
        np.testing.assert_allclose(seen.values, expected.values, rtol=1e-12)
        (facts,) = outcome.json["maps"]
        assert sum(note.startswith("by the index") for note in facts["notes"]) == 1
    assert run("info", "led.dat").out.splitlines()[1].split(maxsplit=1)[1] == "étendue ray index"
    assert files(tmp_path) == ["a.npz", "led.dat"]


def test_a_cut_index_ends_with_status_1_and_no_file(run: Run, folder: Path, tmp_path: Path) -> None:
    run("convert", folder / "led.tm25ray", "led.etd")
    data = (tmp_path / "led.etd").read_bytes()
    (tmp_path / "led.etd").write_bytes(data[:-1])
    outcome = run("luminance", "led.etd", *VIEW, "-o", "a.npz")
    assert outcome.status == 1
    assert "led.etd" in outcome.err
    assert f"byte {len(data) - 1}" in outcome.err
    assert files(tmp_path) == ["led.etd"]


def test_luminance_takes_another_flux_and_unit(run: Run, folder: Path, tmp_path: Path) -> None:
    assert run("luminance", folder / "watts.tm25ray", *VIEW, *CONE, "--flux", "2W", "-o", "w.npz").status == 0
    radiance = et.read_map(tmp_path / "w.npz")
    assert radiance.unit == "W/(m² sr)"
    stated = ("--flux", "2W", "--unit", "lm")
    assert run("luminance", folder / "watts.tm25ray", *VIEW, *CONE, *stated, "-o", "l.npz").status == 0
    rays = et.read_rays(folder / "watts.tm25ray").with_total_flux(2.0).in_unit("lm")
    luminance = et.read_map(tmp_path / "l.npz")
    assert luminance.unit == "cd/m²"
    np.testing.assert_array_equal(luminance.values, et.luminance_map(rays, *api_view(), acceptance=6).values)
    assert (luminance.values != radiance.values).any()


@pytest.mark.slow
def test_many_observers_are_served_in_one_run_and_fill_in_their_names(run: Run, folder: Path, tmp_path: Path) -> None:
    observers = ["--observer", "0,0", "--observer", "30,12.5", "--observer", "30,-90"]
    outputs = ["-o", "t{theta}p{phi}.npz", "-o", "t{theta}p{phi}.png"]
    outcome = run("luminance", folder / "led.tm25ray", *VIEW[2:], *CONE, *observers, *outputs, "--json")
    names = ["t0p0", "t30p12.5", "t30p-90"]
    assert files(tmp_path) == sorted(f"{name}{end}" for name in names for end in (".npz", ".png"))
    assert [m["outputs"] for m in outcome.json["maps"]] == [[f"{name}.npz", f"{name}.png"] for name in names]
    for name, (theta, phi) in zip(names, [(0, 0), (30, 12.5), (30, -90)], strict=True):
        seen = et.read_map(tmp_path / f"{name}.npz")
        assert seen.observer == et.Observer(theta, phi, 300, (1, -0.5, 0))
        alone = et.luminance_map(et.read_rays(folder / "led.tm25ray"), seen.observer, seen.screen, acceptance=6)
        np.testing.assert_array_equal(seen.values, alone.values)


def test_observers_that_would_overwrite_each_other_are_refused(run: Run, folder: Path, tmp_path: Path) -> None:
    outcome = run(
        "luminance", folder / "led.tm25ray", *VIEW, "--observer", "30,0", "-o", "t{theta}.npz", "-o", "all.npz"
    )
    assert outcome.status == 1
    assert "{theta} and {phi}" in outcome.err
    assert files(tmp_path) == []


def test_people_read_figures_notes_and_file_names(run: Run, folder: Path) -> None:
    outcome = run("luminance", folder / "led.tm25ray", *VIEW, *CONE, "-o", "a.exr", "-o", "a.png", "--scale", "log")
    assert outcome.status == 0
    for piece in (
        "luminance from θ = 25°, φ = -40°, 300 mm",
        "cd/m²",
        "intensity towards the observer",
        "a.exr",
        "a.png",
    ):
        assert piece in outcome.out


def test_a_screen_that_sees_nothing_ends_well_with_a_hint(run: Run, folder: Path) -> None:
    arguments = [
        "luminance",
        folder / "led.tm25ray",
        *VIEW[:4],
        "--size",
        "1,1",
        "--pixels",
        "2,2",
        "--target",
        "500,0,0",
        *CONE,
    ]
    outcome = run(*arguments, "-o", "a.npz", "--json")
    assert outcome.status == 0
    (facts,) = outcome.json["maps"]
    assert (facts["maximum"], facts["mean_of_live_pixels"], facts["intensity"], facts["dead_pixels"]) == (
        None,
        None,
        0,
        4,
    )
    people = run(*arguments, "-o", "b.npz")
    assert people.status == 0
    assert "the screen shows 0.0% of the light" in people.out
    assert "about the target" in people.out


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory, folder: Path) -> tuple[Path, Path]:
    """Two noisy maps of the same view, outside the folder that the program works in."""
    place = tmp_path_factory.mktemp("maps")
    for name, file in (("a", "led.tm25ray"), ("b", "led.dat")):
        et.luminance_map(et.read_rays(folder / file), *api_view(), method="cone", acceptance=3.0).save(
            place / f"{name}.npz"
        )
    return place / "a.npz", place / "b.npz"


@pytest.mark.parametrize("kind", ["average", "weighted", "selective", "selective-weighted"])
def test_filter_is_the_filter_of_the_api(run: Run, maps: tuple[Path, Path], tmp_path: Path, kind: str) -> None:
    gamma = ("--gamma", 0.4) if kind.startswith("selective") else ()
    outcome = run("filter", maps[0], "--kind", kind, "--size", 3, *gamma, "-o", "f.npz", "-o", "f.hdr", "--json")
    expected = et.filter_map(et.read_map(maps[0]), kind, size=3, gamma=0.4)
    np.testing.assert_array_equal(et.read_map(tmp_path / "f.npz").values, expected.values)
    assert outcome.json["intensity"] == expected.intensity
    assert outcome.json["notes"] == list(expected.notes)
    assert any("f.hdr" in loss for loss in outcome.json["losses"])
    assert run("filter", maps[0], "--kind", kind, "--size", 4, "-o", "g.npz").status == 1
    assert files(tmp_path) == ["f.hdr", "f.npz"]


@pytest.mark.parametrize(
    ("options", "arguments"),
    [
        ((), {}),
        (("--dead", "exclude"), {"dead": "exclude"}),
        (("--region", "-3,2,-1,4"), {"region": et.Region(-3, 2, -1, 4)}),
    ],
)
def test_compare_gives_the_measures_of_the_api(run: Run, maps: tuple[Path, Path], options: Any, arguments: Any) -> None:
    outcome = run("compare", *maps, *options, "--json")
    expected = et.compare(et.read_map(maps[0]), et.read_map(maps[1]), **arguments)
    assert outcome.json == json.loads(json.dumps(expected.to_dict())) | {"outputs": []}
    assert f"NCC {100 * expected.ncc:.3f} %" in run("compare", *maps, *options).out


@pytest.mark.slow
def test_compare_draws_the_difference_and_the_cuts(run: Run, maps: tuple[Path, Path], tmp_path: Path) -> None:
    outcome = run("compare", *maps, "-o", "d.png", "--section-y", 0.2, "--section-output", "s.png")
    assert outcome.status == 0, outcome.err
    assert files(tmp_path) == ["d.png", "s.png"]
    assert "d.png" in outcome.out
    assert all((tmp_path / name).read_bytes().startswith(b"\x89PNG") for name in ("d.png", "s.png"))
    assert run("compare", *maps, "--section-x", 0.2, "--section-output", "x.png", "--json").json["outputs"] == ["x.png"]


def test_compare_writes_nothing_if_a_cut_is_off_the_screen(run: Run, maps: tuple[Path, Path], tmp_path: Path) -> None:
    outcome = run("compare", *maps, "-o", "d.png", "--section-y", 1e3, "--section-output", "s.png")
    assert outcome.status == 1
    assert "off the screen" in outcome.err
    assert files(tmp_path) == []
    outcome = run("compare", *maps, "--section-y", 0, "--section-x", 0, "--section-output", "s.png")
    assert outcome.status == 2
    assert "one picture shows one of them" in " ".join(outcome.err.split())


def test_maps_of_different_views_are_compared_only_on_request(
    run: Run, maps: tuple[Path, Path], tmp_path: Path
) -> None:
    other = et.read_map(maps[1])
    other.replace(observer=et.Observer(26, -40, 300, (1, -0.5, 0))).save(tmp_path / "c.npz")
    assert run("compare", maps[0], "c.npz").status == 1
    assert run("compare", maps[0], "c.npz", "--ignore-geometry").status == 0


# --- demo ------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_demo_finds_the_truth_within_its_error_bars(run: Run, tmp_path: Path) -> None:
    outcome = run("demo", "--rays", 4_000_000, "--seed", 5, "-o", "d.png", "--json").json
    assert [z["truth"] for z in outcome["zones"]] == pytest.approx([303_964, 67_547, 20_264], abs=0.5)
    for zone in outcome["zones"]:
        assert abs(zone["deviation"]) < 4.4  # one run in 10^5, twice three rings
        assert zone["deviation"] == (zone["estimate"] - zone["truth"]) / zone["standard_error"]
        assert zone["standard_error"] < 0.1 * zone["truth"]
    assert (outcome["rays"], outcome["picture"], outcome["unit"]) == (4_000_000, "d.png", "cd/m²")
    assert (tmp_path / "d.png").read_bytes().startswith(b"\x89PNG")
    again = run("demo", "--rays", 4_000_000, "--seed", 5, "-o", "d.png")
    for zone in outcome["zones"]:
        assert f"{zone['deviation']:+.2f} σ" in again.out
        assert f"{zone['estimate']:,.0f}" in again.out


@pytest.mark.slow
def test_demo_draws_other_rays_for_another_seed(run: Run) -> None:
    estimates = [run("demo", "--rays", 200_000, "--seed", s, "-o", "d.png", "--json").json["zones"] for s in (1, 2, 1)]
    assert estimates[0] != estimates[1]
    assert estimates[0] == estimates[2]


# --- Ctrl-C ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_ctrl_c_ends_long_work_with_status_130_and_no_file(tmp_path: Path) -> None:
    """In a process of its own, with a terminal, so that the progress bar tells when the work has begun."""
    parent, child = os.openpty()
    try:
        # A test runner in the background may ignore the signal, and so would its children.
        heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
        command = [sys.executable, "-c", f"{heed}; from etendue.cli import main; main()"]
        process = subprocess.Popen(
            [*command, "demo", "--rays", "5000000000000", "-o", "d.png"],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=child,
            env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
        )
        os.close(child)
        seen = b""
        while b"rays" not in seen:
            seen += os.read(parent, 4096)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        while b"half-written" not in seen:
            seen += os.read(parent, 4096)
        out, _ = process.communicate(timeout=20)
    finally:
        os.close(parent)
    assert process.returncode == 130
    assert b"stopped; no file was left half-written" in seen
    assert b"Traceback" not in seen
    assert out == b""
    assert files(tmp_path) == []


@pytest.mark.parametrize("verb", ["luminance", "convert"])
def test_ctrl_c_in_any_verb(run: Run, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(luminance_verb, "luminance_map", interrupted)
    monkeypatch.setattr(et.RaySet, "subset", interrupted)
    arguments = {"luminance": [*VIEW, "-o", "a.npz"], "convert": ["x.dat", "--subset", "5"]}[verb]
    outcome = run(verb, folder / "led.tm25ray", *arguments)
    assert outcome.status == 130
    assert "stopped" in outcome.err
    assert files(tmp_path) == []


# --- terminals that do not know Greek --------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_letters_that_the_output_does_not_have_do_no_harm(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch, encoding: str
) -> None:
    """As on Windows, where output that goes to a file is in cp1252: it has ² and °, but neither θ nor φ."""
    arguments = ["luminance", folder / "led.tm25ray", *VIEW, *CONE, "-o", "a.npz"]
    documents = []
    for options in ([], ["--json"]):
        stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
        monkeypatch.setattr(sys, "stdout", stream)
        assert run(*arguments, *options).status == 0
        stream.flush()
        documents.append(stream.buffer.getvalue().decode(encoding))  # type: ignore[attr-defined]
    assert ("from θ = 25°" if encoding == "utf-8" else "from \\u03b8 = 25") in documents[0]
    assert json.loads(documents[1])["maps"][0]["unit"] == "cd/m²"


# --- pieces ----------------------------------------------------------------------------------------------------------


def test_json_has_no_nan_and_knows_numpy(capsys: pytest.CaptureFixture[str]) -> None:
    print_json(
        {"a": math.nan, "b": [math.inf, np.float32(0.5)], "c": np.int64(3), "d": np.bool_(1), "e": Path("x/y"), 5: "θ"}
    )
    text = capsys.readouterr().out
    assert json.loads(text) == {"a": None, "b": [None, 0.5], "c": 3, "d": True, "e": "x/y", "5": "θ"}
    assert "θ" in text


def test_numbers_of_an_option() -> None:
    assert numbers(" 30, -1e3 ", 2, "--observer", "30,0") == (30.0, -1000.0)
    for text in ("30", "30,0,0", "30,", "a,b", ""):
        with pytest.raises(typer.BadParameter, match="2 numbers"):
            numbers(text, 2, "--observer", "30,0")


@pytest.mark.parametrize("text", ["W", "lm", "-", "1e5e", "337 mW"])
def test_a_flux_that_is_no_flux(folder: Path, text: str) -> None:
    with pytest.raises(typer.BadParameter, match="give a flux"):
        convert_verb.with_flux(et.read_rays(folder / "led.dat"), text)


def test_warnings_of_the_api_are_not_printed_twice(run: Run, folder: Path) -> None:
    with pytest.warns(RayFileWarning, match="negative flux"):
        et.read_rays(folder / "bad.csv").tally  # noqa: B018
    assert run("convert", folder / "bad.csv", "out.csv").err.count("negative flux") == 1


def test_no_help_text_loses_words_to_markup() -> None:
    """Words in square brackets would be taken for a style and left out."""
    texts = [(name, getattr(option, "help", None) or "") for name, verb in verbs().items() for option in verb.params]
    assert len(texts) > 100
    assert [(name, text) for name, text in texts if "[" in text] == []
