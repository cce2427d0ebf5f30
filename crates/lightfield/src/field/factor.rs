//! A factor of a light field over the place or over the direction: bilinear between the centres of a fine grid.

use std::ops::Range;

use super::tent::{Tent, Tents};

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

    /// Whether the first axis closes upon itself.
    #[must_use]
    pub const fn wraps(&self) -> bool {
        self.wraps
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
