//! A scene with what its sources need to be seen from other points.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use etendue_lightfield::View;
use etendue_optics::light_sampler::LightSampler;

use crate::scene::Scene;

/// A scene with what its sources need to be looked at.
#[derive(Clone, Debug)]
pub struct LitScene<'a> {
    pub(crate) scene: &'a Scene,
    /// None for those that cannot be seen backwards.
    pub(crate) light_samplers: &'a [Option<LightSampler>],
    /// Flux of all sources.
    pub(crate) flux: f64,
    /// Sums of the shares of the sources' flux.
    pub(crate) shares: Vec<f64>,
    /// Wavelengths: sum of the shares, the wavelength, and how much of each source's flux has it, over its share.
    pub(crate) lines: Vec<(f64, f64, Vec<f64>)>,
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
            light_samplers,
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
