//! Optical properties of surfaces: one file for each kind, all of which keep to one contract.
//!
//! `contract`: what each answers, in which frame and measure. A new kind is a file, and its lines below; the
//! tests then hold for it: its samples against its density, density and shares against a quadrature, energy,
//! reciprocity, grazing angles, both sides.

use std::sync::Arc;

mod albedo;
mod coated;
mod contract;
mod cosine_power;
mod drawn;
#[cfg(test)]
mod examples;
mod facet_lattice;
mod facets;
mod gauss;
mod interface;
mod lambertian;
mod lobe;
mod mirror;
mod mixture;
mod monotone_cubic;
mod profile;
mod rough_coat;
mod rough_conductor;
mod rough_interface;
mod rough_metal;
mod shares;
mod tabulated;
#[cfg(test)]
mod tests;

pub use coated::Coated;
pub use contract::{Bsdf, Facts, Media, Outward, Parameters, Parts, Product};
pub use cosine_power::CosinePower;
pub use drawn::{Drawn, Outcome};
pub use interface::Interface;
pub use lambertian::Lambertian;
pub use lobe::Lobe;
pub use mirror::Mirror;
pub use mixture::Mixture;
pub use profile::Profile;
pub use rough_coat::RoughCoat;
pub use rough_conductor::RoughConductor;
pub use rough_interface::RoughInterface;
pub use rough_metal::RoughMetal;
pub use shares::{Component, Shares};
pub use tabulated::{Row, Side, Slice, Tabulated, Way};

/// A BSDF from the name of its kind and its parameters; None if there is no such kind.
///
/// # Errors
/// What is wrong with the parameters.
pub fn described(kind: &str, by: &dyn Parameters) -> Option<Result<Arc<dyn Bsdf>, String>> {
    match kind {
        "fresnel" => Some(Ok(Arc::new(Interface))),
        "scatter" => Some(Mixture::described(by)),
        "cosine-power" => Some(CosinePower::described(by)),
        "coated" => Some(Coated::described(by)),
        "rough-coat" => Some(RoughCoat::described(by)),
        "rough-metal" => Some(RoughConductor::described(by)),
        "rough-interface" => Some(RoughInterface::described(by)),
        "abg" | "harvey-shack" | "gaussian" => Some(Lobe::described(kind, by)),
        _ => None,
    }
}

/// Examples of all kinds, by the names of their files: what the tests go through.
#[cfg(test)]
fn kinds() -> &'static [Vec<examples::Example>] {
    use examples::Examples;
    static KINDS: std::sync::OnceLock<Vec<Vec<examples::Example>>> = std::sync::OnceLock::new();
    KINDS.get_or_init(|| {
        vec![
            Coated::named("coated"),
            CosinePower::named("cosine_power"),
            Interface::named("interface"),
            Lambertian::named("lambertian"),
            Lobe::named("lobe"),
            Mirror::named("mirror"),
            Mixture::named("mixture"),
            RoughCoat::named("rough_coat"),
            RoughConductor::named("rough_conductor"),
            RoughInterface::named("rough_interface"),
            RoughMetal::named("rough_metal"),
            Tabulated::named("tabulated"),
        ]
    })
}
