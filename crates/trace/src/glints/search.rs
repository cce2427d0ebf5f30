//! Small images of sources: chains of smooth surfaces from the observer, bent until they end on a point of the source.
//!
//! From starts in every pixel all chains are followed. Two more lines beside each tell how it moves with the place in the
//! pixel; by Newton's method that place is found from which it meets a point of the source. As for manifolds of specular
//! paths `[Jakob2012]`, but with differences in the place of derivatives, which asks nothing of the surfaces.

use etendue_geometry::hits::TIE;
use etendue_geometry::origin_faces::{NONE, OriginFaces};
use etendue_lightfield::View;
use etendue_math::Vec3;
use etendue_sampling::lattice::{DIMENSIONS, lattice_point};

use super::chain::{Chain, interactions, straight, turn, turned};
use super::image::Found;
use super::passing::{
    BESIDE, Line, Pair, Square, WIDEST, determinant, image, passing, spread_on_screen, times, widths,
};
use super::targets::Target;
use crate::interaction::{Interaction, first_interaction};
use crate::lit_scene::LitScene;
use crate::medium_cache::MediumCache;
use crate::ray_start::place_observer;
use crate::scatter::SPLIT;
use crate::scene::Scene;
use crate::solid_stack::SolidStack;

/// From how far away an image is looked for, in pixels.
const NEAR: f64 = 3.0;

/// Surfaces met by all chains from one start, at most: light that is caught in a solid has no end.
const MOST_MEETINGS: usize = 128;

/// Surfaces met in all from one start, by chains and while they are bent: among thousands of prisms a search has no end.
const WORK: usize = 256;

/// As many where a first look has found that starts run out of them and lead to no image.
const LITTLE_WORK: usize = 16;

/// Parts of a source are images by themselves if their area on the screen is so much smaller than its own.
const APART: f64 = 1.0 / 400.0;

/// How far behind a surface a point may lie that is on it, in units of the distance: far above rounding.
const HIDDEN: f64 = 1e-3;

/// Steps to an image, each of a pixel at most.
const STEPS: u32 = 20;

/// Steps beyond an edge that are taken back, at most: an image that lies there is none.
const EDGES: u32 = 4;

/// From how far away an image is approached, in pixels: a point of it that is not the nearest to the start may lie farther away.
const FAR: f64 = 2.0 * NEAR;

/// Steps that come no nearer, at most: not half way, or half a pixel. Other starts lie where lines move more evenly.
const SLIPS: u32 = 1;

/// The lesser width of a whole source from which on no image of it is looked for, in pixels.
const LARGE: f64 = 4.0 * WIDEST;

/// Wavelengths that images are looked for at.
const COLOURS: usize = 4;

/// Starts of a tile that look in vain for an image of a source through some surfaces, before no other does.
const IN_VAIN: usize = 2;

/// Of the starts in a tile every so many come first and may speak for the others: where each pixel has one start, and several.
const SPEAKING: [usize; 2] = [4, 3];

/// Starts in a tile, at least.
const TILE: usize = 8;

/// A source, and at each smooth surface on the way to it whether light is transmitted.
pub type Sight = (usize, Vec<bool>);

/// What comes of the starts in a pixel: images, wherever they are, and what most of the starts see without a search.
pub type FromPixel = (Vec<Found>, Vec<Sight>);

/// What is needed to look for images.
#[derive(Clone)]
pub struct Search<'a> {
    lit: &'a LitScene<'a>,
    scene: &'a Scene,
    view: &'a View,
    most_events: u32,
    targets: &'a [Target],
    wavelengths: Vec<f64>,
    /// What the observer is in and on.
    observer: (SolidStack, OriginFaces),
    media: MediumCache,
    /// Surfaces that may be met from a start, and those that are left of them at the present one.
    work: usize,
    left: usize,
    /// Images that were looked for in a tile: of which source, through which surfaces, and whether one was found.
    tried: Vec<(Sight, bool)>,
}

impl<'a> Search<'a> {
    /// None if there is nothing to look for.
    pub fn new(lit: &'a LitScene<'a>, view: &'a View, most_events: u32, targets: &'a [Target]) -> Option<Self> {
        let observer = place_observer(lit.scene, view.observer, view.target).ok()?;
        let wavelengths = &lit.wavelengths;
        let colours = wavelengths.count().min(COLOURS);
        // In the middle of each of as many parts of the light.
        let wavelengths = (0..colours).map(|k| {
            let share = (k as f64 + 0.5) / colours as f64;
            wavelengths.at(wavelengths.draw(share))
        });
        let search = Self {
            lit,
            scene: lit.scene,
            view,
            most_events,
            targets,
            wavelengths: wavelengths.collect(),
            observer,
            media: MediumCache::new(lit.scene),
            work: WORK,
            left: 0,
            tried: Vec::new(),
        };
        // Without smooth surfaces the only images are direct ones.
        let hopeless = !lit.scene.may_reflect() && targets.iter().all(|target| search.is_large(target));
        (!hopeless).then_some(search)
    }

    /// Whether a source is seen directly as something far larger than a pixel, with a margin for places beside its middle.
    fn is_large(&self, target: &Target) -> bool {
        let width = self.view.place(target.middle).and_then(|at| {
            let passing = passing(&self.lines(at), target.middle);
            let inverse = passing.inverse()?;
            Some(widths(&spread_on_screen(&inverse, &passing.axes, &target.spread)).1)
        });
        width.is_some_and(|width| width > 2.0 * LARGE)
    }

    /// Spends little on each start from now on.
    pub fn spend_little(&mut self) {
        self.work = LITTLE_WORK;
    }

    /// How many images are found from starts in a pixel, and how many of the starts end for want of work.
    pub fn first_look(&mut self, pixel: usize, starts: usize) -> [usize; 2] {
        // What other pixels have looked for in vain depends on which of them this thread has had.
        self.tried.clear();
        let looks = (0..starts).map(|start| {
            let mut found = Vec::new();
            self.search_at(pixel, start, starts, &mut found, &mut Vec::new());
            [found.len(), usize::from(self.left == 0)]
        });
        looks.fold([0, 0], |sum, look| [sum[0] + look[0], sum[1] + look[1]])
    }

    /// Looks from the starts in the pixels of a tile, pixel by pixel.
    ///
    /// Some of the starts come first. If these all meet the same surface first and no image is near to any of them, others that
    /// meet this surface are left out.
    pub fn search_from(&mut self, tile: &[usize], starts: usize) -> Vec<FromPixel> {
        let step = SPEAKING[usize::from(starts > 1)];
        let all = tile.len() * starts;
        let mut found = vec![Vec::new(); tile.len()];
        let mut seen: Vec<(Vec<Sight>, usize)> = vec![(Vec::new(), 0); tile.len()];
        let mut search = |search: &mut Self, number: usize| {
            let (pixel, start) = (number / starts, number % starts);
            let (seen, searched) = &mut seen[pixel];
            search.search_at(tile[pixel], start, starts, &mut found[pixel], seen);
            *searched += 1;
        };
        let mut faces: Vec<u32> = Vec::new();
        let mut ended = true;
        self.tried.clear();
        for number in (0..all).step_by(step) {
            search(self, number);
            ended &= self.left > 0;
            faces.push(self.first_face(tile[number / starts], number % starts));
        }
        let quiet = ended && self.tried.is_empty() && faces.iter().all(|face| *face == faces[0]);
        for number in (0..all).filter(|number| number % step > 0) {
            if !quiet || self.first_face(tile[number / starts], number % starts) != faces[0] {
                search(self, number);
            }
        }
        if quiet {
            // What is seen all over the tile.
            let everything: Vec<Sight> = seen.iter().flat_map(|(seen, _)| seen.iter().cloned()).collect();
            let searched = seen.iter().map(|(_, searched)| searched).sum();
            seen.fill((everything, searched));
        }
        let most = seen.into_iter().map(|(seen, searched)| common(seen, searched));
        found.into_iter().zip(most).collect()
    }

    /// Where a start lies.
    #[allow(clippy::cast_possible_truncation, reason = "a small number")]
    fn place(&self, pixel: usize, start: usize) -> Pair {
        let columns = self.view.columns as usize;
        let point = lattice_point(start as u32, &[0.5; DIMENSIONS]);
        [(pixel % columns) as f64 + point[0], (pixel / columns) as f64 + point[1]]
    }

    /// The face that a line of sight from a start meets first; [`NONE`] if there is none.
    fn first_face(&self, pixel: usize, start: usize) -> u32 {
        let d = self.view.through(self.place(pixel, start));
        let (stack, origin_faces) = self.observer;
        let met = first_interaction(self.scene, self.view.observer, d, &origin_faces, f64::INFINITY, stack);
        met.ok().flatten().map_or(NONE, |met| met.face)
    }

    /// Looks from one of the starts in a pixel.
    fn search_at(&mut self, pixel: usize, start: usize, starts: usize, found: &mut Vec<Found>, seen: &mut Vec<Sight>) {
        let wavelength = self.wavelengths[(pixel + start) % self.wavelengths.len()];
        self.start(
            self.place(pixel, start),
            wavelength,
            pixel * starts + start,
            found,
            seen,
        );
    }

    fn start(&mut self, at: Pair, wavelength: f64, number: usize, found: &mut Vec<Found>, seen: &mut Vec<Sight>) {
        let mut chains = vec![Chain {
            lines: self.lines(at),
            weight: 1.0,
            ways: Vec::new(),
        }];
        let mut interactions = 0;
        self.left = self.work;
        while let Some(mut chain) = chains.pop() {
            let mut events = chain.ways.len();
            loop {
                if self.left == 0 {
                    return;
                }
                let met = self.interactions(&chain.lines);
                let reach = met.as_ref().map_or(f64::INFINITY, |met| met[0].t);
                for target in self.targets {
                    if self.shows(target, &chain.lines[0], reach) {
                        seen.push((target.source, chain.ways.clone()));
                    } else {
                        self.aim(target, at, &chain, reach, wavelength, number, found);
                    }
                }
                interactions += 1;
                events += 1;
                let Some(met) = met else { break };
                if interactions >= MOST_MEETINGS || events > self.most_events as usize {
                    return;
                }
                let Ok(at) = turn(self.scene, &chain.lines, &met, wavelength, &mut self.media) else {
                    break;
                };
                let Some(at) = at else {
                    chain.lines = straight(&chain.lines, &met);
                    continue;
                };
                for (transmitted, factor) in [(false, at[0].factors[0]), (true, at[0].factors[1])] {
                    let weight = chain.weight * factor;
                    let lines = (weight > SPLIT).then(|| turned(&at, transmitted));
                    if let Some(lines) = lines.flatten() {
                        let mut ways = chain.ways.clone();
                        ways.push(transmitted);
                        chains.push(Chain { lines, weight, ways });
                    }
                }
                break;
            }
        }
    }

    /// The lines of sight through a place and beside it.
    fn lines(&self, at: Pair) -> [Line; 3] {
        [[0.0, 0.0], [BESIDE, 0.0], [0.0, BESIDE]].map(|off| Line {
            o: self.view.observer,
            d: self.view.through([at[0] + off[0], at[1] + off[1]]),
            stack: self.observer.0,
            origin_faces: self.observer.1,
        })
    }

    /// What three lines meet; None if it is nothing, or not the same, or nothing more is to be met.
    fn interactions(&mut self, lines: &[Line; 3]) -> Option<[Interaction; 3]> {
        self.left = self.left.checked_sub(1)?;
        interactions(self.scene, lines)
    }

    /// The lines from a place along known ways.
    fn follow(&mut self, at: Pair, ways: &[bool], wavelength: f64) -> Option<[Line; 3]> {
        let mut lines = self.lines(at);
        let (mut done, mut interactions) = (0, 0);
        while done < ways.len() {
            interactions += 1;
            if interactions > MOST_MEETINGS {
                return None;
            }
            let met = self.interactions(&lines)?;
            if let Some(at) = turn(self.scene, &lines, &met, wavelength, &mut self.media).ok()? {
                lines = turned(&at, ways[done])?;
                done += 1;
            } else {
                lines = straight(&lines, &met);
            }
        }
        Some(lines)
    }

    /// How far lines go before they are turned or end.
    fn reach(&mut self, mut lines: [Line; 3], wavelength: f64) -> f64 {
        let mut reach = 0.0;
        while let Some(met) = self.interactions(&lines) {
            reach += met[0].t;
            let Ok(None) = turn(self.scene, &lines, &met, wavelength, &mut self.media) else {
                return reach;
            };
            lines = straight(&lines, &met);
        }
        f64::INFINITY
    }

    /// Looks for images of a source near to a start.
    #[allow(clippy::too_many_arguments, reason = "what a start is")]
    fn aim(
        &mut self,
        target: &Target,
        at: Pair,
        chain: &Chain,
        reach: f64,
        wavelength: f64,
        number: usize,
        found: &mut Vec<Found>,
    ) {
        let middle = passing(&chain.lines, target.middle);
        let Some(inverse) = middle.inverse() else {
            return;
        };
        if middle.along + target.radius <= 0.0 || middle.along - target.radius > 2.0 * reach {
            return;
        }
        let norm = inverse.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
        let step = times(&inverse, middle.off);
        if square(step) > (NEAR + norm * target.radius).powi(2) {
            return;
        }
        // Whatever is far larger than a pixel is no small image.
        if widths(&spread_on_screen(&inverse, &middle.axes, &target.spread)).1 > LARGE {
            return;
        }
        let distance2 = |point: &Vec3| {
            let passing = passing(&chain.lines, *point);
            let inverse = passing.inverse();
            inverse.map_or(f64::INFINITY, |inverse| square(times(&inverse, passing.off)))
        };
        let nearest = (0..target.points.len())
            .map(|k| (distance2(&target.points[k]), k))
            .fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a });
        if nearest.0 > NEAR * NEAR {
            return;
        }
        let sight = (target.source, chain.ways.clone());
        let mut before = self.tried.iter().filter(|(other, _)| *other == sight);
        if before.clone().count() >= IN_VAIN && before.all(|(_, found)| !found) {
            return;
        }
        let before = found.len();
        for k in [nearest.1, number % target.points.len()] {
            let Some((place, inverse, axes)) = self.approach(target.points[k], at, chain, target, wavelength) else {
                continue;
            };
            let whole = spread_on_screen(&inverse, &axes, &target.spread);
            let part = spread_on_screen(&inverse, &axes, &target.about[k]);
            let apart = determinant(&part).max(0.0).sqrt() < APART.sqrt() * determinant(&whole).max(0.0).sqrt();
            for spread in [Some(whole), apart.then_some(part)].into_iter().flatten() {
                if let Some(glint) = image(place, &spread) {
                    found.push(Found {
                        glint,
                        source: target.source,
                        ways: chain.ways.clone(),
                    });
                }
            }
        }
        self.tried.push((sight, found.len() > before));
    }

    /// Whether a line meets the source itself: it is not small there, as glass shows the whole sky in little.
    fn shows(&self, target: &Target, line: &Line, reach: f64) -> bool {
        let (mut met, lit) = (false, self.lit);
        if let Some(sampler) = &lit.light_samplers[target.source] {
            sampler.along(
                &lit.scene.sources[target.source],
                line.o,
                line.d,
                reach * (1.0 + TIE),
                |_| {
                    met = true;
                },
            );
        }
        met
    }

    /// The place from which a chain meets a point, and how places there follow from offsets.
    fn approach(
        &mut self,
        point: Vec3,
        start: Pair,
        chain: &Chain,
        target: &Target,
        wavelength: f64,
    ) -> Option<(Pair, Square, [Vec3; 2])> {
        let (mut at, mut last) = (start, start);
        let close = 1e-3 * (target.spread[0][0] + target.spread[1][1] + target.spread[2][2]).sqrt();
        let (mut edges, mut slips, mut distance) = (0, 0, f64::INFINITY);
        for step in 0..STEPS {
            let there = if step == 0 {
                Some(chain.lines)
            } else {
                self.follow(at, &chain.ways, wavelength)
            };
            let Some(lines) = there else {
                edges += 1;
                if edges == EDGES || self.left == 0 {
                    return None;
                }
                // Beyond an edge: half way back.
                at = [f64::midpoint(at[0], last[0]), f64::midpoint(at[1], last[1])];
                continue;
            };
            let passing = passing(&lines, point);
            let inverse = passing.inverse()?;
            let mut way = times(&inverse, passing.off);
            if square(passing.off) < close * close {
                if self.left == 0 {
                    return None;
                }
                // Another surface may stand before it.
                let reach = self.reach(lines, wavelength);
                let there = passing.along > 0.0 && passing.along <= reach * (1.0 + HIDDEN);
                return there.then_some(([at[0] - way[0], at[1] - way[1]], inverse, passing.axes));
            }
            let length = square(way).sqrt();
            slips += u32::from(length > (0.5 * distance).max(distance - 0.5));
            if length > FAR || slips > SLIPS {
                return None;
            }
            distance = length;
            if length > 1.0 {
                way = way.map(|x| x / length);
            }
            last = at;
            at = [at[0] - way[0], at[1] - way[1]];
            let grid = [self.view.columns, self.view.rows].map(f64::from);
            if (0..2).any(|k| !(-1.0..=grid[k] + 1.0).contains(&at[k])) {
                return None;
            }
        }
        None
    }
}

/// The square of a length.
fn square([x, y]: Pair) -> f64 {
    x * x + y * y
}

/// What was seen from more than half of so many starts.
fn common(mut seen: Vec<Sight>, starts: usize) -> Vec<Sight> {
    seen.sort_unstable();
    let most = seen.chunk_by(PartialEq::eq).filter(|same| 2 * same.len() > starts);
    most.map(|same| same[0].clone()).collect()
}

/// The side of the tiles of pixels with so many starts each, at least one, that are searched together.
pub fn tile_side(starts: usize) -> u32 {
    let side = |side: &u32| (side * side) as usize * starts >= TILE;
    (1..=3).find(side).unwrap_or(3)
}
