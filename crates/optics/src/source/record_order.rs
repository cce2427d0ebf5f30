//! The order in which the records of a ray set are gone through.
//!
//! Files have an order of their own: sorted by place or wavelength, each ray followed by its mirror image, two colours in
//! turn. A run takes a share of the records, or some of them more often than others, and ends anywhere. So the order is
//! random, and still reads whole chunks of a file: the places of the order are turned by a random number, which gives every
//! record the same chance; records are mixed within their chunk, lest any period of the file meets one of the places that
//! are taken; and chunks are gone through in the order of van der Corput, scrambled (`[Owen1995]`): of any stretch of
//! the order as many lie in one half of the file as in the other, in each of its quarters, and so on, and where they lie
//! there is random.

use std::ops::Range;

use etendue_geometry::{RayBatch, RaySource};
use etendue_sampling::philox::Stream;

/// Records that are read together.
const CHUNK: u64 = 256;

/// The purpose under which orders are drawn (see [`Stream::new`]), to which the number of the set is added.
const PURPOSE_ORDER: u64 = 0x4F52_4452 << 32;

/// Halvings whose random bits are one word: those of a node, its 2 children, and so on to the 32 of the last level.
const LEVELS_PER_WORD: u32 = 6;

/// Addresses of the shuffles; those below are nodes of halvings.
const SHUFFLES: u64 = 1 << 63;

/// Rounds of a [`Shuffle`]. After six it still shows where pairs of members go.
const ROUNDS: u32 = 8;

/// A random order of the records of a set: the same for all its sources, so that the same place is the same record.
pub struct RecordOrder {
    n: u64,
    turn: u64,
    stream: Stream,
}

impl RecordOrder {
    /// The order of a set of n records, by its number and the seed of a run.
    #[must_use]
    pub fn new(n: u64, set: usize, seed: u64) -> Self {
        let stream = Stream::new(seed, PURPOSE_ORDER + set as u64);
        Self {
            n,
            turn: scale(stream.word(0), n),
            stream,
        }
    }

    /// Records in places ⌊i n/count⌋ for i in `range`, at most a block.
    #[allow(clippy::cast_possible_truncation, reason = "ranges are at most a block")]
    pub fn resample(&self, set: &dyn RaySource, range: Range<u64>, count: u64, batch: &mut RayBatch) {
        let mut part = RayBatch::default();
        batch.len = (range.end - range.start) as usize;
        batch.colour.clear();
        batch.defects = Default::default();
        batch.norm_error = 0.0;
        let mut places = Places::new(self.n, range.start, count);
        let mut members = Vec::new();
        let mut slot = 0;
        while slot < batch.len {
            // The places of one chunk follow each other.
            let start = places.at;
            let turned = self.turned(start);
            let (chunk, shuffle) = self.chunk(turned / CHUNK);
            let inside = turned % CHUNK;
            members.clear();
            while slot + members.len() < batch.len && inside + (places.at - start) < shuffle.members {
                members.push(shuffle.member(inside + (places.at - start)));
                places.advance();
            }
            let first = members.iter().copied().min().unwrap_or_default();
            let last = members.iter().copied().max().unwrap_or_default();
            set.fill(chunk + first..chunk + last + 1, &mut part);
            for axis in 0..3 {
                pick(&part.position[axis], &members, first, &mut batch.position[axis][slot..]);
                pick(
                    &part.direction[axis],
                    &members,
                    first,
                    &mut batch.direction[axis][slot..],
                );
            }
            pick(&part.flux, &members, first, &mut batch.flux[slot..]);
            let colours = members
                .iter()
                .filter_map(|member| part.colour.get((member - first) as usize));
            batch.colour.extend(colours);
            batch.norm_error = batch.norm_error.max(part.norm_error);
            slot += members.len();
        }
    }

    /// A place, turned.
    fn turned(&self, place: u64) -> u64 {
        // Not the sum, which can be beyond 64 bits.
        let before = self.n - self.turn;
        if place < before {
            place + self.turn
        } else {
            place - before
        }
    }

    /// The first record of the chunk that stands in a place of chunks, and the order within it. The last chunk, which is
    /// shorter, stays where it is.
    fn chunk(&self, place: u64) -> (u64, Shuffle) {
        let chunks = self.n / CHUNK;
        let chunk = if place < chunks {
            self.spread(place, chunks)
        } else {
            place
        };
        let first = chunk * CHUNK;
        let [low, high, ..] = self.stream.words(SHUFFLES + chunk);
        (first, Shuffle::new(CHUNK.min(self.n - first), [low, high]))
    }

    /// Where place `i` of n goes: by its last bit, turned over or not, to one half; there by the bit before; and so on.
    fn spread(&self, mut i: u64, n: u64) -> u64 {
        // High bits are added to the low ones: places that are multiples of a power of two would all go to the same part.
        // Those that are beyond n by this, a few at the end, go on to the next.
        loop {
            i ^= i >> 8;
            i ^= i >> 16;
            if i < n {
                break;
            }
        }
        let (mut begin, mut size) = (0, n);
        // Nodes are numbered from 1 as in a heap: those below node j are 2 j and 2 j + 1.
        let (mut node, mut level) = (1_u64, 0);
        let (mut bits, mut below) = (0, 1_u32);
        while size > 1 {
            if level % LEVELS_PER_WORD == 0 {
                (bits, below) = (self.stream.word(node), 1);
            }
            let odd = i % 2 == 1;
            let upper = odd != (bits >> below & 1 == 1);
            let members = if odd { size / 2 } else { size - size / 2 };
            if upper {
                begin += size - members;
            }
            (node, below) = (2 * node + u64::from(upper), 2 * below + u32::from(upper));
            (i, size, level) = (i / 2, members, level + 1);
        }
        begin
    }
}

/// The places ⌊i n/count⌋, one after the other.
struct Places {
    at: u64,
    /// What the division leaves.
    rest: u64,
    step: u64,
    rest_of_step: u64,
    count: u64,
}

impl Places {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "quotients are below n, remainders below the count"
    )]
    fn new(n: u64, i: u64, count: u64) -> Self {
        let product = u128::from(i) * u128::from(n);
        Self {
            at: (product / u128::from(count)) as u64,
            rest: (product % u128::from(count)) as u64,
            step: n / count,
            rest_of_step: n % count,
            count,
        }
    }

    fn advance(&mut self) {
        // Not the sum, which can be beyond 64 bits.
        let full = self.rest >= self.count - self.rest_of_step;
        self.at += self.step + u64::from(full);
        self.rest = if full {
            self.rest - (self.count - self.rest_of_step)
        } else {
            self.rest + self.rest_of_step
        };
    }
}

/// A random order of members, from 128 random bits: each round multiplies by an odd number and adds another, modulo a power
/// of two, and brings the high bits down.
struct Shuffle {
    members: u64,
    /// Of the power of two that the members need.
    bits: u32,
    key: [u64; 2],
}

impl Shuffle {
    fn new(members: u64, key: [u64; 2]) -> Self {
        let bits = members.next_power_of_two().trailing_zeros();
        Self { members, bits, key }
    }

    /// Where member `i` goes.
    fn member(&self, i: u64) -> u64 {
        let (mask, half) = ((1 << self.bits) - 1, (self.bits / 2).max(2));
        let mut x = i;
        loop {
            for round in 0..ROUNDS {
                let key = self.key[(round / 4) as usize].rotate_right(16 * (round % 4));
                x = x.wrapping_mul(key | 1).wrapping_add(key >> 8) & mask;
                x ^= x >> (half - round % 2);
            }
            // A number that no member has goes on to the next.
            if x < self.members {
                return x;
            }
        }
    }
}

/// Values of members, of which the first is `first`.
#[allow(clippy::cast_possible_truncation, reason = "members of a chunk")]
fn pick(values: &[f64], members: &[u64], first: u64, out: &mut [f64]) {
    for (out, member) in out.iter_mut().zip(members) {
        *out = values[(member - first) as usize];
    }
}

/// A word as a whole number below n.
#[allow(clippy::cast_possible_truncation, reason = "below n")]
fn scale(word: u64, n: u64) -> u64 {
    ((u128::from(word) * u128::from(n)) >> 64) as u64
}

#[cfg(test)]
mod tests {
    use etendue_geometry::ray_batch::BLOCK;

    use super::*;

    /// A set whose rays tell their number by their flux.
    struct Numbered(u64);

    impl RaySource for Numbered {
        fn len(&self) -> u64 {
            self.0
        }

        fn fill(&self, range: Range<u64>, batch: &mut RayBatch) {
            assert!(range.end <= self.0);
            for (slot, record) in range.enumerate() {
                batch.flux[slot] = record as f64;
            }
        }
    }

    /// The records that are met by the first `count` rays.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small numbers")]
    fn records(order: &RecordOrder, count: u64) -> Vec<u64> {
        let mut batch = RayBatch::default();
        let mut met = Vec::new();
        for start in (0..count).step_by(BLOCK) {
            let end = (start + BLOCK as u64).min(count);
            order.resample(&Numbered(order.n), start..end, count, &mut batch);
            met.extend(batch.flux[..batch.len].iter().map(|record| *record as u64));
        }
        met
    }

    #[test]
    #[allow(clippy::cast_possible_truncation, reason = "small numbers")]
    fn every_record_is_gone_through_once_and_every_beginning_is_spread_out() {
        for n in [1, 2, 255, 256, 257, 1000, 100_000, 256 * 377, 256 * 256 * 2 + 300] {
            let mut seen = records(&RecordOrder::new(n, 3, 7), n);
            // A sorted file: the mean number of any beginning is near the middle, as no draw of whole chunks would have it.
            for part in [3, 10, 40] {
                let chunks = (n / part / CHUNK) as f64;
                let mean = seen[..(n / part) as usize].iter().map(|r| *r as f64).sum::<f64>() / (n / part) as f64;
                if chunks > 2.0 {
                    assert!((mean / n as f64 - 0.5).abs() < 0.6 / chunks, "{n}, {chunks}: {mean}");
                }
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
                        let taken = records(&RecordOrder::new(n, 1, seed), count);
                        let hits = taken.iter().filter(|r| *r % period < period / 2).count();
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

    /// Of a sorted file few records are taken from all parts alike, also where the places taken are multiples of a power of
    /// two: their mean number has at most the error of as many records drawn. χ² as below, for 10 comparisons.
    #[test]
    fn few_records_are_taken_from_all_parts() {
        for n in [1 << 24, (1 << 24) + 12_345] {
            for stride in [300, 512, 4096, 1 << 16, 3 << 17] {
                let count = n / stride;
                let chi2: f64 = (0..16)
                    .map(|seed| {
                        let taken = records(&RecordOrder::new(n, 2, seed), count);
                        let mean = taken.iter().map(|r| *r as f64).sum::<f64>() / (n * count) as f64;
                        (mean - 0.5).powi(2) * 12.0 * count as f64
                    })
                    .sum();
                assert!(chi2 < 52.0, "one of {stride} of {n}: χ² {chi2}");
            }
        }
    }

    /// A run that ends early has whole chunks, of which no period of the file shows either: the share of each kind has at
    /// most the error of a draw of chunks. Beyond χ² of 52 with 16 degrees of freedom lies 1 in 10⁵, for 12 comparisons.
    #[test]
    fn no_period_of_the_file_shows_at_the_beginning() {
        let n = CHUNK * 1024 + 77;
        for period in [2, 4, 10, 64] {
            for part in [3, 10, 40] {
                let (met, chunks) = (n / part, (n / part).div_ceil(CHUNK));
                let chi2: f64 = (0..16)
                    .map(|seed| {
                        let order = RecordOrder::new(n, 2, seed);
                        let first = &records(&order, n)[..usize::try_from(met).expect("small")];
                        let hits = first.iter().filter(|r| *r / CHUNK % period < period / 2).count();
                        (hits as f64 / met as f64 - 0.5).powi(2) * 4.0 * chunks as f64
                    })
                    .sum();
                assert!(chi2 < 52.0, "period of {period} chunks, 1/{part}: χ² {chi2}");
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
            let taken = records(&RecordOrder::new(n, 0, seed), count);
            for record in taken {
                met[record as usize] += 1;
            }
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
