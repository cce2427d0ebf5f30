"""Maps of stored scatter events: each is connected to the eye, past what stands in the scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.luminance.caustics import Forward
from etendue.luminance.methods import PathTracing
from etendue.luminance.scene_map import look_at_scene
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_stream import Progress, checked_threads
from etendue.scene.scatter_events import EVENT, RAY, ScatterEvents
from etendue.units import MM2_PER_M2

STRETCH = 1 << 21
"""Events that are looked at in one go: a quarter of a gigabyte."""


def look_at_events(
    events: ScatterEvents,
    pairs: Sequence[tuple[Observer, Screen]],
    how: PathTracing | None = None,
    progress: Progress | None = None,
    *,
    cache: bool = True,
    threads: int | None = None,
) -> list[LuminanceMap]:
    """The maps of scatter events for observers with their screens; see `luminance_map`.

    `how`: with what lines of sight find besides; None: without.

    Raises
    ------
    ArgumentError
        If the events have no scene or another one, a screen has no apparent area, or all light is wanted of the scatters
        of some surfaces only.
    SceneError
        If files that the scene names are missing.
    """
    threads = checked_threads(threads)
    views = [screen.core_view(observer) for observer, screen in pairs]
    if how is not None and events.surfaces:
        raise ArgumentError(
            f"the scatter events of {events.name!r} are those of {', '.join(events.surfaces)} only, and lines of sight "
            "would pass over all scattered light: keep those of all surfaces, or leave rays_per_pixel out."
        )
    core, seen, done = events.core, [], 0
    for view in views:
        width = events.dealing.strata, view["columns"] * view["rows"]
        sums = np.zeros(width), np.zeros(width), np.zeros(width, np.uint64), np.zeros(width)
        for stratum, words, brought in _stretches(events):
            try:
                found = _core.look_at_events(core, words, brought, view, threads)
            except ValueError as error:
                raise ArgumentError(f"the scatter events of {events.name!r}: {error}.") from error
            for total, part in zip(sums, found, strict=True):
                total[stratum] += part
            done += len(words)
            if progress is not None and how is None:
                progress(done)
        shape = (view["rows"], view["columns"])
        note = f"{len(events):,} scatter events of {events.rays:,} rays, for light that comes from diffuse surfaces directly"
        seen.append(Forward.of(sums, events.emitted, shape, events.dealing, events.rays, events.scale, note))
    if how is not None and events.scene is not None:
        maps = look_at_scene(events.scene, pairs, how, progress, seen, cache=cache, threads=threads)
        return [lmap.replace(notes=(*lmap.notes, *events.notes)) for lmap in maps]
    return [_map(events, image, *pair) for image, pair in zip(seen, pairs, strict=True)]


def _map(events: ScatterEvents, image: Forward, observer: Observer, screen: Screen) -> LuminanceMap:
    notes = [
        image.note,
        "sources, and what is seen in mirrors and through lenses, are left out; rays_per_pixel adds them",
    ]
    lit = image.rays > 0
    if not lit.all():
        dark = int((~lit).sum())
        notes.append(f"{dark:,} of {lit.size:,} pixels saw no scatter: their luminance is 0, its error unknown")
    return LuminanceMap(
        image.values * MM2_PER_M2,
        np.where(lit, image.error, np.nan) * MM2_PER_M2,
        image.rays,
        observer,
        screen,
        events.flux_unit,
        events.provenance.then("luminance by scatter events"),
        (*notes, *events.notes),
    )


def _stretches(events: ScatterEvents) -> Iterator[tuple[int, npt.NDArray[np.uint64], npt.NDArray[np.float64]]]:
    """The events as words, some at a time, with their stratum, and the flux of the ray of each, its copies included.

    Those of a ray and of all its copies stay together.
    """
    rows, dealing = events.rows, events.dealing
    ray = rows["ray"] & RAY
    if dealing.strata == 1:
        yield from ((0, _words(rows[part]), rows["flux"][part].copy()) for part in _cuts(ray))
        return
    unit, stratum, share = dealing.core.units(ray)
    order = np.argsort(unit, kind="stable")
    for number in range(dealing.strata):
        own = order[stratum[order] == number]
        for part in _cuts(unit[own]):
            chosen = rows[own[part]]
            # To the core, copies of a ray are that ray.
            chosen["ray"] = unit[own[part]]
            yield number, _words(chosen), chosen["flux"] * share[own[part]]


def _cuts(keys: npt.NDArray[np.uint64]) -> Iterator[slice]:
    """Some ascending keys at a time; equal ones stay together."""
    start = 0
    while start < len(keys):
        last = min(start + STRETCH, len(keys)) - 1
        end = int(np.searchsorted(keys, keys[last], side="right"))
        yield slice(start, end)
        start = end


def _words(rows: npt.NDArray[np.void]) -> npt.NDArray[np.uint64]:
    return rows.view("<u8").reshape(-1, EVENT.itemsize // 8)
