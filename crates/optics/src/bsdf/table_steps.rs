//! How light is shared by the slices of a table and its base, by the sine of incidence.

use etendue_sampling::guide::Guide;

use super::monotone_cubic::Cubic;
use super::table_grid::{Grid, Integrals};

/// Numbers by the sine of incidence, linear in few steps: few enough for the nearest caches.
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
#[derive(Clone, Copy, Debug)]
struct Blend {
    /// The first of the two slices from here to the next sine; the other one follows it.
    first: usize,
    /// Of the flux, in each of the two and in the base.
    shares: [f64; 3],
    /// What f of each of the two slices is multiplied by.
    factors: [f64; 2],
}

/// What interpolated shares may be off.
const TOLERANCE: f64 = 5e-6;

/// The smallest step of the sine of incidence for which shares are tabled.
const SMALLEST_STEP: f64 = 1e-4;

/// How light is shared, at sines from 0 to 1 between which everything is linear.
fn blends_of(slices: &[Grid], share: &Cubic, base: &Cubic) -> (Vec<f64>, Vec<Blend>) {
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
            let (rho, base) = (share.at(square), base.at(square));
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
                shares: [shares[0], shares[1], base],
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

impl Steps {
    /// Of slices, by shares in the lobe and in the base over the square of the sine.
    pub fn of(slices: &[Grid], share: &Cubic, base: &Cubic) -> Self {
        let (sines, blends) = blends_of(slices, share, base);
        Self::new(&sines, &blends)
    }

    /// The step with the shares of the flux at a sine.
    #[inline]
    pub fn shares(&self, sine: f64) -> &Step {
        &self.shares[self.at(sine)]
    }

    /// The step with what f of two slices is multiplied by, and with the share of the base.
    #[inline]
    pub fn factors(&self, sine: f64) -> &Step {
        &self.factors[self.at(sine)]
    }

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

    /// The shares where steps begin, and where they end.
    pub fn ends(&self) -> impl Iterator<Item = [f64; 3]> {
        let to = self.from.iter().skip(1).copied().chain([1.0]);
        self.shares
            .iter()
            .zip(to)
            .flat_map(|(step, to)| [step.values, step.at(to)])
    }

    /// Without the base.
    pub fn without_base(&self) -> Self {
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

    /// With the share of the base.
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

#[cfg(test)]
mod tests {
    use etendue_math::special::exp;

    use super::super::table_grid::Slice;
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
        let grids: Vec<Grid> = slices.iter().map(|slice| slice.grid(None).expect("sound")).collect();
        let of = |pick: fn(&Slice) -> f64| {
            let squares: Vec<f64> = slices.iter().map(|slice| slice.sine * slice.sine).collect();
            Cubic::new(&squares, &slices.iter().map(pick).collect::<Vec<_>>())
        };
        let (share, base) = (of(|slice| slice.share), of(|slice| slice.base));
        let steps = Steps::of(&grids, &share, &base);
        let (sines, blends) = blends_of(&grids, &share, &base);
        assert!(4 * steps.from.len() < 3 * sines.len());
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
            let step = steps.shares(sine);
            assert_eq!(step.first as usize, blend.first);
            for (share, known) in step.at(sine).into_iter().zip(blend.shares) {
                assert!((share - known).abs() <= 1.0001 * TOLERANCE, "{sine}: {share} {known}");
            }
            let step = steps.factors(sine);
            let [one, other, base] = step.at(sine);
            let scale: f64 = blend.factors.iter().sum();
            assert_eq!(step.first as usize, blend.first);
            assert!((base - blend.shares[2]).abs() <= 1.0001 * TOLERANCE);
            for (factor, known) in [one, other].into_iter().zip(blend.factors) {
                assert!(
                    (factor - known).abs() <= 1.0001 * TOLERANCE * scale,
                    "{sine}: {factor} {known}"
                );
            }
        }
    }
}
