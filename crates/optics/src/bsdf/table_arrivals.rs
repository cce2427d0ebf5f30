//! Rays that meet a table of one lobe, many at once: which slices and floors scatter them.

use std::ops::Range;

use etendue_sampling::warp::part_of;
use multiversion::multiversion;

use super::table_lobes::Lobe;

/// How many rays are drawn for together.
pub(super) const TOGETHER: usize = 64;

pub(super) type Lanes = [f64; TOGETHER];
pub(super) type Numbers = [u32; TOGETHER];
pub(super) const ZERO: Lanes = [0.0; TOGETHER];

/// Some rays, until it is known what scatters each.
pub(super) struct Arrivals {
    /// Direction cosines of where the light comes from, and a random number.
    pub incident: [Lanes; 2],
    number: Lanes,
    /// See `Incidence`.
    sine: Lanes,
    pub forward: [Lanes; 2],
    /// See `Step`.
    beyond: Lanes,
    first: Numbers,
    shares: [Lanes; 3],
    slopes: [Lanes; 3],
    /// Above 0 for rays that are absorbed, and for those that a floor scatters.
    pub absorbed: Lanes,
    pub floor: Lanes,
    /// The number of the slice, and what is left of the random number.
    pub slice: Numbers,
    pub rest: Lanes,
}

impl Arrivals {
    pub const fn new() -> Self {
        Self {
            incident: [ZERO; 2],
            number: ZERO,
            sine: ZERO,
            forward: [ZERO; 2],
            beyond: ZERO,
            first: [0; TOGETHER],
            shares: [ZERO; 3],
            slopes: [ZERO; 3],
            absorbed: ZERO,
            floor: ZERO,
            slice: [0; TOGETHER],
            rest: ZERO,
        }
    }

    /// Takes some rays in.
    pub fn take(&mut self, incident: [&[f64]; 2], numbers: &[f64], rays: Range<usize>) {
        for (own, given) in self.incident.iter_mut().zip(incident) {
            own[..rays.len()].copy_from_slice(&given[rays.clone()]);
        }
        self.number[..rays.len()].copy_from_slice(&numbers[rays]);
    }

    /// Chooses for the first `n` rays.
    pub fn choose(&mut self, lobe: &Lobe, n: usize) {
        incidences(self);
        for k in 0..n {
            let step = lobe.step(self.sine[k]);
            (self.beyond[k], self.first[k]) = (self.sine[k] - step.from, step.first);
            for j in 0..3 {
                (self.shares[j][k], self.slopes[j][k]) = (step.shares[j], step.slopes[j]);
            }
        }
        picks(self);
    }
}

/// Sines and azimuths of incidence.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn incidences(arrivals: &mut Arrivals) {
    let Arrivals {
        incident: [x, y],
        sine,
        forward: [c, s],
        ..
    } = arrivals;
    for k in 0..TOGETHER {
        let length = (x[k] * x[k] + y[k] * y[k]).sqrt();
        let scale = -1.0 / length;
        let tilted = length > 0.0;
        c[k] = if tilted { x[k] * scale } else { -1.0 };
        s[k] = if tilted { y[k] * scale } else { 0.0 };
        sine[k] = if length < 1.0 { length } else { 1.0 };
    }
}

/// Slices or floors by their shares.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn picks(arrivals: &mut Arrivals) {
    let Arrivals {
        number,
        beyond,
        first,
        shares: [a, b, even],
        slopes: [da, db, deven],
        absorbed,
        floor,
        slice,
        rest,
        ..
    } = arrivals;
    for k in 0..TOGETHER {
        let on = beyond[k];
        let [a, b, even] = [a[k] + on * da[k], b[k] + on * db[k], even[k] + on * deven[k]];
        let all = a + b + even;
        // Shares that should add up to 1 may fall short of it by rounding.
        absorbed[k] = if (number[k] < all) | (all >= 1.0 - 1e-12) {
            0.0
        } else {
            1.0
        };
        let left = [number[k], number[k] - a, number[k] - a - b];
        let is_first = left[0] < a;
        let is_even = !is_first & (left[1] >= b) & (even > 0.0);
        let is_second = !is_first & !is_even & (b > 0.0);
        let (part, share) = if is_even {
            (left[2], even)
        } else if is_second {
            (left[1], b)
        } else {
            (left[0], a)
        };
        floor[k] = if is_even { 1.0 } else { 0.0 };
        slice[k] = first[k] + u32::from(is_second);
        rest[k] = part_of(part, share);
    }
}
