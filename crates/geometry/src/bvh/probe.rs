//! A ray as the boxes see it: in f32, and never too short.
//!
//! The slab test of Kay and Kajiya (1986, `[KayKajiya1986]`) asks whether the ray enters the last of three slabs before it
//! leaves the first. Here all roundings err towards a hit, so that no box that the exact ray meets is missed. With
//! u = 2⁻²⁴:
//!
//! 1. Boxes are rounded outward (`Bounds::outward`). The origin o is moved by more than 2u |o| to o⁻ and o⁺ and the
//!    reciprocal of |d| to r⁻ = (1 − 2u)/|d| and r⁺ = (1 + 8u)/|d| before they round to f32, which is u each. For d > 0 the
//!    ray enters at (lo − o)/d ≥ (lo − o⁺) r⁻ if that is positive, and leaves at (hi − o)/d ≤ (hi − o⁻) r⁺. For d < 0 the
//!    slab is entered through hi, and o⁻ and o⁺ change places.
//! 2. The subtraction rounds: fl(lo − o⁺) ≤ (1 + u)(lo − o⁺), fl(hi − o⁻) ≥ (1 − u)(hi − o⁻). So for the ray to leave no
//!    earlier than it enters it suffices that r⁺/r⁻ ≥ (1 + u)/(1 − u), about 1 + 2u; after rounding it is 1 + 8u or more.
//!    Likewise the end of the ray is moved by 8u, against (1 + u)² in the entry.
//! 3. The product rounds to nearest, which is monotone: if its exact operands are in order, so are its results, also
//!    where they underflow or overflow.
//! 4. A ray that enters before its start has a product ≤ 0 of whatever size; the interval starts at 0.
//! 5. If d = 0, r⁻ is the largest finite number and r⁺ is infinite. Outside the slab the ray leaves at −∞: a miss. Inside
//!    it enters at a number ≤ 0 and leaves at +∞. On a face hi − o⁻ may be 0, and 0 · ∞ = NaN, which the comparison below
//!    drops: that slab then does not bound the ray.
//!
//! A start other than t = 0 moves the origin along the ray; o⁻ and o⁺ hold the rounding of that move too.

use etendue_math::Vec3;

/// Boxes that a ray is tried on at once: the children of a node.
pub(super) const WIDTH: usize = 8;

/// The part by which origin and reciprocals are moved outward: twice the rounding to f32, so that something is left for
/// what f64 has lost, here by moving the start and in the tests of the primitives by finding t (a few 2⁻⁵³).
const SLACK: f64 = 1.0 / (1 << 23) as f64;

/// A ray prepared for boxes: see the head of this file.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    axes: [Axis; 3],
    /// Boxes count t from here.
    start: f64,
    finite: bool,
}

/// One axis of a ray, for the planes through which it enters and leaves a slab.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// The rows of those planes in a node.
    rows: [usize; 2],
    origin: [f32; 2],
    /// The reciprocal of the direction, with its sign.
    inverse: [f32; 2],
}

impl Axis {
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "rounded outward beforehand")]
    fn new(axis: usize, o: f64, d: f64, t_lo: f64) -> Self {
        let start = o + t_lo * d;
        let slack = (o.abs() + (t_lo * d).abs()) * SLACK + f64::from(f32::MIN_POSITIVE);
        // Beyond the range of f32 the outer number may become infinite, the inner one may not.
        let below = ((start - slack) as f32).min(f32::MAX);
        let above = ((start + slack) as f32).max(f32::MIN);
        let inverse = 1.0 / d;
        let near = ((inverse * (1.0 - SLACK)) as f32).clamp(f32::MIN, f32::MAX);
        let far = (inverse * (1.0 + 4.0 * SLACK)) as f32;
        let backward = d.is_sign_negative();
        Self {
            rows: if backward { [axis + 3, axis] } else { [axis, axis + 3] },
            origin: if backward { [below, above] } else { [above, below] },
            inverse: [near, far],
        }
    }
}

impl Probe {
    /// The ray o + t d from t = `t_lo` on, which must be finite; d is a unit vector.
    #[inline(always)]
    #[must_use]
    pub fn new(o: Vec3, d: Vec3, t_lo: f64) -> Self {
        Self {
            axes: [
                Axis::new(0, o.x, d.x, t_lo),
                Axis::new(1, o.y, d.y, t_lo),
                Axis::new(2, o.z, d.z, t_lo),
            ],
            start: t_lo,
            finite: 0.0 * (o.x + o.y + o.z + d.x + d.y + d.z + t_lo) == 0.0,
        }
    }

    /// The end of the ray for boxes; None if nothing is left of it.
    #[inline(always)]
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "rounded outward beforehand")]
    pub fn limit(&self, t_max: f64) -> Option<f32> {
        let length = t_max - self.start;
        let slack = t_max.abs().max(length) * (4.0 * SLACK) + f64::from(f32::MIN_POSITIVE);
        (self.finite && length >= 0.0).then_some((length + slack) as f32)
    }

    /// Finds where the ray enters each of eight boxes, at 0 or later, and which it meets before `limit`.
    ///
    /// `if a > b { a } else { b }` is one instruction, and b if a is NaN.
    #[inline(always)]
    pub(super) fn enter(&self, planes: &[[f32; WIDTH]; 6], limit: f32, lanes: &mut Lanes) {
        let (mut enter, mut leave) = ([0.0_f32; WIDTH], [limit; WIDTH]);
        for Axis { rows, origin, inverse } in self.axes {
            let (near, far) = (&planes[rows[0]], &planes[rows[1]]);
            for i in 0..WIDTH {
                let a = (near[i] - origin[0]) * inverse[0];
                let b = (far[i] - origin[1]) * inverse[1];
                enter[i] = if a > enter[i] { a } else { enter[i] };
                leave[i] = if b < leave[i] { b } else { leave[i] };
            }
        }
        lanes.enter = enter;
        for i in 0..WIDTH {
            lanes.hit[i] = u8::from(enter[i] <= leave[i]);
        }
    }
}

/// What a ray has to do with eight boxes. It stays in memory, where one instruction writes it and children are looked up.
#[derive(Clone, Debug, Default)]
pub(super) struct Lanes {
    /// Where the ray enters each box.
    pub(super) enter: [f32; WIDTH],
    /// 1 if it does, else 0.
    pub(super) hit: [u8; WIDTH],
}
