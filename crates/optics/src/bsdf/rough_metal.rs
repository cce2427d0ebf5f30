//! A rough surface that reflects what a smooth one would at each of its facets: a metal.
//!
//! Light that is not reflected once by facets that both directions see meets more of them. What leaves at last is
//! f = (1 − E(θᵢ)) (1 − E(θₛ))/(π (1 − E)) · F² E/(1 − F (1 − E)), E(θ) being the share that a perfect reflector sends back
//! after one facet, E its mean over diffuse light and F the mean reflectance `[Kulla2017]`: nothing is lost by a perfect one.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};
use std::sync::Arc;

use etendue_math::Vec3;
use etendue_sampling::more_numbers::MoreNumbers;
use etendue_sampling::warp::part_of;

use super::albedo::{Albedo, at_nodes};
use super::contract::{Bsdf, Facts, Media, Parameters, by_cosine};
use super::facet_lattice::{FacetLattice, mirrored};
use super::facets::Facets;
use super::rough_interface::{above, from_side};
use super::shares::Shares;
use crate::table::Table;

/// A rough metal, from both sides alike.
#[derive(Debug)]
pub struct RoughMetal {
    facets: Facets,
    /// Of a smooth surface, by the angle of incidence.
    reflectance: Table,
    /// Of a perfect reflector after one facet.
    perfect: Albedo<1>,
    perfect_mean: f64,
    /// The largest 1 − E of a perfect reflector.
    most: f64,
    /// Wavelengths \[nm\], and what leaves after one facet at each, and the mean reflectance.
    wavelengths: Vec<f64>,
    once: Vec<(Albedo<1>, f64)>,
    facts: Facts,
}

impl RoughMetal {
    /// # Errors
    /// If a roughness is out of range or the reflectance is no share.
    pub fn new(alpha: [f64; 2], ggx: bool, reflectance: Table) -> Result<Self, String> {
        let facets = Facets::new(alpha, ggx)?;
        if !Table::are_shares(std::slice::from_ref(&reflectance)) {
            return Err("a reflectance that is not from 0 to 1".into());
        }
        let lattice = FacetLattice::new(facets);
        let [_, wavelengths] = Table::breakpoints(std::slice::from_ref(&reflectance));
        // A perfect reflector first, then the metal at each wavelength.
        let shares = at_nodes(facets.turns(), |d| {
            let (mut cosines, mut facet_shares) = (Vec::new(), Vec::new());
            lattice.mirrors(above(true, d), &mut cosines, &mut facet_shares);
            let mut sums = vec![0.0; 1 + wavelengths.len()];
            for (cosine, share) in cosines.iter().zip(&facet_shares).filter(|(_, share)| **share > 0.0) {
                let (perfect, metal) = sums.split_at_mut(1);
                perfect[0] += share;
                reflectance.add_all(cosine.min(1.0), *share, metal);
            }
            // The quadrature may find more than 1 by its error.
            sums.into_iter().map(|sum| sum.min(1.0)).collect::<Vec<_>>()
        });
        let albedo = |k: usize| {
            let row = |row: &Vec<Vec<f64>>| row.iter().map(|sums| [sums[k]]).collect();
            Albedo::from_nodes(shares.iter().map(row).collect())
        };
        let perfect = albedo(0);
        let metal = wavelengths.iter().zip(1..);
        let once = metal.map(|(w, k)| (albedo(k), mean_of(&|cosine: f64| reflectance.at(cosine.min(1.0), *w))));
        let once = once.collect();
        Ok(Self {
            facets,
            perfect_mean: perfect.means()[0],
            most: 1.0 - perfect.least(|share| share[0]),
            perfect,
            facts: Facts {
                specular: [false; 2],
                diffuse: [!reflectance.is_zero(), false],
                lambertian: reflectance.is_zero(),
                reciprocal: true,
                constant: None,
                fresnel: false,
            },
            reflectance,
            wavelengths,
            once,
        })
    }

    /// From `alpha_x`, `alpha_y`, `ggx` (0 or 1) and the table `reflectance`.
    ///
    /// # Errors
    /// As [`RoughMetal::new`].
    pub fn described(by: &dyn Parameters) -> Result<Arc<dyn Bsdf>, String> {
        let alpha = [by.number("alpha_x")?, by.number("alpha_y")?];
        let ggx = by.number("ggx")? != 0.0;
        Ok(Arc::new(Self::new(alpha, ggx, by.table("reflectance")?)?))
    }

    /// What leaves after one facet, and the mean reflectance.
    fn once(&self, incident: Vec3, wavelength: f64) -> [f64; 2] {
        let last = self.wavelengths.len() - 1;
        let above = self.wavelengths.partition_point(|w| *w <= wavelength);
        let of = |k: usize| [self.once[k].0.at(incident)[0], self.once[k].1];
        if above == 0 || above > last {
            return of(above.min(last));
        }
        let [low, high] = [self.wavelengths[above - 1], self.wavelengths[above]];
        let t = (wavelength - low) / (high - low);
        let (a, b) = (of(above - 1), of(above));
        [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
    }

    /// Of what meets more than one facet: the part that leaves at last.
    fn kept(&self, mean: f64) -> f64 {
        let e = self.perfect_mean;
        mean * mean * e / (1.0 - mean * (1.0 - e))
    }
}

/// 2 ∫ F cos θ sin θ dθ, in parts of 0.1°.
fn mean_of(at: &dyn Fn(f64) -> f64) -> f64 {
    let n = 900;
    let each = (0..n).map(|k| {
        let theta = (f64::from(k) + 0.5) / f64::from(n) * FRAC_PI_2;
        at(theta.cos()) * (2.0 * theta).sin()
    });
    each.sum::<f64>() * FRAC_PI_2 / f64::from(n)
}

/// How often is tried again for a facet that sends light away.
const TRIES: u32 = 10_000;

impl Bsdf for RoughMetal {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn is_selective(&self) -> bool {
        self.reflectance.depends_on_wavelength()
    }

    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let [once, mean] = self.once(incident, media.wavelength);
        let missing = 1.0 - self.perfect.at(incident)[0];
        Shares {
            specular: [0.0; 2],
            diffuse: [(once + missing.max(0.0) * self.kept(mean)).min(1.0), 0.0],
            refraction: incident.z.abs(),
        }
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        let front = incident.z > 0.0;
        if front != (scattered.z > 0.0) {
            return 0.0;
        }
        let (i, o) = (above(front, incident), above(front, scattered));
        let sum = i + o;
        let h = sum * sum.length().recip();
        let f = self.reflectance.at(i.dot(h).clamp(0.0, 1.0), media.wavelength);
        let hidden = [self.facets.hidden(i), self.facets.hidden(o)];
        let once = 0.25 * f * self.facets.density(h) * Facets::seen_by_both(i.z, o.z, hidden);
        if self.perfect_mean >= 1.0 {
            return once;
        }
        let [_, mean] = self.once(incident, media.wavelength);
        let [here, there] = [incident, scattered].map(|d| (1.0 - self.perfect.at(d)[0]).max(0.0));
        once + here * there * FRAC_1_PI / (1.0 - self.perfect_mean) * self.kept(mean)
    }

    fn draw(&self, incident: Vec3, _transmitted: bool, media: &Media, numbers: [f64; 2]) -> Vec3 {
        let front = incident.z > 0.0;
        let i = above(front, incident);
        let [once, mean] = self.once(incident, media.wavelength);
        let often = (1.0 - self.perfect.at(incident)[0]).max(0.0) * self.kept(mean);
        let chance = once / (once + often).max(f64::MIN_POSITIVE);
        let mut more = MoreNumbers::new(numbers);
        let [number, turn] = numbers;
        if number < chance {
            let hidden = self.facets.hidden(i);
            let mut pair = [part_of(number, chance), turn];
            for _ in 0..TRIES {
                let drawn = self.facets.draw(i, pair);
                let o = mirrored(i, drawn.h);
                if i.dot(drawn.h) > 0.0 && o.z > 0.0 {
                    let f = self.reflectance.at(i.dot(drawn.h).min(1.0), media.wavelength);
                    let seen = Facets::seen_by_both(i.z, o.z, [hidden, self.facets.hidden(o)]);
                    if more.draw() * drawn.most < f * drawn.more * o.z * seen {
                        return from_side(front, o);
                    }
                }
                pair = more.pair();
            }
        }
        let mut pair = [part_of((number - chance).max(0.0), 1.0 - chance), turn];
        for _ in 0..TRIES {
            let d = by_cosine(front, pair);
            if more.draw() * self.most < 1.0 - self.perfect.at(d)[0] && d.z != 0.0 {
                return d;
            }
            pair = more.pair();
        }
        by_cosine(front, numbers)
    }
}

#[cfg(test)]
impl super::examples::Examples for RoughMetal {
    fn examples() -> Vec<Self> {
        let rising = Table::new(
            vec![0.0, 1.2, FRAC_PI_2],
            vec![450.0, 650.0],
            vec![0.8, 0.9, 0.7, 0.85, 1.0, 1.0],
        );
        [
            ([0.5, 0.5], true, Table::constant(1.0)),
            ([0.5, 0.5], false, Table::constant(0.7)),
            ([0.8, 0.4], true, rising.expect("sound")),
        ]
        .map(|(alpha, ggx, table)| Self::new(alpha, ggx, table).expect("sound"))
        .into()
    }

    // The edges of hidden facets at grazing incidence, and kinks of tables.
    const QUADRATURE: f64 = 5e-4;
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
    fn a_perfect_reflector_loses_nothing_however_rough() {
        for (alpha, ggx) in [(0.05, true), (0.3, true), (1.0, true), (0.3, false), (1.0, false)] {
            let bsdf = RoughMetal::new([alpha, alpha], ggx, Table::constant(1.0)).expect("sound");
            for height in [1.0_f64, 0.6, 0.2, 0.02] {
                let incident = Vec3::new((1.0 - height * height).sqrt(), 0.0, height);
                assert!((bsdf.shares(incident, &AIR).total() - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_smooth_metal_has_the_reflectance_of_its_table() {
        // But for the mean slope of its facets, of which GGX has some steep ones.
        let table = Table::new(vec![0.0, 1.0], vec![555.0], vec![0.9, 0.5]).expect("sound");
        let bsdf = RoughMetal::new([1e-3, 1e-3], true, table.clone()).expect("sound");
        for height in [1.0_f64, 0.9, 0.7] {
            let found = bsdf
                .shares(Vec3::new((1.0 - height * height).sqrt(), 0.0, height), &AIR)
                .diffuse[0];
            assert!((found - table.at(height, 555.0)).abs() < 1e-3, "{height}: {found}");
        }
    }

    #[test]
    fn shares_that_are_none_are_refused() {
        assert!(RoughMetal::new([0.1, 0.1], true, Table::constant(1.1)).is_err());
    }
}
