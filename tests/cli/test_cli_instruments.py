"""The verbs of instruments: what they say, write and refuse."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from cli.outcome import Run

DIFFUSER = 'kind = "cosine-power"\npeak = 2897.0\nexponent = 18204\nway = "transmitted"\n'


@pytest.mark.slow
def test_a_diffuser_is_measured_and_comes_back(run: Run) -> None:
    Path("diffuser.toml").write_text(DIFFUSER)
    options = ("--aperture", "25.4", "--beam", "14", "--distance", "886", "--step", "0.1", "--span", "4")
    told = run("goniometer", "diffuser.toml", *options, "--photons", "1e6", "--method", "quadrature", "-o", "scan.csv")
    assert told.status == 0, told.err
    assert "full width at half maximum 1.6" in told.out
    bare = run("goniometer", "--no-sample", "--aperture", "25.4", "-o", "signature.csv", "--json")
    assert json.loads(bare.out)["fwhm"] == pytest.approx(1.557, abs=2e-3)
    outputs = ("-o", "true.csv", "-o", "true.png")
    found = run("deconvolve", "scan.csv", "--instrument", "signature.csv", *outputs, "--json")
    assert found.status == 0, found.err
    facts = json.loads(found.out)
    assert facts["peak_before"] < 1300
    assert abs(facts["peak"] - 2897) < 4 * facts["peak_error"]
    assert facts["fwhm"] == pytest.approx(1.0, abs=0.03)
    assert facts["total_scatter"][1] == pytest.approx(facts["total_scatter"][0], rel=1e-6)
    assert Path("true.png").stat().st_size > 10_000
    assert "# stop = penalised" in Path("true.csv").read_text()
    plain = run("deconvolve", "scan.csv", "--instrument", "signature.csv", "--stop", "12", "--operator", "slice")
    assert "stop after 12 iterations" in plain.out


def test_a_scan_is_deconvolved_to_every_kind_of_picture_that_help_names(run: Run) -> None:
    """``.svg`` was in the help, and refused."""
    lines = {wide: "".join(f"{k / 5},{math.exp(-k * k / wide)}\n" for k in range(-40, 41)) for wide in (100, 40)}
    for wide, name in ((100, "scan.csv"), (40, "bare.csv")):
        Path(name).write_text("angle,flux\n" + lines[wide])
    done = run("deconvolve", "scan.csv", "--instrument", "bare.csv", "--stop", "3", "-o", "true.svg", "-o", "true.pdf")
    assert done.status == 0, done.err
    assert b"<svg" in Path("true.svg").read_bytes()
    for wrong in ("3.5", "-3", "plato"):
        told = run("deconvolve", "scan.csv", "--instrument", "bare.csv", "--stop", wrong)
        assert told.status == 2
        assert "thesis. Or a whole number of iterations, from 1." in told.err


def test_mistakes_are_told_and_nothing_is_written(run: Run) -> None:
    Path("diffuser.toml").write_text(DIFFUSER.replace("exponent", "exponant"))
    wrong = run("goniometer", "diffuser.toml", "-o", "scan.csv")
    assert wrong.status == 1
    assert "exponent" in wrong.err
    assert run("goniometer", "-o", "scan.csv").status == 2
    assert run("goniometer", "--no-sample", "--aperture-shape", "disc").status == 2
    wide = "".join(f"{k / 10},{int(abs(k) < 60)}\n" for k in range(-80, 81))
    Path("wide.csv").write_text("angle,flux\n" + wide)
    Path("scan.csv").write_text("angle,flux\n" + "".join(f"{k / 10},{1 / (1 + k * k)}\n" for k in range(-50, 51)))
    told = run("deconvolve", "scan.csv", "--instrument", "wide.csv", "-o", "true.csv")
    assert told.status == 1
    assert "scan to larger angles" in told.err
    assert run("deconvolve", "scan.csv", "--instrument", "scan.csv", "--stop", "heldout").status == 2
    assert not Path("true.csv").exists()


BRUSHED = """kind = "mixture"
parts = [{kind = "gaussian", peak = 60.0, sigma = 0.008, aspect = 2.0}, {kind = "lambertian", reflectance = 0.3}]
"""


@pytest.mark.slow
def test_a_brushed_sample_is_measured_in_two_dimensions_and_comes_back(run: Run) -> None:
    """The instrument is told by the file, by options, or by a scan of its bare beam."""
    Path("brushed.toml").write_text(BRUSHED)
    place = ("--window", "--incidence", "60", "--turn", "30", "--step", "1", "--span", "5", "--head", "60")
    told = run("goniometer", "brushed.toml", *place, "--photons", "1e6", "--method", "quadrature", "-o", "scan.csv")
    assert told.status == 0, told.err
    assert "121 positions in two dimensions" in told.out
    outputs = ("-o", "true.csv", "-o", "true.png")
    found = run("deconvolve", "scan.csv", "--method", "parametric", *outputs, "--json")
    assert found.status == 0, found.err
    facts = json.loads(found.out)
    assert abs(facts["peak"] - 60.1) < 4 * facts["peak_error"]
    assert facts["peak_before"] < 50
    assert facts["model"]["parts"][0]["kind"] == "gaussian"
    assert Path("true.png").stat().st_size > 10_000
    assert "# regular_share = 0.0" in Path("true.csv").read_text()
    text = Path("scan.csv").read_text()
    Path("bare.csv").write_text("".join(line for line in text.splitlines(True) if "diameter" not in line))
    unknown = run("deconvolve", "bare.csv")
    assert unknown.status == 1
    assert "instrument is not known" in unknown.err
    short = ("--stop", "5", "--regular", "0", "--replicates", "0", "--json")
    stated = run("deconvolve", "bare.csv", "--aperture", "25", "--beam", "14", "--distance", "886", *short)
    run("goniometer", "--no-sample", "-o", "signature.csv")
    signed = run("deconvolve", "bare.csv", "--instrument", "signature.csv", *short)
    peaks = [json.loads(one.out)["peak"] for one in (stated, signed)]
    assert peaks[1] == pytest.approx(peaks[0], rel=0.02)


def test_options_of_the_other_kind_of_scan_are_refused(run: Run) -> None:
    Path("brushed.toml").write_text(BRUSHED)
    assert run("goniometer", "brushed.toml", "--outside", "10").status == 2
    assert run("goniometer", "--no-sample", "--window").status == 2
    assert run("goniometer", "brushed.toml", "--window", "--plane", "cross-plane").status == 2
    Path("flat.csv").write_text("angle,flux\n" + "".join(f"{k / 10},{1 / (1 + k * k)}\n" for k in range(-50, 51)))
    Path("wide.csv").write_text("theta_s,phi_s,flux\n" + "".join(f"{30 + k},0,1\n{30 + k},5,2\n" for k in range(9)))
    for call, told in (
        (("flat.csv", "--instrument", "flat.csv", "--cell", "0.5"), "two dimensions"),
        (("flat.csv", "--instrument", "flat.csv", "--method", "parametric"), "two dimensions"),
        (("flat.csv",), "state --instrument"),
        (("wide.csv", "--operator", "slice"), "one plane"),
        (("wide.csv", "--aperture", "25"), "all three"),
    ):
        refused = run("deconvolve", *call)
        assert refused.status == 1
        assert told in refused.err
