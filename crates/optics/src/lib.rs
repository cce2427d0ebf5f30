//! What sources, media and surfaces do to light.
//!
//! `source`: where rays come from. `medium`: refractive index and absorption. `fresnel`: reflection and refraction. `finish`:
//! optical properties of surfaces. `table`: quantities that depend on angle and wavelength.

pub mod finish;
pub mod fresnel;
pub mod medium;
pub mod source;
pub mod table;
