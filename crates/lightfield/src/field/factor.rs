//! A factor of a light field over the place or over the direction: bilinear between the centres of a fine grid.

use std::ops::Range;

use super::tent::{Tent, Tents, inside};

/// A positive function on the unit square.
#[derive(Clone, Debug)]
pub struct Factor {
    /// Cells along each axis, a power of two.
    n: usize,
    /// Values at the cell centres, second axis fastest.
    values: Vec<f64>,
    /// Whether the first axis closes upon itself.
    wraps: bool,
}

impl Factor {
    /// A factor from the values at the centres of n × n cells; None if they are not n², negative or not finite.
    #[must_use]
    pub fn new(n: usize, values: Vec<f64>, wraps: bool) -> Option<Self> {
        let sound = n.is_power_of_two() && values.len() == n * n && values.iter().all(|v| *v >= 0.0 && v.is_finite());
        sound.then_some(Self { n, values, wraps })
    }

    /// The constant 1.
    #[must_use]
    pub fn one() -> Self {
        Self::constant(1.0)
    }

    /// A constant.
    pub(super) fn constant(value: f64) -> Self {
        Self {
            n: 1,
            values: vec![value],
            wraps: false,
        }
    }

    /// Whether it is that constant.
    #[must_use]
    pub fn is_one(&self) -> bool {
        self.values == [1.0]
    }

    /// Cells along each axis.
    #[must_use]
    pub const fn side(&self) -> usize {
        self.n
    }

    /// The value at the centre of a cell.
    #[must_use]
    pub fn node(&self, row: usize, column: usize) -> f64 {
        self.values[row * self.n + column]
    }

    /// The value at a point of the square.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, point: [f64; 2]) -> f64 {
        if self.n == 1 {
            return self.values[0];
        }
        let [x, y] = [
            Tent::at(point[0], self.n, self.wraps),
            Tent::at(point[1], self.n, false),
        ];
        bilinear(&self.corners([x.cells, y.cells]), [x.weights, y.weights])
    }

    /// The values at the corners of a point among several cells; those of the second axis lie side by side.
    #[inline(always)]
    fn corners(&self, [x, y]: [[usize; 2]; 2]) -> [[f64; 2]; 2] {
        x.map(|row| next_to(&self.values, row * self.n + y[0]))
    }

    /// Asks for the entries between two corners of the square, a few at a time: as points ask for them, one after the other,
    /// the processor would wait for most of them. Not if there are more than `most`.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 to n: the corners lie in the square"
    )]
    pub(super) fn fetch(&self, lower: [f64; 2], upper: [f64; 2], most: usize) {
        /// Entries that come from memory together.
        const LINE: usize = 8;
        let cell = |x: f64| ((x * self.n as f64) as usize).min(self.n - 1);
        let [rows, columns] = [0, 1].map(|k| cell(lower[k])..cell(upper[k]) + 1);
        if rows.len() * columns.len() > LINE * most {
            return;
        }
        let row = |row: usize| self.values[row * self.n..][columns.clone()].iter().step_by(LINE);
        std::hint::black_box(rows.flat_map(row).sum::<f64>());
    }

    /// The values at some points of the square, at most [`Tents::MOST`], given by their coordinates.
    #[inline(always)]
    pub(super) fn fill(&self, points: [&[f64]; 2], [x, y]: [&mut Tents; 2], values: &mut [f64]) {
        if self.n == 1 {
            values.fill(self.values[0]);
            return;
        }
        x.look_up(points[0], self.n, self.wraps);
        y.look_up(points[1], self.n, false);
        for (some, values) in groups(values) {
            let weights = x.weights(some.clone()).iter().zip(y.weights(some.clone()));
            let weights = weights.map(|(x, y)| [[1.0 - x, *x], [1.0 - y, *y]]);
            if let (Some(rows), Some(columns)) = (x.shared(some.clone()), y.shared(some.clone())) {
                let corners = self.corners([rows, columns]);
                for (value, weights) in values.iter_mut().zip(weights) {
                    *value = bilinear(&corners, weights);
                }
            } else {
                for ((value, weights), i) in values.iter_mut().zip(weights).zip(some) {
                    *value = bilinear(&self.corners([x.get(i).cells, y.get(i).cells]), weights);
                }
            }
        }
    }

    /// The sampler of this factor under tents of a grid of `cells` cells along each axis.
    #[must_use]
    pub fn under_tents(&self, cells: [usize; 2]) -> UnderTents {
        UnderTents::new(self, cells)
    }
}

/// Between four corners.
#[inline(always)]
fn bilinear([lower, upper]: &[[f64; 2]; 2], [x, y]: [[f64; 2]; 2]) -> f64 {
    let along: [f64; 2] = std::array::from_fn(|k| lower[k] * x[0] + upper[k] * x[1]);
    along[0] * y[0] + along[1] * y[1]
}

/// Points that are asked whether they share their cells: about those of a pixel.
const GROUP: usize = 16;

/// The numbers of some points in groups, with the numbers of the points.
pub(super) fn groups(values: &mut [f64]) -> impl Iterator<Item = (Range<usize>, &mut [f64])> {
    let groups = values.chunks_mut(GROUP).enumerate();
    groups.map(|(index, values)| (index * GROUP..index * GROUP + values.len(), values))
}

/// N numbers from place `at` on.
#[inline(always)]
pub(super) fn next_to<const N: usize, T: Copy>(values: &[T], at: usize) -> [T; N] {
    *values[at..].first_chunk().expect("neighbours lie within the table")
}

/// Draws points under `factor · tent`, for each tent of a coarser grid, exactly.
///
/// Between the centres and the edges of the finer cells both functions are linear in each coordinate. Over such pieces the
/// integral of their product is Simpson's rule; a piece is drawn by its integral, and the point in it by rejection against
/// the largest corner.
#[derive(Clone, Debug)]
pub struct UnderTents {
    /// Cells of the tents' grid.
    cells: [usize; 2],
    /// Pieces along each axis within one cell of the tents' grid.
    pieces: [usize; 2],
    wraps: bool,
    /// For each tent the running sums of the integrals over its pieces.
    sums: Vec<f64>,
}

impl UnderTents {
    fn new(factor: &Factor, cells: [usize; 2]) -> Self {
        // A half of a fine cell, or of a coarse cell where that is smaller.
        let pieces = cells.map(|c| 2 * (factor.n / c).max(1));
        let mut under = Self {
            cells,
            pieces,
            wraps: factor.wraps,
            sums: Vec::with_capacity(cells[0] * cells[1] * under_count(pieces)),
        };
        for i in 0..cells[0] {
            for j in 0..cells[1] {
                let mut sum = 0.0;
                for piece in 0..under_count(pieces) {
                    sum += under.integral(factor, [i, j], piece);
                    under.sums.push(sum);
                }
            }
        }
        under
    }

    /// Lower corner of a piece under a tent, in cells of the tents' grid from the tent's centre, and its extent.
    fn piece(&self, piece: usize) -> ([f64; 2], [f64; 2]) {
        let extent = self.pieces.map(|p| 1.0 / p as f64);
        let index = [piece / (2 * self.pieces[1]), piece % (2 * self.pieces[1])];
        ([0, 1].map(|k| index[k] as f64 * extent[k] - 1.0), extent)
    }

    /// The point of the square at an offset from the centre of a cell.
    fn point(&self, cell: [usize; 2], offset: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| {
            let x = (cell[k] as f64 + 0.5 + offset[k]) / self.cells[k] as f64;
            inside(x, k == 0 && self.wraps)
        })
    }

    /// ∫ factor · tent over a piece, in cells of the tents' grid.
    fn integral(&self, factor: &Factor, cell: [usize; 2], piece: usize) -> f64 {
        const SIMPSON: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
        let (corner, extent) = self.piece(piece);
        let mut sum = 0.0;
        for (i, wi) in SIMPSON.iter().enumerate() {
            for (j, wj) in SIMPSON.iter().enumerate() {
                let offset = [
                    corner[0] + 0.5 * i as f64 * extent[0],
                    corner[1] + 0.5 * j as f64 * extent[1],
                ];
                let tent = (1.0 - offset[0].abs()) * (1.0 - offset[1].abs());
                sum += wi * wj * tent * factor.at(self.point(cell, offset));
            }
        }
        sum * extent[0] * extent[1]
    }

    /// A point with density proportional to `factor · tent`, from `next`, a source of uniform numbers in (0, 1).
    pub fn draw(&self, factor: &Factor, cell: [usize; 2], mut next: impl FnMut() -> f64) -> [f64; 2] {
        let count = under_count(self.pieces);
        let sums = &self.sums[(cell[0] * self.cells[1] + cell[1]) * count..][..count];
        let target = next() * sums[count - 1];
        let piece = sums.partition_point(|s| *s <= target).min(count - 1);
        let (corner, extent) = self.piece(piece);
        let value =
            |offset: [f64; 2]| (1.0 - offset[0].abs()) * (1.0 - offset[1].abs()) * factor.at(self.point(cell, offset));
        let far = [corner[0] + extent[0], corner[1] + extent[1]];
        // A product of functions that are linear in each coordinate is at most the product of their largest corners.
        let tent = (1.0 - corner[0].abs()).max(1.0 - far[0].abs()) * (1.0 - corner[1].abs()).max(1.0 - far[1].abs());
        let corners = [corner, far, [corner[0], far[1]], [far[0], corner[1]]];
        let highest = corners
            .iter()
            .map(|c| factor.at(self.point(cell, *c)))
            .fold(0.0, f64::max)
            * tent;
        loop {
            let offset = [corner[0] + next() * extent[0], corner[1] + next() * extent[1]];
            if next() * highest <= value(offset) {
                return self.point(cell, offset);
            }
        }
    }
}

/// Pieces under one tent, which reaches over two cells along each axis.
const fn under_count(pieces: [usize; 2]) -> usize {
    4 * pieces[0] * pieces[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::tent::cell_of;
    use etendue_sampling::philox::Stream;

    fn factor(n: usize, wraps: bool) -> Factor {
        let values = (0..n * n)
            .map(|i| ((i * i * 31 + 7 * i) % 17) as f64 * ((i % 3) as f64))
            .collect();
        Factor::new(n, values, wraps).expect("sound")
    }

    #[test]
    fn draws_have_the_density_of_factor_times_tent() {
        // χ² over 8 × 8 bins of the square, for inner, border and wrapped tents; 200 000 draws; 1e-4 of 63 degrees: 121.
        for (wraps, cell) in [(false, [1, 2]), (false, [0, 0]), (true, [0, 3])] {
            let factor = factor(16, wraps);
            let under = factor.under_tents([4, 4]);
            let (draws, bins) = (200_000, 8);
            let mut counts = vec![0.0; bins * bins];
            let stream = Stream::new(9, 1);
            for i in 0..draws {
                let (mut block, mut used, mut numbers) = (0, 4, [0.0; 4]);
                let point = under.draw(&factor, cell, || {
                    if used == 4 {
                        (numbers, used, block) = (stream.uniforms(i, block), 0, block + 1);
                    }
                    used += 1;
                    numbers[used - 1]
                });
                let bin = point.map(|x| cell_of(x, bins));
                counts[bin[0] * bins + bin[1]] += 1.0;
            }
            let mut expected = vec![0.0; bins * bins];
            let fine = 512;
            for i in 0..fine {
                for j in 0..fine {
                    let point = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(fine));
                    let (x, y) = (Tent::at(point[0], 4, wraps), Tent::at(point[1], 4, false));
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
            assert!(chi2 < 121.0, "{wraps} {cell:?}: {chi2}");
        }
    }
}
