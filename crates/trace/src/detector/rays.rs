//! A ray collecting surface.

use etendue_geometry::Face;
use etendue_math::Vec3;

use super::kind::{Kind, Light, Recorded};
use super::record::{Described, Record};

/// Keeps every ray that passes its face, from either side; a cell holds what each brings in all, however often it passes.
#[derive(Clone, Debug)]
pub struct Rays(pub Face);

impl Described for Rays {
    fn read<R: Record>(record: &R) -> Result<Self, R::Error> {
        record.face().map(Self)
    }
}

impl Kind for Rays {
    fn face(&self) -> Option<Face> {
        Some(self.0.clone())
    }

    fn cells(&self) -> usize {
        1
    }

    fn sums_up(&self) -> bool {
        true
    }

    fn passing(&self, light: &Light<'_>, point: Vec3, out: &mut Recorded) {
        out.rays.push(light.at(point));
        out.numbers.push(light.state.ray);
    }
}
