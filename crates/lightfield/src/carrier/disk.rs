//! A disk, by the concentric map.

use std::f64::consts::PI;

use etendue_math::Vec3;
use etendue_sampling::warp::{disk_to_square, square_to_disk};

use super::chart::{Chart, Crossing, Left, clamped, crossing, left};

/// In the plane z = 0, centred, emitting towards +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// \[mm\].
    pub radius: f64,
}

impl Chart for Disk {
    fn area(&self) -> f64 {
        PI * self.radius * self.radius
    }

    fn reach(&self) -> f64 {
        self.radius
    }

    fn extent(&self) -> (f64, f64, [f64; 2]) {
        (self.radius, self.radius, [0.0; 2])
    }

    #[inline(always)]
    fn cross(&self, o: Vec3, d: Vec3) -> Crossing {
        let t = -o.z / d.z;
        let (x, y) = ((o.x + t * d.x) / self.radius, (o.y + t * d.y) / self.radius);
        let inside = (d.z > 0.0) & (x * x + y * y <= 1.0);
        crossing(inside, clamped(disk_to_square(x, y)), d.x, d.y)
    }

    fn ray(&self, [s1, s2]: [f64; 2], [p, q, up]: [f64; 3]) -> (Vec3, Vec3) {
        let (x, y) = square_to_disk(s1, s2);
        (Vec3::new(x * self.radius, y * self.radius, 0.0), Vec3::new(p, q, up))
    }

    #[inline(always)]
    fn leave(&self, o: Vec3, d: Vec3) -> Left {
        let t = -o.z / d.z;
        let (x, y) = ((o.x + t * d.x) / self.radius, (o.y + t * d.y) / self.radius);
        left((d.z > 0.0) & (x * x + y * y <= 1.0), t, d.z)
    }
}
