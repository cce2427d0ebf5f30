//! The lattice of dyadic boxes: every box of every level, a level being how often each axis is halved.

/// A grid of 2^`depths[k]` cells along axis k, last axis fastest.
#[derive(Clone, Debug)]
pub struct Grid {
    depths: Vec<u32>,
    levels: Vec<Level>,
}

/// All boxes of one shape.
#[derive(Clone, Debug)]
pub(super) struct Level {
    /// How often each axis is halved.
    pub halvings: Vec<u32>,
    /// Number of boxes.
    pub boxes: usize,
    /// Halvings in all: boxes of one layer are halved into boxes of the next.
    pub layer: usize,
    /// Where the boxes begin in an array over all boxes of the layer.
    pub start: usize,
    /// Where the splits begin in an array over all splits of all boxes of the layer, split by split.
    pub splits_start: usize,
    /// The ways to halve these boxes once more; the neighbour is the finer level.
    pub splits: Vec<Step>,
    /// The ways in which these boxes are halves; the neighbour is the coarser level.
    pub origins: Vec<Step>,
}

/// From one level to a neighbour along an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// The halved axis.
    pub axis: usize,
    /// Number of the neighbouring level.
    pub level: usize,
    /// Boxes that lie side by side before the axis's number changes: 2^(halvings of the later axes).
    pub block: usize,
}

impl Grid {
    /// A grid; None if it has no axis, or more than 2^34 boxes on all levels together.
    #[must_use]
    pub fn new(depths: Vec<u32>) -> Option<Self> {
        let boxes = depths
            .iter()
            .map(|d| f64::from((*d).min(64) + 1).exp2())
            .product::<f64>();
        if depths.is_empty() || boxes > 2.0_f64.powi(34) {
            return None;
        }
        let mut levels: Vec<Level> = (0..depths.iter().map(|d| *d as usize + 1).product())
            .map(|id| Level::new(&depths, id))
            .collect();
        let mut ends = vec![(0, 0); depths.iter().sum::<u32>() as usize + 1];
        for level in &mut levels {
            let (boxes, splits) = &mut ends[level.layer];
            (level.start, level.splits_start) = (*boxes, *splits);
            *boxes += level.boxes;
            *splits += level.boxes * level.splits.len();
        }
        Some(Self { depths, levels })
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        1 << self.depths.iter().sum::<u32>()
    }

    /// Halvings of each axis.
    #[must_use]
    pub fn depths(&self) -> &[u32] {
        &self.depths
    }

    pub(super) fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The number of the level of the cells.
    pub(super) fn finest(&self) -> usize {
        self.levels.len() - 1
    }

    /// Level numbers by layer, in the order in which they lie in the layer's arrays.
    pub(super) fn layers(&self) -> Vec<Vec<usize>> {
        let mut layers = vec![Vec::new(); self.depths.iter().sum::<u32>() as usize + 1];
        for (id, level) in self.levels.iter().enumerate() {
            layers[level.layer].push(id);
        }
        layers
    }
}

impl Level {
    /// Level `id` in the mixed-radix order of the halvings.
    fn new(depths: &[u32], id: usize) -> Self {
        let mut halvings = vec![0; depths.len()];
        let mut rest = id;
        for (h, d) in halvings.iter_mut().zip(depths).rev() {
            let radix = *d as usize + 1;
            *h = u32::try_from(rest % radix).expect("below the depth");
            rest /= radix;
        }
        let (mut splits, mut origins) = (Vec::new(), Vec::new());
        let (mut stride, mut block) = (1, 1_usize);
        for axis in (0..depths.len()).rev() {
            if halvings[axis] < depths[axis] {
                let level = id + stride;
                splits.push(Step { axis, level, block });
            }
            if halvings[axis] > 0 {
                let level = id - stride;
                origins.push(Step { axis, level, block });
            }
            stride *= depths[axis] as usize + 1;
            block <<= halvings[axis];
        }
        Self {
            boxes: block,
            layer: halvings.iter().sum::<u32>() as usize,
            start: 0,
            splits_start: 0,
            halvings,
            splits,
            origins,
        }
    }
}

impl Level {
    /// The level's boxes in an array over its layer.
    pub fn of<'a, T>(&self, layer: &'a [T]) -> &'a [T] {
        &layer[self.start..self.start + self.boxes]
    }

    /// The level's numbers for one of its splits, in an array over the splits of its layer.
    pub fn of_split<'a, T>(&self, layer: &'a [T], split: usize) -> &'a [T] {
        &layer[self.splits_start + split * self.boxes..][..self.boxes]
    }
}

impl Step {
    /// Copies the lower and upper halves of boxes `first..first + n` out of the finer level's array.
    ///
    /// `first` must be a multiple of n, and n a power of two.
    #[inline(always)]
    pub fn halves<T: Copy>(self, finer: &[T], first: usize, lower: &mut [T], upper: &mut [T]) {
        let n = lower.len();
        let block = self.block;
        if block >= n {
            let start = 2 * (first & !(block - 1)) + (first & (block - 1));
            lower.copy_from_slice(&finer[start..start + n]);
            upper.copy_from_slice(&finer[start + block..start + block + n]);
        } else if block == 1 {
            for ((pair, l), u) in finer[2 * first..2 * (first + n)].chunks_exact(2).zip(lower).zip(upper) {
                (*l, *u) = (pair[0], pair[1]);
            }
        } else {
            let pairs = finer[2 * first..2 * (first + n)].chunks_exact(2 * block);
            for ((pair, l), u) in pairs
                .zip(lower.chunks_exact_mut(block))
                .zip(upper.chunks_exact_mut(block))
            {
                l.copy_from_slice(&pair[..block]);
                u.copy_from_slice(&pair[block..]);
            }
        }
    }

    /// Copies, for boxes `first..first + n`, the entries of the boxes they are halves of, out of the coarser level's array.
    #[inline(always)]
    pub fn wholes<T: Copy>(self, coarser: &[T], first: usize, out: &mut [T]) {
        let n = out.len();
        let block = self.block;
        if block >= n {
            let start = ((first & !(2 * block - 1)) >> 1) + (first & (block - 1));
            out.copy_from_slice(&coarser[start..start + n]);
        } else {
            let wholes = coarser[first / 2..usize::midpoint(first, n)].chunks_exact(block);
            for (whole, pair) in wholes.zip(out.chunks_exact_mut(2 * block)) {
                pair[..block].copy_from_slice(whole);
                pair[block..].copy_from_slice(whole);
            }
        }
    }

    /// Copies, for boxes `first..first + n`, the entries of the other halves.
    #[inline(always)]
    pub fn siblings<T: Copy>(self, same: &[T], first: usize, out: &mut [T]) {
        let n = out.len();
        let block = self.block;
        if block >= n {
            let start = first ^ block;
            out.copy_from_slice(&same[start..start + n]);
        } else {
            let pairs = same[first..first + n].chunks_exact(2 * block);
            for (pair, o) in pairs.zip(out.chunks_exact_mut(2 * block)) {
                o[..block].copy_from_slice(&pair[block..]);
                o[block..].copy_from_slice(&pair[..block]);
            }
        }
    }

    /// Whether boxes are upper halves: calls `visit(range, is_upper)` for runs within `0..n`.
    #[inline(always)]
    pub fn sides(self, first: usize, n: usize, mut visit: impl FnMut(std::ops::Range<usize>, bool)) {
        let run = self.block.min(n);
        for start in (0..n).step_by(run) {
            visit(start..start + run, (first + start) & self.block != 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_absurd_grids() {
        assert!(Grid::new(vec![]).is_none());
        assert!(Grid::new(vec![20, 20]).is_none());
        assert!(Grid::new(vec![u32::MAX / 2]).is_none());
    }

    #[test]
    fn halves_wholes_and_siblings_agree_with_index_arithmetic() {
        let grid = Grid::new(vec![3, 2, 4]).expect("small");
        for level in grid.levels() {
            for step in &level.splits {
                let finer: Vec<usize> = (0..2 * level.boxes).collect();
                for n in (0..).map(|k| 1 << k).take_while(|n| *n <= level.boxes) {
                    for first in (0..level.boxes).step_by(n) {
                        let (mut lower, mut upper) = (vec![0; n], vec![0; n]);
                        step.halves(&finer, first, &mut lower, &mut upper);
                        for i in 0..n {
                            let (high, low) = ((first + i) / step.block, (first + i) % step.block);
                            assert_eq!(lower[i], 2 * high * step.block + low);
                            assert_eq!(upper[i], lower[i] + step.block);
                        }
                    }
                }
                let back = grid.levels()[step.level].origins.iter().find(|o| o.axis == step.axis);
                let back = back.expect("each split has its origin");
                let coarser: Vec<usize> = (0..level.boxes).collect();
                for n in (1..).map(|k| 1 << k).take_while(|n| *n <= 2 * level.boxes) {
                    for first in (0..2 * level.boxes).step_by(n) {
                        let (mut wholes, mut siblings) = (vec![0; n], vec![0; n]);
                        back.wholes(&coarser, first, &mut wholes);
                        back.siblings(&finer, first, &mut siblings);
                        let mut upper = vec![false; n];
                        back.sides(first, n, |run, side| upper[run].fill(side));
                        for i in 0..n {
                            let (high, low) = ((first + i) / (2 * back.block), (first + i) % back.block);
                            assert_eq!(wholes[i], high * back.block + low);
                            assert_eq!(siblings[i], (first + i) ^ back.block);
                            assert_eq!(upper[i], (first + i) & back.block != 0);
                        }
                    }
                }
            }
        }
    }
}
