//! Numbers and vectors: f64, no I/O, no state.
//!
//! `vector`: points and directions. `trig`: sine and cosine that give the same bits on every platform.

pub mod trig;
pub mod vector;

pub use vector::Vec3;
