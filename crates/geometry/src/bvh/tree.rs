//! A tree of boxes, and rays through it.

use etendue_math::Vec3;

use super::probe::{Lanes, Probe, WIDTH};
use crate::bounds::Bounds;

/// This bit of a child tells a leaf from a node.
pub(super) const LEAF: u32 = 1 << 31;

/// The largest depth of a tree: sets are halved once anything else might lead deeper.
pub(super) const DEPTH: usize = 48;

/// Room on a stack: each of at most [`DEPTH`] levels leaves seven siblings behind, and the last one eight.
const ROOM: usize = DEPTH * (WIDTH - 1) + WIDTH + 1;

/// Eight boxes, a structure of arrays: rows lo x, y, z, hi x, y, z.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub(super) planes: [[f32; WIDTH]; 6],
    /// Nodes, or leaves with the bit [`LEAF`].
    pub(super) child: [u32; WIDTH],
    /// One byte per child, 1 if it is in use.
    pub(super) used: u64,
}

/// A tree over primitives 0, 1, … known by their bounds.
#[derive(Clone, Debug)]
pub struct Bvh {
    pub(super) nodes: Vec<Node>,
    /// The primitives in the order of the leaves.
    pub(super) order: Vec<u32>,
    /// Leaf i holds `order[leaves[i]..leaves[i + 1]]`.
    pub(super) leaves: Vec<u32>,
    pub(super) bounds: Bounds,
}

/// What is left to visit, for one ray after the other: the child, and where the ray enters it (f32 bits, in the high
/// half, so that entries sort by distance). And what the ray has to do with the children of the node at hand.
#[derive(Clone, Debug)]
pub struct Stack {
    entries: [u64; ROOM],
    lanes: Lanes,
}

impl Default for Stack {
    fn default() -> Self {
        Self {
            entries: [0; ROOM],
            lanes: Lanes::default(),
        }
    }
}

impl Bvh {
    /// A box around everything.
    #[must_use]
    pub const fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The primitives of every leaf, in the order of the leaves.
    pub fn leaves(&self) -> impl Iterator<Item = &[u32]> {
        self.leaves
            .windows(2)
            .map(|ends| &self.order[ends[0] as usize..ends[1] as usize])
    }

    /// Whether `visit` says so of any primitive whose bounds have a point in common with a box.
    pub fn any_in(&self, around: Bounds, mut visit: impl FnMut(u32) -> bool) -> bool {
        let (lo, hi) = (around.lo, around.hi);
        let axes = [(lo.x, hi.x), (lo.y, hi.y), (lo.z, hi.z)];
        let mut open = vec![0_u32];
        while let Some(child) = open.pop() {
            if child & LEAF == 0 {
                let node = &self.nodes[child as usize];
                // Boxes of lanes that are not in use are NaN: nothing touches them.
                let touches = |lane: usize| {
                    axes.iter().enumerate().all(|(axis, (lo, hi))| {
                        f64::from(node.planes[axis][lane]) <= *hi && *lo <= f64::from(node.planes[axis + 3][lane])
                    })
                };
                open.extend((0..WIDTH).filter(|lane| touches(*lane)).map(|lane| node.child[lane]));
            } else {
                let leaf = (child & !LEAF) as usize;
                let primitives = &self.order[self.leaves[leaf] as usize..self.leaves[leaf + 1] as usize];
                if primitives.iter().any(|primitive| visit(*primitive)) {
                    return true;
                }
            }
        }
        false
    }

    /// Visits all primitives whose bounds the ray o + t d meets for a t in \[`t_lo`, `t_max`\], and few others: boxes in
    /// the order in which the ray enters them, those behind `t_max` left out. `visit` may lower `t_max` as it finds hits.
    ///
    /// A ray that is not finite meets nothing. Compile the caller with `multiversion`.
    #[inline(always)]
    pub fn traverse(&self, o: Vec3, d: Vec3, t_lo: f64, t_max: &mut f64, mut visit: impl FnMut(u32, &mut f64)) {
        let probe = Probe::new(o, d, t_lo);
        self.walk(&probe, t_max, &mut Stack::default(), |leaf, t_max| {
            for &primitive in &self.order[self.leaves[leaf] as usize..self.leaves[leaf + 1] as usize] {
                visit(primitive, t_max);
            }
        });
    }

    /// As [`Bvh::traverse`], leaf by leaf: leaves are numbered as [`Bvh::leaves`] yields them.
    #[inline(always)]
    pub fn walk(&self, probe: &Probe, t_max: &mut f64, stack: &mut Stack, mut visit: impl FnMut(usize, &mut f64)) {
        let Some(mut limit) = probe.limit(*t_max) else {
            return;
        };
        let Stack { entries, lanes } = stack;
        let mut top = 0;
        let mut child = 0_u32;
        loop {
            if child & LEAF == 0 {
                let node = &self.nodes[child as usize];
                probe.enter(&node.planes, limit, lanes);
                let mut hits = u64::from_le_bytes(lanes.hit) & node.used;
                let mut next = || {
                    let lane = (hits.trailing_zeros() >> 3) as usize % WIDTH;
                    hits &= hits.wrapping_sub(1);
                    let entry = u64::from(lanes.enter[lane].to_bits()) << 32 | u64::from(node.child[lane]);
                    (entry, hits != 0)
                };
                if node.used & u64::from_le_bytes(lanes.hit) != 0 {
                    let (mut nearest, mut more) = next();
                    let first = top;
                    while more {
                        let (mut entry, still) = next();
                        more = still;
                        (nearest, entry) = (nearest.min(entry), nearest.max(entry));
                        let mut at = top;
                        while at > first && entries[at - 1] < entry {
                            entries[at] = entries[at - 1];
                            at -= 1;
                        }
                        entries[at] = entry;
                        top += 1;
                    }
                    child = low(nearest);
                    continue;
                }
            } else {
                visit((child & !LEAF) as usize, t_max);
                let Some(lower) = probe.limit(*t_max) else {
                    return;
                };
                limit = lower;
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                if enter(entries[top]) <= limit {
                    child = low(entries[top]);
                    break;
                }
            }
        }
    }
}

/// The child of an entry.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "the lower half")]
const fn low(entry: u64) -> u32 {
    entry as u32
}

/// Where the ray enters the child of an entry.
#[inline(always)]
const fn enter(entry: u64) -> f32 {
    f32::from_bits((entry >> 32) as u32)
}
