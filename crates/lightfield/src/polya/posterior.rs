//! The posterior of the tree, and its evidence.

use etendue_sampling::ordered;
use rayon::ThreadPool;

use super::array::{Array, Workspace};
use super::ascend::ascend;
use super::data::Data;
use super::descend::descend;
use super::grid::Grid;
use super::sweep::Problem;

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

/// The posterior of the tree with concentration `c`, on `threads` threads (0: one per core); the same bits for any number.
///
/// Time is that of Π(2^(d+1) − 1) boxes; memory some 24 to 30 bytes for each.
///
/// # Panics
/// If an array has not one entry per cell.
#[must_use]
pub fn posterior(grid: &Grid, data: &Data<'_>, c: f64, threads: usize) -> Posterior {
    assert!(data.fits(grid), "one entry per cell");
    ordered::beside(threads, |pool| {
        let none = vec![0; grid.depths().len()];
        let mut workspace = Workspace::default();
        let (moments, log_evidence) = grown(grid, data, &none, c, pool, &mut workspace);
        let [ratio, ratio_squared] = moments.map(|moment| {
            let mut values = vec![0.0; grid.cells()];
            grid.each_row(&none, |first, begin, row| {
                for (v, place) in values[first..].iter_mut().zip(row) {
                    *v = moment[begin + place];
                }
            });
            workspace.keep(moment);
            values
        });
        Posterior {
            ratio,
            ratio_squared,
            log_evidence,
        }
    })
}

/// Both moments of the ratio, tile by tile, and the evidence; of cells that are moved by so many steps along each axis.
pub(super) fn grown(
    grid: &Grid,
    data: &Data<'_>,
    steps: &[usize],
    c: f64,
    pool: Option<&ThreadPool>,
    workspace: &mut Workspace,
) -> ([Array<f64>; 2], f64) {
    let data = &data.simplified();
    let problem = Problem::new(grid, data, steps, c);
    let evidence = ascend(&problem, data, steps, true, pool, workspace);
    let moments = descend(&problem, &evidence, pool, workspace);
    let log_root = evidence.log_root;
    evidence.give(workspace);
    (moments, log_root)
}

/// The evidence alone, which costs less than half.
///
/// # Panics
/// If an array has not one entry per cell.
#[must_use]
pub fn log_evidence(grid: &Grid, data: &Data<'_>, c: f64, threads: usize) -> f64 {
    assert!(data.fits(grid), "one entry per cell");
    let data = &data.simplified();
    let none = vec![0; grid.depths().len()];
    ordered::beside(threads, |pool| {
        let problem = Problem::new(grid, data, &none, c);
        let mut workspace = Workspace::default();
        let evidence = ascend(&problem, data, &none, false, pool, &mut workspace);
        let log_root = evidence.log_root;
        evidence.give(&mut workspace);
        log_root
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polya::data::Masses;

    fn integers(cells: usize, seed: u64) -> Vec<f64> {
        (0..cells as u64)
            .map(|i| ((i * i * 7 + seed * 13 + i) % 11) as f64)
            .collect()
    }

    #[test]
    fn two_cells_are_one_beta_binomial_trial() {
        // Σ over "whole" and "split" by hand: B = Beta(c/2+3, c/2+1)/Beta(c/2, c/2) · 2^4.
        let grid = Grid::new(vec![1]).expect("small");
        let data = Data {
            weight: &[3.0, 1.0],
            squared: None,
            factors: &[],
            stop: None,
        };
        let post = posterior(&grid, &data, 2.0, 1);
        let b = (libm::tgamma(4.0) * libm::tgamma(2.0) / libm::tgamma(6.0)) * 16.0;
        let r: f64 = 0.5 + 0.5 * b;
        assert!((post.log_evidence - r.ln()).abs() < 1e-14);
        let split = 0.5 * b / r;
        assert!((post.ratio[0] - ((1.0 - split) + split * 2.0 * 4.0 / 6.0)).abs() < 1e-7);
        assert!((post.ratio_squared[0] - ((1.0 - split) + split * 4.0 * (4.0 * 5.0) / (6.0 * 7.0))).abs() < 1e-6);
        assert_eq!(
            log_evidence(&grid, &data, 2.0, 1).to_bits(),
            post.log_evidence.to_bits()
        );
    }

    #[test]
    fn mass_is_conserved_for_any_base_and_any_weights() {
        for depths in [
            vec![5],
            vec![3, 4],
            vec![2, 1, 3],
            vec![2, 2, 1, 2],
            vec![0, 3],
            vec![7, 6],
        ] {
            let grid = Grid::new(depths.clone()).expect("small");
            let n = grid.cells();
            let base: Vec<f64> = integers(n, 3)
                .iter()
                .map(|v| v + f64::from(u8::from(*v > 0.0)))
                .collect();
            let total: f64 = base.iter().sum();
            let base: Vec<f64> = base.iter().map(|v| v / total).collect();
            let weight: Vec<f64> = integers(n, 1)
                .iter()
                .zip(&base)
                .map(|(v, b)| if *b > 0.0 { *v } else { 0.0 })
                .collect();
            let squared: Vec<f64> = weight.iter().map(|w| w * 1.7).collect();
            let measure = [(depths.len(), &base[..])];
            for squared in [None, Some(squared.as_slice())] {
                let data = Data {
                    weight: &weight,
                    squared,
                    factors: &measure,
                    stop: None,
                };
                let post = posterior(&grid, &data, 3.0, 2);
                let mass: f64 = post.ratio.iter().zip(&base).map(|(r, b)| r * b).sum();
                assert!((mass - 1.0).abs() < 1e-12, "{mass}");
                assert!(
                    post.ratio
                        .iter()
                        .zip(&post.ratio_squared)
                        .all(|(m, s)| *s >= m * m * (1.0 - 1e-6))
                );
            }
        }
    }

    #[test]
    fn counting_on_equal_halves_is_the_special_case_it_claims_to_be() {
        let depths = vec![3, 2, 3, 2];
        let grid = Grid::new(depths.clone()).expect("small");
        let counts = integers(1024, 4);
        let ones = vec![1.0; 1024];
        let (even, uniform): ([Masses<'_>; 1], [Masses<'_>; 0]) = ([(4, &ones)], []);
        let quick = posterior(
            &grid,
            &Data {
                weight: &counts,
                squared: None,
                factors: &uniform,
                stop: None,
            },
            3.0,
            1,
        );
        for squared in [None, Some(counts.as_slice())] {
            let nearly: Vec<f64> = counts.iter().map(|w| w * (1.0 + 1e-13)).collect();
            let squared = squared.map(|_| nearly.as_slice());
            for factors in [&even[..], &uniform] {
                let slow = posterior(
                    &grid,
                    &Data {
                        weight: &counts,
                        squared,
                        factors,
                        stop: None,
                    },
                    3.0,
                    1,
                );
                assert!((quick.log_evidence - slow.log_evidence).abs() < 1e-9 * quick.log_evidence.abs());
                assert!(
                    quick
                        .ratio
                        .iter()
                        .zip(&slow.ratio)
                        .all(|(a, b)| (a / b - 1.0).abs() < 1e-6)
                );
                assert!(
                    quick
                        .ratio_squared
                        .iter()
                        .zip(&slow.ratio_squared)
                        .all(|(a, b)| (a / b - 1.0).abs() < 1e-5)
                );
            }
        }
    }

    #[test]
    fn the_size_of_tiles_does_not_matter() {
        // Weighted and not, on even and on other halves; moved as well.
        let depths = vec![3, 2, 3, 2];
        let weight: Vec<f64> = integers(1024, 4).iter().map(|v| (v - 7.0).max(0.0)).collect();
        let squared: Vec<f64> = weight.iter().map(|w| 0.6 * w * w).collect();
        let (space, direction): (Vec<f64>, Vec<f64>) = (
            integers(32, 1).iter().map(|v| v + 1.0).collect(),
            integers(32, 2).iter().map(|v| v + 0.5).collect(),
        );
        let product: [Masses<'_>; 2] = [(2, &space), (2, &direction)];
        for squared in [None, Some(&squared[..])] {
            for factors in [&[][..], &product] {
                let data = Data {
                    weight: &weight,
                    squared,
                    factors,
                    stop: None,
                };
                let run = |most: usize, steps: &[usize]| {
                    let grid = Grid::with_tiles(depths.clone(), most).expect("small");
                    let ([mean, square], log_root) = grown(&grid, &data, steps, 3.0, None, &mut Workspace::default());
                    let mut cells = Vec::new();
                    grid.each_row(steps, |_, begin, row| {
                        cells.extend(row.iter().map(|place| [mean[begin + place], square[begin + place]]));
                    });
                    (cells, log_root)
                };
                for steps in [[0; 4], [5, 1, 6, 3]] {
                    let (expected, log_root) = run(1 << 16, &steps);
                    for most in [3000, 500, 100, 20, 1] {
                        let (found, log) = run(most, &steps);
                        assert!((log - log_root).abs() < 1e-10 * log_root.abs());
                        for (a, b) in found.iter().zip(&expected) {
                            assert!((a[0] / b[0] - 1.0).abs() < 1e-6 && (a[1] / b[1] - 1.0).abs() < 1e-6);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn gives_the_same_bits_for_one_two_and_seven_threads() {
        // Of many tiles and levels beside them.
        let grid = Grid::with_tiles(vec![4, 4, 4, 4], 3000).expect("small");
        let weight = integers(1 << 16, 2);
        let squared: Vec<f64> = weight.iter().map(|w| w * 1.3).collect();
        let data = Data {
            weight: &weight,
            squared: Some(&squared),
            factors: &[],
            stop: None,
        };
        let bits = |threads| {
            let post = posterior(&grid, &data, 3.0, threads);
            let of = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            (of(&post.ratio), of(&post.ratio_squared), post.log_evidence.to_bits())
        };
        let one = bits(1);
        assert!(one == bits(2) && one == bits(7));
    }

    #[test]
    fn axes_play_the_same_part() {
        let (rows, columns) = (8, 16);
        let counts = integers(rows * columns, 5);
        let transposed: Vec<f64> = (0..columns)
            .flat_map(|c| (0..rows).map(move |r| (r, c)))
            .map(|(r, c)| counts[r * columns + c])
            .collect();
        let run = |depths: Vec<u32>, weight: &[f64]| {
            let grid = Grid::new(depths).expect("small");
            posterior(
                &grid,
                &Data {
                    weight,
                    squared: None,
                    factors: &[],
                    stop: None,
                },
                3.0,
                1,
            )
        };
        let (a, b) = (run(vec![3, 4], &counts), run(vec![4, 3], &transposed));
        assert!((a.log_evidence - b.log_evidence).abs() < 1e-10);
        for r in 0..rows {
            for c in 0..columns {
                assert!((a.ratio[r * columns + c] - b.ratio[c * rows + r]).abs() < 1e-5);
            }
        }
    }
}
