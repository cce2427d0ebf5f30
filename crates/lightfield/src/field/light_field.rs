//! Light fields, part by part, and their luminance along a line.

use std::sync::atomic::{AtomicBool, Ordering};

use etendue_math::Vec3;

use super::errors::FineErrors;
use super::factor::{Factor, next_to};
use super::tent::Tent;
use crate::carrier::CarrierPart;

/// The light that leaves one part.
#[derive(Clone, Debug)]
pub struct PartField {
    /// The chart.
    pub part: CarrierPart,
    /// Cells of the ratio along each coordinate.
    pub cells: [usize; 4],
    /// Ratio and its standard deviation at each cell's centre, last coordinate fastest.
    pub ratio: Vec<[f32; 2]>,
    /// `B_s`.
    pub space: Factor,
    /// `B_d`.
    pub direction: Factor,
    /// Luminance where all factors and the ratio are 1.
    pub level: f64,
    /// Errors within cells, and of averages.
    pub errors: FineErrors,
}

/// Luminance with its standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// The mean.
    pub value: f64,
    /// Its standard deviation.
    pub deviation: f64,
}

impl PartField {
    /// The luminance at (s₁, s₂, a, b).
    #[inline]
    #[must_use]
    pub fn at(&self, place: [f64; 2], direction: [f64; 2]) -> Reading {
        let wraps = self.part.wraps();
        let [n1, n2, n3, n4] = self.cells;
        let ratio = self.ratio_under(&[
            Tent::at(place[0], n1, wraps),
            Tent::at(place[1], n2, false),
            Tent::at(direction[0], n3, false),
            Tent::at(direction[1], n4, false),
        ]);
        let factors = [self.space.at(place), self.direction.at(direction)];
        let errors = [self.errors.space.at(place), self.errors.direction.at(direction)];
        let (value, deviations) = joined(self.level, ratio, factors, errors);
        let variance: f64 = deviations.iter().map(|d| d * d).sum();
        Reading {
            value,
            deviation: variance.sqrt(),
        }
    }

    /// The ratio and its standard deviation under the tents over a point.
    #[inline(always)]
    pub(super) fn ratio_under(&self, tents: &[Tent; 4]) -> [f64; 2] {
        let weights = tents.map(|t| t.weights);
        if self.cells[3] == 1 {
            let corners = self.corners(tents.map(|t| t.cells));
            return weighed(|[i, j, k]| corners[i][j][k], weights);
        }
        // Each pair of cells in one go from the table.
        let [_, n2, n3, n4] = self.cells;
        let (values, [x, y, u, v]) = (self.ratio.as_flattened(), tents.map(|t| t.cells));
        let pair = |[i, j, k]: [usize; 3]| next_to(values, 2 * (((x[i] * n2 + y[j]) * n3 + u[k]) * n4 + v[0]));
        weighed(pair, weights)
    }

    /// Ratio and deviation of the cells of tents. Along the last axis the two cells lie beside one another.
    #[inline(always)]
    pub(super) fn corners(&self, [x, y, u, v]: [[usize; 2]; 4]) -> Corners {
        let [_, n2, n3, n4] = self.cells;
        let values = self.ratio.as_flattened();
        let row = |i: usize, j: usize, k: usize| {
            let cell = ((x[i] * n2 + y[j]) * n3 + u[k]) * n4 + v[0];
            if n4 > 1 {
                next_to(values, 2 * cell)
            } else {
                [values[2 * cell], values[2 * cell + 1], 0.0, 0.0]
            }
        };
        [
            [[row(0, 0, 0), row(0, 0, 1)], [row(0, 1, 0), row(0, 1, 1)]],
            [[row(1, 0, 0), row(1, 0, 1)], [row(1, 1, 0), row(1, 1, 1)]],
        ]
    }
}

/// The luminance and its deviations by their kind, from the ratio with its deviation, the values of the factors and those of
/// their errors.
#[inline(always)]
pub(super) fn joined(level: f64, ratio: [f64; 2], factors: [f64; 2], errors: [f64; 2]) -> (f64, [f64; 3]) {
    let base = level * factors[0] * factors[1];
    let value = base * ratio[0];
    (value, [base * ratio[1], value * errors[0], value * errors[1]])
}

/// Ratio and deviation, then the same of the next cell along the last axis: for either cell of the first three axes.
pub(super) type Corners = [[[[f32; 4]; 2]; 2]; 2];

/// The sum of corners, by the cell of the first three axes that each belongs to, with the weights of their tents. Cells side by
/// side err together, so that their deviations add up.
#[inline(always)]
pub(super) fn weighed(corner: impl Fn([usize; 3]) -> [f32; 4], [x, y, u, v]: [[f64; 2]; 4]) -> [f64; 2] {
    let mut sums = [0.0; 4];
    for (i, x) in x.into_iter().enumerate() {
        for (j, y) in y.into_iter().enumerate() {
            for (k, u) in u.into_iter().enumerate() {
                let weight = x * y * u;
                for (sum, value) in sums.iter_mut().zip(corner([i, j, k])) {
                    *sum += weight * f64::from(value);
                }
            }
        }
    }
    [0, 1].map(|k| sums[k] * v[0] + sums[k + 2] * v[1])
}

/// The light of a source: the fields of the parts of its carrier surface.
#[derive(Clone, Debug)]
pub struct LightField {
    /// In the order in which rays were offered to them.
    pub parts: Vec<PartField>,
}

impl LightField {
    /// The luminance along a line: what leaves each part that the line leaves adds up.
    ///
    /// A ray was counted on one part only, the first that its line leaves; so the sum counts no light twice, and parts err
    /// apart from one another.
    #[inline]
    #[must_use]
    pub fn luminance(&self, point: Vec3, direction: Vec3) -> Reading {
        let mut sum = Reading::default();
        for field in &self.parts {
            let crossing = field.part.cross(point, direction);
            if crossing.met {
                let reading = field.at(crossing.place, crossing.direction);
                sum.value += reading.value;
                sum.deviation = sum.deviation.hypot(reading.deviation);
            }
        }
        sum
    }
}

/// Whether somebody has set the flag that ends long work.
pub(super) fn stopped(stop: Option<&AtomicBool>) -> bool {
    stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::carrier::tests::{lattice, zoo};

    /// One part of each shape with a rough ratio and rough factors, on grids of different sizes.
    pub(crate) fn rough(kind: usize) -> PartField {
        let part = zoo()[kind];
        let cells = [4, 2, 4, 2];
        let ratio = (0..64_u16)
            .map(|i| [f32::from(i * i % 13) * 0.3, f32::from(i % 5) * 0.1])
            .collect();
        let values = |n: u16, m: u16| (0..n * n).map(|i| f64::from(i * m % 7) * 0.5 + 0.1).collect();
        PartField {
            part,
            cells,
            ratio,
            space: Factor::new(8, values(8, 5), part.wraps()).expect("sound"),
            direction: Factor::new(4, values(4, 3), false).expect("sound"),
            level: 2.0,
            errors: FineErrors::none(),
        }
    }

    #[test]
    fn at_the_centres_it_is_the_product_of_factors_and_ratio() {
        let mut field = rough(0);
        (field.space, field.direction) = (Factor::one(), Factor::one());
        for (index, expected) in field.ratio.iter().enumerate() {
            let cell = [index / 16, index / 8 % 2, index / 2 % 4, index % 2];
            let at: [f64; 4] = std::array::from_fn(|k| (cell[k] as f64 + 0.5) / field.cells[k] as f64);
            let reading = field.at([at[0], at[1]], [at[2], at[3]]);
            assert!((reading.value - 2.0 * f64::from(expected[0])).abs() < 1e-12);
            assert!((reading.deviation - 2.0 * f64::from(expected[1])).abs() < 1e-12);
        }
        let rough = rough(0);
        for [s1, s2, a, b] in lattice(100) {
            let plain = field.at([s1, s2], [a, b]).value;
            let product = plain * rough.space.at([s1, s2]) * rough.direction.at([a, b]);
            assert!((rough.at([s1, s2], [a, b]).value - product).abs() < 1e-12);
        }
    }

    #[test]
    fn errors_within_cells_add_their_squares() {
        let plain = rough(0);
        let mut field = plain.clone();
        let values = (0..16_u8).map(|i| f64::from(i) * 0.05).collect::<Vec<_>>();
        field.errors.space = Factor::new(4, values.clone(), false).expect("sound");
        field.errors.direction = Factor::new(4, values, false).expect("sound");
        for [s1, s2, a, b] in lattice(100) {
            let (without, with) = (plain.at([s1, s2], [a, b]), field.at([s1, s2], [a, b]));
            let own = [field.errors.space.at([s1, s2]), field.errors.direction.at([a, b])].map(|d| d * with.value);
            let squares = without.deviation.powi(2) + own[0].powi(2) + own[1].powi(2);
            assert!(with.value == without.value && (with.deviation.powi(2) - squares).abs() < 1e-12 * (1.0 + squares));
        }
    }

    #[test]
    fn luminance_is_constant_along_a_line() {
        let field = LightField {
            parts: (0..4).map(rough).collect(),
        };
        for ([s1, s2, a, b], kind) in lattice(400).zip((0..4).cycle()) {
            let (x, k) = field.parts[kind].part.ray([s1, s2], [a, b]);
            let here = field.luminance(x + k * 1e-3, k);
            assert!(here.value > 0.0);
            assert!((field.luminance(x + k * 500.0, k).value / here.value - 1.0).abs() < 1e-6);
        }
    }
}
