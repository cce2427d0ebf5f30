//! Integrals over directions.

use std::f64::consts::PI;

use etendue_math::Vec3;

use super::super::contract::by_cosine;
use super::super::examples::Example;

/// The direction of this height and azimuth, in turns.
pub(super) fn direction(height: f64, turn: f64) -> Vec3 {
    let across = ((1.0 - height) * (1.0 + height)).sqrt();
    let (s, c) = (2.0 * PI * turn).sin_cos();
    Vec3::new(across * c, across * s, height)
}

/// Cells of a hemisphere: bands of height, sectors of azimuth.
pub(super) const BANDS: usize = 6;
pub(super) const SECTORS: usize = 8;

/// The mean of a function over a cell, times the solid angle of the cell: by height after Gauss and Legendre, two nodes in
/// each of `fine`/2 parts, which is exact for cubics and leaves 10⁻⁸ of smooth lobes; by azimuth at the middles of `fine` parts.
fn integral(front: bool, band: usize, sector: usize, fine: usize, f: impl Fn(Vec3) -> f64) -> f64 {
    let off = 0.5 / 3_f64.sqrt();
    let parts = fine / 2;
    let mut sum = 0.0;
    for (i, node) in (0..parts).flat_map(|i| [(i, 0.5 - off), (i, 0.5 + off)]) {
        let height = (band as f64 + (i as f64 + node) / parts as f64) / BANDS as f64;
        for k in 0..fine {
            let turn = (sector as f64 + (k as f64 + 0.5) / fine as f64) / SECTORS as f64;
            sum += f(direction(if front { height } else { -height }, turn));
        }
    }
    sum * 2.0 * PI / ((BANDS * SECTORS * 2 * parts * fine) as f64)
}

/// The integrals over all cells, those of the front first.
pub(super) fn integrals(fine: usize, f: impl Fn(Vec3) -> f64) -> Vec<f64> {
    let cells = (0..2 * BANDS * SECTORS).map(|cell| {
        let (side, rest) = (cell / (BANDS * SECTORS), cell % (BANDS * SECTORS));
        integral(side == 0, rest / SECTORS, rest % SECTORS, fine, &f)
    });
    cells.collect()
}

/// ∫ g |cos θ| dΩ over one side, by a lattice of Fibonacci that is finer along the normal and at the rim.
pub(super) fn over_lattice(up: bool, g: impl Fn(Vec3) -> f64) -> f64 {
    let (n, step) = (17_711_u32, 10_946_u32);
    let each = (0..n).map(|k| {
        let u = (f64::from(k) + 0.5) / f64::from(n);
        let turn = (f64::from(k) * f64::from(step) / f64::from(n)).fract();
        g(by_cosine(up, [u * u * (3.0 - 2.0 * u), turn])) * 6.0 * u * (1.0 - u)
    });
    each.sum::<f64>() * PI / f64::from(n)
}

/// ∫ g |cos θ| dΩ over one side, in polar coordinates about the specular direction of `incident` in the plane of direction
/// cosines, where cos θ dΩ is area; in steps that are finer towards it and towards the rim.
pub(super) fn projected(example: &Example, incident: Vec3, transmitted: bool, g: impl Fn(Vec3) -> f64) -> f64 {
    const AZIMUTHS: usize = 200;
    const STEPS: usize = 24;
    let up = (incident.z > 0.0) != transmitted;
    if example.lattice {
        return over_lattice(up, g);
    }
    let square = incident.x * incident.x + incident.y * incident.y;
    let off = 0.5 / 3_f64.sqrt();
    let mut sum = 0.0;
    for k in 0..AZIMUTHS {
        let (s, c) = (2.0 * PI * (k as f64 + 0.5) / AZIMUTHS as f64).sin_cos();
        // To the unit circle, in this direction.
        let along = c * incident.x + s * incident.y;
        let rim = along + (along * along + 1.0 - square).max(0.0).sqrt();
        for i in 0..STEPS {
            for node in [0.5 - off, 0.5 + off] {
                let u = (i as f64 + node) / STEPS as f64;
                let r = rim * (0.5 * PI * u).sin().powi(2);
                let (x, y) = (r * c - incident.x, r * s - incident.y);
                let height = (1.0 - x * x - y * y).max(1e-300).sqrt();
                let d = Vec3::new(x, y, if up { height } else { -height });
                sum += g(d) * r * rim * 0.5 * PI * (PI * u).sin();
            }
        }
    }
    sum * PI / (AZIMUTHS * STEPS) as f64
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small numbers that are not negative"
)]
pub(super) fn cell_of(d: Vec3) -> usize {
    let band = ((d.z.abs() * BANDS as f64) as usize).min(BANDS - 1);
    let turn = (d.y.atan2(d.x) / (2.0 * PI)).rem_euclid(1.0);
    let sector = ((turn * SECTORS as f64) as usize).min(SECTORS - 1);
    (if d.z > 0.0 { 0 } else { BANDS * SECTORS }) + band * SECTORS + sector
}
