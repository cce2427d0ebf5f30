//! Hits, areas, volumes and edges against closed forms and plain loops.

use etendue_math::Vec3;
use etendue_sampling::philox::Stream;

use super::meshes::{all_hits, icosphere, random, rays, soup};
use crate::mesh::{Found, MOST_ORIGIN_TRIANGLES, Mesh, MeshError, MeshHit, NO_TRIANGLE, Rays};

#[test]
fn the_tree_finds_what_a_plain_loop_finds_bit_for_bit() {
    for mesh in [soup(1.0), soup(1e-8), soup(1e8)] {
        let bounds = mesh.bounds();
        let size = bounds.sides().length();
        let rays = rays(&mesh, 18_000);
        let n = rays.len();
        let columns = |f: &dyn Fn(&(Vec3, Vec3)) -> f64| rays.iter().map(f).collect::<Vec<f64>>();
        let origin = [columns(&|r| r.0.x), columns(&|r| r.0.y), columns(&|r| r.0.z)];
        let direction = [columns(&|r| r.1.x), columns(&|r| r.1.y), columns(&|r| r.1.z)];
        let leaving: Vec<[u32; MOST_ORIGIN_TRIANGLES]> = (0..n as u32)
            .map(|i| [i % 7, i % 700, NO_TRIANGLE, NO_TRIANGLE])
            .collect();
        let (mut t, mut triangle) = (vec![f64::INFINITY; n], vec![0; n]);
        let (mut u, mut v) = (vec![0.0; n], vec![0.0; n]);
        mesh.nearest_block(
            Rays {
                origin: origin.each_ref().map(Vec::as_slice),
                direction: direction.each_ref().map(Vec::as_slice),
            },
            &leaving,
            Found {
                t: &mut t,
                triangle: &mut triangle,
                u: &mut u,
                v: &mut v,
            },
        );
        let mut found = 0;
        for (i, &(o, d)) in rays.iter().enumerate() {
            let all = all_hits(&mesh, o, d);
            let ahead = |hit: &&MeshHit| hit.t > 0.0;
            assert_eq!(
                mesh.nearest(o, d, f64::INFINITY, &[]),
                all.iter().find(ahead).copied(),
                "{i}"
            );
            let mut free = all
                .iter()
                .filter(ahead)
                .filter(|hit| !leaving[i].contains(&hit.triangle));
            let expected = free.next().copied().unwrap_or(MeshHit::none(f64::INFINITY));
            assert_eq!(
                MeshHit {
                    t: t[i],
                    triangle: triangle[i],
                    u: u[i],
                    v: v[i]
                },
                expected,
                "{i}"
            );
            found += usize::from(expected.triangle != NO_TRIANGLE);
            // A limit just at the hit excludes it, one just behind it does not.
            if triangle[i] != NO_TRIANGLE {
                assert!(mesh.nearest(o, d, t[i], &leaving[i]).is_none_or(|hit| hit.t < t[i]));
                assert_eq!(mesh.nearest(o, d, t[i].next_up(), &leaving[i]), Some(expected));
            }
            for [lo, hi] in [
                [-1e-3 * size, 0.3 * size],
                [all.first().map_or(0.0, |h| h.t), all.last().map_or(0.0, |h| h.t)],
            ] {
                let mut between = Vec::new();
                mesh.between(o, d, lo, hi, &[], |hit| between.push(hit));
                between.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle)));
                assert!(
                    between.iter().eq(all.iter().filter(|hit| lo <= hit.t && hit.t <= hi)),
                    "{i}"
                );
            }
        }
        assert!(found * 4 > n, "{found}");
    }
}

#[test]
fn no_ray_leaves_a_closed_mesh_unseen() {
    for turn in 0..4 {
        let (vertices, triangles) = icosphere(3, turn);
        let mesh = Mesh::new(vertices.clone(), triangles.clone(), None).expect("a mesh");
        let middle = (mesh.bounds().lo + mesh.bounds().hi) * 0.5;
        let stream = Stream::new(turn, 9);
        let edges = triangles
            .iter()
            .map(|[a, b, _]| (vertices[*a as usize] + vertices[*b as usize]) * 0.5);
        let targets: Vec<Vec3> = vertices.iter().copied().chain(edges).collect();
        for i in 0..100_000 {
            let o = middle + random(stream, i, 0) * 0.5;
            let aimed = (targets[i as usize % targets.len()] - o).normalized();
            for d in [random(stream, i, 1).normalized(), aimed] {
                let hit = mesh.nearest(o, d, f64::INFINITY, &[]).expect("a hit");
                assert!(mesh.nearest(o, -d, f64::INFINITY, &[]).is_some());
                assert!(((o + d * hit.t - middle).length() - 1.0).abs() < 0.02);
                assert!(hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v <= 1.0 + 4.0 * f64::EPSILON);
            }
        }
    }
}

#[test]
fn triangles_that_a_ray_leaves_are_passed_over_and_ties_go_to_the_lowest_index() {
    let vertices = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
        .map(|(x, y)| Vec3::new(x, y, 2.0))
        .to_vec();
    let mesh = Mesh::new(vertices, vec![[0, 1, 2], [0, 0, 1], [1, 2, 0]], None).expect("a mesh");
    assert_eq!((mesh.len(), mesh.degenerate()), (3, 1));
    let (o, d) = (Vec3::new(0.25, 0.25, 0.0), Vec3::new(0.0, 0.0, 1.0));
    let hit = mesh.nearest(o, d, 10.0, &[]).expect("a hit");
    assert_eq!(
        hit,
        MeshHit {
            t: 2.0,
            triangle: 0,
            u: 0.25,
            v: 0.25
        }
    );
    assert_eq!(mesh.nearest(o, d, 10.0, &[0]).map(|hit| hit.triangle), Some(2));
    assert_eq!(mesh.nearest(o, d, 10.0, &[2, 0]), None);
    assert_eq!(mesh.nearest(o, d, 2.0, &[]), None);
    assert_eq!(mesh.nearest(o, -d, 10.0, &[]), None);
    assert_eq!(mesh.nearest(o, Vec3::default(), 10.0, &[]), None);
    assert_eq!(mesh.nearest(Vec3::new(f64::NAN, 0.0, 0.0), d, 10.0, &[]), None);
    // Along its plane a triangle has no width.
    assert_eq!(
        mesh.nearest(Vec3::new(-1.0, 0.25, 2.0), Vec3::new(1.0, 0.0, 0.0), 10.0, &[]),
        None
    );
}

#[test]
fn areas_and_volumes_are_those_of_known_solids() {
    let (vertices, triangles) = icosphere(0, 1);
    let side = (vertices[triangles[0][0] as usize] - vertices[triangles[0][1] as usize]).length();
    let area = 5.0 * 3.0_f64.sqrt() * side * side;
    let volume = 5.0 / 12.0 * (3.0 + 5.0_f64.sqrt()) * side.powi(3);
    for (shift, tolerance) in [(0.0, 1e-14), (1e6, 1e-9)] {
        let moved: Vec<Vec3> = vertices.iter().map(|p| *p + Vec3::new(shift, shift, 0.0)).collect();
        let mesh = Mesh::new(moved.clone(), triangles.clone(), None).expect("a mesh");
        assert!((mesh.area() / area - 1.0).abs() < tolerance);
        assert!((mesh.volume() / volume - 1.0).abs() < tolerance);
        let turned = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let inside_out = Mesh::new(moved, turned, None).expect("a mesh");
        assert!((inside_out.volume() / volume + 1.0).abs() < tolerance);
    }
    let mesh = Mesh::new(
        vertices.clone(),
        triangles,
        Some(vertices.iter().map(|p| *p * 3.0).collect()),
    )
    .expect("a mesh");
    let middle = (mesh.bounds().lo + mesh.bounds().hi) * 0.5;
    for i in 0..20 {
        let centre = mesh
            .triangle(i)
            .into_iter()
            .fold(Vec3::default(), |sum, p| sum + p * (1.0 / 3.0));
        assert!(
            (mesh.normal(i).dot((centre - middle).normalized()) - 1.0).abs() < 1e-14,
            "normals point outward"
        );
        let [_, b, _] = mesh.triangle(i);
        assert!((mesh.shading_normal(i, 1.0, 0.0) - b.normalized()).length() < 1e-14);
    }
}

#[test]
fn points_are_drawn_in_proportion_to_area() {
    let (mut vertices, mut triangles) = icosphere(0, 2);
    for p in &mut vertices {
        p.x *= 5.0;
    }
    triangles.push([0, 0, 1]);
    let mesh = Mesh::new(vertices, triangles, None).expect("a mesh");
    // Each triangle in four parts of equal area, told apart by the weights.
    let (n, stream) = (400_000, Stream::new(11, 3));
    let mut counts = vec![[0.0_f64; 4]; mesh.len()];
    for i in 0..n {
        let [u1, u2, u3, _] = stream.uniforms(i, 0);
        let (p, triangle) = mesh.sample(u1, u2, u3);
        let [a, b, c] = mesh.triangle(triangle);
        let weight = |q: Vec3, r: Vec3| (q - p).cross(r - p).length() / (b - a).cross(c - a).length();
        let part = [weight(b, c), weight(c, a), weight(a, b)]
            .iter()
            .position(|w| *w > 0.5)
            .unwrap_or(3);
        counts[triangle as usize][part] += 1.0;
    }
    assert_eq!(counts[20], [0.0; 4], "nothing on a triangle without area");
    let chi2: f64 = (0..20)
        .map(|i| {
            let [a, b, c] = mesh.triangle(i);
            let expected = n as f64 * 0.5 * (b - a).cross(c - a).length() / mesh.area() / 4.0;
            counts[i as usize]
                .iter()
                .map(|k| (k - expected).powi(2) / expected)
                .sum::<f64>()
        })
        .sum();
    // χ² of 79 degrees of freedom exceeds 130.8 with a chance of 10⁻⁴ and falls below 40.9 with the same.
    assert!((40.9..130.8).contains(&chi2), "{chi2}");
}

#[test]
fn what_is_no_mesh_is_refused_with_its_place() {
    let p = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let three = vec![p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)];
    let error = |v: &[Vec3], t: &[[u32; 3]], n: Option<Vec<Vec3>>| {
        Mesh::new(v.to_vec(), t.to_vec(), n).map(|_| ()).expect_err("refused")
    };
    assert_eq!(error(&three, &[], None), MeshError::NoArea { triangles: 0 });
    assert_eq!(error(&three, &[[0, 1, 1]], None), MeshError::NoArea { triangles: 1 });
    let wrong = MeshError::Index {
        triangle: 1,
        vertex: 3,
        vertices: 3,
    };
    assert_eq!(error(&three, &[[0, 1, 2], [0, 3, 1]], None), wrong);
    assert_eq!(
        wrong.to_string(),
        "triangle 1 names vertex 3, but there are 3 vertices, counted from 0"
    );
    for bad in [f64::NAN, f64::INFINITY, 1e101] {
        let v = [p(0.0, 0.0), p(1.0, 0.0), p(0.0, bad)];
        assert_eq!(error(&v, &[[0, 1, 2]], None), MeshError::Vertex { vertex: 2 });
    }
    assert_eq!(
        error(&three, &[[0, 1, 2]], Some(vec![])),
        MeshError::NormalCount {
            normals: 0,
            vertices: 3
        }
    );
    let normals = Some(vec![p(0.0, 0.0), p(f64::NAN, 0.0), p(0.0, 0.0)]);
    assert_eq!(error(&three, &[[0, 1, 2]], normals), MeshError::Normal { vertex: 1 });
}
