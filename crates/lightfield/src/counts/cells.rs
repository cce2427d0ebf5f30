//! The cell of each ray of a block in each of the grids, and the chance by which it is held out.

use etendue_math::heads::{heads, heads_mut};
use etendue_sampling::philox::Stream;
use multiversion::multiversion;

use super::plan::{FINEST, PartGrids, Plan, Starts};

/// The purpose under which rays are held out (see [`Stream::new`]).
pub const PURPOSE_HOLD_OUT: u64 = 0x484F_4C44;

/// The cells in the grids of all parts together, both folds of them: those within their own grids are there already.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn fold(plan: &Plan, starts: &Starts, (chances, part): (&[u16], &[u32]), cells: &mut [Vec<u32>; 3]) {
    for (k, cells) in cells.iter_mut().enumerate() {
        let total = starts.total[k];
        for (cell, chance) in cells.iter_mut().zip(chances) {
            *cell += if u32::from(*chance) < plan.held_out { total } else { 0 };
        }
        // Those of the first part begin with 0.
        if starts.parts.len() > 1 {
            for (cell, part) in cells.iter_mut().zip(part) {
                *cell += starts.parts.get(*part as usize).map_or(0, |starts| starts[k]);
            }
        }
    }
}

/// The cells of the rays of a block in grids that are the same for all parts.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn cells_of_all(grids: PartGrids, finest: &[Vec<u32>; 4], len: usize, out: &mut [Vec<u32>; 3]) {
    let [s1, s2, a, b] = heads(finest, len);
    let [grid, space, direction] = heads_mut(out, len);
    for i in 0..len {
        [grid[i], space[i], direction[i]] = cells_in(grids, [s1[i], s2[i], a[i], b[i]]);
    }
}

/// The same where parts have grids of their own; any cell for rays that meet none.
pub(super) fn cells_of_each(grids: &[PartGrids], part: &[u32], finest: &[Vec<u32>; 4], out: &mut [Vec<u32>; 3]) {
    for (i, part) in part.iter().enumerate() {
        let own = grids.get(*part as usize).copied().unwrap_or(grids[0]);
        let found = cells_in(own, finest.each_ref().map(|list| list[i]));
        for (list, cell) in out.iter_mut().zip(found) {
            list[i] = cell;
        }
    }
}

/// The cells of a block's coordinates, each in the finest grid.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(super) fn finest_cells(at: &[Vec<f64>; 4], len: usize, out: &mut [Vec<u32>; 4]) {
    for (values, numbers) in at.iter().zip(out) {
        for (value, number) in values[..len].iter().zip(numbers) {
            *number = cell(*value);
        }
    }
}

/// The cells of a ray in the three grids of its part.
#[inline(always)]
fn cells_in(grids: PartGrids, finest: [u32; 4]) -> [u32; 3] {
    let joined = |axes: std::ops::Range<usize>, depths: [u32; 4]| {
        axes.fold(0_u32, |c, k| c << depths[k] | finest[k] >> (FINEST - depths[k]))
    };
    let [place, direction] = grids.fine;
    [
        joined(0..4, grids.depths),
        joined(0..2, [place; 4]),
        joined(2..4, [direction; 4]),
    ]
}

/// The cell of a coordinate from 0 to 1, both included; the first or the last one if it lies beyond, any if it is no number.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "the low bits")]
fn cell(value: f64) -> u32 {
    const LAST: f64 = 1.0 - 0.5 / CELLS;
    const CELLS: f64 = (1 << FINEST) as f64;
    // Of a number from 1 to 2 the highest bits behind the point are the cell: what a conversion does more takes longer.
    let inside = if value < LAST { value } else { LAST };
    let inside = if inside > 0.0 { inside } else { 0.0 };
    ((inside + 1.0).to_bits() >> (52 - FINEST)) as u32 & ((1 << FINEST) - 1)
}

/// A number from 0 to 65 535 for each ray of a block: sixteen from one call of the generator.
#[allow(clippy::cast_possible_truncation, reason = "a word is cut into four pieces")]
pub(super) fn chances(seed: u64, first: u64, len: usize) -> Vec<u16> {
    let stream = Stream::new(seed, PURPOSE_HOLD_OUT);
    let last = first + len as u64;
    let mut numbers = Vec::with_capacity(len + 30);
    for block in first / 16..last.div_ceil(16) {
        for word in stream.words(block) {
            numbers.extend([0, 16, 32, 48].map(|shift| (word >> shift) as u16));
        }
    }
    numbers.drain(..(first % 16) as usize);
    numbers.truncate(len);
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coordinate_lies_in_the_cell_whose_lower_edge_it_may_be_and_one_in_the_last() {
        let all = 1 << FINEST;
        for k in 0..all {
            let edge = f64::from(k) / f64::from(all);
            assert_eq!((cell(edge), cell(edge + 1e-12)), (k, k));
            assert_eq!(cell(edge + 0.999_999 / f64::from(all)), k);
        }
        assert_eq!((cell(1.0), cell(1.0 - f64::EPSILON)), (all - 1, all - 1));
        let beyond = [f64::INFINITY, 1.0 + 1e-9, -1e-17, -3.7, f64::NEG_INFINITY];
        assert_eq!(beyond.map(cell), [all - 1, all - 1, 0, 0, 0]);
        assert!(cell(f64::NAN) < all);
    }
}
