//! The two sweeps over the lattice: evidence from the cells to the root, ratios from the root to the cells.

use std::sync::atomic::{AtomicBool, Ordering};

use multiversion::multiversion;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::array::{Array, Workspace};
use super::base::{SplitTerms, Splits};
use super::data::{CHUNK, Data};
use super::grid::{Grid, Level};
use super::kernel::{Flow, Trial, add_flow, add_log_bayes, add_log_gamma, join, log_gamma, whole_term};

/// What the upward sweep leaves behind; arrays over the boxes of each layer.
pub(super) struct Evidence {
    /// Σ w of each box.
    weight: Vec<Array<f64>>,
    /// (Σ w)²/Σ w² of each box; empty if all weights are one.
    effective: Vec<Array<f64>>,
    /// Posterior probability of each split; empty unless they were to be kept.
    splits: Vec<Array<f32>>,
    /// ln R of the root.
    pub log_root: f64,
}

impl Evidence {
    /// Gives its memory back.
    pub fn give(self, workspace: &mut Workspace) {
        self.weight
            .into_iter()
            .chain(self.effective)
            .for_each(|a| workspace.keep(a));
        self.splits.into_iter().for_each(|a| workspace.keep(a));
    }
}

/// One chunk of a level's arrays to be filled.
struct UpTask<'a> {
    level: &'a Level,
    first: usize,
    weight: &'a mut [f64],
    squared: &'a mut [f64],
    log_r: &'a mut [f64],
    splits: Vec<&'a mut [f32]>,
}

/// Rows that a chunk needs.
const ROWS: usize = 12;

/// Room for the numbers of a chunk.
type Row = [f64; CHUNK];

/// What the work on a chunk needs room for; made once per thread, as clearing it takes time.
struct Scratch {
    rows: Box<[Row; ROWS]>,
    /// As many rows as there are axes, one after the other.
    terms: Vec<f64>,
    split: [f32; CHUNK],
}

impl Scratch {
    fn new(axes: usize) -> Self {
        Self {
            rows: vec![[0.0; CHUNK]; ROWS].try_into().expect("as many"),
            terms: vec![0.0; axes * CHUNK],
            split: [0.0; CHUNK],
        }
    }
}

/// Runs tasks until it is stopped, side by side if that is worth it: in the pool, or on the caller's thread.
fn each<T: Send>(
    pool: Option<&ThreadPool>,
    stop: Option<&AtomicBool>,
    axes: usize,
    tasks: Vec<T>,
    work: impl Fn(&mut Scratch, T) + Sync + Send,
) {
    let work = |scratch: &mut Scratch, task| {
        if !stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            work(scratch, task);
        }
    };
    match pool {
        Some(pool) if tasks.len() > 8 => {
            pool.install(|| tasks.into_par_iter().for_each_init(|| Scratch::new(axes), work));
        }
        _ => {
            let mut scratch = Scratch::new(axes);
            for task in tasks {
                work(&mut scratch, task);
            }
        }
    }
}

/// From the cells to the root: sums, evidence and, if `keep`, the probabilities of the splits.
pub(super) fn ascend(
    grid: &Grid,
    data: &Data<'_>,
    c: f64,
    keep: bool,
    pool: Option<&ThreadPool>,
    workspace: &mut Workspace,
) -> Evidence {
    let (levels, layers) = (grid.levels(), grid.layers());
    let none = || layers.iter().map(|_| Array::default()).collect::<Vec<_>>();
    let (mut weight, mut squared, mut log_r, mut effective) = (none(), none(), none(), none());
    let mut splits: Vec<_> = layers.iter().map(|_| Array::default()).collect();
    let last = layers.len() - 1;
    weight[last] = workspace.copy(data.weight);
    squared[last] = data.squared.map(|w2| workspace.copy(w2)).unwrap_or_default();
    log_r[last] = workspace.array(grid.cells());
    log_r[last].fill(0.0);
    if data.has_equal_halves() {
        add_log_gamma(c, data.weight, &mut log_r[last]);
    }
    let split_terms = data.base.split_terms(c);
    for (depth, layer) in layers.iter().enumerate().rev().skip(1) {
        let boxes = layer.iter().map(|id| levels[*id].boxes).sum();
        let of_splits = layer
            .iter()
            .map(|id| levels[*id].boxes * levels[*id].splits.len())
            .sum();
        let mut w = workspace.array(boxes);
        let mut w2 = workspace.array(if data.squared.is_some() { boxes } else { 0 });
        let mut r = workspace.array(boxes);
        let mut q = workspace.array(if keep { of_splits } else { 0 });
        let mut tasks = Vec::with_capacity(boxes / CHUNK + layer.len());
        let (mut weights, mut second, mut logs, mut rest) = (&mut w[..], &mut w2[..], &mut r[..], &mut q[..]);
        for id in layer {
            let level = &levels[*id];
            let mut rows: Vec<_> = level
                .splits
                .iter()
                .map(|_| rest.split_off_mut(..level.boxes).unwrap_or_default())
                .collect();
            for first in (0..level.boxes).step_by(CHUNK) {
                let n = CHUNK.min(level.boxes);
                tasks.push(UpTask {
                    level,
                    first,
                    weight: weights.split_off_mut(..n).unwrap_or_default(),
                    squared: second.split_off_mut(..n).unwrap_or_default(),
                    log_r: logs.split_off_mut(..n).unwrap_or_default(),
                    splits: rows
                        .iter_mut()
                        .map(|row| row.split_off_mut(..n).unwrap_or_default())
                        .collect(),
                });
            }
        }
        let finer = Finer {
            levels,
            weight: &weight[depth + 1],
            squared: &squared[depth + 1],
            log_r: &log_r[depth + 1],
        };
        each(pool, data.stop, grid.depths().len(), tasks, |scratch, task| {
            ascend_chunk(data, (c, &split_terms), &finer, scratch, task);
        });
        if data.squared.is_some() {
            effective[depth] = workspace.array(boxes);
            for ((e, w), w2) in effective[depth].iter_mut().zip(&*w).zip(&*w2) {
                *e = if *w2 > 0.0 { w * w / w2 } else { 0.0 };
            }
        }
        (weight[depth], squared[depth], log_r[depth], splits[depth]) = (w, w2, r, q);
        // Boxes of the finer layer have been asked for the last time.
        for array in [&mut squared[depth + 1], &mut log_r[depth + 1]] {
            workspace.keep(std::mem::take(array));
        }
    }
    let mut log_root = log_r[0][0];
    if data.has_equal_halves() {
        let mut own = [0.0];
        add_log_gamma(c, &weight[0], &mut own);
        log_root -= own[0];
    }
    Evidence {
        weight,
        effective,
        splits,
        log_root,
    }
}

/// The layer that the boxes are halved into.
struct Finer<'a> {
    levels: &'a [Level],
    weight: &'a [f64],
    squared: &'a [f64],
    log_r: &'a [f64],
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn ascend_chunk(
    data: &Data<'_>,
    prior: (f64, &SplitTerms),
    finer: &Finer<'_>,
    scratch: &mut Scratch,
    task: UpTask<'_>,
) {
    let (c, split_terms) = prior;
    let level = task.level;
    let (first, n) = (task.first, task.weight.len());
    let rows = scratch.rows.each_mut().map(|row| &mut row[..n]);
    let [
        b0,
        b1,
        b2,
        b3,
        count,
        prior,
        log_lower,
        log_upper,
        share,
        whole_gamma,
        scaled_lower,
        scaled_upper,
    ] = rows;
    let step = level.splits[0];
    let (lower, upper) = step.halves(finer.levels[step.level].of(finer.weight), first, b0, b1);
    add(task.weight, lower, upper);
    if data.squared.is_some() {
        let (lower, upper) = step.halves(finer.levels[step.level].of(finer.squared), first, b0, b1);
        add(task.squared, lower, upper);
    }
    count.copy_from_slice(task.weight);
    if data.squared.is_some() {
        for (m, w2) in count.iter_mut().zip(&*task.squared) {
            *m = if *w2 > 0.0 { *m * *m / w2 } else { 0.0 };
        }
    }
    // Less than two points say nothing about a split: every term of the evidence is its prior, and they sum to one.
    if count.iter().all(|n| *n <= 1.0) {
        #[allow(clippy::cast_possible_truncation, reason = "a simple fraction")]
        let each = (super::kernel::SPLIT / level.splits.len() as f64) as f32;
        task.splits.into_iter().for_each(|q| q.fill(each));
        task.log_r.fill(0.0);
        if data.has_equal_halves() {
            add_log_gamma(c, count, task.log_r);
        }
        return;
    }
    let terms = &mut scratch.terms[..n * level.splits.len()];
    if !data.has_equal_halves() {
        log_gamma(c, count, whole_gamma);
    }
    for (step, term) in level.splits.iter().zip(terms.chunks_exact_mut(n)) {
        let (r0, r1) = step.halves(finer.levels[step.level].of(finer.log_r), first, b0, b1);
        add(term, r0, r1);
        if !data.has_equal_halves() {
            let (lower, upper) = step.halves(finer.levels[step.level].of(finer.weight), first, b2, b3);
            let (lower, upper) = if data.squared.is_some() {
                for (i, n) in count.iter().enumerate() {
                    let sum = lower[i] + upper[i];
                    let scale = if sum > 0.0 { n / sum } else { 0.0 };
                    (scaled_lower[i], scaled_upper[i]) = (lower[i] * scale, upper[i] * scale);
                }
                (&*scaled_lower, &*scaled_upper)
            } else {
                (lower, upper)
            };
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
    let whole = b0;
    if data.has_equal_halves() {
        whole_term(c, level.splits.len() as f64, count, whole);
    } else {
        whole.fill((super::kernel::SPLIT / level.splits.len() as f64).ln());
    }
    join(terms, whole, task.log_r);
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

/// Mean and mean square of what reaches a box, and of what has stopped at the box or above it and is handed on to its first
/// half-able axis; over the boxes of a layer.
#[derive(Default)]
struct Moments {
    flow: [Array<f64>; 2],
    total: [Array<f64>; 2],
}

struct DownTask<'a> {
    level: &'a Level,
    first: usize,
    flow: [&'a mut [f64]; 2],
    total: [&'a mut [f64]; 2],
}

/// From the root to the cells: posterior mean and mean square of the ratio of each cell.
pub(super) fn descend(
    grid: &Grid,
    data: &Data<'_>,
    c: f64,
    evidence: &Evidence,
    pool: Option<&ThreadPool>,
    workspace: &mut Workspace,
) -> [Array<f64>; 2] {
    let levels = grid.levels();
    let mut coarser = Moments::default();
    for layer in grid.layers() {
        let boxes = layer.iter().map(|id| levels[*id].boxes).sum();
        let mut own = Moments {
            flow: [workspace.array(boxes), workspace.array(boxes)],
            total: [workspace.array(boxes), workspace.array(boxes)],
        };
        let mut tasks = Vec::with_capacity(boxes / CHUNK + layer.len());
        let mut flow = own.flow.each_mut().map(|f| &mut f[..]);
        let mut total = own.total.each_mut().map(|t| &mut t[..]);
        for id in layer {
            let level = &levels[id];
            for first in (0..level.boxes).step_by(CHUNK) {
                let n = CHUNK.min(level.boxes);
                tasks.push(DownTask {
                    level,
                    first,
                    flow: flow.each_mut().map(|f| f.split_off_mut(..n).unwrap_or_default()),
                    total: total.each_mut().map(|t| t.split_off_mut(..n).unwrap_or_default()),
                });
            }
        }
        each(pool, data.stop, levels[0].halvings.len(), tasks, |scratch, task| {
            descend_chunk(levels, data, c, evidence, &coarser, scratch, task);
        });
        let above = std::mem::replace(&mut coarser, own);
        above
            .flow
            .into_iter()
            .chain(above.total)
            .for_each(|a| workspace.keep(a));
    }
    coarser.flow.into_iter().for_each(|a| workspace.keep(a));
    coarser.total
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn descend_chunk(
    levels: &[Level],
    data: &Data<'_>,
    c: f64,
    evidence: &Evidence,
    coarser: &Moments,
    scratch: &mut Scratch,
    task: DownTask<'_>,
) {
    let level = task.level;
    let ([flow_mean, flow_square], [total_mean, total_square]) = (task.flow, task.total);
    let (first, n) = (task.first, flow_mean.len());
    let own = &level.of(&evidence.weight[level.layer])[first..first + n];
    let [share, half, gathered, whole, mean, square, ..] = scratch.rows.each_mut().map(|row| &mut row[..n]);
    let split = &mut scratch.split[..n];
    let start = if level.origins.is_empty() { 1.0 } else { 0.0 };
    flow_mean.fill(start);
    flow_square.fill(start);
    for step in &level.origins {
        let above = &levels[step.level];
        let whole = step.wholes(above.of(&evidence.weight[above.layer]), first, whole);
        let (half, whole) = if data.squared.is_some() {
            let effective = step.wholes(above.of(&evidence.effective[above.layer]), first, gathered);
            for (i, h) in half.iter_mut().enumerate() {
                *h = if whole[i] > 0.0 {
                    effective[i] * (own[i] / whole[i])
                } else {
                    0.0
                };
            }
            (&*half, effective)
        } else {
            (own, whole)
        };
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
        let flow = Flow {
            share,
            half,
            whole,
            split: step.wholes(above.of_split(&evidence.splits[above.layer], way), first, split),
            mean: step.wholes(above.of(&coarser.flow[0]), first, mean),
            square: step.wholes(above.of(&coarser.flow[1]), first, square),
        };
        add_flow(c, &flow, flow_mean, flow_square);
    }
    // What is not split stops here.
    share.fill(1.0);
    for way in 0..level.splits.len() {
        let q = level.of_split(&evidence.splits[level.layer], way);
        for (stop, q) in share.iter_mut().zip(&q[first..first + n]) {
            *stop -= f64::from(*q);
        }
    }
    for (total, flow) in [(&mut *total_mean, &*flow_mean), (&mut *total_square, &*flow_square)] {
        for ((t, f), stop) in total.iter_mut().zip(flow).zip(&*share) {
            *t = f * stop;
        }
    }
    // What stopped above is handed on along one path: the first axis that was not yet fully halved.
    for step in &level.origins {
        let above = &levels[step.level];
        let next = above.splits.iter().map(|s| s.axis).min();
        if next == Some(step.axis) {
            let mean = step.wholes(above.of(&coarser.total[0]), first, mean);
            let square = step.wholes(above.of(&coarser.total[1]), first, square);
            for i in 0..n {
                total_mean[i] += mean[i];
                total_square[i] += square[i];
            }
        }
    }
}

/// The base share of each of the boxes `first..` in the box it is half of along the step's axis.
fn half_shares(data: &Data<'_>, above: &Level, step: super::grid::Step, first: usize, share: &mut [f64]) {
    let n = share.len();
    if step.block >= n {
        let start = ((first & !(2 * step.block - 1)) >> 1) + (first & (step.block - 1));
        data.base.lower_shares(above, step.axis, start, share);
    } else {
        let mut lower = [0.0; CHUNK];
        let lower = &mut lower[..n / 2];
        data.base.lower_shares(above, step.axis, first / 2, lower);
        step.double(lower, share);
    }
    step.sides(first, n, |run, is_upper| {
        if is_upper {
            share[run].iter_mut().for_each(|p| *p = 1.0 - *p);
        }
    });
}
