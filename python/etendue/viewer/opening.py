"""From what can be looked at to what the page shows: light fields and maps as they are, rays and scenes by a light field."""

from __future__ import annotations

import dataclasses
import os
from typing import Any

import numpy as np

from etendue.errors import ArgumentError, UnknownNameError
from etendue.formats.input import as_path
from etendue.formats.maps import is_map_file, read_any_map
from etendue.formats.patch_folder import is_patch_folder
from etendue.lightfield.fit_cache import fit_or_recall
from etendue.lightfield.light_field import LightField
from etendue.luminance.framing import light_of_sources
from etendue.luminance.opening import open_source
from etendue.quantities.pixel_map import PixelMap
from etendue.quantities.ray_stream import Progress, RayStream
from etendue.scene import Scene
from etendue.scene.compiling import compile_scene
from etendue.scene.framing import corners_of
from etendue.tracing import TraceResult, trace
from etendue.tracing.storage import is_result_file
from etendue.viewer.geometry import scene_geometry
from etendue.viewer.subjects import field_subject, map_subject

Viewable = LightField | RayStream | PixelMap | TraceResult | Scene

SCENE_RAYS = 2_000_000
"""Rays that a scene is traced with for the light field around it, if nothing else is said."""

AROUND = 1.01
"""Radius of the sphere on which the light of a scene is collected, in radii of the ball about all that has an end."""

TRACED = 0.25
"""Of the work on a scene: the rest is the fit, whose search for a surface takes longer than the trace of most scenes."""

COLLECTOR = "all light that leaves"
"""Name of the detector that is put around a scene."""


@dataclasses.dataclass(frozen=True, eq=False)
class Exhibit:
    """What a page shows, and what the program behind it works out maps from.

    Parameters
    ----------
    subject : dict
        Plain data for the page.
    source : LightField or PixelMap
    scene : Scene or None
        Whose light the field is of, where lines of sight can be followed as well.
    """

    subject: dict[str, Any]
    source: LightField | PixelMap
    scene: Scene | None = None


def open_viewable(path: str | os.PathLike[str], detector: str | None = None) -> Viewable:
    """What a file holds that can be looked at.

    Parameters
    ----------
    path : path
        A light field, rays, an index of rays, a map, the result of a trace, or a scene (``.toml``).
    detector : str, optional
        Of the result of a trace: whose picture or rays.

    Raises
    ------
    ArgumentError
        If a detector is named and the file is no result of a trace.
    FormatError, SceneError, OSError
        If the file cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import etendue as et
    >>> with TemporaryDirectory() as folder:
    ...     et.Scene(name="nothing").save(Path(folder) / "nothing.toml")
    ...     open_viewable(Path(folder) / "nothing.toml").name
    'nothing'
    """
    path = as_path(path)
    if is_patch_folder(path):
        return open_source(path)
    if is_result_file(path):
        return of_detector(TraceResult.load(path), detector)
    if detector is not None:
        raise ArgumentError(f"detector {detector!r}: for results of traces; {path} is none.")
    return read_any_map(path) if is_map_file(path) else open_source(path)


def of_detector(result: TraceResult, detector: str | None) -> PixelMap | RayStream:
    """What a detector of a trace saw, if it is a picture or rays.

    Raises
    ------
    UnknownNameError
        If there is no such detector.
    ArgumentError
        If none is named, and there is none or more than one.

    Examples
    --------
    >>> import etendue as et
    >>> desk = {"name": "desk", "kind": "illuminance", "width": 10, "height": 10, "columns": 1, "rows": 1,
    ...         "at": [0, 0, -1000], "toward": [0, 0, 1]}
    >>> lamp = et.Scene(sources=[{"kind": "point", "flux": 1}], detectors=[desk])
    >>> of_detector(et.trace(lamp, rays=1000), None).unit
    'lx'
    """
    found: dict[str, PixelMap | RayStream] = {**result.images, **result.illuminance, **result.rays}
    if detector is not None and detector not in found:
        raise UnknownNameError("detector with a map or rays", detector, found)
    if detector is None and len(found) != 1:
        have = f"{len(found)} detectors ({', '.join(found)}); name one" if found else "no detector with a map or rays"
        raise ArgumentError(f"the trace has {have}: a page shows what one detector saw.")
    return found[detector] if detector is not None else next(iter(found.values()))


def exhibit_of(
    viewable: Viewable,
    *,
    name: str,
    file: str | None = None,
    options: str = "",
    detector: str | None = None,
    rays: float | None = None,
    seed: int = 1,
    cache: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Exhibit:
    """What the page shows of a value.

    Parameters
    ----------
    viewable : LightField, RayStream, PixelMap, TraceResult or Scene
        Rays are fitted first; so are the rays that leave a scene, on a surface about it.
    name : str
        Title of the page.
    file : str, optional
        As commands name it; the name if not given.
    options : str
        With which the file was opened, as commands spell them: the page's command has them, too.
    detector : str, optional
        Of the result of a trace.
    rays : float, optional
        That a scene is traced with: 2·10⁶ if not given.
    seed : int
        Of that trace.
    cache : bool
        Whether fits are taken from those made before.
    threads, progress
        As of `etendue.LightField.fit` and `etendue.trace`.

    Raises
    ------
    ArgumentError
        If there is no light to be seen, or options and value do not go together.

    Examples
    --------
    >>> import etendue as et
    >>> desk = et.IlluminanceMap([[500.0]], [[5.0]], [[900]], et.Screen(20, 10, 1, 1, "xy"))
    >>> exhibit_of(desk, name="desk").subject["unit"]
    'lx'
    """
    if not isinstance(viewable, Scene) and rays is not None:
        raise ArgumentError("rays: for scenes, which are traced; this is none.")
    if isinstance(viewable, TraceResult):
        viewable = of_detector(viewable, detector)
    elif detector is not None:
        raise ArgumentError(f"detector {detector!r}: for results of traces; this is none.")
    file, options = file or name, f"{options} " if options else ""
    if isinstance(viewable, PixelMap):
        return Exhibit(map_subject(viewable, name, file), viewable)
    if isinstance(viewable, LightField):
        return Exhibit(field_subject(viewable, name, file, options), viewable)
    if isinstance(viewable, Scene):
        whole = rays or SCENE_RAYS
        light = light_of(viewable, whole, seed, threads, _part_of(progress, 0.0, TRACED, whole))
        fitting = _part_of(progress, TRACED * whole, (1.0 - TRACED) * whole / len(light), whole)
        field = fit_or_recall(light, cache=cache, threads=threads, progress=fitting)
        return Exhibit({**field_subject(field, name, file, options), **_scene_subject(viewable, seed)}, field, viewable)
    field = fit_or_recall(viewable, cache=cache, threads=threads, progress=progress)
    # Of rays that are indexed, maps are made by the cone if nothing is said.
    return Exhibit(field_subject(field, name, file, f"--method lightfield {options}"), field)


def _part_of(progress: Progress | None, before: float, each: float, whole: float) -> Progress | None:
    """The progress of a part of the work, of which each ray counts as so much of one."""
    return None if progress is None else lambda done: progress(min(round(before + each * done), int(whole)))


def _scene_subject(scene: Scene, seed: int) -> dict[str, Any]:
    """What a page shows of a scene besides its light."""
    geometry = scene_geometry(scene, seed=seed)
    return {} if geometry is None else {"geometry": geometry}


def light_of(
    scene: Scene, rays: float, seed: int = 1, threads: int | None = None, progress: Progress | None = None
) -> RayStream:
    """The rays that leave a scene, where they cross a sphere about all that has an end.

    Raises
    ------
    ArgumentError
        If nothing in the scene has an end, all of it is one point, or no light leaves it.

    Examples
    --------
    >>> import etendue as et
    >>> lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}
    >>> len(light_of(et.Scene(sources=[lamp]), 1000))
    1000
    """
    compiled = compile_scene(scene)
    corners = corners_of(compiled)
    if len(corners) == 0 and (measured := light_of_sources(scene, compiled)) is not None:
        corners = measured.position
    if len(corners) == 0:
        raise ArgumentError(
            f"{scene.name or 'the scene'}: nothing in it has an end, so that nothing can be put around it."
        )
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    radius = AROUND * float(np.linalg.norm(corners - middle, axis=1).max())
    if radius == 0.0:
        raise ArgumentError(f"{scene.name or 'the scene'}: all its light comes from one point, which has no luminance.")
    # From the inside alone: what comes from outside is not the luminaire's.
    around = {
        "name": COLLECTOR,
        "kind": "rays",
        "shape": {"kind": "sphere", "radius": radius},
        "at": middle.tolist(),
    }
    result = trace(scene.replace(detectors=[around]), rays, seed, threads=threads, progress=progress)
    found = result.rays[COLLECTOR]
    if not found.total_flux > 0.0:
        raise ArgumentError(f"{scene.name or 'the scene'}: none of {result.rays_done:,} rays leaves it.")
    return found
