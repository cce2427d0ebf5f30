"""Folders of patches read back: the same light, and clear words about folders that are damaged."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.lightfield.carrier import Cylinder, Disk, Dome, Surface
from etendue.lightfield.gridded.gridded_source import GriddedSource

DIGITS = 2e-5
"""Relative: what intensity files keep of a number."""


def slanted(n: int = 4000, unit: str = "lm") -> et.RaySet:
    """Rays without symmetry, from 1.9 × 1.1 mm about (0.33, −0.15)."""
    rng = np.random.default_rng(5)
    position = np.column_stack([rng.uniform(-0.6, 1.3, n), rng.uniform(-0.7, 0.4, n), np.zeros(n)])
    direction = rng.normal([0.2, -0.1, 1.5], 0.3, (n, 3))
    direction[:, 2] = np.abs(direction[:, 2]) + 0.1
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return et.RaySet(position, direction, rng.uniform(0.5, 1.5, n) / n, flux_unit=unit)  # type: ignore[arg-type]


def made(surface: Surface, **options: Any) -> GriddedSource:
    return GriddedSource.fit(slanted(), surface, 0.4, 1.0, **options)


CARRIERS: dict[str, Callable[[], GriddedSource]] = {
    "plane": lambda: made(et.Plane(z=0)),
    "plane about a pixel": lambda: made(et.Plane(z=0.1), centre_on="pixel"),
    "disk elsewhere": lambda: made(Disk(radius=1.4, z=-0.1, centre=(0.3, -0.2))),
    "dome": lambda: made(Dome(radius=2, window=0.9), parallels=3),
    "cylinder": lambda: made(Cylinder(radius=2)),
    "cylinder along y": lambda: made(Cylinder(radius=2, axis="y")),
    "flux stated": lambda: made(et.Plane(z=0)).emitting(7.5),
    "tables alone": lambda: made(et.Plane(z=0)).as_printed,
}


@pytest.mark.slow
@pytest.mark.parametrize("format", ["ies", "ldt"])
@pytest.mark.parametrize("name", CARRIERS)
def test_a_folder_gives_the_same_light(name: str, format: str, tmp_path: Path) -> None:
    source = CARRIERS[name]()
    source.save_patches(tmp_path / "p", format)
    again = GriddedSource.load(tmp_path / "p")
    assert again.emitted_flux == pytest.approx(source.emitted_flux, rel=DIGITS)
    assert again.total_flux == source.total_flux
    for column in ("pixel", "part", "theta_step", "phi_step", "start"):
        assert np.array_equal(getattr(again.patches, column), getattr(source.patches, column)), column
    for column in ("centre", "axes", "area", "projected_area", "flux", "error"):
        assert np.allclose(getattr(again.patches, column), getattr(source.patches, column), rtol=1e-12), column
    rng = np.random.default_rng(2)
    points = rng.uniform([-0.6, -0.7, 0.0], [1.3, 0.4, 0.0], (400, 3))
    directions = rng.normal([0.2, -0.1, 1.0], 0.4, (400, 3))
    expected = source.luminance(points, directions)
    assert np.count_nonzero(expected) > 200
    assert again.luminance(points, directions) == pytest.approx(expected, rel=5 * DIGITS, abs=1e-5 * expected.max())
    facts = {key: value for key, value in source.facts.items() if key not in {"table_flux", "factor", "notes"}}
    assert {key: again.facts[key] for key in facts} == facts


def test_watts_stay_watts(tmp_path: Path) -> None:
    GriddedSource.fit(slanted(unit="W"), et.Plane(z=0), 0.4, 1.0).save_patches(tmp_path / "w")
    assert GriddedSource.load(tmp_path / "w").flux_unit == "W"


def test_what_is_read_is_written_alike(tmp_path: Path) -> None:
    made(Dome(radius=2, window=0.9)).save_patches(tmp_path / "p")
    GriddedSource.load(tmp_path / "p").save_patches(tmp_path / "q")
    first, second = (json.loads((tmp_path / name / "manifest.json").read_text("utf-8")) for name in "pq")
    # Figures of the tables have the digits of the files.
    for head in (first, second):
        for row in head["patches"]:
            row["table_flux"] = float(f"{row['table_flux']:.4g}")
    assert first["patches"] == second["patches"]


Manifest = dict[str, Any]


def damaged(change: Callable[[Manifest], object]) -> Callable[[Path], None]:
    def apply(folder: Path) -> None:
        path = folder / "manifest.json"
        manifest = json.loads(path.read_text("utf-8"))
        change(manifest)
        path.write_text(json.dumps(manifest), "utf-8")

    return apply


def first(**values: Any) -> Callable[[Path], None]:
    """The first patch with other values."""
    return damaged(lambda manifest: manifest["patches"][0].update(values))


DAMAGE: dict[str, tuple[Callable[[Path], None], str]] = {
    "no manifest": (lambda folder: (folder / "manifest.json").unlink(), "manifest.json.*No such file"),
    "no text": (lambda folder: (folder / "manifest.json").write_bytes(b"\xff\xfe"), "manifest.json"),
    "another kind": (damaged(lambda m: m.update(kind="web page")), "kind: no etendue patches"),
    "an older folder": (damaged(lambda m: m.update(version=1)), "version: 1; this program reads version 2"),
    "no patches": (damaged(lambda m: m.update(patches=[])), "no list of patches"),
    "no surface": (damaged(lambda m: m.pop("surface")), "surface: 'nothing'"),
    "no such surface": (damaged(lambda m: m.update(surface="plain:z=0")), "plane"),
    "another surface": (damaged(lambda m: m.update(surface="disk:radius=9,z=4")), r"patches\[0\].centre"),
    "another pixel": (damaged(lambda m: m.update(pixel=0.41)), r"patches\[\d+\].centre"),
    "pixel 0": (damaged(lambda m: m.update(pixel=0)), "pixel is 0"),
    "absurd pixel": (damaged(lambda m: m.update(pixel=1e-9)), "larger pixel"),
    "another lattice": (damaged(lambda m: m.update(centre_on="pixel")), r"patches\[\d+\].centre"),
    "no such lattice": (damaged(lambda m: m.update(centre_on="pixle")), "pixel"),
    "origin of two": (damaged(lambda m: m.update(origin=[0, 0])), "origin"),
    "parallels of words": (damaged(lambda m: m.update(parallels="3")), "parallels"),
    "unit": (damaged(lambda m: m.update(flux_unit="cd")), "flux_unit: 'cd'"),
    "factor 0": (damaged(lambda m: m.update(factor=0.0)), "factor: 0"),
    "account": (damaged(lambda m: m["account"].pop("missed")), "account"),
    "pixel far away": (first(pixel=10**9), "pixels that do not rise"),
    "pixel below 0": (first(pixel=-1), "pixels that do not rise"),
    "pixel twice": (damaged(lambda m: m["patches"].insert(0, m["patches"][0])), "pixels that do not rise"),
    "flux of words": (first(flux="1"), r"patches\[0\].flux"),
    "flux below 0": (first(flux=-1.0), "without light"),
    "flux of truth": (first(flux=True), r"patches\[0\].flux"),
    "steps": (first(theta_step=7), r"patches\[0\]: steps of 7°"),
    "other steps": (first(theta_step=1, phi_step=1), r"lids.000001.ies: angles"),
    "centre": (first(centre=[0, 0, 9]), r"patches\[0\].centre: \[0, 0, 9\]"),
    "outside": (first(file="../secret.ies"), "outside of the folder"),
    "absolute": (first(file="/etc/passwd"), "outside of the folder"),
    "no file": (lambda folder: (folder / "lids" / "000002.ies").unlink(), "000002.ies"),
    "empty file": (lambda folder: (folder / "lids" / "000001.ies").write_text(""), "000001.ies"),
    "a folder for a file": (first(file="lids"), "lids"),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[Path, bytes]:
    """The files of a folder."""
    folder = tmp_path_factory.mktemp("patches") / "p"
    made(et.Plane(z=0)).save_patches(folder)
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def laid(files: dict[Path, bytes], folder: Path) -> Path:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", DAMAGE)
def test_damage_is_told(name: str, written: dict[Path, bytes], tmp_path: Path) -> None:
    folder = laid(written, tmp_path / "p")
    harm, words = DAMAGE[name]
    harm(folder)
    with pytest.raises(FormatError, match=words):
        GriddedSource.load(folder)


def test_a_manifest_cut_anywhere_is_refused(written: dict[Path, bytes], tmp_path: Path) -> None:
    folder = laid(written, tmp_path / "p")
    whole = (folder / "manifest.json").read_bytes()
    for end in [*range(0, len(whole) - 2, 499), len(whole) - 3]:
        (folder / "manifest.json").write_bytes(whole[:end])
        with pytest.raises(FormatError):
            GriddedSource.load(folder)


def test_numbers_that_are_none_are_refused(written: dict[Path, bytes], tmp_path: Path) -> None:
    folder = laid(written, tmp_path / "p")
    text = (folder / "manifest.json").read_text("utf-8")
    (folder / "manifest.json").write_text(text.replace('"threshold": 1.0', '"threshold": NaN'), "utf-8")
    with pytest.raises(FormatError, match="NaN"):
        GriddedSource.load(folder)
