//! What coincides, what is open, what hangs together, and normals of curved surfaces.

use etendue_math::Vec3;

use super::meshes::icosphere;
use crate::mesh::smooth::smooth_normals;
use crate::mesh::topology::{open_edges, shells, sides, weld};

#[test]
fn edges_are_open_where_the_surface_is() {
    let (vertices, triangles) = icosphere(1, 3);
    assert_eq!(open_edges(&triangles), Vec::<[u32; 2]>::new());
    // Every triangle with vertices of its own, at the same places.
    let own: Vec<[f64; 3]> = triangles
        .iter()
        .flatten()
        .map(|i| vertices[*i as usize])
        .map(|p| [p.x, p.y, p.z])
        .collect();
    let welded = weld(&own);
    assert_eq!(welded.kept.len(), vertices.len());
    assert!(
        welded
            .kept
            .windows(2)
            .all(|pair| own[pair[0] as usize] < own[pair[1] as usize])
    );
    let placed = |i: usize| own[welded.kept[welded.number[i] as usize] as usize];
    assert!((0..own.len()).all(|i| placed(i) == own[i]));
    let (again, _) = welded.number.as_chunks::<3>();
    assert_eq!(open_edges(again), Vec::<[u32; 2]>::new());
    let [a, b, c] = triangles[5];
    let mut rim = [[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)]);
    rim.sort_unstable();
    let mut hole = triangles.clone();
    hole.remove(5);
    assert_eq!(open_edges(&hole), rim);
    let mut turned = triangles.clone();
    turned[5] = [a, c, b];
    assert_eq!(open_edges(&turned), rim);
    let mut doubled = triangles;
    doubled.push([a, b, c]);
    assert_eq!(open_edges(&doubled), rim);
}

#[test]
fn zeros_of_either_sign_are_one_place() {
    let welded = weld(&[[0.0, 1.0, -0.0], [-1.0, 0.0, 0.0], [-0.0, 1.0, 0.0]]);
    assert_eq!((welded.kept, welded.number), (vec![1, 0], vec![1, 0, 1]));
}

#[test]
fn sides_come_in_the_order_of_their_edges_and_triangles() {
    let found = sides(&[[3, 1, 2], [2, 1, 0]]);
    assert_eq!(found.edge, [[0, 1], [0, 2], [1, 2], [1, 2], [1, 3], [2, 3]]);
    assert_eq!(found.triangle, [1, 1, 0, 1, 0, 0]);
    assert_eq!(found.forward, [false, true, true, false, false, true]);
    assert_eq!(sides(&[]).edge, Vec::<[u32; 2]>::new());
}

#[test]
fn shells_are_what_hangs_together_by_edges() {
    let (_, ball) = icosphere(1, 2);
    let apart = 1 + ball.iter().flatten().max().expect("some");
    // Triangles of two balls in turn, and one that has a corner in common with the first.
    let mut triangles: Vec<[u32; 3]> = ball.iter().flat_map(|t| [t.map(|v| v + apart), *t]).collect();
    triangles.push([ball[0][0], 2 * apart, 2 * apart + 1]);
    let found = shells(&triangles);
    let (last, both) = found.split_last().expect("some");
    assert_eq!(*last, 2);
    assert!(both.iter().enumerate().all(|(i, shell)| *shell as usize == i % 2));
}

#[test]
fn normals_are_means_within_the_crease() {
    // A bent roof of unequal sides, whose faces meet at 40°, and a face below that is turned away from both.
    let (sin, cos) = 40.0_f64.to_radians().sin_cos();
    let vertices = [
        [0.0, 0.0, 0.0],
        [0.0, 3.0, 0.0],
        [-2.0, 0.0, 0.0],
        [2.0 * cos, 0.0, -2.0 * sin],
        [0.0, 0.0, -5.0],
    ];
    let triangles = [[0, 1, 2], [0, 3, 1], [0, 2, 4]];
    let flat = smooth_normals(&vertices, &triangles, 39.0_f64.to_radians().cos());
    assert_eq!(
        (flat.vertex.len(), flat.normal[flat.triangles[0][1] as usize]),
        (9, [0.0, 0.0, 1.0])
    );
    let smooth = smooth_normals(&vertices, &triangles, 41.0_f64.to_radians().cos());
    // Both are right angles at the first corner; at the other end of the ridge both are as large as each other.
    let half = [20.0_f64.to_radians().sin(), 0.0, 20.0_f64.to_radians().cos()];
    assert_eq!(smooth.vertex, [0, 0, 1, 2, 2, 3, 4]);
    for corner in [smooth.triangles[0][0], smooth.triangles[0][1], smooth.triangles[1][2]] {
        let found = smooth.normal[corner as usize];
        assert!((0..3).all(|k| (found[k] - half[k]).abs() < 1e-15), "{found:?}");
    }
    assert_eq!(smooth.triangles, [[0, 2, 3], [0, 5, 2], [1, 4, 6]]);
    // Of normals that cancel each other, each stays its own.
    let both = smooth_normals(&vertices, &[[0, 1, 2], [0, 2, 1]], -1.0);
    assert_eq!(both.normal[..2], [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]);
}

#[test]
fn normals_of_many_vertices_are_those_of_the_ball() {
    // More than are worked on together: a ball about a point off the origin.
    let (vertices, triangles) = icosphere(5, 1);
    let points: Vec<[f64; 3]> = vertices.iter().map(|p| [p.x, p.y, p.z]).collect();
    let middle = vertices.iter().fold(Vec3::default(), |sum, p| sum + *p) * (1.0 / vertices.len() as f64);
    let found = smooth_normals(&points, &triangles, 0.9);
    assert_eq!(found.vertex.len(), points.len());
    for (corners, smooth) in triangles.iter().zip(&found.triangles) {
        for (corner, new) in corners.iter().zip(smooth) {
            assert_eq!(*corner, found.vertex[*new as usize]);
            let normal = Vec3::from(found.normal[*new as usize]);
            let outwards = (vertices[*corner as usize] - middle).normalized();
            assert!(outwards.dot(normal) > 1.0 - 1e-5);
        }
    }
}
