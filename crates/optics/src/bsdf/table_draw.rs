//! Many rays at once off a table of one lobe: what [`Tabulated`](super::Tabulated) draws for each by itself, to the same bits.
//!
//! Step by step for many of them together. Sums, roots and angles are worked out several at a time, for those that are off
//! slices and those that are off the base alike; what is looked up in between is all over a memory that no cache holds, and without
//! branches the processor waits for many of them at once.

use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::more_numbers::MoreNumbers;
use etendue_sampling::warp::part_of;
use multiversion::multiversion;

use super::contract::{Outcome, by_cosine};
use super::table_arrivals::{ABSORBED, Arrivals, OFF_BASE, OFF_SLICE};
use super::table_base::Base;
use super::table_grid::Grid;
use super::table_lanes::{LANES, Lanes, TOGETHER, blocks};
use super::table_lobes::{Incidence, Lobe};
use super::table_nodes::Nodes;

/// How often is tried again for a point within the unit circle.
const TRIES: u32 = 10_000;

/// What scatters rays that meet the same side of a surface, and where to.
pub(super) struct Group {
    arrivals: Arrivals,
    nodes: Nodes,
    direction: [Lanes<f64>; 3],
}

impl Group {
    pub const fn new() -> Self {
        const ZERO: Lanes<f64> = Lanes::of(0.0);
        Self {
            arrivals: Arrivals::new(),
            nodes: Nodes::new(),
            direction: [ZERO; 3],
        }
    }

    /// Draws for rays that meet one side, and sends those that are scattered up or down: see [`Bsdf::sample_many`].
    ///
    /// [`Bsdf::sample_many`]: super::contract::Bsdf::sample_many
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
            let off_slices = &list[..count];
            self.nodes.draw(lobe, &self.arrivals, rays.len(), off_slices);
            leave(self, rays.len(), if up { 1.0 } else { -1.0 });
            for k in off_slices.iter().copied() {
                if self.direction[2][k] == 0.0 {
                    self.leave_after_all(lobe, up, k);
                }
            }
            for (list, found) in directions.iter_mut().zip(&self.direction) {
                found.give(&mut list[rays.clone()]);
            }
        }
    }

    /// A direction for one whose place lies outside the unit circle.
    fn leave_after_all(&mut self, lobe: &Lobe, up: bool, k: usize) {
        let arrivals = &self.arrivals;
        let [x, y] = arrivals.incident.each_ref().map(|lanes| lanes[k]);
        let (incident, numbers) = (Vec3::new(x, y, 0.0), [arrivals.rest[k], arrivals.other[k]]);
        let grid = lobe.slice(arrivals.slice[k] as usize);
        let found = again(&Incidence::new(incident), incident, grid, numbers, up);
        for (lanes, component) in self.direction.iter_mut().zip([found.x, found.y, found.z]) {
            lanes[k] = component;
        }
    }
}

/// A direction where a first place was outside the unit circle.
pub(super) fn again(incidence: &Incidence, incident: Vec3, grid: &Grid, numbers: [f64; 2], up: bool) -> Vec3 {
    let mut more = MoreNumbers::new(numbers);
    let found = (1..TRIES).find_map(|_| incidence.direction(incident, grid.draw(more.pair()), up));
    found.unwrap_or_else(|| by_cosine(up, numbers))
}

/// Directions off the base, as [`by_cosine`] says of the square of a sine, and off slices, at the places that were drawn; the
/// height of those outside the unit circle is 0.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn leave(group: &mut Group, count: usize, sign: f64) {
    let Group {
        arrivals,
        nodes,
        direction,
    } = group;
    for b in blocks(count) {
        let [x, y] = arrivals.incident.each_ref().map(|lanes| &lanes.0[b]);
        let [c, s] = arrivals.forward.each_ref().map(|lanes| &lanes.0[b]);
        let (kind, rest, number) = (&arrivals.kind.0[b], &arrivals.rest.0[b], &arrivals.other.0[b]);
        let (azimuth, azimuths) = (&nodes.azimuth.0[b], &nodes.azimuths.0[b]);
        let (top, far, left) = (&nodes.top.0[b], &nodes.far.0[b], &nodes.left.0[b]);
        let (limit, bent) = (&nodes.limit.0[b], &nodes.bent.0[b]);
        let mut to = [[0.0; LANES]; 3];
        for k in 0..LANES {
            let is_base = kind[k] == OFF_BASE;
            // Azimuths with a density that falls linearly from the node towards the next ones.
            let low = number[k] < 0.5;
            let root = if low { 2.0 * number[k] } else { 2.0 - 2.0 * number[k] }.sqrt();
            let aside = if low { root - 1.0 } else { 1.0 - root };
            let turn = (azimuth[k] + aside) / azimuths[k];
            let turn = if turn < 0.0 { turn + 1.0 } else { turn };
            let straight = part_of(left[k], limit[k]).sqrt();
            let along = if left[k] < limit[k] { straight } else { bent[k] };
            let r = far[k] + along * (top[k] - far[k]);
            let cosine = (1.0 - rest[k]).sqrt();
            let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
            let (sin, cos) = sin_cos_turns(if is_base { number[k] } else { turn });
            let r = if is_base { sine } else { r };
            let (ahead, across) = (r * cos, r * sin);
            let px = c[k] * ahead - s[k] * across - x[k];
            let py = s[k] * ahead + c[k] * across - y[k];
            let square = 1.0 - px * px - py * py;
            let height = if square > 0.0 { square } else { 0.0 }.sqrt();
            to[0][k] = if is_base { ahead } else { px };
            to[1][k] = if is_base { across } else { py };
            to[2][k] = sign * if is_base { cosine } else { height };
        }
        for (lanes, to) in direction.iter_mut().zip(to) {
            lanes.0[b] = to;
        }
    }
}
