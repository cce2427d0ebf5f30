//! The torus.

use etendue_math::{Interval, Vec3};

use super::roots::{Bounded, zeros};
use super::rounding::{ROUNDING, size, step_down};

/// A tube of radius `minor` whose centre line is a circle of radius `major` about the z axis, in the plane z = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    /// Radius of the centre line \[mm\].
    pub major: f64,
    /// Radius of the tube \[mm\], smaller than `major`.
    pub minor: f64,
}

/// By how much the ball is larger in which crossings are looked for: F there is 8 R³ r of this, and known to some 10⁻¹⁵ R⁴.
const MARGIN: f64 = 1e-6;

/// F = (|p|² + R² − r²)² − 4 R² (x² + y²) along a line, a polynomial of fourth order: Σ cᵢ tⁱ.
struct Along([f64; 5]);

impl Bounded for Along {
    fn at(&self, t: f64) -> [f64; 2] {
        let (mut value, mut slope) = (0.0, 0.0);
        for c in self.0.iter().rev() {
            slope = slope * t + value;
            value = value * t + c;
        }
        [value, slope]
    }

    fn over(&self, t: Interval) -> [Interval; 2] {
        // About the middle m: Σ cᵢ (m + s)ⁱ = Σ eᵢ sⁱ, whose bounds are far tighter than those of the powers of t.
        let middle = 0.5 * (t.lo + t.hi);
        let mut e = self.0.map(Interval::point);
        for i in 0..4 {
            for j in (i..4).rev() {
                e[j] = e[j] + e[j + 1] * Interval::point(middle);
            }
        }
        let s = t - Interval::point(middle);
        let (mut value, mut slope) = (Interval::point(0.0), Interval::point(0.0));
        for (i, c) in e.iter().enumerate().rev() {
            value = value * s + *c;
            if i > 0 {
                slope = slope * s + *c * Interval::point(i as f64);
            }
        }
        [value, slope]
    }
}

impl Torus {
    /// Calls `visit` for each distance in `range` at which the line crosses the surface.
    pub fn crossings(&self, o: Vec3, d: Vec3, range: [f64; 2], starts_on: bool, mut visit: impl FnMut(f64)) {
        // From the point nearest the origin; beyond the ball that holds the torus there is nothing. The ball is larger by as much
        // as F, a difference of numbers of the order of R⁴, needs to have the right sign at its ends.
        let middle = -o.dot(d);
        let near = o + d * middle;
        let reach = (self.major + self.minor) * (1.0 + MARGIN) + ROUNDING * (size(o) + middle.abs());
        let half = reach * reach - near.dot(near);
        if half < 0.0 {
            return;
        }
        let half = half.sqrt();
        let origin = if starts_on { 0.0 } else { middle };
        let p = o + d * origin;
        let (lo, hi) = (
            range[0].max(middle - half) - origin,
            range[1].min(middle + half) - origin,
        );
        let lo = if starts_on { lo.max(0.0) } else { lo };
        let (pd, w) = (
            p.dot(d),
            p.dot(p) + (self.major + self.minor) * (self.major - self.minor),
        );
        let k = 4.0 * self.major * self.major;
        let along = Along([
            if starts_on {
                0.0
            } else {
                w * w - k * (p.x * p.x + p.y * p.y)
            },
            4.0 * w * pd - 2.0 * k * (p.x * d.x + p.y * d.y),
            2.0 * w + 4.0 * pd * pd - k * (d.x * d.x + d.y * d.y),
            4.0 * pd,
            1.0,
        ]);
        zeros(&along, lo, hi, starts_on && lo == 0.0, &mut |s| visit(origin + s));
    }

    /// The point of the surface next to `p`, and the unit normal there.
    #[inline]
    #[must_use]
    pub fn settle(&self, p: Vec3) -> (Vec3, Vec3) {
        // The distance to the centre line, minus the radius of the tube: its gradient has length 1.
        let r = p.x.hypot(p.y);
        let out = r - self.major;
        let distance = out.hypot(p.z);
        let n = Vec3::new(p.x / r * out, p.y / r * out, p.z) * (1.0 / distance);
        step_down(p, distance - self.minor, n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_are_where_a_fine_march_finds_the_distance_to_the_centre_line_cross_the_radius() {
        let torus = Torus { major: 2.0, minor: 0.7 };
        let distance = |p: Vec3| (p.x.hypot(p.y) - 2.0).hypot(p.z) - 0.7;
        let mut four = 0;
        for i in 1..2000 {
            let f = |g: f64| (0.5 + f64::from(i) * g).fract() - 0.5;
            let o = Vec3::new(f(0.754_877) * 9.0, f(0.569_840) * 9.0, f(0.618_034) * 9.0);
            let target = Vec3::new(f(0.819_173) * 4.0, f(0.671_044) * 4.0, f(0.549_7));
            let d = (target - o).normalized();
            let mut found = Vec::new();
            torus.crossings(o, d, [0.0, f64::INFINITY], false, |t| found.push(t));
            let mut changes = 0;
            let mut last = distance(o);
            for step in 1..20_000 {
                let here = distance(o + d * (f64::from(step) * 1e-3));
                changes += usize::from((here > 0.0) != (last > 0.0));
                last = here;
            }
            assert_eq!(found.len(), changes, "{i} {found:?}");
            for t in &found {
                assert!(distance(o + d * *t).abs() < 1e-11);
            }
            four += usize::from(changes == 4);
        }
        assert!(four > 20);
    }

    #[test]
    fn a_ray_that_leaves_it_never_meets_the_point_it_left() {
        for scale in [1e-8, 1.0, 1e8] {
            let torus = Torus {
                major: 2.0 * scale,
                minor: 0.7 * scale,
            };
            for i in 0..2000 {
                let f = |g: f64| std::f64::consts::TAU * (0.5 + f64::from(i) * g).fract();
                let (a, b) = (f(0.754_877), f(0.569_840));
                let r = torus.major + torus.minor * b.cos();
                let (p, n) = torus.settle(Vec3::new(r * a.cos(), r * a.sin(), torus.minor * b.sin()));
                // Along the normal, outwards: from the outer half nothing is met.
                if b.cos() > 0.1 {
                    torus.crossings(p, n, [0.0, f64::INFINITY], true, |t| panic!("{scale} {t}"));
                }
                // Inwards along the normal: the tube is crossed after its diameter.
                let mut found = Vec::new();
                torus.crossings(p, -n, [0.0, 1.5 * torus.minor * 2.0], true, |t| found.push(t));
                found.sort_by(f64::total_cmp);
                assert!((found[0] / (2.0 * torus.minor) - 1.0).abs() < 1e-9, "{found:?}");
            }
        }
    }
}
