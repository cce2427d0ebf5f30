//! Batches of a run: what they amount to, worked out on the threads of the current pool and merged in their order.

use std::ops::Range;

use rayon::prelude::*;

use crate::dealing::Dealing;
use crate::detector::Detector;
use crate::forward::batch::trace_batch;
use crate::forward::run::Run;
use crate::scene::Scene;
use crate::tallies::{BatchSums, Open, TraceSums};

/// Traces batches `batches` of a run on the threads of the current pool, and merges them in order.
#[must_use]
pub fn trace(scene: &Scene, detectors: &[Detector], run: &Run<'_>, batches: Range<u64>) -> TraceSums {
    trace_on(scene, detectors, run, batches, Open::new())
}

/// As [`trace`], of a run whose earlier batches left these sums of open units.
#[must_use]
pub fn trace_on(scene: &Scene, detectors: &[Detector], run: &Run<'_>, batches: Range<u64>, open: Open) -> TraceSums {
    let dealing = Dealing::of(scene, run.rays, run.sets);
    let parts: Vec<BatchSums> = batches
        .clone()
        .into_par_iter()
        .map(|b| trace_batch(scene, detectors, run, &dealing, b))
        .collect();
    let mut sums = TraceSums::new(scene, detectors, &dealing, open);
    for (part, batch) in parts.into_iter().zip(batches) {
        sums.add(part, &dealing, batch);
    }
    sums
}
