//! The sweep from the cells to the root: sums, evidence, and the posterior probability of each split.

use multiversion::multiversion;
use rayon::ThreadPool;

use super::array::{Array, Workspace};
use super::base::Splits;
use super::chunk::{Busy, CHUNK};
use super::data::Data;
use super::kernel::{SPLIT, Trial, add_log_bayes, add_log_gamma, join, log_gamma, whole_term, write_split};
use super::level::Level;
use super::sweep::{Place, Problem, Scratch, add, cut, each, effective_counts, sum_chunk, sum_tile};

/// What the sweep leaves behind.
pub(super) struct Evidence {
    /// Σ w of each cell, tile by tile.
    pub weight: Array<f64>,
    /// Σ w²; empty if all weights are one.
    pub squared: Array<f64>,
    /// Posterior probabilities of the splits of boxes within tiles, tile by tile; empty unless they were to be kept.
    pub splits: Array<f32>,
    /// The same of boxes that are larger than tiles; sums over them, and over those that they are split into.
    pub shared: Shared,
    /// ln R of the root.
    pub log_root: f64,
}

/// What is known of the levels that lie side by side.
pub(super) struct Shared {
    /// Σ w of each box.
    pub weight: Array<f64>,
    /// Σ w² of each box; empty if all weights are one.
    pub squared: Array<f64>,
    /// ln R of each box.
    log_r: Array<f64>,
    pub splits: Array<f32>,
}

impl Evidence {
    /// Gives its memory back.
    pub fn give(self, workspace: &mut Workspace) {
        let Shared {
            weight,
            squared,
            log_r,
            splits,
        } = self.shared;
        for sums in [self.weight, self.squared, weight, squared, log_r] {
            workspace.keep(sums);
        }
        workspace.keep(self.splits);
        workspace.keep(splits);
    }
}

/// From the cells, moved by so many steps, to the root: sums, evidence and, if `keep`, the probabilities of the splits.
pub(super) fn ascend(
    problem: &Problem<'_>,
    data: &Data<'_>,
    steps: &[usize],
    keep: bool,
    pool: Option<&ThreadPool>,
    workspace: &mut Workspace,
) -> Evidence {
    let grid = problem.grid;
    let weighted = |n: usize| if problem.is_weighted { n } else { 0 };
    let kept = |n: usize| if keep { n } else { 0 };
    let mut weight = workspace.array(grid.cells());
    grid.arrange(data.weight, steps, &mut weight);
    let mut squared = workspace.array(weighted(grid.cells()));
    if let Some(w2) = data.squared {
        grid.arrange(w2, steps, &mut squared);
    }
    let mut splits = workspace.array(kept(grid.tiles() * grid.of_tile.splits));
    let mut shared = Shared {
        weight: workspace.array(grid.shared.boxes),
        squared: workspace.array(weighted(grid.shared.boxes)),
        log_r: workspace.array(grid.shared.boxes),
        splits: workspace.array(kept(grid.shared.splits)),
    };
    ascend_tiles(
        problem,
        (&weight, &squared),
        &mut splits,
        &mut shared,
        (pool, workspace),
    );
    for layer in grid.layers.iter().rev() {
        ascend_layer(problem, layer, &mut shared, pool);
    }
    let mut log_root = shared.log_r[0];
    if problem.has_equal_halves() {
        let mut own = [0.0];
        add_log_gamma(problem.c, &shared.weight[..1], &Busy::none(), &mut own);
        log_root -= own[0];
    }
    Evidence {
        weight,
        squared,
        splits,
        shared,
        log_root,
    }
}

/// One tile to be swept.
struct TileTask<'a> {
    tile: usize,
    cells: &'a [f64],
    squared: &'a [f64],
    splits: &'a mut [f32],
    /// ln R, Σ w and, of unequal weights, Σ w² of the boxes on the levels of edges.
    edges: &'a mut [f64],
}

fn ascend_tiles(
    problem: &Problem<'_>,
    cells: (&[f64], &[f64]),
    splits: &mut [f32],
    shared: &mut Shared,
    (pool, workspace): (Option<&ThreadPool>, &mut Workspace),
) {
    let grid = problem.grid;
    let spans = || grid.edges.iter().filter_map(|id| grid.levels()[*id].in_tile);
    let of_edges: usize = spans().map(|span| span.boxes).sum();
    let in_tile = grid.cells() / grid.tiles();
    let kinds = if problem.is_weighted { 3 } else { 2 };
    let mut edges = workspace.array(grid.tiles() * of_edges * kinds);
    let (mut weight, mut squared, mut of_splits, mut rest) = (cells.0, cells.1, splits, &mut edges[..]);
    let tasks = (0..grid.tiles()).map(|tile| TileTask {
        tile,
        cells: weight.split_off(..in_tile).unwrap_or_default(),
        squared: squared.split_off(..in_tile).unwrap_or_default(),
        splits: of_splits.split_off_mut(..grid.of_tile.splits).unwrap_or_default(),
        edges: rest.split_off_mut(..of_edges * kinds).unwrap_or_default(),
    });
    each(pool, problem, tasks.collect(), |scratch, task| {
        ascend_tile(problem, scratch, task);
    });
    // What boxes that are larger than tiles are made of is put side by side.
    let arrays = [&mut shared.log_r, &mut shared.weight, &mut shared.squared];
    for (kind, to) in arrays.into_iter().enumerate().take(kinds) {
        let mut begin = kind * of_edges;
        for id in &grid.edges {
            let level = &grid.levels()[*id];
            let (Some(of_tile), Some(side_by_side)) = (level.in_tile, level.shared) else {
                continue;
            };
            if problem.is_stopped() {
                break;
            }
            let to = to[side_by_side.range()].chunks_exact_mut(of_tile.boxes);
            for (to, from) in to.zip(edges.chunks_exact(of_edges * kinds)) {
                to.copy_from_slice(&from[begin..begin + of_tile.boxes]);
            }
            begin += of_tile.boxes;
        }
    }
    workspace.keep(edges);
}

fn ascend_tile(problem: &Problem<'_>, scratch: &mut Scratch, task: TileTask<'_>) {
    let (grid, levels) = (problem.grid, problem.grid.levels());
    let [mut weight, mut squared, mut log_r, ..] = std::mem::take(&mut scratch.tile);
    sum_tile(grid, task.cells, &mut scratch.rows, &mut weight);
    if problem.is_weighted {
        sum_tile(grid, task.squared, &mut scratch.rows, &mut squared);
    }
    log_r.resize(grid.of_tile.boxes, 0.0);
    let cells = grid.of_tile.boxes - task.cells.len();
    log_r[cells..].fill(0.0);
    if problem.has_equal_halves() {
        for (counts, out) in task.cells.chunks(CHUNK).zip(log_r[cells..].chunks_mut(CHUNK)) {
            scratch.busy.find(counts);
            add_log_gamma(problem.c, counts, &scratch.busy, out);
        }
    }
    for level in levels[..grid.finest()].iter().rev() {
        let Some(span) = level.in_tile else { continue };
        let (own, finer_r) = log_r.split_at_mut(span.range().end);
        let finer = Finer {
            place: Place::Tile,
            origin: span.range().end,
            levels,
            weight: &weight[span.range().end..],
            log_r: finer_r,
        };
        let own = &mut own[span.range()];
        for (chunk, own) in own.chunks_mut(CHUNK).enumerate() {
            let first = chunk * CHUNK;
            let boxes = span.first.boxes + first..span.first.boxes + first + own.len();
            let splits = span.splits(level.splits.len(), first);
            ascend_chunk(
                problem,
                &finer,
                scratch,
                UpTask {
                    level,
                    number: task.tile * span.boxes + first,
                    first,
                    weight: &weight[boxes.clone()],
                    squared: squared.get(boxes).unwrap_or_default(),
                    log_r: own,
                    splits: task.splits.get_mut(splits).unwrap_or_default(),
                },
            );
        }
    }
    let mut edges = task.edges;
    for values in [&log_r, &weight, &squared] {
        for span in grid.edges.iter().filter_map(|id| levels[*id].in_tile) {
            if let Some(to) = edges.split_off_mut(..span.boxes) {
                to.copy_from_slice(&values[span.range()]);
            }
        }
    }
    scratch.tile = [weight, squared, log_r, Vec::new(), Vec::new(), Vec::new()];
}

/// The boxes of a layer that are larger than tiles.
fn ascend_layer(problem: &Problem<'_>, layer: &[usize], shared: &mut Shared, pool: Option<&ThreadPool>) {
    let levels = problem.grid.levels();
    let spans = || layer.iter().filter_map(|id| Some((&levels[*id], levels[*id].shared?)));
    let Some((begin, end)) = spans()
        .map(|(_, span)| span.range())
        .map(|range| (range.start, range.end))
        .reduce(|a, b| (a.0, b.1))
    else {
        return;
    };
    let (own_weight, finer_weight) = shared.weight.split_at_mut(end);
    let (own_squared, finer_squared) = shared.squared.split_at_mut(if problem.is_weighted { end } else { 0 });
    let (own_log_r, finer_log_r) = shared.log_r.split_at_mut(end);
    let (mut weights, mut seconds, mut logs) = (
        &mut own_weight[begin..],
        own_squared.get_mut(begin..).unwrap_or_default(),
        &mut own_log_r[begin..],
    );
    let mut tasks = Vec::new();
    let mut rest = &mut shared.splits[..];
    let mut passed = 0;
    for (level, span) in spans() {
        if level.in_tile.is_some() {
            for values in [&mut weights, &mut seconds, &mut logs] {
                let _ = values.split_off_mut(..span.boxes);
            }
            continue;
        }
        let ways = level.splits.len();
        for first in (0..span.boxes).step_by(CHUNK) {
            let n = span.chunk();
            let splits = span.splits(ways, first);
            let _ = rest.split_off_mut(..splits.start - passed);
            passed = splits.end;
            tasks.push((
                Sums {
                    weight: weights.split_off_mut(..n).unwrap_or_default(),
                    squared: seconds.split_off_mut(..n).unwrap_or_default(),
                },
                (level, first),
                logs.split_off_mut(..n).unwrap_or_default(),
                rest.split_off_mut(..splits.len()).unwrap_or_default(),
            ));
        }
    }
    let finer = Finer {
        place: Place::Shared,
        origin: end,
        levels,
        weight: finer_weight,
        log_r: finer_log_r,
    };
    each(
        pool,
        problem,
        tasks,
        |scratch, (sums, (level, first), log_r, splits)| {
            let step = level.splits[0];
            sum_chunk(
                level,
                finer.of(step.level, finer.weight),
                first,
                &mut scratch.rows,
                sums.weight,
            );
            if problem.is_weighted {
                let squares = finer.of(step.level, finer_squared);
                sum_chunk(level, squares, first, &mut scratch.rows, sums.squared);
            }
            ascend_chunk(
                problem,
                &finer,
                scratch,
                UpTask {
                    level,
                    number: first,
                    first,
                    weight: sums.weight,
                    squared: sums.squared,
                    log_r,
                    splits,
                },
            );
        },
    );
}

/// Sums of a chunk that are yet to be formed.
struct Sums<'a> {
    weight: &'a mut [f64],
    squared: &'a mut [f64],
}

/// The boxes that some are halved into: arrays from the box `origin` on.
struct Finer<'a> {
    place: Place,
    origin: usize,
    levels: &'a [Level],
    weight: &'a [f64],
    log_r: &'a [f64],
}

impl Finer<'_> {
    /// The entries of a level.
    fn of<'b>(&self, level: usize, values: &'b [f64]) -> &'b [f64] {
        let span = self
            .place
            .of(&self.levels[level])
            .expect("halves lie beside their wholes");
        &values[span.first.boxes - self.origin..][..span.boxes]
    }
}

/// One chunk of a level to be filled.
struct UpTask<'a> {
    level: &'a Level,
    /// Number of its first box on the level, and within the tile.
    number: usize,
    first: usize,
    weight: &'a [f64],
    squared: &'a [f64],
    log_r: &'a mut [f64],
    /// Split after split; empty if they are not kept.
    splits: &'a mut [f32],
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn ascend_chunk(problem: &Problem<'_>, finer: &Finer<'_>, scratch: &mut Scratch, task: UpTask<'_>) {
    let (c, level) = (problem.c, task.level);
    let (first, n) = (task.first, task.weight.len());
    let rows = cut(&mut scratch.rows, n);
    let [
        b0,
        b1,
        b2,
        b3,
        effective,
        prior,
        log_lower,
        log_upper,
        share,
        whole_gamma,
        scaled_lower,
        scaled_upper,
    ] = rows;
    let count = if problem.is_weighted {
        effective_counts(task.weight, task.squared, effective);
        &*effective
    } else {
        task.weight
    };
    let busy = &mut scratch.busy;
    busy.find(count);
    let ways = level.splits.len();
    task.log_r.fill(0.0);
    if busy.is_empty() {
        #[allow(clippy::cast_possible_truncation, reason = "a simple fraction")]
        task.splits.fill((SPLIT / ways as f64) as f32);
        if problem.has_equal_halves() {
            add_log_gamma(c, count, busy, task.log_r);
        }
        return;
    }
    let terms = &mut scratch.terms[..n * ways];
    if !problem.has_equal_halves() {
        log_gamma(c, count, busy, whole_gamma);
    }
    for (step, term) in level.splits.iter().zip(terms.chunks_exact_mut(n)) {
        let (r0, r1) = step.halves(finer.of(step.level, finer.log_r), first, b0, b1);
        add(term, r0, r1);
        if !problem.has_equal_halves() {
            let (lower, upper) = step.halves(finer.of(step.level, finer.weight), first, b2, b3);
            let (lower, upper) = if problem.is_weighted {
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
            let place = (level, step.axis, task.number);
            problem.base.splits(&problem.terms, place, busy, &mut splits);
            let trial = Trial {
                share,
                terms: [prior, log_lower, log_upper],
                lower,
                upper,
                whole: whole_gamma,
            };
            add_log_bayes(c, &trial, busy, term);
        }
    }
    let whole = b0;
    if problem.has_equal_halves() {
        whole_term(c, ways as f64, count, busy, whole);
    } else {
        whole.fill((SPLIT / ways as f64).ln());
    }
    join(terms, whole, busy, task.log_r);
    for (split, term) in task.splits.chunks_exact_mut(n).zip(terms.chunks_exact(n)) {
        write_split(SPLIT / ways as f64, term, busy, split);
    }
    if problem.has_equal_halves() {
        add_log_gamma(c, count, busy, task.log_r);
    }
}
