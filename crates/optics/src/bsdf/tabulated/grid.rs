//! A slice of a table of scattered light, ready to be asked: its integrals, and points drawn from it.

use std::f64::consts::TAU;

use etendue_math::trig::sin_cos_turns;
use etendue_sampling::alias::{Alias, Slot};

use super::hats::Hat;
use super::slice::Slice;

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
    /// A slice ready to be asked; to be drawn from where sines of incidence lie between these, so that nodes beyond the unit
    /// circle are left out. None: in all of the plane.
    ///
    /// # Errors
    /// What is wrong with the slice.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "fewer than 2^16 radial coordinates; single precision is meant"
    )]
    pub(super) fn of(slice: &Slice, sines: Option<[f64; 2]>) -> Result<Self, String> {
        let Slice {
            radial, azimuths, f, ..
        } = slice;
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
        if !(0.0..=1.0).contains(&slice.sine) {
            return Err("a sine of incidence is not from 0 to 1".into());
        }
        if !(slice.share >= 0.0 && slice.base >= 0.0 && slice.share + slice.base <= 1.0 + 1e-9) {
            return Err(format!("{} of the flux leaves", slice.share + slice.base));
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
        Ok(Self {
            sine: slice.sine,
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
        let grid = Grid::of(&slice, None).expect("sound");
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
