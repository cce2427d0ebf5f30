//! A scatter event, connected to an observer: the light image, at once or from stored events.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use etendue_geometry::hits::Hits;
use etendue_geometry::origin_faces::NONE;
use etendue_geometry::ray_block::RayBlock;
use etendue_geometry::shape::ROUNDING;
use etendue_lightfield::View;
use etendue_math::Vec3;
use etendue_optics::bsdf::Media;
use rayon::prelude::*;

use crate::events::{ScatterEvent, WORDS, from_row, ray_of};
use crate::medium_cache::MediumCache;
use crate::mis::density;
use crate::records::{Cell, Contribution, merge};
use crate::scatter::Surface;
use crate::scene::{Act, Scene};
use crate::solid_stack::SolidStack;
use crate::transmittance::transmittance;

/// An event as an observer sees it, if nothing is in between.
#[derive(Clone, Copy, Debug)]
struct Sight {
    pixel: u32,
    /// What it adds to the luminance of the pixel.
    light: f64,
    /// Density by area with which lines of sight of the pixel meet the point \[1/mm²\].
    density: f64,
    /// Unit vector to the observer, and how far that is.
    k: Vec3,
    distance: f64,
    /// The solids that the light sets out in.
    stack: SolidStack,
}

/// What an observer would see of it; None if that is nothing.
///
/// Flux Φ on an element gives it the intensity I = Φ f cos θ towards the observer at distance s. Through a pixel of area A at
/// distance p, whose normal is turned by θₚ, that is the luminance I/s² · p²/(A cos θₚ).
#[inline]
fn sight(event: &ScatterEvent, scene: &Scene, view: &View, media: &mut MediumCache) -> Option<Sight> {
    let away = view.observer - event.point;
    let distance = away.length();
    let k = away * (1.0 / distance);
    let cosine = k.dot(event.side);
    let pixel = view.pixel(event.point, k)?;
    let through = cosine < 0.0;
    let both = [event.before, event.after];
    let around = media.both(scene, both, event.front, event.wavelength).ok()?;
    let normals = [event.side, event.normal].map(|n| if event.front { n } else { -n });
    let axis = scene.axes[event.origin_faces.face[0] as usize];
    let surface = Surface::new(&*scene.finishes[event.finish as usize], around, normals, axis);
    let f = surface.evaluate(-event.direction, k);
    if f == 0.0 || cosine == 0.0 {
        return None;
    }
    let t = (view.target - view.observer).dot(view.normal) / k.dot(view.normal);
    if t >= 0.0 {
        // It is behind the observer, who looks the other way.
        return None;
    }
    let density = density(view, k, distance, cosine);
    Some(Sight {
        pixel,
        light: event.flux * f * density,
        density,
        k,
        distance,
        stack: if through { event.after } else { event.before },
    })
}

/// The share of its light that gets to the observer.
fn passes(event: &ScatterEvent, scene: &Scene, view: &View, sight: &Sight, media: &mut MediumCache) -> f64 {
    let stack = sight.stack;
    transmittance::<false>(
        scene,
        [event.point, view.observer],
        event.origin_faces,
        stack,
        media,
        event.wavelength,
        |_, _| {},
    )
}

/// The pixel in which the scatter is seen, what it adds to the luminance there, and the density by area with which lines
/// of sight of the pixel meet it \[1/mm²\]; None if it is not seen.
#[must_use]
pub fn seen(event: &ScatterEvent, scene: &Scene, view: &View, media: &mut MediumCache) -> Option<(u32, f64, f64)> {
    let sight = sight(event, scene, view, media)?;
    let share = passes(event, scene, view, &sight, media);
    (share > 0.0).then_some((sight.pixel, sight.light * share, sight.density))
}
/// Any two media that are the same.
const SAME: Media = Media {
    wavelength: 555.0,
    front: 1.0,
    back: 1.0,
};

/// Stored events in one unit of work, or as many more as belong to the last ray.
const CHUNK: usize = 1 << 14;

/// Lines to the observer that are followed together.
const BLOCK: usize = 1024;

/// The light image of stored events (see [`crate::events`]), on the threads of the current pool; the same bits for any number
/// of them. None if they are not of this scene.
///
/// The rows of a ray follow each other: its contributions to a pixel are taken together. `brought` is the flux that the ray of
/// each row, or the unit with all its copies, brings. Once `stop` is set, the rest is left out.
#[must_use]
pub fn look_at_events(
    scene: &Scene,
    rows: &[u64],
    brought: &[f64],
    view: &View,
    stop: Option<&AtomicBool>,
) -> Option<Vec<Cell>> {
    let parts: Vec<Option<Vec<Contribution>>> = stretches(rows)
        .into_par_iter()
        .map(|range| {
            if stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                return Some(Vec::new());
            }
            let of_rows = &brought[range.start / WORDS..range.end / WORDS];
            EventImage::new(scene, view).look(&rows[range], of_rows)
        })
        .collect();
    let mut cells = vec![Cell::default(); view.pixels()];
    for part in parts {
        for contribution in part? {
            cells[contribution.cell as usize].add(&contribution);
        }
    }
    Some(cells)
}

/// Where the rows can be cut between two rays.
fn stretches(rows: &[u64]) -> Vec<Range<usize>> {
    let ray = |at: usize| ray_of(&rows[at * WORDS..]);
    let (n, mut start) = (rows.len() / WORDS, 0);
    let mut result = Vec::new();
    while start < n {
        let mut end = (start + CHUNK).min(n);
        while end < n && ray(end) == ray(end - 1) {
            end += 1;
        }
        result.push(start * WORDS..end * WORDS);
        start = end;
    }
    result
}

/// Scatter events, seen by an observer one block after the other.
struct EventImage<'a> {
    scene: &'a Scene,
    view: &'a View,
    media: MediumCache,
    /// Events of a block that the observer would see if nothing were in between, and the lines to the observer.
    events: Vec<(ScatterEvent, Sight, f64)>,
    lines: RayBlock,
    hits: Hits,
    /// What the observer sees: luminance of pixels.
    seen: Vec<Contribution>,
}

impl<'a> EventImage<'a> {
    fn new(scene: &'a Scene, view: &'a View) -> Self {
        Self {
            scene,
            view,
            media: MediumCache::new(scene),
            events: Vec::with_capacity(BLOCK),
            lines: RayBlock::default(),
            hits: Hits::default(),
            seen: Vec::new(),
        }
    }

    /// What each ray adds to pixels.
    fn look(mut self, rows: &[u64], brought: &[f64]) -> Option<Vec<Contribution>> {
        for (row, flux) in rows.chunks_exact(WORDS).zip(brought) {
            let event = from_row(self.scene, row)?;
            if let Some(sight) = sight(&event, self.scene, self.view, &mut self.media) {
                self.lines.push(event.point, sight.k, event.origin_faces);
                self.events.push((event, sight, *flux));
                if self.events.len() == BLOCK {
                    self.follow();
                }
            }
        }
        self.follow();
        for same in self.seen.chunk_by_mut(|a, b| a.unit == b.unit) {
            same.sort_by_key(|light| light.cell);
        }
        // What one ray adds to one pixel belongs together: it is not independent.
        merge(&mut self.seen);
        Some(self.seen)
    }

    /// Follows the lines of the block to the observer.
    fn follow(&mut self) {
        let (scene, view) = (self.scene, self.view);
        scene.face_set.nearest(&self.lines, &mut self.hits);
        for (i, (event, sight, flux)) in self.events.iter().enumerate() {
            let share = match self.at_once(i, event, sight) {
                Some(share) => share,
                None => passes(event, scene, view, sight, &mut self.media),
            };
            if share > 0.0 {
                self.seen.push(Contribution {
                    cell: sight.pixel,
                    unit: event.ray,
                    amount: sight.light * share,
                    flux: *flux,
                });
            }
        }
        self.events.clear();
        self.lines.clear();
    }

    /// The share of the light that gets to the observer, where the first thing in its way, or that there is none, says it all.
    fn at_once(&self, i: usize, event: &ScatterEvent, sight: &Sight) -> Option<f64> {
        let scene = self.scene;
        let o = event.point;
        // What lies within rounding of the observer is the surface that it lies on.
        let reach = sight.distance - 64.0 * ROUNDING * (o.x.abs() + o.y.abs() + o.z.abs() + sight.distance);
        if self.hits.face[i] == NONE || self.hits.t[i] >= reach {
            let medium = scene.medium(sight.stack.top());
            return (scene.media[medium].absorption.range() == [0.0, 0.0]).then_some(1.0);
        }
        let role = scene.roles[self.hits.face[i] as usize];
        match role.act {
            // A sheet decides before all else that lies there.
            Act::Optical(finish) if role.solid == 0 => {
                // Light that it lets pass as if nothing were there may meet more behind it.
                (!scene.finishes[finish as usize].is_nothing(&SAME)).then_some(0.0)
            }
            _ => None,
        }
    }
}
