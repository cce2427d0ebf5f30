//! Surfaces of second order about the z axis: sphere, cylinder, cone, paraboloid, ellipsoid, hyperboloid.

use etendue_math::Vec3;

use super::rounding::{ROUNDING, size, step_down};

/// The surface F = r2 (x² + y²) + z2 z² + z1 z + z0 = 0, kept where z and √(x² + y²) lie in given ranges.
///
/// Its normal is the gradient: outwards for a sphere or a cylinder with r2 > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadric {
    /// Coefficient of x² + y².
    pub r2: f64,
    /// Coefficient of z².
    pub z2: f64,
    /// Coefficient of z \[mm\].
    pub z1: f64,
    /// Constant \[mm²\].
    pub z0: f64,
    /// Range of z that is kept \[mm\].
    pub z: [f64; 2],
    /// Range of √(x² + y²) that is kept \[mm\].
    pub r: [f64; 2],
}

impl Quadric {
    /// F at a point.
    #[inline(always)]
    #[must_use]
    pub fn value(&self, p: Vec3) -> f64 {
        self.r2 * (p.x * p.x + p.y * p.y) + (self.z2 * p.z + self.z1) * p.z + self.z0
    }

    /// The two distances at which the line crosses the surface; +∞ in place of a crossing that is none.
    #[inline(always)]
    #[must_use]
    pub fn crossings(&self, o: Vec3, d: Vec3, starts_on: bool) -> [f64; 2] {
        // From the point nearest the origin, so that a start point far away costs no digits; but a line that leaves the
        // surface knows that F = 0 at its start, and the equation without its constant has the other crossing only.
        let shift = if starts_on { 0.0 } else { -o.dot(d) };
        let p = o + d * shift;
        let a = self.r2 * (d.x * d.x + d.y * d.y) + self.z2 * d.z * d.z;
        let half_b = self.r2 * (p.x * d.x + p.y * d.y) + (self.z2 * p.z + 0.5 * self.z1) * d.z;
        let c = if starts_on { 0.0 } else { self.value(p) };
        let discriminant = half_b * half_b - a * c;
        let root = discriminant.max(0.0).sqrt();
        let q = -(half_b + root.copysign(half_b));
        // a = 0 and q = 0 give ±∞ or NaN, which no range contains.
        let met = discriminant >= 0.0;
        let first = self.kept(o, d, shift + q / a, met);
        let second = self.kept(o, d, shift + c / q, met & !starts_on);
        [first, second]
    }

    #[inline(always)]
    fn kept(&self, o: Vec3, d: Vec3, t: f64, met: bool) -> f64 {
        let p = o + d * t;
        let error = ROUNDING * (size(o) + t.abs());
        let r2 = p.x * p.x + p.y * p.y;
        let (least, most) = (self.r[0] - error, self.r[1] + error);
        let inside = (p.z >= self.z[0] - error)
            & (p.z <= self.z[1] + error)
            & (r2 <= most * most)
            & ((least <= 0.0) | (r2 >= least * least));
        if met & inside { t } else { f64::INFINITY }
    }

    /// The point of the surface next to `p`, and the unit normal there.
    #[inline(always)]
    #[must_use]
    pub fn settle(&self, p: Vec3) -> (Vec3, Vec3) {
        let (value, gradient) = self.slope(p);
        step_down(p, value, gradient)
    }

    /// F and its gradient at a point.
    #[inline(always)]
    #[must_use]
    pub fn slope(&self, p: Vec3) -> (f64, Vec3) {
        let gradient = Vec3::new(2.0 * self.r2 * p.x, 2.0 * self.r2 * p.y, 2.0 * self.z2 * p.z + self.z1);
        (self.value(p), gradient)
    }
}

/// r² of a quadric at z.
pub(super) fn squared_radius(q: &Quadric, z: f64) -> f64 {
    -((q.z2 * z + q.z1) * z + q.z0) / q.r2
}

/// The largest √(x² + y²) of a quadric and its range of z; None if it has no end or no points.
pub(super) fn reach(q: &Quadric) -> Option<(f64, [f64; 2])> {
    let ranges = ranges_of_z(q)?;
    let z = [ranges.first()?[0], ranges.last()?[1]];
    // r² is of second order in z: largest at an end, or where its slope is 0.
    let flat = -0.5 * q.z1 / q.z2;
    let places = ranges
        .iter()
        .flatten()
        .copied()
        .chain(ranges.iter().map(|r| flat.max(r[0]).min(r[1])));
    let most = places.map(|z| squared_radius(q, z)).fold(0.0, f64::max).sqrt();
    Some((most.min(q.r[1]), z))
}

/// The height of the centre of a ball that holds a quadric, and its radius; None if the quadric has no end or no points.
pub(super) fn ball(q: &Quadric) -> Option<(f64, f64)> {
    let (most, [from, to]) = reach(q)?;
    let centre = 0.5 * (from + to);
    // r² + (z - centre)² is of second order in z: largest at an end, or where its slope is 0.
    let square = |z: f64| squared_radius(q, z) + (z - centre) * (z - centre);
    let flat = (0.5 * q.z1 / q.r2 + centre) / (1.0 - q.z2 / q.r2);
    let places = [from, to, flat.max(from).min(to)];
    let furthest = places.map(square).into_iter().fold(0.0, f64::max);
    // Where the range of r cuts something out, the sum is not of one order from end to end.
    let around = most * most + 0.25 * (to - from) * (to - from);
    Some((centre, if q.r[1] <= most { around } else { furthest }.sqrt()))
}

/// Where, on the z axis, `lowest` ≤ r² ≤ `highest`: between the zeros of two functions of second order.
pub(super) fn ranges_of_z(q: &Quadric) -> Option<Vec<[f64; 2]>> {
    let zeros = |level: f64| -> Vec<f64> {
        let (a, b, c) = (q.z2, q.z1, q.z0 + q.r2 * level);
        if a == 0.0 {
            return if b == 0.0 { vec![] } else { vec![-c / b] };
        }
        let discriminant = b * b - 4.0 * a * c;
        if discriminant < 0.0 {
            return vec![];
        }
        let m = -0.5 * (b + discriminant.sqrt().copysign(b));
        if m == 0.0 { vec![0.0] } else { vec![m / a, c / m] }
    };
    let lowest = q.r[0] * q.r[0];
    let mut cuts = zeros(lowest);
    if q.r[1].is_finite() {
        cuts.extend(zeros(q.r[1] * q.r[1]));
    }
    cuts.retain(|z| *z > q.z[0] && *z < q.z[1]);
    cuts.extend(q.z);
    cuts.sort_by(f64::total_cmp);
    let mut ranges = Vec::new();
    for pair in cuts.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let middle = if from.is_finite() && to.is_finite() {
            0.5 * (from + to)
        } else if from.is_finite() {
            from + from.abs() + 1.0
        } else if to.is_finite() {
            to - to.abs() - 1.0
        } else {
            0.0
        };
        let g = squared_radius(q, middle);
        if to > from && g >= lowest && g > 0.0 && g <= q.r[1] * q.r[1] {
            if !(from.is_finite() && to.is_finite()) {
                return None;
            }
            ranges.push([from, to]);
        }
    }
    Some(ranges)
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    fn sphere(radius: f64) -> Quadric {
        Quadric {
            r2: 1.0,
            z2: 1.0,
            z1: 0.0,
            z0: -radius * radius,
            z: EVERYWHERE,
            r: [0.0, f64::INFINITY],
        }
    }

    fn numbers(i: u32) -> impl Fn(f64) -> f64 {
        move |g| (0.5 + f64::from(i) * g).fract() - 0.5
    }

    #[test]
    fn a_ray_that_leaves_a_sphere_never_meets_it_again_from_outside_and_once_from_inside_at_any_scale() {
        for exponent in -8..=8 {
            let radius = 1.37 * 10.0_f64.powi(exponent);
            let ball = sphere(radius);
            for i in 0..4000 {
                let f = numbers(i);
                let n = Vec3::new(f(0.754_877), f(0.569_840), f(0.618_034)).normalized();
                let (p, normal) = ball.settle(n * radius);
                let d = Vec3::new(f(0.819_173), f(0.671_044), f(0.549_700)).normalized();
                let hits: Vec<f64> = ball
                    .crossings(p, d, true)
                    .into_iter()
                    .filter(|t| *t > 0.0 && t.is_finite())
                    .collect();
                let cosine = d.dot(normal);
                assert_eq!(hits.len(), usize::from(cosine < 0.0), "{radius} {cosine}");
                if let [t] = hits[..] {
                    assert!((t / (-2.0 * radius * cosine) - 1.0).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn from_far_away_the_crossing_is_as_exact_as_the_start_point() {
        // The exact distance to a unit sphere straight ahead of a start point at 1e8 mm.
        let o = Vec3::new(0.25, -0.5, 1e8);
        let [far, near] = sphere(1.0).crossings(o, Vec3::new(0.0, 0.0, -1.0), false);
        let half = (1.0_f64 - 0.3125).sqrt();
        assert!((near.min(far) - (1e8 - half)).abs() <= 2e-8);
        let (p, _) = sphere(1.0).settle(o + Vec3::new(0.0, 0.0, -near.min(far)));
        assert!((p.length() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn crossings_lie_on_the_surface_and_in_its_ranges() {
        let cone = Quadric {
            r2: 1.0,
            z2: -0.49,
            z1: 0.0,
            z0: 0.0,
            z: [0.5, 2.0],
            r: [0.4, 1.2],
        };
        let paraboloid = Quadric {
            r2: 0.25,
            z2: 0.0,
            z1: -1.0,
            z0: 0.0,
            z: EVERYWHERE,
            r: [0.1, 3.0],
        };
        for surface in [cone, paraboloid] {
            let mut met = 0;
            for i in 0..20_000 {
                let f = numbers(i);
                let o = Vec3::new(f(0.754_877) * 8.0, f(0.569_840) * 8.0, f(0.618_034) * 8.0);
                let d = Vec3::new(f(0.819_173), f(0.671_044), f(0.549_700)).normalized();
                for t in surface.crossings(o, d, false) {
                    if t.is_finite() {
                        let p = o + d * t;
                        let r = p.x.hypot(p.y);
                        assert!(surface.value(p).abs() < 1e-12 * (1.0 + t.abs()).powi(2));
                        assert!(p.z >= surface.z[0] - 1e-12 && p.z <= surface.z[1] + 1e-12);
                        assert!(r >= surface.r[0] - 1e-12 && r <= surface.r[1] + 1e-12);
                        met += 1;
                    }
                }
            }
            assert!(met > 1000);
        }
        // Along the axis a paraboloid is crossed once, by an equation of first order.
        let axial = paraboloid.crossings(Vec3::new(1.0, 0.5, -3.0), Vec3::new(0.0, 0.0, 1.0), false);
        let hits: Vec<f64> = axial.into_iter().filter(|t| t.is_finite()).collect();
        assert!(hits.len() == 1 && (hits[0] - (3.0 + 1.25 / 4.0)).abs() < 1e-15);
    }
}
