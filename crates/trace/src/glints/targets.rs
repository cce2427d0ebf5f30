//! Sources that are looked for in a view: points of them, and how they are spread.

use etendue_geometry::RayBatch;
use etendue_lightfield::View;
use etendue_math::Vec3;

use crate::lit_scene::LitScene;

/// Points of each source that are looked for.
const POINTS: usize = 64;

/// Those among them that tell how large the source is about one of them.
const TOGETHER: usize = 8;

/// The seed of the points of sources: any does.
const SEED: u64 = 0x474C_494E_5453;

/// A covariance in space, by rows.
pub type Spread = [[f64; 3]; 3];

/// Points of a source and how they are spread.
#[derive(Debug)]
pub struct Target {
    pub(super) source: usize,
    pub(super) points: Vec<Vec3>,
    pub(super) middle: Vec3,
    pub(super) radius: f64,
    /// Covariance of all points, and of those about each.
    pub(super) spread: Spread,
    pub(super) about: Vec<Spread>,
}

/// What a view may show small images of.
pub fn targets(lit: &LitScene<'_>, view: &View) -> Vec<Target> {
    (0..lit.scene.sources.len())
        // A source that stands around the observer is a surround, not a lamp: glass shows all of it in little.
        .filter(|number| !lit.scene.sources[*number].bounds().contains(view.observer))
        .filter_map(|number| target(lit, number))
        .collect()
}

/// Points of a source that can be seen; None if it cannot.
fn target(lit: &LitScene<'_>, number: usize) -> Option<Target> {
    let source = &lit.scene.sources[number];
    lit.light_samplers[number].as_ref()?;
    let mut batch = RayBatch::default();
    source.emit(number as u64, 0..POINTS as u64, POINTS as u64, SEED, &[], &mut batch);
    let points: Vec<Vec3> = (0..batch.len)
        .filter(|i| batch.usable(*i))
        .map(|i| batch.position(i))
        .collect();
    let (middle, spread) = moments(points.iter())?;
    let radius = points.iter().map(|p| (*p - middle).length()).fold(0.0, f64::max);
    if radius == 0.0 {
        return None;
    }
    let about = points.iter().map(|point| {
        let mut others: Vec<&Vec3> = points.iter().collect();
        others.sort_by(|a, b| (**a - *point).length().total_cmp(&(**b - *point).length()));
        Some(moments(others.into_iter().take(TOGETHER))?.1)
    });
    Some(Target {
        source: number,
        about: about.collect::<Option<_>>()?,
        points,
        middle,
        radius,
        spread,
    })
}

/// Mean and covariance of points.
fn moments<'p>(points: impl Iterator<Item = &'p Vec3> + Clone) -> Option<(Vec3, Spread)> {
    let n = points.clone().count() as f64;
    let zero = Vec3::new(0.0, 0.0, 0.0);
    let mean = points.clone().fold(zero, |sum, p| sum + *p) * (1.0 / n);
    let mut spread = [[0.0; 3]; 3];
    for point in points {
        let off = *point - mean;
        let off = [off.x, off.y, off.z];
        for (row, a) in spread.iter_mut().zip(off) {
            for (cell, b) in row.iter_mut().zip(off) {
                *cell += a * b / n;
            }
        }
    }
    (n > 0.0).then_some((mean, spread))
}
