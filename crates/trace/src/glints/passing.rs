//! Lines of sight, how they pass a point, and what a source about it comes to on the screen.

use etendue_geometry::origin_faces::OriginFaces;
use etendue_math::Vec3;
use etendue_optics::source::surface::across;

use super::image::Glint;
use super::targets::Spread;
use crate::solid_stack::SolidStack;

/// How far beside a line its neighbours start, in pixels: far above rounding, far below what surfaces do.
pub(super) const BESIDE: f64 = 1e-4;

/// Width of an image in units of the standard deviation of the places of its light.
const WIDTH: f64 = 1.5;

/// The least and the largest width, in pixels. Lines that are spread evenly find what is larger both ways.
const NARROWEST: f64 = 1e-9;
pub(super) const WIDEST: f64 = 0.5;

pub(super) type Pair = [f64; 2];
/// By rows.
pub(super) type Square = [Pair; 2];

/// A line of sight on its way.
#[derive(Clone, Copy)]
pub(super) struct Line {
    pub(super) o: Vec3,
    pub(super) d: Vec3,
    pub(super) stack: SolidStack,
    pub(super) origin_faces: OriginFaces,
}

/// How lines pass a point: offset of the line, and its change with the place in pixels, across it; distance along it.
pub(super) struct Passing {
    pub(super) off: Pair,
    change: Square,
    pub(super) along: f64,
    pub(super) axes: [Vec3; 2],
}

impl Passing {
    /// Places by offsets; None where offsets do not follow places.
    pub(super) fn inverse(&self) -> Option<Square> {
        let [[a, b], [c, d]] = self.change;
        let determinant = a * d - b * c;
        let inverse = [[d / determinant, -b / determinant], [-c / determinant, a / determinant]];
        inverse.iter().flatten().all(|x| x.is_finite()).then_some(inverse)
    }
}

pub(super) fn passing(lines: &[Line; 3], point: Vec3) -> Passing {
    let d = lines[0].d;
    let axes = across(d);
    let off = lines.each_ref().map(|line| {
        let to = point - line.o;
        let beside = line.d * to.dot(line.d) - to;
        axes.map(|axis| beside.dot(axis))
    });
    let change = |k: usize| [(off[1][k] - off[0][k]) / BESIDE, (off[2][k] - off[0][k]) / BESIDE];
    Passing {
        off: off[0],
        change: [change(0), change(1)],
        along: (point - lines[0].o).dot(d),
        axes,
    }
}

pub(super) fn times(m: &Square, v: Pair) -> Pair {
    [m[0][0] * v[0] + m[0][1] * v[1], m[1][0] * v[0] + m[1][1] * v[1]]
}

pub(super) fn determinant(m: &Square) -> f64 {
    m[0][0] * m[1][1] - m[0][1] * m[1][0]
}

/// The covariance in pixels that one in space comes to.
pub(super) fn spread_on_screen(inverse: &Square, axes: &[Vec3; 2], spread: &Spread) -> Square {
    let row = |v: Vec3| spread.map(|r| r[0] * v.x + r[1] * v.y + r[2] * v.z);
    let flat = axes.map(|a| {
        let s = row(a);
        axes.map(|b| s[0] * b.x + s[1] * b.y + s[2] * b.z)
    });
    let half = inverse.map(|r| {
        [
            r[0] * flat[0][0] + r[1] * flat[1][0],
            r[0] * flat[0][1] + r[1] * flat[1][1],
        ]
    });
    half.map(|r| inverse.map(|s| r[0] * s[0] + r[1] * s[1]))
}

/// The larger and the lesser width of an image of this covariance.
pub(super) fn widths(spread: &Square) -> (f64, f64) {
    let [[a, b], [_, d]] = *spread;
    let (mean, half) = (f64::midpoint(a, d), ((a - d) / 2.0).hypot(b));
    let lesser = if mean + half > 0.0 {
        determinant(spread).max(0.0) / (mean + half)
    } else {
        0.0
    };
    (WIDTH * (mean + half).max(0.0).sqrt(), WIDTH * lesser.sqrt())
}

/// An image at a place, of a covariance in pixels; None if it is large.
pub(super) fn image(place: Pair, spread: &Square) -> Option<Glint> {
    let (larger, lesser) = widths(spread);
    if lesser >= WIDEST {
        return None;
    }
    let [[a, b], [_, d]] = *spread;
    // Of the two forms of the axis, the one without cancellation.
    let half = ((a - d) / 2.0).hypot(b);
    let axis = if a >= d {
        [half + (a - d) / 2.0, b]
    } else {
        [b, half + (d - a) / 2.0]
    };
    let length = axis[0].hypot(axis[1]);
    let [x, y] = if length > 0.0 {
        axis.map(|v| v / length)
    } else {
        [1.0, 0.0]
    };
    let [s, t] = [larger, lesser].map(|width| width.clamp(NARROWEST, WIDEST));
    Glint::new(place, [[x * s, y * s], [-y * t, x * t]])
}
