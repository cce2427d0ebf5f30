//! Pixels of a part of a carrier surface, in the part's own coordinates: as `etendue.lightfield.gridded` cuts them.

use std::f64::consts::PI;

use etendue_geometry::bounds::Bounds;
use etendue_math::Vec3;

use crate::source::numbers::Numbers;

/// Share of a square by which a point may lie beyond the lattice: as in Python.
const SLACK: f64 = 1e-9;

/// Equal-area pixels, numbered from 0.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// Squares of a lattice in z = 0 that send light to +z.
    Squares {
        /// A corner of the lattice \[mm\].
        corner: [f64; 2],
        /// \[mm\].
        side: f64,
        /// Number of the first square along x and y, counted from the corner.
        first: [f64; 2],
        /// Squares along x and y.
        count: [usize; 2],
    },
    /// A hemisphere z ≥ 0 between parallels: (2 N − 1)² cells.
    Spherical {
        /// \[mm\].
        radius: f64,
        /// N.
        parallels: usize,
    },
    /// The side of a cylinder about z.
    Cylindrical {
        /// \[mm\].
        radius: f64,
        /// \[mm\], half of it below z = 0.
        height: f64,
        /// Cells around the circle.
        columns: usize,
        /// Cells along the axis.
        rows: usize,
    },
}

/// Where light leaves a part.
#[derive(Clone, Copy, Debug)]
pub struct Exit {
    /// Along the line \[mm\].
    pub t: f64,
    /// Which pixel.
    pub pixel: usize,
    /// Cosine of the angle to the normal there.
    pub cosine: f64,
}

/// Which of `n` equal steps a number of steps lies in; the far edge belongs to the last one.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "negative ones belong to the first"
)]
fn step(x: f64, n: usize) -> usize {
    (x.max(0.0) as usize).min(n - 1)
}

fn turns(point: Vec3) -> f64 {
    let turn = point.y.atan2(point.x) / (2.0 * PI);
    if turn < 0.0 { turn + 1.0 } else { turn }
}

impl Cells {
    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        match self {
            Self::Squares { count, .. } => count[0] * count[1],
            Self::Spherical { parallels, .. } => (2 * parallels - 1) * (2 * parallels - 1),
            Self::Cylindrical { columns, rows, .. } => columns * rows,
        }
    }

    /// Area of each \[mm²\].
    #[must_use]
    pub fn area(&self) -> f64 {
        match self {
            Self::Squares { side, .. } => side * side,
            Self::Spherical { radius, .. } => 2.0 * PI * radius * radius / self.count() as f64,
            Self::Cylindrical { radius, height, .. } => 2.0 * PI * radius * height / self.count() as f64,
        }
    }

    /// A box around all of them.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let (low, high) = match *self {
            Self::Squares {
                corner,
                side,
                first,
                count,
            } => {
                let at = |axis: usize, n: f64| corner[axis] + (first[axis] + n) * side;
                let [nx, ny] = count.map(|n| n as f64);
                (
                    Vec3::new(at(0, 0.0), at(1, 0.0), 0.0),
                    Vec3::new(at(0, nx), at(1, ny), 0.0),
                )
            }
            Self::Spherical { radius: r, .. } => (Vec3::new(-r, -r, 0.0), Vec3::new(r, r, r)),
            Self::Cylindrical { radius: r, height, .. } => {
                (Vec3::new(-r, -r, -0.5 * height), Vec3::new(r, r, 0.5 * height))
            }
        };
        Bounds::of([low, high])
    }

    /// Where light along the unit vector `k` on the line through `p` leaves the part.
    #[must_use]
    pub fn exit(&self, p: Vec3, k: Vec3) -> Option<Exit> {
        match *self {
            Self::Squares {
                corner,
                side,
                first,
                count,
            } => {
                if k.z <= 0.0 {
                    return None;
                }
                let t = -p.z / k.z;
                let x = (p.x + t * k.x - corner[0]) / side - first[0];
                let y = (p.y + t * k.y - corner[1]) / side - first[1];
                let within = |x: f64, n: usize| (-SLACK..=n as f64 + SLACK).contains(&x);
                (within(x, count[0]) && within(y, count[1])).then(|| Exit {
                    t,
                    pixel: step(x, count[0]) * count[1] + step(y, count[1]),
                    cosine: k.z,
                })
            }
            Self::Spherical { radius, parallels } => {
                let along = p.dot(k);
                let nearest = p - k * along;
                let square = radius * radius - nearest.dot(nearest);
                let point = nearest + k * square.max(0.0).sqrt();
                (square >= 0.0 && point.z >= 0.0).then(|| {
                    // 1 − cos θ without cancellation at the pole.
                    let height = (point.x * point.x + point.y * point.y) / (radius * (radius + point.z));
                    let ring = step(
                        f64::midpoint(height.sqrt() * (2 * parallels - 1) as f64, 1.0),
                        parallels,
                    );
                    let pixel = if ring == 0 {
                        0
                    } else {
                        (2 * ring - 1).pow(2) + step(turns(point) * (8 * ring) as f64, 8 * ring)
                    };
                    Exit {
                        t: square.sqrt() - along,
                        pixel,
                        cosine: point.dot(k) / radius,
                    }
                })
            }
            Self::Cylindrical {
                radius,
                height,
                columns,
                rows,
            } => {
                let across = k.x.hypot(k.y);
                if across <= 0.0 {
                    return None;
                }
                let unit = k * (1.0 / across);
                let along = -(p.x * unit.x + p.y * unit.y);
                let nearest = p + unit * along;
                let square = radius * radius - nearest.x * nearest.x - nearest.y * nearest.y;
                let point = nearest + unit * square.max(0.0).sqrt();
                (square >= 0.0 && point.z.abs() <= 0.5 * height).then(|| Exit {
                    t: (along + square.sqrt()) / across,
                    pixel: step(turns(point) * columns as f64, columns) * rows
                        + step((point.z / height + 0.5) * rows as f64, rows),
                    cosine: (point.x * k.x + point.y * k.y) / radius,
                })
            }
        }
    }

    /// A point spread evenly over a pixel, and the normal there.
    #[must_use]
    pub fn point(&self, pixel: usize, numbers: &mut Numbers) -> (Vec3, Vec3) {
        let (u, v) = (numbers.draw(), numbers.draw());
        match *self {
            Self::Squares {
                corner,
                side,
                first,
                count,
            } => {
                let at = |axis: usize, n: usize, u: f64| corner[axis] + (first[axis] + n as f64 + u) * side;
                let point = Vec3::new(at(0, pixel / count[1], u), at(1, pixel % count[1], v), 0.0);
                (point, Vec3::new(0.0, 0.0, 1.0))
            }
            Self::Spherical { radius, parallels } => {
                let [upper, lower, middle, half] = ring_bounds(pixel, parallels);
                let cosine = lower + u * (upper - lower);
                let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
                let (s, c) = (middle + (2.0 * v - 1.0) * half).sin_cos();
                let normal = Vec3::new(sine * c, sine * s, cosine);
                (normal * radius, normal)
            }
            Self::Cylindrical {
                radius,
                height,
                columns,
                rows,
            } => {
                let (s, c) = (2.0 * PI * ((pixel / rows) as f64 + u) / columns as f64).sin_cos();
                let z = (((pixel % rows) as f64 + v) / rows as f64 - 0.5) * height;
                (Vec3::new(radius * c, radius * s, z), Vec3::new(c, s, 0.0))
            }
        }
    }

    /// A bound of the cosine between a unit vector and the normals of a pixel whose mean normal is `normal`.
    #[must_use]
    pub fn most_cosine(&self, pixel: usize, k: Vec3, normal: Vec3) -> f64 {
        match *self {
            Self::Squares { .. } => k.z,
            Self::Spherical { parallels, .. } => {
                let [upper, lower, _, half] = ring_bounds(pixel, parallels);
                // No normal of the cell is further from its middle than this.
                let reach = half.hypot(lower.acos() - upper.acos());
                let away = normal.dot(k).clamp(-1.0, 1.0).acos();
                (away - reach).max(0.0).cos()
            }
            Self::Cylindrical { columns, rows, .. } => {
                let half = PI / columns as f64;
                let middle = (2.0 * (pixel / rows) as f64 + 1.0) * half;
                let away = ((k.y.atan2(k.x) - middle + PI).rem_euclid(2.0 * PI) - PI).abs();
                k.x.hypot(k.y) * (away - half).max(0.0).cos()
            }
        }
    }
}

/// Cosines of the upper and the lower parallel of a spherical cell, azimuth of its middle and half its width \[rad\].
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "roots of small whole numbers"
)]
fn ring_bounds(pixel: usize, parallels: usize) -> [f64; 4] {
    let ring = f64::midpoint((pixel as f64).sqrt(), 1.0) as usize;
    let parallel = |n: usize| 1.0 - (n as f64 / (2 * parallels - 1) as f64).powi(2);
    if ring == 0 {
        return [1.0, parallel(1), 0.0, PI];
    }
    let half = PI / (8 * ring) as f64;
    let place = pixel - (2 * ring - 1).pow(2);
    [
        parallel(2 * ring - 1),
        parallel(2 * ring + 1),
        (2 * place + 1) as f64 * half,
        half,
    ]
}
