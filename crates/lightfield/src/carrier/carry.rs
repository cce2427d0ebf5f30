//! Rays in blocks, carried along themselves to a carrier surface.

use etendue_geometry::RayBatch;
use etendue_geometry::ray_batch::BLOCK;
use etendue_math::Vec3;
use etendue_math::heads::{heads, heads_mut};
use multiversion::multiversion;

use super::chart::Chart;
use super::part::{CarrierPart, Shape, of_chart};

/// The étendue coordinates of a block of rays: a structure of arrays of length [`BLOCK`].
#[derive(Clone, Debug)]
pub struct Coordinates {
    /// The part each ray belongs to, or [`Coordinates::NONE`].
    pub part: Vec<u32>,
    /// s₁, s₂, a, b.
    pub values: [Vec<f64>; 4],
}

impl Coordinates {
    /// The part of a ray that no part meets.
    pub const NONE: u32 = u32::MAX;
}

impl Default for Coordinates {
    fn default() -> Self {
        Self {
            part: vec![Self::NONE; BLOCK],
            values: std::array::from_fn(|_| vec![0.0; BLOCK]),
        }
    }
}

/// Finds for each ray of the block the first part that its line leaves, with the coordinates there.
pub fn carry(parts: &[CarrierPart], batch: &RayBatch, out: &mut Coordinates) {
    let n = batch.len;
    out.part[..n].fill(Coordinates::NONE);
    for (index, part) in (0_u32..).zip(parts) {
        of_chart!(part.shape, chart => carry_to(chart, part, index, batch, out));
    }
}

/// The loop that is compiled once per shape and instruction set. A ray that has its part already keeps it.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn carry_to<C: Chart>(chart: C, part: &CarrierPart, index: u32, batch: &RayBatch, out: &mut Coordinates) {
    let n = batch.len;
    let [px, py, pz] = heads(&batch.position, n);
    let [kx, ky, kz] = heads(&batch.direction, n);
    let owner = &mut out.part[..n];
    let [s1, s2, a, b] = heads_mut(&mut out.values, n);
    for i in 0..n {
        let (o, d) = part.localise(Vec3::new(px[i], py[i], pz[i]), Vec3::new(kx[i], ky[i], kz[i]));
        let found = chart.cross(o, d).within(&part.beam);
        let take = found.met & (owner[i] == Coordinates::NONE);
        owner[i] = if take { index } else { owner[i] };
        s1[i] = if take { found.place[0] } else { s1[i] };
        s2[i] = if take { found.place[1] } else { s2[i] };
        a[i] = if take { found.direction[0] } else { a[i] };
        b[i] = if take { found.direction[1] } else { b[i] };
    }
}
