//! Rays in an order in which those that a cone can see stand together: cone maps without a pass over all of them.
//!
//! Rays are sorted into cells of direction (`cells`), within a cell along a Morton curve through the points in which their
//! lines cross a plane across the cell, and cut into leaves of a fixed number of rays, each with a box of line coordinates
//! (`bounds`). An observer looks through the boxes and counts the rays of those leaves that he may see (`query`) by the
//! cone estimator itself, so the answer is that of a pass over all rays. Records keep their bytes (`build`).
//! `leaf`: how many rays a leaf has.

mod bounds;
mod build;
mod cells;
mod leaf;
mod query;
#[cfg(test)]
mod tests;

pub use bounds::Bounds;
pub use build::{arrange, count, place};
pub use cells::Cells;
pub use leaf::{DRAWN, LEAF, leaves};
pub use query::{RayIndex, index_sums};
