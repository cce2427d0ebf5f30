//! A slice of a table of scattered light, f on a polar grid, and what lies between two of them.

use std::f64::consts::FRAC_1_PI;

use etendue_math::special::{exp, ln};

/// f on a polar grid in the plane of direction cosines.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// |β₀|: the sine of the angle of incidence.
    pub sine: f64,
    /// |β − β₀|, rising from 0.
    pub radial: Vec<f64>,
    /// How many azimuths, evenly spaced from 0.
    pub azimuths: usize,
    /// f \[1/sr\], azimuth by azimuth; constant beyond the last radial coordinate.
    pub f: Vec<f64>,
    /// Share of the flux at this incidence, without the base.
    pub share: f64,
    /// Share of the flux in the base.
    pub base: f64,
}

/// Slices in between are made for steps of incidence of this size \[rad\] at most.
const STEP: f64 = 0.0875;

/// What is added to f before its logarithm is taken, relative to the largest f.
const LITTLE: f64 = 1e-6;

/// f that is nothing beside the largest one.
const NOTHING: f64 = 1e-9;

impl Slice {
    /// Slices between this incidence and another one, close to each other: the logarithm of f is linear in the angle of incidence, so
    /// that a lobe that grows and narrows stays one lobe. Where one of both has nothing, f is linear itself: a hole is no lobe. And what
    /// is little beside the base is nearly linear: it is the logarithm of all of the light, with a base of this share by the sine.
    ///
    /// None where the grids differ in azimuths.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 18 steps"
    )]
    pub(super) fn up_to(&self, other: &Self, base: impl Fn(f64) -> f64) -> Vec<Self> {
        let [from, to] = [self.sine, other.sine].map(|sine| sine.min(1.0).asin());
        let steps = ((to - from) / STEP).ceil() as usize;
        if self.azimuths != other.azimuths || self.radial.is_empty() || other.radial.is_empty() {
            return Vec::new();
        }
        // A lobe that does not change needs nothing in between.
        if self.radial == other.radial && self.f == other.f {
            return Vec::new();
        }
        let radial = finer(&self.radial, &other.radial);
        let [a, b] = [self, other].map(|slice| slice.on(&radial));
        let largest = a.iter().chain(&b).copied().fold(0.0, f64::max);
        let [little, nothing] = [LITTLE, NOTHING].map(|part| (part * largest).max(f64::MIN_POSITIVE));
        let below = |base: f64| little + base * FRAC_1_PI;
        let [under, under_other] = [self, other].map(|slice| below(slice.base));
        (1..steps)
            .map(|k| {
                let part = k as f64 / steps as f64;
                let sine = (from + part * (to - from)).sin();
                let there = below(base(sine));
                let mean = |(a, b): (&f64, &f64)| {
                    let all = exp((1.0 - part) * ln(a + under) + part * ln(b + under_other));
                    let geometric = (all - there).max(0.0);
                    let linear = (1.0 - part) * a + part * b;
                    let least = a.min(*b);
                    linear + (geometric - linear) * least / (least + nothing)
                };
                Self {
                    sine,
                    radial: radial.clone(),
                    azimuths: self.azimuths,
                    f: a.iter().zip(&b).map(mean).collect(),
                    share: 0.0,
                    base: 0.0,
                }
            })
            .collect()
    }

    /// f on other radial coordinates.
    fn on(&self, radial: &[f64]) -> Vec<f64> {
        let n = self.radial.len();
        let along = |row: &[f64]| -> Vec<f64> {
            let at = |r: &f64| {
                let i = self.radial.partition_point(|x| x <= r).max(1) - 1;
                let next = (i + 1).min(n - 1);
                if next == i {
                    return row[i];
                }
                row[i] + (row[next] - row[i]) * (r - self.radial[i]) / (self.radial[next] - self.radial[i])
            };
            radial.iter().map(at).collect()
        };
        self.f.chunks(n).flat_map(along).collect()
    }
}

/// Of two lists of radial coordinates that rise from 0 the finer one at each place, and the ends of both. All of both would be
/// twice as many, and nothing in either needs them.
fn finer(one: &[f64], other: &[f64]) -> Vec<f64> {
    /// By how much finer the other list has to be where both are alike.
    const CLEARLY: f64 = 1.05;
    // From the last coordinate that is not above a place to the next.
    let step = |radial: &[f64], r: f64| {
        let above = radial.partition_point(|x| *x <= r).max(1);
        radial.get(above).map_or(f64::INFINITY, |next| next - radial[above - 1])
    };
    let is_finer = |r: f64| CLEARLY * step(other, r) < step(one, r);
    let ends = [one, other].map(|radial| radial[radial.len() - 1]);
    let of_one = one.iter().filter(|r| ends.contains(r) || !is_finer(**r));
    let of_other = other.iter().filter(|r| ends.contains(r) || is_finer(**r));
    let mut radial: Vec<f64> = of_one.chain(of_other).copied().collect();
    radial.sort_by(f64::total_cmp);
    radial.dedup();
    radial
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_grids_the_finer_one_is_taken_at_each_place() {
        let even = |n: u32, from: f64| {
            (0..n)
                .map(|k| f64::from(k) * 0.1 + if k > 0 { from } else { 0.0 })
                .collect::<Vec<_>>()
        };
        // Alike, but for where they stand: one of them, and the end of the other one.
        let (one, other) = (even(21, 0.0), even(20, 0.04));
        let found = finer(&one, &other);
        assert!(one.iter().all(|r| found.contains(r)));
        assert!(found.len() <= one.len() + 2, "{found:?}");
        // Fine in the middle here, beyond it there: of both what is fine, and no step wider than the finer of both has there.
        let one: Vec<f64> = (0..20).map(|k| 0.02 * f64::from(k)).chain([0.8, 1.2]).collect();
        let other: Vec<f64> = (0..4)
            .map(|k| 0.2 * f64::from(k))
            .chain((0..20).map(|k| 0.8 + 0.03 * f64::from(k)))
            .collect();
        let found = finer(&one, &other);
        assert!(found.is_sorted() && found[0] == 0.0 && found[found.len() - 1] == other[other.len() - 1]);
        assert!(one[..19].iter().chain(&other[4..]).all(|r| found.contains(r)));
        assert!(found.len() < one.len() + other.len() - 3, "{found:?}");
        for pair in found.windows(2) {
            let limit = if pair[1] < 0.39 {
                0.021
            } else if pair[0] > 0.79 {
                0.031
            } else {
                0.201
            };
            assert!(pair[1] - pair[0] <= limit, "{pair:?}");
        }
    }
}
