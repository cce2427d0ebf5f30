//! Values of many rays that meet a table together, in blocks that fill whole registers.

use std::ops::{Index, IndexMut};

/// How many are worked on at once. Loops of this length over blocks become a few instructions on wide registers; where there
/// are few rays, few blocks are worked on.
pub(super) const LANES: usize = 16;

/// A value for each of some rays, in so many blocks.
pub(super) struct Lanes<T, const BLOCKS: usize>(pub [[T; LANES]; BLOCKS]);

impl<T: Copy, const BLOCKS: usize> Lanes<T, BLOCKS> {
    pub const fn of(value: T) -> Self {
        Self([[value; LANES]; BLOCKS])
    }

    /// Takes the first values from a list.
    pub fn take(&mut self, given: &[T]) {
        let (blocks, rest) = given.as_chunks();
        self.0[..blocks.len()].copy_from_slice(blocks);
        if let Some(last) = self.0.get_mut(blocks.len()) {
            last[..rest.len()].copy_from_slice(rest);
        }
    }

    /// Puts the first values into a list.
    pub fn give(&self, list: &mut [T]) {
        let (blocks, rest) = list.as_chunks_mut();
        blocks.copy_from_slice(&self.0[..blocks.len()]);
        if let Some(last) = self.0.get(blocks.len()) {
            rest.copy_from_slice(&last[..rest.len()]);
        }
    }
}

/// The blocks that so many rays take, of all blocks.
pub(super) fn blocks<const BLOCKS: usize>(count: usize) -> std::ops::Range<usize> {
    0..count.div_ceil(LANES).min(BLOCKS)
}

impl<T, const BLOCKS: usize> Index<usize> for Lanes<T, BLOCKS> {
    type Output = T;

    #[inline(always)]
    fn index(&self, k: usize) -> &T {
        &self.0.as_flattened()[k]
    }
}

impl<T, const BLOCKS: usize> IndexMut<usize> for Lanes<T, BLOCKS> {
    #[inline(always)]
    fn index_mut(&mut self, k: usize) -> &mut T {
        &mut self.0.as_flattened_mut()[k]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_where_they_are_put() {
        const BLOCKS: usize = 3;
        let all: Vec<f64> = (0..BLOCKS * LANES).map(|k| k as f64).collect();
        for n in [0, 1, LANES, LANES + 3, all.len()] {
            let mut lanes = Lanes::<f64, BLOCKS>::of(-1.0);
            lanes.take(&all[..n]);
            assert!((0..all.len()).all(|k| lanes[k] == if k < n { all[k] } else { -1.0 }));
            let end = blocks::<BLOCKS>(n).end;
            assert!(end * LANES >= n && end * LANES < n + LANES);
            let mut given = vec![-2.0; n];
            lanes.give(&mut given);
            assert_eq!(given, all[..n]);
        }
    }
}
