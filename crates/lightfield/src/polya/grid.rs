//! The lattice of dyadic boxes: every box of every level, a level being how often each axis is halved.
//!
//! Boxes are numbered so that those of a tile, a dyadic box of the grid, come one after the other: first by the halvings that
//! cut out the tile, axis by axis, then by those within it.

use super::level::{Extent, Level};

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
