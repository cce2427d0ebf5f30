//! An illuminance meter.

use etendue_geometry::Face;
use etendue_geometry::shape::{Flat, Outline, Shape};
use etendue_math::{Frame, Vec3};

use super::kind::{Kind, Light, Recorded};
use super::record::{Described, Record};

/// A rectangle in the plane z = 0 of its frame: flux that arrives on its front, by cells; behind them a cell for all of it,
/// as a ray may come to several cells, and what it brings to them is not independent.
#[derive(Clone, Debug)]
pub struct Illuminance {
    /// Its centre and axes.
    pub frame: Frame,
    /// Along x \[mm\].
    pub width: f64,
    /// Along y \[mm\].
    pub height: f64,
    /// Cells along x.
    pub columns: u32,
    /// Cells along y; row 0 is the top, at the largest y.
    pub rows: u32,
}

impl Described for Illuminance {
    fn read<R: Record>(record: &R) -> Result<Self, R::Error> {
        let cells = |key| {
            let number = record.whole(key)?;
            u32::try_from(number).map_err(|_| R::refuse("more cells than can be counted"))
        };
        Ok(Self {
            frame: record.frame()?,
            width: record.number("width")?,
            height: record.number("height")?,
            columns: cells("columns")?,
            rows: cells("rows")?,
        })
    }
}

impl Kind for Illuminance {
    fn face(&self) -> Option<Face> {
        let (width, height) = (self.width, self.height);
        Some(Face {
            shape: Shape::Flat(Flat {
                outline: Outline::Rectangle { width, height },
            }),
            frame: self.frame,
            trims: vec![],
            flipped: false,
        })
    }

    fn cells(&self) -> usize {
        self.columns as usize * self.rows as usize + 1
    }

    fn sums_up(&self) -> bool {
        true
    }

    fn passing(&self, light: &Light<'_>, point: Vec3, out: &mut Recorded) {
        let (size, cells) = ([self.width, self.height], [self.columns, self.rows]);
        if let Some(cell) = illuminance_cell(&self.frame, size, cells, point, light.direction) {
            out.contribute(cell, light.state, light.state.flux);
        }
    }
}

/// The cell of an illuminance detector that a point of it lies in, for light along `d`; None if it arrives from behind.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "stack the number of cells"
)]
fn illuminance_cell(frame: &Frame, size: [f64; 2], cells: [u32; 2], point: Vec3, d: Vec3) -> Option<u32> {
    if d.dot(frame.z) >= 0.0 {
        return None;
    }
    let p = frame.point_to_local(point);
    let along = |x: f64, size: f64, n: u32| (((x / size + 0.5) * f64::from(n)) as u32).min(n - 1);
    let column = along(p.x, size[0], cells[0]);
    let row = along(-p.y, size[1], cells[1]);
    Some(row * cells[0] + column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_counted_from_the_top_left() {
        let frame = Frame {
            origin: Vec3::new(1.0, 2.0, 3.0),
            x: Vec3::new(1.0, 0.0, 0.0),
            y: Vec3::new(0.0, 1.0, 0.0),
            z: Vec3::new(0.0, 0.0, 1.0),
        };
        let cell = |x, y, dz| {
            illuminance_cell(
                &frame,
                [4.0, 2.0],
                [4, 2],
                Vec3::new(x, y, 3.0),
                Vec3::new(0.0, 0.0, dz),
            )
        };
        assert_eq!(cell(-0.9, 2.9, -1.0), Some(0));
        assert_eq!(cell(2.9, 2.9, -1.0), Some(3));
        assert_eq!(cell(-0.9, 1.1, -1.0), Some(4));
        assert_eq!(cell(0.5, 2.5, 1.0), None);
    }
}
