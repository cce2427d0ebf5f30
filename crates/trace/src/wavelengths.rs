//! Wavelengths of lines of sight: which of them a line has, and what in a scene treats them differently.
//!
//! A line of sight has one wavelength λ, drawn with probability q(λ), and what it finds of a source whose flux has the share s(λ)
//! there counts s(λ)/q(λ) times. Where nothing on its way is *selective*, what it finds is the same at all wavelengths, and counts
//! once: Σ s(λ) = 1. So colours are no noise of light that no selective surface or medium has changed.
//!
//! Any q that is not 0 gives the right mean. With q as the flux of all sources is spread, p(λ), a filter that passes one per cent
//! of it would be dark on most pixels that look through it with few lines, none of which would know. So one part of q is p, which
//! bounds what any line counts; one is p r/Σ p r, averaged over the responses r(λ) of the selective things: shares of finishes,
//! transmittances of media; one, where there are several sources, is the mean of their own spectra; and one, the same for all
//! wavelengths, is for what none of those foresees, such as two filters one behind the other or the colours of a prism.

use std::collections::HashMap;

use etendue_geometry::bounds::Bounds;
use etendue_math::Vec3;
use etendue_optics::bsdf::Media;

use crate::interaction::Interaction;
use crate::scene::{Act, Scene};

/// The part of q that is the same for all wavelengths.
const EVEN: f64 = 0.1;

/// The part of q that goes by responses, and by the spectra of several sources, where there are any.
const BY_RESPONSE: f64 = 0.4;
const BY_SOURCE: f64 = 0.1;

/// Values of the order of 1 that differ by less are taken for equal.
const SAME: f64 = 1e-9;

/// Cosines of the angles of incidence at which finishes are asked for their shares.
const ASKED: [f64; 2] = [1.0, 0.5];

/// A wavelength that lines of sight may have.
#[derive(Clone, Debug)]
struct Line {
    /// \[nm\].
    wavelength: f64,
    /// Its probability q, and the sum of those up to it.
    chance: f64,
    up_to: f64,
    /// The share of each source's flux that it has, over q.
    weights: Vec<f64>,
}

/// Whether a medium treats wavelengths differently.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SelectiveMedium {
    /// By its refractive index.
    bends: bool,
    /// By its absorption.
    absorbs: bool,
}

/// The wavelengths of the sources of a scene.
#[derive(Clone, Debug)]
pub struct Wavelengths {
    lines: Vec<Line>,
    /// For each finish, whether it is selective.
    finishes: Vec<bool>,
    /// For each medium.
    media: Vec<SelectiveMedium>,
}

impl Wavelengths {
    /// Those of the sources of a scene; a single one that stands for all of them where nothing in it is selective.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let all = all_wavelengths(scene);
        let mut used = vec![false; scene.finishes.len()];
        for role in &scene.roles {
            if let Act::Optical(finish) = role.act {
                used[finish as usize] = true;
            }
        }
        let finishes: Vec<bool> = scene
            .finishes
            .iter()
            .zip(used)
            .map(|(bsdf, used)| used && bsdf.is_selective())
            .collect();
        let media: Vec<SelectiveMedium> = scene
            .media
            .iter()
            .map(|medium| {
                let constants: Vec<_> = all.iter().map(|wavelength| medium.at(*wavelength)).collect();
                let ns: Vec<f64> = constants.iter().map(|at| at.n).collect();
                let alphas: Vec<f64> = constants.iter().map(|at| at.absorption).collect();
                SelectiveMedium {
                    bends: differs(&ns),
                    absorbs: differs(&alphas),
                }
            })
            .collect();
        let mut used = (0..=scene.solids.len()).map(|solid| {
            #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^16 solids")]
            let solid = solid as u16;
            media[scene.medium(solid)]
        });
        let any = finishes.contains(&true) || used.any(|medium| medium != SelectiveMedium::default());
        let lines = if any {
            spread(scene, &all, &finishes, &media)
        } else {
            let stands_for_all = |wavelength: &f64| Line {
                wavelength: *wavelength,
                chance: 1.0,
                up_to: 1.0,
                weights: vec![1.0; scene.sources.len()],
            };
            all.first().map(stands_for_all).into_iter().collect()
        };
        Self { lines, finishes, media }
    }

    /// How many there are.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.lines.len()
    }

    /// One of them \[nm\], by its number.
    #[inline]
    #[must_use]
    pub fn at(&self, line: usize) -> f64 {
        self.lines[line].wavelength
    }

    /// All of them \[nm\], rising.
    pub fn all(&self) -> impl Iterator<Item = f64> {
        self.lines.iter().map(|line| line.wavelength)
    }

    /// The probability that a line of sight has one of them.
    #[inline]
    #[must_use]
    pub fn chance(&self, line: usize) -> f64 {
        self.lines[line].chance
    }

    /// The number of the one that a number between 0 and 1 draws.
    #[inline]
    #[must_use]
    pub fn draw(&self, number: f64) -> usize {
        let place = self.lines.partition_point(|line| line.up_to < number);
        place.min(self.lines.len().saturating_sub(1))
    }

    /// How often the light of a source counts on a line of sight, whether anything on its way was selective.
    #[inline]
    #[must_use]
    pub fn weight(&self, line: usize, source: usize, selective: bool) -> f64 {
        if selective {
            self.lines[line].weights[source]
        } else {
            1.0
        }
    }

    /// Whether what is met somewhere treats wavelengths differently.
    #[inline]
    #[must_use]
    pub fn are_told_at(&self, scene: &Scene, interaction: &Interaction) -> bool {
        interaction.finish.is_some_and(|finish| {
            let bends = |solid| self.media[scene.medium(solid)].bends;
            self.finishes[finish as usize] || bends(interaction.before.top()) || bends(interaction.after.top())
        })
    }

    /// Whether an interface with the medium of a solid (0: the surroundings) bends them differently.
    #[inline]
    #[must_use]
    pub fn are_bent_by(&self, scene: &Scene, solid: u16) -> bool {
        self.media[scene.medium(solid)].bends
    }

    /// Whether the medium of a solid (0: the surroundings) absorbs them differently.
    #[inline]
    #[must_use]
    pub fn are_absorbed_by(&self, scene: &Scene, solid: u16) -> bool {
        self.media[scene.medium(solid)].absorbs
    }
}

/// All wavelengths of the sources, rising.
fn all_wavelengths(scene: &Scene) -> Vec<f64> {
    let each = scene.sources.iter().flat_map(|source| source.spectrum.iter());
    let mut all: Vec<f64> = each.map(|line| line.0).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// Whether some of the values are not the same; all of them are what nobody knows, if one is.
fn differs(values: &[f64]) -> bool {
    let [low, high] = [f64::min, f64::max].map(|pick| values.iter().copied().fold(f64::NAN, pick));
    high - low > SAME * high.abs().max(1.0) || values.iter().any(|value| value.is_nan())
}

/// The wavelengths with their probabilities.
fn spread(scene: &Scene, all: &[f64], finishes: &[bool], media: &[SelectiveMedium]) -> Vec<Line> {
    let total: f64 = scene.sources.iter().map(|source| source.flux).sum();
    let mut own = vec![vec![0.0; scene.sources.len()]; all.len()];
    for (number, source) in scene.sources.iter().enumerate() {
        let mut below = 0.0;
        for (wavelength, up_to) in &source.spectrum {
            let line = all.partition_point(|one| one < wavelength);
            own[line][number] += up_to - below;
            below = *up_to;
        }
    }
    let count = all.len() as f64;
    let by_flux = |shares: &Vec<f64>| {
        let each = shares.iter().zip(&scene.sources);
        each.map(|(share, source)| share * source.flux / total).sum::<f64>()
    };
    let p: Vec<f64> = own.iter().map(by_flux).collect();
    let mut parts = vec![(EVEN, vec![1.0 / count; all.len()])];
    if scene.sources.len() > 1 {
        let mean = |shares: &Vec<f64>| shares.iter().sum::<f64>() / scene.sources.len() as f64;
        parts.push((BY_SOURCE, own.iter().map(mean).collect()));
    }
    let seen: Vec<Vec<f64>> = responses(scene, all, finishes, media)
        .into_iter()
        .filter_map(|response| {
            let passed: Vec<f64> = response.iter().zip(&p).map(|(r, p)| r * p).collect();
            let sum = passed.iter().sum::<f64>();
            (differs(&response) && sum > 0.0).then(|| passed.iter().map(|one| one / sum).collect())
        })
        .collect();
    if !seen.is_empty() {
        let mean = |line: usize| seen.iter().map(|one: &Vec<f64>| one[line]).sum::<f64>() / seen.len() as f64;
        parts.push((BY_RESPONSE, (0..all.len()).map(mean).collect()));
    }
    let rest = 1.0 - parts.iter().map(|(part, _)| part).sum::<f64>();
    parts.push((rest, p));
    let chances: Vec<f64> = (0..all.len())
        .map(|line| parts.iter().map(|(part, q)| part * q[line]).sum())
        .collect();
    let whole: f64 = chances.iter().sum();
    let mut up_to = 0.0;
    let lines = all.iter().zip(chances).zip(own);
    lines
        .map(|((wavelength, chance), own)| {
            let chance = chance / whole;
            up_to += chance;
            Line {
                wavelength: *wavelength,
                chance,
                up_to,
                weights: own.into_iter().map(|share| share / chance).collect(),
            }
        })
        .collect()
}

/// The shares of light that selective finishes send on, and selective media let through, over the wavelengths.
fn responses(scene: &Scene, all: &[f64], finishes: &[bool], media: &[SelectiveMedium]) -> Vec<Vec<f64>> {
    let mut found = Vec::new();
    for (bsdf, _) in scene.finishes.iter().zip(finishes).filter(|(_, selective)| **selective) {
        for cosine in ASKED.into_iter().flat_map(|cosine| [cosine, -cosine]) {
            let incident = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let shares = |wavelength: &f64| {
                let media = Media {
                    wavelength: *wavelength,
                    front: 1.0,
                    back: 1.0,
                };
                bsdf.shares(incident, &media).in_order()
            };
            let at_each: Vec<[f64; 4]> = all.iter().map(shares).collect();
            for component in 0..4 {
                found.push(at_each.iter().map(|shares| shares[component]).collect());
            }
        }
    }
    for (medium, lengths) in ways(scene, media) {
        let absorption: Vec<f64> = all.iter().map(|at| scene.media[medium].at(*at).absorption).collect();
        for length in lengths {
            found.push(absorption.iter().map(|alpha| (-alpha * length).exp()).collect());
        }
    }
    found
}

/// Media that absorb wavelengths differently, with a short and a long way through what they fill: the least side of any of the
/// boxes about those solids, and the greatest diagonal; for the surroundings those of the whole scene.
fn ways(scene: &Scene, media: &[SelectiveMedium]) -> Vec<(usize, [f64; 2])> {
    let mut boxes: HashMap<u16, Bounds> = HashMap::new();
    for (role, bounds) in scene.roles.iter().zip(scene.face_set.bounds()) {
        for solid in [0, role.solid] {
            let held = boxes.entry(solid).or_insert(Bounds::EMPTY);
            *held = held.union(*bounds);
        }
    }
    let mut ways = vec![[f64::INFINITY, 0.0]; media.len()];
    for (solid, bounds) in &boxes {
        let size = bounds.hi - bounds.lo;
        let (least, most) = (size.x.min(size.y).min(size.z), size.length());
        let way = &mut ways[scene.medium(*solid)];
        *way = [way[0].min(least), way[1].max(most)];
    }
    let those = ways.into_iter().enumerate().zip(media);
    those
        .filter(|((_, [short, long]), medium)| medium.absorbs && short.is_finite() && long.is_finite())
        .map(|(way, _)| way)
        .collect()
}
