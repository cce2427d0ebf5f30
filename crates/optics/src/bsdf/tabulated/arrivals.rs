//! Rays that meet a table of one lobe, many at once: which slices scatter them, or the base.

use etendue_sampling::warp::part_of;
use multiversion::multiversion;

use super::base::{Base, Within};
use super::lanes::{LANES, Lanes as AnyLanes, blocks};
use super::lobes::{ALL, Lobe};

/// How many rays are taken in together, in so many blocks.
pub(super) const TOGETHER: usize = BLOCKS * LANES;
const BLOCKS: usize = 4;

pub(super) type Lanes<T> = AnyLanes<T, BLOCKS>;

/// Some rays, until it is known what scatters each.
pub(super) struct Arrivals {
    /// Direction cosines of where the light comes from, and two random numbers.
    pub incident: [Lanes<f64>; 2],
    number: Lanes<f64>,
    pub other: Lanes<f64>,
    /// See `Incidence`.
    sine: Lanes<f64>,
    pub forward: [Lanes<f64>; 2],
    /// See `Step`.
    place: Lanes<u32>,
    first: Lanes<u32>,
    shares: [Lanes<f64>; 3],
    /// One of the kinds below.
    pub kind: Lanes<u32>,
    /// The number of the slice, and what is left of the random number; of the base the square of the sine that it draws.
    pub slice: Lanes<u32>,
    pub rest: Lanes<f64>,
    /// See `Within`, of those off the base.
    within: [Lanes<f64>; 5],
}

/// A ray that is absorbed, and one that a slice or the base scatters.
pub(super) const ABSORBED: u32 = 0;
pub(super) const OFF_SLICE: u32 = 1;
pub(super) const OFF_BASE: u32 = 2;

impl Arrivals {
    pub const fn new() -> Self {
        const ZERO: Lanes<f64> = Lanes::of(0.0);
        Self {
            incident: [ZERO; 2],
            number: ZERO,
            other: ZERO,
            sine: ZERO,
            forward: [ZERO; 2],
            place: Lanes::of(0),
            first: Lanes::of(0),
            shares: [ZERO; 3],
            kind: Lanes::of(ABSORBED),
            slice: Lanes::of(0),
            rest: ZERO,
            within: [ZERO; 5],
        }
    }

    /// Takes some rays in, as many as can be, and chooses for them.
    pub fn choose(&mut self, (lobe, base): (&Lobe, &Base), incident: [&[f64]; 2], [numbers, others]: [&[f64]; 2]) {
        let n = numbers.len();
        for (own, given) in self.incident.iter_mut().zip(incident) {
            own.take(given);
        }
        self.number.take(numbers);
        self.other.take(others);
        incidences(self, n);
        // Places first: the processor looks ahead over as many as it can.
        for k in 0..n {
            self.place[k] = lobe.place(self.sine[k]);
        }
        for k in 0..n {
            let step = lobe.step(self.place[k]);
            self.first[k] = step.first;
            for (lanes, share) in self.shares.iter_mut().zip(step.at(self.sine[k])) {
                lanes[k] = share;
            }
        }
        picks(self, n);
        if !base.is_even() {
            // Without branches, which nobody can foresee.
            let (mut list, mut count) = ([0; TOGETHER], 0);
            for k in 0..n {
                list[count] = k;
                count += usize::from(self.kind[k] == OFF_BASE);
            }
            for k in list.into_iter().take(count) {
                let Within {
                    from,
                    width,
                    near,
                    far,
                    part,
                } = base.within(self.rest[k]);
                for (lanes, value) in self.within.iter_mut().zip([from, width, near, far, part]) {
                    lanes[k] = value;
                }
            }
            squares(self, n);
        }
    }
}

/// Sines and azimuths of incidence.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn incidences(arrivals: &mut Arrivals, count: usize) {
    for b in blocks::<BLOCKS>(count) {
        let [x, y] = arrivals.incident.each_ref().map(|lanes| &lanes.0[b]);
        let [c, s] = arrivals.forward.each_mut().map(|lanes| &mut lanes.0[b]);
        let sine = &mut arrivals.sine.0[b];
        for k in 0..LANES {
            let length = (x[k] * x[k] + y[k] * y[k]).sqrt();
            let scale = -1.0 / length;
            let tilted = length > 0.0;
            c[k] = if tilted { x[k] * scale } else { -1.0 };
            s[k] = if tilted { y[k] * scale } else { 0.0 };
            sine[k] = if length < 1.0 { length } else { 1.0 };
        }
    }
}

/// Slices or the base by their shares.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn picks(arrivals: &mut Arrivals, count: usize) {
    for b in blocks::<BLOCKS>(count) {
        let (number, first) = (&arrivals.number.0[b], &arrivals.first.0[b]);
        let shares = arrivals.shares.each_ref().map(|lanes| &lanes.0[b]);
        let (mut kind, mut slice, mut rest) = ([ABSORBED; LANES], [0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            let [a, b, base] = shares.map(|shares| shares[k]);
            let all = a + b + base;
            let goes = (number[k] < all) | (all >= ALL);
            let left = [number[k], number[k] - a, number[k] - a - b];
            let is_first = left[0] < a;
            let is_base = !is_first & (left[1] >= b) & (base > 0.0);
            let is_second = !is_first & !is_base & (b > 0.0);
            let (part, share) = if is_base {
                (left[2], base)
            } else if is_second {
                (left[1], b)
            } else {
                (left[0], a)
            };
            let scattered = if is_base { OFF_BASE } else { OFF_SLICE };
            kind[k] = if goes { scattered } else { ABSORBED };
            slice[k] = first[k] + u32::from(is_second);
            rest[k] = part_of(part, share);
        }
        (arrivals.kind.0[b], arrivals.slice.0[b], arrivals.rest.0[b]) = (kind, slice, rest);
    }
}

/// What those off the base draw.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn squares(arrivals: &mut Arrivals, count: usize) {
    for b in blocks::<BLOCKS>(count) {
        let [from, width, near, far, part] = arrivals.within.each_ref().map(|lanes| &lanes.0[b]);
        let (kind, rest) = (&arrivals.kind.0[b], &mut arrivals.rest.0[b]);
        for k in 0..LANES {
            let within = Within {
                from: from[k],
                width: width[k],
                near: near[k],
                far: far[k],
                part: part[k],
            };
            let square = within.square();
            rest[k] = if kind[k] == OFF_BASE { square } else { rest[k] };
        }
    }
}
