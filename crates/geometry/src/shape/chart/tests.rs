//! Patches by areas, sizes and bins.

use std::sync::Arc;

use super::*;
use crate::shape::sample::AreaSampler;
use crate::shape::{Asphere, Quadric, Torus};
use etendue_sampling::philox::Stream;

fn zoo() -> Vec<Shape> {
    let flat = |outline| Shape::Flat(Flat { outline });
    let quadric = |r2, z2, z1, z0, z, r| Shape::Quadric(Quadric { r2, z2, z1, z0, z, r });
    let corner = |x, y, z| Vec3::new(x, y, z);
    let vertices = vec![
        corner(0.0, 0.0, 0.0),
        corner(9.0, 0.5, 0.0),
        corner(1.0, 7.0, 2.0),
        corner(0.3, 0.2, 6.0),
    ];
    let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    // A fine strip, whose triangles are far smaller than a patch.
    let mut strip = (Vec::new(), Vec::new());
    for i in 0..60_u32 {
        let x = f64::from(i) * 0.1;
        strip
            .0
            .extend([corner(x, 0.0, 0.1 * x * x), corner(x, 1.5, 0.1 * x * x)]);
        if i > 0 {
            strip
                .1
                .extend([[2 * i - 2, 2 * i, 2 * i - 1], [2 * i - 1, 2 * i, 2 * i + 1]]);
        }
    }
    let ell = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.5, 1.2], [1.0, 3.0], [0.0, 3.0]];
    let inf = f64::INFINITY;
    vec![
        flat(Outline::Rectangle {
            width: 7.0,
            height: 2.0,
        }),
        flat(Outline::Annulus { inner: 0.0, outer: 3.0 }),
        flat(Outline::Annulus { inner: 1.0, outer: 3.0 }),
        flat(Outline::Polygon { vertices: ell.into() }),
        quadric(1.0, 1.0, 0.0, -9.0, [-inf, inf], [0.0, inf]),
        quadric(1.0, 0.0, 0.0, -4.0, [-3.0, 5.0], [0.0, inf]),
        quadric(0.25, 0.0, -1.0, 0.0, [-inf, inf], [0.5, 4.0]),
        // Two pieces of one sphere.
        quadric(1.0, 1.0, 0.0, -9.0, [-inf, inf], [0.0, 2.0]),
        Shape::Asphere(Asphere::new(0.1, -2.0, vec![1e-3], [0.0, 4.0]).expect("sound")),
        Shape::Torus(Torus { major: 3.0, minor: 1.0 }),
        Shape::Mesh(Arc::new(Mesh::new(vertices, faces, None).expect("sound"))),
        Shape::Mesh(Arc::new(Mesh::new(strip.0, strip.1, None).expect("sound"))),
    ]
}

/// Point `i` of those that are spread evenly over a surface, and its triangle.
fn drawn(sampler: &AreaSampler, stream: Stream, i: u64) -> (Vec3, u32) {
    let (mut block, mut k, mut numbers) = (0, 4, [0.0; 4]);
    sampler.draw(&mut || {
        if k == 4 {
            (numbers, k, block) = (stream.uniforms(i, block), 0, block + 1);
        }
        k += 1;
        numbers[k - 1]
    })
}

#[test]
fn evenly_spread_points_fall_into_patches_by_their_areas() {
    for (number, shape) in (0..).zip(zoo()) {
        let sampler = AreaSampler::new(&shape).expect("finite");
        let chart = Chart::new(&shape, 0.3).expect("finite");
        let areas = chart.areas();
        let total: f64 = areas.iter().sum();
        assert!((total / sampler.area() - 1.0).abs() < 1e-6, "{shape:?}: {total}");
        let (mut counts, n) = (vec![0_u32; areas.len()], 2000 * areas.len() as u64);
        let stream = Stream::new(8, number);
        for i in 0..n {
            let (p, triangle) = drawn(&sampler, stream, i);
            counts[(chart.bin(p, triangle) / BINS) as usize] += 1;
        }
        // χ² of known shares: its mean is the number of patches but one, its variance twice that.
        let degrees = areas.len() as f64 - 1.0;
        let chi2: f64 = counts
            .iter()
            .zip(areas)
            .map(|(c, a)| {
                let expected = n as f64 * a / total;
                (f64::from(*c) - expected).powi(2) / expected
            })
            .sum();
        assert!(
            (chi2 - degrees).abs() < 4.5 * (2.0 * degrees).sqrt(),
            "{shape:?}: {chi2} of {degrees}"
        );
    }
}

#[test]
fn patches_are_small_and_every_bin_is_used() {
    for shape in zoo() {
        let sampler = AreaSampler::new(&shape).expect("finite");
        let chart = Chart::new(&shape, 0.3).expect("finite");
        let mut seen = vec![Vec::new(); chart.areas().len()];
        let mut bins = vec![0_u32; seen.len() * BINS as usize];
        let stream = Stream::new(9, 0);
        for i in 0..400 * seen.len() as u64 {
            let (p, triangle) = drawn(&sampler, stream, i);
            let bin = chart.bin(p, triangle);
            bins[bin as usize] += 1;
            seen[(bin / BINS) as usize].push(p);
        }
        for (patch, counts) in bins.chunks(BINS as usize).enumerate() {
            let found = counts
                .iter()
                .rev()
                .fold(0, |bits, count| bits << 1 | u32::from(*count > 0));
            assert_eq!(found, chart.bins(patch), "{shape:?}");
        }
        for points in &seen {
            let far = points.iter().map(|p| (*p - points[0]).length()).fold(0.0, f64::max);
            assert!(far < 3.5 * 0.3_f64.sqrt(), "{shape:?}: {far}");
        }
    }
}

#[test]
fn what_has_no_end_has_no_chart() {
    assert!(
        Chart::new(
            &Shape::Flat(Flat {
                outline: Outline::Whole
            }),
            1.0
        )
        .is_none()
    );
}
