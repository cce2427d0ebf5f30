"""A gridded source from its folder: the pixels cut again, and the tables put on them."""

from __future__ import annotations

import dataclasses
import os
from typing import Any

import numpy as np

from etendue.errors import EtendueError, FormatError
from etendue.formats.patch_folder import REWRITE, PatchFolder, read_patch_folder
from etendue.lightfield.carrier import parse_surface
from etendue.lightfield.gridded.fitting import Account
from etendue.lightfield.gridded.pixelated import PixelatedSurface
from etendue.quantities.patches import Patches
from etendue.quantities.provenance import Provenance

ROUNDED = 1e-9
"""Share of a pixel's size within which its centre is that of the manifest, which has all digits."""


def read_gridded(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """What `GriddedSource` is made of, from a folder of patches.

    Raises
    ------
    FormatError
        As of `GriddedSource.load`.

    Examples
    --------
    >>> import tempfile
    >>> import etendue as et
    >>> from pathlib import Path
    >>> source = et.GriddedSource.fit(et.RingSource(rays=5000), et.Plane(z=0), 20.0, 2.1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     source.save_patches(Path(folder) / "rings")
    ...     len(read_gridded(Path(folder) / "rings")["patches"]) == len(source.patches)
    True
    """
    found = read_patch_folder(folder)
    pixel, threshold = (float(found.of(None, key, (int, float))) for key in ("pixel", "threshold"))
    surface = _surface(found, pixel)
    rows = range(len(found.rows))
    numbers = np.array([found.of(i, "pixel", int) for i in rows], dtype=np.int64)
    if numbers[0] < 0 or numbers[-1] >= surface.count or not (np.diff(numbers) > 0).all():
        raise FormatError(found.path, "patches", f"pixels that do not rise from 0 to {surface.count - 1:,}", REWRITE)
    cells = surface.cells(numbers)
    _check_centres(found, cells.centre, cells.area)
    start = np.concatenate([[0], np.cumsum([table.size for table in found.tables])])
    flux_unit = found.of(None, "flux_unit", str)
    if flux_unit not in ("lm", "W"):
        raise FormatError(found.path, "flux_unit", repr(flux_unit)[:20], REWRITE)
    patches = Patches(
        shapes=tuple(pixels.SHAPE for pixels in surface.pixels),
        parts=tuple(pixels.part.name for pixels in surface.pixels),
        part=surface.part_of(numbers),
        pixel=numbers,
        **{field.name: getattr(cells, field.name) for field in dataclasses.fields(cells)},
        flux=np.array([float(found.of(i, "flux", (int, float))) for i in rows]),
        theta_step=np.array([found.rows[i]["theta_step"] for i in rows]),
        phi_step=np.array([found.rows[i]["phi_step"] for i in rows]),
        error=np.array([float(found.of(i, "error", (int, float))) for i in rows]),
        start=start,
        values=np.concatenate([table.ravel() for table in found.tables]),
        flux_unit=flux_unit,
        provenance=Provenance(str(found.path.parent), "etendue patches"),
    )
    if not (patches.flux > 0.0).all() or not patches.table_flux.sum() > 0.0:
        raise FormatError(found.path, "flux", "a patch without light", REWRITE)
    own = {"surface": surface, "patches": patches, "pixel": pixel, "threshold": threshold}
    return {**own, "account": _account(found), **_stated_flux(found, patches)}


def _surface(found: PatchFolder, pixel: float) -> PixelatedSurface:
    origin, parallels = found.facts.get("origin"), found.facts.get("parallels")
    is_point = isinstance(origin, list) and len(origin) == 3 and all(isinstance(v, int | float) for v in origin)
    if not (origin is None or is_point):
        raise FormatError(found.path, "origin", f"{origin!r:.60}", REWRITE)
    if not (parallels is None or isinstance(parallels, int)):
        raise FormatError(found.path, "parallels", f"{parallels!r:.60}", REWRITE)
    try:
        return PixelatedSurface.cut(
            parse_surface(found.of(None, "surface", str)),
            pixel,
            parallels,
            centre_on=found.of(None, "centre_on", str),
            origin=None if origin is None else (float(origin[0]), float(origin[1]), float(origin[2])),
        )
    except FormatError:
        raise
    except EtendueError as error:
        raise FormatError(found.path, "surface", str(error), REWRITE) from error


def _check_centres(found: PatchFolder, centre: Any, area: Any) -> None:
    """Refuse pixels that lie elsewhere than the manifest says."""
    for i, row in enumerate(found.rows):
        stated = row.get("centre")
        off = np.inf
        if isinstance(stated, list) and len(stated) == 3 and all(isinstance(v, int | float) for v in stated):
            off = float(np.abs(np.subtract(stated, centre[i])).max())
        if not off <= ROUNDED * np.sqrt(area[i]) + 1e-12 * float(np.abs(centre[i]).max()):
            raise FormatError(
                found.path, f"patches[{i}].centre", f"{stated!r:.80}, but its pixel is at {centre[i].tolist()}", REWRITE
            )


def _account(found: PatchFolder) -> Account:
    stated = found.of(None, "account", dict)
    names = {field.name for field in dataclasses.fields(Account)}
    if set(stated) != names or not all(isinstance(v, int | float) for v in stated.values()):
        raise FormatError(found.path, "account", f"{sorted(stated)!r:.80}", REWRITE)
    return Account(**stated)


def _stated_flux(found: PatchFolder, patches: Patches) -> dict[str, float]:
    """The flux that overrides that of the rays, if one was stated when the folder was written."""
    factor, flux = (float(found.of(None, key, (int, float))) for key in ("factor", "table_flux"))
    emitted, own = factor * flux, float(patches.flux.sum())
    if not emitted > 0.0:
        raise FormatError(found.path, "factor", f"{factor:g}", REWRITE)
    return {} if abs(emitted - own) <= 1e-9 * own else {"stated_flux": emitted}
