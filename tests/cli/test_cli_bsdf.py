"""The verbs of scatter: what they say, write and refuse."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.materials import MATERIALS
from oracles.tracepro_files import abg_side, surface_property

from cli.outcome import Run


@pytest.fixture
def scans(tmp_path: Path) -> list[Path]:
    """Two incidences of gloss paint without its gloss: a lobe on a floor."""
    bsdf = et.bsdf.Mixture(
        parts=[{"kind": "lambertian", "reflectance": 0.5}, {"kind": "gaussian", "peak": 1.0, "sigma": 0.2}]
    )
    paths = []
    for theta in (10.0, 50.0):
        incident = direction(theta, 180.0)
        grid = PolarGrid("specular", np.arange(0.0, 140.0, 4.0), np.array([0.0, 90.0, 180.0, 270.0]))
        at = grid.directions(incident, transmitted=False)
        at = at[np.nan_to_num(at[..., 2], nan=-1.0) > 0.03]
        f = bsdf.evaluate(incident, at)
        rows = [
            f"{theta},180,{math.degrees(math.acos(d[2]))},{math.degrees(math.atan2(d[1], d[0]))},{value}"
            for d, value in zip(at, f, strict=True)
        ]
        paths.append(tmp_path / f"scan_{theta:g}.csv")
        paths[-1].write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n" + "\n".join(rows) + "\n")
    return paths


def test_scans_behind_a_sample(run: Run, scans: list[Path]) -> None:
    """The same lobe about the direction straight on: θ of the detector counts on from the normal of the front."""
    head, *rows = scans[0].read_text().splitlines()
    cells = [row.split(",") for row in rows]
    through = [",".join([i, p, str(180.0 - float(s)), *rest]) for i, p, s, *rest in cells]
    Path("through.csv").write_text("\n".join([head, *through]) + "\n")
    fitted = run("bsdf", "fit", "through.csv", "-o", "opal.h5", "--transmittance", "0.5")
    assert fitted.status == 0, fitted.err
    assert "10°: the scans of transmitted light add up to 0.7" in fitted.out
    assert "scaled to 0.5" in fitted.out
    (one,) = json.loads(run("bsdf", "info", "opal.h5", "--json").out)["tables"]
    assert (one["transmitted"], one["share"]) == (True, pytest.approx(0.5, abs=1e-3))
    assert run("bsdf", "fit", "through.csv", "-o", "abg.h5", "--model", "abg").status != 0


@pytest.mark.slow
def test_scans_to_a_table_and_what_is_said_of_it(run: Run, scans: list[Path]) -> None:
    fitted = run("bsdf", "fit", *scans, "-o", "pet.h5", "--reflectance", "0.7", "--json")
    assert fitted.status == 0, fitted.err
    shares = json.loads(fitted.out)["shares"]
    assert [(one["theta"], one["phi"], one["transmitted"]) for one in shares] == [(10, 180, False), (50, 180, False)]
    assert shares[0]["share"] == pytest.approx(0.72, abs=0.04)
    told = run("bsdf", "info", "pet.h5", "--json")
    facts = json.loads(told.out)
    assert [one["share"] for one in facts["tables"]] == pytest.approx([0.7, 0.7], abs=1e-3)
    text = run("bsdf", "info", "pet.h5").out
    assert "10°" in text
    assert "at 45°, " in text
    assert "at 60°*, " in text
    assert text.count("* extrapolated from 50°") == 1
    assert [one["stated"] for one in facts["tables"]] == [None, None]
    assert [one["unscaled"] for one in facts["tables"]] == [one["share"] for one in shares]
    line = text.splitlines()[1]
    assert f"0.7000 reflected, {shares[0]['share']:.4f} before scaling" in line
    drawn = run("bsdf", "plot", "pet.h5", "-o", "pet.png", "--incidence", "30", "--json")
    assert json.loads(drawn.out)["output"] == "pet.png"
    assert Path("pet.png").stat().st_size > 5000
    converted = run("bsdf", "convert", "pet.h5", "pet.txt", "--format", "tracepro")
    assert converted.status == 0, converted.err
    assert "pet.txt: 2 slices read from pet.h5" in converted.out
    assert Path("pet.txt").read_text().startswith("TracePro Surface Property Data")
    told = run("bsdf", "gloss", "pet.h5", "--json")
    gloss = json.loads(told.out)
    assert gloss["extrapolated"] == {"gloss 60": 50.0, "gloss 85": 50.0}
    assert any("gloss 60 and gloss 85: beyond the last incidence, 50°" in one for one in gloss["complaints"])
    assert set(gloss["gloss"]) == {"20", "60", "85"}


def test_a_model_instead_of_a_table(run: Run, scans: list[Path]) -> None:
    """Exact values of a Gaussian on a floor: its numbers, to what is not known; and the file is that model."""
    told = run("bsdf", "fit", *scans, "-o", "paint.h5", "--model", "lambertian+gaussian")
    assert told.status == 0, told.err
    assert "note: the scans have no standard errors" in told.err
    assert "root mean square of relative residuals: 0.0%" in told.out
    facts = run("bsdf", "fit", *scans, "-o", "paint.h5", "--model", "lambertian+gaussian", "--json").json
    found = {name: one["value"] for name, one in facts["parameters"].items()}
    assert found == pytest.approx({"peak": 1.0, "sigma": 0.2, "reflectance": 0.5}, rel=1e-6)
    assert facts["chi2_per_dof"] is None
    assert [one["theta"] for one in facts["shares"]] == [10.0, 50.0]
    assert [one["kind"] for one in et.read_bsdf("paint.h5").data.components[0]["parts"]] == ["lambertian", "gaussian"]
    wrong = run("bsdf", "fit", *scans, "-o", "no.h5", "--model", "abgg")
    assert "Did you mean 'abg'?" in wrong.err
    both = run("bsdf", "fit", *scans, "-o", "no.h5", "--model", "abg", "--method", "smooth")
    assert both.status == 2
    assert "leave one out" in both.err
    assert not Path("no.h5").exists()


def test_scans_with_errors_are_told_with_errors(run: Run) -> None:
    """A flat sheet with errors of 2 %: its share is off by 2 % at most, and its model by less, with a χ² beside."""
    rows = [
        f"40,180,{theta},{phi},{0.2 + 0.004 * sign},0.004"
        for phi, sign in ((0, 1), (90, -1), (180, 1), (270, -1))
        for theta in range(0, 85, 10)
    ]
    Path("scan.csv").write_text("\n".join(["theta_i,phi_i,theta_s,phi_s,bsdf,standard_error", *rows]) + "\n")
    (share,) = run("bsdf", "fit", "scan.csv", "-o", "sheet.h5", "--method", "shepard", "--json").json["shares"]
    assert share["standard_error"] == pytest.approx(0.02 * share["share"], rel=0.03)
    told = run("bsdf", "fit", "scan.csv", "-o", "sheet.h5", "--method", "shepard").out
    assert re.search(r"40°: the scans add up to 0\.6\d\d ± 0\.01\d", told)
    said = run("bsdf", "info", "sheet.h5").out.splitlines()[1]
    assert said.endswith("reflected")
    told = run("bsdf", "fit", "scan.csv", "-o", "sheet.h5", "--model", "lambertian").out
    # Each value is off by one standard error: χ² is 36 of 35 degrees of freedom.
    assert "reflectance: 0.6283 ± 0.0021" in told
    assert "χ² per degree of freedom: 1.03 (35 degrees of freedom)" in told


@pytest.mark.slow
def test_a_workbook_of_scattered_positions(run: Run, samples: Path) -> None:
    """The method is found by the data, JSON is all that is on standard output."""
    folder = samples / "bsdf"
    scan = (folder / "AnoBlackEC1_goniometer.xls", "--blank", folder / "blank_goniometer.xls")
    told = run("bsdf", "fit", *scan, "-o", "ano.h5", "--json")
    assert told.status == 0, told.err
    assert told.json["method"] == "natural-neighbours"
    assert "102 azimuths" in told.json["complaints"][0]
    published = {
        round(one.theta): one.integral() for one in et.read_bsdf(folder / "AnoBlackEC1onAlum.bsdf").data.slices
    }
    for one in told.json["shares"]:
        assert one["share"] == pytest.approx(published[round(one["theta"])], rel=0.12)


@pytest.mark.slow
def test_gloss_says_from_where_the_light_comes_and_of_which_colour(run: Run) -> None:
    et.write_bsdf("brushed.h5", et.bsdf.RoughMetal(roughness=0.1, roughness_across=0.3, reflectance=0.8))
    grid = PolarGrid("normal", np.array([0.0, 89.0]), np.array([0.0]))
    slices = [
        BsdfSlice(direction(30.0, 180.0), np.full(grid.shape, f), grid=grid, wavelength=wave)
        for wave, f in ((450.0, 0.05), (650.0, 0.25))
    ]
    et.write_bsdf("red.h5", et.BsdfTable(BsdfData(slices)))
    et.write_bsdf("white.h5", et.bsdf.Lambertian(reflectance=0.8))
    told = {name: run("bsdf", "gloss", f"{name}.h5").err for name in ("brushed", "red", "white")}
    assert "from azimuth 180°" in told["brushed"]
    assert "555 nm" in told["red"]
    assert not told["white"]


@pytest.mark.slow
def test_a_formula_of_another_program_becomes_a_table(run: Run) -> None:
    """ABg of TracePro in Zemax' layout: the same f along the specular direction, which is a node of the table."""
    Path("abg.txt").write_text(surface_property(scatter=1, sections=[abg_side(a=0.01)]))
    assert not et.read_bsdf("abg.txt").data.slices
    told = run("bsdf", "convert", "abg.txt", "abg.bsdf")
    assert told.status == 0, told.err
    assert "abg.bsdf: 1 component read from abg.txt" in told.out
    f = [
        float(et.read_bsdf(path).evaluate(direction(40.0, 0.0), direction(40.0, 180.0)))
        for path in ("abg.txt", "abg.bsdf")
    ]
    assert f[1] == pytest.approx(f[0], rel=1e-3)


def test_each_azimuth_of_a_scan_is_told(run: Run) -> None:
    """Flat scans from two azimuths, the second of 0.6 times the values of the first: their shares have that ratio."""
    rows = [
        f"40,{180 + turn},{theta},{phi},{f}"
        for turn, f in ((0, 0.2), (90, 0.12))
        for theta in range(0, 85, 10)
        for phi in (0, 90, 180, 270)
    ]
    Path("scan.csv").write_text("\n".join(["theta_i,phi_i,theta_s,phi_s,bsdf", *rows]) + "\n")
    told = run("bsdf", "fit", "scan.csv", "-o", "sheet.h5", "--method", "smooth").out
    found = re.findall(r"40°, azimuth (180|270)°: the scans add up to ([0-9.]+)", told)
    assert [azimuth for azimuth, _ in found] == ["180", "270"]
    first, second = (float(share) for _, share in found)
    assert second == pytest.approx(0.6 * first, abs=1e-4)


def test_each_wavelength_is_told(run: Run) -> None:
    grid = PolarGrid("normal", np.array([0.0, 90.0]), np.array([0.0]))
    slices = [
        BsdfSlice(direction(theta, 0.0), [[share / math.pi] * 2], grid=grid, wavelength=wavelength)
        for wavelength, share in ((650.0, 0.8), (450.0, 0.2))
        for theta in (50.0, 10.0)
    ]
    et.write_bsdf("rising.h5", et.BsdfTable(BsdfData(slices)))
    told = run("bsdf", "info", "rising.h5").out.splitlines()
    assert told[0] == "rising.h5: etendue, no name, isotropic"
    assert [line.strip() for line in told[1:5]] == [
        "front, 10°, 450 nm: 0.2000 reflected",
        "front, 10°, 650 nm: 0.8000 reflected",
        "front, 50°, 450 nm: 0.2000 reflected",
        "front, 50°, 650 nm: 0.8000 reflected",
    ]
    assert told[5].startswith("reflectance at 555 nm: 0.5150 at 0°")


def test_the_format_is_told_first_of_several_files_that_of_each(run: Run) -> None:
    """The keys of the JSON begin with file and format; files of two formats are told as both."""
    et.write_bsdf("abg.h5", et.bsdf.ABg(a=0.01, b=0.02, g=1.5))
    Path("abg.txt").write_text(surface_property(scatter=1, sections=[abg_side(a=0.01)]))
    facts = json.loads(run("bsdf", "info", "abg.txt", "--json").out)
    assert list(facts)[:2] == ["file", "format"]
    assert facts["format"] == "tracepro"
    assert run("bsdf", "info", "abg.txt").out.startswith("abg.txt: tracepro, ")
    assert run("bsdf", "info", "abg.txt", "abg.h5").out.startswith("2 files: etendue, tracepro, ")


@pytest.mark.slow
def test_materials_are_listed_with_what_they_rest_on(run: Run) -> None:
    """All that a scene may name; shares of opal PMMA and of a holographic diffuser are stated ones."""
    rows = {one["name"]: one for one in run("bsdf", "materials", "--json").json}
    assert set(rows) == set(MATERIALS)
    opal, diffuser = rows["opal-pmma"], rows["holographic-diffuser-5"]
    assert (opal["kind"], opal["reflectance"], opal["transmittance"]) == ("lambertian", 0.38, 0.52)
    assert diffuser["transmittance"] == pytest.approx(0.9, abs=1e-3)
    told = run("bsdf", "materials").out.splitlines()
    assert len(told) == len(MATERIALS)
    assert all(
        f"{name}: " in line and material.source in line
        for line, (name, material) in zip(told, MATERIALS.items(), strict=True)
    )


@pytest.mark.parametrize("angle", ["95", "90", "-1", "nan"])
def test_no_lobe_of_light_that_does_not_arrive(run: Run, angle: str) -> None:
    et.write_bsdf("film.h5", et.bsdf.Gaussian(peak=2, sigma=0.1))
    wrong = run("bsdf", "plot", "film.h5", "-o", "film.png", "--incidence", angle)
    assert wrong.status == 2
    assert f"--incidence: {angle}° is not from 0 to below 90°" in wrong.err
    assert not Path("film.png").exists()


def test_files_for_other_verbs_are_answered(run: Run, scans: list[Path]) -> None:
    """Scans that were not made a BSDF yet, and a format that is read only."""
    assert (
        "this is a goniometer scan, no BSDF. etendue bsdf fit makes a BSDF of it" in run("bsdf", "info", scans[0]).err
    )
    assert "this is a goniometer scan, no ray file" in run("info", scans[0]).err
    et.write_bsdf("film.h5", et.bsdf.Gaussian(peak=2, sigma=0.1))
    read_only = run("bsdf", "convert", "film.h5", "film.binary").err
    assert "MERL table is read only; formats that are written: astm, bird, etendue" in read_only
    assert "merl" not in read_only
    assert not Path("film.binary").exists()


def test_scans_that_determine_no_model_are_refused_with_their_file(run: Run) -> None:
    """f = 0.1 everywhere has no lobe: neither height nor width of one is determined."""
    rows = [f"30,180,{s},{p},0.1" for s in range(0, 85, 5) for p in (0, 180)]
    Path("flat.csv").write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n" + "\n".join(rows) + "\n")
    outcome = run("bsdf", "fit", "flat.csv", "-o", "flat.h5", "--model", "lambertian+gaussian")
    assert outcome.status == 1
    assert "flat.csv: the scans do not determine" in outcome.err
    assert not Path("flat.h5").exists()


def test_the_family_of_verbs_installs_nothing(run: Run) -> None:
    assert "completion" not in run("bsdf", "--help").out


def test_mistakes_are_told_and_nothing_is_written(run: Run, scans: list[Path]) -> None:
    wrong = run("bsdf", "fit", *scans, "-o", "pet.h5", "--method", "smoth")
    assert wrong.status == 2
    assert "smooth" in wrong.err
    scans[0].write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n10,180,20,0,x\n")
    broken = run("bsdf", "fit", *scans, "-o", "pet.h5")
    assert broken.status == 1
    assert "line 2" in broken.err
    missing = run("bsdf", "info", "pet.h5")
    assert missing.status == 1
    assert not Path("pet.h5").exists()


@pytest.mark.slow
def test_scans_of_more_light_than_is_received_are_refused_with_their_file(run: Run) -> None:
    """f = 1.2/π from all sides: 1.2 of the light."""
    rows = [f"{i},180,{s},{p},{1.2 / math.pi}" for i in (10, 50) for s in range(0, 90, 5) for p in (0, 90, 180, 270)]
    Path("bright.csv").write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n" + "\n".join(rows) + "\n")
    outcome = run("bsdf", "fit", "bright.csv", "-o", "bright.h5")
    assert outcome.status == 1
    assert "bright.csv: at 10° of incidence" in outcome.err
    assert "--reflectance" in outcome.err
    assert not Path("bright.h5").exists()
