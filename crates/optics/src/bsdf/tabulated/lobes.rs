//! How the slices of a table of scattered light go together: between angles and azimuths of incidence.

use std::f64::consts::FRAC_1_PI;
use std::sync::Arc;

use etendue_math::Vec3;
use etendue_math::trig::{sin_cos_turns, turns_of};
use etendue_sampling::ordered::inside;
use etendue_sampling::warp::part_of;
use rayon::prelude::*;

use super::grid::Grid;
use super::slice::Slice;
use super::steps::{Step, Steps};
use crate::bsdf::monotone_cubic::Cubic;

/// Shares that should add up to 1 may fall short of it by as much as they are rounded; what reaches this is all of the light.
pub(super) const ALL: f64 = 1.0 - 1e-6;

/// Slices at one azimuth of incidence, with rising sines.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Azimuth of the incident direction \[turns\]; of one row it does not matter.
    pub azimuth: f64,
    /// At least one.
    pub slices: Vec<Slice>,
}

/// The table of one way of light, at one wavelength.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// Azimuths rise within a turn.
    pub rows: Vec<Row>,
}

/// One way of light, ready to be asked.
#[derive(Clone, Debug)]
pub(super) struct Lobes {
    rows: Vec<Lobe>,
}

#[derive(Clone, Debug)]
pub(super) struct Lobe {
    azimuth: f64,
    slices: Arc<[Grid]>,
    steps: Steps,
}

impl Way {
    pub(super) fn lobes(&self) -> Result<Lobes, String> {
        if self.rows.is_empty() || self.rows.windows(2).any(|pair| pair[0].azimuth >= pair[1].azimuth) {
            return Err("azimuths of incidence do not rise".into());
        }
        if self.rows.iter().any(|row| !(0.0..1.0).contains(&row.azimuth)) {
            return Err("an azimuth of incidence lies outside a turn".into());
        }
        // Side by side: a table by azimuth holds dozens. Of several mistakes the first is told.
        let rows: Vec<_> = if self.rows.len() == 1 {
            self.rows.iter().map(Row::lobe).collect()
        } else {
            inside(0, || self.rows.par_iter().map(Row::lobe).collect())
        };
        let rows: Result<_, _> = rows.into_iter().collect();
        Ok(Lobes { rows: rows? })
    }
}

impl Row {
    fn lobe(&self) -> Result<Lobe, String> {
        let sines: Vec<f64> = self.slices.iter().map(|slice| slice.sine).collect();
        if sines.is_empty() || sines.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err("angles of incidence do not rise".into());
        }
        let squares: Vec<f64> = sines.iter().map(|sine| sine * sine).collect();
        let of = |pick: fn(&Slice) -> f64| Cubic::new(&squares, &self.slices.iter().map(pick).collect::<Vec<_>>());
        let [share, base] = [of(|slice| slice.share), of(|slice| slice.base)];
        let mut between: Vec<Slice> = Vec::new();
        for (k, slice) in self.slices.iter().enumerate() {
            if let Some(before) = k.checked_sub(1).map(|before| &self.slices[before]) {
                between.extend(before.up_to(slice, |sine| base.at(sine * sine)));
            }
            between.push(slice.clone());
        }
        let grid = |k: usize| {
            // From the slice before to the one after.
            let from = k.checked_sub(1).map_or(0.0, |before| between[before].sine);
            let to = between.get(k + 1).map_or(1.0, |after| after.sine);
            Grid::of(&between[k], Some([from, to]))
        };
        let slices: Vec<Grid> = (0..between.len()).map(grid).collect::<Result<_, String>>()?;
        let steps = Steps::of(&slices, &share, &base);
        Ok(Lobe {
            azimuth: self.azimuth,
            slices: slices.into(),
            steps,
        })
    }
}

impl Lobe {
    /// The place of the step for a sine.
    #[inline]
    pub(super) fn place(&self, sine: f64) -> u32 {
        self.steps.place(sine)
    }

    /// The first of two slices and the shares of both and of the base, in the step of a place.
    #[inline]
    pub(super) fn step(&self, place: u32) -> &Step {
        self.steps.shares(place)
    }

    /// The first of two slices, and the shares of both and of the base.
    #[inline]
    pub(super) fn shares(&self, sine: f64) -> (usize, [f64; 3]) {
        let step = self.step(self.place(sine));
        (step.first as usize, step.at(sine))
    }

    /// Of the flux, in all directions.
    #[inline]
    pub(super) fn share(&self, sine: f64) -> f64 {
        self.shares(sine).1.iter().sum::<f64>().min(1.0)
    }

    /// A slice, by its number.
    #[inline]
    pub(super) fn slice(&self, number: usize) -> &Grid {
        &self.slices[number]
    }

    /// f \[1/sr\] for light that leaves towards a point of the plane of direction cosines, where the base has this luminance.
    #[inline]
    pub(super) fn at(&self, sine: f64, (r, turn): (f64, f64), luminance: f64) -> f64 {
        let step = self.steps.factors(self.place(sine));
        let [one, other, base] = step.at(sine);
        let mut f = base * luminance * FRAC_1_PI;
        for (k, factor) in [one, other].into_iter().enumerate().filter(|(_, factor)| *factor > 0.0) {
            f += factor * self.slices[step.first as usize + k].at(r, turn);
        }
        f
    }

    /// A slice or the base (None), picked by its share, with what is left of a number that is less than the share of all, as a
    /// number from 0 to 1.
    #[inline]
    pub(super) fn pick(&self, (first, shares): (usize, [f64; 3]), mut left: f64) -> (Option<&Grid>, f64) {
        let mut last = (None, left);
        for (k, share) in shares.into_iter().enumerate().filter(|(_, share)| *share > 0.0) {
            last = (self.slices.get(first + k).filter(|_| k < 2), part_of(left, share));
            if left < share {
                break;
            }
            left -= share;
        }
        last
    }
}

impl Lobes {
    /// Without the base; None if there is nothing else.
    pub(super) fn without_base(&self) -> Option<Self> {
        let mut rows = self.rows.clone();
        for row in &mut rows {
            row.steps = row.steps.without_base();
        }
        let left = rows.iter().any(|row| row.steps.most() > 0.0);
        left.then_some(Self { rows })
    }

    /// Whether there is a base.
    pub(super) fn has_base(&self) -> bool {
        self.rows.iter().any(|row| row.steps.has_base())
    }

    /// The greatest share of the light.
    pub(super) fn most(&self) -> f64 {
        self.rows.iter().map(|row| row.steps.most()).fold(0.0, f64::max)
    }

    /// The only row, if there is one.
    pub(super) fn lone(&self) -> Option<&Lobe> {
        match &self.rows[..] {
            [lobe] => Some(lobe),
            _ => None,
        }
    }

    /// What light from one direction is shared by.
    pub(super) fn lit(&self, incidence: &Incidence) -> Lit<'_> {
        let n = self.rows.len();
        if n == 1 {
            return Lit::of(&self.rows[0], incidence);
        }
        let turn = incidence.turn();
        let above = self.rows.partition_point(|row| row.azimuth <= turn);
        let (one, other) = (&self.rows[(above + n - 1) % n], &self.rows[above % n]);
        let span = (other.azimuth - one.azimuth).rem_euclid(1.0);
        let part = (turn - one.azimuth).rem_euclid(1.0) / if span > 0.0 { span } else { 1.0 };
        Lit {
            sine: incidence.sine,
            parts: [(one, 1.0 - part), (other, part)],
        }
    }
}

/// What light from one direction is shared by: the rows next to its azimuth, each with its part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lit<'a> {
    sine: f64,
    parts: [(&'a Lobe, f64); 2],
}

impl<'a> Lit<'a> {
    /// Of a single row.
    const fn of(row: &'a Lobe, incidence: &Incidence) -> Self {
        Self {
            sine: incidence.sine,
            parts: [(row, 1.0), (row, 0.0)],
        }
    }

    fn there(&self) -> impl Iterator<Item = &(&'a Lobe, f64)> {
        self.parts.iter().filter(|(_, part)| *part > 0.0)
    }

    /// Of the flux, in all directions.
    pub(super) fn share(&self) -> f64 {
        self.there()
            .fold(0.0, |sum, (row, part)| sum + part * row.share(self.sine))
            .min(1.0)
    }

    /// Of the flux, in the base.
    pub(super) fn base(&self) -> f64 {
        self.there()
            .fold(0.0, |sum, (row, part)| sum + part * row.shares(self.sine).1[2])
    }

    /// f for light that leaves towards a point of the plane of direction cosines, where the base has this luminance.
    pub(super) fn at(&self, place: (f64, f64), luminance: f64) -> f64 {
        self.there()
            .fold(0.0, |sum, (row, part)| sum + part * row.at(self.sine, place, luminance))
    }

    /// A slice or the base (None), picked by its share, with what is left of the number.
    pub(super) fn pick(&self, number: f64) -> (Option<&'a Grid>, f64) {
        let mut left = number * self.share();
        let mut last = (None, number);
        for (row, part) in self.there() {
            let (first, shares) = row.shares(self.sine);
            for (k, share) in shares.iter().enumerate() {
                let share = part * share;
                if share > 0.0 {
                    last = (row.slices.get(first + k).filter(|_| k < 2), part_of(left, share));
                    if left < share {
                        return last;
                    }
                    left -= share;
                }
            }
        }
        last
    }
}

/// Where light comes from, as the tables are asked.
#[derive(Clone, Copy)]
pub(super) struct Incidence {
    /// Of the angle of incidence.
    pub(super) sine: f64,
    /// Cosine and sine of the azimuth of β₀.
    forward: [f64; 2],
}

impl Incidence {
    pub(super) fn new(incident: Vec3) -> Self {
        let sine = (incident.x * incident.x + incident.y * incident.y).sqrt();
        let forward = if sine > 0.0 {
            let scale = -1.0 / sine;
            [incident.x * scale, incident.y * scale]
        } else {
            [-1.0, 0.0]
        };
        Self {
            sine: sine.min(1.0),
            forward,
        }
    }

    /// Azimuth of the incident direction \[turns\].
    fn turn(&self) -> f64 {
        turns(-self.forward[0], -self.forward[1])
    }

    /// Distance from β₀ and azimuth about it \[turns\] of a scattered direction.
    pub(super) fn place(&self, incident: Vec3, scattered: Vec3) -> (f64, f64) {
        let (x, y) = (scattered.x + incident.x, scattered.y + incident.y);
        let [c, s] = self.forward;
        let (along, across) = (c * x + s * y, c * y - s * x);
        ((x * x + y * y).sqrt(), turns(along, across))
    }

    /// The direction at a place, with this height's sign; None outside the unit circle.
    pub(super) fn direction(&self, incident: Vec3, (r, turn): (f64, f64), up: bool) -> Option<Vec3> {
        let [c, s] = self.forward;
        let (sin, cos) = sin_cos_turns(turn);
        let (along, across) = (r * cos, r * sin);
        let x = c * along - s * across - incident.x;
        let y = s * along + c * across - incident.y;
        let square = 1.0 - x * x - y * y;
        (square > 0.0).then(|| Vec3::new(x, y, if up { square.sqrt() } else { -square.sqrt() }))
    }
}

/// The azimuth of a point \[turns\], from 0 to 1; 0 in the middle.
#[inline]
pub(super) fn turns(x: f64, y: f64) -> f64 {
    if x == 0.0 && y == 0.0 { 0.0 } else { turns_of(x, y) }
}
