//! Many rays at once off a table of one lobe: what [`Tabulated`](super::Tabulated) draws for each by itself, to the same bits.
//!
//! Step by step for many of them together. Sums, roots and angles are worked out several at a time; what is looked up in between
//! is all over a memory that no cache holds, and without branches the processor waits for many of them at once. Rays off slices
//! wait until there are enough of them.

use etendue_math::trig::sin_cos_turns;
use multiversion::multiversion;

use super::arrivals::{ABSORBED, Arrivals, Lanes, OFF_SLICE, TOGETHER};
use super::base::Base;
use super::lanes::{LANES, blocks};
use super::lobes::Lobe;
use super::waiting::Waiting;
use crate::bsdf::drawn::Outcome;

/// What scatters rays that meet the same side of a surface, and where to.
pub(super) struct Group {
    arrivals: Arrivals,
    direction: [Lanes<f64>; 3],
    waiting: Waiting,
}

impl Group {
    pub const fn new() -> Self {
        const ZERO: Lanes<f64> = Lanes::of(0.0);
        Self {
            arrivals: Arrivals::new(),
            direction: [ZERO; 3],
            waiting: Waiting::new(),
        }
    }

    /// Draws for rays that meet one side, and sends those that are scattered up or down: see [`Bsdf::sample_many`].
    ///
    /// [`Bsdf::sample_many`]: crate::bsdf::contract::Bsdf::sample_many
    pub fn draw(
        &mut self,
        (lobe, base, up): (&Lobe, &Base, bool),
        directions: &mut [&mut [f64]; 3],
        numbers: [&[f64]; 2],
        outcomes: &mut [Outcome],
    ) {
        for first in (0..outcomes.len()).step_by(TOGETHER) {
            let rays = first..outcomes.len().min(first + TOGETHER);
            let incident = [&directions[0][rays.clone()], &directions[1][rays.clone()]];
            self.arrivals
                .choose((lobe, base), incident, numbers.map(|list| &list[rays.clone()]));
            // Without branches, which nobody can foresee.
            let (mut list, mut count) = ([0; TOGETHER], 0);
            for (k, outcome) in outcomes[rays.clone()].iter_mut().enumerate() {
                let kind = self.arrivals.kind[k];
                *outcome = [Outcome::Absorbed, Outcome::Scattered][usize::from(kind != ABSORBED)];
                list[count] = k;
                count += usize::from(kind == OFF_SLICE);
            }
            off_base(self, rays.len(), if up { 1.0 } else { -1.0 });
            for (list, found) in directions.iter_mut().zip(&self.direction) {
                found.give(&mut list[rays.clone()]);
            }
            self.waiting.take(&self.arrivals, &list[..count], first);
            // Of a lobe that the horizon cuts most may go on waiting.
            while self.waiting.are_enough() {
                self.waiting.leave(lobe, up, directions);
            }
        }
        self.waiting.leave_at_last(lobe, up, directions);
    }
}

/// Directions off the base, as [`by_cosine`](crate::bsdf::contract::by_cosine) says of the square of a sine. Those of rays off slices
/// mean nothing.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn off_base(group: &mut Group, count: usize, sign: f64) {
    let Group {
        arrivals, direction, ..
    } = group;
    for b in blocks::<{ TOGETHER / LANES }>(count) {
        let (square, number) = (&arrivals.rest.0[b], &arrivals.other.0[b]);
        let mut to = [[0.0; LANES]; 3];
        for k in 0..LANES {
            let cosine = (1.0 - square[k]).sqrt();
            let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
            let (sin, cos) = sin_cos_turns(number[k]);
            (to[0][k], to[1][k], to[2][k]) = (sine * cos, sine * sin, sign * cosine);
        }
        for (lanes, to) in direction.iter_mut().zip(to) {
            lanes.0[b] = to;
        }
    }
}
