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
    /// The lower and upper halves of boxes `first..first + n` in the finer level's array: where they lie, or gathered into the
    /// buffers, which are n long.
    ///
    /// `first` must be a multiple of n, and n a power of two.
    #[inline(always)]
    pub fn halves<'a, T: Copy>(
        self,
        finer: &'a [T],
        first: usize,
        lower: &'a mut [T],
        upper: &'a mut [T],
    ) -> (&'a [T], &'a [T]) {
        let n = lower.len();
        let block = self.block;
        if block >= n {
            let start = 2 * (first & !(block - 1)) + (first & (block - 1));
            return (&finer[start..start + n], &finer[start + block..start + block + n]);
        }
        let pairs = &finer[2 * first..2 * (first + n)];
        match block {
            1 => part::<1, T>(pairs, lower, upper),
            2 => part::<2, T>(pairs, lower, upper),
            4 => part::<4, T>(pairs, lower, upper),
            8 => part::<8, T>(pairs, lower, upper),
            16 => part::<16, T>(pairs, lower, upper),
            _ => {
                let places = lower.chunks_exact_mut(block).zip(upper.chunks_exact_mut(block));
                for (pair, (l, u)) in pairs.chunks_exact(2 * block).zip(places) {
                    l.copy_from_slice(&pair[..block]);
                    u.copy_from_slice(&pair[block..]);
                }
            }
        }
        (lower, upper)
    }

    /// For boxes `first..first + n`, the entries of the boxes they are halves of, in the coarser level's array: where they lie,
    /// or gathered into the buffer, which is n long.
    #[inline(always)]
    pub fn wholes<'a, T: Copy>(self, coarser: &'a [T], first: usize, buffer: &'a mut [T]) -> &'a [T] {
        let n = buffer.len();
        let block = self.block;
        if block >= n {
            let start = ((first & !(2 * block - 1)) >> 1) + (first & (block - 1));
            return &coarser[start..start + n];
        }
        self.double(&coarser[first / 2..usize::midpoint(first, n)], buffer);
        buffer
    }

    /// Entries of the wholes of 2 n boxes, each given to both halves; n must be more than a block.
    #[inline(always)]
    pub fn double<T: Copy>(self, wholes: &[T], halves: &mut [T]) {
        match self.block {
            1 => doubled::<1, T>(wholes, halves),
            2 => doubled::<2, T>(wholes, halves),
            4 => doubled::<4, T>(wholes, halves),
            8 => doubled::<8, T>(wholes, halves),
            16 => doubled::<16, T>(wholes, halves),
            block => {
                for (whole, pair) in wholes.chunks_exact(block).zip(halves.chunks_exact_mut(2 * block)) {
                    pair[..block].copy_from_slice(whole);
                    pair[block..].copy_from_slice(whole);
                }
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

/// Blocks of B entries dealt out in turn. Of known length, they are moved in registers, not by calls.
#[inline(always)]
fn part<const B: usize, T: Copy>(pairs: &[T], lower: &mut [T], upper: &mut [T]) {
    let (pairs, _) = pairs.as_chunks::<B>();
    let (lower, _) = lower.as_chunks_mut::<B>();
    let (upper, _) = upper.as_chunks_mut::<B>();
    for (pair, (l, u)) in pairs.chunks_exact(2).zip(lower.iter_mut().zip(upper)) {
        (*l, *u) = (pair[0], pair[1]);
    }
}

/// Each block of B entries twice.
#[inline(always)]
fn doubled<const B: usize, T: Copy>(wholes: &[T], halves: &mut [T]) {
    let (wholes, _) = wholes.as_chunks::<B>();
    let (halves, _) = halves.as_chunks_mut::<B>();
    for (whole, pair) in wholes.iter().zip(halves.chunks_exact_mut(2)) {
        pair[0] = *whole;
        pair[1] = *whole;
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
    fn halves_and_wholes_agree_with_index_arithmetic() {
        let grid = Grid::new(vec![3, 2, 5]).expect("small");
        for level in grid.levels() {
            for step in &level.splits {
                let finer: Vec<usize> = (0..2 * level.boxes).collect();
                for n in (0..).map(|k| 1 << k).take_while(|n| *n <= level.boxes) {
                    for first in (0..level.boxes).step_by(n) {
                        let (mut lower, mut upper) = (vec![0; n], vec![0; n]);
                        let (lower, upper) = step.halves(&finer, first, &mut lower, &mut upper);
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
                        let mut wholes = vec![0; n];
                        let wholes = back.wholes(&coarser, first, &mut wholes);
                        let mut upper = vec![false; n];
                        back.sides(first, n, |run, side| upper[run].fill(side));
                        for i in 0..n {
                            let (high, low) = ((first + i) / (2 * back.block), (first + i) % back.block);
                            assert_eq!(wholes[i], high * back.block + low);
                            assert_eq!(upper[i], (first + i) & back.block != 0);
                        }
                    }
                }
            }
        }
    }
}
