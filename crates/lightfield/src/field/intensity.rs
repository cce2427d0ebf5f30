//! Far-field intensity of a light field, by quadrature over its surface.

use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use etendue_math::Vec3;
use etendue_sampling::ordered;

use super::light_field::{LightField, PartField, stopped};

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
    let towards = |k: &[f64; 3]| {
        if stopped(stop) {
            return 0.0;
        }
        let k = Vec3::from(*k).normalized();
        field.parts.iter().map(|part| of_part(part, k, side)).sum()
    };
    ordered::within(threads, |parallel| {
        if parallel {
            directions.par_iter().map(towards).collect()
        } else {
            directions.iter().map(towards).collect()
        }
    })
}

fn of_part(field: &PartField, k: Vec3, side: u32) -> f64 {
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(side);
    let mut sum = 0.0;
    for i in 0..side {
        for j in 0..side {
            let (point, cosine) = field.part.leaving([middle(i), middle(j)], k);
            if cosine > 0.0 {
                // Along k from the inside: the line leaves the part at this very point.
                let crossing = field.part.cross(point, k);
                if crossing.met {
                    sum += cosine * field.at(crossing.place, crossing.direction).value;
                }
            }
        }
    }
    sum * field.part.area() / (f64::from(side) * f64::from(side))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Factor, FineErrors};
    use crate::surface::tests::zoo;

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
                    crate::surface::Shape::Rectangle { width, height, .. } => width * height * theta.cos(),
                    crate::surface::Shape::Disk { .. } => part.area() * theta.cos(),
                    crate::surface::Shape::Hemisphere { radius } => {
                        std::f64::consts::PI * radius * radius * (1.0 + theta.cos()) / 2.0
                    }
                    crate::surface::Shape::Tube { radius, height } => 2.0 * radius * height * theta.sin(),
                };
            assert!((found / expected - 1.0).abs() < 2e-3, "{part:?}: {found} {expected}");
        }
    }
}
