//! Many rays at once through smooth interfaces of solids, whichever these are: what is there for each of them, then which way
//! they go, several at a time.
//!
//! What [`scatter`](crate::scatter) comes to there, to the same bits.

use etendue_geometry::face::SurfacePoint;
use etendue_geometry::hits::Hits;
use etendue_geometry::surface_points::Vectors;
use etendue_math::Vec3;
use etendue_math::heads::{heads, heads_mut};
use etendue_optics::fresnel::{fresnel, reflect, refract};
use multiversion::multiversion;

use super::queue::RayQueue;
use crate::medium_cache::MediumCache;
use crate::scene::Scene;
use crate::solid_stack::SolidStack;

/// An interface where a ray meets it.
#[derive(Clone, Copy, Debug)]
pub struct Crossed {
    face: u32,
    /// The part of the face.
    part: u32,
    /// \[mm\].
    point: Vec3,
    /// Along which the ray came.
    d: Vec3,
    /// Against the ray.
    normal: Vec3,
    /// Refractive indices where the ray comes from and on the other side.
    n: [f64; 2],
    /// The solids on both sides.
    sides: [SolidStack; 2],
}

impl Crossed {
    /// Where ray `i` of a queue meets an interface of a solid by itself, at a point of it; None if the face is hidden there, or the
    /// ray goes on as if nothing were there, or cannot.
    #[inline(always)]
    pub fn new(
        scene: &Scene,
        queue: &RayQueue,
        hits: &Hits,
        i: usize,
        foot: SurfacePoint,
        wavelength: f64,
        media: &mut MediumCache,
    ) -> Option<Self> {
        let (face, before) = (hits.face[i], queue.stack[i]);
        let solid = scene.roles[face as usize].solid;
        let d = queue.lines.direction(i);
        let front = d.dot(foot.normal) < 0.0;
        if front == before.contains(solid) {
            return None;
        }
        let after = before.crossed(solid)?;
        let n = [before, after].map(|stack| media.at(scene, stack.top(), wavelength).n);
        // Where the face is hidden, the space on both sides belongs to one solid.
        let meets = n[0] > 0.0 && n[1] > 0.0 && n[0] != n[1];
        meets.then_some(Self {
            face,
            part: hits.part[i].0,
            point: foot.point,
            d,
            normal: if front { foot.normal } else { -foot.normal },
            n,
            sides: [before, after],
        })
    }
}

/// Rays that meet interfaces, and what becomes of them. Structure of arrays.
#[derive(Default)]
pub struct InterfaceRays {
    who: Vec<u32>,
    face: Vec<u32>,
    part: Vec<u32>,
    sides: Vec<[SolidStack; 2]>,
    points: Vectors,
    directions: Vectors,
    normals: Vectors,
    n: [Vec<f64>; 2],
    /// Random numbers that decide which way each goes.
    numbers: Vec<f64>,
    /// Whether it is mirrored.
    mirrored: Vec<bool>,
}

impl InterfaceRays {
    /// Room for so many rays.
    pub fn make_room(&mut self, n: usize) {
        for list in [&mut self.who, &mut self.face, &mut self.part] {
            list.resize(n, 0);
        }
        self.sides.resize(n, [SolidStack::default(); 2]);
        let vectors = self
            .points
            .iter_mut()
            .chain(&mut self.directions)
            .chain(&mut self.normals);
        for list in vectors.chain(&mut self.n).chain([&mut self.numbers]) {
            list.resize(n, 0.0);
        }
    }

    /// Puts a ray in its place, by the number of its state and a random number.
    #[inline(always)]
    pub fn put(&mut self, place: usize, who: u32, met: &Crossed, number: f64) {
        (self.who[place], self.face[place], self.part[place]) = (who, met.face, met.part);
        self.sides[place] = met.sides;
        let lists = [&mut self.points, &mut self.directions, &mut self.normals];
        for (list, vector) in lists.into_iter().zip([met.point, met.d, met.normal]) {
            (list[0][place], list[1][place], list[2][place]) = (vector.x, vector.y, vector.z);
        }
        (self.n[0][place], self.n[1][place]) = (met.n[0], met.n[1]);
        self.numbers[place] = number;
    }

    /// Turns the lines to the interfaces into those from there.
    pub fn pass(&mut self) {
        self.mirrored.resize(self.who.len(), false);
        turn(self);
    }

    /// The state of each ray, the face that it met, and whether it passed it.
    pub fn passed(&self) -> impl Iterator<Item = (u32, u32, bool)> {
        let rays = self.who.iter().zip(&self.face).zip(&self.mirrored);
        rays.map(|((who, face), mirrored)| (*who, *face, !mirrored))
    }

    /// Adds the rays to a queue.
    pub fn go_on(&self, queue: &mut RayQueue) {
        let [o, d] = [&self.points, &self.directions].map(|lists| lists.each_ref().map(|list| &list[..]));
        let stacks = self.sides.iter().zip(&self.mirrored);
        queue.extend_each(
            o,
            d,
            &self.who,
            (&self.face, &self.part),
            stacks.map(|(sides, mirrored)| sides[usize::from(!mirrored)]),
        );
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn turn(rays: &mut InterfaceRays) {
    let n = rays.who.len();
    let [dx, dy, dz] = heads_mut(&mut rays.directions, n);
    let [nx, ny, nz] = heads(&rays.normals, n);
    let [n1, n2] = heads(&rays.n, n);
    let (numbers, mirrors) = (&rays.numbers[..n], &mut rays.mirrored[..n]);
    for k in 0..n {
        let d = Vec3::new(dx[k], dy[k], dz[k]);
        let normal = Vec3::new(nx[k], ny[k], nz[k]);
        let height = normal.dot(-d);
        let cosine = if height < 1.0 { height } else { 1.0 };
        let ratio = n1[k] / n2[k];
        let f = fresnel(cosine, n1[k], n2[k]);
        let mirror = numbers[k] < f.reflectance;
        // On the sides where they belong: where light grazes, rounding may send it to the other one.
        let back = beside(reflect(d, normal, cosine), normal, 1.0);
        let through = beside(refract(d, normal, cosine, ratio, f.cosine), normal, -1.0);
        let straight = ratio == 1.0;
        dx[k] = pick(mirror, back.x, pick(straight, d.x, through.x));
        dy[k] = pick(mirror, back.y, pick(straight, d.y, through.y));
        dz[k] = pick(mirror, back.z, pick(straight, d.z, through.z));
        mirrors[k] = mirror;
    }
}

#[inline(always)]
fn pick(first: bool, a: f64, b: f64) -> f64 {
    if first { a } else { b }
}

/// A direction, or what it is mirrored to if it is on the wrong side of a surface.
#[inline(always)]
fn beside(d: Vec3, normal: Vec3, sign: f64) -> Vec3 {
    let height = d.dot(normal);
    let wrong = height * sign < 0.0;
    let turned = d - normal * (2.0 * height);
    Vec3::new(
        pick(wrong, turned.x, d.x),
        pick(wrong, turned.y, d.y),
        pick(wrong, turned.z, d.z),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    use std::sync::Arc;

    use etendue_geometry::Face;
    use etendue_geometry::origin_faces::OriginFaces;
    use etendue_geometry::points_on_faces::PointsOnFaces;
    use etendue_geometry::shape::{Quadric, Shape};
    use etendue_math::Frame;
    use etendue_optics::bsdf::{Bsdf, Interface};
    use etendue_optics::medium::{Index, Medium};
    use etendue_optics::source::surface::about;
    use etendue_optics::table::Curve;
    use etendue_sampling::philox::Stream;

    use crate::interaction::interaction_of;
    use crate::scatter::SurfaceEvent;
    use crate::scene::SceneFace;

    /// A ball of glass that reaches into a cylinder of another one, which is listed first; a third ball of the index of air.
    fn scene() -> Scene {
        let frame = |x: f64| Frame {
            origin: Vec3::new(x, 0.3, -0.2),
            x: Vec3::new(0.6, 0.8, 0.0),
            y: Vec3::new(0.0, 0.0, 1.0),
            z: Vec3::new(0.8, -0.6, 0.0),
        };
        let quadric = |z2: f64| {
            Shape::Quadric(Quadric {
                r2: 1.0,
                z2,
                z1: 0.0,
                z0: -4.0,
                z: [-9.0, 9.0],
                r: [0.0, f64::INFINITY],
            })
        };
        let face = |solid: usize, x: f64, z2: f64, flipped: bool| SceneFace {
            face: Face {
                shape: quadric(z2),
                frame: frame(x),
                trims: vec![],
                flipped,
            },
            solid: Some(solid),
            finish: 0,
            axis: None,
        };
        let faces = vec![
            face(0, 0.0, 0.0, false),
            face(1, 2.5, 1.0, false),
            face(2, 20.0, 1.0, false),
        ];
        let medium = |n: f64| Medium {
            index: Index::Table(Curve::constant(n)),
            absorption: Curve::constant(0.0),
        };
        let media = vec![medium(1.0), medium(1.7), medium(1.5), medium(1.0)];
        let finish: Arc<dyn Bsdf> = Arc::new(Interface);
        Scene::new(faces, vec![finish], media, vec![1, 2, 3], vec![], vec![]).expect("sound")
    }

    #[test]
    fn many_at_once_come_to_what_the_surface_event_comes_to() {
        let scene = scene();
        let (stream, rays) = (Stream::new(8, 9), 20_000_u32);
        let mut queue = RayQueue::default();
        for i in 0..rays {
            let [a, b, c, d] = stream.uniforms(u64::from(i), 0);
            let z = Vec3::new(0.0, 0.0, 1.0);
            let middle = Vec3::new([1.0, 1.8, 20.0][i as usize % 3], 0.3, -0.2);
            let o = middle + about(z, 2.0 * a - 1.0, b) * [0.4, 2.2, 9.0][i as usize / 3 % 3];
            let to = middle + about(z, 2.0 * c - 1.0, d) * 2.1;
            // What the ray is in follows from where it starts; now and then it is wrong.
            let mut stack = SolidStack::default();
            for (number, face) in (1..).zip(scene.face_set.faces()) {
                let Shape::Quadric(quadric) = &face.shape else { continue };
                if (quadric.value(face.frame.point_to_local(o)) < 0.0) != (i % 50 == 11) {
                    stack = stack.crossed(number).expect("room");
                }
            }
            queue.push(i, (o, (to - o).normalized(), OriginFaces::default()), stack);
        }
        let mut hits = Hits::default();
        scene.face_set.nearest(&queue.lines, &mut hits);
        let (mut media, mut others) = (MediumCache::new(&scene), 0);
        let (mut met, mut which) = (InterfaceRays::default(), Vec::new());
        met.make_room(rays as usize);
        let those: Vec<u32> = (0..rays)
            .filter(|i| scene.roles.len() > hits.face[*i as usize] as usize)
            .collect();
        let mut points = PointsOnFaces::default();
        points.find(scene.face_set.faces(), &queue.lines, &hits, &those);
        for (k, i) in those.iter().map(|i| *i as usize).enumerate() {
            let [number, ..] = stream.uniforms(i as u64, 1);
            // Beyond the critical angle and at grazing incidence the shares are extremes: small numbers look for these.
            let number = if i % 3 == 0 { number * 0.1 } else { number };
            if let Some(crossed) = Crossed::new(&scene, &queue, &hits, i, points.get(k), 555.0, &mut media) {
                met.put(which.len(), queue.who[i], &crossed, number);
                which.push((i, number));
            } else {
                let event = interaction_of(&scene, &queue.lines, &hits, i, queue.stack[i], |_, _, _| {});
                let plain = event.is_ok_and(|interaction| {
                    let d = queue.lines.direction(i);
                    let event = SurfaceEvent::new(&scene, &interaction, d, 555.0, &mut media);
                    event.is_ok_and(|event| event.is_some())
                });
                assert!(!plain, "ray {i} meets an interface");
                others += 1;
            }
        }
        met.make_room(which.len());
        met.pass();
        let mut next = RayQueue::default();
        met.go_on(&mut next);
        let mut counts = [0; 4];
        for ((k, (i, number)), (who, face, passed)) in which.iter().enumerate().zip(met.passed()) {
            let interaction =
                interaction_of(&scene, &queue.lines, &hits, *i, queue.stack[*i], |_, _, _| {}).expect("sound");
            let d = queue.lines.direction(*i);
            let event = SurfaceEvent::new(&scene, &interaction, d, 555.0, &mut media);
            let event = event.expect("an index").expect("an interface");
            let (component, d, stack) = event.sample([*number, 0.5]).expect("nothing absorbs");
            assert_eq!(
                (who, face, passed),
                (queue.who[*i], interaction.face, component.is_transmitted())
            );
            assert_eq!(
                (next.lines.origin(k), next.lines.direction(k)),
                (interaction.point, d),
                "{component:?}"
            );
            assert_eq!((next.who[k], next.stack[k]), (who, stack));
            assert_eq!(next.lines.origin_faces(k), interaction.origin_faces);
            counts[usize::from(passed) + 2 * usize::from(interaction.front)] += 1;
        }
        assert!(
            others > 500 && counts.iter().all(|count| *count > 300),
            "{others} {counts:?}"
        );
    }
}
