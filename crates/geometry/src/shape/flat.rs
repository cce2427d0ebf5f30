//! Pieces of a plane.

use etendue_math::Vec3;

use super::corners::Corners;
use super::rounding::{ROUNDING, size};

/// Which piece of the plane.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// All of it.
    Whole,
    /// Centred.
    Rectangle {
        /// Along x \[mm\].
        width: f64,
        /// Along y \[mm\].
        height: f64,
    },
    /// Between two circles; a disk has inner radius 0.
    Annulus {
        /// Inner radius \[mm\].
        inner: f64,
        /// Outer radius \[mm\].
        outer: f64,
    },
    /// Inside a polygon that does not cross itself.
    Polygon {
        /// Corners \[mm\], in order.
        vertices: Corners,
    },
}

/// A piece of the plane z = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Flat {
    /// Which piece.
    pub outline: Outline,
}

/// Where the line meets the plane: t, x, y, and how far off (x, y) may be. t is +∞ if it does not.
#[inline(always)]
fn on_plane(o: Vec3, d: Vec3, starts_on: bool) -> (f64, f64, f64, f64) {
    let t = -o.z / d.z;
    let t = if starts_on | (d.z == 0.0) { f64::INFINITY } else { t };
    (t, o.x + t * d.x, o.y + t * d.y, ROUNDING * (size(o) + t.abs()))
}

/// The piece between two circles \[mm\].
#[derive(Clone, Copy, Debug)]
pub struct Annulus {
    /// Inner radius.
    pub inner: f64,
    /// Outer radius.
    pub outer: f64,
}

impl Annulus {
    /// All of the plane.
    pub const ALL: Self = Self {
        inner: 0.0,
        outer: f64::INFINITY,
    };

    /// Distance to it, +∞ if it is missed. The bounds are NaN-safe: a comparison with NaN fails.
    #[inline(always)]
    #[must_use]
    pub fn crossing(&self, o: Vec3, d: Vec3, starts_on: bool) -> f64 {
        let (t, x, y, error) = on_plane(o, d, starts_on);
        let r2 = x * x + y * y;
        let (least, most) = (self.inner - error, self.outer + error);
        if (r2 <= most * most) & ((least <= 0.0) | (r2 >= least * least)) {
            t
        } else {
            f64::INFINITY
        }
    }
}

/// A centred rectangle.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    /// Half of its sides \[mm\].
    pub half: [f64; 2],
}

impl Rectangle {
    /// Distance to it, +∞ if it is missed.
    #[inline(always)]
    #[must_use]
    pub fn crossing(&self, o: Vec3, d: Vec3, starts_on: bool) -> f64 {
        let (t, x, y, error) = on_plane(o, d, starts_on);
        if (x.abs() <= self.half[0] + error) & (y.abs() <= self.half[1] + error) {
            t
        } else {
            f64::INFINITY
        }
    }
}

impl Flat {
    /// The distance at which the line crosses the piece; +∞ if it does not.
    #[inline(always)]
    #[must_use]
    pub fn crossing(&self, o: Vec3, d: Vec3, starts_on: bool) -> f64 {
        match &self.outline {
            Outline::Whole => on_plane(o, d, starts_on).0,
            Outline::Rectangle { width, height } => {
                let half = [0.5 * width, 0.5 * height];
                Rectangle { half }.crossing(o, d, starts_on)
            }
            Outline::Annulus { inner, outer } => {
                let (inner, outer) = (*inner, *outer);
                Annulus { inner, outer }.crossing(o, d, starts_on)
            }
            Outline::Polygon { vertices } => {
                let (t, x, y, error) = on_plane(o, d, starts_on);
                if t.is_finite() && vertices.hold(x, y, error) {
                    t
                } else {
                    f64::INFINITY
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_concave_polygon_keeps_what_lies_in_it() {
        // An L of area 3; the midpoint rule on a fine grid counts cells.
        let vertices = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let flat = Flat {
            outline: Outline::Polygon {
                vertices: vertices.into(),
            },
        };
        let n = 200;
        let mut cells = 0;
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32| 2.4 * (f64::from(k) + 0.5) / f64::from(n) - 0.2;
                let o = Vec3::new(at(i), at(j), 3.0);
                let t = flat.crossing(o, Vec3::new(0.0, 0.0, -1.0), false);
                let expected =
                    at(i) > 0.0 && at(j) > 0.0 && at(i) < 2.0 && at(j) < 2.0 && !(at(i) > 1.0 && at(j) > 1.0);
                assert_eq!(t == 3.0, expected, "{} {}", at(i), at(j));
                cells += i32::from(t == 3.0);
            }
        }
        assert!((f64::from(cells) * 2.4 * 2.4 / 4e4 - 3.0).abs() < 0.05);
    }

    #[test]
    fn a_line_that_starts_on_the_plane_or_runs_in_it_never_meets_it() {
        let flat = Flat {
            outline: Outline::Whole,
        };
        let d = Vec3::new(0.6, 0.0, 0.8);
        assert_eq!(flat.crossing(Vec3::new(1.0, 2.0, 1e-17), d, true), f64::INFINITY);
        assert_eq!(
            flat.crossing(Vec3::new(1.0, 2.0, 0.0), Vec3::new(1.0, 0.0, 0.0), false),
            f64::INFINITY
        );
    }

    #[test]
    fn neighbours_that_share_an_edge_leave_no_gap() {
        // Rays aimed at points computed on the common edge x = 1/3 meet at least one of two rectangles.
        let half = 0.5 / 3.0;
        let piece = Rectangle { half: [half, 1.0] };
        for i in 0..10_000 {
            let f = |g: f64| (0.5 + f64::from(i) * g).fract();
            let target = Vec3::new(1.0 / 3.0, 0.3 * f(0.754_877) - 0.15, 0.0);
            let o = Vec3::new(
                f(0.569_840) * 7.0 - 3.0,
                f(0.362_911) * 5.0 - 2.0,
                1e3 * f(0.618_034) + 0.1,
            );
            let d = (target - o).normalized();
            let shift = |c: f64| o - Vec3::new(c, 0.0, 0.0);
            let left = piece.crossing(shift(1.0 / 3.0 - half), d, false);
            let right = piece.crossing(shift(1.0 / 3.0 + half), d, false);
            assert!(left.is_finite() || right.is_finite());
        }
    }
}
