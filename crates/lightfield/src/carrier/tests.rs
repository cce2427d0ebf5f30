//! What all charts have in common.

use etendue_geometry::RayBatch;
use etendue_math::{Frame, Vec3};

use super::beam::Beam;
use super::carry::{Coordinates, carry};
use super::disk::Disk;
use super::focus::Focus;
use super::hemisphere::Hemisphere;
use super::part::{CarrierPart, Shape};
use super::rectangle::Rectangle;
use super::tube::Tube;

/// One part of each shape, moved and turned, none in a special position.
pub(crate) fn zoo() -> Vec<CarrierPart> {
    let frame = Frame {
        origin: Vec3::new(0.3, -0.2, 0.7),
        x: Vec3::new(0.36, 0.48, -0.8),
        y: Vec3::new(-0.8, 0.6, 0.0),
        z: Vec3::new(0.48, 0.64, 0.6),
    };
    [
        Shape::Rectangle(Rectangle {
            width: 2.5,
            height: 1.5,
            focus: Focus::default(),
        }),
        Shape::Disk(Disk { radius: 1.3 }),
        Shape::Hemisphere(Hemisphere { radius: 1.7 }),
        Shape::Tube(Tube {
            radius: 0.8,
            height: 2.2,
        }),
        Shape::Rectangle(Rectangle {
            width: 2.5,
            height: 1.5,
            focus: Focus([-0.1, 0.3, -0.2, 0.15]),
        }),
    ]
    .map(|shape| CarrierPart {
        frame,
        shape,
        beam: Beam::ALL,
    })
    .to_vec()
}

/// The same parts, and each of them for a beam.
fn with_beams() -> Vec<CarrierPart> {
    let beam = Beam::new([0.2, -0.35], 0.4).expect("within all directions");
    let beams = zoo().into_iter().map(|part| CarrierPart { beam, ..part });
    zoo().into_iter().chain(beams).collect()
}

/// Coordinates that fill the cube evenly.
pub(crate) fn lattice(n: u32) -> impl Iterator<Item = [f64; 4]> {
    (0..n).map(|i| [0.856_675, 0.733_892, 0.628_707, 0.538_597].map(|g: f64| (0.5 + f64::from(i) * g).fract()))
}

#[test]
fn coordinates_and_rays_are_inverse_wherever_the_ray_starts() {
    for part in with_beams() {
        for [s1, s2, a, b] in lattice(5000) {
            let (x, k) = part.ray([s1, s2], [a, b]);
            assert!((k.length() - 1.0).abs() < 1e-14);
            for along in [0.0, 3.0, -700.0] {
                let c = part.cross(x + k * along, k);
                let tolerance = 1e-13 * (1.0 + along.abs());
                // Near the horizon the crossing of a curved part is a square root away from the line.
                let grazing = 1.0 / (1e-6 + (1.0 - (2.0 * a - 1.0).abs().max((2.0 * b - 1.0).abs())));
                assert!(c.met, "{part:?} {s1} {s2} {a} {b}");
                for (found, given) in c.place.iter().chain(&c.direction).zip([s1, s2, a, b]) {
                    assert!(
                        (found - given).abs() < tolerance * grazing.min(1e4),
                        "{part:?} {found} {given}"
                    );
                }
            }
        }
    }
}

#[test]
fn places_are_seen_where_their_lines_leave_and_under_their_solid_angle() {
    // The solid angle of a small square of places, by the directions to its corners, against cosine · area / distance².
    for part in zoo() {
        let mut seen = 0;
        for [s1, s2, a, b] in lattice(500) {
            let place = [0.05 + 0.9 * s1, 0.05 + 0.9 * s2];
            if ((2.0 * place[0] - 1.0).abs() - (2.0 * place[1] - 1.0).abs()).abs() < 1e-3 {
                continue; // a kink of the concentric map
            }
            let (middle, normal) = part.stand(place);
            let (x, k) = part.ray([0.5, 0.5], [a, b]);
            let p = x + k * 7.0;
            let Some((point, cosine)) = part.seen_from(place, p) else {
                continue;
            };
            let away = p - point;
            let distance = away.length();
            let k = away * (1.0 / distance); // whose length the solid angle counts from the plane
            let crossing = part.cross(p, k);
            if !crossing.met || k.dot(normal) < 0.05 {
                continue; // another side of a curved part, or seen edge-on
            }
            seen += 1;
            let left = part.leaving(middle, normal, k.dot(normal));
            let beside = (left - point) - k * (left - point).dot(k);
            assert!(beside.length() < 1e-12);
            for (found, given) in crossing.place.iter().zip(place) {
                assert!((found - given).abs() < 1e-9, "{part:?} {found} {given}");
            }
            let step = 1e-5;
            let towards = |u: f64, v: f64| {
                let point = part
                    .seen_from([place[0] + u * step, place[1] + v * step], p)
                    .expect("near")
                    .0;
                (p - point).normalized()
            };
            let (du, dv) = (
                towards(1.0, 0.0) - towards(-1.0, 0.0),
                towards(0.0, 1.0) - towards(0.0, -1.0),
            );
            let angle = du.cross(dv).length() / (4.0 * step * step);
            let expected = cosine * part.area() / (distance * distance);
            assert!((angle / expected - 1.0).abs() < 1e-4, "{part:?} {angle} {expected}");
        }
        assert!(seen > 100, "{part:?} {seen}");
    }
}

#[test]
fn a_line_leaves_where_it_crosses() {
    for part in zoo() {
        let mut missed = 0;
        for [s1, s2, a, b] in lattice(5000) {
            let (x, k) = part.ray([s1, s2], [a, b]);
            let normal = part.stand([s1, s2]).1;
            for along in [0.0, 3.0, -700.0] {
                let (t, cosine) = part.leaves(x + k * along, k).expect("it was made to");
                // The same square root as above.
                let error = 1e-12 * (1.0 + along.abs()) / cosine.max(1e-6);
                assert!((t + along).abs() < error, "{part:?} {t} {along}");
                let focused = matches!(part.shape, Shape::Rectangle(flat) if flat.focus != Focus::default());
                let expected = match focused {
                    false => normal.dot(k),
                    true if along > 0.0 && normal.dot(k) > 0.3 => {
                        part.seen_from([s1, s2], x + k * along).expect("far enough").1
                    }
                    true => cosine, // nothing is seen from behind, or a place in several directions
                };
                assert!((cosine - expected).abs() < error, "{part:?} {cosine}");
            }
            // Lines beside it: the two agree on which are met.
            let aside = x + Vec3::new(s1 - 0.4, b - 0.5, a - 0.3) * 60.0;
            assert_eq!(part.leaves(aside, k).is_some(), part.cross(aside, k).met);
            missed += usize::from(!part.cross(aside, k).met);
        }
        assert!(missed > 500, "{part:?} {missed}");
    }
}

#[test]
fn equal_volumes_are_equal_etendues() {
    // |∂(x, y)/∂(s₁, s₂)| on the surface is its area everywhere; central differences.
    let h = 1e-6;
    for part in with_beams() {
        for [s1, s2, a, b] in lattice(300) {
            let near_kink = |u: f64, v: f64| ((2.0 * u - 1.0).abs() - (2.0 * v - 1.0).abs()).abs() < 1e-4;
            let margin = |u: f64| u.min(1.0 - u) < 1e-4;
            if near_kink(s1, s2) || near_kink(a, b) || [s1, s2, a, b].into_iter().any(margin) {
                continue;
            }
            let point = |u, v| part.ray([u, v], [a, b]).0;
            let d1 = (point(s1 + h, s2) - point(s1 - h, s2)) * (0.5 / h);
            let d2 = (point(s1, s2 + h) - point(s1, s2 - h)) * (0.5 / h);
            assert!((d1.cross(d2).length() / part.area() - 1.0).abs() < 1e-5, "{part:?}");
            // Solid angle times cosine: |∂k/∂a × ∂k/∂b| cos = π r².
            let k = |u, v| part.ray([s1, s2], [u, v]).1;
            let normal = part.stand([s1, s2]).1;
            let (e1, e2) = (k(a + h, b) - k(a - h, b), k(a, b + h) - k(a, b - h));
            let projected = (e1.cross(e2) * (0.25 / (h * h))).dot(normal).abs();
            assert!(
                (projected * part.area() / part.etendue() - 1.0).abs() < 1e-5,
                "{part:?}"
            );
        }
    }
}

#[test]
fn a_ray_belongs_to_the_first_part_it_leaves_and_never_to_one_it_enters() {
    let flat = Frame {
        origin: Vec3::default(),
        x: Vec3::new(1.0, 0.0, 0.0),
        y: Vec3::new(0.0, 1.0, 0.0),
        z: Vec3::new(0.0, 0.0, 1.0),
    };
    let dome = [
        Shape::Disk(Disk { radius: 1.0 }),
        Shape::Hemisphere(Hemisphere { radius: 1.0 }),
    ]
    .map(|shape| CarrierPart {
        frame: flat,
        shape,
        beam: Beam::ALL,
    });
    let rays = [
        ([0.2, 0.1, 5.0], [0.0, 0.0, 1.0], 0),
        ([-2.0, 0.0, 0.5], [1.0, 0.0, 0.0], 1),
        ([0.0, 0.0, 0.5], [0.0, 0.6, -0.8], Coordinates::NONE),
        ([3.0, 0.0, 0.0], [0.0, 0.0, 1.0], Coordinates::NONE),
    ];
    let mut batch = RayBatch {
        len: rays.len(),
        ..RayBatch::default()
    };
    for (i, (x, k, _)) in rays.iter().enumerate() {
        for axis in 0..3 {
            batch.position[axis][i] = x[axis];
            batch.direction[axis][i] = k[axis];
        }
    }
    let mut out = Coordinates::default();
    carry(&dome, &batch, &mut out);
    for (i, (_, _, part)) in rays.iter().enumerate() {
        assert_eq!(out.part[i], *part, "ray {i}");
    }
}

#[test]
fn blocks_have_the_bits_of_single_rays() {
    for part in with_beams() {
        // Rays of all directions, whatever the part takes.
        let whole = CarrierPart {
            beam: Beam::ALL,
            ..part
        };
        let mut batch = RayBatch {
            len: 999,
            ..RayBatch::default()
        };
        for (i, c) in lattice(999).enumerate() {
            let (x, k) = whole.ray([c[0], c[1]], [c[2], c[3]]);
            for (axis, (p, d)) in [(x.x, k.x), (x.y, k.y), (x.z, k.z)].into_iter().enumerate() {
                batch.position[axis][i] = p;
                batch.direction[axis][i] = d;
            }
        }
        let mut out = Coordinates::default();
        carry(&[part], &batch, &mut out);
        for i in 0..999 {
            let c = part.cross(batch.position(i), batch.direction(i));
            assert_eq!(c.met, out.part[i] == 0);
            if !c.met {
                continue;
            }
            let block = out.values.each_ref().map(|v| v[i].to_bits());
            assert_eq!(
                block,
                [c.place[0], c.place[1], c.direction[0], c.direction[1]].map(f64::to_bits)
            );
        }
    }
}
