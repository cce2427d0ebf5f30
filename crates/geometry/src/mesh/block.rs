//! Eight triangles and one ray: who is hit, and where.
//!
//! The test of Woop, Benthin and Wald, "Watertight ray/triangle intersection" (JCGT 2, 2013), `[Woop2013]`, in f64. Space
//! is sheared so that the ray becomes the axis of largest direction component; in the plane across it the origin must
//! lie in the triangle. A vertex comes out the same in every triangle it belongs to, and an edge function of two
//! neighbours differs in sign alone. So the sheared triangles meet edge to edge as the mesh does, and a ray slips
//! through nowhere if the signs of edge functions are those of the exact ones. Rounding is monotone: a difference of
//! two rounded products has the right sign or is 0, and 0 counts as inside on either side. Where the area is so small
//! against the rounding that weights would be worthless, they are worked out again without error.

use etendue_math::Vec3;

use crate::bounds::Bounds;

/// The part of its longest side by which a triangle's box is widened, so that the box holds all hits that are accepted.
///
/// Let s be that side and ε = 2⁻⁵³. Where the origin lies in the sheared triangle, its coordinates are at most 2 s (the
/// shear adds at most one s), so an edge function errs by at most 16 s² ε. Of a triangle that is not [`THIN`] the three
/// weights err by 6 · 16 s² ε / (2⁻²⁰ s²) = 6 · 2⁻²⁹ together, the depth by half a side times that, and t, at most √3
/// times the depth, by less than 6 · 2⁻²⁹ s. The sheared coordinates themselves err by a few s ε. Both are below 2⁻²⁶ s.
/// What errs in proportion to the distance is left to [`Probe`](crate::bvh::Probe).
pub(super) const MARGIN: f64 = 1.0 / (1 << 26) as f64;

/// Twice the projected area, as a part of the square of the longest side, below which edge functions are worked out
/// without error.
const THIN: f64 = 1.0 / (1 << 20) as f64;

/// Triangles per block.
pub(super) const LANES: usize = 8;

/// No triangle: fills up lists of triangle indices.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// Where a ray meets a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshHit {
    /// Distance along the ray \[mm\].
    pub t: f64,
    /// Index of the triangle.
    pub triangle: u32,
    /// Weight of the triangle's second vertex.
    pub u: f64,
    /// Weight of the triangle's third vertex; the first has 1 − u − v.
    pub v: f64,
}

impl MeshHit {
    /// Nothing hit before `t_max`.
    pub(super) const fn none(t_max: f64) -> Self {
        Self {
            t: t_max,
            triangle: NO_TRIANGLE,
            u: 0.0,
            v: 0.0,
        }
    }

    /// Nearer, or as near and of lower index: so the nearest hit does not depend on the order of the tests.
    #[inline(always)]
    pub(super) fn before(&self, other: &Self) -> bool {
        self.t < other.t || (self.t == other.t && other.triangle != NO_TRIANGLE && self.triangle < other.triangle)
    }
}

/// What a ray has to do with eight triangles. It stays in memory, where one instruction writes a row of it and a hit is
/// looked up.
#[derive(Clone, Debug, Default)]
#[repr(align(64))]
pub(super) struct Lanes {
    /// The edge functions opposite to the vertices.
    weight: [[f64; LANES]; 3],
    /// 1 if the ray's line meets the triangle, else 0.
    inside: [u8; LANES],
}

/// Up to eight triangles, a structure of arrays. Lanes not in use have NaN for coordinates, which nothing hits.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// Coordinates by vertex and axis.
    corners: [[[f64; LANES]; 3]; 3],
    /// Twice the projected area below which the exact edge functions are asked.
    thin: f64,
    pub(super) triangle: [u32; LANES],
}

/// A ray in the sheared space of its largest direction component.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    axes: [usize; 3],
    origin: [f64; 3],
    /// Across per along, twice, and length per along.
    slope: [f64; 3],
}

impl Shear {
    #[inline(always)]
    pub(super) fn new(o: Vec3, d: Vec3) -> Self {
        let (x, y, z) = (d.x.abs(), d.y.abs(), d.z.abs());
        let (axes, origin, d) = if x > y && x > z {
            ([1, 2, 0], [o.y, o.z, o.x], [d.y, d.z, d.x])
        } else if y > z {
            ([2, 0, 1], [o.z, o.x, o.y], [d.z, d.x, d.y])
        } else {
            ([0, 1, 2], [o.x, o.y, o.z], [d.x, d.y, d.z])
        };
        let inverse = 1.0 / d[2];
        Self {
            axes,
            origin,
            slope: [d[0] * inverse, d[1] * inverse, inverse],
        }
    }
}

/// The longest side of the box around a triangle.
pub(super) fn longest_side(corners: [Vec3; 3]) -> f64 {
    let sides = Bounds::of(corners).sides();
    sides.x.max(sides.y).max(sides.z)
}

impl Block {
    pub(super) fn new(triangles: &[(u32, [Vec3; 3])]) -> Self {
        let mut block = Self {
            corners: [[[f64::NAN; LANES]; 3]; 3],
            thin: 0.0,
            triangle: [NO_TRIANGLE; LANES],
        };
        for (lane, (index, corners)) in triangles.iter().enumerate() {
            block.triangle[lane] = *index;
            for (rows, p) in block.corners.iter_mut().zip(corners) {
                (rows[0][lane], rows[1][lane], rows[2][lane]) = (p.x, p.y, p.z);
            }
            let side = longest_side(*corners);
            block.thin = block.thin.max(THIN * side * side);
        }
        block
    }

    /// Reports every triangle that the ray's line meets, but for those to `skip`.
    #[inline(always)]
    pub(super) fn meet(
        &self,
        ray: &Shear,
        lanes: &mut Lanes,
        skip: impl Fn(u32) -> bool,
        mut hit: impl FnMut(MeshHit),
    ) {
        let [kx, ky, kz] = ray.axes;
        let [ox, oy, oz] = ray.origin;
        let [sx, sy, sz] = ray.slope;
        let Lanes { weight, inside } = lanes;
        let (mut x, mut y) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for (corner, (x, y)) in self.corners.iter().zip(x.iter_mut().zip(&mut y)) {
            for i in 0..LANES {
                let depth = corner[kz][i] - oz;
                x[i] = (corner[kx][i] - ox) - sx * depth;
                y[i] = (corner[ky][i] - oy) - sy * depth;
            }
        }
        for (w, [p, q]) in weight.iter_mut().zip([[2, 1], [0, 2], [1, 0]]) {
            for i in 0..LANES {
                w[i] = x[p][i] * y[q][i] - y[p][i] * x[q][i];
            }
        }
        let [u, v, w] = &*weight;
        for i in 0..LANES {
            let left = (u[i] >= 0.0) & (v[i] >= 0.0) & (w[i] >= 0.0);
            let right = (u[i] <= 0.0) & (v[i] <= 0.0) & (w[i] <= 0.0);
            inside[i] = u8::from(left | right);
        }
        let mut inside = u64::from_le_bytes(*inside);
        while inside != 0 {
            let i = (inside.trailing_zeros() >> 3 & 7) as usize;
            inside &= inside - 1;
            if skip(self.triangle[i]) {
                continue;
            }
            let mut weights = [u[i], v[i], w[i]];
            let depth = [0, 1, 2].map(|k: usize| self.corners[k][kz][i] - oz);
            let mut twice_area = weights[0] + weights[1] + weights[2];
            if twice_area.abs() <= self.thin {
                weights = self.exact_weights(ray, i);
                twice_area = weights[0] + weights[1] + weights[2];
                let all = |sign: f64| weights.iter().all(|w| w * sign >= 0.0);
                if twice_area == 0.0 || !(all(1.0) || all(-1.0)) {
                    continue;
                }
            }
            let scale = 1.0 / twice_area;
            let along = weights[0] * depth[0] + weights[1] * depth[1] + weights[2] * depth[2];
            hit(MeshHit {
                t: along * sz * scale,
                triangle: self.triangle[i],
                u: weights[1] * scale,
                v: weights[2] * scale,
            });
        }
    }

    /// The edge functions of one triangle, each to one rounding and of the right sign.
    #[cold]
    #[inline(never)]
    fn exact_weights(&self, ray: &Shear, lane: usize) -> [f64; 3] {
        let ([kx, ky, kz], [ox, oy, oz], [sx, sy, _]) = (ray.axes, ray.origin, ray.slope);
        let [a, b, c] = self.corners.each_ref().map(|corner| {
            let depth = corner[kz][lane] - oz;
            [
                (corner[kx][lane] - ox) - sx * depth,
                (corner[ky][lane] - oy) - sy * depth,
            ]
        });
        [cross(c, b), cross(a, c), cross(b, a)]
    }
}

/// p₀ q₁ − p₁ q₀ to a relative error of 2⁻⁵²: products without error, and their difference in double-double
/// (Joldes, Muller and Popescu 2017, algorithm 6, `[Joldes2017]`).
fn cross(p: [f64; 2], q: [f64; 2]) -> f64 {
    let product = |x: f64, y: f64| {
        let high = x * y;
        (high, x.mul_add(y, -high))
    };
    let sum = |x: f64, y: f64| {
        let high = x + y;
        let part = high - x;
        (high, (x - (high - part)) + (y - part))
    };
    let ((a, low_a), (b, low_b)) = (product(p[0], q[1]), product(-p[1], q[0]));
    let (high, rest) = sum(a, b);
    let (low, low_rest) = sum(low_a, low_b);
    let (high, rest) = sum(high, rest + low);
    high + (rest + low_rest)
}
