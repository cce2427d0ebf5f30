//! Lobes with a power of the cosine of the angle from the specular direction, or from the normal.

use std::f64::consts::TAU;
use std::sync::Arc;

use etendue_math::Vec3;
use etendue_math::special::{exp, ln};
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::more_numbers::MoreNumbers;

use super::albedo::Albedo;
use super::contract::{Bsdf, Facts, Media, Parameters, Parts, Product, by_cosine};
use super::shares::Shares;

/// f = peak · cosⁿ α, α being the angle from an axis, and 0 beyond 90°; from both sides alike.
#[derive(Clone, Debug)]
pub struct CosinePower {
    peak: f64,
    exponent: f64,
    /// Whether the axis is the normal; otherwise the mirrored direction, or straight on.
    about_normal: bool,
    transmitted: bool,
    albedo: Albedo<1>,
    facts: Facts,
}

/// Two neighbours of Fibonacci: nodes of the quadrature, and what spreads them.
const NODES: [u32; 2] = [28_657, 17_711];

impl CosinePower {
    /// # Errors
    /// If a parameter is out of its range, or more light leaves than arrives.
    pub fn new(peak: f64, exponent: f64, about_normal: bool, transmitted: bool) -> Result<Self, String> {
        if !(peak.is_finite() && peak >= 0.0) {
            return Err(format!("peak is {peak}; it must be at least 0"));
        }
        if !(0.0..=1e6).contains(&exponent) {
            return Err(format!("exponent is {exponent}; it must be from 0 to 1000000"));
        }
        let albedo = Albedo::new(false, |d| {
            if about_normal {
                return [TAU * peak / (exponent + 2.0)];
            }
            let [all, step] = NODES.map(f64::from);
            let across = (d.x * d.x + d.y * d.y).sqrt();
            let each = (0..NODES[0]).map(|k| {
                let u = (f64::from(k) + 0.5) / all;
                let (height, weight) = (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u));
                let [x, _, z] = about_pole(exponent, [height, (f64::from(k) * step / all).fract()]);
                // The axis stands at the angle of incidence.
                weight * (z * d.z - x * across).max(0.0)
            });
            [each.sum::<f64>() / all * TAU * peak / (exponent + 1.0)]
        });
        let most = -albedo.least(|share| -share[0]);
        if most > 1.0 + 1e-6 {
            return Err(format!(
                "{most:.6} of the light is scattered at some angle, more than arrives"
            ));
        }
        let any = most > 0.0;
        Ok(Self {
            peak,
            exponent,
            about_normal,
            transmitted,
            albedo,
            facts: Facts {
                specular: [false; 2],
                diffuse: [any && !transmitted, any && transmitted],
                lambertian: !any,
                // About the normal, only what leaves matters.
                reciprocal: !any || (!about_normal && !transmitted),
                constant: None,
                fresnel: false,
            },
        })
    }

    /// From `peak`, `exponent`, `about_normal` and `transmitted` (0 or 1).
    ///
    /// # Errors
    /// As [`CosinePower::new`].
    pub fn described(by: &dyn Parameters) -> Result<Arc<dyn Bsdf>, String> {
        let flag = |key: &str| by.number(key).map(|value| value != 0.0);
        Ok(Arc::new(Self::new(
            by.number("peak")?,
            by.number("exponent")?,
            flag("about_normal")?,
            flag("transmitted")?,
        )?))
    }

    /// The axis of the lobe.
    fn axis(&self, incident: Vec3) -> Vec3 {
        let up = (incident.z > 0.0) != self.transmitted;
        if self.about_normal {
            Vec3::new(0.0, 0.0, if up { 1.0 } else { -1.0 })
        } else {
            let height = incident.z.abs();
            Vec3::new(-incident.x, -incident.y, if up { height } else { -height })
        }
    }
}

/// A direction about +z with density (n + 1) cosⁿ α/2π.
fn about_pole(exponent: f64, [number, turn]: [f64; 2]) -> [f64; 3] {
    let fall = ln((1.0 - number).max(f64::MIN_POSITIVE)) / (exponent + 1.0);
    let cosine = exp(fall);
    let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
    let (s, c) = sin_cos_turns(turn);
    [sine * c, sine * s, cosine]
}

/// How often is tried again for a direction on the right side.
const TRIES: u32 = 1_000_000;

impl Bsdf for CosinePower {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn is_selective(&self) -> bool {
        false
    }

    fn shares(&self, incident: Vec3, _media: &Media) -> Shares {
        let mut diffuse = [0.0; 2];
        diffuse[usize::from(self.transmitted)] = self.albedo.at(incident)[0].min(1.0);
        Shares {
            specular: [0.0; 2],
            diffuse,
            refraction: incident.z.abs(),
        }
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, _media: &Media) -> f64 {
        if ((incident.z > 0.0) != (scattered.z > 0.0)) != self.transmitted {
            return 0.0;
        }
        let cosine = self.axis(incident).dot(scattered);
        if cosine > 0.0 {
            self.peak * exp(self.exponent * ln(cosine))
        } else {
            0.0
        }
    }

    fn parts(&self) -> Option<Parts<'_>> {
        self.about_normal.then_some(Parts {
            product: self,
            rest: None,
        })
    }

    fn draw(&self, incident: Vec3, transmitted: bool, _media: &Media, numbers: [f64; 2]) -> Vec3 {
        let up = (incident.z > 0.0) != transmitted;
        let side = if up { 1.0 } else { -1.0 };
        let axis = self.axis(incident);
        // Two directions across it.
        let x = if axis.z.abs() < 0.999 {
            Vec3::new(-axis.y, axis.x, 0.0).normalized()
        } else {
            Vec3::new(1.0, 0.0, 0.0).cross(axis).normalized()
        };
        let y = axis.cross(x);
        let mut more = MoreNumbers::new(numbers);
        let mut pair = numbers;
        for _ in 0..TRIES {
            let [a, b, c] = about_pole(self.exponent, pair);
            let d = (x * a + y * b + axis * c).normalized();
            if c > 0.0 && d.z * side > more.draw() {
                return d;
            }
            pair = more.pair();
        }
        by_cosine(up, numbers)
    }
}

/// About the normal.
impl Product for CosinePower {
    fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2] {
        self.shares(incident, media).diffuse
    }

    fn leaving(&self, scattered: Vec3, _media: &Media) -> f64 {
        0.5 * (self.exponent + 2.0) * exp(self.exponent * ln(scattered.z.abs().max(f64::MIN_POSITIVE)))
    }

    fn is_even(&self) -> bool {
        self.exponent == 0.0
    }
}

#[cfg(test)]
impl super::examples::Examples for CosinePower {
    fn examples() -> Vec<Self> {
        [
            (0.5, 3.0, false, false),
            (1.2, 6.5, true, true),
            (0.8, 4.0, false, true),
            (0.6, 2.0, true, false),
        ]
        .map(|(peak, n, about_normal, transmitted)| Self::new(peak, n, about_normal, transmitted).expect("sound"))
        .into()
    }

    // The edge at 90° from the axis.
    const QUADRATURE: f64 = 1e-4;
    const LATTICE: bool = true;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn total_scatter_is_that_of_closed_forms() {
        let media = Media {
            wavelength: 555.0,
            front: 1.0,
            back: 1.0,
        };
        // About the normal, or at normal incidence: 2π peak/(n + 2). For n = 1 along the surface: (2/3) peak, ∫ x⁺ z⁺ dΩ.
        for (exponent, about_normal, height, expected) in [
            (3.0, true, 0.2, TAU / 5.0),
            (3.0, false, 1.0, TAU / 5.0),
            (40.0, false, 1.0, TAU / 42.0),
            (1.0, false, 0.0, 2.0 / 3.0),
        ] {
            let bsdf = CosinePower::new(0.3, exponent, about_normal, false).expect("sound");
            let incident = Vec3::new(-(1.0_f64 - height * height).sqrt(), 0.0, f64::max(height, 1e-9));
            let found = bsdf.shares(incident, &media).diffuse[0] / 0.3;
            assert!(
                (found - expected).abs() < 1e-5,
                "{exponent} {height}: {found} {expected}"
            );
        }
    }

    #[test]
    fn impossible_parameters_are_refused() {
        assert!(CosinePower::new(-1.0, 1.0, true, false).is_err());
        assert!(CosinePower::new(0.1, f64::NAN, true, false).is_err());
        assert!(CosinePower::new(1.0, 0.0, true, false).is_err_and(|e| e.contains("more than arrives")));
    }
}
