//! A block of paths from the eye, all branches of which take their next steps together.
//!
//! `smooth`: interfaces that many of them meet at once; `scatter`: diffuse surfaces.

mod scatter;
mod smooth;

use std::ops::Range;

use etendue_geometry::assembly::{Hits, TIE};
use etendue_geometry::lines::{Leaving, Lines};
use etendue_geometry::sweep::fill;
use etendue_lightfield::View;
use etendue_lightfield::leave::Sights;
use etendue_math::Vec3;
use etendue_optics::finish::{Finish, Incidence};
use etendue_optics::source::Numbers;
use etendue_sampling::lattice::{DIMENSIONS, lattice_point};
use etendue_sampling::philox::Stream;

use crate::exitance::Exitance;
use crate::glints;
use crate::inside::Inside;
use crate::meeting::{Fillings, Meeting, meet, smooth_shares};
use crate::reverse::{Left, Lit, Method, Pixel};
use crate::start::place;
use smooth::{Room, Sorter};

/// The purposes under which shifts of lattices and events of paths are drawn (see [`Stream::new`]).
const PURPOSE_SHIFT: u64 = 0x5348_4946;
const PURPOSE_PATH: u64 = 0x5041_5448;

/// What is added to a purpose for the paths that look for small images of sources.
const AIMED: u64 = 1 << 32;

/// Chains of smooth surfaces are followed on every branch down to this weight; below, one branch is drawn.
pub const SPLIT: f64 = 1e-4;

/// Diffuse scatters before a path may be ended by chance.
const SURE: u32 = 3;

/// What a branch has seen on its way from the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Seen {
    /// Smooth surfaces, or nothing yet.
    Smooth,
    /// A diffuse surface, and nothing since: the density of its direction there, and whether all sources were connected to.
    Diffuse { density: f64, all: bool },
    /// A diffuse surface, and smooth ones since.
    Caustic,
}

/// What is known of a branch besides its line.
#[derive(Clone, Copy, Debug)]
struct Branch {
    /// Number of its path in the block.
    path: u32,
    inside: Inside,
    weight: f64,
    seen: Seen,
    /// Distance since the last diffuse scatter.
    travelled: f64,
    events: u32,
    scatters: u32,
    /// Whether one of several smooth ways was drawn.
    drawn: bool,
    /// Whether the eye sees the first diffuse surface directly.
    direct: bool,
    /// Density by area with which lines of sight meet that surface there \[1/mm²\].
    density: f64,
}

/// One path: its random numbers, its wavelength, and the light that it has found, with its deviation.
struct Path {
    numbers: Numbers,
    line: usize,
    /// Its pass, counted from the first of those that are made.
    pass: usize,
    sum: [f64; 2],
    /// Of the light, that which was found by chance.
    chance: f64,
    /// Whether it met a smooth surface first, and whether it saw a diffuse one directly.
    met: [bool; 2],
    /// Whether it looks for small images of sources and nothing else.
    aimed: bool,
    /// How much such an image counts, as paths of both kinds find it.
    share: f64,
}

/// A connection of a diffuse surface to a source, that counts if nothing is in between.
struct Connection {
    path: u32,
    light: [f64; 2],
    inside: Inside,
    to: Vec3,
}

/// Paths in one block.
pub const BLOCK: usize = 1024;

/// A block of paths, all branches of which take their next steps together.
pub struct Wave<'a> {
    lit: &'a Lit<'a>,
    view: &'a View,
    method: &'a Method<'a>,
    /// The light of diffuse surfaces, for each pass, if it is known.
    known: &'a [Exitance<'a>],
    fillings: Fillings,
    hits: Hits,
    paths: Vec<Path>,
    /// Branches that are about to take a step, and those that come out of it.
    lines: Lines,
    branches: Vec<Branch>,
    next_lines: Lines,
    next: Vec<Branch>,
    sorter: Sorter,
    room: Room,
    /// How far each branch goes, and whether it may meet a source.
    reach: Vec<f64>,
    marks: Vec<bool>,
    /// Connections that have to be looked at.
    shadows: Lines,
    connections: Vec<Connection>,
    /// What the eye is in, and what it lies on; None if it cannot be anywhere.
    eye: Option<(Inside, Leaving)>,
}

impl<'a> Wave<'a> {
    /// An empty block.
    pub fn new(lit: &'a Lit<'a>, view: &'a View, method: &'a Method<'a>, known: &'a [Exitance<'a>]) -> Self {
        Self {
            lit,
            view,
            method,
            known,
            fillings: Fillings::new(lit.scene),
            hits: Hits::default(),
            paths: Vec::with_capacity(BLOCK),
            lines: Lines::default(),
            branches: Vec::new(),
            next_lines: Lines::default(),
            next: Vec::new(),
            sorter: Sorter::new(lit.scene),
            room: Room::default(),
            reach: Vec::new(),
            marks: Vec::new(),
            shadows: Lines::default(),
            connections: Vec::new(),
            eye: place(lit.scene, view.eye, (view.target - view.eye).normalized()).ok(),
        }
    }

    /// Adds the passes to pixels from number `first` on.
    pub fn paint(&mut self, first: usize, passes: Range<u32>, pixels: &mut [Pixel]) {
        let paths = self.method.paths as usize;
        let share = 1.0 / f64::from(self.method.paths);
        let mut cells = vec![[0.0; 5]; pixels.len() * passes.len()];
        // All cells, then once more those with small images of sources.
        let mut tasks: Vec<(usize, bool)> = (0..cells.len()).map(|cell| (cell, false)).collect();
        if let Some(glints) = self.method.glints {
            let has = |cell: &usize| !glints.of_pixel(first + cell / passes.len()).is_empty();
            tasks.extend((0..cells.len()).filter(has).map(|cell| (cell, true)));
        }
        let total = tasks.len() * paths;
        let mut shift = (usize::MAX, [0.0; DIMENSIONS]);
        let mut begin = 0;
        while begin < total && !self.lit.is_stopped() {
            let end = (begin + BLOCK).min(total);
            self.paths.clear();
            for flat in begin..end {
                let (task, index) = (flat / paths, flat % paths);
                let (cell, aimed) = tasks[task];
                let pixel = (first + cell / passes.len()) as u64;
                #[allow(clippy::cast_possible_truncation, reason = "a number of passes")]
                let pass = (cell % passes.len()) as u32;
                let pass = [passes.start + pass, pass];
                if shift.0 != task {
                    shift = (task, self.shift(pixel, pass[0], aimed));
                }
                #[allow(clippy::cast_possible_truncation, reason = "a number of paths")]
                self.aim(pixel, pass, index as u32, aimed, &shift.1);
            }
            self.follow();
            for (flat, path) in (begin..end).zip(&self.paths) {
                let cell = &mut cells[tasks[flat / paths].0];
                let [smooth, diffuse] = path.met.map(|met| if met { 1.0 } else { 0.0 });
                for (sum, value) in cell
                    .iter_mut()
                    .zip([path.sum[0], path.sum[1], path.chance, smooth, diffuse])
                {
                    *sum += value * share;
                }
            }
            begin = end;
        }
        for (pixel, means) in pixels.iter_mut().zip(cells.chunks(passes.len().max(1))) {
            for [mean, deviation, chance, smooth, diffuse] in means {
                pixel.sum += mean;
                pixel.chance += chance;
                pixel.deviation += deviation;
                pixel.met = [pixel.met[0] + smooth, pixel.met[1] + diffuse];
            }
        }
    }

    /// How the lattice of a pixel is moved in a pass.
    fn shift(&self, pixel: u64, pass: u32, aimed: bool) -> [f64; DIMENSIONS] {
        let shifts = Stream::new(self.method.seed, PURPOSE_SHIFT + if aimed { AIMED } else { 0 });
        let mut shift = [0.0; DIMENSIONS];
        for (block, four) in (0_u64..).zip(shift.chunks_mut(4)) {
            four.copy_from_slice(&shifts.uniforms(pixel, u64::from(pass) << 8 | block));
        }
        shift
    }

    /// A path from the eye through a point of a pixel.
    fn aim(&mut self, pixel: u64, [pass, made]: [u32; 2], index: u32, aimed: bool, shift: &[f64; DIMENSIONS]) {
        let view = self.view;
        let stream = Stream::new(self.method.seed, PURPOSE_PATH + if aimed { AIMED } else { 0 });
        let address = ((pixel << 24 | u64::from(pass)) << 20).wrapping_add(u64::from(index));
        #[allow(clippy::cast_possible_truncation, reason = "a block is short")]
        let path = self.paths.len() as u32;
        // Made where it stays: it is large.
        self.paths.push(Path {
            numbers: Numbers::after(lattice_point(index, shift), stream, address),
            line: 0,
            pass: made as usize,
            sum: [0.0; 2],
            chance: 0.0,
            met: [false; 2],
            aimed,
            share: 1.0,
        });
        let Path {
            numbers, line, share, ..
        } = &mut self.paths[path as usize];
        let columns = u64::from(view.columns);
        let corner = [(pixel % columns) as f64, (pixel / columns) as f64];
        #[allow(clippy::cast_possible_truncation, reason = "a number of a pixel")]
        let images = self
            .method
            .glints
            .map_or(&[][..], |glints| glints.of_pixel(pixel as usize));
        let (du, dv) = (numbers.draw(), numbers.draw());
        let place = if aimed {
            glints::draw(images, [numbers.draw(), du, dv])
        } else {
            [corner[0] + du, corner[1] + dv]
        };
        if !images.is_empty() {
            *share = 1.0 / (1.0 + glints::density(images, place));
        }
        let d = view.through(place);
        let lines = &self.lit.lines;
        if lines.len() > 1 {
            let number = numbers.draw();
            *line = lines.partition_point(|l| l.0 < number).min(lines.len() - 1);
        }
        // What is drawn about an image may lie in another pixel.
        let here = !aimed || (0..2).all(|k| (corner[k]..corner[k] + 1.0).contains(&place[k]));
        if let (Some((inside, leaving)), true) = (self.eye, here) {
            self.lines.push(view.eye, d, leaving);
            self.branches.push(Branch {
                path,
                inside,
                weight: 1.0,
                seen: Seen::Smooth,
                travelled: 0.0,
                events: 0,
                scatters: 0,
                drawn: false,
                direct: true,
                density: 0.0,
            });
        }
    }

    /// Follows all branches of the block to their ends.
    fn follow(&mut self) {
        while !self.branches.is_empty() {
            if self.lit.is_stopped() {
                self.lines.clear();
                self.branches.clear();
                return;
            }
            let mut hits = std::mem::take(&mut self.hits);
            self.lit.scene.assembly.nearest(&self.lines, &mut hits);
            self.gather(&hits);
            self.advance(&hits);
            self.connect(&mut hits);
            self.hits = hits;
            std::mem::swap(&mut self.lines, &mut self.next_lines);
            std::mem::swap(&mut self.branches, &mut self.next);
            self.next_lines.clear();
            self.next.clear();
        }
        self.lines.clear();
    }

    fn wavelength(&self, path: u32) -> f64 {
        self.lit.lines[self.paths[path as usize].line].1
    }

    fn push(&mut self, meeting: &Meeting, d: Vec3, branch: Branch) {
        self.next_lines.push(meeting.point, d, meeting.leaving);
        self.next.push(branch);
    }

    fn step(&mut self, hits: &Hits, i: usize) {
        let scene = self.lit.scene;
        let d = self.lines.direction(i);
        let mut branch = self.branches[i];
        let wavelength = self.wavelength(branch.path);
        let absorption = self.fillings.at(scene, branch.inside.top(), wavelength).absorption;
        let Ok(mut meeting) = meet(scene, &self.lines, hits, i, branch.inside, |_, _, _| {}) else {
            return;
        };
        meeting.limit_interpolation(branch.events);
        branch.events += 1;
        branch.travelled += meeting.t;
        if absorption > 0.0 {
            branch.weight *= (-absorption * meeting.t).exp();
        }
        if branch.events > self.method.most_events || branch.weight == 0.0 {
            return;
        }
        let n1 = self.fillings.at(scene, meeting.before.top(), wavelength).n;
        let n2 = self.fillings.at(scene, meeting.after.top(), wavelength).n;
        let finish = meeting.finish.map(|f| &scene.finishes[f as usize]);
        match finish {
            Some(finish) if !(matches!(finish, Finish::Interface) && n1 == n2) => {
                self.meet(&branch, d, &meeting, finish, [n1, n2]);
            }
            _ => {
                branch.inside = meeting.after;
                self.push(&meeting, d, branch);
            }
        }
    }

    /// Adds the light of sources that branches meet before anything else.
    fn gather(&mut self, hits: &Hits) {
        let scene = self.lit.scene;
        // A source that lies on the surface behind it is in front of it.
        fill(&mut self.reach, hits.t.iter().map(|t| t * (1.0 + TIE)));
        let mut before = 0.0;
        for (number, source) in scene.sources.iter().enumerate() {
            let share = self.lit.shares[number] - before;
            before = self.lit.shares[number];
            let Some(lantern) = &self.lit.lanterns[number] else {
                continue;
            };
            self.marks.clear();
            self.marks.resize(self.branches.len(), false);
            let sights = Sights {
                origin: self.lines.origin.each_ref().map(Vec::as_slice),
                direction: self.lines.direction.each_ref().map(Vec::as_slice),
                reach: &self.reach,
            };
            lantern.mark(source, sights, &mut self.marks);
            for (i, branch) in self.branches.iter().enumerate().filter(|(i, _)| self.marks[*i]) {
                let caustic = branch.seen == Seen::Caustic && branch.direct;
                if caustic && self.method.left == Left::Caustics {
                    continue;
                }
                let (o, d) = (self.lines.origin(i), self.lines.direction(i));
                let path = &mut self.paths[branch.path as usize];
                let small = branch.seen == Seen::Smooth && self.method.glints.is_some_and(|g| g.has(number));
                if path.aimed && !small {
                    continue;
                }
                let shared = if small { path.share } else { 1.0 };
                let (_, wavelength, colour) = &self.lit.lines[path.line];
                let (sum, chance, fillings) = (&mut path.sum, &mut path.chance, &mut self.fillings);
                let rare = branch.drawn && !branch.direct;
                lantern.along(source, o, d, self.reach[i], |lit| {
                    let mut weight = branch.weight * shared * colour[number];
                    let absorption = fillings.at(scene, branch.inside.top(), *wavelength).absorption;
                    if absorption > 0.0 {
                        weight *= (-absorption * lit.t).exp();
                    }
                    if let (true, Left::Shared(sharing)) = (caustic, self.method.left) {
                        weight *= 1.0 - sharing.forwards(branch.density, lit.luminance / self.lit.flux);
                    }
                    if let Seen::Diffuse { density, all } = branch.seen {
                        let distance = branch.travelled + lit.t;
                        let picked = if all { 1.0 } else { share };
                        let other = picked * lit.density * distance * distance / lit.cosine;
                        weight *= density / (density + other);
                    }
                    sum[0] += weight * lit.luminance;
                    sum[1] += weight * lit.deviation;
                    if rare {
                        *chance += weight * lit.luminance;
                    }
                });
            }
        }
    }

    /// Branches at a surface.
    fn meet(&mut self, branch: &Branch, d: Vec3, meeting: &Meeting, finish: &Finish, [n1, n2]: [f64; 2]) {
        let cosine = (-d.dot(meeting.normal)).min(1.0);
        let wavelength = self.wavelength(branch.path);
        let here = Incidence {
            cosine,
            wavelength,
            n1,
            n2,
        };
        let (smooth, shares, across) = smooth_shares(finish, &here);
        let seen = if branch.seen == Seen::Smooth {
            Seen::Smooth
        } else {
            Seen::Caustic
        };
        let go = |wave: &mut Self, transmitted: bool, weight: f64, drawn: bool| {
            let d = if transmitted {
                meeting.refracted(d, cosine, n1 / n2, across)
            } else {
                meeting.mirrored(d, cosine)
            };
            let branch = Branch {
                inside: if transmitted { meeting.after } else { meeting.before },
                weight,
                seen,
                drawn: branch.drawn || drawn,
                direct: branch.direct && branch.scatters > 0,
                ..*branch
            };
            wave.push(meeting, d, branch);
        };
        if branch.seen == Seen::Smooth {
            let met = &mut self.paths[branch.path as usize].met;
            met[0] |= smooth != [0.0; 2];
            met[1] |= branch.direct && finish.is_diffuse();
        }
        let aimed = self.paths[branch.path as usize].aimed;
        let diffuse = !aimed && finish.is_diffuse() && !self.end(branch, meeting, finish);
        // Chains of smooth surfaces branch; everything else is drawn.
        if branch.seen == Seen::Smooth && branch.weight > SPLIT {
            for (transmitted, share) in [(false, smooth[0]), (true, smooth[1])] {
                if share > 0.0 {
                    go(self, transmitted, branch.weight * share, false);
                }
            }
            if diffuse {
                self.scatter(branch, d, meeting, finish, [n1, n2], 1.0);
            }
            return;
        }
        // What goes on is drawn by the shares of the flux; radiance carries its factor (n₁/n₂)² besides. Whatever the diffuse
        // share is from here, light may be scattered to here from elsewhere.
        let scattered = if diffuse {
            (shares[2] + shares[3]).max(0.05)
        } else {
            0.0
        };
        let total = shares[0] + shares[1] + scattered;
        let mortal = branch.scatters > SURE || branch.weight <= SPLIT;
        let alive = if mortal { total.min(1.0) } else { 1.0 };
        let number = self.paths[branch.path as usize].numbers.draw();
        if total <= 0.0 || number >= alive {
            return;
        }
        let number = number * total / alive;
        let boost = total / alive;
        if number < shares[0] {
            go(self, false, branch.weight * boost, true);
        } else if number < shares[0] + shares[1] {
            go(self, true, branch.weight * smooth[1] / shares[1] * boost, true);
        } else if diffuse {
            self.scatter(branch, d, meeting, finish, [n1, n2], boost / scattered);
        }
    }
}
