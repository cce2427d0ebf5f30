//! A block of rays against faces of simple shapes, several rays at a time.

use std::ops::Range;

use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::face::Face;
use crate::hits::Hits;
use crate::ray_block::RayBlock;
use crate::shape::flat::{Annulus, Rectangle};
use crate::shape::{Outline, Quadric, Shape};

/// Rays that are tried on all simple faces before the next ones are: what they need stays in the cache of first level.
const CHUNK: usize = 256;

/// Tries a block of rays on the faces `which`, several rays at a time.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn try_simple(faces: &[Face], which: &[u32], block: &RayBlock, hits: &mut Hits) {
    for start in (0..block.len()).step_by(CHUNK) {
        let rays = start..(start + CHUNK).min(block.len());
        for &index in which {
            let face = &faces[index as usize];
            let frame = &face.frame;
            match &face.shape {
                Shape::Flat(flat) => match flat.outline {
                    Outline::Annulus { inner, outer } => {
                        sweep(frame, index, block, hits, &rays, &Annulus { inner, outer });
                    }
                    Outline::Rectangle { width, height } => {
                        let half = [0.5 * width, 0.5 * height];
                        sweep(frame, index, block, hits, &rays, &Rectangle { half });
                    }
                    Outline::Whole | Outline::Polygon { .. } => sweep(frame, index, block, hits, &rays, &Annulus::ALL),
                },
                Shape::Quadric(quadric) => sweep(frame, index, block, hits, &rays, quadric),
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
    fn crossings(&self, o: Vec3, d: Vec3, starts_on: bool) -> [f64; 2];
}

impl Simple for Annulus {
    #[inline(always)]
    fn crossings(&self, o: Vec3, d: Vec3, starts_on: bool) -> [f64; 2] {
        [self.crossing(o, d, starts_on), f64::INFINITY]
    }
}

impl Simple for Rectangle {
    #[inline(always)]
    fn crossings(&self, o: Vec3, d: Vec3, starts_on: bool) -> [f64; 2] {
        [self.crossing(o, d, starts_on), f64::INFINITY]
    }
}

impl Simple for Quadric {
    #[inline(always)]
    fn crossings(&self, o: Vec3, d: Vec3, starts_on: bool) -> [f64; 2] {
        self.crossings(o, d, starts_on)
    }
}

#[inline(always)]
fn sweep(frame: &Frame, index: u32, block: &RayBlock, hits: &mut Hits, rays: &Range<usize>, shape: &impl Simple) {
    if frame.is_straight() {
        sweep_turned::<false>(frame, index, block, hits, rays, shape);
    } else {
        sweep_turned::<true>(frame, index, block, hits, rays, shape);
    }
}

#[inline(always)]
fn sweep_turned<const TURNED: bool>(
    frame: &Frame,
    index: u32,
    block: &RayBlock,
    hits: &mut Hits,
    rays: &Range<usize>,
    shape: &impl Simple,
) {
    let n = rays.len();
    let [ox, oy, oz] = block.origin.each_ref().map(|v| &v[rays.clone()][..n]);
    let [dx, dy, dz] = block.direction.each_ref().map(|v| &v[rays.clone()][..n]);
    let [l0, l1, l2, l3] = block.faces().map(|v| &v[rays.clone()][..n]);
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
        let starts_on = (l0[i] == index) | (l1[i] == index) | (l2[i] == index) | (l3[i] == index);
        let (mut first, mut next, mut face) = (best[i], second[i], owner[i]);
        for t in shape.crossings(o, d, starts_on) {
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
