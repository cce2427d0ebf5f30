//! Many rays at once off one sheet that mirrors and scatters alike in all directions and colours: walls and reflectors.
//!
//! What [`scatter`](crate::scatter) comes to for such a sheet, to the same bits, without branches and several rays at a time.

use etendue_geometry::Face;
use etendue_geometry::hits::Hits;
use etendue_geometry::surface_points::{Vectors, fill, gather, surface_points};
use etendue_math::Vec3;
use etendue_math::heads::{heads, heads_mut};
use etendue_optics::bsdf::Facts;
use etendue_optics::fresnel::reflect;
use etendue_optics::source::surface::about;
use etendue_sampling::warp::part_of;
use multiversion::multiversion;

use super::queue::RayQueue;

/// How a sheet that many rays are bounced off at once shares out light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LambertianSheet {
    /// Its number.
    pub face: u32,
    mirrored: f64,
    scattered: f64,
}

impl LambertianSheet {
    /// A face with these properties; None if it is another kind of sheet.
    #[must_use]
    pub fn of(face: u32, facts: &Facts) -> Option<Self> {
        let [mirrored, through, scattered, behind] = facts.constant?;
        (facts.lambertian && through == 0.0 && behind == 0.0).then_some(Self {
            face,
            mirrored,
            scattered,
        })
    }

    /// Whether the light that this number stands for is absorbed.
    #[inline(always)]
    #[must_use]
    pub fn absorbs(self, number: f64) -> bool {
        number >= self.mirrored + self.scattered
    }
}

/// A ray where it meets a face.
#[derive(Clone, Copy, Debug)]
pub struct SheetRay {
    /// Number of its state.
    pub who: u32,
    /// The part of the face.
    pub part: u32,
    /// \[mm\].
    pub point: Vec3,
    /// Along which it came.
    pub d: Vec3,
    /// Of the front.
    pub normal: Vec3,
}

/// Rays of a block that meet one face, gathered. Structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct SheetRays {
    who: Vec<u32>,
    part: Vec<u32>,
    o: Vectors,
    d: Vectors,
    t: Vec<f64>,
    normal: Vectors,
}

impl SheetRays {
    /// Gathers some rays of a queue.
    pub fn gather(&mut self, queue: &RayQueue, hits: &Hits, which: &[u32]) {
        let indices = || which.iter().map(|i| *i as usize);
        fill(&mut self.who, indices().map(|i| queue.who[i]));
        fill(&mut self.part, indices().map(|i| hits.part[i].0));
        fill(&mut self.t, indices().map(|i| hits.t[i]));
        gather(&mut self.o, &queue.lines.origin, which);
        gather(&mut self.d, &queue.lines.direction, which);
    }

    /// Turns the lines to the face into those from there.
    pub fn bounce(&mut self, face: &Face, sheet: LambertianSheet, numbers: &[Vec<f64>; 2]) {
        self.reach(face);
        turn(sheet, numbers, &self.normal, &mut self.d);
    }

    /// Follows the lines to the face.
    pub fn reach(&mut self, face: &Face) {
        surface_points(face, &mut self.o, &self.d, &self.t, &self.part, &mut self.normal);
    }

    /// How many.
    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.who.len()
    }

    /// Directions of the lines.
    pub const fn directions(&self) -> &Vectors {
        &self.d
    }

    /// Normals of the front where they have reached the face.
    pub const fn normals(&self) -> &Vectors {
        &self.normal
    }

    /// One of those that have reached the face.
    #[inline]
    pub fn get(&self, k: usize) -> SheetRay {
        let at = |lists: &Vectors| Vec3::new(lists[0][k], lists[1][k], lists[2][k]);
        SheetRay {
            who: self.who[k],
            part: self.part[k],
            point: at(&self.o),
            d: at(&self.d),
            normal: at(&self.normal),
        }
    }

    /// The number of the state of one of them.
    #[inline]
    pub fn who(&self, k: usize) -> u32 {
        self.who[k]
    }

    /// Turns the lines that have reached the face into those from there in some directions, which are swapped for theirs. Some rays
    /// are left out, told in rising order: the last ones take their places.
    pub fn turn_to(&mut self, directions: &mut Vectors, gone: &[usize]) {
        std::mem::swap(&mut self.d, directions);
        for k in gone.iter().rev() {
            // All behind it go on.
            self.who.swap_remove(*k);
            self.part.swap_remove(*k);
            for list in self.o.iter_mut().chain(&mut self.d) {
                list.swap_remove(*k);
            }
        }
    }

    /// Adds the rays to a queue.
    pub fn go_on(&self, face: u32, queue: &mut RayQueue) {
        let [o, d] = [&self.o, &self.d].map(|lists| lists.each_ref().map(|list| &list[..]));
        queue.extend(o, d, self.who.iter().copied(), face, self.part.iter().copied());
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn turn(sheet: LambertianSheet, numbers: &[Vec<f64>; 2], normals: &Vectors, directions: &mut Vectors) {
    let n = directions[0].len();
    let [dx, dy, dz] = heads_mut(directions, n);
    let [nx, ny, nz] = heads(normals, n);
    let [lobe, turn] = heads(numbers, n);
    for k in 0..n {
        let (d, normal) = (Vec3::new(dx[k], dy[k], dz[k]), Vec3::new(nx[k], ny[k], nz[k]));
        let height_in = d.dot(normal);
        let sign = if height_in < 0.0 { 1.0 } else { -1.0 };
        let height = part_of(lobe[k] - sheet.mirrored, sheet.scattered);
        let mirrored = reflect(d, normal * sign, -height_in * sign);
        // About the normal of the front, on the side that the light came from.
        let scattered = about(normal, (1.0 - height).sqrt() * sign, turn[k]);
        let mirror = lobe[k] < sheet.mirrored;
        dx[k] = if mirror { mirrored.x } else { scattered.x };
        dy[k] = if mirror { mirrored.y } else { scattered.y };
        dz[k] = if mirror { mirrored.z } else { scattered.z };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use etendue_geometry::origin_faces::OriginFaces;
    use etendue_geometry::shape::{Flat, Outline, Quadric, Shape};
    use etendue_math::Frame;
    use etendue_optics::bsdf::{Component, Mixture};
    use etendue_optics::medium::{Index, Medium};
    use etendue_optics::table::{Curve, Table};
    use etendue_sampling::philox::Stream;

    use crate::interaction::interaction_of;
    use crate::medium_cache::MediumCache;
    use crate::scatter::SurfaceEvent;
    use crate::scene::{Scene, SceneFace};
    use crate::solid_stack::SolidStack;

    /// A sheet that stands askew.
    fn sheet(shape: Shape) -> Scene {
        let [mirrored, scattered, none] = [0.3, 0.45, 0.0].map(Table::constant);
        let bsdf = Mixture::of_shares([mirrored, none.clone()], [scattered, none]).expect("at most 1");
        let face = Face {
            shape,
            frame: Frame {
                origin: Vec3::new(1.0, -2.0, 0.5),
                x: Vec3::new(0.6, 0.8, 0.0),
                y: Vec3::new(0.0, 0.0, 1.0),
                z: Vec3::new(0.8, -0.6, 0.0),
            },
            trims: vec![],
            flipped: false,
        };
        let air = Medium {
            index: Index::Table(Curve::constant(1.0)),
            absorption: Curve::constant(0.0),
        };
        let face = SceneFace {
            face,
            solid: None,
            finish: 0,
            axis: None,
        };
        Scene::new(vec![face], vec![bsdf], vec![air], vec![], vec![], vec![]).expect("sound")
    }

    #[test]
    fn many_at_once_come_to_what_the_surface_event_comes_to() {
        let disk = Shape::Flat(Flat {
            outline: Outline::Annulus {
                inner: 0.0,
                outer: 50.0,
            },
        });
        let ball = Shape::Quadric(Quadric {
            r2: 1.0,
            z2: 1.0,
            z1: 0.0,
            z0: -25.0,
            z: [f64::NEG_INFINITY, f64::INFINITY],
            r: [0.0, f64::INFINITY],
        });
        for shape in [disk, ball] {
            let scene = sheet(shape);
            let plain = LambertianSheet::of(0, scene.finishes[0].facts()).expect("a plain wall");
            let (stream, rays) = (Stream::new(8, 9), 4000_u32);
            let mut queue = RayQueue::default();
            let mut numbers = [Vec::new(), Vec::new()];
            for i in 0..rays {
                let [a, b, c, d] = stream.uniforms(u64::from(i), 0);
                // From points in a ball and outside of it, on both sides of a disk, to points about the middle.
                let z = Vec3::new(0.0, 0.0, 1.0);
                let middle = Vec3::new(1.0, -2.0, 0.5);
                let o = middle + about(z, 2.0 * a - 1.0, b) * if i % 2 == 0 { 9.0 } else { 3.0 };
                let to = middle + about(z, 2.0 * c - 1.0, d) * 2.0;
                queue.push(
                    i,
                    (o, (to - o).normalized(), OriginFaces::default()),
                    SolidStack::default(),
                );
                let [lobe, turn, ..] = stream.uniforms(u64::from(i), 1);
                numbers[0].push(lobe * 0.75);
                numbers[1].push(turn);
            }
            let mut hits = Hits::default();
            scene.face_set.nearest(&queue.lines, &mut hits);
            let which: Vec<u32> = (0..rays).filter(|i| hits.face[*i as usize] == 0).collect();
            let mut gathered = SheetRays::default();
            gathered.gather(&queue, &hits, &which);
            let own = numbers
                .each_ref()
                .map(|list| which.iter().map(|i| list[*i as usize]).collect::<Vec<f64>>());
            gathered.bounce(&scene.face_set.faces()[0], plain, &own);
            let mut media = MediumCache::new(&scene);
            let mut counts = [0; 4];
            for (k, i) in which.iter().enumerate() {
                let place = *i as usize;
                let met = interaction_of(&scene, &queue.lines, &hits, place, SolidStack::default(), |_, _, _| {})
                    .expect("sound");
                let along = queue.lines.direction(place);
                let event = SurfaceEvent::new(&scene, &met, along, 555.0, &mut media)
                    .expect("air")
                    .expect("a surface");
                let (component, d, _) = event.sample([own[0][k], own[1][k]]).expect("not absorbed");
                let [point, direction] = [&gathered.o, &gathered.d].map(|v| Vec3::new(v[0][k], v[1][k], v[2][k]));
                assert_eq!((point, direction), (met.point, d), "{component:?}, front {}", met.front);
                counts[usize::from(component.is_specular()) + 2 * usize::from(met.front)] += 1;
                assert!(component == Component::Specular(false) || component == Component::Diffuse(false));
            }
            assert!(counts.iter().all(|count| *count > 100), "{counts:?}");
        }
    }
}
