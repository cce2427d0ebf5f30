//! Keys of rays, by which copies of a ray are found.

use std::ops::Range;

use etendue_sampling::ordered::inside;
use rayon::prelude::*;

use crate::source::RaySource;

/// A key of a ray's place and direction, to single precision: that of copies is the same, that of others is not. Of 10⁸ rays with
/// different places, two have the same key by chance once in 4000 sets.
#[inline]
#[must_use]
#[allow(
    clippy::cast_possible_truncation,
    reason = "a direction that is normalised again may change in its last bit"
)]
pub fn ray_key(position: [f64; 3], direction: [f64; 3]) -> u64 {
    const ODD: u64 = 0x9E37_79B9_7F4A_7C15;
    // Adding 0 makes 0 of −0.
    let [a, b, c] = position.map(|x| u64::from((x as f32 + 0.0).to_bits()));
    let [d, e, f] = direction.map(|x| u64::from((x as f32 + 0.0).to_bits()));
    let mut key = 0_u64;
    for pair in [a | (b << 32), c | (d << 32), e | (f << 32)] {
        key = (key ^ pair).wrapping_mul(ODD);
        key ^= key >> 29;
    }
    key
}

/// Keys that are multiples of `every`, with their flux, of the rays of some ranges that have flux: in their order, for any number
/// of threads (0: one per core).
#[must_use]
pub fn kept_keys(source: &impl RaySource, ranges: &[Range<u64>], every: u64, threads: usize) -> (Vec<u64>, Vec<f64>) {
    let kept = |range: &Range<u64>| {
        let mut found = (Vec::new(), Vec::new());
        source.for_each_block(range.clone(), |_, batch| {
            for i in 0..batch.len {
                let [position, direction] =
                    [&batch.position, &batch.direction].map(|lists| lists.each_ref().map(|x| x[i]));
                let key = ray_key(position, direction);
                if key.is_multiple_of(every) && batch.flux[i] > 0.0 {
                    found.0.push(key);
                    found.1.push(batch.flux[i]);
                }
            }
        });
        found
    };
    let parts: Vec<(Vec<u64>, Vec<f64>)> = inside(threads, || ranges.par_iter().map(kept).collect());
    let (keys, flux): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
    (keys.concat(), flux.concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray_batch::RayBatch;

    /// Rays on a line, one each millimetre, of which every 64th is without flux, twice.
    struct Twice(u64);

    impl RaySource for Twice {
        fn len(&self) -> u64 {
            2 * self.0
        }

        fn fill(&self, range: Range<u64>, batch: &mut RayBatch) {
            let number = |i: u64| (i % self.0) as f64;
            batch.len = range.clone().count();
            batch.position = [
                range.clone().map(number).collect(),
                vec![0.0; batch.len],
                vec![-0.0; batch.len],
            ];
            batch.direction = [0.0, 0.0, 1.0].map(|x| vec![x; batch.len]);
            batch.flux = range
                .map(|i| {
                    if (i % self.0).is_multiple_of(64) {
                        0.0
                    } else {
                        number(i)
                    }
                })
                .collect();
        }
    }

    #[test]
    fn copies_have_one_key_and_others_others() {
        let key = ray_key([1.0, 2.0, 3.0], [0.6, 0.0, 0.8]);
        assert_eq!(key, ray_key([1.0, 2.0, 3.0], [0.6 + 1e-16, -0.0, 0.8]));
        for k in 0..3 {
            let moved = |mut v: [f64; 3]| {
                v[k] += 1e-6;
                v
            };
            assert_ne!(key, ray_key(moved([1.0, 2.0, 3.0]), [0.6, 0.0, 0.8]));
            assert_ne!(key, ray_key([1.0, 2.0, 3.0], moved([0.6, 0.0, 0.8])));
        }
        assert_ne!(ray_key([1.0, 2.0, 3.0], [0.0; 3]), ray_key([2.0, 1.0, 3.0], [0.0; 3]));
    }

    #[test]
    fn what_is_kept_is_kept_with_its_copy_for_any_number_of_threads() {
        let source = Twice(10_000);
        let ranges: Vec<_> = (0..20).map(|k| k * 1000..(k + 1) * 1000).collect();
        let (keys, flux) = kept_keys(&source, &ranges, 7, 1);
        let half = keys.len() / 2;
        assert!((1300..1500).contains(&half), "{half}");
        assert_eq!(keys[..half], keys[half..]);
        assert_eq!(flux[..half], flux[half..]);
        assert!(keys.iter().all(|key| key.is_multiple_of(7)) && flux.iter().all(|flux| *flux > 0.0));
        assert_eq!((keys, flux), kept_keys(&source, &ranges, 7, 3));
    }
}
