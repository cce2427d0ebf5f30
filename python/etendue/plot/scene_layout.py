"""What a drawing of a scene shows: sections with the curves of all that they cut, and how far everything reaches."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.plot.scene_parts import Glow, Part, View, finish_kind, within
from etendue.quantities.arguments import SCENE, as_numbers, as_whole, require
from etendue.scene import MEDIA, Compiled, Medium, Scene, compile_scene
from etendue.scene.extents import box_of
from etendue.tracing.section import Section
from etendue.tracing.section_chains import rings
from etendue.tracing.sections import Window, cut_faces
from etendue.tracing.trails import (
    CANDIDATES,
    MOST_TRACED,
    MOST_TRAILS,
    near_section,
    sample_source,
    trace_trails,
)

Array = npt.NDArray[np.float64]
Record = dict[str, Any]

DEFAULT_SECTIONS = ("y=0", "x=0")
MOST_SECTIONS = 3
MARGIN = 0.12
"""Of a frame around what is in it, as a share of the larger side; light that leaves is seen there."""
NARROWEST = 0.3
"""Smaller side of a frame, as a share of the larger one."""
FARTHEST = 2.5
"""A detector, or a plane without an end, that would make the frame larger than this many times is left out."""
SAMPLE = 240
"""Rays by which a source shows where and how it sends out light."""
MOST_SAMPLED = 64
"""Sources that are sampled; of more, every so manieth."""
FAR = 1e3
"""Times the size of it all: how far rays are followed that leave the scene, or go on to a plane without an end."""
JOINED = 1e-6
"""Of a solid's size: how far apart the ends of its faces may lie that meet."""


@dataclasses.dataclass(frozen=True, eq=False)
class SceneLayout:
    """What a drawing of a scene shows.

    Parameters
    ----------
    scene : Scene
    compiled : Compiled
    views : tuple of View
    bounds : array, shape (2, 3)
        Lowest and highest x, y, z of the boxes of all solids and surfaces that have an end, and of the sources [mm], those
        without a shape as far as 240 of their rays show them; half spaces that trim them do not count. NaN if there are
        none.
    media : dict
        By number of the medium: name and refractive index.
    wavelength : float
        Of these indices [nm].
    uncut : tuple of str
        Solids and surfaces that no section cuts.
    beyond : tuple of str
        Detectors outside of the frames.
    rays, seed : int
    """

    scene: Scene
    compiled: Compiled
    views: tuple[View, ...]
    bounds: Array
    media: dict[int, tuple[str, float]]
    wavelength: float
    uncut: tuple[str, ...]
    beyond: tuple[str, ...]
    rays: int
    seed: int

    def to_dict(self) -> dict[str, Any]:
        """Bounds and names, as plain data [mm]."""
        low, high = self.bounds.tolist()
        return {
            "scene": self.scene.name,
            "bounds": {axis: [low[i], high[i]] for i, axis in enumerate("xyz")},
            "sections": [
                {
                    "plane": f"{view.section.axis}={view.section.at:g}",
                    "across": view.section.across,
                    "up": view.section.up,
                    "window": list(view.window),
                    "faces": list(dict.fromkeys(face.name for face in view.faces)),
                    "rays": len(view.trails),
                }
                for view in self.views
            ],
            "solids": list(self.compiled.solid_names),
            "surfaces": [name for name, _ in _surfaces(self.compiled)],
            "sources": [s.name or f"sources[{i}]" for i, s in enumerate(self.scene.sources)],
            "detectors": list(self.compiled.detector_names),
            "observers": [o.name or f"observers[{i}]" for i, o in enumerate(self.scene.observers)],
            "media": dict(self.media.values()),
            "wavelength": self.wavelength,
            "not_cut": list(self.uncut),
            "beyond": list(self.beyond),
            "notes": list(self.compiled.notes),
        }


def lay_out_scene(
    scene: Scene,
    section: str | Sequence[str] = DEFAULT_SECTIONS,
    *,
    rays: int = 30,
    seed: int = 1,
    window: Sequence[float] | None = None,
) -> SceneLayout:
    """Cut a scene, and trace a few rays through it; `draw_scene` makes a picture of it.

    Parameters
    ----------
    scene, section, rays, seed, window
        As of `etendue.draw_scene`.

    Raises
    ------
    SceneError, ArgumentError
        As `etendue.draw_scene`.

    Examples
    --------
    >>> ball = {"name": "ball", "shape": {"kind": "ball", "radius": 2}, "medium": "PMMA"}
    >>> layout = lay_out_scene(Scene(solids=[ball]), "y=1")
    >>> layout.bounds[1].tolist(), layout.views[0].faces[0].name
    ([2.0, 2.0, 2.0], 'ball.surface')
    """
    require(scene, Scene, "draw_scene: scene", SCENE)
    require(section, Sequence, "draw_scene: section", "planes such as 'y=0', or ('y=0', 'x=0')")
    planes = [Section.parse(text) for text in ([section] if isinstance(section, str) else section)]
    if not 1 <= len(planes) <= MOST_SECTIONS:
        raise ArgumentError(f"draw_scene: {len(planes)} sections; give 1 to {MOST_SECTIONS}.")
    rays = as_whole(rays, "draw_scene: rays", 0, MOST_TRAILS)
    if isinstance(seed, bool) or not (isinstance(seed, int) and 0 <= seed < 1 << 64):
        raise ArgumentError(f"draw_scene: seed is {seed!r}; give a whole number from 0 to 2⁶⁴ − 1.")
    frame = None if window is None else _checked(window)
    return _Draughtsman(scene, planes, rays, seed, frame).layout()


def _checked(window: Sequence[float]) -> Window:
    edges = as_numbers(window, "draw_scene: window", "left, right, bottom, top in mm").ravel().tolist()
    left, right, bottom, top = edges if len(edges) == 4 else (0.0,) * 4
    if not (np.isfinite([left, right, bottom, top]).all() and left < right and bottom < top):
        raise ArgumentError(
            f"draw_scene: window is {edges}; give left, right, bottom, top in mm with left < right and bottom < top."
        )
    return float(left), float(right), float(bottom), float(top)


class _Draughtsman:
    """The views of a scene under construction."""

    def __init__(self, scene: Scene, planes: list[Section], rays: int, seed: int, window: Window | None) -> None:
        self.scene, self.planes, self.rays, self.seed, self.window = scene, planes, rays, seed, window
        self.compiled = compile_scene(scene)
        self.record = self.compiled.record
        step = -(-len(self.record["sources"]) // MOST_SAMPLED) or 1
        self.sources = [
            (name, source, *sample_source(self.compiled, source, SAMPLE, seed))
            for name, source in list(zip(self.compiled.source_names, self.record["sources"], strict=True))[::step]
        ]
        self.seen = np.array([[np.inf] * 3, [-np.inf] * 3])

    def layout(self) -> SceneLayout:
        faces = self.record["faces"]
        endless = [not np.isfinite(box_of(face["shape"])).all() for face in faces]
        curves = [
            self._cut([f if not e else None for f, e in zip(faces, endless, strict=True)], p) for p in self.planes
        ]
        glows = [self._glows(plane) for plane in self.planes]
        for plane, cut, glow in zip(self.planes, curves, glows, strict=True):
            self._reach(plane, [c for found in cut for c in found])
            self._reach(plane, [c for g in glow for c in [*g.curves, g.start]])
        shown = self._near_detectors()
        without_end = [face if e else None for face, e in zip(faces, endless, strict=True)]
        for plane, window in zip(self.planes, self._windows(FARTHEST), strict=True):
            for found in self._cut(without_end, plane, window):
                self._reach(plane, [self._nearest(plane, found)] if found else [])
        windows = self._windows()
        for i, (plane, window) in enumerate(zip(self.planes, windows, strict=True)):
            curves[i] = [a + b for a, b in zip(curves[i], self._cut(without_end, plane, window), strict=True)]
        trails = self._trails(windows)
        views = tuple(
            View(
                plane,
                window,
                within(self._faces(cut), window),
                within(self._solids(cut), window),
                glow,
                within(self._detectors(shown, plane), window),
                trail,
            )
            for plane, window, cut, glow, trail in zip(self.planes, windows, curves, glows, trails, strict=True)
        )
        seen = {part.name for view in views for part in view.detectors}
        placed = [i for i, detector in enumerate(self.record["detectors"]) if "frame" in detector]
        beyond = tuple(self.compiled.detector_names[i] for i in placed if self.compiled.detector_names[i] not in seen)
        media, wavelength = self._media()
        return SceneLayout(
            self.scene,
            self.compiled,
            views,
            self._extent(),
            media,
            wavelength,
            self._uncut(curves),
            beyond,
            self.rays,
            self.seed,
        )

    # --- what is cut ---------------------------------------------------------------------------------------------------

    def _cut(self, faces: list[Record | None], plane: Section, window: Window | None = None) -> list[list[Array]]:
        """Curves of each face; none of those that are left out."""
        found = iter(cut_faces([face for face in faces if face is not None], plane, window))
        return [[] if face is None else next(found) for face in faces]

    def _reach(self, plane: Section, curves: list[Array]) -> None:
        """Stretch the bounds over curves."""
        for curve in curves:
            if len(curve):
                for i, axis in enumerate((plane.across, plane.up)):
                    k = "xyz".index(axis)
                    self.seen[0, k] = min(self.seen[0, k], curve[:, i].min())
                    self.seen[1, k] = max(self.seen[1, k], curve[:, i].max())

    def _extent(self) -> Array:
        """Of all solids, surfaces and sources that have an end."""
        things = [_placed_box(face) for face in (*self.record["faces"], *self.record["sources"]) if "shape" in face]
        boxes = [box for box in things if np.isfinite(box).all()]
        boxes += [np.array([start.min(axis=0), start.max(axis=0)]) for _, _, start, _ in self.sources if len(start)]
        if not boxes:
            return np.full((2, 3), np.nan)
        return np.array([np.min(boxes, axis=(0, 1)), np.max(boxes, axis=(0, 1))])

    def _faces(self, curves: list[list[Array]]) -> list[Part]:
        kinds = [finish_kind(finish) for finish in self.record["finishes"]]
        return [
            Part(name, kinds[face["finish"]], found)
            for name, face, found in zip(self.compiled.face_names, self.record["faces"], curves, strict=True)
            if found
        ]

    def _solids(self, curves: list[list[Array]]) -> list[Part]:
        borders: dict[int, list[Array]] = {}
        for face, found in zip(self.record["faces"], curves, strict=True):
            if face["solid"] is not None and found:
                borders.setdefault(face["solid"], []).extend(found)
        parts = []
        for number in sorted(borders):
            points = np.concatenate(borders[number])
            reach = JOINED * float(np.ptp(points, axis=0).max())
            filled = rings(borders[number], reach)
            medium = None
            if self.scene.solids[number].medium is not None:
                medium = self.record["solids"][number]["medium"]
            parts.append(Part(self.compiled.solid_names[number], "solid", borders[number], filled, medium))
        return parts

    def _uncut(self, curves: list[list[list[Array]]]) -> tuple[str, ...]:
        cut = {i for view in curves for i, found in enumerate(view) if found}
        solids = {self.record["faces"][i]["solid"] for i in cut}
        missing = [name for i, name in enumerate(self.compiled.solid_names) if i not in solids]
        return (*missing, *(name for name, i in _surfaces(self.compiled) if i not in cut))

    # --- sources, detectors, rays --------------------------------------------------------------------------------------

    def _glows(self, plane: Section) -> list[Glow]:
        found = []
        for name, source, start, direction in self.sources:
            curves: list[Array] = []
            if source["kind"] in {"surface", "beam"}:
                (curves,) = cut_faces([source], plane)
            depth = plane.depth(start)
            slack = 1e-6 * float(np.ptp(start, axis=0).max(initial=0.0)) if len(start) else 0.0
            flat = source["kind"] in {"surface", "beam"}
            near = bool(curves) if flat else bool(len(start) and depth.min() <= slack and depth.max() >= -slack)
            found.append(Glow(name, curves, plane.flat(start), plane.flat(direction), near))
        return found

    def _near_detectors(self) -> list[int]:
        """Numbers of the detectors that are drawn, near ones first."""
        boxes = {i: _placed_box(d) for i, d in enumerate(self.record["detectors"]) if "frame" in d}
        if self.window is not None:
            return list(boxes)
        shown: list[int] = []
        axes = sorted({"xyz".index(axis) for plane in self.planes for axis in (plane.across, plane.up)})
        for i in sorted(boxes, key=lambda i: self._growth(boxes[i])):
            alone = not np.isfinite(self.seen).any()
            if np.isfinite(boxes[i]).all() and (alone or self._growth(boxes[i]) <= FARTHEST):
                shown.append(i)
                self.seen[0, axes] = np.minimum(self.seen[0, axes], boxes[i][0, axes])
                self.seen[1, axes] = np.maximum(self.seen[1, axes], boxes[i][1, axes])
        return shown

    def _nearest(self, plane: Section, curves: list[Array]) -> Array:
        """The point of curves nearest to the middle of what is seen so far, shape (1, 2)."""
        middle = plane.flat(np.where(np.isfinite(self.seen), self.seen, 0.0).mean(axis=0))
        points = np.concatenate(curves)
        return points[[np.argmin(np.hypot(*(points - middle).T))]]

    def _growth(self, box: Array) -> float:
        """How many times larger the frame becomes with a box."""
        both = np.array([np.fmin(self.seen[0], box[0]), np.fmax(self.seen[1], box[1])])
        now = np.where(np.isfinite(self.seen).all(axis=0), self.seen[1] - self.seen[0], 0.0).max()
        return float((both[1] - both[0]).max()) / now if now > 0.0 else np.inf

    def _detectors(self, shown: list[int], plane: Section) -> list[Part]:
        faces = [_detector_face(self.record["detectors"][i]) for i in shown]
        names = [self.compiled.detector_names[i] for i in shown]
        return [Part(n, "detector", c) for n, c in zip(names, cut_faces(faces, plane), strict=True) if c]

    def _trails(self, windows: list[Window]) -> list[list[Array]]:
        """For each view the rays that it shows, out of the same ones for all."""
        frames = [plane.points(np.array(w).reshape(2, 2).T) for plane, w in zip(self.planes, windows, strict=True)]
        size = float(np.ptp(np.concatenate(frames), axis=0).max())
        things = [
            _placed_box(thing) for key in ("faces", "detectors") for thing in self.record[key] if "frame" in thing
        ]
        points = np.concatenate([*frames, *things, *(start for _, _, start, _ in self.sources)])
        far = FAR * float(np.ptp(np.where(np.isfinite(points), points, 0.0), axis=0).max())
        traced = trace_trails(self.compiled, min(CANDIDATES * self.rays, MOST_TRACED), self.seed, far)
        return [near_section(traced, plane, self.rays, 0.1 * size) for plane in self.planes]

    # --- frames and media ----------------------------------------------------------------------------------------------

    def _windows(self, larger: float = 1.0) -> list[Window]:
        """Frames of the views, or frames so much larger; those with the same axis upright have the same height."""
        if self.window is not None:
            return [self.window] * len(self.planes)
        targets = [np.array([o.target, o.target]) for o in self.scene.observers]
        for box in targets if not np.isfinite(self.seen).any() else []:
            self._reach(Section("y", 0.0), [Section("y", 0.0).flat(box)])
            self._reach(Section("x", 0.0), [Section("x", 0.0).flat(box)])
        low, high = np.where(np.isfinite(self.seen), self.seen, 0.0)
        size = float((high - low).max())
        size = size if size > 0.0 else max(1e-9 * float(np.abs(low).max()), 10.0)
        middle, half = (low + high) / 2.0, larger * (np.maximum(high - low, NARROWEST * size) / 2.0 + MARGIN * size)
        left, right = middle - half, middle + half
        pairs = [[("xyz").index(axis) for axis in (plane.across, plane.up)] for plane in self.planes]
        return [(float(left[u]), float(right[u]), float(left[v]), float(right[v])) for u, v in pairs]

    def _media(self) -> tuple[dict[int, tuple[str, float]], float]:
        """Names and indices of media of solids and of the surroundings, at the first source's wavelength."""
        wavelength = self.scene.wavelength
        if self.record["sources"]:
            first = self.record["sources"][0]
            wavelength = float(first["wavelengths"][np.argmax(first["shares"])])
        given = {0: self.scene.surroundings}
        for solid, record in zip(self.scene.solids, self.record["solids"], strict=True):
            if solid.medium is not None:
                given.setdefault(record["medium"], solid.medium)
        media = {}
        for number, what in given.items():
            medium = what if isinstance(what, Medium) else self.scene.media.get(what) or MEDIA[what].medium
            index = float(medium.index_at([wavelength], self.scene.files)[0])
            media[number] = (self.compiled.medium_names[number], index)
        return media, wavelength


def _surfaces(compiled: Compiled) -> list[tuple[str, int]]:
    """Names of the surfaces that are no solid's, and numbers of their faces."""
    faces = zip(compiled.face_names, compiled.record["faces"], strict=True)
    return [(name, i) for i, (name, face) in enumerate(faces) if face["solid"] is None]


def _detector_face(detector: Record) -> Record:
    if "shape" in detector:
        return detector
    outline = {"kind": "rectangle", "width": detector["width"], "height": detector["height"]}
    return {"shape": {"kind": "flat", "outline": outline}, "frame": detector["frame"], "trims": []}


def _placed_box(thing: Record) -> Array:
    """The box around a face or a detector in the world; infinite if it has no end."""
    face = _detector_face(thing)
    box, frame = box_of(face["shape"]), np.asarray(face["frame"], dtype=np.float64)
    if not np.isfinite(box).all():
        return np.array([[-np.inf] * 3, [np.inf] * 3])
    corners = np.stack(np.meshgrid(*box.T), axis=-1).reshape(-1, 3) @ frame[3:].reshape(3, 3) + frame[:3]
    return np.array([corners.min(axis=0), corners.max(axis=0)])
