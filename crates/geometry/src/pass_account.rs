//! The flux account of a pass over rays.

use multiversion::multiversion;

use crate::ray_batch::{Defect, LANES, RayBatch};

/// What a pass has seen: counted in every pass, because the scale of relative fluxes and the complaints rest on it.
#[derive(Clone, Debug, Default)]
pub struct PassAccount {
    /// Rays looked at.
    pub rays: u64,
    /// Rays that cannot be used, by [`Defect`].
    pub defects: [u64; Defect::COUNT],
    /// Usable rays without flux.
    pub dark: u64,
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
        // Rays that cannot be used have no flux left.
        self.dark += zeros(&batch.flux[..batch.len]) - batch.defects.iter().sum::<u64>();
        let [flux, squared] = flux_sums(&batch.flux[..batch.len]);
        self.flux += flux;
        self.flux_squared += squared;
    }

    /// Adds another tally's sums to this one's.
    pub fn merge(&mut self, other: &Self) {
        self.rays += other.rays;
        self.norm_error = self.norm_error.max(other.norm_error);
        self.defects
            .iter_mut()
            .zip(other.defects)
            .for_each(|(total, count)| *total += count);
        self.dark += other.dark;
        self.flux += other.flux;
        self.flux_squared += other.flux_squared;
    }
}

/// How many are 0.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn zeros(flux: &[f64]) -> u64 {
    flux.iter().map(|w| u64::from(*w == 0.0)).sum()
}

/// Σ w and Σ w² of a block, lane by lane, and these one after another: the same bits on every instruction set.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn flux_sums(flux: &[f64]) -> [f64; 2] {
    let (mut sum, mut squared) = ([0.0; LANES], [0.0; LANES]);
    let (chunks, rest) = flux.as_chunks::<LANES>();
    for chunk in chunks {
        for lane in 0..LANES {
            sum[lane] += chunk[lane];
            squared[lane] += chunk[lane] * chunk[lane];
        }
    }
    for (lane, w) in rest.iter().enumerate() {
        sum[lane] += w;
        squared[lane] += w * w;
    }
    [sum, squared].map(|lanes| lanes.into_iter().sum())
}
