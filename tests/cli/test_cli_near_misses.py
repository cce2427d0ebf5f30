"""What people type who do not know the program: it is understood, or answered with the right form."""

from __future__ import annotations

import json
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.formats.head import WORKBOOK_SIGNATURE

from cli.outcome import Run


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    et.write_rays(tmp_path / "lamp.tm25ray", et.RingSource(rays=20_000, seed=1).ray_set())
    return tmp_path / "lamp.tm25ray"


def mapped(run: Run, lamp: Path, *words: object) -> dict[str, object]:
    """The map that a call of `luminance` makes."""
    base = ("--method", "cone", "--acceptance", "5", "-o", "map.npz", "--json")
    outcome = run("luminance", lamp, *words, *base)
    assert outcome.status == 0, outcome.err
    found = json.loads(outcome.out)["maps"][0]
    assert isinstance(found, dict)
    return found


def test_blanks_between_numbers_are_commas(run: Run, lamp: Path) -> None:
    """`--observer 30 0 --size 40 20` and `--observer 30,0 --size 40,20` are the same map."""
    usual = mapped(run, lamp, "--observer", "30,-5", "--size", "40,20", "--pixels", "8,4")
    loose = mapped(run, lamp, "--observer", "30", "-5", "--size", "40", "20", "--pixels", "8", "4")
    assert usual == loose


def test_one_number_is_a_square(run: Run, lamp: Path) -> None:
    screen = mapped(run, lamp, "--observer", "0,0", "--size", "4", "--pixels", "8")["screen"]
    assert isinstance(screen, dict)
    assert (screen["width"], screen["height"], screen["columns"], screen["rows"]) == (4, 4, 8, 8)


def test_counts_have_letters(run: Run, lamp: Path) -> None:
    for text, number in (("1k", 1000), ("0.002M", 2000), ("2e3", 2000)):
        assert run("convert", lamp, "less.tm25ray", "--subset", text).status == 0
        assert len(et.read_rays("less.tm25ray")) == number
    assert "100M" in run("convert", lamp, "less.tm25ray", "--subset", "1X").err


def test_the_case_of_a_choice_does_not_matter(run: Run, lamp: Path) -> None:
    mapped(run, lamp, "--observer", "0,0", "--size", "20,20", "--scale", "Log", "-o", "map.svg")
    usual = mapped(run, lamp, "--observer", "30,0", "--size", "20,20", "--plane", "xy")
    base = ("--observer", "30,0", "--size", "20,20", "--acceptance", "5", "-o", "map.npz", "--json")
    loose = run("luminance", lamp, *base, "--plane", "XY", "--method", "Cone")
    assert loose.status == 0, loose.err
    assert loose.json["maps"][0] == usual


@pytest.mark.parametrize("unit", ["lm", "LM", "Lm", "W", "w"])
def test_a_unit_is_the_same_in_any_case(run: Run, tmp_path: Path, unit: str) -> None:
    """1 W at 555 nm, where V(λ) is 1, is 683 lm: for a ray file that is written, and for an intensity."""
    green = et.RaySet([[0, 0, 0]] * 2, [[0, 0, 1], [0, 0.6, 0.8]], [0.5, 0.5], flux_unit="W", wavelength=[555.0] * 2)
    et.write_rays(tmp_path / "green.tm25ray", green)
    unit_found, flux = ("lm", 683.0) if unit.lower() == "lm" else ("W", 1.0)
    assert run("convert", tmp_path / "green.tm25ray", "green.dat", "--unit", unit).status == 0
    rays = et.read_rays("green.dat")
    assert (rays.flux_unit, rays.total_flux) == (unit_found, pytest.approx(flux, rel=1e-5))
    found = run(
        "intensity", tmp_path / "green.tm25ray", "--unit", unit, "--c-planes", "4", "--gamma-step", "10", "--json"
    )
    assert found.json["flux_unit"] == unit_found
    assert found.json["flux"] == pytest.approx(flux, rel=1e-5)


def test_a_kind_of_picture_is_the_same_in_any_case(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []
    monkeypatch.setattr("etendue.cli.intensity.plot_intensity", lambda *given, **_: drawn.append(given[2]))
    et.write_intensity(tmp_path / "lamp.ies", et.Intensity(c=[0], gamma=[0, 45, 90], values=[[9, 5, 0]]))
    for kind in ("cartesian", "Cartesian", "POLAR"):
        assert run("intensity", tmp_path / "lamp.ies", "--kind", kind, "-o", "lamp.svg").status == 0
    assert drawn == ["cartesian", "cartesian", "polar"]


def test_choices_of_other_verbs_are_the_same_in_any_case(run: Run, lamp: Path) -> None:
    mapped(run, lamp, "--observer", "0,0", "--size", "20,20", "--pixels", "8")
    means = []
    for kind, dead in (("average", "zero"), ("Average", "ZERO")):
        assert run("filter", "map.npz", "--kind", kind, "-o", "smooth.npz").status == 0
        means.append(run("compare", "smooth.npz", "map.npz", "--dead", dead, "--json").json)
    assert means[0] == means[1]
    patches = ("--surface", "plane:z=0", "--pixel", "40", "--threshold", "5", "-o", "patches")
    assert run("patches", lamp, *patches, "--format", "LDT").status == 0
    assert list(Path("patches/lids").glob("*.ldt"))


@pytest.mark.parametrize(
    ("option", "told"), [("--theta", "--observer 30,0"), ("--resolution", "--pixels 128,128"), ("--log", "--scale log")]
)
def test_options_that_do_not_exist_are_answered(run: Run, lamp: Path, option: str, told: str) -> None:
    outcome = run("luminance", lamp, option, "30", "-o", "map.npz")
    assert outcome.status == 2
    assert told in outcome.err


def test_a_format_goes_by_the_name_of_its_program(run: Run, lamp: Path) -> None:
    assert run("convert", lamp, "lamp.dat", "--format", "opticstudio").status == 0
    assert run("convert", lamp, "usual.dat", "--format", "zemax").status == 0
    assert Path("lamp.dat").read_bytes() == Path("usual.dat").read_bytes()
    assert "zemax" in run("convert", lamp, "lamp.dat", "--format", "zemaks").err


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ('material = "PMMA"', "medium = 'PMMA'"),
        ("radius = 4", "shape = { kind = 'ball', radius = 4 }"),
        ("position = [0, 0, 7]", "at = [0, 0, 7]"),
        ("normal = [0, 0, -1]", "toward = [0, 0, -1]"),
    ],
)
def test_keys_of_other_programs_are_answered(run: Run, tmp_path: Path, line: str, told: str) -> None:
    scene = f'[[solids]]\nname = "lens"\nshape = {{ kind = "ball", radius = 4 }}\n{line}\n'
    (tmp_path / "scene.toml").write_text(scene, encoding="utf-8")
    outcome = run("trace", "scene.toml")
    assert outcome.status == 1
    assert told in outcome.err


def test_keys_of_the_wrong_table_are_answered(run: Run, tmp_path: Path) -> None:
    scene = """
        surfaces = [{ shape = { kind = "disk", diameter = 8, normal = [0, 1, 0], at = [0, 0, 7] }, finish = "mirror" }]
        detectors = [{ kind = "illuminance", pixels = 8, width = 1, height = 1, columns = 8, rows = 8 }]
        observers = [{ distance = 1000, at = [0, 0, 1000] }]
    """
    (tmp_path / "scene.toml").write_text(scene, encoding="utf-8")
    told = run("draw", "scene.toml").err
    for answer in (
        "shape.diameter: unknown key. Give a radius, which is half of 8.",
        "shape.normal: unknown key. Give the direction beside the shape: toward = [0, 1, 0].",
        "shape.at: unknown key. Give the place beside the shape: at = [0, 0, 7].",
        "pixels: unknown key. Give columns and rows.",
        "at: unknown key. Give where it stands by theta, phi and distance, and what it looks at by target.",
    ):
        assert answer in told


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("luminance {} --observer 0,0 --size 1,1 --acceptance 95 -o a.npz", "error: --acceptance is 95.0°"),
        ("luminance {} --observer 90,0 --size 1,1 --plane xy -o a.npz", "use --plane view or another theta"),
        (
            "luminance {} --observer 0,0 --size 1,1 --region 5,1,2,3 -o a.npz",
            "error: region 5,1,2,3: left must be below",
        ),
        ("luminance {} --observer 0,0 --size 1,1 --threads 0 -o a.npz", "'--threads': give 1 or more"),
        ("luminance {} --observer 0,0 --size 1,1 --samples 1e3 -o a.npz", "'--samples': give a whole number in digits"),
        ("intensity {} --gamma-step 7", "error: --gamma-step is 7°, which does not divide 180°; 7.2° would do."),
        ("convert {} a.dat --seed -1 --subset 3", "error: seed -1; give 0 to 2^64 - 1."),
    ],
)
def test_messages_name_options(run: Run, lamp: Path, words: str, told: str) -> None:
    outcome = run(*(str(lamp) if word == "{}" else word for word in words.split()))
    assert outcome.status
    assert told in outcome.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            "trace lamp.tm25ray",
            "lamp.tm25ray: this is a ray file (IES TM-25 ray file), not a scene (.toml). etendue info, fit",
        ),
        ("filter lamp.tm25ray --kind opt -o a.npz", "this is a ray file (IES TM-25 ray file), no map"),
        ("sample lamp.tm25ray -n 9 -o a.dat", "this is a ray file (IES TM-25 ray file), not a light field"),
        ("fit map.npz -o a.h5", "this is a luminance or illuminance map, no ray file. etendue plot, filter, compare"),
        ("fit scene.toml -o a.h5", "this is a scene, no ray file. etendue info, trace, luminance, draw"),
        ("bsdf info scene.toml", "this is a scene, no BSDF"),
        ("bsdf info finish.toml", "this is a finish, no BSDF. etendue goniometer takes it"),
        ("fit finish.toml -o a.h5", "this is a finish, no ray file. etendue goniometer takes it"),
        ("info finish.toml", "this is a finish, no ray file. etendue goniometer takes it"),
        ("bsdf info scan.xls", "this is a workbook of Excel, no BSDF. etendue bsdf fit takes scans"),
        ("info scan.xls", "this is a workbook of Excel, no ray file. etendue bsdf fit takes scans"),
        (
            "fit result.h5 -o a.h5",
            "this is the result of a trace, no ray file. etendue info, luminance and view take it",
        ),
        ("sample result.h5 -n 9 -o a.dat", "this is the result of a trace, not a light field"),
        ("draw lamp.ies", "this is an intensity distribution (IES LM-63), not a scene (.toml)"),
    ],
)
def test_a_file_of_another_kind_is_told_by_name(run: Run, lamp: Path, words: str, told: str) -> None:
    mapped(run, lamp, "--observer", "0,0", "--size", "9,9", "--pixels", "2,2")
    et.write_intensity("lamp.ies", et.Intensity(c=[0], gamma=[0, 10, 90], values=[[9, 5, 0]]))
    scene = et.Scene(sources=[{"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 1}])
    scene.save("scene.toml")
    Path("finish.toml").write_text('# paint\nkind = "gaussian"\npeak = 60.0\nsigma = 0.02\n', encoding="utf-8")
    Path("scan.xls").write_bytes(WORKBOOK_SIGNATURE + bytes(504))
    et.trace(scene, 10).save("result.h5")
    outcome = run(*words.split())
    assert outcome.status == 1
    assert told in outcome.err


def test_regions_and_what_is_up(run: Run, lamp: Path) -> None:
    """A region is the mean of its pixels, dead ones as 0; a quarter turn of the head turns the map by a quarter."""
    words = ("--size", "20,20", "--pixels", "4,4")
    plain = mapped(run, lamp, "--observer", "40,0", *words, "--region", "-10,0,0,10")
    values = et.read_map("map.npz").values
    (region,) = plain["regions"]  # type: ignore[misc]
    assert region["mean"] == pytest.approx(np.nan_to_num(values[:2, :2]).mean(), rel=1e-12)
    mapped(run, lamp, "--observer", "40,0", *words, "--roll", "90")
    # The head tilts to its left, so that the picture turns clockwise.
    np.testing.assert_allclose(et.read_map("map.npz").values, np.rot90(values, -1), rtol=1e-9)
    mapped(run, lamp, "--observer", "90,0", *words, "--up", "0,0,1")
    upright = et.read_map("map.npz").values
    mapped(run, lamp, "--observer", "90,0", *words)
    # Seen along X without it, +Y is up and Z points to the left.
    np.testing.assert_allclose(upright, np.rot90(et.read_map("map.npz").values, -1), rtol=1e-9)
