//! What f of a table is at least, over ranges of incidence and of scattered directions.
//!
//! Incident and scattered directions are both cut into rings about the normal of a degree and a half each. A scattered ring is cut
//! into sectors; while the incidence moves through its ring, the place of a sector in the slices of the table, which move
//! with β₀, stays within a range of distances and azimuths. There f is linear between nodes of the grid in both: it is least at
//! a node, or at the edge of the range.

use std::f64::consts::FRAC_1_PI;

use etendue_math::trig::sin_cos_turns;

use super::table_grid::Grid;
use super::table_lobes::{Lobe, turns};

/// Rings from the normal to the horizon.
pub(super) const RINGS: usize = 64;

/// Sectors of a ring: a multiple of 4, so that sines and cosines rise or fall throughout each.
const SECTORS: usize = 128;

/// Steps of the azimuth and of |β − β₀|, which goes up to 2, for which the least values of a slice are kept.
const TURNS: usize = 128;
const RADII: usize = 256;

/// Such steps in a unit of |β − β₀|.
const PER_UNIT: f64 = 0.5 * RADII as f64;

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

/// The least values of a slice, by steps of the azimuth and of the distance.
struct Lows(Vec<[f64; RADII]>);

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
    for (first, factors) in lobe.factors(sines) {
        for number in (first..lows.len()).take(2) {
            by_slice[number].get_or_insert_with(|| regions.iter().map(|region| lows[number].within(region)).collect());
        }
        let low = |number: usize, k: usize| {
            by_slice
                .get(number)
                .and_then(Option::as_ref)
                .map_or(0.0, |there| there[k])
        };
        for (ring, least) in least.iter_mut().enumerate() {
            for k in ring * SECTORS..(ring + 1) * SECTORS {
                // Linear in the sine from one end to the other.
                let [one, other] = [low(first, k), low(first + 1, k)];
                let f = factors.map(|[a, b, floor]| a * one + b * other + floor * FRAC_1_PI);
                *least = least.min(f[0]).min(f[1]);
            }
        }
    }
    least.map(|f| f.max(0.0))
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
        let each = |step: usize| {
            let [from, to] = [step, step + 1].map(|k| k as f64 / TURNS as f64);
            let nodes = (0..slice.azimuths()).map(|j| j as f64 / slice.azimuths() as f64);
            let inside = nodes.filter(|turn| from < *turn && *turn < to);
            let lows = inside.chain([from, to]).map(|turn| lows_along(slice, turn));
            lows.fold([f64::INFINITY; RADII], |all, lows| {
                std::array::from_fn(|k| all[k].min(lows[k]))
            })
        };
        Self((0..TURNS).map(each).collect())
    }

    /// The least value within a region.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "turns are not negative"
    )]
    fn within(&self, region: &Region) -> f64 {
        let [first, last] = [region.turn, region.turn + region.width].map(|turn| (turn * TURNS as f64) as usize);
        let [near, far] = region.steps;
        let all = (first..=last.min(first + TURNS - 1)).flat_map(|step| &self.0[step % TURNS][near..=far]);
        all.copied().fold(f64::INFINITY, f64::min)
    }
}

/// The least values along an azimuth, by steps of the distance.
fn lows_along(slice: &Grid, turn: f64) -> [f64; RADII] {
    let (radial, f) = (slice.radial(), slice.along(turn));
    let mut lows = [f64::INFINITY; RADII];
    let mut i = 0;
    let mut last = f[0];
    for (k, low) in lows.iter_mut().enumerate() {
        let end = (k + 1) as f64 / PER_UNIT;
        *low = last;
        while i + 2 < radial.len() && radial[i + 1] <= end {
            i += 1;
            *low = low.min(f[i]);
        }
        let part = ((end - radial[i]) / (radial[i + 1] - radial[i])).min(1.0);
        last = f[i] + part * (f[i + 1] - f[i]);
        *low = low.min(last);
    }
    lows
}
