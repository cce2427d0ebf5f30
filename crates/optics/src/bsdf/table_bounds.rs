//! What f of a table is at least, over ranges of incidence and of scattered directions.
//!
//! Incident and scattered directions are both cut into rings about the normal of a degree and a half each. A scattered ring is cut
//! into sectors; while the incidence moves through its ring, the place of a sector in the slices of the table, which move
//! with β₀, stays within a range of distances and azimuths, and f is linear between nodes of the grid: it is nowhere less than
//! at the nodes of the cells that the range touches.

use std::f64::consts::FRAC_1_PI;

use etendue_math::trig::sin_cos_turns;

use super::table_grid::Grid;
use super::table_lobes::{Lobe, turns};

/// Rings from the normal to the horizon.
pub(super) const RINGS: usize = 64;

/// Sectors of a ring: a multiple of 4, so that sines and cosines rise or fall throughout each.
const SECTORS: usize = 64;

/// Steps of |β − β₀| for which the least values of a slice are kept.
const RADII: usize = 128;

/// Such steps in a unit of |β − β₀|, which goes up to 2.
const PER_UNIT: f64 = 64.0;

/// What angles and distances may be off by rounding.
const ROUNDING: f64 = 1e-9;

/// For each ring of scattered directions.
pub(super) type Least = [f64; RINGS];

/// The sine of the inner edge of a ring; the last edge is the horizon.
pub(super) fn edge(ring: usize) -> f64 {
    sin_cos_turns(0.25 * ring as f64 / RINGS as f64).0.min(1.0)
}

/// Within which places of a slice light leaves into a sector.
#[derive(Clone, Copy)]
struct Region {
    /// Steps of the distance, first and last.
    steps: [usize; 2],
    /// The first azimuth \[turns\], from 0 to 1, and how much farther the last is.
    turn: f64,
    width: f64,
}

/// The least values of a slice, by azimuth, from each to the next, and by steps of the distance.
struct Lows {
    azimuths: usize,
    lows: Vec<f64>,
}

/// The least f \[1/sr\] of each lobe for each ring of incidence and of scattered directions.
pub(super) fn least(lobes: &[&Lobe]) -> Vec<Vec<Least>> {
    let lows: Vec<Vec<Lows>> = lobes
        .iter()
        .map(|lobe| lobe.slices().iter().map(Lows::of).collect())
        .collect();
    let mut found = vec![Vec::with_capacity(RINGS); lobes.len()];
    for ring in 0..RINGS {
        let sines = [edge(ring), edge(ring + 1)];
        let regions: Vec<Region> = (0..RINGS * SECTORS)
            .map(|k| Region::of(sines, k / SECTORS, k % SECTORS))
            .collect();
        for ((lobe, lows), found) in lobes.iter().zip(&lows).zip(&mut found) {
            found.push(least_of(lobe, lows, sines, &regions));
        }
    }
    found
}

/// The same for one lobe and one ring of incidence.
fn least_of(lobe: &Lobe, lows: &[Lows], sines: [f64; 2], regions: &[Region]) -> Least {
    let mut by_slice: Vec<Option<Vec<f64>>> = vec![None; lows.len()];
    let mut least = [f64::INFINITY; RINGS];
    for (first, factors) in lobe.least_factors(sines) {
        let used = [0, 1]
            .map(|k| (first + k, factors[k]))
            .into_iter()
            .filter(|(_, factor)| *factor > 0.0);
        let mut f = vec![factors[2] * FRAC_1_PI; regions.len()];
        for (number, factor) in used {
            let there = by_slice[number]
                .get_or_insert_with(|| regions.iter().map(|region| lows[number].within(region)).collect());
            for (f, low) in f.iter_mut().zip(there) {
                *f += factor * *low;
            }
        }
        for (least, f) in least.iter_mut().zip(f.chunks(SECTORS)) {
            *least = f.iter().copied().fold(*least, f64::min);
        }
    }
    least
}

impl Region {
    /// For sines of incidence in a range, and a sector of a ring.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "distances are from 0 to 2"
    )]
    fn of([from, to]: [f64; 2], ring: usize, sector: usize) -> Self {
        let radii = [edge(ring), edge(ring + 1)];
        let ends = [sector, sector + 1].map(|k| sin_cos_turns(k as f64 / SECTORS as f64));
        let along = range(radii.map(|r| ends.map(|(_, cosine)| r * cosine)));
        let across = range(radii.map(|r| ends.map(|(sine, _)| r * sine)));
        // A rectangle about β − β₀.
        let (x, y) = (
            [along[0] - to - ROUNDING, along[1] - from + ROUNDING],
            [across[0] - ROUNDING, across[1] + ROUNDING],
        );
        let nearest = |[low, high]: [f64; 2]| 0.0_f64.clamp(low, high);
        let farthest = |[low, high]: [f64; 2]| f64::max(-low, high);
        let [near, far] = [[nearest(x), nearest(y)], [farthest(x), farthest(y)]].map(|[x, y]| (x * x + y * y).sqrt());
        let steps = [near, far].map(|r| ((r * PER_UNIT) as usize).min(RADII - 1));
        if near == 0.0 {
            return Self {
                steps,
                turn: 0.0,
                width: 1.0,
            };
        }
        let middle = turns(0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
        let aside = |x: f64, y: f64| {
            let turn = turns(x, y) - middle;
            turn - turn.round()
        };
        let [low, high] = range(x.map(|x| y.map(|y| aside(x, y))));
        Self {
            steps,
            turn: (middle + low - ROUNDING).rem_euclid(1.0),
            width: high - low + 2.0 * ROUNDING,
        }
    }
}

/// The least and the greatest of four numbers.
fn range(numbers: [[f64; 2]; 2]) -> [f64; 2] {
    let all = numbers.as_flattened().iter().copied();
    [
        all.clone().fold(f64::INFINITY, f64::min),
        all.fold(f64::NEG_INFINITY, f64::max),
    ]
}

impl Lows {
    fn of(slice: &Grid) -> Self {
        let azimuths = slice.azimuths();
        let mut lows = Vec::with_capacity(azimuths * RADII);
        for j in 0..azimuths {
            lows.extend((0..RADII).map(|step| slice.least(j, [step, step + 1].map(|k| k as f64 / PER_UNIT))));
        }
        Self { azimuths, lows }
    }

    /// The least value within a region.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "turns are not negative"
    )]
    fn within(&self, region: &Region) -> f64 {
        let [first, last] =
            [region.turn, region.turn + region.width].map(|turn| (turn * self.azimuths as f64) as usize);
        let [near, far] = region.steps;
        let row = |j: usize| &self.lows[j % self.azimuths * RADII..][near..=far];
        let all = (first..=last.min(first + self.azimuths - 1)).flat_map(row);
        all.copied().fold(f64::INFINITY, f64::min)
    }
}
