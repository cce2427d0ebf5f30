//! Rays sorted by what comes next.

use etendue_geometry::Face;
use etendue_geometry::hits::Hits;

use super::lambertian_sheet::LambertianSheet;
use super::queue::RayQueue;
use super::scattering_sheet::ScatteringSheet;
use crate::buckets::Buckets;
use crate::detector::Wants;
use crate::scene::{Act, Role, Scene};
use crate::solid_stack::SolidStack;

/// A face off which many rays are bounced at once.
#[derive(Clone, Copy, Debug)]
pub enum Sheet<'a> {
    /// A plain wall.
    Lambertian(LambertianSheet),
    /// Any other that lets nothing through.
    Scattering(ScatteringSheet<'a>),
}

impl Sheet<'_> {
    /// Its number.
    const fn face(&self) -> u32 {
        match self {
            Self::Lambertian(sheet) => sheet.face,
            Self::Scattering(sheet) => sheet.face,
        }
    }
}

/// The faces of a scene off which rays are bounced many at a time: flat shaded sheets that let nothing through.
#[must_use]
pub fn sheets(scene: &Scene, wants: Wants) -> Vec<Sheet<'_>> {
    // Detectors of scattered light and absorbing surroundings want to know of every scatter by itself.
    if wants.scatters || scene.media[0].absorption.range() != [0.0, 0.0] {
        return Vec::new();
    }
    let faces = scene.face_set.faces().iter().zip(&scene.roles).zip(0..);
    let sheet = |((face, role), index): ((&Face, &Role), u32)| {
        let Act::Optical(finish) = role.act else { return None };
        if role.solid != 0 || face.shape.is_smooth() {
            return None;
        }
        let bsdf = &*scene.finishes[finish as usize];
        let known = bsdf.facts();
        if wants.exitance {
            // Who sums what sheets send out is told by those of any finish, unless a ray may have been mirrored before.
            let plain = !known.specular[0];
            let sheet = plain.then(|| ScatteringSheet::of(index, bsdf, scene.axes[index as usize]));
            return sheet.flatten().map(Sheet::Scattering);
        }
        LambertianSheet::of(index, known)
            .map(Sheet::Lambertian)
            .or_else(|| ScatteringSheet::of(index, bsdf, scene.axes[index as usize]).map(Sheet::Scattering))
    };
    faces.filter_map(sheet).collect()
}

/// Sorts the rays of a queue by what comes next.
#[derive(Default)]
pub struct Sorter<'a> {
    /// For each face, and for none, the number of the list of most rays that meet it: [`GONE`], [`SINGLE`], [`INTERFACE`], or from
    /// [`FIRST`] on for faces off which many are bounced at once.
    list_of: Vec<usize>,
    sheets: Vec<Sheet<'a>>,
    lists: Buckets,
    /// For each ray whether it may be at more than one face.
    tied: Vec<bool>,
    /// Whether rays that leave each solid's medium cannot be absorbed on their way; the surroundings first.
    clear: Vec<bool>,
}

/// The list of rays that leave the scene.
const GONE: usize = 0;

/// The list of rays that are worked on one by one.
const SINGLE: usize = 1;

/// The list of rays that meet smooth interfaces of solids.
const INTERFACE: usize = 2;

/// The list of the first bouncer.
const FIRST: usize = 3;

impl<'a> Sorter<'a> {
    /// For rays that are worked on one by one all the time.
    pub fn one_by_one(scene: &Scene) -> Self {
        Self::new(scene, Vec::new(), &vec![false; scene.roles.len()])
    }

    /// Of a scene, those of its faces off which many rays are bounced at once, and whether each is a smooth interface.
    #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^16 solids")]
    pub fn new(scene: &Scene, sheets: Vec<Sheet<'a>>, interfaces: &[bool]) -> Self {
        let solids = 0..=scene.solids.len();
        let clear = |solid: usize| scene.media[scene.medium(solid as u16)].absorption.range() == [0.0, 0.0];
        let clear: Vec<bool> = solids.map(clear).collect();
        let list = |smooth: &bool| if *smooth { INTERFACE } else { SINGLE };
        let mut list_of: Vec<usize> = interfaces.iter().map(list).collect();
        list_of.push(GONE);
        for (list, sheet) in (FIRST..).zip(&sheets) {
            list_of[sheet.face() as usize] = list;
        }
        Self {
            list_of,
            lists: Buckets::new(FIRST + sheets.len()),
            sheets,
            tied: Vec::new(),
            clear,
        }
    }

    /// Sorts the rays of a queue. Rays that have had all the events that they may have (`ended`) are not bounced, nor those in
    /// a solid or at more than one face.
    pub fn sort(&mut self, queue: &RayQueue, hits: &Hits, ended: bool) {
        self.lists.clear();
        hits.ties(&queue.lines, &mut self.tied);
        let faces = self.list_of.len() - 1;
        for i in 0..queue.len() {
            let face = (hits.face[i] as usize).min(faces);
            let mut list = self.list_of[face];
            // In a solid rays are bounced one by one.
            let stack = queue.stack[i];
            let special = ended | self.tied[i] | ((list >= FIRST) & (stack != SolidStack::default()));
            let clear = self.clear[usize::from(stack.top())];
            if (special & (list != GONE)) | (!clear & (list < FIRST)) {
                list = SINGLE;
            }
            self.lists.push(list, i);
        }
        self.lists.join_short(INTERFACE, SINGLE);
    }

    /// Places of the rays that meet nothing and cannot be absorbed on their way.
    pub fn gone(&self) -> &[u32] {
        self.lists.get(GONE)
    }

    /// Places of the rays that are worked on one by one.
    pub fn single(&self) -> &[u32] {
        self.lists.get(SINGLE)
    }

    /// Places of the rays that meet smooth interfaces.
    pub fn interfaces(&self) -> &[u32] {
        self.lists.get(INTERFACE)
    }

    /// Places of the rays that are bounced, face by face.
    pub fn bounced(&self) -> impl Iterator<Item = (Sheet<'a>, &[u32])> {
        let sheet = |list: usize| self.sheets.get(list.checked_sub(FIRST)?);
        self.lists
            .used()
            .filter_map(move |(list, places)| Some((*sheet(list)?, places)))
    }
}
