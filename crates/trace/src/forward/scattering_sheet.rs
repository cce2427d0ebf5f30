//! Many rays at once off one sheet that lets nothing through, whatever it does with the light: points and normals of all of
//! them together, then what becomes of each.
//!
//! What [`scatter`](crate::scatter) comes to for such a sheet, to the same bits.

use etendue_geometry::surface_points::Vectors;
use etendue_math::Vec3;
use etendue_math::heads::{heads, heads_mut};
use etendue_optics::bsdf::{Bsdf, Media, Outcome};
use etendue_optics::fresnel::reflect;
use multiversion::multiversion;

use super::lambertian_sheet::SheetRays;
use crate::scatter::{Surface, along, axes, axes_along, axes_from, local};

/// A sheet that mirrors and scatters light back, or absorbs it.
#[derive(Clone, Copy, Debug)]
pub struct ScatteringSheet<'a> {
    /// Its number.
    pub face: u32,
    bsdf: &'a dyn Bsdf,
    /// A direction that the first axis of its surface follows, if one is stated.
    axis: Option<Vec3>,
    /// No more of the light than this leaves, wherever it comes from.
    most: f64,
}

/// What shares may exceed the greatest one by, for rounding.
const SLACK: f64 = 1e-9;

impl<'a> ScatteringSheet<'a> {
    /// A face with this BSDF, and the direction that its first axis follows; None if it lets light through.
    #[must_use]
    pub fn of(face: u32, bsdf: &'a dyn Bsdf, axis: Option<Vec3>) -> Option<Self> {
        let facts = bsdf.facts();
        let back = !facts.specular[1] && !facts.diffuse[1];
        back.then(|| Self {
            face,
            bsdf,
            axis,
            most: bsdf.most() + SLACK,
        })
    }

    /// Whether the light that this number stands for is absorbed, wherever it comes from.
    #[inline(always)]
    #[must_use]
    pub fn absorbs(&self, number: f64) -> bool {
        number >= self.most
    }

    /// The share of light along `d` that its product sends back (see `Parts`).
    #[inline]
    #[must_use]
    pub fn product(&self, d: Vec3, normal: Vec3, media: Media) -> f64 {
        Surface::new(self.bsdf, media, [normal; 2], self.axis).product(d)
    }
}

/// Rays that meet one such sheet, and what becomes of them.
#[derive(Debug, Default)]
pub struct ScatteredRays {
    /// The medium about each.
    pub media: Vec<Media>,
    /// To where each comes from, and where it goes, in the frame of the surface.
    towards: Vectors,
    /// Its first axis there, if one is stated.
    first_axes: Vectors,
    outcomes: Vec<Outcome>,
    /// Those that are absorbed.
    gone: Vec<usize>,
}

impl ScatteredRays {
    /// Draws what becomes of rays that have reached the sheet, and whose media are known, from two random numbers for each.
    pub fn sample(&mut self, sheet: &ScatteringSheet<'_>, rays: &SheetRays, numbers: [&[f64]; 2]) {
        let n = rays.normals()[0].len();
        for list in self.towards.iter_mut().chain(&mut self.first_axes) {
            list.resize(n, 0.0);
        }
        match sheet.axis {
            None => outward(rays.normals(), rays.directions(), &mut self.towards),
            Some(axis) => outward_along(
                axis,
                rays.normals(),
                rays.directions(),
                &mut self.towards,
                &mut self.first_axes,
            ),
        }
        self.outcomes.resize(n, Outcome::Absorbed);
        sheet
            .bsdf
            .sample_many(&mut self.towards, &self.media, numbers, &mut self.outcomes);
    }

    /// Turns the lines to the sheet into those from there; rays that are absorbed are told, and left out.
    pub fn turn(&mut self, sheet: &ScatteringSheet<'_>, rays: &mut SheetRays, mut absorbed: impl FnMut(u32)) {
        match sheet.axis {
            None => in_space(rays.normals(), &mut self.towards),
            Some(_) => in_space_along(rays.normals(), &self.first_axes, &mut self.towards),
        }
        let Self {
            towards,
            outcomes,
            gone: list,
            ..
        } = self;
        let mut gone = 0;
        list.resize(outcomes.len(), 0);
        for (k, outcome) in outcomes.iter().enumerate() {
            if *outcome == Outcome::Mirrored {
                mirror(rays, k, towards);
            }
            list[gone] = k;
            gone += usize::from(!goes_on(*outcome));
        }
        list[..gone].iter().for_each(|k| absorbed(rays.who(*k)));
        rays.turn_to(towards, &list[..gone]);
    }
}

/// The direction in which a ray is mirrored.
fn mirror(rays: &SheetRays, k: usize, towards: &mut Vectors) {
    let ray = rays.get(k);
    let height = (-ray.d.dot(ray.normal)).clamp(-1.0, 1.0);
    let facing = if height > 0.0 { ray.normal } else { -ray.normal };
    let d = reflect(ray.d, facing, height.abs());
    for (list, component) in towards.iter_mut().zip([d.x, d.y, d.z]) {
        list[k] = component;
    }
}

/// Whether a ray leaves a sheet that lets nothing through.
fn goes_on(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::Mirrored | Outcome::Scattered)
}

/// Changes each of many vectors, told the normal there.
#[inline(always)]
fn each(normals: &Vectors, vectors: &mut Vectors, mut change: impl FnMut(usize, Vec3, Vec3) -> Vec3) {
    let [x, y, z] = vectors.each_mut();
    let n = x.len();
    let [x, y, z] = [x, y, z].map(|list| &mut list[..n]);
    let [nx, ny, nz] = normals.each_ref().map(|list| &list[..n]);
    for k in 0..n {
        let v = change(k, Vec3::new(nx[k], ny[k], nz[k]), Vec3::new(x[k], y[k], z[k]));
        (x[k], y[k], z[k]) = (v.x, v.y, v.z);
    }
}

/// To where rays come from, in the frame of the surface.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn outward(normals: &Vectors, directions: &Vectors, towards: &mut Vectors) {
    let n = towards[0].len();
    let [dx, dy, dz] = heads(directions, n);
    each(normals, towards, |k, normal, _| {
        local(&axes(normal), -Vec3::new(dx[k], dy[k], dz[k]))
    });
}

/// The same where the first axis follows a direction, which tells what it is at each.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn outward_along(axis: Vec3, normals: &Vectors, directions: &Vectors, towards: &mut Vectors, firsts: &mut Vectors) {
    let n = towards[0].len();
    let [dx, dy, dz] = heads(directions, n);
    let [fx, fy, fz] = heads_mut(firsts, n);
    each(normals, towards, |k, normal, _| {
        let axes = axes_along(normal, axis);
        (fx[k], fy[k], fz[k]) = (axes[0].x, axes[0].y, axes[0].z);
        local(&axes, -Vec3::new(dx[k], dy[k], dz[k]))
    });
}

/// From the frame of the surface into space.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn in_space(normals: &Vectors, vectors: &mut Vectors) {
    each(normals, vectors, |_, normal, v| along(&axes(normal), v));
}

/// The same where the first axes are known.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn in_space_along(normals: &Vectors, firsts: &Vectors, vectors: &mut Vectors) {
    let n = vectors[0].len();
    let [fx, fy, fz] = heads(firsts, n);
    each(normals, vectors, |k, normal, v| {
        along(&axes_from(normal, Vec3::new(fx[k], fy[k], fz[k])), v)
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    use std::sync::Arc;

    use etendue_geometry::Face;
    use etendue_geometry::hits::Hits;
    use etendue_geometry::origin_faces::OriginFaces;
    use etendue_geometry::shape::{Quadric, Shape};
    use etendue_math::Frame;
    use etendue_optics::bsdf::{Lambertian, Lobe, Mixture, Profile};
    use etendue_optics::medium::{Index, Medium};
    use etendue_optics::source::surface::about;
    use etendue_optics::table::{Curve, Table};
    use etendue_sampling::philox::Stream;

    use crate::forward::queue::RayQueue;
    use crate::interaction::interaction_of;
    use crate::medium_cache::MediumCache;
    use crate::scatter::SurfaceEvent;
    use crate::scene::{Scene, SceneFace};
    use crate::solid_stack::SolidStack;

    /// A ball that mirrors a fifth, scatters about the mirrored direction with an axis along which the lobe is narrow, and evenly,
    /// the less the steeper light comes, and absorbs the rest.
    fn ball(axis: Option<Vec3>) -> Scene {
        let [mirrored, none] = [0.2, 0.0].map(Table::constant);
        let mirror = Mixture::of_shares([mirrored, none.clone()], [none.clone(), none]).expect("at most 1");
        let profile = Profile::Gaussian { peak: 1.0, sigma: 0.15 };
        let lobe = Lobe::elliptical(profile, 3.0, false, false).expect("sound");
        let falling = Table::new(vec![0.0, 1.5], vec![500.0], vec![0.3, 0.1]).expect("sound");
        let white = Lambertian::new(falling, Table::constant(0.0)).expect("at most 1");
        let parts: Vec<(f64, Arc<dyn Bsdf>)> = vec![(1.0, mirror), (1.0, Arc::new(lobe)), (1.0, Arc::new(white))];
        let both: Arc<dyn Bsdf> = Arc::new(Mixture::new(parts).expect("at most 1"));
        let shape = Shape::Quadric(Quadric {
            r2: 1.0,
            z2: 1.0,
            z1: 0.0,
            z0: -25.0,
            z: [f64::NEG_INFINITY, f64::INFINITY],
            r: [0.0, f64::INFINITY],
        });
        let face = Face {
            shape,
            frame: Frame {
                origin: Vec3::new(0.0, 0.0, 0.0),
                x: Vec3::new(1.0, 0.0, 0.0),
                y: Vec3::new(0.0, 1.0, 0.0),
                z: Vec3::new(0.0, 0.0, 1.0),
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
            axis,
        };
        Scene::new(vec![face], vec![both], vec![air], vec![], vec![], vec![]).expect("sound")
    }

    #[test]
    fn a_bounce_is_what_the_surface_event_comes_to() {
        compare(&ball(None));
        compare(&ball(Some(Vec3::new(0.3, 0.1, 0.9))));
    }

    fn compare(scene: &Scene) {
        let sheet = ScatteringSheet::of(0, &*scene.finishes[0], scene.axes[0]).expect("nothing passes");
        let (stream, rays) = (Stream::new(5, 6), 3000_u32);
        let mut queue = RayQueue::default();
        for i in 0..rays {
            let [a, b, c, d] = stream.uniforms(u64::from(i), 0);
            let z = Vec3::new(0.0, 0.0, 1.0);
            let o = about(z, 2.0 * a - 1.0, b) * if i % 2 == 0 { 9.0 } else { 3.0 };
            let to = about(z, 2.0 * c - 1.0, d) * 2.0;
            queue.push(
                i,
                (o, (to - o).normalized(), OriginFaces::default()),
                SolidStack::default(),
            );
        }
        let mut hits = Hits::default();
        scene.face_set.nearest(&queue.lines, &mut hits);
        let mut media = MediumCache::new(scene);
        let mut ends = [0; 3];
        let which: Vec<u32> = (0..rays).filter(|i| hits.face[*i as usize] == 0).collect();
        let pairs: Vec<_> = which.iter().map(|i| stream.uniforms(u64::from(*i), 1)).collect();
        let numbers = [0, 1].map(|k| pairs.iter().map(|pair| pair[k]).collect::<Vec<f64>>());
        let around = Media {
            wavelength: 555.0,
            front: 1.0,
            back: 1.0,
        };
        let mut gathered = SheetRays::default();
        gathered.gather(&queue, &hits, &which);
        gathered.reach(&scene.face_set.faces()[0]);
        let mut scattered = ScatteredRays {
            media: vec![around; which.len()],
            ..ScatteredRays::default()
        };
        scattered.sample(&sheet, &gathered, numbers.each_ref().map(|list| &list[..]));
        let mut absorbed = Vec::new();
        let mut turned = gathered.clone();
        scattered.turn(&sheet, &mut turned, |who| absorbed.push(who));
        let mut found = 0;
        for (k, i) in which.iter().enumerate() {
            let place = *i as usize;
            let met =
                interaction_of(scene, &queue.lines, &hits, place, SolidStack::default(), |_, _, _| {}).expect("sound");
            let d = queue.lines.direction(place);
            let event = SurfaceEvent::new(scene, &met, d, 555.0, &mut media)
                .expect("air")
                .expect("a surface");
            let expected = event.sample([numbers[0][k], numbers[1][k]]);
            assert_eq!(absorbed.contains(i), expected.is_none());
            if let Some((_, d, _)) = expected {
                let at = (0..turned.len()).find(|k| turned.who(*k) == *i).expect("goes on");
                let ray = turned.get(at);
                assert_eq!((ray.point, ray.d), (met.point, d));
                found += 1;
            }
            let front = if met.front { met.side } else { -met.side };
            let known = event.arriving(event.parts().expect("a Lambertian part"));
            assert_eq!([sheet.product(d, front, around), 0.0], known);
            assert!(known[0] > 0.1 && known[0] < 0.3);
            ends[expected.map_or(0, |(component, ..)| 1 + usize::from(component.is_specular()))] += 1;
        }
        assert_eq!(found, turned.len());
        assert!(ends.iter().all(|count| *count > 100), "{ends:?}");
    }
}
