//! Nearest hits per second of one thread, for the rays and the mesh in a folder: `vertices.f64` (x, y, z of each vertex),
//! `triangles.u32` (three vertices each), `rays.f64` (start points, then directions, axis by axis), all little-endian.
//!
//! `cargo run --release -p etendue-geometry --example mesh_speed FOLDER`
#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use etendue_geometry::mesh::{Found, MOST_ORIGIN_TRIANGLES, Mesh, NO_TRIANGLE, Rays};
use etendue_math::Vec3;

const REPEATS: usize = 7;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name a folder")?);
    let floats = |name: &str| -> Result<Vec<f64>, Box<dyn Error>> {
        let bytes = std::fs::read(folder.join(name))?;
        let number = |b: &[u8]| f64::from_le_bytes(std::array::from_fn(|i| b[i]));
        Ok(bytes.chunks_exact(8).map(number).collect())
    };
    let vertices = floats("vertices.f64")?;
    let vertices = vertices.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
    let bytes = std::fs::read(folder.join("triangles.u32"))?;
    let index = |b: &[u8]| u32::from_le_bytes(std::array::from_fn(|i| b[i]));
    let indices: Vec<u32> = bytes.chunks_exact(4).map(index).collect();
    let triangles = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    let mesh = Mesh::new(vertices, triangles, None)?;

    let rays = floats("rays.f64")?;
    let count = rays.len() / 6;
    let row = |i: usize| &rays[i * count..(i + 1) * count];
    let leaving = vec![[NO_TRIANGLE; MOST_ORIGIN_TRIANGLES]; count];
    let (mut t, mut triangle) = (vec![0.0; count], vec![NO_TRIANGLE; count]);
    let (mut u, mut v) = (vec![0.0; count], vec![0.0; count]);
    let mut best = f64::INFINITY;
    for _ in 0..REPEATS {
        t.fill(f64::INFINITY);
        let start = Instant::now();
        let rays = Rays {
            origin: [row(0), row(1), row(2)],
            direction: [row(3), row(4), row(5)],
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
    println!("{:.3} M rays/s, {hits} of {count} hit", count as f64 / best / 1e6);
    Ok(())
}
