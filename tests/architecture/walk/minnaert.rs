//! Diffuse reflection that is weaker the more light comes and goes along the surface: Minnaert's law.

use std::f64::consts::PI;
use std::sync::Arc;

use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;

use super::contract::{Bsdf, Facts, Media, Parameters};
use super::shares::Shares;
use crate::table::Table;

/// f = ρ (n + 2)/(2π) (cos θᵢ cos θₛ)ⁿ: of light along the normal the share ρ is reflected, of other light ρ cosⁿθᵢ. n = 0 is
/// Lambert's law.
#[derive(Clone, Debug)]
pub struct Minnaert {
    reflectance: Table,
    exponent: f64,
    facts: Facts,
}

impl Minnaert {
    /// None if the share is none, or depends on angle, or the exponent is negative.
    #[must_use]
    pub fn new(reflectance: Table, exponent: f64) -> Option<Self> {
        let sound = Table::are_shares(std::slice::from_ref(&reflectance)) && !reflectance.depends_on_angle();
        if !(sound && exponent.is_finite() && exponent >= 0.0) {
            return None;
        }
        let constant = reflectance.constant_value().filter(|r| exponent == 0.0 || *r == 0.0);
        let facts = Facts {
            specular: [false; 2],
            diffuse: [!reflectance.is_zero(), false],
            lambertian: exponent == 0.0 || reflectance.is_zero(),
            reciprocal: true,
            constant: constant.map(|r| [0.0, 0.0, r, 0.0]),
            fresnel: false,
        };
        Some(Self {
            reflectance,
            exponent,
            facts,
        })
    }

    /// From the share along the normal and the exponent.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn described(by: &dyn Parameters) -> Result<Arc<dyn Bsdf>, String> {
        let found = Self::new(by.table("diffuse_reflectance")?, by.number("exponent")?);
        let bsdf = found.ok_or("a reflectance that is no share or depends on angle, or an exponent below 0")?;
        Ok(Arc::new(bsdf))
    }

    fn share(&self, cosine: f64, media: &Media) -> f64 {
        self.reflectance.at(1.0, media.wavelength) * cosine.abs().powf(self.exponent)
    }
}

impl Bsdf for Minnaert {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        Shares {
            specular: [0.0; 2],
            diffuse: [self.share(incident.z, media), 0.0],
            refraction: incident.z.abs(),
        }
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        if (incident.z > 0.0) != (scattered.z > 0.0) {
            return 0.0;
        }
        // The product of the cosines first: the same value there and back.
        self.share(incident.z * scattered.z, media) * (self.exponent + 2.0) / (2.0 * PI)
    }

    fn draw(&self, incident: Vec3, _transmitted: bool, _media: &Media, [height, turn]: [f64; 2]) -> Vec3 {
        // ∫ cosⁿ⁺¹θ sin θ dθ from 0: 1 − cosⁿ⁺²θ is uniform.
        let cosine = (1.0 - height).powf(1.0 / (self.exponent + 2.0));
        let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
        let (s, c) = sin_cos_turns(turn);
        Vec3::new(sine * c, sine * s, cosine.copysign(incident.z))
    }
}

#[cfg(test)]
impl super::examples::Examples for Minnaert {
    fn examples() -> Vec<Self> {
        let coloured = Table::new(vec![0.0], vec![450.0, 700.0], vec![0.2, 0.9]).expect("sound");
        [
            (Table::constant(0.9), 1.0),
            (coloured, 3.0),
            (Table::constant(0.5), 0.0),
            (Table::constant(0.0), 2.0),
        ]
        .map(|(reflectance, exponent)| Self::new(reflectance, exponent).expect("a share"))
        .to_vec()
    }
}
