"""The jobs of `run_all.py` in Mitsuba 3, as fast as its LLVM variants do them: lean loops for rays, renders for maps.

The variants want `libllvm19` (Debian) and `DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drjit as dr
import etendue as et
import mitsuba as mi
import numpy as np
import scenes
import trimesh

Array = Any
VARIANTS = ("llvm_ad_mono", "llvm_ad_rgb")


def _cosine(rng: Any) -> Any:
    return mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))


@dr.syntax
def _about_the_cavity(scene: Any, rays: int, seed: int) -> tuple[Any, Any]:
    """Segments and rays that left; the black holes are found by their place, which costs no shapes."""
    rng = mi.PCG32(size=rays, initstate=seed)
    turn = mi.Float(dr.arange(mi.UInt32, rays) & 3) * (dr.pi / 2)
    spot = mi.warp.square_to_uniform_disk(mi.Point2f(rng.next_float32(), rng.next_float32())) * scenes.HOLE
    origin = mi.Point3f(scenes.AWAY * dr.cos(turn) + spot.x, scenes.AWAY * dr.sin(turn) + spot.y, 1e-3)
    direction = mi.Vector3f(_cosine(rng))
    active, segments, left = mi.Bool(True), mi.UInt32(0), mi.Bool(False)
    while active:
        ray = mi.Ray3f(origin, direction)
        found = scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        hit = found.is_valid() & active
        segments += dr.select(active, 1, 0)
        left |= active & ~hit
        at = found.compute_surface_interaction(ray, mi.RayFlags.Minimal, hit)
        normal = mi.Vector3f(dr.select(dr.dot(at.n, direction) > 0, -at.n, at.n))
        far = dr.maximum(dr.abs(at.p.x), dr.abs(at.p.y))
        near = dr.minimum(dr.abs(at.p.x), dr.abs(at.p.y))
        black = (at.p.z < 1e-4) & (dr.square(far - scenes.AWAY) + dr.square(near) < scenes.HOLE**2)
        active = hit & (rng.next_float32() < scenes.REFLECTANCE) & ~black
        direction = mi.Vector3f(mi.Frame3f(normal).to_world(_cosine(rng)))
        origin = mi.Point3f(at.p + normal * 1e-4)
    return dr.sum(mi.Float(segments)), dr.sum(mi.Float(left))


@dr.syntax
def _among_glass(scene: Any, rays: int, seed: int) -> Any:
    """Segments of rays from a Lambertian disk of radius 40 through whatever stands in the scene."""
    rng = mi.PCG32(size=rays, initstate=seed)
    spot = 40 * mi.warp.square_to_uniform_disk(mi.Point2f(rng.next_float32(), rng.next_float32()))
    ray = mi.Ray3f(mi.Point3f(spot.x, spot.y, 0), _cosine(rng))
    active, segments, events, context = mi.Mask(True), mi.UInt32(0), mi.UInt32(0), mi.BSDFContext()
    while active:
        at = scene.ray_intersect(ray, active)
        segments += dr.select(active, 1, 0)
        active &= at.is_valid()
        pair = mi.Point2f(rng.next_float32(), rng.next_float32())
        chosen, _ = at.bsdf(ray).sample(context, at, rng.next_float32(), pair, active)
        ray = at.spawn_ray(at.to_world(chosen.wo))
        events += 1
        active &= events < 1000
    return dr.sum(mi.Float(segments))


def cavity_rate(walls: Callable[[], dict[str, Any]], rays: int, repeats: int) -> tuple[float, float]:
    """Segments per second in the cavity, by the faster variant, and the exit fraction."""
    best = (0.0, 0.0)
    for variant in VARIANTS:
        mi.set_variant(variant)
        scene = mi.load_dict({"type": "scene", **walls()})
        for seed in range(repeats + 1):
            start = time.perf_counter()
            segments, left = _about_the_cavity(scene, rays, seed)
            dr.eval(segments, left)
            dr.sync_thread()
            if seed:  # the first one compiles
                best = max(best, (segments[0] / (time.perf_counter() - start), left[0] / rays))
    return best


def balls_rate(places: Array, radius: float, rays: int, repeats: int) -> tuple[float, float]:
    """Segments per second among glass balls, and how long they take to load [s]."""
    mi.set_variant(VARIANTS[0])
    glass = {"type": "dielectric", "int_ior": 1.4936, "ext_ior": 1.0, "id": "glass"}
    start = time.perf_counter()
    ball = {"type": "sphere", "radius": radius, "bsdf": {"type": "ref", "id": "glass"}}
    balls = {f"ball{i}": {**ball, "center": place.tolist()} for i, place in enumerate(places)}
    scene = mi.load_dict({"type": "scene", "glass": glass, **balls})
    loaded = time.perf_counter() - start
    best = 0.0
    for seed in range(repeats + 1):
        start = time.perf_counter()
        segments = _among_glass(scene, rays, seed)
        dr.eval(segments)
        dr.sync_thread()
        if seed:
            best = max(best, segments[0] / (time.perf_counter() - start))
    return best, loaded


def _camera(observer: et.Observer, screen: et.Screen, samples: int) -> dict[str, Any]:
    up, eye = screen.axes(observer)[1], np.asarray(observer.position).tolist()
    look = mi.ScalarTransform4f().look_at(origin=eye, target=list(observer.target), up=up.tolist())
    film = {
        "type": "hdrfilm",
        "width": screen.columns,
        "height": screen.rows,
        "rfilter": {"type": "box"},
        "pixel_format": "luminance",
    }
    return {
        "type": "perspective",
        "fov": 2 * math.degrees(math.atan(screen.width / 2 / observer.distance)),
        "fov_axis": "x",
        "to_world": look,
        "film": film,
        "sampler": {"type": "independent", "sample_count": samples},
    }


def _level(value: float) -> Any:
    return value if "mono" in mi.variant() else {"type": "rgb", "value": value}


def cavity_map(observer: et.Observer, screen: et.Screen, samples: int) -> Callable[[int], Array]:
    """The map of the cavity by the path tracer, with walls of triangles: the analytic cylinder leaks in single precision."""
    mi.set_variant(VARIANTS[0])
    transform = mi.ScalarTransform4f
    light = {"type": "area", "radiance": _level(scenes.FLUX / (math.pi**2 * scenes.HOLE**2))}
    black = {"type": "diffuse", "reflectance": _level(0.0)}
    lamps = {
        f"lamp{i}": {
            "type": "disk",
            "to_world": transform().translate([x, y, 1e-3]) @ transform().scale(scenes.HOLE),
            "emitter": light,
            "bsdf": black,
        }
        for i, (x, y) in enumerate(scenes.HOLES)
    }
    vertices, triangles = scenes.mesh()
    white = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": _level(scenes.REFLECTANCE)}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "walls": _mesh(vertices, triangles, white),
            **lamps,
            "integrator": {"type": "path", "max_depth": -1, "rr_depth": 5},
            "sensor": _camera(observer, screen, samples),
        }
    )
    return lambda seed: np.array(mi.render(scene, seed=seed, spp=samples))[..., 0]


def _mesh(vertices: Array, triangles: Array, bsdf: dict[str, Any]) -> Any:
    properties = mi.Properties()
    properties["face_normals"] = True
    properties["bsdf"] = mi.load_dict(bsdf)
    mesh = mi.Mesh("mesh", len(vertices), len(triangles), properties)
    held = mi.traverse(mesh)
    held["vertex_positions"] = np.ravel(vertices).astype(np.float32)
    held["faces"] = np.ravel(triangles).astype(np.uint32)
    held.update()
    return mesh


def rings_seconds(observer: et.Observer, screen: et.Screen, samples: int, repeats: int, *, lens: bool) -> float:
    """Time of a map of the ring source as Lambertian disks, bare or behind 98 304 triangles, by the faster variant [s]."""
    source, best = et.RingSource(), math.inf
    inner, radii = source.edges[:-1], source.edges[1:]
    levels = [flux / (math.pi**2 * (b * b - a * a)) for flux, a, b in zip(source.ring_flux, inner, radii, strict=True)]
    for variant in VARIANTS:
        mi.set_variant(variant)
        transform = mi.ScalarTransform4f
        black = {"type": "diffuse", "reflectance": _level(0.0)}
        parts: dict[str, Any] = {}
        for i, (radius, level) in enumerate(zip(radii, levels, strict=True)):
            # Nested disks at tiny steps, the smallest in front.
            place = transform().translate([0, 0, 1e-3 * (len(levels) - i)]) @ transform().scale(radius)
            emitter = {"type": "area", "radiance": _level(level)}
            parts[f"ring{i}"] = {"type": "disk", "to_world": place, "emitter": emitter, "bsdf": black}
        if lens:
            parts["lens"] = _mesh(*_lens_mesh(), {"type": "dielectric", "int_ior": 1.4936, "ext_ior": 1.0})
        path = {"type": "path", "max_depth": 16, "rr_depth": 100}
        camera = _camera(observer, screen, samples)
        scene = mi.load_dict({"type": "scene", **parts, "integrator": path, "sensor": camera})
        for seed in range(repeats + 1):
            start = time.perf_counter()
            np.array(mi.render(scene, seed=seed, spp=samples))
            if seed:
                best = min(best, time.perf_counter() - start)
    return best


def _lens_mesh(rings: int = 96, sectors: int = 256) -> tuple[Array, Array]:
    """The lens of `scenes.LENS` as triangles, closed."""
    shape = scenes.LENS["shape"]
    r = np.linspace(0, shape["radius"], rings + 1)[1:]

    def sag(radius_of_curvature: float, conic: float = 0.0) -> Array:
        c = 1 / radius_of_curvature
        return c * r * r / (1 + np.sqrt(1 - (1 + conic) * c * c * r * r))

    front, back = scenes.LENS["at"][2], scenes.LENS["at"][2] + shape["thickness"]
    turn = 2 * np.pi * np.arange(sectors) / sectors
    i, j = np.arange(sectors), (np.arange(sectors) + 1) % sectors

    def face(z: float, height: Array, base: int, *, turned: bool) -> tuple[Array, Array]:
        heights = (np.full(sectors, z + h) for h in height)
        circles = [np.column_stack([a * np.cos(turn), a * np.sin(turn), h]) for a, h in zip(r, heights, strict=True)]
        triangles = [np.stack([np.full(sectors, base), base + 1 + i, base + 1 + j], 1)]
        for k in range(rings - 1):
            low, high = base + 1 + k * sectors, base + 1 + (k + 1) * sectors
            triangles += [np.stack([low + i, high + i, high + j], 1), np.stack([low + i, high + j, low + j], 1)]
        found = np.concatenate(triangles)
        return np.concatenate([[[0.0, 0.0, z]], *circles]), found[:, ::-1] if turned else found

    one = face(front, sag(**shape["front"]), 0, turned=True)
    two = face(back, sag(**shape["back"]), len(one[0]), turned=False)
    low, high = 1 + (rings - 1) * sectors, len(one[0]) + 1 + (rings - 1) * sectors
    rim = [np.stack([low + i, low + j, high + j], 1), np.stack([low + i, high + j, high + i], 1)]
    return np.concatenate([one[0], two[0]]), np.concatenate([one[1], two[1], *rim])


def mesh_walls(folder: Path) -> tuple[Path, Callable[[], dict[str, Any]]]:
    """The cavity as a file of triangles, and what Mitsuba makes of it."""
    vertices, triangles = scenes.mesh()
    path = folder / "cavity.ply"
    trimesh.Trimesh(vertices, triangles, process=False).export(path)
    return path, lambda: {"walls": {"type": "ply", "filename": str(path), "face_normals": True}}


def analytic_walls() -> dict[str, Any]:
    """The cavity as a cylinder and a disk."""
    wall = {"type": "cylinder", "p0": [0, 0, 0], "p1": [0, 0, scenes.HEIGHT], "radius": scenes.RADIUS}
    base = {"type": "disk", "to_world": mi.ScalarTransform4f().scale(scenes.RADIUS)}
    return {"wall": {**wall, "flip_normals": True}, "base": base}
