//! Polygons: whether a point lies in one, asked of the edges near it alone.

use std::ops::Deref;

/// From so many corners on, edges are sorted into strips.
const MANY: usize = 12;

/// The corners of a polygon that does not cross itself \[mm\], in order; at least three.
///
/// Edges are kept by strips across one axis, that along which each strip holds the fewer: a prismatic film's end is a polygon of
/// thousands of edges, and a point lies between two of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Corners {
    points: Vec<[f64; 2]>,
    strips: Option<Strips>,
}

/// Edges by strips across an axis.
#[derive(Clone, Debug, PartialEq)]
struct Strips {
    /// 0: x, 1: y.
    axis: usize,
    low: f64,
    high: f64,
    per_unit: f64,
    /// Where the edges of each strip begin, and last, where all end.
    first: Vec<u32>,
    /// Each by the number of the corner that it ends at.
    edges: Vec<u32>,
}

impl From<Vec<[f64; 2]>> for Corners {
    fn from(points: Vec<[f64; 2]>) -> Self {
        let strips = (points.len() >= MANY)
            .then(|| [0, 1].map(|axis| Strips::new(&points, axis)))
            .and_then(|both| both.into_iter().flatten().min_by_key(|strips| strips.edges.len()));
        Self { points, strips }
    }
}

impl Deref for Corners {
    type Target = [[f64; 2]];

    fn deref(&self) -> &Self::Target {
        &self.points
    }
}

impl Strips {
    #[allow(clippy::cast_possible_truncation, reason = "fewer than 2^32 corners")]
    fn new(points: &[[f64; 2]], axis: usize) -> Option<Self> {
        let along = || points.iter().map(|p| p[axis]);
        let (low, high) = (
            along().fold(f64::INFINITY, f64::min),
            along().fold(f64::NEG_INFINITY, f64::max),
        );
        let count = points.len().min(1 << 14);
        let per_unit = count as f64 / (high - low);
        if !(per_unit.is_finite() && per_unit > 0.0) {
            return None;
        }
        let mut strips = Self {
            axis,
            low,
            high,
            per_unit,
            first: Vec::new(),
            edges: Vec::new(),
        };
        let mut lists = vec![Vec::new(); count];
        for (to, ends) in (0_u32..).zip(
            points
                .iter()
                .enumerate()
                .map(|(k, p)| (before(points, k)[axis], p[axis])),
        ) {
            let range = strips.strip(ends.0.min(ends.1), count)..=strips.strip(ends.0.max(ends.1), count);
            for list in &mut lists[range] {
                list.push(to);
            }
        }
        for list in lists {
            strips.first.push(strips.edges.len() as u32);
            strips.edges.extend(list);
        }
        strips.first.push(strips.edges.len() as u32);
        Some(strips)
    }

    /// The strip of a coordinate, or that nearest to it.
    #[inline]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "kept within the strips"
    )]
    fn strip(&self, at: f64, count: usize) -> usize {
        (((at - self.low) * self.per_unit).max(0.0) as usize).min(count - 1)
    }

    #[inline]
    fn edges(&self, strip: usize) -> &[u32] {
        &self.edges[self.first[strip] as usize..self.first[strip + 1] as usize]
    }
}

#[inline]
fn before(points: &[[f64; 2]], k: usize) -> [f64; 2] {
    points[if k == 0 { points.len() - 1 } else { k - 1 }]
}

impl Corners {
    /// Whether (x, y) lies in the polygon, or so near an edge that it may.
    #[must_use]
    pub fn hold(&self, x: f64, y: f64, error: f64) -> bool {
        let point = [x, y];
        let Some(strips) = &self.strips else {
            let mut inside = false;
            let mut from = self.points[self.points.len() - 1];
            for &to in &self.points {
                if is_near(from, to, point, error) {
                    return true;
                }
                inside ^= is_passed(from, to, point, 1);
                from = to;
            }
            return inside;
        };
        let at = point[strips.axis];
        if !(at >= strips.low - error && at <= strips.high + error) {
            return false;
        }
        let count = strips.first.len() - 1;
        let own = strips.strip(at, count);
        // An edge that the point is near may end in the strip beside.
        let mut inside = false;
        for strip in strips.strip(at - error, count)..=strips.strip(at + error, count) {
            for to in strips.edges(strip) {
                let (from, to) = (before(&self.points, *to as usize), self.points[*to as usize]);
                if is_near(from, to, point, error) {
                    return true;
                }
                inside ^= strip == own && is_passed(from, to, point, strips.axis);
            }
        }
        inside
    }
}

/// Whether a point is no farther from an edge than it may be off.
#[inline]
fn is_near(from: [f64; 2], to: [f64; 2], [x, y]: [f64; 2], error: f64) -> bool {
    let (ex, ey) = (to[0] - from[0], to[1] - from[1]);
    let (px, py) = (x - from[0], y - from[1]);
    let along = ((px * ex + py * ey) / (ex * ex + ey * ey)).clamp(0.0, 1.0);
    let (qx, qy) = (px - along * ex, py - along * ey);
    qx * qx + qy * qy <= error * error
}

/// Whether a line from the point across the axis passes an edge. An edge counts for the half-open range that it spans, so that
/// a corner is passed once.
#[inline]
fn is_passed(from: [f64; 2], to: [f64; 2], point: [f64; 2], axis: usize) -> bool {
    let other = 1 - axis;
    let (along, across) = (point[axis] - from[axis], point[other] - from[other]);
    (from[axis] > point[axis]) != (to[axis] > point[axis])
        && across < along / (to[axis] - from[axis]) * (to[other] - from[other])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same without strips.
    fn by_all(corners: &Corners, x: f64, y: f64, error: f64) -> bool {
        let plain = Corners {
            points: corners.points.clone(),
            strips: None,
        };
        plain.hold(x, y, error)
    }

    #[test]
    fn strips_find_what_all_edges_find() {
        let teeth = |n: u32, turned: bool| {
            let mut points = vec![[0.0, 0.0], [f64::from(n), 0.0]];
            for k in (0..n).rev() {
                points.push([f64::from(k) + 1.0, 1.0]);
                points.push([f64::from(k) + 0.5, 1.5 + 0.01 * f64::from(k)]);
            }
            points.push([0.0, 1.0]);
            if turned {
                for p in &mut points {
                    p.swap(0, 1);
                }
            }
            Corners::from(points)
        };
        let star: Vec<[f64; 2]> = (0..90)
            .map(|k| {
                let (s, c) = (f64::from(k) * std::f64::consts::TAU / 90.0).sin_cos();
                let r = if k % 2 == 0 { 3.0 } else { 1.0 };
                [r * c, r * s]
            })
            .collect();
        for (corners, axis) in [(teeth(40, false), 0), (teeth(40, true), 1), (Corners::from(star), 2)] {
            let strips = corners.strips.as_ref().expect("many corners");
            assert!(axis == 2 || strips.axis == axis);
            assert!(axis == 2 || strips.edges.len() < 8 * corners.len());
            let mut held = 0;
            for i in 0..300 {
                for j in 0..60 {
                    let [x, y] = [i, j].map(|k| f64::from(k) * 0.149 - 3.6);
                    let [x, y] = if axis == 1 { [y, x] } else { [x, y] };
                    for error in [0.0, 1e-9, 0.03, 0.7] {
                        let found = corners.hold(x, y, error);
                        assert_eq!(found, by_all(&corners, x, y, error), "{x} {y} {error}");
                        held += u32::from(found);
                    }
                }
            }
            assert!(held > 500);
            assert!(!corners.hold(f64::NAN, 0.5, 1e-9));
            // On the corners themselves.
            for p in corners.iter() {
                assert!(corners.hold(p[0], p[1], 1e-12));
            }
        }
    }
}
