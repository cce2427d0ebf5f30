//! How a map is computed, and what is summed for each of its pixels.

use crate::bright_spots::BrightSpots;
use crate::glints::Glints;
use crate::guide::Guide;
use crate::mis::MisBalance;

/// What lines of sight do not look for, because something else finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LeftOut {
    /// Nothing.
    Nothing,
    /// Light that reaches a diffuse surface through smooth ones, and from there the observer directly or over other diffuse ones.
    Caustics,
    /// Of that light, the share of rays traced forwards.
    Shared(MisBalance),
    /// All light that reaches the observer directly from a diffuse surface.
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
    pub left: LeftOut,
    /// Where paths that do not see a diffuse surface directly go on from there, if that is known.
    pub guide: Option<&'a Guide>,
    /// Small places of diffuse surfaces that a part of the paths goes on to, if there are such.
    pub spots: Option<&'a BrightSpots>,
    /// Small images of sources, where as many paths again look for them, and four in each pass at least.
    pub glints: Option<&'a Glints>,
}

/// Sums over passes: of the mean of each pass, of those parts of it which were scattered and which are found by chance only, of the sources' own
/// deviation, and of the shares of the lines of sight that meet smooth and diffuse surfaces first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Mean luminance of the lines.
    pub mean: f64,
    /// That part of it which was scattered on its way.
    pub scattered: f64,
    /// Mean of the light that drawn directions bring to a source through smooth surfaces, where rays forwards cannot take it
    /// over: rare, and bright.
    pub chance: f64,
    /// What the sources say that their part of the mean may err by.
    pub deviation: f64,
    /// Shares of the lines that meet a smooth surface first, and of those that see a diffuse one directly.
    pub met: [f64; 2],
    /// Mean weight that lines still had when they had met as many surfaces as they may and were given up.
    pub given_up: f64,
    /// Mean weight of lines that were lost, as the solids they were in contradict the faces they met.
    pub lost: f64,
}
