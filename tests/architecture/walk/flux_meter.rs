//! A meter of the flux that passes a surface.

use etendue_geometry::Face;
use etendue_math::Vec3;

use super::kind::{Kind, Light, Recorded};
use super::record::{Described, Record};

/// Adds up the flux of all rays that pass its face, from either side.
#[derive(Clone, Debug)]
pub struct FluxMeter(pub Face);

impl Described for FluxMeter {
    fn read<R: Record>(record: &R) -> Result<Self, R::Error> {
        record.face().map(Self)
    }
}

impl Kind for FluxMeter {
    fn face(&self) -> Option<Face> {
        Some(self.0.clone())
    }

    fn cells(&self) -> usize {
        1
    }

    fn passing(&self, light: &Light<'_>, _point: Vec3, out: &mut Recorded) {
        out.contribute(0, light.state, light.state.flux);
    }
}
