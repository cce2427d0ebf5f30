//! A scene with what its sources need to be seen from other points.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use etendue_lightfield::View;
use etendue_math::Vec3;
use etendue_optics::light_sampler::LightSampler;

use crate::scene::Scene;
use crate::wavelengths::Wavelengths;

/// The share of picks of a source that goes by flux alone; the others go by flux over the square of the distance.
const BY_FLUX: f64 = 0.5;

/// A source among those of which one is picked.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// Of the flux.
    share: f64,
    /// The ball about it, with the square of its radius: infinite for what cannot be connected to.
    centre: Vec3,
    radius2: f64,
}

/// A scene with what its sources need to be looked at.
#[derive(Clone, Debug)]
pub struct LitScene<'a> {
    pub(crate) scene: &'a Scene,
    /// None for those that cannot be seen backwards.
    pub(crate) light_samplers: &'a [Option<LightSampler>],
    /// Flux of all sources.
    pub(crate) flux: f64,
    candidates: Vec<Candidate>,
    /// Those of the sources.
    pub(crate) wavelengths: Wavelengths,
    /// As of a run forwards.
    pub(crate) stop: Option<&'a AtomicBool>,
}

/// What each source needs to be seen: None for those that cannot be.
#[must_use]
pub fn light_samplers(scene: &Scene) -> Vec<Option<LightSampler>> {
    scene.sources.iter().map(LightSampler::new).collect()
}

impl<'a> LitScene<'a> {
    /// A scene and the lanterns of its sources.
    #[must_use]
    pub fn new(scene: &'a Scene, light_samplers: &'a [Option<LightSampler>]) -> Self {
        let total: f64 = scene.sources.iter().map(|s| s.flux).sum();
        let candidates = scene.sources.iter().zip(light_samplers).map(|(source, sampler)| {
            let around = source.bounds();
            let share = source.flux / total;
            if sampler.is_none() || !around.is_finite() {
                return Candidate {
                    share,
                    centre: Vec3::new(0.0, 0.0, 0.0),
                    radius2: f64::INFINITY,
                };
            }
            let half = (around.hi - around.lo) * 0.5;
            Candidate {
                share,
                centre: around.lo + half,
                // A point has no size, and may lie where the light falls.
                radius2: half.dot(half).max(1e-12),
            }
        });
        Self {
            scene,
            light_samplers,
            flux: total,
            candidates: candidates.collect(),
            wavelengths: Wavelengths::new(scene),
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

    /// Sum of what [`Candidate::pull`] is at a point.
    fn pull(&self, x: Vec3) -> f64 {
        self.candidates.iter().map(|one| one.pull(x)).sum()
    }

    /// One source to connect a point to, and the chance that it is this one: by a number between 0 and 1. None without sources.
    ///
    /// By flux alone a weak lamp close by, which may bring most of the light, would be picked on one line of sight in thousands,
    /// and the pixels whose lines all missed it would know nothing of it.
    pub(crate) fn pick_source(&self, x: Vec3, mut number: f64) -> Option<(usize, f64)> {
        let total = self.pull(x);
        let mut last = None;
        for (i, one) in self.candidates.iter().enumerate() {
            let chance = one.chance(x, total);
            if chance > 0.0 {
                last = Some((i, chance));
                number -= chance;
                if number < 0.0 {
                    break;
                }
            }
        }
        last
    }

    /// The chance that [`LitScene::pick_source`] picks a source.
    pub(crate) fn pick_chance(&self, number: usize, x: Vec3) -> f64 {
        self.candidates[number].chance(x, self.pull(x))
    }

    /// The columns and the rows of the pixels of a view, outside of which its lines of sight meet neither surface nor source.
    #[must_use]
    pub fn window(&self, view: &View) -> [Range<u32>; 2] {
        let sources = self.scene.sources.iter().zip(self.light_samplers);
        let lamps = sources
            .filter(|(_, sampler)| sampler.is_some())
            .map(|(source, _)| source.bounds());
        let faces = self.scene.face_set.bounds().iter().copied();
        let windows = faces.chain(lamps).map(|bounds| view.window(bounds));
        windows
            .filter(|[columns, rows]| !columns.is_empty() && !rows.is_empty())
            .fold([0..0, 0..0], |all, one| {
                let [columns, rows] = [0, 1].map(|k| match (&all[k], &one[k]) {
                    (none, some) if none.is_empty() => some.clone(),
                    (a, b) => a.start.min(b.start)..a.end.max(b.end),
                });
                [columns, rows]
            })
    }

    /// Whether that was set.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }
}

impl Candidate {
    /// How strongly it may light a point: its share of the flux over the square of the distance, or of its own radius if that is
    /// larger.
    fn pull(&self, x: Vec3) -> f64 {
        let away = x - self.centre;
        self.share / away.dot(away).max(self.radius2)
    }

    /// The chance that it is picked, where the pulls add up to `total`.
    fn chance(&self, x: Vec3, total: f64) -> f64 {
        if total > 0.0 {
            BY_FLUX * self.share + (1.0 - BY_FLUX) * self.pull(x) / total
        } else {
            self.share
        }
    }
}
