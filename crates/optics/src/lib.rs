//! What sources, media and surfaces do to light.
//!
//! `source`: where rays come from. `medium`: refractive index and absorption. `bsdf`: optical properties of surfaces. `fresnel`:
//! reflection and refraction. `table`: quantities that depend on angle and wavelength.

pub mod bsdf;
#[cfg(test)]
mod chi_squared;
pub mod fresnel;
pub mod light_sampler;
pub mod medium;
pub mod source;
pub mod table;
