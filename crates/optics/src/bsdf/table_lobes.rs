//! How the slices of a table of scattered light go together: between angles and azimuths of incidence.

use std::f64::consts::FRAC_1_PI;
use std::sync::Arc;

use etendue_math::Vec3;
use etendue_math::trig::{sin_cos_turns, turns_of};
use etendue_sampling::guide::Guide;
use etendue_sampling::ordered::inside;
use etendue_sampling::warp::part_of;
use rayon::prelude::*;

use super::monotone_cubic::Cubic;
use super::table_grid::{Grid, Integrals, Slice};

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

/// Numbers by the sine of incidence, linear in few steps: few enough for the nearest caches.
#[derive(Clone, Debug, Default)]
struct Steps {
    /// Rising sines of incidence from which on the steps hold.
    from: Vec<f64>,
    guide: Guide,
    /// Of the flux, in each of two slices and in the floor.
    shares: Vec<Step>,
    /// What f of each of two slices is multiplied by, and the share of the floor.
    factors: Vec<Step>,
}

/// Three numbers between two sines of incidence, in one line of a cache.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Step {
    from: f64,
    /// At the first sine, and by how much they rise with the sine.
    values: [f64; 3],
    slopes: [f64; 3],
    /// The first of the two slices that they belong to.
    pub first: u32,
}

impl Step {
    /// Between two of some sines, for some numbers of the blends there.
    fn new([start, end]: [usize; 2], sines: &[f64], blends: &[Blend], values: fn(&Blend) -> [f64; 3]) -> Self {
        let width = sines[end] - sines[start];
        let [at_start, at_end] = [start, end].map(|i| values(&blends[i]));
        let slope = |k: usize| (at_end[k] - at_start[k]) / width;
        Self {
            from: sines[start],
            values: at_start,
            slopes: std::array::from_fn(|k| if width > 0.0 { slope(k) } else { 0.0 }),
            first: u32::try_from(blends[start].first).unwrap_or(u32::MAX),
        }
    }

    #[inline]
    pub(super) fn at(&self, sine: f64) -> [f64; 3] {
        let beyond = sine - self.from;
        std::array::from_fn(|k| self.values[k] + beyond * self.slopes[k])
    }
}

/// How light from an angle of incidence is shared by slices.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Blend {
    /// The first of the two slices from here to the next sine; the other one follows it.
    first: usize,
    /// Of the flux, in each of the two and in the floor.
    shares: [f64; 3],
    /// What f of each of the two slices is multiplied by.
    factors: [f64; 2],
}

/// What interpolated shares may be off.
const TOLERANCE: f64 = 5e-6;

/// The smallest step of the sine of incidence for which shares are tabled.
const SMALLEST_STEP: f64 = 1e-4;

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
        let mut between: Vec<Slice> = Vec::new();
        for (k, slice) in self.slices.iter().enumerate() {
            if let Some(before) = k.checked_sub(1).map(|before| &self.slices[before]) {
                between.extend(before.up_to(slice));
            }
            between.push(slice.clone());
        }
        let grid = |k: usize| {
            // From the slice before to the one after.
            let from = k.checked_sub(1).map_or(0.0, |before| between[before].sine);
            let to = between.get(k + 1).map_or(1.0, |after| after.sine);
            between[k].grid(Some([from, to]))
        };
        let slices: Vec<Grid> = (0..between.len()).map(grid).collect::<Result<_, String>>()?;
        let squares: Vec<f64> = sines.iter().map(|sine| sine * sine).collect();
        let of = |pick: fn(&Slice) -> f64| Cubic::new(&squares, &self.slices.iter().map(pick).collect::<Vec<_>>());
        let (sines, blends) = blends_of(&slices, &of(|slice| slice.share), &of(|slice| slice.floor));
        Ok(Lobe {
            azimuth: self.azimuth,
            slices: slices.into(),
            steps: Steps::new(&sines, &blends),
        })
    }
}

/// How light is shared, at sines from 0 to 1 between which everything is linear.
fn blends_of(slices: &[Grid], share: &Cubic, floor: &Cubic) -> (Vec<f64>, Vec<Blend>) {
    let (mut sines, mut blends) = (Vec::new(), Vec::new());
    let mut push = |(sine, blend): (f64, Blend)| {
        sines.push(sine);
        blends.push(blend);
    };
    let integrals: Vec<Integrals<'_>> = slices.iter().map(Grid::integrals).collect();
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
        let own = integrals[first].integral(slices[first].sine);
        let at = |sine: f64| {
            let square = sine * sine;
            let (rho, floor) = (share.at(square), floor.at(square));
            let (shares, factors) = if beyond {
                // The slice moves on unchanged.
                let factor = if own > 0.0 { rho / own } else { 0.0 };
                ([factor * integrals[first].integral(sine), 0.0], [factor, 0.0])
            } else {
                let part = (sine - from) / (to - from);
                let energies = [integrals[first].integral(sine), integrals[first + 1].integral(sine)];
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
        push(last);
        let mut left: Vec<_> = (1..=4)
            .rev()
            .map(|i| from + (to - from) * f64::from(i) / 4.0)
            .map(|sine| (sine, at(sine)))
            .collect();
        while let Some(next) = left.pop() {
            let sine = 0.5 * (last.0 + next.0);
            let middle = (sine, at(sine));
            if next.0 - last.0 < SMALLEST_STEP || middle.1.is_between(&last.1, &next.1) {
                push(middle);
                push(next);
                last = next;
            } else {
                left.push(next);
                left.push(middle);
            }
        }
    }
    (sines, blends)
}

impl Lobe {
    /// The first of two slices and, from the last sine on that is not above this one, the shares of both and of the floor.
    #[inline]
    pub(super) fn step(&self, sine: f64) -> &Step {
        &self.steps.shares[self.steps.at(sine)]
    }

    /// The first of two slices, and the shares of both and of the floor.
    #[inline]
    pub(super) fn shares(&self, sine: f64) -> (usize, [f64; 3]) {
        let step = self.step(sine);
        (step.first as usize, step.at(sine))
    }

    /// Of the flux, in all directions.
    #[inline]
    pub(super) fn share(&self, sine: f64) -> f64 {
        self.shares(sine).1.iter().sum()
    }

    pub(super) fn slices(&self) -> &[Grid] {
        &self.slices
    }

    /// Between two sines of incidence: the first of two slices, and what f of each is multiplied by and the share of the floor, where
    /// each step that reaches there begins and ends.
    pub(super) fn factors(&self, [from, to]: [f64; 2]) -> impl Iterator<Item = (usize, [[f64; 3]; 2])> {
        let ends = self.steps.from.iter().skip(1).copied().chain([1.0]);
        let steps = self.steps.factors.iter().zip(ends);
        let there = steps.filter(move |(step, end)| step.from <= to && *end >= from);
        there.map(move |(step, end)| {
            let sines = [from.max(step.from), to.min(end)];
            (step.first as usize, sines.map(|sine| step.at(sine)))
        })
    }

    /// A floor alone, by its shares at some sines from 0 to 1, between which it is linear.
    pub(super) fn of_floor(&self, sines: &[f64], shares: &[f64]) -> Self {
        let floor = |share: &f64| Blend {
            shares: [0.0, 0.0, *share],
            ..Blend::default()
        };
        let blends: Vec<Blend> = shares.iter().map(floor).collect();
        Self {
            azimuth: self.azimuth,
            slices: Arc::default(),
            steps: Steps::every(sines, &blends),
        }
    }

    /// A slice, by its number.
    #[inline]
    pub(super) fn slice(&self, number: usize) -> &Grid {
        &self.slices[number]
    }

    /// f \[1/sr\] for light that leaves towards a point of the plane of direction cosines.
    #[inline]
    pub(super) fn at(&self, sine: f64, r: f64, turn: f64) -> f64 {
        let step = &self.steps.factors[self.steps.at(sine)];
        let [one, other, floor] = step.at(sine);
        let mut f = floor * FRAC_1_PI;
        for (k, factor) in [one, other].into_iter().enumerate().filter(|(_, factor)| *factor > 0.0) {
            f += factor * self.slices[step.first as usize + k].at(r, turn);
        }
        f
    }

    /// A slice or a floor (None), picked by its share, with what is left of a number that is less than the share of all, as a
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

impl Steps {
    /// Of blends at rising sines, as far as each step goes without anything being off.
    fn new(sines: &[f64], blends: &[Blend]) -> Self {
        let mut steps = Self::default();
        let mut start = 0;
        while start + 1 < sines.len() {
            let both =
                |end: usize| [Blend::shares, Blend::factors].map(|of| Step::new([start, end], sines, blends, of));
            let mut end = start + 1;
            while end + 1 < sines.len() && holds(&both(end + 1), [start, end + 1], sines, blends) {
                end += 1;
            }
            // Where two slices meet, a sine stands there twice.
            if sines[end] > sines[start] {
                let [shares, factors] = both(end);
                steps.from.push(sines[start]);
                steps.shares.push(shares);
                steps.factors.push(factors);
            }
            start = end;
        }
        steps.guide = Guide::new(&steps.from);
        steps
    }

    /// The same, from each sine to the next.
    fn every(sines: &[f64], blends: &[Blend]) -> Self {
        let each =
            |of: fn(&Blend) -> [f64; 3]| (1..sines.len()).map(move |end| Step::new([end - 1, end], sines, blends, of));
        let from = sines[..sines.len() - 1].to_vec();
        Self {
            guide: Guide::new(&from),
            from,
            shares: each(Blend::shares).collect(),
            factors: each(Blend::factors).collect(),
        }
    }

    /// The shares where steps begin, and where they end.
    fn ends(&self) -> impl Iterator<Item = [f64; 3]> {
        let to = self.from.iter().skip(1).copied().chain([1.0]);
        self.shares
            .iter()
            .zip(to)
            .flat_map(|(step, to)| [step.values, step.at(to)])
    }

    /// Without the floor.
    fn without_floor(&self) -> Self {
        let mut steps = self.clone();
        for step in steps.shares.iter_mut().chain(&mut steps.factors) {
            (step.values[2], step.slopes[2]) = (0.0, 0.0);
        }
        steps
    }

    /// The number of the step from the last sine that is not above this one.
    #[inline]
    fn at(&self, sine: f64) -> usize {
        self.guide.not_above(&self.from, sine, |from| *from).max(1) - 1
    }
}

/// Whether all between two sines have the slices of steps and, for all that anybody can see, their shares and factors.
fn holds([shares, factors]: &[Step; 2], [start, end]: [usize; 2], sines: &[f64], blends: &[Blend]) -> bool {
    (start + 1..=end).all(|i| {
        let blend = &blends[i];
        let scale = blend.factors[0].abs() + blend.factors[1].abs();
        let near = |found: [f64; 3], there: [f64; 3], scales: [f64; 3]| {
            (0..3).all(|k| (there[k] - found[k]).abs() <= TOLERANCE * scales[k])
        };
        blend.first == blends[start].first
            && sines[i] > sines[start]
            && near(shares.at(sines[i]), blend.shares(), [1.0; 3])
            && near(factors.at(sines[i]), blend.factors(), [scale, scale, 1.0])
    })
}

impl Blend {
    const fn shares(&self) -> [f64; 3] {
        self.shares
    }

    /// With the share of the floor.
    const fn factors(&self) -> [f64; 3] {
        [self.factors[0], self.factors[1], self.shares[2]]
    }

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
}

impl Lobes {
    /// Without the floor of any slice; None if there is nothing else.
    pub(super) fn without_floor(&self) -> Option<Self> {
        let mut rows = self.rows.clone();
        for row in &mut rows {
            row.steps = row.steps.without_floor();
        }
        let left = rows
            .iter()
            .flat_map(|row| row.steps.ends())
            .flatten()
            .any(|share| share > 0.0);
        left.then_some(Self { rows })
    }

    /// Whether any slice has a floor.
    pub(super) fn has_floor(&self) -> bool {
        self.rows
            .iter()
            .flat_map(|row| row.steps.ends())
            .any(|shares| shares[2] > 0.0)
    }

    /// The greatest share of the light.
    pub(super) fn most(&self) -> f64 {
        let shares = self.rows.iter().flat_map(|row| row.steps.ends());
        shares.map(|shares| shares.iter().sum()).fold(0.0, f64::max)
    }

    pub(super) fn rows(&self) -> &[Lobe] {
        &self.rows
    }

    /// Other rows in the place of these.
    pub(super) fn with_rows(rows: Vec<Lobe>) -> Self {
        Self { rows }
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
    }

    /// Of the flux, in the floor.
    pub(super) fn floor(&self) -> f64 {
        self.there()
            .fold(0.0, |sum, (row, part)| sum + part * row.shares(self.sine).1[2])
    }

    /// f for light that leaves towards a point of the plane of direction cosines.
    pub(super) fn at(&self, r: f64, turn: f64) -> f64 {
        self.there()
            .fold(0.0, |sum, (row, part)| sum + part * row.at(self.sine, r, turn))
    }

    /// A slice or a floor (None), picked by its share, with what is left of the number.
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

#[cfg(test)]
mod tests {
    use etendue_math::special::exp;

    use super::*;

    #[test]
    fn shares_by_which_rays_are_drawn_are_those_of_the_table() {
        let slice = |sine: f64, width: f64, floor: f64| Slice {
            sine,
            radial: (0..24).map(|i| 2.0 * (f64::from(i) / 23.0).powi(2)).collect(),
            azimuths: 1,
            f: (0..24)
                .map(|i| exp(-0.5 * (2.0 * (f64::from(i) / 23.0).powi(2) / width).powi(2)))
                .collect(),
            share: 0.5 - 0.2 * sine,
            floor,
        };
        let row = Row {
            azimuth: 0.0,
            slices: vec![slice(0.0, 0.3, 0.1), slice(0.5, 0.2, 0.2), slice(0.95, 0.4, 0.15)],
        };
        let lobe = row.lobe().expect("sound");
        let of = |pick: fn(&Slice) -> f64| {
            let squares: Vec<f64> = row.slices.iter().map(|slice| slice.sine * slice.sine).collect();
            Cubic::new(&squares, &row.slices.iter().map(pick).collect::<Vec<_>>())
        };
        let (sines, blends) = blends_of(&lobe.slices, &of(|slice| slice.share), &of(|slice| slice.floor));
        assert!(4 * lobe.steps.from.len() < 3 * sines.len());
        for k in 0..=20_000 {
            let sine = f64::from(k) / 20_000.0;
            let above = sines[..sines.len() - 1].partition_point(|from| *from <= sine).max(1);
            let (a, b) = (&blends[above - 1], &blends[above]);
            let width = sines[above] - sines[above - 1];
            let part = if width > 0.0 {
                (sine - sines[above - 1]) / width
            } else {
                0.0
            };
            let blend = a.towards(b, part);
            let (first, shares) = lobe.shares(sine);
            assert_eq!(first, blend.first);
            for (share, known) in shares.into_iter().zip(blend.shares) {
                assert!((share - known).abs() <= 1.0001 * TOLERANCE, "{sine}: {share} {known}");
            }
            let step = &lobe.steps.factors[lobe.steps.at(sine)];
            let [one, other, floor] = step.at(sine);
            let scale: f64 = blend.factors.iter().sum();
            assert_eq!(step.first as usize, blend.first);
            assert!((floor - blend.shares[2]).abs() <= 1.0001 * TOLERANCE);
            for (factor, known) in [one, other].into_iter().zip(blend.factors) {
                assert!(
                    (factor - known).abs() <= 1.0001 * TOLERANCE * scale,
                    "{sine}: {factor} {known}"
                );
            }
        }
    }
}
