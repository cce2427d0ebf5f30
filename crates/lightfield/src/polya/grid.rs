//! The lattice of dyadic boxes: every box of every level, a level being how often each axis is halved.
//!
//! Boxes are numbered so that those of a tile, a dyadic box of the grid, come one after the other: first by the halvings that
//! cut out the tile, axis by axis, then by those within it.

use super::chunk::CHUNK;

/// A grid of 2^`depths[k]` cells along axis k, last axis fastest.
#[derive(Clone, Debug)]
pub struct Grid {
    depths: Vec<u32>,
    /// The first halvings of each axis, which cut the grid into tiles.
    cuts: Vec<u32>,
    levels: Vec<Level>,
    /// Boxes and splits of all levels of a tile.
    pub(super) of_tile: Extent,
    /// Boxes and splits of the levels that lie side by side for the whole grid.
    pub(super) shared: Extent,
    /// Numbers of those levels, by halvings in all.
    pub(super) layers: Vec<Vec<usize>>,
    /// Numbers of the levels that are among both: boxes within tiles whose wholes are larger than tiles, or the root.
    pub(super) edges: Vec<usize>,
}

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

/// Boxes of a tile up to which what is worked out about them stays in the second cache.
const TILE: usize = 1 << 16;

impl Grid {
    /// A grid; None if it has no axis, or more than 2^34 boxes on all levels together.
    #[must_use]
    pub fn new(depths: Vec<u32>) -> Option<Self> {
        Self::with_tiles(depths, TILE)
    }

    /// A grid whose tiles have at most so many boxes.
    pub(super) fn with_tiles(depths: Vec<u32>, most: usize) -> Option<Self> {
        let boxes = |depths: &[u32]| {
            let of_axis = |d: &u32| f64::from((*d).min(64) + 1).exp2() - 1.0;
            depths.iter().map(of_axis).product::<f64>()
        };
        if depths.is_empty() || boxes(&depths) > 2.0_f64.powi(34) {
            return None;
        }
        let mut within = depths.clone();
        while boxes(&within) > most as f64 {
            // The axis with most cells; the first of those that are alike.
            let axis = (0..within.len()).rev().max_by_key(|k| within[*k])?;
            within[axis] -= 1;
        }
        let cuts = depths.iter().zip(within).map(|(d, w)| d - w).collect();
        Some(Self::cut(depths, cuts))
    }

    /// The grid over some of the axes, its tiles those of this grid.
    pub(super) fn of_axes(&self, axes: std::ops::Range<usize>) -> Self {
        Self::cut(self.depths[axes.clone()].to_vec(), self.cuts[axes].to_vec())
    }

    fn cut(depths: Vec<u32>, cuts: Vec<u32>) -> Self {
        let mut levels: Vec<Level> = (0..depths.iter().map(|d| *d as usize + 1).product())
            .map(|id| Level::new(&depths, &cuts, id))
            .collect();
        let mut of_tile = Extent::default();
        let tile_bits: u32 = cuts.iter().sum();
        let is_inner = |level: &Level| level.halvings.iter().zip(&cuts).all(|(h, cut)| h >= cut);
        let inner: Vec<bool> = levels.iter().map(is_inner).collect();
        let mut layers = vec![Vec::new(); depths.iter().sum::<u32>() as usize + 1];
        for (id, level) in levels.iter_mut().enumerate() {
            if inner[id] {
                level.in_tile = Some(of_tile.take(level.boxes >> tile_bits, level.splits.len()));
            }
            if !inner[id] || id == 0 || level.origins.iter().any(|step| !inner[step.level]) {
                layers[level.halvings.iter().sum::<u32>() as usize].push(id);
            }
        }
        let mut shared = Extent::default();
        for id in layers.iter().flatten() {
            let level = &mut levels[*id];
            // Boxes within a tile have their splits there.
            let splits = if inner[*id] { 0 } else { level.splits.len() };
            level.shared = Some(shared.take(level.boxes, splits));
        }
        let edges = (0..levels.len())
            .filter(|id| levels[*id].in_tile.is_some() && levels[*id].shared.is_some())
            .collect();
        Self {
            depths,
            cuts,
            levels,
            of_tile,
            shared,
            layers,
            edges,
        }
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

    /// Number of tiles: boxes of the coarsest level that lies within one.
    pub(super) fn tiles(&self) -> usize {
        1 << self.cuts.iter().sum::<u32>()
    }

    /// Boxes on all levels.
    pub(super) fn boxes(&self) -> usize {
        self.depths.iter().map(|d| (2_usize << d) - 1).product()
    }

    pub(super) fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The number of the level of the cells.
    pub(super) fn finest(&self) -> usize {
        self.levels.len() - 1
    }

    /// Visits the rows of cells along the last axis: the number of a row's first cell and the place where the row begins, and
    /// for the cells of a row how far behind that each has its place.
    ///
    /// Cells lie tile by tile. Along each axis they are moved cyclically by so many steps.
    pub(super) fn each_row(&self, steps: &[usize], mut visit: impl FnMut(usize, usize, &[usize])) {
        assert_eq!(steps.len(), self.depths.len(), "one number of steps per axis");
        let finest = &self.levels[self.finest()];
        let mut places: Vec<Vec<usize>> = (0..steps.len())
            .map(|axis| {
                let (bits, mask) = (finest.within[axis], (1 << finest.within[axis]) - 1);
                let (high, low) = (finest.shift_of_tile(axis + 1), finest.shift_in_tile(axis + 1));
                (0..1_usize << self.depths[axis])
                    .map(|i| (i + steps[axis]) & ((1 << self.depths[axis]) - 1))
                    .map(|i| ((i >> bits) << high) | ((i & mask) << low))
                    .collect()
            })
            .collect();
        let row = places.pop().unwrap_or_default();
        for line in 0..self.cells() / row.len() {
            let (mut rest, mut begin) = (line, 0);
            for of_axis in places.iter().rev() {
                begin |= of_axis[rest & (of_axis.len() - 1)];
                rest /= of_axis.len();
            }
            visit(line * row.len(), begin, &row);
        }
    }

    /// The values of the cells, each at its place.
    pub(super) fn arrange(&self, values: &[f64], steps: &[usize], out: &mut [f64]) {
        self.each_row(steps, |first, begin, row| {
            for (v, place) in values[first..].iter().zip(row) {
                out[begin + place] = *v;
            }
        });
    }
}

impl Extent {
    /// The next boxes, each with so many splits.
    fn take(&mut self, boxes: usize, splits: usize) -> Span {
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
    fn new(depths: &[u32], cuts: &[u32], id: usize) -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_absurd_grids() {
        assert!(Grid::new(vec![]).is_none());
        assert!(Grid::new(vec![20, 20]).is_none());
        assert!(Grid::new(vec![u32::MAX / 2]).is_none());
    }

    /// Grids of one tile, of several, and of tiles that are cells.
    fn grids() -> impl Iterator<Item = Grid> {
        [1 << 15, 300, 60, 10, 1]
            .into_iter()
            .map(|most| Grid::with_tiles(vec![3, 2, 5], most).expect("small"))
    }

    #[test]
    fn cells_have_places_of_their_own_tile_by_tile() {
        for grid in grids() {
            let finest = &grid.levels()[grid.finest()];
            let steps = [3, 1, 30];
            let mut cells = vec![usize::MAX; grid.cells()];
            grid.each_row(&steps, |first, begin, row| {
                for (i, place) in row.iter().enumerate() {
                    assert!(cells[begin + place] == usize::MAX);
                    cells[begin + place] = first + i;
                }
            });
            let in_tile = grid.cells() / grid.tiles();
            for (place, cell) in cells.iter().enumerate() {
                let along = [cell / 128, cell / 32 % 4, cell % 32];
                let moved: Vec<usize> = [8, 4, 32]
                    .iter()
                    .zip(along)
                    .zip(steps)
                    .map(|((n, i), s)| (i + s) % n)
                    .collect();
                let (mut tile, mut within) = (0, 0);
                for ((i, halvings), bits) in moved.iter().zip(&finest.halvings).zip(&finest.within) {
                    tile = (tile << (halvings - bits)) | (i >> bits);
                    within = (within << bits) | (i & ((1 << bits) - 1));
                }
                assert!(place == tile * in_tile + within);
            }
        }
    }

    #[test]
    fn levels_are_somewhere_and_edges_in_both_places() {
        for grid in grids() {
            let mut boxes = [0, 0];
            for level in grid.levels() {
                let is_inner = level.halvings.iter().zip(&grid.cuts).all(|(h, cut)| h >= cut);
                assert!(level.in_tile.is_some() == is_inner);
                assert!(
                    level
                        .in_tile
                        .is_none_or(|span| span.boxes * grid.tiles() == level.boxes)
                );
                assert!(level.shared.is_none_or(|span| span.boxes == level.boxes));
                // Whoever is split finds its halves beside it.
                for step in &level.splits {
                    let finer = &grid.levels()[step.level];
                    assert!(if is_inner {
                        finer.in_tile.is_some()
                    } else {
                        finer.shared.is_some()
                    });
                }
                boxes[0] += level.in_tile.map_or(0, |span| span.boxes);
                boxes[1] += level.shared.map_or(0, |span| span.boxes);
            }
            assert!(boxes == [grid.of_tile.boxes, grid.shared.boxes]);
            assert!(grid.levels()[0].shared.is_some_and(|span| span.first.boxes == 0));
        }
    }

    #[test]
    fn halves_and_wholes_agree_with_index_arithmetic() {
        for (grid, id) in grids().flat_map(|grid| (0..grid.levels().len()).map(move |id| (grid.clone(), id))) {
            let level = &grid.levels()[id];
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
                        for (number, whole) in (first..).zip(wholes) {
                            let (high, low) = (number / (2 * back.block), number % back.block);
                            assert_eq!(*whole, high * back.block + low);
                            assert_eq!(back.is_upper(number), number / back.block % 2 == 1);
                        }
                    }
                }
            }
        }
    }
}
