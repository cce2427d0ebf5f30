//! The cone estimator of `[Audenaert2014]` chapter 2.
//!
//! A ray belongs to pixel p if its line crosses p, and it is seen if the angle between its direction and the line from
//! p's centre to the observer is below the acceptance α (eq. 2.2). The sum of the seen flux per pixel, divided by solid
//! angle and apparent area (eqs. 2.3, 2.4), is the luminance; that division is left to the caller, who knows the units.

use std::ops::{ControlFlow, Range};

use etendue_geometry::{PassAccount, RayBatch, RaySource};
use etendue_math::Vec3;
use etendue_sampling::ordered;
use multiversion::multiversion;

use crate::view::View;

/// Sums over the seen rays, for each acceptance and pixel (acceptance · pixels + pixel), in ray order.
#[derive(Clone, Debug)]
pub struct Sums {
    /// Σ w, the flux.
    pub flux: Vec<f64>,
    /// Σ w²: the variance of the flux, for a Poisson process of weighted rays.
    pub flux_squared: Vec<f64>,
    /// Number of rays that carry flux.
    pub rays: Vec<u64>,
}

impl Sums {
    fn new(cells: usize) -> Self {
        Self {
            flux: vec![0.0; cells],
            flux_squared: vec![0.0; cells],
            rays: vec![0; cells],
        }
    }
}

/// A view with the acceptance half-angles \[rad\] under which its rays are counted, rising; the cones are nested.
#[derive(Clone, Debug)]
pub struct Cone {
    /// The observer and the pixels.
    pub view: View,
    /// Half-angles α, rising, each above 0 and at most π/2.
    pub acceptances: Vec<f64>,
    /// Radius of the disk about the observer, facing the target, that a ray has to cross in place of the test of its angle
    /// (fig. 2.2) \[mm\]. There is one acceptance then, that no such ray exceeds; it may go up to π.
    pub disk: Option<f64>,
}

/// A seen ray: its pixel, the narrowest acceptance that sees it, its flux.
struct Hit {
    pixel: u32,
    narrowest: u32,
    flux: f64,
}

/// A cone with everything that can be worked out before the first ray.
struct Prepared {
    view: View,
    axis: [f64; 3],
    /// A ray whose direction has a smaller cosine to `axis` is seen through no pixel.
    cos_field: f64,
    /// cos α, falling.
    cosines: Vec<f64>,
    /// Radius of the observer's disk, and the direction that it faces away from.
    disk: Option<(f64, Vec3)>,
}

impl Prepared {
    fn new(cone: &Cone) -> Self {
        let (axis, field) = cone.view.field();
        let widest = cone.acceptances.last().copied().unwrap_or(0.0);
        // Outward by 1e-9 rad: the test may let a ray through that the exact one below refuses, never the reverse.
        let bound = (field + widest + 1e-9).min(std::f64::consts::PI);
        Self {
            view: cone.view,
            axis: [axis.x, axis.y, axis.z],
            cos_field: bound.cos() - 1e-15,
            cosines: cone.acceptances.iter().map(|a| a.cos()).collect(),
            disk: cone
                .disk
                .map(|radius| (radius, (cone.view.observer - cone.view.target).normalized())),
        }
    }

    fn collect(&self, batch: &RayBatch, ahead: &mut Vec<usize>, hits: &mut Vec<Hit>) {
        let directions = batch.direction.each_ref().map(|axis| &axis[..batch.len]);
        heading(self.axis, self.cos_field, directions, ahead);
        for &i in &*ahead {
            if batch.flux[i] > 0.0 {
                let k = batch.direction(i);
                let Some(pixel) = self.view.pixel(batch.position(i), k) else {
                    continue;
                };
                let narrowest = if let Some((radius, away)) = self.disk {
                    let ahead = k.dot(away);
                    let to_plane = self.view.observer - batch.position(i);
                    let off = k * (to_plane.dot(away) / ahead) - to_plane;
                    (ahead > 0.0 && off.dot(off) < radius * radius).then_some(0)
                } else {
                    let cos_theta = k.dot(self.view.to_eye(pixel));
                    self.cosines.iter().position(|&limit| cos_theta > limit)
                };
                if let Some(narrowest) = narrowest {
                    #[allow(clippy::cast_possible_truncation, reason = "there are a handful of acceptances")]
                    hits.push(Hit {
                        pixel,
                        narrowest: narrowest as u32,
                        flux: batch.flux[i],
                    });
                }
            }
        }
    }
}

/// Directions that are compared with the axis together: most of them have none among them that heads for it.
const TOGETHER: usize = 32;

/// The numbers of the directions whose cosine to `axis` is not below a least one: several at a time, the same bits on every
/// instruction set.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn heading(axis: [f64; 3], least: f64, directions: [&[f64]; 3], found: &mut Vec<usize>) {
    found.clear();
    let [kx, ky, kz] = directions;
    let chunks = kx.chunks(TOGETHER).zip(ky.chunks(TOGETHER)).zip(kz.chunks(TOGETHER));
    for (first, ((kx, ky), kz)) in (0..).step_by(TOGETHER).zip(chunks) {
        let (mut cosines, mut any) = ([f64::NEG_INFINITY; TOGETHER], false);
        for (((cosine, x), y), z) in cosines.iter_mut().zip(kx).zip(ky).zip(kz) {
            *cosine = x * axis[0] + y * axis[1] + z * axis[2];
            any |= *cosine >= least;
        }
        if any {
            found.extend((0..kx.len()).filter(|i| cosines[*i] >= least).map(|i| first + i));
        }
    }
}

/// Sums of the seen rays for any number of cones, in one pass over the source.
///
/// Each pixel's sums run in ray order, whatever the number of threads: threads only find the hits, which are then added
/// one after another. Memory: the sums and the hits of one round of batches. Ends early if `progress` breaks.
pub fn cone_sums(
    source: &impl RaySource,
    cones: &[Cone],
    threads: usize,
    progress: impl FnMut(u64) -> ControlFlow<()>,
) -> (Vec<Sums>, PassAccount) {
    let prepared: Vec<Prepared> = cones.iter().map(Prepared::new).collect();
    let mut sums: Vec<Sums> = cones
        .iter()
        .map(|c| Sums::new(c.view.pixels() * c.acceptances.len()))
        .collect();
    let mut tally = PassAccount::default();
    let work = |range: Range<u64>| {
        let mut part = PassAccount::default();
        let mut hits: Vec<Vec<Hit>> = prepared.iter().map(|_| Vec::new()).collect();
        let mut ahead = Vec::new();
        source.for_each_block(range, |_, batch| {
            part.add_block(batch);
            for (cone, found) in prepared.iter().zip(&mut hits) {
                cone.collect(batch, &mut ahead, found);
            }
        });
        (part, hits)
    };
    let merge = |(part, hits): (PassAccount, Vec<Vec<Hit>>)| {
        tally.merge(&part);
        for ((sum, found), cone) in sums.iter_mut().zip(hits).zip(&prepared) {
            let pixels = cone.view.pixels();
            for hit in found {
                for acceptance in hit.narrowest as usize..cone.cosines.len() {
                    let cell = acceptance * pixels + hit.pixel as usize;
                    sum.flux[cell] += hit.flux;
                    sum.flux_squared[cell] += hit.flux * hit.flux;
                    sum.rays[cell] += 1;
                }
            }
        }
    };
    ordered::run(threads, source.len(), work, merge, progress);
    (sums, tally)
}

#[cfg(test)]
mod tests {
    use super::*;
    use etendue_geometry::table::{Float, Layout, RayTable};

    /// Rays of unequal flux that fan out from a slanted line: no symmetry, some seen, most not.
    fn bytes(n: u32) -> Vec<u8> {
        (0..n)
            .flat_map(|i| {
                let t = f64::from(i) / f64::from(n);
                let (s, c) = (f64::from(i) * 0.7).sin_cos();
                let (p, q) = (f64::from(i) * 1.3).sin_cos();
                let r = (f64::from(i) * 0.618_033_988_75).fract();
                [
                    9.0 * s * r - 1.0,
                    6.0 * c * r,
                    0.3 * c,
                    0.4 * p * t + 0.1,
                    0.3 * q * t - 0.1,
                    0.8,
                    1.0 + t,
                ]
            })
            .flat_map(f64::to_le_bytes)
            .collect()
    }

    fn layout() -> Layout {
        Layout {
            stride: 56,
            position: Some(0),
            direction: 24,
            flux: 48,
            float: Float::F64,
            colour: None,
            length_scale: 1.0,
        }
    }

    fn cone() -> Cone {
        let view = View {
            observer: Vec3::new(20.0, -10.0, 80.0),
            target: Vec3::new(0.5, 0.0, 0.0),
            right: Vec3::new(1.0, 0.0, 0.0),
            up: Vec3::new(0.0, 1.0, 0.0),
            normal: Vec3::new(0.0, 0.0, 1.0),
            width: 11.0,
            height: 7.0,
            columns: 5,
            rows: 4,
        };
        Cone {
            view,
            acceptances: vec![0.05, 0.2, 0.5],
            disk: None,
        }
    }

    #[test]
    fn equals_a_plain_loop_without_the_quick_rejection() {
        let (bytes, cone) = (bytes(300_000), cone());
        let table = RayTable::new(&bytes, layout()).expect("valid");
        let (sums, tally) = cone_sums(&table, std::slice::from_ref(&cone), 2, |_| ControlFlow::Continue(()));
        let mut expected = Sums::new(60);
        table.for_each_block(0..300_000, |_, batch| {
            for i in 0..batch.len {
                let (x, k) = (batch.position(i), batch.direction(i));
                let Some(pixel) = cone.view.pixel(x, k) else { continue };
                let angle = k.dot(cone.view.to_eye(pixel)).acos();
                for (a, limit) in cone.acceptances.iter().enumerate() {
                    if angle < *limit {
                        expected.flux[a * 20 + pixel as usize] += batch.flux[i];
                        expected.rays[a * 20 + pixel as usize] += 1;
                    }
                }
            }
        });
        assert_eq!(tally.rays, 300_000);
        assert_eq!(sums[0].rays, expected.rays);
        assert_eq!(sums[0].flux, expected.flux);
        assert!(expected.rays[40..].iter().all(|&n| n > 10));
    }

    #[test]
    fn gives_the_same_bits_for_one_two_and_seven_threads() {
        let bytes = bytes(500_000);
        let table = RayTable::new(&bytes, layout()).expect("valid");
        let run = |threads| {
            let (sums, tally) = cone_sums(&table, &[cone()], threads, |_| ControlFlow::Continue(()));
            let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            (bits(&sums[0].flux), bits(&sums[0].flux_squared), tally.flux.to_bits())
        };
        let one = run(1);
        assert!(one == run(2) && one == run(7));
    }
}
