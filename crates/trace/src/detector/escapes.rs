//! Rays that leave the scene: a look at the far field before it is known which nodes suit it.

use etendue_math::Vec3;

use super::kind::{Kind, Light, Recorded, Wants};
use super::record::{Described, Record};

/// Keeps every ray that escapes, with its direction alone.
#[derive(Clone, Copy, Debug)]
pub struct Escapes;

impl Described for Escapes {
    fn read<R: Record>(_record: &R) -> Result<Self, R::Error> {
        Ok(Self)
    }
}

impl Kind for Escapes {
    fn wants(&self) -> Wants {
        Wants::ESCAPES
    }

    fn escape(&self, light: &Light<'_>, out: &mut Recorded) {
        out.rays.push(light.at(Vec3::default()));
    }
}
