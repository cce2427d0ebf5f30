//! Sources: what emits rays, where it stands, how much flux it has and of which wavelengths.

mod intensity_table;
pub mod numbers;
pub mod patches;
mod record_order;
mod rings;

pub mod surface;

use std::ops::Range;
use std::sync::Arc;

use etendue_geometry::Face;
use etendue_geometry::bounds::{Ball, Bounds};
use etendue_geometry::shape::Shape;
use etendue_geometry::shape::sample::AreaSampler;
use etendue_geometry::{RayBatch, RaySource};
use etendue_lightfield::field::draw::{FieldRays, Sampler};
use etendue_math::{Frame, Vec3};
use etendue_sampling::philox::{Pairs, Stream, fill_fours};

use self::record_order::RecordOrder;

pub use intensity_table::IntensityTable;
pub use numbers::Numbers;
pub use patches::PatchSource;
pub use rings::{Ring, RingSource};
pub use surface::{Pattern, SurfaceSource};

/// The purpose under which the first four numbers of each ray of a traced source are drawn (see [`Pairs::new`]); each source
/// has one of its own.
const PURPOSE_BIRTH: u32 = 0x4000_0000;

/// The purpose under which more of them are drawn (see [`Stream::new`]).
const PURPOSE_EMIT: u64 = 0x454D_4954 << 32;

/// The purpose under which their wavelengths are drawn.
const PURPOSE_COLOUR: u64 = 0x434F_4C52 << 32;

/// What emits, in its own coordinates.
#[derive(Clone, Debug)]
pub enum Emitter {
    /// The rays of a set, by its number among those that a trace is given.
    Rays {
        /// Which set.
        set: usize,
        /// From stored flux to flux unit.
        scale: f64,
        /// Whether its rays have the colours that their records state, if these state any.
        coloured: bool,
        /// Spectra, if the colour of a ray is the number of one of them, counted from 1; none if it is a wavelength.
        spectra: Vec<SpectralLines>,
    },
    /// A light field, drawn from.
    Field(Arc<Sampler>),
    /// An emitting surface.
    Surface(SurfaceSource),
    /// A point with an intensity distribution.
    Point(IntensityTable),
    /// Patches of a carrier surface with intensity tables.
    Patches(Arc<PatchSource>),
    /// Parallel light along +z from a piece of the plane z = 0.
    Beam(AreaSampler),
}

impl Emitter {
    /// A collimated beam; None if the shape is not flat or has no finite area.
    #[must_use]
    pub fn beam(shape: &Shape) -> Option<Self> {
        matches!(shape, Shape::Flat(_)).then(|| AreaSampler::new(shape).map(Self::Beam))?
    }
}

/// Wavelengths \[nm\], and the share of the flux up to each of them; the last one is 1.
pub type SpectralLines = Vec<(f64, f64)>;

/// The wavelength that a number between 0 and 1 picks.
#[inline]
fn line(lines: &SpectralLines, number: f64) -> f64 {
    let place = lines.partition_point(|(_, share)| *share < number);
    lines[place.min(lines.len() - 1)].0
}

/// The wavelengths of rays `range` of a stream that have nothing but a spectrum in common: each from its address.
#[must_use]
pub fn draw_wavelengths(lines: &SpectralLines, seed: u64, range: Range<u64>) -> Vec<f64> {
    let stream = Stream::new(seed, PURPOSE_COLOUR);
    range.map(|index| line(lines, stream.uniforms(index, 0)[0])).collect()
}

/// A source in its place.
#[derive(Clone, Debug)]
pub struct Source {
    /// What emits.
    pub emitter: Emitter,
    /// Where it stands.
    pub frame: Frame,
    /// \[flux unit\].
    pub flux: f64,
    /// Of the light whose colour no record tells.
    pub spectrum: SpectralLines,
}

impl Source {
    /// A ball in the world that holds every point which lines of sight can meet; None if there is none, or another way to tell.
    #[must_use]
    pub fn ball(&self) -> Option<Ball> {
        match &self.emitter {
            Emitter::Surface(surface) => self.face(surface).ball(),
            Emitter::Patches(_) => Ball::about(self.bounds()),
            Emitter::Field(_) | Emitter::Point(_) | Emitter::Beam(_) | Emitter::Rays { .. } => None,
        }
    }

    /// The surface of a source as a face.
    fn face(&self, surface: &SurfaceSource) -> Face {
        Face {
            shape: surface.shape().0.clone(),
            frame: self.frame,
            trims: Vec::new(),
            flipped: false,
        }
    }

    /// A box in the world that holds every start point; not finite for ray sets, which are not looked through for it. Of a
    /// light field it holds the places of its parts.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        match &self.emitter {
            Emitter::Surface(surface) => self.face(surface).bounds(),
            Emitter::Point(_) => Bounds::of([self.frame.origin]).widened(f64::EPSILON * self.frame.origin.length()),
            Emitter::Field(sampler) => {
                let boxes = sampler.field().parts.iter().map(|part| {
                    let centre = self.frame.point_to_world(part.part.frame.origin);
                    Bounds::of([centre]).widened(part.part.reach() * (1.0 + 1e-9))
                });
                boxes.fold(Bounds::EMPTY, Bounds::union)
            }
            Emitter::Patches(patches) => patches.bounds(&self.frame),
            Emitter::Beam(_) | Emitter::Rays { .. } => {
                Bounds::of([f64::NEG_INFINITY, f64::INFINITY].map(|v| Vec3::new(v, v, v)))
            }
        }
    }

    /// Whether it can be seen or connected to from a point that it lights: a set of rays or a beam cannot.
    #[must_use]
    pub const fn is_visible(&self) -> bool {
        !matches!(self.emitter, Emitter::Rays { .. } | Emitter::Beam(_))
    }

    /// The wavelength of ray `index` of source number `source` \[nm\].
    #[inline]
    #[must_use]
    pub fn wavelength(&self, seed: u64, source: u64, index: u64) -> f64 {
        if let [(wavelength, _)] = self.spectrum[..] {
            return wavelength;
        }
        line(&self.spectrum, Self::colour_number(seed, source, index))
    }

    fn colour_number(seed: u64, source: u64, index: u64) -> f64 {
        Stream::new(seed, PURPOSE_COLOUR + source).uniforms(index, 0)[0]
    }

    /// Turns the colours that records state into wavelengths; a colour that is none counts as not stated.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "numbers of spectra are small; others are in no list"
    )]
    fn name_wavelengths(&self, spectra: &[SpectralLines], source: u64, first: u64, seed: u64, colours: &mut [f64]) {
        for (index, colour) in (first..).zip(colours) {
            let stated = *colour > 0.0 && colour.is_finite();
            let spectrum = || spectra.get((*colour as usize).wrapping_sub(1));
            *colour = match (stated, spectra.is_empty()) {
                (true, true) => *colour,
                (true, false) => spectrum().map_or_else(
                    || self.wavelength(seed, source, index),
                    |lines| line(lines, Self::colour_number(seed, source, index)),
                ),
                (false, _) => self.wavelength(seed, source, index),
            };
        }
    }

    /// Puts rays `range` of `count` (at most a block) into `batch`, in world coordinates: together the `count` rays carry
    /// the flux of the source. Where the records of a set tell the colours of their rays, the colours of the batch are their
    /// wavelengths \[nm\]; else there are none, and [`Source::wavelength`] has them.
    ///
    /// A set of n rays is gone through once: ray i of `count` is the one in place ⌊i n/count⌋ of a random order
    /// ([`RecordOrder`]), with n/count of its flux.
    pub fn emit(
        &self,
        source: u64,
        range: Range<u64>,
        count: u64,
        seed: u64,
        sets: &[&dyn RaySource],
        batch: &mut RayBatch,
    ) {
        match &self.emitter {
            Emitter::Rays {
                set,
                scale,
                coloured,
                spectra,
            } => {
                let first = range.start;
                RecordOrder::new(sets[*set].len(), *set, seed).resample(sets[*set], range, count, batch);
                if !coloured {
                    batch.colour.clear();
                }
                self.name_wavelengths(spectra, source, first, seed, &mut batch.colour);
                let scale = scale * sets[*set].len() as f64 / count as f64;
                batch.flux[..batch.len].iter_mut().for_each(|w| *w *= scale);
            }
            Emitter::Field(sampler) => {
                let rays = FieldRays {
                    sampler,
                    rays: count,
                    seed: seed.wrapping_add(source << 48),
                };
                rays.fill(range, batch);
                // The field's own flux may have been restated.
                let flux = self.flux / count as f64;
                batch.flux[..batch.len].fill(flux);
            }
            Emitter::Surface(surface) => self.draw(source, range, count, seed, batch, |n| surface.draw(n)),
            Emitter::Point(point) => self.draw(source, range, count, seed, batch, |n| (Vec3::default(), point.draw(n))),
            Emitter::Patches(patches) => self.draw(source, range, count, seed, batch, |n| patches.draw(n)),
            Emitter::Beam(area) => self.draw(source, range, count, seed, batch, |n| {
                (area.draw(&mut || n.draw()).0, Vec3::new(0.0, 0.0, 1.0))
            }),
        }
        for i in 0..batch.len {
            if batch.usable(i) {
                let x = self.frame.point_to_world(batch.position(i));
                let k = self.frame.direction_to_world(batch.direction(i));
                for (axis, (x, k)) in [(x.x, k.x), (x.y, k.y), (x.z, k.z)].into_iter().enumerate() {
                    batch.position[axis][i] = x;
                    batch.direction[axis][i] = k;
                }
            }
        }
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "a range of at most a block; fewer than 2^28 sources"
    )]
    fn draw(
        &self,
        source: u64,
        range: Range<u64>,
        count: u64,
        seed: u64,
        batch: &mut RayBatch,
        ray: impl Fn(&mut Numbers) -> (Vec3, Vec3),
    ) {
        let stream = Stream::new(seed, PURPOSE_EMIT + source);
        batch.len = (range.end - range.start) as usize;
        batch.colour.clear();
        batch.defects = Default::default();
        batch.norm_error = 0.0;
        batch.flux[..batch.len].fill(self.flux / count as f64);
        let indices: Vec<u64> = range.collect();
        let mut four: [Vec<f64>; 4] = Default::default();
        fill_fours(Pairs::new(seed, PURPOSE_BIRTH + source as u32), &indices, &mut four);
        if let Emitter::Surface(surface) = &self.emitter
            && surface.draw_block(&four, &mut batch.position, &mut batch.direction)
        {
            return;
        }
        for (i, index) in indices.into_iter().enumerate() {
            let (x, k) = ray(&mut Numbers::begun(stream, index, four.each_ref().map(|v| v[i])));
            for (axis, (x, k)) in [(x.x, k.x), (x.y, k.y), (x.z, k.z)].into_iter().enumerate() {
                batch.position[axis][i] = x;
                batch.direction[axis][i] = k;
            }
        }
    }
}
