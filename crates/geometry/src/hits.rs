//! What the rays of a block meet first.

use etendue_math::Vec3;
use etendue_math::heads::heads;
use multiversion::multiversion;

use crate::origin_faces::{MOST_ORIGIN_FACES, NONE};
use crate::ray_block::RayBlock;
use crate::shape::Crossing;

/// What the rays of a block meet first. Structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Hits {
    /// Distance of the nearest crossing; +∞ if there is none.
    pub t: Vec<f64>,
    /// Distance of the one after it, as far as it was looked for (see [`Hits::tied`]).
    pub second: Vec<f64>,
    /// Its face.
    pub face: Vec<u32>,
    /// Its part and coordinates, for faces that have them; of as many rays as there are, or more.
    pub part: Vec<(u32, [f64; 2])>,
    /// Whether parts were written since all of them were reset.
    parted: bool,
    pub(crate) scratch: MeshRays,
}

/// Rays in the coordinates of a mesh, and what it answers.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeshRays {
    pub(crate) origin: [Vec<f64>; 3],
    pub(crate) direction: [Vec<f64>; 3],
    pub(crate) origin_triangles: Vec<[u32; MOST_ORIGIN_FACES]>,
    pub(crate) t: Vec<f64>,
    pub(crate) triangle: Vec<u32>,
    pub(crate) u: Vec<f64>,
    pub(crate) v: Vec<f64>,
}

impl MeshRays {
    pub(crate) fn resize(&mut self, n: usize) {
        for list in self
            .origin
            .iter_mut()
            .chain(&mut self.direction)
            .chain([&mut self.t, &mut self.u, &mut self.v])
        {
            list.resize(n, 0.0);
        }
        self.origin_triangles.resize(n, [NONE; MOST_ORIGIN_FACES]);
        self.triangle.resize(n, NONE);
    }
}

/// Two crossings that are nearer to each other than this share of (|o| + t) are looked at more closely: they may be one
/// event. Far above all rounding errors, far below what is built.
pub const TIE: f64 = 1e-9;

impl Hits {
    pub(crate) fn reset(&mut self, n: usize, parted: bool) {
        self.t.clear();
        self.t.resize(n, f64::INFINITY);
        self.second.clear();
        self.second.resize(n, f64::INFINITY);
        self.face.clear();
        self.face.resize(n, NONE);
        if self.parted || parted {
            self.part.clear();
        }
        // Parts that nobody writes stay what they are: there may be more of them than rays.
        if self.part.len() < n {
            self.part.resize(n, (0, [0.0; 2]));
        }
        self.parted = parted;
    }

    /// The nearest crossing of ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn crossing(&self, i: usize) -> Crossing {
        let (part, uv) = self.part[i];
        Crossing { t: self.t[i], part, uv }
    }

    /// For each ray whether another crossing may be part of the same event, as [`Hits::tied`] says.
    pub fn ties(&self, rays: &RayBlock, out: &mut Vec<bool>) {
        find_ties(self, rays, out);
    }

    /// Whether another crossing of ray `i` may be part of the same event.
    #[inline(always)]
    #[must_use]
    pub fn tied(&self, i: usize, o: Vec3) -> bool {
        self.second[i] - self.t[i] <= TIE * (o.x.abs() + o.y.abs() + o.z.abs() + self.t[i])
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn find_ties(hits: &Hits, rays: &RayBlock, out: &mut Vec<bool>) {
    let n = rays.len();
    out.resize(n, false);
    let out = &mut out[..n];
    let [x, y, z] = heads(&rays.origin, n);
    let (first, second) = (&hits.t[..n], &hits.second[..n]);
    for i in 0..n {
        out[i] = second[i] - first[i] <= TIE * (x[i].abs() + y[i].abs() + z[i].abs() + first[i]);
    }
}
