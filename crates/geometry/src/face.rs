//! A shape in its place: moved, turned and trimmed.

use etendue_math::{Frame, Interval, Vec3};

use crate::bounds::{Ball, Bounds};
use crate::shape::{Crossing, ROUNDING, Shape, size};

/// The points p with n·p ≤ d, in the coordinates of the shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Unit normal, pointing out of the half space.
    pub normal: Vec3,
    /// Distance of its plane from the origin \[mm\].
    pub offset: f64,
}

/// A shape, where it stands, and what is cut off.
#[derive(Clone, Debug)]
pub struct Face {
    /// The surface.
    pub shape: Shape,
    /// Where it stands and how it is turned.
    pub frame: Frame,
    /// Only what lies in all of these is kept.
    pub trims: Vec<HalfSpace>,
    /// Whether the normal is that of the shape reversed.
    pub flipped: bool,
}

/// A point of a face: what a ray that arrives there needs to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, on the surface to within a rounding error \[mm\].
    pub point: Vec3,
    /// Unit normal of the surface, on the side that the face calls its front.
    pub normal: Vec3,
}

impl Face {
    /// A box in the world that holds the face; not finite if it has no end.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let local = self.shape.bounds();
        if !local.is_finite() {
            let inf = f64::INFINITY;
            return Bounds {
                lo: Vec3::new(-inf, -inf, -inf),
                hi: Vec3::new(inf, inf, inf),
            };
        }
        let bounds = Bounds::of(local.corners().map(|corner| self.frame.point_to_world(corner)));
        bounds.widened(2.0 * ROUNDING * (size(self.frame.origin) + size(local.lo) + size(local.hi)))
    }

    /// A ball in the world that holds the face; None if it has no end.
    #[must_use]
    pub fn ball(&self) -> Option<Ball> {
        let (centre, radius) = self.shape.ball();
        let moved = self.frame.point_to_world(centre);
        Ball::new(
            moved,
            radius + 2.0 * ROUNDING * (size(self.frame.origin) + size(centre) + radius),
        )
    }

    /// The normal that a ray sees: that of the surface, or that which a mesh states at its corners, interpolated.
    #[inline]
    #[must_use]
    pub fn shading_normal(&self, crossing: &Crossing) -> Option<Vec3> {
        let Shape::Mesh(mesh) = &self.shape else { return None };
        let n = self
            .frame
            .direction_to_world(mesh.shading_normal(crossing.part, crossing.uv[0], crossing.uv[1]));
        Some(if self.flipped { -n } else { n })
    }

    /// The same at a point of a triangle of a mesh.
    #[must_use]
    pub fn shading_normal_at(&self, part: u32, point: Vec3) -> Option<Vec3> {
        let Shape::Mesh(mesh) = &self.shape else { return None };
        if !mesh.is_smooth() {
            return None;
        }
        let uv = mesh.weights(part, self.frame.point_to_local(point));
        self.shading_normal(&Crossing {
            part,
            uv,
            ..Crossing::default()
        })
    }

    /// Whether the point, in the coordinates of the shape, may lie in all half spaces.
    #[inline]
    #[must_use]
    pub fn keeps(&self, p: Vec3, error: f64) -> bool {
        self.trims.iter().all(|trim| trim.normal.dot(p) <= trim.offset + error)
    }

    /// Calls `visit` for each crossing of the line o + t d with `from` ≤ t ≤ `to`, in no order.
    ///
    /// `origin_parts`: the parts of the shape (triangles of a mesh) on which the line starts; none if it starts elsewhere.
    #[inline]
    pub fn crossings(&self, o: Vec3, d: Vec3, range: [f64; 2], origin_parts: &[u32], mut visit: impl FnMut(Crossing)) {
        let (p, k) = (self.frame.point_to_local(o), self.frame.direction_to_local(d));
        self.shape.crossings(p, k, range, origin_parts, |crossing| {
            if self.trims.is_empty() || self.keeps(p + k * crossing.t, ROUNDING * (size(p) + crossing.t.abs())) {
                visit(crossing);
            }
        });
    }

    /// Whether a point may lie within `reach` of the face, by a look at its equation; often true where it does not.
    #[inline]
    #[must_use]
    pub fn may_hold(&self, point: Vec3, reach: f64) -> bool {
        match &self.shape {
            Shape::Flat(_) => (point - self.frame.origin).dot(self.frame.z).abs() <= 2.0 * reach,
            Shape::Quadric(quadric) => {
                // Near the surface F is the distance times the length of its gradient.
                let (value, gradient) = quadric.slope(self.frame.point_to_local(point));
                value * value <= 16.0 * reach * reach * gradient.dot(gradient)
            }
            _ => true,
        }
    }

    /// Whether a point of a box may lie on the face, by a look at its equation; often true where none does.
    #[must_use]
    pub fn may_touch(&self, around: Bounds) -> bool {
        if !around.touches(self.bounds()) {
            return false;
        }
        let (lo, hi, frame) = (around.lo, around.hi, &self.frame);
        let along = |axis: Vec3| {
            let term = |from: f64, to: f64, origin: f64, axis: f64| {
                (Interval::new(from, to) - Interval::point(origin)) * Interval::point(axis)
            };
            term(lo.x, hi.x, frame.origin.x, axis.x)
                + term(lo.y, hi.y, frame.origin.y, axis.y)
                + term(lo.z, hi.z, frame.origin.z, axis.z)
        };
        match &self.shape {
            Shape::Flat(_) => along(frame.z).has_zero(),
            Shape::Quadric(quadric) => {
                let [r2, z2, z1, z0] = [quadric.r2, quadric.z2, quadric.z1, quadric.z0].map(Interval::point);
                let (x, y, z) = (along(frame.x), along(frame.y), along(frame.z));
                (r2 * (x.squared() + y.squared()) + z2 * z.squared() + z1 * z + z0).has_zero()
            }
            Shape::Mesh(mesh) => {
                // A box around the box, in the coordinates of the mesh.
                let local = Bounds::of(around.corners().map(|corner| frame.point_to_local(corner)));
                mesh.touches(local.widened(2.0 * ROUNDING * (size(frame.origin) + size(lo) + size(hi))))
            }
            Shape::Asphere(_) | Shape::Torus(_) => true,
        }
    }

    /// The first crossing of the line o + t d at 0 < t < `reach`.
    #[inline]
    #[must_use]
    pub fn first(&self, o: Vec3, d: Vec3, reach: f64, origin_parts: &[u32]) -> Option<Crossing> {
        if let (Shape::Mesh(mesh), true) = (&self.shape, self.trims.is_empty()) {
            let (p, k) = (self.frame.point_to_local(o), self.frame.direction_to_local(d));
            return mesh.nearest(p, k, reach, origin_parts).map(|hit| Crossing {
                t: hit.t,
                part: hit.triangle,
                uv: [hit.u, hit.v],
            });
        }
        let mut found: Option<Crossing> = None;
        self.crossings(o, d, [0.0, reach], origin_parts, |crossing| {
            if crossing.t > 0.0 && crossing.t < found.map_or(reach, |f| f.t) {
                found = Some(crossing);
            }
        });
        found
    }

    /// The point where the line o + t d crosses the face, settled on it, and the normal there.
    #[inline]
    #[must_use]
    pub fn surface_point(&self, o: Vec3, d: Vec3, crossing: &Crossing) -> SurfacePoint {
        if let Shape::Flat(_) = self.shape {
            // Down to the plane along its normal, without a detour through the coordinates of the shape.
            let (p, n) = (o + d * crossing.t, self.frame.z);
            return SurfacePoint {
                point: p - n * (p - self.frame.origin).dot(n),
                normal: if self.flipped { -n } else { n },
            };
        }
        let p = self.frame.point_to_local(o) + self.frame.direction_to_local(d) * crossing.t;
        let (p, n) = self.shape.settle(p, crossing.part);
        let n = self.frame.direction_to_world(n);
        SurfacePoint {
            point: self.frame.point_to_world(p),
            normal: if self.flipped { -n } else { n },
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mesh::Mesh;
    use crate::shape::Quadric;

    #[test]
    fn a_box_touches_a_mesh_where_it_touches_a_triangle() {
        // Stairs of squares up along x, turned.
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for i in 0..50_u32 {
            let (x, z) = (f64::from(i), f64::from(i * i) * 0.1);
            let corner = |dx: f64, dy: f64| Vec3::new(x + dx, dy, z);
            vertices.extend([corner(0.0, 0.0), corner(0.9, 0.0), corner(0.9, 1.0), corner(0.0, 1.0)]);
            triangles.extend([[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]);
        }
        let mesh = Mesh::new(vertices, triangles, None).expect("sound");
        let face = Face {
            shape: Shape::Mesh(Arc::new(mesh)),
            frame: Frame {
                origin: Vec3::new(1.0, -2.0, 0.5),
                x: Vec3::new(0.0, 0.0, 1.0),
                y: Vec3::new(1.0, 0.0, 0.0),
                z: Vec3::new(0.0, 1.0, 0.0),
            },
            trims: vec![],
            flipped: false,
        };
        for i in 0..50 {
            let (x, z) = (f64::from(i), f64::from(i * i) * 0.1);
            let touched = |x: f64, y: f64, z: f64| {
                let at = face.frame.point_to_world(Vec3::new(x, y, z));
                face.may_touch(Bounds::of([at]).widened(1e-3))
            };
            assert!(touched(x + 0.5, 0.5, z) && touched(x + 0.5, 1.0, z + 5e-4));
            assert!(!touched(x + 0.95, 0.5, z) && !touched(x + 0.5, 0.5, z + 0.05) && !touched(x + 0.5, 1.01, z));
        }
    }

    #[test]
    fn a_box_beside_a_turned_cylinder_does_not_touch_it_and_one_on_it_does() {
        let frame = Frame {
            origin: Vec3::new(1.0, -2.0, 0.5),
            x: Vec3::new(0.6, 0.8, 0.0),
            y: Vec3::new(0.0, 0.0, 1.0),
            z: Vec3::new(0.8, -0.6, 0.0),
        };
        let (r2, z2, z1, z0) = (1.0, 0.0, 0.0, -25.0);
        let shape = Shape::Quadric(Quadric {
            r2,
            z2,
            z1,
            z0,
            z: [0.0, 9.0],
            r: [0.0, f64::INFINITY],
        });
        let face = Face {
            shape,
            frame,
            trims: vec![],
            flipped: false,
        };
        let around = |x: f64, y: f64, z: f64| Bounds::of([frame.point_to_world(Vec3::new(x, y, z))]).widened(1e-3);
        assert!(!face.may_touch(around(4.9, 0.0, 4.0)) && !face.may_touch(around(0.1, 0.2, 3.0)));
        assert!(!face.may_touch(around(5.0, 0.0, 40.0)));
        for turn in 0..40_u32 {
            let (sine, cosine) = f64::from(turn).sin_cos();
            assert!(face.may_touch(around(5.0 * cosine, 5.0 * sine, 0.2 * f64::from(turn))));
        }
    }
}
