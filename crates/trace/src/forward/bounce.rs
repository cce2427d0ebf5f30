//! Many rays at once off one sheet that mirrors and scatters alike in all directions and colours: walls and reflectors.
//!
//! What `meeting` and `forward` come to for such a sheet, without branches and several rays at a time.

use etendue_geometry::Face;
use etendue_geometry::assembly::{Hits, Leaving, Lines};
use etendue_geometry::shape::{Outline, Shape};
use etendue_math::Vec3;
use etendue_optics::fresnel::reflect;
use etendue_optics::source::surface::about;
use multiversion::multiversion;

use crate::scene::{Act, Scene};

/// How a sheet that many rays are bounced off at once shares out light: mirrored, and mirrored or scattered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bouncer {
    face: u32,
    mirrored: f64,
    kept: f64,
}

/// The faces of a scene that rays are bounced off many at a time; None for the others.
#[must_use]
pub fn bouncers(scene: &Scene) -> Vec<Option<Bouncer>> {
    let faces = scene.assembly.faces().iter().zip(&scene.roles).zip(0..);
    faces
        .map(|((face, role), index)| {
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
                kept: mirrored + scattered,
            })
        })
        .collect()
}

impl Bouncer {
    /// Whether the light that this number stands for is absorbed.
    #[inline(always)]
    #[must_use]
    pub fn absorbs(self, number: f64) -> bool {
        number >= self.kept
    }
}

/// Rays of a block that meet one face, gathered. Structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    o: [Vec<f64>; 3],
    d: [Vec<f64>; 3],
    t: Vec<f64>,
    numbers: [Vec<f64>; 3],
    /// Normal and a point of the triangle that each ray meets, for meshes.
    normal: [Vec<f64>; 3],
    corner: [Vec<f64>; 3],
}

/// Bounces the rays `which` of a block off a face: sets their new start points and directions in `lines`.
pub fn bounce(
    face: &Face,
    bouncer: Bouncer,
    which: &[u32],
    hits: &Hits,
    numbers: &[Vec<f64>; 4],
    lines: &mut Lines,
    room: &mut Gathered,
) {
    let n = which.len();
    let Gathered {
        o,
        d,
        t,
        numbers: u,
        normal,
        corner,
    } = room;
    for list in o.iter_mut().chain(d.iter_mut()).chain([&mut *t]).chain(u.iter_mut()) {
        list.resize(n, 0.0);
    }
    for (k, &i) in which.iter().enumerate() {
        let i = i as usize;
        for axis in 0..3 {
            o[axis][k] = lines.origin[axis][i];
            d[axis][k] = lines.direction[axis][i];
            u[axis][k] = numbers[axis][i];
        }
        t[k] = hits.t[i];
    }
    if let Shape::Mesh(mesh) = &face.shape {
        for list in normal.iter_mut().chain(corner.iter_mut()) {
            list.resize(n, 0.0);
        }
        for (k, &i) in which.iter().enumerate() {
            let part = hits.part[i as usize].0;
            let (a, p) = (mesh.normal(part), mesh.triangle(part)[0]);
            (normal[0][k], normal[1][k], normal[2][k]) = (a.x, a.y, a.z);
            (corner[0][k], corner[1][k], corner[2][k]) = (p.x, p.y, p.z);
        }
    }
    off(face, bouncer, room);
    let mut leaving = Leaving::default();
    leaving.face[0] = bouncer.face;
    for (k, &i) in which.iter().enumerate() {
        let at = |list: &[Vec<f64>; 3]| Vec3::new(list[0][k], list[1][k], list[2][k]);
        leaving.part[0] = hits.part[i as usize].0;
        lines.set(i as usize, at(&room.o), at(&room.d), leaving);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn off(face: &Face, bouncer: Bouncer, room: &mut Gathered) {
    let frame = face.frame;
    match &face.shape {
        Shape::Quadric(quadric) => sweep(bouncer, room, |_, o, d, t| {
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
            sweep(bouncer, room, |k, o, d, t| {
                let normal = frame.direction_to_world(Vec3::new(nx[k], ny[k], nz[k]));
                let corner = frame.point_to_world(Vec3::new(cx[k], cy[k], cz[k]));
                let p = o + d * t;
                (p - normal * (p - corner).dot(normal), normal)
            });
            (room.normal, room.corner) = (normals, corners);
        }
        _ => sweep(bouncer, room, |_, o, d, t| {
            let p = o + d * t;
            (p - frame.z * (p - frame.origin).dot(frame.z), frame.z)
        }),
    }
}

#[inline(always)]
fn sweep(bouncer: Bouncer, room: &mut Gathered, foot: impl Fn(usize, Vec3, Vec3, f64) -> (Vec3, Vec3)) {
    let n = room.t.len();
    let [ox, oy, oz] = room.o.each_mut().map(|v| &mut v[..n]);
    let [dx, dy, dz] = room.d.each_mut().map(|v| &mut v[..n]);
    let [lobe, height, turn] = room.numbers.each_ref().map(|v| &v[..n]);
    let t = &room.t[..n];
    for k in 0..n {
        let o = Vec3::new(ox[k], oy[k], oz[k]);
        let d = Vec3::new(dx[k], dy[k], dz[k]);
        let (p, normal) = foot(k, o, d, t[k]);
        let height_in = d.dot(normal);
        let sign = if height_in < 0.0 { 1.0 } else { -1.0 };
        let side = normal * sign;
        let mirrored = reflect(d, side, -height_in * sign);
        let scattered = about(side, (1.0 - height[k]).sqrt(), turn[k]);
        let mirror = lobe[k] < bouncer.mirrored;
        (ox[k], oy[k], oz[k]) = (p.x, p.y, p.z);
        dx[k] = if mirror { mirrored.x } else { scattered.x };
        dy[k] = if mirror { mirrored.y } else { scattered.y };
        dz[k] = if mirror { mirrored.z } else { scattered.z };
    }
}
