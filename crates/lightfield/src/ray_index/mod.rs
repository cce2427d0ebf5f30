//! Rays in an order in which those that a cone can see stand together: cone maps without a pass over all of them.
//!
//! Rays are sorted into cells of direction (`cells`), within a cell along a Morton curve through the points in which their
//! lines cross a plane across the cell, and cut into leaves of a fixed number of rays, each with a box of line coordinates
//! (`bounds`). An observer looks through the boxes and counts the rays of those leaves that he may see (`query`) by the
//! cone estimator itself, so the answer is that of a pass over all rays. Records keep their bytes (`build`).

mod bounds;
mod build;
mod cells;
mod query;
#[cfg(test)]
mod tests;

pub use bounds::Bounds;
pub use build::{arrange, count, place};
pub use cells::Cells;
pub use query::{RayIndex, index_sums};

use etendue_geometry::table::{Float, Layout};

/// Rays of a leaf. Fewer make boxes tighter, and more of them to look through.
pub const LEAF: usize = 128;

/// Records of rays that have none of their own because they are drawn: position, direction and flux in 64 bits.
pub const DRAWN: Layout = Layout {
    stride: 56,
    position: Some(0),
    direction: 24,
    flux: 48,
    float: Float::F64,
    colour: None,
    length_scale: 1.0,
};

/// Leaves of each cell, from where the cells' rays start (one more than there are cells).
pub fn leaves(starts: &[u64]) -> impl Iterator<Item = u64> + '_ {
    starts.windows(2).map(|pair| (pair[1] - pair[0]).div_ceil(LEAF as u64))
}
