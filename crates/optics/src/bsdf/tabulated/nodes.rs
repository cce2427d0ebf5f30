//! Rays that slices of a table scatter, many at once: the nodes of their grids, and where about them.

use etendue_sampling::alias::UNIT;
use etendue_sampling::warp::part_of;
use multiversion::multiversion;

use super::arrivals::TOGETHER;
use super::grid::half;
use super::hats::Hat;
use super::lanes::{LANES, Lanes, blocks};
use super::lobes::Lobe;

/// So many rays are worth working on together.
pub(super) const ENOUGH: usize = 2 * LANES;

/// The most that wait: not quite enough, and those that arrive together.
pub(super) const MOST: usize = ENOUGH + TOGETHER;

pub(super) type WaitingLanes<T> = Lanes<T, { MOST / LANES }>;

/// What slices draw for rays that wait for it.
pub(super) struct Nodes {
    /// See `Size`.
    radii: WaitingLanes<f64>,
    pub azimuths: WaitingLanes<f64>,
    places: WaitingLanes<f64>,
    halves: WaitingLanes<f64>,
    /// Of the table of nodes: a place, the same with how far into it the number falls, and what it holds.
    slot: WaitingLanes<u32>,
    scaled: WaitingLanes<f64>,
    chance: WaitingLanes<u32>,
    alias: WaitingLanes<u32>,
    /// The node: its azimuth and radial coordinate, and what is left of the number.
    pub azimuth: WaitingLanes<f64>,
    radius: WaitingLanes<u32>,
    part: WaitingLanes<f64>,
    /// Its hat.
    below: WaitingLanes<f64>,
    pub top: WaitingLanes<f64>,
    above: WaitingLanes<f64>,
    /// Of the side that is drawn from the far end, what is left of the number, and where the side begins to be bent.
    pub far: WaitingLanes<f64>,
    pub left: WaitingLanes<f64>,
    pub limit: WaitingLanes<f64>,
    /// From the far end to the top, of those that are bent.
    pub bent: WaitingLanes<f64>,
}

impl Nodes {
    pub const fn new() -> Self {
        const ZERO: WaitingLanes<f64> = Lanes::of(0.0);
        Self {
            radii: ZERO,
            azimuths: ZERO,
            places: Lanes::of(1.0),
            halves: Lanes::of(1.0),
            slot: Lanes::of(0),
            scaled: ZERO,
            chance: Lanes::of(0),
            alias: Lanes::of(0),
            azimuth: ZERO,
            radius: Lanes::of(0),
            part: ZERO,
            below: ZERO,
            top: ZERO,
            above: ZERO,
            far: ZERO,
            left: ZERO,
            limit: ZERO,
            bent: ZERO,
        }
    }

    /// Draws for the first `n` rays, told their slices and two random numbers for each.
    pub fn draw(
        &mut self,
        lobe: &Lobe,
        n: usize,
        slices: &WaitingLanes<u32>,
        [numbers, others]: [&WaitingLanes<f64>; 2],
    ) {
        for k in 0..n {
            let size = lobe.slice(slices[k] as usize).size();
            (self.radii[k], self.azimuths[k]) = (size.radii, size.azimuths);
            (self.places[k], self.halves[k]) = (size.places, size.halves);
        }
        places(self, numbers, n);
        // Nothing else here: the processor waits for as many places as it can look ahead.
        for k in 0..n {
            let slot = lobe.slice(slices[k] as usize).slot(self.slot[k]);
            (self.chance[k], self.alias[k]) = (slot.own, slot.alias);
        }
        nodes(self, n);
        for k in 0..n {
            let hat = lobe.slice(slices[k] as usize).hat(self.radius[k] as usize);
            (self.below[k], self.top[k], self.above[k]) = (hat.below, hat.node, hat.above);
        }
        sides(self, n);
        let (mut list, mut count) = ([0; MOST], 0);
        for k in 0..n {
            list[count] = k;
            count += usize::from(self.left[k] >= self.limit[k]);
        }
        for k in list.into_iter().take(count) {
            self.bent[k] = self.hat(k).side(self.part[k]).bent(others[k]);
        }
    }

    /// The hat of the node of one ray.
    fn hat(&self, k: usize) -> Hat {
        Hat {
            below: self.below[k],
            node: self.top[k],
            above: self.above[k],
        }
    }
}

/// Sides of the hats.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn sides(all: &mut Nodes, count: usize) {
    for b in blocks::<{ MOST / LANES }>(count) {
        let (below, top, above, part) = (&all.below.0[b], &all.top.0[b], &all.above.0[b], &all.part.0[b]);
        let (mut far, mut left, mut limit) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            let hat = Hat {
                below: below[k],
                node: top[k],
                above: above[k],
            };
            let side = hat.side(part[k]);
            (far[k], left[k], limit[k]) = (side.far, side.left, side.limit());
        }
        (all.far.0[b], all.left.0[b], all.limit.0[b]) = (far, left, limit);
    }
}

/// Places in the alias tables of the slices, by a random number.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "fewer than 2^31 places"
)]
fn places(all: &mut Nodes, number: &WaitingLanes<f64>, count: usize) {
    for b in blocks::<{ MOST / LANES }>(count) {
        let (number, places) = (&number.0[b], &all.places.0[b]);
        let (mut slot, mut scaled) = ([0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            scaled[k] = number[k] * places[k];
            let last = places[k] - 1.0;
            slot[k] = (if scaled[k] < last { scaled[k] } else { last }) as i32 as u32;
        }
        (all.slot.0[b], all.scaled.0[b]) = (slot, scaled);
    }
}

/// Nodes of the slices.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "fewer than 2^16 radial coordinates"
)]
fn nodes(all: &mut Nodes, count: usize) {
    for b in blocks::<{ MOST / LANES }>(count) {
        let (radii, slot, scaled) = (&all.radii.0[b], &all.slot.0[b], &all.scaled.0[b]);
        let (chance, alias) = (&all.chance.0[b], &all.alias.0[b]);
        let (azimuths, halves) = (&all.azimuths.0[b], &all.halves.0[b]);
        let (mut azimuth, mut radius, mut part) = ([0.0; LANES], [0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            let within = scaled[k] - f64::from(slot[k]);
            let chance = f64::from(chance[k]) * UNIT;
            let own = within < chance;
            let (left, share) = if own {
                (within, chance)
            } else {
                (within - chance, 1.0 - chance)
            };
            let (rest, other) = half(part_of(left, share), halves[k]);
            part[k] = rest;
            let node = f64::from(if own { slot[k] } else { alias[k] });
            // A division of whole numbers: the nearest one to what lies half a step from its next.
            let turned = whole((node + 0.5) / radii[k] - 0.5);
            radius[k] = (node - turned * radii[k]) as i32 as u32;
            let mirrored = other & (turned > 0.0);
            azimuth[k] = if mirrored { azimuths[k] - turned } else { turned };
        }
        (all.azimuth.0[b], all.radius.0[b], all.part.0[b]) = (azimuth, radius, part);
    }
}

/// The nearest whole number, of a small one.
#[inline(always)]
fn whole(x: f64) -> f64 {
    // As an addition rounds; `round` is a call where the instruction set has no such thing.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    (x + WHOLE) - WHOLE
}
