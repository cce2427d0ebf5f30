//! A diffuse scatter, connected to the eye of an observer: the light image, at once or from stored events.

use etendue_geometry::assembly::Leaving;
use etendue_lightfield::View;
use etendue_math::Vec3;
use etendue_optics::finish::Incidence;
use rayon::prelude::*;

use crate::harvest::{Cell, gather};
use crate::inside::Inside;
use crate::meeting::{Fillings, Meeting, transmittance};
use crate::scene::Scene;

/// Light that was scattered diffusely: what is needed to look at it later, from anywhere.
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
    /// The surface, its part and its finish.
    pub face: u32,
    /// The part of the face.
    pub part: u32,
    /// Its finish.
    pub finish: u32,
    /// The solids on the side of the light.
    pub before: Inside,
    /// The solids on the other side.
    pub after: Inside,
    /// Whether the reverse tracer does not find the ray, or leaves it to the light image.
    pub unseen: bool,
}

impl Event {
    /// The scatter of a ray at a meeting.
    #[must_use]
    pub fn new(meeting: &Meeting, finish: u32, direction: Vec3, [flux, wavelength]: [f64; 2], ray: u64) -> Self {
        Self {
            point: meeting.point,
            side: meeting.side,
            direction,
            flux,
            wavelength,
            ray,
            face: meeting.face,
            part: meeting.part,
            finish,
            before: meeting.before,
            after: meeting.after,
            unseen: false,
        }
    }

    /// The pixel in which the scatter is seen, and what it adds to the luminance there; None if it is not.
    ///
    /// Flux Φ on an element gives it the intensity I = Φ f cos θ towards the eye at distance s. Through a pixel of area A at
    /// distance p, whose normal is turned by θₚ, that is the luminance I/s² · p²/(A cos θₚ).
    #[must_use]
    pub fn seen(&self, scene: &Scene, view: &View, leaving: Leaving, fillings: &mut Fillings) -> Option<(u32, f64)> {
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
        let inside = if through { self.after } else { self.before };
        let share = transmittance(scene, self.point, view.eye, leaving, inside, fillings, self.wavelength);
        let t = (view.target - view.eye).dot(view.normal) / k.dot(view.normal);
        let area = view.width * view.height / view.pixels() as f64;
        let weight = bsdf * cosine.abs() / (distance * distance) * (t * t) / (area * k.dot(view.normal).abs());
        (share > 0.0).then_some((pixel, self.flux * share * weight))
    }
}

/// Events in one unit of work.
const CHUNK: usize = 1 << 14;

/// The light image of stored events, on the threads of the current pool; the same bits for any number of them.
///
/// Contributions of one ray to one pixel are taken together if its events lie in the same stretch of 2¹⁴ events.
#[must_use]
pub fn look_at_events(scene: &Scene, events: &[Event], view: &View, complement: bool) -> Vec<Cell> {
    let parts: Vec<Vec<(u32, u64, f64)>> = events
        .par_chunks(CHUNK)
        .map(|events| {
            let mut fillings = Fillings::new(scene);
            let wanted = events.iter().filter(|e| e.unseen || !complement);
            wanted
                .filter_map(|event| {
                    let mut leaving = Leaving::default();
                    leaving.add(event.face, event.part);
                    let (pixel, light) = event.seen(scene, view, leaving, &mut fillings)?;
                    Some((pixel, event.ray, light))
                })
                .collect()
        })
        .collect();
    let mut cells = vec![Cell::default(); view.pixels()];
    for marks in parts {
        gather(&mut cells, marks);
    }
    cells
}
