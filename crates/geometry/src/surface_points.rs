//! The points at which many rays meet one face, and the normals there, several at a time.

use etendue_math::heads::{heads, heads_mut};
use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::face::Face;
use crate::shape::{Crossing, Quadric, Shape};

/// A vector for each of many rays, one array per axis.
pub type Vectors = [Vec<f64>; 3];

/// Puts values into a list in place of what it held.
pub fn fill<T>(list: &mut Vec<T>, values: impl Iterator<Item = T>) {
    list.clear();
    list.extend(values);
}

/// Puts some numbers of many into a list in place of what it held: at once, if they lie one behind the other.
pub fn choose(into: &mut Vec<f64>, from: &[f64], which: &[u32]) {
    if let (Some(first), true) = (
        which.first(),
        which.windows(2).all(|pair| pair[1] == pair[0].wrapping_add(1)),
    ) {
        let first = *first as usize;
        into.clear();
        into.extend_from_slice(&from[first..first + which.len()]);
    } else {
        fill(into, which.iter().map(|i| from[*i as usize]));
    }
}

/// Puts some vectors of many into lists in place of what those held.
pub fn gather(into: &mut Vectors, from: &Vectors, which: &[u32]) {
    for (list, values) in into.iter_mut().zip(from) {
        choose(list, values, which);
    }
}

/// The points at which lines meet a face, settled on it, and the normals there: for each line what [`Face::surface_point`] says.
/// `points` holds the start points on entry \[mm\], `t` the distances \[mm\], `parts` the triangles of a mesh that are met;
/// the lists are of one length.
pub fn surface_points(
    face: &Face,
    points: &mut Vectors,
    directions: &Vectors,
    t: &[f64],
    parts: &[u32],
    normals: &mut Vectors,
) {
    for list in normals.iter_mut() {
        list.resize(t.len(), 0.0);
    }
    match &face.shape {
        Shape::Flat(_) => surface_points_on(face, &Plane, points, directions, t, normals),
        Shape::Quadric(quadric) => surface_points_on(face, quadric, points, directions, t, normals),
        Shape::Mesh(mesh) => {
            let mut heights = vec![0.0; t.len()];
            for (i, part) in parts.iter().enumerate() {
                let (n, height) = mesh.plane(*part);
                (normals[0][i], normals[1][i], normals[2][i]) = (n.x, n.y, n.z);
                heights[i] = height;
            }
            surface_points_in_planes(face, points, directions, t, normals, &heights);
        }
        Shape::Asphere(_) | Shape::Torus(_) => {
            for (i, t) in t.iter().enumerate() {
                let [o, d] = [&*points, directions].map(|v| Vec3::new(v[0][i], v[1][i], v[2][i]));
                let crossing = Crossing {
                    t: *t,
                    ..Crossing::default()
                };
                let foot = face.surface_point(o, d, &crossing);
                (points[0][i], points[1][i], points[2][i]) = (foot.point.x, foot.point.y, foot.point.z);
                (normals[0][i], normals[1][i], normals[2][i]) = (foot.normal.x, foot.normal.y, foot.normal.z);
            }
        }
    }
}

/// Each line meets a plane of its own, n·p = `heights`, given with its normal in the coordinates of the face.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn surface_points_in_planes(
    face: &Face,
    points: &mut Vectors,
    directions: &Vectors,
    t: &[f64],
    normals: &mut Vectors,
    heights: &[f64],
) {
    let n = t.len();
    let [px, py, pz] = heads_mut(points, n);
    let [dx, dy, dz] = heads(directions, n);
    let [nx, ny, nz] = heads_mut(normals, n);
    let (heights, frame) = (&heights[..n], &face.frame);
    let sign = if face.flipped { -1.0 } else { 1.0 };
    for i in 0..n {
        let (o, d) = (Vec3::new(px[i], py[i], pz[i]), Vec3::new(dx[i], dy[i], dz[i]));
        let normal = Vec3::new(nx[i], ny[i], nz[i]);
        let p = frame.point_to_local(o) + frame.direction_to_local(d) * t[i];
        let p = frame.point_to_world(p - normal * (p.dot(normal) - heights[i]));
        let normal = frame.direction_to_world(normal);
        (px[i], py[i], pz[i]) = (p.x, p.y, p.z);
        (nx[i], ny[i], nz[i]) = (sign * normal.x, sign * normal.y, sign * normal.z);
    }
}

/// A surface whose points are settled by its equation.
pub(crate) trait Settled {
    /// The point of the surface next to o + t d, and the normal there; everything in the world.
    fn surface_point(&self, frame: &Frame, o: Vec3, d: Vec3, t: f64) -> (Vec3, Vec3);
}

/// The plane z = 0 of a frame.
struct Plane;

impl Settled for Plane {
    #[inline(always)]
    fn surface_point(&self, frame: &Frame, o: Vec3, d: Vec3, t: f64) -> (Vec3, Vec3) {
        let p = o + d * t;
        (p - frame.z * (p - frame.origin).dot(frame.z), frame.z)
    }
}

impl Settled for Quadric {
    #[inline(always)]
    fn surface_point(&self, frame: &Frame, o: Vec3, d: Vec3, t: f64) -> (Vec3, Vec3) {
        let (p, n) = self.settle(frame.point_to_local(o) + frame.direction_to_local(d) * t);
        (frame.point_to_world(p), frame.direction_to_world(n))
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn surface_points_on<S: Settled>(
    face: &Face,
    shape: &S,
    points: &mut Vectors,
    directions: &Vectors,
    t: &[f64],
    normals: &mut Vectors,
) {
    let n = t.len();
    let [px, py, pz] = heads_mut(points, n);
    let [dx, dy, dz] = heads(directions, n);
    let [nx, ny, nz] = heads_mut(normals, n);
    let sign = if face.flipped { -1.0 } else { 1.0 };
    for i in 0..n {
        let (o, d) = (Vec3::new(px[i], py[i], pz[i]), Vec3::new(dx[i], dy[i], dz[i]));
        let (p, normal) = shape.surface_point(&face.frame, o, d, t[i]);
        (px[i], py[i], pz[i]) = (p.x, p.y, p.z);
        (nx[i], ny[i], nz[i]) = (sign * normal.x, sign * normal.y, sign * normal.z);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_chosen_in_the_order_in_which_they_are_asked_for() {
        let from: Vec<f64> = (0..9).map(|k| f64::from(k) + 0.5).collect();
        for which in [
            &[][..],
            &[4],
            &[2, 3, 4, 5],
            &[5, 4, 3],
            &[2, 4, 3, 5],
            &[1, 1, 2],
            &[0, 8],
        ] {
            let mut into = vec![7.0; 3];
            choose(&mut into, &from, which);
            let expected: Vec<f64> = which.iter().map(|k| f64::from(*k) + 0.5).collect();
            assert_eq!(into, expected);
        }
    }
}
