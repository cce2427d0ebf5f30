//! From the eye to the sources.
//!
//! A path starts at the eye, through a point of the pixel. While it meets smooth surfaces only, all its branches are followed:
//! that part of the image has no noise but that of the places within the pixel and of sources that err. At a diffuse surface
//! one direction is drawn, and points of the sources are connected to; a direction that both could find is shared out
//! between them by the balance heuristic `[Veach1995]`.
//!
//! Radiance grows by (n₁/n₂)² on its way from a medium of index n₂ into one of n₁.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use etendue_lightfield::View;
use etendue_optics::source::Lantern;
use rayon::prelude::*;

use crate::exitance::{Exitance, Survey};
use crate::glints::Glints;
use crate::guide::Guide;
use crate::scene::Scene;
use crate::sharing::Sharing;
use crate::wave::{BLOCK, Wave};

/// A scene with what its sources need to be looked at.
#[derive(Clone, Debug)]
pub struct Lit<'a> {
    pub(crate) scene: &'a Scene,
    /// None for those that cannot be seen backwards.
    pub(crate) lanterns: &'a [Option<Lantern>],
    /// Flux of all sources.
    pub(crate) flux: f64,
    /// Sums of the shares of the sources' flux.
    pub(crate) shares: Vec<f64>,
    /// Wavelengths: sum of the shares, the wavelength, and how much of each source's flux has it, over its share.
    pub(crate) lines: Vec<(f64, f64, Vec<f64>)>,
    /// As of [`Run`](crate::forward::Run).
    pub(crate) stop: Option<&'a AtomicBool>,
}

/// What lines of sight do not look for, because something else finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Left {
    /// Nothing.
    Nothing,
    /// Light that reaches a diffuse surface through smooth ones, and from there the eye directly or over other diffuse ones.
    Caustics,
    /// Of that light, the share of rays traced forwards.
    Shared(Sharing),
    /// All light that reaches the eye directly from a diffuse surface.
    Scattered,
}

/// How a map is computed.
#[derive(Clone, Copy, Debug)]
pub struct Method<'a> {
    /// Paths per pixel in each of the independent passes.
    pub paths: u32,
    /// Seed.
    pub seed: u64,
    /// Events that a path may have before it is ended.
    pub most_events: u32,
    /// What is left to the light image, or to scatter events.
    pub left: Left,
    /// Where paths that do not see a diffuse surface directly go on from there, if that is known.
    pub guide: Option<&'a Guide>,
    /// Small images of sources, where as many paths again look for them.
    pub glints: Option<&'a Glints>,
}

/// Sums over passes: of the mean of each pass, of that part of it which is found by chance only, of the sources' own
/// deviation, and of the shares of the lines of sight that meet smooth and diffuse surfaces first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Σ mean.
    pub sum: f64,
    /// Σ mean of the light that drawn directions bring to a source through smooth surfaces, where rays forwards cannot take it
    /// over: rare, and bright.
    pub chance: f64,
    /// Σ deviation.
    pub deviation: f64,
    /// Σ share of the lines that meet a smooth surface first, and of those that see a diffuse one directly.
    pub met: [f64; 2],
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
            flux: total,
            shares: shares.collect(),
            lines,
            stop: None,
        }
    }

    /// The same, whose work ends at once when `stop` is set; what it returns is then worth nothing.
    #[must_use]
    pub fn until(self, stop: &'a AtomicBool) -> Self {
        Self {
            stop: Some(stop),
            ..self
        }
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// The map of `view`: for each pixel the sums over passes `passes`. Passes are independent of each other. With a survey,
    /// paths end at diffuse surfaces whose light is known.
    ///
    /// Runs on the threads of the current pool; the same bits for any number.
    #[must_use]
    pub fn look(&self, view: &View, method: &Method<'_>, survey: Option<&Survey>, passes: Range<u32>) -> Vec<Pixel> {
        let known: Vec<Exitance<'_>> = survey
            .iter()
            .filter(|survey| survey.patches() > 0)
            .flat_map(|survey| passes.clone().map(|pass| survey.exitance(self, pass)))
            .collect();
        let mut pixels = vec![Pixel::default(); view.pixels()];
        let each = (passes.len() * method.paths as usize).max(1);
        let chunk = (4 * BLOCK / each).clamp(1, 1 << 12);
        pixels.par_chunks_mut(chunk).enumerate().for_each(|(number, pixels)| {
            Wave::new(self, view, method, &known).paint(number * chunk, passes.clone(), pixels);
        });
        pixels
    }
}
