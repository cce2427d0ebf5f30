//! From the eye to the sources.
//!
//! A path starts at the eye, through a point of the pixel. While it meets smooth surfaces only, all its branches are followed:
//! that part of the image has no noise but that of the places within the pixel and of sources that err. At a diffuse surface
//! one direction is drawn, and points of the sources are connected to; a direction that both could find is shared out
//! between them by the balance heuristic `[Veach1995]`.
//!
//! Radiance grows by (n₁/n₂)² on its way from a medium of index n₂ into one of n₁.

use std::ops::Range;

use etendue_geometry::assembly::Leaving;
use etendue_lightfield::View;
use etendue_math::Vec3;
use etendue_optics::finish::{Finish, Incidence};
use etendue_optics::source::surface::about;
use etendue_optics::source::{Lantern, Numbers};
use etendue_sampling::lattice::{DIMENSIONS, lattice_point};
use etendue_sampling::philox::Stream;
use rayon::prelude::*;

use crate::inside::Inside;
use crate::meeting::{Fillings, Meeting, meet_one, place, transmittance};
use crate::scene::Scene;

/// The purposes under which shifts of lattices and events of paths are drawn (see [`Stream::new`]).
const PURPOSE_SHIFT: u64 = 0x5348_4946;
const PURPOSE_PATH: u64 = 0x5041_5448;

/// Chains of smooth surfaces are followed on every branch down to this weight; below, one branch is drawn.
const SPLIT: f64 = 1e-4;

/// Diffuse scatters before a path may be ended by chance.
const SURE: u32 = 3;

/// Sources up to this number are all connected to at the first diffuse scatter; of more, one is drawn by its flux.
const FEW: usize = 8;

/// A scene with what its sources need to be looked at.
#[derive(Clone, Debug)]
pub struct Lit<'a> {
    scene: &'a Scene,
    /// None for those that cannot be seen backwards.
    lanterns: &'a [Option<Lantern>],
    /// Sums of the shares of the sources' flux.
    shares: Vec<f64>,
    /// Wavelengths: sum of the shares, the wavelength, and how much of each source's flux has it, over its share.
    lines: Vec<(f64, f64, Vec<f64>)>,
}

/// How a map is computed.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Paths per pixel in each of the independent passes.
    pub paths: u32,
    /// Seed.
    pub seed: u64,
    /// Events that a path may have before it is ended.
    pub most_events: u32,
    /// Whether light that reaches a diffuse surface through smooth ones, and from there the eye directly or over other
    /// diffuse ones, is left to the light image.
    pub without_caustics: bool,
}

/// Sums over passes: of the mean of each pass, of its square, and of the sources' own deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Σ mean.
    pub sum: f64,
    /// Σ mean².
    pub squares: f64,
    /// Σ deviation.
    pub deviation: f64,
}

/// What each source needs to be seen: None for those that cannot be.
#[must_use]
pub fn lanterns(scene: &Scene) -> Vec<Option<Lantern>> {
    scene.sources.iter().map(Lantern::new).collect()
}

impl<'a> Lit<'a> {
    /// A scene and the lanterns of its sources.
    #[must_use]
    pub fn new(scene: &'a Scene, lanterns: &'a [Option<Lantern>]) -> Self {
        let total: f64 = scene.sources.iter().map(|s| s.flux).sum();
        let mut wavelengths: Vec<f64> = scene
            .sources
            .iter()
            .flat_map(|s| s.spectrum.iter().map(|l| l.0))
            .collect();
        wavelengths.sort_by(f64::total_cmp);
        wavelengths.dedup();
        let (mut lines, mut sum) = (Vec::new(), 0.0);
        for wavelength in wavelengths {
            // The share of each source's flux at this wavelength.
            let own: Vec<f64> = scene
                .sources
                .iter()
                .map(|s| {
                    let mut below = 0.0;
                    let mut share = 0.0;
                    for (line, up_to) in &s.spectrum {
                        if *line == wavelength {
                            share += up_to - below;
                        }
                        below = *up_to;
                    }
                    share
                })
                .collect();
            let share: f64 = own.iter().zip(&scene.sources).map(|(o, s)| o * s.flux / total).sum();
            sum += share;
            lines.push((sum, wavelength, own.into_iter().map(|o| o / share).collect()));
        }
        let mut below = 0.0;
        let shares = scene.sources.iter().map(|s| {
            below += s.flux / total;
            below
        });
        Self {
            scene,
            lanterns,
            shares: shares.collect(),
            lines,
        }
    }

    /// The map of `view`: for each pixel the sums over passes `passes`. Passes are independent of each other.
    ///
    /// Runs on the threads of the current pool; the same bits for any number.
    #[must_use]
    pub fn look(&self, view: &View, method: &Method, passes: Range<u32>) -> Vec<Pixel> {
        let mut pixels = vec![Pixel::default(); view.pixels()];
        let chunk = 16;
        pixels.par_chunks_mut(chunk).enumerate().for_each(|(block, pixels)| {
            let mut path = Path::new(self, method);
            for (offset, pixel) in pixels.iter_mut().enumerate() {
                for pass in passes.clone() {
                    let [mean, deviation] = path.pixel(view, (block * chunk + offset) as u64, pass);
                    pixel.sum += mean;
                    pixel.squares += mean * mean;
                    pixel.deviation += deviation;
                }
            }
        });
        pixels
    }
}

/// What a branch has seen on its way from the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Seen {
    /// Smooth surfaces, or nothing yet.
    Smooth,
    /// A diffuse surface, and nothing since: the density of its direction there, and the distance from there.
    Diffuse { density: f64, travelled: f64, all: bool },
    /// A diffuse surface, and smooth ones since.
    Caustic,
}

#[derive(Clone, Copy, Debug)]
struct Branch {
    o: Vec3,
    d: Vec3,
    leaving: Leaving,
    inside: Inside,
    weight: f64,
    seen: Seen,
    events: u32,
    scatters: u32,
    /// Whether the eye sees the first diffuse surface directly.
    direct: bool,
}

struct Path<'a> {
    lit: &'a Lit<'a>,
    method: &'a Method,
    fillings: Fillings,
    branches: Vec<Branch>,
    wavelength: f64,
    /// Each source's flux at the wavelength, over the chance that it was drawn.
    colour: &'a [f64],
    numbers: Numbers,
    sum: [f64; 2],
}

impl<'a> Path<'a> {
    fn new(lit: &'a Lit<'a>, method: &'a Method) -> Self {
        Self {
            lit,
            method,
            fillings: Fillings::new(lit.scene),
            branches: Vec::new(),
            wavelength: f64::NAN,
            colour: &[],
            numbers: Numbers::new(Stream::new(method.seed, PURPOSE_PATH), 0, 0),
            sum: [0.0; 2],
        }
    }

    /// Mean luminance of a pixel over one pass, and its deviation.
    fn pixel(&mut self, view: &View, pixel: u64, pass: u32) -> [f64; 2] {
        let columns = u64::from(view.columns);
        let (row, column) = ((pixel / columns) as f64, (pixel % columns) as f64);
        let shifts = Stream::new(self.method.seed, PURPOSE_SHIFT);
        let mut shift = [0.0; DIMENSIONS];
        for (block, four) in shift.chunks_mut(4).enumerate() {
            four.copy_from_slice(&shifts.uniforms(pixel, u64::from(pass) << 8 | block as u64));
        }
        let stream = Stream::new(self.method.seed, PURPOSE_PATH);
        let mut total = [0.0; 2];
        for index in 0..self.method.paths {
            let point = lattice_point(index, &shift);
            let address = (pixel << 24 | u64::from(pass)) << 20;
            self.numbers = Numbers::after(point, stream, address.wrapping_add(u64::from(index)));
            let (du, dv) = (self.numbers.draw(), self.numbers.draw());
            let u = ((column + du) / f64::from(view.columns) - 0.5) * view.width;
            let v = (0.5 - (row + dv) / f64::from(view.rows)) * view.height;
            let through = view.target + view.right * u + view.up * v;
            self.paint(view.eye, (through - view.eye).normalized());
            total = [total[0] + self.sum[0], total[1] + self.sum[1]];
        }
        let share = 1.0 / f64::from(self.method.paths);
        [total[0] * share, total[1] * share]
    }

    /// Follows one path with all its branches.
    fn paint(&mut self, eye: Vec3, d: Vec3) {
        let lines = &self.lit.lines;
        let line = if lines.len() == 1 {
            &lines[0]
        } else {
            let number = self.numbers.draw();
            &lines[lines.partition_point(|l| l.0 < number).min(lines.len() - 1)]
        };
        self.wavelength = line.1;
        self.colour = &line.2;
        self.sum = [0.0; 2];
        let Ok((inside, leaving)) = place(self.lit.scene, eye, d) else {
            return;
        };
        self.branches.push(Branch {
            o: eye,
            d,
            leaving,
            inside,
            weight: 1.0,
            seen: Seen::Smooth,
            events: 0,
            scatters: 0,
            direct: true,
        });
        while let Some(branch) = self.branches.pop() {
            self.follow(branch);
        }
    }

    fn follow(&mut self, branch: Branch) {
        let scene = self.lit.scene;
        let Ok(met) = meet_one(scene, branch.o, branch.d, &branch.leaving, f64::INFINITY, branch.inside) else {
            return;
        };
        let reach = met.as_ref().map_or(f64::INFINITY, |m| m.t);
        let absorption = self.fillings.at(scene, branch.inside.top(), self.wavelength).absorption;
        self.gather(&branch, reach, absorption);
        let Some(meeting) = met else { return };
        let mut branch = branch;
        branch.events += 1;
        if absorption > 0.0 {
            branch.weight *= (-absorption * meeting.t).exp();
        }
        if branch.events > self.method.most_events || branch.weight == 0.0 {
            return;
        }
        let index = |fillings: &mut Fillings, inside: Inside| fillings.at(scene, inside.top(), self.wavelength).n;
        let n1 = index(&mut self.fillings, meeting.before);
        let n2 = index(&mut self.fillings, meeting.after);
        let finish = meeting.finish.map(|f| &scene.finishes[f as usize]);
        match finish {
            Some(finish) if !(matches!(finish, Finish::Interface) && n1 == n2) => {
                self.meet(&branch, &meeting, finish, n1, n2);
            }
            _ => {
                if let Seen::Diffuse { travelled, .. } = &mut branch.seen {
                    *travelled += meeting.t;
                }
                self.branches.push(Branch {
                    o: meeting.point,
                    leaving: meeting.leaving,
                    inside: meeting.after,
                    ..branch
                });
            }
        }
    }

    /// Adds the light of sources that the branch meets before `reach`.
    fn gather(&mut self, branch: &Branch, reach: f64, absorption: f64) {
        let scene = self.lit.scene;
        if branch.seen == Seen::Caustic && self.method.without_caustics && branch.direct {
            return;
        }
        // A source that lies on the surface behind it is in front of it.
        let reach = reach * (1.0 + 1e-12);
        for (number, source) in scene.sources.iter().enumerate() {
            let Some(lantern) = &self.lit.lanterns[number] else {
                continue;
            };
            let flux = self.colour[number];
            let before = if number == 0 { 0.0 } else { self.lit.shares[number - 1] };
            let share = self.lit.shares[number] - before;
            let sum = &mut self.sum;
            lantern.along(source, branch.o, branch.d, reach, |lit| {
                let mut weight = branch.weight * flux;
                if absorption > 0.0 {
                    weight *= (-absorption * lit.t).exp();
                }
                if let Seen::Diffuse {
                    density,
                    travelled,
                    all,
                } = branch.seen
                {
                    let distance = travelled + lit.t;
                    let picked = if all { 1.0 } else { share };
                    let other = picked * lit.density * distance * distance / lit.cosine;
                    weight *= density / (density + other);
                }
                sum[0] += weight * lit.luminance;
                sum[1] += weight * lit.deviation;
            });
        }
    }

    /// Branches at a surface.
    fn meet(&mut self, branch: &Branch, meeting: &Meeting, finish: &Finish, n1: f64, n2: f64) {
        let cosine = (-branch.d.dot(meeting.normal)).min(1.0);
        let wavelength = self.wavelength;
        let here = Incidence {
            cosine,
            wavelength,
            n1,
            n2,
        };
        let (shares, across) = finish.shares(&here);
        // Light that is transmitted to the eye arrives from the other side, at the angle of refraction.
        let through = if shares[1] > 0.0 {
            let there = Incidence {
                cosine: across,
                wavelength,
                n1: n2,
                n2: n1,
            };
            finish.shares(&there).0[1] * (n1 / n2) * (n1 / n2)
        } else {
            0.0
        };
        let smooth = [shares[0], through];
        let seen = if branch.seen == Seen::Smooth {
            Seen::Smooth
        } else {
            Seen::Caustic
        };
        let go = |transmitted: bool, weight: f64| {
            let d = if transmitted {
                meeting.refracted(branch.d, cosine, n1 / n2, across)
            } else {
                meeting.mirrored(branch.d, cosine)
            };
            Branch {
                o: meeting.point,
                d,
                leaving: meeting.leaving,
                inside: if transmitted { meeting.after } else { meeting.before },
                weight,
                seen,
                direct: branch.direct && branch.scatters > 0,
                ..*branch
            }
        };
        let diffuse = [shares[2], shares[3]];
        let sum = smooth[0] + smooth[1] + diffuse[0] + diffuse[1];
        if sum <= 0.0 && !finish.is_diffuse() {
            return;
        }
        // Chains of smooth surfaces branch; everything else is drawn.
        let split = branch.seen == Seen::Smooth && branch.weight > SPLIT;
        if split {
            for (transmitted, share) in [(false, smooth[0]), (true, smooth[1])] {
                if share > 0.0 {
                    self.branches.push(go(transmitted, branch.weight * share));
                }
            }
            if finish.is_diffuse() {
                self.scatter(branch, meeting, finish, n1, n2, 1.0);
            }
            return;
        }
        // What survives is drawn by the shares of the flux; radiance carries its factor (n₁/n₂)² besides.
        let chances = [
            shares[0],
            shares[1],
            if finish.is_diffuse() {
                (diffuse[0] + diffuse[1]).max(0.05)
            } else {
                0.0
            },
        ];
        let total: f64 = chances.iter().sum();
        let alive = if branch.scatters > SURE || branch.weight <= SPLIT {
            total.min(1.0)
        } else {
            1.0
        };
        let mut number = self.numbers.draw();
        if total <= 0.0 || number >= alive {
            return;
        }
        number *= total / alive;
        if number < chances[0] {
            self.branches
                .push(go(false, branch.weight * smooth[0] / chances[0] * total / alive));
        } else if number < chances[0] + chances[1] {
            self.branches
                .push(go(true, branch.weight * smooth[1] / chances[1] * total / alive));
        } else if chances[2] > 0.0 {
            self.scatter(branch, meeting, finish, n1, n2, total / (alive * chances[2]));
        }
    }

    /// A diffuse scatter: connections to sources, and one direction that is drawn. `boost` makes up for the chance that
    /// it came to this.
    fn scatter(&mut self, branch: &Branch, meeting: &Meeting, finish: &Finish, n1: f64, n2: f64, boost: f64) {
        let wavelength = self.wavelength;
        // How much may come from each side: the shares at the angle of the eye stand for those at the unknown angle.
        let sides = {
            let at = |cosine, n1, n2, through| {
                std::f64::consts::PI
                    * finish.bsdf(
                        &Incidence {
                            cosine,
                            wavelength,
                            n1,
                            n2,
                        },
                        through,
                    )
            };
            let probe = |n1, n2, through| {
                [0.9, 0.5, 0.1]
                    .map(|c| at(c, n1, n2, through))
                    .into_iter()
                    .fold(0.0, f64::max)
            };
            [probe(n1, n2, false), probe(n2, n1, true)]
        };
        let total = sides[0] + sides[1];
        if total <= 0.0 {
            return;
        }
        let transmits = [sides[0] / total, sides[1] / total];
        let first = branch.scatters == 0;
        let all = first && self.lit.scene.sources.len() <= FEW;
        let weight = branch.weight * boost;
        self.connect(meeting, finish, [n1, n2], weight, transmits, all);

        let (side, turn, height) = (self.numbers.draw(), self.numbers.draw(), self.numbers.draw());
        let through = side >= transmits[0];
        let chance = transmits[usize::from(through)];
        let normal = if through { -meeting.side } else { meeting.side };
        let cosine = (1.0 - height).sqrt();
        let light = Incidence {
            cosine,
            wavelength,
            n1: if through { n2 } else { n1 },
            n2: if through { n1 } else { n2 },
        };
        let share = std::f64::consts::PI * finish.bsdf(&light, through);
        if share > 0.0 {
            self.branches.push(Branch {
                o: meeting.point,
                d: about(normal, cosine, turn),
                leaving: meeting.leaving,
                inside: if through { meeting.after } else { meeting.before },
                weight: weight * share / chance,
                seen: Seen::Diffuse {
                    density: chance * cosine * std::f64::consts::FRAC_1_PI,
                    travelled: 0.0,
                    all,
                },
                scatters: branch.scatters + 1,
                ..*branch
            });
        }
    }

    /// Connects a diffuse scatter to the sources.
    fn connect(
        &mut self,
        meeting: &Meeting,
        finish: &Finish,
        [n1, n2]: [f64; 2],
        weight: f64,
        transmits: [f64; 2],
        all: bool,
    ) {
        let scene = self.lit.scene;
        let numbers = if all {
            0..scene.sources.len()
        } else {
            let number = self.numbers.draw();
            let pick = self
                .lit
                .shares
                .partition_point(|s| *s < number)
                .min(scene.sources.len() - 1);
            pick..pick + 1
        };
        for number in numbers {
            let Some(lantern) = &self.lit.lanterns[number] else {
                continue;
            };
            let picked = if all {
                1.0
            } else {
                let before = if number == 0 { 0.0 } else { self.lit.shares[number - 1] };
                self.lit.shares[number] - before
            };
            let source = &scene.sources[number];
            let Some(beacon) = lantern.pick(source, meeting.point, &mut self.numbers) else {
                continue;
            };
            let k = (beacon.point - meeting.point).normalized();
            let height = k.dot(meeting.side);
            let through = height < 0.0;
            let cosine = height.abs();
            let light = Incidence {
                cosine,
                wavelength: self.wavelength,
                n1: if through { n2 } else { n1 },
                n2: if through { n1 } else { n2 },
            };
            let bsdf = finish.bsdf(&light, through);
            if bsdf * cosine * beacon.irradiance <= 0.0 {
                continue;
            }
            let inside = if through { meeting.after } else { meeting.before };
            let free = transmittance(
                scene,
                meeting.point,
                beacon.point,
                meeting.leaving,
                inside,
                &mut self.fillings,
                self.wavelength,
            );
            if free == 0.0 {
                continue;
            }
            let mut share = weight * self.colour[number] * bsdf * cosine * free / picked;
            if beacon.density.is_finite() {
                let (mine, other) = (
                    picked * beacon.density,
                    transmits[usize::from(through)] * cosine * std::f64::consts::FRAC_1_PI,
                );
                share *= mine / (mine + other);
            }
            self.sum[0] += share * beacon.irradiance;
            self.sum[1] += share * beacon.deviation;
        }
    }
}
