//! From the observer to the sources.
//!
//! A path starts at the observer, through a point of the pixel. While it meets smooth surfaces only, all its branches are followed,
//! weak ones on some of many paths: that part of the image has hardly any noise but that of the places within the pixel and of
//! sources that err. At a diffuse surface one direction is drawn, and points of the sources are connected to; a direction that
//! both could find is shared out between them by the power heuristic `[Veach1995]`.
//!
//! Radiance grows by (n₁/n₂)² on its way from a medium of index n₂ into one of n₁.

use std::ops::Range;

use etendue_geometry::surface_points::Vectors;
use etendue_lightfield::View;
use etendue_sampling::lattice::{ShiftedPoint, first_two};
use etendue_sampling::ordered::Idle;
use etendue_sampling::philox::Stream;
use rayon::prelude::*;

use super::method::{Method, Pixel};
use super::path_block::{BLOCK, Branch, Path, PathBlock, PixelPass, Seen};
use super::smooth::Splitter;
use crate::exitance::{ExitanceCache, ExitanceSurvey};
use crate::glints;
use crate::lit_scene::LitScene;

/// The purposes under which shifts of lattices, the lines with weak ways and events of paths are drawn (see [`Stream::new`]).
const PURPOSE_SHIFT: u64 = 0x5348_4946;
const PURPOSE_PATH: u64 = 0x5041_5448;
const PURPOSE_TURN: u64 = 0x5455_524E;

/// What is added to a purpose for the paths that look for small images of sources.
const AIMED: u64 = 1 << 32;

/// Paths that look for the small images of sources in a pixel, per pass at least: of four passes with fewer all may miss them,
/// and would not know it.
const LEAST_AIMED: u32 = 4;

/// What passes of a map hold: the columns and rows in which lines of sight may meet anything, and the means of their pixels, row
/// by row.
#[derive(Clone, Debug)]
pub struct Image {
    /// Columns.
    pub columns: Range<u32>,
    /// Rows.
    pub rows: Range<u32>,
    /// Pixels in both, each pass after pass.
    pub pixels: Vec<Pixel>,
}

/// Passes of the map of `view`, which are independent of each other. With a survey, paths end at diffuse surfaces whose light
/// is known.
///
/// Runs on the threads of the current pool; the same bits for any number.
#[must_use]
pub fn render(
    lit: &LitScene<'_>,
    view: &View,
    method: &Method<'_>,
    survey: Option<&ExitanceSurvey>,
    passes: Range<u32>,
) -> Image {
    let lines = view.pixels() as u64 * u64::from(method.paths);
    let known: Vec<ExitanceCache<'_>> = survey
        .iter()
        .filter(|survey| survey.patches() > 0)
        .flat_map(|survey| passes.clone().map(|pass| survey.exitance(lit, pass, lines)))
        .collect();
    let [columns, rows] = lit.window(view);
    let which: Vec<usize> = rows
        .clone()
        .flat_map(|row| {
            columns
                .clone()
                .map(move |column| (row * view.columns + column) as usize)
        })
        .collect();
    let mut pixels = vec![Pixel::default(); which.len() * passes.len()];
    let each = (passes.len() * method.paths as usize).max(1);
    let chunk = (4 * BLOCK / each).clamp(1, 1 << 12);
    let chunks = pixels
        .par_chunks_mut(chunk * passes.len().max(1))
        .zip(which.par_chunks(chunk));
    let idle = Idle::default();
    chunks.for_each(|(pixels, which)| {
        let make = || Renderer::new(lit, view, method, &known);
        idle.with(make, |renderer| renderer.paint(which, passes.clone(), pixels));
    });
    Image { columns, rows, pixels }
}

/// A block of paths, and room for what its steps need.
struct Renderer<'a> {
    block: PathBlock<'a>,
    splitter: Splitter,
    starts: Starts,
}

/// Where lines of sight begin.
#[derive(Default)]
struct Starts {
    /// Places on the grid, by columns and by rows, and the directions through them.
    places: [Vec<f64>; 2],
    directions: Vectors,
    /// Numbers of their paths.
    paths: Vec<u32>,
}

/// Paths of a pixel in each pass: those spread evenly over it, or those that look for small images of sources.
fn paths_of(method: &Method<'_>, aimed: bool) -> u32 {
    if aimed {
        method.paths.max(LEAST_AIMED)
    } else {
        method.paths
    }
}

impl<'a> Renderer<'a> {
    fn new(lit: &'a LitScene<'a>, view: &'a View, method: &'a Method<'a>, known: &'a [ExitanceCache<'a>]) -> Self {
        Self {
            block: PathBlock::new(lit, view, method, known),
            splitter: Splitter::new(lit.scene),
            starts: Starts::default(),
        }
    }

    /// The passes of pixels of some numbers, pixel by pixel.
    fn paint(&mut self, which: &[usize], passes: Range<u32>, pixels: &mut [Pixel]) {
        let mut cells = vec![[0.0; 8]; which.len() * passes.len()];
        let all: Vec<usize> = (0..cells.len()).collect();
        self.look(&all, which, &passes, false, &mut cells);
        // Once more those with small images of sources.
        if let Some(glints) = self.block.method.glints {
            let has = |cell: &usize| !glints.of_pixel(which[cell / passes.len()]).is_empty();
            let those: Vec<usize> = all.into_iter().filter(has).collect();
            self.look(&those, which, &passes, true, &mut cells);
        }
        for (pixel, [mean, deviation, scattered, chance, smooth, diffuse, given_up, lost]) in
            pixels.iter_mut().zip(cells)
        {
            *pixel = Pixel {
                mean,
                scattered,
                chance,
                deviation,
                met: [smooth, diffuse],
                given_up,
                lost,
            };
        }
    }

    /// Adds the paths of some cells, each a pass of a pixel.
    fn look(&mut self, tasks: &[usize], which: &[usize], passes: &Range<u32>, aimed: bool, cells: &mut [[f64; 8]]) {
        let paths = paths_of(self.block.method, aimed) as usize;
        let share = 1.0 / f64::from(self.block.method.paths);
        let total = tasks.len() * paths;
        let mut begin = 0;
        while begin < total && !self.block.lit.is_stopped() {
            let end = (begin + BLOCK).min(total);
            self.block.passes.clear();
            self.block.paths.clear();
            let these = begin / paths..end.div_ceil(paths);
            for (task, cell) in these.clone().zip(&tasks[these.clone()]) {
                let first = task * paths;
                let pixel = which[cell / passes.len()];
                #[allow(clippy::cast_possible_truncation, reason = "numbers of passes and of paths")]
                let (made, indices) = (
                    (cell % passes.len()) as u32,
                    (begin.max(first) - first) as u32..(end.min(first + paths) - first) as u32,
                );
                self.aim(pixel, [passes.start + made, made], indices, aimed);
            }
            self.start();
            self.follow();
            let mut found = &self.block.paths[..];
            for (task, cell) in these.clone().zip(&tasks[these]) {
                let sums = &mut cells[*cell];
                let of_cell = end.min((task + 1) * paths) - begin.max(task * paths);
                for path in found.split_off(..of_cell).unwrap_or_default() {
                    let [smooth, diffuse] = path.met.map(|met| if met { 1.0 } else { 0.0 });
                    let [mean, deviation] = path.sum;
                    let [given_up, lost] = [path.given_up, path.lost].map(f64::from);
                    let [scattered, chance] = [path.scattered, path.chance];
                    let values = [mean, deviation, scattered, chance, smooth, diffuse, given_up, lost];
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += value * share;
                    }
                }
            }
            begin = end;
        }
    }

    /// Paths through points of a pixel, or, if they are `aimed`, of small images of sources in it.
    #[allow(clippy::cast_possible_truncation, reason = "a block is short")]
    fn aim(&mut self, pixel: usize, [pass, made]: [u32; 2], indices: Range<u32>, aimed: bool) {
        let Self { block, starts, .. } = self;
        let [shifts, turns, stream] = [PURPOSE_SHIFT, PURPOSE_TURN, PURPOSE_PATH]
            .map(|purpose| Stream::new(block.method.seed, purpose + if aimed { AIMED } else { 0 }));
        let point = ShiftedPoint::new(0, shifts, [pixel as u64, u64::from(pass) << 8]);
        let shift = point.shift(0);
        let columns = block.view.columns as usize;
        let corner = [(pixel % columns) as f64, (pixel / columns) as f64];
        let glints = block.method.glints.map_or(&[][..], |all| all.of_pixel(pixel));
        let pass = PixelPass {
            pixel,
            pass: made as usize,
            aimed,
            point,
            shift,
            turn: turns.words(pixel as u64 | u64::from(pass) << 40)[0] as u32,
            stream,
            address: (pixel as u64) << 44 | u64::from(pass) << 20,
        };
        let path = Path {
            pass: block.passes.len() as u32,
            index: 0,
            line: 0,
            drawn: 2,
            begun: false,
            met: [false; 2],
            sum: [0.0; 2],
            scattered: 0.0,
            chance: 0.0,
            given_up: 0.0,
            lost: 0.0,
            share: 1.0,
        };
        block.passes.push(pass);
        if !aimed && glints.is_empty() && block.lit.wavelengths.count() == 1 {
            let begin = starts.paths.len();
            starts.paths.extend((block.paths.len() as u32..).take(indices.len()));
            block.paths.extend(indices.clone().map(|index| Path { index, ..path }));
            let places = starts.places.each_mut().map(|list| {
                list.resize(begin + indices.len(), 0.0);
                &mut list[begin..]
            });
            first_two(indices.start, &shift, corner, places);
            return;
        }
        let [evenly, about] = [false, true].map(|aimed| f64::from(paths_of(block.method, aimed)));
        let more = about / evenly;
        let wavelengths = &block.lit.wavelengths;
        for index in indices {
            let [du, dv, third, last] = point.at(index).moved(0, &shift);
            let place = if aimed {
                glints::draw(glints, [third, du, dv])
            } else {
                [corner[0] + du, corner[1] + dv]
            };
            let share = if glints.is_empty() {
                1.0
            } else {
                1.0 / (1.0 + more * glints::density(glints, place))
            };
            let mut number = if aimed { last } else { third };
            if wavelengths.count() > 1 {
                // Moved at random within the distance of the lines of a pass, as picks of sources are: else as many of them as in
                // almost all passes would have the few wavelengths that get through.
                let aside = block.passes[path.pass as usize].numbers(index).aside();
                number = (number + aside / if aimed { about } else { evenly }).fract();
            }
            let line = wavelengths.draw(number) as u32;
            // What is drawn about an image may lie in another pixel.
            if !aimed || (0..2).all(|k| (corner[k]..corner[k] + 1.0).contains(&place[k])) {
                starts.places[0].push(place[0]);
                starts.places[1].push(place[1]);
                starts.paths.push(block.paths.len() as u32);
            }
            let drawn = 2 + u8::from(aimed) + u8::from(wavelengths.count() > 1);
            block.paths.push(Path {
                index,
                line,
                drawn,
                share,
                ..path
            });
        }
    }

    /// The lines of sight of the paths, from the observer.
    fn start(&mut self) {
        let Self { block, starts, .. } = self;
        if let Some((stack, origin_faces)) = block.observer {
            block.view.through_all(&starts.places, &mut starts.directions);
            block
                .lines
                .extend_from(block.view.observer, &starts.directions, origin_faces);
            let branch = Branch {
                path: 0,
                stack,
                weight: 1.0,
                seen: Seen::Smooth,
                travelled: 0.0,
                events: 0,
                scatters: 0,
                drawn: false,
                direct: true,
                density: 0.0,
                ways: glints::STRAIGHT,
                selective: false,
                thinned: 0,
                behind: 0.0,
            };
            let branches = starts.paths.iter().map(|path| Branch { path: *path, ..branch });
            block.branches.extend(branches);
        } else {
            for path in &mut block.paths {
                path.lost += 1.0;
            }
        }
        starts.places.iter_mut().for_each(Vec::clear);
        starts.paths.clear();
    }

    /// Follows all branches of the block to their ends.
    fn follow(&mut self) {
        while !self.block.branches.is_empty() {
            if self.block.lit.is_stopped() {
                self.block.lines.clear();
                self.block.branches.clear();
                return;
            }
            let mut hits = std::mem::take(&mut self.block.hits);
            self.block.lit.scene.face_set.nearest(&self.block.lines, &mut hits);
            self.block.gather(&hits);
            self.splitter.advance(&mut self.block, &hits);
            self.block.connect(&mut hits);
            self.block.hits = hits;
            std::mem::swap(&mut self.block.lines, &mut self.block.next_lines);
            std::mem::swap(&mut self.block.branches, &mut self.block.next);
            self.block.next_lines.clear();
            self.block.next.clear();
        }
        self.block.lines.clear();
    }
}
