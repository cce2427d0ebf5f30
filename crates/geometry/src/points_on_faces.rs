//! The points at which rays meet faces, each a face of its own, and the normals there.

use std::ops::Range;

use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::face::{Face, SurfacePoint};
use crate::hits::Hits;
use crate::ray_block::RayBlock;
use crate::shape::{Quadric, Shape};
use crate::surface_points::{Settled, Vectors};

/// Rays that are worked on together: their faces stay in the cache of first level.
const CHUNK: usize = 128;

type Numbers = [f64; CHUNK];

/// Points on faces, for each ray what [`Face::surface_point`] says. Structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct PointsOnFaces {
    points: Vectors,
    normals: Vectors,
    chunk: Box<Chunk>,
}

/// Rays of a chunk and the quadrics that they meet.
#[derive(Clone, Debug)]
struct Chunk {
    origin: [Numbers; 3],
    direction: [Numbers; 3],
    t: Numbers,
    /// Coefficients of the quadrics: r2, z2, z1, z0.
    quadric: [Numbers; 4],
    /// Where the faces stand, and how they are turned: three numbers for each axis of theirs.
    place: [Numbers; 3],
    axes: [Numbers; 9],
    /// −1 for faces whose normal is reversed.
    sign: Numbers,
}

impl Default for Chunk {
    fn default() -> Self {
        let none = [0.0; CHUNK];
        Self {
            origin: [none; 3],
            direction: [none; 3],
            t: none,
            quadric: [none; 4],
            place: [none; 3],
            axes: [none; 9],
            sign: none,
        }
    }
}

impl PointsOnFaces {
    /// Finds those of some rays of a block: on quadrics several at a time, on other faces one by one.
    pub fn find(&mut self, faces: &[Face], lines: &RayBlock, hits: &Hits, which: &[u32]) {
        for list in self.points.iter_mut().chain(&mut self.normals) {
            list.resize(which.len(), 0.0);
        }
        for (chunk, which) in which.chunks(CHUNK).enumerate() {
            let places = chunk * CHUNK..chunk * CHUNK + which.len();
            self.find_some(faces, lines, hits, which, places);
        }
    }

    fn find_some(&mut self, faces: &[Face], lines: &RayBlock, hits: &Hits, which: &[u32], places: Range<usize>) {
        let (mut turned, mut others) = (false, false);
        let some = &mut *self.chunk;
        for (k, i) in which.iter().enumerate() {
            let i = *i as usize;
            let face = &faces[hits.face[i] as usize];
            let Shape::Quadric(quadric) = &face.shape else {
                others = true;
                continue;
            };
            turned |= !face.frame.is_straight();
            some.put(k, face, quadric);
            for axis in 0..3 {
                some.origin[axis][k] = lines.origin[axis][i];
                some.direction[axis][k] = lines.direction[axis][i];
            }
            some.t[k] = hits.t[i];
        }
        let [points, normals] =
            [&mut self.points, &mut self.normals].map(|lists| lists.each_mut().map(|list| &mut list[places.clone()]));
        if turned {
            settle::<true>(some, points, normals);
        } else {
            settle::<false>(some, points, normals);
        }
        for (k, i) in places.zip(which).filter(|_| others) {
            let i = *i as usize;
            let face = &faces[hits.face[i] as usize];
            if !matches!(face.shape, Shape::Quadric(_)) {
                let foot = face.surface_point(lines.origin(i), lines.direction(i), &hits.crossing(i));
                let lists = [&mut self.points, &mut self.normals];
                for (list, vector) in lists.into_iter().zip([foot.point, foot.normal]) {
                    (list[0][k], list[1][k], list[2][k]) = (vector.x, vector.y, vector.z);
                }
            }
        }
    }

    /// That of the ray that was told at place `k`.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, k: usize) -> SurfacePoint {
        let at = |lists: &Vectors| Vec3::new(lists[0][k], lists[1][k], lists[2][k]);
        SurfacePoint {
            point: at(&self.points),
            normal: at(&self.normals),
        }
    }
}

impl Chunk {
    /// A face in its place.
    #[inline(always)]
    fn put(&mut self, k: usize, face: &Face, quadric: &Quadric) {
        let Frame { origin, x, y, z } = face.frame;
        let numbers = [quadric.r2, quadric.z2, quadric.z1, quadric.z0];
        self.quadric.iter_mut().zip(numbers).for_each(|(list, v)| list[k] = v);
        let numbers = [origin.x, origin.y, origin.z];
        self.place.iter_mut().zip(numbers).for_each(|(list, v)| list[k] = v);
        let numbers = [x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z];
        self.axes.iter_mut().zip(numbers).for_each(|(list, v)| list[k] = v);
        self.sign[k] = if face.flipped { -1.0 } else { 1.0 };
    }
}

/// What [`Face::surface_point`] comes to, without branches; `TURNED`: whether any of the faces is.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn settle<const TURNED: bool>(some: &Chunk, points: [&mut [f64]; 3], normals: [&mut [f64]; 3]) {
    let [px, py, pz] = points;
    let n = px.len().min(CHUNK);
    let ([px, py, pz], [nx, ny, nz]) = ([px, py, pz].map(|v| &mut v[..n]), normals.map(|v| &mut v[..n]));
    let vector = |lists: &[Numbers; 3], k: usize| Vec3::new(lists[0][k], lists[1][k], lists[2][k]);
    for k in 0..n {
        let [x, y, z] =
            [0, 3, 6].map(|axis| Vec3::new(some.axes[axis][k], some.axes[axis + 1][k], some.axes[axis + 2][k]));
        let frame = Frame {
            origin: vector(&some.place, k),
            x,
            y,
            z,
        };
        let quadric = Quadric {
            r2: some.quadric[0][k],
            z2: some.quadric[1][k],
            z1: some.quadric[2][k],
            z0: some.quadric[3][k],
            z: [0.0; 2],
            r: [0.0; 2],
        };
        let (o, d) = (vector(&some.origin, k), vector(&some.direction, k));
        let (p, normal) = if TURNED {
            quadric.surface_point(&frame, o, d, some.t[k])
        } else {
            // The same along the axes of the world.
            let (p, normal) = quadric.settle((o - frame.origin) + d * some.t[k]);
            (frame.origin + p, normal)
        };
        (px[k], py[k], pz[k]) = (p.x, p.y, p.z);
        let sign = some.sign[k];
        (nx[k], ny[k], nz[k]) = (sign * normal.x, sign * normal.y, sign * normal.z);
    }
}

#[cfg(test)]
mod tests {
    use etendue_sampling::philox::Stream;

    use super::*;
    use crate::face_set::FaceSet;
    use crate::face_set::tests::{faces, point};
    use crate::origin_faces::{NONE, OriginFaces};

    #[test]
    fn each_is_that_of_its_ray_alone() {
        for straight in [false, true] {
            let mut faces = faces(60, 3.0, 0.4);
            for (number, face) in faces.iter_mut().enumerate() {
                face.flipped = number % 4 == 1;
                if straight {
                    let [x, y, z] =
                        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|[x, y, z]| Vec3::new(x, y, z));
                    face.frame = Frame { x, y, z, ..face.frame };
                }
            }
            let stream = Stream::new(4, 9);
            let mut lines = RayBlock::default();
            for i in 0..2000 {
                let (from, to) = (point(stream, i, 0) * 5.0, point(stream, i, 1) * 3.0);
                lines.push(from, (to - from).normalized(), OriginFaces::default());
            }
            let set = FaceSet::new(faces);
            let mut hits = Hits::default();
            set.nearest(&lines, &mut hits);
            let which: Vec<u32> = (0..2000).filter(|i| hits.face[*i as usize] != NONE).collect();
            let mut found = PointsOnFaces::default();
            // Fewer and more than before, none at all.
            for which in [&which[..], &which[..5], &[], &which[300..]] {
                found.find(set.faces(), &lines, &hits, which);
                for (k, i) in which.iter().enumerate() {
                    let i = *i as usize;
                    let face = &set.faces()[hits.face[i] as usize];
                    let alone = face.surface_point(lines.origin(i), lines.direction(i), &hits.crossing(i));
                    assert_eq!(found.get(k), alone);
                }
            }
            let quadrics = |i: &&u32| matches!(set.faces()[hits.face[**i as usize] as usize].shape, Shape::Quadric(_));
            let count = which.iter().filter(quadrics).count();
            assert!(count > 500 && which.len() - count > 50, "{count} of {}", which.len());
        }
    }
}
