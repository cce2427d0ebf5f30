//! What both sweeps over the lattice share: the problem, tasks side by side, and room for a chunk and for a tile.
//!
//! Most boxes lie within tiles, and a tile is swept by one thread while all about it stays in the second cache. The boxes that are
//! larger than tiles, a sixth or so, lie side by side level by level, and their chunks are shared among the threads.

use std::sync::atomic::{AtomicBool, Ordering};

use etendue_sampling::ordered::Idle;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::base::{Base, SplitTerms};
use super::chunk::{Busy, CHUNK};
use super::data::Data;
use super::grid::Grid;
use super::level::{Level, Span};

/// A tree to be grown.
pub(super) struct Problem<'a> {
    pub grid: &'a Grid,
    pub c: f64,
    pub base: Base,
    pub terms: SplitTerms,
    /// Whether weights are unequal: then points are counted by (Σ w)²/Σ w².
    pub is_weighted: bool,
    pub stop: Option<&'a AtomicBool>,
    /// Room for the work on chunks and tiles.
    idle: Idle<Scratch>,
}

impl<'a> Problem<'a> {
    /// The tree on cells that are moved cyclically by so many steps along each axis.
    pub fn new(grid: &'a Grid, data: &Data<'a>, steps: &[usize], c: f64) -> Self {
        let base = Base::product(grid, data.factors, steps);
        Self {
            grid,
            c,
            terms: base.split_terms(c),
            base,
            is_weighted: data.squared.is_some(),
            stop: data.stop,
            idle: Idle::default(),
        }
    }

    /// Whether somebody wants the rest to be left out.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// Whether halves of any box are equal under the base measure and points are counted: then ln Γ is needed per box and not per
    /// split.
    pub fn has_equal_halves(&self) -> bool {
        !self.is_weighted && self.base.is_uniform()
    }
}

/// Where boxes lie: those of a tile, or of the levels that lie side by side for the whole grid.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    Tile,
    Shared,
}

impl Place {
    /// Where a level's boxes lie there.
    pub fn of(self, level: &Level) -> Option<Span> {
        match self {
            Self::Tile => level.in_tile,
            Self::Shared => level.shared,
        }
    }
}

/// Rows that a chunk needs.
const ROWS: usize = 12;

/// Room for the numbers of a chunk.
type Row = [f64; CHUNK];

/// Room for so many numbers in each of the rows.
#[inline(always)]
pub(super) fn cut(rows: &mut [Row; ROWS], n: usize) -> [&mut [f64]; ROWS] {
    let mut rows = rows.iter_mut();
    std::array::from_fn(|_| rows.next().map(|row| &mut row[..n]).unwrap_or_default())
}

/// What the work on a chunk needs room for.
pub(super) struct Scratch {
    pub rows: Box<[Row; ROWS]>,
    /// As many rows as there are axes, one after the other.
    pub terms: Vec<f64>,
    pub split: [f32; CHUNK],
    pub busy: Busy,
    /// Numbers of the boxes of a tile: what they are is for the sweep to say.
    pub tile: [Vec<f64>; 6],
}

impl Scratch {
    fn new(axes: usize) -> Self {
        Self {
            rows: vec![[0.0; CHUNK]; ROWS].try_into().expect("as many"),
            terms: vec![0.0; axes * CHUNK],
            split: [0.0; CHUNK],
            busy: Busy::none(),
            tile: Default::default(),
        }
    }
}

/// Runs tasks until it is stopped, side by side if that is worth it: in the pool, or on the caller's thread.
pub(super) fn each<T: Send>(
    pool: Option<&ThreadPool>,
    problem: &Problem<'_>,
    tasks: Vec<T>,
    work: impl Fn(&mut Scratch, T) + Sync + Send,
) {
    let work = |task| {
        if !problem.is_stopped() {
            let make = || Scratch::new(problem.grid.depths().len());
            problem.idle.with(make, |scratch| work(scratch, task));
        }
    };
    match pool {
        Some(pool) if tasks.len() > 8 => pool.install(|| tasks.into_par_iter().for_each(work)),
        _ => tasks.into_iter().for_each(work),
    }
}

/// Sums over all boxes of a tile from those over its cells.
pub(super) fn sum_tile(grid: &Grid, cells: &[f64], rows: &mut [Row; ROWS], sums: &mut Vec<f64>) {
    let levels = grid.levels();
    sums.resize(grid.of_tile.boxes, 0.0);
    let begin = grid.of_tile.boxes - cells.len();
    sums[begin..].copy_from_slice(cells);
    for level in levels[..grid.finest()].iter().rev() {
        let Some(span) = level.in_tile else { continue };
        let (own, finer) = sums.split_at_mut(span.range().end);
        let step = level.splits[0];
        let range = levels[step.level].in_tile.expect("finer").range();
        let finer = &finer[range.start - span.range().end..range.end - span.range().end];
        for (chunk, own) in own[span.range()].chunks_mut(CHUNK).enumerate() {
            sum_chunk(level, finer, chunk * CHUNK, rows, own);
        }
    }
}

/// Sums of boxes `first..` from those of the halves of their first split.
#[multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(super) fn sum_chunk(level: &Level, finer: &[f64], first: usize, rows: &mut [Row; ROWS], own: &mut [f64]) {
    let [b0, b1, ..] = cut(rows, own.len());
    let (lower, upper) = level.splits[0].halves(finer, first, b0, b1);
    add(own, lower, upper);
}

/// The sum of two rows.
pub(super) fn add(out: &mut [f64], a: &[f64], b: &[f64]) {
    for ((o, a), b) in out.iter_mut().zip(a).zip(b) {
        *o = a + b;
    }
}

/// Numbers of points that unequal weights are worth, (Σ w)²/Σ w².
pub(super) fn effective_counts(weight: &[f64], squared: &[f64], out: &mut [f64]) {
    for ((e, w), w2) in out.iter_mut().zip(weight).zip(squared) {
        *e = if *w2 > 0.0 { w * w / w2 } else { 0.0 };
    }
}
