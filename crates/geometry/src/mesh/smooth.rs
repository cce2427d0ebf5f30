//! Normals at the corners of triangles that stand for curved surfaces.

use etendue_math::Vec3;
use etendue_math::trig::turns_of;
use etendue_sampling::ordered::inside;
use rayon::prelude::*;

/// Vertices with normals: one on a crease is several in one place.
#[derive(Clone, Debug, Default)]
pub struct Smooth {
    /// The vertex that each was.
    pub vertex: Vec<u32>,
    /// Their unit normals.
    pub normal: Vec<[f64; 3]>,
    /// The corners of the triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// Vertices that are worked on together.
const TOGETHER: usize = 4096;

/// A corner with what it is made of.
struct Corner {
    triangle: usize,
    normal: Vec3,
    weighted: Vec3,
}

/// The mean normal at each corner: of the triangles around its vertex, weighted by their angles there
/// `[ThuermerWuethrich1998]`, those whose normals have at least the cosine `least` to that of the corner's own triangle.
///
/// Time is that of the pairs of triangles around each vertex. The same bits for any number of threads.
///
/// # Panics
/// If there are 2³² corners or more, or a triangle names a vertex that there is not.
#[must_use]
pub fn smooth_normals(vertices: &[[f64; 3]], triangles: &[[u32; 3]], least: f64) -> Smooth {
    let corners = u32::try_from(3 * triangles.len()).expect("fewer than 2³² corners");
    let normals: Vec<Vec3> = triangles.iter().map(|corners| normal(vertices, *corners)).collect();
    // The corners at each vertex, in their order.
    let mut next = vec![0_u32; vertices.len() + 1];
    for vertex in triangles.iter().flatten() {
        next[*vertex as usize + 1] += 1;
    }
    for vertex in 0..vertices.len() {
        next[vertex + 1] += next[vertex];
    }
    let firsts = next.clone();
    let mut at_vertex = vec![0; 3 * triangles.len()];
    for (vertex, corner) in triangles.iter().flatten().zip(0..corners) {
        let place = &mut next[*vertex as usize];
        at_vertex[*place as usize] = corner;
        *place += 1;
    }
    let corner = |number: &u32| {
        let (triangle, k) = (*number as usize / 3, *number as usize % 3);
        let points = [0, 1, 2].map(|i| Vec3::from(vertices[triangles[triangle][(k + i) % 3] as usize]));
        let normal = normals[triangle];
        let without_area = normal == Vec3::default();
        Corner {
            triangle,
            normal,
            weighted: if without_area { normal } else { normal * angle(points) },
        }
    };
    let blocks: Vec<usize> = (0..vertices.len()).step_by(TOGETHER).collect();
    let of_block = |first: &usize| {
        let (mut found, mut of_corner, mut around) = (Smooth::default(), Vec::new(), Vec::new());
        for vertex in *first..(first + TOGETHER).min(vertices.len()) {
            let own = &at_vertex[firsts[vertex] as usize..firsts[vertex + 1] as usize];
            around.clear();
            around.extend(own.iter().map(corner));
            let start = found.normal.len();
            for mean in around.iter().map(|own| mean_within(own, &around, least)) {
                let known = found.normal[start..].iter().position(|other| *other == mean);
                let number = start + known.unwrap_or(found.normal.len() - start);
                if known.is_none() {
                    #[allow(clippy::cast_possible_truncation, reason = "no more than corners")]
                    found.vertex.push(vertex as u32);
                    found.normal.push(mean);
                }
                of_corner.push(number);
            }
        }
        (found, of_corner)
    };
    let parts: Vec<(Smooth, Vec<usize>)> = inside(0, || blocks.par_iter().map(of_block).collect());
    let mut smooth = Smooth {
        triangles: vec![[0; 3]; triangles.len()],
        ..Smooth::default()
    };
    let mut places = at_vertex.iter();
    for (found, of_corner) in parts {
        let before = smooth.vertex.len();
        for (number, place) in of_corner.iter().zip(places.by_ref()) {
            #[allow(clippy::cast_possible_truncation, reason = "no more than corners")]
            let number = (before + number) as u32;
            smooth.triangles[*place as usize / 3][*place as usize % 3] = number;
        }
        smooth.vertex.extend(found.vertex);
        smooth.normal.extend(found.normal);
    }
    smooth
}

/// The unit normal of a triangle; 0 of one without an area.
fn normal(vertices: &[[f64; 3]], corners: [u32; 3]) -> Vec3 {
    let [a, b, c] = corners.map(|v| Vec3::from(vertices[v as usize]));
    unit((b - a).cross(c - a))
}

/// A vector of length 1, scaled before the norm, so that none is too small or too large for its square; 0 stays 0.
fn unit(v: Vec3) -> Vec3 {
    let size = v.x.abs().max(v.y.abs()).max(v.z.abs());
    if size > 0.0 {
        let scaled = Vec3::new(v.x / size, v.y / size, v.z / size);
        scaled * (1.0 / scaled.length())
    } else {
        Vec3::default()
    }
}

/// The inner angle at the first of three points \[turns\].
fn angle([own, next, last]: [Vec3; 3]) -> f64 {
    let [ahead, back] = [next, last].map(|other| {
        let v = other - own;
        let size = v.x.abs().max(v.y.abs()).max(v.z.abs());
        Vec3::new(v.x / size, v.y / size, v.z / size)
    });
    turns_of(ahead.dot(back), ahead.cross(back).length())
}

/// The mean normal of those around a corner that are like its own.
fn mean_within(own: &Corner, around: &[Corner], least: f64) -> [f64; 3] {
    let sum = around
        .iter()
        // A triangle is like itself, whatever rounding says.
        .filter(|other| other.triangle == own.triangle || other.normal.dot(own.normal) >= least)
        .fold(Vec3::default(), |sum, other| sum + other.weighted);
    let mean = unit(sum);
    // Normals that cancel each other have no mean.
    let mean = if mean == Vec3::default() { own.normal } else { mean };
    [mean.x, mean.y, mean.z]
}
