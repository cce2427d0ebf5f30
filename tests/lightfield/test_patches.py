"""A folder of patches: what the manifest says is what the files hold, and a failure leaves nothing behind."""

from __future__ import annotations

import csv
import functools
import json
import sys
from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.cli import main
from etendue.errors import ArgumentError, UnknownNameError
from etendue.formats import patch_folder
from etendue.lightfield.carrier import Disk, Dome
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.quantities.patches import Patches
from oracles.sources import DieUnderDome

Array = npt.NDArray[np.float64]
Run = Callable[..., tuple[int, str, str]]


@functools.cache
def dome_rays(n: int = 20_000, unit: str = "lm") -> et.RaySet:
    source = DieUnderDome(floor=0.1)
    position, direction = source.rays(n, seed=7)
    flux = np.full(n, source.total_flux / n)
    return et.RaySet(position, direction, flux, flux_unit=unit)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def source() -> GriddedSource:
    return GriddedSource.fit(dome_rays(), Dome(radius=1.264, window=0.7), pixel=0.3, threshold=2.0, parallels=4)


@pytest.mark.slow
@pytest.mark.parametrize("format", ["ies", "ldt"])
def test_manifest_and_files_say_the_same(source: GriddedSource, tmp_path: Path, format: str) -> None:
    source.save_patches(tmp_path / "p", format)
    manifest = json.loads((tmp_path / "p" / "manifest.json").read_text("utf-8"))
    rows, patches = manifest["patches"], source.patches
    assert (manifest["kind"], manifest["version"], manifest["flux_unit"]) == ("etendue patches", 2, "lm")
    assert (manifest["surface"], manifest["parallels"]) == ("dome:radius=1.264,z=0,window=0.7,centre=0/0", 4)
    assert manifest["flux"] == source.total_flux == pytest.approx(sum(row["flux"] for row in rows))
    assert manifest["account"]["rays"] == 20_000
    assert len(rows) == len(patches)
    assert {row["shape"] for row in rows} == {"square", "spherical cell"}
    rng = np.random.default_rng(1)
    for i, row in enumerate(rows):
        led = et.read_intensity(tmp_path / "p" / row["file"])
        # The file holds the table in the patch's axes: C from x towards y, γ from z, nothing turned or mirrored.
        direction = rng.normal(size=(20, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        axes = np.array([row["x"], row["y"], row["z"]])
        assert np.allclose(
            led.in_direction(direction @ axes.T), patches.towards(np.full(20, i), direction), rtol=1e-5, atol=1e-6
        )
        assert led.flux == pytest.approx(row["table_flux"], rel=1e-5)
        assert row["flux"] == patches.flux[i]
        assert (led.luminaire["opening_x"], led.luminaire["opening_y"]) == pytest.approx(tuple(row["extent"]), rel=1e-5)
        outline = np.array(row["outline"])
        assert outline.shape[1] == 3
        assert np.allclose((outline - row["centre"]) @ axes[2], 0, atol=1e-12)
        assert row["error"] <= 2.0 or (row["theta_step"], row["phi_step"]) == (1, 1)
    files = {path.relative_to(tmp_path / "p").as_posix() for path in (tmp_path / "p").rglob("*") if path.is_file()}
    assert files == {"manifest.json", "manifest.csv", *(row["file"] for row in rows)}
    with (tmp_path / "p" / "manifest.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    for line, row in zip(table, rows, strict=True):
        assert [float(line[f"z_{axis}"]) for axis in "xyz"] == row["z"]
        assert [float(line[f"extent_{axis}"]) for axis in "xy"] == row["extent"]
        assert (line["file"], float(line["flux"]), line["part"]) == (row["file"], row["flux"], row["part"])


def test_watts_are_written_as_ies_only(tmp_path: Path) -> None:
    source = GriddedSource.fit(dome_rays(2000, "W"), Disk(radius=0.8), pixel=0.4, threshold=5)
    source.save_patches(tmp_path / "w")
    assert et.read_intensity(tmp_path / "w" / "lids" / "000001.ies").flux_unit == "W"
    with pytest.raises(ArgumentError, match="watts"):
        source.save_patches(tmp_path / "v", "ldt")
    assert [path.name for path in tmp_path.iterdir()] == ["w"]


@pytest.mark.parametrize("format", patch_folder.PATCH_FORMATS)
def test_everything_that_is_written_can_be_replaced(source: GriddedSource, tmp_path: Path, format: str) -> None:
    """Two writers of names and one that knows them: the dome has rectangles and meshes."""
    target = tmp_path / "p"
    source.save_patches(target, format, scenes=patch_folder.SCENES)
    for name in ("sweep.csv", "sweep.png", "radiance/scene.oct"):
        (target / name).write_text("made of it")
    source.save_patches(target, format)
    assert sorted(path.name for path in target.iterdir()) == ["lids", "manifest.csv", "manifest.json"]


def test_a_folder_is_replaced_only_if_it_holds_patches(source: GriddedSource, tmp_path: Path) -> None:
    target = tmp_path / "p"
    source.save_patches(target, scenes=["radiance"])
    assert (target / "radiance" / "scene.rad").is_file()
    source.save_patches(target)
    assert not (target / "radiance").exists()
    for name in ("notes.txt", "lids/view.png", "lids/000001.ldt.bak", "mitsuba/seen.exr", "rays/led.tm25ray"):
        (target / name).parent.mkdir(exist_ok=True)
        (target / name).write_text("mine")
        with pytest.raises(ArgumentError, match=f"{name}, which would be lost"):
            source.save_patches(target)
        assert (target / name).read_text() == "mine"
        (target / name).unlink()
    for name, content in (("manifest.json", '{"name": "a web page"}'), ("manifest.json", "[]"), ("manifest.json", "{")):
        other = tmp_path / "other"
        other.mkdir(exist_ok=True)
        (other / name).write_text(content)
        with pytest.raises(ArgumentError, match="would be lost"):
            source.save_patches(other)
        assert (other / name).read_text() == content
    (tmp_path / "file").write_text("x")
    (tmp_path / "link").symlink_to(target)
    for name, hint in (("file", "this is a file"), ("link", "this is a file or a link"), ("no/p", "does not exist")):
        with pytest.raises(ArgumentError, match=hint):
            source.save_patches(tmp_path / name)
    (tmp_path / "empty").mkdir()
    source.save_patches(tmp_path / "empty")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "file", "link", "other", "p"]


def test_a_failure_leaves_what_was_there(
    source: GriddedSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source.save_patches(tmp_path / "p")
    before = (tmp_path / "p" / "manifest.json").read_bytes()

    def interrupted(patches: Patches, folder: Path, factor: float) -> None:
        (folder / "scene.rad").write_text(f"half of {len(patches)} patches, times {factor}")
        raise KeyboardInterrupt

    monkeypatch.setitem(patch_folder.SCENES, "radiance", interrupted)
    for name in ("p", "q"):
        with pytest.raises(KeyboardInterrupt):
            source.save_patches(tmp_path / name, scenes=["radiance"])
    assert [path.name for path in tmp_path.iterdir()] == ["p"]
    assert (tmp_path / "p" / "manifest.json").read_bytes() == before
    # The old folder comes back if the new one cannot take its place.
    rename = Path.rename

    def fails(self: Path, target: Path) -> Path:
        if self.name.startswith(".writing"):
            raise OSError("full")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", fails)
    with pytest.raises(OSError, match="full"):
        source.save_patches(tmp_path / "p")
    assert [path.name for path in tmp_path.iterdir()] == ["p"]
    assert (tmp_path / "p" / "manifest.json").read_bytes() == before


def test_unknown_names_are_refused(source: GriddedSource, tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'ies'"):
        source.save_patches(tmp_path / "p", "ise")
    with pytest.raises(UnknownNameError, match="Did you mean 'mitsuba'"):
        source.save_patches(tmp_path / "p", scenes=["mitsuba3"])
    assert not list(tmp_path.iterdir())


# --- the verb ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Run the program in a folder with one ray file: exit status, standard output, standard error."""
    monkeypatch.setenv("COLUMNS", "300")
    monkeypatch.chdir(tmp_path)
    et.write_rays(tmp_path / "led.tm25ray", dome_rays())

    def call(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        monkeypatch.setattr(sys, "argv", ["etendue", "patches", *map(str, arguments)])
        with pytest.raises(SystemExit) as leaving:
            main()
        return int(leaving.value.code or 0), *capsys.readouterr()

    return call


def test_the_verb_writes_what_the_call_does(run: Run, tmp_path: Path) -> None:
    options = ("--surface", "dome:radius=1.264,window=0.7", "--pixel", 0.3, "--threshold", 2, "--parallels", 4)
    status, out, err = run("led.tm25ray", *options, "--scene", "radiance", "--scene", "mitsuba", "-o", "p", "--json")
    assert (status, err) == (0, "")
    facts = json.loads(out)
    rays = et.read_rays("led.tm25ray")
    source = GriddedSource.fit(rays, Dome(radius=1.264, window=0.7), 0.3, 2.0, 4)
    assert (facts["patches"], facts["flux"], facts["scenes"]) == (
        len(source.patches), source.total_flux, ["radiance", "mitsuba"]
    )  # fmt: skip
    source.save_patches("q")
    for path in Path("q").rglob("*"):
        if path.is_file():
            assert path.read_bytes() == (tmp_path / "p" / path.relative_to("q")).read_bytes()
    assert {path.name for path in Path("p").iterdir()} == {
        "lids", "manifest.json", "manifest.csv", "radiance", "mitsuba"
    }  # fmt: skip


def test_text_says_what_was_left_out(run: Run) -> None:
    status, out, _ = run("led.tm25ray", "--surface", "disk:radius=0.5", "--pixel", 0.25, "--flux", "100lm", "-o", "p/")
    assert status == 0
    assert "patches on disk:radius=0.5" in out
    assert "never cross the surface" in out
    assert "the rays on patches have" in out
    assert "all light is theirs multiplied by" in out


@pytest.mark.parametrize(
    ("arguments", "status", "hint"),
    [
        (["led.tm25ray", "-o", "p", "--surface", "dom:radius=2"], 1, "Did you mean 'dome'"),
        (["led.tm25ray", "-o", "p", "--surface", "disk:radius=x"], 1, "number in mm"),
        (["led.tm25ray", "-o", "p", "--format", "iec"], 2, "'ies'"),
        (["led.tm25ray", "-o", "p", "--scene", "povray"], 2, "--scene"),
        (["led.tm25ray", "-o", "p", "--pixel", "0"], 1, "above 0"),
        (["led.tm25ray", "-o", "p", "--threshold", "-3"], 1, "percent"),
        (["led.tm25ray", "-o", "p", "--parallels", "4"], 1, "has none"),
        (["led.tm25ray", "-o", "led.tm25ray"], 1, "also an input"),
        (["led.tm25ray", "-o", "none/p"], 1, "does not exist"),
        (["nothing.ray", "-o", "p"], 1, "nothing.ray"),
        (["led.tm25ray", "-o", "p", "--surface", "disk:radius=1,z=-5"], 1, "no light crosses"),
        (["led.tm25ray"], 2, "output"),
    ],
)
def test_failures_leave_nothing(run: Run, tmp_path: Path, arguments: list[str], status: int, hint: str) -> None:
    if "no light" in hint:
        position = np.tile([50.0, 0, 0], (10, 1))
        et.write_rays(tmp_path / "led.tm25ray", et.RaySet(position, np.tile([0, 0, 1.0], (10, 1)), np.ones(10)))
    before = sorted(tmp_path.rglob("*"))
    found, out, err = run(*arguments)
    assert (found, out) == (status, "")
    assert hint in err
    assert sorted(tmp_path.rglob("*")) == before
