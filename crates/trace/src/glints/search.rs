//! Small images of sources: chains of smooth surfaces from the observer, bent until they end on a point of the source.
//!
//! From starts in every pixel all chains are followed. Two more lines beside each tell how it moves with the place in the
//! pixel; by Newton's method that place is found from which it meets a point of the source. As for manifolds of specular
//! paths `[Jakob2012]`, but with differences in the place of derivatives, which asks nothing of the surfaces.

use etendue_geometry::RayBatch;
use etendue_geometry::hits::TIE;
use etendue_geometry::origin_faces::OriginFaces;
use etendue_lightfield::View;
use etendue_math::Vec3;
use etendue_optics::source::surface::across;
use etendue_sampling::lattice::{DIMENSIONS, lattice_point};

use super::image::{Found, Glint};
use crate::interaction::{Interaction, first_interaction};
use crate::lit_scene::LitScene;
use crate::medium_cache::MediumCache;
use crate::ray_start::place;
use crate::scatter::{SPLIT, SurfaceEvent};
use crate::scene::Scene;
use crate::solid_stack::SolidStack;

/// How far beside a line its neighbours start, in pixels: far above rounding, far below what surfaces do.
const BESIDE: f64 = 1e-4;

/// From how far away an image is looked for, in pixels.
const NEAR: f64 = 3.0;

/// Surfaces met by all chains from one start, at most: light that is caught in a solid has no end.
const MOST_MEETINGS: usize = 128;

/// Surfaces met in all from one start, by chains and while they are bent: among thousands of prisms a search has no end.
const WORK: usize = 256;

/// As many where a first look has found that starts run out of them and lead to no image.
const LITTLE_WORK: usize = 16;

/// Points of each source that are looked for.
const POINTS: usize = 64;

/// Those among them that tell how large the source is about one of them.
const TOGETHER: usize = 8;

/// Parts of a source are images by themselves if their area on the screen is so much smaller than its own.
const APART: f64 = 1.0 / 400.0;

/// How far behind a surface a point may lie that is on it, in units of the distance: far above rounding.
const HIDDEN: f64 = 1e-3;

/// Steps to an image.
const STEPS: usize = 20;

/// Width of an image in units of the standard deviation of the places of its light.
const WIDTH: f64 = 1.5;

/// The least and the largest width, in pixels. Lines that are spread evenly find what is larger both ways.
const NARROWEST: f64 = 1e-9;
const WIDEST: f64 = 0.5;

/// The lesser width of a whole source from which on no image of it is looked for, in pixels.
const LARGE: f64 = 4.0 * WIDEST;

/// The seed of the points of sources: any does.
const SEED: u64 = 0x474C_494E_5453;

/// Wavelengths that images are looked for at.
const COLOURS: usize = 4;

type Pair = [f64; 2];
/// By rows.
type Square = [Pair; 2];
type Spread = [[f64; 3]; 3];

/// Points of a source and how they are spread.
#[derive(Debug)]
pub struct Target {
    source: usize,
    points: Vec<Vec3>,
    middle: Vec3,
    radius: f64,
    /// Covariance of all points, and of those about each.
    spread: Spread,
    about: Vec<Spread>,
}

/// A source, and at each smooth surface on the way to it whether light is transmitted.
pub type Sight = (usize, Vec<bool>);

/// A line of sight on its way.
#[derive(Clone, Copy)]
struct Line {
    o: Vec3,
    d: Vec3,
    stack: SolidStack,
    origin_faces: OriginFaces,
}

/// A chain of smooth surfaces from a start: the line there and those beside it.
#[derive(Clone)]
struct Chain {
    lines: [Line; 3],
    weight: f64,
    ways: Vec<bool>,
}

/// How lines pass a point: offset of the line, and its change with the place in pixels, across it; distance along it.
struct Passing {
    off: Pair,
    change: Square,
    along: f64,
    axes: [Vec3; 2],
}

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
}

impl<'a> Search<'a> {
    /// None if there is nothing to look for.
    pub fn new(lit: &'a LitScene<'a>, view: &'a View, most_events: u32, targets: &'a [Target]) -> Option<Self> {
        let observer = place(lit.scene, view.observer, (view.target - view.observer).normalized()).ok()?;
        let n = lit.lines.len();
        let colours = n.min(COLOURS);
        // In the middle of each of as many parts of the light.
        let wavelengths = (0..colours).map(|k| {
            let share = (k as f64 + 0.5) / colours as f64;
            lit.lines[lit.lines.partition_point(|line| line.0 < share).min(n - 1)].1
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
        let looks = (0..starts).map(|start| {
            let mut found = Vec::new();
            self.search_at(pixel, start, starts, &mut found, &mut Vec::new());
            [found.len(), usize::from(self.left == 0)]
        });
        looks.fold([0, 0], |sum, look| [sum[0] + look[0], sum[1] + look[1]])
    }

    /// Images that are found from starts in a pixel, wherever they are, and what most of the starts see without a search.
    pub fn search_from(&mut self, pixel: usize, starts: usize) -> (Vec<Found>, Vec<Sight>) {
        let (mut found, mut seen) = (Vec::new(), Vec::new());
        for start in 0..starts {
            self.search_at(pixel, start, starts, &mut found, &mut seen);
        }
        seen.sort_unstable();
        let most = seen
            .chunk_by(PartialEq::eq)
            .filter(|same| 2 * same.len() > starts)
            .map(|same| same[0].clone());
        let most = most.collect();
        (found, most)
    }

    /// Looks from one of the starts in a pixel.
    #[allow(clippy::cast_possible_truncation, reason = "a small number")]
    fn search_at(&mut self, pixel: usize, start: usize, starts: usize, found: &mut Vec<Found>, seen: &mut Vec<Sight>) {
        let columns = self.view.columns as usize;
        let point = lattice_point(start as u32, &[0.5; DIMENSIONS]);
        let at = [(pixel % columns) as f64 + point[0], (pixel / columns) as f64 + point[1]];
        let wavelength = self.wavelengths[(pixel + start) % self.wavelengths.len()];
        self.start(at, wavelength, pixel * starts + start, found, seen);
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
                let Some(shares) = self.shares(&chain.lines[0], &met[0], wavelength) else {
                    chain.lines = met.map(|met| Line {
                        o: met.point,
                        d: chain.lines[0].d,
                        stack: met.after,
                        origin_faces: met.origin_faces,
                    });
                    continue;
                };
                for (transmitted, share) in [(false, shares[0]), (true, shares[1])] {
                    let weight = chain.weight * share;
                    let lines = (weight > SPLIT).then(|| self.turned(&chain.lines, &met, transmitted, wavelength));
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

    /// What three lines meet; None if it is nothing, or not the same.
    fn interactions(&mut self, lines: &[Line; 3]) -> Option<[Interaction; 3]> {
        self.left = self.left.checked_sub(1)?;
        let next = |line: &Line| {
            first_interaction(
                self.scene,
                line.o,
                line.d,
                &line.origin_faces,
                f64::INFINITY,
                line.stack,
            )
        };
        let first = next(&lines[0]).ok()??;
        let same = |line: &Line| {
            let met = next(line).ok()??;
            (met.face == first.face && met.finish == first.finish && met.after == first.after).then_some(met)
        };
        Some([first, same(&lines[1])?, same(&lines[2])?])
    }

    /// What of the radiance is mirrored and refracted; None if the line goes on as if nothing were there.
    fn shares(&mut self, line: &Line, met: &Interaction, wavelength: f64) -> Option<Pair> {
        let event = SurfaceEvent::new(self.scene, met, line.d, wavelength, &mut self.media);
        Some(event.ok()??.seen().0)
    }

    /// Three lines beyond a smooth surface; None if one of them cannot go there.
    fn turned(
        &mut self,
        lines: &[Line; 3],
        met: &[Interaction; 3],
        transmitted: bool,
        wavelength: f64,
    ) -> Option<[Line; 3]> {
        let mut result = *lines;
        for (line, met) in result.iter_mut().zip(met) {
            let event = SurfaceEvent::new(self.scene, met, line.d, wavelength, &mut self.media).ok()??;
            let (smooth, shares) = event.seen();
            if smooth[usize::from(transmitted)] <= 0.0 {
                return None;
            }
            let (d, stack) = if transmitted {
                event.refracted(shares.refraction)
            } else {
                event.mirrored()
            };
            *line = Line {
                o: met.point,
                d,
                stack,
                origin_faces: met.origin_faces,
            };
        }
        Some(result)
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
            if self.shares(&lines[0], &met[0], wavelength).is_some() {
                lines = self.turned(&lines, &met, ways[done], wavelength)?;
                done += 1;
            } else {
                let before = lines;
                for ((line, met), before) in lines.iter_mut().zip(met).zip(before) {
                    *line = Line {
                        o: met.point,
                        d: before.d,
                        stack: met.after,
                        origin_faces: met.origin_faces,
                    };
                }
            }
        }
        Some(lines)
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
        if step[0].hypot(step[1]) > NEAR + norm * target.radius {
            return;
        }
        // Whatever is far larger than a pixel is no small image.
        if widths(&spread_on_screen(&inverse, &middle.axes, &target.spread)).1 > LARGE {
            return;
        }
        let distance = |point: &Vec3| {
            let passing = passing(&chain.lines, *point);
            passing.inverse().map_or(f64::INFINITY, |inverse| {
                let step = times(&inverse, passing.off);
                step[0].hypot(step[1])
            })
        };
        let nearest = (0..target.points.len())
            .map(|k| (distance(&target.points[k]), k))
            .fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a });
        if nearest.0 > NEAR {
            return;
        }
        for k in [nearest.1, number % target.points.len()] {
            let Some((place, inverse, axes)) = self.approach(target.points[k], at, &chain.ways, target, wavelength)
            else {
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
        ways: &[bool],
        target: &Target,
        wavelength: f64,
    ) -> Option<(Pair, Square, [Vec3; 2])> {
        let (mut at, mut last) = (start, start);
        let close = 1e-3 * (target.spread[0][0] + target.spread[1][1] + target.spread[2][2]).sqrt();
        for _ in 0..STEPS {
            let Some(lines) = self.follow(at, ways, wavelength) else {
                // Beyond an edge: half way back.
                at = [f64::midpoint(at[0], last[0]), f64::midpoint(at[1], last[1])];
                continue;
            };
            let passing = passing(&lines, point);
            let inverse = passing.inverse()?;
            let mut step = times(&inverse, passing.off);
            if passing.off[0].hypot(passing.off[1]) < close {
                if self.left == 0 {
                    return None;
                }
                // Another surface may stand before it.
                let reach = self.interactions(&lines).map_or(f64::INFINITY, |met| met[0].t);
                let there = passing.along > 0.0 && passing.along <= reach * (1.0 + HIDDEN);
                return there.then_some(([at[0] - step[0], at[1] - step[1]], inverse, passing.axes));
            }
            let length = step[0].hypot(step[1]);
            if length > 1.0 {
                step = step.map(|x| x / length);
            }
            last = at;
            at = [at[0] - step[0], at[1] - step[1]];
            let grid = [self.view.columns, self.view.rows].map(f64::from);
            if (0..2).any(|k| !(-1.0..=grid[k] + 1.0).contains(&at[k])) {
                return None;
            }
        }
        None
    }
}

impl Passing {
    /// Places by offsets; None where offsets do not follow places.
    fn inverse(&self) -> Option<Square> {
        let [[a, b], [c, d]] = self.change;
        let determinant = a * d - b * c;
        let inverse = [[d / determinant, -b / determinant], [-c / determinant, a / determinant]];
        inverse.iter().flatten().all(|x| x.is_finite()).then_some(inverse)
    }
}

fn passing(lines: &[Line; 3], point: Vec3) -> Passing {
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

fn times(m: &Square, v: Pair) -> Pair {
    [m[0][0] * v[0] + m[0][1] * v[1], m[1][0] * v[0] + m[1][1] * v[1]]
}

fn determinant(m: &Square) -> f64 {
    m[0][0] * m[1][1] - m[0][1] * m[1][0]
}

/// The covariance in pixels that one in space comes to.
fn spread_on_screen(inverse: &Square, axes: &[Vec3; 2], spread: &Spread) -> Square {
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
fn widths(spread: &Square) -> (f64, f64) {
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
fn image(place: Pair, spread: &Square) -> Option<Glint> {
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

/// What a view may show small images of.
pub fn targets(lit: &LitScene<'_>, view: &View) -> Vec<Target> {
    (0..lit.scene.sources.len())
        // A source that stands around the observer is a surround, not a lamp: glass shows all of it in little.
        .filter(|number| !lit.scene.sources[*number].bounds().contains(view.observer))
        .filter_map(|number| target(lit, number))
        .collect()
}

/// Points of a source that can be seen; None if it cannot.
fn target(lit: &LitScene<'_>, number: usize) -> Option<Target> {
    let source = &lit.scene.sources[number];
    lit.light_samplers[number].as_ref()?;
    let mut batch = RayBatch::default();
    source.emit(number as u64, 0..POINTS as u64, POINTS as u64, SEED, &[], &mut batch);
    let points: Vec<Vec3> = (0..batch.len)
        .filter(|i| batch.usable(*i))
        .map(|i| batch.position(i))
        .collect();
    let (middle, spread) = moments(points.iter())?;
    let radius = points.iter().map(|p| (*p - middle).length()).fold(0.0, f64::max);
    if radius == 0.0 {
        return None;
    }
    let about = points.iter().map(|point| {
        let mut others: Vec<&Vec3> = points.iter().collect();
        others.sort_by(|a, b| (**a - *point).length().total_cmp(&(**b - *point).length()));
        Some(moments(others.into_iter().take(TOGETHER))?.1)
    });
    Some(Target {
        source: number,
        about: about.collect::<Option<_>>()?,
        points,
        middle,
        radius,
        spread,
    })
}

/// Mean and covariance of points.
fn moments<'p>(points: impl Iterator<Item = &'p Vec3> + Clone) -> Option<(Vec3, Spread)> {
    let n = points.clone().count() as f64;
    let zero = Vec3::new(0.0, 0.0, 0.0);
    let mean = points.clone().fold(zero, |sum, p| sum + *p) * (1.0 / n);
    let mut spread = [[0.0; 3]; 3];
    for point in points {
        let off = *point - mean;
        let off = [off.x, off.y, off.z];
        for (row, a) in spread.iter_mut().zip(off) {
            for (cell, b) in row.iter_mut().zip(off) {
                *cell += a * b / n;
            }
        }
    }
    (n > 0.0).then_some((mean, spread))
}
