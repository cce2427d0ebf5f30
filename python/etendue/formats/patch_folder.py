"""A source as a folder of patches: one intensity file per patch, and a manifest. See docs/formats/patches.md."""

from __future__ import annotations

import csv
import dataclasses
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, FormatError
from etendue.formats.intensity import INTENSITY_FORMATS, read_intensity
from etendue.formats.output_folder import atomic_folder, check_output_folder
from etendue.formats.scenes import SCENE_FILES, SCENES
from etendue.formats.strict_json import strict_json
from etendue.quantities.arguments import require, require_known, require_path
from etendue.quantities.patches import AngularGrid, Patches

MANIFEST = "manifest.json"
KIND, VERSION = "etendue patches", 2

REWRITE = "Write the folder again with `etendue patches`."

PATCH_FORMATS = {"ies": "lm63", "ldt": "eulumdat"}
"""What the intensity files can be, by extension."""

OWN_FILES = re.compile(
    "|".join(
        (
            r"manifest\.(json|csv)",
            r"sweep\.(csv|png)",
            rf"lids/\d{{6,}}\.({'|'.join(PATCH_FORMATS)})",
            *(f"{name}/({files})" for name, files in SCENE_FILES.items()),
            r"(.*/)?(\.DS_Store|Thumbs\.db)",
        )
    )
)
"""Names of the files that a folder of patches has, with what systems leave in any folder; others are the user's."""


def check_patch_folder(
    folder: str | os.PathLike[str], flux_unit: str, format: str = "ies", scenes: Iterable[str] = ()
) -> None:
    """Refuse, before any work is done, what `write_patch_folder` cannot write.

    Raises
    ------
    UnknownNameError
        If there is no such format or ray tracer.
    ArgumentError
        If the folder cannot be written or holds something else, beside patches too, or the format does not know the unit
        of flux.
    """
    check_output_folder(folder, is_patch_folder)
    others = _other_files(Path(folder))
    if others:
        found = ", ".join(others[:3]) + (f" and {len(others) - 3:,} more" if len(others) > 3 else "")
        raise ArgumentError(
            f"{folder}: this folder of patches also holds {found}, which would be lost with it. Move what is yours, or "
            "give another name."
        )
    require_known(format, PATCH_FORMATS, "format of patches")
    for scene in scenes:
        require_known(scene, SCENES, "ray tracer")
    if format == "ldt" and flux_unit != "lm":
        raise ArgumentError("EULUMDAT knows luminous intensity only, and these rays are in watts; write ies files.")


def is_patch_folder(folder: Path) -> bool:
    """Whether a folder holds patches, by its manifest."""
    if not folder.is_dir():
        return False
    try:
        manifest = strict_json((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, RecursionError, ValueError):
        return False
    return isinstance(manifest, dict) and manifest.get("kind") == KIND


def _other_files(folder: Path) -> list[str]:
    """What a folder holds that no folder of patches has."""
    names = (
        path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_symlink() or not path.is_dir()
    )
    return sorted(name for name in names if not OWN_FILES.fullmatch(name))


def write_patch_folder(
    folder: str | os.PathLike[str],
    patches: Patches,
    facts: Mapping[str, Any],
    format: str = "ies",
    scenes: Iterable[str] = (),
    factor: float = 1.0,
) -> None:
    """Write patches: completely, or not at all.

    Parameters
    ----------
    folder : path
        To be made; its parent must exist. A folder of patches of that name is replaced, if it holds nothing else.
    patches : Patches
        At least one.
    facts : mapping
        What else the manifest says of the whole: plain data.
    format : {"ies", "ldt"}
        Of the intensity files.
    scenes : iterable of str
        Ray tracers for which scenes are added; keys of `etendue.formats.scenes.SCENES`.
    factor : float
        What multiplies the tables in the light of scenes; the intensity files hold the tables alone.

    Raises
    ------
    UnknownNameError
        If there is no such format or ray tracer.
    ArgumentError
        If the folder cannot be written or holds something else, beside patches too, or the format does not know the unit
        of flux.
    """
    require(scenes, Iterable, "scenes", f"a list of ray tracers of {', '.join(SCENES)}")
    scenes = tuple(scenes)
    check_patch_folder(folder, patches.flux_unit, format, scenes)
    rows = list(_rows(patches, format))
    with atomic_folder(folder, is_patch_folder) as temporary:
        (temporary / "lids").mkdir()
        writer = INTENSITY_FORMATS[PATCH_FORMATS[format]].write
        assert writer is not None  # noqa: S101 - both are formats that are written
        for i, row in enumerate(rows):
            writer(patches.intensity(i), temporary / row["file"])
        for scene in dict.fromkeys(scenes):
            (temporary / scene).mkdir()
            SCENES[scene](patches, temporary / scene, factor)
        _write_table(temporary / "manifest.csv", rows)
        head = {"kind": KIND, "version": VERSION, "software": patches.provenance.software}
        head |= {"source": patches.provenance.to_dict(), "flux_unit": patches.flux_unit, **facts}
        (temporary / MANIFEST).write_text(_manifest(head, rows), encoding="utf-8")


@dataclasses.dataclass(frozen=True)
class PatchFolder:
    """What a folder of patches says.

    Parameters
    ----------
    path : Path
        Of the manifest.
    facts : dict
        Of the whole.
    rows : tuple of dict
        Of each patch.
    tables : tuple of array, shape (rows, columns)
        Intensities of each patch at the nodes of its grid [cd or W/sr].
    """

    path: Path
    facts: dict[str, Any]
    rows: tuple[dict[str, Any], ...]
    tables: tuple[npt.NDArray[np.float64], ...]

    def of(self, row: int | None, key: str, kind: type | tuple[type, ...]) -> Any:
        """A value of the whole, or of a patch, that must be there and of a kind.

        Raises
        ------
        FormatError
            If it is not.
        """
        values = self.facts if row is None else self.rows[row]
        place = key if row is None else f"patches[{row}].{key}"
        if key not in values or not isinstance(values[key], kind) or isinstance(values[key], bool):
            raise FormatError(self.path, place, f"{values.get(key, 'nothing')!r:.60}", REWRITE)
        return values[key]


def read_patch_folder(folder: str | os.PathLike[str]) -> PatchFolder:
    """A folder that `write_patch_folder` wrote.

    Raises
    ------
    FormatError
        If the manifest or one of the files that it names is missing or damaged.
    """
    require_path(folder, "folder", "the path of a folder of patches")
    path = Path(folder) / MANIFEST
    try:
        found = strict_json(path.read_bytes())
    except OSError as error:
        raise FormatError(path, "file", error.strerror or str(error), REWRITE) from error
    except (RecursionError, ValueError) as error:
        raise FormatError(path, "text", str(error)[:80], REWRITE) from error
    if not isinstance(found, dict) or found.get("kind") != KIND:
        raise FormatError(path, "kind", f"no {KIND}", "Give a folder that `etendue patches` made.")
    if found.get("version") != VERSION:
        known = f"this program reads version {VERSION}"
        raise FormatError(path, "version", f"{found.get('version')!r:.20}; {known}", REWRITE)
    rows = found.pop("patches", None)
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise FormatError(path, "patches", "no list of patches", REWRITE)
    head = PatchFolder(path, found, tuple(rows), ())
    return dataclasses.replace(head, tables=tuple(_table(head, i) for i in range(len(rows))))


def _table(head: PatchFolder, i: int) -> npt.NDArray[np.float64]:
    """The table of a patch, at the nodes of its grid."""
    name = head.of(i, "file", str)
    folder = head.path.parent
    if not (folder / name).resolve().is_relative_to(folder.resolve()):
        raise FormatError(head.path, f"patches[{i}].file", f"{name!r:.60} is outside of the folder", REWRITE)
    steps = head.of(i, "theta_step", int), head.of(i, "phi_step", int)
    if not all(step > 0 and whole % step == 0 for step, whole in zip(steps, (90, 360), strict=True)):
        raise FormatError(head.path, f"patches[{i}]", f"steps of {steps[0]}° and {steps[1]}°", REWRITE)
    grid = AngularGrid(*steps)
    try:
        table = read_intensity(folder / name)
    except OSError as error:
        raise FormatError(folder / name, "file", error.strerror or str(error), REWRITE) from error
    except ArgumentError as error:  # a folder, or a pipe
        raise FormatError(folder / name, "file", str(error), REWRITE) from error
    values = np.asarray(table.values, dtype=np.float64).T
    if values.shape == (grid.shape[0], grid.shape[1] + 1):  # C = 360° beside 0°
        values = values[:, :-1]
    rows = min(len(values), grid.shape[0])
    fits = values.shape[1] == grid.shape[1] and np.allclose(table.gamma[:rows], grid.theta[:rows], atol=1e-6)
    if not fits or rows < grid.shape[0]:
        found = f"{len(table.c)} planes C and {len(table.gamma)} angles γ"
        raise FormatError(folder / name, "angles", f"{found} instead of {grid.shape[1]} and {grid.shape[0]}", REWRITE)
    return np.ascontiguousarray(values[:rows])


def _manifest(head: Mapping[str, Any], rows: Iterable[Mapping[str, Any]]) -> str:
    """JSON with one line for each patch, for people who look into it."""
    text = json.dumps(head, ensure_ascii=False, indent=1, allow_nan=False).removesuffix("\n}")
    lines = ",\n  ".join(json.dumps(row, allow_nan=False) for row in rows)
    return f'{text},\n "patches": [\n  {lines}\n ]\n}}\n'


def _rows(patches: Patches, format: str) -> Iterator[dict[str, Any]]:
    """What the manifest says of each patch."""
    table_flux = patches.table_flux
    for i in range(len(patches)):
        x, y, z = patches.axes[i].tolist()
        yield {
            "file": f"lids/{i + 1:06d}.{format}",
            "part": patches.parts[patches.part[i]],
            "shape": patches.shape(i),
            "pixel": int(patches.pixel[i]),
            "centre": patches.centre[i].tolist(),
            "x": x,
            "y": y,
            "z": z,
            "extent": patches.extent[i].tolist(),
            "area": float(patches.area[i]),
            "projected_area": float(patches.projected_area[i]),
            "flux": float(patches.flux[i]),
            "table_flux": float(table_flux[i]),
            **dataclasses.asdict(patches.grid(i)),
            "error": float(patches.error[i]),
            "outline": patches.outline[i].tolist(),
        }


def _write_table(path: Path, rows: list[dict[str, Any]]) -> None:
    """The manifest without the outlines, one patch per line; vectors as three columns."""
    flat = [dict(_columns(row)) for row in rows]
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, list(flat[0]))
        table.writeheader()
        table.writerows(flat)


def _columns(row: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in row.items():
        if name == "outline":
            continue
        if isinstance(value, list):
            yield from ((f"{name}_{axis}", part) for axis, part in zip("xyz", value, strict=False))
        else:
            yield name, value
