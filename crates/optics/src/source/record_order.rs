//! The order in which the records of a ray set are gone through.
//!
//! Files have an order of their own: sorted by place or wavelength, each ray followed by its mirror image, two colours in
//! turn. A run takes a share of the records, or some of them more often than others, and ends anywhere. So the order is
//! random, and still reads whole stretches of a file: places are turned by a random number, which gives every record the
//! same chance; records are mixed within chunks of 256, chunks within stretches of 256 of them, and so on, lest any period
//! of the file meets one of the places that are taken; and chunks are gone through in steps of the golden section, so that
//! every beginning of a run is spread over the whole file.

use std::ops::Range;

use etendue_geometry::{RayBatch, RaySource};
use etendue_sampling::philox::Stream;

/// Records that stay together.
const CHUNK: u64 = 256;

/// The purpose under which orders are drawn (see [`Stream::new`]), to which the number of the set is added.
const PURPOSE_ORDER: u64 = 0x4F52_4452 << 32;

/// Bits of an address below the level: more than a set has chunks.
const LEVEL_BITS: u32 = 56;

/// A random order of the records of a set: the same for all its sources, so that the same place is the same record.
pub struct RecordOrder {
    n: u64,
    turn: u64,
    /// From one chunk to the next \[chunks\].
    step: u64,
    stream: Stream,
    /// For each level the stretch that was last mixed and the order of its members.
    mixed: Vec<(u64, Vec<u8>)>,
}

impl RecordOrder {
    /// The order of a set of n records, by its number and the seed of a run.
    #[must_use]
    pub fn new(n: u64, set: usize, seed: u64) -> Self {
        let stream = Stream::new(seed, PURPOSE_ORDER + set as u64);
        Self {
            n,
            turn: scale(stream.word(u64::MAX), n),
            step: golden_step(n / CHUNK),
            stream,
            mixed: Vec::new(),
        }
    }

    /// Records in places ⌊i n/count⌋ for i in `range`, at most a block.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "quotients are below the set's length; ranges are at most a block"
    )]
    pub fn resample(&mut self, set: &dyn RaySource, range: Range<u64>, count: u64, batch: &mut RayBatch) {
        let mut part = RayBatch::default();
        batch.len = (range.end - range.start) as usize;
        batch.colour.clear();
        batch.defects = Default::default();
        batch.norm_error = 0.0;
        let mut records = Vec::new();
        let (mut slot, mut i) = (0, range.start);
        while i < range.end {
            // The records of one chunk follow each other, but for their order.
            records.clear();
            let mut chunk = None;
            while i < range.end {
                let place = (u128::from(i) * u128::from(self.n) / u128::from(count)) as u64;
                let record = self.record(place);
                if *chunk.get_or_insert(record / CHUNK) != record / CHUNK {
                    break;
                }
                records.push(record);
                i += 1;
            }
            let first = records.iter().copied().min().unwrap_or_default();
            let last = records.iter().copied().max().unwrap_or_default();
            set.fill(first..last + 1, &mut part);
            for record in &records {
                let at = (record - first) as usize;
                for axis in 0..3 {
                    batch.position[axis][slot] = part.position[axis][at];
                    batch.direction[axis][slot] = part.direction[axis][at];
                }
                batch.flux[slot] = part.flux[at];
                batch.colour.extend(part.colour.get(at));
                slot += 1;
            }
            batch.norm_error = batch.norm_error.max(part.norm_error);
        }
    }

    /// The record in a place.
    fn record(&mut self, place: u64) -> u64 {
        let place = (u128::from(place) + u128::from(self.turn)) % u128::from(self.n);
        #[allow(clippy::cast_possible_truncation, reason = "below the number of records")]
        let record = self.mix(place as u64, self.n, 0);
        let (chunk, chunks) = (record / CHUNK, self.n / CHUNK);
        if chunk >= chunks {
            return record;
        }
        #[allow(clippy::cast_possible_truncation, reason = "below the number of chunks")]
        let chunk = (u128::from(chunk) * u128::from(self.step) % u128::from(chunks)) as u64;
        chunk * CHUNK + record % CHUNK
    }

    /// Where place `i` of n goes: within its stretch, and with it. The last stretch, which is shorter, stays where it is.
    fn mix(&mut self, i: u64, n: u64, level: usize) -> u64 {
        let (stretch, stretches) = (i / CHUNK, n / CHUNK);
        let inner = self.within(level, stretch, (n - stretch * CHUNK).min(CHUNK), i % CHUNK);
        let stretch = if stretch < stretches && stretches > 1 {
            self.mix(stretch, stretches, level + 1)
        } else {
            stretch
        };
        stretch * CHUNK + inner
    }

    /// Where a member of a stretch of so many goes within it.
    #[allow(clippy::cast_possible_truncation, reason = "members of a stretch; few levels")]
    fn within(&mut self, level: usize, stretch: u64, members: u64, i: u64) -> u64 {
        if self.mixed.len() == level {
            self.mixed.push((u64::MAX, Vec::new()));
        }
        let (known, order) = &mut self.mixed[level];
        if *known != stretch {
            *known = stretch;
            let address = ((level as u64) << LEVEL_BITS) | stretch;
            order.clear();
            order.extend((0..members).map(|member| member as u8));
            // Durstenfeld's shuffle; of a word either half is a number.
            let mut words = (0..).flat_map(|block| self.stream.block(address, block));
            let mut spare = None;
            for k in (1..members).rev() {
                let half = spare.take().unwrap_or_else(|| {
                    let word = words.next().unwrap_or_default();
                    spare = Some(word << 32);
                    word
                });
                order.swap(k as usize, scale((half >> 32) << 32, k + 1) as usize);
            }
        }
        u64::from(order[i as usize])
    }
}

/// A word as a whole number below n.
#[allow(clippy::cast_possible_truncation, reason = "below n")]
fn scale(word: u64, n: u64) -> u64 {
    ((u128::from(word) * u128::from(n)) >> 64) as u64
}

/// A step that shares no factor with the number of chunks, so that each of them is met once, near their golden section.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "below the number of chunks"
)]
fn golden_step(chunks: u64) -> u64 {
    let golden = (chunks as f64 * 0.618_033_988_749_895) as u64;
    let common = |mut a: u64, mut b: u64| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    (golden..golden + chunks)
        .find(|step| common(*step, chunks) == 1)
        .unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::cast_possible_truncation, reason = "small numbers")]
    fn every_record_is_gone_through_once_and_every_beginning_is_spread_out() {
        for n in [1, 2, 255, 256, 257, 1000, 100_000, 256 * 377, 256 * 256 * 2 + 300] {
            let mut order = RecordOrder::new(n, 3, 7);
            let mut seen: Vec<u64> = (0..n).map(|i| order.record(i)).collect();
            if n > 10_000 {
                // The mean of the first tenth is near the middle of the file.
                let mean = seen[..n as usize / 10].iter().map(|r| *r as f64).sum::<f64>() / (n as f64 / 10.0);
                assert!((mean / n as f64 - 0.5).abs() < 0.05, "{n}: {mean}");
            }
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..n), "{n}");
        }
    }

    /// Of records in a period, each has its share among those that are taken, with the error of a draw without replacement,
    /// whatever share is taken. Six standard deviations, for fewer than a hundred comparisons.
    #[test]
    fn no_period_of_the_file_shows_in_what_is_taken() {
        for n in [300_u64, 100_000, 256 * 256 * 3] {
            for period in [2, 3, 4, 256, 512, 256 * 256] {
                for (taken, of) in [(1_u64, 1000_u64), (1, 10), (1, 2), (3, 4), (3, 2), (5, 2)] {
                    let count = n * taken / of;
                    if count < 20 || n < 4 * period {
                        continue;
                    }
                    let (mut found, mut expected, mut variance) = (0.0, 0.0, 0.0);
                    for seed in 0..8 {
                        let mut order = RecordOrder::new(n, 1, seed);
                        let place = |i: u64| i * n / count;
                        let hits = (0..count)
                            .filter(|i| order.record(place(*i)) % period < period / 2)
                            .count();
                        let share = (0..n).filter(|r| r % period < period / 2).count() as f64 / n as f64;
                        // Of places taken more often than others only the additional ones are drawn.
                        let drawn = (count % n) as f64;
                        found += hits as f64;
                        expected += share * count as f64;
                        variance += drawn * share * (1.0 - share) * (1.0 - drawn / n as f64);
                    }
                    let z = (found - expected) / variance.max(1e-9).sqrt();
                    assert!(
                        z.abs() < 6.0,
                        "{n} records, period {period}, {taken}/{of}: {found} for {expected}, z {z}"
                    );
                }
            }
        }
    }

    /// Every record has the same chance, the last and shorter chunk included: over seeds each is met as often as it should.
    #[test]
    #[allow(clippy::cast_possible_truncation, reason = "small numbers")]
    fn every_record_has_the_same_chance() {
        let (n, count, seeds) = (257_u64, 128_u64, 4000);
        let mut met = vec![0_u32; n as usize];
        for seed in 0..seeds {
            let mut order = RecordOrder::new(n, 0, seed);
            (0..count).for_each(|i| met[order.record(i * n / count) as usize] += 1);
        }
        let share = count as f64 / n as f64;
        let chi2: f64 = met
            .iter()
            .map(|m| (f64::from(*m) - share * seeds as f64).powi(2) / (share * (1.0 - share) * seeds as f64))
            .sum();
        // 257 degrees of freedom, but for the one of the sum: beyond 360 lie 2 in 10⁵.
        assert!(chi2 < 360.0, "{chi2}");
        assert!(met.iter().all(|m| (f64::from(*m) - share * seeds as f64).abs() < 160.0));
    }
}
