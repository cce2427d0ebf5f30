//! Many faces together: what a block of rays meets first.

use std::sync::Arc;

use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::bounds::Bounds;
use crate::bvh::Bvh;
use crate::face::Face;
use crate::hits::{Hits, MeshRays, TIE};
use crate::intersect_block::try_simple;
use crate::mesh::{Found, Rays};
use crate::origin_faces::{MOST_ORIGIN_FACES, NONE, OriginFaces};
use crate::ray_block::RayBlock;
use crate::shape::{Crossing, Outline, Shape};

/// Rays in the coordinates of a mesh, and how far each of them is of interest: crossings that are tied with what it met so
/// far are.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn to_local(frame: &Frame, rays: &RayBlock, met: &[f64], scratch: &mut MeshRays) {
    let n = rays.len();
    let [ox, oy, oz] = rays.origin.each_ref().map(|v| &v[..n]);
    let [dx, dy, dz] = rays.direction.each_ref().map(|v| &v[..n]);
    let [px, py, pz] = scratch.origin.each_mut().map(|v| &mut v[..n]);
    let [kx, ky, kz] = scratch.direction.each_mut().map(|v| &mut v[..n]);
    let (met, reach) = (&met[..n], &mut scratch.t[..n]);
    for i in 0..n {
        let (o, d) = (Vec3::new(ox[i], oy[i], oz[i]), Vec3::new(dx[i], dy[i], dz[i]));
        let (p, k) = (frame.point_to_local(o), frame.direction_to_local(d));
        (px[i], py[i], pz[i]) = (p.x, p.y, p.z);
        (kx[i], ky[i], kz[i]) = (k.x, k.y, k.z);
        reach[i] = met[i] + TIE * (o.x.abs() + o.y.abs() + o.z.abs() + met[i]);
    }
}

/// Up to this number of faces, all of them are tried on every ray; of more, those that a tree does not rule out.
const FEW: usize = 24;

/// All faces of a scene.
#[derive(Clone, Debug, Default)]
pub struct FaceSet {
    faces: Vec<Face>,
    bounds: Vec<Bounds>,
    /// Faces that a whole block is tried on at once.
    simple: Vec<u32>,
    /// Meshes, which a whole block is sent through.
    meshes: Vec<u32>,
    /// Faces that are tried ray by ray.
    others: Vec<u32>,
    /// Faces behind a tree, and their numbers.
    tree: Option<(Arc<Bvh>, Vec<u32>)>,
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
        let mut inner = Vec::new();
        for (index, face) in (0..).zip(&faces) {
            let trimmed = !face.trims.is_empty();
            if faces.len() > FEW && set.bounds[index as usize].is_finite() {
                inner.push(index);
            } else if matches!(face.shape, Shape::Mesh(_)) && !trimmed {
                set.meshes.push(index);
            } else if is_simple(&face.shape) && !trimmed {
                set.simple.push(index);
            } else {
                set.others.push(index);
            }
        }
        let boxes: Vec<Bounds> = inner.iter().map(|i| set.bounds[*i as usize]).collect();
        if !inner.is_empty() {
            set.tree = Bvh::new(&boxes, LEAF).map(|tree| (Arc::new(tree), inner));
        }
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
        hits.reset(rays.len(), one_by_one || !self.meshes.is_empty());
        try_simple(&self.faces, &self.simple, rays, hits);
        for &index in &self.meshes {
            self.try_mesh(index, rays, hits);
        }
        if !one_by_one {
            return;
        }
        for i in 0..rays.len() {
            let mut one = One {
                t: hits.t[i],
                second: hits.second[i],
                face: hits.face[i],
                part: hits.part[i],
            };
            self.try_one(
                &self.others,
                rays.origin(i),
                rays.direction(i),
                &rays.origin_faces(i),
                &mut one,
            );
            hits.t[i] = one.t;
            hits.second[i] = one.second;
            hits.face[i] = one.face;
            hits.part[i] = one.part;
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

    /// Tries faces on one ray: a list, and those in the tree.
    fn try_one(&self, list: &[u32], o: Vec3, d: Vec3, origin_faces: &OriginFaces, one: &mut One) {
        for &index in list {
            self.try_face(index, o, d, origin_faces, one);
        }
        if let Some((tree, numbers)) = &self.tree {
            let mut reach = one.reach(o);
            tree.traverse(o, d, 0.0, &mut reach, |primitive, reach| {
                self.try_face(numbers[primitive as usize], o, d, origin_faces, one);
                *reach = one.reach(o);
            });
        }
    }

    #[inline]
    fn try_face(&self, index: u32, o: Vec3, d: Vec3, origin_faces: &OriginFaces, one: &mut One) {
        let mut room = [NONE; MOST_ORIGIN_FACES];
        let parts = origin_faces.parts(index, &mut room);
        if let Some(crossing) = self.faces[index as usize].first(o, d, one.reach(o), parts) {
            if crossing.t < one.t {
                one.second = one.t;
                one.t = crossing.t;
                one.face = index;
                one.part = (crossing.part, crossing.uv);
            } else {
                one.second = one.second.min(crossing.t);
            }
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
        for list in [&self.simple, &self.meshes] {
            for &index in list {
                self.try_face(index, o, d, origin_faces, &mut one);
            }
        }
        self.try_one(&self.others, o, d, origin_faces, &mut one);
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
        for list in [&self.simple, &self.meshes, &self.others] {
            list.iter().copied().for_each(&mut look);
        }
        if let Some((tree, numbers)) = &self.tree {
            let mut reach = range[1];
            tree.traverse(o, d, range[0], &mut reach, |primitive, _| {
                look(numbers[primitive as usize]);
            });
        }
    }
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
    /// How far crossings are of interest: those that are tied with the nearest one are.
    #[inline(always)]
    fn reach(&self, o: Vec3) -> f64 {
        self.t + TIE * (o.x.abs() + o.y.abs() + o.z.abs() + self.t)
    }
}
