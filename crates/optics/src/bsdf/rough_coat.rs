//! A rough clear coat over a diffuse base: satin and matt paint.

use std::f64::consts::FRAC_1_PI;
use std::sync::{Arc, OnceLock};

use etendue_math::Vec3;
use etendue_sampling::more_numbers::MoreNumbers;
use etendue_sampling::warp::part_of;

use super::albedo::ByHeight;
use super::contract::{Bsdf, Facts, Media, Outward, Parameters, Parts, Product, by_cosine, proposed};
use super::rough_interface::{RoughFacets, above, from_side};
use super::shares::Shares;
use crate::table::Table;

/// A rough coat of a refractive index on a Lambertian base, from both sides alike.
///
/// One facet reflects the share R(θ); all other light gets in, and the base scatters the share ρ of it. Of that the coat lets
/// out what goes back as it came, so that the mean over diffuse light from within is (1 − R)/m², m being the index of the coat over
/// that outside and R the mean of R(θ): f = f₁ + (1 − R(θᵢ)) (1 − R(θₛ)) ρ/(π m² (1 − ρ Fᵢₙ)), with Fᵢₙ = 1 − (1 − R)/m², as
/// for a smooth coat `[Saunderson1942]`.
#[derive(Debug)]
pub struct RoughCoat {
    rough: Arc<RoughFacets>,
    index: f64,
    base: Table,
    /// The same on a black base; None if that is what it is.
    coat: Option<Arc<dyn Bsdf>>,
    /// R(θ) and its mean, seen from a medium of index 1; None if R depends on azimuth.
    usual: Arc<OnceLock<Option<(ByHeight, f64)>>>,
}

const FACTS: Facts = Facts {
    specular: [false; 2],
    diffuse: [true, false],
    lambertian: false,
    reciprocal: true,
    constant: None,
    fresnel: false,
};

impl RoughCoat {
    /// # Errors
    /// What is wrong with the roughness, the index or the base.
    pub fn new(alpha: [f64; 2], ggx: bool, index: f64, base: Table) -> Result<Self, String> {
        if !(index.is_finite() && index > 1.0) {
            return Err(format!("an index of {index}; it must be more than 1"));
        }
        if !Table::are_shares(std::slice::from_ref(&base)) || base.depends_on_angle() {
            return Err("a base whose reflectance is no share or depends on angle".into());
        }
        let rough = Arc::new(RoughFacets::new(alpha, ggx, false)?);
        let usual = Arc::default();
        let coat = (!base.is_zero()).then(|| {
            Arc::new(Self {
                rough: Arc::clone(&rough),
                index,
                base: Table::constant(0.0),
                coat: None,
                usual: Arc::clone(&usual),
            }) as Arc<dyn Bsdf>
        });
        Ok(Self {
            rough,
            index,
            base,
            coat,
            usual,
        })
    }

    /// From `alpha_x`, `alpha_y`, `ggx` (0 or 1), `index` and the table `base_reflectance`.
    ///
    /// # Errors
    /// As [`RoughCoat::new`].
    pub fn described(by: &dyn Parameters) -> Result<Arc<dyn Bsdf>, String> {
        let alpha = [by.number("alpha_x")?, by.number("alpha_y")?];
        let (ggx, base) = (by.number("ggx")? != 0.0, by.table("base_reflectance")?);
        Ok(Arc::new(Self::new(alpha, ggx, by.number("index")?, base)?))
    }

    /// The index of the coat over that outside.
    fn ratio(&self, incident: Vec3, media: &Media) -> f64 {
        self.index / media.seen_from(incident)[0]
    }

    /// R(θ) and its mean, if they are tabled for this ratio.
    fn usual(&self, ratio: f64) -> Option<&(ByHeight, f64)> {
        let usual = (ratio == self.index).then(|| self.usual.get_or_init(|| self.rough.reflected_once(ratio)));
        usual.and_then(Option::as_ref)
    }

    /// R(θ).
    fn mirrored(&self, direction: Vec3, ratio: f64) -> f64 {
        match self.usual(ratio) {
            Some((table, _)) => table.at(direction),
            None => self.rough.once(direction, ratio)[0].clamp(0.0, 1.0),
        }
    }

    /// Of light within the coat on its way to the base: the share that leaves it at last, and 1 − R.
    fn leaves(&self, ratio: f64, wavelength: f64) -> [f64; 2] {
        let mean = self
            .usual(ratio)
            .map_or_else(|| self.rough.once_of_diffuse(ratio)[0], |(_, mean)| *mean);
        let let_in = 1.0 - mean;
        let (rho, out) = (self.base.at(1.0, wavelength), let_in / (ratio * ratio));
        // Nothing of lower index than the surroundings lets out more than all.
        let out = out.min(1.0);
        [rho * out / (1.0 - rho * (1.0 - out)), let_in]
    }
}

/// How often is tried again for a direction that the coat lets out.
const TRIES: u32 = 10_000;

impl Bsdf for RoughCoat {
    fn facts(&self) -> &Facts {
        &FACTS
    }

    fn is_selective(&self) -> bool {
        self.base.depends_on_wavelength()
    }

    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let ratio = self.ratio(incident, media);
        let mirrored = self.mirrored(incident, ratio);
        Shares {
            specular: [0.0; 2],
            diffuse: [
                mirrored + (1.0 - mirrored) * self.leaves(ratio, media.wavelength)[0],
                0.0,
            ],
            refraction: incident.z.abs(),
        }
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        let front = incident.z > 0.0;
        if front != (scattered.z > 0.0) {
            return 0.0;
        }
        let ratio = self.ratio(incident, media);
        let coat = self
            .rough
            .reflected(above(front, incident), above(front, scattered), ratio);
        if self.coat.is_none() {
            return coat;
        }
        let [there, back] = [incident, scattered].map(|d| 1.0 - self.mirrored(d, ratio));
        let [leaves, let_in] = self.leaves(ratio, media.wavelength);
        coat + there * back * FRAC_1_PI * leaves / let_in
    }

    /// As any BSDF does, but what the coat does to the direction of the line of sight is looked up once.
    fn incoming_light(&self, incident: Vec3, outward: &Outward, media: &Media) -> (f64, f64) {
        let (front, scattered) = (incident.z > 0.0, outward.scattered);
        if front != (scattered.z > 0.0) {
            return (0.0, proposed(incident, 0.0, 0.0));
        }
        let ratio = self.ratio(incident, media);
        let [there, back] = [incident, scattered].map(|d| self.mirrored(d, ratio));
        let [leaves, let_in] = self.leaves(ratio, media.wavelength);
        let coat = self
            .rough
            .reflected(above(front, incident), above(front, scattered), ratio);
        let f = coat + (1.0 - there) * (1.0 - back) * FRAC_1_PI * leaves / let_in;
        let density = proposed(incident, f * incident.z.abs(), back + (1.0 - back) * leaves);
        (f, density)
    }

    fn parts(&self) -> Option<Parts<'_>> {
        self.coat.as_ref().map(|coat| Parts {
            product: self,
            rest: Some(coat),
        })
    }

    fn draw(&self, incident: Vec3, _transmitted: bool, media: &Media, numbers: [f64; 2]) -> Vec3 {
        let front = incident.z > 0.0;
        let ratio = self.ratio(incident, media);
        let mirrored = self.mirrored(incident, ratio);
        let base = (1.0 - mirrored) * self.leaves(ratio, media.wavelength)[0];
        let chance = mirrored / (mirrored + base).max(f64::MIN_POSITIVE);
        let mut more = MoreNumbers::new(numbers);
        let [number, turn] = numbers;
        if number < chance {
            let first = [part_of(number, chance), turn];
            if let Some(d) = self.rough.draw(above(front, incident), false, ratio, first, &mut more) {
                return from_side(front, d);
            }
        }
        let mut pair = [part_of((number - chance).max(0.0), 1.0 - chance), turn];
        for _ in 0..TRIES {
            let d = by_cosine(front, pair);
            if d.z != 0.0 && more.draw() >= self.mirrored(d, ratio) {
                return d;
            }
            pair = more.pair();
        }
        by_cosine(front, numbers)
    }
}

impl Product for RoughCoat {
    fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2] {
        let ratio = self.ratio(incident, media);
        let let_in = 1.0 - self.mirrored(incident, ratio);
        [let_in * self.leaves(ratio, media.wavelength)[0], 0.0]
    }

    fn leaving(&self, scattered: Vec3, media: &Media) -> f64 {
        let ratio = self.ratio(scattered, media);
        (1.0 - self.mirrored(scattered, ratio)) / self.leaves(ratio, media.wavelength)[1]
    }

    fn is_even(&self) -> bool {
        false
    }
}

#[cfg(test)]
impl super::examples::Examples for RoughCoat {
    const MEDIA: bool = true;

    fn examples() -> Vec<Self> {
        [([0.5, 0.5], 2.4, 0.0), ([0.7, 0.4], 1.8, 1.0)]
            .map(|(alpha, index, base)| Self::new(alpha, true, index, Table::constant(base)).expect("sound"))
            .into()
    }

    // Grazing facets.
    const QUADRATURE: f64 = 1e-3;
}

#[cfg(test)]
mod tests {
    use super::*;

    const AIR: Media = Media {
        wavelength: 555.0,
        front: 1.0,
        back: 1.0,
    };

    #[test]
    fn a_hardly_rough_coat_is_a_smooth_one_and_white_under_it_loses_nothing() {
        for rho in [1.0, 0.6] {
            let base = || Table::constant(rho);
            let rough = RoughCoat::new([1e-3, 1e-3], true, 1.5, base()).expect("sound");
            let smooth = super::super::coated::Coated::new(1.5, base()).expect("sound");
            for height in [1.0_f64, 0.7, 0.3] {
                let incident = Vec3::new((1.0 - height * height).sqrt(), 0.0, height);
                let [a, b] = [
                    rough.shares(incident, &AIR).total(),
                    smooth.shares(incident, &AIR).total(),
                ];
                assert!((a - b).abs() < 2e-4, "{rho} {height}: {a} {b}");
                assert!(rho < 1.0 || (a - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn the_table_for_an_index_of_1_is_that_of_any_index() {
        let of = |index| RoughCoat::new([0.3, 0.3], true, index, Table::constant(0.7)).expect("sound");
        let (air, twofold) = (of(1.5), of(3.0));
        let twice = Media {
            front: 2.0,
            back: 2.0,
            ..AIR
        };
        let d = |z: f64, x: f64| Vec3::new(x, (1.0 - z * z - x * x).sqrt(), z);
        for (incident, scattered) in [(d(0.8, 0.1), d(0.3, -0.7)), (d(-0.05, 0.9), d(-0.6, 0.2))] {
            let a = air.evaluate(incident, scattered, &AIR);
            let b = twofold.evaluate(incident, scattered, &twice);
            assert!((a - b).abs() < 1e-6 && a > 0.0, "{a} {b}");
            let [a, b] = [
                air.shares(incident, &AIR).diffuse[0],
                twofold.shares(incident, &twice).diffuse[0],
            ];
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }

    #[test]
    fn impossible_coats_are_refused() {
        let of = |alpha, index, base| RoughCoat::new([alpha, alpha], true, index, Table::constant(base));
        assert!(of(0.0, 1.5, 0.5).is_err());
        assert!(of(0.1, 1.0, 0.5).is_err());
        assert!(of(0.1, 1.5, 1.5).is_err());
    }
}
