//! Interfaces of solids that many branches meet at once: each of them goes on mirrored and refracted, or on one of both ways.
//!
//! What `interaction` and the surface event of `step` come to there, without branches and several lines at a time.

use etendue_geometry::hits::Hits;
use etendue_geometry::origin_faces::NONE;
use etendue_geometry::ray_block::RayBlock;
use etendue_geometry::surface_points::{Vectors, choose, fill, gather, surface_points};
use etendue_math::Vec3;
use etendue_math::heads::{heads, heads_mut};
use etendue_optics::fresnel::{fresnel, reflect, refract};
use multiversion::multiversion;

use super::path_block::{Branch, PathBlock, Seen};
use crate::buckets::Buckets;
use crate::glints::led_on;
use crate::lit_scene::LitScene;
use crate::medium_cache::MediumCache;
use crate::scatter::SPLIT;
use crate::scene::Scene;
use crate::solid_stack::SolidStack;

/// Sorts branches by the faces that they meet.
struct Sorter {
    /// For each face whether it is an interface of a solid that branches are split at many at a time.
    splits: Vec<bool>,
    /// Places of the branches that are, by the number of their face and 1.
    lists: Buckets,
    tied: Vec<bool>,
}

/// The list of branches that are worked on one by one.
const SINGLE: usize = 0;

impl Sorter {
    fn new(scene: &Scene) -> Self {
        Self {
            splits: scene.interfaces(),
            lists: Buckets::new(scene.roles.len() + 1),
            tied: Vec::new(),
        }
    }

    /// Sorts branches; those that meet nothing are left out.
    fn sort(&mut self, branches: &[Branch], lines: &RayBlock, hits: &Hits, most_events: u32) {
        self.lists.clear();
        hits.ties(lines, &mut self.tied);
        for (i, branch) in branches.iter().enumerate() {
            let face = hits.face[i];
            if face == NONE {
                continue;
            }
            let split = self.splits[face as usize] && !self.tied[i] && branch.events < most_events;
            self.lists.push(if split { face as usize + 1 } else { SINGLE }, i);
        }
        self.lists.join_short(SINGLE + 1, SINGLE);
    }
}

/// What lies on both sides of an interface, for a line that crosses it.
#[derive(Clone, Copy)]
struct Sides {
    before: SolidStack,
    after: SolidStack,
    n: [f64; 2],
    /// 1 if the line enters the solid, −1 if it leaves it.
    sign: f64,
    /// Absorption coefficient of the medium that it comes through \[1/mm\].
    absorption: f64,
    /// Whether that medium or the interface treats wavelengths differently.
    selective: bool,
}

impl Sides {
    /// None if the face is hidden there, or the line goes on as if nothing were there, or cannot.
    fn new(
        lit: &LitScene<'_>,
        solid: u16,
        before: SolidStack,
        wavelength: f64,
        media: &mut MediumCache,
    ) -> Option<Self> {
        let (scene, wavelengths) = (lit.scene, &lit.wavelengths);
        let after = before.crossed(solid)?;
        let [here, there] = [before, after].map(|stack| media.at(scene, stack.top(), wavelength));
        let meets = solid >= before.top().min(after.top()) && here.n > 0.0 && there.n > 0.0 && here.n != there.n;
        meets.then_some(Self {
            before,
            after,
            n: [here.n, there.n],
            sign: if before.contains(solid) { -1.0 } else { 1.0 },
            absorption: here.absorption,
            selective: wavelengths.are_absorbed_by(scene, before.top())
                || wavelengths.are_bent_by(scene, before.top())
                || wavelengths.are_bent_by(scene, after.top()),
        })
    }
}

/// Branches that meet one face, gathered, and what becomes of them. Structure of arrays.
#[derive(Default)]
struct SplitScratch {
    which: Vec<u32>,
    /// What lies on both sides, for each that is different; and which of them it is.
    kinds: Vec<Sides>,
    kind: Vec<u32>,
    sign: Vec<f64>,
    n: [Vec<f64>; 2],
    t: Vec<f64>,
    part: Vec<u32>,
    points: Vectors,
    normals: Vectors,
    /// Where they come along and where they are mirrored to.
    mirrored: Vectors,
    refracted: Vectors,
    /// Shares of the flux that go on mirrored and refracted; NaN where the normal contradicts what the line is in.
    shares: [Vec<f64>; 2],
    /// Those of them that go on either way, and what is known of them there.
    going: [Vec<u32>; 2],
    branches: [Vec<Branch>; 2],
    sorted: [Vectors; 2],
}

/// Takes branches to their next events, those that meet one interface together.
pub struct Splitter {
    sorter: Sorter,
    scratch: SplitScratch,
}

impl Splitter {
    /// For a scene.
    pub fn new(scene: &Scene) -> Self {
        Self {
            sorter: Sorter::new(scene),
            scratch: SplitScratch::default(),
        }
    }

    /// Takes all branches to their next events.
    pub(super) fn advance(&mut self, block: &mut PathBlock<'_>, hits: &Hits) {
        let Self { sorter, scratch } = self;
        sorter.sort(&block.branches, &block.lines, hits, block.method.most_events);
        for (list, which) in sorter.lists.used().filter(|(list, _)| *list != SINGLE) {
            block.split(list - 1, which, hits, scratch);
        }
        for i in sorter.lists.get(SINGLE) {
            block.step(hits, *i as usize);
        }
    }
}

impl PathBlock<'_> {
    /// Splits branches at an interface of a solid.
    fn split(&mut self, number: usize, which: &[u32], hits: &Hits, scratch: &mut SplitScratch) {
        self.look_around(self.lit.scene.roles[number].solid, which, hits, scratch);
        choose(&mut scratch.t, &hits.t, &scratch.which);
        fill(
            &mut scratch.part,
            scratch.which.iter().map(|i| hits.part[*i as usize].0),
        );
        let write = |list: &mut Vec<f64>, value: fn(&Sides) -> f64| match &scratch.kinds[..] {
            [all] => fill(list, std::iter::repeat_n(value(all), scratch.which.len())),
            kinds => fill(list, scratch.kind.iter().map(|kind| value(&kinds[*kind as usize]))),
        };
        write(&mut scratch.sign, |sides| sides.sign);
        write(&mut scratch.n[0], |sides| sides.n[0]);
        write(&mut scratch.n[1], |sides| sides.n[1]);
        gather(&mut scratch.points, &self.lines.origin, &scratch.which);
        gather(&mut scratch.mirrored, &self.lines.direction, &scratch.which);
        let surface = &self.lit.scene.face_set.faces()[number];
        surface_points(
            surface,
            &mut scratch.points,
            &scratch.mirrored,
            &scratch.t,
            &scratch.part,
            &mut scratch.normals,
        );
        refract_all(scratch);
        self.send_on(hits, scratch);
        for (way, directions) in [(1, &scratch.refracted), (0, &scratch.mirrored)] {
            self.next.append(&mut scratch.branches[way]);
            let [points, ways] = &mut scratch.sorted;
            gather(points, &scratch.points, &scratch.going[way]);
            gather(ways, directions, &scratch.going[way]);
            let [o, d] = [points, ways].map(|lists| lists.each_ref().map(|list| &list[..]));
            #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^32 faces")]
            let face = number as u32;
            let parts = scratch.going[way].iter().map(|k| scratch.part[*k as usize]);
            self.next_lines.extend(o, d, face, parts);
        }
    }

    /// Branches at an interface go on mirrored and refracted, or on one of both ways.
    fn send_on(&mut self, hits: &Hits, scratch: &mut SplitScratch) {
        scratch.going.iter_mut().for_each(Vec::clear);
        for (k, i) in scratch.which.iter().enumerate() {
            let mut shares = [scratch.shares[0][k], scratch.shares[1][k]];
            if shares[0].is_nan() {
                self.step(hits, *i as usize);
                continue;
            }
            let mut branch = self.branches[*i as usize];
            if branch.seen == Seen::Smooth {
                self.paths[branch.path as usize].met[0] = true;
            }
            branch.events += 1;
            branch.travelled += scratch.t[k];
            branch.direct &= branch.scatters > 0;
            let sides = &scratch.kinds[scratch.kind[k] as usize];
            branch.selective |= sides.selective;
            if sides.absorption > 0.0 {
                branch.weight *= (-sides.absorption * scratch.t[k]).exp();
            }
            if branch.seen != Seen::Smooth {
                branch.seen = Seen::Caustic;
            }
            if branch.seen != Seen::Smooth || branch.weight <= SPLIT {
                // One of both ways is drawn by its share of the flux.
                branch.drawn = true;
                let mirrored = self.numbers(branch.path).draw() < shares[0];
                shares = if mirrored { [1.0, 0.0] } else { [0.0, 1.0] };
            }
            let ratio = sides.n[0] / sides.n[1];
            for (transmitted, share) in [(false, shares[0]), (true, shares[1])] {
                let Some(thinned) = self.followed(&branch, share) else {
                    continue;
                };
                // Radiance carries its factor (n₁/n₂)² besides.
                let (factor, stack) = if transmitted {
                    (share * (ratio * ratio), sides.after)
                } else {
                    (share, sides.before)
                };
                let on = Branch {
                    weight: branch.weight * factor,
                    ways: led_on(branch.ways, transmitted),
                    stack,
                    ..branch
                };
                if on.weight > 0.0 {
                    scratch.branches[usize::from(transmitted)].push(on.thinned_to(thinned));
                    #[allow(clippy::cast_possible_truncation, reason = "a block is short")]
                    scratch.going[usize::from(transmitted)].push(k as u32);
                }
            }
        }
    }

    /// Finds what lies on both sides of a face of a solid for each of some branches; those for which it is no interface are
    /// worked on by themselves.
    fn look_around(&mut self, solid: u16, which: &[u32], hits: &Hits, scratch: &mut SplitScratch) {
        scratch.which.clear();
        scratch.kinds.clear();
        scratch.kind.clear();
        // Nearly all come from one or two sides.
        let mut seen: Vec<(SolidStack, f64, Option<u32>)> = Vec::new();
        for i in which {
            let branch = &self.branches[*i as usize];
            let (stack, wavelength) = (branch.stack, self.wavelength(branch.path));
            let known = seen
                .iter()
                .rev()
                .find(|known| known.0 == stack && known.1 == wavelength);
            let kind = if let Some((.., kind)) = known {
                *kind
            } else {
                let kind = Sides::new(self.lit, solid, stack, wavelength, &mut self.media).map(|sides| {
                    scratch.kinds.push(sides);
                    #[allow(clippy::cast_possible_truncation, reason = "a block is short")]
                    {
                        scratch.kinds.len() as u32 - 1
                    }
                });
                seen.push((stack, wavelength, kind));
                kind
            };
            if let Some(kind) = kind {
                scratch.which.push(*i);
                scratch.kind.push(kind);
            } else {
                self.step(hits, *i as usize);
            }
        }
    }
}

/// Directions and shares of what is mirrored and refracted.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn refract_all(scratch: &mut SplitScratch) {
    let n = scratch.t.len();
    for list in scratch.refracted.iter_mut().chain(&mut scratch.shares) {
        list.resize(n, 0.0);
    }
    let [dx, dy, dz] = heads_mut(&mut scratch.mirrored, n);
    let [rx, ry, rz] = heads_mut(&mut scratch.refracted, n);
    let [back, through] = heads_mut(&mut scratch.shares, n);
    let [nx, ny, nz] = heads(&scratch.normals, n);
    let [n1, n2] = heads(&scratch.n, n);
    let sign = &scratch.sign[..n];
    for k in 0..n {
        let d = Vec3::new(dx[k], dy[k], dz[k]);
        let side = Vec3::new(nx[k], ny[k], nz[k]) * sign[k];
        let height = -d.dot(side);
        let cosine = if height < 1.0 { height } else { 1.0 };
        let f = fresnel(cosine, n1[k], n2[k]);
        let mirrored = reflect(d, side, cosine);
        let refracted = refract(d, side, cosine, n1[k] / n2[k], f.cosine);
        (dx[k], dy[k], dz[k]) = (mirrored.x, mirrored.y, mirrored.z);
        (rx[k], ry[k], rz[k]) = (refracted.x, refracted.y, refracted.z);
        let agrees = (height > 0.0) | ((height == 0.0) & (sign[k] < 0.0));
        back[k] = if agrees { f.reflectance } else { f64::NAN };
        through[k] = 1.0 - f.reflectance;
    }
}
