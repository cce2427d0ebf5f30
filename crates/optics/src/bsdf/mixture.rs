//! Several BSDFs at once, each with its part: diffuse + specular paint, a coat with holes.

use std::sync::{Arc, OnceLock};

use etendue_math::Vec3;
use etendue_sampling::warp::part_of;

use super::contract::{Bsdf, Facts, Media, Outward, Parameters, Parts, Product};
use super::lambertian::Lambertian;
use super::mirror::Mirror;
use super::shares::Shares;
use crate::table::Table;

/// A sum of BSDFs, each times a weight.
#[derive(Clone, Debug)]
pub struct Mixture {
    members: Vec<(f64, Arc<dyn Bsdf>)>,
    facts: Facts,
    apart: OnceLock<Apart>,
}

/// A mixture taken apart: found when somebody asks, since members may have to look for their parts.
#[derive(Clone, Debug)]
struct Apart {
    /// Numbers of the members whose products are taken together; and what scatters light beside them, if anything does.
    products: Vec<usize>,
    rest: Option<Arc<dyn Bsdf>>,
}

/// What shares may exceed 1 by, for rounding.
const SLACK: f64 = 1e-9;

/// The same for shares that come from quadratures.
const CLOSE: f64 = 1e-5;

/// Azimuths at which shares are looked at.
const AROUND: [(f64, f64); 5] = [(1.0, 0.0), (0.8, 0.6), (0.0, 1.0), (-0.96, 0.28), (-0.6, -0.8)];

impl Mixture {
    /// None if a weight is negative or not finite, or if more light may leave than arrives.
    #[must_use]
    pub fn new(members: Vec<(f64, Arc<dyn Bsdf>)>) -> Option<Self> {
        if !members.iter().all(|(weight, _)| *weight >= 0.0 && weight.is_finite()) {
            return None;
        }
        let mixture = Self::of(members);
        mixture.is_sound().then_some(mixture)
    }

    fn of(members: Vec<(f64, Arc<dyn Bsdf>)>) -> Self {
        let each: Vec<(f64, Facts)> = members.iter().map(|(weight, bsdf)| (*weight, *bsdf.facts())).collect();
        let any = |pick: fn(&Facts) -> [bool; 2]| {
            std::array::from_fn(|side| each.iter().any(|(weight, facts)| *weight > 0.0 && pick(facts)[side]))
        };
        let constant = each.iter().try_fold([0.0; 4], |mut sum, (weight, facts)| {
            for (sum, share) in sum.iter_mut().zip(facts.constant?) {
                *sum += weight * share;
            }
            Some(sum)
        });
        let facts = Facts {
            specular: any(|facts| facts.specular),
            diffuse: any(|facts| facts.diffuse),
            lambertian: each.iter().all(|(_, facts)| facts.lambertian),
            reciprocal: each.iter().all(|(_, facts)| facts.reciprocal),
            constant,
            fresnel: false,
        };
        Self {
            members,
            facts,
            apart: OnceLock::new(),
        }
    }

    /// All products that are even, or one that is not: what scatters more.
    fn apart(&self) -> &Apart {
        self.apart.get_or_init(|| {
            let mut sets: Vec<(f64, Vec<usize>)> = vec![(0.0, Vec::new())];
            for (number, (weight, bsdf)) in self.members.iter().enumerate() {
                let Some(parts) = bsdf.parts().filter(|_| *weight > 0.0) else {
                    continue;
                };
                let share = weight * typical(parts.product);
                if parts.product.is_even() {
                    sets[0].0 += share;
                    sets[0].1.push(number);
                } else {
                    sets.push((share, vec![number]));
                }
            }
            // Of equals the first.
            let some = sets.into_iter().rev().filter(|(_, numbers)| !numbers.is_empty());
            let best = some.max_by(|a, b| a.0.total_cmp(&b.0));
            let products = best.map_or_else(Vec::new, |(_, products)| products);
            let mut others = Vec::new();
            for (number, (weight, bsdf)) in self.members.iter().enumerate() {
                let left = if products.contains(&number) {
                    bsdf.parts().and_then(|parts| parts.rest)
                } else {
                    Some(bsdf).filter(|bsdf| bsdf.facts().is_diffuse())
                };
                others.extend(left.filter(|_| *weight > 0.0).map(|left| (*weight, Arc::clone(left))));
            }
            let rest =
                (!products.is_empty() && !others.is_empty()).then(|| Arc::new(Self::of(others)) as Arc<dyn Bsdf>);
            Apart { products, rest }
        })
    }

    /// Of mirrored and refracted, scattered and through-scattered light by their shares; None if a share is negative or they exceed 1 together.
    #[must_use]
    pub fn of_shares(specular: [Table; 2], diffuse: [Table; 2]) -> Option<Arc<dyn Bsdf>> {
        let has = |tables: &[Table; 2]| !tables.iter().all(Table::is_zero);
        let both = has(&specular) && has(&diffuse);
        let mirror = has(&specular);
        let [r, t] = specular;
        let specular = Mirror::new(r, t)?;
        let [r, t] = diffuse;
        let diffuse = Lambertian::new(r, t)?;
        Some(if both {
            let members: [Arc<dyn Bsdf>; 2] = [Arc::new(specular), Arc::new(diffuse)];
            Arc::new(Self::new(members.map(|member| (1.0, member)).to_vec())?)
        } else if mirror {
            Arc::new(specular)
        } else {
            Arc::new(diffuse)
        })
    }

    /// From the four tables of shares.
    ///
    /// # Errors
    /// If a table is missing, a share is negative or they exceed 1 together.
    pub fn described(by: &dyn Parameters) -> Result<Arc<dyn Bsdf>, String> {
        let specular = [by.table("specular_reflectance")?, by.table("specular_transmittance")?];
        let diffuse = [by.table("diffuse_reflectance")?, by.table("diffuse_transmittance")?];
        Self::of_shares(specular, diffuse).ok_or_else(|| "shares below 0, or above 1 together".into())
    }

    fn is_sound(&self) -> bool {
        if self.members.iter().map(|(weight, _)| weight).sum::<f64>() <= 1.0 + SLACK {
            return true;
        }
        // Sums of bilinear functions are extreme at the breakpoints of any of them; others are looked at closely.
        let known = self.breakpoints();
        let slack = if known.is_some() { SLACK } else { CLOSE };
        let [angles, wavelengths] = known.unwrap_or_else(|| {
            let angles = (0..=360).map(|i| f64::from(i) * 0.25_f64.to_radians()).collect();
            [angles, (0..=20).map(|i| 380.0 + 20.0 * f64::from(i)).collect()]
        });
        let directions = angles.iter().flat_map(|angle| {
            let (s, c) = angle.sin_cos();
            AROUND
                .iter()
                .flat_map(move |(x, y)| [c, -c].map(|z| Vec3::new(s * x, s * y, z)))
        });
        directions.into_iter().all(|incident| {
            wavelengths.iter().all(|wavelength| {
                let media = Media {
                    wavelength: *wavelength,
                    front: 1.0,
                    back: 1.0,
                };
                self.shares(incident, &media).total() <= 1.0 + slack
            })
        })
    }
}

impl Bsdf for Mixture {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn is_selective(&self) -> bool {
        self.members.iter().any(|(_, bsdf)| bsdf.is_selective())
    }

    #[inline]
    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        if let (Some([mirrored, 0.0, back, through]), cosine) = (self.facts.constant, incident.z.abs()) {
            return Shares {
                specular: [mirrored, 0.0],
                diffuse: [back, through],
                refraction: cosine,
            };
        }
        let mut all = Shares {
            refraction: incident.z.abs(),
            ..Shares::default()
        };
        for (weight, bsdf) in &self.members {
            let own = bsdf.shares(incident, media);
            for side in 0..2 {
                all.specular[side] += weight * own.specular[side];
                all.diffuse[side] += weight * own.diffuse[side];
            }
            if own.specular[1] > 0.0 {
                all.refraction = own.refraction;
            }
        }
        all
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        let own = |(weight, bsdf): &(f64, Arc<dyn Bsdf>)| weight * bsdf.evaluate(incident, scattered, media);
        self.members.iter().map(own).sum()
    }

    fn parts(&self) -> Option<Parts<'_>> {
        let Apart { products, rest } = self.apart();
        (!products.is_empty()).then_some(Parts {
            product: self,
            rest: rest.as_ref(),
        })
    }

    fn draw(&self, incident: Vec3, transmitted: bool, media: &Media, [which, turn]: [f64; 2]) -> Vec3 {
        let side = usize::from(transmitted);
        let share = |(weight, bsdf): &(f64, Arc<dyn Bsdf>)| weight * bsdf.shares(incident, media).diffuse[side];
        let (member, rest) = pick(&self.members, share, which);
        member.draw(incident, transmitted, media, [rest, turn])
    }

    fn is_nothing(&self, media: &Media) -> bool {
        let counts = |member: &&(f64, Arc<dyn Bsdf>)| member.0 > 0.0;
        let whole = self.members.iter().map(|(weight, _)| weight).sum::<f64>() == 1.0;
        whole
            && self
                .members
                .iter()
                .filter(counts)
                .all(|(_, bsdf)| bsdf.is_nothing(media))
    }

    fn breakpoints(&self) -> Option<[Vec<f64>; 2]> {
        let mut all = [Vec::new(), Vec::new()];
        for (_, bsdf) in &self.members {
            for (all, own) in all.iter_mut().zip(bsdf.breakpoints()?) {
                all.extend(own);
            }
        }
        Some(all)
    }

    fn most(&self) -> f64 {
        self.members.iter().map(|(weight, bsdf)| weight * bsdf.most()).sum()
    }

    fn outward(&self, scattered: Vec3, media: &Media) -> Outward {
        let mut all = Outward {
            scattered,
            back: [0.0; 2],
            chances: [0.0; 2],
        };
        for (weight, bsdf) in &self.members {
            let own = bsdf.outward(scattered, media);
            for side in 0..2 {
                all.back[side] += weight * own.back[side];
                all.chances[side] += weight * own.chances[side];
            }
        }
        all
    }

    fn draw_incoming(&self, outward: &Outward, transmitted: bool, media: &Media, [which, turn]: [f64; 2]) -> Vec3 {
        let side = usize::from(transmitted);
        let share =
            |(weight, bsdf): &(f64, Arc<dyn Bsdf>)| weight * bsdf.outward(outward.scattered, media).chances[side];
        let (member, rest) = pick(&self.members, share, which);
        let own = member.outward(outward.scattered, media);
        member.draw_incoming(&own, transmitted, media, [rest, turn])
    }

    fn incoming_light(&self, incident: Vec3, outward: &Outward, media: &Media) -> (f64, f64) {
        let (f, [density]) = self.light(incident, outward, media, |bsdf, own| {
            let (f, density) = bsdf.incoming_light(incident, own, media);
            (f, [density])
        });
        (f, density)
    }

    fn drawn_light(&self, incident: Vec3, outward: &Outward, media: &Media) -> (f64, f64, f64) {
        let (f, [density, about]) = self.light(incident, outward, media, |bsdf, own| {
            let (f, density, about) = bsdf.drawn_light(incident, own, media);
            (f, [density, about])
        });
        (f, density, about)
    }
}

impl Mixture {
    /// f, and means of densities over the members by the chances of each.
    #[inline]
    fn light<const N: usize>(
        &self,
        incident: Vec3,
        outward: &Outward,
        media: &Media,
        of: impl Fn(&dyn Bsdf, &Outward) -> (f64, [f64; N]),
    ) -> (f64, [f64; N]) {
        let side = usize::from((incident.z > 0.0) != (outward.scattered.z > 0.0));
        let (mut f, mut sums, mut total) = (0.0, [0.0; N], 0.0);
        for (weight, bsdf) in &self.members {
            let there = bsdf.outward(outward.scattered, media);
            let chance = weight * there.chances[side];
            if chance > 0.0 {
                let (own, densities) = of(&**bsdf, &there);
                f += weight * own;
                sums = std::array::from_fn(|k| sums[k] + chance * densities[k]);
                total += chance;
            } else {
                f += weight * bsdf.evaluate(incident, outward.scattered, media);
            }
        }
        (f, sums.map(|sum| if total > 0.0 { sum / total } else { 0.0 }))
    }
}

impl Mixture {
    /// The products that are taken together, each with its weight.
    #[inline]
    fn products(&self) -> impl Iterator<Item = (f64, &dyn Product)> {
        self.apart().products.iter().filter_map(|number| {
            let (weight, bsdf) = &self.members[*number];
            Some((*weight, bsdf.parts()?.product))
        })
    }
}

impl Product for Mixture {
    fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2] {
        let mut all = [0.0; 2];
        for (weight, product) in self.products() {
            let own = product.arriving(incident, media);
            all = [all[0] + weight * own[0], all[1] + weight * own[1]];
        }
        all
    }

    fn leaving(&self, scattered: Vec3, media: &Media) -> f64 {
        self.products()
            .next()
            .map_or(1.0, |(_, product)| product.leaving(scattered, media))
    }

    fn is_even(&self) -> bool {
        self.products().all(|(_, product)| product.is_even())
    }
}

/// What a product scatters of light that comes at 45°, from both sides.
fn typical(product: &dyn Product) -> f64 {
    let media = Media {
        wavelength: 555.0,
        front: 1.0,
        back: 1.0,
    };
    let height = std::f64::consts::FRAC_1_SQRT_2;
    let each = [height, -height].map(|z| product.arriving(Vec3::new(height, 0.0, z), &media));
    each.as_flattened().iter().sum()
}

/// The member that a number from 0 to 1 picks by shares, and what is left of the number.
fn pick(
    members: &[(f64, Arc<dyn Bsdf>)],
    share: impl Fn(&(f64, Arc<dyn Bsdf>)) -> f64,
    number: f64,
) -> (&dyn Bsdf, f64) {
    let shares = members.iter().map(&share);
    let possible = || members.iter().zip(shares.clone()).filter(|(_, share)| *share > 0.0);
    if let (Some((only, _)), 1) = (possible().next(), possible().count()) {
        return (&*only.1, number);
    }
    let mut left = number * possible().map(|(_, share)| share).sum::<f64>();
    let mut last = (&*members[0].1, number);
    for (member, share) in possible() {
        last = (&*member.1, part_of(left, share));
        if left < share {
            break;
        }
        left -= share;
    }
    last
}

#[cfg(test)]
impl super::examples::Examples for Mixture {
    const MEDIA: bool = true;

    fn examples() -> Vec<Self> {
        use super::cosine_power::CosinePower;
        use super::interface::Interface;

        let power = |n| Arc::new(CosinePower::new(0.6, n, true, false).expect("sound")) as Arc<dyn Bsdf>;
        let table = |a: f64, b: f64| Table::new(vec![0.0, 1.5], vec![500.0], vec![a, b]).expect("sound");
        let mirror = |r, t| Arc::new(Mirror::new(r, t).expect("at most 1")) as Arc<dyn Bsdf>;
        let diffuse = |r, t| Arc::new(Lambertian::new(r, t).expect("at most 1")) as Arc<dyn Bsdf>;
        let constant = Table::constant;
        [
            // Diffuse + specular, of constant shares and of tables; three diffuse ones; a scattering film on glass with gaps.
            vec![
                (1.0, mirror(constant(0.05), constant(0.0))),
                (1.0, diffuse(constant(0.9), constant(0.0))),
            ],
            vec![
                (1.0, mirror(table(0.1, 0.6), table(0.1, 0.0))),
                (1.0, diffuse(table(0.5, 0.2), table(0.3, 0.1))),
            ],
            vec![
                (0.5, diffuse(constant(0.9), constant(0.0))),
                (0.2, diffuse(constant(0.1), constant(0.9))),
                (0.3, diffuse(table(0.5, 0.2), table(0.3, 0.1))),
            ],
            vec![
                (0.4, Arc::new(Interface) as Arc<dyn Bsdf>),
                (0.6, diffuse(constant(0.3), constant(0.6))),
            ],
            // Two products that are not even.
            vec![
                (0.5, power(2.0)),
                (0.4, power(5.0)),
                (0.1, mirror(constant(0.7), constant(0.0))),
            ],
        ]
        .map(|members| Self::new(members).expect("at most 1"))
        .to_vec()
    }
}
