//! A ray as the boxes see it: in f32, and never too short.
//!
//! The slab test of Kay and Kajiya (1986) asks where the ray enters the last of three slabs and leaves the first. Here
//! all roundings err towards a hit, so that no box that the exact ray meets is missed. With u = 2⁻²⁴:
//!
//! 1. Boxes are rounded outward (`Bounds::outward`), the origin o both ways to o⁻ < o < o⁺, 1/|d| both ways to r⁻ and r⁺.
//!    For d > 0 the ray enters at (lo − o)/d ≥ (lo − o⁺) r⁻ if that is positive, and leaves at (hi − o)/d ≤ (hi − o⁻) r⁺.
//!    For d < 0 the slab is entered through hi, and o⁻ and o⁺ change places.
//! 2. The subtraction rounds: fl(lo − o⁺) ≤ (1 + u)(lo − o⁺), fl(hi − o⁻) ≥ (1 − u)(hi − o⁻). For the ray to leave no
//!    earlier than it enters it suffices that r⁺ ≥ (1 + 3u)/|d|, as (1 − u)(1 + 3u) ≥ 1 + u for u ≤ 1/3. The code takes
//!    1 + 4u; the fourth u pays for the rounding of r⁺ itself.
//! 3. The product rounds to nearest, which is monotone: if its exact operands are in order, so are its results, also
//!    where they underflow or overflow.
//! 4. A ray that enters before its start has a product ≤ 0 of whatever size; the interval starts at 0.
//! 5. If d = 0, r⁻ is the largest finite number and r⁺ is infinite. Outside the slab the ray leaves at −∞: a miss. Inside
//!    it enters at a number ≤ 0 and leaves at +∞. On a face hi − o⁻ may be 0, and 0 · ∞ = NaN, which the comparison below
//!    drops: that slab then does not bound the ray.
//!
//! A start other than t = 0 moves the origin along the ray; o⁻ and o⁺ hold the rounding of that move too.

use etendue_math::Vec3;

use super::WIDTH;
use crate::bounds::round_up;

/// What f64 may have lost, as a part of the distance from the origin: here by moving the start, in the tests of the
/// primitives by finding t. Either is a few roundings of 2⁻⁵³ each.
const SLACK: f64 = 16.0 * f64::EPSILON;

/// A ray prepared for boxes: see the head of this file.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// Rows of the planes through which the ray enters and leaves the slab of each axis.
    rows: [[usize; 2]; 3],
    /// The origin for either plane.
    origin: [[f32; 2]; 3],
    /// The reciprocal of the direction for either plane, with its sign.
    inverse: [[f32; 2]; 3],
    /// Boxes count t from here.
    start: f64,
    finite: bool,
}

impl Probe {
    /// The ray o + t d from t = `t_lo` on, which must be finite.
    #[inline(always)]
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "rounded outward afterwards")]
    pub fn new(o: Vec3, d: Vec3, t_lo: f64) -> Self {
        let axis = |axis: usize, o: f64, d: f64| {
            let moved = o + t_lo * d;
            let error = (o.abs() + (t_lo * d).abs()) * SLACK;
            let (below, above) = (((moved - error) as f32).next_down(), ((moved + error) as f32).next_up());
            let near = (1.0 / d) as f32;
            let far = ((1.0 / d) * (1.0 + 2.0 * f64::from(f32::EPSILON))) as f32;
            if d.is_sign_negative() {
                ([axis + 3, axis], [below, above], [near.next_up(), far.next_down()])
            } else {
                ([axis, axis + 3], [above, below], [near.next_down(), far.next_up()])
            }
        };
        let [x, y, z] = [axis(0, o.x, d.x), axis(1, o.y, d.y), axis(2, o.z, d.z)];
        Self {
            rows: [x.0, y.0, z.0],
            origin: [x.1, y.1, z.1],
            inverse: [x.2, y.2, z.2],
            start: t_lo,
            finite: (0.0 * (o.x + o.y + o.z) + 0.0 * (d.x + d.y + d.z) + 0.0 * t_lo) == 0.0,
        }
    }

    /// The end of the ray for boxes; None if nothing is left of it.
    #[inline(always)]
    #[must_use]
    pub fn limit(&self, t_max: f64) -> Option<f32> {
        let length = t_max - self.start;
        (self.finite && length >= 0.0).then(|| round_up(length + t_max.abs() * SLACK).next_up())
    }

    /// Where the ray enters each of eight boxes, at 0 or later, and a bit for each that it meets before `limit`.
    ///
    /// `if a > b { a } else { b }` is one instruction, and b if a is NaN.
    #[inline(always)]
    #[must_use]
    pub fn enter(&self, planes: &[[f32; WIDTH]; 6], limit: f32) -> ([f32; WIDTH], u32) {
        let (mut enter, mut leave) = ([0.0_f32; WIDTH], [limit; WIDTH]);
        for axis in 0..3 {
            let [near, far] = self.rows[axis].map(|row| &planes[row]);
            let (origin, inverse) = (self.origin[axis], self.inverse[axis]);
            for i in 0..WIDTH {
                let a = (near[i] - origin[0]) * inverse[0];
                let b = (far[i] - origin[1]) * inverse[1];
                enter[i] = if a > enter[i] { a } else { enter[i] };
                leave[i] = if b < leave[i] { b } else { leave[i] };
            }
        }
        let mut hits = 0;
        for i in 0..WIDTH {
            hits |= u32::from(enter[i] <= leave[i]) << i;
        }
        (enter, hits)
    }
}
