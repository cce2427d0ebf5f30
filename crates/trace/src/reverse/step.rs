//! One branch meets what it meets: sources on its way, and the surface behind them.

use etendue_geometry::hits::Hits;
use etendue_geometry::shape::size;
use etendue_geometry::surface_points::fill;
use etendue_lightfield::carrier::Sights;
use etendue_math::Vec3;

use super::diffuse::Known;
use super::method::LeftOut;
use super::path_block::{Branch, Path, PathBlock, PixelPass, Seen};
use crate::glints::{Glints, led_on};
use crate::interaction::interaction_of;
use crate::mis::power_weight;
use crate::scatter::{SPLIT, SurfaceEvent};
use crate::scene::START;

/// Diffuse scatters before a path may be ended by chance.
const SURE: u32 = 3;

/// How many times its share the rest of a surface whose light is known in part is followed: more lines of less weight err less,
/// down to where the light before it errs as much. Of 1, 2, 4 and 8 it did best for satin paint and for a table.
const REST: f64 = 4.0;

/// The part of diffuse light that goes on at least.
const LEAST: f64 = 0.05;

impl PathBlock<'_> {
    #[allow(clippy::cast_possible_truncation, reason = "weights that are only told of")]
    pub(super) fn step(&mut self, hits: &Hits, i: usize) {
        let scene = self.lit.scene;
        let d = self.lines.direction(i);
        let mut branch = self.branches[i];
        let wavelength = self.wavelength(branch.path);
        let absorption = self.media.at(scene, branch.stack.top(), wavelength).absorption;
        branch.selective |= self.lit.wavelengths.are_absorbed_by(scene, branch.stack.top());
        let Ok(mut interaction) = interaction_of(scene, &self.lines, hits, i, branch.stack, |_, _, _| {}) else {
            self.paths[branch.path as usize].lost += branch.weight as f32;
            return;
        };
        interaction.limit_interpolation(branch.events);
        branch.events += 1;
        branch.travelled += interaction.t;
        if absorption > 0.0 {
            branch.weight *= (-absorption * interaction.t).exp();
        }
        if branch.events > self.method.most_events {
            self.paths[branch.path as usize].given_up += branch.weight as f32;
            return;
        }
        if branch.weight == 0.0 {
            return;
        }
        branch.selective |= self.lit.wavelengths.are_told_at(scene, &interaction);
        match SurfaceEvent::new(scene, &interaction, d, wavelength, &mut self.media) {
            Err(_) => self.paths[branch.path as usize].lost += branch.weight as f32,
            Ok(Some(event)) => self.surface_event(&branch, &event),
            Ok(None) => {
                branch.stack = interaction.after;
                self.push(&interaction, d, branch);
            }
        }
    }

    /// Adds the light of sources that branches meet before anything else.
    #[allow(clippy::cast_possible_truncation, reason = "a length that rounding bounds")]
    pub(super) fn gather(&mut self, hits: &Hits) {
        let scene = self.lit.scene;
        // A source that lies on a surface, but for rounding, is met on the way there and not again on the way from it.
        let [x, y, z] = &self.lines.origin;
        let starts = hits.t.iter().zip(x.iter().zip(y).zip(z));
        fill(
            &mut self.reach,
            starts.map(|(t, ((x, y), z))| t + START * (size(Vec3::new(*x, *y, *z)) + t)),
        );
        for (number, source) in scene.sources.iter().enumerate() {
            let Some(sampler) = &self.lit.light_samplers[number] else {
                continue;
            };
            let Self {
                lines,
                reach,
                branches,
                passes,
                paths,
                method,
                marks,
                marked,
                reader,
                media,
                lit,
                ..
            } = self;
            marks.clear();
            marks.resize(branches.len(), false);
            let sights = Sights {
                origin: lines.origin.each_ref().map(Vec::as_slice),
                direction: lines.direction.each_ref().map(Vec::as_slice),
                reach,
            };
            sampler.mark(source, sights, marks);
            let glints = method.glints.filter(|glints| glints.has(number));
            // What is seen large in the same pixel is no small image, though seen beside one.
            let is_small = |branch: &Branch, path: &Path| {
                let PixelPass { pixel, aimed, .. } = passes[path.pass as usize];
                let small = |glints: &&Glints| !glints.is_large(pixel, number, branch.ways);
                branch.seen == Seen::Smooth && (aimed || path.share < 1.0) && glints.as_ref().is_some_and(small)
            };
            let is_caustic = |branch: &Branch| branch.seen == Seen::Caustic && branch.direct;
            let counts = |branch: &Branch| {
                let elsewhere = is_caustic(branch) && method.left == LeftOut::Caustics;
                let path = &paths[branch.path as usize];
                !elsewhere && (!passes[path.pass as usize].aimed || is_small(branch, path))
            };
            let numbers = (0_u32..).zip(branches.iter().zip(&*marks));
            let those = numbers.filter(|(_, (branch, mark))| **mark && counts(branch));
            fill(marked, those.map(|(i, _)| i));
            sampler.along_all(source, sights, marked, reader, |i, hit| {
                let branch = &branches[i];
                if hit.t <= f64::from(branch.behind) {
                    return;
                }
                let path = &mut paths[branch.path as usize];
                let shared = if is_small(branch, path) { path.share } else { 1.0 };
                let (line, top) = (path.line as usize, branch.stack.top());
                let selective = branch.selective || lit.wavelengths.are_absorbed_by(scene, top);
                let mut weight = branch.weight * shared * lit.wavelengths.weight(line, number, selective);
                let absorption = media.at(scene, top, lit.wavelengths.at(line)).absorption;
                if absorption > 0.0 {
                    weight *= (-absorption * hit.t).exp();
                }
                if let (true, LeftOut::Shared(balance)) = (is_caustic(branch), method.left) {
                    weight *= 1.0 - balance.forwards(branch.density, hit.luminance / lit.flux);
                }
                if let Seen::Diffuse { density, all } = branch.seen {
                    let distance = branch.travelled + hit.t;
                    // Where the branch was scattered: faces that do nothing to light may lie in between.
                    let picked = if all {
                        1.0
                    } else {
                        lit.pick_chance(number, lines.origin(i) - lines.direction(i) * branch.travelled)
                    };
                    let other = picked * hit.density() * distance * distance / hit.cosine;
                    weight *= power_weight(density, other);
                }
                path.sum[0] += weight * hit.luminance;
                path.sum[1] += weight * hit.deviation;
                if branch.scatters > 0 {
                    path.scattered += weight * hit.luminance;
                }
                if branch.drawn && !branch.direct {
                    path.chance += weight * hit.luminance;
                }
            });
        }
        for ((branch, reach), t) in self.branches.iter_mut().zip(&self.reach).zip(&hits.t) {
            branch.behind = (reach - t) as f32;
        }
    }

    /// Branches at a surface.
    fn surface_event(&mut self, branch: &Branch, event: &SurfaceEvent<'_>) {
        let facts = event.bsdf().facts();
        let is_specular = facts.specular != [false; 2];
        let (smooth, shares) = if is_specular { event.seen() } else { Default::default() };
        // Connections to sources go straight through sheets, too: of such ways both know the density.
        let seen = |transmitted: bool| match branch.seen {
            Seen::Smooth => Seen::Smooth,
            Seen::Diffuse { .. } if transmitted && event.is_straight() => branch.seen,
            _ => Seen::Caustic,
        };
        // One of the ways on, which all are followed; or the one that was drawn.
        let go = |block: &mut Self, transmitted: bool, weight: f64, share: Option<f64>| {
            let (d, stack) = if transmitted {
                event.refracted(shares.refraction)
            } else {
                event.mirrored()
            };
            let branch = Branch {
                stack,
                weight,
                seen: seen(transmitted),
                drawn: branch.drawn || share.is_none(),
                ways: led_on(branch.ways, transmitted),
                direct: branch.direct && branch.scatters > 0,
                ..*branch
            };
            block.push_if_followed(event.interaction(), d, branch, share.unwrap_or(1.0));
        };
        let is_diffuse = facts.is_diffuse();
        if branch.seen == Seen::Smooth {
            let met = &mut self.paths[branch.path as usize].met;
            met[0] |= smooth != [0.0; 2];
            met[1] |= branch.direct && is_diffuse;
        }
        let aimed = self.pass_of(&self.paths[branch.path as usize]).aimed;
        // What scatters light that is still to be looked for.
        let (known, left) = if aimed || !is_diffuse {
            (false, None)
        } else {
            match self.end(branch, event) {
                Known::Nothing => (false, Some(*event)),
                Known::All => (true, None),
                Known::But(rest) => (true, Some(event.of(rest))),
            }
        };
        // Chains of smooth surfaces branch; everything else is drawn.
        if branch.seen == Seen::Smooth && branch.weight > SPLIT {
            for (transmitted, factor, share) in [
                (false, smooth[0], shares.specular[0]),
                (true, smooth[1], shares.specular[1]),
            ] {
                go(self, transmitted, branch.weight * factor, Some(share));
            }
            if let Some(left) = &left {
                self.scatter(branch, left, 1.0);
            }
            return;
        }
        let mortal = branch.scatters > SURE || branch.weight <= SPLIT || known;
        // What goes on is drawn by the shares of the flux; radiance carries its factor (n₁/n₂)² besides. Whatever the diffuse
        // share is from here, light may be scattered to here from elsewhere. A single way that is sure needs no share.
        let scattered = match &left {
            None => 0.0,
            Some(_) if !mortal && !is_specular => 1.0,
            Some(left) => {
                let [one, other] = if known || !is_specular { left.shares() } else { shares }.diffuse;
                (one + other).max(LEAST)
            }
        };
        let [mirrored, refracted] = shares.specular;
        let total = mirrored + refracted + scattered;
        let alive = if known { REST * total } else { total };
        let alive = if mortal { alive.min(1.0) } else { 1.0 };
        let number = self.numbers(branch.path).draw();
        if total <= 0.0 || number >= alive {
            return;
        }
        let number = number * total / alive;
        let boost = total / alive;
        if number < mirrored {
            go(self, false, branch.weight * boost, None);
        } else if number < mirrored + refracted {
            go(self, true, branch.weight * smooth[1] / refracted * boost, None);
        } else if let Some(left) = &left {
            self.scatter(branch, left, boost / scattered);
        }
    }
}
