//! Points that fill a cube more evenly than random ones: a rank-1 lattice, as a sequence, randomly shifted.

use multiversion::multiversion;

use crate::philox::Stream;

/// Generating vector of the lattice sequence, an embedded rule as in Cools, Kuo, Nuyens, "Constructing embedded lattice rules
/// for multivariate integration", SIAM J. Sci. Comput. 28 (2006), `[Cools2006]`, found by `benchmarks/lattice_search.py`: any
/// 2^m of its points, m from 4 to 20, are a lattice of good quality, above all dimensions 0 and 1, 2 and 3, and so on.
const GENERATOR: [u32; 12] = [
    1, 942_887, 269_861, 595_501, 354_371, 229_499, 1_033_079, 905_313, 830_563, 493_873, 910_413, 932_203,
];

/// Dimensions of a point.
pub const DIMENSIONS: usize = GENERATOR.len();

/// Point `index` of the sequence, moved by `shift`, each from 0 to 1, modulo 1 in each dimension: uniform if the shift is, and unbiased.
#[inline]
#[must_use]
pub fn lattice_point(index: u32, shift: &[f64; DIMENSIONS]) -> [f64; DIMENSIONS] {
    // The radical inverse in base 2 orders the points so that every beginning is spread out.
    let phase = index.reverse_bits();
    std::array::from_fn(|k| coordinate(phase, GENERATOR[k], shift[k]))
}

/// Coordinates 0 and 1 of all points from `first` on that there is room for, moved by so much and added to a corner.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn first_two(first: u32, shift: &[f64; 4], corner: [f64; 2], out: [&mut [f64]; 2]) {
    let [across, down] = out;
    let places = across.iter_mut().zip(down);
    for (index, (across, down)) in (first..).zip(places) {
        let phase = index.reverse_bits();
        *across = corner[0] + coordinate(phase, GENERATOR[0], shift[0]);
        *down = corner[1] + coordinate(phase, GENERATOR[1], shift[1]);
    }
}

#[inline(always)]
fn coordinate(phase: u32, generator: u32, shift: f64) -> f64 {
    let turn = f64::from(phase.wrapping_mul(generator)) * (1.0 / 4_294_967_296.0) + shift;
    // Both are below 1.
    let inside = if turn >= 1.0 { turn - 1.0 } else { turn };
    // A number that rounds to 1 or is 0 is none that others draw.
    inside.clamp(f64::EPSILON / 2.0, 1.0 - f64::EPSILON / 2.0)
}

/// A point of the sequence, moved at random; four of its coordinates at a time are worked out when they are asked for.
#[derive(Clone, Copy, Debug)]
pub struct ShiftedPoint {
    phase: u32,
    shifts: Stream,
    address: [u64; 2],
}

impl ShiftedPoint {
    /// How many times four coordinates it has.
    pub const FOURS: u64 = DIMENSIONS as u64 / 4;

    /// Point `index`, moved by the numbers of a stream at an address, the second part of which leaves its last 8 bits free.
    #[inline]
    #[must_use]
    pub const fn new(index: u32, shifts: Stream, address: [u64; 2]) -> Self {
        Self {
            phase: index.reverse_bits(),
            shifts,
            address,
        }
    }

    /// Another point at the same address.
    #[inline]
    #[must_use]
    pub const fn at(self, index: u32) -> Self {
        Self {
            phase: index.reverse_bits(),
            ..self
        }
    }

    /// Coordinates 4 `number` to 4 `number` + 3.
    #[inline]
    #[must_use]
    pub fn four(&self, number: u64) -> [f64; 4] {
        self.moved(number, &self.shift(number))
    }

    /// By how much they are moved: the same for all points at one address.
    #[inline]
    #[must_use]
    pub fn shift(&self, number: u64) -> [f64; 4] {
        self.shifts.uniforms(self.address[0], self.address[1] | number)
    }

    /// These coordinates, where it is known by how much they are moved.
    #[inline]
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "below FOURS")]
    pub fn moved(&self, number: u64, shift: &[f64; 4]) -> [f64; 4] {
        std::array::from_fn(|k| coordinate(self.phase, GENERATOR[4 * number as usize + k], shift[k]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_of_few_points_are_spread_as_well_as_those_of_good_lattices() {
        // P₂ of the best lattices of two dimensions is 0.346 at 16 points and falls as log n/n².
        for (m, bound) in [(4, 0.45), (5, 0.15), (6, 0.04), (8, 0.007), (10, 0.002)] {
            let n = 1_u32 << m;
            let omega = |x: f64| 2.0 * std::f64::consts::PI.powi(2) * (x * x - x + 1.0 / 6.0);
            let points: Vec<_> = (0..n).map(|i| lattice_point(i, &[0.0; DIMENSIONS])).collect();
            for k in (0..DIMENSIONS).step_by(2) {
                let worth = points.iter().map(|p| omega(p[k]) * omega(p[k + 1])).sum::<f64>() / f64::from(n);
                assert!(worth < bound, "{n} points, dimension {k}: {worth}");
            }
        }
    }

    #[test]
    fn a_smooth_function_is_integrated_far_better_than_by_random_points() {
        // Π (1 + (x² − 1/3)/2) has the mean 1; 2^12 random points are off by 7e-3 and more in 6 dimensions.
        for d in [2, 6, 12] {
            let shift = std::array::from_fn(|k| (0.37 + 0.618_034 * k as f64).fract());
            let mean = (0..4096)
                .map(|i| {
                    let p = lattice_point(i, &shift);
                    p[..d].iter().map(|x| 1.0 + (x * x - 1.0 / 3.0) / 2.0).product::<f64>()
                })
                .sum::<f64>()
                / 4096.0;
            assert!((mean - 1.0).abs() < 1e-3, "{d}: {mean}");
        }
    }

    #[test]
    fn every_dimension_is_stratified() {
        for m in [1024_u32, 4096] {
            for k in 0..DIMENSIONS {
                let mut seen: Vec<f64> = (0..m).map(|i| lattice_point(i, &[0.0; DIMENSIONS])[k]).collect();
                seen.sort_by(f64::total_cmp);
                for (i, x) in (0..).zip(seen) {
                    assert!((x - f64::from(i) / f64::from(m)).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn four_coordinates_at_a_time_are_those_of_the_point() {
        let shifts = Stream::new(7, 1);
        let mut shift = [0.0; DIMENSIONS];
        for (number, four) in (0_u64..).zip(shift.chunks_mut(4)) {
            four.copy_from_slice(&shifts.uniforms(12, 5 << 8 | number));
        }
        let (point, whole) = (ShiftedPoint::new(3, shifts, [12, 5 << 8]), lattice_point(3, &shift));
        let fours: Vec<f64> = (0..ShiftedPoint::FOURS).flat_map(|number| point.four(number)).collect();
        assert_eq!(fours, whole);
        let (mut across, mut down) = (vec![0.0; 100], vec![0.0; 100]);
        first_two(7, &point.shift(0), [2.0, 5.0], [&mut across, &mut down]);
        for (index, place) in (7..).zip(across.into_iter().zip(down)) {
            let [x, y, ..] = point.at(index).four(0);
            assert_eq!(place, (2.0 + x, 5.0 + y));
        }
    }
}
