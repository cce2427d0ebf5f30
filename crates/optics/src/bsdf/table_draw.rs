//! Many rays at once off a table of one lobe: what [`Tabulated`](super::Tabulated) draws for each by itself, to the same bits.
//!
//! Step by step for all of them together. Sums, roots and angles are worked out several at a time; what is looked up in between
//! is all over a memory that no cache holds, and without branches the processor waits for many of them at once.

use etendue_math::trig::sin_cos_turns;
use etendue_sampling::alias::{Slot, UNIT};
use etendue_sampling::warp::part_of;
use multiversion::multiversion;

use super::table_grid::bent;
use super::table_lobes::Lobe;

/// How many rays are drawn for together.
pub(super) const TOGETHER: usize = 32;

type Lanes = [f64; TOGETHER];
type Numbers = [u32; TOGETHER];
const ZERO: Lanes = [0.0; TOGETHER];

/// What scatters each of some rays that meet the same side of a surface, and where to.
pub(super) struct Group {
    /// Direction cosines of where the light comes from, and two random numbers.
    pub incident: [Lanes; 2],
    pub numbers: [Lanes; 2],
    /// See `Incidence`.
    sine: Lanes,
    forward: [Lanes; 2],
    /// See `Step`.
    beyond: Lanes,
    first: Numbers,
    shares: [Lanes; 3],
    slopes: [Lanes; 3],
    /// Above 0 for rays that are absorbed, and for those that a floor scatters.
    pub absorbed: Lanes,
    floor: Lanes,
    /// The number of the slice, and what is left of the first number.
    slice: Numbers,
    rest: Lanes,
    /// Of the slice how many radial coordinates, azimuths and values there are.
    radii: Lanes,
    azimuths: Lanes,
    values: Lanes,
    /// Of its alias table: a place, what it holds, and the node that is found.
    slot: Numbers,
    chance: Numbers,
    alias: Numbers,
    /// Azimuth and radial coordinate of the node.
    azimuth: Lanes,
    radius: Numbers,
    /// See `Hat`; of both sides. The first is the share of the side once that is known.
    inner: Lanes,
    top: Lanes,
    fars: [Lanes; 2],
    linears: [Lanes; 2],
    /// Of the side that is drawn from; above 0 if it is the inner one.
    far: Lanes,
    linear: Lanes,
    inwards: Lanes,
    /// What is left of the first number, on that side less than its share.
    part: Lanes,
    /// From the far end of the side to its top.
    along: Lanes,
    /// Where the light goes.
    pub direction: [Lanes; 3],
}

impl Group {
    pub const fn new() -> Self {
        Self {
            incident: [ZERO; 2],
            numbers: [ZERO; 2],
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
            radii: ZERO,
            azimuths: ZERO,
            values: ZERO,
            slot: [0; TOGETHER],
            chance: [0; TOGETHER],
            alias: [0; TOGETHER],
            azimuth: ZERO,
            radius: [0; TOGETHER],
            inner: ZERO,
            top: ZERO,
            fars: [ZERO; 2],
            linears: [ZERO; 2],
            far: ZERO,
            linear: ZERO,
            inwards: ZERO,
            part: ZERO,
            along: ZERO,
            direction: [ZERO; 3],
        }
    }

    /// Draws for the first `n` rays.
    pub fn draw(&mut self, lobe: &Lobe, n: usize, up: bool) {
        incidences(self);
        for k in 0..n {
            let step = lobe.step(self.sine[k]);
            (self.beyond[k], self.first[k]) = (self.sine[k] - step.from, step.first);
            for j in 0..3 {
                (self.shares[j][k], self.slopes[j][k]) = (step.shares[j], step.slopes[j]);
            }
        }
        picks(self);
        // Those that a slice scatters; without branches, which nobody can foresee.
        let (mut those, mut count) = ([0; TOGETHER], 0);
        for k in 0..n {
            those[count] = k;
            count += usize::from((self.floor[k] == 0.0) & (self.absorbed[k] == 0.0));
        }
        let those = &those[..count];
        let mut tables: [&[Slot]; TOGETHER] = [&[]; TOGETHER];
        for &k in those {
            let grid = lobe.slice(self.slice[k] as usize);
            [self.radii[k], self.azimuths[k], self.values[k]] = grid.size();
            tables[k] = grid.slots();
        }
        slots(self);
        for &k in those {
            let slot = tables[k][self.slot[k] as usize];
            (self.chance[k], self.alias[k]) = (slot.own, slot.alias);
        }
        nodes(self);
        for &k in those {
            let hat = lobe.slice(self.slice[k] as usize).hat(self.radius[k] as usize);
            (self.inner[k], self.top[k]) = (hat.inner, hat.node);
            for side in 0..2 {
                (self.fars[side][k], self.linears[side][k]) = (hat.slopes[side].far, hat.slopes[side].linear);
            }
        }
        radii(self);
        // Those that are bent first.
        let (mut list, mut count) = ([0; TOGETHER], 0);
        for &k in those {
            list[count] = k;
            count += usize::from(self.part[k] >= self.inner[k] * self.linear[k]);
        }
        for k in list.into_iter().take(count) {
            let slope = [self.part[k] / self.inner[k], self.linear[k]];
            self.along[k] = bent(slope, self.numbers[1][k], self.inwards[k] > 0.0);
        }
        directions(self, if up { 1.0 } else { -1.0 });
    }

    /// Those of the first `n` rays whose places lie outside the unit circle, each with the number of its slice and its numbers
    /// that have not been used.
    pub fn missed(&self, n: usize) -> impl Iterator<Item = (usize, usize, [f64; 2])> {
        let (mut list, mut count) = ([0; TOGETHER], 0);
        for k in 0..n {
            list[count] = k;
            count += usize::from((self.direction[2][k] == 0.0) & (self.floor[k] == 0.0) & (self.absorbed[k] == 0.0));
        }
        let numbers = |k: usize| [self.rest[k], self.numbers[1][k]];
        list.into_iter()
            .take(count)
            .map(move |k| (k, self.slice[k] as usize, numbers(k)))
    }
}

/// Sines and azimuths of incidence.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn incidences(group: &mut Group) {
    let Group {
        incident: [x, y],
        sine,
        forward: [c, s],
        ..
    } = group;
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
fn picks(group: &mut Group) {
    let Group {
        numbers: [number, _],
        beyond,
        first,
        shares: [a, b, even],
        slopes: [da, db, deven],
        absorbed,
        floor,
        slice,
        rest,
        ..
    } = group;
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

/// Places in the tables of nodes.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a slice has fewer than 2^31 values"
)]
fn slots(group: &mut Group) {
    let Group { rest, values, slot, .. } = group;
    for k in 0..TOGETHER {
        let place = rest[k] * values[k];
        let last = values[k] - 1.0;
        slot[k] = (if place < last { place } else { last }) as i32 as u32;
    }
}

/// Nodes of the slices.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "fewer than 2^16 radial coordinates"
)]
fn nodes(group: &mut Group) {
    let Group {
        rest,
        radii,
        values,
        slot,
        chance,
        alias,
        azimuth,
        radius,
        part,
        ..
    } = group;
    for k in 0..TOGETHER {
        let within = rest[k] * values[k] - f64::from(slot[k]);
        let chance = f64::from(chance[k]) * UNIT;
        let own = within < chance;
        let (left, share) = if own {
            (within, chance)
        } else {
            (within - chance, 1.0 - chance)
        };
        part[k] = part_of(left, share);
        let node = f64::from(if own { slot[k] } else { alias[k] });
        // A division of whole numbers: the nearest one to what lies half a step from its next.
        azimuth[k] = whole((node + 0.5) / radii[k] - 0.5);
        radius[k] = (node - azimuth[k] * radii[k]) as i32 as u32;
    }
}

/// The nearest whole number, of a small one.
#[inline(always)]
fn whole(x: f64) -> f64 {
    // As an addition rounds; `round` is a call where the instruction set has no such thing.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    (x + WHOLE) - WHOLE
}

/// Radial coordinates, but for those that have to be drawn in another way.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn radii(group: &mut Group) {
    let Group {
        inner,
        fars,
        linears,
        far,
        linear,
        inwards: sides,
        part,
        along,
        ..
    } = group;
    for k in 0..TOGETHER {
        let inwards = part[k] < inner[k];
        far[k] = if inwards { fars[0][k] } else { fars[1][k] };
        linear[k] = if inwards { linears[0][k] } else { linears[1][k] };
        sides[k] = if inwards { 1.0 } else { 0.0 };
        let (left, share) = if inwards {
            (part[k], inner[k])
        } else {
            (part[k] - inner[k], 1.0 - inner[k])
        };
        part[k] = left;
        inner[k] = share;
        along[k] = part_of(left, share * linear[k]).sqrt();
    }
}

/// Directions at the places that were drawn; the height of those outside the unit circle is 0.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn directions(group: &mut Group, sign: f64) {
    let Group {
        incident: [x, y],
        numbers: [_, number],
        forward: [c, s],
        floor,
        rest,
        azimuth,
        azimuths,
        far,
        top,
        along,
        direction: [to_x, to_y, to_z],
        ..
    } = group;
    for k in 0..TOGETHER {
        let is_even = floor[k] > 0.0;
        // Of a node: azimuths with a density that falls linearly towards the next ones. Of a floor, as `by_cosine` says. One root
        // for both, here and below.
        let low = number[k] < 0.5;
        let square = if low { 2.0 * number[k] } else { 2.0 - 2.0 * number[k] };
        let root = (if is_even { 1.0 - rest[k] } else { square }).sqrt();
        let aside = if low { root - 1.0 } else { 1.0 - root };
        let turn = (azimuth[k] + aside) / azimuths[k];
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let r = far[k] + along[k] * (top[k] - far[k]);
        let (sin, cos) = sin_cos_turns(if is_even { number[k] } else { turn });
        let (ahead, across) = (r * cos, r * sin);
        let px = c[k] * ahead - s[k] * across - x[k];
        let py = s[k] * ahead + c[k] * across - y[k];
        let square = 1.0 - px * px - py * py;
        let square = if square > 0.0 { square } else { 0.0 };
        let height = (if is_even { (1.0 - root) * (1.0 + root) } else { square }).sqrt();
        to_x[k] = if is_even { height * cos } else { px };
        to_y[k] = if is_even { height * sin } else { py };
        to_z[k] = sign * if is_even { root } else { height };
    }
}
