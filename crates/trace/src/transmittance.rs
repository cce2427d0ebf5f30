//! The share of light that gets from one point to another.

use etendue_geometry::origin_faces::OriginFaces;
use etendue_geometry::shape::ROUNDING;
use etendue_math::Vec3;

use crate::interaction::{Interaction, first_interaction};
use crate::medium_cache::MediumCache;
use crate::scatter::SurfaceEvent;
use crate::scene::Scene;
use crate::solid_stack::SolidStack;

/// Surfaces that change nothing, which light may pass between two points: more are a start that is not where it should be.
const MOST_PASSED: u32 = 1000;

/// The share of light that gets from a point to another without being scattered, reflected or refracted: what media do not
/// absorb, times what goes straight through sheets if `FILTERED`; 0 if there is any other surface in between.
///
/// `told` is called with each stretch: the solids that it lies in, and what ends it before its end, if anything does.
#[must_use]
pub fn transmittance<const FILTERED: bool>(
    scene: &Scene,
    [from, to]: [Vec3; 2],
    origin_faces: OriginFaces,
    stack: SolidStack,
    media: &mut MediumCache,
    wavelength: f64,
    mut told: impl FnMut(SolidStack, Option<&Interaction>),
) -> f64 {
    let (mut o, mut origin_faces, mut stack) = (from, origin_faces, stack);
    let (mut depth, mut through) = (0.0, 1.0);
    let d = (to - from).normalized();
    for _ in 0..MOST_PASSED {
        let distance = (to - o).dot(d);
        // What lies within rounding of the end is the surface that the end lies on.
        let reach = distance - 64.0 * ROUNDING * (o.x.abs() + o.y.abs() + o.z.abs() + distance);
        let absorption = media.at(scene, stack.top(), wavelength).absorption;
        let next = first_interaction(scene, o, d, &origin_faces, reach, stack);
        told(stack, next.as_ref().ok().and_then(Option::as_ref));
        match next {
            Err(_) => return 0.0,
            Ok(None) => {
                depth += absorption * distance;
                return if depth == 0.0 {
                    through
                } else {
                    through * (-depth).exp()
                };
            }
            Ok(Some(interaction)) => {
                match SurfaceEvent::new(scene, &interaction, d, wavelength, media) {
                    Ok(None) => {}
                    Ok(Some(event)) if FILTERED && event.bsdf().facts().specular[1] => through *= event.straight_on(),
                    _ => return 0.0,
                }
                if through == 0.0 {
                    return 0.0;
                }
                depth += absorption * interaction.t;
                (o, origin_faces, stack) = (interaction.point, interaction.origin_faces, interaction.after);
            }
        }
    }
    0.0
}
