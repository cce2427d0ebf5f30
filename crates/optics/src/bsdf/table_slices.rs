//! Rays that slices of a table scatter, many at once, from the choice of the slice on.

use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::alias::{Slot, UNIT};
use etendue_sampling::more_numbers::MoreNumbers;
use etendue_sampling::warp::part_of;
use multiversion::multiversion;

use super::contract::by_cosine;
use super::table_arrivals::{Arrivals, Lanes, Numbers, TOGETHER, ZERO};
use super::table_grid::{Grid, bent};
use super::table_lobes::{Incidence, Lobe};

/// How often is tried again for a point within the unit circle.
const TRIES: u32 = 10_000;

/// Rays that slices scatter.
pub(super) struct OffSlices {
    pub count: usize,
    /// Number of each among the rays.
    ray: [usize; TOGETHER],
    /// See `Arrivals`.
    incident: [Lanes; 2],
    forward: [Lanes; 2],
    slice: Numbers,
    /// Two random numbers.
    rest: Lanes,
    number: Lanes,
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
    direction: [Lanes; 3],
}

impl OffSlices {
    pub const fn new() -> Self {
        Self {
            count: 0,
            ray: [0; TOGETHER],
            incident: [ZERO; 2],
            forward: [ZERO; 2],
            slice: [0; TOGETHER],
            rest: ZERO,
            number: ZERO,
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

    /// One ray more.
    #[inline]
    pub fn push(&mut self, arrivals: &Arrivals, k: usize, first: usize, numbers: &[f64]) {
        let at = self.count;
        self.ray[at] = first + k;
        for axis in 0..2 {
            self.incident[axis][at] = arrivals.incident[axis][k];
            self.forward[axis][at] = arrivals.forward[axis][k];
        }
        self.slice[at] = arrivals.slice[k];
        self.rest[at] = arrivals.rest[k];
        self.number[at] = numbers[first + k];
        self.count += 1;
    }

    /// Draws for all of them.
    pub fn draw(&mut self, lobe: &Lobe, up: bool, directions: &mut [&mut [f64]; 3]) {
        let n = std::mem::take(&mut self.count);
        let mut tables: [&[Slot]; TOGETHER] = [&[]; TOGETHER];
        for (k, table) in tables.iter_mut().enumerate().take(n) {
            let grid = lobe.slice(self.slice[k] as usize);
            [self.radii[k], self.azimuths[k], self.values[k]] = grid.size();
            *table = grid.slots();
        }
        slots(self);
        for (k, table) in tables.iter().enumerate().take(n) {
            let slot = table[self.slot[k] as usize];
            (self.chance[k], self.alias[k]) = (slot.own, slot.alias);
        }
        nodes(self);
        for k in 0..n {
            let hat = lobe.slice(self.slice[k] as usize).hat(self.radius[k] as usize);
            (self.inner[k], self.top[k]) = (hat.inner, hat.node);
            for side in 0..2 {
                (self.fars[side][k], self.linears[side][k]) = (hat.slopes[side].far, hat.slopes[side].linear);
            }
        }
        radii(self);
        // Those that are bent first.
        let (mut list, mut count) = ([0; TOGETHER], 0);
        for k in 0..n {
            list[count] = k;
            count += usize::from(self.part[k] >= self.inner[k] * self.linear[k]);
        }
        for k in list.into_iter().take(count) {
            let slope = [self.part[k] / self.inner[k], self.linear[k]];
            self.along[k] = bent(slope, self.number[k], self.inwards[k] > 0.0);
        }
        off_slices(self, if up { 1.0 } else { -1.0 });
        for (list, found) in directions.iter_mut().zip(&self.direction) {
            for (ray, found) in self.ray.iter().zip(found).take(n) {
                list[*ray] = *found;
            }
        }
        // Those whose places lie outside the unit circle.
        for k in (0..n).filter(|k| self.direction[2][*k] == 0.0) {
            let [x, y] = self.incident.each_ref().map(|list| list[k]);
            let incident = Vec3::new(x, y, 0.0);
            let (grid, numbers) = (lobe.slice(self.slice[k] as usize), [self.rest[k], self.number[k]]);
            let found = again(&Incidence::new(incident), incident, grid, numbers, up);
            for (list, found) in directions.iter_mut().zip([found.x, found.y, found.z]) {
                list[self.ray[k]] = found;
            }
        }
    }
}

/// A direction where a first place was outside the unit circle.
pub(super) fn again(incidence: &Incidence, incident: Vec3, grid: &Grid, numbers: [f64; 2], up: bool) -> Vec3 {
    let mut more = MoreNumbers::new(numbers);
    let found = (1..TRIES).find_map(|_| incidence.direction(incident, grid.draw(more.pair()), up));
    found.unwrap_or_else(|| by_cosine(up, numbers))
}

/// Places in the tables of nodes.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a slice has fewer than 2^31 values"
)]
fn slots(lobes: &mut OffSlices) {
    let OffSlices { rest, values, slot, .. } = lobes;
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
fn nodes(lobes: &mut OffSlices) {
    let OffSlices {
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
    } = lobes;
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
fn radii(lobes: &mut OffSlices) {
    let OffSlices {
        inner,
        fars,
        linears,
        far,
        linear,
        inwards: sides,
        part,
        along,
        ..
    } = lobes;
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
fn off_slices(lobes: &mut OffSlices, sign: f64) {
    let OffSlices {
        incident: [x, y],
        number,
        forward: [c, s],
        azimuth,
        azimuths,
        far,
        top,
        along,
        direction: [to_x, to_y, to_z],
        ..
    } = lobes;
    for k in 0..TOGETHER {
        // Azimuths with a density that falls linearly from the node towards the next ones.
        let low = number[k] < 0.5;
        let root = if low { 2.0 * number[k] } else { 2.0 - 2.0 * number[k] }.sqrt();
        let aside = if low { root - 1.0 } else { 1.0 - root };
        let turn = (azimuth[k] + aside) / azimuths[k];
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let r = far[k] + along[k] * (top[k] - far[k]);
        let (sin, cos) = sin_cos_turns(turn);
        let (ahead, across) = (r * cos, r * sin);
        let px = c[k] * ahead - s[k] * across - x[k];
        let py = s[k] * ahead + c[k] * across - y[k];
        let square = 1.0 - px * px - py * py;
        to_x[k] = px;
        to_y[k] = py;
        to_z[k] = sign * if square > 0.0 { square } else { 0.0 }.sqrt();
    }
}
