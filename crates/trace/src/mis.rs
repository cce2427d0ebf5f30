//! Light that rays forwards and lines of sight both find, shared out between them.
//!
//! Light that smooth surfaces send to diffuse ones is found by lines of sight by chance, the more rarely the smaller the source;
//! rays traced forwards find it the more rarely the larger the source. Each path counts by the densities with which both find
//! it, the balance heuristic `[Veach1995]`. Smooth surfaces keep étendue, so that the densities can be compared where the
//! path ends: a ray forwards has the density L/Φ by étendue, a line of sight that is scattered diffusely the density p/π, with
//! p by area of the diffuse surface that it meets first. Refractive indices, and what diffuse surfaces on the way absorb, are
//! left out: the weights of a path add up to 1 whatever they are.

use std::f64::consts::FRAC_1_PI;

use etendue_lightfield::View;
use etendue_math::Vec3;
use etendue_optics::light_sampler::LightSampler;
use etendue_optics::source::Source;

/// Distance from its source at which the luminance of a ray is read, in units of the sizes involved: rounding is far smaller.
const NEAR: f64 = 1e-7;

/// How a light image and lines of sight share light out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MisBalance {
    /// Rays traced forwards for each line of sight of a pixel.
    pub rays: f64,
}

impl MisBalance {
    /// The part of the light of a path that rays traced forwards have; the rest is that of lines of sight.
    ///
    /// `density`: with which lines of sight of a pixel meet the first diffuse surface \[1/mm²\]; `brightness`: luminance of
    /// the source over the flux of all sources \[1/(mm² sr)\], ∞ if lines of sight cannot meet it.
    #[inline]
    #[must_use]
    pub fn forwards(self, density: f64, brightness: f64) -> f64 {
        let other = self.rays * brightness;
        if other.is_finite() {
            other / (density * FRAC_1_PI + other)
        } else {
            1.0
        }
    }
}

/// Density by area \[1/mm²\] with which a line of sight through a pixel, spread evenly over it, meets a surface: at distance
/// `distance` along `d` from the observer, at an angle with this cosine.
#[inline]
#[must_use]
pub fn density(view: &View, d: Vec3, distance: f64, cosine: f64) -> f64 {
    let slant = d.dot(view.normal);
    let t = (view.target - view.observer).dot(view.normal) / slant;
    let area = view.width * view.height / view.pixels() as f64;
    cosine.abs() * (t * t) / (distance * distance * area * slant.abs())
}

/// Ratio of two densities below which the rarer way has nothing: see [`power_weight`].
const CUTOFF: f64 = 0.1;

/// Weight of a sample that was drawn with the density `mine` where another way to draw it has the density `other`: the power
/// heuristic with exponent 2, and none for a way that is ten times as rare as the other `[Veach1995]`.
///
/// Where a small source is connected to, a drawn direction meets it once in thousands of lines. By the balance heuristic it would
/// bring as much light then as a connection does, and a pixel that has met no such line would know nothing of it: too low by what
/// the others share out, which is more than the error its connections show. By squares what is missed is of second order, which
/// connections to one of many lamps, spread evenly over the lines, still err less than.
#[inline]
#[must_use]
pub fn power_weight(mine: f64, other: f64) -> f64 {
    let ratio = other / mine;
    if ratio < CUTOFF {
        1.0
    } else if ratio > 1.0 / CUTOFF {
        0.0
    } else {
        1.0 / (1.0 + ratio * ratio)
    }
}

/// Reads the luminance of rays where they start.
#[derive(Clone, Copy, Debug)]
pub struct SourceLuminance<'a> {
    source: &'a Source,
    sampler: Option<&'a LightSampler>,
    /// Flux of all sources.
    total: f64,
    size: f64,
}

impl<'a> SourceLuminance<'a> {
    /// Of a source among sources of this flux in all.
    #[must_use]
    pub fn new(source: &'a Source, sampler: Option<&'a LightSampler>, total: f64) -> Self {
        let around = source.bounds();
        let size = (around.hi - around.lo).length();
        Self {
            source,
            sampler,
            total,
            size,
        }
    }

    /// Luminance over the flux of all sources of a ray that starts at `o` along `d` \[1/(mm² sr)\]; ∞ if lines of sight
    /// cannot meet it.
    #[must_use]
    pub fn at(&self, o: Vec3, d: Vec3) -> f64 {
        let Some(sampler) = self.sampler else {
            return f64::INFINITY;
        };
        let away = NEAR * (self.size + o.x.abs() + o.y.abs() + o.z.abs());
        let mut found = (f64::INFINITY, f64::INFINITY);
        sampler.along(self.source, o + d * away, -d, 2.0 * away, |hit| {
            let off = (hit.t - away).abs();
            if off < found.0 {
                found = (off, hit.luminance);
            }
        });
        found.1 / self.total
    }
}
