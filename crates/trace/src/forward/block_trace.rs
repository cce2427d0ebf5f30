//! The rays of a block, and what they leave: flux in the account, contributions to detectors, points of their trails.

use etendue_math::Vec3;
use etendue_sampling::ordered::BATCH;

use super::run::Run;
use crate::detector::{Detector, Light, Wants};
use crate::medium_cache::MediumCache;
use crate::ray_state::RayState;
use crate::scene::Scene;
use crate::tallies::BatchSums;

/// The rays of a block on their way, and what they have left so far.
pub struct BlockTrace<'a> {
    pub scene: &'a Scene,
    pub detectors: &'a [Detector],
    /// What any of them wants to be told of.
    pub wants: Wants,
    pub run: &'a Run<'a>,
    pub media: MediumCache,
    /// What each ray of the block carries.
    pub states: Vec<RayState>,
    /// The wavelength of all of them, where it is the same \[nm\].
    pub wavelength: Option<f64>,
    /// Where each ray has been, if that is wanted.
    pub trails: Option<Vec<Vec<Vec3>>>,
    /// How far a ray that escapes is followed on its trail \[mm\].
    pub far: f64,
    pub out: BatchSums,
}

impl BlockTrace<'_> {
    /// A point more on the trail of a ray.
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "below the size of a batch")]
    pub fn mark(&mut self, ray: u64, point: Vec3) {
        if let Some(trails) = &mut self.trails {
            let slot = (ray % BATCH) as usize;
            trails.resize(trails.len().max(slot + 1), Vec::new());
            trails[slot].push(point);
        }
    }

    /// Detectors are told of a ray that leaves the scene.
    pub fn escape(&mut self, d: Vec3, state: &RayState) {
        let light = Light { direction: d, state };
        for (detector, out) in self.detectors.iter().zip(&mut self.out.detectors) {
            detector.escape(&light, out);
        }
    }
}
