//! Cone maps from an index.

use std::ops::{ControlFlow, Range};

use etendue_geometry::table::RayTable;
use etendue_geometry::{RayBatch, RaySource};
use etendue_math::Vec3;
use etendue_sampling::ordered;
use rayon::prelude::*;

use super::bounds::{Bounds, Sight};
use super::cells::Cells;
use super::leaf::{LEAF, leaves};
use crate::cone::{Cone, Sums, cone_sums};

/// Cells that a thread looks into at a time.
const SOME: usize = 64;

/// An index over borrowed memory: records in the order of their leaves, where cells start, the boxes of the leaves.
#[derive(Clone, Copy, Debug)]
pub struct RayIndex<'a> {
    rays: RayTable<'a>,
    cells: Cells,
    centre: Vec3,
    starts: &'a [u64],
    bounds: &'a [Bounds],
}

impl<'a> RayIndex<'a> {
    /// An index; None if its tables do not fit each other. `bounds` holds eight numbers for each leaf.
    #[must_use]
    pub fn new(rays: RayTable<'a>, cells: Cells, centre: Vec3, starts: &'a [u64], bounds: &'a [f32]) -> Option<Self> {
        let bounds: &[Bounds] = bytemuck::try_cast_slice(bounds).ok()?;
        let fits = starts.len() == cells.count() + 1
            && starts[0] == 0
            && starts.windows(2).all(|pair| pair[0] <= pair[1])
            && starts[cells.count()] == rays.len()
            && leaves(starts).sum::<u64>() == bounds.len() as u64;
        fits.then_some(Self {
            rays,
            cells,
            centre,
            starts,
            bounds,
        })
    }

    /// The rays of all leaves that a cone may see, as stretches of the index, rising.
    #[must_use]
    pub fn candidates(&self, cone: &Cone, threads: usize) -> Vec<Range<u64>> {
        let sight = Sight::new(cone);
        let mut first = 0;
        let cells: Vec<Cell> = (0..)
            .zip(self.starts.windows(2).zip(leaves(self.starts)))
            .filter(|(_, (_, leaves))| *leaves > 0)
            .map(|(number, (pair, leaves))| {
                #[allow(clippy::cast_possible_truncation, reason = "there are as many boxes in a slice")]
                let leaves = first..first + leaves as usize;
                first = leaves.end;
                Cell {
                    number,
                    rays: pair[0]..pair[1],
                    leaves,
                }
            })
            .collect();
        let look = |some: &[Cell]| {
            let mut stretches = Vec::new();
            for cell in some {
                self.look_into(cell, &sight, &mut stretches);
            }
            stretches
        };
        let found: Vec<Vec<Range<u64>>> = ordered::within(threads, |parallel| {
            if parallel {
                cells.par_chunks(SOME).map(look).collect()
            } else {
                cells.chunks(SOME).map(look).collect()
            }
        });
        let mut stretches = Vec::new();
        found
            .into_iter()
            .flatten()
            .for_each(|stretch| join(&mut stretches, stretch));
        stretches
    }

    fn look_into(&self, cell: &Cell, sight: &Sight, stretches: &mut Vec<Range<u64>>) {
        let frame = self.cells.frame(cell.number, self.centre);
        if !sight.may_meet(frame.z, self.cells.radius()) {
            return;
        }
        let sighted = sight.cell(&frame);
        let starts = (cell.rays.start..).step_by(LEAF);
        for (start, bounds) in starts.zip(&self.bounds[cell.leaves.clone()]) {
            if sighted.may_see(bounds) {
                join(stretches, start..(start + LEAF as u64).min(cell.rays.end));
            }
        }
    }
}

/// Adds a stretch to others that end before or where it begins.
fn join(stretches: &mut Vec<Range<u64>>, stretch: Range<u64>) {
    match stretches.last_mut() {
        Some(last) if last.end == stretch.start => last.end = stretch.end,
        _ => stretches.push(stretch),
    }
}

/// A cell that holds rays, and where they and their boxes are.
struct Cell {
    number: u32,
    rays: Range<u64>,
    leaves: Range<usize>,
}

/// Some stretches of a table as a source of their own.
struct Stretches<'a> {
    rays: RayTable<'a>,
    parts: Vec<Range<u64>>,
    /// Index of each part's first ray in this source, and their total.
    starts: Vec<u64>,
}

impl<'a> Stretches<'a> {
    fn new(rays: RayTable<'a>, parts: Vec<Range<u64>>) -> Self {
        let mut starts = vec![0];
        let mut total = 0;
        starts.extend(parts.iter().map(|part| {
            total += part.end - part.start;
            total
        }));
        Self { rays, parts, starts }
    }
}

impl RaySource for Stretches<'_> {
    fn len(&self) -> u64 {
        self.starts[self.parts.len()]
    }

    fn fill(&self, range: Range<u64>, batch: &mut RayBatch) {
        let first = self.starts.partition_point(|start| *start <= range.start) - 1;
        let pieces = self.parts[first..]
            .iter()
            .zip(&self.starts[first..])
            .take_while(|(_, start)| **start < range.end)
            .map(|(part, start)| {
                let skipped = range.start.saturating_sub(*start);
                part.start + skipped..part.end.min(part.start + (range.end - start))
            });
        self.rays.gather(pieces, batch);
    }
}

/// Sums of the seen rays for each cone, as [`cone_sums`] of the index' records gives them bit by bit, and the number of
/// rays that had to be looked at.
pub fn index_sums(
    index: &RayIndex<'_>,
    cones: &[Cone],
    threads: usize,
    mut progress: impl FnMut(u64) -> ControlFlow<()>,
) -> Vec<(Sums, u64)> {
    let mut all = Vec::with_capacity(cones.len());
    for cone in cones {
        let source = Stretches::new(index.rays, index.candidates(cone, threads));
        let mut stopped = false;
        let (sums, _) = cone_sums(&source, std::slice::from_ref(cone), threads, |done| {
            let flow = progress(done);
            stopped |= flow.is_break();
            flow
        });
        all.extend(sums.into_iter().map(|sums| (sums, source.len())));
        if stopped {
            break;
        }
    }
    all
}
