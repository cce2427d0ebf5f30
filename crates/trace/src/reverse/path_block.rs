//! A block of paths from the observer, all branches of which take their next steps together.

use etendue_geometry::hits::Hits;
use etendue_geometry::origin_faces::OriginFaces;
use etendue_geometry::ray_block::RayBlock;
use etendue_lightfield::View;
use etendue_lightfield::field::SightReader;
use etendue_math::Vec3;
use etendue_optics::source::Numbers;

use super::method::Method;
use crate::exitance::ExitanceCache;
use crate::interaction::Interaction;
use crate::lit_scene::LitScene;
use crate::medium_cache::MediumCache;
use crate::ray_start::place;
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
}

/// One path: its random numbers, its wavelength, and the light that it has found, with its deviation.
pub(super) struct Path {
    pub(super) numbers: Numbers,
    pub(super) line: usize,
    /// The number of its pixel.
    pub(super) pixel: usize,
    /// Its pass, counted from the first of those that are made.
    pub(super) pass: usize,
    pub(super) sum: [f64; 2],
    /// Of the light, that which was found by chance.
    pub(super) chance: f64,
    /// Whether it met a smooth surface first, and whether it saw a diffuse one directly.
    pub(super) met: [bool; 2],
    /// Whether it looks for small images of sources and nothing else.
    pub(super) aimed: bool,
    /// How much such an image counts, as paths of both kinds find it.
    pub(super) share: f64,
}

/// A connection of a diffuse surface to a source, that counts if nothing is in between.
pub(super) struct Connection {
    pub(super) path: u32,
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
    pub(super) paths: Vec<Path>,
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
            paths: Vec::with_capacity(BLOCK),
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
            observer: place(lit.scene, view.observer, (view.target - view.observer).normalized()).ok(),
        }
    }

    pub(super) fn wavelength(&self, path: u32) -> f64 {
        self.lit.lines[self.paths[path as usize].line].1
    }

    pub(super) fn push(&mut self, interaction: &Interaction, d: Vec3, branch: Branch) {
        self.next_lines.push(interaction.point, d, interaction.origin_faces);
        self.next.push(branch);
    }
}
