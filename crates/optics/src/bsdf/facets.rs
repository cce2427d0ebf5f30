//! Distributions of the slopes of a rough surface of small facets: Trowbridge and Reitz (GGX), Beckmann.
//!
//! Directions and facets are above the surface here, on the side of the light: heights are positive.

use std::f64::consts::FRAC_1_PI;

use etendue_math::Vec3;
use etendue_math::special::{exp, ierfc, ln_gamma, ln_gamma_of_both};
use etendue_math::trig::sin_cos_turns;

/// The slopes of facets: along the axis and across it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facets {
    alpha: [f64; 2],
    /// Otherwise of Beckmann: slopes of a normal distribution with standard deviations α/√2.
    ggx: bool,
}

/// Roughness that is described: smoother is as good as a mirror, rougher is no surface of facets.
const RANGE: [f64; 2] = [1e-3, 2.0];

impl Facets {
    /// # Errors
    /// If a roughness is out of range.
    pub fn new(alpha: [f64; 2], ggx: bool) -> Result<Self, String> {
        if alpha.iter().all(|a| (RANGE[0]..=RANGE[1]).contains(a)) {
            Ok(Self { alpha, ggx })
        } else {
            Err(format!(
                "roughness {} and {}; each must be from {} to {}",
                alpha[0], alpha[1], RANGE[0], RANGE[1]
            ))
        }
    }

    /// Whether the axis matters.
    pub fn turns(&self) -> bool {
        self.alpha[0] != self.alpha[1]
    }

    /// tan² of the slope of a facet over α².
    #[inline(always)]
    fn slope(&self, h: Vec3) -> f64 {
        let (x, y) = (h.x / self.alpha[0], h.y / self.alpha[1]);
        (x * x + y * y) / (h.z * h.z)
    }

    /// Density \[1/sr\] of the normals of facets over the area of the surface below them: ∫ D cos θ dΩ = 1 `[Walter2007]`.
    pub fn density(&self, h: Vec3) -> f64 {
        if h.z <= 0.0 {
            return 0.0;
        }
        let z2 = h.z * h.z;
        let t = self.slope(h);
        let shape = if self.ggx {
            1.0 / ((1.0 + t) * (1.0 + t))
        } else {
            exp(-t)
        };
        FRAC_1_PI * shape / (self.alpha[0] * self.alpha[1] * z2 * z2)
    }

    /// Of Trowbridge and Reitz; otherwise of Beckmann.
    pub fn ggx(&self) -> bool {
        self.ggx
    }

    /// Smith's Λ of a direction, times its height: how much the facets hide of each other `[Heitz2014]`.
    pub fn hidden(&self, d: Vec3) -> f64 {
        if self.ggx {
            self.hidden_of::<true>(d)
        } else {
            self.hidden_of::<false>(d)
        }
    }

    /// The same of a kind that is known beforehand.
    #[inline(always)]
    pub fn hidden_of<const GGX: bool>(&self, d: Vec3) -> f64 {
        let (x, y) = (d.x * self.alpha[0], d.y * self.alpha[1]);
        let across = (x * x + y * y).sqrt();
        if GGX {
            // (√(z² + q²) − z)/2 without a difference of like numbers.
            0.5 * across * across / ((d.z * d.z + across * across).sqrt() + d.z)
        } else {
            0.5 * across * ierfc(d.z / across)
        }
    }

    /// The part of the facets that both directions see, if they are on the same side, over the product of their heights, from
    /// what each has hidden.
    #[inline(always)]
    pub fn seen_by_both(i: f64, o: f64, hidden: [f64; 2]) -> f64 {
        1.0 / (i * o + hidden[0] * o + hidden[1] * i)
    }

    /// The same of directions on both sides of the surface, not over their heights: facets that are high for the one are low for
    /// the other `[Heitz2014]`.
    ///
    /// B(1 + a, 1 + b), which is less than 1/a and 1/b: where one of them is above [`MOST_HIDDEN`], nothing to speak of.
    #[inline(always)]
    pub fn seen_through(i: f64, o: f64, hidden: [f64; 2]) -> f64 {
        let (a, b) = (hidden[0] / i, hidden[1] / o);
        let (a, b) = (
            if a < MOST_HIDDEN { a } else { MOST_HIDDEN },
            if b < MOST_HIDDEN { b } else { MOST_HIDDEN },
        );
        exp(ln_gamma_of_both::<true>(1.0 + a, 1.0 + b) - ln_gamma(2.0 + a + b))
    }

    /// A facet that `i` sees, from two numbers, with the density of those of GGX with the same α `[Dupuy2023]`; how much more of
    /// such facets there are in this distribution over what each of GGX there is seen, and the most that this can be.
    ///
    /// With the chance of each facet that light arrives at it and gets away, over the second number, as acceptance, the
    /// directions have the density of the light.
    pub fn draw(&self, i: Vec3, [turn, height]: [f64; 2]) -> Drawn {
        let turn = sin_cos_turns(turn);
        if self.ggx {
            self.drawn::<true>(i, turn, height)
        } else {
            self.drawn::<false>(i, turn, height)
        }
    }

    /// The same of a kind that is known beforehand, from the sine and the cosine of the turn.
    #[inline(always)]
    pub fn drawn<const GGX: bool>(&self, i: Vec3, (sine, cosine): (f64, f64), height: f64) -> Drawn {
        let stretched = Vec3::new(i.x * self.alpha[0], i.y * self.alpha[1], i.z);
        let w = stretched * stretched.length().recip();
        let z = (1.0 - height) * (1.0 + w.z) - w.z;
        let across = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let cap = Vec3::new(across * cosine + w.x, across * sine + w.y, (z + w.z).max(0.0));
        let h = Vec3::new(cap.x * self.alpha[0], cap.y * self.alpha[1], cap.z);
        let h = h * h.length().max(f64::MIN_POSITIVE).recip();
        // Seen facets of GGX: D (i·h) G₁/z, with G₁/z = 1/(z + hidden).
        let proposed = i.z + self.hidden_of::<true>(i);
        if GGX {
            return Drawn {
                h,
                more: proposed,
                most: 1.0,
            };
        }
        let t = self.slope(h);
        let ratio = exp(-t) * (1.0 + t) * (1.0 + t);
        let ratio = if h.z > 0.0 { ratio } else { 0.0 };
        // e⁻ᵗ (1 + t)² is 4/e at most, for t = 1.
        let most = 4.0 * (-1.0_f64).exp() * proposed / (i.z + self.hidden_of::<GGX>(i));
        Drawn {
            h,
            more: ratio * proposed,
            most,
        }
    }
}

/// The most that facets hide of a direction over its height, as far as that is told apart.
const MOST_HIDDEN: f64 = 1e8;

/// A facet that is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// Its normal.
    pub h: Vec3,
    /// What the part of such facets that is seen by both directions, over the height of the first, is multiplied by to be the
    /// chance of light that goes there over that of drawing it.
    pub more: f64,
    /// The most of that chance.
    pub most: f64,
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// ∫ g cos θ dΩ over facets, by slopes.
    fn over_facets(facets: &Facets, g: impl Fn(Vec3) -> f64) -> f64 {
        let n = 400;
        let mut sum = 0.0;
        for i in 0..n {
            // tan² = α² u/(1 − u) is even in u over the projected area of GGX; 1 − u = (1 − v)² tames its tail.
            let v = (f64::from(i) + 0.5) / f64::from(n);
            let r = (1.0 - (1.0 - v) * (1.0 - v)).sqrt() / (1.0 - v);
            for k in 0..n {
                let (s, c) = (2.0 * PI * (f64::from(k) + 0.5) / f64::from(n)).sin_cos();
                let h = Vec3::new(r * c * facets.alpha[0], r * s * facets.alpha[1], 1.0);
                let h = h * h.length().recip();
                let ggx = Facets { ggx: true, ..*facets };
                sum += g(h) * facets.density(h) / ggx.density(h) * 2.0 * (1.0 - v);
            }
        }
        sum / f64::from(n * n)
    }

    #[test]
    fn facets_cover_the_surface_and_what_is_seen_of_them_is_its_projection() {
        for ggx in [true, false] {
            for alpha in [[0.3, 0.3], [0.7, 0.2]] {
                let facets = Facets::new(alpha, ggx).expect("sound");
                assert!((over_facets(&facets, |_| 1.0) - 1.0).abs() < 2e-4);
                for (x, y, z) in [(0.6, 0.0, 0.8), (0.48, 0.64, 0.6), (-0.3, 0.94, 0.162_480_768)] {
                    let d = Vec3::new(x, y, z);
                    // Without hiding each other they would show ∫ D max(0, d·h) dΩ: z (1 + Λ).
                    let shown = over_facets(&facets, |h| f64::max(0.0, d.dot(h)) / h.z);
                    let expected = z + facets.hidden(d);
                    assert!((shown / expected - 1.0).abs() < 2e-4, "{shown} {expected}");
                }
            }
        }
    }

    #[test]
    fn what_is_seen_through_a_surface_is_the_mean_over_the_heights_of_its_facets() {
        // Facets at the height of share t of all are seen with t^a from above and (1 − t)^b from below.
        for (a, b) in [(0.0, 0.0), (0.4, 0.0), (2.5, 0.7), (0.01, 30.0)] {
            let n = 400_000;
            let sum: f64 = (0..n)
                .map(|k| {
                    // Finer towards both ends, where there are roots.
                    let u = (f64::from(k) + 0.5) / f64::from(n);
                    let t = u * u * (3.0 - 2.0 * u);
                    t.powf(a) * (1.0 - t).powf(b) * 6.0 * u * (1.0 - u)
                })
                .sum();
            let found = Facets::seen_through(0.5, 0.25, [0.5 * a, 0.25 * b]);
            assert!((found / (sum / f64::from(n)) - 1.0).abs() < 1e-8, "{a} {b} {found}");
        }
        // Along the surface hardly anything is seen: 1/(1 + a) if nothing is hidden of the other direction.
        for a in [1e3, 1e5, 1e7] {
            let found = Facets::seen_through(1e-6, 1.0, [1e-6 * a, 0.0]);
            assert!((found * (1.0 + a) - 1.0).abs() < 1e-6, "{a} {found}");
        }
        assert!(Facets::seen_through(0.0, 1.0, [1.0, 0.5]) < 1e-8);
    }

    #[test]
    fn roughness_out_of_range_is_refused() {
        assert!(Facets::new([0.0, 0.1], true).is_err());
        assert!(Facets::new([0.1, f64::NAN], true).is_err());
    }
}
