//! Many faces together: what a block of rays meets first.

use std::sync::Arc;

use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::bounds::Bounds;
use crate::bvh::Bvh;
use crate::face::Face;
use crate::mesh::{Found, Rays};
use crate::shape::flat::{meet_annulus, meet_rectangle};
use crate::shape::{Crossing, Outline, Shape};

/// No face.
pub const NONE: u32 = u32::MAX;

/// Faces that a ray can start on at once: more surfaces than that never coincide in one point but in corners.
pub const MOST_LEFT: usize = 4;

/// What a ray starts on: faces, and the parts of them, filled up with [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaving {
    /// Faces.
    pub face: [u32; MOST_LEFT],
    /// Part of each face.
    pub part: [u32; MOST_LEFT],
}

impl Default for Leaving {
    fn default() -> Self {
        Self {
            face: [NONE; MOST_LEFT],
            part: [NONE; MOST_LEFT],
        }
    }
}

impl Leaving {
    /// One face more; a ray that starts on more than [`MOST_LEFT`] forgets the rest.
    pub fn add(&mut self, face: u32, part: u32) {
        if let Some(slot) = self.face.iter().position(|f| *f == NONE) {
            (self.face[slot], self.part[slot]) = (face, part);
        }
    }

    /// The parts of `face` that are left, in `room`.
    #[inline]
    pub fn parts<'a>(&self, face: u32, room: &'a mut [u32; MOST_LEFT]) -> &'a [u32] {
        let mut n = 0;
        for slot in 0..MOST_LEFT {
            if self.face[slot] == face {
                room[n] = self.part[slot];
                n += 1;
            }
        }
        &room[..n]
    }
}

/// A block of rays: where they start, where they go, what they start on. Structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    /// Start points, one array per axis \[mm\].
    pub origin: [Vec<f64>; 3],
    /// Unit directions, one array per axis.
    pub direction: [Vec<f64>; 3],
    /// Faces that each ray starts on.
    left: [Vec<u32>; MOST_LEFT],
    /// The parts of them.
    parts: Vec<[u32; MOST_LEFT]>,
}

impl Lines {
    /// Number of rays.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parts.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Start point of ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn origin(&self, i: usize) -> Vec3 {
        Vec3::new(self.origin[0][i], self.origin[1][i], self.origin[2][i])
    }

    /// Direction of ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn direction(&self, i: usize) -> Vec3 {
        Vec3::new(self.direction[0][i], self.direction[1][i], self.direction[2][i])
    }

    /// What ray `i` starts on.
    #[inline(always)]
    #[must_use]
    pub fn leaving(&self, i: usize) -> Leaving {
        Leaving {
            face: std::array::from_fn(|slot| self.left[slot][i]),
            part: self.parts[i],
        }
    }

    /// One ray more.
    #[inline(always)]
    pub fn push(&mut self, o: Vec3, d: Vec3, leaving: Leaving) {
        for (axis, (o, d)) in [(o.x, d.x), (o.y, d.y), (o.z, d.z)].into_iter().enumerate() {
            self.origin[axis].push(o);
            self.direction[axis].push(d);
        }
        for (slot, face) in self.left.iter_mut().zip(leaving.face) {
            slot.push(face);
        }
        self.parts.push(leaving.part);
    }

    /// Puts a ray in the place of ray `i`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, o: Vec3, d: Vec3, leaving: Leaving) {
        for (axis, (o, d)) in [(o.x, d.x), (o.y, d.y), (o.z, d.z)].into_iter().enumerate() {
            self.origin[axis][i] = o;
            self.direction[axis][i] = d;
        }
        for (slot, face) in self.left.iter_mut().zip(leaving.face) {
            slot[i] = face;
        }
        self.parts[i] = leaving.part;
    }

    /// Keeps the first `n` rays.
    pub fn truncate(&mut self, n: usize) {
        for axis in self.origin.iter_mut().chain(&mut self.direction) {
            axis.truncate(n);
        }
        for slot in &mut self.left {
            slot.truncate(n);
        }
        self.parts.truncate(n);
    }
}

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
    fn reset(&mut self, n: usize) {
        self.t.clear();
        self.t.resize(n, f64::INFINITY);
        self.second.clear();
        self.second.resize(n, f64::INFINITY);
        self.face.clear();
        self.face.resize(n, NONE);
        self.part.clear();
        self.part.resize(n, (0, [0.0; 2]));
    }

    /// Puts what is known of ray `from` in the place of ray `to`.
    #[inline(always)]
    pub fn keep(&mut self, from: usize, to: usize) {
        self.t[to] = self.t[from];
        self.second[to] = self.second[from];
        self.face[to] = self.face[from];
        self.part[to] = self.part[from];
    }

    /// The nearest crossing of ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn crossing(&self, i: usize) -> Crossing {
        let (part, uv) = self.part[i];
        Crossing { t: self.t[i], part, uv }
    }

    /// Whether another crossing of ray `i` may be part of the same event.
    #[inline(always)]
    #[must_use]
    pub fn tied(&self, i: usize, o: Vec3) -> bool {
        self.second[i] - self.t[i] <= TIE * (o.x.abs() + o.y.abs() + o.z.abs() + self.t[i])
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
        hits.reset(lines.len());
        try_simple(&self.faces, &self.simple, lines, hits);
        for &index in &self.meshes {
            self.try_mesh(index, lines, hits);
        }
        if self.others.is_empty() && self.tree.is_none() {
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
        for i in 0..n {
            let (o, d) = (lines.origin(i), lines.direction(i));
            let (p, k) = (face.frame.point_to_local(o), face.frame.direction_to_local(d));
            for (axis, (p, k)) in [(p.x, k.x), (p.y, k.y), (p.z, k.z)].into_iter().enumerate() {
                scratch.origin[axis][i] = p;
                scratch.direction[axis][i] = k;
            }
            scratch.t[i] = hits.t[i] + TIE * (o.x.abs() + o.y.abs() + o.z.abs() + hits.t[i]);
            let mut room = [NONE; MOST_LEFT];
            lines.leaving(i).parts(index, &mut room);
            scratch.leaving[i] = room;
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

/// Tries a block of rays on the faces `which`, one face after the other, several rays at a time.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn try_simple(faces: &[Face], which: &[u32], lines: &Lines, hits: &mut Hits) {
    for &index in which {
        let face = &faces[index as usize];
        match &face.shape {
            Shape::Flat(flat) => match flat.outline {
                Outline::Annulus { inner, outer } => sweep(&face.frame, index, lines, hits, |o, d, leaving| {
                    [meet_annulus(inner, outer, o, d, leaving), f64::INFINITY]
                }),
                Outline::Rectangle { width, height } => sweep(&face.frame, index, lines, hits, |o, d, leaving| {
                    [
                        meet_rectangle([0.5 * width, 0.5 * height], o, d, leaving),
                        f64::INFINITY,
                    ]
                }),
                Outline::Whole | Outline::Polygon { .. } => sweep(&face.frame, index, lines, hits, |o, d, leaving| {
                    [meet_annulus(0.0, f64::INFINITY, o, d, leaving), f64::INFINITY]
                }),
            },
            Shape::Quadric(quadric) => sweep(&face.frame, index, lines, hits, |o, d, leaving| {
                quadric.crossings(o, d, leaving)
            }),
            Shape::Asphere(_) | Shape::Torus(_) | Shape::Mesh(_) => {}
        }
    }
}

#[inline(always)]
fn sweep(frame: &Frame, index: u32, lines: &Lines, hits: &mut Hits, meet: impl Fn(Vec3, Vec3, bool) -> [f64; 2]) {
    let n = lines.len();
    let [ox, oy, oz] = lines.origin.each_ref().map(|v| &v[..n]);
    let [dx, dy, dz] = lines.direction.each_ref().map(|v| &v[..n]);
    let [l0, l1, l2, l3] = lines.left.each_ref().map(|v| &v[..n]);
    let (best, second, owner) = (&mut hits.t[..n], &mut hits.second[..n], &mut hits.face[..n]);
    for i in 0..n {
        let o = frame.point_to_local(Vec3::new(ox[i], oy[i], oz[i]));
        let d = frame.direction_to_local(Vec3::new(dx[i], dy[i], dz[i]));
        let left = (l0[i] == index) | (l1[i] == index) | (l2[i] == index) | (l3[i] == index);
        for t in meet(o, d, left) {
            let nearer = (t > 0.0) & (t < best[i]);
            let next = (t > 0.0) & (t < second[i]);
            second[i] = if nearer {
                best[i]
            } else if next {
                t
            } else {
                second[i]
            };
            owner[i] = if nearer { index } else { owner[i] };
            best[i] = if nearer { t } else { best[i] };
        }
    }
}
