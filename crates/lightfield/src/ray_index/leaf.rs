//! Leaves of the index, and the records of rays that have none of their own.

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
