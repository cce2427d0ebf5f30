//! Rounding errors of points on surfaces, and the step that settles a point on its surface.

use etendue_math::Vec3;

/// Rounding error of a computed point o + t d, in units of (|o| + t): a dozen operations with relative errors of half a
/// unit in the last place each, and as many again for what the start point inherits from the frame it came through.
pub const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The absolute values of the components, added up.
#[inline(always)]
#[must_use]
pub fn size(v: Vec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

/// One step of Newton's method along the gradient g of F, and the unit normal.
#[inline(always)]
pub(crate) fn step_down(p: Vec3, value: f64, gradient: Vec3) -> (Vec3, Vec3) {
    let square = gradient.dot(gradient);
    // At the apex of a cone there is no gradient; any normal is as good as another.
    let sound = square > 0.0;
    let (step, scale) = if sound {
        (value / square, 1.0 / square.sqrt())
    } else {
        (0.0, 0.0)
    };
    let normal = gradient * scale;
    let z = if sound { normal.z } else { 1.0 };
    (p - gradient * step, Vec3::new(normal.x, normal.y, z))
}
