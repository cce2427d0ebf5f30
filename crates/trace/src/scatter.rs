//! The surface event: what becomes of light at a surface that it meets. Rays from the sources and lines of sight both ask here.

use etendue_math::Vec3;
use etendue_optics::bsdf::{Bsdf, Component, Drawn, Media, Outward, Parts, Shares};
use etendue_optics::source::surface::across;

use crate::interaction::Interaction;
use crate::ledger::Loss;
use crate::medium_cache::MediumCache;
use crate::scene::Scene;
use crate::solid_stack::SolidStack;

/// Chains of smooth surfaces are followed on every branch down to this weight; below, one branch is drawn.
pub const SPLIT: f64 = 1e-4;

/// A surface at one of its points: its axes, its BSDF, and the media on both sides.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    bsdf: &'a dyn Bsdf,
    media: Media,
    /// Axes of the frame in which diffuse light is spread; the third is the normal of the front, and the first points along the
    /// stated axis of the surface. Lambertian light is spread about the surface itself, so that none starts behind it; lobes
    /// are about the interpolated normal, as the mirrored direction is.
    axes: [Vec3; 3],
    /// The normal of the front of the surface itself.
    side: Vec3,
}

impl<'a> Surface<'a> {
    /// With the unit normals of the front: that of the surface itself, and the interpolated one; and a direction that the first
    /// axis follows along the surface, if there is one.
    #[inline(always)]
    #[must_use]
    pub fn new(bsdf: &'a dyn Bsdf, media: Media, [side, normal]: [Vec3; 2], axis: Option<Vec3>) -> Self {
        let normal = if bsdf.facts().lambertian { side } else { normal };
        Self {
            bsdf,
            media,
            axes: axis.map_or_else(|| axes(normal), |axis| axes_along(normal, axis)),
            side,
        }
    }

    /// Whether a direction lies on the same side of the surface itself as of the frame in which light is spread.
    #[inline]
    fn keeps_side(&self, v: Vec3) -> bool {
        (v.dot(self.side) > 0.0) == (v.dot(self.axes[2]) > 0.0)
    }

    /// f \[1/sr\] for light that comes from one direction and goes to another, both pointing away from the surface: of the
    /// surface itself, whose cosine makes intensity of it.
    #[inline]
    #[must_use]
    pub fn evaluate(&self, incident: Vec3, scattered: Vec3) -> f64 {
        let [i, s] = [incident, scattered].map(|v| local(&self.axes, v));
        self.bsdf.evaluate(i, s, &self.media) * self.tilt(incident, scattered, s.z)
    }

    /// The share of light along `d` that the product of the BSDF sends back (see [`Parts`]).
    #[inline]
    #[must_use]
    pub fn product(&self, d: Vec3) -> f64 {
        let parts = self.bsdf.parts();
        parts.map_or(0.0, |parts| {
            parts.product.arriving(local(&self.axes, -d), &self.media)[0]
        })
    }

    /// What f is multiplied by where normals are interpolated: the light that leaves in a direction is f cosθ about the
    /// interpolated normal, forwards, and the same light is seen backwards, where the cosine is that of the surface itself
    /// `[Veach1997]`, section 5.3. 0 where either direction is on the other side of the surface itself.
    #[inline]
    fn tilt(&self, incident: Vec3, scattered: Vec3, height: f64) -> f64 {
        if self.axes[2] == self.side {
            1.0
        } else if self.keeps_side(incident) && self.keeps_side(scattered) {
            (height / scattered.dot(self.side)).abs()
        } else {
            0.0
        }
    }
}

/// Axes of which the third is the normal.
#[inline(always)]
#[must_use]
pub fn axes(normal: Vec3) -> [Vec3; 3] {
    let [x, y] = across(normal);
    [x, y, normal]
}

/// Axes of which the first is a direction laid on the surface; any, where it stands upright on it.
#[inline(always)]
#[must_use]
pub fn axes_along(normal: Vec3, axis: Vec3) -> [Vec3; 3] {
    let laid = axis - normal * axis.dot(normal);
    let length = laid.length();
    let upright = length <= 1e-9 * axis.length();
    let own = laid * (1.0 / length);
    // By components: several at a time where many are asked for.
    let [any, _] = across(normal);
    let pick = |any: f64, own: f64| if upright { any } else { own };
    axes_from(
        normal,
        Vec3::new(pick(any.x, own.x), pick(any.y, own.y), pick(any.z, own.z)),
    )
}

/// Axes of which the first and the third are known.
#[inline(always)]
#[must_use]
pub fn axes_from(normal: Vec3, first: Vec3) -> [Vec3; 3] {
    [first, normal.cross(first), normal]
}

/// Components of a unit vector along axes.
#[inline(always)]
#[must_use]
pub fn local(axes: &[Vec3; 3], v: Vec3) -> Vec3 {
    let [x, y, z] = axes.map(|axis| axis.dot(v));
    Vec3::new(x, y, z.clamp(-1.0, 1.0))
}

/// The vector that has these components along axes.
#[inline(always)]
#[must_use]
pub fn along(axes: &[Vec3; 3], v: Vec3) -> Vec3 {
    let [x, y, z] = *axes;
    x * v.x + y * v.y + z * v.z
}

/// Light, or a line of sight, at a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceEvent<'a> {
    surface: Surface<'a>,
    interaction: &'a Interaction,
    /// Along which it came.
    d: Vec3,
    /// To where it came from, about the interpolated normal: what is mirrored and refracted goes by it.
    towards: Vec3,
    /// The same in the frame in which diffuse light is spread.
    outward: Vec3,
}

impl<'a> SurfaceEvent<'a> {
    /// What meets a surface along `d`; None if it goes on as if nothing were there.
    ///
    /// # Errors
    /// If a medium has no refractive index at this wavelength.
    #[inline]
    pub fn new(
        scene: &'a Scene,
        interaction: &'a Interaction,
        d: Vec3,
        wavelength: f64,
        media: &mut MediumCache,
    ) -> Result<Option<Self>, Loss> {
        let Some(finish) = interaction.finish else {
            return Ok(None);
        };
        let media = media.both(
            scene,
            [interaction.before, interaction.after],
            interaction.front,
            wavelength,
        )?;
        let bsdf = &*scene.finishes[finish as usize];
        if bsdf.is_nothing(&media) {
            return Ok(None);
        }
        let front = |normal: Vec3| if interaction.front { normal } else { -normal };
        let normals = [interaction.side, interaction.normal].map(front);
        let surface = Surface::new(bsdf, media, normals, scene.axes[interaction.face as usize]);
        let outward = local(&surface.axes, -d);
        let towards = if surface.axes[2] == normals[1] {
            outward
        } else {
            local(&axes(normals[1]), -d)
        };
        Ok(Some(Self {
            surface,
            interaction,
            d,
            towards,
            outward,
        }))
    }

    /// The optical properties.
    #[inline]
    #[must_use]
    pub fn bsdf(&self) -> &'a dyn Bsdf {
        self.surface.bsdf
    }

    /// Where.
    #[inline]
    #[must_use]
    pub const fn interaction(&self) -> &'a Interaction {
        self.interaction
    }

    /// Along which it came.
    #[inline]
    #[must_use]
    pub const fn direction(&self) -> Vec3 {
        self.d
    }

    /// Shares of the light that arrives.
    #[inline]
    #[must_use]
    pub fn shares(&self) -> Shares {
        self.surface.bsdf.shares(self.towards, &self.surface.media)
    }

    /// The diffuse part of the optical properties, taken apart where that is of use: where normals are interpolated, what leaves
    /// in a direction depends on the point.
    #[inline]
    #[must_use]
    pub fn parts(&self) -> Option<Parts<'a>> {
        let even = self.surface.axes[2] == self.surface.side;
        self.surface.bsdf.parts().filter(|_| even)
    }

    /// The product's shares of the light that arrives (see [`Parts`]).
    #[inline]
    #[must_use]
    pub fn arriving(&self, parts: Parts<'_>) -> [f64; 2] {
        parts.product.arriving(self.towards, &self.surface.media)
    }

    /// The product's luminance where the line of sight came from, over that of Lambertian light (see [`Parts`]).
    #[inline]
    #[must_use]
    pub fn leaving(&self, parts: Parts<'_>) -> f64 {
        parts.product.leaving(self.outward, &self.surface.media)
    }

    /// The same for another BSDF in the place of this one.
    #[inline]
    #[must_use]
    pub fn of(&self, bsdf: &'a dyn Bsdf) -> Self {
        let surface = Surface { bsdf, ..self.surface };
        Self { surface, ..*self }
    }

    /// What becomes of a ray, from two numbers: the component, its direction and the solids that it is in; None if it is absorbed.
    #[inline]
    #[must_use]
    pub fn sample(&self, numbers: [f64; 2]) -> Option<(Component, Vec3, SolidStack)> {
        let (component, (d, stack)) = match self.surface.bsdf.sample(self.towards, &self.surface.media, numbers) {
            Drawn::Absorbed => return None,
            Drawn::Mirrored => (Component::Specular(false), self.mirrored()),
            Drawn::Refracted(cosine) => (Component::Specular(true), self.refracted(cosine)),
            Drawn::Scattered(direction) => {
                let transmitted = (direction.z > 0.0) != self.interaction.front;
                let (d, stack) = self.scattered(direction);
                if !self.surface.keeps_side(d) {
                    return None;
                }
                (Component::Diffuse(transmitted), (d, stack))
            }
        };
        Some((component, d, stack))
    }

    /// Shares of the radiance along the mirrored and the refracted line that are seen, and shares of light that arrives (see
    /// [`Bsdf::seen`]).
    #[inline]
    #[must_use]
    pub fn seen(&self) -> ([f64; 2], Shares) {
        self.surface.bsdf.seen(self.towards, &self.surface.media)
    }

    /// The share of the radiance along the line that goes straight on, as through a filter; 0 where that way bends.
    #[inline]
    #[must_use]
    pub fn straight_on(&self) -> f64 {
        if self.is_straight() { self.seen().0[1] } else { 0.0 }
    }

    /// Whether what is transmitted without being scattered keeps its direction.
    #[inline]
    #[must_use]
    pub fn is_straight(&self) -> bool {
        self.surface.media.front == self.surface.media.back
    }

    /// The direction after it is mirrored, and the solids there.
    #[inline]
    #[must_use]
    pub fn mirrored(&self) -> (Vec3, SolidStack) {
        (
            self.interaction.mirrored(self.d, self.towards.z.abs()),
            self.interaction.before,
        )
    }

    /// The direction after it is refracted at an angle with this cosine, and the solids there.
    #[inline]
    #[must_use]
    pub fn refracted(&self, cosine: f64) -> (Vec3, SolidStack) {
        let [n1, n2] = self.surface.media.seen_from(self.towards);
        let d = self
            .interaction
            .refracted(self.d, self.towards.z.abs(), n1 / n2, cosine);
        (d, self.interaction.after)
    }

    /// A direction of diffuse light out of the frame of the surface, and the solids there.
    #[inline]
    #[must_use]
    pub fn scattered(&self, direction: Vec3) -> (Vec3, SolidStack) {
        let stack = if (direction.z > 0.0) == self.interaction.front {
            self.interaction.before
        } else {
            self.interaction.after
        };
        (along(&self.surface.axes, direction), stack)
    }

    /// What is to be known of diffuse light that goes where the line of sight came from (see [`Bsdf::outward`]).
    #[inline]
    #[must_use]
    pub fn outward(&self) -> Outward {
        self.surface.bsdf.outward(self.outward, &self.surface.media)
    }

    /// A direction that such light may have come from, on one of the sides, in space.
    #[inline]
    #[must_use]
    pub fn draw_incoming(&self, outward: &Outward, transmitted: bool, numbers: [f64; 2]) -> Vec3 {
        let bsdf = self.surface.bsdf;
        let k = bsdf.draw_incoming(outward, transmitted, &self.surface.media, numbers);
        self.scattered(k).0
    }

    /// Light that comes from `k`, away from the surface, and goes where the line of sight came from.
    #[inline]
    #[must_use]
    pub fn from(&self, k: Vec3, outward: &Outward) -> Incoming {
        let incident = local(&self.surface.axes, k);
        let (f, about) = self.surface.bsdf.incoming_light(incident, outward, &self.surface.media);
        self.incoming(k, incident, f, about)
    }

    /// The same for a direction that was drawn, with the density \[1/sr\] with which that is done on its side.
    #[inline]
    #[must_use]
    pub fn drawn_from(&self, k: Vec3, outward: &Outward) -> (Incoming, f64) {
        let incident = local(&self.surface.axes, k);
        let (f, density, about) = self.surface.bsdf.drawn_light(incident, outward, &self.surface.media);
        (self.incoming(k, incident, f, about), density)
    }

    #[inline]
    fn incoming(&self, k: Vec3, incident: Vec3, f: f64, about: f64) -> Incoming {
        let transmitted = (incident.z > 0.0) != self.interaction.front;
        Incoming {
            transmitted,
            f: f * self.surface.tilt(k, -self.d, self.outward.z),
            cosine: k.dot(self.surface.side).abs(),
            about,
            stack: if transmitted {
                self.interaction.after
            } else {
                self.interaction.before
            },
        }
    }
}

/// Diffuse light of one direction that is seen at a surface.
#[derive(Clone, Copy, Debug)]
pub struct Incoming {
    /// Whether it comes from the other side.
    pub transmitted: bool,
    /// \[1/sr\].
    pub f: f64,
    /// Of the angle of incidence.
    pub cosine: f64,
    /// About the density \[1/sr\] with which this direction is drawn on its side (see [`Bsdf::incoming_light`]).
    pub about: f64,
    /// The solids that it comes through.
    pub stack: SolidStack,
}
