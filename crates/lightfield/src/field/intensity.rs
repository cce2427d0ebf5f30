//! Far-field intensity of a light field, by quadrature over its surface.

use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use etendue_geometry::RayBatch;
use etendue_geometry::ray_batch::BLOCK;
use etendue_math::Vec3;
use etendue_sampling::ordered;

use super::light_field::{LightField, PartField, stopped};
use super::points::Points;
use crate::carrier::{Coordinates, carry};

/// I(k) = Σ ∫ L(x, k) (n·k) dA over the parts, for each direction: a midpoint rule of `side`² points on every part.
///
/// The same bits for any number of threads; 0 once `stop` is set.
#[must_use]
pub fn intensity(
    field: &LightField,
    directions: &[[f64; 3]],
    side: u32,
    threads: usize,
    stop: Option<&AtomicBool>,
) -> Vec<f64> {
    let places: Vec<_> = field.parts.iter().map(|part| Places::new(part, side)).collect();
    let towards = |scratch: &mut Scratch, k: &[f64; 3]| {
        if stopped(stop) {
            return 0.0;
        }
        let k = Vec3::from(*k).normalized();
        let parts = field.parts.iter().zip(&places);
        parts.map(|(part, places)| of_part(part, places, k, scratch)).sum()
    };
    ordered::within(threads, |parallel| {
        if parallel {
            directions.par_iter().map_init(Scratch::default, towards).collect()
        } else {
            let mut scratch = Scratch::default();
            directions.iter().map(|k| towards(&mut scratch, k)).collect()
        }
    })
}

/// The points of a midpoint rule on a part, with the normals there.
struct Places {
    points: Vec<(Vec3, Vec3)>,
    /// Area that each stands for \[mm²\].
    area: f64,
}

impl Places {
    fn new(field: &PartField, side: u32) -> Self {
        let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(side);
        let place = |(i, j)| field.part.stand([middle(i), middle(j)]);
        Self {
            points: (0..side)
                .flat_map(|i| (0..side).map(move |j| (i, j)))
                .map(place)
                .collect(),
            area: field.part.area() / (f64::from(side) * f64::from(side)),
        }
    }
}

/// Room for the lines of some points.
#[derive(Default)]
struct Scratch {
    batch: RayBatch,
    at: Coordinates,
    points: Points,
    cosine: Vec<f64>,
}

fn of_part(field: &PartField, places: &Places, k: Vec3, scratch: &mut Scratch) -> f64 {
    let Scratch {
        batch,
        at,
        points,
        cosine,
    } = scratch;
    let mut sum = 0.0;
    for some in places.points.chunks(BLOCK) {
        cosine.clear();
        batch.len = 0;
        for (point, normal) in some {
            let c = k.dot(*normal);
            if c > 0.0 {
                // Along k from the inside: the line leaves the part at this very point.
                let start = field.part.leaving(*point, *normal, c);
                for (axis, (x, k)) in [(start.x, k.x), (start.y, k.y), (start.z, k.z)].into_iter().enumerate() {
                    batch.position[axis][batch.len] = x;
                    batch.direction[axis][batch.len] = k;
                }
                cosine.push(c);
                batch.len += 1;
            }
        }
        carry(std::slice::from_ref(&field.part), batch, at);
        points.read(field, at, batch.len);
        let seen = cosine.iter().zip(&points.value).zip(&at.part);
        sum += seen
            .filter(|(_, owner)| **owner != Coordinates::NONE)
            .map(|((c, value), _)| c * value)
            .sum::<f64>();
    }
    sum * places.area
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::carrier::Shape;
    use crate::carrier::tests::zoo;
    use crate::field::{Factor, FineErrors};

    #[test]
    fn a_part_of_constant_luminance_has_the_intensity_of_its_projected_area() {
        // Flat parts: L A cos θ; a hemisphere seen under θ from its pole: L π R² (1 + cos θ)/2; a tube: L 2 R h sin θ.
        for part in zoo() {
            let field = PartField {
                part,
                cells: [1; 4],
                ratio: vec![[1.0, 0.0]],
                space: Factor::one(),
                direction: Factor::one(),
                level: 3.0,
                errors: FineErrors::none(),
            };
            let (theta, phi) = (0.7_f64, 2.1_f64);
            let local = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let k = part.frame.direction_to_world(local);
            let found = intensity(&LightField { parts: vec![field] }, &[[k.x, k.y, k.z]], 200, 2, None)[0];
            let expected = 3.0
                * match part.shape {
                    Shape::Rectangle(r) => r.width * r.height * theta.cos(),
                    Shape::Disk(_) => part.area() * theta.cos(),
                    Shape::Hemisphere(h) => std::f64::consts::PI * h.radius * h.radius * (1.0 + theta.cos()) / 2.0,
                    Shape::Tube(t) => 2.0 * t.radius * t.height * theta.sin(),
                };
            assert!((found / expected - 1.0).abs() < 2e-3, "{part:?}: {found} {expected}");
        }
    }
}
