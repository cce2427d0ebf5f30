//! The directions that a part takes: a disk of direction cosines, by the concentric map.

use etendue_sampling::warp::{disk_to_square, square_to_disk};

/// About a middle (p₀, q₀), within the unit disk, so that cells of direction are as fine as a narrow beam needs.
///
/// The map is a shift and a factor before the concentric one, which leaves equal volumes equal: dp dq = π r² da db.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    middle: [f64; 2],
    radius: f64,
    inverse: f64,
}

impl Beam {
    /// All directions.
    pub const ALL: Self = Self {
        middle: [0.0; 2],
        radius: 1.0,
        inverse: 1.0,
    };

    /// The disk of this radius about a middle; None if it is not within the unit disk.
    #[must_use]
    pub fn new(middle: [f64; 2], radius: f64) -> Option<Self> {
        let is_within = radius > 0.0 && middle[0].hypot(middle[1]) + radius <= 1.0;
        is_within.then(|| Self {
            middle,
            radius,
            inverse: 1.0 / radius,
        })
    }

    /// Its share of all direction cosines.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.radius * self.radius
    }

    /// Whether cosines are in it, and their coordinates.
    #[inline(always)]
    pub(super) fn coordinates(&self, p: f64, q: f64) -> (bool, [f64; 2]) {
        let (x, y) = ((p - self.middle[0]) * self.inverse, (q - self.middle[1]) * self.inverse);
        let (a, b) = disk_to_square(x, y);
        // Rounding may carry a direction along the horizon out of the disk, and out of the square by some 1e-16.
        let inside = (self.radius >= 1.0) | (x * x + y * y <= 1.0);
        (inside, [a.clamp(0.0, 1.0), b.clamp(0.0, 1.0)])
    }

    /// The cosines at some coordinates, and that to the normal.
    pub(super) fn cosines(&self, [a, b]: [f64; 2]) -> [f64; 3] {
        let (x, y) = square_to_disk(a, b);
        let (p, q) = (self.middle[0] + self.radius * x, self.middle[1] + self.radius * y);
        [p, q, (1.0 - p * p - q * q).max(0.0).sqrt()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_that_is_not_within_all_directions_is_none() {
        for (middle, radius) in [
            ([0.6, 0.5], 0.3),
            ([0.0; 2], 0.0),
            ([0.0; 2], f64::NAN),
            ([f64::NAN, 0.0], 0.1),
        ] {
            assert!(Beam::new(middle, radius).is_none());
        }
        assert_eq!(Beam::new([0.0; 2], 1.0), Some(Beam::ALL));
    }

    #[test]
    fn even_coordinates_are_even_cosines_within_the_disk() {
        // Means and mean squares of an even disk.
        let beam = Beam::new([0.3, -0.2], 0.1).expect("within");
        let n = 400;
        let (mut mean, mut squares) = ([0.0; 2], [0.0; 2]);
        for i in 0..n {
            for j in 0..n {
                let at = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(n));
                let [p, q, up] = beam.cosines(at);
                assert!((p * p + q * q + up * up - 1.0).abs() < 1e-15);
                let (inside, [a, b]) = beam.coordinates(p, q);
                assert!(inside && (a - at[0]).abs() < 1e-13 && (b - at[1]).abs() < 1e-13);
                for (k, x) in [p - 0.3, q + 0.2].into_iter().enumerate() {
                    mean[k] += x / f64::from(n * n);
                    squares[k] += x * x / f64::from(n * n);
                }
            }
        }
        assert!(mean.iter().all(|m| m.abs() < 1e-12));
        assert!(squares.iter().all(|s| (s / (0.01 / 4.0) - 1.0).abs() < 1e-4));
        assert!(!beam.coordinates(0.3, -0.0999).0 && beam.coordinates(0.3, -0.1001).0);
    }
}
