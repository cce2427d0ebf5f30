//! Patches: a surface cut into small pieces of known area, each of them into sixteen bins of about the same area.

use std::f64::consts::PI;

use etendue_math::Vec3;
use etendue_math::trig::turns_of;

use crate::mesh::Mesh;

use super::flat::{Flat, Outline};
use super::sample::{Outlined, integral, triangulate, twice_area};
use super::surface::Shape;

/// Bins of a patch, in four rows of four.
pub const BINS: u32 = 16;

/// Points at which the length of an outline is measured.
const STEPS: usize = 2048;

/// Most patches along an outline or around it: no shape is so slender that it would need more.
const MOST: f64 = 4096.0;

/// Tells the bin of each point of a surface. Bin b belongs to patch b/16.
#[derive(Clone, Debug)]
pub struct Chart {
    kind: Kind,
    areas: Vec<f64>,
    /// For patches whose bins are not all there, a bit for each bin that is; for the others nothing.
    there: Vec<u32>,
}

#[derive(Clone, Debug)]
enum Kind {
    Rectangle {
        size: [f64; 2],
        cells: [u32; 2],
    },
    Rotation {
        outline: Meridian,
        /// Where rows of bins begin along the outline, and where the last one ends: four for each row of patches.
        edges: Vec<f64>,
        /// For each row of patches: the first one, and how many there are around the axis.
        rows: Vec<[u32; 2]>,
    },
    Triangles {
        /// Of a polygon; a mesh names the triangle itself.
        polygon: Vec<[[f64; 2]; 3]>,
        /// For each triangle: its first bin, the number of patches along its sides, and that of bins along the sides of each;
        /// a triangle that is a part of a patch has no patches along its sides.
        pieces: Vec<[u32; 3]>,
        corners: Vec<[Vec3; 3]>,
    },
}

/// What is turned about the axis, with its parameter s.
#[derive(Clone, Debug)]
enum Meridian {
    /// s = r².
    Plane,
    Curved(Outlined),
}

impl Meridian {
    fn density(&self, s: f64) -> f64 {
        match self {
            Self::Plane => PI,
            Self::Curved(outlined) => outlined.density(s),
        }
    }

    /// r and z at s.
    fn point(&self, s: f64) -> [f64; 2] {
        match self {
            Self::Plane => [s.max(0.0).sqrt(), 0.0],
            Self::Curved(outlined) => {
                let p = outlined.point(s, 0.0);
                [p.x, p.z]
            }
        }
    }

    /// The parameter of a point.
    fn parameter(&self, p: Vec3) -> f64 {
        match self {
            Self::Plane | Self::Curved(Outlined::Asphere(_)) => p.x * p.x + p.y * p.y,
            Self::Curved(Outlined::Quadric(_)) => p.z,
            Self::Curved(Outlined::Torus(torus)) => {
                let angle = p.z.atan2(p.x.hypot(p.y) - torus.major);
                if angle < 0.0 { angle + 2.0 * PI } else { angle }
            }
        }
    }
}

/// Which of `n` equal parts of 0..1 a number lies in.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn part(x: f64, n: u32) -> u32 {
    ((x * f64::from(n)) as u32).min(n - 1)
}

/// How many pieces of about `size` a length has.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn pieces(length: f64, size: f64) -> u32 {
    (length / size).round().clamp(1.0, MOST) as u32
}

/// The number of a small triangle among the m² that a triangle falls into, row by row, and the coordinates in it.
fn small_triangle([u, v]: [f64; 2], m: u32) -> (u32, [f64; 2]) {
    let scale = f64::from(m);
    let (i, j) = (part(u, m), part(v, m));
    let (x, y) = (u * scale - f64::from(i), v * scale - f64::from(j));
    // The row of i has 2 (m − i) − 1 of them; rounding may leave a point beyond the long side.
    let j = j.min(m - 1 - i);
    let upper = x + y > 1.0 && i + j + 1 < m;
    let inner = if upper { [1.0 - x, 1.0 - y] } else { [x, y] };
    (i * (2 * m - i) + 2 * j + u32::from(upper), inner)
}

impl Chart {
    /// Patches of about `area` \[mm²\]; None for surfaces without finite area.
    #[must_use]
    pub fn new(shape: &Shape, area: f64) -> Option<Self> {
        let size = area.sqrt();
        let chart = match shape {
            Shape::Flat(Flat { outline }) => match outline {
                Outline::Whole => return None,
                Outline::Rectangle { width, height } => {
                    let cells = [pieces(*width, size), pieces(*height, size)];
                    let number = cells[0] * cells[1];
                    Self {
                        kind: Kind::Rectangle {
                            size: [*width, *height],
                            cells,
                        },
                        areas: vec![width * height / f64::from(number); number as usize],
                        there: vec![],
                    }
                }
                Outline::Annulus { inner, outer } => {
                    rotation(Meridian::Plane, &[[inner * inner, outer * outer]], size)?
                }
                Outline::Polygon { vertices } => {
                    let polygon = triangulate(vertices);
                    let lifted = |p: [f64; 2]| Vec3::new(p[0], p[1], 0.0);
                    let corners = polygon.iter().map(|t| t.map(lifted)).collect();
                    triangles(polygon, corners, area)
                }
            },
            Shape::Quadric(q) => curved(Outlined::Quadric(*q), size)?,
            Shape::Asphere(a) => curved(Outlined::Asphere(a.clone()), size)?,
            Shape::Torus(t) => curved(Outlined::Torus(*t), size)?,
            Shape::Mesh(mesh) => triangles(vec![], corners(mesh), area),
        };
        let total: f64 = chart.areas.iter().sum();
        (total > 0.0 && total.is_finite()).then_some(chart)
    }

    /// The area of each patch \[mm²\].
    #[must_use]
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// A bit for each bin of a patch that points can lie in.
    #[must_use]
    pub fn bins(&self, patch: usize) -> u32 {
        self.there.get(patch).copied().unwrap_or((1 << BINS) - 1)
    }

    /// The bin of a point of the surface, in the coordinates of the shape, on a part of it (a triangle of a mesh).
    #[must_use]
    pub fn bin(&self, p: Vec3, triangle: u32) -> u32 {
        match &self.kind {
            Kind::Rectangle { size, cells } => {
                let [i, j] = [0, 1].map(|k| part([p.x, p.y][k] / size[k] + 0.5, 4 * cells[k]));
                in_patch(i / 4 * cells[1] + j / 4, i % 4, j % 4)
            }
            Kind::Rotation { outline, edges, rows } => {
                let s = outline.parameter(p);
                let last = edges.len() - 2;
                let row = edges.partition_point(|e| *e <= s).saturating_sub(1).min(last);
                let [first, around] = rows[row / 4];
                // From the negative first axis on.
                let column = part(turns_of(-p.x, -p.y), 4 * around);
                #[allow(clippy::cast_possible_truncation, reason = "below four")]
                in_patch(first + column / 4, (row % 4) as u32, column % 4)
            }
            Kind::Triangles {
                polygon,
                pieces,
                corners,
            } => {
                let number = if polygon.is_empty() {
                    triangle as usize
                } else {
                    nearest(polygon, [p.x, p.y])
                };
                let [first, m, fine] = pieces[number];
                let (coarse, inner) = small_triangle(coordinates(&corners[number], p), m.max(1));
                first + coarse * BINS + small_triangle(inner, fine).0
            }
        }
    }
}

const fn in_patch(patch: u32, row: u32, column: u32) -> u32 {
    patch * BINS + row * 4 + column
}

fn curved(outlined: Outlined, size: f64) -> Option<Chart> {
    let ranges = outlined.ranges()?;
    rotation(Meridian::Curved(outlined), &ranges, size)
}

/// Rows of about equal length along the outline, each cut into equal patches around the axis.
fn rotation(outline: Meridian, ranges: &[[f64; 2]], size: f64) -> Option<Chart> {
    let (mut edges, mut rows, mut areas) = (Vec::new(), Vec::new(), Vec::new());
    for [from, to] in ranges {
        let at = |i: usize| from + (to - from) * (i as f64 / STEPS as f64);
        let points: Vec<[f64; 2]> = (0..=STEPS).map(|i| outline.point(at(i))).collect();
        let mut lengths = vec![0.0];
        for pair in points.windows(2) {
            let step = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            lengths.push(lengths[lengths.len() - 1] + step);
        }
        let whole = lengths[STEPS];
        if !(whole > 0.0 && whole.is_finite()) {
            return None;
        }
        let count = pieces(whole, size);
        // The parameter at a share of the length, between the points that it was measured at.
        let share = |share: f64| {
            let wanted = share * whole;
            let i = lengths.partition_point(|l| *l <= wanted).clamp(1, STEPS);
            let step = lengths[i] - lengths[i - 1];
            let within = if step > 0.0 {
                (wanted - lengths[i - 1]) / step
            } else {
                0.0
            };
            at(i - 1) + (at(i) - at(i - 1)) * within.clamp(0.0, 1.0)
        };
        for row in 0..count {
            let quarters: [f64; 5] =
                std::array::from_fn(|k| share((f64::from(row) + k as f64 / 4.0) / f64::from(count)));
            let around = pieces(2.0 * PI * outline.point(quarters[2])[0], whole / f64::from(count));
            let area: f64 = quarters
                .windows(2)
                .map(|pair| integral(|s| outline.density(s), pair[0], pair[1]))
                .sum();
            #[allow(clippy::cast_possible_truncation, reason = "4096² at most")]
            rows.push([areas.len() as u32, around]);
            areas.extend(std::iter::repeat_n(area / f64::from(around), around as usize));
            edges.extend(&quarters[..4]);
        }
    }
    edges.push(ranges.last()?[1]);
    Some(Chart {
        kind: Kind::Rotation { outline, edges, rows },
        areas,
        there: vec![],
    })
}

fn corners(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    #[allow(clippy::cast_possible_truncation, reason = "a mesh has fewer than 2^32 triangles")]
    (0..mesh.len() as u32).map(|i| mesh.triangle(i)).collect()
}

fn area_vector([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (*b - *a).cross(*c - *a) * 0.5
}

/// Large triangles are cut into m² patches; small ones with about the same normal that are neighbours become one.
#[allow(clippy::cast_possible_truncation, reason = "fewer than 2^32 bins")]
fn triangles(polygon: Vec<[[f64; 2]; 3]>, corners: Vec<[Vec3; 3]>, area: f64) -> Chart {
    let (mut pieces, mut areas) = (vec![[0, 0, 1]; corners.len()], Vec::new());
    let mut small = Vec::new();
    for (number, triangle) in corners.iter().enumerate() {
        let own = area_vector(triangle).length();
        if own >= area {
            let m = self::pieces(own.sqrt(), area.sqrt());
            pieces[number] = [areas.len() as u32 * BINS, m, 4];
            areas.extend(std::iter::repeat_n(own / f64::from(m * m), (m * m) as usize));
        } else {
            small.push(number);
        }
    }
    let mut there = vec![(1 << BINS) - 1; areas.len()];
    small.sort_by_key(|number| neighbourhood(&corners[*number], area.sqrt()));
    // Groups end where the neighbourhood does, or when they are large enough.
    let mut rest = &small[..];
    while let Some(first) = rest.first() {
        let home = neighbourhood(&corners[*first], area.sqrt());
        let mut sum = 0.0;
        let count = rest
            .iter()
            .take_while(|number| {
                let triangle = &corners[**number];
                let fits = sum < area && neighbourhood(triangle, area.sqrt()) == home;
                sum += if fits { area_vector(triangle).length() } else { 0.0 };
                fits
            })
            .count();
        let (group, others) = rest.split_at(count);
        let (mut below, mut bits) = (0.0, 0);
        for number in group {
            let own = area_vector(&corners[*number]).length();
            let share = |part: f64| if sum > 0.0 { part / sum } else { 0.0 };
            // As many bins as its share of the area has, but one at least.
            let fine = (1..=3)
                .rfind(|k| f64::from(k * k) <= f64::from(BINS) * share(own))
                .unwrap_or(1);
            let first = part(share(below), BINS).min(BINS - fine * fine);
            pieces[*number] = [areas.len() as u32 * BINS + first, 0, fine];
            bits |= ((1 << (fine * fine)) - 1) << first;
            below += own;
        }
        areas.push(sum);
        there.push(bits);
        rest = others;
    }
    Chart {
        kind: Kind::Triangles {
            polygon,
            pieces,
            corners,
        },
        areas,
        there,
    }
}

/// The cube, of twice this size, that the middle of a triangle lies in, and the axis that its normal is nearest to.
#[allow(clippy::cast_possible_truncation, reason = "saturates; only equality counts")]
fn neighbourhood(triangle: &[Vec3; 3], size: f64) -> [i64; 4] {
    let middle = (triangle[0] + triangle[1] + triangle[2]) * (1.0 / 3.0);
    let n = area_vector(triangle);
    let (x, y, z) = (n.x.abs(), n.y.abs(), n.z.abs());
    let axis = if x >= y && x >= z {
        1.0_f64.copysign(n.x)
    } else if y >= z {
        2.0_f64.copysign(n.y)
    } else {
        3.0_f64.copysign(n.z)
    };
    let at = |x: f64| (0.5 * x / size).floor() as i64;
    [at(middle.z), at(middle.y), at(middle.x), axis as i64]
}

/// Shares of the second and third corner in a point of a triangle's plane.
fn coordinates(triangle: &[Vec3; 3], p: Vec3) -> [f64; 2] {
    let [a, b, c] = *triangle;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (bb, bc, cc) = (ab.dot(ab), ab.dot(ac), ac.dot(ac));
    let (pb, pc) = (ap.dot(ab), ap.dot(ac));
    let determinant = bb * cc - bc * bc;
    if determinant == 0.0 {
        return [0.0, 0.0];
    }
    let u = ((cc * pb - bc * pc) / determinant).clamp(0.0, 1.0);
    let v = ((bb * pc - bc * pb) / determinant).clamp(0.0, 1.0);
    [u, v]
}

/// The triangle of a polygon that a point lies in, or that it is least outside of.
fn nearest(triangles: &[[[f64; 2]; 3]], p: [f64; 2]) -> usize {
    let depth = |[a, b, c]: &[[f64; 2]; 3]| {
        let whole = twice_area([*a, *b, *c]);
        [[*a, *b, p], [*b, *c, p], [*c, *a, p]]
            .map(|t| twice_area(t) / whole)
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    };
    let best = triangles
        .iter()
        .enumerate()
        .max_by(|(_, a), (_, b)| depth(a).total_cmp(&depth(b)));
    best.map_or(0, |(number, _)| number)
}

#[cfg(test)]
mod tests;
