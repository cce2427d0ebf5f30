//! The average of trees on a grid whose cells are moved: a dyadic grid knows edges best where its own coarse boxes end.

use etendue_sampling::ordered;
use rayon::prelude::*;

use super::array::{Array, Workspace};
use super::data::Data;
use super::grid::Grid;
use super::posterior::grown;

/// Boxes of a tree up to which trees are grown side by side, each on one thread; larger ones share the threads.
const SIDE_BY_SIDE: usize = 1 << 22;

/// Trees that are grown side by side before their sum is formed, which bounds the memory.
const AT_ONCE: usize = 16;

/// The average of trees, one entry per cell where there are several.
#[derive(Clone, Debug)]
pub struct Average {
    /// Mean of the posterior means of mass over base mass.
    pub ratio: Vec<f64>,
    /// Mean of the posterior means of the square of that ratio.
    pub ratio_squared: Vec<f64>,
    /// ln of the evidence of each tree against the base measure.
    pub log_evidence: Vec<f64>,
}

/// Grows a tree with concentration `c` for each position, and averages them: of a position, `positions[k]` says by how many
/// steps along each axis the cells are moved cyclically; what is found is moved back. On `threads` threads (0: one per core); the
/// same bits for any number.
///
/// # Panics
/// If an array has not one entry per cell, or a position has not one number per axis.
#[must_use]
pub fn average(grid: &Grid, data: &Data<'_>, c: f64, positions: &[Vec<usize>], threads: usize) -> Average {
    assert!(data.fits(grid), "one entry per cell");
    ordered::beside(threads, |pool| {
        let mut sum = Average {
            ratio: vec![0.0; grid.cells()],
            ratio_squared: vec![0.0; grid.cells()],
            log_evidence: Vec::with_capacity(positions.len()),
        };
        let share = 1.0 / positions.len() as f64;
        let mut workspace = Workspace::default();
        match pool {
            Some(pool) if grid.boxes() <= SIDE_BY_SIDE && positions.len() > 1 => {
                for some in positions.chunks(AT_ONCE) {
                    let alone = |steps: &Vec<usize>| grown(grid, data, steps, c, None, &mut Workspace::default());
                    let trees: Vec<_> = pool.install(|| some.par_iter().map(alone).collect());
                    for (steps, (moments, log_evidence)) in some.iter().zip(trees) {
                        sum.add(grid, &moments, log_evidence, share, steps);
                        for moment in moments {
                            workspace.keep(moment);
                        }
                    }
                }
            }
            _ => {
                for steps in positions {
                    let (moments, log_evidence) = grown(grid, data, steps, c, pool, &mut workspace);
                    sum.add(grid, &moments, log_evidence, share, steps);
                    for moment in moments {
                        workspace.keep(moment);
                    }
                }
            }
        }
        sum
    })
}

impl Average {
    /// Adds the share of one more tree, its cells moved back.
    fn add(&mut self, grid: &Grid, moments: &[Array<f64>; 2], log_evidence: f64, share: f64, steps: &[usize]) {
        for (sum, moment) in [&mut self.ratio, &mut self.ratio_squared].into_iter().zip(moments) {
            grid.each_row(steps, |first, begin, row| {
                for (s, place) in sum[first..].iter_mut().zip(row) {
                    *s += share * moment[begin + place];
                }
            });
        }
        self.log_evidence.push(log_evidence);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polya::posterior::posterior;

    fn numbers(n: usize, seed: usize) -> Vec<f64> {
        (0..n).map(|i| ((i * i * 7 + seed * 13 + i) % 11) as f64).collect()
    }

    /// A copy whose entries are moved cyclically by so many steps along each axis.
    fn rolled(values: &[f64], sizes: &[usize], steps: &[usize]) -> Vec<f64> {
        let mut moved = vec![0.0; values.len()];
        for (i, value) in values.iter().enumerate() {
            let (mut rest, mut to, mut stride) = (i, 0, 1);
            for (n, s) in sizes.iter().zip(steps).rev() {
                to += (rest % n + s) % n * stride;
                (rest, stride) = (rest / n, stride * n);
            }
            moved[to] = *value;
        }
        moved
    }

    #[test]
    fn is_the_mean_of_trees_on_moved_cells() {
        // Trees of few boxes, which are grown side by side, and of many, which share the threads.
        for depths in [vec![2, 3, 2, 1], vec![5, 5, 5, 4]] {
            let grid = Grid::new(depths.clone()).expect("small");
            let sizes: Vec<usize> = depths.iter().map(|d| 1 << d).collect();
            let cells = grid.cells();
            let (space, direction) = (
                numbers(sizes[0] * sizes[1], 1)
                    .iter()
                    .map(|v| v + 1.0)
                    .collect::<Vec<_>>(),
                numbers(sizes[2] * sizes[3], 2)
                    .iter()
                    .map(|v| v + 0.5)
                    .collect::<Vec<_>>(),
            );
            let (weight, squared) = (
                numbers(cells, 4),
                numbers(cells, 4).iter().map(|w| 1.3 * w).collect::<Vec<_>>(),
            );
            let positions = [vec![0, 0, 0, 0], vec![1, 3, 2, 1]];
            let data = Data {
                weight: &weight,
                squared: Some(&squared),
                factors: &[(2, &space), (2, &direction)],
                stop: None,
            };
            let found = average(&grid, &data, 3.0, &positions, 2);
            let again = average(&grid, &data, 3.0, &positions, 1);
            let bits = |a: &Average| {
                a.ratio
                    .iter()
                    .chain(&a.ratio_squared)
                    .map(|v| v.to_bits())
                    .collect::<Vec<_>>()
            };
            assert!(bits(&found) == bits(&again) && found.log_evidence == again.log_evidence);
            let mut mean = vec![0.0; cells];
            for (k, steps) in positions.iter().enumerate() {
                let (place, turn) = (
                    rolled(&space, &sizes[..2], &steps[..2]),
                    rolled(&direction, &sizes[2..], &steps[2..]),
                );
                let (w, w2) = (rolled(&weight, &sizes, steps), rolled(&squared, &sizes, steps));
                let tree = posterior(
                    &grid,
                    &Data {
                        weight: &w,
                        squared: Some(&w2),
                        factors: &[(2, &place), (2, &turn)],
                        stop: None,
                    },
                    3.0,
                    1,
                );
                let back: Vec<usize> = sizes.iter().zip(steps).map(|(n, s)| n - s).collect();
                for (m, r) in mean.iter_mut().zip(rolled(&tree.ratio, &sizes, &back)) {
                    *m += 0.5 * r;
                }
                assert!(tree.log_evidence.to_bits() == found.log_evidence[k].to_bits());
            }
            assert!(mean.iter().zip(&found.ratio).all(|(a, b)| (a / b - 1.0).abs() < 1e-14));
        }
    }
}
