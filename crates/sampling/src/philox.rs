//! Philox4x64-10: a random number is a function of its address (seed, stream, index).
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

    /// Four independent 64-bit words at `index`.
    #[inline]
    #[must_use]
    pub fn words(self, index: u64) -> [u64; 4] {
        philox4x64([index, 0, 0, 0], self.key)
    }

    /// A 64-bit word at `index`.
    #[inline]
    #[must_use]
    pub fn word(self, index: u64) -> u64 {
        self.words(index)[0]
    }
}

/// Four uniform numbers for each of many addresses, as [`Stream::uniforms`] has them, several at a time.
///
/// `index` and `block` hold the addresses, one after the other; the result is written number by number.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn fill_uniforms(stream: Stream, index: &[u64], block: &[u64], out: &mut [Vec<f64>; 4]) {
    let n = index.len();
    let block = &block[..n];
    let [a, b, c, d] = out;
    for list in [&mut *a, &mut *b, &mut *c, &mut *d] {
        list.resize(n, 0.0);
    }
    let (a, b, c, d) = (&mut a[..n], &mut b[..n], &mut c[..n], &mut d[..n]);
    for i in 0..n {
        [a[i], b[i], c[i], d[i]] = stream.uniforms(index[i], block[i]);
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
    fn many_addresses_have_the_numbers_of_each() {
        let index: Vec<u64> = (0..77).map(|i| i * i + 3).collect();
        let block: Vec<u64> = (0..77).map(|i| i % 5).collect();
        let mut out = Default::default();
        let stream = Stream::new(9, 4);
        fill_uniforms(stream, &index, &block, &mut out);
        for i in 0..77 {
            let expected = stream.uniforms(index[i], block[i]);
            assert_eq!(expected, std::array::from_fn(|k| out[k][i]));
        }
    }

    #[test]
    fn unit_numbers_stay_inside_the_open_interval_and_are_centred() {
        assert_eq!(unit_open(0), f64::EPSILON / 2.0);
        assert!(unit_open(u64::MAX) < 1.0);
        assert!((unit_open(1 << 63) - 0.5).abs() < 1e-15);
    }
}
