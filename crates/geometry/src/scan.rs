//! The statistics of a ray set in one pass.

use std::ops::ControlFlow;

use crate::pass::{Sums, over_all_rays};
use crate::pass_account::PassAccount;
use crate::ray_batch::RayBatch;
use crate::source::RaySource;

/// What a ray set amounts to. Sums run over the usable rays, in file order by batches.
#[derive(Clone, Debug)]
pub struct Scan {
    /// The flux account.
    pub tally: PassAccount,
    /// Usable rays that carry no flux.
    pub zero_flux: u64,
    /// Smallest and largest flux of a usable ray.
    pub flux_range: [f64; 2],
    /// Smallest and largest coordinate on each axis \[mm\].
    pub bounds: [[f64; 2]; 3],
    /// Σ w x \[flux · mm\].
    pub weighted_position: [f64; 3],
    /// Σ w k.
    pub weighted_direction: [f64; 3],
    /// Σ w k kᵀ as xx, xy, xz, yy, yz, zz.
    pub weighted_outer: [f64; 6],
    /// Σ w (1 − k kᵀ) x, the right-hand side of the virtual focus \[flux · mm\].
    pub focus_rhs: [f64; 3],
}

impl Default for Scan {
    fn default() -> Self {
        Self {
            tally: PassAccount::default(),
            zero_flux: 0,
            flux_range: [f64::INFINITY, f64::NEG_INFINITY],
            bounds: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
            weighted_position: [0.0; 3],
            weighted_direction: [0.0; 3],
            weighted_outer: [0.0; 6],
            focus_rhs: [0.0; 3],
        }
    }
}

impl Sums for Scan {
    fn add_block(&mut self, batch: &RayBatch) {
        self.tally.add_block(batch);
        for i in (0..batch.len).filter(|&i| batch.usable(i)) {
            let (x, k, w) = (batch.position(i), batch.direction(i), batch.flux[i]);
            self.zero_flux += u64::from(w == 0.0);
            widen(&mut self.flux_range, w);
            let kx = x.dot(k);
            for (axis, (p, d)) in [(x.x, k.x), (x.y, k.y), (x.z, k.z)].into_iter().enumerate() {
                widen(&mut self.bounds[axis], p);
                self.weighted_position[axis] += w * p;
                self.weighted_direction[axis] += w * d;
                self.focus_rhs[axis] += w * (p - kx * d);
            }
            for (sum, product) in
                self.weighted_outer
                    .iter_mut()
                    .zip([k.x * k.x, k.x * k.y, k.x * k.z, k.y * k.y, k.y * k.z, k.z * k.z])
            {
                *sum += w * product;
            }
        }
    }

    fn merge(&mut self, other: &Self) {
        self.tally.merge(&other.tally);
        self.zero_flux += other.zero_flux;
        for (range, o) in
            std::iter::once((&mut self.flux_range, other.flux_range)).chain(self.bounds.iter_mut().zip(other.bounds))
        {
            widen(range, o[0]);
            widen(range, o[1]);
        }
        let add = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        add(&mut self.weighted_position, &other.weighted_position);
        add(&mut self.weighted_direction, &other.weighted_direction);
        add(&mut self.weighted_outer, &other.weighted_outer);
        add(&mut self.focus_rhs, &other.focus_rhs);
    }
}

fn widen(range: &mut [f64; 2], value: f64) {
    range[0] = range[0].min(value);
    range[1] = range[1].max(value);
}

/// Scans a whole source. Ends early, with the sums so far, if `progress` breaks.
pub fn scan(source: &impl RaySource, threads: usize, progress: impl FnMut(u64) -> ControlFlow<()>) -> Scan {
    over_all_rays(source, threads, progress)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{Float, Layout, RayTable};

    #[test]
    fn sums_of_an_asymmetric_set_match_a_plain_loop() {
        let n = 200_001_u64;
        let rays: Vec<[f64; 7]> = (0..n)
            .map(|i| {
                let t = i as f64 / n as f64;
                let k = [(7.0 * t).sin(), 0.3 + t, 1.0 - 0.5 * t];
                let norm = (k[0] * k[0] + k[1] * k[1] + k[2] * k[2]).sqrt();
                [
                    3.0 * t - 1.0,
                    t * t,
                    0.1 - t,
                    k[0] / norm,
                    k[1] / norm,
                    k[2] / norm,
                    1.0 + t,
                ]
            })
            .collect();
        let bytes: Vec<u8> = rays.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let layout = Layout {
            stride: 56,
            position: Some(0),
            direction: 24,
            flux: 48,
            float: Float::F64,
            colour: None,
            length_scale: 1.0,
        };
        let table = RayTable::new(&bytes, layout).expect("valid");
        let scanned = scan(&table, 2, |_| ControlFlow::Continue(()));
        let plain = |f: &dyn Fn(&[f64; 7]) -> f64| rays.iter().map(f).sum::<f64>();
        assert_eq!(scanned.tally.rays, n);
        assert!((scanned.tally.flux / plain(&|r| r[6]) - 1.0).abs() < 1e-12);
        assert!((scanned.tally.flux_squared / plain(&|r| r[6] * r[6]) - 1.0).abs() < 1e-12);
        assert!((scanned.weighted_outer[4] / plain(&|r| r[6] * r[4] * r[5]) - 1.0).abs() < 1e-12);
        assert!((scanned.weighted_position[1] / plain(&|r| r[6] * r[1]) - 1.0).abs() < 1e-12);
        let rhs = plain(&|r| r[6] * (r[2] - (r[0] * r[3] + r[1] * r[4] + r[2] * r[5]) * r[5]));
        assert!((scanned.focus_rhs[2] / rhs - 1.0).abs() < 1e-12);
        assert!((scanned.bounds[0][0] + 1.0).abs() < 1e-15 && (scanned.flux_range[0] - 1.0).abs() < 1e-15);
    }
}
