//! Many faces together: what a block of rays meets first.

use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::face::Face;
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
    /// What each ray starts on.
    pub leaving: Vec<Leaving>,
}

impl Lines {
    /// Number of rays.
    #[must_use]
    pub fn len(&self) -> usize {
        self.leaving.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.leaving.is_empty()
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

    /// One ray more.
    #[inline(always)]
    pub fn push(&mut self, o: Vec3, d: Vec3, leaving: Leaving) {
        for (axis, (o, d)) in [(o.x, d.x), (o.y, d.y), (o.z, d.z)].into_iter().enumerate() {
            self.origin[axis].push(o);
            self.direction[axis].push(d);
        }
        self.leaving.push(leaving);
    }

    /// Puts a ray in the place of ray `i`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, o: Vec3, d: Vec3, leaving: Leaving) {
        for (axis, (o, d)) in [(o.x, d.x), (o.y, d.y), (o.z, d.z)].into_iter().enumerate() {
            self.origin[axis][i] = o;
            self.direction[axis][i] = d;
        }
        self.leaving[i] = leaving;
    }

    /// Keeps the first `n` rays.
    pub fn truncate(&mut self, n: usize) {
        for axis in self.origin.iter_mut().chain(&mut self.direction) {
            axis.truncate(n);
        }
        self.leaving.truncate(n);
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

/// All faces of a scene.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    faces: Vec<Face>,
    /// Faces that a whole block is tried on at once, and the others.
    simple: Vec<u32>,
    others: Vec<u32>,
}

impl Assembly {
    /// The faces, in the order of their numbers.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^32 faces")]
    pub fn new(faces: Vec<Face>) -> Self {
        let (simple, others) = (0..faces.len() as u32).partition(|i| {
            let face = &faces[*i as usize];
            let flat = |flat: &crate::shape::Flat| !matches!(flat.outline, Outline::Polygon { .. });
            face.trims.is_empty()
                && match &face.shape {
                    Shape::Flat(shape) => flat(shape),
                    Shape::Quadric(_) => true,
                    Shape::Asphere(_) | Shape::Torus(_) => false,
                }
        });
        Self { faces, simple, others }
    }

    /// The faces.
    #[must_use]
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The first crossing of each ray of the block, at t > 0.
    pub fn nearest(&self, lines: &Lines, hits: &mut Hits) {
        hits.reset(lines.len());
        try_simple(&self.faces, &self.simple, lines, hits);
        for &index in &self.others {
            let face = &self.faces[index as usize];
            for i in 0..lines.len() {
                let (o, d) = (lines.origin(i), lines.direction(i));
                let mut room = [0; MOST_LEFT];
                let leaving = lines.leaving[i].parts(index, &mut room);
                let reach = hits.t[i] + TIE * (o.x.abs() + o.y.abs() + o.z.abs() + hits.t[i]);
                face.crossings(o, d, [0.0, reach], leaving, |crossing| {
                    if crossing.t > 0.0 {
                        if crossing.t < hits.t[i] {
                            hits.second[i] = hits.t[i];
                            hits.t[i] = crossing.t;
                            hits.face[i] = index;
                            hits.part[i] = (crossing.part, crossing.uv);
                        } else {
                            hits.second[i] = hits.second[i].min(crossing.t);
                        }
                    }
                });
            }
        }
    }

    /// The first crossing of one ray at 0 < t < `reach`, its face, and the distance of the next one.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^32 faces")]
    pub fn first(&self, o: Vec3, d: Vec3, leaving: &Leaving, reach: f64) -> Option<(u32, Crossing, f64)> {
        let mut found: Option<(u32, Crossing)> = None;
        let (mut best, mut second) = (reach, f64::INFINITY);
        let mut room = [0; MOST_LEFT];
        let origin = o.x.abs() + o.y.abs() + o.z.abs();
        for (index, face) in self.faces.iter().enumerate() {
            let index = index as u32;
            let parts = leaving.parts(index, &mut room);
            face.crossings(o, d, [0.0, best + TIE * (origin + best)], parts, |crossing| {
                if crossing.t > 0.0 && crossing.t < best {
                    second = if found.is_some() { best } else { f64::INFINITY };
                    best = crossing.t;
                    found = Some((index, crossing));
                } else if crossing.t > 0.0 && found.is_some() {
                    second = second.min(crossing.t);
                }
            });
        }
        found.map(|(index, crossing)| (index, crossing, second))
    }

    /// Calls `visit` with every crossing of a line in a range of distances, face by face.
    #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^32 faces")]
    pub fn crossings(&self, o: Vec3, d: Vec3, range: [f64; 2], leaving: &Leaving, mut visit: impl FnMut(u32, Crossing)) {
        let mut room = [0; MOST_LEFT];
        for (index, face) in self.faces.iter().enumerate() {
            let index = index as u32;
            let parts = leaving.parts(index, &mut room);
            face.crossings(o, d, range, parts, |crossing| visit(index, crossing));
        }
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
                    [meet_rectangle([0.5 * width, 0.5 * height], o, d, leaving), f64::INFINITY]
                }),
                Outline::Whole | Outline::Polygon { .. } => sweep(&face.frame, index, lines, hits, |o, d, leaving| {
                    [meet_annulus(0.0, f64::INFINITY, o, d, leaving), f64::INFINITY]
                }),
            },
            Shape::Quadric(quadric) => sweep(&face.frame, index, lines, hits, |o, d, leaving| {
                quadric.crossings(o, d, leaving)
            }),
            Shape::Asphere(_) | Shape::Torus(_) => {}
        }
    }
}

#[inline(always)]
fn sweep(
    frame: &Frame,
    index: u32,
    lines: &Lines,
    hits: &mut Hits,
    meet: impl Fn(Vec3, Vec3, bool) -> [f64; 2],
) {
    let n = lines.len();
    let [ox, oy, oz] = lines.origin.each_ref().map(|v| &v[..n]);
    let [dx, dy, dz] = lines.direction.each_ref().map(|v| &v[..n]);
    let leaving = &lines.leaving[..n];
    let (best, second, owner) = (&mut hits.t[..n], &mut hits.second[..n], &mut hits.face[..n]);
    for i in 0..n {
        let o = frame.point_to_local(Vec3::new(ox[i], oy[i], oz[i]));
        let d = frame.direction_to_local(Vec3::new(dx[i], dy[i], dz[i]));
        let [a, b, c, e] = leaving[i].face;
        let left = (a == index) | (b == index) | (c == index) | (e == index);
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
