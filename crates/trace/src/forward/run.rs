//! How many rays are traced, and how.

use std::sync::atomic::{AtomicBool, Ordering};

use etendue_geometry::RaySource;
use etendue_optics::light_sampler::LightSampler;

/// How many rays, and how.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// Of all sources together.
    pub rays: u64,
    /// Seed of the run.
    pub seed: u64,
    /// Events that a ray may have before it is ended.
    pub most_events: u32,
    /// The ray sets that sources refer to.
    pub sets: &'a [&'a dyn RaySource],
    /// Set by whoever wants the work to end at once; what it returns is then worth nothing.
    pub stop: Option<&'a AtomicBool>,
    /// What each source needs to be seen; none are needed unless a light image shares light with lines of sight.
    pub light_samplers: &'a [Option<LightSampler>],
}

impl Run<'_> {
    /// Whether `stop` is set.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }
}
