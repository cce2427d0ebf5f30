//! Scatter events: light that diffuse surfaces scattered, stored for later and thinned to a number of them.
//!
//! Thinning drops the scatters of every second ray, by a coin that each ray brings along: its depth, which is k or more for
//! one ray of 2ᵏ. Whether to thin once more depends on coins that were looked at already, never on the next one, so that
//! 2ᵏ Σ over what is left after k times is a martingale: its mean is the sum over all rays, whenever one stops.

use etendue_geometry::Face;
use etendue_geometry::origin_faces::{MOST_ORIGIN_FACES, OriginFaces};
use etendue_geometry::shape::Crossing;
use etendue_math::Vec3;
use etendue_sampling::philox::Stream;

use crate::interaction::Interaction;
use crate::scene::{Act, Scene};
use crate::solid_stack::SolidStack;

/// Light that was scattered diffusely: what is needed to look at it, now or later, from anywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatterEvent {
    /// Where \[mm\].
    pub point: Vec3,
    /// Unit normal of the surface, on the side that the light came from.
    pub side: Vec3,
    /// The interpolated normal of a mesh that states some, on the same side; else the same.
    pub normal: Vec3,
    /// Where the light was going.
    pub direction: Vec3,
    /// Of the ray \[flux unit\].
    pub flux: f64,
    /// \[nm\].
    pub wavelength: f64,
    /// Number of the ray in its run.
    pub ray: u64,
    /// The finish of the surface.
    pub finish: u32,
    /// Whether the light met its front.
    pub front: bool,
    /// The faces that the light leaves from, the one that scattered it first.
    pub origin_faces: OriginFaces,
    /// The solids on the side of the light.
    pub before: SolidStack,
    /// The solids on the other side.
    pub after: SolidStack,
}

impl ScatterEvent {
    /// The scatter of a ray at an interaction.
    #[must_use]
    pub fn new(interaction: &Interaction, direction: Vec3, [flux, wavelength]: [f64; 2], ray: u64) -> Self {
        let mut origin_faces = interaction.origin_faces;
        let mut found = origin_faces.face.iter().zip(origin_faces.part);
        if let Some(slot) = found.position(|(face, part)| (*face, part) == (interaction.face, interaction.part)) {
            origin_faces.face.swap(0, slot);
            origin_faces.part.swap(0, slot);
        } else {
            // More faces coincide than are told apart: in a corner.
            (origin_faces.face[0], origin_faces.part[0]) = (interaction.face, interaction.part);
        }
        Self {
            point: interaction.point,
            side: interaction.side,
            normal: interaction.normal,
            direction,
            flux,
            wavelength,
            ray,
            finish: interaction.finish.unwrap_or_default(),
            front: interaction.front,
            origin_faces,
            before: interaction.before,
            after: interaction.after,
        }
    }
}

/// Numbers of a row.
pub const WORDS: usize = 15;

/// An event as it is kept, in 64-bit words: point, direction, flux, wavelength (as the bits of f64); depth · 2⁵⁶ + number of
/// the ray; the faces that light leaves from, the deciding one first, and their parts (two in a word, the lower half first);
/// the solids on both sides.
pub type Row = [u64; WORDS];

/// Bits of a word that hold the number of a ray; its depth lies above.
const RAY_BITS: u32 = 56;

/// Times that anything is thinned at most.
pub const DEEPEST: u32 = 63;

/// Batches that may be worked on at a time, each of which keeps its share of what is kept at most.
const TOGETHER: u64 = 16;

/// The purpose under which the depths of rays are drawn (see [`Stream::new`]).
const PURPOSE_DEPTH: u64 = 0x4445_5054;

/// How often a ray can be passed over by thinning: k or more with probability 2⁻ᵏ.
#[must_use]
pub fn depth(seed: u64, ray: u64) -> u32 {
    Stream::new(seed, PURPOSE_DEPTH).word(ray).leading_zeros().min(DEEPEST)
}

/// The row of an event, whose ray has a depth.
#[must_use]
pub fn to_row(event: &ScatterEvent, depth: u32) -> Row {
    let [p, d] = [event.point, event.direction].map(|v| [v.x, v.y, v.z].map(f64::to_bits));
    let pair = |list: [u32; MOST_ORIGIN_FACES], at: usize| u64::from(list[at + 1]) << 32 | u64::from(list[at]);
    let OriginFaces { face, part } = event.origin_faces;
    [
        p[0],
        p[1],
        p[2],
        d[0],
        d[1],
        d[2],
        event.flux.to_bits(),
        event.wavelength.to_bits(),
        u64::from(depth) << RAY_BITS | event.ray,
        pair(face, 0),
        pair(face, 2),
        pair(part, 0),
        pair(part, 2),
        event.before.bits(),
        event.after.bits(),
    ]
}

/// Number of the ray of a row.
#[inline]
#[must_use]
pub fn ray_of(row: &[u64]) -> u64 {
    row[8] & ((1 << RAY_BITS) - 1)
}

/// Depth of the ray of a row.
#[inline]
#[must_use]
pub fn depth_of(row: &[u64]) -> u32 {
    #[allow(clippy::cast_possible_truncation, reason = "eight bits are left")]
    let depth = (row[8] >> RAY_BITS) as u32;
    depth
}

/// The event of a row; None if it cannot be one of this scene.
#[must_use]
pub fn from_row(scene: &Scene, row: &[u64]) -> Option<ScatterEvent> {
    let real = |k: usize| f64::from_bits(row[k]);
    let vector = |k: usize| Vec3::new(real(k), real(k + 1), real(k + 2));
    #[allow(clippy::cast_possible_truncation, reason = "the halves of a word")]
    let halves = |word: u64| [word as u32, (word >> 32) as u32];
    let four = |k: usize| {
        let ([a, b], [c, d]) = (halves(row[k]), halves(row[k + 1]));
        [a, b, c, d]
    };
    let origin_faces = OriginFaces {
        face: four(9),
        part: four(11),
    };
    let (index, part) = (origin_faces.face[0] as usize, origin_faces.part[0]);
    let (before, after) = (SolidStack::from_bits(row[13]), SolidStack::from_bits(row[14]));
    let solids = scene.solids.len();
    let known = |stack: SolidStack| stack.solids().iter().all(|s| usize::from(*s) <= solids);
    let Act::Optical(finish) = scene.roles.get(index)?.act else {
        return None;
    };
    let face: &Face = &scene.face_set.faces()[index];
    let whole = row[..8].iter().all(|word| f64::from_bits(*word).is_finite());
    if !(whole && known(before) && known(after) && (part as usize) < face.shape.parts()) {
        return None;
    }
    let (point, direction) = (vector(0), vector(3));
    let here = Crossing {
        part,
        ..Crossing::default()
    };
    let normal = face.surface_point(point, direction, &here).normal;
    let front = direction.dot(normal) < 0.0;
    let side = if front { normal } else { -normal };
    let interpolated = face.shading_normal_at(part, point).map_or(side, |n| {
        let n = if front { n } else { -n };
        if direction.dot(n) < 0.0 { n } else { side }
    });
    Some(ScatterEvent {
        point,
        side,
        normal: interpolated,
        direction,
        flux: real(6),
        wavelength: real(7),
        ray: ray_of(row),
        finish,
        front,
        origin_faces,
        before,
        after,
    })
}

/// Events of whole rays, in the order of their numbers.
#[derive(Clone, Debug, Default)]
pub struct EventReservoir {
    /// Rows, stretch by stretch.
    stretches: Vec<Vec<Row>>,
    /// The stretch under construction, of which so many rows are in order.
    rows: Vec<Row>,
    settled: usize,
    /// How often they were thinned: each stands for 2ᵏ.
    level: u32,
    /// How many are kept at most.
    most: usize,
}

impl EventReservoir {
    /// Nothing yet, and room for so many.
    #[must_use]
    pub fn new(most: usize) -> Self {
        Self {
            most,
            ..Self::default()
        }
    }

    /// Nothing yet, of one of `batches` batches that have room for so many together.
    #[must_use]
    pub fn of_batch(most: usize, batches: u64) -> Self {
        #[allow(clippy::cast_possible_truncation, reason = "a small number")]
        let share = batches.clamp(1, TOGETHER) as usize;
        Self::new(most / share)
    }

    /// How often they were thinned.
    #[must_use]
    pub const fn level(&self) -> u32 {
        self.level
    }

    /// The rows in their order.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.stretches.iter().flatten().chain(&self.rows)
    }

    /// Their number.
    #[must_use]
    pub fn count(&self) -> usize {
        self.stretches.iter().map(Vec::len).sum::<usize>() + self.rows.len()
    }

    /// Keeps an event, unless its ray was dropped.
    #[inline]
    pub fn push(&mut self, event: &ScatterEvent, depth: u32) {
        if depth >= self.level {
            self.rows.push(to_row(event, depth));
            self.fit();
        }
    }

    /// Puts the latest rows in the order of their rays: all of these have come to their ends.
    pub fn settle(&mut self) {
        self.rows[self.settled..].sort_by_cached_key(|row| ray_of(row));
        self.settled = self.rows.len();
    }

    /// Adds those of the next batch.
    pub fn add(&mut self, mut part: Self) {
        self.thin(part.level);
        part.thin(self.level);
        self.stretches.append(&mut part.stretches);
        self.stretches.push(part.rows);
        self.fit();
    }

    fn fit(&mut self) {
        while self.count() > self.most && self.level < DEEPEST {
            self.thin(self.level + 1);
        }
    }

    fn thin(&mut self, level: u32) {
        if level <= self.level {
            return;
        }
        self.level = level;
        let stays = |row: &Row| depth_of(row) >= level;
        self.settled = self.rows[..self.settled].iter().filter(|row| stays(row)).count();
        self.rows.retain(stays);
        for rows in &mut self.stretches {
            rows.retain(stays);
            rows.shrink_to_fit();
        }
    }
}
