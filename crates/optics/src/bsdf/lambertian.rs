//! Light that is scattered with the same luminance in all directions of a side: Lambert's law.

use std::f64::consts::FRAC_1_PI;

use etendue_math::Vec3;

use super::contract::{Bsdf, Facts, Media, Outward, Parts, Product};
use super::shares::Shares;
use crate::table::Table;

/// Cosines of the angle of incidence at which is asked how much light may come from a side.
const ASKED: [f64; 3] = [0.9, 0.5, 0.1];

/// Shares that are scattered back and to the other side, by angle of incidence and wavelength, the same from both sides.
///
/// A share ρ(θ) spreads evenly over projected solid angle: f = ρ(θ)/π, eqs. 4.1 and 4.2 of \[Audenaert2014\].
#[derive(Clone, Debug, PartialEq)]
pub struct Lambertian {
    tables: [Table; 2],
    facts: Facts,
}

impl Lambertian {
    /// None if a share is negative or both exceed 1 together.
    #[must_use]
    pub fn new(reflectance: Table, transmittance: Table) -> Option<Self> {
        let tables = [reflectance, transmittance];
        let constant = tables.each_ref().map(Table::constant_value);
        let facts = Facts {
            specular: [false; 2],
            diffuse: tables.each_ref().map(|table| !table.is_zero()),
            lambertian: true,
            // Luminance over n² is what both sides would have to share.
            reciprocal: tables[1].is_zero() && !tables[0].depends_on_angle(),
            constant: constant[0].zip(constant[1]).map(|(r, t)| [0.0, 0.0, r, t]),
            fresnel: false,
        };
        Table::are_shares(&tables).then_some(Self { tables, facts })
    }
}

impl Bsdf for Lambertian {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn is_selective(&self) -> bool {
        self.tables.iter().any(Table::depends_on_wavelength)
    }

    #[inline]
    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let cosine = incident.z.abs();
        Shares {
            specular: [0.0; 2],
            diffuse: self.tables.each_ref().map(|table| table.at(cosine, media.wavelength)),
            refraction: cosine,
        }
    }

    #[inline]
    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        let transmitted = (incident.z > 0.0) != (scattered.z > 0.0);
        self.tables[usize::from(transmitted)].at(incident.z.abs(), media.wavelength) * FRAC_1_PI
    }

    fn parts(&self) -> Option<Parts<'_>> {
        Some(Parts {
            product: self,
            rest: None,
        })
    }

    fn breakpoints(&self) -> Option<[Vec<f64>; 2]> {
        Some(Table::breakpoints(&self.tables))
    }

    fn outward(&self, scattered: Vec3, media: &Media) -> Outward {
        let chances = self.tables.each_ref().map(|table| {
            let most = ASKED.map(|cosine| table.at(cosine, media.wavelength));
            most.into_iter().fold(0.0, f64::max)
        });
        // Directions are drawn without regard to what goes back.
        Outward {
            scattered,
            back: chances,
            chances,
        }
    }
}

impl Product for Lambertian {
    #[inline]
    fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2] {
        self.shares(incident, media).diffuse
    }
}

#[cfg(test)]
impl super::examples::Examples for Lambertian {
    fn examples() -> Vec<Self> {
        let table = |a: f64, b: f64| Table::new(vec![0.0, 1.5], vec![500.0], vec![a, b]).expect("sound");
        [
            (Table::constant(0.984), Table::constant(0.0)),
            (Table::constant(0.0), Table::constant(0.0)),
            (Table::constant(0.2), Table::constant(0.7)),
            (table(0.3, 0.9), table(0.6, 0.05)),
        ]
        .map(|(r, t)| Self::new(r, t).expect("at most 1"))
        .to_vec()
    }
}
