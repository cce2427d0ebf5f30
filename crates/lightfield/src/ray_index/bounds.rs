//! A box of line coordinates, and whether an observer may see a line of it.

use etendue_math::{Frame, Vec3};

use crate::cone::Cone;
use crate::view::View;

/// The rays of a leaf in the coordinates of their cell: least and greatest u, v, p, q, rounded outwards.
///
/// (p, q) are the first two components of the direction in the cell's frame, (u, v) \[mm\] those of the point in which the
/// line crosses the frame's plane z = 0. They do not depend on where on its line a ray starts.
pub type Bounds = [f32; 8];

/// Rounding of a line's coordinates, and of the point in which the cone estimator finds it crossing the screen, as a
/// fraction of the distances involved. Both take less than twenty operations: below 40 · 2⁻⁵³ = 4.4e-15.
const ROUNDING: f64 = 1e-13;

/// More than the errors \[rad\] of all angles of a comparison together: a cosine or chord that is off by 1e-15 is an angle
/// near 0 that is off by √(2e-15) = 4.5e-8.
const ANGLE_ROUNDING: f64 = 1e-6;

/// Coordinates (u, v, p, q) of the line of a ray with position `x` and unit direction `k`.
#[must_use]
pub fn line_coordinates(frame: &Frame, x: Vec3, k: Vec3) -> [f64; 4] {
    let (local, direction) = (frame.point_to_local(x), frame.direction_to_local(k));
    let t = local.z / direction.z;
    [
        local.x - t * direction.x,
        local.y - t * direction.y,
        direction.x,
        direction.y,
    ]
}

/// How far off the u and v of a ray that starts at `x` may be.
#[must_use]
pub fn coordinate_error(frame: &Frame, x: Vec3) -> f64 {
    ROUNDING * (size(x) + size(frame.origin))
}

/// Bounds of lines from their coordinates, each with the error of its u and v.
#[must_use]
pub fn bounds_of(lines: impl Iterator<Item = ([f64; 4], f64)>) -> Bounds {
    let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 4];
    for (line, error) in lines {
        for (axis, (range, value)) in ranges.iter_mut().zip(line).enumerate() {
            let error = if axis < 2 { error } else { 0.0 };
            // A start point so far away that its coordinates overflow may cross anywhere.
            let (low, high) = if (value - error).is_finite() && (value + error).is_finite() {
                (value - error, value + error)
            } else {
                (f64::NEG_INFINITY, f64::INFINITY)
            };
            *range = [range[0].min(low), range[1].max(high)];
        }
    }
    let [u, v, p, q] = ranges.map(|[low, high]| [outwards(low, false), outwards(high, true)]);
    [u[0], u[1], v[0], v[1], p[0], p[1], q[0], q[1]]
}

/// The nearest f32 that is not on the inner side of `value`.
#[allow(clippy::cast_possible_truncation, reason = "the rounding is made good for")]
fn outwards(value: f64, up: bool) -> f32 {
    let near = value as f32;
    match (up, f64::from(near) < value, f64::from(near) > value) {
        (true, true, _) => near.next_up(),
        (false, _, true) => near.next_down(),
        _ => near,
    }
}

fn size(x: Vec3) -> f64 {
    x.x.abs() + x.y.abs() + x.z.abs()
}

/// A cone as the index asks about it: in the axes of its screen.
pub struct Sight {
    view: View,
    /// From the target to the observer, along right, up and normal.
    observer: [f64; 3],
    half: [f64; 2],
    half_pixel: [f64; 2],
    /// Sine and cosine of the widest acceptance.
    reach: (f64, f64),
    /// That and the angle of the field \[rad\].
    field: f64,
    axis: Vec3,
}

impl Sight {
    /// Everything that can be worked out before the first cell.
    #[must_use]
    pub fn new(cone: &Cone) -> Self {
        let view = &cone.view;
        let (axis, field) = view.field();
        let widest = cone.acceptances.iter().fold(0.0, |a: f64, b| a.max(*b)) + ANGLE_ROUNDING;
        Self {
            view: *view,
            observer: along(view, view.observer - view.target),
            half: [view.width / 2.0, view.height / 2.0],
            half_pixel: [
                view.width / f64::from(view.columns) / 2.0,
                view.height / f64::from(view.rows) / 2.0,
            ],
            reach: widest.sin_cos(),
            axis,
            field: field + widest,
        }
    }

    /// Whether a direction within `radius` \[rad\] of `axis` may head for the observer from anywhere on the screen.
    #[must_use]
    pub fn may_meet(&self, axis: Vec3, radius: f64) -> bool {
        let angle = self.axis.dot(axis).clamp(-1.0, 1.0).acos();
        angle <= self.field + radius
    }

    /// The cell with this frame, in the axes of the screen.
    #[must_use]
    pub fn cell(&self, frame: &Frame) -> SightedCell<'_> {
        SightedCell {
            sight: self,
            origin: along(&self.view, frame.origin - self.view.target),
            x: along(&self.view, frame.x),
            y: along(&self.view, frame.y),
            z: along(&self.view, frame.z),
            slack: ROUNDING * (size(frame.origin) + size(self.view.target) + size(self.view.observer)),
        }
    }
}

fn along(view: &View, v: Vec3) -> [f64; 3] {
    [v.dot(view.right), v.dot(view.up), v.dot(view.normal)]
}

/// The frame of a cell in the axes of a screen.
pub struct SightedCell<'a> {
    sight: &'a Sight,
    origin: [f64; 3],
    x: [f64; 3],
    y: [f64; 3],
    z: [f64; 3],
    slack: f64,
}

impl SightedCell<'_> {
    /// Whether the cone may see a line within `bounds`. It may say yes in vain, and never no where the answer is yes;
    /// every comparison is put so that NaN says yes.
    ///
    /// The lines cross the screen within a rectangle. Between the line from its middle to the observer and the one from any
    /// other point there is an angle of at most arcsin(half the diagonal/distance of the observer); between the middle of the
    /// directions and any other one a chord of at most the length of half the box' diagonal. A ray can be seen only if the
    /// two middles are no farther apart than the acceptance and both angles together.
    #[must_use]
    #[inline]
    pub fn may_see(&self, bounds: &Bounds) -> bool {
        let [u0, u1, v0, v1, p0, p1, q0, q1] = bounds.map(f64::from);
        let r0 = root(1.0 - p0.abs().max(p1.abs()).powi(2) - q0.abs().max(q1.abs()).powi(2));
        let r1 = root(1.0 - nearest_zero(p0, p1).powi(2) - nearest_zero(q0, q1).powi(2));
        let component = |axis: usize| {
            let (p, q, r) = (
                times([p0, p1], self.x[axis]),
                times([q0, q1], self.y[axis]),
                times([r0, r1], self.z[axis]),
            );
            [p[0] + q[0] + r[0], p[1] + q[1] + r[1]]
        };
        let towards = component(2);
        let crosses = towards[0] > 0.0 || towards[1] < 0.0;
        let (mut middle, mut diagonal) = ([0.0; 2], 0.0);
        for axis in 0..2 {
            let half = self.sight.half[axis];
            let (mut low, mut high) = (-half, half);
            if crosses {
                let slopes = quotient(component(axis), towards);
                // The crossing is linear in u, in v and in the slope m, each with the others held: corners are extreme.
                let [a, b] = slopes.map(|m| {
                    let of = |v: &[f64; 3]| v[axis] - v[2] * m;
                    let (u, v) = (times([u0, u1], of(&self.x)), times([v0, v1], of(&self.y)));
                    let slack = self.slack * (1.0 + m.abs());
                    [
                        of(&self.origin) + u[0] + v[0] - slack,
                        of(&self.origin) + u[1] + v[1] + slack,
                    ]
                });
                if (a[0] > half && b[0] > half) || (a[1] < -half && b[1] < -half) {
                    return false;
                }
                // Infinite or NaN: the whole screen.
                if (a[0] - a[1] + b[0] - b[1]).is_finite() {
                    (low, high) = (low.max(a[0].min(b[0])), high.min(a[1].max(b[1])));
                }
            }
            // The middles of pixels, to which sight lines go, are off the crossings by half a pixel at most.
            middle[axis] = f64::midpoint(low, high);
            diagonal += (f64::midpoint(high, -low) + self.sight.half_pixel[axis]).powi(2);
        }
        let observer = self.sight.observer;
        let line = [observer[0] - middle[0], observer[1] - middle[1], observer[2]];
        let distance2 = dot(line, line);
        let sine2 = diagonal / distance2;
        let (p, q) = (f64::midpoint(p0, p1), f64::midpoint(q0, q1));
        let r = root(1.0 - p * p - q * q);
        let chord2 = (p1 - p).powi(2) + (q1 - q).powi(2) + (r1 - r).max(r - r0).powi(2);
        let heading: [f64; 3] = std::array::from_fn(|i| p * self.x[i] + q * self.y[i] + r * self.z[i]);
        let apart = dot(line, heading) / distance2.sqrt();
        let (sine, cosine) = plus(
            (sine2.sqrt(), root(1.0 - sine2)),
            (root(chord2 * (1.0 - 0.25 * chord2)), 1.0 - 0.5 * chord2),
        );
        let (sine, cosine) = plus((sine, cosine), self.sight.reach);
        // Where the angles are too large for their sum to be below 180° by its sine, nothing is ruled out.
        let ruled_out = apart < cosine && sine > 0.0 && sine2 < 1.0 && chord2 < 1.0;
        !ruled_out
    }
}

fn root(square: f64) -> f64 {
    square.max(0.0).sqrt()
}

/// Sine and cosine of a sum of two angles.
fn plus((s, c): (f64, f64), (t, d): (f64, f64)) -> (f64, f64) {
    (s * d + c * t, c * d - s * t)
}

/// The value of least size in an interval.
fn nearest_zero(low: f64, high: f64) -> f64 {
    if low > 0.0 {
        low
    } else if high < 0.0 {
        high
    } else {
        0.0
    }
}

fn times([low, high]: [f64; 2], factor: f64) -> [f64; 2] {
    if factor < 0.0 {
        [high * factor, low * factor]
    } else {
        [low * factor, high * factor]
    }
}

/// Quotient of an interval by one without zero.
fn quotient([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    let (c, d) = (1.0 / c, 1.0 / d);
    let (first, second) = (times([a, b], c), times([a, b], d));
    [first[0].min(second[0]), first[1].max(second[1])]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
