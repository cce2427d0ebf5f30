//! Many faces together: what a block of rays meets first.

use std::sync::Arc;

use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::bounds::Bounds;
use crate::bvh::Bvh;
use crate::face::Face;
use crate::lines::{Leaving, Lines, MOST_LEFT, NONE};
use crate::mesh::{Found, Rays};
use crate::shape::{Crossing, Outline, Shape};
use crate::sweep::try_simple;

/// What the rays of a block meet first. Structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Hits {
    /// Distance of the nearest crossing; +∞ if there is none.
    pub t: Vec<f64>,
    /// Distance of the one after it, as far as it was looked for (see [`Hits::tied`]).
    pub second: Vec<f64>,
    /// Its face.
    pub face: Vec<u32>,
    /// Its part and coordinates, for faces that have them.
    pub part: Vec<(u32, [f64; 2])>,
    /// Whether parts were written since all of them were reset.
    parted: bool,
    scratch: Scratch,
}

/// Rays in the coordinates of a mesh, and what it answers.
#[derive(Clone, Debug, Default)]
struct Scratch {
    origin: [Vec<f64>; 3],
    direction: [Vec<f64>; 3],
    leaving: Vec<[u32; MOST_LEFT]>,
    t: Vec<f64>,
    triangle: Vec<u32>,
    u: Vec<f64>,
    v: Vec<f64>,
}

impl Scratch {
    fn resize(&mut self, n: usize) {
        for list in self
            .origin
            .iter_mut()
            .chain(&mut self.direction)
            .chain([&mut self.t, &mut self.u, &mut self.v])
        {
            list.resize(n, 0.0);
        }
        self.leaving.resize(n, [NONE; MOST_LEFT]);
        self.triangle.resize(n, NONE);
    }
}

/// Two crossings that are nearer to each other than this share of (|o| + t) are looked at more closely: they may be one
/// event. Far above all rounding errors, far below what is built.
pub const TIE: f64 = 1e-9;

impl Hits {
    fn reset(&mut self, n: usize, parted: bool) {
        self.t.clear();
        self.t.resize(n, f64::INFINITY);
        self.second.clear();
        self.second.resize(n, f64::INFINITY);
        self.face.clear();
        self.face.resize(n, NONE);
        if self.parted || parted {
            self.part.clear();
        }
        self.part.resize(n, (0, [0.0; 2]));
        self.parted = parted;
    }

    /// The nearest crossing of ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn crossing(&self, i: usize) -> Crossing {
        let (part, uv) = self.part[i];
        Crossing { t: self.t[i], part, uv }
    }

    /// For each ray whether another crossing may be part of the same event, as [`Hits::tied`] says.
    pub fn ties(&self, lines: &Lines, out: &mut Vec<bool>) {
        find_ties(self, lines, out);
    }

    /// Whether another crossing of ray `i` may be part of the same event.
    #[inline(always)]
    #[must_use]
    pub fn tied(&self, i: usize, o: Vec3) -> bool {
        self.second[i] - self.t[i] <= TIE * (o.x.abs() + o.y.abs() + o.z.abs() + self.t[i])
    }
}

/// Lines in the coordinates of a mesh, and how far each of them is of interest: crossings that are tied with what it met so
/// far are.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn to_local(frame: &Frame, lines: &Lines, met: &[f64], scratch: &mut Scratch) {
    let n = lines.len();
    let [ox, oy, oz] = lines.origin.each_ref().map(|v| &v[..n]);
    let [dx, dy, dz] = lines.direction.each_ref().map(|v| &v[..n]);
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

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn find_ties(hits: &Hits, lines: &Lines, out: &mut Vec<bool>) {
    let n = lines.len();
    out.resize(n, false);
    let out = &mut out[..n];
    let [x, y, z] = lines.origin.each_ref().map(|v| &v[..n]);
    let (first, second) = (&hits.t[..n], &hits.second[..n]);
    for i in 0..n {
        out[i] = second[i] - first[i] <= TIE * (x[i].abs() + y[i].abs() + z[i].abs() + first[i]);
    }
}

/// Up to this number of faces, all of them are tried on every ray; of more, those that a tree does not rule out.
const FEW: usize = 24;

/// All faces of a scene.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
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

impl Assembly {
    /// The faces, in the order of their numbers.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^32 faces")]
    pub fn new(faces: Vec<Face>) -> Self {
        let bounds: Vec<Bounds> = faces.iter().map(Face::bounds).collect();
        let mut assembly = Self {
            bounds,
            ..Self::default()
        };
        let mut inner = Vec::new();
        for (index, face) in (0..).zip(&faces) {
            let trimmed = !face.trims.is_empty();
            if faces.len() > FEW && assembly.bounds[index as usize].is_finite() {
                inner.push(index);
            } else if matches!(face.shape, Shape::Mesh(_)) && !trimmed {
                assembly.meshes.push(index);
            } else if is_simple(&face.shape) && !trimmed {
                assembly.simple.push(index);
            } else {
                assembly.others.push(index);
            }
        }
        let boxes: Vec<Bounds> = inner.iter().map(|i| assembly.bounds[*i as usize]).collect();
        if !inner.is_empty() {
            assembly.tree = Bvh::new(&boxes, LEAF).map(|tree| (Arc::new(tree), inner));
        }
        assembly.faces = faces;
        assembly
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
    pub fn nearest(&self, lines: &Lines, hits: &mut Hits) {
        let one_by_one = !self.others.is_empty() || self.tree.is_some();
        hits.reset(lines.len(), one_by_one || !self.meshes.is_empty());
        try_simple(&self.faces, &self.simple, lines, hits);
        for &index in &self.meshes {
            self.try_mesh(index, lines, hits);
        }
        if !one_by_one {
            return;
        }
        for i in 0..lines.len() {
            let mut one = One {
                t: hits.t[i],
                second: hits.second[i],
                face: hits.face[i],
                part: hits.part[i],
            };
            self.try_one(
                &self.others,
                lines.origin(i),
                lines.direction(i),
                &lines.leaving(i),
                &mut one,
            );
            hits.t[i] = one.t;
            hits.second[i] = one.second;
            hits.face[i] = one.face;
            hits.part[i] = one.part;
        }
    }

    fn try_mesh(&self, index: u32, lines: &Lines, hits: &mut Hits) {
        let face = &self.faces[index as usize];
        let Shape::Mesh(mesh) = &face.shape else { return };
        let n = lines.len();
        let scratch = &mut hits.scratch;
        scratch.resize(n);
        to_local(&face.frame, lines, &hits.t, scratch);
        for (i, left) in scratch.leaving.iter_mut().enumerate() {
            *left = lines.leaving(i).parts_of(index);
        }
        mesh.nearest_block(
            Rays {
                origin: scratch.origin.each_ref().map(|v| &v[..n]),
                direction: scratch.direction.each_ref().map(|v| &v[..n]),
            },
            &scratch.leaving[..n],
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
    fn try_one(&self, list: &[u32], o: Vec3, d: Vec3, leaving: &Leaving, one: &mut One) {
        for &index in list {
            self.try_face(index, o, d, leaving, one);
        }
        if let Some((tree, numbers)) = &self.tree {
            let mut reach = one.reach(o);
            tree.traverse(o, d, 0.0, &mut reach, |primitive, reach| {
                self.try_face(numbers[primitive as usize], o, d, leaving, one);
                *reach = one.reach(o);
            });
        }
    }

    #[inline]
    fn try_face(&self, index: u32, o: Vec3, d: Vec3, leaving: &Leaving, one: &mut One) {
        let mut room = [NONE; MOST_LEFT];
        let parts = leaving.parts(index, &mut room);
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
    pub fn first(&self, o: Vec3, d: Vec3, leaving: &Leaving, reach: f64) -> Option<(u32, Crossing, f64)> {
        let mut one = One {
            t: reach,
            second: f64::INFINITY,
            face: NONE,
            part: (0, [0.0; 2]),
        };
        for list in [&self.simple, &self.meshes] {
            for &index in list {
                self.try_face(index, o, d, leaving, &mut one);
            }
        }
        self.try_one(&self.others, o, d, leaving, &mut one);
        let (part, uv) = one.part;
        (one.face != NONE).then_some((one.face, Crossing { t: one.t, part, uv }, one.second))
    }

    /// Calls `visit` with every crossing of a line in a range of distances, face by face.
    pub fn crossings(
        &self,
        o: Vec3,
        d: Vec3,
        range: [f64; 2],
        leaving: &Leaving,
        mut visit: impl FnMut(u32, Crossing),
    ) {
        let mut look = |index: u32| {
            let mut room = [NONE; MOST_LEFT];
            let parts = leaving.parts(index, &mut room);
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
