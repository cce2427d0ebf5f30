//! A tree of boxes, and rays through it.

use std::cell::RefCell;
use std::ops::{Deref, DerefMut, Range};

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

thread_local! {
    /// Stacks that nobody uses at present: to clear one, or to move it, takes as long as many a walk.
    #[allow(clippy::vec_box, reason = "they change hands")]
    static SPARE: RefCell<Vec<Box<Stack>>> = const { RefCell::new(Vec::new()) };
}

/// A stack that is given back when it is dropped.
#[derive(Debug)]
pub struct LentStack(Option<Box<Stack>>);

impl Stack {
    /// One for some walks of this thread.
    #[must_use]
    pub fn lend() -> LentStack {
        LentStack(Some(SPARE.with_borrow_mut(Vec::pop).unwrap_or_default()))
    }
}

impl Drop for LentStack {
    fn drop(&mut self) {
        if let Some(stack) = self.0.take() {
            SPARE.with_borrow_mut(|spare| spare.push(stack));
        }
    }
}

impl Deref for LentStack {
    type Target = Stack;

    fn deref(&self) -> &Stack {
        self.0.as_ref().expect("there until it is dropped")
    }
}

impl DerefMut for LentStack {
    fn deref_mut(&mut self) -> &mut Stack {
        self.0.as_mut().expect("there until it is dropped")
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
                if self.leaf(leaf).iter().any(|primitive| visit(*primitive)) {
                    return true;
                }
            }
        }
        false
    }

    /// The primitives of a leaf.
    #[inline(always)]
    fn leaf(&self, leaf: usize) -> &[u32] {
        &self.order[self.places(leaf)]
    }

    /// Where the primitives of a leaf are among those of all leaves, one after the other.
    #[inline(always)]
    #[must_use]
    pub fn places(&self, leaf: usize) -> Range<usize> {
        self.leaves[leaf] as usize..self.leaves[leaf + 1] as usize
    }

    /// Visits all leaves with primitives whose bounds the ray meets before `t_max`, and few others: boxes in the order in
    /// which the ray enters them, those behind `t_max` left out. `visit` may lower `t_max` as it finds hits. Leaves are numbered
    /// as [`Bvh::leaves`] yields them.
    ///
    /// A ray that is not finite meets nothing. Compile the caller with `multiversion`.
    #[inline(always)]
    pub fn walk(&self, probe: &Probe, t_max: &mut f64, stack: &mut Stack, mut visit: impl FnMut(usize, &mut f64)) {
        let mut walk = Walk::new(self, probe, stack);
        while let Some(leaf) = walk.next(*t_max) {
            visit(leaf, t_max);
        }
    }
}

/// The leaves that a ray comes by, the nearest ones first.
#[derive(Debug)]
pub struct Walk<'a> {
    tree: &'a Bvh,
    probe: &'a Probe,
    stack: &'a mut Stack,
    /// Entries on the stack.
    top: usize,
}

impl<'a> Walk<'a> {
    /// From the root.
    #[inline(always)]
    #[must_use]
    pub fn new(tree: &'a Bvh, probe: &'a Probe, stack: &'a mut Stack) -> Self {
        stack.entries[0] = 0;
        Self {
            tree,
            probe,
            stack,
            top: 1,
        }
    }

    /// The next leaf whose box the ray enters before `t_max`.
    #[inline(always)]
    pub fn next(&mut self, t_max: f64) -> Option<usize> {
        let limit = self.probe.limit(t_max)?;
        let Stack { entries, lanes } = &mut *self.stack;
        let mut top = self.top;
        loop {
            let mut child = loop {
                if top == 0 {
                    self.top = 0;
                    return None;
                }
                top -= 1;
                if enter(entries[top]) <= limit {
                    break low(entries[top]);
                }
            };
            loop {
                if child & LEAF != 0 {
                    self.top = top;
                    return Some((child & !LEAF) as usize);
                }
                let node = &self.tree.nodes[child as usize];
                self.probe.enter(&node.planes, limit, lanes);
                let mut hits = u64::from_le_bytes(lanes.hit) & node.used;
                if hits == 0 {
                    break;
                }
                let mut next = || {
                    let lane = (hits.trailing_zeros() >> 3) as usize % WIDTH;
                    hits &= hits.wrapping_sub(1);
                    let entry = u64::from(lanes.enter[lane].to_bits()) << 32 | u64::from(node.child[lane]);
                    (entry, hits != 0)
                };
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
