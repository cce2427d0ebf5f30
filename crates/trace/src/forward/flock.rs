//! Rays on their way, and the sorting of them by what comes next.

use etendue_geometry::assembly::Hits;
use etendue_geometry::lines::{Leaving, Lines};
use etendue_math::Vec3;

use crate::inside::Inside;
use crate::lists::Lists;
use crate::scene::Scene;

use super::bounce::Bouncer;

/// What a ray carries.
#[derive(Clone, Copy, Debug)]
pub struct Rider {
    /// \[flux unit\].
    pub flux: f64,
    /// \[nm\].
    pub wavelength: f64,
    /// Its number in the run.
    pub ray: u64,
    /// Whether it has met a diffuse surface.
    pub scattered: bool,
    /// Whether the reverse tracer does not find it, or leaves it to the light image.
    pub unseen: bool,
    /// Luminance of the source where it started, over the flux of all sources \[1/(mm² sr)\], if a detector asks for it; ∞ if
    /// lines of sight cannot meet it.
    pub brightness: f64,
    /// Which source it came from and through which smooth surfaces, as a number that few others share.
    pub family: u32,
    /// How often the kept events can be thinned before those of this ray are dropped.
    pub depth: u32,
}

/// Rays on their way. Structure of arrays.
#[derive(Default)]
pub struct Flock {
    pub lines: Lines,
    /// The rider of each.
    pub who: Vec<u32>,
    pub inside: Vec<Inside>,
}

impl Flock {
    pub fn len(&self) -> usize {
        self.who.len()
    }

    pub fn is_empty(&self) -> bool {
        self.who.is_empty()
    }

    pub fn clear(&mut self) {
        self.lines.clear();
        self.who.clear();
        self.inside.clear();
    }

    /// Rays more that start on one face, or on none, outside of all solids.
    pub fn extend(
        &mut self,
        o: [&[f64]; 3],
        d: [&[f64]; 3],
        who: impl Iterator<Item = u32>,
        face: u32,
        parts: impl ExactSizeIterator<Item = u32>,
    ) {
        self.lines.extend(o, d, face, parts);
        self.who.extend(who);
        self.inside.resize(self.who.len(), Inside::default());
    }

    /// One ray more.
    #[inline(always)]
    pub fn push(&mut self, who: u32, (o, d, leaving): (Vec3, Vec3, Leaving), inside: Inside) {
        self.lines.push(o, d, leaving);
        self.who.push(who);
        self.inside.push(inside);
    }
}

/// Sorts the rays of a flock by what comes next.
#[derive(Default)]
pub struct Sorter {
    /// For each face, and for none, the number of the list of most rays that meet it: [`GONE`], [`SINGLE`], or from [`FIRST`] on
    /// for faces off which many are bounced at once.
    list_of: Vec<usize>,
    bouncers: Vec<Bouncer>,
    lists: Lists,
    /// For each ray whether it may be at more than one face.
    tied: Vec<bool>,
    /// Whether rays that leave each solid's medium cannot be absorbed on their way; the surroundings first.
    clear: Vec<bool>,
}

/// The list of rays that leave the scene.
const GONE: usize = 0;

/// The list of rays that are worked on one by one.
const SINGLE: usize = 1;

/// The list of the first bouncer.
const FIRST: usize = 2;

impl Sorter {
    /// Of a scene, and those of its faces off which many rays are bounced at once.
    #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^16 solids")]
    pub fn new(scene: &Scene, bouncers: Vec<Bouncer>) -> Self {
        let solids = 0..=scene.solids.len();
        let clear = |solid: usize| scene.media[scene.medium(solid as u16)].absorption.range() == [0.0, 0.0];
        let clear: Vec<bool> = solids.map(clear).collect();
        let mut list_of = vec![SINGLE; scene.roles.len() + 1];
        list_of[scene.roles.len()] = if clear[0] { GONE } else { SINGLE };
        for (list, bouncer) in (FIRST..).zip(&bouncers) {
            list_of[bouncer.face as usize] = list;
        }
        Self {
            list_of,
            lists: Lists::new(FIRST + bouncers.len()),
            bouncers,
            tied: Vec::new(),
            clear,
        }
    }

    /// Sorts the rays of a flock. Rays that have had all the events that they may have (`ended`) are not bounced, nor those in
    /// a solid or at more than one face.
    pub fn sort(&mut self, flock: &Flock, hits: &Hits, ended: bool) {
        self.lists.clear();
        hits.ties(&flock.lines, &mut self.tied);
        let faces = self.list_of.len() - 1;
        for i in 0..flock.len() {
            let face = (hits.face[i] as usize).min(faces);
            let mut list = self.list_of[face];
            // Few rays are special: their branch costs nothing, and none is on the way of the others.
            let nested = flock.inside[i] != Inside::default();
            if nested | ended | self.tied[i] {
                let leaves = face == faces && self.clear[usize::from(flock.inside[i].top())];
                list = if leaves { GONE } else { SINGLE };
            }
            self.lists.push(list, i);
        }
        self.lists.join_short(FIRST, SINGLE);
    }

    /// Places of the rays that meet nothing and cannot be absorbed on their way.
    pub fn gone(&self) -> &[u32] {
        self.lists.get(GONE)
    }

    /// Places of the rays that are worked on one by one.
    pub fn single(&self) -> &[u32] {
        self.lists.get(SINGLE)
    }

    /// Places of the rays that are bounced, face by face.
    pub fn bounced(&self) -> impl Iterator<Item = (Bouncer, &[u32])> {
        let bouncer = |list: usize| self.bouncers.get(list.checked_sub(FIRST)?);
        self.lists
            .used()
            .filter_map(move |(list, places)| Some((*bouncer(list)?, places)))
    }
}
