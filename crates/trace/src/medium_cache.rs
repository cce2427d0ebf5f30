//! Optical constants of the media of a scene at one wavelength.

use etendue_optics::bsdf::Media;
use etendue_optics::medium::OpticalConstants;

use crate::ledger::Loss;
use crate::scene::Scene;
use crate::solid_stack::SolidStack;

/// The media of a scene at the wavelength that was last asked for, since one ray follows another of the same.
#[derive(Clone, Debug)]
pub struct MediumCache {
    at: Vec<(f64, OpticalConstants)>,
}

impl MediumCache {
    /// Nothing known yet.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let unknown = OpticalConstants {
            n: f64::NAN,
            absorption: f64::NAN,
        };
        Self {
            at: vec![(f64::NAN, unknown); scene.media.len()],
        }
    }

    /// What fills the space of a solid (0: the surroundings) at a wavelength \[nm\].
    #[inline]
    pub fn at(&mut self, scene: &Scene, solid: u16, wavelength: f64) -> OpticalConstants {
        let medium = scene.medium(solid);
        let held = &mut self.at[medium];
        if held.0 != wavelength {
            *held = (wavelength, scene.media[medium].at(wavelength));
        }
        held.1
    }

    /// What lies on both sides of a surface in the surroundings; None if they have no refractive index at this wavelength \[nm\].
    #[inline]
    pub fn around(&mut self, scene: &Scene, wavelength: f64) -> Option<Media> {
        let n = self.at(scene, 0, wavelength).n;
        (n > 0.0).then_some(Media {
            wavelength,
            front: n,
            back: n,
        })
    }

    /// What lies on both sides of a surface, for light that comes out of `before`, to its front or its back.
    ///
    /// # Errors
    /// If one of the media has no refractive index at this wavelength \[nm\].
    #[inline]
    pub fn both(
        &mut self,
        scene: &Scene,
        [before, after]: [SolidStack; 2],
        front: bool,
        wavelength: f64,
    ) -> Result<Media, Loss> {
        let [here, there] = [before, after].map(|stack| self.at(scene, stack.top(), wavelength).n);
        if !(here > 0.0 && there > 0.0) {
            return Err(Loss::NoIndex);
        }
        let (front, back) = if front { (here, there) } else { (there, here) };
        Ok(Media {
            wavelength,
            front,
            back,
        })
    }
}
