//! Even aspheres.

use etendue_math::{Interval, Vec3};

use super::roots::{Bounded, zeros};
use super::rounding::{ROUNDING, size, step_down};

/// z = c r²/(1 + √(1 − (1 + k) c² r²)) + A₄ r⁴ + A₆ r⁶ + …, kept where r lies in a range.
#[derive(Clone, Debug, PartialEq)]
pub struct Asphere {
    curvature: f64,
    conic: f64,
    coefficients: Vec<f64>,
    r: [f64; 2],
    /// Bounds of the sag over the range of r.
    sag: Interval,
}

/// Stretches of r over which the sag is bounded one by one.
const STRETCHES: u32 = 64;

impl Asphere {
    /// None if the conic ends inside the range of r, or a number is not finite.
    #[must_use]
    pub fn new(curvature: f64, conic: f64, coefficients: Vec<f64>, r: [f64; 2]) -> Option<Self> {
        let finite = [curvature, conic, r[0], r[1]]
            .iter()
            .chain(&coefficients)
            .all(|x| x.is_finite());
        let ends = (1.0 + conic) * curvature * curvature * r[1] * r[1] > 1.0;
        if !finite || ends || !(0.0 <= r[0] && r[0] < r[1]) {
            return None;
        }
        let mut shape = Self {
            curvature,
            conic,
            coefficients,
            r,
            sag: Interval::point(0.0),
        };
        let at = |i: u32| {
            let r = r[0] + (r[1] - r[0]) * f64::from(i) / f64::from(STRETCHES);
            r * r
        };
        shape.sag = (0..STRETCHES)
            .map(|i| shape.sag_over(Interval::new(at(i), at(i + 1)))[0])
            .reduce(Interval::union)?;
        Some(shape)
    }

    /// Bounds of z.
    #[must_use]
    pub const fn sag_range(&self) -> Interval {
        self.sag
    }

    /// Range of r \[mm\].
    #[must_use]
    pub const fn radii(&self) -> [f64; 2] {
        self.r
    }

    /// The sag at s = r², and its derivative by s.
    #[inline]
    pub(super) fn sag_at(&self, s: f64) -> [f64; 2] {
        let c = self.curvature;
        let root = (1.0 - (1.0 + self.conic) * c * c * s).max(0.0).sqrt();
        let (mut value, mut slope) = (0.0, 0.0);
        for a in self.coefficients.iter().rev() {
            slope = slope * s + value;
            value = value * s + a;
        }
        // The polynomial begins with s². d/ds of c s/(1 + root) is c/(2 root).
        [
            c * s / (1.0 + root) + s * s * value,
            0.5 * c / root.max(f64::MIN_POSITIVE) + s * (2.0 * value + s * slope),
        ]
    }

    pub(super) fn sag_over(&self, s: Interval) -> [Interval; 2] {
        let (c, point) = (self.curvature, Interval::point);
        let under = point(1.0) - point((1.0 + self.conic) * c * c) * s;
        let root = under.sqrt();
        let (mut value, mut slope) = (point(0.0), point(0.0));
        for a in self.coefficients.iter().rev() {
            slope = slope * s + value;
            value = value * s + point(*a);
        }
        [
            point(c) * s * (point(1.0) + root).reciprocal() + s.squared() * value,
            if c == 0.0 {
                point(0.0)
            } else {
                point(0.5 * c) * root.reciprocal()
            } + s * (point(2.0) * value + s * slope),
        ]
    }

    /// Calls `visit` for each distance in `range` at which the line crosses the surface.
    pub fn crossings(&self, o: Vec3, d: Vec3, range: [f64; 2], starts_on: bool, mut visit: impl FnMut(f64)) {
        // The stretch of the line inside the cylinder and between the planes that hold the surface.
        let error = ROUNDING * (size(o) + range[0].abs());
        let (mut lo, mut hi) = (range[0], range[1]);
        let across = d.x * d.x + d.y * d.y;
        let closest = if across > 0.0 {
            -(o.x * d.x + o.y * d.y) / across
        } else {
            0.0
        };
        let (x, y) = (o.x + closest * d.x, o.y + closest * d.y);
        let least = x * x + y * y;
        let radius = self.r[1] + error;
        if least > radius * radius {
            return;
        }
        if across > 0.0 {
            let half = ((radius * radius - least) / across).sqrt() * (1.0 + ROUNDING);
            (lo, hi) = (lo.max(closest - half), hi.min(closest + half));
        }
        let (low, high) = (self.sag.lo - error, self.sag.hi + error);
        if d.z == 0.0 {
            if o.z < low || o.z > high {
                return;
            }
        } else {
            let (a, b) = ((low - o.z) / d.z, (high - o.z) / d.z);
            (lo, hi) = (lo.max(a.min(b)), hi.min(a.max(b)));
        }
        if starts_on {
            lo = lo.max(0.0);
        }
        let known = starts_on && lo == 0.0;
        if lo >= hi {
            return;
        }
        // Distances count from the middle of the stretch, so that a start point far away costs no digits.
        let origin = if known { 0.0 } else { lo };
        let along = Along {
            surface: self,
            across,
            closest: closest - origin,
            least,
            z: o.z + origin * d.z,
            dz: d.z,
            largest: radius * radius,
        };
        zeros(&along, lo - origin, hi - origin, known, &mut |s| {
            let t = origin + s;
            let p = o + d * t;
            let inner = self.r[0] - ROUNDING * (size(o) + t.abs());
            if inner <= 0.0 || p.x * p.x + p.y * p.y >= inner * inner {
                visit(t);
            }
        });
    }

    /// The point of the surface next to `p`, and the unit normal there.
    #[inline]
    #[must_use]
    pub fn settle(&self, p: Vec3) -> (Vec3, Vec3) {
        let [sag, slope] = self.sag_at(p.x * p.x + p.y * p.y);
        step_down(p, p.z - sag, Vec3::new(-2.0 * slope * p.x, -2.0 * slope * p.y, 1.0))
    }
}

/// z − sag along a line.
struct Along<'a> {
    surface: &'a Asphere,
    across: f64,
    /// Where the line is nearest to the axis, and the square of its distance there.
    closest: f64,
    least: f64,
    z: f64,
    dz: f64,
    /// Largest square of r that is looked at: rounding must not leave the domain of the conic by much.
    largest: f64,
}

impl Bounded for Along<'_> {
    fn at(&self, t: f64) -> [f64; 2] {
        let from = t - self.closest;
        let [sag, slope] = self
            .surface
            .sag_at((self.least + self.across * from * from).min(self.largest));
        [self.z + self.dz * t - sag, self.dz - slope * 2.0 * self.across * from]
    }

    fn over(&self, t: Interval) -> [Interval; 2] {
        let point = Interval::point;
        let from = t - point(self.closest);
        let s = point(self.least) + point(self.across) * from.squared();
        let s = Interval::new(s.lo.min(self.largest), s.hi.min(self.largest));
        let [sag, slope] = self.surface.sag_over(s);
        [
            point(self.z) + point(self.dz) * t - sag,
            point(self.dz) - slope * point(2.0 * self.across) * from,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Quadric;

    fn crossings(surface: &Asphere, o: Vec3, d: Vec3, starts_on: bool) -> Vec<f64> {
        let mut found = Vec::new();
        surface.crossings(o, d, [0.0, f64::INFINITY], starts_on, |t| found.push(t));
        found.sort_by(f64::total_cmp);
        found
    }

    fn direction(i: u32) -> Vec3 {
        let f = |g: f64| (0.5 + f64::from(i) * g).fract() - 0.5;
        Vec3::new(f(0.819_173), f(0.671_044), f(0.549_700)).normalized()
    }

    #[test]
    fn without_higher_terms_it_is_the_conic_that_the_quadratic_equation_solves() {
        // c r² + (1 + k) c z² − 2 z = 0.
        for (c, k) in [(0.2, 0.0), (-0.15, -0.7), (0.3, -1.0), (0.25, -2.5)] {
            let r = [0.3, 2.5];
            let asphere = Asphere::new(c, k, vec![], r).expect("sound");
            let [lo, hi] = [0.0, 1.0 / (c * (1.0 + k))];
            let quadric = Quadric {
                r2: c,
                z2: (1.0 + k) * c,
                z1: -2.0,
                z0: 0.0,
                // The branch at the vertex.
                z: if 1.0 + k > 0.0 {
                    [f64::min(lo, hi), f64::max(lo, hi)]
                } else if c > 0.0 {
                    [0.0, 99.0]
                } else {
                    [-99.0, 0.0]
                },
                r,
            };
            let mut met = 0;
            for i in 0..20_000 {
                let f = |g: f64| (0.5 + f64::from(i) * g).fract() - 0.5;
                let o = Vec3::new(f(0.754_877) * 6.0, f(0.569_840) * 6.0, f(0.618_034) * 6.0);
                let d = direction(i);
                let mut expected: Vec<f64> = quadric
                    .crossings(o, d, false)
                    .into_iter()
                    .filter(|t| *t >= 0.0 && t.is_finite())
                    .collect();
                expected.sort_by(f64::total_cmp);
                let found = crossings(&asphere, o, d, false);
                assert_eq!(
                    found.len(),
                    expected.len(),
                    "{c} {k} {o:?} {d:?} {found:?} {expected:?}"
                );
                for (a, b) in found.iter().zip(expected) {
                    assert!((a - b).abs() < 1e-11);
                }
                met += found.len();
            }
            assert!(met > 1000);
        }
    }

    #[test]
    fn a_wavy_surface_is_crossed_where_a_fine_march_along_the_line_finds_a_change_of_sign() {
        let wavy = Asphere::new(0.1, 0.5, vec![0.08, -0.03, 0.002], [0.0, 2.6]).expect("sound");
        let mut several = 0;
        for i in 0..3000 {
            let f = |g: f64| (0.5 + f64::from(i) * g).fract() - 0.5;
            let o = Vec3::new(-3.5, f(0.569_840) * 3.0, f(0.754_877) * 0.8);
            let target = Vec3::new(3.5, f(0.362_911) * 3.0, f(0.271_9) * 0.8);
            let d = (target - o).normalized();
            let at = |t: f64| {
                let p = o + d * t;
                let s = p.x * p.x + p.y * p.y;
                (s <= 2.6 * 2.6).then(|| p.z - wavy.sag_at(s)[0])
            };
            let (mut last, mut changes) = (None, 0);
            for step in 0..40_000 {
                let here = at(f64::from(step) * 5e-4);
                if let (Some(a), Some(b)) = (last, here) {
                    changes += usize::from((a > 0.0_f64) != (b > 0.0));
                }
                last = here;
            }
            let found = crossings(&wavy, o, d, false);
            // The march may miss the stretch of a step at the rim.
            let near_rim = found.iter().any(|t| {
                let p = o + d * *t;
                (p.x.hypot(p.y) - 2.6).abs() < 2e-3
            });
            assert!(found.len() == changes || near_rim, "{i}: {found:?} {changes}");
            several += usize::from(changes > 1);
        }
        assert!(several > 30, "{several}");
    }

    #[test]
    fn a_ray_that_leaves_it_meets_it_again_only_where_the_surface_is_crossed() {
        for scale in [1e-8, 1e-3, 1.0, 1e8] {
            // A lens face, convex: from outside there is no second crossing.
            let face = Asphere::new(0.2 / scale, -0.5, vec![1e-3 / scale.powi(3)], [0.0, 2.0 * scale]).expect("sound");
            for i in 0..4000 {
                let f = |g: f64| (0.5 + f64::from(i) * g).fract();
                let (r, turn) = (2.0 * scale * f(0.754_877).sqrt(), std::f64::consts::TAU * f(0.569_840));
                let (p, normal) = face.settle(Vec3::new(r * turn.cos(), r * turn.sin(), face.sag_at(r * r)[0]));
                let d = direction(i);
                if d.dot(normal) < 0.0 {
                    assert!(crossings(&face, p, d, true).is_empty(), "{scale} {i}");
                }
            }
        }
    }
}
