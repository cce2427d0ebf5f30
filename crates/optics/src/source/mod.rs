//! Sources of rays.

mod rings;

pub use rings::{Ring, RingSource};
