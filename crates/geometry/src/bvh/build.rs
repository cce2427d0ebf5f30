//! From bounds to a tree: binned surface-area heuristic, then eight children per node.
//!
//! Wald, "On fast construction of SAH-based bounding volume hierarchies" (2007), `[Wald2007]`. A set is split where the
//! expected number of leaf tests, area × leaves on either side, is least; a set that no bin boundary divides is halved.
//! Two levels of children are then pulled up until a node has eight: always those of the child with the largest area.

use etendue_math::Vec3;
use etendue_sampling::ordered::inside;

use super::probe::WIDTH;
use super::tree::{Bvh, DEPTH, LEAF, Node};
use crate::bounds::Bounds;

const BINS: usize = 16;

/// Primitives from which on both sides of a split are worked on at once.
const LARGE: usize = 1 << 14;

/// A set of primitives: split in two, or a leaf.
struct Set {
    bounds: Bounds,
    kind: Kind,
}

enum Kind {
    Split([u32; 2]),
    Leaf { first: u32, count: u32 },
}

struct Item {
    bounds: Bounds,
    centre: [f64; 3],
    primitive: u32,
}

impl Bvh {
    /// A tree over primitives with these bounds, at most `leaf` (1 or more) of them in a leaf.
    ///
    /// Bounds that are infinite or NaN on a side are never culled there; empty ones are culled always. None if there
    /// are 2³¹ primitives or more.
    #[must_use]
    pub fn new(bounds: &[Bounds], leaf: usize) -> Option<Self> {
        build(bounds, leaf)
    }
}

fn build(bounds: &[Bounds], leaf: usize) -> Option<Bvh> {
    let count = u32::try_from(bounds.len()).ok().filter(|n| *n < LEAF)?;
    let splitter = Splitter { leaf: leaf.max(1) };
    let split = || {
        let mut items: Vec<Item> = bounds
            .iter()
            .zip(0..count)
            .map(|(b, primitive)| Item {
                bounds: unbounded_where_nan(*b),
                centre: centre(*b),
                primitive,
            })
            .collect();
        let mut sets = Vec::new();
        splitter.split(&mut items, 0, 0, &mut sets);
        (items, sets)
    };
    let (items, sets) = if bounds.len() < LARGE {
        split()
    } else {
        inside(0, split)
    };
    let mut tree = Bvh {
        nodes: Vec::new(),
        order: Vec::with_capacity(items.len()),
        leaves: vec![0],
        bounds: sets[0].bounds,
    };
    flatten(&sets, &items, 0, &mut tree);
    Some(tree)
}

fn unbounded_where_nan(b: Bounds) -> Bounds {
    let or = |v: f64, limit: f64| if v.is_nan() { limit } else { v };
    Bounds {
        lo: Vec3::new(
            or(b.lo.x, f64::NEG_INFINITY),
            or(b.lo.y, f64::NEG_INFINITY),
            or(b.lo.z, f64::NEG_INFINITY),
        ),
        hi: Vec3::new(
            or(b.hi.x, f64::INFINITY),
            or(b.hi.y, f64::INFINITY),
            or(b.hi.z, f64::INFINITY),
        ),
    }
}

/// The middle of a box, a finite number whatever the box is.
fn centre(b: Bounds) -> [f64; 3] {
    let middle = |lo: f64, hi: f64| {
        let m = 0.5 * lo + 0.5 * hi;
        if m.is_nan() { 0.0 } else { m.clamp(-f64::MAX, f64::MAX) }
    };
    [middle(b.lo.x, b.hi.x), middle(b.lo.y, b.hi.y), middle(b.lo.z, b.hi.z)]
}

struct Splitter {
    leaf: usize,
}

impl Splitter {
    /// Orders the items so that every leaf is a range, appends their set and all below it, and returns the set's number.
    fn split(&self, items: &mut [Item], first: u32, depth: usize, sets: &mut Vec<Set>) -> u32 {
        let bounds = items.iter().fold(Bounds::EMPTY, |b, item| b.union(item.bounds));
        #[allow(
            clippy::cast_possible_truncation,
            reason = "fewer than 2³¹ items and twice as many sets"
        )]
        let (number, count) = (sets.len() as u32, items.len() as u32);
        sets.push(Set {
            bounds,
            kind: Kind::Leaf { first, count },
        });
        if items.len() > self.leaf {
            let is_large = items.len() >= LARGE;
            let middle = self.partition(items, depth);
            let (left, right) = items.split_at_mut(middle);
            #[allow(clippy::cast_possible_truncation, reason = "below the number of items")]
            let second = first + middle as u32;
            let children = if is_large {
                let (mut lower, mut upper) = (Vec::new(), Vec::new());
                rayon::join(
                    || self.split(left, first, depth + 1, &mut lower),
                    || self.split(right, second, depth + 1, &mut upper),
                );
                [append(sets, lower), append(sets, upper)]
            } else {
                [
                    self.split(left, first, depth + 1, sets),
                    self.split(right, second, depth + 1, sets),
                ]
            };
            sets[number as usize].kind = Kind::Split(children);
        }
        number
    }

    /// Moves the items of one side in front of the others and returns how many there are: neither none nor all.
    fn partition(&self, items: &mut [Item], depth: usize) -> usize {
        let spread = Bounds::of(items.iter().map(|item| Vec3::from(item.centre)));
        let halvings = (items.len().div_ceil(self.leaf)).next_power_of_two().ilog2() as usize;
        if depth + halvings < DEPTH
            && let Some(plane) = self.best_plane(items, spread)
        {
            let mut middle = 0;
            for i in 0..items.len() {
                if plane.bin(&items[i]) <= plane.last {
                    items.swap(i, middle);
                    middle += 1;
                }
            }
            if 0 < middle && middle < items.len() {
                return middle;
            }
        }
        let sides = spread.sides();
        let axis = if sides.x >= sides.y.max(sides.z) {
            0
        } else if sides.y >= sides.z {
            1
        } else {
            2
        };
        let middle = items.len() / 2;
        items.select_nth_unstable_by(middle, |a, b| {
            a.centre[axis]
                .total_cmp(&b.centre[axis])
                .then(a.primitive.cmp(&b.primitive))
        });
        middle
    }

    /// The bin boundary with the least cost; None if no boundary has items on both sides.
    fn best_plane(&self, items: &[Item], spread: Bounds) -> Option<Plane> {
        let (lo, sides) = (spread.lo, spread.sides());
        let mut best: Option<(f64, Plane)> = None;
        for (axis, (lo, side)) in [(lo.x, sides.x), (lo.y, sides.y), (lo.z, sides.z)]
            .into_iter()
            .enumerate()
        {
            let mut plane = Plane {
                axis,
                lo,
                scale: BINS as f64 / side,
                last: 0,
            };
            if !(side > 0.0 && plane.scale.is_finite()) {
                continue;
            }
            let mut bins = [(Bounds::EMPTY, 0_usize); BINS];
            for item in items {
                let (bounds, count) = &mut bins[plane.bin(item)];
                *bounds = bounds.union(item.bounds);
                *count += 1;
            }
            let cost = |(bounds, count): (Bounds, usize)| bounds.area() * count.div_ceil(self.leaf) as f64;
            let mut right = [(0.0, 0); BINS];
            let mut sum = (Bounds::EMPTY, 0);
            for i in (1..BINS).rev() {
                sum = (sum.0.union(bins[i].0), sum.1 + bins[i].1);
                right[i] = (cost(sum), sum.1);
            }
            sum = (Bounds::EMPTY, 0);
            for i in 0..BINS - 1 {
                sum = (sum.0.union(bins[i].0), sum.1 + bins[i].1);
                let total = cost(sum) + right[i + 1].0;
                if sum.1 > 0 && right[i + 1].1 > 0 && best.as_ref().is_none_or(|(least, _)| total < *least) {
                    plane.last = i;
                    best = Some((total, plane));
                }
            }
        }
        best.map(|(_, plane)| plane)
    }
}

/// Appends sets that were numbered by themselves; returns the number of the first.
fn append(sets: &mut Vec<Set>, others: Vec<Set>) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "at most twice as many sets as there are items"
    )]
    let first = sets.len() as u32;
    sets.extend(others.into_iter().map(|set| Set {
        kind: match set.kind {
            Kind::Split(children) => Kind::Split(children.map(|child| child + first)),
            Kind::Leaf { .. } => set.kind,
        },
        ..set
    }));
    first
}

/// A boundary behind bin `last` along an axis.
#[derive(Clone, Copy)]
struct Plane {
    axis: usize,
    lo: f64,
    scale: f64,
    last: usize,
}

impl Plane {
    #[inline]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the cast saturates at both ends"
    )]
    fn bin(&self, item: &Item) -> usize {
        (((item.centre[self.axis] - self.lo) * self.scale) as usize).min(BINS - 1)
    }
}

/// Appends the node of a set, and all below it, to the tree; returns the node's number.
fn flatten(sets: &[Set], items: &[Item], root: u32, tree: &mut Bvh) -> u32 {
    let mut children = [0; WIDTH];
    children[0] = root;
    let mut count = 1;
    while count < WIDTH {
        let mut largest: Option<(f64, usize, [u32; 2])> = None;
        for (i, child) in children[..count].iter().enumerate() {
            let set = &sets[*child as usize];
            if let Kind::Split(halves) = set.kind
                && largest.is_none_or(|(area, ..)| set.bounds.area() > area)
            {
                largest = Some((set.bounds.area(), i, halves));
            }
        }
        let Some((_, i, [left, right])) = largest else {
            break;
        };
        children[i] = left;
        children[count] = right;
        count += 1;
    }
    #[allow(clippy::cast_possible_truncation, reason = "fewer nodes than primitives")]
    let number = tree.nodes.len() as u32;
    // An unused box is never entered: NaN is on no side of anything, and its bit is not set.
    tree.nodes.push(Node {
        planes: [[f32::NAN; WIDTH]; 6],
        child: [0; WIDTH],
        used: 0x0101_0101_0101_0101 >> (8 * (WIDTH - count)),
    });
    for (lane, child) in children[..count].iter().enumerate() {
        let set = &sets[*child as usize];
        let [lo, hi] = set.bounds.outward();
        let number_below = match set.kind {
            Kind::Split(_) => flatten(sets, items, *child, tree),
            Kind::Leaf { first, count } => {
                let range = &items[first as usize..(first + count) as usize];
                tree.order.extend(range.iter().map(|item| item.primitive));
                #[allow(clippy::cast_possible_truncation, reason = "no more than primitives")]
                tree.leaves.push(tree.order.len() as u32);
                #[allow(clippy::cast_possible_truncation, reason = "no more leaves than primitives")]
                let leaf = (tree.leaves.len() - 2) as u32;
                leaf | LEAF
            }
        };
        let node = &mut tree.nodes[number as usize];
        for axis in 0..3 {
            node.planes[axis][lane] = lo[axis];
            node.planes[axis + 3][lane] = hi[axis];
        }
        node.child[lane] = number_below;
    }
    number
}
