//! Building an index: two passes over the rays, then one over the cells. The same bytes for any number of threads.

use std::cell::RefCell;
use std::ops::{ControlFlow, Range};

use etendue_geometry::ray_batch::BLOCK;
use etendue_geometry::table::{Layout, RayTable};
use etendue_geometry::{PassAccount, RayBatch, RaySource};
use etendue_math::Vec3;
use etendue_sampling::ordered;
use rayon::prelude::*;

use super::bounds::{Bounds, bounds_of, coordinate_error, line_coordinates};
use super::cells::{Cells, spread};
use super::leaf::{DRAWN, LEAF, leaves};

/// Rays that are sorted at once: what a thread holds of a cell in memory, some 150 MB with their keys. A cell with more is
/// sorted in pieces. A multiple of [`LEAF`].
const PIECE: usize = 1 << 20;

/// Rays of the pieces between two calls of the progress function.
const ROUND: usize = 1 << 22;

/// First pass: the number of usable rays in each cell, and the flux account.
pub fn count(
    source: &impl RaySource,
    cells: Cells,
    threads: usize,
    progress: impl FnMut(u64) -> ControlFlow<()>,
) -> (Vec<u64>, PassAccount) {
    let mut counts = vec![0; cells.count()];
    let mut tally = PassAccount::default();
    let work = |range: Range<u64>| {
        let mut part = PassAccount::default();
        let mut found = vec![0_u32; cells.count()];
        source.for_each_block(range, |_, batch| {
            part.add_block(batch);
            for i in (0..batch.len).filter(|&i| batch.usable(i)) {
                found[cells.cell(batch.direction(i)) as usize] += 1;
            }
        });
        (part, found)
    };
    let merge = |(part, found): (PassAccount, Vec<u32>)| {
        tally.merge(&part);
        counts
            .iter_mut()
            .zip(found)
            .for_each(|(total, n)| *total += u64::from(n));
    };
    ordered::run(threads, source.len(), work, merge, progress);
    (counts, tally)
}

/// The records of a batch of rays, cell by cell.
struct Sorted {
    records: Vec<u8>,
    /// (cell, number of rays), cells rising.
    runs: Vec<(u32, u32)>,
}

/// Second pass: each usable ray's record to its cell, in the order of the source within it.
///
/// Records are those of `table`, which is the source itself, byte by byte; None: rays are drawn, and written as [`DRAWN`].
/// `starts` (one more than there are cells) are the cells' first rays in `out`. False if the rays are not those that were
/// counted: somebody changed the file.
pub fn place(
    source: &impl RaySource,
    table: Option<&RayTable<'_>>,
    cells: Cells,
    starts: &[u64],
    out: &mut [u8],
    threads: usize,
    progress: impl FnMut(u64) -> ControlFlow<()>,
) -> bool {
    let stride = table.map_or(DRAWN.stride, |table| table.layout().stride);
    if starts.len() != cells.count() + 1 || starts.windows(2).any(|pair| pair[0] > pair[1]) {
        return false;
    }
    let mut next = starts.to_vec();
    let mut fits = true;
    let work = |range| sorted(source, table, cells, range);
    let merge = |batch: Sorted| {
        let mut records = batch.records.as_slice();
        for (cell, n) in batch.runs {
            let cell = cell as usize;
            let (run, rest) = records.split_at(n as usize * stride);
            records = rest;
            let (from, to) = (next[cell], next[cell] + u64::from(n));
            let room = byte_range(from..to, stride).and_then(|range| out.get_mut(range));
            match room {
                Some(room) if to <= starts[cell + 1] => room.copy_from_slice(run),
                _ => fits = false,
            }
            next[cell] = to;
        }
    };
    ordered::run(threads, source.len(), work, merge, progress);
    fits && next[..cells.count()] == starts[1..]
}

fn byte_range(rays: Range<u64>, stride: usize) -> Option<Range<usize>> {
    let at = |ray: u64| usize::try_from(ray).ok()?.checked_mul(stride);
    Some(at(rays.start)?..at(rays.end)?)
}

/// A counting sort of one batch.
#[allow(
    clippy::cast_possible_truncation,
    reason = "a batch has far fewer than 2^32 rays, and so has a grid cells"
)]
fn sorted(source: &impl RaySource, table: Option<&RayTable<'_>>, cells: Cells, range: Range<u64>) -> Sorted {
    const OUT: u32 = u32::MAX;
    let stride = table.map_or(DRAWN.stride, |table| table.layout().stride);
    let mut cell_of = Vec::with_capacity((range.end - range.start) as usize);
    let mut drawn = Vec::new();
    let mut counts = vec![0_u32; cells.count()];
    source.for_each_block(range.clone(), |_, batch| {
        for i in 0..batch.len {
            let cell = if batch.usable(i) {
                cells.cell(batch.direction(i))
            } else {
                OUT
            };
            cell_of.push(cell);
            if cell != OUT {
                counts[cell as usize] += 1;
            }
            if table.is_none() {
                let columns = batch.position.iter().chain(&batch.direction).chain([&batch.flux]);
                let mut record = [0; DRAWN.stride];
                for (place, column) in record.chunks_exact_mut(8).zip(columns) {
                    place.copy_from_slice(&column[i].to_le_bytes());
                }
                drawn.extend_from_slice(&record);
            }
        }
    });
    let mut room = Vec::new();
    let stored = match table {
        Some(table) => table.records(range, &mut room),
        None => drawn.as_slice(),
    };
    let mut runs = Vec::new();
    let mut total = 0;
    // From counts to the first place of each cell.
    for (cell, n) in counts.iter_mut().enumerate().filter(|(_, n)| **n > 0) {
        runs.push((cell as u32, *n));
        total += std::mem::replace(n, total);
    }
    let mut records = vec![0; total as usize * stride];
    for (record, cell) in stored.chunks_exact(stride).zip(cell_of) {
        if cell != OUT {
            let at = counts[cell as usize] as usize * stride;
            records[at..at + stride].copy_from_slice(record);
            counts[cell as usize] += 1;
        }
    }
    Sorted { records, runs }
}

/// Rays of one cell that are sorted at once, with the boxes to fill.
struct Piece<'a> {
    cell: u32,
    records: &'a mut [u8],
    bounds: &'a mut [Bounds],
}

/// Last pass, cell by cell: rays along a Morton curve through the points in which they cross their cell's plane, whose
/// origin is `centre`; and the boxes of the leaves.
///
/// `records` are those that [`place`] wrote. None if they and `starts` do not agree, or if `progress` broke.
pub fn arrange(
    records: &mut [u8],
    layout: &Layout,
    cells: Cells,
    starts: &[u64],
    centre: Vec3,
    threads: usize,
    mut progress: impl FnMut(u64) -> ControlFlow<()>,
) -> Option<Vec<Bounds>> {
    let fit = RayTable::new(records, *layout)?.len() == *starts.last()?
        && starts.len() == cells.count() + 1
        && starts[0] == 0
        && starts.windows(2).all(|pair| pair[0] <= pair[1]);
    if !fit {
        return None;
    }
    let count: u64 = leaves(starts).sum();
    let mut bounds = vec![Bounds::default(); usize::try_from(count).ok()?];
    // The pool lends the calling thread to a function that may be called twice in principle, hence the cell.
    let state = RefCell::new((&mut *records, bounds.as_mut_slice(), &mut progress));
    let whole = ordered::beside(threads, |pool| {
        let mut state = state.borrow_mut();
        let (records, bounds, progress) = &mut *state;
        let mut pieces = Pieces {
            records,
            bounds,
            starts,
            stride: layout.stride,
            cell: 0,
            done: 0,
        };
        let sort = |piece| sort_piece(piece, layout, cells, centre);
        while let Some(round) = pieces.round() {
            match pool {
                Some(pool) => pool.install(|| round.into_par_iter().for_each(sort)),
                None => round.into_iter().for_each(sort),
            }
            if progress(pieces.done).is_break() {
                return false;
            }
        }
        true
    });
    whole.then_some(bounds)
}

/// What is left to sort.
struct Pieces<'a> {
    records: &'a mut [u8],
    bounds: &'a mut [Bounds],
    starts: &'a [u64],
    stride: usize,
    cell: usize,
    done: u64,
}

impl<'a> Pieces<'a> {
    /// Pieces of about [`ROUND`] rays; None at the end.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the rays are in a slice, and there are few cells"
    )]
    fn round<'b>(&'b mut self) -> Option<Vec<Piece<'a>>> {
        let mut pieces = Vec::new();
        let mut rays = 0;
        while rays < ROUND && self.cell + 1 < self.starts.len() {
            let left = (self.starts[self.cell + 1] - self.done) as usize;
            let n = left.min(PIECE);
            if n > 0 {
                let (records, rest) = std::mem::take(&mut self.records).split_at_mut(n * self.stride);
                let (bounds, other) = std::mem::take(&mut self.bounds).split_at_mut(n.div_ceil(LEAF));
                (self.records, self.bounds) = (rest, other);
                pieces.push(Piece {
                    cell: self.cell as u32,
                    records,
                    bounds,
                });
            }
            self.done += n as u64;
            rays += n;
            self.cell += usize::from(n == left);
        }
        (!pieces.is_empty()).then_some(pieces)
    }
}

#[allow(clippy::cast_possible_truncation, reason = "a piece has at most 2^20 rays")]
fn sort_piece(piece: Piece<'_>, layout: &Layout, cells: Cells, centre: Vec3) {
    let Some(table) = RayTable::new(piece.records, *layout) else {
        return;
    };
    let frame = cells.frame(piece.cell, centre);
    let mut lines = Vec::with_capacity(table.len() as usize);
    let mut visit = |_, batch: &RayBatch| {
        lines.extend((0..batch.len).map(|i| {
            let (x, k) = (batch.position(i), batch.direction(i));
            (line_coordinates(&frame, x, k), coordinate_error(&frame, x))
        }));
    };
    table.for_each_block(0..table.len(), &mut visit);
    let order = along_the_curve(&lines);
    let mut sorted = Vec::with_capacity(piece.records.len());
    for &i in &order {
        let at = i as usize * layout.stride;
        sorted.extend_from_slice(&piece.records[at..at + layout.stride]);
    }
    piece.records.copy_from_slice(&sorted);
    for (bounds, leaf) in piece.bounds.iter_mut().zip(order.chunks(LEAF)) {
        *bounds = bounds_of(leaf.iter().map(|&i| lines[i as usize]));
    }
}

/// The order of lines along a Morton curve through (u, v), in squares of their larger extent; equal places keep theirs.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, and the order decides nothing but speed"
)]
fn along_the_curve(lines: &[([f64; 4], f64)]) -> Vec<u32> {
    let range = |axis: usize| {
        let values = lines
            .iter()
            .map(|(line, _)| line[axis])
            .filter(|value| value.is_finite());
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    let (u, v) = (range(0), range(1));
    let step = f64::from(u16::MAX) / (u[1] - u[0]).max(v[1] - v[0]);
    let place = |value: f64, low: f64| ((value - low) * step) as u16;
    let mut keys: Vec<u64> = (0_u32..)
        .zip(lines)
        .map(|(i, (line, _))| {
            let key = spread(u32::from(place(line[0], u[0]))) | spread(u32::from(place(line[1], v[0]))) << 1;
            u64::from(key) << 32 | u64::from(i)
        })
        .collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}

const _: () = assert!(PIECE.is_multiple_of(LEAF) && BLOCK >= LEAF);
