//! Integrals of a light field over its cells, in closed form: flux and mean luminance.
//!
//! Within a cell only the tents of the cell and of its neighbours are not zero, and a field is a sum of products of one
//! function of the place and one of the direction. So two sums over nine neighbours each, with weights ∫ factor · tent over
//! a cell, are exact.

use rayon::prelude::*;

use etendue_sampling::ordered;

use super::factor::Factor;
use super::light_field::{PartField, Reading};
use super::tent::Tent;

/// ∫ factor · tent over each cell, for the tents of the cell and of its neighbours; the second axis of both fastest.
struct Overlaps {
    cells: [usize; 2],
    wraps: bool,
    weights: Vec<[f64; 9]>,
}

/// ∫ tent · hat over each cell of one axis, for the three tents and for the finer hats that are not zero there.
type AxisOverlaps = Vec<[Vec<(usize, f64)>; 3]>;

fn along_axis(cells: usize, hats: usize, wraps: bool) -> AxisOverlaps {
    const SIMPSON: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
    // Between the centres and the edges of the finer cells both are linear, and Simpson's rule is exact.
    let pieces = 2 * (hats / cells).max(1);
    let extent = 1.0 / (cells * pieces) as f64;
    let of_cell = |cell: usize| {
        let mut sums: [Vec<(usize, f64)>; 3] = std::array::from_fn(|_| Vec::new());
        for piece in cell * pieces..(cell + 1) * pieces {
            for (step, simpson) in SIMPSON.iter().enumerate() {
                let x = (piece as f64 + 0.5 * step as f64) * extent;
                let (tent, hat) = (Tent::at(x, cells, wraps), Tent::at(x, hats, wraps));
                for (t, tent_weight) in tent.cells.iter().zip(tent.weights) {
                    let side = neighbour(*t, cell);
                    for (h, hat_weight) in hat.cells.iter().zip(hat.weights) {
                        let weight = simpson * extent * tent_weight * hat_weight;
                        match sums[side].iter_mut().find(|(known, _)| known == h) {
                            Some((_, sum)) => *sum += weight,
                            None => sums[side].push((*h, weight)),
                        }
                    }
                }
            }
        }
        sums
    };
    (0..cells).map(of_cell).collect()
}

/// 0, 1, 2: a cell lies before another, is the same, or lies after it; on an axis that closes, the last before the first.
const fn neighbour(cell: usize, of: usize) -> usize {
    if cell == of {
        1
    } else if cell + 1 == of || cell > of + 1 {
        0
    } else {
        2
    }
}

impl Overlaps {
    fn new(factor: &Factor, cells: [usize; 2], wraps: bool) -> Self {
        let axes = [
            along_axis(cells[0], factor.side(), wraps),
            along_axis(cells[1], factor.side(), false),
        ];
        // Each row of hats along the second axis, before the rows are added up.
        let along_row = |row: usize| {
            let of_side = move |hats: &Vec<(usize, f64)>| hats.iter().map(|(c, w)| w * factor.node(row, *c)).sum();
            axes[1].iter().map(move |columns| columns.each_ref().map(of_side))
        };
        let inner: Vec<[f64; 3]> = (0..factor.side()).flat_map(along_row).collect();
        let mut weights = vec![[0.0; 9]; cells[0] * cells[1]];
        for (rows, weights) in axes[0].iter().zip(weights.chunks_exact_mut(cells[1])) {
            for (side, rows) in rows.iter().enumerate() {
                for (row, weight) in rows {
                    for (sums, inner) in weights.iter_mut().zip(&inner[row * cells[1]..]) {
                        for (sum, inner) in sums[3 * side..3 * side + 3].iter_mut().zip(inner) {
                            *sum += weight * inner;
                        }
                    }
                }
            }
        }
        Self { cells, wraps, weights }
    }

    /// The neighbours of a cell; those beyond an end, whose weights are zero, are the cell itself.
    fn neighbours(&self, cell: usize) -> [usize; 9] {
        let [rows, columns] = self.cells;
        let (i, j) = (cell / columns, cell % columns);
        let beside = |x: usize, n: usize, wraps: bool| match (x == 0, x + 1 == n, wraps) {
            (false, false, _) => [x - 1, x, x + 1],
            (first, last, true) => [if first { n - 1 } else { x - 1 }, x, if last { 0 } else { x + 1 }],
            (first, last, false) => [if first { x } else { x - 1 }, x, if last { x } else { x + 1 }],
        };
        let (near, along) = (beside(i, rows, self.wraps), beside(j, columns, false));
        std::array::from_fn(|side| near[side / 3] * columns + along[side % 3])
    }

    /// ∫ factor · tent of each cell, over the whole square.
    fn tent_masses(&self) -> Vec<f64> {
        let mut masses = vec![0.0; self.weights.len()];
        for (cell, weights) in self.weights.iter().enumerate() {
            for (near, weight) in self.neighbours(cell).into_iter().zip(weights) {
                masses[near] += weight;
            }
        }
        masses
    }
}

impl PartField {
    fn overlaps(&self) -> [Overlaps; 2] {
        let [n1, n2, n3, n4] = self.cells;
        [
            Overlaps::new(&self.space, [n1, n2], self.part.wraps()),
            Overlaps::new(&self.direction, [n3, n4], false),
        ]
    }

    /// ∫ factor · tent of each cell over the place, and the same over the direction.
    #[must_use]
    pub fn tent_masses(&self) -> [Vec<f64>; 2] {
        self.overlaps().map(|overlaps| overlaps.tent_masses())
    }

    /// ∫ L dU.
    #[must_use]
    pub fn flux(&self) -> f64 {
        let [space, direction] = self.tent_masses();
        self.flux_of(&space, &self.layers(&direction))
    }

    /// ∫ L dU, and the same over each cell of the place, in all directions together.
    #[must_use]
    pub fn flux_and_places(&self) -> (f64, Vec<f64>) {
        let [space, direction] = self.overlaps();
        let layers = self.layers(&direction.tent_masses());
        let scale = self.level * self.part.etendue();
        let of_place = |(place, weights): (usize, &[f64; 9])| -> f64 {
            let near = space.neighbours(place).into_iter().zip(weights);
            near.map(|(near, weight)| weight * layers[near]).sum::<f64>() * scale
        };
        let places = space.weights.iter().enumerate().map(of_place).collect();
        (self.flux_of(&space.tent_masses(), &layers), places)
    }

    /// From masses of the places and what is over each.
    fn flux_of(&self, space: &[f64], layers: &[f64]) -> f64 {
        let sum: f64 = layers.iter().zip(space).map(|(layer, mass)| mass * layer).sum();
        sum * self.level * self.part.etendue()
    }

    /// The ratio over each place, weighed by masses of the directions.
    fn layers(&self, direction: &[f64]) -> Vec<f64> {
        /// Places that are added up side by side: a sum by itself waits for each of its additions.
        const SOME: usize = 8;
        let mut layers = Vec::with_capacity(self.ratio.len() / direction.len());
        for some in self.ratio.chunks(SOME * direction.len()) {
            let mut places = some.chunks_exact(direction.len());
            let places: [_; SOME] = std::array::from_fn(|_| places.next().unwrap_or_default());
            let mut sums = [0.0; SOME];
            for (aim, mass) in direction.iter().enumerate() {
                for (sum, place) in sums.iter_mut().zip(places) {
                    *sum += place.get(aim).map_or(0.0, |r| f64::from(r[0]) * mass);
                }
            }
            layers.extend_from_slice(&sums[..some.len() / direction.len()]);
        }
        layers
    }

    /// Mean luminance of each cell and mean of its standard deviation; the same bits for any number of threads.
    #[must_use]
    pub fn cell_means(&self, threads: usize) -> Vec<Reading> {
        let [space, direction] = self.overlaps();
        let aims = direction.weights.len();
        let scale = self.level * (space.weights.len() * aims) as f64;
        let near: Vec<[usize; 9]> = (0..aims).map(|cell| direction.neighbours(cell)).collect();
        let fill = |(place, means): (usize, &mut [Reading])| {
            let mut layer = vec![[0.0; 2]; aims];
            for (neighbour, weight) in space.neighbours(place).into_iter().zip(&space.weights[place]) {
                let ratio = &self.ratio[neighbour * aims..][..aims];
                for (sum, r) in layer.iter_mut().zip(ratio) {
                    sum[0] += weight * f64::from(r[0]);
                    sum[1] += weight * f64::from(r[1]);
                }
            }
            for ((mean, weights), near) in means.iter_mut().zip(&direction.weights).zip(&near) {
                for (neighbour, weight) in near.iter().zip(weights) {
                    mean.value += scale * weight * layer[*neighbour][0];
                    mean.deviation += scale * weight * layer[*neighbour][1];
                }
            }
        };
        ordered::within(threads, |parallel| {
            let mut means = vec![Reading::default(); self.ratio.len()];
            if parallel {
                means.par_chunks_mut(aims).enumerate().for_each(fill);
            } else {
                means.chunks_mut(aims).enumerate().for_each(fill);
            }
            means
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::field::light_field::tests::rough;

    /// Averages of `f` over each cell by Gauss's two-point rule on pieces between kinks: exact for products of linears.
    fn quadrature(cells: [usize; 4], fine: usize, f: impl Fn([f64; 4]) -> f64) -> Vec<f64> {
        let nodes = |n: usize| -> Vec<Vec<f64>> {
            let pieces = 2 * (fine / n).max(1);
            let offset = 0.5 / 3.0_f64.sqrt();
            (0..n)
                .map(|c| {
                    let starts = (0..pieces).map(move |p| (c * pieces + p) as f64);
                    starts
                        .flat_map(|p| [p + 0.5 - offset, p + 0.5 + offset])
                        .map(|x| x / (n * pieces) as f64)
                        .collect()
                })
                .collect()
        };
        let axes = cells.map(nodes);
        let mut means = Vec::new();
        for (i, j, k, l) in (0..cells.iter().product::<usize>()).map(|c| {
            let [_, n2, n3, n4] = cells;
            (c / (n2 * n3 * n4), c / (n3 * n4) % n2, c / n4 % n3, c % n4)
        }) {
            let (mut sum, mut count) = (0.0, 0.0);
            for a in &axes[0][i] {
                for b in &axes[1][j] {
                    for c in &axes[2][k] {
                        for d in &axes[3][l] {
                            sum += f([*a, *b, *c, *d]);
                            count += 1.0;
                        }
                    }
                }
            }
            means.push(sum / count);
        }
        means
    }

    #[test]
    fn means_of_cells_and_flux_are_those_of_quadrature() {
        for kind in 0..4 {
            let field = rough(kind);
            let value = quadrature(field.cells, 8, |[s1, s2, a, b]| field.at([s1, s2], [a, b]).value);
            let deviation = quadrature(field.cells, 8, |[s1, s2, a, b]| field.at([s1, s2], [a, b]).deviation);
            let means = field.cell_means(2);
            for ((mean, v), d) in means.iter().zip(&value).zip(&deviation) {
                assert!((mean.value - v).abs() < 1e-12 * (1.0 + v), "{kind}: {} {v}", mean.value);
                assert!((mean.deviation - d).abs() < 1e-12 * (1.0 + d));
            }
            let flux = value.iter().sum::<f64>() / value.len() as f64 * field.part.etendue();
            assert!(
                (field.flux() / flux - 1.0).abs() < 1e-13,
                "{kind}: {} {flux}",
                field.flux()
            );
            let directions = field.cells[2] * field.cells[3];
            let share = field.part.etendue() / value.len() as f64;
            let (whole, places) = field.flux_and_places();
            assert!(whole.to_bits() == field.flux().to_bits());
            for (of_place, cells) in places.iter().zip(value.chunks(directions)) {
                let flux = cells.iter().sum::<f64>() * share;
                assert!(
                    (of_place - flux).abs() < 1e-12 * (1.0 + flux),
                    "{kind}: {of_place} {flux}"
                );
            }
        }
    }

    #[test]
    fn cells_that_are_their_own_neighbours_keep_their_light() {
        // One or two cells along an axis that closes, and factors coarser than the grid.
        for (kind, cells) in [
            (0, [1, 1, 1, 1]),
            (3, [1, 4, 2, 1]),
            (3, [2, 1, 16, 2]),
            (3, [16, 2, 1, 8]),
        ] {
            let mut field = rough(kind);
            let ratio = field.ratio.clone();
            field.cells = cells;
            field.ratio = ratio.into_iter().cycle().take(cells.iter().product()).collect();
            let value = quadrature(cells, 8, |[s1, s2, a, b]| field.at([s1, s2], [a, b]).value);
            for (mean, v) in field.cell_means(1).iter().zip(&value) {
                assert!(
                    (mean.value - v).abs() < 1e-12 * (1.0 + v),
                    "{kind} {cells:?}: {} {v}",
                    mean.value
                );
            }
        }
    }

    #[test]
    fn gives_the_same_bits_for_one_two_and_seven_threads() {
        let bits = |threads| -> Vec<u64> { rough(3).cell_means(threads).iter().map(|m| m.value.to_bits()).collect() };
        let one = bits(1);
        assert!(one == bits(2) && one == bits(7));
    }
}
