//! Carrier surfaces: equal-area charts, and the étendue coordinates of a ray on them.
//!
//! A light field lives on a surface Σ in four coordinates, each from 0 to 1: (s₁, s₂) is the place on a part of Σ, by an
//! equal-area chart, and (a, b) the direction, by the concentric map of its local direction cosines (p, q). Equal volumes
//! in these coordinates are equal étendues: dU = dA dp dq = π A ds₁ ds₂ da db, or π r² A of a part that takes the directions
//! of a beam. Theory eq. 37.
//!
//! `chart`: what a shape answers; `rectangle`, `disk`, `hemisphere`, `tube`: the shapes; `focus`: depth by inclination;
//! `beam`: the directions that a part takes; `part`: a shape and where it stands; `carry`: rays carried there; `leave`: lines that mostly miss it.

mod beam;
mod carry;
mod chart;
mod disk;
mod focus;
mod hemisphere;
pub(crate) mod leave;
mod part;
mod rectangle;
#[cfg(test)]
pub(crate) mod tests;
mod tube;

pub use beam::Beam;
pub use carry::{Coordinates, carry};
pub use chart::Departure;
pub use disk::Disk;
pub use focus::Focus;
pub use hemisphere::Hemisphere;
pub use leave::{Departures, Sights};
pub use part::{CarrierPart, Shape};
pub use rectangle::Rectangle;
pub use tube::Tube;
