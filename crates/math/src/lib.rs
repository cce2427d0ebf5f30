//! Numbers and vectors: f64, no I/O, no state.
//!
//! `vector`: points and directions. `frame`: where something stands and how it is turned. `heads`: the first entries of several
//! lists. `interval`: bounds of a function.
//! `polynomial`: by Horner's rule. `trig` and `special`: sine, cosine, arc tangent, exponential, logarithm and ln Γ that give the
//! same bits on every platform.

#[macro_use]
mod polynomial;

pub mod frame;
pub mod heads;
pub mod interval;
pub mod special;
pub mod trig;
pub mod vector;

pub use frame::Frame;
pub use interval::Interval;
pub use vector::Vec3;
