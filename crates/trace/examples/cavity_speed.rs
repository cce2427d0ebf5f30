//! How many segments per second the tracer follows in a cavity of analytic faces: `cargo run --release --example cavity_speed`.
//!
//! A cylinder of radius 21.5 and height 21.4, open at the top, closed below by a disk, Lambertian with reflectance 0.984;
//! four black disks in the base, which emit Lambertian from 1 µm above. The share that leaves is 0.9550 ± 0.0001.

#![allow(clippy::print_stdout, reason = "a program that reports what it measured")]

use std::sync::Arc;
use std::time::Instant;

use etendue_geometry::Face;
use etendue_geometry::shape::{Flat, Outline, Quadric, Shape};
use etendue_math::{Frame, Vec3};
use etendue_optics::bsdf::{Bsdf, Lambertian};
use etendue_optics::medium::{Index, Medium};
use etendue_optics::source::{Emitter, Pattern, Source, SurfaceSource};
use etendue_optics::table::{Curve, Table};
use etendue_sampling::ordered::{BATCH, inside};
use etendue_trace::forward::run::Run;
use etendue_trace::scene::{Scene, SceneFace};
use etendue_trace::work_unit::work_unit;

const RADIUS: f64 = 21.5;
const HEIGHT: f64 = 21.4;

fn at(x: f64, y: f64, z: f64) -> Frame {
    Frame {
        origin: Vec3::new(x, y, z),
        x: Vec3::new(1.0, 0.0, 0.0),
        y: Vec3::new(0.0, 1.0, 0.0),
        z: Vec3::new(0.0, 0.0, 1.0),
    }
}

fn disk(radius: f64) -> Shape {
    Shape::Flat(Flat {
        outline: Outline::Annulus {
            inner: 0.0,
            outer: radius,
        },
    })
}

fn part(shape: Shape, frame: Frame, finish: usize) -> SceneFace {
    SceneFace {
        face: Face {
            shape,
            frame,
            trims: vec![],
            flipped: false,
        },
        solid: None,
        finish,
        axis: None,
    }
}

fn scene() -> Result<Scene, String> {
    let finishes = [0.984, 0.0].map(|reflectance| {
        Arc::new(Lambertian::new(Table::constant(reflectance), Table::constant(0.0)).expect("at most 1"))
            as Arc<dyn Bsdf>
    });
    let wall = Shape::Quadric(Quadric {
        r2: 1.0,
        z2: 0.0,
        z1: 0.0,
        z0: -RADIUS * RADIUS,
        z: [0.0, HEIGHT],
        r: [0.0, f64::INFINITY],
    });
    let mut parts = vec![
        part(wall, at(0.0, 0.0, 0.0), 0),
        part(disk(RADIUS), at(0.0, 0.0, 0.0), 0),
    ];
    let mut sources = Vec::new();
    for (x, y) in [(10.0, 0.0), (-10.0, 0.0), (0.0, 10.0), (0.0, -10.0)] {
        parts.push(part(disk(2.5), at(x, y, 5e-4), 1));
        sources.push(Source {
            emitter: Emitter::Surface(SurfaceSource::new(disk(2.5), false, Pattern::CosinePower(1.0)).expect("finite")),
            frame: at(x, y, 1e-3),
            flux: 0.96,
            spectrum: vec![(555.0, 1.0)],
        });
    }
    let air = Medium {
        index: Index::Table(Curve::constant(1.0)),
        absorption: Curve::constant(0.0),
    };
    Scene::new(parts, finishes.to_vec(), vec![air], vec![], sources, vec![])
}

fn main() -> Result<(), String> {
    let scene = scene()?;
    let rays = 4_000_000_u64;
    let run = Run {
        rays,
        seed: 1,
        most_events: 100_000,
        sets: &[],
        stop: None,
        light_samplers: &[],
    };
    for threads in [1, 2] {
        let begin = Instant::now();
        let sums = inside(threads, || work_unit(&scene, &[], &run, 0..rays.div_ceil(BATCH)));
        let seconds = begin.elapsed().as_secs_f64();
        let [emitted, _] = sums.ledger.balance();
        println!(
            "{threads} threads: {:.1} M segments/s, {:.2} segments per ray, exit fraction {:.4}",
            sums.ledger.segments as f64 / seconds * 1e-6,
            sums.ledger.segments as f64 / rays as f64,
            sums.ledger.escaped.flux() / emitted.flux(),
        );
    }
    Ok(())
}
