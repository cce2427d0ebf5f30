//! The flux of a ray set by colour, in one pass.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use etendue_math::special::ln;

use crate::pass::{Sums, over_all_rays};
use crate::ray_batch::RayBatch;
use crate::source::RaySource;

/// Bins per unit of the logarithm: they are 0.2 % wide, 0.9 nm at 450 nm. Whatever a file holds, there are not more bins than
/// a float has logarithms.
const BINS: f64 = 500.0;

/// Rays whose colours lie in one bin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bin {
    /// Flux of the rays.
    pub flux: f64,
    /// Σ flux · colour.
    weighted: f64,
    /// The smallest and the largest colour.
    pub range: [f64; 2],
}

impl Bin {
    /// The colour that stands for all of them: their mean by flux, which moves no colour to another place.
    #[must_use]
    pub fn mean(&self) -> f64 {
        let [low, high] = self.range;
        if low == high || self.flux <= 0.0 {
            low
        } else {
            (self.weighted / self.flux).clamp(low, high)
        }
    }

    fn merge(&mut self, other: &Self) {
        self.flux += other.flux;
        self.weighted += other.weighted;
        self.range = [self.range[0].min(other.range[0]), self.range[1].max(other.range[1])];
    }
}

/// The flux of rays by what their records say of their colour (see [`RayBatch::colour`]).
#[derive(Clone, Debug, Default)]
pub struct Colours {
    /// By colour, rising.
    pub bins: BTreeMap<i64, Bin>,
    /// Flux and number of the usable rays whose colour is not above 0, not finite, or not there.
    pub unknown: (f64, u64),
}

impl Sums for Colours {
    #[allow(clippy::cast_possible_truncation, reason = "a logarithm is small")]
    fn add_block(&mut self, batch: &RayBatch) {
        for i in (0..batch.len).filter(|&i| batch.usable(i)) {
            let flux = batch.flux[i];
            let colour = batch.colour.get(i).copied().unwrap_or(0.0);
            if !(colour > 0.0 && colour.is_finite()) {
                self.unknown.0 += flux;
                self.unknown.1 += 1;
                continue;
            }
            let bin = Bin {
                flux,
                weighted: flux * colour,
                range: [colour; 2],
            };
            let key = (ln(colour) * BINS).floor() as i64;
            self.bins
                .entry(key)
                .and_modify(|known| known.merge(&bin))
                .or_insert(bin);
        }
    }

    fn merge(&mut self, other: &Self) {
        self.unknown.0 += other.unknown.0;
        self.unknown.1 += other.unknown.1;
        for (key, bin) in &other.bins {
            self.bins
                .entry(*key)
                .and_modify(|known| known.merge(bin))
                .or_insert(*bin);
        }
    }
}

/// One pass over a whole source. Ends early, with the sums so far, if `progress` breaks.
pub fn colours(source: &impl RaySource, threads: usize, progress: impl FnMut(u64) -> ControlFlow<()>) -> Colours {
    over_all_rays(source, threads, progress)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{Column, Float, Layout, Number, RayTable};

    #[test]
    fn lines_stay_where_they_are_and_a_band_keeps_its_mean() {
        // Two lines, a band from 500 to 600 nm whose flux rises, and rays without a wavelength.
        let n = 150_000_u64;
        let ray = |i: u64| {
            let t = i as f64 / n as f64;
            let band = 500.0 + 100.0 * t;
            let (flux, wavelength) = match i % 4 {
                0 => (1.0, 450.0),
                1 => (0.5, 633.0),
                2 => (t, band),
                _ => (2.0, [0.0, -1.0, f64::NAN, f64::INFINITY][(i / 4 % 4) as usize]),
            };
            [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, flux, wavelength]
        };
        let bytes: Vec<u8> = (0..n).flat_map(ray).flat_map(f64::to_le_bytes).collect();
        let layout = Layout {
            stride: 64,
            position: Some(0),
            direction: 24,
            flux: 48,
            float: Float::F64,
            colour: Some(Column {
                offset: 56,
                number: Number::Float(Float::F64),
                scale: 1.0,
            }),
            length_scale: 1.0,
        };
        let table = RayTable::new(&bytes, layout).expect("valid");
        let found = colours(&table, 1, |_| ControlFlow::Continue(()));
        let several = colours(&table, 3, |_| ControlFlow::Continue(()));
        assert_eq!(found.bins, several.bins);
        assert_eq!(found.unknown, several.unknown);
        let quarter = n as f64 / 4.0;
        assert_eq!(found.unknown.1, n / 4);
        assert!((found.unknown.0 - 2.0 * quarter).abs() < 1e-6);
        let at = |wavelength: f64| {
            found
                .bins
                .values()
                .find(|bin| bin.mean() == wavelength)
                .expect("a line")
        };
        assert!((at(450.0).flux - quarter).abs() < 1e-6 && (at(633.0).flux - 0.5 * quarter).abs() < 1e-6);
        let band: Vec<&Bin> = found
            .bins
            .values()
            .filter(|b| b.range[0] >= 500.0 && b.range[1] <= 600.0)
            .collect();
        assert!(band.len() > 80 && band.iter().all(|b| b.range[1] - b.range[0] < 1.2));
        // ∫ t dt and ∫ t (500 + 100 t) dt over 0..1.
        let (flux, weighted) = band
            .iter()
            .fold((0.0, 0.0), |(f, w), b| (f + b.flux, w + b.flux * b.mean()));
        assert!((flux / quarter - 0.5).abs() < 1e-4);
        assert!((weighted / flux - (250.0 + 100.0 / 3.0) / 0.5).abs() < 0.01);
    }
}
