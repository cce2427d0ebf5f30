//! Work units: some batches of a run → what they amount to. A pure function of scene, detectors, run and batches, and the one
//! seam at which a trace is cut: for threads, to go on later, for other processes and machines. The sums of work units are
//! joined in the order of their batches ([`crate::tallies::join`]; the rest are plain sums).

use std::ops::Range;

use rayon::prelude::*;

use crate::dealing::Dealing;
use crate::detector::Detector;
use crate::forward::batch::trace_batch;
use crate::forward::run::Run;
use crate::scene::Scene;
use crate::tallies::{BatchSums, TraceSums};

/// Traces batches `batches` of a run on the threads of the current pool. The same bits for any number of threads.
#[must_use]
pub fn work_unit(scene: &Scene, detectors: &[Detector], run: &Run<'_>, batches: Range<u64>) -> TraceSums {
    let dealing = Dealing::of(scene, run.rays, run.sets);
    work_unit_of(scene, detectors, run, &dealing, batches)
}

/// The same with rays that are dealt in another way.
#[must_use]
pub fn work_unit_of(
    scene: &Scene,
    detectors: &[Detector],
    run: &Run<'_>,
    dealing: &Dealing,
    batches: Range<u64>,
) -> TraceSums {
    let parts: Vec<BatchSums> = batches
        .into_par_iter()
        .map(|batch| trace_batch(scene, detectors, run, dealing, batch))
        .collect();
    TraceSums::of(scene, detectors, dealing, parts)
}
