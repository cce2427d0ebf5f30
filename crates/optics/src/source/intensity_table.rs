//! Intensity distributions, from which points and flat surfaces emit.

use std::f64::consts::PI;

use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::alias::Alias;

use super::numbers::Numbers;

/// Intensity by a C-γ table: γ from +z, C from +x towards +y, bilinear between the nodes, 0 where there are none.
///
/// The planes go once around: after the last one comes the first.
#[derive(Clone, Debug)]
pub struct IntensityTable {
    /// \[rad\], from 0 on, increasing.
    c: Vec<f64>,
    /// \[rad\], increasing.
    gamma: Vec<f64>,
    /// Plane by plane; the integral over all directions is 1.
    values: Vec<f64>,
    cells: Alias,
}

/// ∫ sin γ dγ and ∫ γ sin γ dγ between two angles.
fn moments(a: f64, b: f64) -> [f64; 2] {
    [a.cos() - b.cos(), (b.sin() - b * b.cos()) - (a.sin() - a * a.cos())]
}

impl IntensityTable {
    /// None unless the nodes increase, the values are finite and not negative with a positive integral, and their numbers fit.
    #[must_use]
    pub fn new(c: Vec<f64>, gamma: Vec<f64>, values: &[f64]) -> Option<Self> {
        let increasing = |x: &[f64]| x.iter().all(|v| v.is_finite()) && x.windows(2).all(|w| w[0] < w[1]);
        let planes = !c.is_empty() && increasing(&c) && c[0] >= 0.0 && c[c.len() - 1] < 2.0 * PI;
        let angles = gamma.len() > 1 && increasing(&gamma) && gamma[0] >= 0.0 && gamma[gamma.len() - 1] <= PI + 1e-12;
        let sound = values.iter().all(|v| v.is_finite() && *v >= 0.0) && values.len() == c.len() * gamma.len();
        if !(planes && angles && sound) {
            return None;
        }
        let mut table = Self {
            c,
            gamma,
            values: values.to_vec(),
            cells: Alias::new(&[1.0])?,
        };
        let fluxes: Vec<f64> = (0..table.c.len())
            .flat_map(|i| (0..table.gamma.len() - 1).map(move |j| (i, j)))
            .map(|(i, j)| table.cell_flux(i, j))
            .collect();
        let total: f64 = fluxes.iter().sum();
        table.cells = Alias::new(&fluxes)?;
        table.values.iter_mut().for_each(|v| *v /= total);
        Some(table)
    }

    /// The two planes of cell `i` and the angle between them.
    fn planes(&self, i: usize) -> (usize, usize, f64) {
        let next = (i + 1) % self.c.len();
        let width = if next == 0 {
            self.c[0] + 2.0 * PI - self.c[i]
        } else {
            self.c[next] - self.c[i]
        };
        (i, next, width)
    }

    /// ∫∫ I sin γ dγ dC over a cell: the mean of its planes, times the integral of a linear function.
    fn cell_flux(&self, i: usize, j: usize) -> f64 {
        let (a, b, width) = self.planes(i);
        let n = self.gamma.len();
        let mean = |j: usize| 0.5 * (self.values[a * n + j] + self.values[b * n + j]);
        let (from, to) = (self.gamma[j], self.gamma[j + 1]);
        let slope = (mean(j + 1) - mean(j)) / (to - from);
        let [zeroth, first] = moments(from, to);
        width * ((mean(j) - slope * from) * zeroth + slope * first)
    }

    /// Whether no light goes beyond γ = 90°.
    #[must_use]
    pub fn is_in_front(&self) -> bool {
        self.gamma[self.gamma.len() - 1] <= 0.5 * PI * (1.0 + 1e-12)
    }

    /// Intensity per unit of flux \[1/sr\] towards a unit vector.
    #[must_use]
    pub fn intensity(&self, d: Vec3) -> f64 {
        let gamma = d.x.hypot(d.y).atan2(d.z);
        let turn = d.y.atan2(d.x).rem_euclid(2.0 * PI);
        let n = self.gamma.len();
        if gamma < self.gamma[0] || gamma > self.gamma[n - 1] {
            return 0.0;
        }
        let j = (self.gamma.partition_point(|g| *g <= gamma).max(1) - 1).min(n - 2);
        let v = (gamma - self.gamma[j]) / (self.gamma[j + 1] - self.gamma[j]);
        // Before the first plane lies the cell after the last one.
        let i = self
            .c
            .partition_point(|c| *c <= turn)
            .checked_sub(1)
            .unwrap_or(self.c.len() - 1);
        let (a, b, width) = self.planes(i);
        let u = (turn - self.c[i]).rem_euclid(2.0 * PI) / width;
        let at = |plane: usize| (1.0 - v) * self.values[plane * n + j] + v * self.values[plane * n + j + 1];
        (1.0 - u) * at(a) + u * at(b)
    }

    /// A direction with the density of the intensity: a cell by its flux, then rejection from its largest corner.
    #[must_use]
    pub fn draw(&self, numbers: &mut Numbers) -> Vec3 {
        let n = self.gamma.len();
        let cell = self.cells.pick(numbers.draw());
        let (i, j) = (cell / (n - 1), cell % (n - 1));
        let (a, b, width) = self.planes(i);
        let corner = [a, b].map(|p| [self.values[p * n + j], self.values[p * n + j + 1]]);
        let most = corner.iter().flatten().copied().fold(0.0, f64::max);
        let (top, bottom) = (self.gamma[j].cos(), self.gamma[j + 1].cos());
        loop {
            let (u, w) = (numbers.draw(), numbers.draw());
            let cosine = top + w * (bottom - top);
            let v = (cosine.clamp(-1.0, 1.0).acos() - self.gamma[j]) / (self.gamma[j + 1] - self.gamma[j]);
            let at = |k: usize| (1.0 - v) * corner[k][0] + v * corner[k][1];
            if numbers.draw() * most <= (1.0 - u) * at(0) + u * at(1) {
                let (s, c) = sin_cos_turns(((self.c[i] + u * width) / (2.0 * PI)).fract());
                let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
                return Vec3::new(sine * c, sine * s, cosine);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use etendue_sampling::philox::Stream;

    fn lopsided() -> IntensityTable {
        let c = [0.3, 1.0, 2.5, 5.0].to_vec();
        let gamma = [0.1, 0.6, 1.2, 2.0].to_vec();
        let values = [
            1.0, 3.0, 2.0, 0.0, 2.0, 0.5, 4.0, 1.0, 0.0, 1.0, 0.2, 0.1, 5.0, 1.0, 1.0, 2.0,
        ];
        IntensityTable::new(c, gamma, &values).expect("sound")
    }

    #[test]
    fn the_intensity_integrates_to_the_flux() {
        let table = lopsided();
        let (n, m) = (1200, 1800);
        let mut sum = 0.0;
        for i in 0..n {
            let gamma = 0.1 + 1.9 * (f64::from(i) + 0.5) / f64::from(n);
            for k in 0..m {
                let c = 2.0 * PI * (f64::from(k) + 0.5) / f64::from(m);
                let d = Vec3::new(gamma.sin() * c.cos(), gamma.sin() * c.sin(), gamma.cos());
                sum += table.intensity(d) * gamma.sin() * 1.9 / f64::from(n) * 2.0 * PI / f64::from(m);
            }
        }
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
    }

    #[test]
    fn directions_have_the_density_of_the_intensity() {
        // χ² over 8 × 6 bins in C and cos γ against the midpoint rule; 1e-4 point of 47 degrees of freedom: 92.7.
        let table = lopsided();
        let rays = 200_000;
        let mut counts = [0.0; 48];
        let (top, bottom) = (0.1_f64.cos(), 2.0_f64.cos());
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bins")]
        let bin = |d: Vec3| {
            let i = (d.y.atan2(d.x).rem_euclid(2.0 * PI) / (2.0 * PI) * 8.0) as usize;
            let j = ((d.z - top) / (bottom - top) * 6.0) as usize;
            i.min(7) * 6 + j.min(5)
        };
        for i in 0..rays {
            let mut numbers = Numbers::new(Stream::new(1, 2), i, 0);
            counts[bin(table.draw(&mut numbers))] += 1.0;
        }
        let mut expected = [0.0; 48];
        let (n, m) = (960, 720);
        for i in 0..n {
            let c = 2.0 * PI * (f64::from(i) + 0.5) / f64::from(n);
            for k in 0..m {
                let z = top + (bottom - top) * (f64::from(k) + 0.5) / f64::from(m);
                let sine = (1.0 - z * z).sqrt();
                let d = Vec3::new(sine * c.cos(), sine * c.sin(), z);
                expected[bin(d)] += table.intensity(d) * 2.0 * PI * (top - bottom) / f64::from(n * m);
            }
        }
        let chi2: f64 = counts
            .iter()
            .zip(expected)
            .map(|(n, e)| (n - e * rays as f64).powi(2) / (e * rays as f64))
            .sum();
        assert!(chi2 < 92.7, "{chi2}");
    }
}
