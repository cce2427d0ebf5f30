//! What the points of a pixel see: sums, and how well these tell the average over the pixel.

use super::light_field::PartField;

/// What the points of a pixel amount to on one part.
#[derive(Clone, Debug, Default)]
pub struct PixelSums {
    points: f64,
    /// Sum of the luminances.
    pub value: f64,
    deviations: [f64; 3],
    /// The coordinates of the first point, and how far those of the others lie from them: sums and sums of squares.
    first: [f64; 4],
    away: [f64; 4],
    squares: [f64; 4],
}

impl PixelSums {
    /// Adds a point of the part: its luminance, and its deviations as [`super::points::Points`] holds them.
    #[inline(always)]
    pub fn add(&mut self, wraps: bool, coordinates: [f64; 4], value: f64, deviations: [f64; 3]) {
        if self.points == 0.0 {
            self.first = coordinates;
        }
        self.points += 1.0;
        self.value += value;
        for (axis, at) in coordinates.iter().enumerate() {
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

    /// Standard deviation of the sum of values: what is left of each kind of error on the area that the points spread over.
    ///
    /// That is one of places; on a curved part the direction, too, goes from cell to cell with the place. Within the cells of
    /// directions all points err together, as a pixel sees a part along nearly one.
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
        let sides: [f64; 4] = std::array::from_fn(side);
        let in_cells = |axis: usize| sides[axis] * part.cells[axis] as f64;
        let of_cells = [0, 1].map(|axis| in_cells(axis).hypot(in_cells(axis + 2)));
        let of_cells = part.errors.cells.left(of_cells[0] * of_cells[1]);
        let fine = part.errors.space.side() as f64;
        let within = part.errors.within.left(sides[0] * sides[1] * fine * fine);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::errors::Averaging;
    use crate::field::light_field::tests::rough;

    /// The deviation of the mean of even points on a square of so many cells of places, or of directions, or of both.
    fn over(part: &PartField, cells: [f64; 2], deviations: [f64; 3]) -> f64 {
        let (mut sums, side) = (PixelSums::default(), 64);
        let extent: [f64; 4] = std::array::from_fn(|axis| cells[axis / 2] / part.cells[axis] as f64);
        for i in 0..side * side {
            let share = [i % side, i / side].map(|k| (f64::from(k) + 0.5) / f64::from(side));
            let at = std::array::from_fn(|axis| 0.1 + extent[axis] * share[axis % 2]);
            sums.add(part.part.wraps(), at, 1.0, deviations);
        }
        sums.deviation(part) / f64::from(side * side)
    }

    #[test]
    fn errors_go_out_over_places_and_over_directions() {
        let mut part = rough(0);
        part.errors.cells = Averaging::new(vec![1.0, 0.5, 0.25]).expect("sound");
        let [cells, direction] = [[0.3, 0.0, 0.0], [0.0, 0.0, 0.2]];
        for (extent, left) in [
            ([0.5, 0.0], 1.0),
            ([2.0, 0.0], 0.5),
            ([0.0, 2.0], 0.5),
            ([4.0, 0.0], 0.25),
            ([2.0 * 2.0_f64.sqrt(), 2.0 * 2.0_f64.sqrt()], 0.25),
        ] {
            // A lattice of 64 points along a side spreads by a little less than the side.
            let found = over(&part, extent, cells);
            assert!((found - 0.3 * left).abs() < 1e-3 * found, "{extent:?}: {found}");
            assert!((over(&part, extent, direction) - 0.2).abs() < 1e-12);
        }
    }
}
