"""Whether rays meet the same triangles, at the same distances, as they do for Embree, which works in single precision.

Both get the same numbers: vertices, origins and directions are rounded to single precision first. Ours are hits of the
forward trace on a ray collecting surface of the same mesh, in double precision. They are compared with Embree's triangle:
equal is what lies on it to 10⁻⁹ of its size. All other rays are decided by brute force in double precision, triangle by
triangle, and told by what makes single precision err:

- edge: the ray passes an edge of the nearest triangle, or of Embree's, closer than single precision can tell;
- coincident: Embree's triangle is met at a distance that single precision cannot tell from the nearest;
- rim: it passes the rim of what it sees, an edge or a corner with one triangle only or with triangles whose fronts and backs
  are seen, so closely that double precision cannot tell either;
- ours: brute force does not confirm our hit, and there is no rim;
- unexplained: the rest.

Rays: random ones about a bumpy ball of 20 480 triangles; off the walls of the cavity of `tracer.py`; onto two sheets
of slivers, up to 10⁴ times as long as they are wide, one a millionth of a millimetre below the other, half of them aimed at
corners and edges.

python benchmarks/embree_agreement.py [--jobs ball,cavity,slivers] [--rays 10000000]
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
import time
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import trimesh
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from scenes import mesh as cavity_mesh

Array = Any
CHUNK = 1 << 20
SINGLE, DOUBLE = 2.0**-24, 2.0**-53
"""Half the distance from 1 to the next number in single and in double precision."""
ROUNDINGS = 32.0
"""Roundings that a crossing in single precision may add up to: some thirty operations, none of which cancels more than the
factors that are counted apart."""
ON = 1e-9


@dataclasses.dataclass
class Mesh:
    """Corners of triangles, shape (n, 3, 3) [mm], numbers of single precision."""

    vertices: Array
    triangles: Array

    def __post_init__(self) -> None:
        self.vertices = self.vertices.astype(np.float32).astype(np.float64)
        self.corners = self.vertices[self.triangles]
        self.first = self.corners[:, 0]
        self.edges = np.stack([self.corners[:, 1] - self.first, self.corners[:, 2] - self.first], axis=1)
        self.cross = np.cross(self.edges[:, 0], self.edges[:, 1])
        self.area = np.linalg.norm(self.cross, axis=1)
        sides = np.linalg.norm(self.corners - np.roll(self.corners, 1, axis=1), axis=2)
        self.size = sides.max(axis=1)
        # How much of the digits of a normal are lost in a sliver.
        self.slim = self.size**2 / self.area


def places(mesh: Mesh, triangle: Array, points: Array) -> tuple[Array, Array]:
    """Barycentric coordinates (…, 3) of points in the planes of triangles, and heights over these."""
    away = points - mesh.first[triangle]
    e1, e2, normal = mesh.edges[triangle, 0], mesh.edges[triangle, 1], mesh.cross[triangle]
    square = (normal**2).sum(-1)
    u = (np.cross(away, e2) * normal).sum(-1) / square
    v = (np.cross(e1, away) * normal).sum(-1) / square
    return np.stack([1 - u - v, u, v], axis=-1), np.abs((away * normal).sum(-1)) / np.sqrt(square)


class Ours:
    """The forward trace, with the mesh as a ray collecting surface."""

    def __init__(self, mesh: Mesh, folder: Path) -> None:
        path = folder / "mesh.ply"
        trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).export(path)
        self.detector = {"name": "mesh", "kind": "rays", "shape": {"kind": "mesh", "file": str(path), "unit": "mm"}}

    def nearest(self, origin: Array, direction: Array) -> Array:
        """Distance of the nearest hit of each ray in units of its direction's length; infinite if there is none."""
        n = len(origin)
        # The flux of a ray is its number.
        rays = et.RaySet(origin, direction, np.arange(1.0, n + 1.0))
        scene = et.Scene(sources=[{"kind": "rays", "rays": rays}], detectors=[self.detector])
        met = et.trace(scene, None, 1).rays["mesh"]
        number = np.rint(met.flux).astype(np.int64) - 1
        away = np.linalg.norm(met.position - origin[number], axis=1) / np.linalg.norm(direction[number], axis=1)
        found = np.full(n, np.inf)
        np.minimum.at(found, number, away)
        return found


@dataclasses.dataclass
class Crossings:
    """Of one ray with all triangles, in double precision."""

    distance: Array
    """In units of the direction's length; infinite: not met."""
    within: Array
    """How far inside of the line of each edge the ray passes, shape (n, 3) [mm]; negative outside."""
    cosine: Array
    reach: Array
    """The lengths that a crossing is computed from [mm]."""


def brute_force(mesh: Mesh, o: Array, d: Array) -> Crossings:
    """Triangle by triangle. Met is also what roundings may have put outside: those of a ray's place beside an edge."""
    reach = np.linalg.norm(mesh.first - o, axis=1) + mesh.size
    down = mesh.cross @ d
    edges = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    across = np.cross(d, edges)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = ((mesh.first - o) * mesh.cross).sum(1) / down
        within = ((o - mesh.corners) * across).sum(2) / np.linalg.norm(across, axis=2) * np.sign(down)[:, None]
    within = np.nan_to_num(within, nan=-np.inf)
    inside = (within >= -ROUNDINGS * DOUBLE * reach[:, None]).all(1)
    t = np.where(inside & (t > 0), t, np.inf)
    return Crossings(t, within, np.abs(down) / (mesh.area * np.linalg.norm(d)), reach)


@dataclasses.dataclass
class Count:
    """What became of the rays."""

    rays: int = 0
    met: int = 0
    equal: int = 0
    edge: int = 0
    coincident: int = 0
    rim: int = 0
    ours: int = 0
    unexplained: int = 0
    farther: int = 0
    worst: float = 0.0


def compare(mesh: Mesh, mine: Array, theirs: dict[str, Array], origin: Array, direction: Array, count: Count) -> None:
    """Count the verdicts on rays."""
    length = np.linalg.norm(direction, axis=1)
    triangle, distance = theirs["primID"].astype(np.int64), theirs["tfar"].astype(np.float64)
    both = (triangle >= 0) & np.isfinite(mine)
    count.rays += len(mine)
    count.met += int(np.isfinite(mine).sum())
    equal = (triangle < 0) & ~np.isfinite(mine)
    i = np.flatnonzero(both)
    k = triangle[i]
    weights, height = places(mesh, k, origin[i] + mine[i, None] * direction[i])
    on = (weights >= -ON).all(1) & (height <= ON * (mesh.size[k] + np.abs(mesh.first[k]).max(1)))
    equal[i[on]] = True
    count.equal += int(equal.sum())
    # Distances, where the triangle is the same: what single precision can err by, counted in units of it.
    i, k = i[on], k[on]
    cosine = np.abs((mesh.cross[k] * direction[i]).sum(1)) / (mesh.area[k] * length[i])
    reach = np.linalg.norm(mesh.first[k] - origin[i], axis=1) + mesh.size[k]
    bound = SINGLE * reach * mesh.slim[k] / cosine / length[i]
    off = np.abs(distance[i] - mine[i]) / bound
    count.farther += int((off > ROUNDINGS).sum())
    count.worst = max(count.worst, float(off.max(initial=0.0)))
    for i in np.flatnonzero(~equal):
        judge(mesh, origin[i], direction[i], float(mine[i]), int(triangle[i]), count)


def judge(mesh: Mesh, o: Array, d: Array, mine: float, theirs: int, count: Count) -> None:
    """Why a ray meets another triangle for Embree."""
    truth, length = brute_force(mesh, o, d), np.linalg.norm(d)
    t, reach = truth.distance, truth.reach
    best = int(np.argmin(t))
    same = np.isfinite(t[best]) == np.isfinite(mine)
    if not (same and (not np.isfinite(mine) or abs(t[best] - mine) <= ON * reach[best] / length)):
        missed = np.flatnonzero(t < mine - ON * reach / length)
        if len(missed) and all(at_rim(mesh, k, truth, d) for k in missed):
            count.rim += 1
        else:
            count.ours += 1
        return
    near = {k for k in (best, theirs) if k == theirs >= 0 or (k == best and np.isfinite(t[k]))}
    if any(np.abs(truth.within[k]).min() <= ROUNDINGS * SINGLE * reach[k] for k in near):
        count.edge += 1
    elif theirs >= 0 and abs(t[theirs] - t[best]) * length <= ROUNDINGS * SINGLE * max(
        reach[k] * mesh.slim[k] / truth.cosine[k] for k in near
    ):
        count.coincident += 1
    else:
        count.unexplained += 1


def at_rim(mesh: Mesh, triangle: int, truth: Crossings, d: Array) -> bool:
    """Whether a triangle is met at a corner or an edge beyond which the mesh ends or turns away."""
    beside = np.flatnonzero(np.abs(truth.within[triangle]) <= ROUNDINGS * DOUBLE * truth.reach[triangle])
    if not beside.size:
        return False
    # On one edge the ends of it hold the place, on two the corner that they share.
    ends = [{int(v) for v in mesh.triangles[triangle][[j, (j + 1) % 3]]} for j in beside]
    held = list(set.intersection(*ends[:2]))
    around = np.flatnonzero(np.isin(mesh.triangles, held).sum(axis=1) == len(held))
    turned = np.sign(mesh.cross[around] @ d)
    # About an inner corner every edge has two triangles: as many others as triangles.
    others = len(np.unique(mesh.triangles[around])) - len(held)
    closed = len(around) == (2 if len(held) == 2 else others)
    return not closed or len(np.unique(turned)) > 1


# --- meshes and rays -------------------------------------------------------------------------------------------------


def directions(rng: np.random.Generator, n: int) -> Array:
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


def ball() -> Mesh:
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=10.0)
    bumps = (
        1.0
        + 0.05 * np.sin(3 * sphere.vertices).prod(axis=1)
        + np.random.default_rng(1).normal(0, 2e-3, len(sphere.vertices))
    )
    return Mesh(sphere.vertices * bumps[:, None], sphere.faces)


def rays_of_ball(_mesh: Mesh, rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Points within a box about the ball, directions all round, of all lengths from 1/2 to 2."""
    return rng.uniform(-12, 12, (n, 3)), directions(rng, n) * rng.uniform(0.5, 2.0, (n, 1))


def cavity() -> Mesh:
    return Mesh(*cavity_mesh())


def rays_of_cavity(mesh: Mesh, rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Off the walls, Lambertian, as the segments of a trace; a thousandth of a millimetre above the facets."""
    pick = rng.choice(len(mesh.triangles), n, p=mesh.area / mesh.area.sum())
    u, v = np.sqrt(rng.random(n)), rng.random(n)
    place = np.einsum("nk,nkx->nx", np.stack([1 - u, u * (1 - v), u * v], axis=1), mesh.corners[pick])
    inward = mesh.cross[pick] / mesh.area[pick, None]
    inward *= np.sign(((np.array([0.0, 0.0, 10.7]) - place) * inward).sum(1))[:, None]
    d = inward + directions(rng, n)
    return place + 1e-3 * inward, d / np.linalg.norm(d, axis=1)[:, None]


def slivers() -> Mesh:
    """Two wavy sheets of quadrilaterals, 10 long and 0.001 to 1 wide, each cut in two."""
    rng = np.random.default_rng(3)
    x = np.concatenate([[0.0], np.cumsum(10 ** rng.uniform(-3, 0, 300))])
    z = 0.3 * np.sin(x) + rng.normal(0, 1e-3, len(x))
    z = np.stack([z, z + rng.normal(0, 1e-3, len(x)), z - 1.0, z])
    rails = [np.stack([x, np.full(len(x), 10.0 * k), z[k] - down], axis=1) for down in (0.0, 1e-6) for k in range(4)]
    n = len(x)
    a = np.arange(n - 1)
    parts = []
    for low in (k * n for k in (0, 1, 2, 4, 5, 6)):
        parts += [
            np.stack([low + a, low + a + 1, low + n + a], 1),
            np.stack([low + a + 1, low + n + a + 1, low + n + a], 1),
        ]
    return Mesh(np.concatenate(rails), np.concatenate(parts))


def rays_of_slivers(mesh: Mesh, rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """From above: at random points of triangles, and as many at corners, at middles of edges, and at points of edges."""
    pick = rng.integers(0, len(mesh.triangles), n)
    weights = rng.dirichlet([1.0, 1.0, 1.0], n)
    kind = rng.integers(0, 6, n)
    weights[kind == 3] = np.eye(3)[rng.integers(0, 3, (kind == 3).sum())]
    weights[kind == 4] = (1 - np.eye(3)[rng.integers(0, 3, (kind == 4).sum())]) / 2
    weights[kind == 5, rng.integers(0, 3, (kind == 5).sum())] = 0.0
    weights /= weights.sum(1)[:, None]
    target = np.einsum("nk,nkx->nx", weights, mesh.corners[pick]).astype(np.float32)
    away = directions(rng, n)
    away[:, 2] = np.abs(away[:, 2])
    origin = (target + 20.0 * away).astype(np.float32)
    return origin.astype(np.float64), target.astype(np.float64) - origin


JOBS = {
    "ball": (ball, rays_of_ball, 1.0),
    "cavity": (cavity, rays_of_cavity, 1.0),
    "slivers": (slivers, rays_of_slivers, 0.05),
}


def run(name: str, rays: int) -> None:
    make, cast, share = JOBS[name]
    mesh, rng, count = make(), np.random.default_rng(7), Count()
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, mesh.corners.astype(np.float32))
    start, left = time.perf_counter(), int(rays * share)
    with tempfile.TemporaryDirectory() as folder:
        ours = Ours(mesh, Path(folder))
        while left:
            n = min(left, CHUNK)
            left -= n
            origin, direction = (a.astype(np.float32) for a in cast(mesh, rng, n))
            theirs = scene.run(origin, direction, output=True)
            origin, direction = origin.astype(np.float64), direction.astype(np.float64)
            compare(mesh, ours.nearest(origin, direction), theirs, origin, direction, count)
    print(f"{name}: {len(mesh.triangles):,} triangles, {count.rays:,} rays, {time.perf_counter() - start:.0f} s")
    print(f"  meet the mesh {count.met:,}; equal {count.equal / count.rays:.7%}, other {count.rays - count.equal:,}")
    print(f"  edge {count.edge:,}, coincident {count.coincident:,}, rim {count.rim:,}")
    print(f"  ours {count.ours:,}, unexplained {count.unexplained:,}")
    print(f"  distances beyond {ROUNDINGS:g} roundings: {count.farther:,}; the farthest {count.worst:.1f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", default=",".join(JOBS))
    parser.add_argument("--rays", type=float, default=1e7)
    options = parser.parse_args()
    for name in options.jobs.split(","):
        run(name, int(options.rays))


if __name__ == "__main__":
    main()
