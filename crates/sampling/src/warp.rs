//! From the unit square to disks, annuli and hemispheres, each with its inverse.

use etendue_math::trig::{atan_eighths, sin_cos_turns};

/// The greatest number below 1.
const LAST: f64 = 1.0 - f64::EPSILON / 2.0;

/// What is left of a number that decided for a share by being less than it: a number from 0 to 1 again, less than 1.
#[inline(always)]
#[must_use]
pub fn part_of(number: f64, share: f64) -> f64 {
    (number / share).min(LAST)
}

/// A point uniform in area on the annulus `inner ≤ r ≤ outer`, from `(u, v)` in the unit square: density 1/(π(R²−r²)).
#[inline(always)]
#[must_use]
pub fn square_to_annulus(u: f64, v: f64, inner: f64, outer: f64) -> (f64, f64) {
    let r = (inner * inner + u * (outer * outer - inner * inner)).sqrt();
    let (s, c) = sin_cos_turns(v);
    (r * c, r * s)
}

/// A direction about +Z with density cos θ/π, from `(u, v)` in the unit square: sin²θ = u, φ = 2πv.
#[inline(always)]
#[must_use]
pub fn square_to_cosine_hemisphere(u: f64, v: f64) -> (f64, f64, f64) {
    let (s, c) = sin_cos_turns(v);
    let sin_theta = u.sqrt();
    (sin_theta * c, sin_theta * s, (1.0 - u).sqrt())
}

/// A point of the unit disk, from `(u, v)` in the unit square: the concentric map of Shirley and Chiu, density 1/π.
///
/// Squares about the centre become circles; the map is continuous and keeps neighbours together. `[ShirleyChiu1997]`
#[inline(always)]
#[must_use]
pub fn square_to_disk(u: f64, v: f64) -> (f64, f64) {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let wide = a.abs() > b.abs();
    let (r, other) = if wide { (a, b) } else { (b, a) };
    let slope = if r == 0.0 { 0.0 } else { other / r };
    let (sine, cosine) = sin_cos_turns(slope.abs() * 0.125);
    let across = if slope < 0.0 { -r * sine } else { r * sine };
    let along = r * cosine;
    if wide { (along, across) } else { (across, along) }
}

/// Inverse of [`square_to_disk`]; a point outside the disk gives one outside the square.
#[inline(always)]
#[must_use]
pub fn disk_to_square(x: f64, y: f64) -> (f64, f64) {
    let wide = x.abs() > y.abs();
    let (along, across) = if wide { (x, y) } else { (y, x) };
    let slope = if along == 0.0 { 0.0 } else { across / along };
    let radius = (x * x + y * y).sqrt();
    let r = if along < 0.0 { -radius } else { radius };
    let other = r * atan_eighths(slope);
    let (a, b) = if wide { (r, other) } else { (other, r) };
    (0.5 * a + 0.5, 0.5 * b + 0.5)
}

/// Inverse of [`square_to_annulus`].
#[must_use]
pub fn annulus_to_square(x: f64, y: f64, inner: f64, outer: f64) -> (f64, f64) {
    let u = (x * x + y * y - inner * inner) / (outer * outer - inner * inner);
    (u, turns(x, y))
}

/// Inverse of [`square_to_cosine_hemisphere`].
#[must_use]
pub fn cosine_hemisphere_to_square(x: f64, y: f64) -> (f64, f64) {
    (x * x + y * y, turns(x, y))
}

fn turns(x: f64, y: f64) -> f64 {
    (y.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> impl Iterator<Item = (f64, f64)> {
        (0..37).flat_map(|i| (0..41).map(move |j| ((f64::from(i) + 0.3) / 37.0, (f64::from(j) + 0.7) / 41.0)))
    }

    #[test]
    fn warps_are_inverted() {
        for (u, v) in grid() {
            let (x, y) = square_to_annulus(u, v, 10.0, 20.0);
            let (a, b) = annulus_to_square(x, y, 10.0, 20.0);
            assert!((a - u).abs() < 1e-14 && (b - v).abs() < 1e-14);
            let (x, y) = square_to_disk(u, v);
            assert!(x * x + y * y <= 1.0 + 1e-15);
            let (a, b) = disk_to_square(x, y);
            assert!((a - u).abs() < 1e-15 && (b - v).abs() < 1e-15);
            let (p, q, r) = square_to_cosine_hemisphere(u, v);
            assert!((p * p + q * q + r * r - 1.0).abs() < 1e-15);
            let (a, b) = cosine_hemisphere_to_square(p, q);
            assert!((a - u).abs() < 1e-15 && (b - v).abs() < 1e-14);
        }
    }

    #[test]
    fn warps_preserve_measure() {
        // |∂(x,y)/∂(u,v)| must be π(R²−r²) on the annulus, and π for (p,q) on the hemisphere: central differences.
        let h = 1e-6;
        for (u, v) in grid() {
            let det = |f: &dyn Fn(f64, f64) -> (f64, f64)| {
                let ((a, b), (c, d)) = (f(u + h, v), f(u - h, v));
                let ((e, g), (k, l)) = (f(u, v + h), f(u, v - h));
                ((a - c) * (g - l) - (b - d) * (e - k)) / (4.0 * h * h)
            };
            let annulus = det(&|u, v| square_to_annulus(u, v, 10.0, 20.0));
            let hemisphere = det(&|u, v| {
                let (p, q, _) = square_to_cosine_hemisphere(u, v);
                (p, q)
            });
            let disk = det(&square_to_disk);
            assert!((disk / std::f64::consts::PI - 1.0).abs() < 1e-6);
            assert!((annulus / (300.0 * std::f64::consts::PI) - 1.0).abs() < 1e-6);
            assert!((hemisphere / std::f64::consts::PI - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_concentric_map_keeps_centre_and_corners() {
        assert_eq!(square_to_disk(0.5, 0.5), (0.0, 0.0));
        assert_eq!(disk_to_square(0.0, 0.0), (0.5, 0.5));
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (x, y) = square_to_disk(u, v);
            assert!((x * x + y * y - 1.0).abs() < 1e-15);
            assert_eq!((x > 0.0, y > 0.0), (u > 0.5, v > 0.5));
            let (a, b) = disk_to_square(x, y);
            assert!((a - u).abs() < 1e-15 && (b - v).abs() < 1e-15);
        }
    }
}
