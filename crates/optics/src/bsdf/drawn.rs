//! What becomes of a ray at a surface.

use etendue_geometry::surface_points::Vectors;
use etendue_math::Vec3;

/// What is drawn of a ray at a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drawn {
    /// It is absorbed.
    Absorbed,
    /// It is mirrored.
    Mirrored,
    /// It is refracted; the cosine of the angle of refraction.
    Refracted(f64),
    /// It is scattered in a direction.
    Scattered(Vec3),
}

/// What becomes of one of many rays whose directions are kept together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It is absorbed.
    Absorbed,
    /// It is mirrored.
    Mirrored,
    /// It is refracted; the third component of its direction is the cosine of the angle of refraction instead.
    Refracted,
    /// It is scattered; its direction is the new one.
    Scattered,
}

impl Drawn {
    /// Its direction in the place of that from which the ray came, and what becomes of the ray.
    pub fn keep(self, directions: &mut Vectors, k: usize) -> Outcome {
        match self {
            Self::Absorbed => Outcome::Absorbed,
            Self::Mirrored => Outcome::Mirrored,
            Self::Refracted(cosine) => {
                directions[2][k] = cosine;
                Outcome::Refracted
            }
            Self::Scattered(d) => {
                for (list, component) in directions.iter_mut().zip([d.x, d.y, d.z]) {
                    list[k] = component;
                }
                Outcome::Scattered
            }
        }
    }
}
