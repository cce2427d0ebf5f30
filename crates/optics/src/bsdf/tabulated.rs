//! A table of scattered light by direction: measured, or made of a model.
//!
//! **What is stored.** For each way (reflected, transmitted) and each azimuth and angle of incidence a *slice*: f on a polar
//! grid about the specular direction in the plane of direction cosines, |β − β₀| and azimuth from the direction of β₀; a
//! Lambertian floor apart from it; and the share of the flux of each.
//!
//! **In between.** At an angle of incidence between two slices both are moved with β₀ and added by their distance; the sum is
//! scaled to the share there, a monotone cubic in β₀² through the shares of the slices `[Fritsch1984]`. Slices that are far
//! apart get others in between, ln f being linear in the angle of incidence. Beyond the first and the last angle the nearest
//! slice moves on unchanged, and what leaves the unit circle of direction cosines is absorbed.
//!
//! **Drawing** is exact: a slice by its share, a point of its grid by the inverse of its distribution in the plane of direction
//! cosines, where area is projected solid angle, and again if the point lies outside the unit circle.

use std::f64::consts::{FRAC_1_PI, TAU};

use etendue_math::Vec3;
use etendue_math::special::{exp, ln};
use etendue_math::trig::{atan_eighths, sin_cos_turns};
use etendue_sampling::warp::part_of;

use super::contract::{Bsdf, Facts, Media, Shares, by_cosine};
use etendue_sampling::more_numbers::MoreNumbers;

/// f on a polar grid in the plane of direction cosines.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// |β₀|: the sine of the angle of incidence.
    pub sine: f64,
    /// |β − β₀|, rising from 0.
    pub radial: Vec<f64>,
    /// How many azimuths, evenly spaced from 0.
    pub azimuths: usize,
    /// f \[1/sr\], azimuth by azimuth; constant beyond the last radial coordinate.
    pub f: Vec<f64>,
    /// Share of the flux at this incidence, without the floor.
    pub share: f64,
    /// Share of the flux that is Lambertian.
    pub floor: f64,
}

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

/// Tables of light that meets one side: reflected and transmitted, by wavelength \[nm\].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Side {
    /// Rising wavelengths, each with the tables of both ways; empty: everything is absorbed.
    pub sheets: Vec<(f64, [Option<Way>; 2])>,
}

/// A table of scattered light.
#[derive(Clone, Debug)]
pub struct Tabulated {
    sides: [Vec<(f64, [Option<Lobes>; 2])>; 2],
    facts: Facts,
}

/// One way of light, ready to be asked.
#[derive(Clone, Debug)]
struct Lobes {
    rows: Vec<Lobe>,
}

#[derive(Clone, Debug)]
struct Lobe {
    azimuth: f64,
    slices: Vec<Grid>,
    /// Sines of incidence, rising, between which what follows is linear.
    sines: Vec<f64>,
    blends: Vec<Blend>,
}

/// How light from an angle of incidence is shared by slices.
#[derive(Clone, Copy, Debug, Default)]
struct Blend {
    /// The first of the two slices from here to the next sine; the other one follows it.
    first: usize,
    /// Of the flux, in each of the two and in the floor.
    shares: [f64; 3],
    /// What f of each of the two slices is multiplied by.
    factors: [f64; 2],
}

/// A slice with its integrals.
#[derive(Clone, Debug)]
struct Grid {
    sine: f64,
    radial: Vec<f64>,
    azimuths: usize,
    f: Vec<f64>,
    /// ∫ f r dr from 0 to each radial coordinate and, last, to the end of the plane.
    cumulative: Vec<f64>,
    /// Running sum over the sectors between azimuths, of the whole plane.
    sectors: Vec<f64>,
}

/// Farthest |β − β₀|.
const END: f64 = 2.0;

/// What interpolated shares may be off.
const TOLERANCE: f64 = 5e-6;

/// The smallest step of the sine of incidence for which shares are tabled.
const SMALLEST_STEP: f64 = 1e-4;

impl Tabulated {
    /// # Errors
    /// What is wrong with the tables.
    pub fn new(front: &Side, back: &Side) -> Result<Self, String> {
        let sides = [front, back].map(Side::lobes);
        let [front, back] = sides;
        let sides = [front?, back?];
        let diffuse = [0, 1].map(|way| sides.iter().flatten().any(|(_, ways)| ways[way].is_some()));
        Ok(Self {
            sides,
            facts: Facts {
                specular: [false; 2],
                diffuse,
                lambertian: false,
                reciprocal: false,
                constant: None,
                fresnel: false,
            },
        })
    }

    /// The tables next to a wavelength, each with its part.
    fn sheets(&self, front: bool, wavelength: f64) -> [(&[Option<Lobes>; 2], f64); 2] {
        const NONE: &[Option<Lobes>; 2] = &[None, None];
        let side = &self.sides[usize::from(!front)];
        let above = side.partition_point(|(at, _)| *at <= wavelength);
        match (above.checked_sub(1), side.get(above)) {
            (None, None) => [(NONE, 0.0); 2],
            (None, Some((_, only))) => [(only, 1.0), (NONE, 0.0)],
            (Some(last), None) => [(&side[last].1, 1.0), (NONE, 0.0)],
            (Some(below), Some((upper, next))) => {
                let (lower, this) = &side[below];
                let part = (wavelength - lower) / (upper - lower);
                [(this, 1.0 - part), (next, part)]
            }
        }
    }

    /// The lobes of one way next to a wavelength.
    fn ways(&self, front: bool, transmitted: bool, wavelength: f64) -> impl Iterator<Item = (&Lobes, f64)> {
        let sheets = self.sheets(front, wavelength);
        let both = sheets.into_iter().filter(|(_, part)| *part > 0.0);
        both.filter_map(move |(ways, part)| ways[usize::from(transmitted)].as_ref().map(|lobes| (lobes, part)))
    }
}

impl Side {
    #[allow(clippy::type_complexity, reason = "the same as in the field")]
    fn lobes(&self) -> Result<Vec<(f64, [Option<Lobes>; 2])>, String> {
        if self
            .sheets
            .windows(2)
            .any(|pair| pair[0].0.partial_cmp(&pair[1].0) != Some(std::cmp::Ordering::Less))
        {
            return Err("wavelengths do not rise".into());
        }
        let sheet = |(wavelength, ways): &(f64, [Option<Way>; 2])| {
            let [a, b] = ways.each_ref().map(|way| way.as_ref().map(Way::lobes).transpose());
            Ok((*wavelength, [a?, b?]))
        };
        self.sheets.iter().map(sheet).collect()
    }
}

impl Way {
    fn lobes(&self) -> Result<Lobes, String> {
        if self.rows.is_empty() || self.rows.windows(2).any(|pair| pair[0].azimuth >= pair[1].azimuth) {
            return Err("azimuths of incidence do not rise".into());
        }
        if self.rows.iter().any(|row| !(0.0..1.0).contains(&row.azimuth)) {
            return Err("an azimuth of incidence lies outside a turn".into());
        }
        let rows: Result<_, _> = self.rows.iter().map(Row::lobe).collect();
        Ok(Lobes { rows: rows? })
    }
}

impl Row {
    fn lobe(&self) -> Result<Lobe, String> {
        let sines: Vec<f64> = self.slices.iter().map(|slice| slice.sine).collect();
        if sines.is_empty() || sines.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err("angles of incidence do not rise".into());
        }
        let mut slices: Vec<Grid> = Vec::new();
        for (k, slice) in self.slices.iter().enumerate() {
            if let Some(before) = k.checked_sub(1).map(|before| &self.slices[before]) {
                for between in before.up_to(slice) {
                    slices.push(between.grid()?);
                }
            }
            slices.push(slice.grid()?);
        }
        let squares: Vec<f64> = sines.iter().map(|sine| sine * sine).collect();
        let of = |pick: fn(&Slice) -> f64| Cubic::new(&squares, &self.slices.iter().map(pick).collect::<Vec<_>>());
        let mut lobe = Lobe {
            azimuth: self.azimuth,
            slices,
            sines: Vec::new(),
            blends: Vec::new(),
        };
        lobe.fill(&of(|slice| slice.share), &of(|slice| slice.floor));
        Ok(lobe)
    }
}

/// Slices in between are made for steps of incidence of this size \[rad\] at most.
const STEP: f64 = 0.0875;

/// What is added to f before its logarithm is taken, relative to the largest f.
const LITTLE: f64 = 1e-6;

impl Slice {
    /// Slices between this incidence and another one, close to each other: the logarithm of f is linear in the angle of incidence, so
    /// that a lobe that grows and narrows stays one lobe.
    ///
    /// None where the grids differ in azimuths.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 18 steps"
    )]
    fn up_to(&self, other: &Self) -> Vec<Self> {
        let [from, to] = [self.sine, other.sine].map(|sine| sine.min(1.0).asin());
        let steps = ((to - from) / STEP).ceil() as usize;
        if self.azimuths != other.azimuths || self.radial.is_empty() || other.radial.is_empty() {
            return Vec::new();
        }
        let mut radial = [&self.radial[..], &other.radial[..]].concat();
        radial.sort_by(f64::total_cmp);
        radial.dedup();
        let [a, b] = [self, other].map(|slice| slice.on(&radial));
        let largest = a.iter().chain(&b).copied().fold(0.0, f64::max);
        let little = (LITTLE * largest).max(f64::MIN_POSITIVE);
        (1..steps)
            .map(|k| {
                let part = k as f64 / steps as f64;
                let mean = |(a, b): (&f64, &f64)| {
                    (exp((1.0 - part) * ln(a + little) + part * ln(b + little)) - little).max(0.0)
                };
                Self {
                    sine: (from + part * (to - from)).sin(),
                    radial: radial.clone(),
                    azimuths: self.azimuths,
                    f: a.iter().zip(&b).map(mean).collect(),
                    share: 0.0,
                    floor: 0.0,
                }
            })
            .collect()
    }

    /// f on other radial coordinates.
    fn on(&self, radial: &[f64]) -> Vec<f64> {
        let n = self.radial.len();
        let along = |row: &[f64]| -> Vec<f64> {
            let at = |r: &f64| {
                let i = self.radial.partition_point(|x| x <= r).max(1) - 1;
                let next = (i + 1).min(n - 1);
                if next == i {
                    return row[i];
                }
                row[i] + (row[next] - row[i]) * (r - self.radial[i]) / (self.radial[next] - self.radial[i])
            };
            radial.iter().map(at).collect()
        };
        self.f.chunks(n).flat_map(along).collect()
    }

    fn grid(&self) -> Result<Grid, String> {
        let Self {
            radial, azimuths, f, ..
        } = self;
        let rises = radial.windows(2).all(|pair| pair[0] < pair[1]);
        if radial.first() != Some(&0.0) || !rises || radial[radial.len() - 1] > END {
            return Err("radial coordinates do not rise from 0 to 2 at most".into());
        }
        if *azimuths == 0 || f.len() != azimuths * radial.len() {
            return Err("values of a slice do not fit its grid".into());
        }
        if !f.iter().all(|value| value.is_finite() && *value >= 0.0) {
            return Err("a value of f is negative or not finite".into());
        }
        if !(0.0..=1.0).contains(&self.sine) {
            return Err("a sine of incidence is not from 0 to 1".into());
        }
        if !(self.share >= 0.0 && self.floor >= 0.0 && self.share + self.floor <= 1.0 + 1e-9) {
            return Err(format!("{} of the flux leaves", self.share + self.floor));
        }
        let n = radial.len();
        let mut cumulative = Vec::with_capacity(azimuths * (n + 1));
        for row in f.chunks(n) {
            let mut sum = 0.0;
            cumulative.push(sum);
            for i in 1..n {
                sum += moment(radial[i - 1], radial[i], row[i - 1], row[i], radial[i]);
                cumulative.push(sum);
            }
            cumulative.push(sum + row[n - 1] * 0.5 * (END * END - radial[n - 1] * radial[n - 1]));
        }
        let mut grid = Grid {
            sine: self.sine,
            radial: radial.clone(),
            azimuths: *azimuths,
            f: f.clone(),
            cumulative,
            sectors: Vec::new(),
        };
        let mut sum = 0.0;
        for j in 0..*azimuths {
            sum += 0.5 * (grid.whole(j) + grid.whole((j + 1) % azimuths)) * TAU / *azimuths as f64;
            grid.sectors.push(sum);
        }
        Ok(grid)
    }
}

/// ∫ g r dr from `a` to `x`, g being linear from `(a, ga)` to `(b, gb)`.
fn moment(a: f64, b: f64, ga: f64, gb: f64, x: f64) -> f64 {
    let slope = (gb - ga) / (b - a);
    let h = x - a;
    // r = a + t: ∫ (ga + slope t)(a + t) dt.
    h * (ga * a + h * (0.5 * (ga + slope * a) + h * slope / 3.0))
}

impl Grid {
    /// ∫ f r dr along an azimuth, all over the plane.
    fn whole(&self, j: usize) -> f64 {
        self.cumulative[(j + 1) * (self.radial.len() + 1) - 1]
    }

    /// ∫ f r dr along an azimuth up to `r`.
    fn up_to(&self, j: usize, i: usize, r: f64) -> f64 {
        let n = self.radial.len();
        let before = self.cumulative[j * (n + 1) + i];
        let row = &self.f[j * n..(j + 1) * n];
        if i + 1 < n {
            before + moment(self.radial[i], self.radial[i + 1], row[i], row[i + 1], r)
        } else {
            before + row[i] * 0.5 * (r * r - self.radial[i] * self.radial[i])
        }
    }

    /// The last radial coordinate not above `r`.
    fn below(&self, r: f64) -> usize {
        self.radial.partition_point(|x| *x <= r).max(1) - 1
    }

    /// f at a distance from β₀ and an azimuth \[turns\].
    fn at(&self, r: f64, turn: f64) -> f64 {
        let (n, i) = (self.radial.len(), self.below(r));
        let next = (i + 1).min(n - 1);
        let u = if next > i {
            (r - self.radial[i]) / (self.radial[next] - self.radial[i])
        } else {
            0.0
        };
        let (j, k, v) = self.around(turn);
        let along = |j: usize| {
            let row = &self.f[j * n..(j + 1) * n];
            row[i] + u * (row[next] - row[i])
        };
        let (near, far) = (along(j), along(k));
        near + v * (far - near)
    }

    /// The azimuths on both sides of one, and how far on it is.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a turn is from 0 to 1, and there are fewer azimuths than numbers"
    )]
    fn around(&self, turn: f64) -> (usize, usize, f64) {
        let place = turn * self.azimuths as f64;
        let j = (place as usize).min(self.azimuths - 1);
        (j, (j + 1) % self.azimuths, place - j as f64)
    }

    /// The integral over the unit circle about −β₀.
    fn integral(&self, sine: f64) -> f64 {
        // Gauss and Legendre, in parts of at most 5°; finer towards grazing incidence, where the circle is all on one side.
        const NODES: [(f64, f64); 2] = [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];
        let parts = 72_usize.div_ceil(self.azimuths) * if sine > 0.9 { 4 } else { 1 };
        let mut sum = 0.0;
        for j in 0..self.azimuths {
            let k = (j + 1) % self.azimuths;
            for part in 0..parts {
                for (node, weight) in NODES {
                    let v = (part as f64 + node) / parts as f64;
                    let (s, c) = sin_cos_turns((j as f64 + v) / self.azimuths as f64);
                    let r = rim(sine, s, c);
                    let i = self.below(r);
                    let (near, far) = (self.up_to(j, i, r), self.up_to(k, i, r));
                    sum += weight / parts as f64 * (near + v * (far - near));
                }
            }
        }
        sum * TAU / self.azimuths as f64
    }

    /// A point of the plane with density f over its integral: distance and azimuth \[turns\].
    fn draw(&self, numbers: [f64; 2]) -> (f64, f64) {
        let all = self.sectors[self.azimuths - 1];
        let wanted = numbers[1] * all;
        let j = self
            .sectors
            .partition_point(|sum| *sum <= wanted)
            .min(self.azimuths - 1);
        let before = if j == 0 { 0.0 } else { self.sectors[j - 1] };
        let k = (j + 1) % self.azimuths;
        let (near, far) = (self.whole(j), self.whole(k));
        // Within the sector the density is linear from one azimuth to the next.
        let v = of_linear(part_of(wanted - before, self.sectors[j] - before), near, far);
        // There it is a mixture of those along both azimuths.
        let far_part = v * far;
        let share = far_part / ((1.0 - v) * near + far_part);
        let (row, number) = if numbers[0] < share {
            (k, part_of(numbers[0], share))
        } else {
            (j, part_of(numbers[0] - share, 1.0 - share))
        };
        (self.draw_along(row, number), (j as f64 + v) / self.azimuths as f64)
    }

    /// A distance along an azimuth, with density f r.
    fn draw_along(&self, j: usize, number: f64) -> f64 {
        let n = self.radial.len();
        let sums = &self.cumulative[j * (n + 1)..(j + 1) * (n + 1)];
        let wanted = number * sums[n];
        let i = (sums.partition_point(|sum| *sum <= wanted).max(1) - 1).min(n - 1);
        let (mut low, mut high) = (self.radial[i], if i + 1 < n { self.radial[i + 1] } else { END });
        let row = &self.f[j * n..(j + 1) * n];
        let (f0, f1) = (row[i], row[(i + 1).min(n - 1)]);
        let (start, width) = (low, high - low);
        let slope = if i + 1 < n { (f1 - f0) / width } else { 0.0 };
        // Newton's method, kept between ends that close in.
        let mut r = low + width * part_of(wanted - sums[i], sums[i + 1] - sums[i]);
        for _ in 0..60 {
            let off = self.up_to(j, i, r) - wanted;
            if off > 0.0 {
                high = r;
            } else {
                low = r;
            }
            let density = (f0 + slope * (r - start)) * r;
            let next = r - off / density;
            let next = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
            if (next - r).abs() <= 1e-14 * END {
                return next;
            }
            r = next;
        }
        r
    }
}

/// The number from 0 to 1 below which lies a part of a density that is linear from `a` to `b`.
fn of_linear(part: f64, a: f64, b: f64) -> f64 {
    let root = (a * a + part * (b * b - a * a)).max(0.0).sqrt();
    let below = a + root;
    if below > 0.0 {
        (part * (a + b) / below).min(1.0)
    } else {
        part
    }
}

/// How far the unit circle is from β₀ along an azimuth of this sine and cosine.
fn rim(sine: f64, s: f64, c: f64) -> f64 {
    let across = sine * s;
    let half = ((1.0 - across) * (1.0 + across)).max(0.0).sqrt();
    // The difference without cancellation, where β₀ lies near the rim.
    let along = sine * c;
    if along > 0.0 {
        ((1.0 - sine) * (1.0 + sine)) / (half + along)
    } else {
        half - along
    }
}

impl Lobe {
    /// Tables how light is shared, in steps that are halved until everything is linear within them.
    fn fill(&mut self, share: &Cubic, floor: &Cubic) {
        let slices = std::mem::take(&mut self.slices);
        let count = slices.len();
        // From 0 to the first slice, from each to the next, from the last to 1.
        let mut ends: Vec<f64> = slices.iter().map(|grid| grid.sine).collect();
        ends.insert(0, 0.0);
        ends.push(1.0);
        for (k, pair) in ends.windows(2).enumerate() {
            let [from, to] = [pair[0], pair[1]];
            if from >= to {
                continue;
            }
            let beyond = k == 0 || k == count;
            let first = k.saturating_sub(1).min(count - 1);
            let own = slices[first].integral(slices[first].sine);
            let at = |sine: f64| {
                let square = sine * sine;
                let (rho, floor) = (share.at(square), floor.at(square));
                let (shares, factors) = if beyond {
                    // The slice moves on unchanged.
                    let factor = if own > 0.0 { rho / own } else { 0.0 };
                    ([factor * slices[first].integral(sine), 0.0], [factor, 0.0])
                } else {
                    let part = (sine - from) / (to - from);
                    let energies = [slices[first].integral(sine), slices[first + 1].integral(sine)];
                    let all = (1.0 - part) * energies[0] + part * energies[1];
                    let factor = if all > 0.0 { rho / all } else { 0.0 };
                    let factors = [factor * (1.0 - part), factor * part];
                    ([factors[0] * energies[0], factors[1] * energies[1]], factors)
                };
                Blend {
                    first,
                    shares: [shares[0], shares[1], floor],
                    factors,
                }
            };
            let mut last = (from, at(from));
            self.push(last);
            let mut left: Vec<_> = (1..=4)
                .rev()
                .map(|i| from + (to - from) * f64::from(i) / 4.0)
                .map(|sine| (sine, at(sine)))
                .collect();
            while let Some(next) = left.pop() {
                let sine = 0.5 * (last.0 + next.0);
                let middle = (sine, at(sine));
                if next.0 - last.0 < SMALLEST_STEP || middle.1.is_between(&last.1, &next.1) {
                    self.push(middle);
                    self.push(next);
                    last = next;
                } else {
                    left.push(next);
                    left.push(middle);
                }
            }
        }
        self.slices = slices;
    }

    fn push(&mut self, (sine, blend): (f64, Blend)) {
        self.sines.push(sine);
        self.blends.push(blend);
    }

    fn blend(&self, sine: f64) -> Blend {
        let above = self
            .sines
            .partition_point(|node| *node <= sine)
            .clamp(1, self.sines.len() - 1);
        let (a, b) = (&self.blends[above - 1], &self.blends[above]);
        let [from, to] = [self.sines[above - 1], self.sines[above]];
        let part = if to > from {
            ((sine - from) / (to - from)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        a.towards(b, part)
    }
}

impl Blend {
    fn towards(&self, other: &Self, part: f64) -> Self {
        let mean = |a: f64, b: f64| a + part * (b - a);
        Self {
            first: self.first,
            shares: std::array::from_fn(|k| mean(self.shares[k], other.shares[k])),
            factors: std::array::from_fn(|k| mean(self.factors[k], other.factors[k])),
        }
    }

    /// Whether it is what lies halfway between two others, for all that anybody can see.
    fn is_between(&self, one: &Self, other: &Self) -> bool {
        let middle = one.towards(other, 0.5);
        let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= TOLERANCE * scale;
        let shares = self.shares.iter().zip(middle.shares);
        let scale = self.factors[0].abs() + self.factors[1].abs();
        let factors = self.factors.iter().zip(middle.factors);
        shares.into_iter().all(|(a, b)| near(*a, b, 1.0)) && factors.into_iter().all(|(a, b)| near(*a, b, scale))
    }

    fn share(&self) -> f64 {
        self.shares.iter().sum()
    }
}

impl Lobes {
    /// The rows next to an azimuth of incidence, each with its part.
    fn rows(&self, turn: f64) -> [(&Lobe, f64); 2] {
        let n = self.rows.len();
        if n == 1 {
            return [(&self.rows[0], 1.0), (&self.rows[0], 0.0)];
        }
        let above = self.rows.partition_point(|row| row.azimuth <= turn);
        let (one, other) = (&self.rows[(above + n - 1) % n], &self.rows[above % n]);
        let span = (other.azimuth - one.azimuth).rem_euclid(1.0);
        let part = (turn - one.azimuth).rem_euclid(1.0) / if span > 0.0 { span } else { 1.0 };
        [(one, 1.0 - part), (other, part)]
    }

    fn share(&self, incidence: &Incidence) -> f64 {
        let rows = self.rows(incidence.turn).into_iter().filter(|(_, part)| *part > 0.0);
        rows.fold(0.0, |sum, (row, part)| sum + part * row.blend(incidence.sine).share())
    }

    /// f for light that leaves towards a point of the plane of direction cosines.
    fn evaluate(&self, incidence: &Incidence, r: f64, turn: f64) -> f64 {
        let mut sum = 0.0;
        for (row, part) in self.rows(incidence.turn).into_iter().filter(|(_, part)| *part > 0.0) {
            let blend = row.blend(incidence.sine);
            let mut here = blend.shares[2] * FRAC_1_PI;
            for (k, factor) in blend
                .factors
                .into_iter()
                .enumerate()
                .filter(|(_, factor)| *factor > 0.0)
            {
                here += factor * row.slices[blend.first + k].at(r, turn);
            }
            sum += part * here;
        }
        sum
    }

    /// A slice or a floor (None), picked by its share, with what is left of the number.
    fn pick(&self, incidence: &Incidence, number: f64) -> (Option<&Grid>, f64) {
        let rows = self.rows(incidence.turn);
        let blends = rows.map(|(row, part)| (row, part, row.blend(incidence.sine)));
        let all: f64 = blends.iter().map(|(_, part, blend)| part * blend.share()).sum();
        let mut left = number * all;
        let mut last = (None, number);
        for (row, part, blend) in &blends {
            for (k, share) in blend.shares.iter().enumerate() {
                let share = part * share;
                if share > 0.0 {
                    last = (row.slices.get(blend.first + k).filter(|_| k < 2), part_of(left, share));
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
struct Incidence {
    /// Of the angle of incidence.
    sine: f64,
    /// Azimuth of the incident direction.
    turn: f64,
    /// Cosine and sine of the azimuth of β₀.
    forward: [f64; 2],
}

impl Incidence {
    fn new(incident: Vec3) -> Self {
        let sine = (incident.x * incident.x + incident.y * incident.y).sqrt();
        let forward = if sine > 0.0 {
            [-incident.x / sine, -incident.y / sine]
        } else {
            [-1.0, 0.0]
        };
        Self {
            sine: sine.min(1.0),
            turn: turns(-forward[0], -forward[1]),
            forward,
        }
    }

    /// Distance from β₀ and azimuth about it \[turns\] of a scattered direction.
    fn place(&self, incident: Vec3, scattered: Vec3) -> (f64, f64) {
        let (x, y) = (scattered.x + incident.x, scattered.y + incident.y);
        let [c, s] = self.forward;
        let (along, across) = (c * x + s * y, c * y - s * x);
        ((x * x + y * y).sqrt(), turns(along, across))
    }

    /// The direction at a place, with this height's sign; None outside the unit circle.
    fn direction(&self, incident: Vec3, (r, turn): (f64, f64), up: bool) -> Option<Vec3> {
        let [c, s] = self.forward;
        let (sin, cos) = sin_cos_turns(turn);
        let (along, across) = (r * cos, r * sin);
        let x = c * along - s * across - incident.x;
        let y = s * along + c * across - incident.y;
        let square = 1.0 - x * x - y * y;
        (square > 0.0).then(|| Vec3::new(x, y, if up { square.sqrt() } else { -square.sqrt() }))
    }
}

/// The azimuth of a point \[turns\], from 0 to 1.
fn turns(x: f64, y: f64) -> f64 {
    if x == 0.0 && y == 0.0 {
        return 0.0;
    }
    let steep = y.abs() > x.abs();
    let angle = if steep {
        let right = atan_eighths(x / y);
        (if y > 0.0 { 2.0 } else { 6.0 }) - right
    } else {
        let right = atan_eighths(y / x);
        (if x > 0.0 { 0.0 } else { 4.0 }) + right
    };
    let turn = angle / 8.0;
    let turn = if turn < 0.0 { turn + 1.0 } else { turn };
    if turn >= 1.0 { 0.0 } else { turn }
}

/// How often is tried again for a point within the unit circle.
const TRIES: u32 = 10_000;

impl Bsdf for Tabulated {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let incidence = Incidence::new(incident);
        let diffuse = [false, true].map(|transmitted| {
            let ways = self.ways(incident.z > 0.0, transmitted, media.wavelength);
            ways.fold(0.0, |sum, (lobes, part)| sum + part * lobes.share(&incidence))
        });
        Shares {
            specular: [0.0; 2],
            diffuse,
            refraction: incident.z.abs(),
        }
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        let incidence = Incidence::new(incident);
        let (r, turn) = incidence.place(incident, scattered);
        let front = incident.z > 0.0;
        let ways = self.ways(front, front != (scattered.z > 0.0), media.wavelength);
        ways.map(|(lobes, part)| part * lobes.evaluate(&incidence, r, turn))
            .sum()
    }

    fn draw(&self, incident: Vec3, transmitted: bool, media: &Media, numbers: [f64; 2]) -> Vec3 {
        let incidence = Incidence::new(incident);
        let up = (incident.z > 0.0) != transmitted;
        let ways = || self.ways(incident.z > 0.0, transmitted, media.wavelength);
        let all: f64 = ways().map(|(lobes, part)| part * lobes.share(&incidence)).sum();
        let mut left = numbers[0] * all;
        let mut picked = (None, numbers[0]);
        for (lobes, part) in ways() {
            let share = part * lobes.share(&incidence);
            picked = lobes.pick(&incidence, part_of(left, share));
            if left < share {
                break;
            }
            left -= share;
        }
        let (Some(grid), number) = picked else {
            return by_cosine(up, [picked.1, numbers[1]]);
        };
        let mut pair = [number, numbers[1]];
        let mut more = MoreNumbers::new(numbers);
        for _ in 0..TRIES {
            if let Some(d) = incidence.direction(incident, grid.draw(pair), up) {
                return d;
            }
            pair = more.pair();
        }
        by_cosine(up, numbers)
    }
}

/// A monotone cubic through points: between two of rising values it rises, and beyond the ends it is constant.
///
/// Slopes after `[Fritsch1984]`.
#[derive(Clone, Debug)]
struct Cubic {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
}

impl Cubic {
    fn new(x: &[f64], y: &[f64]) -> Self {
        let n = x.len();
        let h: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let d: Vec<f64> = y.windows(2).zip(&h).map(|(pair, h)| (pair[1] - pair[0]) / h).collect();
        let mut slope = vec![0.0; n];
        for k in 1..n.max(2) - 1 {
            if d[k - 1] * d[k] > 0.0 {
                let (w1, w2) = (2.0 * h[k] + h[k - 1], h[k] + 2.0 * h[k - 1]);
                slope[k] = (w1 + w2) / (w1 / d[k - 1] + w2 / d[k]);
            }
        }
        if n == 2 {
            slope = vec![d[0]; 2];
        } else if n > 2 {
            let end = |h0: f64, h1: f64, d0: f64, d1: f64| {
                let s = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
                if s * d0 <= 0.0 {
                    0.0
                } else if d0 * d1 <= 0.0 && s.abs() > 3.0 * d0.abs() {
                    3.0 * d0
                } else {
                    s
                }
            };
            slope[0] = end(h[0], h[1], d[0], d[1]);
            slope[n - 1] = end(h[n - 2], h[n - 3], d[n - 2], d[n - 3]);
        }
        Self {
            x: x.to_vec(),
            y: y.to_vec(),
            slope,
        }
    }

    fn at(&self, x: f64) -> f64 {
        let n = self.x.len();
        if x <= self.x[0] {
            return self.y[0];
        }
        if x >= self.x[n - 1] {
            return self.y[n - 1];
        }
        let k = self.x.partition_point(|node| *node <= x) - 1;
        let h = self.x[k + 1] - self.x[k];
        let t = (x - self.x[k]) / h;
        let (a, b) = (self.y[k], self.y[k + 1]);
        let s = t * t * (3.0 - 2.0 * t);
        let value = a + s * (b - a) + h * t * (1.0 - t) * ((1.0 - t) * self.slope[k] - t * self.slope[k + 1]);
        value.clamp(a.min(b), a.max(b))
    }
}

#[cfg(test)]
impl super::contract::Examples for Tabulated {
    // f has kinks at the nodes of each slice. A quadrature of 16 times the steps leaves 4e-6.
    const QUADRATURE: f64 = 2e-4;

    fn examples() -> Vec<Self> {
        let lobe = |width: f64, skew: f64, sine: f64, share: f64, floor: f64| {
            let radial: Vec<f64> = (0..24).map(|i| 2.0 * (f64::from(i) / 23.0).powi(2)).collect();
            let azimuths = 12;
            let mut f = Vec::new();
            for j in 0..azimuths {
                let turn = f64::from(j) / f64::from(azimuths);
                let stretch = 1.0 + skew * (TAU * turn).cos() + 0.5 * skew * (TAU * turn).sin();
                f.extend(radial.iter().map(|r| (-0.5 * (r / (width * stretch)).powi(2)).exp()));
            }
            Slice {
                sine,
                radial,
                azimuths: 12,
                f,
                share,
                floor,
            }
        };
        let row = |azimuth: f64, k: f64| Row {
            azimuth,
            slices: vec![
                lobe(0.4, 0.2 * k, 0.0, 0.3, 0.2),
                lobe(0.5, -0.3 * k, 0.5, 0.35 * k, 0.25),
                lobe(0.3, 0.4 * k, 0.94, 0.5, 0.1 * k),
            ],
        };
        let side = |way: [Option<Way>; 2]| Side {
            sheets: vec![(500.0, way)],
        };
        let isotropic = Way {
            rows: vec![row(0.0, 1.0)],
        };
        let turned = Way {
            rows: vec![row(0.0, 0.5), row(0.3, 1.0), row(0.7, 0.7)],
        };
        let faint = Way {
            rows: vec![Row {
                azimuth: 0.0,
                slices: vec![lobe(0.6, 0.1, 0.3, 0.2, 0.0)],
            }],
        };
        let coloured = Side {
            sheets: vec![
                (450.0, [Some(isotropic.clone()), None]),
                (600.0, [Some(faint.clone()), Some(faint.clone())]),
            ],
        };
        let both = side([Some(turned), Some(faint)]);
        let one = side([Some(isotropic), None]);
        [(&one, &one), (&both, &one), (&coloured, &both)]
            .map(|(a, b)| Self::new(a, b).expect("sound"))
            .to_vec()
    }
}
