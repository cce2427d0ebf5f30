//! What the points of a pixel see: sums, and how well these tell the average over the pixel.

use super::light_field::PartField;

/// What the points of a pixel amount to on one part.
#[derive(Clone, Debug, Default)]
pub struct PixelSums {
    points: f64,
    /// Sum of the luminances.
    pub value: f64,
    deviations: [f64; 3],
    /// Where the first point is, and how far the others lie from it: sums and sums of squares.
    first: [f64; 2],
    away: [f64; 2],
    squares: [f64; 2],
}

impl PixelSums {
    /// Adds a point at a place of the part: its luminance, and its deviations as [`super::points::Points`] holds them.
    #[inline(always)]
    pub fn add(&mut self, wraps: bool, place: [f64; 2], value: f64, deviations: [f64; 3]) {
        if self.points == 0.0 {
            self.first = place;
        }
        self.points += 1.0;
        self.value += value;
        for (axis, at) in place.iter().enumerate() {
            let mut away = at - self.first[axis];
            if wraps && axis == 0 {
                away -= away.round();
            }
            self.away[axis] += away;
            self.squares[axis] += away * away;
        }
        for (sum, d) in self.deviations.iter_mut().zip(deviations) {
            *sum += d;
        }
    }

    /// Standard deviation of the sum of values: what is left of each kind of error on the area of places that the points
    /// spread over. A pixel sees a part along nearly one direction, in which all its points err together.
    #[must_use]
    pub fn deviation(&self, part: &PartField) -> f64 {
        if self.points == 0.0 {
            return 0.0;
        }
        // Even points on a side of length l have the variance l²/12.
        let side = |axis: usize| {
            let mean = self.away[axis] / self.points;
            (12.0 * (self.squares[axis] / self.points - mean * mean).max(0.0)).sqrt()
        };
        let area = side(0) * side(1);
        let of_cells = part.errors.cells.left(area * (part.cells[0] * part.cells[1]) as f64);
        let fine = part.errors.space.side() as f64;
        let within = part.errors.within.left(area * fine * fine);
        let [cells, place, direction] = self.deviations;
        (cells * of_cells).hypot(place * within).hypot(direction)
    }
}

/// How far the average over some points of a lattice is off, by how much their values differ.
///
/// At an edge, where they differ most, lattices in two dimensions are off by some 0.4 n^-3/4 of the step.
#[inline(always)]
#[must_use]
pub fn lattice_error(points: f64, variance: f64) -> f64 {
    0.4 * variance.max(0.0).sqrt() / (points.sqrt() * points.sqrt().sqrt())
}
