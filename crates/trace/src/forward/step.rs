//! One ray meets what it meets.

use etendue_geometry::hits::Hits;
use etendue_geometry::origin_faces::{NONE, OriginFaces};
use etendue_math::Vec3;
use etendue_sampling::warp::part_of;

use super::block_trace::BlockTrace;
use super::queue::RayQueue;
use crate::detector::{Light, Scatter};
use crate::events::ScatterEvent;
use crate::interaction::interaction_of;
use crate::ledger::Fate;
use crate::ray_state::RayState;
use crate::scatter::SurfaceEvent;
use crate::solid_stack::SolidStack;

/// How a ray goes on, and in which solids.
type Next = Result<((Vec3, Vec3, OriginFaces), SolidStack), Fate>;

impl BlockTrace<'_> {
    /// Takes ray `i` to its next event, from two random numbers: `numbers[0]` decides, one after the other, whether it gets
    /// there, into which component it goes, and at which height, since what is left of a number that has decided is again spread
    /// evenly.
    #[inline]
    pub(super) fn step(
        &mut self,
        now: &RayQueue,
        hits: &Hits,
        i: usize,
        numbers: [f64; 2],
        event: u32,
        next: &mut RayQueue,
    ) {
        let who = now.who[i];
        let mut state = self.states[who as usize];
        let went = self.event(now, hits, i, numbers, event, &mut state);
        let t = if hits.t[i].is_finite() { hits.t[i] } else { self.far };
        self.mark(state.ray, now.lines.origin(i) + now.lines.direction(i) * t);
        match went {
            Ok((line, stack)) => {
                self.states[who as usize] = state;
                next.push(who, line, stack);
            }
            Err(fate) => self.out.ledger.book(fate, state.flux),
        }
    }

    #[inline]
    fn event(
        &mut self,
        now: &RayQueue,
        hits: &Hits,
        i: usize,
        numbers: [f64; 2],
        event: u32,
        state: &mut RayState,
    ) -> Next {
        let scene = self.scene;
        let (d, stack) = (now.lines.direction(i), now.stack[i]);
        let [mut number, turn] = numbers;
        let filling = self.media.at(scene, stack.top(), state.wavelength);
        if filling.absorption > 0.0 {
            let through = (-filling.absorption * hits.t[i]).exp();
            if number >= through {
                return Err(Fate::InMedium(scene.medium(stack.top())));
            }
            number = part_of(number, through);
        }
        if hits.face[i] == NONE {
            self.escape(d, state);
            return Err(Fate::Escaped);
        }
        let (detectors, out) = (self.detectors, &mut self.out.detectors);
        let mut interaction = interaction_of(scene, &now.lines, hits, i, stack, |detector, point, _| {
            // A detector's face may be there without it, as in a survey.
            let number = detector as usize;
            if let Some(detector) = detectors.get(number) {
                detector.passing(&Light { direction: d, state }, point, &mut out[number]);
            }
        })
        .map_err(|(loss, face)| Fate::Lost(loss, face))?;
        if event + 1 >= self.run.most_events {
            return Err(Fate::Terminated);
        }
        interaction.limit_interpolation(event);
        let met = SurfaceEvent::new(scene, &interaction, d, state.wavelength, &mut self.media);
        let Some(met) = met.map_err(|loss| Fate::Lost(loss, interaction.face))? else {
            return Ok(((interaction.point, d, interaction.origin_faces), interaction.after));
        };
        if (self.wants.scatters || self.wants.exitance) && met.bsdf().facts().is_diffuse() {
            self.tell_of_scatter(&met, state);
        }
        let Some((component, d, stack)) = met.sample([number, turn]) else {
            return Err(Fate::OnFace(interaction.face));
        };
        if component.is_specular() {
            // What goes straight on is found backwards, by connections.
            if !(component.is_transmitted() && met.is_straight()) {
                state.go_smoothly(interaction.face, component.is_transmitted());
            }
        } else {
            state.scattered = true;
        }
        Ok(((interaction.point, d, interaction.origin_faces), stack))
    }

    /// Detectors are told of light that meets a diffuse surface.
    fn tell_of_scatter(&mut self, met: &SurfaceEvent<'_>, state: &RayState) {
        let (interaction, d) = (met.interaction(), met.direction());
        let mut scatter = Scatter {
            scene: self.scene,
            media: &mut self.media,
            met,
            event: ScatterEvent::new(interaction, d, [state.flux, state.wavelength], state.ray),
            light: Light { direction: d, state },
        };
        for (detector, out) in self.detectors.iter().zip(&mut self.out.detectors) {
            detector.scatter(&mut scatter, out);
        }
    }
}
