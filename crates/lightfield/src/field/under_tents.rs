//! Points under a factor times a tent of another grid, drawn exactly.
//!
//! A factor is a sum of hats about the centres of its cells, each a product of one function along either axis, as the tent is. So a
//! hat is picked by what it contributes under the tent, and each coordinate is drawn by itself, under a hat times a tent: by
//! rejection, from the narrower of the two.

use etendue_sampling::alias::Aliases;

use super::factor::Factor;
use super::tent::{inside, tent_offset};

/// Draws points under `factor · tent`, for each tent of a grid.
#[derive(Clone, Debug)]
pub struct UnderTents {
    axes: [Axis; 2],
    /// For each tent of either axis the middle of the first hat under it, from that of the tent, and how many hats there are.
    firsts: [Vec<(f64, usize)>; 2],
    /// For each tent the hats that lie under it, by what they contribute; without entries where the factor is 0.
    tables: Aliases,
}

impl UnderTents {
    /// Under tents of a grid of so many cells along each axis.
    #[must_use]
    pub fn new(factor: &Factor, cells: [usize; 2]) -> Self {
        let axes = [0, 1].map(|k| Axis {
            hats: factor.side(),
            tents: cells[k],
            half: factor.side() as f64 / cells[k] as f64,
            wraps: k == 0 && factor.wraps(),
        });
        let mut tables = Aliases::default();
        let mut weights = Vec::new();
        for i in 0..cells[0] {
            for j in 0..cells[1] {
                let [rows, columns] = [axes[0].under(i), axes[1].under(j)];
                weights.clear();
                for row in &rows {
                    let of = |column: &Hat| factor.node(row.cell, column.cell) * (row.share * column.share);
                    weights.extend(columns.iter().map(of));
                }
                tables.push(&weights);
            }
        }
        let firsts = axes.map(|axis| {
            (0..axis.tents)
                .map(|tent| (axis.first(tent), axis.count(tent)))
                .collect()
        });
        Self { axes, firsts, tables }
    }

    /// One of the hats under a tent, from a uniform number in (0, 1); None if the factor is 0 all over the tent.
    #[inline(always)]
    #[must_use]
    pub fn pick(&self, tent: [usize; 2], number: f64) -> Option<usize> {
        self.tables.pick(tent[0] * self.axes[1].tents + tent[1], number)
    }

    /// A point with density proportional to `hat · tent`, from `next`, a source of uniform numbers in (0, 1); the centre of the
    /// tent if there is no hat. With a hat from [`Self::pick`] the density is proportional to `factor · tent`.
    #[inline(always)]
    pub fn point(&self, tent: [usize; 2], hat: Option<usize>, mut next: impl FnMut() -> f64) -> [f64; 2] {
        let [rows, columns] = &self.axes;
        let Some(hat) = hat else {
            return [rows.point(tent[0], 0.0), columns.point(tent[1], 0.0)];
        };
        let ((row, _), (column, many)) = (self.firsts[0][tent[0]], self.firsts[1][tent[1]]);
        [
            rows.draw(tent[0], row + (hat / many) as f64, &mut next),
            columns.draw(tent[1], column + (hat % many) as f64, &mut next),
        ]
    }
}

/// One axis, on which hats of one grid meet tents of another. Lengths are in cells of the hats; both go on beyond the ends, where
/// they are reflected, or the axis closes upon itself.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Cells of either grid.
    hats: usize,
    tents: usize,
    /// Half the width of a tent.
    half: f64,
    wraps: bool,
}

/// A hat under a tent.
struct Hat {
    /// The cell of the factor that it belongs to.
    cell: usize,
    /// ∫ hat · tent.
    share: f64,
}

impl Axis {
    /// The middle of a tent.
    fn middle(self, tent: usize) -> f64 {
        (tent as f64 + 0.5) * self.half
    }

    /// The middle of the first hat under a tent, from that of the tent.
    fn first(self, tent: usize) -> f64 {
        let middle = self.middle(tent);
        (middle - self.half - 0.5).floor() + 0.5 - middle
    }

    /// How many hats lie under a tent.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "no more than there are cells, and two"
    )]
    fn count(self, tent: usize) -> usize {
        (self.half + 1.0 - self.first(tent)).ceil() as usize
    }

    /// The hats under a tent.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "the number of a cell, or of one beyond the ends"
    )]
    fn under(self, tent: usize) -> Vec<Hat> {
        let (first, n) = (self.first(tent), self.hats as i64);
        let begin = (first + self.middle(tent)).floor() as i64;
        let hat = |k: usize| {
            let cell = begin + k as i64;
            let within = match cell {
                cell if self.wraps => cell.rem_euclid(n),
                cell if cell < 0 => -1 - cell,
                cell if cell >= n => 2 * n - 1 - cell,
                cell => cell,
            };
            Hat {
                cell: usize::try_from(within).map_or(0, |cell| cell.min(self.hats - 1)),
                share: overlap(first + k as f64, self.half),
            }
        };
        (0..self.count(tent)).map(hat).collect()
    }

    /// A coordinate under a tent, as far from its middle.
    fn point(self, tent: usize, offset: f64) -> f64 {
        inside((self.middle(tent) + offset) / self.hats as f64, self.wraps)
    }

    /// A coordinate under a tent and a hat whose middle is as far from that of the tent.
    #[inline]
    fn draw(self, tent: usize, hat: f64, next: &mut impl FnMut() -> f64) -> f64 {
        let half = self.half;
        // From the narrower of the two, against the highest value of the wider one there.
        let (from, width, other, reach) = if half < 1.0 {
            (0.0, half, hat, 1.0)
        } else {
            (hat, 1.0, 0.0, half)
        };
        let highest = 1.0 - ((hat.abs() - width) / reach).max(0.0);
        loop {
            let offset = from + width * tent_offset(next());
            if next() * highest <= 1.0 - (offset - other).abs() / reach {
                return self.point(tent, offset);
            }
        }
    }
}

/// ∫ (1 − |s − d|) (1 − |s|/f) ds, where both factors are positive: by Simpson's rule, as both are linear between where they bend.
fn overlap(d: f64, f: f64) -> f64 {
    let product = |s: f64| (1.0 - (s - d).abs()).max(0.0) * (1.0 - s.abs() / f).max(0.0);
    let mut bends = [-f, 0.0, f, d - 1.0, d, d + 1.0];
    bends.sort_by(f64::total_cmp);
    let piece = |pair: &[f64]| {
        let (a, b) = (pair[0], pair[1]);
        (b - a) / 6.0 * (product(a) + 4.0 * product(0.5 * (a + b)) + product(b))
    };
    bends.windows(2).map(piece).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::tent::{Tent, cell_of};
    use etendue_sampling::philox::Stream;

    fn factor(n: usize, wraps: bool) -> Factor {
        let values = (0..n * n)
            .map(|i| ((i * i * 31 + 7 * i) % 17) as f64 * ((i % 3) as f64))
            .collect();
        Factor::new(n, values, wraps).expect("sound")
    }

    #[test]
    fn draws_have_the_density_of_factor_times_tent() {
        // χ² over 8 × 8 bins of the square, for inner, border and wrapped tents, of factors finer and coarser than the tents'
        // grid, along one axis or both; 1 000 000 draws; 1e-4 of 63 degrees, over 15 trials: 128.
        let cells = [(false, [1, 2]), (false, [0, 0]), (true, [0, 3])];
        let sides = [(16, [4, 4]), (4, [4, 4]), (16, [8, 4]), (2, [4, 8]), (8, [4, 16])];
        for ((wraps, cell), (side, grid)) in cells.into_iter().flat_map(|c| sides.map(|s| (c, s))) {
            let factor = factor(side, wraps);
            let under = UnderTents::new(&factor, grid);
            let (draws, bins) = (1_000_000, 8);
            let mut counts = vec![0.0; bins * bins];
            let stream = Stream::new(9, 1);
            for i in 0..draws {
                let (mut block, mut used, mut numbers) = (0, 4, [0.0; 4]);
                let mut next = || {
                    if used == 4 {
                        (numbers, used, block) = (stream.uniforms(i, block), 0, block + 1);
                    }
                    used += 1;
                    numbers[used - 1]
                };
                let hat = under.pick(cell, next());
                let point = under.point(cell, hat, &mut next);
                let bin = point.map(|x| cell_of(x, bins));
                counts[bin[0] * bins + bin[1]] += 1.0;
            }
            let mut expected = vec![0.0; bins * bins];
            let fine = 512;
            for i in 0..fine {
                for j in 0..fine {
                    let point = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(fine));
                    let (x, y) = (Tent::at(point[0], grid[0], wraps), Tent::at(point[1], grid[1], false));
                    let weight = |t: Tent, c: usize| {
                        t.cells
                            .iter()
                            .zip(t.weights)
                            .filter(|(k, _)| **k == c)
                            .map(|(_, w)| w)
                            .sum::<f64>()
                    };
                    let density = factor.at(point) * weight(x, cell[0]) * weight(y, cell[1]);
                    let bin = point.map(|x| cell_of(x, bins));
                    expected[bin[0] * bins + bin[1]] += density / f64::from(fine * fine);
                }
            }
            let total: f64 = expected.iter().sum();
            let mut chi2 = 0.0;
            for (n, e) in counts.iter().zip(&expected) {
                let e = e / total * draws as f64;
                if e > 0.0 {
                    chi2 += (n - e) * (n - e) / e;
                } else {
                    assert_eq!(*n, 0.0);
                }
            }
            assert!(chi2 < 128.0, "{wraps} {cell:?} {side} {grid:?}: {chi2}");
        }
    }
}
