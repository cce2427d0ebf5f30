//! Cone maps from an index.

use std::ops::{ControlFlow, Range};

use etendue_geometry::table::RayTable;
use etendue_geometry::{RayBatch, RaySource};
use etendue_math::Vec3;

use super::LEAF;
use super::bounds::{Bounds, Sight};
use super::cells::Cells;
use crate::cone::{Cone, Sums, cone_sums};

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
            && super::leaves(starts).sum::<u64>() == bounds.len() as u64;
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
    pub fn candidates(&self, cone: &Cone) -> Vec<Range<u64>> {
        let sight = Sight::new(cone);
        let mut stretches: Vec<Range<u64>> = Vec::new();
        let mut bounds = self.bounds;
        for ((cell, pair), leaves) in (0..).zip(self.starts.windows(2)).zip(super::leaves(self.starts)) {
            #[allow(clippy::cast_possible_truncation, reason = "there are as many boxes in a slice")]
            let (own, rest) = bounds.split_at(leaves as usize);
            bounds = rest;
            if own.is_empty() {
                continue;
            }
            let frame = self.cells.frame(cell, self.centre);
            if !sight.may_meet(frame.z, self.cells.radius()) {
                continue;
            }
            let sighted = sight.cell(&frame);
            for (start, bounds) in (pair[0]..).step_by(LEAF).zip(own) {
                if sighted.may_see(bounds) {
                    let stop = (start + LEAF as u64).min(pair[1]);
                    match stretches.last_mut() {
                        Some(last) if last.end == start => last.end = stop,
                        _ => stretches.push(start..stop),
                    }
                }
            }
        }
        stretches
    }
}

/// Some stretches of a table as a source of their own.
struct Stretches<'a> {
    rays: RayTable<'a>,
    stretches: Vec<Range<u64>>,
    /// Index of each stretch's first ray in this source, and their total.
    starts: Vec<u64>,
}

impl<'a> Stretches<'a> {
    fn new(rays: RayTable<'a>, stretches: Vec<Range<u64>>) -> Self {
        let mut starts = vec![0];
        let mut total = 0;
        starts.extend(stretches.iter().map(|stretch| {
            total += stretch.end - stretch.start;
            total
        }));
        Self {
            rays,
            stretches,
            starts,
        }
    }
}

impl RaySource for Stretches<'_> {
    fn len(&self) -> u64 {
        self.starts[self.stretches.len()]
    }

    fn fill(&self, range: Range<u64>, batch: &mut RayBatch) {
        let first = self.starts.partition_point(|start| *start <= range.start) - 1;
        let parts = self.stretches[first..]
            .iter()
            .zip(&self.starts[first..])
            .take_while(|(_, start)| **start < range.end)
            .map(|(stretch, start)| {
                let skipped = range.start.saturating_sub(*start);
                stretch.start + skipped..stretch.end.min(stretch.start + (range.end - start))
            });
        self.rays.gather(parts, batch);
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
        let source = Stretches::new(index.rays, index.candidates(cone));
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
