//! A clear coat over a diffuse base: gloss paint.

use std::f64::consts::FRAC_1_PI;
use std::sync::Arc;

use etendue_math::Vec3;
use etendue_math::special::ln;
use etendue_sampling::more_numbers::MoreNumbers;

use super::contract::{Bsdf, Facts, Media, Parameters, Parts, Product, by_cosine};
use super::shares::Shares;
use crate::fresnel::fresnel;
use crate::table::Table;

/// A smooth coat of a refractive index on a Lambertian base, from both sides alike.
///
/// Fresnel's part is mirrored at the coat. Of the rest, the base scatters the share ρ; of that the coat lets out 1 − F(θₛ) in
/// each direction and sends back the rest, again and again `[Saunderson1942]`:
/// f = (1 − F(θᵢ)) (1 − F(θₛ)) ρ / (π m² (1 − ρ Fᵢₙ)), m being the index of the coat over that outside and Fᵢₙ the
/// reflectance of the coat for diffuse light from within.
#[derive(Clone, Debug)]
pub struct Coated {
    index: f64,
    base: Table,
    facts: Facts,
    /// What the coat lets out of diffuse light from within into a medium of index 1.
    usual: f64,
}

/// Reflectance of a smooth surface for diffuse light from the side of the lower index, m being the ratio of both
/// `[Duntley1942]`.
fn diffuse_reflectance(m: f64) -> f64 {
    if m == 1.0 {
        return 0.0;
    }
    let (m2, m4) = (m * m, m * m * m * m);
    0.5 + (m - 1.0) * (3.0 * m + 1.0) / (6.0 * (m + 1.0) * (m + 1.0))
        + m2 * (m2 - 1.0) * (m2 - 1.0) / ((m2 + 1.0) * (m2 + 1.0) * (m2 + 1.0)) * ln((m - 1.0) / (m + 1.0))
        - 2.0 * m2 * m * (m2 + 2.0 * m - 1.0) / ((m2 + 1.0) * (m4 - 1.0))
        + 8.0 * m4 * (m4 + 1.0) / ((m2 + 1.0) * (m4 - 1.0) * (m4 - 1.0)) * ln(m)
}

/// The share of diffuse light from within a medium that its smooth surface lets out, m being its index over that outside.
fn let_out(m: f64) -> f64 {
    if m >= 1.0 {
        (1.0 - diffuse_reflectance(m)) / (m * m)
    } else {
        1.0 - diffuse_reflectance(1.0 / m)
    }
}

impl Coated {
    /// None if the index is less than 1 or not finite, or the base has no reflectance from 0 to 1 that is the same at all angles.
    #[must_use]
    pub fn new(index: f64, base: Table) -> Option<Self> {
        let sound = Table::are_shares(std::slice::from_ref(&base)) && !base.depends_on_angle();
        if !(sound && index.is_finite() && index >= 1.0) {
            return None;
        }
        let facts = Facts {
            specular: [true, false],
            diffuse: [!base.is_zero(), false],
            lambertian: base.is_zero(),
            reciprocal: true,
            constant: None,
            fresnel: false,
        };
        Some(Self {
            index,
            base,
            facts,
            usual: let_out(index),
        })
    }

    /// From `index` and `base_reflectance`.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn described(by: &dyn Parameters) -> Result<Arc<dyn Bsdf>, String> {
        let found = Self::new(by.number("index")?, by.table("base_reflectance")?);
        Ok(Arc::new(found.ok_or(
            "an index below 1, or a base whose reflectance depends on angle",
        )?))
    }

    /// The share that the coat mirrors.
    fn mirrored(&self, cosine: f64, outside: f64) -> f64 {
        fresnel(cosine, outside, self.index).reflectance
    }

    /// The share of diffuse light from within that the coat lets out.
    fn lets_out(&self, outside: f64) -> f64 {
        if outside == 1.0 {
            self.usual
        } else {
            let_out(self.index / outside)
        }
    }

    /// Of light within the coat on its way to the base: the share that leaves it at last.
    fn leaves(&self, outside: f64, wavelength: f64) -> f64 {
        let (rho, out) = (self.base.at(1.0, wavelength), self.lets_out(outside));
        rho * out / (1.0 - rho * (1.0 - out))
    }
}

/// How often is tried again for a direction that the coat lets out.
const TRIES: u32 = 10_000;

impl Bsdf for Coated {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn is_selective(&self) -> bool {
        self.base.depends_on_wavelength()
    }

    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let [outside, _] = media.seen_from(incident);
        let mirrored = self.mirrored(incident.z.abs(), outside);
        Shares {
            specular: [mirrored, 0.0],
            diffuse: [(1.0 - mirrored) * self.leaves(outside, media.wavelength), 0.0],
            refraction: incident.z.abs(),
        }
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        if (incident.z > 0.0) != (scattered.z > 0.0) {
            return 0.0;
        }
        let [outside, _] = media.seen_from(incident);
        let there = (1.0 - self.mirrored(incident.z.abs(), outside)) * self.leaves(outside, media.wavelength);
        there * FRAC_1_PI * self.leaving(scattered, media)
    }

    fn parts(&self) -> Option<Parts<'_>> {
        Some(Parts {
            product: self,
            rest: None,
        })
    }

    fn draw(&self, incident: Vec3, _transmitted: bool, media: &Media, numbers: [f64; 2]) -> Vec3 {
        let [outside, _] = media.seen_from(incident);
        let mut more = MoreNumbers::new(numbers);
        let mut pair = numbers;
        for _ in 0..TRIES {
            let d = by_cosine(incident.z > 0.0, pair);
            if d.z != 0.0 && more.draw() >= self.mirrored(d.z.abs(), outside) {
                return d;
            }
            pair = more.pair();
        }
        by_cosine(incident.z > 0.0, numbers)
    }
}

impl Product for Coated {
    fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2] {
        self.shares(incident, media).diffuse
    }

    fn leaving(&self, scattered: Vec3, media: &Media) -> f64 {
        let [outside, _] = media.seen_from(scattered);
        let m = self.index / outside;
        (1.0 - self.mirrored(scattered.z.abs(), outside)) / (m * m * self.lets_out(outside))
    }

    fn is_even(&self) -> bool {
        false
    }
}

#[cfg(test)]
impl super::examples::Examples for Coated {
    const MEDIA: bool = true;

    fn examples() -> Vec<Self> {
        [(1.65, 0.9), (1.6, 0.0), (1.8, 1.0)]
            .map(|(index, base)| Self::new(index, Table::constant(base)).expect("sound"))
            .to_vec()
    }

    // Fresnel's reflectance rises with infinite slope towards grazing angles. Of indices below that outside, where it has a
    // kink at the angle of total reflection, the shares are held against closed forms below.
    const QUADRATURE: f64 = 2e-4;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diffuse_reflectances_of_glass_are_those_of_a_quadrature() {
        // Of unpolarised light from outside and from within, by an independent quadrature.
        for (m, outside, inside) in [
            (1.49, 0.090_306, 0.590_246),
            (1.5, 0.091_778, 0.596_346),
            (1.586, 0.104_245, 0.643_891),
        ] {
            assert!((diffuse_reflectance(m) - outside).abs() < 1e-6);
            assert!((1.0 - let_out(m) - inside).abs() < 1e-6);
            assert!((1.0 - let_out(1.0 / m) - outside).abs() < 1e-6);
        }
        assert!((let_out(1.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn white_under_a_clear_coat_loses_nothing() {
        let white = Coated::new(1.5, Table::constant(1.0)).expect("sound");
        let media = Media {
            wavelength: 555.0,
            front: 1.0,
            back: 1.0,
        };
        for height in [1.0_f64, 0.5, 0.01] {
            let incident = Vec3::new((1.0 - height * height).sqrt(), 0.0, height);
            assert!((white.shares(incident, &media).total() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn impossible_coats_are_refused() {
        assert!(Coated::new(0.9, Table::constant(0.5)).is_none());
        assert!(Coated::new(f64::NAN, Table::constant(0.5)).is_none());
        assert!(Coated::new(1.5, Table::constant(1.2)).is_none());
    }
}
