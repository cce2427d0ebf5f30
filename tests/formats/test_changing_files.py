"""Files that somebody shortens, writes to or replaces while they are in use: an error or a warning, never a dead program."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError, SceneError
from etendue.formats.rays import RAY_FORMATS, read_rays, write_rays
from etendue.quantities.file_records import FileRecords
from etendue.quantities.ray_set import RaySet
from etendue.quantities.report import ChangedFileWarning

BINARY = ("tm25", "zemax", "lighttools", "speos", "asap", "etd")
"""Formats whose rays stay in the file."""

RAYS = 5000

OBSERVER, SCREEN = et.Observer(20, 30, 1000), et.Screen(80, 80, 4, 4)

USES = {
    "pass": lambda rays: rays.pass_over(),
    "moments": lambda rays: rays.moments(),
    "column": lambda rays: rays.flux,
    "batches": lambda rays: list(rays.batches()),
    "subset": lambda rays: rays.subset(4900, seed=1),
    "moved": lambda rays: rays.moved((0, 0, 1)),
    "map": lambda rays: et.luminance_map(rays, OBSERVER, SCREEN, method="cone", acceptance=5),
    "intensity": lambda rays: et.intensity_distribution(rays, 30, 15),
    "index": et.RayIndex.build,
    "fit": lambda rays: et.LightField.fit(rays, et.Disk(radius=50), depths=(2, 2, 2, 2)),
    "trace": lambda rays: et.trace(
        et.Scene(
            sources=[{"kind": "rays", "rays": rays}],
            detectors=[{"name": "far", "kind": "intensity"}],
        ),
        rays=RAYS,
    ),
}


@pytest.fixture
def written() -> et.RaySet:
    return coloured(3)


def coloured(seed: int) -> RaySet:
    rays = et.RingSource(rays=RAYS, seed=seed).ray_set()
    return RaySet(rays.position, rays.direction, rays.flux, wavelength=np.linspace(450, 650, RAYS))


@pytest.mark.slow
@pytest.mark.parametrize("name", BINARY)
@pytest.mark.parametrize("use", USES)
def test_a_file_that_shrinks_is_an_error_that_names_it(name: str, use: str, written: RaySet, tmp_path: Path) -> None:
    path = tmp_path / "shrinking.rays"
    write_rays(path, written, name)
    rays = read_rays(path)
    assert isinstance(rays.records, FileRecords)
    if use == "trace":
        assert rays.total_flux > 0  # or the scene would find the fault before a ray is traced
    os.truncate(path, path.stat().st_size // 2)
    # A scene that looks at the wavelengths of its rays tells what is wrong with the file as one of its mistakes.
    with pytest.raises(
        (FormatError, SceneError), match=r"shrinking\.rays: byte \d+: the file ended here while it was read"
    ):
        USES[use](rays)


@pytest.mark.slow
def test_the_program_ends_with_a_message_and_leaves_nothing_behind(written: RaySet, tmp_path: Path) -> None:
    """A map of such a file would end it with signal 7 and no word."""
    path = tmp_path / "shrinking.tm25ray"
    write_rays(path, written)
    code = f"""
import os, sys
from etendue.cli import convert
from etendue.cli.app import main
opened = convert.read_rays
def shrinks(path, **how):
    rays = opened(path, **how)
    os.truncate(path, 40_000)
    return rays
convert.read_rays = shrinks
sys.argv = ["etendue", "convert", {str(path)!r}, {str(tmp_path / "out.ray")!r}, "--format", "lighttools"]
main()
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 1, ended
    assert "shrinking.tm25ray: byte 40000: the file ended here while it was read" in ended.stderr
    assert "Traceback" not in ended.stderr
    assert sorted(file.name for file in tmp_path.iterdir()) == ["shrinking.tm25ray"]


def test_a_file_that_grows_counts_as_it_was_and_is_told_once(written: RaySet, tmp_path: Path) -> None:
    path = tmp_path / "growing.tm25ray"
    write_rays(path, written)
    rays = read_rays(path)
    before = rays.flux
    with path.open("ab") as file:
        file.write(bytes(500))
    with pytest.warns(ChangedFileWarning, match=r"growing\.tm25ray: somebody wrote to this file"):
        assert np.array_equal(rays.flux, before)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert rays.tally.rays == RAYS


def test_a_file_written_over_in_place_is_told(written: RaySet, tmp_path: Path) -> None:
    path = tmp_path / "rewritten.tm25ray"
    write_rays(path, written)
    rays = read_rays(path)
    data = path.read_bytes()
    os.utime(path, ns=(0, 0))
    assert path.read_bytes() == data
    with pytest.warns(ChangedFileWarning):
        rays.pass_over()


def test_a_file_whose_name_another_takes_stays_what_it_was(written: RaySet, tmp_path: Path) -> None:
    path = tmp_path / "replaced.tm25ray"
    write_rays(path, written)
    rays = read_rays(path)
    before = rays.flux
    write_rays(path, et.RingSource(rays=100, seed=4))
    assert np.array_equal(rays.flux, before)
    assert len(read_rays(path)) == 100


@pytest.mark.parametrize("name", [f.name for f in RAY_FORMATS])
def test_a_file_that_changes_while_it_is_opened_is_refused(
    name: str, written: RaySet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its header is of one file and its rays of another."""
    path, other = tmp_path / "a.rays", tmp_path / "b.rays"
    write_rays(path, written, name)
    write_rays(other, coloured(9), name)
    (chosen,) = (f for f in RAY_FORMATS if f.name == name)

    def swapped(_self: object, at: Path) -> RaySet:
        rays = chosen.read(at)
        other.replace(path)
        return rays

    monkeypatch.setattr("etendue.formats.rays.detect_format", lambda _path: type("Swapping", (), {"read": swapped})())
    with pytest.raises(FormatError, match="another file took its place while it was opened"):
        read_rays(path)


@pytest.mark.parametrize(
    "name", [f.name for f in RAY_FORMATS if f.name.endswith(("text", "csv")) or f.name == "tracepro"]
)
def test_a_text_file_that_shrinks_while_it_is_read_is_refused(
    name: str, written: RaySet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "text.rays"
    write_rays(path, written, name)
    monkeypatch.setattr("etendue.formats.rays.text_rows.BLOCK", 1 << 12)
    from etendue.formats.rays.text_rows import RowLayout

    kept = RowLayout.records

    def shrinks(self: RowLayout, values: np.ndarray) -> np.ndarray:
        os.truncate(path, path.stat().st_size // 2)
        return kept(self, values)

    monkeypatch.setattr(RowLayout, "records", shrinks)
    with pytest.raises(FormatError, match=r"text\.rays: byte \d+: the file ended here while it was read"):
        read_rays(path)
