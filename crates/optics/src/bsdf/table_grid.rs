//! A slice of a table of scattered light: f on a polar grid, its integrals, and points drawn from it.

use std::f64::consts::TAU;

use etendue_math::special::{exp, ln};
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::guide::Guide;
use etendue_sampling::warp::part_of;

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

/// A slice with its integrals.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub sine: f64,
    /// From 0 to the end of the plane.
    radial: Vec<f64>,
    azimuths: usize,
    /// Azimuth by azimuth, at each radial coordinate.
    nodes: Vec<Node>,
    /// ∫ f r dr along each azimuth, all over the plane.
    wholes: Vec<f64>,
    /// Running sum over the sectors between azimuths, of the whole plane.
    sectors: Vec<f64>,
    /// Of `sectors`, and of the sums along each azimuth.
    sector_guide: Guide,
    guides: Vec<Guide>,
    /// Of the radial coordinates, by the leading bits of a number: coordinates rise by ratios.
    first_below: Vec<u16>,
    /// Leading bits of the second radial coordinate.
    lowest: u64,
}

/// What a slice holds at a point of its grid.
#[derive(Clone, Copy, Debug)]
struct Node {
    f: f64,
    /// ∫ f r dr along its azimuth from 0.
    sum: f64,
}

/// Farthest |β − β₀|.
const END: f64 = 2.0;

/// Bits of a number that stay when its sign, its exponent and two digits of its fraction are kept: four steps for each
/// doubling.
const SHIFT: u32 = 50;

/// The leading bits of a number that is not negative: they rise with it.
#[inline]
fn leading(x: f64) -> u64 {
    x.to_bits() >> SHIFT
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
    pub(super) fn up_to(&self, other: &Self) -> Vec<Self> {
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

    /// With its integrals.
    ///
    /// # Errors
    /// What is wrong with the slice.
    #[allow(clippy::cast_possible_truncation, reason = "fewer than 2^16 radial coordinates")]
    pub(super) fn grid(&self) -> Result<Grid, String> {
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
        let mut all = radial.clone();
        if radial[radial.len() - 1] < END {
            all.push(END);
        }
        let mut nodes = Vec::with_capacity(azimuths * all.len());
        for row in f.chunks(radial.len()) {
            let mut sum = 0.0;
            for (i, r) in all.iter().enumerate() {
                // Constant beyond the last of its coordinates.
                let f = row[i.min(row.len() - 1)];
                if i > 0 {
                    sum += moment(all[i - 1], *r, row[i - 1], f, *r);
                }
                nodes.push(Node { f, sum });
            }
        }
        let rows = || nodes.chunks(all.len());
        let sums = |row: &[Node]| row.iter().map(|node| node.sum).collect::<Vec<f64>>();
        let mut grid = Grid {
            sine: self.sine,
            azimuths: *azimuths,
            guides: rows().map(|row| Guide::new(&sums(row))).collect(),
            wholes: rows().map(|row| row[row.len() - 1].sum).collect(),
            nodes,
            sectors: Vec::new(),
            sector_guide: Guide::default(),
            first_below: Vec::new(),
            lowest: all.get(1).map_or(0, |r| leading(*r)),
            radial: all,
        };
        let mut sum = 0.0;
        for j in 0..*azimuths {
            sum += 0.5 * (grid.wholes[j] + grid.wholes[grid.after(j)]) * TAU / *azimuths as f64;
            grid.sectors.push(sum);
        }
        grid.sector_guide = Guide::new(&grid.sectors);
        grid.first_below = (grid.lowest..=leading(END))
            .map(|bits| {
                grid.radial
                    .partition_point(|r| *r < f64::from_bits(bits << SHIFT))
                    .max(1) as u16
                    - 1
            })
            .collect();
        Ok(grid)
    }
}

/// ∫ g r dr from `a` to `x`, g being linear from `(a, ga)` to `(b, gb)`.
#[inline]
fn moment(a: f64, b: f64, ga: f64, gb: f64, x: f64) -> f64 {
    let slope = (gb - ga) / (b - a);
    let h = x - a;
    // r = a + t: ∫ (ga + slope t)(a + t) dt.
    h * (ga * a + h * (0.5 * (ga + slope * a) + h * slope / 3.0))
}

impl Grid {
    /// The azimuth after one.
    #[inline]
    const fn after(&self, j: usize) -> usize {
        if j + 1 == self.azimuths { 0 } else { j + 1 }
    }

    /// What is held along an azimuth.
    #[inline]
    fn row(&self, j: usize) -> &[Node] {
        let n = self.radial.len();
        &self.nodes[j * n..(j + 1) * n]
    }

    /// ∫ f r dr along an azimuth up to `r`, which is beyond radial coordinate `i`.
    #[inline]
    fn up_to(&self, j: usize, i: usize, r: f64) -> f64 {
        let row = self.row(j);
        row[i].sum + moment(self.radial[i], self.radial[i + 1], row[i].f, row[i + 1].f, r)
    }

    /// The last radial coordinate not above `r`, but for the very last.
    #[inline]
    #[allow(clippy::cast_possible_truncation, reason = "14 bits")]
    fn below(&self, r: f64) -> usize {
        let bits = leading(r);
        if bits < self.lowest || self.first_below.is_empty() {
            return 0;
        }
        let step = ((bits - self.lowest) as usize).min(self.first_below.len() - 1);
        let mut at = usize::from(self.first_below[step]);
        while at + 2 < self.radial.len() && self.radial[at + 1] <= r {
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
            let row = self.row(j);
            row[i].f + u * (row[i + 1].f - row[i].f)
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

    /// The integral over the unit circle about −β₀.
    pub(super) fn integral(&self, sine: f64) -> f64 {
        // Gauss and Legendre, in parts of at most 5°; finer towards grazing incidence, where the circle is all on one side.
        const NODES: [(f64, f64); 2] = [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];
        let parts = 72_usize.div_ceil(self.azimuths) * if sine > 0.9 { 4 } else { 1 };
        let mut sum = 0.0;
        for j in 0..self.azimuths {
            let k = self.after(j);
            for part in 0..parts {
                for (node, weight) in NODES {
                    let v = (part as f64 + node) / parts as f64;
                    let (s, c) = sin_cos_turns((j as f64 + v) / self.azimuths as f64);
                    let r = rim(sine, s, c).min(END);
                    let i = self.below(r);
                    let (near, far) = (self.up_to(j, i, r), self.up_to(k, i, r));
                    sum += weight / parts as f64 * (near + v * (far - near));
                }
            }
        }
        sum * TAU / self.azimuths as f64
    }

    /// A point of the plane with density f over its integral: distance and azimuth \[turns\].
    pub(super) fn draw(&self, numbers: [f64; 2]) -> (f64, f64) {
        let all = self.sectors[self.azimuths - 1];
        let wanted = numbers[1] * all;
        let j = self
            .sector_guide
            .not_above(&self.sectors, wanted, |sum| *sum)
            .min(self.azimuths - 1);
        let before = if j == 0 { 0.0 } else { self.sectors[j - 1] };
        let k = self.after(j);
        let (near, far) = (self.wholes[j], self.wholes[k]);
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
        let row = self.row(j);
        let wanted = number * self.wholes[j];
        let steps = row.len() - 1;
        let i = (self.guides[j].not_above(row, wanted, |node| node.sum).max(1) - 1).min(steps - 1);
        let (mut low, mut high) = (self.radial[i], self.radial[i + 1]);
        let (Node { f: f0, sum: before }, Node { f: f1, sum: after }) = (row[i], row[i + 1]);
        let (start, width) = (low, high - low);
        let slope = (f1 - f0) / width;
        let left = wanted - before;
        // ∫ f r dr from the start of the step on, as `moment` has it.
        let linear = f0 + slope * start;
        let moment = |h: f64| h * (f0 * start + h * (0.5 * linear + h * slope / 3.0));
        // Newton's method, kept between ends that close in, from where f r would be if it were linear in r.
        let mut r = low + width * of_linear(part_of(left, after - before), f0 * start, f1 * high);
        for _ in 0..60 {
            let h = r - start;
            let off = moment(h) - left;
            if off > 0.0 {
                high = r;
            } else {
                low = r;
            }
            let density = (f0 + slope * h) * r;
            let next = r - off / density;
            let next = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
            if (next - r).abs() <= 1e-12 * next {
                return next;
            }
            r = next;
        }
        r
    }
}

/// The number from 0 to 1 below which lies a part of a density that is linear from `a` to `b`.
#[inline]
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
