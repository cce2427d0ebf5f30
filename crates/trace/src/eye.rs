//! A diffuse scatter, connected to the eye of an observer: the light image, at once or from stored events.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use etendue_geometry::assembly::Hits;
use etendue_geometry::lines::{Leaving, Lines, NONE};
use etendue_geometry::shape::ROUNDING;
use etendue_lightfield::View;
use etendue_math::Vec3;
use etendue_optics::finish::{Finish, Incidence};
use rayon::prelude::*;

use crate::harvest::Cell;
use crate::inside::Inside;
use crate::kept::{WORDS, from_row, ray_of};
use crate::meeting::{Fillings, Meeting, transmittance};
use crate::scene::{Act, Scene};
use crate::sharing::density;

/// Light that was scattered diffusely: what is needed to look at it, now or later, from anywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Where \[mm\].
    pub point: Vec3,
    /// Unit normal of the surface, on the side that the light came from.
    pub side: Vec3,
    /// Where the light was going.
    pub direction: Vec3,
    /// Of the ray \[flux unit\].
    pub flux: f64,
    /// \[nm\].
    pub wavelength: f64,
    /// Number of the ray in its run.
    pub ray: u64,
    /// The finish of the surface.
    pub finish: u32,
    /// The faces that the light leaves from, the one that scattered it first.
    pub leaving: Leaving,
    /// The solids on the side of the light.
    pub before: Inside,
    /// The solids on the other side.
    pub after: Inside,
}

/// An event as an observer sees it, if nothing is in between.
#[derive(Clone, Copy, Debug)]
struct Sight {
    pixel: u32,
    /// What it adds to the luminance of the pixel.
    light: f64,
    /// Density by area with which lines of sight of the pixel meet the point \[1/mm²\].
    density: f64,
    /// Unit vector to the eye, and how far that is.
    k: Vec3,
    distance: f64,
    /// The solids that the light sets out in.
    inside: Inside,
}

impl Event {
    /// The scatter of a ray at a meeting.
    #[must_use]
    pub fn new(meeting: &Meeting, finish: u32, direction: Vec3, [flux, wavelength]: [f64; 2], ray: u64) -> Self {
        let mut leaving = meeting.leaving;
        let mut found = leaving.face.iter().zip(leaving.part);
        if let Some(slot) = found.position(|(face, part)| (*face, part) == (meeting.face, meeting.part)) {
            leaving.face.swap(0, slot);
            leaving.part.swap(0, slot);
        } else {
            // More faces coincide than are told apart: in a corner.
            (leaving.face[0], leaving.part[0]) = (meeting.face, meeting.part);
        }
        Self {
            point: meeting.point,
            side: meeting.side,
            direction,
            flux,
            wavelength,
            ray,
            finish,
            leaving,
            before: meeting.before,
            after: meeting.after,
        }
    }

    /// What an observer would see of it; None if that is nothing.
    ///
    /// Flux Φ on an element gives it the intensity I = Φ f cos θ towards the eye at distance s. Through a pixel of area A at
    /// distance p, whose normal is turned by θₚ, that is the luminance I/s² · p²/(A cos θₚ).
    #[inline]
    fn sight(&self, scene: &Scene, view: &View, fillings: &mut Fillings) -> Option<Sight> {
        let away = view.eye - self.point;
        let distance = away.length();
        let k = away * (1.0 / distance);
        let cosine = k.dot(self.side);
        let pixel = view.pixel(self.point, k)?;
        let through = cosine < 0.0;
        let light = Incidence {
            cosine: (-self.direction.dot(self.side)).clamp(0.0, 1.0),
            wavelength: self.wavelength,
            n1: fillings.at(scene, self.before.top(), self.wavelength).n,
            n2: fillings.at(scene, self.after.top(), self.wavelength).n,
        };
        let bsdf = scene.finishes[self.finish as usize].bsdf(&light, through);
        if bsdf == 0.0 || cosine == 0.0 {
            return None;
        }
        let t = (view.target - view.eye).dot(view.normal) / k.dot(view.normal);
        if t >= 0.0 {
            // It is behind the observer, who looks the other way.
            return None;
        }
        let density = density(view, k, distance, cosine);
        Some(Sight {
            pixel,
            light: self.flux * bsdf * density,
            density,
            k,
            distance,
            inside: if through { self.after } else { self.before },
        })
    }

    /// The share of its light that gets to the eye.
    fn passes(&self, scene: &Scene, view: &View, sight: &Sight, fillings: &mut Fillings) -> f64 {
        let inside = sight.inside;
        transmittance(
            scene,
            self.point,
            view.eye,
            self.leaving,
            inside,
            fillings,
            self.wavelength,
        )
    }

    /// The pixel in which the scatter is seen, what it adds to the luminance there, and the density by area with which lines
    /// of sight of the pixel meet it \[1/mm²\]; None if it is not seen.
    #[must_use]
    pub fn seen(&self, scene: &Scene, view: &View, fillings: &mut Fillings) -> Option<(u32, f64, f64)> {
        let sight = self.sight(scene, view, fillings)?;
        let share = self.passes(scene, view, &sight, fillings);
        (share > 0.0).then_some((sight.pixel, sight.light * share, sight.density))
    }
}

/// Stored events in one unit of work, or as many more as belong to the last ray.
const CHUNK: usize = 1 << 14;

/// Lines to the eye that are followed together.
const BLOCK: usize = 1024;

/// The light image of stored events (see [`crate::kept`]), on the threads of the current pool; the same bits for any number
/// of them. None if they are not of this scene.
///
/// The rows of a ray follow each other: its contributions to a pixel are taken together. Once `stop` is set, the rest is left
/// out.
#[must_use]
pub fn look_at_events(scene: &Scene, rows: &[u64], view: &View, stop: Option<&AtomicBool>) -> Option<Vec<Cell>> {
    let parts: Vec<Option<Vec<(u32, f64)>>> = stretches(rows)
        .into_par_iter()
        .map(|range| {
            if stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                return Some(Vec::new());
            }
            Gaze::new(scene, view).look(&rows[range])
        })
        .collect();
    let mut cells = vec![Cell::default(); view.pixels()];
    for part in parts {
        for (pixel, light) in part? {
            let cell = &mut cells[pixel as usize];
            cell.sum += light;
            cell.squares += light * light;
            cell.rays += 1;
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

/// An observer who looks at one event after the other.
struct Gaze<'a> {
    scene: &'a Scene,
    view: &'a View,
    fillings: Fillings,
    /// Events of a block that he would see if nothing were in between, and the lines to his eye.
    events: Vec<(Event, Sight)>,
    lines: Lines,
    hits: Hits,
    /// What he sees: ray, pixel, luminance.
    seen: Vec<(u64, u32, f64)>,
}

impl<'a> Gaze<'a> {
    fn new(scene: &'a Scene, view: &'a View) -> Self {
        Self {
            scene,
            view,
            fillings: Fillings::new(scene),
            events: Vec::with_capacity(BLOCK),
            lines: Lines::default(),
            hits: Hits::default(),
            seen: Vec::new(),
        }
    }

    /// Pixels and what each ray adds to them.
    fn look(mut self, rows: &[u64]) -> Option<Vec<(u32, f64)>> {
        for row in rows.chunks_exact(WORDS) {
            let event = from_row(self.scene, row)?;
            if let Some(sight) = event.sight(self.scene, self.view, &mut self.fillings) {
                self.lines.push(event.point, sight.k, event.leaving);
                self.events.push((event, sight));
                if self.events.len() == BLOCK {
                    self.follow();
                }
            }
        }
        self.follow();
        let mut result = Vec::with_capacity(self.seen.len());
        for same in self.seen.chunk_by_mut(|a, b| a.0 == b.0) {
            // What one ray adds to one pixel belongs together: it is not independent.
            same.sort_by_key(|(_, pixel, _)| *pixel);
            for here in same.chunk_by(|a, b| a.1 == b.1) {
                result.push((here[0].1, here.iter().map(|(_, _, light)| light).sum()));
            }
        }
        Some(result)
    }

    /// Follows the lines of the block to the eye.
    fn follow(&mut self) {
        let (scene, view) = (self.scene, self.view);
        scene.assembly.nearest(&self.lines, &mut self.hits);
        for (i, (event, sight)) in self.events.iter().enumerate() {
            let share = match self.at_once(i, event, sight) {
                Some(share) => share,
                None => event.passes(scene, view, sight, &mut self.fillings),
            };
            if share > 0.0 {
                self.seen.push((event.ray, sight.pixel, sight.light * share));
            }
        }
        self.events.clear();
        self.lines.clear();
    }

    /// The share of the light that gets to the eye, where the first thing in its way, or that there is none, says it all.
    fn at_once(&self, i: usize, event: &Event, sight: &Sight) -> Option<f64> {
        let scene = self.scene;
        let o = event.point;
        // What lies within rounding of the eye is the surface that it lies on.
        let reach = sight.distance - 64.0 * ROUNDING * (o.x.abs() + o.y.abs() + o.z.abs() + sight.distance);
        if self.hits.face[i] == NONE || self.hits.t[i] >= reach {
            let medium = scene.medium(sight.inside.top());
            return (scene.media[medium].absorption.range() == [0.0, 0.0]).then_some(1.0);
        }
        let role = scene.roles[self.hits.face[i] as usize];
        match role.act {
            // A sheet decides before all else that lies there.
            Act::Optical(finish) if role.solid == 0 => {
                (!matches!(scene.finishes[finish as usize], Finish::Interface)).then_some(0.0)
            }
            _ => None,
        }
    }
}
