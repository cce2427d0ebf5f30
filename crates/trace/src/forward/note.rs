//! Detectors take note of a ray.

use std::f64::consts::PI;

use etendue_math::Vec3;
use etendue_optics::finish::Incidence;

use crate::detector::{Detector, Portion, illuminance_cell};
use crate::exitance::Place;
use crate::eye::Event;
use crate::guide::Arrival;
use crate::harvest::{Record, Yield};
use crate::meeting::Meeting;
use crate::scene::Scene;

use super::Walk;
use super::flock::Rider;

impl Walk<'_> {
    /// The far field takes note of a ray that leaves the scene.
    pub(super) fn escape(&mut self, d: Vec3, rider: &Rider) {
        for (number, detector) in self.scene.detectors.iter().enumerate() {
            match detector {
                Detector::Intensity(nodes) => {
                    let marks = &mut self.out.marks[number];
                    nodes.share(d, |node, share| marks.push((node, rider.ray, share * rider.flux)));
                }
                Detector::Escapes => self.out.records[number].push(Record {
                    position: [0.0; 3],
                    direction: [d.x, d.y, d.z],
                    flux: rider.flux,
                    wavelength: rider.wavelength,
                }),
                _ => {}
            }
        }
    }

    /// Detectors of scattered light take note.
    pub(super) fn show(&mut self, meeting: &Meeting, finish: u32, light: &Incidence, d: Vec3, rider: &Rider) {
        let event = Event::new(meeting, finish, d, [rider.flux, rider.wavelength], rider.ray);
        for (number, detector) in self.scene.detectors.iter().enumerate() {
            match detector {
                Detector::Image { view, portion } if rider.unseen || *portion == Portion::Whole => {
                    if let Some((pixel, light, density)) = event.seen(self.scene, view, &mut self.fillings) {
                        let share = match portion {
                            Portion::Shared(sharing) => sharing.forwards(density, rider.brightness),
                            Portion::Whole | Portion::Unseen => 1.0,
                        };
                        self.out.marks[number].push((pixel, rider.ray, light * share));
                    }
                }
                Detector::Arrivals if rider.unseen && !rider.scattered && rider.brightness.is_finite() => {
                    self.out.arrivals.push(Arrival {
                        face: meeting.face,
                        point: meeting.point,
                        towards: -d,
                        family: rider.family,
                    });
                }
                Detector::Exitance(patches) => {
                    for through in [false, true] {
                        let share = PI * self.scene.finishes[finish as usize].bsdf(light, through);
                        let place = Place {
                            face: meeting.face,
                            part: meeting.part,
                            front: meeting.front != through,
                            point: meeting.point,
                        };
                        let cell = || patches.cell(self.scene, place, rider.wavelength, rider.unseen);
                        if let Some(cell) = (share > 0.0).then(cell).flatten() {
                            self.out.marks[number].push((cell, rider.ray, rider.flux * share));
                        }
                    }
                }
                Detector::Events { faces, .. }
                    if faces
                        .as_ref()
                        .is_none_or(|faces| faces.get(meeting.face as usize) == Some(&true)) =>
                {
                    self.out.events[number].push(&event, rider.depth);
                }
                _ => {}
            }
        }
    }
}

/// A detector that a ray passes takes note of it.
pub fn detect(scene: &Scene, out: &mut Yield, detector: u32, point: Vec3, d: Vec3, rider: &Rider) {
    let number = detector as usize;
    match &scene.detectors[number] {
        Detector::Rays(_) => out.records[number].push(Record {
            position: [point.x, point.y, point.z],
            direction: [d.x, d.y, d.z],
            flux: rider.flux,
            wavelength: rider.wavelength,
        }),
        Detector::Illuminance {
            frame,
            width,
            height,
            columns,
            rows,
        } => {
            if let Some(cell) = illuminance_cell(frame, [*width, *height], [*columns, *rows], point, d) {
                out.marks[number].push((cell, rider.ray, rider.flux));
            }
        }
        Detector::Escapes
        | Detector::Intensity(_)
        | Detector::Image { .. }
        | Detector::Arrivals
        | Detector::Exitance(_)
        | Detector::Events { .. } => {}
    }
}
