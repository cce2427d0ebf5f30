//! Optical properties of surfaces: what a surface does to light that arrives on it.
//!
//! One contract for all. Light arrives on a side of the surface at an angle of incidence; a share of it goes into each of
//! four *lobes*, the rest is absorbed. A lobe is specular, in one direction, or diffuse, with a BSDF in 1/sr that is
//! evaluated and sampled by solid angle; cosines are never part of it. Directions of lobes refer to light as it travels:
//! who traces backwards asks for the light that would arrive.

use std::f64::consts::FRAC_1_PI;

use crate::fresnel::fresnel;
use crate::table::Table;

/// Where light goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobe {
    /// Mirrored.
    SpecularReflection,
    /// Refracted by Snell's law, straight on between equal media.
    SpecularTransmission,
    /// Back to the side it came from, with constant luminance.
    DiffuseReflection,
    /// To the other side, with constant luminance.
    DiffuseTransmission,
}

impl Lobe {
    /// In the order of [`Shares`].
    pub const ALL: [Self; 4] = [
        Self::SpecularReflection,
        Self::SpecularTransmission,
        Self::DiffuseReflection,
        Self::DiffuseTransmission,
    ];

    /// Whether the light goes on in a single direction.
    #[must_use]
    pub const fn is_specular(self) -> bool {
        matches!(self, Self::SpecularReflection | Self::SpecularTransmission)
    }

    /// Whether the light passes to the other side.
    #[must_use]
    pub const fn is_transmission(self) -> bool {
        matches!(self, Self::SpecularTransmission | Self::DiffuseTransmission)
    }
}

/// Shares of the arriving flux that go into the lobes, in the order of [`Lobe::ALL`]. They add up to 1 at most.
pub type Shares = [f64; 4];

/// What a surface does to light.
#[derive(Clone, Debug, PartialEq)]
pub enum Finish {
    /// A smooth interface of the media on both sides: Fresnel's equations.
    Interface,
    /// Measured or chosen shares by angle of incidence and wavelength, in the order of [`Lobe::ALL`].
    ///
    /// A diffuse share ρ(θ) spreads evenly over projected solid angle, BSDF ρ(θ)/π: eqs. 4.1 and 4.2 of \[Audenaert2014\].
    Scatter(Box<Scatter>),
}

/// Shares of the lobes by angle of incidence and wavelength.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    tables: [Table; 4],
    /// The shares, if they are the same for all angles and wavelengths.
    constant: Option<Shares>,
    diffuse: bool,
}

/// The light at a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incidence {
    /// Cosine of the angle of incidence, positive.
    pub cosine: f64,
    /// \[nm\].
    pub wavelength: f64,
    /// Refractive index where the light comes from.
    pub n1: f64,
    /// Refractive index on the other side.
    pub n2: f64,
}

impl Finish {
    /// None if a share is negative or they exceed 1 together at some angle and wavelength.
    #[must_use]
    pub fn scatter(shares: [Table; 4]) -> Option<Self> {
        let tables = &shares;
        // Sums of bilinear functions are extreme at the nodes of any of them.
        let collect =
            |pick: fn(&Table) -> &[f64]| -> Vec<f64> { tables.iter().flat_map(|t| pick(t).to_vec()).collect() };
        let angles = collect(|t| t.nodes().0);
        let wavelengths = collect(|t| t.nodes().1);
        let sound = tables.iter().all(|t| t.least() >= 0.0)
            && angles.iter().all(|angle| {
                wavelengths.iter().all(|wavelength| {
                    let sum: f64 = tables.iter().map(|t| t.at(angle.cos(), *wavelength)).sum();
                    sum <= 1.0 + 1e-9
                })
            });
        if !sound {
            return None;
        }
        let constant = tables.iter().all(|t| t.nodes().0.len() * t.nodes().1.len() == 1);
        Some(Self::Scatter(Box::new(Scatter {
            constant: constant.then(|| tables.each_ref().map(Table::least)),
            diffuse: !(tables[2].is_zero() && tables[3].is_zero()),
            tables: shares,
        })))
    }

    /// The shares of the lobes, and the cosine of the angle of refraction (0 beyond the critical angle).
    #[inline]
    #[must_use]
    pub fn shares(&self, light: &Incidence) -> (Shares, f64) {
        match self {
            Self::Interface => {
                let f = fresnel(light.cosine, light.n1, light.n2);
                ([f.reflectance, 1.0 - f.reflectance, 0.0, 0.0], f.cosine)
            }
            Self::Scatter(scatter) => {
                let at = |t: &Table| t.at(light.cosine, light.wavelength);
                let mut shares = scatter.constant.unwrap_or_else(|| scatter.tables.each_ref().map(at));
                let mut across = light.cosine;
                if shares[1] > 0.0 && light.n1 != light.n2 {
                    let f = fresnel(light.cosine, light.n1, light.n2);
                    across = f.cosine;
                    if f.cosine == 0.0 {
                        // There is no refracted direction: the light is totally reflected.
                        shares[0] += shares[1];
                        shares[1] = 0.0;
                    }
                }
                (shares, across)
            }
        }
    }

    /// The shares of the lobes, if they are the same for all light.
    #[must_use]
    pub fn constant(&self) -> Option<Shares> {
        match self {
            Self::Interface => None,
            Self::Scatter(scatter) => scatter.constant,
        }
    }

    /// Whether any light can go into a diffuse lobe.
    #[inline]
    #[must_use]
    pub fn is_diffuse(&self) -> bool {
        match self {
            Self::Interface => false,
            Self::Scatter(scatter) => scatter.diffuse,
        }
    }

    /// Whether any light can be mirrored, or pass without being scattered.
    #[must_use]
    pub fn is_smooth(&self) -> bool {
        match self {
            Self::Interface => true,
            Self::Scatter(scatter) => !(scatter.tables[0].is_zero() && scatter.tables[1].is_zero()),
        }
    }

    /// The BSDF \[1/sr\] of the diffuse lobes for light that arrives as `light` says and leaves on the same side, or on
    /// the other one if `through`.
    #[inline]
    #[must_use]
    pub fn bsdf(&self, light: &Incidence, through: bool) -> f64 {
        match self {
            Self::Interface => 0.0,
            Self::Scatter(scatter) => {
                scatter.tables[if through { 3 } else { 2 }].at(light.cosine, light.wavelength) * FRAC_1_PI
            }
        }
    }
}

/// The lobe that a number from 0 to 1 picks by the shares; None: absorbed. What is left of the number when that is known is
/// again spread evenly from 0 to 1.
#[inline]
#[must_use]
pub fn pick(shares: &Shares, number: f64) -> Option<(Lobe, f64)> {
    let mut sum = 0.0;
    for (share, lobe) in shares.iter().zip(Lobe::ALL) {
        if number < sum + share {
            return Some((lobe, part_of(number - sum, *share)));
        }
        sum += share;
    }
    // Shares that should add up to 1 may fall short of it by rounding.
    (sum >= 1.0 - 1e-12).then(|| {
        let last = shares.iter().rposition(|share| *share > 0.0).unwrap_or(0);
        (Lobe::ALL[last], 0.5)
    })
}

/// The greatest number below 1.
const LAST: f64 = 1.0 - f64::EPSILON / 2.0;

/// Where a number lies between 0 and `share`, as a number from 0 to 1 that is less than 1.
#[inline(always)]
#[must_use]
pub fn part_of(number: f64, share: f64) -> f64 {
    (number / share).min(LAST)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIGHT: Incidence = Incidence {
        cosine: 0.6,
        wavelength: 555.0,
        n1: 1.0,
        n2: 1.5,
    };

    #[test]
    fn an_interface_loses_nothing() {
        for i in 1..=50 {
            let light = Incidence {
                cosine: f64::from(i) / 50.0,
                n1: 1.6,
                ..LIGHT
            };
            let (shares, _) = Finish::Interface.shares(&light);
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            for k in 0..1000 {
                assert!(pick(&shares, (f64::from(k) + 0.5) / 1000.0).is_some());
            }
            assert!(pick(&shares, 1.0 - f64::EPSILON / 2.0).is_some());
        }
    }

    #[test]
    fn lobes_are_picked_by_their_shares_and_the_rest_is_absorbed() {
        let shares = [0.1, 0.2, 0.3, 0.15];
        let n = 100_000;
        let (mut counts, mut rests) = ([0; 5], [0.0; 5]);
        for k in 0..n {
            let lobe = pick(&shares, (f64::from(k) + 0.5) / f64::from(n));
            let place = lobe.map_or(4, |(l, _)| Lobe::ALL.iter().position(|m| *m == l).expect("known"));
            rests[place] += lobe.map_or(0.0, |(_, rest)| rest);
            assert!(lobe.is_none_or(|(_, rest)| (0.0..1.0).contains(&rest)));
            counts[place] += 1;
        }
        assert_eq!(counts, [10_000, 20_000, 30_000, 15_000, 25_000]);
        // What is left of the number is even in each lobe.
        for (rest, count) in rests.iter().zip(counts).take(4) {
            assert!((rest / f64::from(count) - 0.5).abs() < 1e-4, "{rest}");
        }
    }

    #[test]
    fn the_bsdf_times_the_cosine_integrates_to_the_diffuse_share() {
        let part = |a, b| Table::new(vec![0.0, 1.5], vec![500.0], vec![a, b]).expect("sound");
        let finish = Finish::scatter([part(0.1, 0.4), part(0.0, 0.0), part(0.7, 0.2), part(0.1, 0.3)]).expect("sound");
        let (shares, _) = finish.shares(&LIGHT);
        // ∫ f cos θ dω over a hemisphere: the integral of cos θ is π.
        for (through, lobe) in [(false, 2), (true, 3)] {
            assert!((finish.bsdf(&LIGHT, through) * std::f64::consts::PI - shares[lobe]).abs() < 1e-15);
        }
        assert!(finish.is_diffuse() && !Finish::Interface.is_diffuse());
        assert!(Finish::scatter([part(0.5, 0.5), part(0.0, 0.0), part(0.4, 0.6), part(0.0, 0.0)]).is_none());
        assert!(Finish::scatter([part(-0.1, 0.5), part(0.0, 0.0), part(0.4, 0.4), part(0.0, 0.0)]).is_none());
    }
}
