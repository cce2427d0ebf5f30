//! Rays against a mesh. Each function is compiled for several instruction sets; the tree and the triangles are inlined
//! into it. All give the same bits: no sum is reordered and no product fused.

use etendue_math::Vec3;
use multiversion::multiversion;

use super::block::{Lanes, MeshHit, NO_TRIANGLE, Shear};
use super::triangle_mesh::Mesh;
use crate::bvh::{LentStack, Probe, Stack};

/// Triangles that a ray of a block may start on.
pub const MOST_ORIGIN_TRIANGLES: usize = 4;

/// A block of rays, one array per axis: origins \[mm\] and unit directions.
#[derive(Clone, Copy, Debug)]
pub struct Rays<'a> {
    /// Where each ray starts \[mm\].
    pub origin: [&'a [f64]; 3],
    /// Its unit direction. A ray with a direction that is 0 or NaN hits nothing.
    pub direction: [&'a [f64]; 3],
}

/// Where the rays of a block hit, one entry per ray.
#[derive(Debug)]
pub struct Found<'a> {
    /// On entry how far each ray may go, on return how far it went \[mm\].
    pub t: &'a mut [f64],
    /// The triangle that it hit, [`NO_TRIANGLE`] if none.
    pub triangle: &'a mut [u32],
    /// Weight of that triangle's second vertex.
    pub u: &'a mut [f64],
    /// Weight of its third vertex.
    pub v: &'a mut [f64],
}

/// What a search keeps in memory.
pub(super) struct Scratch {
    stack: LentStack,
    pub(super) lanes: Lanes,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            stack: Stack::lend(),
            lanes: Lanes::default(),
        }
    }
}

impl Mesh {
    /// The nearest hit of the ray o + t d with 0 < t < `t_max`, on either side of a triangle; of hits at the same t that
    /// with the lowest index. The triangles in `origin` are passed over: the ray starts on them.
    ///
    /// Along the edges of a closed mesh no ray passes between two triangles. `d` is a unit vector.
    #[must_use]
    pub fn nearest(&self, o: Vec3, d: Vec3, t_max: f64, origin: &[u32]) -> Option<MeshHit> {
        let hit = nearest(self, o, d, t_max, origin);
        (hit.triangle != NO_TRIANGLE).then_some(hit)
    }

    /// [`Mesh::nearest`] for many rays, the fast way. `found.t` holds their `t_max`, and `origin` up to [`MOST_ORIGIN_TRIANGLES`]
    /// triangles of each, filled up with [`NO_TRIANGLE`].
    ///
    /// # Panics
    /// If a slice is shorter than `origin`, which says how many rays there are.
    pub fn nearest_block(&self, rays: Rays<'_>, origin: &[[u32; MOST_ORIGIN_TRIANGLES]], found: Found<'_>) {
        nearest_block(self, rays, origin, found);
    }

    /// Visits every hit of the ray o + t d with `t_lo` ≤ t ≤ `t_hi`, in no particular order. `t_lo` may be negative but
    /// is finite. The triangles in `origin` are passed over. A hit on an edge is one of either triangle.
    pub fn between(&self, o: Vec3, d: Vec3, t_lo: f64, t_hi: f64, origin: &[u32], visit: impl FnMut(MeshHit)) {
        between(self, o, d, [t_lo, t_hi], origin, visit);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn nearest(mesh: &Mesh, o: Vec3, d: Vec3, t_max: f64, origin: &[u32]) -> MeshHit {
    nearest_of(
        mesh,
        o,
        d,
        t_max,
        |triangle| origin.contains(&triangle),
        &mut Scratch::default(),
    )
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn nearest_block(mesh: &Mesh, rays: Rays<'_>, origin: &[[u32; MOST_ORIGIN_TRIANGLES]], found: Found<'_>) {
    let count = origin.len();
    let Rays {
        origin: [ox, oy, oz],
        direction: [dx, dy, dz],
    } = rays;
    let (ox, oy, oz) = (&ox[..count], &oy[..count], &oz[..count]);
    let (dx, dy, dz) = (&dx[..count], &dy[..count], &dz[..count]);
    let (t, triangle) = (&mut found.t[..count], &mut found.triangle[..count]);
    let (u, v) = (&mut found.u[..count], &mut found.v[..count]);
    let mut scratch = Scratch::default();
    for i in 0..count {
        let (o, d) = (Vec3::new(ox[i], oy[i], oz[i]), Vec3::new(dx[i], dy[i], dz[i]));
        let out = origin[i];
        let is_left = |triangle| out[0] == triangle || out[1] == triangle || out[2] == triangle || out[3] == triangle;
        let hit = nearest_of(mesh, o, d, t[i], is_left, &mut scratch);
        (t[i], triangle[i], u[i], v[i]) = (hit.t, hit.triangle, hit.u, hit.v);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn between<F: FnMut(MeshHit)>(mesh: &Mesh, o: Vec3, d: Vec3, [t_lo, t_hi]: [f64; 2], origin: &[u32], mut visit: F) {
    let (probe, ray) = (Probe::new(o, d, t_lo), Shear::new(o, d));
    let mut end = t_hi;
    let Scratch { stack, lanes } = &mut Scratch::default();
    mesh.tree.walk(&probe, &mut end, stack, |leaf, _| {
        mesh.blocks[leaf].meet(
            &ray,
            lanes,
            |triangle| origin.contains(&triangle),
            |hit| {
                if t_lo <= hit.t && hit.t <= t_hi {
                    visit(hit);
                }
            },
        );
    });
}

#[inline(always)]
fn nearest_of(
    mesh: &Mesh,
    o: Vec3,
    d: Vec3,
    t_max: f64,
    is_left: impl Fn(u32) -> bool,
    Scratch { stack, lanes }: &mut Scratch,
) -> MeshHit {
    let (probe, ray) = (Probe::new(o, d, 0.0), Shear::new(o, d));
    let mut best = MeshHit::none(t_max);
    let mut end = t_max;
    mesh.tree.walk(&probe, &mut end, stack, |leaf, end| {
        mesh.blocks[leaf].meet(&ray, lanes, &is_left, |hit| {
            if hit.t > 0.0 && hit.before(&best) {
                best = hit;
                *end = hit.t;
            }
        });
    });
    best
}
