//! k of n without replacement, in file order, in one pass and constant memory.

use crate::philox::{Stream, unit_open};

/// The purpose under which subset choices are drawn (see [`Stream::new`]).
pub const PURPOSE_SUBSET: u64 = 0x5355_4253;

/// The purpose under which rays are dealt to independent parts.
pub const PURPOSE_THINNING: u64 = 0x5448_494e;

/// Selection sampling (Fan, Muller, Rezucha 1962; Knuth, TAOCP 2, 3.4.2, algorithm S) over one stretch of the records.
///
/// Record `i` is taken with probability (k − taken)/(n − i), which makes every k-subset equally likely. Returns the
/// indices taken within `start..stop`; the caller carries `taken` from stretch to stretch.
#[must_use]
pub fn select(start: u64, stop: u64, n: u64, k: u64, mut taken: u64, seed: u64) -> Vec<u64> {
    let stream = Stream::new(seed, PURPOSE_SUBSET);
    let mut chosen = Vec::new();
    for i in start..stop.min(n) {
        if taken == k {
            break;
        }
        if unit_open(stream.word(i)) * ((n - i) as f64) < (k - taken) as f64 {
            chosen.push(i);
            taken += 1;
        }
    }
    chosen
}

/// The part, 0 to `parts`−1, that each ray of `start..stop` belongs to: independent and uniform, so that the parts of a
/// Poisson ray set are independent Poisson ray sets (thinning).
#[must_use]
#[allow(
    clippy::cast_possible_truncation,
    reason = "the high word of word·parts is below parts"
)]
pub fn deal(start: u64, stop: u64, parts: u32, seed: u64) -> Vec<u32> {
    let stream = Stream::new(seed, PURPOSE_THINNING);
    (start..stop)
        .map(|i| ((u128::from(stream.word(i)) * u128::from(parts)) >> 64) as u32)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_exactly_k_and_does_not_depend_on_the_stretches() {
        let whole = select(0, 1000, 1000, 137, 0, 5);
        assert_eq!(whole.len(), 137);
        let mut pieces = select(0, 411, 1000, 137, 0, 5);
        pieces.extend(select(411, 1000, 1000, 137, pieces.len() as u64, 5));
        assert_eq!(whole, pieces);
        assert_eq!(select(0, 50, 50, 50, 0, 1).len(), 50);
        assert!(select(0, 50, 50, 0, 0, 1).is_empty());
    }

    #[test]
    fn every_pair_is_equally_likely() {
        // 2 of 5: ten pairs, 20 000 seeds; χ² with 9 degrees of freedom, 99.9 % point 27.88.
        let mut counts = [0_u32; 25];
        for seed in 0..20_000 {
            let pair = select(0, 5, 5, 2, 0, seed);
            counts[usize::try_from(pair[0] * 5 + pair[1]).expect("small")] += 1;
        }
        let chi2: f64 = counts
            .iter()
            .filter(|&&c| c > 0)
            .map(|&c| (f64::from(c) - 2000.0).powi(2) / 2000.0)
            .sum();
        assert_eq!(counts.iter().filter(|&&c| c > 0).count(), 10);
        assert!(chi2 < 27.88, "chi2 = {chi2}");
    }

    #[test]
    fn parts_are_uniform() {
        let mut counts = [0_u32; 7];
        for part in deal(0, 70_000, 7, 3) {
            counts[part as usize] += 1;
        }
        let chi2: f64 = counts
            .iter()
            .map(|&c| (f64::from(c) - 10_000.0).powi(2) / 10_000.0)
            .sum();
        assert!(chi2 < 22.46, "chi2 = {chi2}"); // 6 degrees of freedom, 99.9 %
    }
}
