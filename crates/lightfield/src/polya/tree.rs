//! The two sweeps over the lattice: evidence from the cells to the root, ratios from the root to the cells.

use rayon::ThreadPool;
use rayon::prelude::*;

use super::base::{SplitTerms, Splits};
use super::grid::{Grid, Level};
use super::kernel::{Flow, Trial, add_flow, add_log_bayes, add_log_gamma, join, log_gamma, whole_term};
use super::{CHUNK, Data};

/// What the upward sweep leaves behind.
pub(super) struct Evidence {
    /// Σ w of each box, by level.
    weight: Vec<Vec<f64>>,
    /// (Σ w)²/Σ w² of each box, by level; empty if all weights are one.
    effective: Vec<Vec<f64>>,
    /// Posterior probability of each split, by level and split; empty unless they were to be kept.
    splits: Vec<Vec<Vec<f32>>>,
    /// ln R of the root.
    pub log_root: f64,
}

/// One chunk of a level's arrays to be filled.
struct UpTask<'a> {
    first: usize,
    weight: &'a mut [f64],
    squared: &'a mut [f64],
    log_r: &'a mut [f64],
    splits: Vec<&'a mut [f32]>,
}

/// Runs tasks side by side if that is worth it: in the pool, or on the caller's thread.
fn each<T: Send>(pool: Option<&ThreadPool>, tasks: Vec<T>, work: impl Fn(T) + Sync + Send) {
    match pool {
        Some(pool) if tasks.len() > 8 => pool.install(|| tasks.into_par_iter().for_each(work)),
        _ => tasks.into_iter().for_each(work),
    }
}

/// The chunks of an array, or empty slices without end if there is no array.
fn chunks<T>(values: &mut [T], size: usize) -> impl Iterator<Item = &mut [T]> {
    values
        .chunks_mut(size)
        .chain(std::iter::repeat_with(|| [].as_mut_slice()))
}

/// From the cells to the root: sums, evidence and, if `keep`, the probabilities of the splits.
pub(super) fn ascend(grid: &Grid, data: &Data<'_>, c: f64, keep: bool, pool: Option<&ThreadPool>) -> Evidence {
    let levels = grid.levels();
    let mut weight: Vec<Vec<f64>> = vec![Vec::new(); levels.len()];
    let mut squared: Vec<Vec<f64>> = vec![Vec::new(); levels.len()];
    let mut log_r: Vec<Vec<f64>> = vec![Vec::new(); levels.len()];
    let mut splits: Vec<Vec<Vec<f32>>> = vec![Vec::new(); levels.len()];
    let mut effective: Vec<Vec<f64>> = vec![Vec::new(); levels.len()];
    let finest = grid.finest();
    weight[finest] = data.weight.to_vec();
    squared[finest] = data.squared.map(<[f64]>::to_vec).unwrap_or_default();
    log_r[finest] = vec![0.0; grid.cells()];
    if data.has_equal_halves() {
        add_log_gamma(c, &weight[finest], &mut log_r[finest]);
    }
    let layers = grid.layers();
    let split_terms = data.base.split_terms(c);
    for (depth, layer) in layers.iter().enumerate().rev().skip(1) {
        for &id in layer {
            let level = &levels[id];
            let mut w = vec![0.0; level.boxes];
            let mut w2 = vec![0.0; if data.squared.is_some() { level.boxes } else { 0 }];
            let mut r = vec![0.0; level.boxes];
            let mut q = vec![vec![0.0_f32; if keep { level.boxes } else { 0 }]; level.splits.len()];
            let mut rows: Vec<_> = q.iter_mut().map(|row| chunks(row, CHUNK)).collect();
            let tasks: Vec<UpTask<'_>> = w
                .chunks_mut(CHUNK)
                .zip(chunks(&mut w2, CHUNK))
                .zip(r.chunks_mut(CHUNK))
                .enumerate()
                .map(|(i, ((weight, squared), log_r))| UpTask {
                    first: i * CHUNK,
                    weight,
                    squared,
                    log_r,
                    splits: rows.iter_mut().filter_map(Iterator::next).collect(),
                })
                .collect();
            drop(rows);
            each(pool, tasks, |task| {
                ascend_chunk(level, data, (c, &split_terms), (&weight, &squared, &log_r), task);
            });
            if data.squared.is_some() {
                effective[id] = w
                    .iter()
                    .zip(&w2)
                    .map(|(w, w2)| if *w2 > 0.0 { w * w / w2 } else { 0.0 })
                    .collect();
            }
            (weight[id], squared[id], log_r[id], splits[id]) = (w, w2, r, q);
        }
        // Boxes two layers down have been asked for the last time.
        for &id in layers.get(depth + 1).into_iter().flatten() {
            log_r[id] = Vec::new();
            squared[id] = Vec::new();
        }
    }
    let mut log_root = [log_r[0][0]];
    if data.has_equal_halves() {
        let mut own = [0.0];
        add_log_gamma(c, &weight[0], &mut own);
        log_root[0] -= own[0];
    }
    Evidence {
        weight,
        effective,
        splits,
        log_root: log_root[0],
    }
}

type Finer<'a> = (&'a [Vec<f64>], &'a [Vec<f64>], &'a [Vec<f64>]);

fn ascend_chunk(level: &Level, data: &Data<'_>, prior: (f64, &SplitTerms), finer: Finer<'_>, task: UpTask<'_>) {
    let (weight, squared, log_r) = finer;
    let (c, split_terms) = prior;
    let (first, n) = (task.first, task.weight.len());
    let mut buffer = [[0.0; CHUNK]; 5];
    let [lower, upper, r0, r1, share] = buffer.each_mut().map(|b| &mut b[..n]);
    let step = level.splits[0];
    step.halves(&weight[step.level], first, lower, upper);
    add(task.weight, lower, upper);
    if data.squared.is_some() {
        step.halves(&squared[step.level], first, lower, upper);
        add(task.squared, lower, upper);
    }
    let mut count = [0.0; CHUNK];
    let count = &mut count[..n];
    count.copy_from_slice(task.weight);
    if data.squared.is_some() {
        for (m, w2) in count.iter_mut().zip(&*task.squared) {
            *m = if *w2 > 0.0 { *m * *m / w2 } else { 0.0 };
        }
    }
    // Less than two points say nothing about a split: every term of the evidence is its prior, and they sum to one.
    if count.iter().all(|n| *n <= 1.0) {
        #[allow(clippy::cast_possible_truncation, reason = "a simple fraction")]
        let prior = (super::kernel::SPLIT / level.splits.len() as f64) as f32;
        task.splits.into_iter().for_each(|q| q.fill(prior));
        if data.has_equal_halves() {
            add_log_gamma(c, count, task.log_r);
        }
        return;
    }
    let mut terms = vec![0.0; n * level.splits.len()];
    let mut of_base = [[0.0; CHUNK]; 4];
    let [prior, log_lower, log_upper, whole_gamma] = of_base.each_mut().map(|b| &mut b[..n]);
    if !data.has_equal_halves() {
        log_gamma(c, count, whole_gamma);
    }
    for (step, term) in level.splits.iter().zip(terms.chunks_exact_mut(n)) {
        step.halves(&log_r[step.level], first, r0, r1);
        add(term, r0, r1);
        if !data.has_equal_halves() {
            step.halves(&weight[step.level], first, lower, upper);
            if data.squared.is_some() {
                for ((l, u), n) in lower.iter_mut().zip(&mut *upper).zip(&*count) {
                    let scale = if *l + *u > 0.0 { n / (*l + *u) } else { 0.0 };
                    (*l, *u) = (*l * scale, *u * scale);
                }
            }
            let mut splits = Splits {
                share: &mut *share,
                terms: [&mut *prior, &mut *log_lower, &mut *log_upper],
            };
            data.base.splits(split_terms, level, step.axis, first, &mut splits);
            let trial = Trial {
                share,
                terms: [prior, log_lower, log_upper],
                lower,
                upper,
                whole: whole_gamma,
            };
            add_log_bayes(c, &trial, term);
        }
    }
    let whole = r0;
    if data.has_equal_halves() {
        whole_term(c, level.splits.len() as f64, count, whole);
    } else {
        whole.fill((super::kernel::SPLIT / level.splits.len() as f64).ln());
    }
    join(&mut terms, whole, task.log_r);
    for (q, term) in task.splits.into_iter().zip(terms.chunks_exact(n)) {
        for (q, t) in q.iter_mut().zip(term) {
            // Rounded down, so that they never add up to more than one; what is missing stops at the box.
            #[allow(clippy::cast_possible_truncation, reason = "seven digits are kept")]
            {
                *q = (*t * (1.0 - f64::from(f32::EPSILON))) as f32;
            }
        }
    }
    if data.has_equal_halves() {
        add_log_gamma(c, count, task.log_r);
    }
}

fn add(out: &mut [f64], a: &[f64], b: &[f64]) {
    for ((o, a), b) in out.iter_mut().zip(a).zip(b) {
        *o = a + b;
    }
}

/// Mean and mean square of a quantity of each box of a level.
#[derive(Clone, Default)]
struct Moments {
    mean: Vec<f64>,
    square: Vec<f64>,
}

struct DownTask<'a> {
    first: usize,
    flow: (&'a mut [f64], &'a mut [f64]),
    total: (&'a mut [f64], &'a mut [f64]),
}

/// From the root to the cells: posterior mean and mean square of the ratio of each cell.
pub(super) fn descend(
    grid: &Grid,
    data: &Data<'_>,
    c: f64,
    evidence: &Evidence,
    pool: Option<&ThreadPool>,
) -> (Vec<f64>, Vec<f64>) {
    let levels = grid.levels();
    // What reaches a box, and what has stopped at the box or above it and is handed on to its first half-able axis.
    let mut flows = vec![Moments::default(); levels.len()];
    let mut totals = vec![Moments::default(); levels.len()];
    for (depth, layer) in grid.layers().iter().enumerate() {
        for &id in layer {
            let level = &levels[id];
            let zeros = || vec![0.0; level.boxes];
            let [mut m, mut s, mut tm, mut ts] = [zeros(), zeros(), zeros(), zeros()];
            let tasks: Vec<DownTask<'_>> = m
                .chunks_mut(CHUNK)
                .zip(s.chunks_mut(CHUNK))
                .zip(tm.chunks_mut(CHUNK))
                .zip(ts.chunks_mut(CHUNK))
                .enumerate()
                .map(|(i, (((m, s), tm), ts))| DownTask {
                    first: i * CHUNK,
                    flow: (m, s),
                    total: (tm, ts),
                })
                .collect();
            each(pool, tasks, |task| {
                descend_chunk(grid, id, data, c, evidence, (&flows, &totals), task);
            });
            (flows[id], totals[id]) = (Moments { mean: m, square: s }, Moments { mean: tm, square: ts });
        }
        if depth > 0 {
            for &id in &grid.layers()[depth - 1] {
                (flows[id], totals[id]) = (Moments::default(), Moments::default());
            }
        }
    }
    let cells = std::mem::take(&mut totals[grid.finest()]);
    (cells.mean, cells.square)
}

fn descend_chunk(
    grid: &Grid,
    id: usize,
    data: &Data<'_>,
    c: f64,
    evidence: &Evidence,
    coarser: (&[Moments], &[Moments]),
    task: DownTask<'_>,
) {
    let (flows, totals) = coarser;
    let level = &grid.levels()[id];
    let (first, n) = (task.first, task.flow.0.len());
    let own = &evidence.weight[id];
    let mut buffer = [[0.0; CHUNK]; 6];
    let [share, half, whole, mean, square, scratch] = buffer.each_mut().map(|b| &mut b[..n]);
    let mut split = [0.0_f32; CHUNK];
    let split = &mut split[..n];
    if level.origins.is_empty() {
        task.flow.0.fill(1.0);
        task.flow.1.fill(1.0);
    }
    for step in &level.origins {
        let above = &grid.levels()[step.level];
        half.copy_from_slice(&own[first..first + n]);
        step.siblings(own, first, whole);
        for (w, h) in whole.iter_mut().zip(&*half) {
            *w += h;
        }
        if data.squared.is_some() {
            step.wholes(&evidence.effective[step.level], first, scratch);
            for ((h, w), e) in half.iter_mut().zip(&mut *whole).zip(&*scratch) {
                *h = if *w > 0.0 { e * (*h / *w) } else { 0.0 };
                *w = *e;
            }
        }
        if data.base.is_uniform() {
            share.fill(0.5);
        } else {
            half_shares(data, above, *step, first, share);
        }
        let way = above
            .splits
            .iter()
            .position(|s| s.axis == step.axis)
            .expect("each origin has its split");
        step.wholes(&evidence.splits[step.level][way], first, split);
        step.wholes(&flows[step.level].mean, first, mean);
        step.wholes(&flows[step.level].square, first, square);
        let flow = Flow {
            share,
            half,
            whole,
            split,
            mean,
            square,
        };
        add_flow(c, &flow, task.flow.0, task.flow.1);
    }
    // What is not split stops here.
    share.fill(1.0);
    for q in &evidence.splits[id] {
        for (stop, q) in share.iter_mut().zip(&q[first..first + n]) {
            *stop -= f64::from(*q);
        }
    }
    for (total, flow) in [(&mut *task.total.0, &*task.flow.0), (&mut *task.total.1, &*task.flow.1)] {
        for ((t, f), stop) in total.iter_mut().zip(flow).zip(&*share) {
            *t = f * stop;
        }
    }
    // What stopped above is handed on along one path: the first axis that was not yet fully halved.
    for step in &level.origins {
        let above = &grid.levels()[step.level];
        let next = above.splits.iter().map(|s| s.axis).min();
        if next == Some(step.axis) {
            step.wholes(&totals[step.level].mean, first, mean);
            step.wholes(&totals[step.level].square, first, square);
            for i in 0..n {
                task.total.0[i] += mean[i];
                task.total.1[i] += square[i];
            }
        }
    }
}

/// The base share of each of the boxes `first..` in the box it is half of along the step's axis.
fn half_shares(data: &Data<'_>, above: &Level, step: super::grid::Step, first: usize, share: &mut [f64]) {
    let n = share.len();
    let mut lower = [0.0; CHUNK];
    if step.block >= n {
        let start = ((first & !(2 * step.block - 1)) >> 1) + (first & (step.block - 1));
        data.base.lower_shares(above, step.axis, start, share);
    } else {
        let lower = &mut lower[..n / 2];
        data.base.lower_shares(above, step.axis, first / 2, lower);
        for (whole, pair) in lower
            .chunks_exact(step.block)
            .zip(share.chunks_exact_mut(2 * step.block))
        {
            pair[..step.block].copy_from_slice(whole);
            pair[step.block..].copy_from_slice(whole);
        }
    }
    step.sides(first, n, |run, is_upper| {
        if is_upper {
            share[run].iter_mut().for_each(|p| *p = 1.0 - *p);
        }
    });
}
