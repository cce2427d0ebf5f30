//! Étendue counts: one pass over any number of rays, into a grid on each part of a carrier surface.
//!
//! Beside the grid in (s₁, s₂, a, b) the pass fills two finer ones, in (s₁, s₂) and in (a, b) alone, and deals the rays to
//! two folds by the address of a random number: most are fitted, some are held out to judge the fit. Of the latter a few
//! are kept with their exact coordinates.

use std::ops::{ControlFlow, Range};

use etendue_geometry::ray_batch::BLOCK;
use etendue_geometry::{PassAccount, RayBatch, RaySource};
use etendue_sampling::ordered::{self, Idle};
use multiversion::multiversion;

use crate::carrier::{Coordinates, carry};

mod cells;
mod plan;

pub use cells::PURPOSE_HOLD_OUT;
use cells::{cells_of_all, cells_of_each, chances, finest_cells, fold};
use plan::Starts;
pub use plan::{CHANCES, PartGrids, Plan};

/// Σ w and Σ w² over the rays of each cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Sums {
    /// All rays so far have the same weight: their numbers.
    Equal(Vec<u32>),
    /// Σ w and Σ w², side by side: a ray adds to both, somewhere in a memory that no cache holds.
    Weighted(Vec<[f64; 2]>),
}

impl Sums {
    fn add(&mut self, cells: &[u32], weights: &[f64]) {
        match self {
            Self::Equal(counts) => cells.iter().for_each(|c| counts[*c as usize] += 1),
            Self::Weighted(sums) => {
                for (c, w) in cells.iter().zip(weights) {
                    let [sum, squares] = &mut sums[*c as usize];
                    *sum += w;
                    *squares += w * w;
                }
            }
        }
    }

    fn weighted(&mut self, weight: f64) {
        if let Self::Equal(counts) = self {
            let sum = |n: &u32| f64::from(*n) * weight;
            *self = Self::Weighted(counts.iter().map(|n| [sum(n), sum(n) * weight]).collect());
        }
    }
}

/// A held-out ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOutRay {
    /// Number of its part.
    pub part: u32,
    /// s₁, s₂, a, b.
    pub coordinates: [f64; 4],
    /// Its flux.
    pub weight: f64,
}

/// The account of a pass.
#[derive(Clone, Debug)]
pub struct Counts {
    /// Cells of the 4-D grid, fold by fold (fitted, held out), part by part, b fastest.
    pub grid: Sums,
    /// Cells of the place grid, in the same order of folds and parts, s₂ fastest.
    pub space: Sums,
    /// Cells of the direction grid, likewise, b fastest.
    pub direction: Sums,
    /// The one weight that all rays have, if they have.
    pub weight: Option<f64>,
    /// Held-out rays with their coordinates, in ray order.
    pub kept: Vec<HeldOutRay>,
    /// Rays with flux that no part meets.
    pub unmet_rays: u64,
    /// Their flux.
    pub unmet_flux: f64,
    /// The flux account of all rays.
    pub tally: PassAccount,
}

/// What one batch has found.
#[derive(Default)]
struct Found {
    tally: PassAccount,
    cells: [Vec<u32>; 3],
    weights: Vec<f64>,
    kept: Vec<HeldOutRay>,
    unmet_rays: u64,
    unmet_flux: f64,
}

/// Where the rays of a block cross the surface.
struct Scratch {
    at: Coordinates,
    /// Cells along each coordinate, of 2^FINEST.
    finest: [Vec<u32>; 4],
    /// The cell of each ray in each of the three grids, and whether it has one.
    cells: [Vec<u32>; 3],
    counts: Vec<bool>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            at: Coordinates::default(),
            finest: std::array::from_fn(|_| vec![0; BLOCK]),
            cells: std::array::from_fn(|_| vec![0; BLOCK]),
            counts: vec![false; BLOCK],
        }
    }
}

impl Found {
    /// Nothing yet, with room for the rays of a batch.
    fn with_room() -> Self {
        #[allow(clippy::cast_possible_truncation, reason = "a batch is short")]
        const ROOM: usize = ordered::BATCH as usize;
        Self {
            cells: std::array::from_fn(|_| Vec::with_capacity(ROOM)),
            weights: Vec::with_capacity(ROOM),
            ..Self::default()
        }
    }

    /// Forgets what it has found, not the room for it.
    fn clear(&mut self) {
        self.cells.iter_mut().for_each(Vec::clear);
        self.weights.clear();
        self.kept.clear();
        (self.tally, self.unmet_rays, self.unmet_flux) = Default::default();
    }

    fn collect(&mut self, plan: &Plan, starts: &Starts, first: u64, batch: &RayBatch, scratch: &mut Scratch) {
        self.tally.add_block(batch);
        let n = batch.len;
        let chances = chances(plan.seed, first, n);
        carry(&plan.parts, batch, &mut scratch.at);
        let Scratch {
            at,
            finest,
            cells,
            counts,
        } = scratch;
        finest_cells(&at.values, n, finest);
        let (first_grids, others) = (plan.grids[0], &plan.grids[1..]);
        if others.iter().all(|grids| *grids == first_grids) {
            cells_of_all(first_grids, finest, n, cells);
        } else {
            cells_of_each(&plan.grids, &at.part[..n], finest, cells);
        }
        fold(plan, starts, (&chances, &at.part[..n]), cells);
        let all = count_all(&batch.flux[..n], &at.part[..n], &mut counts[..n]);
        self.leave_out(batch, &at.part[..n], all);
        for (list, cells) in self.cells.iter_mut().zip(cells) {
            if all {
                list.extend_from_slice(&cells[..n]);
            } else {
                list.extend(chosen(&cells[..n], &counts[..n]));
            }
        }
        if all {
            self.weights.extend_from_slice(&batch.flux[..n]);
        } else {
            self.weights.extend(chosen(&batch.flux[..n], &counts[..n]));
        }
        for i in 0..n {
            if u32::from(chances[i]) < plan.kept && counts[i] {
                self.kept.push(HeldOutRay {
                    part: at.part[i],
                    coordinates: at.values.each_ref().map(|values| values[i]),
                    weight: batch.flux[i],
                });
            }
        }
    }

    /// Notes the rays of a block that have flux and meet no part; `none`: there are none.
    fn leave_out(&mut self, batch: &RayBatch, part: &[u32], none: bool) {
        for (weight, part) in batch.flux.iter().zip(part).filter(|_| !none) {
            if *weight > 0.0 && *part == Coordinates::NONE {
                self.unmet_rays += 1;
                self.unmet_flux += weight;
            }
        }
    }
}

/// Those of some values that count.
fn chosen<'a, T: Copy>(values: &'a [T], counts: &'a [bool]) -> impl Iterator<Item = T> + 'a {
    values
        .iter()
        .zip(counts)
        .filter_map(|(value, counts)| counts.then_some(*value))
}

/// Whether each ray has flux and meets a part; and whether all do.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn count_all(flux: &[f64], part: &[u32], counts: &mut [bool]) -> bool {
    let mut all = true;
    for ((counts, weight), part) in counts.iter_mut().zip(flux).zip(part) {
        *counts = (*weight > 0.0) & (*part != Coordinates::NONE);
        all &= *counts;
    }
    all
}

/// Counts all rays of a source on a surface.
///
/// Every sum runs in ray order, so its bits do not depend on the number of threads. Memory: the grids, twice 12 bytes per
/// ray of a round of batches, and the kept rays. Ends early if `progress` breaks. None if the plan is not countable.
pub fn count(
    source: &impl RaySource,
    plan: &Plan,
    threads: usize,
    progress: impl FnMut(u64) -> ControlFlow<()>,
) -> Option<Counts> {
    let starts = plan.starts()?;
    let [grid, space, direction] = starts.total.map(|n| Sums::Equal(vec![0; 2 * n as usize]));
    let mut counts = Counts {
        grid,
        space,
        direction,
        weight: None,
        kept: Vec::new(),
        unmet_rays: 0,
        unmet_flux: 0.0,
        tally: PassAccount::default(),
    };
    let mut equal = true;
    let (lists, places) = (Idle::<Found>::default(), Idle::<Scratch>::default());
    let work = |range: Range<u64>| {
        let mut found = lists.take(Found::with_room);
        places.with(Scratch::default, |scratch| {
            source.for_each_block(range, |first, batch| {
                found.collect(plan, &starts, first, batch, scratch);
            });
        });
        found
    };
    let merge = |mut found: Box<Found>| {
        counts.tally.merge(&found.tally);
        counts.unmet_rays += found.unmet_rays;
        counts.unmet_flux += found.unmet_flux;
        counts.kept.append(&mut found.kept);
        if let Some(first) = found.weights.first() {
            let weight = *counts.weight.get_or_insert(*first);
            let many = counts.tally.rays > u64::from(u32::MAX);
            if equal && (many || found.weights.iter().any(|w| *w != weight)) {
                equal = false;
                for sums in [&mut counts.grid, &mut counts.space, &mut counts.direction] {
                    sums.weighted(weight);
                }
            }
        }
        for (sums, cells) in [&mut counts.grid, &mut counts.space, &mut counts.direction]
            .into_iter()
            .zip(&found.cells)
        {
            sums.add(cells, &found.weights);
        }
        found.clear();
        lists.give_back(found);
    };
    ordered::run(threads, source.len(), work, merge, progress);
    if !equal {
        counts.weight = None;
    }
    Some(counts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::carrier::tests::{lattice, zoo};
    use etendue_geometry::table::{Float, Layout, RayTable};

    fn bytes(n: u32, weights: impl Fn(u32) -> f64) -> Vec<u8> {
        let parts = zoo();
        lattice(n)
            .zip(0..)
            .flat_map(|([s1, s2, a, b], i)| {
                let (x, k) = parts[(i % 3) as usize].ray([s1 * s1, s2], [a, b]);
                [x.x, x.y, x.z, k.x, k.y, k.z, weights(i)]
            })
            .flat_map(f64::to_le_bytes)
            .collect()
    }

    const LAYOUT: Layout = Layout {
        stride: 56,
        position: Some(0),
        direction: 24,
        flux: 48,
        float: Float::F64,
        colour: None,
        length_scale: 1.0,
    };

    const GRIDS: PartGrids = PartGrids {
        depths: [2, 3, 2, 1],
        fine: [4, 3],
    };

    fn plan() -> Plan {
        Plan {
            parts: zoo(),
            grids: vec![GRIDS; zoo().len()],
            held_out: CHANCES / 10,
            kept: CHANCES / 100,
            seed: 3,
        }
    }

    fn run(bytes: &[u8], threads: usize) -> Counts {
        let table = RayTable::new(bytes, LAYOUT).expect("valid");
        count(&table, &plan(), threads, |_| ControlFlow::Continue(())).expect("countable")
    }

    #[test]
    fn every_ray_is_counted_once_in_every_grid() {
        let n = 200_000;
        let counts = run(&bytes(n, |_| 2.5), 2);
        assert_eq!(counts.weight, Some(2.5));
        for (sums, size) in [(&counts.grid, 256), (&counts.space, 256), (&counts.direction, 64)] {
            let Sums::Equal(numbers) = sums else {
                panic!("equal weights")
            };
            assert_eq!(numbers.len(), 2 * zoo().len() * size);
            let total: u64 = numbers.iter().map(|c| u64::from(*c)).sum();
            assert_eq!(total + counts.unmet_rays, u64::from(n));
            // Held out: a tenth, within four standard deviations of a binomial.
            let out: u32 = numbers[zoo().len() * size..].iter().sum();
            let (mean, deviation) = (0.1 * total as f64, (0.09 * total as f64).sqrt());
            assert!((f64::from(out) - mean).abs() < 4.0 * deviation + 1.0, "{out} {mean}");
        }
        assert!((counts.kept.len() as f64 - 2000.0).abs() < 4.0 * 45.0);
        assert!((counts.unmet_flux - 2.5 * counts.unmet_rays as f64).abs() < 1e-9);
        assert_eq!(counts.tally.rays, u64::from(n));
    }

    #[test]
    fn weights_that_differ_late_are_summed_as_if_they_had_differed_from_the_start() {
        let n = 200_000;
        let late = |i| if i == n - 1 { 7.0 } else { 2.5 };
        let counts = run(&bytes(n, late), 2);
        assert_eq!(counts.weight, None);
        let Sums::Weighted(sums) = &counts.grid else {
            panic!("unequal weights")
        };
        let [w1, w2] = [0, 1].map(|k| sums.iter().map(|both| both[k]).sum::<f64>());
        let met = f64::from(n) - counts.unmet_rays as f64;
        assert!((w1 - (met * 2.5 + 4.5)).abs() < 1e-6 && (w2 - (met * 6.25 + 49.0 - 6.25)).abs() < 1e-5);
    }

    #[test]
    fn gives_the_same_bits_for_one_two_and_seven_threads() {
        let bytes = bytes(300_000, |i| 1.0 + f64::from(i % 7) / 3.0);
        let one = run(&bytes, 1);
        for threads in [2, 7] {
            let more = run(&bytes, threads);
            assert!(one.grid == more.grid && one.space == more.space && one.direction == more.direction);
            assert_eq!(one.kept, more.kept);
            assert_eq!(one.unmet_flux.to_bits(), more.unmet_flux.to_bits());
        }
    }

    #[test]
    fn the_same_ray_has_the_same_chance_in_any_block() {
        let whole = chances(5, 0, 4096);
        assert_eq!(chances(5, 2048, 100), whole[2048..2148]);
        assert_eq!(chances(5, 7, 20), whole[7..27]);
    }

    #[test]
    fn parts_may_have_grids_of_their_own() {
        // Cells of a coarser grid hold what their cells of a finer one hold together.
        let bytes = bytes(50_000, |_| 1.0);
        let table = RayTable::new(&bytes, LAYOUT).expect("valid");
        let coarse = PartGrids {
            depths: [1, 2, 0, 1],
            fine: [2, 1],
        };
        let mixed = Plan {
            grids: vec![GRIDS, coarse, GRIDS, coarse, coarse],
            ..plan()
        };
        let found = count(&table, &mixed, 2, |_| ControlFlow::Continue(())).expect("countable");
        let finer = run(&bytes, 2);
        let (Sums::Equal(found), Sums::Equal(finer)) = (&found.grid, &finer.grid) else {
            panic!("equal weights")
        };
        let fold = 2 * 256 + 3 * 16;
        assert_eq!(found.len(), 2 * fold);
        for held_out in [0, 1] {
            let (mine, whole) = (
                &found[held_out * fold..][..fold],
                &finer[held_out * 5 * 256..][..5 * 256],
            );
            assert_eq!(mine[..256], whole[..256]);
            let mut expected = [0; 16];
            for (cell, n) in whole[256..512].iter().enumerate() {
                // Coordinates of 2, 3, 2 and 1 halvings, of which 1, 2, 0 and 1 are kept.
                let [i, j, l] = [cell >> 6, (cell >> 3) & 7, cell & 1];
                expected[(i >> 1) << 3 | (j >> 1) << 1 | l] += n;
            }
            assert_eq!(mine[256..272], expected);
        }
    }

    #[test]
    fn absurd_plans_are_told() {
        let refused = |grids: Vec<PartGrids>| {
            let table = RayTable::new(&[], LAYOUT).expect("valid");
            count(&table, &Plan { grids, ..plan() }, 1, |_| ControlFlow::Continue(())).is_none()
        };
        let parts = zoo().len();
        assert!(!refused(vec![GRIDS; parts]));
        assert!(refused(vec![GRIDS; parts - 1]));
        assert!(refused(vec![
            PartGrids {
                depths: [8, 8, 8, 8],
                ..GRIDS
            };
            parts
        ]));
        assert!(refused(vec![PartGrids { fine: [40, 2], ..GRIDS }; parts]));
    }
}
