//! Rays that slices of a table scatter, until they have a direction within the unit circle.

use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::more_numbers::MoreNumbers;
use etendue_sampling::warp::part_of;
use multiversion::multiversion;

use super::arrivals::Arrivals;
use super::grid::Grid;
use super::lanes::{LANES, Lanes, blocks};
use super::lobes::{Incidence, Lobe};
use super::nodes::{ENOUGH, MOST, Nodes, WaitingLanes};
use crate::bsdf::contract::by_cosine;

/// How often is tried for a point within the unit circle.
const TRIES: u32 = 10_000;

/// So few rays go on one by one.
const FEW: usize = 4;

/// Rays off slices.
pub(super) struct Waiting {
    count: usize,
    /// See [`Arrivals`]; and the place of each in the lists of all rays.
    incident: [WaitingLanes<f64>; 2],
    forward: [WaitingLanes<f64>; 2],
    slice: WaitingLanes<u32>,
    ray: WaitingLanes<u32>,
    /// Two random numbers, those that follow them, and how often was tried.
    numbers: [WaitingLanes<f64>; 2],
    more: [MoreNumbers; MOST],
    tries: [u32; MOST],
    nodes: Nodes,
    direction: [WaitingLanes<f64>; 3],
}

impl Waiting {
    pub const fn new() -> Self {
        const ZERO: WaitingLanes<f64> = Lanes::of(0.0);
        Self {
            count: 0,
            incident: [ZERO; 2],
            forward: [ZERO; 2],
            slice: Lanes::of(0),
            ray: Lanes::of(0),
            numbers: [ZERO; 2],
            more: [MoreNumbers::new([0.0; 2]); MOST],
            tries: [0; MOST],
            nodes: Nodes::new(),
            direction: [ZERO; 3],
        }
    }

    /// Takes some of the rays that arrive, the first of which has this place in the lists of all; there are not enough yet.
    #[allow(clippy::cast_possible_truncation, reason = "fewer than 2^32 rays")]
    pub fn take(&mut self, arrivals: &Arrivals, which: &[usize], first: usize) {
        for (i, k) in (self.count..).zip(which.iter().copied()) {
            for (lanes, others) in self.incident.iter_mut().zip(&arrivals.incident) {
                lanes[i] = others[k];
            }
            for (lanes, others) in self.forward.iter_mut().zip(&arrivals.forward) {
                lanes[i] = others[k];
            }
            (self.slice[i], self.ray[i]) = (arrivals.slice[k], (first + k) as u32);
            let numbers = [arrivals.rest[k], arrivals.other[k]];
            for (lanes, number) in self.numbers.iter_mut().zip(numbers) {
                lanes[i] = number;
            }
            (self.more[i], self.tries[i]) = (MoreNumbers::new(numbers), 1);
        }
        self.count += which.len();
    }

    pub const fn are_enough(&self) -> bool {
        self.count > ENOUGH
    }

    /// Tries once for all of them. Those outside the unit circle go on waiting, with other numbers.
    pub fn leave(&mut self, lobe: &Lobe, up: bool, directions: &mut [&mut [f64]; 3]) {
        let [numbers, others] = &self.numbers;
        self.nodes.draw(lobe, self.count, &self.slice, [numbers, others]);
        off_slices(self, if up { 1.0 } else { -1.0 });
        let (mut list, mut outside) = ([0; MOST], 0);
        for i in 0..self.count {
            let ray = self.ray[i] as usize;
            for (all, found) in directions.iter_mut().zip(&self.direction) {
                all[ray] = found[i];
            }
            list[outside] = i;
            outside += usize::from(self.direction[2][i] == 0.0);
        }
        self.count = 0;
        for i in list.into_iter().take(outside) {
            if self.tries[i] < TRIES {
                self.wait_on(i);
            } else {
                let numbers = self.more[i].pair();
                tell(directions, self.ray[i], by_cosine(up, numbers));
            }
        }
    }

    /// Lets a ray go on waiting.
    fn wait_on(&mut self, i: usize) {
        let to = self.count;
        for lanes in self.incident.iter_mut().chain(&mut self.forward) {
            lanes[to] = lanes[i];
        }
        (self.slice[to], self.ray[to]) = (self.slice[i], self.ray[i]);
        (self.more[to], self.tries[to]) = (self.more[i], self.tries[i] + 1);
        let numbers = self.more[to].pair();
        for (lanes, number) in self.numbers.iter_mut().zip(numbers) {
            lanes[to] = number;
        }
        self.count += 1;
    }

    /// Directions for all that are left.
    pub fn leave_at_last(&mut self, lobe: &Lobe, up: bool, directions: &mut [&mut [f64]; 3]) {
        while self.count > FEW {
            self.leave(lobe, up, directions);
        }
        for i in 0..self.count {
            let [x, y] = self.incident.each_ref().map(|lanes| lanes[i]);
            let (incident, grid) = (Vec3::new(x, y, 0.0), lobe.slice(self.slice[i] as usize));
            let numbers = self.numbers.each_ref().map(|lanes| lanes[i]);
            let tries = (numbers, self.more[i], self.tries[i]);
            tell(
                directions,
                self.ray[i],
                tried(&Incidence::new(incident), incident, grid, tries, up),
            );
        }
        self.count = 0;
    }
}

/// Puts a direction into lists.
fn tell(directions: &mut [&mut [f64]; 3], ray: u32, found: Vec3) {
    for (all, component) in directions.iter_mut().zip([found.x, found.y, found.z]) {
        all[ray as usize] = component;
    }
}

/// A direction off a slice, from two numbers and those that follow them.
#[inline]
pub(super) fn off_slice(incidence: &Incidence, incident: Vec3, grid: &Grid, numbers: [f64; 2], up: bool) -> Vec3 {
    let tries = (numbers, MoreNumbers::new(numbers), 1);
    tried(incidence, incident, grid, tries, up)
}

/// The same after some tries.
fn tried(
    incidence: &Incidence,
    incident: Vec3,
    grid: &Grid,
    (mut numbers, mut more, tries): ([f64; 2], MoreNumbers, u32),
    up: bool,
) -> Vec3 {
    for _ in tries..=TRIES {
        if let Some(found) = incidence.direction(incident, grid.draw(numbers), up) {
            return found;
        }
        numbers = more.pair();
    }
    by_cosine(up, numbers)
}

/// Directions at the places that were drawn; the height of those outside the unit circle is 0.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn off_slices(waiting: &mut Waiting, sign: f64) {
    let Waiting {
        count,
        incident,
        forward,
        numbers,
        nodes,
        direction,
        ..
    } = waiting;
    for b in blocks::<{ MOST / LANES }>(*count) {
        let [x, y] = incident.each_ref().map(|lanes| &lanes.0[b]);
        let [c, s] = forward.each_ref().map(|lanes| &lanes.0[b]);
        let number = &numbers[1].0[b];
        let (azimuth, azimuths) = (&nodes.azimuth.0[b], &nodes.azimuths.0[b]);
        let (top, far, left) = (&nodes.top.0[b], &nodes.far.0[b], &nodes.left.0[b]);
        let (limit, bent) = (&nodes.limit.0[b], &nodes.bent.0[b]);
        let mut to = [[0.0; LANES]; 3];
        for k in 0..LANES {
            // Azimuths with a density that falls linearly from the node towards the next ones.
            let low = number[k] < 0.5;
            let root = if low { 2.0 * number[k] } else { 2.0 - 2.0 * number[k] }.sqrt();
            let aside = if low { root - 1.0 } else { 1.0 - root };
            let turn = (azimuth[k] + aside) / azimuths[k];
            let turn = if turn < 0.0 { turn + 1.0 } else { turn };
            let straight = part_of(left[k], limit[k]).sqrt();
            let along = if left[k] < limit[k] { straight } else { bent[k] };
            let r = far[k] + along * (top[k] - far[k]);
            let (sin, cos) = sin_cos_turns(turn);
            let (ahead, across) = (r * cos, r * sin);
            let px = c[k] * ahead - s[k] * across - x[k];
            let py = s[k] * ahead + c[k] * across - y[k];
            let square = 1.0 - px * px - py * py;
            let height = if square > 0.0 { square } else { 0.0 }.sqrt();
            (to[0][k], to[1][k], to[2][k]) = (px, py, sign * height);
        }
        for (lanes, to) in direction.iter_mut().zip(to) {
            lanes.0[b] = to;
        }
    }
}
