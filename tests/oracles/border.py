"""The tracer's record, read a second time: a plain ray caster in numpy, written from the record's definition alone.

It knows nothing of how scenes are described. One ray at a time, no tree, no tolerance but where a quadratic needs none.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Hit = tuple[float, float, int]
"""Distance along the ray, cosine between ray and outward normal, number of the face."""


def _in_polygon(x: float, y: float, vertices: Array) -> bool:
    """Crossing number of a ray along +x."""
    a, b = vertices, np.concatenate([vertices[1:], vertices[:1]])
    straddles = (a[:, 1] > y) != (b[:, 1] > y)
    a, b = a[straddles], b[straddles]
    crossing = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(crossing > x) % 2)


def _in_outline(outline: dict[str, Any], p: Array) -> bool:
    match outline["kind"]:
        case "whole":
            return True
        case "rectangle":
            return bool(abs(p[0]) <= outline["width"] / 2 and abs(p[1]) <= outline["height"] / 2)
        case "annulus":
            return bool(outline["inner"] <= math.hypot(p[0], p[1]) <= outline["outer"])
        case "polygon":
            return _in_polygon(p[0], p[1], outline["vertices"])
    raise AssertionError(outline)


def _sag(shape: dict[str, Any], r: Array) -> Array:
    """The asphere's equation, term by term."""
    c, k = shape["curvature"], shape["conic"]
    z = c * r**2 / (1 + np.sqrt(1 - (1 + k) * c**2 * r**2))
    for i, a in enumerate(shape["coefficients"]):
        z = z + a * r ** (4 + 2 * i)
    return z


def _roots(a: float, b: float, c: float) -> list[float]:
    """Real ones of a t² + b t + c, the smaller from the product of both."""
    square = b * b - 4 * a * c
    if square < 0:
        return []
    q = -(b + math.copysign(math.sqrt(square), b)) / 2
    return ([q / a] if a != 0 else []) + ([c / q] if q != 0 else [])


def _surface_hits(shape: dict[str, Any], o: Array, d: Array) -> list[tuple[float, Array]]:
    """(t, unit normal) where the line o + t d meets a shape, in its own coordinates."""
    found: list[tuple[float, Array]] = []
    match shape["kind"]:
        case "flat":
            if d[2] != 0:
                t = -o[2] / d[2]
                if _in_outline(shape["outline"], o + t * d):
                    found.append((t, np.array([0.0, 0.0, 1.0])))
        case "quadric":
            w = np.array([shape["r2"], shape["r2"], shape["z2"]])
            linear = np.array([0.0, 0.0, shape["z1"]])
            a, b, c = w @ (d * d), 2 * (w @ (o * d)) + linear @ d, w @ (o * o) + linear @ o + shape["z0"]
            for t in _roots(float(a), float(b), float(c)):
                p = o + t * d
                low, high = shape["r"]
                r = math.hypot(p[0], p[1])
                if shape["z"][0] <= p[2] <= shape["z"][1] and low <= r <= high:
                    n = 2 * w * p + linear
                    found.append((t, n / np.linalg.norm(n)))
        case "asphere":
            found = _asphere_hits(shape, o, d)
        case "torus":
            found = _torus_hits(shape, o, d)
        case "mesh":
            found = _mesh_hits(shape, o, d)
        case kind:
            raise AssertionError(kind)
    return found


def _asphere_hits(shape: dict[str, Any], o: Array, d: Array) -> list[tuple[float, Array]]:
    """Sign changes of z - sag(r) between the crossings of the cylinder r = outer, refined by halving."""
    low, high = shape["r"]
    a, b, c = d[0] ** 2 + d[1] ** 2, o[0] * d[0] + o[1] * d[1], o[0] ** 2 + o[1] ** 2 - high**2
    if a == 0:  # parallel to the axis
        starts = [float((_sag(shape, np.array(math.sqrt(c + high**2))) - o[2]) / d[2])] if c <= 0 else []
    elif b * b - a * c <= 0:
        starts = []
    else:
        starts = _asphere_roots(shape, o, d, (-b - math.sqrt(b * b - a * c)) / a, (-b + math.sqrt(b * b - a * c)) / a)
    found = []
    for t in starts:
        p = o + t * d
        r = math.hypot(p[0], p[1])
        if low <= r:
            # The slope by a difference, one-sided at the rim.
            h = 1e-6 * high
            outer = min(r + h, high)
            slope = float(_sag(shape, np.array(outer)) - _sag(shape, np.array(r - h))) / (outer - r + h)
            n = np.array([-slope * p[0] / max(r, 1e-300), -slope * p[1] / max(r, 1e-300), 1.0])
            found.append((t, n / np.linalg.norm(n)))
    return found


def _asphere_roots(shape: dict[str, Any], o: Array, d: Array, start: float, stop: float) -> list[float]:
    high = shape["r"][1]

    def height(t: Array) -> Array:
        p = o + t[:, None] * d
        return p[:, 2] - _sag(shape, np.minimum(np.hypot(p[:, 0], p[:, 1]), high))

    t = np.linspace(start, stop, 2001)
    sign = np.sign(height(t))
    found = []
    for i in np.nonzero(sign[1:] != sign[:-1])[0]:
        near, far = t[i], t[i + 1]
        for _ in range(60):
            middle = (near + far) / 2
            near, far = (middle, far) if np.sign(height(np.array([middle])))[0] == sign[i] else (near, middle)
        found.append(float(near))
    return found


def _torus_hits(shape: dict[str, Any], o: Array, d: Array) -> list[tuple[float, Array]]:
    """Real roots of the quartic (p² + R² - r²)² = 4 R² (x² + y²)."""
    R, r = shape["major"], shape["minor"]
    square = np.array([d @ d, 2 * (o @ d), o @ o + R * R - r * r])
    flat = np.array([d[:2] @ d[:2], 2 * (o[:2] @ d[:2]), o[:2] @ o[:2]])
    quartic = np.convolve(square, square)
    quartic[2:] -= 4 * R * R * flat
    found = []
    for t in np.roots(quartic):
        if abs(t.imag) < 1e-7:
            p = o + t.real * d
            ring = R * p[:2] / math.hypot(p[0], p[1])
            found.append((float(t.real), np.array([*(p[:2] - ring), p[2]]) / r))
    return found


def _cross(u: Array, v: Array) -> Array:
    """Vector products, row by row: for a few triangles `numpy.cross` takes ten times as long."""
    return u[:, [1, 2, 0]] * v[:, [2, 0, 1]] - u[:, [2, 0, 1]] * v[:, [1, 2, 0]]


def _mesh_hits(shape: dict[str, Any], o: Array, d: Array) -> list[tuple[float, Array]]:
    """Every triangle by Cramer's rule."""
    a, b, c = (shape["vertices"][shape["triangles"][:, k]] for k in range(3))
    normal = _cross(b - a, c - a)
    across = normal @ d
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.einsum("ij,ij->i", normal, a - o) / across
        p = o + t[:, None] * d
        inside = [np.einsum("ij,ij->i", normal, _cross(v - u, p - u)) >= 0 for u, v in ((a, b), (b, c), (c, a))]
    hit = inside[0] & inside[1] & inside[2] & (across != 0)
    return [(float(t[i]), normal[i] / np.linalg.norm(normal[i])) for i in np.nonzero(hit)[0]]


def _face_hits(face: dict[str, Any], o: Array, d: Array) -> list[tuple[float, float]]:
    """(t, cosine between ray and the face's normal) of every hit, unordered."""
    frame = np.array(face["frame"])
    origin, axes = frame[:3], frame[3:].reshape(3, 3)  # rows are the local axes
    local_o, local_d = axes @ (o - origin), axes @ d
    found = []
    for t, n in _surface_hits(face["shape"], local_o, local_d):
        p = local_o + t * local_d
        if all(x * p[0] + y * p[1] + z * p[2] <= limit for x, y, z, limit in face["trims"]):
            found.append((t, float(n @ local_d) * (-1 if face["flip"] else 1)))
    return found


def hits(faces: list[dict[str, Any]], *, o: Array, d: Array) -> list[Hit]:
    """Every hit of a line with some faces, in order."""
    return sorted((t, cosine, i) for i, face in enumerate(faces) for t, cosine in _face_hits(face, o, d))
