//! Many rays at once off one sheet that mirrors and scatters alike in all directions and colours: walls and reflectors.
//!
//! What `meeting` and `forward` come to for such a sheet, without branches and several rays at a time.

use etendue_geometry::Face;
use etendue_geometry::assembly::Hits;
use etendue_geometry::sweep::{Vectors, feet, fill, gather};
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
            let Act::Optical(finish) = role.act else { return None };
            let [mirrored, through, scattered, behind] = scene.finishes[finish as usize].constant()?;
            let sheet = role.solid == 0 && through == 0.0 && behind == 0.0;
            (sheet && !face.shape.is_smooth()).then_some(Bouncer {
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
    o: Vectors,
    d: Vectors,
    t: Vec<f64>,
    normal: Vectors,
}

impl Gathered {
    /// Gathers some rays of a flock.
    pub fn gather(&mut self, flock: &Flock, hits: &Hits, which: &[u32]) {
        let indices = || which.iter().map(|i| *i as usize);
        fill(&mut self.who, indices().map(|i| flock.who[i]));
        fill(&mut self.part, indices().map(|i| hits.part[i].0));
        fill(&mut self.t, indices().map(|i| hits.t[i]));
        gather(&mut self.o, &flock.lines.origin, which);
        gather(&mut self.d, &flock.lines.direction, which);
    }

    /// Turns the lines to the face into those from there.
    pub fn bounce(&mut self, face: &Face, bouncer: Bouncer, numbers: &[Vec<f64>; 2]) {
        feet(face, &mut self.o, &self.d, &self.t, &self.part, &mut self.normal);
        turn(bouncer, numbers, &self.normal, &mut self.d);
    }

    /// Adds the rays to a flock.
    pub fn go_on(&self, face: u32, flock: &mut Flock) {
        let [o, d] = [&self.o, &self.d].map(|lists| lists.each_ref().map(|list| &list[..]));
        flock.extend(o, d, self.who.iter().copied(), face, self.part.iter().copied());
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn turn(bouncer: Bouncer, numbers: &[Vec<f64>; 2], normals: &Vectors, directions: &mut Vectors) {
    let n = directions[0].len();
    let [dx, dy, dz] = directions.each_mut().map(|v| &mut v[..n]);
    let [nx, ny, nz] = normals.each_ref().map(|v| &v[..n]);
    let [lobe, turn] = numbers.each_ref().map(|v| &v[..n]);
    for k in 0..n {
        let (d, normal) = (Vec3::new(dx[k], dy[k], dz[k]), Vec3::new(nx[k], ny[k], nz[k]));
        let height_in = d.dot(normal);
        let sign = if height_in < 0.0 { 1.0 } else { -1.0 };
        let side = normal * sign;
        let height = part_of(lobe[k] - bouncer.mirrored, bouncer.scattered);
        let mirrored = reflect(d, side, -height_in * sign);
        let scattered = about(side, (1.0 - height).sqrt(), turn[k]);
        let mirror = lobe[k] < bouncer.mirrored;
        dx[k] = if mirror { mirrored.x } else { scattered.x };
        dy[k] = if mirror { mirrored.y } else { scattered.y };
        dz[k] = if mirror { mirrored.z } else { scattered.z };
    }
}
