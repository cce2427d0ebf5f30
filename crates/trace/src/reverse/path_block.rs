//! A block of paths from the observer, all branches of which take their next steps together.

use etendue_geometry::hits::Hits;
use etendue_geometry::origin_faces::OriginFaces;
use etendue_geometry::ray_block::RayBlock;
use etendue_lightfield::View;
use etendue_lightfield::field::SightReader;
use etendue_math::Vec3;
use etendue_optics::source::Numbers;
use etendue_sampling::lattice::ShiftedPoint;
use etendue_sampling::philox::Stream;

use super::method::Method;
use crate::exitance::ExitanceCache;
use crate::interaction::Interaction;
use crate::lit_scene::LitScene;
use crate::medium_cache::MediumCache;
use crate::ray_start::place_observer;
use crate::solid_stack::SolidStack;

/// What a branch has seen on its way from the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Seen {
    /// Smooth surfaces, or nothing yet.
    Smooth,
    /// A diffuse surface, and nothing since: the density of its direction there, and whether all sources were connected to.
    Diffuse { density: f64, all: bool },
    /// A diffuse surface, and smooth ones since.
    Caustic,
}

/// What is known of a branch besides its line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Branch {
    /// Number of its path in the block.
    pub(super) path: u32,
    pub(super) stack: SolidStack,
    pub(super) weight: f64,
    pub(super) seen: Seen,
    /// Distance since the last diffuse scatter.
    pub(super) travelled: f64,
    pub(super) events: u32,
    pub(super) scatters: u32,
    /// Whether one of several smooth ways was drawn.
    pub(super) drawn: bool,
    /// Whether the observer sees the first diffuse surface directly.
    pub(super) direct: bool,
    /// Density by area with which lines of sight meet that surface there \[1/mm²\].
    pub(super) density: f64,
    /// Its ways through smooth surfaces from the observer (see [`led_on`](crate::glints::led_on)).
    pub(super) ways: u32,
    /// Whether anything on its way treats wavelengths differently.
    pub(super) selective: bool,
    /// On one of 2^`thinned` lines of sight it is followed, for all of them.
    pub(super) thinned: u8,
    /// Sources no farther along its line were met on the way to where it starts. Of single precision, as branches are the size of
    /// a line of the cache so.
    pub(super) behind: f32,
}

impl Branch {
    /// On one of 2^`thinned` lines of sight instead of as many as before.
    #[inline(always)]
    pub(super) fn thinned_to(self, thinned: u8) -> Self {
        let times = f64::from(1_u32 << (thinned - self.thinned));
        Self {
            weight: self.weight * times,
            thinned,
            ..self
        }
    }
}

/// A way that carries less of the light than this is followed on fewer lines of sight.
const WEAK: f64 = 0.25;

/// Of the lines of a pass through a pixel as many are left as this, at least: their mean errs little, and so do errors of it.
const LEFT: u32 = 8;

/// Paths of one pass through one pixel.
pub(super) struct PixelPass {
    /// The number of the pixel.
    pub(super) pixel: usize,
    /// The pass, counted from the first of those that are made.
    pub(super) pass: usize,
    /// Whether they look for small images of sources and nothing else.
    pub(super) aimed: bool,
    /// The point of the first of them, and by how much the first numbers of all are moved.
    pub(super) point: ShiftedPoint,
    pub(super) shift: [f64; 4],
    /// Where among them those begin on which weak ways are followed: as a share of all, times 2³².
    pub(super) turn: u32,
    /// Where their further numbers are found.
    pub(super) stream: Stream,
    pub(super) address: u64,
}

impl PixelPass {
    /// The numbers of a path.
    pub(super) fn numbers(&self, index: u32) -> Numbers {
        let address = self.address.wrapping_add(u64::from(index));
        Numbers::after(self.point.at(index), &self.shift, self.stream, address)
    }
}

/// One path: its wavelength, and the light that it has found, with its deviation.
#[derive(Clone, Copy)]
pub(super) struct Path {
    /// Place of its pixel and pass in the block.
    pub(super) pass: u32,
    /// Its number there.
    pub(super) index: u32,
    pub(super) line: u32,
    /// How many of its random numbers its start took, and whether any were drawn since.
    pub(super) drawn: u8,
    pub(super) begun: bool,
    /// Whether it met a smooth surface first, and whether it saw a diffuse one directly.
    pub(super) met: [bool; 2],
    pub(super) sum: [f64; 2],
    /// Of the light, that which was scattered on its way.
    pub(super) scattered: f64,
    /// Of the light, that which was found by chance.
    pub(super) chance: f64,
    /// Weight of its branches that met more surfaces than they may.
    pub(super) given_up: f32,
    /// Weight of its branches that were lost, as the solids they were in contradict the faces they met.
    pub(super) lost: f32,
    /// How much a small image of a source counts, as paths of both kinds find it.
    pub(super) share: f64,
}

/// A connection of a diffuse surface to a source, that counts if nothing is in between.
pub(super) struct Connection {
    pub(super) path: u32,
    /// The number of the source.
    pub(super) source: usize,
    /// Whether anything on the way to here treats wavelengths differently.
    pub(super) selective: bool,
    pub(super) light: [f64; 2],
    pub(super) stack: SolidStack,
    pub(super) to: Vec3,
}

/// Paths in one block.
pub const BLOCK: usize = 1024;

/// A block of paths, all branches of which take their next steps together.
pub struct PathBlock<'a> {
    pub(super) lit: &'a LitScene<'a>,
    pub(super) view: &'a View,
    pub(super) method: &'a Method<'a>,
    /// The light of diffuse surfaces, for each pass, if it is known.
    pub(super) known: &'a [ExitanceCache<'a>],
    pub(super) media: MediumCache,
    pub(super) hits: Hits,
    pub(super) passes: Vec<PixelPass>,
    pub(super) paths: Vec<Path>,
    /// The random numbers of paths that have drawn any since their start.
    numbers: Vec<Numbers>,
    /// Branches that are about to take a step, and those that come out of it.
    pub(super) lines: RayBlock,
    pub(super) branches: Vec<Branch>,
    pub(super) next_lines: RayBlock,
    pub(super) next: Vec<Branch>,
    /// How far each branch goes, and whether it may meet a source.
    pub(super) reach: Vec<f64>,
    pub(super) marks: Vec<bool>,
    /// Those that may, and room to look along them.
    pub(super) marked: Vec<u32>,
    pub(super) reader: SightReader,
    /// Connections that have to be looked at.
    pub(super) shadows: RayBlock,
    pub(super) connections: Vec<Connection>,
    /// What the observer is in, and what it lies on; None if it cannot be anywhere.
    pub(super) observer: Option<(SolidStack, OriginFaces)>,
}

impl<'a> PathBlock<'a> {
    /// An empty block.
    pub fn new(lit: &'a LitScene<'a>, view: &'a View, method: &'a Method<'a>, known: &'a [ExitanceCache<'a>]) -> Self {
        Self {
            lit,
            view,
            method,
            known,
            media: MediumCache::new(lit.scene),
            hits: Hits::default(),
            passes: Vec::new(),
            paths: Vec::with_capacity(BLOCK),
            numbers: Vec::new(),
            lines: RayBlock::default(),
            branches: Vec::new(),
            next_lines: RayBlock::default(),
            next: Vec::new(),
            reach: Vec::new(),
            marks: Vec::new(),
            marked: Vec::new(),
            reader: SightReader::default(),
            shadows: RayBlock::default(),
            connections: Vec::new(),
            observer: place_observer(lit.scene, view.observer, view.target).ok(),
        }
    }

    pub(super) fn wavelength(&self, path: u32) -> f64 {
        self.lit.wavelengths.at(self.paths[path as usize].line as usize)
    }

    /// The random numbers of a path. Many paths need none: theirs are not worked out.
    pub(super) fn numbers(&mut self, path: u32) -> &mut Numbers {
        let place = path as usize;
        let Path {
            pass,
            index,
            drawn,
            begun,
            ..
        } = &mut self.paths[place];
        if !*begun {
            *begun = true;
            let mut numbers = self.passes[*pass as usize].numbers(*index);
            for _ in 0..*drawn {
                numbers.draw();
            }
            if self.numbers.len() <= place {
                self.numbers.resize(place + 1, numbers.clone());
            }
            self.numbers[place] = numbers;
        }
        &mut self.numbers[place]
    }

    /// On one of how many lines of sight a way is followed that carries `share` of a branch's light, as a power of two; None if
    /// not on this one. The weight grows as they become fewer.
    ///
    /// What a weak way brings errs little, measured by all light: so on one line in 2, 4, 8 … if it carries less than 1/4, 1/16,
    /// 1/64 … Those lines follow each other, so that they are spread evenly over their pixel as well; each is one of them with
    /// that probability, and a way that is weak twice is followed on some of the lines on which the first one is.
    ///
    /// On all of them where they look for small images of sources, or go on from diffuse surfaces to where smooth ones focus
    /// light: what is found rarely must not be found on fewer lines, and count for more there.
    #[inline(always)]
    pub(super) fn followed(&self, branch: &Branch, share: f64) -> Option<u8> {
        let path = &self.paths[branch.path as usize];
        let pass = self.pass_of(path);
        if share >= WEAK || pass.aimed || self.method.guide.is_some() {
            return (share > 0.0).then_some(branch.thinned);
        }
        // By the exponent of two: 1/4, 1/16 … halve the lines once more.
        let halvings = 1022_u64.saturating_sub(share.to_bits() >> 52) / 2;
        let most = (self.method.paths / LEFT).max(1).ilog2();
        #[allow(clippy::cast_possible_truncation, reason = "below 32; a number of 32 bits")]
        let (thinned, place) = (
            (u64::from(branch.thinned) + halvings).min(u64::from(most)) as u8,
            ((u64::from(path.index) << 32) / u64::from(self.method.paths)) as u32,
        );
        let among = u64::from(place.wrapping_add(pass.turn)) << thinned < 1 << 32;
        (share > 0.0 && among).then_some(thinned)
    }

    /// The pixel and pass of a path.
    pub(super) fn pass_of(&self, path: &Path) -> &PixelPass {
        &self.passes[path.pass as usize]
    }

    /// A branch goes on a way through a smooth surface that carries `share` of its light, if it is followed there.
    pub(super) fn push_if_followed(&mut self, interaction: &Interaction, d: Vec3, branch: Branch, share: f64) {
        if let Some(thinned) = self.followed(&branch, share) {
            self.push(interaction, d, branch.thinned_to(thinned));
        }
    }

    pub(super) fn push(&mut self, interaction: &Interaction, d: Vec3, branch: Branch) {
        self.next_lines.push(interaction.point, d, interaction.origin_faces);
        self.next.push(branch);
    }
}
