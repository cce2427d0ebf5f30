//! Cells of direction: both hemispheres cut into cells of equal solid angle.

use etendue_math::{Frame, Vec3};
use etendue_sampling::warp::{disk_to_square, square_to_disk};

/// A grid of side² cells on the upper hemisphere and as many on the lower.
///
/// A hemisphere goes to the unit disk by the equal-area azimuthal map, (x, y) = (kx, ky)/√(1 + |kz|), and the disk to the
/// unit square by the concentric map. Cells are numbered along a Morton curve, so that neighbours in number are
/// neighbours in direction; the lower hemisphere follows the upper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cells {
    side: u32,
}

impl Cells {
    /// Fewest and most cells along a side: with 8, no direction is 31° from the axis of its cell; with 256, the places at
    /// which a file of all cells grows at once fit the memory.
    pub const SIDES: std::ops::RangeInclusive<u32> = 8..=256;

    /// The grid, if `side` is a power of two in [`Cells::SIDES`].
    #[must_use]
    pub fn new(side: u32) -> Option<Self> {
        (side.is_power_of_two() && Self::SIDES.contains(&side)).then_some(Self { side })
    }

    /// Number of cells.
    #[must_use]
    pub fn count(self) -> usize {
        2 * self.side as usize * self.side as usize
    }

    /// The cell of a unit direction.
    #[inline]
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the cast saturates, and what rounding puts beyond an edge belongs to the cell at it"
    )]
    pub fn cell(self, k: Vec3) -> u32 {
        let scale = 1.0 / (1.0 + k.z.abs()).sqrt();
        let (u, v) = disk_to_square(k.x * scale, k.y * scale);
        let place = |t: f64| ((t * f64::from(self.side)) as u32).min(self.side - 1);
        let lower = if k.z < 0.0 { self.side * self.side } else { 0 };
        lower + (spread(place(u)) | spread(place(v)) << 1)
    }

    /// The frame of a cell at `origin`: z along the cell's middle, x across it and X (across Y where the middle is within
    /// 37° of X), y across both.
    #[must_use]
    pub fn frame(self, cell: u32, origin: Vec3) -> Frame {
        let half = self.side * self.side;
        let morton = cell % half;
        let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(self.side);
        let (x, y) = square_to_disk(middle(gather(morton)), middle(gather(morton >> 1)));
        let r2 = x * x + y * y;
        let scale = (2.0 - r2).sqrt();
        let height = if cell < half { 1.0 - r2 } else { r2 - 1.0 };
        let axis = Vec3::new(x * scale, y * scale, height).normalized();
        let beside = if axis.x.abs() < 0.8 {
            Vec3::new(1.0, 0.0, 0.0)
        } else {
            Vec3::new(0.0, 1.0, 0.0)
        };
        let across = beside.cross(axis).normalized();
        Frame {
            origin,
            x: across,
            y: axis.cross(across),
            z: axis,
        }
    }

    /// An angle \[rad\] that no direction of a cell exceeds to the cell's middle.
    ///
    /// From the square \[−1, 1\]² to the disk the concentric map stretches by at most √(1 + 2(π/4)²) < 1.5, its derivative's
    /// Frobenius norm; from there to the sphere by at most 2 (at the rim, radially). Half a cell's diagonal is √2/side.
    #[must_use]
    pub fn radius(self) -> f64 {
        3.0 * std::f64::consts::SQRT_2 / f64::from(self.side)
    }
}

/// Bit i of the low half to bit 2i.
#[inline]
pub(super) fn spread(i: u32) -> u32 {
    let i = (i | i << 8) & 0x00ff_00ff;
    let i = (i | i << 4) & 0x0f0f_0f0f;
    let i = (i | i << 2) & 0x3333_3333;
    (i | i << 1) & 0x5555_5555
}

/// Inverse of [`spread`] on the even bits.
fn gather(i: u32) -> u32 {
    let i = i & 0x5555_5555;
    let i = (i | i >> 1) & 0x3333_3333;
    let i = (i | i >> 2) & 0x0f0f_0f0f;
    let i = (i | i >> 4) & 0x00ff_00ff;
    (i | i >> 8) & 0xffff
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions spread evenly over the sphere: equal steps of z, turned by the golden angle.
    fn directions(n: u32) -> impl Iterator<Item = Vec3> {
        (0..n).map(move |i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
            let (s, c) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * c, r * s, z)
        })
    }

    #[test]
    fn the_middle_of_a_cell_lies_in_it_and_its_frame_is_orthonormal() {
        for side in [8, 32, 256] {
            let cells = Cells::new(side).expect("a power of two");
            for cell in 0..2 * side * side {
                let f = cells.frame(cell, Vec3::new(0.0, 0.0, 0.0));
                assert_eq!(cells.cell(f.z), cell);
                for (a, b, expected) in [
                    (f.x, f.x, 1.0),
                    (f.y, f.y, 1.0),
                    (f.z, f.z, 1.0),
                    (f.x, f.y, 0.0),
                    (f.y, f.z, 0.0),
                    (f.z, f.x, 0.0),
                ] {
                    assert!((a.dot(b) - expected).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn cells_have_equal_solid_angle_and_no_direction_is_beyond_the_radius() {
        let cells = Cells::new(16).expect("a power of two");
        let mut counts = vec![0_i32; cells.count()];
        for k in directions(512_000) {
            let cell = cells.cell(k);
            counts[cell as usize] += 1;
            let frame = cells.frame(cell, Vec3::new(0.0, 0.0, 0.0));
            assert!(frame.z.dot(k).min(1.0).acos() < cells.radius());
        }
        // 1000 points each; a spiral leaves a discrepancy of about its step times the cell's outline, some 60 points.
        assert!(counts.iter().all(|n| (n - 1000).abs() < 100), "{counts:?}");
    }

    #[test]
    fn poles_the_equator_and_the_axes_have_a_cell() {
        let cells = Cells::new(8).expect("a power of two");
        for k in [
            (0.0, 0.0, 1.0),
            (0.0, 0.0, -1.0),
            (1.0, 0.0, 0.0),
            (-1.0, 0.0, -0.0),
            (0.0, -1.0, 0.0),
            (0.6, 0.8, 0.0),
        ] {
            assert!((cells.cell(Vec3::new(k.0, k.1, k.2)) as usize) < cells.count());
        }
        assert!([0, 7, 4, 48, 512].iter().all(|&side| Cells::new(side).is_none()));
    }
}
