//! What a path does at a diffuse surface: it ends if the light there is known; else it goes on in one direction, and points
//! of the sources are connected to.

use std::f64::consts::{FRAC_1_PI, PI};

use etendue_geometry::assembly::{Hits, TIE};
use etendue_math::Vec3;
use etendue_optics::finish::{Finish, Incidence};
use etendue_optics::source::surface::about;

use super::{Branch, Connection, Seen, Wave};
use crate::exitance::Place;
use crate::guide::{Near, SHARE};
use crate::meeting::{Meeting, transmittance};
use crate::reverse::Left;
use crate::sharing::density;

/// Sources up to this number are all connected to at the first diffuse scatter; of more, one is drawn by its flux.
const FEW: usize = 8;

/// How the directions are spread in which paths go on from a diffuse surface.
struct Spread<'a> {
    /// Shares of those that go on in front of the surface and behind it, by the cosine law.
    chances: [f64; 2],
    /// Directions that light is known to come from.
    guide: Option<Near<'a>>,
}

impl Spread<'_> {
    /// Density of a direction \[1/sr\] on a side of the surface, at an angle to its normal with this cosine.
    #[inline]
    fn density(&self, d: Vec3, through: bool, cosine: f64) -> f64 {
        let even = self.chances[usize::from(through)] * cosine * FRAC_1_PI;
        self.guide
            .as_ref()
            .map_or(even, |near| (1.0 - SHARE) * even + SHARE * near.density(d))
    }
}

impl Wave<'_> {
    /// Takes what a diffuse surface is known to send back along the branch; false if that is not known.
    pub(super) fn end(&mut self, branch: &Branch, meeting: &Meeting, finish: &Finish) -> bool {
        if branch.scatters == 0 || self.known.is_empty() || !finish.is_diffuse() {
            return false;
        }
        let path = &mut self.paths[branch.path as usize];
        let place = Place {
            face: meeting.face,
            part: meeting.part,
            front: meeting.front,
            point: meeting.point,
        };
        // What light that came through smooth surfaces does from here on is left to the light image, if there is one.
        let all = !(self.method.left == Left::Caustics && branch.direct);
        let light = self.known[path.pass].at(self.lit.scene, place, branch.travelled, path.line, all);
        if let Some(light) = light {
            path.sum[0] += branch.weight * light;
        }
        light.is_some()
    }

    /// A diffuse scatter: connections to sources, and one direction that is drawn. `boost` makes up for the chance that
    /// it came to this.
    pub(super) fn scatter(
        &mut self,
        branch: &Branch,
        d: Vec3,
        meeting: &Meeting,
        finish: &Finish,
        n: [f64; 2],
        boost: f64,
    ) {
        if self.method.left == Left::Scattered && branch.direct && branch.scatters == 0 {
            return;
        }
        let wavelength = self.wavelength(branch.path);
        let [n1, n2] = n;
        let sides = [(false, n1, n2), (true, n2, n1)].map(|(through, n1, n2)| {
            // How much may come from each side: the angle at which it does is not known yet.
            let at = |cosine| {
                let light = Incidence {
                    cosine,
                    wavelength,
                    n1,
                    n2,
                };
                finish.bsdf(&light, through)
            };
            [0.9, 0.5, 0.1].map(at).into_iter().fold(0.0, f64::max)
        });
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
            branch.density = density(self.view, d, branch.travelled, d.dot(meeting.side));
        }
        // The direction has the first numbers, which are the most evenly spread; a side is drawn only where there are two.
        let numbers = &mut self.paths[branch.path as usize].numbers;
        let (turn, height) = (numbers.draw(), numbers.draw());
        let through = chances[1] > 0.0 && numbers.draw() >= chances[0];
        // What the eye sees directly is left to rays traced forwards; the rest is looked for where they came from.
        let guide = self.method.guide.filter(|_| !branch.direct);
        let guide = guide.and_then(|guide| guide.near(meeting.face, meeting.point));
        let spread = Spread { chances, guide };
        let guided = guide.and_then(|near| {
            let numbers = &mut self.paths[branch.path as usize].numbers;
            let number = numbers.draw() / SHARE;
            (number < 1.0).then(|| near.draw([number, height, turn]))
        });
        self.reach_out(&branch, meeting, finish, n, &spread, all);

        let (d, through, cosine) = guided.map_or_else(
            || {
                let cosine = (1.0 - height).sqrt();
                let normal = if through { -meeting.side } else { meeting.side };
                (about(normal, cosine, turn), through, cosine)
            },
            |d| {
                let height = d.dot(meeting.side);
                (d, height < 0.0, height.abs())
            },
        );
        let light = Incidence {
            cosine,
            wavelength,
            n1: if through { n2 } else { n1 },
            n2: if through { n1 } else { n2 },
        };
        let density = spread.density(d, through, cosine);
        let share = if guide.is_some() {
            finish.bsdf(&light, through) * cosine / density
        } else {
            // The cosine cancels.
            PI * finish.bsdf(&light, through) / chances[usize::from(through)]
        };
        if share > 0.0 {
            let next = Branch {
                inside: if through { meeting.after } else { meeting.before },
                weight: branch.weight * share,
                seen: Seen::Diffuse { density, all },
                drawn: false,
                travelled: 0.0,
                scatters: branch.scatters + 1,
                ..branch
            };
            self.push(meeting, d, next);
        }
    }

    /// Notes connections of a diffuse scatter to the sources.
    fn reach_out(
        &mut self,
        branch: &Branch,
        meeting: &Meeting,
        finish: &Finish,
        [n1, n2]: [f64; 2],
        spread: &Spread<'_>,
        all: bool,
    ) {
        let scene = self.lit.scene;
        let path = &mut self.paths[branch.path as usize];
        let (_, wavelength, colour) = &self.lit.lines[path.line];
        let which = if all {
            0..scene.sources.len()
        } else {
            let number = path.numbers.draw();
            let last = scene.sources.len().saturating_sub(1);
            let pick = self.lit.shares.partition_point(|s| *s < number).min(last);
            pick..scene.sources.len().min(pick + 1)
        };
        for number in which {
            let Some(lantern) = &self.lit.lanterns[number] else {
                continue;
            };
            let before = if number == 0 { 0.0 } else { self.lit.shares[number - 1] };
            let picked = if all { 1.0 } else { self.lit.shares[number] - before };
            let source = &scene.sources[number];
            let Some(beacon) = lantern.pick(source, meeting.point, &mut path.numbers) else {
                continue;
            };
            let k = (beacon.point - meeting.point).normalized();
            let height = k.dot(meeting.side);
            let through = height < 0.0;
            let cosine = height.abs();
            let light = Incidence {
                cosine,
                wavelength: *wavelength,
                n1: if through { n2 } else { n1 },
                n2: if through { n1 } else { n2 },
            };
            let bsdf = finish.bsdf(&light, through);
            if bsdf * cosine * beacon.irradiance <= 0.0 {
                continue;
            }
            let mut share = branch.weight * colour[number] * bsdf * cosine / picked;
            if beacon.density.is_finite() {
                let mine = picked * beacon.density;
                share *= mine / (mine + spread.density(k, through, cosine));
            }
            self.shadows.push(meeting.point, k, meeting.leaving);
            self.connections.push(Connection {
                path: branch.path,
                light: [share * beacon.irradiance, share * beacon.deviation],
                inside: if through { meeting.after } else { meeting.before },
                to: beacon.point,
            });
        }
    }

    /// Looks at the connections of the block: light counts that nothing stands in the way of.
    pub(super) fn connect(&mut self, hits: &mut Hits) {
        let scene = self.lit.scene;
        if self.connections.is_empty() {
            return;
        }
        scene.assembly.nearest(&self.shadows, hits);
        for (i, connection) in self.connections.iter().enumerate() {
            let (o, wavelength) = (
                self.shadows.origin(i),
                self.lit.lines[self.paths[connection.path as usize].line].1,
            );
            let distance = (connection.to - o).length();
            let absorption = self.fillings.at(scene, connection.inside.top(), wavelength).absorption;
            // What lies within rounding of the end is the surface that the end lies on.
            let free = if hits.t[i] >= distance * (1.0 - TIE) {
                if absorption == 0.0 {
                    1.0
                } else {
                    (-absorption * distance).exp()
                }
            } else {
                let leaving = self.shadows.leaving(i);
                transmittance(
                    scene,
                    o,
                    connection.to,
                    leaving,
                    connection.inside,
                    &mut self.fillings,
                    wavelength,
                )
            };
            let sum = &mut self.paths[connection.path as usize].sum;
            *sum = [sum[0] + free * connection.light[0], sum[1] + free * connection.light[1]];
        }
        self.connections.clear();
        self.shadows.clear();
    }
}
