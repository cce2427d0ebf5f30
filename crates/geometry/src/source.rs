//! Anything that yields rays by index.

use std::ops::Range;

use crate::ray_batch::{BLOCK, RayBatch};

/// A finite sequence of rays, addressed by index, that any thread may read anywhere.
pub trait RaySource: Sync {
    /// Number of rays.
    fn len(&self) -> u64;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Puts the rays `range` (at most [`BLOCK`]) into `batch`, settled (see [`RayBatch::settle`]).
    fn fill(&self, range: Range<u64>, batch: &mut RayBatch);

    /// Calls `visit` for each block of `range`, with the index of the block's first ray.
    fn for_each_block(&self, range: Range<u64>, mut visit: impl FnMut(u64, &RayBatch))
    where
        Self: Sized,
    {
        let mut batch = RayBatch::default();
        let mut start = range.start;
        while start < range.end {
            let stop = (start + BLOCK as u64).min(range.end);
            self.fill(start..stop, &mut batch);
            visit(start, &batch);
            start = stop;
        }
    }
}
