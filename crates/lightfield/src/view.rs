//! An observer and the pixel grid through which he looks.

use std::ops::Range;

use etendue_geometry::bounds::Bounds;
use etendue_math::Vec3;
use etendue_math::heads::heads_mut;
use multiversion::multiversion;

/// A pixel grid in space, seen from a point. Lengths in mm.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Where the observer stands.
    pub observer: Vec3,
    /// Centre of the grid.
    pub target: Vec3,
    /// Unit vector along the rows, to the right.
    pub right: Vec3,
    /// Unit vector along the columns, upwards.
    pub up: Vec3,
    /// Unit normal of the grid.
    pub normal: Vec3,
    /// Extent along `right`.
    pub width: f64,
    /// Extent along `up`.
    pub height: f64,
    /// Pixels along `right`.
    pub columns: u32,
    /// Pixels along `up`; row 0 is the top.
    pub rows: u32,
}

impl View {
    /// Number of pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    /// The pixel (row · columns + column) through which the line `x + t k` crosses the grid, if it does.
    ///
    /// The whole line counts, before and behind `x`: in free space luminance is constant along it.
    #[inline]
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "inside 0..columns and 0..rows by the test"
    )]
    pub fn pixel(&self, x: Vec3, k: Vec3) -> Option<u32> {
        let t = (self.target - x).dot(self.normal) / k.dot(self.normal);
        let hit = x + k * t - self.target;
        let column = (hit.dot(self.right) / self.width + 0.5) * f64::from(self.columns);
        let row = (0.5 - hit.dot(self.up) / self.height) * f64::from(self.rows);
        // A line parallel to the grid gives ±∞ or NaN, which fails the test too.
        let inside = column >= 0.0 && column < f64::from(self.columns) && row >= 0.0 && row < f64::from(self.rows);
        inside.then(|| row as u32 * self.columns + column as u32)
    }

    /// The unit vector from the observer through a place on the grid: in pixels, along the columns and the rows, from the top
    /// left corner.
    #[inline(always)]
    #[must_use]
    pub fn through(&self, place: [f64; 2]) -> Vec3 {
        (self.point(place) - self.observer).normalized()
    }

    /// The point of the grid at a place, as for [`View::through`].
    #[inline(always)]
    #[must_use]
    pub fn point(&self, place: [f64; 2]) -> Vec3 {
        let u = (place[0] / f64::from(self.columns) - 0.5) * self.width;
        let v = (0.5 - place[1] / f64::from(self.rows)) * self.height;
        self.target + self.right * u + self.up * v
    }

    /// The same through each of some places, given by their columns and by their rows.
    pub fn through_all(&self, places: &[Vec<f64>; 2], directions: &mut [Vec<f64>; 3]) {
        for list in directions.iter_mut() {
            list.resize(places[0].len(), 0.0);
        }
        through_all(self, places, directions);
    }

    /// Where on the grid, in pixels as for [`View::through`], the observer sees a point; None if it is not before him.
    #[must_use]
    pub fn place(&self, point: Vec3) -> Option<[f64; 2]> {
        let to = point - self.observer;
        let t = (self.target - self.observer).dot(self.normal) / to.dot(self.normal);
        let at = self.observer + to * t - self.target;
        let u = at.dot(self.right) / self.width + 0.5;
        let v = 0.5 - at.dot(self.up) / self.height;
        let place = [u * f64::from(self.columns), v * f64::from(self.rows)];
        (t > 0.0 && place.iter().all(|p| p.is_finite())).then_some(place)
    }

    /// The columns and the rows of all pixels through which lines from the observer may meet a box; all of them if it has no
    /// end, or is not as a whole before the observer.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the grid"
    )]
    pub fn window(&self, bounds: Bounds) -> [Range<u32>; 2] {
        let size = [self.columns, self.rows];
        if bounds.is_empty() {
            return [0..0, 0..0];
        }
        // Central projection keeps what is convex: the corners hold all that is between them.
        let mut place = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for corner in bounds.corners() {
            let Some(at) = self.place(corner) else {
                return size.map(|n| 0..n);
            };
            for (range, at) in place.iter_mut().zip(at) {
                *range = [range[0].min(at), range[1].max(at)];
            }
        }
        // A pixel more on each side, for rounding.
        std::array::from_fn(|k| {
            let [low, high] =
                [place[k][0].floor() - 1.0, place[k][1].floor() + 2.0].map(|v| v.clamp(0.0, f64::from(size[k])));
            low as u32..high as u32
        })
    }

    /// The unit vector from the centre of a pixel to the observer.
    #[inline]
    #[must_use]
    pub fn to_eye(&self, pixel: u32) -> Vec3 {
        let (row, column) = (pixel / self.columns, pixel % self.columns);
        let u = ((f64::from(column) + 0.5) / f64::from(self.columns) - 0.5) * self.width;
        let v = (0.5 - (f64::from(row) + 0.5) / f64::from(self.rows)) * self.height;
        (self.observer - self.target - self.right * u - self.up * v).normalized()
    }

    /// Unit vector from the target to the observer, and the largest angle \[rad\] between it and the line from any point
    /// of the grid to the observer.
    ///
    /// Points of a plane that are seen within an angle of a given line form a convex set, so a corner is the extreme.
    #[must_use]
    pub fn field(&self) -> (Vec3, f64) {
        let axis = (self.observer - self.target).normalized();
        let half = |sx: f64, sy: f64| {
            let corner = self.right * (sx * self.width / 2.0) + self.up * (sy * self.height / 2.0);
            (self.observer - self.target - corner)
                .normalized()
                .dot(axis)
                .clamp(-1.0, 1.0)
                .acos()
        };
        let angle = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(a, b)| half(a, b));
        (axis, angle.into_iter().fold(0.0, f64::max))
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn through_all(view: &View, [across, down]: &[Vec<f64>; 2], directions: &mut [Vec<f64>; 3]) {
    let n = across.len();
    let (down, [x, y, z]) = (&down[..n], heads_mut(directions, n));
    for i in 0..n {
        let d = view.through([across[i], down[i]]);
        (x[i], y[i], z[i]) = (d.x, d.y, d.z);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        View {
            observer: Vec3::new(30.0, -20.0, 100.0),
            target: Vec3::new(1.0, 2.0, 3.0),
            right: Vec3::new(1.0, 0.0, 0.0),
            up: Vec3::new(0.0, 1.0, 0.0),
            normal: Vec3::new(0.0, 0.0, 1.0),
            width: 7.0,
            height: 3.0,
            columns: 7,
            rows: 6,
        }
    }

    #[test]
    fn a_line_meets_the_pixel_it_was_aimed_at_from_before_and_behind() {
        let v = view();
        for pixel in 0..42 {
            let k = v.to_eye(pixel);
            let centre = v.observer - k * ((v.observer - v.target).dot(v.normal) / k.dot(v.normal));
            for t in [-50.0, 0.0, 20.0, 300.0] {
                assert_eq!(v.pixel(centre + k * t, k), Some(pixel));
            }
        }
        // Row 0 is the top, column 0 the left; edges belong to the pixel on the right and below.
        let up = Vec3::new(0.0, 0.0, 1.0);
        assert_eq!(v.pixel(Vec3::new(-2.4, 3.4, 0.0), up), Some(0));
        assert_eq!(v.pixel(Vec3::new(4.5, 2.0, 0.0), up), None);
        assert_eq!(v.pixel(Vec3::new(-2.5, 3.5, 0.0), up), Some(0));
    }

    #[test]
    fn a_parallel_line_meets_no_pixel() {
        assert_eq!(view().pixel(Vec3::new(0.0, 0.0, 3.0), Vec3::new(1.0, 0.0, 0.0)), None);
        assert_eq!(view().pixel(Vec3::new(0.0, 0.0, 9.0), Vec3::new(1.0, 0.0, 0.0)), None);
    }

    #[test]
    fn lines_that_meet_a_box_lie_in_its_window() {
        let v = View {
            columns: 70,
            rows: 60,
            ..view()
        };
        let around = Bounds::of([Vec3::new(-1.0, 2.3, -4.0), Vec3::new(0.3, 3.1, 2.0)]);
        let [columns, rows] = v.window(around);
        assert!(columns.len() < 40 && rows.len() < 50);
        for k in 0..20_u32.pow(3) {
            let at = |k: u32, lo: f64, hi: f64| lo + (hi - lo) * f64::from(k % 20) / 19.0;
            let point = Vec3::new(at(k, -1.0, 0.3), at(k / 20, 2.3, 3.1), at(k / 400, -4.0, 2.0));
            let pixel = v.pixel(point, (v.observer - point).normalized()).expect("on the grid");
            assert!(
                columns.contains(&(pixel % 70)) && rows.contains(&(pixel / 70)),
                "{point:?}"
            );
            let place = v.place(point).expect("before the observer");
            assert!((v.through(place) - (point - v.observer).normalized()).length() < 1e-12);
        }
    }

    #[test]
    fn the_window_is_whole_where_projection_does_not_tell() {
        let v = view();
        let all = [0..7, 0..6];
        assert_eq!(v.window(Bounds::of([v.observer, v.target])), all);
        assert_eq!(v.window(Bounds::EMPTY.grow(Vec3::new(f64::INFINITY, 0.0, 0.0))), all);
        assert_eq!(v.window(Bounds::EMPTY), [0..0, 0..0]);
        assert_eq!(v.place(v.observer + v.observer - v.target), None);
        let beside = Bounds::of([Vec3::new(90.0, 0.0, 0.0), Vec3::new(91.0, 1.0, 0.0)]);
        assert!(v.window(beside)[0].is_empty());
    }

    #[test]
    fn no_pixel_is_seen_outside_the_field() {
        let (axis, angle) = view().field();
        let widest = (0..42).map(|p| view().to_eye(p).dot(axis).acos()).fold(0.0, f64::max);
        assert!(widest <= angle && widest > 0.8 * angle);
    }
}
