//! What a path does at a diffuse surface: it ends if the light there is known; else it goes on in one direction, and points
//! of the sources are connected to.

use etendue_geometry::hits::{Hits, TIE};
use etendue_math::Vec3;
use etendue_optics::bsdf::{Bsdf, Outward};

use super::method::LeftOut;
use super::path_block::{Branch, Connection, PathBlock, Seen};
use crate::bright_spots::Towards;
use crate::exitance_cells::FacePoint;
use crate::guide::{self, Near};
use crate::mis::{density, power_weight};
use crate::scatter::{Incoming, SurfaceEvent};
use crate::transmittance::transmittance;

/// Diffuse scatters after which paths go on to bright spots: from later ones, a twentieth would at most.
const SPOTS: u32 = 2;

/// Sources up to this number are all connected to at the first diffuse scatter; of more, one is drawn (`LitScene::pick_source`).
const FEW: usize = 8;

/// What is known of the light that a diffuse surface sends out.
pub(super) enum Known<'a> {
    Nothing,
    All,
    /// All but the light of this BSDF.
    But(&'a dyn Bsdf),
}

/// What directions are drawn about by preference.
#[allow(clippy::large_enum_variant, reason = "one at a time, on the stack")]
enum Aim<'a> {
    /// Those that light is known to come from through smooth surfaces.
    Guide(Near<'a>),
    Spots(Towards),
}

impl Aim<'_> {
    /// Of a direction \[1/sr\].
    fn density(&self, k: Vec3) -> f64 {
        match self {
            Self::Guide(near) => near.density(k),
            Self::Spots(spots) => spots.density(k),
        }
    }

    /// A direction from three numbers.
    fn draw(&self, numbers: [f64; 3]) -> Vec3 {
        match self {
            Self::Guide(near) => near.draw(numbers),
            Self::Spots(spots) => spots.draw(numbers),
        }
    }
}

/// How the directions are spread in which paths go on from a diffuse surface.
struct Spread<'a> {
    /// Shares of those that go on on this side of the surface and on the other one, as its BSDF draws them.
    chances: [f64; 2],
    /// Directions by preference, and the share of paths that go on in one of those.
    aim: Option<(Aim<'a>, f64)>,
}

impl Spread<'_> {
    /// Of a direction to where light comes from, with the density \[1/sr\] of its side, or about that.
    #[inline]
    fn density(&self, k: Vec3, light: &Incoming, of_side: f64) -> f64 {
        let drawn = self.chances[usize::from(light.transmitted)] * of_side;
        self.aim
            .as_ref()
            .map_or(drawn, |(aim, share)| (1.0 - share) * drawn + share * aim.density(k))
    }
}

impl PathBlock<'_> {
    /// Takes what a diffuse surface is known to send back along the branch.
    pub(super) fn end<'b>(&mut self, branch: &Branch, event: &SurfaceEvent<'b>) -> Known<'b> {
        let Some(parts) = event.parts().filter(|_| branch.scatters > 0 && !self.known.is_empty()) else {
            return Known::Nothing;
        };
        let interaction = event.interaction();
        let path = self.paths[branch.path as usize];
        let place = FacePoint {
            face: interaction.face,
            part: interaction.part,
            front: interaction.front,
            point: interaction.point,
        };
        // What light that came through smooth surfaces does from here on is left to the light image, if there is one.
        let all = !(self.method.left == LeftOut::Caustics && branch.direct);
        let known = &self.known[self.pass_of(&path).pass];
        let line = branch.selective.then_some(path.line as usize);
        let light = known.at(self.lit, place, branch.travelled, line, all);
        let Some(light) = light else { return Known::Nothing };
        let found = branch.weight * light * event.leaving(parts);
        let path = &mut self.paths[branch.path as usize];
        path.sum[0] += found;
        path.scattered += found;
        parts.rest.map_or(Known::All, |rest| Known::But(&**rest))
    }

    /// A diffuse scatter: connections to sources, and one direction that is drawn. `boost` makes up for the chance that
    /// it came to this.
    pub(super) fn scatter(&mut self, branch: &Branch, event: &SurfaceEvent<'_>, boost: f64) {
        if self.method.left == LeftOut::Scattered && branch.direct && branch.scatters == 0 {
            return;
        }
        let (interaction, outward) = (event.interaction(), event.outward());
        let sides = outward.chances;
        let total = sides[0] + sides[1];
        if total <= 0.0 {
            return;
        }
        let chances = sides.map(|side| side / total);
        let all = branch.scatters == 0 && self.lit.scene.sources.len() <= FEW;
        let mut branch = Branch {
            weight: branch.weight * boost,
            ..*branch
        };
        if branch.scatters == 0 && branch.direct {
            let d = event.direction();
            branch.density = density(self.view, d, branch.travelled, d.dot(interaction.side));
        }
        // The direction has the first numbers, which are the most evenly spread; a side is drawn only where there are two.
        let numbers = self.numbers(branch.path);
        let (turn, height) = (numbers.draw(), numbers.draw());
        let through = chances[1] > 0.0 && numbers.draw() >= chances[0];
        // What the observer sees directly is left to rays traced forwards; the rest is looked for where they came from.
        let guide = self.method.guide.filter(|_| !branch.direct);
        let guide = guide.and_then(|guide| guide.near(interaction.face, interaction.point));
        // Whether to follow a guide is drawn by one of the first numbers: by it few lines find most of the light. With spots, that
        // comes after the numbers of connections, which then are as evenly spread as without.
        let early = guide.is_some().then(|| self.numbers(branch.path).draw());
        let share = guide::share(branch.scatters);
        let aim = guide.map(|near| (Aim::Guide(near), share)).or_else(|| {
            let spots = self.method.spots.filter(|_| branch.scatters < SPOTS)?;
            let towards = spots.towards(interaction.point, interaction.side, chances[1] > 0.0)?;
            let part = towards.part;
            Some((Aim::Spots(towards), part * share))
        });
        let spread = Spread { chances, aim };
        self.reach_out(&branch, (event, &outward), &spread, all);
        let aimed = spread.aim.as_ref().and_then(|(aim, share)| {
            let number = early.unwrap_or_else(|| self.numbers(branch.path).draw()) / share;
            (number < 1.0).then(|| aim.draw([number, height, turn]))
        });
        let k = aimed.unwrap_or_else(|| event.draw_incoming(&outward, through, [height, turn]));
        let (light, density) = event.drawn_from(k, &outward);
        let share = light.f * light.cosine / spread.density(k, &light, density);
        if share > 0.0 {
            let next = Branch {
                stack: light.stack,
                weight: branch.weight * share,
                seen: Seen::Diffuse {
                    density: spread.density(k, &light, light.about),
                    all,
                },
                drawn: false,
                travelled: 0.0,
                scatters: branch.scatters + 1,
                ..branch
            };
            self.push(interaction, k, next);
        }
    }

    /// Notes connections of a diffuse scatter to the sources.
    fn reach_out(
        &mut self,
        branch: &Branch,
        (event, outward): (&SurfaceEvent<'_>, &Outward),
        spread: &Spread<'_>,
        all: bool,
    ) {
        let (scene, interaction) = (self.lit.scene, event.interaction());
        let (which, picked) = if all {
            (0..scene.sources.len(), 1.0)
        } else {
            // Moved at random within the distance of the lines of a pass: on a lattice alone the number of picks of a source
            // would be the same in almost all passes, which tell nothing then of the few where it is another.
            let lines = f64::from(self.method.paths.max(1));
            let numbers = self.numbers(branch.path);
            let number = (numbers.draw() + numbers.aside() / lines).fract();
            let Some((pick, chance)) = self.lit.pick_source(interaction.point, number) else {
                return;
            };
            (pick..pick + 1, chance)
        };
        for number in which {
            let Some(sampler) = &self.lit.light_samplers[number] else {
                continue;
            };
            let source = &scene.sources[number];
            let Some(beacon) = sampler.pick(source, interaction.point, self.numbers(branch.path)) else {
                continue;
            };
            let k = (beacon.point - interaction.point).normalized();
            let light = event.from(k, outward);
            if light.f * light.cosine * beacon.irradiance <= 0.0 {
                continue;
            }
            let mut share = branch.weight * light.f * light.cosine / picked;
            if beacon.density.is_finite() {
                let mine = picked * beacon.density;
                share *= power_weight(mine, spread.density(k, &light, light.about));
            }
            self.shadows.push(interaction.point, k, interaction.origin_faces);
            self.connections.push(Connection {
                path: branch.path,
                source: number,
                selective: branch.selective,
                light: [share * beacon.irradiance, share * beacon.deviation],
                stack: light.stack,
                to: beacon.point,
            });
        }
    }

    /// Looks at the connections of the block: light counts that nothing stands in the way of.
    pub(super) fn connect(&mut self, hits: &mut Hits) {
        let (scene, wavelengths) = (self.lit.scene, &self.lit.wavelengths);
        if self.connections.is_empty() {
            return;
        }
        scene.face_set.nearest(&self.shadows, hits);
        for (i, connection) in self.connections.iter().enumerate() {
            let (o, wavelength) = (self.shadows.origin(i), self.wavelength(connection.path));
            let distance = (connection.to - o).length();
            let absorption = self.media.at(scene, connection.stack.top(), wavelength).absorption;
            let mut selective = connection.selective || wavelengths.are_absorbed_by(scene, connection.stack.top());
            // What lies within rounding of the end is the surface that the end lies on.
            let free = if hits.t[i] >= distance * (1.0 - TIE) {
                if absorption == 0.0 {
                    1.0
                } else {
                    (-absorption * distance).exp()
                }
            } else {
                let origin_faces = self.shadows.origin_faces(i);
                transmittance::<true>(
                    scene,
                    [o, connection.to],
                    origin_faces,
                    connection.stack,
                    &mut self.media,
                    wavelength,
                    |stack, interaction| {
                        selective |= wavelengths.are_absorbed_by(scene, stack.top())
                            || interaction.is_some_and(|met| wavelengths.are_told_at(scene, met));
                    },
                )
            };
            let path = &mut self.paths[connection.path as usize];
            let seen = free * wavelengths.weight(path.line as usize, connection.source, selective);
            for (sum, light) in path.sum.iter_mut().zip(connection.light) {
                *sum += seen * light;
            }
            path.scattered += seen * connection.light[0];
        }
        self.connections.clear();
        self.shadows.clear();
    }
}
