//! Many faces together: what a block of rays meets first.

use std::sync::Arc;

use etendue_math::heads::{heads, heads_mut};
use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::bounds::{Ball, Bounds};
use crate::bvh::{Bvh, Probe, Stack, Walk};
use crate::face::Face;
use crate::hits::{Hits, MeshRays, TIE};
use crate::intersect_block::{BoundedFace, try_simple};
use crate::mesh::{Found, Rays};
use crate::origin_faces::{MOST_ORIGIN_FACES, NONE, OriginFaces};
use crate::ray_block::RayBlock;
use crate::shape::{Crossing, Outline, Shape};

/// Rays in the coordinates of a mesh, and how far each of them is of interest: crossings that are tied with what it met so
/// far are.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn to_local(frame: &Frame, rays: &RayBlock, met: &[f64], scratch: &mut MeshRays) {
    let n = rays.len();
    let [ox, oy, oz] = heads(&rays.origin, n);
    let [dx, dy, dz] = heads(&rays.direction, n);
    let [px, py, pz] = heads_mut(&mut scratch.origin, n);
    let [kx, ky, kz] = heads_mut(&mut scratch.direction, n);
    let (met, reach) = (&met[..n], &mut scratch.t[..n]);
    for i in 0..n {
        let (o, d) = (Vec3::new(ox[i], oy[i], oz[i]), Vec3::new(dx[i], dy[i], dz[i]));
        let (p, k) = (frame.point_to_local(o), frame.direction_to_local(d));
        (px[i], py[i], pz[i]) = (p.x, p.y, p.z);
        (kx[i], ky[i], kz[i]) = (k.x, k.y, k.z);
        reach[i] = met[i] + TIE * (o.x.abs() + o.y.abs() + o.z.abs() + met[i]);
    }
}

/// Up to this number of faces, all of them, or balls around them, are tried on every ray; of more, those that a tree does not
/// rule out. Where a tree begins to pay: a ray's way through it takes as long as that many balls.
const FEW: usize = 128;

/// Faces that are met by so many rays that no tree would rule them out: as many of the largest as this at most.
const MOST_LARGE: usize = 24;

/// Share of the area of the whole scene, as balls have it, from which on a face is tried on every ray.
const LARGE: f64 = 0.2;

/// All faces of a scene.
#[derive(Clone, Debug, Default)]
pub struct FaceSet {
    faces: Vec<Face>,
    bounds: Vec<Bounds>,
    /// Faces that a whole block is tried on at once.
    simple: Vec<BoundedFace>,
    /// Meshes, which a whole block is sent through.
    meshes: Vec<u32>,
    /// Faces that are tried ray by ray.
    others: Vec<u32>,
    /// The tree of the other faces, and these in the order of its leaves.
    tree: Option<(Arc<Bvh>, Vec<BoundedFace>)>,
    /// Whether crossings of any of them have parts.
    has_parts: bool,
}

impl FaceSet {
    /// The faces, in the order of their numbers.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^32 faces")]
    pub fn new(faces: Vec<Face>) -> Self {
        let bounds: Vec<Bounds> = faces.iter().map(Face::bounds).collect();
        let mut set = Self {
            bounds,
            ..Self::default()
        };
        let balls: Vec<Option<Ball>> = faces.iter().map(Face::ball).collect();
        let large = large_faces(&balls, &set.bounds);
        let mut inner = Vec::new();
        for (index, face) in (0..).zip(&faces) {
            let trimmed = !face.trims.is_empty();
            let large = large[index as usize];
            if faces.len() > FEW && !large {
                inner.push(index);
            } else if matches!(face.shape, Shape::Mesh(_)) && !trimmed {
                set.meshes.push(index);
            } else if is_simple(&face.shape) && !trimmed {
                let ball = if large { None } else { balls[index as usize] };
                set.simple.push(BoundedFace::new(index, ball));
            } else {
                set.others.push(index);
            }
        }
        let boxes: Vec<Bounds> = inner.iter().map(|i| set.bounds[*i as usize]).collect();
        if !inner.is_empty() {
            set.tree = Bvh::new(&boxes, LEAF).map(|tree| {
                let bounded = |place: &u32| {
                    let index = inner[*place as usize];
                    BoundedFace::new(index, balls[index as usize])
                };
                let inner = tree.leaves().flatten().map(bounded).collect();
                (Arc::new(tree), inner)
            });
        }
        set.has_parts = faces.iter().any(|face| matches!(face.shape, Shape::Mesh(_)));
        set.faces = faces;
        set
    }

    /// The faces.
    #[must_use]
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// A box around each face; not finite for faces without end.
    #[must_use]
    pub fn bounds(&self) -> &[Bounds] {
        &self.bounds
    }

    /// The first crossing of each ray of the block, at t > 0.
    pub fn nearest(&self, rays: &RayBlock, hits: &mut Hits) {
        let one_by_one = !self.others.is_empty() || self.tree.is_some();
        hits.reset(rays.len(), self.has_parts);
        try_simple(&self.faces, &self.simple, rays, hits);
        for &index in &self.meshes {
            self.try_mesh(index, rays, hits);
        }
        if one_by_one {
            try_one_by_one(self, rays, hits, &mut Stack::lend());
        }
    }

    fn try_mesh(&self, index: u32, rays: &RayBlock, hits: &mut Hits) {
        let face = &self.faces[index as usize];
        let Shape::Mesh(mesh) = &face.shape else { return };
        let n = rays.len();
        let scratch = &mut hits.scratch;
        scratch.resize(n);
        to_local(&face.frame, rays, &hits.t, scratch);
        for (i, origin) in scratch.origin_triangles.iter_mut().enumerate() {
            *origin = rays.origin_faces(i).parts_of(index);
        }
        mesh.nearest_block(
            Rays {
                origin: scratch.origin.each_ref().map(|v| &v[..n]),
                direction: scratch.direction.each_ref().map(|v| &v[..n]),
            },
            &scratch.origin_triangles[..n],
            Found {
                t: &mut scratch.t[..n],
                triangle: &mut scratch.triangle[..n],
                u: &mut scratch.u[..n],
                v: &mut scratch.v[..n],
            },
        );
        for i in 0..n {
            if scratch.triangle[i] == NONE {
                continue;
            }
            let t = scratch.t[i];
            if t < hits.t[i] {
                hits.second[i] = hits.t[i];
                hits.t[i] = t;
                hits.face[i] = index;
                hits.part[i] = (scratch.triangle[i], [scratch.u[i], scratch.v[i]]);
            } else {
                hits.second[i] = hits.second[i].min(t);
            }
        }
    }

    /// Tries the faces on one ray that no block is tried on, though they are in no tree.
    #[inline(always)]
    fn try_others(&self, o: Vec3, d: Vec3, origin_faces: &OriginFaces, one: &mut One) {
        for &index in &self.others {
            self.try_face(index, o, d, origin_faces, one);
        }
    }

    /// Tries the faces in the tree on one ray.
    #[inline(always)]
    fn try_tree(&self, o: Vec3, d: Vec3, origin_faces: &OriginFaces, one: &mut One, stack: &mut Stack) {
        if let Some((tree, faces)) = &self.tree {
            let probe = Probe::new(o, d, 0.0);
            let mut walk = Walk::new(tree, &probe, stack);
            while let Some(leaf) = walk.next(one.reach(o)) {
                for face in &faces[tree.places(leaf)] {
                    if face.ball.is_none_or(|ball| ball.meets(o, d)) {
                        self.try_face(face.index, o, d, origin_faces, one);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn try_face(&self, index: u32, o: Vec3, d: Vec3, origin_faces: &OriginFaces, one: &mut One) {
        let face = &self.faces[index as usize];
        if let (Shape::Quadric(quadric), true) = (&face.shape, face.trims.is_empty()) {
            // The most common kind, and short enough to be worked on in place.
            let (p, k) = (face.frame.point_to_local(o), face.frame.direction_to_local(d));
            for t in quadric.crossings(p, k, origin_faces.face.contains(&index)) {
                if t > 0.0 && t < f64::INFINITY {
                    one.meets(index, t, (0, [0.0; 2]));
                }
            }
            return;
        }
        let mut room = [NONE; MOST_ORIGIN_FACES];
        let parts = origin_faces.parts(index, &mut room);
        if let Some(crossing) = face.first(o, d, one.reach(o), parts) {
            one.meets(index, crossing.t, (crossing.part, crossing.uv));
        }
    }

    /// The first crossing of one ray at 0 < t < `reach`, its face, and the distance of the next one, as far as it was
    /// looked for.
    #[must_use]
    pub fn first(&self, o: Vec3, d: Vec3, origin_faces: &OriginFaces, reach: f64) -> Option<(u32, Crossing, f64)> {
        let mut one = One {
            t: reach,
            second: f64::INFINITY,
            face: NONE,
            part: (0, [0.0; 2]),
        };
        for index in self
            .simple
            .iter()
            .map(|simple| simple.index)
            .chain(self.meshes.iter().copied())
        {
            self.try_face(index, o, d, origin_faces, &mut one);
        }
        self.try_others(o, d, origin_faces, &mut one);
        if self.tree.is_some() {
            self.try_tree(o, d, origin_faces, &mut one, &mut Stack::lend());
        }
        let (part, uv) = one.part;
        (one.face != NONE).then_some((one.face, Crossing { t: one.t, part, uv }, one.second))
    }

    /// Calls `visit` with every crossing of a line in a range of distances, face by face.
    pub fn crossings(
        &self,
        o: Vec3,
        d: Vec3,
        range: [f64; 2],
        origin_faces: &OriginFaces,
        mut visit: impl FnMut(u32, Crossing),
    ) {
        let mut look = |index: u32| {
            let mut room = [NONE; MOST_ORIGIN_FACES];
            let parts = origin_faces.parts(index, &mut room);
            self.faces[index as usize].crossings(o, d, range, parts, |crossing| visit(index, crossing));
        };
        self.simple.iter().for_each(|simple| look(simple.index));
        self.meshes.iter().chain(&self.others).copied().for_each(&mut look);
        if let Some((tree, faces)) = &self.tree {
            tree.walk(
                &Probe::new(o, d, range[0]),
                &mut range[1].clone(),
                &mut Stack::lend(),
                |leaf, _| {
                    faces[tree.places(leaf)].iter().for_each(|face| look(face.index));
                },
            );
        }
    }
}

/// The faces that no block is tried on, ray by ray.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn try_one_by_one(set: &FaceSet, rays: &RayBlock, hits: &mut Hits, stack: &mut Stack) {
    for i in 0..rays.len() {
        let mut one = One {
            t: hits.t[i],
            second: hits.second[i],
            face: hits.face[i],
            part: hits.part[i],
        };
        let (o, d, origin_faces) = (rays.origin(i), rays.direction(i), rays.origin_faces(i));
        set.try_others(o, d, &origin_faces, &mut one);
        set.try_tree(o, d, &origin_faces, &mut one, stack);
        (hits.t[i], hits.second[i], hits.face[i], hits.part[i]) = (one.t, one.second, one.face, one.part);
    }
}

/// Of each face whether no tree would rule it out: the largest ones, and those without end.
fn large_faces(balls: &[Option<Ball>], bounds: &[Bounds]) -> Vec<bool> {
    let finite = bounds.iter().copied().filter(|b| b.is_finite());
    let half = finite.fold(Bounds::EMPTY, Bounds::union).sides() * 0.5;
    let least = LARGE * half.dot(half);
    let area = |ball: &Option<Ball>| ball.map_or(f64::INFINITY, |ball| ball.square());
    let areas: Vec<f64> = balls.iter().map(area).collect();
    let mut ranked: Vec<f64> = areas.iter().copied().filter(|a| a.is_finite() && *a >= least).collect();
    ranked.sort_by(f64::total_cmp);
    let least = ranked
        .iter()
        .rev()
        .take(MOST_LARGE)
        .next_back()
        .map_or(f64::INFINITY, |a| *a);
    areas.iter().map(|area| *area >= least).collect()
}

/// Faces in a leaf of the tree of a scene.
const LEAF: usize = 2;

const fn is_simple(shape: &Shape) -> bool {
    match shape {
        Shape::Flat(flat) => !matches!(flat.outline, Outline::Polygon { .. }),
        Shape::Quadric(_) => true,
        Shape::Asphere(_) | Shape::Torus(_) | Shape::Mesh(_) => false,
    }
}

/// The nearest crossing of one ray so far.
struct One {
    t: f64,
    second: f64,
    face: u32,
    part: (u32, [f64; 2]),
}

impl One {
    /// One more crossing.
    #[inline(always)]
    fn meets(&mut self, face: u32, t: f64, part: (u32, [f64; 2])) {
        if t < self.t {
            self.second = self.t;
            (self.t, self.face, self.part) = (t, face, part);
        } else {
            self.second = self.second.min(t);
        }
    }

    /// How far crossings are of interest: those that are tied with the nearest one are.
    #[inline(always)]
    fn reach(&self, o: Vec3) -> f64 {
        self.t + TIE * (o.x.abs() + o.y.abs() + o.z.abs() + self.t)
    }
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, reason = "small numbers")]
pub(crate) mod tests;
