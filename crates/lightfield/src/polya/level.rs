//! Boxes of one shape, where they lie, and which are halves of which.

use super::chunk::CHUNK;

/// All boxes of one shape.
#[derive(Clone, Debug)]
pub(super) struct Level {
    /// How often each axis is halved.
    pub halvings: Vec<u32>,
    /// How often each axis is halved within a tile.
    pub within: Vec<u32>,
    /// Number of boxes.
    pub boxes: usize,
    /// Where the level's boxes begin among those of a tile, and how many they are; none if a box is larger than a tile.
    pub in_tile: Option<Span>,
    /// Where they begin among the levels that lie side by side for the whole grid; none if they lie within tiles and no box that is
    /// larger than a tile is split into them. The root is always among these.
    pub shared: Option<Span>,
    /// The ways to halve these boxes once more; the neighbour is the finer level.
    pub splits: Vec<Step>,
    /// The ways in which these boxes are halves; the neighbour is the coarser level.
    pub origins: Vec<Step>,
}

/// Numbers of boxes and of their splits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    pub boxes: usize,
    pub splits: usize,
}

/// Where a level lies among others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub first: Extent,
    pub boxes: usize,
}

/// From one level to a neighbour along an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// The halved axis.
    pub axis: usize,
    /// Number of the neighbouring level.
    pub level: usize,
    /// Boxes that lie side by side before the number along the axis changes: 2^(bits after the last of the axis).
    pub block: usize,
}

impl Extent {
    /// The next boxes, each with so many splits.
    pub fn take(&mut self, boxes: usize, splits: usize) -> Span {
        let first = *self;
        self.boxes += boxes;
        self.splits += boxes * splits;
        Span { first, boxes }
    }
}

impl Span {
    /// The level's boxes in an array over all boxes.
    pub const fn range(self) -> std::ops::Range<usize> {
        self.first.boxes..self.first.boxes + self.boxes
    }

    /// Where the splits of boxes `first..` lie in an array over all splits of boxes that have so many each: a chunk of boxes after
    /// the other, within it split after split.
    pub const fn splits(self, ways: usize, first: usize) -> std::ops::Range<usize> {
        let start = self.first.splits + first * ways;
        start..start + ways * self.chunk()
    }

    /// The entries of one split of some boxes of a chunk, in an array over all splits.
    pub fn of_split(self, values: &[f32], ways: usize, way: usize, boxes: std::ops::Range<usize>) -> &[f32] {
        let within = boxes.start % self.chunk();
        &values[self.splits(ways, boxes.start - within)][way * self.chunk() + within..][..boxes.len()]
    }

    /// Boxes that are worked on together.
    pub const fn chunk(self) -> usize {
        if self.boxes < CHUNK { self.boxes } else { CHUNK }
    }
}

impl Level {
    /// Level `id` in the mixed-radix order of the halvings.
    pub fn new(depths: &[u32], cuts: &[u32], id: usize) -> Self {
        let mut halvings = vec![0; depths.len()];
        let mut rest = id;
        for (h, d) in halvings.iter_mut().zip(depths).rev() {
            let radix = *d as usize + 1;
            *h = u32::try_from(rest % radix).expect("below the depth");
            rest /= radix;
        }
        let within = halvings
            .iter()
            .zip(cuts)
            .map(|(h, cut)| h.saturating_sub(*cut))
            .collect();
        let mut level = Self {
            boxes: 1 << halvings.iter().sum::<u32>(),
            halvings,
            within,
            in_tile: None,
            shared: None,
            splits: Vec::new(),
            origins: Vec::new(),
        };
        let mut stride = 1;
        for axis in (0..depths.len()).rev() {
            let halved = level.halvings[axis];
            let block = |in_tile: bool| {
                let shift = if in_tile {
                    Self::shift_in_tile
                } else {
                    Self::shift_of_tile
                };
                1 << shift(&level, axis + 1)
            };
            let (next, last) = (block(halved >= cuts[axis]), block(halved > cuts[axis]));
            if halved < depths[axis] {
                level.splits.push(Step {
                    axis,
                    level: id + stride,
                    block: next,
                });
            }
            if halved > 0 {
                level.origins.push(Step {
                    axis,
                    level: id - stride,
                    block: last,
                });
            }
            stride *= depths[axis] as usize + 1;
        }
        level
    }

    /// Bits of a box's number for its place within its tile, along the axes from `axis` on.
    pub fn shift_in_tile(&self, axis: usize) -> u32 {
        self.within[axis..].iter().sum()
    }

    /// Bits of a box's number behind those for the tile along the axes from `axis` on.
    pub fn shift_of_tile(&self, axis: usize) -> u32 {
        self.shift_in_tile(0) + self.halvings[axis..].iter().sum::<u32>() - self.shift_in_tile(axis)
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
        let wholes = &coarser[self.range_of_wholes(first, buffer.len())];
        self.dealt(wholes, buffer)
    }

    /// Which boxes of the coarser level are the wholes of boxes `first..first + n`.
    #[inline(always)]
    pub const fn range_of_wholes(self, first: usize, n: usize) -> std::ops::Range<usize> {
        let block = self.block;
        if block >= n {
            let start = ((first & !(2 * block - 1)) >> 1) + (first & (block - 1));
            start..start + n
        } else {
            first / 2..usize::midpoint(first, n)
        }
    }

    /// The entries of those wholes for each half: as they are, or gathered into the buffer.
    #[inline(always)]
    pub fn dealt<'a, T: Copy>(self, wholes: &'a [T], buffer: &'a mut [T]) -> &'a [T] {
        if wholes.len() == buffer.len() {
            return wholes;
        }
        self.double(wholes, buffer);
        buffer
    }

    /// Entries of the wholes of 2 n boxes, each given to both halves; n must be more than a block.
    #[inline(always)]
    fn double<T: Copy>(self, wholes: &[T], halves: &mut [T]) {
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

    /// Whether a box is an upper half.
    pub const fn is_upper(self, number: usize) -> bool {
        number & self.block != 0
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
