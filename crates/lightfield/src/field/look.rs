//! What an observer sees of a light field: luminance averaged over each pixel, by quadrature.

use std::sync::atomic::AtomicBool;

use multiversion::multiversion;
use rayon::prelude::*;

use etendue_geometry::RayBatch;
use etendue_geometry::ray_batch::BLOCK;
use etendue_math::Vec3;
use etendue_sampling::ordered;

use super::footprint::{Footprint, add_small};
use super::light_field::{LightField, PartField, Reading, stopped};
use super::pixel_sums::{PixelSums, lattice_error};
use super::points::Points;
use super::tile::{Tile, aim};
use crate::carrier::{Coordinates, carry};
use crate::view::View;

/// How many times as many points there are in pixels where they differ much.
const FINER: u32 = 16;

/// By how much the average over the points may be off before there are more: a share of the deviation, or of the value.
const LEFT: [f64; 2] = [0.25, 0.005];

/// Points of which each half is a lattice of its own.
const HALVES: usize = 64;

/// Lines in one unit of work outside of maps.
const CHUNK: usize = 256;

/// Mean luminance of each pixel and its standard deviation, row by row; the same bits for any number of threads.
///
/// The average runs over `samples` points, at most [`BLOCK`], of a rank-1 lattice in the pixel: of all point sets that
/// small its shadows on rows, columns and slanted edges are the most even. Points of a part err together as far as the
/// place that they spread over is small, and parts apart from one another. Where they differ so much that their average may
/// be off by more than [`LEFT`], as at edges, [`FINER`] times as many are taken, and what is left is in the deviation. Parts
/// that are no larger than pixels are summed up over their own footprint. Once `stop` is set, the rest is left out.
#[must_use]
pub fn look(field: &LightField, view: &View, samples: u32, threads: usize, stop: Option<&AtomicBool>) -> Vec<Reading> {
    let (mut small, mut large) = (vec![], vec![]);
    for part in &field.parts {
        match Footprint::of(&part.part, view).filter(Footprint::is_small) {
            Some(footprint) => small.push((part, footprint)),
            None => large.push(part),
        }
    }
    let mut map = look_at_large(&large, view, samples, threads, stop);
    for (part, footprint) in small {
        if !stopped(stop) {
            add_small(part, &footprint, view, &mut map);
        }
    }
    map
}

/// What is seen of parts that are large against the pixels.
fn look_at_large(
    parts: &[&PartField],
    view: &View,
    samples: u32,
    threads: usize,
    stop: Option<&AtomicBool>,
) -> Vec<Reading> {
    let mut map = vec![Reading::default(); view.pixels()];
    if parts.is_empty() {
        return map;
    }
    let points = lattice(samples);
    let tiles = Tile::all(view, (BLOCK / points.len()).max(1));
    let seen = each(&tiles, threads, stop, |scratch, tile| {
        see(parts, view, *tile, &points, scratch)
    });
    let mut off = vec![0.0; map.len()];
    for (tile, seen) in tiles.iter().zip(&seen) {
        for (row, seen) in (tile.row..).zip(seen.chunks_exact(tile.columns)) {
            let first = row * view.columns as usize + tile.column;
            for (pixel, (reading, left)) in (first..).zip(seen) {
                (map[pixel], off[pixel]) = (*reading, *left);
            }
        }
    }
    let wanted: Vec<usize> = (0..map.len())
        .filter(|pixel| wants_more(view, &map, &off, points.len(), *pixel))
        .collect();
    let points = lattice((samples * FINER).min(u32::try_from(BLOCK).unwrap_or(u32::MAX)));
    let finer = each(&wanted, threads, stop, |scratch, pixel| {
        see(parts, view, Tile::alone(view, *pixel), &points, scratch)
    });
    for (pixel, seen) in wanted.iter().zip(&finer) {
        for (reading, left) in seen {
            map[*pixel] = Reading {
                value: reading.value,
                deviation: reading.deviation.hypot(*left),
            };
        }
    }
    map
}

/// The results of work on each of some items, in their order; nothing for those that come after `stop` is set.
fn each<T: Sync, R: Send>(
    items: &[T],
    threads: usize,
    stop: Option<&AtomicBool>,
    work: impl Fn(&mut Scratch, &T) -> Vec<R> + Sync,
) -> Vec<Vec<R>> {
    let work = |scratch: &mut Scratch, item: &T| if stopped(stop) { vec![] } else { work(scratch, item) };
    let one_by_one = || {
        let mut scratch = Scratch::default();
        items.iter().map(|item| work(&mut scratch, item)).collect()
    };
    if threads == 1 || items.len() <= 4 {
        return one_by_one();
    }
    ordered::within(threads, |parallel| {
        if parallel {
            items
                .par_iter()
                .with_min_len(4)
                .map_init(Scratch::default, work)
                .collect()
        } else {
            one_by_one()
        }
    })
}

/// Whether the average over `points` points of a pixel may be off by too much: by how much they differ, or because an edge
/// beside the outermost of them would not show, of which the pixels next to it tell.
fn wants_more(view: &View, map: &[Reading], off: &[f64], points: usize, pixel: usize) -> bool {
    let [rows, columns] = [view.rows as usize, view.columns as usize];
    let (row, column) = (pixel / columns, pixel % columns);
    let beside = [
        (row > 0).then(|| pixel - columns),
        (row + 1 < rows).then(|| pixel + columns),
        (column > 0).then(|| pixel - 1),
        (column + 1 < columns).then(|| pixel + 1),
    ];
    let Reading { value, deviation } = map[pixel];
    let step = beside
        .into_iter()
        .flatten()
        .map(|other| (map[other].value - value).abs())
        .fold(0.0, f64::max);
    // The outermost points are half a step from the border; where an edge lies before them it is half of that on average.
    let left = off[pixel].max(0.25 * step / points as f64);
    points > 1 && left > (LEFT[0] * deviation).max(LEFT[1] * value)
}

/// Room for the points of some pixels.
#[derive(Default)]
struct Scratch {
    batch: RayBatch,
    at: Coordinates,
    points: Points,
    /// What each point sees on all parts together.
    total: Vec<f64>,
}

/// What is seen in each pixel of a tile, and how far the average over its points may be off: all points of the tile are
/// carried to each part as one block.
fn see(
    parts: &[&PartField],
    view: &View,
    tile: Tile,
    points: &[[f64; 2]],
    scratch: &mut Scratch,
) -> Vec<(Reading, f64)> {
    let mut pixels = vec![Reading::default(); tile.pixels()];
    aim(view, tile, points, &mut scratch.batch);
    scratch.total.clear();
    scratch.total.resize(scratch.batch.len, 0.0);
    for part in parts {
        carry(std::slice::from_ref(&part.part), &scratch.batch, &mut scratch.at);
        scratch.points.read(part, &scratch.at, scratch.batch.len);
        average(
            part,
            &scratch.at,
            &scratch.points,
            points.len(),
            &mut pixels,
            &mut scratch.total,
        );
    }
    let off = scratch.total.chunks_exact(points.len()).map(left);
    pixels.into_iter().zip(off).collect()
}

/// How far the average over the points of a pixel may be off: by their variance, and by how every other of them differs from
/// the rest.
fn left(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let (mut halves, mut squares) = ([0.0; 2], 0.0);
    for (i, value) in values.iter().enumerate() {
        halves[i % 2] += value;
        squares += value * value;
    }
    let mean = (halves[0] + halves[1]) / n;
    let by_variance = lattice_error(n, squares / n - mean * mean);
    // Of a few points either half alone says little.
    if values.len() < HALVES {
        by_variance
    } else {
        by_variance.max((halves[0] - halves[1]).abs() / n)
    }
}

/// Adds to each pixel, and to the total of each point, what its points, so many one after the other, see on a part: compiled
/// for each instruction set.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn average(
    part: &PartField,
    at: &Coordinates,
    read: &Points,
    points: usize,
    pixels: &mut [Reading],
    total: &mut [f64],
) {
    let share = 1.0 / points as f64;
    let [of_cells, by_place, by_direction] = &read.deviations;
    let wraps = part.part.wraps();
    for (pixel, start) in pixels.iter_mut().zip((0..).step_by(points)) {
        let mut sums = PixelSums::default();
        for i in start..start + points {
            if at.part[i] != Coordinates::NONE {
                let deviations = [of_cells[i], by_place[i], by_direction[i]];
                let coordinates = at.values.each_ref().map(|values| values[i]);
                sums.add(wraps, coordinates, read.value[i], deviations);
                total[i] += read.value[i];
            }
        }
        pixel.value += share * sums.value;
        pixel.deviation = pixel.deviation.hypot(share * sums.deviation(part));
    }
}

/// Luminance along lines given by points and directions; 0 once `stop` is set.
#[must_use]
pub fn along(
    field: &LightField,
    points: &[[f64; 3]],
    directions: &[[f64; 3]],
    threads: usize,
    stop: Option<&AtomicBool>,
) -> Vec<Reading> {
    let read = |(p, k): (&[f64; 3], &[f64; 3])| {
        if stopped(stop) {
            return Reading::default();
        }
        field.luminance(Vec3::from(*p), Vec3::from(*k).normalized())
    };
    if threads == 1 || points.len() <= CHUNK {
        return points.iter().zip(directions).map(read).collect();
    }
    ordered::within(threads, |parallel| {
        if parallel {
            points
                .par_iter()
                .zip(directions)
                .with_min_len(CHUNK)
                .map(read)
                .collect()
        } else {
            points.iter().zip(directions).map(read).collect()
        }
    })
}

/// A rank-1 lattice in the unit square: (i + ½)/n and the fractions of i·g/n, g the number prime to n next to n/φ.
fn lattice(n: u32) -> Vec<[f64; 2]> {
    let n = n.max(1);
    let ideal = f64::from(n) * 0.618_033_988_749_894_9;
    let prime_to_n = |g: &u32| gcd(*g, n) == 1;
    let generator = (1..=n)
        .filter(prime_to_n)
        .min_by(|a, b| (f64::from(*a) - ideal).abs().total_cmp(&(f64::from(*b) - ideal).abs()))
        .unwrap_or(1);
    (0..n)
        .map(|i| {
            let second = u64::from(i) * u64::from(generator) % u64::from(n);
            [
                (f64::from(i) + 0.5) / f64::from(n),
                (second as f64 + 0.5) / f64::from(n),
            ]
        })
        .collect()
}

const fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::carrier::{Focus, Rectangle, Shape};
    use crate::field::errors::Averaging;
    use crate::field::factor::Factor;
    use crate::field::light_field::tests::rough;
    use etendue_math::Frame;

    fn view() -> View {
        View {
            observer: Vec3::new(300.0, 200.0, 900.0),
            target: Vec3::new(0.3, -0.2, 0.7),
            right: Vec3::new(1.0, 0.0, 0.0),
            up: Vec3::new(0.0, 1.0, 0.0),
            normal: Vec3::new(0.0, 0.0, 1.0),
            width: 4.0,
            height: 3.0,
            columns: 40,
            rows: 30,
        }
    }

    #[test]
    fn lattices_hit_every_row_and_column_once() {
        for n in [1, 2, 3, 8, 16, 64] {
            for axis in 0..2 {
                let mut seen: Vec<f64> = lattice(n).iter().map(|p| p[axis]).collect();
                seen.sort_by(f64::total_cmp);
                for (i, x) in (0..).zip(seen) {
                    assert!((x - (f64::from(i) + 0.5) / f64::from(n)).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn maps_converge_to_the_average_of_many_points_and_have_the_same_bits_on_any_threads() {
        let field = LightField {
            parts: (0..4).map(rough).collect(),
        };
        let (coarse, fine) = (look(&field, &view(), 16, 2, None), look(&field, &view(), 2048, 2, None));
        assert_eq!(coarse, look(&field, &view(), 16, 1, None));
        assert_eq!(coarse, look(&field, &view(), 16, 7, None));
        let total: f64 = fine.iter().map(|r| r.value).sum();
        let difference: f64 = coarse.iter().zip(&fine).map(|(a, b)| (a.value - b.value).abs()).sum();
        assert!(total > 0.0 && difference < 0.05 * total, "{difference} {total}");
        // Each pixel's own average, point by point, through the public reading: of the points or of the finer ones.
        let v = view();
        let average = |pixel: usize, points: u32| {
            let read = |[du, dv]: [f64; 2]| {
                let u = (((pixel % 40) as f64 + du) / 40.0 - 0.5) * 4.0;
                let w = (0.5 - ((pixel / 40) as f64 + dv) / 30.0) * 3.0;
                let point = v.target + v.right * u + v.up * w;
                field.luminance(point, (v.observer - point).normalized()).value
            };
            lattice(points).into_iter().map(read).sum::<f64>() / f64::from(points)
        };
        let mut finer = 0;
        for (pixel, reading) in coarse.iter().enumerate() {
            let near = |value: f64| (reading.value - value).abs() <= 1e-12 * value;
            let more = !near(average(pixel, 16));
            assert!(!more || near(average(pixel, 256)));
            finer += usize::from(more);
        }
        assert!((50..1000).contains(&finer), "{finer}");
    }

    #[test]
    fn edges_between_the_points_of_pixels_are_seen() {
        // An even square that reaches a fiftieth of a pixel beyond the edges of others, seen from far above.
        let mut part = rough(0);
        part.part.shape = Shape::Rectangle(Rectangle {
            width: 2.04,
            height: 1.04,
            focus: Focus::default(),
        });
        part.part.frame = Frame {
            origin: Vec3::default(),
            x: Vec3::new(1.0, 0.0, 0.0),
            y: Vec3::new(0.0, 1.0, 0.0),
            z: Vec3::new(0.0, 0.0, 1.0),
        };
        part.ratio.fill([1.0, 0.0]);
        (part.space, part.direction) = (Factor::one(), Factor::one());
        let field = LightField { parts: vec![part] };
        for off in [0.0, 0.3, 0.77] {
            let view = View {
                observer: Vec3::new(0.0, 0.0, 1e7),
                target: Vec3::new(off, 0.5 * off, 0.0),
                width: 6.0,
                height: 6.0,
                columns: 6,
                rows: 6,
                ..view()
            };
            let map = look(&field, &view, 16, 1, None);
            let total: f64 = map.iter().map(|r| r.value).sum();
            assert!((total / (2.0 * 2.04 * 1.04) - 1.0).abs() < 5e-3, "{total}");
            for (i, reading) in map.iter().enumerate() {
                let overlap = |at: f64, low: f64, high: f64| (high.min(at + 1.0) - low.max(at)).max(0.0);
                let (row, column) = ((i / 6) as f64, (i % 6) as f64);
                let x = overlap(column - 3.0 + off, -1.02, 1.02);
                let y = overlap(2.0 - row + 0.5 * off, -0.52, 0.52);
                let error = (reading.value - 2.0 * x * y).abs();
                assert!(error < 3.0 * reading.deviation + 0.01, "{error} {reading:?}");
            }
        }
    }

    #[test]
    fn errors_of_large_pixels_average_out() {
        // One part, seen from above: pixels of a known number of cells.
        let mut field = LightField { parts: vec![rough(0)] };
        let whole = look(&field, &view(), 16, 1, None);
        let v = view();
        let (x, k) = (v.target, (v.observer - v.target).normalized());
        let place = |u: f64, w: f64| field.parts[0].part.cross(x + v.right * u + v.up * w, k).place;
        let [origin, right, up] = [place(0.0, 0.0), place(4.0 / 40.0, 0.0), place(0.0, 3.0 / 30.0)];
        let area = (right[0] - origin[0]).abs() * (up[1] - origin[1]).abs();
        let left = 0.25;
        let curve = (0..40)
            .map(|doublings| if doublings == 0 { 1.0 } else { left })
            .collect();
        field.parts[0].errors.cells = Averaging::new(curve).expect("sound");
        let few = look(&field, &view(), 16, 1, None);
        // Pixels smaller than a cell err as their points do.
        assert!(area * 8.0 < 1.0);
        assert!(whole.iter().zip(&few).all(|(a, b)| a == b));
        let coarse = View {
            columns: 2,
            rows: 2,
            ..view()
        };
        let mut plain = field.clone();
        plain.parts[0].errors.cells = Averaging::none();
        for (a, b) in look(&field, &coarse, 256, 1, None)
            .iter()
            .zip(look(&plain, &coarse, 256, 1, None))
        {
            assert!(a.value == b.value && (a.deviation < 0.99 * b.deviation || b.deviation == 0.0));
            assert!(a.deviation >= left * b.deviation * (1.0 - 1e-12));
        }
    }

    #[test]
    fn lines_are_read_in_order() {
        let field = LightField {
            parts: (0..4).map(rough).collect(),
        };
        let points: Vec<[f64; 3]> = (0..2000).map(|i| [f64::from(i) * 1e-3 - 1.0, 0.2, 3.0]).collect();
        let directions = vec![[0.1, 0.2, 1.0]; 2000];
        let readings = along(&field, &points, &directions, 2, None);
        assert_eq!(readings, along(&field, &points, &directions, 1, None));
        assert_eq!(
            readings[700],
            field.luminance(points[700].into(), Vec3::from(directions[700]).normalized())
        );
    }
}
