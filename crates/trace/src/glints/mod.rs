//! Where in its pixels a source is seen that is small there, directly or in smooth surfaces.
//!
//! Lines of sight that are spread over a pixel find the image of a lamp that covers a thousandth of it in few maps, and the
//! others do not know what they have missed. So its images are looked for beforehand (`search`), and as many lines of sight
//! again go where they are: those of both kinds share the light by the balance heuristic `[Veach1995]`. Whatever was not
//! found, or not rightly, is left to the lines that are spread evenly: no light is lost or counted twice.

mod search;

use std::f64::consts::PI;

use etendue_lightfield::View;
use etendue_math::trig::sin_cos_turns;
use rayon::prelude::*;

use crate::reverse::Lit;
use search::{Search, Sight};

/// Starts of the search over all pixels: more per pixel where these are few.
const STARTS: usize = 1 << 15;

/// Starts in one pixel, at most.
const MOST_STARTS: usize = 16;

/// Images in one pixel, at most.
const MOST: usize = 32;

/// How near to each other two images of one source through the same surfaces are one, in units of their width.
const SAME: f64 = 0.25;

/// How far beyond its width an image is looked for in other pixels.
const REACH: f64 = 3.0;

/// A small image of a source: the place about which lines of sight are drawn, and how narrowly. In pixels, along the columns
/// and the rows, from the top left corner of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glint {
    centre: [f64; 2],
    /// From the plane of a density (1 + r²)⁻²/π to places, by columns.
    axes: [[f64; 2]; 2],
    /// |determinant| of `axes`.
    area: f64,
}

impl Glint {
    /// About a centre, with two axes at right angles; None if it has no area.
    fn new(centre: [f64; 2], axes: [[f64; 2]; 2]) -> Option<Self> {
        let area = (axes[0][0] * axes[1][1] - axes[0][1] * axes[1][0]).abs();
        (area > 0.0 && area.is_finite() && centre.iter().all(|c| c.is_finite())).then_some(Self { centre, axes, area })
    }

    /// The square of the distance of a place from the centre, in units of the width.
    fn distance2(&self, place: [f64; 2]) -> f64 {
        let [x, y] = [place[0] - self.centre[0], place[1] - self.centre[1]];
        let [a, b] = self.axes;
        let (p, q) = (x * b[1] - y * b[0], y * a[0] - x * a[1]);
        (p * p + q * q) / (self.area * self.area)
    }

    /// Density of a place, by area in pixels. It has far tails, so that light beside the image is not missed.
    fn density(&self, place: [f64; 2]) -> f64 {
        let x = 1.0 + self.distance2(place);
        1.0 / (PI * self.area * x * x)
    }

    /// A place from two numbers.
    fn draw(&self, [height, turn]: [f64; 2]) -> [f64; 2] {
        let r = (height / (1.0 - height)).sqrt();
        let (sine, cosine) = sin_cos_turns(turn);
        std::array::from_fn(|k| self.centre[k] + r * (self.axes[0][k] * cosine + self.axes[1][k] * sine))
    }
}

/// An image, of which source, and through which surfaces it is seen.
#[derive(Clone, Debug)]
struct Found {
    glint: Glint,
    source: usize,
    /// At each smooth surface whether light is transmitted.
    ways: Vec<bool>,
}

/// The small images of sources in the pixels of a view.
#[derive(Clone, Debug, Default)]
pub struct Glints {
    images: Vec<Glint>,
    /// Where those of each pixel begin.
    begins: Vec<usize>,
    /// For each source whether it has any.
    of: Vec<bool>,
}

impl Glints {
    /// Looks for the images of the sources of a scene. Runs on the threads of the current pool; the same for any number.
    /// Once `lit` is stopped, the rest is left out.
    #[must_use]
    pub fn find(lit: &Lit<'_>, view: &View, most_events: u32) -> Self {
        let sources = lit.scene.sources.len();
        let mut result = Self {
            images: Vec::new(),
            begins: vec![0; view.pixels() + 1],
            of: vec![false; sources],
        };
        let Some(search) = Search::new(lit, view, most_events) else {
            return result;
        };
        let pixels = view.pixels();
        let starts = (STARTS / pixels.max(1)).clamp(1, MOST_STARTS);
        let found: Vec<(Vec<Found>, Vec<Sight>)> = (0..pixels)
            .into_par_iter()
            .map_init(
                || search.clone(),
                |search, pixel| {
                    if lit.is_stopped() {
                        return Default::default();
                    }
                    search.search_from(pixel, starts)
                },
            )
            .collect();
        let mut images: Vec<Vec<Found>> = vec![Vec::new(); pixels];
        for image in found.iter().flat_map(|(images, _)| images) {
            for pixel in touched(view, &image.glint) {
                // In the midst of a large image lines that are spread evenly have no noise, and need no others.
                let large = |sight: &Sight| sight.0 == image.source && sight.1 == image.ways;
                let here = &mut images[pixel];
                let known = |other: &Found| {
                    other.source == image.source
                        && other.ways == image.ways
                        && other.glint.distance2(image.glint.centre) < SAME * SAME
                };
                if here.len() < MOST && !here.iter().any(known) && !found[pixel].1.iter().any(large) {
                    here.push(image.clone());
                }
            }
        }
        for (pixel, here) in images.iter().enumerate() {
            for image in here {
                result.of[image.source] = true;
                result.images.push(image.glint);
            }
            result.begins[pixel + 1] = result.images.len();
        }
        result
    }

    /// Number of pixels that have images.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.begins.windows(2).filter(|pair| pair[0] < pair[1]).count()
    }

    /// Whether a source has small images.
    #[must_use]
    pub fn has(&self, source: usize) -> bool {
        self.of[source]
    }

    /// The images in a pixel.
    #[must_use]
    pub fn of_pixel(&self, pixel: usize) -> &[Glint] {
        &self.images[self.begins[pixel]..self.begins[pixel + 1]]
    }
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

/// The pixels that an image reaches into.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the grid"
)]
fn touched<'a>(view: &'a View, image: &Glint) -> impl Iterator<Item = usize> + use<'a> {
    let [columns, rows] = [view.columns, view.rows].map(|n| n as usize);
    let range = |k: usize, n: usize| {
        let half = REACH * image.axes[0][k].hypot(image.axes[1][k]);
        let low = (image.centre[k] - half).floor().clamp(0.0, n as f64) as usize;
        let high = (image.centre[k] + half).ceil().clamp(0.0, n as f64) as usize;
        low..high
    };
    let across = range(0, columns);
    range(1, rows).flat_map(move |row| across.clone().map(move |column| row * columns + column))
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
