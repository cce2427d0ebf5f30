//! The light that diffuse surfaces send out, patch by patch, from rays traced forwards.
//!
//! A path from the observer that goes from one diffuse surface to another may end there if the luminance of the second one is
//! known: *final gathering*, `[Jensen1996]`. Where only a part of that luminance does not depend on where the light came from
//! (the base of a satin paint, the floor of a table), this part is known, and the path goes on for the rest. What is known is a mean over a small patch of the surface, by the rays that
//! arrive on it. The first surface that the observer sees is never looked up, so that patches are not seen: they enter integrals
//! over all that the surface faces. A patch is of no use where light is blocked from a part of it, since the mean is that of
//! the whole; a survey finds those, and paths that meet them go on. So do paths that are too near to a patch to take it for
//! smooth.
//!
//! Each pass of a map has rays of its own: patches err by chance, and the spread of the passes tells by how much.

use std::f64::consts::FRAC_1_PI;
use std::ops::Range;
use std::sync::Arc;

use etendue_geometry::Face;
use etendue_geometry::shape::chart::BINS;
use etendue_geometry::shape::sample::AreaSampler;
use etendue_sampling::ordered::BATCH;

use crate::dealing::Dealing;
use crate::detector::{Detector, Exitance};
use crate::exitance_cells::{ExitanceCells, FacePoint};
use crate::forward::run::Run;
use crate::lit_scene::LitScene;
use crate::records::Cell;
use crate::scene::{Act, Role, Scene};
use crate::work_unit::work_unit_of;

/// Batches of rays from which the sizes of patches are chosen.
const SCOUTS: u64 = 1;

/// Batches of rays that look at the bins of each patch.
const SURVEYORS: u64 = 8;

/// Rays in a batch of a pass.
const FEW: u64 = 1 << 13;

/// Batches of a pass: at least and at most.
const EACH: [u64; 2] = [4, 64];

/// Lines of sight of a pass for each of its rays.
const LINES: u64 = 1;

/// Rays that a bin has on average in a survey: of as many, hardly one in 10⁶ gets none by chance.
const FILL: f64 = 16.0;

/// Patches of all faces together, beside one for each: where light goes to and fro for long, rays would fill more than there is
/// memory for.
const MOST_PATCHES: f64 = 65_536.0;

/// Distance from which a patch counts as smooth, in sides of it.
const NEAR: f64 = 2.0;

/// Wavelengths at each of which the light of patches is known, at most: of more, each has too few rays and too much room. Lines of
/// sight on which something was selective then go on.
const FEW_WAVELENGTHS: usize = 8;

/// What the seed is mixed with, so that no ray of a survey is one of a light image or a trace of the same seed.
const SURVEY: u64 = 0x5355_5256;

/// More rays than any map takes: the run whose batches are dealt to the passes.
const RUN: u64 = 1 << 44;

/// Segments of rays whose contributions are kept at a time: some hundred megabytes. Where light goes to and fro for long, a
/// batch alone holds as many.
const KEPT: u64 = 1 << 24;

/// Patches, and which of them can be used.
#[derive(Clone, Debug)]
pub struct ExitanceSurvey {
    patches: Arc<ExitanceCells>,
    /// For each side of each patch: the area \[mm²\], and the distance from which it can be used \[mm\]; ∞ if it cannot.
    sides: Vec<[f64; 2]>,
    seed: u64,
    most_events: u32,
    /// Batches of the survey that would be traced at a time.
    round: u64,
}

/// The luminance of the patches, by the rays of one pass.
#[derive(Clone, Debug)]
pub struct ExitanceCache<'a> {
    survey: &'a ExitanceSurvey,
    /// Of each side of each patch, at each wavelength, over the probability that a line of sight has it, and at all of them
    /// together: without the light that may be left to the light image, and of all.
    luminance: Vec<[f64; 2]>,
}

impl ExitanceSurvey {
    /// Cuts the diffuse surfaces of a scene by the light that falls on them, and finds the patches that light reaches
    /// everywhere.
    ///
    /// A face is cut if it has a finite area, nothing is cut off it, and a part of its light is a product (`Parts`); with
    /// interpolated normals, if it is Lambertian. Runs on the threads of the current pool; the same for any number.
    #[must_use]
    pub fn new(lit: &LitScene<'_>, seed: u64, most_events: u32) -> Self {
        let (scene, seed) = (lit.scene, seed ^ SURVEY);
        // A single one stands for all of them.
        let told = if lit.wavelengths.count() > FEW_WAVELENGTHS {
            1
        } else {
            lit.wavelengths.count()
        };
        let wavelengths: Vec<f64> = lit.wavelengths.all().take(told).collect();
        let own = |(face, role): (&Face, &Role)| {
            let Act::Optical(finish) = role.act else { return None };
            let bsdf = &*scene.finishes[finish as usize];
            let facts = bsdf.facts();
            let known = facts.lambertian || (bsdf.parts().is_some() && !face.shape.is_smooth());
            let cut = facts.is_diffuse() && known && face.trims.is_empty();
            cut.then(|| AreaSampler::new(&face.shape).map(|sampler| sampler.area()))?
        };
        let areas: Vec<Option<f64>> = scene.face_set.faces().iter().zip(&scene.roles).map(own).collect();
        let (run, mut round) = (run_of(lit, seed, most_events), 1);
        let mut count = |patches: &Arc<ExitanceCells>, batches: Range<u64>| -> Vec<u64> {
            // Where nothing is cut there is nothing to look for.
            if patches.bins == 0 {
                return Vec::new();
            }
            let mut found = vec![0; 2 * patches.bins as usize];
            trace(lit, patches, &run, (BATCH, batches), &mut round, |cells| {
                for (found, lines) in found.iter_mut().zip(cells.chunks(2 * wavelengths.len())) {
                    *found += lines.iter().map(|cell| cell.rays).sum::<u64>();
                }
            });
            found
        };
        // Scouts: how much light falls on each face.
        let whole = Arc::new(ExitanceCells::cut(scene.face_set.faces(), wavelengths.clone(), &areas));
        let found = count(&whole, 0..SCOUTS);
        // How many patches rays of a survey would fill on each face.
        let filled: Vec<Option<f64>> = whole
            .faces
            .iter()
            .map(|chart| {
                let (chart, first) = chart.as_ref()?;
                let from = 2 * *first as usize;
                let to = from + 2 * BINS as usize * chart.areas().len();
                let (front, back) = found[from..to]
                    .chunks(2)
                    .fold((0, 0), |sum, pair| (sum.0 + pair[1], sum.1 + pair[0]));
                let hits = front.max(back) as f64 * (SURVEYORS as f64 / SCOUTS as f64);
                (hits > 0.0).then_some(hits / (FILL * f64::from(BINS)))
            })
            .collect();
        let share = (MOST_PATCHES / filled.iter().flatten().sum::<f64>()).min(1.0);
        let piece = |(filled, area): (&Option<f64>, &Option<f64>)| Some((*area)? / ((*filled)? * share).max(1.0));
        let pieces: Vec<Option<f64>> = filled.iter().zip(&areas).map(piece).collect();
        let patches = Arc::new(ExitanceCells::cut(scene.face_set.faces(), wavelengths.clone(), &pieces));
        // Fewer patches are filled by fewer rays.
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 0 to all of them"
        )]
        let surveyors = ((SURVEYORS as f64 * share).ceil() as u64).max(1);
        let found = count(&patches, SCOUTS..SCOUTS + surveyors);
        let mut sides = Vec::new();
        for (chart, first) in patches.faces.iter().flatten() {
            for (number, area) in chart.areas().iter().enumerate() {
                let from = 2 * (*first as usize + number * BINS as usize);
                let bins = &found[from..from + 2 * BINS as usize];
                for side in 0..2 {
                    let lit = bins.iter().skip(side).step_by(2).rev();
                    let lit = lit.fold(0, |bits, count| bits << 1 | u32::from(*count > 0));
                    let full = lit == chart.bins(number);
                    sides.push([*area, if full { NEAR * area.sqrt() } else { f64::INFINITY }]);
                }
            }
        }
        Self {
            patches,
            sides,
            seed,
            most_events,
            round,
        }
    }

    /// The side of the patch that a point of a face lies in.
    fn side(&self, scene: &Scene, place: FacePoint) -> Option<usize> {
        let side = self.patches.side(scene.face_set.faces(), place)? as usize;
        Some(side / (2 * BINS as usize) * 2 + side % 2)
    }

    /// Number of patches.
    #[must_use]
    pub const fn patches(&self) -> usize {
        self.sides.len() / 2
    }

    /// Share of the patches that have a side whose light is known.
    #[must_use]
    pub fn usable(&self) -> f64 {
        let known = |sides: &&[[f64; 2]]| sides.iter().any(|side| side[1].is_finite());
        self.sides.chunks(2).filter(known).count() as f64 / self.patches().max(1) as f64
    }

    /// What the patches send out, by the rays of a pass of so many lines of sight.
    #[must_use]
    pub fn exitance(&self, lit: &LitScene<'_>, pass: u32, lines: u64) -> ExitanceCache<'_> {
        let first = (SCOUTS + SURVEYORS) * BATCH / FEW + u64::from(pass) * EACH[1];
        let batches = (2 * lines / (LINES * FEW)).clamp(EACH[0], EACH[1]);
        // The rays stand for the whole run.
        let scale = RUN as f64 / (batches * FEW) as f64;
        let lines = self.patches.wavelengths.len();
        let mut luminance = vec![[0.0; 2]; self.sides.len() * (lines + 1)];
        let (run, mut round) = (run_of(lit, self.seed, self.most_events), self.round * (BATCH / FEW));
        trace(
            lit,
            &self.patches,
            &run,
            (FEW, first..first + batches),
            &mut round,
            |cells| {
                for (number, pair) in cells.chunks(2).enumerate() {
                    let (side, line) = (number / lines, number % lines);
                    let side = side / (2 * BINS as usize) * 2 + side % 2;
                    let unit = scale * FRAC_1_PI / self.sides[side][0];
                    let light = [pair[0].sum * unit, (pair[0].sum + pair[1].sum) * unit];
                    for (column, chance) in [(line, lit.wavelengths.chance(line)), (lines, 1.0)] {
                        let found = &mut luminance[side * (lines + 1) + column];
                        for (found, light) in found.iter_mut().zip(light) {
                            *found += light / chance;
                        }
                    }
                }
            },
        );
        ExitanceCache {
            survey: self,
            luminance,
        }
    }
}

/// The run whose batches are dealt to the survey and to the passes.
fn run_of<'a>(lit: &LitScene<'a>, seed: u64, most_events: u32) -> Run<'a> {
    Run {
        rays: RUN,
        seed,
        most_events,
        sets: &[],
        stop: lit.stop,
        light_samplers: &[],
    }
}

/// Traces batches of `each` rays, so many at a time as there is room for, and hands on what each round adds to the cells.
///
/// `round` is the number of batches of the next round; how many segments their rays have tells it. It is the same for any number
/// of threads.
fn trace(
    lit: &LitScene<'_>,
    patches: &Arc<ExitanceCells>,
    run: &Run<'_>,
    (each, batches): (u64, Range<u64>),
    round: &mut u64,
    mut take: impl FnMut(&[Cell]),
) {
    let detectors = [Detector::Exitance(Exitance(Arc::clone(patches)))];
    let dealing = Dealing::of(lit.scene, RUN, &[]).in_batches_of(each);
    let mut next = batches.start;
    while next < batches.end {
        let some = next..batches.end.min(next + *round);
        let traced = some.end - some.start;
        next = some.end;
        let sums = work_unit_of(lit.scene, &detectors, run, &dealing, some);
        take(&sums.tallies[0].cells);
        *round = (KEPT * traced / sums.ledger.segments.max(1)).max(1);
    }
}

impl ExitanceCache<'_> {
    /// The luminance of a point of a face, seen from a distance: of all light, or without that which is left to the light image.
    /// On a line of sight that has one of the wavelengths because something on it was selective, or on any (None). None if it is
    /// not known.
    #[inline]
    #[must_use]
    pub fn at(
        &self,
        lit: &LitScene<'_>,
        place: FacePoint,
        distance: f64,
        line: Option<usize>,
        all: bool,
    ) -> Option<f64> {
        let side = self.survey.side(lit.scene, place)?;
        let lines = self.survey.patches.wavelengths.len();
        // What is selective has no light that is known for all wavelengths together only.
        let is_told = line.is_none() || lines == lit.wavelengths.count();
        let place = side * (lines + 1) + line.unwrap_or(lines);
        (is_told && distance > self.survey.sides[side][1]).then(|| self.luminance[place][usize::from(all)])
    }
}
