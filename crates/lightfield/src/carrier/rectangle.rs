//! A rectangle, whose places may lie at a depth of their own for each inclination.

use etendue_math::Vec3;

use super::chart::{Chart, Crossing, Left, crossing, left};
use super::focus::Focus;

/// About the plane z = 0, centred, emitting towards +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Along x \[mm\].
    pub width: f64,
    /// Along y \[mm\].
    pub height: f64,
    /// Height above the plane at which the place of a line is taken, by its direction.
    pub focus: Focus,
}

impl Chart for Rectangle {
    fn area(&self) -> f64 {
        self.width * self.height
    }

    fn reach(&self) -> f64 {
        (0.5 * self.width.hypot(self.height)).hypot(self.focus.reach())
    }

    fn extent(&self) -> (f64, f64, [f64; 2]) {
        (0.5 * self.width, 0.5 * self.height, self.focus.range())
    }

    #[inline(always)]
    fn focus(&self) -> Focus {
        self.focus
    }

    #[inline(always)]
    fn cross(&self, o: Vec3, d: Vec3) -> Crossing {
        let t = (self.focus.at(d.z) - o.z) / d.z;
        let place = ((o.x + t * d.x) / self.width + 0.5, (o.y + t * d.y) / self.height + 0.5);
        crossing(d.z > 0.0, place, d.x, d.y)
    }

    fn ray(&self, [s1, s2]: [f64; 2], [p, q, up]: [f64; 3]) -> (Vec3, Vec3) {
        let k = Vec3::new(p, q, up);
        let sharp = Vec3::new((s1 - 0.5) * self.width, (s2 - 0.5) * self.height, self.focus.at(up));
        // Along the horizon nothing meets the plane.
        let back = if up > 0.0 { sharp.z / up } else { 0.0 };
        (sharp - k * back, k)
    }

    #[inline(always)]
    fn leave(&self, o: Vec3, d: Vec3) -> Left {
        let t = -o.z / d.z;
        let there = t + self.focus.at(d.z) / d.z;
        let (x, y) = (
            (o.x + there * d.x) / self.width + 0.5,
            (o.y + there * d.y) / self.height + 0.5,
        );
        let inside = (0.0..=1.0).contains(&x) & (0.0..=1.0).contains(&y);
        left((d.z > 0.0) & inside, t, self.focus.seen(d.z, o.z))
    }
}
