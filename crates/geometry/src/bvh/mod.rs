//! A tree of boxes over anything that has bounds: which primitives may a ray meet, nearest first?
//!
//! Eight children per node, their boxes in f32 rounded outward, laid out so that one instruction serves all eight.
//! `tree`: the boxes and the traversal. `build`: from bounds to the tree. `probe`: the ray as the boxes see it, and the proof that no box is missed.
//!
//! The traversal is inlined into its caller, who compiles it once per instruction set (`multiversion`) around a loop
//! over rays, so that nothing is dispatched per node.

mod build;
mod probe;
#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small numbers")]
mod tests;
mod tree;

pub use probe::Probe;
pub use tree::{Bvh, LentStack, Stack, Walk};
