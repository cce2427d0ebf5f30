//! Philox: a random number is a function of its address (seed, purpose, index). Philox4x64-10 gives four at a time;
//! Philox4x32-10 gives two, in a tenth of the time where many are wanted at once.
//!
//! Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011), `[Salmon2011]`.

use multiversion::multiversion;

const M0: u64 = 0xD2E7_470E_E14C_6C93;
const M1: u64 = 0xCA5A_8263_9512_1157;
const W0: u64 = 0x9E37_79B9_7F4A_7C15;
const W1: u64 = 0xBB67_AE85_84CA_A73B;

#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "the two halves of a 128-bit product")]
fn wide_mul(a: u64, b: u64) -> (u64, u64) {
    let p = u128::from(a) * u128::from(b);
    ((p >> 64) as u64, p as u64)
}

/// Four 64-bit words from a 256-bit counter and a 128-bit key.
#[inline(always)]
#[must_use]
pub fn philox4x64(counter: [u64; 4], key: [u64; 2]) -> [u64; 4] {
    let [mut c0, mut c1, mut c2, mut c3] = counter;
    let [mut k0, mut k1] = key;
    for round in 0..10 {
        if round > 0 {
            k0 = k0.wrapping_add(W0);
            k1 = k1.wrapping_add(W1);
        }
        let (h0, l0) = wide_mul(M0, c0);
        let (h1, l1) = wide_mul(M1, c2);
        (c0, c1, c2, c3) = (h1 ^ c1 ^ k0, l1, h0 ^ c3 ^ k1, l0);
    }
    [c0, c1, c2, c3]
}

/// A word as a uniform number on the grid of midpoints (k + ½)/2⁵², so that 0 and 1 never occur.
#[inline(always)]
#[must_use]
pub fn unit_open(word: u64) -> f64 {
    // The 52 high bits under the exponent of 1.0 give 1 + k/2^52 without an integer-to-float conversion.
    f64::from_bits((word >> 12) | 0x3FF0_0000_0000_0000) - (1.0 - f64::EPSILON / 2.0)
}

/// The address of a family of random numbers: a seed and the purpose it is used for.
///
/// The purpose keeps numbers of different use apart (the directions of rays, the choice of a subset) under one seed.
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    key: [u64; 2],
}

impl Stream {
    /// The stream of `purpose` under `seed`.
    #[must_use]
    pub const fn new(seed: u64, purpose: u64) -> Self {
        Self { key: [seed, purpose] }
    }

    /// Four independent uniform numbers in (0, 1) at `index`, block `block`.
    #[inline(always)]
    #[must_use]
    pub fn uniforms(self, index: u64, block: u64) -> [f64; 4] {
        philox4x64([index, block, 0, 0], self.key).map(unit_open)
    }

    /// Four independent 64-bit words at `index`, block `block`.
    #[inline]
    #[must_use]
    pub fn block(self, index: u64, block: u64) -> [u64; 4] {
        philox4x64([index, block, 0, 0], self.key)
    }

    /// Four independent 64-bit words at `index`.
    #[inline]
    #[must_use]
    pub fn words(self, index: u64) -> [u64; 4] {
        self.block(index, 0)
    }

    /// A 64-bit word at `index`.
    #[inline]
    #[must_use]
    pub fn word(self, index: u64) -> u64 {
        self.words(index)[0]
    }
}

/// Four 32-bit words from a 128-bit counter and a 64-bit key, each in a word of 64 bits.
#[inline(always)]
fn philox4x32(counter: [u64; 4], key: [u32; 2]) -> [u64; 4] {
    const LOW: u64 = 0xFFFF_FFFF;
    let [mut c0, mut c1, mut c2, mut c3] = counter;
    let [mut k0, mut k1] = key;
    for round in 0..10 {
        if round > 0 {
            k0 = k0.wrapping_add(0x9E37_79B9);
            k1 = k1.wrapping_add(0xBB67_AE85);
        }
        let (a, b) = (0xD251_1F53 * c0, 0xCD9E_8D57 * c2);
        (c0, c1, c2, c3) = (
            b >> 32 ^ c1 ^ u64::from(k0),
            b & LOW,
            a >> 32 ^ c3 ^ u64::from(k1),
            a & LOW,
        );
    }
    [c0, c1, c2, c3]
}

/// The address of a family of pairs of random numbers: a seed and the purpose that they are used for.
#[derive(Clone, Copy, Debug)]
pub struct Pairs {
    key: [u32; 2],
    purpose: u32,
}

impl Pairs {
    /// The pairs of `purpose` under `seed`.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "the two halves of a word")]
    pub const fn new(seed: u64, purpose: u32) -> Self {
        Self {
            key: [seed as u32, (seed >> 32) as u32],
            purpose,
        }
    }

    /// Two independent uniform numbers in (0, 1) at `index`, block `block`.
    #[inline(always)]
    #[must_use]
    pub fn at(self, index: u64, block: u32) -> [f64; 2] {
        let counter = [
            index & 0xFFFF_FFFF,
            index >> 32,
            u64::from(block),
            u64::from(self.purpose),
        ];
        let [a, b, c, d] = philox4x32(counter, self.key);
        [a << 32 | b, c << 32 | d].map(unit_open)
    }
}

/// Two uniform numbers for each of many indices, as [`Pairs::at`] has them, several at a time.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn fill_pairs(pairs: Pairs, index: &[u64], block: u32, out: &mut [Vec<f64>; 2]) {
    let n = index.len();
    let [a, b] = out;
    a.resize(n, 0.0);
    b.resize(n, 0.0);
    let (a, b) = (&mut a[..n], &mut b[..n]);
    for i in 0..n {
        [a[i], b[i]] = pairs.at(index[i], block);
    }
}

/// Four uniform numbers for each of many indices: the pairs of blocks 0 and 1.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn fill_fours(pairs: Pairs, index: &[u64], out: &mut [Vec<f64>; 4]) {
    let n = index.len();
    let [a, b, c, d] = out;
    for list in [&mut *a, &mut *b, &mut *c, &mut *d] {
        list.resize(n, 0.0);
    }
    let (a, b, c, d) = (&mut a[..n], &mut b[..n], &mut c[..n], &mut d[..n]);
    for i in 0..n {
        [a[i], b[i]] = pairs.at(index[i], 0);
        [c[i], d[i]] = pairs.at(index[i], 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_answers_of_the_random123_distribution() {
        // kat_vectors of Random123, "philox4x64 10".
        assert_eq!(
            philox4x64([0; 4], [0; 2]),
            [
                0x1655_4d9e_ca36_314c,
                0xdb20_fe9d_672d_0fdc,
                0xd7e7_72ce_e186_176b,
                0x7e68_b68a_ec7b_a23b
            ]
        );
        assert_eq!(
            philox4x64([u64::MAX; 4], [u64::MAX; 2]),
            [
                0x87b0_92c3_013f_e90b,
                0x438c_3c67_be8d_0224,
                0x9cc7_d7c6_9cd7_77b6,
                0xa09c_aebf_594f_0ba0
            ]
        );
    }

    #[test]
    fn known_answers_for_words_of_32_bits() {
        // kat_vectors of Random123, "philox4x32 10".
        assert_eq!(
            philox4x32([0; 4], [0; 2]),
            [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]
        );
        assert_eq!(
            philox4x32([0xFFFF_FFFF; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox4x32(
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0]
            ),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn many_pairs_are_those_of_each_and_the_whole_address_matters() {
        let index: Vec<u64> = (0..77).map(|i| i * (i << 40) + 3 * i).collect();
        let mut out = Default::default();
        let pairs = Pairs::new(9 << 40 | 7, 4);
        fill_pairs(pairs, &index, 5, &mut out);
        for i in 0..77 {
            assert_eq!(pairs.at(index[i], 5), [out[0][i], out[1][i]]);
        }
        let mut fours = Default::default();
        fill_fours(pairs, &index, &mut fours);
        for i in 0..77 {
            let four = fours.each_ref().map(|list| list[i]);
            assert_eq!([pairs.at(index[i], 0), pairs.at(index[i], 1)].concat(), four);
        }
        let others = [
            Pairs::new(7, 4).at(3, 5),
            Pairs::new(9 << 40 | 7, 3).at(3, 5),
            pairs.at(1 << 32 | 3, 5),
            pairs.at(3, 6),
        ];
        assert!(others.iter().all(|other| *other != pairs.at(3, 5)));
    }

    #[test]
    fn unit_numbers_stay_inside_the_open_interval_and_are_centred() {
        assert_eq!(unit_open(0), f64::EPSILON / 2.0);
        assert!(unit_open(u64::MAX) < 1.0);
        assert!((unit_open(1 << 63) - 0.5).abs() < 1e-15);
    }
}
