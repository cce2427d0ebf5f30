//! A light field: luminance at any point of a carrier surface, in any direction.
//!
//! On each part of the surface L(z) = level · `B_s(s₁`, s₂) · `B_d(a`, b) · r(z): two factors that are bilinear on fine grids
//! and a ratio that is linear in each of the four coordinates between the centres of its cells. Read-out (`PartField::at`, in `light_field`)
//! and sampling (`draw`) are of one and the same function. Theory eq. 38.

pub mod cells;
pub mod draw;
pub mod errors;
pub mod factor;
mod footprint;
pub mod intensity;
mod light_field;
pub mod look;
pub mod nodes;
mod pixel_sums;
mod points;
mod sights;
pub mod tent;
mod tile;
mod under_tents;

pub use errors::{Averaging, FineErrors};
pub use factor::Factor;
pub use light_field::{LightField, PartField, Reading};
pub use sights::{SightReader, SightReading};
