"""Fits that are kept: a light field that was asked for before is not fitted again.

A fit hangs on nothing but the rays, the surface and options asked for, and the program. A digest of these is the name under
which the field is kept, in memory and as a file in the user's cache folder; so a changed ray file or another version of the
program is another name. A field that is kept is rounded as `LightField.save` rounds it, and so is one that is not found
and fitted: the bits do not tell which it was.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import os
import re
import threading
from collections import OrderedDict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Literal

import platformdirs

from etendue import _core
from etendue.errors import FormatError
from etendue.lightfield.carrier import Surface
from etendue.lightfield.fitting import notes_of_rays
from etendue.lightfield.light_field import LightField
from etendue.lightfield.storage import as_stored, save_field
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayStream, checked_threads

FOLDER_VARIABLE = "ETENDUE_CACHE_DIR"
"""Environment variable that names another folder; empty: nothing is kept."""

MOST_BYTES = 1 << 30
"""Size that the folder may have: beyond it those fields go that were not asked for the longest."""

MOST_IN_MEMORY = 4
"""Fields kept in memory."""

PIECE = 1 << 18
"""Rays that are digested in one piece."""

KEPT_NAME = re.compile(r"[0-9a-f]{40}\.h5")
"""Names of the files that are kept, which no others have: what else lies in the folder is neither counted nor removed."""

_memory: OrderedDict[str, LightField] = OrderedDict()
_lock = threading.Lock()


@dataclasses.dataclass(frozen=True)
class CacheContent:
    """What is kept on disk.

    Parameters
    ----------
    folder : Path or None
        None: nothing is kept.
    fields : int
    size : int
        [bytes]

    Examples
    --------
    >>> CacheContent(None, 0, 0).folder is None
    True
    """

    folder: Path | None
    fields: int
    size: int


def fit_or_recall(
    rays: RayStream,
    surface: Surface | Literal["auto"] = "auto",
    *,
    seed: int = 1,
    cache: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
) -> LightField:
    """The light field of rays as `LightField.fit` finds it and `LightField.save` keeps it; from the cache if it is there.

    Parameters
    ----------
    rays, surface, seed, threads, progress
        As of `LightField.fit`.
    cache : bool
        Whether the cache is looked into, and the field kept there.

    Raises
    ------
    ArgumentError
        As `LightField.fit`. A cache folder that cannot be read or written is done without.

    Examples
    --------
    >>> import etendue as et
    >>> field = fit_or_recall(et.RingSource(rays=1000), et.Disk(radius=30))
    >>> round(field.total_flux)
    600
    """
    if not cache or _folder() is None:
        return as_stored(LightField.fit(rays, surface, seed=seed, threads=threads, progress=progress))
    name = _name(rays, surface, seed, threads)
    field, told = _recall(name), notes_of_rays(rays)
    if field is None:
        field = as_stored(LightField.fit(rays, surface, seed=seed, threads=threads, progress=progress))
        field = field.replace(notes=field.notes[: len(field.notes) - len(told)])
        _keep_on_disk(name, field)
    with _lock:
        _memory[name] = field
        _memory.move_to_end(name)
        while len(_memory) > MOST_IN_MEMORY:
            _memory.popitem(last=False)
    # The same rays may come from another file, or by other steps; and the field's name says nothing of their colours and
    # notes.
    return field.replace(
        notes=(*field.notes, *told),
        provenance=rays.provenance.then(f"light field on {field.surface.spec}"),
        spectrum=rays.total_spectrum(threads=threads),
    )


def cache_content() -> CacheContent:
    """The cache folder, and what it holds.

    Examples
    --------
    >>> import etendue as et
    >>> et.cache_content().size >= 0
    True
    """
    folder = _folder()
    files = [] if folder is None else list(_files(folder))
    return CacheContent(folder, len(files), sum(size for _, size, _ in files))


def clear_cache() -> CacheContent:
    """Forget all fields that are kept, in memory and on disk; returns what was there.

    Files of other names in the folder stay.

    Raises
    ------
    OSError
        If the system does not let a file be removed; names it.

    Examples
    --------
    >>> import etendue as et
    >>> os.environ["ETENDUE_CACHE_DIR"] = ""                    # nothing is kept, so that nothing can go
    >>> et.clear_cache().fields
    0
    """
    held = cache_content()
    with _lock:
        _memory.clear()
    if held.folder is not None:
        for _, _, path in _files(held.folder):
            path.unlink(missing_ok=True)
    return held


def _folder() -> Path | None:
    named = os.environ.get(FOLDER_VARIABLE)
    if named is not None:
        return Path(named) if named else None
    return Path(platformdirs.user_cache_dir("etendue", appauthor=False)) / "light-fields"


def _files(folder: Path) -> Iterator[tuple[int, int, Path]]:
    """When each file was asked for last [ns], its size and its place."""
    for path in folder.glob("*.h5"):
        if not KEPT_NAME.fullmatch(path.name):
            continue
        # Another process may clear it at any moment.
        with contextlib.suppress(OSError):
            facts = path.stat()
            yield facts.st_mtime_ns, facts.st_size, path


def _recall(name: str) -> LightField | None:
    """The field of that name from memory or disk, if it is there and whole."""
    with _lock:
        if name in _memory:
            return _memory[name]
    folder = _folder()
    if folder is None:
        return None
    path = folder / f"{name}.h5"
    # One that is damaged is fitted and written anew.
    try:
        field = LightField.load(path)
        os.utime(path)
    except (OSError, FormatError):
        return None
    return field


def _keep_on_disk(name: str, field: LightField) -> None:
    """Write the field, and make room by what was not asked for the longest."""
    folder = _folder()
    if folder is None:
        return
    # Without a folder that takes it, it is fitted again next time.
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        save_field(field, folder / f"{name}.h5")
        files = sorted(_files(folder), reverse=True)
        size = 0
        for _, bytes_, path in files:
            size += bytes_
            if size > MOST_BYTES:
                path.unlink(missing_ok=True)


def _name(rays: RayStream, surface: Surface | Literal["auto"], seed: int, threads: int | None) -> str:
    """A digest of everything that a fit hangs on."""
    digest = hashlib.blake2b(digest_size=20)
    meaning: tuple[Any, ...] = (len(rays), rays.flux_unit, float(rays.total_flux))
    if isinstance(rays, RaySet):
        meaning += (rays.meaning.single_wavelength, [(s.wavelength.tolist(), s.weight.tolist()) for s in rays.spectra])
    options = surface if isinstance(surface, str) else repr(surface)
    digest.update(repr((_program(), meaning, options, seed)).encode())
    source = rays.core_source()

    def piece(start: int) -> bytes:
        part = hashlib.blake2b(digest_size=20)
        for array in _core.read_rays(source, start, min(start + PIECE, len(rays))):
            part.update(array.data)
        return part.digest()

    with ThreadPoolExecutor(checked_threads(threads) or os.cpu_count()) as pool:
        for part in pool.map(piece, range(0, len(rays), PIECE)):
            digest.update(part)
    return digest.hexdigest()


@functools.cache
def _program() -> str:
    """A digest of the program that fits: of the core and of this package's files."""
    digest = hashlib.blake2b(digest_size=20)
    files = [Path(_core.__file__), *sorted(Path(__file__).parent.rglob("*.py"))]
    for path in files:
        digest.update(path.name.encode() + hashlib.blake2b(path.read_bytes()).digest())
    return digest.hexdigest()
