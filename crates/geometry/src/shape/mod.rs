//! Shapes: where a line crosses them, and their normal there.
//!
//! Every shape stands in its own coordinates. One contract for all: `crossings` names the distances t at which the line
//! o + t d crosses the shape, d being a unit vector; a line that starts *on* the shape says so, and the crossing at its
//! start is then divided out of the equation instead of being told from others by a smallest distance. A point near an edge
//! counts as inside if it may be, by the rounding errors of its computation: neighbours that share an edge leave no gap.

pub mod asphere;
pub mod chart;
pub mod flat;
pub mod quadric;
pub mod roots;
pub mod sample;
pub mod torus;

use std::sync::Arc;

use etendue_math::Vec3;

use crate::bounds::Bounds;
use crate::mesh::Mesh;

pub use asphere::Asphere;
pub use flat::{Flat, Outline};
pub use quadric::Quadric;
pub use torus::Torus;

/// Rounding error of a computed point o + t d, in units of (|o| + t): a dozen operations with relative errors of half a
/// unit in the last place each, and as many again for what the start point inherits from the frame it came through.
pub const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Where a line crosses a shape.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossing {
    /// Distance along the line \[mm\].
    pub t: f64,
    /// Triangle of a mesh; 0 for the other shapes.
    pub part: u32,
    /// Coordinates in the triangle.
    pub uv: [f64; 2],
}

/// A surface in its own coordinates.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A piece of the plane z = 0; its normal is +z.
    Flat(Flat),
    /// A surface of second order with the z axis as axis of rotation; its normal is the gradient.
    Quadric(Quadric),
    /// An even asphere about the z axis; its normal has a positive z.
    Asphere(Asphere),
    /// A torus about the z axis; its normal points out of it.
    Torus(Torus),
    /// Triangles, counter-clockwise seen from outside.
    Mesh(Arc<Mesh>),
}

impl Shape {
    /// Calls `visit` for each crossing of the line o + t d with `from` ≤ t ≤ `to`, in no order.
    ///
    /// `parts`: the parts of the shape (triangles of a mesh) on which the line starts, so that t = 0 is no crossing; none if
    /// it starts elsewhere.
    #[inline]
    pub fn crossings(&self, o: Vec3, d: Vec3, range: [f64; 2], parts: &[u32], mut visit: impl FnMut(Crossing)) {
        let leaving = !parts.is_empty();
        if let Self::Mesh(mesh) = self {
            return mesh.between(o, d, range[0], range[1], parts, |hit| {
                visit(Crossing {
                    t: hit.t,
                    part: hit.triangle,
                    uv: [hit.u, hit.v],
                });
            });
        }
        let mut keep = |t: f64| {
            if t >= range[0] && t <= range[1] && t.is_finite() {
                visit(Crossing {
                    t,
                    ..Crossing::default()
                });
            }
        };
        match self {
            Self::Flat(flat) => keep(flat.crossing(o, d, leaving)),
            Self::Quadric(quadric) => quadric.crossings(o, d, leaving).into_iter().for_each(keep),
            Self::Asphere(asphere) => asphere.crossings(o, d, range, leaving, keep),
            Self::Torus(torus) => torus.crossings(o, d, range, leaving, keep),
            Self::Mesh(_) => {}
        }
    }

    /// The point of the shape next to `p`, which lies off it by a rounding error, and the unit normal there.
    #[inline]
    #[must_use]
    pub fn settle(&self, p: Vec3, part: u32) -> (Vec3, Vec3) {
        match self {
            Self::Mesh(mesh) => {
                let (n, height) = mesh.plane(part);
                (p - n * (p.dot(n) - height), n)
            }
            Self::Flat(_) => (Vec3::new(p.x, p.y, 0.0), Vec3::new(0.0, 0.0, 1.0)),
            Self::Quadric(quadric) => quadric.settle(p),
            Self::Asphere(asphere) => asphere.settle(p),
            Self::Torus(torus) => torus.settle(p),
        }
    }
}

impl Shape {
    /// Number of its parts: triangles of a mesh, 1 for the other shapes.
    #[must_use]
    pub fn parts(&self) -> usize {
        if let Self::Mesh(mesh) = self { mesh.count() } else { 1 }
    }

    /// Whether it looks smooth where it is not: a mesh that states normals at its vertices.
    #[must_use]
    pub fn is_smooth(&self) -> bool {
        matches!(self, Self::Mesh(mesh) if mesh.is_smooth())
    }

    /// A box that holds the shape; not finite if the shape has no end.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let inf = f64::INFINITY;
        let around = |r: f64, z: [f64; 2]| Bounds {
            lo: Vec3::new(-r, -r, z[0]),
            hi: Vec3::new(r, r, z[1]),
        };
        match self {
            Self::Flat(Flat { outline }) => match outline {
                Outline::Whole => around(inf, [0.0, 0.0]),
                Outline::Rectangle { width, height } => Bounds {
                    lo: Vec3::new(-0.5 * width, -0.5 * height, 0.0),
                    hi: Vec3::new(0.5 * width, 0.5 * height, 0.0),
                },
                Outline::Annulus { outer, .. } => around(*outer, [0.0, 0.0]),
                Outline::Polygon { vertices } => Bounds::of(vertices.iter().map(|v| Vec3::new(v[0], v[1], 0.0))),
            },
            Self::Quadric(quadric) => {
                sample::reach(quadric).map_or_else(|| around(quadric.r[1], quadric.z), |(r, z)| around(r, z))
            }
            Self::Asphere(asphere) => {
                let sag = asphere.sag_range();
                around(asphere.radii()[1], [sag.lo, sag.hi])
            }
            Self::Torus(torus) => around(torus.major + torus.minor, [-torus.minor, torus.minor]),
            Self::Mesh(mesh) => mesh.bounds(),
        }
    }
}

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
