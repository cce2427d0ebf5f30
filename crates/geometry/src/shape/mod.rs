//! Shapes: where a line crosses them, and their normal there.
//!
//! Every shape stands in its own coordinates. One contract for all: `crossings` names the distances t at which the line
//! o + t d crosses the shape, d being a unit vector; a line that starts *on* the shape says so, and the crossing at its
//! start is then divided out of the equation instead of being told from others by a smallest distance. A point near an edge
//! counts as inside if it may be, by the rounding errors of its computation: neighbours that share an edge leave no gap.

pub mod asphere;
pub mod chart;
pub mod corners;
pub mod flat;
pub mod quadric;
pub mod roots;
pub mod rounding;
pub mod sample;
pub mod surface;
pub mod torus;

pub use asphere::Asphere;
pub use corners::Corners;
pub use flat::{Flat, Outline};
pub use quadric::Quadric;
pub use rounding::{ROUNDING, size};
pub use surface::{Crossing, Shape};
pub use torus::Torus;
