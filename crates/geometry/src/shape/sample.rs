//! Points spread evenly over the area of a shape.

use std::f64::consts::PI;
use std::sync::Arc;

use etendue_math::trig::sin_cos_turns;
use etendue_math::{Interval, Vec3};
use etendue_sampling::alias::Alias;

use crate::mesh::Mesh;

use super::asphere::Asphere;
use super::flat::{Flat, Outline};
use super::quadric::{Quadric, ranges_of_z, squared_radius};
use super::surface::Shape;
use super::torus::Torus;

/// Stretches into which the outline of a body of rotation is cut.
const STRETCHES: usize = 256;

/// Draws points with density 1/area.
///
/// Bodies of rotation are cut into stretches of their outline; a stretch is picked by its area, a place in it by
/// rejection from its largest density, so that the result is exact.
#[derive(Clone, Debug)]
pub struct AreaSampler {
    kind: Kind,
    area: f64,
}

#[derive(Clone, Debug)]
enum Kind {
    Rectangle([f64; 2]),
    Annulus([f64; 2]),
    /// Triangles, and the table that picks one by its area.
    Polygon(Vec<[[f64; 2]; 3]>, Alias),
    Rotation(Outlined, Vec<Stretch>, Alias),
    Mesh(Arc<Mesh>),
}

/// What is turned about the z axis: the parameter s runs along its outline.
#[derive(Clone, Debug)]
pub(super) enum Outlined {
    /// s = z.
    Quadric(Quadric),
    /// s = r².
    Asphere(Asphere),
    /// s is the angle about the centre line \[rad\].
    Torus(Torus),
}

#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: f64,
    to: f64,
    /// No dA/ds of the stretch is larger.
    most: f64,
}

/// Nodes and weights of Gauss's rule with five points on (0, 1).
const GAUSS: [[f64; 2]; 5] = [
    [0.046_910_077_030_668, 0.118_463_442_528_094_5],
    [0.230_765_344_947_158_4, 0.239_314_335_249_683_2],
    [0.5, 0.284_444_444_444_444_4],
    [0.769_234_655_052_841_6, 0.239_314_335_249_683_2],
    [0.953_089_922_969_332, 0.118_463_442_528_094_5],
];

impl Outlined {
    /// dA/ds.
    pub(super) fn density(&self, s: f64) -> f64 {
        match self {
            // With r² = g(z), dA = 2π r √(1 + r'²) dz = 2π √(g + g'²/4) dz, which is smooth at an apex too.
            Self::Quadric(q) => {
                let g = squared_radius(q, s);
                let slope = -(2.0 * q.z2 * s + q.z1) / q.r2;
                2.0 * PI * (g.max(0.0) + 0.25 * slope * slope).sqrt()
            }
            // With z = f(s), s = r²: dA = π √(1 + 4 s f'²) ds.
            Self::Asphere(a) => {
                let slope = a.sag_at(s)[1];
                PI * (1.0 + 4.0 * s * slope * slope).sqrt()
            }
            Self::Torus(t) => 2.0 * PI * t.minor * (t.major + t.minor * s.cos()),
        }
    }

    /// A bound of dA/ds over a stretch.
    fn bound(&self, from: f64, to: f64) -> f64 {
        match self {
            Self::Quadric(q) => {
                // g + g'²/4 is of second order in z: largest at an end, or at its own extreme.
                let [a, b] = [-q.z2 / q.r2, -q.z1 / q.r2];
                let (second, first) = (a + a * a, b + a * b);
                let middle = if second < 0.0 {
                    (-0.5 * first / second).clamp(from, to)
                } else {
                    from
                };
                [from, to, middle]
                    .map(|s| self.density(s))
                    .into_iter()
                    .fold(0.0, f64::max)
            }
            Self::Asphere(a) => {
                let [_, slope] = a.sag_over(Interval::new(from, to));
                PI * (1.0 + 4.0 * to * slope.squared().hi).sqrt()
            }
            Self::Torus(t) => {
                // The cosine is largest at 0, at 2π or at an end.
                let inner = if from <= 0.0 { 1.0 } else { from.cos().max(to.cos()) };
                2.0 * PI * t.minor * (t.major + t.minor * inner)
            }
        }
    }

    /// The point at s, `turn` turns about the axis.
    pub(super) fn point(&self, s: f64, turn: f64) -> Vec3 {
        let (r, z) = match self {
            Self::Quadric(q) => (squared_radius(q, s).max(0.0).sqrt(), s),
            Self::Asphere(a) => (s.sqrt(), a.sag_at(s)[0]),
            Self::Torus(t) => (t.major + t.minor * s.cos(), t.minor * s.sin()),
        };
        let (sine, cosine) = sin_cos_turns(turn);
        Vec3::new(r * cosine, r * sine, z)
    }

    /// The ranges of s that belong to the surface.
    pub(super) fn ranges(&self) -> Option<Vec<[f64; 2]>> {
        match self {
            Self::Quadric(q) => ranges_of_z(q),
            Self::Asphere(a) => {
                let [inner, outer] = a.radii();
                Some(vec![[inner * inner, outer * outer]])
            }
            Self::Torus(_) => Some(vec![[0.0, 2.0 * PI]]),
        }
    }
}

impl AreaSampler {
    /// None if the surface has no finite, positive area.
    #[must_use]
    pub fn new(shape: &Shape) -> Option<Self> {
        let sampler = match shape {
            Shape::Flat(Flat { outline }) => match outline {
                Outline::Whole => return None,
                Outline::Rectangle { width, height } => Self {
                    kind: Kind::Rectangle([*width, *height]),
                    area: width * height,
                },
                Outline::Annulus { inner, outer } => Self {
                    kind: Kind::Annulus([*inner, *outer]),
                    area: PI * (outer * outer - inner * inner),
                },
                Outline::Polygon { vertices } => {
                    let triangles = triangulate(vertices);
                    let areas: Vec<f64> = triangles.iter().map(|t| 0.5 * twice_area(*t).abs()).collect();
                    let table = Alias::new(&areas)?;
                    Self {
                        area: areas.iter().sum(),
                        kind: Kind::Polygon(triangles, table),
                    }
                }
            },
            Shape::Quadric(q) => rotation(Outlined::Quadric(*q))?,
            Shape::Asphere(a) => rotation(Outlined::Asphere(a.clone()))?,
            Shape::Torus(t) => rotation(Outlined::Torus(*t))?,
            Shape::Mesh(mesh) => Self {
                area: mesh.area(),
                kind: Kind::Mesh(Arc::clone(mesh)),
            },
        };
        (sampler.area > 0.0 && sampler.area.is_finite()).then_some(sampler)
    }

    /// \[mm²\].
    #[must_use]
    pub const fn area(&self) -> f64 {
        self.area
    }

    /// A point of the surface and the part that it lies on; takes numbers between 0 and 1 from `next` as it needs them.
    #[must_use]
    pub fn draw(&self, next: &mut impl FnMut() -> f64) -> (Vec3, u32) {
        let point = match &self.kind {
            Kind::Mesh(mesh) => return mesh.sample(next(), next(), next()),
            Kind::Rectangle([width, height]) => Vec3::new((next() - 0.5) * width, (next() - 0.5) * height, 0.0),
            Kind::Annulus([inner, outer]) => {
                let (x, y) = etendue_sampling::warp::square_to_annulus(next(), next(), *inner, *outer);
                Vec3::new(x, y, 0.0)
            }
            Kind::Polygon(triangles, table) => {
                let [a, b, c] = triangles[table.pick(next())];
                let root = next().sqrt();
                let (u, v) = (1.0 - root, next() * root);
                let at = |k: usize| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
                Vec3::new(at(0), at(1), 0.0)
            }
            Kind::Rotation(outlined, stretches, table) => loop {
                let stretch = stretches[table.pick(next())];
                let s = stretch.from + next() * (stretch.to - stretch.from);
                if next() * stretch.most <= outlined.density(s) {
                    break outlined.point(s, next());
                }
            },
        };
        (point, 0)
    }
}

fn rotation(outlined: Outlined) -> Option<AreaSampler> {
    let ranges = outlined.ranges()?;
    let (mut stretches, mut areas, mut area) = (Vec::new(), Vec::new(), 0.0);
    for [from, to] in ranges {
        for i in 0..STRETCHES {
            let at = |i: usize| from + (to - from) * (i as f64 / STRETCHES as f64);
            let (from, to) = (at(i), at(i + 1));
            let most = outlined.bound(from, to);
            area += integral(|s| outlined.density(s), from, to);
            // Picked by the area under the bound: rejection leaves the area under the density.
            areas.push((to - from) * most);
            stretches.push(Stretch { from, to, most });
        }
    }
    let table = Alias::new(&areas)?;
    Some(AreaSampler {
        kind: Kind::Rotation(outlined, stretches, table),
        area,
    })
}

/// ∫ f(s) ds by Gauss's rule.
pub(super) fn integral(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let sum: f64 = GAUSS.iter().map(|[x, w]| w * f(from + x * (to - from))).sum();
    (to - from) * sum
}

pub(super) fn twice_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// A simple polygon as triangles, by cutting off ears.
pub(super) fn triangulate(vertices: &[[f64; 2]]) -> Vec<[[f64; 2]; 3]> {
    let mut rest: Vec<[f64; 2]> = vertices.to_vec();
    let turn = |p: &[[f64; 2]]| -> f64 {
        (0..p.len())
            .map(|i| {
                let (a, b) = (p[i], p[(i + 1) % p.len()]);
                a[0] * b[1] - a[1] * b[0]
            })
            .sum()
    };
    if turn(&rest) < 0.0 {
        rest.reverse();
    }
    let mut triangles = Vec::new();
    while rest.len() > 3 {
        let n = rest.len();
        let ear = (0..n).find(|&i| {
            let corner = [rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]];
            let holds = |p: &[f64; 2]| {
                let [a, b, c] = corner;
                [[a, b, *p], [b, c, *p], [c, a, *p]]
                    .into_iter()
                    .all(|t| twice_area(t) >= 0.0)
            };
            twice_area(corner) > 0.0 && !rest.iter().filter(|p| !corner.contains(p)).any(holds)
        });
        // A corner that is none (three points on a line) is left out; the area stays the same.
        let flat = (0..n).find(|&i| twice_area([rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]]) == 0.0);
        let Some(i) = ear.or(flat) else { break };
        let corner = [rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]];
        if twice_area(corner) > 0.0 {
            triangles.push(corner);
        }
        rest.remove(i);
    }
    if let [a, b, c] = rest[..] {
        triangles.push([a, b, c]);
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use etendue_sampling::philox::Stream;

    const ALL_R: [f64; 2] = [0.0, f64::INFINITY];

    fn draws(sampler: &AreaSampler, n: u64) -> Vec<Vec3> {
        let stream = Stream::new(3, 17);
        let mut points = Vec::new();
        for i in 0..n {
            let (mut block, mut k, mut numbers) = (0, 4, [0.0; 4]);
            points.push(
                sampler
                    .draw(&mut || {
                        if k == 4 {
                            (numbers, k, block) = (stream.uniforms(i, block), 0, block + 1);
                        }
                        k += 1;
                        numbers[k - 1]
                    })
                    .0,
            );
        }
        points
    }

    fn sphere(radius: f64, z: [f64; 2]) -> Shape {
        Shape::Quadric(Quadric {
            r2: 1.0,
            z2: 1.0,
            z1: 0.0,
            z0: -radius * radius,
            z,
            r: ALL_R,
        })
    }

    #[test]
    fn areas_are_those_of_closed_forms() {
        let area = |shape: &Shape| AreaSampler::new(shape).expect("finite").area();
        let near = |found: f64, exact: f64| assert!((found / exact - 1.0).abs() < 1e-10, "{found} {exact}");
        // Archimedes: a zone of a sphere is as large as that of the cylinder around it.
        near(area(&sphere(2.0, [-0.5, 1.7])), 2.0 * PI * 2.0 * 2.2);
        near(area(&sphere(2.0, [f64::NEG_INFINITY, f64::INFINITY])), 16.0 * PI);
        // z = r²/(4 f): (8 π/3) f² ((1 + (R/2f)²)^{3/2} − 1).
        let (f, rim) = (1.5, 4.0);
        let paraboloid = Shape::Quadric(Quadric {
            r2: 0.25 / f,
            z2: 0.0,
            z1: -1.0,
            z0: 0.0,
            z: [f64::NEG_INFINITY, f64::INFINITY],
            r: [0.0, rim],
        });
        let exact = 8.0 * PI / 3.0 * f * f * ((1.0 + (rim / (2.0 * f)).powi(2)).powf(1.5) - 1.0);
        near(area(&paraboloid), exact);
        let same = Asphere::new(1.0 / (2.0 * f), -1.0, vec![], [0.0, rim]).expect("sound");
        near(area(&Shape::Asphere(same)), exact);
        near(
            area(&Shape::Torus(Torus { major: 3.0, minor: 1.0 })),
            4.0 * PI * PI * 3.0,
        );
        // A cone from its apex: π r s.
        let cone = Shape::Quadric(Quadric {
            r2: 1.0,
            z2: -0.25,
            z1: 0.0,
            z0: 0.0,
            z: [0.0, 4.0],
            r: ALL_R,
        });
        near(area(&cone), PI * 2.0 * 20.0_f64.sqrt());
        let l = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        near(
            area(&Shape::Flat(Flat {
                outline: Outline::Polygon { vertices: l.into() },
            })),
            3.0,
        );
        assert!(
            AreaSampler::new(&Shape::Flat(Flat {
                outline: Outline::Whole
            }))
            .is_none()
        );
    }

    /// χ² of counts in bins of equal share.
    fn chi_square(places: &[f64], bins: usize) -> f64 {
        let mut counts = vec![0.0; bins];
        for p in places {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "p lies in 0..1")]
            let bin = (p * bins as f64) as usize;
            counts[bin.min(bins - 1)] += 1.0;
        }
        let expected = places.len() as f64 / bins as f64;
        counts.iter().map(|n| (n - expected) * (n - expected) / expected).sum()
    }

    /// A shape, and the share of its area that lies below a point.
    type Case = (Shape, fn(Vec3) -> f64);

    #[test]
    fn points_are_spread_evenly() {
        // The area below a point, as a share of the whole, is uniform: χ² with 49 degrees of freedom, 1e-4 point 95.2.
        let torus = Torus { major: 3.0, minor: 1.0 };
        let cases: [Case; 4] = [
            (sphere(2.0, [-0.5, 1.7]), |p| (p.z + 0.5) / 2.2),
            (
                Shape::Asphere(Asphere::new(1.0 / 3.0, -1.0, vec![], [0.0, 4.0]).expect("sound")),
                |p| {
                    let below = |r2: f64| (1.0 + r2 / 9.0).powf(1.5) - 1.0;
                    below(p.x * p.x + p.y * p.y) / below(16.0)
                },
            ),
            (Shape::Torus(torus), |p| {
                let angle = p.z.atan2(p.x.hypot(p.y) - 3.0).rem_euclid(2.0 * PI);
                (3.0 * angle + angle.sin()) / (6.0 * PI)
            }),
            (
                Shape::Flat(Flat {
                    outline: Outline::Polygon {
                        vertices: vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]].into(),
                    },
                }),
                |p| {
                    if p.x < 1.0 {
                        2.0 * p.x / 3.0
                    } else {
                        (2.0 + (p.x - 1.0)) / 3.0
                    }
                },
            ),
        ];
        for (shape, share) in cases {
            let points = draws(&AreaSampler::new(&shape).expect("finite"), 100_000);
            let places: Vec<f64> = points.iter().map(|p| share(*p)).collect();
            assert!(chi_square(&places, 50) < 95.2, "{shape:?}");
            for p in points.iter().take(1000) {
                assert!((shape.settle(*p, 0).0 - *p).length() < 1e-12);
            }
        }
    }
}
