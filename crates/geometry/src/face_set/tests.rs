use super::*;

use etendue_sampling::philox::Stream;

use crate::face::HalfSpace;
use crate::shape::{Flat, Quadric};

const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

fn quadric([r2, z2, z1, z0]: [f64; 4], z: [f64; 2], r: [f64; 2]) -> Shape {
    let shape = Quadric { r2, z2, z1, z0, z, r };
    Shape::Quadric(shape)
}

/// Ball, piece of a ball, cylinder, cone, ellipsoids long and flat, paraboloid, hyperboloids, and plane pieces, about 1 mm large.
fn shapes() -> Vec<Shape> {
    let whole = [0.0, f64::INFINITY];
    let flat = |outline| Shape::Flat(Flat { outline });
    vec![
        quadric([1.0, 1.0, 0.0, -1.0], EVERYWHERE, whole),
        quadric([1.0, 1.0, -2.0, 0.0], [0.0, 0.4], [0.3, 0.7]),
        quadric([1.0, 0.0, 0.0, -0.25], [-1.0, 2.0], whole),
        quadric([1.0, -0.5, 0.0, 0.0], [0.2, 1.5], whole),
        quadric([1.0, 0.1, 0.3, -0.2], EVERYWHERE, whole),
        quadric([1.0, 4.0, 0.0, -1.0], EVERYWHERE, whole),
        quadric([1.0, 4.0, 4.0, 0.0], [-0.95, 0.0], whole),
        quadric([1.0, 0.0, -1.0, 0.0], [0.0, 1.3], whole),
        quadric([1.0, -0.3, 0.0, -0.1], [-0.9, 1.1], whole),
        quadric([1.0, -0.7, 0.0, 0.2], [-1.4, 1.1], whole),
        flat(Outline::Annulus { inner: 0.2, outer: 1.0 }),
        flat(Outline::Rectangle {
            width: 2.0,
            height: 0.3,
        }),
    ]
}

pub(crate) fn point(stream: Stream, i: u64, block: u64) -> Vec3 {
    let [x, y, z, _] = stream.uniforms(i, block).map(|u| 2.0 * u - 1.0);
    Vec3::new(x, y, z)
}

/// Faces in a cube of side 2 · `range`, every third of them straight, every seventh trimmed.
pub(crate) fn faces(count: u64, range: f64, away: f64) -> Vec<Face> {
    let (stream, shapes) = (Stream::new(3, 7), shapes());
    let turned = |i: u64| {
        let z = point(stream, i, 1).normalized();
        let x = z.cross(point(stream, i, 2)).normalized();
        [x, z.cross(x), z]
    };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|[x, y, z]| Vec3::new(x, y, z));
    let face = |i: u64| {
        let [x, y, z] = if i.is_multiple_of(3) { axes } else { turned(i) };
        let origin = point(stream, i, 0) * range + Vec3::new(away, -away, 0.0);
        let half = HalfSpace {
            normal: Vec3::new(0.6, 0.0, 0.8),
            offset: 0.2,
        };
        Face {
            shape: shapes[i as usize % shapes.len()].clone(),
            frame: Frame { origin, x, y, z },
            trims: if i % 7 == 6 { vec![half] } else { vec![] },
            flipped: false,
        }
    };
    (0..count).map(face).collect()
}

/// Blocks, trees and lists find what trying all faces one by one finds, to the bit.
#[test]
fn the_nearest_face_is_that_of_all_faces_tried() {
    for (count, range, away) in [
        (10, 4.0, 0.0),
        (FEW as u64, 9.0, 1e5),
        (FEW as u64 + 1, 9.0, 0.0),
        (700, 20.0, 1e3),
    ] {
        let set = FaceSet::new(faces(count, range, away));
        assert_eq!(set.tree.is_some(), count > FEW as u64);
        let stream = Stream::new(4, count);
        let middle = Vec3::new(away, -away, 0.0);
        let (mut block, rays) = (RayBlock::default(), 6000);
        for i in 0..rays {
            let far = if i % 5 == 0 { 40.0 } else { 1.0 };
            let o = point(stream, i, 0) * (range * far) + middle;
            let to = point(stream, i, 1) * range + middle;
            let d = (to - o).normalized();
            let d = if i % 400 == 3 { d * f64::NAN } else { d };
            // Some start on a face, at a point of it.
            let mut start = (o, OriginFaces::default());
            if i % 2 == 0 {
                let nearest = set.faces.iter().zip(0..).filter_map(|(face, index)| {
                    let crossing = face.first(o, d, f64::INFINITY, &[])?;
                    Some((crossing.t, index, face.surface_point(o, d, &crossing).point))
                });
                if let Some((_, index, at)) = nearest.min_by(|a, b| a.0.total_cmp(&b.0)) {
                    start.0 = at;
                    start.1.add(index, 0);
                }
            }
            block.push(start.0, d, start.1);
        }
        let mut hits = Hits::default();
        set.nearest(&block, &mut hits);
        let mut met = 0;
        for i in 0..block.len() {
            let (o, d, origin) = (block.origin(i), block.direction(i), block.origin_faces(i));
            let first = |(face, index): (&Face, u32)| {
                let parts: &[u32] = if origin.face[0] == index { &[0] } else { &[] };
                face.first(o, d, f64::INFINITY, parts)
                    .map(|crossing| (crossing.t, index))
            };
            let all = set.faces.iter().zip(0..).filter_map(first);
            let expected = all.min_by(|a, b| a.0.total_cmp(&b.0));
            let expected = expected.map_or((f64::INFINITY, NONE), |nearest| nearest);
            assert_eq!((hits.t[i], hits.face[i]), expected, "ray {i} among {count}");
            let single = set.first(o, d, &origin, f64::INFINITY);
            assert_eq!(single.map_or(NONE, |(face, ..)| face), expected.1);
            met += usize::from(expected.1 != NONE);
        }
        assert!(met > 1000, "{met}");
    }
}

/// Wherever a line crosses a face, it meets the ball around it; and a ball is no larger than the half diagonal of the box.
#[test]
fn no_crossing_is_ruled_out_by_a_ball() {
    for (range, away) in [(2.0, 0.0), (2.0, 1e6)] {
        let stream = Stream::new(6, 2);
        let mut crossed = 0;
        for (face, number) in faces(33, range, away).iter().zip(0..) {
            let ball = face.ball().expect("it has an end");
            let half = face.bounds().sides() * 0.5;
            assert!(ball.square() <= half.dot(half) * 2.01, "{face:?}");
            for i in 0..2000 {
                let o = face.frame.origin + point(stream, i, number) * [1.5, 8.0, 1e4][i as usize % 3];
                let d = (face.frame.origin + point(stream, i, number + 50) * 1.5 - o).normalized();
                if face.first(o, d, f64::INFINITY, &[]).is_some() {
                    assert!(ball.meets(o, d), "{face:?} {o:?} {d:?}");
                    crossed += 1;
                }
            }
            assert!(!ball.meets(Vec3::new(f64::NAN, 0.0, 0.0), Vec3::new(0.0, 0.0, 1.0)));
        }
        assert!(crossed > 10_000, "{crossed}");
    }
}

#[test]
fn large_faces_are_tried_on_all_rays() {
    let mut all = faces(400, 9.0, 0.0);
    let wall = quadric([1.0, 0.0, 0.0, -100.0], [-10.0, 10.0], [0.0, f64::INFINITY]);
    let floor = Shape::Flat(Flat {
        outline: Outline::Whole,
    });
    for shape in [wall, floor] {
        let face = Face {
            shape,
            ..all[0].clone()
        };
        all.push(face);
    }
    let set = FaceSet::new(all);
    let simple: Vec<u32> = set.simple.iter().map(|face| face.index).collect();
    assert_eq!(simple, [400, 401]);
    assert!(set.simple.iter().all(|face| face.ball.is_none()));
}
