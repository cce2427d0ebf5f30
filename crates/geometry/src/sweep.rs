//! Many rays on one face, several at a time.

use std::ops::Range;

use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::assembly::Hits;
use crate::face::Face;
use crate::lines::Lines;
use crate::shape::flat::{Annulus, Rectangle};
use crate::shape::{Crossing, Outline, Quadric, Shape};

/// Rays that are tried on all simple faces before the next ones are: what they need stays in the cache of first level.
const CHUNK: usize = 256;

/// Tries a block of rays on the faces `which`, several rays at a time.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn try_simple(faces: &[Face], which: &[u32], lines: &Lines, hits: &mut Hits) {
    for start in (0..lines.len()).step_by(CHUNK) {
        let rays = start..(start + CHUNK).min(lines.len());
        for &index in which {
            let face = &faces[index as usize];
            let frame = &face.frame;
            match &face.shape {
                Shape::Flat(flat) => match flat.outline {
                    Outline::Annulus { inner, outer } => {
                        sweep(frame, index, lines, hits, &rays, &Annulus { inner, outer });
                    }
                    Outline::Rectangle { width, height } => {
                        let half = [0.5 * width, 0.5 * height];
                        sweep(frame, index, lines, hits, &rays, &Rectangle { half });
                    }
                    Outline::Whole | Outline::Polygon { .. } => sweep(frame, index, lines, hits, &rays, &Annulus::ALL),
                },
                Shape::Quadric(quadric) => sweep(frame, index, lines, hits, &rays, quadric),
                Shape::Asphere(_) | Shape::Torus(_) | Shape::Mesh(_) => {}
            }
        }
    }
}

/// A surface that a line crosses twice at most.
///
/// Its method is inlined into loops for several instruction sets; a closure would be compiled for the least of them.
trait Simple {
    /// The distances of the crossings, +∞ in place of one that is none.
    fn crossings(&self, o: Vec3, d: Vec3, leaving: bool) -> [f64; 2];
}

impl Simple for Annulus {
    #[inline(always)]
    fn crossings(&self, o: Vec3, d: Vec3, leaving: bool) -> [f64; 2] {
        [self.crossing(o, d, leaving), f64::INFINITY]
    }
}

impl Simple for Rectangle {
    #[inline(always)]
    fn crossings(&self, o: Vec3, d: Vec3, leaving: bool) -> [f64; 2] {
        [self.crossing(o, d, leaving), f64::INFINITY]
    }
}

impl Simple for Quadric {
    #[inline(always)]
    fn crossings(&self, o: Vec3, d: Vec3, leaving: bool) -> [f64; 2] {
        self.crossings(o, d, leaving)
    }
}

#[inline(always)]
fn sweep(frame: &Frame, index: u32, lines: &Lines, hits: &mut Hits, rays: &Range<usize>, shape: &impl Simple) {
    if frame.is_straight() {
        sweep_turned::<false>(frame, index, lines, hits, rays, shape);
    } else {
        sweep_turned::<true>(frame, index, lines, hits, rays, shape);
    }
}

#[inline(always)]
fn sweep_turned<const TURNED: bool>(
    frame: &Frame,
    index: u32,
    lines: &Lines,
    hits: &mut Hits,
    rays: &Range<usize>,
    shape: &impl Simple,
) {
    let n = rays.len();
    let [ox, oy, oz] = lines.origin.each_ref().map(|v| &v[rays.clone()][..n]);
    let [dx, dy, dz] = lines.direction.each_ref().map(|v| &v[rays.clone()][..n]);
    let [l0, l1, l2, l3] = lines.left().map(|v| &v[rays.clone()][..n]);
    let (best, second, owner) = (
        &mut hits.t[rays.clone()][..n],
        &mut hits.second[rays.clone()][..n],
        &mut hits.face[rays.clone()][..n],
    );
    for i in 0..n {
        let (mut o, mut d) = (Vec3::new(ox[i], oy[i], oz[i]), Vec3::new(dx[i], dy[i], dz[i]));
        o = o - frame.origin;
        if TURNED {
            (o, d) = (frame.direction_to_local(o), frame.direction_to_local(d));
        }
        let left = (l0[i] == index) | (l1[i] == index) | (l2[i] == index) | (l3[i] == index);
        let (mut first, mut next, mut face) = (best[i], second[i], owner[i]);
        for t in shape.crossings(o, d, left) {
            // Neither behind nor NaN.
            let t = if t > 0.0 { t } else { f64::INFINITY };
            face = if t < first { index } else { face };
            next = least(next, if t < first { first } else { t });
            first = least(first, t);
        }
        (best[i], second[i], owner[i]) = (first, next, face);
    }
}

/// The lesser of two numbers that are not NaN: one instruction, as `f64::min` is not.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// A vector for each of many rays, one array per axis.
pub type Vectors = [Vec<f64>; 3];

/// Puts values into a list in place of what it held.
pub fn fill<T>(list: &mut Vec<T>, values: impl Iterator<Item = T>) {
    list.clear();
    list.extend(values);
}

/// Puts some vectors of many into lists in place of what those held.
pub fn gather(into: &mut Vectors, from: &Vectors, which: &[u32]) {
    for (list, values) in into.iter_mut().zip(from) {
        fill(list, which.iter().map(|i| values[*i as usize]));
    }
}

/// The points at which lines meet a face, settled on it, and the normals there: for each line what [`Face::foot`] says.
/// `points` holds the start points on entry \[mm\], `t` the distances \[mm\], `parts` the triangles of a mesh that are met;
/// the lists are of one length.
pub fn feet(face: &Face, points: &mut Vectors, directions: &Vectors, t: &[f64], parts: &[u32], normals: &mut Vectors) {
    for list in normals.iter_mut() {
        list.resize(t.len(), 0.0);
    }
    match &face.shape {
        Shape::Flat(_) => feet_on(face, &Plane, points, directions, t, normals),
        Shape::Quadric(quadric) => feet_on(face, quadric, points, directions, t, normals),
        Shape::Mesh(mesh) => {
            let mut heights = vec![0.0; t.len()];
            for (i, part) in parts.iter().enumerate() {
                let (n, height) = mesh.plane(*part);
                (normals[0][i], normals[1][i], normals[2][i]) = (n.x, n.y, n.z);
                heights[i] = height;
            }
            feet_in_planes(face, points, directions, t, normals, &heights);
        }
        Shape::Asphere(_) | Shape::Torus(_) => {
            for (i, t) in t.iter().enumerate() {
                let [o, d] = [&*points, directions].map(|v| Vec3::new(v[0][i], v[1][i], v[2][i]));
                let crossing = Crossing {
                    t: *t,
                    ..Crossing::default()
                };
                let foot = face.foot(o, d, &crossing);
                (points[0][i], points[1][i], points[2][i]) = (foot.point.x, foot.point.y, foot.point.z);
                (normals[0][i], normals[1][i], normals[2][i]) = (foot.normal.x, foot.normal.y, foot.normal.z);
            }
        }
    }
}

/// Each line meets a plane of its own, n·p = `heights`, given with its normal in the coordinates of the face.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn feet_in_planes(
    face: &Face,
    points: &mut Vectors,
    directions: &Vectors,
    t: &[f64],
    normals: &mut Vectors,
    heights: &[f64],
) {
    let n = t.len();
    let [px, py, pz] = points.each_mut().map(|v| &mut v[..n]);
    let [dx, dy, dz] = directions.each_ref().map(|v| &v[..n]);
    let [nx, ny, nz] = normals.each_mut().map(|v| &mut v[..n]);
    let (heights, frame) = (&heights[..n], &face.frame);
    let sign = if face.flipped { -1.0 } else { 1.0 };
    for i in 0..n {
        let (o, d) = (Vec3::new(px[i], py[i], pz[i]), Vec3::new(dx[i], dy[i], dz[i]));
        let normal = Vec3::new(nx[i], ny[i], nz[i]);
        let p = frame.point_to_local(o) + frame.direction_to_local(d) * t[i];
        let p = frame.point_to_world(p - normal * (p.dot(normal) - heights[i]));
        let normal = frame.direction_to_world(normal);
        (px[i], py[i], pz[i]) = (p.x, p.y, p.z);
        (nx[i], ny[i], nz[i]) = (sign * normal.x, sign * normal.y, sign * normal.z);
    }
}

/// A surface whose points are settled by its equation.
trait Settled {
    /// The point of the surface next to o + t d, and the normal there; everything in the world.
    fn foot(&self, frame: &Frame, o: Vec3, d: Vec3, t: f64) -> (Vec3, Vec3);
}

/// The plane z = 0 of a frame.
struct Plane;

impl Settled for Plane {
    #[inline(always)]
    fn foot(&self, frame: &Frame, o: Vec3, d: Vec3, t: f64) -> (Vec3, Vec3) {
        let p = o + d * t;
        (p - frame.z * (p - frame.origin).dot(frame.z), frame.z)
    }
}

impl Settled for Quadric {
    #[inline(always)]
    fn foot(&self, frame: &Frame, o: Vec3, d: Vec3, t: f64) -> (Vec3, Vec3) {
        let (p, n) = self.settle(frame.point_to_local(o) + frame.direction_to_local(d) * t);
        (frame.point_to_world(p), frame.direction_to_world(n))
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn feet_on<S: Settled>(
    face: &Face,
    shape: &S,
    points: &mut Vectors,
    directions: &Vectors,
    t: &[f64],
    normals: &mut Vectors,
) {
    let n = t.len();
    let [px, py, pz] = points.each_mut().map(|v| &mut v[..n]);
    let [dx, dy, dz] = directions.each_ref().map(|v| &v[..n]);
    let [nx, ny, nz] = normals.each_mut().map(|v| &mut v[..n]);
    let sign = if face.flipped { -1.0 } else { 1.0 };
    for i in 0..n {
        let (o, d) = (Vec3::new(px[i], py[i], pz[i]), Vec3::new(dx[i], dy[i], dz[i]));
        let (p, normal) = shape.foot(&face.frame, o, d, t[i]);
        (px[i], py[i], pz[i]) = (p.x, p.y, p.z);
        (nx[i], ny[i], nz[i]) = (sign * normal.x, sign * normal.y, sign * normal.z);
    }
}
