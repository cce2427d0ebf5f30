//! Many rays at once off one sheet that lets nothing through, whatever it does with the light: points and normals of all of
//! them together, then what becomes of each.
//!
//! What [`scatter`](crate::scatter) comes to for such a sheet, to the same bits.

use etendue_math::Vec3;
use etendue_optics::bsdf::{Bsdf, Media};

use crate::scatter::Surface;

/// A sheet that mirrors and scatters light back, or absorbs it.
#[derive(Clone, Copy, Debug)]
pub struct ScatteringSheet<'a> {
    /// Its number.
    pub face: u32,
    bsdf: &'a dyn Bsdf,
    /// A direction that the first axis of its surface follows, if one is stated.
    axis: Option<Vec3>,
}

impl<'a> ScatteringSheet<'a> {
    /// A face with this BSDF, and the direction that its first axis follows; None if it lets light through.
    #[must_use]
    pub fn of(face: u32, bsdf: &'a dyn Bsdf, axis: Option<Vec3>) -> Option<Self> {
        let facts = bsdf.facts();
        let back = !facts.specular[1] && !facts.diffuse[1];
        back.then_some(Self { face, bsdf, axis })
    }

    /// The direction of a ray after it met the sheet, from two random numbers; None: absorbed. `normal` is that of the front.
    #[inline]
    #[must_use]
    pub fn bounced(&self, d: Vec3, normal: Vec3, media: Media, numbers: [f64; 2]) -> Option<Vec3> {
        Surface::new(self.bsdf, media, [normal; 2], self.axis).bounced(d, numbers)
    }

    /// The share of light along `d` that its product sends back (see `Parts`).
    #[inline]
    #[must_use]
    pub fn product(&self, d: Vec3, normal: Vec3, media: Media) -> f64 {
        Surface::new(self.bsdf, media, [normal; 2], self.axis).product(d)
    }
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
    fn ball() -> Scene {
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
        let axis = Some(Vec3::new(0.3, 0.1, 0.9));
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
        let scene = ball();
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
        let mut media = MediumCache::new(&scene);
        let mut ends = [0; 3];
        for i in (0..rays as usize).filter(|i| hits.face[*i] == 0) {
            let [number, turn, ..] = stream.uniforms(i as u64, 1);
            let met =
                interaction_of(&scene, &queue.lines, &hits, i, SolidStack::default(), |_, _, _| {}).expect("sound");
            let d = queue.lines.direction(i);
            let event = SurfaceEvent::new(&scene, &met, d, 555.0, &mut media)
                .expect("air")
                .expect("a surface");
            let expected = event.sample([number, turn]);
            let around = Media {
                wavelength: 555.0,
                front: 1.0,
                back: 1.0,
            };
            let front = if met.front { met.side } else { -met.side };
            let found = sheet.bounced(d, front, around, [number, turn]);
            assert_eq!(found, expected.map(|(_, d, _)| d));
            let known = event.arriving(event.parts().expect("a Lambertian part"));
            assert_eq!([sheet.product(d, front, around), 0.0], known);
            assert!(known[0] > 0.1 && known[0] < 0.3);
            ends[expected.map_or(0, |(component, ..)| 1 + usize::from(component.is_specular()))] += 1;
        }
        assert!(ends.iter().all(|count| *count > 100), "{ends:?}");
    }
}
