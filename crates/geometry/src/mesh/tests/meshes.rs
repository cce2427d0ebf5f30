//! Meshes and rays that several tests use.

use etendue_math::Vec3;
use etendue_sampling::philox::Stream;

use super::super::block::Shear;
use super::super::query::Scratch;
use crate::mesh::{Mesh, MeshHit};

/// Components uniform in (−1, 1).
pub(super) fn random(stream: Stream, i: u64, block: u64) -> Vec3 {
    let [x, y, z, _] = stream.uniforms(i, block).map(|u| 2.0 * u - 1.0);
    Vec3::new(x, y, z)
}

/// An icosahedron whose faces are split in four `levels` times, on the unit sphere, turned and moved.
pub(super) fn icosphere(levels: u32, turn: u64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = f64::midpoint(1.0, 5.0_f64.sqrt());
    let mut vertices: Vec<Vec3> = [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)]
        .into_iter()
        .flat_map(|(a, b)| [Vec3::new(a, b, 0.0), Vec3::new(0.0, a, b), Vec3::new(b, 0.0, a)])
        .map(Vec3::normalized)
        .collect();
    let near = |a: Vec3, b: Vec3| (a - b).length() < 1.2;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| vertices[i as usize]);
                if near(p, q) && near(q, r) && near(r, p) {
                    let outside = (q - p).cross(r - p).dot(p) > 0.0;
                    triangles.push(if outside { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32, vertices: &mut Vec<Vec3>| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                vertices.push((vertices[a as usize] + vertices[b as usize]).normalized());
                vertices.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| middle(p, q, &mut vertices));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let stream = Stream::new(turn, 77);
    let x = random(stream, 0, 0).normalized();
    let y = x.cross(random(stream, 1, 0)).normalized();
    let z = x.cross(y);
    let shift = random(stream, 2, 0);
    let vertices = vertices.iter().map(|p| x * p.x + y * p.y + z * p.z + shift).collect();
    (vertices, triangles)
}

/// Triangles of many kinds in a cube of side 2: small ones, slivers, one in an axis plane of every four, doubled ones.
pub(super) fn soup(scale: f64) -> Mesh {
    let stream = Stream::new(3, 4);
    let mut vertices = Vec::new();
    for i in 0..600 {
        let p = random(stream, i, 0);
        let (mut a, mut b) = (random(stream, i, 1) * 0.2, random(stream, i, 2) * 0.2);
        match i % 4 {
            0 => (a.z, b.z) = (0.0, 0.0),
            1 => b = a * 0.7 + b * 1e-9,
            2 => (a, b) = (a * 5.0, b * 1e-3),
            _ => {}
        }
        let corners = [p, p + a, p + b].map(|p| p * scale);
        vertices.extend(corners);
        if i % 5 == 0 {
            vertices.extend(corners);
        }
    }
    let triangles = (0..vertices.len() as u32 / 3)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    Mesh::new(vertices, triangles, None).expect("a mesh")
}

/// Rays at a mesh: anywhere, along axes, at vertices and edges, in the planes of triangles, from the faces of boxes.
pub(super) fn rays(mesh: &Mesh, count: u64) -> Vec<(Vec3, Vec3)> {
    let stream = Stream::new(8, 4);
    let bounds = mesh.bounds();
    let (middle, half) = ((bounds.lo + bounds.hi) * 0.5, bounds.sides().length() * 0.5);
    (0..count)
        .map(|i| {
            let [pick, ..] = stream.uniforms(i, 0);
            let [a, b, c] = mesh.triangle((pick * mesh.len() as f64) as u32);
            let o = middle + random(stream, i, 1) * half;
            let axis = [
                Vec3::new(1.0, 0.0, 0.0),
                Vec3::new(0.0, -1.0, -0.0),
                Vec3::new(-0.0, 0.0, 1.0),
            ][i as usize % 3];
            let at = |p: Vec3| (p - o).normalized();
            match i % 9 {
                0 => (o, random(stream, i, 2).normalized()),
                1 => (o, at(a)),
                2 => (o, at((b + c) * 0.5)),
                3 => (a - axis * half, axis),
                4 => ((a + b) * 0.5 - axis * half, axis),
                5 => (a - (b - a) * 2.0, (b - a).normalized()),
                6 => (Vec3::new(bounds.lo.x, o.y, o.z), at(c)),
                7 => (Vec3::new(a.x.min(b.x).min(c.x), o.y, o.z), axis),
                _ => (a + (b - a) * 0.25 + (c - a) * 0.5, axis),
            }
        })
        .collect()
}

/// All hits of a ray's line, without the tree.
pub(super) fn all_hits(mesh: &Mesh, o: Vec3, d: Vec3) -> Vec<MeshHit> {
    let mut hits = Vec::new();
    let (ray, mut scratch) = (Shear::new(o, d), Scratch::default());
    for block in &mesh.blocks {
        block.meet(&ray, &mut scratch.lanes, |_| false, |hit| hits.push(hit));
    }
    hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle)));
    hits
}
