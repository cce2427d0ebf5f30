//! A rough interface of two transparent media, and a rough coat over a diffuse base.
//!
//! Light that is neither reflected nor refracted once by facets that both directions see meets more of them. It leaves at
//! last, to both sides in proportion to n² as if it had met many: f = nₛ² (1 − E(θᵢ)) (1 − E(θₛ))/S, E being the share of what leaves
//! after one facet, and S = n₁² ∫ (1 − E₁) cos θ dΩ + n₂² ∫ (1 − E₂) cos θ dΩ, so that nothing is lost and light goes back as it came
//! (after `[Kulla2017]`, who have reflection alone).

use std::f64::consts::PI;
use std::sync::{Arc, OnceLock};

use etendue_math::Vec3;
use etendue_math::special::exp;
use etendue_math::special::ln;
use etendue_sampling::more_numbers::MoreNumbers;
use etendue_sampling::warp::part_of;

use super::albedo::{Albedo, ByHeight, LOWEST};
use super::contract::{Bsdf, Facts, Media, Parameters, by_cosine};
use super::facet_lattice::{FacetLattice, mirrored, refracted};
use super::facets::Facets;
use super::shares::Shares;
use crate::fresnel::fresnel;

/// Steps of the logarithm of the ratio of indices for which shares are tabled, linear in between, and the largest logarithm.
const STEP: f64 = 1.0 / 512.0;
const STEPS: usize = 768;

/// A direction as seen from the side of the light, whose normal is +z there.
pub fn from_side(front: bool, d: Vec3) -> Vec3 {
    if front { d } else { Vec3::new(d.x, d.y, -d.z) }
}

/// What facets of a rough interface do to light that meets one of them.
#[derive(Debug)]
pub struct RoughFacets {
    facets: Facets,
    /// Whether it is asked what passes; else nothing does.
    through: bool,
    /// By the ratio of the index on the other side to that on the side of the light.
    tables: Vec<OnceLock<Known>>,
}

/// At one ratio of indices.
#[derive(Debug)]
struct Known {
    /// Reflected and transmitted.
    albedo: Albedo<2>,
    /// Of diffuse light.
    means: [f64; 2],
    /// ∫ (1 − E) cos θ dΩ.
    missing: f64,
    /// The largest 1 − E.
    most: f64,
}

impl RoughFacets {
    /// # Errors
    /// If a roughness is out of range.
    pub fn new(alpha: [f64; 2], ggx: bool, through: bool) -> Result<Self, String> {
        Ok(Self {
            facets: Facets::new(alpha, ggx)?,
            through,
            tables: (0..=2 * STEPS).map(|_| OnceLock::new()).collect(),
        })
    }

    /// What a facet mirrors, or sends to the other side, for light that it meets in an index of 1.
    fn one_way(facets: &Facets, i: Vec3, h: Vec3, more: f64, ratio: f64, through: bool) -> f64 {
        let cosine = i.dot(h);
        let f = fresnel(cosine, 1.0, ratio);
        if !through {
            let o = mirrored(i, h);
            if o.z <= 0.0 {
                return 0.0;
            }
            let hidden = [facets.hidden(i), facets.hidden(o)];
            return f.reflectance * more * o.z * Facets::seen_by_both(i.z, o.z, hidden);
        }
        if f.reflectance >= 1.0 {
            return 0.0;
        }
        let o = refracted(i, h, cosine, f.cosine, ratio);
        if o.z >= 0.0 {
            return 0.0;
        }
        let up = Vec3::new(o.x, o.y, -o.z);
        let seen = Facets::seen_through(i.z, up.z, [facets.hidden(i), facets.hidden(up)]);
        (1.0 - f.reflectance) * more * seen / i.z
    }

    fn known(&self, step: usize) -> &Known {
        self.tables[step].get_or_init(|| {
            let ratio = exp((step as f64 - STEPS as f64) * STEP);
            let lattice = FacetLattice::new(self.facets);
            let albedo = Albedo::new(self.facets.turns(), |d| {
                let shares = lattice.reflected_and_transmitted(above(true, d), ratio, self.through);
                // The quadrature may find more than 1 by its error.
                let scale = 1.0 / f64::max(1.0, shares[0] + shares[1]);
                shares.map(|share| share * scale)
            });
            let means = albedo.means();
            let most = 1.0 - albedo.least(|[r, t]| r + t);
            Known {
                missing: PI * (1.0 - means[0] - means[1]).max(0.0),
                most: most.max(0.0),
                albedo,
                means,
            }
        })
    }

    /// A mean over the tables of the two nearest ratios.
    fn at<const N: usize>(&self, ratio: f64, of: impl Fn(&Known) -> [f64; N]) -> [f64; N] {
        let place = (ln(ratio) / STEP + STEPS as f64).clamp(0.0, (2 * STEPS) as f64);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let cell = (place as usize).min(2 * STEPS - 1);
        let t = place - cell as f64;
        let a = of(self.known(cell));
        if t == 0.0 {
            return a;
        }
        let b = of(self.known(cell + 1));
        std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
    }

    /// The share that is reflected by one facet, tabled for one ratio, and its mean over diffuse light; None if it depends on
    /// azimuth.
    pub fn reflected_once(&self, ratio: f64) -> Option<(ByHeight, f64)> {
        let at = |z: f64| self.once(Vec3::new((1.0 - z * z).max(0.0).sqrt(), 0.0, z), ratio)[0];
        let table = || ByHeight::new(|z| at(z).clamp(0.0, 1.0));
        (!self.facets.turns()).then(|| (table(), self.once_of_diffuse(ratio)[0]))
    }

    /// Shares that are reflected and transmitted by one facet.
    pub fn once(&self, incident: Vec3, ratio: f64) -> [f64; 2] {
        self.at(ratio, |known| known.albedo.at(incident))
    }

    /// The mean of [`once`](RoughFacets::once) over diffuse light.
    pub fn once_of_diffuse(&self, ratio: f64) -> [f64; 2] {
        self.at(ratio, |known| known.means)
    }

    /// ∫ (1 − E) cos θ dΩ, and the most of 1 − E.
    fn missing(&self, ratio: f64) -> [f64; 2] {
        self.at(ratio, |known| [known.missing, known.most])
    }

    /// f of light that is mirrored by one facet; both directions are above the surface, on the side of the lower number.
    pub fn reflected(&self, i: Vec3, o: Vec3, ratio: f64) -> f64 {
        let sum = i + o;
        let h = sum * sum.length().recip();
        let (facets, f) = (&self.facets, fresnel(i.dot(h).max(0.0), 1.0, ratio).reflectance);
        let hidden = [facets.hidden(i), facets.hidden(o)];
        0.25 * f * facets.density(h) * Facets::seen_by_both(i.z, o.z, hidden)
    }

    /// f of light that is refracted by one facet; `o` is below.
    fn transmitted(&self, i: Vec3, o: Vec3, ratio: f64) -> f64 {
        let sum = i + o * ratio;
        let h = sum * sum.length().copysign(sum.z).recip();
        let (from, to) = (i.dot(h), o.dot(h));
        if from <= 0.0 || to >= 0.0 {
            return 0.0;
        }
        let facets = &self.facets;
        let up = Vec3::new(o.x, o.y, -o.z);
        let seen = Facets::seen_through(i.z, up.z, [facets.hidden(i), facets.hidden(up)]);
        let f = fresnel(from, 1.0, ratio).reflectance;
        let bottom = from + ratio * to;
        (1.0 - f) * facets.density(h) * seen * from * -to * ratio * ratio / (i.z * up.z * bottom * bottom)
    }

    /// A direction of light that one facet mirrors or refracts, from the first pair of numbers and more; None if there is
    /// hardly any.
    pub fn draw(&self, i: Vec3, through: bool, ratio: f64, first: [f64; 2], more: &mut MoreNumbers) -> Option<Vec3> {
        let mut pair = first;
        for _ in 0..TRIES {
            let drawn = self.facets.draw(i, pair);
            let (h, chance) = (drawn.h, more.draw());
            // The cheapest first: no more is mirrored than Fresnel's part.
            let cosine = i.dot(h);
            if cosine > 0.0
                && (through || chance < fresnel(cosine, 1.0, ratio).reflectance)
                && chance * drawn.most < Self::one_way(&self.facets, i, h, drawn.more, ratio, through)
            {
                return Some(if through {
                    refracted(i, h, cosine, fresnel(cosine, 1.0, ratio).cosine, ratio)
                } else {
                    mirrored(i, h)
                });
            }
            pair = more.pair();
        }
        None
    }
}

/// How often is tried again for a facet that sends light away.
const TRIES: u32 = 1_000_000;

/// From above, and not along the surface.
pub fn above(front: bool, d: Vec3) -> Vec3 {
    let d = from_side(front, d);
    if d.z >= LOWEST {
        d
    } else {
        Vec3::new(d.x, d.y, LOWEST).normalized()
    }
}

/// A rough interface of the media on both sides, which loses nothing.
#[derive(Debug)]
pub struct RoughInterface {
    rough: RoughFacets,
}

const FACTS: Facts = Facts {
    // Straight on between equal media.
    specular: [false, true],
    diffuse: [true; 2],
    lambertian: false,
    reciprocal: true,
    constant: None,
    fresnel: false,
};

impl RoughInterface {
    /// # Errors
    /// If a roughness is out of range.
    pub fn new(alpha: [f64; 2], ggx: bool) -> Result<Self, String> {
        Ok(Self {
            rough: RoughFacets::new(alpha, ggx, true)?,
        })
    }

    /// From `alpha_x`, `alpha_y` and `ggx` (0 or 1).
    ///
    /// # Errors
    /// As [`RoughInterface::new`].
    pub fn described(by: &dyn Parameters) -> Result<Arc<dyn Bsdf>, String> {
        let alpha = [by.number("alpha_x")?, by.number("alpha_y")?];
        Ok(Arc::new(Self::new(alpha, by.number("ggx")? != 0.0)?))
    }

    /// Of light that meets several facets: shares of the two sides, and what f is beside both 1 − E and nₛ².
    fn often(&self, incident: Vec3, ratio: f64, once: [f64; 2]) -> ([f64; 2], f64) {
        let ([here, _], [there, _]) = (self.rough.missing(ratio), self.rough.missing(1.0 / ratio));
        let all = here + ratio * ratio * there;
        let missing = (1.0 - once[0] - once[1]).max(0.0);
        debug_assert!(incident.z != 0.0);
        if all <= 0.0 {
            return ([missing, 0.0], 0.0);
        }
        let back = here / all;
        ([missing * back, missing * (1.0 - back)], 1.0 / all)
    }
}

impl Bsdf for RoughInterface {
    fn facts(&self) -> &Facts {
        &FACTS
    }

    fn is_selective(&self) -> bool {
        false
    }

    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let [n1, n2] = media.seen_from(incident);
        if n1 == n2 {
            return Shares {
                specular: [0.0, 1.0],
                diffuse: [0.0; 2],
                refraction: incident.z.abs(),
            };
        }
        let ratio = n2 / n1;
        let once = self.rough.once(incident, ratio);
        let (often, _) = self.often(incident, ratio, once);
        Shares {
            specular: [0.0; 2],
            diffuse: [once[0] + often[0], once[1] + often[1]],
            refraction: incident.z.abs(),
        }
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        let [n1, n2] = media.seen_from(incident);
        if n1 == n2 {
            return 0.0;
        }
        let (ratio, front) = (n2 / n1, incident.z > 0.0);
        let through = front != (scattered.z > 0.0);
        let (i, up) = (above(front, incident), above(front != through, scattered));
        let (f, own, ratio_there) = if through {
            let o = Vec3::new(up.x, up.y, -up.z);
            (self.rough.transmitted(i, o, ratio), ratio * ratio, 1.0 / ratio)
        } else {
            (self.rough.reflected(i, up, ratio), 1.0, ratio)
        };
        let once = self.rough.once(incident, ratio);
        let back = self.rough.once(scattered, ratio_there);
        let (_, scale) = self.often(incident, ratio, once);
        let [here, there] = [once, back].map(|[r, t]| (1.0 - r - t).max(0.0));
        f + own * here * there * scale
    }

    fn draw(&self, incident: Vec3, transmitted: bool, media: &Media, numbers: [f64; 2]) -> Vec3 {
        let [n1, n2] = media.seen_from(incident);
        let (ratio, front) = (n2 / n1, incident.z > 0.0);
        let side = front != transmitted;
        let once = self.rough.once(incident, ratio);
        let (often, _) = self.often(incident, ratio, once);
        let k = usize::from(transmitted);
        let chance = once[k] / (once[k] + often[k]).max(f64::MIN_POSITIVE);
        let mut more = MoreNumbers::new(numbers);
        let [number, turn] = numbers;
        if number < chance {
            let first = [part_of(number, chance), turn];
            let found = self
                .rough
                .draw(above(front, incident), transmitted, ratio, first, &mut more);
            if let Some(d) = found {
                return from_side(front, d);
            }
        }
        let there = if transmitted { 1.0 / ratio } else { ratio };
        let [_, most] = self.rough.missing(there);
        let mut pair = [part_of((number - chance).max(0.0), 1.0 - chance), turn];
        for _ in 0..TRIES {
            let d = by_cosine(side, pair);
            let [r, t] = self.rough.once(d, there);
            if more.draw() * most < 1.0 - r - t && d.z != 0.0 {
                return d;
            }
            pair = more.pair();
        }
        by_cosine(side, numbers)
    }

    fn is_nothing(&self, media: &Media) -> bool {
        media.front == media.back
    }
}

#[cfg(test)]
impl super::examples::Examples for RoughInterface {
    const MEDIA: bool = true;

    fn examples() -> Vec<Self> {
        [([0.6, 0.6], true), ([0.5, 0.5], false), ([0.9, 0.6], true)]
            .map(|(alpha, ggx)| Self::new(alpha, ggx).expect("sound"))
            .into()
    }

    // To which the lattice of the tests does edges of total reflection.
    const QUADRATURE: f64 = 3e-3;
    const LATTICE: bool = true;
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: Media = Media {
        wavelength: 555.0,
        front: 1.0,
        back: 1.5,
    };

    /// ∫ f cos θ dΩ over one side, by a lattice in direction cosines, where it is ∫ f dA.
    fn whole(bsdf: &RoughInterface, incident: Vec3, front: bool) -> f64 {
        let (n, step) = (317_811_u32, 196_418_u32);
        let each = (0..n).map(|k| {
            let u = (f64::from(k) + 0.5) / f64::from(n);
            let turn = (f64::from(k) * f64::from(step) / f64::from(n)).fract();
            let d = by_cosine(front, [u * u * (3.0 - 2.0 * u), turn]);
            bsdf.evaluate(incident, d, &GLASS) * 6.0 * u * (1.0 - u)
        });
        each.sum::<f64>() * PI / f64::from(n)
    }

    #[test]
    fn rough_glass_loses_nothing_and_its_shares_are_the_integrals() {
        for (alpha, ggx) in [([0.3, 0.3], true), ([0.3, 0.3], false), ([0.6, 0.3], true)] {
            let bsdf = RoughInterface::new(alpha, ggx).expect("sound");
            for height in [1.0_f64, -0.9, 0.5, -0.4, 0.1] {
                let across = (1.0 - height * height).sqrt();
                let incident = Vec3::new(0.6 * across, -0.8 * across, height);
                let shares = bsdf.shares(incident, &GLASS);
                assert!((shares.total() - 1.0).abs() < 1e-12);
                for through in [false, true] {
                    let found = whole(&bsdf, incident, (height > 0.0) != through);
                    let stated = shares.diffuse[usize::from(through)];
                    // Where azimuth matters the tables are coarser.
                    let known = if alpha[0] == alpha[1] { 1e-4 } else { 3e-4 };
                    assert!(
                        (found - stated).abs() < known,
                        "{alpha:?} {ggx} {height} {through}: {found} {stated}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_hardly_rough_interface_has_the_shares_of_a_smooth_one() {
        let bsdf = RoughInterface::new([1e-3, 1e-3], true).expect("sound");
        for height in [1.0_f64, 0.5, -0.9, -0.3] {
            let shares = bsdf.shares(Vec3::new((1.0 - height * height).sqrt(), 0.0, height), &GLASS);
            let [n1, n2] = GLASS.seen_from(Vec3::new(0.0, 0.0, height));
            let smooth = fresnel(height.abs(), n1, n2).reflectance;
            assert!(
                (shares.diffuse[0] - smooth).abs() < 2e-4,
                "{height}: {shares:?} {smooth}"
            );
        }
    }
}
