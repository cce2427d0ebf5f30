//! Tents: the hat functions of linear interpolation between cell centres.

use std::ops::Range;

/// The two cells between whose centres a coordinate lies, and the weight of either.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tent {
    /// Lower and upper cell: neighbours, unless the axis has one cell only, or closes upon itself between them.
    pub cells: [usize; 2],
    /// Weights of the two: they add up to one. On an axis with two ends and one cell the first has it all.
    pub weights: [f64; 2],
}

impl Tent {
    /// The tents over `x` in \[0, 1\] on an axis of `n` cells, a power of two.
    ///
    /// Before the first centre and after the last the value stays that of the cell, or, if the axis `wraps`, runs over to
    /// the cell at the other end. Either way the tent of every cell has the area of one cell.
    #[inline(always)]
    #[must_use]
    pub fn at(x: f64, n: usize, wraps: bool) -> Self {
        let (lower, weight) = if wraps { around(x, n) } else { along(x, n) };
        Self::of(lower, weight, n)
    }

    /// From the lower cell and the weight of the upper one.
    #[inline(always)]
    fn of(lower: u32, weight: f64, n: usize) -> Self {
        let lower = lower as usize;
        Self {
            cells: [lower, (lower + 1) & (n - 1)],
            weights: [1.0 - weight, weight],
        }
    }
}

/// Added to a number, it leaves the nearest integer in the low bits: 1.5 · 2⁵².
const INTEGER: f64 = 6_755_399_441_055_744.0;

/// The integer below a number, and what is beyond it. Of an integer it is either this one or, with a rest of 1, the one before:
/// the even one. In a few steps that every processor takes for several numbers at a time.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "the low bits")]
fn cut(t: f64) -> (u32, f64) {
    let lower = (t - 0.5) + INTEGER;
    (lower.to_bits() as u32, t - (lower - INTEGER))
}

/// The lower cell and the weight of the upper one on an axis with two ends.
#[inline(always)]
fn along(x: f64, n: usize) -> (u32, f64) {
    let (t, last) = (x * n as f64 - 0.5, (n - 1) as f64); // in cells, from the first centre
    let t = if t > 0.0 { t } else { 0.0 };
    // The last centre is an odd number, so that the cell before it is found; of a single cell it is 0, and found itself.
    cut(if t < last { t } else { last })
}

/// The same on an axis that closes upon itself.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "cells of an axis")]
fn around(x: f64, n: usize) -> (u32, f64) {
    let (lower, weight) = cut(x * n as f64 - 0.5);
    (lower & (n as u32 - 1), weight)
}

/// The tents over several points on one axis.
pub struct Tents {
    lower: [u32; Self::MOST],
    /// Of the upper cells.
    weight: [f64; Self::MOST],
    /// Of the axis.
    cells: usize,
}

impl Default for Tents {
    /// None yet.
    fn default() -> Self {
        Self {
            lower: [0; Self::MOST],
            weight: [0.0; Self::MOST],
            cells: 1,
        }
    }
}

impl Tents {
    /// Points that are looked up at a time: their numbers stay in the processor's nearest memory.
    pub const MOST: usize = 128;

    /// Looks up points `x` on an axis of `n` cells; see [`Tent::at`].
    #[inline(always)]
    pub fn look_up(&mut self, x: &[f64], n: usize, wraps: bool) {
        self.cells = n;
        let places = self.lower.iter_mut().zip(&mut self.weight).zip(x);
        if wraps {
            places.for_each(|((lower, weight), x)| (*lower, *weight) = around(*x, n));
        } else {
            places.for_each(|((lower, weight), x)| (*lower, *weight) = along(*x, n));
        }
    }

    /// The tent over a point.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, point: usize) -> Tent {
        Tent::of(self.lower[point], self.weight[point], self.cells)
    }

    /// The cells of points, if they are the same for all.
    #[inline(always)]
    #[must_use]
    pub fn shared(&self, points: Range<usize>) -> Option<[usize; 2]> {
        let first = self.lower[points.start];
        // All of them, without a way out: several at a time.
        let others = self.lower[points]
            .iter()
            .fold(0, |found, lower| found | (lower ^ first));
        (others == 0).then(|| Tent::of(first, 0.0, self.cells).cells)
    }

    /// The weights of the upper cells of points.
    #[inline(always)]
    #[must_use]
    pub fn weights(&self, points: Range<usize>) -> &[f64] {
        &self.weight[points]
    }
}

/// A point under the tent of cell `cell`, from a uniform number: density n · tent.
#[inline]
#[must_use]
pub fn under_tent(cell: usize, u: f64, n: usize, wraps: bool) -> f64 {
    inside((cell as f64 + 0.5 + tent_offset(u)) / n as f64, wraps)
}

/// A number from −1 to 1 whose density is a tent, from a uniform one in (0, 1).
#[inline(always)]
pub(super) fn tent_offset(u: f64) -> f64 {
    // One root for either side, without a branch.
    let low = u < 0.5;
    let aside = 1.0 - (2.0 * if low { u } else { 1.0 - u }).sqrt();
    if low { -aside } else { aside }
}

/// Brings a coordinate back that has left \[0, 1\] by less than one: on the other side, or reflected.
#[inline]
#[must_use]
pub fn inside(x: f64, wraps: bool) -> f64 {
    match (wraps, x) {
        (true, x) if x < 0.0 => x + 1.0,
        (true, x) if x > 1.0 => x - 1.0,
        (false, x) if x < 0.0 => -x,
        (false, x) if x > 1.0 => 2.0 - x,
        _ => x,
    }
}

/// The cell of a coordinate from 0 to 1, both included, on an axis of `n` cells.
#[inline(always)]
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to n")]
pub fn cell_of(x: f64, n: usize) -> usize {
    ((x * n as f64) as usize).min(n - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tents_add_up_to_one_and_each_has_the_area_of_a_cell() {
        for (n, wraps) in [(1, false), (2, true), (8, false), (8, true)] {
            let mut area = vec![0.0; n];
            let steps = 8000;
            for i in 0..steps {
                let tent = Tent::at((f64::from(i) + 0.5) / f64::from(steps), n, wraps);
                for (cell, weight) in tent.cells.iter().zip(tent.weights) {
                    assert!((0.0..=1.0).contains(&weight));
                    area[*cell] += weight * n as f64 / f64::from(steps);
                }
            }
            assert!(area.iter().all(|a| (a - 1.0).abs() < 1e-9), "{n} {area:?}");
        }
        assert_eq!(
            (Tent::at(1.0, 4, false).cells, Tent::at(1.0, 4, false).weights),
            ([2, 3], [0.0, 1.0])
        );
        assert_eq!(
            (Tent::at(0.0, 4, false).cells, Tent::at(0.0, 4, false).weights),
            ([0, 1], [1.0, 0.0])
        );
        assert_eq!(
            (Tent::at(0.7, 1, false).cells, Tent::at(0.7, 1, false).weights),
            ([0, 0], [1.0, 0.0])
        );
        assert_eq!(Tent::at(0.0, 4, true).cells, [3, 0]);
    }

    #[test]
    fn many_at_a_time_are_those_of_each() {
        let x: Vec<f64> = (0..100).map(|i| f64::from(i) / 99.0).collect();
        for (n, wraps) in [(1, false), (1, true), (2, true), (8, false), (8, true)] {
            let mut tents = Tents::default();
            tents.look_up(&x, n, wraps);
            for (i, x) in x.iter().enumerate() {
                assert_eq!(tents.get(i), Tent::at(*x, n, wraps));
            }
        }
    }

    #[test]
    fn points_under_a_tent_have_its_distribution() {
        // The share of quantiles below each bin edge is the integral of the tent up to it.
        for (n, wraps) in [(4, false), (4, true)] {
            for cell in 0..n {
                let steps = 40_000;
                let mut bins = vec![0.0; 16];
                let mut expected = vec![0.0; 16];
                for i in 0..steps {
                    let u = (f64::from(i) + 0.5) / f64::from(steps);
                    let x = under_tent(cell, u, n, wraps);
                    bins[cell_of(x, 16)] += 1.0 / f64::from(steps);
                    let tent = Tent::at(u, n, wraps);
                    for (c, w) in tent.cells.iter().zip(tent.weights) {
                        if *c == cell {
                            expected[cell_of(u, 16)] += w * n as f64 / f64::from(steps);
                        }
                    }
                }
                for (a, b) in bins.iter().zip(&expected) {
                    assert!((a - b).abs() < 1e-3, "{n} {wraps} {cell} {bins:?} {expected:?}");
                }
            }
        }
    }
}
