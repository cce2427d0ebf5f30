//! The flux account of a pass over rays.

use crate::ray_batch::{Defect, RayBatch};

/// What a pass has seen: counted in every pass, because the scale of relative fluxes and the complaints rest on it.
#[derive(Clone, Debug, Default)]
pub struct PassAccount {
    /// Rays looked at.
    pub rays: u64,
    /// Rays that cannot be used, by [`Defect`].
    pub defects: [u64; Defect::COUNT],
    /// Σ w over the usable rays, in file order by batches \[flux unit\].
    pub flux: f64,
    /// Σ w².
    pub flux_squared: f64,
    /// Largest | |k| − 1 | of the stored directions.
    pub norm_error: f64,
}

impl PassAccount {
    /// Adds the rays of a block.
    pub fn add_block(&mut self, batch: &RayBatch) {
        self.rays += batch.len as u64;
        self.norm_error = self.norm_error.max(batch.norm_error);
        self.defects
            .iter_mut()
            .zip(batch.defects)
            .for_each(|(total, count)| *total += count);
        for w in &batch.flux[..batch.len] {
            self.flux += w;
            self.flux_squared += w * w;
        }
    }

    /// Adds another tally's sums to this one's.
    pub fn merge(&mut self, other: &Self) {
        self.rays += other.rays;
        self.norm_error = self.norm_error.max(other.norm_error);
        self.defects
            .iter_mut()
            .zip(other.defects)
            .for_each(|(total, count)| *total += count);
        self.flux += other.flux;
        self.flux_squared += other.flux_squared;
    }
}
