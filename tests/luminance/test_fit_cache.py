"""A fit is kept: the same map, bit by bit, without a second fit; another ray, surface or program is another fit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.lightfield import fit_cache
from etendue.lightfield.light_field import LightField

EYE, SCREEN = et.Observer(25, 40, 300), et.Screen(3, 3, 12, 12)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(fit_cache.FOLDER_VARIABLE, str(tmp_path / "kept"))
    et.clear_cache()
    return tmp_path / "kept"


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One entry for each fit that was made. On a coarse grid: it is the number of fits that is looked at."""
    made: list[int] = []
    fit = LightField.fit

    def counted(rays: Any, *arguments: Any, **options: Any) -> LightField:
        made.append(len(rays))
        return fit(rays, *arguments, **{"depths": (2, 2, 2, 2), **options})

    monkeypatch.setattr(LightField, "fit", staticmethod(counted))
    return made


FLAT = et.Plane(z=0, focus=(0, 0, 0, 0))
"""A plane that no focus is sought for."""


def led(seed: int = 1, n: int = 300) -> et.RaySet:
    rng = np.random.default_rng(seed)
    k = rng.normal((0.2, 0.1, 1.0), 0.5, (n, 3))
    k[:, 2] = np.abs(k[:, 2])
    k /= np.linalg.norm(k, axis=1)[:, None]
    return et.RaySet(np.c_[rng.normal(0, 0.3, n), rng.normal(0, 0.5, n), np.zeros(n)], k, rng.random(n))


def seen(rays: et.RaySet, **options: Any) -> et.LuminanceMap:
    return et.luminance_map(rays, EYE, SCREEN, **{"surface": FLAT, **options})


def forget() -> None:
    fit_cache._memory.clear()


def test_the_map_is_the_same_from_a_fit_from_memory_from_disk_and_without_a_cache(
    folder: Path, fits: list[int]
) -> None:
    rays = led()
    maps = [seen(rays), seen(rays)]
    forget()
    maps.append(seen(rays))
    assert len(fits) == 1
    maps.append(seen(rays, cache=False))
    assert len(fits) == 2
    assert len({m.values.tobytes() + m.standard_error.tobytes() for m in maps}) == 1
    assert len({m.notes for m in maps}) == 1
    assert len({repr(m.provenance) for m in maps}) == 1
    assert et.cache_content().fields == 1 == len(list(folder.iterdir()))


@pytest.mark.usefixtures("folder")
def test_a_recalled_field_tells_the_notes_of_the_rays_as_they_are_now(fits: list[int]) -> None:
    rays = led()
    for notes in (("measured with a dirty window",), (), ("a first draft", "no second one")):
        told = seen(rays.replace(notes=notes))
        assert len(fits) == 1
        whole = seen(rays.replace(notes=notes), cache=False)
        fits.pop()
        assert told.notes == whole.notes
        assert told.notes[len(told.notes) - len(notes) :] == notes


@pytest.mark.usefixtures("folder")
def test_another_ray_surface_unit_or_program_is_another_fit(fits: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    rays = led()
    seen(rays)
    # One ray in the middle, moved by a micrometre.
    place = rays.position.copy()
    place[150, 1] += 1e-3
    seen(et.RaySet(place, rays.direction, rays.flux))
    seen(rays.with_total_flux(7.0))
    seen(rays, surface=et.Plane(z=0.1, focus=FLAT.focus))
    seen(rays, surface=et.Plane(z=0.1000000001, focus=FLAT.focus))
    assert len(fits) == 5
    monkeypatch.setattr(fit_cache, "_program", lambda: "another")
    seen(rays)
    assert len(fits) == 6


@pytest.mark.usefixtures("folder")
def test_a_scene_with_a_ray_file_is_fitted_once(
    fits: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a surface that is known: the search for one takes longest, and is no matter here.
    fit = LightField.fit
    monkeypatch.setattr(LightField, "fit", staticmethod(lambda rays, _, **more: fit(rays, FLAT, **more)))
    et.write_rays(tmp_path / "led.tm25ray", led())
    scene = et.Scene(sources=[{"kind": "rays", "file": str(tmp_path / "led.tm25ray"), "flux": 30}])
    first = et.luminance_map(scene, EYE, SCREEN, rays_per_pixel=4)
    again = et.luminance_map(scene, et.Observer(10, 0, 200), SCREEN, rays_per_pixel=4)
    assert len(fits) == 1
    assert again.values.max() > 0
    assert (
        first.values.tobytes() == et.luminance_map(scene, EYE, SCREEN, rays_per_pixel=4, cache=False).values.tobytes()
    )
    # The file is another one now.
    et.write_rays(tmp_path / "led.tm25ray", led(2))
    et.luminance_map(scene, EYE, SCREEN, rays_per_pixel=4)
    assert len(fits) == 3


def test_a_damaged_file_is_made_anew(folder: Path, fits: list[int]) -> None:
    rays = led()
    whole = seen(rays)
    (path,) = folder.iterdir()
    path.write_bytes(path.read_bytes()[:-500])
    forget()
    assert seen(rays).values.tobytes() == whole.values.tobytes()
    forget()
    seen(rays)
    assert len(fits) == 2


@pytest.mark.usefixtures("folder")
def test_the_folder_is_bounded_and_what_was_used_last_stays(fits: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    sets = [led(seed) for seed in range(4)]
    for rays in sets[:3]:
        seen(rays)
    size = et.cache_content().size
    monkeypatch.setattr(fit_cache, "MOST_BYTES", size)
    forget()
    seen(sets[0])
    seen(sets[3])
    assert et.cache_content().size <= size
    forget()
    made = len(fits)
    seen(sets[0])
    seen(sets[3])
    assert len(fits) == made
    seen(sets[1])
    assert len(fits) == made + 1


@pytest.mark.usefixtures("fits")
def test_files_of_other_names_are_neither_counted_nor_removed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder may be one in which the user keeps work: neither room that is made nor clearing takes any of it."""
    folder.mkdir()
    own = [folder / name for name in ("led.h5", "trace.h5", f"{'0' * 39}g.h5", f"{'0' * 40}.csv", "notes.txt")]
    for path in own:
        path.write_bytes(bytes(4096))
    assert et.cache_content() == fit_cache.CacheContent(folder, 0, 0)
    monkeypatch.setattr(fit_cache, "MOST_BYTES", 1)
    seen(led())
    assert all(path.is_file() for path in own)
    monkeypatch.setattr(fit_cache, "MOST_BYTES", 1 << 30)
    seen(led(2))
    held = et.clear_cache()
    assert held.fields == 1
    assert et.cache_content().fields == 0
    assert sorted(folder.iterdir()) == sorted(own)


def test_a_field_that_cannot_be_removed_is_told(folder: Path) -> None:
    stuck = folder / f"{'a' * 40}.h5"
    stuck.mkdir(parents=True)  # no user can unlink a folder
    with pytest.raises(OSError, match=stuck.name):
        et.clear_cache()


def test_a_folder_that_cannot_be_written_is_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fits: list[int]
) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv(fit_cache.FOLDER_VARIABLE, str(tmp_path / "file" / "kept"))
    assert seen(led()).values.max() > 0
    assert fits == [300]


@pytest.mark.slow
def test_two_processes_share_the_folder(folder: Path, tmp_path: Path) -> None:
    """Both fit and keep at the same time, and clear what the other reads: each gets its map, and no file is left half."""
    et.write_rays(tmp_path / "led.tm25ray", led())
    text = (
        "import sys, etendue as et\n"
        "rays = et.read_rays(sys.argv[1])\n"
        "for i in range(3):\n"
        "    from etendue.lightfield import fit_cache; fit_cache._memory.clear()\n"
        "    view = et.Observer(25, 40, 300), et.Screen(3, 3, 12, 12)\n"
        "    m = et.luminance_map(rays, *view, surface=et.Plane(z=0, focus=(0, 0, 0, 0)))\n"
        "    if i % 2: et.clear_cache()\n"
        "print(float(m.values.sum()).hex())\n"
    )
    both = [
        subprocess.Popen([sys.executable, "-c", text, tmp_path / "led.tm25ray"], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    found = {process.communicate(timeout=200)[0].strip() for process in both}
    assert [process.returncode for process in both] == [0, 0]
    assert len(found) == 1
    assert all(path.suffix == ".h5" for path in folder.iterdir())
