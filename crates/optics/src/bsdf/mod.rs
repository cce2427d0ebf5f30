//! Optical properties of surfaces: one file for each kind, all of which keep to one contract.
//!
//! `contract`: what each answers, in which frame and measure. A new kind is a file, and its lines below; the
//! tests then hold for it: its samples against its density, density and shares against a quadrature, energy,
//! reciprocity, grazing angles, both sides.

mod contract;
mod interface;
mod lambertian;
mod mirror;
mod mixture;
mod more_numbers;
mod tabulated;
#[cfg(test)]
mod tests;

pub use contract::{Bsdf, Component, Drawn, Facts, Media, Shares};
pub use interface::Interface;
pub use lambertian::Lambertian;
pub use mirror::Mirror;
pub use mixture::Mixture;
pub use tabulated::{Row, Side, Slice, Tabulated, Way};

/// Examples of all kinds, by the names of their files: what the tests go through.
#[cfg(test)]
fn kinds() -> Vec<Vec<contract::Example>> {
    use contract::Examples;
    vec![
        Interface::named("interface"),
        Lambertian::named("lambertian"),
        Mirror::named("mirror"),
        Mixture::named("mixture"),
        Tabulated::named("tabulated"),
    ]
}
