//! A rough metal of known n and k: how much its facets reflect depends on the medium in front of it.

use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, OnceLock};

use etendue_math::Vec3;
use etendue_math::special::{exp, ln};
use etendue_sampling::warp::part_of;

use super::contract::{Bsdf, Facts, Media, Parameters};
use super::rough_metal::RoughMetal;
use super::shares::Shares;
use crate::fresnel::fresnel_of_metal;
use crate::table::Table;

/// Steps of the logarithm of the index in front at which the metal is tabled, when light first arrives there; shares and f are
/// linear in between, which is off by a few 10⁻⁵.
const STEP: f64 = 1.0 / 64.0;

/// Number of the step whose index is 1, and of the last one, whose index is 10.
const VACUUM: usize = 45;
const LAST: usize = VACUUM + 148;

/// A rough metal, from both sides alike.
#[derive(Debug)]
pub struct RoughConductor {
    alpha: [f64; 2],
    ggx: bool,
    n: f64,
    k: f64,
    tabled: Vec<OnceLock<RoughMetal>>,
    facts: Facts,
}

impl RoughConductor {
    /// Of refractive index `n` and extinction coefficient `k` against vacuum.
    ///
    /// # Errors
    /// If a roughness is out of range, or n or k is no sound number.
    pub fn new(alpha: [f64; 2], ggx: bool, n: f64, k: f64) -> Result<Self, String> {
        if !(n > 0.0 && n.is_finite() && k >= 0.0 && k.is_finite()) {
            return Err("a metal without n above 0 and k of 0 or more".into());
        }
        let in_vacuum = RoughMetal::new(alpha, ggx, smooth(n, k))?;
        let facts = *in_vacuum.facts();
        let tabled: Vec<OnceLock<RoughMetal>> = (0..=LAST).map(|_| OnceLock::new()).collect();
        let _ = tabled[VACUUM].set(in_vacuum);
        Ok(Self {
            alpha,
            ggx,
            n,
            k,
            tabled,
            facts,
        })
    }

    /// From `alpha_x`, `alpha_y`, `ggx` (0 or 1), `index` and `extinction`; a [`RoughMetal`] where its reflectance is described.
    ///
    /// # Errors
    /// As [`RoughConductor::new`] and [`RoughMetal::described`].
    pub fn described(by: &dyn Parameters) -> Result<Arc<dyn Bsdf>, String> {
        let (Ok(n), Ok(k)) = (by.number("index"), by.number("extinction")) else {
            return RoughMetal::described(by);
        };
        let alpha = [by.number("alpha_x")?, by.number("alpha_y")?];
        Ok(Arc::new(Self::new(alpha, by.number("ggx")? != 0.0, n, k)?))
    }

    fn at(&self, step: usize) -> &RoughMetal {
        self.tabled[step].get_or_init(|| {
            let outside = exp((step as f64 - VACUUM as f64) * STEP);
            let reflectance = smooth(self.n / outside, self.k / outside);
            RoughMetal::new(self.alpha, self.ggx, reflectance).expect("as sound as in vacuum")
        })
    }

    /// The metal at the steps below and above the index in front, and the weight of the second; in vacuum twice the same.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a number from 0 to LAST"
    )]
    fn around(&self, incident: Vec3, media: &Media) -> ([&RoughMetal; 2], f64) {
        let [here, _] = media.seen_from(incident);
        let place = (VACUUM as f64 + ln(here) / STEP).clamp(0.0, LAST as f64);
        let below = place as usize;
        let weight = place - below as f64;
        let above = if weight > 0.0 { below + 1 } else { below };
        ([self.at(below), self.at(above)], weight)
    }
}

/// The reflectance of a smooth surface, by the angle of incidence: every 0.5°, and near the horizon every 0.1°.
fn smooth(n: f64, k: f64) -> Table {
    let coarse = (0..160).map(|i| 0.5 * f64::from(i));
    let fine = (0..=100).map(|i| 80.0 + 0.1 * f64::from(i));
    let angles: Vec<f64> = coarse
        .chain(fine)
        .map(|degrees| degrees.to_radians().min(FRAC_PI_2))
        .collect();
    let values = angles.iter().map(|angle| fresnel_of_metal(angle.cos(), n, k)).collect();
    Table::new(angles, vec![555.0], values).expect("rising angles, and shares")
}

impl Bsdf for RoughConductor {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn is_selective(&self) -> bool {
        false
    }

    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let ([below, above], weight) = self.around(incident, media);
        let (mut shares, other) = (below.shares(incident, media), above.shares(incident, media));
        shares.diffuse[0] += weight * (other.diffuse[0] - shares.diffuse[0]);
        shares
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        let ([below, above], weight) = self.around(incident, media);
        let f = below.evaluate(incident, scattered, media);
        if weight == 0.0 {
            return f;
        }
        f + weight * (above.evaluate(incident, scattered, media) - f)
    }

    fn draw(&self, incident: Vec3, transmitted: bool, media: &Media, numbers: [f64; 2]) -> Vec3 {
        let ([below, above], weight) = self.around(incident, media);
        if weight == 0.0 {
            return below.draw(incident, transmitted, media, numbers);
        }
        let [one, two] = [(below, 1.0 - weight), (above, weight)]
            .map(|(metal, weight)| weight * metal.shares(incident, media).diffuse[0]);
        let chance = one / (one + two);
        let [number, turn] = numbers;
        if number < chance {
            below.draw(incident, transmitted, media, [part_of(number, chance), turn])
        } else {
            above.draw(
                incident,
                transmitted,
                media,
                [part_of(number - chance, 1.0 - chance), turn],
            )
        }
    }
}

#[cfg(test)]
impl super::examples::Examples for RoughConductor {
    const MEDIA: bool = true;

    fn examples() -> Vec<Self> {
        [([0.5, 0.5], 1.2, 2.0), ([0.8, 0.4], 0.96, 6.69)]
            .map(|(alpha, n, k)| Self::new(alpha, true, n, k).expect("sound"))
            .into()
    }

    // As of rough metals.
    const QUADRATURE: f64 = 5e-4;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_one_reflects_by_the_medium_in_front() {
        let bsdf = RoughConductor::new([1e-3, 1e-3], true, 1.2, 2.0).expect("sound");
        for (front, back) in [(1.0, 1.0), (1.33, 1.0), (1.5186, 1.7), (0.8, 1.0)] {
            let media = Media {
                wavelength: 555.0,
                front,
                back,
            };
            for height in [1.0_f64, 0.8, 0.5] {
                let across = (1.0 - height * height).sqrt();
                for (side, outside) in [(height, front), (-height, back)] {
                    let found = bsdf.shares(Vec3::new(across, 0.0, side), &media).diffuse[0];
                    let expected = fresnel_of_metal(height, 1.2 / outside, 2.0 / outside);
                    // But for the mean slope of its facets.
                    assert!((found - expected).abs() < 1e-3, "{outside} {side}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_metal_is_refused() {
        for (n, k) in [(0.0, 1.0), (1.0, -1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY)] {
            assert!(RoughConductor::new([0.1, 0.1], true, n, k).is_err());
        }
    }
}
