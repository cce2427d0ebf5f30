//! Nearest hits per second of one thread, in a cavity of 24 576 triangles: a cylinder of radius 21.5 and height 21.4, 512
//! facets around, closed below by a disk and open above. Rays start anywhere on the walls, cosine-distributed.
//!
//! `cargo run --release -p etendue-geometry --example mesh_speed [folder]`; with a folder, vertices, triangles, rays
//! and distances are written there as raw numbers, for other ray tracers.
#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::f64::consts::TAU;
use std::time::Instant;

use etendue_geometry::mesh::{Found, LEAVING, Mesh, NO_TRIANGLE, Rays};
use etendue_math::Vec3;
use etendue_sampling::philox::Stream;
use etendue_sampling::warp::square_to_cosine_hemisphere;

const RAYS: usize = 1 << 20;
const FACETS: u32 = 512;
/// Rows of the wall and rings of the disk, whose innermost is a fan: 512 · (2 · 12 + 2 · 12) = 24 576 triangles.
const ROWS: u32 = 12;
const RINGS: u32 = 12;

fn cavity() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (radius, height) = (21.5, 21.4);
    let mut vertices = Vec::new();
    for ring in 0..=RINGS + ROWS {
        // The innermost ring is almost a point, so that all rings have the same triangles.
        let r = radius * f64::from(ring.clamp(0, RINGS)).max(0.01) / f64::from(RINGS);
        let z = height * f64::from(ring.saturating_sub(RINGS)) / f64::from(ROWS);
        for facet in 0..FACETS {
            let angle = TAU * f64::from(facet) / f64::from(FACETS);
            vertices.push(Vec3::new(r * angle.cos(), r * angle.sin(), z));
        }
    }
    let mut triangles = Vec::new();
    for ring in 0..RINGS + ROWS {
        for facet in 0..FACETS {
            let (a, b) = (ring * FACETS + facet, ring * FACETS + (facet + 1) % FACETS);
            triangles.push([a, a + FACETS, b]);
            triangles.push([b, a + FACETS, b + FACETS]);
        }
    }
    (vertices, triangles)
}

fn main() -> Result<(), Box<dyn Error>> {
    let (vertices, triangles) = cavity();
    let start = Instant::now();
    let mesh = Mesh::new(vertices.clone(), triangles.clone(), None)?;
    println!(
        "{} triangles, tree in {:.1} ms",
        mesh.len(),
        start.elapsed().as_secs_f64() * 1e3
    );

    let stream = Stream::new(1, 1);
    let mut origin: [Vec<f64>; 3] = Default::default();
    let mut direction: [Vec<f64>; 3] = Default::default();
    let mut leaving = Vec::new();
    for i in 0..RAYS as u64 {
        let [u1, u2, u3, _] = stream.uniforms(i, 0);
        let (p, triangle) = mesh.sample(u1, u2, u3);
        let [u1, u2, ..] = stream.uniforms(i, 1);
        let (x, y, z) = square_to_cosine_hemisphere(u1, u2);
        let n = mesh.normal(triangle);
        let a = if n.z.abs() < 0.5 {
            Vec3::new(0.0, 0.0, 1.0)
        } else {
            Vec3::new(1.0, 0.0, 0.0)
        };
        let (e, f) = (n.cross(a).normalized(), n.cross(n.cross(a)).normalized());
        let d = (e * x + f * y + n * z).normalized();
        for (axis, (p, d)) in [(p.x, d.x), (p.y, d.y), (p.z, d.z)].into_iter().enumerate() {
            origin[axis].push(p);
            direction[axis].push(d);
        }
        leaving.push([triangle, NO_TRIANGLE, NO_TRIANGLE, NO_TRIANGLE] as [u32; LEAVING]);
    }

    let (mut t, mut triangle) = (vec![0.0; RAYS], vec![NO_TRIANGLE; RAYS]);
    let (mut u, mut v) = (vec![0.0; RAYS], vec![0.0; RAYS]);
    let mut best = f64::INFINITY;
    for _ in 0..7 {
        t.fill(f64::INFINITY);
        let start = Instant::now();
        let rays = Rays {
            origin: origin.each_ref().map(Vec::as_slice),
            direction: direction.each_ref().map(Vec::as_slice),
        };
        let found = Found {
            t: &mut t,
            triangle: &mut triangle,
            u: &mut u,
            v: &mut v,
        };
        mesh.nearest_block(rays, &leaving, found);
        best = best.min(start.elapsed().as_secs_f64());
    }
    let hits = triangle.iter().filter(|i| **i != NO_TRIANGLE).count();
    println!("{:.2} M rays/s, {hits} of {RAYS} hit", RAYS as f64 / best / 1e6);

    if let Some(folder) = std::env::args().nth(1) {
        let folder = std::path::Path::new(&folder);
        let floats = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let points: Vec<f64> = vertices.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        let indices: Vec<u8> = triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        std::fs::write(folder.join("vertices.f64"), floats(&points))?;
        std::fs::write(folder.join("triangles.u32"), indices)?;
        std::fs::write(folder.join("rays.f64"), floats(&[origin, direction].concat().concat()))?;
        std::fs::write(folder.join("distances.f64"), floats(&t))?;
    }
    Ok(())
}
