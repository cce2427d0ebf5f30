use etendue_math::Vec3;
use etendue_sampling::philox::Stream;

use super::tree::{DEPTH, LEAF};
use super::*;
use crate::bounds::Bounds;

/// Primitives visited along a ray, in order.
fn visited(tree: &Bvh, o: Vec3, d: Vec3, t_lo: f64, t_max: f64) -> Vec<u32> {
    let mut seen = Vec::new();
    let mut end = t_max;
    let leaves: Vec<&[u32]> = tree.leaves().collect();
    tree.walk(&Probe::new(o, d, t_lo), &mut end, &mut Stack::lend(), |leaf, _| {
        seen.extend_from_slice(leaves[leaf]);
    });
    seen
}

/// A point with whole coordinates in [−range, range].
fn whole(stream: Stream, i: u64, block: u64, range: f64) -> Vec3 {
    let [x, y, z, _] = stream
        .uniforms(i, block)
        .map(|u| (u * (2.0 * range + 1.0)).floor() - range);
    Vec3::new(x, y, z)
}

fn random_boxes(count: u64, size: f64) -> Vec<Bounds> {
    let stream = Stream::new(5, 1);
    (0..count)
        .map(|i| {
            let p = whole(stream, i, 0, 1000.0);
            Bounds::of([p, p + whole(stream, i, 1, size)])
        })
        .collect()
}

#[test]
fn every_box_that_touches_a_ray_in_exact_arithmetic_is_visited() {
    // Whole numbers: o + k d is a corner, on an edge or on a face without any rounding, and k is its t.
    let stream = Stream::new(6, 1);
    for (scale, origin) in [(1.0, 0.0), (1e-8, 0.0), (1e8, 0.0), (1.0 / 3.0, 0.0), (1.0, 1e6)] {
        let shift = Vec3::new(origin, -origin, origin);
        let exact = random_boxes(3000, 20.0);
        let place = |p: Vec3| (p + shift) * scale;
        let boxes: Vec<Bounds> = exact
            .iter()
            .map(|b| Bounds {
                lo: place(b.lo),
                hi: place(b.hi),
            })
            .collect();
        // 1e±8 and 1/3 round; there the ray is only as exact as f64, which the boxes are widened for.
        let margin = if scale == 1.0 { 0.0 } else { 1e4 * scale * f64::EPSILON };
        let widened: Vec<Bounds> = boxes.iter().map(|b| b.widened(margin)).collect();
        let tree = Bvh::new(&widened, 4).expect("few");
        for i in 0..20_000 {
            let [pick, kind, k, _] = stream.uniforms(i, 7);
            let b = exact[(pick * 3000.0) as usize];
            // A corner, or the middle of an edge or a face: whole coordinates between lo and hi.
            let mix = whole(stream, i, 8, 1.0);
            let at = |lo: f64, hi: f64, m: f64| {
                if m < 0.0 {
                    lo
                } else if m > 0.0 {
                    hi
                } else {
                    (0.5 * (lo + hi)).floor()
                }
            };
            let p = Vec3::new(
                at(b.lo.x, b.hi.x, mix.x),
                at(b.lo.y, b.hi.y, mix.y),
                at(b.lo.z, b.hi.z, mix.z),
            );
            let mut d = whole(stream, i, 9, 50.0);
            if kind < 0.4 {
                d.x = 0.0;
            }
            if kind < 0.2 {
                d.y = -0.0;
            }
            if d == Vec3::default() {
                continue;
            }
            let k = (k * 30.0).floor();
            let o = p - d * k;
            let seen = visited(&tree, place(o), d * scale, 0.0, k);
            assert!(
                seen.iter().any(|s| exact[*s as usize] == b),
                "{i} {scale}: {o:?} {d:?} {b:?}"
            );
            // The same from a start before and a start beyond the origin of the ray.
            let seen = visited(&tree, place(p), d * scale, -1.0, 0.0);
            assert!(seen.iter().any(|s| exact[*s as usize] == b), "{i} {scale}: {p:?} {d:?}");
            let seen = visited(&tree, place(o), d * scale, k, f64::INFINITY);
            assert!(seen.iter().any(|s| exact[*s as usize] == b), "{i} {scale}: from {k}");
        }
    }
}

#[test]
fn few_other_boxes_are_visited_and_the_near_ones_first() {
    let boxes = random_boxes(50_000, 5.0);
    let tree = Bvh::new(&boxes, 1).expect("few");
    let stream = Stream::new(7, 1);
    let (mut all, mut disorder) = (0, 0);
    for i in 0..1000 {
        let o = whole(stream, i, 0, 1000.0);
        let d = whole(stream, i, 1, 1000.0).normalized();
        let seen = visited(&tree, o, d, 0.0, 1e9);
        all += seen.len();
        let along: Vec<f64> = seen.iter().map(|s| (boxes[*s as usize].lo - o).dot(d)).collect();
        disorder += along.windows(2).filter(|w| w[1] < w[0] - 100.0).count();
        // A limit behind the first box leaves out all that lie wholly beyond it.
        let near = visited(&tree, o, d, 0.0, 100.0);
        assert!(near.iter().all(|s| (boxes[*s as usize].lo - o).dot(d) < 110.0));
    }
    // A line crosses boxes of a side of 2.5 on average, and as many as they cover of its cross section: about 0.3.
    assert!(all < 1000 * 10, "{all}");
    assert!(disorder * 20 < all, "{disorder} of {all}");
}

#[test]
fn a_tree_holds_every_primitive_once_whatever_the_boxes() {
    let point = |x: f64| {
        let p = Vec3::new(x, 0.0, 0.0);
        Bounds { lo: p, hi: p }
    };
    let nan = Vec3::new(f64::NAN, 1.0, f64::NAN);
    let everything = Bounds {
        lo: Bounds::EMPTY.hi,
        hi: Bounds::EMPTY.lo,
    };
    let cases: [Vec<Bounds>; 7] = [
        vec![],
        vec![point(1.0)],
        vec![point(0.5); 5000],
        // A chain: each box is half as far out as the one before, so that one at a time is split off.
        (0..1000).map(|i| point((-f64::from(i)).exp2())).collect(),
        vec![everything; 100],
        (0..300)
            .map(|i| match i % 3 {
                0 => Bounds { lo: nan, hi: nan },
                1 => Bounds::EMPTY,
                _ => point(f64::MAX),
            })
            .collect(),
        random_boxes(100_000, 3.0),
    ];
    for boxes in cases {
        for leaf in [1, 8] {
            let tree = Bvh::new(&boxes, leaf).expect("few");
            let mut held: Vec<u32> = tree.leaves().flatten().copied().collect();
            held.sort_unstable();
            assert!(held.iter().copied().eq(0..boxes.len() as u32));
            assert!(tree.leaves().all(|l| l.len() <= leaf));
            let mut deepest = 0;
            let mut open = vec![(0_usize, 1)];
            while let Some((number, depth)) = open.pop() {
                deepest = deepest.max(depth);
                let node = &tree.nodes[number];
                let below = node.child.iter().zip(node.used.to_le_bytes());
                open.extend(
                    below
                        .filter(|(c, used)| **c & LEAF == 0 && *used == 1)
                        .map(|(c, _)| (*c as usize, depth + 1)),
                );
            }
            assert!(deepest <= DEPTH, "{deepest}");
        }
    }
}

#[test]
fn boxes_without_a_bound_are_never_culled() {
    let nan = Vec3::new(f64::NAN, f64::NAN, f64::NAN);
    let mut boxes = random_boxes(100, 3.0);
    boxes[17] = Bounds { lo: nan, hi: nan };
    boxes[18] = Bounds {
        lo: Bounds::EMPTY.hi,
        hi: Bounds::EMPTY.lo,
    };
    let tree = Bvh::new(&boxes, 1).expect("few");
    for d in [Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.6, -0.8, 0.0)] {
        for o in [Vec3::default(), Vec3::new(1e30, -5.0, 0.1)] {
            let seen = visited(&tree, o, d, 0.0, f64::INFINITY);
            assert!(seen.contains(&17) && seen.contains(&18));
        }
    }
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(visited(&tree, Vec3::new(bad, 0.0, 0.0), Vec3::new(0.0, 0.0, 1.0), 0.0, 1.0).is_empty());
        assert!(visited(&tree, Vec3::default(), Vec3::new(bad, 0.0, 1.0), 0.0, 1.0).is_empty());
    }
    assert!(visited(&tree, Vec3::default(), Vec3::new(0.0, 0.0, 1.0), 0.0, f64::NAN).is_empty());
    assert!(visited(&tree, Vec3::default(), Vec3::new(0.0, 0.0, 1.0), 0.0, -1.0).is_empty());
}

#[test]
fn a_tree_whose_sides_are_split_at_once_has_every_box() {
    let boxes = random_boxes(40_000, 5.0);
    let tree = Bvh::new(&boxes, 2).expect("few");
    let mut order: Vec<u32> = tree.leaves().flatten().copied().collect();
    order.sort_unstable();
    assert!(order.iter().copied().eq(0..40_000));
    let stream = Stream::new(9, 1);
    for i in 0..4000 {
        let [pick, a, b, c] = stream.uniforms(i, 0);
        let pick = (pick * 40_000.0) as usize;
        let Bounds { lo, hi } = boxes[pick];
        let at = |lo: f64, hi: f64, u: f64| lo + u * (hi - lo);
        let p = Vec3::new(at(lo.x, hi.x, a), at(lo.y, hi.y, b), at(lo.z, hi.z, c));
        let d = whole(stream, i, 1, 1000.0).normalized();
        let seen = visited(&tree, p - d * 50.0, d, 0.0, 1e9);
        assert!(seen.contains(&(pick as u32)), "{i}");
    }
}
