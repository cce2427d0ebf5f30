//! The average of trees on a grid whose cells are moved: a dyadic grid knows edges best where its own coarse boxes end.

use etendue_sampling::ordered;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::array::{Array, Workspace};
use super::base::Base;
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
/// The base of `data` is made anew for each: the product of `factors`, see [`Base::product`].
///
/// # Panics
/// If an array has not one entry per cell, a factor does not fit, or a position has not one number per axis.
#[must_use]
pub fn average(
    grid: &Grid,
    data: &Data<'_>,
    factors: &[(usize, &[f64])],
    c: f64,
    positions: &[Vec<usize>],
    threads: usize,
) -> Average {
    assert!(data.fits(grid), "one entry per cell");
    let sizes: Vec<usize> = grid.depths().iter().map(|d| 1 << d).collect();
    let boxes: usize = sizes.iter().map(|n| 2 * n - 1).product();
    let tree = |steps: &Vec<usize>, pool: Option<&ThreadPool>, workspace: &mut Workspace| {
        let base = moved_base(grid, factors, &sizes, steps);
        let (weight, squared) = (
            rolled(data.weight, &sizes, steps),
            data.squared.map(|w2| rolled(w2, &sizes, steps)),
        );
        let moved = Data {
            weight: &weight,
            squared: squared.as_deref(),
            base: &base,
            stop: data.stop,
        };
        grown(grid, &moved, c, pool, workspace)
    };
    ordered::beside(threads, |pool| {
        let mut sum = Average {
            ratio: vec![0.0; grid.cells()],
            ratio_squared: vec![0.0; grid.cells()],
            log_evidence: Vec::with_capacity(positions.len()),
        };
        let share = 1.0 / positions.len() as f64;
        let mut workspace = Workspace::default();
        match pool {
            Some(pool) if boxes <= SIDE_BY_SIDE && positions.len() > 1 => {
                for some in positions.chunks(AT_ONCE) {
                    let alone = |steps| tree(steps, None, &mut Workspace::default());
                    let trees: Vec<_> = pool.install(|| some.par_iter().map(alone).collect());
                    for (steps, (moments, log_evidence)) in some.iter().zip(trees) {
                        sum.add(&moments, log_evidence, share, &sizes, steps);
                    }
                }
            }
            _ => {
                for steps in positions {
                    let (moments, log_evidence) = tree(steps, pool, &mut workspace);
                    sum.add(&moments, log_evidence, share, &sizes, steps);
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
    fn add(&mut self, moments: &[Array<f64>; 2], log_evidence: f64, share: f64, sizes: &[usize], steps: &[usize]) {
        let back: Vec<usize> = sizes.iter().zip(steps).map(|(n, s)| (n - s % n) % n).collect();
        for (sum, moment) in [&mut self.ratio, &mut self.ratio_squared].into_iter().zip(moments) {
            roll(moment, sizes, &back, |at, run| {
                for (s, v) in sum[at..at + run.len()].iter_mut().zip(run) {
                    *s += share * v;
                }
            });
        }
        self.log_evidence.push(log_evidence);
    }
}

/// The product of the factors, whose cells are moved as those of the grid.
fn moved_base(grid: &Grid, factors: &[(usize, &[f64])], sizes: &[usize], steps: &[usize]) -> Base {
    let mut first = 0;
    let mut moved = Vec::with_capacity(factors.len());
    for (axes, mass) in factors {
        let own = first..first + axes;
        first = own.end;
        moved.push((*axes, rolled(mass, &sizes[own.clone()], &steps[own])));
    }
    let moved: Vec<_> = moved.iter().map(|(axes, mass)| (*axes, &mass[..])).collect();
    if moved.is_empty() {
        return Base::uniform();
    }
    Base::product(grid.depths(), &moved).expect("factors that fit the grid")
}

/// A copy whose entries are moved cyclically by so many steps along each axis.
fn rolled(values: &[f64], sizes: &[usize], steps: &[usize]) -> Vec<f64> {
    let mut moved = vec![0.0; values.len()];
    roll(values, sizes, steps, |at, run| {
        moved[at..at + run.len()].copy_from_slice(run);
    });
    moved
}

/// Visits runs of entries, each with the place where it begins once it is moved by so many steps along each axis.
fn roll(values: &[f64], sizes: &[usize], steps: &[usize], mut visit: impl FnMut(usize, &[f64])) {
    assert_eq!(sizes.len(), steps.len(), "one number of steps per axis");
    let Some((row, outer)) = sizes.split_last() else {
        return;
    };
    let shift = steps[outer.len()] % row;
    let mut index = vec![0; outer.len()];
    for values in values.chunks_exact(*row) {
        let to = index
            .iter()
            .zip(outer)
            .zip(steps)
            .fold(0, |to, ((i, n), s)| to * n + (i + s) % n)
            * row;
        let (stay, wrap) = values.split_at(row - shift);
        visit(to + shift, stay);
        if shift > 0 {
            visit(to, wrap);
        }
        for (i, n) in index.iter_mut().zip(outer).rev() {
            *i = (*i + 1) % n;
            if *i > 0 {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polya::posterior::posterior;

    fn numbers(n: usize, seed: usize) -> Vec<f64> {
        (0..n).map(|i| ((i * i * 7 + seed * 13 + i) % 11) as f64).collect()
    }

    #[test]
    fn rolls_as_index_arithmetic_has_it() {
        let (sizes, steps) = ([2, 4, 8], [1, 3, 5]);
        let values = numbers(64, 3);
        let moved = rolled(&values, &sizes, &steps);
        for i in 0..2 {
            for j in 0..4 {
                for k in 0..8 {
                    let to = ((i + 1) % 2) * 32 + ((j + 3) % 4) * 8 + (k + 5) % 8;
                    assert!(moved[to].to_bits() == values[i * 32 + j * 8 + k].to_bits());
                }
            }
        }
    }

    #[test]
    fn is_the_mean_of_trees_on_moved_cells() {
        // Trees of few boxes, which are grown side by side, and of many, which share the threads.
        for depths in [vec![2, 3, 2, 1], vec![5, 5, 5, 5]] {
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
                base: &Base::uniform(),
                stop: None,
            };
            let factors = [(2, &space[..]), (2, &direction[..])];
            let found = average(&grid, &data, &factors, 3.0, &positions, 2);
            let again = average(&grid, &data, &factors, 3.0, &positions, 1);
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
                let base = moved_base(&grid, &factors, &sizes, steps);
                let (w, w2) = (rolled(&weight, &sizes, steps), rolled(&squared, &sizes, steps));
                let tree = posterior(
                    &grid,
                    &Data {
                        weight: &w,
                        squared: Some(&w2),
                        base: &base,
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
