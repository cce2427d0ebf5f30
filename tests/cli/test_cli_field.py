"""Light fields on the command line: fitted, described, looked at, drawn from, exported; and refused where they must be."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.cli import field as field_verbs
from etendue.cli import fit as fit_verb
from etendue.cli import sample as sample_verb
from etendue.lightfield.carrier import Disk, Plane, Surface
from etendue.lightfield.diagnostics import diagnose
from etendue.lightfield.fit_cache import FOLDER_VARIABLE
from oracles.light_fields import SURFACES, make_field
from oracles.sources import LimbDarkenedDisk

from cli.outcome import Run, files

Array = npt.NDArray[np.float64]

FLAT = Plane(z=0.0, focus=(0.0, 0.0, 0.0, 0.0))
"""A plane that no focus is sought for."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An off-centre source as a ray file, in watts too, and a light field made by hand."""
    place = tmp_path_factory.mktemp("fields")
    source, n = LimbDarkenedDisk(), 20_000
    x, k = source.rays(n, seed=2)
    et.write_rays(place / "led.tm25ray", et.RaySet(x, k, np.full(n, source.total_flux / n)))
    watts = et.RaySet(x[:3000], k[:3000], np.full(3000, 1e-3), flux_unit="W", wavelength=np.full(3000, 555.0))
    et.write_rays(place / "watts.tm25ray", watts)
    few_rays(make_field(SURFACES["dome with a window"])).save(place / "dome.h5")
    few_rays(make_field(SURFACES["plane"], flux_unit="W")).save(place / "watts.h5")
    (place / "short.h5").write_bytes((place / "dome.h5").read_bytes()[:-500])
    (place / "nonsense.h5").write_bytes(b"\x00\x01" * 500)
    return place


def few_rays(field: et.LightField) -> et.LightField:
    """The same field, on so few rays that the nodes of its far field are soon chosen."""
    return field.replace(report=dataclasses.replace(field.report, rays=20_000))


def same_field(a: et.LightField, b: et.LightField) -> None:
    assert (a.surface, a.report, a.flux_unit) == (b.surface, b.report, b.flux_unit)
    for one, other in zip(a.parts, b.parts, strict=True):
        np.testing.assert_array_equal(one.ratio, other.ratio)
        np.testing.assert_array_equal(one.deviation, other.deviation)


# --- fit and info ----------------------------------------------------------------------------------------------------

GRID = ("--surface", "disk:radius=11.3,centre=0.9/-0.5", "--depths", "3,3,2,2")


def api_field(folder: Path, **changes: Any) -> et.LightField:
    """What `GRID` stands for, as it comes back from a file."""
    rays = et.read_rays(folder / "led.tm25ray")
    options = {"depths": (3, 3, 2, 2)} | changes
    return et.LightField.fit(rays, options.pop("surface", Disk(radius=11.3, centre=(0.9, -0.5))), **options)


@pytest.mark.slow
def test_fit_is_the_fit_of_the_api_and_tells_all_of_it(run: Run, folder: Path, tmp_path: Path) -> None:
    outcome = run("fit", folder / "led.tm25ray", "-o", "led.h5", *GRID, "--seed", 7, "--threads", 1, "--json")
    assert (outcome.status, outcome.err) == (0, "")
    expected = api_field(folder, seed=7)
    expected.save(tmp_path / "expected.h5")
    same_field(et.LightField.load(tmp_path / "led.h5"), et.LightField.load(tmp_path / "expected.h5"))
    facts, report = outcome.json, expected.report
    assert {name: facts[name] for name in ("rays", "unmet_rays", "score", "score_error", "effective_cells")} == {
        "rays": 20_000,
        "unmet_rays": report.unmet_rays,
        "score": report.score,
        "score_error": report.score_error,
        "effective_cells": report.effective_cells,
    }
    assert (facts["log_evidence"], facts["bases"]) == (report.log_evidence, list(report.bases))
    assert facts["lead_over_histogram"] == report.score - report.histogram_score
    assert facts["surface"] == "disk:radius=11.3,z=0,centre=0.9/-0.5"
    assert facts["parts"][0]["cells"] == [8, 8, 4, 4]
    assert facts["parts"][0]["flux"] == facts["total_flux"] == expected.total_flux
    assert facts["flux_unit"] == "lm"
    assert facts["bytes"] == (tmp_path / "led.h5").stat().st_size
    assert facts["seconds"] > 0
    assert files(tmp_path) == ["expected.h5", "led.h5"]
    other = run("fit", folder / "led.tm25ray", "-o", "other.h5", *GRID, "--seed", 8, "--json").json
    assert other["score"] != facts["score"]


@pytest.mark.slow
def test_fit_for_people_says_the_same_and_info_says_it_again(run: Run, folder: Path, tmp_path: Path) -> None:
    outcome = run("fit", folder / "led.tm25ray", "-o", "led.h5", "--surface", "disk:radius=9,centre=1/0", *GRID[2:])
    assert outcome.status == 0, outcome.err
    field = et.LightField.load(tmp_path / "led.h5")
    report = field.report
    assert report.unmet_rays > 0
    pieces = [
        f"{field.total_flux:.4g} lm",
        f"{report.rays - report.unmet_rays:,}; {report.unmet_rays:,} more (",
        "disk:radius=9,z=0,centre=1/0",
        "8 × 8 × 4 × 4 cells",
        f"{report.log_evidence:,.1f} nat",
        f"{report.effective_cells:,.0f}, effective",
        f"{report.score:.4f} ± {report.score_error:.4f} nat per ray",
        f"{report.score - report.histogram_score:+.4f} against the equal-étendue histogram",
        "kB",
    ]
    described = run("info", "led.h5")
    for piece in pieces:
        assert piece in outcome.out
        assert piece in described.out
    assert " s\n" in outcome.out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "changes"),
    [
        (("--surface", "plane:z=0.5", *GRID[2:]), {"surface": Plane(z=0.5)}),
        (("--flux", "500lm", *GRID), {}),
        (("--max-resolution", "2.5", *GRID), {"max_resolution": 2.5}),
    ],
)
def test_fit_takes_surface_and_flux(run: Run, folder: Path, tmp_path: Path, options: Any, changes: Any) -> None:
    facts = run("fit", folder / "led.tm25ray", "-o", "a.h5", *options, "--json").json
    expected = api_field(folder, **changes)
    field = et.LightField.load(tmp_path / "a.h5")
    assert field.surface == expected.surface
    whole = 500.0 if "500lm" in options else et.read_rays(folder / "led.tm25ray").total_flux
    assert facts["total_flux"] + facts["unmet_flux"] == pytest.approx(whole, rel=1e-9)


def test_fit_turns_watts_into_lumens(run: Run, folder: Path) -> None:
    """555 nm: 683 lm/W."""
    facts = run("fit", folder / "watts.tm25ray", "-o", "a.h5", "--unit", "lm", *GRID, "--json").json
    met = 1 - facts["unmet_rays"] / 3000
    assert facts["flux_unit"] == "lm"
    assert facts["total_flux"] == pytest.approx(3.0 * 683 * met, rel=1e-3)


def test_fit_chooses_the_surface_unless_told(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[dict[str, Any]] = []

    def fitted(rays: et.RaySet, surface: Any, **options: Any) -> et.LightField:
        asked.append({"surface": surface, "rays": len(rays)} | options)
        return make_field(SURFACES["plane"])

    monkeypatch.setattr(et.LightField, "fit", fitted)
    assert run("fit", folder / "led.tm25ray", "-o", "a.h5").status == 0
    assert run("fit", folder / "led.tm25ray", "-o", "a.h5", "--surface", "auto", "--symmetry", "mirror-x").status == 0
    assert [(a["surface"], a["symmetry"], a["depths"], a["seed"]) for a in asked] == [
        ("auto", "none", None, 1),
        ("auto", "mirror-x", None, 1),
    ]


@pytest.mark.slow
def test_a_report_holds_the_diagnostics(run: Run, folder: Path, tmp_path: Path) -> None:
    outcome = run("fit", folder / "led.tm25ray", "-o", "a.h5", *GRID, "--report", "r.png", "--json")
    facts = outcome.json["diagnostics"]
    expected = diagnose(api_field(folder), et.read_rays(folder / "led.tm25ray")).to_dict()
    assert facts["forecast"] == json.loads(json.dumps(expected["forecast"]))
    assert facts["characteristic_curve"]["flux"] == expected["characteristic_curve"]["flux"]
    assert (tmp_path / "r.png").read_bytes().startswith(b"\x89PNG")
    people = run("fit", folder / "led.tm25ray", "-o", "a.h5", *GRID, "--report", "r.pdf")
    for piece in ("times the rays", "least certain: (", "r.pdf"):
        assert piece in people.out
    assert files(tmp_path) == ["a.h5", "r.pdf", "r.png"]


def test_info_describes_fields_beside_rays_and_damage(run: Run, folder: Path) -> None:
    names = ("dome.h5", "led.tm25ray", "short.h5", "nonsense.h5", "watts.h5")
    outcome = run("info", *(folder / name for name in names), "--json")
    assert outcome.status == 1
    dome, rays, short, nonsense, watts = outcome.json
    field = et.LightField.load(folder / "dome.h5")
    assert (dome["format"], dome["surface"], dome["total_flux"]) == (
        "light field",
        field.surface.spec,
        field.total_flux,
    )
    assert [part["name"] for part in dome["parts"]] == ["window", "dome"]
    assert dome["score"] is None
    assert rays["format"] == "tm25"
    assert "short.h5" in short["error"]
    assert "Known formats" in nonsense["error"]
    assert watts["flux_unit"] == "W"
    people = run("info", folder / "dome.h5", folder / "short.h5")
    assert people.status == 1
    assert "window: 4 × 2 × 2 × 4 cells, tree on the product of the images" in people.out
    assert "dome: 4 × 2 × 2 × 4 cells, tree alone" in people.out
    assert "short.h5" in people.err


# --- sample ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["dome.h5", "watts.h5"])
def test_sample_draws_the_rays_of_the_api(run: Run, folder: Path, name: str) -> None:
    outcome = run("sample", folder / name, "-n", 5000, "-o", "a.tm25ray", "-o", "a.csv", "--seed", 3, "--json")
    assert outcome.status == 0
    field = et.LightField.load(folder / name)
    expected = next(field.rays(5000, seed=3).batches())
    for path in ("a.tm25ray", "a.csv"):
        drawn = et.read_rays(path)
        assert (len(drawn), drawn.flux_unit) == (5000, field.flux_unit)
        np.testing.assert_allclose(drawn.position, expected.position, atol=1e-6)
        np.testing.assert_allclose(drawn.direction, expected.direction, atol=1e-6)
        assert drawn.total_flux == pytest.approx(field.total_flux, rel=1e-5)
    facts = outcome.json
    assert (facts["rays"], facts["seed"], facts["flux_unit"]) == (5000, 3, field.flux_unit)
    assert facts["total_flux"] == field.total_flux
    assert facts["outputs"] == ["a.tm25ray", "a.csv"]
    other = run("sample", folder / name, "-n", 5000, "-o", "b.tm25ray", "--seed", 4)
    assert other.out == f"b.tm25ray: 5,000 rays, {field.total_flux:.4g} {field.flux_unit}\n"
    assert (et.read_rays("b.tm25ray").position != et.read_rays("a.tm25ray").position).any()


def test_sample_writes_any_format_and_says_what_it_cannot_hold(run: Run, folder: Path, tmp_path: Path) -> None:
    outcome = run("sample", folder / "dome.h5", "-n", 100, "-o", "a.dat", "-o", "b.dat", "--format", "zemax")
    assert outcome.status == 0
    assert (tmp_path / "a.dat").read_bytes()[100:] == (tmp_path / "b.dat").read_bytes()[100:]
    assert et.read_rays("a.dat").provenance.format == "zemax"


def test_sample_streams(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is written is a stream, never a set of rays in memory."""
    handed: list[Any] = []

    def written(path: Path, rays: Any, format: str | None) -> tuple[str, ...]:
        del path, format
        handed.append(rays)
        return ()

    monkeypatch.setattr(sample_verb, "write_rays", written)
    assert run("sample", folder / "dome.h5", "-n", 10**12, "-o", "a.tm25ray").status == 0
    assert len(handed[0]) == 10**12
    assert not isinstance(handed[0], et.RaySet)


# --- luminance -------------------------------------------------------------------------------------------------------

VIEW = ("--observer", "25,-40", "--distance", 300, "--target", "0.1,-0.2,0.4", "--size", "3,2", "--pixels", "12,9")


def view(target: tuple[float, float, float] = (0.1, -0.2, 0.4), size: tuple[float, float] = (3, 2)) -> tuple[Any, Any]:
    return et.Observer(25, -40, 300, target), et.Screen(*size, 12, 9)


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("--samples", 4), ("--method", "lightfield", "--threads", 1)])
def test_luminance_of_a_field_is_the_map_of_the_api(run: Run, folder: Path, tmp_path: Path, options: Any) -> None:
    outcome = run("luminance", folder / "dome.h5", *VIEW, *options, "-o", "a.npz", "-o", "a.png", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    samples = {"samples": 4} if "--samples" in options else {}
    expected = et.luminance_map(et.LightField.load(folder / "dome.h5"), *view(), **samples)
    written = et.read_map(tmp_path / "a.npz")
    np.testing.assert_array_equal(written.values, expected.values)
    np.testing.assert_array_equal(written.standard_error, expected.standard_error)
    assert (written.rays == -1).all()
    (facts,) = outcome.json["maps"]
    assert facts["rays"] is None
    assert facts["dead_pixels"] == 0
    assert facts["maximum"] == expected.values.max() > 0
    assert facts["intensity"] == expected.intensity
    assert outcome.json["complaints"] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "method"),
    [
        (("--surface", "disk:radius=11.3,centre=0.9/-0.5"), {"surface": Disk(radius=11.3, centre=(0.9, -0.5))}),
        (
            ("--surface", FLAT.spec, "--method", "lightfield", "--samples", 2, "--flux", "7"),
            {"surface": FLAT, "method": "lightfield", "samples": 2},
        ),
    ],
)
def test_luminance_of_rays_by_their_light_field(
    run: Run, folder: Path, tmp_path: Path, options: Any, method: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The same rays on the same surface are fitted once; on another one, or with another flux, a second time.
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "kept"))
    rays = et.read_rays(folder / "led.tm25ray")
    arguments = [*VIEW[:4], "--target", "1,-0.5,0", "--size", "12,9", "--pixels", "12,9"]
    assert run("luminance", folder / "led.tm25ray", *arguments, *options, "-o", "a.npz").status == 0
    rays = rays.with_total_flux(7.0) if "--flux" in options else rays
    expected = et.luminance_map(rays, *view((1, -0.5, 0), (12, 9)), **method)
    np.testing.assert_array_equal(et.read_map(tmp_path / "a.npz").values, expected.values)


def test_rays_are_fitted_unless_an_acceptance_is_given(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def fitted(rays: et.RaySet, surface: Any, **_: Any) -> et.LightField:
        asked.append(surface)
        return make_field(SURFACES["plane"]).replace(flux_unit=rays.flux_unit)

    monkeypatch.setattr(et.LightField, "fit", fitted)
    maps = {}
    for name, options in {
        "default": (),
        "auto": ("--method", "auto"),
        "narrow": ("--acceptance", "6"),
        "ladder": ("--acceptance", "auto"),
        "cone": ("--method", "cone"),
    }.items():
        outcome = run("luminance", folder / "led.tm25ray", *VIEW, *options, "-o", f"{name}.npz", "--json")
        assert outcome.status == 0, outcome.err
        maps[name] = outcome.json["maps"][0]
    assert asked == ["auto", "auto"]
    assert [name for name, facts in maps.items() if facts["rays"] is None] == ["default", "auto"]
    assert any("within 1.5°" in note for note in maps["cone"]["notes"])
    assert any("within 6°" in note for note in maps["narrow"]["notes"])


def test_many_observers_of_a_field(run: Run, folder: Path, tmp_path: Path) -> None:
    observers = ["--observer", "0,0", "--observer", "60,12.5"]
    outcome = run("luminance", folder / "dome.h5", *VIEW[2:], *observers, "-o", "t{theta}p{phi}.npz", "--json")
    assert [m["outputs"] for m in outcome.json["maps"]] == [["t0p0.npz"], ["t60p12.5.npz"]]
    field = et.LightField.load(folder / "dome.h5")
    for theta, phi in ((0, 0), (60, 12.5)):
        seen = et.read_map(tmp_path / f"t{theta}p{phi}.npz")
        np.testing.assert_array_equal(seen.values, et.luminance_map(field, seen.observer, seen.screen).values)


@pytest.mark.slow
def test_people_read_figures_and_a_note_where_nothing_is_seen(run: Run, folder: Path) -> None:
    outcome = run("luminance", folder / "watts.h5", *VIEW, "-o", "a.npz")
    assert "radiance from θ = 25°, φ = -40°, 300 mm" in outcome.out
    assert "W/(m² sr)" in outcome.out
    assert outcome.err == ""
    off = [*VIEW[:4], "--target", "500,0,0", "--size", "1,1", "--pixels", "2,2", "-o", "b.npz"]
    blind = run("luminance", folder / "watts.h5", *off)
    assert blind.status == 0
    assert "the screen shows 0.0% of the light" in blind.out
    rays = run("luminance", folder / "led.tm25ray", *off, "--surface", FLAT.spec)
    assert "the screen shows 0.0% of the light" in rays.out


# --- intensity -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_intensity_of_a_field(run: Run, folder: Path, tmp_path: Path) -> None:
    outputs = ["-o", "a.ies", "-o", "a.ldt", "-o", "a.png"]
    outcome = run("intensity", folder / "dome.h5", *outputs, "--c-planes", 8, "--gamma-step", 15, "--json")
    assert outcome.status == 0
    expected = et.LightField.load(folder / "dome.h5").intensity(8, 15)
    facts = outcome.json
    assert (facts["planes"], facts["gammas"], facts["flux"]) == (8, 13, expected.flux)
    assert facts["maximum"] == expected.maximum
    for name in ("a.ies", "a.ldt"):
        np.testing.assert_allclose(et.read_intensity(name).values, expected.values, rtol=1e-4, atol=1e-4)
    assert (tmp_path / "a.png").exists()
    people = run("intensity", folder / "watts.h5")
    assert re.search(r"flux [\d.e-]+ ± [\d.e-]+ W", people.out)
    assert "that the field rests on" in people.out
    assert "radiant intensity" in people.out


# --- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "status", "hint"),
    [
        (["fit", "{}/led.tm25ray"], 2, "--output"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--depths", "5,5,5"], 2, "give 4 numbers"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--depths", "5,5,5,4.5"], 2, "4 whole numbers"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--threads", "0"], 2, "--threads"),
        (["fit", "{}/led.tm25ray", "-o", "a.npz"], 1, "'.npz' is none of the known ones: .h5"),
        (["fit", "{}/led.tm25ray", "-o", "none/a.h5"], 1, "does not exist. Create it first"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--report", "a.exe"], 1, ".png"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--surface", "plan:z=0"], 1, "'plane'"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--surface", "autoo"], 1, "Did you mean 'auto'?"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--surface", "auto:z=0"], 1, "give auto alone"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--surface", "plane", "--depths", "16,0,0,0"], 1, "from 0 to 12"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", *GRID, "--symmetry", "mirorx"], 1, "'mirror-x'"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--surface", "dome:radus=2"], 1, "'radius'"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--surface", "plane:z=0", "--depths", "99,0,0,0"], 1, "depths"),
        (["fit", "{}/led.tm25ray", "-o", "a.h5", "--surface", "disk:radius=1,centre=90/0"], 1, "none of 20,000 rays"),
        (["fit", "{}/dome.h5", "-o", "a.h5"], 1, "dome.h5"),
        (["sample", "{}/dome.h5", "-o", "a.dat"], 2, "--rays"),
        (["sample", "{}/dome.h5", "-n", "0", "-o", "a.tm25ray"], 2, "-n"),
        (["sample", "{}/dome.h5", "-n", "1.5e0", "-o", "a.tm25ray"], 2, "-n"),
        (["sample", "{}/dome.h5", "-n", "5", "-o", "a.tm25ray", "--format", "tm52"], 2, "'tm25'"),
        (["sample", "{}/dome.h5", "-n", "5", "-o", "a.xyz"], 1, "belongs to no ray format"),
        (["sample", "{}/dome.h5", "-n", "5", "-o", "a.csv", "-o", "b.ray"], 1, "belongs to several formats: "),
        (["sample", "{}/dome.h5", "-n", "5", "-o", "none/a.csv"], 1, "does not exist"),
        (["sample", "{}/dome.h5", "-n", "5", "-o", "a.csv", "--seed", "-1"], 2, "give 0 or more"),
        (["sample", "{}/led.tm25ray", "-n", "5", "-o", "a.csv"], 1, "led.tm25ray"),
        (["sample", "{}/short.h5", "-n", "5", "-o", "a.csv"], 1, "short.h5"),
        (["sample", "{}/nothere.h5", "-n", "5", "-o", "a.csv"], 1, "nothere.h5: No such file"),
        (
            ["luminance", "{}/dome.h5", *VIEW, "-o", "a.npz", "--acceptance", "3"],
            2,
            "--acceptance: an option of",
        ),
        (
            ["luminance", "{}/dome.h5", *VIEW, "-o", "a.npz", "--method", "cone"],
            2,
            "--method cone is for rays",
        ),
        (
            ["luminance", "{}/dome.h5", *VIEW, "-o", "a.npz", "--surface", "auto"],
            2,
            "--surface: a light field has",
        ),
        (["luminance", "{}/dome.h5", *VIEW, "-o", "a.npz", "--flux", "3", "--unit", "W"], 2, "--flux: for ray files"),
        (
            ["luminance", "{}/dome.h5", *VIEW, "-o", "a.npz", "--unit", "W"],
            1,
            "lm cannot become W: the light field knows",
        ),
        (["intensity", "{}/dome.h5", "--unit", "watt"], 2, "--unit"),
        (["luminance", "{}/dome.h5", *VIEW, "-o", "a.npz", "--samples", "0"], 2, "--samples"),
        (["luminance", "{}/dome.h5", *VIEW, "-o", "a.npz", "--samples", "9999999"], 1, "samples is 9999999"),
        (["luminance", "{}/led.tm25ray", *VIEW, "-o", "a.npz", "--acceptance", "wide"], 2, "--acceptance 1.5"),
        (["luminance", "{}/led.tm25ray", *VIEW, "-o", "a.npz", "--surface", "sfere"], 1, "'sphere'"),
        (
            ["luminance", "{}/led.tm25ray", *VIEW, "-o", "a.npz", "--method", "lightfield", "--acceptance", "3"],
            2,
            "--acceptance: --method lightfield has no such option",
        ),
        (["luminance", "{}/short.h5", *VIEW, "-o", "a.npz"], 1, "short.h5"),
        (["intensity", "{}/dome.h5", "--flux", "3"], 2, "--flux: for ray files"),
        (["intensity", "{}/dome.h5", "--c-planes", "9999", "--gamma-step", "0.1"], 1, "9999"),
        (["intensity", "{}/short.h5"], 1, "short.h5"),
    ],
)
def test_what_cannot_be_done_is_said_and_leaves_nothing(
    run: Run, folder: Path, tmp_path: Path, arguments: list[Any], status: int, hint: str
) -> None:
    outcome = run(*(str(a).format(folder) for a in arguments))
    assert (outcome.status, outcome.out) == (status, ""), outcome
    assert hint in outcome.err
    assert "Traceback" not in outcome.err
    assert files(tmp_path) == []


@pytest.mark.parametrize(
    "arguments",
    [
        ["fit", "led.tm25ray", "-o", "no/a.h5"],
        ["fit", "led.tm25ray", "-o", "a.h5", "--report", "no/a.png"],
        ["fit", "led.tm25ray", "-o", "a.h5", "--surface", "plan"],
        ["sample", "a.h5", "-n", "5", "-o", "a.csv", "-o", "b.nothing"],
        ["luminance", "a.h5", *VIEW, "-o", "no/a.npz"],
        ["luminance", "a.h5", *VIEW, "-o", "a.npz", "--surface", "plan"],
    ],
)
def test_mistakes_are_found_before_any_work(run: Run, monkeypatch: pytest.MonkeyPatch, arguments: list[Any]) -> None:
    for module, name in ((fit_verb, "read_rays"), (field_verbs, "read_rays"), (field_verbs, "is_field_file")):
        monkeypatch.setattr(module, name, lambda *_, **__: pytest.fail("work was done"))
    monkeypatch.setattr(et.LightField, "load", lambda *_: pytest.fail("work was done"))
    assert run(*arguments).status == 1


@pytest.mark.parametrize("verb", ["fit", "sample"])
def test_ctrl_c(run: Run, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(et.LightField, "fit", interrupted)
    monkeypatch.setattr(et.LightField, "rays", interrupted)
    arguments = {"fit": ["led.tm25ray", "-o", "a.h5"], "sample": ["dome.h5", "-n", "5", "-o", "a.csv"]}[verb]
    outcome = run(verb, folder / arguments[0], *arguments[1:])
    assert outcome.status == 130
    assert "stopped" in outcome.err
    assert files(tmp_path) == []


def test_a_failing_fit_leaves_the_old_field_as_it_was(run: Run, folder: Path, tmp_path: Path) -> None:
    (tmp_path / "a.h5").write_text("mine")
    far = ("--surface", "disk:radius=1,centre=90/0")
    assert run("fit", folder / "led.tm25ray", "-o", "a.h5", *far).status == 1
    assert (tmp_path / "a.h5").read_text() == "mine"


@pytest.mark.slow
def test_the_lumens_of_a_field_in_watts(run: Run, tmp_path: Path, stand_on: Callable[[Surface], None]) -> None:
    """Two lines of 0.75 and 0.25 W: told by info, used by --unit; a scene's notes say what its spectrum leaves out."""
    stand_on(FLAT)
    rng = np.random.default_rng(8)
    sine, turn = np.sqrt(rng.random(4000)), 2 * np.pi * rng.random(4000)
    direction = np.column_stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - sine**2)])
    place = np.column_stack([rng.random((4000, 2)), np.zeros(4000)])
    wavelength = np.repeat([450.0, 600.0], [3000, 1000])
    flux = np.full(4000, 1 / 4000)
    rays = et.RaySet(place, direction, flux, flux_unit="W", wavelength=wavelength)
    et.write_rays(tmp_path / "led.tm25ray", rays)
    expected = 683 * (0.75 * 0.038 + 0.25 * 0.631)
    assert f"450 to 600 nm, {expected:.4g} lm/W" in run("info", "led.tm25ray").out
    assert run("info", "led.tm25ray", "--json").json[0]["luminous_efficacy"] == pytest.approx(expected, rel=1e-6)
    assert run("fit", "led.tm25ray", "-o", "led.h5", "--surface", FLAT.spec, "--depths", "2,2,2,2").status == 0
    assert f"2 lines, 450 to 600 nm, {expected:.4g} lm/W" in run("info", "led.h5").out
    watts, lumens = (run("intensity", "led.h5", *unit, "--json").json for unit in ((), ("--unit", "lm")))
    assert (watts["flux_unit"], lumens["flux_unit"]) == ("W", "lm")
    assert lumens["flux"] == pytest.approx(watts["flux"] * expected, rel=1e-6)
    scene = '[[sources]]\nname = "led"\nkind = "rays"\nfile = "led.tm25ray"\n'
    ball = '[[solids]]\nmedium = "BK7"\nat = [0, 0, 5]\nshape = { kind = "ball", radius = 2 }\n'
    (tmp_path / "lamp.toml").write_text(scene + ball)
    view = ("--observer", "0,0", "--distance", "300", "--size", "2,2", "--pixels", "2,2", "--rays-per-pixel", "4")
    seen = run("luminance", "lamp.toml", *view, "-o", "a.npz")
    assert seen.status == 0, seen.err
    assert "the index of 'BK7' treats its wavelengths differently" in " ".join((seen.out + seen.err).split())
