//! A smooth interface of two media: Fresnel's equations.

use etendue_math::Vec3;

use super::contract::{Bsdf, Facts, Media};
use super::shares::Shares;
use crate::fresnel::fresnel;

/// A smooth interface of the media on both sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interface;

const FACTS: Facts = Facts {
    specular: [true; 2],
    diffuse: [false; 2],
    lambertian: true,
    reciprocal: true,
    constant: None,
    fresnel: true,
};

impl Bsdf for Interface {
    fn facts(&self) -> &Facts {
        &FACTS
    }

    fn is_selective(&self) -> bool {
        false
    }

    #[inline]
    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let [n1, n2] = media.seen_from(incident);
        let f = fresnel(incident.z.abs(), n1, n2);
        Shares {
            specular: [f.reflectance, 1.0 - f.reflectance],
            diffuse: [0.0; 2],
            refraction: f.cosine,
        }
    }

    fn is_nothing(&self, media: &Media) -> bool {
        media.front == media.back
    }
}

#[cfg(test)]
impl super::examples::Examples for Interface {
    const MEDIA: bool = true;

    fn examples() -> Vec<Self> {
        vec![Self]
    }
}
