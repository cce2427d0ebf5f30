//! Étendue is conserved: the Jacobian determinant of (x, y, p, q) through lenses is 1, p and q being direction cosines in air.

use std::sync::Arc;

use etendue_geometry::Face;
use etendue_geometry::origin_faces::OriginFaces;
use etendue_geometry::shape::{Asphere, Quadric, Shape};
use etendue_math::{Frame, Vec3};
use etendue_optics::bsdf::Interface;
use etendue_optics::fresnel::fresnel;
use etendue_optics::medium::{Index, Medium};
use etendue_optics::table::Curve;
use etendue_trace::interaction::first_interaction;
use etendue_trace::scene::{Scene, SceneFace};
use etendue_trace::solid_stack::SolidStack;

/// A tilted biconvex lens of glass with an asphere and a conic, and behind it a ball: nothing is on a common axis.
fn lenses() -> Scene {
    let tilted = |origin: Vec3, tilt: f64| Frame {
        origin,
        x: Vec3::new(tilt.cos(), 0.0, -tilt.sin()),
        y: Vec3::new(0.0, 1.0, 0.0),
        z: Vec3::new(tilt.sin(), 0.0, tilt.cos()),
    };
    let part = |shape, frame, solid, flipped| SceneFace {
        face: Face {
            shape,
            frame,
            trims: vec![],
            flipped,
        },
        solid: Some(solid),
        finish: 0,
        axis: None,
    };
    let lens = tilted(Vec3::new(0.2, -0.1, 0.0), 0.15);
    let front = Asphere::new(0.08, -0.6, vec![1e-4, -2e-7], [0.0, 4.0]).expect("sound");
    let back = Asphere::new(-0.06, 0.4, vec![], [0.0, 4.0]).expect("sound");
    let edge = Quadric {
        r2: 1.0,
        z2: 0.0,
        z1: 0.0,
        z0: -16.0,
        z: [front.sag_range().hi, 3.0 + back.sag_range().lo],
        r: [0.0, f64::INFINITY],
    };
    let behind = Frame {
        origin: lens.point_to_world(Vec3::new(0.0, 0.0, 3.0)),
        ..lens
    };
    let ball = Quadric {
        r2: 1.0,
        z2: 1.0,
        z1: 0.0,
        z0: -36.0,
        z: [f64::NEG_INFINITY, f64::INFINITY],
        r: [0.0, f64::INFINITY],
    };
    let medium = |n| Medium {
        index: Index::Table(Curve::constant(n)),
        absorption: Curve::constant(0.0),
    };
    Scene::new(
        vec![
            // The front's normal points into the lens, that of the back out of it.
            part(Shape::Asphere(front), lens, 0, true),
            part(Shape::Asphere(back), behind, 0, false),
            part(Shape::Quadric(edge), lens, 0, false),
            part(Shape::Quadric(ball), tilted(Vec3::new(0.5, 0.3, 12.0), 0.0), 1, false),
        ],
        vec![Arc::new(Interface)],
        vec![medium(1.0), medium(1.52), medium(1.8)],
        vec![1, 2],
        vec![],
        vec![],
    )
    .expect("sound")
}

/// From the plane z = −5 to the plane z = 30, always through the interfaces; None if a ray is totally reflected or misses.
fn through(scene: &Scene, [x, y, p, q]: [f64; 4]) -> Option<([f64; 4], u32)> {
    let (mut o, mut d) = (Vec3::new(x, y, -5.0), Vec3::new(p, q, (1.0 - p * p - q * q).sqrt()));
    let (mut origin_faces, mut stack, mut met) = (OriginFaces::default(), SolidStack::default(), 0);
    while let Some(interaction) = first_interaction(scene, o, d, &origin_faces, f64::INFINITY, stack).ok()? {
        let index = |stack: SolidStack| scene.media[scene.medium(stack.top())].at(555.0).n;
        let (n1, n2) = (index(interaction.before), index(interaction.after));
        let cosine = -d.dot(interaction.normal);
        let f = fresnel(cosine, n1, n2);
        if f.cosine == 0.0 {
            return None;
        }
        d = interaction.refracted(d, cosine, n1 / n2, f.cosine);
        (o, origin_faces, stack) = (interaction.point, interaction.origin_faces, interaction.after);
        met += 1;
    }
    let t = (30.0 - o.z) / d.z;
    (stack == SolidStack::default() && d.z > 0.0).then_some(([o.x + t * d.x, o.y + t * d.y, d.x, d.y], met))
}

/// Determinant by elimination with pivots.
fn determinant(mut m: [[f64; 4]; 4]) -> f64 {
    let mut result = 1.0;
    for k in 0..4 {
        let pivot = (k..4)
            .max_by(|a, b| m[*a][k].abs().total_cmp(&m[*b][k].abs()))
            .expect("rows");
        if pivot != k {
            m.swap(k, pivot);
            result = -result;
        }
        result *= m[k][k];
        for row in k + 1..4 {
            let (factor, upper) = (m[row][k] / m[k][k], m[k]);
            m[row].iter_mut().zip(upper).for_each(|(a, b)| *a -= factor * b);
        }
    }
    result
}

#[test]
fn the_jacobian_of_a_bundle_is_one_to_a_part_in_a_thousand_million() {
    // Central differences of the sixth order: their error is some h⁶ = 10⁻¹⁵ with h = 3·10⁻³, and rounding 10⁻¹³.
    const WEIGHTS: [f64; 3] = [3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0];
    let scene = lenses();
    let mut tested = 0;
    for i in 1..200 {
        let f = |g: f64| (0.5 + f64::from(i) * g).fract() - 0.5;
        let base = [
            4.0 * f(0.754_877),
            4.0 * f(0.569_840),
            0.3 * f(0.819_173),
            0.3 * f(0.671_044),
        ];
        let Some((_, 4)) = through(&scene, base) else { continue };
        let h = 3e-3;
        let mut jacobian = [[0.0; 4]; 4];
        let mut whole = true;
        for axis in 0..4 {
            for (step, weight) in (1..).zip(WEIGHTS) {
                for sign in [-1.0, 1.0] {
                    let mut at = base;
                    at[axis] += sign * f64::from(step) * h;
                    let Some((out, 4)) = through(&scene, at) else {
                        whole = false;
                        continue;
                    };
                    for row in 0..4 {
                        jacobian[row][axis] += sign * weight * out[row] / h;
                    }
                }
            }
        }
        if whole {
            assert!(
                (determinant(jacobian) - 1.0).abs() < 1e-9,
                "{i}: {}",
                determinant(jacobian) - 1.0
            );
            tested += 1;
        }
    }
    assert!(tested > 50, "{tested}");
}
