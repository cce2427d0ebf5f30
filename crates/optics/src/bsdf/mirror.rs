//! Light that leaves in a single direction, by given shares: mirrors, half mirrors, clear films.

use etendue_math::Vec3;

use super::contract::{Bsdf, Facts, Media};
use super::shares::Shares;
use crate::fresnel::fresnel;
use crate::table::Table;

/// Shares that are mirrored and refracted, by angle of incidence and wavelength, the same from both sides.
///
/// Beyond the critical angle nothing can be refracted: that share is mirrored as well.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    tables: [Table; 2],
    facts: Facts,
}

impl Mirror {
    /// None if a share is negative or both exceed 1 together.
    #[must_use]
    pub fn new(reflectance: Table, transmittance: Table) -> Option<Self> {
        let tables = [reflectance, transmittance];
        let constant = tables.each_ref().map(Table::constant_value);
        let specular = tables.each_ref().map(|table| !table.is_zero());
        let facts = Facts {
            specular,
            diffuse: [false; 2],
            lambertian: true,
            // The angle of incidence is another one on the other side.
            reciprocal: !specular[1] || !tables[1].depends_on_angle(),
            constant: constant[0].zip(constant[1]).map(|(r, t)| [r, t, 0.0, 0.0]),
            fresnel: false,
        };
        Table::are_shares(&tables).then_some(Self { tables, facts })
    }
}

impl Bsdf for Mirror {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn is_selective(&self) -> bool {
        self.tables.iter().any(Table::depends_on_wavelength)
    }

    #[inline]
    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let cosine = incident.z.abs();
        let mut specular = self.tables.each_ref().map(|table| table.at(cosine, media.wavelength));
        let mut refraction = cosine;
        if specular[1] > 0.0 && media.front != media.back {
            let [n1, n2] = media.seen_from(incident);
            refraction = fresnel(cosine, n1, n2).cosine;
            if refraction == 0.0 {
                specular = [specular[0] + specular[1], 0.0];
            }
        }
        Shares {
            specular,
            diffuse: [0.0; 2],
            refraction,
        }
    }

    fn is_nothing(&self, media: &Media) -> bool {
        media.front == media.back && self.facts.constant == Some([0.0, 1.0, 0.0, 0.0])
    }

    fn breakpoints(&self) -> Option<[Vec<f64>; 2]> {
        Some(Table::breakpoints(&self.tables))
    }
}

#[cfg(test)]
impl super::examples::Examples for Mirror {
    const MEDIA: bool = true;

    fn examples() -> Vec<Self> {
        let table = |a: f64, b: f64| Table::new(vec![0.0, 1.5], vec![500.0], vec![a, b]).expect("sound");
        [
            (Table::constant(0.9), Table::constant(0.0)),
            (Table::constant(0.25), Table::constant(0.75)),
            (table(0.3, 0.9), table(0.6, 0.05)),
        ]
        .map(|(r, t)| Self::new(r, t).expect("at most 1"))
        .to_vec()
    }
}
