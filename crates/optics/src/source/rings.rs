//! Concentric Lambertian rings in the plane z = 0: the test source of `[Audenaert2014]` section 2.3.

use std::ops::Range;

use etendue_geometry::{RayBatch, RaySource};
use etendue_sampling::philox::Stream;
use etendue_sampling::warp::{square_to_annulus, square_to_cosine_hemisphere};
use multiversion::multiversion;

/// The purpose under which the rays of a source are drawn (see [`Stream::new`]).
const PURPOSE_RAYS: u64 = 0x5241_5953;

/// One zone: emits `rays` rays per run, which share `flux`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Inner radius \[mm\].
    pub inner: f64,
    /// Outer radius \[mm\].
    pub outer: f64,
    /// Flux \[lm\] of the zone, over all runs.
    pub flux: f64,
    /// Rays per run.
    pub rays: u64,
}

/// Rings that emit towards +Z with constant luminance Φ/(π A) each (eq. 2.9), as a sequence of runs with seeds of their
/// own: run r has seed `seed + r`, and the flux of a ray is divided by the number of runs (section 2.3.1).
#[derive(Clone, Debug)]
pub struct RingSource {
    rings: Vec<Ring>,
    runs: u64,
    seed: u64,
    rays_per_run: u64,
}

impl RingSource {
    /// A source of `runs` runs; None if there is no ray, or their number exceeds u64.
    #[must_use]
    pub fn new(rings: Vec<Ring>, runs: u64, seed: u64) -> Option<Self> {
        let rays_per_run = rings.iter().try_fold(0_u64, |sum, ring| sum.checked_add(ring.rays))?;
        let total = rays_per_run.checked_mul(runs)?;
        (total > 0).then_some(Self {
            rings,
            runs,
            seed,
            rays_per_run,
        })
    }
}

impl RaySource for RingSource {
    fn len(&self) -> u64 {
        self.rays_per_run * self.runs
    }

    #[allow(clippy::cast_possible_truncation, reason = "a range is at most one block long")]
    fn fill(&self, range: Range<u64>, batch: &mut RayBatch) {
        batch.len = (range.end - range.start) as usize;
        batch.colour.clear();
        batch.defects = Default::default();
        batch.norm_error = 0.0;
        let [px, py, pz] = &mut batch.position;
        let [kx, ky, kz] = &mut batch.direction;
        let mut index = range.start;
        while index < range.end {
            let (run, ray) = (index / self.rays_per_run, index % self.rays_per_run);
            let mut first = 0;
            let ring = self
                .rings
                .iter()
                .find(|ring| {
                    let inside = ray < first + ring.rays;
                    first += if inside { 0 } else { ring.rays };
                    inside
                })
                .expect("ray < rays_per_run, which is the sum over the rings");
            let stretch = (first + ring.rays - ray).min(range.end - index);
            let begin = (index - range.start) as usize;
            let slots = begin..begin + stretch as usize;
            let stream = Stream::new(self.seed.wrapping_add(run), PURPOSE_RAYS);
            emit(
                ring,
                stream,
                ray,
                [&mut px[slots.clone()], &mut py[slots.clone()]],
                [&mut kx[slots.clone()], &mut ky[slots.clone()], &mut kz[slots.clone()]],
            );
            pz[slots.clone()].fill(0.0);
            batch.flux[slots].fill(ring.flux / (ring.rays * self.runs) as f64);
            index += stretch;
        }
    }
}

/// Draws the rays of one ring from number `ray` on into arrays of equal length.
///
/// Two loops, the integer generator and then the geometry, so that each runs several rays at a time. No operation is
/// fused or reordered: every instruction set gives the same bits.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn emit(ring: &Ring, stream: Stream, ray: u64, position: [&mut [f64]; 2], direction: [&mut [f64]; 3]) {
    let [xs, ys] = position;
    let [ps, qs, rs] = direction;
    for (i, (((x, y), p), q)) in (ray..).zip(xs.iter_mut().zip(ys.iter_mut()).zip(ps.iter_mut()).zip(qs.iter_mut())) {
        [*x, *y, *p, *q] = stream.uniforms(i, 0);
    }
    for ((((x, y), p), q), r) in xs.iter_mut().zip(ys).zip(ps).zip(qs).zip(rs) {
        (*x, *y) = square_to_annulus(*x, *y, ring.inner, ring.outer);
        (*p, *q, *r) = square_to_cosine_hemisphere(*p, *q);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source() -> RingSource {
        let rings = vec![
            Ring {
                inner: 0.0,
                outer: 10.0,
                flux: 300.0,
                rays: 3001,
            },
            Ring {
                inner: 10.0,
                outer: 20.0,
                flux: 200.0,
                rays: 5003,
            },
        ];
        RingSource::new(rings, 3, 11).expect("rays")
    }

    #[test]
    fn a_ray_does_not_depend_on_the_block_it_is_read_in() {
        let source = source();
        let (mut whole, mut single) = (RayBatch::default(), RayBatch::default());
        source.fill(7000..9000, &mut whole);
        for i in [0, 1, 999, 1003, 1004, 1005, 1999] {
            source.fill(7000 + i as u64..7001 + i as u64, &mut single);
            assert_eq!(whole.position(i), single.position(0));
            assert_eq!(whole.direction(i), single.direction(0));
        }
    }

    #[test]
    fn rays_lie_in_their_ring_and_the_flux_adds_up() {
        let source = source();
        let mut fluxes = [0.0; 2];
        source.for_each_block(0..source.len(), |start, batch| {
            for i in 0..batch.len {
                let ring = usize::from((start + i as u64) % 8004 >= 3001);
                let r = batch.position[0][i].hypot(batch.position[1][i]);
                assert!(r >= [0.0, 10.0][ring] && r <= [10.0, 20.0][ring]);
                assert!((batch.direction(i).length() - 1.0).abs() < 4e-16 && batch.direction[2][i] > 0.0);
                fluxes[ring] += batch.flux[i];
            }
        });
        assert!((fluxes[0] - 300.0).abs() < 1e-9 && (fluxes[1] - 200.0).abs() < 1e-9);
    }

    #[test]
    fn runs_differ() {
        let source = source();
        let (mut a, mut b) = (RayBatch::default(), RayBatch::default());
        source.fill(0..10, &mut a);
        source.fill(8004..8014, &mut b);
        assert!((0..10).all(|i| a.position(i) != b.position(i)));
    }
}
