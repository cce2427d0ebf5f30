//! A box of line coordinates, and whether an observer may see a line of it.

use std::f64::consts::FRAC_PI_2;

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

/// The largest error \[rad\] of three angles from scalar products that are off by up to 1e-15: arccos near 1 makes √(2e-15)
/// of it.
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
    /// From the target to the eye, along right, up and normal.
    eye: [f64; 3],
    half: [f64; 2],
    half_pixel: [f64; 2],
    /// The widest acceptance \[rad\].
    reach: f64,
    axis: Vec3,
    field: f64,
}

impl Sight {
    /// Everything that can be worked out before the first cell.
    #[must_use]
    pub fn new(cone: &Cone) -> Self {
        let view = &cone.view;
        let (axis, field) = view.field();
        Self {
            view: *view,
            eye: along(view, view.eye - view.target),
            half: [view.width / 2.0, view.height / 2.0],
            half_pixel: [
                view.width / f64::from(view.columns) / 2.0,
                view.height / f64::from(view.rows) / 2.0,
            ],
            reach: cone.acceptances.iter().fold(0.0, |a: f64, b| a.max(*b)) + ANGLE_ROUNDING,
            axis,
            field,
        }
    }

    /// Whether a direction within `radius` \[rad\] of `axis` may head for the eye from anywhere on the screen.
    #[must_use]
    pub fn may_meet(&self, axis: Vec3, radius: f64) -> bool {
        let angle = self.axis.dot(axis).clamp(-1.0, 1.0).acos();
        angle <= self.field + self.reach + radius
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
            slack: ROUNDING * (size(frame.origin) + size(self.view.target) + size(self.view.eye)),
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
    /// The lines cross the screen within a rectangle. Lines from there to the eye are within an angle of the one from its
    /// middle, directions of the box within another of that of its middle, and the corners are the extremes of both: the
    /// points of a plane, and likewise the (p, q), within less than 90° of a given direction form a convex set.
    #[must_use]
    pub fn may_see(&self, bounds: &Bounds) -> bool {
        let [u0, u1, v0, v1, p0, p1, q0, q1] = bounds.map(f64::from);
        let r = [
            root(1.0 - p0.abs().max(p1.abs()).powi(2) - q0.abs().max(q1.abs()).powi(2)),
            root(1.0 - nearest_zero(p0, p1).powi(2) - nearest_zero(q0, q1).powi(2)),
        ];
        let component = |axis: usize| {
            let (p, q) = (times([p0, p1], self.x[axis]), times([q0, q1], self.y[axis]));
            let r = times(r, self.z[axis]);
            [p[0] + q[0] + r[0], p[1] + q[1] + r[1]]
        };
        let towards = component(2);
        let mut low = [0.0; 2];
        let mut high = [0.0; 2];
        for axis in 0..2 {
            let [mut a, mut b] = [f64::NEG_INFINITY, f64::INFINITY];
            if towards[0] > 0.0 || towards[1] < 0.0 {
                let slopes = quotient(component(axis), towards);
                // The crossing is linear in u, in v and in the slope m, each with the others held: corners are extreme.
                let ranges = slopes.map(|m| {
                    let of = |v: &[f64; 3]| v[axis] - v[2] * m;
                    let (u, v) = (times([u0, u1], of(&self.x)), times([v0, v1], of(&self.y)));
                    let slack = self.slack * (1.0 + m.abs());
                    [
                        of(&self.origin) + u[0] + v[0] - slack,
                        of(&self.origin) + u[1] + v[1] + slack,
                    ]
                });
                if ranges.iter().flatten().all(|end| end.is_finite()) {
                    (a, b) = (ranges[0][0].min(ranges[1][0]), ranges[0][1].max(ranges[1][1]));
                }
            }
            let half = self.sight.half[axis];
            if a > half || b < -half {
                return false;
            }
            low[axis] = a.max(-half) - self.sight.half_pixel[axis];
            high[axis] = b.min(half) + self.sight.half_pixel[axis];
        }
        let eye = self.sight.eye;
        let to_eye = |sx: f64, sy: f64| {
            let (x, y, z) = (eye[0] - sx, eye[1] - sy, eye[2]);
            let length = (x * x + y * y + z * z).sqrt();
            [x / length, y / length, z / length]
        };
        let sight = to_eye(f64::midpoint(low[0], high[0]), f64::midpoint(low[1], high[1]));
        let corners = [
            (low[0], low[1]),
            (low[0], high[1]),
            (high[0], low[1]),
            (high[0], high[1]),
        ];
        let spread = widest(corners.map(|(sx, sy)| dot(sight, to_eye(sx, sy))));
        let local = |p: f64, q: f64| [p, q, root(1.0 - p * p - q * q)];
        let middle = local(f64::midpoint(p0, p1), f64::midpoint(q0, q1));
        let fan = widest([(p0, q0), (p0, q1), (p1, q0), (p1, q1)].map(|(p, q)| dot(middle, local(p, q))));
        let heading: [f64; 3] =
            std::array::from_fn(|i| middle[0] * self.x[i] + middle[1] * self.y[i] + middle[2] * self.z[i]);
        let apart = angle(dot(sight, heading));
        !(apart > self.sight.reach + spread + fan && spread < FRAC_PI_2)
    }
}

fn root(square: f64) -> f64 {
    square.max(0.0).sqrt()
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
    let values = [a / c, a / d, b / c, b / d];
    [
        values.iter().copied().fold(f64::INFINITY, f64::min),
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn angle(cosine: f64) -> f64 {
    cosine.clamp(-1.0, 1.0).acos()
}

fn widest(cosines: [f64; 4]) -> f64 {
    angle(cosines.into_iter().fold(1.0, f64::min))
}
