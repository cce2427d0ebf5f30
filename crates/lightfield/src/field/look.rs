//! What an observer sees of a light field: luminance averaged over each pixel, by quadrature.

use std::sync::atomic::AtomicBool;

use multiversion::multiversion;
use rayon::prelude::*;

use etendue_geometry::RayBatch;
use etendue_geometry::ray_batch::BLOCK;
use etendue_math::Vec3;
use etendue_sampling::ordered;

use super::light_field::{LightField, PartField, Reading, stopped};
use super::points::Points;
use crate::surface::{Coordinates, carry};
use crate::view::View;

/// Lines in one unit of work outside of maps.
const CHUNK: usize = 256;

/// Mean luminance of each pixel and its standard deviation, row by row; the same bits for any number of threads.
///
/// The average runs over `samples` points, at most [`BLOCK`], of a rank-1 lattice in the pixel: of all point sets that
/// small its shadows on rows, columns and slanted edges are the most even. Points of a part err together as far as the
/// place that they spread over is small, and parts apart from one another. Once `stop` is set, the rest is left out.
#[must_use]
pub fn look(field: &LightField, view: &View, samples: u32, threads: usize, stop: Option<&AtomicBool>) -> Vec<Reading> {
    let points = lattice(samples);
    let tiles = Tile::all(view, (BLOCK / points.len()).max(1));
    let work = |scratch: &mut Scratch, tile: &Tile| {
        let mut pixels = vec![Reading::default(); tile.pixels()];
        if !stopped(stop) {
            see(field, view, *tile, &points, scratch, &mut pixels);
        }
        pixels
    };
    let one_by_one = || {
        let mut scratch = Scratch::default();
        tiles.iter().map(|tile| work(&mut scratch, tile)).collect()
    };
    let seen: Vec<Vec<Reading>> = if threads == 1 || tiles.len() <= 4 {
        one_by_one()
    } else {
        ordered::within(threads, |parallel| {
            if parallel {
                tiles.par_iter().map_init(Scratch::default, work).collect()
            } else {
                one_by_one()
            }
        })
    };
    let mut map = vec![Reading::default(); view.pixels()];
    for (tile, seen) in tiles.iter().zip(&seen) {
        for (row, seen) in (tile.row..).zip(seen.chunks_exact(tile.columns)) {
            map[row * view.columns as usize + tile.column..][..tile.columns].copy_from_slice(seen);
        }
    }
    map
}

/// Some pixels beside and above one another: they see parts of the tables that lie together, whichever way the rows of these
/// run over the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tile {
    row: usize,
    column: usize,
    rows: usize,
    columns: usize,
}

impl Tile {
    /// The tiles of a view, of so many pixels at most.
    fn all(view: &View, most: usize) -> Vec<Self> {
        let [rows, columns] = [view.rows as usize, view.columns as usize];
        let tall = rows.min(1 << (most.ilog2() / 2));
        let wide = columns.min(most / tall);
        let mut tiles = Vec::with_capacity(rows.div_ceil(tall) * columns.div_ceil(wide));
        for row in (0..rows).step_by(tall) {
            for column in (0..columns).step_by(wide) {
                tiles.push(Self {
                    row,
                    column,
                    rows: tall.min(rows - row),
                    columns: wide.min(columns - column),
                });
            }
        }
        tiles
    }

    const fn pixels(&self) -> usize {
        self.rows * self.columns
    }
}

/// Room for the points of some pixels.
#[derive(Default)]
struct Scratch {
    batch: RayBatch,
    at: Coordinates,
    points: Points,
}

/// Fills the pixels of a tile: all their points are carried to each part as one block.
fn see(
    field: &LightField,
    view: &View,
    tile: Tile,
    points: &[[f64; 2]],
    scratch: &mut Scratch,
    pixels: &mut [Reading],
) {
    aim(view, tile, points, &mut scratch.batch);
    for part in &field.parts {
        carry(std::slice::from_ref(&part.part), &scratch.batch, &mut scratch.at);
        scratch.points.read(part, &scratch.at, scratch.batch.len);
        average(part, &scratch.at, &scratch.points, points.len(), pixels);
    }
}

/// Adds to each pixel what its points, so many one after the other, see on a part: compiled for each instruction set.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn average(part: &PartField, at: &Coordinates, read: &Points, points: usize, pixels: &mut [Reading]) {
    let share = 1.0 / points as f64;
    let [of_cells, by_place, by_direction] = &read.deviations;
    let wraps = part.part.wraps();
    let [s1, s2, ..] = &at.values;
    for (pixel, start) in pixels.iter_mut().zip((0..).step_by(points)) {
        let mut sums = PixelSums::default();
        for i in start..start + points {
            if at.part[i] != Coordinates::NONE {
                let deviations = [of_cells[i], by_place[i], by_direction[i]];
                sums.add(wraps, [s1[i], s2[i]], read.value[i], deviations);
            }
        }
        pixel.value += share * sums.value;
        pixel.deviation = pixel.deviation.hypot(share * sums.deviation(part));
    }
}

/// What the points of a pixel amount to on one part.
#[derive(Default)]
struct PixelSums {
    points: f64,
    value: f64,
    deviations: [f64; 3],
    /// Where the first point is, and how far the others lie from it: sums and sums of squares.
    first: [f64; 2],
    away: [f64; 2],
    squares: [f64; 2],
}

impl PixelSums {
    #[inline(always)]
    fn add(&mut self, wraps: bool, place: [f64; 2], value: f64, deviations: [f64; 3]) {
        if self.points == 0.0 {
            self.first = place;
        }
        self.points += 1.0;
        self.value += value;
        for (axis, at) in place.iter().enumerate() {
            let mut away = at - self.first[axis];
            if wraps && axis == 0 {
                away -= away.round();
            }
            self.away[axis] += away;
            self.squares[axis] += away * away;
        }
        for (sum, d) in self.deviations.iter_mut().zip(deviations) {
            *sum += d;
        }
    }

    /// Standard deviation of the sum of values: what is left of each kind of error on the area of places that the points
    /// spread over. A pixel sees a part along nearly one direction, in which all its points err together.
    fn deviation(&self, part: &PartField) -> f64 {
        if self.points == 0.0 {
            return 0.0;
        }
        // Even points on a side of length l have the variance l²/12.
        let side = |axis: usize| {
            let mean = self.away[axis] / self.points;
            (12.0 * (self.squares[axis] / self.points - mean * mean).max(0.0)).sqrt()
        };
        let area = side(0) * side(1);
        let of_cells = part.errors.cells.left(area * (part.cells[0] * part.cells[1]) as f64);
        let fine = part.errors.space.side() as f64;
        let within = part.errors.within.left(area * fine * fine);
        let [cells, place, direction] = self.deviations;
        (cells * of_cells).hypot(place * within).hypot(direction)
    }
}

/// The lines from the points of the pixels of a tile to the observer: compiled for each instruction set.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn aim(view: &View, tile: Tile, points: &[[f64; 2]], batch: &mut RayBatch) {
    batch.len = tile.pixels() * points.len();
    let [x, y, z] = batch.position.each_mut().map(|v| v.chunks_exact_mut(points.len()));
    let [kx, ky, kz] = batch.direction.each_mut().map(|v| v.chunks_exact_mut(points.len()));
    for (pixel, (((x, y), z), ((kx, ky), kz))) in (0..tile.pixels()).zip(x.zip(y).zip(z).zip(kx.zip(ky).zip(kz))) {
        let row = (tile.row + pixel / tile.columns) as f64;
        let column = (tile.column + pixel % tile.columns) as f64;
        let places = x.iter_mut().zip(y).zip(z);
        let directions = kx.iter_mut().zip(ky).zip(kz);
        for ((((x, y), z), ((kx, ky), kz)), [du, dv]) in places.zip(directions).zip(points) {
            let u = ((column + du) / f64::from(view.columns) - 0.5) * view.width;
            let v = (0.5 - (row + dv) / f64::from(view.rows)) * view.height;
            let point = view.target + view.right * u + view.up * v;
            let k = (view.observer - point).normalized();
            (*x, *y, *z) = (point.x, point.y, point.z);
            (*kx, *ky, *kz) = (k.x, k.y, k.z);
        }
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
    use crate::field::errors::Averaging;
    use crate::field::light_field::tests::rough;

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
        // A pixel's own average, point by point, through the public reading.
        let v = view();
        let pixel = 15 * 40 + 17;
        let mut sum = 0.0;
        for [du, dv] in lattice(16) {
            let u = ((17.0 + du) / 40.0 - 0.5) * 4.0;
            let w = (0.5 - (15.0 + dv) / 30.0) * 3.0;
            let point = v.target + v.right * u + v.up * w;
            sum += field.luminance(point, (v.observer - point).normalized()).value / 16.0;
        }
        assert!((coarse[pixel].value / sum - 1.0).abs() < 1e-12 && sum > 0.0);
    }

    #[test]
    fn tiles_cover_each_pixel_once() {
        for (columns, rows, most) in [
            (40, 30, 128),
            (1, 1, 128),
            (1, 500, 128),
            (500, 1, 128),
            (7, 5, 1),
            (33, 9, 2048),
        ] {
            let view = View {
                columns,
                rows,
                ..view()
            };
            let mut seen = vec![0; view.pixels()];
            for tile in Tile::all(&view, most) {
                assert!(tile.pixels() <= most);
                for row in tile.row..tile.row + tile.rows {
                    for column in tile.column..tile.column + tile.columns {
                        seen[row * columns as usize + column] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|n| *n == 1));
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
