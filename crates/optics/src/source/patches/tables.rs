//! Intensity tables of patches: bilinear in (θ, φ), periodic in φ, rows Δθ apart but for the last ones at 90° − Δθ/4 and 90°.

use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;

use crate::source::numbers::Numbers;

/// Steps of a table \[°\]: Δθ divides 90, Δφ divides 360.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// Δθ.
    pub theta: u16,
    /// Δφ.
    pub phi: u16,
}

impl Steps {
    /// Nodes along φ.
    #[must_use]
    pub fn columns(self) -> usize {
        usize::from(360 / self.phi)
    }

    /// Nodes along θ, the one at 90° included.
    #[must_use]
    pub fn rows(self) -> usize {
        usize::from(90 / self.theta) + 2
    }

    /// θ of a row \[°\].
    #[must_use]
    pub fn theta_of(self, row: usize) -> f64 {
        let whole = usize::from(90 / self.theta);
        match row {
            row if row < whole => (row * usize::from(self.theta)) as f64,
            row if row == whole => 90.0 - f64::from(self.theta) / 4.0,
            _ => 90.0,
        }
    }

    /// The value of a table towards a unit vector in its axes; 0 for θ ≥ 90°.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "angles are not negative, and small"
    )]
    #[must_use]
    pub fn value(self, table: &[f64], k: Vec3) -> f64 {
        let theta = k.x.hypot(k.y).atan2(k.z).to_degrees();
        if theta >= 90.0 {
            return 0.0;
        }
        let whole = usize::from(90 / self.theta);
        let row = if theta >= self.theta_of(whole) {
            whole
        } else {
            ((theta / f64::from(self.theta)) as usize).min(whole - 1)
        };
        let (low, high) = (self.theta_of(row), self.theta_of(row + 1));
        let up = (theta - low) / (high - low);
        let columns = self.columns();
        let turn = k.y.atan2(k.x).to_degrees().rem_euclid(360.0) / f64::from(self.phi);
        let left = turn as usize % columns;
        let aside = turn - turn.floor();
        let right = (left + 1) % columns;
        let at = |row: usize| (1.0 - aside) * table[row * columns + left] + aside * table[row * columns + right];
        (1.0 - up) * at(row) + up * at(row + 1)
    }

    /// A unit vector with the density of the hat function about a node.
    #[must_use]
    pub fn draw_about(self, node: usize, numbers: &mut Numbers) -> Vec3 {
        let columns = self.columns();
        let (row, column) = (node / columns, node % columns);
        let theta = self.draw_theta(row, numbers);
        let turn = (column as f64 + numbers.draw() + numbers.draw() - 1.0) / columns as f64;
        let (s, c) = sin_cos_turns(turn.rem_euclid(1.0));
        let (sine, cosine) = theta.sin_cos();
        Vec3::new(sine * c, sine * s, cosine)
    }

    /// θ \[rad\] with a density proportional to sin θ times the hat about a row.
    fn draw_theta(self, row: usize, numbers: &mut Numbers) -> f64 {
        let at = |row: usize| self.theta_of(row).to_radians();
        let (a, b, c) = (at(row.saturating_sub(1)), at(row), at((row + 1).min(self.rows() - 1)));
        loop {
            let u = [numbers.draw(), numbers.draw(), numbers.draw()];
            // About the pole θ (1 − θ/Δθ), the median of three uniform numbers; elsewhere the hat itself.
            let (theta, bound) = if row == 0 {
                let theta = c * (u[0].min(u[1]).max(u[0].max(u[1]).min(u[2])));
                (theta, theta)
            } else {
                let beyond = if u[0] * (c - a) > b - a { c - b } else { a - b };
                (b + beyond * (1.0 - u[1].sqrt()), c.sin())
            };
            if numbers.draw() * bound < theta.sin() {
                return theta;
            }
        }
    }
}
