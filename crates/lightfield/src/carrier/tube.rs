//! The side of a cylinder, unrolled.

use std::f64::consts::PI;

use etendue_math::Vec3;
use etendue_math::trig::{atan_eighths, sin_cos_turns};

use super::chart::{Chart, Crossing, Left, crossing, left};

/// About the z axis, centred, emitting outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tube {
    /// Of the cylinder \[mm\].
    pub radius: f64,
    /// Along z \[mm\].
    pub height: f64,
}

impl Chart for Tube {
    fn area(&self) -> f64 {
        2.0 * PI * self.radius * self.height
    }

    fn reach(&self) -> f64 {
        self.radius.hypot(0.5 * self.height)
    }

    fn extent(&self) -> (f64, f64, [f64; 2]) {
        (self.radius, self.radius, [-0.5 * self.height, 0.5 * self.height])
    }

    #[inline(always)]
    fn cross(&self, o: Vec3, d: Vec3) -> Crossing {
        let across = d.x * d.x + d.y * d.y;
        let t = -(o.x * d.x + o.y * d.y) / across;
        let (x, y) = (o.x + t * d.x, o.y + t * d.y);
        let half_chord = (self.radius * self.radius - (x * x + y * y)) / across;
        let t_out = t + half_chord.max(0.0).sqrt();
        let (x, y) = ((o.x + t_out * d.x) / self.radius, (o.y + t_out * d.y) / self.radius);
        let z = o.z + t_out * d.z;
        let inside = (across > 0.0) & (half_chord > 0.0);
        crossing(inside, (turns(x, y), z / self.height + 0.5), d.y * x - d.x * y, d.z)
    }

    fn ray(&self, [s1, s2]: [f64; 2], [p, q, up]: [f64; 3]) -> (Vec3, Vec3) {
        let (sine, cosine) = sin_cos_turns(s1);
        // The seam lies at −x: azimuth is s₁ turns from there.
        let (nx, ny) = (-cosine, -sine);
        let k = Vec3::new(nx * up - ny * p, ny * up + nx * p, q);
        (
            Vec3::new(nx * self.radius, ny * self.radius, (s2 - 0.5) * self.height),
            k,
        )
    }

    #[inline(always)]
    fn leave(&self, o: Vec3, d: Vec3) -> Left {
        let across = d.x * d.x + d.y * d.y;
        let middle = -(o.x * d.x + o.y * d.y) / across;
        let (x, y) = (o.x + middle * d.x, o.y + middle * d.y);
        let half_chord = (self.radius * self.radius - (x * x + y * y)) / across;
        let half = half_chord.max(0.0).sqrt();
        let t = middle + half;
        let z = (o.z + t * d.z) / self.height + 0.5;
        let met = (across > 0.0) & (half_chord > 0.0) & (0.0..=1.0).contains(&z);
        left(met, t, half * across / self.radius)
    }
}

/// Azimuth of (x, y) as a fraction of a turn from −x over −y, +x and +y: the seam lies at −x.
#[inline(always)]
fn turns(x: f64, y: f64) -> f64 {
    let wide = x.abs() > y.abs();
    let (along, across) = if wide { (x, y) } else { (y, x) };
    let slope = if along == 0.0 { 0.0 } else { across / along };
    let eighth = 0.125 * atan_eighths(slope);
    let from_x = if wide {
        let back = if y < 0.0 { -0.5 } else { 0.5 };
        eighth + if x < 0.0 { back } else { 0.0 }
    } else {
        let quarter = if y < 0.0 { -0.25 } else { 0.25 };
        quarter - eighth
    };
    (from_x + 0.5).clamp(0.0, 1.0)
}
