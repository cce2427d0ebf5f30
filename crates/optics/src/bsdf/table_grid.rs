//! A slice of a table of scattered light: f on a polar grid, its integrals, and points drawn from it.

use std::f64::consts::{FRAC_1_PI, TAU};

use etendue_math::special::{exp, ln};
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::alias::{Alias, Slot};

use super::table_hats::Hat;

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
    /// Share of the flux at this incidence, without the base.
    pub share: f64,
    /// Share of the flux in the base.
    pub base: f64,
}

/// A slice that can be asked and drawn from.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub sine: f64,
    /// From 0 to the end of the plane.
    radial: Vec<f64>,
    azimuths: usize,
    /// f, azimuth by azimuth, at each radial coordinate, in single precision: values of a table are looked up all over it, and
    /// nearer memories hold twice as many; and how many azimuths are kept.
    f: Vec<f32>,
    rows: usize,
    size: Size,
    /// Of `f`, by what each value contributes to the integral over the plane; if that is 0, the first takes all. Of a slice whose
    /// sides are alike one half and what both contribute.
    nodes: Alias,
    /// Of the radial coordinates, by the leading bits of a number: coordinates rise by ratios.
    first_below: Vec<u16>,
    /// Leading bits of the second radial coordinate.
    lowest: u64,
}

/// How many there are of what a slice draws from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    pub radii: f64,
    pub azimuths: f64,
    /// Places in the table of nodes.
    pub places: f64,
    /// Halves that the table stands for: 2 where both sides of the plane of incidence are alike.
    pub halves: f64,
}

/// A slice with its integrals along each azimuth.
pub(super) struct Integrals<'a> {
    grid: &'a Grid,
    /// ∫ f r dr from 0, azimuth by azimuth, at each radial coordinate.
    sums: Vec<f64>,
    /// Sines and cosines at the nodes of the circle: of few parts between two azimuths, of many.
    circle: [Vec<(f64, f64)>; 2],
}

/// Gauss and Legendre's nodes and weights on the unit interval.
const NODES: [(f64, f64); 2] = [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];

/// Farthest |β − β₀|.
const END: f64 = 2.0;

/// Bits of a number that go when its exponent and four digits of its fraction are kept: sixteen steps for each doubling.
const SHIFT: u32 = 48;

/// The leading bits of a number that is not negative: they rise with it.
#[inline]
fn leading(x: f64) -> u64 {
    x.to_bits() >> SHIFT
}

/// Slices in between are made for steps of incidence of this size \[rad\] at most.
const STEP: f64 = 0.0875;

/// What is added to f before its logarithm is taken, relative to the largest f.
const LITTLE: f64 = 1e-6;

/// f that is nothing beside the largest one.
const NOTHING: f64 = 1e-9;

impl Slice {
    /// Slices between this incidence and another one, close to each other: the logarithm of f is linear in the angle of incidence, so
    /// that a lobe that grows and narrows stays one lobe. Where one of both has nothing, f is linear itself: a hole is no lobe. And what
    /// is little beside the base is nearly linear: it is the logarithm of all of the light, with a base of this share by the sine.
    ///
    /// None where the grids differ in azimuths.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 18 steps"
    )]
    pub(super) fn up_to(&self, other: &Self, base: impl Fn(f64) -> f64) -> Vec<Self> {
        let [from, to] = [self.sine, other.sine].map(|sine| sine.min(1.0).asin());
        let steps = ((to - from) / STEP).ceil() as usize;
        if self.azimuths != other.azimuths || self.radial.is_empty() || other.radial.is_empty() {
            return Vec::new();
        }
        // A lobe that does not change needs nothing in between.
        if self.radial == other.radial && self.f == other.f {
            return Vec::new();
        }
        let radial = finer(&self.radial, &other.radial);
        let [a, b] = [self, other].map(|slice| slice.on(&radial));
        let largest = a.iter().chain(&b).copied().fold(0.0, f64::max);
        let [little, nothing] = [LITTLE, NOTHING].map(|part| (part * largest).max(f64::MIN_POSITIVE));
        let below = |base: f64| little + base * FRAC_1_PI;
        let [under, under_other] = [self, other].map(|slice| below(slice.base));
        (1..steps)
            .map(|k| {
                let part = k as f64 / steps as f64;
                let sine = (from + part * (to - from)).sin();
                let there = below(base(sine));
                let mean = |(a, b): (&f64, &f64)| {
                    let all = exp((1.0 - part) * ln(a + under) + part * ln(b + under_other));
                    let geometric = (all - there).max(0.0);
                    let linear = (1.0 - part) * a + part * b;
                    let least = a.min(*b);
                    linear + (geometric - linear) * least / (least + nothing)
                };
                Self {
                    sine,
                    radial: radial.clone(),
                    azimuths: self.azimuths,
                    f: a.iter().zip(&b).map(mean).collect(),
                    share: 0.0,
                    base: 0.0,
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

    /// Ready to be asked; to be drawn from where sines of incidence lie between these, so that nodes beyond the unit circle are
    /// left out. None: in all of the plane.
    ///
    /// # Errors
    /// What is wrong with the slice.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "fewer than 2^16 radial coordinates; single precision is meant"
    )]
    pub(super) fn grid(&self, sines: Option<[f64; 2]>) -> Result<Grid, String> {
        let Self {
            radial, azimuths, f, ..
        } = self;
        let rises = radial.windows(2).all(|pair| pair[0] < pair[1]);
        if radial.first() != Some(&0.0) || !rises || radial[radial.len() - 1] > END {
            return Err("radial coordinates do not rise from 0 to 2 at most".into());
        }
        if radial.len() > usize::from(u16::MAX) {
            return Err("a slice has more than 65535 radial coordinates".into());
        }
        if *azimuths == 0 || f.len() != azimuths * radial.len() || i32::try_from(f.len()).is_err() {
            return Err("values of a slice do not fit its grid".into());
        }
        if !f.iter().all(|value| (0.0..=f64::from(f32::MAX)).contains(value)) {
            return Err("a value of f is not from 0 to 3.4e38".into());
        }
        if !(0.0..=1.0).contains(&self.sine) {
            return Err("a sine of incidence is not from 0 to 1".into());
        }
        if !(self.share >= 0.0 && self.base >= 0.0 && self.share + self.base <= 1.0 + 1e-9) {
            return Err(format!("{} of the flux leaves", self.share + self.base));
        }
        let mut all = radial.clone();
        if radial[radial.len() - 1] < END {
            all.push(END);
        }
        // Constant beyond the last of its coordinates.
        let on_all = |row: &[f64]| (0..all.len()).map(|i| row[i.min(row.len() - 1)]).collect::<Vec<f64>>();
        let f: Vec<f64> = f.chunks(radial.len()).flat_map(on_all).collect();
        let wholes: Vec<f64> = (0..all.len()).map(|i| Hat::of(&all, i).whole()).collect();
        let (nodes, halves, rows) =
            nodes_of(&all, *azimuths, &f, &wholes, sines).ok_or("a slice has too many values")?;
        let lowest = all.get(1).map_or(0, |r| leading(*r));
        let first_above = |bits: u64| all.partition_point(|r| *r < f64::from_bits(bits << SHIFT));
        Ok(Grid {
            sine: self.sine,
            azimuths: *azimuths,
            f: f[..rows * all.len()].iter().map(|f| *f as f32).collect(),
            rows,
            size: Size {
                radii: all.len() as f64,
                azimuths: *azimuths as f64,
                places: nodes.slots().len() as f64,
                halves,
            },
            nodes,
            first_below: (lowest..=leading(END))
                .map(|bits| first_above(bits).max(1) as u16 - 1)
                .collect(),
            lowest,
            radial: all,
        })
    }
}

/// The table of the nodes of a slice by what they contribute, the halves that it stands for, and how many azimuths are in it;
/// None: there are too many.
fn nodes_of(
    radial: &[f64],
    azimuths: usize,
    f: &[f64],
    wholes: &[f64],
    sines: Option<[f64; 2]>,
) -> Option<(Alias, f64, usize)> {
    let n = radial.len();
    let row = |j: usize| &f[j * n..(j + 1) * n];
    let other_side = |j: usize| if j == 0 { 0 } else { azimuths - j };
    let alike = azimuths > 2 && (1..=azimuths / 2).all(|j| row(j) == row(other_side(j)));
    let drawn = if alike { azimuths / 2 + 1 } else { azimuths };
    let weight = |node: usize| {
        let [j, i] = [node / n, node % n];
        if sines.is_some_and(|sines| !reaches_in(radial, azimuths, [j, i], sines)) {
            return 0.0;
        }
        let times = if alike && other_side(j) != j { 2.0 } else { 1.0 };
        times * f[node] * wholes[i]
    };
    let weights: Vec<f64> = (0..drawn * n).map(weight).collect();
    let nodes = Alias::new(&weights).or_else(|| Alias::new(&[1.0]))?;
    Some((nodes, if alike { 2.0 } else { 1.0 }, drawn))
}

/// Of two lists of radial coordinates that rise from 0 the finer one at each place, and the ends of both. All of both would be
/// twice as many, and nothing in either needs them.
fn finer(one: &[f64], other: &[f64]) -> Vec<f64> {
    /// By how much finer the other list has to be where both are alike.
    const CLEARLY: f64 = 1.05;
    // From the last coordinate that is not above a place to the next.
    let step = |radial: &[f64], r: f64| {
        let above = radial.partition_point(|x| *x <= r).max(1);
        radial.get(above).map_or(f64::INFINITY, |next| next - radial[above - 1])
    };
    let is_finer = |r: f64| CLEARLY * step(other, r) < step(one, r);
    let ends = [one, other].map(|radial| radial[radial.len() - 1]);
    let of_one = one.iter().filter(|r| ends.contains(r) || !is_finer(**r));
    let of_other = other.iter().filter(|r| ends.contains(r) || is_finer(**r));
    let mut radial: Vec<f64> = of_one.chain(of_other).copied().collect();
    radial.sort_by(f64::total_cmp);
    radial.dedup();
    radial
}

/// Whether the hats of a node, an azimuth and a radial coordinate, reach into the unit circle about −β₀ for any |β₀| of a range.
fn reaches_in(radial: &[f64], azimuths: usize, [j, i]: [usize; 2], [from, to]: [f64; 2]) -> bool {
    let [near, far] = [radial[i.saturating_sub(1)], radial[(i + 1).min(radial.len() - 1)]];
    // The azimuth of the hat that is farthest from the direction of β₀.
    let step = 1.0 / azimuths as f64;
    let turn = j as f64 * step;
    let cosine = if (turn - 0.5).abs() < step {
        -1.0
    } else {
        sin_cos_turns(turn - step).1.min(sin_cos_turns(turn + step).1)
    };
    // |β|² is convex in |β₀| and r: where it is least within a rectangle lies on its sides.
    let square = |sine: f64, r: f64| sine * sine + r * (2.0 * sine * cosine + r);
    let least = [from, to].map(|sine| square(sine, (-sine * cosine).clamp(near, far)));
    let sides = [near, far].map(|r| square((-r * cosine).clamp(from, to), r));
    least.into_iter().chain(sides).fold(f64::INFINITY, f64::min) < 1.0
}

/// ∫ g r dr from `a` to `x`, g being linear from `(a, ga)` to `(b, gb)`.
#[inline]
fn moment(a: f64, b: f64, ga: f64, gb: f64, x: f64) -> f64 {
    let slope = (gb - ga) / (b - a);
    let h = x - a;
    // r = a + t: ∫ (ga + slope t)(a + t) dt.
    h * (ga * a + h * (0.5 * (ga + slope * a) + h * slope / 3.0))
}

/// What is left of a number, less than 1, that one of so many halves is drawn by, and whether it is the second one.
#[inline(always)]
pub(super) fn half(number: f64, halves: f64) -> (f64, bool) {
    let scaled = number * halves;
    let other = scaled >= 1.0;
    (scaled - f64::from(u8::from(other)), other)
}

impl Grid {
    /// The azimuth after one.
    #[inline]
    const fn after(&self, j: usize) -> usize {
        if j + 1 == self.azimuths { 0 } else { j + 1 }
    }

    /// The azimuth whose values stand for those of an azimuth: where both sides are alike, those of one are kept.
    #[inline]
    const fn kept(&self, j: usize) -> usize {
        if j < self.rows { j } else { self.azimuths - j }
    }

    /// f along an azimuth.
    #[inline]
    fn row(&self, j: usize) -> &[f32] {
        let (n, j) = (self.radial.len(), self.kept(j));
        &self.f[j * n..(j + 1) * n]
    }

    /// f at a radial coordinate and the next one.
    #[inline]
    fn from(&self, j: usize, i: usize) -> [f64; 2] {
        let row = &self.row(j)[i..i + 2];
        [row[0], row[1]].map(f64::from)
    }

    /// The last radial coordinate not above `r`, but for the very last.
    #[inline]
    #[allow(clippy::cast_possible_truncation, reason = "16 bits")]
    fn below(&self, r: f64) -> usize {
        let bits = leading(r);
        if bits < self.lowest || self.first_below.is_empty() {
            return 0;
        }
        let step = ((bits - self.lowest) as usize).min(self.first_below.len() - 1);
        let mut at = usize::from(self.first_below[step]);
        let last = self.radial.len() - 2;
        // Whether one coordinate lies below in the step nobody foresees, so it is counted; that there are more is rare.
        at += usize::from(self.radial[at + 1] <= r && at < last);
        while at < last && self.radial[at + 1] <= r {
            at += 1;
        }
        at
    }

    /// f at a distance from β₀ and an azimuth \[turns\].
    pub(super) fn at(&self, r: f64, turn: f64) -> f64 {
        let i = self.below(r);
        let u = ((r - self.radial[i]) / (self.radial[i + 1] - self.radial[i])).min(1.0);
        let (j, k, v) = self.around(turn);
        let along = |j: usize| {
            let [near, far] = self.from(j, i);
            near + u * (far - near)
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
        (j, self.after(j), place - j as f64)
    }

    /// A point of the plane with density f over its integral: distance and azimuth \[turns\].
    pub(super) fn draw(&self, [number, turn]: [f64; 2]) -> (f64, f64) {
        self.about(self.node(number), turn)
    }

    /// The first part of it: a node, and what is left of the number. f is a sum of hats in both directions, one for each node
    /// of the grid, and a node is picked by what it contributes.
    #[inline]
    #[allow(clippy::cast_possible_truncation, reason = "a slice has fewer than 2^32 values")]
    pub(super) fn node(&self, number: f64) -> (u32, f64) {
        let (node, rest) = self.nodes.pick_and_rest(number);
        let (rest, other) = half(rest, self.size.halves);
        let [n, azimuth] = [self.radial.len(), node / self.radial.len()];
        let node = if other && azimuth > 0 {
            node + (self.azimuths - 2 * azimuth) * n
        } else {
            node
        };
        (node as u32, rest)
    }

    /// What a place in the table of nodes holds.
    #[inline(always)]
    pub(super) fn slot(&self, place: u32) -> Slot {
        self.nodes.slots()[place as usize]
    }

    #[inline(always)]
    pub(super) const fn size(&self) -> Size {
        self.size
    }

    /// The hat of a radial coordinate.
    #[inline]
    pub(super) fn hat(&self, i: usize) -> Hat {
        Hat::of(&self.radial, i)
    }

    /// The second part: a point from the hats of a node.
    #[inline]
    #[allow(clippy::cast_possible_truncation, reason = "fewer than 2^16 radial coordinates")]
    pub(super) fn about(&self, (node, rest): (u32, f64), number: f64) -> (f64, f64) {
        let n = self.radial.len() as u32;
        let (azimuth, i) = (node / n, node % n);
        let aside = if number < 0.5 {
            (2.0 * number).sqrt() - 1.0
        } else {
            1.0 - (2.0 - 2.0 * number).sqrt()
        };
        let turn = (f64::from(azimuth) + aside) / self.azimuths as f64;
        let r = self.hat(i as usize).draw(rest, number);
        (r, if turn < 0.0 { turn + 1.0 } else { turn })
    }

    /// With its integrals.
    pub(super) fn integrals(&self) -> Integrals<'_> {
        let n = self.radial.len();
        let along = |j: usize| {
            let mut sum = 0.0;
            let mut step = |i: usize| {
                if let Some(before) = i.checked_sub(1) {
                    let ([from, to], [near, far]) = ([self.radial[before], self.radial[i]], self.from(j, before));
                    sum += moment(from, to, near, far, to);
                }
                sum
            };
            (0..n).map(&mut step).collect::<Vec<f64>>()
        };
        let circle = [false, true].map(|finer| {
            let parts = self.parts(finer);
            let part = move |part: usize| NODES.map(|(node, _)| (part as f64 + node) / parts as f64);
            (0..self.azimuths)
                .flat_map(|j| {
                    (0..parts)
                        .flat_map(part)
                        .map(move |v| (j as f64 + v) / self.azimuths as f64)
                })
                .map(sin_cos_turns)
                .collect()
        });
        Integrals {
            grid: self,
            sums: (0..self.rows).flat_map(along).collect(),
            circle,
        }
    }

    /// Parts of a circle between two azimuths: at most 5° each; finer towards grazing incidence, where it is all on one side.
    fn parts(&self, finer: bool) -> usize {
        72_usize.div_ceil(self.azimuths) * if finer { 4 } else { 1 }
    }
}

impl Integrals<'_> {
    /// ∫ f r dr along an azimuth up to `r`, which is beyond radial coordinate `i`.
    #[inline]
    fn up_to(&self, j: usize, i: usize, r: f64) -> f64 {
        let ([near, far], radial) = (self.grid.from(j, i), &self.grid.radial);
        self.sums[self.grid.kept(j) * radial.len() + i] + moment(radial[i], radial[i + 1], near, far, r)
    }

    /// The integral over the unit circle about −β₀.
    pub(super) fn integral(&self, sine: f64) -> f64 {
        let finer = sine > 0.9;
        let parts = self.grid.parts(finer);
        let mut sum = 0.0;
        let mut circle = self.circle[usize::from(finer)].iter();
        for j in 0..self.grid.azimuths {
            let k = self.grid.after(j);
            for part in 0..parts {
                for ((node, weight), (s, c)) in NODES.into_iter().zip(&mut circle) {
                    let v = (part as f64 + node) / parts as f64;
                    let r = rim(sine, *s, *c).min(END);
                    let i = self.grid.below(r);
                    let (near, far) = (self.up_to(j, i, r), self.up_to(k, i, r));
                    sum += weight / parts as f64 * (near + v * (far - near));
                }
            }
        }
        sum * TAU / self.grid.azimuths as f64
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

#[cfg(test)]
mod tests {
    use etendue_sampling::philox::Stream;

    use super::*;
    use crate::chi_squared::{CRITICAL, deviate};

    #[test]
    fn of_two_grids_the_finer_one_is_taken_at_each_place() {
        let even = |n: u32, from: f64| {
            (0..n)
                .map(|k| f64::from(k) * 0.1 + if k > 0 { from } else { 0.0 })
                .collect::<Vec<_>>()
        };
        // Alike, but for where they stand: one of them, and the end of the other one.
        let (one, other) = (even(21, 0.0), even(20, 0.04));
        let found = finer(&one, &other);
        assert!(one.iter().all(|r| found.contains(r)));
        assert!(found.len() <= one.len() + 2, "{found:?}");
        // Fine in the middle here, beyond it there: of both what is fine, and no step wider than the finer of both has there.
        let one: Vec<f64> = (0..20).map(|k| 0.02 * f64::from(k)).chain([0.8, 1.2]).collect();
        let other: Vec<f64> = (0..4)
            .map(|k| 0.2 * f64::from(k))
            .chain((0..20).map(|k| 0.8 + 0.03 * f64::from(k)))
            .collect();
        let found = finer(&one, &other);
        assert!(found.is_sorted() && found[0] == 0.0 && found[found.len() - 1] == other[other.len() - 1]);
        assert!(one[..19].iter().chain(&other[4..]).all(|r| found.contains(r)));
        assert!(found.len() < one.len() + other.len() - 3, "{found:?}");
        for pair in found.windows(2) {
            let limit = if pair[1] < 0.39 {
                0.021
            } else if pair[0] > 0.79 {
                0.031
            } else {
                0.201
            };
            assert!(pair[1] - pair[0] <= limit, "{pair:?}");
        }
    }

    #[test]
    fn nodes_that_are_left_out_reach_nowhere_into_the_circle() {
        let radial = [0.0, 0.05, 0.3, 0.7, 1.1, 1.5, 2.0];
        let mut seen = [0; 2];
        for azimuths in [1, 4, 36] {
            for sines in [[0.0, 0.1], [0.5, 0.6], [0.9, 1.0], [0.2, 0.2]] {
                for (j, i) in (0..azimuths).flat_map(|j| (0..radial.len()).map(move |i| (j, i))) {
                    let at = |k: u32, [a, b]: [f64; 2]| a + (b - a) * f64::from(k) / 40.0;
                    let [near, far] = [radial[i.saturating_sub(1)], radial[(i + 1).min(6)]];
                    let step = 1.0 / azimuths as f64;
                    let around = [(j as f64 - 1.0) * step, (j as f64 + 1.0) * step];
                    let inside = (0..41_u32.pow(3)).any(|k| {
                        let (sine, r) = (at(k % 41, sines), at(k / 41 % 41, [near, far]));
                        let (s, c) = sin_cos_turns(at(k / 1681, around));
                        (sine + r * c).hypot(r * s) < 1.0
                    });
                    let kept = reaches_in(&radial, azimuths, [j, i], sines);
                    assert!(kept || !inside, "{azimuths} {sines:?} {j} {i}");
                    seen[usize::from(kept == inside)] += 1;
                }
            }
        }
        // Points in steps of a fortieth find nearly all that there are.
        assert!(seen[1] > 40 * seen[0], "{seen:?}");
    }

    #[test]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "small numbers that are not negative"
    )]
    fn points_have_the_density_f_within_each_step_too() {
        // Steep within few steps, one of them empty; cells are much smaller than the steps.
        let slice = Slice {
            sine: 0.0,
            radial: vec![0.0, 0.2, 0.9, 1.4],
            azimuths: 3,
            f: vec![1.0, 5.0, 0.1, 0.0, 2.0, 0.3, 4.0, 0.0, 0.5, 0.0, 0.0, 0.7],
            share: 0.5,
            base: 0.0,
        };
        let grid = slice.grid(None).expect("sound");
        let (radii, turns) = (40, 24);
        let cell = |r: f64, turn: f64| (r / END * f64::from(radii), turn * f64::from(turns));
        let mut counts = vec![0_u64; 40 * 24];
        let drawn = 200_000_u32;
        let stream = Stream::new(7, 0);
        for k in 0..drawn {
            let [a, b, ..] = stream.uniforms(u64::from(k), 0);
            let (r, turn) = grid.draw([a, b]);
            assert!((0.0..=END).contains(&r) && (0.0..1.0).contains(&turn));
            let (i, j) = cell(r, turn);
            counts[(i as usize).min(39) * 24 + (j as usize).min(23)] += 1;
        }
        // f r by the rule of midpoints, 20 × 20 in each cell.
        let fine = 20;
        let masses: Vec<f64> = (0..radii * turns)
            .map(|cell| {
                let (i, j) = (f64::from(cell / turns), f64::from(cell % turns));
                let points = (0..fine * fine).map(|k| {
                    let [u, v] = [k / fine, k % fine].map(|k| (f64::from(k) + 0.5) / f64::from(fine));
                    let r = (i + u) / f64::from(radii) * END;
                    grid.at(r, (j + v) / f64::from(turns)) * r
                });
                points.sum()
            })
            .collect();
        let all: f64 = masses.iter().sum();
        let expected: Vec<f64> = masses.iter().map(|mass| mass / all * f64::from(drawn)).collect();
        let z = deviate(&counts, &expected);
        assert!(z < CRITICAL, "{z}");
    }
}
