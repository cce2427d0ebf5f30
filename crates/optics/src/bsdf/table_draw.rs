//! Many rays at once off a table of one lobe: what [`Tabulated`](super::Tabulated) draws for each by itself, to the same bits.
//!
//! Step by step for many of them together. Sums, roots and angles are worked out several at a time; what is looked up in between
//! is all over a memory that no cache holds, and without branches the processor waits for many of them at once.

use etendue_math::trig::sin_cos_turns;
use multiversion::multiversion;

use super::contract::Outcome;
use super::table_arrivals::{Arrivals, Lanes, TOGETHER, ZERO};
use super::table_lobes::Lobe;
use super::table_slices::OffSlices;

/// What scatters rays that meet the same side of a surface, and where to.
pub(super) struct Group {
    arrivals: Arrivals,
    lobes: OffSlices,
    floors: OffFloors,
}

/// Rays that floors scatter.
struct OffFloors {
    count: usize,
    /// Number of each among the rays.
    ray: [usize; TOGETHER],
    /// Two random numbers.
    rest: Lanes,
    number: Lanes,
    /// Where the light goes.
    direction: [Lanes; 3],
}

impl Group {
    pub const fn new() -> Self {
        Self {
            arrivals: Arrivals::new(),
            lobes: OffSlices::new(),
            floors: OffFloors {
                count: 0,
                ray: [0; TOGETHER],
                rest: ZERO,
                number: ZERO,
                direction: [ZERO; 3],
            },
        }
    }

    /// Draws for rays that meet one side, and sends those that are scattered up or down: see [`Bsdf::sample_many`].
    ///
    /// [`Bsdf::sample_many`]: super::contract::Bsdf::sample_many
    pub fn draw(
        &mut self,
        (lobe, up): (&Lobe, bool),
        directions: &mut [&mut [f64]; 3],
        numbers: [&[f64]; 2],
        outcomes: &mut [Outcome],
    ) {
        let n = outcomes.len();
        for first in (0..n).step_by(TOGETHER) {
            let count = TOGETHER.min(n - first);
            let rays = first..first + count;
            self.arrivals.take([&*directions[0], &*directions[1]], numbers[0], rays);
            self.arrivals.choose(lobe, count);
            let Self {
                arrivals,
                lobes,
                floors,
            } = self;
            // Without branches, which nobody can foresee.
            let (mut off_slices, mut slices) = ([0; TOGETHER], 0);
            let (mut off_floors, mut evens) = ([0; TOGETHER], 0);
            for (k, outcome) in outcomes[first..].iter_mut().take(TOGETHER).enumerate() {
                let (goes, even) = (arrivals.absorbed[k] == 0.0, arrivals.floor[k] > 0.0);
                *outcome = if goes { Outcome::Scattered } else { Outcome::Absorbed };
                (off_slices[slices], off_floors[evens]) = (k, k);
                slices += usize::from(goes & !even);
                evens += usize::from(goes & even);
            }
            for k in &off_slices[..slices] {
                if lobes.count == TOGETHER {
                    lobes.draw(lobe, up, directions);
                }
                lobes.push(arrivals, *k, first, numbers[1]);
            }
            for k in &off_floors[..evens] {
                if floors.count == TOGETHER {
                    floors.draw(up, directions);
                }
                floors.push(arrivals, *k, first, numbers[1]);
            }
        }
        self.lobes.draw(lobe, up, directions);
        self.floors.draw(up, directions);
    }
}

impl OffFloors {
    /// One ray more.
    #[inline]
    fn push(&mut self, arrivals: &Arrivals, k: usize, first: usize, numbers: &[f64]) {
        let at = self.count;
        (self.ray[at], self.rest[at], self.number[at]) = (first + k, arrivals.rest[k], numbers[first + k]);
        self.count += 1;
    }

    /// Draws for all of them.
    fn draw(&mut self, up: bool, directions: &mut [&mut [f64]; 3]) {
        let n = std::mem::take(&mut self.count);
        off_floors(self, if up { 1.0 } else { -1.0 });
        for (list, found) in directions.iter_mut().zip(&self.direction) {
            for (ray, found) in self.ray.iter().zip(found).take(n) {
                list[*ray] = *found;
            }
        }
    }
}

/// Directions off floors, as [`by_cosine`] says.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn off_floors(floors: &mut OffFloors, sign: f64) {
    let OffFloors {
        rest,
        number,
        direction: [to_x, to_y, to_z],
        ..
    } = floors;
    for k in 0..TOGETHER {
        let cosine = (1.0 - rest[k]).sqrt();
        let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
        let (s, c) = sin_cos_turns(number[k]);
        (to_x[k], to_y[k], to_z[k]) = (sine * c, sine * s, sign * cosine);
    }
}
