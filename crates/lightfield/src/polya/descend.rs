//! The sweep from the root to the cells: mean and mean square of the ratio of mass to base mass.

use multiversion::multiversion;
use rayon::ThreadPool;

use super::array::{Array, Workspace};
use super::ascend::Evidence;
use super::chunk::CHUNK;
use super::kernel::{Flow, add_flow};
use super::level::Level;
use super::sweep::{Place, Problem, Scratch, cut, each, effective_counts, sum_tile};

/// Mean and mean square of what reaches a box, and of what has stopped at the box or above it and is handed on to its first
/// half-able axis; over boxes that lie in one place.
type Moments<T> = [T; 4];

/// What is known of the boxes above, which lie in one place: arrays over all of them.
struct Above<'a> {
    place: Place,
    /// Σ w, and the number of points that it is worth: the same if all weights are one.
    weight: &'a [f64],
    count: &'a [f64],
    splits: &'a [f32],
    moments: Moments<&'a [f64]>,
}

/// One chunk of a level to be filled.
struct DownTask<'a> {
    level: &'a Level,
    /// Number of its first box on the level, and within the tile.
    number: usize,
    first: usize,
    /// Σ w of its boxes.
    weight: &'a [f64],
    /// Their splits, split after split; none of boxes that stop nothing here, as they are within tiles.
    splits: Option<&'a [f32]>,
    /// Whether nothing has come from elsewhere: then what stands there means nothing.
    is_fresh: bool,
    moments: Moments<&'a mut [f64]>,
}

/// From the root to the cells: posterior mean and mean square of the ratio of each cell, tile by tile.
pub(super) fn descend(
    problem: &Problem<'_>,
    evidence: &Evidence,
    pool: Option<&ThreadPool>,
    workspace: &mut Workspace,
) -> [Array<f64>; 2] {
    let grid = problem.grid;
    let shared = descend_shared(problem, evidence, pool, workspace);
    let in_tile = grid.cells() / grid.tiles();
    let mut found = [workspace.array(grid.cells()), workspace.array(grid.cells())];
    let [mean, square] = found.each_mut().map(|values| values.chunks_exact_mut(in_tile));
    let tasks = mean.zip(square).enumerate().collect();
    each(pool, problem, tasks, |scratch, (tile, (mean, square))| {
        descend_tile(problem, evidence, &shared, scratch, tile);
        let cells = grid.of_tile.boxes - in_tile;
        mean.copy_from_slice(&scratch.tile[4][cells..]);
        square.copy_from_slice(&scratch.tile[5][cells..]);
    });
    for moment in shared {
        workspace.keep(moment);
    }
    found
}

/// The moments of boxes that are larger than tiles, and what they bring to those that they are split into.
fn descend_shared(
    problem: &Problem<'_>,
    evidence: &Evidence,
    pool: Option<&ThreadPool>,
    workspace: &mut Workspace,
) -> Moments<Array<f64>> {
    let (grid, levels) = (problem.grid, problem.grid.levels());
    let boxes = grid.shared.boxes;
    let mut moments: Moments<Array<f64>> = std::array::from_fn(|_| workspace.array(boxes));
    for (values, root) in moments.iter_mut().zip([1.0, 1.0, 0.0, 0.0]) {
        values[0] = root;
    }
    let mut effective = workspace.array(evidence.shared.squared.len());
    effective_counts(&evidence.shared.weight, &evidence.shared.squared, &mut effective);
    for layer in &grid.layers {
        let mut tasks = Vec::new();
        let mut passed = None;
        let mut above = moments.each_mut().map(|values| &mut values[..]);
        let mut own: Moments<&mut [f64]> = Default::default();
        for id in layer {
            let level = &levels[*id];
            let Some(span) = level.shared else { continue };
            if passed.is_none() {
                let begin = span.first.boxes;
                let parts = above.map(|values| values.split_at_mut(begin));
                let [a, b, c, d] = parts;
                (above, own) = ([a.0, b.0, c.0, d.0], [a.1, b.1, c.1, d.1]);
                passed = Some(begin);
            }
            for first in (0..span.boxes).step_by(CHUNK) {
                let n = span.chunk();
                let begin = span.first.boxes + first;
                let splits = span.splits(level.splits.len(), first);
                tasks.push(DownTask {
                    level,
                    number: first,
                    first,
                    weight: &evidence.shared.weight[begin..begin + n],
                    splits: level.in_tile.is_none().then(|| &evidence.shared.splits[splits]),
                    is_fresh: *id > 0,
                    moments: own
                        .each_mut()
                        .map(|values| values.split_off_mut(..n).unwrap_or_default()),
                });
            }
        }
        let above = Above {
            place: Place::Shared,
            weight: &evidence.shared.weight,
            count: if problem.is_weighted {
                &effective
            } else {
                &evidence.shared.weight
            },
            splits: &evidence.shared.splits,
            moments: above.map(|values| &*values),
        };
        each(pool, problem, tasks, |scratch, task| {
            descend_chunk(problem, &above, scratch, task);
        });
    }
    workspace.keep(effective);
    moments
}

/// The moments of the boxes of a tile, in the last four arrays for it.
fn descend_tile(
    problem: &Problem<'_>,
    evidence: &Evidence,
    shared: &Moments<Array<f64>>,
    scratch: &mut Scratch,
    tile: usize,
) {
    let (grid, levels) = (problem.grid, problem.grid.levels());
    let in_tile = grid.cells() / grid.tiles();
    let cells = tile * in_tile..(tile + 1) * in_tile;
    let [mut weight, mut count, mut moments @ ..] = std::mem::take(&mut scratch.tile);
    if problem.is_weighted {
        let mut squared = Vec::new();
        sum_tile(grid, &evidence.squared[cells.clone()], &mut scratch.rows, &mut squared);
        sum_tile(grid, &evidence.weight[cells], &mut scratch.rows, &mut weight);
        count.resize(weight.len(), 0.0);
        effective_counts(&weight, &squared, &mut count);
    } else {
        sum_tile(grid, &evidence.weight[cells], &mut scratch.rows, &mut weight);
    }
    let splits = &evidence.splits[tile * grid.of_tile.splits..][..grid.of_tile.splits];
    for values in &mut moments {
        values.resize(grid.of_tile.boxes, 0.0);
    }
    for id in &grid.edges {
        let level = &levels[*id];
        let (Some(of_tile), Some(side_by_side)) = (level.in_tile, level.shared) else {
            continue;
        };
        let from = side_by_side.first.boxes + tile * of_tile.boxes;
        for (values, shared) in moments.iter_mut().zip(shared) {
            values[of_tile.range()].copy_from_slice(&shared[from..from + of_tile.boxes]);
        }
    }
    for level in levels {
        let Some(span) = level.in_tile else { continue };
        let [a, b, c, d] = moments.each_mut().map(|values| values.split_at_mut(span.first.boxes));
        let above = Above {
            place: Place::Tile,
            weight: &weight,
            count: if problem.is_weighted { &count } else { &weight },
            splits,
            moments: [a.0, b.0, c.0, d.0],
        };
        let mut own = [a.1, b.1, c.1, d.1];
        for first in (0..span.boxes).step_by(CHUNK) {
            let n = span.chunk();
            let begin = span.first.boxes + first;
            let task = DownTask {
                level,
                number: tile * span.boxes + first,
                first,
                weight: &weight[begin..begin + n],
                splits: Some(&splits[span.splits(level.splits.len(), first)]),
                is_fresh: level.shared.is_none(),
                moments: own
                    .each_mut()
                    .map(|values| values.split_off_mut(..n).unwrap_or_default()),
            };
            descend_chunk(problem, &above, scratch, task);
        }
    }
    let [a, b, c, d] = moments;
    scratch.tile = [weight, count, a, b, c, d];
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn descend_chunk(problem: &Problem<'_>, above: &Above<'_>, scratch: &mut Scratch, task: DownTask<'_>) {
    let (levels, level) = (problem.grid.levels(), task.level);
    let mut moments = task.moments;
    if task.is_fresh {
        for values in &mut moments {
            values.fill(0.0);
        }
    }
    let [flow_mean, flow_square, total_mean, total_square] = moments;
    let (first, n) = (task.first, flow_mean.len());
    let [share, half, gathered, whole, mean, square, ..] = cut(&mut scratch.rows, n);
    let split = &mut scratch.split[..n];
    for step in &level.origins {
        let from = &levels[step.level];
        // Boxes within tiles bring nothing to any that lie elsewhere, and what larger boxes bring has come.
        let is_there = (above.place == Place::Tile) == from.in_tile.is_some();
        let Some(span) = above.place.of(from).filter(|_| is_there) else {
            continue;
        };
        let whole = step.wholes(&above.weight[span.range()], first, whole);
        let (half, whole) = if problem.is_weighted {
            let count = step.wholes(&above.count[span.range()], first, gathered);
            for (i, h) in half.iter_mut().enumerate() {
                *h = if whole[i] > 0.0 {
                    count[i] * (task.weight[i] / whole[i])
                } else {
                    0.0
                };
            }
            (&*half, count)
        } else {
            (task.weight, whole)
        };
        problem.base.half_shares(level, step.axis, task.number, share);
        let way = from
            .splits
            .iter()
            .position(|s| s.axis == step.axis)
            .expect("each origin has its split");
        let wholes = step.range_of_wholes(first, n);
        let splits = span.of_split(above.splits, from.splits.len(), way, wholes);
        let flow = Flow {
            share,
            half,
            whole,
            split: step.dealt(splits, split),
            mean: step.wholes(&above.moments[0][span.range()], first, mean),
            square: step.wholes(&above.moments[1][span.range()], first, square),
        };
        add_flow(problem.c, &flow, flow_mean, flow_square);
        // What stopped above is handed on along one path: the first axis that was not yet fully halved.
        if from.splits.iter().all(|s| s.axis >= step.axis) {
            let stopped = [(&mut *total_mean, 2, &mut *mean), (&mut *total_square, 3, &mut *square)];
            for (total, kind, buffer) in stopped {
                let handed = step.wholes(&above.moments[kind][span.range()], first, buffer);
                total.iter_mut().zip(handed).for_each(|(t, h)| *t += h);
            }
        }
    }
    // What is not split stops here.
    if let Some(splits) = task.splits {
        share.fill(1.0);
        for q in splits.chunks_exact(n) {
            for (stop, q) in share.iter_mut().zip(q) {
                *stop -= f64::from(*q);
            }
        }
        for (total, flow) in [(total_mean, flow_mean), (total_square, flow_square)] {
            for ((t, f), stop) in total.iter_mut().zip(flow).zip(&*share) {
                *t += *f * stop;
            }
        }
    }
}
