//! The components of the light that leaves a surface, and their shares of the flux.

use etendue_sampling::warp::part_of;

/// A component of the light that leaves a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Mirrored (`false`), or refracted by Snell's law, which is straight on between equal media (`true`).
    Specular(bool),
    /// Scattered back (`false`), or to the other side (`true`).
    Diffuse(bool),
}

impl Component {
    /// In the order in which they are drawn.
    pub const ALL: [Self; 4] = [
        Self::Specular(false),
        Self::Specular(true),
        Self::Diffuse(false),
        Self::Diffuse(true),
    ];

    /// Whether the light goes on in a single direction.
    #[must_use]
    pub const fn is_specular(self) -> bool {
        matches!(self, Self::Specular(_))
    }

    /// Whether the light passes to the other side.
    #[must_use]
    pub const fn is_transmitted(self) -> bool {
        matches!(self, Self::Specular(true) | Self::Diffuse(true))
    }
}

/// Shares of the arriving flux that leave, reflected and transmitted; what they lack to 1 is absorbed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shares {
    /// In a single direction.
    pub specular: [f64; 2],
    /// In all directions of a side: the directional-hemispherical shares.
    pub diffuse: [f64; 2],
    /// Cosine of the angle of refraction: 0 if the light is totally reflected.
    pub refraction: f64,
}

impl Shares {
    /// Of all components together.
    #[inline]
    #[must_use]
    pub fn total(&self) -> f64 {
        self.specular[0] + self.specular[1] + self.diffuse[0] + self.diffuse[1]
    }

    /// In the order of [`Component::ALL`].
    #[inline(always)]
    #[must_use]
    pub const fn in_order(&self) -> [f64; 4] {
        [self.specular[0], self.specular[1], self.diffuse[0], self.diffuse[1]]
    }

    /// The component that a number from 0 to 1 picks by the shares; None: absorbed. What is left of the number when that is
    /// known is again spread evenly from 0 to 1.
    #[inline]
    #[must_use]
    pub fn pick(&self, number: f64) -> Option<(Component, f64)> {
        let shares = self.in_order();
        let mut sum = 0.0;
        for (share, component) in shares.iter().zip(Component::ALL) {
            if number < sum + share {
                return Some((component, part_of(number - sum, *share)));
            }
            sum += share;
        }
        // Shares that should add up to 1 may fall short of it by rounding.
        (sum >= 1.0 - 1e-12).then(|| {
            let last = shares.iter().rposition(|share| *share > 0.0).unwrap_or(0);
            (Component::ALL[last], 0.5)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_are_picked_by_their_shares_and_the_rest_is_absorbed() {
        let shares = Shares {
            specular: [0.1, 0.2],
            diffuse: [0.3, 0.15],
            refraction: 1.0,
        };
        let n = 100_000;
        let (mut counts, mut rests) = ([0; 5], [0.0; 5]);
        for k in 0..n {
            let picked = shares.pick((f64::from(k) + 0.5) / f64::from(n));
            let place = picked.map_or(4, |(c, _)| Component::ALL.iter().position(|m| *m == c).expect("known"));
            rests[place] += picked.map_or(0.0, |(_, rest)| rest);
            assert!(picked.is_none_or(|(_, rest)| (0.0..1.0).contains(&rest)));
            counts[place] += 1;
        }
        assert_eq!(counts, [10_000, 20_000, 30_000, 15_000, 25_000]);
        // What is left of the number is even in each of them.
        for (rest, count) in rests.iter().zip(counts).take(4) {
            assert!((rest / f64::from(count) - 0.5).abs() < 1e-4, "{rest}");
        }
    }

    #[test]
    fn shares_of_1_leave_no_number_unused() {
        let shares = Shares {
            specular: [0.1, 0.2],
            diffuse: [0.3, 0.4 - 1e-16],
            refraction: 1.0,
        };
        assert!(shares.pick(1.0 - f64::EPSILON / 2.0).is_some());
    }
}
