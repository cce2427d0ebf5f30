//! Tiles of a picture, and the lines of sight of their pixels.

use etendue_geometry::RayBatch;
use multiversion::multiversion;

use crate::view::View;

/// Some pixels beside and above one another: they see parts of the tables that lie together, whichever way the rows of these
/// run over the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tile {
    pub row: usize,
    pub column: usize,
    pub rows: usize,
    pub columns: usize,
}

impl Tile {
    /// The tiles of a view, of so many pixels at most.
    pub fn all(view: &View, most: usize) -> Vec<Self> {
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

    /// One pixel.
    pub const fn alone(view: &View, pixel: usize) -> Self {
        let columns = view.columns as usize;
        Self {
            row: pixel / columns,
            column: pixel % columns,
            rows: 1,
            columns: 1,
        }
    }

    pub const fn pixels(&self) -> usize {
        self.rows * self.columns
    }
}

/// The lines from the points of the pixels of a tile to the observer: compiled for each instruction set.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(super) fn aim(view: &View, tile: Tile, points: &[[f64; 2]], batch: &mut RayBatch) {
    batch.len = tile.pixels() * points.len();
    let [x, y, z] = batch.position.each_mut().map(|v| v.chunks_exact_mut(points.len()));
    let [kx, ky, kz] = batch.direction.each_mut().map(|v| v.chunks_exact_mut(points.len()));
    for (pixel, (((x, y), z), ((kx, ky), kz))) in (0..tile.pixels()).zip(x.zip(y).zip(z).zip(kx.zip(ky).zip(kz))) {
        let row = (tile.row + pixel / tile.columns) as f64;
        let column = (tile.column + pixel % tile.columns) as f64;
        let places = x.iter_mut().zip(y).zip(z);
        let directions = kx.iter_mut().zip(ky).zip(kz);
        for ((((x, y), z), ((kx, ky), kz)), [du, dv]) in places.zip(directions).zip(points) {
            let point = view.point([column + du, row + dv]);
            let k = (view.observer - point).normalized();
            (*x, *y, *z) = (point.x, point.y, point.z);
            (*kx, *ky, *kz) = (k.x, k.y, k.z);
        }
    }
}

#[cfg(test)]
mod tests {
    use etendue_math::Vec3;

    use super::*;

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
                observer: Vec3::new(0.0, 0.0, 900.0),
                target: Vec3::default(),
                right: Vec3::new(1.0, 0.0, 0.0),
                up: Vec3::new(0.0, 1.0, 0.0),
                normal: Vec3::new(0.0, 0.0, 1.0),
                width: 4.0,
                height: 3.0,
                columns,
                rows,
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
}
