//! The small images of sources in the pixels of a view.

use std::ops::Range;

use etendue_lightfield::View;
use rayon::prelude::*;

use super::image::{Found, Glint, STRAIGHT, led_on};
use super::search::{FromPixel, Search, Sight, tile_side};
use super::targets::targets;
use crate::lit_scene::LitScene;

/// Starts of the search over all pixels: more per pixel where these are few.
const STARTS: usize = 1 << 14;

/// Starts in one pixel, at most.
const MOST_STARTS: usize = 16;

/// One pixel of so many is looked at first: where light wanders among thousands of surfaces, a search finds nothing and has
/// no end.
const FIRST_LOOK: usize = 32;

/// From so many pixels beside those that see anything, an image in these may be found.
const BESIDE: u32 = 5;

/// Images in one pixel, at most.
const MOST: usize = 32;

/// How near to each other two images of one source through the same surfaces are one, in units of their width.
const SAME: f64 = 0.25;

/// How far beyond its width an image is looked for in other pixels.
const REACH: f64 = 3.0;

/// The small images of sources in the pixels of a view.
#[derive(Clone, Debug, Default)]
pub struct Glints {
    images: Vec<Glint>,
    /// Where those of each pixel begin.
    begins: Vec<usize>,
    /// In pixels that have some, the sources that are seen large, each through which surfaces; and where those of each pixel begin.
    large: Vec<(usize, u32)>,
    large_begins: Vec<usize>,
    /// For each source whether it has any.
    of: Vec<bool>,
}

impl Glints {
    /// Looks for the images of the sources of a scene. Runs on the threads of the current pool; the same for any number.
    /// Once `lit` is stopped, the rest is left out.
    #[must_use]
    pub fn find(lit: &LitScene<'_>, view: &View, most_events: u32) -> Self {
        let sources = lit.scene.sources.len();
        let mut result = Self {
            images: Vec::new(),
            begins: vec![0; view.pixels() + 1],
            large: Vec::new(),
            large_begins: vec![0; view.pixels() + 1],
            of: vec![false; sources],
        };
        let targets = targets(lit, view);
        let Some(mut search) = Search::new(lit, view, most_events, &targets) else {
            return result;
        };
        let pixels = view.pixels();
        let [columns, rows] = lit.window(view);
        let starts = (STARTS / pixels.max(1)).clamp(1, MOST_STARTS);
        let side = tile_side(starts);
        // Whole tiles, that lie where they do in any window.
        let beside = |range: Range<u32>, n: u32| {
            let from = range.start.saturating_sub(BESIDE) / side * side;
            from..((range.end + BESIDE).div_ceil(side) * side).min(n)
        };
        let (columns, rows) = (beside(columns, view.columns), beside(rows, view.rows));
        let pixels_of = |rows: Range<u32>, columns: Range<u32>| -> Vec<usize> {
            let of_row = |row: u32| {
                columns
                    .clone()
                    .map(move |column| (row * view.columns + column) as usize)
            };
            rows.flat_map(of_row).collect()
        };
        let window = pixels_of(rows.clone(), columns.clone());
        let [first, caught] = window
            .par_iter()
            .filter(|pixel| *pixel % FIRST_LOOK == 0)
            .map_init(
                || search.clone(),
                |search, pixel| {
                    if lit.is_stopped() {
                        return [0, 0];
                    }
                    search.first_look(*pixel, starts)
                },
            )
            .reduce(|| [0, 0], |a, b| [a[0] + b[0], a[1] + b[1]]);
        if first == 0 && 2 * caught > starts * pixels.div_ceil(FIRST_LOOK) {
            search.spend_little();
        }
        let cut = |range: &Range<u32>| {
            let range = range.clone();
            range
                .clone()
                .step_by(side as usize)
                .map(move |from| from..(from + side).min(range.end))
        };
        let tiles: Vec<Vec<usize>> = cut(&rows)
            .flat_map(|rows| cut(&columns).map(move |columns| (rows.clone(), columns)))
            .map(|(rows, columns)| pixels_of(rows, columns))
            .collect();
        let mut found: Vec<(usize, FromPixel)> = tiles
            .par_iter()
            .map_init(
                || search.clone(),
                |search, tile| {
                    let found = if lit.is_stopped() {
                        vec![Default::default(); tile.len()]
                    } else {
                        search.search_from(tile, starts)
                    };
                    tile.iter().copied().zip(found).collect::<Vec<_>>()
                },
            )
            .flatten()
            .collect();
        found.sort_unstable_by_key(|(pixel, _)| *pixel);
        let found: Vec<FromPixel> = found.into_iter().map(|(_, found)| found).collect();
        if found.iter().all(|(images, _)| images.is_empty()) {
            return result;
        }
        result.take(view, &window, &found);
        result
    }

    /// Takes in what was found from the pixels of a window.
    fn take(&mut self, view: &View, window: &[usize], found: &[FromPixel]) {
        let seen_in = |pixel: usize| window.binary_search(&pixel).map_or(&[][..], |at| &found[at].1[..]);
        let mut images: Vec<Vec<Found>> = vec![Vec::new(); view.pixels()];
        for image in found.iter().flat_map(|(images, _)| images) {
            for pixel in touched(view, &image.glint) {
                // In the midst of a large image lines that are spread evenly have no noise, and need no others.
                let large = |sight: &Sight| sight.0 == image.source && sight.1 == image.ways;
                let seen = seen_in(pixel);
                let here = &mut images[pixel];
                let known = |other: &Found| {
                    other.source == image.source
                        && other.ways == image.ways
                        && other.glint.distance2(image.glint.centre) < SAME * SAME
                };
                if here.len() < MOST && !here.iter().any(known) && !seen.iter().any(large) {
                    here.push(image.clone());
                }
            }
        }
        for (pixel, here) in images.iter().enumerate() {
            for image in here {
                self.of[image.source] = true;
                self.images.push(image.glint);
            }
            self.begins[pixel + 1] = self.images.len();
            if !here.is_empty() {
                let key = |ways: &[bool]| ways.iter().fold(STRAIGHT, |ways, way| led_on(ways, *way));
                let known = seen_in(pixel).iter().map(|(source, ways)| (*source, key(ways)));
                self.large.extend(known.filter(|(_, ways)| *ways > 0));
            }
            self.large_begins[pixel + 1] = self.large.len();
        }
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

    /// Whether a source is seen large through some surfaces in a pixel that has images: lines that are spread evenly have no noise
    /// there, and what they find is not shared with those that look for the images.
    #[inline]
    #[must_use]
    pub fn is_large(&self, pixel: usize, source: usize, ways: u32) -> bool {
        self.large[self.large_begins[pixel]..self.large_begins[pixel + 1]].contains(&(source, ways))
    }

    /// The images in a pixel.
    #[must_use]
    pub fn of_pixel(&self, pixel: usize) -> &[Glint] {
        &self.images[self.begins[pixel]..self.begins[pixel + 1]]
    }
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
