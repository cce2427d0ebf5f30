//! One ray meets what it meets.

use etendue_geometry::assembly::Hits;
use etendue_geometry::lines::{Leaving, NONE};
use etendue_math::Vec3;
use etendue_optics::finish::{Finish, Incidence, Lobe, part_of, pick};
use etendue_optics::source::surface::about;

use crate::detector::Detector;
use crate::guide::family;
use crate::inside::Inside;
use crate::ledger::Fate;
use crate::meeting::{Loss, Meeting, meet};

use super::Walk;
use super::flock::{Flock, Rider};
use super::note::detect;

/// How a ray goes on, and in which solids.
type Next = Result<((Vec3, Vec3, Leaving), Inside), Fate>;

impl Walk<'_> {
    /// Takes ray `i` to its next event, from two random numbers: `numbers[0]` decides, one after the other, whether it gets
    /// there, into which lobe it goes, and at which height, since what is left of a number that has decided is again spread
    /// evenly.
    #[inline]
    pub(super) fn step(&mut self, now: &Flock, hits: &Hits, i: usize, numbers: [f64; 2], event: u32, next: &mut Flock) {
        let who = now.who[i];
        let mut rider = self.riders[who as usize];
        let went = self.event(now, hits, i, numbers, event, &mut rider);
        let t = if hits.t[i].is_finite() { hits.t[i] } else { self.far };
        self.mark(rider.ray, now.lines.origin(i) + now.lines.direction(i) * t);
        match went {
            Ok((line, inside)) => {
                self.riders[who as usize] = rider;
                next.push(who, line, inside);
            }
            Err(fate) => self.out.ledger.book(fate, rider.flux),
        }
    }

    #[inline]
    fn event(&mut self, now: &Flock, hits: &Hits, i: usize, numbers: [f64; 2], event: u32, rider: &mut Rider) -> Next {
        let scene = self.scene;
        let (d, inside) = (now.lines.direction(i), now.inside[i]);
        let [mut number, turn] = numbers;
        let filling = self.fillings.at(scene, inside.top(), rider.wavelength);
        if filling.absorption > 0.0 {
            let through = (-filling.absorption * hits.t[i]).exp();
            if number >= through {
                return Err(Fate::InMedium(scene.medium(inside.top())));
            }
            number = part_of(number, through);
        }
        if hits.face[i] == NONE {
            self.escape(d, rider);
            return Err(Fate::Escaped);
        }
        let out = &mut self.out;
        let mut meeting = meet(scene, &now.lines, hits, i, inside, |detector, point, _| {
            detect(scene, out, detector, point, d, rider);
        })
        .map_err(|(loss, face)| Fate::Lost(loss, face))?;
        if event + 1 >= self.run.most_events {
            return Err(Fate::Terminated);
        }
        meeting.limit_interpolation(event);
        match meeting.finish {
            None => Ok(((meeting.point, d, meeting.leaving), meeting.after)),
            Some(finish) => self.scatter(&meeting, finish, d, [number, turn], rider),
        }
    }

    #[inline]
    fn scatter(
        &mut self,
        meeting: &Meeting,
        number: u32,
        d: Vec3,
        [choice, turn]: [f64; 2],
        rider: &mut Rider,
    ) -> Next {
        let scene = self.scene;
        let finish = &scene.finishes[number as usize];
        let light = Incidence {
            cosine: (-d.dot(meeting.normal)).min(1.0),
            wavelength: rider.wavelength,
            n1: self.fillings.at(scene, meeting.before.top(), rider.wavelength).n,
            n2: self.fillings.at(scene, meeting.after.top(), rider.wavelength).n,
        };
        if !(light.n1 > 0.0 && light.n2 > 0.0) {
            return Err(Fate::Lost(Loss::NoIndex, meeting.face));
        }
        if finish.is_diffuse() && scene.detectors.iter().any(Detector::watches_scatter) {
            self.show(meeting, number, &light, d, rider);
        }
        let (shares, across) = finish.shares(&light);
        let Some((lobe, height)) = pick(&shares, choice) else {
            return Err(Fate::OnFace(meeting.face));
        };
        // Smooth surfaces before the first diffuse one; an interface of equal media is none.
        let nothing = matches!(finish, Finish::Interface) && light.n1 == light.n2;
        if lobe.is_specular() && !rider.scattered && !nothing {
            rider.unseen = true;
            rider.family = family(rider.family, meeting.face, lobe.is_transmission());
        }
        rider.scattered |= !lobe.is_specular();
        let d = match lobe {
            Lobe::SpecularReflection => meeting.mirrored(d, light.cosine),
            Lobe::SpecularTransmission => meeting.refracted(d, light.cosine, light.n1 / light.n2, across),
            // Diffuse light is spread about the surface itself, so that none of it starts behind it.
            Lobe::DiffuseReflection => about(meeting.side, (1.0 - height).sqrt(), turn),
            Lobe::DiffuseTransmission => about(-meeting.side, (1.0 - height).sqrt(), turn),
        };
        let inside = if lobe.is_transmission() {
            meeting.after
        } else {
            meeting.before
        };
        Ok(((meeting.point, d, meeting.leaving), inside))
    }
}
