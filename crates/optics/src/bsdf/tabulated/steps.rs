//! How light is shared by the slices of a table and its base, by the sine of incidence.

use etendue_sampling::guide::Guide;

use super::grid::{Grid, Integrals};
use crate::bsdf::monotone_cubic::Cubic;

/// Numbers by the sine of incidence, parabolas in few steps: few enough for the nearest caches.
#[derive(Clone, Debug, Default)]
pub(super) struct Steps {
    /// Rising sines of incidence from which on the steps hold.
    from: Vec<f64>,
    guide: Guide,
    /// Of the flux, in each of two slices and in the base.
    shares: Vec<Step>,
    /// What f of each of two slices is multiplied by, and the share of the base.
    factors: Vec<Step>,
}

/// Three numbers between two sines of incidence, in one line of a cache.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Step {
    from: f64,
    /// At the first sine, and with what they change by the sine and by its square; of these single precision is enough.
    values: [f64; 3],
    slopes: [f32; 3],
    bends: [f32; 3],
    /// The first of the two slices that they belong to.
    pub first: u32,
}

impl Step {
    /// Between two of some sines, for some numbers of the blends there: through both and one in the middle.
    #[allow(clippy::cast_possible_truncation, reason = "single precision is meant")]
    fn new([start, end]: [usize; 2], sines: &[f64], blends: &[Blend], values: fn(&Blend) -> [f64; 3]) -> Self {
        let middle = usize::midpoint(start, end);
        let [near, far] = [middle, end].map(|i| sines[i] - sines[start]);
        let [at_start, at_middle, at_end] = [start, middle, end].map(|i| values(&blends[i]));
        let slope = |k: usize, to: [f64; 3], width: f64| {
            if width > 0.0 {
                (to[k] - at_start[k]) / width
            } else {
                0.0
            }
        };
        let bend = |k: usize| {
            if near > 0.0 && near < far {
                (slope(k, at_end, far) - slope(k, at_middle, near)) / (far - near)
            } else {
                0.0
            }
        };
        Self {
            from: sines[start],
            values: at_start,
            slopes: std::array::from_fn(|k| (slope(k, at_end, far) - bend(k) * far) as f32),
            bends: std::array::from_fn(|k| bend(k) as f32),
            first: u32::try_from(blends[start].first).unwrap_or(u32::MAX),
        }
    }

    /// For the shares and for the factors.
    fn both(ends: [usize; 2], sines: &[f64], blends: &[Blend]) -> [Self; 2] {
        [Blend::shares, Blend::factors].map(|of| Self::new(ends, sines, blends, of))
    }

    #[inline]
    pub(super) fn at(&self, sine: f64) -> [f64; 3] {
        let beyond = sine - self.from;
        let at = |k: usize| self.values[k] + beyond * (f64::from(self.slopes[k]) + beyond * f64::from(self.bends[k]));
        // Where a share ends a parabola may go below 0 by what it may be off.
        std::array::from_fn(|k| at(k).max(0.0))
    }

    /// No sum of the three is greater up to another sine.
    fn most(&self, to: f64) -> f64 {
        let sum = |list: [f32; 3]| list.map(f64::from).iter().sum::<f64>();
        let [slope, bend] = [sum(self.slopes), sum(self.bends)];
        let at = |sine: f64| self.at(sine).iter().sum::<f64>();
        // Where the sum is greatest, or one of the ends.
        let top = if bend < 0.0 { self.from - 0.5 * slope / bend } else { to };
        [self.from, to, top.clamp(self.from, to)]
            .map(at)
            .into_iter()
            .fold(0.0, f64::max)
    }
}

/// How light from an angle of incidence is shared by slices.
#[derive(Clone, Copy, Debug)]
struct Blend {
    /// The first of the two slices from here to the next sine; the other one follows it.
    first: usize,
    /// Of the flux, in each of the two and in the base.
    shares: [f64; 3],
    /// What f of each of the two slices is multiplied by.
    factors: [f64; 2],
}

/// What interpolated shares may be off, in parts of all that is scattered, or of [`LEAST`] where that is less.
const TOLERANCE: f64 = 5e-6;
const LEAST: f64 = 1e-3;

/// Steps of the sine of incidence are not made smaller than this.
const SMALLEST_STEP: f64 = 1e-4;

/// What light is shared by between two slices, or before the first and beyond the last one.
struct Between<'a> {
    /// Sines of both ends.
    ends: [f64; 2],
    /// The first of two slices, or the only one.
    first: usize,
    slices: Vec<&'a Integrals<'a>>,
    /// The integral of the only one, where it stands.
    own: f64,
    /// In the lobe and in the base, over the square of the sine.
    share: &'a Cubic,
    base: &'a Cubic,
}

impl Between<'_> {
    fn at(&self, sine: f64) -> Blend {
        let square = sine * sine;
        let (rho, base) = (self.share.at(square), self.base.at(square));
        let [from, to] = self.ends;
        let (shares, factors) = if let [one, other] = self.slices[..] {
            let part = (sine - from) / (to - from);
            let energies = [one.integral(sine), other.integral(sine)];
            let all = (1.0 - part) * energies[0] + part * energies[1];
            let factor = if all > 0.0 { rho / all } else { 0.0 };
            let factors = [factor * (1.0 - part), factor * part];
            ([factors[0] * energies[0], factors[1] * energies[1]], factors)
        } else {
            // The slice moves on unchanged.
            let factor = if self.own > 0.0 { rho / self.own } else { 0.0 };
            ([factor * self.slices[0].integral(sine), 0.0], [factor, 0.0])
        };
        Blend {
            first: self.first,
            shares: [shares[0], shares[1], base],
            factors,
        }
    }

    /// What is there at sines from one end to the other: between each and the next but one it is a parabola, for all that
    /// anybody can see.
    fn blends(&self) -> Vec<(f64, Blend)> {
        let [from, to] = self.ends;
        let there = |sine: f64| (sine, self.at(sine));
        let halves = |[one, other]: [(f64, Blend); 2]| [one, there(0.5 * (one.0 + other.0)), other];
        let mut found = vec![there(from)];
        let mut left: Vec<_> = (0..4)
            .rev()
            .map(|k| [k, k + 1].map(|k| there(from + (to - from) * f64::from(k) / 4.0)))
            .map(halves)
            .collect();
        while let Some([start, middle, end]) = left.pop() {
            let [near, far] = [[start, middle], [middle, end]].map(halves);
            // Beside both ends as well: where f has a kink, a parabola is off most there.
            let [first, last] = [[start, near[1]], [far[1], end]].map(|ends| halves(ends)[1]);
            let all = [start, first, near[1], middle, far[1], last, end];
            let (sines, blends): (Vec<f64>, Vec<Blend>) = all.into_iter().unzip();
            if end.0 - start.0 < SMALLEST_STEP || holds(&Step::both([0, 6], &sines, &blends), [0, 6], &sines, &blends) {
                found.extend(&all[1..]);
            } else {
                left.extend([far, near]);
            }
        }
        found
    }
}

/// How light is shared by slices with these integrals, from the sine 0 to 1.
fn all_between<'a>(integrals: &'a [Integrals<'a>], sines: &[f64], [share, base]: [&'a Cubic; 2]) -> Vec<Between<'a>> {
    let last = sines.len() - 1;
    // From 0 to the first slice, from each to the next, from the last to 1.
    let mut ends = sines.to_vec();
    ends.insert(0, 0.0);
    ends.push(1.0);
    let between = |(k, ends): (usize, &[f64])| {
        let first = k.saturating_sub(1);
        let alone = k == 0 || first == last;
        Between {
            ends: [ends[0], ends[1]],
            first,
            slices: integrals[first..=if alone { first } else { k }].iter().collect(),
            own: integrals[first].integral(sines[first]),
            share,
            base,
        }
    };
    let all = ends.windows(2).enumerate().map(between);
    all.filter(|between| between.ends[0] < between.ends[1]).collect()
}

impl Steps {
    /// Of slices, by shares in the lobe and in the base over the square of the sine.
    pub fn of(slices: &[Grid], share: &Cubic, base: &Cubic) -> Self {
        let integrals: Vec<Integrals<'_>> = slices.iter().map(Grid::integrals).collect();
        let sines: Vec<f64> = slices.iter().map(|grid| grid.sine).collect();
        let all = all_between(&integrals, &sines, [share, base]);
        let (sines, blends): (Vec<f64>, Vec<Blend>) = all.iter().flat_map(Between::blends).unzip();
        Self::new(&sines, &blends)
    }

    /// The place of the step from the last sine that is not above this one.
    #[inline]
    #[allow(clippy::cast_possible_truncation, reason = "fewer than 2^32 steps")]
    pub fn place(&self, sine: f64) -> u32 {
        self.guide.not_above(&self.from, sine, |from| *from).max(1) as u32 - 1
    }

    /// A step with the shares of the flux.
    #[inline]
    pub fn shares(&self, place: u32) -> &Step {
        &self.shares[place as usize]
    }

    /// A step with what f of two slices is multiplied by, and with the share of the base.
    #[inline]
    pub fn factors(&self, place: u32) -> &Step {
        &self.factors[place as usize]
    }

    /// Of blends at rising sines, as far as each step goes without anything being off.
    fn new(sines: &[f64], blends: &[Blend]) -> Self {
        let mut steps = Self::default();
        let mut start = 0;
        while start + 1 < sines.len() {
            let both = |end: usize| Step::both([start, end], sines, blends);
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

    /// The greatest sum of shares.
    pub fn most(&self) -> f64 {
        let to = self.from.iter().skip(1).copied().chain([1.0]);
        self.shares
            .iter()
            .zip(to)
            .map(|(step, to)| step.most(to))
            .fold(0.0, f64::max)
    }

    /// Without the base.
    pub fn without_base(&self) -> Self {
        let mut steps = self.clone();
        for step in steps.shares.iter_mut().chain(&mut steps.factors) {
            (step.values[2], step.slopes[2], step.bends[2]) = (0.0, 0.0, 0.0);
        }
        steps
    }

    /// Whether anything is in the base.
    pub fn has_base(&self) -> bool {
        self.shares
            .iter()
            .any(|step| step.values[2] > 0.0 || step.slopes[2] != 0.0 || step.bends[2] != 0.0)
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
            && near(shares.at(sines[i]), blend.shares(), [blend.all(); 3])
            && near(factors.at(sines[i]), blend.factors(), [scale, scale, blend.all()])
    })
}

impl Blend {
    const fn shares(&self) -> [f64; 3] {
        self.shares
    }

    /// The shares together, or [`LEAST`].
    fn all(&self) -> f64 {
        self.shares.iter().sum::<f64>().max(LEAST)
    }

    /// With the share of the base.
    const fn factors(&self) -> [f64; 3] {
        [self.factors[0], self.factors[1], self.shares[2]]
    }
}

#[cfg(test)]
mod tests {
    use etendue_math::special::exp;

    use super::super::slice::Slice;
    use super::*;

    #[test]
    fn shares_by_which_rays_are_drawn_are_those_of_the_table() {
        let slice = |sine: f64, width: f64, base: f64| Slice {
            sine,
            radial: (0..24).map(|i| 2.0 * (f64::from(i) / 23.0).powi(2)).collect(),
            azimuths: 1,
            f: (0..24)
                .map(|i| exp(-0.5 * (2.0 * (f64::from(i) / 23.0).powi(2) / width).powi(2)))
                .collect(),
            share: 0.5 - 0.2 * sine,
            base,
        };
        let slices = [slice(0.0, 0.3, 0.1), slice(0.5, 0.2, 0.2), slice(0.95, 0.4, 0.15)];
        let grids: Vec<Grid> = slices
            .iter()
            .map(|slice| Grid::of(slice, None).expect("sound"))
            .collect();
        let of = |pick: fn(&Slice) -> f64| {
            let squares: Vec<f64> = slices.iter().map(|slice| slice.sine * slice.sine).collect();
            Cubic::new(&squares, &slices.iter().map(pick).collect::<Vec<_>>())
        };
        let (share, base) = (of(|slice| slice.share), of(|slice| slice.base));
        let steps = Steps::of(&grids, &share, &base);
        let integrals: Vec<Integrals<'_>> = grids.iter().map(Grid::integrals).collect();
        let sines: Vec<f64> = slices.iter().map(|slice| slice.sine).collect();
        let all = all_between(&integrals, &sines, [&share, &base]);
        assert!(steps.from.len() < 200, "{}", steps.from.len());
        // Between the seven sines of a cell steps and shares may both be off a parabola through the same three, and these from
        // each other.
        let most_off = 4.0 * TOLERANCE;
        for k in 0..=20_000 {
            let sine = f64::from(k) / 20_000.0;
            let there = all.iter().rfind(|between| between.ends[0] <= sine);
            let blend = there.expect("from 0 on").at(sine);
            let place = steps.place(sine);
            let [shares, factors] = [steps.shares(place), steps.factors(place)];
            assert_eq!(
                [shares.first, factors.first].map(|first| first as usize),
                [blend.first; 2]
            );
            for (share, known) in shares.at(sine).into_iter().zip(blend.shares) {
                assert!(
                    (share - known).abs() <= most_off * blend.all(),
                    "{sine}: {share} {known}"
                );
            }
            let scale: f64 = blend.factors.iter().sum();
            for (k, (factor, known)) in factors.at(sine).into_iter().zip(blend.factors()).enumerate() {
                let scale = if k < 2 { scale } else { blend.all() };
                assert!((factor - known).abs() <= most_off * scale, "{sine}: {factor} {known}");
            }
            assert!(shares.at(sine).iter().sum::<f64>() <= steps.most());
        }
    }
}
