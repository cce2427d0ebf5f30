//! Many rays at once off one sheet that mirrors and scatters alike in all directions and colours: walls and reflectors.
//!
//! What `meeting` and `forward` come to for such a sheet, without branches and several rays at a time.

use etendue_geometry::Face;
use etendue_geometry::assembly::Hits;
use etendue_geometry::shape::{Outline, Shape};
use etendue_math::Vec3;
use etendue_optics::finish::part_of;
use etendue_optics::fresnel::reflect;
use etendue_optics::source::surface::about;
use multiversion::multiversion;

use crate::detector::Detector;
use crate::scene::{Act, Scene};

use super::flock::Flock;

/// How a sheet that many rays are bounced off at once shares out light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bouncer {
    /// Its number.
    pub face: u32,
    mirrored: f64,
    scattered: f64,
}

/// The faces of a scene that rays are bounced off many at a time.
#[must_use]
pub fn bouncers(scene: &Scene) -> Vec<Bouncer> {
    // Detectors of scattered light and absorbing surroundings want to know of every scatter by itself.
    let watched = scene.detectors.iter().any(Detector::watches_scatter);
    if watched || scene.media[0].absorption.range() != [0.0, 0.0] {
        return Vec::new();
    }
    let faces = scene.assembly.faces().iter().zip(&scene.roles).zip(0..);
    faces
        .filter_map(|((face, role), index)| {
            let simple = match &face.shape {
                Shape::Flat(flat) => !matches!(flat.outline, Outline::Polygon { .. }),
                Shape::Quadric(_) => true,
                Shape::Mesh(mesh) => !mesh.is_smooth() && face.trims.is_empty(),
                _ => false,
            };
            let Act::Optical(finish) = role.act else { return None };
            let [mirrored, through, scattered, behind] = scene.finishes[finish as usize].constant()?;
            let sheet = role.solid == 0 && simple && through == 0.0 && behind == 0.0;
            sheet.then_some(Bouncer {
                face: index,
                mirrored,
                scattered,
            })
        })
        .collect()
}

impl Bouncer {
    /// Whether the light that this number stands for is absorbed.
    #[inline(always)]
    #[must_use]
    pub fn absorbs(self, number: f64) -> bool {
        number >= self.mirrored + self.scattered
    }
}

/// Rays of a block that meet one face, gathered. Structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    who: Vec<u32>,
    part: Vec<u32>,
    o: [Vec<f64>; 3],
    d: [Vec<f64>; 3],
    t: Vec<f64>,
    /// Normal and a point of the triangle that each ray meets, for meshes.
    normal: [Vec<f64>; 3],
    corner: [Vec<f64>; 3],
}

impl Gathered {
    /// Gathers some rays of a flock.
    pub fn gather(&mut self, flock: &Flock, hits: &Hits, which: &[u32]) {
        let which = || which.iter().map(|i| *i as usize);
        fill(&mut self.who, which().map(|i| flock.who[i]));
        fill(&mut self.part, which().map(|i| hits.part[i].0));
        for axis in 0..3 {
            let (o, d) = (&flock.lines.origin[axis], &flock.lines.direction[axis]);
            fill(&mut self.o[axis], which().map(|i| o[i]));
            fill(&mut self.d[axis], which().map(|i| d[i]));
        }
        fill(&mut self.t, which().map(|i| hits.t[i]));
    }

    /// Turns the lines to the face into those from there.
    pub fn bounce(&mut self, face: &Face, bouncer: Bouncer, numbers: &[Vec<f64>; 2]) {
        if let Shape::Mesh(mesh) = &face.shape {
            let n = self.part.len();
            let (normal, corner) = (&mut self.normal, &mut self.corner);
            normal
                .iter_mut()
                .chain(corner.iter_mut())
                .for_each(|list| list.resize(n, 0.0));
            for (k, part) in self.part.iter().enumerate() {
                let (a, p) = (mesh.normal(*part), mesh.triangle(*part)[0]);
                (normal[0][k], normal[1][k], normal[2][k]) = (a.x, a.y, a.z);
                (corner[0][k], corner[1][k], corner[2][k]) = (p.x, p.y, p.z);
            }
        }
        off(face, bouncer, numbers, self);
    }

    /// Adds the rays to a flock.
    pub fn go_on(&self, face: u32, flock: &mut Flock) {
        let [o, d] = [&self.o, &self.d].map(|lists| lists.each_ref().map(|list| &list[..]));
        flock.extend(o, d, self.who.iter().copied(), face, self.part.iter().copied());
    }
}

/// Puts values into a list in place of what it held.
fn fill<T>(list: &mut Vec<T>, values: impl Iterator<Item = T>) {
    list.clear();
    list.extend(values);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn off(face: &Face, bouncer: Bouncer, numbers: &[Vec<f64>; 2], room: &mut Gathered) {
    let frame = face.frame;
    match &face.shape {
        Shape::Quadric(quadric) => sweep(bouncer, numbers, room, |_, o, d, t| {
            let p = frame.point_to_local(o) + frame.direction_to_local(d) * t;
            let (p, n) = quadric.settle(p);
            (frame.point_to_world(p), frame.direction_to_world(n))
        }),
        Shape::Mesh(_) => {
            // Each triangle is a plane of its own.
            let (normals, corners) = (std::mem::take(&mut room.normal), std::mem::take(&mut room.corner));
            let n = room.t.len();
            let [nx, ny, nz] = normals.each_ref().map(|v| &v[..n]);
            let [cx, cy, cz] = corners.each_ref().map(|v| &v[..n]);
            sweep(bouncer, numbers, room, |k, o, d, t| {
                let normal = frame.direction_to_world(Vec3::new(nx[k], ny[k], nz[k]));
                let corner = frame.point_to_world(Vec3::new(cx[k], cy[k], cz[k]));
                let p = o + d * t;
                (p - normal * (p - corner).dot(normal), normal)
            });
            (room.normal, room.corner) = (normals, corners);
        }
        _ => sweep(bouncer, numbers, room, |_, o, d, t| {
            let p = o + d * t;
            (p - frame.z * (p - frame.origin).dot(frame.z), frame.z)
        }),
    }
}

#[inline(always)]
fn sweep(
    bouncer: Bouncer,
    numbers: &[Vec<f64>; 2],
    room: &mut Gathered,
    foot: impl Fn(usize, Vec3, Vec3, f64) -> (Vec3, Vec3),
) {
    let n = room.t.len();
    let [ox, oy, oz] = room.o.each_mut().map(|v| &mut v[..n]);
    let [dx, dy, dz] = room.d.each_mut().map(|v| &mut v[..n]);
    let [lobe, turn] = numbers.each_ref().map(|v| &v[..n]);
    let t = &room.t[..n];
    for k in 0..n {
        let o = Vec3::new(ox[k], oy[k], oz[k]);
        let d = Vec3::new(dx[k], dy[k], dz[k]);
        let (p, normal) = foot(k, o, d, t[k]);
        let height_in = d.dot(normal);
        let sign = if height_in < 0.0 { 1.0 } else { -1.0 };
        let side = normal * sign;
        let height = part_of(lobe[k] - bouncer.mirrored, bouncer.scattered);
        let mirrored = reflect(d, side, -height_in * sign);
        let scattered = about(side, (1.0 - height).sqrt(), turn[k]);
        let mirror = lobe[k] < bouncer.mirrored;
        (ox[k], oy[k], oz[k]) = (p.x, p.y, p.z);
        dx[k] = if mirror { mirrored.x } else { scattered.x };
        dy[k] = if mirror { mirrored.y } else { scattered.y };
        dz[k] = if mirror { mirrored.z } else { scattered.z };
    }
}
