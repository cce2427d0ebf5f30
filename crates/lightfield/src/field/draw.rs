//! Rays drawn from a light field: as many as wanted, each from its address.

use std::ops::Range;
use std::sync::Arc;

use etendue_geometry::{RayBatch, RaySource};
use etendue_sampling::alias::Alias;
use etendue_sampling::philox::Stream;

use super::light_field::LightField;
use super::tent::under_tent;
use super::under_tents::UnderTents;

/// The purpose under which rays are drawn from a field (see [`Stream::new`]).
pub const PURPOSE_FIELD: u64 = 0x4649_454C;

/// What has to be worked out once before rays can be drawn.
#[derive(Clone, Debug)]
pub struct Sampler {
    field: Arc<LightField>,
    /// Over the cells of all parts, by the flux under their tents.
    cells: Alias,
    /// Where the cells of each part begin.
    starts: Vec<usize>,
    /// Factors under tents, over place and direction; None where a factor is 1.
    under: Vec<[Option<UnderTents>; 2]>,
    /// Of all parts.
    flux: f64,
    /// Of each part, and of each cell of its place.
    fluxes: Vec<(f64, Vec<f64>)>,
}

impl Sampler {
    /// None if the field has no flux.
    #[must_use]
    pub fn new(field: impl Into<Arc<LightField>>) -> Option<Self> {
        let field = field.into();
        let (mut weights, mut starts, mut under, mut fluxes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for part in &field.parts {
            starts.push(weights.len());
            let [n1, n2, n3, n4] = part.cells;
            let tables = [(&part.space, [n1, n2]), (&part.direction, [n3, n4])];
            let tables = tables.map(|(factor, cells)| (!factor.is_one()).then(|| UnderTents::new(factor, cells)));
            let [space, direction] = part.tent_masses();
            let scale = part.level * part.part.etendue();
            let products = space.iter().flat_map(|s| direction.iter().map(move |d| s * d));
            weights.extend(
                part.ratio
                    .iter()
                    .zip(products)
                    .map(|(r, m)| scale * f64::from(r[0]) * m),
            );
            fluxes.push(part.flux_and_places());
            under.push(tables);
        }
        let cells = Alias::new(&weights)?;
        Some(Self {
            field,
            cells,
            starts,
            under,
            flux: fluxes.iter().map(|(flux, _)| flux).sum(),
            fluxes,
        })
    }

    /// The field that is drawn from.
    #[must_use]
    pub fn field(&self) -> &LightField {
        &self.field
    }

    /// The flux of each part, and that of each cell of its place.
    #[must_use]
    pub fn fluxes(&self) -> &[(f64, Vec<f64>)] {
        &self.fluxes
    }

    /// Rays `first..` of a stream, as many as there is room for.
    ///
    /// Step by step for all of them: the tables are larger than the caches of a processor, and while it waits for an entry of one
    /// ray, it asks for those of others.
    ///
    /// # Panics
    /// If there is room for more than [`TOGETHER`].
    pub fn draw(&self, stream: Stream, first: u64, rays: &mut [Drawn]) {
        let parts = &self.field.parts;
        let mut all_numbers: [_; TOGETHER] =
            std::array::from_fn(|i| Numbers::new(stream, first.wrapping_add(i as u64)));
        let (mut all_cells, mut all_hats) = ([[0; 4]; TOGETHER], [None; TOGETHER]);
        let (numbers, cells, hats) = (
            &mut all_numbers[..rays.len()],
            &mut all_cells[..rays.len()],
            &mut all_hats[..rays.len()],
        );
        for (numbers, [cell, ..]) in numbers.iter_mut().zip(&mut *cells) {
            *cell = self.cells.pick(numbers.next());
        }
        for (ray, index) in rays.iter_mut().zip(&mut *cells) {
            let cell = index[0];
            ray.part = self.starts.partition_point(|start| *start <= cell) - 1;
            let [_, n2, n3, n4] = parts[ray.part].cells;
            let local = cell - self.starts[ray.part];
            *index = [
                local / (n2 * n3 * n4),
                local / (n3 * n4) % n2,
                local / n4 % n3,
                local % n4,
            ];
        }
        for (pair, axis) in [0, 2].into_iter().enumerate() {
            for (((ray, index), numbers), hat) in rays.iter().zip(&*cells).zip(&mut *numbers).zip(&mut *hats) {
                *hat = self.under[ray.part][pair]
                    .as_ref()
                    .and_then(|table| table.pick([index[axis], index[axis + 1]], numbers.next()));
            }
            for (((ray, index), numbers), hat) in rays.iter_mut().zip(&*cells).zip(&mut *numbers).zip(&*hats) {
                let (field, cell) = (&parts[ray.part], [index[axis], index[axis + 1]]);
                ray.coordinates[pair] = match &self.under[ray.part][pair] {
                    Some(table) => table.point(cell, *hat, || numbers.next()),
                    None => [0, 1].map(|k| {
                        let wraps = field.part.wraps() && axis + k == 0;
                        under_tent(cell[k], numbers.next(), field.cells[axis + k], wraps)
                    }),
                };
            }
        }
    }
}

/// Rays that can be drawn at a time.
pub const TOGETHER: usize = 64;

/// What is drawn of a ray.
#[derive(Clone, Copy, Debug, Default)]
pub struct Drawn {
    /// The part of the surface that it leaves.
    pub part: usize,
    /// Its place and its direction there.
    pub coordinates: [[f64; 2]; 2],
}

/// The uniform numbers of one ray.
#[derive(Clone, Copy)]
struct Numbers {
    stream: Stream,
    /// Of the ray.
    index: u64,
    /// The next block of numbers, those at hand, and how many of them have been used.
    block: u64,
    at_hand: [f64; 4],
    used: usize,
}

impl Numbers {
    fn new(stream: Stream, index: u64) -> Self {
        Self {
            stream,
            index,
            block: 1,
            at_hand: stream.uniforms(index, 0),
            used: 0,
        }
    }

    #[inline(always)]
    fn next(&mut self) -> f64 {
        if self.used == 4 {
            (self.at_hand, self.used) = (self.stream.uniforms(self.index, self.block), 0);
            self.block += 1;
        }
        self.used += 1;
        self.at_hand[self.used - 1]
    }
}

/// A number of equal rays drawn from a field.
#[derive(Clone, Copy, Debug)]
pub struct FieldRays<'a> {
    /// What is drawn from.
    pub sampler: &'a Sampler,
    /// Number of rays; together they carry the flux of the field.
    pub rays: u64,
    /// Seed of the draw.
    pub seed: u64,
}

impl RaySource for FieldRays<'_> {
    fn len(&self) -> u64 {
        self.rays
    }

    #[allow(clippy::cast_possible_truncation, reason = "a range of at most a block")]
    fn fill(&self, range: Range<u64>, batch: &mut RayBatch) {
        let stream = Stream::new(self.seed, PURPOSE_FIELD);
        let flux = self.sampler.flux / self.rays as f64;
        batch.len = (range.end - range.start) as usize;
        batch.colour.clear();
        let mut drawn = [Drawn::default(); TOGETHER];
        for begin in (0..batch.len).step_by(TOGETHER) {
            let drawn = &mut drawn[..TOGETHER.min(batch.len - begin)];
            self.sampler.draw(stream, range.start + begin as u64, drawn);
            for (i, ray) in (begin..).zip(&*drawn) {
                let [place, direction] = ray.coordinates;
                let (x, k) = self.sampler.field.parts[ray.part].part.ray(place, direction);
                for (axis, (x, k)) in [(x.x, k.x), (x.y, k.y), (x.z, k.z)].into_iter().enumerate() {
                    batch.position[axis][i] = x;
                    batch.direction[axis][i] = k;
                }
            }
        }
        batch.flux[..batch.len].fill(flux);
        batch.settle();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::light_field::tests::rough;
    use crate::field::tent::cell_of;

    #[test]
    fn rays_have_the_density_of_the_luminance() {
        // χ² over the 4·2·4·2 cells of two parts of different shape; expected shares by the midpoint rule, whose error
        // is far below the sampling error of 400 000 rays. 1e-4 point for 127 degrees of freedom: 194.
        let field = LightField {
            parts: vec![rough(2), rough(3)],
        };
        let sampler = Sampler::new(field.clone()).expect("flux");
        let stream = Stream::new(4, PURPOSE_FIELD);
        let rays = 400_000;
        let mut counts = vec![0.0; 128];
        let bin = |part: usize, at: [f64; 4]| {
            let [i, j, k, l] = [0, 1, 2, 3].map(|m| cell_of(at[m], [4, 2, 4, 2][m]));
            part * 64 + ((i * 2 + j) * 4 + k) * 2 + l
        };
        let mut drawn = [Drawn::default(); TOGETHER];
        for first in (0..rays).step_by(TOGETHER) {
            sampler.draw(stream, first, &mut drawn);
            for ray in drawn {
                let [[x, y], [a, b]] = ray.coordinates;
                counts[bin(ray.part, [x, y, a, b])] += 1.0;
            }
        }
        let mut expected = vec![0.0; 128];
        let n = 32_usize;
        for (p, part) in field.parts.iter().enumerate() {
            for index in 0..n.pow(4) {
                let strides = [1, n, n * n, n * n * n];
                let at = strides.map(|stride| ((index / stride % n) as f64 + 0.5) / n as f64);
                expected[bin(p, at)] += part.at([at[0], at[1]], [at[2], at[3]]).value * part.part.etendue();
            }
        }
        let total: f64 = expected.iter().sum();
        let chi2: f64 = counts
            .iter()
            .zip(&expected)
            .map(|(n, e)| (n, e / total * rays as f64))
            .map(|(n, e)| (n - e) * (n - e) / e)
            .sum();
        assert!(chi2 < 194.0, "{chi2}");
    }

    #[test]
    fn every_ray_has_its_address() {
        let sampler = Sampler::new(LightField { parts: vec![rough(1)] }).expect("flux");
        let rays = FieldRays {
            sampler: &sampler,
            rays: 5000,
            seed: 7,
        };
        let (mut whole, mut part) = (RayBatch::default(), RayBatch::default());
        rays.fill(0..2048, &mut whole);
        rays.fill(1000..1010, &mut part);
        for i in 0..10 {
            assert_eq!(part.position(i), whole.position(1000 + i));
            assert_eq!(part.direction(i), whole.direction(1000 + i));
        }
    }

    #[test]
    fn a_dark_field_cannot_be_drawn_from() {
        let mut field = rough(0);
        field.level = 0.0;
        assert!(Sampler::new(LightField { parts: vec![field] }).is_none());
    }
}
