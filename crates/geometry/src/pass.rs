//! One pass over a ray source: the frame of everything that is summed over all rays.

use std::ops::ControlFlow;

use etendue_sampling::ordered;

use crate::ray_batch::RayBatch;
use crate::source::RaySource;

/// What is summed over rays, part by part.
pub(crate) trait Sums: Default + Send {
    /// Adds the usable rays of a block.
    fn add_block(&mut self, batch: &RayBatch);

    /// Adds the sums of another part.
    fn merge(&mut self, other: &Self);
}

/// The sums over a whole source, in file order by batches. Ends early, with those so far, if `progress` breaks.
pub(crate) fn over_all_rays<S: Sums>(
    source: &impl RaySource,
    threads: usize,
    progress: impl FnMut(u64) -> ControlFlow<()>,
) -> S {
    let mut total = S::default();
    ordered::run(
        threads,
        source.len(),
        |range| {
            let mut part = S::default();
            source.for_each_block(range, |_, batch| part.add_block(batch));
            part
        },
        |part| total.merge(&part),
        progress,
    );
    total
}
