"""What of a scene a plane cuts."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.scene.extents import box_of
from etendue.tracing.section import Section
from etendue.tracing.section_curves import crossed_curves
from etendue.tracing.section_meshes import mesh_curves

Array = npt.NDArray[np.float64]
Record = dict[str, Any]
Window = tuple[float, float, float, float]

BESIDE = 1e-11
"""Of the size of what is cut: so far beyond its place a section is laid, so that faces may end in it or lie in it; more than
roundings, and far less than a drawing shows."""

_CORNERS = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
_EDGES = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]


def cut_faces(faces: Sequence[Mapping[str, Any]], section: Section, window: Window | None = None) -> list[list[Array]]:
    """The curves in which a section cuts faces.

    Lines within the section are crossed with each face by the tracer itself, so that the curves are where rays would meet
    the face; only whole rectangles and triangles are cut by formula.

    Parameters
    ----------
    faces : sequence of mappings
        With ``shape``, ``frame`` and ``trims`` as the tracer takes them.
    section : Section
        It is laid a trifle (10⁻¹¹ of the size of it all) farther along its axis, where nothing ends or lies.
    window : left, right, bottom, top, optional
        What of the section is looked at [mm]. A face without an end, as a plane, has no curve without it.

    Returns
    -------
    list of lists of arrays, each of shape (k, 2)
        For each face its curves: points in order along each [mm]; a closed curve ends in its first point. Every point lies
        on the face, and between two of them the curve is nowhere farther from their chord than 3·10⁻⁵ of the face's size.

    Examples
    --------
    >>> rectangle = {"kind": "flat", "outline": {"kind": "rectangle", "width": 4.0, "height": 2.0}}
    >>> here = [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]
    >>> cut_faces([{"shape": rectangle, "frame": here, "trims": []}], Section("y", 0.5))[0][0].tolist()
    [[2.0, 0.0], [-2.0, 0.0]]
    """
    section = _beyond(section, faces)
    curves: list[list[Array]] = [[] for _ in faces]
    whole = [i for i, face in enumerate(faces) if _is_whole_rectangle(face)]
    for i, segment in zip(whole, _rectangles([faces[i] for i in whole], section), strict=True):
        curves[i] = segment
    for i in set(range(len(faces))).difference(whole):
        face = faces[i]
        placed = np.asarray(face["frame"], dtype=np.float64)
        curves[i] = _cut(face["shape"], placed[:3], placed[3:].reshape(3, 3), face.get("trims") or [], section, window)
    return curves


def _is_whole_rectangle(face: Mapping[str, Any]) -> bool:
    shape = face["shape"]
    return bool(shape["kind"] == "flat" and shape["outline"]["kind"] == "rectangle" and not face.get("trims"))


def _rectangles(faces: Sequence[Mapping[str, Any]], section: Section) -> list[list[Array]]:
    """All at once: films have a hundred thousand of them."""
    if not faces:
        return []
    frames = np.array([face["frame"] for face in faces], dtype=np.float64).reshape(-1, 4, 3)
    sizes = np.array([[f["shape"]["outline"][name] / 2.0 for name in ("width", "height")] for f in faces])
    turns = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    corners = frames[:, None, 0] + np.einsum("nck,nkx->ncx", turns * sizes[:, None], frames[:, 1:3])
    depth, flat = section.depth(corners), section.flat(corners)
    cut = (depth > 0.0) != (np.roll(depth, -1, axis=1) > 0.0)
    found: list[list[Array]] = [[] for _ in faces]
    for i in np.flatnonzero(cut.any(axis=1)).tolist():
        ends = [_between(flat[i], depth[i], k, (k + 1) % 4) for k in np.flatnonzero(cut[i]).tolist()]
        found[i] = [np.array(ends)]
    return found


def _between(flat: Array, depth: Array, a: int, b: int) -> Array:
    point: Array = (depth[b] * flat[a] - depth[a] * flat[b]) / (depth[b] - depth[a])
    return point


def _cut(
    shape: Record, origin: Array, axes: Array, trims: list[Any], section: Section, window: Window | None
) -> list[Array]:
    """The curves of one face whose axes are the rows of `axes`."""
    box = box_of(shape)
    if not (box[0] <= box[1]).all():
        return []
    if shape["kind"] == "mesh":
        curves = mesh_curves(shape, origin, axes, section)
        return [part for curve in curves for part in _trimmed(curve, trims, origin, axes, section)]
    if np.isfinite(box).all():
        corners = np.where(_CORNERS, box[1], box[0]) @ axes + origin
        crossing = _cut_box(section, corners)
        if crossing is None:
            return []
        region = np.array([crossing.min(axis=0), crossing.max(axis=0)])
    elif window is not None:
        region = np.array(window).reshape(2, 2).T
    else:
        return []
    return crossed_curves(shape, [*origin.tolist(), *axes.ravel().tolist()], trims, section, region)


def _beyond(section: Section, faces: Sequence[Mapping[str, Any]]) -> Section:
    """The section, moved on by a trifle."""
    sizes = [abs(section.at)]
    for face in faces:
        reach = np.abs([face["frame"][:3], *box_of(face["shape"])])
        sizes.append(float(reach.max(initial=0.0, where=np.isfinite(reach))))
    return dataclasses.replace(section, at=section.at + BESIDE * max(sizes))


def _cut_box(section: Section, corners: Array) -> Array | None:
    """Corners of the polygon in which a section cuts a box, in no order, shape (k, 2)."""
    depth = section.depth(corners)
    flat = section.flat(corners)
    found = [_between(flat, depth, a, b) for a, b in _EDGES if (depth[a] > 0.0) != (depth[b] > 0.0)]
    return np.array(found) if found else None


def _trimmed(curve: Array, trims: list[Any], origin: Array, axes: Array, section: Section) -> list[Array]:
    """What half spaces leave of straight pieces."""
    parts = [curve]
    for *normal, offset in trims:
        parts = [piece for part in parts for piece in _clipped(part, np.array(normal), offset, origin, axes, section)]
    return parts


def _clipped(curve: Array, normal: Array, offset: float, origin: Array, axes: Array, section: Section) -> list[Array]:
    height = (section.points(curve) - origin) @ axes.T @ normal - offset
    pieces: list[list[Array]] = [[]]
    for i, point in enumerate(curve):
        if i and (height[i - 1] <= 0.0) != (height[i] <= 0.0):
            pieces[-1].append(_between(curve, height, i - 1, i))
            if height[i] > 0.0:
                pieces.append([])
        if height[i] <= 0.0:
            pieces[-1].append(point)
    return [np.array(piece) for piece in pieces if len(piece) > 1]
