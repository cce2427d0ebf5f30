//! A surface of any kind in its own coordinates.

use std::sync::Arc;

use etendue_math::Vec3;

use super::asphere::Asphere;
use super::flat::{Flat, Outline};
use super::quadric::{Quadric, ball, reach};
use super::torus::Torus;
use crate::bounds::Bounds;
use crate::mesh::Mesh;

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
        let starts_on = !parts.is_empty();
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
            Self::Flat(flat) => keep(flat.crossing(o, d, starts_on)),
            Self::Quadric(quadric) => quadric.crossings(o, d, starts_on).into_iter().for_each(keep),
            Self::Asphere(asphere) => asphere.crossings(o, d, range, starts_on, keep),
            Self::Torus(torus) => torus.crossings(o, d, range, starts_on, keep),
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

    /// Centre and radius of a ball that holds the shape \[mm\]; not finite if the shape has no end.
    #[must_use]
    pub fn ball(&self) -> (Vec3, f64) {
        if let Self::Quadric(quadric) = self
            && let Some((z, radius)) = ball(quadric)
        {
            return (Vec3::new(0.0, 0.0, z), radius);
        }
        if let Self::Flat(Flat {
            outline: Outline::Annulus { outer, .. },
        }) = self
        {
            return (Vec3::default(), *outer);
        }
        let bounds = self.bounds();
        ((bounds.lo + bounds.hi) * 0.5, 0.5 * bounds.sides().length())
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
                reach(quadric).map_or_else(|| around(quadric.r[1], quadric.z), |(r, z)| around(r, z))
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
