//! The place of a small image, and places drawn about it.

use std::f64::consts::PI;

use etendue_math::trig::sin_cos_turns;

/// A small image of a source: the place about which lines of sight are drawn, and how narrowly. In pixels, along the columns
/// and the rows, from the top left corner of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glint {
    pub(super) centre: [f64; 2],
    /// From the plane of a density (1 + r²)⁻²/π to places, by columns.
    pub(super) axes: [[f64; 2]; 2],
    /// |determinant| of `axes`.
    area: f64,
}

impl Glint {
    /// About a centre, with two axes at right angles; None if it has no area.
    pub(super) fn new(centre: [f64; 2], axes: [[f64; 2]; 2]) -> Option<Self> {
        let area = (axes[0][0] * axes[1][1] - axes[0][1] * axes[1][0]).abs();
        (area > 0.0 && area.is_finite() && centre.iter().all(|c| c.is_finite())).then_some(Self { centre, axes, area })
    }

    /// The square of the distance of a place from the centre, in units of the width.
    pub(super) fn distance2(&self, place: [f64; 2]) -> f64 {
        let [x, y] = [place[0] - self.centre[0], place[1] - self.centre[1]];
        let [a, b] = self.axes;
        let (p, q) = (x * b[1] - y * b[0], y * a[0] - x * a[1]);
        (p * p + q * q) / (self.area * self.area)
    }

    /// Density of a place, by area in pixels. It has far tails, so that light beside the image is not missed.
    pub(super) fn density(&self, place: [f64; 2]) -> f64 {
        let x = 1.0 + self.distance2(place);
        1.0 / (PI * self.area * x * x)
    }

    /// A place from two numbers.
    pub(super) fn draw(&self, [height, turn]: [f64; 2]) -> [f64; 2] {
        let r = (height / (1.0 - height)).sqrt();
        let (sine, cosine) = sin_cos_turns(turn);
        std::array::from_fn(|k| self.centre[k] + r * (self.axes[0][k] * cosine + self.axes[1][k] * sine))
    }
}

/// Ways through smooth surfaces as one number: 1 before the first of them; each adds a binary digit, 1 if light is transmitted.
/// 0 where there are more than 31.
pub const STRAIGHT: u32 = 1;

/// The ways that lead on from such a number.
#[inline]
#[must_use]
pub const fn led_on(ways: u32, transmitted: bool) -> u32 {
    if ways == 0 || ways >> 31 == 1 {
        0
    } else {
        ways << 1 | transmitted as u32
    }
}

/// An image, of which source, and through which surfaces it is seen.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) glint: Glint,
    pub(super) source: usize,
    /// At each smooth surface whether light is transmitted.
    pub(super) ways: Vec<bool>,
}

/// Density by area in pixels of a place that is drawn about one of some images.
#[must_use]
pub fn density(images: &[Glint], place: [f64; 2]) -> f64 {
    images.iter().map(|image| image.density(place)).sum::<f64>() / images.len() as f64
}

/// A place about one of some images, from three numbers.
#[must_use]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "below the number of images"
)]
pub fn draw(images: &[Glint], [which, height, turn]: [f64; 3]) -> [f64; 2] {
    let which = ((which * images.len() as f64) as usize).min(images.len() - 1);
    images[which].draw([height, turn])
}

#[cfg(test)]
mod tests {
    use super::*;
    use etendue_sampling::philox::Stream;

    #[test]
    fn places_are_drawn_with_their_density() {
        let images = [
            Glint::new([2.0, 3.0], [[0.3, 0.1], [-0.02, 0.06]]).expect("an area"),
            Glint::new([2.3, 2.9], [[0.0, 0.2], [0.2, 0.0]]).expect("an area"),
        ];
        // The mean of f/p over places is the integral of f, for a square that holds a part of both.
        let (n, stream, mut sums) = (1_000_000_u32, Stream::new(5, 6), [0.0; 2]);
        for i in 0..n {
            let [a, b, c, _] = stream.uniforms(u64::from(i), 0);
            let [x, y] = draw(&images, [a, b, c]);
            if (1.9..2.5).contains(&x) && (2.8..3.2).contains(&y) {
                let f = 1.0 / density(&images, [x, y]);
                sums = [sums[0] + f, sums[1] + f * f];
            }
        }
        let n = f64::from(n);
        let (mean, expected) = (sums[0] / n, 0.6 * 0.4);
        let error = ((sums[1] / n - mean * mean) / n).sqrt();
        assert!(error < 0.01 * expected, "{error}");
        assert!((mean - expected).abs() < 3.9 * error, "{mean} ± {error}");
    }

    #[test]
    fn nothing_is_no_image() {
        assert!(Glint::new([0.0, 0.0], [[1.0, 2.0], [2.0, 4.0]]).is_none());
        assert!(Glint::new([f64::NAN, 0.0], [[1.0, 0.0], [0.0, 1.0]]).is_none());
    }
}
