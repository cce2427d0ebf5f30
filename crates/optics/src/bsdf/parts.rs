//! A BSDF taken apart: a product of what arrives and of what leaves, and the rest.
//!
//! Many BSDFs have a part f = a(incident) l(scattered)/π: Lambertian light, that under a clear coat, the floor of a table. What it
//! sends out anywhere is known as soon as the light that arrives is summed with the weights a, wherever it came from. Whoever
//! knows this sum needs to look for the light of the rest only.

use std::sync::Arc;

use etendue_math::Vec3;

use super::contract::{Bsdf, Media};

/// The part of a BSDF that is a(incident) l(scattered)/π.
pub trait Product {
    /// a: the shares of light from `incident` that it scatters back, and to the other side.
    fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2];

    /// l: its luminance towards `scattered` over that of Lambertian light of the same flux on the same side; its mean over
    /// projected solid angle is 1.
    #[inline]
    fn leaving(&self, _scattered: Vec3, _media: &Media) -> f64 {
        1.0
    }

    /// Whether l is 1 in all directions.
    fn is_even(&self) -> bool {
        true
    }
}

/// The diffuse part of a BSDF, taken apart.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// The product.
    pub product: &'a dyn Product,
    /// The rest of the diffuse light, if there is any.
    pub rest: Option<&'a Arc<dyn Bsdf>>,
}
