//! Patches of a carrier surface, each with an intensity table of its own: chapter 3 of the thesis.

mod cells;
mod tables;

use etendue_geometry::bounds::Bounds;
use etendue_math::{Frame, Vec3};
use etendue_sampling::alias::Alias;

use super::numbers::Numbers;

pub use cells::{Cells, Exit};
pub use tables::Steps;

/// A part of the carrier surface in its place, with its lit pixels.
#[derive(Clone, Debug)]
pub struct Part {
    /// Where it stands in the source.
    pub frame: Frame,
    /// Its pixels.
    pub cells: Cells,
    /// Numbers of the lit ones, rising.
    pub lit: Vec<usize>,
    /// The patch of the first of them; the others follow.
    pub first: usize,
}

/// A lit pixel.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Its axes in the source; z is its mean normal.
    pub axes: [Vec3; 3],
    /// What it shows along z \[mm²\].
    pub projected_area: f64,
    /// Of its table.
    pub steps: Steps,
    /// Where its table begins.
    pub start: usize,
}

/// Patches that emit: where a line meets one its luminance is I(θ, φ)/(A cos θ).
#[derive(Clone, Debug)]
pub struct PatchSource {
    parts: Vec<Part>,
    patches: Vec<Patch>,
    /// All tables, one after the other; their flux together is 1.
    values: Vec<f64>,
    /// Nodes of all tables by the flux of their hat functions.
    nodes: Alias,
    /// Patches by their flux, and the flux itself.
    picks: Alias,
    shares: Vec<f64>,
}

/// Light that leaves a patch.
#[derive(Clone, Copy, Debug)]
pub struct PatchLight {
    /// Along the line \[mm\].
    pub t: f64,
    /// Per unit of flux \[1/(mm² sr)\].
    pub luminance: f64,
    /// Cosine of the angle to the surface's normal.
    pub cosine: f64,
    /// Density by area of picking the point \[1/mm²\].
    pub density: f64,
}

impl PatchSource {
    /// `weights`: solid angles of the nodes \[sr\]. None if the numbers do not fit, a value is negative or all are 0.
    #[must_use]
    pub fn new(parts: Vec<Part>, patches: Vec<Patch>, values: Vec<f64>, weights: &[f64]) -> Option<Self> {
        let fits = |(i, patch): (usize, &Patch)| {
            let end = patches.get(i + 1).map_or(values.len(), |next| next.start);
            let Steps { theta, phi } = patch.steps;
            theta > 0
                && phi > 0
                && patch.start + patch.steps.rows() * patch.steps.columns() == end
                && patch.projected_area > 0.0
        };
        let mut next = 0;
        for part in &parts {
            let rising = part.lit.windows(2).all(|pair| pair[0] < pair[1]);
            let known = part.lit.last().is_none_or(|last| *last < part.cells.count());
            if part.first != next || !rising || !known {
                return None;
            }
            next += part.lit.len();
        }
        let sound = values.iter().all(|v| v.is_finite() && *v >= 0.0) && values.len() == weights.len();
        if next != patches.len() || patches.is_empty() || !patches.iter().enumerate().all(fits) || !sound {
            return None;
        }
        let fluxes: Vec<f64> = values.iter().zip(weights).map(|(v, w)| v * w).collect();
        let total: f64 = fluxes.iter().sum();
        let shares: Vec<f64> = patches
            .iter()
            .map(|patch| {
                let end = patch.start + patch.steps.rows() * patch.steps.columns();
                fluxes[patch.start..end].iter().sum::<f64>() / total
            })
            .collect();
        Some(Self {
            nodes: Alias::new(&fluxes)?,
            picks: Alias::new(&shares)?,
            values: values.into_iter().map(|v| v / total).collect(),
            parts,
            patches,
            shares,
        })
    }

    /// A box around all patches, placed by `frame`.
    #[must_use]
    pub fn bounds(&self, frame: &Frame) -> Bounds {
        let corners = self.parts.iter().flat_map(|part| {
            let corners = part.cells.bounds().corners();
            corners.map(|corner| frame.point_to_world(part.frame.point_to_world(corner)))
        });
        let found = Bounds::of(corners);
        found.widened(1e-9 * (found.hi - found.lo).length())
    }

    /// Intensity per unit of flux of a patch over what it shows towards a unit vector \[1/(mm² sr)\].
    fn luminance(&self, number: usize, k: Vec3) -> f64 {
        let patch = &self.patches[number];
        let [x, y, z] = patch.axes;
        let local = Vec3::new(x.dot(k), y.dot(k), z.dot(k));
        if local.z <= 0.0 {
            return 0.0;
        }
        patch.steps.value(&self.values[patch.start..], local) / (patch.projected_area * local.z)
    }

    /// Calls `visit` for the light that leaves along the unit vector `k` on the line through `p`: from one patch on each part
    /// at most, as light from a flat part passes the dome above it.
    pub fn leaving(&self, p: Vec3, k: Vec3, mut visit: impl FnMut(PatchLight)) {
        for part in &self.parts {
            let (p, k_own) = (part.frame.point_to_local(p), part.frame.direction_to_local(k));
            let Some(exit) = part.cells.exit(p, k_own) else {
                continue;
            };
            let Ok(place) = part.lit.binary_search(&exit.pixel) else {
                continue;
            };
            let number = part.first + place;
            visit(PatchLight {
                t: exit.t,
                luminance: self.luminance(number, k),
                cosine: exit.cosine,
                density: self.shares[number] / part.cells.area(),
            });
        }
    }

    /// The part of a patch.
    fn part_of(&self, number: usize) -> &Part {
        &self.parts[self.parts.partition_point(|part| part.first <= number) - 1]
    }

    /// A point, from patches by their flux, the normal there and the light towards `p` in the place of that along a line;
    /// None if none goes there.
    #[must_use]
    pub fn pick(&self, p: Vec3, numbers: &mut Numbers) -> Option<(Vec3, PatchLight)> {
        let number = self.picks.pick(numbers.draw());
        let part = self.part_of(number);
        let (point, normal) = part.cells.point(part.lit[number - part.first], numbers);
        let point = part.frame.point_to_world(point);
        let away = p - point;
        let distance = away.length();
        let k = away * (1.0 / distance);
        let cosine = part.frame.direction_to_world(normal).dot(k);
        let luminance = self.luminance(number, k);
        (cosine > 0.0 && luminance > 0.0 && distance > 0.0).then(|| {
            let density = self.shares[number] / part.cells.area();
            let light = PatchLight {
                t: distance,
                luminance,
                cosine,
                density,
            };
            (point, light)
        })
    }

    /// A ray: a node of a table by its flux, a direction from the hat about it, and a point of the patch by its cosine to that.
    #[must_use]
    pub fn draw(&self, numbers: &mut Numbers) -> (Vec3, Vec3) {
        let node = self.nodes.pick(numbers.draw());
        let number = self.patches.partition_point(|patch| patch.start <= node) - 1;
        let patch = &self.patches[number];
        let local = patch.steps.draw_about(node - patch.start, numbers);
        let [x, y, z] = patch.axes;
        let k = x * local.x + y * local.y + z * local.z;
        let part = self.part_of(number);
        let pixel = part.lit[number - part.first];
        let (k_own, normal) = (part.frame.direction_to_local(k), part.frame.direction_to_local(z));
        let most = part.cells.most_cosine(pixel, k_own, normal);
        loop {
            let (point, there) = part.cells.point(pixel, numbers);
            if matches!(part.cells, Cells::Squares { .. }) || numbers.draw() * most < there.dot(k_own) {
                return (part.frame.point_to_world(point), k);
            }
        }
    }
}
