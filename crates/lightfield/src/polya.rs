//! Optional Pólya tree: the average over all ways to split a dyadic grid, in closed form.
//!
//! A box of the grid is either left whole, with probability 1 − ρ, or split in half along one of its axes, each with the
//! same share of ρ; the share of its mass that falls into the lower half then has a Beta prior with concentration c about
//! the share of the base measure. Every axis-parallel dyadic partition has its prior probability, every one is averaged
//! with its posterior probability, and no bin width is ever chosen. `[WongMa2010]`, `[Hutter2005]`; theory eqs. 29 to 32.

use std::ops::Range;

/// Probability that a box is split, before any data (Wong & Ma 2010, section 3).
const SPLIT: f64 = 0.5;

/// A grid of 2^`depths[k]` cells along axis k, last axis fastest.
#[derive(Clone, Debug)]
pub struct Grid {
    depths: Vec<u32>,
    /// Where the boxes of each level begin, in order of the mixed-radix number of the level.
    offsets: Vec<usize>,
}

/// What the tree knows after the data; one entry per cell.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// Posterior mean of mass over base mass. Σ ratio · base = 1.
    pub ratio: Vec<f64>,
    /// Posterior mean of the square of that ratio.
    pub ratio_squared: Vec<f64>,
    /// ln of the evidence against the base measure: how much more likely the data are under the tree.
    pub log_evidence: f64,
}

impl Grid {
    /// A grid; None if it has no axis, or more than 2^34 boxes on all levels together.
    #[must_use]
    pub fn new(depths: Vec<u32>) -> Option<Self> {
        let boxes = depths
            .iter()
            .map(|d| f64::from((*d).min(64) + 1).exp2())
            .product::<f64>();
        if depths.is_empty() || boxes > 2.0_f64.powi(34) {
            return None;
        }
        let levels: usize = depths.iter().map(|d| *d as usize + 1).product();
        let mut grid = Self {
            depths,
            offsets: Vec::with_capacity(levels + 1),
        };
        let mut offset = 0;
        for id in 0..levels {
            grid.offsets.push(offset);
            offset += 1_usize << grid.level(id).iter().sum::<u32>();
        }
        grid.offsets.push(offset);
        Some(grid)
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        1 << self.depths.iter().sum::<u32>()
    }

    /// How often each axis is halved on level `id`.
    fn level(&self, mut id: usize) -> Vec<u32> {
        let mut level = vec![0; self.depths.len()];
        for (l, d) in level.iter_mut().zip(&self.depths).rev() {
            let radix = *d as usize + 1;
            *l = u32::try_from(id % radix).expect("below the depth");
            id /= radix;
        }
        level
    }

    /// The boxes of level `id` in arrays over all boxes.
    fn range(&self, id: usize) -> Range<usize> {
        self.offsets[id]..self.offsets[id + 1]
    }

    /// The level of the cells.
    fn finest(&self) -> usize {
        self.offsets.len() - 2
    }

    /// The axes along which boxes of level `id` can be halved.
    fn splits(&self, id: usize) -> Vec<Split> {
        let level = self.level(id);
        let mut stride = 1;
        let mut splits = Vec::new();
        let mut low_bits = 0;
        for axis in (0..level.len()).rev() {
            if level[axis] < self.depths[axis] {
                splits.push(Split {
                    start: self.offsets[id + stride],
                    low_bits,
                });
            }
            stride *= self.depths[axis] as usize + 1;
            low_bits += level[axis];
        }
        splits
    }
}

/// How the halves of a box along one axis are found.
#[derive(Clone, Copy, Debug)]
struct Split {
    /// Where the boxes of the finer level begin.
    start: usize,
    /// Bits of a box's number that belong to the axes after the split one.
    low_bits: u32,
}

impl Split {
    /// The lower and the upper half of box number `index` of its level.
    fn halves(self, index: usize) -> (usize, usize) {
        let (high, low) = (index >> self.low_bits, index & ((1 << self.low_bits) - 1));
        let lower = self.start + (high << (self.low_bits + 1)) + low;
        (lower, lower + (1 << self.low_bits))
    }
}

/// Sums over every box of every level.
struct Boxes {
    /// Σ w.
    weight: Vec<f64>,
    /// Σ w².
    weight_squared: Vec<f64>,
    /// Base mass.
    base: Vec<f64>,
}

impl Boxes {
    fn new(grid: &Grid, weight: &[f64], weight_squared: &[f64], base: &[f64]) -> Self {
        let spread = |cells: &[f64]| {
            let mut all = vec![0.0; *grid.offsets.last().expect("has an end")];
            all[grid.range(grid.finest())].copy_from_slice(cells);
            for id in (0..grid.finest()).rev() {
                let split = grid.splits(id)[0];
                for (index, at) in grid.range(id).enumerate() {
                    let (lower, upper) = split.halves(index);
                    all[at] = all[lower] + all[upper];
                }
            }
            all
        };
        Self {
            weight: spread(weight),
            weight_squared: spread(weight_squared),
            base: spread(base),
        }
    }

    /// Number of equal rays as good as those of a box: (Σ w)²/Σ w².
    fn effective(&self, at: usize) -> f64 {
        if self.weight_squared[at] > 0.0 {
            self.weight[at] * self.weight[at] / self.weight_squared[at]
        } else {
            0.0
        }
    }

    /// The two halves as a Beta-binomial trial: prior shares and effective counts.
    fn trial(&self, at: usize, lower: usize, upper: usize) -> Trial {
        let n = self.effective(at);
        let share = if self.weight[at] > 0.0 {
            self.weight[lower] / self.weight[at]
        } else {
            0.0
        };
        let base = self.base[lower] + self.base[upper];
        let p = if base > 0.0 {
            [self.base[lower] / base, self.base[upper] / base]
        } else {
            [0.5, 0.5]
        };
        Trial {
            p,
            n: [n * share, n * (1.0 - share)],
        }
    }
}

/// One split of one box: the prior shares of its halves and the effective counts in them.
#[derive(Clone, Copy)]
struct Trial {
    p: [f64; 2],
    n: [f64; 2],
}

impl Trial {
    /// Whether one half has no base mass, so that nothing is split off.
    fn is_void(self) -> bool {
        self.p[0] == 0.0 || self.p[1] == 0.0
    }

    /// ln of the Beta-binomial evidence of the split against the base measure.
    fn log_bayes_factor(self, c: f64) -> f64 {
        let [n0, n1] = self.n;
        if self.is_void() || n0 + n1 == 0.0 {
            return 0.0;
        }
        let [a0, a1] = self.p.map(|p| c * p);
        log_beta(a0 + n0, a1 + n1) - log_beta(a0, a1) - n0 * self.p[0].ln() - n1 * self.p[1].ln()
    }

    /// Posterior means of θ/p and (θ/p)² of one half.
    fn moments(self, half: usize, c: f64) -> (f64, f64) {
        if self.is_void() {
            return (1.0, 1.0);
        }
        let p = self.p[half];
        let (alpha, total) = (c * p + self.n[half], c + self.n[0] + self.n[1]);
        let mean = alpha / total;
        (mean / p, mean * (alpha + 1.0) / (total + 1.0) / (p * p))
    }
}

fn log_beta(a: f64, b: f64) -> f64 {
    libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b)
}

/// ln of the evidence of a box, theory eq. 30, with the terms of its sum put into `terms`, the undivided box first.
fn log_evidence(
    boxes: &Boxes,
    log_r: &[f64],
    splits: &[Split],
    at: usize,
    index: usize,
    c: f64,
    terms: &mut Vec<f64>,
) -> f64 {
    terms.clear();
    terms.push((1.0 - SPLIT).ln());
    let share = (SPLIT / splits.len() as f64).ln();
    for split in splits {
        let (lower, upper) = split.halves(index);
        let factor = boxes.trial(at, lower, upper).log_bayes_factor(c);
        terms.push(share + factor + log_r[lower] + log_r[upper]);
    }
    let top = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    top + terms.iter().map(|t| (t - top).exp()).sum::<f64>().ln()
}

/// The posterior of the tree for weighted points: Σ w and Σ w² per cell, the base mass per cell, the concentration c.
///
/// Σ w² turns unequal weights into effective counts, box by box; with w = 1 both sums are the counts. Cells without base
/// mass hold no mass and must hold no points. Time and memory are those of Π(2^(d+1) − 1) boxes.
///
/// # Panics
/// If an array has not one entry per cell.
#[must_use]
pub fn posterior(grid: &Grid, weight: &[f64], weight_squared: &[f64], base: &[f64], c: f64) -> Posterior {
    assert!(
        [weight.len(), weight_squared.len(), base.len()]
            .iter()
            .all(|n| *n == grid.cells()),
        "one entry per cell"
    );
    let boxes = Boxes::new(grid, weight, weight_squared, base);
    let finest = grid.finest();
    let mut terms = Vec::new();
    let mut log_r = vec![0.0; boxes.weight.len()];
    for id in (0..finest).rev() {
        let splits = grid.splits(id);
        for (index, at) in grid.range(id).enumerate() {
            // An empty box says nothing: every term of its evidence is its prior, and they sum to one.
            if boxes.weight[at] > 0.0 {
                log_r[at] = log_evidence(&boxes, &log_r, &splits, at, index, c, &mut terms);
            }
        }
    }
    // From the root down: the flow of the mean (and mean square) of the ratio into each box, and what stops there.
    let mut flow = vec![[0.0; 2]; log_r.len()];
    flow[0] = [1.0; 2];
    for id in 0..finest {
        let splits = grid.splits(id);
        for (index, at) in grid.range(id).enumerate() {
            let log_total = log_evidence(&boxes, &log_r, &splits, at, index, c, &mut terms);
            let [mean, square] = flow[at];
            for (split, term) in splits.iter().zip(&terms[1..]) {
                let probability = (term - log_total).exp();
                let (lower, upper) = split.halves(index);
                let trial = boxes.trial(at, lower, upper);
                for (half, child) in [lower, upper].into_iter().enumerate() {
                    let (m1, m2) = trial.moments(half, c);
                    flow[child][0] += probability * mean * m1;
                    flow[child][1] += probability * square * m2;
                }
            }
            let stop = (terms[0] - log_total).exp();
            flow[at] = [mean * stop, square * stop];
        }
    }
    let cells = gather(grid, flow);
    Posterior {
        ratio: cells.iter().map(|cell| cell[0]).collect(),
        ratio_squared: cells.iter().map(|cell| cell[1]).collect(),
        log_evidence: log_r[0],
    }
}

/// Each cell's sum over all boxes that contain it: one sweep per axis.
fn gather(grid: &Grid, mut stopped: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let mut stride = 1;
    for axis in (0..grid.depths.len()).rev() {
        for id in 0..grid.finest() {
            let level = grid.level(id);
            // Axes already swept have given everything to their finest level.
            let swept = level[axis + 1..]
                .iter()
                .zip(&grid.depths[axis + 1..])
                .all(|(l, d)| l == d);
            if swept && level[axis] < grid.depths[axis] {
                let split = Split {
                    start: grid.offsets[id + stride],
                    low_bits: level[axis + 1..].iter().sum(),
                };
                for (index, at) in grid.range(id).enumerate() {
                    let (lower, upper) = split.halves(index);
                    let [mean, square] = stopped[at];
                    for half in [lower, upper] {
                        stopped[half][0] += mean;
                        stopped[half][1] += square;
                    }
                }
            }
        }
        stride *= grid.depths[axis] as usize + 1;
    }
    stopped[grid.range(grid.finest())].to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn integers(cells: usize, seed: u64) -> Vec<f64> {
        (0..cells as u64)
            .map(|i| ((i * i * 7 + seed * 13 + i) % 11) as f64)
            .collect()
    }

    #[test]
    fn two_cells_are_one_beta_binomial_trial() {
        // Σ over "whole" and "split" by hand: B = Beta(c/2+3, c/2+1)/Beta(c/2, c/2) · 2^4.
        let grid = Grid::new(vec![1]).expect("small");
        let post = posterior(&grid, &[3.0, 1.0], &[3.0, 1.0], &[0.5, 0.5], 2.0);
        let b = (libm::tgamma(4.0) * libm::tgamma(2.0) / libm::tgamma(6.0)) * 16.0;
        let r: f64 = 0.5 + 0.5 * b;
        assert!((post.log_evidence - r.ln()).abs() < 1e-14);
        let split = 0.5 * b / r;
        assert!((post.ratio[0] - ((1.0 - split) + split * 2.0 * 4.0 / 6.0)).abs() < 1e-14);
        assert!((post.ratio_squared[0] - ((1.0 - split) + split * 4.0 * (4.0 * 5.0) / (6.0 * 7.0))).abs() < 1e-14);
    }

    #[test]
    fn mass_is_conserved_for_any_base_and_any_weights() {
        for depths in [vec![5], vec![3, 4], vec![2, 1, 3], vec![2, 2, 1, 2], vec![0, 3]] {
            let grid = Grid::new(depths).expect("small");
            let n = grid.cells();
            let base: Vec<f64> = integers(n, 3)
                .iter()
                .map(|v| v + f64::from(u8::from(*v > 0.0)))
                .collect();
            let total: f64 = base.iter().sum();
            let base: Vec<f64> = base.iter().map(|v| v / total).collect();
            let masked = |v: Vec<f64>| -> Vec<f64> {
                v.iter()
                    .zip(&base)
                    .map(|(v, b)| if *b > 0.0 { *v } else { 0.0 })
                    .collect()
            };
            let weight = masked(integers(n, 1));
            let squared: Vec<f64> = weight.iter().map(|w| w * 1.7).collect();
            let post = posterior(&grid, &weight, &squared, &base, 3.0);
            let mass: f64 = post.ratio.iter().zip(&base).map(|(r, b)| r * b).sum();
            assert!((mass - 1.0).abs() < 1e-12, "{mass}");
            assert!(
                post.ratio
                    .iter()
                    .zip(&post.ratio_squared)
                    .all(|(m, s)| *s >= m * m * (1.0 - 1e-12))
            );
        }
    }

    #[test]
    fn axes_play_the_same_part() {
        let (rows, columns) = (8, 16);
        let counts = integers(rows * columns, 5);
        let transposed: Vec<f64> = (0..columns)
            .flat_map(|c| (0..rows).map(move |r| (r, c)))
            .map(|(r, c)| counts[r * columns + c])
            .collect();
        let base = vec![1.0 / 128.0; 128];
        let a = posterior(&Grid::new(vec![3, 4]).expect("small"), &counts, &counts, &base, 3.0);
        let b = posterior(
            &Grid::new(vec![4, 3]).expect("small"),
            &transposed,
            &transposed,
            &base,
            3.0,
        );
        assert!((a.log_evidence - b.log_evidence).abs() < 1e-10);
        for r in 0..rows {
            for c in 0..columns {
                assert!((a.ratio[r * columns + c] - b.ratio[c * rows + r]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn refuses_absurd_grids() {
        assert!(Grid::new(vec![]).is_none());
        assert!(Grid::new(vec![20, 20]).is_none());
        assert!(Grid::new(vec![u32::MAX / 2]).is_none());
    }
}
