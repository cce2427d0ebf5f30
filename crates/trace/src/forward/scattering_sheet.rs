//! Many rays at once off one sheet that lets nothing through, whatever it does with the light: points and normals of all of
//! them together, then what becomes of each.
//!
//! What [`scatter`](crate::scatter) comes to for such a sheet, to the same bits.

use etendue_math::Vec3;
use etendue_optics::bsdf::{Bsdf, Media};

use crate::detector::Wants;
use crate::scatter::Surface;
use crate::scene::{Act, Scene};

/// A sheet that mirrors and scatters light back, or absorbs it.
#[derive(Clone, Copy, Debug)]
pub struct ScatteringSheet<'a> {
    /// Its number.
    pub face: u32,
    bsdf: &'a dyn Bsdf,
    /// A direction that the first axis of its surface follows, if one is stated.
    axis: Option<Vec3>,
}

/// The faces of a scene off which rays are bounced many at a time, besides plain walls.
#[must_use]
pub fn scattering_sheets(scene: &Scene, wants: Wants) -> Vec<ScatteringSheet<'_>> {
    // Detectors of scattered light and absorbing surroundings want to know of every scatter by itself.
    if wants.scatters || scene.media[0].absorption.range() != [0.0, 0.0] {
        return Vec::new();
    }
    let faces = scene.face_set.faces().iter().zip(&scene.roles).zip(0..);
    faces
        .filter_map(|((face, role), index)| {
            let Act::Optical(finish) = role.act else { return None };
            let bsdf = &*scene.finishes[finish as usize];
            let known = bsdf.facts();
            let back = !known.specular[1] && !known.diffuse[1];
            (role.solid == 0 && back && !face.shape.is_smooth()).then_some(ScatteringSheet {
                face: index,
                bsdf,
                axis: scene.axes[index as usize],
            })
        })
        .collect()
}

impl ScatteringSheet<'_> {
    /// The direction of a ray after it met the sheet, from two random numbers; None: absorbed. `normal` is that of the front.
    #[inline]
    #[must_use]
    pub fn bounced(&self, d: Vec3, normal: Vec3, media: Media, numbers: [f64; 2]) -> Option<Vec3> {
        Surface::new(self.bsdf, media, [normal; 2], self.axis).bounced(d, numbers)
    }
}
