//! What every BSDF answers, and in which terms.
//!
//! **Frame.** Directions are unit vectors in the frame of the surface, +z being the normal of its front. They point *away*
//! from the surface: `incident` to where light comes from, `scattered` to where it goes. Light meets the front if
//! `incident.z > 0`, and it is reflected if both heights have the same sign.
//!
//! **Measure.** [`evaluate`](Bsdf::evaluate) is f in 1/sr: flux Φ from `incident` leaves with the intensity Φ f |cos θₛ|
//! `[Nicodemus1977]`. The cosine is never part of f. Light that leaves in a single direction, mirrored or refracted, has no
//! f: it is *specular*, and the other is *diffuse* (regular and diffuse in the terms of the CIE). A BSDF says which of its
//! components exist: [`facts`](Bsdf::facts).
//!
//! **Drawing.** [`sample`](Bsdf::sample) draws what becomes of a ray with the shares of its flux as probabilities, so that a
//! ray that goes on keeps its flux. So the density of scattered directions, [`pdf`](Bsdf::pdf), is f |cos θₛ|, and its integral
//! the diffuse share; what is missing to 1 is mirrored, refracted or absorbed. None of the methods knows a weight.
//!
//! **Backwards.** Who follows light from the eye knows where it goes and asks where it came from.
//! [`seen`](Bsdf::seen) says how much of the radiance behind a mirrored or refracted line of sight is seen;
//! [`outward`](Bsdf::outward) prepares what is asked about light that leaves one way, [`draw_incoming`](Bsdf::draw_incoming)
//! proposes directions that it may have come from, [`drawn_light`](Bsdf::drawn_light) has their density, and
//! [`incoming_light`](Bsdf::incoming_light) answers for other directions. Whoever takes one weighs it by f |cos θᵢ| over its
//! density.
//!
//! **Taken apart.** Many BSDFs have a part f = a(incident) l(scattered)/π: Lambertian light, that under a clear coat, the base of
//! a table. What it sends out anywhere is known as soon as the light that arrives is summed with the weights a, wherever it came
//! from. Whoever knows this sum needs to look for the light of the rest only: [`Parts`].

use std::f64::consts::FRAC_1_PI;
use std::fmt::Debug;
use std::sync::Arc;

use etendue_geometry::surface_points::Vectors;
use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::warp::part_of;

use super::drawn::{Drawn, Outcome};
use super::shares::{Component, Shares};
use crate::table::Table;

/// What lies on both sides of a surface, for light of one wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Media {
    /// In vacuum \[nm\].
    pub wavelength: f64,
    /// Refractive index in front.
    pub front: f64,
    /// Refractive index behind.
    pub back: f64,
}

impl Media {
    /// The indices on the side of a direction and on the other one.
    #[inline(always)]
    #[must_use]
    pub fn seen_from(&self, direction: Vec3) -> [f64; 2] {
        if direction.z > 0.0 {
            [self.front, self.back]
        } else {
            [self.back, self.front]
        }
    }
}

/// What holds for a BSDF at all angles and wavelengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
    /// Whether light may be mirrored, and refracted.
    pub specular: [bool; 2],
    /// Whether light may be scattered back, and to the other side.
    pub diffuse: [bool; 2],
    /// Whether scattered light leaves each side with the same luminance in all directions, wherever it came from (Lambert).
    pub lambertian: bool,
    /// Whether light that comes back along its way has the same shares and f/n², n being the index where it leaves
    /// (Helmholtz), between any two media.
    pub reciprocal: bool,
    /// The shares, in the order of [`Component::ALL`], if they are the same at all angles and wavelengths, total reflection
    /// apart.
    pub constant: Option<[f64; 4]>,
    /// Whether it is an interface of the media on both sides, with Fresnel's shares.
    pub fresnel: bool,
}

impl Facts {
    /// Whether any light is scattered.
    #[must_use]
    pub const fn is_diffuse(&self) -> bool {
        self.diffuse[0] || self.diffuse[1]
    }

    /// Whether any light is mirrored or refracted.
    #[must_use]
    pub const fn is_specular(&self) -> bool {
        self.specular[0] || self.specular[1]
    }
}

/// Optical properties of a surface: the bidirectional scattering distribution function and the specular components beside it.
pub trait Bsdf: Debug + Send + Sync {
    /// What holds at all angles and wavelengths.
    fn facts(&self) -> &Facts;

    /// The shares of light from `incident`.
    fn shares(&self, incident: Vec3, media: &Media) -> Shares;

    /// f \[1/sr\] of the diffuse components; 0 for directions that it never scatters to.
    fn evaluate(&self, _incident: Vec3, _scattered: Vec3, _media: &Media) -> f64 {
        0.0
    }

    /// A direction of diffuse light on one side, from two numbers from 0 to 1: with density f |cos θₛ| over its share, which is
    /// not 0.
    #[inline]
    fn draw(&self, incident: Vec3, transmitted: bool, _media: &Media, numbers: [f64; 2]) -> Vec3 {
        by_cosine((incident.z > 0.0) != transmitted, numbers)
    }

    /// Its diffuse part, taken apart; None if no part of it is a product.
    fn parts(&self) -> Option<Parts<'_>> {
        None
    }

    /// Whether light passes as if nothing were there.
    fn is_nothing(&self, _media: &Media) -> bool {
        false
    }

    /// Whether it may treat some wavelengths differently from others where the media on both sides do not: it is *selective*.
    fn is_selective(&self) -> bool {
        true
    }

    /// Angles \[rad\] and wavelengths \[nm\] between which the shares are bilinear and beyond which they do not change; None if
    /// they are not of that kind.
    fn breakpoints(&self) -> Option<[Vec<f64>; 2]> {
        None
    }

    /// The greatest share of light that leaves, all components together, whatever its direction and wavelength; 1 where that is
    /// not known. What is beyond is absorbed before anything else has to be known of a ray.
    fn most(&self) -> f64 {
        let Some([angles, wavelengths]) = self.breakpoints() else {
            return 1.0;
        };
        let mut most = 0.0;
        for angle in angles {
            let (s, c) = angle.sin_cos();
            for wavelength in &wavelengths {
                let media = Media {
                    wavelength: *wavelength,
                    front: 1.0,
                    back: 1.0,
                };
                most = self.shares(Vec3::new(s, 0.0, c), &media).total().max(most);
            }
        }
        most
    }

    /// Density \[1/sr\] of scattered directions.
    #[inline]
    fn pdf(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        self.evaluate(incident, scattered, media) * scattered.z.abs()
    }

    /// What becomes of a ray, from two numbers from 0 to 1: the first decides between the components and, with what is left of
    /// it, how far from the normal light is scattered.
    #[inline]
    fn sample(&self, incident: Vec3, media: &Media, numbers: [f64; 2]) -> Drawn {
        let shares = self.shares(incident, media);
        match shares.pick(numbers[0]) {
            None => Drawn::Absorbed,
            Some((Component::Specular(false), _)) => Drawn::Mirrored,
            Some((Component::Specular(true), _)) => Drawn::Refracted(shares.refraction),
            Some((Component::Diffuse(transmitted), rest)) => {
                Drawn::Scattered(self.draw(incident, transmitted, media, [rest, numbers[1]]))
            }
        }
    }

    /// What becomes of many rays, each as [`sample`](Bsdf::sample) says, one outcome for each. Directions are those from which the
    /// rays come; those of rays that are scattered are changed to where they go, and those of rays that are absorbed mean nothing.
    fn sample_many(&self, directions: &mut Vectors, media: &[Media], numbers: [&[f64]; 2], outcomes: &mut [Outcome]) {
        for (k, outcome) in outcomes.iter_mut().enumerate() {
            let [x, y, z] = directions.each_ref().map(|list| list[k]);
            let drawn = self.sample(Vec3::new(x, y, z), &media[k], numbers.map(|list| list[k]));
            *outcome = drawn.keep(directions, k);
        }
    }

    /// Shares of the radiance along the mirrored and the refracted line that is seen by who looks along −`towards`; and the
    /// shares of light from `towards`.
    ///
    /// Light that is transmitted to the eye arrives on the other side, at the angle of refraction, and its radiance grows by
    /// (n₁/n₂)² on its way from a medium of index n₂ into one of n₁.
    #[inline]
    fn seen(&self, towards: Vec3, media: &Media) -> ([f64; 2], Shares) {
        let shares = self.shares(towards, media);
        let [mirrored, mut refracted] = shares.specular;
        if refracted > 0.0 {
            let [n1, n2] = media.seen_from(towards);
            let ratio = n1 / n2;
            if !self.facts().reciprocal {
                let height = -shares.refraction.copysign(towards.z);
                let there = Vec3::new(-ratio * towards.x, -ratio * towards.y, height);
                refracted = self.shares(there, media).specular[1];
            }
            refracted *= ratio * ratio;
        }
        ([mirrored, refracted], shares)
    }

    /// What is to be known of light that leaves along `scattered`, before it is asked where it came from.
    fn outward(&self, scattered: Vec3, media: &Media) -> Outward {
        let diffuse = self.facts().diffuse;
        if !diffuse[0] && !diffuse[1] {
            return Outward {
                scattered,
                back: [0.0; 2],
                chances: [0.0; 2],
            };
        }
        let back = self.shares(scattered, media).diffuse;
        // As much as would go there, if light went back as it comes, and a little of all where there is some at other angles.
        let least = f64::max(ANYWHERE * (back[0] + back[1]), f64::MIN_POSITIVE);
        Outward {
            scattered,
            back,
            chances: std::array::from_fn(|side| if diffuse[side] { back[side].max(least) } else { 0.0 }),
        }
    }

    /// A direction that light may have come from, on the side of `scattered` or on the other one.
    ///
    /// Where light would go that came from there, and now and then anywhere, for what does not go back as it came.
    #[inline]
    fn draw_incoming(&self, outward: &Outward, transmitted: bool, media: &Media, numbers: [f64; 2]) -> Vec3 {
        let [first, turn] = numbers;
        let chance = if self.facts().lambertian || outward.back[usize::from(transmitted)] <= 0.0 {
            1.0
        } else {
            ANYWHERE
        };
        let scattered = outward.scattered;
        if first < chance {
            return by_cosine((scattered.z > 0.0) != transmitted, [part_of(first, chance), turn]);
        }
        self.draw(
            scattered,
            transmitted,
            media,
            [part_of(first - chance, 1.0 - chance), turn],
        )
    }

    /// f \[1/sr\] for light from `incident`, and about the density \[1/sr\] of [`draw_incoming`](Bsdf::draw_incoming) on its side, by
    /// which directions towards sources are weighted against those that are drawn: any function does, where it is not 0.
    ///
    /// The density itself if light goes back as it comes; nearly that of tables, whose f need not be asked for twice.
    #[inline]
    fn incoming_light(&self, incident: Vec3, outward: &Outward, media: &Media) -> (f64, f64) {
        let f = self.evaluate(incident, outward.scattered, media);
        let about = if self.facts().lambertian {
            proposed(incident, 0.0, 0.0)
        } else {
            outward.as_if_reciprocal(incident, f, media)
        };
        (f, about)
    }

    /// f \[1/sr\] for light from `incident`, the density \[1/sr\] itself, and what
    /// [`incoming_light`](Bsdf::incoming_light) says about it.
    #[inline]
    fn drawn_light(&self, incident: Vec3, outward: &Outward, media: &Media) -> (f64, f64, f64) {
        let (f, about) = self.incoming_light(incident, outward, media);
        let (facts, share) = (self.facts(), outward.back_from(incident));
        let density = if facts.lambertian || facts.reciprocal || share <= 0.0 {
            about
        } else {
            proposed(incident, self.pdf(outward.scattered, incident, media), share)
        };
        (f, density, about)
    }
}

/// Light that leaves along a direction, of which it is asked where it came from.
#[derive(Clone, Copy, Debug)]
pub struct Outward {
    /// The direction.
    pub scattered: Vec3,
    /// Shares of diffuse light that came from there: back to the same side, and to the other one.
    pub back: [f64; 2],
    /// How much diffuse light may have come from the same side and from the other one, whatever its direction there: not 0 where
    /// there may be any.
    pub chances: [f64; 2],
}

impl Outward {
    /// The share of light that came from there, on the side of `incident`.
    #[inline]
    #[must_use]
    pub fn back_from(&self, incident: Vec3) -> f64 {
        self.back[usize::from((incident.z > 0.0) != (self.scattered.z > 0.0))]
    }

    /// The density of [`draw_incoming`](Bsdf::draw_incoming) at `incident` on its side, if light goes back as it comes: f over n² on
    /// the side where light leaves is the same there and back.
    #[inline]
    #[must_use]
    pub fn as_if_reciprocal(&self, incident: Vec3, f: f64, media: &Media) -> f64 {
        let [here, there] = media.seen_from(incident);
        let transmitted = (incident.z > 0.0) != (self.scattered.z > 0.0);
        let ratio = if transmitted { here / there } else { 1.0 };
        proposed(incident, f * ratio * ratio * incident.z.abs(), self.back_from(incident))
    }
}

/// The part of a BSDF that is a(incident) l(scattered)/π.
pub trait Product {
    /// a: the shares of light from `incident` that it scatters back, and to the other side.
    fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2];

    /// l: its luminance towards `scattered` over that of Lambertian light of the same flux on the same side; its mean over
    /// projected solid angle is 1.
    #[inline]
    fn leaving(&self, _scattered: Vec3, _media: &Media) -> f64 {
        1.0
    }

    /// Whether l is 1 in all directions.
    fn is_even(&self) -> bool {
        true
    }
}

/// The diffuse part of a BSDF, taken apart.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// The product.
    pub product: &'a dyn Product,
    /// The rest of the diffuse light, if there is any.
    pub rest: Option<&'a Arc<dyn Bsdf>>,
}

/// The part of the light of lobes that is looked for where nothing says that it comes from.
const ANYWHERE: f64 = 0.1;

/// Density \[1/sr\] of [`Bsdf::draw_incoming`] at `incident` on its side, where light that goes back as it came would have the
/// density `back` and this share; Lambert's where there is none.
#[inline]
#[must_use]
pub fn proposed(incident: Vec3, back: f64, share: f64) -> f64 {
    let any = incident.z.abs() * FRAC_1_PI;
    if share > 0.0 {
        ANYWHERE * any + (1.0 - ANYWHERE) * back / share
    } else {
        any
    }
}

/// What a BSDF is described by: values by name.
pub trait Parameters {
    /// A number.
    ///
    /// # Errors
    /// If there is none of that name.
    fn number(&self, key: &str) -> Result<f64, String>;

    /// A table of shares over angle and wavelength.
    ///
    /// # Errors
    /// If there is none of that name.
    fn table(&self, key: &str) -> Result<Table, String>;
}

/// A direction in front of a surface or behind it with density |cos θ|/π, from two numbers.
#[inline(always)]
#[must_use]
pub fn by_cosine(front: bool, [height, turn]: [f64; 2]) -> Vec3 {
    let cosine = (1.0 - height).sqrt();
    let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
    let (s, c) = sin_cos_turns(turn);
    Vec3::new(sine * c, sine * s, if front { cosine } else { -cosine })
}
