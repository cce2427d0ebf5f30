//! Half a sphere, by Lambert's azimuthal projection and the concentric map.

use std::f64::consts::PI;

use etendue_math::Vec3;
use etendue_sampling::warp::{disk_to_square, square_to_disk};

use super::chart::{Chart, Crossing, Left, clamped, crossing, left};

/// The half z ≥ 0 of a sphere about the origin, emitting outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hemisphere {
    /// Of the sphere \[mm\].
    pub radius: f64,
}

impl Chart for Hemisphere {
    fn area(&self) -> f64 {
        2.0 * PI * self.radius * self.radius
    }

    fn reach(&self) -> f64 {
        self.radius
    }

    fn extent(&self) -> (f64, f64, [f64; 2]) {
        (self.radius, self.radius, [0.0, self.radius])
    }

    #[inline(always)]
    fn cross(&self, o: Vec3, d: Vec3) -> Crossing {
        // From the point nearest the centre, so that a start point far away costs no digits.
        let near = o + d * -o.dot(d);
        let half_chord = self.radius * self.radius - near.dot(near);
        let n = (near + d * half_chord.max(0.0).sqrt()) * (1.0 / self.radius);
        let lift = 1.0 / (1.0 + n.z.max(0.0));
        let azimuthal = lift.sqrt();
        // Local axes: x and y turned by the shortest rotation that takes +z to the normal.
        let shear = (d.x * n.x + d.y * n.y) * lift + d.z;
        let inside = (half_chord > 0.0) & (n.z >= 0.0);
        let place = clamped(disk_to_square(n.x * azimuthal, n.y * azimuthal));
        crossing(inside, place, d.x - n.x * shear, d.y - n.y * shear)
    }

    fn ray(&self, [s1, s2]: [f64; 2], [p, q, up]: [f64; 3]) -> (Vec3, Vec3) {
        let (x, y) = square_to_disk(s1, s2);
        let r2 = x * x + y * y;
        let scale = (2.0 - r2).max(0.0).sqrt();
        let n = Vec3::new(x * scale, y * scale, (1.0 - r2).max(0.0));
        // The shortest rotation from +z to n, applied to (p, q, up).
        let lean = (n.x * p + n.y * q) / (1.0 + n.z);
        let k = Vec3::new(p - n.x * lean, q - n.y * lean, -(n.x * p + n.y * q)) + n * up;
        (n * self.radius, k)
    }

    #[inline(always)]
    fn leave(&self, o: Vec3, d: Vec3) -> Left {
        let middle = -o.dot(d);
        let near = o + d * middle;
        let half_chord = self.radius * self.radius - near.dot(near);
        let half = half_chord.max(0.0).sqrt();
        let met = (half_chord > 0.0) & (near.z + d.z * half >= 0.0);
        left(met, middle + half, half / self.radius)
    }
}
